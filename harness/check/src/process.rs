//! Runs each rule of calls in a separate process that `host::guard` watches, so that an FMU that crashes, hangs or exits
//! the process causes a finding. The process reports each call before it makes the call, and at the end its findings.

use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use host::guard::{self, Cause, Limits, Output};
use host::xml::Element;

use super::description::Description;
use super::findings::Findings;
use super::options::Options;
use super::rule::{Check, CheckCalls, Rule};
use super::rules::fmi2::RULES;
use super::trace::{self, Answer, Crash};
use super::under_test::{Tested, UnderTest, Unusable};

pub const SUBCOMMAND: &str = "check-calls";
/// Number of rules in which a call did not return, after which no further rules of calls are run.
const HANGS: usize = 2;
/// Time limit of a single call of the FMU. It is shorter if the time limit of the rule is shorter. With this limit
/// the [`HANGS`] endless calls, after which the check stops calling the FMU, take at most about 10 s.
const CALL: Duration = Duration::from_secs(4);
const PART: f64 = 15.0;
/// Largest file that an FMU may write, bytes. It is small because several rules run at the same time.
const FILE: u64 = 8 << 20;
const OPENS: &str = "load.opens";
/// Number of bytes of the FMU's printed output that a finding quotes.
const PRINTED: usize = 200;

#[derive(Default)]
pub struct SoFar {
    hung: AtomicUsize,
    /// Reason why the binary cannot be loaded. The process of the first rule that finds the reason stores it here, so that
    /// no other rule tries to load the binary.
    lost: OnceLock<String>,
    pub bug: OnceLock<String>,
}

#[derive(Clone, Copy, Debug)]
pub struct Unpacked<'a> {
    pub path: &'a Path,
    pub directory: &'a Path,
    /// File with the parsed description ([`Element::pack`]), because parsing a large modelDescription.xml
    /// takes longer than most rules.
    pub description: &'a Path,
}

/// Checks `rule` in a separate process and stores its findings. Skips the rule if earlier rules have found that the
/// binary cannot be loaded, or that too many calls never return; `so_far` contains these results.
pub fn check(
    rule: &'static Rule,
    fmu: Unpacked,
    options: &Options,
    so_far: &SoFar,
    findings: &mut Findings,
) {
    if so_far.hung.load(Ordering::Relaxed) >= HANGS {
        return findings.skip(format!("{HANGS} rules have ended in endless calls already"));
    }
    if let Some(why) = so_far.lost.get().filter(|_| rule.id != OPENS) {
        return findings.skip(why);
    }
    match run(rule, fmu, options, so_far, findings) {
        Ok(true) => {
            so_far.hung.fetch_add(1, Ordering::Relaxed);
        }
        Ok(false) => {}
        Err(error) => {
            findings.at("hubslosh").fail(format!("the calls could not be made: {error:#}"))
        }
    }
}

/// Runs the process of a rule. Returns true if it had to be killed.
fn run(
    rule: &'static Rule,
    fmu: Unpacked,
    options: &Options,
    so_far: &SoFar,
    findings: &mut Findings,
) -> Result<bool> {
    let seconds = options.limit.as_secs_f64().to_string();
    let arguments = [
        guard::OPTION.as_ref(),
        SUBCOMMAND.as_ref(),
        rule.id.as_ref(),
        fmu.directory.as_os_str(),
        fmu.path.as_os_str(),
        fmu.description.as_os_str(),
        seconds.as_ref(),
    ];
    let limits = Limits {
        call: options.limit.div_f64(PART).max(CALL).min(options.limit),
        total: Some(options.limit),
        memory: guard::MEMORY,
        file: FILE,
    };
    let (mut doing, mut crash) = (LOADING.to_string(), Crash::Error);
    let (mut done, mut is_damaged) = (None, false);
    let hear = |answer: &[u8]| match serde_json::from_slice(answer) {
        Ok(Answer::Doing(what, then)) => (doing, crash) = (what, then),
        Ok(Answer::Done(found)) => done = Some(found),
        // A damaged message means that the FMU has overwritten memory, because the program sends nothing else.
        Err(_) => is_damaged = true,
    };
    let ended = guard::run(&options.program, arguments, &limits, Output::Kept, hear)?;
    let [stdout, stderr] = &ended.printed;
    let last = ended.last_line().map(|line| format!("; it printed {line:?}")).unwrap_or_default();
    let endless = |limit: Duration| {
        let seconds = limit.as_secs_f64();
        format!(
            "the calls of this rule have not ended after {seconds:.0} s (required: every call returns; --limit allows more time)"
        )
    };
    let (why, was_ended) = match &ended.cause {
        Cause::Done(_) if is_damaged => {
            let why = "the findings cannot be read, because the FMU has written into the memory of the host";
            (format!("{why} (allowed: writing into the FMU's own memory)"), false)
        }
        Cause::Done(_) => ("the process ended without a result".into(), false),
        Cause::Ended(status) => {
            (format!("the process ended ({status}{last}; required: every call returns)"), false)
        }
        Cause::EndlessCall => (endless(limits.call), true),
        Cause::TooLong => (endless(options.limit), true),
        Cause::Hoard => {
            let most = limits.memory >> 20;
            let why = "the FMU's temporary files or its shared memory take";
            (format!("{why} more than {most} MiB (allowed: less)"), true)
        }
        Cause::Interfered => {
            let why = "the FMU writes to a file or connection of the host, or closes it";
            (format!("{why} (allowed: files and connections that the FMU has opened)"), true)
        }
        Cause::Panicked(report) => {
            let report = so_far.bug.get_or_init(|| report.clone());
            findings.skip(report);
            return Ok(false);
        }
        Cause::Flood => {
            (format!("the FMU prints more than {} bytes (allowed: nothing)", guard::FLOOD), true)
        }
    };
    let is_lost = done.is_none() && doing == LOADING;
    if is_lost {
        let _ = so_far.lost.set(format!("the process ended while {LOADING}: {why}"));
    }
    match done {
        Some(found) => {
            *findings = found;
            if rule.id == "host.silent" {
                let start = |bytes| -> String {
                    String::from_utf8_lossy(bytes).chars().take(PRINTED).collect()
                };
                if !stdout.is_empty() {
                    findings.at("stdout").fail(format!("the FMU prints {:?}", start(stdout)));
                }
                if !stderr.is_empty() {
                    findings.at("stderr").add(format!("the FMU prints {:?}", start(stderr)));
                }
            }
        }
        // Only the rule `OPENS` reports that the process ended while the FMU was loaded. All other rules would repeat it.
        None if is_lost && rule.id != OPENS => {
            findings.skip_for(OPENS, format!("the process ended while {doing}: {why}"));
        }
        None => report_crash(findings, doing, why, crash),
    }
    Ok(was_ended)
}

fn report_crash(findings: &mut Findings, doing: String, text: String, crash: Crash) {
    match crash {
        Crash::Error => {
            findings.stopped_at = Some(doing.clone());
            findings.at(doing).fail(text);
        }
        Crash::Open => findings.at(doing).add(text),
        Crash::ReportedBy(rule) => findings.skip_for(&rule, format!("{doing}: {text}")),
    }
}

const LOADING: &str = "loading the binary";

/// Checks the rule `id` inside the process of the rule and sends the findings to the parent process, which
/// ends this process after `limit`.
pub fn check_in_child(id: &str, fmu: Unpacked, limit: Duration) -> Result<()> {
    let Unpacked { path, directory, description } = fmu;
    // The description is leaked, because it is needed until the process ends.
    let mut packed: &'static [u8] = std::fs::read(description)?.leak();
    let root = Element::unpack(&mut packed)
        .context("the file with the parsed description has changed since it was written")?;
    let description: &'static Description = Box::leak(Box::new(Description::new(root)));
    let rules = if description.is_fmi3() { super::rules::fmi3::RULES } else { RULES };
    let rule = rules.iter().find(|rule| rule.id == id).context("no such rule")?;
    trace::announce_call(LOADING, Crash::Error);
    // A rule that is slow, but not stuck, reports its findings before the time limit.
    let deadline = Instant::now() + limit.mul_f64(0.75);
    trace::done(match rule.check {
        Check::Calls(check) => {
            call(rule, check, UnderTest::open(directory, path, description, deadline))
        }
        Check::Calls3(check) => {
            call(rule, check, UnderTest::open(directory, path, description, deadline))
        }
        _ => anyhow::bail!("the rule {id} makes no calls of the binary"),
    })
}

/// Checks a rule by calls of the FMU, which may be impossible to load.
fn call<V: Tested>(rule: &Rule, check: CheckCalls<V>, fmu: Result<UnderTest<V>>) -> Findings {
    let mut findings = Findings::new(rule.severity);
    match fmu {
        Err(error) if rule.id == OPENS => findings.at("the binary").add(format!("{error:#}")),
        Err(error) => findings.skip(format!("the FMU cannot be loaded: {error:#}")),
        Ok(fmu) => {
            if let Err(error) = check(&fmu, &mut findings) {
                match error.downcast_ref::<Unusable>() {
                    Some(unusable) if unusable.rule != rule.id => {
                        findings.skip_for(unusable.rule, unusable.to_string());
                    }
                    _ => {
                        findings.stopped_at = Some(fmu.last_call());
                        findings.at(fmu.last_call()).add(format!("{error:#}"));
                    }
                }
            }
            // The call is announced, so that a crash or a hang while the binary is unloaded is reported with these words.
            fmu.announce("unloading the binary");
        }
    }
    findings
}

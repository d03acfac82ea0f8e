//! Rules of calls run in a process of their own: an FMU that crashes, hangs or ends the process is
//! a finding. What the process is about to do and what it found go through a file, because the FMU
//! may write to stdout.

use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

use super::under_test::{FmuUnderTest, Unusable};
use super::{Check, Findings, Options, RULES, Rule};

/// The hidden subcommand of `hubslosh`.
pub const SUBCOMMAND: &str = "check-calls";
/// After so many endless calls no more are made: the check would take for ever as well.
const HANGS: usize = 3;
/// Bytes shown of what an FMU prints.
const PRINTED: usize = 200;

/// What it is if the process ends, or does not end, during what comes next.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Crash {
    /// An error, whatever the rule.
    Error,
    /// As bad as the rule: the standard does not say what such a call does.
    Open,
    /// What this rule tells.
    ToldBy(String),
}

/// One line of the file.
#[derive(Serialize, Deserialize)]
enum Line {
    /// What comes next.
    Doing(String, Crash),
    /// All that was found; the last line.
    Done(Findings),
}

/// Where the process writes what it does.
pub struct Trace(File);

impl Trace {
    fn write(&self, line: &Line) -> Result<()> {
        let mut text = serde_json::to_string(line)?;
        text.push('\n');
        // One call without a buffer: what was written is there when the process crashes.
        (&self.0).write_all(text.as_bytes())?;
        Ok(())
    }

    /// Another hand on the same file.
    pub fn again(&self) -> Result<Trace> {
        Ok(Trace(self.0.try_clone()?))
    }

    /// Tells what comes next.
    pub fn doing(&self, what: &str, crash: Crash) {
        // Without it a crash is told less well; that is all.
        let _ = self.write(&Line::Doing(what.into(), crash));
    }

    /// Tells what was found; nothing comes after it.
    pub fn done(&self, findings: Findings) -> Result<()> {
        self.write(&Line::Done(findings))
    }
}

/// Looks at one rule in a process of its own; `path` is what the FMU is called, `directory` where it
/// is unpacked.
pub fn check(
    rule: &'static Rule,
    directory: &Path,
    path: &Path,
    options: &Options,
    hung: &AtomicUsize,
    findings: &mut Findings,
) {
    if hung.load(Ordering::Relaxed) >= HANGS {
        return findings.skip(format!("{HANGS} rules have ended in endless calls already"));
    }
    match run(rule, directory, path, options, findings) {
        Ok(true) => {
            hung.fetch_add(1, Ordering::Relaxed);
        }
        Ok(false) => {}
        Err(error) => findings.fail("hubslosh", format!("the calls could not be made: {error:#}")),
    }
}

/// Whether it had to be killed.
fn run(
    rule: &'static Rule,
    directory: &Path,
    path: &Path,
    options: &Options,
    findings: &mut Findings,
) -> Result<bool> {
    let folder = tempfile::tempdir().context("no temporary directory")?;
    let answer = folder.path().join("answer");
    let (stdout, stderr) = (folder.path().join("stdout"), folder.path().join("stderr"));
    let mut child = Command::new(&options.program)
        .arg(SUBCOMMAND)
        .arg(rule.id)
        .arg(directory)
        .arg(path)
        .arg(&answer)
        .arg(options.limit.as_secs_f64().to_string())
        .stdin(Stdio::null())
        .stdout(File::create(&stdout)?)
        .stderr(File::create(&stderr)?)
        .spawn()
        .with_context(|| format!("{} cannot be run", options.program.display()))?;
    let started = Instant::now();
    let ended = loop {
        if let Some(status) = child.try_wait()? {
            break Some(status);
        }
        if started.elapsed() > options.limit {
            // It may have ended just now; either is fine.
            let _ = child.kill();
            child.wait()?;
            break None;
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let lines = std::fs::read_to_string(&answer).unwrap_or_default();
    let (mut doing, mut crash) = (LOADING.to_string(), Crash::Error);
    let mut done = None;
    for line in lines.lines() {
        match serde_json::from_str(line) {
            Ok(Line::Doing(what, then)) => (doing, crash) = (what, then),
            Ok(Line::Done(found)) => done = Some(found),
            Err(_) => {} // cut off by the crash
        }
    }
    let read = |file| std::fs::read(file).unwrap_or_default();
    let (stdout, stderr) = (read(&stdout), read(&stderr));
    match (done, ended) {
        (Some(found), _) => {
            *findings = found;
            if rule.id == "host.silent" {
                let start = |bytes| -> String {
                    String::from_utf8_lossy(bytes).chars().take(PRINTED).collect()
                };
                if !stdout.is_empty() {
                    findings.fail("stdout", format!("it prints {:?}", start(&stdout)));
                }
                if !stderr.is_empty() {
                    findings.add("stderr", format!("it prints {:?}", start(&stderr)));
                }
            }
        }
        // One rule tells it; the others would say the same.
        (None, Some(status)) if doing == LOADING && rule.id != "load.opens" => {
            findings.skip(format!("the process ended while {doing} ({status})"));
        }
        (None, Some(status)) => {
            let printed = [stdout, stderr].concat();
            let text = String::from_utf8_lossy(&printed);
            let last = text.lines().rfind(|line| !line.trim().is_empty());
            let last = last.map(|line| format!("; it printed {line:?}")).unwrap_or_default();
            let text = format!("the process ended ({status}{last}); allowed: every call returns");
            tell_crash(findings, doing, text, crash);
        }
        (None, None) => {
            let text = format!(
                "no end after {:.0} s (allowed: every call returns; --limit gives more time)",
                options.limit.as_secs_f64()
            );
            tell_crash(findings, doing, text, crash);
        }
    }
    Ok(ended.is_none())
}

fn tell_crash(findings: &mut Findings, doing: String, text: String, crash: Crash) {
    match crash {
        Crash::Error => findings.fail(doing, text),
        Crash::Open => findings.add(doing, text),
        Crash::ToldBy(rule) => findings.skip_for(&rule, format!("{doing}: {text}")),
    }
}

/// What the process does first.
const LOADING: &str = "loading the binary";

/// The other side: looks at the rule and writes what it finds to `answer`; it is ended after `limit`.
pub fn answer(
    id: &str,
    directory: &Path,
    path: &Path,
    answer: &Path,
    limit: Duration,
) -> Result<()> {
    let rule = RULES.iter().find(|rule| rule.id == id).context("no such rule")?;
    let Check::Calls(check) = rule.check else { anyhow::bail!("{id} makes no calls") };
    let trace = Trace(File::create(answer)?);
    trace.doing(LOADING, Crash::Error);
    let mut findings = Findings::new(rule.severity);
    // a rule that is slow, and not hung, shall tell what it has found by then
    let deadline = Instant::now() + limit.mul_f64(0.75);
    match FmuUnderTest::open(directory, path, trace, deadline) {
        Err(error) if rule.id == "load.opens" => findings.add("the binary", format!("{error:#}")),
        Err(error) => findings.skip(format!("it cannot be loaded: {error:#}")),
        Ok(fmu) => {
            if let Err(error) = check(&fmu, &mut findings) {
                match error.downcast_ref::<Unusable>() {
                    Some(unusable) if unusable.rule != rule.id => {
                        findings.skip_for(unusable.rule, unusable.to_string());
                    }
                    _ => findings.add(fmu.now(), format!("{error:#}")),
                }
            }
            fmu.doing("unloading the binary");
            let trace = fmu.close();
            return trace.done(findings);
        }
    }
    Trace(File::options().append(true).open(answer)?).done(findings)
}

//! Checks an FMU against the rules of FMI 2.0 or 3.0 and against what hosts expect (`hubslosh check`).
//!
//! Every rule is an entry of a table, [`RULES`] for FMI 2.0 and [`rules::fmi3::RULES`] for FMI 3.0, with the function
//! that checks it. Rules of the archive, the description and the binaries only read files. Rules of calls load the
//! binary for this platform and call it as hosts do; each of them runs in a separate process, so that a crash or a hang
//! is a finding and does not end the check.

pub mod archive;
pub mod arrays;
pub mod binaries;
pub mod definitions;
pub mod dependencies;
pub mod description;
pub mod events;
pub mod exchange;
pub mod findings;
pub mod integrate;
pub mod json;
pub mod junit;
pub mod kinds;
pub mod life;
pub mod log;
pub mod memory;
pub mod options;
pub mod portable;
pub mod process;
pub mod ranges;
pub mod reading;
pub mod report;
pub mod rule;
pub mod rules;
pub mod sarif;
pub mod schema;
pub mod states;
pub mod steps;
pub mod structure;
pub mod trace;
pub mod tunable;
pub mod under_test;
pub mod units;
pub mod v3;
pub mod values;
pub mod variables;

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use files::temporary;
use host::xml::Element;
use rayon::prelude::*;

use self::rules::fmi3;

pub use self::archive::Archive;
pub use self::binaries::Binaries;
pub use self::description::Description;
pub use self::findings::{Finding, Findings, Severity};
pub use self::options::Options;
pub use self::report::{Outcome, Report};
pub use self::rule::{Check, Rule};
pub use self::rules::fmi2::RULES;
pub use self::under_test::FmuUnderTest;

#[derive(serde::Serialize)]
pub struct Statement {
    fmi: &'static str,
    #[serde(flatten)]
    rule: &'static Rule,
}

pub fn rules() -> Vec<Statement> {
    let second = RULES.iter().map(|rule| Statement { fmi: "2.0", rule });
    second.chain(fmi3::RULES.iter().map(|rule| Statement { fmi: "3.0", rule })).collect()
}

/// Rules that explain why a file cannot be opened as an FMU. If the file cannot be opened, their findings are reported
/// even if the user has not selected these rules.
const OPENING: [&str; 10] = [
    "zip.readable",
    "zip.methods",
    "zip.names",
    "zip.links",
    "zip.duplicates",
    "zip.description",
    "xml.well_formed",
    "xml.encoding",
    "xml.size",
    "xml.doctype",
];

/// Checks an FMU by all rules, or by the rules that `options` selects. `progress` receives the number of rules that
/// have been checked so far by calls of the FMU.
///
/// # Errors
///
/// If the file cannot be read, a selected rule does not exist, or a temporary folder cannot be written. Faults of the
/// FMU are findings, not errors.
pub fn check(path: &Path, options: &Options, progress: impl Fn(usize) + Sync) -> Result<Report> {
    let known = |name: &str| RULES.iter().chain(fmi3::RULES).any(|rule| is_selected(rule, name));
    let unknown: Vec<_> = options.only.iter().filter(|name| !known(name)).cloned().collect();
    if !unknown.is_empty() {
        let all = RULES.iter().chain(fmi3::RULES);
        let groups: BTreeSet<_> = all.filter_map(|rule| rule.id.split('.').next()).collect();
        bail!(
            "no rule is called {} (groups of rules: {}; `hubslosh check --rules` lists all)",
            unknown.join(", "),
            Vec::from_iter(groups).join(", ")
        );
    }
    let archive = Archive::read(path)?;
    let description = archive.file("modelDescription.xml").map(Description::read);
    let description = match &description {
        Some(Ok(description)) => Ok(description),
        Some(Err(why)) => Err(format!("modelDescription.xml cannot be read: {why}")),
        None => Err(archive::NO_DESCRIPTION.to_string()),
    };
    // FMI 3.0 has another table of rules. A file of FMI 1.0 breaks one rule, whose finding says so.
    let described = description.as_ref().ok().copied();
    let table = if described.is_some_and(Description::is_fmi3) { fmi3::RULES } else { RULES };
    let binaries = Binaries::new(&archive, described);
    let is_foreign = described.is_some_and(|d| d.other_version().is_some());
    let is_wanted = |rule: &&'static Rule| match is_foreign {
        true => rule.id == "xml.fmi_version",
        false => options.only.is_empty() || options.only.iter().any(|o| is_selected(rule, o)),
    };
    let selected: Vec<&'static Rule> = table.iter().filter(is_wanted).collect();
    let calls = selected.iter().filter(|rule| rule.is_of_calls()).count();
    let offers = |name: &str| described.is_some_and(|d| d.interface(name).is_some());
    let exchanges = offers("ModelExchange");
    let callable = match &description {
        Err(why) => Err(why.clone()),
        Ok(d) if d.is_fmi3() && !exchanges && !offers("CoSimulation") => {
            Err("the FMU offers neither Co-Simulation nor Model Exchange, and the check calls no other interface".into())
        }
        Ok(d) if d.has_clocks() && !exchanges => {
            Err("the FMU has clocks, and the check does not call Co-Simulation of FMUs with clocks".into())
        }
        _ if binaries.own_binary().is_none() => {
            Err(format!("the FMU has no binary for this platform, {}", binaries.own_folder()))
        }
        Ok(description) => Ok(write_description(&description.root)?),
    };
    let so_far = process::SoFar::default();
    let one = |rule: &&'static Rule| {
        let started = std::time::Instant::now();
        let mut findings = Findings::new(rule.severity);
        match (&rule.check, &description) {
            (Check::Archive(check), _) => check(&archive, &mut findings),
            (Check::Description(check), Ok(description)) => check(description, &mut findings),
            // `zip.description` reports a missing description, and `xml.well_formed` one that is not well-formed.
            (Check::Description(_), Err(why)) => findings.skip(why.clone()),
            (Check::Binaries(check), _) => check(&binaries, &mut findings),
            (Check::Calls(_) | Check::Calls3(_), _) => {
                match &callable {
                    Ok((_, description)) => {
                        let directory = archive.directory();
                        let fmu = process::Unpacked { path, directory, description };
                        process::check(rule, fmu, options, &so_far, &mut findings);
                    }
                    Err(why) => findings.skip(why.clone()),
                }
                progress(calls);
            }
        }
        Outcome { rule, findings, time: started.elapsed() }
    };
    let mut outcomes: Vec<Outcome> = selected.par_iter().map(one).collect();
    name_each_cause_once(&mut outcomes);
    restore_unreported_faults(&mut outcomes);
    let unchecked = unchecked(&outcomes, &options.only);
    let unopened = archive.refusal().or(description.as_ref().err().cloned());
    if let Some(why) = unopened {
        let is_selected = |rule: &Rule| selected.iter().any(|selected| selected.id == rule.id);
        let others = table.iter().filter(|rule| OPENING.contains(&rule.id) && !is_selected(rule));
        let mut others: Vec<Outcome> = others.map(|rule| one(&rule)).collect();
        others.retain(|outcome| outcome.findings.has_error());
        outcomes.extend(others);
        if !outcomes.iter().any(|outcome| outcome.findings.has_error())
            && let Some(rule) = table.iter().find(|rule| rule.id == OPENING[0])
        {
            outcomes.retain(|outcome| outcome.rule.id != rule.id);
            let mut findings = Findings::new(rule.severity);
            findings
                .at("the archive")
                .fail(format!("the archive cannot be opened as an FMU: {why}"));
            outcomes.push(Outcome { rule, findings, time: Duration::ZERO });
        }
        let place = |outcome: &Outcome| table.iter().position(|rule| rule.id == outcome.rule.id);
        outcomes.sort_by_key(place);
    }
    let bug = so_far.bug.into_inner();
    Ok(Report { path: path.to_path_buf(), outcomes, unchecked, bug })
}

fn write_description(root: &Element) -> Result<(temporary::Folder, PathBuf)> {
    let folder = temporary::Folder::new()?;
    let path = folder.path().join("description");
    let mut bytes = Vec::new();
    root.pack(&mut bytes);
    std::fs::write(&path, bytes)
        .context("the parsed modelDescription.xml cannot be written to the temporary folder from which the check's processes read it: make space there or set TMPDIR to another folder")?;
    Ok((folder, path))
}

/// Returns the message that no rule was checked, or `None` if at least one of the rules in `outcomes` was checked.
/// `only` are the rules that the user has selected; the message names them.
fn unchecked(outcomes: &[Outcome], only: &[String]) -> Option<String> {
    let is_skipped = |o: &Outcome| o.findings.skipped.is_some() && o.findings.list.is_empty();
    if !outcomes.iter().all(is_skipped) {
        return None;
    }
    let why = outcomes.first().and_then(|outcome| outcome.findings.skipped.as_deref());
    let selection = only.join(",");
    Some(match (outcomes.len(), why) {
        (0, _) | (_, None) => format!(
            "nothing was checked: this version of FMI has no rule {selection} (`hubslosh check --rules` lists the \
             rules of each version)"
        ),
        (n, Some(why)) => format!(
            "nothing was checked: all {n} rules of {selection} were skipped, the first because {why} (select rules \
             that apply, or check all of them without --only)"
        ),
    })
}

/// Pairs of the beginning of a call's description and the rule that owns this call. If the call fails, only the owner
/// reports this; other rules that need the call are skipped.
const OWNERS: [(&str, &str); 6] = [
    ("fmi2Instantiate", "load.instance"),
    ("fmi2SetupExperiment", "load.initialises"),
    ("fmi2EnterInitializationMode", "load.initialises"),
    ("fmi2ExitInitializationMode", "load.initialises"),
    ("a step from", "steps.run"),
    ("a step from", "exchange.run"),
];

/// Makes sure that a failing call is reported only once, although it stops every rule that makes this call.
/// [`OWNERS`] defines which rule reports a call; a call without an owner is reported by the first rule that it
/// stopped. All other rules that make the call are skipped.
fn name_each_cause_once(outcomes: &mut [Outcome]) {
    let alike = |text: &str| text.replace(|c: char| c.is_ascii_digit() || ".-+e".contains(c), "");
    // rules whose only finding is the call at which they stopped, as positions in the table
    let stopped: Vec<(usize, String, String)> = (outcomes.iter().enumerate())
        .filter_map(|(n, outcome)| {
            let [finding] = &outcome.findings.list[..] else { return None };
            let at = outcome.findings.stopped_at.as_deref()?;
            (finding.severity == Severity::Error).then(|| (n, at.into(), finding.text.clone()))
        })
        .collect();
    for (n, at, text) in &stopped {
        let owner = stopped.iter().find(|(other, place, why)| {
            let rule = outcomes[*other].rule.id;
            OWNERS.iter().any(|(begin, owner)| *owner == rule && at.starts_with(begin))
                && (alike(place), alike(why)) == (alike(at), alike(text))
        });
        let first = || stopped.iter().find(|(_, place, why)| (place, why) == (at, text));
        if let Some((cause, ..)) = owner.or_else(first)
            && cause != n
        {
            let rule = outcomes[*cause].rule.id;
            let findings = &mut outcomes[*n].findings;
            findings.list.clear();
            findings.skip_for(rule, format!("{at}: {text}"));
        }
    }
}

/// Makes sure that each fault is reported. A rule that meets a fault is skipped if another rule is responsible for
/// this fault. If the other rule was checked without a finding, the skipped rule gets the finding.
fn restore_unreported_faults(outcomes: &mut [Outcome]) {
    let silent: Vec<&str> = outcomes
        .iter()
        .filter(|o| o.findings.list.is_empty() && o.findings.skipped.is_none())
        .map(|o| o.rule.id)
        .collect();
    for findings in outcomes.iter_mut().map(|outcome| &mut outcome.findings) {
        if findings.reported_by.as_deref().is_some_and(|rule| silent.contains(&rule))
            && let Some(why) = findings.skipped.take()
        {
            findings.at("a run of this rule").add(why);
        }
    }
}

fn is_selected(rule: &Rule, name: &str) -> bool {
    rule.id == name || rule.id.strip_prefix(name).is_some_and(|rest| rest.starts_with('.'))
}

/// Renders the rules of one FMI version as Markdown tables, one per group, for the book.
pub fn table(rules: &[Rule]) -> String {
    let mut text = String::new();
    let mut group = "";
    for rule in rules {
        let (this, _) = rule.id.split_once('.').unwrap_or((rule.id, ""));
        if this != group {
            group = this;
            text.push_str("\n| rule | what must hold | source | |\n| --- | --- | --- | --- |\n");
        }
        let _ = writeln!(
            text,
            "| `{}` | {} | {} | {} |",
            rule.id,
            rule.title,
            rule.source,
            rule.severity.name()
        );
    }
    text.trim_start().to_string()
}

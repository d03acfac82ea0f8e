//! `hubslosh check`: does an FMU keep the rules of FMI 2.0 or 3.0, and those that hosts add?
//!
//! Every rule is an entry of a table, [`RULES`] for FMI 2.0, [`v3::RULES`] for 3.0, with the function that looks. Rules of the
//! archive, the description and the binaries look at the file. Rules of calls load the binary for
//! this platform and call it as hosts do, each in a process of its own: an FMU that crashes or hangs
//! is a finding, not the end of the check.

pub mod archive;
pub mod arrays;
pub mod binaries;
pub mod definitions;
pub mod dependencies;
pub mod description;
pub mod events;
pub mod exchange;
pub mod integrate;
pub mod json;
pub mod junit;
pub mod kinds;
pub mod life;
pub mod log;
pub mod memory;
pub mod portable;
pub mod process;
pub mod ranges;
pub mod reading;
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

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Result, bail};
use host::fmi2::PLATFORM;
use host::xml::Element;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use self::archive::Archive;
pub use self::binaries::Binaries;
pub use self::description::Description;
pub use self::rules::RULES;
pub use self::under_test::FmuUnderTest;

/// How bad it is to break a rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The standard forbids it, or hosts fail.
    Error,
    /// Some host stumbles, or people are left in the dark.
    Warning,
}

impl Severity {
    /// As reports write it.
    pub fn name(self) -> &'static str {
        match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
        }
    }
}

/// What a rule says, for programs.
#[derive(Debug, serde::Serialize)]
pub struct Statement {
    fmi: &'static str,
    rule: &'static str,
    title: &'static str,
    source: &'static str,
    severity: &'static str,
}

/// All rules.
pub fn rules() -> Vec<Statement> {
    let statement = |fmi, rule: &Rule| Statement {
        fmi,
        rule: rule.id,
        title: rule.title,
        source: rule.source,
        severity: rule.severity.name(),
    };
    let second = RULES.iter().map(|rule| statement("2.0", rule));
    second.chain(v3::RULES.iter().map(|rule| statement("3.0", rule))).collect()
}

/// One rule: what must hold, who says so, and how to look.
pub struct Rule {
    /// Group and name, `group.name`.
    pub id: &'static str,
    /// What must hold.
    pub title: &'static str,
    /// The section of FMI 2.0.5 or 3.0.2, or the host that trips over it.
    pub source: &'static str,
    /// How bad it is to break it; a crash or an endless call is an error whatever is written here.
    pub severity: Severity,
    /// How to look.
    pub check: Check,
}

/// A rule as a line of a table.
const fn rule(
    id: &'static str,
    severity: Severity,
    title: &'static str,
    source: &'static str,
    check: Check,
) -> Rule {
    Rule { id, title, source, severity, check }
}

/// The function behind a rule, by what it looks at.
pub enum Check {
    /// The zip archive.
    Archive(fn(&Archive, &mut Findings)),
    /// modelDescription.xml.
    Description(fn(&Description, &mut Findings)),
    /// The files under `binaries/`.
    Binaries(fn(&Binaries, &mut Findings)),
    /// The loaded FMU, in a process of its own. A call that fails although it must not is a finding.
    Calls(fn(&FmuUnderTest, &mut Findings) -> Result<()>),
    /// modelDescription.xml of FMI 3.0.
    Description3(fn(&v3::Description, &mut Findings)),
    /// The files under `binaries/` of an FMU 3.0.
    Binaries3(fn(&v3::Binaries, &mut Findings)),
    /// The loaded FMU 3.0, in a process of its own.
    Calls3(fn(&v3::Subject, &mut Findings) -> Result<()>),
}

impl Rule {
    /// Whether it calls the FMU.
    pub fn is_of_calls(&self) -> bool {
        matches!(self.check, Check::Calls(_) | Check::Calls3(_))
    }
}

/// A rule that is broken.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// How bad it is.
    pub severity: Severity,
    /// Where: a file, a line, a variable, a call.
    pub place: String,
    /// What is wrong and what is allowed.
    pub text: String,
}

/// What came of looking at one rule.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Findings {
    severity: Severity,
    /// What is wrong, the first [`KEPT`]; empty if nothing is.
    pub list: Vec<Finding>,
    /// How many more there are.
    pub more: usize,
    /// Why the rule does not apply, or could not be looked at.
    pub skipped: Option<String>,
    /// The rule that must tell the fault for which this one could not be looked at.
    told_by: Option<String>,
}

impl Findings {
    /// Nothing found yet; what will be found is this bad.
    pub fn new(severity: Severity) -> Findings {
        Findings { severity, list: Vec::new(), more: 0, skipped: None, told_by: None }
    }

    /// The rule is broken.
    pub fn add(&mut self, place: impl Into<String>, text: impl Into<String>) {
        if self.list.len() >= KEPT {
            self.more += 1;
            return;
        }
        self.list.push(Finding { severity: self.severity, place: place.into(), text: text.into() });
    }

    /// The rule is broken, and that is an error whatever the rule says.
    pub fn fail(&mut self, place: impl Into<String>, text: impl Into<String>) {
        let finding = Finding { severity: Severity::Error, place: place.into(), text: text.into() };
        if self.list.len() >= KEPT {
            self.list.pop(); // an error shows, however many warnings there are
            self.more += 1;
        }
        self.list.push(finding);
    }

    /// The rule is bent: a warning, whatever the rule says.
    pub fn warn(&mut self, place: impl Into<String>, text: impl Into<String>) {
        let kept = self.list.len();
        self.add(place, text);
        if let Some(last) = self.list.get_mut(kept) {
            last.severity = Severity::Warning;
        }
    }

    /// Whether an error was found.
    fn has_error(&self) -> bool {
        self.list.iter().any(|finding| finding.severity == Severity::Error)
    }

    /// The rule does not apply.
    pub fn skip(&mut self, why: impl Into<String>) {
        self.skipped = Some(why.into());
    }

    /// The rule cannot be looked at, for a fault that another rule tells.
    pub fn skip_for(&mut self, rule: &str, why: impl Into<String>) {
        self.skip(why);
        self.told_by = Some(rule.into());
    }
}

/// What came of a rule.
pub struct Outcome {
    /// The rule.
    pub rule: &'static Rule,
    /// What was found.
    pub findings: Findings,
    /// How long it took.
    pub time: Duration,
}

/// How to check.
pub struct Options {
    /// The program that makes the calls, `hubslosh`, run with the hidden subcommand `check-calls`.
    pub program: PathBuf,
    /// Rules or groups of rules to look at, by the beginning of their names; empty for all.
    pub only: Vec<String>,
    /// Time that the calls of one rule may take.
    pub limit: Duration,
}

/// Everything that was looked at.
pub struct Report {
    /// The FMU.
    pub path: PathBuf,
    /// One for each rule, in the table's order.
    pub outcomes: Vec<Outcome>,
    /// The error that no selected rule was checked, if that is so: such a report says nothing about the FMU.
    pub unchecked: Option<String>,
    /// Report of a bug of this program for which a rule could not be checked.
    pub bug: Option<String>,
}

/// Rules that say why a file cannot be opened as an FMU. If it cannot, those that are broken are in the report even
/// if they are not selected.
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

/// Looks at all rules, or those asked for; `progress` is called after each rule of calls with their
/// number.
///
/// # Errors
/// If the file cannot be read, a rule asked for is unknown, or there is no place to unpack. Whatever
/// is wrong with the FMU is no error but a finding.
pub fn check(path: &Path, options: &Options, progress: impl Fn(usize) + Sync) -> Result<Report> {
    let known = |name: &str| RULES.iter().chain(v3::RULES).any(|rule| is_selected(rule, name));
    let unknown: Vec<_> = options.only.iter().filter(|name| !known(name)).cloned().collect();
    if !unknown.is_empty() {
        let mut groups: Vec<_> =
            RULES.iter().chain(v3::RULES).filter_map(|rule| rule.id.split('.').next()).collect();
        groups.sort_unstable();
        groups.dedup();
        bail!(
            "no rule is called {} (groups of rules: {}; `hubslosh check --rules` lists all)",
            unknown.join(", "),
            groups.join(", ")
        );
    }
    let archive = Archive::read(path)?;
    let description = archive.file("modelDescription.xml").map(Description::read);
    let description = match &description {
        Some(Ok(description)) => Ok(description),
        Some(Err(why)) => Err(format!("modelDescription.xml cannot be read: {why}")),
        None => Err("there is no modelDescription.xml that can be unpacked".to_string()),
    };
    let binaries = Binaries::new(&archive, description.as_ref().ok().copied());

    // An FMU of FMI 3 keeps rules of its own. One of FMI 1 keeps others: one rule tells it.
    let third = archive.file("modelDescription.xml").and_then(|xml| Element::parse(xml).ok());
    let third = third.filter(|root| root.get("fmiVersion").is_some_and(|v| v.starts_with("3.")));
    let third = third.map(v3::Description::new);
    let libraries = v3::Binaries::new(&archive, third.as_ref());
    let is_foreign = description.as_ref().is_ok_and(|d| d.other_version().is_some());
    let is_wanted = |rule: &&'static Rule| match is_foreign && third.is_none() {
        true => rule.id == "xml.fmi_version",
        false => options.only.is_empty() || options.only.iter().any(|o| is_selected(rule, o)),
    };
    let table = if third.is_some() { v3::RULES } else { RULES };
    let selected: Vec<&'static Rule> = table.iter().filter(is_wanted).collect();
    let calls = selected.iter().filter(|rule| rule.is_of_calls()).count();
    let callable = match (&description, &third) {
        (Err(why), _) => Err(why.clone()),
        (_, Some(d))
            if !["CoSimulation", "ModelExchange"].iter().any(|i| d.interface(i).is_some()) =>
        {
            Err("it offers neither Co-Simulation nor Model Exchange, which alone are called".into())
        }
        (_, Some(_)) if !libraries.is_callable() => {
            Err(format!("it has no library for this platform, {}", host::fmi3::PLATFORM))
        }
        (_, None) if binaries.own().is_none() => {
            Err(format!("it has no binary for this platform, {PLATFORM}"))
        }
        (Ok(_), _) => Ok(()),
    };
    let so_far = process::SoFar::default();
    let one = |rule: &&'static Rule| {
        let started = std::time::Instant::now();
        let mut findings = Findings::new(rule.severity);
        match (&rule.check, &description) {
            (Check::Archive(check), _) => check(&archive, &mut findings),
            (Check::Description(check), Ok(description)) => check(description, &mut findings),
            // That it is missing or not well-formed is a rule of its own.
            (Check::Description(_), Err(why)) => findings.skip(why.clone()),
            (Check::Binaries(check), _) => check(&binaries, &mut findings),
            (Check::Description3(check), _) => match &third {
                Some(description) => check(description, &mut findings),
                None => findings.skip("it is no FMU 3.0"),
            },
            (Check::Binaries3(check), _) => check(&libraries, &mut findings),
            (Check::Calls(_) | Check::Calls3(_), _) => {
                match &callable {
                    Ok(()) => process::check(
                        rule,
                        archive.directory(),
                        path,
                        options,
                        &so_far,
                        &mut findings,
                    ),
                    Err(why) => findings.skip(why.clone()),
                }
                progress(calls);
            }
        }
        Outcome { rule, findings, time: started.elapsed() }
    };
    let mut outcomes: Vec<Outcome> = selected.par_iter().map(one).collect();
    tell_what_nobody_tells(&mut outcomes);
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
            findings.fail("the archive", format!("it cannot be opened as an FMU: {why}"));
            outcomes.push(Outcome { rule, findings, time: Duration::ZERO });
        }
        let place = |outcome: &Outcome| table.iter().position(|rule| rule.id == outcome.rule.id);
        outcomes.sort_by_key(place);
    }
    let bug = so_far.bug.into_inner();
    Ok(Report { path: path.to_path_buf(), outcomes, unchecked, bug })
}

/// The error that no rule of `outcomes`, those selected by `only`, was checked.
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

/// A rule that was skipped for a fault that another rule tells becomes a finding if that rule was
/// looked at and found nothing: the fault shows only here.
fn tell_what_nobody_tells(outcomes: &mut [Outcome]) {
    let silent: Vec<&str> = outcomes
        .iter()
        .filter(|o| o.findings.list.is_empty() && o.findings.skipped.is_none())
        .map(|o| o.rule.id)
        .collect();
    for findings in outcomes.iter_mut().map(|outcome| &mut outcome.findings) {
        if findings.told_by.as_deref().is_some_and(|rule| silent.contains(&rule))
            && let Some(why) = findings.skipped.take()
        {
            findings.add("a run of this rule", why);
        }
    }
}

fn is_selected(rule: &Rule, name: &str) -> bool {
    rule.id == name || rule.id.strip_prefix(name).is_some_and(|rest| rest.starts_with('.'))
}

/// Findings of one rule that are kept: a file with a hundred thousand variables, all of them wrong,
/// shall not fill the memory with sentences.
const KEPT: usize = 1000;
/// Findings of one rule that a person is shown; those kept are in the JUnit file.
const SHOWN: usize = 8;

impl Report {
    /// How many findings are as bad as this.
    pub fn count(&self, severity: Severity) -> usize {
        let more = self.outcomes.iter().map(|outcome| &outcome.findings);
        let more = more.filter(|f| f.severity == severity).map(|f| f.more).sum::<usize>();
        more + self.all().filter(|(_, finding)| finding.severity == severity).count()
    }

    /// All findings, each with its rule.
    pub fn all(&self) -> impl Iterator<Item = (&'static Rule, &Finding)> {
        self.outcomes.iter().flat_map(|o| o.findings.list.iter().map(move |f| (o.rule, f)))
    }

    /// For people: every finding, what was skipped and why, and a sum.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for outcome in &self.outcomes {
            let Outcome { rule, findings, .. } = outcome;
            for finding in findings.list.iter().take(SHOWN) {
                let _ = writeln!(
                    text,
                    "{} {}: {}: {}",
                    finding.severity.name(),
                    rule.id,
                    finding.place,
                    finding.text
                );
            }
            let more = findings.more + findings.list.len().saturating_sub(SHOWN);
            if more > 0 {
                let _ = writeln!(text, "  and {more} more like these");
            }
            if !findings.list.is_empty() {
                let _ = writeln!(text, "  rule: {} [{}]", rule.title, rule.source);
            }
        }
        let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
        for outcome in &self.outcomes {
            let Some(why) = outcome.findings.skipped.as_deref() else { continue };
            match reasons.iter_mut().find(|(known, _)| *known == why) {
                Some((_, rules)) => rules.push(outcome.rule.id),
                None => reasons.push((why, vec![outcome.rule.id])),
            }
        }
        for (why, rules) in reasons {
            match rules.len() {
                1 => _ = writeln!(text, "skipped {}: {why}", rules[0]),
                n => {
                    _ = writeln!(text, "skipped {n} rules, {} to {}: {why}", rules[0], rules[n - 1])
                }
            }
        }
        let skipped = self.outcomes.iter().filter(|o| o.findings.skipped.is_some()).count();
        let _ = writeln!(
            text,
            "{}: {} errors, {} warnings; {} rules looked at, {skipped} skipped",
            self.path.display(),
            self.count(Severity::Error),
            self.count(Severity::Warning),
            self.outcomes.len() - skipped,
        );
        if let Some(why) = &self.unchecked {
            let _ = writeln!(text, "error: {why}");
        }
        text
    }
}

/// The table of rules of one version as Markdown, as the documentation shows it.
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn rules_have_names_of_their_own_and_stand_in_groups() {
        for rules in [RULES, v3::RULES] {
            let names: BTreeSet<_> = rules.iter().map(|rule| rule.id).collect();
            assert_eq!(names.len(), rules.len());
            let mut groups: Vec<_> =
                rules.iter().map(|r| r.id.split_once('.').unwrap().0).collect();
            groups.dedup();
            let unique: BTreeSet<_> = groups.iter().collect();
            assert_eq!(unique.len(), groups.len(), "a group is torn apart: {groups:?}");
        }
    }

    #[test]
    fn a_group_means_its_rules_and_no_others() {
        let rule = |id| RULES.iter().find(|rule| rule.id == id).unwrap();
        assert!(is_selected(rule("zip.names"), "zip"));
        assert!(is_selected(rule("zip.names"), "zip.names"));
        assert!(!is_selected(rule("zip.names"), "zip.name"));
        assert!(!is_selected(rule("zip.names"), "xml"));
    }
}

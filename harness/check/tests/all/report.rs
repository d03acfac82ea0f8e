//! Names of rules, their selection, and the report in JUnit's form.

use std::collections::BTreeSet;
use std::time::Duration;

use check::rules::fmi3;
use check::{Findings, Options, Outcome, RULES, Report, Severity, junit};
use host::xml::Element;
use pack::packed_for_tests;

use crate::common::check_rules;

#[test]
fn rule_names_are_unique_and_rules_of_a_group_are_adjacent() {
    for rules in [RULES, fmi3::RULES] {
        let names: BTreeSet<_> = rules.iter().map(|rule| rule.id).collect();
        assert_eq!(names.len(), rules.len());
        let mut groups: Vec<_> = rules.iter().map(|r| r.id.split_once('.').unwrap().0).collect();
        groups.dedup();
        let unique: BTreeSet<_> = groups.iter().collect();
        assert_eq!(unique.len(), groups.len(), "a group is torn apart: {groups:?}");
    }
}

#[test]
fn selecting_a_group_selects_exactly_its_rules() {
    let checked = |only| -> Vec<&str> {
        let report = check_rules(packed_for_tests(), &[only], 60.0);
        report.outcomes.iter().map(|outcome| outcome.rule.id).collect()
    };
    let rules = RULES.iter().map(|rule| rule.id);
    let group: Vec<_> = rules.filter(|id| id.split('.').next() == Some("zip")).collect();
    assert!(group.len() > 5);
    assert_eq!(checked("zip"), group);
    assert_eq!(checked("zip.names"), ["zip.names"]);
    let only = vec!["zip.name".into()];
    let options = Options { program: "hubslosh".into(), only, limit: Duration::from_secs(60) };
    let why = check::check(packed_for_tests(), &options, |_| {}).err().unwrap().to_string();
    assert!(why.starts_with("no rule is called zip.name ("), "{why}");
}

#[test]
fn every_rule_is_a_junit_case_and_any_text_is_escaped() {
    let mut outcomes: Vec<_> = RULES
        .iter()
        .map(|rule| Outcome {
            rule,
            findings: Findings::new(Severity::Warning),
            time: Duration::ZERO,
        })
        .collect();
    outcomes[0].findings.at("a\u{1}b").fail("<&\"]]>");
    outcomes[1].findings.at("c").add("d");
    outcomes[2].findings.skip("e");
    let report = Report { path: "x.fmu".into(), outcomes, unchecked: None, bug: None };
    let mut out = Vec::new();
    junit::write(&report, &mut out).unwrap();
    let root = Element::parse(&out).unwrap();
    let suite = &root.children[0];
    assert_eq!(suite.children.len(), RULES.len());
    assert_eq!((suite.get("failures"), suite.get("skipped")), (Some("1"), Some("1")));
    assert_eq!(root.get("failures"), Some("1"));
    assert_eq!(suite.children[0].children[0].name, "failure");
    assert_eq!(suite.children[1].children[0].name, "system-out");
    assert_eq!(suite.children[2].children[0].name, "skipped");
}

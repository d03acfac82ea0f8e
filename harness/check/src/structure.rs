//! Rules about ModelStructure in modelDescription.xml (FMI 2.0.5, section 2.2) and about dependencies.

use std::collections::{BTreeMap, BTreeSet};

use host::causality::Causality;

use super::description::{Description, Unknown, Variable};
use super::findings::Findings;

/// Reports entries of the list named `list` that are missing, repeated or not allowed; `why` describes the
/// allowed entries. Each of `entries` is a place, the variable's index or value reference, and whether it is
/// allowed; `name` returns the name of a variable.
pub(crate) fn compare_list<K: Ord>(
    findings: &mut Findings,
    list: &str,
    entries: impl Iterator<Item = (String, K, bool)>,
    needed: &BTreeSet<K>,
    name: impl Fn(&K) -> String,
    why: &str,
) {
    let mut seen = BTreeSet::new();
    for (place, key, is_allowed) in entries {
        if !is_allowed {
            findings.at(&place).add(format!("it is not allowed here (allowed: {why})"));
        }
        if !seen.insert(key) {
            findings.at(place).add("it is listed already");
        }
    }
    for missing in needed.difference(&seen) {
        let place = format!("{list}, {}", name(missing));
        findings.at(place).add(format!("it is missing (required: {why})"));
    }
}

fn compare(
    d: &Description,
    findings: &mut Findings,
    list: &str,
    listed: &[Unknown],
    expected: &BTreeSet<usize>,
    why: &str,
) {
    let entries = listed.iter().map(|unknown| {
        let place = format!("line {}, {list}, {}", unknown.line, d.name_of(unknown.index));
        // An index out of range is reported by another rule.
        let is_allowed = d.at(unknown.index).is_none() || expected.contains(&unknown.index);
        (place, unknown.index, is_allowed)
    });
    compare_list(findings, list, entries, expected, |index| d.name_of(*index), why);
}

/// Reports a dependency that is listed twice, and dependenciesKind without as many dependencies.
pub(crate) fn check_kinds<K: Ord>(
    findings: &mut Findings,
    place: &str,
    dependencies: Option<&[K]>,
    kinds: Option<&Vec<String>>,
) {
    let listed = dependencies.unwrap_or_default();
    let all = listed.len();
    match kinds.map(Vec::len) {
        Some(_) if dependencies.is_none() => {
            findings.at(place).add("dependenciesKind without dependencies");
        }
        Some(n) if n != all => {
            findings.at(place).add(format!("{all} dependencies, but {n} kinds of them"));
        }
        _ => {}
    }
    if listed.iter().collect::<BTreeSet<_>>().len() < all {
        findings.at(place).add("a dependency is listed twice");
    }
}

fn indices(d: &Description, wanted: impl Fn(&Variable) -> bool) -> BTreeSet<usize> {
    d.variables.iter().filter(|v| wanted(v)).map(|v| v.index).collect()
}

pub fn outputs(d: &Description, findings: &mut Findings) {
    let expected = indices(d, |v| v.causality == Causality::Output);
    compare(d, findings, "Outputs", &d.outputs, &expected, "every output, once");
}

pub fn derivatives(d: &Description, findings: &mut Findings) {
    if d.model_exchange.is_none() && d.derivatives.is_empty() {
        return findings.skip("Co-Simulation alone need not list derivatives");
    }
    let mut taken = BTreeMap::new();
    let mut seen = BTreeSet::new();
    for unknown in &d.derivatives {
        let Some(v) = d.at(unknown.index) else { continue };
        let place = format!("line {}, Derivatives, {}", unknown.line, v.name);
        let Some(state) = v.derivative_of() else {
            findings.at(&place).add("it has no attribute derivative, so its state is unknown");
            continue;
        };
        if !seen.insert(unknown.index) {
            findings.at(&place).add("it is listed already");
        } else if let Some(other) = taken.insert(state, &v.name) {
            findings.at(&place).add(format!("{other} is the derivative of the same state"));
        }
        if let Some(state) =
            d.at(state).filter(|state| !(v.is_continuous() && state.is_continuous()))
        {
            let text = format!("it and its state {} must be continuous Reals", state.name);
            findings.at(&place).add(text);
        }
    }
}

pub fn initial_unknowns(d: &Description, findings: &mut Findings) {
    let states = d.states();
    let expected = indices(d, |v| {
        let computed = matches!(v.initial.as_deref(), Some("calculated" | "approx"));
        let derivative = |v: &Variable| v.derivative_of().is_some_and(|s| states.contains(&s));
        let state = states.contains(&v.index) || derivative(v);
        computed
            && (v.causality == Causality::Output
                || v.causality == Causality::CalculatedParameter
                || state)
    });
    // The standard lets an FMU for Co-Simulation list its states or leave them out.
    let expected = match d.derivatives.is_empty() && d.model_exchange.is_none() {
        true => indices(d, |v| {
            expected.contains(&v.index)
                && (v.causality != Causality::Local
                    || d.initial_unknowns.iter().any(|u| u.index == v.index))
        }),
        false => expected,
    };
    let why = "outputs, states and derivatives with initial calculated or approx, and calculated \
               parameters, once";
    compare(d, findings, "InitialUnknowns", &d.initial_unknowns, &expected, why);
    for pair in d.initial_unknowns.windows(2) {
        if pair[1].index < pair[0].index {
            findings
                .at(format!("line {}, InitialUnknowns, {}", pair[1].line, d.name_of(pair[1].index)))
                .add(format!(
                    "index {} after {} (required: ascending)",
                    pair[1].index, pair[0].index
                ));
        }
    }
}

fn lists(d: &Description) -> [(&'static str, &[Unknown]); 3] {
    [
        ("Outputs", &d.outputs),
        ("Derivatives", &d.derivatives),
        ("InitialUnknowns", &d.initial_unknowns),
    ]
}

pub fn indices_in_range(d: &Description, findings: &mut Findings) {
    let count = d.variables.len();
    for (list, unknowns) in lists(d) {
        for unknown in unknowns {
            let place = format!("line {}, {list}", unknown.line);
            if d.at(unknown.index).is_none() {
                findings.at(&place).add(format!("index {} (allowed: 1 to {count})", unknown.index));
            }
            for index in unknown.dependencies.iter().flatten().filter(|i| d.at(**i).is_none()) {
                findings.at(&place).add(format!("dependency {index} (allowed: 1 to {count})"));
            }
        }
    }
}

pub fn dependencies(d: &Description, findings: &mut Findings) {
    for (list, unknowns) in lists(d) {
        let initial = list == "InitialUnknowns";
        for unknown in unknowns {
            let place = format!("line {}, {list}, {}", unknown.line, d.name_of(unknown.index));
            check_kinds(findings, &place, unknown.dependencies.as_deref(), unknown.kinds.as_ref());
            let mut kinds = unknown.kinds.iter().flatten();
            let odd = kinds.find(|k| !matches!(k.as_str(), "dependent" | "constant"));
            if let Some(odd) = odd.filter(|_| initial) {
                findings
                    .at(&place)
                    .add(format!("dependenciesKind {odd} (allowed: dependent, constant)"));
            }
        }
    }
}

pub fn dependencies_known(d: &Description, findings: &mut Findings) {
    let states = d.states();
    for (list, unknowns) in lists(d) {
        let initial = list == "InitialUnknowns";
        for unknown in unknowns {
            let place = format!("line {}, {list}, {}", unknown.line, d.name_of(unknown.index));
            let dependencies = unknown.dependencies.as_deref().unwrap_or_default();
            let known = |v: &Variable| {
                let common =
                    v.causality == Causality::Input || v.causality == Causality::Independent;
                match initial {
                    true => common || v.initial.as_deref() == Some("exact"),
                    // An FMU for Co-Simulation may hide its derivatives and still name its states.
                    false => common || states.contains(&v.index) || d.model_exchange.is_none(),
                }
            };
            for v in dependencies.iter().filter_map(|i| d.at(*i)).filter(|v| !known(v)) {
                let allowed = match initial {
                    true => "inputs, variables with initial=exact",
                    false => "inputs, continuous states, the independent variable",
                };
                findings
                    .at(&place)
                    .add(format!("it cannot depend on {} (allowed: {allowed})", v.name));
            }
        }
    }
}

pub fn dependencies_written(d: &Description, findings: &mut Findings) {
    for unknown in d.outputs.iter().filter(|unknown| unknown.dependencies.is_none()) {
        findings.at(format!("line {}, Outputs, {}", unknown.line, d.name_of(unknown.index))).add(
            "no attribute dependencies: that means it depends on everything (write \
             dependencies=\"\" where there is no feedthrough)",
        );
    }
}

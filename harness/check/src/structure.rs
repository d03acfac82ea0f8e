//! Rules about ModelStructure in modelDescription.xml (FMI 2.0.5, section 2.2) and about dependencies.

use std::collections::{BTreeMap, BTreeSet};

use host::causality::Causality;

use super::description::{Description, Unknown, Variable};
use super::findings::Findings;

/// Reports entries of the list named `list` that are missing, repeated or not in `expected`; `why` describes
/// the allowed entries.
fn compare(
    d: &Description,
    findings: &mut Findings,
    list: &str,
    listed: &[Unknown],
    expected: &BTreeSet<usize>,
    why: &str,
) {
    let mut seen = BTreeSet::new();
    for unknown in listed {
        let place = format!("line {}, {list}, {}", unknown.line, d.name_of(unknown.index));
        // An index out of range is reported by another rule.
        if d.at(unknown.index).is_some() && !expected.contains(&unknown.index) {
            findings.at(&place).add(format!("it is not allowed here (allowed: {why})"));
        }
        if !seen.insert(unknown.index) {
            findings.at(&place).add("it is listed already");
        }
    }
    for missing in expected.difference(&seen) {
        findings
            .at(format!("{list}, {}", d.name_of(*missing)))
            .add(format!("it is missing (required: {why})"));
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
            let dependencies = unknown.dependencies.as_deref().unwrap_or_default();
            if let Some(kinds) = &unknown.kinds {
                if unknown.dependencies.is_none() {
                    findings.at(&place).add("dependenciesKind without dependencies");
                } else if kinds.len() != dependencies.len() {
                    let (kinds, all) = (kinds.len(), dependencies.len());
                    findings
                        .at(&place)
                        .add(format!("{all} dependencies, but {kinds} kinds of them"));
                }
                let odd = kinds.iter().find(|k| !matches!(k.as_str(), "dependent" | "constant"));
                if let Some(odd) = odd.filter(|_| initial) {
                    findings
                        .at(&place)
                        .add(format!("dependenciesKind {odd} (allowed: dependent, constant)"));
                }
            }
            let distinct: BTreeSet<_> = dependencies.iter().collect();
            if distinct.len() < dependencies.len() {
                findings.at(&place).add("a dependency is listed twice");
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

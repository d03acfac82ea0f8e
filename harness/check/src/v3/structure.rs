//! Rules about ModelStructure in modelDescription.xml (FMI 3.0.2, section 2.4) and about dependencies.

use std::collections::{BTreeMap, BTreeSet};

use super::description::{Description, Unknown, Variable};
use crate::findings::Findings;
use crate::structure::{check_kinds, compare_list};
use host::causality::{Causality, Variability};
use host::description::Type;

fn place(d: &Description, u: &Unknown) -> String {
    format!("line {}, {}, {}", u.line, u.list, d.name_of(u.reference))
}

/// Reports elements named `list` that are missing from `needed`, repeated or not `allowed`; `why` describes
/// the allowed ones.
fn compare(
    d: &Description,
    findings: &mut Findings,
    list: &str,
    needed: &BTreeSet<u32>,
    allowed: impl Fn(&Variable) -> bool,
    why: &str,
) {
    let entries = d.unknowns(list).filter_map(|unknown| {
        let reference = unknown.reference?;
        Some((place(d, unknown), reference, d.at(reference).is_none_or(&allowed)))
    });
    compare_list(findings, list, entries, needed, |missing| d.name_of(Some(*missing)), why);
}

fn all(d: &Description, wanted: impl Fn(&Variable) -> bool) -> BTreeSet<u32> {
    d.variables.iter().filter(|v| wanted(v)).map(|v| v.reference).collect()
}

pub fn outputs(d: &Description, findings: &mut Findings) {
    let is_output = |v: &Variable| v.causality == Causality::Output;
    compare(d, findings, "Output", &all(d, is_output), is_output, "every output, once");
}

pub fn derivatives(d: &Description, findings: &mut Findings) {
    let why = "variables with the attribute derivative, once";
    let allowed = |v: &Variable| v.derivative_of().is_some();
    compare(d, findings, "ContinuousStateDerivative", &BTreeSet::new(), allowed, why);
    let mut taken: BTreeMap<u32, String> = BTreeMap::new();
    for unknown in d.unknowns("ContinuousStateDerivative") {
        let v = unknown.reference.and_then(|r| d.at(r));
        if let Some(v) = v
            && let Some(state) = v.derivative_of()
            && let Some(other) =
                taken.insert(state, v.name.clone()).filter(|other| *other != v.name)
        {
            findings
                .at(place(d, unknown))
                .add(format!("{other} is the derivative of the same state"));
        }
    }
}

pub fn clocked_states(d: &Description, findings: &mut Findings) {
    let is_state = |v: &Variable| v.written.get("previous").is_some();
    let why = "every variable with the attribute previous, once";
    compare(d, findings, "ClockedState", &all(d, is_state), is_state, why);
}

pub fn initial_unknowns(d: &Description, findings: &mut Findings) {
    let derivatives: BTreeSet<u32> =
        d.unknowns("ContinuousStateDerivative").filter_map(|u| u.reference).collect();
    let states: BTreeSet<u32> = d.states().into_iter().collect();
    let needed = |v: &Variable| {
        let computed = matches!(v.initial.as_deref(), Some("calculated" | "approx"));
        let state = states.contains(&v.reference) || derivatives.contains(&v.reference);
        v.written.get("clocks").is_none()
            && v.kind != Type::Clock
            && (v.causality == Causality::CalculatedParameter
                || (computed && (v.causality == Causality::Output || state)))
    };
    let why = "outputs, states and their derivatives with initial calculated or approx, calculated \
               parameters, once; clocked variables";
    let allowed = |v: &Variable| needed(v) || v.written.get("clocks").is_some();
    compare(d, findings, "InitialUnknown", &all(d, needed), allowed, why);
}

pub fn event_indicators(d: &Description, findings: &mut Findings) {
    let why = "continuous Float32 and Float64, each once";
    compare(d, findings, "EventIndicator", &BTreeSet::new(), |v| v.is_continuous(), why);
}

pub fn structure_references(d: &Description, findings: &mut Findings) {
    for unknown in &d.structure {
        let all =
            unknown.reference.into_iter().chain(unknown.dependencies.iter().flatten().copied());
        for reference in all.filter(|r| d.at(*r).is_none()) {
            findings
                .at(format!("line {}, {}", unknown.line, unknown.list))
                .add(format!("no variable has the valueReference {reference}"));
        }
    }
}

pub fn dependencies(d: &Description, findings: &mut Findings) {
    for unknown in &d.structure {
        let place = place(d, unknown);
        check_kinds(findings, &place, unknown.dependencies.as_deref(), unknown.kinds.as_ref());
        let Some(kinds) = &unknown.kinds else { continue };
        let is_float = unknown.reference.and_then(|r| d.at(r)).is_none_or(|v| v.is_real());
        for kind in kinds {
            let fits = match kind.as_str() {
                "dependent" => true,
                "constant" => is_float,
                _ => is_float && unknown.list != "InitialUnknown",
            };
            if !fits {
                let allowed = if is_float { "dependent, constant" } else { "dependent" };
                findings.at(&place).add(format!("dependenciesKind {kind} (allowed: {allowed})"));
            }
        }
    }
}

pub fn dependencies_known(d: &Description, findings: &mut Findings) {
    let states: BTreeSet<u32> = d.states().into_iter().collect();
    // The standard does not say on what event indicators may depend.
    for unknown in d.structure.iter().filter(|u| u.list != "EventIndicator") {
        let initial = unknown.list == "InitialUnknown";
        let known = |v: &Variable| {
            matches!(
                v.causality,
                Causality::Input
                    | Causality::Independent
                    | Causality::Parameter
                    | Causality::StructuralParameter
            ) || match initial {
                true => v.initial.as_deref() == Some("exact"),
                // A discrete variable may be a discrete-time state.
                false => states.contains(&v.reference) || v.variability == Variability::Discrete,
            } || v.kind == Type::Clock
                || v.written.get("clocks").is_some()
        };
        let listed = unknown.dependencies.iter().flatten().filter_map(|r| d.at(*r));
        for v in listed.filter(|v| !known(v)) {
            let allowed = match initial {
                true => "inputs, variables with initial=exact, the independent variable",
                false => {
                    "inputs, continuous and discrete states, parameters, the independent variable"
                }
            };
            findings
                .at(place(d, unknown))
                .add(format!("it cannot depend on {} (allowed: {allowed})", v.name));
        }
    }
}

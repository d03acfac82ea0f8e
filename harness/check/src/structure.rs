//! Rules about ModelStructure in modelDescription.xml (FMI 2.0.5, section 2.2; FMI 3.0.2, section 2.4) and about
//! dependencies.

use std::collections::{BTreeMap, BTreeSet};

use host::causality::{Causality, Variability};
use host::description::Type;

use super::description::{Description, Unknown, Variable};
use super::findings::Findings;

fn place(d: &Description, u: &Unknown) -> String {
    format!("line {}, {}, {}", u.line, u.list, d.name_of(u.key))
}

/// Compares the entries of `list`, a list of ModelStructure, with the variables of the description. Reports entries
/// that are repeated or not `allowed`, and variables that are `needed` but missing in the list. `why` describes the
/// allowed entries in messages.
fn compare(
    d: &Description,
    findings: &mut Findings,
    list: &str,
    needed: impl Fn(&Variable) -> bool,
    allowed: impl Fn(&Variable) -> bool,
    why: &str,
) {
    let mut seen = BTreeSet::new();
    for unknown in d.unknowns(list).filter(|unknown| unknown.key.is_some()) {
        if !d.variable_of(unknown).is_none_or(&allowed) {
            let text = format!("the variable is not allowed in this list (allowed: {why})");
            findings.at(place(d, unknown)).add(text);
        }
        if !seen.insert(unknown.key) {
            findings.at(place(d, unknown)).add("the variable is listed twice");
        }
    }
    for v in d.variables.iter().filter(|v| needed(v) && !seen.contains(&Some(v.key))) {
        findings
            .at(format!("{list}, {}", v.name))
            .add(format!("the variable is missing in this list (required: {why})"));
    }
}

pub fn outputs(d: &Description, findings: &mut Findings) {
    let is_output = |v: &Variable| v.causality == Causality::Output;
    compare(d, findings, d.words.outputs, is_output, is_output, "every output, once");
}

pub fn derivatives(d: &Description, findings: &mut Findings) {
    if d.hides_states() {
        return findings.skip("Co-Simulation alone need not list derivatives");
    }
    let why = "variables with the attribute derivative, once";
    let allowed = |v: &Variable| v.derivative_of().is_some();
    compare(d, findings, d.words.derivatives, |_| false, allowed, why);
    let mut taken: BTreeMap<u32, &Variable> = BTreeMap::new();
    for unknown in d.unknowns(d.words.derivatives) {
        let Some(v) = d.variable_of(unknown) else { continue };
        let Some(state) = v.derivative_of() else { continue };
        if let Some(other) = taken.insert(state, v).filter(|other| other.key != v.key) {
            let text = format!("{} is the derivative of the same state", other.name);
            findings.at(place(d, unknown)).add(text);
        }
        // In FMI 3.0 the rule xml.derivatives_of reports this.
        let is_wrong = |state: &&Variable| !(v.is_continuous() && state.is_continuous());
        if !d.is_fmi3()
            && let Some(state) = d.at(state).filter(is_wrong)
        {
            let text =
                format!("the derivative and its state {} must be continuous Reals", state.name);
            findings.at(place(d, unknown)).add(text);
        }
    }
}

fn is_clocked(v: &Variable) -> bool {
    v.written.get("clocks").is_some()
}

pub fn clocked_states(d: &Description, findings: &mut Findings) {
    let is_state = |v: &Variable| v.written.get("previous").is_some();
    let why = "every variable with the attribute previous, once";
    compare(d, findings, "ClockedState", is_state, is_state, why);
}

pub fn event_indicators(d: &Description, findings: &mut Findings) {
    let why = "continuous Float32 and Float64, each once";
    compare(d, findings, "EventIndicator", |_| false, Variable::is_continuous, why);
}

pub fn initial_unknowns(d: &Description, findings: &mut Findings) {
    let list = d.words.initial_unknowns;
    let derivatives: BTreeSet<_> = d.unknowns(d.words.derivatives).map(|u| u.key).collect();
    let states: BTreeSet<u32> = d.states().into_iter().collect();
    let is_derivative = |v: &Variable| match d.is_fmi3() {
        true => derivatives.contains(&Some(v.key)),
        false => v.derivative_of().is_some_and(|state| states.contains(&state)),
    };
    let is_unknown = |v: &Variable| {
        let is_computed = matches!(v.initial.as_deref(), Some("calculated" | "approx"));
        let is_running =
            v.causality == Causality::Output || states.contains(&v.key) || is_derivative(v);
        let is_parameter = v.causality == Causality::CalculatedParameter;
        !is_clocked(v)
            && v.kind != Type::Clock
            && (is_computed && (is_running || is_parameter) || is_parameter && d.is_fmi3())
    };
    // If derivatives are not listed, a local variable may or may not be a state.
    let may_hide = d.hides_states();
    let needed = |v: &Variable| is_unknown(v) && !(may_hide && v.causality == Causality::Local);
    let why = match d.is_fmi3() {
        true => {
            "outputs, states and their derivatives with initial calculated or approx, calculated parameters, \
             once; clocked variables"
        }
        false => {
            "outputs, states and derivatives with initial calculated or approx, and calculated parameters, once"
        }
    };
    compare(d, findings, list, needed, |v| is_unknown(v) || is_clocked(v), why);
    let keys: Vec<_> = d.unknowns(list).filter(|_| !d.is_fmi3()).collect();
    for pair in keys.windows(2) {
        if let (Some(before), Some(key)) = (pair[0].key, pair[1].key)
            && key < before
        {
            findings
                .at(place(d, pair[1]))
                .add(format!("index {key} after {before} (required: ascending)"));
        }
    }
}

pub fn references(d: &Description, findings: &mut Findings) {
    let count = d.variables.len();
    for unknown in &d.structure {
        let named = unknown.key.map(|key| ("index", key)).into_iter();
        let known = unknown.dependencies.iter().flatten().map(|key| ("dependency", *key));
        for (what, key) in named.chain(known).filter(|(_, key)| d.at(*key).is_none()) {
            let text = match d.is_fmi3() {
                true => format!("no variable has the valueReference {key}"),
                false => format!("{what} {key} (allowed: 1 to {count})"),
            };
            findings.at(format!("line {}, {}", unknown.line, unknown.list)).add(text);
        }
    }
}

pub fn dependencies(d: &Description, findings: &mut Findings) {
    for unknown in &d.structure {
        let place = place(d, unknown);
        let listed = unknown.dependencies.as_deref().unwrap_or_default();
        let (all, kinds) = (listed.len(), unknown.kinds.as_deref().unwrap_or_default());
        if unknown.kinds.is_some() && unknown.dependencies.is_none() {
            findings.at(&place).add("dependenciesKind without dependencies");
        } else if unknown.kinds.is_some() && kinds.len() != all {
            let text = format!("{all} dependencies, but {} kinds of them", kinds.len());
            findings.at(&place).add(text);
        }
        if listed.iter().collect::<BTreeSet<_>>().len() < all {
            findings.at(&place).add("a dependency is listed twice");
        }
        // FMI 3.0 allows kinds of linear dependence only for floating-point numbers.
        let is_linear = !d.is_fmi3() || d.variable_of(unknown).is_none_or(Variable::is_real);
        for kind in kinds {
            let fits = match kind.as_str() {
                "dependent" => true,
                "constant" => is_linear,
                _ => is_linear && unknown.list != d.words.initial_unknowns,
            };
            if !fits {
                let allowed = if is_linear { "dependent, constant" } else { "dependent" };
                findings.at(&place).add(format!("dependenciesKind {kind} (allowed: {allowed})"));
            }
        }
    }
}

pub fn dependencies_known(d: &Description, findings: &mut Findings) {
    use Causality::{Independent, Input, Parameter, StructuralParameter};
    let states: BTreeSet<u32> = d.states().into_iter().collect();
    let is_fmi3 = d.is_fmi3();
    let any_state = !is_fmi3 && d.interface("ModelExchange").is_none();
    for unknown in d.structure.iter().filter(|u| u.list != "EventIndicator") {
        let initial = unknown.list == d.words.initial_unknowns;
        let is_always_known = |v: &Variable| match v.causality {
            Input | Independent => true,
            Parameter | StructuralParameter => is_fmi3,
            _ => v.kind == Type::Clock || is_clocked(v),
        };
        let is_known = |v: &Variable| match initial {
            true => v.initial.as_deref() == Some("exact"),
            false => {
                any_state
                    || states.contains(&v.key)
                    || is_fmi3 && v.variability == Variability::Discrete
            }
        };
        let allowed = match (initial, is_fmi3) {
            (true, true) => "inputs, variables with initial=exact, the independent variable",
            (true, false) => "inputs, variables with initial=exact",
            (false, true) => {
                "inputs, continuous and discrete states, parameters, the independent variable"
            }
            (false, false) => "inputs, continuous states, the independent variable",
        };
        let listed = unknown.dependencies.iter().flatten().filter_map(|key| d.at(*key));
        for v in listed.filter(|v| !is_always_known(v) && !is_known(v)) {
            let text = format!("the unknown cannot depend on {} (allowed: {allowed})", v.name);
            findings.at(place(d, unknown)).add(text);
        }
    }
}

pub fn dependencies_written(d: &Description, findings: &mut Findings) {
    let outputs = d.unknowns(d.words.outputs);
    for unknown in outputs.filter(|unknown| unknown.dependencies.is_none()) {
        findings.at(place(d, unknown)).add(
            "no attribute dependencies: that means it depends on everything (write \
             dependencies=\"\" where there is no feedthrough)",
        );
    }
}

//! Rules about the head and the definitions of modelDescription.xml (FMI 3.0.2, section 2.4): interfaces,
//! capabilities, units, types.

use std::collections::BTreeMap;

use super::description::Description;
use crate::definitions::{
    experiment_numbers, identifiers, stop_before_start, unique_names, unit_definitions, wrong_unit,
};
use crate::findings::Findings;
use host::description::Type;
use host::xml::Element;

pub fn fmi_version(d: &Description, findings: &mut Findings) {
    let version = d.root.get("fmiVersion").unwrap_or_default();
    if version != "3.0" {
        findings.at("fmiVersion").add(format!("\"{version}\" (allowed: \"3.0\")"));
    }
}

pub fn token(d: &Description, findings: &mut Findings) {
    if d.root.get("instantiationToken").is_none_or(|token| token.trim().is_empty()) {
        findings.at("instantiationToken").add("it is missing or empty");
    }
}

pub fn interfaces(d: &Description, findings: &mut Findings) {
    if d.interfaces().next().is_none() {
        findings
            .at("fmiModelDescription")
            .add("none of ModelExchange, CoSimulation and ScheduledExecution is there");
    }
}

pub fn model_identifier(d: &Description, findings: &mut Findings) {
    identifiers(d.interfaces(), findings);
}

pub fn capabilities(d: &Description, findings: &mut Findings) {
    const NEEDS: [(&str, &str); 2] = [
        ("canSerializeFMUState", "canGetAndSetFMUState"),
        ("canReturnEarlyAfterIntermediateUpdate", "providesIntermediateUpdate"),
    ];
    for interface in d.interfaces() {
        let place = format!("line {}, {}", interface.line, interface.name);
        for (flag, needed) in NEEDS {
            if interface.flag(flag) && !interface.flag(needed) {
                findings.at(&place).add(format!("{flag} without {needed}"));
            }
        }
        if let Some(step) =
            interface.number("fixedInternalStepSize").filter(|h| h.is_nan() || *h <= 0.0)
        {
            findings.at(&place).add(format!("fixedInternalStepSize={step} (allowed: above 0)"));
        }
    }
    let clocks = d.variables.iter().any(|v| v.kind == Type::Clock);
    if let Some(stepping) =
        d.interface("CoSimulation").filter(|e| clocks && !e.flag("hasEventMode"))
    {
        findings
            .at(format!("line {}, CoSimulation", stepping.line))
            .add("it has clocks, but not hasEventMode: clocks need event mode");
    }
    let mut flags: BTreeMap<(&str, &str), (&str, bool)> = BTreeMap::new();
    for interface in d.interfaces() {
        for flag in ["needsExecutionTool", "canBeInstantiatedOnlyOncePerProcess"] {
            let key = (flag, interface.get("modelIdentifier").unwrap_or_default());
            let (first, said) =
                *flags.entry(key).or_insert((&interface.name, interface.flag(flag)));
            if said != interface.flag(flag) {
                let text =
                    format!("one binary, but {first} and {} say different things", interface.name);
                findings.at(flag).add(text);
            }
        }
    }
}

pub fn default_experiment(d: &Description, findings: &mut Findings) {
    if let Some(experiment) = experiment_numbers(&d.root, findings) {
        stop_before_start(experiment, findings);
    }
}

pub(super) fn items(of: &Element) -> Vec<&Element> {
    of.children.iter().filter(|c| c.name == "Item").collect()
}

pub fn unique(d: &Description, findings: &mut Findings) {
    unique_names(&d.root, "TypeDefinitions", items, findings);
}

pub fn units(d: &Description, findings: &mut Findings) {
    let units = unit_definitions(&d.root);
    d.each(findings, |v| {
        let aliases = v.typed.children.iter().filter(|c| c.name == "Alias");
        let shown = v.typed.get("displayUnit").into_iter();
        wrong_unit(v, shown.chain(aliases.filter_map(|alias| alias.get("displayUnit"))), &units)
    });
    for unit in units.values() {
        for part in &unit.children {
            for name in ["factor", "offset"] {
                if let Some(x) = part.number(name)
                    && (!x.is_finite() || (name == "factor" && x == 0.0))
                {
                    findings
                        .at(format!("line {}, {}", part.line, part.name))
                        .add(format!("{name}={x} (allowed: finite, factors not 0)"));
                }
            }
        }
    }
}

pub fn types(d: &Description, findings: &mut Findings) {
    let types: BTreeMap<&str, &str> = d
        .root
        .list("TypeDefinitions")
        .filter_map(|t| Some((t.get("name")?, t.name.as_ref())))
        .collect();
    d.each(findings, |v| {
        let declared = v.written.get("declaredType")?;
        match types.get(declared) {
            None => Some(format!("declaredType \"{declared}\" is not among TypeDefinitions")),
            Some(kind) if kind.strip_suffix("Type") != Some(&v.written.name) => Some(format!(
                "it is of type {}, its declaredType \"{declared}\" a {kind}",
                v.written.name
            )),
            Some(_) => None,
        }
    });
}

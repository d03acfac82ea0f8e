//! Head and definitions of modelDescription.xml (FMI 3.0.2, section 2.4): interfaces, capabilities, units, types.

use std::collections::{BTreeMap, BTreeSet};

use super::description::Description;
use crate::Findings;
use host::description::Type;
use host::xml::Element;

/// `xml.fmi_version`
pub fn fmi_version(d: &Description, findings: &mut Findings) {
    let version = d.root.get("fmiVersion").unwrap_or_default();
    if version != "3.0" {
        findings.add("fmiVersion", format!("\"{version}\" (allowed: \"3.0\")"));
    }
}

/// `xml.token`
pub fn token(d: &Description, findings: &mut Findings) {
    if d.root.get("instantiationToken").is_none_or(|token| token.trim().is_empty()) {
        findings.add("instantiationToken", "it is missing or empty");
    }
}

/// `xml.interfaces`
pub fn interfaces(d: &Description, findings: &mut Findings) {
    if d.interfaces().next().is_none() {
        findings.add(
            "fmiModelDescription",
            "none of ModelExchange, CoSimulation and ScheduledExecution is there",
        );
    }
}

/// `xml.model_identifier`
pub fn model_identifier(d: &Description, findings: &mut Findings) {
    for interface in d.interfaces() {
        let name = interface.get("modelIdentifier").unwrap_or_default();
        let first = name.chars().next();
        let is_identifier = first.is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        if !is_identifier {
            findings.add(
                format!("line {}, {}", interface.line, interface.name),
                format!(
                    "modelIdentifier=\"{name}\" (allowed: letters, digits and _, no digit first: \
                     it becomes part of a C name)"
                ),
            );
        }
    }
}

/// `xml.capabilities`
pub fn capabilities(d: &Description, findings: &mut Findings) {
    const NEEDS: [(&str, &str); 2] = [
        ("canSerializeFMUState", "canGetAndSetFMUState"),
        ("canReturnEarlyAfterIntermediateUpdate", "providesIntermediateUpdate"),
    ];
    for interface in d.interfaces() {
        let place = format!("line {}, {}", interface.line, interface.name);
        for (flag, needed) in NEEDS {
            if interface.flag(flag) && !interface.flag(needed) {
                findings.add(&place, format!("{flag} without {needed}"));
            }
        }
        if let Some(step) =
            interface.number("fixedInternalStepSize").filter(|h| h.is_nan() || *h <= 0.0)
        {
            findings.add(&place, format!("fixedInternalStepSize={step} (allowed: above 0)"));
        }
    }
    let clocks = d.variables.iter().any(|v| v.kind == Type::Clock);
    if let Some(stepping) =
        d.interface("CoSimulation").filter(|e| clocks && !e.flag("hasEventMode"))
    {
        findings.add(
            format!("line {}, CoSimulation", stepping.line),
            "it has clocks, but not hasEventMode: clocks need event mode",
        );
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
                findings.add(flag, text);
            }
        }
    }
}

/// `xml.default_experiment`
pub fn default_experiment(d: &Description, findings: &mut Findings) {
    let Some(experiment) = d.root.child("DefaultExperiment") else {
        return findings.skip("there is no DefaultExperiment");
    };
    let place = format!("line {}, DefaultExperiment", experiment.line);
    let number = |name| experiment.number(name);
    for name in ["startTime", "stopTime", "tolerance", "stepSize"] {
        if let Some(x) = number(name)
            && !(x.is_finite() && (x > 0.0 || name.ends_with("Time")))
        {
            findings
                .add(&place, format!("{name}={x} (allowed: finite, steps and tolerances above 0)"));
        }
    }
    let start = number("startTime").unwrap_or(0.0);
    if let Some(stop) = number("stopTime").filter(|stop| *stop < start) {
        findings
            .add(place, format!("stopTime={stop} is before startTime={start} (allowed: after it)"));
    }
}

/// `xml.unique`
pub fn unique(d: &Description, findings: &mut Findings) {
    let mut one = |what: &str, elements: &mut dyn Iterator<Item = &Element>, attribute: &str| {
        let mut seen = BTreeSet::new();
        for element in elements {
            if let Some(value) = element.get(attribute)
                && !seen.insert(value)
            {
                findings.add(
                    format!("line {}, {what}", element.line),
                    format!("the {attribute} \"{value}\" is there already"),
                );
            }
        }
    };
    one("Unit", &mut d.root.list("UnitDefinitions"), "name");
    one("TypeDefinitions", &mut d.root.list("TypeDefinitions"), "name");
    one("Category", &mut d.root.list("LogCategories"), "name");
    for unit in d.root.list("UnitDefinitions") {
        one("DisplayUnit", &mut unit.children.iter().filter(|c| c.name == "DisplayUnit"), "name");
    }
    for of in d.root.list("TypeDefinitions") {
        for attribute in ["name", "value"] {
            one("Item", &mut of.children.iter().filter(|c| c.name == "Item"), attribute);
        }
    }
}

/// `xml.units`
pub fn units(d: &Description, findings: &mut Findings) {
    let units: BTreeMap<&str, &Element> =
        d.root.list("UnitDefinitions").filter_map(|unit| Some((unit.get("name")?, unit))).collect();
    d.each(findings, |v| {
        let unit = v.element.get("unit");
        let aliases = v.element.children.iter().filter(|c| c.name == "Alias");
        let shown = v.element.get("displayUnit").into_iter();
        let shown = shown.chain(aliases.filter_map(|alias| alias.get("displayUnit")));
        if let Some(unit) = unit.filter(|unit| !units.contains_key(unit)) {
            return Some(format!("the unit \"{unit}\" is not among UnitDefinitions"));
        }
        for shown in shown {
            let Some(unit) = unit else {
                return Some(format!("displayUnit \"{shown}\" without a unit"));
            };
            let mut all = units[unit].children.iter().filter(|c| c.name == "DisplayUnit");
            if shown != unit && !all.any(|c| c.get("name") == Some(shown)) {
                return Some(format!("displayUnit \"{shown}\" is not defined for \"{unit}\""));
            }
        }
        None
    });
    for unit in units.values() {
        for part in &unit.children {
            for name in ["factor", "offset"] {
                if let Some(x) = part.number(name)
                    && (!x.is_finite() || (name == "factor" && x == 0.0))
                {
                    findings.add(
                        format!("line {}, {}", part.line, part.name),
                        format!("{name}={x} (allowed: finite, factors not 0)"),
                    );
                }
            }
        }
    }
}

/// `xml.types`
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

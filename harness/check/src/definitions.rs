//! Rules of the head and the definitions of modelDescription.xml (FMI 2.0.5, section 2.2): interfaces,
//! capabilities, units, types.

use std::collections::{BTreeMap, BTreeSet};

use super::description::{Common, Description};
use super::findings::Findings;
use host::xml::{Element, Fault};

pub fn well_formed(archive: &super::archive::Archive, findings: &mut Findings) {
    match archive.file("modelDescription.xml") {
        None => findings.skip("there is no modelDescription.xml that can be unpacked"),
        Some(bytes) => {
            let read = Element::parse(bytes);
            if let Err(Fault::TooLarge(_) | Fault::Doctype(_)) = read {
                // Files that are too large or have a DOCTYPE break `xml.size` or `xml.doctype`.
                findings.skip("modelDescription.xml is not read to its end");
            } else if let Err(why) = read {
                findings.at("modelDescription.xml").add(why.to_string());
            }
        }
    }
}

pub fn fmi_version(d: &Description, findings: &mut Findings) {
    if let Some(other) = d.other_version() {
        return findings.at("fmiVersion").add(format!(
            "\"{other}\": this is not FMI 2.0, and no other rule is checked (allowed: \"2.0\")"
        ));
    }
    match d.root.get("fmiVersion") {
        Some("2.0") => {}
        Some(other) => findings.at("fmiVersion").add(format!("\"{other}\" (allowed: \"2.0\")")),
        None => findings.at("fmiVersion").add("it is missing (allowed: \"2.0\")"),
    }
}

pub fn guid(d: &Description, findings: &mut Findings) {
    if d.root.get("guid").is_none_or(|guid| guid.trim().is_empty()) {
        findings.at("guid").add("it is missing or empty");
    }
}

pub fn date(d: &Description, findings: &mut Findings) {
    if let Some(date) = d.root.get("generationDateAndTime")
        && !(date.len() == 20 && date.ends_with('Z') && date.as_bytes().get(10) == Some(&b'T'))
    {
        findings
            .at("generationDateAndTime")
            .add(format!("\"{date}\" (allowed: in UTC, like 2026-01-31T12:00:00Z)"));
    }
}

pub fn interfaces(d: &Description, findings: &mut Findings) {
    if d.interfaces().next().is_none() {
        findings.at("fmiModelDescription").add("neither ModelExchange nor CoSimulation is there");
    }
}

pub fn model_identifier(d: &Description, findings: &mut Findings) {
    identifiers(d.interfaces(), findings);
}

/// Reports each interface whose modelIdentifier cannot be the start of a C function's name.
pub(crate) fn identifiers<'d>(
    interfaces: impl Iterator<Item = &'d Element>,
    findings: &mut Findings,
) {
    for interface in interfaces {
        let name = interface.get("modelIdentifier").unwrap_or_default();
        let first = name.chars().next();
        let is_identifier = first.is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        if !is_identifier {
            findings.at(format!("line {}, {}", interface.line, interface.name)).add(format!(
                "modelIdentifier=\"{name}\" (allowed: letters, digits and _, no digit first: \
                     it becomes part of a C name)"
            ));
        }
    }
}

pub fn capabilities(d: &Description, findings: &mut Findings) {
    for interface in d.interfaces() {
        if interface.flag("canSerializeFMUstate") && !interface.flag("canGetAndSetFMUstate") {
            findings
                .at(format!("line {}, {}", interface.line, interface.name))
                .add("canSerializeFMUstate without canGetAndSetFMUstate");
        }
    }
    let first = d.model_exchange.as_ref().zip(d.co_simulation.as_ref());
    if let Some((exchange, stepping)) = first
        && exchange.get("modelIdentifier") == stepping.get("modelIdentifier")
    {
        const SHARED: [&str; 3] = [
            "needsExecutionTool",
            "canBeInstantiatedOnlyOncePerProcess",
            "canNotUseMemoryManagementFunctions",
        ];
        for flag in SHARED {
            if exchange.flag(flag) != stepping.flag(flag) {
                findings
                    .at(flag)
                    .add("one binary, but the two interfaces say different things of it");
            }
        }
    }
}

pub fn state_capability(d: &Description, findings: &mut Findings) {
    for interface in d.interfaces() {
        for flag in ["canGetAndSetFMUstate", "canSerializeFMUstate"] {
            if !interface.flag(flag) {
                findings
                    .at(format!("line {}, {}", interface.line, interface.name))
                    .add(format!("{flag} is not true"));
            }
        }
    }
}

pub fn default_experiment(d: &Description, findings: &mut Findings) {
    let Some(experiment) = experiment_numbers(&d.root, findings) else { return };
    let number = |name| experiment.number(name);
    let start = number("startTime").unwrap_or(0.0);
    let Some(stop) = number("stopTime").filter(|stop| *stop >= start) else { return };
    let place = format!("line {}, DefaultExperiment", experiment.line);
    if stop == start {
        findings.at(place).add(format!("stopTime={stop} (allowed: above startTime {start})"));
    } else if let Some(step) = number("stepSize").filter(|step| *step > stop - start) {
        findings.at(place).add(format!(
            "stepSize={step} (allowed: at most stopTime - startTime = {})",
            stop - start
        ));
    }
}

/// Reports times, tolerances and step sizes of DefaultExperiment that are not finite or not positive. Returns
/// the element; if it is missing, the rule is skipped.
pub(crate) fn experiment_numbers<'d>(
    root: &'d Element,
    findings: &mut Findings,
) -> Option<&'d Element> {
    let Some(experiment) = root.child("DefaultExperiment") else {
        findings.skip("there is no DefaultExperiment");
        return None;
    };
    for name in ["startTime", "stopTime", "tolerance", "stepSize"] {
        if let Some(x) = experiment.number(name)
            && !(x.is_finite() && (x > 0.0 || name.ends_with("Time")))
        {
            findings
                .at(format!("line {}, DefaultExperiment", experiment.line))
                .add(format!("{name}={x} (allowed: finite, steps and tolerances above 0)"));
        }
    }
    Some(experiment)
}

pub fn stop_time(d: &Description, findings: &mut Findings) {
    match d.root.child("DefaultExperiment") {
        None => findings.skip("there is no DefaultExperiment"),
        Some(experiment) => stop_before_start(experiment, findings),
    }
}

pub(crate) fn stop_before_start(experiment: &Element, findings: &mut Findings) {
    let start = experiment.number("startTime").unwrap_or(0.0);
    if let Some(stop) = experiment.number("stopTime").filter(|stop| *stop < start) {
        findings
            .at(format!("line {}, DefaultExperiment", experiment.line))
            .add(format!("stopTime={stop} is before startTime={start} (allowed: after it)"));
    }
}

pub fn unique(d: &Description, findings: &mut Findings) {
    unique_names(&d.root, "SimpleType", |simple| simple.list("Enumeration").collect(), findings);
}

/// Reports definitions (of units and types) whose names are repeated, and types two of whose items have the
/// same name or value. `items` returns the items of a type's element.
pub(crate) fn unique_names(
    root: &Element,
    of_type: &str,
    items: impl Fn(&Element) -> Vec<&Element>,
    findings: &mut Findings,
) {
    let mut one = |what: &str, elements: &mut dyn Iterator<Item = &Element>, attribute: &str| {
        let mut seen = BTreeSet::new();
        for element in elements {
            if let Some(value) = element.get(attribute)
                && !seen.insert(value)
            {
                findings
                    .at(format!("line {}, {what}", element.line))
                    .add(format!("the {attribute} \"{value}\" is there already"));
            }
        }
    };
    one("Unit", &mut root.list("UnitDefinitions"), "name");
    one(of_type, &mut root.list("TypeDefinitions"), "name");
    one("Category", &mut root.list("LogCategories"), "name");
    for unit in root.list("UnitDefinitions") {
        one("DisplayUnit", &mut unit.children.iter().filter(|c| c.name == "DisplayUnit"), "name");
    }
    for simple in root.list("TypeDefinitions") {
        for attribute in ["name", "value"] {
            one("Item", &mut items(simple).into_iter(), attribute);
        }
    }
}

pub fn units(d: &Description, findings: &mut Findings) {
    let units = unit_definitions(&d.root);
    d.each(findings, |v| wrong_unit(v, v.typed.get("displayUnit"), &units));
}

pub(crate) fn unit_definitions(root: &Element) -> BTreeMap<&str, &Element> {
    root.list("UnitDefinitions").filter_map(|unit| Some((unit.get("name")?, unit))).collect()
}

pub(crate) fn wrong_unit<'d>(
    v: &Common,
    shown: impl IntoIterator<Item = &'d str>,
    units: &BTreeMap<&str, &Element>,
) -> Option<String> {
    let unit = v.typed.get("unit");
    if let Some(unit) = unit.filter(|unit| !units.contains_key(unit)) {
        return Some(format!("the unit \"{unit}\" is not among UnitDefinitions"));
    }
    shown.into_iter().find_map(|shown| {
        let Some(unit) = unit else {
            return Some(format!("displayUnit \"{shown}\" without a unit"));
        };
        let mut all = units[unit].children.iter().filter(|c| c.name == "DisplayUnit");
        (shown != unit && !all.any(|c| c.get("name") == Some(shown)))
            .then(|| format!("displayUnit \"{shown}\" is not defined for \"{unit}\""))
    })
}

pub fn types(d: &Description, findings: &mut Findings) {
    let types: BTreeMap<&str, &str> = d
        .root
        .list("TypeDefinitions")
        .filter_map(|t| Some((t.get("name")?, t.children.first()?.name.as_ref())))
        .collect();
    d.each(findings, |v| {
        let declared = v.typed.get("declaredType")?;
        match types.get(declared) {
            None => Some(format!("declaredType \"{declared}\" is not among TypeDefinitions")),
            Some(kind) if *kind != v.typed.name => {
                Some(format!("it is a {}, its declaredType \"{declared}\" a {kind}", v.typed.name))
            }
            Some(_) => None,
        }
    });
    let used: BTreeSet<&str> = d.variables.iter().map(|v| v.name.as_str()).collect();
    for name in types.keys().filter(|name| used.contains(*name)) {
        findings.at(format!("SimpleType \"{name}\"")).add("a variable has the same name");
    }
}

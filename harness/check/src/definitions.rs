//! Rules about the attributes of fmiModelDescription and about its definitions (FMI 2.0.5, section 2.2; FMI 3.0.2,
//! section 2.4): interfaces, capabilities, units, types.

use std::collections::{BTreeMap, BTreeSet};

use super::description::Description;
use super::findings::Findings;
use host::xml::{Element, Fault};

pub fn well_formed(archive: &super::archive::Archive, findings: &mut Findings) {
    match archive.description_or_skip(findings).map(Element::parse) {
        None | Some(Ok(_)) => {}
        // Files that are too large or have a DOCTYPE break `xml.size` or `xml.doctype`.
        Some(Err(Fault::TooLarge(_) | Fault::Doctype(_))) => {
            findings.skip("modelDescription.xml cannot be read to its end");
        }
        Some(Err(why)) => findings.at("modelDescription.xml").add(why.to_string()),
    }
}

pub fn fmi_version(d: &Description, findings: &mut Findings) {
    let (expected, version) = (d.words.version, d.root.get("fmiVersion"));
    let text = match (d.other_version(), version) {
        (Some(other), _) => {
            format!("\"{other}\", so that no other rule is checked for this FMU")
        }
        (None, Some(version)) if version == expected => return,
        (None, Some(other)) => format!("\"{other}\""),
        (None, None) => "the attribute is missing".into(),
    };
    findings.at("fmiVersion").add(format!("{text} (allowed: \"{expected}\")"));
}

pub fn token(d: &Description, findings: &mut Findings) {
    let name = d.words.token;
    if d.root.get(name).is_none_or(|token| token.trim().is_empty()) {
        findings.at(name).add("the attribute is missing or empty");
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
        findings.at("fmiModelDescription").add(match d.is_fmi3() {
            true => "the element ModelExchange, CoSimulation or ScheduledExecution is missing (required: at least one)",
            false => "the element ModelExchange or CoSimulation is missing (required: at least one)",
        });
    }
}

/// Reports each interface whose modelIdentifier cannot be the beginning of a C function's name.
pub fn model_identifier(d: &Description, findings: &mut Findings) {
    for interface in d.interfaces() {
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
    const NEEDS: [(&str, &str); 3] = [
        ("canSerializeFMUstate", "canGetAndSetFMUstate"),
        ("canSerializeFMUState", "canGetAndSetFMUState"),
        ("canReturnEarlyAfterIntermediateUpdate", "providesIntermediateUpdate"),
    ];
    /// Attributes of an interface that describe the binary. If two interfaces use one binary, they must have the same values.
    const SHARED: [&str; 3] = [
        "needsExecutionTool",
        "canBeInstantiatedOnlyOncePerProcess",
        "canNotUseMemoryManagementFunctions",
    ];
    let mut flags: BTreeMap<(&str, &str), (&str, bool)> = BTreeMap::new();
    for interface in d.interfaces() {
        let place = format!("line {}, {}", interface.line, interface.name);
        for (flag, needed) in NEEDS {
            if interface.flag(flag) && !interface.flag(needed) {
                findings.at(&place).add(format!(
                    "{flag} is true, but {needed} is not (required: {flag} needs {needed})"
                ));
            }
        }
        let step = interface.number("fixedInternalStepSize");
        if let Some(step) = step.filter(|h| h.is_nan() || *h <= 0.0) {
            findings.at(&place).add(format!("fixedInternalStepSize={step} (allowed: above 0)"));
        }
        if interface.name == "CoSimulation" && d.has_clocks() && !interface.flag("hasEventMode") {
            let text = "the FMU has clocks, but hasEventMode is not true (required: clocks need event mode)";
            findings.at(&place).add(text);
        }
        for flag in SHARED {
            let key = (flag, interface.get("modelIdentifier").unwrap_or_default());
            let own = interface.flag(flag);
            let (first, said) = *flags.entry(key).or_insert((&interface.name, own));
            if said != own {
                let other = &interface.name;
                let text = format!(
                    "{first} and {other} declare different values, although one binary serves both (required: equal values)"
                );
                findings.at(flag).add(text);
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
fn experiment_numbers<'d>(root: &'d Element, findings: &mut Findings) -> Option<&'d Element> {
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

pub fn default_experiment3(d: &Description, findings: &mut Findings) {
    if experiment_numbers(&d.root, findings).is_some() {
        stop_time(d, findings);
    }
}

pub fn stop_time(d: &Description, findings: &mut Findings) {
    let Some(experiment) = d.root.child("DefaultExperiment") else {
        return findings.skip("there is no DefaultExperiment");
    };
    let start = experiment.number("startTime").unwrap_or(0.0);
    if let Some(stop) = experiment.number("stopTime").filter(|stop| *stop < start) {
        findings
            .at(format!("line {}, DefaultExperiment", experiment.line))
            .add(format!("stopTime={stop} is before startTime={start} (allowed: after it)"));
    }
}

/// Returns the items of an enumeration's type. In FMI 3.0 they are children of the type itself.
pub(crate) fn items(of: &Element) -> impl Iterator<Item = &Element> {
    of.children.iter().chain(of.list("Enumeration")).filter(|child| child.name == "Item")
}

/// Reports definitions of units and types with equal names, and types in which two items have the same name or value.
pub fn unique(d: &Description, findings: &mut Findings) {
    let root = &d.root;
    let mut one = |what: &str, elements: &mut dyn Iterator<Item = &Element>, attribute: &str| {
        let mut seen = BTreeSet::new();
        for element in elements {
            if let Some(value) = element.get(attribute)
                && !seen.insert(value)
            {
                findings.at(format!("line {}, {what}", element.line)).add(format!(
                    "an earlier definition has the same {attribute} \"{value}\" (required: unique)"
                ));
            }
        }
    };
    let of_type = if d.is_fmi3() { "TypeDefinitions" } else { "SimpleType" };
    one("Unit", &mut root.list("UnitDefinitions"), "name");
    one(of_type, &mut root.list("TypeDefinitions"), "name");
    one("Category", &mut root.list("LogCategories"), "name");
    for unit in root.list("UnitDefinitions") {
        one("DisplayUnit", &mut unit.children.iter().filter(|c| c.name == "DisplayUnit"), "name");
    }
    for simple in root.list("TypeDefinitions") {
        for attribute in ["name", "value"] {
            one("Item", &mut items(simple), attribute);
        }
    }
}

pub fn units_with_numbers(d: &Description, findings: &mut Findings) {
    units(d, findings);
    super::units::numbers(d, findings);
}

pub fn units(d: &Description, findings: &mut Findings) {
    let definitions = d.root.list("UnitDefinitions");
    let units: BTreeMap<&str, &Element> =
        definitions.filter_map(|unit| Some((unit.get("name")?, unit))).collect();
    d.each(findings, |v| {
        let unit = v.typed.get("unit");
        if let Some(unit) = unit.filter(|unit| !units.contains_key(unit)) {
            return Some(format!("the unit \"{unit}\" is not defined in UnitDefinitions"));
        }
        let aliases = v.typed.children.iter().filter(|c| c.name == "Alias");
        [&v.typed].into_iter().chain(aliases).filter_map(|of| of.get("displayUnit")).find_map(
            |shown| {
                let Some(unit) = unit else {
                    return Some(format!("displayUnit=\"{shown}\", but the variable has no unit (required with displayUnit)"));
                };
                let mut all = units[unit].children.iter().filter(|c| c.name == "DisplayUnit");
                (shown != unit && !all.any(|c| c.get("name") == Some(shown)))
                    .then(|| format!("displayUnit=\"{shown}\" is not defined as a DisplayUnit of the unit \"{unit}\""))
            },
        )
    });
}

pub fn types(d: &Description, findings: &mut Findings) {
    // In FMI 2.0 the element of a type has a child such as Real; in FMI 3.0 the element itself has a name such as Float64Type.
    let kind = |of: &'_ Element| match d.is_fmi3() {
        true => of.name.strip_suffix("Type").map(String::from),
        false => Some(of.children.first()?.name.to_string()),
    };
    let definitions = d.root.list("TypeDefinitions");
    let types: BTreeMap<&str, String> =
        definitions.filter_map(|t| Some((t.get("name")?, kind(t)?))).collect();
    d.each(findings, |v| {
        let declared = v.typed.get("declaredType")?;
        match types.get(declared) {
            None => Some(format!("declaredType=\"{declared}\" is not defined in TypeDefinitions")),
            Some(kind) if *kind != v.typed.name => Some(format!(
                "the variable is a {}, but its declaredType \"{declared}\" a {kind}",
                v.typed.name
            )),
            Some(_) => None,
        }
    });
    let used: BTreeSet<&str> = d.variables.iter().map(|v| v.name.as_str()).collect();
    for name in types.keys().filter(|name| !d.is_fmi3() && used.contains(*name)) {
        findings.at(format!("SimpleType \"{name}\"")).add("a variable has the same name");
    }
}

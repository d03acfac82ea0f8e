//! The schema of modelDescription.xml as a table: the elements with their parents and order, their
//! attributes, and the format of each attribute. This file has the table of FMI 2.0 (2.0.5, section 2.2);
//! `schema/fmi3.rs` has the table of FMI 3.0.

mod fmi3;

use super::description::Description;
use super::findings::Findings;
use host::xml::{Element, double};

#[derive(Clone, Copy)]
pub enum Written {
    Text,
    Boolean,
    Int,
    Unsigned,
    Double,
    Time,
    Long,
    List(&'static Written),
    OneOf(&'static [&'static str]),
    Words(&'static [&'static str]),
}

use Written::*;

/// Elements of the schema with the same attributes and children. `names` has their names, separated by
/// spaces; a name is `parent/name` if elements of this name differ between parents.
pub struct Kind {
    names: &'static str,
    needed: Attributes,
    optional: [Attributes; 3],
    children: Children,
}

pub type Attributes = &'static [(&'static str, Written)];

pub enum Children {
    Any,
    /// Each of these child elements at most once, in this order. Elements marked with `!` are required.
    Sequence(&'static [&'static str]),
    Ordered(&'static [&'static str]),
    Many(&'static [&'static str]),
    /// Exactly one of the elements in the first list, then any number of elements of the second list.
    Choice(&'static [&'static str], &'static [&'static str]),
}

use Children::*;

const CAUSALITY: Written =
    OneOf(&["parameter", "calculatedParameter", "input", "output", "local", "independent"]);
pub(crate) const VARIABILITY: Written =
    OneOf(&["constant", "fixed", "tunable", "discrete", "continuous"]);
pub(crate) const INITIAL: Written = OneOf(&["exact", "approx", "calculated"]);
pub(crate) const DEPENDENCY: Written =
    Words(&["dependent", "constant", "fixed", "tunable", "discrete"]);
const TYPES: &[&str] = &["Real", "Integer", "Boolean", "String", "Enumeration"];

pub const fn kind(
    names: &'static str,
    needed: Attributes,
    optional: Attributes,
    children: Children,
) -> Kind {
    Kind { names, needed, optional: [&[], optional, &[]], children }
}

impl Kind {
    pub const fn and(mut self, shared: Attributes) -> Kind {
        self.optional[0] = shared;
        self
    }

    pub const fn then(mut self, more: Attributes) -> Kind {
        self.optional[2] = more;
        self
    }

    fn attributes(&self) -> impl Iterator<Item = &'static (&'static str, Written)> {
        self.needed.iter().chain(self.optional.into_iter().flatten())
    }

    fn is_named(&self, name: &str) -> bool {
        self.names.split(' ').any(|own| own == name)
    }
}

#[rustfmt::skip]
pub const BASE_UNIT: Attributes = &[("kg", Int), ("m", Int), ("s", Int), ("A", Int), ("K", Int), ("mol", Int),
    ("cd", Int), ("rad", Int), ("factor", Double), ("offset", Double)];
pub const EXPERIMENT: Attributes =
    &[("startTime", Double), ("stopTime", Double), ("tolerance", Double), ("stepSize", Double)];

#[rustfmt::skip]
static KINDS: &[Kind] = &[
    kind("fmiModelDescription",
        // Another rule checks the value of fmiVersion.
        &[("fmiVersion", Text), ("modelName", Text), ("guid", Text)],
        &[("description", Text), ("author", Text), ("version", Text), ("copyright", Text),
          ("license", Text), ("generationTool", Text), ("generationDateAndTime", Time),
          ("variableNamingConvention", OneOf(&["flat", "structured"])),
          ("numberOfEventIndicators", Unsigned)],
        Sequence(&["ModelExchange", "CoSimulation", "UnitDefinitions", "TypeDefinitions",
            "LogCategories", "DefaultExperiment", "VendorAnnotations", "!ModelVariables",
            "!ModelStructure"])),
    kind("ModelExchange", &[("modelIdentifier", Text)],
        &[("needsExecutionTool", Boolean), ("completedIntegratorStepNotNeeded", Boolean),
          ("canBeInstantiatedOnlyOncePerProcess", Boolean),
          ("canNotUseMemoryManagementFunctions", Boolean), ("canGetAndSetFMUstate", Boolean),
          ("canSerializeFMUstate", Boolean), ("providesDirectionalDerivative", Boolean)],
        Sequence(&["SourceFiles"])),
    kind("CoSimulation", &[("modelIdentifier", Text)],
        &[("needsExecutionTool", Boolean), ("canHandleVariableCommunicationStepSize", Boolean),
          ("canInterpolateInputs", Boolean), ("maxOutputDerivativeOrder", Unsigned),
          ("canRunAsynchronuously", Boolean), ("canBeInstantiatedOnlyOncePerProcess", Boolean),
          ("canNotUseMemoryManagementFunctions", Boolean), ("canGetAndSetFMUstate", Boolean),
          ("canSerializeFMUstate", Boolean), ("providesDirectionalDerivative", Boolean)],
        Sequence(&["SourceFiles"])),
    kind("SourceFiles", &[], &[], Many(&["File"])),
    kind("File", &[("name", Text)], &[], Sequence(&[])),
    kind("UnitDefinitions", &[], &[], Many(&["Unit"])),
    kind("Unit", &[("name", Text)], &[], Choice(&[], &["BaseUnit", "DisplayUnit"])),
    kind("BaseUnit", &[], BASE_UNIT, Sequence(&[])),
    kind("DisplayUnit", &[("name", Text)], &[("factor", Double), ("offset", Double)], Sequence(&[])),
    kind("TypeDefinitions", &[], &[], Many(&["SimpleType"])),
    kind("SimpleType", &[("name", Text)], &[("description", Text)], Choice(TYPES, &[])),
    kind("SimpleType/Real", &[],
        &[("quantity", Text), ("unit", Text), ("displayUnit", Text), ("relativeQuantity", Boolean),
          ("min", Double), ("max", Double), ("nominal", Double), ("unbounded", Boolean)],
        Sequence(&[])),
    kind("SimpleType/Integer", &[], &[("quantity", Text), ("min", Int), ("max", Int)], Sequence(&[])),
    kind("SimpleType/Boolean SimpleType/String", &[], &[], Sequence(&[])),
    kind("SimpleType/Enumeration", &[], &[("quantity", Text)], Many(&["Item"])),
    kind("Item", &[("name", Text), ("value", Int)], &[("description", Text)], Sequence(&[])),
    kind("LogCategories", &[], &[], Many(&["Category"])),
    kind("Category", &[("name", Text)], &[("description", Text)], Sequence(&[])),
    kind("DefaultExperiment", &[], EXPERIMENT, Sequence(&[])),
    kind("VendorAnnotations Annotations", &[], &[], Many(&["Tool"])),
    kind("Tool", &[("name", Text)], &[], Any),
    kind("ModelVariables", &[], &[], Many(&["ScalarVariable"])),
    kind("ScalarVariable", &[("name", Text), ("valueReference", Unsigned)],
        &[("description", Text), ("causality", CAUSALITY), ("variability", VARIABILITY),
          ("initial", INITIAL), ("canHandleMultipleSetPerTimeInstant", Boolean)],
        Choice(TYPES, &["Annotations"])),
    kind("ScalarVariable/Real", &[],
        &[("declaredType", Text), ("quantity", Text), ("unit", Text), ("displayUnit", Text),
          ("relativeQuantity", Boolean), ("min", Double), ("max", Double), ("nominal", Double),
          ("unbounded", Boolean), ("start", Double), ("derivative", Unsigned), ("reinit", Boolean)],
        Sequence(&[])),
    kind("ScalarVariable/Integer", &[],
        &[("declaredType", Text), ("quantity", Text), ("min", Int), ("max", Int), ("start", Int)],
        Sequence(&[])),
    kind("ScalarVariable/Boolean", &[], &[("declaredType", Text), ("start", Boolean)], Sequence(&[])),
    kind("ScalarVariable/String", &[], &[("declaredType", Text), ("start", Text)], Sequence(&[])),
    kind("ScalarVariable/Enumeration", &[("declaredType", Text)],
        &[("quantity", Text), ("min", Int), ("max", Int), ("start", Int)],
        Sequence(&[])),
    kind("ModelStructure", &[], &[], Sequence(&["Outputs", "Derivatives", "InitialUnknowns"])),
    kind("Outputs Derivatives InitialUnknowns", &[], &[], Many(&["Unknown"])),
    kind("Unknown", &[("index", Unsigned)],
        &[("dependencies", INDICES), ("dependenciesKind", DEPENDENCY)],
        Sequence(&[])),
];

fn find(kinds: &'static [Kind], parent: &str, name: &str) -> Option<&'static Kind> {
    let full = format!("{parent}/{name}");
    kinds.iter().find(|k| k.is_named(&full)).or_else(|| kinds.iter().find(|k| k.is_named(name)))
}

pub const INDICES: Written = List(&Unsigned);
pub const LONGS: Written = List(&Long);
pub const DOUBLES: Written = List(&Double);
pub const BOOLEANS: Written = List(&Boolean);

impl Written {
    fn accepts(self, value: &str) -> bool {
        let value = value.trim();
        match self {
            Text => true,
            Boolean => matches!(value, "true" | "false" | "0" | "1"),
            Int => value.parse::<i32>().is_ok(),
            Unsigned => value.parse::<u32>().is_ok(),
            Long => value.parse::<i64>().is_ok() || value.parse::<u64>().is_ok(),
            Double => double(value).is_some(),
            Time => is_time(value),
            List(one) => value.split_whitespace().all(|word| one.accepts(word)),
            OneOf(words) => words.contains(&value),
            Words(words) => value.split_whitespace().all(|word| words.contains(&word)),
        }
    }

    fn allowed(self) -> String {
        match self {
            Text => "any text".into(),
            Boolean => "true, false, 1, 0".into(),
            Int => "a whole number of 32 bits".into(),
            Unsigned => "a whole number from 0 on".into(),
            Long => "a whole number of 64 bits".into(),
            Double => "a number with a decimal point, INF, -INF or NaN".into(),
            Time => "year-month-dayThour:minute:secondZ".into(),
            List(Unsigned | Long) => "whole numbers with spaces between".into(),
            List(Double) => {
                "numbers with a decimal point, INF, -INF or NaN, with spaces between".into()
            }
            List(one) => format!("{} with spaces between", one.allowed()),
            OneOf(words) | Words(words) => words.join(", "),
        }
    }
}

/// Returns true if `text` is an `xs:dateTime`; fractions of seconds and time zones are allowed.
fn is_time(text: &str) -> bool {
    let Some((date, time)) = text.split_once('T') else { return false };
    let date: Vec<Option<u32>> = date.split('-').map(|part| part.parse().ok()).collect();
    let [Some(_), Some(month @ 1..=12), Some(day @ 1..)] = date[..] else { return false };
    let days = match month {
        2 => 29,
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    };
    let zone = time.find(['Z', '+', '-']).unwrap_or(time.len());
    let (clock, zone) = time.split_at(zone);
    let zone_fits = matches!(zone, "" | "Z")
        || zone[1..].split_once(':').is_some_and(|(h, m)| {
            h.len() == 2 && m.len() == 2 && h.parse::<u32>().is_ok() && m.parse::<u32>().is_ok()
        });
    let parts: Vec<&str> = clock.split(':').collect();
    let [hour, minute, second] = parts[..] else { return false };
    let below = |text: &str, limit: f64| {
        text.len() >= 2
            && text.starts_with(|c: char| c.is_ascii_digit())
            && double(text).is_some_and(|x| (0.0..limit).contains(&x))
    };
    let whole = |text: &str| text.len() == 2 && text.parse::<u32>().is_ok();
    day <= days
        && zone_fits
        && whole(hour)
        && whole(minute)
        && below(hour, 24.0)
        && below(minute, 60.0)
        && below(second, 61.0)
}

fn place(element: &Element) -> String {
    match element.get("name") {
        Some(name) => format!("line {}, {} \"{name}\"", element.line, element.name),
        None => format!("line {}, {}", element.line, element.name),
    }
}

fn kinds(d: &Description) -> &'static [Kind] {
    if d.is_fmi3() { fmi3::KINDS } else { KINDS }
}

/// `xml.schema`: reports elements and attributes that are unknown, missing or in the wrong order.
pub fn structure(d: &Description, findings: &mut Findings) {
    if d.root.name != "fmiModelDescription" {
        return findings.at(place(&d.root)).add("the root element is not fmiModelDescription");
    }
    elements(kinds(d), "", &d.root, findings);
}

/// Elements in which the schema of FMI 3.0 allows any attribute of other namespaces and of vendors.
const ANY_ATTRIBUTE: [&str; 3] = ["ModelExchange", "CoSimulation", "ScheduledExecution"];

fn elements(kinds: &'static [Kind], parent: &str, element: &Element, findings: &mut Findings) {
    let Some(kind) = find(kinds, parent, &element.name) else { return };
    let is_open = !std::ptr::eq(kinds, KINDS) && ANY_ATTRIBUTE.contains(&&*element.name);
    for (attribute, _) in &element.attributes {
        let known = kind.attributes().any(|(name, _)| name == attribute);
        // xsi:noNamespaceSchemaLocation is part of XML Schema itself and always allowed.
        if !known
            && !is_open
            && attribute != "noNamespaceSchemaLocation"
            && attribute != "schemaLocation"
        {
            let all: Vec<_> = kind.attributes().map(|(name, _)| *name).collect();
            let all = if all.is_empty() { "none".to_string() } else { all.join(", ") };
            findings
                .at(place(element))
                .add(format!("the schema has no attribute {attribute} (allowed: {all})"));
        }
    }
    for (name, _) in kind.needed {
        if element.get(name).is_none() {
            findings.at(place(element)).add(format!("the attribute {name} is missing"));
        }
    }
    children(kind, element, findings);
    if !matches!(kind.children, Any) {
        for child in &element.children {
            elements(kinds, &element.name, child, findings);
        }
    }
}

fn children(kind: &Kind, element: &Element, findings: &mut Findings) {
    let unknown = |child: &Element, allowed: &[&str], findings: &mut Findings| {
        let allowed = match allowed.len() {
            0 => "nothing".to_string(),
            _ => allowed.join(", ").replace('!', ""),
        };
        findings
            .at(place(child))
            .add(format!("the element is not allowed in {} (allowed: {allowed})", element.name));
    };
    match kind.children {
        Any => {}
        Ordered(names) => {
            let mut reached = 0;
            for child in &element.children {
                match names.iter().position(|name| *name == child.name) {
                    None => unknown(child, names, findings),
                    Some(at) if at < reached => findings.at(place(child)).add(format!(
                        "the element stands after {} (allowed order: {})",
                        names[reached],
                        names.join(", ")
                    )),
                    Some(at) => reached = at,
                }
            }
        }
        Many(names) => {
            if element.children.is_empty() {
                let one = if let [name] = names { name } else { "element" };
                findings
                    .at(place(element))
                    .add(format!("the element is empty (allowed: one {one} or more)"));
            }
            for child in element.children.iter().filter(|c| !names.contains(&&*c.name)) {
                unknown(child, names, findings);
            }
        }
        Sequence(names) => {
            let mut reached = 0;
            let mut seen: Vec<&str> = Vec::new();
            for child in &element.children {
                let at = names.iter().position(|name| name.trim_start_matches('!') == child.name);
                let Some(at) = at else {
                    unknown(child, names, findings);
                    continue;
                };
                if seen.contains(&&*child.name) {
                    findings.at(place(child)).add("the element occurs twice (allowed: once)");
                } else if at < reached && child.name != "ModelExchange" {
                    // Elements of the two interfaces may come in any order.
                    findings.at(place(child)).add(format!(
                        "the element stands after {} (allowed order: {})",
                        names[reached].trim_start_matches('!'),
                        names.join(", ").replace('!', "")
                    ));
                }
                reached = reached.max(at);
                seen.push(&child.name);
            }
            for name in names.iter().filter_map(|name| name.strip_prefix('!')) {
                if !seen.contains(&name) {
                    findings.at(place(element)).add(format!("the element {name} is missing"));
                }
            }
        }
        Choice(choice, rest) => {
            let chosen = element.children.iter().filter(|child| choice.contains(&&*child.name));
            let count = chosen.count();
            if !choice.is_empty() && count != 1 {
                findings.at(place(element)).add(format!(
                    "{count} types are given (allowed: one of {})",
                    choice.join(", ")
                ));
            }
            let all = [choice, rest].concat();
            let mut reached = 0;
            for child in &element.children {
                match all.iter().position(|name| *name == child.name) {
                    None => unknown(child, &all, findings),
                    // The element of the type comes first, for every type.
                    Some(at) if at.max(choice.len().saturating_sub(1)) < reached => {
                        findings.at(place(child)).add(format!(
                            "the element stands too late (allowed order: {})",
                            all.join(", ")
                        ));
                    }
                    Some(at) => reached = reached.max(at.max(choice.len().saturating_sub(1))),
                }
            }
        }
    }
}

/// `xml.values`: reports attributes whose values do not have the required format.
pub fn values(d: &Description, findings: &mut Findings) {
    value(kinds(d), "", &d.root, findings);
}

fn value(kinds: &'static [Kind], parent: &str, element: &Element, findings: &mut Findings) {
    let Some(kind) = find(kinds, parent, &element.name) else { return };
    for (name, written) in kind.attributes() {
        if let Some(value) = element.get(name).filter(|value| !written.accepts(value)) {
            let allowed = written.allowed();
            findings.at(place(element)).add(format!("{name}=\"{value}\" (allowed: {allowed})"));
        }
    }
    if !matches!(kind.children, Any) {
        for child in &element.children {
            self::value(kinds, &element.name, child, findings);
        }
    }
}

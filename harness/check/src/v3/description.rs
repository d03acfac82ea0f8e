//! modelDescription.xml of FMI 3.0.2 (section 2.4): what it says, and whether it may say so.

use std::collections::{BTreeMap, BTreeSet};

use crate::Findings;
use host::description::{CType, Type};
use host::xml::{Element, double};

/// The parts of modelDescription.xml that rules need, read without judging.
pub struct Description {
    /// All of it.
    pub root: Element,
    /// In the order of the file.
    pub variables: Vec<Variable>,
    /// The elements of ModelStructure, in the order of the file.
    pub structure: Vec<Unknown>,
}

/// A variable.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Line of the file.
    pub line: u64,
    /// Its name.
    pub name: String,
    /// Its value reference; 0 if that cannot be read.
    pub reference: u32,
    /// As written, or the default "local".
    pub causality: String,
    /// As written, or the default for causality and type.
    pub variability: String,
    /// As written, or the default for causality and variability, if there is one.
    pub initial: Option<String>,
    /// In which type calls exchange it.
    pub c_type: CType,
    /// What it is to people.
    pub kind: Type,
    /// Its start values, as written.
    pub starts: Vec<String>,
    /// Sizes with the start values of structural parameters; empty for a scalar.
    pub dimensions: Vec<usize>,
    /// The element, attributes of the declared type filled in.
    pub element: Element,
    /// The element as written.
    pub written: Element,
}

/// An element of ModelStructure.
#[derive(Clone, Debug)]
pub struct Unknown {
    /// Its name: Output and so on.
    pub list: String,
    /// Line of the file.
    pub line: u64,
    /// Value reference; none if it cannot be read.
    pub reference: Option<u32>,
    /// What it depends on; none if that is not said: on everything.
    pub dependencies: Option<Vec<u32>>,
    /// How.
    pub kinds: Option<Vec<String>>,
}

impl Variable {
    /// Where it is, for findings.
    pub fn place(&self) -> String {
        format!("line {}, {}", self.line, self.name)
    }

    /// Whether it is a floating-point number.
    pub fn is_float(&self) -> bool {
        self.kind == Type::Real
    }

    /// Whether it may change at any time.
    pub fn is_continuous(&self) -> bool {
        self.is_float() && self.variability == "continuous"
    }

    /// Value reference of what it is the derivative of.
    pub fn derivative_of(&self) -> Option<u32> {
        self.element.get("derivative")?.trim().parse().ok()
    }

    /// How many values it has.
    pub fn length(&self) -> usize {
        self.dimensions.iter().product()
    }

    /// Whether a host sets it before and while it runs.
    pub fn is_set_by_hosts(&self) -> bool {
        matches!(self.causality.as_str(), "input" | "parameter")
    }

    /// Whether values of it are exchanged by calls that the rules make.
    pub fn is_exchanged(&self) -> bool {
        !matches!(self.kind, Type::Binary | Type::Clock) && self.element.get("clocks").is_none()
    }

    /// Its bounds; infinite where there are none.
    pub fn bounds(&self) -> (f64, f64) {
        let bound = |name, none| self.element.number(name).filter(|x| !x.is_nan()).unwrap_or(none);
        (bound("min", f64::NEG_INFINITY), bound("max", f64::INFINITY))
    }

    /// Its order of magnitude.
    pub fn nominal(&self) -> f64 {
        let nominal = self.element.number("nominal").filter(|n| n.is_finite() && *n > 0.0);
        nominal.unwrap_or(1.0)
    }
}

/// The default of `initial` and what is allowed (2.4.7.5); `None` where causality and variability do not go
/// together, an empty list where `initial` must not be written.
fn initials(causality: &str, variability: &str) -> Option<&'static [&'static str]> {
    match (causality, variability) {
        ("parameter" | "structuralParameter", "fixed" | "tunable") => Some(&["exact"]),
        ("calculatedParameter", "fixed" | "tunable") => Some(&["calculated", "approx"]),
        ("input", "discrete" | "continuous") => Some(&["exact"]),
        ("output" | "local", "constant") => Some(&["exact"]),
        ("output" | "local", "discrete" | "continuous") => Some(&["calculated", "exact", "approx"]),
        ("local", "fixed" | "tunable") => Some(&["calculated", "approx"]),
        ("independent", "continuous") => Some(&[]),
        _ => None,
    }
}

impl Description {
    /// Reads the file, whose tree is `root`.
    pub fn new(root: Element) -> Description {
        let types: BTreeMap<&str, &Element> =
            root.list("TypeDefinitions").filter_map(|t| Some((t.get("name")?, t))).collect();
        let sizes: BTreeMap<&str, usize> = root
            .list("ModelVariables")
            .filter_map(|e| Some((e.get("valueReference")?, e.get("start")?.trim().parse().ok()?)))
            .collect();
        let variables = root.list("ModelVariables");
        let variables = variables.filter_map(|e| variable(e, &types, &sizes)).collect();
        let structure = root.list("ModelStructure").map(unknown).collect();
        Description { variables, structure, root }
    }

    /// The first variable of a value reference.
    pub fn at(&self, reference: u32) -> Option<&Variable> {
        self.variables.iter().find(|v| v.reference == reference)
    }

    /// An interface.
    pub fn interface(&self, name: &str) -> Option<&Element> {
        self.root.child(name)
    }

    /// The interfaces there are.
    pub fn interfaces(&self) -> impl Iterator<Item = &Element> {
        ["ModelExchange", "CoSimulation", "ScheduledExecution"]
            .into_iter()
            .filter_map(|name| self.root.child(name))
    }

    /// Elements of ModelStructure of one name.
    pub fn unknowns<'a>(&'a self, list: &'a str) -> impl Iterator<Item = &'a Unknown> {
        self.structure.iter().filter(move |u| u.list == list)
    }

    /// Value references of the continuous states, in the order of their derivatives.
    pub fn states(&self) -> Vec<u32> {
        let derivatives = self.unknowns("ContinuousStateDerivative");
        derivatives.filter_map(|u| self.at(u.reference?)?.derivative_of()).collect()
    }

    fn each(&self, findings: &mut Findings, wrong: impl Fn(&Variable) -> Option<String>) {
        for variable in &self.variables {
            if let Some(text) = wrong(variable) {
                findings.add(variable.place(), text);
            }
        }
    }

    fn name_of(&self, reference: Option<u32>) -> String {
        match reference.map(|r| (r, self.at(r))) {
            Some((_, Some(v))) => v.name.clone(),
            Some((r, None)) => format!("valueReference {r}"),
            None => "no valueReference".into(),
        }
    }
}

fn variable(
    element: &Element,
    types: &BTreeMap<&str, &Element>,
    sizes: &BTreeMap<&str, usize>,
) -> Option<Variable> {
    let (c_type, kind) = CType::of_element(&element.name)?;
    let mut whole = element.clone();
    let declared = element.get("declaredType").and_then(|name| types.get(name)).copied();
    for (name, value) in declared.iter().flat_map(|declared| &declared.attributes) {
        if whole.get(name).is_none() {
            whole.attributes.push((name.clone(), value.clone()));
        }
    }
    let text = |name: &str, default: &str| element.get(name).unwrap_or(default).trim().to_string();
    let causality = text("causality", "local");
    let default = match kind {
        _ if causality.to_lowercase().ends_with("parameter") => "fixed",
        Type::Real => "continuous",
        _ => "discrete",
    };
    let variability = text("variability", default);
    let default = initials(&causality, &variability).and_then(|all| all.first());
    let starts = match kind {
        Type::String | Type::Binary => {
            let starts = element.children.iter().filter(|child| child.name == "Start");
            starts.map(|start| start.get("value").unwrap_or_default().to_string()).collect()
        }
        _ => {
            let words = element.get("start").into_iter().flat_map(str::split_whitespace);
            words.map(String::from).collect()
        }
    };
    let dimensions = element.children.iter().filter(|child| child.name == "Dimension").map(|d| {
        let start = d.get("start").and_then(|start| start.trim().parse().ok());
        start.or_else(|| sizes.get(d.get("valueReference")?.trim()).copied()).unwrap_or(1)
    });
    Some(Variable {
        line: element.line,
        name: text("name", ""),
        reference: element.get("valueReference").and_then(|r| r.trim().parse().ok()).unwrap_or(0),
        initial: element.get("initial").or(default.copied()).map(str::to_string),
        causality,
        variability,
        c_type,
        kind,
        starts,
        dimensions: dimensions.collect(),
        element: whole,
        written: element.clone(),
    })
}

fn unknown(element: &Element) -> Unknown {
    let words = |name: &str| {
        let words = element.get(name)?.split_whitespace();
        Some(words.map(str::to_string).collect::<Vec<_>>())
    };
    Unknown {
        list: element.name.clone(),
        line: element.line,
        reference: element.get("valueReference").and_then(|r| r.trim().parse().ok()),
        dependencies: words("dependencies")
            .map(|words| words.iter().filter_map(|word| word.parse().ok()).collect()),
        kinds: words("dependenciesKind"),
    }
}

// ---------------------------------------------------------------- head

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

// ---------------------------------------------------------------- definitions

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
        .filter_map(|t| Some((t.get("name")?, t.name.as_str())))
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

// ---------------------------------------------------------------- variables

/// `xml.names`
pub fn names(d: &Description, findings: &mut Findings) {
    let mut seen: BTreeMap<&str, u64> = BTreeMap::new();
    for v in &d.variables {
        let aliases = v.written.children.iter().filter(|c| c.name == "Alias");
        let aliases = aliases.map(|alias| (alias.get("name").unwrap_or_default(), alias.line));
        for (name, line) in [(v.name.as_str(), v.line)].into_iter().chain(aliases) {
            if name.is_empty() {
                findings.add(format!("line {line}"), "the name is empty");
            } else if let Some(other) = seen.insert(name, line) {
                findings.add(
                    format!("line {line}, {name}"),
                    format!("line {other} has the same name (allowed: unique over variables and aliases)"),
                );
            }
        }
    }
}

/// `xml.structured_names`
pub fn structured_names(d: &Description, findings: &mut Findings) {
    if d.root.get("variableNamingConvention") != Some("structured") {
        return findings.skip("names are not declared as structured");
    }
    d.each(findings, |v| {
        (!crate::description::is_structured(&v.name))
            .then(|| "the name is no path like a.b[1].c, der(a.b) or a.'b c'".to_string())
    });
}

/// `xml.references`
pub fn references(d: &Description, findings: &mut Findings) {
    let mut seen: BTreeMap<u32, &str> = BTreeMap::new();
    for v in &d.variables {
        if let Some(other) = seen.insert(v.reference, &v.name) {
            findings.add(
                v.place(),
                format!(
                    "{other} has the same valueReference, {} (allowed: one variable each; an alias is an \
                     element Alias)",
                    v.reference
                ),
            );
        }
    }
}

/// `xml.causality`
pub fn causality(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        let (causality, variability) = (v.causality.as_str(), v.variability.as_str());
        if initials(causality, variability).is_none() {
            let all = ["constant", "fixed", "tunable", "discrete", "continuous"];
            let allowed: Vec<_> =
                all.into_iter().filter(|v| initials(causality, v).is_some()).collect();
            return Some(format!(
                "causality {causality} with variability {variability} (allowed: {})",
                allowed.join(", ")
            ));
        }
        (variability == "continuous" && !v.is_float())
            .then(|| format!("a continuous {} (allowed: Float32, Float64 alone)", v.written.name))
    });
}

/// `xml.initial`
pub fn initial(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        let written = v.written.get("initial")?;
        let allowed = initials(&v.causality, &v.variability)?;
        let how = if allowed.is_empty() { "none".into() } else { allowed.join(", ") };
        (!allowed.contains(&written)).then(|| {
            format!(
                "initial={written} with causality {} and variability {} (allowed: {how})",
                v.causality, v.variability
            )
        })
    });
}

/// `xml.start`
pub fn start(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        if v.kind == Type::Clock {
            return None;
        }
        let start = !v.starts.is_empty();
        let initial = v.initial.as_deref();
        if v.causality == "independent" || initial == Some("calculated") {
            return start.then(|| {
                let why = initial.map_or("independent".into(), |i| format!("initial={i}"));
                format!("a start value with {why} (allowed: none)")
            });
        }
        let needed = matches!(v.causality.as_str(), "input" | "parameter" | "structuralParameter")
            || v.variability == "constant"
            || matches!(initial, Some("exact" | "approx"));
        // an array of no elements has no values
        if needed && !start && v.length() > 0 {
            let why = initial.map_or(v.causality.clone(), |i| format!("initial={i}"));
            return Some(format!("no start value with {why}"));
        }
        let (count, length) = (v.starts.len(), v.length());
        (count > 1 && count != length).then(|| {
            format!("{count} start values (allowed: one, or {length}, one for each element)")
        })
    });
}

/// `xml.finite`
pub fn finite(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        if !v.is_float() {
            return None;
        }
        let starts = v.starts.iter().filter_map(|s| Some(("start", double(s)?)));
        let others = ["min", "max", "nominal"].into_iter();
        let others = others.filter_map(|name| Some((name, v.element.number(name)?)));
        let mut all = starts.chain(others);
        let fits = |name: &str, x: f64| x.is_finite() && (name != "nominal" || x > 0.0);
        let (name, x) = all.find(|(name, x)| !fits(name, *x))?;
        Some(match name {
            "nominal" => format!("nominal={x} (allowed: finite, above 0)"),
            _ => format!("{name}={x} (allowed: finite numbers)"),
        })
    });
}

/// `xml.range`
pub fn range(d: &Description, findings: &mut Findings) {
    let items = |name: &str| -> Vec<f64> {
        let of = d.root.list("TypeDefinitions").find(|t| t.get("name") == Some(name));
        let items = of.into_iter().flat_map(|t| &t.children).filter(|c| c.name == "Item");
        items.filter_map(|item| item.number("value")).collect()
    };
    d.each(findings, |v| {
        let (min, max) = v.bounds();
        if min > max {
            return Some(format!("min={min} is above max={max}"));
        }
        if !matches!(v.kind, Type::Real | Type::Integer | Type::Enumeration) {
            return None;
        }
        let starts: Vec<f64> = v.starts.iter().filter_map(|s| double(s)).collect();
        if let Some(start) = starts.iter().find(|x| **x < min || **x > max) {
            return Some(format!("start={start} (allowed: {min} to {max})"));
        }
        if v.kind == Type::Enumeration {
            let items = v.element.get("declaredType").map(items).unwrap_or_default();
            let list: Vec<_> = items.iter().map(f64::to_string).collect();
            let odd = starts.iter().find(|x| !items.is_empty() && !items.contains(x))?;
            return Some(format!("start={odd} is no item (allowed: {})", list.join(", ")));
        }
        None
    });
}

/// `xml.independent`
pub fn independent(d: &Description, findings: &mut Findings) {
    let all: Vec<_> = d.variables.iter().filter(|v| v.causality == "independent").collect();
    if all.len() != 1 {
        findings
            .add("ModelVariables", format!("{} independent variables (allowed: one)", all.len()));
    }
    for v in all {
        if !v.is_float() {
            findings.add(v.place(), "the independent variable is no Float64 or Float32");
        }
        for attribute in ["initial", "start", "min", "max"] {
            if v.written.get(attribute).is_some() {
                findings.add(
                    v.place(),
                    format!("the independent variable has {attribute} (allowed: none)"),
                );
            }
        }
    }
}

/// `xml.flags`
pub fn flags(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        if v.written.get("canHandleMultipleSetPerTimeInstant").is_some() && v.causality != "input" {
            return Some(format!(
                "canHandleMultipleSetPerTimeInstant of causality {}",
                v.causality
            ));
        }
        (v.written.flag("intermediateUpdate") && v.variability != "continuous").then(|| {
            format!("intermediateUpdate with variability {} (allowed: continuous)", v.variability)
        })
    });
}

/// `xml.clocks`
pub fn clocks(d: &Description, findings: &mut Findings) {
    let mut previous = BTreeMap::new();
    for v in &d.variables {
        let clocks = v.written.get("clocks");
        if let Some(clocks) = clocks {
            let list: Vec<Option<&Variable>> =
                clocks.split_whitespace().map(|r| d.at(r.parse().ok()?)).collect();
            if list.is_empty() || list.iter().any(|c| c.is_none_or(|c| c.kind != Type::Clock)) {
                findings.add(
                    v.place(),
                    format!("clocks=\"{clocks}\" (allowed: value references of clocks)"),
                );
            }
            if !matches!(v.variability.as_str(), "discrete" | "tunable") {
                findings.add(
                    v.place(),
                    format!(
                        "clocks with variability {} (allowed: discrete, tunable)",
                        v.variability
                    ),
                );
            }
        }
        let Some(text) = v.written.get("previous") else { continue };
        let of = text.trim().parse().ok().and_then(|r| d.at(r));
        let fits = of.is_some_and(|of| {
            of.reference != v.reference
                && of.kind == v.kind
                && of.variability == "discrete"
                && of.causality != "input"
        });
        if !fits {
            findings.add(
                v.place(),
                format!(
                    "previous=\"{text}\" (allowed: another discrete variable of the same type that is no \
                     input)"
                ),
            );
        }
        if clocks.is_none() || v.variability != "discrete" {
            findings.add(v.place(), "previous of a variable that is not clocked and discrete");
        }
        if let Some(other) = previous.insert(text.trim(), &v.name) {
            findings.add(v.place(), format!("{other} has the same previous"));
        }
    }
}

/// `xml.dimensions`
pub fn dimensions(d: &Description, findings: &mut Findings) {
    for v in &d.variables {
        for dimension in v.written.children.iter().filter(|c| c.name == "Dimension") {
            let place = format!("line {}, Dimension of {}", dimension.line, v.name);
            match (dimension.get("start"), dimension.get("valueReference")) {
                (Some(_), Some(_)) => {
                    findings.add(place, "start and valueReference (allowed: one of them)");
                }
                (None, None) => {
                    findings.add(place, "neither start nor valueReference (allowed: one of them)");
                }
                (Some(start), None) if start.trim() == "0" => {
                    findings.add(place, "start=0 (allowed: above 0)");
                }
                (Some(_), None) => {}
                (None, Some(reference)) => {
                    let of = reference.trim().parse().ok().and_then(|r| d.at(r));
                    let fits = of.is_some_and(|of| {
                        of.c_type == CType::UInt64
                            && (of.causality == "structuralParameter"
                                || of.variability == "constant")
                    });
                    if !fits {
                        findings.add(
                            place,
                            format!(
                                "valueReference={reference} (allowed: a structural parameter or a constant, of \
                                 type UInt64)"
                            ),
                        );
                    } else if of.is_some_and(|of| of.starts.first().is_none_or(|s| s == "0")) {
                        findings.add(
                            place,
                            format!("valueReference={reference} has no start above 0 (required)"),
                        );
                    }
                }
            }
        }
    }
}

/// `xml.derivatives_of`
pub fn derivatives_of(d: &Description, findings: &mut Findings) {
    let states: BTreeSet<u32> = d.states().into_iter().collect();
    d.each(findings, |v| {
        if v.written.flag("reinit") && !states.contains(&v.reference) {
            return Some("reinit, but it is no continuous state".to_string());
        }
        let text = v.written.get("derivative")?;
        let Some(of) = v.derivative_of().and_then(|r| d.at(r)) else {
            return Some(format!(
                "derivative=\"{text}\" (allowed: the valueReference of a variable)"
            ));
        };
        if of.reference == v.reference {
            return Some("it is its own derivative".into());
        }
        if !(v.is_continuous() && of.is_continuous()) {
            return Some(format!("it and {} must be continuous floating-point numbers", of.name));
        }
        (v.dimensions != of.dimensions).then(|| {
            format!(
                "its dimensions are {:?}, those of {} {:?}",
                v.dimensions, of.name, of.dimensions
            )
        })
    });
}

// ---------------------------------------------------------------- structure

fn place(d: &Description, u: &Unknown) -> String {
    format!("line {}, {}, {}", u.line, u.list, d.name_of(u.reference))
}

/// Says what is missing, repeated, or listed although it must not be.
fn compare(
    d: &Description,
    findings: &mut Findings,
    list: &str,
    needed: &BTreeSet<u32>,
    allowed: impl Fn(&Variable) -> bool,
    why: &str,
) {
    let mut seen = BTreeSet::new();
    for unknown in d.unknowns(list) {
        let Some(reference) = unknown.reference else { continue };
        if d.at(reference).is_some_and(|v| !allowed(v)) {
            findings.add(place(d, unknown), format!("it is not allowed here (allowed: {why})"));
        }
        if !seen.insert(reference) {
            findings.add(place(d, unknown), "it is listed already");
        }
    }
    for missing in needed.difference(&seen) {
        findings.add(
            format!("{list}, {}", d.name_of(Some(*missing))),
            format!("it is missing (required: {why})"),
        );
    }
}

fn all(d: &Description, wanted: impl Fn(&Variable) -> bool) -> BTreeSet<u32> {
    d.variables.iter().filter(|v| wanted(v)).map(|v| v.reference).collect()
}

/// `xml.outputs`
pub fn outputs(d: &Description, findings: &mut Findings) {
    let is_output = |v: &Variable| v.causality == "output";
    compare(d, findings, "Output", &all(d, is_output), is_output, "every output, once");
}

/// `xml.derivatives`
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
            findings.add(place(d, unknown), format!("{other} is the derivative of the same state"));
        }
    }
}

/// `xml.clocked_states`
pub fn clocked_states(d: &Description, findings: &mut Findings) {
    let is_state = |v: &Variable| v.written.get("previous").is_some();
    let why = "every variable with the attribute previous, once";
    compare(d, findings, "ClockedState", &all(d, is_state), is_state, why);
}

/// `xml.initial_unknowns`
pub fn initial_unknowns(d: &Description, findings: &mut Findings) {
    let derivatives: BTreeSet<u32> =
        d.unknowns("ContinuousStateDerivative").filter_map(|u| u.reference).collect();
    let states: BTreeSet<u32> = d.states().into_iter().collect();
    let needed = |v: &Variable| {
        let computed = matches!(v.initial.as_deref(), Some("calculated" | "approx"));
        let state = states.contains(&v.reference) || derivatives.contains(&v.reference);
        v.written.get("clocks").is_none()
            && v.kind != Type::Clock
            && (v.causality == "calculatedParameter"
                || (computed && (v.causality == "output" || state)))
    };
    let why = "outputs, states and their derivatives with initial calculated or approx, calculated \
               parameters, once; clocked variables";
    let allowed = |v: &Variable| needed(v) || v.written.get("clocks").is_some();
    compare(d, findings, "InitialUnknown", &all(d, needed), allowed, why);
}

/// `xml.event_indicators`
pub fn event_indicators(d: &Description, findings: &mut Findings) {
    let why = "continuous Float32 and Float64, each once";
    compare(d, findings, "EventIndicator", &BTreeSet::new(), Variable::is_continuous, why);
}

/// `xml.structure_references`
pub fn structure_references(d: &Description, findings: &mut Findings) {
    for unknown in &d.structure {
        let all =
            unknown.reference.into_iter().chain(unknown.dependencies.iter().flatten().copied());
        for reference in all.filter(|r| d.at(*r).is_none()) {
            findings.add(
                format!("line {}, {}", unknown.line, unknown.list),
                format!("no variable has the valueReference {reference}"),
            );
        }
    }
}

/// `xml.dependencies`
pub fn dependencies(d: &Description, findings: &mut Findings) {
    for unknown in &d.structure {
        let place = place(d, unknown);
        let listed = unknown.dependencies.as_deref().unwrap_or_default();
        let distinct: BTreeSet<_> = listed.iter().collect();
        if distinct.len() < listed.len() {
            findings.add(&place, "a dependency is listed twice");
        }
        let Some(kinds) = &unknown.kinds else { continue };
        if unknown.dependencies.is_none() {
            findings.add(&place, "dependenciesKind without dependencies");
        } else if kinds.len() != listed.len() {
            let (kinds, all) = (kinds.len(), listed.len());
            findings.add(&place, format!("{all} dependencies, but {kinds} kinds of them"));
        }
        let is_float = unknown.reference.and_then(|r| d.at(r)).is_none_or(Variable::is_float);
        for kind in kinds {
            let fits = match kind.as_str() {
                "dependent" => true,
                "constant" => is_float,
                _ => is_float && unknown.list != "InitialUnknown",
            };
            if !fits {
                let allowed = if is_float { "dependent, constant" } else { "dependent" };
                findings.add(&place, format!("dependenciesKind {kind} (allowed: {allowed})"));
            }
        }
    }
}

/// `xml.dependencies_known`
pub fn dependencies_known(d: &Description, findings: &mut Findings) {
    let states: BTreeSet<u32> = d.states().into_iter().collect();
    // what event indicators may depend on is not said
    for unknown in d.structure.iter().filter(|u| u.list != "EventIndicator") {
        let initial = unknown.list == "InitialUnknown";
        let known = |v: &Variable| {
            matches!(
                v.causality.as_str(),
                "input" | "independent" | "parameter" | "structuralParameter"
            ) || match initial {
                true => v.initial.as_deref() == Some("exact"),
                // a discrete variable may be a discrete-time state
                false => states.contains(&v.reference) || v.variability == "discrete",
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
            findings.add(
                place(d, unknown),
                format!("it cannot depend on {} (allowed: {allowed})", v.name),
            );
        }
    }
}

//! modelDescription.xml (FMI 2.0.5, section 2.2): what it says, and whether it may say so.

use std::collections::{BTreeMap, BTreeSet};

use super::Findings;
use host::description::Type;
use host::xml::{Element, Fault, double};

/// The parts of modelDescription.xml that rules need, read without judging.
pub struct Description {
    /// All of it.
    pub root: Element,
    /// The element ModelExchange.
    pub model_exchange: Option<Element>,
    /// The element CoSimulation.
    pub co_simulation: Option<Element>,
    /// In the order of the file.
    pub variables: Vec<Variable>,
    /// ModelStructure's Outputs, as written.
    pub outputs: Vec<Unknown>,
    /// ModelStructure's Derivatives, as written.
    pub derivatives: Vec<Unknown>,
    /// ModelStructure's InitialUnknowns, as written.
    pub initial_unknowns: Vec<Unknown>,
}

/// A ScalarVariable.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Place among the variables, counted from 1, as ModelStructure counts.
    pub index: usize,
    /// Line of the file.
    pub line: u64,
    /// Its name.
    pub name: String,
    /// Its value reference; 0 if that cannot be read.
    pub reference: u32,
    /// As written, or the default "local".
    pub causality: String,
    /// As written, or the default: "continuous" of a Real, else "discrete".
    pub variability: String,
    /// As written, or the default for causality and variability, if there is one.
    pub initial: Option<String>,
    /// Its type.
    pub kind: Type,
    /// The element of its type, attributes of the declared type filled in.
    pub typed: Element,
    /// Attributes of the ScalarVariable itself.
    written: Element,
}

/// An Unknown of ModelStructure.
#[derive(Clone, Debug)]
pub struct Unknown {
    /// Line of the file.
    pub line: u64,
    /// Place of the variable, counted from 1; 0 if that cannot be read.
    pub index: usize,
    /// What it depends on; none if that is not said: on everything.
    pub dependencies: Option<Vec<usize>>,
    /// How.
    pub kinds: Option<Vec<String>>,
}

impl Variable {
    /// Where it is, for findings.
    pub fn place(&self) -> String {
        format!("line {}, {}", self.line, self.name)
    }

    /// Whether it is a Real that may change at any time.
    pub fn is_continuous(&self) -> bool {
        self.kind == Type::Real && self.variability == "continuous"
    }

    /// Index of the state whose derivative it is.
    pub fn derivative_of(&self) -> Option<usize> {
        self.typed.get("derivative")?.trim().parse().ok()
    }

    /// Whether its type is Real.
    pub fn is_real(&self) -> bool {
        self.kind == Type::Real
    }

    /// Whether a host sets it: a parameter or an input.
    pub fn is_set_by_hosts(&self) -> bool {
        self.causality == "input"
            || (self.causality == "parameter" && self.variability != "constant")
    }

    /// Its order of magnitude.
    pub fn nominal(&self) -> f64 {
        let nominal = self.typed.number("nominal").filter(|n| n.is_finite() && *n > 0.0);
        nominal.unwrap_or(1.0)
    }

    /// Its bounds; infinite where there are none.
    pub fn bounds(&self) -> (f64, f64) {
        let bound = |name, none| self.typed.number(name).filter(|x| !x.is_nan()).unwrap_or(none);
        (bound("min", f64::NEG_INFINITY), bound("max", f64::INFINITY))
    }
}

/// The default of `initial` and what is allowed (the table of section 2.2.7); `None` where the
/// combination is not allowed at all, an empty list where `initial` must not be written.
fn initials(causality: &str, variability: &str) -> Option<&'static [&'static str]> {
    const EXACT: &[&str] = &["exact"];
    const COMPUTED: &[&str] = &["calculated", "approx"];
    const ANY: &[&str] = &["calculated", "exact", "approx"];
    match (causality, variability) {
        ("parameter", "fixed" | "tunable") => Some(EXACT),
        ("calculatedParameter", "fixed" | "tunable") => Some(COMPUTED),
        ("input", "discrete" | "continuous") => Some(&[]),
        ("output" | "local", "constant") => Some(EXACT),
        ("output" | "local", "discrete" | "continuous") => Some(ANY),
        ("local", "fixed" | "tunable") => Some(COMPUTED),
        ("independent", "continuous") => Some(&[]),
        _ => None,
    }
}

impl Description {
    /// Reads the file.
    ///
    /// # Errors
    /// If it is not well-formed, with the line.
    pub fn read(bytes: &[u8]) -> Result<Description, String> {
        let root = Element::parse(bytes)?;
        let types: BTreeMap<&str, &Element> = root
            .list("TypeDefinitions")
            .filter_map(|t| Some((t.get("name")?, t.children.first()?)))
            .collect();
        let elements = root.list("ModelVariables").filter(|e| e.name == "ScalarVariable");
        let variables =
            elements.zip(1..).map(|(element, index)| variable(element, index, &types)).collect();
        let unknowns = |list: &str| -> Vec<Unknown> {
            let structure = root.child("ModelStructure");
            structure.into_iter().flat_map(|s| s.list(list)).map(unknown).collect()
        };
        Ok(Description {
            model_exchange: root.child("ModelExchange").cloned(),
            co_simulation: root.child("CoSimulation").cloned(),
            outputs: unknowns("Outputs"),
            derivatives: unknowns("Derivatives"),
            initial_unknowns: unknowns("InitialUnknowns"),
            variables,
            root,
        })
    }

    /// The version of FMI, 1.0 or 3.0, that it is of in place of 2.0.
    pub fn other_version(&self) -> Option<&str> {
        let version = self.root.get("fmiVersion").map(str::trim);
        version.filter(|version| version.starts_with("1.") || version.starts_with("3."))
    }

    /// The variable at a place counted from 1.
    pub fn at(&self, index: usize) -> Option<&Variable> {
        self.variables.get(index.checked_sub(1)?)
    }

    /// The two interfaces, those there are.
    pub fn interfaces(&self) -> impl Iterator<Item = &Element> {
        self.model_exchange.iter().chain(&self.co_simulation)
    }

    /// Indices of the continuous states.
    pub fn states(&self) -> BTreeSet<usize> {
        self.variables.iter().filter_map(Variable::derivative_of).collect()
    }

    /// Each variable that breaks something, as `wrong` tells.
    fn each(&self, findings: &mut Findings, wrong: impl Fn(&Variable) -> Option<String>) {
        for variable in &self.variables {
            if let Some(text) = wrong(variable) {
                findings.add(variable.place(), text);
            }
        }
    }

    fn name_of(&self, index: usize) -> String {
        self.at(index).map_or_else(|| format!("index {index}"), |v| v.name.clone())
    }
}

fn variable(element: &Element, index: usize, types: &BTreeMap<&str, &Element>) -> Variable {
    let kinds = [
        ("Real", Type::Real),
        ("Integer", Type::Integer),
        ("Boolean", Type::Boolean),
        ("String", Type::String),
        ("Enumeration", Type::Enumeration),
    ];
    let typed = element.children.iter().find_map(|child| {
        let (_, kind) = kinds.iter().find(|(name, _)| *name == child.name)?;
        Some((*kind, child.clone()))
    });
    let (kind, mut typed) = typed.unwrap_or((Type::Real, Element::default()));
    let declared = typed.get("declaredType").and_then(|name| types.get(name)).copied();
    for (name, value) in declared.iter().flat_map(|declared| &declared.attributes) {
        if typed.get(name).is_none() {
            typed.attributes.push((name.clone(), value.clone()));
        }
    }
    let text = |name: &str, default: &str| element.get(name).unwrap_or(default).trim().to_string();
    let causality = text("causality", "local");
    let default = if kind == Type::Real { "continuous" } else { "discrete" };
    let variability = text("variability", default);
    let default = initials(&causality, &variability).and_then(|all| all.first());
    Variable {
        index,
        line: element.line,
        name: text("name", ""),
        reference: element.get("valueReference").and_then(|r| r.trim().parse().ok()).unwrap_or(0),
        initial: element.get("initial").or(default.copied()).map(str::to_string),
        causality,
        variability,
        kind,
        typed,
        written: Element { children: Vec::new(), ..element.clone() },
    }
}

fn unknown(element: &Element) -> Unknown {
    let words = |name: &str| {
        let words = element.get(name)?.split_whitespace();
        Some(words.map(str::to_string).collect::<Vec<_>>())
    };
    Unknown {
        line: element.line,
        index: element.get("index").and_then(|i| i.trim().parse().ok()).unwrap_or(0),
        dependencies: words("dependencies")
            .map(|words| words.iter().map(|word| word.parse().unwrap_or(0)).collect()),
        kinds: words("dependenciesKind"),
    }
}

// ---------------------------------------------------------------- head

/// `xml.well_formed`
pub fn well_formed(archive: &super::Archive, findings: &mut Findings) {
    match archive.file("modelDescription.xml") {
        None => findings.skip("there is no modelDescription.xml that can be unpacked"),
        Some(bytes) => {
            let read = Element::read(bytes);
            if let Err(Fault::TooLarge(_) | Fault::Doctype(_)) = read {
                // rules of their own
                findings.skip("modelDescription.xml is not read to its end");
            } else if let Err(why) = read {
                findings.add("modelDescription.xml", format!("line and column {why}"));
            }
        }
    }
}

/// `xml.fmi_version`
pub fn fmi_version(d: &Description, findings: &mut Findings) {
    if let Some(other) = d.other_version() {
        return findings.add(
            "fmiVersion",
            format!(
                "\"{other}\": it is no FMU 2.0, and no other rule is looked at (allowed: \"2.0\")"
            ),
        );
    }
    match d.root.get("fmiVersion") {
        Some("2.0") => {}
        Some(other) => findings.add("fmiVersion", format!("\"{other}\" (allowed: \"2.0\")")),
        None => findings.add("fmiVersion", "it is missing (allowed: \"2.0\")"),
    }
}

/// `xml.guid`
pub fn guid(d: &Description, findings: &mut Findings) {
    if d.root.get("guid").is_none_or(|guid| guid.trim().is_empty()) {
        findings.add("guid", "it is missing or empty");
    }
}

/// `xml.date`
pub fn date(d: &Description, findings: &mut Findings) {
    if let Some(date) = d.root.get("generationDateAndTime")
        && !(date.len() == 20 && date.ends_with('Z') && date.as_bytes().get(10) == Some(&b'T'))
    {
        findings.add(
            "generationDateAndTime",
            format!("\"{date}\" (allowed: in UTC, like 2026-01-31T12:00:00Z)"),
        );
    }
}

/// `xml.interfaces`
pub fn interfaces(d: &Description, findings: &mut Findings) {
    if d.interfaces().next().is_none() {
        findings.add("fmiModelDescription", "neither ModelExchange nor CoSimulation is there");
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
    for interface in d.interfaces() {
        if interface.flag("canSerializeFMUstate") && !interface.flag("canGetAndSetFMUstate") {
            findings.add(
                format!("line {}, {}", interface.line, interface.name),
                "canSerializeFMUstate without canGetAndSetFMUstate",
            );
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
                findings.add(flag, "one binary, but the two interfaces say different things of it");
            }
        }
    }
}

/// `xml.state_capability`
pub fn state_capability(d: &Description, findings: &mut Findings) {
    for interface in d.interfaces() {
        for flag in ["canGetAndSetFMUstate", "canSerializeFMUstate"] {
            if !interface.flag(flag) {
                findings.add(
                    format!("line {}, {}", interface.line, interface.name),
                    format!("{flag} is not true"),
                );
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
    if let Some(stop) = number("stopTime").filter(|stop| *stop >= start) {
        if stop == start {
            findings.add(&place, format!("stopTime={stop} (allowed: above startTime {start})"));
        } else if let Some(step) = number("stepSize").filter(|step| *step > stop - start) {
            findings.add(
                &place,
                format!(
                    "stepSize={step} (allowed: at most stopTime - startTime = {})",
                    stop - start
                ),
            );
        }
    }
}

/// `xml.stop_time`
pub fn stop_time(d: &Description, findings: &mut Findings) {
    let Some(experiment) = d.root.child("DefaultExperiment") else {
        return findings.skip("there is no DefaultExperiment");
    };
    let start = experiment.number("startTime").unwrap_or(0.0);
    if let Some(stop) = experiment.number("stopTime").filter(|stop| *stop < start) {
        findings.add(
            format!("line {}, DefaultExperiment", experiment.line),
            format!("stopTime={stop} is before startTime={start} (allowed: after it)"),
        );
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
    one("SimpleType", &mut d.root.list("TypeDefinitions"), "name");
    one("Category", &mut d.root.list("LogCategories"), "name");
    for unit in d.root.list("UnitDefinitions") {
        one("DisplayUnit", &mut unit.children.iter().filter(|c| c.name == "DisplayUnit"), "name");
    }
    for simple in d.root.list("TypeDefinitions") {
        for attribute in ["name", "value"] {
            one("Item", &mut simple.list("Enumeration"), attribute);
        }
    }
}

/// `xml.units`
pub fn units(d: &Description, findings: &mut Findings) {
    let units: BTreeMap<&str, &Element> =
        d.root.list("UnitDefinitions").filter_map(|unit| Some((unit.get("name")?, unit))).collect();
    d.each(findings, |v| {
        let unit = v.typed.get("unit");
        let display_unit = v.typed.get("displayUnit");
        let defined = |name: &str| units.get(name);
        match (unit, display_unit) {
            (None, Some(shown)) => Some(format!("displayUnit \"{shown}\" without a unit")),
            (Some(unit), _) if defined(unit).is_none() => {
                Some(format!("the unit \"{unit}\" is not among UnitDefinitions"))
            }
            (Some(unit), Some(shown)) => {
                let all = defined(unit).into_iter().flat_map(|unit| &unit.children);
                let mut all = all.filter(|c| c.name == "DisplayUnit").filter_map(|c| c.get("name"));
                (shown != unit && !all.any(|name| name == shown))
                    .then(|| format!("displayUnit \"{shown}\" is not defined for \"{unit}\""))
            }
            _ => None,
        }
    });
}

/// `xml.types`
pub fn types(d: &Description, findings: &mut Findings) {
    let types: BTreeMap<&str, &str> = d
        .root
        .list("TypeDefinitions")
        .filter_map(|t| Some((t.get("name")?, t.children.first()?.name.as_str())))
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
        findings.add(format!("SimpleType \"{name}\""), "a variable has the same name");
    }
}

// ---------------------------------------------------------------- variables

/// `xml.names`
pub fn names(d: &Description, findings: &mut Findings) {
    let mut seen: BTreeMap<&str, u64> = BTreeMap::new();
    for v in &d.variables {
        if v.name.is_empty() {
            findings.add(v.place(), "the name is empty");
        } else if let Some(line) = seen.insert(&v.name, v.line) {
            findings.add(v.place(), format!("line {line} has the same name"));
        }
    }
}

/// `xml.structured_names`
pub fn structured_names(d: &Description, findings: &mut Findings) {
    if d.root.get("variableNamingConvention") != Some("structured") {
        return findings.skip("names are not declared as structured");
    }
    d.each(findings, |v| {
        (!is_structured(&v.name))
            .then(|| "the name is no path like a.b[1].c, der(a.b) or a.'b c'".to_string())
    });
}

/// The grammar of section 2.2.9.
pub(crate) fn is_structured(name: &str) -> bool {
    if let Some(inner) = name.strip_prefix("der(").and_then(|rest| rest.strip_suffix(')')) {
        // A comma after the last index is the order's, one between brackets the indices'.
        return match inner.rsplit_once(',') {
            Some((path, order)) if !order.contains(']') => {
                is_structured(path) && order.trim().parse::<u32>().is_ok()
            }
            _ => is_structured(inner),
        };
    }
    // An identifier, then indices, then a point and the next one.
    let mut rest = name;
    loop {
        let end = match rest.strip_prefix('\'') {
            Some(quoted) => {
                let escaped = |at: usize| quoted[..at].ends_with('\\');
                let close = quoted.match_indices('\'').find(|(at, _)| !escaped(*at));
                close.map_or(0, |(at, _)| at + 2)
            }
            None if rest.starts_with(|c: char| c.is_ascii_digit()) => 0,
            None => {
                rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len())
            }
        };
        if end == 0 {
            return false;
        }
        rest = &rest[end..];
        if let Some(open) = rest.strip_prefix('[') {
            let Some((indices, after)) = open.split_once(']') else { return false };
            if !indices.split(',').all(|i| i.trim().parse::<u32>().is_ok()) {
                return false;
            }
            rest = after;
        }
        match rest.strip_prefix('.') {
            _ if rest.is_empty() => return true,
            Some(next) => rest = next,
            None => return false,
        }
    }
}

/// `xml.parameter_names`
pub fn parameter_names(d: &Description, findings: &mut Findings) {
    const LONGEST: usize = 55;
    d.each(findings, |v| {
        let length = v.name.chars().count();
        (v.causality == "parameter" && length > LONGEST)
            .then(|| format!("the name has {length} characters (allowed: {LONGEST})"))
    });
}

/// `xml.flat_ports`
///
/// A point makes a member of a structure of the name, and importers that know such names make one port of all its
/// members. An index makes an element of an array (2.2.9), of which importers make a vector or leave the elements
/// alone: both can be wired, if the array is whole.
pub fn flat_ports(d: &Description, findings: &mut Findings) {
    let is_structured = d.root.get("variableNamingConvention") == Some("structured");
    let is_port = |v: &&Variable| matches!(v.causality.as_str(), "input" | "output");
    // Elements of each array by name, in the order of the variables.
    let mut arrays: BTreeMap<(&str, &str), Vec<Vec<u32>>> = BTreeMap::new();
    for v in d.variables.iter().filter(is_port) {
        if let Some((array, index)) = indexed(&v.name) {
            arrays.entry((&v.causality, array)).or_default().push(index);
        }
    }
    d.each(findings, |v| {
        if !is_port(&v) {
            return None;
        }
        if v.name.contains('.') {
            return Some("the name of a port has a point".to_string());
        }
        if !v.name.contains(['[', ']']) {
            return None;
        }
        if !is_structured {
            return Some("the name of a port has a bracket, and names are not structured".to_string());
        }
        let whole = indexed(&v.name)
            .and_then(|(array, _)| arrays.get(&(v.causality.as_str(), array)))
            .is_some_and(|indices| is_whole(indices));
        (!whole).then(|| {
            "the port is an element of an array some of whose elements are missing (allowed: every index \
             from 1 to the last, each once, all inputs or all outputs)"
                .to_string()
        })
    });
}

/// Array and indices of `array[1,2]`.
fn indexed(name: &str) -> Option<(&str, Vec<u32>)> {
    let (array, indices) = name.strip_suffix(']')?.split_once('[')?;
    let indices: Option<Vec<u32>> = indices.split(',').map(|i| i.trim().parse().ok()).collect();
    Some((array, indices?))
}

/// Whether these are all indices of an array, each once.
fn is_whole(indices: &[Vec<u32>]) -> bool {
    let dimensions = indices[0].len();
    if indices.iter().any(|index| index.len() != dimensions || index.contains(&0)) {
        return false;
    }
    let last = |k: usize| indices.iter().map(|index| index[k] as usize).max().unwrap_or(0);
    let count = (0..dimensions).try_fold(1_usize, |count, k| count.checked_mul(last(k)));
    let different: BTreeSet<_> = indices.iter().collect();
    count == Some(indices.len()) && different.len() == indices.len()
}

/// `xml.causality`
pub fn causality(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        let (causality, variability) = (v.causality.as_str(), v.variability.as_str());
        if initials(causality, variability).is_none() {
            let all = ["constant", "fixed", "tunable", "discrete", "continuous"];
            let allowed: Vec<_> =
                all.into_iter().filter(|v| initials(causality, v).is_some()).collect();
            let allowed = allowed.join(", ");
            return Some(format!(
                "causality {causality} with variability {variability} (allowed: {allowed})"
            ));
        }
        (variability == "continuous" && v.kind != Type::Real)
            .then(|| format!("a continuous {} (allowed: Real alone)", v.typed.name))
    });
}

/// `xml.variability`
pub fn variability(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        (v.kind != Type::Real && v.written.get("variability").is_none()).then(|| {
            format!("variability is not written, and the schema's default, continuous, is not allowed for {}", v.typed.name)
        })
    });
}

/// `xml.initial`
pub fn initial(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        let written = v.written.get("initial")?;
        // A combination that is not allowed is another rule's business.
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
        let start = v.typed.get("start").is_some();
        let initial = v.initial.as_deref();
        if v.causality == "independent" || initial == Some("calculated") {
            return start.then(|| {
                let why = initial.map_or("independent".into(), |i| format!("initial={i}"));
                format!("a start value with {why} (allowed: none)")
            });
        }
        let needed = v.causality == "input"
            || v.variability == "constant"
            || matches!(initial, Some("exact" | "approx"));
        (needed && !start).then(|| {
            let why = initial.map_or(v.causality.clone(), |i| format!("initial={i}"));
            format!("no start value with {why}")
        })
    });
}

/// `xml.finite`
pub fn finite(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        let wrong = ["start", "min", "max", "nominal"].into_iter().find_map(|name| {
            let x = v.typed.number(name).filter(|_| v.kind == Type::Real)?;
            let fits = x.is_finite() && (name != "nominal" || x > 0.0);
            (!fits).then_some((name, x))
        });
        wrong.map(|(name, x)| match name {
            "nominal" => format!("nominal={x} (allowed: finite, above 0)"),
            _ => format!("{name}={x} (allowed: finite numbers)"),
        })
    });
}

/// `xml.range`
pub fn range(d: &Description, findings: &mut Findings) {
    let items = |name: &str| -> Vec<f64> {
        let simple = d.root.list("TypeDefinitions").find(|t| t.get("name") == Some(name));
        simple
            .into_iter()
            .flat_map(|t| t.list("Enumeration"))
            .filter_map(|item| item.number("value"))
            .collect()
    };
    d.each(findings, |v| {
        let (min, max) = v.bounds();
        if min > max {
            return Some(format!("min={min} is above max={max}"));
        }
        let start = v.typed.get("start").and_then(double)?;
        if matches!(v.kind, Type::Boolean | Type::String) {
            return None;
        }
        if start < min || start > max {
            return Some(format!("start={start} (allowed: {min} to {max})"));
        }
        if v.kind == Type::Enumeration {
            let items = v.typed.get("declaredType").map(items).unwrap_or_default();
            let list: Vec<_> = items.iter().map(f64::to_string).collect();
            return (!items.is_empty() && !items.contains(&start))
                .then(|| format!("start={start} is no item (allowed: {})", list.join(", ")));
        }
        None
    });
}

/// `xml.aliases`
pub fn aliases(d: &Description, findings: &mut Findings) {
    // Integers and enumerations share their calls.
    let group = |v: &Variable| match v.kind {
        Type::Real => 0,
        Type::Integer | Type::Enumeration => 1,
        Type::Boolean => 2,
        // FMI 2.0 has no Binary and no Clock
        Type::String | Type::Binary | Type::Clock => 3,
    };
    let mut sets: BTreeMap<(i32, u32), Vec<&Variable>> = BTreeMap::new();
    for v in &d.variables {
        sets.entry((group(v), v.reference)).or_default().push(v);
    }
    for set in sets.values().filter(|set| set.len() > 1) {
        let first = set[0];
        let names: Vec<_> = set.iter().map(|v| v.name.as_str()).collect();
        let place = format!("valueReference {}, {}", first.reference, names.join(" = "));
        let settable = set.iter().filter(|v| v.is_set_by_hosts()).count();
        if settable > 1 {
            findings.add(&place, format!("{settable} of them are set by hosts (allowed: one)"));
        }
        let started =
            set.iter().filter(|v| v.typed.get("start").is_some() && v.variability != "constant");
        if settable <= 1 && started.count() > 1 {
            findings.add(&place, "several of them have a start value (allowed: one)");
        }
        if set.iter().any(|v| v.typed.get("unit") != first.typed.get("unit")) {
            findings.add(&place, "one value, but several units");
        }
        let constant = |v: &Variable| v.variability == "constant";
        if set.iter().any(|v| constant(v) != constant(first)) {
            findings.add(&place, "one value, but constant and not constant");
        }
        if set.iter().any(|v| v.kind != first.kind) {
            findings.add(&place, "one value, but several types");
        }
    }
}

/// `xml.independent`
pub fn independent(d: &Description, findings: &mut Findings) {
    let all: Vec<_> = d.variables.iter().filter(|v| v.causality == "independent").collect();
    if all.len() > 1 {
        findings.add(all[1].place(), format!("{} independent variables (allowed: one)", all.len()));
    }
    for v in all.iter().filter(|v| v.kind != Type::Real) {
        findings.add(v.place(), "the independent variable is no Real");
    }
}

/// `xml.multiple_set`
pub fn multiple_set(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        v.written.get("canHandleMultipleSetPerTimeInstant")?;
        if d.model_exchange.is_none() {
            return Some("canHandleMultipleSetPerTimeInstant without ModelExchange".into());
        }
        (v.causality != "input")
            .then(|| format!("canHandleMultipleSetPerTimeInstant of causality {}", v.causality))
    });
}

/// `xml.states`
pub fn states(d: &Description, findings: &mut Findings) {
    let mut taken = BTreeMap::new();
    d.each(findings, |v| {
        v.typed.get("derivative")?;
        let index = v.derivative_of().unwrap_or(0);
        let Some(state) = d.at(index) else {
            return Some(format!("derivative={index} (allowed: 1 to {})", d.variables.len()));
        };
        if !(v.is_continuous() && state.is_continuous()) {
            return Some(format!("it and its state {} must be continuous Reals", state.name));
        }
        (index == v.index).then(|| "it is its own derivative".to_string())
    });
    for v in &d.variables {
        if let Some(index) = v.derivative_of()
            && let Some(other) = taken.insert(index, &v.name)
        {
            let name = d.name_of(index);
            findings.add(v.place(), format!("{other} is a derivative of {name} as well"));
        }
    }
    let states = d.states();
    d.each(findings, |v| {
        (v.typed.flag("reinit") && !states.contains(&v.index))
            .then(|| "reinit, but it is no state: nobody is its derivative".to_string())
    });
}

// ---------------------------------------------------------------- structure

/// Says what is missing, repeated, or listed although it must not be.
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
        // An index out of range is another rule's business.
        if d.at(unknown.index).is_some() && !expected.contains(&unknown.index) {
            findings.add(&place, format!("it is not allowed here (allowed: {why})"));
        }
        if !seen.insert(unknown.index) {
            findings.add(&place, "it is listed already");
        }
    }
    for missing in expected.difference(&seen) {
        findings.add(
            format!("{list}, {}", d.name_of(*missing)),
            format!("it is missing (required: {why})"),
        );
    }
}

fn indices(d: &Description, wanted: impl Fn(&Variable) -> bool) -> BTreeSet<usize> {
    d.variables.iter().filter(|v| wanted(v)).map(|v| v.index).collect()
}

/// `xml.outputs`
pub fn outputs(d: &Description, findings: &mut Findings) {
    let expected = indices(d, |v| v.causality == "output");
    compare(d, findings, "Outputs", &d.outputs, &expected, "every output, once");
}

/// `xml.derivatives`
pub fn derivatives(d: &Description, findings: &mut Findings) {
    let expected = indices(d, |v| v.derivative_of().is_some());
    if d.model_exchange.is_none() && d.derivatives.is_empty() {
        return findings.skip("Co-Simulation alone need not list derivatives");
    }
    let why = "every variable with the attribute derivative, once";
    compare(d, findings, "Derivatives", &d.derivatives, &expected, why);
}

/// `xml.initial_unknowns`
pub fn initial_unknowns(d: &Description, findings: &mut Findings) {
    let states = d.states();
    let expected = indices(d, |v| {
        let computed = matches!(v.initial.as_deref(), Some("calculated" | "approx"));
        let state = states.contains(&v.index) || v.derivative_of().is_some();
        computed && (v.causality == "output" || v.causality == "calculatedParameter" || state)
    });
    // What a Co-Simulation FMU says of its states is up to it.
    let expected = match d.derivatives.is_empty() && d.model_exchange.is_none() {
        true => indices(d, |v| {
            expected.contains(&v.index)
                && (v.causality != "local" || d.initial_unknowns.iter().any(|u| u.index == v.index))
        }),
        false => expected,
    };
    let why = "outputs, states and derivatives with initial calculated or approx, and calculated \
               parameters, once";
    compare(d, findings, "InitialUnknowns", &d.initial_unknowns, &expected, why);
    for pair in d.initial_unknowns.windows(2) {
        if pair[1].index < pair[0].index {
            findings.add(
                format!("line {}, InitialUnknowns, {}", pair[1].line, d.name_of(pair[1].index)),
                format!("index {} after {} (required: ascending)", pair[1].index, pair[0].index),
            );
        }
    }
}

/// The three lists of ModelStructure with their names.
fn lists(d: &Description) -> [(&'static str, &[Unknown]); 3] {
    [
        ("Outputs", &d.outputs),
        ("Derivatives", &d.derivatives),
        ("InitialUnknowns", &d.initial_unknowns),
    ]
}

/// `xml.indices`
pub fn indices_in_range(d: &Description, findings: &mut Findings) {
    let count = d.variables.len();
    for (list, unknowns) in lists(d) {
        for unknown in unknowns {
            let place = format!("line {}, {list}", unknown.line);
            if d.at(unknown.index).is_none() {
                findings.add(&place, format!("index {} (allowed: 1 to {count})", unknown.index));
            }
            for index in unknown.dependencies.iter().flatten().filter(|i| d.at(**i).is_none()) {
                findings.add(&place, format!("dependency {index} (allowed: 1 to {count})"));
            }
        }
    }
}

/// `xml.dependencies`
pub fn dependencies(d: &Description, findings: &mut Findings) {
    for (list, unknowns) in lists(d) {
        let initial = list == "InitialUnknowns";
        for unknown in unknowns {
            let place = format!("line {}, {list}, {}", unknown.line, d.name_of(unknown.index));
            let dependencies = unknown.dependencies.as_deref().unwrap_or_default();
            if let Some(kinds) = &unknown.kinds {
                if unknown.dependencies.is_none() {
                    findings.add(&place, "dependenciesKind without dependencies");
                } else if kinds.len() != dependencies.len() {
                    let (kinds, all) = (kinds.len(), dependencies.len());
                    findings.add(&place, format!("{all} dependencies, but {kinds} kinds of them"));
                }
                let odd = kinds.iter().find(|k| !matches!(k.as_str(), "dependent" | "constant"));
                if let Some(odd) = odd.filter(|_| initial) {
                    findings.add(
                        &place,
                        format!("dependenciesKind {odd} (allowed: dependent, constant)"),
                    );
                }
            }
            let distinct: BTreeSet<_> = dependencies.iter().collect();
            if distinct.len() < dependencies.len() {
                findings.add(&place, "a dependency is listed twice");
            }
        }
    }
}

/// `xml.dependencies_known`
pub fn dependencies_known(d: &Description, findings: &mut Findings) {
    let states = d.states();
    for (list, unknowns) in lists(d) {
        let initial = list == "InitialUnknowns";
        for unknown in unknowns {
            let place = format!("line {}, {list}, {}", unknown.line, d.name_of(unknown.index));
            let dependencies = unknown.dependencies.as_deref().unwrap_or_default();
            let known = |v: &Variable| {
                let common = v.causality == "input" || v.causality == "independent";
                match initial {
                    true => common || v.initial.as_deref() == Some("exact"),
                    // a Co-Simulation FMU may hide its derivatives and still name its states
                    false => common || states.contains(&v.index) || d.model_exchange.is_none(),
                }
            };
            for v in dependencies.iter().filter_map(|i| d.at(*i)).filter(|v| !known(v)) {
                let allowed = match initial {
                    true => "inputs, variables with initial=exact",
                    false => "inputs, continuous states, the independent variable",
                };
                findings
                    .add(&place, format!("it cannot depend on {} (allowed: {allowed})", v.name));
            }
        }
    }
}

/// `xml.dependencies_written`
pub fn dependencies_written(d: &Description, findings: &mut Findings) {
    for unknown in d.outputs.iter().filter(|unknown| unknown.dependencies.is_none()) {
        findings.add(
            format!("line {}, Outputs, {}", unknown.line, d.name_of(unknown.index)),
            "no attribute dependencies: that means it depends on everything (write \
             dependencies=\"\" where there is no feedthrough)",
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn structured_names_are_paths() {
        for right in [
            "a",
            "a.b_1[2,3].c",
            "der(a.b)",
            "der(a[1],2)",
            "der(a[1].b[2,3])",
            "der(a[1,2],2)",
            "a.'b c\\'d'.e",
            "_x",
        ] {
            assert!(is_structured(right), "{right}");
        }
        for wrong in ["", "a b", "1a", "a..b", "a.", "a[x]", "a[1", "der(a,b)", "a-b", "'a"] {
            assert!(!is_structured(wrong), "{wrong}");
        }
    }

    #[test]
    fn arrays_are_whole_from_index_1_to_the_last() {
        let whole = |names: &[&str]| {
            is_whole(&names.iter().map(|name| indexed(name).unwrap().1).collect::<Vec<_>>())
        };
        assert!(whole(&["a[1]"]) && whole(&["a[2]", "a[1]"]));
        assert!(whole(&["a[1,1]", "a[1,2]", "a[2,1]", "a[2,2]"]));
        for broken in [
            &["a[0]"][..],
            &["a[2]"],
            &["a[1]", "a[3]"],
            &["a[1]", "a[1]"],
            &["a[1,1]", "a[2,2]"],
            &["a[1]", "a[1,2]"],
            &["a[4294967295,4294967295,4294967295]"],
        ] {
            assert!(!whole(broken), "{broken:?}");
        }
        assert_eq!(indexed("a"), None);
        assert_eq!(indexed("a[x]"), None);
    }

    #[test]
    fn defaults_are_those_of_the_standard() {
        let xml = br#"<fmiModelDescription><TypeDefinitions><SimpleType name="T"><Real unit="m"
            min="1"/></SimpleType></TypeDefinitions><ModelVariables>
            <ScalarVariable name="a" valueReference="3"><Real declaredType="T" min="2"/></ScalarVariable>
            <ScalarVariable name="b" valueReference="4" causality="parameter" variability="fixed"><Integer/></ScalarVariable>
            <ScalarVariable name="c" valueReference="4"><Boolean/></ScalarVariable>
            </ModelVariables></fmiModelDescription>"#;
        let d = Description::read(xml).unwrap();
        let [a, b, c] = &d.variables[..] else { panic!() };
        assert_eq!((a.causality.as_str(), a.variability.as_str()), ("local", "continuous"));
        assert_eq!(a.initial.as_deref(), Some("calculated"));
        assert_eq!((a.bounds(), a.typed.get("unit")), ((2.0, f64::INFINITY), Some("m")));
        assert_eq!((b.initial.as_deref(), b.kind, b.index), (Some("exact"), Type::Integer, 2));
        assert_eq!(c.variability, "discrete");
    }
}

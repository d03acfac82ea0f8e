//! Reads modelDescription.xml (FMI 2.0.5, section 2.2; FMI 3.0.2, section 2.4) without reporting faults, which is the
//! task of the rules.

use std::collections::BTreeMap;
use std::str::FromStr;

use super::findings::Findings;
use host::causality::{Causality, Variability};
use host::description::{CType, Type, starts};
use host::xml::{Element, Fault};

/// Names in modelDescription.xml that differ between the versions of FMI.
pub struct Words {
    pub version: &'static str,
    pub token: &'static str,
    /// Names of the types whose variables may be continuous.
    pub reals: &'static str,
    pub outputs: &'static str,
    pub derivatives: &'static str,
    pub initial_unknowns: &'static str,
    pub initials: Initials,
}

/// Function that returns the allowed values of `initial`, the default first (FMI 2.0.5, section 2.2.7; FMI
/// 3.0.2, section 2.4.7.5). `None` means that the standard forbids this pair of causality and variability; an
/// empty list means that `initial` must not be written.
type Initials = fn(&Causality, &Variability) -> Option<&'static [&'static str]>;

static FMI2: Words = Words {
    version: "2.0",
    token: "guid",
    reals: "Real",
    outputs: "Outputs",
    derivatives: "Derivatives",
    initial_unknowns: "InitialUnknowns",
    initials: |causality, variability| match (causality, variability) {
        (Causality::StructuralParameter, _) => None,
        (Causality::Input, Variability::Discrete | Variability::Continuous) => Some(&[]),
        _ => initials(causality, variability),
    },
};

static FMI3: Words = Words {
    version: "3.0",
    token: "instantiationToken",
    reals: "Float32, Float64",
    outputs: "Output",
    derivatives: "ContinuousStateDerivative",
    initial_unknowns: "InitialUnknown",
    initials,
};

fn initials(causality: &Causality, variability: &Variability) -> Option<&'static [&'static str]> {
    use Causality::{
        CalculatedParameter, Independent, Input, Local, Output, Parameter, StructuralParameter,
    };
    use Variability::{Constant, Continuous, Discrete, Fixed, Tunable};
    match (causality, variability) {
        (Parameter | StructuralParameter, Fixed | Tunable) => Some(&["exact"]),
        (CalculatedParameter | Local, Fixed | Tunable) => Some(&["calculated", "approx"]),
        (Input, Discrete | Continuous) | (Output | Local, Constant) => Some(&["exact"]),
        (Output | Local, Discrete | Continuous) => Some(&["calculated", "exact", "approx"]),
        (Independent, Continuous) => Some(&[]),
        _ => None,
    }
}

/// The parts of modelDescription.xml that rules need. The rules report its faults.
pub struct Description {
    pub words: &'static Words,
    pub root: Element,
    pub variables: Vec<Variable>,
    pub structure: Vec<Unknown>,
    places: BTreeMap<u32, usize>,
}

/// A variable. The element `typed` also has the attributes that the variable inherits from its declaredType.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Number by which ModelStructure and the attribute `derivative` name the variable: in FMI 2.0 its position
    /// among the variables, counted from 1, in FMI 3.0 its value reference.
    pub key: u32,
    pub line: u64,
    pub name: String,
    /// Value reference; 0 if the attribute is missing or not a number.
    pub reference: u32,
    pub causality: Causality,
    /// Variability as written, or the standard's default for this causality and type.
    pub variability: Variability,
    /// Attribute `initial` as written, or the standard's default for this causality and variability; `None`
    /// if there is no default.
    pub initial: Option<String>,
    pub kind: Type,
    pub c_type: CType,
    pub starts: Vec<String>,
    /// Sizes of an array, computed with the start values of structural parameters; empty for a scalar.
    pub dimensions: Vec<usize>,
    /// The element with the type's attributes (start, min, unit …): in FMI 2.0 the child of ScalarVariable,
    /// in FMI 3.0 the variable's own element.
    pub typed: Element,
    pub(crate) written: Element,
}

/// An entry of ModelStructure; `list` is the name of the list that contains it, for example Outputs
/// (FMI 3.0: Output).
#[derive(Clone, Debug)]
pub struct Unknown {
    pub list: String,
    pub line: u64,
    /// Key of the variable that this entry names. If the attribute in the file is not a number, the key is 0 in FMI
    /// 2.0 and `None` in FMI 3.0.
    pub key: Option<u32>,
    /// Keys of the variables that this unknown depends on. `None` if the attribute is missing, which means
    /// that it may depend on everything.
    pub dependencies: Option<Vec<u32>>,
    pub kinds: Option<Vec<String>>,
}

impl Variable {
    pub fn derivative_of(&self) -> Option<u32> {
        number(&self.typed, "derivative")
    }

    /// Returns true if a host may set the variable: it is an input, or a parameter that is not constant.
    pub fn is_set_by_hosts(&self) -> bool {
        self.causality == Causality::Input
            || (self.causality == Causality::Parameter && self.variability != Variability::Constant)
    }

    pub fn place(&self) -> String {
        format!("line {}, {}", self.line, self.name)
    }

    pub fn is_real(&self) -> bool {
        self.kind == Type::Real
    }

    pub fn is_continuous(&self) -> bool {
        self.is_real() && self.variability == Variability::Continuous
    }

    /// Returns true if rules read and set this variable; clocked variables, clocks and Binary are left out.
    pub fn is_exchanged(&self) -> bool {
        !matches!(self.kind, Type::Binary | Type::Clock) && self.typed.get("clocks").is_none()
    }

    pub fn length(&self) -> usize {
        self.dimensions.iter().product()
    }

    /// Returns the attribute nominal, or 1 if it is missing or not positive.
    pub fn nominal(&self) -> f64 {
        let nominal = self.typed.number("nominal").filter(|n| n.is_finite() && *n > 0.0);
        nominal.unwrap_or(1.0)
    }

    pub fn bounds(&self) -> (f64, f64) {
        let bound = |name, none| self.typed.number(name).filter(|x| !x.is_nan()).unwrap_or(none);
        (bound("min", f64::NEG_INFINITY), bound("max", f64::INFINITY))
    }
}

fn number<T: FromStr>(element: &Element, attribute: &str) -> Option<T> {
    element.get(attribute)?.trim().parse().ok()
}

impl Description {
    /// Parses the bytes of modelDescription.xml.
    ///
    /// # Errors
    ///
    /// If the file is not well-formed XML; the text has the line.
    pub fn read(bytes: &[u8]) -> Result<Description, Fault> {
        Ok(Description::new(Element::parse(bytes)?))
    }

    pub fn new(root: Element) -> Description {
        let version = root.get("fmiVersion").unwrap_or_default().trim();
        let is_fmi3 = version.starts_with("3.") && !version.contains('-');
        let words = if is_fmi3 { &FMI3 } else { &FMI2 };
        let types: BTreeMap<&str, &Element> = root
            .list("TypeDefinitions")
            .filter_map(|t| Some((t.get("name")?, if is_fmi3 { t } else { t.children.first()? })))
            .collect();
        let sizes: BTreeMap<&str, usize> = root
            .list("ModelVariables")
            .filter_map(|e| Some((e.get("valueReference")?, number(e, "start")?)))
            .collect();
        let elements = root.list("ModelVariables");
        let variables: Vec<Variable> = match is_fmi3 {
            true => {
                elements.filter_map(|e| variable(words, e, e.clone(), &types, &sizes)).collect()
            }
            false => elements
                .filter(|element| element.name == "ScalarVariable")
                .zip(1..)
                .filter_map(|(element, key)| {
                    let of_fmi2 = |child: &&Element| CType::from_child_name(&child.name).is_some();
                    let typed = element.children.iter().find(of_fmi2).cloned();
                    let typed =
                        typed.unwrap_or(Element { name: "Real".into(), ..Element::default() });
                    let read = variable(words, element, typed, &types, &sizes)?;
                    Some(Variable { key, ..read })
                })
                .collect(),
        };
        let mut places = BTreeMap::new();
        for (place, variable) in variables.iter().enumerate() {
            places.entry(variable.key).or_insert(place);
        }
        let lists = root.list("ModelStructure");
        let structure = match is_fmi3 {
            true => lists.map(|e| unknown(words, &e.name, e)).collect(),
            false => lists
                .flat_map(|list| list.children.iter().map(|e| unknown(words, &list.name, e)))
                .collect(),
        };
        Description { words, variables, structure, places, root }
    }

    pub fn is_fmi3(&self) -> bool {
        std::ptr::eq(self.words, &FMI3)
    }

    /// Returns fmiVersion if the check has no rules for this version.
    pub fn other_version(&self) -> Option<&str> {
        let version = self.root.get("fmiVersion").map(str::trim).filter(|_| !self.is_fmi3());
        version.filter(|version| version.starts_with("1.") || version.starts_with("3."))
    }

    pub fn at(&self, key: u32) -> Option<&Variable> {
        self.places.get(&key).map(|place| &self.variables[*place])
    }

    pub fn variable_of(&self, unknown: &Unknown) -> Option<&Variable> {
        self.at(unknown.key?)
    }

    pub fn interface(&self, name: &str) -> Option<&Element> {
        self.root.child(name)
    }

    pub fn interfaces(&self) -> impl Iterator<Item = &Element> {
        let names = ["ModelExchange", "CoSimulation", "ScheduledExecution"].into_iter();
        names.filter_map(|name| self.root.child(name))
    }

    /// Returns true if the FMU has clocks, in which case `eventModeUsed` must be true in Co-Simulation
    /// (section 2.3.1).
    pub fn has_clocks(&self) -> bool {
        self.variables.iter().any(|v| v.kind == Type::Clock)
    }

    pub fn unknowns<'a>(&'a self, list: &'a str) -> impl Iterator<Item = &'a Unknown> {
        self.structure.iter().filter(move |u| u.list == list)
    }

    /// Returns the outputs and then the derivatives in ModelStructure.
    pub fn running_unknowns(&self) -> impl Iterator<Item = &Unknown> {
        self.unknowns(self.words.outputs).chain(self.unknowns(self.words.derivatives))
    }

    /// Returns true if the FMU lists no derivatives and is allowed to do so, because it is an FMU 2.0 only for Co-Simulation.
    pub fn hides_states(&self) -> bool {
        !self.is_fmi3()
            && self.interface("ModelExchange").is_none()
            && self.unknowns(self.words.derivatives).next().is_none()
    }

    /// Returns the keys of the continuous states, which are the variables whose derivatives ModelStructure lists, in
    /// its order. The attribute `derivative` is used only if the FMU hides its states: by itself it does not make a
    /// variable a state, because inputs, outputs and dummy derivatives may also have it (FMI 2.0.5, section 2.2.7).
    pub fn states(&self) -> Vec<u32> {
        if self.hides_states() {
            return self.variables.iter().filter_map(Variable::derivative_of).collect();
        }
        let listed = self.unknowns(self.words.derivatives);
        listed.filter_map(|unknown| self.variable_of(unknown)?.derivative_of()).collect()
    }

    pub(crate) fn each<'d>(
        &'d self,
        findings: &mut Findings,
        wrong: impl Fn(&'d Variable) -> Option<String>,
    ) {
        for variable in &self.variables {
            if let Some(text) = wrong(variable) {
                findings.at(variable.place()).add(text);
            }
        }
    }

    pub(crate) fn name_of(&self, key: Option<u32>) -> String {
        let kind = if self.is_fmi3() { "valueReference" } else { "index" };
        match key.map(|key| (key, self.at(key))) {
            Some((_, Some(v))) => v.name.clone(),
            Some((key, None)) => format!("{kind} {key}"),
            None => format!("no {kind}"),
        }
    }
}

/// Reads a variable from its element. In FMI 2.0 the caller replaces its `key`, which depends on the position of the
/// element in the file. `types` maps the names of declared types to the types, from which missing attributes are
/// inherited; `sizes` maps value references of structural parameters to their start values.
fn variable(
    words: &Words,
    element: &Element,
    mut typed: Element,
    types: &BTreeMap<&str, &Element>,
    sizes: &BTreeMap<&str, usize>,
) -> Option<Variable> {
    let is_fmi3 = words.version == "3.0";
    let (c_type, kind) = match is_fmi3 {
        true => CType::from_element_name(&typed.name),
        false => CType::from_child_name(&typed.name),
    }?;
    let declared = typed.get("declaredType").and_then(|name| types.get(name)).copied();
    for (name, value) in declared.iter().flat_map(|declared| &declared.attributes) {
        if typed.get(name).is_none() {
            typed.attributes.push((name.clone(), value.clone()));
        }
    }
    let text = |name: &str, default: &str| element.get(name).unwrap_or(default).trim().to_string();
    let causality = text("causality", "local");
    let default = match kind {
        _ if is_fmi3 && causality.to_lowercase().ends_with("parameter") => "fixed",
        Type::Real => "continuous",
        _ => "discrete",
    };
    let causality = Causality::from(&*causality);
    let variability = Variability::from(&*text("variability", default));
    let default = (words.initials)(&causality, &variability).and_then(|all| all.first());
    let starts = match is_fmi3 {
        true => starts(element, c_type),
        false => typed.get("start").map(String::from).into_iter().collect(),
    };
    let dimensions = element.children.iter().filter(|child| child.name == "Dimension").map(|d| {
        let size = || sizes.get(d.get("valueReference")?.trim()).copied();
        number(d, "start").or_else(size).unwrap_or(1)
    });
    let reference = number(element, "valueReference").unwrap_or(0);
    Some(Variable {
        key: reference,
        line: element.line,
        name: text("name", ""),
        reference,
        initial: element.get("initial").or(default.copied()).map(str::to_string),
        causality,
        variability,
        kind,
        c_type,
        starts,
        dimensions: dimensions.collect(),
        typed,
        written: element.clone(),
    })
}

fn unknown(words: &Words, list: &str, element: &Element) -> Unknown {
    let is_fmi3 = words.version == "3.0";
    let absent = (!is_fmi3).then_some(0);
    let words =
        |name: &str| -> Option<Vec<&str>> { Some(element.get(name)?.split_whitespace().collect()) };
    let keys = |all: Vec<&str>| -> Vec<u32> {
        all.into_iter().filter_map(|key| key.parse().ok().or(absent)).collect()
    };
    Unknown {
        list: list.into(),
        line: element.line,
        key: number(element, if is_fmi3 { "valueReference" } else { "index" }).or(absent),
        dependencies: words("dependencies").map(keys),
        kinds: words("dependenciesKind").map(|all| all.into_iter().map(String::from).collect()),
    }
}

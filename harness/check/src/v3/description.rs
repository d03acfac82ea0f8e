//! modelDescription.xml of FMI 3.0.2 (section 2.4): what it says, read without judging.

use std::collections::BTreeMap;

use crate::Findings;
use host::causality::{Causality, Variability};
use host::description::{CType, Type};
use host::xml::Element;

/// The parts of modelDescription.xml that rules need, read without judging.
pub struct Description {
    /// All of it.
    pub root: Element,
    /// Variables in the order of the file.
    pub variables: Vec<Variable>,
    /// The elements of ModelStructure, in the order of the file.
    pub structure: Vec<Unknown>,
}

/// A variable.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Line of the file.
    pub line: u64,
    /// Name.
    pub name: String,
    /// Value reference; 0 if that cannot be read.
    pub reference: u32,
    /// Value in the file, or the default "local".
    pub causality: Causality,
    /// Value in the file, or the default for causality and type.
    pub variability: Variability,
    /// Value in the file, or the default for causality and variability, if there is one.
    pub initial: Option<String>,
    /// Type in which calls exchange the variable.
    pub c_type: CType,
    /// Type for display.
    pub kind: Type,
    /// Start values, as written.
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
    /// Name: Output and so on.
    pub list: String,
    /// Line of the file.
    pub line: u64,
    /// Value reference; none if it cannot be read.
    pub reference: Option<u32>,
    /// Dependencies; `None` if they are not declared and all knowns count.
    pub dependencies: Option<Vec<u32>>,
    /// Kinds of the dependencies.
    pub kinds: Option<Vec<String>>,
}

impl Variable {
    /// Position for findings.
    pub fn place(&self) -> String {
        format!("line {}, {}", self.line, self.name)
    }

    /// Returns true for a floating-point number.
    pub fn is_float(&self) -> bool {
        self.kind == Type::Real
    }

    /// Returns true for a continuous variable.
    pub fn is_continuous(&self) -> bool {
        self.is_float() && self.variability == Variability::Continuous
    }

    /// Value reference of what it is the derivative of.
    pub fn derivative_of(&self) -> Option<u32> {
        self.element.get("derivative")?.trim().parse().ok()
    }

    /// Number of values.
    pub fn length(&self) -> usize {
        self.dimensions.iter().product()
    }

    /// Returns true for variables that a host sets before and during a simulation.
    pub fn is_set_by_hosts(&self) -> bool {
        matches!(self.causality, Causality::Input | Causality::Parameter)
    }

    /// Returns true if the rules' calls exchange values of the variable.
    pub fn is_exchanged(&self) -> bool {
        !matches!(self.kind, Type::Binary | Type::Clock) && self.element.get("clocks").is_none()
    }

    /// Returns the bounds; infinite where there are none.
    pub fn bounds(&self) -> (f64, f64) {
        let bound = |name, none| self.element.number(name).filter(|x| !x.is_nan()).unwrap_or(none);
        (bound("min", f64::NEG_INFINITY), bound("max", f64::INFINITY))
    }

    /// Returns the order of magnitude.
    pub fn nominal(&self) -> f64 {
        let nominal = self.element.number("nominal").filter(|n| n.is_finite() && *n > 0.0);
        nominal.unwrap_or(1.0)
    }
}

/// The default of `initial` and what is allowed (2.4.7.5); `None` where causality and variability do not go
/// together, an empty list where `initial` must not be written.
pub(crate) fn initials(
    causality: &Causality,
    variability: &Variability,
) -> Option<&'static [&'static str]> {
    use Causality::{
        CalculatedParameter, Independent, Input, Local, Output, Parameter, StructuralParameter,
    };
    use Variability::{Constant, Continuous, Discrete, Fixed, Tunable};
    match (causality, variability) {
        (Parameter | StructuralParameter, Fixed | Tunable) => Some(&["exact"]),
        (CalculatedParameter, Fixed | Tunable) => Some(&["calculated", "approx"]),
        (Input, Discrete | Continuous) => Some(&["exact"]),
        (Output | Local, Constant) => Some(&["exact"]),
        (Output | Local, Discrete | Continuous) => Some(&["calculated", "exact", "approx"]),
        (Local, Fixed | Tunable) => Some(&["calculated", "approx"]),
        (Independent, Continuous) => Some(&[]),
        _ => None,
    }
}

impl Description {
    /// Returns true if it has clocks: then `eventModeUsed` must be true in Co-Simulation (section 2.3.1).
    pub fn has_clocks(&self) -> bool {
        self.variables.iter().any(|v| v.kind == Type::Clock)
    }

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

    pub(crate) fn each(
        &self,
        findings: &mut Findings,
        wrong: impl Fn(&Variable) -> Option<String>,
    ) {
        for variable in &self.variables {
            if let Some(text) = wrong(variable) {
                findings.add(variable.place(), text);
            }
        }
    }

    pub(crate) fn name_of(&self, reference: Option<u32>) -> String {
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
    let causality = Causality::from(&*causality);
    let variability = Variability::from(&*text("variability", default));
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
        list: element.name.to_string(),
        line: element.line,
        reference: element.get("valueReference").and_then(|r| r.trim().parse().ok()),
        dependencies: words("dependencies")
            .map(|words| words.iter().filter_map(|word| word.parse().ok()).collect()),
        kinds: words("dependenciesKind"),
    }
}

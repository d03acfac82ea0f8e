//! Reads modelDescription.xml of FMI 3.0.2 (section 2.4) without judging it, so that rules can report what is
//! wrong.

use std::collections::BTreeMap;
use std::ops::Deref;

use crate::description::{Common, each, number, split_attribute};
use crate::findings::Findings;
use host::causality::{Causality, Variability};
use host::description::{CType, Type};
use host::xml::Element;

/// The parts of modelDescription.xml that rules need. Faults are not reported here but by the rules.
pub struct Description {
    pub root: Element,
    pub variables: Vec<Variable>,
    pub structure: Vec<Unknown>,
}

#[derive(Clone, Debug)]
pub struct Variable {
    read: Common,
    pub c_type: CType,
    pub starts: Vec<String>,
    /// Sizes of an array, computed with the start values of structural parameters; empty for a scalar.
    pub dimensions: Vec<usize>,
}

impl Deref for Variable {
    type Target = Common;

    fn deref(&self) -> &Common {
        &self.read
    }
}

#[derive(Clone, Debug)]
pub struct Unknown {
    pub list: String,
    pub line: u64,
    /// Value reference; `None` if it is missing or not a number.
    pub reference: Option<u32>,
    /// Value references on which this unknown depends. `None` if the attribute is missing, which means that
    /// it may depend on all knowns.
    pub dependencies: Option<Vec<u32>>,
    pub kinds: Option<Vec<String>>,
}

impl Variable {
    /// Returns the value reference of the variable of which this is the derivative.
    pub fn derivative_of(&self) -> Option<u32> {
        self.typed.get("derivative")?.trim().parse().ok()
    }

    pub fn length(&self) -> usize {
        self.dimensions.iter().product()
    }

    /// Returns true for inputs and parameters, which a host sets before and during a simulation.
    pub fn is_set_by_hosts(&self) -> bool {
        matches!(self.causality, Causality::Input | Causality::Parameter)
    }

    /// Returns true if rules read and set this variable; clocked variables, clocks and Binary are left out.
    pub fn is_exchanged(&self) -> bool {
        !matches!(self.kind, Type::Binary | Type::Clock) && self.typed.get("clocks").is_none()
    }
}

/// Returns the allowed values of `initial` in FMI 3.0; see the type `Initials` in [`crate::description`].
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
    /// Returns true if the FMU has clocks, in which case `eventModeUsed` must be true in Co-Simulation
    /// (section 2.3.1).
    pub fn has_clocks(&self) -> bool {
        self.variables.iter().any(|v| v.kind == Type::Clock)
    }

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

    pub fn at(&self, reference: u32) -> Option<&Variable> {
        self.variables.iter().find(|v| v.reference == reference)
    }

    pub fn interface(&self, name: &str) -> Option<&Element> {
        self.root.child(name)
    }

    pub fn interfaces(&self) -> impl Iterator<Item = &Element> {
        ["ModelExchange", "CoSimulation", "ScheduledExecution"]
            .into_iter()
            .filter_map(|name| self.root.child(name))
    }

    pub fn unknowns<'a>(&'a self, list: &'a str) -> impl Iterator<Item = &'a Unknown> {
        self.structure.iter().filter(move |u| u.list == list)
    }

    /// Returns the value references of the continuous states, in the order of their derivatives in
    /// ModelStructure.
    pub fn states(&self) -> Vec<u32> {
        let derivatives = self.unknowns("ContinuousStateDerivative");
        derivatives.filter_map(|u| self.at(u.reference?)?.derivative_of()).collect()
    }

    pub(crate) fn each<'d>(
        &'d self,
        findings: &mut Findings,
        wrong: impl Fn(&'d Variable) -> Option<String>,
    ) {
        each(&self.variables, findings, wrong);
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
    let (c_type, kind) = CType::from_element_name(&element.name)?;
    let causality = element.get("causality").unwrap_or("local").trim();
    let default = match kind {
        _ if causality.to_lowercase().ends_with("parameter") => "fixed",
        Type::Real => "continuous",
        _ => "discrete",
    };
    let read = Common::read(element, (kind, element.clone()), types, default, initials);
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
    Some(Variable { read, c_type, starts, dimensions: dimensions.collect() })
}

fn unknown(element: &Element) -> Unknown {
    Unknown {
        list: element.name.to_string(),
        line: element.line,
        reference: number(element, "valueReference"),
        dependencies: split_attribute(element, "dependencies")
            .map(|words| words.iter().filter_map(|word| word.parse().ok()).collect()),
        kinds: split_attribute(element, "dependenciesKind"),
    }
}

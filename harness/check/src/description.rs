//! Reads modelDescription.xml (FMI 2.0.5, section 2.2) without judging it, so that rules can report what is
//! wrong.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Deref;
use std::str::FromStr;

use super::findings::Findings;
use host::causality::{Causality, Variability};
use host::description::Type;
use host::xml::{Element, Fault};

/// The parts of modelDescription.xml that rules need. Faults are not reported here but by the rules.
pub struct Description {
    pub root: Element,
    pub model_exchange: Option<Element>,
    pub co_simulation: Option<Element>,
    pub variables: Vec<Variable>,
    pub outputs: Vec<Unknown>,
    pub derivatives: Vec<Unknown>,
    pub initial_unknowns: Vec<Unknown>,
}

#[derive(Clone, Debug)]
pub struct Variable {
    /// Position among the variables, counted from 1 as in ModelStructure.
    pub index: usize,
    read: Common,
}

impl Deref for Variable {
    type Target = Common;

    fn deref(&self) -> &Common {
        &self.read
    }
}

/// The attributes of a variable that FMI 2.0 and 3.0 have in common. In `typed` the attributes that the
/// variable inherits from its declaredType are filled in.
#[derive(Clone, Debug)]
pub struct Common {
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
    /// The element with the type's attributes (start, min, unit …): in FMI 2.0 the child of ScalarVariable,
    /// in FMI 3.0 the variable's own element.
    pub typed: Element,
    pub(crate) written: Element,
}

/// Function that returns the allowed values of `initial`, the default first (FMI 2.0.5, section 2.2.7; FMI
/// 3.0.2, section 2.4.7.5). `None` means that the standard forbids this pair of causality and variability; an
/// empty list means that `initial` must not be written.
pub(crate) type Initials = fn(&Causality, &Variability) -> Option<&'static [&'static str]>;

#[derive(Clone, Debug)]
pub struct Unknown {
    pub line: u64,
    /// Position of the variable, counted from 1; 0 if the attribute is missing or not a number.
    pub index: usize,
    /// Positions of the variables that this unknown depends on. `None` if the attribute is missing, which
    /// means that it may depend on everything.
    pub dependencies: Option<Vec<usize>>,
    pub kinds: Option<Vec<String>>,
}

impl Variable {
    pub fn derivative_of(&self) -> Option<usize> {
        self.typed.get("derivative")?.trim().parse().ok()
    }

    /// Returns true if a host may set the variable: it is an input, or a parameter that is not constant.
    pub fn is_set_by_hosts(&self) -> bool {
        self.causality == Causality::Input
            || (self.causality == Causality::Parameter && self.variability != Variability::Constant)
    }
}

impl Common {
    /// Reads the attributes of a variable. `types` are the declared types by name, from which missing
    /// attributes are inherited. `default` is the variability if the attribute is missing.
    pub(crate) fn read(
        element: &Element,
        (kind, mut typed): (Type, Element),
        types: &BTreeMap<&str, &Element>,
        default: &str,
        initials: Initials,
    ) -> Common {
        let declared = typed.get("declaredType").and_then(|name| types.get(name)).copied();
        for (name, value) in declared.iter().flat_map(|declared| &declared.attributes) {
            if typed.get(name).is_none() {
                typed.attributes.push((name.clone(), value.clone()));
            }
        }
        let text =
            |name: &str, default: &str| element.get(name).unwrap_or(default).trim().to_string();
        let causality = Causality::from(&*text("causality", "local"));
        let variability = Variability::from(&*text("variability", default));
        let default = initials(&causality, &variability).and_then(|all| all.first());
        Common {
            line: element.line,
            name: text("name", ""),
            reference: number(element, "valueReference").unwrap_or(0),
            initial: element.get("initial").or(default.copied()).map(str::to_string),
            causality,
            variability,
            kind,
            typed,
            written: element.clone(),
        }
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

    /// Returns the attribute nominal, or 1 if it is missing or not positive.
    pub fn nominal(&self) -> f64 {
        let nominal = self.typed.number("nominal").filter(|n| n.is_finite() && *n > 0.0);
        nominal.unwrap_or(1.0)
    }

    /// Returns the attributes min and max; a missing bound is infinite.
    pub fn bounds(&self) -> (f64, f64) {
        let bound = |name, none| self.typed.number(name).filter(|x| !x.is_nan()).unwrap_or(none);
        (bound("min", f64::NEG_INFINITY), bound("max", f64::INFINITY))
    }
}

pub(crate) fn number<T: FromStr>(element: &Element, attribute: &str) -> Option<T> {
    element.get(attribute)?.trim().parse().ok()
}

pub(crate) fn split_attribute(element: &Element, attribute: &str) -> Option<Vec<String>> {
    Some(element.get(attribute)?.split_whitespace().map(str::to_string).collect())
}

pub(crate) fn each<'v, V: Deref<Target = Common> + 'v>(
    variables: impl IntoIterator<Item = &'v V>,
    findings: &mut Findings,
    wrong: impl Fn(&'v V) -> Option<String>,
) {
    for variable in variables {
        if let Some(text) = wrong(variable) {
            findings.at(variable.place()).add(text);
        }
    }
}

/// Returns the allowed values of `initial` in FMI 2.0; see [`Initials`].
pub(crate) fn initials(
    causality: &Causality,
    variability: &Variability,
) -> Option<&'static [&'static str]> {
    use Causality::{CalculatedParameter, Independent, Input, Local, Output, Parameter};
    use Variability::{Constant, Continuous, Discrete, Fixed, Tunable};
    const EXACT: &[&str] = &["exact"];
    const COMPUTED: &[&str] = &["calculated", "approx"];
    const ANY: &[&str] = &["calculated", "exact", "approx"];
    match (causality, variability) {
        (Parameter, Fixed | Tunable) => Some(EXACT),
        (CalculatedParameter, Fixed | Tunable) => Some(COMPUTED),
        (Input, Discrete | Continuous) => Some(&[]),
        (Output | Local, Constant) => Some(EXACT),
        (Output | Local, Discrete | Continuous) => Some(ANY),
        (Local, Fixed | Tunable) => Some(COMPUTED),
        (Independent, Continuous) => Some(&[]),
        _ => None,
    }
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
        Description {
            model_exchange: root.child("ModelExchange").cloned(),
            co_simulation: root.child("CoSimulation").cloned(),
            outputs: unknowns("Outputs"),
            derivatives: unknowns("Derivatives"),
            initial_unknowns: unknowns("InitialUnknowns"),
            variables,
            root,
        }
    }

    pub fn is_fmi3(&self) -> bool {
        let version = self.root.get("fmiVersion").map(str::trim);
        // A draft version such as 3.0-beta.3 has rules of its own, which are not checked here.
        version.is_some_and(|version| version.starts_with("3.") && !version.contains('-'))
    }

    /// Returns fmiVersion if it is a version 1 or 3 instead of 2.0.
    pub fn other_version(&self) -> Option<&str> {
        let version = self.root.get("fmiVersion").map(str::trim);
        version.filter(|version| version.starts_with("1.") || version.starts_with("3."))
    }

    pub fn at(&self, index: usize) -> Option<&Variable> {
        self.variables.get(index.checked_sub(1)?)
    }

    pub fn interfaces(&self) -> impl Iterator<Item = &Element> {
        self.model_exchange.iter().chain(&self.co_simulation)
    }

    /// Returns the positions of the continuous states: the variables whose derivatives are listed in
    /// ModelStructure's Derivatives. The attribute `derivative` does not make a state, because inputs, outputs and dummy
    /// derivatives may also have it (FMI 2.0.5, section 2.2.7). However, an FMU for only Co-Simulation may leave the list
    /// out, and then the attribute is used.
    pub fn states(&self) -> BTreeSet<usize> {
        if self.derivatives.is_empty() && self.model_exchange.is_none() {
            return self.variables.iter().filter_map(Variable::derivative_of).collect();
        }
        let listed = self.derivatives.iter().filter_map(|unknown| self.at(unknown.index));
        listed.filter_map(Variable::derivative_of).collect()
    }

    pub(crate) fn each<'d>(
        &'d self,
        findings: &mut Findings,
        wrong: impl Fn(&'d Variable) -> Option<String>,
    ) {
        each(&self.variables, findings, wrong);
    }

    pub(crate) fn name_of(&self, index: usize) -> String {
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
    let (kind, typed) = typed.unwrap_or((Type::Real, Element::default()));
    let default = if kind == Type::Real { "continuous" } else { "discrete" };
    let mut read = Common::read(element, (kind, typed), types, default, initials);
    read.written = element.without_children();
    Variable { index, read }
}

fn unknown(element: &Element) -> Unknown {
    Unknown {
        line: element.line,
        index: number(element, "index").unwrap_or(0),
        dependencies: split_attribute(element, "dependencies")
            .map(|words| words.iter().map(|word| word.parse().unwrap_or(0)).collect()),
        kinds: split_attribute(element, "dependenciesKind"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_equal_those_of_the_standard() {
        let xml = br#"<fmiModelDescription><TypeDefinitions><SimpleType name="T"><Real unit="m"
            min="1"/></SimpleType></TypeDefinitions><ModelVariables>
            <ScalarVariable name="a" valueReference="3"><Real declaredType="T" min="2"/></ScalarVariable>
            <ScalarVariable name="b" valueReference="4" causality="parameter" variability="fixed"><Integer/></ScalarVariable>
            <ScalarVariable name="c" valueReference="4"><Boolean/></ScalarVariable>
            </ModelVariables></fmiModelDescription>"#;
        let d = Description::read(xml).unwrap();
        let [a, b, c] = &d.variables[..] else { panic!() };
        assert_eq!((&a.causality, &a.variability), (&Causality::Local, &Variability::Continuous));
        assert_eq!(a.initial.as_deref(), Some("calculated"));
        assert_eq!((a.bounds(), a.typed.get("unit")), ((2.0, f64::INFINITY), Some("m")));
        assert_eq!((b.initial.as_deref(), b.kind, b.index), (Some("exact"), Type::Integer, 2));
        assert_eq!(c.variability, Variability::Discrete);
    }
}

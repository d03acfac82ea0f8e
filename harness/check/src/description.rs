//! modelDescription.xml (FMI 2.0.5, section 2.2): what it says, read without judging.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Deref;
use std::str::FromStr;

use super::findings::Findings;
use host::causality::{Causality, Variability};
use host::description::Type;
use host::xml::Element;

/// The parts of modelDescription.xml that rules need, read without judging.
pub struct Description {
    /// All of it.
    pub root: Element,
    /// The element ModelExchange.
    pub model_exchange: Option<Element>,
    /// The element CoSimulation.
    pub co_simulation: Option<Element>,
    /// Variables in the order of the file.
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
    read: Common,
}

impl Deref for Variable {
    type Target = Common;

    fn deref(&self) -> &Common {
        &self.read
    }
}

/// A variable as far as FMI 2.0 and 3.0 agree. In `typed` the attributes of the declared type are filled in.
#[derive(Clone, Debug)]
pub struct Common {
    /// Line of the file.
    pub line: u64,
    /// Name.
    pub name: String,
    /// Value reference; 0 if that cannot be read.
    pub reference: u32,
    /// Causality as written, or the default "local".
    pub causality: Causality,
    /// Variability as written, or the default for causality and type.
    pub variability: Variability,
    /// Attribute `initial` as written, or the default for causality and variability, if there is one.
    pub initial: Option<String>,
    /// Type.
    pub kind: Type,
    /// The element of its type: in FMI 2.0 that within the ScalarVariable, in FMI 3.0 the variable's own.
    pub typed: Element,
    /// The element of the variable as written.
    pub(crate) written: Element,
}

/// Allowed values of `initial`, the default first (FMI 2.0.5, section 2.2.7; FMI 3.0.2, section 2.4.7.5). `None`: causality and
/// variability do not go together. An empty list: `initial` must not be written.
pub(crate) type Initials = fn(&Causality, &Variability) -> Option<&'static [&'static str]>;

/// An Unknown of ModelStructure.
#[derive(Clone, Debug)]
pub struct Unknown {
    /// Line of the file.
    pub line: u64,
    /// Place of the variable, counted from 1; 0 if that cannot be read.
    pub index: usize,
    /// Indices that this unknown depends on; `None` if the attribute is missing: it may depend on everything.
    pub dependencies: Option<Vec<usize>>,
    /// Kinds of these dependencies.
    pub kinds: Option<Vec<String>>,
}

impl Variable {
    /// Index of the state whose derivative it is.
    pub fn derivative_of(&self) -> Option<usize> {
        self.typed.get("derivative")?.trim().parse().ok()
    }

    /// True for a parameter or an input, which a host sets.
    pub fn is_set_by_hosts(&self) -> bool {
        self.causality == Causality::Input
            || (self.causality == Causality::Parameter && self.variability != Variability::Constant)
    }
}

impl Common {
    /// Reads the variable of an element. `default` is the variability of a parameter and of others without one.
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

    /// Position in the file, for findings.
    pub fn place(&self) -> String {
        format!("line {}, {}", self.line, self.name)
    }

    /// True for a floating-point number.
    pub fn is_real(&self) -> bool {
        self.kind == Type::Real
    }

    /// True for a floating-point number that may change at any time.
    pub fn is_continuous(&self) -> bool {
        self.is_real() && self.variability == Variability::Continuous
    }

    /// Returns the order of magnitude.
    pub fn nominal(&self) -> f64 {
        let nominal = self.typed.number("nominal").filter(|n| n.is_finite() && *n > 0.0);
        nominal.unwrap_or(1.0)
    }

    /// Returns the bounds; infinite where there are none.
    pub fn bounds(&self) -> (f64, f64) {
        let bound = |name, none| self.typed.number(name).filter(|x| !x.is_nan()).unwrap_or(none);
        (bound("min", f64::NEG_INFINITY), bound("max", f64::INFINITY))
    }
}

/// A whole number of an attribute.
pub(crate) fn number<T: FromStr>(element: &Element, attribute: &str) -> Option<T> {
    element.get(attribute)?.trim().parse().ok()
}

/// The words of an attribute.
pub(crate) fn words(element: &Element, attribute: &str) -> Option<Vec<String>> {
    Some(element.get(attribute)?.split_whitespace().map(str::to_string).collect())
}

/// Adds a finding for each variable that breaks something, as `wrong` tells.
pub(crate) fn each<'v, V: Deref<Target = Common> + 'v>(
    variables: impl IntoIterator<Item = &'v V>,
    findings: &mut Findings,
    wrong: impl Fn(&'v V) -> Option<String>,
) {
    for variable in variables {
        if let Some(text) = wrong(variable) {
            findings.add(variable.place(), text);
        }
    }
}

/// See [`Initials`].
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
    /// Reads the file.
    ///
    /// # Errors
    /// If it is not well-formed, with the line.
    pub fn read(bytes: &[u8]) -> Result<Description, String> {
        Ok(Description::new(Element::parse(bytes)?))
    }

    /// Returns the description with this root element.
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

    /// Returns true for a description of FMI 3.
    pub fn is_fmi3(&self) -> bool {
        let version = self.root.get("fmiVersion").map(str::trim);
        // a draft, such as 3.0-beta.3, has rules of its own
        version.is_some_and(|version| version.starts_with("3.") && !version.contains('-'))
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

    /// Indices of the continuous states: the variables whose derivatives Derivatives lists. The attribute derivative
    /// alone makes no state; inputs, outputs and dummy derivatives may have it (FMI 2.0.5, section 2.2.7). An FMU for
    /// Co-Simulation alone need not have the list, and then the attribute is all there is.
    pub fn states(&self) -> BTreeSet<usize> {
        if self.derivatives.is_empty() && self.model_exchange.is_none() {
            return self.variables.iter().filter_map(Variable::derivative_of).collect();
        }
        let listed = self.derivatives.iter().filter_map(|unknown| self.at(unknown.index));
        listed.filter_map(Variable::derivative_of).collect()
    }

    /// Adds a finding for each variable that breaks something, as `wrong` tells.
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
    read.written = element.alone();
    Variable { index, read }
}

fn unknown(element: &Element) -> Unknown {
    Unknown {
        line: element.line,
        index: number(element, "index").unwrap_or(0),
        dependencies: words(element, "dependencies")
            .map(|words| words.iter().map(|word| word.parse().unwrap_or(0)).collect()),
        kinds: words(element, "dependenciesKind"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!((&a.causality, &a.variability), (&Causality::Local, &Variability::Continuous));
        assert_eq!(a.initial.as_deref(), Some("calculated"));
        assert_eq!((a.bounds(), a.typed.get("unit")), ((2.0, f64::INFINITY), Some("m")));
        assert_eq!((b.initial.as_deref(), b.kind, b.index), (Some("exact"), Type::Integer, 2));
        assert_eq!(c.variability, Variability::Discrete);
    }
}

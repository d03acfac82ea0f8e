//! Writes the modelDescription.xml of FMI 2.0 from the table of variables of an FMU.
//!
//! This crate contains nothing about single variables, which the table describes. The XML is committed, so that a change of
//! the interface is visible in a diff.

mod element;
pub mod fmi3;
pub mod icon;
pub mod names;
pub mod variables;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use runtime::Model;
use runtime::instance::DEFAULT_TOLERANCE;
use runtime::log::categories;
use runtime::table::Scalar;
use runtime::unit::Unit;
use runtime::v2::Fmi2;
use runtime::variable::{Access, Causality, Enumeration, Kind, Value, Variable};
use runtime::version::Version;

use crate::element::Element;

pub fn folder<M: Model>() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(M::table().about.model)
}

pub fn path<M: Model>() -> PathBuf {
    folder::<M>().join("modelDescription.xml")
}

/// Date of the release. It is not the date of the build, because builds of one commit must give the
/// same bytes.
const RELEASED: &str = "2026-11-22T12:00:00Z";

/// Default stop time of a simulation, s. A simulation of 20 s has 1000 samples of the gyro at 50
/// Hz.
const STOP_TIME: f64 = 20.0;
const STEP_SIZE: f64 = 0.02;

pub fn xml<M: Model>() -> Result<String, xml::writer::Error> {
    description::<M>().document()
}

fn description<M: Model>() -> Element {
    let table = M::table();
    let all_unknowns = |list| unknowns::<M>(list, "Unknown", "index", Long::Nothing, index);
    root::<M>("2.0", "guid", table.guid())
        .with("numberOfEventIndicators", table.about.event_indicators)
        .holding([
            Element::new("ModelExchange")
                .with("modelIdentifier", table.about.model)
                .with("needsExecutionTool", false)
                .with("completedIntegratorStepNotNeeded", false)
                .with("canBeInstantiatedOnlyOncePerProcess", false)
                .with("canNotUseMemoryManagementFunctions", true)
                .with("canGetAndSetFMUstate", true)
                .with("canSerializeFMUstate", true)
                .with("providesDirectionalDerivative", true),
            Element::new("CoSimulation")
                .with("modelIdentifier", table.about.model)
                .with("needsExecutionTool", false)
                .with("canHandleVariableCommunicationStepSize", true)
                .with("canInterpolateInputs", true)
                .with("maxOutputDerivativeOrder", 1)
                .with("canRunAsynchronuously", false)
                .with("canBeInstantiatedOnlyOncePerProcess", false)
                .with("canNotUseMemoryManagementFunctions", true)
                .with("canGetAndSetFMUstate", true)
                .with("canSerializeFMUstate", true)
                .with("providesDirectionalDerivative", true),
            Element::new("UnitDefinitions").holding(table.units().map(unit)),
        ])
        .holding(type_definitions::<M>(|of| {
            Element::new("SimpleType")
                .with("name", of.name)
                .with("description", of.description)
                .holding([Element::new("Enumeration").holding(items(of))])
        }))
        .holding([
            log_categories::<M, Fmi2>(),
            default_experiment(),
            Element::new("ModelVariables").holding(table.scalars.iter().map(variable)),
            Element::new("ModelStructure").holding([
                Element::new("Outputs").holding(all_unknowns(List::Outputs)),
                Element::new("Derivatives").holding(all_unknowns(List::Derivatives)),
                Element::new("InitialUnknowns").holding(all_unknowns(List::Initial)),
            ]),
        ])
}

fn root<M: Model>(version: &str, token_name: &'static str, token: &str) -> Element {
    let about = &M::table().about;
    Element::new("fmiModelDescription")
        .with("fmiVersion", version)
        .with("modelName", about.model)
        .with(token_name, token)
        .with("description", about.description)
        .with("author", env!("CARGO_PKG_AUTHORS"))
        .with("version", about.version)
        .with("copyright", concat!("(c) 2026 ", env!("CARGO_PKG_AUTHORS")))
        .with("license", env!("CARGO_PKG_LICENSE"))
        .with("generationTool", format_args!("{} {}", about.model, about.version))
        .with("generationDateAndTime", RELEASED)
        .with("variableNamingConvention", "structured")
}

fn unit(unit: &Unit) -> Element {
    let exponents = |all: [i32; 4]| {
        let named = ["kg", "m", "s", "rad"].into_iter().zip(all).filter(|(_, n)| *n != 0);
        named.fold(Element::new("BaseUnit"), |base, (name, n)| base.with(name, n))
    };
    let display_unit = |(name, factor): &(&str, f64)| {
        Element::new("DisplayUnit").with("name", name).with("factor", real(*factor))
    };
    Element::new("Unit")
        .with("name", unit.name)
        .holding(unit.base.map(exponents))
        .holding(unit.display_units.iter().map(display_unit))
}

fn type_definitions<M: Model>(one: impl Fn(&Enumeration) -> Element) -> Option<Element> {
    let all = M::table().enumerations();
    let some = !all.is_empty();
    some.then(|| Element::new("TypeDefinitions").holding(all.into_iter().map(one)))
}

fn items(of: &Enumeration) -> impl Iterator<Item = Element> {
    of.items.iter().zip(1..).map(|(item, value)| {
        Element::new("Item")
            .with("name", item.name)
            .with("value", value)
            .with("description", item.description)
    })
}

fn log_categories<M: Model, V: Version>() -> Element {
    Element::new("LogCategories").holding(
        categories::<M, V>(M::table()).into_iter().map(|c| {
            Element::new("Category").with("name", c.name).with("description", c.description)
        }),
    )
}

fn default_experiment() -> Element {
    Element::new("DefaultExperiment")
        .with("startTime", real(0.0))
        .with("stopTime", real(STOP_TIME))
        .with("tolerance", real(DEFAULT_TOLERANCE))
        .with("stepSize", real(STEP_SIZE))
}

fn variable<M: Model>(scalar: &Scalar<M>) -> Element {
    let v = scalar.variable;
    let (causality, initial) = match v.causality {
        Causality::Input => ("input", None),
        Causality::Output => ("output", Some("calculated")),
        Causality::Local => ("local", Some("calculated")),
        Causality::Parameter => ("parameter", Some("exact")),
        Causality::CalculatedParameter => ("calculatedParameter", Some("calculated")),
    };
    let kind = match v.kind {
        Kind::Real(_) => "Real",
        Kind::Integer { .. } => "Integer",
        Kind::Boolean => "Boolean",
        Kind::Enumeration(_) => "Enumeration",
    };
    let derivative = state_of(v, scalar.element).map(index);
    let own = Own { start: scalar.start().map(text), derivative };
    Element::new("ScalarVariable")
        .with("name", scalar.name())
        .with("valueReference", Fmi2::reference(scalar))
        .with("description", v.description)
        .with("causality", causality)
        .with("variability", variability(v))
        .with_some("initial", initial)
        .holding([with_type_attributes(Element::new(kind), v, own)])
}

fn variability<M: Model>(v: &Variable<M>) -> &'static str {
    match (v.causality, v.kind) {
        (Causality::Parameter, _) if v.tunable => "tunable",
        (Causality::Parameter | Causality::CalculatedParameter, _) => "fixed",
        (_, Kind::Real(_)) => "continuous",
        _ => "discrete",
    }
}

struct Own {
    start: Option<String>,
    /// The index (FMI 2.0) or value reference (FMI 3.0) of the state if the variable is the
    /// derivative of a state.
    derivative: Option<u32>,
}

fn with_type_attributes<M: Model>(element: Element, v: &Variable<M>, own: Own) -> Element {
    let element = match v.kind {
        Kind::Real(quantity) => element
            .with_some("unit", Some(quantity.unit).filter(|unit| !unit.is_empty()))
            .with_some("displayUnit", quantity.display_unit)
            .with_some("min", quantity.min.map(real))
            .with_some("max", quantity.max.map(real))
            .with_some("nominal", quantity.nominal.map(real)),
        Kind::Integer { min, max } => element.with_some("min", min).with_some("max", max),
        Kind::Boolean => element,
        Kind::Enumeration(of) => element.with("declaredType", of.name),
    };
    element
        .with_some("start", own.start)
        .with_some("derivative", own.derivative)
        .with_some("reinit", v.reinit.then_some(true))
}

fn text(value: Value) -> String {
    match value {
        Value::Real(x) => real(x),
        Value::Integer(n) => n.to_string(),
        Value::Boolean(b) => b.to_string(),
    }
}

fn real(x: f64) -> String {
    format!("{x:?}")
}

fn state_of<M: Model>(v: &Variable<M>, element: usize) -> Option<&'static Scalar<M>> {
    match v.access {
        Access::Derivative(place) => M::table().state_at(place(element)),
        _ => None,
    }
}

fn index<M: Model>(scalar: &Scalar<M>) -> u32 {
    scalar.index + 1
}

#[derive(Clone, Copy, PartialEq)]
enum List {
    Outputs,
    Derivatives,
    Initial,
}

impl List {
    fn holds<M: Model>(self, scalar: &Scalar<M>) -> bool {
        let v = scalar.variable;
        let is_output = v.causality == Causality::Output;
        let is_derivative = matches!(scalar.access, Access::Derivative(_));
        match self {
            Self::Outputs => is_output,
            Self::Derivatives => is_derivative,
            Self::Initial => {
                let calculated = v.causality == Causality::CalculatedParameter;
                is_output || calculated || v.state.is_some() || is_derivative
            }
        }
    }
}

/// Length above which the list of dependencies of an initial value is shortened, as [`Long`] says.
/// Values that depend on accelerations depend on nearly all parameters, so that their lists would
/// be the largest part of the file.
const LONGEST: usize = 100;

#[derive(Clone, Copy, PartialEq)]
enum Long {
    /// Long lists are left out, so that an importer assumes that the value depends on everything.
    /// However, the list of an output is written if the output does not depend on all inputs,
    /// because otherwise an importer would find an algebraic loop that does not exist.
    Nothing,
    /// Long lists are written without the kinds of the dependencies, so that an importer assumes
    /// the kind `dependent`, which is correct.
    Dependencies,
}

/// Returns the elements of one list of ModelStructure, such as Outputs or InitialUnknowns, in
/// ascending order of `number`. Each states the numbers of the scalars on which the variable
/// depends; an array depends on everything on which one of its elements depends. `element` and
/// `attribute` are the XML names in this version of FMI, `number` returns the index or value
/// reference of a scalar, and `long` determines if long lists of initial values are written.
fn unknowns<M: Model>(
    list: List,
    element: &'static str,
    attribute: &'static str,
    long: Long,
    number: impl Fn(&Scalar<M>) -> u32,
) -> Vec<Element> {
    let inputs: BTreeSet<u32> = M::table().inputs().iter().map(&number).collect();
    let mut unknowns: BTreeMap<u32, (bool, BTreeSet<u32>)> = BTreeMap::new();
    for scalar in M::table().scalars.iter().filter(|scalar| list.holds(scalar)) {
        let known: Vec<_> = match list {
            List::Initial => scalar.initial_depends_on().collect(),
            List::Outputs | List::Derivatives => scalar.depends_on().collect(),
        };
        let (is_output, all) = unknowns.entry(number(scalar)).or_default();
        *is_output = scalar.variable.causality == Causality::Output;
        all.extend(known.into_iter().map(&number));
    }
    let one = |(n, (is_output, known)): (u32, (bool, BTreeSet<u32>))| {
        if list == List::Initial && known.len() > LONGEST {
            let entry = Element::new(element).with(attribute, n);
            match long {
                Long::Nothing if !is_output || inputs.is_subset(&known) => return entry,
                Long::Nothing => {}
                Long::Dependencies => return entry.with("dependencies", numbers(&known)),
            }
        }
        unknown(element, attribute, n, &known)
    };
    unknowns.into_iter().map(one).collect()
}

fn unknown(
    element: &'static str,
    attribute: &'static str,
    number: u32,
    known: &BTreeSet<u32>,
) -> Element {
    Element::new(element)
        .with(attribute, number)
        .with("dependencies", numbers(known))
        .with("dependenciesKind", vec!["dependent"; known.len()].join(" "))
}

fn numbers(known: &BTreeSet<u32>) -> String {
    known.iter().map(u32::to_string).collect::<Vec<_>>().join(" ")
}

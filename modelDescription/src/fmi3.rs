//! Writes modelDescription.xml of FMI 3.0 from the same table: scalars with the names of FMI 2.0. Then follow the independent
//! variable and the event indicators, which are not variables in FMI 2.0. With arrays an entry of the table is one variable.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use runtime::Model;
use runtime::instance::DEFAULT_TOLERANCE;
use runtime::log::categories;
use runtime::table::{Layout, Scalar};
use runtime::unit::{UNITS, Unit};
use runtime::v3::arrays::{self, Arrays};
use runtime::v3::{Fmi3, extra_names, has_intermediate_update, time_reference};
use runtime::variable::{Access, Causality, Dimension, Enumeration, Kind, Quantity, Value};
use runtime::version::Version;
use serde::Serialize;

use crate::schema::{Category, DefaultExperiment, Item, LogCategories, Units};
use crate::{RELEASED, STEP_SIZE, STOP_TIME, folder, is_derivative, is_output, real, unit, write};

/// Path of the committed XML.
pub fn path<M: Model>(layout: Layout) -> PathBuf {
    folder::<M>().join(match layout {
        Layout::Scalars => "fmi3/modelDescription.xml",
        Layout::Arrays => "fmi3-arrays/modelDescription.xml",
    })
}

/// The file's text.
pub fn xml<M: Model>(layout: Layout) -> Result<String, serde_xml_rs::Error> {
    write(&description::<M>(layout))
}

// ---- The elements, in the order that the schema of FMI 3.0 demands ----

#[derive(Debug, Serialize)]
#[serde(rename = "fmiModelDescription")]
struct ModelDescription {
    #[serde(rename = "@fmiVersion")]
    fmi_version: &'static str,
    #[serde(rename = "@modelName")]
    model_name: &'static str,
    #[serde(rename = "@instantiationToken")]
    instantiation_token: &'static str,
    #[serde(rename = "@description")]
    description: &'static str,
    #[serde(rename = "@author")]
    author: &'static str,
    #[serde(rename = "@version")]
    version: &'static str,
    #[serde(rename = "@copyright")]
    copyright: String,
    #[serde(rename = "@license")]
    license: &'static str,
    #[serde(rename = "@generationTool")]
    generation_tool: String,
    #[serde(rename = "@generationDateAndTime")]
    generation_date_and_time: &'static str,
    #[serde(rename = "@variableNamingConvention")]
    variable_naming_convention: &'static str,
    #[serde(rename = "ModelExchange")]
    model_exchange: ModelExchange,
    #[serde(rename = "CoSimulation")]
    co_simulation: CoSimulation,
    #[serde(rename = "UnitDefinitions")]
    units: Units,
    #[serde(rename = "TypeDefinitions")]
    types: Option<Types>,
    #[serde(rename = "LogCategories")]
    log_categories: LogCategories,
    #[serde(rename = "DefaultExperiment")]
    default_experiment: DefaultExperiment,
    #[serde(rename = "ModelVariables")]
    variables: Variables,
    #[serde(rename = "ModelStructure")]
    structure: Structure,
}

#[derive(Debug, Serialize)]
struct ModelExchange {
    #[serde(rename = "@modelIdentifier")]
    model_identifier: &'static str,
    #[serde(rename = "@needsExecutionTool")]
    needs_execution_tool: bool,
    #[serde(rename = "@canBeInstantiatedOnlyOncePerProcess")]
    can_be_instantiated_only_once_per_process: bool,
    #[serde(rename = "@canGetAndSetFMUState")]
    can_get_and_set_fmu_state: bool,
    #[serde(rename = "@canSerializeFMUState")]
    can_serialize_fmu_state: bool,
    #[serde(rename = "@providesDirectionalDerivatives")]
    provides_directional_derivatives: bool,
    #[serde(rename = "@providesAdjointDerivatives")]
    provides_adjoint_derivatives: bool,
    #[serde(rename = "@providesPerElementDependencies")]
    provides_per_element_dependencies: bool,
    #[serde(rename = "@needsCompletedIntegratorStep")]
    needs_completed_integrator_step: bool,
    #[serde(rename = "@providesEvaluateDiscreteStates")]
    provides_evaluate_discrete_states: bool,
}

#[derive(Debug, Serialize)]
struct CoSimulation {
    #[serde(rename = "@modelIdentifier")]
    model_identifier: &'static str,
    #[serde(rename = "@needsExecutionTool")]
    needs_execution_tool: bool,
    #[serde(rename = "@canBeInstantiatedOnlyOncePerProcess")]
    can_be_instantiated_only_once_per_process: bool,
    #[serde(rename = "@canGetAndSetFMUState")]
    can_get_and_set_fmu_state: bool,
    #[serde(rename = "@canSerializeFMUState")]
    can_serialize_fmu_state: bool,
    #[serde(rename = "@providesDirectionalDerivatives")]
    provides_directional_derivatives: bool,
    #[serde(rename = "@providesAdjointDerivatives")]
    provides_adjoint_derivatives: bool,
    #[serde(rename = "@providesPerElementDependencies")]
    provides_per_element_dependencies: bool,
    #[serde(rename = "@canHandleVariableCommunicationStepSize")]
    can_handle_variable_communication_step_size: bool,
    #[serde(rename = "@maxOutputDerivativeOrder")]
    max_output_derivative_order: u32,
    #[serde(rename = "@providesIntermediateUpdate")]
    provides_intermediate_update: bool,
    #[serde(rename = "@mightReturnEarlyFromDoStep")]
    might_return_early_from_do_step: bool,
    #[serde(rename = "@canReturnEarlyAfterIntermediateUpdate")]
    can_return_early_after_intermediate_update: bool,
    #[serde(rename = "@hasEventMode")]
    has_event_mode: bool,
    #[serde(rename = "@providesEvaluateDiscreteStates")]
    provides_evaluate_discrete_states: bool,
}

#[derive(Debug, Serialize)]
struct Types {
    #[serde(rename = "EnumerationType")]
    all: Vec<EnumerationType>,
}

#[derive(Debug, Serialize)]
struct EnumerationType {
    #[serde(rename = "@name")]
    name: &'static str,
    #[serde(rename = "@description")]
    description: &'static str,
    #[serde(rename = "Item")]
    items: Vec<Item>,
}

#[derive(Debug, Serialize)]
struct Variables {
    #[serde(rename = "#content")]
    all: Vec<Variable>,
}

#[derive(Debug, Serialize)]
enum Variable {
    Float64(Box<Attributes>),
    Int32(Box<Attributes>),
    UInt64(Box<Attributes>),
    Boolean(Box<Attributes>),
    Enumeration(Box<Attributes>),
}

/// Attributes that a variable of any type may have.
#[derive(Debug, Default, Serialize)]
struct Attributes {
    #[serde(rename = "@name")]
    name: String,
    #[serde(rename = "@valueReference")]
    value_reference: u32,
    #[serde(rename = "@description")]
    description: String,
    #[serde(rename = "@causality")]
    causality: &'static str,
    #[serde(rename = "@variability")]
    variability: &'static str,
    #[serde(rename = "@initial")]
    initial: Option<&'static str>,
    #[serde(rename = "@intermediateUpdate")]
    intermediate_update: Option<bool>,
    #[serde(rename = "@declaredType")]
    declared_type: Option<&'static str>,
    #[serde(rename = "@unit")]
    unit: Option<&'static str>,
    #[serde(rename = "@displayUnit")]
    display_unit: Option<&'static str>,
    #[serde(rename = "@min")]
    min: Option<String>,
    #[serde(rename = "@max")]
    max: Option<String>,
    #[serde(rename = "@nominal")]
    nominal: Option<String>,
    #[serde(rename = "@start")]
    start: Option<String>,
    #[serde(rename = "@derivative")]
    derivative: Option<u32>,
    #[serde(rename = "@reinit")]
    reinit: Option<bool>,
    #[serde(rename = "Dimension")]
    dimensions: Vec<Size>,
}

/// Size of an array along one dimension: fixed, or set by a structural parameter.
#[derive(Debug, Serialize)]
struct Size {
    #[serde(rename = "@start")]
    start: Option<usize>,
    #[serde(rename = "@valueReference")]
    value_reference: Option<u32>,
}

#[derive(Debug, Serialize)]
struct Structure {
    #[serde(rename = "Output")]
    outputs: Vec<Unknown>,
    #[serde(rename = "ContinuousStateDerivative")]
    derivatives: Vec<Unknown>,
    #[serde(rename = "InitialUnknown")]
    initial_unknowns: Vec<Unknown>,
    #[serde(rename = "EventIndicator")]
    event_indicators: Vec<Unknown>,
}

/// An unknown with the value references of what it depends on.
#[derive(Debug, Serialize)]
struct Unknown {
    #[serde(rename = "@valueReference")]
    value_reference: u32,
    #[serde(rename = "@dependencies")]
    dependencies: String,
    #[serde(rename = "@dependenciesKind")]
    dependencies_kind: String,
}

// ---- What they hold ----

fn description<M: Model>(layout: Layout) -> ModelDescription {
    let table = M::table();
    ModelDescription {
        fmi_version: "3.0",
        model_name: table.about.model,
        instantiation_token: Fmi3::token::<M>(layout),
        description: table.about.description,
        author: env!("CARGO_PKG_AUTHORS"),
        version: table.about.version,
        copyright: format!("(c) 2026 {}", env!("CARGO_PKG_AUTHORS")),
        license: env!("CARGO_PKG_LICENSE"),
        generation_tool: format!("{} {}", table.about.model, table.about.version),
        generation_date_and_time: RELEASED,
        variable_naming_convention: "structured",
        model_exchange: ModelExchange {
            model_identifier: table.about.model,
            needs_execution_tool: false,
            can_be_instantiated_only_once_per_process: false,
            can_get_and_set_fmu_state: true,
            can_serialize_fmu_state: true,
            provides_directional_derivatives: true,
            provides_adjoint_derivatives: true,
            provides_per_element_dependencies: true,
            needs_completed_integrator_step: true,
            provides_evaluate_discrete_states: false,
        },
        co_simulation: CoSimulation {
            model_identifier: table.about.model,
            needs_execution_tool: false,
            can_be_instantiated_only_once_per_process: false,
            can_get_and_set_fmu_state: true,
            can_serialize_fmu_state: true,
            provides_directional_derivatives: true,
            provides_adjoint_derivatives: true,
            provides_per_element_dependencies: true,
            can_handle_variable_communication_step_size: true,
            max_output_derivative_order: 1,
            provides_intermediate_update: true,
            might_return_early_from_do_step: true,
            can_return_early_after_intermediate_update: true,
            has_event_mode: true,
            provides_evaluate_discrete_states: false,
        },
        units: Units { all: units_with_time(table.units()).map(unit).collect() },
        types: Some(table.enumerations())
            .filter(|all| !all.is_empty())
            .map(|all| Types { all: all.into_iter().map(enumeration_type).collect() }),
        log_categories: LogCategories {
            all: categories::<M, Fmi3>(table)
                .into_iter()
                .map(|c| Category { name: c.name, description: c.description })
                .collect(),
        },
        default_experiment: DefaultExperiment {
            start_time: real(0.0),
            stop_time: real(STOP_TIME),
            tolerance: real(DEFAULT_TOLERANCE),
            step_size: real(STEP_SIZE),
        },
        variables: Variables {
            all: match layout {
                Layout::Scalars => table.scalars.iter().map(variable).chain(extra::<M>()).collect(),
                Layout::Arrays => {
                    table.variables.iter().map(array).chain(extra_arrays::<M>()).collect()
                }
            },
        },
        structure: Structure {
            outputs: unknowns::<M>(layout, is_output, |s| s.depends_on().collect()),
            derivatives: unknowns::<M>(layout, is_derivative, |s| s.depends_on().collect()),
            initial_unknowns: unknowns::<M>(
                layout,
                |s| {
                    let calculated = s.variable.causality == Causality::CalculatedParameter;
                    is_output(s) || calculated || s.variable.state.is_some() || is_derivative(s)
                },
                |s| s.initial_depends_on().collect(),
            ),
            event_indicators: event_indicators::<M>(layout),
        },
    }
}

/// The units of the table's variables and of time, in the order of all units.
fn units_with_time(
    used: impl Iterator<Item = &'static Unit>,
) -> impl Iterator<Item = &'static Unit> {
    let used: Vec<_> = used.map(|unit| unit.name).collect();
    UNITS.iter().filter(move |unit| unit.name == TIME_UNIT || used.contains(&unit.name))
}

/// The unit of the independent variable.
const TIME_UNIT: &str = "s";

fn enumeration_type(of: &Enumeration) -> EnumerationType {
    let items = of.items.iter().zip(1..);
    EnumerationType {
        name: of.name,
        description: of.description,
        items: items
            .map(|(item, value)| Item { name: item.name, value, description: item.description })
            .collect(),
    }
}

fn variable<M: Model>(scalar: &Scalar<M>) -> Variable {
    let v = scalar.variable;
    let derivative = match v.access {
        Access::Derivative(place) => M::table().state_at(place(scalar.element)),
        _ => None,
    };
    of_entry(
        Layout::Scalars,
        v,
        Attributes {
            name: scalar.name(),
            value_reference: Fmi3::reference(scalar),
            start: scalar.start().map(text),
            derivative: derivative.map(Fmi3::reference),
            ..Attributes::default()
        },
    )
}

/// An entry of the table as one variable, of the size it starts with.
fn array<M: Model>(v: &'static runtime::variable::Variable<M>) -> Variable {
    let derivative = match v.access {
        Access::Derivative(place) => M::table().state_at(place(0)),
        _ => None,
    };
    let (mut parameters, mut inputs) = (M::Parameters::default(), M::Inputs::default());
    let present = elements(v).into_iter();
    let mut starts: Vec<_> = present
        .filter_map(|element| v.start(&mut parameters, &mut inputs, element))
        .map(text)
        .collect();
    // One value is for all.
    if starts.iter().all(|start| *start == starts[0]) {
        starts.truncate(1);
    }
    let size = |dimension: &Dimension| match dimension {
        Dimension::Fixed(length) => Size { start: Some(*length), value_reference: None },
        Dimension::Sized(name, _) => {
            Size { start: None, value_reference: entry::<M>(name).map(arrays::reference) }
        }
    };
    of_entry(
        Layout::Arrays,
        v,
        Attributes {
            name: v.array_name(),
            value_reference: arrays::reference(v),
            start: Some(starts.join(" ")).filter(|starts| !starts.is_empty()),
            derivative: derivative.map(|state| arrays::reference(state.variable)),
            dimensions: v.shape.iter().map(size).collect(),
            ..Attributes::default()
        },
    )
}

/// The entry of that name.
fn entry<M: Model>(name: &str) -> Option<&'static runtime::variable::Variable<M>> {
    M::table().variables.iter().find(|v| v.name == name)
}

/// The elements that an entry has at the start, counted by rows in the largest array.
fn elements<M: Model>(v: &runtime::variable::Variable<M>) -> Vec<usize> {
    let all = Arrays::new::<M>(&M::table().starts());
    let scalars = all.of(arrays::reference(v)).unwrap_or_default().iter();
    scalars.map(|reference| M::table().scalars[*reference as usize - 1].element).collect()
}

fn text(value: Value) -> String {
    match value {
        Value::Real(x) => real(x),
        Value::Integer(n) => n.to_string(),
        Value::Boolean(b) => b.to_string(),
    }
}

/// Attributes shared by all elements of an entry; those of `own` belong to the variable itself.
fn of_entry<M: Model>(
    layout: Layout,
    v: &runtime::variable::Variable<M>,
    own: Attributes,
) -> Variable {
    let is_structural = layout == Layout::Arrays && M::table().is_structural(v);
    let (causality, initial) = match v.causality {
        // That an input is exact is the default, and CasADi refuses to read it.
        Causality::Input => ("input", None),
        Causality::Output => ("output", Some("calculated")),
        Causality::Local => ("local", Some("calculated")),
        Causality::Parameter if is_structural => ("structuralParameter", Some("exact")),
        Causality::Parameter => ("parameter", Some("exact")),
        Causality::CalculatedParameter => ("calculatedParameter", Some("calculated")),
    };
    let variability = match (v.causality, v.kind) {
        (Causality::Parameter, _) if v.tunable => "tunable",
        (Causality::Parameter | Causality::CalculatedParameter, _) => "fixed",
        (_, Kind::Real(_)) => "continuous",
        _ => "discrete",
    };
    let common = Attributes {
        description: match layout {
            Layout::Scalars => v.description.into(),
            Layout::Arrays => v.description.replace("[]", ""),
        },
        causality,
        variability,
        initial,
        intermediate_update: has_intermediate_update(v).then_some(true),
        ..own
    };
    match v.kind {
        Kind::Real(Quantity { unit, display_unit, min, max, nominal }) => {
            Variable::Float64(Box::new(Attributes {
                unit: Some(unit).filter(|unit| !unit.is_empty()),
                display_unit,
                min: min.map(real),
                max: max.map(real),
                nominal: nominal.map(real),
                reinit: v.reinit.then_some(true),
                ..common
            }))
        }
        Kind::Integer { min, max } => {
            let of_integer = Box::new(Attributes {
                min: min.map(|n| n.to_string()),
                max: max.map(|n| n.to_string()),
                ..common
            });
            match is_structural {
                true => Variable::UInt64(of_integer),
                false => Variable::Int32(of_integer),
            }
        }
        Kind::Boolean => Variable::Boolean(Box::new(common)),
        Kind::Enumeration(of) => {
            Variable::Enumeration(Box::new(Attributes { declared_type: Some(of.name), ..common }))
        }
    }
}

/// The independent variable and the event indicators.
fn extra<M: Model>() -> impl Iterator<Item = Variable> {
    let references = time_reference::<M>()..;
    references.zip(extra_names::<M>()).map(|(value_reference, name)| {
        let is_time = value_reference == time_reference::<M>();
        let of = if is_time { of_time() } else { of_indicators() };
        Variable::Float64(Box::new(Attributes { name, value_reference, ..of }))
    })
}

fn of_time() -> Attributes {
    Attributes {
        description: "Simulation time".into(),
        causality: "independent",
        variability: "continuous",
        unit: Some(TIME_UNIT),
        ..Attributes::default()
    }
}

fn of_indicators() -> Attributes {
    Attributes {
        description: "Crosses zero at events; positive between them".into(),
        causality: "local",
        variability: "continuous",
        initial: Some("calculated"),
        ..Attributes::default()
    }
}

/// The same where the event indicators are one array.
fn extra_arrays<M: Model>() -> impl Iterator<Item = Variable> {
    let indicators = M::table().about.event_indicators;
    let time = arrays::time::<M>();
    let both = [
        Attributes { name: "time".into(), value_reference: time, ..of_time() },
        Attributes {
            name: arrays::INDICATORS.into(),
            value_reference: time + 1,
            dimensions: vec![Size { start: Some(indicators), value_reference: None }],
            ..of_indicators()
        },
    ];
    let count = if indicators > 0 { 2 } else { 1 };
    both.into_iter().take(count).map(|attributes| Variable::Float64(Box::new(attributes)))
}

/// Some of the scalars in the order of their value references, with what they depend on. An array depends on what any
/// of its elements does.
fn unknowns<M: Model>(
    layout: Layout,
    of_interest: impl Fn(&Scalar<M>) -> bool,
    dependencies: impl Fn(&Scalar<M>) -> Vec<&'static Scalar<M>>,
) -> Vec<Unknown> {
    let all = M::table().scalars.iter().filter(|scalar| of_interest(scalar));
    let mut unknowns: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    for scalar in all {
        let known = dependencies(scalar);
        let known = known.iter().map(|known| reference(layout, known));
        unknowns.entry(reference(layout, scalar)).or_default().extend(known);
    }
    unknowns.into_iter().map(|(reference, known)| unknown(reference, &known)).collect()
}

/// The value reference by which a scalar goes.
fn reference<M: Model>(layout: Layout, scalar: &Scalar<M>) -> u32 {
    match layout {
        Layout::Scalars => Fmi3::reference(scalar),
        Layout::Arrays => arrays::reference(scalar.variable),
    }
}

/// The event indicators; which inputs and states each depends on is the model's choice of contact and limits.
fn event_indicators<M: Model>(layout: Layout) -> Vec<Unknown> {
    let is_known = |s: &&'static Scalar<M>| {
        s.variable.causality == Causality::Input || s.variable.state.is_some()
    };
    let known = M::table().scalars.iter().filter(is_known);
    let known: BTreeSet<u32> = known.map(|scalar| reference(layout, scalar)).collect();
    let count = M::table().about.event_indicators as u32;
    let references = match layout {
        Layout::Scalars => time_reference::<M>() + 1..=time_reference::<M>() + count,
        Layout::Arrays => arrays::time::<M>() + 1..=arrays::time::<M>() + count.min(1),
    };
    references.map(|n| unknown(n, &known)).collect()
}

fn unknown(value_reference: u32, known: &BTreeSet<u32>) -> Unknown {
    let references: Vec<_> = known.iter().map(u32::to_string).collect();
    Unknown {
        value_reference,
        dependencies: references.join(" "),
        dependencies_kind: vec!["dependent"; references.len()].join(" "),
    }
}

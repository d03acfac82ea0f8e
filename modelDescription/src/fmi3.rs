//! modelDescription.xml of FMI 3.0 from the same table: scalars with the names of FMI 2.0, and behind them
//! the independent variable and the event indicators, which FMI 2.0 has no variables for.

use std::path::PathBuf;

use runtime::Model;
use runtime::instance::DEFAULT_TOLERANCE;
use runtime::log::categories;
use runtime::table::Scalar;
use runtime::unit::{UNITS, Unit};
use runtime::v3::{Fmi3, extra_names, has_intermediate_update, time_reference};
use runtime::variable::{Access, Causality, Enumeration, Kind, Quantity, Value};
use runtime::version::Version;
use serde::Serialize;

use crate::schema::{Category, DefaultExperiment, Item, LogCategories, Units};
use crate::{RELEASED, STEP_SIZE, STOP_TIME, folder, is_derivative, is_output, real, unit, write};

/// Where the committed XML is.
pub fn path<M: Model>() -> PathBuf {
    folder::<M>().join("fmi3/modelDescription.xml")
}

/// The file's text.
pub fn xml<M: Model>() -> Result<String, serde_xml_rs::Error> {
    write(&description::<M>())
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
    Boolean(Box<Attributes>),
    Enumeration(Box<Attributes>),
}

/// What a variable of any type may have.
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

fn description<M: Model>() -> ModelDescription {
    let table = M::table();
    ModelDescription {
        fmi_version: "3.0",
        model_name: table.about.model,
        instantiation_token: Fmi3::token::<M>(),
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
            all: table.scalars.iter().map(variable).chain(extra::<M>()).collect(),
        },
        structure: Structure {
            outputs: unknowns::<M>(is_output, |s| s.depends_on().collect()),
            derivatives: unknowns::<M>(is_derivative, |s| s.depends_on().collect()),
            initial_unknowns: unknowns::<M>(
                |s| {
                    let calculated = s.variable.causality == Causality::CalculatedParameter;
                    is_output(s) || calculated || s.variable.state.is_some() || is_derivative(s)
                },
                |s| s.initial_depends_on().collect(),
            ),
            event_indicators: event_indicators::<M>(),
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
    let (causality, initial) = match v.causality {
        // That an input is exact is the default, and CasADi refuses to read it.
        Causality::Input => ("input", None),
        Causality::Output => ("output", Some("calculated")),
        Causality::Local => ("local", Some("calculated")),
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
        name: scalar.name(),
        value_reference: Fmi3::reference(scalar),
        description: v.description.into(),
        causality,
        variability,
        initial,
        intermediate_update: has_intermediate_update(scalar).then_some(true),
        start: scalar.start().map(|value| match value {
            Value::Real(x) => real(x),
            Value::Integer(n) => n.to_string(),
            Value::Boolean(b) => b.to_string(),
        }),
        ..Attributes::default()
    };
    match v.kind {
        Kind::Real(Quantity { unit, display_unit, min, max, nominal }) => {
            let derivative = match v.access {
                Access::Derivative(place) => M::table().state_at(place(scalar.element)),
                _ => None,
            };
            Variable::Float64(Box::new(Attributes {
                unit: Some(unit).filter(|unit| !unit.is_empty()),
                display_unit,
                min: min.map(real),
                max: max.map(real),
                nominal: nominal.map(real),
                derivative: derivative.map(Fmi3::reference),
                reinit: v.reinit.then_some(true),
                ..common
            }))
        }
        Kind::Integer { min, max } => Variable::Int32(Box::new(Attributes {
            min: min.map(|n| n.to_string()),
            max: max.map(|n| n.to_string()),
            ..common
        })),
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
        let common = Attributes {
            value_reference,
            variability: "continuous",
            name,
            ..Attributes::default()
        };
        Variable::Float64(Box::new(if is_time {
            Attributes {
                description: "Simulation time".into(),
                causality: "independent",
                unit: Some(TIME_UNIT),
                ..common
            }
        } else {
            Attributes {
                description: "Crosses zero at events; positive between them".into(),
                causality: "local",
                initial: Some("calculated"),
                ..common
            }
        }))
    })
}

/// Some of the scalars in the order of their value references, with what they depend on.
fn unknowns<M: Model>(
    of_interest: impl Fn(&Scalar<M>) -> bool,
    dependencies: impl Fn(&Scalar<M>) -> Vec<&'static Scalar<M>>,
) -> Vec<Unknown> {
    let all = M::table().scalars.iter().filter(|scalar| of_interest(scalar));
    all.map(|scalar| unknown(Fmi3::reference(scalar), dependencies(scalar))).collect()
}

/// The event indicators; which inputs and states each depends on is the model's choice of contact and limits.
fn event_indicators<M: Model>() -> Vec<Unknown> {
    let known = |s: &&'static Scalar<M>| {
        s.variable.causality == Causality::Input || s.variable.state.is_some()
    };
    let count = M::table().about.event_indicators as u32;
    let references = (1..=count).map(|n| time_reference::<M>() + n);
    references.map(|n| unknown(n, M::table().scalars.iter().filter(known).collect())).collect()
}

fn unknown<M: Model>(value_reference: u32, known: Vec<&Scalar<M>>) -> Unknown {
    let references: Vec<_> = known.iter().map(|s| Fmi3::reference(s).to_string()).collect();
    Unknown {
        value_reference,
        dependencies: references.join(" "),
        dependencies_kind: vec!["dependent"; references.len()].join(" "),
    }
}

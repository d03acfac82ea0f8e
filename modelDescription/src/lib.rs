//! modelDescription.xml from an FMU's variable table.
//!
//! This crate knows no single variable: the table describes them. The XML is committed so that a
//! change of the interface shows in a diff.

pub mod fmi3;
pub mod icon;
pub mod names;
pub mod schema;
pub mod variables;

use std::path::PathBuf;

use runtime::Model;
use runtime::instance::DEFAULT_TOLERANCE;
use runtime::log::categories;
use runtime::table::Scalar;
use runtime::unit::Unit;
use runtime::v2::Fmi2;
use runtime::variable::{Access, Causality, Enumeration, Kind, Value};
use runtime::version::Version;

/// The folder of a model's XML, documentation and pictures.
pub fn folder<M: Model>() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(M::table().about.model)
}

/// Path of the committed XML.
pub fn path<M: Model>() -> PathBuf {
    folder::<M>().join("modelDescription.xml")
}

/// The date of the release; not of the build, which the same commit must survive
/// byte for byte.
const RELEASED: &str = "2026-11-22T12:00:00Z";

/// Default stop time: 20 s at the gyro's 50 Hz.
const STOP_TIME: f64 = 20.0;
const STEP_SIZE: f64 = 0.02;

/// The file's text.
pub fn xml<M: Model>() -> Result<String, serde_xml_rs::Error> {
    write(&description::<M>())
}

fn write(description: &impl serde::Serialize) -> Result<String, serde_xml_rs::Error> {
    let layout = xml::EmitterConfig::new().perform_indent(true).indent_string("  ");
    let mut text = serde_xml_rs::SerdeXml::new().emitter(layout).to_string(description)?;
    text.push('\n');
    Ok(text)
}

fn description<M: Model>() -> schema::ModelDescription {
    let table = M::table();
    schema::ModelDescription {
        fmi_version: "2.0",
        model_name: table.about.model,
        guid: table.guid().into(),
        description: table.about.description,
        author: env!("CARGO_PKG_AUTHORS"),
        version: table.about.version,
        copyright: format!("(c) 2026 {}", env!("CARGO_PKG_AUTHORS")),
        license: env!("CARGO_PKG_LICENSE"),
        generation_tool: format!("{} {}", table.about.model, table.about.version),
        generation_date_and_time: RELEASED,
        variable_naming_convention: "structured",
        number_of_event_indicators: table.about.event_indicators,
        model_exchange: schema::ModelExchange {
            model_identifier: table.about.model,
            needs_execution_tool: false,
            completed_integrator_step_not_needed: false,
            can_be_instantiated_only_once_per_process: false,
            can_not_use_memory_management_functions: true,
            can_get_and_set_fmu_state: true,
            can_serialize_fmu_state: true,
            provides_directional_derivative: true,
        },
        co_simulation: schema::CoSimulation {
            model_identifier: table.about.model,
            needs_execution_tool: false,
            can_handle_variable_communication_step_size: true,
            can_interpolate_inputs: true,
            max_output_derivative_order: 1,
            can_run_asynchronuously: false,
            can_be_instantiated_only_once_per_process: false,
            can_not_use_memory_management_functions: true,
            can_get_and_set_fmu_state: true,
            can_serialize_fmu_state: true,
            provides_directional_derivative: true,
        },
        units: schema::Units { all: table.units().map(unit).collect() },
        types: Some(table.enumerations())
            .filter(|all| !all.is_empty())
            .map(|all| schema::Types { all: all.into_iter().map(simple_type).collect() }),
        log_categories: schema::LogCategories {
            all: categories::<M, Fmi2>(table)
                .into_iter()
                .map(|c| schema::Category { name: c.name, description: c.description })
                .collect(),
        },
        default_experiment: schema::DefaultExperiment {
            start_time: real(0.0),
            stop_time: real(STOP_TIME),
            tolerance: real(DEFAULT_TOLERANCE),
            step_size: real(STEP_SIZE),
        },
        variables: schema::Variables { all: table.scalars.iter().map(variable).collect() },
        structure: schema::Structure {
            outputs: unknowns::<M>(is_output, |s| s.depends_on().collect()),
            derivatives: unknowns::<M>(is_derivative, |s| s.depends_on().collect()),
            initial_unknowns: unknowns::<M>(
                |s| {
                    let calculated = s.variable.causality == Causality::CalculatedParameter;
                    is_output(s) || calculated || s.variable.state.is_some() || is_derivative(s)
                },
                |s| s.initial_depends_on().collect(),
            ),
        },
    }
}

fn unit(unit: &Unit) -> schema::Unit {
    let exponent = |n: i32| (n != 0).then_some(n);
    schema::Unit {
        name: unit.name,
        base: unit.base.map(|[kg, m, s, rad]| schema::BaseUnit {
            kg: exponent(kg),
            m: exponent(m),
            s: exponent(s),
            rad: exponent(rad),
        }),
        displayed: unit
            .display_units
            .iter()
            .map(|(name, factor)| schema::DisplayUnit { name, factor: real(*factor) })
            .collect(),
    }
}

fn simple_type(of: &Enumeration) -> schema::SimpleType {
    let items = of.items.iter().zip(1..);
    schema::SimpleType {
        name: of.name,
        description: of.description,
        enumeration: schema::Items {
            all: items
                .map(|(item, value)| schema::Item {
                    name: item.name,
                    value,
                    description: item.description,
                })
                .collect(),
        },
    }
}

fn variable<M: Model>(scalar: &Scalar<M>) -> schema::ScalarVariable {
    let v = scalar.variable;
    let (causality, initial) = match v.causality {
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
    let start = scalar.start().map(|value| match value {
        Value::Real(x) => real(x),
        Value::Integer(n) => n.to_string(),
        Value::Boolean(b) => b.to_string(),
    });
    let kind = match v.kind {
        Kind::Real(q) => schema::Kind::Real {
            unit: Some(q.unit).filter(|unit| !unit.is_empty()),
            display_unit: q.display_unit,
            min: q.min.map(real),
            max: q.max.map(real),
            nominal: q.nominal.map(real),
            start,
            derivative: match v.access {
                Access::Derivative(place) => M::table().state_at(place(scalar.element)).map(index),
                _ => None,
            },
            reinit: v.reinit.then_some(true),
        },
        Kind::Integer { min, max } => schema::Kind::Integer { min, max, start },
        Kind::Boolean => schema::Kind::Boolean { start },
        Kind::Enumeration(of) => schema::Kind::Enumeration { declared_type: of.name, start },
    };
    schema::ScalarVariable {
        name: scalar.name(),
        value_reference: Fmi2::reference(scalar),
        description: v.description,
        causality,
        variability,
        initial,
        kind,
    }
}

/// The shortest decimal number that reads back as the same bits.
fn real(x: f64) -> String {
    format!("{x:?}")
}

fn is_output<M: Model>(scalar: &Scalar<M>) -> bool {
    scalar.variable.causality == Causality::Output
}

fn is_derivative<M: Model>(scalar: &Scalar<M>) -> bool {
    matches!(scalar.access, Access::Derivative(_))
}

/// Place among the variables, counted from 1.
fn index<M: Model>(scalar: &Scalar<M>) -> usize {
    scalar.index as usize + 1
}

/// Some of the scalars in the order of their indices, with what they depend on.
fn unknowns<M: Model>(
    of_interest: impl Fn(&Scalar<M>) -> bool,
    dependencies: impl Fn(&Scalar<M>) -> Vec<&'static Scalar<M>>,
) -> schema::Unknowns {
    let all = M::table().scalars.iter().filter(|scalar| of_interest(scalar)).map(|scalar| {
        let text: Vec<_> =
            dependencies(scalar).into_iter().map(|known| index(known).to_string()).collect();
        schema::Unknown {
            index: index(scalar),
            dependencies: text.join(" "),
            dependencies_kind: vec!["dependent"; text.len()].join(" "),
        }
    });
    schema::Unknowns { all: all.collect() }
}

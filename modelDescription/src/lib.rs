//! modelDescription.xml from the FMU's variable table.
//!
//! Nothing is said here about any single variable: what the XML says of it is in
//! `HubSlosh::table`, and the XML is committed so that a change of the interface
//! shows in a diff.

pub mod icon;
pub mod schema;
pub mod variables;

use HubSlosh::instance::DEFAULT_TOLERANCE;
use HubSlosh::log::CATEGORIES;
use HubSlosh::table::{self, ENUMERATIONS, MODEL, SCALARS, Scalar, UNITS, VERSION};
use HubSlosh::variable::{Access, Causality, Kind, Value};

/// Where the committed XML is.
pub const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/HubSlosh/modelDescription.xml");

/// The date of the release; not of the build, which the same commit must survive
/// byte for byte.
const RELEASED: &str = "2026-11-21T12:00:00Z";

/// What a host shows when it knows nothing better: 20 s at the gyro's 50 Hz.
const STOP_TIME: f64 = 20.0;
const STEP_SIZE: f64 = 0.02;

/// The file's text.
pub fn xml() -> Result<String, serde_xml_rs::Error> {
    let layout = xml::EmitterConfig::new().perform_indent(true).indent_string("  ");
    let mut text = serde_xml_rs::SerdeXml::new().emitter(layout).to_string(&description())?;
    text.push('\n');
    Ok(text)
}

fn description() -> schema::ModelDescription {
    schema::ModelDescription {
        fmi_version: "2.0",
        model_name: MODEL,
        guid: table::guid(),
        description: "A spacecraft hub on a bearing with dry friction that can stick, and on it a \
                      tank with sloshing liquid, a reaction wheel and a rate gyro",
        author: env!("CARGO_PKG_AUTHORS"),
        version: VERSION,
        copyright: format!("(c) 2026 {}", env!("CARGO_PKG_AUTHORS")),
        license: env!("CARGO_PKG_LICENSE"),
        generation_tool: format!("{MODEL} {VERSION}"),
        generation_date_and_time: RELEASED,
        variable_naming_convention: "structured",
        number_of_event_indicators: plant::INDICATORS,
        model_exchange: schema::ModelExchange {
            model_identifier: MODEL,
            needs_execution_tool: false,
            completed_integrator_step_not_needed: false,
            can_be_instantiated_only_once_per_process: false,
            can_not_use_memory_management_functions: true,
            can_get_and_set_fmu_state: true,
            can_serialize_fmu_state: true,
            provides_directional_derivative: true,
        },
        co_simulation: schema::CoSimulation {
            model_identifier: MODEL,
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
        units: schema::Units { all: UNITS.iter().map(unit).collect() },
        types: schema::Types { all: ENUMERATIONS.into_iter().map(simple_type).collect() },
        log_categories: schema::LogCategories {
            all: CATEGORIES
                .iter()
                .map(|c| schema::Category { name: c.name, description: c.description })
                .collect(),
        },
        default_experiment: schema::DefaultExperiment {
            start_time: real(0.0),
            stop_time: real(STOP_TIME),
            tolerance: real(DEFAULT_TOLERANCE),
            step_size: real(STEP_SIZE),
        },
        variables: schema::Variables { all: SCALARS.iter().map(variable).collect() },
        structure: schema::Structure {
            outputs: unknowns(is_output, |s| s.follows().collect()),
            derivatives: unknowns(is_rate, |s| s.follows().collect()),
            initial_unknowns: unknowns(
                |s| {
                    let calculated = s.variable.causality == Causality::CalculatedParameter;
                    is_output(s) || calculated || s.variable.state.is_some() || is_rate(s)
                },
                |s| s.starts_from().collect(),
            ),
        },
    }
}

fn unit(unit: &table::Unit) -> schema::Unit {
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
            .displayed
            .iter()
            .map(|(name, factor)| schema::DisplayUnit { name, factor: real(*factor) })
            .collect(),
    }
}

fn simple_type(of: &HubSlosh::variable::Enumeration) -> schema::SimpleType {
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

fn variable(scalar: &Scalar) -> schema::ScalarVariable {
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
    let start = v.start().map(|value| match value {
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
                Access::Rate(place) => table::state_at(place.at(scalar.element)).map(index),
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
        value_reference: scalar.reference,
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

fn is_output(scalar: &Scalar) -> bool {
    scalar.variable.causality == Causality::Output
}

fn is_rate(scalar: &Scalar) -> bool {
    matches!(scalar.variable.access, Access::Rate(_))
}

/// Place among the variables, counted from 1.
fn index(scalar: &Scalar) -> usize {
    scalar.reference as usize + 1
}

/// Some of the scalars in the order of their indices, with what they depend on.
fn unknowns(
    of_interest: impl Fn(&Scalar) -> bool,
    dependencies: impl Fn(&Scalar) -> Vec<&'static Scalar>,
) -> schema::Unknowns {
    let all = SCALARS.iter().filter(|scalar| of_interest(scalar)).map(|scalar| {
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

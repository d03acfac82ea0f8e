//! What the fuzzer does to an instance, as functions of bytes: the tests call them as well.
//!
//! Everything here panics when something happens that must not, whatever the bytes are.

pub mod states;
pub mod values;

use HubSlosh::Instance;
use HubSlosh::Scalar;
use HubSlosh::from_bytes;
use HubSlosh::table::TABLE;
use runtime::operation::{self as op, Operation};
use runtime::snapshot::to_bytes;
use runtime::variable::{Access, Causality, Kind, Value};

/// The call that reads a variable of this type.
fn getter(scalar: &Scalar) -> &'static Operation {
    match scalar.variable.kind {
        Kind::Real(_) => &op::GET_REAL,
        Kind::Integer { .. } | Kind::Enumeration(_) => &op::GET_INTEGER,
        Kind::Boolean => &op::GET_BOOLEAN,
    }
}

/// A value's own call to set it.
fn setter(value: Value) -> &'static Operation {
    match value {
        Value::Real(_) => &op::SET_REAL,
        Value::Integer(_) => &op::SET_INTEGER,
        Value::Boolean(_) => &op::SET_BOOLEAN,
    }
}

/// Every output and local variable of a plant in motion can be read and is a number.
///
/// # Panics
/// If not.
fn everything_is_a_number(instance: &mut Instance) {
    let shown = |scalar: &&Scalar| {
        matches!(scalar.variable.causality, Causality::Output | Causality::Local)
            // these are read one by one from all states together: slow, and seen in the states
            && !matches!(scalar.variable.access, Access::Derivative(_))
    };
    for scalar in TABLE.scalars.iter().filter(shown) {
        match instance.get(getter(scalar), scalar.reference) {
            Ok(Value::Real(x)) => assert!(x.is_finite(), "{} = {x}", scalar.name()),
            Ok(_) => {}
            Err(fault) => panic!("{}: {}", scalar.name(), fault.text),
        }
    }
}

/// A state that is written out reads back as itself, and writes the same bytes.
///
/// # Panics
/// If not.
fn survives_being_saved(instance: &Instance) -> Instance {
    let bytes = to_bytes(instance);
    let again = from_bytes(&bytes).unwrap_or_else(|why| panic!("own bytes are refused: {why}"));
    assert!(to_bytes(&again) == bytes, "bytes that were read are written otherwise");
    again
}

//! What the fuzzer does to an instance of any model, as functions of bytes: the tests call them as
//! well.
//!
//! Everything here panics when something happens that must not, whatever the bytes are.

#[cfg(feature = "libfuzzer")]
pub mod calls;
pub mod states;
pub mod values;

use runtime::Model;
use runtime::call::Call;
use runtime::instance::Instance;
use runtime::snapshot::{from_bytes, to_bytes};
use runtime::table::Scalar;
use runtime::v2::{Fmi2, GET_BOOLEAN, GET_INTEGER, GET_REAL, SET_BOOLEAN, SET_INTEGER, SET_REAL};
use runtime::variable::{Access, Causality, Kind, Value};
use runtime::version::Version;

/// What the environment variable `HUBSLOSH_FUZZ_TARGET` names.
///
/// # Panics
/// If it names no target, or if something happened that must not.
#[cfg(feature = "libfuzzer")]
pub fn run<M: Model>(data: &[u8]) {
    static TARGET: std::sync::OnceLock<fn(&[u8])> = std::sync::OnceLock::new();
    let target = TARGET.get_or_init(|| match std::env::var("HUBSLOSH_FUZZ_TARGET").as_deref() {
        Ok("calls") => calls::run::<M>,
        Ok("states") => states::run::<M>,
        Ok("values") => values::run::<M>,
        _ => panic!("HUBSLOSH_FUZZ_TARGET must be calls, states or values"),
    });
    target(data);
}

/// What the hostile host knows of an FMU besides its GUID (`host.h`): the number of scalar
/// variables, of outputs, of continuous states, of event indicators.
pub fn sizes<M: Model>() -> [usize; 4] {
    let table = M::table();
    let is_output = |s: &&Scalar<M>| s.variable.causality == Causality::Output;
    let outputs = table.scalars.iter().take_while(is_output).count();
    [table.scalars.len(), outputs, table.derivatives().len(), table.about.event_indicators]
}

/// The call that reads a variable of this type.
fn getter<M: Model>(scalar: &Scalar<M>) -> &'static Call {
    match scalar.variable.kind {
        Kind::Real(_) => &GET_REAL,
        Kind::Integer { .. } | Kind::Enumeration(_) => &GET_INTEGER,
        Kind::Boolean => &GET_BOOLEAN,
    }
}

/// A value's own call to set it.
fn setter(value: Value) -> &'static Call {
    match value {
        Value::Real(_) => &SET_REAL,
        Value::Integer(_) => &SET_INTEGER,
        Value::Boolean(_) => &SET_BOOLEAN,
    }
}

/// Every output and local variable of a model in motion can be read and is a number.
///
/// # Panics
/// If not.
fn everything_is_a_number<M: Model>(instance: &mut Instance<M, Fmi2>) {
    let shown = |scalar: &&Scalar<M>| {
        matches!(scalar.variable.causality, Causality::Output | Causality::Local)
            // these are read one by one from all states together: slow, and seen in the states
            && !matches!(scalar.variable.access, Access::Derivative(_))
    };
    for scalar in M::table().scalars.iter().filter(shown) {
        match instance.get(getter(scalar), Fmi2::reference(scalar)) {
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
fn survives_being_saved<M: Model>(instance: &Instance<M, Fmi2>) -> Instance<M, Fmi2> {
    let bytes = to_bytes(instance);
    let again = from_bytes(&bytes).unwrap_or_else(|why| panic!("own bytes are refused: {why}"));
    assert!(to_bytes(&again) == bytes, "bytes that were read are written otherwise");
    again
}

//! Tests of an instance through the Rust interface, with a model that uses all features of the runtime ([`vessels`]) and a
//! model that has only states (tests/spring).

mod experiment;
mod log;
mod model_exchange;
mod reported;
mod snapshot;
mod steps;
mod table;
pub(crate) mod trays;
mod v3;
mod v3_arrays;
mod values;
mod variable;
mod version;
pub(crate) mod vessels;

use crate::call::{Fault, Interface, Severity};
use crate::dynamics::Dynamics;
use crate::instance::Instance;
use crate::model::Model;
use crate::snapshot::to_bytes;
use crate::spring::Spring;
use crate::v2::{Fmi2, GET_BOOLEAN, GET_INTEGER, GET_REAL, SET_BOOLEAN, SET_INTEGER, SET_REAL};
use crate::variable::{Kind, Value};
use vessels::{TABLE, Vessels};

type Subject = Instance<Vessels, Fmi2>;

const CS: Interface = Interface::CoSimulation;
const ME: Interface = Interface::ModelExchange;

fn fresh(interface: Interface) -> Subject {
    Instance::new(interface)
}

fn started(interface: Interface, values: &[(&str, f64)]) -> Subject {
    let mut instance = fresh(interface);
    for (name, value) in values {
        set(&mut instance, name, *value).unwrap();
    }
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    instance
}

fn continuous(values: &[(&str, f64)]) -> Subject {
    let mut instance = started(ME, values);
    instance.enter_continuous_time_mode().unwrap();
    instance
}

fn reference(name: &str) -> u32 {
    TABLE.find(name).unwrap_or_else(|| panic!("no variable {name}"))
}

fn references<const N: usize>(names: [&str; N]) -> [u32; N] {
    names.map(reference)
}

fn set(instance: &mut Subject, name: &str, x: f64) -> Result<(), Fault> {
    instance.set(&SET_REAL, &[reference(name)], |_| Value::Real(x))
}

fn set_integer(instance: &mut Subject, name: &str, n: i32) -> Result<(), Fault> {
    instance.set(&SET_INTEGER, &[reference(name)], |_| Value::Integer(n))
}

fn set_boolean(instance: &mut Subject, name: &str, b: bool) -> Result<(), Fault> {
    instance.set(&SET_BOOLEAN, &[reference(name)], |_| Value::Boolean(b))
}

fn get(instance: &mut Subject, name: &str) -> Result<Value, Fault> {
    let reference = reference(name);
    let call = match TABLE.scalars[reference as usize].variable.kind {
        Kind::Real(_) => &GET_REAL,
        Kind::Integer { .. } | Kind::Enumeration(_) => &GET_INTEGER,
        Kind::Boolean => &GET_BOOLEAN,
    };
    instance.get(call, reference)
}

fn real(instance: &mut Subject, name: &str) -> f64 {
    match get(instance, name) {
        Ok(Value::Real(x)) => x,
        other => panic!("{name}: {other:?}"),
    }
}

fn refused<T: std::fmt::Debug>(result: Result<T, Fault>) -> String {
    let fault = result.expect_err("the call should be refused");
    assert_eq!(fault.severity, Severity::Error, "{}", fault.text);
    fault.text
}

fn discarded<T: std::fmt::Debug>(result: Result<T, Fault>) -> String {
    let fault = result.expect_err("the call should be discarded");
    assert_eq!(fault.severity, Severity::Discard, "{}", fault.text);
    fault.text
}

/// Asserts that a refused call leaves the instance unchanged, and returns its message.
fn unchanged<T: std::fmt::Debug>(
    instance: &mut Subject,
    call: impl FnOnce(&mut Subject) -> Result<T, Fault>,
) -> String {
    let before = to_bytes(instance);
    let message = refused(call(instance));
    assert!(to_bytes(instance) == before, "{message}: the instance has changed");
    message
}

fn close(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance * b.abs().max(1e-300), "{a} instead of {b}");
}

fn spring(interface: Interface) -> Instance<Spring, Fmi2> {
    let mut instance = Instance::new(interface);
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    instance
}

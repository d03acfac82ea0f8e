//! Fuzz targets that exercise an instance of any model with random bytes. The tests call them, too. They panic if the
//! instance violates its contract, whatever the bytes are.

#[cfg(feature = "libfuzzer")]
pub mod calls;
pub mod clocks;
pub mod states;
pub mod values;

use runtime::Model;
use runtime::call::{Call, Fault, InstanceState};
use runtime::instance::{Instance, StepInfo};
use runtime::snapshot::{from_bytes, to_bytes};
use runtime::table::{Layout, Scalar};
use runtime::v2::{self, Fmi2};
use runtime::v3::arrays::{self, Arrays};
use runtime::v3::{self, Fmi3};
use runtime::variable::{Access, Causality, Kind, Value};
use runtime::version::Version;

/// Runs the fuzz target that the environment variable `HUBSLOSH_FUZZ_TARGET` names.
///
/// # Panics
/// If the variable does not contain the name of a target, or if the FMU breaks a rule of the target.
#[cfg(feature = "libfuzzer")]
pub fn run<M: Model>(data: &[u8]) {
    static TARGET: std::sync::OnceLock<fn(&[u8])> = std::sync::OnceLock::new();
    let target = TARGET.get_or_init(|| match std::env::var("HUBSLOSH_FUZZ_TARGET").as_deref() {
        Ok("calls") => calls::run::<M>,
        Ok("clocks") => clocks::run::<M>,
        Ok("states") => states::run::<M>,
        Ok("values") => values::run::<M>,
        _ => panic!("HUBSLOSH_FUZZ_TARGET must be calls, clocks, states or values"),
    });
    target(data);
}

/// Returns the numbers that the host in `host.c` needs to know about the FMU in addition to GUID and token: the numbers of
/// scalar variables, outputs, continuous states and event indicators, and the value reference of the first input in FMI 3.0.
pub fn sizes<M: Model>(layout: Layout) -> [usize; 5] {
    let table = M::table();
    if layout == Layout::Arrays {
        let all = Arrays::new::<M>(&table.starts());
        let input = table.inputs().first().map_or(0, |input| arrays::reference(input.variable));
        let (variables, states) = (table.variables.len(), all.states().len());
        return [variables, 0, states, table.about.event_indicators, input as usize];
    }
    let is_output = |s: &&Scalar<M>| s.variable.causality == Causality::Output;
    let outputs = table.scalars.iter().take_while(is_output).count();
    let input = table.inputs().first().map_or(0, Fmi3::reference);
    let states = table.derivatives().len();
    [table.scalars.len(), outputs, states, table.about.event_indicators, input as usize]
}

/// The functions of one version of FMI that get and set values, for reals, integers, enumerations and Booleans in this order.
pub trait Values: Version {
    const GET: [&'static Call; 4];
    const SET: [&'static Call; 4];
}

impl Values for Fmi2 {
    const GET: [&'static Call; 4] =
        [&v2::GET_REAL, &v2::GET_INTEGER, &v2::GET_INTEGER, &v2::GET_BOOLEAN];
    const SET: [&'static Call; 4] =
        [&v2::SET_REAL, &v2::SET_INTEGER, &v2::SET_INTEGER, &v2::SET_BOOLEAN];
}

impl Values for Fmi3 {
    const GET: [&'static Call; 4] =
        [&v3::GET_FLOAT64, &v3::GET_INT32, &v3::GET_INT64, &v3::GET_BOOLEAN];
    const SET: [&'static Call; 4] =
        [&v3::SET_FLOAT64, &v3::SET_INT32, &v3::SET_INT64, &v3::SET_BOOLEAN];
}

fn place<M: Model>(scalar: &Scalar<M>) -> usize {
    match scalar.variable.kind {
        Kind::Real(_) => 0,
        Kind::Integer { .. } => 1,
        Kind::Enumeration(_) => 2,
        Kind::Boolean => 3,
    }
}

fn set<M: Model, V: Values>(
    instance: &mut Instance<M, V>,
    scalar: &Scalar<M>,
    value: Value,
) -> Result<(), Fault> {
    instance.set(V::SET[place(scalar)], &[V::reference(scalar)], |_| value)
}

fn step<M: Model, V: Version>(
    instance: &mut Instance<M, V>,
    at: f64,
    h: f64,
) -> Result<StepInfo, Fault> {
    let info = instance.step_to_event(at, h, true)?;
    if info.event {
        instance.enter_event_mode().expect("the step has reported an event");
        to_steps(instance);
    }
    Ok(info)
}

/// Leaves event mode, so that steps can follow.
///
/// # Panics
/// If the next event is not in the future.
fn to_steps<M: Model, V: Version>(instance: &mut Instance<M, V>) {
    if instance.state() == InstanceState::Event {
        let next = instance.new_discrete_states().expect("in event mode").next_time;
        let time = instance.time();
        assert!(
            next.is_none_or(|next| next > time),
            "the next event, {next:?}, is not after {time:?}"
        );
        _ = instance.enter_step_mode(&v3::ENTER_STEP);
    }
}

/// Checks that every output and local variable of an initialised model can be read and is finite.
///
/// # Panics
/// If a variable cannot be read, or is NaN or infinite.
fn everything_is_a_number<M: Model, V: Values>(instance: &mut Instance<M, V>) {
    let shown = |scalar: &&Scalar<M>| {
        matches!(scalar.variable.causality, Causality::Output | Causality::Local)
            // Derivatives are left out: each is computed from all states together, which is slow, and their errors are
            // visible in the states.
            && !matches!(scalar.variable.access, Access::Derivative(_))
    };
    for scalar in M::table().scalars.iter().filter(shown) {
        match instance.get(V::GET[place(scalar)], V::reference(scalar)) {
            Ok(Value::Real(x)) => assert!(x.is_finite(), "{} = {x}", scalar.name()),
            Ok(_) => {}
            Err(fault) => panic!("{}: {}", scalar.name(), fault.text),
        }
    }
}

/// Serialises an instance and restores it from the bytes. Returns the restored instance.
///
/// # Panics
/// If the bytes are refused, or if the restored instance is serialised to other bytes.
fn survives_being_saved<M: Model, V: Version>(instance: &Instance<M, V>) -> Instance<M, V> {
    let bytes = to_bytes(instance);
    let again = from_bytes(&bytes).unwrap_or_else(|why| panic!("own bytes are refused: {why}"));
    assert!(to_bytes(&again) == bytes, "a deserialised state is serialised to other bytes");
    again
}

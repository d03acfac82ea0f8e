//! Fuzzing of parameters, inputs and step sizes. All values must be finite or there must be an error, a refused call must
//! change nothing, and a step that is repeated from a saved state must give bit-identical results.

use std::time::{Duration, Instant};

use arbitrary::{Result, Unstructured};

use runtime::Model;
use runtime::call::{Events, InstanceState, Interface};
use runtime::instance::Instance;
use runtime::snapshot::to_bytes;
use runtime::v2::Fmi2;
use runtime::v3::Fmi3;
use runtime::variable::{Causality, Kind, Quantity, Value};

use crate::{Values, everything_is_a_number, set, step, survives_being_saved, to_steps};

const STEPS: usize = 12;
/// Longest step, s. It only makes the fuzzer faster, because a model limits the work of a step by itself.
const LONGEST: f64 = 2.0;
/// CPU time after which a simulation ends. Stiff models may use all allowed internal steps in every step, and would take too
/// long.
const SLOW: Duration = Duration::from_secs(1);

/// Creates an instance, sets some values, and simulates. The first byte of `data` determines the FMI version and who handles
/// events, the other bytes the values and steps.
pub fn run<M: Model>(data: &[u8]) {
    let Some((how, data)) = data.split_first() else { return };
    let data = &mut Unstructured::new(data);
    // The simulation ends when no bytes are left.
    _ = match how % 4 {
        0 | 1 => co_simulation::<M, Fmi2>(Events::InStep, data),
        2 => co_simulation::<M, Fmi3>(Events::InStep, data),
        _ => co_simulation::<M, Fmi3>(Events::Reported, data),
    };
}

fn co_simulation<M: Model, V: Values>(events: Events, data: &mut Unstructured) -> Result<()> {
    let mut instance = Instance::<M, V>::with_events(Interface::CoSimulation, events);
    for _ in 0..data.int_in_range(0..=12)? {
        set_something(&mut instance, data)?;
    }
    let tolerance =
        if data.ratio(1, 2)? { Some(10f64.powi(data.int_in_range(-15..=0)?)) } else { None };
    let start = real(data)?;
    let stop = if data.ratio(1, 4)? { Some(start + real(data)?.abs()) } else { None };
    _ = instance.setup_experiment(tolerance, start, stop);
    _ = instance.enter_initialization_mode();
    if instance.exit_initialization_mode().is_err() {
        return Ok(());
    }
    to_steps(&mut instance);
    everything_is_a_number(&mut instance);
    let begun = Instant::now();
    for _ in 0..STEPS {
        if begun.elapsed() > SLOW {
            break;
        }
        for _ in 0..data.int_in_range(0..=2)? {
            set_something(&mut instance, data)?;
        }
        if data.ratio(1, 3)? {
            let input = V::reference(data.choose(M::table().scalars)?);
            _ = instance.set_input_derivatives(&[input], &[1], &[real(data)?]);
        }
        let h = real(data)?.min(LONGEST);
        let before = to_bytes(&instance);
        let mut again = survives_being_saved(&instance);
        let at = instance.time();
        let done = step(&mut instance, at, h);
        assert_eq!(step(&mut again, at, h), done, "the repeated step has another status");
        if let Ok(info) = &done {
            everything_is_a_number(&mut instance);
            match info.early {
                true => assert!(instance.time() >= at && instance.time() <= at + h),
                false => assert_eq!(instance.time(), at + h),
            }
        } else if instance.state() == InstanceState::Stepping {
            assert!(to_bytes(&instance) == before, "a refused step has changed something");
        } else {
            // The instance is still at the same time, and its variables can be read.
            everything_is_a_number(&mut instance);
            assert_eq!(instance.time(), at);
        }
        everything_is_a_number(&mut again);
        assert!(to_bytes(&again) == to_bytes(&instance), "the repeated step has another result");
    }
    Ok(())
}

/// Sets a parameter or an input of the FMU, usually to an allowed value.
///
/// # Panics
/// If a call that the FMU refuses has changed a value.
fn set_something<M: Model, V: Values>(
    instance: &mut Instance<M, V>,
    data: &mut Unstructured,
) -> Result<()> {
    let scalar = data.choose(M::table().scalars)?;
    if !matches!(scalar.variable.causality, Causality::Parameter | Causality::Input) {
        return Ok(());
    }
    let value = match scalar.variable.kind {
        Kind::Real(quantity) if scalar.variable.causality == Causality::Input => {
            Value::Real(within(everyday(quantity), data)?)
        }
        Kind::Real(quantity) => Value::Real(within(quantity, data)?),
        Kind::Integer { .. } => Value::Integer(data.int_in_range(-1..=11)?),
        Kind::Enumeration(of) => Value::Integer(data.int_in_range(0..=of.items.len() as i32 + 1)?),
        Kind::Boolean => Value::Boolean(data.arbitrary()?),
    };
    let before = to_bytes(instance);
    if set(instance, scalar, value).is_err() {
        assert!(to_bytes(instance) == before, "a refused value has changed something");
    }
    Ok(())
}

/// Limits the range of an input to magnitudes that occur in simulations. With a torque of 1e12 N·m, for example, every step
/// would use all allowed internal steps.
fn everyday(quantity: Quantity) -> Quantity {
    let near = |limit: Option<f64>| limit.filter(|limit| limit.abs() <= 1e6);
    Quantity { min: near(quantity.min), max: near(quantity.max), ..quantity }
}

fn within(quantity: Quantity, data: &mut Unstructured) -> Result<f64> {
    let (min, max) = (quantity.min.unwrap_or(-1e3), quantity.max.unwrap_or(1e3));
    let share = f64::from(data.int_in_range(0..=1000u16)?) / 1000.0;
    Ok(match data.int_in_range(0..=7)? {
        0 => min,
        1 => max,
        2 => min + share * (max - min),
        // The logarithm of the value is uniformly distributed.
        3 | 4 if min > 0.0 => min * (max / min).powf(share),
        5 | 6 => quantity.nominal.unwrap_or(1.0) * (2.0 * share - 1.0),
        _ => real(data)?,
    })
}

fn real(data: &mut Unstructured) -> Result<f64> {
    if data.ratio(1, 8)? {
        return Ok(f64::from_bits(data.arbitrary()?));
    }
    let mantissa = f64::from(data.int_in_range(-100..=1000i32)?);
    Ok(mantissa * 10f64.powi(data.int_in_range(-6..=0)?))
}

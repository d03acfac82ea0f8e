//! Saved states that somebody has changed and given a new checksum: reading them is refused or
//! gives an instance that lives as any other, and never panics.

use std::sync::OnceLock;

use HubSlosh::Instance;
use HubSlosh::from_bytes;
use HubSlosh::table::TABLE;
use runtime::hash::Hash;
use runtime::operation::{self as op, InstanceState, Interface};
use runtime::snapshot::to_bytes;
use runtime::variable::Value;

use crate::{everything_is_a_number, setter, survives_being_saved};

/// Bytes of the checksum, at the end.
const CHECKSUM: usize = 16;

/// The bytes are: which state to start from; then patches, each a place (two bytes), a length
/// (one byte) and that many bytes of new content. What is left over, or an odd first byte, is
/// taken as a saved state by itself.
pub fn run(data: &[u8]) {
    let Some((which, mut patches)) = data.split_first() else { return };
    if *which == u8::MAX {
        _ = from_bytes(patches);
        return;
    }
    let bases = bases();
    let mut bytes = bases[usize::from(*which) % bases.len()].clone();
    let body = bytes.len() - CHECKSUM;
    while let [low, high, length, rest @ ..] = patches {
        let (content, rest) = rest.split_at(rest.len().min(usize::from(length % 9)));
        let place = usize::from(u16::from_le_bytes([*low, *high])) % body;
        for (byte, new) in bytes[place..body].iter_mut().zip(content) {
            *byte = *new;
        }
        patches = rest;
    }
    let checksum = Hash::new().bytes(&bytes[..body]).value().to_le_bytes();
    bytes[body..].copy_from_slice(&checksum);
    let Ok(read) = from_bytes(&bytes) else { return };
    let read = survives_being_saved(&read);
    let mut instance = HubSlosh::instance(read.interface());
    instance.restore(&read).expect("a state that could be read can be restored");
    live(&mut instance);
}

/// What a host may do next. Calls may be refused; after a step that succeeded everything is a
/// number.
fn live(instance: &mut Instance) {
    let torque = TABLE.find("tau_cmd").expect("there is a tau_cmd");
    _ = instance.set(setter(Value::Real(0.1)), &[torque], |_| Value::Real(0.1));
    if instance.state() == InstanceState::Instantiated {
        _ = instance.enter_initialization_mode();
    }
    if instance.state() == InstanceState::Initialization {
        _ = instance.exit_initialization_mode();
    }
    for n in 0..TABLE.scalars.len() as u32 {
        _ = instance.get(&op::GET_REAL, n);
        _ = instance.output_derivatives(&[n], &[1], &mut [0.0]);
    }
    match instance.interface() {
        Interface::CoSimulation => {
            for h in [1e-3, 0.1] {
                if instance.do_step(instance.time(), h).is_ok() {
                    everything_is_a_number(instance);
                }
            }
        }
        Interface::ModelExchange => {
            let nx = TABLE.places().len();
            let (mut x, mut rates, mut indicators) =
                (vec![0.0; nx], vec![0.0; nx], vec![0.0; TABLE.about.event_indicators]);
            for _ in 0..3 {
                _ = instance.new_discrete_states();
                _ = instance.enter_continuous_time_mode();
                _ = instance.continuous_states(&mut x);
                _ = instance.derivatives(&mut rates);
                _ = instance.event_indicators(&mut indicators);
                for (x, rate) in x.iter_mut().zip(&rates) {
                    *x += 1e-3 * rate;
                }
                _ = instance.set_time(instance.time() + 1e-3);
                _ = instance.set_continuous_states(&x);
                _ = instance.completed_integrator_step();
                _ = instance.enter_event_mode();
            }
        }
    }
    survives_being_saved(instance);
}

/// Both interfaces, every model of the liquid, every instance state that can be reached without
/// an error.
fn bases() -> &'static [Vec<u8>] {
    static BASES: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    BASES.get_or_init(|| {
        let mut all = Vec::new();
        for interface in [Interface::CoSimulation, Interface::ModelExchange] {
            for model in 1..=5 {
                let mut instance = HubSlosh::instance(interface);
                let settings = [
                    ("slosh.model", Value::Integer(model)),
                    ("slosh.modes", Value::Integer(2)),
                    ("init.omega", Value::Real(0.3)),
                    ("init.slosh_angle", Value::Real(0.2)),
                    ("wheel.enabled", Value::Boolean(true)),
                    ("imu.enabled", Value::Boolean(true)),
                ];
                for (name, value) in settings {
                    let reference = TABLE.find(name).expect("the table has the variable");
                    instance.set(setter(value), &[reference], |_| value).expect("a good value");
                }
                all.push(to_bytes(&instance));
                instance.setup_experiment(Some(1e-6), 1.0, Some(9.0)).expect("a good experiment");
                instance.enter_initialization_mode().expect("allowed");
                all.push(to_bytes(&instance));
                instance.exit_initialization_mode().expect("good parameters");
                all.push(to_bytes(&instance));
                match interface {
                    Interface::CoSimulation => instance.do_step(1.0, 0.5).expect("a good step"),
                    Interface::ModelExchange => {
                        instance.enter_continuous_time_mode().expect("allowed");
                    }
                }
                all.push(to_bytes(&instance));
                instance.terminate().expect("allowed");
                all.push(to_bytes(&instance));
            }
        }
        all
    })
}

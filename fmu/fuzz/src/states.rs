//! Fuzzing of saved states that were modified and have a valid checksum. Deserialising them must either be refused or give
//! an instance that works as any other. It must never panic.

use std::collections::BTreeMap;
use std::sync::Mutex;

use runtime::Model;
use runtime::call::{Events, InstanceState, Interface};
use runtime::hash::Hash;
use runtime::instance::Instance;
use runtime::snapshot::{from_bytes, to_bytes};
use runtime::v2::Fmi2;
use runtime::v3::Fmi3;
use runtime::variable::Value::{self, Boolean, Integer, Real};
use runtime::version::Version;

use crate::{Values, everything_is_a_number, set, step, survives_being_saved, to_steps};

const CHECKSUM: usize = 16;

/// Restores a damaged saved state and continues the simulation. The first byte of `data` selects the FMI version and a valid
/// saved state. The other bytes are changes of this state: each has a position (two bytes), a length (one byte) and as many
/// bytes of new content. If the first byte is 255, the other bytes are the saved state itself.
pub fn run<M: Model>(data: &[u8]) {
    let Some((which, patches)) = data.split_first() else { return };
    if *which == u8::MAX {
        _ = from_bytes::<M, Fmi2>(patches);
        _ = from_bytes::<M, Fmi3>(patches);
        return;
    }
    match which % 2 {
        0 => damaged::<M, Fmi2>(usize::from(which / 2), patches),
        _ => damaged::<M, Fmi3>(usize::from(which / 2), patches),
    }
}

fn damaged<M: Model, V: Values>(which: usize, mut patches: &[u8]) {
    let bases = bases::<M, V>();
    let mut bytes = bases[which % bases.len()].clone();
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
    let Ok(read) = from_bytes::<M, V>(&bytes) else { return };
    let read = survives_being_saved(&read);
    // The saved state and the instance must handle events in the same way.
    let mut instance = lives::<V>()
        .filter(|(interface, _)| *interface == read.interface())
        .map(|(interface, events)| Instance::with_events(interface, events))
        .find_map(|mut instance| instance.restore(&read).is_ok().then_some(instance))
        .expect("a state that could be read can be restored");
    simulate(&mut instance);
}

fn lives<V: Version>() -> impl Iterator<Item = (Interface, Events)> {
    let interfaces = [Interface::CoSimulation, Interface::ModelExchange].into_iter();
    let all = interfaces.flat_map(|interface| {
        [Events::InStep, Events::ByHost, Events::Reported].map(|events| (interface, events))
    });
    all.filter(|(interface, events)| V::allows(*interface, *events))
}

/// Continues a simulation as a host could. The FMU may refuse calls, but after a step without error all values must be
/// finite.
fn simulate<M: Model, V: Values>(instance: &mut Instance<M, V>) {
    let table = M::table();
    for input in table.inputs() {
        _ = set(instance, input, Real(0.1));
    }
    if instance.state() == InstanceState::Instantiated {
        _ = instance.enter_initialization_mode();
    }
    if instance.state() == InstanceState::Initialization {
        _ = instance.exit_initialization_mode();
    }
    for n in 0..table.scalars.len() as u32 {
        _ = instance.get(V::GET[0], n);
        _ = instance.output_derivatives(&[n], &[1], &mut [0.0]);
    }
    match instance.interface() {
        Interface::CoSimulation => {
            to_steps(instance);
            for h in [1e-3, 0.1] {
                if step(instance, instance.time(), h).is_ok() {
                    everything_is_a_number(instance);
                }
            }
        }
        Interface::ModelExchange => {
            let nx = table.places().len();
            let (mut x, mut rates, mut indicators) =
                (vec![0.0; nx], vec![0.0; nx], vec![0.0; table.about.event_indicators]);
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

/// Returns saved states for Co-Simulation and Model Exchange, with each of the model's [`settings`], in every instance state
/// that can be reached without an error.
fn bases<M: Model, V: Values>() -> &'static [Vec<u8>] {
    static BASES: Mutex<BTreeMap<[&str; 2], &[Vec<u8>]>> = Mutex::new(BTreeMap::new());
    let mut bases = BASES.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    bases.entry([M::table().about.model, V::PREFIX]).or_insert_with(|| {
        let mut all = Vec::new();
        for (interface, events) in lives::<V>() {
            for settings in settings(M::table().about.model) {
                life_of::<M, V>(interface, events, &settings, &mut all);
            }
        }
        all.leak()
    })
}

fn life_of<M: Model, V: Values>(
    interface: Interface,
    events: Events,
    settings: &[(&str, Value)],
    all: &mut Vec<Vec<u8>>,
) {
    let mut instance = Instance::<M, V>::with_events(interface, events);
    for (name, value) in settings {
        let scalar = M::table().find(name).expect("the table has the variable");
        set(&mut instance, &M::table().scalars[scalar as usize], *value).expect("a good value");
    }
    all.push(to_bytes(&instance));
    instance.setup_experiment(Some(1e-6), 1.0, Some(9.0)).expect("a good experiment");
    instance.enter_initialization_mode().expect("allowed");
    all.push(to_bytes(&instance));
    instance.exit_initialization_mode().expect("good parameters");
    all.push(to_bytes(&instance));
    match interface {
        Interface::CoSimulation => {
            to_steps(&mut instance);
            instance.step_to_event(1.0, 0.5, true).expect("a good step");
            if events == Events::Reported {
                // States are saved before event mode, with pending events, and in event mode.
                all.push(to_bytes(&instance));
                instance.enter_event_mode().expect("allowed");
            }
        }
        Interface::ModelExchange => {
            instance.enter_continuous_time_mode().expect("allowed");
        }
    }
    all.push(to_bytes(&instance));
    instance.terminate().expect("allowed");
    all.push(to_bytes(&instance));
}

/// Returns the sets of parameters with which the FMU runs before its saved states are changed. Together they use every part
/// of the model, in motion.
///
/// # Panics
/// If there are no settings for the model.
pub(crate) fn settings(model: &str) -> Vec<Vec<(&'static str, Value)>> {
    match model {
        // Each slosh model occurs with one friction law; the linear model also with a baffle.
        "HubSlosh" => [(1, 2), (2, 3), (3, 4), (4, 5), (5, 3), (2, 5)]
            .map(|(liquid, friction)| {
                vec![
                    ("slosh.model", Integer(liquid)),
                    ("friction.model", Integer(friction)),
                    ("friction.asymmetry", Real(0.1)),
                    ("bench.tilt", Real(0.01)),
                    ("hub.imbalance", Real(0.02)),
                    ("baffle.width", Real(if liquid == 2 { 0.01 } else { 0.0 })),
                    ("slosh.modes", Integer(2)),
                    ("init.omega", Real(0.3)),
                    ("init.slosh_angle", Real(0.2)),
                    ("wheel.enabled", Boolean(true)),
                    ("imu.enabled", Boolean(true)),
                ]
            })
            .into(),
        // The craft is free, or on a pivot (2).
        "Spacecraft" => [(1, 0), (1, 1), (1, 4), (2, 2)]
            .map(|(mount, tanks)| {
                vec![
                    ("mount", Integer(mount)),
                    ("gravity[3]", Real(-9.81)),
                    ("tanks", Integer(tanks)),
                    ("tank[1].modes", Integer(3)),
                    ("tank[1].p_0[1,1]", Real(0.3)),
                    ("tank[2].k[1]", Real(20.0)),
                    ("tank[2].position[1]", Real(0.8)),
                    ("tank[4].modes", Integer(0)),
                    ("init.omega[1]", Real(0.02)),
                    ("init.omega[2]", Real(0.2)),
                    ("init.omega[3]", Real(0.1)),
                    ("h_wheels[1]", Real(3.0)),
                    ("tank[1].fill.points", Integer(if tanks == 1 { 8 } else { 0 })),
                    ("mass_flow[1]", Real(0.5)),
                ]
            })
            .into(),
        // The couplings are split, lumped (2) and rigid_body (3). Two of the tanks drain, and in one tank the liquid
        // detaches from the bottom.
        "SloshTank" => {
            [(1, 0, 0), (1, 1, 0), (1, 3, 0), (2, 2, 0), (3, 1, 8), (1, 2, 8), (1, 2, 0)]
                .into_iter()
                .enumerate()
                .map(|(i, (coupling, modes, points))| {
                    let leaves = i == 6;
                    vec![
                        ("coupling", Integer(coupling)),
                        ("tank.modes", Integer(modes)),
                        ("tank.k[1]", Real(20.0)),
                        ("tank.p_0[1,1]", Real(0.3)),
                        ("host.mass", Real(1000.0)),
                        ("a[1]", Real(0.1)),
                        ("a[3]", Real(if leaves { -2.0 } else { 2.0 })),
                        ("omega_dot[1]", Real(0.1)),
                        ("tank.fill.points", Integer(points)),
                        ("tank.ball.travel", Real(if leaves { 0.6 } else { 0.0 })),
                        ("mass_flow", Real(0.5)),
                    ]
                })
                .collect()
        }
        _ => panic!("settings() has no parameters for {model}"),
    }
}

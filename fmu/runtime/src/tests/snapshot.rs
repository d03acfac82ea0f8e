//! Tests of saved states: all data are restored, and damaged states are refused.

use super::*;
use crate::call::InstanceState;
use crate::clock::Clock;
use crate::hash::Hash;
use crate::snapshot::{from_bytes, size};

const CHECKSUM: usize = 16;
const SHOWN_COUNT: usize = 3;
const FLAGS: usize = 55;
const TIMES: usize = 58;
const PARAMETERS: usize = TIMES + 5 * 8;
const INPUTS: usize = PARAMETERS + 8 * 8;
const SHOWN: usize = INPUTS + 4 * 16;
const WORDS: usize = SHOWN + SHOWN_COUNT * 4;

fn read(bytes: &[u8]) -> Result<Subject, String> {
    from_bytes(bytes)
}

fn eventful() -> Subject {
    let mut instance = fresh(CS);
    instance.setup_experiment(Some(1e-4), 1.0, Some(9.0)).unwrap();
    set(&mut instance, "leak", 0.25).unwrap();
    set_boolean(&mut instance, "has_lid", false).unwrap();
    set_integer(&mut instance, "number", -2).unwrap();
    set_integer(&mut instance, "material", 2).unwrap();
    set(&mut instance, "z", 2.5).unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    set(&mut instance, "z", 1.5).unwrap();
    instance.do_step(1.0, 0.5).unwrap();
    instance.set_input_derivatives(&references(["q[2]"]), &[1], &[0.125]).unwrap();
    instance
}

#[test]
fn a_saved_state_is_equal_after_conversion_to_bytes_and_back() {
    let failed = {
        let mut instance = started(CS, &[("z", 101.0)]);
        refused(instance.do_step(0.0, 1.0));
        instance
    };
    let initialization = {
        let mut instance = fresh(ME);
        instance.enter_initialization_mode().unwrap();
        instance
    };
    let terminated = {
        let mut instance = continuous(&[]);
        instance.terminate().unwrap();
        instance
    };
    let event = {
        let mut instance = continuous(&[]);
        instance.enter_event_mode().unwrap();
        instance
    };
    let all = [
        fresh(CS),
        fresh(ME),
        initialization,
        eventful(),
        started(ME, &[]),
        continuous(&[("q[1]", 3.0)]),
        event,
        terminated,
        failed,
    ];
    for instance in all {
        let bytes = to_bytes(&instance);
        assert_eq!(bytes.len(), size::<Vessels>());
        let mut again = read(&bytes).unwrap();
        assert_eq!(to_bytes(&again), bytes);
        assert_eq!((again.state, again.interface), (instance.state, instance.interface));
        let clock = instance.clock;
        let last_event = clock.last_event.max(f64::MIN);
        assert_eq!(again.clock, Clock { last_event, ..clock });
        assert_eq!(again.tolerance, instance.tolerance);
        assert_eq!((again.sloped, again.past_slopes), (instance.sloped, instance.past_slopes));
        assert_eq!(again.parameters, instance.parameters);
        assert_eq!(again.model.is_some(), instance.model.is_some());
        let mut instance = instance;
        for scalar in TABLE.scalars {
            let name = scalar.name();
            let values = (get(&mut again, &name), get(&mut instance, &name));
            assert_eq!(values.0.ok(), values.1.ok(), "{name}");
        }
    }
    assert_eq!(size::<Vessels>(), WORDS + 6 * 8 + CHECKSUM);
}

#[test]
fn an_instance_restored_from_bytes_continues_bit_identically() {
    let mut instance = eventful();
    let mut again = fresh(CS);
    again.restore(&read(&to_bytes(&instance)).unwrap()).unwrap();
    for one in [&mut instance, &mut again] {
        one.do_step(1.5, 0.5).unwrap();
    }
    assert_eq!(to_bytes(&again), to_bytes(&instance));
    assert!(refused(again.do_step(2.0, 8.0)).contains("stop time 9.0 s"));
}

/// The inputs have changed linearly in the last step. The outputs use these slopes until an input is set, also after the
/// state was saved and restored.
#[test]
fn input_slopes_of_the_last_step_are_part_of_a_saved_state() {
    let mut instance = eventful();
    instance.do_step(1.5, 0.5).unwrap();
    assert!(instance.past_slopes && !instance.sloped);
    let mut again = read(&to_bytes(&instance)).unwrap();
    assert_eq!(real(&mut again, "trend"), 0.125);
    set(&mut again, "z", 0.0).unwrap();
    assert_eq!(real(&mut again, "trend"), 0.0);
    // Slopes for the next step are kept if an input is set.
    let mut sloped = read(&to_bytes(&eventful())).unwrap();
    set(&mut sloped, "z", 0.0).unwrap();
    assert_eq!(real(&mut sloped, "trend"), 0.125);
}

#[test]
fn a_saved_state_of_the_other_interface_is_refused() {
    let mut instance = started(CS, &[]);
    let other = started(ME, &[]);
    assert_eq!(
        unchanged(&mut instance, |i| i.restore(&other)),
        "fmi2SetFMUstate: the saved state belongs to an instance for Model Exchange, but this \
         instance is for Co-Simulation"
    );
    let mut moved = instance.clone();
    moved.do_step(0.0, 1.0).unwrap();
    moved.restore(&instance).unwrap();
    assert_eq!(to_bytes(&moved), to_bytes(&instance));
}

fn patched(bytes: &[u8], place: usize, new: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bytes[place..place + new.len()].copy_from_slice(new);
    let body = bytes.len() - CHECKSUM;
    let checksum = Hash::new().bytes(&bytes[..body]).value();
    bytes[body..].copy_from_slice(&checksum.to_le_bytes());
    bytes
}

#[test]
fn bytes_that_are_no_saved_state_are_refused_with_a_reason() {
    let bytes = to_bytes(&eventful());
    let why = |bytes: &[u8]| read(bytes).map(|_| ()).unwrap_err();
    assert_eq!(why(&[]), "the saved state is cut off");
    assert_eq!(why(b"FMUstatX"), "these bytes are not a saved state of Vessels");
    assert_eq!(
        why(&patched(&bytes, 8, &[9])),
        "the saved state has format 9, but this FMU reads only format 4"
    );
    let length = bytes.len();
    let cut = &bytes[..length - 1];
    assert_eq!(
        why(cut),
        format!("the saved state should have {length} bytes but has {}", length - 1)
    );
    let other = "{00000000-0000-0000-0000-000000000000}";
    assert_eq!(
        why(&patched(&bytes, 16, other.as_bytes())),
        format!(
            "the saved state belongs to another FMU, or another version of Vessels, with the GUID {other}"
        )
    );
    let mut long = bytes.clone();
    long.extend([0; 8]);
    let says = (length + 8) as u32;
    assert_eq!(
        why(&patched(&long, 12, &says.to_le_bytes())),
        format!("saved states of this FMU have {length} bytes, but this one has {}", length + 8)
    );
    for place in 54..length {
        let mut damaged = bytes.clone();
        damaged[place] ^= 1;
        assert_eq!(why(&damaged), "the saved state is damaged: its checksum is wrong");
    }
}

/// Single fields of a saved state get invalid values, and the checksum is adjusted to them.
#[test]
fn damaged_saved_states_with_a_valid_checksum_are_refused_with_a_reason() {
    let bytes = to_bytes(&eventful());
    let why = |place: usize, new: &[u8]| {
        let message = read(&patched(&bytes, place, new)).map(|_| ()).unwrap_err();
        message.strip_prefix("the saved state is damaged: ").unwrap_or(&message).to_string()
    };
    let number = |x: f64| x.to_le_bytes();
    assert_eq!(why(FLAGS + 1, &[2]), "it names an interface that does not exist");
    for state in [InstanceState::Event, InstanceState::Continuous, InstanceState::Fatal] {
        assert_eq!(why(FLAGS - 1, &[state as u8]), "no such instance state");
    }
    assert_eq!(why(FLAGS - 1, &[99]), "no such instance state");
    assert_eq!(why(TIMES, &number(f64::NAN)), "start time");
    assert_eq!(why(TIMES + 8, &number(f64::INFINITY)), "stop time");
    assert_eq!(why(TIMES + 16, &number(f64::NAN)), "tolerance");
    assert_eq!(why(TIMES + 16, &number(0.2)), "its tolerance is out of range");
    assert_eq!(why(TIMES + 24, &number(f64::NAN)), "time");
    let parameter = |name: &str| PARAMETERS + 8 * TABLE.scalars[reference(name) as usize].slot;
    assert_eq!(why(parameter("has_lid"), &[2]), "has_lid");
    assert_eq!(why(parameter("number"), &i64::MAX.to_le_bytes()), "number");
    assert_eq!(
        why(parameter("leak"), &number(-1.0)),
        "leak = -1.0 1/s (allowed: at least 0.0 1/s, finite)"
    );
    assert_eq!(why(INPUTS, &number(f64::NAN)), "q");
    assert_eq!(why(INPUTS, &number(11.0)), "q[1] = 11.0 m/s (allowed: 1.0 m/s to 10.0 m/s)");
    assert_eq!(why(INPUTS + 8, &number(1e12)), "derivative of q[1] = 1000000000000.0");
    assert_eq!(why(WORDS + 4 * 8, &[2]), "the model's state");
    assert_eq!(why(FLAGS, &[0]), "the model is missing");
    // Before the simulation starts, a parameter out of its range and a missing model are allowed.
    let mut fresh = fresh(CS);
    set(&mut fresh, "leak", -1.0).unwrap();
    let mut again = read(&to_bytes(&fresh)).unwrap();
    assert_eq!(real(&mut again, "leak"), -1.0);
}

#[test]
fn an_instance_before_initialization_saves_zeros_for_its_model() {
    let bytes = to_bytes(&fresh(CS));
    assert!(bytes[WORDS..bytes.len() - CHECKSUM].iter().all(|byte| *byte == 0));
    assert_eq!(bytes[FLAGS], 0);
    assert_eq!(to_bytes(&eventful())[FLAGS], 1 | 2 | 4);
}

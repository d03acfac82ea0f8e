//! A second importer, independent of ours: the crate `fmi` opens the packed FMU and gets the same
//! bits from it. Its bindings are made by bindgen from the official headers, so this needs
//! libclang; `.ci/importers` gets it and runs this test.

use HubSlosh::table::TABLE;
use fmi::EventFlags;
use fmi::fmi2::import::Fmi2Import;
use fmi::fmi2::instance::{CoSimulation, Common, ModelExchange};
use fmi::traits::FmiImport;
use host::fmi2::{Fmu, Instance, MODEL_EXCHANGE};
use pack::packed_for_tests;
use runtime::variable::Causality;

const STATES: usize = plant::STATES;
const INDICATORS: usize = plant::INDICATORS;

/// Everything moves.
const START: [(&str, f64); 3] =
    [("init.omega", 0.2), ("init.slosh_angle", 0.2), ("init.slosh_angle_radial", 0.1)];
/// slosh.model
const SPHERICAL: i32 = 4;

fn references(fmu: &Fmu, names: &[&str]) -> Vec<u32> {
    names.iter().map(|name| fmu.description().variable(name).unwrap().reference).collect()
}

/// The same start in the other importer's hands.
fn start(instance: &mut impl Common, fmu: &Fmu) {
    let names = START.map(|(name, _)| name);
    instance.set_real(&references(fmu, &names), &START.map(|(_, value)| value)).unwrap();
    instance.set_integer(&references(fmu, &["slosh.model"]), &[SPHERICAL]).unwrap();
    instance.setup_experiment(Some(1e-9), 0.0, Some(100.0)).unwrap();
    // The crate has two of each, this one for FMI 2.0.
    Common::enter_initialization_mode(instance).unwrap();
    Common::exit_initialization_mode(instance).unwrap();
}

/// And in ours.
fn started<'fmu>(fmu: &'fmu Fmu, kind: i32) -> Instance<'fmu> {
    let mut with = fmu.instantiation("ours");
    with.kind = kind;
    let mut instance = fmu.instantiate_with(&with).unwrap();
    let names = START.map(|(name, _)| name);
    instance.set_real(&references(fmu, &names), &START.map(|(_, value)| value)).unwrap();
    instance.set_integer(&references(fmu, &["slosh.model"]), &[SPHERICAL]).unwrap();
    instance.setup_experiment(Some(1e-9), 0.0, Some(100.0)).unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    instance
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|x| x.to_bits()).collect()
}

#[test]
fn co_simulation_gives_the_crate_fmi_the_bits_that_it_gives_us() {
    let import: Fmi2Import = fmi::import::from_path(packed_for_tests()).unwrap();
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    assert_eq!(import.model_description().guid, fmu.description().guid);
    let mut theirs = import.instantiate_cs("theirs", false, true).unwrap();
    assert_eq!(theirs.get_types_platform(), "default");
    start(&mut theirs, &fmu);
    let mut ours = started(&fmu, host::fmi2::CO_SIMULATION);
    let outputs = TABLE.scalars.iter().filter(|s| s.variable.causality == Causality::Output);
    let names: Vec<String> = outputs.map(|s| s.name()).collect();
    let outputs = references(&fmu, &names.iter().map(String::as_str).collect::<Vec<_>>());
    let torque = references(&fmu, &["tau_cmd"]);
    let (mut saved, mut after) = (Vec::new(), Vec::new());
    let tau_at = |time: f64| 0.05 * f64::sin(15.0 * time);
    for n in 0..1000 {
        let at = f64::from(n) * 0.02;
        let tau = tau_at(at);
        theirs.set_real(&torque, &[tau]).unwrap();
        theirs.do_step(at, 0.02, true).unwrap();
        ours.set_real(&torque, &[tau]).unwrap();
        ours.do_step(at, 0.02).unwrap();
        let (mut a, mut b) = (vec![0.0; outputs.len()], vec![0.0; outputs.len()]);
        theirs.get_real(&outputs, &mut a).unwrap();
        ours.get_real(&outputs, &mut b).unwrap();
        assert_eq!(bits(&a), bits(&b), "step {n}");
        if n == 499 {
            let state = theirs.get_fmu_state().unwrap();
            saved = theirs.serialize_fmu_state(&state).unwrap();
        }
        if n == 500 {
            after = bits(&a);
        }
    }
    assert_eq!(theirs.last_successful_time().unwrap(), 999.0 * 0.02 + 0.02);
    assert!(!theirs.terminated().unwrap());

    // Their bytes go on in an instance of ours.
    let mut other = fmu.instantiate("other").unwrap();
    let state = other.deserialize(&saved).unwrap();
    other.set_state(&state).unwrap();
    other.free_state(state).unwrap();
    other.set_real(&torque, &[tau_at(10.0)]).unwrap();
    other.do_step(10.0, 0.02).unwrap();
    let mut again = vec![0.0; outputs.len()];
    other.get_real(&outputs, &mut again).unwrap();
    assert_eq!(bits(&again), after);
    theirs.terminate().unwrap();
}

#[test]
fn model_exchange_gives_the_crate_fmi_the_bits_that_it_gives_us() {
    let import: Fmi2Import = fmi::import::from_path(packed_for_tests()).unwrap();
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let mut theirs = import.instantiate_me("theirs", false, true).unwrap();
    start(&mut theirs, &fmu);
    let mut ours = started(&fmu, MODEL_EXCHANGE);
    let mut flags = EventFlags::default();
    theirs.new_discrete_states(&mut flags).unwrap();
    ours.new_discrete_states().unwrap();
    assert!(!flags.discrete_states_need_update && !flags.terminate_simulation);
    assert_eq!(flags.next_event_time, None, "no gyro, no time event");
    theirs.enter_continuous_time_mode().unwrap();
    ours.enter_continuous_time_mode().unwrap();

    // Euler, the same in both.
    let (mut x, mut y) = ([0.0; STATES], [0.0; STATES]);
    let (mut dx, mut dy) = ([0.0; STATES], [0.0; STATES]);
    let (mut z, mut w) = ([0.0; INDICATORS], [0.0; INDICATORS]);
    for n in 1..=1000 {
        let time = f64::from(n) * 1e-3;
        theirs.get_continuous_states(&mut x).unwrap();
        ours.continuous_states(&mut y).unwrap();
        theirs.get_derivatives(&mut dx).unwrap();
        ours.derivatives(&mut dy).unwrap();
        theirs.get_event_indicators(&mut z).unwrap();
        ours.event_indicators(&mut w).unwrap();
        assert_eq!((bits(&x), bits(&dx), bits(&z)), (bits(&y), bits(&dy), bits(&w)), "step {n}");
        for (x, dx) in x.iter_mut().zip(dx) {
            *x += 1e-3 * dx;
        }
        theirs.set_time(time).unwrap();
        ours.set_time(time).unwrap();
        theirs.set_continuous_states(&x).unwrap();
        ours.set_continuous_states(&x).unwrap();
        let (mut event, mut end) = (false, false);
        theirs.completed_integrator_step(true, &mut event, &mut end).unwrap();
        assert_eq!(ours.completed_integrator_step().unwrap().0, event, "step {n}");
        assert!(!end);
        if event {
            theirs.enter_event_mode().unwrap();
            theirs.new_discrete_states(&mut flags).unwrap();
            theirs.enter_continuous_time_mode().unwrap();
            ours.enter_event_mode().unwrap();
            ours.new_discrete_states().unwrap();
            ours.enter_continuous_time_mode().unwrap();
        }
    }
    // As many unknowns as knowns: the crate takes nothing else.
    let (unknowns, knowns) = (references(&fmu, &["omega_dot"]), references(&fmu, &["tau_cmd"]));
    let mut answer = [0.0];
    theirs.get_directional_derivative(&unknowns, &knowns, &[1.0], &mut answer).unwrap();
    let expected = ours.get_directional_derivative(&unknowns, &knowns, &[1.0]).unwrap();
    assert_eq!(bits(&answer), bits(&expected));
    let mut nominals = [0.0; STATES];
    theirs.get_nominals_of_continuous_states(&mut nominals).unwrap();
    assert!(nominals.iter().all(|x| *x > 0.0));
    theirs.terminate().unwrap();
}

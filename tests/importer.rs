//! A second importer, independent of ours: the crate `fmi` opens the packed FMU and gets bit-identical results.
//! bindgen makes its bindings from the official headers, so that this test needs libclang; `.ci/importers` installs it
//! and runs this test.

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

const START: [(&str, f64); 3] =
    [("init.omega", 0.2), ("init.slosh_angle", 0.2), ("init.slosh_angle_radial", 0.1)];
const SPHERICAL: i32 = 4;

fn references(fmu: &Fmu, names: &[&str]) -> Vec<u32> {
    names.iter().map(|name| fmu.description().variable(name).unwrap().reference).collect()
}

fn start(instance: &mut impl Common, fmu: &Fmu) {
    let names = START.map(|(name, _)| name);
    instance.set_real(&references(fmu, &names), &START.map(|(_, value)| value)).unwrap();
    instance.set_integer(&references(fmu, &["slosh.model"]), &[SPHERICAL]).unwrap();
    instance.setup_experiment(Some(1e-9), 0.0, Some(100.0)).unwrap();
    // The crate has two functions of this name; this one is for FMI 2.0.
    Common::enter_initialization_mode(instance).unwrap();
    Common::exit_initialization_mode(instance).unwrap();
}

fn start_instance<'fmu>(fmu: &'fmu Fmu, kind: i32) -> Instance<'fmu> {
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

/// The crate `fmi` is an importer that is independent of this project. It runs HubSlosh with the inputs that the harness
/// uses.
#[test]
fn the_importer_crate_fmi_gets_bit_identical_outputs_in_co_simulation() {
    let import: Fmi2Import = fmi::import::from_path(packed_for_tests()).unwrap();
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    assert_eq!(import.model_description().guid, fmu.description().guid);
    let mut theirs = import.instantiate_cs("theirs", false, true).unwrap();
    assert_eq!(theirs.get_types_platform(), "default");
    start(&mut theirs, &fmu);
    let mut ours = start_instance(&fmu, host::fmi2::CO_SIMULATION);
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

    // The bytes of the crate restore the state in an instance of our host.
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
fn the_importer_crate_fmi_gets_bit_identical_derivatives_in_model_exchange() {
    let import: Fmi2Import = fmi::import::from_path(packed_for_tests()).unwrap();
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let mut theirs = import.instantiate_me("theirs", false, true).unwrap();
    start(&mut theirs, &fmu);
    let mut ours = start_instance(&fmu, MODEL_EXCHANGE);
    let mut flags = EventFlags::default();
    theirs.new_discrete_states(&mut flags).unwrap();
    ours.new_discrete_states().unwrap();
    assert!(!flags.discrete_states_need_update && !flags.terminate_simulation);
    assert_eq!(flags.next_event_time, None, "no gyro, no time event");
    theirs.enter_continuous_time_mode().unwrap();
    ours.enter_continuous_time_mode().unwrap();

    // Both hosts integrate by Euler's method.
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
        assert_eq!(ours.completed_integrator_step().unwrap().enter_event_mode, event, "step {n}");
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
    // The crate requires as many unknowns as knowns, so that one of each is used.
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

/// The crate `fmi` runs FMI 3.0, and our host runs FMI 2.0 for comparison.
mod fmi3 {
    use std::io::{Read, Write};

    use fmi::EventFlags;
    use fmi::fmi3::import::Fmi3Import;
    use fmi::fmi3::{CoSimulation, Common, Fmi3Model, GetSet, ModelExchange};
    use host::causality::Causality;
    use host::description::{ModelDescription, Type};
    use host::fmi2::MODEL_EXCHANGE;
    use pack::{Fmi, HUBSLOSH, MODELS, Model, packed_model_for_tests, packed_version_for_tests};
    use plant::{INDICATORS, STATES};

    use super::{SPHERICAL, bits, start_instance};

    /// Imports the FMU 3.0 with the crate `fmi`. The crate gets a copy of the description without units and nominal values of
    /// variables, because version 0.8 of its schema does not know these attributes, although the standard defines them
    /// (2.4.7.5).
    fn import(model: &Model) -> (Fmi3Import, ModelDescription) {
        let packed = packed_version_for_tests(model, Fmi::V3);
        let copy = tempfile::NamedTempFile::new().unwrap();
        let mut from = zip::ZipArchive::new(std::fs::File::open(packed).unwrap()).unwrap();
        let mut to = zip::ZipWriter::new(copy.reopen().unwrap());
        for index in 0..from.len() {
            let mut file = from.by_index(index).unwrap();
            let name = file.name().unwrap().into_owned();
            if name != "modelDescription.xml" {
                to.raw_copy_file(file).unwrap();
                continue;
            }
            let mut text = String::new();
            file.read_to_string(&mut text).unwrap();
            to.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
            for line in text.lines() {
                let is_real = line.trim_start().starts_with("<Float64 ");
                let known = |part: &&str| {
                    let attributes = ["unit=", "displayUnit=", "nominal="];
                    !is_real || !attributes.iter().any(|name| part.starts_with(name))
                };
                // Splitting at spaces is safe, because no text of the description contains one of these names and a quote.
                let parts: Vec<&str> = line.split(' ').filter(known).collect();
                writeln!(to, "{}", parts.join(" ")).unwrap();
            }
        }
        to.finish().unwrap();
        let import = fmi::import::from_path(copy.path()).unwrap();
        (import, ModelDescription::from_fmu(packed).unwrap())
    }

    fn references(description: &ModelDescription, names: &[&str]) -> Vec<u32> {
        names.iter().map(|name| description.variable(name).unwrap().reference).collect()
    }

    /// Enters and leaves event mode at a time at which no event is due.
    fn pass_event_mode(instance: &mut impl Common) {
        let mut flags = EventFlags::default();
        instance.update_discrete_states(&mut flags).unwrap();
        assert!(!flags.discrete_states_need_update && !flags.terminate_simulation);
    }

    fn input(model: &Model) -> (&'static str, f64) {
        match model.name {
            "HubSlosh" => ("tau_cmd", 0.05),
            "Spacecraft" => ("force[1]", 20.0),
            _ => ("a[1]", 0.1),
        }
    }

    /// The crate `fmi` runs the FMUs 3.0 in Co-Simulation; the harness runs the FMUs 2.0.
    #[test]
    fn the_importer_crate_fmi_gets_bit_identical_outputs_from_both_versions_with_and_without_event_mode()
     {
        for model in &MODELS {
            let (import, description) = import(model);
            let two = host::fmu::Fmu::open(packed_model_for_tests(model)).unwrap();
            let outputs = description.variables.iter();
            let outputs =
                outputs.filter(|v| v.causality == Causality::Output && v.kind() == Type::Real);
            let names: Vec<&str> = outputs.map(|v| v.name.as_str()).collect();
            let outputs = references(&description, &names);
            let ours_outputs = references(two.description(), &names);
            let (name, amplitude) = input(model);
            for (event_mode, early_return) in
                [(false, false), (false, true), (true, false), (true, true)]
            {
                let mut ours = two.instantiate("ours").unwrap();
                let mut theirs = import
                    .instantiate_cs("theirs", false, true, event_mode, early_return, &[])
                    .unwrap();
                if model.name == "HubSlosh" {
                    ours.set("slosh.model", &SPHERICAL.to_string()).unwrap();
                    ours.set("imu.enabled", "true").unwrap();
                    ours.set("imu.rate", "7").unwrap();
                    let reference = |name| references(&description, &[name]);
                    theirs.set_int64(&reference("slosh.model"), &[SPHERICAL.into()]).unwrap();
                    theirs.set_boolean(&reference("imu.enabled"), &[true]).unwrap();
                    theirs.set_float64(&reference("imu.rate"), &[7.0]).unwrap();
                }
                ours.enter_initialization_mode(None, 0.0, None).unwrap();
                ours.exit_initialization_mode().unwrap();
                Common::enter_initialization_mode(&mut theirs, None, 0.0, None).unwrap();
                Common::exit_initialization_mode(&mut theirs).unwrap();
                if event_mode {
                    pass_event_mode(&mut theirs);
                    theirs.enter_step_mode().unwrap();
                }
                let mut returns = 0;
                for n in 0..200 {
                    let (at, h) = (f64::from(n) * 0.02, 0.02);
                    let value = amplitude * f64::sin(0.3 * f64::from(n));
                    ours.set_real(&references(two.description(), &[name]), &[value]).unwrap();
                    ours.do_step(at, h).unwrap();
                    theirs.set_float64(&references(&description, &[name]), &[value]).unwrap();
                    let (mut from, end) = (at, at + h);
                    loop {
                        let (mut event, mut over, mut early) = (true, true, true);
                        let mut last = f64::NAN;
                        let length = if from == at { h } else { end - from };
                        theirs
                            .do_step(
                                from, length, true, &mut event, &mut over, &mut early, &mut last,
                            )
                            .unwrap();
                        assert!(!over && (event_mode || !event) && (early_return || !early));
                        if event {
                            theirs.enter_event_mode().unwrap();
                            pass_event_mode(&mut theirs);
                            theirs.enter_step_mode().unwrap();
                        }
                        if !early {
                            assert_eq!(last, end);
                            break;
                        }
                        returns += 1;
                        from = last;
                    }
                    let (mut a, mut b) = (vec![0.0; outputs.len()], vec![0.0; outputs.len()]);
                    theirs.get_float64(&outputs, &mut a).unwrap();
                    ours.get_real(&ours_outputs, &mut b).unwrap();
                    assert_eq!(bits(&a), bits(&b), "{}, step {n}", model.name);
                }
                assert_eq!(
                    returns > 20,
                    model.name == "HubSlosh" && event_mode && early_return,
                    "{} early returns",
                    returns
                );
                Common::terminate(&mut theirs).unwrap();
            }
        }
    }

    #[test]
    fn the_importer_crate_fmi_gets_bit_identical_derivatives_from_fmi_3_and_fmi_2() {
        let (import, description) = import(HUBSLOSH);
        let two = host::fmi2::Fmu::open(packed_model_for_tests(HUBSLOSH)).unwrap();
        let mut ours = start_instance(&two, MODEL_EXCHANGE);
        let mut theirs = import.instantiate_me("theirs", false, true).unwrap();
        let names = super::START.map(|(name, _)| name);
        let values = super::START.map(|(_, value)| value);
        theirs.set_float64(&references(&description, &names), &values).unwrap();
        let model = references(&description, &["slosh.model"]);
        theirs.set_int64(&model, &[SPHERICAL.into()]).unwrap();
        Common::enter_initialization_mode(&mut theirs, Some(1e-9), 0.0, Some(100.0)).unwrap();
        Common::exit_initialization_mode(&mut theirs).unwrap();
        pass_event_mode(&mut theirs);
        ours.new_discrete_states().unwrap();
        ModelExchange::enter_continuous_time_mode(&mut theirs).unwrap();
        ours.enter_continuous_time_mode().unwrap();
        assert_eq!(ModelExchange::get_number_of_continuous_states(&mut theirs).unwrap(), STATES);
        assert_eq!(ModelExchange::get_number_of_event_indicators(&mut theirs).unwrap(), INDICATORS);
        let (mut x, mut y) = ([0.0; STATES], [0.0; STATES]);
        let (mut dx, mut dy) = ([0.0; STATES], [0.0; STATES]);
        let (mut z, mut w) = ([0.0; INDICATORS], [0.0; INDICATORS]);
        for n in 1..=1000 {
            let time = f64::from(n) * 1e-3;
            ModelExchange::get_continuous_states(&mut theirs, &mut x).unwrap();
            ours.continuous_states(&mut y).unwrap();
            ModelExchange::get_continuous_state_derivatives(&mut theirs, &mut dx).unwrap();
            ours.derivatives(&mut dy).unwrap();
            ModelExchange::get_event_indicators(&mut theirs, &mut z).unwrap();
            ours.event_indicators(&mut w).unwrap();
            assert_eq!(
                (bits(&x), bits(&dx), bits(&z)),
                (bits(&y), bits(&dy), bits(&w)),
                "step {n}"
            );
            for (x, dx) in x.iter_mut().zip(dx) {
                *x += 1e-3 * dx;
            }
            ModelExchange::set_time(&mut theirs, time).unwrap();
            ours.set_time(time).unwrap();
            ModelExchange::set_continuous_states(&mut theirs, &x).unwrap();
            ours.set_continuous_states(&x).unwrap();
            let (mut event, mut end) = (false, false);
            ModelExchange::completed_integrator_step(&mut theirs, true, &mut event, &mut end)
                .unwrap();
            assert_eq!(
                ours.completed_integrator_step().unwrap().enter_event_mode,
                event,
                "step {n}"
            );
            assert!(!end);
            if event {
                Common::enter_event_mode(&mut theirs).unwrap();
                pass_event_mode(&mut theirs);
                ModelExchange::enter_continuous_time_mode(&mut theirs).unwrap();
                ours.enter_event_mode().unwrap();
                ours.new_discrete_states().unwrap();
                ours.enter_continuous_time_mode().unwrap();
            }
        }
        Common::terminate(&mut theirs).unwrap();
    }
}

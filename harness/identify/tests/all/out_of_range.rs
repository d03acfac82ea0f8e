//! Times and values that are NaN, infinite, very large or very small: every method returns a result or an error,
//! without panicking or hanging.

use experiments::profile::Torque;
use host::fmu::Fmu;
use identify::any_fmu::identify;
use identify::bench::options::Options;
use identify::input::question::{Question, Solver};
use identify::input::recording::Recording;
use identify::methods::{free_decay, friction, output_error};
use identify::model::simulate::Model;
use pack::packed_for_tests;

use crate::fmu_twin::{self, SensorErrors};
use crate::solver_noise::{Adaptive, question, record};

fn errors(fmu: &Fmu, recording: &Recording) -> Vec<(&'static str, Option<String>)> {
    let recordings = std::slice::from_ref(recording);
    let said = |error: Option<anyhow::Error>| error.map(|error| format!("{error:#}"));
    vec![
        (
            "friction",
            said(friction::identify(fmu, recordings, &Options::default(), &mut |_| {}).err()),
        ),
        ("free decay", said(free_decay::identify("omega", 1e-4, recordings, &mut |_| {}).err())),
    ]
}

/// Every method refuses recordings with NaN, infinite or very large times and values, and its error names the
/// row and the reason.
#[test]
fn no_method_hangs_or_panics_on_values_out_of_range() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let torque = Torque::Profile("lin-sweep:amplitude=0.1,duration=20".parse().unwrap());
    let sound = fmu_twin::record(&fmu, &[], &torque, Some(3), SensorErrors::default()).unwrap();
    let last = sound.time.len() - 1;
    type Change = fn(&mut Recording, usize);
    let refused: [(Change, &str); 9] = [
        (|r, _| r.time[7] = f64::NAN, "row 8: time is NaN"),
        (|r, last| r.time[last] = f64::INFINITY, "time is inf"),
        (|r, last| r.time[last] = 1e12, "5.000e13 steps (allowed: at most 20000000)"),
        (
            |r, _| {
                let part = r.between(0.0, 0.05);
                *r = Recording { time: vec![0.0, 1e-9, 1e9], ..part };
            },
            "1000000000.0 s in steps of 1e-9 s are 1.000e18 steps",
        ),
        (|r, _| r.rate[5] = f64::NAN, "row 6: omega is NaN (allowed: up to 1e100)"),
        (|r, _| r.torque[0] = f64::NEG_INFINITY, "row 1: tau_cmd is -inf"),
        (|r, _| r.rate[5] = -1e300, "row 6: omega is -1e300"),
        (|r, _| r.angle = Some(vec![f64::NAN]), "row 1: theta is NaN"),
        (|r, _| r.time.truncate(2), "has 2 rows (allowed: at least 3)"),
    ];
    for (change, words) in refused {
        let mut bad = sound.clone();
        change(&mut bad, last);
        for (method, error) in errors(&fmu, &bad) {
            let error = error.unwrap_or_else(|| panic!("{method} takes {words}"));
            assert!(error.contains(words), "{method}: {error}");
        }
        let found = output_error::identify(&fmu, &[bad], &Options::default(), &mut |_| {});
        assert!(found.is_err(), "{words}");
    }
    // the methods accept values of these sizes: some results are strange, but each method returns
    let sizes: [Change; 6] = [
        |r, _| r.rate.iter_mut().for_each(|w| *w *= 1e90),
        |r, _| r.rate.iter_mut().for_each(|w| *w *= 1e-200),
        |r, _| r.torque.iter_mut().for_each(|t| *t *= 1e90),
        |r, _| r.torque.fill(0.0),
        |r, _| r.time.iter_mut().for_each(|t| *t *= 1e-12),
        |r, _| r.time.iter_mut().for_each(|t| *t *= 1e12),
    ];
    for change in sizes {
        let mut odd = sound.clone();
        change(&mut odd, last);
        errors(&fmu, &odd);
    }
}

#[test]
fn any_fmu_refuses_records_out_of_range() {
    let fmu = Adaptive::new(&["-DTOLERANCE=1e-5"]);
    let question = Question { starts: 1, ..question(Solver::Own) };
    let model = Model::open(&fmu.path(), Solver::Own).unwrap();
    for (time, value, words) in [
        (Some(f64::NAN), None, "row 6: time is NaN"),
        (Some(1e12), None, "row 7: time must grow"),
        (None, Some(f64::INFINITY), "row 6: r is inf (allowed: up to 1e100)"),
        (None, Some(1e300), "row 6: r is 1e300"),
    ] {
        let mut bad = record(1, 1.0);
        time.into_iter().for_each(|t| bad.time[5] = t);
        value.into_iter().for_each(|y| bad.outputs[0][5] = y);
        let error = identify(&model, &question, &[bad], &mut |_| {}).unwrap_err();
        assert!(format!("{error:#}").contains(words), "{error:#}");
    }
    for size in [1e90, 1e-200] {
        let mut odd = record(1, 1.0);
        odd.outputs[0].iter_mut().for_each(|y| *y *= size);
        let found = identify(&model, &question, &[odd], &mut |_| {});
        assert!(found.is_err() || found.unwrap().fits != Some(true), "{size}");
    }
}

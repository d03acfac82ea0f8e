//! Recordings of the FMU itself, with its gyro's noise, identified with nothing told.

use bench::profile::{Profile, Torque};
use host::fmi2::Fmu;
use identify::identification::{Options, identify};
use identify::recording::Recording;
use identify::twin::{self, Flaws};
use pack::packed_for_tests;

/// The thesis's sweep of 2700 s.
const LONG: &str = "lin-sweep:amplitude=0.1";
/// A faster one, where only gross faults matter.
const SHORT: &str = "lin-sweep:amplitude=0.1,duration=600,f0=1.8,f1=3";

fn sweep(fmu: &Fmu, torque: &str, settings: &[(&str, &str)]) -> Recording {
    let torque: Profile = torque.parse().unwrap();
    let zeta = [("slosh.zeta_from_correlation", "false"), ("slosh.zeta", "0.003")];
    let settings = [&zeta, settings].concat();
    twin::record(fmu, &settings, &Torque::Profile(torque), Some(4), Flaws::default()).unwrap()
}

fn options() -> Options {
    Options { models: vec!["linear".into()], flaws: false, gyro_scale: 0.0, ..Options::default() }
}

#[test]
fn parameters_come_back_and_coulomb_and_stribeck_friction_as_their_sum() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let found = identify(&fmu, &[sweep(&fmu, LONG, &[])], &options(), &mut |_| {}).unwrap();
    assert!(found.converged && found.described, "{:?}", found.verdict);
    for (name, truth) in [
        ("tank.d", 0.163),
        ("tank.h", 0.1),
        ("slosh.zeta", 0.003),
        ("hub.I", 0.322414),
        ("friction.c", 0.003498),
    ] {
        let p = &found.parameters[name];
        // four standard deviations: one false alarm in 3000 draws, and the seed is fixed
        assert!((p.value - truth).abs() < 4.0 * p.std, "{name}: {p:?}");
    }
    // the tank is known to better than a thousandth, or the fit has learnt nothing
    assert!(found.parameters["tank.d"].std < 1e-3 * 0.163);
    let sum = found.combinations.iter().find(|c| c.name == "friction.c + friction.d").unwrap();
    assert!((sum.value - 0.005921).abs() < 4.0 * sum.std, "{sum:?}");
    assert!(found.verdict.iter().any(|line| line.contains("cannot be told apart")));
}

#[test]
fn a_torque_that_is_clipped_is_flagged_as_not_described() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let clipped = sweep(&fmu, SHORT, &[("wheel.enabled", "true"), ("wheel.tau_max", "0.09")]);
    let found = identify(&fmu, &[clipped], &options(), &mut |_| {}).unwrap();
    assert!(!found.described);
    assert!(
        found.verdict.iter().any(|line| line.starts_with("NOT DESCRIBED")),
        "{:?}",
        found.verdict
    );
}

#[test]
fn degrees_per_second_are_refused_by_name() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let mut degrees = sweep(&fmu, SHORT, &[]);
    degrees.rate.iter_mut().for_each(|w| *w = w.to_degrees());
    let error = identify(&fmu, &[degrees], &options(), &mut |_| {}).unwrap_err().to_string();
    assert!(error.contains("omega looks like degrees per second"), "{error}");
}

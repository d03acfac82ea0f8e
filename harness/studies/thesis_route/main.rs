//! Compares the thesis's estimates of tank parameters in the time domain with ours, on the same recordings of the FMU: the thesis
//! adds a known friction torque to the command (`compensation.rs`), `hubslosh identify` simulates the friction in the model.
//!
//! ```text
//! cargo run --release -p identify --features studies --example thesis_route -- [duration of the sweep, s]
//! ```
//!
//! The thesis reports fits of 71.1 % for synthetic data without noise, 46.28 % with noise and −520.9 % for experiments (6.1.2).
//! Simulating the friction took four to five hours per fit, so the thesis gave it up. In place of the experiment, a simulated
//! bench has 10 % asymmetric friction, a gyro bias of 2 mrad/s and a delay of 5 ms, three values that neither method knows. The
//! thesis's method knows everything else exactly: the friction, the hub's inertia, and d, h and ζ as start values.

#[path = "../fmu_twin/mod.rs"]
#[allow(dead_code, reason = "others use the rest of it")]
mod fmu_twin;

use experiments::profile::Torque;
use fmu_twin::SensorErrors;
use host::fmu::Fmu;
use identify::bench::nominal::Bench;
use identify::bench::options::Options;
use identify::methods::output_error::identify;

mod compensation;

use compensation::Friction;

fn main() -> anyhow::Result<()> {
    let duration: f64 = std::env::args().nth(1).unwrap_or("2700".into()).parse()?;
    let fmu = Fmu::open(pack::packed_for_tests())?;
    let sweep = format!("lin-sweep:amplitude=0.1,duration={duration}");
    let torque = Torque::Profile(sweep.parse()?);
    let bench = Bench { arm: 0.225, density: 1000.0, gravity: 9.81 };
    let friction =
        Friction { b: 0.03793, c: 0.003498, d: 0.002423, omega_s: 0.08581, dead_band: 0.0 };
    let known = [("slosh.zeta_from_correlation", "false"), ("slosh.zeta", "0.003")];
    let uneven = [&known[..], &[("friction.asymmetry", "0.1")]].concat();
    let sensor_errors = SensorErrors { delay: 0.005, gyro_scale: 1.0, gyro_bias: 2e-3 };
    let cases = [
        ("clean", &known[..], None, SensorErrors::default(), "71.1"),
        ("with the gyro's noise", &known[..], Some(1), SensorErrors::default(), "46.28"),
        ("as in an experiment", &uneven[..], Some(1), sensor_errors, "-520.9"),
    ];
    println!(
        "{:24} {:>8} {:>12} {:>12} {:>10} {:>9} {:>9}",
        "fit of the rate, %", "thesis", "compensated", "dead band", "ours", "d, mm", "ours, s"
    );
    for (name, settings, seed, sensor_errors, thesis) in cases {
        let recording = fmu_twin::record(&fmu, settings, &torque, seed, sensor_errors)?;
        let start = (0.163, 0.1, 0.003);
        let by = |friction| compensation::identify(&recording, friction, 0.322414, start, bench);
        let (plain, banded) = (by(friction)?, by(Friction { dead_band: 2e-3, ..friction })?);
        let options = Options {
            models: vec!["linear".into()],
            sensor_errors: sensor_errors.delay > 0.0,
            gyro_scale: 0.0,
            ..Options::default()
        };
        let ours = identify(&fmu, &[recording], &options, &mut |_| {})?;
        println!(
            "{name:24} {thesis:>8} {:>12.2} {:>12.2} {:>10.3} {:>9.3} {:>9.1}",
            plain,
            banded,
            ours.details.fit.fit_pct,
            1e3 * ours.parameters["tank.d"].value,
            ours.details.seconds
        );
    }
    Ok(())
}

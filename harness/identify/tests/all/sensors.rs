//! Identification of simulated recordings from a sensor that is not an output of the FMU, for example a wave gauge
//! or a force sensor.

use experiments::profile::Torque;
use experiments::run::{Run, TORQUE};
use experiments::sensors::{Sensor, Sensors};
use host::fmu::Fmu;
use identify::any_fmu::identify;
use identify::input::question::{Question, Solver};
use identify::input::record::Record;
use identify::model::simulate::Model;
use pack::packed_for_tests;

const KNOWN: [(&str, &str); 4] = [
    ("slosh.model", "linear"),
    ("friction.model", "viscous"),
    ("slosh.zeta_from_correlation", "false"),
    ("init.slosh_angle", "0"),
];
const TRUTH: [(&str, f64); 3] = [("tank.h", 0.083), ("slosh.zeta", 0.006), ("hub.I", 0.35)];
const STEP: f64 = 0.02;

fn twin(sensor: &Sensor, column: &str) -> Record {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let known = KNOWN.iter().map(|(name, value)| (name.to_string(), value.to_string()));
    let own = TRUTH.iter().map(|(name, value)| (name.to_string(), value.to_string()));
    let profile = "noise:rms=0.03,f0=1,f1=3.5,duration=100";
    let run = Run {
        settings: known.chain(own).collect(),
        input: Some(TORQUE.into()),
        torque: Torque::Profile(profile.parse().unwrap()),
        others: Vec::new(),
        step: STEP,
        sample: STEP,
        stop: 100.0,
        tolerance: None,
        hold: false,
    };
    let one = [sensor.clone()];
    let sensors = Sensors::new(&one, fmu.description(), &run.settings, STEP).unwrap();
    let mut instance = run.initialise(&fmu).unwrap();
    let table = run.drive(&mut instance, &sensors.required_variables(), |_| {}).unwrap();
    let table = sensors.read(table, "twin", STEP).unwrap();
    let of = |name: &str| table.column(name).unwrap().to_vec();
    Record {
        name: "twin".into(),
        time: of("time"),
        inputs: vec![of(TORQUE)],
        outputs: vec![of(column)],
    }
}

/// Simulates a bench, records one column of a sensor, and asserts that the estimates are the true values. `noise` is the
/// specified standard deviation of one reading.
fn check_estimates_from(sensor: &str, column: &str, noise: f64) {
    let sensor: Sensor = sensor.parse().unwrap();
    let record = twin(&sensor, column);
    let free = ["tank.h=0.1:0.05:0.15", "slosh.zeta=0.003:0:0.1", "hub.I=0.3:0.1:1"];
    let settings = KNOWN.map(|(name, value)| format!("{name}={value}"));
    let question = Question {
        free: free.iter().map(|text| text.parse().unwrap()).collect(),
        priors: Vec::new(),
        tolerances: Vec::new(),
        settings: settings.iter().map(|text| text.parse().unwrap()).collect(),
        inputs: vec![TORQUE.into()],
        held: Vec::new(),
        outputs: vec![column.into()],
        sensors: vec![sensor],
        biases: vec![format!("{column}={}", 10.0 * noise).parse().unwrap()],
        triads: Vec::new(),
        drift: false,
        tolerance: None,
        solver: Solver::Own,
        starts: 2,
    };
    let model = Model::open(packed_for_tests(), Solver::Own).unwrap();
    let found = identify(&model, &question, &[record], &mut |_| {}).unwrap();
    assert!(found.converged && found.fits == Some(true), "{column}: {:?}", found.verdict);
    for (name, truth) in TRUTH {
        let e = &found.parameters[name];
        // a correct estimate exceeds this limit with a probability of 6e-5 for each of three values
        assert!((e.value - truth).abs() < 4.0 * e.std, "{column}: {name}: {e:?}");
        assert!(e.std < 0.05 * truth, "{column}: {name} is determined: {e:?}");
    }
    // 2500 readings determine their noise to 1.4 %; four standard errors are allowed
    let white = found.details.outputs[0].noise_white;
    assert!((white / noise - 1.0).abs() < 0.06, "{column}: {white}");
}

#[test]
fn identify_finds_the_parameters_of_a_simulated_bench_with_a_late_wave_gauge() {
    check_estimates_from(
        "wave=gauge:angle=60deg,rate=25,delay=0.04,scale=1.01,noise=2e-4,bias=3e-4",
        "wave",
        2e-4,
    );
}

/// The force sensor has noise and a bias.
#[test]
fn identify_finds_the_parameters_of_a_simulated_bench_with_a_force_sensor() {
    check_estimates_from("load=force:noise=5e-3,bias=0.01", "load", 5e-3);
}

/// The camera has a delay of 0.1 s.
#[test]
fn identify_finds_the_parameters_of_a_simulated_bench_with_a_camera() {
    check_estimates_from("view=camera:rate=10,delay=0.1,noise=5e-4", "view.plane_tangential", 5e-4);
}

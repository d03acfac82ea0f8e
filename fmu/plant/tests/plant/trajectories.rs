//! Compares the plant with trajectories of known accuracy.
//!
//! `trajectories.json` contains motions of 20 s, sampled every second, that were computed by two independent integrators of
//! high order (for the linear model by a 60-digit matrix exponential). Each record contains its number of valid digits
//! (`digits`, relative to `largest`, the largest value of the signal). `events` are pairs [time, contact] of the set-valued
//! friction law, and begin with the contact at the start.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use plant::{FrictionModel, Inputs, Parameters, Plant, Ramp, SloshModel};
use serde::Deserialize;

#[derive(Deserialize)]
struct Fill {
    zeta: f64,
    l: f64,
    f1: f64,
    h: f64,
    runs: Vec<Run>,
}

#[derive(Deserialize)]
struct Run {
    model: String,
    input: String,
    friction: String,
    digits: f64,
    largest: BTreeMap<String, f64>,
    samples: BTreeMap<String, Vec<f64>>,
    work: Vec<f64>,
    dissipated: Vec<f64>,
    #[serde(default)]
    events: Vec<(f64, i32)>,
    #[serde(default)]
    stuck_time: f64,
}

impl Fill {
    fn parameters(&self, run: &Run) -> Parameters {
        let mut p = Parameters::default();
        p.tank.h = self.h;
        p.slosh.zeta_from_correlation = false;
        p.slosh.zeta = self.zeta;
        p.slosh.model = match run.model.as_str() {
            "linear" => SloshModel::Linear,
            "planar" => SloshModel::Planar,
            _ => SloshModel::Spherical,
        };
        p.friction.model = match run.friction.as_str() {
            "none" => FrictionModel::None,
            "viscous" => FrictionModel::Viscous,
            "stribeck_smooth" => FrictionModel::StribeckSmooth,
            _ => FrictionModel::Stribeck,
        };
        p.friction.eps = 1e-3;
        let at = |name: &str| run.samples[name][0];
        if run.model == "spherical" {
            let (sin, cos) = (at("y") / self.l, at("x") / self.l);
            p.init.slosh_angle = sin.asin();
            p.init.slosh_rate = at("ydot") / self.l / (1.0 - sin * sin).sqrt();
            p.init.slosh_angle_radial = cos.asin();
            p.init.slosh_rate_radial = at("xdot") / self.l / (1.0 - cos * cos).sqrt();
        } else {
            p.init.slosh_angle = at("alpha");
            p.init.slosh_rate = at("alphadot");
        }
        p
    }

    /// Returns the communication step, s, and a function for the torque at the communication points. A pulse and a release
    /// are exact. A sine that is replaced by straight lines with the angular frequency w = 2 pi f would lose (w h)^2/12 of
    /// its amplitude in steps of h; therefore the values are multiplied by 1/sinc^2(f h), so that the fundamental of the
    /// lines is the sine.
    fn input<'a>(&'a self, run: &'a Run) -> (f64, impl Fn(f64) -> f64 + 'a) {
        let step = match run.input.as_str() {
            // Stick and slip begin when the torque itself, and not its fundamental, passes a level. For an error of 1e-7 s
            // the step must be so small that (w H)^2/8 of the torque is negligible.
            "sine_0p1" if run.friction == "stribeck" => 1e-4,
            "sine_0p1" => 1e-3,
            _ => 0.02,
        };
        let x = PI * self.f1 * step;
        let raise = (x / x.sin()).powi(2);
        (step, move |t: f64| match run.input.as_str() {
            "pulse" if t < 1.0 - 1e-9 => 0.05,
            "sine_0p1" => 0.1 * raise * (TAU * self.f1 * t).sin(),
            _ => 0.0,
        })
    }
}

fn differences(name: &str, fill: &Fill, run: &Run, tolerance: f64) -> Vec<String> {
    let (step, torque) = fill.input(run);
    let is_pulse = run.input == "pulse";
    let mut inputs = Inputs { tau_cmd: Ramp::held(torque(0.0)), ..Inputs::default() };
    let mut plant = Plant::new(&fill.parameters(run), &inputs, 0.0, tolerance).unwrap();
    let first = plant.outputs(&inputs);
    let mut events = vec![(0.0, first.discrete.friction_mode)];
    let mut largest_error: BTreeMap<&str, f64> = BTreeMap::new();
    let steps_per_second = (1.0 / step).round() as usize;
    for second in 0..=20 {
        let o = plant.outputs(&inputs);
        let value = |signal: &str| match signal {
            "theta" => o.theta,
            "omega" => o.omega,
            "alpha" => o.slosh_angle,
            "alphadot" => o.slosh_rate,
            "x" => fill.l * o.slosh_angle_radial.sin(),
            "y" => fill.l * o.slosh_angle.sin(),
            "xdot" => fill.l * o.slosh_angle_radial.cos() * o.slosh_rate_radial,
            _ => fill.l * o.slosh_angle.cos() * o.slosh_rate,
        };
        for (signal, samples) in &run.samples {
            // Without friction a released spherical pendulum has almost no radial motion.
            let scale = run.largest[signal].max(1e-12);
            let error = (value(signal) - samples[second]).abs() / scale;
            let worst = largest_error.entry(signal).or_default();
            *worst = worst.max(error);
        }
        let last = run.work.len() - 1;
        for (signal, got, want) in [("work", o.work, &run.work), ("heat", o.heat, &run.dissipated)]
        {
            let scale = want[last].abs().max(run.dissipated[last]).max(1e-12);
            let worst = largest_error.entry(signal).or_default();
            *worst = worst.max((got - want[second]).abs() / scale);
        }
        if second == 20 {
            break;
        }
        for k in second * steps_per_second..(second + 1) * steps_per_second {
            let (a, b) = (torque(k as f64 * step), torque((k + 1) as f64 * step));
            inputs.tau_cmd =
                if is_pulse { Ramp::held(a) } else { Ramp { value: a, slope: (b - a) / step } };
            // Each communication step is divided into two steps, so that two events are rarely in the same step.
            for _ in 0..2 {
                plant.step(&inputs, step / 2.0).unwrap();
                inputs.tau_cmd.value = inputs.tau_cmd.value_at(step / 2.0);
                let o = plant.outputs(&inputs);
                if o.discrete.event_count as usize == events.len() {
                    events.push((o.discrete.event_time, o.discrete.friction_mode));
                } else if o.discrete.event_count as usize > events.len() {
                    // If there were two events in one step, only the later one can be read.
                    events.push((f64::NAN, 2));
                    events.push((o.discrete.event_time, o.discrete.friction_mode));
                }
            }
            inputs.tau_cmd = Ramp::held(b);
        }
    }
    // The reference is exact to 1e-8. If the straight lines that replace the sine had their knots on the sine, they would lose
    // up to (w H)^2/12 = 1.8e-5 of its amplitude at 1 ms. With the increased values at the knots only harmonics of a
    // thousandth of this remain.
    let allowed = f64::max(1e-8, 10f64.powf(-run.digits));
    let mut wrong: Vec<String> = largest_error
        .iter()
        .filter(|(_, error)| **error > allowed || error.is_nan())
        .map(|(signal, error)| format!("{name}: error of {signal} is {error:.1e} of its maximum"))
        .collect();
    if run.friction == "stribeck" {
        if events.len() != run.events.len() {
            wrong.push(format!("{name}: {} events, not {}", events.len(), run.events.len()));
        }
        for (got, want) in events.iter().zip(&run.events) {
            let missed = got.1 == 2;
            if !missed && ((got.0 - want.0).abs() > 1e-7 || got.1 != want.1) {
                wrong.push(format!("{name}: event {got:?} instead of {want:?}"));
            }
        }
        let stuck = plant.outputs(&inputs).stuck_time;
        if (stuck - run.stuck_time).abs() > 1e-7 * events.len() as f64 {
            wrong.push(format!("{name}: stuck {stuck} s, not {} s", run.stuck_time));
        }
    }
    wrong
}

fn check(model: &str, tolerance: f64) {
    let text = include_str!("../trajectories.json");
    let fills: BTreeMap<String, Fill> = serde_json::from_str(text).unwrap();
    let mut wrong = Vec::new();
    let mut runs = 0;
    for (fill_name, fill) in &fills {
        for run in fill.runs.iter().filter(|run| run.model == model) {
            let name = format!("{fill_name} {} {} {}", run.model, run.input, run.friction);
            wrong.extend(differences(&name, fill, run, tolerance));
            runs += 1;
        }
    }
    assert!(runs >= 20, "the reference must contain at least 20 runs of every model");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The reference trajectories, with stick and slip, were computed by two other integrators. The tolerance of the solver is
/// 1e-10.
#[test]
fn trajectories_of_the_linear_model_equal_the_reference_at_tolerance_1e_10() {
    check("linear", 1e-10);
}

#[test]
fn trajectories_of_the_planar_model_equal_the_reference() {
    check("planar", 1e-11);
}

#[test]
fn trajectories_of_the_spherical_model_equal_the_reference() {
    check("spherical", 1e-11);
}

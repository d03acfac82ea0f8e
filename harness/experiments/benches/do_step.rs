//! Compares the CPU time of one fmi2DoStep for 20 ms of motion with two explicit integrators of the same equations.
//! Each time is the best of five. Only ratios are printed: the unit is the time of a Runge–Kutta integration with fixed
//! steps of 5 ms.
//!
//! All integrators receive the same torque, which is linear between knots 20 ms apart. It is a sweep of 0.1 N·m from 2.2 to
//! 2.6 Hz over antiresonance and resonance (10 cm fill).
//!
//! `cargo bench -p experiments --bench do_step`

use std::hint::black_box;
use std::time::{Duration, Instant};

use experiments::profile::Torque;
use experiments::run::Run;
use host::fmu::{Fmu, Instance};
use ode_solvers::{Dopri5, SVector, System};
use pack::packed_for_tests;

const STEP: f64 = 0.02;
const SWEEP: &str = "lin-sweep:amplitude=0.1,f0=2.2,f1=2.6,duration=200";
const DURATION: f64 = 200.0;

/// State of the bench: angle θ, rad, and rate ω, rad/s, of the hub, slosh angle α, rad, and its
/// rate, rad/s.
type State = SVector<f64, 4>;

/// Equations of the hub with one linear pendulum, for the thesis's bench. The sign of ω in the dry friction
/// is smoothed to tanh(ω/ε).
struct Smooth {
    knots: Vec<f64>,
}

impl System<f64, State> for Smooth {
    fn system(&self, t: f64, x: &State, dx: &mut State) {
        const MASS: f64 = 0.756_293_271_9; // Table 4.1 with the exact root of J1', 10 cm
        const LENGTH: f64 = 0.045_241_351_3;
        const ARM: f64 = 0.225;
        const INERTIA: f64 = 0.322_414 + 1.330_431_108_5 * ARM * ARM;
        const ZETA: f64 = 0.002_975_7;
        const EPS: f64 = 1e-3;
        let natural = (9.81f64 / LENGTH).sqrt();
        let knot = ((t / STEP) as usize).min(self.knots.len() - 2);
        let part = t / STEP - knot as f64;
        let tau = self.knots[knot] + (self.knots[knot + 1] - self.knots[knot]) * part;
        let [_, w, angle, rate] = x.data.0[0];
        let dry = 0.003498 + 0.002423 * (-(w / 0.08581).powi(2)).exp();
        let friction = -0.03793 * w - (w / EPS).tanh() * dry;
        let spring = natural * natural * angle + 2.0 * ZETA * natural * rate;
        let acceleration = (tau + friction + ARM * MASS * LENGTH * spring) / INERTIA;
        *dx = State::from([w, acceleration, rate, -spring - ARM / LENGTH * acceleration]);
    }
}

fn rk4(system: &Smooth, parts: usize) -> State {
    let h = STEP / parts as f64;
    let slope = |t: f64, x: State| {
        let mut dx = State::zeros();
        system.system(t, &x, &mut dx);
        dx
    };
    let mut x = State::zeros();
    for step in 0..(system.knots.len() - 1) * parts {
        let t = step as f64 * h;
        let k1 = slope(t, x);
        let k2 = slope(t + h / 2.0, x + k1 * (h / 2.0));
        let k3 = slope(t + h / 2.0, x + k2 * (h / 2.0));
        let k4 = slope(t + h, x + k3 * h);
        x += (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0);
    }
    x
}

/// Integrates by the method of MATLAB's ode45 over the whole sweep, with the tolerances of the thesis (6.2.3) and dense
/// output at every knot.
fn dopri5(system: Smooth) -> State {
    let end = (system.knots.len() - 1) as f64 * STEP;
    let mut solver = Dopri5::new(system, 0.0, end, STEP, State::zeros(), 1e-5, 1e-7);
    solver.integrate().expect("it integrates");
    *solver.y_out().last().expect("it gives points")
}

fn best(mut run: impl FnMut() -> Duration) -> Duration {
    (0..5).map(|_| run()).min().unwrap_or_default()
}

fn main() {
    let torque = Torque::Profile(SWEEP.parse().expect("a profile"));
    let steps = (DURATION / STEP).round() as usize;
    let knots: Vec<f64> = (0..=steps).map(|k| torque.torque_at(k as f64 * STEP)).collect();
    let smooth = || Smooth { knots: knots.clone() };

    let rk4_time = best(|| {
        let system = smooth();
        let start = Instant::now();
        black_box(rk4(&system, 4));
        start.elapsed()
    });
    let dopri5_time = best(|| {
        let system = smooth();
        let start = Instant::now();
        black_box(dopri5(system));
        start.elapsed()
    });

    let fmu = Fmu::open(packed_for_tests()).expect("the FMU opens");
    let reference = fmu.description().variable("tau_cmd").expect("it is there").reference;
    // only fmi2DoStep is timed, not the calls that set the torque
    let steps_of = |instance: &mut Instance| {
        let mut total = Duration::ZERO;
        for (k, knots) in knots.windows(2).enumerate() {
            instance.set_real(&[reference], &knots[..1]).expect("a torque");
            let slope = (knots[1] - knots[0]) / STEP;
            instance.set_slopes(&[reference], &[slope]).expect("its slope");
            let start = Instant::now();
            instance.do_step(k as f64 * STEP, STEP).expect("a step");
            total += start.elapsed();
        }
        total
    };
    println!("20 ms of motion, {steps} steps of a 0.1 N·m sweep from 2.2 to 2.6 Hz, 10 cm fill:\n");
    println!("{:55} {:>10} {:>9}", "", "ns", "RK4 = 1");
    let line = |what: &str, time: Duration| {
        let nanoseconds = time.as_secs_f64() * 1e9 / steps as f64;
        let ratio = time.as_secs_f64() / rk4_time.as_secs_f64();
        println!("{what:55} {nanoseconds:10.0} {ratio:9.2}");
    };
    line("RK4, 4 steps of 5 ms, friction tanh(ω/1e-3)", rk4_time);
    line("ode_solvers Dopri5, rtol 1e-5, atol 1e-7, the same", dopri5_time);
    for (model, friction) in [
        ("linear", "stribeck"),
        ("linear", "stribeck_smooth"),
        ("linear", "viscous"),
        ("spherical", "stribeck"),
    ] {
        let settings =
            [("slosh.model", model), ("friction.model", friction), ("friction.eps", "1e-3")];
        let settings = settings.map(|(k, v)| (k.to_string(), v.to_string())).to_vec();
        let stop = DURATION;
        let run = Run {
            input: Some(experiments::run::TORQUE.into()),
            settings,
            torque: torque.clone(),
            others: Vec::new(),
            step: STEP,
            sample: STEP,
            stop,
            tolerance: None,
            hold: false,
        };
        let time = best(|| steps_of(&mut run.initialise(&fmu).expect("it starts")));
        line(&format!("fmi2DoStep, {model}, {friction}, the FMU's own tolerance"), time);
    }
}

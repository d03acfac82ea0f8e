//! Computes one point of a work-precision diagram, for one method at one tolerance: CPU time for 20 ms of motion, and the
//! error over the thesis's sweep (0.1 N·m, 10 cm of water, dry friction).
//!
//! `work_precision METHOD TOLERANCE SECONDS RUNS [REFERENCE]` prints `ns per 20 ms,largest error of omega in rad/s`.
//! The motion is simulated RUNS times. The CPU time is measured in pieces of 10 s, or over the whole sweep if a solver
//! takes it in one call. For each piece the smallest time of all runs counts, which excludes other load of the machine.
//! METHOD is one of:
//!
//! * `linear`, `spherical`: the packed FMU (`dist/HubSlosh.fmu`) with the slosh model of this name and set-valued
//!   friction. With `--write FILE` the rates are written to a file, which is the REFERENCE of later calls
//!   (`work_precision linear 1e-13 2700 1 --write FILE`). `linear/12` reads the first 12 outputs after every step, in one
//!   call, instead of only omega.
//! * `dopri5`, `dop853`: ode_solvers on the linear model with sgn(omega) smoothed to tanh(omega/1e-5), over the whole sweep
//!   in one call; `dopri5@1e-8` smooths over 1e-8 rad/s instead of 1e-5 rad/s.
//! * `rk4`: classical fixed-step Runge-Kutta on the smoothed model; TOLERANCE is the step in s.
//! * `torque`: computes only the torque, so that its instructions can be subtracted from those of each method.
//!
//! All methods receive the same torque, which is linear between knots 20 ms apart.

use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use experiments::rest;
use host::causality::Causality;
use host::fmu::Fmu;
use ode_solvers::{Dop853, Dopri5, OutputType, SVector, System};

const STEP: f64 = 0.02;
const AMPLITUDE: f64 = 0.1;
/// Number of steps of 20 ms in a piece of a run whose CPU time is measured.
const PIECE: usize = 500;

fn torque(seconds: f64) -> Vec<f64> {
    let rate = (3.5f64 / 1.25).ln() / 2700.0;
    let cycles = |t: f64| 1.25 * ((rate * t).exp() - 1.0) / rate;
    let count = (seconds / STEP).round() as usize;
    let at = |k| AMPLITUDE * (std::f64::consts::TAU * cycles(k as f64 * STEP)).sin();
    (0..=count).map(at).collect()
}

#[cfg(unix)]
fn cpu_time() -> Duration {
    let now = nix::time::clock_gettime(nix::time::ClockId::CLOCK_THREAD_CPUTIME_ID);
    now.map_or(Duration::ZERO, Duration::from)
}

/// Returns the time since the first call. It is used on systems that do not report the CPU time of a thread.
#[cfg(not(unix))]
fn cpu_time() -> Duration {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed()
}

fn since(start: Duration) -> f64 {
    (cpu_time() - start).as_secs_f64()
}

/// Solution by one method: the hub's rates at the knots, rad/s, and the CPU time that each piece of
/// the run took, s.
type Solution = (Vec<f64>, Vec<f64>);

fn fmu(model: &str, outputs: usize, tolerance: f64, torque: &[f64]) -> Result<Solution> {
    let fmu = Fmu::open(Path::new("dist/HubSlosh.fmu"))?;
    let mut instance = rest::instantiate(&fmu, "work_precision")?;
    instance.set("slosh.model", model)?;
    instance.enter_initialization_mode(Some(tolerance), 0.0, None)?;
    instance.exit_initialization_mode()?;
    let reference =
        |name: &str| Ok::<u32, anyhow::Error>(fmu.description().variable(name)?.reference);
    let (tau, omega) = (reference("tau_cmd")?, reference("omega")?);
    let all = fmu.description().variables.iter().filter(|v| v.causality == Causality::Output);
    let others = all.map(|v| v.reference).filter(|reference| *reference != omega);
    let read: Vec<u32> = std::iter::once(omega).chain(others).take(outputs).collect();
    ensure!(read.len() == outputs, "{outputs} outputs (allowed: 1 to {})", read.len());
    let mut values = vec![0.0; read.len()];
    let (mut rates, mut took) = (vec![0.0; torque.len()], Vec::new());
    for begin in (0..torque.len() - 1).step_by(PIECE) {
        let start = cpu_time();
        for k in begin..(begin + PIECE).min(torque.len() - 1) {
            let slope = (torque[k + 1] - torque[k]) / STEP;
            instance.set_real(&[tau], &torque[k..k + 1])?;
            instance.do_step_along(k as f64 * STEP, STEP, &[tau], &torque[k..k + 1], &[slope])?;
            instance.get_real(&read, &mut values)?;
            rates[k + 1] = values[0];
        }
        took.push(since(start));
    }
    Ok((rates, took))
}

/// Differential equations of the hub and one linear pendulum on the bench with 10 cm of water, with smoothed friction, for
/// the solvers other than the FMU.
struct Smooth<'a> {
    torque: &'a [f64],
    /// Rate of the hub, rad/s, below which dry friction is smoothed: tanh(ω/eps) replaces the sign of the rate ω.
    eps: f64,
}

type State = SVector<f64, 4>;

impl System<f64, State> for Smooth<'_> {
    fn system(&self, t: f64, x: &State, dx: &mut State) {
        const M: f64 = 0.756_293_271_862_872;
        const L: f64 = 0.045_241_351_252_659_934;
        const R: f64 = 0.225;
        const G: f64 = 9.81;
        const I0: f64 = 0.322_414 + 1.330_431_108_467_808_4 * R * R;
        // c = 2 zeta omega_n m with the damping of the correlation
        const C: f64 = 0.066_278_753_698_767_37;
        let place = (t / STEP).clamp(0.0, (self.torque.len() - 1) as f64);
        let k = (place as usize).min(self.torque.len() - 2);
        let part = place - k as f64;
        let tau = self.torque[k] + part * (self.torque[k + 1] - self.torque[k]);
        let w = x[1];
        let dry = 0.003498 + 0.002423 * (-(w / 0.08581).powi(2)).exp();
        let friction = -(0.03793 * w + (w / self.eps).tanh() * dry);
        dx[0] = w;
        dx[1] = (tau + friction + R * (M * G * x[2] + C * L * x[3])) / I0;
        dx[2] = x[3];
        dx[3] = -C / M * x[3] - G / L * x[2] - R / L * dx[1];
    }
}

fn at_knots(times: &[f64], states: &[State], count: usize) -> Result<Vec<f64>> {
    let mut rates = vec![f64::NAN; count];
    for (t, x) in times.iter().zip(states) {
        let k = (t / STEP).round() as usize;
        if k < count && (t - k as f64 * STEP).abs() < 1e-6 {
            rates[k] = x[1];
        }
    }
    ensure!(rates.iter().all(|w| w.is_finite()), "the solver left knots out");
    Ok(rates)
}

fn rk4(torque: &[f64], eps: f64, step: f64) -> Solution {
    let system = Smooth { torque, eps };
    let per_knot = (STEP / step).round() as usize;
    let (mut x, mut rates, mut took) = (State::zeros(), vec![0.0], Vec::new());
    for begin in (0..torque.len() - 1).step_by(PIECE) {
        let start = cpu_time();
        for k in begin..(begin + PIECE).min(torque.len() - 1) {
            for j in 0..per_knot {
                let t = k as f64 * STEP + j as f64 * step;
                let slope = |t: f64, x: State| {
                    let mut dx = State::zeros();
                    system.system(t, &x, &mut dx);
                    dx
                };
                let k1 = slope(t, x);
                let k2 = slope(t + step / 2.0, x + k1 * (step / 2.0));
                let k3 = slope(t + step / 2.0, x + k2 * (step / 2.0));
                let k4 = slope(t + step, x + k3 * step);
                x += (k1 + (k2 + k3) * 2.0 + k4) * (step / 6.0);
            }
            rates.push(x[1]);
        }
        took.push(since(start));
    }
    (rates, took)
}

fn main() -> Result<()> {
    let all: Vec<String> = std::env::args().skip(1).collect();
    let args: Vec<&str> = all.iter().map(String::as_str).collect();
    let ([method, tolerance, seconds, runs], file) = match args[..] {
        [a, b, c, d] => ([a, b, c, d], None),
        [a, b, c, d, "--write", file] => ([a, b, c, d], Some((file, true))),
        [a, b, c, d, file] => ([a, b, c, d], Some((file, false))),
        _ => bail!("usage: work_precision METHOD TOLERANCE SECONDS RUNS [[--write] REFERENCE]"),
    };
    let (tolerance, seconds): (f64, f64) = (tolerance.parse()?, seconds.parse()?);
    let runs: usize = runs.parse()?;
    let (method, eps) = method.split_once('@').unwrap_or((method, "1e-5"));
    let eps: f64 = eps.parse()?;
    ensure!(runs > 0, "RUNS = 0 (allowed: 1 or more)");
    let torque = torque(seconds);
    let end = (torque.len() - 1) as f64 * STEP;
    // the number of steps is not limited, and stiffness is not detected; other options have their defaults
    macro_rules! whole_sweep {
        ($solver:ident, $max:expr, $min:expr, $beta:expr) => {{
            let start = cpu_time();
            let mut solver = $solver::from_param(
                Smooth { torque: &torque, eps },
                0.0,
                end,
                STEP,
                State::zeros(),
                tolerance,
                tolerance * 1e-2,
                0.9,
                $beta,
                $min,
                $max,
                end,
                0.0,
                u32::MAX,
                u32::MAX,
                OutputType::Dense,
            );
            solver.integrate()?;
            let took = vec![since(start)];
            (at_knots(solver.x_out(), solver.y_out(), torque.len())?, took)
        }};
    }
    let (method, outputs) = method.split_once('/').unwrap_or((method, "1"));
    let outputs: usize = outputs.parse()?;
    let solve = || -> Result<Solution> {
        Ok(match method {
            "linear" | "spherical" => fmu(method, outputs, tolerance, &torque)?,
            "dopri5" => whole_sweep!(Dopri5, 10.0, 0.2, 0.04),
            "dop853" => whole_sweep!(Dop853, 6.0, 0.333, 0.0),
            "rk4" => rk4(&torque, eps, tolerance),
            "torque" => (vec![0.0; torque.len()], Vec::new()),
            _ => bail!("{method} is none of linear, spherical, dopri5, dop853, rk4, torque"),
        })
    };
    let (rates, mut least) = solve()?;
    for _ in 1..runs {
        for (least, took) in least.iter_mut().zip(solve()?.1) {
            *least = least.min(took);
        }
    }
    let took: f64 = least.iter().sum();
    let mut error = f64::NAN;
    match file {
        Some((file, true)) => {
            let bytes: Vec<u8> = rates.iter().flat_map(|w| w.to_le_bytes()).collect();
            std::fs::write(file, bytes).with_context(|| format!("{file} could not be written"))?;
        }
        Some((file, false)) => {
            let bytes = std::fs::read(file).with_context(|| format!("{file} could not be read"))?;
            let exact = bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap()));
            error = rates.iter().zip(exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        }
        None => (),
    }
    println!("{:.1},{error:e}", took / (torque.len() - 1) as f64 * 1e9);
    Ok(())
}

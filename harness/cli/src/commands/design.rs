use std::collections::BTreeMap;
use std::path::PathBuf;

use analysis::gauss_markov::Noise;
use analysis::linear::{Linear, Mode};
use anyhow::{Result, bail, ensure};
use experiments::profile::{self, COARSEST, Torque, Written};
use files::budget;
use host::fmu::Fmu;
use host::schedule::History;
use identify::bench::design::{self, Multisine, Wheel};
use identify::bench::nominal;
use identify::bench::simulate::Setup;
use identify::engine::Hold;
use names::hubslosh::{TAU_CMD, friction, hub, imu, slosh, tank, wheel};
use serde_json::json;
use signals::table::{self, Table};

use super::any_fmu::{AnyFmuArgs, Request};
use super::{DEFAULT_FMU, estimates, open, setting};
use crate::terminal;

/// Predicts how well a planned experiment will determine each parameter (Cramér–Rao bound).
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  hubslosh design --profile lin-sweep:amplitude=0.1\n  \
    hubslosh design --snr 20 --band 1.25,20\n  \
    hubslosh design --multisine 0.25 --duration 600 --out torque.csv\n  \
    hubslosh design --multisine 0.25 --optimal --set friction.b=0.04 --out torque.csv\n  \
    hubslosh design slew.csv --fmu Spacecraft --free craft.Jzz=640,tank[1].mass[1]=128 --inputs torque[3] \
    --outputs omega[3] --noise omega[3]=1e-5")]
pub struct DesignArgs {
    /// Torque profile with its settings, such as lin-sweep:amplitude=0.1. `hubslosh torque --profiles` lists the
    /// profiles.
    #[arg(long, value_name = "PROFILE", conflicts_with_all = ["multisine", "free"])]
    profile: Option<String>,
    /// Plans a multisine with random phases whose largest torque is PEAK, N·m. It contains only odd multiples of the
    /// frequency 1/period. Some odd multiples are left out, so that a response at them reveals nonlinearity.
    #[arg(long, value_name = "PEAK", conflicts_with = "free")]
    multisine: Option<f64>,
    /// Desired signal-to-noise ratio of the gyro's samples, dB. The command prints the torque amplitude of a sine that
    /// reaches this ratio: at both ends of the band, at the frequencies that need the smallest torque (the resonance)
    /// and the largest (the antiresonance), and for a rigid hub at the upper end of the band (section 8.6.1 of Rubaga's
    /// thesis).
    #[arg(long, value_name = "DB", conflicts_with_all = ["profile", "multisine", "out"])]
    snr: Option<f64>,
    /// Period of the multisine, s.
    #[arg(long, value_name = "SECONDS", default_value_t = 100.0, conflicts_with = "profile")]
    period: f64,
    /// Length of the multisine, s. A torque profile has its own length, set by `duration=…`.
    #[arg(long, value_name = "SECONDS", default_value_t = 600.0, conflicts_with = "profile")]
    duration: f64,
    /// Lowest and highest frequency of the multisine, or of the sine for --snr, Hz.
    #[arg(long, value_name = "HZ,HZ", value_delimiter = ',', default_value = "1.25,3.5")]
    band: Vec<f64>,
    /// Distributes the power of the multisine over its frequencies so that it determines the parameters of the expected
    /// bench best (D-optimal); a quarter of the power stays spread over all frequencies. The command then compares the
    /// multisine with a linear sweep of the same peak, band and length, and recommends the better one.
    #[arg(long, requires = "multisine")]
    optimal: bool,
    /// Largest slosh angle, rad; a torque that would exceed it is scaled down. Linear theory holds up to 0.18 rad, where
    /// the wave is 0.15 tank radii high.
    #[arg(long, value_name = "RAD")]
    slosh_angle: Option<f64>,
    /// Seed for the random phases of the multisine, and for the choice of the frequencies that are left out to detect
    /// nonlinearity.
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    seed: u64,
    /// Sets a parameter to its expected value for the bench.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    settings: Vec<(String, String)>,
    /// Also treats delay, gyro bias and friction asymmetry as unknown, because the fit of the recording will estimate
    /// them, too.
    #[arg(long, alias = "flaws", conflicts_with = "free")]
    sensor_errors: bool,
    /// FMU: a file, or the name of an FMU of this project (`hubslosh fmus` lists them).
    #[arg(long, value_name = "FILE|NAME", default_value = DEFAULT_FMU)]
    pub fmu: PathBuf,
    /// Prints the result as JSON.
    #[arg(long)]
    json: bool,
    /// File for the torque, .csv or .parquet.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Tables with the inputs that you plan to apply; only with --free, which names the parameters to estimate.
    #[arg(value_name = "DATA", requires = "free")]
    data: Vec<PathBuf>,
    /// Standard deviation of the noise in one sample of each output, in the unit of the output; only with --free.
    #[arg(long, value_name = "OUTPUT=STD,…", requires = "free")]
    noise: Vec<String>,
    /// Columns of the tables that contain the inputs, with units, such as torque[3]=T:mNm; only with --free.
    #[arg(
        long,
        value_name = "INPUT=COLUMN[:UNIT],…",
        requires = "free",
        default_value = "",
        hide_default_value = true
    )]
    columns: String,
    #[command(flatten)]
    any: AnyFmuArgs,
}

/// Time between two rows of the planned torque, s.
const STEP: f64 = 0.02;
/// Slosh angle at which linear theory ends, rad. The wave at the wall is 2 α R/(ξ² − 1) with the
/// slosh angle α, the tank's radius R and the zero ξ = 1.841 of J₁'; at this angle it reaches 0.15
/// R.
const LINEAR: f64 = 0.18;
/// Number of columns of the table from which the Cramér–Rao bound is computed. The memory for the
/// table is estimated with it.
const COLUMNS: usize = 20;

impl DesignArgs {
    pub fn run(mut self) -> Result<()> {
        if !self.any.is_asked() {
            self.settings = nominal::with_damping(self.settings);
        }
        if self.any.is_asked() {
            let request = Request {
                data: &self.data,
                settings: &self.settings,
                columns: &self.columns,
                rate: None,
                fmu: &self.fmu,
                json: self.json,
            };
            return self.any.design(&request, &self.noise);
        }
        ensure!(
            self.any.tolerances.is_empty(),
            "--tolerance needs --free, because the bound for the bench treats all known values as exact"
        );
        if let Some(out) = &self.out {
            table::check_ending(out)?;
        }
        let fmu = open(&self.fmu)?;
        for warning in nominal::warnings(&fmu, &self.settings)? {
            terminal::warn(warning);
        }
        let mut instance = nominal::initialised(&fmu, &self.settings)?;
        let mut real = |name: &str| instance.real(name);
        let wheel = Wheel {
            torque: real(wheel::TAU_MAX)?,
            inertia: real(wheel::I)?,
            speeds: [real(wheel::SPEED_0)?, real(wheel::SPEED_MIN)?, real(wheel::SPEED_MAX)?],
        };
        if let Some(snr) = self.snr {
            return self.torque_for(snr, wheel.torque, &mut real);
        }
        let (time, torque, by_wheel) = self.torque(&wheel, &mut real)?;
        let bench = Bench::new(&self, &fmu, &mut real)?;
        let full = analysis::statistics::peak(&torque);
        let (by_angle, torque) = bench.limit_slosh_angle(&time, torque)?;
        let plan = Plan {
            factor: by_wheel * by_angle,
            peak: analysis::statistics::peak(&torque),
            angle: design::slosh_angle(&fmu, &bench.setup, &time, &torque)?,
            speeds: wheel.range(&time, &torque),
            bounds: bench.bounds(&time, &torque)?,
            sweep: self.optimal.then(|| self.sweep(&bench, &time, full)).transpose()?,
        };
        if self.json {
            terminal::print_json(&plan.json(&fmu, &wheel))?;
        } else {
            plan.print(&wheel, self.slosh_angle);
        }
        if let Some(out) = &self.out {
            Table::of([("time", time), (TAU_CMD, torque)]).write(out, &BTreeMap::new())?;
            done!("{}", out.display());
        }
        Ok(())
    }

    /// Returns the planned torque, which is reduced if it would exceed the limits of the reaction
    /// wheel `wheel`: times of the rows (s), torques (N·m), and the factor of the reduction. `real`
    /// returns the value of a parameter of the FMU.
    fn torque(
        &self,
        wheel: &Wheel,
        real: &mut dyn FnMut(&str) -> Result<f64>,
    ) -> Result<(Vec<f64>, Vec<f64>, f64)> {
        let sampled = |stop: f64, at: &dyn Fn(f64) -> f64| -> Result<(Vec<f64>, Vec<f64>)> {
            // Time, torque, rate and the derivative of the rate with respect to every unknown.
            budget::table(budget::steps(stop, STEP)? + 1, COLUMNS)?;
            let rows = (stop / STEP).round() as usize;
            let time: Vec<f64> = (0..=rows).map(|k| k as f64 * STEP).collect();
            let tau = time.iter().map(|&t| at(t)).collect();
            Ok((time, tau))
        };
        if let Some(profile) = &self.profile {
            let torque = profile.parse::<Written>()?.torque()?;
            let (time, tau) = sampled(torque.span().1, &|t| torque.torque_at(t))?;
            check_rows(&torque, &time, &tau)?;
            return Ok((time, tau, 1.0));
        }
        let Some(peak) = self.multisine else {
            bail!("give the torque to plan: --profile or --multisine")
        };
        let [f0, f1] = self.band[..] else { bail!("--band needs two frequencies, Hz") };
        ensure!(
            f1 <= 0.5 / STEP,
            "--band ends at {f1} Hz (allowed: up to {} Hz, half the sampling rate of rows {STEP} s apart)",
            0.5 / STEP
        );
        design::check_rows(self.period, (f0, f1), peak, budget::steps(self.duration, STEP)?)?;
        let mut torque = Multisine::new(self.period, (f0, f1), peak, self.seed)?;
        if self.optimal {
            let plant = expected(real, peak)?;
            let shares = design::d_optimal(&plant, &torque.frequencies());
            torque = torque.shaped(&shares, peak, self.seed);
        }
        let (time, tau) = sampled(self.duration, &|t| torque.at(t))?;
        let factor = wheel.factor(&time, &tau).min(1.0);
        if factor < 1.0 {
            torque = torque.scaled(factor);
        }
        let (time, tau) = sampled(self.duration, &|t| torque.at(t))?;
        Ok((time, tau, factor))
    }

    /// Computes the Cramér–Rao bounds for a linear sweep with the peak torque `peak`, N·m, at the
    /// times `time`, s. The peak is reduced if the slosh angle would exceed its limit.
    fn sweep(&self, bench: &Bench, time: &[f64], peak: f64) -> Result<Sweep> {
        let (f0, f1) = (self.band[0], self.band[1]);
        let written = |peak: f64| {
            format!("lin-sweep:amplitude={peak:.4},f0={f0},f1={f1},duration={}", self.duration)
        };
        let profile = written(peak).parse::<Written>()?.torque()?;
        let (factor, sweep) =
            bench.limit_slosh_angle(time, time.iter().map(|&t| profile.torque_at(t)).collect())?;
        Ok(Sweep {
            profile: written(factor * peak),
            angle: design::slosh_angle(bench.fmu, &bench.setup, time, &sweep)?,
            bounds: bench.bounds(time, &sweep)?,
        })
    }
}

/// Checks that straight lines between the rows with the times `time`, s, and the torques `tau`,
/// N·m, reproduce the planned torque.
///
/// # Errors
///
/// If they do not. A torque that changes more slowly, or that has its edges at the rows, helps.
fn check_rows(torque: &Torque, time: &[f64], tau: &[f64]) -> Result<()> {
    let history = torque.history(STEP, time[time.len() - 1], false)?;
    let lines = History::new(time.to_vec(), tau.to_vec(), None, false)?;
    let knots = history.time();
    let wanted = |t: f64| history.after(t).0;
    let peak = knots.iter().fold(0.0_f64, |peak, t| peak.max(wanted(*t).abs()));
    let mut lines = lines.cursor();
    for &t in knots.iter().filter(|t| **t <= time[time.len() - 1]) {
        // An edge of the torque may lie one ulp before the row with the same time.
        let row = (t / STEP).round() * STEP;
        let made = lines.after(if (t - row).abs() < 1e-6 * STEP { row } else { t }).0;
        ensure!(
            (made - wanted(t)).abs() <= COARSEST * peak,
            "rows {STEP} s apart, joined by straight lines, do not describe this torque: at {t:.6} s they give \
             {made:.4} N·m in place of {:.4} N·m (allowed: edges at multiples of {STEP} s, frequencies up to {:.2} Hz)",
            wanted(t),
            profile::cycles(COARSEST) / STEP
        );
    }
    Ok(())
}

struct Bench<'f> {
    fmu: &'f Fmu,
    /// Settings of the FMU. If they contain no damping ratio of a slosh mode, the FMU computes it
    /// from a correlation of measurements.
    setup: Setup,
    sensor_errors: bool,
    noise: Noise,
    /// Largest slosh angle that the option `--slosh-angle` allows, rad; `None` without a limit.
    limit: Option<f64>,
}

impl<'f> Bench<'f> {
    fn new(
        asked: &DesignArgs,
        fmu: &'f Fmu,
        real: &mut dyn FnMut(&str) -> Result<f64>,
    ) -> Result<Self> {
        let intersample = Hold::FirstOrderHold;
        let setup = Setup { settings: asked.settings.clone(), intersample };
        let white = white_noise(real)?;
        // Gauss–Markov bias of IEEE Std 952: its standard deviation is the bias instability divided by
        // 0.664.
        let drift = real(imu::BIAS_INSTABILITY)? / 0.664 / white;
        let noise = Noise { white, drift, time: real(imu::BIAS_TIME)? };
        let sensor_errors = asked.sensor_errors;
        Ok(Bench { fmu, setup, sensor_errors, noise, limit: asked.slosh_angle })
    }

    fn limit_slosh_angle(&self, time: &[f64], torque: Vec<f64>) -> Result<(f64, Vec<f64>)> {
        let Some(limit) = self.limit else { return Ok((1.0, torque)) };
        ensure!(limit > 0.0, "--slosh-angle must be a positive number, rad");
        let factor = design::within_angle(self.fmu, &self.setup, time, &torque, limit)?;
        Ok((factor, torque.iter().map(|t| factor * t).collect()))
    }

    /// Computes the Cramér–Rao bounds of all unknowns for a torque (N·m) at the times `time` (s).
    ///
    /// # Errors
    ///
    /// If the plan has no more rows than unknowns, or the simulation fails.
    fn bounds(&self, time: &[f64], torque: &[f64]) -> Result<Bounds> {
        let rows = (time.to_vec(), torque.to_vec());
        ensure!(
            time.len() > COLUMNS,
            "the plan has {} rows, {STEP} s apart (allowed: more than {COLUMNS} rows); a longer duration gives more rows",
            time.len()
        );
        design::cramer_rao(self.fmu, &self.setup.settings, rows, self.sensor_errors, self.noise)
    }
}

/// Returns the standard deviation of the gyro's white noise in one sample, rad/s: the angle random
/// walk times the square root of the sampling rate. `real` returns the value of a parameter of the
/// FMU.
fn white_noise(real: &mut dyn FnMut(&str) -> Result<f64>) -> Result<f64> {
    let white = real(imu::ARW)? * real(imu::RATE)?.sqrt();
    ensure!(
        white > 0.0,
        "imu.arw = 0: without noise there is no signal-to-noise ratio (allowed: above 0)"
    );
    Ok(white)
}

type Bounds = Vec<(String, f64, f64)>;

struct Sweep {
    profile: String,
    angle: f64,
    bounds: Bounds,
}

struct Plan {
    factor: f64,
    peak: f64,
    angle: f64,
    /// Lowest and highest speed of the reaction wheel that turns the hub, rad/s.
    speeds: (f64, f64),
    bounds: Bounds,
    sweep: Option<Sweep>,
}

impl Plan {
    /// Returns the linear sweep with the same peak torque if it determines the parameters more
    /// precisely than the planned multisine, otherwise `None`.
    fn more_precise_sweep(&self) -> Option<&Sweep> {
        let merit = design::merit(&self.bounds);
        self.sweep.as_ref().filter(|sweep| design::merit(&sweep.bounds) < merit)
    }

    fn json(&self, fmu: &Fmu, wheel: &Wheel) -> serde_json::Value {
        let parameters = |bounds: &[(String, f64, f64)]| {
            let one = |(name, value, std): &(String, f64, f64)| {
                let variable = fmu.description().variable(name);
                let unit = variable.map(|v| fmu.description().unit(v).to_string()).ok();
                (name.clone(), json!({ "value": value, "std_noise": std, "unit": unit }))
            };
            bounds.iter().map(one).collect::<serde_json::Map<_, _>>()
        };
        let other = self.sweep.as_ref().map(|Sweep { profile, angle, bounds }| {
            json!({ "profile": profile, "slosh_angle": angle, "parameters": parameters(bounds) })
        });
        let [_, low, high] = wheel.speeds;
        json!({
            "peak": self.peak,
            "torque_factor": self.factor,
            "wheel_speed": [self.speeds.0, self.speeds.1],
            "wheel_speed_allowed": [low, high],
            "slosh_angle": self.angle,
            "parameters": parameters(&self.bounds),
            "sweep": other,
            "recommended": if self.more_precise_sweep().is_some() { "sweep" } else { "this" },
        })
    }

    fn print(&self, wheel: &Wheel, limit: Option<f64>) {
        if self.factor < 1.0 {
            println!(
                "all torques are multiplied by {:.4}, to stay within the wheel's limits{}",
                self.factor,
                match limit {
                    Some(limit) => format!(" and {limit} rad of slosh"),
                    None => String::new(),
                }
            );
        }
        let rpm = std::f64::consts::TAU / 60.0;
        let [_, low, high] = wheel.speeds;
        println!(
            "peak {:.3} N·m (the wheel gives {:.3}), wheel from {:.0} to {:.0} rpm (allowed {:.0} to {:.0}), \
             slosh angle up to {:.3} rad{}",
            self.peak,
            wheel.torque,
            self.speeds.0 / rpm,
            self.speeds.1 / rpm,
            low / rpm,
            high / rpm,
            self.angle,
            if self.angle > LINEAR {
                format!(" (linear theory ends at {LINEAR}: --slosh-angle limits it)")
            } else {
                String::new()
            }
        );
        let head = if self.sweep.is_some() { "sweep %" } else { "" };
        println!("{:20} {:>12} {:>12} {:>9} {head:>9}", "", "expected", "std, noise", "std %");
        for (k, (name, value, deviation)) in self.bounds.iter().enumerate() {
            // If the expected value is 0, the standard deviation cannot be given in per cent of it.
            let percent = |std: f64| match *value {
                0.0 => "-".to_string(),
                _ if !std.is_finite() => "-".to_string(),
                value => format!("{:.4}", 100.0 * std / value.abs()),
            };
            let other = self.sweep.as_ref().map_or(String::new(), |s| percent(s.bounds[k].2));
            println!(
                "{name:20} {value:>12.6} {:>12} {:>9} {other:>9}",
                estimates::deviation(*deviation),
                percent(*deviation)
            );
        }
        println!(
            "These bounds are not the intervals of a fit: they contain only the gyro's noise, and the shape of the friction curve is taken \
             as known. The standard deviations of identify also contain the tolerances of torque, clock and bench and the unknown \
             Stribeck curve, and are up to a hundred times larger."
        );
        if let Some(Sweep { profile, angle, bounds }) = &self.sweep {
            println!(
                "Mean standard deviation (geometric): multisine {:.4} %, linear sweep {:.4} % (slosh angle up to {angle:.3} rad).",
                100.0 * design::merit(&self.bounds),
                100.0 * design::merit(bounds)
            );
            println!(
                "Recommended: {}",
                match self.more_precise_sweep() {
                    Some(_) => format!("the sweep, --profile {profile}"),
                    None => "the multisine".into(),
                }
            );
        }
    }
}

impl DesignArgs {
    /// Prints the torque amplitude of a sine for which the gyro's samples have the signal-to-noise
    /// ratio `snr`, dB: at both ends of the band, at resonance and antiresonance, and for a rigid
    /// hub (section 8.6.1 of Rubaga's thesis). `limit` is the largest torque of the reaction wheel,
    /// N·m, and `real` returns the value of a parameter of the FMU.
    fn torque_for(
        &self,
        snr: f64,
        limit: f64,
        real: &mut dyn FnMut(&str) -> Result<f64>,
    ) -> Result<()> {
        let [f0, f1] = self.band[..] else { bail!("--band needs two frequencies, Hz") };
        ensure!(0.0 < f0 && f0 < f1 && f1.is_finite(), "--band = {f0},{f1} (allowed: 0 < f0 < f1)");
        ensure!(snr.abs() <= 200.0, "--snr = {snr} (allowed: -200 to 200 dB)");
        // Ratio in one sample: the power of the sine, Ω²/2, divided by the power of the noise, arw² times the sampling rate.
        let sigma = white_noise(real)?;
        let rate = sigma * std::f64::consts::SQRT_2 * 10f64.powf(snr / 20.0);
        let dry = real(friction::C)? + real(friction::D)?;
        // the dry friction is replaced by viscous friction with the same first harmonic at this rate (describing function)
        let mut bench = expected(real, 1.0)?;
        bench.friction =
            real(friction::B)? + real(hub::C)? + 4.0 * dry / (std::f64::consts::PI * rate);
        let torque = |f: f64| rate / bench.response(f).norm();
        let grid = analysis::logarithmic_grid((f0, f1), 2000);
        let needs = || grid.iter().map(|f| (torque(*f), *f));
        let least = needs().fold((f64::INFINITY, f0), |a, b| if b.0 < a.0 { b } else { a });
        let most = needs().fold((0.0, f0), |a, b| if b.0 > a.0 { b } else { a });
        let inertia =
            bench.inertia + bench.arm.powi(2) * bench.modes.iter().map(|m| m.mass).sum::<f64>();
        let rows = [
            ("lower end of the band", f0, torque(f0)),
            ("least, at the resonance", least.1, least.0),
            ("most", most.1, most.0),
            ("upper end of the band", f1, torque(f1)),
            ("upper end, rigid: I 2πf Ω", f1, inertia * std::f64::consts::TAU * f1 * rate),
        ];
        if self.json {
            let all = rows.map(|(what, f, torque)| {
                json!({ "what": what, "frequency": f, "torque": torque, "wheel": torque <= limit })
            });
            return terminal::print_json(
                &json!({ "snr": snr, "rate": rate, "wheel_torque": limit, "needs": all }),
            );
        }
        println!(
            "rate amplitude {rate:.3e} rad/s for {snr} dB in the gyro's samples (one has {sigma:.3e} rad/s)"
        );
        println!("{:28} {:>9} {:>11}", "", "Hz", "torque N·m");
        for (what, f, torque) in rows {
            let beyond = if torque > limit { "  more than the wheel gives" } else { "" };
            println!("{what:28} {f:>9.4} {torque:>11.5}{beyond}");
        }
        Ok(())
    }
}

/// Returns the expected bench as a linear model. The dry friction is replaced by a viscous friction
/// that dissipates the same power at one rate of the hub: the rate that a torque with the peak
/// `peak`, N·m (crest factor 3), causes far from resonance.
fn expected(real: &mut dyn FnMut(&str) -> Result<f64>, peak: f64) -> Result<Linear> {
    let arm = real(tank::R)?;
    let mode = Mode {
        mass: real(&slosh::MASS.element([1]))?,
        frequency: real(&slosh::FREQUENCY.element([1]))?,
        damping: real(&slosh::DAMPING.element([1]))?,
    };
    let inertia = real(hub::I)? + real(tank::M_0)? * arm * arm;
    let rate = peak / 3.0 / (inertia * std::f64::consts::TAU * mode.frequency);
    // The mean of |ω| for a normal distribution is sqrt(2/π) σ.
    let dry = real(friction::C)? + real(friction::D)?;
    let viscous = real(friction::B)? + real(hub::C)?;
    let friction = viscous + dry * (2.0 / std::f64::consts::PI).sqrt() / rate;
    Ok(Linear { inertia, friction, stiffness: real(hub::K)?, arm, modes: vec![mode] })
}

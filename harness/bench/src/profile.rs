//! Torque against time: named profiles with parameters, or the rows of a file.

use std::f64::consts::TAU;
use std::fmt;
use std::path::Path;
use std::str::FromStr;

use anyhow::{Context, Result, bail, ensure};

use crate::noise::Noise;
use crate::table::Table;
use host::description::did_you_mean;

/// A torque history with a formula. Times in s, frequencies in Hz, torques in N·m.
#[derive(Clone, Debug, PartialEq)]
pub enum Profile {
    /// A sin φ, φ = 2π f0 (e^{at} − 1)/a with a = ln(f1/f0)/T: the frequency changes exponentially
    /// (Rubaga's thesis 5.1.4), upwards or, with f1 < f0, downwards.
    ExpSweep {
        /// A, N·m.
        amplitude: f64,
        /// Frequency at the start, Hz.
        f0: f64,
        /// Frequency at the end, Hz.
        f1: f64,
        /// T, s.
        duration: f64,
    },
    /// A sin φ, φ = 2π (f0 t + s t²/2) with s = (f1 − f0)/T: the frequency changes evenly, upwards
    /// or downwards.
    LinSweep {
        /// A, N·m.
        amplitude: f64,
        /// Frequency at the start, Hz.
        f0: f64,
        /// Frequency at the end, Hz.
        f1: f64,
        /// T, s.
        duration: f64,
    },
    /// A sin 2πft: a dwell.
    Sine {
        /// A, N·m.
        amplitude: f64,
        /// f, Hz.
        frequency: f64,
        /// Length, s.
        duration: f64,
    },
    /// The same torque all the time.
    Constant {
        /// Torque, N·m.
        amplitude: f64,
        /// Length, s.
        duration: f64,
    },
    /// Torque from `start` to `start + width`, else none.
    Pulse {
        /// Torque, N·m.
        amplitude: f64,
        /// Beginning of the pulse, s.
        start: f64,
        /// Length of the pulse, s.
        width: f64,
        /// Length of the whole, s.
        duration: f64,
    },
    /// +A for `bang`, nothing for `stop`, −A for `bang`, then nothing (thesis 2.7.1): the hub is
    /// spun up, coasts, and is brought to rest.
    BangStopBang {
        /// A, N·m.
        amplitude: f64,
        /// Beginning of the first bang, s.
        start: f64,
        /// Length of either bang, s.
        bang: f64,
        /// Time between the bangs, s.
        stop: f64,
        /// Length of the whole, s.
        duration: f64,
    },
    /// The torque inertia · acceleration from `start` to `start + width`: what a wheel makes whose
    /// speed is ramped evenly (thesis 2.7.1). A hub of that inertia without friction, its liquid
    /// frozen, would have this acceleration; the bearing's friction is not made up for.
    AccelerationStep {
        /// Acceleration, rad/s².
        acceleration: f64,
        /// Inertia of hub and frozen liquid about the axis, kg·m².
        inertia: f64,
        /// Beginning of the step, s.
        start: f64,
        /// Length of the step, s.
        width: f64,
        /// Length of the whole, s.
        duration: f64,
    },
    /// Band-limited coloured noise.
    Noise(Noise),
    /// No torque.
    Zero {
        /// Length, s.
        duration: f64,
    },
}

/// Names, parameters and defaults of the profiles: what the parser takes and `--help` shows.
const PROFILES: &[(&str, &[(&str, f64)])] = &[
    ("exp-sweep", &[("amplitude", 0.1), ("f0", 1.25), ("f1", 3.5), ("duration", 2700.0)]),
    ("lin-sweep", &[("amplitude", 0.1), ("f0", 1.25), ("f1", 3.5), ("duration", 2700.0)]),
    ("sine", &[("amplitude", 0.1), ("frequency", 2.4), ("duration", 60.0)]),
    ("constant", &[("amplitude", 0.1), ("duration", 20.0)]),
    ("pulse", &[("amplitude", 0.05), ("start", 0.0), ("width", 1.0), ("duration", 20.0)]),
    (
        "bang-stop-bang",
        &[("amplitude", 0.1), ("start", 0.0), ("bang", 1.0), ("stop", 10.0), ("duration", 60.0)],
    ),
    (
        "acceleration-step",
        &[
            ("acceleration", 0.1),
            ("inertia", 0.428054), // hub.I + tank.m_liq tank.r² at the FMU's start values
            ("start", 1.0),
            ("width", 5.0),
            ("duration", 60.0),
        ],
    ),
    (
        "noise",
        &[
            ("rms", 0.05),
            ("f0", 1.25),
            ("f1", 3.5),
            ("exponent", 0.0),
            ("seed", 1.0),
            ("limit", 0.26), // the wheel's (thesis 5.1.3)
            ("duration", 600.0),
        ],
    ),
    ("zero", &[("duration", 20.0)]),
];

/// One line per profile, for `--help`.
pub fn help() -> String {
    let line = |(name, parameters): &(&str, &[(&str, f64)])| {
        let parameters: Vec<_> = parameters.iter().map(|(k, v)| format!("{k}={v}")).collect();
        format!("  {name}:{}\n", parameters.join(","))
    };
    PROFILES.iter().map(line).chain(["  file:path=FILE,hold=false\n".to_string()]).collect()
}

/// A profile as it was written, `name` or `name:key=value,key=value`: not yet looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    name: String,
    pairs: Vec<(String, String)>,
}

impl FromStr for Written {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> Result<Self> {
        let (name, rest) = text.split_once(':').unwrap_or((text, ""));
        let name = name.trim();
        let mut written = Written { name: name.into(), pairs: Vec::new() };
        for pair in rest.split(',').filter(|pair| !pair.trim().is_empty()) {
            let (key, value) = pair.split_once('=').with_context(|| {
                format!("profile {name}: \"{pair}\" is not of the form key=value")
            })?;
            let key = key.trim();
            ensure!(
                written.pairs.iter().all(|(k, _)| k != key),
                "profile {name}: {key} is given twice"
            );
            written.pairs.push((key.into(), value.trim().into()));
        }
        Ok(written)
    }
}

impl Written {
    /// Gives a parameter another value.
    pub fn set(&mut self, key: &str, value: &str) {
        self.pairs.retain(|(k, _)| k != key);
        self.pairs.push((key.into(), value.into()));
    }

    /// The torque it stands for; a file is read.
    pub fn torque(&self) -> Result<Torque> {
        if self.name == "file" { self.file() } else { Ok(Torque::Profile(self.profile()?)) }
    }

    /// The file that `file:path=…` names.
    pub fn path(&self) -> Option<&Path> {
        let path = self.pairs.iter().find(|(key, _)| key == "path");
        path.filter(|_| self.name == "file").map(|(_, path)| Path::new(path))
    }

    fn file(&self) -> Result<Torque> {
        let mut held = false;
        for (key, value) in &self.pairs {
            match (key.as_str(), value.as_str()) {
                ("path", _) => {}
                ("hold", "true" | "false") => held = value == "true",
                ("hold", _) => bail!("profile file: hold wants true or false, not \"{value}\""),
                _ => bail!("profile file has no parameter \"{key}\" (it has path, hold)"),
            }
        }
        let path = self.path().context("profile file: it wants path=FILE")?;
        Torque::read(path, held)
    }

    fn profile(&self) -> Result<Profile> {
        let name = self.name.as_str();
        let (name, defaults) = PROFILES.iter().find(|(n, _)| *n == name).with_context(|| {
            let names = PROFILES.iter().map(|(n, _)| *n).chain(["file"]);
            let all: Vec<_> = names.clone().collect();
            let hint = did_you_mean(name, names);
            format!("there is no profile \"{name}\" (there are {}){hint}", all.join(", "))
        })?;
        let mut problems = Vec::new();
        let mut values = defaults.to_vec();
        for (key, text) in &self.pairs {
            let Some(slot) = values.iter_mut().find(|(k, _)| k == key) else {
                let keys: Vec<_> = defaults.iter().map(|(k, _)| *k).collect();
                problems
                    .push(format!("it has no parameter \"{key}\" (it has {})", keys.join(", ")));
                continue;
            };
            match text.parse().ok().filter(|v: &f64| v.is_finite()) {
                Some(value) => slot.1 = value,
                None => problems.push(format!("{key} wants a number, not \"{text}\"")),
            }
        }
        let of = |key: &str| values.iter().find(|(k, _)| *k == key).map_or(0.0, |(_, v)| *v);
        let mut demand = |met: bool, what: &str| {
            if !met {
                problems.push(what.to_string());
            }
        };
        demand(of("duration") > 0.0, "duration must be positive");
        for key in ["start", "width", "bang", "stop"] {
            demand(of(key) >= 0.0, &format!("{key} must not be negative"));
        }
        if name.ends_with("sweep") {
            demand(of("f0") > 0.0 && of("f1") > 0.0, "f0 and f1 must be positive");
            demand(of("f0") != of("f1"), "f0 and f1 are equal; use sine");
            demand(of("amplitude") != 0.0, "amplitude must not be 0; use zero");
        }
        if *name == "noise" {
            demand(0.0 < of("f0") && of("f0") < of("f1"), "it wants 0 < f0 < f1");
            demand(
                of("rms") > 0.0 && of("rms") <= of("limit") / 2.0,
                "rms must be positive and at most half of limit (else too much of it is cut off)",
            );
            let seed = of("seed");
            demand(
                (0.0..=9e15).contains(&seed) && seed.fract() == 0.0,
                "seed wants a whole number from 0 to 9e15",
            );
            demand(of("exponent").abs() <= 10.0, "exponent must be from -10 to 10");
        }
        if *name == "acceleration-step" {
            demand(of("inertia") > 0.0, "inertia must be positive");
        }
        ensure!(problems.is_empty(), "profile {name}: {}", problems.join("; "));
        let (amplitude, start, duration) = (of("amplitude"), of("start"), of("duration"));
        let (f0, f1, width) = (of("f0"), of("f1"), of("width"));
        Ok(match *name {
            "exp-sweep" => Profile::ExpSweep { amplitude, f0, f1, duration },
            "lin-sweep" => Profile::LinSweep { amplitude, f0, f1, duration },
            "sine" => Profile::Sine { amplitude, frequency: of("frequency"), duration },
            "constant" => Profile::Constant { amplitude, duration },
            "pulse" => Profile::Pulse { amplitude, start, width, duration },
            "bang-stop-bang" => {
                let (bang, stop) = (of("bang"), of("stop"));
                Profile::BangStopBang { amplitude, start, bang, stop, duration }
            }
            "acceleration-step" => {
                let (acceleration, inertia) = (of("acceleration"), of("inertia"));
                Profile::AccelerationStep { acceleration, inertia, start, width, duration }
            }
            "noise" => {
                let (exponent, seed) = (of("exponent"), of("seed") as u64);
                let (rms, limit) = (of("rms"), of("limit"));
                Profile::Noise(Noise::new(rms, (f0, f1), exponent, seed, limit, duration))
            }
            _ => Profile::Zero { duration },
        })
    }
}

impl FromStr for Profile {
    type Err = anyhow::Error;

    /// `name` or `name:key=value,key=value`; what is not given has its default.
    fn from_str(text: &str) -> Result<Self> {
        text.parse::<Written>()?.profile()
    }
}

impl fmt::Display for Profile {
    /// The text that parses to this profile.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Profile::ExpSweep { amplitude, f0, f1, duration } => {
                write!(f, "exp-sweep:amplitude={amplitude},f0={f0},f1={f1},duration={duration}")
            }
            Profile::LinSweep { amplitude, f0, f1, duration } => {
                write!(f, "lin-sweep:amplitude={amplitude},f0={f0},f1={f1},duration={duration}")
            }
            Profile::Sine { amplitude, frequency, duration } => {
                write!(f, "sine:amplitude={amplitude},frequency={frequency},duration={duration}")
            }
            Profile::Constant { amplitude, duration } => {
                write!(f, "constant:amplitude={amplitude},duration={duration}")
            }
            Profile::Pulse { amplitude, start, width, duration } => write!(
                f,
                "pulse:amplitude={amplitude},start={start},width={width},duration={duration}"
            ),
            Profile::BangStopBang { amplitude, start, bang, stop, duration } => write!(
                f,
                "bang-stop-bang:amplitude={amplitude},start={start},bang={bang},stop={stop},duration={duration}"
            ),
            Profile::AccelerationStep { acceleration, inertia, start, width, duration } => write!(
                f,
                "acceleration-step:acceleration={acceleration},inertia={inertia},start={start},width={width},duration={duration}"
            ),
            Profile::Noise(Noise { rms, f0, f1, exponent, seed, limit, duration, .. }) => write!(
                f,
                "noise:rms={rms},f0={f0},f1={f1},exponent={exponent},seed={seed},limit={limit},duration={duration}"
            ),
            Profile::Zero { duration } => write!(f, "zero:duration={duration}"),
        }
    }
}

impl Profile {
    /// Length, s.
    pub fn duration(&self) -> f64 {
        match *self {
            Profile::ExpSweep { duration, .. }
            | Profile::LinSweep { duration, .. }
            | Profile::Sine { duration, .. }
            | Profile::Constant { duration, .. }
            | Profile::Pulse { duration, .. }
            | Profile::BangStopBang { duration, .. }
            | Profile::AccelerationStep { duration, .. }
            | Profile::Noise(Noise { duration, .. })
            | Profile::Zero { duration } => duration,
        }
    }

    /// Its parameter `amplitude`, N·m, if it has one.
    pub fn amplitude(&self) -> Option<f64> {
        match *self {
            Profile::ExpSweep { amplitude, .. }
            | Profile::LinSweep { amplitude, .. }
            | Profile::Sine { amplitude, .. }
            | Profile::Constant { amplitude, .. }
            | Profile::Pulse { amplitude, .. }
            | Profile::BangStopBang { amplitude, .. } => Some(amplitude),
            Profile::AccelerationStep { .. } | Profile::Noise(_) | Profile::Zero { .. } => None,
        }
    }

    /// Whether its frequency sweeps.
    pub fn is_sweep(&self) -> bool {
        matches!(self, Profile::ExpSweep { .. } | Profile::LinSweep { .. })
    }

    /// The frequencies it excites evenly enough for a frequency response, from and to, Hz; `None`
    /// if there are none.
    pub fn band(&self) -> Option<(f64, f64)> {
        match *self {
            Profile::ExpSweep { f0, f1, .. }
            | Profile::LinSweep { f0, f1, .. }
            | Profile::Noise(Noise { f0, f1, .. }) => Some((f0.min(f1), f0.max(f1))),
            _ => None,
        }
    }

    /// Phase φ(t), rad; 0 for profiles that do not oscillate.
    pub fn phase(&self, t: f64) -> f64 {
        match *self {
            Profile::ExpSweep { f0, f1, duration, .. } => {
                let a = (f1 / f0).ln() / duration;
                TAU * f0 * (a * t).exp_m1() / a
            }
            Profile::LinSweep { f0, f1, duration, .. } => {
                TAU * (f0 * t + (f1 - f0) / duration * t * t / 2.0)
            }
            Profile::Sine { frequency, .. } => TAU * frequency * t,
            _ => 0.0,
        }
    }

    /// The time at which a sweep passes `frequency` (Hz); `None` if it never does.
    pub fn time_of(&self, frequency: f64) -> Option<f64> {
        let (t, duration) = match *self {
            Profile::ExpSweep { f0, f1, duration, .. } => {
                ((frequency / f0).ln() * duration / (f1 / f0).ln(), duration)
            }
            Profile::LinSweep { f0, f1, duration, .. } => {
                ((frequency - f0) / (f1 - f0) * duration, duration)
            }
            _ => return None,
        };
        (-1e-9..=duration * (1.0 + 1e-12)).contains(&t).then_some(t)
    }

    /// df/dt of a sweep at `frequency`, Hz/s, negative downwards; 0 for the others.
    pub fn rate_at(&self, frequency: f64) -> f64 {
        match *self {
            Profile::ExpSweep { f0, f1, duration, .. } => frequency * (f1 / f0).ln() / duration,
            Profile::LinSweep { f0, f1, duration, .. } => (f1 - f0) / duration,
            _ => 0.0,
        }
    }

    /// Torque just after `t`, N·m.
    fn after(&self, t: f64) -> f64 {
        // a communication point k·H may lie an ulp beside the edge it is meant to be
        let slack = 1e-9 * (1.0 + t.abs());
        let within = |start: f64, width: f64| t >= start - slack && t < start + width - slack;
        match *self {
            Profile::ExpSweep { amplitude, .. }
            | Profile::LinSweep { amplitude, .. }
            | Profile::Sine { amplitude, .. } => amplitude * self.phase(t).sin(),
            Profile::Constant { amplitude, .. } => amplitude,
            Profile::Pulse { amplitude, start, width, .. } => {
                if within(start, width) {
                    amplitude
                } else {
                    0.0
                }
            }
            Profile::BangStopBang { amplitude, start, bang, stop, .. } => {
                if within(start, bang) {
                    amplitude
                } else if within(start + bang + stop, bang) {
                    -amplitude
                } else {
                    0.0
                }
            }
            Profile::AccelerationStep { acceleration, inertia, start, width, .. } => {
                if within(start, width) { inertia * acceleration } else { 0.0 }
            }
            Profile::Noise(ref noise) => noise.at(t),
            Profile::Zero { .. } => 0.0,
        }
    }

    /// Torque just before `t`, N·m; differs from [`Profile::after`] at a pulse's edges.
    fn before(&self, t: f64) -> f64 {
        match *self {
            Profile::Pulse { .. }
            | Profile::BangStopBang { .. }
            | Profile::AccelerationStep { .. } => self.after(t - 3e-9 * (1.0 + t.abs())),
            _ => self.after(t),
        }
    }
}

/// Where a run's torque comes from.
#[derive(Clone, Debug)]
pub enum Torque {
    /// A formula.
    Profile(Profile),
    /// The rows of a file: `time` (s, growing) and torque (N·m).
    Rows {
        /// Times, s.
        time: Vec<f64>,
        /// Torques, N·m.
        tau: Vec<f64>,
        /// Held from row to row (else linear between rows).
        held: bool,
    },
}

impl Torque {
    /// Reads the columns `time,tau_cmd` of a CSV or Parquet file.
    pub fn read(path: &Path, held: bool) -> Result<Self> {
        let table = Table::read(path, &["time", "tau_cmd"])?;
        let column = |name| table.column(name).unwrap_or_default().to_vec();
        let (time, tau) = (column("time"), column("tau_cmd"));
        let name = path.display();
        ensure!(time.len() >= 2, "{name} has {} rows; a torque history needs two", time.len());
        if let Some(row) = time.windows(2).position(|pair| pair[1] <= pair[0]) {
            bail!(
                "{name}, row {}: time goes from {} to {} s; it must grow",
                row + 2,
                time[row],
                time[row + 1]
            );
        }
        Ok(Torque::Rows { time, tau, held })
    }

    /// First and last time, s.
    pub fn span(&self) -> (f64, f64) {
        match self {
            Torque::Profile(profile) => (0.0, profile.duration()),
            Torque::Rows { time, .. } => (time[0], time[time.len() - 1]),
        }
    }

    /// Torque at `t`, N·m (at a jump: after it).
    pub fn at(&self, t: f64) -> f64 {
        match self {
            Torque::Profile(profile) => profile.after(t),
            Torque::Rows { time, tau, held } => {
                // communication points k·H may lie an ulp before the row they are meant to meet
                let slack = 1e-9 * (1.0 + t.abs());
                let next = time.partition_point(|row| *row <= t + slack);
                match next {
                    0 => tau[0],
                    n if n == time.len() || *held => tau[n - 1],
                    n => {
                        let part = (t - time[n - 1]) / (time[n] - time[n - 1]);
                        tau[n - 1] + (tau[n] - tau[n - 1]) * part
                    }
                }
            }
        }
    }

    /// Torque at the beginning of a step and the slope of the chord to its end, N·m and N·m/s.
    pub fn chord(&self, t: f64, step: f64) -> (f64, f64) {
        let begin = self.at(t);
        let end = match self {
            Torque::Profile(profile) => profile.before(t + step),
            Torque::Rows { held: true, .. } => begin,
            Torque::Rows { .. } => self.at(t + step),
        };
        (begin, (end - begin) / step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_profile_reads_back_from_its_own_text() {
        for (name, _) in PROFILES {
            let profile: Profile = name.parse().unwrap();
            assert_eq!(profile.to_string().parse::<Profile>().unwrap(), profile);
        }
    }

    #[test]
    fn wrong_profiles_are_refused_with_what_there_is() {
        for (text, word) in [
            ("exp-swep:f0=1", "did you mean \"exp-sweep\""),
            ("sine:freq=2", "it has amplitude, frequency, duration"),
            ("sine:frequency=2,frequency=3", "frequency is given twice"),
            ("lin-sweep:f0=0,duration=0", "duration must be positive; f0 and f1 must be positive"),
            ("exp-sweep:amplitude=0", "amplitude must not be 0"),
            ("pulse:width=-1", "width must not be negative"),
            ("noise:rms=0.2", "at most half of limit"),
            ("noise:f0=3,f1=2,seed=0.5", "it wants 0 < f0 < f1; seed wants a whole number"),
            ("acceleration-step:inertia=0", "inertia must be positive"),
            ("sine:frequency=fast", "wants a number"),
            ("sine:amplitude=NaN", "wants a number"),
            ("zero:duration=0", "must be positive"),
        ] {
            let error = text.parse::<Profile>().unwrap_err().to_string();
            assert!(error.contains(word), "{text}: {error}");
        }
    }

    #[test]
    fn the_sweeps_have_the_cycles_of_the_thesis() {
        // 5900.24 and 6412.5 cycles from 1.25 to 3.5 Hz in 2700 s, by hand from the formulas
        for (name, cycles) in [("exp-sweep", 5900.24), ("lin-sweep", 6412.5)] {
            let sweep: Profile = name.parse().unwrap();
            assert!((sweep.phase(2700.0) / TAU - cycles).abs() < 5e-3, "{name}");
            let t = sweep.time_of(2.4).unwrap();
            let f = (sweep.phase(t + 1e-3) - sweep.phase(t - 1e-3)) / 2e-3 / TAU;
            assert!((f - 2.4).abs() < 1e-7, "{name}: the frequency is the phase's derivative");
        }
    }

    #[test]
    fn a_downward_sweep_is_the_upward_one_run_backwards() {
        for kind in ["exp-sweep", "lin-sweep"] {
            let sweep = |f0: f64, f1: f64| -> Profile {
                format!("{kind}:f0={f0},f1={f1},duration=100").parse().unwrap()
            };
            let (up, down) = (sweep(1.25, 3.5), sweep(3.5, 1.25));
            assert_eq!(down.band(), Some((1.25, 3.5)));
            for f in [1.25, 2.0, 3.5] {
                let (t_up, t_down) = (up.time_of(f).unwrap(), down.time_of(f).unwrap());
                // rounding of times up to 100 s, of phases up to 1500 rad
                assert!((t_up + t_down - 100.0).abs() < 1e-11, "{kind}, {f} Hz");
                assert!((up.rate_at(f) + down.rate_at(f)).abs() < 1e-15);
                let behind = up.phase(100.0) - up.phase(t_up);
                assert!((down.phase(t_down) - behind).abs() < 1e-9, "{kind}, {f} Hz");
            }
        }
    }

    #[test]
    fn bang_stop_bang_takes_back_all_the_momentum_it_gave() {
        let text = "bang-stop-bang:amplitude=0.1,start=0.1,bang=0.3,stop=0.5,duration=2";
        let torque = Torque::Profile(text.parse().unwrap());
        let mut momentum: f64 = 0.0;
        for k in 0..100 {
            let (tau, slope) = torque.chord(k as f64 * 0.02, 0.02);
            let expected = match k {
                5..20 => 0.1,
                45..60 => -0.1,
                _ => 0.0,
            };
            assert_eq!((tau, slope), (expected, 0.0), "step {k}");
            momentum += tau * 0.02;
        }
        assert!(momentum.abs() < 1e-15);
    }

    #[test]
    fn an_acceleration_step_is_inertia_times_acceleration() {
        let text = "acceleration-step:acceleration=0.5,inertia=0.4,start=1,width=2,duration=5";
        let torque = Torque::Profile(text.parse().unwrap());
        assert_eq!([0.5, 1.0, 2.9, 3.0].map(|t| torque.at(t)), [0.0, 0.2, 0.2, 0.0]);
    }

    #[test]
    fn a_torque_file_can_be_named_as_a_profile() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("torque.csv");
        std::fs::write(&path, "time,tau_cmd\n0,0\n1,2\n").unwrap();
        let torque = |rest: &str| {
            format!("file:path={}{rest}", path.display()).parse::<Written>().unwrap().torque()
        };
        assert_eq!(torque("").unwrap().at(0.5), 1.0);
        assert_eq!(torque(",hold=true").unwrap().at(0.5), 0.0);
        let error = torque(",hold=maybe").unwrap_err().to_string();
        assert!(error.contains("hold wants true or false"), "{error}");
        let error = "file".parse::<Written>().unwrap().torque().unwrap_err().to_string();
        assert!(error.contains("path=FILE"), "{error}");
    }

    #[test]
    fn a_pulse_has_no_ramps() {
        let pulse = Torque::Profile("pulse:amplitude=2,start=0.1,width=0.3".parse().unwrap());
        for k in 0..50 {
            let (t, step) = (k as f64 * 0.02, 0.02);
            let (tau, slope) = pulse.chord(t, step);
            assert_eq!(slope, 0.0, "at {t}");
            assert_eq!(tau, if (5..20).contains(&k) { 2.0 } else { 0.0 }, "at {t}");
        }
    }

    #[test]
    fn rows_are_joined_by_lines_or_held() {
        let rows =
            |held| Torque::Rows { time: vec![0.0, 1.0, 3.0], tau: vec![0.0, 2.0, 0.0], held };
        assert_eq!((rows(false).at(0.5), rows(false).at(2.0)), (1.0, 1.0));
        assert_eq!((rows(true).at(0.5), rows(true).at(2.0)), (0.0, 2.0));
        assert_eq!(rows(false).chord(0.0, 0.5), (0.0, 2.0));
        assert_eq!(rows(true).chord(1.0, 2.0), (2.0, 0.0));
        assert_eq!(rows(false).at(9.0), 0.0);
    }
}

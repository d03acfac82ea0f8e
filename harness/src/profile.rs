//! Torque against time: named profiles with parameters, or the rows of a file.

use std::f64::consts::TAU;
use std::fmt;
use std::path::Path;
use std::str::FromStr;

use anyhow::{Context, Result, bail, ensure};

use crate::description::did_you_mean;
use crate::table::Table;

/// A torque history with a formula. Times in s, frequencies in Hz, torques in N·m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// A sin φ, φ = 2π f0 (e^{at} − 1)/a with a = ln(f1/f0)/T: the frequency grows exponentially
    /// (Rubaga's thesis 5.1.4).
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
    /// A sin φ, φ = 2π (f0 t + s t²/2) with s = (f1 − f0)/T: the frequency grows evenly.
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
    ("zero", &[("duration", 20.0)]),
];

/// One line per profile, for `--help`.
pub fn help() -> String {
    let line = |(name, parameters): &(&str, &[(&str, f64)])| {
        let parameters: Vec<_> = parameters.iter().map(|(k, v)| format!("{k}={v}")).collect();
        format!("  {name}:{}\n", parameters.join(","))
    };
    PROFILES.iter().map(line).collect()
}

impl FromStr for Profile {
    type Err = anyhow::Error;

    /// `name` or `name:key=value,key=value`; what is not given has its default.
    fn from_str(text: &str) -> Result<Self> {
        let (name, rest) = text.split_once(':').unwrap_or((text, ""));
        let (name, defaults) = PROFILES.iter().find(|(n, _)| *n == name).with_context(|| {
            let names = PROFILES.iter().map(|(n, _)| *n);
            let all: Vec<_> = names.clone().collect();
            let hint = did_you_mean(name, names);
            format!("there is no profile \"{name}\" (there are {}){hint}", all.join(", "))
        })?;
        let mut values = defaults.to_vec();
        for pair in rest.split(',').filter(|pair| !pair.is_empty()) {
            let (key, value) = pair.split_once('=').with_context(|| {
                format!("profile {name}: \"{pair}\" is not of the form key=value")
            })?;
            let keys: Vec<_> = defaults.iter().map(|(k, _)| *k).collect();
            let slot = values.iter_mut().find(|(k, _)| *k == key.trim()).with_context(|| {
                format!("profile {name} has no parameter \"{key}\" (it has {})", keys.join(", "))
            })?;
            slot.1 =
                value.trim().parse().ok().filter(|v: &f64| v.is_finite()).with_context(|| {
                    format!("profile {name}: {key} wants a number, not \"{value}\"")
                })?;
        }
        let of = |key: &str| values.iter().find(|(k, _)| *k == key).map_or(0.0, |(_, v)| *v);
        let (amplitude, duration) = (of("amplitude"), of("duration"));
        ensure!(duration > 0.0, "profile {name}: duration must be positive");
        if name.ends_with("sweep") {
            ensure!(of("f0") > 0.0 && of("f1") > 0.0, "profile {name}: f0 and f1 must be positive");
            ensure!(of("f0") != of("f1"), "profile {name}: f0 and f1 are equal; use sine");
        }
        Ok(match *name {
            "exp-sweep" => Profile::ExpSweep { amplitude, f0: of("f0"), f1: of("f1"), duration },
            "lin-sweep" => Profile::LinSweep { amplitude, f0: of("f0"), f1: of("f1"), duration },
            "sine" => Profile::Sine { amplitude, frequency: of("frequency"), duration },
            "constant" => Profile::Constant { amplitude, duration },
            "pulse" => {
                Profile::Pulse { amplitude, start: of("start"), width: of("width"), duration }
            }
            _ => Profile::Zero { duration },
        })
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
            | Profile::Zero { duration } => duration,
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

    /// df/dt of a sweep at `frequency`, Hz/s; 0 for the others.
    pub fn rate_at(&self, frequency: f64) -> f64 {
        match *self {
            Profile::ExpSweep { f0, f1, duration, .. } => frequency * (f1 / f0).ln() / duration,
            Profile::LinSweep { f0, f1, duration, .. } => (f1 - f0) / duration,
            _ => 0.0,
        }
    }

    /// Torque just after `t`, N·m.
    fn after(&self, t: f64) -> f64 {
        match *self {
            Profile::ExpSweep { amplitude, .. }
            | Profile::LinSweep { amplitude, .. }
            | Profile::Sine { amplitude, .. } => amplitude * self.phase(t).sin(),
            Profile::Constant { amplitude, .. } => amplitude,
            Profile::Pulse { amplitude, start, width, .. } => {
                // a communication point k·H may lie an ulp beside the edge it is meant to be
                let slack = 1e-9 * (1.0 + t.abs());
                if t >= start - slack && t < start + width - slack { amplitude } else { 0.0 }
            }
            Profile::Zero { .. } => 0.0,
        }
    }

    /// Torque just before `t`, N·m; differs from [`Profile::after`] at a pulse's edges.
    fn before(&self, t: f64) -> f64 {
        match *self {
            Profile::Pulse { .. } => self.after(t - 3e-9 * (1.0 + t.abs())),
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

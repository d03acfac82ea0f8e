//! Torque as a function of time: named profiles with parameters ([`KINDS`]), or the rows of a file.

mod kinds;
mod noise;
mod shape;

use std::borrow::Cow;
use std::fmt;
use std::path::Path;
use std::str::FromStr;
use std::sync::Arc;

use anyhow::{Context, Result, bail, ensure};
use files::budget;
use host::description::did_you_mean;
use host::schedule::History;
use names::hubslosh::TAU_CMD;
use serde_json::json;

pub(crate) use self::kinds::parameter;
pub use self::kinds::{Allowed, FILE, KINDS, Kind, Parameter};
pub use self::noise::TONES;
pub use self::shape::Shape;
use analysis::sweep::Sweep;
use signals::recording::{self, Between, Columns, Signal, Wanted};

/// A torque history that is given by a formula: an entry of [`KINDS`] with values of its parameters.
#[derive(Clone, Debug)]
pub struct Profile {
    kind: &'static Kind,
    values: Vec<f64>,
    shape: Arc<dyn Shape>,
}

pub struct Values<'a> {
    kind: &'a Kind,
    values: &'a [f64],
}

impl Values<'_> {
    pub fn value(&self, name: &str) -> f64 {
        self.get(name).unwrap_or_else(|| panic!("{} has no {name}", self.kind.name))
    }

    fn get(&self, name: &str) -> Option<f64> {
        let place = self.kind.parameters.iter().position(|p| p.name == name)?;
        Some(self.values[place])
    }
}

impl Kind {
    fn written(&self, values: &[f64]) -> String {
        let pairs = self.parameters.iter().zip(values);
        let pairs: Vec<_> = pairs.map(|(p, value)| format!("{}={value}", p.name)).collect();
        format!("{}:{}", self.name, pairs.join(","))
    }

    fn defaults(&self) -> Vec<f64> {
        self.parameters.iter().map(|parameter| parameter.default).collect()
    }
}

pub fn help() -> String {
    let all = KINDS.iter().map(|kind| (kind.written(&kind.defaults()), kind.description));
    all.chain([(FILE.0.into(), FILE.1)])
        .map(|(written, description)| {
            format!("  {written}\n      {}\n", description.replace('`', ""))
        })
        .collect()
}

pub fn table() -> String {
    let mut text =
        String::from("| profile, with its defaults | torque | units |\n| --- | --- | --- |\n");
    for kind in KINDS {
        let units = kind.parameters.iter().filter(|p| !p.unit.is_empty());
        let units: Vec<_> = units.map(|p| format!("{} {}", p.name, p.unit)).collect();
        let written = kind.written(&kind.defaults());
        text.push_str(&format!("| `{written}` | {} | {} |\n", kind.description, units.join(", ")));
    }
    text.push_str(&format!("| `{}` | {} | s, N·m |\n", FILE.0, FILE.1));
    text
}

pub fn list() -> Vec<serde_json::Value> {
    let parameter =
        |p: &kinds::Parameter| json!({ "name": p.name, "unit": p.unit, "default": p.default });
    let profile = |kind: &kinds::Kind| {
        json!({
            "profile": kind.name,
            "torque": kind.description,
            "parameters": kind.parameters.iter().map(parameter).collect::<Vec<_>>(),
        })
    };
    KINDS.iter().map(profile).collect()
}

/// The text of a profile, `name` or `name:key=value,key=value`, split into its parts but not yet checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    name: String,
    pairs: Vec<(String, String)>,
}

impl FromStr for Written {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> Result<Self> {
        Written::read("profile", text)
    }
}

impl Written {
    pub(crate) fn read(what: &str, text: &str) -> Result<Self> {
        let (name, rest) = text.split_once(':').unwrap_or((text, ""));
        let name = name.trim();
        let mut written = Written { name: name.into(), pairs: Vec::new() };
        // A comma within brackets belongs to a name, such as p[1,2], and does not separate pairs.
        let mut depth = 0i32;
        let pairs = rest.split(|c| {
            depth += i32::from(c == '[') - i32::from(c == ']');
            c == ',' && depth == 0
        });
        for pair in pairs.filter(|pair| !pair.trim().is_empty()) {
            let (key, value) = pair.split_once('=').with_context(|| {
                format!("{what} {name}: \"{pair}\" is not of the form key=value")
            })?;
            let key = key.trim();
            ensure!(
                written.pairs.iter().all(|(k, _)| k != key),
                "{what} {name}: {key} is given twice"
            );
            written.pairs.push((key.into(), value.trim().into()));
        }
        Ok(written)
    }
}

impl fmt::Display for Written {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let pairs: Vec<_> =
            self.pairs.iter().map(|(key, value)| format!("{key}={value}")).collect();
        write!(f, "{}:{}", self.name, pairs.join(","))
    }
}

impl Written {
    pub fn set(&mut self, key: &str, value: &str) {
        self.pairs.retain(|(k, _)| k != key);
        self.pairs.push((key.into(), value.into()));
    }

    /// Creates the torque. If the profile is `file`, reads the file.
    ///
    /// # Errors
    /// If there is no such profile, a parameter is unknown or not allowed, or the file cannot be read.
    pub fn torque(&self) -> Result<Torque> {
        if self.name == "file" { self.file() } else { Ok(Torque::Profile(self.profile()?)) }
    }

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
                ("hold", _) => bail!("profile file: hold must be true or false, not \"{value}\""),
                _ => bail!("profile file has no parameter \"{key}\" (allowed: path, hold)"),
            }
        }
        let path = self.path().context("profile file: path=FILE is required")?;
        Torque::read(path, held)
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn take(&mut self, key: &str) -> Option<String> {
        let place = self.pairs.iter().position(|(k, _)| k == key)?;
        Some(self.pairs.remove(place).1)
    }

    /// Returns the values of `parameters` in their order, with defaults for those that the text does not give, and a
    /// list of everything that is wrong with the text.
    pub(crate) fn values(&self, parameters: &[Parameter]) -> (Vec<f64>, Vec<String>) {
        let mut values: Vec<f64> = parameters.iter().map(|p| p.default).collect();
        let mut problems = Vec::new();
        for (key, text) in &self.pairs {
            let Some(place) = parameters.iter().position(|p| p.name == key) else {
                let names: Vec<_> = parameters.iter().map(|p| p.name).collect();
                problems.push(format!(
                    "there is no parameter \"{key}\" (allowed: {})",
                    names.join(", ")
                ));
                continue;
            };
            match parameters[place].number(text).filter(|v| v.is_finite()) {
                Some(value) => values[place] = value,
                None => problems.push(format!("{key} expects a number, not \"{text}\"")),
            }
        }
        for (parameter, value) in parameters.iter().zip(&values) {
            let fault = parameter.allowed.fault(*value);
            problems.extend(fault.map(|fault| format!("{} {fault}", parameter.name)));
        }
        (values, problems)
    }

    fn profile(&self) -> Result<Profile> {
        let name = self.name.as_str();
        let kind = KINDS.iter().find(|kind| kind.name == name).with_context(|| {
            let names = KINDS.iter().map(|kind| kind.name).chain(["file"]);
            let all: Vec<_> = names.clone().collect();
            let hint = did_you_mean(name, names);
            format!("there is no profile \"{name}\" (there are {}){hint}", all.join(", "))
        })?;
        let (values, mut problems) = self.values(kind.parameters);
        let given = Values { kind, values: &values };
        let unmet = kind.demands.iter().filter(|(met, _)| !met(&given));
        problems.extend(unmet.map(|(_, demand)| demand.to_string()));
        ensure!(problems.is_empty(), "profile {name}: {}", problems.join("; "));
        let shape = (kind.shape)(&given);
        Ok(Profile { kind, values, shape })
    }
}

impl FromStr for Profile {
    type Err = anyhow::Error;

    /// Parses `name` or `name:key=value,key=value`; other parameters have their defaults.
    fn from_str(text: &str) -> Result<Self> {
        text.parse::<Written>()?.profile()
    }
}

impl fmt::Display for Profile {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.kind.written(&self.values))
    }
}

impl PartialEq for Profile {
    fn eq(&self, other: &Self) -> bool {
        self.kind.name == other.kind.name && self.values == other.values
    }
}

impl Profile {
    fn get(&self, name: &str) -> Option<f64> {
        Values { kind: self.kind, values: &self.values }.get(name)
    }

    pub fn parameter(&self, name: &str) -> Option<&'static Parameter> {
        self.kind.parameters.iter().find(|parameter| parameter.name == name)
    }

    pub fn duration(&self) -> f64 {
        self.get("duration").unwrap_or(0.0)
    }

    pub fn amplitude(&self) -> Option<f64> {
        self.get("amplitude")
    }

    pub fn frequency(&self) -> Option<f64> {
        self.get("frequency")
    }

    pub fn sweep(&self) -> Option<&Sweep> {
        self.shape.sweep()
    }

    /// Returns the lowest and highest frequency (Hz) of the band that the torque excites uniformly enough for a
    /// frequency response; `None` for torques without such a band.
    pub fn band(&self) -> Option<(f64, f64)> {
        self.shape.band()
    }
}

/// Time between two torque commands of a profile, s, if the user does not state it: 50 Hz, as on the thesis's bench.
pub const SAMPLE: f64 = 0.02;
/// Largest error of linear interpolation between the commands of a profile, relative to its amplitude, at which the
/// user's interval between commands is kept. For a sine of frequency f the error is (2π f · interval)²/8. The value
/// allows the thesis's sweeps up to 3.5 Hz to be commanded at 50 Hz.
pub const COARSEST: f64 = 0.025;
/// Allowed error of linear interpolation between the torque commands of a profile, relative to its amplitude, if the
/// user's interval between commands is too long. The interval is too long if its error exceeds [`COARSEST`]; it is
/// then divided until the error is at most this value.
const FINEST: f64 = 0.001;

/// Returns the largest product of frequency and interval (cycles) at which linear interpolation of a sine has at most
/// the error `error`, relative to its amplitude.
pub fn cycles(error: f64) -> f64 {
    (8.0 * error).sqrt() / std::f64::consts::TAU
}

#[derive(Clone, Debug)]
pub enum Torque {
    Profile(Profile),
    /// Rows of time (s) and torque (N·m), each held until the next row, or interpolated linearly.
    Rows {
        history: History,
        held: bool,
    },
}

impl Torque {
    /// Reads the columns `time` (s) and `tau_cmd` (N·m) of a file. Between rows the torque is
    /// `held` or interpolated linearly.
    ///
    /// # Errors
    /// If the file cannot be read as a history of inputs.
    pub fn read(path: &Path, held: bool) -> Result<Self> {
        let signal =
            Signal { name: TAU_CMD, required: true, between: Between::Missing, unit: None };
        let wanted = Wanted { signals: &[signal], columns: &Columns::default() };
        let table = recording::read_inputs(path, &wanted, &[], &mut |_| {})?;
        let column = |name| table.column(name).unwrap_or_default();
        Torque::rows(column("time"), column(TAU_CMD), None, held)
            .with_context(|| format!("the file {} cannot be used", path.display()))
    }

    /// Creates a torque from rows of time (s) and torque (N·m). With `slopes` (N·m/s) the torque follows the slope of
    /// each row until the next row, and may jump there.
    ///
    /// # Errors
    /// If there are no rows, or the times do not increase.
    pub fn rows(time: &[f64], tau: &[f64], slopes: Option<&[f64]>, held: bool) -> Result<Self> {
        let slopes = slopes.map(<[f64]>::to_vec);
        Ok(Torque::Rows { history: History::new(time.to_vec(), tau.to_vec(), slopes, held)?, held })
    }

    pub fn profile(&self) -> Option<&Profile> {
        match self {
            Torque::Profile(profile) => Some(profile),
            Torque::Rows { .. } => None,
        }
    }

    pub fn span(&self) -> (f64, f64) {
        match self {
            Torque::Profile(profile) => (0.0, profile.duration()),
            Torque::Rows { history, .. } => {
                let time = history.time();
                (time[0], time[time.len() - 1])
            }
        }
    }

    /// Returns the torque at `t` (s), N·m. At a jump it is the value after the jump.
    pub fn torque_at(&self, t: f64) -> f64 {
        match self {
            Torque::Profile(profile) => profile.shape.torque_after(t),
            // Communication points k·H may be one rounding error before the row with the same time.
            Torque::Rows { history, .. } => history.near(t),
        }
    }

    /// Returns the torque until `stop` (s) as rows, between which it is interpolated linearly or held. The rows of a
    /// file are unchanged. A profile has rows at its edges; a profile that oscillates also has a row every `sample`
    /// seconds. If the error of linear interpolation would exceed 2.5 % of the amplitude, `sample` is divided so that
    /// the error is at most 0.1 %. Held rows are never divided.
    ///
    /// # Errors
    /// If there would be more than [`budget::ROWS`] rows, or the profile has frequencies above half of the
    /// rate of held rows.
    pub fn history(&self, sample: f64, stop: f64, hold: bool) -> Result<Cow<'_, History>> {
        match self {
            Torque::Rows { history, .. } if hold => Ok(Cow::Owned(history.held())),
            Torque::Rows { history, .. } => Ok(Cow::Borrowed(history)),
            Torque::Profile(profile) => profile.history(sample, stop, hold).map(Cow::Owned),
        }
    }

    /// Returns the number of rows of [`Torque::history`] without creating them.
    ///
    /// # Errors
    /// If the profile has more commands than allowed, or frequencies that are too high for the
    /// commands, as for [`Torque::history`].
    pub fn row_count(&self, sample: f64, stop: f64, hold: bool) -> Result<usize> {
        Ok(match self {
            Torque::Rows { history, .. } => history.time().len(),
            Torque::Profile(profile) => match profile.commands(sample, stop, hold)? {
                Some((intervals, _)) => intervals.ceil() as usize + 1,
                None => profile.shape.edges().len() + 2,
            },
        })
    }

    /// Checks that rows `step` s apart can represent the torque.
    ///
    /// # Errors
    /// If its highest frequency is half of the rows' rate or more.
    pub fn check_rows(&self, step: f64, stop: f64) -> Result<()> {
        let Torque::Profile(profile) = self else { return Ok(()) };
        let highest = profile.shape.highest(stop);
        ensure!(
            highest * step < 0.5,
            "{profile} reaches {highest} Hz, which rows {step} s apart cannot show (allowed: a step below {:.3e} s)",
            0.5 / highest
        );
        Ok(())
    }
}

impl Profile {
    /// Returns two numbers: the number of intervals between torque commands up to the time `stop` (s), which may end
    /// within an interval, and the number of parts into which each interval `sample` (s) is divided. Returns `None`
    /// if the torque needs no commands, because it is constant between its edges.
    fn commands(&self, sample: f64, stop: f64, hold: bool) -> Result<Option<(f64, usize)>> {
        let highest = self.shape.highest(stop);
        if highest == 0.0 {
            return Ok(None);
        }
        ensure!(
            sample > 0.0 && sample.is_finite(),
            "the interval of the torque's commands must be a positive number of seconds, not {sample}"
        );
        let parts = match highest * sample {
            turns if hold => {
                ensure!(
                    turns < 0.5,
                    "{self} reaches {highest} Hz, which commands held for {sample} s cannot follow (allowed: an interval below \
                     {:.3e} s)",
                    0.5 / highest
                );
                1.0
            }
            turns if turns <= cycles(COARSEST) => 1.0,
            turns => (turns / cycles(FINEST)).ceil(),
        };
        let intervals = stop / sample * parts;
        let most = budget::ROWS as f64;
        ensure!(
            intervals <= most,
            "{self} takes {intervals:.3e} commands until {stop} s, because it reaches {highest} Hz or is commanded every {sample} s \
             (allowed: at most {most}). A length of up to {:.3e} s, or a frequency of up to {:.4e} Hz, is possible",
            stop * most / intervals,
            most / stop * cycles(FINEST)
        );
        Ok(Some((intervals, parts as usize)))
    }

    fn history(&self, sample: f64, stop: f64, hold: bool) -> Result<History> {
        let (mut time, mut values) = (vec![0.0], vec![self.shape.torque_after(0.0)]);
        let mut row = |t: f64| {
            time.push(t);
            values.push(self.shape.torque_after(t));
        };
        let Some((intervals, parts)) = self.commands(sample, stop, hold)? else {
            let mut edges = self.shape.edges();
            edges.sort_by(f64::total_cmp);
            let mut last = 0.0;
            for edge in edges {
                // Two edges whose times differ only by rounding are one edge.
                let apart = 1e-9 * (1.0 + edge.abs());
                if edge > last + apart && edge < stop - apart {
                    row(edge);
                    last = edge;
                }
            }
            row(stop);
            return History::new(time, values, None, true);
        };
        let command =
            |k: usize| (k / parts) as f64 * sample + (k % parts) as f64 * (sample / parts as f64);
        let whole = (intervals - intervals.round()).abs() < 1e-6;
        let last = if whole { intervals.round() } else { intervals.ceil() }.max(1.0) as usize;
        (1..last).for_each(|k| row(command(k)));
        // The last row is the first command after the stop time, so that the torque does not depend on the
        // end of the run.
        row(if whole { stop } else { command(last) });
        History::new(time, values, None, hold)
    }
}

#[cfg(test)]
mod tests {
    use super::kinds::KINDS;
    use super::{Profile, Torque, Written, table};

    #[test]
    fn documentation_lists_the_profiles() {
        let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../book/campaigns.md");
        let page = std::fs::read_to_string(page).unwrap();
        assert!(
            page.contains(&table()),
            "campaigns.md is out of date: put what `hubslosh torque --profiles` prints under \"Profiles\""
        );
    }

    #[test]
    fn a_profile_that_is_written_and_parsed_again_is_unchanged() {
        for kind in KINDS {
            let profile: Profile = kind.name.parse().unwrap();
            assert_eq!(profile.to_string().parse::<Profile>().unwrap(), profile);
            assert!(profile.duration() > 0.0, "{} has a duration", kind.name);
        }
    }

    /// A linear sweep from 0 Hz has the phase φ = π f1 t²/T. With f1 = 4 Hz and T = 8 s, the first quarter of a cycle
    /// ends at t = 1 s, and the first whole cycle at 2 s, when the frequency is 1 Hz.
    #[test]
    fn a_linear_sweep_begins_at_zero_hertz() {
        let profile: Profile = "lin-sweep:amplitude=2,f0=0,f1=4,duration=8".parse().unwrap();
        let torque = Torque::Profile(profile.clone());
        for (t, tau) in [(0.0, 0.0), (1.0, 2.0), (2f64.sqrt(), 0.0), (2.0, 0.0)] {
            assert!((torque.torque_at(t) - tau).abs() < 1e-14, "{t} s");
        }
        assert_eq!(profile.band(), Some((1.0, 4.0)));
        assert_eq!(profile.to_string().parse::<Profile>().unwrap(), profile);
    }

    #[test]
    fn wrong_profiles_are_refused_with_the_allowed_names_and_values() {
        for (text, word) in [
            ("exp-swep:f0=1", "did you mean \"exp-sweep\""),
            ("sine:freq=2", "(allowed: amplitude, frequency, duration)"),
            ("sine:frequency=2,frequency=3", "frequency is given twice"),
            ("exp-sweep:f0=0,duration=0", "f0 must be positive; duration must be positive"),
            ("lin-sweep:f0=-1", "f0 must not be negative"),
            ("lin-sweep:f0=1,f1=0", "f1 must be positive"),
            ("exp-sweep:f0=1e-320", "f0 and f1 must be from 1e-9 to 1e9 Hz"),
            ("lin-sweep:f1=1e300", "f0 must be 0 or, as f1, from 1e-9 to 1e9 Hz"),
            ("noise:f0=1e-300", "f0 must be 0 or, as f1, from 1e-9 to 1e9 Hz"),
            ("sine:frequency=1e308", "frequency must be from -1000000000 to 1000000000"),
            ("exp-sweep:amplitude=0", "amplitude must not be 0"),
            ("pulse:width=-1", "width must not be negative"),
            ("noise:rms=0.2", "at most half of limit"),
            ("sine-noise:rms=0.09", "must be within limit"),
            (
                "noise:f0=3,f1=2,seed=0.5",
                "seed expects a whole number from 0 to 9e15; f0 must be less than f1",
            ),
            ("acceleration-step:inertia=0", "inertia must be positive"),
            ("sine:frequency=fast", "expects a number"),
            ("sine:amplitude=NaN", "expects a number"),
            ("zero:duration=0", "must be positive"),
        ] {
            let error = text.parse::<Profile>().unwrap_err().to_string();
            assert!(error.contains(word), "{text}: {error}");
        }
    }

    fn rows(text: &str, sample: f64, stop: f64, hold: bool) -> Vec<(f64, f64)> {
        let torque = Torque::Profile(text.parse().unwrap());
        let history = torque.history(sample, stop, hold).unwrap();
        history.time().iter().map(|t| (*t, history.after(*t).0)).collect()
    }

    /// A profile of two pulses is sampled every 20 ms. The torque history has rows at the edges, so that
    /// its impulse is exact.
    #[test]
    fn edges_of_a_profile_are_rows_at_their_exact_times() {
        let text = "bang-stop-bang:amplitude=0.1,start=0.1,bang=0.3,stop=0.5,duration=2";
        let torque = Torque::Profile(text.parse().unwrap());
        let history = torque.history(0.02, 2.0, false).unwrap();
        assert!(history.is_held());
        let momentum: f64 = (0..history.time().len() - 1)
            .map(|k| {
                let t = history.time()[k];
                history.after(t).0 * (history.time()[k + 1] - t)
            })
            .sum();
        assert!(momentum.abs() < 1e-15);
        let found = rows(text, 0.02, 2.0, false);
        assert_eq!(found.len(), 6, "{found:?}");
        let pulse = "pulse:amplitude=2,start=0.005,width=0.01";
        let expected = [(0.0, 0.0), (0.005, 2.0), (0.015, 0.0), (1.0, 0.0)];
        assert_eq!(rows(pulse, 0.02, 1.0, false), expected);
        assert_eq!(rows(pulse, 0.02, 1.0, true), expected);
        // a pulse with one edge at the start and the other at the end of the history
        let pulse = "pulse:amplitude=2,start=0,width=1";
        assert_eq!(rows(pulse, 0.02, 1.0, false), [(0.0, 2.0), (1.0, 0.0)]);
    }

    /// The thesis's sweeps are commanded at 50 Hz: linear interpolation over 0.02 s has an error of (0.44)²/8 = 2.4 %
    /// of the amplitude at 3.5 Hz.
    #[test]
    fn the_error_of_linear_interpolation_between_commands_is_limited_at_any_frequency() {
        for (text, count, error) in [
            ("exp-sweep:amplitude=1,duration=20", 1000, 0.025),
            ("sine:amplitude=1,frequency=3.5", 1000, 0.025),
            ("sine:amplitude=1,frequency=4", 6000, 0.001),
            ("sine:amplitude=1,frequency=-50", 71_000, 0.001),
            ("lin-sweep:amplitude=1,f0=60,f1=1,duration=20", 85_000, 0.001),
        ] {
            let torque = Torque::Profile(text.parse().unwrap());
            let history = torque.history(0.02, 20.0, false).unwrap();
            assert_eq!(history.time().len(), count + 1, "{text}");
            let mut largest = 0.0_f64;
            for k in 0..100_000 {
                let t = 20.0 * (f64::from(k) + 0.5) / 100_000.0;
                largest = largest.max((history.after(t).0 - torque.torque_at(t)).abs());
            }
            assert!(largest <= error, "{text}: {largest}");
            // every command at 50 Hz is exactly one of the rows, and no row depends on the end of the run
            let early = torque.history(0.02, 7.333, false).unwrap();
            for k in 0..366 {
                let t = f64::from(k) * 0.02;
                assert_eq!(history.after(t).0, torque.torque_at(t));
                assert_eq!(history.after(t + 0.007), early.after(t + 0.007), "{text}");
            }
        }
    }

    #[test]
    fn a_profile_with_too_many_commands_is_refused_and_the_error_states_what_is_possible() {
        let refused = |text: &str, sample: f64, hold: bool| {
            let torque = Torque::Profile(text.parse().unwrap());
            torque.history(sample, 60.0, hold).unwrap_err().to_string()
        };
        let error = refused("lin-sweep:f1=1e9", 0.02, false);
        for word in ["4.215e12 commands", "allowed: at most 20000000", "up to 2.847e-4 s"] {
            assert!(error.contains(word), "{word}: {error}");
        }
        // 20 million rows in 60 s with 70.25 rows per cycle
        assert!(error.contains("up to 4.7451e3 Hz"), "{error}");
        assert!(refused("sine", 1e-9, false).contains("6.000e10 commands"));
        let error = refused("sine:frequency=25", 0.02, true);
        assert!(error.contains("allowed: an interval below 2.000e-2 s"), "{error}");
        assert!(
            refused("sine", 0.0, false).contains("must be a positive number of seconds, not 0")
        );
        let error = Torque::Profile("lin-sweep:f0=1,f1=60".parse().unwrap());
        let error = error.check_rows(0.02, 60.0).unwrap_err().to_string();
        assert!(error.contains("allowed: a step below 8.333e-3 s"), "{error}");
    }

    #[test]
    fn the_torque_of_an_acceleration_step_is_inertia_times_acceleration() {
        let text = "acceleration-step:acceleration=0.5,inertia=0.4,start=1,width=2,duration=5";
        let torque = Torque::Profile(text.parse().unwrap());
        assert_eq!([0.5, 1.0, 2.9, 3.0].map(|t| torque.torque_at(t)), [0.0, 0.2, 0.2, 0.0]);
    }

    #[test]
    fn a_torque_file_can_be_named_as_a_profile() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("torque.csv");
        std::fs::write(&path, "time,tau_cmd\n0,0\n1,2\n").unwrap();
        let torque = |rest: &str| {
            format!("file:path={}{rest}", path.display()).parse::<Written>().unwrap().torque()
        };
        assert_eq!(torque("").unwrap().torque_at(0.5), 1.0);
        assert_eq!(torque(",hold=true").unwrap().torque_at(0.5), 0.0);
        let error = torque(",hold=maybe").unwrap_err().to_string();
        assert!(error.contains("hold must be true or false"), "{error}");
        let error = "file".parse::<Written>().unwrap().torque().unwrap_err().to_string();
        assert!(error.contains("path=FILE"), "{error}");
    }

    #[test]
    fn torque_rows_are_interpolated_linearly_or_held() {
        let rows = |held| Torque::rows(&[0.0, 1.0, 3.0], &[0.0, 2.0, 0.0], None, held).unwrap();
        assert_eq!((rows(false).torque_at(0.5), rows(false).torque_at(2.0)), (1.0, 1.0));
        assert_eq!((rows(true).torque_at(0.5), rows(true).torque_at(2.0)), (0.0, 2.0));
        assert_eq!(rows(false).torque_at(9.0), 0.0);
        let held = rows(false).history(0.02, 3.0, true).unwrap().into_owned();
        assert_eq!(held, *rows(true).history(0.02, 3.0, false).unwrap());
    }
}

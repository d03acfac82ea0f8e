//! The plan of a campaign: a TOML file that is read, checked and expanded into runs. `book/campaigns.md` shows
//! the format by example.

mod draft;
mod file;
mod problems;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, bail, ensure};

use crate::profile::{Torque, Written};
use crate::rounding::thousandths;
use crate::run::{Run, driven};
use crate::sensors::{Sensor, Sensors};
use files::output::{hash_reader, sha256};
use files::{budget, input};
use host::causality::Causality;
use host::description::{ModelDescription, Value, did_you_mean};
use names::hubslosh::{SloshModel, SloshSource, slosh, tank};
use signals::recording::Columns;

pub use self::draft::Draft;
use self::problems::{Lines, Problems};

/// Slosh models of the default campaign: the model of the thesis's synthetic data, and the model that is
/// closest to its bench.
pub const MODELS: [&str; 2] = [SloshModel::Linear.name(), SloshModel::Spherical.name()];
pub const FILLS: [f64; 2] = [0.05, 0.10];
/// The thesis's amplitudes, N·m (its Table 5.2 and chapter 7).
pub const AMPLITUDES: [f64; 11] =
    [0.0125, 0.025, 0.05, 0.075, 0.1, 0.125, 0.15, 0.175, 0.2, 0.225, 0.25];

macro_rules! plans {
    ($($name:literal)*) => {
        &[$(($name, include_str!(concat!("../../../campaigns/", $name, ".toml")))),*]
    };
}

pub const BUILT_IN: &[(&str, &str)] = plans! {
    "thesis" "thesis_models" "t1_resonance" "t2_mass" "t3_diameter" "t4_distance"
    "t5_near_resonance" "t6_high_amplitude" "t7_on_the_axis" "fills" "amplitudes" "bench_damping"
    "bench_as_built" "low_thrust" "slew"
};

/// Time between the rows of a result, s, if the plan does not state it: the sampling period of the thesis's IMU at 50 Hz.
const STEP: f64 = 0.02;
/// Names that a plan usually varies. If a plan varies no other names, the files of its runs are called
/// `<model>_<fill>mm_<amplitude>`; users rely on these names, so that they must not change.
const NAMING: [&str; 3] = [slosh::MODEL, tank::H, AMPLITUDE];
pub const AMPLITUDE: &str = "profile.amplitude";
const FREQUENCY: &str = "profile.frequency";

/// Value of a name in a plan file. The name is an FMU variable, `profile` or `profile.PARAMETER`.
#[derive(Clone, Debug)]
struct Named<T> {
    name: String,
    value: T,
    lines: Lines,
}

impl<T> Named<T> {
    fn map<U>(self, f: impl FnOnce(T) -> U) -> Named<U> {
        Named { name: self.name, value: f(self.value), lines: self.lines }
    }
}

#[derive(Clone, Debug)]
pub struct Plan {
    pub title: String,
    pub text: String,
    profile: Named<Written>,
    step: f64,
    stop: Option<Named<f64>>,
    tolerance: Option<f64>,
    hold: bool,
    input: Option<Named<String>>,
    set: Vec<Named<String>>,
    vary: Vec<Named<Vec<String>>>,
    listed: Vec<Listed>,
    count: Vec<Named<i64>>,
    onset: Option<Onset>,
    sensors: Vec<Sensor>,
}

/// Range in which a plan seeks the onset of rotary slosh: the smallest and largest frequency, Hz, and at least two torques
/// in ascending order, N·m. The onset is searched between the first and the last torque; then dwells at its frequency are
/// simulated with all torques. `found` is true after [`Plan::dwell`] has replaced the search by these dwells.
#[derive(Clone, Debug)]
pub(crate) struct Onset {
    pub frequency: [f64; 2],
    pub amplitude: Vec<f64>,
    found: bool,
    lines: Lines,
}

#[derive(Clone, Debug, Default)]
struct Listed {
    name: Option<String>,
    values: Vec<Named<String>>,
    recording: Option<Recorded>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Recorded {
    pub path: PathBuf,
    pub columns: Columns,
}

pub const RECORDING: &str = "recording";

/// One run of a plan. `listed` is the name of its `[[run]]`, if the plan gives one. `varied` are the values of the varied
/// names, in the order of [`Plan::varied`], empty if a `[[run]]` does not set the name. `model`, `fill` (m) and
/// `amplitude` (N·m) are the values of `slosh.model`, of `tank.h` and of the profile's amplitude, if they exist.
/// `settings` are start values by FMU name.
#[derive(Clone, Debug)]
pub struct Case {
    pub name: String,
    pub listed: Option<String>,
    pub varied: Vec<String>,
    pub model: Option<String>,
    pub fill: Option<f64>,
    pub amplitude: Option<f64>,
    pub profile: String,
    pub torque: Arc<Torque>,
    /// SHA-256 of the torque's file, if the torque comes from a file.
    pub torque_sha256: Option<String>,
    pub input: Option<String>,
    pub settings: Vec<(String, String)>,
    /// Time between the rows of the result, and between the commands of the profile, s.
    pub step: f64,
    pub stop: f64,
    pub tolerance: Option<f64>,
    /// True if the torque is held constant over each step, false if it is interpolated linearly.
    pub hold: bool,
    pub sensors: Vec<Sensor>,
    pub recording: Option<Recorded>,
}

impl Case {
    pub fn run(&self) -> Run {
        Run {
            settings: self.settings.clone(),
            input: self.input.clone(),
            torque: Torque::clone(&self.torque),
            others: Vec::new(),
            step: self.step,
            sample: self.step,
            stop: self.stop,
            tolerance: self.tolerance,
            hold: self.hold,
        }
    }
}

impl Plan {
    pub fn read(file: &str) -> Result<Self> {
        let built_in = BUILT_IN.iter().find(|(name, _)| *name == file);
        let text = match (input::text(Path::new(file)), built_in) {
            (Ok(text), _) => text,
            (Err(_), Some((_, text))) => text.to_string(),
            (Err(error), None) => {
                let names: Vec<_> = BUILT_IN.iter().map(|(name, _)| *name).collect();
                bail!(
                    "the plan {file} cannot be read ({error}), and no built-in plan has that name; \
                     there are {}{}",
                    names.join(", "),
                    did_you_mean(file, names.iter().copied())
                );
            }
        };
        Plan::parse(&text).with_context(|| format!("the plan {file}"))
    }

    /// Parses the text of a plan. [`Plan::cases`] checks the names against an FMU.
    pub fn parse(text: &str) -> Result<Self> {
        Plan::from_text(text, true)
    }

    fn from_text(text: &str, has_lines: bool) -> Result<Self> {
        let mut problems = Problems::default();
        let plan = file::read(text, has_lines, &mut problems);
        if let Some(plan) = &plan {
            plan.each_name_once(&mut problems);
        }
        problems.check()?;
        plan.context("the plan has no torque profile: write profile = \"NAME\" (hubslosh torque --profiles lists the names)")
    }

    fn each_name_once(&self, problems: &mut Problems) {
        fn names_in<'a, T>(
            named: &'a [Named<T>],
            place: &'static str,
        ) -> impl Iterator<Item = (&'a str, &'static str, &'a Lines)> {
            named.iter().map(move |one| (one.name.as_str(), place, &one.lines))
        }
        let mut owner: BTreeMap<&str, (&str, &Lines)> = BTreeMap::new();
        let listed = self.listed.iter().flat_map(|run| names_in(&run.values, "[[run]]"));
        let named =
            names_in(&self.set, "[set]")
                .chain(names_in(&self.vary, "[vary]"))
                .chain(listed)
                .chain(names_in(&self.count, "[count]"))
                .chain(self.onset.iter().flat_map(|onset| {
                    [FREQUENCY, AMPLITUDE].map(|n| (n, "[onset]", &onset.lines))
                }));
        for (name, place, lines) in named {
            match owner.insert(name, (place, lines)) {
                Some((other, others)) if other != place => {
                    let both = others.union(lines);
                    problems.add(
                        &both,
                        format!(
                            "{name} is given in {other} and in {place} (allowed: in one of the two)"
                        ),
                    );
                }
                _ => {}
            }
        }
    }

    pub fn varied(&self) -> Vec<&str> {
        let mut names = self.grouping();
        names.extend(self.count.iter().map(|one| one.name.as_str()));
        names
    }

    /// Returns the names that the plan varies systematically, with `[[run]]` and `[vary]`.
    pub fn grouping(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        let listed = self.listed.iter().flat_map(|run| &run.values).map(|one| one.name.as_str());
        for name in listed.chain(self.vary.iter().map(|one| one.name.as_str())) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// Returns the name of the varied number with the most values in the plan, which becomes the horizontal axis of
    /// figures; if several have equally many values, the last one of them. Returns `None` if no number is varied.
    pub fn axis(&self) -> Option<&str> {
        self.axis_of_vary().or_else(|| self.axis_of_listed())
    }

    /// Returns the varied number that has the most different values in the listed recordings (or in the dwells at the
    /// onset of rotary slosh), for the axis of figures.
    fn axis_of_listed(&self) -> Option<&str> {
        let along = |run: &&Listed| run.recording.is_some() || self.onset.is_some();
        let runs = self.listed.iter().filter(along);
        let mut values: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
        for one in runs.flat_map(|run| &run.values).filter(|one| one.value.parse::<f64>().is_ok()) {
            values.entry(&one.name).or_default().insert(&one.value);
        }
        let several = values.into_iter().filter(|(_, values)| values.len() > 1);
        // if several numbers have equally many values, the amplitude of the torque is chosen
        let most = several.max_by_key(|(name, values)| (values.len(), *name == NAMING[2]));
        most.map(|(name, _)| name)
    }

    fn axis_of_vary(&self) -> Option<&str> {
        let numbers = |values: &[String]| values.iter().all(|v| v.parse::<f64>().is_ok());
        let along = self.vary.iter().filter(|vary| vary.value.len() > 1 && numbers(&vary.value));
        let most = along.max_by_key(|vary| vary.value.len());
        most.map(|vary| vary.name.as_str())
    }

    /// Converts values with a unit (`50 mm`) to numbers in the FMU's unit. Values that cannot be read are not changed,
    /// and [`Plan::cases`] refuses them.
    pub fn convert_units(&mut self, description: &ModelDescription) {
        let convert = |name: &str, text: &mut String| {
            let variable = description.variable(name).ok();
            let read = variable.and_then(|variable| description.value(variable, text).ok());
            if let (Some(Value::Real(number)), Err(_)) = (read, text.trim().parse::<f64>()) {
                *text = number.to_string();
            }
        };
        let listed = self.listed.iter_mut().flat_map(|run| &mut run.values);
        for one in self.set.iter_mut().chain(listed) {
            convert(&one.name, &mut one.value);
        }
        for vary in &mut self.vary {
            vary.value.iter_mut().for_each(|value| convert(&vary.name, value));
        }
    }

    pub fn set(&self) -> impl Iterator<Item = (&str, &str)> {
        self.set.iter().map(|set| (set.name.as_str(), set.value.as_str()))
    }

    pub(crate) fn pending_onset(&self) -> Option<Onset> {
        self.onset.clone().filter(|onset| !onset.found)
    }

    pub(crate) fn seeking(&self, description: &ModelDescription) -> Result<Vec<Case>> {
        Plan { onset: None, ..self.clone() }.cases(description)
    }

    /// Replaces the cases of [`Plan::seeking`] by dwells, which are sine torques of constant frequency. An entry of
    /// `dwells` has the case that is replaced, the frequency (Hz) and the torques (N·m).
    pub(crate) fn dwell(&mut self, dwells: Vec<(Case, f64, Vec<f64>)>) {
        let names: Vec<String> = self.grouping().into_iter().map(String::from).collect();
        let lines = self.onset.as_ref().map_or(Lines::default(), |onset| onset.lines.clone());
        let named =
            |name: &str, value: String| Named { name: name.into(), value, lines: lines.clone() };
        let mut listed = Vec::new();
        for (case, frequency, torques) in dwells {
            for torque in torques {
                let values = names.iter().zip(&case.varied).filter(|(_, value)| !value.is_empty());
                let mut values: Vec<_> =
                    values.map(|(name, value)| named(name, value.clone())).collect();
                values.push(named(FREQUENCY, frequency.to_string()));
                values.push(named(AMPLITUDE, torque.to_string()));
                listed.push(Listed { values, ..Listed::default() });
            }
        }
        (self.listed, self.vary) = (listed, Vec::new());
        self.onset.iter_mut().for_each(|onset| onset.found = true);
    }

    /// Returns the plan's runs for an FMU with this description: every `[[run]]` with every combination of `[vary]` (the
    /// last varies fastest). The error lists all problems of the plan. The FMU checks the values only when it is simulated.
    pub fn cases(&self, description: &ModelDescription) -> Result<Vec<Case>> {
        ensure!(
            self.pending_onset().is_none(),
            "only `hubslosh campaign` runs a plan with [onset]"
        );
        let count = self
            .vary
            .iter()
            .map(|vary| vary.value.len())
            .chain([self.listed.len().max(1)])
            .try_fold(1_usize, usize::checked_mul)
            .filter(|count| *count <= budget::RUNS)
            .with_context(|| {
                format!("a plan may have at most {} runs, and this plan has more", budget::RUNS)
            })?;

        let mut combinations = match &self.listed[..] {
            [] => vec![Listed::default()],
            listed => listed.to_vec(),
        };
        for Named { name, value: values, lines } in &self.vary {
            let with = |run: &Listed, value: &String| {
                let mut run = run.clone();
                let (name, value, lines) = (name.clone(), value.clone(), lines.clone());
                run.values.push(Named { name, value, lines });
                run
            };
            combinations = combinations
                .iter()
                .flat_map(|run| values.iter().map(|value| with(run, value)).collect::<Vec<_>>())
                .collect();
        }

        let mut problems = Problems::default();
        let chosen = self.input.as_ref().map(|input| input.value.as_str());
        let input = driven(description, chosen).context("the input that the plan names");
        let lines = self.input.as_ref().map_or(Lines::default(), |input| input.lines.clone());
        let Some(input) = problems.take(&lines, input) else {
            problems.check()?;
            return Ok(Vec::new());
        };
        let mut torques = BTreeMap::new();
        let mut names = BTreeSet::new();
        let mut cases = Vec::with_capacity(count);
        // a recording comes before the simulations with the same values
        for run in &self.listed {
            let Some(recording) = &run.recording else { continue };
            let case = self.case(description, &input, &mut torques, &mut problems, &run.values);
            let Some(mut case) = case else { continue };
            let varied = self.varied();
            let model = varied.iter().position(|name| *name == NAMING[0]);
            model.into_iter().for_each(|place| case.varied[place] = RECORDING.into());
            case.model = Some(RECORDING.into());
            case.recording = Some(recording.clone());
            case.name = self.name(run, &case, &mut names);
            cases.push(case);
        }
        let recorded = cases.len();
        for run in &combinations {
            if problems.len() > 20 {
                break; // enough to report that there are too many
            }
            let mut values = run.values.clone();
            for count in &self.count {
                let number = |first: i64| (first + (cases.len() - recorded) as i64).to_string();
                values.push(count.clone().map(number));
            }
            let case = self.case(description, &input, &mut torques, &mut problems, &values);
            let Some(mut case) = case else { continue };
            case.name = self.name(run, &case, &mut names);
            // a recording is plotted over its varied values, as simulated runs are, and not over its name
            case.listed = run.name.clone().filter(|_| run.recording.is_none());
            cases.push(case);
        }
        problems.check()?;
        Ok(cases)
    }

    fn case(
        &self,
        description: &ModelDescription,
        input: &Option<String>,
        torques: &mut BTreeMap<String, (Arc<Torque>, Option<String>)>,
        problems: &mut Problems,
        values: &[Named<String>],
    ) -> Option<Case> {
        let before = problems.len();
        let Named { value: mut written, mut lines, .. } = self.profile.clone();
        if let Some(profile) = values.iter().find(|one| one.name == "profile") {
            written = problems.take(&profile.lines, profile.value.parse())?;
            lines = profile.lines.clone();
        }
        for one in values {
            if let Some(parameter) = one.name.strip_prefix("profile.") {
                written.set(parameter, &one.value);
                lines = lines.union(&one.lines);
            }
        }
        let mut settings: Vec<(String, String)> = Vec::new();
        let of_fmu = |name: &str| name != "profile" && !name.starts_with("profile.");
        for Named { name, value, lines } in
            self.set.iter().chain(values).filter(|one| of_fmu(&one.name))
        {
            problems.take(lines, check_setting(description, input, name, value));
            settings.push((name.clone(), value.clone()));
        }

        // a file is read once for all runs that use it
        let key = format!("{written:?}");
        if !torques.contains_key(&key) {
            let hash = written
                .path()
                .and_then(|path| input::open(path).ok())
                .and_then(|file| hash_reader(file).ok());
            let torque = problems.take(&lines, written.torque())?;
            torques.insert(key.clone(), (Arc::new(torque), hash));
        }
        let (torque, torque_sha256) = torques[&key].clone();
        let value = |name: &str| {
            let set = settings.iter().rfind(|(n, _)| n == name).map(|(_, v)| v.clone());
            let variable = description.variable(name).ok()?;
            let text = set.or_else(|| variable.attributes().start.clone())?;
            let item = description.items(variable).iter().find(|i| i.value.to_string() == text);
            Some(item.map_or(text, |item| item.name.clone()))
        };
        // a table of modes does not depend on the dimensions of the tank
        let from_table = value(slosh::SOURCE).is_some_and(|item| item == SloshSource::Table.name())
            || value(slosh::SOURCE_KIND)
                .is_some_and(|item| item == (SloshSource::Table as i32).to_string());
        for name in [tank::H, slosh::ZETA] {
            if let Some(varied) = values.iter().find(|one| from_table && one.name == name) {
                let what = "is varied, but has no effect with slosh.source = table";
                problems.add(&varied.lines, format!("{name} {what}"));
            }
        }
        let case = Case {
            name: String::new(),
            listed: None,
            varied: self
                .varied()
                .iter()
                .map(|name| {
                    let value = values.iter().find(|one| one.name == *name);
                    value.map_or(String::new(), |one| one.value.clone())
                })
                .collect(),
            model: value(slosh::MODEL),
            input: input.clone(),
            fill: value(tank::H).filter(|_| !from_table).and_then(|h| h.parse().ok()),
            amplitude: torque.profile().and_then(|profile| profile.amplitude()),
            profile: match &*torque {
                Torque::Profile(profile) => profile.to_string(),
                Torque::Rows { held, .. } => {
                    format!("file:path={},hold={held}", written.path()?.display())
                }
            },
            stop: self.stop.as_ref().map_or(torque.span().1, |stop| stop.value),
            torque,
            torque_sha256,
            settings,
            step: self.step,
            tolerance: self.tolerance,
            hold: self.hold,
            sensors: self.sensors.clone(),
            recording: None,
        };
        let sensors = Sensors::new(&case.sensors, description, &case.settings, case.step);
        problems.take(&Lines::default(), sensors);
        let lines = self.stop.as_ref().map_or(lines, |stop| stop.lines.clone());
        let run = case.run();
        problems.take(&lines, run.check().and_then(|()| run.torque.check_rows(run.step, run.stop)));
        (problems.len() == before).then_some(case)
    }

    /// Returns the run's own name, or `linear_100mm_12.5` (model, fill in mm, amplitude in mN·m) if nothing else is
    /// varied. Otherwise the name consists of the varied values, as in `d_0.111_amplitude_0.1`.
    fn name(&self, run: &Listed, case: &Case, taken: &mut BTreeSet<String>) -> String {
        let mut parts = match &run.name {
            // if a named run is varied further, the varied values are appended to its name
            Some(name) => vec![name.clone()],
            None => Vec::new(),
        };
        let values: Vec<_> = match &run.name {
            Some(_) => {
                let varied = |name: &str| self.vary.iter().any(|vary| vary.name == name);
                run.values.iter().filter(|one| varied(&one.name)).collect()
            }
            None => run.values.iter().collect(),
        };
        match (&case.model, case.fill, case.amplitude) {
            (Some(model), Some(fill), Some(amplitude))
                if run.name.is_none()
                    && values.iter().all(|one| NAMING.contains(&one.name.as_str())) =>
            {
                let [fill, amplitude] = [fill, amplitude].map(thousandths);
                parts.push(format!("{model}_{fill}mm_{amplitude}"));
            }
            _ => {
                for Named { name, value, .. } in values {
                    let name = name.rsplit('.').next().unwrap_or(name);
                    let value = value.split(':').next().unwrap_or(value);
                    // the value of an enumeration is clear by itself; before a number or a Boolean the name of
                    // its variable is added
                    if value.parse::<f64>().is_ok() || value.parse::<bool>().is_ok() {
                        parts.push(format!("{name}_{value}"));
                    } else {
                        parts.push(value.into());
                    }
                }
            }
        }
        if parts.is_empty() {
            parts.push("run".into());
        }
        let plain = |c: char| if c.is_alphanumeric() || "._-".contains(c) { c } else { '_' };
        let mut base: String = parts.join("_").chars().map(plain).collect();
        if base.len() > budget::NAME {
            // long names are cut, with a hash that distinguishes names with the same beginning
            let fits = |(i, c): &(usize, char)| i + c.len_utf8() <= budget::NAME - 17;
            let begin: String = base.char_indices().take_while(fits).map(|(_, c)| c).collect();
            base = format!("{begin}_{}", &sha256(base.as_bytes())[..16]);
        }
        // some file systems do not distinguish upper and lower case
        let mut name = base.clone();
        let mut number = 1;
        while !taken.insert(name.to_lowercase()) {
            number += 1;
            name = format!("{base}_{number}");
        }
        name
    }
}

/// Fails unless the FMU has this parameter or input and accepts the format of the value.
fn check_setting(
    description: &ModelDescription,
    input: &Option<String>,
    name: &str,
    text: &str,
) -> Result<()> {
    let variable = description.variable(name)?;
    ensure!(
        input.as_deref() != Some(name),
        "{name} cannot be set, because the torque profile drives it"
    );
    ensure!(
        matches!(variable.causality, Causality::Parameter | Causality::Input),
        "{name} cannot be set: it is of causality {}, not a parameter or an input",
        variable.causality
    );
    description.value(variable, text).map(|_| ())
}

#[cfg(test)]
mod tests {
    use host::description::ModelDescription;

    use super::{AMPLITUDE, AMPLITUDES, BUILT_IN, Case, Draft, FILLS, MODELS, Plan};

    fn description() -> ModelDescription {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../modelDescription/HubSlosh/modelDescription.xml"
        );
        ModelDescription::from_xml(&std::fs::read_to_string(path).unwrap()).unwrap()
    }

    fn cases(text: &str) -> Vec<Case> {
        Plan::parse(text).unwrap().cases(&description()).unwrap()
    }

    fn names(cases: &[Case]) -> Vec<&str> {
        cases.iter().map(|case| case.name.as_str()).collect()
    }

    #[test]
    fn every_built_in_plan_has_the_expected_number_of_runs() {
        let counts: Vec<(&str, usize)> = BUILT_IN
            .iter()
            .map(|(name, text)| {
                let mut plan = Plan::parse(text).unwrap();
                assert!(!plan.title.is_empty(), "{name}");
                if let Some(onset) = plan.pending_onset() {
                    let seeking = plan.seeking(&description()).unwrap().into_iter();
                    plan.dwell(seeking.map(|case| (case, 2.4, onset.amplitude.clone())).collect());
                }
                (*name, plan.cases(&description()).unwrap().len())
            })
            .collect();
        let expected = [
            ("thesis", 44),
            ("thesis_models", 88),
            ("t1_resonance", 6),
            ("t2_mass", 5),
            ("t3_diameter", 5),
            ("t4_distance", 5),
            ("t5_near_resonance", 16),
            ("t6_high_amplitude", 27),
            ("t7_on_the_axis", 6),
            ("fills", 20),
            ("amplitudes", 30),
            ("bench_damping", 63),
            ("bench_as_built", 22),
            ("low_thrust", 8),
            ("slew", 27),
        ];
        assert_eq!(counts, expected);
    }

    #[test]
    fn dwells_at_the_onset_frequency_are_run_with_all_torques() {
        let text = "profile = \"sine:duration=10\"\n[vary]\nslosh.model = [\"planar\", \"spherical\"]\n\
                    [onset]\nfrequency = [2.3, 2.5]\namplitude = [0.03, 0.1]\n";
        let mut plan = Plan::parse(text).unwrap();
        let error = plan.cases(&description()).unwrap_err().to_string();
        assert!(error.contains("`hubslosh campaign`"), "{error}");
        let seeking = plan.seeking(&description()).unwrap();
        let models: Vec<_> = seeking.iter().map(|case| case.model.as_deref().unwrap()).collect();
        assert_eq!(models, ["planar", "spherical"]);
        let dwells = seeking.into_iter().zip([2.45, 2.4]);
        plan.dwell(dwells.map(|(case, f)| (case, f, vec![0.05, 0.1])).collect());
        assert_eq!(plan.axis(), Some("profile.amplitude"));
        let cases = plan.cases(&description()).unwrap();
        let expected = [
            "planar_frequency_2.45_amplitude_0.05",
            "planar_frequency_2.45_amplitude_0.1",
            "spherical_frequency_2.4_amplitude_0.05",
            "spherical_frequency_2.4_amplitude_0.1",
        ];
        assert_eq!(names(&cases), expected);
        assert!(cases[2].profile.contains("frequency=2.4"), "{}", cases[2].profile);
        let wrong = [
            ("frequency = [2.3]\namplitude = [0.03, 0.1]", "frequency expects two frequencies"),
            ("frequency = [2.3, 2.5]\namplitude = [0.1, 0.03]", "amplitude expects ascending"),
            ("frequency = [2.3, 2.5]", "[onset] has no amplitude"),
            (
                "frequency = [2.3, 2.5]\namplitude = [0.03, 0.1]\n[vary]\nprofile.amplitude = [1]",
                "profile.amplitude is given in [vary] and in [onset]",
            ),
        ];
        for (table, words) in wrong {
            let text = format!("profile = \"sine:duration=10\"\n[onset]\n{table}\n");
            let error = Plan::parse(&text).unwrap_err().to_string();
            assert!(error.contains(words), "{words}: {error}");
        }
        let text =
            "profile = \"exp-sweep\"\n[onset]\nfrequency = [2.3, 2.5]\namplitude = [0.03, 0.1]\n";
        let error = Plan::parse(text).unwrap_err().to_string();
        assert!(error.contains("a profile of one frequency, sine"), "{error}");
    }

    #[test]
    fn values_with_and_without_units_give_the_same_plan() {
        let [plain, with_units] = [
            "profile = \"sine\"\n[set]\ntank.d = 0.163\n[vary]\ntank.h = [0.05, 0.1]\n[[run]]\nhub.I = 0.3\n",
            "profile = \"sine\"\n[set]\ntank.d = \"163 mm\"\n[vary]\ntank.h = [\"50mm\", \"0.1 m\"]\n\
             [[run]]\nhub.I = \"0.3 kg.m2\"\n",
        ]
        .map(|text| {
            let mut plan = Plan::parse(text).unwrap();
            plan.convert_units(&description());
            (plan.axis().map(String::from), plan.cases(&description()).unwrap())
        });
        assert_eq!(plain.0.as_deref(), Some("tank.h"));
        assert_eq!(format!("{plain:?}"), format!("{with_units:?}"));
        let mut plan = Plan::parse("profile = \"sine\"\n[vary]\ntank.h = [\"5 V\"]\n").unwrap();
        plan.convert_units(&description());
        let why = plan.cases(&description()).unwrap_err().to_string();
        assert!(why.contains("tank.h has no unit \"V\" (allowed: m, mm)"), "{why}");
    }

    #[test]
    fn sweeps_from_command_line_options_have_the_runs_of_the_built_in_plan() {
        let sweeps = |set: &[(&str, &str)]| {
            let set = set.iter().map(|(name, value)| (name.to_string(), value.to_string()));
            let texts = |values: &[f64]| values.iter().map(f64::to_string).collect();
            let draft = Draft {
                title: "Sweeps".into(),
                profile: "lin-sweep:f0=1.25,f1=3.5,duration=2700".into(),
                set: set.collect(),
                tolerance: Some(1e-9),
                vary: vec![
                    ("slosh.model", vec!["linear".into(), "spherical".into()]),
                    ("tank.h", texts(&FILLS)),
                    (AMPLITUDE, texts(&[0.0125, 0.1])),
                ],
                ..Draft::default()
            };
            draft.plan()
        };
        let plan = sweeps(&[("friction.model", "viscous")]).unwrap();
        let direct = plan.cases(&description()).unwrap();
        let written = cases(&plan.text);
        assert_eq!(direct.len(), 8);
        assert_eq!(direct[0].name, "linear_50mm_12.5");
        assert_eq!(format!("{direct:?}"), format!("{written:?}"));
        let error = sweeps(&[("tank.h", "0.1")]).unwrap_err().to_string();
        assert_eq!(error, "tank.h is given in [set] and in [vary] (allowed: in one of the two)");
    }

    #[test]
    fn every_plan_file_is_built_in() {
        let directory = concat!(env!("CARGO_MANIFEST_DIR"), "/../campaigns");
        for file in std::fs::read_dir(directory).unwrap() {
            let path = file.unwrap().path();
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            assert!(BUILT_IN.iter().any(|(n, _)| *n == name), "{name}");
        }
    }

    #[test]
    fn the_thesis_campaign_has_22_runs_of_each_model_with_plain_names() {
        let plan = Plan::read("thesis").unwrap();
        let cases = plan.cases(&description()).unwrap();
        assert_eq!(cases[0].name, "linear_50mm_12.5");
        assert_eq!(cases[21].name, "linear_100mm_250");
        assert_eq!(cases[43].name, "spherical_100mm_250");
        let swept = |case: &Case| {
            (case.model.clone().unwrap(), case.fill.unwrap(), case.amplitude.unwrap())
        };
        let sweeps = |model: &'static str| {
            let at = move |h: f64| AMPLITUDES.map(|a| (model.to_string(), h, a));
            FILLS.into_iter().flat_map(at)
        };
        let all = MODELS.into_iter().flat_map(sweeps);
        assert!(cases.iter().map(swept).eq(all), "the command line's defaults are the same");
        let dusty = cases_of(
            "profile = \"sine\"\n[vary]\nslosh.model = [\"planar\"]\ntank.h = [0.07]\nprofile.amplitude = [0.30000000000000004]",
        );
        assert_eq!(dusty, ["planar_70mm_300"]);
    }

    fn cases_of(text: &str) -> Vec<String> {
        names(&cases(text)).into_iter().map(String::from).collect()
    }

    #[test]
    fn each_listed_run_is_combined_with_all_varied_values_and_the_last_value_varies_fastest() {
        let text = "profile = \"sine:duration=1\"\n\
            [[run]]\nname = \"near\"\nprofile.frequency = 2.3\n\
            [[run]]\nname = \"far\"\nprofile.frequency = 3\nhub.I = 0.5\n\
            [vary]\ntank.d = [0.1, 0.2]\nprofile.amplitude = [0.1, 0.2]\n\
            [count]\nimu.seed = 7\n";
        let plan = Plan::parse(text).unwrap();
        let cases = plan.cases(&description()).unwrap();
        assert_eq!(
            plan.varied(),
            ["profile.frequency", "hub.I", "tank.d", "profile.amplitude", "imu.seed"]
        );
        assert_eq!(cases.len(), 8);
        assert_eq!(cases[1].name, "near_d_0.1_amplitude_0.2");
        assert_eq!(cases[1].varied, ["2.3", "", "0.1", "0.2", "8"]);
        assert_eq!(cases[6].name, "far_d_0.2_amplitude_0.1");
        assert_eq!(cases[6].profile, "sine:amplitude=0.1,frequency=3,duration=1");
        let setting = |name: &str, value: &str| (name.to_string(), value.to_string());
        assert_eq!(
            cases[6].settings,
            [setting("hub.I", "0.5"), setting("tank.d", "0.2"), setting("imu.seed", "13")]
        );
    }

    #[test]
    fn names_of_runs_become_unique_file_names_on_any_file_system() {
        let text = "profile = \"zero:duration=1\"\n[[run]]\nname = \"a b\"\n[[run]]\nname = \"A/b\"\n[[run]]\nname = \"a_b\"";
        assert_eq!(cases_of(text), ["a_b", "A_b_2", "a_b_3"]);
        let text =
            "profile = \"zero\"\n[vary]\nprofile = [\"zero:duration=1\", \"sine:amplitude=0.1\"]";
        assert_eq!(cases_of(text), ["zero", "sine"]);
    }

    #[test]
    fn all_faults_of_a_wrong_plan_are_reported_at_once() {
        let text = "titel = \"x\"\nprofile = 3\nstep = -1\nhold = 1\n\
            [set]\ntank.h = [1]\nprofile.amplitude = 1\n[vary]\ntank.d = 1\n\
            [count]\nimu.seed = -1\n[onset]\nfrequency = [2, 1]\namplitud = 1\n";
        let error = Plan::parse(text).unwrap_err().to_string();
        for words in [
            "line 1: there is no key \"titel\" (there are title, profile,",
            "did you mean \"title\"",
            "line 2: profile expects a text in quotes, not 3",
            "line 3: step expects a positive number, not -1",
            "line 4: hold expects true or false, not 1",
            "line 6: [set] tank.h expects a number, true, false or a text in quotes, not [1]",
            "line 7: [set] profile.amplitude: write it into profile",
            "line 9: [vary] tank.d expects a list of values, such as [0.05, 0.1], not 1",
            "line 11: [count] imu.seed expects the whole number to count from, 0 to",
            "line 12: [onset] has no amplitude",
            "line 13: [onset] frequency expects two frequencies in Hz, such as [2.3, 2.5], not [2, 1]",
            "line 14: [onset] there is no key \"amplitud\" (there are frequency, amplitude); did you mean \"amplitude\"?",
        ] {
            assert!(error.contains(words), "\"{words}\" is not in:\n{error}");
        }
    }

    #[test]
    fn every_error_in_a_plan_file_is_reported_with_its_line() {
        let lines = |text: &str| -> Vec<String> {
            let error = Plan::parse(text).unwrap_err().to_string();
            error.lines().skip(1).map(|line| line.trim().to_string()).collect()
        };
        let syntax = lines("title = \"a\nstep = = 1\nstop = 2\n[set\n");
        let places =
            syntax.iter().filter_map(|line| line.split_once(": the plan is not valid TOML: "));
        let places: Vec<&str> = places.map(|(place, _)| place).collect();
        assert_eq!(places, ["line 1", "line 2", "line 2", "line 4"], "{syntax:?}");
        let text = "profile = [\n1,\n2]\n[onset]\nfrequency = [2, 3]\namplitude = 1e3\nset = 1\n\
            [[run]]\nname = \"\"\n[vary]\na.b = [1, nan]\n";
        let expected = [
            "line 1: profile expects a text in quotes, not [ 1, 2]",
            "line 6: [onset] amplitude expects ascending torques in N·m, at least two, such as [0.03, 0.1], not 1e3",
            "line 7: [onset] there is no key \"set\" (there are frequency, amplitude)",
            "line 9: [[run]] number 1: name expects a text in quotes, which must have 1 to 200 bytes (for a run without a name, leave the key out), not \"\"",
            "line 11: [vary] a.b expects a list of values, such as [0.05, 0.1], not [1, nan]",
        ];
        assert_eq!(lines(text), expected);
        let error = Plan::parse("title = \"\"").unwrap_err().to_string();
        assert!(error.starts_with("the plan has no profile, such as profile = "), "{error}");
    }

    #[test]
    fn every_name_and_value_of_a_plan_that_the_fmu_lacks_is_reported_once() {
        let text = "profile = \"sine\"\nstop = 0.5\n[set]\ntank.hh = 1\nomega = 1\nslosh.model = \"oily\"\ntau_cmd = 1\n\
            [vary]\nprofile.amplitde = [1, 2]\n";
        let error = Plan::parse(text).unwrap().cases(&description()).unwrap_err().to_string();
        for words in [
            "no variable \"tank.hh\"; did you mean \"tank.h\"",
            "line 5: omega cannot be set",
            "line 6: slosh.model expects one of frozen (1)",
            "line 7: tau_cmd cannot be set, because the torque profile drives it",
            "lines 1 and 9: profile sine: there is no parameter \"amplitde\"",
        ] {
            assert_eq!(error.matches(words).count(), 1, "{words}:\n{error}");
        }
        let twice = "profile = \"sine\"\n[set]\ntank.h = 1\n[vary]\ntank.h = [1]\n";
        let error = Plan::parse(twice).unwrap_err().to_string();
        assert_eq!(
            error,
            "lines 3 and 5: tank.h is given in [set] and in [vary] (allowed: in one of the two)"
        );
        let many =
            format!("profile = \"sine\"\n[vary]\ntank.h = {0:?}\ntank.d = {0:?}", [0.1; 400]);
        let error = Plan::parse(&many).unwrap().cases(&description()).unwrap_err().to_string();
        assert!(error.contains("100000 runs"), "{error}");
    }

    #[test]
    fn the_error_for_an_unknown_plan_suggests_a_built_in_plan() {
        let error = Plan::read("thesis_model").unwrap_err().to_string();
        assert!(error.contains("did you mean \"thesis_models\""), "{error}");
    }

    #[test]
    fn the_content_of_a_torque_file_is_part_of_the_definition_of_a_run() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("torque.csv");
        let hash = |text: &str| {
            std::fs::write(&path, text).unwrap();
            let plan = format!("profile = \"file:path={}\"", path.display());
            cases(&plan)[0].torque_sha256.clone().unwrap()
        };
        let first = hash("time,tau_cmd\n0,1\n1,1\n");
        assert_eq!(first.len(), 64);
        assert_ne!(hash("time,tau_cmd\n0,1\n1,2\n"), first);
    }
}

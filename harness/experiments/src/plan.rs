//! A campaign's plan: a TOML file, read, checked and expanded into runs. The format by example:
//! `book/campaigns.md`.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use anyhow::{Context, Result, bail, ensure};
use toml::Value;

use crate::profile::{Torque, Written};
use crate::rounding::thousandths;
use crate::run::{Run, driven};
use analysis::random::Random;
use host::budget;
use host::description::{self, ModelDescription, Type, did_you_mean};
use host::output::sha256;

/// Slosh models of the default campaign: what the thesis's synthetic data have, and what its bench
/// does.
pub const MODELS: [&str; 2] = ["linear", "spherical"];
/// The thesis's fills, m.
pub const FILLS: [f64; 2] = [0.05, 0.10];
/// The thesis's amplitudes, N·m (its Table 5.2 and chapter 7).
pub const AMPLITUDES: [f64; 11] =
    [0.0125, 0.025, 0.05, 0.075, 0.1, 0.125, 0.15, 0.175, 0.2, 0.225, 0.25];

/// Plans that come with the program: their names and texts.
pub const BUILT_IN: &[(&str, &str)] = &[
    ("thesis", include_str!("../../campaigns/thesis.toml")),
    ("thesis_models", include_str!("../../campaigns/thesis_models.toml")),
    ("t1_resonance", include_str!("../../campaigns/t1_resonance.toml")),
    ("t2_mass", include_str!("../../campaigns/t2_mass.toml")),
    ("t3_diameter", include_str!("../../campaigns/t3_diameter.toml")),
    ("t4_distance", include_str!("../../campaigns/t4_distance.toml")),
    ("t5_near_resonance", include_str!("../../campaigns/t5_near_resonance.toml")),
    ("t6_high_amplitude", include_str!("../../campaigns/t6_high_amplitude.toml")),
    ("t7_on_the_axis", include_str!("../../campaigns/t7_on_the_axis.toml")),
    ("fills", include_str!("../../campaigns/fills.toml")),
    ("amplitudes", include_str!("../../campaigns/amplitudes.toml")),
    ("monte_carlo", include_str!("../../campaigns/monte_carlo.toml")),
    ("low_thrust", include_str!("../../campaigns/low_thrust.toml")),
    ("slew", include_str!("../../campaigns/slew.toml")),
];

/// The communication step of a plan that names none: the thesis's IMU at 50 Hz, s.
const STEP: f64 = 0.02;
/// What the interface's file names `<model>_<fill>mm_<amplitude>` are made of.
const NAMING: [&str; 3] = ["slosh.model", "tank.h", "profile.amplitude"];
/// How often a number is drawn again that lies outside its bounds.
const MOST_DRAWS: usize = 10_000;

/// Names (FMU variables, `profile`, `profile.PARAMETER`) and the texts of their values.
type Values = Vec<(String, String)>;

/// What a campaign is to do.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What it is about.
    pub title: String,
    /// The file's text.
    pub text: String,
    profile: Written,
    step: f64,
    stop: Option<f64>,
    tolerance: Option<f64>,
    hold: bool,
    input: Option<String>,
    set: Values,
    vary: Vec<(String, Vec<String>)>,
    listed: Vec<Listed>,
    count: Vec<(String, i64)>,
    draws: Option<Draws>,
}

/// Sweeps of the bench from 1.25 to 3.5 Hz in 2700 s.
#[derive(Clone, Debug)]
pub struct Sweeps {
    /// Values of `slosh.model`, by name.
    pub models: Vec<String>,
    /// Fills, m.
    pub fills: Vec<f64>,
    /// Torque amplitudes, N·m.
    pub amplitudes: Vec<f64>,
    /// Name of the profile, `exp-sweep` or `lin-sweep`.
    pub profile: &'static str,
    /// What is set in every run, by FMU name.
    pub set: Vec<(String, String)>,
    /// Relative tolerance of the FMU's solver; `None`: the FMU's own.
    pub tolerance: Option<f64>,
}

/// One `[[run]]`.
#[derive(Clone, Debug, Default)]
struct Listed {
    name: Option<String>,
    values: Values,
}

/// `[random]`.
#[derive(Clone, Debug)]
struct Draws {
    runs: usize,
    seed: u64,
    draw: Vec<(String, Distribution)>,
}

/// Where a random value comes from; drawn again while outside `min` to `max` and the bounds of the
/// variable itself.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Distribution {
    kind: Kind,
    min: f64,
    max: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Normal {
        mean: f64,
        deviation: f64,
    },
    Uniform {
        from: f64,
        to: f64,
    },
    /// `deviation` is that of the natural logarithm.
    Lognormal {
        median: f64,
        deviation: f64,
    },
}

/// One run of a plan.
#[derive(Clone, Debug)]
pub struct Case {
    /// Its name, unique in the plan; its file is `runs/<name>.parquet`.
    pub name: String,
    /// The name of its `[[run]]`, if the plan gives one.
    pub listed: Option<String>,
    /// The values of what the plan varies, in the order of [`Plan::varied`]; empty where a
    /// `[[run]]` does not name one.
    pub varied: Vec<String>,
    /// Value of `slosh.model`, by name, if the FMU has it.
    pub model: Option<String>,
    /// Fill (`tank.h`), m, if the FMU has it.
    pub fill: Option<f64>,
    /// The profile's `amplitude`, N·m, if it has one.
    pub amplitude: Option<f64>,
    /// The profile's text.
    pub profile: String,
    /// The torque it stands for.
    pub torque: Arc<Torque>,
    /// SHA-256 of the torque's file, if it comes from one.
    pub torque_sha256: Option<String>,
    /// The input that the torque drives; `None`: none.
    pub input: Option<String>,
    /// Start values by FMU name.
    pub settings: Values,
    /// Communication step, s.
    pub step: f64,
    /// Stop time, s.
    pub stop: f64,
    /// Relative tolerance of the FMU's solver; `None`: the FMU's own.
    pub tolerance: Option<f64>,
    /// The torque is held over each step.
    pub hold: bool,
}

impl Case {
    /// What is to be driven.
    pub fn run(&self) -> Run {
        Run {
            settings: self.settings.clone(),
            input: self.input.clone(),
            torque: Torque::clone(&self.torque),
            others: Vec::new(),
            step: self.step,
            stop: self.stop,
            tolerance: self.tolerance,
            hold: self.hold,
        }
    }
}

/// What is wrong, each once, in the order found.
#[derive(Default)]
struct Problems(Vec<String>);

impl Problems {
    fn add(&mut self, problem: impl Into<String>) {
        let problem = problem.into();
        if !self.0.contains(&problem) {
            self.0.push(problem);
        }
    }

    /// Takes the value, or notes what `place` is wrong with.
    fn take<T>(&mut self, place: &str, result: Result<T>) -> Option<T> {
        result.map_err(|error| self.add(format!("{place}{error:#}"))).ok()
    }

    /// Fails if there are any.
    fn check(self) -> Result<()> {
        match &self.0[..] {
            [] => Ok(()),
            [one] => bail!("{one}"),
            many => bail!("{} problems:\n  {}", many.len(), many.join("\n  ")),
        }
    }
}

impl Plan {
    /// Reads a plan file, or takes the built-in plan of that name.
    pub fn read(file: &str) -> Result<Self> {
        let built_in = BUILT_IN.iter().find(|(name, _)| *name == file);
        let text = match (std::fs::read_to_string(file), built_in) {
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

    /// Reads a plan's text. Names are checked against the FMU by [`Plan::cases`].
    pub fn parse(text: &str) -> Result<Self> {
        let table: toml::Table = text.parse().context("it is not TOML")?;
        let mut problems = Problems::default();
        const KEYS: [&str; 11] = [
            "title",
            "profile",
            "input",
            "step",
            "stop",
            "tolerance",
            "hold",
            "set",
            "vary",
            "run",
            "random",
        ];
        known(&mut problems, "", &table, &[&KEYS[..], &["count"]].concat());

        let title = text_at(&mut problems, &table, "title").unwrap_or_default();
        let profile = text_at(&mut problems, &table, "profile");
        if profile.is_none() && !table.contains_key("profile") {
            problems.add("it has no profile, such as profile = \"exp-sweep:amplitude=0.1\"");
        }
        let profile = profile.and_then(|text| problems.take("", text.parse::<Written>()));
        let input = text_at(&mut problems, &table, "input");
        let step = positive_at(&mut problems, &table, "step").unwrap_or(STEP);
        let stop = positive_at(&mut problems, &table, "stop");
        let tolerance = positive_at(&mut problems, &table, "tolerance");
        let hold = match table.get("hold") {
            None => false,
            Some(Value::Boolean(hold)) => *hold,
            Some(other) => {
                problems.add(format!("hold expects true or false, not {other}"));
                false
            }
        };

        let set = table_at(&mut problems, &table, "set")
            .map(|set| values(&mut problems, "[set]", set))
            .unwrap_or_default();
        for (name, _) in &set {
            if name == "profile" || name.starts_with("profile.") {
                problems.add(format!("[set] {name}: write it into profile = \"…\""));
            }
        }
        let vary = table_at(&mut problems, &table, "vary")
            .map(|vary| lists(&mut problems, vary))
            .unwrap_or_default();
        let count = table_at(&mut problems, &table, "count")
            .map(|count| counts(&mut problems, count))
            .unwrap_or_default();
        let listed = listed(&mut problems, &table);
        let draws = table_at(&mut problems, &table, "random")
            .and_then(|random| draws(&mut problems, random));

        let plan = match profile {
            Some(profile) => Plan {
                title,
                text: text.into(),
                profile,
                step,
                stop,
                tolerance,
                hold,
                input,
                set,
                vary,
                listed,
                count,
                draws,
            },
            None => {
                problems.check()?;
                bail!("it has no profile");
            }
        };
        plan.each_name_once(&mut problems);
        problems.check()?;
        Ok(plan)
    }

    /// The thesis's sweeps for every one of these models, fills and amplitudes.
    ///
    /// # Errors
    /// If a setting is one of what is varied.
    pub fn sweeps(sweeps: Sweeps) -> Result<Self> {
        let Sweeps { models, fills, amplitudes, profile, set, tolerance } = sweeps;
        let numbers = |values: Vec<f64>| values.iter().map(f64::to_string).collect();
        let vary: [(&str, Vec<String>); 3] =
            [(NAMING[0], models), (NAMING[1], numbers(fills)), (NAMING[2], numbers(amplitudes))];
        let mut plan = Plan {
            title: "Sweeps at several fills and amplitudes".into(),
            text: String::new(),
            profile: format!("{profile}:f0=1.25,f1=3.5,duration=2700").parse()?,
            step: STEP,
            stop: None,
            tolerance,
            hold: false,
            input: None,
            set,
            vary: vary.map(|(name, values)| (name.to_string(), values)).into(),
            listed: Vec::new(),
            count: Vec::new(),
            draws: None,
        };
        let mut problems = Problems::default();
        plan.each_name_once(&mut problems);
        problems.check()?;
        plan.text = plan.written()?;
        Ok(plan)
    }

    /// A plan of [`Plan::sweeps`] as a file, which the campaign leaves beside its results.
    fn written(&self) -> Result<String> {
        let mut table = toml::Table::new();
        table.insert("title".into(), self.title.clone().into());
        table.insert("profile".into(), self.profile.to_string().into());
        if let Some(tolerance) = self.tolerance {
            table.insert("tolerance".into(), tolerance.into());
        }
        let set = self.set.iter().map(|(name, value)| (name.clone(), value.as_str().into()));
        table.insert("set".into(), set.collect::<toml::Table>().into());
        let vary = self.vary.iter().map(|(name, values)| (name.clone(), values.clone().into()));
        table.insert("vary".into(), vary.collect::<toml::Table>().into());
        Ok(toml::to_string(&table)?)
    }

    /// A name may be set, varied, listed, counted or drawn, but only one of these.
    fn each_name_once(&self, problems: &mut Problems) {
        let mut owner: BTreeMap<&str, &str> = BTreeMap::new();
        let listed: BTreeSet<&str> =
            self.listed.iter().flat_map(|run| run.values.iter().map(|(n, _)| n.as_str())).collect();
        let named = (self.set.iter().map(|(n, _)| (n.as_str(), "[set]")))
            .chain(self.vary.iter().map(|(n, _)| (n.as_str(), "[vary]")))
            .chain(listed.into_iter().map(|n| (n, "[[run]]")))
            .chain(self.count.iter().map(|(n, _)| (n.as_str(), "[count]")))
            .chain(
                self.draws.iter().flat_map(|d| &d.draw).map(|(n, _)| (n.as_str(), "[random.draw]")),
            );
        for (name, place) in named {
            if let Some(other) = owner.insert(name, place) {
                problems.add(format!("{name} stands in {other} and in {place}"));
            }
        }
    }

    /// Names of what the plan varies: first what its `[[run]]`s name, then `[vary]`, `[random]` and
    /// `[count]`.
    pub fn varied(&self) -> Vec<&str> {
        let mut names = self.grouping();
        let draws = self.draws.iter().flat_map(|d| &d.draw).map(|(n, _)| n.as_str());
        names.extend(draws);
        names.extend(self.count.iter().map(|(n, _)| n.as_str()));
        names
    }

    /// Names of what the plan varies on purpose: by `[[run]]` and `[vary]`.
    pub fn grouping(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        let listed = self.listed.iter().flat_map(|run| run.values.iter().map(|(n, _)| n.as_str()));
        for name in listed.chain(self.vary.iter().map(|(n, _)| n.as_str())) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// The number that the plan varies most, along which its runs are drawn; of several with as many
    /// values the last. None if there is none, or if values are drawn at random.
    pub fn axis(&self) -> Option<&str> {
        let numbers = |values: &[String]| values.iter().all(|v| v.parse::<f64>().is_ok());
        let along = self.vary.iter().filter(|(_, values)| values.len() > 1 && numbers(values));
        let most = along.max_by_key(|(_, values)| values.len());
        most.map(|(name, _)| name.as_str()).filter(|_| !self.is_random())
    }

    /// What is set in every run, by FMU name.
    pub fn set(&self) -> &[(String, String)] {
        &self.set
    }

    /// Whether values are drawn at random.
    pub fn is_random(&self) -> bool {
        self.draws.is_some()
    }

    /// Its runs, for the FMU of that description: every `[[run]]` with every combination of
    /// `[vary]` (the last varies fastest) and every draw. All that is wrong with the plan is said
    /// at once. Whether the FMU takes the values is only known when it runs.
    pub fn cases(&self, description: &ModelDescription) -> Result<Vec<Case>> {
        let draws = self.draws.as_ref().map_or(1, |d| d.runs);
        let count = self
            .vary
            .iter()
            .map(|(_, values)| values.len())
            .chain([self.listed.len().max(1), draws])
            .try_fold(1_usize, usize::checked_mul)
            .filter(|count| *count <= budget::RUNS)
            .with_context(|| format!("a plan may have {} runs; this has more", budget::RUNS))?;

        let mut combinations = match &self.listed[..] {
            [] => vec![Listed::default()],
            listed => listed.to_vec(),
        };
        for (name, values) in &self.vary {
            let with = |run: &Listed, value: &String| {
                let mut run = run.clone();
                run.values.push((name.clone(), value.clone()));
                run
            };
            combinations = combinations
                .iter()
                .flat_map(|run| values.iter().map(|value| with(run, value)).collect::<Vec<_>>())
                .collect();
        }

        let mut problems = Problems::default();
        let input = driven(description, self.input.as_deref());
        let input = input.context("the plan's input")?;
        let mut torques = BTreeMap::new();
        let mut names = BTreeSet::new();
        let mut cases = Vec::with_capacity(count);
        for run in &combinations {
            for draw in 0..draws {
                let mut values = run.values.clone();
                if let Some(random) = &self.draws {
                    let drawn = random.draw(description, &self.profile, draw as u64);
                    values.extend(problems.take("[random.draw] ", drawn).unwrap_or_default());
                }
                for (name, first) in &self.count {
                    values.push((name.clone(), (first + cases.len() as i64).to_string()));
                }
                let case = self.case(description, &input, &mut torques, &mut problems, &values);
                let Some(mut case) = case else {
                    continue;
                };
                case.name = self.name(run, &case, draw, &mut names);
                case.listed.clone_from(&run.name);
                cases.push(case);
            }
            if problems.0.len() > 20 {
                break; // enough to go on with
            }
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
        values: &Values,
    ) -> Option<Case> {
        let before = problems.0.len();
        let mut written = self.profile.clone();
        if let Some((_, text)) = values.iter().find(|(name, _)| name == "profile") {
            written = problems.take("", text.parse())?;
        }
        for (name, value) in values {
            if let Some(parameter) = name.strip_prefix("profile.") {
                written.set(parameter, value);
            }
        }
        let settings: Values = self
            .set
            .iter()
            .chain(values)
            .filter(|(name, _)| name != "profile" && !name.starts_with("profile."))
            .cloned()
            .collect();
        for (name, value) in &settings {
            problems.take("", settable(description, input, name, value));
        }

        // a file is read once, however many runs it drives
        let key = format!("{written:?}");
        if !torques.contains_key(&key) {
            let hash = written
                .path()
                .and_then(|path| std::fs::read(path).ok())
                .map(|bytes| sha256(&bytes));
            let torque = problems.take("", written.torque())?;
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
        // a table of modes knows of no dimensions
        let from_table = value("slosh.source").as_deref() == Some("table")
            || value("slosh.source_kind").as_deref() == Some("2");
        for name in ["tank.h", "slosh.zeta"] {
            if from_table && values.iter().any(|(n, _)| n == name) {
                problems
                    .add(format!("{name} is varied, but has no effect with slosh.source = table"));
            }
        }
        let case = Case {
            name: String::new(),
            listed: None,
            varied: self
                .varied()
                .iter()
                .map(|name| {
                    let value = values.iter().find(|(n, _)| n == name);
                    value.map_or(String::new(), |(_, v)| v.clone())
                })
                .collect(),
            model: value("slosh.model"),
            input: input.clone(),
            fill: value("tank.h").filter(|_| !from_table).and_then(|h| h.parse().ok()),
            amplitude: match &*torque {
                Torque::Profile(profile) => profile.amplitude(),
                Torque::Rows { .. } => None,
            },
            profile: match &*torque {
                Torque::Profile(profile) => profile.to_string(),
                Torque::Rows { held, .. } => {
                    format!("file:path={},hold={held}", written.path()?.display())
                }
            },
            stop: self.stop.unwrap_or(torque.span().1),
            torque,
            torque_sha256,
            settings,
            step: self.step,
            tolerance: self.tolerance,
            hold: self.hold,
        };
        problems.take("", case.run().check());
        (problems.0.len() == before).then_some(case)
    }

    /// The run's own name; or `linear_100mm_12.5` (model, fill in mm, amplitude in mN·m) where
    /// nothing else is varied; else what is varied, as `d_0.111_amplitude_0.1`. Draws have numbers.
    fn name(&self, run: &Listed, case: &Case, draw: usize, taken: &mut BTreeSet<String>) -> String {
        let mut parts = match &run.name {
            // a named run that is varied further: only that is added
            Some(name) => vec![name.clone()],
            None => Vec::new(),
        };
        let values: Vec<_> = match &run.name {
            Some(_) => {
                run.values.iter().filter(|(n, _)| self.vary.iter().any(|(v, _)| v == n)).collect()
            }
            None => run.values.iter().collect(),
        };
        match (&case.model, case.fill, case.amplitude) {
            (Some(model), Some(fill), Some(amplitude))
                if run.name.is_none()
                    && self.draws.is_none()
                    && values.iter().all(|(name, _)| NAMING.contains(&name.as_str())) =>
            {
                let [fill, amplitude] = [fill, amplitude].map(thousandths);
                parts.push(format!("{model}_{fill}mm_{amplitude}"));
            }
            _ => {
                for (name, value) in values {
                    let name = name.rsplit('.').next().unwrap_or(name);
                    let value = value.split(':').next().unwrap_or(value);
                    // a word speaks for itself, a number or a truth does not
                    if value.parse::<f64>().is_ok() || value.parse::<bool>().is_ok() {
                        parts.push(format!("{name}_{value}"));
                    } else {
                        parts.push(value.into());
                    }
                }
            }
        }
        if self.draws.is_some() {
            parts.push(format!("{:04}", draw + 1));
        }
        if parts.is_empty() {
            parts.push("run".into());
        }
        let plain = |c: char| if c.is_alphanumeric() || "._-".contains(c) { c } else { '_' };
        let mut base: String = parts.join("_").chars().map(plain).collect();
        if base.len() > budget::NAME {
            // as many letters as fit, and what tells it from others that begin so
            let fits = |(i, c): &(usize, char)| i + c.len_utf8() <= budget::NAME - 17;
            let begin: String = base.char_indices().take_while(fits).map(|(_, c)| c).collect();
            base = format!("{begin}_{}", &sha256(base.as_bytes())[..16]);
        }
        // some file systems do not tell A from a
        let mut name = base.clone();
        let mut number = 1;
        while !taken.insert(name.to_lowercase()) {
            number += 1;
            name = format!("{base}_{number}");
        }
        name
    }
}

/// Fails unless the FMU has such a parameter or input and could read the value.
fn settable(
    description: &ModelDescription,
    input: &Option<String>,
    name: &str,
    text: &str,
) -> Result<()> {
    let variable = description.variable(name)?;
    ensure!(input.as_deref() != Some(name), "{name} comes from the profile");
    ensure!(
        ["parameter", "input"].contains(&variable.causality.as_str()),
        "{name} cannot be set: it is of causality {}, not a parameter or an input",
        variable.causality
    );
    description.value(variable, text).map(|_| ())
}

// ---------------------------------------------------------------- the file's parts

/// Notes the keys of a table that have no meaning there.
fn known(problems: &mut Problems, place: &str, table: &toml::Table, keys: &[&str]) {
    for key in table.keys().filter(|key| !keys.contains(&key.as_str())) {
        let hint = did_you_mean(key, keys.iter().copied());
        problems
            .add(format!("{place}there is no key \"{key}\" (there are {}){hint}", keys.join(", ")));
    }
}

fn text_at(problems: &mut Problems, table: &toml::Table, key: &str) -> Option<String> {
    match table.get(key)? {
        Value::String(text) => Some(text.clone()),
        other => {
            problems.add(format!("{key} expects a text in quotes, not {other}"));
            None
        }
    }
}

fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Integer(i) => Some(*i as f64),
        Value::Float(f) if f.is_finite() => Some(*f),
        _ => None,
    }
}

fn positive_at(problems: &mut Problems, table: &toml::Table, key: &str) -> Option<f64> {
    let value = table.get(key)?;
    let positive = number(value).filter(|v| *v > 0.0);
    if positive.is_none() {
        problems.add(format!("{key} expects a positive number, not {value}"));
    }
    positive
}

fn table_at<'a>(
    problems: &mut Problems,
    table: &'a toml::Table,
    key: &str,
) -> Option<&'a toml::Table> {
    match table.get(key)? {
        Value::Table(inner) => Some(inner),
        other => {
            problems.add(format!("[{key}] must be a table, not {other}"));
            None
        }
    }
}

/// `tank.h = 1` is a table in a table in TOML; here it is the name `tank.h`. Tables that `leaf`
/// accepts are values.
fn flat<'a>(
    table: &'a toml::Table,
    leaf: &dyn Fn(&toml::Table) -> bool,
) -> Vec<(String, &'a Value)> {
    let mut names = Vec::new();
    for (key, value) in table {
        match value {
            Value::Table(inner) if !leaf(inner) => {
                names.extend(flat(inner, leaf).into_iter().map(|(n, v)| (format!("{key}.{n}"), v)))
            }
            _ => names.push((key.clone(), value)),
        }
    }
    names
}

/// A single value as text.
fn plain(value: &Value) -> Option<String> {
    match value {
        Value::String(text) => Some(text.clone()),
        Value::Boolean(b) => Some(b.to_string()),
        Value::Integer(i) => Some(i.to_string()),
        Value::Float(f) if f.is_finite() => Some(f.to_string()),
        _ => None,
    }
}

fn values(problems: &mut Problems, place: &str, table: &toml::Table) -> Values {
    let mut values = Vec::new();
    for (name, value) in flat(table, &|_| false) {
        match plain(value) {
            Some(text) => values.push((name, text)),
            None => problems.add(format!(
                "{place} {name} expects a number, true, false or a text in quotes, not {value}"
            )),
        }
    }
    values
}

fn lists(problems: &mut Problems, table: &toml::Table) -> Vec<(String, Vec<String>)> {
    let mut lists = Vec::new();
    for (name, value) in flat(table, &|_| false) {
        let texts = match value {
            Value::Array(items) if !items.is_empty() => items.iter().map(plain).collect(),
            _ => None,
        };
        match texts {
            Some(texts) => lists.push((name, texts)),
            None => problems.add(format!(
                "[vary] {name} expects a list of values, such as [0.05, 0.1], not {value}"
            )),
        }
    }
    lists
}

fn counts(problems: &mut Problems, table: &toml::Table) -> Vec<(String, i64)> {
    let mut counts = Vec::new();
    for (name, value) in flat(table, &|_| false) {
        match value {
            // room for a run's number above it
            Value::Integer(first) if (0..=i64::from(i32::MAX / 2)).contains(first) => {
                counts.push((name, *first))
            }
            _ => problems.add(format!(
                "[count] {name} expects the whole number to count from, 0 to {}, not {value}",
                i32::MAX / 2
            )),
        }
    }
    counts
}

fn listed(problems: &mut Problems, table: &toml::Table) -> Vec<Listed> {
    let Some(value) = table.get("run") else {
        return Vec::new();
    };
    let Some(runs) = value.as_array() else {
        problems.add("runs are listed as [[run]], with two brackets");
        return Vec::new();
    };
    let mut listed = Vec::new();
    for (i, run) in runs.iter().enumerate() {
        let place = format!("[[run]] number {}:", i + 1);
        let Some(run) = run.as_table() else {
            problems.add(format!("{place} it must be a table, not {run}"));
            continue;
        };
        let mut run = run.clone();
        let name = text_at(problems, &run, "name");
        if name.as_ref().is_some_and(|name| !(1..=budget::NAME).contains(&name.len())) {
            let most = budget::NAME;
            problems.add(format!(
                "{place} its name must have 1 to {most} bytes; without one leave it out"
            ));
        }
        run.remove("name");
        listed.push(Listed { name, values: values(problems, &place, &run) });
    }
    listed
}

fn draws(problems: &mut Problems, table: &toml::Table) -> Option<Draws> {
    known(problems, "[random] ", table, &["runs", "seed", "draw"]);
    let mut whole = |key: &str, least: i64| match table.get(key) {
        Some(Value::Integer(i)) if *i >= least => Some(*i as u64),
        Some(other) => {
            problems
                .add(format!("[random] {key} expects a whole number from {least} on, not {other}"));
            None
        }
        None => {
            problems.add(format!("[random] has no {key}"));
            None
        }
    };
    let (runs, seed) = (whole("runs", 1), whole("seed", 0));
    let Some(Value::Table(inner)) = table.get("draw") else {
        problems.add("[random] has no table [random.draw]");
        return None;
    };
    let mut draw = Vec::new();
    for (name, value) in flat(inner, &|table| table.contains_key("distribution")) {
        let place = format!("[random.draw] {name}: ");
        if let Some(distribution) = distribution(problems, &place, value) {
            draw.push((name, distribution));
        }
    }
    Some(Draws { runs: runs? as usize, seed: seed?, draw })
}

fn distribution(problems: &mut Problems, place: &str, value: &Value) -> Option<Distribution> {
    const KINDS: [(&str, [&str; 2]); 3] = [
        ("normal", ["mean", "deviation"]),
        ("uniform", ["from", "to"]),
        ("lognormal", ["median", "deviation"]),
    ];
    let Some(table) = value.as_table() else {
        problems.add(format!(
            "{place}it expects {{ distribution = \"normal\", mean = 1.0, deviation = 0.1 }} or the \
             like, not {value}"
        ));
        return None;
    };
    let kind = text_at(problems, table, "distribution")?;
    let Some((kind, [first, second])) = KINDS.iter().find(|(name, _)| *name == kind) else {
        let names = KINDS.map(|(name, _)| name);
        let hint = did_you_mean(&kind, names.into_iter());
        problems.add(format!(
            "{place}there is no distribution \"{kind}\" (there are {}){hint}",
            names.join(", ")
        ));
        return None;
    };
    known(problems, place, table, &["distribution", first, second, "min", "max"]);
    let mut of = |key: &str, default: Option<f64>| match table.get(key) {
        None if default.is_none() => {
            problems.add(format!("{place}{kind} expects {key}"));
            None
        }
        None => default,
        Some(value) => {
            let found = number(value);
            if found.is_none() {
                problems.add(format!("{place}{key} expects a number, not {value}"));
            }
            found
        }
    };
    let (a, b) = (of(first, None), of(second, None));
    let (min, max) = (of("min", Some(f64::NEG_INFINITY))?, of("max", Some(f64::INFINITY))?);
    let (a, b) = (a?, b?);
    let (makes_sense, rule, kind) = match *kind {
        "normal" => (b > 0.0, "deviation must be positive", Kind::Normal { mean: a, deviation: b }),
        "uniform" => (a < b, "from must be less than to", Kind::Uniform { from: a, to: b }),
        _ => (
            a > 0.0 && b > 0.0,
            "median and deviation must be positive",
            Kind::Lognormal { median: a, deviation: b },
        ),
    };
    if !makes_sense || min >= max {
        problems.add(format!(
            "{place}{}",
            if makes_sense { "min must be less than max" } else { rule }
        ));
        return None;
    }
    Some(Distribution { kind, min, max })
}

// ---------------------------------------------------------------- drawing

impl Draws {
    /// The values of draw `number`. Every draw has its own stream, so that it stays the same
    /// however many runs there are.
    fn draw(
        &self,
        description: &ModelDescription,
        profile: &Written,
        number: u64,
    ) -> Result<Values> {
        let mut random = Random::new(self.seed, number);
        let mut values = Vec::with_capacity(self.draw.len());
        for (name, distribution) in &self.draw {
            let variable = match name.starts_with("profile.") {
                true => None,
                false => Some(description.variable(name)?),
            };
            let whole = match variable {
                Some(variable) => variable.kind() == Type::Integer,
                None => name.strip_prefix("profile.").is_some_and(|key| profile.is_whole(key)),
            };
            values.push((name.clone(), distribution.draw(&mut random, name, variable, whole)?));
        }
        Ok(values)
    }
}

impl Distribution {
    fn draw(
        &self,
        random: &mut Random,
        name: &str,
        variable: Option<&description::Variable>,
        whole: bool,
    ) -> Result<String> {
        let bound = |text: Option<&String>| text.and_then(|text| text.parse::<f64>().ok());
        let attributes = variable.map(|variable| variable.attributes());
        let min =
            attributes.and_then(|a| bound(a.min.as_ref())).map_or(self.min, |m| m.max(self.min));
        let max =
            attributes.and_then(|a| bound(a.max.as_ref())).map_or(self.max, |m| m.min(self.max));
        for _ in 0..MOST_DRAWS {
            let value = match self.kind {
                Kind::Normal { mean, deviation } => mean + deviation * random.normal(),
                // whole numbers from `from` to `to`, both included
                Kind::Uniform { from, to } if whole => {
                    from + (random.uniform() * (to - from + 1.0)).floor()
                }
                Kind::Uniform { from, to } => from + (to - from) * random.uniform(),
                Kind::Lognormal { median, deviation } => {
                    median * libm::exp(deviation * random.normal())
                }
            };
            let value = if whole { value.round() } else { value };
            if (min..=max).contains(&value) {
                return Ok(value.to_string());
            }
        }
        bail!("{name}: {MOST_DRAWS} draws, none within {min} to {max}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The FMU's own description, without the FMU.
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
    fn every_built_in_plan_has_the_runs_it_should() {
        let counts: Vec<(&str, usize)> = BUILT_IN
            .iter()
            .map(|(name, text)| {
                let plan = Plan::parse(text).unwrap();
                assert!(!plan.title.is_empty(), "{name}");
                (*name, plan.cases(&description()).unwrap().len())
            })
            .collect();
        let expected = [
            ("thesis", 44),
            ("thesis_models", 66),
            ("t1_resonance", 6),
            ("t2_mass", 5),
            ("t3_diameter", 5),
            ("t4_distance", 5),
            ("t5_near_resonance", 27),
            ("t6_high_amplitude", 27),
            ("t7_on_the_axis", 3),
            ("fills", 20),
            ("amplitudes", 30),
            ("monte_carlo", 200),
            ("low_thrust", 8),
            ("slew", 27),
        ];
        assert_eq!(counts, expected);
    }

    #[test]
    fn the_sweeps_of_the_command_line_are_those_of_the_plan_they_leave() {
        let sweeps = |set: &[(&str, &str)]| {
            let set = set.iter().map(|(name, value)| (name.to_string(), value.to_string()));
            Plan::sweeps(Sweeps {
                models: vec!["linear".into(), "spherical".into()],
                fills: FILLS.to_vec(),
                amplitudes: vec![0.0125, 0.1],
                profile: "lin-sweep",
                set: set.collect(),
                tolerance: Some(1e-9),
            })
        };
        let plan = sweeps(&[("friction.model", "viscous")]).unwrap();
        let direct = plan.cases(&description()).unwrap();
        let written = cases(&plan.text);
        assert_eq!(direct.len(), 8);
        assert_eq!(direct[0].name, "linear_50mm_12.5");
        assert_eq!(format!("{direct:?}"), format!("{written:?}"));
        let error = sweeps(&[("tank.h", "0.1")]).unwrap_err().to_string();
        assert_eq!(error, "tank.h stands in [set] and in [vary]");
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
        let of = |model: &'static str| {
            let at = move |h: f64| AMPLITUDES.map(|a| (model.to_string(), h, a));
            FILLS.into_iter().flat_map(at)
        };
        let all = MODELS.into_iter().flat_map(of);
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
    fn listed_runs_meet_every_combination_and_the_last_varies_fastest() {
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
    fn names_are_unique_on_any_file_system() {
        let text = "profile = \"zero:duration=1\"\n[[run]]\nname = \"a b\"\n[[run]]\nname = \"A/b\"\n[[run]]\nname = \"a_b\"";
        assert_eq!(cases_of(text), ["a_b", "A_b_2", "a_b_3"]);
        let text =
            "profile = \"zero\"\n[vary]\nprofile = [\"zero:duration=1\", \"sine:amplitude=0.1\"]";
        assert_eq!(cases_of(text), ["zero", "sine"]);
    }

    #[test]
    fn a_wrong_plan_says_all_that_is_wrong_with_it() {
        let text = "titel = \"x\"\nprofile = 3\nstep = -1\nhold = 1\n\
            [set]\ntank.h = [1]\nprofile.amplitude = 1\n[vary]\ntank.d = 1\n\
            [random]\nruns = 0\n[random.draw]\nhub.I = { distribution = \"norml\" }\n\
            tank.r = { distribution = \"uniform\", from = 2, to = 1, mx = 3 }\n";
        let error = Plan::parse(text).unwrap_err().to_string();
        for words in [
            "there is no key \"titel\" (there are title, profile,",
            "did you mean \"title\"",
            "profile expects a text in quotes, not 3",
            "step expects a positive number, not -1",
            "hold expects true or false, not 1",
            "[set] tank.h expects a number, true, false or a text in quotes, not [1]",
            "[set] profile.amplitude: write it into profile",
            "[vary] tank.d expects a list of values, such as [0.05, 0.1], not 1",
            "[random] runs expects a whole number from 1 on, not 0",
            "[random] has no seed",
            "[random.draw] hub.I: there is no distribution \"norml\" (there are normal, uniform, lognormal); did you mean \"normal\"",
            "[random.draw] tank.r: there is no key \"mx\"",
            "[random.draw] tank.r: from must be less than to",
        ] {
            assert!(error.contains(words), "\"{words}\" is not in:\n{error}");
        }
    }

    #[test]
    fn names_and_values_the_fmu_does_not_have_are_all_named_once() {
        let text = "profile = \"sine\"\nstop = 0.5\n[set]\ntank.hh = 1\nomega = 1\nslosh.model = \"oily\"\ntau_cmd = 1\n\
            [vary]\nprofile.amplitde = [1, 2]\n";
        let error = Plan::parse(text).unwrap().cases(&description()).unwrap_err().to_string();
        for words in [
            "no variable \"tank.hh\"; did you mean \"tank.h\"",
            "omega cannot be set",
            "slosh.model expects one of frozen (1)",
            "tau_cmd comes from the profile",
            "profile sine: it has no parameter \"amplitde\"",
        ] {
            assert_eq!(error.matches(words).count(), 1, "{words}:\n{error}");
        }
        let twice = "profile = \"sine\"\n[set]\ntank.h = 1\n[vary]\ntank.h = [1]\n";
        let error = Plan::parse(twice).unwrap_err().to_string();
        assert_eq!(error, "tank.h stands in [set] and in [vary]");
        let many =
            format!("profile = \"sine\"\n[vary]\ntank.h = {0:?}\ntank.d = {0:?}", [0.1; 400]);
        let error = Plan::parse(&many).unwrap().cases(&description()).unwrap_err().to_string();
        assert!(error.contains("100000 runs"), "{error}");
    }

    #[test]
    fn an_unknown_plan_brings_the_built_in_ones() {
        let error = Plan::read("thesis_model").unwrap_err().to_string();
        assert!(error.contains("did you mean \"thesis_models\""), "{error}");
    }

    const RANDOM: &str = "profile = \"zero:duration=1\"\n[random]\nruns = RUNS\nseed = 3\n[random.draw]\n\
        hub.I = { distribution = \"normal\", mean = 0.3, deviation = 0.01 }\n\
        slosh.zeta = { distribution = \"lognormal\", median = 0.003, deviation = 0.2 }\n\
        friction.b = { distribution = \"uniform\", from = 0.03, to = 0.05 }\n\
        friction.c = { distribution = \"normal\", mean = 0.0, deviation = 0.01, max = 0.02 }\n\
        imu.seed = { distribution = \"uniform\", from = 1, to = 6 }\n";

    #[test]
    fn draws_have_the_distributions_asked_for_within_the_variables_bounds() {
        let cases = cases(&RANDOM.replace("RUNS", "4000"));
        assert_eq!((cases[0].name.as_str(), cases[3999].name.as_str()), ("0001", "4000"));
        let drawn = |i: usize| -> Vec<f64> {
            cases.iter().map(|case| case.varied[i].parse().unwrap()).collect()
        };
        let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
        let deviation = |x: &[f64]| {
            let m = mean(x);
            (x.iter().map(|v| (v - m).powi(2)).sum::<f64>() / x.len() as f64).sqrt()
        };
        // four standard errors of 4000 draws: 0.063 deviations for a mean, 4.5 % for a deviation
        let inertia = drawn(0);
        assert!((mean(&inertia) - 0.3).abs() < 0.01 * 0.063, "{}", mean(&inertia));
        assert!((deviation(&inertia) / 0.01 - 1.0).abs() < 0.045);
        let logarithms: Vec<f64> = drawn(1).iter().map(|zeta| (zeta / 0.003).ln()).collect();
        assert!(mean(&logarithms).abs() < 0.2 * 0.063);
        assert!((deviation(&logarithms) / 0.2 - 1.0).abs() < 0.045);
        let even = drawn(2);
        assert!(even.iter().all(|b| (0.03..0.05).contains(b)));
        assert!((mean(&even) - 0.04).abs() < 0.02 / 12_f64.sqrt() * 0.063);
        // friction.c has the FMU's min 0, and the plan's max
        assert!(drawn(3).iter().all(|c| (0.0..=0.02).contains(c)));
        let seeds = drawn(4);
        for seed in 1..=6 {
            let count = seeds.iter().filter(|s| **s == f64::from(seed)).count();
            // 667 expected; four standard deviations are 94
            assert!(count.abs_diff(667) < 94, "{seed}: {count}");
        }
    }

    #[test]
    fn a_draw_stays_the_same_when_there_are_more_of_them() {
        let (few, many) =
            (cases(&RANDOM.replace("RUNS", "3")), cases(&RANDOM.replace("RUNS", "9")));
        assert_eq!(few[2].settings, many[2].settings);
        assert_ne!(few[0].settings, few[1].settings);
    }

    #[test]
    fn bounds_that_nothing_falls_into_are_named() {
        let text = "profile = \"zero\"\n[random]\nruns = 1\nseed = 1\n[random.draw]\n\
            tank.h = { distribution = \"uniform\", from = -2, to = -1 }\n";
        let error = Plan::parse(text).unwrap().cases(&description()).unwrap_err().to_string();
        assert!(error.contains("tank.h: 10000 draws, none within 0.0001 to 100"), "{error}");
    }

    #[test]
    fn a_torque_file_is_part_of_the_recipe() {
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

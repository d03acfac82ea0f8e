//! Reads the file of a plan. Serde parses each value separately, so that one message can list all problems.

use std::fmt;
use std::ops::Range;

use files::budget;
use host::description::did_you_mean;
use serde::Deserialize;
use serde::de::{DeserializeOwned, IntoDeserializer};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::problems::{Lines, Problems};
use super::{Listed, Named, Onset, Plan, Recorded, STEP};
use crate::profile::Written;
use crate::sensors::Sensor;
use signals::recording::Columns;

#[derive(Deserialize)]
#[serde(untagged)]
enum Scalar {
    Truth(bool),
    Whole(i64),
    Number(f64),
    Text(String),
}

impl Scalar {
    fn is_allowed(&self) -> bool {
        !matches!(self, Scalar::Number(x) if !x.is_finite())
    }
}

impl fmt::Display for Scalar {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Scalar::Truth(value) => value.fmt(f),
            Scalar::Whole(value) => value.fmt(f),
            Scalar::Number(value) => value.fmt(f),
            Scalar::Text(value) => value.fmt(f),
        }
    }
}

const KEYS: [&str; 13] = [
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
    "count",
    "onset",
    "sensor",
];

pub(super) fn read(text: &str, has_lines: bool, problems: &mut Problems) -> Option<Plan> {
    let (table, errors) = DeTable::parse_recoverable(text);
    let table = table.get_ref();
    let mut reader = Reader { text, has_lines, problems };
    for error in &errors {
        let problem = format!("the plan is not valid TOML: {}", error.message());
        reader.add(error.span().unwrap_or_default(), problem);
    }
    if !errors.is_empty() {
        return None;
    }
    reader.check_keys("", table, &KEYS);

    let title = reader.text("", table, "title");
    let profile = reader.text("", table, "profile").and_then(|Named { name, value, lines }| {
        let value = reader.problems.take(&lines, value.parse::<Written>())?;
        Some(Named { name, value, lines })
    });
    if !table.contains_key("profile") {
        let what = "the plan has no profile, such as profile = \"exp-sweep:amplitude=0.1\"";
        reader.problems.add(&Lines::default(), what);
    }
    let input = reader.text("", table, "input");
    let mut positive =
        |key| reader.take("", table, key, "a positive number", |v: &f64| *v > 0.0 && v.is_finite());
    let (step, stop, tolerance) = (positive("step"), positive("stop"), positive("tolerance"));
    let hold = reader.take("", table, "hold", "true or false", |_: &bool| true);

    let set = reader.names(table, "set");
    let set = reader.settings("[set] ", set);
    for Named { name, lines, .. } in &set {
        if name == "profile" || name.starts_with("profile.") {
            reader.problems.add(lines, format!("[set] {name}: write it into profile = \"…\""));
        }
    }
    let vary = reader.names(table, "vary");
    let allowed = |list: &Vec<Scalar>| !list.is_empty() && list.iter().all(Scalar::is_allowed);
    let vary =
        reader.named("[vary] ", vary, "a list of values, such as [0.05, 0.1]", allowed).into_iter();
    let vary = vary.map(|vary| vary.map(|list| list.iter().map(Scalar::to_string).collect()));
    // the first number is at most half of the largest 32-bit integer, so that the number of a run can
    // be added to it
    let most = i64::from(i32::MAX / 2);
    let expected = format!("the whole number to count from, 0 to {most}");
    let count = reader.names(table, "count");
    let count =
        reader.named("[count] ", count, &expected, |first: &i64| (0..=most).contains(first));
    let listed = reader.listed(table);
    let onset = reader.onset(table, profile.as_ref());
    let sensors = reader.sensors(table);
    Some(Plan {
        title: title.map_or(String::new(), |title| title.value),
        text: text.into(),
        profile: profile?,
        step: step.map_or(STEP, |step| step.value),
        stop,
        tolerance: tolerance.map(|tolerance| tolerance.value),
        hold: hold.is_some_and(|hold| hold.value),
        input,
        set,
        vary: vary.collect(),
        listed,
        count,
        onset,
        sensors,
    })
}

type Values<'t, 'i> = Vec<(String, &'t Spanned<DeValue<'i>>)>;

/// Returns values by name. In TOML `tank.h = 1` is a table within a table; here it becomes the name `tank.h`.
fn names<'t, 'i>(table: &'t DeTable<'i>) -> Values<'t, 'i> {
    let mut all = Values::new();
    for (key, value) in table {
        match value.get_ref() {
            DeValue::Table(inner) => {
                let inner = names(inner).into_iter();
                all.extend(inner.map(|(name, v)| (format!("{}.{name}", key.get_ref()), v)));
            }
            _ => all.push((key.get_ref().to_string(), value)),
        }
    }
    all
}

struct Reader<'a> {
    text: &'a str,
    has_lines: bool,
    problems: &'a mut Problems,
}

impl Reader<'_> {
    fn lines(&self, span: Range<usize>) -> Lines {
        match self.has_lines {
            true => Lines::single(1 + self.text[..span.start].matches('\n').count()),
            false => Lines::default(),
        }
    }

    fn add(&mut self, span: Range<usize>, problem: String) {
        let lines = self.lines(span);
        self.problems.add(&lines, problem);
    }

    fn add_unexpected(&mut self, value: &Spanned<DeValue>, expected: &str) {
        let written = self.text[value.span()].split_whitespace().collect::<Vec<_>>().join(" ");
        self.add(value.span(), format!("{expected}, not {written}"));
    }

    fn check_keys(&mut self, place: &str, table: &DeTable, keys: &[&str]) {
        for (key, _) in table {
            let name: &str = key.get_ref();
            if !keys.contains(&name) {
                let (all, hint) = (keys.join(", "), did_you_mean(name, keys.iter().copied()));
                let problem = format!("{place}there is no key \"{name}\" (there are {all}){hint}");
                self.add(key.span(), problem);
            }
        }
    }

    fn value<T: DeserializeOwned>(
        &mut self,
        place: &str,
        (name, value): (String, &Spanned<DeValue>),
        expected: &str,
        allowed: impl Fn(&T) -> bool,
    ) -> Option<Named<T>> {
        let read = T::deserialize(value.clone().into_deserializer()).ok().filter(allowed);
        if read.is_none() {
            self.add_unexpected(value, &format!("{place}{name} expects {expected}"));
        }
        Some(Named { name, value: read?, lines: self.lines(value.span()) })
    }

    fn take<T: DeserializeOwned>(
        &mut self,
        place: &str,
        table: &DeTable,
        key: &str,
        expected: &str,
        allowed: impl Fn(&T) -> bool,
    ) -> Option<Named<T>> {
        self.value(place, (key.into(), table.get(key)?), expected, allowed)
    }

    fn text(&mut self, place: &str, table: &DeTable, key: &str) -> Option<Named<String>> {
        self.take(place, table, key, "a text in quotes", |_| true)
    }

    fn names<'t, 'i>(&mut self, table: &'t DeTable<'i>, key: &str) -> Values<'t, 'i> {
        match table.get(key).map(|value| (value, value.get_ref())) {
            Some((_, DeValue::Table(inner))) => names(inner),
            Some((value, _)) => {
                self.add_unexpected(value, &format!("[{key}] must be a table"));
                Values::new()
            }
            None => Values::new(),
        }
    }

    fn named<T: DeserializeOwned>(
        &mut self,
        place: &str,
        values: Values,
        expected: &str,
        allowed: impl Fn(&T) -> bool,
    ) -> Vec<Named<T>> {
        let read = |value| self.value(place, value, expected, &allowed);
        values.into_iter().filter_map(read).collect()
    }

    fn settings(&mut self, place: &str, values: Values) -> Vec<Named<String>> {
        let expected = "a number, true, false or a text in quotes";
        let scalars = self.named(place, values, expected, Scalar::is_allowed);
        scalars.into_iter().map(|scalar| scalar.map(|value| value.to_string())).collect()
    }

    fn listed(&mut self, table: &DeTable) -> Vec<Listed> {
        let Some(value) = table.get("run") else { return Vec::new() };
        let Some(runs) = value.get_ref().as_array() else {
            self.add(value.span(), "runs are listed as [[run]], with two brackets".into());
            return Vec::new();
        };
        let mut listed = Vec::new();
        for (i, run) in runs.iter().enumerate() {
            let place = format!("[[run]] number {}: ", i + 1);
            let Some(table) = run.get_ref().as_table() else {
                self.add_unexpected(run, &format!("{place}it must be a table"));
                continue;
            };
            let most = budget::NAME;
            let rule = format!(
                "must have 1 to {most} bytes (for a run without a name, leave the key out)"
            );
            let expected = format!("a text in quotes, which {rule}");
            let allowed = |name: &String| (1..=most).contains(&name.len());
            let name = self.take(&place, table, "name", &expected, allowed);
            let recording = self.recording(&place, table);
            let own = ["name", "recording", "columns"];
            let values = names(table).into_iter();
            let values = values.filter(|(key, _)| !own.contains(&key.as_str()));
            let values = self.settings(&place, values.collect());
            listed.push(Listed { name: name.map(|name| name.value), values, recording });
        }
        listed
    }

    fn recording(&mut self, place: &str, table: &DeTable) -> Option<Recorded> {
        let columns = self.text(place, table, "columns");
        let columns = match columns {
            Some(Named { value, lines, .. }) => self.problems.take(&lines, value.parse())?,
            None => Columns::default(),
        };
        match self.text(place, table, "recording") {
            Some(file) => Some(Recorded { path: file.value.into(), columns }),
            None => {
                if let Some((key, _)) = table.get_key_value("columns") {
                    self.add(
                        key.span(),
                        format!("{place}columns needs a recording, which is missing"),
                    );
                }
                None
            }
        }
    }

    fn sensors(&mut self, table: &DeTable) -> Vec<Sensor> {
        let texts = self.names(table, "sensor");
        let texts = self.named("[sensor] ", texts, "a text in quotes", |_: &String| true);
        let new = |one: &Named<String>, problems: &mut Problems| {
            problems.take(&one.lines, Sensor::new(&one.name, &one.value))
        };
        texts.iter().filter_map(|one| new(one, self.problems)).collect()
    }

    fn onset(&mut self, table: &DeTable, profile: Option<&Named<Written>>) -> Option<Onset> {
        let (header, value) = table.get_key_value("onset")?;
        let Some(inner) = value.get_ref().as_table() else {
            self.add_unexpected(value, "[onset] must be a table");
            return None;
        };
        self.check_keys("[onset] ", inner, &["frequency", "amplitude"]);
        for key in ["frequency", "amplitude"].iter().filter(|key| !inner.contains_key(**key)) {
            self.add(header.span(), format!("[onset] has no {key}"));
        }
        let ascend =
            |list: &[f64]| list.is_sorted_by(|a, b| a < b) && list.iter().all(|v| *v > 0.0);
        let two = "two frequencies in Hz, such as [2.3, 2.5]";
        let frequency =
            self.take("[onset] ", inner, "frequency", two, |list: &[f64; 2]| ascend(list));
        let several = "ascending torques in N·m, at least two, such as [0.03, 0.1]";
        let amplitude = self.take("[onset] ", inner, "amplitude", several, |list: &Vec<f64>| {
            list.len() > 1 && ascend(list)
        });
        if profile.is_some_and(|profile| profile.value.name() != "sine") {
            self.add(header.span(), "[onset] expects a profile of one frequency, sine".into());
        }
        let lines = self.lines(header.span());
        Some(Onset {
            frequency: frequency?.value,
            amplitude: amplitude?.value,
            found: false,
            lines,
        })
    }
}

//! Stored runs, and the decision whether a stored run can be reused.

use std::collections::BTreeMap;
use std::path::Path;

use files::store::{Damage, MANIFEST};
use host::fmu::Fmu;

use crate::plan::Case;
use crate::run::{self, Run};
use crate::sensors::Sensors;
use signals::table::{self, Table};

/// Version of the format of stored runs. It is increased if runs that an older version has stored would be
/// read with another meaning.
const FORMAT: &str = "1";

/// Returns the recipe of a run, which contains everything that determines its numbers. Two runs with the same
/// recipe are the same run, independent of the archive of the FMU. The recipe is a part of the metadata of
/// the run's Parquet file:
///
/// * `model`, `binary_sha256`: the model's name and the hash of the binary that was loaded,
/// * `parameters`: every parameter and input with its start value, as a JSON object,
/// * `settings`: the start values that the plan sets, `name=value` in the order of setting, separated by spaces,
/// * `profile`: the torque; `torque_sha256`: the hash of its file, if it comes from a file,
/// * `step`, `stop`: s; `tolerance`: the relative tolerance passed to the FMU,
/// * `torque`: whether the torque is linear over each step or held,
/// * `sensors`: the recorded sensors, as a JSON object, if there are any,
/// * `columns`: the recorded variables; `format`: version of the recipe.
pub fn recipe(fmu: &Fmu, case: &Case, columns: &[String]) -> BTreeMap<String, String> {
    let settings: Vec<_> = case.settings.iter().map(|(k, v)| format!("{k}={v}")).collect();
    let torque = if case.hold { "held over each step" } else { "linear over each step" };
    let parameters = run::parameters(fmu.description(), &case.settings, case.input.as_slice());
    let mut recipe = BTreeMap::from(
        [
            ("format", FORMAT.to_string()),
            ("model", fmu.description().model_name.clone()),
            ("binary_sha256", fmu.binary_hash().to_string()),
            ("parameters", serde_json::json!(parameters).to_string()),
            ("settings", settings.join(" ")),
            ("profile", case.profile.clone()),
            ("step", case.step.to_string()),
            ("stop", case.stop.to_string()),
            ("tolerance", case.tolerance.map_or("the FMU's own".into(), |t| t.to_string())),
            ("torque", torque.to_string()),
            ("columns", columns.join(",")),
        ]
        .map(|(key, value)| (key.to_string(), value)),
    );
    if !case.sensors.is_empty() {
        let texts: BTreeMap<_, _> = case.sensors.iter().map(|s| (&s.name, &s.text)).collect();
        recipe.insert("sensors".into(), serde_json::json!(texts).to_string());
    }
    if let Some(hash) = &case.torque_sha256 {
        recipe.insert("torque_sha256".into(), hash.clone());
    }
    recipe
}

/// A stored run. `lacks_sensors` is true if the table contains the signals for the sensors but not their readings,
/// because another program wrote it.
pub struct Stored {
    pub table: Table,
    pub lacks_sensors: bool,
}

#[derive(Debug, thiserror::Error)]
pub enum Unusable {
    #[error(transparent)]
    Damaged(Damage),
    #[error("the file is incomplete")]
    Incomplete,
    #[error("the file has {rows} rows, but the run needs {expected}")]
    Rows { rows: usize, expected: usize },
    #[error("the stored run has sensors that the plan does not have")]
    Sensors,
    #[error("{0}")]
    Differs(String),
}

/// Returns the stored run if it is complete and has this recipe; otherwise the reason why it cannot be reused.
pub fn stored(
    path: &Path,
    run: &Run,
    recipe: &BTreeMap<String, String>,
    (columns, sensors): (&[String], &Sensors),
) -> Result<Stored, Unusable> {
    let found = table::metadata(path).map_err(|_| Unusable::Incomplete)?;
    if let Some(why) = difference(&found, recipe) {
        return Err(Unusable::Differs(why));
    }
    if found.contains_key("sensors") && !recipe.contains_key("sensors") {
        return Err(Unusable::Sensors);
    }
    let there = table::names(path).map_err(|_| Unusable::Incomplete)?;
    let lacks_sensors = sensors.columns().iter().any(|column| !there.contains(column));
    let mut names: Vec<&str> = columns.iter().map(String::as_str).collect();
    if lacks_sensors {
        let needs = sensors
            .required_variables()
            .into_iter()
            .filter(|name| !columns.iter().any(|c| c == name));
        names.extend(needs);
    }
    let table = Table::read(path, &names).map_err(|_| Unusable::Incomplete)?;
    let last = table.column("time").and_then(|time| time.last()).copied();
    if table.rows() != run.steps() + 1 || last != Some(run.stop) {
        return Err(Unusable::Rows { rows: table.rows(), expected: run.steps() + 1 });
    }
    Ok(Stored { table, lacks_sensors })
}

const NAMED: usize = 3;

fn difference(
    found: &BTreeMap<String, String>,
    wanted: &BTreeMap<String, String>,
) -> Option<String> {
    let read = |notes: &BTreeMap<String, String>| -> BTreeMap<String, String> {
        let text = notes.get("parameters").map_or("", String::as_str);
        serde_json::from_str(text).unwrap_or_default()
    };
    // a difference that causes others is named first: parameters before the settings that set them
    const ORDER: [&str; 4] = ["format", "model", "binary_sha256", "parameters"];
    let rest = wanted.keys().map(String::as_str).filter(|key| !ORDER.contains(key));
    // runs with equal parameters are the same, even if they were set in another way
    let keys = ORDER.into_iter().chain(rest).filter(|key| *key != "settings");
    for key in keys {
        let (was, is) = (found.get(key), &wanted[key]);
        if was == Some(is) {
            continue;
        }
        let Some(was) = was else { return Some(format!("the metadata of the file have no {key}")) };
        return Some(match key {
            "parameters" => {
                let (was, is) = (read(found), read(wanted));
                let text = |value: Option<&String>| value.map_or("missing".into(), String::clone);
                let names = is.keys().chain(was.keys().filter(|name| !is.contains_key(*name)));
                let differ: Vec<String> = names
                    .filter(|name| was.get(*name) != is.get(*name))
                    .map(|name| {
                        format!("{name} was {}, is {}", text(was.get(name)), text(is.get(name)))
                    })
                    .collect();
                match differ.len().checked_sub(NAMED) {
                    None | Some(0) => differ.join("; "),
                    Some(more) => format!("{}; and {more} more", differ[..NAMED].join("; ")),
                }
            }
            "binary_sha256" => "the FMU's binary was another one".into(),
            "torque_sha256" => "the torque file has changed".into(),
            _ => format!("{key} was {was}, is {is}"),
        });
    }
    None
}

pub fn because(case: &Case, why: &Unusable) -> String {
    format!("re-running {}: {why}", case.name)
}

pub fn unverified(case: &Case) -> String {
    format!(
        "reusing {}: another program stored it, and it has no line in {MANIFEST} yet",
        case.name
    )
}

#[cfg(test)]
mod tests {
    use super::difference;
    use std::collections::BTreeMap;

    fn notes(pairs: &[(&str, &str)]) -> BTreeMap<String, String> {
        pairs.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect()
    }

    #[test]
    fn a_changed_parameter_is_named_with_both_values() {
        let with = |b: &str| {
            let all = format!("{{\"friction.b\":\"{b}\",\"tank.h\":\"0.1\"}}");
            notes(&[("binary_sha256", "a"), ("format", "1"), ("model", "M"), ("parameters", &all)])
        };
        assert_eq!(difference(&with("0.03793"), &with("0.03793")), None);
        let why = difference(&with("0.03793"), &with("0.04")).unwrap();
        assert_eq!(why, "friction.b was 0.03793, is 0.04");
        let mut other = with("0.04");
        other.insert("binary_sha256".into(), "b".into());
        let why = difference(&other, &with("0.05")).unwrap();
        assert_eq!(why, "the FMU's binary was another one", "that alone decides");
    }
}

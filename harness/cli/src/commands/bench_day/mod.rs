//! `hubslosh analyse --bench-day`: analyses the recordings of one day at the bench and writes one report.
//!
//! The sine sweeps become a plan whose runs are recordings, so that a campaign analyses them and simulates the slosh
//! models under the same torque. Friction runs, free decays and the gyro at rest become chapters of the campaign's page.

mod chapters;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use experiments::campaign::{Campaign, recorded};
use experiments::plan::{AMPLITUDE, Draft, Plan, Recorded};
use files::{input, output};
use identify::input::tolerance::Tolerances;
use names::hubslosh::{slosh, tank};
use serde::Deserialize;
use signals::recording::Columns;

use super::campaign::drive;
use super::open;
use crate::terminal;

const MANIFEST: &str = "day.toml";

/// Kind of a recording that day.toml lists. Numbers in parentheses are sections of Rubaga's thesis.
///
/// - `Friction`: a ramp, step or sweep of the torque with the tank empty (5.2).
/// - `Decay`: a push and the free decay after it, with the tank empty and an encoder (5.4).
/// - `Rest`: a recording of the gyro while the hub stands still (5.5).
/// - `Sweep`: a sine sweep with liquid (chapters 6 and 7).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Friction,
    Decay,
    Rest,
    Sweep,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Manifest {
    #[serde(default = "title")]
    title: String,
    #[serde(default)]
    columns: String,
    #[serde(default = "profile")]
    profile: String,
    #[serde(default = "models")]
    models: Vec<String>,
    #[serde(default)]
    tolerance: String,
    #[serde(default = "gyro_scale")]
    gyro_scale: f64,
    #[serde(default)]
    set: toml::Table,
    recording: Vec<Entry>,
}

fn title() -> String {
    "A day at the bench".into()
}

fn profile() -> String {
    "exp-sweep:f0=1.25,f1=3.5,duration=2700".into()
}

fn gyro_scale() -> f64 {
    0.01
}

fn models() -> Vec<String> {
    vec!["linear".into(), "spherical".into()]
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    kind: Kind,
    file: PathBuf,
    columns: Option<String>,
    fill: Option<toml::Value>,
    amplitude: Option<toml::Value>,
}

struct Item {
    kind: Kind,
    recorded: Recorded,
    fill: Option<toml::Value>,
    amplitude: Option<toml::Value>,
}

struct Day {
    manifest: Manifest,
    tolerances: Tolerances,
    items: Vec<Item>,
    settings: Vec<(String, String)>,
}

impl Day {
    fn read(directory: &Path) -> Result<Day> {
        let path = directory.join(MANIFEST);
        let text = input::text(&path).with_context(|| {
            format!(
                "{} is needed: it lists the recordings, their kinds, fills and torques",
                path.display()
            )
        })?;
        let name = path.display().to_string();
        let mut manifest: Manifest = toml::from_str(&text).with_context(|| name.clone())?;
        let items =
            std::mem::take(&mut manifest.recording).into_iter().enumerate().map(|(i, entry)| {
                let Entry { kind, file, columns, fill, amplitude } = entry;
                let place = format!("{name}: [[recording]] {} ({})", i + 1, file.display());
                let is_sweep = kind == Kind::Sweep;
                for (key, value) in [("fill", &fill), ("amplitude", &amplitude)] {
                    ensure!(
                        value.is_some() == is_sweep,
                        "{place}: {key} {} (it belongs to kind = \"sweep\")",
                        if is_sweep { "is missing" } else { "is not allowed here" }
                    );
                }
                let columns: Columns =
                    columns.as_ref().unwrap_or(&manifest.columns).parse().with_context(|| place)?;
                Ok(Item {
                    kind,
                    recorded: Recorded { path: directory.join(file), columns },
                    fill,
                    amplitude,
                })
            });
        let items = items.collect::<Result<Vec<Item>>>()?;
        let tolerances = match manifest.tolerance.as_str() {
            "" => Tolerances::default(),
            text => {
                Tolerances::default().with(text).with_context(|| format!("{name}: tolerance"))?
            }
        };
        ensure!(
            (0.0..0.5).contains(&manifest.gyro_scale),
            "{name}: gyro_scale = {} (allowed: 0 to 0.5)",
            manifest.gyro_scale
        );
        ensure!(
            items.iter().any(|item| item.kind == Kind::Sweep),
            "{name}: no [[recording]] has kind = \"sweep\"; without sweeps, fit the friction runs by hubslosh identify friction"
        );
        let mut settings = Vec::new();
        flatten("", &manifest.set, &mut settings);
        Ok(Day { manifest, tolerances, items, settings })
    }

    fn items_of_kind(&self, kind: Kind) -> impl Iterator<Item = &Item> {
        self.items.iter().filter(move |item| item.kind == kind)
    }

    /// Returns a plan for a campaign, in which each sweep is a recording that is simulated with
    /// every slosh model. `found` are parameters from the friction runs; the simulations use them
    /// unless day.toml sets them.
    fn plan(self, found: Vec<(String, String)>) -> Result<Plan> {
        let read = |item: &Item| recorded::read(&item.recorded, &mut |_| {}).ok();
        let Some((step, _)) = self.items_of_kind(Kind::Sweep).find_map(read) else {
            bail!("none of the sweeps that {MANIFEST} lists can be read")
        };
        let run = |item: &Item| {
            let values = [(tank::H, item.fill.clone()), (AMPLITUDE, item.amplitude.clone())];
            let given = values.into_iter().filter_map(|(name, value)| Some((name, value?)));
            Draft::run(&item.recorded, given)
        };
        let runs = self.items_of_kind(Kind::Sweep).map(run).collect();
        let mut set = self.settings;
        for (name, value) in found {
            if set.iter().all(|(other, _)| *other != name) {
                set.push((name, value));
            }
        }
        let Manifest { title, profile, models, .. } = self.manifest;
        let (step, vary) = (Some((step * 1e9).round() / 1e9), vec![(slosh::MODEL, models)]);
        Draft { title, profile, step, set, runs, vary, tolerance: None }.plan()
    }
}

/// Appends the values of nested tables to `values` under dotted names, as the FMU names its
/// parameters: `[tank] h = 0.08` becomes `tank.h`. `prefix` is the name of the outer tables, with a
/// full stop at its end.
fn flatten(prefix: &str, table: &toml::Table, values: &mut Vec<(String, String)>) {
    for (key, value) in table {
        let name = format!("{prefix}{key}");
        match value {
            toml::Value::Table(inner) => flatten(&format!("{name}."), inner, values),
            toml::Value::String(text) => values.push((name, text.clone())),
            other => values.push((name, other.to_string())),
        }
    }
}

/// Analyses the bench day in `directory`, and writes its tables and report to `out`, by default to
/// a folder in dist with the name of `directory`. At most `jobs` runs are simulated at the same
/// time.
pub fn run(directory: &Path, fmu: &Path, jobs: usize, out: Option<PathBuf>) -> Result<()> {
    let day = Day::read(directory)?;
    let fmu = open(fmu)?;
    let (mut problems, mut found) = (Vec::new(), Vec::new());
    let (chapters, bearing) = chapters::chapters(&day, &fmu, &mut problems, &mut found)?;
    for problem in &problems {
        terminal::error(problem);
    }
    let mut plan = day.plan(found)?;
    plan.convert_units(fmu.description());
    plan.cases(fmu.description())?;
    let stem = directory.canonicalize()?;
    let stem = stem.file_name().unwrap_or_default();
    let out = out.unwrap_or_else(|| Path::new("dist").join(stem));
    let campaign = Campaign { plan, force: false, jobs, out };
    let store = campaign.take()?;
    if let Some(bearing) = bearing {
        let text = bearing.json()?;
        output::write(&campaign.out.join("friction.json"), text.as_bytes())?;
    }
    drive(&fmu, &campaign, store, chapters)?;
    ensure!(
        problems.is_empty(),
        "{} recordings could not be used; the report says why",
        problems.len()
    );
    Ok(())
}

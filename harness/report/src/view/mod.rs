//! One run, to be looked at: a self-contained page with bench or craft in 3-D, its liquid, and plots that follow the time.
//!
//! Nothing is simulated: all that moves stands in the run's table, or follows from a column by a formula that the page names.

mod data;
mod geometry;

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, ensure};
use experiments::sensors::quantity::Coordinate;
use host::description::ModelDescription;
use maud::{DOCTYPE, PreEscaped, html};
use serde_json::{Value, json};
use signals::table::Table;

use self::data::{Thinning, integral, peak};
pub use self::geometry::{Drawing, Outline, Surfaces};
use self::geometry::{Parameters, Pendulum, Tank};
use crate::campaign::{PLOTLY, PLOTLY_LICENSE};

/// A run and what is known of it.
pub struct Run<'a> {
    /// What stands above the page.
    pub title: String,
    /// Its file, for messages.
    pub source: String,
    /// The description of the FMU that made it.
    pub description: &'a ModelDescription,
    /// Parameters that differ from the FMU's start values, or all, by name, as text.
    pub parameters: &'a BTreeMap<String, String>,
    /// Whether the parameters come with the run; else they are the FMU's start values and what the user says.
    pub parameters_known: bool,
    /// Tanks that somebody has drawn, by number from 1.
    pub drawings: &'a BTreeMap<usize, Drawing>,
    /// Its columns, `time` among them.
    pub table: &'a Table,
}

/// A page and what is to be said about it.
pub struct Page {
    /// The page.
    pub html: String,
    /// Sentences on what is not drawn as it is.
    pub warnings: Vec<String>,
}

/// Whose variables an FMU has.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Bench,
    Craft,
    Tank,
}

fn kind(description: &ModelDescription) -> Option<Kind> {
    let has = |name: &str| description.variable(name).is_ok();
    [
        ("slosh_angle_radial", Kind::Bench),
        ("tank[1].p[1,1]", Kind::Craft),
        ("tank.p[1,1]", Kind::Tank),
    ]
    .into_iter()
    .find_map(|(name, kind)| has(name).then_some(kind))
}

/// Families of columns that share a panel, the most looked at first; a name with `*` is a beginning.
const BENCH_PANELS: [(&str, &[&str]); 7] = [
    ("Torque on the hub", &["tau_actuator", "tau_cmd", "tau_ext", "tau_friction", "tau_fluid"]),
    ("Rate of the hub", &["omega", "omega_imu"]),
    ("Slosh angle", &["slosh_angle", "slosh_angle_radial"]),
    ("Wave at the wall", &["wave_height"]),
    ("Force of the liquid on the tank", &["F_radial", "F_tangential"]),
    ("Angle of the hub", &["theta"]),
    ("Energy", &["energy", "work", "heat"]),
];

/// Most panels of plots.
const MOST_PANELS: usize = 8;

/// Angle of a full arc, rad.
const FULL_ARC: f64 = 2.4;

/// All columns that a page can use, in the order of a table: the answer to "which columns shall I record?".
pub fn columns(
    description: &ModelDescription,
    parameters: &BTreeMap<String, String>,
) -> Vec<String> {
    let parameters = Parameters { description, set: parameters };
    let of = |names: &[&str]| names.iter().map(|n| n.to_string()).collect::<Vec<_>>();
    let mut all = match kind(description) {
        Some(Kind::Bench) => {
            let all = of(&[
                "theta",
                "omega",
                "slosh_angle",
                "slosh_angle_radial",
                "wave_height",
                "tau_actuator",
                "tau_friction",
                "tau_fluid",
                "F_radial",
                "F_tangential",
                "wheel_speed",
            ]);
            let modes = parameters.number("slosh.modes") as usize;
            all.into_iter().chain((2..=modes).flat_map(coordinates)).collect()
        }
        Some(Kind::Craft) => {
            let q = (1..=4).map(|i| format!("q[{i}]"));
            q.chain(["omega", "slosh_force", "slosh_torque"].iter().flat_map(|n| three(n)))
                .collect()
        }
        Some(Kind::Tank) => ["force", "torque"].iter().flat_map(|n| three(n)).collect(),
        None => Vec::new(),
    };
    for (prefix, modes) in prefixes(&parameters) {
        for n in 1..=modes {
            all.extend((1..=3).map(|i| format!("{prefix}.p[{n},{i}]")));
        }
        all.push(format!("{prefix}.wave_height"));
        if parameters.number(&format!("{prefix}.fill.points")) > 1.0 {
            all.push(format!("{prefix}.liquid"));
        }
    }
    all
}

/// Beginnings of the tanks' variables and how many modes each tank has; none of the bench.
fn prefixes(parameters: &Parameters) -> Vec<(String, usize)> {
    let all: Vec<String> = match kind(parameters.description) {
        Some(Kind::Craft) => (1..=(parameters.number("tanks") as usize).max(1))
            .map(|i| format!("tank[{i}]"))
            .collect(),
        Some(Kind::Tank) => vec!["tank".into()],
        _ => Vec::new(),
    };
    let modes = |prefix: &str| (parameters.number(&format!("{prefix}.modes")) as usize).max(1);
    all.into_iter()
        .map(|prefix| {
            let n = modes(&prefix);
            (prefix, n)
        })
        .collect()
}

/// The columns that move something, with what is missing.
#[derive(Default)]
struct Columns<'a> {
    table: Option<&'a Table>,
    missing: Vec<String>,
    moving: BTreeSet<String>,
}

impl Columns<'_> {
    fn has(&self, name: &str) -> bool {
        self.table.is_some_and(|table| table.column(name).is_some())
    }

    /// Takes all of `names`, or none.
    fn take(&mut self, names: &[String]) -> bool {
        let there = names.iter().all(|name| self.has(name));
        if there {
            self.moving.extend(names.iter().cloned());
        }
        there
    }

    /// Takes the first list that is there, else the first one is missing.
    fn need(&mut self, lists: &[Vec<String>]) -> Option<usize> {
        let found = (0..lists.len()).find(|i| self.take(&lists[*i]));
        if found.is_none() {
            let ways: Vec<String> = lists.iter().map(|list| list.join(", ")).collect();
            self.missing.push(ways.join(" (or ") + &")".repeat(ways.len() - 1));
        }
        found
    }
}

/// The coordinates of mode `n` of HubSlosh, from 1.
fn coordinates(n: usize) -> [String; 2] {
    ["radial", "tangential"].map(|along| format!("slosh.q_{along}[{n}]"))
}

/// Slosh angles, radial and tangential, of HubSlosh's modes after the first, of which the FMU shows states alone: as far as
/// those are recorded.
fn higher_modes(table: &Table, model: &str, modes: &[Pendulum]) -> Vec<[Vec<f64>; 2]> {
    let Some(coordinate) = Coordinate::of(model) else { return Vec::new() };
    let recorded = (2..).zip(&modes[1..]).map_while(|(n, mode)| {
        let [radial, tangential] = coordinates(n);
        let y = table.column(&tangential)?;
        let x = match (coordinate, table.column(&radial)) {
            (_, Some(x)) => x.to_vec(),
            // in a plane it is unused
            (Coordinate::Angle, None) => vec![0.0; y.len()],
            _ => return None,
        };
        let angles = |(x, y): (&f64, &f64)| coordinate.angles([*x, *y], mode.length);
        let all: Vec<[f64; 2]> = x.iter().zip(y).map(angles).collect();
        Some([0, 1].map(|axis| all.iter().map(|angles| angles[axis]).collect()))
    });
    recorded.collect()
}

/// Masses of liquid at which a draining tank's surfaces are computed.
const MASSES: usize = 9;

/// Evenly from the least of these to the largest.
fn spread(values: &[f64]) -> Vec<f64> {
    let [low, high] =
        [f64::min, f64::max].map(|of| values.iter().copied().reduce(of).unwrap_or(0.0));
    let count = if high > low { MASSES } else { 1 };
    let step = (high - low) / (count - 1).max(1) as f64;
    (0..count).map(|i| low + step * i as f64).collect()
}

fn three(name: &str) -> Vec<String> {
    (1..=3).map(|i| format!("{name}[{i}]")).collect()
}

/// Fails with what a page needs and how it is recorded.
///
/// # Errors
/// If the FMU is none of this project's kinds, columns are missing, or the table has fewer than two rows.
pub fn page(run: &Run) -> Result<Page> {
    let parameters = Parameters { description: run.description, set: run.parameters };
    let source = &run.source;
    let Some(kind) = kind(run.description) else {
        anyhow::bail!(
            "{source}: a run of {} cannot be drawn (allowed: HubSlosh, Spacecraft, SloshTank)",
            run.description.model_name
        );
    };
    let mut columns = Columns { table: Some(run.table), ..Columns::default() };
    let mut notes: Vec<String> = Vec::new();
    let mut warnings: Vec<String> = Vec::new();
    let mut derived: Vec<(String, Vec<f64>)> = Vec::new();
    let time = run.table.column("time").unwrap_or_default();
    let one = |name: &str| vec![name.to_string()];

    // what moves the body
    let mut motion = json!({});
    if kind == Kind::Bench {
        match columns.need(&[one("theta"), one("omega")]) {
            Some(1) => {
                derived.push((
                    "theta".into(),
                    integral(time, run.table.column("omega").unwrap_or_default()),
                ));
                notes.push("The hub's angle is the integral of omega by the trapezoidal rule from 0: theta is not in the table.".into());
            }
            _ => motion["theta"] = json!("theta"),
        }
        motion["theta"] = json!("theta");
        if let Some(speed) = run.table.column("wheel_speed") {
            derived.push(("wheel_angle".into(), integral(time, speed)));
            motion["wheel"] = json!("wheel_angle");
        }
    } else if kind == Kind::Craft {
        let q: Vec<String> = (1..=4).map(|i| format!("q[{i}]")).collect();
        columns.need(std::slice::from_ref(&q));
        motion["q"] = json!(q);
        notes.push("The view follows O; the faint circles are directions that do not turn.".into());
    } else {
        notes.push("The host's frame stands still here: a tank alone knows no attitude.".into());
    }

    // tanks and their pendulums
    let drawing = |i: usize| run.drawings.get(&(i + 1));
    let mut tanks: Vec<Tank> = match kind {
        Kind::Bench => vec![geometry::bench(&parameters, drawing(0))],
        _ => prefixes(&parameters)
            .iter()
            .enumerate()
            .map(|(i, (prefix, _))| geometry::tank(&parameters, prefix, drawing(i)))
            .collect(),
    };
    if let Some(number) = run.drawings.keys().find(|n| **n == 0 || **n > tanks.len()) {
        anyhow::bail!("--tank {number}: the run has {} tank(s) (allowed: 1 to that)", tanks.len());
    }
    let mut tank_columns = Vec::new();
    for (i, tank) in tanks.iter_mut().enumerate() {
        let prefix = &tank.prefix;
        let mut of_modes = Vec::new();
        if kind == Kind::Bench && !tank.modes.is_empty() {
            let model = parameters.choice("slosh.model", "slosh.kind");
            let planar = ["linear", "planar"].contains(&model.as_str());
            let both = vec!["slosh_angle_radial".to_string(), "slosh_angle".to_string()];
            let lists = if planar && run.parameters_known {
                vec![both, one("slosh_angle")]
            } else {
                vec![both]
            };
            let found = columns.need(&lists);
            let radial = (found == Some(0)).then_some("slosh_angle_radial");
            of_modes.push(json!({ "angles": [radial, "slosh_angle"] }));
            let higher = higher_modes(run.table, &model, &tank.modes);
            for (n, angles) in (2..).zip(higher) {
                let names = ["radial", "tangential"].map(|along| format!("{along} angle {n}"));
                of_modes.push(json!({ "angles": names }));
                derived.extend(names.into_iter().zip(angles));
            }
            let (drawn, all) = (of_modes.len(), tank.modes.len());
            tank.modes.truncate(drawn);
            match all {
                _ if drawn < all => {
                    let missing: Vec<String> = (drawn + 1..=all).flat_map(coordinates).collect();
                    let sentence = format!(
                        "{drawn} of {all} slosh modes are drawn: the run does not have {}",
                        missing.join(", ")
                    );
                    notes.push(format!("Note: {sentence}."));
                    warnings.push(format!(
                        "{source}: {sentence} (all that is drawn: `hubslosh run … --columns {}`)",
                        self::columns(run.description, run.parameters).join(",")
                    ));
                }
                2.. => notes.push(format!(
                    "Slosh angles of modes 2 to {all} follow from the states slosh.q_radial and slosh.q_tangential."
                )),
                _ => {}
            }
        }
        for n in (1..=tank.modes.len()).filter(|_| kind != Kind::Bench) {
            let p: Vec<String> = (1..=3).map(|i| format!("{prefix}.p[{n},{i}]")).collect();
            let angles: Vec<String> =
                ["x", "y"].map(|axis| format!("{prefix}.angle_{axis}[{n}]")).to_vec();
            match columns.need(&[p.clone(), angles.clone()]) {
                Some(1) => of_modes.push(json!({ "angles": angles })),
                _ => of_modes.push(json!({ "p": p })),
            }
        }
        let mut entry = json!({ "modes": of_modes });
        if let Some(fill) = &tank.fill {
            let name = format!("{prefix}.liquid");
            if columns.need(&[one(&name)]).is_some() {
                let liquid = run.table.column(&name).unwrap_or_default();
                let mut add = |what: String, values: Vec<f64>| {
                    derived.push((what.clone(), values));
                    json!(what)
                };
                entry["level"] =
                    add(format!("{prefix} level"), liquid.iter().map(|m| fill.level(*m)).collect());
                for n in 0..tank.modes.len() {
                    for (k, key) in ["length", "hinge"].into_iter().enumerate() {
                        let values = liquid.iter().map(|m| fill.mode(n, *m)[k]).collect();
                        entry["modes"][n][key] = add(format!("{prefix} {key} {}", n + 1), values);
                    }
                }
            }
        }
        let surfaces = drawing(i).and_then(|drawing| drawing.surfaces.as_ref());
        if let Some(surfaces) = surfaces.filter(|_| !tank.modes.is_empty()) {
            let of = |mass: &f64| {
                let shapes = surfaces(*mass, tank.modes.len());
                shapes.with_context(|| format!("--tank {}: with {mass} kg of liquid", i + 1))
            };
            let name = format!("{prefix}.liquid");
            match tank.fill.as_ref().and(run.table.column(&name)) {
                Some(liquid) => {
                    let masses = spread(liquid);
                    let shapes = masses.iter().map(of).collect::<Result<Vec<_>>>()?;
                    entry["surfaces"] =
                        json!({ "liquid": name, "masses": masses, "shapes": shapes });
                }
                None => tank.shapes = of(&tank.liquid)?,
            }
        }
        tank_columns.push(entry);
    }
    ensure!(
        columns.missing.is_empty() && columns.has("time"),
        "{source} cannot be drawn: it has no {}.\nRecord what is drawn by `hubslosh run … --columns {}`; what it has: {}",
        if columns.has("time") { columns.missing.join("; no ") } else { "time".into() },
        self::columns(run.description, run.parameters).join(","),
        run.table.names().join(", ")
    );
    ensure!(
        time.len() > 1,
        "{source} cannot be drawn: it has {} row(s) (allowed: two or more)",
        time.len()
    );
    if let Some(k) = time.windows(2).position(|pair| pair[1] <= pair[0]) {
        anyhow::bail!(
            "{source} cannot be drawn: time does not rise after row {}, {} s",
            k + 1,
            time[k]
        );
    }

    let scene = scene(kind, &parameters, &tanks, run.table, &mut columns, &mut notes);
    notes.extend(tanks.iter().map(|tank| tank.note.clone()));
    notes.push(
        "The surface is that of linear potential flow for the slosh angles, the sum of all modes, each as high at the wall as the FMU's \
         wave per angle says: in an upright cylinder J₁(ξr/R) over the radius, in a box sin (2n − 1)πx/a, in another tank of --tank \
         the modes that `hubslosh tank` finds there. A high wave breaks before it looks like that. Pendulums are drawn where they \
         are; the exaggeration is of the surface alone, which ends at bottom and rim."
            .into(),
    );
    if !run.parameters_known {
        warnings.push(format!(
            "{source} does not say which parameters it was run with: drawn with the FMU's start values and what --set and --parameters \
             say (a .parquet of `hubslosh run` has them in its metadata)"
        ));
        notes.push("The file does not hold its parameters: those are the FMU's start values and what the command said.".into());
    }

    // what goes into the page
    let panels = panels(kind, run.table);
    let plotted: BTreeSet<&String> = panels.iter().flat_map(|(_, names)| names).collect();
    let mut moving = columns.moving.clone();
    // where all of it has room, what is only plotted keeps its rows, too
    let all: BTreeSet<String> =
        moving.iter().cloned().chain(plotted.iter().map(|n| n.to_string())).collect();
    if Thinning::of(time.len(), all.len() + derived.len()).every == 1 {
        moving = all;
    }
    let thinning = Thinning::of(time.len(), moving.len() + derived.len());
    let rows = thinning.rows(time.len());
    let column = |name: &str| run.table.column(name).unwrap_or_default();
    if thinning.every > 1 {
        notes.push(format!(
            "Of {} rows every {} is drawn, {:.3} s apart, and motion between them along straight lines; --from and --to show a part \
             with more of them. Plots of what does not move have the extremes of all rows.",
            time.len(),
            ordinal(thinning.every),
            (time[time.len() - 1] - time[0]) / (rows.len() - 1) as f64,
        ));
    }
    let angles: Vec<&[f64]> = moving
        .iter()
        .filter(|n| n.contains("angle") || n.contains(".p["))
        .map(|n| column(n))
        .collect();
    if let Some(frames) = thinning.too_few(&angles) {
        let sentence = format!(
            "the liquid's oscillations have {frames:.1} frames each: what is drawn between them is not the motion (--from and --to \
             show a part; a smaller --step of `hubslosh run` records more)"
        );
        notes.push(format!("Note: {sentence}."));
        warnings.push(sentence);
    }
    let unit = |name: &str| {
        let variable = run.description.variable(name).ok();
        let unit = variable.and_then(|v| v.attributes().unit.clone()).unwrap_or_default();
        crate::campaign::printed(&unit)
    };
    let unplotted = run.table.names().len() - 1 - plotted.len();
    if unplotted > 0 {
        notes.push(format!(
            "{unplotted} columns of the table are not plotted: what is 0 throughout, and what {MOST_PANELS} panels do not hold."
        ));
    }
    let mut data = serde_json::Map::new();
    for name in &moving {
        data.insert(name.clone(), json!(data::thinned(column(name), &rows)));
    }
    for (name, values) in &derived {
        data.insert(name.clone(), json!(data::thinned(values, &rows)));
    }
    let envelopes: serde_json::Map<String, Value> = plotted
        .iter()
        .filter(|name| !moving.contains(**name))
        .map(|name| (name.to_string(), data::envelope(time, column(name))))
        .collect();
    let panels: Vec<Value> = panels
        .iter()
        .map(|(title, names)| json!({ "title": title, "names": names, "unit": unit(&names[0]) }))
        .collect();
    let page = json!({
        "kind": match kind { Kind::Bench => "bench", Kind::Craft => "craft", Kind::Tank => "tank" },
        "time": data::times(time, &rows),
        "columns": data,
        "envelopes": envelopes,
        "panels": panels,
        "motion": motion,
        "tanks": tank_columns,
        "scene": scene,
    });
    let facts = format!(
        "{} {} · {} to {} s · {} rows",
        run.description.model_name,
        run.description.version,
        shown(time[0]),
        shown(time[time.len() - 1]),
        time.len(),
    );
    Ok(Page { html: markup(&run.title, &facts, kind, &page, &notes), warnings })
}

fn ordinal(n: usize) -> String {
    match n {
        2 => "second".into(),
        3 => "third".into(),
        n => format!("{n}th"),
    }
}

/// A number without the dust of binary fractions.
fn shown(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// What is drawn, as the scene's `geometry` (harness/web/scene/README.md).
fn scene(
    kind: Kind,
    parameters: &Parameters,
    tanks: &[Tank],
    table: &Table,
    columns: &mut Columns,
    notes: &mut Vec<String>,
) -> Value {
    let drawn: Vec<Value> = tanks
        .iter()
        .map(|tank| {
            let shape = match &tank.outline {
                Outline::Revolved(contour) => json!({ "contour": contour }),
                Outline::Box([a, b, bottom, top]) => json!({ "box": [a, b], "bottom": bottom, "top": top }),
            };
            let modes: Vec<Value> = tank
                .modes
                .iter()
                .enumerate()
                .map(|(n, m)| {
                    let shape = tank.shapes.get(n);
                    json!({ "hinge": m.hinge, "length": m.length, "wave": m.wave, "mass": m.mass, "shape": shape })
                })
                .collect();
            json!({ "position": tank.position, "q": tank.q, "shape": shape, "level": tank.level, "modes": modes })
        })
        .collect();
    let at = |tank: &Tank| tank.position.iter().map(|x| x * x).sum::<f64>().sqrt() + tank.extent();
    let mut reach = tanks.iter().map(at).fold(0.0, f64::max);
    let (mut arrows, mut of_arrows) = (Vec::new(), serde_json::Map::new());
    // (column or beginning, label, kind, unit, where, whether it ends there)
    let mut add =
        |columns: &mut Columns, name: &str, label: String, entry: Value, names: Vec<String>| {
            // an input that is not in the table has its start value throughout
            let constant = |name: &String| {
                let variable = parameters.description.variable(name).ok()?;
                (variable.causality == "input").then(|| parameters.number(name))
            };
            let there: Vec<String> = names.iter().filter(|n| columns.has(n)).cloned().collect();
            if there.is_empty() || names.iter().any(|n| !columns.has(n) && constant(n).is_none()) {
                return;
            }
            let at = |name: &String, k: usize| match table.column(name) {
                Some(values) => values[k],
                None => constant(name).unwrap_or(0.0),
            };
            let size = |k: usize| names.iter().map(|name| at(name, k).powi(2)).sum::<f64>().sqrt();
            let most = (0..table.rows()).map(size).fold(0.0, f64::max);
            if most > 0.0 {
                columns.take(&there);
                let mut arrow = entry;
                (arrow["name"], arrow["label"], arrow["most"]) =
                    (json!(name), json!(label), json!(most));
                arrows.push(arrow);
                let source =
                    |n: &String| if columns.has(n) { json!(n) } else { json!(constant(n)) };
                let all: Vec<Value> = names.iter().map(source).collect();
                of_arrows
                    .insert(name.into(), if all.len() == 1 { all[0].clone() } else { json!(all) });
            }
        };
    let mut geometry = match kind {
        Kind::Bench => {
            let tank = &tanks[0];
            let r = tank.position[0];
            let radius = match &tank.outline {
                Outline::Revolved(points) => points.iter().map(|p| p[0]).fold(0.0, f64::max),
                Outline::Box([a, b, ..]) => 0.5 * a.hypot(*b),
            };
            reach = r + 1.25 * radius;
            let wheel = 0.0625_f64.min(0.4 * reach);
            let below = r < radius + 1.1 * wheel;
            let actuator = if columns.has("tau_actuator") { "tau_actuator" } else { "tau_cmd" };
            let torques = [
                (
                    actuator,
                    if actuator == "tau_cmd" { "torque command" } else { "actuator torque" },
                ),
                ("tau_ext", "external torque"),
                ("tau_friction", "friction torque"),
                ("tau_fluid", "liquid torque"),
            ];
            let [inner, outer] =
                if below { [1.1 * radius, 1.4 * radius] } else { [1.25 * wheel, 0.42 * reach] };
            for (i, (name, label)) in torques.into_iter().enumerate() {
                let arc = json!({
                    "radius": inner + (outer - inner) * (i as f64 + 0.5) / 4.0, "z": 0.03 * reach,
                    "from": std::f64::consts::PI, "most": FULL_ARC,
                });
                add(
                    columns,
                    name,
                    label.into(),
                    json!({ "kind": "torque", "unit": "N·m", "arc": arc }),
                    vec![name.into()],
                );
            }
            let force = json!({
                "kind": "force", "unit": "N", "length": 0.7 * reach,
                "at": [r, 0.0, tank.position[2] + tank.level],
            });
            let names = vec!["F_radial".to_string(), "F_tangential".to_string()];
            add(columns, "force", "liquid force on the tank".into(), force, names);
            json!({
                "bench": {
                    "wheel": wheel, "below": below,
                    "arm": { "length": r, "width": 1.2 * radius, "plate": 1.12 * radius },
                },
                "target": [0.3 * r, 0.0, -0.07 * reach], "from": [0.55, -1.25, 0.75], "radius": 0.87 * reach,
                "axes": {
                    "length": 0.2 * reach, "names": ["radial", "tangential", "z"],
                    "at": if below { [0.0, 0.0, 0.0] } else { [0.0, 0.0, 0.5 * wheel] },
                },
            })
        }
        Kind::Craft => {
            let size = geometry::craft_box(parameters);
            let center: [f64; 3] = parameters.vector("craft.r");
            if let Some(size) = size {
                let length = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
                reach = reach.max(0.5 * length(&size) + length(&center));
                notes.push("The craft is drawn as the box with the dry craft's mass and moments of inertia, its middle at the dry \
                    craft's centre of mass."
                    .into());
            } else {
                notes.push(
                    "No box has the dry craft's moments of inertia: the craft itself is not drawn."
                        .into(),
                );
            }
            let long = 0.8 * reach;
            let force = |at: [f64; 3], tip: bool| json!({ "kind": "force", "unit": "N", "length": long, "at": at, "tip": tip });
            let torque = json!({ "kind": "torque", "unit": "N·m", "length": long });
            add(columns, "force", "force at O".into(), force([0.0; 3], true), three("force"));
            add(columns, "torque", "torque about O".into(), torque.clone(), three("torque"));
            let each = tanks.len() > 1
                && tanks
                    .iter()
                    .all(|t| three(&format!("{}.force", t.prefix)).iter().all(|n| columns.has(n)));
            if each {
                for tank in tanks {
                    let name = format!("{}.force", tank.prefix);
                    add(
                        columns,
                        &name,
                        format!("liquid force, {}", tank.prefix),
                        force(tank.position, false),
                        three(&name),
                    );
                }
            } else {
                add(
                    columns,
                    "slosh_force",
                    "liquid force at O".into(),
                    force([0.0; 3], false),
                    three("slosh_force"),
                );
            }
            add(
                columns,
                "slosh_torque",
                "liquid torque about O".into(),
                torque,
                three("slosh_torque"),
            );
            json!({
                "body": { "size": size, "center": center },
                "from": [1.0, -1.25, 0.55], "axes": { "length": 0.85 * reach },
            })
        }
        Kind::Tank => {
            // about its middle, in which the tank is seen, with O and full arrows from there
            let tank = &tanks[0];
            let [middle, half] = tank.middle_and_extent();
            let [x, y, z] = tank.position;
            let off = x.hypot(y).hypot(z + middle);
            reach = half.max(off);
            let long = 0.6 * reach;
            let force = json!({ "kind": "force", "unit": "N", "length": long });
            add(columns, "force", "liquid force on the host at O".into(), force, three("force"));
            let torque = json!({ "kind": "torque", "unit": "N·m", "length": long });
            add(columns, "torque", "liquid torque about O".into(), torque, three("torque"));
            let acceleration = json!({ "kind": "acceleration", "unit": "m/s²", "length": long });
            add(columns, "a", "specific force at O".into(), acceleration, three("a"));
            json!({
                "from": [1.0, -1.25, 0.55], "axes": { "length": 0.5 * reach },
                "radius": f64::max(1.1 * half, off + 1.1 * long), "target": [x, y, z + middle],
            })
        }
    };
    // one scale for all that share a unit, so that lengths can be compared
    let mut most: BTreeMap<String, f64> = BTreeMap::new();
    for arrow in &arrows {
        let one = most.entry(arrow["unit"].to_string()).or_insert(0.0);
        *one = one.max(arrow["most"].as_f64().unwrap_or(0.0));
    }
    for arrow in &mut arrows {
        arrow["most"] = json!(most[&arrow["unit"].to_string()]);
    }
    geometry["reach"] = json!(reach);
    geometry["tanks"] = json!(drawn);
    geometry["arrows"] = json!(arrows);
    json!({ "geometry": geometry, "arrows": of_arrows })
}

/// Titles and columns of the plots, in order.
fn panels(kind: Kind, table: &Table) -> Vec<(String, Vec<String>)> {
    let moves = |name: &str| table.column(name).is_some_and(|values| peak(values) > 0.0);
    let mut left: Vec<&String> =
        table.names().iter().filter(|n| *n != "time" && moves(n)).collect();
    let mut panels: Vec<(String, Vec<String>)> = Vec::new();
    if kind == Kind::Bench {
        for (title, family) in BENCH_PANELS {
            let names: Vec<String> = family
                .iter()
                .filter(|n| left.iter().any(|l| l == *n))
                .map(|n| n.to_string())
                .collect();
            left.retain(|name| !names.contains(name));
            if !names.is_empty() {
                panels.push((title.into(), names));
            }
        }
    }
    // elements of one vector share a panel, and the slosh angles of one tank
    let family = |name: &str| {
        let bare =
            name.strip_suffix(']').and_then(|n| n.rsplit_once('[')).map_or(name, |(bare, _)| bare);
        match bare.strip_suffix("angle_x").or(bare.strip_suffix("angle_y")) {
            Some(prefix) => format!("{prefix}slosh angles"),
            None => bare.to_string(),
        }
    };
    const RANK: [&str; 8] = [
        "omega",
        "slosh angles",
        "wave_height",
        "liquid",
        "torque",
        "force",
        "mass_flow",
        "slosh_torque",
    ];
    let rank = |title: &str| {
        let last = title.rsplit('.').next().unwrap_or(title);
        RANK.iter().position(|name| *name == last).unwrap_or(RANK.len())
    };
    let mut rest: Vec<(String, Vec<String>)> = Vec::new();
    for name in left {
        let title = family(name);
        match rest.iter_mut().find(|(other, _)| *other == title) {
            Some((_, names)) => names.push(name.clone()),
            None => rest.push((title, vec![name.clone()])),
        }
    }
    rest.sort_by_key(|(title, _)| rank(title));
    panels.extend(rest);
    panels.truncate(MOST_PANELS);
    panels
}

fn markup(title: &str, facts: &str, kind: Kind, page: &Value, notes: &[String]) -> String {
    let data = page.to_string().replace("</", "<\\/");
    let body_frame = match kind {
        Kind::Bench => Some("View turns with the hub"),
        Kind::Craft => Some("View turns with the craft"),
        Kind::Tank => None,
    };
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "HubSlosh: " (title) }
                style { (PreEscaped(include_str!("view.css"))) }
            }
            body {
                main {
                    header {
                        h1 { (title) }
                        p .facts { (facts) }
                    }
                    noscript {
                        p .warning {
                            "The moving picture and the plots need JavaScript. The numbers are in the run's table; `hubslosh view` made "
                            "this page from it."
                        }
                    }
                    div .stage {
                        div #scene {}
                        div .controls role="group" aria-label="Time" {
                            button #play type="button" aria-label="Play" title="Play or pause (space)" { "▶" }
                            input #time type="range" min="0" max="1000" value="0" step="any" aria-label="Time";
                            output #now for="time" { "" }
                            label { "Speed " input #speed type="range" min="-2" max="2.5" step="0.05" value="0"; output #speed-is {} }
                            label { "Wave × " input #wave type="range" min="0" max="1.5" step="0.02" value="0"; output #wave-is {} }
                            label {
                                "Plots "
                                select #window {
                                    option value="" { "all" }
                                    @for width in ["300", "60", "20", "5"] { option value=(width) { (width) " s" } }
                                }
                            }
                            @if let Some(text) = body_frame {
                                label { input #body type="checkbox"; " " (text) }
                            }
                        }
                    }
                    div .plots { div #plots {} }
                    details .notes {
                        summary { "What is drawn, and keys" }
                        ul { @for note in notes { li { (note) } } }
                        p {
                            kbd { "space" } " play, pause · " kbd { "←" } " " kbd { "→" } " one row (with shift ten) · " kbd { "Home" } " "
                            kbd { "End" } " · " kbd { "," } " " kbd { "." } " slower, faster · " kbd { "b" } " turn with the body. With the "
                            "picture in focus the arrows turn it, " kbd { "+" } " " kbd { "-" } " zoom, " kbd { "0" } " shows all. "
                            "A click on a plot goes to that time, a drag zooms, a double click shows all."
                        }
                    }
                }
                script type="application/json" id="run" { (PreEscaped(data)) }
                script { (PreEscaped(format!("/* {} */\n", web::THREE_LICENSE.replace("*/", "* /")))) (PreEscaped(web::THREE)) }
                script { (PreEscaped(format!("/* {} */\n", PLOTLY_LICENSE.replace("*/", "* /")))) (PreEscaped(PLOTLY)) }
                script { (PreEscaped(web::SCENE)) }
                script { (PreEscaped(include_str!("view.js"))) }
            }
        }
    };
    page.into_string()
}

//! A self-contained page that shows one run: the bench or craft in 3-D with its liquid, and plots that follow the time.
//!
//! Nothing is simulated: every moving object shows a column of the run's table, or a formula of columns,
//! which the page states.

mod data;
mod geometry;
mod scene;

use std::collections::{BTreeMap, BTreeSet};

use analysis::statistics::peak;
use anyhow::{Context, Result, ensure};
use experiments::sensors::quantity::Coordinate;
use host::description::ModelDescription;
use maud::html;
use names::hubslosh::{
    ENERGY, F_RADIAL, F_TANGENTIAL, HEAT, OMEGA, OMEGA_IMU, SLOSH_ANGLE, SLOSH_ANGLE_RADIAL,
    SloshModel, TAU_ACTUATOR, TAU_CMD, TAU_EXT, TAU_FLUID, TAU_FRICTION, THETA, WAVE_HEIGHT,
    WHEEL_SPEED, WORK, slosh,
};
use serde_json::{Map, Value, json};
use signals::table::Table;

use self::data::{Thinning, integral};
pub use self::geometry::{Drawing, Outline, Surfaces};
use self::geometry::{Parameters, Pendulum, Tank};
use self::scene::scene;
use crate::campaign::{PLOTLY, PLOTLY_LICENSE};
use crate::svg::range;

pub struct Run<'a> {
    pub title: String,
    pub source: String,
    pub description: &'a ModelDescription,
    /// Values of parameters by name, as text: all parameters, or those that differ from the FMU's start values.
    pub parameters: &'a BTreeMap<String, String>,
    /// True if the parameters come from the file of the run. Otherwise they are the FMU's start values
    /// and the user's settings.
    pub parameters_known: bool,
    pub drawings: &'a BTreeMap<usize, Drawing>,
    pub table: &'a Table,
}

/// An HTML page and its warnings, which are sentences about objects that are not drawn exactly.
pub struct Page {
    pub html: String,
    pub warnings: Vec<String>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Bench,
    Craft,
    Tank,
}

fn kind(description: &ModelDescription) -> Option<Kind> {
    let has = |name: &str| description.variable(name).is_ok();
    [
        (SLOSH_ANGLE_RADIAL, Kind::Bench),
        ("tank[1].p[1,1]", Kind::Craft),
        ("tank.p[1,1]", Kind::Tank),
    ]
    .into_iter()
    .find_map(|(name, kind)| has(name).then_some(kind))
}

/// Panels of the plots of HubSlosh, each with its title and its columns in the order of importance.
const BENCH_PANELS: [(&str, &[&str]); 7] = [
    ("Torque on the hub", &[TAU_ACTUATOR, TAU_CMD, TAU_EXT, TAU_FRICTION, TAU_FLUID]),
    ("Rate of the hub", &[OMEGA, OMEGA_IMU]),
    ("Slosh angle", &[SLOSH_ANGLE, SLOSH_ANGLE_RADIAL]),
    ("Wave at the wall", &[WAVE_HEIGHT]),
    ("Force of the liquid on the tank", &[F_RADIAL, F_TANGENTIAL]),
    ("Angle of the hub", &[THETA]),
    ("Energy", &[ENERGY, WORK, HEAT]),
];

const MOST_PANELS: usize = 8;

/// Lists all columns that the page can use, in the order of a table, so that the user knows which columns to record.
pub fn columns(
    description: &ModelDescription,
    parameters: &BTreeMap<String, String>,
) -> Vec<String> {
    let parameters = Parameters { description, set: parameters };
    let texts = |names: &[&str]| names.iter().map(|n| n.to_string()).collect::<Vec<_>>();
    let mut all = match kind(description) {
        Some(Kind::Bench) => {
            let all = texts(&[
                THETA,
                OMEGA,
                SLOSH_ANGLE,
                SLOSH_ANGLE_RADIAL,
                WAVE_HEIGHT,
                TAU_ACTUATOR,
                TAU_FRICTION,
                TAU_FLUID,
                F_RADIAL,
                F_TANGENTIAL,
                WHEEL_SPEED,
            ]);
            let modes = parameters.number(slosh::MODES) as usize;
            all.into_iter().chain((2..=modes).flat_map(coordinates)).collect()
        }
        Some(Kind::Craft) => {
            let q = (1..=4).map(|i| format!("q[{i}]"));
            q.chain(["omega", "slosh_force", "slosh_torque"].iter().flat_map(|n| vector(n)))
                .collect()
        }
        Some(Kind::Tank) => ["force", "torque"].iter().flat_map(|n| vector(n)).collect(),
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

/// Returns for each tank of Spacecraft or SloshTank the first part of its variables' names, such as `tank[1]`, and
/// its number of modes. The list is empty for HubSlosh.
fn prefixes(parameters: &Parameters) -> Vec<(String, usize)> {
    let all: Vec<String> = match kind(parameters.description) {
        Some(Kind::Craft) => (1..=(parameters.number("tanks") as usize).max(1))
            .map(|i| format!("tank[{i}]"))
            .collect(),
        Some(Kind::Tank) => vec!["tank".into()],
        _ => Vec::new(),
    };
    let modes = |prefix: &String| parameters.number(&format!("{prefix}.modes")) as usize;
    all.into_iter().map(|prefix| (modes(&prefix).max(1), prefix)).map(|(n, p)| (p, n)).collect()
}

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

    /// Returns true if the run has all columns `names`, and marks them as used. Otherwise marks none.
    fn take(&mut self, names: &[String]) -> bool {
        let there = names.iter().all(|name| self.has(name));
        if there {
            self.moving.extend(names.iter().cloned());
        }
        there
    }

    /// Finds the first of alternative `lists` of columns of which the run has all columns, marks these columns as
    /// used, and returns the index of the list. If the run has none of the lists completely, records which columns
    /// are missing.
    fn require(&mut self, lists: &[Vec<String>]) -> Option<usize> {
        let found = (0..lists.len()).find(|i| self.take(&lists[*i]));
        if found.is_none() {
            let ways: Vec<String> = lists.iter().map(|list| list.join(", ")).collect();
            self.missing.push(ways.join(" (or ") + &")".repeat(ways.len() - 1));
        }
        found
    }
}

fn coordinates(n: usize) -> [String; 2] {
    [slosh::Q_RADIAL, slosh::Q_TANGENTIAL].map(|array| array.element([n]))
}

/// Returns the radial and tangential slosh angles of HubSlosh's second and further modes, if the states of these
/// modes were recorded. HubSlosh has outputs only for the angles of the first mode, so that the other angles are
/// computed from the states.
fn higher_modes(table: &Table, model: &str, modes: &[Pendulum]) -> Vec<[Vec<f64>; 2]> {
    let Some(coordinate) = Coordinate::from_model(model) else { return Vec::new() };
    let recorded = (2..).zip(&modes[1..]).map_while(|(n, mode)| {
        let [radial, tangential] = coordinates(n);
        let y = table.column(&tangential)?;
        let x = match (coordinate, table.column(&radial)) {
            (_, Some(x)) => x.to_vec(),
            // the radial coordinate is not used if the motion is planar
            (Coordinate::Angle, None) => vec![0.0; y.len()],
            _ => return None,
        };
        let angles = |(x, y): (&f64, &f64)| coordinate.angles([*x, *y], mode.length);
        let all: Vec<[f64; 2]> = x.iter().zip(y).map(angles).collect();
        Some([0, 1].map(|axis| all.iter().map(|angles| angles[axis]).collect()))
    });
    recorded.collect()
}

const MASSES: usize = 9;

fn spread(values: &[f64]) -> Vec<f64> {
    let (low, high) = range(values.iter().copied());
    let count = if high > low { MASSES } else { 1 };
    let step = (high - low) / (count - 1).max(1) as f64;
    (0..count).map(|i| low + step * i as f64).collect()
}

fn scalar(name: &str) -> Vec<String> {
    vec![name.to_string()]
}

fn vector(name: &str) -> Vec<String> {
    (1..=3).map(|i| format!("{name}[{i}]")).collect()
}

/// Returns the page that shows a run.
///
/// # Errors
/// If the FMU is not one of this project's, columns are missing, or the table has fewer than two rows. The message says how
/// to record the columns.
pub fn page(run: &Run) -> Result<Page> {
    let Some(kind) = kind(run.description) else {
        anyhow::bail!(
            "{}: a run of {} cannot be drawn (allowed: HubSlosh, Spacecraft, SloshTank)",
            run.source,
            run.description.model_name
        );
    };
    let mut draft = Draft {
        run,
        kind,
        parameters: Parameters { description: run.description, set: run.parameters },
        columns: Columns { table: Some(run.table), ..Columns::default() },
        derived: Vec::new(),
        notes: Vec::new(),
        warnings: Vec::new(),
    };
    let motion = draft.body();
    let mut tanks = draft.tanks()?;
    let of_tank = |(i, tank): (usize, &mut Tank)| draft.tank(i, tank);
    let moved: Vec<Value> = tanks.iter_mut().enumerate().map(of_tank).collect::<Result<_>>()?;
    draft.check()?;
    let scene =
        scene(kind, &draft.parameters, &tanks, run.table, &mut draft.columns, &mut draft.notes);
    draft.say_what_is_drawn(&tanks);
    let mut page = draft.data();
    page["kind"] = json!(match kind {
        Kind::Bench => "bench",
        Kind::Craft => "craft",
        Kind::Tank => "tank",
    });
    (page["motion"], page["tanks"], page["scene"]) = (motion, json!(moved), scene);
    let time = draft.time();
    let facts = format!(
        "{} {} · {} to {} s · {} rows",
        run.description.model_name,
        run.description.version,
        rounded(time[0]),
        rounded(time[time.len() - 1]),
        time.len(),
    );
    let html = markup(&run.title, &facts, kind, &page, &draft.notes);
    Ok(Page { html, warnings: draft.warnings })
}

/// A page that is being assembled, with columns that are computed from other columns, and with notes about the
/// drawing for the reader.
struct Draft<'a> {
    run: &'a Run<'a>,
    kind: Kind,
    parameters: Parameters<'a>,
    columns: Columns<'a>,
    derived: Vec<(String, Vec<f64>)>,
    notes: Vec<String>,
    warnings: Vec<String>,
}

impl Draft<'_> {
    fn time(&self) -> &[f64] {
        self.run.table.column("time").unwrap_or_default()
    }

    fn derive(&mut self, name: String, values: Vec<f64>) -> Value {
        let value = json!(name);
        self.derived.push((name, values));
        value
    }

    fn body(&mut self) -> Value {
        let table = self.run.table;
        let mut motion = json!({});
        match self.kind {
            Kind::Bench => {
                motion["theta"] = json!(THETA);
                if self.columns.require(&[scalar(THETA), scalar(OMEGA)]) == Some(1) {
                    let omega = table.column(OMEGA).unwrap_or_default();
                    self.derive(THETA.into(), integral(self.time(), omega));
                    self.notes.push("The hub's angle is the integral of omega by the trapezoidal rule from 0: theta is not in the table.".into());
                }
                if let Some(speed) = table.column(WHEEL_SPEED) {
                    let angle = integral(self.time(), speed);
                    motion["wheel"] = self.derive("wheel_angle".into(), angle);
                }
            }
            Kind::Craft => {
                let q: Vec<String> = (1..=4).map(|i| format!("q[{i}]")).collect();
                self.columns.require(std::slice::from_ref(&q));
                motion["q"] = json!(q);
                self.notes.push(
                    "The view follows O; the faint circles are fixed in inertial space.".into(),
                );
            }
            Kind::Tank => self
                .notes
                .push("The host's frame does not move in this view, because a tank without a craft has no attitude.".into()),
        }
        motion
    }

    fn drawing(&self, i: usize) -> Option<&'_ Drawing> {
        self.run.drawings.get(&(i + 1))
    }

    fn tanks(&self) -> Result<Vec<Tank>> {
        let tanks: Vec<Tank> = match self.kind {
            Kind::Bench => vec![geometry::bench(&self.parameters, self.drawing(0))],
            _ => prefixes(&self.parameters)
                .iter()
                .enumerate()
                .map(|(i, (prefix, _))| geometry::tank(&self.parameters, prefix, self.drawing(i)))
                .collect(),
        };
        if let Some(number) = self.run.drawings.keys().find(|n| **n == 0 || **n > tanks.len()) {
            anyhow::bail!(
                "--tank {number}: the run has {} tank(s) (allowed: numbers from 1 to the number of tanks)",
                tanks.len()
            );
        }
        Ok(tanks)
    }

    fn tank(&mut self, i: usize, tank: &mut Tank) -> Result<Value> {
        let modes = match self.kind {
            Kind::Bench => self.modes_of_bench(tank),
            _ => self.modes_in_space(tank),
        };
        let mut moved = json!({ "modes": modes });
        self.drain(tank, &mut moved);
        self.shape_surfaces(i, tank, &mut moved)?;
        Ok(moved)
    }

    fn modes_of_bench(&mut self, tank: &mut Tank) -> Vec<Value> {
        let run = self.run;
        if tank.modes.is_empty() {
            return Vec::new();
        }
        let model = self.parameters.choice(slosh::MODEL, slosh::KIND);
        let planar =
            [SloshModel::Linear.name(), SloshModel::Planar.name()].contains(&model.as_str());
        let both = vec![SLOSH_ANGLE_RADIAL.to_string(), SLOSH_ANGLE.to_string()];
        let lists = if planar && run.parameters_known {
            vec![both, scalar(SLOSH_ANGLE)]
        } else {
            vec![both]
        };
        let found = self.columns.require(&lists);
        let radial = (found == Some(0)).then_some(SLOSH_ANGLE_RADIAL);
        let mut modes = vec![json!({ "angles": [radial, SLOSH_ANGLE] })];
        let higher = higher_modes(run.table, &model, &tank.modes);
        for (n, angles) in (2..).zip(higher) {
            let names = ["radial", "tangential"].map(|along| format!("{along} angle {n}"));
            modes.push(json!({ "angles": names }));
            self.derived.extend(names.into_iter().zip(angles));
        }
        let (drawn, all) = (modes.len(), tank.modes.len());
        tank.modes.truncate(drawn);
        match all {
            _ if drawn < all => {
                let missing: Vec<String> = (drawn + 1..=all).flat_map(coordinates).collect();
                let sentence = format!(
                    "{drawn} of {all} slosh modes are drawn: the run does not have {}",
                    missing.join(", ")
                );
                self.notes.push(format!("Note: {sentence}."));
                self.warnings.push(format!(
                    "{}: {sentence} (all that is drawn: `hubslosh run … --columns {}`)",
                    run.source,
                    columns(run.description, run.parameters).join(",")
                ));
            }
            2.. => self.notes.push(format!(
                "Slosh angles of modes 2 to {all} follow from the states slosh.q_radial and slosh.q_tangential."
            )),
            _ => {}
        }
        modes
    }

    fn modes_in_space(&mut self, tank: &Tank) -> Vec<Value> {
        let prefix = &tank.prefix;
        let mode = |n: usize| {
            let p: Vec<String> = (1..=3).map(|i| format!("{prefix}.p[{n},{i}]")).collect();
            let angles: Vec<String> =
                ["x", "y"].map(|axis| format!("{prefix}.angle_{axis}[{n}]")).to_vec();
            match self.columns.require(&[p.clone(), angles.clone()]) {
                Some(1) => json!({ "angles": angles }),
                _ => json!({ "p": p }),
            }
        };
        (1..=tank.modes.len()).map(mode).collect()
    }

    fn drain(&mut self, tank: &Tank, moved: &mut Value) {
        let (prefix, Some(fill)) = (&tank.prefix, &tank.fill) else { return };
        let name = format!("{prefix}.liquid");
        if self.columns.require(&[scalar(&name)]).is_none() {
            return;
        }
        let liquid = self.run.table.column(&name).unwrap_or_default();
        let level = liquid.iter().map(|m| fill.level(*m)).collect();
        moved["level"] = self.derive(format!("{prefix} level"), level);
        for n in 0..tank.modes.len() {
            for (k, key) in ["length", "hinge"].into_iter().enumerate() {
                let values = liquid.iter().map(|m| fill.mode(n, *m)[k]).collect();
                moved["modes"][n][key] = self.derive(format!("{prefix} {key} {}", n + 1), values);
            }
        }
    }

    fn shape_surfaces(&self, i: usize, tank: &mut Tank, moved: &mut Value) -> Result<()> {
        let surfaces = self.drawing(i).and_then(|drawing| drawing.surfaces.as_ref());
        let Some(surfaces) = surfaces.filter(|_| !tank.modes.is_empty()) else { return Ok(()) };
        let modes = tank.modes.len();
        let shapes_at = |mass: &f64| {
            surfaces(*mass, modes)
                .with_context(|| format!("--tank {}: with {mass} kg of liquid", i + 1))
        };
        let name = format!("{}.liquid", tank.prefix);
        match tank.fill.as_ref().and(self.run.table.column(&name)) {
            Some(liquid) => {
                let masses = spread(liquid);
                let shapes = masses.iter().map(shapes_at).collect::<Result<Vec<_>>>()?;
                moved["surfaces"] = json!({ "liquid": name, "masses": masses, "shapes": shapes });
            }
            None => tank.shapes = shapes_at(&tank.liquid)?,
        }
        Ok(())
    }

    fn check(&self) -> Result<()> {
        let (run, source, time) = (self.run, &self.run.source, self.time());
        let (missing, has_time) = (&self.columns.missing, self.columns.has("time"));
        ensure!(
            missing.is_empty() && has_time,
            "{source} cannot be drawn: it has no {}.\nRecord the variables of a picture by `hubslosh run … --columns {}`, in Python by outputs=…; this run has: {}",
            if has_time { missing.join("; no ") } else { "time".into() },
            columns(run.description, run.parameters).join(","),
            run.table.names().join(", ")
        );
        ensure!(
            time.len() > 1,
            "{source} cannot be drawn: it has fewer than two rows ({})",
            time.len()
        );
        if let Some(k) = time.windows(2).position(|pair| pair[1] <= pair[0]) {
            anyhow::bail!(
                "{source} cannot be drawn: the time does not increase after row {}, {} s",
                k + 1,
                time[k]
            );
        }
        Ok(())
    }

    fn say_what_is_drawn(&mut self, tanks: &[Tank]) {
        self.notes.extend(tanks.iter().map(|tank| tank.note.clone()));
        self.notes.push(
            "The surface is that of linear potential flow for the slosh angles, the sum of all modes with the FMU's wave height per slosh angle at \
             the wall. The shape is J₁(ξr/R) over the radius in an upright cylinder, sin (2n − 1)πx/a in a box, and the modes of \
             `hubslosh tank` in another tank of --tank. A real wave of this height would break. Only the surface is exaggerated, up to \
             bottom and rim; pendulums are drawn at their positions."
                .into(),
        );
        if !self.run.parameters_known {
            self.warnings.push(format!(
                "{} does not contain the parameters of the run: it is drawn with the FMU's start values and the values of --set and --parameters \
                 (a .parquet of `hubslosh run` contains them in its metadata)",
                self.run.source
            ));
            self.notes.push("The file does not contain the parameters of the run: the FMU's start values and the values of the command are used.".into());
        }
    }

    fn data(&mut self) -> Value {
        let (table, description) = (self.run.table, self.run.description);
        let time = table.column("time").unwrap_or_default();
        let panels = panels(self.kind, table);
        let plotted: BTreeSet<&String> = panels.iter().flat_map(|(_, names)| names).collect();
        let mut moving = self.columns.moving.clone();
        // if every row is drawn, columns that are only plotted keep all rows, too
        let all: BTreeSet<String> =
            moving.iter().cloned().chain(plotted.iter().map(|n| n.to_string())).collect();
        if Thinning::new(time.len(), all.len() + self.derived.len()).every == 1 {
            moving = all;
        }
        let thinning = Thinning::new(time.len(), moving.len() + self.derived.len());
        let rows = thinning.rows(time.len());
        let column = |name: &str| table.column(name).unwrap_or_default();
        if thinning.every > 1 {
            self.notes.push(format!(
                "Of {} rows every {} is drawn, {:.3} s apart, with linear interpolation between them; --from and --to show a part \
                 with more rows. Plots of quantities that move no object contain the extreme values of all rows.",
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
                "the picture has {frames:.1} frames per oscillation of the liquid, so that it does not show the motion between them (--from and --to \
                 show a part; a smaller --step of `hubslosh run` records more)"
            );
            self.notes.push(format!("Note: {sentence}."));
            self.warnings.push(sentence);
        }
        let unplotted = table.names().len() - 1 - plotted.len();
        if unplotted > 0 {
            self.notes.push(format!(
                "{unplotted} columns of the table are not plotted, because they are always 0 or because the page has at most {MOST_PANELS} panels."
            ));
        }
        let unit = |name: &str| {
            let variable = description.variable(name).ok();
            let unit = variable.and_then(|v| v.attributes().unit.clone()).unwrap_or_default();
            crate::campaign::printed(&unit)
        };
        let of_table = moving.iter().map(|name| (name, column(name)));
        let derived = self.derived.iter().map(|(name, values)| (name, values.as_slice()));
        let columns: Map<String, Value> = of_table
            .chain(derived)
            .map(|(name, values)| (name.clone(), json!(data::thinned(values, &rows))))
            .collect();
        let envelopes: Map<String, Value> = plotted
            .iter()
            .filter(|name| !moving.contains(**name))
            .map(|name| (name.to_string(), data::envelope(time, column(name))))
            .collect();
        let panels: Vec<Value> = panels
            .iter()
            .map(
                |(title, names)| json!({ "title": title, "names": names, "unit": unit(&names[0]) }),
            )
            .collect();
        json!({
            "time": data::times(time, &rows),
            "columns": columns,
            "envelopes": envelopes,
            "panels": panels,
        })
    }
}

fn ordinal(n: usize) -> String {
    match n {
        2 => "second".into(),
        3 => "third".into(),
        n => format!("{n}th"),
    }
}

fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

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
    // the elements of one vector share a panel, and so do the slosh angles of one tank
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
    let frame = |body: &str| html! { label { input #body type="checkbox"; " View turns with the " (body) } };
    let body_frame = match kind {
        Kind::Bench => frame("hub"),
        Kind::Craft => frame("craft"),
        Kind::Tank => html! {},
    };
    let licence = |text: &str| text.replace("*/", "* /");
    format!(
        include_str!("view.html"),
        title = html! { (title) }.0,
        facts = html! { (facts) }.0,
        body_frame = body_frame.0,
        notes = html! { @for note in notes { li { (note) } } }.0,
        data = web::json_in_script(&page.to_string()),
        three = web::THREE,
        three_license = licence(web::THREE_LICENSE),
        plotly = PLOTLY,
        plotly_license = licence(PLOTLY_LICENSE),
        scene = web::SCENE,
        style = include_str!("view.css"),
        script = include_str!("view.js"),
    )
}

//! From a record of force, moment and motion of a tank to its mechanical model.
//!
//! [`crate::any_fmu`] fits SloshTank. This module reads the record in any frame ([`Frame`]), turns the [`motion`] into the FMU's inputs,
//! and chooses unknowns, starts and priors. The starts are those of the tank's drawing ([`Prediction`]) or of the record's spectrum.
//!
//! Every unknown that a record may lack has a wide prior. A value is stated only if the record narrows this prior to [`STATED`] of its
//! width, or to [`STATED_WITHOUT_FIT`] if the model does not fit. For all others the result names the reason. A result of a model that
//! does not fit has no intervals.

pub mod motion;
mod reasons;
mod start;

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use names::sloshtank::tank;
use names::sloshtank::{A, FORCE, OMEGA, OMEGA_DOT, TORQUE};
use serde::Serialize;
use signals::recording::{self, Between, Columns, Signal, Wanted};

use crate::any_fmu::{self, Identification};
use crate::estimate::Estimated;
use crate::input::question::{Bias, Free, Prior, Question, Setting, Solver, real};
use crate::input::record::Record;
use crate::model::bench::breaking;
use crate::model::simulate::{Model, Setup};
use crate::news::News;
use crate::tuning::{INPUT_PHASE, MOST_INPUTS, STATED, STATED_WITHOUT_FIT, WIDE_SHIFT};
use start::Start;

/// Signals of forces and moments of a record, with their units.
pub const LOADS: [(&str, &str); 6] =
    [("Fx", "N"), ("Fy", "N"), ("Fz", "N"), ("Mx", "N.m"), ("My", "N.m"), ("Mz", "N.m")];
/// Signals of the motion: displacement and acceleration of the reference point, rotation about one axis.
pub const MOTIONS: [(&str, &str); 9] = [
    ("x", "m"),
    ("y", "m"),
    ("z", "m"),
    ("ax", "m/s2"),
    ("ay", "m/s2"),
    ("az", "m/s2"),
    ("rx", "rad"),
    ("ry", "rad"),
    ("rz", "rad"),
];

/// Frame of a record.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Frame {
    /// The tank's x, y and z axes in the record's axes, as columns; z is upwards at rest.
    pub axes: [[f64; 3]; 3],
    /// Reference point of the moments and of the motion, m from the zero of the drawing's heights on the tank's axis, tank axes.
    pub point: [f64; 3],
    /// True if forces and moments act on the balance's side: minus those on the tank.
    pub is_reaction: bool,
    /// True if axes and reference point of forces and moments stay fixed in space while the tank moves.
    pub is_fixed: bool,
}

impl Frame {
    /// Parses the tank's axes in the record's, such as `z,x,y` or `x,-z,y`.
    ///
    /// # Errors
    /// If they are not three different axes in right-handed order.
    pub fn axes(text: &str) -> Result<[[f64; 3]; 3]> {
        let allowed = || {
            format!(
                "{text} (allowed: three of x, y, z with signs, right-handed, such as z,x,y for y upwards)"
            )
        };
        let one = |name: &str| -> Result<[f64; 3]> {
            let (sign, letter) = match name.trim().strip_prefix('-') {
                Some(letter) => (-1.0, letter),
                None => (1.0, name.trim()),
            };
            let place = ["x", "y", "z"].iter().position(|l| *l == letter).with_context(allowed)?;
            let mut axis = [0.0; 3];
            axis[place] = sign;
            Ok(axis)
        };
        let axes: Vec<[f64; 3]> = text.split(',').map(one).collect::<Result<_>>()?;
        let [x, y, z] = axes[..] else { bail!(allowed()) };
        ensure!(cross(x, y) == z, allowed());
        Ok([x, y, z])
    }

    /// The unit quaternion from tank to record axes, scalar first.
    fn quaternion(&self) -> [f64; 4] {
        let r = |i: usize, j: usize| self.axes[j][i];
        let squares = [
            1.0 + r(0, 0) + r(1, 1) + r(2, 2),
            1.0 + r(0, 0) - r(1, 1) - r(2, 2),
            1.0 - r(0, 0) + r(1, 1) - r(2, 2),
            1.0 - r(0, 0) - r(1, 1) + r(2, 2),
        ];
        let largest = (0..4).fold(0, |best, k| if squares[k] > squares[best] { k } else { best });
        let s = 0.5 / squares[largest].sqrt();
        let w = [r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)];
        let sum = |i: usize, j: usize| r(i, j) + r(j, i);
        let rows = match largest {
            0 => [squares[0], w[0], w[1], w[2]],
            1 => [w[0], squares[1], sum(0, 1), sum(0, 2)],
            2 => [w[1], sum(0, 1), squares[2], sum(1, 2)],
            _ => [w[2], sum(0, 2), sum(1, 2), squares[3]],
        };
        rows.map(|q| q * s)
    }

    /// Returns the place of a tank axis among the record's, and its sign.
    fn place(&self, axis: usize) -> (usize, f64) {
        let places = self.axes[axis].iter().enumerate();
        places.fold((0, 0.0), |best, (k, v)| if *v != 0.0 { (k, *v) } else { best })
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// A value that theory predicts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Predicted {
    /// Value, SI.
    pub value: f64,
    /// Expected interval.
    pub interval: Option<[f64; 2]>,
}

/// Theory's values of a tank, such as those of `hubslosh tank`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prediction {
    /// Values by the names of SloshTank's variables.
    pub values: BTreeMap<String, Predicted>,
    /// Settings of the FMU, these values among them.
    pub settings: Vec<(String, String)>,
}

/// Input of an identification.
#[derive(Clone, Debug, Default)]
pub struct Task {
    /// The record's frame.
    pub frame: Frame,
    /// Specific force along the tank's axis at rest, m/s².
    pub gravity: f64,
    /// Known slosh angles along the tank's x and y axes, rad, at which the liquid is released at rest when the records begin.
    pub release: Option<[f64; 2]>,
    /// Values from the tank's drawing.
    pub prediction: Option<Prediction>,
    /// Known values; an unknown among them is not estimated.
    pub settings: Vec<Setting>,
    /// Priors in place of the wide ones.
    pub priors: Vec<Prior>,
    /// Loads with an unknown offset in each record, by their names here ([`LOADS`]).
    pub biases: Vec<Bias>,
    /// True if the noise of each load also drifts.
    pub drift: bool,
    /// Relative tolerance of the FMU's own solver.
    pub tolerance: Option<f64>,
    /// Starts that are drawn where the search from the first one ends at no good fit.
    pub starts: usize,
}

/// A record as it was read, in its own frame.
#[derive(Clone, Debug, Default)]
pub struct Raw {
    /// The file's name.
    pub name: String,
    /// s, increasing.
    pub time: Vec<f64>,
    /// Forces, N, and moments, N·m, in the order of [`LOADS`]; NaN in rows without a value.
    pub loads: [Option<Vec<f64>>; 6],
    /// The motion in the order of [`MOTIONS`].
    pub motion: [Option<Vec<f64>>; 9],
}

impl Raw {
    /// Reads a record; `done` hears what was done to it.
    ///
    /// # Errors
    /// If the file cannot be read, or has no force or moment across the tank's axis.
    pub fn read(path: &Path, columns: &Columns, done: &mut dyn FnMut(String)) -> Result<Raw> {
        let signal = |(name, unit): &(&'static str, &'static str), between| Signal {
            name,
            required: false,
            between,
            unit: Some(unit),
        };
        let loads = LOADS.iter().map(|of| signal(of, Between::Missing));
        let all: Vec<Signal> =
            loads.chain(MOTIONS.iter().map(|of| signal(of, Between::Line))).collect();
        let table = recording::read(path, &Wanted { signals: &all, columns }, done)?;
        let column = |name: &str| table.column(name).map(<[f64]>::to_vec);
        Ok(Raw {
            name: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            time: column("time").unwrap_or_default(),
            loads: LOADS.map(|(name, _)| column(name)),
            motion: MOTIONS.map(|(name, _)| column(name)),
        })
    }

    fn is_moved(&self) -> bool {
        self.motion.iter().any(Option::is_some)
    }

    /// The motion at a time: displacement of the reference point, m, its acceleration, m/s², and angle, rad, rate and acceleration of
    /// the rotation about the axis `about`, all in axes that are the record's at rest.
    fn at(&self, t: f64, window: f64) -> Result<Moved> {
        let of = |k: usize| -> Result<[f64; 3]> {
            let values = self.motion[k].as_ref();
            values.map_or(Ok([0.0; 3]), |values| {
                motion::Signal { time: &self.time, values, window }.at(t)
            })
        };
        let mut moved = Moved { about: self.about(), ..Moved::default() };
        for k in 0..3 {
            let [place, _, bend] = of(k)?;
            moved.place[k] = place;
            moved.acceleration[k] = bend + of(3 + k)?[0];
        }
        moved.rotation = of(6 + moved.about)?;
        Ok(moved)
    }

    /// The axis of rotation among the record's.
    fn about(&self) -> usize {
        (0..3).find(|k| self.motion[6 + k].is_some()).unwrap_or(0)
    }

    fn check(&self) -> Result<()> {
        let rotations = (6..9).filter(|k| self.motion[*k].is_some()).count();
        ensure!(
            rotations < 2,
            "{rotations} rotations are recorded (allowed: about one of rx, ry, rz)"
        );
        for k in 0..3 {
            ensure!(
                self.motion[k].is_none() || self.motion[3 + k].is_none(),
                "both {} and {} are recorded (allowed: one of them)",
                MOTIONS[k].0,
                MOTIONS[3 + k].0
            );
        }
        Ok(())
    }
}

/// Motion of a tank at one time.
#[derive(Clone, Copy, Debug, Default)]
struct Moved {
    place: [f64; 3],
    acceleration: [f64; 3],
    about: usize,
    /// Angle, rate and acceleration.
    rotation: [f64; 3],
}

impl Moved {
    /// Components in the tank's turned axes of a vector in fixed axes.
    fn turned(&self, v: [f64; 3]) -> [f64; 3] {
        let (sin, cos) = self.rotation[0].sin_cos();
        let (i, j) = ((self.about + 1) % 3, (self.about + 2) % 3);
        let mut turned = v;
        turned[i] = cos * v[i] + sin * v[j];
        turned[j] = cos * v[j] - sin * v[i];
        turned
    }

    /// The FMU's inputs a, omega and omega_dot, if `up` is the specific force at rest.
    fn inputs(&self, up: [f64; 3]) -> [f64; 9] {
        let force = self.turned([0, 1, 2].map(|k| self.acceleration[k] + up[k]));
        let mut inputs = [0.0; 9];
        inputs[..3].copy_from_slice(&force);
        inputs[3 + self.about] = self.rotation[1];
        inputs[6 + self.about] = self.rotation[2];
        inputs
    }
}

/// One quantity of the mechanical model.
#[derive(Clone, Debug, Serialize)]
pub struct Quantity {
    /// Name for readers.
    pub label: String,
    /// Variable of SloshTank, or empty if the quantity follows from several.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Estimate; `None` if the record does not tell it.
    pub value: Option<f64>,
    /// 95 % interval; `None` without a value, and if the result is not trusted.
    pub interval: Option<[f64; 2]>,
    /// Value by theory.
    pub predicted: Option<f64>,
    /// Expected interval of that value.
    pub predicted_interval: Option<[f64; 2]>,
    /// The reason why no value is stated.
    pub reason: Option<String>,
}

/// A mechanical model from records of force and moment.
#[derive(Clone, Debug, Serialize)]
pub struct ForceRecord {
    /// The fit; quantities that the record does not tell are not among its parameters.
    #[serde(flatten)]
    pub found: Identification,
    /// The mechanical model.
    pub tank: Vec<Quantity>,
    /// True if the model fits and the search ended at a minimum. If false, no interval is stated and the values may be wrong.
    pub trusted: bool,
    /// Largest slosh angle of each record, rad; `None` if the record has no scale of it.
    pub largest_angle: Option<Vec<f64>>,
}

/// Places of the loads across the tank's axis that a record has: force and moment, of motion along the tank's x and y axes.
fn lateral(frame: &Frame, raw: &Raw) -> [[Option<(usize, f64)>; 2]; 2] {
    [0, 1].map(|axis| {
        let (force, sign) = frame.place(axis);
        // motion along x has a moment about y, motion along y one about -x
        let (moment, turned) = frame.place(1 - axis);
        let turned = if axis == 0 { turned } else { -turned };
        [(force, sign), (3 + moment, turned)].map(|of| raw.loads[of.0].as_ref().map(|_| of))
    })
}

/// Identifies the mechanical model.
///
/// # Errors
/// All that is wrong with records and options, and what the FMU refuses.
pub fn identify(
    model: &Model,
    task: &Task,
    raws: &[Raw],
    news: &mut dyn FnMut(&News),
) -> Result<ForceRecord> {
    let first = raws.first().context("there is no record")?;
    for raw in raws {
        raw.check().with_context(|| format!("{} cannot be used", raw.name))?;
        ensure!(
            (0..6).all(|k| raw.loads[k].is_some() == first.loads[k].is_some()),
            "{} and {} have different forces and moments (allowed: the same in all records)",
            first.name,
            raw.name
        );
    }
    let across = lateral(&task.frame, first);
    ensure!(
        across.iter().flatten().any(Option::is_some),
        "there is no force or moment across the tank's axis (allowed: {}; --columns Fx=COLUMN:UNIT names them, --axes states the frame)",
        LOADS.map(|(name, _)| name).join(", ")
    );
    let mut loads = raws.to_vec();
    for raw in &mut loads {
        into_frame(&task.frame, raw, 0.0)?;
    }
    let start = Start::of(task, &loads)?;
    news(&News::Step(start.words()));
    let window = start.period(task.gravity) / 8.0;
    let mut loads = raws.to_vec();
    for raw in &mut loads {
        into_frame(&task.frame, raw, window)?;
    }
    // waves that never break show no breaking: as an unknown it would bias the other damping
    let growth = tank::ZETA_BREAKING.at([start.mode]);
    let is_own = task.priors.iter().any(|prior| prior.name == growth);
    let is_settled = is_own || task.settings.iter().any(|setting| setting.name == growth);
    let (mut asked, records) = question(task, &loads, &start, window, is_own)?;
    let mut found = any_fmu::identify(model, &asked, &records, news)?;
    let angles_of = |asked: &Question, found: &Identification| {
        angles(model, asked, &records, found, start.mode)
    };
    let mut angles = angles_of(&asked, &found)?;
    let largest = angles.iter().flatten().copied().fold(0.0, f64::max);
    let breaks =
        has_scale(task, &start, &found) && breaking::steepness(largest) >= breaking::least();
    if breaks && !is_settled {
        news(&News::Step(format!("waves break: k a reaches {:.2}", breaking::steepness(largest))));
        (asked, _) = question(task, &loads, &start, window, true)?;
        found = any_fmu::identify(model, &asked, &records, news)?;
        angles = angles_of(&asked, &found)?;
    }
    interpret(task, &asked, &records, &start, found, &angles)
}

/// Turns the loads into those on the tank, in axes and about a point that move with it.
fn into_frame(frame: &Frame, raw: &mut Raw, window: f64) -> Result<()> {
    if frame.is_reaction {
        raw.loads.iter_mut().flatten().flatten().for_each(|value| *value = -*value);
    }
    if !frame.is_fixed || !raw.is_moved() {
        return Ok(());
    }
    // a moment's lever and a rotation take in the other components
    let turns = |k: usize| raw.motion[6 + k].is_some();
    for k in 0..3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let is_moved = [(i, j), (j, i)].map(|(along, other)| (raw.motion[along].is_some(), other));
        let lever = is_moved.into_iter().filter(|(moved, _)| *moved && raw.loads[3 + k].is_some());
        let turned =
            [(i, j), (j, i)].into_iter().filter(|(own, _)| turns(k) && raw.loads[*own].is_some());
        let needs = lever.map(|(_, other)| other).chain(turned.map(|(_, other)| other));
        for other in needs {
            ensure!(
                raw.loads[other].is_some(),
                "{}: loads in axes that are fixed in space need {} too, which is not recorded",
                raw.name,
                LOADS[other].0
            );
        }
    }
    for row in 0..raw.time.len() {
        let moved = raw.at(raw.time[row], window)?;
        let value = |k: usize| raw.loads[k].as_ref().map(|values| values[row]);
        let force = [0, 1, 2].map(|k| value(k).unwrap_or(0.0));
        let lever = cross(moved.place, force);
        let moment = [0, 1, 2].map(|k| value(3 + k).unwrap_or(0.0) - lever[k]);
        let (force, moment) = (moved.turned(force), moved.turned(moment));
        for k in 0..3 {
            if let Some(values) = &mut raw.loads[k] {
                values[row] = force[k];
            }
            if let Some(values) = &mut raw.loads[3 + k] {
                values[row] = moment[k];
            }
        }
    }
    Ok(())
}

/// The FMU's name of a load.
fn load_name(k: usize) -> String {
    if k < 3 { FORCE.at([k + 1]) } else { TORQUE.at([k - 2]) }
}

/// The FMU's name of an input of [`Moved::inputs`].
fn input_name(k: usize) -> String {
    [A, OMEGA, OMEGA_DOT][k / 3].at([k % 3 + 1])
}

/// Specific force at rest in the record's axes.
fn upwards(task: &Task) -> [f64; 3] {
    task.frame.axes[2].map(|axis| axis * task.gravity)
}

/// Records of the FMU's inputs and outputs, with the inputs that change.
fn records(
    task: &Task,
    raws: &[Raw],
    start: &Start,
    window: f64,
) -> Result<(Vec<usize>, Vec<Record>)> {
    let up = upwards(task);
    let omega = std::f64::consts::TAU / start.period(task.gravity);
    let is_moved = raws.iter().any(Raw::is_moved);
    let mut made = Vec::new();
    for raw in raws {
        let outputs = raw.loads.iter().flatten();
        let mut record = Record {
            name: raw.name.clone(),
            outputs: outputs.clone().map(|_| Vec::new()).collect(),
            inputs: vec![Vec::new(); if is_moved { 9 } else { 0 }],
            ..Record::default()
        };
        for row in 0..raw.time.len() {
            let t = raw.time[row];
            let step = raw.time.get(row + 1).map_or(0.0, |next| next - t);
            let parts = match is_moved {
                true => (step * omega / INPUT_PHASE).ceil().clamp(1.0, MOST_INPUTS),
                false => 1.0,
            };
            for part in 0..if step > 0.0 { parts as usize } else { 1 } {
                let t = t + step * part as f64 / parts;
                record.time.push(t);
                if is_moved {
                    let inputs = raw.at(t, window)?.inputs(up);
                    record
                        .inputs
                        .iter_mut()
                        .zip(inputs)
                        .for_each(|(column, value)| column.push(value));
                }
                for (column, values) in record.outputs.iter_mut().zip(outputs.clone()) {
                    column.push(if part == 0 { values[row] } else { f64::NAN });
                }
            }
        }
        made.push(record);
    }
    // a constant input does not drive the liquid
    let rest = Moved::default().inputs(up);
    let changes = |k: &usize| {
        let mut values = made.iter().flat_map(|record| record.inputs[*k].iter());
        values.any(|value| (value - rest[*k]).abs() > 1e-9 * (1.0 + rest[*k].abs()))
    };
    let kept: Vec<usize> = (0..if is_moved { 9 } else { 0 }).filter(changes).collect();
    for record in &mut made {
        record.inputs = kept.iter().map(|k| record.inputs[*k].clone()).collect();
    }
    Ok((kept, made))
}

/// Returns true if the records tell the size of the slosh angle. A free decay without a known angle or mass shows their product alone.
fn has_scale(task: &Task, start: &Start, found: &Identification) -> bool {
    let mass = tank::MASS.at([start.mode]);
    start.is_moved
        || !found.parameters.contains_key(&mass)
        || task.release.is_some()
        || task.priors.iter().any(|prior| prior.name == mass)
}

/// Names of the parameters of waves that break.
fn of_breaking(mode: usize) -> [String; 2] {
    [tank::ZETA_BREAKING.at([mode]), tank::BREAKING_STEEPNESS.at([mode])]
}

/// The question for the engine, with or without waves that break.
fn question(
    task: &Task,
    raws: &[Raw],
    start: &Start,
    window: f64,
    breaks: bool,
) -> Result<(Question, Vec<Record>)> {
    let (inputs, records) = records(task, raws, start, window)?;
    let outputs: Vec<usize> = (0..6).filter(|k| raws[0].loads[*k].is_some()).collect();
    let mut settings: Vec<(String, String)> = Vec::new();
    match &task.prediction {
        Some(prediction) => settings.extend(prediction.settings.iter().cloned()),
        None => {
            settings.push((tank::MODES.into(), "1".into()));
            settings.push((tank::I_Z.into(), "0".into()));
        }
    }
    let mut real = |name: String, value: f64| settings.push((name, format!("{value:?}")));
    real(tank::G_REF.into(), task.gravity);
    for (k, q) in task.frame.quaternion().into_iter().enumerate() {
        real(tank::Q.at([k + 1]), q);
    }
    for k in 0..3 {
        let along = |axis: usize| task.frame.axes[axis][k] * task.frame.point[axis];
        real(tank::POSITION.at([k + 1]), -(along(0) + along(1) + along(2)));
        real(A.at([k + 1]), upwards(task)[k]);
    }
    let (mut free, mut priors) = (Vec::new(), Vec::new());
    for unknown in start.unknowns(task, raws, !inputs.is_empty()) {
        if !breaks && of_breaking(start.mode).contains(&unknown.name) {
            continue;
        }
        real(unknown.name.clone(), unknown.start);
        let known = task.settings.iter().any(|setting| setting.name == unknown.name);
        if unknown.is_free && !known {
            priors.push(Prior {
                name: unknown.name.clone(),
                mean: unknown.start,
                std: unknown.prior,
            });
            free.push(Free {
                name: unknown.name,
                each: unknown.each,
                start: unknown.start,
                bounds: unknown.bounds,
            });
        }
    }
    // one prior for the start of each record
    let mut each = Vec::new();
    for prior in priors {
        let is_each = free.iter().any(|free| free.name == prior.name && free.each);
        let names: Vec<String> = match is_each {
            true => (1..=raws.len()).map(|k| format!("{}@{k}", prior.name)).collect(),
            false => vec![prior.name.clone()],
        };
        each.extend(names.into_iter().map(|name| Prior { name, ..prior }));
    }
    each.retain(|prior| !task.priors.iter().any(|own| own.name == prior.name));
    each.extend(task.priors.iter().cloned());
    let mut biases = Vec::new();
    ensure!(
        task.biases.is_empty() || !task.frame.is_fixed || inputs.is_empty(),
        "--bias with --fixed (allowed: one of them if the tank moves): an offset in fixed axes changes in those of the tank. Give the \
         loads in the tank's axes"
    );
    for bias in &task.biases {
        let place = LOADS.iter().position(|(name, _)| *name == bias.output);
        let place = place.filter(|k| outputs.contains(k)).with_context(|| {
            let there: Vec<&str> = outputs.iter().map(|k| LOADS[*k].0).collect();
            format!("--bias {} (allowed: {})", bias.output, there.join(", "))
        })?;
        biases.push(Bias { output: load_name(place), std: bias.std });
    }
    let settings =
        settings.into_iter().map(|(name, value)| Setting { name, recording: None, value });
    let question = Question {
        free,
        priors: each,
        settings: settings.chain(task.settings.iter().cloned()).collect(),
        inputs: inputs.into_iter().map(input_name).collect(),
        held: Vec::new(),
        outputs: outputs.into_iter().map(load_name).collect(),
        sensors: Vec::new(),
        biases,
        tolerances: Vec::new(),
        triads: Vec::new(),
        drift: task.drift,
        solver: Solver::Own,
        tolerance: task.tolerance,
        starts: task.starts,
    };
    Ok((question, records))
}

/// Slosh angles of the fitted mode over each record, rad.
fn angles(
    model: &Model,
    question: &Question,
    records: &[Record],
    found: &Identification,
    mode: usize,
) -> Result<Vec<Vec<f64>>> {
    let outputs = vec![tank::ANGLE_X.at([mode]), tank::ANGLE_Y.at([mode])];
    let asked = Question { outputs, biases: Vec::new(), ..question.clone() };
    let setup = Setup::new(&asked, model.description())?;
    let one = |(number, record): (usize, &Record)| -> Result<Vec<f64>> {
        let mut values = Vec::new();
        for (name, estimate) in &found.parameters {
            let name = match name.rsplit_once('@') {
                Some((_, of)) if of != (number + 1).to_string() => continue,
                Some((name, _)) => name,
                None => name,
            };
            values.push((real(model.description(), name)?.reference, estimate.value));
        }
        let read = setup.run(model, &values, number, record)?;
        Ok(read[0].iter().zip(&read[1]).map(|(x, y)| x.hypot(*y)).collect())
    };
    records.iter().enumerate().map(one).collect()
}

/// The mechanical model, with reasons for what the record does not tell.
fn interpret(
    task: &Task,
    question: &Question,
    records: &[Record],
    start: &Start,
    mut found: Identification,
    angles: &[Vec<f64>],
) -> Result<ForceRecord> {
    let n = start.mode;
    let largest_angle: Vec<f64> =
        angles.iter().map(|angles| angles.iter().copied().fold(0.0, f64::max)).collect();
    let prior = |name: &str| question.priors.iter().find(|prior| prior.name == name).map(|p| p.std);
    let trusted = found.fits == Some(true) && found.converged;
    let most = if trusted { STATED } else { STATED_WITHOUT_FIT };
    let is_own = |name: &str| task.priors.iter().any(|prior| prior.name == name);
    let has_scale = has_scale(task, start, &found);
    let scaled = [tank::LENGTH.at([n]), tank::HINGE.at([n]), tank::ZETA.at([n]), tank::M_0.into()];
    let is_told = |name: &str, e: &Estimated| {
        if !has_scale && !scaled.iter().any(|other| other == name) {
            return false;
        }
        // at a bound only one end counts
        let width = e.interval[1] - e.interval[0];
        let is_narrow = prior(name).is_none_or(|prior| is_own(name) || e.std < most * prior);
        let lists = [&found.details.not_determined, &found.details.decided_by_solver];
        let is_listed = lists.iter().any(|list| list.iter().any(|other| other == name));
        let is_in_set =
            found.details.cannot_tell_apart.iter().any(|set| set.direction.contains_key(name));
        let is_stopped = !trusted && found.details.at_bound.iter().any(|other| other == name);
        !is_stopped
            && e.std.is_finite()
            && width.is_finite()
            && is_narrow
            && !is_listed
            && !is_in_set
    };
    let told: BTreeMap<String, bool> =
        found.parameters.iter().map(|(name, e)| (name.clone(), is_told(name, e))).collect();
    let context = reasons::Context {
        task,
        question,
        start,
        angles,
        told: &told,
        has_scale,
        at_bound: &found.details.at_bound,
        trusted,
    };
    let mut quantities = Vec::new();
    let predicted = |name: &str| task.prediction.as_ref().and_then(|p| p.values.get(name).copied());
    // no load depends on a wave that does not break
    let unbroken = Estimated {
        value: 0.0,
        std: f64::INFINITY,
        std_noise: f64::INFINITY,
        interval: [0.0, f64::INFINITY],
        determined: false,
        unit: "1".into(),
    };
    let is_unbroken = |name: &String| {
        of_breaking(n).contains(name) && !task.settings.iter().any(|setting| setting.name == *name)
    };
    for (label, name) in start.labels() {
        let Some(e) = found.parameters.get(&name) else {
            if is_unbroken(&name) {
                quantities.push(Quantity {
                    label,
                    unit: unbroken.unit.clone(),
                    value: None,
                    interval: None,
                    predicted: predicted(&name).map(|p| p.value),
                    predicted_interval: None,
                    reason: Some(context.reason(&name, &unbroken)),
                    name,
                });
            }
            continue;
        };
        let theory = predicted(&name);
        let is_told = told[&name];
        quantities.push(Quantity {
            label,
            unit: e.unit.clone(),
            value: is_told.then_some(e.value),
            interval: (trusted && is_told).then_some(e.interval),
            predicted: theory.map(|p| p.value),
            predicted_interval: theory.and_then(|p| p.interval),
            reason: (!is_told).then(|| context.reason(&name, e)),
            name,
        });
    }
    let mut also = derived(task, start, &found, &told, has_scale.then_some(most));
    if !trusted {
        also.iter_mut().for_each(|quantity| quantity.interval = None);
    }
    quantities.extend(also);
    for number in 0..records.len() {
        let at_start = [0, 1].map(|axis| format!("{}@{}", tank::P_0.at([n, axis + 1]), number + 1));
        let at_start =
            at_start.iter().filter_map(|name| found.parameters.get(name).map(|e| (name, e)));
        for (name, e) in at_start {
            let is_told = told[name];
            quantities.push(Quantity {
                label: format!("slosh angle at the start of {}", records[number].name),
                name: name.clone(),
                unit: "deg".into(),
                value: is_told.then(|| e.value.atan().to_degrees()),
                interval: (trusted && is_told)
                    .then(|| e.interval.map(|end| end.atan().to_degrees())),
                predicted: None,
                predicted_interval: None,
                reason: (!is_told).then(|| context.reason(name, e)),
            });
        }
    }
    quantities.extend(offsets(task, records, &mut found, trusted));
    let untold: Vec<&String> =
        told.iter().filter(|(_, told)| !**told).map(|(name, _)| name).collect();
    // their remarks state values
    let is_of = |line: &String, name: &str| {
        line.strip_prefix(name).is_some_and(|rest| rest.starts_with([' ', ':']))
    };
    found.verdict.retain(|line| !untold.iter().any(|name| is_of(line, name)));
    found.verdict.retain(|line| trusted || !line.contains("its 95 % interval"));
    // --tank takes no tolerances
    found.verdict.retain(|line| line != any_fmu::NOISE_ALONE);
    if trusted {
        found.verdict.push("The intervals include noise alone: settings, motion, clock and the scales of the loads count as exact.".into());
    }
    let is_fitted = question.free.iter().any(|free| free.name == tank::ZETA_BREAKING.at([n]));
    if !trusted && !is_fitted {
        let largest = largest_angle.iter().copied().fold(0.0, f64::max);
        found.verdict.extend(left_out(n, largest, has_scale));
    }
    found.parameters.retain(|name, _| told[name]);
    let reasons = quantities.iter().filter_map(|q| Some((q, q.reason.as_ref()?)));
    found.verdict.extend(reasons.map(|(q, reason)| format!("{} is not stated: {reason}", q.label)));
    let largest_angle = has_scale.then_some(largest_angle);
    Ok(ForceRecord { found, tank: quantities, trusted, largest_angle })
}

/// The words about a misfit whose waves break in a fit without this damping, with the way to estimate it; nothing if they do not.
fn left_out(mode: usize, largest: f64, has_scale: bool) -> Option<String> {
    let steepness = breaking::steepness(largest);
    let [growth, mass] = [tank::ZETA_BREAKING.at([mode]), tank::MASS.at([mode])];
    let way = match has_scale {
        true => format!("{growth} is set: without --set {growth} it is estimated"),
        false => format!(
            "the fit leaves this damping out, because the slosh angle is not known: with --release DEG or --set {mass}=KG it \
             estimates {growth}"
        ),
    };
    (steepness >= breaking::least()).then(|| {
        format!(
            "The likeliest cause is waves that break: in the fit k a reaches {steepness:.2} ({:.1}°), and they break from {:.2} on. Here \
             {way}.",
            largest.to_degrees(),
            breaking::least()
        )
    })
}

/// Takes the offsets of the loads out of the fit, by the names and in the signs of the records.
fn offsets(
    task: &Task,
    records: &[Record],
    found: &mut Identification,
    trusted: bool,
) -> Vec<Quantity> {
    let sign = if task.frame.is_reaction { -1.0 } else { 1.0 };
    let mut all = Vec::new();
    for (k, (load, unit)) in LOADS.iter().enumerate() {
        for (number, record) in records.iter().enumerate() {
            let name_of = |load: &str| format!("bias({load})@{}", number + 1);
            let Some(e) = found.measurement.remove(&name_of(&load_name(k))) else { continue };
            let mut interval = e.interval.map(|end| sign * end);
            interval.sort_by(f64::total_cmp);
            all.push(Quantity {
                label: format!("offset of {load} in {}", record.name),
                name: name_of(load),
                unit: (*unit).into(),
                value: Some(sign * e.value),
                interval: trusted.then_some(interval),
                predicted: None,
                predicted_interval: None,
                reason: None,
            });
        }
    }
    all
}

/// Quantities that follow from several estimates.
fn derived(
    task: &Task,
    start: &Start,
    found: &Identification,
    told: &BTreeMap<String, bool>,
    most: Option<f64>,
) -> Vec<Quantity> {
    let n = start.mode;
    let (names, _) = &found.correlations;
    let place = |name: &str| names.iter().position(|other| other == name);
    let covariance = &found.details.covariance;
    let theory =
        |name: String| task.prediction.as_ref().and_then(|p| p.values.get(&name)).map(|p| p.value);
    let mut all = Vec::new();
    let mut add = |label: &str, unit: &str, value: f64, std: f64, predicted: Option<f64>| {
        if std.is_finite() {
            all.push(Quantity {
                label: label.into(),
                name: String::new(),
                unit: unit.into(),
                value: Some(value),
                interval: Some([value - 1.96 * std, value + 1.96 * std]),
                predicted,
                predicted_interval: None,
                reason: None,
            });
        }
    };
    // the frequency of small waves
    let length = tank::LENGTH.at([n]);
    if let Some(e) = found.parameters.get(&length).filter(|_| told[&length]) {
        let frequency = |l: f64| (task.gravity / l).sqrt() / std::f64::consts::TAU;
        let f = frequency(e.value);
        let by_theory = theory(length).filter(|_| start.stiffness == 0.0).map(frequency);
        if start.stiffness == 0.0 {
            add("frequency of small waves", "Hz", f, 0.5 * f * e.std / e.value, by_theory);
        }
    }
    // the planar shift, which a planar record knows better than s and κ
    let (s, kappa) = (tank::NONLINEAR_INERTIA.at([n]), tank::NONLINEAR_STIFFNESS.at([n]));
    if let (Some(i), Some(j)) = (place(&s), place(&kappa)) {
        let shift = |s: f64, kappa: f64| 0.375 * kappa - 0.5 * s;
        let value = shift(found.parameters[&s].value, found.parameters[&kappa].value);
        let variance =
            0.25 * covariance[i][i] + 0.140625 * covariance[j][j] - 0.375 * covariance[i][j];
        let std = variance.max(0.0).sqrt();
        let predicted = theory(s).zip(theory(kappa)).map(|(s, kappa)| shift(s, kappa));
        if most.is_some_and(|most| std < most * shift_prior()) {
            add("planar shift of ω² over A², 3κ/8 − s/2", "1", value, std, predicted);
        }
    }
    // the product that a small free decay knows
    let mass = tank::MASS.at([n]);
    for (number, axis) in (1..=99).flat_map(|number| [(number, 1), (number, 2)]) {
        let p = format!("{}@{number}", tank::P_0.at([n, axis]));
        let (Some(i), Some(j)) = (place(&mass), place(&p)) else { continue };
        if told[&mass] || told[&p] {
            continue;
        }
        let (m, p) = (found.parameters[&mass].value, found.parameters[&p].value);
        let variance =
            p * p * covariance[i][i] + m * m * covariance[j][j] + 2.0 * m * p * covariance[i][j];
        add(
            "modal mass times slosh angle at the start",
            "kg.rad",
            m * p,
            variance.max(0.0).sqrt(),
            None,
        );
    }
    all
}

/// Standard deviation of the planar shift by the priors of s and κ.
fn shift_prior() -> f64 {
    (0.5 * WIDE_SHIFT).hypot(0.375 * WIDE_SHIFT)
}

/// Head of the column of values.
fn head(result: &ForceRecord) -> &'static str {
    if result.trusted { "estimate" } else { "NOT TRUSTED" }
}

/// Lines for a terminal; the verdict comes first.
pub fn lines(result: &ForceRecord) -> Vec<String> {
    let mut lines = result.found.verdict.clone();
    lines.push(format!(
        "{:44} {:>12} {:>27} {:>12}  unit",
        "mechanical model",
        head(result),
        "95 % interval",
        "by theory"
    ));
    let number = |value: f64| format!("{value:.5}");
    for q in &result.tank {
        let interval =
            q.interval.map_or("-".into(), |[low, high]| format!("{low:.5} to {high:.5}"));
        lines.push(format!(
            "{:44} {:>12} {interval:>27} {:>12}  {}",
            q.label,
            q.value.map_or("not told".into(), number),
            q.predicted.map_or("-".into(), number),
            crate::estimate::prose(&q.unit)
        ));
    }
    if let Some(angles) = &result.largest_angle {
        let angles = angles.iter().map(|a| format!("{:.1}°", a.to_degrees()));
        lines.push(format!("largest slosh angle: {}", angles.collect::<Vec<_>>().join(", ")));
    }
    lines.extend(any_fmu::lines(&result.found));
    lines
}

/// The page, in HTML.
pub fn page(result: &ForceRecord) -> String {
    let rows = result.tank.iter().map(|q| {
        let number = |value: f64| format!("{value:.5}");
        let interval = |of: Option<[f64; 2]>| {
            of.map_or("–".into(), |[low, high]| format!("{low:.5} to {high:.5}"))
        };
        vec![
            q.label.clone(),
            q.value.map_or("not told".into(), number),
            interval(q.interval),
            q.predicted.map_or("–".into(), number),
            interval(q.predicted_interval),
            crate::estimate::prose(&q.unit),
        ]
    });
    let head = ["quantity", head(result), "95 % interval", "by theory", "expected", "unit"];
    let table = report::page::table(head, rows);
    let doubt = result.found.verdict.first().filter(|_| !result.trusted);
    let first = maud::html! { h2 { "Mechanical model" } @if let Some(doubt) = doubt { p { (doubt) } } (table) };
    any_fmu::page_with(&result.found, first)
}

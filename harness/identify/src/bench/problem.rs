//! The bench's unknowns, signals and starts for one slosh model and friction law.

use std::sync::OnceLock;

use analysis::innovations::LIMIT;
use analysis::statistics::{deviation, noise_level, peak};
use anyhow::{Result, ensure};
use host::causality::Causality;
use host::description::Type;
use host::fmu::Fmu;
use names::hubslosh::{
    FrictionModel, SloshModel, TAU_EXT, friction, hub, init, slosh, tank, wheel,
};

use super::combination;
use super::system::{ADDITIONAL_TORQUES, BenchSystem, Target};
use crate::bench::breaking;
use crate::bench::nominal::{self, Nominal, PARAMETERS, Start};
use crate::bench::options::Options;
use crate::engine::{Drift, Hold, Part, Problem, Recorded, Role, Signal, Unknown};
use crate::input::recording::Recording;
use crate::input::tolerance;
use crate::model::overridden::{near, refuse};
use crate::model::unknown::range;

/// Indices of the gyro's rate and the encoder's angle in the list of outputs.
const RATE: usize = 0;
const ANGLE: usize = 1;

/// Expected drift of a MEMS gyro (the thesis's LSM6DS3).
const GYRO_DRIFT: Drift = Drift { size: 0.2, time: 100.0, width: 0.7 };
/// Expected drift of an encoder's angle. It is the integral of the rate that the model does not explain. The size of this rate is
/// unknown, so the width is large.
const ENCODER_DRIFT: Drift = Drift { size: 1.0, time: 100.0, width: 6.0 };
/// Standard deviation of a delay's prior, and the delay's bounds, s.
pub const DELAY: (f64, f64, f64) = (0.05, -0.2, 0.5);
/// Prior standard deviation of the asymmetry of the dry friction, which is usually small against 1.
const ASYMMETRY: f64 = 0.5;
/// Prior standard deviation of each friction coefficient b, c and d, relative to its start value.
const FRICTION_WIDTH: f64 = 10.0;
/// Lower bound of each friction coefficient b, c and d, relative to its start value.
pub const LEAST_FRICTION: f64 = 1e-4;
/// Prior standard deviation of ln ω_s, where ω_s is the Stribeck speed, and the largest factor between ω_s and its start value.
const SPEED: (f64, f64) = (1.5, 30.0);
/// Smallest and largest ratio of a known value to its nominal value that the fit allows.
const WIDEST: (f64, f64) = (0.6, 1.6);

struct List<'a> {
    fmu: &'a Fmu,
    unknowns: Vec<Unknown>,
    targets: Vec<Target>,
}

impl List<'_> {
    fn add(&mut self, target: Target, unknown: Unknown) {
        self.targets.push(target);
        self.unknowns.push(unknown);
    }

    fn add_parameter(&mut self, unknown: Unknown) {
        self.add(Target::Parameter(unknown.name.clone()), unknown);
    }

    /// Returns the unit of a parameter of the FMU, and its bounds: the FMU's own ones, restricted to `least` and `largest`.
    fn variable(&self, name: &str, (least, largest): (f64, f64)) -> (String, (f64, f64)) {
        let description = self.fmu.description();
        let Ok(variable) = description.variable(name) else {
            return ("1".into(), (least, largest));
        };
        let [low, high] = range(variable);
        (description.unit(variable).into(), (low.max(least), high.min(largest)))
    }

    fn parameter(&self, name: &str, start: f64) -> Unknown {
        let (unit, bounds) = self.variable(name, (1e-6 * start, 1e6 * start));
        Unknown::positive(name, &unit, Role::Run(None), start, bounds)
    }

    /// Returns a parameter of the FMU that may be 0, such as a friction coefficient, as an unknown. Its coordinate is the value
    /// itself, because a logarithm cannot reach 0.
    fn nonnegative(&self, name: &str, start: f64) -> Unknown {
        let (unit, bounds) = self.variable(name, (0.0, f64::INFINITY));
        Unknown::linear(name, &unit, Role::Run(None), (start, start), bounds)
    }
}

/// Returns the bench with one slosh model and friction law, its unknowns, and the values of all unknowns at each start.
///
/// # Errors
/// If an option names a parameter that cannot be estimated, or the data give no finite start.
pub fn system<'a>(
    fmu: &'a Fmu,
    recordings: &'a [Recording],
    options: &Options,
    (model, law): (&str, &str),
    starts: &[Start],
) -> Result<(BenchSystem<'a>, Vec<Unknown>, Vec<Vec<f64>>)> {
    let nominal = Nominal::of(fmu, &options.settings, &[])?;
    let is_set = |name: &str| options.settings.iter().any(|(n, _)| n == name);
    let known = |name: &str| options.known.iter().find(|(n, ..)| n == name);
    let given = |name: &str| options.starts.iter().find(|(n, _)| n == name).map(|(_, v)| *v);
    let frozen = model == SloshModel::Frozen.name();
    let run = Role::Run(None);
    // if tank, hub or modes are set or known, the FMU's own parameters are the unknowns
    let shapes = [tank::D, tank::H, hub::I];
    let is_shaped = |name: &str| name.starts_with("slosh.") && name != slosh::MODEL;
    let by_modes = !frozen
        && !shapes.iter().any(|name| is_set(name) || known(name).is_some())
        && !options.settings.iter().any(|(name, _)| is_shaped(name));
    let start_of = |start: &Start| -> Start {
        let mut own = *start;
        for name in PARAMETERS {
            *own.parameter_mut(name) = given(name).unwrap_or(own.parameter(name));
        }
        match shapes.iter().any(|name| given(name).is_some()) {
            true => own.with_modes(nominal.bench),
            false => own,
        }
    };
    let mut all: Vec<Start> = starts.iter().map(start_of).collect();
    if !options.starts.is_empty() {
        all.extend_from_slice(starts);
    }
    let mut first = all[0];
    let mut list = List { fmu, unknowns: Vec::new(), targets: Vec::new() };
    if by_modes {
        let positive = |name: &str, unit: &str, start: f64, by: f64| {
            Unknown::positive(name, unit, run, start, (start / by, start * by))
        };
        list.add(Target::Length, positive(tank::D, "m", first.length, 10.0));
        let ratio = positive(tank::H, "m", first.mass_ratio.clamp(0.01, 1.0), 1.0);
        list.add(Target::MassRatio, Unknown { bounds: (0.002, 3.0), ..ratio });
        let zeta = list.parameter(slosh::ZETA, first.zeta);
        list.add(Target::Zeta, Unknown { bounds: (1e-5, 0.9), ..zeta });
        list.add(Target::Inertia, positive(hub::I, "kg.m2", first.inertia, 20.0));
    } else {
        if first.hub_inertia <= 0.0 {
            first.hub_inertia = 0.3;
        }
        for name in [tank::D, tank::H, slosh::ZETA, hub::I] {
            if !is_set(name) && (name == hub::I || !frozen) {
                list.add_parameter(list.parameter(name, first.parameter(name)));
            }
        }
    }
    let viscous = law != FrictionModel::None.name();
    let dry = viscous && law != FrictionModel::Viscous.name();
    for (name, used) in [(friction::B, viscous), (friction::C, dry), (friction::D, dry)] {
        if used && !is_set(name) {
            let start = first.parameter(name);
            let own = list.nonnegative(name, start).with_prior(start, FRICTION_WIDTH * start);
            // the LuGre law does not allow 0
            list.add_parameter(Unknown { bounds: (LEAST_FRICTION * start, own.bounds.1), ..own });
        }
    }
    if dry && !is_set(friction::OMEGA_S) {
        // starts at the usual Stribeck speed of the bearing if all recorded rates are lower: such rates do not determine ω_s
        let start = first.omega_s.max(nominal.start.omega_s);
        let unknown = list.parameter(friction::OMEGA_S, start).with_prior(start.ln(), SPEED.0);
        let bounds = (start / SPEED.1, start * SPEED.1);
        list.add_parameter(Unknown { bounds, bent: !is_set(friction::D), ..unknown });
    }
    if law == FrictionModel::Lugre.name() && !is_set(friction::SIGMA0) {
        // bristles that are stiffer than the upper bound deflect by less than 1/100 of the angle that the gyro resolves
        let unknown = list.parameter(friction::SIGMA0, 100.0);
        list.add_parameter(Unknown { bounds: (0.1, 1000.0), ..unknown });
    }
    // a parameter is also estimated if the user gives its start or its prior
    for name in options.starts.iter().map(|s| &s.0).chain(options.known.iter().map(|k| &k.0)) {
        let is_listed = list.unknowns.iter().any(|u| u.name == *name);
        let is_of_bench = PARAMETERS.contains(&name.as_str()) || name == friction::ASYMMETRY;
        if is_listed || is_set(name) || is_of_bench {
            continue;
        }
        let variable = fmu.description().variable(name)?;
        ensure!(
            variable.causality == Causality::Parameter && variable.kind() == Type::Real,
            "{name} cannot be estimated: it is not a parameter with a real value"
        );
        let start = given(name).or(known(name).map(|k| k.1)).unwrap_or(1.0);
        ensure!(start > 0.0, "{name}: only positive parameters can be estimated");
        list.add_parameter(list.nonnegative(name, start));
    }
    for (name, mean, std) in &options.known {
        if let Some(unknown) = list.unknowns.iter_mut().find(|u| u.name == *name) {
            let std = if unknown.log { std / mean } else { *std };
            unknown.prior = Some((unknown.coordinate(*mean), std));
            unknown.start = given(name).unwrap_or(*mean);
        }
    }
    let way = way(recordings);
    let has_encoder = recordings.iter().any(|r| r.angle.is_some());
    if options.sensor_errors {
        if dry && !is_set(friction::ASYMMETRY) {
            let of = |role, end: f64| {
                let one = Unknown::linear(friction::ASYMMETRY, "1", role, (0.0, 0.1), (-end, end));
                one.with_prior(0.0, ASYMMETRY)
            };
            match way == 0.0 {
                true => list.add_parameter(of(run, 0.98)),
                false => {
                    let one = Unknown { part: Part::Tolerance, ..of(Role::Derived, 0.9) };
                    list.add(Target::Asymmetry, one);
                }
            }
        }
        let (std, low, high) = DELAY;
        let delay = |name: &str, output| {
            let role = Role::Delay(output);
            Unknown::linear(name, "s", role, (0.0, 0.01), (low, high)).with_prior(0.0, std)
        };
        list.add(Target::Delay, delay("delay", RATE));
        if has_encoder {
            list.add(Target::AngleDelay, delay("angle_delay", ANGLE));
        }
        for k in 0..recordings.len() {
            let bias = bias(&format!("gyro_bias[{}]", k + 1), "rad/s", (RATE, k), 0.0);
            list.add(Target::GyroBias, bias);
        }
    }
    for (k, recording) in recordings.iter().enumerate() {
        if let Some(angle) = &recording.angle {
            let offset = bias(&format!("angle_offset[{}]", k + 1), "rad", (ANGLE, k), angle[0]);
            list.add(Target::AngleOffset, offset);
        }
    }
    for target in &options.effects {
        list.add(target.clone(), effect(target, Part::Free));
    }
    if options.breaking && !frozen {
        let (begins, std) = breaking::BEGINS;
        let growth = list.nonnegative(slosh::ZETA_BREAKING, 0.04).with_prior(0.04, 0.2);
        let onset = list.nonnegative(slosh::BREAKING_STEEPNESS, begins).with_prior(begins, std);
        for one in [growth, Unknown { reach: 0.1, ..onset }] {
            if !is_set(&one.name) {
                list.add_parameter(one);
            }
        }
    }
    for (k, recording) in recordings.iter().enumerate().filter(|(_, r)| !r.from_rest) {
        let (rate, spread) = (recording.first_rate(), deviation(&recording.rate));
        let states = [
            (init::OMEGA, "rad/s", (rate, spread), 1e3, spread),
            (init::SLOSH_ANGLE, "rad", (0.0, 0.1), 1.4, 0.5),
            (init::SLOSH_RATE, "rad/s", (0.0, 1.0), 100.0, 7.0),
        ];
        for (name, unit, start, end, std) in &states[..if frozen { 1 } else { 3 }] {
            let (role, own) = (Role::Run(Some(k)), format!("{name}[{}]", k + 1));
            let state = Unknown::linear(&own, unit, role, *start, (-end, *end));
            list.add(Target::Initial(k, (*name).into()), state.with_prior(start.0, *std));
        }
    }
    // the gyro's scale is free only if the recording determines it, as an encoder or nonlinear slosh does; a fixed scale would
    // then leave a residual that is more than noise
    let nonlinear = !frozen && model != SloshModel::Linear.name();
    if options.gyro_scale > 0.0 {
        let std = options.gyro_scale;
        let scale =
            Unknown::linear("gyro_scale", "1", Role::Gain(RATE, RATE), (0.0, std), (-0.5, 1.0));
        let part = if nonlinear || has_encoder { Part::Free } else { Part::Tolerance };
        list.add(Target::GyroScale, Unknown { part, ..scale.with_prior(0.0, std) });
    }
    let derived = list.unknowns.len();
    let targets = [Target::Torque, Target::Clock, Target::Gravity, Target::Arm, Target::Density];
    let is_recorded = recordings.iter().any(|r| r.gravity.is_some());
    for ((target, name), std) in
        targets.into_iter().zip(tolerance::NAMES).zip(options.tolerances.all())
    {
        // a value with a prior or a start has no tolerance in addition
        let has_value = known(name).is_some() || given(name).is_some();
        if std > 0.0 && !has_value && !(target == Target::Gravity && is_recorded) {
            let is_derived = target == Target::Density && by_modes;
            let role = if is_derived { Role::Derived } else { run };
            let one = Unknown::positive(name, "1", role, 1.0, WIDEST).with_prior(0.0, std);
            list.add(target, Unknown { part: Part::Tolerance, reach: std, ..one });
        }
    }
    candidates(&mut list, options, frozen, law);
    let mut settings = vec![
        (slosh::MODEL.to_string(), model.to_string()),
        (slosh::ZETA_FROM_CORRELATION.to_string(), "false".to_string()),
        (friction::MODEL.to_string(), law.to_string()),
    ];
    if law == FrictionModel::Lugre.name() {
        // a bearing with little viscous friction allows no damping of the bristles
        settings.push((friction::SIGMA1.into(), "0".into()));
    }
    let chosen = |name: &str| matches!(name, slosh::MODEL | friction::MODEL);
    settings.extend(options.settings.iter().filter(|(name, _)| !chosen(name)).cloned());
    let List { unknowns, targets, .. } = list;
    for u in &unknowns {
        ensure!(
            u.start.is_finite() && u.bounds.0 <= u.bounds.1,
            "the recordings give {} = {:.3e} as the start of the search, which is impossible for a bench. Check units and signs of the columns, and the settings of the bench",
            u.name,
            u.start
        );
    }
    refuse_overridden(fmu, &settings, &unknowns, &targets)?;
    let values = |start: &Start| -> Vec<f64> {
        let of = |(unknown, target): (&Unknown, &Target)| match target {
            _ if unknown.part == Part::Candidate => unknown.start,
            Target::Length => start.length,
            Target::MassRatio => start.mass_ratio,
            Target::Inertia => start.inertia,
            Target::Zeta => start.zeta,
            Target::Parameter(name)
                if PARAMETERS.contains(&name.as_str())
                    && known(name).is_none()
                    && (name != hub::I || start.hub_inertia > 0.0) =>
            {
                start.parameter(name)
            }
            _ => unknown.start,
        };
        unknowns.iter().zip(&targets).map(of).collect()
    };
    let starts = all.iter().map(values).collect();
    let system = BenchSystem {
        fmu,
        recordings,
        settings,
        bench: nominal.bench,
        targets,
        derived,
        way,
        largest: recordings.iter().map(|r| peak(&r.torque)).fold(0.0, f64::max),
        base: OnceLock::new(),
    };
    Ok((system, unknowns, starts))
}

/// Returns the direction, 1 or −1, in which the hub turns in all recordings; 0 if it turns both ways. If a recording begins at
/// rest, its first value is subtracted, because it is the gyro's bias.
fn way(recordings: &[Recording]) -> f64 {
    let one = |recording: &Recording| {
        let bias = if recording.from_rest { recording.first_rate() } else { 0.0 };
        let noise = LIMIT * recording.rate_noise();
        let rates = recording.rate.iter().map(|rate| rate - bias);
        combination::way(rates.filter(|rate| rate.abs() > noise)).unwrap_or(0.0)
    };
    let first = recordings.first().map_or(0.0, one);
    if recordings.iter().all(|recording| one(recording) == first) { first } else { 0.0 }
}

fn bias(name: &str, unit: &str, (output, recording): (usize, usize), start: f64) -> Unknown {
    let role = Role::Bias(output, Some(recording));
    Unknown::linear(name, unit, role, (start, 1e-2), (f64::NEG_INFINITY, f64::INFINITY))
}

/// Returns the unknown for an effect that the FMU does not model. If it is free, it starts at its plausible size, otherwise at 0.
pub fn effect(target: &Target, part: Part) -> Unknown {
    let (name, unit, reach, bounds) = match target {
        Target::ActuatorLag => ("actuator_lag", "s", 0.02, (0.0, 1.0)),
        Target::GyroLag => ("gyro_lag", "s", 0.02, (0.0, 1.0)),
        Target::FrictionDrift => ("friction_drift", "1", 0.1, (-0.95, 5.0)),
        Target::Limit => ("limit", "1", 0.1, (0.0, 0.7)),
        Target::Compliance => ("compliance", "rad/(N.m)", 1e-2, (0.0, 10.0)),
        Target::SecondMode => ("second mode", "1", 1.0, (0.0, 3.0)),
        Target::ProportionalTorque(kind) => {
            let (follows, unit, _) = ADDITIONAL_TORQUES[*kind];
            (follows, unit, 1e-4, (f64::NEG_INFINITY, f64::INFINITY))
        }
        _ => ("effect", "1", 1.0, (0.0, 1.0)),
    };
    let start = if part == Part::Free { reach } else { 0.0 };
    Unknown { part, ..Unknown::linear(name, unit, Role::Run(None), (start, reach), bounds) }
}

/// Adds the effects that are tried if no model fits, for example a lag of the actuator.
fn candidates(list: &mut List, options: &Options, frozen: bool, law: &str) {
    let is_set = |name: &str| options.settings.iter().any(|(n, _)| n == name);
    let mut all: Vec<(Target, Unknown)> = Vec::new();
    for (target, used) in [
        (Target::ActuatorLag, true),
        (Target::GyroLag, true),
        (Target::FrictionDrift, true),
        (Target::Limit, !is_set(wheel::TAU_MAX)),
        (Target::Compliance, law == FrictionModel::Stribeck.name()),
        (Target::SecondMode, !frozen && !is_set(slosh::MODES)),
    ] {
        all.extend(used.then(|| (target.clone(), effect(&target, Part::Candidate))));
    }
    for (name, reach, used) in [(hub::K, 0.02, true), (slosh::ZETA_AMPLITUDE, 0.005, !frozen)] {
        let unknown = Unknown { part: Part::Candidate, reach, ..list.nonnegative(name, 0.0) };
        all.extend((used && !is_set(name)).then(|| (Target::Parameter(name.into()), unknown)));
    }
    // Values that the user states may be wrong, so they are candidate causes.
    for (name, value) in options.settings.iter().filter(|(n, _)| PARAMETERS.contains(&n.as_str())) {
        let stated = value.parse::<f64>().ok().filter(|value| *value > 0.0);
        if let Some(value) = stated.filter(|_| !(frozen && name.starts_with("slosh."))) {
            let unknown = Unknown { part: Part::Candidate, ..list.parameter(name, value) };
            all.push((Target::Parameter(name.clone()), unknown));
        }
    }
    for (name, ..) in &options.known {
        let Some(j) = list.unknowns.iter().position(|u| u.name == *name) else { continue };
        let (unit, reach) = (&list.unknowns[j].unit, list.unknowns[j].reach);
        let ends = (f64::NEG_INFINITY, f64::INFINITY);
        let unknown = Unknown::linear(name, unit, Role::Stated(j), (0.0, reach), ends);
        let unknown = Unknown { part: Part::Candidate, ..unknown };
        all.push((Target::Stated(name.clone()), unknown));
    }
    if list.fmu.description().variable(TAU_EXT).is_ok() {
        let torques = (0..ADDITIONAL_TORQUES.len()).map(Target::ProportionalTorque);
        all.extend(torques.map(|target| (target.clone(), effect(&target, Part::Candidate))));
    }
    for (target, unknown) in all {
        if !list.targets.contains(&target) {
            list.add(target, unknown);
        }
    }
}

/// Returns an error if an unknown has no effect because the settings replace it by another parameter.
fn refuse_overridden(
    fmu: &Fmu,
    settings: &[(String, String)],
    unknowns: &[Unknown],
    targets: &[Target],
) -> Result<()> {
    let parameters = unknowns.iter().zip(targets).filter_map(|(unknown, target)| match target {
        Target::Parameter(name) if unknown.part == Part::Free => {
            let value = unknown.start;
            Some((name.clone(), near(value, (f64::MIN, f64::MAX), value.abs()).to_string()))
        }
        _ => None,
    });
    let parameters: Vec<_> = parameters.collect();
    let settings = [settings, &parameters].concat();
    // values that the FMU refuses are reported later, by the search
    let warnings = nominal::warnings(fmu, &settings).unwrap_or_default();
    parameters.iter().try_for_each(|(name, _)| refuse(name, &warnings))
}

pub fn problem<'a>(
    system: &'a BenchSystem,
    unknowns: Vec<Unknown>,
    starts: Vec<Vec<f64>>,
    options: &Options,
) -> Problem<'a> {
    let mut signals = Vec::new();
    let mut recordings = Vec::new();
    for (k, recording) in system.recordings.iter().enumerate() {
        let rows = recording.time.len();
        let all = |mask: &Option<Vec<bool>>| mask.clone().unwrap_or_else(|| vec![true; rows]);
        signals.push(Signal {
            recording: k,
            output: RATE,
            measured: recording.rate.clone(),
            sampled: all(&recording.fresh),
            white: recording.rate_noise(),
            drift: Some(GYRO_DRIFT),
        });
        if let Some(angle) = &recording.angle {
            signals.push(Signal {
                recording: k,
                output: ANGLE,
                measured: angle.clone(),
                sampled: all(&recording.angle_fresh),
                white: noise_level(&recording.of_fresh_angle(angle)),
                drift: Some(ENCODER_DRIFT),
            });
        }
        recordings.push(Recorded {
            name: recording.name.clone(),
            time: recording.time.clone(),
            inputs: vec![recording.torque.clone()],
            step: recording.torque_step(),
        });
    }
    let holds = match options.intersample {
        Some(hold) => vec![hold],
        None => guessed(system.recordings),
    };
    let plain = Problem::new(system, recordings, signals, unknowns, starts);
    Problem { holds, acausal: options.acausal, drawn: 2, ..plain }
}

/// Returns the possible intersample behaviours of the torque, the likeliest first: a torque that changes seldom is probably held.
/// For a nearly constant torque only one behaviour is returned, because all behaviours give the same motion.
fn guessed(recordings: &[Recording]) -> Vec<Hold> {
    let square = |x: f64| x * x;
    let varies = |recording: &Recording| {
        let changes: f64 = recording.torque.windows(2).map(|t| square(t[1] - t[0])).sum();
        changes > 1e-4 * recording.torque.iter().map(|t| square(*t)).sum::<f64>()
    };
    if !recordings.iter().any(varies) {
        return vec![Hold::FirstOrderHold];
    }
    let torque = &recordings[0].torque;
    let same = torque.windows(2).filter(|pair| pair[0] == pair[1]).count();
    let first =
        if 5 * same > 4 * torque.len() { Hold::ZeroOrderHold } else { Hold::FirstOrderHold };
    let others = Hold::ALL.into_iter().filter(|hold| *hold != first);
    std::iter::once(first).chain(others).collect()
}

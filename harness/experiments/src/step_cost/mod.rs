//! Cost of one communication step, and the number of internal steps that a deadline allows.
//!
//! A manoeuvre is simulated in steps with held inputs. Each step is repeated several times from the same saved state, and
//! the shortest time counts, because other programs only add to a time. Trials find the `solver.max_steps` that meets a
//! deadline: at states along the manoeuvre an FMU with this limit gets a step that is far too long. It takes as many
//! internal steps as allowed and refuses the step. The longest of these times is the worst case of a step.

pub mod instructions;

use std::hint::black_box;
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use host::c_abi::{CallError, Called};
use host::description::{Type, Value};
use host::fmu::{Fmu, Instance};
use names::hubslosh::{TAU_CMD, solver};

use crate::profile::Written;
use crate::run::{Run, driven};

/// The parameter that bounds the internal steps of a communication step.
pub const MAX_STEPS: &str = solver::MAX_STEPS;
/// Number of repetitions of a step from the same state.
const TAKEN: usize = 5;
/// The longest step that is asked for, s: what it needs no FMU needs more.
const LONGEST: f64 = 1e6;
/// More internal steps are no bound.
const MOST: u64 = 1_000_000;
/// States along the manoeuvre at which the cost of the most internal steps is looked at, and the time for that, s.
const STATES: usize = 40;
const TIME: f64 = 0.5;

/// Default drive of an FMU of this project.
struct Usual {
    settings: &'static [(&'static str, &'static str)],
    input: &'static str,
    profile: &'static str,
}

/// The bench and the tank have a sweep through their first resonance, the craft a slew under thrust.
fn usual(model: &str) -> Option<Usual> {
    let of = |settings, input, profile| Some(Usual { settings, input, profile });
    match model.split('_').next() {
        Some("HubSlosh") => of(&[], TAU_CMD, "exp-sweep:amplitude=0.1,f0=1.25,f1=3.5"),
        Some("SloshTank") => {
            of(&[("a[3]", "1.5")], "a[1]", "exp-sweep:amplitude=0.15,f0=0.2,f1=0.8")
        }
        Some("Spacecraft") => {
            of(&[("force[3]", "2400")], "torque[1]", "bang-stop-bang:amplitude=20")
        }
        _ => None,
    }
}

/// A manoeuvre of so many steps of a length, s. `profile` and `drive` take the place of what is usual for the FMU,
/// `settings` come after it.
///
/// # Errors
/// If an FMU for which nothing is usual is given no profile, or two inputs could be meant.
pub fn manoeuvre(
    fmu: &Fmu,
    (steps, step): (usize, f64),
    profile: Option<&str>,
    drive: Option<&str>,
    settings: &[(String, String)],
) -> Result<(Run, String)> {
    let description = fmu.description();
    ensure!(steps > 0, "0 steps (allowed: 1 and more)");
    let stop = steps as f64 * step;
    ensure!(
        step > 0.0 && stop.is_finite(),
        "the step must be a positive number of seconds, not {step}"
    );
    let usual = usual(&description.model_name);
    let input = match (drive, &usual) {
        (None, Some(usual)) => Some(usual.input.to_string()),
        (drive, _) => driven(description, drive)?,
    };
    let profile = match (profile, &usual) {
        (Some(profile), _) => profile.to_string(),
        (None, Some(Usual { profile, .. })) => match profile.starts_with("bang") {
            true => format!("{profile},bang={},stop={}", stop / 8.0, stop / 4.0),
            false => format!("{profile},duration={stop}"),
        },
        (None, None) => bail!(
            "{} is none of HubSlosh, SloshTank and Spacecraft: name what it is driven by with --profile",
            description.model_name
        ),
    };
    let own = usual.map_or(&[][..], |usual| usual.settings);
    let mut all: Vec<(String, String)> =
        own.iter().map(|(name, value)| (name.to_string(), value.to_string())).collect();
    all.retain(|(name, _)| Some(name) != input.as_ref());
    all.extend_from_slice(settings);
    let run = Run {
        settings: all,
        input,
        torque: profile.parse::<Written>()?.torque()?,
        others: Vec::new(),
        step,
        stop,
        tolerance: None,
        hold: true,
    };
    run.check()?;
    Ok((run, profile))
}

/// Median, 99.99th percentile (nearest rank) and maximum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread<T> {
    /// Half of the steps cost at most this.
    pub median: T,
    /// All but one in 10,000.
    pub p99_99: T,
    /// All.
    pub max: T,
}

impl Spread<f64> {
    fn of(values: &[f64]) -> Spread<f64> {
        let mut values = values.to_vec();
        values.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| {
            let rank = (share * values.len() as f64).ceil() as usize;
            values[rank.clamp(1, values.len()) - 1]
        };
        Spread { median: at(0.5), p99_99: at(0.9999), max: at(1.0) }
    }
}

/// Takes a manoeuvre's instance from step to step.
struct Course<'r, 'fmu> {
    run: &'r Run,
    instance: Instance<'fmu>,
    reference: Option<u32>,
    /// The next step.
    k: usize,
}

impl<'r, 'fmu> Course<'r, 'fmu> {
    fn new(run: &'r Run, fmu: &'fmu Fmu) -> Result<Course<'r, 'fmu>> {
        // without a stop time, which would bind longer steps
        let input = run.input.as_deref().map(|name| fmu.description().variable(name));
        let reference = input.transpose()?.map(|variable| variable.reference);
        Ok(Course { run, instance: run.initialise_without_end(fmu)?, reference, k: 0 })
    }

    fn time(&self) -> f64 {
        self.run.start() + self.k as f64 * self.run.step
    }

    /// Sets the input for the step that begins now.
    fn drive(&mut self) -> Called {
        match self.reference {
            Some(reference) => {
                let now = self.run.torque.at(self.time());
                self.instance.set_real(&[reference], &[now])
            }
            None => Ok(()),
        }
    }

    /// Makes a step of `h` from here; it is the caller's to go on or back.
    fn try_step(&mut self, h: f64) -> Called {
        self.instance.do_step(self.time(), h)
    }

    /// Makes the manoeuvre's own step and goes on.
    fn go_on(&mut self) -> Called {
        self.try_step(self.run.step)?;
        self.k += 1;
        Ok(())
    }
}

/// The least time of every step of a manoeuvre, s. `progress` hears of every step.
///
/// # Errors
/// What the FMU refuses.
pub fn times(fmu: &Fmu, run: &Run, progress: impl Fn(u64)) -> Result<Vec<f64>> {
    let mut course = Course::new(run, fmu)?;
    let mut times = Vec::with_capacity(run.steps());
    for _ in 0..run.steps() {
        let at = course.time();
        let least = || -> Called<f64> {
            course.drive()?;
            let here = course.instance.get_state()?;
            let mut least = f64::INFINITY;
            for _ in 0..TAKEN {
                course.instance.set_state(&here)?;
                let start = Instant::now();
                let done = black_box(course.try_step(run.step));
                least = least.min(start.elapsed().as_secs_f64());
                done?;
            }
            course.instance.free_state(here)?;
            course.k += 1;
            Ok(least)
        };
        let mut least = least;
        times.push(least().with_context(|| format!("the step at t = {at} s was not made"))?);
        progress(1);
    }
    Ok(times)
}

/// Median, percentile and maximum of times.
pub fn spread(times: &[f64]) -> Spread<f64> {
    Spread::of(times)
}

/// Returns true if a step was refused because it needs more internal steps than allowed.
fn is_too_much(error: &CallError) -> bool {
    error.text().contains(MAX_STEPS)
}

/// A manoeuvre whose FMU may take so many internal steps.
fn bounded(run: &Run, max_steps: u64) -> Run {
    let mut bounded = run.clone();
    bounded.settings.retain(|(name, _)| name != MAX_STEPS);
    bounded.settings.push((MAX_STEPS.into(), max_steps.to_string()));
    bounded
}

/// Time at which a manoeuvre is refused because a step needs more than `max_steps` internal steps, s.
fn refused(fmu: &Fmu, run: &Run, max_steps: u64) -> Result<Option<f64>> {
    let run = bounded(run, max_steps);
    let mut course = Course::new(&run, fmu)?;
    for _ in 0..run.steps() {
        course.drive()?;
        match course.go_on() {
            Err(error) if is_too_much(&error) => return Ok(Some(course.time())),
            done => done?,
        }
    }
    Ok(None)
}

/// Largest number of internal steps in one step of the manoeuvre, and its time, s.
fn needed(fmu: &Fmu, run: &Run, progress: &impl Fn(u64)) -> Result<(u64, f64)> {
    let mut when = run.start();
    let (mut too_few, mut enough) = (0, 1);
    while let Some(at) = refused(fmu, run, enough)? {
        progress(1);
        (when, too_few) = (at, enough);
        enough *= 2;
        ensure!(enough <= MOST, "the step at t = {when} s needs more than {MOST} internal steps");
    }
    while enough - too_few > 1 {
        let middle = too_few + (enough - too_few) / 2;
        match refused(fmu, run, middle)? {
            Some(at) => (when, too_few) = (at, middle),
            None => enough = middle,
        }
        progress(1);
    }
    Ok((enough, when))
}

/// Worst time of `max_steps` internal steps, s: the longest time of a step that is refused after them, at states along
/// the manoeuvre, each the least of several.
fn worst(fmu: &Fmu, run: &Run, max_steps: u64, allowed: f64) -> Result<f64> {
    let run = bounded(run, max_steps);
    let mut course = Course::new(&run, fmu)?;
    let taken = if allowed < 0.02 { TAKEN } else { 2 };
    let states = ((TIME / (taken as f64 * allowed)) as usize).clamp(3, STATES).min(run.steps());
    let every = run.steps() / states;
    let (mut worst, mut long, mut looked_at): (f64, f64, usize) = (0.0, run.step, 0);
    for k in 0..run.steps() {
        course.drive()?;
        if k % every == every / 2 {
            let here = course.instance.get_state()?;
            let mut least = f64::INFINITY;
            let mut times = 0;
            while times < taken {
                course.instance.set_state(&here)?;
                let start = Instant::now();
                let done = black_box(course.try_step(long));
                let time = start.elapsed().as_secs_f64();
                match done {
                    Ok(()) if long < LONGEST => {
                        (long, times, least) = (2.0 * long, 0, f64::INFINITY)
                    }
                    Ok(()) => (least, times) = (least.min(time), times + 1),
                    Err(error) if is_too_much(&error) => {
                        (least, times) = (least.min(time), times + 1);
                    }
                    // The motion leaves the model's range before that many steps are made.
                    Err(_) if long > run.step => {
                        long /= 4.0;
                        break;
                    }
                    Err(error) => return Err(error.into()),
                }
            }
            if times == taken {
                (worst, looked_at) = (worst.max(least), looked_at + 1);
            }
            course.instance.take_messages();
            course.instance.set_state(&here)?;
            course.instance.free_state(here)?;
            course.drive()?;
        }
        course.go_on()?;
    }
    ensure!(
        looked_at > 0,
        "no step of {max_steps} internal steps can be made from anywhere in the manoeuvre: it leaves the range of \
         the model before"
    );
    Ok(worst)
}

/// Choice for a deadline.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    /// Value for `solver.max_steps`.
    pub max_steps: u64,
    /// Worst time of this many internal steps, s.
    pub worst: f64,
    /// Largest number of internal steps that the manoeuvre itself needs.
    pub needed: u64,
}

/// The largest number of internal steps whose worst measured cost, `margin` times, is within a deadline, s: to 1/64 of it.
/// `progress` hears of every manoeuvre made.
///
/// # Errors
/// If the FMU has no such parameter; if the deadline is too short for the manoeuvre's own steps.
pub fn choose(
    fmu: &Fmu,
    run: &Run,
    deadline: f64,
    margin: f64,
    progress: impl Fn(u64),
) -> Result<Choice> {
    let description = fmu.description();
    let model = &description.model_name;
    let parameter = description.variable(MAX_STEPS).ok().filter(|v| v.kind() == Type::Integer);
    let parameter = parameter.with_context(|| {
        format!("{model} has no parameter {MAX_STEPS}, by which a deadline could be kept")
    })?;
    ensure!((1e-9..=1.0).contains(&deadline), "--deadline {deadline} s (allowed: 1e-9 s to 1 s)");
    ensure!((1.0..=100.0).contains(&margin), "--margin {margin} (allowed: 1 to 100)");
    let allowed = deadline / margin;
    let (needed, when) = needed(fmu, run, &progress)?;
    let mut fits = worst(fmu, run, needed, allowed)?;
    progress(1);
    ensure!(
        fits <= allowed,
        "a deadline of {deadline} s is too short: the step at t = {when} s needs {needed} internal steps, which \
         take up to {fits:.2e} s, {:.2e} s with the margin {margin} (allowed: --deadline of that and more, a \
         smaller --margin, a shorter --step)",
        fits * margin
    );
    let most = match description.value(parameter, &MOST.to_string()) {
        Ok(Value::Integer(most)) => most as u64,
        _ => MOST,
    };
    let (mut low, mut high) = (needed, needed);
    while low == high && high < most {
        high = (2 * high).min(most);
        let cost = worst(fmu, run, high, allowed)?;
        progress(1);
        if cost <= allowed {
            (low, fits) = (high, cost);
        }
    }
    while high - low > (low / 64).max(1) {
        let middle = low + (high - low) / 2;
        let cost = worst(fmu, run, middle, allowed)?;
        progress(1);
        match cost <= allowed {
            true => (low, fits) = (middle, cost),
            false => high = middle,
        }
    }
    Ok(Choice { max_steps: low, worst: fits, needed })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_of_the_nearest_rank() {
        let values: Vec<f64> = (1..=20_000).rev().map(f64::from).collect();
        let Spread { median, p99_99, max } = Spread::of(&values);
        assert_eq!((median, p99_99, max), (10_000.0, 19_998.0, 20_000.0));
        let few = Spread::of(&[3.0]);
        assert_eq!((few.median, few.p99_99, few.max), (3.0, 3.0, 3.0));
    }
}

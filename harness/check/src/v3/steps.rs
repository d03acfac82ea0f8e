//! Rules about steps in FMI 3.0: results of fmi3DoStep, events, intermediate update, derivatives and
//! dependencies (FMI 3.0.2, sections 2.2.9 to 2.2.12, 2.3.5 and 4).

use anyhow::Result;

use super::subject::{STEPS, Session, Subject};
use crate::description::Variable;
use crate::findings::Findings;
use crate::under_test::{Use, skip};
use host::causality::{Causality, Variability};
use host::description::{CType, Value};
use host::fmi3::{Interface, Step, UNWRITTEN, Update};

/// Lists the faults in the results that the FMU returns from one fmi3DoStep of `h` seconds that starts at the time `from`.
fn faults(using: Use, step: &Step, from: f64, h: f64) -> Vec<String> {
    let mut faults = Vec::new();
    for (name, byte) in [
        ("eventHandlingNeeded", step.event),
        ("terminateSimulation", step.terminate),
        ("earlyReturn", step.early_return),
    ] {
        match byte {
            0 | 1 => {}
            UNWRITTEN => faults.push(format!("{name} is not written")),
            other => faults.push(format!("{name} is {other} (allowed: 0, 1)")),
        }
    }
    // Section 4.2.1 allows an FMU to end slightly off the communication point, if its own steps do not fit into the step.
    let slack = 1e-2 * h;
    let end = from + h;
    if step.last_time.is_nan() {
        faults.push("lastSuccessfulTime is not written".into());
    } else if step.early_return == 1 {
        if !using.early_return {
            faults.push("fmi3DoStep returns early although earlyReturnAllowed is false".into());
        }
        if step.last_time < from - slack || step.last_time > end + slack {
            faults.push(format!(
                "lastSuccessfulTime after an early return is {:?} (allowed: {from:?} to {end:?})",
                step.last_time
            ));
        }
    } else if (step.last_time - end).abs() > slack {
        faults.push(format!(
            "lastSuccessfulTime is {:?}, but the step ends at {end:?} (required: equal times without early return)",
            step.last_time
        ));
    }
    if step.event == 1 && !using.event_mode {
        faults.push("eventHandlingNeeded is true although eventModeUsed is false".into());
    }
    faults
}

fn stepping_uses(subject: &Subject) -> Vec<Use> {
    let uses = subject.uses().into_iter();
    uses.filter(|u| u.interface == Interface::CoSimulation).collect()
}

/// Returns the ways to use the FMU in which the host handles events; skips the rule if there are
/// none.
fn uses_with_events(subject: &Subject) -> Result<Vec<Use>> {
    let mut uses = subject.uses();
    uses.retain(|u| u.event_mode || u.interface == Interface::ModelExchange);
    if uses.is_empty() { skip("the FMU has no event mode") } else { Ok(uses) }
}

const LONG: usize = 200;

pub fn runs(subject: &Subject, findings: &mut Findings) -> Result<()> {
    for using in subject.uses() {
        let mut session = subject.running(using)?;
        for _ in 0..STEPS {
            session.advance(1)?;
            let wrong = |(_, x): &&(String, f64)| !x.is_finite();
            let outputs = outputs(&mut session, false)?;
            if let Some((name, x)) = outputs.iter().find(wrong) {
                findings.at(format!("{name}, t = {:?} s ({using})", session.time)).add(format!(
                    "the value is {x} after a step that returned fmi3OK (allowed: finite)"
                ));
                break;
            }
        }
    }
    Ok(())
}

pub fn iterates(subject: &Subject, _: &mut Findings) -> Result<()> {
    subject.uses().into_iter().try_for_each(|using| subject.running(using)?.advance(STEPS))
}

pub fn answers(subject: &Subject, findings: &mut Findings) -> Result<()> {
    subject.stepping()?;
    let is_clock =
        |v: &&Variable| v.causality == Causality::Independent && v.c_type == CType::Float64;
    let clock = subject.readable().find(is_clock).cloned();
    for using in stepping_uses(subject) {
        let mut session = subject.running(using)?;
        let mut told: Vec<String> = Vec::new();
        for k in 0..LONG {
            session.count = k;
            session.stimulate()?;
            let (from, h) = (session.time, session.step);
            let step = session.raw_step(h)?;
            let mut all = faults(using, &step, from, h);
            if let Some(v) = &clock
                && let [Value::Real(own)] = session.read(v)?[..]
                && (own - step.last_time).abs() > 1e-2 * h
            {
                all.push(format!(
                    "lastSuccessfulTime is {:?}, but the independent variable {} is {own:?}",
                    step.last_time, v.name
                ));
            }
            for fault in all {
                let kind = fault.split_whitespace().take(2).collect::<Vec<_>>().join(" ");
                if !told.contains(&kind) {
                    findings.at(format!("{using}, step from {from:?} s")).add(fault);
                    told.push(kind);
                }
            }
            if step.event == 1 && using.event_mode && !session.is_ended() {
                session.event()?;
            }
            if session.is_ended() {
                break;
            }
        }
    }
    Ok(())
}

pub fn wrong(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let mut session = subject.stepping()?;
    session.advance(1)?;
    let place = "fmi3DoStep with a communicationStepSize below 0";
    let (time, h) = (session.time, -session.step);
    if subject.with_undefined_effect(place, findings, || session.instance.do_step(time, h)).is_ok()
    {
        findings.at(place).add("the call returns fmi3OK (allowed: fmi3Error)");
    }
    Ok(())
}

pub fn event_answers(subject: &Subject, findings: &mut Findings) -> Result<()> {
    for using in uses_with_events(subject)? {
        let mut session = subject.session(using)?;
        session.enter_initialization()?;
        session.instance.exit_initialization_mode()?;
        let mut steps = 0;
        for k in 0..LONG {
            let info = session.leave_event()?;
            for (name, byte) in [
                ("discreteStatesNeedUpdate", info.needs_update),
                ("terminateSimulation", info.terminate),
                ("nominalsOfContinuousStatesChanged", info.nominals_changed),
                ("valuesOfContinuousStatesChanged", info.values_changed),
                ("nextEventTimeDefined", info.next_event_defined),
            ] {
                if byte > 1 {
                    let what =
                        if byte == UNWRITTEN { "is not written" } else { "is neither 0 nor 1" };
                    findings
                        .at(format!("{using}, fmi3UpdateDiscreteStates"))
                        .add(format!("{name} {what}"));
                }
            }
            let passed = |next: f64| next.is_nan() || next <= session.time;
            if info.next_event_defined == 1 && passed(info.next_event_time) {
                findings.at(format!("{}, t = {:?} s", using, session.time)).add(format!(
                    "nextEventTime is {:?} (required: later than the present time)",
                    info.next_event_time
                ));
            }
            if session.is_ended() || !findings.list.is_empty() {
                break;
            }
            // Simulates until the next event.
            let events = session.notes.events;
            while session.notes.events == events && !session.is_ended() && steps < LONG {
                steps += 1;
                session.count = k;
                session.stimulate()?;
                let until = session.time + session.step;
                session.advance_to(until)?;
            }
            if session.is_ended() || session.notes.events == events || steps >= LONG {
                break;
            }
            subject.announce(format!("event mode at {:?} s", session.time));
            session.instance.enter_event_mode()?;
        }
    }
    Ok(())
}

pub fn idempotent(subject: &Subject, findings: &mut Findings) -> Result<()> {
    for using in uses_with_events(subject)? {
        let mut session = subject.running(using)?;
        session.advance(STEPS)?;
        if session.is_ended() {
            continue;
        }
        session.instance.enter_event_mode()?;
        session.iterate()?;
        let before = session.readings()?;
        let info = session.iterate()?;
        let after = session.readings()?;
        let clocks =
            subject.description.variables.iter().any(|v| v.written.get("clocks").is_some());
        if let Some(text) = session.difference(&after, &before)
            && !clocks
            && info.terminate != 1
        {
            findings
                .at(format!("{using}, another fmi3UpdateDiscreteStates at the same instant"))
                .add(text);
        }
    }
    Ok(())
}

pub fn discrete_held(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let uses: Vec<Use> = stepping_uses(subject).into_iter().filter(|u| u.event_mode).collect();
    if uses.is_empty() {
        findings.skip("the FMU has no event mode in Co-Simulation");
    }
    let discrete: Vec<Variable> = subject
        .readable()
        .filter(|v| v.variability == Variability::Discrete && v.causality != Causality::Input)
        .cloned()
        .collect();
    for using in uses {
        let mut session = subject.running(using)?;
        for k in 0..LONG {
            session.count = k;
            session.stimulate()?;
            let before: Vec<Vec<Value>> =
                discrete.iter().map(|v| session.read(v)).collect::<Result<_>>()?;
            let (from, h) = (session.time, session.step);
            let step = session.raw_step(h)?;
            for (v, before) in discrete.iter().zip(&before) {
                let after = session.read(v)?;
                if after != *before {
                    findings.at(v.place()).add(format!(
                            "the value is {before:?} before and {after:?} after fmi3DoStep from {from:?} s ({using}; allowed: \
                             discrete variables change in event mode alone)"
                        ));
                    return Ok(());
                }
            }
            if step.event == 1 && !session.is_ended() {
                session.event()?;
            }
            if session.is_ended() {
                break;
            }
        }
    }
    Ok(())
}

fn outputs(session: &mut Session, continuous: bool) -> Result<Vec<(String, f64)>> {
    let wanted =
        |v: &&Variable| v.causality == Causality::Output && (!continuous || v.is_continuous());
    let all: Vec<Variable> = session.fmu.readable().filter(wanted).cloned().collect();
    let mut outputs = Vec::new();
    for v in all {
        for value in session.read(&v)? {
            if !matches!(value, Value::String(_)) {
                outputs.push((v.name.clone(), value.number()));
            }
        }
    }
    Ok(outputs)
}

/// Relative difference of an output that is allowed between two ways to use the FMU, for example with and without event
/// mode. The FMU's solver may restart at other times in these runs.
const SAME: f64 = 1e-3;

pub fn same_trajectory(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let mut plain = subject.stepping()?;
    let mut reference = Vec::new();
    let until = |session: &Session, k: usize| {
        session.fmu.experiment().start + (k + 1) as f64 * session.step
    };
    for k in 0..LONG {
        if plain.is_ended() {
            break;
        }
        let to = until(&plain, k);
        plain.advance_to(to)?;
        reference.push(outputs(&mut plain, false)?);
    }
    let others: Vec<Use> =
        stepping_uses(subject).into_iter().filter(|u| *u != Use::PLAIN).collect();
    if others.is_empty() {
        findings.skip("the FMU has neither event mode nor early return");
    }
    for using in others {
        let mut session = subject.running(using)?;
        for (k, expected) in reference.iter().enumerate() {
            let to = until(&session, k);
            session.advance_to(to)?;
            let own = outputs(&mut session, false)?;
            let size = |name: &str| {
                let all = reference.iter().flatten().filter(|(n, _)| n == name);
                all.fold(0.0, |size: f64, (_, x)| size.max(x.abs()))
            };
            let far = own
                .iter()
                .zip(expected)
                .find(|((name, a), (_, b))| (a - b).abs() > SAME * size(name));
            if let Some(((name, a), (_, b))) = far {
                findings
                    .at(format!("{using}, t = {to:?} s"))
                    .add(format!("{name} is {a:?}, but {b:?} in Co-Simulation without events and early return (required: the same trajectory)"));
                break;
            }
        }
    }
    Ok(())
}

fn require_updates(subject: &Subject) -> Result<()> {
    let stepping = Interface::CoSimulation;
    match subject.binary(stepping) {
        Ok(_) => subject.require(stepping, "providesIntermediateUpdate"),
        Err(_) => skip("providesIntermediateUpdate is not declared"),
    }
}

const UPDATING: Use = Use { updates: true, ..Use::PLAIN };

pub fn intermediate_time(subject: &Subject, findings: &mut Findings) -> Result<()> {
    require_updates(subject)?;
    let mut session = subject.running(UPDATING)?;
    let mut last = f64::NEG_INFINITY;
    for k in 0..STEPS {
        session.count = k;
        session.stimulate()?;
        let (from, h) = (session.time, session.step);
        // The FMU's own steps may not fit into the communication step, see `faults`.
        let slack = 1e-2 * h;
        let mut wrong: Option<String> = None;
        session.raw_step_with_updates(
            h,
            Some(&mut |update: &Update| {
                let t = update.time;
                if !(t >= from - slack && t <= from + h + slack) {
                    wrong.get_or_insert(format!(
                        "intermediateUpdateTime {t:?} lies outside of the step"
                    ));
                } else if t < last - slack {
                    wrong.get_or_insert(format!("intermediateUpdateTime is {t:?}, but an earlier update had {last:?} (required: times that do not fall)"));
                }
                if update.can_return_early {
                    wrong.get_or_insert(
                        "canReturnEarly is true although earlyReturnAllowed is false".into(),
                    );
                }
                if update.step_finished {
                    last = last.max(t);
                }
                None
            }),
        )?;
        if let Some(text) = wrong {
            findings.at(format!("step from {from:?} s by {h:?} s")).add(text);
            return Ok(());
        }
    }
    if session.instance.updates() == 0 {
        findings
            .at("intermediateUpdate")
            .add("intermediateUpdate is never called, although providesIntermediateUpdate is true");
    }
    Ok(())
}

pub fn intermediate_early_return(subject: &Subject, findings: &mut Findings) -> Result<()> {
    require_updates(subject)?;
    subject.require(Interface::CoSimulation, "canReturnEarlyAfterIntermediateUpdate")?;
    let using = Use { early_return: true, ..UPDATING };
    let mut session = subject.running(using)?;
    let (from, h) = (session.time, 10.0 * session.step);
    let mut asked = None;
    let step = session.raw_step_with_updates(
        h,
        Some(&mut |update: &Update| {
            if update.can_return_early && asked.is_none() && update.time < from + h {
                asked = Some(update.time);
                return Some(update.time);
            }
            None
        }),
    )?;
    match asked {
        None => {
            findings.skip("the FMU offers no early return in a step of ten communication steps")
        }
        Some(time) if step.early_return != 1 => {
            findings.at(format!("step from {from:?} s by {h:?} s")).add(format!(
                "the host requested an early return at {time:?} s, but earlyReturn is {} (required: 1)",
                step.early_return
            ))
        }
        Some(time) if !(step.last_time <= from + h && step.last_time >= time - 1e-9 * h) => {
            findings.at(format!("step from {from:?} s by {h:?} s")).add(format!(
                "lastSuccessfulTime is {:?} after an early return that the host requested at {time:?} s",
                step.last_time
            ))
        }
        Some(_) => {}
    }
    Ok(())
}

/// `intermediate.inputs`: checks that inputs which are set in the intermediate update act within the step.
///
/// The reference is a simulation with steps 64 times as short. Outputs with an input that changes linearly in time
/// must be closer to the reference than outputs with a held input. The short steps also use intermediate update,
/// because an FMU may use the input's rate (a wheel's torque is minus the rate of its momentum), and held inputs have
/// no rate for any step size.
pub fn intermediate_inputs(subject: &Subject, findings: &mut Findings) -> Result<()> {
    require_updates(subject)?;
    let inputs: Vec<Variable> = subject
        .inputs
        .iter()
        .copied()
        .filter(|v| v.written.flag("intermediateUpdate"))
        .cloned()
        .collect();
    if inputs.is_empty() {
        return skip("no input has intermediateUpdate");
    }
    const FINE: usize = 64;
    let fixed = subject.description.interface("CoSimulation");
    if fixed.is_some_and(|e| !e.flag("canHandleVariableCommunicationStepSize")) {
        return skip("the communication step of the FMU is fixed");
    }
    for v in &inputs {
        let (min, max) = v.bounds();
        let starts: Vec<f64> = v.starts.iter().filter_map(|s| host::xml::double(s)).collect();
        let start = |i: usize| starts.get(i).or(starts.first()).copied().unwrap_or(0.0);
        let steps = 8;
        let h = subject.experiment().step;
        let slope = v.nominal().max(start(0).abs()) / (h * steps as f64);
        if start(0) + slope * h * steps as f64 > max || start(0) < min {
            continue;
        }
        let at = |t: f64| -> Vec<f64> {
            (0..v.length()).map(|i| start(i) + slope * (t - subject.experiment().start)).collect()
        };
        let run = |parts: usize, along: bool| -> Result<Vec<(String, f64)>> {
            let mut session = subject.running(if along { UPDATING } else { Use::PLAIN })?;
            let h = h / parts as f64;
            for _ in 0..steps * parts {
                session.instance.set_numbers(&[v.reference], &at(session.time))?;
                if along {
                    session.raw_step_with_updates(
                        h,
                        Some(&mut |update: &Update| {
                            if update.set_requested {
                                update.set(&[v.reference], &at(update.time));
                            }
                            None
                        }),
                    )?;
                } else {
                    session.raw_step(h)?;
                }
            }
            outputs(&mut session, true)
        };
        let (fine, held, along) = (run(FINE, true)?, run(1, false)?, run(1, true)?);
        for (((name, right), (_, held)), (_, along)) in fine.iter().zip(&held).zip(&along) {
            // An output with direct feedthrough shows the last value of the input, even if the FMU ignores intermediate
            // values.
            let effect = (held - right).abs();
            if effect > 1e-9 * right.abs().max(1e-9) && (along - right).abs() > 0.6 * effect {
                findings.at(v.place()).add(format!(
                        "set in intermediate update along a line, {name} is {along:?}; held it is {held:?}, along the \
                         line with steps {FINE} times as short {right:?} (allowed: nearer to the last)"
                    ));
            }
        }
    }
    Ok(())
}

/// Returns the Float64 unknowns for which directional derivatives are checked, each with its declared Float64
/// dependencies.
fn pairs(subject: &Subject) -> Vec<(Variable, Vec<Variable>)> {
    let d = subject.description;
    let states = d.states();
    let lists = ["Output", "ContinuousStateDerivative"];
    let all = d.structure.iter().filter(|u| lists.contains(&u.list.as_str()));
    let float = |v: &Variable| v.c_type == CType::Float64 && v.is_continuous();
    all.filter_map(|u| {
        let unknown = d.variable_of(u).filter(|v| float(v))?;
        let knowns = d.variables.iter().filter(|v| {
            let listed = u.dependencies.as_ref().is_none_or(|all| all.contains(&v.reference));
            let is_known = v.causality == Causality::Input || states.contains(&v.reference);
            float(v) && is_known && listed
        });
        Some((unknown.clone(), knowns.cloned().collect()))
    })
    .collect()
}

fn real(values: &[Value]) -> Vec<f64> {
    values.iter().map(|v| if let Value::Real(x) = v { *x } else { f64::NAN }).collect()
}

/// Returns the value of `unknown` while one element of `known` is displaced by `by` from `base`.
fn unknown_at_displacement(
    session: &mut Session,
    unknown: &Variable,
    known: &Variable,
    base: &[f64],
    element: usize,
    by: f64,
) -> Result<Vec<f64>> {
    let mut moved = base.to_vec();
    moved[element] += by;
    session.instance.set_numbers(&[known.reference], &moved)?;
    let values = session.read(unknown)?;
    session.instance.set_numbers(&[known.reference], base)?;
    Ok(real(&values))
}

fn require_derivatives(subject: &Subject, flag: &str) -> Result<Use> {
    // In Model Exchange the derivatives are functions of states and inputs, so that finite differences can
    // be compared with them.
    if !subject.has(Interface::ModelExchange) {
        return skip(
            "the FMU offers no Model Exchange, where derivatives can be compared with differences",
        );
    }
    subject.require(Interface::ModelExchange, flag)?;
    Ok(Use::EXCHANGE)
}

struct Difference {
    quotient: f64,
    rounding: f64,
}

impl Difference {
    fn new(above: f64, below: f64, h: f64) -> Difference {
        let rounding = 1e-13 * above.abs().max(below.abs()) / h;
        Difference { quotient: (above - below) / (2.0 * h), rounding }
    }

    /// Returns true if `derivative`, which the FMU computes, equals the difference quotient except for rounding
    /// errors, a relative error of 1e-4, and the estimated error `unsure` of the quotient.
    fn is_near(&self, derivative: f64, unsure: f64) -> bool {
        let size = self.quotient.abs().max(derivative.abs());
        (derivative - self.quotient).abs() <= 1e-4 * size + self.rounding + unsure + 1e-9
    }
}

pub fn directional(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let using = require_derivatives(subject, "providesDirectionalDerivatives")?;
    let mut session = subject.running(using)?;
    session.advance(2)?;
    for (unknown, knowns) in pairs(subject) {
        for known in knowns {
            let base = real(&session.read(&known)?);
            for element in 0..base.len() {
                let mut seed = vec![0.0; base.len()];
                seed[element] = 1.0;
                subject.announce(format!(
                    "fmi3GetDirectionalDerivative of {} by {}",
                    unknown.name, known.name
                ));
                let own = session.instance.directional_derivative(
                    &[unknown.reference],
                    &[known.reference],
                    &seed,
                    unknown.length(),
                )?;
                let h = 1e-5 * base[element].abs().max(1e-3 * known.nominal()).max(1e-6);
                let mut differences = |h: f64| -> Result<Vec<Difference>> {
                    let plus =
                        unknown_at_displacement(&mut session, &unknown, &known, &base, element, h)?;
                    let minus = unknown_at_displacement(
                        &mut session,
                        &unknown,
                        &known,
                        &base,
                        element,
                        -h,
                    )?;
                    Ok(plus.iter().zip(&minus).map(|(a, b)| Difference::new(*a, *b, h)).collect())
                };
                let mut last = differences(h)?;
                let mut wrong: Vec<usize> =
                    (0..own.len()).filter(|i| !last[*i].is_near(own[*i], 0.0)).collect();
                // If terms cancel, the rounding error is larger than the value suggests; the difference between two
                // step sizes shows its size. A derivative is wrong only if it disagrees for every step size.
                for h in [10.0, 100.0, 1000.0].map(|times| times * h) {
                    let (min, max) = known.bounds();
                    if wrong.is_empty() || base[element] - h < min || base[element] + h > max {
                        break;
                    }
                    let wider = differences(h)?;
                    wrong.retain(|i| {
                        let unsure = (wider[*i].quotient - last[*i].quotient).abs();
                        !wider[*i].is_near(own[*i], unsure)
                    });
                    last = wider;
                }
                for i in wrong {
                    findings.at(unknown.place()).add(format!(
                        "fmi3GetDirectionalDerivative with respect to {} gives {:?}, but central differences give {:?} (required: equal derivatives)",
                        known.name, own[i], last[i].quotient
                    ));
                }
            }
        }
    }
    Ok(())
}

pub fn adjoint(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let using = require_derivatives(subject, "providesAdjointDerivatives")?;
    if !subject.has_capability(using.interface, "providesDirectionalDerivatives") {
        return skip(
            "the FMU provides no directional derivatives with which adjoint ones can be compared",
        );
    }
    let mut session = subject.running(using)?;
    session.advance(2)?;
    for (unknown, knowns) in pairs(subject) {
        for known in knowns {
            let (n, m) = (unknown.length(), known.length());
            for j in 0..m {
                let mut seed = vec![0.0; m];
                seed[j] = 1.0;
                let forward = session.instance.directional_derivative(
                    &[unknown.reference],
                    &[known.reference],
                    &seed,
                    n,
                )?;
                for (i, forward) in forward.iter().enumerate() {
                    let mut seed = vec![0.0; n];
                    seed[i] = 1.0;
                    subject.announce(format!(
                        "fmi3GetAdjointDerivative of {} by {}",
                        unknown.name, known.name
                    ));
                    let back = session.instance.adjoint_derivative(
                        &[unknown.reference],
                        &[known.reference],
                        &seed,
                        m,
                    )?[j];
                    let error = (back - forward).abs();
                    if error.is_nan() || error > 1e-12 * forward.abs().max(1e-12) {
                        findings.at(unknown.place()).add(format!(
                                "with respect to {} the adjoint derivative is {back:?}, but the directional derivative is {forward:?} (required: one is the transpose of the other)",
                                known.name
                            ));
                    }
                }
            }
        }
    }
    Ok(())
}

/// Returns true if a value has changed by more than a few units in its last place. Such small changes come from
/// rounding, for example if two terms cancel.
fn has_changed(after: f64, before: f64) -> bool {
    const ROUNDING: f64 = 16.0 * f64::EPSILON;
    let same = after.to_bits() == before.to_bits()
        || (after - before).abs() <= ROUNDING * after.abs().max(before.abs());
    !same
}

pub fn declared(subject: &Subject, findings: &mut Findings) -> Result<()> {
    if !subject.has(Interface::ModelExchange) {
        return skip(
            "the FMU offers no Model Exchange, where a value follows from states and inputs at once",
        );
    }
    let d = subject.description;
    let states = d.states();
    let mut session = subject.running(Use::EXCHANGE)?;
    session.advance(2)?;
    for unknown in &d.structure {
        let Some(listed) = &unknown.dependencies else { continue };
        if !["Output", "ContinuousStateDerivative", "EventIndicator"]
            .contains(&unknown.list.as_str())
        {
            continue;
        }
        let Some(v) = d.variable_of(unknown) else { continue };
        if v.c_type != CType::Float64 || !v.is_continuous() || !v.is_exchanged() {
            continue;
        }
        for known in d.variables.iter().filter(|k| k.c_type == CType::Float64 && k.is_continuous())
        {
            let is_known = known.causality == Causality::Input || states.contains(&known.reference);
            // An output that is also a state depends on itself.
            if !is_known || listed.contains(&known.reference) || known.reference == v.reference {
                continue;
            }
            let base = real(&session.read(known)?);
            let before = real(&session.read(v)?);
            for element in 0..base.len() {
                let by = 1e-2 * base[element].abs().max(known.nominal());
                subject.announce(format!("moving {} and reading {}", known.name, v.name));
                let after = unknown_at_displacement(&mut session, v, known, &base, element, by)?;
                if after.iter().zip(&before).any(|(a, b)| has_changed(*a, *b)) {
                    findings.at(format!("line {}, {}, {}", unknown.line, unknown.list, v.name)).add(format!(
                            "the unknown changes with {}, which is not among its dependencies: {before:?} becomes {after:?}",
                            known.name
                        ));
                    break;
                }
            }
        }
    }
    Ok(())
}

pub fn elements(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let uses = subject.plain_uses().into_iter();
    let using = uses
        .into_iter()
        .find(|u| subject.has_capability(u.interface, "providesPerElementDependencies"));
    let Some(using) = using else {
        return skip("providesPerElementDependencies is not declared");
    };
    let d = subject.description;
    let mut session = subject.running(using)?;
    for unknown in d.structure.iter().filter(|u| u.list == "Output") {
        let (Some(reference), Some(listed)) = (unknown.key, &unknown.dependencies) else {
            continue;
        };
        let Some(v) = d.at(reference) else { continue };
        subject.announce(format!("fmi3GetVariableDependencies of {}", v.name));
        for one in session.instance.dependencies(reference)? {
            let length = d.at(one.independent).map(Variable::length);
            if !listed.contains(&one.independent) {
                findings.at(v.place()).add(format!(
                    "the unknown depends on valueReference {}, which is not declared",
                    one.independent
                ));
            } else if one.element > v.length() || length.is_none_or(|n| one.independent_element > n)
            {
                findings
                    .at(v.place())
                    .add(format!("{one:?} names an element that the array does not have"));
            }
        }
    }
    Ok(())
}

//! Rules about events in Model Exchange (FMI 2.0.5, sections 3.1.1 and 3.2.2): the FMU must report every
//! event and every value that it changes.
//!
//! A host may enter event mode at any time. There is no event if no event indicator has changed its sign, no time event
//! is due, and fmi2CompletedIntegratorStep has not requested event mode; then event mode may not change any value. A
//! value that changes nevertheless shows an event that a host would have missed.
//!
//! An FMU may also notice an event in fmi2CompletedIntegratorStep, after the host has passed it, and request event
//! mode. If the event indicators of an FMU never change, this is its only way to report events, and they are up to
//! one integrator step late.

use anyhow::Result;

use super::dependencies::random_session;
use super::description::Variable;
use super::findings::Findings;
use super::under_test::{FmuUnderTest, Interface, Observed, STEPS, Session, skip};

/// Number of initial points from which the FMU is simulated. The first point has the declared start values, all further
/// points have parameters drawn at random.
const STARTS: u64 = 12;
/// Relative change of a value in event mode below which the change counts as rounding and not as a missed event.
const ROUNDING: f64 = 1e-9;
/// If the time to the next time event is below this fraction of the step, the event counts as due.
const NEARLY_DUE: f64 = 1e-6;

pub fn missed(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    fmu.exchanging()?;
    let (mut vary, mut step_event) = (false, None);
    for start in 0..STARTS {
        let mut session = random_session(fmu, Interface::ModelExchange, start)?;
        // A start is skipped if the FMU refuses its parameters or cannot simulate with them.
        if session.initialise().is_err() || session.is_ended() {
            continue;
        }
        let missed = missed_event(&mut session, &mut vary);
        step_event = step_event.or(session.notes.step_event.clone());
        if let Ok(Some((time, name, change))) = missed {
            findings.at(format!("event mode at t = {time:?} s, start {start}")).add(format!(
                "{name} goes from {change}: an event that the FMU has not reported to the host (allowed: an \
                     event indicator changes its sign, nextEventTime is reached, or \
                     fmi2CompletedIntegratorStep sets enterEventMode)"
            ));
            return Ok(());
        }
    }
    if let (Some((time, name, change)), false) = (step_event, vary) {
        findings.at("fmi2GetEventIndicators").add(format!(
                "none of the event indicators ever changes, but at t = {time:?} s {name} goes from {change}: \
                 fmi2CompletedIntegratorStep asks for this event only after it has passed (allowed: an indicator that changes \
                 its sign, so that the host finds the time)"
            ));
    }
    Ok(())
}

/// Simulates, enters event mode after each step, and returns the first value that changes in event mode although
/// no event was due: time, name of the variable, and both values as text. Sets `vary` to true if an event
/// indicator changes its value.
fn missed_event<'f>(
    session: &mut Session<'f>,
    vary: &mut bool,
) -> Result<Option<(f64, &'f str, String)>> {
    let fmu = session.fmu;
    let indicators = session.indicators()?;
    // A model without event indicators has no state events.
    *vary |= indicators.is_empty();
    for _ in 0..2 * STEPS {
        // All inputs jump at the beginning of each step, which is an event.
        session.instance.enter_event_mode()?;
        session.stimulate()?;
        session.leave_event()?;
        if session.is_ended() {
            break;
        }
        session.make_step(session.step)?;
        if session.is_ended() {
            break;
        }
        *vary |= session.indicators()? != indicators;
        let near = NEARLY_DUE * session.step;
        if session.next_event.is_some_and(|next| next - session.time < near) {
            continue;
        }
        let before = Observed::read(session)?;
        fmu.announce(format!("entering event mode at t = {:?} s, without an event", session.time));
        session.event()?;
        if session.is_ended() {
            break;
        }
        let after = Observed::read(session)?;
        let Some((name, change)) = before.change(&after, fmu) else { continue };
        // A variable that changes in every event mode is a counter of events; its change is not a missed event.
        session.event()?;
        if !session.is_ended() && after.change(&Observed::read(session)?, fmu).is_none() {
            return Ok(Some((session.time, name, change)));
        }
    }
    Ok(None)
}

pub fn values_changed(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    fmu.exchanging()?;
    if fmu.states().is_empty() {
        return skip("the FMU has no continuous states");
    }
    for start in 0..STARTS {
        let mut session = random_session(fmu, Interface::ModelExchange, start)?;
        if session.initialise().is_err() {
            continue;
        }
        // `exchange.run` reports failures in these steps.
        let _ = session.advance(2 * STEPS);
        if let Some((time, n, before, after)) = session.notes.hidden_jump {
            findings.at(format!("the event at t = {time:?} s, start {start}")).add(format!(
                    "{} goes from {before:?} to {after:?}, and valuesOfContinuousStatesChanged of \
                     fmi2NewDiscreteStates is false (allowed: true, or the host goes on from its own \
                     states)",
                    fmu.states()[n].1.name
                ));
            return Ok(());
        }
    }
    Ok(())
}

pub fn nominals(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut session = fmu.exchanging()?;
    let states = fmu.states();
    let declared = |v: &Variable| v.typed.number("nominal").is_some();
    if !states.iter().any(|(_, state)| declared(state)) {
        return skip("no continuous state has a nominal");
    }
    if session.notes.nominals_changed {
        return skip(
            "the FMU has changed its nominals during the run (nominalsOfContinuousStatesChanged), so that they cannot be compared with modelDescription.xml",
        );
    }
    fmu.announce("fmi2GetNominalsOfContinuousStates");
    for ((_, state), given) in states.iter().zip(session.nominals()?) {
        let written = state.nominal();
        if declared(state) && (given - written).abs() > ROUNDING * written {
            findings.at(state.place()).add(format!(
                "nominal={written:?} in modelDescription.xml, but \
                     fmi2GetNominalsOfContinuousStates gives {given:?} (required: equal values, \
                     because hosts scale errors by one of the two)"
            ));
        }
    }
    Ok(())
}

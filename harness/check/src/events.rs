//! Events in Model Exchange (FMI 2.0.5, sections 3.1.1 and 3.2.2): the FMU must report each one and what it changes.
//!
//! A host may enter event mode whenever it likes. Where no event indicator has changed its sign, no
//! time event is due and fmi2CompletedIntegratorStep has not asked for it, there is no event, and
//! nothing changes. What changes nevertheless is an event that a host would have missed. An FMU may notice in
//! fmi2CompletedIntegratorStep that the host has passed an event, and ask for event mode. If its indicators never change, this is
//! its only way, and events come up to one step of the host late.

use anyhow::Result;

use super::dependencies::moved;
use super::description::Variable;
use super::exchange::continuous;
use super::findings::Findings;
use super::under_test::{FmuUnderTest, Interface, Life, STEPS, Session, Sight};

/// Starts from which runs are made: the first as declared, then with other parameters.
const STARTS: u64 = 12;
/// A share of a value below which a change is rounding.
const ROUNDING: f64 = 1e-9;
/// An event in time that is nearer than this share of a step may be due.
const NEARLY_DUE: f64 = 1e-6;

/// `exchange.events`
pub fn told(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    if continuous(fmu, findings)?.is_none() {
        return Ok(());
    }
    let (mut vary, mut step_event) = (false, None);
    for start in 0..STARTS {
        let mut session = moved(fmu, Interface::ModelExchange, start)?;
        // Parameters that do not go together, or run into trouble, are another start's luck.
        if session.initialise().is_err() || session.is_ended() {
            continue;
        }
        let missed = missed_event(&mut session, &mut vary);
        step_event = step_event.or(session.step_event());
        if let Ok(Some((time, name, change))) = missed {
            findings.add(
                format!("event mode at t = {time:?} s, start {start}"),
                format!(
                    "{name} goes from {change}: an event of which the host is not told (allowed: an \
                     event indicator changes its sign, nextEventTime is reached, or \
                     fmi2CompletedIntegratorStep sets enterEventMode)"
                ),
            );
            return Ok(());
        }
    }
    if let (Some((time, name, change)), false) = (step_event, vary) {
        findings.add(
            "fmi2GetEventIndicators",
            format!(
                "none of the event indicators ever changes, but at t = {time:?} s {name} goes from {change}: \
                 fmi2CompletedIntegratorStep asks for this event only after it has passed (allowed: an indicator that changes \
                 its sign, so that the host finds the time)"
            ),
        );
    }
    Ok(())
}

/// Runs the FMU, enters event mode after each step, and returns the first change there: time, variable and both values. `vary`
/// becomes true if an event indicator changes its value.
fn missed_event<'f>(
    session: &mut Session<'f>,
    vary: &mut bool,
) -> Result<Option<(f64, &'f str, String)>> {
    let fmu = session.fmu;
    let indicators = session.read_indicators()?;
    // a model without any has no such events
    *vary |= indicators.is_empty();
    for _ in 0..2 * STEPS {
        // inputs jump, which is an event
        session.instance.enter_event_mode()?;
        session.stimulate()?;
        session.leave_event()?;
        if session.is_ended() {
            break;
        }
        session.go(session.step)?;
        if session.is_ended() {
            break;
        }
        *vary |= session.read_indicators()? != indicators;
        let near = NEARLY_DUE * session.step;
        if session.next_event().is_some_and(|next| next - session.time < near) {
            continue;
        }
        let before = Sight::of(session)?;
        fmu.doing(format!("entering event mode at t = {:?} s, without an event", session.time));
        session.event()?;
        if session.is_ended() {
            break;
        }
        let after = Sight::of(session)?;
        let Some((name, change)) = before.change(&after, fmu) else { continue };
        // what changes whenever there is an event counts them
        session.event()?;
        if !session.is_ended() && after.change(&Sight::of(session)?, fmu).is_none() {
            return Ok(Some((session.time, name, change)));
        }
    }
    Ok(None)
}

/// `exchange.values_changed`
pub fn values_changed(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    if continuous(fmu, findings)?.is_none() {
        return Ok(());
    }
    if fmu.states().is_empty() {
        findings.skip("it has no continuous states");
        return Ok(());
    }
    for start in 0..STARTS {
        let mut session = moved(fmu, Interface::ModelExchange, start)?;
        if session.initialise().is_err() {
            continue;
        }
        // how far it comes is the business of exchange.run
        let _ = session.advance(2 * STEPS);
        if let Some((time, n, before, after)) = session.hidden_jump() {
            findings.add(
                format!("the event at t = {time:?} s, start {start}"),
                format!(
                    "{} goes from {before:?} to {after:?}, and valuesOfContinuousStatesChanged of \
                     fmi2NewDiscreteStates is false (allowed: true, or the host goes on from its own \
                     states)",
                    fmu.states()[n].1.name
                ),
            );
            return Ok(());
        }
    }
    Ok(())
}

/// `exchange.nominals`
pub fn nominals(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let Some(mut session) = continuous(fmu, findings)? else { return Ok(()) };
    let states = fmu.states();
    let declared = |v: &Variable| v.typed.number("nominal").is_some();
    if !states.iter().any(|(_, state)| declared(state)) {
        findings.skip("no continuous state has a nominal");
        return Ok(());
    }
    if session.nominals_changed() {
        findings.skip("nominalsOfContinuousStatesChanged: they are others than at the start");
        return Ok(());
    }
    let mut nominals = vec![f64::NAN; states.len()];
    fmu.doing("fmi2GetNominalsOfContinuousStates");
    session.instance.nominals(&mut nominals)?;
    for ((_, state), given) in states.iter().zip(nominals) {
        let written = state.nominal();
        if declared(state) && (given - written).abs() > ROUNDING * written {
            findings.add(
                state.place(),
                format!(
                    "nominal={written:?} in modelDescription.xml, but \
                     fmi2GetNominalsOfContinuousStates gives {given:?} (allowed: the same: hosts \
                     weigh errors by the one or the other)"
                ),
            );
        }
    }
    Ok(())
}

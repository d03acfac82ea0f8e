//! Rules about tunable parameters (FMI 2.0.5, sections 2.2.7, 3.2.3 and 4.2.4). Hosts may set tunable parameters
//! between steps, and in Model Exchange in event mode.

use anyhow::Result;

use super::description::Variable;
use super::findings::Findings;
use super::under_test::{FmuUnderTest, Interface, Readings, STEPS, Session, start_value};
use super::values::other_value;
use host::causality::{Causality, Variability};
use host::description::Value;
use host::fmi2::Called;

fn tunables(fmu: &FmuUnderTest) -> impl Iterator<Item = (&Variable, Value)> {
    let all = fmu.variables().iter();
    let all = all
        .filter(|v| v.causality == Causality::Parameter && v.variability == Variability::Tunable);
    all.filter_map(|v| Some((v, start_value(v)?)))
}

/// Sets `v` after initialisation in a mode where the standard allows it. The outer error means that the mode
/// cannot be entered or left; the inner result is the FMU's answer to setting the value.
fn set_between_steps(session: &mut Session, v: &Variable, value: &Value) -> Result<Called> {
    if session.using.interface == Interface::CoSimulation {
        return Ok(session.set(v, value));
    }
    session.instance.enter_event_mode()?;
    let answer = session.set(v, value);
    if answer.is_ok() {
        session.leave_event()?;
    }
    Ok(answer)
}

/// Returns true if the FMU accepts `value` for `v` before initialisation.
fn is_allowed(
    fmu: &FmuUnderTest,
    interface: Interface,
    v: &Variable,
    value: &Value,
) -> Result<bool> {
    let mut session = fmu.session(interface)?;
    Ok(session.set(v, value).is_ok() && session.initialise().is_ok())
}

pub fn can_be_set(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut any = false;
    for interface in fmu.interfaces() {
        for (v, start) in tunables(fmu) {
            any = true;
            let other = other_value(fmu, v, &start);
            for value in [Some(start.clone()), other].into_iter().flatten() {
                let mut session = fmu.running(interface)?;
                session.advance(1)?;
                if session.is_ended() {
                    continue;
                }
                let place = format!(
                    "setting the tunable parameter {} to {value} after a step ({})",
                    v.name, interface
                );
                fmu.announce(&place);
                if let Err(error) = set_between_steps(&mut session, v, &value)? {
                    if value.is_identical(&start) || is_allowed(fmu, interface, v, &value)? {
                        findings.at(place).add(format!("{error} (allowed: fmi2OK)"));
                        break;
                    }
                    continue;
                }
                let read = session.get(v)?;
                if !read.is_identical(&value) {
                    findings.at(place).add(format!(
                        "the parameter is read as {read} afterwards (allowed: {value})"
                    ));
                    break;
                }
            }
        }
    }
    if !any {
        findings.skip("the FMU has no tunable parameters");
    }
    Ok(())
}

/// Simulates a short run in which one parameter is changed before initialisation (`before`), after initialisation
/// (`after`), or not at all, and returns all values at the end. Returns `None` if the FMU refuses the change, because
/// another rule reports this.
fn run(
    fmu: &FmuUnderTest,
    interface: Interface,
    before: Option<(&Variable, &Value)>,
    after: Option<(&Variable, &Value)>,
) -> Result<Option<Readings>> {
    let mut session = fmu.session(interface)?;
    if let Some((v, value)) = before
        && session.set(v, value).is_err()
    {
        return Ok(None);
    }
    if let Err(error) = session.initialise() {
        return if before.is_some() { Ok(None) } else { Err(error) };
    }
    if let Some((v, value)) = after
        && (session.is_ended() || set_between_steps(&mut session, v, value)?.is_err())
    {
        return Ok(None);
    }
    if let Err(error) = session.advance(STEPS) {
        return if before.is_some() || after.is_some() { Ok(None) } else { Err(error) };
    }
    session.readings().map(Some)
}

pub fn acts(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut any = false;
    for interface in fmu.interfaces() {
        let Some(plain) = run(fmu, interface, None, None)? else { continue };
        for (v, start) in tunables(fmu) {
            any = true;
            let Some(value) = other_value(fmu, v, &start) else { continue };
            fmu.chose_values();
            fmu.announce(format!("runs with {} = {value}, set before and after", v.name));
            let change = Some((v, &value));
            let runs = (run(fmu, interface, change, None)?, run(fmu, interface, None, change)?);
            let (Some(before), Some(after)) = runs else { continue };
            // the effect on all variables other than the parameter itself
            let differing = |run: &Readings| {
                let mut all = fmu.variables().iter().zip(run.iter().zip(&plain));
                all.find(|(o, (a, b))| {
                    (o.kind, o.reference) != (v.kind, v.reference) && !a[0].is_identical(&b[0])
                })
                .map(|(o, _)| o.name.as_str())
            };
            let (Some(name), None) = (differing(&before), differing(&after)) else { continue };
            let text = format!(
                "set to {value} before initialisation it changes {name} within {STEPS} steps; set \
                 after initialisation it changes nothing ({interface}) (allowed: a tunable parameter that \
                 acts)"
            );
            findings.at(v.place()).add(text);
        }
    }
    if !any {
        findings.skip("the FMU has no tunable parameters");
    }
    Ok(())
}

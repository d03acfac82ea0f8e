//! Rules of Model Exchange (FMI 2.0.5, section 3.2).

use anyhow::Result;

use super::findings::Findings;
use super::life::expect_refusal;
use super::steps;
use super::under_test::{FmuUnderTest, Interface, STEPS, skip};
use host::description::Value;

pub fn run(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut session = fmu.exchanging()?;
    session.advance(2 * STEPS)?;
    steps::report_not_finite(&mut session, &format!("after {} steps", 2 * STEPS), findings)
}

pub fn event_iteration(fmu: &FmuUnderTest, _: &mut Findings) -> Result<()> {
    // This rule needs only a run that does not end with an error; failures other than an endless
    // iteration are reported by other rules.
    let mut session = fmu.exchanging()?;
    session.advance(2 * STEPS)
}

pub fn next_event_time(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut session = fmu.exchanging()?;
    session.advance(2 * STEPS)?;
    if let Some((time, next)) = session.notes.past_event {
        findings.at(format!("fmi2NewDiscreteStates at t = {time:?} s")).add(format!(
            "nextEventTime is {next:?} (allowed: a later time, if nextEventTimeDefined)"
        ));
    }
    Ok(())
}

pub fn terminate_simulation(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    if !fmu.has(Interface::ModelExchange) {
        return skip("the FMU offers no Model Exchange");
    }
    let mut session = fmu.session(Interface::ModelExchange)?;
    session.initialise()?;
    steps::report_early_end(&mut session, findings)
}

pub fn vectors(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut session = fmu.exchanging()?;
    let (nx, ni) = session.sizes()?;
    for moved in [false, true] {
        if moved {
            session.advance(3)?;
        }
        fmu.announce(format!("the vectors of {nx} states and {ni} event indicators"));
        for (call, values, above_0) in [
            ("fmi2GetContinuousStates", session.states()?, false),
            ("fmi2GetDerivatives", session.derivatives()?, false),
            ("fmi2GetNominalsOfContinuousStates", session.nominals()?, true),
            ("fmi2GetEventIndicators", session.indicators()?, false),
        ] {
            let fits = |x: f64| x.is_finite() && (!above_0 || x > 0.0);
            if let Some(n) = values.iter().position(|x| !fits(*x)) {
                let allowed = if above_0 { "finite, above 0" } else { "finite" };
                findings.at(call).add(format!(
                    "element {} is {} (allowed: {allowed})",
                    n + 1,
                    values[n]
                ));
            }
        }
        if !findings.list.is_empty() {
            return Ok(());
        }
    }
    Ok(())
}

pub fn lengths(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut session = fmu.exchanging()?;
    let (nx, ni) = session.sizes()?;
    let place = |call: &str, n: usize, right: usize| {
        let place = format!("{call} with room for {n} numbers instead of {right}");
        fmu.announce(&place);
        place
    };
    let (mut x, mut z) = (vec![0.0; nx + 1], vec![0.0; ni + 1]);
    let i = &mut session.instance;
    let here = place("fmi2GetContinuousStates", nx + 1, nx);
    expect_refusal(findings, here, i.continuous_states(&mut x));
    let here = place("fmi2GetDerivatives", nx + 1, nx);
    expect_refusal(findings, here, i.derivatives(&mut x));
    let here = place("fmi2GetEventIndicators", ni + 1, ni);
    expect_refusal(findings, here, i.event_indicators(&mut z));
    let here = place("fmi2SetContinuousStates", nx + 1, nx);
    expect_refusal(findings, here, i.set_continuous_states(&x));
    Ok(())
}

pub fn variables(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut session = fmu.exchanging()?;
    let states = fmu.states();
    if states.is_empty() {
        return skip("the FMU has no continuous states");
    }
    session.advance(3)?;
    fmu.announce("fmi2GetContinuousStates and fmi2GetDerivatives");
    let (x, dx) = (session.states()?, session.derivatives()?);
    for (n, (derivative, state)) in states.iter().enumerate() {
        for (v, vector, call) in
            [(state, x[n], "fmi2GetContinuousStates"), (derivative, dx[n], "fmi2GetDerivatives")]
        {
            let read = session.get(v)?;
            if !read.is_identical(&Value::Real(vector)) {
                findings.at(v.place()).add(format!(
                    "the variable is {read}, but {call} returns {vector:?} as element {} of the vector (required: equal values)",
                    n + 1
                ));
            }
        }
    }
    Ok(())
}

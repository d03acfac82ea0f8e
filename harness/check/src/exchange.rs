//! Rules of Model Exchange (FMI 2.0.5, section 3.2).

use anyhow::Result;

use super::findings::Findings;
use super::life::expect_refusal;
use super::loaded::skip;
use super::under_test::{FmuUnderTest, Interface, Life, Reading, STEPS, Session, UnderTest};

/// Returns an instance in continuous-time mode, or skips the rule if the FMU has no Model Exchange.
pub fn continuous(fmu: &FmuUnderTest) -> Result<Session<'_>> {
    if !fmu.interfaces().contains(&Interface::ModelExchange) {
        return skip("the FMU offers no Model Exchange");
    }
    fmu.running(Interface::ModelExchange)
}

pub fn run(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut session = continuous(fmu)?;
    session.advance(2 * STEPS)?;
    let readings = session.readings()?;
    for (v, reading) in fmu.variables().iter().zip(readings) {
        if let Reading::Real(x) = reading
            && !x.is_finite()
        {
            findings.at(v.place()).add(format!("it is {x} after {} steps", 2 * STEPS));
        }
    }
    Ok(())
}

pub fn event_iteration(fmu: &FmuUnderTest, _: &mut Findings) -> Result<()> {
    // Other failures are reported by other rules.
    let mut session = continuous(fmu)?;
    session.advance(2 * STEPS)
}

pub fn next_event_time(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut session = continuous(fmu)?;
    session.advance(2 * STEPS)?;
    if let Some((time, next)) = session.past_event {
        findings.at(format!("fmi2NewDiscreteStates at t = {time:?} s")).add(format!(
            "nextEventTime is {next:?} (allowed: a later time, if nextEventTimeDefined)"
        ));
    }
    Ok(())
}

pub fn terminate_simulation(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    if !fmu.interfaces().contains(&Interface::ModelExchange) {
        return skip("the FMU offers no Model Exchange");
    }
    let mut session = fmu.session(Interface::ModelExchange)?;
    session.initialise()?;
    super::steps::report_early_end(&mut session, findings)
}

pub fn vectors(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut session = continuous(fmu)?;
    let (nx, ni) = (fmu.states().len(), session.indicators());
    for moved in [false, true] {
        if moved {
            session.advance(3)?;
        }
        let (mut x, mut dx, mut nominals, mut z) =
            (vec![f64::NAN; nx], vec![f64::NAN; nx], vec![f64::NAN; nx], vec![f64::NAN; ni]);
        fmu.announce(format!("the vectors of {nx} states and {ni} event indicators"));
        // Hosts do not ask for states or indicators if there are none.
        if nx > 0 {
            session.instance.continuous_states(&mut x)?;
            session.instance.derivatives(&mut dx)?;
            session.instance.nominals(&mut nominals)?;
        }
        if ni > 0 {
            session.instance.event_indicators(&mut z)?;
        }
        for (call, values, above_0) in [
            ("fmi2GetContinuousStates", x, false),
            ("fmi2GetDerivatives", dx, false),
            ("fmi2GetNominalsOfContinuousStates", nominals, true),
            ("fmi2GetEventIndicators", z, false),
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
    let mut session = continuous(fmu)?;
    let (nx, ni) = (fmu.states().len(), session.indicators());
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
    let mut session = continuous(fmu)?;
    let states = fmu.states();
    if states.is_empty() {
        return skip("the FMU has no continuous states");
    }
    session.advance(3)?;
    let (mut x, mut dx) = (vec![0.0; states.len()], vec![0.0; states.len()]);
    fmu.announce("fmi2GetContinuousStates and fmi2GetDerivatives");
    session.instance.continuous_states(&mut x)?;
    session.instance.derivatives(&mut dx)?;
    for (n, (derivative, state)) in states.iter().enumerate() {
        for (v, vector, call) in
            [(state, x[n], "fmi2GetContinuousStates"), (derivative, dx[n], "fmi2GetDerivatives")]
        {
            let read = session.get(v)?;
            if !read.is_identical(&Reading::Real(vector)) {
                findings.at(v.place()).add(format!(
                    "it reads {read}, but {call} gives {vector:?} in place {}",
                    n + 1
                ));
            }
        }
    }
    Ok(())
}

//! Rules about steps of Co-Simulation (FMI 2.0.5, section 4.2).

use anyhow::{Result, anyhow};

use super::dependencies::displaced_value;
use super::description::Variable;
use super::findings::Findings;
use super::life::expect_refusal;
use super::under_test::{FmuUnderTest, Interface, STEPS, Session, Unusable, skip};
use host::causality::Causality;
use host::description::Value;
use host::fmi2::{CallError, Status};

/// Returns an instance for Co-Simulation after three ordinary steps. If these steps fail, other rules report it.
fn after_three_steps(fmu: &FmuUnderTest) -> Result<Session<'_>> {
    let mut session = fmu.stepping()?;
    session.advance(3)?;
    if session.is_ended() {
        let why = "it asks for the end of the simulation in its first steps".into();
        return Err(Unusable { rule: "steps.terminated", why }.into());
    }
    fmu.stepping()
}

pub fn run(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    const LONG: usize = 200;
    let mut session = fmu.stepping()?;
    for _ in 0..LONG {
        if session.is_ended() {
            break;
        }
        let done = session.stimulate().map_err(anyhow::Error::from);
        let Err(error) = done.and_then(|()| session.make_step(session.step)) else { continue };
        let discarded =
            error.downcast_ref::<CallError>().is_some_and(|error| error.status == Status::Discard);
        let allowed = match discarded {
            true => {
                " (allowed: fmi2Discard only with fmi2Terminated, because two hosts repeat the step for ever)"
            }
            false => "",
        };
        findings.at(fmu.last_call()).add(format!("{error}{allowed}"));
        return Ok(());
    }
    let when = format!("after {LONG} steps, which all returned fmi2OK");
    report_not_finite(&mut session, &when, findings)
}

pub fn report_not_finite(session: &mut Session, when: &str, findings: &mut Findings) -> Result<()> {
    for (v, values) in session.fmu.readable().zip(session.readings()?) {
        if let Some(x) = values.iter().map(Value::number).find(|x| v.is_real() && !x.is_finite()) {
            findings.at(v.place()).add(format!("the value is {x} {when}"));
        }
    }
    Ok(())
}

pub fn size(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    for h in [0.0, -0.01, f64::INFINITY, f64::NAN] {
        // After an error the FMU may refuse every call, so that each step size needs a new instance.
        let mut session = after_three_steps(fmu)?;
        session.advance(3)?;
        let before = session.readings()?;
        let place = format!("fmi2DoStep with communicationStepSize = {h:?}");
        let time = session.time;
        let answer = if h.is_finite() {
            fmu.announce(&place);
            session.instance.do_step(time, h)
        } else {
            fmu.with_undefined_effect(&place, findings, || session.instance.do_step(time, h))
        };
        let is_refused = answer.is_err();
        expect_refusal(findings, place.clone(), answer);
        if is_refused
            && let Ok(after) = session.readings()
            && let Some(text) = session.difference(&after, &before)
        {
            findings.at(&place).add(format!("the call is refused and yet changes the FMU: {text}"));
        }
    }
    Ok(())
}

pub fn point(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    for off in [2.0, -1.0, f64::NAN] {
        let mut session = after_three_steps(fmu)?;
        session.advance(3)?;
        let wrong = session.time + off * session.step;
        let place = format!(
            "fmi2DoStep from {wrong:?} s, although the FMU has reached {:?} s",
            session.time
        );
        let step = session.step;
        let answer =
            fmu.with_undefined_effect(&place, findings, || session.instance.do_step(wrong, step));
        expect_refusal(findings, place, answer);
    }
    Ok(())
}

pub fn wobble(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    const LONG: usize = 200;
    let mut session = after_three_steps(fmu)?;
    let (start, h) = (session.time, session.step);
    for n in 0..LONG {
        // n·h and t + h differ by rounding; some hosts pass the first value and some the second.
        let product = start + n as f64 * h;
        let wobbled = match n % 3 {
            0 => product,
            1 => product.next_up(),
            _ => product.next_down(),
        };
        session.stimulate()?;
        fmu.announce(format!(
            "fmi2DoStep from {wobbled:?} s, which is {product:?} s with a rounding error, by {h:?} s"
        ));
        if let Err(error) = session.instance.do_step(wobbled, h) {
            if session.has_terminated(&error) {
                break;
            }
            findings
                .at(fmu.last_call())
                .add(format!("{error} (allowed: fmi2OK for times within a few ulps)"));
            return Ok(());
        }
    }
    Ok(())
}

pub fn start_time(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    for interface in fmu.interfaces() {
        // If this ordinary run fails, another rule reports it, and this rule ends.
        fmu.running(interface)?.advance(STEPS)?;
        for start in [fmu.experiment().start + 1000.0, fmu.experiment().start - 3.0] {
            let mut session = fmu.session(interface)?;
            let place = format!("start time {start} s ({interface})");
            if let Err(error) = session.initialise_at(start, None, fmu.experiment().tolerance) {
                findings.at(place).add(error.to_string());
            } else if let Err(error) = session.advance(STEPS) {
                findings.at(place).add(error.to_string());
            }
        }
    }
    Ok(())
}

pub fn stop_time(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    after_three_steps(fmu)?;
    let experiment = fmu.experiment();
    let stop = experiment.start + STEPS as f64 * experiment.step;
    let mut session = fmu.session(Interface::CoSimulation)?;
    session.initialise_at(experiment.start, Some(stop), experiment.tolerance)?;
    // The sum of the steps differs from the stop time by rounding.
    if let Err(error) = session.advance(STEPS) {
        findings.at(fmu.last_call()).add(format!(
            "{error} (the stop time is {stop:?} s; required: the FMU accepts rounding errors)"
        ));
        return Ok(());
    }
    let place = format!("fmi2DoStep past the stop time {stop} s");
    fmu.announce(&place);
    let answer = session.instance.do_step(session.time, session.step);
    expect_refusal(findings, place, answer);
    Ok(())
}

pub fn tolerance(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let start = fmu.experiment().start;
    let mut fails = Vec::new();
    for interface in fmu.interfaces() {
        for tolerance in [None, Some(1e-4), Some(1e-6)] {
            let mut session = fmu.session(interface)?;
            let done =
                session.initialise_at(start, None, tolerance).and_then(|()| session.advance(3));
            if let Err(error) = done {
                let given = tolerance.map_or("none".into(), |x: f64| x.to_string());
                fails.push((interface, format!("tolerance {given} ({interface})"), error));
            }
        }
    }
    // If no tolerance works, the reason is not the tolerance, and another rule reports it.
    for interface in fmu.interfaces() {
        let of_this = fails.iter().filter(|(i, ..)| *i == interface);
        if of_this.clone().count() < 3 {
            for (_, place, error) in of_this {
                findings.at(place).add(error.to_string());
            }
        }
    }
    Ok(())
}

pub fn cut(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    /// Allowed difference of two runs, divided by the tolerance of the FMU's solver. It is above 1 because the
    /// tolerance applies to one step, and the errors of many steps add up.
    const SLACK: f64 = 1e3;
    after_three_steps(fmu)?;
    fmu.require(Interface::CoSimulation, STEP_SIZES)?;
    let Some(tolerance) = fmu.experiment().tolerance else {
        return skip("no tolerance is suggested");
    };
    // inputs that change at the same times in both runs, and are constant during each long step
    let run = |parts: usize| -> Result<(Vec<f64>, Vec<f64>)> {
        let mut session = fmu.running(Interface::CoSimulation)?;
        let mut scale = vec![0.0f64; fmu.outputs.len()];
        let mut last = vec![0.0; fmu.outputs.len()];
        let start = session.time;
        for step in 0..STEPS {
            session.count = step;
            session.stimulate()?;
            for part in 1..=parts {
                let end = start + session.step * (step as f64 + part as f64 / parts as f64);
                session.make_step(end - session.time)?;
                session.time = end;
            }
            for (n, v) in fmu.outputs.iter().enumerate() {
                last[n] = session.real(v)?;
                scale[n] = scale[n].max(last[n].abs());
            }
        }
        Ok((last, scale))
    };
    let (whole, scale) = run(1)?;
    for parts in [2, 5] {
        let (cut, _) = run(parts)?;
        for (n, v) in fmu.outputs.iter().enumerate() {
            let allowed = SLACK * tolerance * scale[n].max(1e-3 * v.nominal());
            let off = (whole[n] - cut[n]).abs();
            if off > allowed {
                findings.at(v.place()).add(format!(
                        "{} after {STEPS} steps, {} after {} shorter ones: {off:.1e} off (allowed: {allowed:.1e})",
                        whole[n], cut[n], parts * STEPS
                    ));
            }
        }
        if !findings.list.is_empty() {
            break;
        }
    }
    Ok(())
}

pub fn lag(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    /// Relative change of a value with the step size above which the value depends on the step size. A smaller
    /// change counts as rounding.
    const SEEN: f64 = 1e-6;
    /// Number of steps after which an FMU that delays constant inputs by one or two steps shows their effect.
    const SETTLED: usize = 4;
    /// Largest difference between two values that count as equal, relative to the largest difference between the
    /// simulations with long and with short steps.
    const SAME: f64 = 0.02;
    let usual = after_three_steps(fmu)?.step;
    let states: Vec<&Variable> = fmu.states().into_iter().map(|(_, state)| state).collect();
    let is_state = |v: &Variable| states.iter().any(|state| state.key == v.key);
    let is_watched = |v: &&Variable| {
        let shows = matches!(v.causality, Causality::Output | Causality::Independent);
        v.is_continuous() && (shows || is_state(v))
    };
    let watched: Vec<&Variable> = fmu.variables().iter().filter(is_watched).collect();
    // Inputs are constant, because delaying its inputs by a step may be the purpose of an FMU.
    let run = |step: f64, count: usize| -> Result<Vec<Vec<f64>>> {
        let mut session = fmu.running(Interface::CoSimulation)?;
        session.stimulate()?;
        let (start, mut all) = (session.time, Vec::new());
        for n in 1..=count {
            let end = start + n as f64 * step;
            session.make_step(end - session.time)?;
            if session.is_ended() {
                break;
            }
            session.time = end;
            all.push(watched.iter().map(|v| session.real(v)).collect::<Result<_>>()?);
        }
        Ok(all)
    };
    // The FMU may accept only its own step size or multiples of it.
    let pair = |step: f64, count: usize| -> Result<_> {
        Ok((run(step, count)?, run(step / 2.0, 2 * count)?, step))
    };
    let (long, short, step) = match pair(usual, STEPS).or_else(|_| pair(2.0 * usual, STEPS / 2)) {
        Ok(runs) => runs,
        Err(error) => match error.downcast::<Unusable>() {
            Ok(unusable) => return Err(unusable.into()),
            Err(_) => {
                return skip("the FMU refuses steps of half and of twice the usual size");
            }
        },
    };
    let points = long.len().min(short.len() / 2);
    for (i, v) in watched.iter().enumerate() {
        // short[2k + 1] is the value at the time of long[k]; short[2k] is the value half a long step earlier.
        let off = |k: usize| (long[k][i] - short[2 * k + 1][i]).abs();
        let largest = |of: &dyn Fn(usize) -> f64| (SETTLED..points).map(of).fold(0.0, f64::max);
        let size = largest(&|k| long[k][i].abs()).max(1e-3 * v.nominal());
        let (apart, missed) = (largest(&off), largest(&|k| (long[k][i] - short[2 * k][i]).abs()));
        // Another rule reports NaN.
        let lags = points > 2 * SETTLED && apart > SEEN * size && missed <= SAME * apart;
        if let Some(k) = (SETTLED..points).find(|k| off(*k) == apart).filter(|_| lags) {
            let time = fmu.experiment().start + (k + 1) as f64 * step;
            let text = format!(
                "{} after the step of {step:?} s to {time:?} s; with steps half as long {} then, and {} at {:?} s already: \
                 it lags by one step (allowed: the value at the end of the step)",
                long[k][i],
                short[2 * k + 1][i],
                short[2 * k][i],
                time - 0.5 * step
            );
            match is_state(v) || v.causality == Causality::Independent {
                true => findings.at(v.place()).fail(text),
                false => findings.at(v.place()).add(text),
            }
        }
    }
    Ok(())
}

pub fn inputs(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut session = after_three_steps(fmu)?;
    let inputs: Vec<_> =
        fmu.variables().iter().filter(|v| v.causality == Causality::Input && v.is_real()).collect();
    if inputs.is_empty() {
        return skip("the FMU has no Real inputs");
    }
    for v in &inputs {
        let mut session = fmu.running(Interface::CoSimulation)?;
        let place = format!("{} = NaN, then a step", v.name);
        let refused = fmu.with_undefined_effect(&place, findings, || {
            session.set(v, &Value::Real(f64::NAN)).is_err()
                || session.make_step(session.step).is_err()
        });
        if !refused {
            findings.at(place).add("fmi2OK (allowed: fmi2Error and a message)");
        }
    }
    let can = fmu.has_capability(Interface::CoSimulation, "canInterpolateInputs");
    for v in inputs.iter().filter(|v| can && v.is_continuous()) {
        let place = format!("fmi2SetRealInputDerivatives of {}", v.name);
        fmu.announce(&place);
        let set = session.instance.set_real_input_derivatives(&[v.reference], &[1], &[0.0]);
        if let Err(error) = set {
            findings.at(place).add(format!("{error}, but canInterpolateInputs is declared"));
        }
    }
    Ok(())
}

pub fn input_derivatives(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    /// Change of an input within a step, relative to its magnitude, by which the rule tests whether
    /// the FMU uses the input's slope.
    const SHARE: f64 = 0.3;
    /// Limit below which the rule reports that the FMU ignores the slope of an input: the difference between the
    /// effects of a held input and of an input with a slope, divided by the effect of the held input.
    const IGNORED: f64 = 0.05;
    after_three_steps(fmu)?;
    fmu.require(Interface::CoSimulation, "canInterpolateInputs")?;
    let computed = |v: &&Variable| v.is_continuous() && !v.is_set_by_hosts();
    let computed: Vec<&Variable> = fmu.variables().iter().filter(computed).collect();
    let mut any = false;
    // It is enough that one input has an effect, because one input may be the derivative of another input, which
    // then needs no slope.
    let (mut acts, mut ignored) = (false, Vec::new());
    for &input in &fmu.inputs {
        let running = || -> Result<(Session, Value)> {
            let mut session = fmu.running(Interface::CoSimulation)?;
            session.advance(3)?;
            let now = session.read(input)?.remove(0);
            Ok((session, now))
        };
        let (_, now) = running()?;
        let (Value::Real(here), Some(Value::Real(there))) =
            (&now, displaced_value(fmu, input, &now, SHARE))
        else {
            continue;
        };
        any = true;
        // Returns the values after a step, with the input held at a value, or with a slope from this value. The last
        // value is the input itself.
        let end = |value: f64, slope: Option<f64>| -> Result<Vec<f64>> {
            let (mut session, _) = running()?;
            fmu.announce(format!("a step with {} = {value:?}, its slope {slope:?}", input.name));
            session.set(input, &Value::Real(value))?;
            if let Some(slope) = slope {
                let reference = [input.reference];
                session.instance.set_real_input_derivatives(&reference, &[1], &[slope])?;
            }
            session.make_step(session.step)?;
            computed.iter().chain([&input]).map(|v| session.real(v)).collect()
        };
        let step = fmu.session(Interface::CoSimulation)?.step;
        let held = end(*here, None)?;
        let on_average = end(0.5 * (here + there), None)?;
        let on_slope = end(*here, Some((there - here) / step))?;
        // The last value is the input: if it differs, the FMU changes the input itself. Other variables may change too
        // little to be seen.
        if on_slope.last() != held.last() {
            acts = true;
            continue;
        }
        // Returns the variables that the input visibly changes within a step, with the fraction of the change
        // that the slope causes.
        let followed = |n: usize| {
            let (whole, part) = (on_average[n] - held[n], on_slope[n] - held[n]);
            let size = held[n].abs().max(1e-3 * computed[n].nominal());
            (whole.abs() > 1e-9 * size).then(|| (computed[n], part / whole))
        };
        let shares: Vec<_> = (0..computed.len()).filter_map(followed).collect();
        let Some((first, _)) = shares.first() else { continue };
        match shares.iter().all(|(_, share)| share.abs() < IGNORED) {
            true => ignored.push((input, *first)),
            false => acts = true,
        }
    }
    for (input, first) in ignored.into_iter().filter(|_| !acts) {
        findings.at(format!("fmi2SetRealInputDerivatives of {}", input.name)).add(format!(
            "fmi2OK, but {} and the other variables that depend on this input within a step do not follow its \
                 slope (allowed: a derivative that acts, since canInterpolateInputs is declared)",
            first.name
        ));
    }
    if !any {
        findings.skip("the FMU has no continuous inputs that can be moved");
    }
    Ok(())
}

pub fn output_derivatives(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut session = after_three_steps(fmu)?;
    let interface = fmu.description.interface("CoSimulation");
    let order = interface.and_then(|i| i.number("maxOutputDerivativeOrder")).unwrap_or(0.0);
    if order < 1.0 {
        return skip("maxOutputDerivativeOrder is 0");
    }
    let outputs = &fmu.outputs;
    let references: Vec<u32> = outputs.iter().map(|v| v.reference).collect();
    session.advance(STEPS)?;
    let mut declared = vec![f64::NAN; outputs.len()];
    fmu.announce("fmi2GetRealOutputDerivatives of every output");
    session.instance.get_real_output_derivatives(
        &references,
        &vec![1; outputs.len()],
        &mut declared,
    )?;
    if !fmu.has_capability(Interface::CoSimulation, STEP_SIZES) {
        return Ok(());
    }
    // Differences over two successive short steps with held inputs. If they disagree, the output is not smooth.
    let h = session.step * 1e-3;
    let mut points = Vec::new();
    for n in 0..3 {
        let mut values = vec![0.0; outputs.len()];
        session.instance.get_real(&references, &mut values)?;
        points.push(values);
        if n < 2 {
            session.make_step(h)?;
        }
    }
    for (n, v) in outputs.iter().enumerate() {
        let (first, second) =
            ((points[1][n] - points[0][n]) / h, (points[2][n] - points[1][n]) / h);
        let at_start = 1.5 * first - 0.5 * second;
        let smooth = (first - second).abs() <= 0.1 * first.abs().max(second.abs());
        // the tolerance is one per cent of the value, plus the rounding error of the difference
        let rounding = 1e-9 * points[0][n].abs().max(1e-3 * v.nominal()) / h;
        let off = (declared[n] - at_start).abs();
        if declared[n].is_nan() || (smooth && off > 1e-2 * at_start.abs() + rounding) {
            let text = format!(
                "the derivative is given as {}, but the output changes by {at_start} per s",
                declared[n]
            );
            match declared[n] * at_start < 0.0 && at_start.abs() > rounding {
                true => findings.at(v.place()).fail(format!("{text}: the sign is wrong")),
                false => findings.at(v.place()).add(text),
            }
        }
    }
    Ok(())
}

const STEP_SIZES: &str = "canHandleVariableCommunicationStepSize";

pub fn small(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    /// Step sizes, s, with which the rule simulates to see whether the FMU also works with steps
    /// much shorter than usual.
    const SMALL: [f64; 2] = [4e-4, 1e-5];
    const MOST: f64 = 5000.0;
    let usual = after_three_steps(fmu)?.step;
    fmu.require(Interface::CoSimulation, STEP_SIZES)?;
    let experiment = fmu.experiment();
    let continuous = |v: &&Variable| v.is_continuous() && !v.is_set_by_hosts();
    let all: Vec<&Variable> = fmu.variables().iter().filter(continuous).collect();
    // Values before and after `count` steps of `h` with held inputs, or the FMU's message. `None` if the FMU ends the
    // simulation.
    type Ends = Option<Result<(Vec<f64>, Vec<f64>)>>;
    let run = |h: f64, count: usize| -> Result<Ends> {
        let mut session = fmu.running(Interface::CoSimulation)?;
        session.advance(3)?;
        session.stimulate()?;
        let read = |session: &mut Session| -> Result<Vec<f64>> {
            all.iter().map(|v| session.real(v)).collect()
        };
        let before = read(&mut session)?;
        let start = session.time;
        for n in 1..=count {
            let end = start + n as f64 * h;
            if let Err(error) = session.make_step(end - session.time) {
                return Ok(Some(Err(anyhow!("step {n} of {h:.1e} s: {error}"))));
            }
            if session.is_ended() {
                return Ok(None);
            }
            session.time = end;
        }
        Ok(Some(Ok((before, read(&mut session)?))))
    };
    for h in SMALL {
        // The same time span is simulated with usual steps and with small steps.
        let longest = (MOST * h).min(1.0);
        let steps = (longest / usual).floor().clamp(1.0, STEPS as f64);
        let time = (steps * usual).min(longest);
        let h = h.min(time / 20.0);
        let count = (time / h).round();
        let Some(Ok((before, usually))) = run(time / steps, steps as usize)? else { continue };
        let (_, small) = match run(time / count, count as usize)? {
            Some(Ok(ends)) => ends,
            Some(Err(why)) => {
                findings
                    .at("fmi2DoStep")
                    .add(format!("{why} (allowed: fmi2OK, since {STEP_SIZES} is declared)"));
                break;
            }
            None => continue,
        };
        for (n, v) in all.iter().enumerate() {
            let moved = usually[n] - before[n];
            let size = before[n].abs().max(usually[n].abs()).max(1e-3 * v.nominal());
            let visible = 100.0 * experiment.tolerance.unwrap_or(1e-5).max(1e-9) * size;
            // The rule steps.cut compares the accuracy of the two runs.
            let stays = (small[n] - before[n]).abs() <= 0.05 * moved.abs();
            if moved.abs() > visible && stays {
                findings.at(v.place()).add(format!(
                        "the value goes from {} to {} in {steps} steps of {:.1e} s, but to {} in {count} steps of {:.1e} s over \
                         the same time (required: results that do not depend on the step, since {STEP_SIZES} is declared)",
                        before[n],
                        usually[n],
                        time / steps,
                        small[n],
                        time / count
                    ));
            }
        }
        if !findings.list.is_empty() {
            break;
        }
    }
    Ok(())
}

pub fn output_derivative_order(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    after_three_steps(fmu)?;
    let interface = fmu.description.interface("CoSimulation");
    let most = interface.and_then(|i| i.number("maxOutputDerivativeOrder")).unwrap_or(0.0);
    if most < 1.0 {
        return skip("maxOutputDerivativeOrder is 0");
    }
    let outputs = &fmu.outputs;
    for order in 1..=most.min(10.0) as i32 {
        for v in outputs {
            // After an error the FMU may refuse every call, so that each order needs a new instance.
            let mut session = fmu.running(Interface::CoSimulation)?;
            session.advance(3)?;
            let place = format!("derivative {order} of {}", v.name);
            fmu.announce(format!("fmi2GetRealOutputDerivatives, {place}"));
            let mut value = [f64::NAN];
            let answer =
                session.instance.get_real_output_derivatives(&[v.reference], &[order], &mut value);
            let fault = match answer {
                Err(error) => error.to_string(),
                Ok(()) if !value[0].is_finite() => format!("the derivative is {}", value[0]),
                Ok(()) => continue,
            };
            findings
                .at(place)
                .add(format!("{fault} (allowed: fmi2OK up to maxOutputDerivativeOrder={most})"));
        }
    }
    Ok(())
}

pub fn terminated(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut session = fmu.stepping()?;
    report_early_end(&mut session, findings)
}

/// Simulates until the FMU requests the end of the simulation, and reports this if it is before the stop time
/// of the default experiment.
pub fn report_early_end(session: &mut Session, findings: &mut Findings) -> Result<()> {
    let experiment = session.fmu.experiment();
    session.advance(2 * STEPS)?;
    let Some((time, call)) = session.ended else { return Ok(()) };
    let place = format!("{call} at t = {time:?} s");
    // If no stop time is suggested, the model may have reached its natural end.
    let suggested = match experiment.stop {
        Some(stop) if time < stop - 1e-9 * stop.abs() => format!("stopTime={stop}"),
        None => "no stopTime".into(),
        Some(_) => return Ok(()),
    };
    let when = match session.count {
        0 => "when it is initialised".into(),
        1 => "in its first step".into(),
        n => format!("in step {n}"),
    };
    let text = format!(
        "it asks for the end of the simulation {when} (DefaultExperiment has {suggested}; allowed: \
         at that time, or for a reason that a user can see)"
    );
    if session.count <= 1 {
        findings.at(place).fail(text);
    } else if experiment.stop.is_some() {
        findings.at(place).add(text);
    }
    Ok(())
}

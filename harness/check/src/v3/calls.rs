//! Rules of calls for FMI 3.0: loading, life cycle, values, states, logging (FMI 3.0.2, sections 2.2 and
//! 2.3).

use anyhow::Result;

use super::subject::{STEPS, Subject, start_values};
use crate::description::Variable;
use crate::findings::Findings;
use crate::under_test::{Use, skip};
use crate::{life, states};
use host::c_abi::{CallError, Status, foreign_environments};
use host::causality::{Causality, Variability};
use host::description::{CType, Type, Value};
use host::fmi3::Interface;

pub fn token(subject: &Subject, findings: &mut Findings) -> Result<()> {
    for using in subject.plain_uses() {
        let mut with = subject.instantiation(using)?;
        with.token = Some("{another token of another FMU}");
        subject.announce("making an instance with another instantiationToken");
        match subject.instantiate(&with)? {
            Ok(_) => findings.at(subject.last_call()).add("the call returns an instance (allowed: NULL for a token that is not that of modelDescription.xml)"),
            Err(CallError { messages, .. }) if messages.is_empty() => {
                findings.at(subject.last_call()).warn("the call returns no instance and logs no reason (allowed: a message)");
            }
            Err(_) => {}
        }
    }
    Ok(())
}

pub fn callbacks(subject: &Subject, findings: &mut Findings) -> Result<()> {
    for using in subject.plain_uses() {
        let mut with = subject.instantiation(using)?;
        with.logger = false;
        with.intermediate_update = false;
        subject.announce("making an instance without callbacks, and a step");
        if let Err(error) = subject.instantiate(&with)? {
            findings.at(subject.last_call()).add(error.to_string());
            continue;
        }
        // the instance is created with intermediate variables, but without a callback
        // that could receive them
        let mut session = subject.session(using)?;
        session.initialise()?;
        session.advance(2)?;
    }
    Ok(())
}

pub fn deterministic(subject: &Subject, findings: &mut Findings) -> Result<()> {
    life::deterministic(subject, findings)?;
    match findings.list.is_empty() {
        true => life::instances(subject, findings),
        false => Ok(()),
    }
}

pub fn readable(subject: &Subject, findings: &mut Findings) -> Result<()> {
    for using in subject.plain_uses() {
        let mut session = subject.running(using)?;
        for v in subject.readable() {
            subject.announce(format!("reading {}", v.name));
            if let Err(error) = session.elements(v) {
                findings.at(v.place()).add(format!("{using} ({error})"));
            }
        }
    }
    Ok(())
}

pub fn start(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let using = subject.plain_uses()[0];
    let mut session = subject.session(using)?;
    session.enter_initialization()?;
    for v in subject.readable().filter(|v| v.initial.as_deref() == Some("exact")) {
        let Some(starts) = start_values(v) else { continue };
        let values = session.read(v)?;
        let differ = values.iter().zip(&starts).position(|(a, b)| match (a, b) {
            (Value::Real(a), Value::Real(b)) => (a - b).abs() > 1e-12 * b.abs(),
            (a, b) => a != b,
        });
        if let Some(i) = differ {
            findings.at(v.place()).add(format!(
                "the value is {:?} in initialization mode and {:?} in modelDescription.xml",
                values[i], starts[i]
            ));
        }
    }
    Ok(())
}

pub fn set(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let using = subject.plain_uses()[0];
    let wanted =
        |v: &&Variable| v.is_set_by_hosts() && v.causality != Causality::StructuralParameter;
    for v in subject.readable().filter(wanted) {
        let Some(mut values) = start_values(v) else { continue };
        let (min, max) = v.bounds();
        // Each element gets a different value, so that exchanged elements are noticed.
        for (i, value) in values.iter_mut().enumerate() {
            match value {
                Value::Real(x) => {
                    // Float32 represents this value exactly.
                    let size = if *x == 0.0 { v.nominal() } else { x.abs() };
                    let moved = f64::from((*x + size * (i + 1) as f64 / 64.0) as f32);
                    if moved > min && moved < max {
                        *x = moved;
                    }
                }
                Value::Boolean(yes) => *yes = !*yes,
                Value::Integer(n) if v.kind == Type::Integer => {
                    let moved = n.saturating_add(1);
                    if (moved as f64) < max.min(120.0) {
                        *n = moved;
                    }
                }
                Value::Integer(_) => {}
                Value::String(text) => text.push('x'),
            }
        }
        let mut session = subject.session(using)?;
        subject.announce(format!("setting {}", v.name));
        if let Err(error) = session.instance.set_values(v.c_type, v.reference, &values) {
            // A model may refuse a value for reasons of its own, but it must log the reason.
            if error.messages.is_empty() {
                findings.at(v.place()).add(format!("{error} (allowed: a message)"));
            }
            continue;
        }
        // The model may have no solution with such a value.
        if subject.with_crash_reported_by("", || session.enter_initialization()).is_err() {
            continue;
        }
        let read = session.read(v)?;
        if let Some(i) = (0..values.len()).find(|i| read[*i] != values[*i]) {
            findings.at(v.place()).add(format!(
                "element {} was set to {:?} and is then read as {:?}",
                i + 1,
                values[i],
                read[i]
            ));
        }
    }
    Ok(())
}

pub fn type_mismatch(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let mut session = subject.running(subject.plain_uses()[0])?;
    for v in subject.readable() {
        let n = v.length();
        let place = format!("reading {} by the call of another type", v.name);
        let (call, answer) = subject.with_undefined_effect(place, findings, || match v.c_type {
            CType::Float64 => {
                ("fmi3GetInt32", session.instance.get_numbers(&[v.reference], &mut vec![0i32; n]))
            }
            _ => (
                "fmi3GetFloat64",
                session.instance.get_numbers(&[v.reference], &mut vec![0.0f64; n]),
            ),
        });
        if answer.is_ok() {
            findings.at(v.place()).add(format!(
                "{call} of this {} returns fmi3OK (allowed: fmi3Error)",
                v.written.name
            ));
        }
    }
    Ok(())
}

pub fn unknown(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let last = subject.description.variables.iter().map(|v| v.reference).max().unwrap_or(0);
    let Some(unknown) = last.checked_add(1000) else {
        return skip(
            "every value reference belongs to a variable, so that no unknown one can be tried",
        );
    };
    let mut session = subject.running(subject.plain_uses()[0])?;
    subject.announce(format!("fmi3GetFloat64 of valueReference {unknown}, which no variable has"));
    if session.instance.get_numbers(&[unknown], &mut [0.0f64]).is_ok() {
        findings.at(subject.last_call()).add("the call returns fmi3OK (allowed: fmi3Error)");
    }
    Ok(())
}

pub fn counts(subject: &Subject, findings: &mut Findings) -> Result<()> {
    const CANARY: f64 = -7.25e77;
    let mut session = subject.running(subject.plain_uses()[0])?;
    let all = subject.readable().filter(|v| v.c_type == CType::Float64);
    for v in all {
        let n = v.length();
        // The FMU is called with nValues = n, and then with n - 1. In both calls the array of the host
        // is longer than nValues.
        for told in [n, n.saturating_sub(1)] {
            let place = format!("fmi3GetFloat64 of {} with nValues = {told}", v.name);
            let mut values = vec![CANARY; n + 8];
            let answer = subject.with_undefined_effect(place, findings, || {
                session.instance.get_numbers(&[v.reference], &mut values[..told])
            });
            if values[told..].iter().any(|x| x.to_bits() != CANARY.to_bits()) {
                findings.at(v.place()).add(format!(
                    "fmi3GetFloat64 with nValues = {told} writes more values than that"
                ));
            } else if told < n && answer.is_ok() {
                findings.at(v.place()).warn(format!(
                    "fmi3GetFloat64 of an array of {n} values returns fmi3OK for nValues = {told} (required: fmi3Error)"
                ));
            }
        }
    }
    Ok(())
}

pub fn booleans(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let mut session = subject.running(subject.plain_uses()[0])?;
    session.advance(2)?;
    let mut any = false;
    for v in subject.readable().filter(|v| v.c_type == CType::Boolean) {
        any = true;
        let mut bytes = vec![0xa5; v.length()];
        session.instance.get_boolean_bytes(&[v.reference], &mut bytes)?;
        if let Some(byte) = bytes.iter().find(|byte| **byte > 1) {
            findings.at(v.place()).add(format!("fmi3GetBoolean writes {byte} (allowed: 0, 1)"));
        }
    }
    if !any {
        findings.skip("the FMU has no Boolean");
    }
    Ok(())
}

pub fn fixed(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let Some(using) = subject.plain_uses().first().copied() else { return Ok(()) };
    let mut any = false;
    let wanted = |v: &&Variable| {
        v.causality == Causality::Parameter
            && v.variability == Variability::Fixed
            && v.c_type == CType::Float64
    };
    for v in subject.readable().filter(wanted) {
        any = true;
        let mut session = subject.running(using)?;
        session.advance(1)?;
        let before = session.read(v)?;
        let moved: Vec<f64> = before
            .iter()
            .map(|x| if let Value::Real(x) = x { x + 0.125 * v.nominal() } else { 0.0 })
            .collect();
        let place = format!("setting the fixed parameter {} after initialisation", v.name);
        let set = subject.with_undefined_effect(place, findings, || {
            session.instance.set_numbers(&[v.reference], &moved)
        });
        if set.is_ok() && session.read(v)? != before {
            findings.at(v.place()).add("the parameter is fixed, and fmi3SetFloat64 after initialization changes it (allowed: fmi3Error)");
        }
    }
    if !any {
        findings.skip("the FMU has no fixed parameter of type Float64");
    }
    Ok(())
}

pub fn restore(subject: &Subject, findings: &mut Findings) -> Result<()> {
    states::rollback(subject, findings)?;
    match subject.plain_uses().first().filter(|_| findings.skipped.is_none()) {
        Some(using) => Ok(subject.running(*using)?.instance.free_state_null()?),
        None => Ok(()),
    }
}

pub fn serialize(subject: &Subject, findings: &mut Findings) -> Result<()> {
    for using in states::uses_with(subject, "canSerialize", findings) {
        let mut session = subject.running(using)?;
        session.advance(5)?;
        let state = session.instance.get_state()?;
        subject.announce("fmi3SerializeFMUState");
        let bytes = session.instance.serialize(&state)?;
        let here = session.mark();
        let first = states::continue_from(&mut session, &here)?;
        subject.announce("fmi3DeserializeFMUState");
        let copy = session.instance.deserialize(&bytes)?;
        session.instance.set_state(&copy)?;
        let again = states::continue_from(&mut session, &here)?;
        if let Some(text) = session.difference(&again, &first) {
            findings.at(format!("{using}, from a serialised state")).add(text);
        }
        if let Some(half) = bytes.len().checked_div(2).filter(|half| *half > 0) {
            subject.announce("fmi3DeserializeFMUState of half the bytes");
            if let Ok(wrong) = session.instance.deserialize(&bytes[..half]) {
                findings.at(using.to_string()).add(format!(
                    "{half} of the {} bytes of a serialised state are accepted as a state (required: fmi3Error)",
                    bytes.len()
                ));
                session.instance.free_state(wrong)?;
            }
        }
        session.instance.free_state(copy)?;
        session.instance.free_state(state)?;
    }
    Ok(())
}

pub fn log_environment(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let mut heard = 0;
    let mut run = |mut using: Use| -> Result<()> {
        let stepping = using.interface == Interface::CoSimulation;
        using.updates =
            stepping && subject.has_capability(using.interface, "providesIntermediateUpdate");
        let mut session = subject.running(using)?;
        session.advance(2)?;
        heard += session.provoke_refusal().map_or(0, |error| error.messages.len());
        heard += session.instance.take_messages().len() + session.instance.updates();
        Ok(())
    };
    let done: Result<()> = subject.plain_uses().into_iter().try_for_each(&mut run);
    match foreign_environments() {
        0 => {
            done?;
            if heard == 0 {
                findings.skip("the FMU calls no callback");
            }
        }
        n => findings.at("the callbacks").add(format!(
                "{n} calls have another instanceEnvironment than that given when the instance was made (allowed: the \
                 same pointer; fmi3Instance is not it)"
            )),
    }
    Ok(())
}

pub fn log_errors(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let mut session = subject.running(subject.plain_uses()[0])?;
    if let Some(error) = session.provoke_refusal()
        && error.status == Status::Error
        && error.messages.is_empty()
    {
        findings
            .at(subject.last_call())
            .add("the call returns fmi3Error without a message (allowed: a message)");
    }
    Ok(())
}

pub fn exchange_counts(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let d = subject.description;
    let mut session = subject.exchanging()?;
    let length = |r: u32| d.at(r).map_or(0, Variable::length);
    let states: usize = d.states().into_iter().map(length).sum();
    let indicators = d.unknowns("EventIndicator").filter_map(|u| u.key);
    let indicators: usize = indicators.map(length).sum();
    let (nx, nz) = session.sizes()?;
    for (call, own, declared, list) in [
        ("fmi3GetNumberOfContinuousStates", nx, states, "ContinuousStateDerivative"),
        ("fmi3GetNumberOfEventIndicators", nz, indicators, "EventIndicator"),
    ] {
        if own != declared {
            findings
                .at(call)
                .add(format!("the call returns {own}, but the elements {list} of modelDescription.xml have {declared} values in all (required: equal numbers)"));
        }
    }
    Ok(())
}

pub fn exchange_vectors(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let d = subject.description;
    let mut session = subject.exchanging()?;
    session.advance(3)?;
    let derivatives: Vec<u32> =
        d.unknowns("ContinuousStateDerivative").filter_map(|u| u.key).collect();
    let indicators: Vec<u32> = d.unknowns("EventIndicator").filter_map(|u| u.key).collect();
    for (call, vector, references) in [
        ("fmi3GetContinuousStates", session.states()?, d.states()),
        ("fmi3GetContinuousStateDerivatives", session.derivatives()?, derivatives),
        ("fmi3GetEventIndicators", session.indicators()?, indicators),
    ] {
        let mut of = vector.iter();
        for v in references.iter().filter_map(|r| d.at(*r)) {
            for value in session.read(v)? {
                if let (Value::Real(a), Some(b)) = (&value, of.next())
                    && a.to_bits() != b.to_bits()
                {
                    findings.at(call).add(format!(
                        "the vector of states has {b:?} for {}, which is read as {a:?} (required: equal values)",
                        v.name
                    ));
                }
            }
        }
    }
    Ok(())
}

pub fn states_set(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let mut session = subject.exchanging()?;
    let x = session.states()?;
    if x.is_empty() {
        return skip("the FMU has no continuous states");
    }
    let moved: Vec<f64> = x.iter().map(|x| x + 1e-3 * x.abs().max(1e-3)).collect();
    subject.announce("fmi3SetContinuousStates");
    session.instance.set_continuous_states(&moved)?;
    let x = session.states()?;
    if let Some(i) = (0..x.len()).find(|i| x[*i].to_bits() != moved[*i].to_bits()) {
        findings.at("fmi3SetContinuousStates").add(format!(
            "state {} was set to {:?} and is then read as {:?}",
            i + 1,
            moved[i],
            x[i]
        ));
    }
    Ok(())
}

pub fn indicators(subject: &Subject, findings: &mut Findings) -> Result<()> {
    let mut session = subject.exchanging()?;
    if session.sizes()?.1 == 0 {
        return skip("the FMU has no event indicators");
    }
    session.advance(10 * STEPS)?;
    if let Some((time, i)) = session.notes.zero_indicator {
        findings
            .at(format!("event indicator {}, t = {time:?} s", i + 1))
            .add("the event indicator is exactly 0 after event mode (required: above or below 0, so that the host sees on which side the model is)");
    }
    Ok(())
}

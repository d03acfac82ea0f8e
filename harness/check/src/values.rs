use std::collections::BTreeSet;

use anyhow::Result;

use super::description::Variable;
use super::findings::Findings;
use super::life::expect_refusal;
use super::under_test::{FmuUnderTest, STEPS, Session, start_value};
use host::causality::{Causality, Variability};
use host::description::{Type, Value};
use host::fmi2::{Called, Instance};

pub fn settable(fmu: &FmuUnderTest) -> impl Iterator<Item = (&Variable, Value)> {
    let all = fmu.variables().iter().filter(|v| v.is_set_by_hosts());
    all.filter_map(|v| Some((v, start_value(v)?)))
}

fn initializing<'f>(fmu: &'f FmuUnderTest) -> Result<Session<'f>> {
    // If an ordinary initialisation fails, another rule reports it, and this rule ends.
    fmu.running(fmu.first_interface()?)?;
    let mut session = fmu.session(fmu.first_interface()?)?;
    session.instance.setup_experiment(None, session.time, None)?;
    session.instance.enter_initialization_mode()?;
    Ok(session)
}

/// Returns true if a value equals the value in modelDescription.xml to within half a unit of the 15th digit plus
/// rounding. A double represents 15 decimal digits.
fn has_digits_of(value: &Value, written: &Value) -> bool {
    const HALF_A_UNIT: f64 = 5e-15;
    match (value, written) {
        (Value::Real(value), Value::Real(written)) if value.is_finite() => {
            let largest = value.abs().max(written.abs());
            (value - written).abs() <= (HALF_A_UNIT + f64::EPSILON) * largest
        }
        _ => value.is_identical(written),
    }
}

pub fn start(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let starts: Vec<_> = fmu
        .variables()
        .iter()
        .filter(|v| v.initial.as_deref() != Some("approx"))
        .filter_map(|v| Some((v, start_value(v)?)))
        .collect();
    let mut wrong = BTreeSet::new();
    let mut look = |session: &mut Session, when: &str, only_parameters: bool| {
        for (v, start) in &starts {
            // An output or a state may move away from its start value with time.
            if only_parameters && !v.is_set_by_hosts() {
                continue;
            }
            let Ok(value) = session.get(v) else { continue }; // values.readable tells
            if !has_digits_of(&value, start) && wrong.insert(v.key) {
                findings.at(v.place()).add(format!(
                    "the start value is {start} in modelDescription.xml, but {value} in the binary {when} (required: equal values)"
                ));
            }
        }
    };
    let mut session = initializing(fmu)?;
    fmu.announce("reading start values in initialization mode");
    look(&mut session, "before initialisation", false);
    session.leave_initialisation()?;
    fmu.announce("reading start values after initialisation");
    look(&mut session, "after initialisation", true);
    Ok(())
}

pub fn readable(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut session = initializing(fmu)?;
    let mut told = BTreeSet::new();
    let mut look = |session: &mut Session, when: &str| {
        for v in fmu.variables() {
            fmu.announce(format!("reading {} {when}", v.name));
            let fault = match session.get(v) {
                Err(error) => error.to_string(),
                Ok(Value::Real(x)) if !x.is_finite() => {
                    format!("the value is {x} {when} (allowed: finite)")
                }
                Ok(_) => continue,
            };
            if told.insert(v.key) {
                findings.at(v.place()).add(fault);
            }
        }
    };
    look(&mut session, "in initialization mode");
    session.leave_initialisation()?;
    look(&mut session, "after initialisation");
    session.advance(3)?;
    look(&mut session, "after steps");
    Ok(())
}

pub fn booleans(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut session = initializing(fmu)?;
    let all: Vec<_> = fmu.variables().iter().filter(|v| v.kind == Type::Boolean).collect();
    if all.is_empty() {
        findings.skip("the FMU has no Booleans");
    }
    for v in all {
        fmu.announce(format!("reading and setting {}", v.name));
        let (reference, mut value) = ([v.reference], [0]);
        session.instance.get_boolean(&reference, &mut value)?;
        if !matches!(value, [0 | 1]) {
            findings
                .at(v.place())
                .fail(format!("the Boolean is read as {} (allowed: 0 and 1)", value[0]));
        }
        if v.is_set_by_hosts() && session.instance.set_boolean(&reference, &[2]).is_ok() {
            session.instance.get_boolean(&reference, &mut value)?;
            if value != [1] {
                let text = format!(
                    "the Boolean was set to 2, which counts as true, and is then read as {}",
                    value[0]
                );
                findings.at(v.place()).add(text);
            }
        }
    }
    Ok(())
}

pub fn round_trip(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut session = initializing(fmu)?;
    let mut fresh = fmu.session(fmu.first_interface()?)?;
    for (v, start) in settable(fmu) {
        fmu.announce(format!("setting {} to {start}", v.name));
        // The values are set before fmi2SetupExperiment, because some hosts set every start value in this order.
        if let Err(error) = fresh.set(v, &start) {
            findings
                .at(v.place())
                .add(format!("the call that sets the start value of modelDescription.xml is refused when instantiated: {error}"));
        }
        let mut tried = vec![start.clone()];
        tried.extend(other_value(fmu, v, &start));
        tried.push(start);
        for value in tried {
            fmu.announce(format!("setting {} to {value}", v.name));
            // The FMU may refuse a value other than the start value.
            if session.set(v, &value).is_err() {
                continue;
            }
            let read = session.get(v)?;
            if !read.is_identical(&value) {
                findings
                    .at(v.place())
                    .add(format!("the variable was set to {value} and is then read as {read}"));
                break;
            }
        }
    }
    Ok(())
}

/// Returns another allowed value near `start`, or `None` if there is none.
pub fn other_value(fmu: &FmuUnderTest, v: &Variable, start: &Value) -> Option<Value> {
    let (min, max) = v.bounds();
    match start {
        Value::Real(x) => {
            let step = x.abs().max(v.nominal() * 1e-3) / 1024.0;
            let step = step.min((max - min) / 4.0);
            let moved = if x + step <= max { x + step } else { x - step };
            (moved >= min && moved != *x).then_some(Value::Real(moved))
        }
        Value::Integer(n) => {
            let allowed: Vec<i64> = match v.kind {
                Type::Enumeration => items(fmu, v),
                _ => vec![n.saturating_add(1), n.saturating_sub(1)],
            };
            let fits = |m: &i64| m != n && *m as f64 >= min && *m as f64 <= max;
            allowed.into_iter().find(fits).map(Value::Integer)
        }
        Value::Boolean(b) => Some(Value::Boolean(!b)),
        Value::String(text) => Some(Value::String(format!("{text}x"))),
    }
}

pub fn items(fmu: &FmuUnderTest, v: &Variable) -> Vec<i64> {
    let declared = v.typed.get("declaredType");
    let types = fmu.description.root.list("TypeDefinitions");
    let simple = types.filter(|t| t.get("name").is_some() && t.get("name") == declared);
    let items = simple.flat_map(|t| t.list("Enumeration"));
    items.filter_map(|item| item.get("value")?.trim().parse().ok()).collect()
}

pub fn nothing(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut session = initializing(fmu)?;
    fmu.announce("fmi2Get… and fmi2Set… with nvr = 0 and NULL pointers");
    for (call, status) in session.instance.calls_without_variables() {
        if status != host::fmi2::Status::Ok {
            findings
                .at(format!("{call} with nvr = 0"))
                .add(format!("fmi2{status:?} (allowed: fmi2OK)"));
        }
    }
    Ok(())
}

pub fn unknown(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let taken: BTreeSet<u32> = fmu.variables().iter().map(|v| v.reference).collect();
    let largest = taken.last().copied().unwrap_or(0);
    let free = [u32::MAX, largest.saturating_add(1)];
    let calls: [Call; 8] = [
        ("fmi2GetReal", |i, r| i.get_real(&[r], &mut [0.0])),
        ("fmi2SetReal", |i, r| i.set_real(&[r], &[0.0])),
        ("fmi2GetInteger", |i, r| i.get_integer(&[r], &mut [0])),
        ("fmi2SetInteger", |i, r| i.set_integer(&[r], &[0])),
        ("fmi2GetBoolean", |i, r| i.get_boolean(&[r], &mut [0])),
        ("fmi2SetBoolean", |i, r| i.set_boolean(&[r], &[0])),
        ("fmi2GetString", |i, r| i.get_string(&[r]).map(|_| ())),
        ("fmi2SetString", |i, r| i.set_string(&[r], &["x"])),
    ];
    for reference in free.into_iter().filter(|r| !taken.contains(r)) {
        for call in calls {
            let what = format!("the unknown value reference {reference}");
            check_refusal(fmu, findings, call, reference, &what)?;
        }
    }
    Ok(())
}

type Call = (&'static str, fn(&mut Instance, u32) -> Called);

/// Adds a finding unless the FMU refuses the call `what`. Each such call is made with a new instance, because after an
/// error some FMUs refuse every call.
fn check_refusal(
    fmu: &FmuUnderTest,
    findings: &mut Findings,
    (name, call): Call,
    reference: u32,
    what: &str,
) -> Result<()> {
    let mut session = fmu.running(fmu.first_interface()?)?;
    let place = format!("{name} of {what}");
    fmu.announce(&place);
    let answer = call(&mut session.instance, reference);
    expect_refusal(findings, place, answer);
    Ok(())
}

pub fn wrong_type(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    // In FMI 2.0 each type has its own value references.
    let of = |kinds: &[Type]| -> BTreeSet<u32> {
        let all = fmu.variables().iter().filter(|v| kinds.contains(&v.kind));
        all.map(|v| v.reference).collect()
    };
    let integers = of(&[Type::Integer, Type::Enumeration]);
    let (reals, booleans, texts) = (of(&[Type::Real]), of(&[Type::Boolean]), of(&[Type::String]));
    let of_real: [(Call, &BTreeSet<u32>); 4] = [
        (("fmi2GetInteger", |i, r| i.get_integer(&[r], &mut [0])), &integers),
        (("fmi2SetInteger", |i, r| i.set_integer(&[r], &[0])), &integers),
        (("fmi2GetBoolean", |i, r| i.get_boolean(&[r], &mut [0])), &booleans),
        (("fmi2GetString", |i, r| i.get_string(&[r]).map(|_| ())), &texts),
    ];
    let mut looked = false;
    for (call, others) in of_real {
        if let Some(reference) = reals.difference(others).next() {
            looked = true;
            check_refusal(fmu, findings, call, *reference, "a Real")?;
        }
    }
    let get_real: Call = ("fmi2GetReal", |i, r| i.get_real(&[r], &mut [0.0]));
    for (others, what) in [(&integers, "an Integer"), (&booleans, "a Boolean")] {
        if let Some(reference) = others.difference(&reals).next() {
            looked = true;
            check_refusal(fmu, findings, get_real, *reference, what)?;
        }
    }
    if !looked {
        findings.skip("every value reference belongs to a variable of each type, so that no unknown one can be tried");
    }
    Ok(())
}

pub fn fixed(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let fixed = settable(fmu).filter(|(v, _)| {
        v.causality == Causality::Parameter && v.variability == Variability::Fixed
    });
    let mut any = false;
    let (mut refused, mut accepted) = (None, Vec::new());
    for (v, start) in fixed {
        any = true;
        let mut session = fmu.running(fmu.first_interface()?)?;
        session.advance(1)?;
        let place = format!("setting the fixed parameter {} after initialisation", v.name);
        fmu.announce(&place);
        let other = other_value(fmu, v, &start).unwrap_or(start);
        match session.set(v, &other) {
            Ok(()) => accepted.push((place, session.get(v)?.is_identical(&other))),
            answer => {
                refused = Some(&v.name);
                expect_refusal(findings, place, answer);
            }
        }
    }
    for (place, is_taken) in accepted {
        match refused {
            // The binary accepts the new value, so that the parameter is tunable, although the description says fixed.
            Some(other) if is_taken => findings.at(place).fail(format!(
                "the call is accepted as for tunable parameters, while {other} is refused (allowed: \
                     fmi2Error, or variability=\"tunable\")"
            )),
            _ => findings.at(place).add("the call is accepted (allowed: fmi2Error and a message)"),
        }
    }
    if !any {
        findings.skip("the FMU has no fixed parameters");
    }
    Ok(())
}

pub fn computed(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let aliases: BTreeSet<_> =
        settable(fmu).map(|(v, _)| (v.kind == Type::Real, v.reference)).collect();
    let mut any = false;
    for causality in [Causality::Output, Causality::Local, Causality::CalculatedParameter] {
        // Variables with initial exact or approx can be set before initialisation, but not later.
        let v = fmu.variables().iter().find(|v| {
            v.causality == causality
                && v.initial.as_deref() == Some("calculated")
                && !aliases.contains(&(v.kind == Type::Real, v.reference))
        });
        let Some(v) = v else { continue };
        any = true;
        let mut session = fmu.running(fmu.first_interface()?)?;
        let value = session.get(v)?;
        let place = format!("setting the {causality} {} after initialisation", v.name);
        fmu.announce(&place);
        let answer = session.set(v, &value);
        expect_refusal(findings, place, answer);
    }
    if !any {
        findings.skip("the FMU declares no calculated variable");
    }
    Ok(())
}

pub fn contains_name(text: &str, name: &str) -> bool {
    let part = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.' | '[');
    text.match_indices(name).any(|(at, _)| {
        let (before, after) = (text[..at].chars().last(), text[at + name.len()..].chars().next());
        !before.is_some_and(part) && !after.is_some_and(|c| part(c) && c != '.')
    })
}

pub fn not_a_number(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    // Inputs are left out, because another rule is about them.
    let reals =
        settable(fmu).filter(|(v, _)| v.kind == Type::Real && v.causality != Causality::Input);
    for (v, _) in reals {
        for x in [f64::NAN, f64::INFINITY] {
            let mut session = fmu.session(fmu.first_interface()?)?;
            let place = format!("{} = {x}, then a step", v.name);
            let refused = fmu.with_undefined_effect(&place, findings, || {
                session.set(v, &Value::Real(x)).is_err()
                    || session.initialise().is_err()
                    || session.make_step(session.step).is_err()
            });
            if !refused {
                findings.at(place).add(
                    "the value is accepted without error (allowed: fmi2Error at the step at the latest)",
                );
                break;
            }
        }
    }
    Ok(())
}

pub fn no_warning(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    for interface in fmu.interfaces() {
        let mut session = fmu.running(interface)?;
        session.advance(STEPS)?;
        session.readings()?;
        if let Some(call) = session.instance.take_warning() {
            findings
                .at(format!("an ordinary run ({interface})"))
                .add(format!("{call} returns fmi2Warning (allowed: fmi2OK)"));
        }
    }
    Ok(())
}

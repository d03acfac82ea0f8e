//! Rules that compare the ranges and enumeration items of modelDescription.xml with the binary (FMI 2.0.5,
//! sections 2.2.3 and 2.2.7).

use std::collections::BTreeSet;

use anyhow::Result;

use super::dependencies::random_session;
use super::description::Variable;
use super::findings::Findings;
use super::under_test::{FmuUnderTest, STEPS, Session, skip, start_value};
use super::values::{contains_name, items, settable};
use host::description::{Type, Value};

/// Largest amount by which a value may exceed min or max without a finding, relative to min or max or to the nominal
/// value. A small excess is allowed because an integrator may move a state slightly out of its range.
const OVERSHOOT: f64 = 1e-3;

pub fn in_range(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let bounded =
        |v: &&Variable| v.bounds() != (f64::NEG_INFINITY, f64::INFINITY) && !v.is_set_by_hosts();
    let all: Vec<&Variable> = fmu.variables().iter().filter(bounded).collect();
    if all.is_empty() {
        return skip("no variable that the FMU computes has a min or a max");
    }
    let mut told = BTreeSet::new();
    for interface in fmu.interfaces() {
        let mut session = fmu.running(interface)?;
        for step in 0..=2 * STEPS {
            if step > 0 {
                session.advance(1)?;
            }
            fmu.announce(format!("reading what has a min or a max after {step} steps"));
            for v in &all {
                let x = match session.get(v) {
                    Ok(Value::Real(x)) => x,
                    Ok(Value::Integer(n)) => n as f64,
                    _ => continue,
                };
                let (min, max) = v.bounds();
                let slack = |bound: f64| match v.kind {
                    Type::Real => OVERSHOOT * bound.abs().max(v.nominal()),
                    _ => 0.0,
                };
                if (x < min - slack(min) || x > max + slack(max)) && told.insert(v.key) {
                    findings.at(v.place()).add(format!(
                        "the value is {x} after {step} steps of an ordinary run ({interface}) (allowed by its min \
                             and max: {min} to {max})"
                    ));
                }
            }
        }
    }
    Ok(())
}

/// Sets the start value of `v`, and initialises the FMU. The inner error is the reason why the FMU
/// refused the value.
fn refusal(fmu: &FmuUnderTest, v: &Variable, value: &Value) -> Result<Result<()>> {
    let mut session = fmu.session(fmu.first_interface()?)?;
    fmu.announce(format!("setting {} to {value} and initialising", v.name));
    if let Err(error) = session.set(v, value) {
        return Ok(Err(error.into()));
    }
    Ok(session.initialise())
}

/// Returns the finite bounds of all numbers that hosts set: the variable, the bound, the direction that leaves the range, and
/// the name of the attribute.
fn bounds(fmu: &FmuUnderTest) -> Vec<(&Variable, f64, f64, &'static str)> {
    let settable = fmu.variables().iter().filter(|v| v.is_set_by_hosts());
    let numbers = settable.filter(|v| matches!(v.kind, Type::Real | Type::Integer));
    let both = numbers.filter(|v| start_value(v).is_some()).flat_map(|v| {
        let (min, max) = v.bounds();
        [(v, min, -1.0, "min"), (v, max, 1.0, "max")]
    });
    both.filter(|(_, bound, ..)| bound.is_finite()).collect()
}

fn number(v: &Variable, x: f64) -> Value {
    if v.is_real() { Value::Real(x) } else { Value::Integer(x as i64) }
}

/// Returns true if `x` is a value of the variable's type.
fn is_value_of_type(v: &Variable, x: f64) -> bool {
    x.is_finite() && (v.is_real() || f64::from(x as i32) == x)
}

pub fn limits(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let bounds = bounds(fmu);
    for &(v, bound, outwards, _) in &bounds {
        // The FMU may refuse the value because it contradicts another parameter; the message then names this
        // parameter, too.
        if let Err(why) = refusal(fmu, v, &number(v, bound))?
            && !settable(fmu)
                .any(|(o, _)| o.name != v.name && contains_name(&why.to_string(), &o.name))
        {
            findings.at(v.place()).add(format!(
                "the value {bound} lies within min and max, but the FMU refuses it: {why}"
            ));
        }
        let size = if v.is_real() { bound.abs().max(1e-3 * v.nominal()) } else { 1.0 };
        let outside = bound + outwards * size;
        if is_value_of_type(v, outside) && refusal(fmu, v, &number(v, outside))?.is_ok() {
            let (min, max) = v.bounds();
            findings.at(v.place()).add(format!(
                "the value {outside} lies outside of min and max ({min} to {max}), but the FMU accepts it"
            ));
        }
    }
    if bounds.is_empty() {
        findings.skip("no variable that hosts set has a min or a max");
    }
    Ok(())
}

pub fn limits_exact(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    const JUST: f64 = 1e-6;
    /// Distance from a bound at which an Integer is outside any reasonable range.
    const FAR: f64 = 1000.0;
    let bounds = bounds(fmu);
    for &(v, bound, outwards, name) in &bounds {
        let size = bound.abs().max(1e-3 * v.nominal());
        let near = bound + outwards * if v.is_real() { JUST * size } else { 1.0 };
        let far = bound + outwards * if v.is_real() { size } else { FAR };
        // An FMU that accepts every value breaks another rule, and has no exact range that could be compared.
        if near != bound
            && is_value_of_type(v, near)
            && is_value_of_type(v, far)
            && refusal(fmu, v, &number(v, far))?.is_err()
            && refusal(fmu, v, &number(v, near))?.is_ok()
        {
            findings.at(v.place()).add(format!(
                "{near} is accepted, and {far} refused: the binary's range is wider than {name}={bound} says (allowed: the \
                 same range)"
            ));
        }
    }
    if bounds.is_empty() {
        findings.skip("no number that a host sets has a min or a max");
    }
    Ok(())
}

pub fn items_known(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let all: Vec<&Variable> =
        fmu.variables().iter().filter(|v| v.kind == Type::Enumeration).collect();
    if all.is_empty() {
        return skip("the FMU has no enumerations");
    }
    fmu.chose_values();
    for v in all.iter().filter(|v| v.is_set_by_hosts() && start_value(v).is_some()) {
        let known = items(fmu, v);
        let (Some(first), Some(last)) = (known.iter().min(), known.iter().max()) else { continue };
        let list = known.iter().map(i64::to_string).collect::<Vec<_>>().join(", ");
        for item in &known {
            if let Err(why) = refusal(fmu, v, &Value::Integer(*item))?
                && !fmu
                    .variables()
                    .iter()
                    .any(|o| o.name != v.name && contains_name(&why.to_string(), &o.name))
            {
                findings.at(v.place()).add(format!(
                    "{item} is an item of the variable's type, but the FMU refuses it: {why}"
                ));
            }
        }
        // Types that accept further items are reported. Another rule reports a type that accepts any number.
        let beyond = last.saturating_add(1000);
        let takes_any = refusal(fmu, v, &Value::Integer(beyond))?.is_ok();
        if takes_any {
            findings
                .at(v.place())
                .add(format!("{beyond} is accepted, although it is no item of the variable's type (allowed: {list})"));
            continue;
        }
        for other in first.saturating_sub(1)..=last.saturating_add(3) {
            if !known.contains(&other) && refusal(fmu, v, &Value::Integer(other))?.is_ok() {
                findings.at(v.place()).fail(format!(
                    "{other} is accepted, and no item of its type in modelDescription.xml has \
                         this value (items: {list})"
                ));
            }
        }
    }
    let computed: Vec<&&Variable> = all.iter().filter(|v| !v.is_set_by_hosts()).collect();
    if computed.is_empty() {
        return Ok(());
    }
    let mut told = BTreeSet::new();
    let mut look = |session: &mut Session| {
        for v in &computed {
            let known = items(fmu, v);
            if let Ok(Value::Integer(value)) = session.get(v)
                && !known.is_empty()
                && !known.contains(&value)
                && told.insert(v.key)
            {
                let list = known.iter().map(i64::to_string).collect::<Vec<_>>().join(", ");
                findings.at(v.place()).fail(format!(
                    "the value is {value}, and no item of its type in modelDescription.xml has this \
                         value (items: {list})"
                ));
            }
        }
    };
    // runs with random parameters, and runs with one parameter far from its start value
    for attempt in 0..STEPS as u64 {
        let mut session = random_session(fmu, fmu.first_interface()?, attempt)?;
        fmu.announce(format!("initialising with other parameters, try {attempt}"));
        if session.initialise().is_err() {
            continue;
        }
        for _ in 0..5 {
            look(&mut session);
            if session.advance(1).is_err() {
                break;
            }
        }
    }
    for v in fmu.variables().iter().filter(|v| v.is_set_by_hosts() && v.is_real()) {
        for x in far_values(v) {
            let mut session = fmu.session(fmu.first_interface()?)?;
            fmu.announce(format!("initialising with {} = {x:?}", v.name));
            if session.set(v, &Value::Real(x)).is_ok() && session.initialise().is_ok() {
                look(&mut session);
                if session.advance(1).is_ok() {
                    look(&mut session);
                }
            }
        }
    }
    Ok(())
}

fn far_values(v: &Variable) -> Vec<f64> {
    let (min, max) = v.bounds();
    let Some(Value::Real(start)) = start_value(v) else { return Vec::new() };
    let size = start.abs().max(v.nominal());
    let mut values = vec![start + 0.3 * size, start + 3.0 * size, start - 3.0 * size];
    if max.is_finite() {
        values.extend([0.1, 0.2, 0.5, 1.0].map(|share| start + share * (max - start)));
    }
    if min.is_finite() {
        values.push(0.5 * (start + min));
    }
    values.retain(|x| *x >= min && *x <= max && *x != start);
    values
}

//! Warnings about parameters without effect: no warning names a parameter that changes an output.

use runtime::Model;
use runtime::call::{CType, Interface};
use runtime::instance::Instance;
use runtime::table::Scalar;
use runtime::v2::{Fmi2, GET_BOOLEAN, GET_INTEGER, GET_REAL, SET_BOOLEAN, SET_INTEGER, SET_REAL};
use runtime::variable::{Access, Causality, Kind, Quantity, Value};

type Values<'a> = &'a [(&'a str, f64)];

fn value_of<M: Model>(scalar: &Scalar<M>, x: f64) -> Value {
    match scalar.c_type {
        CType::Real => Value::Real(x),
        CType::Boolean => Value::Boolean(x != 0.0),
        _ => Value::Integer(x as i32),
    }
}

/// Returns the bits of the outputs at the start and after each of four steps, and the warnings; `None` if the FMU refuses the
/// `values`.
fn run<M: Model>(values: &[(&'static Scalar<M>, Value)]) -> Option<(Vec<u64>, Vec<String>)> {
    let mut instance = Instance::<M, Fmi2>::new(Interface::CoSimulation);
    for (scalar, value) in values {
        let call = match value {
            Value::Real(_) => &SET_REAL,
            Value::Integer(_) => &SET_INTEGER,
            Value::Boolean(_) => &SET_BOOLEAN,
        };
        instance.set(call, &[scalar.index], |_| *value).ok()?;
    }
    instance.enter_initialization_mode().ok()?;
    instance.exit_initialization_mode().ok()?;
    let warnings = instance.warnings();
    let is_set =
        |s: &Scalar<M>| matches!(s.variable.causality, Causality::Input | Causality::Parameter);
    let mut bits = Vec::new();
    let mut time = 0.0;
    for h in [0.1, 0.3, 0.7, 1.1] {
        for scalar in M::table().scalars.iter().filter(|s| !is_set(s)) {
            let call = match scalar.c_type {
                CType::Real => &GET_REAL,
                CType::Boolean => &GET_BOOLEAN,
                _ => &GET_INTEGER,
            };
            bits.push(match instance.get(call, scalar.index).ok()? {
                Value::Real(x) => x.to_bits(),
                Value::Integer(n) => n as u64,
                Value::Boolean(b) => b.into(),
            });
        }
        instance.do_step(time, h).ok()?;
        time += h;
    }
    Some((bits, warnings))
}

/// Lists other values for a parameter whose present value is `value`. The test uses the first one that the FMU accepts.
fn other_values<M: Model>(scalar: &Scalar<M>, value: Value) -> Vec<Value> {
    match (value, scalar.variable.kind) {
        (Value::Boolean(b), _) => vec![Value::Boolean(!b)],
        (Value::Integer(n), Kind::Enumeration(of)) => {
            (1..=of.items.len() as i32).filter(|m| *m != n).map(Value::Integer).collect()
        }
        (Value::Integer(n), _) => [n + 1, n - 1, n + 2].map(Value::Integer).to_vec(),
        (Value::Real(x), Kind::Real(Quantity { max, .. })) => {
            let by_range = max.map_or(1.0, |max| 1e-3 * max.min(1e3));
            let all = [1.03 * x, 0.97 * x, x + by_range, x - by_range, x + 1e-3, x + 1e-6, 1.0];
            all.into_iter().filter(|y| *y != x).map(Value::Real).collect()
        }
        _ => Vec::new(),
    }
}

/// Changes each parameter separately, and asserts that no warning names a parameter that changes an output.
fn check<M: Model>(base: Values) {
    let scalar = |name: &str| {
        let n = M::table().find(name).unwrap_or_else(|| panic!("no variable {name}"));
        &M::table().scalars[n as usize]
    };
    let base: Vec<_> =
        base.iter().map(|(name, x)| (scalar(name), value_of(scalar(name), *x))).collect();
    let (before, warnings) = run::<M>(&base).expect("the scene is accepted");
    let warned = |warnings: &[String]| warnings.iter().any(|text| text.contains("no effect"));
    assert!(!warned(&warnings), "{warnings:?}");
    let mut faults = Vec::new();
    for scalar in M::table().parameters() {
        if matches!(scalar.access, Access::Input(_)) {
            continue;
        }
        let set = base.iter().find(|(s, _)| s.index == scalar.index).map(|(_, value)| *value);
        let Some(value) = set.or_else(|| scalar.start()) else { continue };
        for other in other_values(scalar, value) {
            let mut values = base.clone();
            values.retain(|(s, _)| s.index != scalar.index);
            values.push((scalar, other));
            let Some((after, warnings)) = run::<M>(&values) else { continue };
            let name = scalar.name();
            let is_named = warnings
                .iter()
                .any(|text| text.contains("no effect") && text.starts_with(&format!("{name} ")));
            if before != after && is_named {
                faults.push(format!("{name} = {other:?} has an effect: {warnings:?}"));
            }
            break;
        }
    }
    let base: Vec<_> = base.iter().map(|(s, value)| (s.name(), value)).collect();
    assert!(faults.is_empty(), "{base:?}:\n{}", faults.join("\n"));
}

/// HubSlosh warns of parameters that are set but have no effect. A change of each of them must leave all outputs
/// bit-identical.
#[test]
fn no_warning_names_a_parameter_of_hubslosh_that_changes_an_output() {
    let check = check::<HubSlosh::HubSlosh>;
    let moving = [("init.omega", 0.3), ("tau_cmd", 0.3), ("tau_ext", -0.5)];
    let with =
        |more: &[(&'static str, f64)]| -> Vec<(&'static str, f64)> { [&moving[..], more].concat() };
    // The settings contain each friction law and each slosh model at least once.
    for n in 1..=5 {
        let (friction, slosh) = (f64::from(n), f64::from(1 + n % 5));
        let models = [("friction.model", friction), ("slosh.model", slosh), ("slosh.modes", 1.0)];
        check(&with(&models));
    }
    check(&with(&[("slosh.zeta_from_correlation", 0.0), ("bench.tilt", 0.02)]));
    check(&with(&[("wheel.enabled", 1.0), ("imu.enabled", 1.0)]));
}

#[test]
fn no_warning_names_a_parameter_of_spacecraft_that_changes_an_output() {
    check::<Spacecraft::Model>(&[("force[1]", 10.0)]);
}

#[test]
fn no_warning_names_a_parameter_of_sloshtank_that_changes_an_output() {
    check::<SloshTank::Model>(&[]);
}

/// If another parameter replaces a parameter, so that it has no effect, the warning must say so.
#[test]
fn a_warning_names_parameters_that_have_no_effect_because_others_replace_them() {
    fn said<M: Model>(values: Values) -> Vec<String> {
        let scalar = |name: &str| &M::table().scalars[M::table().find(name).unwrap() as usize];
        let values: Vec<_> =
            values.iter().map(|(name, x)| (scalar(name), value_of(scalar(name), *x))).collect();
        run::<M>(&values).expect("the values are accepted").1
    }
    let hub = said::<HubSlosh::HubSlosh>(&[("slosh.zeta", 0.01)]);
    assert!(hub[0].starts_with("slosh.zeta has no effect: slosh.zeta_from_correlation is true"));
    let hub = said::<HubSlosh::HubSlosh>(&[("slosh.zeta", 0.01), ("slosh.model", 1.0)]);
    assert_eq!(hub, [""; 0], "what is switched off needs no warning");
    let craft =
        said::<Spacecraft::Model>(&[("tank[1].frequency[1]", 0.5), ("tank[1].length[1]", 0.3)]);
    assert!(craft[0].starts_with("tank[1].length[1] has no effect: tank[1].frequency[1] = 0.5 Hz"));
}

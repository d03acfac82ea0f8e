//! Tests of the allowed values of a variable, and of the messages about other values.

use super::*;
use crate::number::{is_finite, text};
use crate::variable::Dimension::Fixed;
use crate::variable::{Enumeration, Item, Variable};
use Value::{Boolean, Integer, Real};

type V = Variable<Vessels>;

static CHOICE: Enumeration =
    Enumeration { name: "C", description: "", items: &[Item::new("a", ""), Item::new("b", "")] };

fn a_real(unit: &'static str) -> V {
    V::parameter("p", |p, _| &mut p.k, unit, "")
}

fn an_integer() -> V {
    V::integer("n", |p, _| &mut p.number, "")
}

fn why(variable: &V, value: Value) -> String {
    variable.problem(0, value).unwrap_or_default()
}

#[test]
fn finite_numbers_are_recognised_by_their_bits() {
    for x in [0.0, -0.0, 1.0, -1e308, f64::MAX, f64::MIN_POSITIVE, 5e-324] {
        assert!(is_finite(x), "{x}");
    }
    for x in [f64::NAN, -f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(!is_finite(x), "{x}");
    }
    assert_eq!([f64::NAN, -f64::NAN].map(text), ["NaN", "NaN"]);
    assert_eq!(
        [f64::INFINITY, -f64::INFINITY, 1.0, -0.5].map(text),
        ["inf", "-inf", "1.0", "-0.5"]
    );
}

#[test]
fn values_within_a_range_and_at_its_ends_are_accepted() {
    let both = a_real("m").range(-2.0, 3.0);
    let low = a_real("m").at_least(-2.0);
    let integer = an_integer().between(-2, 3);
    for x in [-2.0, 0.0, 3.0] {
        assert_eq!(both.problem(0, Real(x)), None);
        assert_eq!(low.problem(0, Real(x)), None);
        assert_eq!(integer.problem(0, Integer(x as i32)), None);
    }
    assert_eq!(low.problem(0, Real(1e300)), None);
    assert_eq!(a_real("m").problem(0, Real(-1e300)), None);
    assert_eq!(an_integer().problem(0, Integer(i32::MIN)), None);
    let choice = V::choice("c", &CHOICE, |_, _| 1, |_, _, _| {}, "");
    assert_eq!([1, 2].map(|n| choice.problem(0, Integer(n))), [None, None]);
    let switch = V::switch("b", |p| &mut p.has_lid, "");
    assert_eq!(switch.problem(0, Boolean(false)), None);
}

#[test]
fn values_out_of_range_are_refused_with_the_range_and_unit() {
    let both = a_real("m").range(-2.0, 3.0);
    assert_eq!(why(&both, Real(-2.1)), "p = -2.1 m (allowed: -2.0 m to 3.0 m)");
    assert_eq!(why(&both, Real(3.1)), "p = 3.1 m (allowed: -2.0 m to 3.0 m)");
    assert_eq!(why(&both, Real(f64::NAN)), "p = NaN m (allowed: -2.0 m to 3.0 m)");
    let low = a_real("1").at_least(0.0);
    assert_eq!(why(&low, Real(-0.1)), "p = -0.1 (allowed: at least 0.0, finite)");
    assert_eq!(why(&low, Real(f64::INFINITY)), "p = inf (allowed: at least 0.0, finite)");
    let mut high = a_real("");
    high.kind = match high.kind {
        Kind::Real(quantity) => {
            Kind::Real(crate::variable::Quantity { max: Some(1.0), ..quantity })
        }
        kind => kind,
    };
    assert_eq!(why(&high, Real(2.0)), "p = 2.0 (allowed: at most 1.0, finite)");
    assert_eq!(high.problem(0, Real(-1e300)), None);
    assert_eq!(why(&a_real("s"), Real(f64::NAN)), "p = NaN s (allowed: any finite number)");
    assert_eq!(why(&an_integer().between(-2, 3), Integer(4)), "n = 4 (allowed: -2 to 3)");
    assert_eq!(why(&an_integer().between(-2, 3), Integer(-3)), "n = -3 (allowed: -2 to 3)");
    let mut one_sided = an_integer();
    one_sided.kind = Kind::Integer { min: Some(1), max: None };
    assert_eq!(why(&one_sided, Integer(0)), "n = 0 (allowed: at least 1)");
    one_sided.kind = Kind::Integer { min: None, max: Some(1) };
    assert_eq!(why(&one_sided, Integer(2)), "n = 2 (allowed: at most 1)");
    let choice = V::choice("c", &CHOICE, |_, _| 1, |_, _, _| {}, "");
    for n in [-1, 0, 3] {
        assert_eq!(why(&choice, Integer(n)), format!("c = {n} (allowed: 1 a, 2 b)"));
    }
    let array = a_real("m").range(0.0, 1.0).shape(&[Fixed(2), Fixed(2)]);
    assert!(array.problem(2, Real(2.0)).unwrap().starts_with("p[2,1] = 2.0 m"));
}

#[test]
fn a_value_of_another_type_than_the_variable_is_refused() {
    let switch = V::switch("b", |p| &mut p.has_lid, "");
    assert_eq!(why(&switch, Integer(1)), "b = 1 (allowed: true, false)");
    assert_eq!(why(&an_integer(), Boolean(true)), "n = true (allowed: any integer)");
    assert_eq!(why(&an_integer(), Real(1.0)), "n = 1.0 (allowed: any integer)");
    assert_eq!(why(&a_real("m"), Integer(1)), "p = 1 (allowed: any finite number)");
}

/// The largest allowed rate of an input is the rate at which it crosses its allowed range in 1 ns.
#[test]
fn the_rate_of_an_input_is_bounded_by_the_range_of_its_value() {
    let free = a_real("m");
    let both = a_real("m").range(-8.0, 2.0);
    let above = a_real("m").range(1.0, 2.0);
    assert_eq!(free.fastest(), f64::INFINITY);
    close(both.fastest(), 8e9, 1e-15);
    close(above.fastest(), 2e9, 1e-15);
    assert_eq!(a_real("m").at_least(-1.0).fastest(), f64::INFINITY);
    assert_eq!(an_integer().fastest(), f64::INFINITY);
    for rate in [0.0, 7.9e9, -7.9e9] {
        assert!(free.allows_rate(rate) && both.allows_rate(rate));
    }
    assert!(free.allows_rate(-1e300));
    assert!(!both.allows_rate(8.1e9) && !both.allows_rate(-8.1e9));
    assert!(above.allows_rate(-1.9e9) && !above.allows_rate(2.1e9));
    for rate in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(!free.allows_rate(rate) && !both.allows_rate(rate));
        assert!(!an_integer().allows_rate(rate));
    }
    assert!(an_integer().allows_rate(1.0));
}

#[test]
fn a_variable_has_the_unit_range_and_nominal_value_that_were_given() {
    let plain = a_real("m");
    assert_eq!((plain.unit(), plain.min(), plain.nominal_value()), ("m", None, 1.0));
    let rich = a_real("kg").range(-2.0, 3.0).nominal(7.0).display_unit("g");
    assert_eq!((rich.unit(), rich.min(), rich.nominal_value()), ("kg", Some(-2.0), 7.0));
    assert!(matches!(rich.kind, Kind::Real(q) if q.display_unit == Some("g")));
    let integer = an_integer().between(1, 2);
    assert_eq!((integer.unit(), integer.min(), integer.nominal_value()), ("", None, 1.0));
    assert!(!plain.is_empty());
    assert_eq!((plain.len(), plain.shape(&[Fixed(4), Fixed(3)]).len()), (1, 12));
}

#[test]
fn a_parameter_is_read_back_as_it_was_set_unless_its_type_is_wrong() {
    let mut parameters = vessels::Parameters::default();
    let mut all = TABLE.parameters().to_vec();
    all.extend(TABLE.inputs());
    for scalar in all {
        let v = scalar.variable;
        let old = v.parameter_value(&mut parameters, scalar.element);
        let new = match old {
            Some(Real(x)) => Real(x + 1.0),
            Some(Integer(n)) => Integer(n + 1),
            Some(Boolean(b)) => Boolean(!b),
            None => {
                assert_eq!(v.causality, crate::variable::Causality::Input);
                continue;
            }
        };
        // If the value has another type, nothing changes.
        let other = if matches!(old, Some(Boolean(_))) { Real(0.0) } else { Boolean(true) };
        v.set_parameter(&mut parameters, scalar.element, other);
        assert_eq!(v.parameter_value(&mut parameters, scalar.element), old);
        v.set_parameter(&mut parameters, scalar.element, new);
        assert_eq!(v.parameter_value(&mut parameters, scalar.element), Some(new));
    }
}

//! Rules about units (FMI 2.0.5, section 2.2.2): UnitDefinitions must agree with the name of the unit, and a
//! derivative must have the unit of its state per second.
//!
//! Names are parsed as Modelica writes them (Modelica 3.6, chapter 19): SI symbols with prefixes, `.` for
//! products, one `/`, and exponents after the symbol, as in `kg.m2/s2`. A name that cannot be parsed in this
//! way is not checked.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use super::description::Description;
use super::findings::Findings;
use host::description::BaseUnit;
use host::xml::Element;

/// Position of the radian among [`BaseUnit::NAMES`]. The radian has dimension 1, so that authors may write it or omit it.
const RADIAN: usize = 7;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Unit {
    exponents: [i32; 8],
    factor: f64,
    offset: f64,
}

impl Unit {
    const ONE: Unit = Unit { exponents: [0; 8], factor: 1.0, offset: 0.0 };

    /// Multiplies this unit by `other` to the power `power`. The offset is dropped, because only a unit that is not
    /// part of a product can have one.
    fn times(self, other: Unit, power: i32) -> Unit {
        let mut exponents = self.exponents;
        for (e, o) in exponents.iter_mut().zip(other.exponents) {
            *e += power * o;
        }
        Unit { exponents, factor: self.factor * other.factor.powi(power), offset: 0.0 }
    }

    /// Returns true if both units have the same dimension; radians are ignored.
    fn has_same_dimensions(&self, other: &Unit) -> bool {
        (0..RADIAN).all(|i| self.exponents[i] == other.exponents[i])
    }

    /// Returns true if this unit has the same power of radians as the other unit, or no radians.
    fn has_radians_of(&self, other: &Unit) -> bool {
        [0, other.exponents[RADIAN]].contains(&self.exponents[RADIAN])
    }

    /// Returns the unit in the form of UnitDefinitions, for example "kg=1, m=2, s=-2".
    fn text(&self) -> String {
        let mut text: Vec<String> = BaseUnit::NAMES
            .iter()
            .zip(self.exponents)
            .filter(|(_, e)| *e != 0)
            .map(|(name, e)| format!("{name}={e}"))
            .collect();
        if self.factor != 1.0 {
            text.push(format!("factor={}", self.factor));
        }
        if self.offset != 0.0 {
            text.push(format!("offset={}", self.offset));
        }
        if text.is_empty() { "no exponents".into() } else { text.join(" ") }
    }
}

/// A unit symbol: its text, true if it may have a prefix, the exponents of kg, m, s, A, K, mol, cd and rad, the factor
/// and the offset. A symbol that can mean several units has several entries.
type Symbol = (&'static str, bool, [i32; 8], f64, f64);

#[rustfmt::skip]
const SYMBOLS: &[Symbol] = &[
    ("m", true, [0, 1, 0, 0, 0, 0, 0, 0], 1.0, 0.0),
    ("g", true, [1, 0, 0, 0, 0, 0, 0, 0], 1e-3, 0.0),
    ("g", false, [0, 1, -2, 0, 0, 0, 0, 0], 9.80665, 0.0), // standard gravity
    ("s", true, [0, 0, 1, 0, 0, 0, 0, 0], 1.0, 0.0),
    ("A", true, [0, 0, 0, 1, 0, 0, 0, 0], 1.0, 0.0),
    ("K", true, [0, 0, 0, 0, 1, 0, 0, 0], 1.0, 0.0),
    ("mol", true, [0, 0, 0, 0, 0, 1, 0, 0], 1.0, 0.0),
    ("cd", true, [0, 0, 0, 0, 0, 0, 1, 0], 1.0, 0.0),
    ("rad", true, [0, 0, 0, 0, 0, 0, 0, 1], 1.0, 0.0),
    ("sr", true, [0, 0, 0, 0, 0, 0, 0, 2], 1.0, 0.0),
    ("Hz", true, [0, 0, -1, 0, 0, 0, 0, 0], 1.0, 0.0),
    ("Hz", true, [0, 0, -1, 0, 0, 0, 0, 1], 2.0 * PI, 0.0), // a frequency shown for rad/s
    ("N", true, [1, 1, -2, 0, 0, 0, 0, 0], 1.0, 0.0),
    ("Pa", true, [1, -1, -2, 0, 0, 0, 0, 0], 1.0, 0.0),
    ("bar", true, [1, -1, -2, 0, 0, 0, 0, 0], 1e5, 0.0),
    ("J", true, [1, 2, -2, 0, 0, 0, 0, 0], 1.0, 0.0),
    ("W", true, [1, 2, -3, 0, 0, 0, 0, 0], 1.0, 0.0),
    ("Wh", true, [1, 2, -2, 0, 0, 0, 0, 0], 3600.0, 0.0),
    ("C", true, [0, 0, 1, 1, 0, 0, 0, 0], 1.0, 0.0),
    ("C", false, [0, 0, 0, 0, 1, 0, 0, 0], 1.0, 273.15),
    ("V", true, [1, 2, -3, -1, 0, 0, 0, 0], 1.0, 0.0),
    ("F", true, [-1, -2, 4, 2, 0, 0, 0, 0], 1.0, 0.0),
    ("F", false, [0, 0, 0, 0, 1, 0, 0, 0], 5.0 / 9.0, 459.67 * 5.0 / 9.0),
    ("Ohm", true, [1, 2, -3, -2, 0, 0, 0, 0], 1.0, 0.0),
    ("ohm", true, [1, 2, -3, -2, 0, 0, 0, 0], 1.0, 0.0),
    ("S", true, [-1, -2, 3, 2, 0, 0, 0, 0], 1.0, 0.0),
    ("Wb", true, [1, 2, -2, -1, 0, 0, 0, 0], 1.0, 0.0),
    ("T", true, [1, 0, -2, -1, 0, 0, 0, 0], 1.0, 0.0),
    ("H", true, [1, 2, -2, -2, 0, 0, 0, 0], 1.0, 0.0),
    ("min", false, [0, 0, 1, 0, 0, 0, 0, 0], 60.0, 0.0),
    ("h", false, [0, 0, 1, 0, 0, 0, 0, 0], 3600.0, 0.0),
    ("d", false, [0, 0, 1, 0, 0, 0, 0, 0], 86400.0, 0.0),
    ("t", false, [1, 0, 0, 0, 0, 0, 0, 0], 1000.0, 0.0),
    ("l", true, [0, 3, 0, 0, 0, 0, 0, 0], 1e-3, 0.0),
    ("L", true, [0, 3, 0, 0, 0, 0, 0, 0], 1e-3, 0.0),
    ("deg", false, [0, 0, 0, 0, 0, 0, 0, 1], PI / 180.0, 0.0),
    ("rev", false, [0, 0, 0, 0, 0, 0, 0, 1], 2.0 * PI, 0.0),
    ("rev", false, [0, 0, 0, 0, 0, 0, 0, 0], 1.0, 0.0),
    ("r", false, [0, 0, 0, 0, 0, 0, 0, 1], 2.0 * PI, 0.0),
    ("r", false, [0, 0, 0, 0, 0, 0, 0, 0], 1.0, 0.0),
    ("rpm", false, [0, 0, -1, 0, 0, 0, 0, 1], PI / 30.0, 0.0),
    ("rpm", false, [0, 0, -1, 0, 0, 0, 0, 0], 1.0 / 60.0, 0.0),
    ("°", false, [0, 0, 0, 0, 0, 0, 0, 1], PI / 180.0, 0.0),
    ("°C", false, [0, 0, 0, 0, 1, 0, 0, 0], 1.0, 273.15),
    ("degC", false, [0, 0, 0, 0, 1, 0, 0, 0], 1.0, 273.15),
    ("degF", false, [0, 0, 0, 0, 1, 0, 0, 0], 5.0 / 9.0, 459.67 * 5.0 / 9.0),
    ("1", false, [0; 8], 1.0, 0.0),
    ("%", false, [0; 8], 0.01, 0.0),
];

/// Prefixes in common use. The rarest are left out, because for example "PS" is a horsepower.
const PREFIXES: [(&str, f64); 12] = [
    ("T", 1e12),
    ("G", 1e9),
    ("M", 1e6),
    ("k", 1e3),
    ("h", 1e2),
    ("d", 1e-1),
    ("c", 1e-2),
    ("m", 1e-3),
    ("u", 1e-6),
    ("µ", 1e-6),
    ("n", 1e-9),
    ("p", 1e-12),
];

/// Lists the units that a symbol can mean, with and without a prefix.
fn symbol(text: &str) -> Vec<Unit> {
    let unit = |(_, _, exponents, factor, offset): &Symbol, prefix: f64| Unit {
        exponents: *exponents,
        factor: factor * prefix,
        offset: *offset,
    };
    let exact: Vec<Unit> = SYMBOLS.iter().filter(|s| s.0 == text).map(|s| unit(s, 1.0)).collect();
    if !exact.is_empty() {
        return exact;
    }
    let mut all = Vec::new();
    for (prefix, size) in PREFIXES {
        let Some(rest) = text.strip_prefix(prefix) else { continue };
        all.extend(SYMBOLS.iter().filter(|s| s.1 && s.0 == rest).map(|s| unit(s, size)));
    }
    all
}

/// Lists the units that the name of a unit can mean; empty if the name cannot be parsed.
fn read(name: &str) -> Vec<Unit> {
    let mut rest = name.trim();
    match quotient(&mut rest) {
        Some(units) if rest.is_empty() => units,
        _ => Vec::new(),
    }
}

/// Parses a unit of the form `product` or `product/factor`, such as `kg.m2/s`.
fn quotient(rest: &mut &str) -> Option<Vec<Unit>> {
    let above = product(rest)?;
    let Some(after) = rest.strip_prefix('/') else { return Some(above) };
    *rest = after;
    let below = factor(rest)?;
    // a/b.c and a/b/c are ambiguous for readers.
    if rest.starts_with(['.', '*', '/']) {
        return None;
    }
    Some(combine(&above, &below, -1))
}

fn product(rest: &mut &str) -> Option<Vec<Unit>> {
    let mut all = factor(rest)?;
    while let Some(after) = rest.strip_prefix(['.', '*']) {
        *rest = after;
        all = combine(&all, &factor(rest)?, 1);
    }
    Some(all)
}

fn combine(left: &[Unit], right: &[Unit], power: i32) -> Vec<Unit> {
    left.iter().flat_map(|l| right.iter().map(move |r| l.times(*r, power))).collect()
}

fn factor(rest: &mut &str) -> Option<Vec<Unit>> {
    let base = if let Some(inner) = rest.strip_prefix('(') {
        *rest = inner;
        let inner = quotient(rest)?;
        *rest = rest.strip_prefix(')')?;
        inner
    } else if let Some(after) = rest.strip_prefix('1') {
        *rest = after;
        return Some(vec![Unit::ONE]);
    } else {
        let end = rest
            .find(|c: char| !(c.is_alphabetic() || matches!(c, '%' | '°')))
            .unwrap_or(rest.len());
        let (name, after) = rest.split_at(end);
        *rest = after;
        symbol(name)
    };
    let after = rest.strip_prefix('^').unwrap_or(rest);
    let sign = usize::from(after.starts_with(['+', '-']));
    let digits = after[sign..].find(|c: char| !c.is_ascii_digit()).unwrap_or(after.len() - sign);
    if digits == 0 {
        return (!base.is_empty()).then_some(base);
    }
    let power: i32 = after[..sign + digits].parse().ok().filter(|p: &i32| p.abs() < 100)?;
    *rest = &after[sign + digits..];
    (!base.is_empty()).then(|| base.iter().map(|u| Unit::ONE.times(*u, power)).collect())
}

fn unit_from_element(unit: &Element) -> Option<Unit> {
    let BaseUnit { exponents, factor, offset } = BaseUnit::from_element(unit)?;
    Some(Unit { exponents, factor, offset })
}

fn number(element: &Element, attribute: &str, default: f64) -> Option<f64> {
    match element.get(attribute) {
        None => Some(default),
        Some(_) => element.number(attribute).filter(|x| x.is_finite()),
    }
}

/// Returns true if two conversion factors agree in three digits, the accuracy with which authors
/// usually write them.
fn is_equal(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-3 * a.abs().max(b.abs())
}

pub fn numbers(d: &Description, findings: &mut Findings) {
    for unit in d.root.list("UnitDefinitions") {
        for child in &unit.children {
            let name = child.get("name").or(unit.get("name")).unwrap_or_default();
            let place = format!("line {}, {} of \"{name}\"", child.line, child.name);
            for (attribute, not_0) in [("factor", true), ("offset", false)] {
                let Some(x) = child.number(attribute) else { continue };
                if !x.is_finite() || (not_0 && x == 0.0) {
                    let allowed = if not_0 { "finite, not 0" } else { "finite" };
                    findings.at(&place).add(format!("{attribute}={x} (allowed: {allowed})"));
                }
            }
        }
    }
}

pub fn base_units(d: &Description, findings: &mut Findings) {
    for unit in d.root.list("UnitDefinitions") {
        let (Some(name), Some(written)) = (unit.get("name"), unit_from_element(unit)) else {
            continue;
        };
        let meant = read(name);
        let fits = |m: &&Unit| {
            written.has_same_dimensions(m)
                && written.has_radians_of(m)
                // Some authors give % the factor 0.01, others do not.
                && (m.exponents == [0; 8]
                    || is_equal(written.factor, m.factor)
                        && (written.offset - m.offset).abs() <= 1e-3 * m.offset.abs())
        };
        if let Some(first) = meant.first()
            && !meant.iter().any(|m| fits(&m))
        {
            findings.at(format!("line {}, Unit \"{name}\"", unit.line)).add(format!(
                "BaseUnit declares {}, but the unit of that name has {} (required: the dimensions of the name)",
                written.text(),
                first.text()
            ));
        }
    }
}

pub fn display_units(d: &Description, findings: &mut Findings) {
    for unit in d.root.list("UnitDefinitions") {
        let Some(name) = unit.get("name") else { continue };
        // Without BaseUnit the name determines the unit that is converted.
        let from = match unit_from_element(unit) {
            Some(written) => vec![written],
            None => read(name),
        };
        for shown in unit.children.iter().filter(|c| c.name == "DisplayUnit") {
            let numbers = (number(shown, "factor", 1.0), number(shown, "offset", 0.0));
            let (Some(shown_name), (Some(factor), Some(offset))) = (shown.get("name"), numbers)
            else {
                continue;
            };
            let to = read(shown_name);
            if from.is_empty() || to.is_empty() || shown_name == name {
                continue;
            }
            let place = format!("line {}, DisplayUnit \"{shown_name}\" of \"{name}\"", shown.line);
            // shown = factor · value + offset. from.factor · value + from.offset and to.factor · shown + to.offset are
            // the same number in base units.
            let expected: Vec<(f64, f64)> = from
                .iter()
                .flat_map(|f| to.iter().map(move |t| (f, t)))
                .filter(|(f, t)| f.has_same_dimensions(t))
                .map(|(f, t)| (f.factor / t.factor, (f.offset - t.offset) / t.factor))
                .collect();
            let Some((right, shift)) = expected.first().copied() else {
                findings.at(place).add(format!(
                    "the units \"{shown_name}\" ({}) and \"{name}\" ({}) have different dimensions",
                    to[0].text(),
                    from[0].text()
                ));
                continue;
            };
            let fits = |(f, o): &(f64, f64)| {
                is_equal(factor, *f) && (offset - o).abs() <= 1e-3 * o.abs().max(1e-9)
            };
            if !expected.iter().any(fits) {
                let inverted = is_equal(factor * right, 1.0);
                let hint = if inverted { "; it is inverted" } else { "" };
                findings.at(place).add(format!(
                    "factor={factor} offset={offset}{hint} (allowed: factor={right} \
                         offset={shift}, for shown = factor * value + offset)"
                ));
            }
        }
    }
}

pub fn derivative_units(d: &Description, findings: &mut Findings) {
    let units: BTreeMap<&str, &Element> =
        d.root.list("UnitDefinitions").filter_map(|unit| Some((unit.get("name")?, unit))).collect();
    let known = |name: &str| -> Vec<Unit> {
        match units.get(name).and_then(|unit| unit_from_element(unit)) {
            Some(unit) => vec![unit],
            None => read(name),
        }
    };
    let second = Unit { exponents: [0, 0, 1, 0, 0, 0, 0, 0], ..Unit::ONE };
    for v in &d.variables {
        let Some(state) = v.derivative_of().and_then(|index| d.at(index)) else { continue };
        let (of_state, of_derivative) = (state.typed.get("unit"), v.typed.get("unit"));
        let (Some(of_state), Some(of_derivative)) = (of_state, of_derivative) else { continue };
        let (all, written) = (known(of_state), known(of_derivative));
        if all.is_empty() || written.is_empty() {
            continue;
        }
        let expected: Vec<Unit> = all.iter().map(|u| u.times(second, -1)).collect();
        let fits = |w: &Unit| {
            expected.iter().any(|e| e.has_same_dimensions(w) && is_equal(e.factor, w.factor))
        };
        if !written.iter().any(fits) {
            findings.at(v.place()).add(format!(
                "the variable is the derivative of {} in \"{of_state}\", but its unit is \"{of_derivative}\" (required: \"{of_state}\" per second, which is {})",
                state.name,
                expected[0].text()
            ));
        }
    }
}

//! Reads units of measurement, and converts their values to SI.
//!
//! One grammar reads units in brackets, in a row of units, and within the name of a column (`find_unit`). A
//! unit is a product of symbols (`mN`, `deg`, `s`) or words (`degrees`, `microseconds`) with whole exponents:
//! `N·m`, `mN.m`, `Nm`, `m/s^2`, `m s⁻²`, `deg per sec`, `deg_s`. If a text has several meanings, the
//! expected quantity decides: `nm` means newton metres for a torque and nanometres for a length.

use std::fmt;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    Time,
    Torque,
    Rate,
    Angle,
    Acceleration,
    Length,
    Force,
}

use Quantity::{Acceleration, Angle, Force, Length, Rate, Time, Torque};

pub(super) type Dimension = [i8; 4];

const GRAVITY: f64 = 9.80665;
const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Weight of a pound under standard gravity, N. The pound is 0.453 592 37 kg (international yard and
/// pound agreement of 1959).
const POUND: f64 = 0.453_592_37 * GRAVITY;

/// A symbol of a unit such as `N`: its name, its dimension, its value in SI, and the prefixes with
/// which it may occur.
type Symbol = (&'static str, Dimension, f64, &'static str);

const SYMBOLS: [Symbol; 20] = [
    ("s", [0, 0, 1, 0], 1.0, "mun"),
    ("min", [0, 0, 1, 0], 60.0, ""),
    ("h", [0, 0, 1, 0], 3600.0, ""),
    ("d", [0, 0, 1, 0], 86_400.0, ""),
    ("rad", [0, 0, 0, 1], 1.0, "mu"),
    ("deg", [0, 0, 0, 1], DEGREE, "m"),
    ("arcmin", [0, 0, 0, 1], DEGREE / 60.0, ""),
    ("arcsec", [0, 0, 0, 1], DEGREE / 3600.0, ""),
    ("rev", [0, 0, 0, 1], 360.0 * DEGREE, ""),
    ("dps", [0, 0, -1, 1], DEGREE, "m"),
    ("rpm", [0, 0, -1, 1], 6.0 * DEGREE, ""),
    ("m", [0, 1, 0, 0], 1.0, "mcun"),
    ("in", [0, 1, 0, 0], 0.0254, ""),
    ("ft", [0, 1, 0, 0], 0.3048, ""),
    ("N", FORCE, 1.0, "muk"),
    ("lbf", FORCE, POUND, ""),
    ("ozf", FORCE, POUND / 16.0, ""),
    ("kg", [1, 0, 0, 0], 1.0, ""),
    ("g", [0, 1, -2, 0], GRAVITY, "mu"),
    ("gal", [0, 1, -2, 0], 1e-2, "m"),
];

const FORCE: Dimension = [1, 1, -2, 0];
const LENGTH: Dimension = [0, 1, 0, 0];
const PREFIXES: [(&str, &str, f64); 5] = [
    ("m", "milli", 1e-3),
    ("u", "micro", 1e-6),
    ("n", "nano", 1e-9),
    ("c", "centi", 1e-2),
    ("k", "kilo", 1e3),
];

const WORDS: &str = "sec=s second=s msec=ms milli=ms usec=us micro=us nsec=ns nano=ns min=min minute=min hr=h hour=h day=d rad=rad \
    radian=rad deg=deg degree=deg rev=rev revolution=rev newton=N meter=m metre=m inch=in foot=ft lb=lbf oz=ozf";

type Product = (Dimension, f64);

/// Finds the meanings of the unit symbol `name`, also with a prefix such as m for milli. If `fold` is true,
/// upper and lower case are treated as equal, so that a symbol may have several meanings.
fn symbol(name: &str, fold: bool) -> Vec<Product> {
    let same = |a: &str, b: &str| if fold { a.eq_ignore_ascii_case(b) } else { a == b };
    let mut found = Vec::new();
    for (own, dimension, factor, prefixes) in SYMBOLS {
        if same(own, name) {
            found.push((dimension, factor));
        }
        for (prefix, _, scale) in PREFIXES.iter().filter(|(p, ..)| prefixes.contains(p)) {
            let rest = name.get(1..).filter(|_| name.get(..1).is_some_and(|p| same(p, prefix)));
            if rest.is_some_and(|rest| same(rest, own)) {
                found.push((dimension, scale * factor));
            }
        }
    }
    found
}

/// Finds the meanings of a unit that is written as a word, in upper or lower case, in the singular or plural,
/// with or without a prefix: `Milliseconds`.
fn word(name: &str) -> Vec<Product> {
    let lower = name.to_lowercase();
    let mut found = Vec::new();
    for text in [Some(lower.as_str()), lower.strip_suffix('s')].into_iter().flatten() {
        for (word, own) in WORDS.split_whitespace().filter_map(|pair| pair.split_once('=')) {
            let Some(prefix) = text.strip_suffix(word) else { continue };
            let scale = match PREFIXES.iter().find(|(_, name, _)| *name == prefix) {
                Some((.., scale)) if word.len() > 2 => *scale,
                _ if prefix.is_empty() => 1.0,
                _ => continue,
            };
            found.extend(
                symbol(own, false).iter().map(|(dimension, factor)| (*dimension, scale * factor)),
            );
        }
    }
    found
}

/// Reads a run of letters within a unit: a symbol, a word, or two of them without a separator (`mNm`,
/// `inlb`).
fn run(name: &str, fold: bool) -> Vec<Product> {
    let either = |name: &str| [symbol(name, fold), word(name)].concat();
    let mut found = either(name);
    // If upper and lower case count as equal, M may be mega or milli. Both meanings are returned, so that the
    // text counts as ambiguous.
    if fold && name.starts_with(['M']) && name[1..].starts_with(['n', 'N']) {
        let milli = run(&format!("m{}", &name[1..]), true);
        return milli.iter().map(|m| (m.0, 1e9 * m.1)).chain(milli.clone()).collect();
    }
    for at in 1..name.len() {
        let (left, right) = (&name[..at], &name[at..]);
        let pairs =
            either(left).into_iter().flat_map(|a| either(right).into_iter().map(move |b| (a, b)));
        let is_pound = ["lb", "lbf", "oz", "ozf"].contains(&&*right.to_lowercase());
        found.extend(pairs.filter_map(|(a, b)| match (a.0, b.0) {
            (FORCE, LENGTH) => Some(times(a, b, 1)),
            (LENGTH, FORCE) if is_pound => Some(times(a, b, 1)),
            _ => None,
        }));
    }
    found
}

fn times(a: Product, b: Product, exponent: i8) -> Product {
    let mut dimension = a.0;
    dimension
        .iter_mut()
        .zip(b.0)
        .for_each(|(a, b)| *a = a.saturating_add(b.saturating_mul(exponent)));
    let factor = match exponent {
        1 => a.1 * b.1,
        -1 => a.1 / b.1,
        power => a.1 * b.1.powi(power.into()),
    };
    (dimension, factor)
}

/// A run of letters within a unit, with its exponent. `is_soft` is true if the separator before it may mean a
/// product or a quotient, as in `deg_s`.
struct Term {
    letters: String,
    exponent: i8,
    is_soft: bool,
}

fn terms(text: &str) -> Option<Vec<Term>> {
    let text = text.replace('°', "deg").replace(['µ', 'μ', 'Μ'], "u").replace('″', "arcsec");
    let mut found: Vec<Term> = Vec::new();
    let (mut divides, mut is_soft, mut signs) = (false, false, String::new());
    let mut all = text.chars().peekable();
    while let Some(c) = all.next() {
        match c {
            'a'..='z' | 'A'..='Z' => {
                let mut letters = String::from(c);
                while let Some(c) = all.next_if(char::is_ascii_alphabetic) {
                    letters.push(c);
                }
                if letters.eq_ignore_ascii_case("per") {
                    divides = true;
                    continue;
                }
                let exponent = if divides { -1 } else { 1 };
                found.push(Term { letters, exponent, is_soft });
                (divides, is_soft) = (false, false);
                signs.clear();
            }
            '0'..='9' | '²' | '³' | '¹' => {
                let size = match c {
                    '¹' => 1,
                    '²' => 2,
                    '³' => 3,
                    digit => digit.to_digit(10)? as i8,
                };
                let last = found.last_mut().filter(|last| last.exponent.abs() == 1 && size > 0)?;
                if signs.ends_with(['-', '−', '⁻']) {
                    last.exponent = -last.exponent;
                }
                last.exponent *= size;
                (is_soft, divides) = (false, false);
                signs.clear();
            }
            '/' => divides = true,
            '_' => is_soft = true,
            ' ' | '.' | '·' | '⋅' | '∙' | '•' | '×' | '*' | '^' | '-' | '−' | '⁻' => {
                signs.push(c)
            }
            '(' | ')' | '{' | '}' | '[' | ']' => {}
            _ => return None,
        }
    }
    (!found.is_empty() && !divides).then_some(found)
}

/// Returns all meanings of a unit as products of symbols. If `fold` is true, upper and lower case are treated
/// as equal; if `divide` is true, ambiguous separators, as in `deg_s`, mean division.
fn products(text: &str, fold: bool, divide: bool) -> Vec<Product> {
    let Some(terms) = terms(text).filter(|terms| terms.len() < 6) else { return Vec::new() };
    // ms2 and ms-2 mean m/s², although no sign of division is there.
    if let [Term { letters, exponent: 2 | -2, .. }] = &terms[..]
        && letters.eq_ignore_ascii_case("ms")
    {
        return vec![([0, 1, -2, 0], 1.0)];
    }
    let mut found = vec![([0; 4], 1.0)];
    let is_single = terms.len() == 1;
    for term in terms {
        let exponent = if divide && term.is_soft { -term.exponent } else { term.exponent };
        // `mps2` is split, because it means m/s²; `dps` is itself a symbol.
        let whole = run(&term.letters, fold);
        if whole.is_empty() {
            let letters = &term.letters;
            let split = letters.to_lowercase().find("per").filter(|at| *at > 0);
            let split = split.map(|at| (&letters[..at], &letters[at + 3..]));
            let Some((left, right)) = split.or(letters.strip_suffix("ps").map(|l| (l, "s"))) else {
                return Vec::new();
            };
            let (left, right) = (run(left, fold), run(right, fold));
            let each = found.iter().flat_map(|a| {
                let above = left.iter().map(move |b| times(*a, *b, exponent.signum()));
                above.flat_map(|a| right.iter().map(move |b| times(a, *b, -exponent)))
            });
            found = each.collect();
            continue;
        }
        // `rads^-1` is read as rad/s, although it has no separator.
        let left = term.letters.strip_suffix(['s', 'S']).filter(|_| is_single && exponent < 0);
        let left = left.map(|left| run(left, fold)).unwrap_or_default();
        let each = found.iter().flat_map(|a| {
            let direct = whole.iter().map(move |b| times(*a, *b, exponent));
            let second = ([0, 0, 1, 0], 1.0);
            direct.chain(left.iter().map(move |b| times(times(*a, *b, 1), second, exponent)))
        });
        found = each.collect();
        found.truncate(64);
    }
    found
}

/// Returns the SI values of a unit with the given dimension: one value for a unit, none for a text that is
/// not a unit, several if the text is ambiguous.
pub(super) fn factors(text: &str, dimension: Dimension) -> Vec<f64> {
    for fold in [false, true] {
        for divide in [false, true] {
            let mut found: Vec<f64> = Vec::new();
            for (own, factor) in products(text, fold, divide) {
                let is_new = |f: &f64| (f / factor - 1.0).abs() > 1e-12;
                if own == dimension && found.iter().all(is_new) {
                    found.push(factor);
                }
            }
            if !found.is_empty() {
                return found;
            }
        }
    }
    Vec::new()
}

/// Units of quantities that the bench does not measure, such as volts. With them, a row of units below the
/// names of the columns is recognised.
const OTHERS: [&str; 42] = [
    "-", "1", "%", "V", "mV", "A", "mA", "W", "J", "ohm", "K", "C", "degC", "°C", "degF", "Pa",
    "hPa", "kPa", "MPa", "bar", "mbar", "psi", "Hz", "kHz", "l", "m/s", "km/h", "mph", "km", "T",
    "uT", "mT", "G", "rad/s2", "rad/s^2", "deg/s2", "deg/s^2", "dB", "counts", "raw", "rps",
    "grad",
];

/// Returns true if the text is a unit, which may therefore stand in brackets. `nanosec` and similar names are
/// no units, because such columns contain fractions of a second.
pub(super) fn is_unit(text: &str) -> bool {
    let text = text.trim_matches(['[', ']', '(', ')', ' ']);
    if ["nanosec", "nanosecs", "nsec", "nsecs"].contains(&text) {
        return false;
    }
    let known = |quantity: Quantity| {
        products(text, false, false).iter().any(|(own, _)| *own == quantity.dimension())
    };
    OTHERS.contains(&text) || Quantity::ALL.into_iter().any(known)
}

/// Returns the factor that converts values from one unit to another; `None` unless both are known units
/// of the same quantity.
pub fn conversion(from: &str, to: &str) -> Option<f64> {
    if from == to {
        return Some(1.0);
    }
    let (dimension, own) = parse_unit(to)?;
    match factors(from, dimension)[..] {
        [factor] => Some(factor / own),
        _ => None,
    }
}

pub(super) fn parse_unit(unit: &str) -> Option<Product> {
    match products(unit, false, false)[..] {
        [only] => Some(only),
        _ => None,
    }
}

const BETWEEN: [char; 11] = ['_', '.', ' ', '-', ',', ':', '/', '(', ')', '[', ']'];
/// Units that often mean something else at the end of a name: minimum, input, revision.
const OFTEN_OTHERS: [&str; 5] = ["min", "in", "rev", "raw", "counts"];

/// A unit that was found in the name of a column: its text, its SI value (`factor`), the part of the name
/// before it, and whether it ends the name.
#[derive(Debug, PartialEq)]
pub(super) struct Stated {
    pub text: String,
    pub factor: f64,
    pub before: String,
    pub is_last: bool,
}

#[derive(Debug, PartialEq)]
pub(super) enum Fault {
    Foreign(String),
    Two(String, String),
}

/// Finds the unit of a dimension within the name of a column: `gyro [deg/s]`, `gyro{deg/s} z`, `gyro_dps`,
/// `gyroDegPerSec`, `gyro in deg/s`, `time_ms_boot`, `TIME_US`.
///
/// # Errors
/// If the name states a unit of another dimension, or two units.
pub(super) fn find_unit(name: &str, dimension: Dimension) -> Result<Option<Stated>, Fault> {
    let stated = |from: usize, to: usize, text: &str, factor: f64| Stated {
        text: text.trim().into(),
        factor,
        before: strip_unit(&name[..from]).into(),
        is_last: name[to..].trim().is_empty(),
    };
    let mut found: Vec<Stated> = Vec::new();
    let mut other = None;
    for (from, to) in brackets(name) {
        let inside = name[from..to].trim_matches(['[', ']', '(', ')', '{', '}', '<', '>', ' ']);
        match factors(inside, dimension)[..] {
            [factor] => {
                let found_here = stated(from, to, inside, factor);
                // The name may contain a second unit, as in `t_ms [s]`.
                if let Ok(Some(also)) = find_unit(&found_here.before, dimension)
                    && also.text.len() > 1
                    && also.factor != factor
                {
                    return Err(Fault::Two(also.text, inside.into()));
                }
                found.push(found_here);
            }
            // Indices in brackets, as in `data(3)` of a .mat file and `p[1,2]` of an FMU, belong to the name.
            [] if inside.chars().all(|c| c.is_ascii_digit() || ", ".contains(c)) => {}
            [] if !is_unit(inside) && !name[to..].trim().is_empty() => {}
            _ => other = Some(inside),
        }
    }
    if found.is_empty() && other.is_none() {
        let starts: Vec<usize> = (0..name.len()).filter(|k| begins(name, *k)).collect();
        let ends: Vec<usize> = (1..=name.len()).filter(|k| ends(name, *k)).collect();
        let mut taken = (usize::MAX, 0);
        let mut windows: Vec<(usize, usize)> =
            starts.iter().flat_map(|from| ends.iter().map(move |to| (*from, *to))).collect();
        // The word "in" introduces a unit, as in `gyro in deg/s`.
        let leads = |from: usize| name[from..].to_lowercase().starts_with("in ");
        windows.retain(|(from, to)| from < to && to - from <= 40 && !leads(*from));
        // The longest unit is used; of equally long ones, the last.
        windows.sort_by_key(|(from, to)| (std::cmp::Reverse(to - from), std::cmp::Reverse(*from)));
        for (from, to) in windows {
            let text = &name[from..to];
            let is_last = name[to..].trim().is_empty();
            let is_inside = taken.0 <= from && to <= taken.1;
            if is_inside || !may_be_unit(name, text, from, is_last, dimension) {
                continue;
            }
            let read = |text: &str| factors(text, dimension);
            let mut factors = read(text);
            if factors.is_empty() {
                factors = read(&parted(text));
            }
            if factors.is_empty() {
                continue;
            }
            // The found unit may be a part of a longer one: Nm_s is not a torque.
            let rest = name[from..].trim();
            let continues = !is_last
                && [false, true].iter().any(|divide| !products(rest, false, *divide).is_empty());
            match factors[..] {
                [factor] if !continues => found.push(stated(from, to, text, factor)),
                _ => other = other.or(Some(if continues { rest } else { text })),
            }
            if taken.0 == usize::MAX {
                taken = (from, to);
            }
        }
        let is_foreign = |text: &str| {
            let minutes = dimension == Time.dimension() && text.eq_ignore_ascii_case("m");
            // An index in brackets, as in omega[1], is not a unit.
            let is_index = !text.contains(|c: char| c.is_alphabetic() || "%°".contains(c));
            minutes || !is_index && text.len() > 1 && !OFTEN_OTHERS.contains(&text) && is_unit(text)
        };
        if found.is_empty() && other.is_none() {
            let ends = starts.iter().filter(|from| **from > 0).map(|from| name[*from..].trim());
            other = ends.into_iter().find(|text| is_foreign(text));
        }
    }
    let second = found.iter().find(|stated| stated.factor != found[0].factor);
    match (second.map(|stated| stated.text.as_str()).or(other), found.is_empty()) {
        (None, true) => Ok(None),
        (None, false) => Ok(Some(found.swap_remove(0))),
        (Some(other), true) => Err(Fault::Foreign(other.into())),
        (Some(other), false) => Err(Fault::Two(found[0].text.clone(), other.into())),
    }
}

/// Returns true if a part of a column's name can be a unit. A single letter is a unit only at the end of the
/// name, after a separator and in the correct case; a whole name is a unit only if it is a time (`millis`).
fn may_be_unit(name: &str, text: &str, from: usize, is_last: bool, dimension: Dimension) -> bool {
    let shouts = !name.contains(|c: char| c.is_lowercase());
    let is_time = dimension == Time.dimension();
    match text.chars().count() {
        _ if from == 0 && is_last => is_time && text != "d" && text != "h" && text != "m",
        1 if text.is_ascii() => {
            let after = name[..from].chars().next_back();
            let own = text.chars().all(|c| c == 'N' || c.is_lowercase() && c != 'n') || shouts;
            is_last && own && text != "d" && after.is_some_and(|c| BETWEEN.contains(&c))
        }
        _ => true,
    }
}

/// Returns the part of a column's name before its unit, without the characters that introduce the unit:
/// opening brackets, separators and the word "in".
fn strip_unit(name: &str) -> &str {
    let name = name.trim_end_matches(|c| BETWEEN.contains(&c) || ['[', '(', '{', '<'].contains(&c));
    let cut = name.strip_suffix(" in").unwrap_or(name);
    cut.trim_end_matches(|c| BETWEEN.contains(&c))
}

fn brackets(name: &str) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    for (open, close) in [('[', ']'), ('(', ')'), ('{', '}'), ('<', '>')] {
        let mut from = 0;
        while let Some(start) = name[from..].find(open).map(|k| from + k) {
            let Some(end) = name[start..].find(close).map(|k| start + k + 1) else { break };
            found.push((start, end));
            from = end;
        }
    }
    // The brackets of `[rad/(s)]` are one pair of brackets with a unit.
    let inside = |a: &(usize, usize), b: &(usize, usize)| a != b && b.0 <= a.0 && a.1 <= b.1;
    let all = found.clone();
    found.retain(|a| !all.iter().any(|b| inside(a, b)));
    found
}

/// Returns true if a word begins at the position `at`: after a separator, or with a capital
/// after a lower-case letter.
fn begins(name: &str, at: usize) -> bool {
    let (Some(left), Some(right)) = (name.get(..at), name.get(at..)) else { return false };
    let (Some(next), last) = (right.chars().next(), left.chars().next_back()) else { return false };
    let is_hump = |last| is_hump(last, next, right.chars().nth(1));
    !BETWEEN.contains(&next) && last.is_none_or(|last| BETWEEN.contains(&last) || is_hump(last))
}

fn ends(name: &str, at: usize) -> bool {
    let (Some(left), Some(right)) = (name.get(..at), name.get(at..)) else { return false };
    let (Some(last), next) = (left.chars().next_back(), right.chars().next()) else { return false };
    let is_hump = |next| is_hump(last, next, right.chars().nth(1));
    !BETWEEN.contains(&last) && next.is_none_or(|next| BETWEEN.contains(&next) || is_hump(next))
}

/// Returns true if a new word begins with the letter `next` in a name of mixed case: with the B of aB, and
/// with the A of ABc.
fn is_hump(last: char, next: char, after: Option<char>) -> bool {
    next.is_uppercase() && (!last.is_uppercase() || after.is_some_and(char::is_lowercase))
}

/// Inserts separators between words in mixed case: `DegPerSec` becomes `Deg_Per_Sec`.
fn parted(text: &str) -> String {
    let mut found = String::new();
    for (at, c) in text.char_indices() {
        let after = text[at..].chars().nth(1);
        if found.chars().next_back().is_some_and(|last| is_hump(last, c, after)) {
            found.push('_');
        }
        found.push(c);
    }
    found
}

impl Quantity {
    const ALL: [Quantity; 7] = [Time, Torque, Rate, Angle, Acceleration, Length, Force];

    fn facts(self) -> (Dimension, &'static str, &'static str) {
        match self {
            Time => ([0, 0, 1, 0], "a time", "s, ms, us, ns, min, h, d"),
            Torque => ([1, 2, -2, 0], "a torque", "N.m, mN.m, uN.m, N.cm, kN.m, lbf.in, ozf.in"),
            Rate => ([0, 0, -1, 1], "a rate", "rad/s, mrad/s, deg/s, mdeg/s, dps, deg/h, rpm"),
            Angle => ([0, 0, 0, 1], "an angle", "rad, mrad, urad, deg, arcmin, arcsec"),
            Acceleration => ([0, 1, -2, 0], "an acceleration", "m/s2, mm/s2, g, mg"),
            Length => (LENGTH, "a length", "m, cm, mm, um, in"),
            Force => (FORCE, "a force", "N, mN, kN, lbf"),
        }
    }

    pub(super) fn dimension(self) -> Dimension {
        self.facts().0
    }

    /// Returns the SI value of a unit of this quantity; `None` for an unknown unit.
    pub fn factor(self, unit: &str) -> Option<f64> {
        match factors(unit, self.dimension())[..] {
            [factor] => Some(factor),
            _ => None,
        }
    }

    pub fn units(self) -> &'static str {
        self.facts().2
    }

    pub fn unit(self) -> &'static str {
        self.units().split(',').next().unwrap_or_default()
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.facts().1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_index_of_a_variable_is_not_read_as_a_unit() {
        for name in ["omega[1]", "torque[3]", "q[4]", "tank[1].p[1,2]", "data(3)"] {
            for quantity in Quantity::ALL {
                let found = find_unit(name, quantity.dimension());
                assert!(matches!(found, Ok(None)), "{name} is no {quantity}");
            }
        }
    }

    #[test]
    fn every_spelling_of_a_unit_is_recognised() {
        let cases: [(Quantity, f64, &[&str]); 12] = [
            (
                Torque,
                1e-3,
                &[
                    "mN.m",
                    "mN·m",
                    "mNm",
                    "mN*m",
                    "mN m",
                    "mN_m",
                    "mN-m",
                    "mnm",
                    "millinewton meters",
                ],
            ),
            (Torque, 1.0, &["Nm", "N.m", "NM", "nm", "newton-metres", "kg.m2/s2", "kg m^2 s^-2"]),
            (Torque, POUND * 0.0254, &["lbf.in", "in-lb", "inlb", "lb in", "lbf·in"]),
            (
                Rate,
                DEGREE,
                &[
                    "deg/s",
                    "°/s",
                    "dps",
                    "DPS",
                    "deg/sec",
                    "deg_s",
                    "deg per second",
                    "degrees/s",
                    "deg s-1",
                    "deg·s⁻¹",
                    "degps",
                    "deg_per_sec",
                ],
            ),
            (Rate, 1.0, &["rad/s", "rad_s", "radps", "rad s^-1", "rad/(s)", "Rad/Sec"]),
            (Rate, DEGREE / 3600.0, &["deg/h", "deg/hr", "°/h"]),
            (
                Acceleration,
                1.0,
                &["m/s²", "m/s^2", "m/s2", "m_s2", "ms-2", "mps2", "m/s/s", "m s⁻²"],
            ),
            (Acceleration, 1e-3 * GRAVITY, &["mg"]),
            (Time, 1e-6, &["us", "µs", "μs", "usec", "microseconds", "US", "micros"]),
            (Time, 1e-3, &["ms", "msec", "millis", "Milliseconds", "MS"]),
            (Time, 86_400.0, &["d", "days"]),
            (Angle, DEGREE, &["deg", "°", "degrees"]),
        ];
        for (quantity, factor, texts) in cases {
            for text in texts {
                let found = quantity.factor(text);
                assert!(
                    found.is_some_and(|f| (f / factor - 1.0).abs() < 1e-14),
                    "{text}: {found:?}"
                );
            }
        }
        assert_eq!((conversion("mN.m", "N.m"), conversion("kg", "kg")), (Some(1e-3), Some(1.0)));
        assert_eq!((conversion("deg", "rad/s"), conversion("mm", "furlong")), (None, None));
        for (quantity, text) in [
            (Rate, "deg"),
            (Torque, "MNm"),
            (Torque, "Nm/rad"),
            (Rate, "1/s"),
            (Time, ""),
            (Time, "x"),
            (Rate, "rps"),
            (Time, "ms2"),
            (Length, "min"),
            (Rate, "V"),
            (Time, "s/"),
        ] {
            assert_eq!(quantity.factor(text), None, "{text}");
        }
    }

    #[test]
    fn units_are_found_in_column_names_in_many_notations() {
        let text = |name: &str, quantity: Quantity| {
            find_unit(name, quantity.dimension()).map(|found| found.map(|s| (s.before, s.text)))
        };
        for (quantity, name, before, unit) in [
            (Rate, "gyro [deg/s]", "gyro", "deg/s"),
            (Rate, "gyro{deg/s}", "gyro", "deg/s"),
            (Rate, "Gyro (deg/s) Z", "Gyro", "deg/s"),
            (Rate, "gyro_dps", "gyro", "dps"),
            (Rate, "gyro_z_deg_s", "gyro_z", "deg_s"),
            (Rate, "gyro in deg/s", "gyro", "deg/s"),
            (Torque, "torque in N.m", "torque", "N.m"),
            (Rate, "omega_s °/s", "omega_s", "°/s"),
            (Rate, "Gyro Z, deg per sec", "Gyro Z", "deg per sec"),
            (Rate, "gyroZDegPerSec", "gyroZ", "DegPerSec"),
            (Rate, "ω / (deg/s)", "ω", "deg/s"),
            (Rate, "wheel_speed_rpm", "wheel_speed", "rpm"),
            (Torque, "torque_mNm", "torque", "mNm"),
            (Torque, "TORQUE_NM", "TORQUE", "NM"),
            (Time, "time_ms", "time", "ms"),
            (Time, "TimeUS", "Time", "US"),
            (Time, "time_boot_ms", "time_boot", "ms"),
            (Time, "time_ms_boot", "time", "ms"),
            (Time, "t/s", "t", "s"),
            (Time, "TIME_S", "TIME", "S"),
            (Time, "millis", "", "millis"),
            (Acceleration, "acc_m_s2", "acc", "m_s2"),
            (Force, "force_N", "force", "N"),
        ] {
            assert_eq!(text(name, quantity), Ok(Some((before.into(), unit.into()))), "{name}");
        }
        for (quantity, name) in [
            (Rate, "gyro_z"),
            (Rate, "omega_s"),
            (Rate, "omega_m"),
            (Torque, "T_cmd"),
            (Torque, "torque_in"),
            (Angle, "theta_min"),
            (Time, "time"),
            (Time, "timestamp"),
            (Torque, "data(3)"),
            (Torque, "tau_cmd"),
            (Force, "force_n"),
            (Rate, "gyro_raw"),
        ] {
            assert_eq!(text(name, quantity), Ok(None), "{name}");
        }
        let foreign = |text: &str| Err(Fault::Foreign(text.into()));
        for (quantity, name, fault) in [
            (Rate, "gyro_deg", foreign("deg")),
            (Rate, "gyro [deg]", foreign("deg")),
            (Rate, "gyro (furlong)", foreign("furlong")),
            (Time, "time_m", foreign("m")),
            (Torque, "torque_MNm", foreign("MNm")),
            (Torque, "torque_Nm_s", foreign("Nm_s")),
            (Time, "t_ms [s]", Err(Fault::Two("ms".into(), "s".into()))),
            (Time, "us_or_ms", Err(Fault::Two("ms".into(), "us".into()))),
        ] {
            assert_eq!(text(name, quantity), fault, "{name}");
        }
    }
}

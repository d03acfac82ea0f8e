use std::collections::{BTreeMap, BTreeSet};

use super::definitions::items;
use super::description::{Description, Variable};
use super::findings::Findings;
use host::causality::{Causality, Variability};
use host::description::Type;
use host::xml::double;

pub fn names(d: &Description, findings: &mut Findings) {
    let mut seen: BTreeMap<&str, u64> = BTreeMap::new();
    for v in &d.variables {
        let aliases = v.written.children.iter().filter(|c| c.name == "Alias");
        let aliases = aliases.map(|alias| (alias.get("name").unwrap_or_default(), alias.line));
        for (name, line) in [(v.name.as_str(), v.line)].into_iter().chain(aliases) {
            if name.is_empty() {
                findings.at(format!("line {line}")).add("the name is empty");
            } else if let Some(other) = seen.insert(name, line) {
                findings.at(format!("line {line}, {name}")).add(format!(
                    "the variable in line {other} has the same name (required: unique names)"
                ));
            }
        }
    }
}

pub fn structured_names(d: &Description, findings: &mut Findings) {
    if d.root.get("variableNamingConvention") != Some("structured") {
        return findings.skip("variableNamingConvention is not \"structured\"");
    }
    d.each(findings, |v| {
        (!is_structured(&v.name))
            .then(|| "the name is not a path like a.b[1].c, der(a.b) or a.'b c'".to_string())
    });
}

fn is_structured(name: &str) -> bool {
    if let Some(inner) = name.strip_prefix("der(").and_then(|rest| rest.strip_suffix(')')) {
        // A comma after the last bracket precedes the order of the derivative; a comma between brackets
        // separates indices.
        return match inner.rsplit_once(',') {
            Some((path, order)) if !order.contains(']') => {
                is_structured(path) && order.trim().parse::<u32>().is_ok()
            }
            _ => is_structured(inner),
        };
    }
    // an identifier, its indices, a point, and the next identifier
    let mut rest = name;
    loop {
        let end = match rest.strip_prefix('\'') {
            Some(quoted) => {
                let escaped = |at: usize| quoted[..at].ends_with('\\');
                let close = quoted.match_indices('\'').find(|(at, _)| !escaped(*at));
                close.map_or(0, |(at, _)| at + 2)
            }
            None if rest.starts_with(|c: char| c.is_ascii_digit()) => 0,
            None => {
                rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len())
            }
        };
        if end == 0 {
            return false;
        }
        rest = &rest[end..];
        if let Some(open) = rest.strip_prefix('[') {
            let Some((indices, after)) = open.split_once(']') else { return false };
            if !indices.split(',').all(|i| i.trim().parse::<u32>().is_ok()) {
                return false;
            }
            rest = after;
        }
        match rest.strip_prefix('.') {
            _ if rest.is_empty() => return true,
            Some(next) => rest = next,
            None => return false,
        }
    }
}

pub fn parameter_names(d: &Description, findings: &mut Findings) {
    const LONGEST: usize = 55;
    d.each(findings, |v| {
        let length = v.name.chars().count();
        (v.causality == Causality::Parameter && length > LONGEST)
            .then(|| format!("the name has {length} characters (allowed: {LONGEST})"))
    });
}

/// `xml.flat_ports`: a point in a name makes the variable a member of a structure. Importers that support structures
/// make one port of all members.
///
/// A name with an index is an element of an array (2.2.9). Importers show the array as a vector or as separate
/// elements; a user can connect both if no element is missing.
pub fn flat_ports(d: &Description, findings: &mut Findings) {
    let is_structured = d.root.get("variableNamingConvention") == Some("structured");
    let is_port = |v: &&Variable| matches!(v.causality, Causality::Input | Causality::Output);
    // Elements of each array by name, in the order of the variables.
    let mut arrays: BTreeMap<(&Causality, &str), Vec<Vec<u32>>> = BTreeMap::new();
    for v in d.variables.iter().filter(is_port) {
        if let Some((array, index)) = indexed(&v.name) {
            arrays.entry((&v.causality, array)).or_default().push(index);
        }
    }
    d.each(findings, |v| {
        if !is_port(&v) {
            return None;
        }
        if v.name.contains('.') {
            return Some("the name of the port has a full stop".to_string());
        }
        if !v.name.contains(['[', ']']) {
            return None;
        }
        if !is_structured {
            return Some("the name of the port has a bracket, but variableNamingConvention is not \"structured\"".to_string());
        }
        let whole = indexed(&v.name)
            .and_then(|(array, _)| arrays.get(&(&v.causality, array)))
            .is_some_and(|indices| is_whole(indices));
        (!whole).then(|| {
            "the port is an element of an array some of whose elements are missing (allowed: every index \
             from 1 to the last, each once, all inputs or all outputs)"
                .to_string()
        })
    });
}

/// Splits a name such as `array[1,2]` into the array's name and the indices.
fn indexed(name: &str) -> Option<(&str, Vec<u32>)> {
    let (array, indices) = name.strip_suffix(']')?.split_once('[')?;
    let indices: Option<Vec<u32>> = indices.split(',').map(|i| i.trim().parse().ok()).collect();
    Some((array, indices?))
}

/// Returns true if `indices` contains every index of an array exactly once.
fn is_whole(indices: &[Vec<u32>]) -> bool {
    let dimensions = indices[0].len();
    if indices.iter().any(|index| index.len() != dimensions || index.contains(&0)) {
        return false;
    }
    let last = |k: usize| indices.iter().map(|index| index[k] as usize).max().unwrap_or(0);
    let count = (0..dimensions).try_fold(1_usize, |count, k| count.checked_mul(last(k)));
    let different: BTreeSet<_> = indices.iter().collect();
    count == Some(indices.len()) && different.len() == indices.len()
}

pub fn causality(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        let (causality, variability) = (&v.causality, &v.variability);
        let is_allowed =
            |variability: &Variability| (d.words.initials)(causality, variability).is_some();
        if !is_allowed(variability) {
            let all = ["constant", "fixed", "tunable", "discrete", "continuous"];
            let allowed: Vec<_> = all.into_iter().filter(|v| is_allowed(&(*v).into())).collect();
            let allowed = allowed.join(", ");
            return Some(format!(
                "causality={causality} with variability={variability} (allowed with this causality: {allowed})"
            ));
        }
        let reals = d.words.reals;
        (v.variability == Variability::Continuous && !v.is_real())
            .then(|| format!("the variable is a continuous {} (allowed: only {reals} may be continuous)", v.typed.name))
    });
}

pub fn variability(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        (v.kind != Type::Real && v.written.get("variability").is_none()).then(|| {
            format!("variability is not written, and the schema's default, continuous, is not allowed for {}", v.typed.name)
        })
    });
}

pub fn initial(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        let written = v.written.get("initial")?;
        // Another rule reports a combination of causality and variability that is not allowed.
        let allowed = (d.words.initials)(&v.causality, &v.variability)?;
        let how = if allowed.is_empty() { "none".into() } else { allowed.join(", ") };
        (!allowed.contains(&written)).then(|| {
            format!(
                "initial={written} with causality {} and variability {} (allowed: {how})",
                v.causality, v.variability
            )
        })
    });
}

pub fn start(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        let (count, length) = (v.starts.len(), v.length());
        if v.kind == Type::Clock || (count == 0 && length == 0) {
            return None;
        }
        let initial = v.initial.as_deref();
        let why = initial.map_or(format!("causality={}", v.causality), |i| format!("initial={i}"));
        if v.causality == Causality::Independent || initial == Some("calculated") {
            return (count > 0).then(|| {
                format!("the variable has a start value and {why} (required: no start value)")
            });
        }
        let is_set = matches!(
            v.causality,
            Causality::Input | Causality::Parameter | Causality::StructuralParameter
        );
        let is_constant = v.variability == Variability::Constant;
        if count == 0 && (is_set || is_constant || matches!(initial, Some("exact" | "approx"))) {
            return Some(format!(
                "the variable has no start value, but {why} (required: a start value)"
            ));
        }
        (count > 1 && count != length).then(|| {
            format!("{count} start values (allowed: one, or {length}, one for each element)")
        })
    });
}

/// Reports start, min, max and nominal of floating-point variables that are NaN, infinite or (nominal) not
/// positive.
pub fn finite(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        let starts = v.starts.iter().filter_map(|s| Some(("start", double(s)?)));
        let others = ["min", "max", "nominal"].into_iter();
        let others = others.filter_map(|name| Some((name, v.typed.number(name)?)));
        let fits = |name: &str, x: f64| x.is_finite() && (name != "nominal" || x > 0.0);
        let (name, x) = starts.chain(others).find(|(name, x)| v.is_real() && !fits(name, *x))?;
        Some(match name {
            "nominal" => format!("nominal={x} (allowed: finite, above 0)"),
            _ => format!("{name}={x} (allowed: finite numbers)"),
        })
    });
}

pub fn range(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        let (min, max) = v.bounds();
        if min > max {
            return Some(format!("min={min} is above max={max}"));
        }
        if !matches!(v.kind, Type::Real | Type::Integer | Type::Enumeration) {
            return None;
        }
        let starts: Vec<f64> = v.starts.iter().filter_map(|s| double(s)).collect();
        if let Some(start) = starts.iter().find(|x| **x < min || **x > max) {
            return Some(format!("start={start} (allowed: {min} to {max})"));
        }
        let declared = v.typed.get("declaredType").filter(|_| v.kind == Type::Enumeration)?;
        let of = d.root.list("TypeDefinitions").find(|t| t.get("name") == Some(declared))?;
        let items: Vec<f64> = items(of).filter_map(|item| item.number("value")).collect();
        let odd = starts.iter().find(|x| !items.is_empty() && !items.contains(x))?;
        let list: Vec<_> = items.iter().map(f64::to_string).collect();
        Some(format!(
            "start={odd} is not an item of the enumeration (allowed: {})",
            list.join(", ")
        ))
    });
}

pub fn aliases(d: &Description, findings: &mut Findings) {
    // Integers and enumerations share their calls and their value references.
    let group = |v: &Variable| match v.kind {
        Type::Real => 0,
        Type::Integer | Type::Enumeration => 1,
        Type::Boolean => 2,
        // FMI 2.0 has no Binary and no Clock.
        Type::String | Type::Binary | Type::Clock => 3,
    };
    let mut sets: BTreeMap<(i32, u32), Vec<&Variable>> = BTreeMap::new();
    for v in &d.variables {
        sets.entry((group(v), v.reference)).or_default().push(v);
    }
    for set in sets.values().filter(|set| set.len() > 1) {
        let first = set[0];
        let names: Vec<_> = set.iter().map(|v| v.name.as_str()).collect();
        let place = format!("valueReference {}, {}", first.reference, names.join(" = "));
        let settable = set.iter().filter(|v| v.is_set_by_hosts()).count();
        if settable > 1 {
            findings.at(&place).add(format!("hosts can set {settable} of the variables that share this valueReference (allowed: one)"));
        }
        let started =
            set.iter().filter(|v| !v.starts.is_empty() && v.variability != Variability::Constant);
        if settable <= 1 && started.count() > 1 {
            findings.at(&place).add("several of the variables that share this valueReference have a start value (allowed: one)");
        }
        if set.iter().any(|v| v.typed.get("unit") != first.typed.get("unit")) {
            findings
                .at(&place)
                .add("the variables that share this valueReference have several units");
        }
        let constant = |v: &Variable| v.variability == Variability::Constant;
        if set.iter().any(|v| constant(v) != constant(first)) {
            findings.at(&place).add("of the variables that share this valueReference, some are constant and some are not");
        }
        if set.iter().any(|v| v.kind != first.kind) {
            findings
                .at(&place)
                .add("the variables that share this valueReference have several types");
        }
    }
}

pub fn independent(d: &Description, findings: &mut Findings) {
    let all = d.variables.iter().filter(|v| v.causality == Causality::Independent);
    let count = all.clone().count();
    if count > 1 || count == 0 && d.is_fmi3() {
        findings.at("ModelVariables").add(format!("{count} independent variables (allowed: one)"));
    }
    for v in all {
        if !v.is_real() {
            let reals = d.words.reals;
            findings
                .at(v.place())
                .add(format!("the independent variable has another type (allowed: {reals})"));
        }
        for attribute in ["initial", "start", "min", "max"] {
            if d.is_fmi3() && v.written.get(attribute).is_some() {
                findings
                    .at(v.place())
                    .add(format!("the independent variable has {attribute} (allowed: none)"));
            }
        }
    }
}

pub fn multiple_set(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        v.written.get("canHandleMultipleSetPerTimeInstant")?;
        if !d.is_fmi3() && d.interface("ModelExchange").is_none() {
            return Some("canHandleMultipleSetPerTimeInstant without ModelExchange".into());
        }
        (v.causality != Causality::Input).then(|| {
            format!(
                "canHandleMultipleSetPerTimeInstant on a variable of causality {} (allowed: input)",
                v.causality
            )
        })
    });
}

pub fn derivatives_of(d: &Description, findings: &mut Findings) {
    let states = d.states();
    d.each(findings, |v| {
        (v.typed.flag("reinit") && !states.contains(&v.key)).then(|| {
            format!(
                "reinit is true, but the variable is not a continuous state, because {} lists no derivative of it",
                d.words.derivatives
            )
        })
    });
    d.each(findings, |v| {
        let text = v.typed.get("derivative")?;
        let Some(of) = v.derivative_of().and_then(|key| d.at(key)) else {
            let allowed = match d.is_fmi3() {
                true => "the valueReference of a variable".into(),
                false => format!("1 to {}", d.variables.len()),
            };
            return Some(format!("derivative=\"{text}\" (allowed: {allowed})"));
        };
        if of.key == v.key {
            return Some("the variable is declared as its own derivative".into());
        }
        // In FMI 2.0 the rule xml.derivatives reports the type, and variables have no dimensions.
        if d.is_fmi3() && !(v.is_continuous() && of.is_continuous()) {
            return Some(format!(
                "the variable and {} must be continuous floating-point numbers",
                of.name
            ));
        }
        (v.dimensions != of.dimensions).then(|| {
            format!(
                "the variable has the dimensions {:?}, but {} has {:?} (required: equal dimensions)",
                v.dimensions, of.name, of.dimensions
            )
        })
    });
}

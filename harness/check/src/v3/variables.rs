//! Variables of modelDescription.xml (FMI 3.0.2, section 2.4): names, causality, start values, ranges.

use std::collections::{BTreeMap, BTreeSet};

use super::description::{Description, Variable, initials};
use crate::Findings;
use host::causality::{Causality, Variability};
use host::description::{CType, Type};
use host::xml::double;

/// `xml.names`
pub fn names(d: &Description, findings: &mut Findings) {
    let mut seen: BTreeMap<&str, u64> = BTreeMap::new();
    for v in &d.variables {
        let aliases = v.written.children.iter().filter(|c| c.name == "Alias");
        let aliases = aliases.map(|alias| (alias.get("name").unwrap_or_default(), alias.line));
        for (name, line) in [(v.name.as_str(), v.line)].into_iter().chain(aliases) {
            if name.is_empty() {
                findings.add(format!("line {line}"), "the name is empty");
            } else if let Some(other) = seen.insert(name, line) {
                findings.add(
                    format!("line {line}, {name}"),
                    format!("line {other} has the same name (allowed: unique over variables and aliases)"),
                );
            }
        }
    }
}

/// `xml.structured_names`
pub fn structured_names(d: &Description, findings: &mut Findings) {
    if d.root.get("variableNamingConvention") != Some("structured") {
        return findings.skip("names are not declared as structured");
    }
    d.each(findings, |v| {
        (!crate::variables::is_structured(&v.name))
            .then(|| "the name is not a path like a.b[1].c, der(a.b) or a.'b c'".to_string())
    });
}

/// `xml.references`
pub fn references(d: &Description, findings: &mut Findings) {
    let mut seen: BTreeMap<u32, &str> = BTreeMap::new();
    for v in &d.variables {
        if let Some(other) = seen.insert(v.reference, &v.name) {
            findings.add(
                v.place(),
                format!(
                    "{other} has the same valueReference, {} (allowed: one variable each; an alias is an \
                     element Alias)",
                    v.reference
                ),
            );
        }
    }
}

/// `xml.causality`
pub fn causality(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        let (causality, variability) = (&v.causality, &v.variability);
        if initials(causality, variability).is_none() {
            let all = ["constant", "fixed", "tunable", "discrete", "continuous"];
            let allowed: Vec<_> =
                all.into_iter().filter(|v| initials(causality, &(*v).into()).is_some()).collect();
            return Some(format!(
                "causality {causality} with variability {variability} (allowed: {})",
                allowed.join(", ")
            ));
        }
        (v.variability == Variability::Continuous && !v.is_float())
            .then(|| format!("a continuous {} (allowed: Float32, Float64 alone)", v.written.name))
    });
}

/// `xml.initial`
pub fn initial(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        let written = v.written.get("initial")?;
        let allowed = initials(&v.causality, &v.variability)?;
        let how = if allowed.is_empty() { "none".into() } else { allowed.join(", ") };
        (!allowed.contains(&written)).then(|| {
            format!(
                "initial={written} with causality {} and variability {} (allowed: {how})",
                v.causality, v.variability
            )
        })
    });
}

/// `xml.start`
pub fn start(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        if v.kind == Type::Clock {
            return None;
        }
        let start = !v.starts.is_empty();
        let initial = v.initial.as_deref();
        if v.causality == Causality::Independent || initial == Some("calculated") {
            return start.then(|| {
                let why = initial.map_or("independent".into(), |i| format!("initial={i}"));
                format!("a start value with {why} (allowed: none)")
            });
        }
        let needed = matches!(
            v.causality,
            Causality::Input | Causality::Parameter | Causality::StructuralParameter
        ) || v.variability == Variability::Constant
            || matches!(initial, Some("exact" | "approx"));
        // an array of no elements has no values
        if needed && !start && v.length() > 0 {
            let why = initial.map_or(v.causality.to_string(), |i| format!("initial={i}"));
            return Some(format!("no start value with {why}"));
        }
        let (count, length) = (v.starts.len(), v.length());
        (count > 1 && count != length).then(|| {
            format!("{count} start values (allowed: one, or {length}, one for each element)")
        })
    });
}

/// `xml.finite`
pub fn finite(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        if !v.is_float() {
            return None;
        }
        let starts = v.starts.iter().filter_map(|s| Some(("start", double(s)?)));
        let others = ["min", "max", "nominal"].into_iter();
        let others = others.filter_map(|name| Some((name, v.element.number(name)?)));
        let mut all = starts.chain(others);
        let fits = |name: &str, x: f64| x.is_finite() && (name != "nominal" || x > 0.0);
        let (name, x) = all.find(|(name, x)| !fits(name, *x))?;
        Some(match name {
            "nominal" => format!("nominal={x} (allowed: finite, above 0)"),
            _ => format!("{name}={x} (allowed: finite numbers)"),
        })
    });
}

/// `xml.range`
pub fn range(d: &Description, findings: &mut Findings) {
    let items = |name: &str| -> Vec<f64> {
        let of = d.root.list("TypeDefinitions").find(|t| t.get("name") == Some(name));
        let items = of.into_iter().flat_map(|t| &t.children).filter(|c| c.name == "Item");
        items.filter_map(|item| item.number("value")).collect()
    };
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
        if v.kind == Type::Enumeration {
            let items = v.element.get("declaredType").map(items).unwrap_or_default();
            let list: Vec<_> = items.iter().map(f64::to_string).collect();
            let odd = starts.iter().find(|x| !items.is_empty() && !items.contains(x))?;
            return Some(format!("start={odd} is not an item (allowed: {})", list.join(", ")));
        }
        None
    });
}

/// `xml.independent`
pub fn independent(d: &Description, findings: &mut Findings) {
    let all: Vec<_> =
        d.variables.iter().filter(|v| v.causality == Causality::Independent).collect();
    if all.len() != 1 {
        findings
            .add("ModelVariables", format!("{} independent variables (allowed: one)", all.len()));
    }
    for v in all {
        if !v.is_float() {
            findings.add(v.place(), "the independent variable is not a Float64 or Float32");
        }
        for attribute in ["initial", "start", "min", "max"] {
            if v.written.get(attribute).is_some() {
                findings.add(
                    v.place(),
                    format!("the independent variable has {attribute} (allowed: none)"),
                );
            }
        }
    }
}

/// `xml.flags`
pub fn flags(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        if v.written.get("canHandleMultipleSetPerTimeInstant").is_some()
            && v.causality != Causality::Input
        {
            return Some(format!(
                "canHandleMultipleSetPerTimeInstant of causality {}",
                v.causality
            ));
        }
        (v.written.flag("intermediateUpdate") && v.variability != Variability::Continuous).then(
            || {
                format!(
                    "intermediateUpdate with variability {} (allowed: continuous)",
                    v.variability
                )
            },
        )
    });
}

/// `xml.clocks`
pub fn clocks(d: &Description, findings: &mut Findings) {
    let mut previous = BTreeMap::new();
    for v in &d.variables {
        let clocks = v.written.get("clocks");
        if let Some(clocks) = clocks {
            let list: Vec<Option<&Variable>> =
                clocks.split_whitespace().map(|r| d.at(r.parse().ok()?)).collect();
            if list.is_empty() || list.iter().any(|c| c.is_none_or(|c| c.kind != Type::Clock)) {
                findings.add(
                    v.place(),
                    format!("clocks=\"{clocks}\" (allowed: value references of clocks)"),
                );
            }
            if !matches!(v.variability, Variability::Discrete | Variability::Tunable) {
                findings.add(
                    v.place(),
                    format!(
                        "clocks with variability {} (allowed: discrete, tunable)",
                        v.variability
                    ),
                );
            }
        }
        let Some(text) = v.written.get("previous") else { continue };
        let of = text.trim().parse().ok().and_then(|r| d.at(r));
        let fits = of.is_some_and(|of| {
            of.reference != v.reference
                && of.kind == v.kind
                && of.variability == Variability::Discrete
                && of.causality != Causality::Input
        });
        if !fits {
            findings.add(
                v.place(),
                format!(
                    "previous=\"{text}\" (allowed: another discrete variable of the same type that is no \
                     input)"
                ),
            );
        }
        if clocks.is_none() || v.variability != Variability::Discrete {
            findings.add(v.place(), "previous of a variable that is not clocked and discrete");
        }
        if let Some(other) = previous.insert(text.trim(), &v.name) {
            findings.add(v.place(), format!("{other} has the same previous"));
        }
    }
}

/// `xml.dimensions`
pub fn dimensions(d: &Description, findings: &mut Findings) {
    for v in &d.variables {
        for dimension in v.written.children.iter().filter(|c| c.name == "Dimension") {
            let place = format!("line {}, Dimension of {}", dimension.line, v.name);
            match (dimension.get("start"), dimension.get("valueReference")) {
                (Some(_), Some(_)) => {
                    findings.add(place, "start and valueReference (allowed: one of them)");
                }
                (None, None) => {
                    findings.add(place, "neither start nor valueReference (allowed: one of them)");
                }
                (Some(start), None) if start.trim() == "0" => {
                    findings.add(place, "start=0 (allowed: above 0)");
                }
                (Some(_), None) => {}
                (None, Some(reference)) => {
                    let of = reference.trim().parse().ok().and_then(|r| d.at(r));
                    let fits = of.is_some_and(|of| {
                        of.c_type == CType::UInt64
                            && (of.causality == Causality::StructuralParameter
                                || of.variability == Variability::Constant)
                    });
                    if !fits {
                        findings.add(
                            place,
                            format!(
                                "valueReference={reference} (allowed: a structural parameter or a constant, of \
                                 type UInt64)"
                            ),
                        );
                    } else if of.is_some_and(|of| of.starts.first().is_none_or(|s| s == "0")) {
                        findings.add(
                            place,
                            format!("valueReference={reference} has no start above 0 (required)"),
                        );
                    }
                }
            }
        }
    }
}

/// `xml.derivatives_of`
pub fn derivatives_of(d: &Description, findings: &mut Findings) {
    let states: BTreeSet<u32> = d.states().into_iter().collect();
    d.each(findings, |v| {
        if v.written.flag("reinit") && !states.contains(&v.reference) {
            return Some("reinit, but it is not a continuous state".to_string());
        }
        let text = v.written.get("derivative")?;
        let Some(of) = v.derivative_of().and_then(|r| d.at(r)) else {
            return Some(format!(
                "derivative=\"{text}\" (allowed: the valueReference of a variable)"
            ));
        };
        if of.reference == v.reference {
            return Some("it is its own derivative".into());
        }
        if !(v.is_continuous() && of.is_continuous()) {
            return Some(format!("it and {} must be continuous floating-point numbers", of.name));
        }
        (v.dimensions != of.dimensions).then(|| {
            format!(
                "its dimensions are {:?}, those of {} {:?}",
                v.dimensions, of.name, of.dimensions
            )
        })
    });
}

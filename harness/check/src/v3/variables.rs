use std::collections::{BTreeMap, BTreeSet};

use super::definitions::items;
use super::description::{Description, Variable, initials};
use crate::findings::Findings;
use crate::variables::{
    not_finite, out_of_range, unstructured, wrong_causality, wrong_initial, wrong_start,
};
use host::causality::{Causality, Variability};
use host::description::{CType, Type};
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
                    "line {other} has the same name (allowed: unique over variables and aliases)"
                ));
            }
        }
    }
}

pub fn structured_names(d: &Description, findings: &mut Findings) {
    unstructured(&d.root, &d.variables, findings);
}

pub fn references(d: &Description, findings: &mut Findings) {
    let mut seen: BTreeMap<u32, &str> = BTreeMap::new();
    for v in &d.variables {
        if let Some(other) = seen.insert(v.reference, &v.name) {
            findings.at(v.place()).add(format!(
                    "{other} has the same valueReference, {} (allowed: one variable each; an alias is an \
                     element Alias)",
                    v.reference
                ));
        }
    }
}

pub fn causality(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| wrong_causality(v, initials, "Float32, Float64"));
}

pub fn initial(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| wrong_initial(v, initials));
}

pub fn start(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        let (count, length) = (v.starts.len(), v.length());
        // An array without elements has no start values.
        if v.kind == Type::Clock || (count == 0 && length == 0) {
            return None;
        }
        let is_required = matches!(
            v.causality,
            Causality::Input | Causality::Parameter | Causality::StructuralParameter
        );
        wrong_start(v, count > 0, is_required).or_else(|| {
            (count > 1 && count != length).then(|| {
                format!("{count} start values (allowed: one, or {length}, one for each element)")
            })
        })
    });
}

pub fn finite(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| not_finite(v, v.starts.iter().filter_map(|s| double(s))));
}

pub fn range(d: &Description, findings: &mut Findings) {
    d.each(findings, |v| {
        let starts: Vec<f64> = v.starts.iter().filter_map(|s| double(s)).collect();
        out_of_range(v, &starts, &d.root, items)
    });
}

pub fn independent(d: &Description, findings: &mut Findings) {
    let all: Vec<_> =
        d.variables.iter().filter(|v| v.causality == Causality::Independent).collect();
    if all.len() != 1 {
        findings
            .at("ModelVariables")
            .add(format!("{} independent variables (allowed: one)", all.len()));
    }
    for v in all {
        if !v.is_real() {
            findings.at(v.place()).add("the independent variable is not a Float64 or Float32");
        }
        for attribute in ["initial", "start", "min", "max"] {
            if v.written.get(attribute).is_some() {
                findings
                    .at(v.place())
                    .add(format!("the independent variable has {attribute} (allowed: none)"));
            }
        }
    }
}

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

pub fn clocks(d: &Description, findings: &mut Findings) {
    let mut previous = BTreeMap::new();
    for v in &d.variables {
        let clocks = v.written.get("clocks");
        if let Some(clocks) = clocks {
            let list: Vec<Option<&Variable>> =
                clocks.split_whitespace().map(|r| d.at(r.parse().ok()?)).collect();
            if list.is_empty() || list.iter().any(|c| c.is_none_or(|c| c.kind != Type::Clock)) {
                findings
                    .at(v.place())
                    .add(format!("clocks=\"{clocks}\" (allowed: value references of clocks)"));
            }
            if !matches!(v.variability, Variability::Discrete | Variability::Tunable) {
                findings.at(v.place()).add(format!(
                    "clocks with variability {} (allowed: discrete, tunable)",
                    v.variability
                ));
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
            findings.at(v.place()).add(format!(
                    "previous=\"{text}\" (allowed: another discrete variable of the same type that is no \
                     input)"
                ));
        }
        if clocks.is_none() || v.variability != Variability::Discrete {
            findings.at(v.place()).add("previous of a variable that is not clocked and discrete");
        }
        if let Some(other) = previous.insert(text.trim(), &v.name) {
            findings.at(v.place()).add(format!("{other} has the same previous"));
        }
    }
}

pub fn dimensions(d: &Description, findings: &mut Findings) {
    for v in &d.variables {
        for dimension in v.written.children.iter().filter(|c| c.name == "Dimension") {
            let place = format!("line {}, Dimension of {}", dimension.line, v.name);
            match (dimension.get("start"), dimension.get("valueReference")) {
                (Some(_), Some(_)) => {
                    findings.at(place).add("start and valueReference (allowed: one of them)");
                }
                (None, None) => {
                    findings
                        .at(place)
                        .add("neither start nor valueReference (allowed: one of them)");
                }
                (Some(start), None) if start.trim() == "0" => {
                    findings.at(place).add("start=0 (allowed: above 0)");
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
                        findings.at(place).add(format!(
                                "valueReference={reference} (allowed: a structural parameter or a constant, of \
                                 type UInt64)"
                            ));
                    } else if of.is_some_and(|of| of.starts.first().is_none_or(|s| s == "0")) {
                        findings.at(place).add(format!(
                            "valueReference={reference} has no start above 0 (required)"
                        ));
                    }
                }
            }
        }
    }
}

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

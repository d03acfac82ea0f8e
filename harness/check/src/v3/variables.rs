//! Rules about variables that only FMI 3.0 has (FMI 3.0.2, section 2.4.7).

use std::collections::BTreeMap;

use crate::description::{Description, Variable};
use crate::findings::Findings;
use crate::variables::multiple_set;
use host::causality::{Causality, Variability};
use host::description::{CType, Type};

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

pub fn flags(d: &Description, findings: &mut Findings) {
    multiple_set(d, findings);
    d.each(findings, |v| {
        (v.written.flag("intermediateUpdate") && v.variability != Variability::Continuous).then(
            || {
                format!(
                    "intermediateUpdate is true on a variable of variability {} (allowed: continuous)",
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
                    "the attribute clocks on a variable of variability {} (allowed: discrete, tunable)",
                    v.variability
                ));
            }
        }
        let Some(text) = v.written.get("previous") else { continue };
        let of = text.trim().parse().ok().and_then(|r| d.at(r));
        let fits = of.is_some_and(|of| {
            of.key != v.key
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
            findings
                .at(v.place())
                .add("the attribute previous on a variable that is not clocked and discrete");
        }
        if let Some(other) = previous.insert(text.trim(), &v.name) {
            findings.at(v.place()).add(format!("{other} refers to the same variable by its attribute previous (allowed: one reference to each)"));
        }
    }
}

pub fn dimensions(d: &Description, findings: &mut Findings) {
    for v in &d.variables {
        for dimension in v.written.children.iter().filter(|c| c.name == "Dimension") {
            let place = format!("line {}, Dimension of {}", dimension.line, v.name);
            match (dimension.get("start"), dimension.get("valueReference")) {
                (Some(_), Some(_)) => {
                    findings.at(place).add("the dimension has both start and valueReference (required: exactly one of them)");
                }
                (None, None) => {
                    findings
                        .at(place)
                        .add("the dimension has neither start nor valueReference (required: exactly one of them)");
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

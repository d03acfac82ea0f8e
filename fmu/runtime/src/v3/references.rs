//! Value references of FMI 3.0: their types, and the variables that follow those of the table.

use crate::call::CType;
use crate::model::Model;
use crate::table::Scalar;
use crate::variable::{Causality, Kind, Variable};

#[inline]
pub(super) fn scalar_reference<M: Model>(scalar: &Scalar<M>) -> u32 {
    scalar.index + 1
}

#[inline]
pub(crate) fn type_of<M: Model>(scalar: &Scalar<M>) -> CType {
    match scalar.c_type {
        CType::Integer if matches!(scalar.variable.kind, Kind::Enumeration(_)) => {
            CType::Enumeration
        }
        other => other,
    }
}

pub(super) fn type_name(c_type: CType) -> &'static str {
    match c_type {
        CType::Real => "Float64",
        CType::Integer => "Int32",
        CType::Enumeration => "Enumeration (Int64)",
        CType::Size => "UInt64",
        CType::Boolean => "Boolean",
        CType::String => "String",
    }
}

#[cold]
pub(super) fn wrong_reference<M: Model>(
    reference: u32,
    found: Option<&Scalar<M>>,
    wanted: Option<CType>,
) -> String {
    match found {
        Some(scalar) => {
            let is = type_name(type_of(scalar));
            format!("{} (value reference {reference}) is of type {is}", scalar.name())
        }
        None if extra_variable::<M>(reference).is_some() => {
            let name = extra_name::<M>(reference).unwrap_or_default();
            match wanted {
                Some(CType::Real) => {
                    format!("{name} (value reference {reference}) can only be read")
                }
                _ => format!("{name} (value reference {reference}) is of type Float64"),
            }
        }
        None => format!(
            "no variable has the value reference {reference} (allowed: 1 to {})",
            M::table().scalars.len() + 1 + M::table().about.event_indicators
        ),
    }
}

/// A variable of FMI 3.0 that is not in the table of variables: the time or an event indicator.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum Extra {
    Time,
    Indicator(usize),
}

#[inline]
pub(super) fn extra_variable<M: Model>(reference: u32) -> Option<Extra> {
    let beyond = (reference as usize).checked_sub(M::table().scalars.len() + 1)?;
    match beyond.checked_sub(1) {
        None => Some(Extra::Time),
        Some(n) => (n < M::table().about.event_indicators).then_some(Extra::Indicator(n)),
    }
}

/// Returns the names of the variables that are not in the table (time and event indicators) in the order
/// of their value references.
pub fn extra_names<M: Model>() -> Vec<String> {
    let indicators = 1..=M::table().about.event_indicators;
    let indicators = indicators.map(|n| format!("event_indicator[{n}]"));
    std::iter::once("time".to_string()).chain(indicators).collect()
}

/// Returns the value reference of the independent variable, the time. The event indicators have the value references after
/// it.
pub fn time_reference<M: Model>() -> u32 {
    M::table().scalars.len() as u32 + 1
}

fn extra_name<M: Model>(reference: u32) -> Option<String> {
    let place = reference.checked_sub(time_reference::<M>())?;
    extra_names::<M>().into_iter().nth(place as usize)
}

/// Returns true if hosts may read or set this variable within a step. Inputs that other inputs determine are excluded,
/// because they have no value of their own at the end of the step.
pub fn has_intermediate_update<M: Model>(variable: &Variable<M>) -> bool {
    matches!(variable.causality, Causality::Input | Causality::Output)
        && variable.c_type() == CType::Real
        && !variable.follows_inputs
}

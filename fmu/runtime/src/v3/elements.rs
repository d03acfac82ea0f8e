//! Translation of the host's value references to scalars of the table, with a check that a call has as
//! many values as scalars.

use std::borrow::Cow;

use super::arrays::{self, Arrays};
use super::calls::Fmi3;
use super::references::type_name;
use super::types::*;
use crate::c_abi::Component;
use crate::call::{Call, Fault};
use crate::model::Model;
use crate::variable::{Dimension, Value};

/// Checks that the host passes one value for each value reference, as it must if every variable is a scalar.
#[inline]
pub(super) fn check_count(call: &Call, references: usize, values: usize) -> Result<(), Fault> {
    if references == values {
        return Ok(());
    }
    Err(call.error(format_args!(
        "nValues = {values} (allowed: {references}, one for each value reference)"
    )))
}

pub(super) fn check_numbers(
    call: &Call,
    name: &str,
    given: usize,
    expected: usize,
) -> Result<(), Fault> {
    if given == expected {
        return Ok(());
    }
    Err(call.error(format_args!("{name} = {given} (allowed: {expected})")))
}

pub(super) fn scalars_of<'a, M: Model>(
    component: &Component<M, Fmi3>,
    call: &Call,
    references: &'a [fmi3ValueReference],
) -> Result<Cow<'a, [u32]>, Fault> {
    match &component.host.arrays {
        None => Ok(Cow::Borrowed(references)),
        Some(arrays) => expand::<M>(arrays, call, references).map(Cow::Owned),
    }
}

/// Returns the value references of all scalars of the array variables `references`.
///
/// # Errors
/// If the type of a variable is not the C type of the call.
pub(super) fn expand<M: Model>(
    arrays: &Arrays,
    call: &Call,
    references: &[fmi3ValueReference],
) -> Result<Vec<u32>, Fault> {
    let mut scalars = Vec::with_capacity(references.len());
    for reference in references {
        match arrays.scalars(*reference) {
            Some(all) if call.c_type.is_none_or(|t| t == arrays.c_type(*reference)) => {
                scalars.extend_from_slice(all);
            }
            _ => return Err(call.error(wrong_variable::<M>(arrays, *reference))),
        }
    }
    Ok(scalars)
}

#[cold]
pub(super) fn wrong_variable<M: Model>(arrays: &Arrays, reference: u32) -> String {
    match arrays::name::<M>(reference) {
        Some(name) => {
            let is = type_name(arrays.c_type(reference));
            format!("{name} (value reference {reference}) is of type {is}")
        }
        None => format!(
            "no variable has the value reference {reference} (allowed: 1 to {})",
            arrays.len()
        ),
    }
}

pub(super) fn check_elements<M: Model>(
    component: &Component<M, Fmi3>,
    call: &Call,
    references: &[fmi3ValueReference],
    expected: usize,
    values: usize,
) -> Result<(), Fault> {
    if values == expected {
        return Ok(());
    }
    const NAMED: usize = 4;
    let mut shapes: Vec<_> = references
        .iter()
        .take(NAMED)
        .map(|reference| arrays::shape::<M>(*reference, &component.instance.parameters))
        .collect();
    if references.len() > NAMED {
        shapes.push("…".into());
    }
    Err(call.error(format_args!(
        "nValues = {values} (allowed: {expected}, by rows: {})",
        shapes.join(", ")
    )))
}

pub(super) fn resize<M: Model>(component: &mut Component<M, Fmi3>) {
    let Component { instance, host, .. } = component;
    if let Some(arrays) = &mut host.arrays {
        **arrays = Arrays::new::<M>(&instance.parameters);
        let all = host.required_variables.iter().filter_map(|reference| arrays.scalars(*reference));
        host.required = all.flatten().copied().collect();
        host.set = Vec::with_capacity(host.required.len());
    }
}

/// If `call` has changed the sizes of arrays, sets all elements of these arrays to their start values. `scalars` are the
/// structural parameters that the call has set, and `before` are the values that all parameters had before the call. If the
/// host had set other values in these arrays, a warning in its log says that they are lost.
pub(super) fn start_resized<M: Model>(
    component: &mut Component<M, Fmi3>,
    call: &Call,
    scalars: &[u32],
    before: &[Value],
) {
    let after = &component.instance.parameters;
    let changed: Vec<_> = scalars
        .iter()
        .filter_map(|reference| M::table().scalars.get(*reference as usize - 1))
        .filter(|scalar| before.get(scalar.slot) != after.get(scalar.slot))
        .map(|scalar| scalar.variable.name)
        .collect();
    let is_resized = |d: &Dimension| matches!(d, Dimension::Sized(by, _) if changed.contains(by));
    let lost = component.instance.restart(|variable| variable.shape.iter().any(is_resized));
    resize(component);
    if !lost.is_empty() {
        component.log.report_effect(call, || {
            let names: Vec<_> = lost.iter().map(|variable| variable.array_name()).collect();
            let sizes = changed.join(", ");
            format!(
                "{sizes} changed: the values set earlier for {} are lost. Set them again",
                names.join(", ")
            )
        });
    }
}

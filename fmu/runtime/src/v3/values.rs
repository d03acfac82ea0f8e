//! Reading and setting variables by type, also within steps. There are no values for clocks and binary variables.

#![allow(unsafe_code)]

use super::calls::*;
use super::elements::{check_count, check_elements, scalars_of, start_resized, wrong_variable};
use super::host::Phase;
use super::references::{Extra, extra_variable, wrong_reference};
use super::types::*;
use crate::c_abi::{Component, array, array_mut, perform_if_allowed};
use crate::call::{CType, Call, Fault, InstanceState};
use crate::model::Model;
use crate::table::Scalar;
use crate::variable::{Access, Value};
use crate::version::Version;

#[inline]
pub(super) unsafe fn get<M: Model, T>(
    instance: fmi3Instance,
    call: &'static Call,
    (references, count): References,
    (values, value_count): (*mut T, usize),
    as_c: impl Fn(Value) -> Option<T>,
) -> fmi3Status {
    unsafe {
        perform_if_allowed::<M, Fmi3>(instance, call, |component| {
            let references = array(call, "valueReferences", references, count)?;
            if component.host.arrays.is_some() {
                let found = array_values(component, call, references, value_count)?;
                let places = array_mut(call, "values", values, value_count)?;
                for (value, place) in found.into_iter().zip(places) {
                    *place = as_c(value).ok_or_else(|| call.error("wrong type"))?;
                }
                return Ok(());
            }
            check_count(call, count, value_count)?;
            let places = array_mut(call, "values", values, value_count)?;
            for (reference, place) in references.iter().zip(places) {
                let value = as_c(value(component, call, *reference)?);
                *place = value.ok_or_else(|| call.error("wrong type"))?;
            }
            Ok(())
        })
    }
}

#[cold]
fn array_values<M: Model>(
    component: &mut Component<M, Fmi3>,
    call: &Call,
    references: &[fmi3ValueReference],
    count: usize,
) -> Result<Vec<Value>, Fault> {
    let scalars = scalars_of(component, call, references)?;
    check_elements(component, call, references, scalars.len(), count)?;
    let call = if call.c_type == Some(CType::Size) { &GET_SIZE } else { call };
    scalars.iter().map(|reference| value(component, call, *reference)).collect()
}

#[inline(always)]
fn value<M: Model>(
    component: &mut Component<M, Fmi3>,
    call: &Call,
    reference: u32,
) -> Result<Value, Fault> {
    if reference as usize > M::table().scalars.len() {
        return extra_value(component, call, reference);
    }
    if component.instance.state() == InstanceState::Intermediate {
        check_intermediate(component, call, reference, Phase::Get)?;
    }
    component.instance.value(call, reference)
}

#[cold]
fn extra_value<M: Model>(
    component: &mut Component<M, Fmi3>,
    call: &Call,
    reference: u32,
) -> Result<Value, Fault> {
    let Component { instance, host, .. } = component;
    match extra_variable::<M>(reference).filter(|_| call.c_type == Some(CType::Real)) {
        Some(Extra::Time) => Ok(Value::Real(instance.time())),
        Some(Extra::Indicator(n)) => {
            instance.indicators_for(call, &mut host.indicators)?;
            Ok(Value::Real(host.indicators[n]))
        }
        None => Err(call.error(wrong_reference::<M>(reference, None, call.c_type))),
    }
}

/// Checks that the host may get or set the variable `reference` within a step. The host must have declared it at
/// instantiation (requiredIntermediateVariables), and the present phase of the intermediate update must be `phase`.
#[cold]
pub(super) fn check_intermediate<M: Model>(
    component: &Component<M, Fmi3>,
    call: &Call,
    reference: u32,
    phase: Phase,
) -> Result<(), Fault> {
    let host = &component.host;
    if host.phase != phase {
        let (now, then) = match host.phase {
            Phase::Set => ("set", "intermediateVariableSetRequested"),
            Phase::Get => ("got", "intermediateVariableGetAllowed"),
        };
        return Err(call.error(format_args!(
            "variables can only be {now} in this intermediate update, because only {then} is true"
        )));
    }
    let name = || Fmi3::scalar::<M>(reference, call.c_type).map_or_else(|why| why, Scalar::name);
    if !host.required.contains(&reference) {
        return Err(call.error(format_args!(
            "{} is not among the requiredIntermediateVariables of this instance",
            name()
        )));
    }
    Ok(())
}

#[inline]
pub(super) unsafe fn set<M: Model, T: Copy>(
    instance: fmi3Instance,
    call: &'static Call,
    (references, count): References,
    (values, value_count): (*const T, usize),
    from_c: impl Fn(T) -> Value,
) -> fmi3Status {
    unsafe {
        perform_if_allowed::<M, Fmi3>(instance, call, |component| {
            let references = array(call, "valueReferences", references, count)?;
            if component.host.arrays.is_some() {
                let values = array(call, "values", values, value_count)?;
                let values: Vec<_> = values.iter().map(|value| from_c(*value)).collect();
                return set_arrays(component, call, references, &values);
            }
            check_count(call, count, value_count)?;
            let values = array(call, "values", values, value_count)?;
            if component.instance.state() == InstanceState::Intermediate {
                return set_ends(component, call, references, |n| from_c(values[n]));
            }
            component.instance.set(call, references, |n| from_c(values[n]))
        })
    }
}

#[cold]
fn set_arrays<M: Model>(
    component: &mut Component<M, Fmi3>,
    call: &'static Call,
    references: &[fmi3ValueReference],
    values: &[Value],
) -> Result<(), Fault> {
    let scalars = scalars_of(component, call, references)?;
    check_elements(component, call, references, scalars.len(), values.len())?;
    let value = |n: usize| values[n];
    if component.instance.state() == InstanceState::Intermediate {
        return set_ends(component, call, &scalars, value);
    }
    let before = (call.c_type == Some(CType::Size)).then(|| component.instance.parameters.clone());
    let call = if before.is_some() { &SET_SIZE } else { call };
    component.instance.set(call, &scalars, value)?;
    if let Some(before) = before {
        start_resized(component, call, &scalars, &before);
    }
    Ok(())
}

/// Sets inputs during the intermediate update at the start of a step. Input number n of `references` then changes linearly,
/// and reaches `value(n)` at the end of the step.
#[cold]
fn set_ends<M: Model>(
    component: &mut Component<M, Fmi3>,
    call: &Call,
    references: &[fmi3ValueReference],
    value: impl Fn(usize) -> Value,
) -> Result<(), Fault> {
    for (n, reference) in references.iter().enumerate() {
        let scalar = Fmi3::scalar::<M>(*reference, call.c_type).map_err(|why| call.error(why))?;
        check_intermediate(component, call, *reference, Phase::Set)?;
        if !matches!(scalar.access, Access::Input(_)) {
            let name = scalar.name();
            return Err(call.error(format_args!("{name} is computed; only inputs can be set")));
        }
        if let Some(problem) = scalar.problem(value(n)) {
            return Err(call.discard(problem));
        }
    }
    let host = &mut component.host;
    for (n, reference) in references.iter().enumerate() {
        let scalar = Fmi3::scalar::<M>(*reference, call.c_type).map_err(|why| call.error(why))?;
        if let (Access::Input(ramp), Value::Real(x)) = (scalar.access, value(n)) {
            *ramp(&mut host.ends, scalar.element)[0] = x;
        }
        if !host.set.contains(reference) {
            host.set.push(*reference);
        }
    }
    Ok(())
}

/// Checks the arguments of a getter or setter for a type that no variable has. The call is allowed without value references,
/// and otherwise fails.
fn check_no_variable<M: Model>(
    component: &Component<M, Fmi3>,
    call: &Call,
    references: &[fmi3ValueReference],
    value_count: usize,
) -> Result<(), Fault> {
    match references.first() {
        Some(reference) => Err(call.error(match &component.host.arrays {
            Some(arrays) => wrong_variable::<M>(arrays, *reference),
            None => {
                let scalar = M::table().scalars.get(reference.wrapping_sub(1) as usize);
                wrong_reference::<M>(*reference, scalar, call.c_type)
            }
        })),
        None => check_count(call, 0, value_count),
    }
}

pub(super) unsafe fn access_no_variable<M: Model>(
    instance: fmi3Instance,
    call: &'static Call,
    (references, count): References,
    value_count: usize,
) -> fmi3Status {
    unsafe {
        perform_if_allowed::<M, Fmi3>(instance, call, |component| {
            let references = array(call, "valueReferences", references, count)?;
            check_no_variable(component, call, references, value_count)
        })
    }
}

pub(super) unsafe fn get_sizes<M: Model>(
    instance: fmi3Instance,
    (references, count): References,
    (values, value_count): (*mut fmi3UInt64, usize),
) -> fmi3Status {
    let call = &GET_UINT64;
    unsafe {
        perform_if_allowed::<M, Fmi3>(instance, call, |component| {
            let references = array(call, "valueReferences", references, count)?;
            if component.host.arrays.is_none() {
                return check_no_variable(component, call, references, value_count);
            }
            let found = array_values(component, call, references, value_count)?;
            let places = array_mut(call, "values", values, value_count)?;
            for (value, place) in found.into_iter().zip(places) {
                *place = match value {
                    Value::Integer(n) => u64::try_from(n).unwrap_or(0),
                    _ => return Err(call.error("wrong type")),
                };
            }
            Ok(())
        })
    }
}

pub(super) unsafe fn set_sizes<M: Model>(
    instance: fmi3Instance,
    (references, count): References,
    (values, value_count): (*const fmi3UInt64, usize),
) -> fmi3Status {
    let call = &SET_UINT64;
    unsafe {
        perform_if_allowed::<M, Fmi3>(instance, call, |component| {
            let references = array(call, "valueReferences", references, count)?;
            if component.host.arrays.is_none() {
                return check_no_variable(component, call, references, value_count);
            }
            // A value above the largest i32 is also above the largest size.
            let size = |n: &u64| Value::Integer(i32::try_from(*n).unwrap_or(i32::MAX));
            let values = array(call, "values", values, value_count)?;
            let values: Vec<_> = values.iter().map(size).collect();
            set_arrays(component, call, references, &values)
        })
    }
}

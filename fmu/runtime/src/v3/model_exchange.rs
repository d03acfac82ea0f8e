#![allow(unsafe_code)]

use super::calls::*;
use super::elements::check_numbers;
use super::types::*;
use crate::c_abi::{Component, array, array_mut, perform_if_allowed, place};
use crate::call::{Call, Fault};
use crate::instance::Instance;
use crate::model::Model;
use crate::version::Version;

pub(super) unsafe fn set_states<M: Model>(
    instance: fmi3Instance,
    (states, count): (*const fmi3Float64, usize),
) -> fmi3Status {
    let call = Fmi3::SET_CONTINUOUS_STATES;
    unsafe {
        perform_if_allowed::<M, Fmi3>(instance, call, |component| {
            let states = array(call, "continuousStates", states, count)?;
            let Component { instance, host, .. } = component;
            let Some(arrays) = &host.arrays else { return instance.set_continuous_states(states) };
            check_numbers(call, "nx", states.len(), arrays.states().len())?;
            let mut all = vec![0.0; M::table().derivatives().len()];
            instance.continuous_states(&mut all)?;
            for (place, x) in arrays.states().iter().zip(states) {
                all[*place] = *x;
            }
            instance.set_continuous_states(&all)
        })
    }
}

/// Fills an array of the host with one value for each continuous state that exists with the present array sizes. `body`
/// writes the values of all states that exist with the largest sizes, from which the present ones are selected. The host
/// passes the array as the argument `name`.
pub(super) unsafe fn fill_states<M: Model>(
    instance: fmi3Instance,
    call: &'static Call,
    (name, pointer, length): (&str, *mut fmi3Float64, usize),
    body: impl FnOnce(&mut Instance<M, Fmi3>, &mut [fmi3Float64]) -> Result<(), Fault>,
) -> fmi3Status {
    unsafe {
        perform_if_allowed::<M, Fmi3>(instance, call, |component| {
            let room = array_mut(call, name, pointer, length)?;
            let Component { instance, host, .. } = component;
            let Some(arrays) = &host.arrays else { return body(instance, room) };
            check_numbers(call, "nx", room.len(), arrays.states().len())?;
            let mut all = vec![0.0; M::table().derivatives().len()];
            body(instance, &mut all)?;
            for (place, x) in arrays.states().iter().zip(room) {
                *x = all[*place];
            }
            Ok(())
        })
    }
}

pub(super) unsafe fn write_count<M: Model>(
    instance: fmi3Instance,
    call: &'static Call,
    (name, pointer): (&str, *mut usize),
    count: impl FnOnce(&mut Component<M, Fmi3>) -> Result<usize, Fault>,
) -> fmi3Status {
    unsafe {
        perform_if_allowed::<M, Fmi3>(instance, call, |component| {
            let place = place(call, name, pointer)?;
            *place = count(component)?;
            Ok(())
        })
    }
}

pub(super) fn state_count<M: Model>(component: &Component<M, Fmi3>) -> usize {
    match (&component.host.arrays, &component.instance.extent) {
        (Some(arrays), _) => arrays.states().len(),
        (None, Some(extent)) => extent.places().len(),
        (None, None) => M::table().derivatives().len(),
    }
}

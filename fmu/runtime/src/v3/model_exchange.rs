//! Model Exchange: continuous states, their derivatives, and event indicators.

// The standard documents these names.
#![allow(missing_docs)]
#![allow(unsafe_code)]

use super::calls::*;
use super::elements::check_numbers;
use super::types::*;
use crate::c_abi::{Component, array, array_mut, on, on_allowed, place};
use crate::call::{Call, Fault};
use crate::instance::Instance;
use crate::model::Model;
use crate::version::Version;

pub unsafe fn fmi3EnterContinuousTimeMode<M: Model>(instance: fmi3Instance) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, Fmi3::ENTER_CONTINUOUS_TIME, |component| {
            component.instance.enter_continuous_time_mode()
        })
    }
}

/// Accepts a step of the host's integrator. The FMU keeps no past, so `noSetFMUStatePriorToCurrentPoint` has
/// no effect.
pub unsafe fn fmi3CompletedIntegratorStep<M: Model>(
    instance: fmi3Instance,
    _noSetFMUStatePriorToCurrentPoint: fmi3Boolean,
    enterEventMode: *mut fmi3Boolean,
    terminateSimulation: *mut fmi3Boolean,
) -> fmi3Status {
    let call = Fmi3::COMPLETED_STEP;
    unsafe {
        on_allowed::<M, Fmi3>(instance, call, |component| {
            let enter = place(call, "enterEventMode", enterEventMode)?;
            let terminate = place(call, "terminateSimulation", terminateSimulation)?;
            *enter = component.instance.completed_integrator_step()?.into();
            *terminate = 0;
            component.log.report_step_warning(&component.instance);
            Ok(())
        })
    }
}

pub unsafe fn fmi3SetTime<M: Model>(instance: fmi3Instance, time: fmi3Float64) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, Fmi3::SET_TIME, |component| component.instance.set_time(time))
    }
}

/// Sets the continuous states that the host has integrated.
pub unsafe fn fmi3SetContinuousStates<M: Model>(
    instance: fmi3Instance,
    continuousStates: *const fmi3Float64,
    nContinuousStates: usize,
) -> fmi3Status {
    let call = Fmi3::SET_CONTINUOUS_STATES;
    unsafe {
        on_allowed::<M, Fmi3>(instance, call, |component| {
            let states = array(call, "continuousStates", continuousStates, nContinuousStates)?;
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

/// Fills an array of the host with one value per state by `body`, which uses the largest possible number of
/// states.
unsafe fn fill_states<M: Model>(
    instance: fmi3Instance,
    call: &'static Call,
    (name, pointer, length): (&str, *mut fmi3Float64, usize),
    body: impl FnOnce(&mut Instance<M, Fmi3>, &mut [fmi3Float64]) -> Result<(), Fault>,
) -> fmi3Status {
    unsafe {
        on_allowed::<M, Fmi3>(instance, call, |component| {
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

/// Fills an array of the host by `body`.
unsafe fn fill<M: Model>(
    instance: fmi3Instance,
    call: &'static Call,
    (name, pointer, length): (&str, *mut fmi3Float64, usize),
    body: impl FnOnce(&mut Instance<M, Fmi3>, &mut [fmi3Float64]) -> Result<(), Fault>,
) -> fmi3Status {
    unsafe {
        on_allowed::<M, Fmi3>(instance, call, |component| {
            body(&mut component.instance, array_mut(call, name, pointer, length)?)
        })
    }
}

/// Computes the derivatives of the states, in the order of the model description.
pub unsafe fn fmi3GetContinuousStateDerivatives<M: Model>(
    instance: fmi3Instance,
    derivatives: *mut fmi3Float64,
    nContinuousStates: usize,
) -> fmi3Status {
    let into = ("derivatives", derivatives, nContinuousStates);
    unsafe { fill_states::<M>(instance, Fmi3::GET_DERIVATIVES, into, Instance::derivatives) }
}

/// Computes the event indicators, which change sign at events.
pub unsafe fn fmi3GetEventIndicators<M: Model>(
    instance: fmi3Instance,
    eventIndicators: *mut fmi3Float64,
    nEventIndicators: usize,
) -> fmi3Status {
    let into = ("eventIndicators", eventIndicators, nEventIndicators);
    unsafe { fill::<M>(instance, Fmi3::GET_EVENT_INDICATORS, into, Instance::event_indicators) }
}

/// Reads the states, in the order of the model description.
pub unsafe fn fmi3GetContinuousStates<M: Model>(
    instance: fmi3Instance,
    continuousStates: *mut fmi3Float64,
    nContinuousStates: usize,
) -> fmi3Status {
    let into = ("continuousStates", continuousStates, nContinuousStates);
    unsafe {
        fill_states::<M>(instance, Fmi3::GET_CONTINUOUS_STATES, into, Instance::continuous_states)
    }
}

pub unsafe fn fmi3GetNominalsOfContinuousStates<M: Model>(
    instance: fmi3Instance,
    nominals: *mut fmi3Float64,
    nContinuousStates: usize,
) -> fmi3Status {
    let into = ("nominals", nominals, nContinuousStates);
    unsafe {
        fill_states::<M>(instance, Fmi3::GET_NOMINALS, into, |instance, x| instance.nominals(x))
    }
}

unsafe fn tell<M: Model>(
    instance: fmi3Instance,
    call: &'static Call,
    (name, pointer): (&str, *mut usize),
    count: impl FnOnce(&Component<M, Fmi3>) -> usize,
) -> fmi3Status {
    unsafe {
        on_allowed::<M, Fmi3>(instance, call, |component| {
            *place(call, name, pointer)? = count(component);
            Ok(())
        })
    }
}

pub unsafe fn fmi3GetNumberOfEventIndicators<M: Model>(
    instance: fmi3Instance,
    nEventIndicators: *mut usize,
) -> fmi3Status {
    let into = ("nEventIndicators", nEventIndicators);
    let count = |component: &Component<M, Fmi3>| match &component.instance.extent {
        None => M::table().about.event_indicators,
        Some(extent) => extent.indicators(),
    };
    unsafe { tell::<M>(instance, &NUMBER_OF_INDICATORS, into, count) }
}

pub unsafe fn fmi3GetNumberOfContinuousStates<M: Model>(
    instance: fmi3Instance,
    nContinuousStates: *mut usize,
) -> fmi3Status {
    let into = ("nContinuousStates", nContinuousStates);
    let count =
        |component: &Component<M, Fmi3>| match (&component.host.arrays, &component.instance.extent)
        {
            (Some(arrays), _) => arrays.states().len(),
            (None, Some(extent)) => extent.places().len(),
            (None, None) => M::table().derivatives().len(),
        };
    unsafe { tell::<M>(instance, &NUMBER_OF_STATES, into, count) }
}

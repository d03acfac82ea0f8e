//! Steps of FMI 3.0 Co-Simulation, with intermediate updates and early return.

#![allow(unsafe_code)]

use std::borrow::Cow;

use super::calls::*;
use super::elements::{check_count, check_elements, expand};
use super::host::Phase;
use super::types::*;
use super::values::check_intermediate;
use crate::c_abi::{Component, array, array_mut, null_argument, perform, perform_if_allowed};
use crate::call::{Call, Fault, InstanceState};
use crate::instance::StepInfo;
use crate::model::Model;
use crate::number::is_finite;
use crate::version::Version;

pub(super) unsafe fn output_derivatives<M: Model>(
    instance: fmi3Instance,
    (references, count): References,
    orders: *const fmi3Int32,
    (values, value_count): (*mut fmi3Float64, usize),
) -> fmi3Status {
    let call = Fmi3::GET_OUTPUT_DERIVATIVES;
    unsafe {
        perform_if_allowed::<M, Fmi3>(instance, call, |component| {
            let references = array(call, "valueReferences", references, count)?;
            let orders = array(call, "orders", orders, count)?;
            let (mut scalars, mut orders) = (Cow::Borrowed(references), Cow::Borrowed(orders));
            match &component.host.arrays {
                None => check_count(call, count, value_count)?,
                Some(arrays) => {
                    let each = references.iter().zip(orders.iter());
                    let each = each.flat_map(|(r, order)| {
                        vec![*order; arrays.scalars(*r).map_or(0, <[u32]>::len)]
                    });
                    let each: Vec<i32> = each.collect();
                    scalars = Cow::Owned(expand::<M>(arrays, call, references)?);
                    orders = Cow::Owned(each);
                    check_elements(component, call, references, scalars.len(), value_count)?;
                }
            }
            let places = array_mut(call, "values", values, value_count)?;
            if component.instance.state() == InstanceState::Intermediate {
                for reference in scalars.iter() {
                    check_intermediate(component, call, *reference, Phase::Get)?;
                }
            }
            component.instance.output_derivatives(&scalars, &orders, places)
        })
    }
}

#[derive(Clone, Copy)]
struct Wish {
    early_return: Option<f64>,
}

/// Calls the host's callback intermediateUpdate at `time`, s, and returns the host's wish, for example to return early. While
/// the callback runs there must be no reference into the instance, because the host calls functions of the FMU from within
/// its callback.
unsafe fn intermediate_update<M: Model>(
    instance: fmi3Instance,
    time: f64,
    phase: Phase,
) -> Result<Wish, fmi3Status> {
    let call = Fmi3::DO_STEP;
    let mut prepared = None;
    let status = unsafe {
        perform::<M, Fmi3>(instance, call, |component| {
            let host = &mut component.host;
            let Some(update) = host.intermediate_update else { return Ok(()) };
            (host.phase, host.ends) = (phase, M::Inputs::default());
            host.set.clear();
            prepared = Some((update, host.environment, host.early_return_allowed));
            component.instance.enter_intermediate();
            Ok(())
        })
    };
    if status != fmi3OK {
        return Err(status);
    }
    let Some((update, environment, can_return)) = prepared else {
        return Ok(Wish { early_return: None });
    };
    let sets = phase == Phase::Set;
    let (mut requested, mut at): (fmi3Boolean, fmi3Float64) = (0, time);
    unsafe {
        update(
            environment,
            time,
            sets.into(),
            (!sets).into(),
            (!sets).into(),
            can_return.into(),
            &mut requested,
            &mut at,
        );
    }
    let status = unsafe {
        perform::<M, Fmi3>(instance, call, |component| component.instance.leave_intermediate(call))
    };
    if status != fmi3OK {
        return Err(status);
    }
    Ok(Wish { early_return: Some(at).filter(|_| requested != 0 && can_return) })
}

#[derive(Clone, Copy)]
pub(super) struct Answers {
    pub(super) event: *mut fmi3Boolean,
    pub(super) terminate: *mut fmi3Boolean,
    pub(super) early: *mut fmi3Boolean,
    pub(super) last: *mut fmi3Float64,
}

impl Answers {
    unsafe fn initialise(&self, call: &Call, time: f64) -> Result<(), Fault> {
        let Answers { event, terminate, early, last } = *self;
        let flags = [
            ("eventHandlingNeeded", event),
            ("terminateSimulation", terminate),
            ("earlyReturn", early),
        ];
        for (_, flag) in flags {
            if let Some(flag) = unsafe { flag.as_mut() } {
                *flag = 0;
            }
        }
        if let Some(last) = unsafe { last.as_mut() } {
            *last = time;
        }
        let flag = flags.iter().find(|(_, flag)| flag.is_null()).map(|(name, _)| *name);
        match flag.or(last.is_null().then_some("lastSuccessfulTime")) {
            Some(name) => Err(null_argument(call, name)),
            None => Ok(()),
        }
    }
}

/// Makes one communication step of `h` seconds from the time `at`, s. If the host allows early return, the step stops at an
/// event; eventHandlingNeeded is set for an event within the step or at its end.
pub(super) unsafe fn do_step<M: Model>(
    instance: fmi3Instance,
    (at, h): (fmi3Float64, fmi3Float64),
    answers: Answers,
) -> fmi3Status {
    let mut has_updates = false;
    let status = unsafe {
        perform::<M, Fmi3>(instance, Fmi3::DO_STEP, |component| {
            answers.initialise(Fmi3::DO_STEP, component.instance.time())?;
            component.instance.check(Fmi3::DO_STEP)?;
            has_updates = component.host.intermediate_update.is_some();
            if has_updates {
                return Ok(());
            }
            let (before, stops) =
                (component.instance.event_count(), component.host.early_return_allowed);
            let step = component.instance.step_to_event(at, h, stops)?;
            write_step_results(component, before, step, answers);
            Ok(())
        })
    };
    if status != fmi3OK || !has_updates {
        return status;
    }
    unsafe { step_with_updates::<M>(instance, at, h, answers) }
}

#[inline(always)]
unsafe fn write_step_results<M: Model>(
    component: &mut Component<M, Fmi3>,
    before: i32,
    step: StepInfo,
    answers: Answers,
) {
    let Component { instance, log, .. } = component;
    unsafe {
        *answers.event = step.event.into();
        *answers.early |= fmi3Boolean::from(step.early);
        *answers.last = instance.time();
    }
    log.report_event(Fmi3::DO_STEP, before, instance);
    log.report_step_warning(instance);
}

/// Makes one step with two intermediate updates. In the first, at the start of the step, the host may set the inputs for the
/// end of the step and request an early return; the second is at the end.
unsafe fn step_with_updates<M: Model>(
    instance: fmi3Instance,
    at: f64,
    mut h: f64,
    answers: Answers,
) -> fmi3Status {
    let (call, whole) = (Fmi3::DO_STEP, h);
    let checked = unsafe {
        perform::<M, Fmi3>(instance, call, |component| component.instance.check_step(call, at, h))
    };
    if checked != fmi3OK {
        return checked;
    }
    let wish = match unsafe { intermediate_update::<M>(instance, at + h, Phase::Set) } {
        Ok(wish) => wish,
        Err(status) => return status,
    };
    let ramps = unsafe {
        perform::<M, Fmi3>(instance, call, |component| {
            let Component { instance, host, .. } = component;
            instance.ramp_to(call, &host.set, &host.ends, h)
        })
    };
    if ramps != fmi3OK {
        return ramps;
    }
    // The return time may be any time in the step; a time before the start of the step, or NaN, means that the
    // step ends at once.
    let (mut is_early, mut moves) = (false, true);
    let placed = unsafe {
        perform::<M, Fmi3>(instance, call, |component| {
            let clock = &component.instance.clock;
            if let Some(time) = wish.early_return {
                let is_late = time.to_bits() == f64::INFINITY.to_bits();
                is_early = !is_late && (!is_finite(time) || clock.is_before(time, at + h));
                moves = !is_early || is_finite(time) && clock.is_before(at, time);
            }
            if let Some(time) = wish.early_return.filter(|_| is_early && moves) {
                h = time - at;
            }
            Ok(())
        })
    };
    if placed != fmi3OK {
        return placed;
    }
    if is_early {
        unsafe { *answers.early = 1 };
        if !moves {
            let drop_ramps = |component: &mut Component<M, Fmi3>| {
                component.instance.drop_ramps();
                Ok(())
            };
            return unsafe { perform::<M, Fmi3>(instance, call, drop_ramps) };
        }
    }
    let status = unsafe {
        perform::<M, Fmi3>(instance, call, |component| {
            let Component { instance, host, .. } = component;
            let before = instance.event_count();
            let step = instance.step_to_event(at, h, host.early_return_allowed);
            match &step {
                Ok(step) if !step.early && h == whole => {
                    instance.end_ramps(&host.set, &host.ends);
                }
                Ok(_) => {}
                Err(_) => instance.drop_ramps(),
            }
            write_step_results(component, before, step?, answers);
            Ok(())
        })
    };
    if status != fmi3OK {
        return status;
    }
    let end = unsafe { *answers.last };
    match unsafe { intermediate_update::<M>(instance, end, Phase::Get) } {
        Ok(_) => fmi3OK,
        Err(status) => status,
    }
}

//! Saved states.

#![allow(unsafe_code)]

use std::ptr;

use super::calls::*;
use super::elements::resize;
use super::types::*;
use crate::c_abi::{array, array_mut, free_state, new_state, null, on, place, saved_state};
use crate::model::Model;
use crate::snapshot;
use crate::version::Version;

/// Saves the state, into the handle that is there or into a new one.
pub unsafe fn fmi3GetFMUState<M: Model>(
    instance: fmi3Instance,
    FMUState: *mut fmi3FMUState,
) -> fmi3Status {
    let call = &GET_STATE;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let handle = place(call, "FMUState", FMUState)?;
            if handle.is_null() {
                *handle = new_state(component.instance.clone());
            } else {
                saved_state(call, "FMUState", *handle)?.clone_from(&component.instance);
            }
            Ok(())
        })
    }
}

/// Takes a saved state, this instance's or another's, in any instance state.
pub unsafe fn fmi3SetFMUState<M: Model>(
    instance: fmi3Instance,
    FMUState: fmi3FMUState,
) -> fmi3Status {
    let call = Fmi3::SET_STATE;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            component.instance.restore(saved_state(call, "FMUState", FMUState)?)?;
            resize(component);
            Ok(())
        })
    }
}

/// Frees a saved state and clears the handle; NULL is fine.
pub unsafe fn fmi3FreeFMUState<M: Model>(
    instance: fmi3Instance,
    FMUState: *mut fmi3FMUState,
) -> fmi3Status {
    let call = &FREE_STATE;
    unsafe { on::<M, Fmi3>(instance, call, |_| free_state::<M, Fmi3>(call, "FMUState", FMUState)) }
}

/// Returns the size of a saved state in bytes.
pub unsafe fn fmi3SerializedFMUStateSize<M: Model>(
    instance: fmi3Instance,
    FMUState: fmi3FMUState,
    size: *mut usize,
) -> fmi3Status {
    let call = &SERIALIZED_SIZE;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            saved_state::<M, Fmi3>(call, "FMUState", FMUState)?;
            *place(call, "size", size)? = snapshot::size::<M>();
            Ok(())
        })
    }
}

/// Writes a saved state to the host's bytes.
pub unsafe fn fmi3SerializeFMUState<M: Model>(
    instance: fmi3Instance,
    FMUState: fmi3FMUState,
    serializedState: *mut fmi3Byte,
    size: usize,
) -> fmi3Status {
    let call = &SERIALIZE;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let bytes = snapshot::to_bytes(saved_state::<M, Fmi3>(call, "FMUState", FMUState)?);
            if size < bytes.len() {
                return Err(call.error(format_args!(
                    "size is {size}; a saved state takes {} bytes",
                    bytes.len()
                )));
            }
            let room = array_mut(call, "serializedState", serializedState, size)?;
            room[..bytes.len()].copy_from_slice(&bytes);
            Ok(())
        })
    }
}

/// Makes a saved state from bytes. The handle is written, never read: the host need not have set it.
pub unsafe fn fmi3DeserializeFMUState<M: Model>(
    instance: fmi3Instance,
    serializedState: *const fmi3Byte,
    size: usize,
    FMUState: *mut fmi3FMUState,
) -> fmi3Status {
    let call = &DESERIALIZE;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            if FMUState.is_null() {
                return Err(null(call, "FMUState"));
            }
            let bytes = array(call, "serializedState", serializedState, size)?;
            let saved = snapshot::from_bytes::<M, Fmi3>(bytes).map_err(|why| call.error(why))?;
            component.instance.check_layout(call, &saved)?;
            ptr::write(FMUState, new_state(saved));
            Ok(())
        })
    }
}

//! Saved states.

// The standard documents these names.
#![allow(missing_docs)]
#![allow(unsafe_code)]

use super::calls::*;
use super::elements::resize;
use super::types::*;
use crate::c_abi::{
    deserialize, free_state, on, on_allowed, place, save_state, saved_state, serialize,
};
use crate::model::Model;
use crate::snapshot;
use crate::version::Version;

/// Saves the state into the existing handle, or into a new one if it is NULL.
pub unsafe fn fmi3GetFMUState<M: Model>(
    instance: fmi3Instance,
    FMUState: *mut fmi3FMUState,
) -> fmi3Status {
    let call = &GET_STATE;
    unsafe {
        on_allowed::<M, Fmi3>(instance, call, |component| {
            save_state(call, "FMUState", FMUState, &component.instance)
        })
    }
}

/// Restores a saved state of this or another instance, in any instance state.
pub unsafe fn fmi3SetFMUState<M: Model>(
    instance: fmi3Instance,
    FMUState: fmi3FMUState,
) -> fmi3Status {
    let call = Fmi3::SET_STATE;
    unsafe {
        on_allowed::<M, Fmi3>(instance, call, |component| {
            component.instance.restore(saved_state(call, "FMUState", FMUState)?)?;
            resize(component);
            Ok(())
        })
    }
}

/// Frees a saved state and sets the handle to NULL; NULL is allowed.
pub unsafe fn fmi3FreeFMUState<M: Model>(
    instance: fmi3Instance,
    FMUState: *mut fmi3FMUState,
) -> fmi3Status {
    let call = &FREE_STATE;
    unsafe { on::<M, Fmi3>(instance, call, |_| free_state::<M, Fmi3>(call, "FMUState", FMUState)) }
}

pub unsafe fn fmi3SerializedFMUStateSize<M: Model>(
    instance: fmi3Instance,
    FMUState: fmi3FMUState,
    size: *mut usize,
) -> fmi3Status {
    let call = &SERIALIZED_SIZE;
    unsafe {
        on_allowed::<M, Fmi3>(instance, call, |_| {
            saved_state::<M, Fmi3>(call, "FMUState", FMUState)?;
            *place(call, "size", size)? = snapshot::size::<M>();
            Ok(())
        })
    }
}

pub unsafe fn fmi3SerializeFMUState<M: Model>(
    instance: fmi3Instance,
    FMUState: fmi3FMUState,
    serializedState: *mut fmi3Byte,
    size: usize,
) -> fmi3Status {
    let call = &SERIALIZE;
    unsafe {
        on_allowed::<M, Fmi3>(instance, call, |_| {
            let saved = saved_state::<M, Fmi3>(call, "FMUState", FMUState)?;
            serialize(call, saved, serializedState, size)
        })
    }
}

pub unsafe fn fmi3DeserializeFMUState<M: Model>(
    instance: fmi3Instance,
    serializedState: *const fmi3Byte,
    size: usize,
    FMUState: *mut fmi3FMUState,
) -> fmi3Status {
    let call = &DESERIALIZE;
    let bytes = (serializedState, size);
    unsafe {
        on_allowed::<M, Fmi3>(instance, call, |component| {
            deserialize(call, &component.instance, bytes, ("FMUState", FMUState))
        })
    }
}

//! Tests with an FMI 3.0 host that has read the model description with array variables.

#![allow(unsafe_code)]

use std::ffi::c_void;
use std::sync::Mutex;

use crate::c_abi::{c_string, text};
use crate::model::Model;
use crate::table::Layout;
use crate::tests::trays::Trays;
use crate::v3::*;

type Lines = Mutex<Vec<String>>;

unsafe extern "C" fn log(to: *mut c_void, _: fmi3Status, _: fmi3String, what: fmi3String) {
    let lines = unsafe { &*to.cast::<Lines>() };
    lines.lock().unwrap().push(unsafe { text(what) }.unwrap());
}

fn instance_with_arrays(lines: &Lines) -> fmi3Instance {
    let token = c_string(Trays::table().token(Layout::Arrays));
    let environment = std::ptr::from_ref(lines).cast_mut().cast();
    let (name, log) = (c"one".as_ptr(), Some(log as _));
    let instance = unsafe {
        fmi3InstantiateModelExchange::<Trays>(
            name,
            token.as_ptr(),
            std::ptr::null(),
            0,
            0,
            environment,
            log,
        )
    };
    assert!(!instance.is_null(), "{:?}", lines.lock().unwrap());
    instance
}

fn get<const N: usize>(instance: fmi3Instance, of: &[u32]) -> (fmi3Status, [f64; N]) {
    let mut values = [7.0; N];
    let (count, room) = (of.len(), values.as_mut_ptr());
    let status = unsafe { fmi3GetFloat64::<Trays>(instance, of.as_ptr(), count, room, N) };
    (status, values)
}

fn set(instance: fmi3Instance, of: u32, values: &[f64]) -> fmi3Status {
    unsafe { fmi3SetFloat64::<Trays>(instance, &of, 1, values.as_ptr(), values.len()) }
}

#[test]
fn values_of_arrays_are_read_and_set_in_row_major_order() {
    let lines = Lines::default();
    let instance = instance_with_arrays(&lines);
    assert_eq!(get(instance, &[6, 7]), (fmi3OK, [0.0, 1.0, 2.0, 3.0, 10.0, 11.0, 13.0, 14.0]));
    assert_eq!(set(instance, 7, &[1.5, 2.5, 3.5, 4.5]), fmi3OK);
    assert_eq!(get(instance, &[8, 7]), (fmi3OK, [0.5, 1.5, 2.5, 3.5, 4.5]));
    assert_eq!(set(instance, 4, &[0.25, -0.5]), fmi3OK);
    unsafe {
        assert_eq!(fmi3EnterInitializationMode::<Trays>(instance, 0, 0.0, 3.0, 0, 0.0), fmi3OK);
    }
    assert_eq!(get(instance, &[1, 3, 9]), (fmi3OK, [1.0, 2.0, 0.25, -0.5, 3.0]));
    assert_eq!(get(instance, &[10]), (fmi3OK, [0.25, -0.5]));
    unsafe { fmi3FreeInstance::<Trays>(instance) };
    assert_eq!(*lines.lock().unwrap(), [""; 0]);
}

/// Each message contains the error and the lengths of the arrays; of five or more arrays it contains the first four.
#[test]
fn wrong_counts_types_and_references_of_arrays_are_described() {
    let all = [6, 7, 8, 6, 8];
    for (case, said) in [
        "nValues = 3 (allowed: 4, by rows: w[2,2])",
        "nValues = 3 (allowed: 13, by rows: w[2,2], m[2,2], k, w[2,2])",
        "nValues = 3 (allowed: 14, by rows: w[2,2], m[2,2], k, w[2,2], …)",
        "no variable has the value reference 11 (allowed: 1 to 10)",
        "rows (value reference 5) is of type UInt64",
        "level (value reference 1) is of type Float64",
        "nValues = 5 (allowed: 4, by rows: m[2,2])",
    ]
    .into_iter()
    .enumerate()
    {
        let lines = Lines::default();
        let instance = instance_with_arrays(&lines);
        let status = match case {
            0 => get::<3>(instance, &all[..1]).0,
            1 => get::<3>(instance, &all[..4]).0,
            2 => get::<3>(instance, &all).0,
            3 => get::<1>(instance, &[11]).0,
            4 => get::<1>(instance, &[5]).0,
            5 => unsafe { fmi3GetInt32::<Trays>(instance, &1, 1, &mut 0, 1) },
            _ => set(instance, 7, &[1.0; 5]),
        };
        unsafe { fmi3FreeInstance::<Trays>(instance) };
        let lines = lines.lock().unwrap();
        assert_eq!((status, lines.len()), (fmi3Error, 1), "{lines:?}");
        assert!(lines[0].ends_with(said), "{}\n{said}", lines[0]);
    }
}

/// If the number of the test model's trays changes, the arrays whose size depends on it get their start values, and all
/// other variables keep their values. If the number is set to its present value, nothing changes.
#[test]
fn changing_the_size_of_an_array_resets_its_elements() {
    let lines = Lines::default();
    let instance = instance_with_arrays(&lines);
    let rows = |n: u64| unsafe {
        assert_eq!(fmi3EnterConfigurationMode::<Trays>(instance), fmi3OK);
        assert_eq!(fmi3SetUInt64::<Trays>(instance, &5, 1, &n, 1), fmi3OK);
        assert_eq!(fmi3ExitConfigurationMode::<Trays>(instance), fmi3OK);
        let mut found = 0;
        assert_eq!(fmi3GetUInt64::<Trays>(instance, &5, 1, &mut found, 1), fmi3OK);
        assert_eq!(found, n);
    };
    let states = || unsafe {
        let mut count = 0;
        assert_eq!(fmi3GetNumberOfContinuousStates::<Trays>(instance, &mut count), fmi3OK);
        count
    };
    assert_eq!((set(instance, 7, &[1.5; 4]), set(instance, 8, &[9.0])), (fmi3OK, fmi3OK));
    rows(2);
    assert_eq!((get(instance, &[7, 8]), states()), ((fmi3OK, [1.5, 1.5, 1.5, 1.5, 9.0]), 2));
    rows(3);
    let all = [10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 9.0];
    assert_eq!((get(instance, &[7, 8]), states()), ((fmi3OK, all), 3));
    rows(1);
    assert_eq!((get(instance, &[7, 8]), states()), ((fmi3OK, [10.0, 13.0, 9.0]), 1));
    unsafe {
        // After a reset there are two trays.
        assert_eq!(fmi3Reset::<Trays>(instance), fmi3OK);
    }
    assert_eq!((get(instance, &[7, 8]), states()), ((fmi3OK, [10.0, 11.0, 13.0, 14.0, 0.5]), 2));
    unsafe { fmi3FreeInstance::<Trays>(instance) };
    // For three rows m loses values that were set; for one row no value was set any more.
    let told = "fmi3SetUInt64: rows changed: the values set earlier for m are lost. Set them again";
    assert_eq!(*lines.lock().unwrap(), [told]);
}

/// The table has 24 scalars. The time and two event indicators follow, and the host can read each of them as a Float64.
#[test]
fn value_references_of_time_and_event_indicators_follow_those_of_the_scalars() {
    let lines = Lines::default();
    let token = c_string(Trays::table().token(Layout::Scalars));
    let environment = std::ptr::from_ref(&lines).cast_mut().cast();
    let scalar_instance = || unsafe {
        let (name, token, path) = (c"one".as_ptr(), token.as_ptr(), std::ptr::null());
        let instance = fmi3InstantiateModelExchange::<Trays>(
            name,
            token,
            path,
            0,
            0,
            environment,
            Some(log as _),
        );
        fmi3EnterInitializationMode::<Trays>(instance, 0, 0.0, 3.0, 0, 0.0);
        instance
    };
    let instance = scalar_instance();
    assert_eq!(get(instance, &[24, 25, 26, 27]), (fmi3OK, [0.5, 3.0, 0.25, -0.5]));
    unsafe { fmi3FreeInstance::<Trays>(instance) };
    for (case, said) in [
        "no variable has the value reference 28 (allowed: 1 to 27)",
        "event_indicator[2] (value reference 27) can only be read",
        "event_indicator[1] (value reference 26) is of type Float64",
        "time (value reference 25) is of type Float64",
        "nValues = 2 (allowed: 1, one for each value reference)",
    ]
    .into_iter()
    .enumerate()
    {
        let instance = scalar_instance();
        let status = match case {
            0 => get::<1>(instance, &[28]).0,
            1 => set(instance, 27, &[1.0]),
            2 => unsafe { fmi3GetInt32::<Trays>(instance, &26, 1, &mut 0, 1) },
            3 => unsafe { fmi3GetInt32::<Trays>(instance, &25, 1, &mut 0, 1) },
            _ => set(instance, 8, &[1.0; 2]),
        };
        unsafe { fmi3FreeInstance::<Trays>(instance) };
        let lines = std::mem::take(&mut *lines.lock().unwrap());
        assert_eq!((status, lines.len()), (fmi3Error, 1), "{lines:?}");
        assert!(lines[0].ends_with(said), "{}\n{said}", lines[0]);
    }
    let names = extra_names::<Trays>();
    assert_eq!(names, ["time", "event_indicator[1]", "event_indicator[2]"]);
    assert_eq!(time_reference::<Trays>(), 25);
}

/// In the test model each element of the output `square` depends on all levels and inflows of the present trays, even where
/// all of them are 0, so that the derivatives vanish. The rate of a level depends only on the inflow of its own tray.
#[test]
fn dependencies_of_array_elements_are_reported_even_where_the_derivative_vanishes() {
    let lines = Lines::default();
    let instance = instance_with_arrays(&lines);
    unsafe {
        fmi3EnterInitializationMode::<Trays>(instance, 0, 0.0, 0.0, 0, 0.0);
        assert_eq!(fmi3ExitInitializationMode::<Trays>(instance), fmi3OK);
        assert_eq!(fmi3EnterContinuousTimeMode::<Trays>(instance), fmi3OK);
        let x = [0.0; 2];
        assert_eq!(fmi3SetContinuousStates::<Trays>(instance, x.as_ptr(), 2), fmi3OK);
    }
    let of = |variable: u32| unsafe {
        let mut count = 99;
        let status = fmi3GetNumberOfVariableDependencies::<Trays>(instance, variable, &mut count);
        assert_eq!(status, fmi3OK, "{:?}", lines.lock().unwrap());
        let (mut own, mut known) = (vec![9; count], vec![0; count]);
        let (mut elements, mut kinds) = (vec![9; count], vec![9; count]);
        let status = fmi3GetVariableDependencies::<Trays>(
            instance,
            variable,
            own.as_mut_ptr(),
            known.as_mut_ptr(),
            elements.as_mut_ptr(),
            kinds.as_mut_ptr(),
            count,
        );
        assert_eq!(status, fmi3OK);
        let mut all: Vec<_> =
            own.iter().zip(&known).zip(&elements).map(|((a, b), c)| (*a, *b, *c)).collect();
        all.sort_unstable();
        all
    };
    assert_eq!(of(2), [(1, 1, 1), (1, 1, 2), (1, 4, 1), (1, 4, 2)]);
    assert_eq!(of(3), [(1, 4, 1), (2, 4, 2)]);
    unsafe { fmi3FreeInstance::<Trays>(instance) };
}

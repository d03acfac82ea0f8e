#![allow(unsafe_code)]

use super::calls::*;
use super::elements::{check_numbers, scalars_of};
use super::references::time_reference;
use super::types::*;
use crate::c_abi::{array, array_mut, perform_if_allowed};
use crate::model::Model;
use crate::number::{is_finite, text as number};
use crate::version::Version;

pub(super) unsafe fn directional_derivative<M: Model>(
    instance: fmi3Instance,
    (unknowns, n_unknowns): References,
    (knowns, n_knowns): References,
    (seed, n_seed): (*const fmi3Float64, usize),
    (sensitivity, n_sensitivity): (*mut fmi3Float64, usize),
) -> fmi3Status {
    let call = Fmi3::DIRECTIONAL_DERIVATIVE;
    unsafe {
        perform_if_allowed::<M, Fmi3>(instance, call, |component| {
            let unknowns = array(call, "unknowns", unknowns, n_unknowns)?;
            let unknowns = scalars_of(component, call, unknowns)?;
            let knowns = array(call, "knowns", knowns, n_knowns)?;
            let knowns = scalars_of(component, call, knowns)?;
            check_numbers(call, "nSeed", n_seed, knowns.len())?;
            check_numbers(call, "nSensitivity", n_sensitivity, unknowns.len())?;
            let seed = array(call, "seed", seed, n_seed)?;
            let answers = array_mut(call, "sensitivity", sensitivity, n_sensitivity)?;
            // The independent variable is not among the knowns, because variables depend on it only
            // through states and inputs.
            let time = time_reference::<M>();
            if !knowns.contains(&time) {
                return component
                    .instance
                    .directional_derivative(&unknowns, &knowns, seed, answers);
            }
            let others = knowns.iter().zip(seed).filter(|(known, _)| **known != time);
            let (knowns, seed): (Vec<u32>, Vec<f64>) = others.unzip();
            component.instance.directional_derivative(&unknowns, &knowns, &seed, answers)
        })
    }
}

/// Computes the derivative of a weighted sum of the unknowns with respect to each known. `seed` contains the weights, and the
/// results are written to `sensitivity`. Each result is computed from a directional derivative along one known.
pub(super) unsafe fn adjoint_derivative<M: Model>(
    instance: fmi3Instance,
    (unknowns, n_unknowns): References,
    (knowns, n_knowns): References,
    (seed, n_seed): (*const fmi3Float64, usize),
    (sensitivity, n_sensitivity): (*mut fmi3Float64, usize),
) -> fmi3Status {
    let call = &ADJOINT_DERIVATIVE;
    unsafe {
        perform_if_allowed::<M, Fmi3>(instance, call, |component| {
            let unknowns = array(call, "unknowns", unknowns, n_unknowns)?;
            let unknowns = scalars_of(component, call, unknowns)?;
            let knowns = array(call, "knowns", knowns, n_knowns)?;
            let knowns = scalars_of(component, call, knowns)?;
            check_numbers(call, "nSeed", n_seed, unknowns.len())?;
            check_numbers(call, "nSensitivity", n_sensitivity, knowns.len())?;
            let seed = array(call, "seed", seed, n_seed)?;
            for weight in seed {
                if !is_finite(*weight) {
                    let weight = number(*weight);
                    return Err(
                        call.error(format_args!("seed[] = {weight} (allowed: any finite number)"))
                    );
                }
            }
            let answers = array_mut(call, "sensitivity", sensitivity, n_sensitivity)?;
            let mut column = vec![0.0; unknowns.len()];
            for (known, answer) in knowns.iter().zip(answers) {
                *answer = 0.0;
                if *known == time_reference::<M>() {
                    continue;
                }
                let (known, one) = (std::slice::from_ref(known), &[1.0]);
                component.instance.directional_derivative(&unknowns, known, one, &mut column)?;
                *answer = seed.iter().zip(&column).map(|(weight, d)| weight * d).sum();
            }
            Ok(())
        })
    }
}

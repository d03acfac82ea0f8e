#![allow(unsafe_code)]

use super::calls::*;
use super::elements::{check_numbers, wrong_variable};
use super::references::wrong_reference;
use super::types::*;
use crate::c_abi::{Component, array_mut, perform_if_allowed};
use crate::call::{Call, Fault};
use crate::model::Model;
use crate::variable::Causality;

pub(super) struct Dependency {
    element: usize,
    independent: fmi3ValueReference,
    independent_element: usize,
}

/// Returns the scalars on which the variable with the value reference `reference` depends in the present state, each with the
/// kind of the dependency.
pub(super) fn dependencies<M: Model>(
    component: &mut Component<M, Fmi3>,
    call: &Call,
    reference: u32,
) -> Result<Vec<Dependency>, Fault> {
    let Component { instance, host, .. } = component;
    let scalars = match &host.arrays {
        None => std::slice::from_ref(&reference),
        Some(arrays) => arrays
            .scalars(reference)
            .ok_or_else(|| call.error(wrong_variable::<M>(arrays, reference)))?,
    };
    let mut all = Vec::new();
    for (scalar, element) in scalars.iter().zip(1..) {
        let found = M::table().scalars.get(scalar.wrapping_sub(1) as usize);
        let wrong = || call.error(wrong_reference::<M>(*scalar, found, None));
        let scalar = found.ok_or_else(wrong)?;
        if matches!(scalar.variable.causality, Causality::Input | Causality::Parameter) {
            let name = scalar.name();
            return Err(
                call.error(format_args!("{name} depends on no variable, because the host sets it"))
            );
        }
        for known in instance.dependencies(call, scalar)? {
            let place = match &host.arrays {
                None => Some((known, 1)),
                Some(arrays) => arrays.place(known),
            };
            let of = |(independent, independent_element)| Dependency {
                element,
                independent,
                independent_element,
            };
            all.extend(place.map(of));
        }
    }
    Ok(all)
}

/// Writes the dependencies of the variable `dependent` to four arrays of the host, which have `n` elements each. Until the
/// end of initialization mode they are the dependencies of the initial value, and afterwards the dependencies in the present
/// state.
pub(super) unsafe fn write_dependencies<M: Model>(
    instance: fmi3Instance,
    dependent: fmi3ValueReference,
    (elements, independents): (*mut usize, *mut fmi3ValueReference),
    (independent_elements, kinds): (*mut usize, *mut fmi3DependencyKind),
    n: usize,
) -> fmi3Status {
    let call = &DEPENDENCIES;
    unsafe {
        perform_if_allowed::<M, Fmi3>(instance, call, |component| {
            let all = dependencies(component, call, dependent)?;
            check_numbers(call, "nDependencies", n, all.len())?;
            let elements = array_mut(call, "elementIndicesOfDependent", elements, n)?;
            let independents = array_mut(call, "independents", independents, n)?;
            let independent_elements =
                array_mut(call, "elementIndicesOfIndependents", independent_elements, n)?;
            for (n, dependency) in all.iter().enumerate() {
                elements[n] = dependency.element;
                independents[n] = dependency.independent;
                independent_elements[n] = dependency.independent_element;
            }
            array_mut(call, "dependencyKinds", kinds, n)?.fill(fmi3Dependent);
            Ok(())
        })
    }
}

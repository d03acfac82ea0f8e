//! Tests of an instance in an invented version of FMI that differs from 2.0 in the same way as 3.0: all types share one
//! range of value references, which does not begin at 0, and the host can handle events also in Co-Simulation.

use super::*;
use crate::call::{CType, Call, Events, InstanceState, typed};
use crate::table::{Layout, Scalar};
use crate::version::Version;

#[derive(Clone, Copy, Debug)]
struct Other;

const FIRST: u32 = 100;

const fn call(name: &'static str) -> Call {
    Call::new(name, u16::MAX)
}

static GET_FLOAT: Call = typed(CType::Real, "otherGetFloat", u16::MAX);

#[rustfmt::skip]
impl Version for Other {
    const PREFIX: &'static str = "other";

    type Host<M: Model> = ();

    const AFTER_ERROR: Option<InstanceState> = None;
    const OUT_OF_RANGE: Severity = Severity::Error;
    const FIRST_EVENT: InstanceState = InstanceState::Initialized;
    const SETS_STATES: bool = false;

    const SETUP_EXPERIMENT:       &'static Call = &call("otherEnterInitialization");
    const ENTER_INITIALIZATION:   &'static Call = &call("otherEnterInitialization");
    const EXIT_INITIALIZATION:    &'static Call = &call("otherExitInitialization");
    const TERMINATE:              &'static Call = &call("otherTerminate");
    const RESET:                  &'static Call = &call("otherReset");
    const SET_STATE:              &'static Call = &call("otherSetState");
    const DIRECTIONAL_DERIVATIVE: &'static Call = &typed(CType::Real, "otherDirectionalDerivative", u16::MAX);

    const SET_INPUT_DERIVATIVES:  &'static Call = &typed(CType::Real, "otherSetInputDerivatives", u16::MAX);
    const GET_OUTPUT_DERIVATIVES: &'static Call = &typed(CType::Real, "otherGetOutputDerivatives", u16::MAX);
    const DO_STEP:                &'static Call = &call("otherDoStep");

    const ENTER_EVENT:            &'static Call = &call("otherEnterEventMode");
    const NEW_DISCRETE_STATES:    &'static Call = &call("otherUpdateDiscreteStates");
    const ENTER_CONTINUOUS_TIME:  &'static Call = &call("otherEnterContinuousTime");
    const COMPLETED_STEP:         &'static Call = &call("otherCompletedStep");
    const SET_TIME:               &'static Call = &call("otherSetTime");
    const SET_CONTINUOUS_STATES:  &'static Call = &call("otherSetContinuousStates");
    const GET_DERIVATIVES:        &'static Call = &call("otherGetDerivatives");
    const GET_EVENT_INDICATORS:   &'static Call = &call("otherGetEventIndicators");
    const GET_CONTINUOUS_STATES:  &'static Call = &call("otherGetContinuousStates");
    const GET_NOMINALS:           &'static Call = &call("otherGetNominals");

    fn token<M: Model>(_: Layout) -> &'static str {
        M::table().guid()
    }

    fn events(_: Interface) -> Events {
        Events::ByHost
    }

    fn reference<M: Model>(scalar: &Scalar<M>) -> u32 {
        FIRST + scalar.index
    }

    fn scalar<M: Model>(reference: u32, _: Option<CType>) -> Result<&'static Scalar<M>, String> {
        let index = reference.checked_sub(FIRST).ok_or("value references begin at 100")?;
        M::table().scalars.get(index as usize).ok_or("no such variable".into())
    }
}

/// The test defines a version of FMI that has other function names, value references from 100 on, and another handling of
/// events.
#[test]
fn names_references_and_event_handling_depend_on_the_fmi_version() {
    let mut instance = Instance::<Vessels, Other>::new(CS);
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    assert_eq!(instance.state(), InstanceState::Initialized);
    let sum = TABLE.find("sum").unwrap();
    let scalar = &TABLE.scalars[sum as usize];
    assert_eq!((Other::reference(scalar), Fmi2::reference(scalar)), (sum + FIRST, sum));
    assert_eq!(instance.get(&GET_FLOAT, sum + FIRST), Ok(Value::Real(7.0)));
    assert_eq!(
        refused(instance.get(&GET_FLOAT, sum)),
        "otherGetFloat: value references begin at 100"
    );
    assert_eq!(
        refused(instance.do_step(0.0, -1.0)),
        "otherDoStep: communicationStepSize = -1.0 s (allowed: greater than 0, finite)"
    );
    // The present inputs do not move the valve, because the host has not handled an event yet.
    let references = ["z", "open"].map(|name| TABLE.find(name).unwrap() + FIRST);
    instance.set(&GET_FLOAT, &references[..1], |_| Value::Real(3.0)).unwrap();
    assert_eq!(instance.get(&GET_FLOAT, references[1]), Ok(Value::Boolean(true)));
    instance.enter_event_mode().unwrap();
    instance.set(&GET_FLOAT, &references[..1], |_| Value::Real(1.0)).unwrap();
    assert_eq!(instance.get(&GET_FLOAT, references[1]), Ok(Value::Boolean(true)));
    instance.new_discrete_states().unwrap();
    assert_eq!(instance.get(&GET_FLOAT, references[1]), Ok(Value::Boolean(false)));
}

//! The functions of FMI 3.0 with the instance states in which each is allowed, and the differences from FMI 2.0.

use super::host::Host;
use super::references::{scalar_reference, type_of, wrong_reference};
use crate::call::states::*;
use crate::call::{CType, Call, Events, InstanceState, Interface, Severity, cs, me, typed};
use crate::model::Model;
use crate::table::{Layout, Scalar};
use crate::version::Version;

pub(super) const GET: u16 = ANY;
pub(super) const SET: u16 = I | M | S | E | C;

#[allow(missing_docs)]
#[rustfmt::skip]
mod list {
    use super::*;
    pub static SET_DEBUG_LOGGING:   Call = Call::new("fmi3SetDebugLogging", ANY | CONFIGURATION);
    pub static GET_FLOAT64:         Call = typed(CType::Real, "fmi3GetFloat64", GET | INTERMEDIATE);
    pub static GET_INT32:           Call = typed(CType::Integer, "fmi3GetInt32", GET);
    pub static GET_INT64:           Call = typed(CType::Enumeration, "fmi3GetInt64", GET);
    pub static GET_BOOLEAN:         Call = typed(CType::Boolean, "fmi3GetBoolean", GET);
    pub static SET_FLOAT64:         Call = typed(CType::Real, "fmi3SetFloat64", SET | INTERMEDIATE);
    pub static SET_INT32:           Call = typed(CType::Integer, "fmi3SetInt32", SET);
    pub static SET_INT64:           Call = typed(CType::Enumeration, "fmi3SetInt64", SET);
    pub static SET_BOOLEAN:         Call = typed(CType::Boolean, "fmi3SetBoolean", SET);
    pub static GET_UINT64:          Call = typed(CType::Size, "fmi3GetUInt64", GET | CONFIGURATION);
    pub static SET_UINT64:          Call = typed(CType::Size, "fmi3SetUInt64", SET | CONFIGURATION);
    // The same functions for structural parameters, whose type in the table is integer.
    pub static GET_SIZE:            Call = typed(CType::Integer, "fmi3GetUInt64", GET | CONFIGURATION);
    pub static SET_SIZE:            Call = typed(CType::Integer, "fmi3SetUInt64", CONFIGURATION);
    pub static NUMBER_OF_DEPENDENCIES: Call = typed(CType::Real, "fmi3GetNumberOfVariableDependencies", ANY);
    pub static DEPENDENCIES:        Call = typed(CType::Real, "fmi3GetVariableDependencies", ANY);
    pub static GET_STATE:           Call = Call::new("fmi3GetFMUState", ANY);
    pub static FREE_STATE:          Call = Call::new("fmi3FreeFMUState", ANY | CONFIGURATION | FATAL);
    pub static SERIALIZED_SIZE:     Call = Call::new("fmi3SerializedFMUStateSize", ANY);
    pub static SERIALIZE:           Call = Call::new("fmi3SerializeFMUState", ANY);
    pub static DESERIALIZE:         Call = Call::new("fmi3DeserializeFMUState", ANY);
    pub static ADJOINT_DERIVATIVE:  Call = Call::new("fmi3GetAdjointDerivative", M | RUN);
    pub static ENTER_CONFIGURATION: Call = Call::new("fmi3EnterConfigurationMode", I);
    pub static EXIT_CONFIGURATION:  Call = Call::new("fmi3ExitConfigurationMode", CONFIGURATION);
    pub static EVALUATE_DISCRETE_STATES: Call = Call::new("fmi3EvaluateDiscreteStates", M | E);
    // The standard allows these two functions in fewer states, but fmusim 0.8 calls them in continuous-time mode.
    pub static NUMBER_OF_INDICATORS: Call = me(Call::new("fmi3GetNumberOfEventIndicators", ANY | CONFIGURATION));
    pub static NUMBER_OF_STATES:    Call = me(Call::new("fmi3GetNumberOfContinuousStates", ANY | CONFIGURATION));
    pub static ENTER_STEP:          Call = cs(Call::new("fmi3EnterStepMode", E));
}
pub use list::*;

#[derive(Clone, Copy, Debug)]
pub struct Fmi3;

#[rustfmt::skip]
impl Version for Fmi3 {
    const PREFIX: &'static str = "fmi3";

    type Host<M: Model> = Host<M>;

    const AFTER_ERROR: Option<InstanceState> = Some(InstanceState::Terminated);
    const OUT_OF_RANGE: Severity = Severity::Discard;
    const FIRST_EVENT: InstanceState = InstanceState::Event;
    const SETS_STATES: bool = true;

    // FMI 3.0 has no setupExperiment; fmi3EnterInitializationMode has its arguments.
    const SETUP_EXPERIMENT:       &'static Call = &Call::new("fmi3EnterInitializationMode", I);
    const ENTER_INITIALIZATION:   &'static Call = &Call::new("fmi3EnterInitializationMode", I);
    const EXIT_INITIALIZATION:    &'static Call = &Call::new("fmi3ExitInitializationMode", M);
    const TERMINATE:              &'static Call = &Call::new("fmi3Terminate", S | E | C);
    const RESET:                  &'static Call = &Call::new("fmi3Reset", ANY | CONFIGURATION);
    const SET_STATE:              &'static Call = &Call::new("fmi3SetFMUState", ANY);
    const DIRECTIONAL_DERIVATIVE: &'static Call = &typed(CType::Real, "fmi3GetDirectionalDerivative", M | RUN);

    // In FMI 3.0 intermediate updates set the slopes of inputs.
    const SET_INPUT_DERIVATIVES:  &'static Call = &cs(typed(CType::Real, "fmi3SetFloat64", INTERMEDIATE));
    const GET_OUTPUT_DERIVATIVES: &'static Call = &cs(typed(CType::Real, "fmi3GetOutputDerivatives", S | T | INTERMEDIATE));
    const DO_STEP:                &'static Call = &cs(Call::new("fmi3DoStep", S));

    const ENTER_EVENT:            &'static Call = &Call::new("fmi3EnterEventMode", S | C);
    const NEW_DISCRETE_STATES:    &'static Call = &Call::new("fmi3UpdateDiscreteStates", E);
    const ENTER_CONTINUOUS_TIME:  &'static Call = &me(Call::new("fmi3EnterContinuousTimeMode", E));
    const COMPLETED_STEP:         &'static Call = &me(Call::new("fmi3CompletedIntegratorStep", C));
    const SET_TIME:               &'static Call = &me(Call::new("fmi3SetTime", C));
    const SET_CONTINUOUS_STATES:  &'static Call = &me(Call::new("fmi3SetContinuousStates", C));
    const GET_DERIVATIVES:        &'static Call = &me(Call::new("fmi3GetContinuousStateDerivatives", M | E | C | T));
    const GET_EVENT_INDICATORS:   &'static Call = &me(Call::new("fmi3GetEventIndicators", M | E | C | T));
    const GET_CONTINUOUS_STATES:  &'static Call = &me(Call::new("fmi3GetContinuousStates", M | E | C | T));
    const GET_NOMINALS:           &'static Call = &me(Call::new("fmi3GetNominalsOfContinuousStates", ANY));

    fn token<M: Model>(layout: Layout) -> &'static str {
        M::table().token(layout)
    }

    fn events(interface: Interface) -> Events {
        match interface {
            Interface::ModelExchange => Events::ByHost,
            Interface::CoSimulation => Events::InStep,
        }
    }

    fn allows(interface: Interface, events: Events) -> bool {
        let reported = interface == Interface::CoSimulation && events == Events::Reported;
        reported || events == Self::events(interface)
    }

    fn reference<M: Model>(scalar: &Scalar<M>) -> u32 {
        scalar_reference(scalar)
    }

    #[inline]
    fn scalar<M: Model>(reference: u32, c_type: Option<CType>) -> Result<&'static Scalar<M>, String> {
        match M::table().scalars.get(reference.wrapping_sub(1) as usize) {
            Some(scalar) if c_type == Some(type_of(scalar)) => Ok(scalar),
            other => Err(wrong_reference(reference, other, c_type)),
        }
    }
}

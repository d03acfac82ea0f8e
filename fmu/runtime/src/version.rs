//! Properties of a version of FMI: the names of its functions, the states in which they are allowed, the
//! handler of events, and the numbering of value references.

use crate::call::{CType, Call, Events, InstanceState, Interface, Severity};
use crate::model::Model;
use crate::table::{Layout, Scalar};

/// A version of FMI. Each constant is the function that performs an operation of
/// [`Instance`](crate::instance::Instance). Functions that read and set values are not listed, because a
/// version has several of them.
#[allow(missing_docs)]
pub trait Version: std::fmt::Debug + 'static {
    const PREFIX: &'static str;

    /// Data that an instance keeps about its host in this version of FMI, other than the logger.
    type Host<M: Model>;

    /// The instance state after a call has failed; `None` if the state does not change.
    const AFTER_ERROR: Option<InstanceState>;
    /// Severity of the failure if a call sets a value outside its range.
    const OUT_OF_RANGE: Severity;
    /// The instance state that follows initialization mode if the host handles events.
    const FIRST_EVENT: InstanceState;
    /// True if Model Exchange hosts may set single continuous states, and may not go back before an event.
    const SETS_STATES: bool;

    const SETUP_EXPERIMENT: &'static Call;
    const ENTER_INITIALIZATION: &'static Call;
    const EXIT_INITIALIZATION: &'static Call;
    const TERMINATE: &'static Call;
    const RESET: &'static Call;
    const SET_STATE: &'static Call;
    const DIRECTIONAL_DERIVATIVE: &'static Call;

    const SET_INPUT_DERIVATIVES: &'static Call;
    const GET_OUTPUT_DERIVATIVES: &'static Call;
    const DO_STEP: &'static Call;

    const ENTER_EVENT: &'static Call;
    const NEW_DISCRETE_STATES: &'static Call;
    const ENTER_CONTINUOUS_TIME: &'static Call;
    const COMPLETED_STEP: &'static Call;
    const SET_TIME: &'static Call;
    const SET_CONTINUOUS_STATES: &'static Call;
    const GET_DERIVATIVES: &'static Call;
    const GET_EVENT_INDICATORS: &'static Call;
    const GET_CONTINUOUS_STATES: &'static Call;
    const GET_NOMINALS: &'static Call;

    /// Returns the text by which the FMU recognises its model description: the GUID (FMI 2.0) or
    /// instantiationToken (FMI 3.0).
    fn token<M: Model>(layout: Layout) -> &'static str;

    /// Returns the party that handles events of an instance with this interface, if the host does
    /// not choose.
    fn events(interface: Interface) -> Events;

    /// Returns true if a host may choose this handler of events for an interface.
    fn allows(interface: Interface, events: Events) -> bool {
        events == Self::events(interface)
    }

    /// Returns the value reference by which the host refers to a scalar in this version of FMI.
    fn reference<M: Model>(scalar: &Scalar<M>) -> u32;

    /// Finds the scalar to which a host's value reference belongs.
    ///
    /// # Errors
    /// If there is none, or it does not have this C type.
    fn scalar<M: Model>(
        reference: u32,
        c_type: Option<CType>,
    ) -> Result<&'static Scalar<M>, String>;
}

//! Properties in which versions of FMI differ: the names of the functions, the instance states in which each is allowed, the
//! possible ways to handle events, and the assignment of value references.

use crate::call::{CType, Call, Events, InstanceState, Interface, Severity};
use crate::model::Model;
use crate::table::{Layout, Scalar};

/// A version of FMI. Each constant of the type [`Call`] names the function that performs an operation of
/// [`Instance`](crate::instance::Instance) in this version. Functions that read and set values are not among the constants,
/// because a version has several of them.
#[allow(missing_docs)]
pub trait Version: std::fmt::Debug + 'static {
    const PREFIX: &'static str;

    /// Data about its host that an instance stores in this version of FMI, except for the logger.
    type Host<M: Model>;

    /// The instance state after a call has failed; `None` if the state does not change.
    const AFTER_ERROR: Option<InstanceState>;
    /// Severity of the failure if a call sets a value outside its range.
    const OUT_OF_RANGE: Severity;
    /// The instance state that follows initialization mode if the host handles events.
    const FIRST_EVENT: InstanceState;
    /// True if Model Exchange hosts may set single continuous states, and may not set a time before the last event.
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
    /// the instantiationToken (FMI 3.0).
    fn token<M: Model>(layout: Layout) -> &'static str;

    /// Returns how events are handled in an instance with this interface if the host does not choose.
    fn events(interface: Interface) -> Events;

    /// Returns true if a host may choose this handling of events for an interface.
    fn allows(interface: Interface, events: Events) -> bool {
        events == Self::events(interface)
    }

    /// Returns the value reference by which the host refers to a scalar in this version of FMI.
    fn reference<M: Model>(scalar: &Scalar<M>) -> u32;

    /// Returns the scalar of a host's value reference.
    ///
    /// # Errors
    /// If there is no such scalar, or it does not have this C type.
    fn scalar<M: Model>(
        reference: u32,
        c_type: Option<CType>,
    ) -> Result<&'static Scalar<M>, String>;
}

//! Properties in which versions of FMI differ: the names of the functions, the instance states in which each is allowed, the
//! possible ways to handle events, and the assignment of value references.

use crate::call::{CType, Call, Events, InstanceState, Interface, Severity};
use crate::model::Model;
use crate::table::{Layout, Scalar};

/// A version of FMI. Each constant of the type [`Call`] is the function of this version that performs an operation of
/// [`Instance`](crate::instance::Instance). Functions that get and set values are not among the constants, because a version
/// has several of them.
#[allow(missing_docs)]
pub trait Version: std::fmt::Debug + 'static {
    const PREFIX: &'static str;

    /// Data about the host that an instance of this version stores in addition to the logger, for example callbacks.
    type Host<M: Model>;

    /// State that an instance enters after a call has failed; `None` if a failed call does not change the state.
    const AFTER_ERROR: Option<InstanceState>;
    /// Severity of the fault if a host sets a value outside its range.
    const OUT_OF_RANGE: Severity;
    /// State that an instance enters after initialization mode if the host handles events.
    const FIRST_EVENT: InstanceState;
    /// True if a host of Model Exchange may set single continuous states, but may not set a time before the last event.
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

    /// Returns the text by which the binary recognises its model description: the GUID in FMI 2.0, the instantiationToken in
    /// FMI 3.0.
    fn token<M: Model>(layout: Layout) -> &'static str;

    /// Returns who handles events in an instance with this interface if the host does not choose.
    fn events(interface: Interface) -> Events;

    /// Returns true if a host may create an instance with this interface and this handling of events.
    fn allows(interface: Interface, events: Events) -> bool {
        events == Self::events(interface)
    }

    /// Returns the value reference with which hosts of this version refer to the scalar.
    fn reference<M: Model>(scalar: &Scalar<M>) -> u32;

    /// Returns the scalar with this value reference.
    ///
    /// # Errors
    /// A message if no scalar has the value reference, or if the scalar is not of the type `c_type`.
    fn scalar<M: Model>(
        reference: u32,
        c_type: Option<CType>,
    ) -> Result<&'static Scalar<M>, String>;
}

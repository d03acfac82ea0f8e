//! Properties of a version of FMI: its functions' names, when they may be called, the handler of
//! events, and the numbering of value references.

use crate::call::{CType, Call, Events, InstanceState, Interface, Severity};
use crate::model::Model;
use crate::table::{Layout, Scalar};

/// A version of FMI. Each constant is the call by which it asks for an operation of
/// [`Instance`](crate::instance::Instance); getting and setting values, for which a version has several
/// functions, name theirs themselves.
#[allow(missing_docs)]
pub trait Version: std::fmt::Debug + 'static {
    /// Prefix of its functions and types.
    const PREFIX: &'static str;

    /// Data that an instance keeps about its host in addition to the logger.
    type Host<M: Model>;

    /// The state after a call that failed, if it is another than before.
    const AFTER_ERROR: Option<InstanceState>;
    /// Severity of a value outside its range, if it is refused at once.
    const OUT_OF_RANGE: Severity;
    /// The state in which a host that handles events is after initialization mode.
    const FIRST_EVENT: InstanceState;
    /// True if Model Exchange hosts may set single continuous states, and may not go back behind an event.
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

    /// GUID (FMI 2.0) or instantiationToken (FMI 3.0).
    fn token<M: Model>(layout: Layout) -> &'static str;

    /// Default handler of events for this interface.
    fn events(interface: Interface) -> Events;

    /// Returns true if a host may choose this handler of events for this interface.
    fn allows(interface: Interface, events: Events) -> bool {
        events == Self::events(interface)
    }

    /// The value reference of a scalar.
    fn reference<M: Model>(scalar: &Scalar<M>) -> u32;

    /// The scalar of a value reference, if its values pass as this C type; if not, why.
    fn scalar<M: Model>(
        reference: u32,
        c_type: Option<CType>,
    ) -> Result<&'static Scalar<M>, String>;
}

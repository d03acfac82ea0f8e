//! Data that an instance of FMI 3.0 keeps about its host.

use super::arrays::Arrays;
use super::types::*;
use crate::model::Model;

/// Data that an instance of FMI 3.0 keeps about its host.
pub struct Host<M: Model> {
    pub(super) environment: fmi3InstanceEnvironment,
    pub(super) intermediate_update: fmi3IntermediateUpdateCallback,
    pub(super) early_return_allowed: bool,
    /// The variables that the host wants within steps.
    pub(super) required: Vec<fmi3ValueReference>,
    /// Present phase of an intermediate update.
    pub(super) phase: Phase,
    /// The inputs at the end of the piece that comes, as far as they are set.
    pub(super) ends: M::Inputs,
    /// Inputs that are set.
    pub(super) set: Vec<fmi3ValueReference>,
    /// Room for event indicators.
    pub(super) indicators: Vec<f64>,
    /// The scalars behind the variables that it knows, if these are not the scalars.
    pub(super) arrays: Option<Box<Arrays>>,
    /// The variables that it wants within steps, as it knows them.
    pub(super) required_variables: Vec<fmi3ValueReference>,
}

/// Phases of an intermediate update, by the calls that a host may make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Phase {
    Set,
    Get,
}

impl<M: Model> Host<M> {
    pub(super) fn new(environment: fmi3InstanceEnvironment) -> Host<M> {
        Host {
            environment,
            intermediate_update: None,
            early_return_allowed: false,
            required: Vec::new(),
            phase: Phase::Get,
            ends: M::Inputs::default(),
            set: Vec::new(),
            indicators: vec![0.0; M::table().about.event_indicators],
            arrays: None,
            required_variables: Vec::new(),
        }
    }
}

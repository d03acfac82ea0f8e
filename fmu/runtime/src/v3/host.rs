//! Data that an instance of FMI 3.0 keeps about its host.

use super::arrays::Arrays;
use super::types::*;
use crate::model::Model;

#[allow(missing_docs)]
pub struct Host<M: Model> {
    pub(super) environment: fmi3InstanceEnvironment,
    pub(super) intermediate_update: fmi3IntermediateUpdateCallback,
    pub(super) early_return_allowed: bool,
    pub(super) required: Vec<fmi3ValueReference>,
    pub(super) phase: Phase,
    /// Values that the host has given to inputs in the intermediate update at the start of a step. The inputs change
    /// linearly towards these values, and reach them at the end of the step.
    pub(super) ends: M::Inputs,
    pub(super) set: Vec<fmi3ValueReference>,
    pub(super) indicators: Vec<f64>,
    pub(super) arrays: Option<Box<Arrays>>,
    pub(super) required_variables: Vec<fmi3ValueReference>,
}

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

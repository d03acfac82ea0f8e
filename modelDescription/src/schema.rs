//! The elements of modelDescription.xml, as far as HubSlosh uses them, in the
//! order that the schema of FMI 2.0 demands.

use serde::Serialize;

/// `<fmiModelDescription>`
#[derive(Debug, Serialize)]
#[serde(rename = "fmiModelDescription")]
#[allow(missing_docs)]
pub struct ModelDescription {
    #[serde(rename = "@fmiVersion")]
    pub fmi_version: &'static str,
    #[serde(rename = "@modelName")]
    pub model_name: &'static str,
    #[serde(rename = "@guid")]
    pub guid: String,
    #[serde(rename = "@description")]
    pub description: &'static str,
    #[serde(rename = "@author")]
    pub author: &'static str,
    #[serde(rename = "@version")]
    pub version: &'static str,
    #[serde(rename = "@copyright")]
    pub copyright: String,
    #[serde(rename = "@license")]
    pub license: &'static str,
    #[serde(rename = "@generationTool")]
    pub generation_tool: String,
    #[serde(rename = "@generationDateAndTime")]
    pub generation_date_and_time: &'static str,
    #[serde(rename = "@variableNamingConvention")]
    pub variable_naming_convention: &'static str,
    #[serde(rename = "@numberOfEventIndicators")]
    pub number_of_event_indicators: usize,
    #[serde(rename = "ModelExchange")]
    pub model_exchange: ModelExchange,
    #[serde(rename = "CoSimulation")]
    pub co_simulation: CoSimulation,
    #[serde(rename = "UnitDefinitions")]
    pub units: Units,
    #[serde(rename = "TypeDefinitions")]
    pub types: Option<Types>,
    #[serde(rename = "LogCategories")]
    pub log_categories: LogCategories,
    #[serde(rename = "DefaultExperiment")]
    pub default_experiment: DefaultExperiment,
    #[serde(rename = "ModelVariables")]
    pub variables: Variables,
    #[serde(rename = "ModelStructure")]
    pub structure: Structure,
}

/// `<ModelExchange>`: what the FMU can do when the host integrates.
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct ModelExchange {
    #[serde(rename = "@modelIdentifier")]
    pub model_identifier: &'static str,
    #[serde(rename = "@needsExecutionTool")]
    pub needs_execution_tool: bool,
    #[serde(rename = "@completedIntegratorStepNotNeeded")]
    pub completed_integrator_step_not_needed: bool,
    #[serde(rename = "@canBeInstantiatedOnlyOncePerProcess")]
    pub can_be_instantiated_only_once_per_process: bool,
    #[serde(rename = "@canNotUseMemoryManagementFunctions")]
    pub can_not_use_memory_management_functions: bool,
    #[serde(rename = "@canGetAndSetFMUstate")]
    pub can_get_and_set_fmu_state: bool,
    #[serde(rename = "@canSerializeFMUstate")]
    pub can_serialize_fmu_state: bool,
    #[serde(rename = "@providesDirectionalDerivative")]
    pub provides_directional_derivative: bool,
}

/// `<CoSimulation>`: what the FMU can do when it integrates itself.
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct CoSimulation {
    #[serde(rename = "@modelIdentifier")]
    pub model_identifier: &'static str,
    #[serde(rename = "@needsExecutionTool")]
    pub needs_execution_tool: bool,
    #[serde(rename = "@canHandleVariableCommunicationStepSize")]
    pub can_handle_variable_communication_step_size: bool,
    #[serde(rename = "@canInterpolateInputs")]
    pub can_interpolate_inputs: bool,
    #[serde(rename = "@maxOutputDerivativeOrder")]
    pub max_output_derivative_order: u32,
    #[serde(rename = "@canRunAsynchronuously")]
    pub can_run_asynchronuously: bool,
    #[serde(rename = "@canBeInstantiatedOnlyOncePerProcess")]
    pub can_be_instantiated_only_once_per_process: bool,
    #[serde(rename = "@canNotUseMemoryManagementFunctions")]
    pub can_not_use_memory_management_functions: bool,
    #[serde(rename = "@canGetAndSetFMUstate")]
    pub can_get_and_set_fmu_state: bool,
    #[serde(rename = "@canSerializeFMUstate")]
    pub can_serialize_fmu_state: bool,
    #[serde(rename = "@providesDirectionalDerivative")]
    pub provides_directional_derivative: bool,
}

/// `<UnitDefinitions>`
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct Units {
    #[serde(rename = "Unit")]
    pub all: Vec<Unit>,
}

/// `<Unit>`
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct Unit {
    #[serde(rename = "@name")]
    pub name: &'static str,
    #[serde(rename = "BaseUnit")]
    pub base: Option<BaseUnit>,
    #[serde(rename = "DisplayUnit")]
    pub displayed: Vec<DisplayUnit>,
}

/// `<BaseUnit>`: exponents; those that are 0 are left out.
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct BaseUnit {
    #[serde(rename = "@kg")]
    pub kg: Option<i32>,
    #[serde(rename = "@m")]
    pub m: Option<i32>,
    #[serde(rename = "@s")]
    pub s: Option<i32>,
    #[serde(rename = "@rad")]
    pub rad: Option<i32>,
}

/// `<DisplayUnit>`: value displayed = factor times value.
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct DisplayUnit {
    #[serde(rename = "@name")]
    pub name: &'static str,
    #[serde(rename = "@factor")]
    pub factor: String,
}

/// `<TypeDefinitions>`: the enumerations.
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct Types {
    #[serde(rename = "SimpleType")]
    pub all: Vec<SimpleType>,
}

/// `<SimpleType>`
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct SimpleType {
    #[serde(rename = "@name")]
    pub name: &'static str,
    #[serde(rename = "@description")]
    pub description: &'static str,
    #[serde(rename = "Enumeration")]
    pub enumeration: Items,
}

/// `<Enumeration>` of a type.
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct Items {
    #[serde(rename = "Item")]
    pub all: Vec<Item>,
}

/// `<Item>`
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct Item {
    #[serde(rename = "@name")]
    pub name: &'static str,
    #[serde(rename = "@value")]
    pub value: usize,
    #[serde(rename = "@description")]
    pub description: &'static str,
}

/// `<LogCategories>`
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct LogCategories {
    #[serde(rename = "Category")]
    pub all: Vec<Category>,
}

/// `<Category>`
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct Category {
    #[serde(rename = "@name")]
    pub name: &'static str,
    #[serde(rename = "@description")]
    pub description: String,
}

/// `<DefaultExperiment>`
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct DefaultExperiment {
    #[serde(rename = "@startTime")]
    pub start_time: String,
    #[serde(rename = "@stopTime")]
    pub stop_time: String,
    #[serde(rename = "@tolerance")]
    pub tolerance: String,
    #[serde(rename = "@stepSize")]
    pub step_size: String,
}

/// `<ModelVariables>`
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct Variables {
    #[serde(rename = "ScalarVariable")]
    pub all: Vec<ScalarVariable>,
}

/// `<ScalarVariable>`
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct ScalarVariable {
    #[serde(rename = "@name")]
    pub name: String,
    #[serde(rename = "@valueReference")]
    pub value_reference: u32,
    #[serde(rename = "@description")]
    pub description: &'static str,
    #[serde(rename = "@causality")]
    pub causality: &'static str,
    #[serde(rename = "@variability")]
    pub variability: &'static str,
    #[serde(rename = "@initial")]
    pub initial: Option<&'static str>,
    #[serde(rename = "#content")]
    pub kind: Kind,
}

/// The type of a variable with its attributes.
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub enum Kind {
    Real {
        #[serde(rename = "@unit")]
        unit: Option<&'static str>,
        #[serde(rename = "@displayUnit")]
        display_unit: Option<&'static str>,
        #[serde(rename = "@min")]
        min: Option<String>,
        #[serde(rename = "@max")]
        max: Option<String>,
        #[serde(rename = "@nominal")]
        nominal: Option<String>,
        #[serde(rename = "@start")]
        start: Option<String>,
        #[serde(rename = "@derivative")]
        derivative: Option<usize>,
        #[serde(rename = "@reinit")]
        reinit: Option<bool>,
    },
    Integer {
        #[serde(rename = "@min")]
        min: Option<i32>,
        #[serde(rename = "@max")]
        max: Option<i32>,
        #[serde(rename = "@start")]
        start: Option<String>,
    },
    Boolean {
        #[serde(rename = "@start")]
        start: Option<String>,
    },
    Enumeration {
        #[serde(rename = "@declaredType")]
        declared_type: &'static str,
        #[serde(rename = "@start")]
        start: Option<String>,
    },
}

/// `<ModelStructure>`
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct Structure {
    #[serde(rename = "Outputs")]
    pub outputs: Unknowns,
    #[serde(rename = "Derivatives")]
    pub derivatives: Unknowns,
    #[serde(rename = "InitialUnknowns")]
    pub initial_unknowns: Unknowns,
}

/// A list of `<Unknown>`
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct Unknowns {
    #[serde(rename = "Unknown")]
    pub all: Vec<Unknown>,
}

/// `<Unknown>`: indices are places in ModelVariables, counted from 1.
#[derive(Debug, Serialize)]
#[allow(missing_docs)]
pub struct Unknown {
    #[serde(rename = "@index")]
    pub index: usize,
    #[serde(rename = "@dependencies")]
    pub dependencies: String,
    #[serde(rename = "@dependenciesKind")]
    pub dependencies_kind: String,
}

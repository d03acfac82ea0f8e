//! The schema of modelDescription.xml in FMI 3.0.2 (section 2.4) as a table.

use super::Children::{Any, Choice, Many, Ordered, Sequence};
use super::Written::{Boolean, Double, Int, OneOf, Text, Time, Unsigned};
use super::{
    Attributes, BASE_UNIT, BOOLEANS, Children, DEPENDENCY, DOUBLES, EXPERIMENT, INDICES, INITIAL,
    Kind, LONGS, VARIABILITY, Written, kind,
};

const NAME: Attributes = &[("name", Text)];
const NAMED: Attributes = &[("name", Text), ("valueReference", Unsigned)];
const DESCRIPTION: Attributes = &[("description", Text)];
const WHOLE: Attributes = &[("quantity", Text), ("min", LONGS), ("max", LONGS)];
const TEXT: Attributes = &[("mimeType", Text), ("maxSize", LONGS)];
const NOTE: Children = Sequence(&["Annotations"]);
const INSIDE: Children = Ordered(&["Annotations", "Dimension", "Alias"]);
const INSIDE_TEXT: Children = Ordered(&["Annotations", "Dimension", "Start", "Alias"]);

#[rustfmt::skip]
mod long {
    use super::*;

    pub const TYPES: &[&str] = &["Float32", "Float64", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32",
        "Int64", "UInt64", "Boolean", "String", "Binary", "Enumeration", "Clock"];

    const CAUSALITY: Written = OneOf(&["parameter", "calculatedParameter", "input", "output", "local",
        "independent", "structuralParameter"]);

    pub const OF_ALL: Attributes = &[("description", Text), ("causality", CAUSALITY), ("variability", VARIABILITY),
        ("initial", INITIAL), ("canHandleMultipleSetPerTimeInstant", Boolean), ("clocks", INDICES),
        ("intermediateUpdate", Boolean), ("previous", Unsigned), ("declaredType", Text)];

    pub const FLOAT: Attributes = &[("quantity", Text), ("unit", Text), ("displayUnit", Text),
        ("relativeQuantity", Boolean), ("unbounded", Boolean), ("min", Double), ("max", Double), ("nominal", Double)];

    pub const CLOCK: Attributes = &[("description", Text), ("canBeDeactivated", Boolean), ("priority", Unsigned),
        ("intervalVariability", OneOf(&["constant", "fixed", "tunable", "changing", "countdown", "triggered"])),
        ("intervalDecimal", Double), ("shiftDecimal", Double), ("supportsFraction", Boolean), ("resolution", LONGS),
        ("intervalCounter", LONGS), ("shiftCounter", LONGS), ("causality", CAUSALITY), ("variability", VARIABILITY),
        ("canHandleMultipleSetPerTimeInstant", Boolean), ("clocks", INDICES), ("declaredType", Text)];

    pub const INTERFACE: Attributes = &[("needsExecutionTool", Boolean), ("canBeInstantiatedOnlyOncePerProcess", Boolean),
        ("canGetAndSetFMUState", Boolean), ("canSerializeFMUState", Boolean), ("providesDirectionalDerivatives", Boolean),
        ("providesAdjointDerivatives", Boolean), ("providesPerElementDependencies", Boolean)];
}
use long::*;

#[rustfmt::skip]
pub static KINDS: &[Kind] = &[
    kind("fmiModelDescription",
        &[("fmiVersion", Text), ("modelName", Text), ("instantiationToken", Text)],
        &[("description", Text), ("author", Text), ("version", Text), ("copyright", Text), ("license", Text),
          ("generationTool", Text), ("generationDateAndTime", Time),
          ("variableNamingConvention", OneOf(&["flat", "structured"]))],
        Sequence(&["ModelExchange", "CoSimulation", "ScheduledExecution", "UnitDefinitions", "TypeDefinitions",
            "LogCategories", "DefaultExperiment", "!ModelVariables", "!ModelStructure", "Annotations"])),
    kind("ModelExchange", &[("modelIdentifier", Text)],
        &[("needsCompletedIntegratorStep", Boolean), ("providesEvaluateDiscreteStates", Boolean)], NOTE).and(INTERFACE),
    kind("CoSimulation", &[("modelIdentifier", Text)],
        &[("canHandleVariableCommunicationStepSize", Boolean), ("fixedInternalStepSize", Double),
          ("maxOutputDerivativeOrder", Unsigned), ("recommendedIntermediateInputSmoothness", Int),
          ("providesIntermediateUpdate", Boolean), ("mightReturnEarlyFromDoStep", Boolean),
          ("canReturnEarlyAfterIntermediateUpdate", Boolean), ("hasEventMode", Boolean),
          ("providesEvaluateDiscreteStates", Boolean)], NOTE).and(INTERFACE),
    kind("ScheduledExecution", &[("modelIdentifier", Text)], INTERFACE, NOTE),
    kind("UnitDefinitions", &[], &[], Many(&["Unit"])),
    kind("Unit", NAME, &[], Ordered(&["Annotations", "BaseUnit", "DisplayUnit"])),
    kind("BaseUnit", &[], BASE_UNIT, Sequence(&[])),
    kind("DisplayUnit", NAME, &[("factor", Double), ("offset", Double), ("inverse", Boolean)], NOTE),
    kind("TypeDefinitions", &[], &[], Many(&["Float32Type", "Float64Type", "Int8Type", "UInt8Type", "Int16Type",
        "UInt16Type", "Int32Type", "UInt32Type", "Int64Type", "UInt64Type", "BooleanType", "StringType",
        "BinaryType", "EnumerationType", "ClockType"])),
    kind("Float32Type Float64Type", NAME, FLOAT, NOTE).and(DESCRIPTION),
    kind("Int8Type UInt8Type Int16Type UInt16Type Int32Type UInt32Type Int64Type UInt64Type", NAME, WHOLE, NOTE)
        .and(DESCRIPTION),
    kind("BooleanType StringType", NAME, DESCRIPTION, NOTE),
    kind("BinaryType", NAME, TEXT, NOTE).and(DESCRIPTION),
    kind("EnumerationType", NAME, &[("description", Text), ("quantity", Text)], Choice(&[], &["Annotations", "Item"])),
    kind("ClockType", NAME, CLOCK, NOTE),
    kind("Item", &[("name", Text), ("value", LONGS)], DESCRIPTION, NOTE),
    kind("LogCategories", &[], &[], Many(&["Category"])),
    kind("Category", NAME, DESCRIPTION, NOTE),
    kind("DefaultExperiment", &[], EXPERIMENT, NOTE),
    kind("ModelVariables", &[], &[], Many(TYPES)),
    kind("Float32 Float64", NAMED, FLOAT, INSIDE).and(OF_ALL)
        .then(&[("start", DOUBLES), ("derivative", Unsigned), ("reinit", Boolean)]),
    kind("Int8 UInt8 Int16 UInt16 Int32 UInt32 Int64 UInt64", NAMED, WHOLE, INSIDE).and(OF_ALL)
        .then(&[("start", LONGS)]),
    kind("Boolean", NAMED, &[("start", BOOLEANS)], INSIDE).and(OF_ALL),
    kind("String Binary", NAMED, TEXT, INSIDE_TEXT).and(OF_ALL),
    kind("Enumeration", &[("name", Text), ("valueReference", Unsigned), ("declaredType", Text)], WHOLE, INSIDE)
        .and(OF_ALL).then(&[("start", LONGS)]),
    kind("Clock", NAMED, CLOCK, Ordered(&["Annotations", "Alias"])),
    kind("Dimension", &[], &[("start", LONGS), ("valueReference", Unsigned)], Sequence(&[])),
    kind("Start", &[("value", Text)], &[], Sequence(&[])),
    kind("Alias", NAME, &[("description", Text), ("displayUnit", Text)], NOTE),
    kind("Annotations", &[], &[], Any),
    kind("ModelStructure", &[], &[], Ordered(&["Output", "ContinuousStateDerivative", "ClockedState",
        "InitialUnknown", "EventIndicator"])),
    kind("Output ContinuousStateDerivative ClockedState InitialUnknown EventIndicator", &[("valueReference", Unsigned)],
        &[("dependencies", INDICES), ("dependenciesKind", DEPENDENCY)], NOTE),
];

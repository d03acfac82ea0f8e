//! The schema of modelDescription.xml in FMI 3.0.2 (section 2.4) as a table.

use crate::schema::Children::{Any, Choice, Many, Ordered, Sequence};
use crate::schema::Written::{Boolean, Double, Int, OneOf, Text, Time, Unsigned};
use crate::schema::{
    self, Attributes, BOOLEANS, DEPENDENCY, DOUBLES, INDICES, INITIAL, Kind, LONGS, VARIABILITY,
    Written, kind,
};

use super::description::Description;
use crate::findings::Findings;

const CAUSALITY: Written = OneOf(&[
    "parameter",
    "calculatedParameter",
    "input",
    "output",
    "local",
    "independent",
    "structuralParameter",
]);

/// Elements of ModelVariables; each is a type of variable.
pub const TYPES: &[&str] = &[
    "Float32",
    "Float64",
    "Int8",
    "UInt8",
    "Int16",
    "UInt16",
    "Int32",
    "UInt32",
    "Int64",
    "UInt64",
    "Boolean",
    "String",
    "Binary",
    "Enumeration",
    "Clock",
];

const OF_ALL: Attributes = &[
    ("description", Text),
    ("causality", CAUSALITY),
    ("variability", VARIABILITY),
    ("initial", INITIAL),
    ("canHandleMultipleSetPerTimeInstant", Boolean),
    ("clocks", INDICES),
    ("intermediateUpdate", Boolean),
    ("previous", Unsigned),
    ("declaredType", Text),
];
const FLOAT: Attributes = &[
    ("quantity", Text),
    ("unit", Text),
    ("displayUnit", Text),
    ("relativeQuantity", Boolean),
    ("unbounded", Boolean),
    ("min", Double),
    ("max", Double),
    ("nominal", Double),
    ("start", DOUBLES),
    ("derivative", Unsigned),
    ("reinit", Boolean),
];
const WHOLE: Attributes = &[("quantity", Text), ("min", LONGS), ("max", LONGS), ("start", LONGS)];
const TRUTH: Attributes = &[("start", BOOLEANS)];
const TEXT: Attributes = &[("mimeType", Text), ("maxSize", LONGS)];
const NAMED: Attributes = &[("name", Text), ("valueReference", Unsigned)];
const ENUMERATION: Attributes =
    &[("name", Text), ("valueReference", Unsigned), ("declaredType", Text)];
const INSIDE: schema::Children = Ordered(&["Annotations", "Dimension", "Alias"]);
const INSIDE_TEXT: schema::Children = Ordered(&["Annotations", "Dimension", "Start", "Alias"]);
const FLOAT_TYPE: Attributes = &[
    ("description", Text),
    ("quantity", Text),
    ("unit", Text),
    ("displayUnit", Text),
    ("relativeQuantity", Boolean),
    ("unbounded", Boolean),
    ("min", Double),
    ("max", Double),
    ("nominal", Double),
];
const WHOLE_TYPE: Attributes =
    &[("description", Text), ("quantity", Text), ("min", LONGS), ("max", LONGS)];
const CLOCK_ATTRIBUTES: Attributes = &[
    ("description", Text),
    ("canBeDeactivated", Boolean),
    ("priority", Unsigned),
    (
        "intervalVariability",
        OneOf(&["constant", "fixed", "tunable", "changing", "countdown", "triggered"]),
    ),
    ("intervalDecimal", Double),
    ("shiftDecimal", Double),
    ("supportsFraction", Boolean),
    ("resolution", LONGS),
    ("intervalCounter", LONGS),
    ("shiftCounter", LONGS),
    ("causality", CAUSALITY),
    ("variability", VARIABILITY),
    ("canHandleMultipleSetPerTimeInstant", Boolean),
    ("clocks", INDICES),
    ("declaredType", Text),
];
const NOTE: schema::Children = Sequence(&["Annotations"]);

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
        &[("needsExecutionTool", Boolean), ("canBeInstantiatedOnlyOncePerProcess", Boolean),
          ("canGetAndSetFMUState", Boolean), ("canSerializeFMUState", Boolean),
          ("providesDirectionalDerivatives", Boolean), ("providesAdjointDerivatives", Boolean),
          ("providesPerElementDependencies", Boolean), ("needsCompletedIntegratorStep", Boolean),
          ("providesEvaluateDiscreteStates", Boolean)], NOTE),
    kind("CoSimulation", &[("modelIdentifier", Text)],
        &[("needsExecutionTool", Boolean), ("canBeInstantiatedOnlyOncePerProcess", Boolean),
          ("canGetAndSetFMUState", Boolean), ("canSerializeFMUState", Boolean),
          ("providesDirectionalDerivatives", Boolean), ("providesAdjointDerivatives", Boolean),
          ("providesPerElementDependencies", Boolean), ("canHandleVariableCommunicationStepSize", Boolean),
          ("fixedInternalStepSize", Double), ("maxOutputDerivativeOrder", Unsigned),
          ("recommendedIntermediateInputSmoothness", Int), ("providesIntermediateUpdate", Boolean),
          ("mightReturnEarlyFromDoStep", Boolean), ("canReturnEarlyAfterIntermediateUpdate", Boolean),
          ("hasEventMode", Boolean), ("providesEvaluateDiscreteStates", Boolean)], NOTE),
    kind("ScheduledExecution", &[("modelIdentifier", Text)],
        &[("needsExecutionTool", Boolean), ("canBeInstantiatedOnlyOncePerProcess", Boolean),
          ("canGetAndSetFMUState", Boolean), ("canSerializeFMUState", Boolean),
          ("providesDirectionalDerivatives", Boolean), ("providesAdjointDerivatives", Boolean),
          ("providesPerElementDependencies", Boolean)], NOTE),
    kind("UnitDefinitions", &[], &[], Many(&["Unit"])),
    kind("Unit", &[("name", Text)], &[], Ordered(&["Annotations", "BaseUnit", "DisplayUnit"])),
    kind("BaseUnit", &[],
        &[("kg", Int), ("m", Int), ("s", Int), ("A", Int), ("K", Int), ("mol", Int), ("cd", Int), ("rad", Int),
          ("factor", Double), ("offset", Double)], Sequence(&[])),
    kind("DisplayUnit", &[("name", Text)],
        &[("factor", Double), ("offset", Double), ("inverse", Boolean)], NOTE),
    kind("TypeDefinitions", &[], &[], Many(&["Float32Type", "Float64Type", "Int8Type", "UInt8Type", "Int16Type",
        "UInt16Type", "Int32Type", "UInt32Type", "Int64Type", "UInt64Type", "BooleanType", "StringType",
        "BinaryType", "EnumerationType", "ClockType"])),
    kind("Float32Type", &[("name", Text)], FLOAT_TYPE, NOTE),
    kind("Float64Type", &[("name", Text)], FLOAT_TYPE, NOTE),
    kind("Int8Type", &[("name", Text)], WHOLE_TYPE, NOTE),
    kind("UInt8Type", &[("name", Text)], WHOLE_TYPE, NOTE),
    kind("Int16Type", &[("name", Text)], WHOLE_TYPE, NOTE),
    kind("UInt16Type", &[("name", Text)], WHOLE_TYPE, NOTE),
    kind("Int32Type", &[("name", Text)], WHOLE_TYPE, NOTE),
    kind("UInt32Type", &[("name", Text)], WHOLE_TYPE, NOTE),
    kind("Int64Type", &[("name", Text)], WHOLE_TYPE, NOTE),
    kind("UInt64Type", &[("name", Text)], WHOLE_TYPE, NOTE),
    kind("BooleanType", &[("name", Text)], &[("description", Text)], NOTE),
    kind("StringType", &[("name", Text)], &[("description", Text)], NOTE),
    kind("BinaryType", &[("name", Text)],
        &[("description", Text), ("mimeType", Text), ("maxSize", LONGS)], NOTE),
    kind("EnumerationType", &[("name", Text)], &[("description", Text), ("quantity", Text)],
        Choice(&[], &["Annotations", "Item"])),
    kind("ClockType", &[("name", Text)], CLOCK_ATTRIBUTES, NOTE),
    kind("Item", &[("name", Text), ("value", LONGS)], &[("description", Text)], NOTE),
    kind("LogCategories", &[], &[], Many(&["Category"])),
    kind("Category", &[("name", Text)], &[("description", Text)], NOTE),
    kind("DefaultExperiment", &[],
        &[("startTime", Double), ("stopTime", Double), ("tolerance", Double), ("stepSize", Double)], NOTE),
    kind("ModelVariables", &[], &[], Many(TYPES)),
    kind("Float32", NAMED, FLOAT, INSIDE).and(OF_ALL),
    kind("Float64", NAMED, FLOAT, INSIDE).and(OF_ALL),
    kind("Int8", NAMED, WHOLE, INSIDE).and(OF_ALL),
    kind("UInt8", NAMED, WHOLE, INSIDE).and(OF_ALL),
    kind("Int16", NAMED, WHOLE, INSIDE).and(OF_ALL),
    kind("UInt16", NAMED, WHOLE, INSIDE).and(OF_ALL),
    kind("Int32", NAMED, WHOLE, INSIDE).and(OF_ALL),
    kind("UInt32", NAMED, WHOLE, INSIDE).and(OF_ALL),
    kind("Int64", NAMED, WHOLE, INSIDE).and(OF_ALL),
    kind("UInt64", NAMED, WHOLE, INSIDE).and(OF_ALL),
    kind("Boolean", NAMED, TRUTH, INSIDE).and(OF_ALL),
    kind("String", NAMED, TEXT, INSIDE_TEXT).and(OF_ALL),
    kind("Binary", NAMED, TEXT, INSIDE_TEXT).and(OF_ALL),
    kind("Enumeration", ENUMERATION, WHOLE, INSIDE).and(OF_ALL),
    kind("Clock", NAMED, CLOCK_ATTRIBUTES, Ordered(&["Annotations", "Alias"])),
    kind("Dimension", &[], &[("start", LONGS), ("valueReference", Unsigned)], Sequence(&[])),
    kind("Start", &[("value", Text)], &[], Sequence(&[])),
    kind("Alias", &[("name", Text)], &[("description", Text), ("displayUnit", Text)], NOTE),
    kind("Annotations", &[], &[], Any),
    kind("ModelStructure", &[], &[], Ordered(&["Output", "ContinuousStateDerivative", "ClockedState",
        "InitialUnknown", "EventIndicator"])),
    kind("Output", &[("valueReference", Unsigned)],
        &[("dependencies", INDICES), ("dependenciesKind", DEPENDENCY)], NOTE),
    kind("ContinuousStateDerivative", &[("valueReference", Unsigned)],
        &[("dependencies", INDICES), ("dependenciesKind", DEPENDENCY)], NOTE),
    kind("ClockedState", &[("valueReference", Unsigned)],
        &[("dependencies", INDICES), ("dependenciesKind", DEPENDENCY)], NOTE),
    kind("InitialUnknown", &[("valueReference", Unsigned)],
        &[("dependencies", INDICES), ("dependenciesKind", DEPENDENCY)], NOTE),
    kind("EventIndicator", &[("valueReference", Unsigned)],
        &[("dependencies", INDICES), ("dependenciesKind", DEPENDENCY)], NOTE),
];

pub fn structure(description: &Description, findings: &mut Findings) {
    schema::structure_by(KINDS, &description.root, findings);
}

pub fn values(description: &Description, findings: &mut Findings) {
    schema::values_by(KINDS, &description.root, findings);
}

use host::causality::{Causality, Variability};
use host::description::{ArrayElement, ModelDescription, Type, Value};

const XML: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="M" guid="{1}" version="0.1" numberOfEventIndicators="0">
  <CoSimulation modelIdentifier="M" canHandleVariableCommunicationStepSize="true">
    <SourceFiles><File name="a.c"/></SourceFiles>
  </CoSimulation>
  <UnitDefinitions><Unit name="rad"><BaseUnit rad="1"/><DisplayUnit name="deg" factor="57.3"/></Unit></UnitDefinitions>
  <TypeDefinitions><SimpleType name="Model"><Enumeration><Item name="frozen" value="1"/><Item name="linear" value="2"/></Enumeration></SimpleType></TypeDefinitions>
  <LogCategories><Category name="logAll"/></LogCategories>
  <DefaultExperiment startTime="0" stopTime="10.5" tolerance="1e-6"/>
  <ModelVariables>
    <!-- a comment -->
    <ScalarVariable name="omega" valueReference="3" causality="output" variability="continuous" initial="calculated"><Real unit="rad/s"/></ScalarVariable>
    <ScalarVariable name="slosh.model" valueReference="4" causality="parameter" variability="fixed" initial="exact"><Enumeration declaredType="Model" start="2"/></ScalarVariable>
    <ScalarVariable name="wheel.enabled" valueReference="5" causality="parameter" variability="fixed"><Boolean start="false"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="1" dependencies=""/></Outputs></ModelStructure>
</fmiModelDescription>"#;

#[test]
fn names_types_and_enumeration_items_of_a_model_description_are_read() {
    let d = ModelDescription::from_xml(XML).unwrap();
    assert_eq!(d.co_simulation.as_ref().unwrap().model_identifier, "M");
    assert_eq!(d.default_experiment.stop_time, Some(10.5));
    let model = d.variable("slosh.model").unwrap();
    assert_eq!((model.kind(), model.reference), (Type::Enumeration, 4));
    assert_eq!(d.items(model)[1].name, "linear");
    assert_eq!(d.variable("omega").unwrap().attributes().unit.as_deref(), Some("rad/s"));
    assert_eq!(d.variable("wheel.enabled").unwrap().kind(), Type::Boolean);
}

#[test]
fn a_number_may_have_the_variable_s_own_unit_or_a_display_unit() {
    let with_angle = XML.replace(
        "<ScalarVariable name=\"wheel.enabled\"",
        "<ScalarVariable name=\"angle\" valueReference=\"9\" causality=\"parameter\" variability=\"fixed\">\
         <Real unit=\"rad\" start=\"0\"/></ScalarVariable><ScalarVariable name=\"wheel.enabled\"",
    );
    let d = ModelDescription::from_xml(&with_angle).unwrap();
    let angle = d.variable("angle").unwrap();
    for (text, value) in [
        ("5e-1", 0.5),
        ("0.5rad", 0.5),
        (" -5E-1 rad ", -0.5),
        ("573deg", 573.0 / 57.3),
        ("+573 deg", 573.0 / 57.3),
    ] {
        assert_eq!(d.value(angle, text).unwrap(), Value::Real(value), "{text}");
    }
    for (text, why) in [
        ("5 mm", "angle has no unit \"mm\" (allowed: rad, deg)"),
        ("5 deg deg", "angle has no unit \"deg deg\" (allowed: rad, deg)"),
        ("deg", "angle expects a number, not \"deg\""),
        ("", "angle expects a number, not \"\""),
        ("µ5", "angle expects a number, not \"µ5\""),
    ] {
        assert_eq!(d.value(angle, text).unwrap_err().to_string(), why);
    }
    let omega = d.variable("omega").unwrap();
    let why = d.value(omega, "5 rpm").unwrap_err().to_string();
    assert_eq!(why, "omega has no unit \"rpm\" (allowed: rad/s)");
}

#[test]
fn all_missing_attributes_of_a_model_description_are_reported_with_their_lines() {
    let broken =
        XML.replace(" guid=\"{1}\"", "").replace("valueReference=\"3\"", "valueReference=\"x\"");
    let error = ModelDescription::from_xml(&broken).unwrap_err().to_string();
    for words in ["line 2, fmiModelDescription: guid is missing", "valueReference cannot be \"x\""]
    {
        assert!(error.contains(words), "{words}: {error}");
    }
}

const XML3: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="M" instantiationToken="{2}">
  <CoSimulation modelIdentifier="M" providesIntermediateUpdate="true"/>
  <UnitDefinitions><Unit name="rad"><BaseUnit rad="1"/><DisplayUnit name="deg" factor="57.3"/></Unit></UnitDefinitions>
  <TypeDefinitions><Float64Type name="Angle" unit="rad"/><EnumerationType name="Model"><Item name="frozen" value="1"/><Item name="linear" value="2"/></EnumerationType></TypeDefinitions>
  <ModelVariables>
    <UInt64 name="n" valueReference="7" causality="structuralParameter" start="2"/>
    <Float64 name="a" valueReference="2" causality="input" declaredType="Angle" start="1 2 3 4 5 6" intermediateUpdate="true"><Dimension start="3"/><Dimension valueReference="7"/></Float64>
    <Float64 name="y" valueReference="3" causality="output"><Alias name="z" displayUnit="deg"/></Float64>
    <Enumeration name="model" valueReference="4" causality="parameter" declaredType="Model" start="2"/>
    <UInt8 name="small" valueReference="5" causality="parameter" start="2"/>
    <String name="text" valueReference="6" causality="parameter"><Start value="one word"/></String>
  </ModelVariables>
  <ModelStructure/>
</fmiModelDescription>"#;

#[test]
fn arrays_of_fmi_3_are_read_as_elements_in_row_major_order() {
    let d = ModelDescription::from_xml(XML3).unwrap();
    let elements = d.variables.iter().filter(|v| v.causality == Causality::Input);
    let elements: Vec<_> =
        elements.map(|v| (v.name.as_str(), v.attributes().start.as_deref().unwrap())).collect();
    let all = [("a[1,1]", "1"), ("a[1,2]", "2"), ("a[2,1]", "3"), ("a[2,2]", "4")];
    assert_eq!(elements[..4], all);
    let last = d.variable("a[3,2]").unwrap();
    assert_eq!(d.element(last.reference), Some(ArrayElement { array: 2, index: 5 }));
    assert!(!d.variables.iter().any(|v| v.name != "a[3,2]" && v.reference == last.reference));
    assert_eq!(d.array(2).unwrap().length, 6);
    assert_eq!((d.unit(last), last.intermediate), ("rad", true));
}

#[test]
fn an_alias_of_an_fmi_3_output_has_the_value_reference_of_the_output_and_is_local() {
    let d = ModelDescription::from_xml(XML3).unwrap();
    let (y, z) = (d.variable("y").unwrap(), d.variable("z").unwrap());
    assert_eq!((y.reference, &y.causality), (z.reference, &Causality::Output));
    let displayed = z.attributes().display_unit.as_deref();
    assert_eq!((&z.causality, displayed), (&Causality::Local, Some("deg")));
}

#[test]
fn an_integer_value_of_fmi_3_must_fit_the_declared_type() {
    let d = ModelDescription::from_xml(XML3).unwrap();
    let small = d.variable("small").unwrap();
    assert_eq!(d.value(small, "255").unwrap(), Value::Integer(255));
    let why = d.value(small, "256").unwrap_err().to_string();
    assert_eq!(why, "small expects a whole number from 0 to 255, not 256");
    assert_eq!(d.value(d.variable("model").unwrap(), "frozen").unwrap(), Value::Integer(1));
    assert_eq!(d.variable("text").unwrap().attributes().start.as_deref(), Some("one word"));
    assert_eq!(d.variable("n").unwrap().variability, Variability::Fixed);
}

#[test]
fn the_error_about_a_misspelt_variable_suggests_similar_names() {
    let d = ModelDescription::from_xml(XML).unwrap();
    let error = d.variable("slosh.modle").unwrap_err().to_string();
    assert!(error.contains("did you mean \"slosh.model\""), "{error}");
    let error = d.variable("enabled").unwrap_err().to_string();
    assert_eq!(error, "the FMU has no variable \"enabled\"; did you mean \"wheel.enabled\"?");
}

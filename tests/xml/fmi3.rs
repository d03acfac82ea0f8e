//! modelDescription.xml of FMI 3.0 describes every variable in the same way as that of FMI 2.0, and has the additional
//! data that FMI 3.0 requires.

use std::collections::BTreeMap;

use host::xml::Element;
use runtime::Model;
use runtime::table::{Layout, Scalar};
use runtime::v3::Fmi3;
use runtime::variable::Access;
use runtime::version::Version;

fn parse(text: &str) -> Element {
    Element::parse(text.as_bytes()).unwrap()
}

fn description_2<M: Model>() -> Element {
    parse(&model_description::xml::<M>().unwrap())
}

fn description_3<M: Model>() -> Element {
    parse(&model_description::fmi3::xml::<M>(Layout::Scalars).unwrap())
}

fn every_variable_is_as_in_fmi_2<M: Model>() {
    let (two, three) = (description_2::<M>(), description_3::<M>());
    let (old, new): (Vec<_>, Vec<_>) =
        (two.list("ModelVariables").collect(), three.list("ModelVariables").collect());
    let indicators = M::table().about.event_indicators;
    assert_eq!(new.len(), old.len() + 1 + indicators);
    for (place, (old, new)) in old.iter().zip(&new).enumerate() {
        let name = old.get("name").unwrap();
        let kind = &old.children[0];
        let types = [
            ("Real", "Float64"),
            ("Integer", "Int32"),
            ("Boolean", "Boolean"),
            ("Enumeration", "Enumeration"),
        ];
        assert!(types.contains(&(&*kind.name, &*new.name)), "{name}: {}", new.name);
        for attribute in ["name", "description", "causality", "variability"] {
            assert_eq!(old.get(attribute), new.get(attribute), "{name}");
        }
        for attribute in
            ["unit", "displayUnit", "min", "max", "nominal", "start", "declaredType", "reinit"]
        {
            assert_eq!(kind.get(attribute), new.get(attribute), "{name} {attribute}");
        }
        // Inputs have no attribute `initial` in either version: exact is the default, and CasADi accepts no other form.
        assert_eq!(old.get("initial"), new.get("initial"), "{name}");
        assert_eq!(new.get("initial").is_none(), new.get("causality") == Some("input"), "{name}");
        // Variables have the same position in both versions, and the value reference in FMI 3.0 is the position counted from 1.
        let reference = (place + 1).to_string();
        assert_eq!(new.get("valueReference"), Some(&*reference), "{name}");
        assert_eq!(kind.get("derivative"), new.get("derivative"), "{name}");
        let port = matches!(old.get("causality"), Some("input" | "output")) && kind.name == "Real";
        let follows = M::table().scalars[place].variable.follows_inputs;
        assert_eq!(new.get("intermediateUpdate"), (port && !follows).then_some("true"), "{name}");
    }
    let [time, z @ ..] = &new[old.len()..] else { panic!("no independent variable") };
    assert_eq!((time.get("causality"), time.get("unit")), (Some("independent"), Some("s")));
    assert_eq!((time.get("start"), time.get("initial"), time.get("min")), (None, None, None));
    for z in z {
        assert_eq!((z.get("causality"), z.get("variability")), (Some("local"), Some("continuous")));
        assert_eq!(z.get("start"), None);
    }
    let mut names: BTreeMap<_, u32> = BTreeMap::new();
    new.iter().for_each(|v| *names.entry(v.get("name").unwrap()).or_default() += 1);
    assert!(names.values().all(|count| *count == 1), "names are unique");
}

#[test]
fn every_variable_of_fmi_3_has_the_attributes_of_fmi_2() {
    every_variable_is_as_in_fmi_2::<HubSlosh::HubSlosh>();
    every_variable_is_as_in_fmi_2::<Spacecraft::Model>();
    every_variable_is_as_in_fmi_2::<SloshTank::Model>();
}

fn an_input_follows_others_exactly_where_the_model_sets_its_slope<M: Model>() {
    let given = 0.25;
    let mut inputs = M::Inputs::default();
    let slope = |inputs: &mut M::Inputs, scalar: &Scalar<M>| match scalar.access {
        Access::Input(ramp) => std::mem::replace(ramp(inputs, scalar.element)[1], given),
        _ => panic!("{} is not an input", scalar.name()),
    };
    for scalar in M::table().inputs() {
        slope(&mut inputs, scalar);
    }
    M::set_dependent_slopes(&mut inputs, 0.1);
    for scalar in M::table().inputs() {
        let is_set = slope(&mut inputs, scalar) != given;
        assert_eq!(is_set, scalar.variable.follows_inputs, "{}", scalar.name());
    }
}

/// If an input is the derivative of another input, the model itself changes the other input within a step. Therefore a host
/// cannot set the other input within steps.
#[test]
fn only_inputs_whose_slopes_the_model_sets_lack_intermediate_update() {
    an_input_follows_others_exactly_where_the_model_sets_its_slope::<HubSlosh::HubSlosh>();
    an_input_follows_others_exactly_where_the_model_sets_its_slope::<Spacecraft::Model>();
    an_input_follows_others_exactly_where_the_model_sets_its_slope::<SloshTank::Model>();
}

fn the_structure_is_as_in_fmi_2<M: Model>() {
    let (two, three) = (description_2::<M>(), description_3::<M>());
    let old = two.child("ModelStructure").unwrap();
    let new = three.child("ModelStructure").unwrap();
    for (list, element) in [
        ("Outputs", "Output"),
        ("Derivatives", "ContinuousStateDerivative"),
        ("InitialUnknowns", "InitialUnknown"),
    ] {
        let of = |element: &Element, reference: &str| {
            [reference, "dependencies", "dependenciesKind"]
                .map(|name| element.get(name).map(String::from))
        };
        let old: Vec<_> = old.list(list).map(|unknown| of(unknown, "index")).collect();
        let new = new.children.iter().filter(|child| child.name == element);
        let new: Vec<_> = new.map(|unknown| of(unknown, "valueReference")).collect();
        assert_eq!(old.len(), new.len(), "{list}");
        for (old, new) in old.iter().zip(&new) {
            // Long lists of dependencies of initial values exist in FMI 2.0 only for some outputs, and have no kinds in FMI 3.0.
            let has_kinds = new[2].is_some();
            let known = if has_kinds { 3 } else { 1 + usize::from(old[1].is_some()) };
            let is_long = new[1].as_ref().is_some_and(|list| list.split(' ').count() > 100);
            assert_eq!(old[..known], new[..known], "{list}");
            let is_none = new[1].as_ref().is_some_and(String::is_empty);
            assert!(
                has_kinds || is_none || is_long && list == "InitialUnknowns",
                "{list}: {new:?}"
            );
        }
    }
    let indicators: Vec<_> =
        new.children.iter().filter(|child| child.name == "EventIndicator").collect();
    assert_eq!(indicators.len(), M::table().about.event_indicators);
    let first = M::table().scalars.len() + 2;
    for (n, indicator) in indicators.iter().enumerate() {
        assert_eq!(indicator.get("valueReference"), Some(&*(first + n).to_string()));
        assert!(indicator.get("dependencies").is_some());
    }
    let order: Vec<_> = new.children.iter().map(|child| &*child.name).collect();
    let mut sorted = order.clone();
    let rank = |name: &str| {
        ["Output", "ContinuousStateDerivative", "InitialUnknown", "EventIndicator"]
            .iter()
            .position(|n| *n == name)
    };
    sorted.sort_by_key(|name| rank(name));
    assert_eq!(order, sorted);
}

/// The ModelStructure of FMI 3.0 must have the outputs, states and initial unknowns of FMI 2.0 with their dependencies, and
/// also the event indicators.
#[test]
fn the_structure_of_fmi_3_equals_that_of_fmi_2_with_event_indicators() {
    the_structure_is_as_in_fmi_2::<HubSlosh::HubSlosh>();
    the_structure_is_as_in_fmi_2::<Spacecraft::Model>();
    the_structure_is_as_in_fmi_2::<SloshTank::Model>();
}

fn units_are_defined<M: Model>() {
    let three = description_3::<M>();
    let mut defined: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for unit in three.list("UnitDefinitions") {
        let shown = unit.children.iter().filter(|child| child.name == "DisplayUnit");
        let shown = shown.map(|shown| shown.get("name").unwrap().to_string()).collect();
        defined.insert(unit.get("name").unwrap().into(), shown);
    }
    for variable in three.list("ModelVariables") {
        let name = variable.get("name").unwrap();
        let Some(unit) = variable.get("unit") else { continue };
        let shown = defined.get(unit).unwrap_or_else(|| panic!("{name}: {unit} is not defined"));
        let display = variable.get("displayUnit");
        assert!(display.is_none_or(|display| shown.iter().any(|s| s == display)), "{name}");
    }
}

#[test]
fn every_unit_of_fmi_3_is_defined_including_the_unit_of_time() {
    units_are_defined::<HubSlosh::HubSlosh>();
    units_are_defined::<Spacecraft::Model>();
    units_are_defined::<SloshTank::Model>();
}

#[test]
fn the_root_element_of_fmi_3_has_its_own_token_and_the_form_of_the_schema() {
    let text = model_description::fmi3::xml::<HubSlosh::HubSlosh>(Layout::Scalars).unwrap();
    assert!(text.starts_with(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"3.0\""
    ));
    let (two, three) =
        (description_2::<HubSlosh::HubSlosh>(), description_3::<HubSlosh::HubSlosh>());
    assert_eq!(
        three.get("instantiationToken"),
        Some(Fmi3::token::<HubSlosh::HubSlosh>(Layout::Scalars))
    );
    assert_ne!(three.get("instantiationToken"), two.get("guid"));
    for attribute in ["modelName", "description", "author", "version", "generationDateAndTime"] {
        assert_eq!(two.get(attribute), three.get(attribute));
    }
    assert!(three.get("generationDateAndTime").unwrap().ends_with('Z'));
    let order: Vec<_> = three.children.iter().map(|child| &*child.name).collect();
    assert_eq!(
        order,
        [
            "ModelExchange",
            "CoSimulation",
            "UnitDefinitions",
            "TypeDefinitions",
            "LogCategories",
            "DefaultExperiment",
            "ModelVariables",
            "ModelStructure",
        ]
    );
    let identifier = |interface: &str| three.child(interface).unwrap().get("modelIdentifier");
    assert_eq!(
        (identifier("ModelExchange"), identifier("CoSimulation")),
        (Some("HubSlosh"), Some("HubSlosh"))
    );
}

fn capabilities_are_shown<M: Model>() {
    let (two, three) = (description_2::<M>(), description_3::<M>());
    let flags = |interface: &str| -> BTreeMap<String, String> {
        let element = three.child(interface).unwrap();
        let others = element.attributes.iter().filter(|(name, _)| name != "modelIdentifier");
        others.map(|(name, value)| (name.to_string(), value.to_string())).collect()
    };
    let both = [
        ("needsExecutionTool", "false"),
        ("canBeInstantiatedOnlyOncePerProcess", "false"),
        ("canGetAndSetFMUState", "true"),
        ("canSerializeFMUState", "true"),
        ("providesDirectionalDerivatives", "true"),
        ("providesAdjointDerivatives", "true"),
        ("providesPerElementDependencies", "true"),
        ("providesEvaluateDiscreteStates", "false"),
    ];
    let exchange = [("needsCompletedIntegratorStep", "true")];
    let steps = [
        ("canHandleVariableCommunicationStepSize", "true"),
        ("maxOutputDerivativeOrder", "1"),
        ("hasEventMode", "true"),
        ("mightReturnEarlyFromDoStep", "true"),
        ("providesIntermediateUpdate", "true"),
        ("canReturnEarlyAfterIntermediateUpdate", "true"),
    ];
    for (interface, more) in [("ModelExchange", &exchange[..]), ("CoSimulation", &steps[..])] {
        let expected = both.iter().chain(more).map(|(a, b)| (a.to_string(), b.to_string()));
        assert_eq!(flags(interface), expected.collect(), "{interface}");
    }
    assert_eq!(three.get("variableNamingConvention"), Some("structured"));
    for name in ["startTime", "stopTime", "tolerance", "stepSize"] {
        let of =
            |root: &Element| root.child("DefaultExperiment").unwrap().get(name).map(String::from);
        assert!(of(&three).is_some() && of(&three) == of(&two), "{name}");
    }
    let names = |root: &Element| -> Vec<String> {
        root.list("LogCategories").map(|category| category.get("name").unwrap().into()).collect()
    };
    assert_eq!(names(&two), names(&three), "log categories");
    for variable in three.list("ModelVariables") {
        let name = variable.get("name").unwrap();
        assert!(variable.children.is_empty(), "{name} has aliases or dimensions");
        for attribute in ["clocks", "previous", "canHandleMultipleSetPerTimeInstant"] {
            assert_eq!(variable.get(attribute), None, "{name}");
        }
    }
}

#[test]
fn every_declared_capability_of_fmi_3_has_a_test() {
    capabilities_are_shown::<HubSlosh::HubSlosh>();
    capabilities_are_shown::<Spacecraft::Model>();
    capabilities_are_shown::<SloshTank::Model>();
}

//! Tests that modelDescription.xml agrees with the binary, and is valid by the standard.

use std::collections::{BTreeMap, BTreeSet};

use HubSlosh::table::TABLE;
use host::xml::{Element, double};
use plant::{FrictionModel, SloshModel, SloshSource};
use runtime::call::Interface;
use runtime::v2::{GET_BOOLEAN, GET_INTEGER, GET_REAL};
use runtime::variable::{Causality, Kind, Value, Variable};

fn number(element: &Element, attribute: &str) -> Option<f64> {
    element.get(attribute).map(|text| double(text).unwrap())
}

fn indices(element: &Element, attribute: &str) -> Vec<usize> {
    let words = element.get(attribute).unwrap_or_default().split_whitespace();
    words.map(|word| word.parse().unwrap()).collect()
}

fn committed() -> String {
    std::fs::read_to_string(model_description::path::<HubSlosh::HubSlosh>()).unwrap()
}

fn root() -> Element {
    Element::parse(committed().as_bytes()).unwrap()
}

fn variables() -> Vec<(Element, Element)> {
    let root = root();
    let of_type = |variable: &Element| (variable.clone(), variable.children[0].clone());
    root.list("ModelVariables").map(of_type).collect()
}

fn unknowns(list: &str) -> Vec<Element> {
    root().child("ModelStructure").unwrap().list(list).cloned().collect()
}

#[test]
fn the_committed_model_description_equals_the_table() {
    assert!(
        committed() == model_description::xml::<HubSlosh::HubSlosh>().unwrap(),
        "modelDescription.xml is out of date: run `cargo run --release -p model-description`"
    );
}

#[test]
fn the_guid_in_the_model_description_equals_the_guid_of_the_binary() {
    assert_eq!(root().get("guid"), Some(TABLE.guid()));
}

#[test]
fn start_values_equal_those_of_the_binary_to_the_last_bit() {
    let mut fresh = HubSlosh::instance(Interface::CoSimulation);
    let mut count = 0;
    for (variable, kind) in variables() {
        let Some(start) = kind.get("start") else { continue };
        let reference = variable.get("valueReference").unwrap().parse().unwrap();
        match &*kind.name {
            "Real" => {
                let Value::Real(x) = fresh.get(&GET_REAL, reference).unwrap() else { panic!() };
                assert_eq!(start.parse::<f64>().unwrap().to_bits(), x.to_bits());
            }
            "Boolean" => {
                let value = fresh.get(&GET_BOOLEAN, reference).unwrap();
                assert_eq!(Value::Boolean(start.parse().unwrap()), value);
            }
            _ => {
                let value = fresh.get(&GET_INTEGER, reference).unwrap();
                assert_eq!(Value::Integer(start.parse().unwrap()), value);
            }
        }
        count += 1;
    }
    let set_by_host = [Causality::Input, Causality::Parameter];
    let expected = TABLE.scalars.iter().filter(|s| set_by_host.contains(&s.variable.causality));
    assert_eq!(count, expected.count());
}

#[test]
fn start_values_are_within_min_and_max() {
    for (variable, kind) in variables() {
        if !matches!(&*kind.name, "Real" | "Integer") {
            continue;
        }
        let (min, max) = (number(&kind, "min"), number(&kind, "max"));
        let name = variable.get("name").unwrap();
        if let Some(start) = number(&kind, "start") {
            assert!(min.is_none_or(|min| min <= start), "{name}");
            assert!(max.is_none_or(|max| start <= max), "{name}");
        }
        if let (Some(min), Some(max)) = (min, max) {
            assert!(min < max, "{name}");
        }
    }
}

/// For example, a Real input is continuous and has a start value. A parameter has a start value and is fixed, except for
/// friction parameters, which are tunable.
#[test]
fn the_causality_of_a_variable_determines_its_variability_initial_and_start() {
    for (variable, kind) in variables() {
        let name = variable.get("name").unwrap();
        let moving = if kind.name == "Real" { "continuous" } else { "discrete" };
        let expected = match variable.get("causality").unwrap() {
            "input" => (moving, None, true),
            "output" | "local" => (moving, Some("calculated"), false),
            // Friction parameters are tunable, because friction can change during a run.
            "parameter" if name.starts_with("friction.") => ("tunable", Some("exact"), true),
            "parameter" => ("fixed", Some("exact"), true),
            "calculatedParameter" => ("fixed", Some("calculated"), false),
            other => panic!("{name}: {other}"),
        };
        let variability = variable.get("variability").unwrap();
        let found = (variability, variable.get("initial"), kind.get("start").is_some());
        assert_eq!(found, expected, "{name}");
        assert!(variable.get("description").is_some_and(|d| !d.is_empty()), "{name}");
    }
}

#[test]
fn names_and_value_references_of_variables_are_unique() {
    let all = variables();
    for attribute in ["name", "valueReference"] {
        let unique: BTreeSet<_> = all.iter().map(|(v, _)| v.get(attribute).unwrap()).collect();
        assert_eq!(unique.len(), all.len(), "{attribute}");
    }
}

/// Simulink turns ports whose names contain dots into buses, and cuts names of parameters after 55 characters.
#[test]
fn inputs_and_outputs_have_names_without_dots_and_parameters_short_names() {
    for (variable, _) in variables() {
        let name = variable.get("name").unwrap();
        match variable.get("causality").unwrap() {
            "input" | "output" => assert!(!name.contains(['.', '[']), "{name}"),
            _ => assert!(name.len() <= 55, "{name}"),
        }
    }
}

#[test]
fn every_unit_and_display_unit_is_defined() {
    let mut units: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for unit in root().list("UnitDefinitions") {
        let displayed = unit.children.iter().filter(|child| child.name == "DisplayUnit");
        let displayed = displayed.map(|display| {
            assert!(number(display, "factor").unwrap() > 0.0);
            display.get("name").unwrap().to_string()
        });
        units.insert(unit.get("name").unwrap().into(), displayed.collect());
    }
    let mut used = BTreeSet::new();
    for (variable, kind) in variables() {
        if kind.name == "Real" {
            let name = variable.get("name").unwrap();
            // The unit of the slosh modes' coordinates depends on the slosh model.
            let Some(unit) = kind.get("unit") else {
                assert!(name.contains("slosh.q_") || name.contains("slosh.v_"), "{name}");
                continue;
            };
            let displayed = units.get(unit).unwrap_or_else(|| panic!("unit of {name}"));
            if let Some(display_unit) = kind.get("displayUnit") {
                assert!(displayed.contains(display_unit), "display unit of {name}");
            }
            used.insert(unit.to_string());
        }
    }
    assert_eq!(used, units.into_keys().collect(), "units that nobody uses");
}

#[test]
fn every_enumeration_is_declared_with_its_items() {
    let root = root();
    let types: BTreeSet<_> =
        root.list("TypeDefinitions").map(|of| of.get("name").unwrap()).collect();
    for (variable, kind) in variables() {
        if kind.name == "Enumeration" {
            let declared = kind.get("declaredType").unwrap();
            assert!(types.contains(declared), "{}", variable.get("name").unwrap());
        }
    }
}

/// Hosts set these enumerations by number, so that the numbers must be those of the physics crate.
#[test]
fn enumerations_have_the_items_of_the_physics_crate_in_their_order() {
    fn compare<T: std::fmt::Debug>(variable: &str, all: &[T]) {
        let variable = TABLE.variables.iter().find(|v| v.name == variable).unwrap();
        let Kind::Enumeration(of) = variable.kind else { panic!("{} is none", variable.name) };
        let items: Vec<String> = of.items.iter().map(|item| item.name.replace('_', "")).collect();
        let own: Vec<String> = all.iter().map(|item| format!("{item:?}").to_lowercase()).collect();
        assert_eq!(
            items, own,
            "{}: the items in fmu/hubslosh/src/table.rs (left) must be those of ALL in fmu/plant/src/parameters.rs (right), in its \
             order",
            variable.name
        );
    }
    compare("slosh.model", &SloshModel::ALL);
    compare("slosh.source", &SloshSource::ALL);
    compare("friction.model", &FrictionModel::ALL);
}

#[test]
fn every_slosh_model_and_friction_law_is_in_the_documentation() {
    let has = |page: &str, text: String| {
        let all = std::fs::read_to_string(pack::root().join(page)).unwrap();
        let all = all.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(all.contains(&text), "{page} does not contain: {text}");
    };
    for name in ["slosh.model", "friction.model"] {
        let variable = TABLE.variables.iter().find(|v| v.name == name).unwrap();
        let Kind::Enumeration(of) = variable.kind else { panic!("{name} is none") };
        let mut numbered = Vec::new();
        for (item, number) in of.items.iter().zip(1..) {
            has("modelDescription/HubSlosh/documentation/model.md", format!("`{}`", item.name));
            has("book/choosing.md", format!("`{}`", item.name));
            numbered.push(format!("{number} {}", item.name));
        }
        has("book/host_setup.md", format!("`{name}`: {}", numbered.join(", ")));
    }
}

/// ModelStructure lists each output and each state derivative once. Its initial unknowns are all variables that are computed
/// during initialisation.
#[test]
fn the_structure_lists_every_output_and_every_variable_computed_at_the_start_once() {
    let with = |causalities: &[&str]| -> Vec<usize> {
        let all = variables();
        let meant = all
            .iter()
            .zip(1..)
            .filter(|((v, _), _)| causalities.contains(&v.get("causality").unwrap()));
        meant.map(|(_, index)| index).collect()
    };
    let listed = |list: &str| -> Vec<usize> {
        unknowns(list).iter().map(|e| e.get("index").unwrap().parse().unwrap()).collect()
    };
    assert_eq!(listed("Outputs"), with(&["output"]));
    let mut initial = with(&["output", "calculatedParameter"]);
    for (rate, state) in derivatives() {
        initial.extend([rate, state]);
    }
    initial.sort_unstable();
    initial.dedup();
    assert_eq!(listed("InitialUnknowns"), initial);
    let rates: Vec<_> = derivatives().into_iter().map(|(rate, _)| rate).collect();
    assert_eq!(listed("Derivatives"), rates);
}

fn derivatives() -> Vec<(usize, usize)> {
    let all = variables();
    let with_index = all.iter().zip(1..);
    with_index
        .filter_map(|((_, kind), index)| Some((index, kind.get("derivative")?.parse().unwrap())))
        .collect()
}

#[test]
fn states_are_continuous_each_has_one_derivative_and_only_states_are_reinitialised() {
    let all = variables();
    let states: BTreeSet<usize> = derivatives().into_iter().map(|(_, state)| state).collect();
    assert_eq!((states.len(), derivatives().len()), (plant::STATES, plant::STATES));
    for (rate, state) in derivatives() {
        let (rate, state) = (&all[rate - 1].0, &all[state - 1].0);
        assert_eq!(rate.get("name").unwrap(), format!("der({})", state.get("name").unwrap()));
        assert_eq!(state.get("variability"), Some("continuous"));
    }
    let reinitialised: Vec<usize> = all
        .iter()
        .zip(1..)
        .filter(|((_, kind), _)| kind.get("reinit") == Some("true"))
        .map(|(_, index)| index)
        .collect();
    assert_eq!(reinitialised.len(), 2);
    assert!(reinitialised.iter().all(|index| states.contains(index)));
    let indicators: usize = root().get("numberOfEventIndicators").unwrap().parse().unwrap();
    assert_eq!(indicators, plant::INDICATORS);
}

/// An importer treats missing dependencies as a dependency on everything, and sees algebraic loops where there are none.
#[test]
fn every_dependency_list_is_given_and_contains_only_inputs_parameters_and_states() {
    let all = variables();
    let states: BTreeSet<usize> = derivatives().into_iter().map(|(_, state)| state).collect();
    let kind = |index: &usize| match all[index - 1].0.get("causality").unwrap() {
        "output" | "local" if states.contains(index) => "state",
        causality => causality,
    };
    for (list, allowed) in [
        ("Outputs", ["input", "state"]),
        ("Derivatives", ["input", "state"]),
        ("InitialUnknowns", ["input", "parameter"]),
    ] {
        for unknown in unknowns(list) {
            let dependencies = indices(&unknown, "dependencies");
            assert!(dependencies.is_sorted_by(|a, b| a < b));
            assert!(dependencies.iter().all(|index| allowed.contains(&kind(index))));
            let Some(kinds) = unknown.get("dependenciesKind") else {
                // The list of an initial value that depends on nearly everything is left out.
                assert!(list == "InitialUnknowns" && unknown.get("dependencies").is_none());
                continue;
            };
            let kinds = kinds.split_whitespace();
            assert_eq!(kinds.count(), dependencies.len());
        }
    }
}

#[test]
fn every_name_in_the_table_s_dependencies_is_a_variable() {
    for variable in TABLE.variables {
        for name in variable.depends_on {
            let family = name.split('[').next().unwrap();
            let is_known = |v: &Variable<_>| v.causality == Causality::Input || v.state.is_some();
            assert!(TABLE.variables.iter().any(|v| v.name == family && is_known(v)), "{name}");
        }
        for name in variable.initial_depends_on {
            let meant = |v: &Variable<_>| {
                v.name == *name
                    || (v.causality == Causality::Parameter
                        && name.ends_with('.')
                        && v.name.starts_with(name))
            };
            assert!(TABLE.variables.iter().any(meant), "{name}");
        }
    }
}

#[test]
fn variable_names_on_which_other_programs_rely_exist() {
    let names = "tau_cmd tau_ext g_axial theta omega omega_dot slosh_angle slosh_rate \
        slosh_angle_radial tau_friction tau_fluid F_tangential F_radial wave_height omega_imu \
        slosh_rate_radial energy momentum power_dissipated tau_actuator wheel_speed stuck regime \
        hub.I tank.d tank.h tank.r fluid.rho fluid.nu fluid.sigma slosh.model slosh.modes \
        slosh.zeta_from_correlation slosh.zeta friction.model friction.b \
        friction.c friction.d friction.omega_s friction.eps init.theta init.omega \
        init.slosh_angle init.slosh_angle_radial init.slosh_rate init.slosh_rate_radial \
        wheel.enabled wheel.I wheel.speed_0 wheel.speed_min wheel.speed_max wheel.tau_max \
        imu.enabled imu.rate imu.arw imu.bias_instability imu.bias_time imu.lsb imu.seed \
        tank.m_liq tank.m_0 tank.bond slosh.mass[1] slosh.mass[10] slosh.length[10] \
        slosh.frequency[10] slosh.damping[10]";
    for name in names.split_whitespace() {
        assert!(TABLE.find(name).is_some(), "{name}");
    }
}

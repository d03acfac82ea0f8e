//! Checks statements of the README, and the scripts for other hosts.

use host::causality::Causality;
use host::description::ModelDescription;

fn read(path: &str) -> String {
    std::fs::read_to_string(pack::root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// The commands are cargo run and cargo test, and each stands on a line of its own, ready to copy.
#[test]
fn the_first_40_lines_of_readme_lead_to_a_plot_and_to_the_tests() {
    let readme = read("README.md");
    let first: Vec<&str> = readme.lines().take(40).collect();
    for command in ["cargo run --release", "cargo test --release"] {
        let alone = ["```sh", command, "```"];
        assert!(first.windows(3).any(|lines| lines == alone), "{command}: {first:#?}");
    }
    for begin in [
        "![",
        "pip install ",
        "python examples/0_your_own_tank/my_tank.py",
        "| by tests and CI | FMPy",
        "| not | Simulink",
        "* [Against published measurements]",
    ] {
        assert!(first.iter().any(|line| line.starts_with(begin)), "{begin}: {first:#?}");
    }
}

/// The wrapper that OpenModelica's importFMU writes drops the start values of inputs, so that an
/// input that is not set is 0. With `g_axial` = 0 the tank would be weightless.
#[test]
fn the_script_for_openmodelica_sets_every_input_of_hubslosh() {
    let script = read("harness/hosts/openmodelica.mos");
    let xml = read("modelDescription/HubSlosh/modelDescription.xml");
    let (_, set) = script.split_once("-override=").unwrap();
    let set: Vec<(&str, &str)> =
        set.split('"').next().unwrap().split(',').filter_map(|one| one.split_once('=')).collect();
    for input in ModelDescription::from_xml(&xml).unwrap().variables {
        if input.causality == Causality::Input {
            let start: f64 = input.attributes().start.as_deref().unwrap().parse().unwrap();
            let value = set.iter().find(|(name, _)| *name == input.name).map(|(_, value)| *value);
            assert_eq!(value.and_then(|text| text.parse().ok()), Some(start), "{}", input.name);
        }
    }
}

//! Promises of README and of the scripts for other hosts.

use host::causality::Causality;
use host::description::ModelDescription;

fn read(path: &str) -> String {
    std::fs::read_to_string(pack::root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// A newcomer, and a machine that tries the project, finds both in the first screen, ready to copy.
#[test]
fn readme_begins_with_the_two_commands_in_bold_each_alone_on_its_line() {
    let readme = read("README.md");
    let first: Vec<&str> = readme.lines().take(40).collect();
    for command in ["cargo run --release", "cargo test --release"] {
        let bold = ["<b>", "", "```sh", command, "```", "", "</b>"];
        assert!(first.windows(bold.len()).any(|lines| lines == bold), "{command}: {first:#?}");
    }
}

/// The wrapper that OpenModelica's importFMU writes drops the start values of inputs: one that is not set is 0,
/// and with `g_axial` the tank is weightless.
#[test]
fn openmodelicas_script_sets_every_input() {
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

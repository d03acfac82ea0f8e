//! Tests that the example in the folder `extra` of each FMU agrees with the FMU.

use std::path::PathBuf;

use experiments::example::{self, EXAMPLES, Example};
use host::fmu::Fmu;
use pack::{packed_for_tests, packed_model_for_tests};
use signals::table::Table;

fn differences(answer: &Table, reference: &Table) -> Vec<(String, f64)> {
    let every = (answer.rows() - 1) / (reference.rows() - 1);
    let names = reference.names().iter();
    names
        .map(|name| {
            let (answer, reference) =
                (answer.column(name).unwrap(), reference.column(name).unwrap());
            let largest = reference.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            let pairs = answer.iter().step_by(every).zip(reference);
            let difference = pairs.fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
            (name.clone(), if difference == 0.0 { 0.0 } else { difference / largest })
        })
        .collect()
}

fn folder(example: &Example) -> PathBuf {
    pack::model(example.model).unwrap().example()
}

fn packed(example: &Example) -> Fmu {
    Fmu::open(packed_model_for_tests(pack::model(example.model).unwrap())).unwrap()
}

fn reference(example: &Example) -> Table {
    let path = folder(example).join(example.reference());
    let text = std::fs::read_to_string(&path).unwrap();
    let names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    Table::read(&path, &names).unwrap()
}

#[test]
fn the_recorded_input_of_an_example_gives_its_reference_result() {
    for example in &EXAMPLES {
        let fmu = packed(example);
        let input = folder(example).join(example.input());
        let answer = example::replay(&fmu, &input, None, false).unwrap();
        let reference = reference(example);
        assert_eq!(reference.rows(), 201);
        for (name, difference) in differences(&answer, &reference) {
            // the README.md of each example states this figure; the default tolerance is 1e-8
            assert!(difference < 1e-6, "{}, {name}: {difference:e}", example.model);
            // the divisor is not so small that it consists of rounding errors
            let largest =
                reference.column(&name).unwrap().iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            assert!(largest == 0.0 || largest > 1e-6, "{}, {name}: {largest:e}", example.model);
        }
    }
}

#[test]
fn the_example_of_the_bench_slips_and_comes_to_rest() {
    let answer = reference(&EXAMPLES[0]);
    let omega = answer.column("omega").unwrap();
    assert!(omega.iter().any(|w| w.abs() > 0.01) && omega.ends_with(&[0.0, 0.0]));
}

#[test]
fn in_the_six_axis_examples_the_slosh_angle_reaches_some_degrees() {
    // the lateral force of the wave: 128 kg at 1.5 m/s2 and 2 degrees are 6.7 N
    for (example, name) in [(&EXAMPLES[1], "slosh_force[1]"), (&EXAMPLES[2], "force[1]")] {
        let answer = reference(example);
        let force = answer.column(name).unwrap();
        let late = &force[120..]; // the inputs have ended
        assert!(late.iter().any(|f| f.abs() > 6.7), "{}: {late:?}", example.model);
    }
}

#[test]
fn the_example_replayed_with_held_torque_is_as_close_to_the_reference_as_its_readme_states() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let example = &EXAMPLES[0];
    let input = folder(example).join(example.input());
    let answer = example::replay(&fmu, &input, None, true).unwrap();
    let all = differences(&answer, &reference(example));
    // these outputs do not jump when the hub stops; a delay of 10 ms at 2 Hz changes them by 2 pi
    // 2 0.01 = 0.13
    let smooth = ["theta", "omega", "slosh_angle", "slosh_rate"];
    let smooth = all.iter().filter(|(name, _)| smooth.contains(&name.as_str()));
    let worst = smooth.map(|(_, difference)| *difference).fold(0.0, f64::max);
    assert!((0.01..0.2).contains(&worst), "{all:?}");
}

#[test]
fn committed_files_of_the_examples_equal_the_files_that_hubslosh_example_writes() {
    for example in &EXAMPLES {
        let made = tempfile::tempdir().unwrap();
        example.write(&packed(example), made.path()).unwrap();
        // the file of the reference result is not compared, because its last digits may change; its
        // values are compared above
        for name in [example.input(), example.options()] {
            let made = std::fs::read_to_string(made.path().join(&name)).unwrap();
            let committed = std::fs::read_to_string(folder(example).join(&name)).unwrap();
            assert!(made == committed, "{name} is out of date: run `hubslosh example`");
        }
    }
}

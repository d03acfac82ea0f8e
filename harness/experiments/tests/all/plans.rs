//! The built-in plans stay within the range of validity of their models, unless their texts say that they leave it.

use experiments::campaign::{Range, WAVE, seek_onset};
use experiments::plan::{BUILT_IN, Case, Plan};
use host::fmu::Fmu;
use pack::packed_for_tests;
use rayon::prelude::*;

/// Built-in plans whose runs leave the range of a model; the text of each of these plans says why.
const BEYOND: [&str; 7] = [
    "thesis",
    "thesis_models",
    "t5_near_resonance",
    "t6_high_amplitude",
    "t7_on_the_axis",
    "amplitudes",
    "bench_damping",
];

/// Returns the runs of a plan that the test simulates. Of more than 20 runs these are only the runs with the largest
/// torque.
fn simulated_cases(cases: &[Case]) -> Vec<&Case> {
    let largest = cases.iter().filter_map(|case| case.amplitude).fold(0.0, f64::max);
    match cases.len() {
        0..=20 => cases.iter().collect(),
        _ => cases.iter().filter(|case| case.amplitude.unwrap_or(0.0) >= largest).collect(),
    }
}

fn range_warnings(fmu: &Fmu, case: &Case) -> Vec<String> {
    let run = case.run();
    let mut instance = run.initialise(fmu).unwrap();
    let mut said = instance.take_warnings();
    // A plan may compare models, one of which does not use a parameter.
    said.retain(|warning| !warning.contains(" no effect: "));
    let range = Range::read(fmu.description(), &mut instance).unwrap().unwrap();
    let table = run.drive(&mut instance, &[WAVE], |_| {}).unwrap();
    said.extend(range.left(table.column(WAVE).unwrap()));
    said.into_iter().map(|why| format!("{}: {why}", case.name)).collect()
}

/// List of slosh models in the text of the built-in plan that searches for the onset of rotary slosh.
const MODELS: &str = r#"["linear", "planar", "spherical", "liquid"]"#;

/// The plan that searches for the onset of rotary slosh is simulated only with the linear model, because the search
/// with each further model takes seconds.
#[test]
#[ignore = "six seconds: .ci/long-tests"]
fn built_in_plans_stay_in_their_models_range_or_say_that_they_leave_it() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    for (name, text) in BUILT_IN {
        let mut plan = Plan::parse(text).unwrap();
        if text.contains("\n[onset]") {
            assert!(text.contains(MODELS), "{name}");
            plan = Plan::parse(&text.replace(MODELS, r#"["linear"]"#)).unwrap();
        }
        seek_onset(&mut plan, &fmu, 0, &|_| {}).unwrap();
        let cases = plan.cases(fmu.description()).unwrap();
        let cases = simulated_cases(&cases);
        let says = text.contains("\n# Beyond the range of ");
        assert_eq!(says, BEYOND.contains(name), "{name}");
        if says {
            let leaves = cases.par_iter().any(|case| !range_warnings(&fmu, case).is_empty());
            assert!(leaves, "{name}");
        } else {
            let left: Vec<String> =
                cases.par_iter().flat_map(|case| range_warnings(&fmu, case)).collect();
            assert!(left.is_empty(), "{name}: {left:#?}");
        }
    }
}

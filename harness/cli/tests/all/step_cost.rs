//! `hubslosh step-cost` from outside. No time is tested: what is chosen is tried on the FMU.

use std::process::{Command, Output};

use host::c_abi::Status;
use host::fmu::Fmu;
use pack::{Fmi, HUBSLOSH, packed_version_for_tests};
use serde_json::Value;

fn step_cost(fmi: Fmi, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hubslosh"))
        .args(["step-cost", "--fmu"])
        .arg(packed_version_for_tests(HUBSLOSH, fmi))
        .args(["--step", "1ms", "--steps", "20"])
        .args(arguments)
        .output()
        .unwrap()
}

/// The FMU makes at most the chosen number of internal steps. If it refuses a step, a shorter step (FMI 3.0) or one from the
/// saved state (FMI 2.0) continues.
#[test]
fn the_number_of_internal_steps_chosen_for_a_deadline_is_obeyed() {
    for fmi in Fmi::RELEASED {
        let spherical = ["--set", "slosh.model=spherical"];
        let done = step_cost(fmi, &[&["--deadline", "2ms", "--json"][..], &spherical].concat());
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let found: Value = serde_json::from_slice(&done.stdout).unwrap();
        let time = |name: &str| found["time_s"][name].as_f64().unwrap();
        assert!(time("p50") > 0.0 && time("p50") <= time("p99_99"), "{found}");
        assert!(time("p99_99") <= time("max"), "{found}");
        if let Some(instructions) = found["instructions"].as_object() {
            assert!(instructions["p50"].as_u64().unwrap() > 100, "{found}");
            assert!(instructions["max"].as_u64() >= instructions["p50"].as_u64(), "{found}");
        }
        let choice = &found["choice"];
        let max_steps = choice["max_steps"].as_u64().unwrap();
        assert!(choice["needed"].as_u64().unwrap() <= max_steps, "{choice}");
        let worst = choice["worst_s"].as_f64().unwrap();
        assert!(worst * choice["margin"].as_f64().unwrap() <= 2e-3, "{choice}");

        let fmu = Fmu::open(packed_version_for_tests(HUBSLOSH, fmi)).unwrap();
        let mut instance = fmu.instantiate("one").unwrap();
        instance.set("slosh.model", "spherical").unwrap();
        instance.set("init.slosh_angle", "0.3").unwrap();
        instance.set("solver.max_steps", &max_steps.to_string()).unwrap();
        instance.enter_initialization_mode(None, 0.0, None).unwrap();
        instance.exit_initialization_mode().unwrap();
        instance.do_step(0.0, 1e-3).unwrap();
        let here = instance.get_state().unwrap();
        let error = instance.do_step(1e-3, 1e6).unwrap_err();
        let expected = if fmi == Fmi::V2 { Status::Error } else { Status::Discard };
        assert_eq!(error.status, expected, "{error}");
        assert!(error.text().contains(&format!("solver.max_steps = {max_steps}")), "{error}");
        assert!(choice["beyond"].as_str().unwrap().contains(&format!("{:?}", error.status)));
        if fmi == Fmi::V2 {
            instance.set_state(&here).unwrap();
        }
        instance.free_state(here).unwrap();
        instance.do_step(1e-3, 1e-3).unwrap();
    }
}

#[test]
fn a_deadline_that_is_too_short_is_refused_in_words() {
    let done = step_cost(Fmi::V3, &["--deadline", "2ns"]);
    assert_eq!(done.status.code(), Some(1));
    let said = String::from_utf8_lossy(&done.stderr);
    for words in ["a deadline of 0.000000002 s is too short", "internal steps", "allowed: "] {
        assert!(said.contains(words), "{words}: {said}");
    }
}

#[test]
fn what_step_cost_cannot_do_is_said() {
    for (arguments, code, words) in [
        (&["--deadline", "soon"][..], 2, "\"soon\" is not a time above 0"),
        (&["--deadline", "0ms"], 2, "is not a time above 0"),
        (&["--deadline", "2s"], 1, "allowed: 1e-9 s to 1 s"),
        (&["--deadline", "1ms", "--margin", "0.5"], 1, "allowed: 1 to 100"),
        (&["--profile", "sweep"], 1, "sweep"),
        (&["--set", "tank.height=1"], 1, "did you mean"),
        (&["--drive", "omega"], 1, "omega cannot be driven"),
    ] {
        let done = step_cost(Fmi::V2, arguments);
        let said = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(code), "{arguments:?}: {said}");
        assert!(said.contains(words), "{arguments:?}: {said}");
    }
}

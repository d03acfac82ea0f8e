//! A minimal second FMU on the same runtime: the mass on a spring of `tests/spring`. It is packed, checked, and
//! simulated by FMPy in Co-Simulation and in Model Exchange.

use std::path::PathBuf;
use std::process::Command;

use pack::archive::{self, Files, Packed};

use crate::common::{harness, python, run};

fn packed() -> PathBuf {
    let binary = pack::build("spring-fmu", true).unwrap();
    let out = binary.ancestors().nth(2).unwrap().join("test-fmu/Spring.fmu");
    let binary = Packed::native(&binary).unwrap();
    let xml = model_description::xml::<Spring::spring::Spring>().unwrap();
    let text = |text: &str| text.as_bytes().to_vec();
    let files: Files = vec![
        ("modelDescription.xml".into(), xml.into_bytes()),
        (binary.name("Spring"), binary.bytes),
        ("documentation/index.html".into(), text("<!DOCTYPE html><title>Spring</title>")),
        ("documentation/licenses/license.txt".into(), text("MIT OR Apache-2.0")),
    ];
    archive::write(&files, &out).unwrap();
    out
}

/// Compares a simulation by FMPy with the exact motion of m x'' + d x' + k x = F from x0 at rest, under a constant force.
const FMPY: &str = r#"
import sys
import numpy as np
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu

fmu = sys.argv[1]
problems = validate_fmu(fmu)
assert not problems, problems
m, d, k, x0, force = 2.0, 0.4, 50.0, 0.05, 3.0
zeta_w, rest = d / (2 * m), force / k
w = np.sqrt(k / m - zeta_w**2)
for kind in ("CoSimulation", "ModelExchange"):
    result = simulate_fmu(
        fmu, fmi_type=kind, stop_time=10, output_interval=0.01, relative_tolerance=1e-10,
        start_values={"m": m, "d": d, "k": k, "x0": x0, "F": force}, output=["x", "a", "f"],
    )
    t = result["time"]
    decay = np.exp(-zeta_w * t)
    exact = rest + (x0 - rest) * decay * (np.cos(w * t) + zeta_w / w * np.sin(w * t))
    error = np.abs(result["x"] - exact).max()
    # Runge-Kutta 4 at 1 ms: (w h)^5/120 a step, 5e-14 of 0.05 m; CVODE at 1e-10 adds up to 1e-7.
    assert error < (1e-11 if kind == "CoSimulation" else 1e-7), (kind, error)
    assert abs(result["f"][0] - np.sqrt(k / m) / (2 * np.pi)) < 1e-15
    assert len(t) == 1001
"#;

#[test]
fn a_minimal_fmu_needs_only_a_table_and_a_model() {
    let fmu = packed();
    let report = run(
        Command::new(harness()).arg("check").arg(&fmu),
        "hubslosh check found errors in the second FMU",
    );
    // The library is built for this machine only, and may therefore need a newer glibc than the released FMUs.
    assert!(report.contains(" 0 errors, "), "{report}");
    run(Command::new(python()).args(["-c", FMPY]).arg(&fmu), "fmpy and the second FMU disagree");
}

#[test]
fn a_minimal_fmu_on_the_runtime_takes_at_most_150_lines() {
    let folder = pack::root().join("tests/spring/src");
    let lines: usize = ["lib.rs", "spring.rs"]
        .map(|name| std::fs::read_to_string(folder.join(name)).unwrap().lines().count())
        .iter()
        .sum();
    assert!(lines <= 150, "{lines} lines");
}

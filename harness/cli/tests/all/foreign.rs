//! `hubslosh run` with an FMU of others: the FMU 3.0 of the tests of `check`.

use std::path::Path;
use std::process::Command;

use host::fmi3::PLATFORM;

/// Packs model3.c with the fault of this number.
fn model(path: &Path, mutant: u32) {
    let sources = concat!(env!("CARGO_MANIFEST_DIR"), "/../check/tests/all/");
    let library = path.with_extension("library");
    let done = Command::new("cc")
        .args(["-std=gnu11", "-O1", "-fPIC", "-shared", "-o"])
        .arg(&library)
        .args([format!("{sources}model3.c"), format!("-DMUTANT=\"{mutant:02}\""), "-lm".into()])
        .status()
        .unwrap();
    assert!(done.success());
    let name = format!("binaries/{PLATFORM}/Model3{}", std::env::consts::DLL_SUFFIX);
    let xml = std::fs::read(format!("{sources}model3.xml")).unwrap();
    let files = vec![("modelDescription.xml".into(), xml), (name, std::fs::read(library).unwrap())];
    pack::archive::write(&files, path).unwrap();
}

/// Runs the model with an input along lines, which intermediateUpdate sets, and compares its outputs. Mutant 35 hands its
/// instance to the callbacks.
#[test]
fn an_fmu_3_runs_as_its_closed_solution_with_inputs_along_lines() {
    for mutant in [0, 35] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("Model3.fmu");
        model(&path, mutant);
        follows_its_closed_solution(&path, folder.path());
    }
}

fn follows_its_closed_solution(path: &Path, folder: &Path) {
    let input = folder.join("u.csv");
    std::fs::write(&input, "time,u\n0,0\n10,5\n").unwrap();
    let out = folder.join("out.csv");
    let done = Command::new(env!("CARGO_BIN_EXE_hubslosh"))
        .args(["run", "--fmu"])
        .arg(path)
        .arg("--input")
        .arg(&input)
        .args(["--set=k=2", "--set=a[2]=7", "--columns=y,n,a[1],a[2],on"])
        .args(["--step=0.1", "--stop=10", "--out"])
        .arg(&out)
        .output()
        .unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let text = std::fs::read_to_string(&out).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("time,u,y,n,a[1],a[2],on"));
    let mut rows = 0;
    for line in lines {
        let row: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        // x' = -k (x - s t), x(0) = 1: x = s t - s/k + (1 + s/k) exp(-k t)
        let (t, k, s) = (row[0], 2.0, 0.5);
        let x = s * t - s / k + (1.0 + s / k) * (-k * t).exp();
        // 100 steps, each exact to rounding
        assert!((row[2] - 2.0 * x).abs() < 1e-12, "{line}: {x}");
        assert_eq!(row[3], (t / 0.25 + 1e-6).floor(), "{line}");
        assert_eq!(row[4..], [1.0, 7.0, 0.0], "{line}");
        rows += 1;
    }
    assert_eq!(rows, 101);
}

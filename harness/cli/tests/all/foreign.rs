//! `hubslosh run` with an FMU of another project: the FMU 3.0 of the tests of `check`.

use std::path::Path;
use std::process::Command;

use host::fmi3::PLATFORM;

pub fn model(path: &Path, mutant: u32) {
    changed_model(path, mutant, &[]);
}

fn changed_model(path: &Path, mutant: u32, changes: &[(&str, &str)]) {
    let sources = concat!(env!("CARGO_MANIFEST_DIR"), "/../check/tests/all/");
    let changed = |name: &str| {
        let text = std::fs::read_to_string(format!("{sources}{name}")).unwrap();
        changes.iter().fold(text, |text, (old, new)| text.replace(old, new))
    };
    let (library, source) = (path.with_extension("library"), path.with_extension("c"));
    std::fs::write(&source, changed("model3.c")).unwrap();
    let done = Command::new("cc")
        .args(["-std=gnu11", "-O1", "-fPIC", "-shared", "-o"])
        .arg(&library)
        .arg(&source)
        .args([format!("-I{sources}"), format!("-DMUTANT=\"{mutant:02}\""), "-lm".into()])
        .status()
        .unwrap();
    assert!(done.success());
    let name = format!("binaries/{PLATFORM}/Model3{}", std::env::consts::DLL_SUFFIX);
    let xml = changed("model3.xml").into_bytes();
    let files = vec![("modelDescription.xml".into(), xml), (name, std::fs::read(library).unwrap())];
    pack::archive::write(&files, path).unwrap();
}

/// The callback intermediateUpdate sets an input that follows straight lines. The FMU is also built
/// with a fault (mutant 35): it passes its instance to the callbacks instead of the host's
/// environment, which must not change the result.
#[test]
fn a_run_of_an_fmu_3_with_linear_inputs_equals_the_exact_solution() {
    for mutant in [0, 35] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("Model3.fmu");
        model(&path, mutant);
        follows_its_closed_solution(&path, folder.path(), 1e-12);
    }
}

/// The command integrates the FMU itself. It does not activate the FMU's clock, and says so.
#[test]
fn a_run_of_an_fmu_with_only_model_exchange_equals_the_exact_solution() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("Model3.fmu");
    let xml = std::fs::read_to_string(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../check/tests/all/model3.xml"
    ));
    let xml = xml.unwrap();
    let from = xml.find("  <CoSimulation").unwrap();
    let element = &xml[from..from + xml[from..].find("/>").unwrap() + 2];
    let clock = "<Clock name=\"tick\" valueReference=\"11\" causality=\"input\" intervalVariability=\"triggered\"/>\n  </ModelVariables>";
    changed_model(&path, 0, &[(element, ""), ("</ModelVariables>", clock)]);
    // the default experiment's tolerance is 1e-6
    let said = follows_its_closed_solution(&path, folder.path(), 2e-5);
    assert!(said.contains("this command integrates it"), "{said}");
    assert!(said.contains("has clocks (tick), and none ticks in this run"), "{said}");
}

fn follows_its_closed_solution(path: &Path, folder: &Path, within: f64) -> String {
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
        // exact solution of x' = -k (x - s t), x(0) = 1: x = s t - s/k + (1 + s/k) exp(-k t)
        let (t, k, s) = (row[0], 2.0, 0.5);
        let x = s * t - s / k + (1.0 + s / k) * (-k * t).exp();
        // 100 steps, each of which is exact to rounding in Co-Simulation
        assert!((row[2] - 2.0 * x).abs() < within, "{line}: {x}");
        assert_eq!(row[3], (t / 0.25 + 1e-6).floor(), "{line}");
        assert_eq!(row[4..], [1.0, 7.0, 0.0], "{line}");
        rows += 1;
    }
    assert_eq!(rows, 101);
    String::from_utf8(done.stderr).unwrap()
}

/// The output `counter` of this model is 100 while its Boolean input is true.
#[test]
fn boolean_inputs_from_a_file_are_held_between_rows() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("Model3.fmu");
    let changes = [
        ("y[i] = m->s.n;", "y[i] = m->s.on ? 100 : m->s.n;"),
        (
            "causality=\"parameter\" variability=\"fixed\" initial=\"exact\" start=\"false\"",
            "causality=\"input\" variability=\"discrete\" start=\"false\"",
        ),
    ];
    changed_model(&path, 0, &changes);
    let run = |rows: &str| {
        let input = folder.path().join("u.csv");
        std::fs::write(&input, format!("time,u,on\n{rows}")).unwrap();
        let done = Command::new(env!("CARGO_BIN_EXE_hubslosh"))
            .args(["run", "--columns=n", "--step=0.1", "--stop=2", "--out=-", "--fmu"])
            .arg(&path)
            .arg("--input")
            .arg(&input)
            .output()
            .unwrap();
        let [out, error] = [done.stdout, done.stderr].map(|text| String::from_utf8(text).unwrap());
        if done.status.success() { Ok(out) } else { Err(error) }
    };
    let out = run("0,0,0\n0.95,0,1\n1.45,0,0\n2,0,0\n").unwrap();
    // true and false as pandas and spreadsheets write them
    for words in [["True", "False"], ["TRUE", "FALSE"], ["true", "false"]] {
        let [on, off] = words;
        let same = run(&format!("0,0,{off}\n0.95,0,{on}\n1.45,0,{off}\n2,0,{off}\n"));
        assert_eq!(same.unwrap(), out, "{words:?}");
    }
    let mut high = 0;
    for line in out.lines().skip(1) {
        let row: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        // The FMU steps to the row of the input, although it lies between two rows of the result.
        let on = (0.95..1.45).contains(&row[0]);
        assert_eq!(row[3] == 100.0, on, "{line}");
        high += usize::from(on);
    }
    assert_eq!(high, 5, "{out}");
    let error = run("0,0,0\n1,0,2\n2,0,0\n").unwrap_err();
    assert!(error.contains("row 2: on is 2 (allowed: true and false, or 1 and 0"), "{error}");
    let error = run("0,0,true\n1,0,yes\n2,0,true\n").unwrap_err();
    assert!(
        error.contains("line 3, column on: \"yes\" is not a Boolean (allowed: true,"),
        "{error}"
    );
    let error = run("0,0,true\n1,true,true\n2,0,true\n").unwrap_err();
    assert!(error.contains("line 3, column u: \"true\" is not a number"), "{error}");
    assert_eq!(run("0,0,0\r2,0,0\r").unwrap(), run("0,0,0\n2,0,0\n").unwrap());
    // The date changes at midnight, and nothing in the file shows whether the day or the month comes first.
    let error = run("01/02/2026 23:59:59,0,0\n02/02/2026 00:00:01,0,0\n").unwrap_err();
    assert!(
        error.contains("line 3, column time: \"02/02/2026 00:00:01\" may have the day first"),
        "{error}"
    );
    for rows in [
        "11:59:59 AM,0,0\n12:00:01 PM,0,0\n",
        "2026-01-31T23:59:59+0100,0,0\n2026-02-01T00:00:01+0100,0,0\n",
        "31/01/2026 23:59:59,0,0\n01/02/2026 00:00:01,0,0\n",
        "12:00:00:000,0,0\n12:00:02:000,0,0\n",
    ] {
        let same = run(rows).unwrap_or_else(|error| panic!("{rows}: {error}"));
        assert_eq!(same.lines().count(), 22, "{rows}: {same}");
    }
}

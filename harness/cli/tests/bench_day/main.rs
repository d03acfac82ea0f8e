//! Recordings of one day at a simulated bench that differs from the FMU: gyro bias on three axes, a tilting platform
//! and the thesis's noise. `hubslosh analyse --bench-day` analyses them.

#[path = "../../../studies/twins/bench.rs"]
#[allow(dead_code, reason = "the twins use the rest of it")]
mod bench;
#[path = "../../../studies/bench_day/logs.rs"]
mod logs;

use std::collections::HashMap;
use std::path::Path;
use std::process::{Command, Output};

use pack::packed_for_tests;

use crate::bench::Bench;
use crate::logs::{ASYMMETRY, Day, GYRO, SHORT};

fn analyse(directory: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hubslosh"))
        .args(["analyse", "--bench-day"])
        .arg(directory)
        .arg("--fmu")
        .arg(packed_for_tests())
        .arg("--out")
        .arg(directory.join("out"))
        .output()
        .expect("the program runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn features(directory: &Path) -> Vec<HashMap<String, String>> {
    let mut reader = csv::Reader::from_path(directory.join("out/features.csv")).unwrap();
    reader.deserialize().map(|row| row.unwrap()).collect()
}

fn number(row: &HashMap<String, String>, name: &str) -> f64 {
    row[name].parse().unwrap_or_else(|_| panic!("{name} = {:?}", row[name]))
}

#[test]
#[ignore = "a minute of CPU time: .ci/long-tests"]
fn bench_day_reports_every_chapter_and_the_true_values_are_within_the_intervals() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    SHORT.write(folder).unwrap();
    let done = analyse(folder);
    assert!(done.status.success(), "{}{}", text(&done.stdout), text(&done.stderr));
    let said = text(&done.stdout) + &text(&done.stderr);
    for name in ["the gyro's rate", "omega_x", "omega_y"] {
        assert!(said.contains(&format!("{name} has a mean of")), "{name}: {said}");
    }
    let page = std::fs::read_to_string(folder.join("out/report.html")).unwrap();
    for figure in ["5.6", "5.8 and 5.9", "5.10", "5.18", "6.4, 6.5 and 6.7", "6.6"] {
        assert!(page.contains(&format!(" {figure}.</figcaption>")), "figure {figure}");
    }
    for figure in
        ["7.1 and 7.2", "7.3, 7.4 and 7.7 to 7.10", "7.11 to 7.14 and 7.16", "7.15", "7.17"]
    {
        assert!(page.contains(&format!(" {figure}.</figcaption>")), "figure {figure}");
    }
    assert!(page.contains("the hub turns more easily clockwise"));
    // with only two short decays, friction that depends on the angle cannot be distinguished from scatter
    assert!(page.contains("Figures 5.11 and 5.12 of the thesis need more decays"));
    assert!([" 5.11.</figcaption>", " 5.12.</figcaption>"].iter().all(|end| !page.contains(end)));
    assert!(!page.contains("No usable recordings"));

    // the result of the fit of friction and inertia
    let bearing = std::fs::read_to_string(folder.join("out/friction.json")).unwrap();
    let bearing: serde_json::Value = serde_json::from_str(&bearing).unwrap();
    let truth = Bench::default();
    let mut all = vec![
        ("hub.I", truth.hub_inertia),
        ("friction.b", truth.bearing.b),
        ("friction.c", truth.bearing.c),
        ("friction.d", truth.bearing.d),
        ("friction.omega_s", truth.bearing.omega_s),
        ("friction.asymmetry", ASYMMETRY),
    ];
    let biases = ["gyro_bias[1]", "gyro_bias[2]", "gyro_bias[3]", "gyro_bias[4]", "gyro_bias[5]"];
    all.extend(biases.map(|name| (name, SHORT.bias[2].to_radians())));
    for (name, truth) in all {
        let found = [&bearing["parameters"][name], &bearing["measurement"][name]];
        let found = found.into_iter().find(|found| !found.is_null()).unwrap();
        let [low, high] = [0, 1].map(|end| found["interval"][end].as_f64().unwrap());
        println!("{name}: {low:.5e} to {high:.5e}, truth {truth:.5e}");
        assert!((low..=high).contains(&truth), "{name}: {truth} is not in {found}");
    }
    // the gyro's noise: N = σ/√50, including the variance of the quantisation
    let walk = (GYRO.0.powi(2) + GYRO.1.powi(2) / 12.0).sqrt() * 0.02f64.sqrt();
    let found = page.split("angle random walk N: ").nth(1).unwrap().split(' ').next().unwrap();
    let found: f64 = found.parse().unwrap();
    // 30,000 samples determine the noise to 0.4 %.
    assert!((found / walk - 1.0).abs() < 0.02, "N = {found} for {walk}");

    // antiresonance and resonance of each recording, and of the model under the same torque
    let rows = features(folder);
    let (recorded, simulated): (Vec<_>, Vec<_>) =
        rows.iter().partition(|row| row["model"] == "recording");
    assert_eq!((recorded.len(), simulated.len()), (6, 6));
    let mut off = Vec::new();
    for there in &recorded {
        let same = |row: &&&HashMap<String, String>| {
            ["fill_m", "amplitude_nm"].iter().all(|name| row[*name] == there[*name])
        };
        let model = simulated.iter().find(same).unwrap();
        for name in ["f_dip", "f_res"] {
            let [a, b] = [there, model].map(|row| number(row, &format!("{name}_hz")));
            let [s, t] = [there, model].map(|row| number(row, &format!("{name}_std_hz")));
            let (fill, torque) = (&there["fill_m"], &there["amplitude_nm"]);
            println!("{fill} m, {torque} N·m, {name}: {a:.4} ± {s:.1e} Hz, model {b:.4} Hz");
            off.push((a - b) / s.hypot(t));
        }
    }
    // On 1 % of days the sum of these 12 squares is larger than 26.2 (χ²), and on 2 % of days more than two of
    // the values exceed 1.96.
    let squares: f64 = off.iter().map(|off| off * off).sum();
    assert!(squares < 26.2 && off.iter().all(|off| off.abs() < 3.0), "{squares}: {off:?}");
    let outside = off.iter().filter(|off| off.abs() > 1.96).count();
    assert!(outside <= 2, "{off:?}");

    // Figure 7.15: noise dominates at the small torque. The biases change nothing.
    let plain = tempfile::tempdir().unwrap();
    let plain = plain.path();
    Day { bias: [0.0; 3], rest: 0.0, friction: false, ..SHORT }.write(plain).unwrap();
    let done = analyse(plain);
    assert!(done.status.success(), "{}", text(&done.stderr));
    let page = std::fs::read_to_string(plain.join("out/report.html")).unwrap();
    for kind in ["friction", "decay", "rest"] {
        assert!(
            page.contains(&format!("No usable recordings with kind = &quot;{kind}&quot;")),
            "{kind}"
        );
    }
    let unbiased = features(plain);
    let unbiased: Vec<_> = unbiased.iter().filter(|row| row["model"] == "recording").collect();
    for name in ["off_axis_median", "off_axis_energy"] {
        for (with, without) in recorded.iter().zip(&unbiased) {
            let (a, b) = (number(with, name), number(without, name));
            assert!((a - b).abs() < 1e-3, "{name}: {a} with bias, {b} without");
        }
        for fill in recorded.chunks(SHORT.amplitudes.len()) {
            let [small, large] = [0, fill.len() - 1].map(|i| number(fill[i], name));
            assert!(large < 0.1 * small && large < 0.01, "{name}: {small}, {large}");
        }
    }
}

#[test]
fn bench_day_reports_a_missing_log_file_in_its_chapter() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let day = Day {
        fills: &[0.1],
        amplitudes: &[0.1],
        sweep: 120.0,
        rest: 0.0,
        friction: false,
        ..SHORT
    };
    day.write(folder).unwrap();
    let manifest = folder.join("day.toml");
    let list = std::fs::read_to_string(&manifest).unwrap();
    let more = "\n[[recording]]\nkind = \"rest\"\nfile = \"night.csv\"\n\n[[recording]]\nkind = \"friction\"\nfile = \"ramp.csv\"\n";
    std::fs::write(&manifest, format!("{list}{more}")).unwrap();
    std::fs::write(folder.join("ramp.csv"), "t;T_cmd\n0;1\n20;x\n").unwrap();
    let done = analyse(folder);
    let said = text(&done.stderr);
    assert!(!done.status.success());
    for name in ["night.csv", "ramp.csv", "2 recordings could not be used"] {
        assert!(said.contains(name), "{name}: {said}");
    }
    let page = std::fs::read_to_string(folder.join("out/report.html")).unwrap();
    assert!(page.contains("The messages of the command say which recordings could not be used"));

    // the list lacks the fill of a sweep
    std::fs::write(&manifest, list.replace("fill = 0.1\n", "")).unwrap();
    let said = text(&analyse(folder).stderr);
    assert!(said.contains("[[recording]] 1") && said.contains("fill is missing"), "{said}");
    // the directory lacks the list
    std::fs::remove_file(&manifest).unwrap();
    let said = text(&analyse(folder).stderr);
    assert!(said.contains("day.toml is needed"), "{said}");
}

/// The clock and the lost rows must not be mistaken for another profile or for a torque of the
/// wrong sign.
#[test]
fn a_clock_300_ppm_off_and_lost_rows_change_no_feature_beyond_its_interval() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let day = Day {
        fills: &[0.1],
        amplitudes: &[0.1],
        sweep: 900.0,
        rest: 0.0,
        friction: false,
        clock: 3e-4,
        lost: 0.03,
        ..SHORT
    };
    day.write(folder).unwrap();
    let done = analyse(folder);
    let said = text(&done.stdout) + &text(&done.stderr);
    assert!(done.status.success(), "{said}");
    assert!(said.contains("its clock runs +300 ppm"), "{said}");
    let rows = features(folder);
    let of = |is_recording: bool| {
        let found = rows.iter().find(|row| (row["model"] == "recording") == is_recording);
        found.unwrap_or_else(|| panic!("{said}"))
    };
    for name in ["f_dip", "f_res"] {
        let [a, b] = [true, false].map(|is| number(of(is), &format!("{name}_hz")));
        let [s, t] = [true, false].map(|is| number(of(is), &format!("{name}_std_hz")));
        println!("{name}: {a:.5} ± {s:.1e} Hz, model {b:.5} ± {t:.1e} Hz");
        assert!((a - b).abs() < 3.0 * s.hypot(t), "{name}: {a} ± {s}, {b} ± {t}");
    }
    // A torque of the wrong sign is reported as such.
    let manifest = folder.join("day.toml");
    let list = std::fs::read_to_string(&manifest).unwrap();
    std::fs::write(&manifest, list.replace("amplitude = 0.1", "amplitude = -0.1")).unwrap();
    let said = text(&analyse(folder).stderr);
    assert!(said.contains("with the opposite sign"), "{said}");
}

//! The result of a command does not depend on the interval of its rows: the FMU follows inputs and profiles between the
//! rows, or the command refuses the run and says which interval it needs.

use std::path::Path;
use std::process::{Command, Output};

use pack::packed_for_tests;
use signals::table::Table;

fn hubslosh(directory: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hubslosh"));
    command.current_dir(directory).args(arguments).output().unwrap()
}

fn expect_refusal(directory: &Path, arguments: &[&str]) -> String {
    let done = hubslosh(directory, arguments);
    assert_eq!(done.status.code(), Some(1), "{arguments:?}");
    String::from_utf8(done.stderr).unwrap()
}

/// Settings of a hub that turns without friction and with rigid liquid. Its rate is the integral of
/// the torque divided by the inertia, so that only the rounding errors of a sum remain.
const FREE: [&str; 4] = ["--set", "slosh.model=frozen", "--set", "friction.model=none"];

fn run(directory: &Path, arguments: &[&str]) -> [Vec<f64>; 3] {
    let fmu = packed_for_tests().to_str().unwrap();
    let all = [&["run", "--quiet", "--fmu", fmu, "--out", "run.csv"], arguments].concat();
    let done = hubslosh(directory, &all);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let names = ["time", "tau_cmd", "omega"];
    let table = Table::read(&directory.join("run.csv"), &names).unwrap();
    names.map(|name| table.column(name).unwrap().to_vec())
}

fn inertia(directory: &Path) -> f64 {
    let profile = ["--profile", "constant:amplitude=1,duration=1"];
    1.0 / run(directory, &[&FREE[..], &profile].concat())[2].last().unwrap()
}

fn follows(directory: &Path, source: &[&str], integral: &dyn Fn(f64) -> f64, within: f64) {
    let inertia = inertia(directory);
    let mut first: Option<[Vec<f64>; 3]> = None;
    for step in ["0.02", "0.01", "0.005", "0.05", "0.0333"] {
        let found = run(directory, &[&FREE[..], source, &["--step", step]].concat());
        let [time, tau, omega] = &found;
        for (t, omega) in time.iter().zip(omega) {
            let wanted = integral(*t);
            assert!(
                (omega * inertia - wanted).abs() <= within,
                "{source:?}, --step {step}: {} for {wanted} N·m·s at {t} s",
                omega * inertia
            );
        }
        // The values are equal at times that occur in both tables.
        let [times, torques, rates] = first.get_or_insert_with(|| found.clone());
        let mut shared = 0;
        for (k, t) in time.iter().enumerate() {
            let Some(at) = times.iter().position(|other| (other - t).abs() < 1e-9) else {
                continue;
            };
            shared += 1;
            assert!((tau[k] - torques[at]).abs() < 1e-9, "{source:?}, --step {step}, {t} s");
            assert!((omega[k] - rates[at]).abs() < 1e-11, "{source:?}, --step {step}, {t} s");
        }
        assert!(shared >= 2, "--step {step}");
    }
}

fn write(directory: &Path, rows: impl Iterator<Item = (f64, f64)>) {
    let rows: Vec<String> = rows.map(|(t, tau)| format!("{t},{tau}\n")).collect();
    std::fs::write(directory.join("in.csv"), format!("time,tau_cmd\n{}", rows.concat())).unwrap();
}

/// The file has rows 5 ms apart, with a pulse of 30 ms every 0.25 s. The momentum of the hub must
/// follow the integral of the torque.
#[test]
fn a_torque_file_has_the_same_impulse_with_any_output_step() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // 30 ms of 1 N·m every 0.25 s in rows 5 ms apart; lines between the rows make ramps of 5 ms at both ends
    let pulse = |k: u32| if (7..13).contains(&(k % 50)) { 1.0 } else { 0.0 };
    write(folder, (0..=400).map(|k| (0.005 * f64::from(k), pulse(k))));
    let integral = |t: f64| {
        let k = (t / 0.005 + 1e-9) as u32;
        let rest = t - 0.005 * f64::from(k);
        let whole: f64 = (0..k).map(|k| 0.0025 * (pulse(k) + pulse(k + 1))).sum();
        whole + rest * (pulse(k) + (pulse(k + 1) - pulse(k)) * rest / 0.01)
    };
    follows(folder, &["--input", "in.csv"], &integral, 1e-9);
    // With zero-order hold each row acts for 5 ms.
    let held = |t: f64| {
        let k = (t / 0.005 + 1e-9) as u32;
        let rest = t - 0.005 * f64::from(k);
        0.005 * (0..k).map(pulse).sum::<f64>() + rest * pulse(k)
    };
    follows(folder, &["--input", "in.csv", "--hold"], &held, 1e-9);
    // a single pulse of 8 ms at 1 kHz
    let pulse = |k: u32| if (303..311).contains(&k) { 1.0 } else { 0.0 };
    write(folder, (0..=1000).map(|k| (0.001 * f64::from(k), pulse(k))));
    let ramp = |t: f64| match t {
        t if t <= 0.302 => 0.0,
        t if t >= 0.311 => 0.008,
        _ => f64::NAN,
    };
    let integral = |t: f64| match ramp(t) {
        // while the torque acts: the integral over the first ramp, 0.0005 N·m·s, plus the time at 1 N·m
        value if value.is_nan() => 0.0005 + (t - 0.303).clamp(0.0, 0.007),
        value => value,
    };
    follows(folder, &["--input", "in.csv"], &integral, 1e-3);
    let found = run(folder, &[&FREE[..], &["--input", "in.csv"]].concat());
    let total = found[2].last().unwrap() * inertia(folder);
    assert!((total - 0.008).abs() < 1e-9, "{total} N·m·s of 8 ms");
}

/// The integral of the torque is (1 − cos 2πft)/2πf. Straight lines between rows h = 1 ms apart
/// give (π f h)²/3 = 0.8 % less at 49 Hz.
#[test]
fn a_sine_of_49_hz_in_a_file_has_the_same_impulse_with_any_output_step() {
    let folder = tempfile::tempdir().unwrap();
    let w = std::f64::consts::TAU * 49.0;
    write(folder.path(), (0..=2000).map(|k| 0.001 * f64::from(k)).map(|t| (t, (w * t).sin())));
    let integral = |t: f64| (1.0 - (w * t).cos()) / w;
    follows(folder.path(), &["--input", "in.csv"], &integral, 0.02 / w);
}

/// The profiles are sines from 24.9 to 333 Hz and a pulse of 10 ms. Some output steps are longer
/// than a period.
#[test]
fn a_profile_has_the_same_impulse_with_any_output_step() {
    let folder = tempfile::tempdir().unwrap();
    let follows = |profile: &str, integral: &dyn Fn(f64) -> f64, within: f64| {
        follows(folder.path(), &["--profile", profile], integral, within);
    };
    for f in [50.0, 24.9, 333.0] {
        // A straight line between 70 torque values per period differs by at most 0.1 %.
        let w = std::f64::consts::TAU * f;
        let profile = format!("sine:amplitude=1,frequency={f},duration=1");
        follows(&profile, &|t| (1.0 - (w * t).cos()) / w, 1.5e-3 / w);
    }
    let pulse = |t: f64| (t - 0.005).clamp(0.0, 0.01);
    follows("pulse:amplitude=1,start=0.005,width=0.01,duration=1", &pulse, 1e-12);
    let back = |t: f64| {
        0.1 * ((t - 0.103).clamp(0.0, 0.0071) - (t - 0.103 - 0.0071 - 0.0333).clamp(0.0, 0.0071))
    };
    let profile = "bang-stop-bang:amplitude=0.1,start=0.103,bang=0.0071,stop=0.0333,duration=1";
    follows(profile, &back, 1e-12);
    // an upward sweep through 50 Hz, whose integral is computed from 10,000 midpoints
    let sweep = |t: f64| (std::f64::consts::TAU * (t + 59.0 / 4.0 * t * t)).sin();
    let integral = |t: f64| {
        let h = t / 1e4;
        (0..10_000).map(|k| sweep((f64::from(k) + 0.5) * h)).sum::<f64>() * h
    };
    follows("lin-sweep:amplitude=1,f0=1,f1=60,duration=2", &integral, 1e-4);
}

#[test]
fn the_option_sample_only_changes_the_interval_between_commands() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let inertia = inertia(folder);
    let of = |more: &[&str]| {
        let profile = ["--profile", "sine:amplitude=1,frequency=2,duration=1", "--step", "0.01"];
        run(folder, &[&FREE[..], &profile, more].concat())[2].iter().map(|w| w * inertia).collect()
    };
    let torque = |k: u32, h: f64| (std::f64::consts::TAU * 2.0 * h * f64::from(k)).sin();
    for (sample, more) in
        [(0.02, &[][..]), (0.02, &["--hold"]), (0.1, &["--hold", "--sample", "0.1"])]
    {
        let found: Vec<f64> = of(more);
        let count = (sample / 0.01_f64).round() as usize;
        for k in 0..(1.0 / sample).round() as u32 {
            let before = found[k as usize * count];
            let gained = found[(k as usize + 1) * count] - before;
            let mean = match more.is_empty() {
                true => (torque(k, sample) + torque(k + 1, sample)) / 2.0,
                false => torque(k, sample),
            };
            assert!((gained - mean * sample).abs() < 1e-10, "{more:?}, {k}");
        }
    }
    let fmu = packed_for_tests().to_str().unwrap();
    let profile = "--profile=sine:frequency=30";
    let said = expect_refusal(folder, &["run", "--fmu", fmu, "--out", "a.csv", profile, "--hold"]);
    assert!(said.contains("reaches 30 Hz") && said.contains("below 1.667e-2 s"), "{said}");
}

/// Output steps that do not meet the edges of a pulse must not change the impulse of the torque:
/// the table gets additional rows at the edges.
#[test]
fn hubslosh_torque_writes_a_row_for_each_edge_of_a_profile() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let impulse = |profile: &str, step: &str| {
        let arguments =
            ["torque", "--profile", profile, "--step", step, "--out", "t.csv", "--quiet"];
        assert!(hubslosh(folder, &arguments).status.success());
        let table = Table::read(&folder.join("t.csv"), &["time", "tau_cmd", "tau_slope"]).unwrap();
        let [time, tau, slope] = ["time", "tau_cmd", "tau_slope"].map(|n| table.column(n).unwrap());
        let part = |k: usize| {
            let h = time[k + 1] - time[k];
            assert!(h <= step.parse::<f64>().unwrap() * (1.0 + 1e-9));
            h * (tau[k] + slope[k] * h / 2.0)
        };
        (0..time.len() - 1).map(part).sum::<f64>()
    };
    for step in ["0.02", "0.007", "1"] {
        let found = impulse("pulse:amplitude=1,start=0.005,width=0.01,duration=1", step);
        assert!((found - 0.01).abs() < 1e-15, "{step}: {found}");
        // the integral over half a period of 50 Hz is 2/ω
        let found = impulse("sine:amplitude=1,frequency=50,duration=0.01", step);
        assert!((found * std::f64::consts::TAU * 25.0 - 1.0).abs() < 1e-3, "{step}: {found}");
    }
    let said =
        expect_refusal(folder, &["torque", "--profile", "lin-sweep:f1=1e9", "--out", "a.csv"]);
    assert!(said.contains("commands until 2700 s") && said.contains("is possible"), "{said}");
}

/// The rows of a campaign must be close enough to show the torque; otherwise the error names the
/// longest possible step. Between the rows the FMU follows the torque as in `hubslosh run`.
#[test]
fn a_campaign_follows_its_torque_or_names_the_step_that_it_needs() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let fmu = packed_for_tests().to_str().unwrap();
    let campaign = |plan: &str| {
        std::fs::write(folder.join("plan.toml"), plan).unwrap();
        hubslosh(
            folder,
            &["campaign", "--plan", "plan.toml", "--fmu", fmu, "--out", "out", "--quiet"],
        )
    };
    for (profile, needed) in [
        ("lin-sweep:f0=1,f1=60,duration=100", "below 8.333e-3 s"),
        ("lin-sweep:f1=1e9", "commands until 2700 s"),
        ("sine:frequency=50", "below 1.000e-2 s"),
    ] {
        let done = campaign(&format!("profile = \"{profile}\"\n"));
        let said = String::from_utf8(done.stderr).unwrap();
        assert!(!done.status.success() && said.contains(needed), "{profile}: {said}");
    }
    for (profile, step) in [
        ("pulse:amplitude=1,start=0.005,width=0.01,duration=1", "0.02"),
        ("sine:amplitude=1,frequency=20,duration=1", "0.02"),
        ("sine:amplitude=1,frequency=2.4,duration=1", "0.05"),
    ] {
        let done = campaign(&format!(
            "profile = \"{profile}\"\nstep = {step}\n[set]\nslosh.model = \"frozen\"\n\
             friction.model = \"none\"\n[[run]]\nname = \"one\"\n"
        ));
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let stored = Table::read(&folder.join("out/runs/one.parquet"), &["time", "omega"]).unwrap();
        let alone = ["--profile", profile, "--step", step, "--sample", step];
        let [time, _, omega] = run(folder, &[&FREE[..], &alone].concat());
        assert_eq!(stored.column("time").unwrap(), time);
        assert_eq!(stored.column("omega").unwrap(), omega, "{profile}");
        assert!(omega.iter().any(|omega| omega.abs() > 0.01), "{profile}");
        std::fs::remove_dir_all(folder.join("out")).unwrap();
    }
}

/// `hubslosh design` predicts the identification from one row per output step, so that it refuses a
/// sine of 50 Hz and pulses that are shorter than a step.
#[test]
fn design_refuses_a_profile_that_changes_too_fast_for_its_rows() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let fmu = packed_for_tests().to_str().unwrap();
    let rows: String = (0..1000)
        .map(|k| format!("{},{}\n", 0.001 * f64::from(k), u8::from((303..311).contains(&k))))
        .collect();
    std::fs::write(folder.join("in.csv"), format!("time,tau_cmd\n{rows}")).unwrap();
    for profile in [
        "sine:frequency=50",
        "pulse:start=0.005,width=0.01",
        "pulse:start=0.21,width=1",
        "lin-sweep:f0=1,f1=60,duration=100",
        "file:path=in.csv",
    ] {
        let said = expect_refusal(folder, &["design", "--profile", profile, "--fmu", fmu]);
        assert!(said.contains("edges at multiples of 0.02 s, frequencies up to 3.56 Hz"), "{said}");
    }
    let said = expect_refusal(folder, &["design", "--profile", "lin-sweep:f1=1e9", "--fmu", fmu]);
    assert!(said.contains("commands until 2700 s"), "{said}");
}

/// If an input that changes linearly were held at its value at the start of each step, it would be
/// late by half a step. Therefore the command refuses straight lines for such an FMU.
#[test]
fn an_fmu_that_cannot_interpolate_has_inputs_that_are_constant_between_rows() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let unpacked = folder.join("unpacked");
    let archive = std::fs::File::open(packed_for_tests()).unwrap();
    zip::ZipArchive::new(archive).unwrap().extract(&unpacked).unwrap();
    let text = std::fs::read_to_string(unpacked.join("modelDescription.xml")).unwrap();
    let changed = text.replace("canInterpolateInputs=\"true\"", "canInterpolateInputs=\"false\"");
    assert_ne!(text, changed);
    let name = format!("HubSlosh{}", std::env::consts::DLL_SUFFIX);
    let binary = unpacked.join("binaries").join(host::fmi2::PLATFORM).join(name);
    pack::archive::plain(&changed, &binary, "HubSlosh", None, &folder.join("held.fmu")).unwrap();
    write(folder, [(0.0, 0.1), (1.0, 0.2)].into_iter());
    let line = ["run", "--fmu", "held.fmu", "--input", "in.csv", "--out", "a.parquet"];
    let said = expect_refusal(folder, &line);
    for word in ["HubSlosh cannot interpolate its inputs", "tau_cmd is not constant", "--hold"] {
        assert!(said.contains(word), "{said}");
    }
    for more in [&["--hold"][..], &[]] {
        let source = if more.is_empty() { "--profile=pulse:start=0.005" } else { "--input=in.csv" };
        let all = ["run", "--fmu", "held.fmu", source, "--out", "a.parquet", "--quiet"];
        let done = hubslosh(folder, &[&all, more].concat());
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let notes = signals::table::metadata(&folder.join("a.parquet")).unwrap();
        let between = if more.is_empty() { "straight lines" } else { "held from row to row" };
        assert!(notes["inputs"].starts_with(between) && notes["rows"].contains("before"));
    }
}

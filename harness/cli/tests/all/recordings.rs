//! Analyses recordings with the program. A simulated run that is written in any file format gives the results of the
//! run itself. Further cases are a gyro at rest, a free decay and an empty tank.

use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use analysis::random::Random;
use pack::packed_for_tests;
use signals::table::Table;

fn hubslosh(folder: &Path, arguments: &[&str]) -> Result<String, String> {
    let done = Command::new(env!("CARGO_BIN_EXE_hubslosh"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .expect("the program runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    if done.status.success() {
        Ok(text(&done.stdout) + &text(&done.stderr))
    } else {
        Err(text(&done.stderr))
    }
}

fn rows(path: &Path) -> Vec<HashMap<String, String>> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader.deserialize().map(|row| row.unwrap()).collect()
}

/// Columns of the table of features that must be equal for a recording and for the run from which
/// the recording was made.
const SAME: [&str; 22] = [
    "fill_m",
    "amplitude_nm",
    "f_res_hz",
    "f_dip_hz",
    "delta_f_hz",
    "notch_db",
    "fit_freq_pct",
    "fit_time_pct",
    "coherence",
    "snr_res_db",
    "snr_dip_db",
    "skewness",
    "kurtosis",
    "zero_hz",
    "zero_damping",
    "pole_hz",
    "pole_damping",
    "estimator",
    "f_res_std_hz",
    "f_dip_std_hz",
    "peak_rate_rad_s",
    "peak_acceleration_rad_s2",
];

#[test]
fn a_recording_of_a_run_has_the_features_of_the_run_in_every_file_format() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let fmu = packed_for_tests();
    let fmu = fmu.to_str().unwrap();
    // The profile is a sixth of the thesis's sweep, so that each run takes a second.
    let profile = "exp-sweep:f0=1.25,f1=3.5,duration=450";
    let plan = format!(
        "profile = \"{profile},amplitude=0.1\"\n[set]\nimu.enabled = true\nimu.seed = 3\n[vary]\nslosh.model = [\"linear\"]\n"
    );
    std::fs::write(directory.join("run.toml"), plan).unwrap();
    hubslosh(directory, &["campaign", "--plan", "run.toml", "--out", "run", "--fmu", fmu]).unwrap();
    let run =
        std::fs::read_dir(directory.join("run/runs")).unwrap().next().unwrap().unwrap().path();
    let run = Table::read(&run, &["time", "tau_cmd", "omega_imu"]).unwrap();
    let [time, torque, rate] =
        ["time", "tau_cmd", "omega_imu"].map(|name| run.column(name).unwrap().to_vec());

    // The hub tilts at a tenth and at a fifth of its rate.
    let names = ["time", "tau_cmd", "omega", "omega_x", "omega_y"].map(String::from).to_vec();
    let part = |factor: f64| rate.iter().map(|w| factor * w).collect::<Vec<f64>>();
    let twin =
        Table::new(names, vec![time.clone(), torque.clone(), rate.clone(), part(0.1), part(-0.2)]);
    twin.write(&directory.join("twin.csv"), &BTreeMap::new()).unwrap();
    let settings =
        ["--set", "imu.enabled=true", "--set", "imu.seed=3", "--model", "linear", "--fmu", fmu];
    let analyse = |name: &str, others: &[&str]| {
        let all =
            [&["analyse", name, "--out", "found", "--profile", profile], &settings[..], others]
                .concat();
        let said = hubslosh(directory, &all).unwrap();
        (rows(&directory.join("found/features.csv")), said)
    };
    let (found, _) = analyse("twin.csv", &[]);
    let [recording, model] = &found[..] else { panic!("{found:?}") };
    assert_eq!((recording["model"].as_str(), model["model"].as_str()), ("recording", "linear"));
    for table in ["features.csv", "features_spa.csv", "features_h1.csv"] {
        let [of, from] = ["found", "run"].map(|folder| rows(&directory.join(folder).join(table)));
        for name in SAME {
            assert_eq!(of[0][name], from[0][name], "{table}: {name}");
            // The model with which the recording is compared is the run itself.
            assert_eq!(of[1][name], from[0][name], "{table}: {name} of the model");
        }
    }
    // The same recording with a gyro bias on each axis, of which the largest is 20 times the largest rate about its axis.
    let with = |values: &[f64], bias: f64| -> Vec<f64> {
        values.iter().map(|w| w + f64::to_radians(bias)).collect()
    };
    let names = ["time", "tau_cmd", "omega", "omega_x", "omega_y"].map(String::from).to_vec();
    let biased = vec![
        time.clone(),
        torque.clone(),
        with(&rate, 1.0),
        with(&part(0.1), 5.0),
        with(&part(-0.2), -2.0),
    ];
    let biased = Table::new(names, biased);
    biased.write(&directory.join("biased.csv"), &BTreeMap::new()).unwrap();
    let (of_biased, said) = analyse("biased.csv", &[]);
    for name in ["omega_x", "omega_y"] {
        assert!(said.contains(&format!("{name} has a mean of")), "{said}");
    }
    for name in [
        "off_axis_median",
        "off_axis_energy",
        "leakage",
        "peak_rate_rad_s",
        "peak_acceleration_rad_s2",
        "f_res_hz",
        "f_dip_hz",
        "notch_db",
        "fit_time_pct",
    ] {
        let [with, without] =
            [&of_biased[0], &found[0]].map(|row| row[name].parse::<f64>().unwrap());
        // A bias of 20 times the rate causes rounding errors of 1e-13, and a fit ends within 1e-8.
        assert!((with / without - 1.0).abs() < 1e-6, "{name}: {with} for {without}");
    }
    // CEF of proportional rates is (0.01 + 0.04)/1.05, the leakage √0.05
    let number = |row: &HashMap<String, String>, name: &str| row[name].parse::<f64>().unwrap();
    assert!((number(recording, "off_axis_median") - 0.05 / 1.05).abs() < 1e-12);
    assert!((number(recording, "leakage") - 0.05f64.sqrt()).abs() < 1e-9);
    assert!(
        ["stuck_s", "peak_slosh_angle_deg", "regime", "swirl"]
            .iter()
            .all(|name| recording[*name].is_empty())
    );
    let page = std::fs::read_to_string(directory.join("found/report.html")).unwrap();
    for words in [
        "Comparison of models with recordings",
        "Models overlaid",
        ">recording<",
        "1 recording, compared with 1 run",
    ] {
        assert!(page.contains(words), "{words}");
    }

    // the recording in the format of a data logger: semicolons, decimal commas, milliseconds, degrees, a beginning 5 s
    // before the torque, lost rows
    let mut random = Random::new(4, 0);
    let mut text = String::from("# bench\nt;T_cmd;gyro z\nms;mNm;deg/s\n");
    for k in -250..time.len() as i64 {
        let at = usize::try_from(k).ok();
        if random.uniform() < 0.002 && at.is_some() {
            continue;
        }
        let value = |column: &[f64]| at.map_or(0.0, |k| column[k]);
        let torque = 1e3 * value(&torque);
        let rate = value(&rate).to_degrees();
        let _ = writeln!(text, "{};{torque};{rate}", 7000 + 20 * k);
    }
    std::fs::write(directory.join("logger.csv"), text.replace('.', ",")).unwrap();
    let columns = ["--columns", "time=t,tau_cmd=T_cmd,omega=gyro z"];
    let (found, said) = analyse("logger.csv", &columns);
    assert!(said.contains("the torque begins at 7.00 s of the recording"), "{said}");
    // One lost row in 500 lies on a line between its neighbours, which is 4.5 % too low for a 2.4 Hz sine at 50 Hz.
    for (name, most) in
        [("f_res_hz", 2e-4), ("f_dip_hz", 2e-4), ("notch_db", 0.3), ("fit_time_pct", 0.5)]
    {
        let off = number(&found[0], name) - number(recording, name);
        assert!(off.abs() < most, "{name}: {off}");
    }

    // A recording with another torque is refused, and so is a plan without recordings.
    let wrong = [
        "analyse",
        "twin.csv",
        "--fmu",
        fmu,
        "--profile",
        "lin-sweep:duration=450",
        "--out",
        "wrong",
    ];
    let error = hubslosh(directory, &wrong).unwrap_err();
    assert!(
        error.contains("the recorded torque is not lin-sweep")
            && error.contains("allowed: at least 0.9"),
        "{error}"
    );
    let error = hubslosh(directory, &["analyse", "--plan", "run.toml", "--fmu", fmu]).unwrap_err();
    assert!(error.contains("no [[run]] of the plan has recording"), "{error}");
}

#[test]
fn noise_and_bias_of_a_gyro_are_estimated_from_a_recording_at_rest() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let mut random = Random::new(1, 0);
    // the recorded noise has 4e-4 rad/s at 50 Hz: N = 4e-4/√50
    let mut text = String::from("t,w\n");
    for k in 0..50_000 {
        let _ = writeln!(text, "{},{}", 20 * k, (4e-4 * random.normal()).to_degrees());
    }
    std::fs::write(directory.join("rest.csv"), text).unwrap();
    let of = ["gyro", "--recording", "rest.csv", "--columns", "time=t:ms,omega=w:deg/s"];
    let said = hubslosh(
        directory,
        &[&of[..], &["--chunk", "50", "--out", "g", "--report", "g.html"]].concat(),
    )
    .unwrap();
    let line = said.lines().find(|line| line.starts_with("angle random walk N")).unwrap();
    let walk: f64 = line.split_whitespace().nth(4).unwrap().parse().unwrap();
    // 50,000 samples determine the noise to 0.5 %.
    assert!((walk / (4e-4 / 50f64.sqrt()) - 1.0).abs() < 0.03, "{line}");
    let page = std::fs::read_to_string(directory.join("g.html")).unwrap();
    assert_eq!(page.matches("<svg ").count(), 6 + 6, "six charts, each with a nested one");
    assert!(page.contains("noise over quantisation"), "{page}");
    for name in ["allan", "quantiles", "autocorrelation", "chunks"] {
        assert!(
            directory.join(format!("g/{name}.svg")).is_file()
                && directory.join(format!("g/{name}.csv")).is_file()
        );
    }
    // a unit in the name of the column, and a text that is no unit
    let text = std::fs::read_to_string(directory.join("rest.csv")).unwrap();
    let named = |head: &str| std::fs::write(directory.join("named.csv"), text.replace("t,w", head));
    let characterise = |columns: &str| {
        let of = [
            "gyro",
            "--recording",
            "named.csv",
            "--chunk",
            "50",
            "--out",
            "n",
            "--columns",
            columns,
        ];
        hubslosh(directory, &of)
    };
    for head in ["t_ms,gyro_dps", "TimeMS,w_deg_s", "t [ms],w{deg/s}", "t in ms,w in deg/s"] {
        named(head).unwrap();
        let (time, rate) = head.split_once(',').unwrap();
        let said = characterise(&format!("time={time},omega={rate}")).unwrap();
        assert!(said.contains(line), "{head}: {said}");
    }
    named("t,gyro_dps").unwrap();
    let error = characterise("time=t,omega=gyro_dps").unwrap_err();
    assert!(error.contains("column t states no unit, and its rows are 20.0 apart"), "{error}");
    named("t_ms,w").unwrap();
    let said = characterise("time=t_ms,omega=w").unwrap();
    assert!(said.contains("omega = w, no unit stated, taken as rad/s"), "{said}");
    named("t_ms,gyro_deg").unwrap();
    let error = characterise("time=t_ms,omega=gyro_deg").unwrap_err();
    assert!(error.contains("column gyro_deg: \"deg\" is not a unit of a rate"), "{error}");
    let error = hubslosh(directory, &[&of[..], &["--out", "g"]].concat()).unwrap_err();
    assert!(
        error
            .contains("the recording lasts 1000 s, in chunks of 900 s (allowed: at least 3 chunks"),
        "{error}"
    );
}

#[test]
fn a_free_decay_of_30_s_determines_frequency_damping_and_its_growth() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let mut random = Random::new(2, 0);
    let (f, zeta, growth, start) = (2.33, 0.004, 0.4, 0.03);
    let omega = std::f64::consts::TAU * f;
    let mut text = String::from("time\tprobe\ns\tmm\n");
    for k in 0..1500 {
        let t = 0.02 * f64::from(k);
        let g = -(-zeta * omega * t).exp_m1() / zeta;
        let size = start * (-zeta * omega * t).exp() / (1.0 + growth * start * g);
        let wave = size * (omega * t).cos() + 2e-4 * random.normal();
        let _ = writeln!(text, "{t:.2}\t{:.4}", 1e3 * wave);
    }
    std::fs::write(directory.join("decay.txt"), text.replace('.', ",")).unwrap();
    let of = ["identify", "decay", "decay.txt", "--out", "d.json"];
    let of = [&of[..], &["--report", "d.html"]].concat();
    let said =
        hubslosh(directory, &[&of[..], &["--columns", "wave_height=probe"]].concat()).unwrap();
    assert!(said.contains("Damping depends on the amplitude"), "{said}");
    let page = std::fs::read_to_string(directory.join("d.html")).unwrap();
    assert!(page.contains("Residual over time") && page.contains("wave_height, m"));
    let found: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(directory.join("d.json")).unwrap()).unwrap();
    for (name, truth, unit) in
        [("frequency", f, "Hz"), ("zeta", zeta, "1"), ("zeta_amplitude", growth, "1/m")]
    {
        let estimate = &found["measurement"][name];
        let (value, std) = (estimate["value"].as_f64().unwrap(), estimate["std"].as_f64().unwrap());
        // one draw of the noise; the tolerance is four standard deviations
        assert!((value - truth).abs() < 4.0 * std && std < 0.05 * truth, "{name}: {estimate}");
        assert_eq!(estimate["unit"], unit);
    }
    // times in a unit that the file does not state, and times in whole seconds, each of which 50 rows share
    let probe = text.lines().skip(2).map(|line| line.split_once('\t').unwrap());
    let rows: Vec<(f64, String)> =
        probe.map(|(t, wave)| (t.parse().unwrap(), wave.to_string())).collect();
    let write = |head: &str, time: &dyn Fn(f64) -> String| {
        let lines = rows.iter().map(|(t, wave)| format!("{};{wave}\n", time(*t)));
        let text = format!("{head}\n{}", lines.collect::<String>());
        std::fs::write(directory.join("other.csv"), text).unwrap();
        let of = ["identify", "decay", "other.csv", "--out", "o.json"];
        hubslosh(directory, &of)
    };
    let estimate = |file: &str| -> f64 {
        let text = std::fs::read_to_string(directory.join(file)).unwrap();
        let found: serde_json::Value = serde_json::from_str(&text).unwrap();
        found["measurement"]["frequency"]["value"].as_f64().unwrap()
    };
    for factor in [1e3, 1e6, 1e9] {
        let error = write("time;wave_height [mm]", &|t| format!("{:.0}", t * factor)).unwrap_err();
        assert!(error.contains("column time states no unit, and its rows are"), "{error}");
    }
    for (head, factor) in [("time_ms", 1e3), ("time_us", 1e6), ("time [ns]", 1e9)] {
        let head = format!("{head};wave_height_mm");
        write(&head, &|t| format!("{:.0}", t * factor)).unwrap();
        assert!((estimate("o.json") / estimate("d.json") - 1.0).abs() < 1e-9, "{head}");
    }
    let error = write("time_s;wave_height [mm]", &|t| format!("{:.0}", t.floor())).unwrap_err();
    assert!(
        error.contains("rows share each time, and the time between rows is known to"),
        "{error}"
    );
    let of_ros = write("stamp.sec;stamp.nanosec;wave_height_mm", &|t| {
        format!("{:.0};{:.0}", 1.7e9 + t.floor(), 1e9 * t.fract())
    });
    assert!(of_ros.unwrap().contains("the times are the columns stamp.sec and stamp.nanosec"));
    assert!((estimate("o.json") / estimate("d.json") - 1.0).abs() < 1e-9);
    let error = hubslosh(directory, &of).unwrap_err();
    assert!(
        error.contains(
            "decay.txt has no column wave_height, force, theta, omega (columns in it: time, probe;"
        ),
        "{error}"
    );
}

#[test]
fn with_an_empty_tank_all_inertia_is_attributed_to_the_hub() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let fmu = packed_for_tests();
    let fmu = fmu.to_str().unwrap();
    let run = [
        "run",
        "--profile",
        "lin-sweep:amplitude=0.1,f0=0.5,f1=2,duration=60",
        "--out",
        "empty.csv",
        "--fmu",
        fmu,
        "--set",
        "fluid.rho=1e-6",
        "--set",
        "slosh.model=frozen",
        "--columns",
        "omega",
    ];
    hubslosh(directory, &run).unwrap();
    let of = ["identify", "friction", "empty.csv", "--fmu", fmu, "--out", "e.json"];
    hubslosh(directory, &of).unwrap();
    let found: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(directory.join("e.json")).unwrap()).unwrap();
    let inertia = found["parameters"]["hub.I"]["value"].as_f64().unwrap();
    // With --set tank.h=0.1 a quarter of the 2.09 kg of water would be subtracted.
    assert!((inertia / 0.322414 - 1.0).abs() < 1e-3, "{inertia}");
}

//! Runs `hubslosh view` as a process. The script `.ci/browser` compares the drawing in a browser.

use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Output};

use base64ct::{Base64, Encoding};
use pack::{packed_for_tests, packed_model_for_tests};

fn hubslosh(directory: &Path, arguments: &[&str]) -> Output {
    let fmu = ["--fmu", packed_for_tests().to_str().unwrap()];
    let mut command = Command::new(env!("CARGO_BIN_EXE_hubslosh"));
    command.current_dir(directory).args(arguments).args(fmu).output().expect("the program runs")
}

fn stderr_text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

const RUN: [&str; 5] =
    ["run", "--profile", "exp-sweep:amplitude=0.1,duration=20", "--set", "tank.d=200mm"];

fn read_page_data(directory: &Path, file: &str) -> serde_json::Value {
    let page = std::fs::read_to_string(directory.join(file)).unwrap();
    for word in [" src=\"", "<link", "@import", "url(http"] {
        assert!(!page.contains(word), "{word} is in the page");
    }
    assert!(page.contains("<noscript>") && page.contains("The MIT License"));
    let (_, rest) = page.split_once("id=\"run\">").unwrap();
    serde_json::from_str(rest.split("</script>").next().unwrap()).unwrap()
}

#[test]
fn a_run_with_default_columns_becomes_a_page_with_the_run_s_parameters() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    assert!(hubslosh(directory, &[&RUN[..], &["--out", "run.parquet"]].concat()).status.success());
    let done = hubslosh(directory, &["view", "run.parquet", "--from", "5", "--to", "10"]);
    assert!(done.status.success(), "{}", stderr_text(&done));
    assert_eq!(stderr_text(&done), "");
    let run = read_page_data(directory, "run.html");
    assert_eq!(run["time"]["count"], 251);
    assert_eq!(run["scene"]["geometry"]["tanks"][0]["shape"]["contour"][1][0], 0.1);
    // A CSV file cannot hold the parameters; they are given on the command line, or the command asks for them.
    assert!(hubslosh(directory, &[&RUN[..], &["--out", "run.csv"]].concat()).status.success());
    let done = hubslosh(directory, &["view", "run.csv", "--out", "csv.html"]);
    assert!(
        stderr_text(&done).contains("does not contain the parameters"),
        "{}",
        stderr_text(&done)
    );
    assert_eq!(
        read_page_data(directory, "csv.html")["scene"]["geometry"]["tanks"][0]["shape"]["contour"]
            [1][0],
        0.0815
    );
}

#[test]
fn view_refuses_runs_that_cannot_be_drawn_and_writes_no_page() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let columns = ["--columns", "wave_height", "--out", "run.parquet"];
    assert!(hubslosh(directory, &[&RUN[..], &columns].concat()).status.success());
    for (arguments, why) in [
        (
            &["run.parquet"][..],
            "no theta (or omega); no slosh_angle_radial, slosh_angle (or slosh_angle)",
        ),
        (&["run.parquet"], "--columns theta,omega,slosh_angle,slosh_angle_radial,wave_height"),
        (&["run.parquet", "--from", "30"], "leave 0 row(s)"),
        (&["run.parquet", "--out", "page.txt"], "must end in .html"),
        (&["run.parquet", "--set", "tank.dd=1"], "no variable \"tank.dd\""),
        (&["none.parquet"], "cannot be opened"),
    ] {
        let done = hubslosh(directory, &[&["view"], arguments].concat());
        assert_eq!(done.status.code(), Some(1));
        assert!(stderr_text(&done).contains(why), "{arguments:?}: {}", stderr_text(&done));
    }
    assert!(!directory.join("run.html").exists());
}

fn column(run: &serde_json::Value, name: &str) -> Vec<f64> {
    let text = run["columns"][name].as_str().unwrap_or_else(|| panic!("no {name}"));
    let bytes = Base64::decode_vec(text).unwrap();
    bytes.chunks(4).map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap()))).collect()
}

/// For each slosh model, a sweep over the first two frequencies excites a liquid with three modes.
/// Page and FMU agree to 32 bits, with which the page stores its numbers.
#[test]
fn the_modes_that_are_drawn_add_up_at_the_wall_to_the_wave_height_of_the_fmu() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    for model in ["linear", "planar", "spherical", "liquid"] {
        let set = format!("slosh.model={model}");
        let profile = "exp-sweep:amplitude=0.2,f0=1.5,f1=4.5,duration=20";
        let run = ["run", "--profile", profile, "--set", &set, "--set", "slosh.modes=3"];
        let mut columns =
            "omega,wave_height,slosh_angle,slosh_angle_radial,slosh.q_tangential[2],slosh.q_tangential[3]"
                .to_string();
        if !["linear", "planar"].contains(&model) {
            columns += ",slosh.q_radial[2],slosh.q_radial[3]";
        }
        let rest = ["--columns", &columns, "--out", "run.parquet"];
        assert!(hubslosh(directory, &[&run[..], &rest].concat()).status.success(), "{model}");
        let done = hubslosh(directory, &["view", "run.parquet"]);
        assert!(
            done.status.success() && stderr_text(&done).is_empty(),
            "{model}: {}",
            stderr_text(&done)
        );
        let page = read_page_data(directory, "run.html");
        let modes = page["scene"]["geometry"]["tanks"][0]["modes"].as_array().unwrap();
        let angles = page["tanks"][0]["modes"].as_array().unwrap();
        assert_eq!((modes.len(), angles.len()), (3, 3), "{model}");
        let wave = column(&page, "wave_height");
        let mut wall = vec![[0.0; 2]; wave.len()];
        let mut most = [0.0; 3];
        for (n, (mode, names)) in modes.iter().zip(angles).enumerate() {
            for (axis, name) in names["angles"].as_array().unwrap().iter().enumerate() {
                let values =
                    name.as_str().map_or(vec![0.0; wave.len()], |name| column(&page, name));
                for (wall, angle) in wall.iter_mut().zip(values) {
                    wall[axis] += mode["wave"].as_f64().unwrap() * angle;
                    most[n] = f64::max(most[n], angle.abs());
                }
            }
        }
        assert!(most.iter().all(|most| *most > 1e-3), "{model}: modes do not move: {most:?} rad");
        let height = wave.iter().fold(0.0, |most: f64, wave| most.max(*wave));
        for ([x, y], wave) in wall.into_iter().zip(wave) {
            assert!(
                (x.hypot(y) - wave).abs() < 1e-6 * height,
                "{model}: {} is not {wave}",
                x.hypot(y)
            );
        }
    }
    // a run with only the columns recorded by default: the states of the higher modes are missing, so that the page draws
    // the first mode and says so
    let run = ["run", "--profile", "exp-sweep:amplitude=0.1,duration=5", "--set", "slosh.modes=3"];
    assert!(hubslosh(directory, &[&run[..], &["--out", "all.parquet"]].concat()).status.success());
    let done = hubslosh(directory, &["view", "all.parquet"]);
    assert!(done.status.success() && stderr_text(&done).is_empty(), "{}", stderr_text(&done));
    let page = read_page_data(directory, "all.html");
    assert_eq!(page["scene"]["geometry"]["tanks"][0]["modes"].as_array().unwrap().len(), 3);
    let columns = ["--columns", "omega,slosh_angle,slosh_angle_radial", "--out", "less.parquet"];
    assert!(hubslosh(directory, &[&run[..], &columns].concat()).status.success());
    let done = hubslosh(directory, &["view", "less.parquet"]);
    let warning = stderr_text(&done);
    assert!(done.status.success() && warning.contains("1 of 3 slosh modes are drawn"), "{warning}");
    assert!(warning.contains("slosh.q_radial[3],slosh.q_tangential[3]"), "{warning}");
    let page = read_page_data(directory, "less.html");
    assert_eq!(page["scene"]["geometry"]["tanks"][0]["modes"].as_array().unwrap().len(), 1);
}

/// Liquid that stands higher on one side has its centre of mass on this side. In linear theory, the
/// integral of density times elevation times horizontal coordinate over the surface, for a slosh
/// angle of 1, equals the mass of a mode times its pendulum length, for every mode and every tank.
/// If the surface of a cylinder were drawn in this sphere, the integral would differ by a tenth.
#[test]
fn the_surface_that_is_drawn_in_a_sphere_moves_its_liquid_as_far_as_the_pendulum_does() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    std::fs::write(
        directory.join("sphere.toml"),
        "name = \"sphere\"\ndensity = 1004.0\nshape = { sphere = { radius = 0.3 } }\n",
    )
    .unwrap();
    let (fill, radius) = (0.14, f64::sqrt(0.3 * 0.3 - 0.16 * 0.16));
    let mut tank = Command::new(env!("CARGO_BIN_EXE_hubslosh"));
    tank.current_dir(directory).args(["tank", "sphere.toml", "--fill", "0.14", "--modes", "3"]);
    let solved = tank.args(["--parameters", "liquid.toml"]).output().unwrap();
    assert!(solved.status.success(), "{fill} m: {}", stderr_text(&solved));
    let run = ["run", "--profile", "exp-sweep:amplitude=0.1,duration=5"];
    let rest = ["--parameters", "liquid.toml", "--out", "run.parquet"];
    let columns = [
        "--columns",
        "theta,slosh_angle,slosh_angle_radial,slosh.q_radial[2],slosh.q_radial[3],slosh.q_tangential[2],slosh.q_tangential[3]",
    ];
    let done = hubslosh(directory, &[&run[..], &rest, &columns].concat());
    assert!(done.status.success(), "{}", stderr_text(&done));
    let done = hubslosh(directory, &["view", "run.parquet", "--tank", "sphere.toml"]);
    assert!(done.status.success(), "{}", stderr_text(&done));
    let page = read_page_data(directory, "run.html");
    let modes = page["scene"]["geometry"]["tanks"][0]["modes"].as_array().unwrap();
    assert_eq!(modes.len(), 3);
    for mode in modes {
        let of = |key: &str| mode[key].as_f64().unwrap();
        let shape: Vec<f64> =
            mode["shape"].as_array().unwrap().iter().map(|s| s.as_f64().unwrap()).collect();
        assert_eq!(shape[shape.len() - 1], 1.0);
        // integral over the radius by Simpson's rule
        let last = shape.len() - 1;
        let integral = |of: &dyn Fn(f64) -> f64| -> f64 {
            let weight = |i| if i == 0 || i == last { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
            let term = |i| weight(i) * of(shape[i]) * (i as f64 / last as f64).powi(2);
            (0..=last).map(term).sum::<f64>() / (3.0 * last as f64)
        };
        let all = 1004.0 * std::f64::consts::PI * of("wave") * radius.powi(3);
        let moved = all * integral(&|s| s);
        // In the integrals of higher modes positive and negative parts nearly cancel; the error of straight lines
        // between 80 steps is relative to the parts.
        let size = all * integral(&f64::abs);
        let pendulum = of("mass") * of("length");
        assert!((moved - pendulum).abs() < 1e-3 * size, "{moved} kg m, not {pendulum} of {size}");
    }
}

/// `hubslosh tank` writes HubSlosh's parameters so that the modes along a box's first side move in
/// the tangential direction, the y axis of the tank.
#[test]
fn the_first_length_of_a_box_on_the_bench_is_drawn_along_the_tangent() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let text = "name = \"box\"\ndensity = 997.0\nbox = [0.3, 0.2]\n";
    std::fs::write(directory.join("box.toml"), text).unwrap();
    let mut tank = Command::new(env!("CARGO_BIN_EXE_hubslosh"));
    tank.current_dir(directory).args(["tank", "box.toml", "--fill", "0.1", "--modes", "2"]);
    let solved = tank.args(["--parameters", "liquid.toml"]).output().unwrap();
    assert!(solved.status.success(), "{}", stderr_text(&solved));
    let run = ["run", "--profile", "exp-sweep:amplitude=0.1,duration=5", "--out", "run.parquet"];
    let rest = ["--parameters", "liquid.toml", "--set", "slosh.model=linear"];
    let states = "slosh.q_tangential[2],slosh.q_radial[3],slosh.q_radial[4]";
    let others = "slosh.q_radial[2],slosh.q_tangential[3],slosh.q_tangential[4]";
    let columns = format!("theta,slosh_angle,slosh_angle_radial,{states},{others}");
    let done = hubslosh(directory, &[&run[..], &rest, &["--columns", &columns]].concat());
    assert!(done.status.success(), "{}", stderr_text(&done));
    let done = hubslosh(directory, &["view", "run.parquet", "--tank", "box.toml"]);
    assert!(done.status.success() && stderr_text(&done).is_empty(), "{}", stderr_text(&done));
    let page = read_page_data(directory, "run.html");
    let tank = &page["scene"]["geometry"]["tanks"][0];
    assert_eq!(tank["shape"]["box"], serde_json::json!([0.2, 0.3]));
    let modes = tank["modes"].as_array().unwrap();
    let orders: Vec<_> = modes.iter().map(|mode| mode["order"].as_u64().unwrap()).collect();
    assert_eq!(orders, [0, 1, 0, 1], "two along the tangent, two along the radius");
}

#[test]
fn default_columns_of_a_draining_tank_are_enough_for_its_page() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let fmu = packed_model_for_tests(pack::model("SloshTank").unwrap());
    let of_tank = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hubslosh"));
        command.current_dir(directory).args(arguments).arg("--fmu").arg(fmu).output().unwrap()
    };
    let set = ["--set", "tank.fill.points=8", "--set", "mass_flow=0.1", "--set", "a[3]=1"];
    let run =
        ["run", "--profile", "zero", "--drive", "a[1]", "--stop", "2", "--out", "drain.parquet"];
    let done = of_tank(&[&run[..], &set].concat());
    assert!(done.status.success(), "{}", stderr_text(&done));
    let done = of_tank(&["view", "drain.parquet"]);
    assert!(done.status.success() && stderr_text(&done).is_empty(), "{}", stderr_text(&done));
    let liquid = column(&read_page_data(directory, "drain.html"), "tank.liquid");
    assert!(liquid[0] - liquid[liquid.len() - 1] > 0.1);
}

/// In HTML, `</script>` after `<!--<script` does not end a script element, so that the rest of the
/// page would be lost.
#[test]
fn a_unit_that_contains_html_markup_does_not_break_the_page() {
    const UNIT: &str = "<!--<script></script>&\u{2028}";
    let folder = tempfile::tempdir().unwrap();
    let mut from =
        zip::ZipArchive::new(std::fs::File::open(pack::packed_for_tests()).unwrap()).unwrap();
    let mut to = zip::ZipWriter::new(std::fs::File::create(folder.path().join("a.fmu")).unwrap());
    for i in 0..from.len() {
        let mut file = from.by_index(i).unwrap();
        let name = file.name().unwrap().into_owned();
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).unwrap();
        if name == "modelDescription.xml" {
            let escaped = UNIT.replace('&', "&amp;").replace('<', "&lt;");
            bytes = String::from_utf8(bytes)
                .unwrap()
                .replace("\"rad/s\"", &format!("\"{escaped}\""))
                .into();
        }
        to.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        to.write_all(&bytes).unwrap();
    }
    to.finish().unwrap();
    for arguments in [
        "run --fmu a.fmu --profile exp-sweep:amplitude=0.1 --stop 1 --out run.parquet",
        "view run.parquet --fmu a.fmu",
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hubslosh"));
        let done = command.current_dir(folder.path()).args(arguments.split(' ')).output().unwrap();
        assert!(done.status.success(), "{}", stderr_text(&done));
    }
    let page = std::fs::read_to_string(folder.path().join("run.html")).unwrap();
    let (_, data) = page.split_once("id=\"run\">").unwrap();
    let (data, _) = data.split_once("</script>").unwrap();
    assert!(!data.contains(['<', '>', '&', '\u{2028}', '\u{2029}']));
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    assert!(data.to_string().contains("<!--<script></script>&"), "{data}");
}

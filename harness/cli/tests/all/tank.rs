use std::process::Command;

fn tank(arguments: &[&str]) -> (bool, String, String) {
    let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/../tank/examples");
    let done = Command::new(env!("CARGO_BIN_EXE_hubslosh"))
        .current_dir(examples)
        .arg("tank")
        .args(arguments)
        .output()
        .unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (done.status.success(), text(done.stdout), text(done.stderr))
}

/// The eigenvalue lambda_1 R and m_1/m_liq are compared with Budiansky (1960); all hinges are at
/// the centre of the sphere.
#[test]
fn a_half_full_sphere_has_its_published_first_mode() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("sphere.toml"), folder.path().join("result.json"));
    std::fs::write(&file, "density = 1000\nshape = { sphere = { radius = 2 } }\n").unwrap();
    let (file, out) = (file.to_str().unwrap(), out.to_str().unwrap());
    let (ok, _, error) = tank(&[file, "--fill", "2", "--out", out]);
    assert!(ok, "{error}");
    let text = std::fs::read_to_string(out).unwrap();
    let result: serde_json::Value = serde_json::from_str(&text).unwrap();
    let number = |pointer: &str| result.pointer(pointer).unwrap().as_f64().unwrap();
    // 1.56015717 and 0.57969303 are given to 9 digits.
    assert!((number("/modes/0/lambda") * 2.0 - 1.56015717).abs() < 1e-8);
    assert!((number("/modes/0/m") / number("/m_liq") - 0.57969303).abs() < 1e-8);
    let centre = number("/modes/0/hinge") - number("/modes/1/hinge");
    assert!(centre.abs() < 1e-6 * 2.0 && number("/error") < 1e-6);
}

#[test]
fn an_invalid_tank_is_refused_in_a_sentence_without_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("bad.toml"), folder.path().join("result.json"));
    std::fs::write(&file, "density = 1000\nprofile = [{ line = [0, 0, 1, 0] }]\n").unwrap();
    let arguments = [file.to_str().unwrap(), "--fill", "0.5", "--out", out.to_str().unwrap()];
    let (ok, _, error) = tank(&arguments);
    assert!(!ok && error.contains("bad.toml") && !error.contains("panicked"), "{error}");
    assert!(!out.exists());
}

/// The bench's cylinder gets its parameters from a drawing (through a TOML and an SSV file) or from
/// its dimensions. Masses and lengths agree to 1e-11. The tolerance of the rates, 1e-9 rad/s, is
/// about 1e-8 of their size.
#[test]
fn parameters_of_a_drawn_tank_give_the_same_motion_as_its_dimensions() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let text = "density = 1000\nshape = { cylinder = { radius = 0.0815, height = 0.3 } }\n";
    std::fs::write(path("tank.toml"), text).unwrap();
    for file in ["set.toml", "set.ssv"] {
        let (ok, _, error) = tank(&[
            &path("tank.toml"),
            "--fill=0.1",
            "--modes=2",
            "--nu=9.1312e-7",
            "--gravity=9.81",
            "--out",
            &path("result.json"),
            "--parameters",
            &path(file),
        ]);
        assert!(ok, "{error}");
    }
    let run = |more: &[&str]| {
        let out = path("out.csv");
        let done = Command::new(env!("CARGO_BIN_EXE_hubslosh"))
            .args(["run", "--fmu", pack::packed_for_tests().to_str().unwrap(), "--stop=5"])
            .args(["--profile", "sine:amplitude=0.1,frequency=2.3", "--set", "slosh.model=planar"])
            .args(["--columns", "omega,wave_height", "--out", &out])
            .args(more)
            .output()
            .unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        signals::table::Table::read(std::path::Path::new(&out), &["omega", "wave_height"]).unwrap()
    };
    let geometry = run(&["--set", "slosh.modes=2"]);
    let toml = run(&["--set-file", &path("set.toml")]);
    let ssv = run(&["--set-file", &path("set.ssv")]);
    for column in ["omega", "wave_height"] {
        let [a, b, c] = [&geometry, &toml, &ssv].map(|table| table.column(column).unwrap());
        assert!(a.iter().any(|x| x.abs() > 1e-3), "it moves");
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9), "{column}");
        assert_eq!(b, c, "{column}: both files hold the same numbers");
    }
    // A value of --set replaces the value in the file.
    let other = run(&["--set-file", &path("set.toml"), "--set", "slosh.table.m_liq=3"]);
    assert_ne!(other.column("omega").unwrap(), toml.column("omega").unwrap());
}

#[test]
fn parameter_files_for_spacecraft_and_sloshtank_have_the_names_of_their_variables() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    std::fs::write(path("tank.toml"), "density = 1000\nshape = { sphere = { radius = 0.3 } }\n")
        .unwrap();
    for (model, prefix) in [("SloshTank", "tank"), ("Spacecraft", "tank[2]")] {
        let set = path("set.toml");
        let (ok, _, error) = tank(&[
            &path("tank.toml"),
            "--fill=0.3",
            "--out",
            &path("result.json"),
            "--parameters",
            &set,
            "--model",
            model,
            "--tank-number=2",
            "--sigma=0.07",
        ]);
        assert!(ok, "{error}");
        let set: toml::Table = std::fs::read_to_string(set).unwrap().parse().unwrap();
        let text = std::fs::read_to_string(path("result.json")).unwrap();
        let result: serde_json::Value = serde_json::from_str(&text).unwrap();
        let fmu = host::fmu::Fmu::open(pack::packed_model_for_tests(pack::model(model).unwrap()))
            .unwrap();
        for name in set.keys() {
            fmu.description().variable(name).unwrap();
        }
        for (name, pointer) in [
            ("m_0", "/rest/2/m_0"),
            ("H_0", "/rest/2/H_0"),
            ("I_0", "/rest/2/I_0"),
            ("mass[3]", "/modes/2/m"),
            ("length[1]", "/modes/0/l"),
            ("hinge[2]", "/modes/1/hinge"),
            ("wave[2]", "/modes/1/wave"),
        ] {
            let found = set[&format!("{prefix}.{name}")].as_float().unwrap();
            assert_eq!(found, result.pointer(pointer).unwrap().as_f64().unwrap(), "{name}");
        }
        assert_eq!(set[&format!("{prefix}.modes")].as_integer(), Some(3));
    }
}

/// For a deep cylinder at the Bond number 10 and the contact angle 30 degrees, the table for curved
/// menisci has omega_1^2 rho R^3/sigma = 21.4397, which determines the expected frequency. In the
/// bench's tank, liquid with this contact angle has a negative stiffness, which the FMU does not
/// accept.
#[test]
fn the_fmu_has_the_frequency_of_a_curved_meniscus_and_negative_stiffnesses_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let text = "density = 1000\nshape = { cylinder = { radius = 0.1, height = 3 } }\n";
    std::fs::write(path("tank.toml"), text).unwrap();
    let written = |gravity: &str, angle: &str| {
        let (ok, _, said) = tank(&[
            &path("tank.toml"),
            "--fill=2",
            "--modes=2",
            "--sigma=0.072",
            "--gravity",
            gravity,
            "--contact-angle",
            angle,
            "--out",
            &path("result.json"),
            "--parameters",
            &path("set.toml"),
        ]);
        (ok, said)
    };
    let frequency = |gravity: &str| {
        let out = path("out.csv");
        let done = Command::new(env!("CARGO_BIN_EXE_hubslosh"))
            .args(["run", "--fmu", pack::packed_for_tests().to_str().unwrap(), "--stop=0.1"])
            .args(["--profile", "zero", "--columns", "slosh.frequency[1]", "--out", &out])
            .args(["--set-file", &path("set.toml"), "--set", &format!("g_axial={gravity}")])
            .output()
            .unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let column = ["slosh.frequency[1]"];
        let table = signals::table::Table::read(std::path::Path::new(&out), &column).unwrap();
        table.column(column[0]).unwrap()[0]
    };
    let (ok, said) = written("0.072", "30");
    assert!(ok && said.contains("warning: capillarity: under a curved meniscus"), "{said}");
    // rho R^3/sigma = 1/0.072; 21.4397 is given to 2.4e-6.
    let omega2 = (core::f64::consts::TAU * frequency("0.072")).powi(2);
    assert!((omega2 / 0.072 - 21.4397).abs() < 6e-5, "{}", omega2 / 0.072);
    let (ok, said) = written("9.81", "5");
    assert!(ok && said.contains("do not accept a negative k, so 0 is written"), "{said}");
    assert!(frequency("9.81") > 2.0, "the FMU takes the file");
    for (gravity, angle, words) in [
        ("9.81", "200", "--contact-angle 200 (allowed: 0 to 180)"),
        ("1e-10", "30", "at least 1e-9"),
    ] {
        std::fs::remove_file(path("set.toml")).unwrap_or_default();
        let (ok, said) = written(gravity, angle);
        assert!(!ok && said.contains(words) && !folder.path().join("set.toml").exists(), "{said}");
    }
}

/// A sphere with a radius of 1 m that is half full has a liquid height of 1 m, 50 % of its volume,
/// and 2094.395 kg of water.
#[test]
fn a_fill_is_given_in_metres_in_per_cent_or_by_mass() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("sphere.toml");
    std::fs::write(&file, "density = 1000\nshape = { sphere = { radius = 1 } }\n").unwrap();
    let file = file.to_str().unwrap();
    let (ok, metres, error) = tank(&[file, "--fill=1"]);
    assert!(ok && metres.contains("fill 1 m, density"), "{metres}{error}");
    for fill in ["--fill=50%", "--fill-mass=2094.3951023931954"] {
        let (ok, same, error) = tank(&[file, fill]);
        assert!(ok && same == metres, "{fill}: {same}{error}");
    }
    let (ok, swept, error) = tank(&[file, "--sweep=0.5,50%,100%"]);
    assert!(ok && swept.lines().count() == 4, "{swept}{error}");
    let (ok, full, error) = tank(&[file, "--fill=2.0"]);
    assert!(ok && full.contains("none: the tank is full and does not slosh"), "{full}{error}");
    for (arguments, words) in [
        (&["--fill=120%"][..], "0 to 100 %"),
        (&["--fill=0%"], "must be above 0"),
        (&["--fill=60 percent"], "neither a height in m (1.2) nor per cent"),
        (&["--fill-mass=5000"], "more than the tank holds: 4188.790205 kg"),
        (&["--fill=1", "--fill-mass=5000"], "cannot be used with"),
        (&[], "--fill"),
    ] {
        let (ok, _, said) = tank(&[&[file], arguments].concat());
        assert!(!ok && said.contains(words), "{said}");
    }
}

/// Without gravity the frequencies in the table are 0. A parameter file has the stiffness by
/// capillarity, but no damping ratios, because there is no specific force at which they would hold.
#[test]
fn without_gravity_only_surface_tension_restores_the_liquid() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let text = "density = 1000\nshape = { cylinder = { radius = 0.1, height = 3 } }\n";
    std::fs::write(path("tank.toml"), text).unwrap();
    let (file, set) = (path("tank.toml"), path("set.toml"));
    let base = [&file[..], "--fill=2", "--gravity=0"];
    let (ok, said, error) = tank(&base);
    assert!(ok && said.contains("only capillarity brings the liquid back"), "{said}{error}");
    assert!(!said.contains("NaN") && !said.contains("inf"), "{said}");
    let (ok, _, said) = tank(&[&base[..], &["--parameters", &set]].concat());
    assert!(ok && said.contains("the liquid has no restoring force"), "{said}");
    let (ok, _, said) = tank(&[&base[..], &["--parameters", &set, "--sigma=0.072"]].concat());
    assert!(ok, "{said}");
    let written = std::fs::read_to_string(&set).unwrap();
    let k = written.lines().find_map(|l| l.strip_prefix("\"slosh.table.k[1]\" = ")).unwrap();
    assert!(k.parse::<f64>().unwrap() > 0.0 && !written.contains("g_ref"), "{written}");
    for (more, words) in [
        (&["--parameters", &set, "--nu=1e-6"][..], "A damping ratio depends on the acceleration"),
        (&["--gravity=-1"], "--gravity -1 (allowed: 0 or more"),
    ] {
        let given: Vec<&str> = base[..2].iter().chain(more).copied().collect();
        let given = if words.starts_with("--") { given } else { [&given[..], &base[2..]].concat() };
        let (ok, _, said) = tank(&given);
        assert!(!ok && said.contains(words), "{said}");
    }
}

/// In a sphere of 1 m at 1e-6 m/s² the first-order correction by capillarity is larger than the
/// value that it corrects.
#[test]
fn a_stiffness_far_outside_its_formula_is_written_only_with_the_option_force() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    std::fs::write(path("a.toml"), "density = 1000\nshape = { sphere = { radius = 1 } }\n")
        .unwrap();
    let (file, set) = (path("a.toml"), path("set.toml"));
    let given: [&str; 6] =
        [&file, "--fill=1", "--gravity=1e-6", "--sigma=0.072", "--parameters", &set];
    let (ok, _, said) = tank(&given);
    assert!(!ok && said.contains("k of mode 1 is not known: surface tension adds"), "{said}");
    assert!(said.contains("--force") && !std::fs::exists(&set).unwrap(), "{said}");
    let (ok, _, said) = tank(&[&given[..], &["--force"]].concat());
    assert!(ok && said.contains("too much for a computation to first order"), "{said}");
    assert!(
        std::fs::read_to_string(&set)
            .unwrap()
            .contains("# warning: capillarity: surface tension adds")
    );
}

#[test]
fn invalid_parameter_files_are_refused_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text, words) in [
        ("set.txt", "a = 1", "must end in .toml, .ssv or .json"),
        ("set.toml", "a = [1]", "line 1: a cannot be a value of a parameter"),
        ("set.toml", "", "contains no parameters"),
        ("set.toml", "\"tank.q\" = 1", "tank.q"),
        ("set.ssv", "<a/>", "the root element is a, not ParameterSet"),
        (
            "set.ssv",
            "<ParameterSet><Parameters><Parameter name='x'/></Parameters></ParameterSet>",
            "x has no value",
        ),
        ("set.ssv", "<ParameterSet>", "set.ssv: line 1, column "),
        (
            "set.ssv",
            "<ParameterSet><Parameters><Parameter name='x'><Real value='1'/></Parameter>\n<Parameter name='x'><Real \
             value='2'/></Parameter></Parameters></ParameterSet>",
            "set.ssv: line 2: x is given twice, first in line 1 (allowed: once)",
        ),
        ("set.json", "{}", "it is not a result of `hubslosh identify`"),
        ("set.json", r#"{"parameters": {"hub.I": 1}}"#, "hub.I has no number"),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let done = Command::new(env!("CARGO_BIN_EXE_hubslosh"))
            .current_dir(folder.path())
            .args(["run", "--fmu", pack::packed_for_tests().to_str().unwrap()])
            .args(["--profile", "zero", "--out", "out.csv", "--set-file", path.to_str().unwrap()])
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&done.stderr);
        assert!(!done.status.success() && said.trim().lines().count() == 1, "{said}");
        assert!(said.contains(words) || words == "could not be read", "{words}: {said}");
        assert!(!folder.path().join("out.csv").exists());
    }
}

/// At the Bond number 3.6 and the contact angle 30 degrees, omega_1^2 rho R^3/sigma of a deep
/// cylinder is between 9.1 and 21.4, the values of the table for curved menisci at the Bond numbers
/// 3 and 10; gravity alone would give 6.6. For a sphere there is no formula: the frequency is
/// reported as unknown, and is null in JSON.
#[test]
fn frequencies_include_the_surface_tension_if_it_is_given() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let shape = |shape: &str| {
        let text = format!("density = 1000\nshape = {{ {shape} }}\n");
        std::fs::write(path("tank.toml"), text).unwrap();
    };
    let run = |more: &[&str]| {
        let file = path("tank.toml");
        let args = ["--modes=2", "--gravity=0.02592", "--sigma=0.072", "--contact-angle=30"];
        let (ok, out, said) = tank(&[&[&file[..]], &args[..], more].concat());
        assert!(ok, "{said}");
        (out, said)
    };
    shape("cylinder = { radius = 0.1, height = 3 }");
    let (table, _) = run(&["--fill=2", "--picture", &path("tank.svg")]);
    let (json, said) = run(&["--fill=2", "--json"]);
    let data: serde_json::Value = serde_json::from_str(&json).unwrap();
    let found = &data["capillarity"];
    let omega = found["modes"][0]["omega"].as_f64().unwrap();
    let omega2 = omega * omega / 0.072;
    let gravity = 0.02592 * data["modes"][0]["lambda"].as_f64().unwrap() / 0.072;
    assert!((10.0..10.4).contains(&omega2) && gravity < 6.7, "{omega2} {gravity}");
    assert!((found["bond"].as_f64().unwrap() - 3.6).abs() < 1e-12);
    let row = |table: &str| -> Vec<String> {
        let row = table.lines().find(|line| line.trim_start().starts_with("1  ")).unwrap();
        row.split_whitespace().map(String::from).collect()
    };
    assert_eq!(row(&table)[1], format!("{:.6}", omega / core::f64::consts::TAU));
    assert!(table.contains("contact angle 30 degrees, Bond number 3.6"), "{table}");
    assert!(table.contains("warning: capillarity: under a curved meniscus"), "{table}");
    assert!(said.contains("warning: capillarity: under a curved meniscus"), "{said}");
    let picture = std::fs::read_to_string(path("tank.svg")).unwrap();
    assert!(picture.contains("surface tension 0.072 N/m"));
    assert!(picture.contains(&format!("1: {:.3} Hz", omega / core::f64::consts::TAU)), "{picture}");

    shape("sphere = { radius = 0.1 }");
    let (table, _) = run(&["--fill=0.1"]);
    assert!(table.contains("f of mode 1 is not known"), "{table}");
    assert_eq!(row(&table)[1], "-");
    let (json, _) = run(&["--fill=0.1", "--json"]);
    let data: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(data["capillarity"]["modes"][0]["omega"].is_null(), "{json}");
}

//! Misuse of the packed FMU: a hostile host that makes any calls with any arguments, thousands of instances at the same
//! time, repeated loading and unloading, and random bytes in saved states and values.
//!
//! The hosts are C programs with FMI's official headers. They load the binary that users get, and each is compiled for
//! FMI 2.0 and for FMI 3.0 (`fmi.h`). Tests with many values divide the values between the versions, because calls of
//! both versions lead to the same instance; `abuse_tests_run_in_both_versions_of_fmi` tries all values with each
//! version. `.ci/valgrind` runs the tests under valgrind and sets `HUBSLOSH_VALGRIND`. The tests make few random
//! inputs, because `.ci/fuzz` tries a thousand and more calls, clocks, saved states and values on each FMU.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

use crate::common::{python, run};
use host::description::{ModelDescription, Type, Variable};
use host::xml::Element;
use pack::{Fmi, HUBSLOSH, packed_version_for_tests, root};
use runtime::table::Layout;

const VERSIONS: [Fmi; 2] = [Fmi::V2, Fmi::V3];

struct Unpacked {
    fmi: Fmi,
    directory: tempfile::TempDir,
    library: PathBuf,
    description: ModelDescription,
    states: usize,
    indicators: usize,
}

impl Unpacked {
    fn new(model: &pack::Model, fmi: Fmi) -> Unpacked {
        let directory = tempfile::tempdir().unwrap();
        let packed = packed_version_for_tests(model, fmi);
        let file = std::fs::File::open(packed).unwrap();
        zip::ZipArchive::new(file).unwrap().extract(directory.path()).unwrap();
        let binaries = directory.path().join("binaries");
        let folder = std::fs::read_dir(binaries).unwrap().next().unwrap().unwrap().path();
        let library = folder.join(model.name).with_extension("so");
        let file = std::fs::read(directory.path().join("modelDescription.xml")).unwrap();
        let root = Element::parse(&file).unwrap();
        let of_the_type =
            |v: &Element| v.child("Real").is_some_and(|r| r.get("derivative").is_some());
        let derivative = |v: &&Element| of_the_type(v) || v.get("derivative").is_some();
        let states = root.list("ModelVariables").filter(derivative).count();
        let indicators = match fmi {
            Fmi::V2 => root.get("numberOfEventIndicators").map_or(0, |n| n.parse().unwrap()),
            Fmi::V3 | Fmi::V3Arrays => {
                root.list("ModelStructure").filter(|e| e.name == "EventIndicator").count()
            }
        };
        let description = ModelDescription::from_fmu(packed).unwrap();
        Unpacked { fmi, directory, library, description, states, indicators }
    }

    fn guid(&self) -> &str {
        &self.description.guid
    }

    fn variable(&self, name: &str) -> &Variable {
        self.description.variable(name).unwrap()
    }

    fn reference(&self, name: &str) -> String {
        self.variable(name).reference.to_string()
    }

    fn host(&self, name: &str, sources: &[&str], link: &[&Path]) -> Command {
        let program = self.directory.path().join(name);
        let sources = sources.iter().map(|source| root().join(source));
        let version = if self.fmi == Fmi::V2 { 2 } else { 3 };
        // valgrind has its own allocator instead of the one that counts allocations.
        let counts = (!under_valgrind()).then_some("-DCOUNT_ALLOCATIONS");
        if !program.exists() {
            run(
                Command::new("cc")
                    .args(["-std=c11", "-O1", "-g", "-Wall", "-Wextra", "-Werror"])
                    .arg(format!("-DFMI={version}"))
                    .arg(format!("-DSTATES={}", self.states))
                    .arg(format!("-DINDICATORS={}", self.indicators))
                    .arg(format!("-DSTEPS={STEPS}"))
                    .args(counts)
                    .arg("-I")
                    .arg(headers())
                    .args(sources)
                    .args(link)
                    .args(["-ldl", "-lm", "-pthread", "-o"])
                    .arg(&program),
                "the host did not compile",
            );
        }
        if !under_valgrind() {
            return Command::new(program);
        }
        let mut valgrind = Command::new("valgrind");
        valgrind
            .args(["--quiet", "--leak-check=full", "--show-leak-kinds=all"])
            .args(["--errors-for-leak-kinds=all", "--error-exitcode=9"])
            .arg(program);
        valgrind
    }
}

fn letter(variable: &Variable) -> char {
    match variable.kind() {
        Type::Real => 'R',
        Type::Boolean => 'B',
        Type::Enumeration => 'E',
        _ => 'I',
    }
}

#[derive(Clone, Copy)]
struct Share {
    of: &'static str,
    /// Arguments of the C program `life.c`: the number of instances that exist at the same time, and the number of times the
    /// library is loaded.
    lives: [&'static str; 2],
    pairs: usize,
}

const PART: Share = Share { of: "part", lives: ["1000", "300"], pairs: 50 };
const ALL: Share = Share { of: "all", lives: ["5000", "1500"], pairs: 5000 };

fn under_valgrind() -> bool {
    std::env::var_os("HUBSLOSH_VALGRIND").is_some()
}

/// Returns the folder with the official headers fmi2Functions.h and fmi3Functions.h, which FMPy contains.
fn headers() -> &'static Path {
    static HEADERS: LazyLock<PathBuf> = LazyLock::new(|| {
        let script = "import importlib.util; print(importlib.util.find_spec('fmpy').origin)";
        let sentence = "fmpy does not say where it is";
        let origin =
            PathBuf::from(run(Command::new(python()).args(["-c", script]), sentence).trim());
        origin.with_file_name("c-code")
    });
    &HEADERS
}

fn number(said: &str, word: &str) -> f64 {
    let before = said.split(word).next().unwrap().trim_end();
    before.rsplit(' ').next().unwrap().parse().unwrap_or_else(|_| panic!("no {word} in: {said}"))
}

/// Steps thousands of instances in turns; each must have the same results as when it runs alone. Loads the library hundreds
/// of times; after it is unloaded it must no longer be mapped. Saves and restores states, handles events in Model Exchange,
/// and checks that steps allocate no memory.
fn a_whole_life(fmi: Fmi, share: Share) {
    let fmu = Unpacked::new(HUBSLOSH, fmi);
    let [instances, loads] = match std::env::var("HUBSLOSH_VALGRIND").as_deref() {
        Ok("all") => ALL.lives,
        Err(_) => share.lives,
        Ok(_) => ["200", "20"],
    };
    let mut names = vec!["omega", "omega_dot", "tau_cmd", "slosh.model", "init.omega"];
    if fmi == Fmi::V3 {
        names.push("event_indicator[1]");
    }
    let said = run(
        fmu.host("life", &["tests/abi/life.c"], &[])
            .arg(&fmu.library)
            .args([fmu.guid(), instances, loads])
            .args(names.iter().map(|name| fmu.reference(name))),
        "a host in C met something that it must not",
    );
    print!("{said}");
    if !under_valgrind() {
        // An instance has some 10 KiB. If each of the 270 counted loads left one instance behind, the memory would grow
        // by 2.6 MiB. Fluctuations of malloc are far smaller.
        assert!(number(&said, " KiB") < 1024.0, "{said}");
    }
    assert_eq!(number(&said, " more descriptors"), 0.0, "{said}");
}

#[test]
fn a_c_host_survives_every_wrong_call_and_no_memory_is_leaked() {
    for fmi in VERSIONS {
        a_whole_life(fmi, PART);
    }
}

/// Tests in which mode each function is allowed, with the C program `modes.c`. `names` are an output, a variable that depends
/// directly on an input, this input, an Integer, an enumeration and a Boolean.
fn check_functions_in_every_mode(model: &pack::Model, names: [&str; 6], sets: bool) {
    let fmu = Unpacked::new(model, Fmi::V3);
    run(
        fmu.host("modes", &["tests/abi/modes.c"], &[])
            .arg(&fmu.library)
            .arg(fmu.guid())
            .args(names.map(|name| fmu.reference(name)))
            .arg(u8::from(sets).to_string()),
        "a function answers otherwise than the standard's tables have it",
    );
}

#[test]
fn every_function_of_fmi_3_is_allowed_or_refused_in_words_in_every_mode() {
    for (model, names, sets) in [
        (
            "HubSlosh",
            ["omega", "omega_dot", "tau_cmd", "slosh.modes", "slosh.model", "wheel.enabled"],
            true,
        ),
        (
            "Spacecraft",
            ["omega[1]", "omega_dot[1]", "torque[1]", "tanks", "mount", "tank[1].in_range"],
            false,
        ),
        (
            "SloshTank",
            ["force[1]", "force[1]", "a[1]", "tank.modes", "coupling", "tank.in_range"],
            false,
        ),
    ] {
        check_functions_in_every_mode(pack::model(model).unwrap(), names, sets);
    }
}

/// Makes random calls, or the calls of the fuzzer's corpus in the folder `HUBSLOSH_CORPUS`, in both versions of FMI. The C
/// program `host.c` lists the faults that it finds, for example floating-point exceptions in calls that succeed.
fn check_random_calls<M: runtime::Model>(inputs: u32) {
    let name = M::table().about.model;
    let fmu = Unpacked::new(pack::model(name).unwrap(), Fmi::V2);
    let sources =
        ["host.c", "calls2.c", "calls3.c", "replay.c"].map(|name| format!("fmu/fuzz/{name}"));
    let sources: Vec<&str> = sources.iter().map(String::as_str).collect();
    let folder = fmu.library.parent().unwrap();
    let path = format!("-Wl,-rpath,{}", folder.display());
    for (layout, share) in [(Layout::Scalars, 1), (Layout::Arrays, 6)] {
        let mut host = fmu.host("replay", &sources, &[&fmu.library, Path::new(&path)]);
        host.args([M::table().guid(), M::table().token(layout)])
            .args(hubslosh_fuzz::sizes::<M>(layout).map(|n| n.to_string()));
        // Under valgrind the program is much slower. Otherwise no call may take longer than 10 s.
        host.arg(if under_valgrind() { "1000" } else { "10" });
        match std::env::var_os("HUBSLOSH_CORPUS") {
            Some(corpus) => {
                for input in std::fs::read_dir(corpus).expect("HUBSLOSH_CORPUS is not a folder") {
                    host.arg(input.unwrap().path());
                }
            }
            None => {
                let inputs = if under_valgrind() { 400 } else { inputs } / share;
                host.args(["--noise", &inputs.to_string(), "1"]);
            }
        }
        let said = run(&mut host, "the hostile host broke the FMU, or the FMU broke its promise");
        print!("{name}, {layout:?}: {said}");
        // If the FMU had accepted only few of the random calls, the test would prove nothing.
        assert!(number(&said, " accepted") > 0.1 * number(&said, " calls"), "{said}");
    }
}

#[test]
fn no_sequence_of_calls_breaks_the_packed_binary_of_hubslosh() {
    check_random_calls::<HubSlosh::HubSlosh>(3000);
}

#[test]
fn no_sequence_of_calls_breaks_the_packed_binary_of_spacecraft() {
    check_random_calls::<Spacecraft::Model>(600);
}

#[test]
fn no_sequence_of_calls_breaks_the_packed_binary_of_sloshtank() {
    check_random_calls::<SloshTank::Model>(600);
}

/// Runs HubSlosh in a host that traps division by zero, invalid operations and overflow, as hosts do to find the first NaN.
/// No slosh model, friction law or gyro may cause one of these exceptions in either interface.
#[cfg(target_os = "linux")]
fn check_that_no_model_traps(fmi: Fmi, share: Share) {
    if under_valgrind() {
        return; // valgrind does not support such traps
    }
    let fmu = Unpacked::new(HUBSLOSH, fmi);
    let items = |name: &str| fmu.description.items(fmu.variable(name)).len().to_string();
    let names = [
        "slosh.model",
        "friction.model",
        "slosh.modes",
        "imu.enabled",
        "wheel.enabled",
        "imu.lsb",
        "init.omega",
        "init.slosh_angle",
        "tank.r",
        "friction.c",
        "friction.d",
        "friction.b",
        "friction.sigma0",
        "tau_cmd",
        "g_axial",
    ];
    let reals = fmu.description.variables.iter().filter(|v| v.kind() == Type::Real);
    let said = run(
        fmu.host("traps", &["tests/abi/traps.c"], &[])
            .arg(&fmu.library)
            .args([fmu.guid(), &fmu.states.to_string(), &fmu.indicators.to_string()])
            .args([items("slosh.model"), items("friction.model")])
            .arg(share.of)
            .args(names.map(|name| format!("{name}={}", fmu.reference(name))))
            .arg("--")
            .args(reals.map(|v| v.reference.to_string())),
        "a floating-point exception was raised",
    );
    print!("{said}");
    // The runs are combinations of at least 5 slosh models, 4 friction laws, 3 gyros, 8 scenes and 2 interfaces.
    let runs = if share.of == "all" { 960.0 } else { 480.0 };
    assert!(number(&said, " runs") >= runs, "{said}");
    // LuGre refuses the only scene without dry friction.
    assert!(number(&said, " refused") <= 0.03 * number(&said, " runs"), "{said}");
}

/// The host traps division by zero, invalid operations and overflow, as hosts do to find the first NaN.
#[cfg(target_os = "linux")]
#[test]
fn no_model_raises_a_floating_point_exception() {
    for fmi in VERSIONS {
        check_that_no_model_traps(fmi, PART);
    }
}

/// Returns the input file for the C program `ranges.c`: each variable with its allowed values, and the scenes, which are sets
/// of start values.
fn ranges(description: &ModelDescription, scenes: &[Vec<(&str, &str)>]) -> String {
    let number = |text: &str| match text {
        "true" => "1".to_string(),
        "false" => "0".to_string(),
        _ => text.to_string(),
    };
    let mut lines = Vec::new();
    for v in &description.variables {
        let causality = match v.causality.as_str() {
            // An input without intermediate update has no slope in FMI 3.0, and is set like a parameter.
            "input" if description.is_fmi3() && !v.intermediate => 'p',
            "parameter" => 'p',
            "input" => 'i',
            _ => '-',
        };
        let [min, max] = match v.kind() {
            Type::Real => [f64::MIN, f64::MAX].map(|x| format!("{x:?}")),
            Type::Boolean => [0, 1].map(|n| n.to_string()),
            Type::Enumeration => [1, description.items(v).len()].map(|n| n.to_string()),
            _ => [i32::MIN, i32::MAX].map(|n| n.to_string()),
        };
        let of = v.attributes();
        let min = of.min.clone().unwrap_or(min);
        let max = of.max.clone().unwrap_or(max);
        let start = number(of.start.as_deref().unwrap_or("0"));
        let (reference, name) = (v.reference, &v.name);
        lines.push(format!("v {causality} {} {reference} {min} {start} {max} {name}", letter(v)));
    }
    for (n, scene) in scenes.iter().enumerate() {
        for (name, value) in scene {
            let v = description.variable(name).unwrap();
            lines.push(format!("s {n} {} {} {}", letter(v), v.reference, number(value)));
        }
    }
    lines.join("\n") + "\n"
}

/// In every scene, sets every parameter and input to its smallest and largest value, and random pairs of values, in a host
/// that traps floating-point exceptions, in both interfaces. Also sets each Real to NaN and to infinity. The scenes limit the
/// internal steps of the integrator, because the test is about numbers and not about run time.
#[cfg(target_os = "linux")]
fn check_that_no_allowed_value_traps(model: &str, fmi: Fmi, share: Share) {
    if under_valgrind() {
        return; // valgrind does not support such traps
    }
    let fmu = Unpacked::new(pack::model(model).unwrap(), fmi);
    let path = fmu.directory.path().join("ranges.txt");
    let scenes = scenes(model);
    std::fs::write(&path, ranges(&fmu.description, &scenes)).unwrap();
    let said = run(
        fmu.host("ranges", &["tests/abi/ranges.c"], &[])
            .arg(&fmu.library)
            .args([fmu.guid(), &fmu.states.to_string(), &fmu.indicators.to_string()])
            .arg(&path)
            .args([&share.pairs.to_string(), "7", share.of]),
        "an allowed value raised a floating-point exception, or one that is none was accepted",
    );
    print!("{model}, {fmi:?}: {said}");
    let settable = fmu.description.variables.iter();
    let settable = settable.filter(|v| ["parameter", "input"].contains(&v.causality.as_str()));
    let (settable, version) = (settable.count(), if fmi == Fmi::V2 { 2 } else { 3 });
    let settings = match share.of {
        // Each variable is set to its min, start and max in each scene.
        "all" => 3 * settable * scenes.len(),
        // Each version sets the min or the max of each variable in one scene, and its start value in each scene.
        _ => {
            let ends = |scene: usize| (0..2 * settable).map(move |k| scene + k / 2 + k % 2);
            let is_set = |place: &usize| place % (scenes.len() + 1) == version % 2;
            (0..scenes.len()).flat_map(ends).filter(is_set).count() + scenes.len()
        }
    };
    let expected = 2 * (settings + share.pairs);
    assert_eq!(number(&said, " runs"), expected as f64, "{said}");
    assert!(number(&said, " with no number") > 0.0, "{said}");
    // A model may refuse contradicting values. If it refused more runs than this, the test would prove less.
    assert!(number(&said, " refused") <= 0.5 * number(&said, " runs"), "{said}");
}

#[cfg(target_os = "linux")]
fn scenes(model: &str) -> Vec<Vec<(&'static str, &'static str)>> {
    let few = ("solver.max_steps", "300");
    match model {
        "HubSlosh" => vec![
            vec![few],
            vec![
                few,
                ("slosh.model", "4"),
                ("slosh.modes", "10"),
                ("friction.model", "5"),
                ("wheel.enabled", "true"),
                ("imu.enabled", "true"),
                ("imu.lsb", "1e-4"),
                ("slosh.capillarity", "true"),
                ("init.omega", "0.3"),
                ("init.slosh_angle", "0.2"),
                ("init.slosh_angle_radial", "0.1"),
                ("tau_cmd", "0.01"),
            ],
            vec![
                few,
                ("slosh.model", "3"),
                ("slosh.source", "2"),
                ("slosh.modes", "2"),
                ("slosh.table.m_liq", "2"),
                ("slosh.table.mass[1]", "0.8"),
                ("slosh.table.mass[2]", "0.05"),
                ("slosh.table.length[1]", "0.05"),
                ("slosh.table.frequency[2]", "4"),
                ("slosh.table.zeta[1]", "0.01"),
                ("baffle.width", "0.01"),
                ("baffle.depth", "0.02"),
                ("init.omega", "0.1"),
                ("friction.model", "3"),
            ],
            vec![
                few,
                ("slosh.model", "5"),
                ("slosh.modes", "2"),
                ("baffle.width", "0.01"),
                ("baffle.depth", "0.02"),
                ("bench.tilt", "0.02"),
                ("hub.imbalance", "0.1"),
                ("init.slosh_angle", "0.1"),
            ],
            vec![
                few,
                ("slosh.model", "5"),
                ("slosh.modes", "3"),
                ("init.slosh_angle", "0.1"),
                ("init.omega", "0.2"),
                ("friction.asymmetry", "0.1"),
            ],
        ],
        // The four tanks are one with constant liquid, one that is given by its dimensions, one that drains, and one that is
        // given by its frequency.
        "Spacecraft" => {
            let four_tanks = vec![
                few,
                ("tanks", "4"),
                ("init.omega[1]", "0.1"),
                ("init.omega[3]", "0.2"),
                ("tank[1].modes", "3"),
                ("tank[2].modes", "3"),
                ("tank[3].modes", "3"),
                ("tank[4].modes", "3"),
                ("tank[2].diameter", "0.9"),
                ("tank[2].position[1]", "1"),
                ("tank[3].fill.points", "8"),
                ("tank[3].position[1]", "-1"),
                ("mass_flow[3]", "0.1"),
                ("tank[4].frequency[1]", "0.5"),
                ("tank[4].k[1]", "1"),
                ("tank[1].p_dot_0[1,1]", "0.1"),
                ("force[1]", "10"),
            ];
            let on_a_pivot = [&four_tanks[..], &[("mount", "2")]].concat();
            let planar = vec![
                few,
                ("tank[1].modes", "3"),
                ("tank[1].direction[1,1]", "1"),
                ("tank[1].direction[2,2]", "1"),
                ("tank[1].arm[2]", "0.2"),
                ("tank[1].r_0[1]", "-0.01"),
                ("tank[1].I_xz", "0.3"),
                ("tank[1].p_dot_0[1,1]", "0.1"),
                ("force[1]", "10"),
            ];
            // The tables of tanks, points and modes that are not used contain zeros.
            let unused_tanks = vec![
                few,
                ("tank[2].fill.points", "6"),
                ("tank[2].fill.length[1,3]", "0"),
                ("tank[2].fill.length[1,4]", "0"),
                ("tank[2].fill.liquid[2]", "0"),
                ("tank[3].diameter", "0.9"),
                ("tank[3].modes", "3"),
                ("tank[4].fill.points", "1"),
                ("tank[4].frequency[1]", "0.5"),
                ("tank[4].direction[1,1]", "1"),
            ];
            let unused_points = vec![
                few,
                ("tank[1].fill.points", "5"),
                ("tank[1].liquid_0", "200"),
                ("tank[1].fill.liquid[7]", "0"),
                ("tank[1].fill.length[1,8]", "0"),
                ("tank[1].fill.length[2,3]", "0"),
                ("tank[1].fill.mass[2,3]", "0"),
                ("mass_flow[1]", "0.1"),
                ("force[3]", "500"),
            ];
            let with_a_ball = vec![
                few,
                ("tank[1].ball.travel", "0.6"),
                ("tank[1].modes", "3"),
                ("force[1]", "118"),
                ("force[3]", "-1180"),
            ];
            vec![
                vec![few, ("init.omega[1]", "0.02"), ("init.omega[3]", "0.1")],
                four_tanks,
                on_a_pivot,
                planar,
                unused_tanks,
                unused_points,
                with_a_ball,
            ]
        }
        "SloshTank" => vec![
            vec![few, ("a[1]", "0.1"), ("a[3]", "9.81")],
            vec![
                few,
                ("tank.modes", "3"),
                ("tank.diameter", "0.9"),
                ("a[1]", "1"),
                ("a[3]", "9.81"),
                ("omega[1]", "0.2"),
                ("host.mass", "1000"),
                ("coupling", "3"),
                ("tank.p_dot_0[1,1]", "0.1"),
            ],
            vec![
                few,
                ("tank.modes", "3"),
                ("tank.fill.points", "8"),
                ("mass_flow", "0.1"),
                ("a[3]", "1"),
                ("omega[3]", "0.2"),
            ],
            vec![
                few,
                ("tank.fill.points", "5"),
                ("a[1]", "0.1"),
                ("a[3]", "9.81"),
                ("tank.liquid_0", "200"),
                ("tank.fill.liquid[7]", "0"),
                ("tank.fill.length[1,8]", "0"),
                ("tank.fill.length[2,3]", "0"),
                ("tank.fill.mass[2,3]", "0"),
                ("mass_flow", "0.1"),
            ],
            vec![
                few,
                ("tank.ball.travel", "0.6"),
                ("host.mass", "1000"),
                ("a[1]", "0.1"),
                ("a[3]", "-1"),
            ],
        ],
        _ => panic!("nobody has said what to set in {model}"),
    }
}

#[cfg(target_os = "linux")]
#[test]
fn no_allowed_value_of_hubslosh_raises_a_floating_point_exception() {
    for fmi in VERSIONS {
        check_that_no_allowed_value_traps("HubSlosh", fmi, PART);
    }
}

/// The long form of the test for SloshTank, which has the same equations and runs in `cargo test`.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "half a minute: .ci/long-tests"]
fn no_allowed_value_of_spacecraft_raises_a_floating_point_exception() {
    for fmi in VERSIONS {
        check_that_no_allowed_value_traps("Spacecraft", fmi, PART);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn no_allowed_value_of_sloshtank_raises_a_floating_point_exception() {
    for fmi in VERSIONS {
        check_that_no_allowed_value_traps("SloshTank", fmi, PART);
    }
}

/// Runs all tests of this file in both versions of FMI, whereas `cargo test` runs each of them in one version. This takes
/// minutes, so that the test is ignored by default.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "minutes: .ci/run --nightly"]
fn abuse_tests_run_in_both_versions_of_fmi() {
    std::thread::scope(|scope| {
        for fmi in VERSIONS {
            for model in &pack::MODELS {
                scope.spawn(move || check_that_no_allowed_value_traps(model.name, fmi, ALL));
            }
            scope.spawn(move || {
                a_whole_life(fmi, ALL);
                check_that_no_model_traps(fmi, ALL);
            });
        }
    });
}

/// Passes a handle of HubSlosh, and other wrong handles, to the functions of all other FMUs (C program `handles.c`).
#[cfg(target_os = "linux")]
#[test]
#[ignore = "three seconds: .ci/long-tests"]
fn handles_of_other_libraries_or_versions_and_freed_or_random_handles_are_errors() {
    if under_valgrind() {
        return; // valgrind would report that the mark of a freed instance is read
    }
    for fmi in VERSIONS {
        let all: Vec<Unpacked> =
            pack::MODELS.iter().map(|model| Unpacked::new(model, fmi)).collect();
        for (i, fmu) in all.iter().enumerate() {
            let copy = fmu.directory.path().join("copy.so");
            std::fs::copy(&fmu.library, &copy).unwrap();
            let others = all.iter().enumerate().filter(|(k, _)| *k != i).map(|(_, o)| &o.library);
            let output = fmu.description.variables.iter().find(|v| v.kind() == Type::Real).unwrap();
            let said = run(
                fmu.host("handles", &["tests/abi/handles.c"], &[])
                    .arg(&fmu.library)
                    .args([fmu.guid(), &output.reference.to_string()])
                    .args(others)
                    .arg(&copy),
                "a handle that is not the function's own was not refused",
            );
            assert!(said.contains("is an error"), "{said}");
        }
    }
}

/// Largest stack that an FMU may need, kB: first to instantiate and initialise it, then for steps. The page on real time of
/// the book states these numbers. They are a quarter above the measured values, because these depend on the compiler.
#[cfg(target_os = "linux")]
const STACK: [(&str, [u32; 2]); 3] =
    [("HubSlosh", [64, 23]), ("Spacecraft", [156, 112]), ("SloshTank", [122, 66])];

/// The page book/real_time.md states the largest stack of each FMU. The stack is measured in several runs and in both
/// versions of FMI.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn an_fmu_needs_at_most_the_stack_that_the_book_states() {
    if under_valgrind() {
        return; // valgrind uses another stack
    }
    let page = std::fs::read_to_string(root().join("book/real_time.md")).unwrap();
    for (name, limits) in STACK {
        let row = format!("| {name} | {} | {} |", limits[0], limits[1]);
        assert!(page.contains(&row), "book/real_time.md has no row {row}");
        for fmi in VERSIONS {
            let fmu = Unpacked::new(pack::model(name).unwrap(), fmi);
            for scene in scenes(name) {
                let settings = scene.iter().map(|(name, value)| {
                    let v = fmu.variable(name);
                    let value = if *value == "true" { "1" } else { value };
                    format!("{}:{}={value}", letter(v), v.reference)
                });
                let settings: Vec<String> = settings.collect();
                let reals = fmu.description.variables.iter().filter(|v| v.kind() == Type::Real);
                let reals: Vec<String> = reals.map(|v| v.reference.to_string()).collect();
                for interface in ["co-simulation", "model-exchange"] {
                    let said = run(
                        fmu.host("stack", &["tests/abi/stack.c"], &[])
                            .arg(&fmu.library)
                            .args([fmu.guid(), interface, &fmu.states.to_string()])
                            .args(&settings)
                            .arg("--")
                            .args(&reals),
                        "the stack could not be measured",
                    );
                    println!("{name}, {fmi:?}, {interface}, {scene:?}: {said}");
                    for (what, limit) in [" bytes to start", " bytes to step"].iter().zip(limits) {
                        let bytes = number(&said, what);
                        assert!(
                            bytes <= 1000.0 * f64::from(limit),
                            "{name}: {bytes}{what}, more than {limit} kB"
                        );
                    }
                }
            }
        }
    }
}

const STEPS: usize = 250;

type Settings<'a> = &'a [(&'a str, &'a str)];

/// Simulates a motion of `model` with `settings` in both versions of FMI, and compares all Reals at ten instants within 5 s.
/// Both versions must give the same bits, also in a host that replaces subnormal numbers by 0; a host with another rounding
/// mode of the processor may get other last digits.
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
fn check_that_rounding_changes_only_last_digits(model: &str, settings: Settings) {
    if under_valgrind() {
        return; // valgrind always rounds to nearest and keeps subnormal numbers
    }
    let two = Unpacked::new(pack::model(model).unwrap(), Fmi::V2);
    let three = Unpacked::new(pack::model(model).unwrap(), Fmi::V3);
    let is_motion = |v: &&Variable| {
        v.kind() == Type::Real && ["output", "local"].contains(&v.causality.as_str())
    };
    let names: Vec<&str> =
        two.description.variables.iter().filter(is_motion).map(|v| v.name.as_str()).collect();
    let motion = |fmu: &Unpacked, mode: &str| -> Vec<f64> {
        let settings = settings.iter().map(|(name, value)| {
            let v = fmu.variable(name);
            let value = if *value == "true" { "1" } else { value };
            format!("{}:{}={value}", letter(v), v.reference)
        });
        let said = run(
            fmu.host("rounding", &["tests/abi/rounding.c"], &[])
                .arg(&fmu.library)
                .args([fmu.guid(), mode])
                .args(settings)
                .arg("--")
                .args(names.iter().map(|name| fmu.reference(name))),
            "a host with another rounding mode met an error",
        );
        said.lines().map(|line| f64::from_bits(u64::from_str_radix(line, 16).unwrap())).collect()
    };
    let bits = |motion: Vec<f64>| -> Vec<u64> { motion.into_iter().map(f64::to_bits).collect() };
    let nearest = motion(&two, "nearest");
    assert_eq!(nearest.len(), 10 * names.len());
    let expected = bits(nearest.clone());
    assert_eq!(bits(motion(&three, "nearest")), expected, "{model}: FMI 3.0 and 2.0");
    let peak =
        |i: usize| nearest.iter().skip(i).step_by(names.len()).fold(0.0, |p, x| x.abs().max(p));
    for fmu in [&two, &three] {
        let what = format!("{model}, FMI {}", fmu.description.fmi_version);
        assert_eq!(motion(fmu, "flush"), nearest, "{what}: subnormal numbers taken for 0");
        for mode in ["up", "down", "zero"] {
            let other = motion(fmu, mode);
            assert_ne!(other, nearest, "{what}: the mode is in effect");
            for (i, (x, y)) in nearest.iter().zip(&other).enumerate() {
                // Some 1e5 operations, each with an error of up to 2e-16 of the same sign, cause 2e-11; 1e-12 is observed.
                let allowed = 1e-10 * f64::max(peak(i % names.len()), f64::MIN_POSITIVE);
                assert!(
                    (x - y).abs() <= allowed,
                    "{what}, {mode}, {}: {x} {y}",
                    names[i % names.len()]
                );
            }
        }
    }
}

/// Some hosts set another rounding mode of the processor, or let it replace subnormal numbers by 0.
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
#[test]
fn a_hosts_rounding_mode_changes_only_last_digits_and_flushing_subnormal_numbers_changes_nothing() {
    check_that_rounding_changes_only_last_digits(
        "HubSlosh",
        &[
            ("slosh.model", "4"),
            ("slosh.modes", "3"),
            ("init.omega", "0.3"),
            ("init.slosh_angle", "0.2"),
            ("init.slosh_angle_radial", "0.1"),
            ("imu.enabled", "true"),
            ("tau_cmd", "0.002"),
        ],
    );
    check_that_rounding_changes_only_last_digits(
        "Spacecraft",
        &[
            ("tanks", "2"),
            ("tank[1].modes", "3"),
            ("tank[2].fill.points", "8"),
            ("tank[2].position[1]", "1"),
            ("mass_flow[2]", "0.1"),
            ("init.omega[1]", "0.1"),
            ("init.omega[3]", "0.2"),
            ("tank[1].p_dot_0[1,1]", "0.5"),
            ("force[3]", "100"),
        ],
    );
}

fn noise(rng: &mut fastrand::Rng, longest: usize) -> Vec<u8> {
    let length = rng.usize(..longest);
    std::iter::repeat_with(|| rng.u8(..)).take(length).collect()
}

fn states<M: runtime::Model>() {
    let mut rng = fastrand::Rng::with_seed(1);
    for _ in 0..60 {
        hubslosh_fuzz::states::run::<M>(&noise(&mut rng, 60));
    }
}

#[test]
fn damaged_saved_states_are_refused_or_give_a_valid_instance() {
    states::<HubSlosh::HubSlosh>();
    states::<Spacecraft::Model>();
    states::<SloshTank::Model>();
}

fn values<M: runtime::Model>(runs: usize) {
    let mut rng = fastrand::Rng::with_seed(2);
    for _ in 0..runs {
        hubslosh_fuzz::values::run::<M>(&noise(&mut rng, 800));
    }
}

/// Random bytes determine which variables are set to which values, and the lengths of the steps.
#[test]
fn random_values_of_variables_give_finite_results_or_an_error() {
    values::<HubSlosh::HubSlosh>(200);
    // Stiff models use all steps that the integrator may make: half a second each.
    values::<Spacecraft::Model>(8);
    values::<SloshTank::Model>(8);
}

/// Runs sequences of calls by hosts whose times have different rounding errors (`fmu/fuzz/src/clocks.rs`). `sequences` are
/// the numbers of sequences for the three FMUs.
fn clocks(sequences: [usize; 3]) {
    fn play<M: runtime::Model>(sequences: usize) {
        let mut rng = fastrand::Rng::with_seed(3);
        for _ in 0..sequences {
            hubslosh_fuzz::clocks::run::<M>(&noise(&mut rng, 400));
        }
    }
    std::thread::scope(|all| {
        all.spawn(|| play::<HubSlosh::HubSlosh>(sequences[0]));
        all.spawn(|| play::<Spacecraft::Model>(sequences[1]));
        all.spawn(|| play::<SloshTank::Model>(sequences[2]));
    });
}

/// Hosts add up their communication steps or multiply them, so that their times have other rounding errors than the FMU's
/// time.
#[test]
fn hosts_whose_times_have_rounding_errors_get_the_same_outputs() {
    clocks([20, 2, 4]);
}

#[test]
#[ignore = "minutes: .ci/run --nightly"]
fn hosts_with_other_clocks_get_the_same_outputs_in_a_hundred_thousand_sequences() {
    clocks([34_000, 33_000, 33_000]);
}

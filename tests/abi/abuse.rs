//! Abuse of the packed FMU: a hostile host that calls anything with anything, thousands of
//! instances at once, loading and unloading; noise in saved states and in values.
//!
//! The hosts are C programs with the FMI's official headers, linked with the binary that users
//! get. `.ci/valgrind` runs them under valgrind (it sets `HUBSLOSH_VALGRIND`), `.ci/fuzz` looks
//! for bad bytes for as long as one likes.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{python, run};
use host::fmi2::{Fmu, PLATFORM};
use host::xml::Element;
use pack::{HUBSLOSH, packed_model_for_tests, root};

/// The unpacked binary, and what the C hosts need to know of the FMU.
struct Unpacked {
    directory: tempfile::TempDir,
    library: PathBuf,
    fmu: Fmu,
}

impl Unpacked {
    fn new(model: &pack::Model) -> Unpacked {
        let directory = tempfile::tempdir().unwrap();
        let packed = packed_model_for_tests(model);
        let file = std::fs::File::open(packed).unwrap();
        zip::ZipArchive::new(file).unwrap().extract(directory.path()).unwrap();
        let folder = directory.path().join("binaries").join(PLATFORM);
        let library = folder.join(model.name).with_extension("so");
        Unpacked { directory, library, fmu: Fmu::open(packed).unwrap() }
    }

    fn guid(&self) -> &str {
        &self.fmu.description().guid
    }

    fn reference(&self, name: &str) -> String {
        self.fmu.description().variable(name).unwrap().reference.to_string()
    }

    /// Compiles a host from C and gives the command that runs it.
    fn host(&self, name: &str, sources: &[&str], link: &[&Path]) -> Command {
        let program = self.directory.path().join(name);
        let sources = sources.iter().map(|source| root().join(source));
        run(
            Command::new("cc")
                .args(["-std=c11", "-O1", "-g", "-Wall", "-Wextra", "-Werror"])
                .arg(format!("-DSTATES={}", plant::STATES))
                .arg(format!("-DINDICATORS={}", plant::INDICATORS))
                .arg("-I")
                .arg(headers())
                .args(sources)
                .args(link)
                .args(["-ldl", "-lm", "-o"])
                .arg(&program),
            "the host did not compile",
        );
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

fn under_valgrind() -> bool {
    std::env::var_os("HUBSLOSH_VALGRIND").is_some()
}

/// Where fmi2Functions.h is: fmpy has the official headers among its files.
fn headers() -> PathBuf {
    let script = "import fmpy, pathlib; print(pathlib.Path(fmpy.__file__).parent / 'c-code')";
    let sentence = "fmpy does not say where it is";
    PathBuf::from(run(Command::new(python()).args(["-c", script]), sentence).trim())
}

/// The number before `word` in what a host says at its end.
fn number(said: &str, word: &str) -> f64 {
    let before = said.split(word).next().unwrap().trim_end();
    before.rsplit(' ').next().unwrap().parse().unwrap_or_else(|_| panic!("no {word} in: {said}"))
}

/// 5,000 at once step in turns with the bits each has alone; 1,500 times the library is loaded
/// and is gone after unloading; a state goes there and back; Model Exchange through its events.
#[test]
fn a_c_host_lives_through_everything_and_nothing_is_left_behind() {
    let fmu = Unpacked::new(HUBSLOSH);
    let (instances, loads) = match std::env::var("HUBSLOSH_VALGRIND").as_deref() {
        Ok("all") | Err(_) => ("5000", "1500"),
        Ok(_) => ("200", "20"),
    };
    let references = ["omega", "omega_dot", "tau_cmd", "slosh.model", "init.omega"];
    let said = run(
        fmu.host("life", &["tests/abi/life.c"], &[])
            .arg(&fmu.library)
            .args([fmu.guid(), instances, loads])
            .args(references.map(|name| fmu.reference(name))),
        "a host in C met something that it must not",
    );
    print!("{said}");
    if !under_valgrind() {
        // An instance has some 10 KiB: one left behind by each of the 1,350 loads that count would
        // be 13 MiB. malloc's own coming and going is far below one.
        assert!(number(&said, " KiB") < 1024.0, "{said}");
    }
    assert_eq!(number(&said, " more descriptors"), 0.0, "{said}");
}

/// Noise, or the fuzzer's corpus in the folder `HUBSLOSH_CORPUS`, as calls; among what must not
/// happen (`host.c`) are floating-point exceptions in calls that succeed.
fn no_calls_break<M: runtime::Model>(inputs: u32) {
    let name = M::table().about.model;
    let fmu = Unpacked::new(pack::model(name).unwrap());
    let sources = ["fmu/fuzz/host.c", "fmu/fuzz/replay.c"];
    let folder = fmu.library.parent().unwrap();
    let path = format!("-Wl,-rpath,{}", folder.display());
    let mut host = fmu.host("replay", &sources, &[&fmu.library, Path::new(&path)]);
    host.arg(fmu.guid()).args(hubslosh_fuzz::sizes::<M>().map(|n| n.to_string()));
    // Under valgrind time passes otherwise; without, no call may take longer than 10 s.
    host.arg(if under_valgrind() { "1000" } else { "10" });
    match std::env::var_os("HUBSLOSH_CORPUS") {
        Some(corpus) => {
            for input in std::fs::read_dir(corpus).expect("HUBSLOSH_CORPUS is no folder") {
                host.arg(input.unwrap().path());
            }
        }
        None => {
            let inputs = if under_valgrind() { 300 } else { inputs };
            host.args(["--noise", &inputs.to_string(), "1"]);
        }
    }
    let said = run(&mut host, "the hostile host broke the FMU, or the FMU broke its promise");
    print!("{name}: {said}");
    // Noise that reaches nothing would prove nothing.
    assert!(number(&said, " accepted") > 0.1 * number(&said, " calls"), "{said}");
}

#[test]
fn no_calls_break_the_packed_binary_of_hubslosh() {
    no_calls_break::<HubSlosh::HubSlosh>(100_000);
}

#[test]
fn no_calls_break_the_packed_binary_of_spacecraft() {
    no_calls_break::<Spacecraft::Model>(2000);
}

#[test]
fn no_calls_break_the_packed_binary_of_sloshtank() {
    no_calls_break::<SloshTank::Model>(2000);
}

/// A host that traps division by zero, invalid operations and overflow, as those do that look for the
/// first NaN: none of them comes from any slosh model, friction law or gyro, in either interface.
#[cfg(target_os = "linux")]
#[test]
fn no_model_raises_a_floating_point_exception() {
    if under_valgrind() {
        return; // which has no such traps
    }
    let fmu = Unpacked::new(HUBSLOSH);
    let file = std::fs::read(fmu.directory.path().join("modelDescription.xml")).unwrap();
    let root = Element::parse(&file).unwrap();
    let variables: Vec<&Element> = root.list("ModelVariables").collect();
    let reals = |v: &&&Element| v.child("Real").is_some();
    let states = variables.iter().filter_map(|v| v.child("Real")?.get("derivative")).count();
    let items = |name: &str| {
        let description = fmu.fmu.description();
        description.items(description.variable(name).unwrap()).len().to_string()
    };
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
    let said = run(
        fmu.host("traps", &["tests/abi/traps.c"], &[])
            .arg(&fmu.library)
            .args([fmu.guid(), &states.to_string(), root.get("numberOfEventIndicators").unwrap()])
            .args([items("slosh.model"), items("friction.model")])
            .args(names.map(|name| format!("{name}={}", fmu.reference(name))))
            .arg("--")
            .args(variables.iter().filter(reals).filter_map(|v| v.get("valueReference"))),
        "a floating-point exception was raised",
    );
    print!("{said}");
    // 5 slosh models, 4 friction laws, 3 gyros, 8 scenes, 2 interfaces at the least
    assert!(number(&said, " runs") >= 960.0, "{said}");
    // LuGre refuses the one scene without dry friction
    assert!(number(&said, " refused") <= 0.03 * number(&said, " runs"), "{said}");
}

fn noise(rng: &mut fastrand::Rng, longest: usize) -> Vec<u8> {
    let length = rng.usize(..longest);
    std::iter::repeat_with(|| rng.u8(..)).take(length).collect()
}

fn states<M: runtime::Model>() {
    let mut rng = fastrand::Rng::with_seed(1);
    for _ in 0..1000 {
        hubslosh_fuzz::states::run::<M>(&noise(&mut rng, 60));
    }
}

#[test]
fn noise_in_saved_states_is_refused_or_gives_an_instance_like_any_other() {
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

#[test]
fn any_values_end_in_numbers_or_in_an_error() {
    values::<HubSlosh::HubSlosh>(1000);
    // Stiff ones use up the integrator's steps: half a second each.
    values::<Spacecraft::Model>(50);
    values::<SloshTank::Model>(50);
}

//! What several tests share.

use std::path::PathBuf;
use std::process::{Command, Output};

use HubSlosh::table::TABLE;
use plant::{FrictionModel, Parameters, SloshModel};
use runtime::variable::Kind;

/// Every slosh model.
pub const SLOSH: [SloshModel; SloshModel::ALL.len()] = SloshModel::ALL;

/// Whether the model ends at a rim, which a violent motion reaches.
pub fn has_rim(slosh: SloshModel) -> bool {
    matches!(slosh, SloshModel::Paraboloid | SloshModel::Liquid)
}

/// Every friction law.
pub const FRICTION: [FrictionModel; FrictionModel::ALL.len()] = FrictionModel::ALL;

/// The numbers of the items of an enumeration, by the name of a variable.
///
/// # Panics
/// If there is no such variable, or if it is not an enumeration.
pub fn items(name: &str) -> std::ops::RangeInclusive<i32> {
    let variable = TABLE.variables.iter().find(|v| v.name == name);
    match variable.map(|v| v.kind) {
        Some(Kind::Enumeration(of)) => 1..=of.items.len() as i32,
        _ => panic!("{name} is not an enumeration"),
    }
}

/// The bench with the given models.
pub fn bench(slosh: SloshModel, friction: FrictionModel) -> Parameters {
    let mut p = Parameters::default();
    p.slosh.model = slosh;
    p.friction.model = friction;
    p
}

/// A plant somewhere in the allowed range: sizes from a toy to a launcher's stage,
/// any fill, one to ten modes, any damping and friction, a start in motion.
pub fn anywhere(rng: &mut fastrand::Rng, slosh: SloshModel, friction: FrictionModel) -> Parameters {
    let mut p = bench(slosh, friction);
    let mut between = |low: f64, high: f64| low + (high - low) * rng.f64();
    p.tank.d = 10f64.powf(between(-1.5, 0.5));
    p.tank.h = p.tank.d * 10f64.powf(between(-1.5, 0.5));
    if slosh == SloshModel::Liquid {
        // Neither shallow nor next to a secondary resonance, where it warns.
        p.tank.h = p.tank.d
            * if between(0.0, 1.0) < 0.5 { between(0.22, 0.37) } else { between(0.6, 3.0) };
    }
    p.tank.r = p.tank.d * between(0.0, 5.0);
    let m_liq = 1000.0 * 0.785 * p.tank.d * p.tank.d * p.tank.h;
    p.hub.inertia = m_liq * p.tank.d * p.tank.d * 10f64.powf(between(-1.0, 2.0));
    p.slosh.zeta_from_correlation = between(0.0, 1.0) < 0.5;
    p.slosh.zeta = between(0.0, 0.3);
    p.slosh.hardening = between(0.0, 2.0);
    let torque = p.hub.inertia * between(0.0, 1.0);
    p.friction.b = torque * between(0.0, 1.0);
    p.friction.c = torque * between(0.0, 0.1);
    p.friction.d = torque * between(0.0, 0.1);
    p.friction.omega_s = between(0.01, 0.5);
    p.friction.eps = 10f64.powf(between(-4.0, -1.0));
    // Bristles that deflect by 10 mrad, without damping of their own: passive with any friction.
    p.friction.sigma0 = 100.0 * (p.friction.c + p.friction.d);
    p.friction.sigma1 = 0.0;
    p.friction.asymmetry = between(-0.3, 0.3);
    p.friction.harmonics_forward = core::array::from_fn(|_| between(-0.15, 0.15));
    p.friction.harmonics_backward = core::array::from_fn(|_| between(-0.15, 0.15));
    p.init.omega = between(-0.5, 0.5);
    p.init.slosh_angle = between(-0.5, 0.5);
    p.init.slosh_angle_radial = between(-0.5, 0.5);
    p.init.slosh_rate = between(-2.0, 2.0);
    p.init.slosh_rate_radial = between(-2.0, 2.0);
    p.slosh.modes = rng.usize(1..=plant::MODES);
    p
}

/// The output of a command that must succeed.
///
/// # Panics
/// If it does not, with what it said and `sentence`.
pub fn run(command: &mut Command, sentence: &str) -> String {
    let why = match command.output() {
        Err(error) => error.to_string(),
        Ok(Output { status, stdout, stderr }) => {
            let out = String::from_utf8_lossy(&stdout).into_owned();
            if status.success() {
                return out;
            }
            out + &String::from_utf8_lossy(&stderr)
        }
    };
    panic!("{why}\n{sentence}\n(the command: {command:?})");
}

/// The interpreter of the tests' virtual environment, which is made if need be.
///
/// # Panics
/// If it can't be made.
pub fn python() -> PathBuf {
    let target =
        pack::packed_for_tests().ancestors().nth(2).expect("<target>/test-fmu/HubSlosh.fmu");
    let scripts = pack::root().join("harness").join("python");
    let first = if cfg!(windows) { "python" } else { "python3" };
    let path = run(
        Command::new(first)
            .arg(scripts.join("environment.py"))
            .arg(target.join("python").join("tests"))
            .arg(scripts.join("requirements.txt")),
        "the tests in Python need Python 3.11 or newer with its module venv, and the network once",
    );
    PathBuf::from(path.trim())
}

/// The binary `hubslosh`, of the profile that this test was built with; it is
/// another package's, so Cargo does not say where it is.
pub fn harness() -> PathBuf {
    binary("hubslosh", &[])
}

/// A binary of the workspace by its name, of the profile that this test was built with; `package`
/// says where it is if not in one of the default members.
///
/// # Panics
/// If it does not build.
pub fn binary(name: &str, package: &[&str]) -> PathBuf {
    let mut build = Command::new(env!("CARGO"));
    build.current_dir(pack::root()).args(["build", "--quiet", "--bin", name]).args(package);
    let profile = if cfg!(debug_assertions) { "debug" } else { "release" };
    if profile == "release" {
        build.arg("--release");
    }
    run(&mut build, "a binary of the workspace did not build");
    let target =
        pack::packed_for_tests().ancestors().nth(2).expect("<target>/test-fmu/HubSlosh.fmu");
    target.join(profile).join(name).with_extension(std::env::consts::EXE_EXTENSION)
}

//! Identification of an FMU with an adaptive solver and a coarse tolerance (`adaptive.c`): its errors jump from one parameter
//! value to the next.

use std::path::PathBuf;
use std::process::Command;

use analysis::random::Random;
use analysis::statistics::deviation;
use host::fmi2::PLATFORM;
use identify::any_fmu::foresee::foresee;
use identify::any_fmu::{Identification, identify};
use identify::input::question::{Question, Solver};
use identify::input::record::Record;
use identify::model::simulate::{Model, Setup};
use tempfile::TempDir;

const STEP: f64 = 0.05;
const ROWS: usize = 400;
/// Standard deviation of the noise in one row: of r, m, and of phi, rad.
const NOISE: [f64; 2] = [2e-3, 4e-3];
pub const TRUTH: [(&str, f64); 5] =
    [("k", 42.0), ("d", 0.1), ("c", 0.03), ("r", 1.3), ("phi", 0.4)];
const FREE: [&str; 5] = ["k=40:20:80", "d=0.05:0:1", "c=0.02:0:1", "r=1.25:1:2", "phi=0.35:-1:1"];

pub struct Adaptive {
    folder: TempDir,
}

impl Adaptive {
    pub fn new(definitions: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("adaptive.so");
        let done = Command::new("cc")
            .args(["-std=c11", "-O1", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"])
            .args(definitions)
            .arg("-o")
            .arg(&out)
            .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/adaptive.c"))
            .arg("-lm")
            .output()
            .expect("a C compiler is there");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let exchange = definitions.contains(&"-DMODEL_EXCHANGE");
        let files = [
            ("modelDescription.xml".into(), xml(exchange).into_bytes()),
            (format!("binaries/{PLATFORM}/adaptive.so"), std::fs::read(&out).unwrap()),
        ];
        std::fs::write(folder.path().join("adaptive.fmu"), pack::archive::zipped(&files).unwrap())
            .unwrap();
        Adaptive { folder }
    }

    pub fn path(&self) -> PathBuf {
        self.folder.path().join("adaptive.fmu")
    }
}

fn xml(exchange: bool) -> String {
    let states = [("r", "1.2"), ("v", "0"), ("phi", "0.3"), ("w", "0")];
    let mut variables = String::new();
    for (k, (name, start)) in states.iter().enumerate() {
        let causality = if k % 2 == 0 { "output" } else { "local" };
        variables += &format!(
            "<ScalarVariable name=\"{name}\" valueReference=\"{k}\" causality=\"{causality}\" initial=\"exact\"><Real start=\"{start}\"/></ScalarVariable>\n"
        );
    }
    for (k, (name, _)) in states.iter().enumerate() {
        variables += &format!(
            "<ScalarVariable name=\"der({name})\" valueReference=\"{}\" causality=\"local\"><Real derivative=\"{}\"/></ScalarVariable>\n",
            k + 4,
            k + 1
        );
    }
    let parameters =
        [("m", "1"), ("k", "40"), ("d", "0"), ("L", "1"), ("c", "0.02"), ("unused", "1")];
    for (k, (name, start)) in parameters.iter().enumerate() {
        variables += &format!(
            "<ScalarVariable name=\"{name}\" valueReference=\"{}\" causality=\"parameter\" variability=\"fixed\"><Real start=\"{start}\"/></ScalarVariable>\n",
            k + 8
        );
    }
    variables += "<ScalarVariable name=\"a\" valueReference=\"14\" causality=\"input\"><Real start=\"0\"/></ScalarVariable>\n";
    let exchange =
        if exchange { "<ModelExchange modelIdentifier=\"adaptive\"/>" } else { Default::default() };
    format!(
        "<fmiModelDescription fmiVersion=\"2.0\" modelName=\"adaptive\" guid=\"a\" numberOfEventIndicators=\"0\">{exchange}\
         <CoSimulation modelIdentifier=\"adaptive\" canHandleVariableCommunicationStepSize=\"true\"/>\
         <ModelVariables>\n{variables}</ModelVariables><ModelStructure>\
         <Outputs><Unknown index=\"1\"/><Unknown index=\"3\"/></Outputs>\
         <Derivatives><Unknown index=\"5\"/><Unknown index=\"6\"/><Unknown index=\"7\"/><Unknown index=\"8\"/></Derivatives>\
         </ModelStructure></fmiModelDescription>"
    )
}

/// Returns the time derivatives of r, v, phi and w by the equations in `adaptive.c` with m = 1 and L = 1.
fn rates([r, v, phi, w]: [f64; 4], [k, d, c]: [f64; 3], a: f64) -> [f64; 4] {
    let g = 9.81;
    [
        v,
        r * w * w + g * phi.cos() - k * (r - 1.0) - d * v - a * phi.sin(),
        w,
        (-2.0 * v * w - g * phi.sin() - a * phi.cos()) / r - c * w,
    ]
}

/// Records a free swing from the true initial state, with noise of `scale` times [`NOISE`]. The Runge–Kutta method with 100 steps
/// a row has an error below 1e-9.
pub fn record(seed: u64, scale: f64) -> Record {
    let noise = NOISE.map(|noise| scale * noise);
    let [k, d, c, r, phi] = TRUTH.map(|(_, value)| value);
    let (mut x, mut random) = ([r, 0.0, phi, 0.0], Random::new(seed, 0));
    let mut record = Record { outputs: vec![Vec::new(); 2], ..Record::default() };
    for row in 0..ROWS {
        record.time.push(STEP * row as f64);
        record.outputs[0].push(x[0] + noise[0] * random.normal());
        record.outputs[1].push(x[2] + noise[1] * random.normal());
        for _ in 0..100 {
            let h = STEP / 100.0;
            let rate = |x| rates(x, [k, d, c], 0.0);
            let moved = |f: [f64; 4], s: f64| [0, 1, 2, 3].map(|i| x[i] + s * h * f[i]);
            let f1 = rate(x);
            let f2 = rate(moved(f1, 0.5));
            let f3 = rate(moved(f2, 0.5));
            let f4 = rate(moved(f3, 1.0));
            x = [0, 1, 2, 3].map(|i| x[i] + h / 6.0 * (f1[i] + 2.0 * (f2[i] + f3[i]) + f4[i]));
        }
    }
    record
}

pub fn question(solver: Solver) -> Question {
    Question {
        free: FREE.iter().map(|text| text.parse().unwrap()).collect(),
        priors: Vec::new(),
        tolerances: Vec::new(),
        settings: Vec::new(),
        inputs: Vec::new(),
        held: Vec::new(),
        outputs: vec!["r".into(), "phi".into()],
        sensors: Vec::new(),
        biases: Vec::new(),
        triads: Vec::new(),
        drift: false,
        tolerance: None,
        solver,
        starts: 2,
    }
}

fn found(fmu: &Adaptive, question: &Question, seed: u64, scale: f64) -> Identification {
    let model = Model::open(&fmu.path(), question.solver).unwrap();
    identify(&model, question, &[record(seed, scale)], &mut |_| {}).unwrap()
}

/// Returns the number of 95 % intervals that contain the true value, and the number of all intervals.
fn held(found: &Identification) -> (usize, usize) {
    let given = TRUTH.iter().filter(|(name, _)| found.parameters[*name].determined);
    let holds = |(name, truth): &&(&str, f64)| {
        let [low, high] = found.parameters[*name].interval;
        low <= *truth && *truth <= high
    };
    (given.clone().filter(holds).count(), given.count())
}

/// Checks the result of a fit whose estimates depend on the solver's errors: no verdict that the model fits, no interval, and
/// advice for smaller errors.
fn check_refusal(found: &Identification, remedy: &str) {
    assert_ne!(found.fits, Some(true), "{:?}", found.verdict);
    let decided = &found.details.decided_by_solver;
    assert!(!decided.is_empty(), "{:?}", found.verdict);
    let json: serde_json::Value = serde_json::from_str(&found.json().unwrap()).unwrap();
    for name in decided {
        let e = &json["parameters"][name];
        assert!(e["value"].is_f64() && e["std"].is_null(), "{e}");
        assert_eq!(
            (&e["determined"], &e["interval"][0]),
            (&false.into(), &serde_json::Value::Null)
        );
    }
    assert_eq!(json["decided_by_solver"].as_array().unwrap().len(), decided.len());
    assert!(json["fits"] != true);
    let words = found.verdict.join("\n");
    assert!(words.contains("No interval is given for") && words.contains(remedy), "{words}");
    assert!(!words.contains("The model fits"), "{words}");
}

/// The fit once took differences so small that the solver's noise dominated them, and did not compare the solver with a more
/// accurate one. In the three cases of this test the true values were then up to 50,000, 20 and 17 standard deviations from the
/// estimates, although the verdict was that the model fits.
#[test]
fn no_interval_is_given_if_solver_errors_exceed_the_noise() {
    for (definitions, scale) in [
        (&["-DTOLERANCE=1e-3", "-DROUGH"][..], 1.0),
        (&["-DTOLERANCE=1e-4"], 0.1),
        (&["-DTOLERANCE=1e-3", "-DDEAF"], 1.0),
    ] {
        let fmu = Adaptive::new(&[definitions, &["-DMODEL_EXCHANGE"]].concat());
        check_refusal(&found(&fmu, &question(Solver::Own), 1, scale), "--solver host");
    }
    let fmu = Adaptive::new(&["-DTOLERANCE=1e-3", "-DROUGH"]);
    check_refusal(&found(&fmu, &question(Solver::Own), 1, 1.0), "--solver own:");
    let fmu = Adaptive::new(&["-DTOLERANCE=1e-3", "-DROUGH", "-DDEAF"]);
    check_refusal(&found(&fmu, &question(Solver::Own), 1, 1.0), "ignores the tolerance");
}

/// The FMU ignores the tolerance of the solver, so that a simulation with a smaller tolerance shows no difference.
#[test]
fn identify_fmu_states_if_the_size_of_solver_errors_cannot_be_determined() {
    let fmu = Adaptive::new(&["-DTOLERANCE=1e-6", "-DDEAF"]);
    let found = found(&fmu, &question(Solver::Own), 1, 1.0);
    assert_eq!(found.fits, Some(true));
    let said = "The size of the solver's errors is not known";
    assert!(found.verdict.iter().any(|line| line.starts_with(said)), "{:?}", found.verdict);
}

/// At a tolerance of 1e-3 the errors of the FMU's solver exceed the noise. With 1e-5 the 95 % intervals contain the true values.
#[test]
#[ignore = "ten seconds of CPU time: .ci/long-tests"]
fn a_finer_solver_tolerance_gives_intervals_that_contain_the_true_values() {
    let fmu = Adaptive::new(&["-DTOLERANCE=1e-3", "-DMODEL_EXCHANGE"]);
    let fine = Question { tolerance: Some(1e-5), ..question(Solver::Own) };
    let mut all = (0, 0);
    for seed in 1..=20 {
        let found = found(&fmu, &fine, seed, 1.0);
        assert!(found.fits == Some(true) && found.converged, "{seed}: {:?}", found.verdict);
        let (inside, given) = held(&found);
        all = (all.0 + inside, all.1 + given);
    }
    // 95 of 100 intervals should contain the true value; fewer than 89 would have a probability of 0.4 %
    assert!(all.1 == 100 && all.0 >= 89, "{all:?}");
}

#[test]
fn a_finer_tolerance_and_the_hosts_solver_give_the_same_estimates() {
    let fmu = Adaptive::new(&["-DTOLERANCE=1e-3", "-DMODEL_EXCHANGE"]);
    let fine = Question { tolerance: Some(1e-5), ..question(Solver::Own) };
    let (own, host) =
        (found(&fmu, &fine, 1, 1.0), found(&fmu, &question(Solver::Host(1e-8)), 1, 1.0));
    for (name, e) in &host.parameters {
        // the intervals do not include effects of the solver's errors below 0.05 standard deviations, and all
        // effects are below 0.3
        assert!((own.parameters[name].value - e.value).abs() < 0.3 * e.std, "{name}");
    }
}

/// `design --free` gives NaN for the standard deviation of unknowns whose derivative is dominated by errors of the FMU's solver.
#[test]
fn predicted_standard_deviations_are_nan_if_solver_errors_dominate_the_derivatives() {
    let fmu = Adaptive::new(&["-DTOLERANCE=1e-3", "-DROUGH", "-DMODEL_EXCHANGE"]);
    let at_truth = TRUTH.map(|(name, value)| format!("{name}={value}").parse().unwrap()).to_vec();
    let question = |solver| Question { free: at_truth.clone(), ..question(solver) };
    let bounds = |solver| {
        let model = Model::open(&fmu.path(), solver).unwrap();
        foresee(&model, &question(solver), &[record(1, 1.0)], &NOISE, &mut |_| {}).unwrap()
    };
    for bound in bounds(Solver::Own).iter().filter(|bound| ["k", "d"].contains(&&*bound.name)) {
        assert!(bound.decided_by_solver && bound.std.is_nan(), "{bound:?}");
    }
    let stated = found(&fmu, &question(Solver::Host(1e-8)), 1, 1.0);
    for bound in bounds(Solver::Host(1e-8)) {
        // the fit estimates the noise with a relative error of 1/√(2 · 800)
        let stated = stated.parameters[&bound.name].std;
        assert!((bound.std / stated - 1.0).abs() < 0.1, "{bound:?} {stated}");
    }
}

/// Model Exchange has no input derivatives, so that the host's solver simulated a spacecraft without the torque of its
/// wheels. The difference was once taken for an error of the spacecraft's own solver, so that no interval was given for
/// a flight with wheels.
#[test]
fn the_wheel_torque_of_a_spacecraft_is_not_taken_for_a_solver_error() {
    for fmi in [pack::Fmi::V2, pack::Fmi::V3] {
        wheels(pack::packed_version_for_tests(&pack::MODELS[1], fmi));
    }
}

fn wheels(fmu: &std::path::Path) {
    let model = Model::open(fmu, Solver::Own).unwrap();
    let time: Vec<f64> = (0..200).map(|row| 0.1 * f64::from(row)).collect();
    // angular momentum that oscillates, N.m.s
    let momentum = time.iter().map(|t| 5.0 * (1.0 - (0.5 * t).cos())).collect();
    let record = Record {
        outputs: vec![vec![0.0; time.len()]],
        inputs: vec![momentum],
        time,
        ..Record::default()
    };
    let question = Question {
        free: vec!["craft.Jzz=640:200:2500".parse().unwrap()],
        inputs: vec!["h_wheels[3]".into()],
        outputs: vec!["omega[3]".into()],
        ..question(Solver::Own)
    };
    let setup = Setup::new(&question, model.description()).unwrap();
    assert!(model.offers_exchange() && !setup.can_exchange(&model), "{}", fmu.display());
    let bounds = foresee(&model, &question, &[record], &[1e-5], &mut |_| {}).unwrap();
    assert!(!bounds[0].decided_by_solver && bounds[0].std > 0.0, "{bounds:?}");
}

fn with_free(free: &[&str], solver: Solver) -> Question {
    Question { free: free.iter().map(|text| text.parse().unwrap()).collect(), ..question(solver) }
}

/// The equations contain stiffness k, damping d and mass m only in the ratios k/m and d/m, so that these three cannot be
/// separated. The parameter c can be determined.
#[test]
fn inseparable_parameters_are_named_together_in_the_verdict_and_in_json() {
    let fmu = Adaptive::new(&["-DTOLERANCE=1e-7", "-DMODEL_EXCHANGE"]);
    let free = ["k=42:20:80", "m=1:0.5:2", "d=0.1:0:1", "c=0.03:0:1", "r=1.3:1:2", "phi=0.4:-1:1"];
    for solver in [Solver::Own, Solver::Host(1e-8)] {
        let question = with_free(&free, solver);
        let result = found(&fmu, &question, 1, 1.0);
        let json: serde_json::Value = serde_json::from_str(&result.json().unwrap()).unwrap();
        for (name, e) in &result.parameters {
            let is_lost = ["k", "m", "d"].contains(&name.as_str());
            assert_eq!(result.details.not_determined.contains(name), is_lost, "{name} {e:?}");
            assert_eq!(json["parameters"][name]["determined"], !is_lost, "{name} {e:?}");
            assert_eq!(json["parameters"][name]["std"].is_null(), is_lost, "{name} {e:?}");
        }
        let direction = &result.details.cannot_tell_apart[0].direction;
        let relative = |name: &str| direction[name] / result.parameters[name].value;
        // the direction is an eigenvector of finite-difference derivatives, accurate to about 1e-3 because d has little
        // effect on the outputs
        assert!((relative("k") / relative("m") - 1.0).abs() < 1e-3, "{direction:?}");
        assert!((relative("d") / relative("m") - 1.0).abs() < 0.05, "{direction:?}");
        let said = result.verdict.iter().any(|l| l.starts_with("d, k, m cannot be distinguished"));
        assert!(said, "{:?}", result.verdict);
        let model = Model::open(&fmu.path(), solver).unwrap();
        for bound in foresee(&model, &question, &[record(1, 1.0)], &NOISE, &mut |_| {}).unwrap() {
            let is_lost = ["k", "m", "d"].contains(&bound.name.as_str());
            assert_eq!((bound.std.is_nan(), bound.inseparable_from.len() == 2), (is_lost, is_lost));
        }
    }
}

/// The matrices of these fits are empty or singular. No fit may panic.
#[test]
fn fits_with_empty_or_singular_matrices_do_not_panic() {
    let fmu = Adaptive::new(&["-DTOLERANCE=1e-5", "-DMODEL_EXCHANGE"]);
    let one_row =
        Record { time: vec![0.0], outputs: vec![vec![1.0], vec![0.0]], ..Record::default() };
    for solver in [Solver::Own, Solver::Host(1e-6)] {
        let model = Model::open(&fmu.path(), solver).unwrap();
        for free in [
            &["k=40:20:80"][..],
            &["k=30:20:35"],
            &["k=30:20:35", "r=1.05:1:1.1"],
            &["unused=1:0:2"],
            &["unused=1"],
            &["unused=1", "k=40:20:80"],
        ] {
            let question = Question { starts: 1, ..with_free(free, solver) };
            let result = found(&fmu, &question, 1, 1.0);
            for (name, e) in &result.parameters {
                let is_lost = name == "unused";
                assert_eq!(e.determined && e.std.is_finite(), !is_lost, "{free:?} {name} {e:?}");
                assert_eq!(
                    result.details.not_determined.contains(name),
                    is_lost,
                    "{free:?} {name}"
                );
            }
            for records in [&[record(1, 1.0)][..], std::slice::from_ref(&one_row)] {
                let bounds = foresee(&model, &question, records, &NOISE, &mut |_| {}).unwrap();
                assert_eq!(bounds.len(), free.len());
            }
        }
        let question = with_free(&["k=40:20:80"], solver);
        for rows in [0, 1, 2, 9] {
            let full = record(1, 1.0);
            let cut = |column: &Vec<f64>| column[..rows].to_vec();
            let short = Record {
                time: cut(&full.time),
                outputs: full.outputs.iter().map(cut).collect(),
                ..Record::default()
            };
            let error = identify(&model, &question, &[short], &mut |_| {}).unwrap_err();
            assert!(format!("{error:#}").contains("allowed: at least"), "{error:#}");
        }
        let empty = Record { outputs: vec![Vec::new(); 2], ..Record::default() };
        assert!(foresee(&model, &question, &[empty], &NOISE, &mut |_| {}).is_err());
        assert!(foresee(&model, &question, &[], &NOISE, &mut |_| {}).is_err());
    }
}

/// The hinge is shaken at 1 Hz, and its motion is recorded in 8 rows per period. The FMU takes no input derivatives, so that the
/// input is held constant over short steps between rows.
#[test]
fn a_smooth_input_is_followed_by_an_fmu_that_cannot_interpolate() {
    let fmu = Adaptive::new(&["-DTOLERANCE=1e-7", "-DMODEL_EXCHANGE"]);
    let mut record = record(1, 1.0);
    let shaken = |t: &f64| 3.0 * (std::f64::consts::TAU * t).sin();
    record.time.iter_mut().for_each(|t| *t *= 2.5);
    record.time.truncate(160);
    record.outputs.iter_mut().for_each(|y| y.truncate(160));
    record.inputs = vec![record.time.iter().map(shaken).collect()];
    let run = |solver| {
        let question = Question { inputs: vec!["a".into()], ..question(solver) };
        let model = Model::open(&fmu.path(), solver).unwrap();
        let setup = Setup::new(&question, model.description()).unwrap();
        setup.run(&model, &[], 0, &record).unwrap()
    };
    let (own, host) = (run(Solver::Own), run(Solver::Host(1e-9)));
    let off: Vec<f64> = own[1].iter().zip(&host[1]).map(|(a, b)| a - b).collect();
    // an input that is held from the beginning of each row is late by 1/16 of a period, an error of 0.4 of its size; the sawtooth
    // of an eighth of its change per row has a mean of 0
    let (off, size) = (deviation(&off), deviation(&host[1]));
    assert!(off < 0.01 * size, "{off} {size}");
}

/// Identifies 20 simulated recordings for each tolerance of an adaptive solver and each size of the noise. At least 88 % of
/// the intervals have to contain the true value. Only this test is run by `cargo test --release -p identify --test all --
/// --ignored --nocapture coverage_with_adaptive_solvers`.
#[test]
#[ignore = "two minutes: .ci/run --nightly"]
fn coverage_with_adaptive_solvers_is_near_95_percent() {
    for rough in ["-DROUGH", "-DSTEADY"] {
        for deaf in ["-DDEAF", "-DHEEDS"] {
            for (tolerance, scale) in
                [1e-2, 1e-3, 1e-4, 1e-5, 1e-6].into_iter().flat_map(|t| [(t, 1.0), (t, 0.1)])
            {
                let fmu = Adaptive::new(&[
                    rough,
                    deaf,
                    &format!("-DTOLERANCE={tolerance:e}"),
                    "-DMODEL_EXCHANGE",
                ]);
                let (mut inside, mut given, mut judged) = (0, 0, 0);
                for seed in 1..=20 {
                    let found = found(&fmu, &question(Solver::Own), seed, scale);
                    if found.fits == Some(true) && found.converged {
                        let held = held(&found);
                        (inside, given, judged) = (inside + held.0, given + held.1, judged + 1);
                    }
                }
                println!(
                    "{rough} {deaf} tolerance {tolerance:e}, noise x {scale}: {judged} of 20 judged, {inside} of {given} \
                     intervals hold the truth"
                );
                // with an accurate tolerance of the solver, every fit gets a verdict
                assert!(tolerance > 1e-6 || judged == 20, "{judged}");
                // with 95 % intervals, fewer than 88 of 100 would contain the true value with a probability of 0.4 %
                assert!(f64::from(inside as u32) >= 0.88 * f64::from(given as u32));
            }
        }
    }
}

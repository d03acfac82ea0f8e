//! Coverage of the 95 % intervals for kinds of FMUs that other tools export, with a hundred simulated recordings (twins) of each
//! kind. The recordings do not come from the FMUs.

use std::path::Path;

use analysis::innovations::LIMIT;
use identify::any_fmu::{Identification, identify};
use identify::input::question::{Question, Solver};
use identify::model::simulate::Model;
use pack::{Fmi, HUBSLOSH, packed_for_tests, packed_version_for_tests};

use crate::any_fmu::{self, record_with_stops};
use crate::solver_noise::{self, Adaptive};

const TWINS: u64 = 100;
const DRY: f64 = 0.03;

#[derive(Default)]
struct Count {
    inside: usize,
    given: usize,
    refused: usize,
    worst: f64,
}

impl Count {
    fn add(&mut self, found: &Identification, truth: &[(&str, f64)]) {
        if found.fits != Some(true) || !found.converged {
            self.refused += 1;
            return;
        }
        for (name, truth) in truth {
            let e = &found.parameters[*name];
            self.given += 1;
            self.inside += usize::from((e.interval[0]..=e.interval[1]).contains(truth));
            self.worst = self.worst.max(((e.value - truth) / e.std).abs());
        }
    }

    /// Prints the counts, and checks that at least 93 % of the intervals contain the true value. If there are few intervals, the
    /// limit is 95 % minus two standard deviations of the fraction. No error may exceed [`LIMIT`] standard deviations.
    fn check(&self, kind: &str) {
        let part = self.inside as f64 / self.given.max(1) as f64;
        println!(
            "| {kind} | {} of {} | {:.1} % | {} | {:.1} |",
            self.inside,
            self.given,
            100.0 * part,
            self.refused,
            self.worst
        );
        let chance = 2.0 * (0.95 * 0.05 / self.given.max(1) as f64).sqrt();
        assert!(self.given == 0 || part > 0.95 - chance.max(0.02), "{kind}");
        assert!(self.worst < LIMIT, "{kind}");
    }
}

/// Prints a table; `cargo test --release -p identify --test all -- --ignored --nocapture coverage_of_a_hundred`
/// runs only this test.
#[test]
#[ignore = "minutes: .ci/run --nightly"]
fn coverage_of_a_hundred_twins_of_each_kind_is_near_95_percent() {
    println!("| kind | intervals that hold the truth | part | refused | largest error/σ |");
    println!("| --- | --- | --- | --- | --- |");
    let adaptive = Adaptive::new(&["-DTOLERANCE=1e-3", "-DMODEL_EXCHANGE"]);
    let path = adaptive.path();
    let own = solver_noise::question(Solver::Own);
    let fine = Question { tolerance: Some(1e-5), ..own.clone() };
    let host = solver_noise::question(Solver::Host(1e-8));
    for (kind, question) in [
        ("Co-Simulation 2.0, adaptive solver, 1e-3", own),
        ("the same, `--solver own:1e-5`", fine),
        ("Model Exchange 2.0", host),
    ] {
        let (mut count, model) = (Count::default(), Model::open(&path, question.solver).unwrap());
        for seed in 1..=TWINS {
            let records = [solver_noise::record(seed, 1.0)];
            let found = identify(&model, &question, &records, &mut |_| {}).unwrap();
            count.add(&found, &solver_noise::TRUTH);
        }
        count.check(kind);
    }
    let (inertia, b) = any_fmu::TRUTH;
    let three = packed_version_for_tests(HUBSLOSH, Fmi::V3);
    let smooth = any_fmu::question(&any_fmu::FREE);
    let truth = [("hub.I", inertia), ("friction.b", b), ("init.omega@1", 0.2)];
    let mut stops =
        any_fmu::question(&["hub.I=0.3:0.1:1", "friction.b=0.03:0:1", "friction.c=0.02:0:1"]);
    stops.settings =
        ["slosh.model=frozen", "fluid.rho=1e-6", "friction.model=stribeck", "friction.d=0"]
            .iter()
            .map(|text| text.parse().unwrap())
            .collect();
    stops.biases.clear();
    let dry = [("hub.I", inertia), ("friction.b", b), ("friction.c", DRY)];
    let of = |kind: &str, path: &Path, solver: Solver, has_stops: bool| {
        let (question, truth) = if has_stops { (&stops, &dry) } else { (&smooth, &truth) };
        let question = Question { solver, ..question.clone() };
        let (mut count, model) = (Count::default(), Model::open(path, solver).unwrap());
        for seed in 1..=TWINS {
            let record = match has_stops {
                true => record_with_stops(seed, DRY).0,
                false => any_fmu::record(seed, 0.2, 0.0),
            };
            count.add(&identify(&model, &question, &[record], &mut |_| {}).unwrap(), truth);
        }
        count.check(kind);
    };
    of("Model Exchange 3.0", three, Solver::Host(1e-8), false);
    of("events, Co-Simulation 3.0", three, Solver::Own, true);
    of("events, Model Exchange 3.0", three, Solver::Host(1e-8), true);
    of("events, Model Exchange 2.0", packed_for_tests(), Solver::Host(1e-8), true);
}

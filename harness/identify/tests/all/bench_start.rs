use analysis::linear::Linear;
use analysis::{BAND, logarithmic_grid};
use identify::bench::nominal::{Bench, Start};
use identify::bench::start::translate;

const BENCH: Bench = Bench { arm: 0.225, density: 1000.0, gravity: 9.81 };

#[test]
fn the_bench_follows_from_poles_and_zeros_of_its_exact_response() {
    let measured =
        Linear::bench_10_cm(0.002_975_7).frequency_response(&logarithmic_grid(BAND, 1200));
    let found = translate(&measured, BENCH).unwrap();
    // the value of the book's table of physics: 10 cm of water in a cylinder of 163 mm diameter
    assert!((found.slosh_frequency / 2.343_618_143_1 - 1.0).abs() < 1e-6, "{found:?}");
    assert!((found.slosh_mass / 0.756_293_271_9 - 1.0).abs() < 1e-4, "{found:?}");
    assert!((found.slosh_damping / 0.002_975_7 - 1.0).abs() < 1e-4, "{found:?}");
    let Start { d, h, .. } = found.start(BENCH, Start::default());
    assert!((d / 0.163 - 1.0).abs() < 1e-4 && (h / 0.1 - 1.0).abs() < 1e-3, "{d} {h}");
}

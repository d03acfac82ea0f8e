use analysis::demodulation::cycles;
use analysis::lengths::Lengths;
use analysis::sweep::{Law, Sweep};

#[test]
fn the_thesis_sweep_has_the_window_lengths_of_the_thesis() {
    for law in [Law::Exponential, Law::Linear] {
        let sweep = Sweep { law, ..Sweep::THESIS };
        let lengths = Lengths::for_record(sweep.band(), Some(&sweep), 2700.0, 0.02);
        let expected = Lengths { lag: 200.0, segment: 20.0, decimation: 1 };
        assert_eq!(lengths.lag, expected.lag);
        assert!((lengths.segment - 20.0).abs() < 1e-12 && lengths.decimation == 1);
        assert!([1.25, 2.4, 3.5].iter().all(|&f| cycles(&sweep, f) == 24.0));
    }
}

#[test]
fn a_slow_spacecraft_has_longer_windows_and_a_fast_sweep_fewer_cycles() {
    let slow = Sweep { f0: 0.01, f1: 0.3, duration: 40_000.0, ..Sweep::THESIS };
    let lengths = Lengths::for_record(slow.band(), Some(&slow), 40_000.0, 0.1);
    // lag: 200 s times sqrt(1.25 3.5)/sqrt(0.01 0.3); decimation: 10 Hz divided by 0.3 Hz is 33 samples per cycle
    assert!((lengths.lag - 7637.6).abs() < 0.1, "{lengths:?}");
    assert_eq!(lengths.decimation, 2);
    let fast = Sweep { duration: 2700.0, ..slow };
    assert_eq!(Lengths::for_record(fast.band(), Some(&fast), 2700.0, 0.1).lag, 1350.0);
    assert_eq!(cycles(&fast, 0.045), 3.0);
}

use std::f64::consts::TAU;

use analysis::sweep::{Law, Sweep};

const LAWS: [Law; 2] = [Law::Exponential, Law::Linear];

#[test]
fn sweeps_of_the_thesis_have_the_numbers_of_cycles_that_the_thesis_states() {
    // 5900.24 cycles (exponential) and 6412.5 cycles (linear) from 1.25 to 3.5 Hz in 2700 s, computed by
    // hand from the formulas
    for (law, cycles) in LAWS.into_iter().zip([5900.24, 6412.5]) {
        let sweep = Sweep { law, ..Sweep::THESIS };
        assert!((sweep.phase(2700.0) / TAU - cycles).abs() < 5e-3, "{law:?}");
        let t = sweep.time_at_frequency(2.4).unwrap();
        let f = (sweep.phase(t + 1e-3) - sweep.phase(t - 1e-3)) / 2e-3 / TAU;
        assert!((f - 2.4).abs() < 1e-7, "{law:?}: the frequency is the phase's derivative");
        assert!((sweep.frequency_at(t) - 2.4).abs() < 1e-12, "{law:?}");
    }
}

#[test]
fn a_downward_sweep_is_the_time_reversed_upward_sweep() {
    for law in LAWS {
        let sweep = |f0, f1| Sweep { f0, f1, duration: 100.0, law, ..Sweep::THESIS };
        let (up, down) = (sweep(1.25, 3.5), sweep(3.5, 1.25));
        assert_eq!(down.band(), (1.25, 3.5));
        for f in [1.25, 2.0, 3.5] {
            let (t_up, t_down) =
                (up.time_at_frequency(f).unwrap(), down.time_at_frequency(f).unwrap());
            // rounding errors of times up to 100 s and of phases up to 1500 rad
            assert!((t_up + t_down - 100.0).abs() < 1e-11, "{law:?}, {f} Hz");
            assert!((up.rate_at(f) + down.rate_at(f)).abs() < 1e-15);
            let behind = up.phase(100.0) - up.phase(t_up);
            assert!((down.phase(t_down) - behind).abs() < 1e-9, "{law:?}, {f} Hz");
        }
    }
}

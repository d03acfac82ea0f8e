use analysis::features::Features;
use analysis::logarithmic_grid;
use analysis::rational::Rational;
use analysis::sweep::Sweep;
use analysis::transfer_function::TransferFunction;
use std::f64::consts::TAU;

#[test]
fn a_short_record_still_separates_antiresonance_from_resonance() {
    // a craft of 800 kg m2, given as zeros and poles of its transfer function
    let tf = TransferFunction {
        numerator: [1.0 / 800.0, 2.0 * 0.004 * 0.2752 / 800.0, 0.2752 * 0.2752 / 800.0],
        real_pole: 1e-4,
        pole_omega: 0.2827,
        pole_damping: 0.0042,
    };
    let sweep = Sweep { f0: 0.01, f1: 0.3, duration: 900.0, ..Sweep::THESIS };
    let step = 0.2;
    let torque: Vec<f64> = (0..4500).map(|k| sweep.torque(f64::from(k) * step)).collect();
    let rate = tf.simulate(step, &torque);
    let band = (0.01, 0.3);
    let found = Rational::fit(step, &torque, &rate, band).unwrap();
    let features = Features::find(&found.frequency_response(&logarithmic_grid(band, 2000)));
    let (antiresonance, resonance) = (0.2752 / TAU, 0.2827 / TAU);
    // the separation of 1.1 mHz is hardly larger than the record's resolution; sampling causes an error
    // of a thousandth of the frequency
    assert!((features.f_dip.unwrap() / antiresonance - 1.0).abs() < 2e-3, "{features:?}");
    assert!((features.f_res.unwrap() / resonance - 1.0).abs() < 2e-3, "{features:?}");
    assert!(found.misfit < 0.2, "{}", found.misfit);
}

#[test]
fn independent_noise_as_input_and_output_does_not_fit_a_transfer_function() {
    let mut random = analysis::random::Random::new(7, 0);
    let mut noise = || (0..4000).map(|_| random.normal()).collect::<Vec<_>>();
    let (u, y) = (noise(), noise());
    let found = Rational::fit(0.1, &u, &y, (0.1, 2.0)).unwrap();
    assert!(found.misfit > 0.6, "{}", found.misfit);
}

use analysis::features::Features;
use analysis::linear::Linear;
use analysis::{BAND, logarithmic_grid};

#[test]
fn features_of_the_exact_transfer_function_are_the_reference_values() {
    // roots of d log|H|/df to 17 digits from an independent calculation (60-digit arithmetic);
    // 2000 points are 1.2 mHz apart, where the parabola misses by a few µHz
    for (plant, f_dip, f_res, notch) in [
        (Linear::bench_10_cm(0.0029757), 2.3431981, 2.4566022, 46.40),
        (Linear::bench_5_cm(0.0035842), 2.1329468, 2.2306922, 42.25),
    ] {
        let features = Features::find(&plant.frequency_response(&logarithmic_grid(BAND, 2000)));
        assert!((features.f_dip.unwrap() - f_dip).abs() < 2e-5, "{features:?}");
        assert!((features.f_res.unwrap() - f_res).abs() < 2e-5, "{features:?}");
        assert!((features.notch_db.unwrap() - notch).abs() < 0.02, "{features:?}");
    }
}

#[test]
fn a_deep_ripple_above_the_resonance_is_not_taken_for_the_antiresonance() {
    let mut response =
        Linear::bench_10_cm(0.0029757).frequency_response(&logarithmic_grid(BAND, 2000));
    let clean = Features::find(&response);
    for (f, h) in response.frequency.iter().zip(&mut response.response) {
        // a minimum that a beat causes, 60 mHz above the resonance and 5 dB lower than the antiresonance
        *h *= 1.0 - 0.994 * (-((f - 2.52) / 0.004_f64).powi(2)).exp();
    }
    let level = response.decibels();
    let deepest = (0..level.len()).min_by(|&a, &b| level[a].total_cmp(&level[b])).unwrap();
    assert!(response.frequency[deepest] > clean.f_res.unwrap());
    assert_eq!(Features::find(&response), clean);
}

#[test]
fn no_resonance_is_reported_if_the_band_contains_no_resonance() {
    let hub = Linear { inertia: 0.4, friction: 0.04, arm: 0.2, ..Linear::default() };
    let grid = logarithmic_grid(BAND, 2000);
    assert_eq!(Features::find(&hub.frequency_response(&grid)), Features::default());
    // a band that ends at 2.4 Hz contains the antiresonance, but not the resonance
    let early = logarithmic_grid((1.25, 2.4), 2000);
    let features = Features::find(&Linear::bench_10_cm(0.003).frequency_response(&early));
    assert!(features.f_dip.is_some() && features.f_res.is_none(), "{features:?}");
    assert_eq!((features.notch_db, features.delta_f()), (None, None));
}

#[test]
fn a_damped_resonance_is_found_though_the_response_at_the_band_edge_is_larger() {
    let plant = Linear::bench_10_cm(0.05);
    let response = plant.frequency_response(&logarithmic_grid(BAND, 2000));
    let features = Features::find(&response);
    let resonance = features.f_res.unwrap();
    assert!(response.response[0].norm() > plant.response(resonance).norm());
    assert!((resonance - 2.5308065).abs() < 1e-4, "{features:?}");
    assert!((features.f_dip.unwrap() - 2.2850539).abs() < 1e-4, "{features:?}");
}

use std::f64::consts::PI;

use identify::input::clocks::{completed, refined};

/// The gyro has a value in every third row and NaN in the others. The NaN values are interpolated, and the rows with
/// measured values are marked.
#[test]
fn readings_of_a_slow_gyro_are_interpolated_and_measured_rows_are_marked() {
    let time: Vec<f64> = (0..2000).map(|k| 0.02 * f64::from(k)).collect();
    let sine = |t: f64| (2.0 * PI * 2.0 * t).sin();
    let values = time.iter().enumerate().map(|(k, t)| if k % 3 == 1 { sine(*t) } else { f64::NAN });
    let (filled, there) = completed(&time, values.collect());
    let there = there.unwrap();
    assert_eq!(there.iter().filter(|there| **there).count(), 667);
    let worst = time.iter().zip(&filled).skip(10).take(1980).map(|(t, y)| (y - sine(*t)).abs());
    assert!(worst.fold(0.0, f64::max) < 0.02);
    assert_eq!(completed(&time, filled.clone()), (filled, None));
}

/// A torque sampled at 10 Hz that contains 1.3 and 3.6 Hz is interpolated to 50 Hz with an error below 1e-3.
#[test]
fn a_band_limited_torque_of_10_hz_is_interpolated_accurately_between_its_samples() {
    let sine = |t: f64| (2.0 * PI * 3.6 * t + 0.4).sin() + 0.5 * (2.0 * PI * 1.3 * t).cos();
    let time: Vec<f64> = (0..600).map(|k| 0.1 * f64::from(k)).collect();
    let (fine, found) = refined(&time, &time.iter().map(|t| sine(*t)).collect::<Vec<_>>());
    assert_eq!(fine.len(), 5 * 599 + 1);
    let off = fine.iter().zip(&found).map(|(t, y)| (t, (y - sine(*t)).abs()));
    // without the ends, where the kernel has samples on one side only
    let inner = off.filter(|(t, _)| (3.0..56.0).contains(*t));
    assert!(inner.map(|(_, off)| off).fold(0.0, f64::max) < 1e-3);
}

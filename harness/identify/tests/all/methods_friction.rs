use std::f64::consts::TAU;

use identify::input::recording::Recording;
use identify::methods::friction::brakings;

/// Simulates twelve decays in one direction from 6 rad/s, with viscous and dry friction and noise of the gyro. The dry
/// friction varies with the cosine of the angle by the fraction `cosine`.
fn decays(random: &mut analysis::random::Random, way: f64, cosine: f64) -> Vec<Recording> {
    (0..12)
        .map(|_| {
            let (h, mut time, mut torque) = (0.02, Vec::new(), Vec::new());
            let (mut rate, mut angle) = (Vec::new(), Vec::new());
            let (mut w, mut at) = (6.0, 10.0 * random.normal());
            while w > 0.5 {
                time.push(h * time.len() as f64);
                torque.push(if time.len() < 3 { 0.1 } else { 0.0 });
                rate.push(way * w + 2e-3 * random.normal());
                angle.push(at);
                for _ in 0..10 {
                    w -= 0.1 * h * (0.2 * w + 0.8 * (1.0 + cosine * f64::cos(at)));
                    at += 0.1 * h * way * w;
                }
            }
            Recording {
                name: String::new(),
                time,
                torque,
                rate,
                angle: Some(angle),
                gravity: None,
                wheel_speed: None,
                off_axis: [None, None],
                from_rest: false,
                fresh: None,
                angle_fresh: None,
                commanded: None,
            }
        })
        .collect()
}

/// Returns true if the difference between the friction in the two directions leaves its 95 % band at any angle.
fn differ(seed: u64, cosine: f64) -> bool {
    let mut random = analysis::random::Random::new(seed, 0);
    let all = [decays(&mut random, 1.0, cosine), decays(&mut random, -1.0, 0.0)].concat();
    let both = brakings(&all, &[0.0; 24]);
    let [ahead, back] = &both[..] else { panic!("{both:?}") };
    (0..90).map(|k| TAU * f64::from(k) / 90.0).any(|angle| {
        let half = ahead.half_width(angle).unwrap().hypot(back.half_width(angle).unwrap());
        (-ahead.at(angle) - back.at(angle)).abs() > half
    })
}

#[test]
fn friction_that_depends_on_angle_and_direction_is_distinguished_from_noise() {
    let of = |cosine: f64| (0..100).filter(|seed| differ(*seed, cosine)).count();
    // the 95 % band holds for the whole curve: on average 5 of 100 simulations leave it, and 12 are
    // three standard deviations more
    assert!(of(0.0) <= 12, "{}", of(0.0));
    assert!(of(0.1) >= 95, "{}", of(0.1));
}

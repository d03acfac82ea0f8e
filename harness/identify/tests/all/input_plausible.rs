use identify::input::plausible::columns;
use identify::input::recording::Recording;

fn wheel(limit: f64) -> Recording {
    let time: Vec<f64> = (0..20_000).map(|k| 0.01 * f64::from(k)).collect();
    let torque: Vec<f64> = time.iter().map(|t| 0.1 * (t * (8.0 + 0.02 * t)).sin()).collect();
    let mut speed = vec![167.0];
    for pair in torque.windows(2) {
        let mean = 0.5 * (pair[0].clamp(-limit, limit) + pair[1].clamp(-limit, limit));
        speed.push(speed[speed.len() - 1] - 0.01 * mean / 2.25e-3);
    }
    let rate = vec![0.0; time.len()];
    Recording { wheel_speed: Some(speed), ..Recording::of("a", time, torque, rate) }
}

/// In the first recording the wheel's acceleration times its inertia equals the commanded torque, and a note states the
/// inertia. In the second it equals 5 % of the torque, and a doubt says that the wheel did not give the torque.
#[test]
fn a_wheel_that_does_not_give_the_commanded_torque_is_reported() {
    let (notes, doubts) = columns(&wheel(1.0));
    assert!(notes[0].contains("wheel.I = 2.25") && doubts.is_empty(), "{notes:?} {doubts:?}");
    let (notes, doubts) = columns(&wheel(0.05));
    assert!(notes.is_empty() && doubts[0].contains("did not give the commanded torque"));
}

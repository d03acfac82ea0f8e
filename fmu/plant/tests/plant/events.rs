//! Events as a host that integrates itself meets them.

use super::common::bench;
use plant::{FrictionModel, Inputs, Plant, Ramp, STATES, SloshModel, indicator, x};

fn torque(value: f64) -> Inputs {
    Inputs { tau_cmd: Ramp::held(value), ..Inputs::default() }
}

/// At the limit itself the hub is still held; the event makes it turn, and then nothing is overdue.
#[test]
fn after_a_break_away_no_event_is_overdue() {
    let p = bench(SloshModel::Frozen, FrictionModel::Stribeck);
    let limit = p.friction.c + p.friction.d;
    for sign in [1.0, -1.0] {
        let mut plant = Plant::new(&p, &torque(0.0), 0.0, 1e-9).unwrap();
        assert!(!plant.is_event_overdue(&torque(sign * limit * (1.0 - 1e-9))), "held");
        assert!(plant.is_event_overdue(&torque(sign * limit * (1.0 + 1e-9))), "not held");
        let z = plant.event_indicators(&torque(sign * 0.4 * limit));
        let [with, against] = if sign > 0.0 {
            [indicator::BREAK_AWAY_FORWARD, indicator::BREAK_AWAY_BACKWARD]
        } else {
            [indicator::BREAK_AWAY_BACKWARD, indicator::BREAK_AWAY_FORWARD]
        };
        // What is left of the hold to either side.
        assert!((z[with] - 0.6 * limit).abs() < 1e-15 && (z[against] - 1.4 * limit).abs() < 1e-15);
        assert_eq!(z[indicator::REST], 1.0);
        plant.set_time(2.0);
        assert!(!plant.take_event(&torque(sign * limit)).unwrap(), "no state has changed");
        assert_eq!(plant.last_contact(), (1, 2.0, sign as i32));
        assert!(!plant.is_event_overdue(&torque(sign * limit)));
        // Turning: the rate in the direction of the contact.
        let mut states = [0.0; STATES];
        states[x::OMEGA] = sign * 0.25;
        plant.set_continuous_states(&states);
        let z = plant.event_indicators(&torque(sign * limit));
        assert_eq!([z[indicator::REST], z[with], z[against]], [0.25, 1.0, 1.0]);
        states[x::OMEGA] = -sign * 1e-9;
        plant.set_continuous_states(&states);
        assert!(plant.is_event_overdue(&torque(0.0)), "integrated past the stop");
        assert!(plant.take_event(&torque(0.0)).unwrap(), "put at rest");
        assert_eq!((plant.omega(), plant.last_contact().2), (0.0, 0));
    }
}

/// Without torque and bristles a LuGre hub at rest keeps the sense in which it has turned last; a torque
/// gives it another.
#[test]
fn a_lugre_hub_at_rest_turns_where_the_torque_goes() {
    let p = bench(SloshModel::Frozen, FrictionModel::Lugre);
    let mut plant = Plant::new(&p, &torque(0.0), 0.0, 1e-9).unwrap();
    let mut contact_under = |inputs: &Inputs, omega: f64| {
        let mut states = [0.0; STATES];
        states[x::OMEGA] = omega;
        plant.set_continuous_states(&states);
        plant.take_event(inputs).unwrap();
        plant.last_contact().2
    };
    assert_eq!(contact_under(&torque(0.0), -0.1), -1);
    assert_eq!(contact_under(&torque(0.0), 0.0), -1, "nothing moves it");
    assert_eq!(contact_under(&torque(1e-6), 0.0), 1);
    assert_eq!(contact_under(&torque(0.0), 0.0), 1, "nothing moves it");
    assert_eq!(contact_under(&torque(-1e-6), 0.0), -1);
}

/// Each indicator of the wheel is the distance to what it stands for.
#[test]
fn indicators_of_the_wheel_are_distances_to_its_limits() {
    let mut p = bench(SloshModel::Frozen, FrictionModel::Viscous);
    let none = Plant::new(&p, &torque(0.1), 0.0, 1e-9).unwrap().event_indicators(&torque(0.1));
    assert_eq!(none, [1.0; 8]);
    p.wheel.enabled = true;
    let mut plant = Plant::new(&p, &torque(0.1), 0.0, 1e-9).unwrap();
    let z = plant.event_indicators(&torque(0.1));
    assert_eq!(z[indicator::TORQUE_MAX], 0.26 - 0.1);
    assert_eq!(z[indicator::TORQUE_MIN], 0.26 + 0.1);
    assert_eq!(z[indicator::TORQUE_SIGN], 0.1);
    assert_eq!(z[indicator::SPEED_MAX], p.wheel.speed_max - p.wheel.speed_0);
    assert_eq!(z[indicator::SPEED_MIN], p.wheel.speed_0 - p.wheel.speed_min);
    // A host that has integrated past a limit is taken back to it.
    for (beyond, limit) in [
        (p.wheel.speed_max + 1e-6, p.wheel.speed_max),
        (p.wheel.speed_min - 1e-6, p.wheel.speed_min),
    ] {
        let mut states = *plant.continuous_states();
        states[x::WHEEL_SPEED] = beyond;
        plant.set_continuous_states(&states);
        assert!(plant.take_event(&torque(0.1)).unwrap());
        assert_eq!(plant.continuous_states()[x::WHEEL_SPEED], limit);
    }
}

/// Sample k is due at start + k/rate; an event up to a millionth of a period early takes it.
#[test]
fn the_gyros_samples_are_time_events() {
    let mut p = bench(SloshModel::Frozen, FrictionModel::Viscous);
    let inputs = torque(0.0);
    let next = |p: &plant::Parameters| Plant::new(p, &inputs, 3.0, 1e-9).unwrap().next_time_event();
    assert_eq!(next(&p), None);
    p.imu.enabled = true;
    assert_eq!(next(&p), Some(3.0 + 1.0 / 50.0), "the first is taken at the start");
    let mut plant = Plant::new(&p, &inputs, 3.0, 1e-9).unwrap();
    plant.set_time(3.0 + 0.02 * (1.0 - 2e-6));
    plant.take_event(&inputs).unwrap();
    assert_eq!(plant.next_time_event(), Some(3.02), "too early");
    plant.set_time(3.0 + 0.02 * (1.0 - 0.5e-6));
    plant.take_event(&inputs).unwrap();
    assert_eq!(plant.next_time_event(), Some(3.04));
    plant.set_time(3.09);
    plant.take_event(&inputs).unwrap();
    assert_eq!(plant.next_time_event(), Some(3.1), "all that are overdue");
}

/// Along each state alone, also one along which the outputs curve at once: a hundred times the direction
/// has a hundred times the derivative, and it is that of a small step.
#[test]
fn output_derivatives_are_linear_in_each_direction() {
    for slosh in SloshModel::ALL {
        let mut p = bench(slosh, FrictionModel::Viscous);
        (p.bench.tilt, p.bench.tilt_azimuth, p.hub.imbalance) = (0.3, 0.4, 0.5);
        p.init.omega = 0.3;
        (p.init.slosh_angle, p.init.slosh_angle_radial, p.init.slosh_rate) = (0.3, 0.2, 1.0);
        let inputs = torque(0.1);
        let mut plant = Plant::new(&p, &inputs, 0.0, 1e-9).unwrap();
        for i in [x::THETA, x::OMEGA, x::SLOSH, x::SLOSH + 1, x::SLOSH + 2, x::SLOSH + 3] {
            let mut along = |size: f64| {
                let mut dx = [0.0; STATES];
                dx[i] = size;
                let o = plant.output_derivatives(&inputs, &dx, &[0.0; 3]);
                [o.energy, o.momentum, o.f_radial, o.f_tangential, o.tau_fluid, o.tau_gravity]
            };
            let [one, hundred] = [along(1.0), along(100.0)];
            for (n, (a, b)) in one.iter().zip(hundred).enumerate() {
                let size = 1.0 + a.abs();
                assert!((100.0 * a - b).abs() < 1e-7 * size, "{slosh:?} {i} {n}: {a} {b}");
            }
            // Energy along theta on a bench that leans: minus the moment of gravity.
            if i == x::THETA && slosh == SloshModel::Frozen {
                let (sin, _) = (0.4f64).sin_cos();
                let moment = 0.5 + plant.calculated().m_0 * p.tank.r;
                let expected = -9.81 * 0.3f64.tan() * moment * sin;
                assert!((one[0] - expected).abs() < 1e-10, "{} {expected}", one[0]);
            }
        }
    }
}

//! Tests of the plant's event indicators and events in Model Exchange, in which the importing tool integrates the states.

use super::common::bench;
use plant::{
    FrictionModel, Inputs, Parameters, Plant, Ramp, STATES, SloshModel, StepEnd, StoppedStep,
    indicator, x,
};

fn torque(value: f64) -> Inputs {
    Inputs { tau_cmd: Ramp::held(value), ..Inputs::default() }
}

/// A torque just below the static friction does not break the hub away, and a torque just above it makes an event overdue.
/// After the event has been handled, the hub turns.
#[test]
fn after_the_hub_breaks_away_no_event_is_overdue() {
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
        // These are the distances of the torque from the static friction in both directions.
        assert!((z[with] - 0.6 * limit).abs() < 1e-15 && (z[against] - 1.4 * limit).abs() < 1e-15);
        assert_eq!(z[indicator::REST], 1.0);
        plant.set_time(2.0, Some(2.0), 0.0);
        assert!(!plant.take_event(&torque(sign * limit)).unwrap(), "no state may change");
        assert_eq!(plant.last_contact(), (1, 2.0, sign as i32));
        assert!(!plant.is_event_overdue(&torque(sign * limit)));
        // The hub turns: the indicator is its rate in the direction of the contact.
        let mut states = [0.0; STATES];
        states[x::OMEGA] = sign * 0.25;
        plant.set_continuous_states(&states);
        let z = plant.event_indicators(&torque(sign * limit));
        assert_eq!([z[indicator::REST], z[with], z[against]], [0.25, 1.0, 1.0]);
        states[x::OMEGA] = -sign * 1e-9;
        plant.set_continuous_states(&states);
        assert!(plant.is_event_overdue(&torque(0.0)), "the host has integrated past the stop");
        assert!(plant.take_event(&torque(0.0)).unwrap(), "the hub must be set to rest");
        assert_eq!((plant.omega(), plant.last_contact().2), (0.0, 0));
    }
}

/// Without torque, a hub with LuGre friction that comes to rest keeps the direction of its last motion as the direction of
/// its contact. If a torque acts, the torque determines this direction.
#[test]
fn a_lugre_hub_at_rest_moves_in_the_direction_of_the_torque() {
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
    assert_eq!(
        contact_under(&torque(0.0), 0.0),
        -1,
        "without torque the direction must not change"
    );
    assert_eq!(contact_under(&torque(1e-6), 0.0), 1);
    assert_eq!(contact_under(&torque(0.0), 0.0), 1, "without torque the direction must not change");
    assert_eq!(contact_under(&torque(-1e-6), 0.0), -1);
}

#[test]
fn event_indicators_of_the_wheel_are_distances_to_its_limits() {
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
    // If the integrator has passed a speed limit, the event sets the rotor's speed to the limit.
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

/// Sample k is due k sampling periods after the start. An event that is early by at most a millionth of a period takes the
/// sample.
#[test]
fn samples_of_the_gyro_are_time_events() {
    let mut p = bench(SloshModel::Frozen, FrictionModel::Viscous);
    let inputs = torque(0.0);
    let next = |p: &plant::Parameters| Plant::new(p, &inputs, 3.0, 1e-9).unwrap().next_time_event();
    assert_eq!(next(&p), None);
    p.imu.enabled = true;
    assert_eq!(next(&p), Some(3.0 + 1.0 / 50.0), "the first sample is taken at the start");
    let mut plant = Plant::new(&p, &inputs, 3.0, 1e-9).unwrap();
    plant.set_time(3.0 + 0.02 * (1.0 - 2e-6), Some(0.02 * (1.0 - 2e-6)), 0.0);
    plant.take_event(&inputs).unwrap();
    assert_eq!(plant.next_time_event(), Some(3.02), "too early");
    plant.set_time(3.0 + 0.02 * (1.0 - 0.5e-6), Some(0.02 * (1.0 - 0.5e-6)), 0.0);
    plant.take_event(&inputs).unwrap();
    assert_eq!(plant.next_time_event(), Some(3.04));
    plant.set_time(3.09, Some(0.09), 0.0);
    plant.take_event(&inputs).unwrap();
    let next = plant.next_time_event().unwrap();
    assert!((next - 3.1).abs() < 1e-15, "all overdue samples must have been taken");
}

/// The derivatives are also tested where the outputs are strongly nonlinear. If the direction is 100 times as long, the
/// derivatives are 100 times as large; they equal the change of the outputs by a small step.
#[test]
fn directional_derivatives_of_outputs_are_linear_in_the_direction() {
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
            // On a tilted bench the derivative of the energy by theta is minus the moment of gravity.
            if i == x::THETA && slosh == SloshModel::Frozen {
                let (sin, _) = (0.4f64).sin_cos();
                let moment = 0.5 + plant.calculated().m_0 * p.tank.r;
                let expected = -9.81 * 0.3f64.tan() * moment * sin;
                assert!((one[0] - expected).abs() < 1e-10, "{} {expected}", one[0]);
            }
        }
    }
}

fn stops(plant: &mut Plant, inputs: &Inputs, end: f64) -> Vec<StepEnd> {
    let mut all = Vec::new();
    loop {
        let stop = plant.step_to_event(inputs, end - plant.time()).unwrap();
        all.push(stop);
        if !matches!(stop, StepEnd::Event(_)) {
            return all;
        }
        assert!(all.len() < 100, "{all:?}");
    }
}

/// Returns a hub with rigid liquid that a torque brakes against Coulomb friction, and the time after which it comes to rest
/// and sticks, s.
fn braked() -> (Parameters, f64) {
    let mut p = bench(SloshModel::Frozen, FrictionModel::Stribeck);
    (p.friction.b, p.friction.d, p.init.omega) = (0.0, 0.0, 0.02);
    let m_liq = 1000.0 * std::f64::consts::PI / 4.0 * p.tank.d * p.tank.d * p.tank.h;
    let inertia = p.hub.inertia + m_liq * p.tank.r * p.tank.r;
    let rest = inertia * p.init.omega / (0.001 + p.friction.c);
    (p, rest)
}

#[test]
fn a_step_ends_at_the_time_at_which_the_hub_comes_to_rest() {
    let (p, rest) = braked();
    for start in [0.0, 1000.0] {
        let mut plant = Plant::new(&p, &torque(-0.001), start, 1e-9).unwrap();
        let end = plant.step_to_event(&torque(-0.001), 2.0 * rest).unwrap();
        let StepEnd::Event(at) = end else { panic!("{end:?}") };
        assert!((at - rest).abs() < 1e-12, "{at} {rest}");
        assert_eq!((plant.time(), plant.omega(), plant.last_contact().2), (start + at, 0.0, 0));
        let left = start + 2.0 * rest - plant.time();
        assert_eq!(plant.step_to_event(&torque(-0.001), left).unwrap(), StepEnd::End);
        assert_eq!(plant.time(), start + 2.0 * rest);
        // An event after the requested end of a step does not stop the step.
        let mut plant = Plant::new(&p, &torque(-0.001), start, 1e-9).unwrap();
        let end = plant.step_to_event(&torque(-0.001), 0.9 * rest).unwrap();
        assert_eq!((end, plant.stopped()), (StepEnd::End, None));
    }
}

/// In the first case the speed of the rotor falls by 1 rad/s per second and reaches its lowest value after a quarter of a
/// second. In the second case the torque command rises through 0 and the torque limit of the wheel.
#[test]
fn a_step_stops_where_the_wheel_reaches_a_limit_or_its_torque_passes_0() {
    let mut p = bench(SloshModel::Frozen, FrictionModel::Viscous);
    p.wheel.enabled = true;
    p.wheel.speed_min = p.wheel.speed_0 - 0.25;
    let inputs = torque(p.wheel.inertia);
    let mut plant = Plant::new(&p, &inputs, 3.0, 1e-9).unwrap();
    let [StepEnd::Event(at), StepEnd::End] = stops(&mut plant, &inputs, 4.0)[..] else { panic!() };
    assert!((at - 0.25).abs() < 1e-12, "{at}");
    assert_eq!(plant.continuous_states()[x::WHEEL_SPEED], p.wheel.speed_min);
    // The command rises by 1 N m/s from -0.13 N m, through 0 and the wheel's torque limit of 0.26 N m.
    p.wheel.speed_min = Parameters::default().wheel.speed_min;
    let ramp = Inputs { tau_cmd: Ramp { value: -0.13, slope: 1.0 }, ..Inputs::default() };
    let mut plant = Plant::new(&p, &ramp, 0.0, 1e-9).unwrap();
    let first = plant.step_to_event(&ramp, 0.5).unwrap();
    let StepEnd::Event(at) = first else { panic!("{first:?}") };
    assert!((at - 0.13).abs() < 1e-12, "{at}");
}

/// Samples are due 0.02 s, 0.04 s, … after the start. A sample at the end of the step does not stop the step early.
#[test]
fn a_step_stops_at_each_sample_of_the_gyro() {
    let mut p = bench(SloshModel::Spherical, FrictionModel::Viscous);
    (p.imu.enabled, p.init.omega) = (true, 0.1);
    let inputs = torque(0.02);
    let mut plant = Plant::new(&p, &inputs, 7.0, 1e-9).unwrap();
    plant.set_time(7.0, None, 1e-14);
    let all = stops(&mut plant, &inputs, 7.1);
    assert_eq!(all.len(), 5, "{all:?}");
    for stop in &all[..4] {
        let StepEnd::Event(after) = stop else { panic!("{all:?}") };
        assert!((after - 0.02).abs() < 4e-15, "{all:?}");
    }
    assert_eq!((all[4], plant.time()), (StepEnd::EventAtEnd, 7.1));
    assert_eq!(plant.next_time_event(), Some(7.0 + 6.0 / 50.0));
    // The next step ends before the next sample, and the one after it ends at the sample except for rounding.
    assert_eq!(plant.step_to_event(&inputs, 0.015).unwrap(), StepEnd::End);
    assert_eq!(plant.step_to_event(&inputs, 7.12 - plant.time()).unwrap(), StepEnd::EventAtEnd);
}

/// The motion includes stick and slip under oscillating liquid, a wheel that saturates, and samples of the gyro. The results
/// must be bit-identical, however often steps stop at events.
#[test]
fn a_step_continued_after_events_equals_one_whole_step_to_the_last_bit() {
    for slosh in SloshModel::ALL {
        let mut p = bench(slosh, FrictionModel::Stribeck);
        (p.imu.enabled, p.wheel.enabled) = (true, true);
        p.wheel.speed_min = p.wheel.speed_0 - 2.0;
        (p.init.omega, p.init.slosh_angle, p.init.slosh_angle_radial) = (0.01, 0.1, 0.05);
        let inputs = torque(0.006);
        let fresh = || Plant::new(&p, &inputs, 1.0, 1e-8).unwrap();
        let (mut whole, mut stopped) = (fresh(), fresh());
        whole.step(&inputs, 1.015625).unwrap();
        let all = stops(&mut stopped, &inputs, 2.015625);
        assert!(all.len() > 50, "{slosh:?}: {}", all.len());
        assert_eq!(whole.state().to_words(), stopped.state().to_words(), "{slosh:?}");
        // At each event the plant is saved, and another plant continues from the saved state.
        let (mut saved, mut count) = (fresh(), 0);
        while saved.time() < 2.015625 {
            let (state, words) = (*saved.state(), saved.stopped().map(StoppedStep::to_words));
            let mut other = Plant::resume(&p, &state, 1e-8);
            let step = words.map(|words| StoppedStep::from_words(&words).unwrap());
            assert_eq!(step.as_ref(), saved.stopped());
            other.set_stopped(step);
            saved = other;
            saved.step_to_event(&inputs, 2.015625 - saved.time()).unwrap();
            count += 1;
        }
        assert_eq!(count, all.len(), "{slosh:?}");
        assert_eq!(whole.state().to_words(), saved.state().to_words(), "{slosh:?}");
    }
}

/// After a step has stopped at an event, a host usually simulates the rest of this step with the same torque, and the plant
/// does not stop at this event again. If the next step has another end or another torque, it must give the same result as in
/// a new plant that was created from the saved state.
#[test]
fn after_an_event_a_changed_step_equals_that_of_a_restored_plant() {
    let mut p = bench(SloshModel::Linear, FrictionModel::Stribeck);
    (p.imu.enabled, p.init.omega, p.init.slosh_angle) = (true, 0.05, 0.1);
    let inputs = torque(0.01);
    for (inputs_then, h) in [
        (torque(0.02), 0.08),
        (inputs, 0.07),
        (inputs, 0.09),
        (Inputs { tau_ext: Ramp::held(0.01), ..inputs }, 0.08),
        (Inputs { tau_cmd: Ramp { value: 0.01, slope: 1e-3 }, ..inputs }, 0.08),
    ] {
        let mut plant = Plant::new(&p, &inputs, 0.0, 1e-8).unwrap();
        assert!(matches!(plant.step_to_event(&inputs, 0.1).unwrap(), StepEnd::Event(_)));
        let mut fresh = Plant::resume(&p, plant.state(), 1e-8);
        let (a, b) = (plant.step_to_event(&inputs_then, h), fresh.step_to_event(&inputs_then, h));
        assert_eq!(a, b, "{inputs_then:?} {h}");
        assert_eq!(plant.state().to_words(), fresh.state().to_words(), "{inputs_then:?} {h}");
        assert_eq!(plant.stopped(), fresh.stopped(), "{inputs_then:?} {h}");
    }
    // The end of the continued step may differ from the end of the whole step by rounding.
    let mut plant = Plant::new(&p, &inputs, 0.0, 1e-8).unwrap();
    let mut whole = plant.clone();
    whole.step(&inputs, 0.1).unwrap();
    plant.step_to_event(&inputs, 0.1).unwrap();
    let off = 2.0 * f64::EPSILON * 0.1;
    while plant.time() < 0.1 - 1e-9 {
        plant.step_to_event(&inputs, 0.1 - plant.time() + off).unwrap();
    }
    assert_eq!(plant.state().to_words(), whole.state().to_words());
}

/// Saved data of a stopped step are valid only if all numbers are finite and the time of the stop lies within the step.
#[test]
fn invalid_saved_data_of_a_step_stopped_at_an_event_are_refused() {
    let mut p = bench(SloshModel::Linear, FrictionModel::Viscous);
    p.imu.enabled = true;
    let inputs = torque(0.01);
    let mut plant = Plant::new(&p, &inputs, 0.0, 1e-8).unwrap();
    plant.step_to_event(&inputs, 0.1).unwrap();
    let words = plant.stopped().unwrap().to_words();
    let first = words.len() - 6 - STATES;
    let with = |n: usize, x: f64| {
        let mut words = words;
        words[first + n] = x.to_bits();
        StoppedStep::from_words(&words)
    };
    assert!(with(0, 0.1).is_some() && with(1, 0.0).is_some());
    // Invalid values of the length of the step and of the elapsed time:
    let bad = [(0, 0.01), (0, f64::INFINITY), (0, f64::NAN), (1, 0.1), (1, -1e-9), (1, f64::NAN)];
    assert!(bad.iter().all(|(n, x)| with(*n, *x).is_none()));
    // Invalid values of each number after the first two:
    for n in 2..6 + STATES {
        assert!(with(n, f64::NAN).is_none() && with(n, f64::INFINITY).is_none(), "{n}");
        assert!(with(n, 0.25).is_some(), "{n}");
    }
    let mut none = words;
    none[..first].fill(u64::MAX);
    assert!(StoppedStep::from_words(&none).is_none(), "the start of the step is not a state");
}

#[test]
fn a_failed_step_does_not_forget_the_step_that_stopped_at_an_event() {
    let mut p = bench(SloshModel::Linear, FrictionModel::Viscous);
    (p.imu.enabled, p.solver.max_steps) = (true, 20);
    let inputs = torque(0.01);
    let mut plant = Plant::new(&p, &inputs, 0.0, 1e-8).unwrap();
    plant.step_to_event(&inputs, 0.1).unwrap();
    let (state, stopped) = (plant.state().to_words(), plant.stopped().copied());
    assert!(plant.step_to_event(&inputs, 100.0).is_ok_and(|end| matches!(end, StepEnd::Event(_))));
    let mut plant = Plant::resume(&p, plant.state(), 1e-8);
    let before = plant.state().to_words();
    assert!(plant.step(&inputs, 100.0).is_err());
    assert_eq!(plant.state().to_words(), before);
    assert!(stopped.is_some() && state != before);
    p.solver.max_steps = 1;
    let mut tired = Plant::resume(&p, plant.state(), 1e-8);
    tired.set_stopped(stopped);
    assert!(tired.step_to_event(&inputs, 0.5).is_err());
    assert_eq!((tired.state().to_words(), tired.stopped().copied()), (before, stopped));
}

//! Events after a step of Spacecraft or SloshTank, and warnings, as the models report them to the runtime.

use SloshTank::model as sloshtank;
use Spacecraft::model as spacecraft;
use craft::{Inputs, STATES, TANK_STATES, TANKS};
use runtime::Dynamics;
use runtime::clock::Instant;
use sloshtank::Model as TankModel;
use spacecraft::Model as CraftModel;

const STEP: f64 = 0.01;

/// Simulates one second of Spacecraft in Model Exchange by Euler steps, while the wheels' angular momentum `h_wheels[2]` and
/// the `torque` about y are functions of time. Returns true if the FMU warns.
fn is_warned(h_wheels: fn(f64) -> f64, torque: fn(f64) -> f64, with_events: bool) -> bool {
    let inputs = |t: f64| {
        let mut inputs = Inputs::default();
        inputs.h_wheels.value[1] = h_wheels(t);
        inputs.torque.value = [1.0, torque(t), 0.0];
        inputs
    };
    let mut model =
        CraftModel::new(&spacecraft::Parameters::default(), &inputs(0.0), 0.0, 1e-6).unwrap();
    let (mut x, mut x_dot) = ([0.0; STATES], [0.0; STATES]);
    for k in 0..100 {
        let t = k as f64 * STEP;
        if with_events {
            model.handle_event(&inputs(t)).unwrap();
        }
        x.copy_from_slice(model.continuous_states());
        model.derivatives(&inputs(t), &mut x_dot);
        for (x, x_dot) in x.iter_mut().zip(x_dot) {
            *x += STEP * x_dot;
        }
        model.set_time(Instant { time: t + STEP, since_start: None, resolution: 0.0 });
        model.set_continuous_states(&x);
        // Inputs that jump at events are constant between them.
        model.accept_step(&inputs(if with_events { t } else { t + STEP })).unwrap();
    }
    model.step_warning().is_some()
}

/// Spacecraft must warn unless the torque is the reaction to the change of the wheels' angular momentum.
#[test]
fn spacecraft_warns_if_the_wheels_angular_momentum_changes_without_a_reaction_torque() {
    let sine = |t: f64| f64::sin(3.0 * t);
    let reaction = |t: f64| -3.0 * f64::cos(3.0 * t);
    assert!(is_warned(sine, |_| 0.0, false));
    assert!(!is_warned(sine, reaction, false));
    assert!(!is_warned(sine, |_| 0.0, true), "jumps at events turn the craft by impulses");
    assert!(!is_warned(|_| 5.0, |_| 0.0, false), "wheels that hold their momentum");
    // The momentum is a ramp between two knots, with a reaction torque only during the ramp.
    let ramp = |t: f64| (10.0 * (t - 0.5)).clamp(0.0, 1.0);
    let reaction = |t: f64| if (0.5..0.6).contains(&t) { -10.0 } else { 0.0 };
    assert!(!is_warned(ramp, reaction, false));
    assert!(is_warned(ramp, |_| 0.0, false));
}

/// The thrust is reversed, so that the liquid detaches. The host, which integrates the FMU, then sets the position of the
/// liquid to half a metre above its tank. Only if the liquid moves further outwards does the FMU request an event at the end
/// of the step; the event reverses the velocity of the liquid.
#[test]
fn a_step_that_ends_with_the_liquid_outside_its_tank_asks_for_an_event() {
    let mut parameters = spacecraft::Parameters::default();
    parameters.tank[0].ball.travel = 0.6;
    let mut inputs = Inputs::default();
    inputs.force.value[2] = -100.0;
    let mut model = CraftModel::new(&parameters, &inputs, 0.0, 1e-6).unwrap();
    assert!(model.accept_step(&inputs).unwrap(), "liquid that has to leave its bottom");
    model.handle_event(&inputs).unwrap();
    assert!(!model.accept_step(&inputs).unwrap());
    let ball = craft::index::ball(0);
    let mut x = model.continuous_states().to_vec();
    x[ball + 2] += 1.1;
    for (speed, is_overdue) in [(-0.3, false), (0.3, true)] {
        x[ball + 5] = speed;
        model.set_continuous_states(&x);
        let mut z = [0.0; 2 * TANKS];
        model.event_indicators(&inputs, &mut z);
        assert_eq!(z[0] < 0.0, is_overdue);
        assert_eq!(model.accept_step(&inputs).unwrap(), is_overdue);
    }
    assert!(model.handle_event(&inputs).unwrap());
    assert!(model.continuous_states()[ball + 5] < 0.0);
    assert!(!model.accept_step(&inputs).unwrap());
}

/// The craft that carries the tank accelerates backwards while the liquid is half a metre above its tank. A host of Model
/// Exchange can set such a position.
#[test]
fn a_step_of_slosh_tank_that_ends_with_the_liquid_outside_asks_for_an_event() {
    let mut parameters = sloshtank::Parameters::default();
    parameters.host.mass = 1000.0;
    parameters.tank.ball.travel = 0.6;
    let mut inputs = sloshtank::Inputs::default();
    inputs.tank.a.value = [0.0, 0.0, -0.1];
    let mut model = TankModel::new(&parameters, &inputs, 0.0, 1e-6).unwrap();
    assert!(model.accept_step(&inputs).unwrap(), "liquid that has to leave its bottom");
    model.handle_event(&inputs).unwrap();
    assert!(!model.accept_step(&inputs).unwrap());
    // `ball` is the index of position and velocity of the detached liquid, which precede the three states of the spin.
    let ball = TANK_STATES - 9;
    let mut x = model.continuous_states().to_vec();
    x[ball + 2] += 1.1;
    for (speed, is_overdue) in [(-0.3, false), (0.3, true)] {
        x[ball + 5] = speed;
        model.set_continuous_states(&x);
        assert_eq!(model.accept_step(&inputs).unwrap(), is_overdue);
    }
    assert!(model.handle_event(&inputs).unwrap());
    assert!(model.continuous_states()[ball + 5] < 0.0);
    assert!(!model.accept_step(&inputs).unwrap());
}

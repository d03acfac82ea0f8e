//! Tests of a hub that hangs from a torsion line: frequencies and decays in closed form, and balances. Without stiffness and
//! damping of the line, results are bit-identical to those without suspension.

use std::f64::consts::{PI, TAU};

use super::common::{FRICTION, SLOSH, bench};
use plant::{FrictionModel, Inputs, Parameters, Plant, Ramp, SloshModel};

const TOLERANCE: f64 = 1e-10;

fn plant(p: &Parameters) -> Plant {
    Plant::new(p, &Inputs::default(), 0.0, TOLERANCE).unwrap()
}

/// Returns a bench with rigid liquid on a suspension line of 0.5 N m/rad that is twisted by 0.1 rad at the start.
fn frozen(friction: FrictionModel) -> Parameters {
    let mut p = bench(SloshModel::Frozen, friction);
    (p.hub.k, p.hub.theta_0, p.init.theta) = (0.5, -0.2, -0.1);
    p
}

fn inertia(p: &Parameters) -> f64 {
    let m_liq = 1000.0 * PI / 4.0 * p.tank.d * p.tank.d * p.tank.h;
    p.hub.inertia + m_liq * p.tank.r * p.tank.r
}

#[test]
fn a_suspension_line_without_stiffness_and_damping_changes_no_bit_of_the_motion() {
    for slosh in SLOSH {
        for friction in FRICTION {
            let run = |theta_0: f64| {
                let mut p = bench(slosh, friction);
                (p.init.slosh_angle, p.hub.theta_0) = (0.2, theta_0);
                let inputs =
                    Inputs { tau_cmd: Ramp { value: 0.03, slope: -0.02 }, ..Inputs::default() };
                let mut plant = plant(&p);
                plant.step(&inputs, 3.0).unwrap();
                (plant.state().to_words(), plant.outputs(&inputs).energy.to_bits())
            };
            assert_eq!(run(0.0), run(2.5), "{slosh:?} {friction:?}");
        }
    }
}

/// The expected energy is the spring's, 0.25 (0.1)^2 J, plus the kinetic energy; the expected torque is -0.05 N m of the
/// spring and -0.02 N m of the damping.
#[test]
fn torque_and_energy_of_the_suspension_line_follow_from_its_twist() {
    let mut p = frozen(FrictionModel::None);
    (p.hub.c, p.init.omega) = (0.1, 0.2);
    let outputs = plant(&p).outputs(&Inputs::default());
    assert!((outputs.tau_suspension + 0.07).abs() < 1e-16, "{}", outputs.tau_suspension);
    let kinetic = 0.5 * inertia(&p) * 0.04;
    assert!((outputs.energy - kinetic - 0.0025).abs() < 1e-15, "{} {kinetic}", outputs.energy);
}

/// The expected motion is the solution of I theta'' = -k (theta - theta_0) - c theta'.
#[test]
fn a_rigid_hub_swings_and_decays_as_a_torsion_pendulum() {
    for c in [0.0, 0.05] {
        let mut p = frozen(FrictionModel::None);
        p.hub.c = c;
        let (decay, omega_0) = (c / (2.0 * inertia(&p)), (p.hub.k / inertia(&p)).sqrt());
        let omega = (omega_0 * omega_0 - decay * decay).sqrt();
        let mut plant = plant(&p);
        for k in 1..=40 {
            plant.step(&Inputs::default(), 0.5).unwrap();
            let t = 0.5 * k as f64;
            let swing = (omega * t).cos() + decay / omega * (omega * t).sin();
            let expected = -0.2 + 0.1 * (-decay * t).exp() * swing;
            let theta = plant.outputs(&Inputs::default()).theta;
            assert!((theta - expected).abs() < 1e-9, "{c} {t}: {theta} {expected}");
        }
    }
}

/// The expected frequencies are the eigenvalues of the coupled equations of hub and linear pendulum with the stiffness of the
/// line.
#[test]
fn suspension_line_and_liquid_swing_at_the_frequencies_of_two_coupled_pendulums() {
    let mut p = bench(SloshModel::Linear, FrictionModel::None);
    (p.slosh.zeta_from_correlation, p.slosh.zeta) = (false, 0.0);
    p.hub.k = 40.0; // near the slosh frequency: strongly coupled
    let (m, l, m_0) = {
        let plant = plant(&p);
        let it = plant.calculated();
        (it.mass[0], it.length[0], it.m_0)
    };
    let (r, g) = (p.tank.r, 9.81);
    let i = p.hub.inertia + (m_0 + m) * r * r;
    // The determinant is (k - I w2)(m g l - m l^2 w2) - (m l r w2)^2.
    let a = i * m * l * l - (m * l * r).powi(2);
    let b = -(i * m * g * l + p.hub.k * m * l * l);
    let c = p.hub.k * m * g * l;
    let root = (b * b - 4.0 * a * c).sqrt();
    for omega2 in [(-b - root) / (2.0 * a), (-b + root) / (2.0 * a)] {
        let ratio = (p.hub.k - i * omega2) / (m * l * r * omega2); // alpha/theta
        p.init.theta = 1e-2;
        p.init.slosh_angle = 1e-2 * ratio;
        let mut plant = plant(&p);
        let third = TAU / omega2.sqrt() / 3.0;
        for _ in 0..7 {
            plant.step(&Inputs::default(), third).unwrap();
        }
        let o = plant.outputs(&Inputs::default());
        for (got, start) in [(o.theta, 1e-2), (o.slosh_angle, 1e-2 * ratio)] {
            // After 7/3 periods each angle is cos(7 2 pi/3) = -1/2 of its start.
            assert!((got / start + 0.5).abs() < 1e-8, "{omega2}: {got} {start}");
        }
    }
}

/// Coulomb friction c_f reduces the amplitude by 2 c_f/k in each half swing of pi sqrt(I/k), until the line can no longer
/// overcome the friction.
#[test]
fn dry_friction_stops_a_hub_on_a_suspension_line_at_the_predicted_angle_and_time() {
    let mut p = frozen(FrictionModel::Stribeck);
    (p.friction.b, p.friction.d, p.friction.c) = (0.0, 0.0, 0.006);
    let (half, loss) = (PI * (inertia(&p) / p.hub.k).sqrt(), 2.0 * p.friction.c / p.hub.k);
    // The reversals are at 0.1, -0.076, 0.052, -0.028 and 0.004 rad; the last is within c_f/k = 0.012 rad.
    let mut plant = plant(&p);
    for swing in 1..=4 {
        let until = f64::from(swing) * half * (1.0 + 1e-9) - plant.time();
        plant.step(&Inputs::default(), until).unwrap();
        let twist = plant.outputs(&Inputs::default()).theta - p.hub.theta_0;
        let sign = if swing % 2 == 0 { 1.0 } else { -1.0 };
        let expected = sign * (0.1 - loss * f64::from(swing));
        assert!((twist - expected).abs() < 1e-9, "{swing}: {twist} {expected}");
    }
    let (_, time, contact) = plant.last_contact();
    assert_eq!(contact, 0, "the bearing must hold the hub against the torque of the line");
    assert!((time - 4.0 * half).abs() < 1e-8, "{time} {}", 4.0 * half);
    let before = plant.outputs(&Inputs::default());
    plant.step(&Inputs::default(), 10.0).unwrap();
    let now = plant.outputs(&Inputs::default());
    assert_eq!((now.theta, now.omega), (before.theta, 0.0));
    assert!((now.tau_friction + now.tau_suspension).abs() < 1e-15);
    // A torque command in the direction of the line's torque breaks the hub away when their sum reaches the static friction.
    let missing = p.friction.c - now.tau_suspension.abs();
    let towards = now.tau_suspension.signum();
    for (factor, stuck) in [(1.0 - 1e-6, true), (1.0 + 1e-6, false)] {
        let torque = Ramp::held(towards * missing * factor);
        let inputs = Inputs { tau_cmd: torque, ..Inputs::default() };
        assert_eq!(plant.outputs(&inputs).discrete.stuck, stuck);
    }
}

#[test]
fn energy_and_torques_balance_on_a_suspension_line_for_any_communication_step() {
    for slosh in SLOSH {
        for friction in FRICTION {
            let mut p = bench(slosh, friction);
            (p.hub.k, p.hub.theta_0, p.hub.c) = (2.0, 0.4, 0.01);
            (p.init.omega, p.init.slosh_angle, p.init.slosh_angle_radial) = (0.2, 0.2, 0.1);
            let inputs = Inputs { tau_cmd: Ramp::held(0.02), ..Inputs::default() };
            let run = |h: f64, count: usize| {
                let mut plant = plant(&p);
                let first = plant.outputs(&inputs);
                for _ in 0..count {
                    plant.step(&inputs, h).unwrap();
                }
                (first, plant.outputs(&inputs))
            };
            let (first, last) = run(0.05, 100);
            let lost = first.energy + last.work - last.heat - last.energy;
            assert!(
                lost.abs() < 1e-9 * (first.energy + last.heat),
                "{slosh:?} {friction:?} {lost:e}"
            );
            assert!(last.heat > 0.0);
            let torques = last.tau_actuator + last.tau_friction + last.tau_fluid;
            let rest = p.hub.inertia * last.omega_dot - torques - last.tau_suspension;
            assert!(rest.abs() < 1e-12, "{slosh:?} {friction:?} {rest:e}");
            let expected = -2.0 * (last.theta - 0.4) - 0.01 * last.omega;
            assert!((last.tau_suspension - expected).abs() < 1e-15);
            let (_, other) = run(2.5, 2);
            let apart = other.theta - last.theta;
            assert!(apart.abs() < 1e-8, "{slosh:?} {friction:?} {apart:e}");
        }
    }
}

//! Forces, momentum and energy in the outputs agree with those computed from the positions of the masses: the positions of
//! the slosh masses follow from the states, and their velocities and accelerations from differences of the positions.

use super::common::bench;
use plant::{Calculated, FrictionModel, Inputs, Outputs, Parameters, Plant, Ramp, SloshModel, x};

/// Sampling interval, s. Five-point differences have the error (omega h)^4/30 of a derivative, which is 2e-8 for the second
/// mode at 25 rad/s.
const H: f64 = 5e-4;

const G: f64 = 9.81;

fn moving(slosh: SloshModel) -> Parameters {
    let mut p = bench(slosh, FrictionModel::Viscous);
    p.slosh.modes = 3;
    (p.bench.tilt, p.bench.tilt_azimuth) = (0.1, 0.7);
    (p.hub.imbalance, p.hub.imbalance_angle) = (0.4, 2.0);
    p.tank.own_inertia = 0.01;
    (p.init.omega, p.init.theta) = (0.8, 0.4);
    (p.init.slosh_angle, p.init.slosh_angle_radial) = (0.3, -0.2);
    (p.init.slosh_rate, p.init.slosh_rate_radial) = (1.0, 2.0);
    p
}

struct Place {
    theta: f64,
    /// For each slosh mass, m: its coordinates x and y in the hub's frame, the height that determines its vertical velocity,
    /// and the height that determines its potential energy.
    bobs: Vec<[f64; 4]>,
}

fn displaced(p: &Parameters, l: f64, first: bool, q: [f64; 2]) -> [f64; 4] {
    let [a, b] = q;
    match p.slosh.model {
        SloshModel::Frozen => [0.0; 4],
        // The slosh mass has no height; its potential energy is that of a spring.
        SloshModel::Linear => [0.0, l * b, 0.0, l * b * b / 2.0],
        SloshModel::Planar => [0.0, l * b.sin(), l * (1.0 - b.cos()), l * (1.0 - b.cos())],
        SloshModel::Spherical => {
            let k = 2.0 / (1.0 + a * a + b * b);
            let up = l * (2.0 - k);
            [l * k * a, l * k * b, up, up]
        }
        SloshModel::Liquid => {
            let fill = p.tank.h / (p.tank.d / 2.0);
            let (s, kappa) =
                if first { formulas::third_order::coefficients(fill) } else { (1.0, 1.0) };
            let spring = kappa / (2.0 * l * l);
            let q2 = a * a + b * b;
            // The coefficient s multiplies the kinetic energy of the vertical motion.
            let up = s.sqrt() * q2 / (2.0 * l);
            [a, b, up, (q2 / 2.0 + spring * q2 * q2 / 4.0) / l]
        }
    }
}

fn place(p: &Parameters, known: &Calculated, plant: &Plant) -> Place {
    let states = plant.continuous_states();
    let modes = known.mass.iter().take_while(|m| **m > 0.0).count();
    let bob = |n: usize| {
        let q = &states[x::SLOSH + 4 * n..];
        let [x, y, up, felt] = displaced(p, known.length[n], n == 0, [q[0], q[1]]);
        [p.tank.r + x, y, up, felt]
    };
    Place { theta: states[x::THETA], bobs: (0..modes).map(bob).collect() }
}

fn derivatives(f: [f64; 5]) -> [f64; 2] {
    let [a, b, c, d, e] = f;
    [
        (a - 8.0 * b + 8.0 * d - e) / (12.0 * H),
        (-a + 16.0 * b - 30.0 * c + 16.0 * d - e) / (12.0 * H * H),
    ]
}

/// Simulates five samples of a motion. Returns the calculated parameters, the positions of all masses at the samples, and the
/// outputs at the middle sample.
fn sampled(p: &Parameters) -> (Calculated, [Place; 5], Outputs) {
    let inputs = Inputs { tau_cmd: Ramp::held(0.3), ..Inputs::default() };
    let mut plant = Plant::new(p, &inputs, 0.0, 1e-13).unwrap();
    let known = *plant.calculated();
    plant.step(&inputs, 0.1).unwrap();
    let mut outputs = None;
    let places = [0, 1, 2, 3, 4].map(|k| {
        if k > 0 {
            plant.step(&inputs, H).unwrap();
        }
        if k == 2 {
            outputs = Some(plant.outputs(&inputs));
        }
        place(p, &known, &plant)
    });
    (known, places, outputs.unwrap())
}

fn assert_near(got: f64, want: f64, size: f64, what: &str) {
    assert!((got - want).abs() < size, "{what}: {got} {want}");
}

/// Velocities and accelerations are computed by differences from the positions of hub and slosh masses at several times.
/// Forces, momentum and energy then follow from Newton's law.
#[test]
fn forces_momentum_and_energy_follow_from_the_positions_of_the_masses_by_newtons_law() {
    for slosh in SloshModel::ALL {
        let p = moving(slosh);
        let (known, places, o) = sampled(&p);
        let theta = places.each_ref().map(|place| place.theta);
        let [w, wd] = derivatives(theta);
        let (r, now) = (p.tank.r, theta[2]);
        let lateral = G * p.bench.tilt.tan();
        let (e_y, e_x) = (p.bench.tilt_azimuth - now).sin_cos();
        let (e_x, e_y) = (lateral * e_x, lateral * e_y);
        let (i_0, m_0) = (known.m_0 * r * r + p.tank.own_inertia, known.m_0);
        // The rigid liquid, and the hub's imbalance u. Only the gravity torque of the imbalance is added, because
        // `hub.inertia` contains its inertia.
        let (u_y, u_x) = p.hub.imbalance_angle.sin_cos();
        let (u_x, u_y) = (p.hub.imbalance * u_x, p.hub.imbalance * u_y);
        let mut force = [m_0 * (r * w * w + e_x), m_0 * (-r * wd + e_y)];
        let mut momentum = (p.hub.inertia + i_0) * w;
        let mut energy = (p.hub.inertia + i_0) * w * w / 2.0 - (u_x + m_0 * r) * e_x - u_y * e_y;
        for n in 0..places[2].bobs.len() {
            let m = known.mass[n];
            let along = |i: usize| derivatives(places.each_ref().map(|place| place.bobs[n][i]));
            let [x, y, _, felt] = places[2].bobs[n];
            let ([x_d, x_dd], [y_d, y_dd], [up_d, _]) = (along(0), along(1), along(2));
            let linear = slosh == SloshModel::Linear;
            // Velocity and acceleration are relative to inertial axes. In the linear model the slosh mass moves along the
            // tangent, so that only the tangential terms of first order are included.
            let velocity = if linear { [0.0, r * w + y_d] } else { [x_d - w * y, y_d + w * x] };
            let radial = x_dd - 2.0 * w * y_d - wd * y - w * w * x;
            let tangential =
                if linear { y_dd + wd * r } else { y_dd + 2.0 * w * x_d + wd * x - w * w * y };
            force[0] += m * (e_x - radial);
            force[1] += m * (e_y - tangential);
            momentum +=
                m * if linear { r * velocity[1] } else { x * velocity[1] - y * velocity[0] };
            let speed2 = velocity[0].powi(2) + velocity[1].powi(2) + up_d.powi(2);
            energy += m * (speed2 / 2.0 + G * felt - e_x * x - e_y * y);
        }
        // The tolerances allow for errors in forces of 10 N, and in differences of accelerations of 100 m/s2 (second and third
        // mode) with an error of 1e-8.
        let what = format!("{slosh:?}");
        assert_near(o.omega, w, 1e-9, &what);
        assert_near(o.omega_dot, wd, 1e-6, &what);
        assert_near(o.f_radial, force[0], 1e-5, &format!("{what} radial force"));
        assert_near(o.f_tangential, force[1], 1e-5, &format!("{what} tangential force"));
        assert_near(o.momentum, momentum, 1e-8, &format!("{what} momentum"));
        assert_near(o.energy, energy, 1e-8, &format!("{what} energy"));
        assert!(
            force[0].abs() > 0.4 && force[1].abs() > 0.4,
            "a force is too small: {what} {force:?}"
        );
    }
}

/// All liquid is at rest relative to the rotating hub, so that its force on the hub is the centrifugal force of its mass.
#[test]
fn liquid_that_turns_with_the_hub_pushes_outwards() {
    for slosh in SloshModel::ALL {
        let mut p = bench(slosh, FrictionModel::None);
        p.init.omega = 0.5;
        let o = Plant::new(&p, &Inputs::default(), 0.0, 1e-9).unwrap().outputs(&Inputs::default());
        let m_liq = 1000.0 * core::f64::consts::FRAC_PI_4 * 0.163 * 0.163 * 0.10;
        // The centrifugal force accelerates a spherical slosh mass that hangs under its hinge, so that it does not pull
        // at the hinge yet.
        let pushed = match slosh {
            SloshModel::Frozen | SloshModel::Linear | SloshModel::Planar => m_liq,
            _ => Plant::new(&p, &Inputs::default(), 0.0, 1e-9).unwrap().calculated().m_0,
        };
        assert_near(o.f_radial, pushed * 0.225 * 0.25, 1e-12, &format!("{slosh:?}"));
    }
}

/// When a torque begins to act, only the rigid part of the liquid accelerates with the hub at first.
#[test]
fn liquid_at_rest_reacts_against_an_acceleration_of_the_hub() {
    for slosh in SloshModel::ALL {
        let p = bench(slosh, FrictionModel::None);
        let inputs = Inputs { tau_ext: Ramp::held(0.1), ..Inputs::default() };
        let mut plant = Plant::new(&p, &inputs, 0.0, 1e-9).unwrap();
        let m_0 = plant.calculated().m_0;
        let o = plant.outputs(&inputs);
        // Slosh masses at rest under their hinges exert no lateral force.
        let wd = 0.1 / (p.hub.inertia + m_0 * 0.225 * 0.225);
        assert_near(o.omega_dot, wd, 1e-14, &format!("{slosh:?}"));
        assert_near(o.f_tangential, -m_0 * 0.225 * wd, 1e-14, &format!("{slosh:?}"));
        assert_near(o.tau_fluid, -m_0 * 0.225 * 0.225 * wd, 1e-14, &format!("{slosh:?}"));
    }
}

/// The outputs at the start must equal the initial angles and rates of the first mode in both directions, although each slosh
/// model has coordinates of its own.
#[test]
fn a_bench_starts_at_the_given_slosh_angles_and_rates() {
    for slosh in SloshModel::ALL.into_iter().filter(|model| *model != SloshModel::Frozen) {
        let mut p = bench(slosh, FrictionModel::Viscous);
        p.init.slosh_angle = 0.3;
        p.init.slosh_rate = 1.5;
        let both = !matches!(slosh, SloshModel::Linear | SloshModel::Planar);
        if both {
            (p.init.slosh_angle_radial, p.init.slosh_rate_radial) = (-0.2, 2.0);
        }
        let inputs = Inputs::default();
        let o = Plant::new(&p, &inputs, 0.0, 1e-9).unwrap().outputs(&inputs);
        let shown = [o.slosh_angle, o.slosh_rate, o.slosh_angle_radial, o.slosh_rate_radial];
        let given = [0.3, 1.5, p.init.slosh_angle_radial, p.init.slosh_rate_radial];
        for (shown, given) in shown.iter().zip(given) {
            // The tolerance allows for the rounding errors of a few functions.
            assert!((shown - given).abs() < 1e-14, "{slosh:?} {shown} {given}");
        }
    }
}

//! Tests of rotary slosh of the spherical model against independent references: a model in unit vectors, the analytic
//! stability boundaries of the forced spherical pendulum, and the onset of rotary slosh that Rubaga observed on the bench.

use std::f64::consts::TAU;

use super::common::bench;
use ode_solvers::dop853::Dop853;
use ode_solvers::{SVector, System};
use plant::{FrictionModel, Inputs, Parameters, Plant, Ramp, SloshModel};

/// Hub and one spherical pendulum with the unit vector p as coordinates: angle and rate of the hub, then p and p'. The
/// equations are Newton's law of the slosh mass in the hub's frame, in which p.p'' = -|p'|^2 eliminates the tension of the
/// rod. The equations of the plant differ: they contain the inertial velocity of the slosh mass instead of p', and the
/// tension acts on the hub, whereas here the acceleration of the hub follows from the total angular momentum.
struct UnitVector {
    i0: f64,
    m: f64,
    l: f64,
    r: f64,
    c: f64,
    b: f64,
    tau: f64,
}

type State = SVector<f64, 8>;

impl System<f64, State> for UnitVector {
    fn system(&self, _: f64, y: &State, dy: &mut State) {
        let UnitVector { i0, m, l, r, c, b, tau } = *self;
        let (w, p, v) = (y[1], [y[2], y[3], y[4]], [y[5], y[6], y[7]]);
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let (x, y_) = (r + l * p[0], l * p[1]);
        // Specific force without the terms in w': Coriolis force, centrifugal force, drag, gravity.
        let f = [
            2.0 * w * l * v[1] + w * w * x - c / m * l * v[0],
            -2.0 * w * l * v[0] + w * w * y_ - c / m * l * v[1],
            -9.81 - c / m * l * v[2],
        ];
        let (pf, v2) = (dot(p, f), dot(v, v));
        let acc = [0, 1, 2].map(|i| (f[i] - pf * p[i]) / l - v2 * p[i]);
        // w' follows from the derivative of the total angular momentum.
        let inner = x * (l * acc[1] + 2.0 * w * l * v[0] - w * w * y_)
            - y_ * (l * acc[0] - 2.0 * w * l * v[1] - w * w * x);
        let wd = (tau - b * w - m * inner) / (i0 + m * r * r * p[1] * p[1]);
        let e = [wd * y_, -wd * x, 0.0];
        let pe = dot(p, e);
        (dy[0], dy[1]) = (w, wd);
        for i in 0..3 {
            dy[2 + i] = v[i];
            dy[5 + i] = acc[i] + (e[i] - pe * p[i]) / l;
        }
    }
}

#[test]
fn stereographic_and_unit_vector_pendulums_agree_beyond_the_horizontal() {
    for (zeta, rate) in [(0.0, 25.0), (0.02, 27.0)] {
        let mut p = bench(SloshModel::Spherical, FrictionModel::Viscous);
        p.slosh.zeta_from_correlation = false;
        p.slosh.zeta = zeta;
        (p.init.slosh_angle, p.init.slosh_angle_radial) = (0.4, -0.1);
        (p.init.slosh_rate, p.init.slosh_rate_radial) = (rate, 2.0);
        let inputs = Inputs { tau_cmd: Ramp::held(0.05), ..Inputs::default() };
        let mut plant = Plant::new(&p, &inputs, 0.0, 1e-12).unwrap();
        let known = *plant.calculated();
        let (m, l) = (known.mass[0], known.length[0]);
        let system = UnitVector {
            i0: p.hub.inertia + known.m_0 * p.tank.r * p.tank.r,
            m,
            l,
            r: p.tank.r,
            c: 2.0 * zeta * (9.81 / l).sqrt() * m,
            b: p.friction.b,
            tau: 0.05,
        };
        let (a, b) = (p.init.slosh_angle_radial, p.init.slosh_angle);
        let (p_x, p_y) = (a.sin(), b.sin());
        let (v_x, v_y) = (a.cos() * p.init.slosh_rate_radial, b.cos() * p.init.slosh_rate);
        let p_z = -(1.0 - p_x * p_x - p_y * p_y).sqrt();
        let v_z = -(p_x * v_x + p_y * v_y) / p_z;
        let start = State::from([0.0, 0.0, p_x, p_y, p_z, v_x, v_y, v_z]);
        let mut solver = Dop853::new(system, 0.0, 1.51, 0.01, start, 1e-13, 1e-13);
        solver.integrate().unwrap();
        let (mut highest, mut time) = (-1.0f64, 0.0);
        for (t, y) in solver.x_out().iter().zip(solver.y_out()) {
            if *t <= time || *t > 1.505 {
                continue;
            }
            plant.step(&inputs, t - time).unwrap();
            time = *t;
            highest = highest.max(y[4]);
            let o = plant.outputs(&inputs);
            // Both simulations start with an error of 1e-13. The motion is chaotic: errors grow ninefold in 0.2 s, so that
            // they are about 1e-11 after 1.5 s.
            assert!((o.theta - y[0]).abs() < 1e-9, "theta at {t}");
            assert!((o.omega - y[1]).abs() < 1e-9, "omega at {t}");
            assert!((o.slosh_angle.sin() - y[3]).abs() < 1e-9, "p_y at {t}");
            assert!((o.slosh_angle_radial.sin() - y[2]).abs() < 1e-9, "p_x at {t}");
        }
        assert!(time > 1.4 && highest > 0.3, "the bob must pass the horizontal: {highest}");
    }
}

/// Returns true if a small radial displacement grows, that is, if planar motion is unstable. The hub is too heavy for the
/// liquid to move it, and the tank is so far from the axis that the hinge moves on a straight line, by `eps` l cos(w t),
/// where l is the pendulum length. `mu` is the detuning: w^2 = (g/l) (1 + mu eps^(2/3)). The motion starts on the planar
/// periodic orbit with the amplitude a eps^(1/3), where mu a + a^3/8 + 1 = 0.
fn leaves_the_plane(eps: f64, mu: f64) -> bool {
    let mut p = bench(SloshModel::Spherical, FrictionModel::None);
    p.tank.r = 1000.0;
    p.hub.inertia = 1e12;
    // This damping is large enough to end the initial transient and too small to move the boundaries: the growth rate of the
    // radial displacement must exceed zeta w, which shifts mu by about (2 zeta/eps^(2/3))^2 = 4e-4.
    p.slosh.zeta_from_correlation = false;
    p.slosh.zeta = 1e-4;
    let l = Plant::new(&p, &Inputs::default(), 0.0, 1e-9).unwrap().calculated().length[0];
    let w = (9.81 / l).sqrt() * (1.0 + mu * eps.powf(2.0 / 3.0)).sqrt();
    // The planar branch that exists on both sides of the boundary: above resonance the bob is in antiphase (a < 0), below
    // resonance it is in phase (the smallest positive root).
    let cubic = |a: f64| mu * a + a * a * a / 8.0 + 1.0;
    let (mut low, mut high) = if mu > 0.0 { (-3.0, 0.0) } else { (0.0, 1.6) };
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        let rises = mu > 0.0;
        if (cubic(middle) > 0.0) == rises { high = middle } else { low = middle }
    }
    let amplitude = low * eps.powf(1.0 / 3.0);
    // The hub moves as theta = eps l cos(w t)/r up to a constant, so that omega(0) = 0, and the torque follows
    // from its known inertia.
    let inertia = p.hub.inertia;
    let torque = |t: f64| -inertia * eps * l / p.tank.r * w * w * (w * t).cos();
    p.init.slosh_angle = amplitude;
    p.init.slosh_angle_radial = 1e-5;
    let h = TAU / w / 16.0;
    // Straight lines between the knots of a sine lose (w h)^2/12 of its amplitude; the values at the knots are increased
    // to compensate for this.
    let raise = (w * h / 2.0 / (w * h / 2.0).sin()).powi(2);
    let mut plant = Plant::new(&p, &Inputs::default(), 0.0, 1e-9).unwrap();
    let cycles = 4000;
    let mut largest: f64 = 0.0;
    for k in 0..16 * cycles {
        let (a, b) = (raise * torque(k as f64 * h), raise * torque((k + 1) as f64 * h));
        let inputs = Inputs { tau_cmd: Ramp { value: a, slope: (b - a) / h }, ..Inputs::default() };
        plant.step(&inputs, h).unwrap();
        let out = plant.outputs(&inputs);
        largest = largest.max(out.slosh_angle_radial.abs());
        if largest > 0.1 * amplitude.abs() {
            return true;
        }
    }
    false
}

#[test]
fn forced_pendulum_loses_planar_stability_at_the_analytic_boundaries() {
    // The limits for eps -> 0 are (5/8)(4/3)^(2/3) = 0.75714 and -(3/8) 4^(2/3) = -0.94494. Shooting and Floquet multipliers
    // give 0.760748 and -0.932806 at eps = 1e-3. The initial amplitude has an error of eps^(2/3) = 1 %, and growth near a
    // boundary is slow, so that each boundary is bracketed to 0.02.
    let eps = 1e-3;
    for (stable, unstable) in [(0.7607 + 0.02, 0.7607 - 0.02), (-0.9328 - 0.02, -0.9328 + 0.02)] {
        assert!(!leaves_the_plane(eps, stable), "planar at mu = {stable}");
        assert!(leaves_the_plane(eps, unstable), "not planar at mu = {unstable}");
    }
}

fn swirl(p: &Parameters, frequency: f64, amplitude: f64) -> f64 {
    let h = 0.02;
    let torque = |k: usize| amplitude * (TAU * frequency * k as f64 * h).sin();
    let mut plant = Plant::new(p, &Inputs::default(), 0.0, 1e-8).unwrap();
    let (mut radial, mut tangential): (f64, f64) = (0.0, 0.0);
    for k in 0..20_000 {
        let (a, b) = (torque(k), torque(k + 1));
        let inputs = Inputs { tau_cmd: Ramp { value: a, slope: (b - a) / h }, ..Inputs::default() };
        plant.step(&inputs, h).unwrap();
        if k >= 17_500 {
            let o = plant.outputs(&inputs);
            radial = radial.max(o.slosh_angle_radial.abs());
            tangential = tangential.max(o.slosh_angle.abs());
        }
    }
    radial / tangential
}

#[test]
fn a_steady_sine_makes_slosh_rotary_between_50_and_60_millinewton_metres() {
    // The author of the thesis saw no rotation at 0.05 N m, a weak rotation at 0.075 N m, and a clear rotation from
    // 0.1 N m on (appendix A). Planar motion has a radial component of second order, less than one per cent; rotary
    // motion is a cone.
    for (h, frequency) in [(0.10, 2.435), (0.05, 2.210)] {
        let mut p = bench(SloshModel::Spherical, FrictionModel::Stribeck);
        p.tank.h = h;
        let planar = swirl(&p, frequency, 0.05);
        assert!(planar < 0.02, "{h} m, 0.05 N m: {planar}");
        for amplitude in [0.06, 0.1] {
            let rotary = swirl(&p, frequency, amplitude);
            assert!(rotary > 0.2, "{h} m, {amplitude} N m: {rotary}");
        }
    }
}

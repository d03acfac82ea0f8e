//! Tests of a platform that tilts on a pivot: nutation, coupling of rotation and tilt, and liquid on the platform
//! agree with closed forms.

use std::f64::consts::TAU;

use craft::{
    Craft, Inertia, Inputs, Mount, Parameters, Pivot, PivotFriction, Ramp, STATES, Tank, index,
};
use nalgebra::{Complex, DMatrix, DVector};

use super::component::Spacecraft;

const G: f64 = 9.81;

/// Returns a platform of 12 kg without a tank, whose centre of mass is 0.1 m above the pivot.
fn platform() -> Parameters {
    let j = Inertia { xx: 0.25, yy: 0.25, zz: 0.4, xy: 0.0, xz: 0.0, yz: 0.0 };
    Parameters {
        craft: Craft { mass: 12.0, r: [0.0, 0.0, 0.1], j },
        mount: Mount::Pivot,
        pivot: Pivot { k: [40.0; 2], c: [0.0; 3], ..Pivot::default() },
        gravity: [0.0, 0.0, -G],
        tanks: 0,
        ..Parameters::default()
    }
}

fn tank() -> Tank {
    let mut tank = Tank {
        position: [0.0, 0.0, 0.05],
        m_0: 1.33,
        h_0: 0.03,
        i_0: 0.004,
        g_ref: G,
        damping_law: craft::DampingLaw::Constant,
        ..Tank::default()
    };
    (tank.mass[0], tank.length[0], tank.hinge[0], tank.zeta[0]) = (0.756, 0.0452, 0.06, 0.0);
    tank
}

fn start(p: &Parameters) -> Spacecraft {
    Spacecraft::new(p, &Inputs::default(), 0.0, 1e-12).unwrap()
}

fn tilted([x, y]: [f64; 2]) -> [f64; 4] {
    [1.0, x / 2.0, y / 2.0, 0.0]
}

/// The tilt angles theta = theta_x + i theta_y in rotating axes are phi = theta e^(i W t) in space. They fulfil I
/// phi'' - i I_a W phi' + (k - M g h) phi = 0, where W is the spin, and I and I_a are the moments of inertia about O
/// across and along the axis.
#[test]
fn a_spinning_platform_nutates_and_precesses_at_the_frequencies_of_a_top_on_a_spring() {
    let mut p = platform();
    let (across, along) = (0.25 + 12.0 * 0.01, 0.4);
    let stiffness = 40.0 - 12.0 * G * 0.1;
    for spin in [0.0, 2.0, 30.0] {
        let root = f64::sqrt(along * along * spin * spin + 4.0 * across * stiffness);
        for omega in
            [(along * spin + root) / (2.0 * across), (along * spin - root) / (2.0 * across)]
        {
            // theta = e e^(i (omega - W) t), so that w_x + i w_y = theta' + i W theta = i omega theta.
            let e = 1e-5;
            p.init.q = tilted([e, 0.0]);
            p.init.omega = [0.0, omega * e, spin];
            let mut craft = start(&p);
            for k in 1..=50 {
                craft.step(&Inputs::default(), 0.05).unwrap();
                let out = craft.outputs(&Inputs::default());
                let (sin, cos) = f64::sin_cos((omega - spin) * 0.05 * k as f64);
                let want = [-omega * e * sin, omega * e * cos];
                for i in 0..2 {
                    // The error is quadratic in the tilt, 1e-10.
                    let off = (out.omega[i] - want[i]).abs();
                    assert!(off < 1e-7 * omega.abs() * e, "{spin} {omega} {k}: {off:e}");
                }
            }
        }
    }
}

/// Returns the frequency response of the angular velocities about all axes to the torque about z. It follows from the linear
/// equations x' = A x + B u of the platform at rest.
fn rates_per_torque(p: &Parameters, frequency: f64) -> [Complex<f64>; 3] {
    let mut craft = start(p);
    let column = |craft: &mut Spacecraft, state: Option<usize>| -> [f64; STATES] {
        let (mut dx, mut du) = ([0.0; STATES], [0.0; craft::INPUTS]);
        state.map_or_else(|| du[5] = 1.0, |i| dx[i] = 1.0);
        craft.directional_derivative(&Inputs::default(), &dx, &du)
    };
    let size = index::OMEGA + 3 + 6;
    let places: Vec<usize> = (0..index::OMEGA + 3).chain(index::BOBS..index::BOBS + 6).collect();
    let mut a = DMatrix::<Complex<f64>>::zeros(size, size);
    let s = Complex::new(0.0, TAU * frequency);
    for (j, &of) in places.iter().enumerate() {
        let column = column(&mut craft, Some(of));
        for (i, &to) in places.iter().enumerate() {
            let one = if i == j { s } else { Complex::new(0.0, 0.0) };
            a[(i, j)] = one - column[to];
        }
    }
    let by_torque = column(&mut craft, None);
    let b = DVector::from_fn(size, |i, _| Complex::new(by_torque[places[i]], 0.0));
    let x = a.lu().solve(&b).unwrap();
    [0, 1, 2].map(|i| x[index::OMEGA + i])
}

/// The platform has products of inertia and rests on springs of the stiffness k_x about x and k_y
/// about y. At the angular frequency s, its rates fulfil w_x (k_x - I_xx s^2) = I_xz s^2 w_z, and
/// the analogous equation with w_y. The leakage is the rate across the axis divided by the rate
/// about it, sqrt(w_x^2 + w_y^2)/w_z (Rubaga's thesis, section 6.3.6).
#[test]
fn products_of_inertia_couple_the_rotation_of_a_platform_into_its_tilt() {
    let mut p = platform();
    p.craft.r = [0.0, 0.0, 0.0];
    (p.craft.j.xz, p.craft.j.yz) = (0.02, -0.03);
    p.pivot.k = [40.0, 90.0];
    for frequency in [0.5, 1.0, 1.9, 2.4, 5.0] {
        let s2 = (TAU * frequency).powi(2);
        let [x, y, z] = rates_per_torque(&p, frequency);
        let want = [0.02 * s2 / (40.0 - 0.25 * s2), -0.03 * s2 / (90.0 - 0.25 * s2)];
        for (got, want) in [x / z, y / z].into_iter().zip(want) {
            assert!((got - want).norm() < 1e-12 * want.abs().max(1.0), "{frequency}: {got} {want}");
        }
        // Expected: I_zz s w_z + I_xz s w_x + I_yz s w_y = tau.
        let total = z * 0.4 + x * 0.02 - y * 0.03;
        assert!((total * Complex::new(0.0, s2.sqrt()) - 1.0).norm() < 1e-12);
    }
}

/// If the centre of mass of the platform is at a distance d from the axis, gravity tilts the
/// platform at rest by M g d/(k - M g h), where M is the mass, h the height of the centre of mass,
/// and k the stiffness of the pivot.
#[test]
fn static_imbalance_tilts_the_platform_by_its_moment_over_the_stiffness() {
    let mut p = platform();
    let d = 1e-5;
    p.craft.r[0] = d;
    p.pivot.c = [3.0; 3];
    let mut craft = start(&p);
    craft.step(&Inputs::default(), 60.0).unwrap();
    let out = craft.outputs(&Inputs::default());
    let tilt = 2.0 * out.q[2];
    let want = 12.0 * G * d / (40.0 - 12.0 * G * 0.1);
    assert!((tilt / want - 1.0).abs() < 1e-6, "{tilt} {want}");
    assert!(out.omega.iter().all(|w| w.abs() < 1e-9));
}

/// Platform and bob form a double pendulum with the angles theta of the platform and phi of the
/// rod. The bob is at z theta + l phi. For the natural frequencies omega, (K - omega^2 M)(theta,
/// phi) = 0 with M = [[I + m z^2, m z l], [m z l, m l^2]] and K = diag(k - g (M h + m z), m g l).
#[test]
fn liquid_on_a_tilting_platform_swings_as_a_double_pendulum() {
    let mut p = platform();
    (p.tanks, p.tank[0]) = (1, tank());
    let (m, l) = (0.756, 0.0452);
    let (z, z_0) = (0.05 + 0.06, 0.05 + 0.03);
    let inertia = 0.25 + 12.0 * 0.01 + 0.004 + 1.33 * z_0 * z_0;
    let stiffness = 40.0 - G * (12.0 * 0.1 + 1.33 * z_0 + m * z);
    let a = (inertia + m * z * z) * m * l * l - (m * z * l).powi(2);
    let b = -((inertia + m * z * z) * m * G * l + stiffness * m * l * l);
    let c = stiffness * m * G * l;
    let root = (b * b - 4.0 * a * c).sqrt();
    for omega2 in [(-b - root) / (2.0 * a), (-b + root) / (2.0 * a)] {
        let e = 1e-5;
        let phi = e * m * z * l * omega2 / (m * G * l - m * l * l * omega2);
        p.init.q = tilted([0.0, e]);
        // Relative to the platform the bob hangs at phi + theta.
        p.tank[0].p_0[0] = [phi + e, 0.0, -1.0];
        let mut craft = start(&p);
        craft.step(&Inputs::default(), TAU / omega2.sqrt() * 7.0 / 3.0).unwrap();
        let out = craft.outputs(&Inputs::default());
        // After 7/3 periods each angle is cos(7 2 pi/3) = -1/2 of its start.
        for (got, start) in [(2.0 * out.q[2], e), (out.tank[0].angle_x[0], phi + e)] {
            assert!((got / start + 0.5).abs() < 1e-6, "{omega2}: {got} {start}");
        }
    }
}

/// A platform on a stiff pivot moves almost like the hub in the FMU HubSlosh, which rotates about
/// one axis only. The difference falls as 1/k, where k is the stiffness of the pivot.
#[test]
fn a_platform_on_a_stiff_pivot_moves_as_a_hub_that_rotates_about_one_axis() {
    let u = Inputs { torque: Ramp::held([0.0, 0.0, 0.05]), ..Inputs::default() };
    let turned = |k: f64| {
        let mut p = platform();
        p.tanks = 1;
        p.tank[0] = Tank { position: [0.225, 0.0, 0.05], ..tank() };
        // The tilt is critically damped.
        p.pivot = Pivot { k: [k; 2], c: [1.3 * k.sqrt(), 1.3 * k.sqrt(), 0.0], ..Pivot::default() };
        let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-10).unwrap();
        craft.step(&u, 1.5).unwrap();
        craft.outputs(&u).omega[2]
    };
    // The linear hub: I0 w' = tau + r m g alpha and alpha'' = -(g/l) alpha - (r/l) w'.
    let (i_0, m, l, r) = (0.4 + 1.33 * 0.225 * 0.225, 0.756, 0.0452, 0.225);
    let i = i_0 + m * r * r;
    let omega = (G / l * i / i_0).sqrt();
    let hub = 0.05 / i * 1.5 + 0.05 * (i - i_0) / (i * i_0) * (omega * 1.5).sin() / omega;
    let [soft, stiff] = [1e4, 1e5].map(|k| turned(k) - hub);
    assert!(stiff.abs() < 2e-4 * hub, "{stiff:e} {hub}");
    let limit = turned(1e7);
    let ratio = (turned(1e4) - limit) / (turned(1e5) - limit);
    assert!((ratio - 10.0).abs() < 0.5, "{ratio} {soft:e} {stiff:e}");
}

/// If the platform's rate w is far above `eps`, the width of the smoothed sign function, the
/// friction torque equals the Coulomb torque C to the last bit, so that I w' = -C until the
/// platform stops. From 2 rad/s it stops after 2 I/C = 16 s.
#[test]
fn coulomb_friction_stops_a_platform_and_holds_it() {
    let mut p = platform();
    p.pivot.friction = PivotFriction { c: [0.0, 0.0, 0.05], ..PivotFriction::default() };
    p.init.omega = [0.0, 0.0, 2.0];
    let mut craft = start(&p);
    for k in 1..=15 {
        craft.step(&Inputs::default(), 1.0).unwrap();
        let out = craft.outputs(&Inputs::default());
        let want = 2.0 - 0.05 / 0.4 * f64::from(k);
        assert!((out.omega[2] - want).abs() < 1e-12, "{k}: {} {want}", out.omega[2]);
        assert_eq!(out.pivot_torque, [0.0, 0.0, -0.05]);
        let lost = 0.4 * (2.0 * 2.0 - want * want) / 2.0;
        assert!((out.dissipated - lost).abs() < 1e-11, "{k}: {} {lost}", out.dissipated);
    }
    // Within eps, 1e-3 rad/s, the rate decays with the time constant I eps/C = 8 ms.
    craft.step(&Inputs::default(), 2.0).unwrap();
    let out = craft.outputs(&Inputs::default());
    assert!(out.omega[2].abs() < 1e-20, "{}", out.omega[2]);
}

/// The platform follows the friction law r = (C + D exp(-(w/w_s)^2)) tanh(w/eps) as in a separate simulator, which
/// integrates I w' = tau - c w - r by classical Runge-Kutta in steps of eps I/(C + D)/20. The error of this simulator
/// is below 1e-9 rad/s.
#[test]
fn a_platform_under_an_oscillating_torque_follows_stribecks_law() {
    let (mut p, i_z, tau, w) = (platform(), 0.4, 0.12, 3.0);
    let friction =
        PivotFriction { c: [0.0, 0.0, 0.03], d: [0.0, 0.0, 0.02], omega_s: 0.05, eps: 5e-3 };
    (p.pivot.friction, p.pivot.c[2]) = (friction, 0.02);
    let rate = |t: f64, x: f64| {
        let r = (0.03 + 0.02 * (-(x / 0.05) * (x / 0.05)).exp()) * (x / 5e-3).tanh();
        (tau * (w * t).sin() - 0.02 * x - r) / i_z
    };
    let mut craft = start(&p);
    let (mut x, mut t, h) = (0.0, 0.0, 2e-4);
    let mut most: f64 = 0.0;
    for k in 0..2000 {
        // The torque on the craft is linear within its steps of 2 ms, which differs from the sine by tau w^2
        // h^2/8 = 4e-7 N m.
        let at = |k: i32| tau * (w * 2e-3 * f64::from(k)).sin();
        let slope = (at(k + 1) - at(k)) / 2e-3;
        let torque = Ramp { value: [0.0, 0.0, at(k)], slope: [0.0, 0.0, slope] };
        craft.step(&Inputs { torque, ..Inputs::default() }, 2e-3).unwrap();
        for _ in 0..10 {
            let k1 = rate(t, x);
            let k2 = rate(t + h / 2.0, x + h / 2.0 * k1);
            let k3 = rate(t + h / 2.0, x + h / 2.0 * k2);
            let k4 = rate(t + h, x + h * k3);
            x += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
            t += h;
        }
        most = most.max(x.abs());
        let got = craft.outputs(&Inputs::default()).omega[2];
        // The tolerance is the effect of 4e-7 N m on I over half a cycle of the torque.
        assert!((got - x).abs() < 1e-6, "{t}: {got} {x}");
    }
    assert!(most > 0.05, "the rate must exceed w_s, but its maximum is {most}");
}

#[test]
fn pivot_parameters_do_not_change_a_free_craft() {
    let run = |pivot: Pivot| {
        let p = Parameters { pivot, ..Parameters::default() };
        let mut craft = start(&p);
        craft.step(&Inputs::default(), 3.0).unwrap();
        craft.continuous_states().map(f64::to_bits)
    };
    assert_eq!(
        run(Pivot::default()),
        run(Pivot { k: [5.0, 6.0], c: [1.0; 3], ..Pivot::default() })
    );
}

/// The platform has the data of the bench in book/tilting.md. The leakage is the rate across the
/// axis divided by the rate about it; the test computes its root mean square from 1.25 to 3.5 Hz by
/// linear equations. With a damping ratio of 0.03 `hubslosh analyse` finds 0.0419 from the rates of
/// a sweep at 0.0125 N m. With a damping ratio of 0.003 it finds 0.125 instead of 0.135, because a
/// sweep smooths the tip of the antiresonance, which is 0.014 Hz wide.
#[test]
fn the_leakage_of_the_books_platform_equals_that_of_its_linear_equations() {
    let j = Inertia { xx: 0.22, yy: 0.25, zz: 0.304, xy: 0.0, xz: 0.004, yz: -0.006 };
    let mut p = Parameters {
        craft: Craft { mass: 12.0, r: [-0.039, 0.0, 0.05], j },
        pivot: Pivot { k: [600.0; 2], c: [0.5, 0.5, 0.03793], ..Pivot::default() },
        tanks: 1,
        ..platform()
    };
    let upright = Tank { position: [0.225, 0.0, 0.05], diameter: 0.163, depth: 0.1, ..tank() };
    p.tank[0] = upright;
    let mut leakage = |zeta: f64| {
        p.tank[0].zeta = [zeta; craft::MODES];
        rms(&p)
    };
    let [sharp, blunt] = [0.003, 0.03].map(&mut leakage);
    assert!((blunt / 0.0419 - 1.0).abs() < 5e-3, "{blunt}");
    assert!((sharp / 0.135 - 1.0).abs() < 5e-3, "{sharp}");
}

/// Returns the root mean square of the leakage on a logarithmic frequency grid from 1.25 to 3.5 Hz.
fn rms(p: &Parameters) -> f64 {
    let squares: f64 = (0..2000)
        .map(|k| {
            let [x, y, z] = rates_per_torque(p, 1.25 * (3.5 / 1.25_f64).powf(k as f64 / 1999.0));
            (x.norm_sqr() + y.norm_sqr()) / z.norm_sqr()
        })
        .sum();
    (squares / 2000.0).sqrt()
}

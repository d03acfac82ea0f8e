//! Small motions about steady thrust: poles, zeros and unstable slosh locations (danger zone) of the attitude loop, computed
//! from directional derivatives, equal closed forms.
//!
//! All heights are from the centre of mass of the rigid part R (dry craft and rigid liquid), which has the mass M and the
//! transverse inertia I about this centre. The hinge is at the height h, the bob at b = h - l, and a lateral force acts at z_f:
//!
//! ```text
//! w_0^2 = g/l + k/m,  sigma = 1 + m/M + m b^2/I
//! pole               w_p^2 = w_0^2 sigma + m b g/I,         2 zeta_p w_p = (c/m) sigma
//! zero of theta/tau  w_z^2 = w_0^2 (1 + m/M)
//! zero of theta/f    w_z^2 = w_0^2 (1 + (m/M)(1 - b/z_f)) - (m/M) g/z_f
//! ```
//!
//! Source: Lagrange's equations of lateral and pitch motion with one pendulum.

use craft::{DampingLaw, INPUTS, Inertia, Inputs, Parameters, Ramp, STATES, Tank, index};
use nalgebra::{Complex, DMatrix, Matrix4, Vector4};

use super::component::Spacecraft;
use super::records::{parameters, record};

const PITCH_RATE: usize = index::OMEGA + 1;
const SLOSH: usize = index::bob(0, 0);
const SLOSH_RATE: usize = SLOSH + 3;

const THRUST: f64 = 2400.0;

fn inputs() -> Inputs {
    Inputs { force: Ramp::held([0.0, 0.0, THRUST]), ..Inputs::default() }
}

fn craft_with_tank_at(z: f64, k: f64, c: f64) -> Parameters {
    let j = Inertia { xx: 860.0, yy: 860.0, zz: 640.0, xy: 0.0, xz: 0.0, yz: 0.0 };
    let mut p = Parameters::default();
    p.craft.j = j;
    let law = DampingLaw::Constant;
    let mut tank = Tank { position: [0.0, 0.0, z], damping_law: law, ..Tank::default() };
    tank.k[0] = k;
    tank.zeta[0] = 0.5;
    tank.zeta[0] *= c / tank.drag(0);
    p.tank[0] = tank;
    p
}

struct Closed {
    m: f64,
    mass: f64,
    inertia: f64,
    g: f64,
    h: f64,
    b: f64,
    w_0_2: f64,
    sigma: f64,
    center: f64,
}

impl Closed {
    fn new(p: &Parameters) -> Closed {
        let (tank, craft) = (&p.tank[0], &p.craft);
        let mass = craft.mass + tank.m_0;
        let z_0 = tank.position[2] + tank.h_0;
        let center = (craft.mass * craft.r[2] + tank.m_0 * z_0) / mass;
        let inertia = craft.j.yy
            + craft.mass * (craft.r[2] - center).powi(2)
            + tank.i_0
            + tank.m_0 * (z_0 - center).powi(2);
        let (m, l) = (tank.mass[0], tank.length[0]);
        let h = tank.position[2] + tank.hinge[0] - center;
        let b = h - l;
        let g = THRUST / (mass + m);
        let sigma = 1.0 + m / mass + m * b * b / inertia;
        Closed { m, mass, inertia, g, h, b, w_0_2: g / l + tank.k[0] / m, sigma, center }
    }

    fn pole(&self) -> f64 {
        self.w_0_2 * self.sigma + self.m * self.b * self.g / self.inertia
    }

    fn zero_of_torque(&self) -> f64 {
        self.w_0_2 * (1.0 + self.m / self.mass)
    }

    fn zero_of_force(&self, z_f: f64) -> f64 {
        let ratio = self.m / self.mass;
        self.w_0_2 * (1.0 + ratio * (1.0 - self.b / z_f)) - ratio * self.g / z_f
    }
}

/// Returns the derivatives of the pitch acceleration w_y' and of the first bob's p_x'' with respect to one state or, if `state`
/// is `None`, in the direction `du` of the inputs.
fn column(craft: &mut Spacecraft, state: Option<usize>, du: [f64; INPUTS]) -> [f64; 2] {
    let mut dx = [0.0; STATES];
    if let Some(at) = state {
        dx[at] = 1.0;
    }
    let rate = craft.directional_derivative(&inputs(), &dx, &du);
    [rate[PITCH_RATE], rate[SLOSH_RATE]]
}

/// Returns three numbers of the linearised craft: the squared frequency of the slosh pole, the
/// pole's damping 2 zeta_p w_p, and the squared frequency of the zero in the response of the pitch
/// angle theta to inputs in the direction `du`.
fn pole_and_zero(p: &Parameters, du: [f64; INPUTS]) -> [f64; 3] {
    let mut craft = Spacecraft::new(p, &inputs(), 0.0, 1e-9).unwrap();
    let [alpha, gamma] = column(&mut craft, Some(SLOSH), [0.0; INPUTS]);
    let [_, delta] = column(&mut craft, Some(SLOSH_RATE), [0.0; INPUTS]);
    let [b_w, b_p] = column(&mut craft, None, du);
    // The equations are p'' = gamma p + delta p' + b_p u and w' = alpha p + ... + b_w u. Without damping w/u = 0 at s^2 =
    // gamma - alpha b_p/b_w.
    [-gamma, -delta, -(gamma - alpha * b_p / b_w)]
}

fn torque() -> [f64; INPUTS] {
    let mut du = [0.0; INPUTS];
    du[4] = 1.0;
    du
}

fn force_at(z: f64) -> [f64; INPUTS] {
    let mut du = [0.0; INPUTS];
    (du[0], du[4]) = (1.0, z);
    du
}

fn assert_close(got: f64, want: f64, tolerance: f64) {
    assert!((got / want - 1.0).abs() < tolerance, "{got} {want}");
}

/// The computed poles and zeros agree with their closed forms, and with numbers of 10 to 13 digits
/// that were computed independently of this code.
#[test]
fn poles_and_zeros_are_the_closed_forms_with_and_without_centring_stiffness() {
    let numbers = [
        (0.0, 6.984054254358, 6.749874426933, 6.585310119655),
        (60.0, 7.522104916008, 7.259708796089, 7.075316159962),
    ];
    for (k, pole, zero_of_torque, zero_of_force) in numbers {
        let p = craft_with_tank_at(-0.45, k, 0.0);
        let closed = Closed::new(&p);
        let [got_pole, _, by_torque] = pole_and_zero(&p, torque());
        let [_, _, by_force] = pole_and_zero(&p, force_at(-1.3));
        for (got, closed, number) in [
            (got_pole, closed.pole(), pole),
            (by_torque, closed.zero_of_torque(), zero_of_torque),
            (by_force, closed.zero_of_force(-1.3 - closed.center), zero_of_force),
        ] {
            assert_close(got, closed, 1e-12);
            assert_close(got, number, 1e-11);
        }
    }
}

#[test]
fn a_damped_slosh_pole_equals_the_closed_form() {
    let c = 31.9467;
    let p = craft_with_tank_at(-0.45, 0.0, c);
    let closed = Closed::new(&p);
    let [w_2, damping, _] = pole_and_zero(&p, torque());
    assert_close(damping, c / closed.m * closed.sigma, 1e-12);
    // The reference pole is -0.14324119 +- 2.63885131 i, of which nine digits are known.
    assert_close(damping / 2.0, 0.14324119, 1e-7);
    assert_close(f64::sqrt(w_2 - damping * damping / 4.0), 2.63885131, 1e-8);
}

/// Returns -p_x''/p_x, the squared frequency, of a mode in a craft that is too heavy to move and accelerates by g.
fn frequency_2(tank: Tank, g: f64) -> f64 {
    let mut p = Parameters::default();
    let heavy = 1e11;
    p.craft.mass = heavy;
    p.craft.j = Inertia { xx: heavy, yy: heavy, zz: heavy, xy: 0.0, xz: 0.0, yz: 0.0 };
    p.tank[0] = tank;
    let force = Ramp::held([0.0, 0.0, heavy * g]);
    let u = Inputs { force, ..Inputs::default() };
    let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
    let mut dx = [0.0; STATES];
    dx[SLOSH] = 1.0;
    -craft.directional_derivative(&u, &dx, &[0.0; INPUTS])[SLOSH_RATE]
}

/// The tank's slosh mass of 382 kg moves the craft of 1e11 kg a little, which changes the squared
/// frequency by the fraction 4e-9.
#[test]
fn a_slosh_mode_oscillates_at_the_frequency_given_as_parameter() {
    for k in [0.0, 60.0] {
        let mut tank = Tank { g_ref: 2.0, damping_law: DampingLaw::Constant, ..Tank::default() };
        (tank.k[0], tank.frequency[0]) = (k, 0.5);
        let w_2 = f64::powi(std::f64::consts::TAU * 0.5, 2);
        assert_close(frequency_2(tank, 2.0), w_2, 1e-8);
        // The part k/m of the squared frequency is the same at any acceleration.
        let m = tank.mass[0];
        assert_close(frequency_2(tank, 4.0), 2.0 * (w_2 - k / m) + k / m, 1e-8);
    }
}

#[test]
fn centring_stiffness_restores_the_slosh_mass_in_weightlessness() {
    let mut tank = Tank::default();
    tank.k[0] = 60.0;
    assert_close(frequency_2(tank, 0.0), 60.0 / tank.mass[0], 1e-8);
}

/// Two equal tanks are at +-r from the axis e of a torque. The squared antiresonance (zero) is
/// w_0^2, the squared frequency of the mode, and the squared resonance (pole) is w_0^2 (1 + 2 m
/// r^2/I_z), at any centring stiffness k.
#[test]
fn opposite_tanks_have_the_bench_s_antiresonance_and_resonance_in_yaw() {
    for (k, pole_given) in [(0.0, 9.785768250592), (30.0, 10.462710224511)] {
        let mut p = parameters(&record("two_tanks"));
        p.craft.r = [0.0, 0.0, 0.21];
        (p.craft.j.xy, p.craft.j.xz, p.craft.j.yz) = (0.0, 0.0, 0.0);
        for tank in &mut p.tank {
            (tank.zeta[0], tank.k[0]) = (0.0, k);
        }
        let u = Inputs { force: Ramp::held([0.0, 0.0, 2450.0]), ..Inputs::default() };
        let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
        // In this mode of motion the bobs swing in opposite directions along y.
        let at = [index::bob(0, 0) + 1, index::bob(1, 0) + 1];
        let mut dx = [0.0; STATES];
        (dx[at[0]], dx[at[1]]) = (1.0, -1.0);
        let rate = craft.directional_derivative(&u, &dx, &[0.0; INPUTS]);
        let [alpha, gamma] = [rate[index::OMEGA + 2], rate[at[0] + 3]];
        assert!((rate[at[1] + 3] + gamma).abs() < 1e-13 * gamma.abs());
        let mut du = [0.0; INPUTS];
        du[5] = 1.0;
        let rate = craft.directional_derivative(&u, &[0.0; STATES], &du);
        let [b_w, b_p] = [rate[index::OMEGA + 2], rate[at[0] + 3]];
        let (pole, zero) = (-gamma, -(gamma - alpha * b_p / b_w));

        let (tank, m) = (&p.tank[0], p.tank[0].mass[0]);
        let mass = p.craft.mass + 2.0 * (tank.m_0 + m);
        let w_0_2 = 2450.0 / mass / tank.length[0] + k / m;
        let r = tank.position[0];
        let i_z = p.craft.j.zz + 2.0 * (tank.i_z + tank.m_0 * r * r);
        assert_close(zero, w_0_2, 1e-12);
        assert_close(pole, w_0_2 * (1.0 + 2.0 * m * r * r / i_z), 1e-12);
        assert_close(pole, pole_given, 1e-12);
        if k == 0.0 {
            assert_close(zero, 9.327735730076, 1e-12);
        }
    }
}

/// Gains of the attitude loop divided by the inertia: K_p/I, 1/s2, and K_d/I, 1/s. The loop has a natural frequency of 0.2
/// rad/s and the damping ratio 0.7.
const K_P: f64 = 0.04;
const K_D: f64 = 0.28;

/// Height of the point at which the lateral force acts, above O, m.
const ENGINE: f64 = -1.3;

/// Returns the growth rate of the slosh pole, 1/s, in an attitude loop, for a tank at the height
/// `z`, m, and the drag coefficient `c`, kg/s. The loop demands the torque tau = -K_p theta - K_d
/// theta', which a lateral force f at the engine exerts: tau = (z_f - center) f.
fn growth(z: f64, c: f64) -> f64 {
    let p = craft_with_tank_at(z, 0.0, c);
    let closed = Closed::new(&p);
    let mut craft = Spacecraft::new(&p, &inputs(), 0.0, 1e-9).unwrap();
    let by = |craft: &mut Spacecraft, at| column(craft, Some(at), [0.0; INPUTS]);
    let [a_wp, a_pp] = by(&mut craft, SLOSH);
    let [a_wd, a_pd] = by(&mut craft, SLOSH_RATE);
    // Attitude and a slow rotation of the craft do not change the rates, so that their columns need not be computed.
    for at in [index::Q + 2, PITCH_RATE] {
        assert!(by(&mut craft, at).iter().all(|x| x.abs() < 1e-13));
    }
    let [b_w, b_p] = column(&mut craft, None, force_at(ENGINE));
    let gain = closed.inertia / (ENGINE - closed.center);
    // The states are theta, w, p and p'.
    let open = Matrix4::new(
        0.0, 1.0, 0.0, 0.0, //
        0.0, 0.0, a_wp, a_wd, //
        0.0, 0.0, 0.0, 1.0, //
        0.0, 0.0, a_pp, a_pd,
    );
    let force = Vector4::new(0.0, b_w, 0.0, b_p);
    let feedback = Vector4::new(-K_P * gain, -K_D * gain, 0.0, 0.0);
    let closed_loop = open + force * feedback.transpose();
    let poles = closed_loop.complex_eigenvalues();
    // The slosh poles have the largest magnitude.
    poles.iter().max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap().re
}

/// Returns the growth rate of the slosh pole in an attitude loop, 1/s, for a tank at the height
/// `z`, to first order in the gains: K_d (w_z^2 - w_p^2)/(2 I w_p^2) with the frequencies w_p of
/// the pole and w_z of the zero.
fn predicted_growth(z: f64) -> f64 {
    let closed = Closed::new(&craft_with_tank_at(z, 0.0, 0.0));
    let (zero, pole) = (closed.zero_of_force(ENGINE - closed.center), closed.pole());
    K_D * (zero - pole) / (2.0 * pole)
}

/// The expected growth rates, 1/s, with five digits, were computed independently of this code.
#[test]
fn the_growth_rate_of_the_slosh_pole_in_an_attitude_loop_equals_the_analytic_one() {
    for (z, expected) in [
        (-1.60, -3.1726e-2),
        (-0.45, -7.9994e-3),
        (0.14, 7.6250e-4),
        (0.20, 1.1911e-3),
        (0.50, 1.8675e-3),
        (0.80, 4.5618e-4),
        (1.20, -3.2389e-3),
    ] {
        // The tolerance is half a unit of the fifth digit.
        assert_close(growth(z, 0.0), expected, 5e-5);
    }
}

fn root(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let sign = f(low).signum();
    assert!(f(high).signum() != sign);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if f(middle).signum() == sign { low = middle } else { high = middle }
    }
    low
}

/// R is the craft without the slosh mass. The loop is unstable if the hinge is above the centre of
/// mass of R (h > 0) and the bob is below the centre of percussion of R (b < I/(M |z_f|)); see the
/// module's head. The computed ends of this danger zone agree with both conditions within 1 % of
/// its length.
#[test]
fn danger_zone_lies_between_centre_of_mass_and_centre_of_percussion() {
    let at = |z: f64| Closed::new(&craft_with_tank_at(z, 0.0, 0.0));
    let percussion = |z: f64| {
        let closed = at(z);
        closed.b - closed.inertia / (closed.mass * (closed.center - ENGINE))
    };
    let predicted = [root(|z| at(z).h, -0.4, 0.5), root(percussion, 0.5, 1.2)];
    let found = [root(|z| growth(z, 0.0), -0.4, 0.5), root(|z| growth(z, 0.0), 0.5, 1.2)];
    let length = predicted[1] - predicted[0];
    for (predicted, found) in predicted.iter().zip(found) {
        assert!((predicted - found).abs() < 0.01 * length, "{predicted} {found} of {length}");
    }
}

/// The loop is stable if the damping of the slosh pole, zeta_p w_p = (c/m) sigma/2, exceeds the
/// pole's growth rate without drag (symbols of the module's head).
#[test]
fn the_damping_that_stabilises_a_slosh_pole_is_predicted_to_5_percent() {
    for z in [0.2, 0.35, 0.5, 0.65] {
        let closed = Closed::new(&craft_with_tank_at(z, 0.0, 0.0));
        let predicted = 2.0 * predicted_growth(z) * closed.m / closed.sigma;
        let needed = root(|c| growth(z, c), 0.0, 10.0);
        assert_close(needed, predicted, 0.05);
    }
}

/// A prolate spinner has liquid at +-x. The nutation grows because the liquid dissipates energy, at the rate of the
/// eigenvalue of an independent linearisation, 0.002551418 +- 0.468308812 i.
#[test]
fn nutation_of_a_prolate_spinner_grows_at_the_analytic_rate() {
    let mut p = parameters(&record("spinner"));
    p.init.omega = [0.0, 0.0, 1.1];
    let u = Inputs::default();
    let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
    let start = craft.continuous_states();
    // The linear system has these states: w, and p and p' of both bobs.
    let places: Vec<usize> = (index::OMEGA..index::OMEGA + 3)
        .chain([0, 1].iter().flat_map(|&i| index::bob(i, 0)..index::bob(i, 0) + 6))
        .collect();
    // Trim: Newton's method with exact derivatives rotates the spin axis and the bobs until w' perpendicular to the spin
    // axis and p'' perpendicular to the rods vanish.
    let bobs = [0, 1].map(|i| index::bob(i, 0));
    let free = [index::OMEGA, index::OMEGA + 1, bobs[0], bobs[0] + 1, bobs[1], bobs[1] + 1];
    let rates =
        [index::OMEGA, index::OMEGA + 1, bobs[0] + 3, bobs[0] + 4, bobs[1] + 3, bobs[1] + 4];
    let mut x = start;
    for _ in 0..20 {
        craft.set_continuous_states(&x);
        let now = craft.derivatives(&u);
        let jacobian = DMatrix::from_fn(6, 6, |i, k| {
            let mut dx = [0.0; STATES];
            dx[free[k]] = 1.0;
            craft.directional_derivative(&u, &dx, &[0.0; INPUTS])[rates[i]]
        });
        let residual = nalgebra::DVector::from_fn(6, |i, _| now[rates[i]]);
        let change = jacobian.lu().solve(&residual).unwrap();
        for (at, change) in free.iter().zip(&change) {
            x[*at] -= change;
        }
        for at in bobs {
            let size = x[at..at + 3].iter().map(|x| x * x).sum::<f64>().sqrt();
            x[at..at + 3].iter_mut().for_each(|x| *x /= size);
        }
    }
    craft.set_continuous_states(&x);
    let now = craft.derivatives(&u);
    assert!(rates.iter().all(|&at| now[at].abs() < 1e-13));
    let n = places.len();
    let a = DMatrix::from_fn(n, n, |i, k| {
        let mut dx = [0.0; STATES];
        dx[places[k]] = 1.0;
        craft.directional_derivative(&u, &dx, &[0.0; INPUTS])[places[i]]
    });
    let given = Complex::new(0.002551418, 0.468308812);
    let nearest = a
        .complex_eigenvalues()
        .iter()
        .map(|pole| (pole - given).norm())
        .fold(f64::INFINITY, f64::min);
    // The tolerance is half a unit of the ninth decimal, plus the rounding error of an eigenvalue.
    assert!(nearest < 2e-9, "{nearest}");
}

//! Tests of flexible appendages: Lagrange's equations of each mode, a hub with beams whose frequencies are known in closed
//! form, and a hinged panel. Other files test random craft with appendages: independent.rs against Newton's law, balances.rs
//! for momentum and energy, and equations.rs for derivatives.

use craft::{APPENDAGES, Appendage, Craft, Inertia, Inputs, Parameters, Ramp, STATES, index};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use super::component::Spacecraft;
use super::random::Random;

type V = Vector3<f64>;

fn v(x: &[f64]) -> V {
    V::new(x[0], x[1], x[2])
}

fn motion(x: &[f64; STATES]) -> [V; 2] {
    let q = UnitQuaternion::from_quaternion(Quaternion::new(x[0], x[1], x[2], x[3]));
    let axes: Rotation3<f64> = q.into();
    [axes.inverse() * v(&x[index::VELOCITY..]), v(&x[index::OMEGA..])]
}

/// Returns the Lagrangian of a dry craft with appendages, that is, the kinetic energy of the undeformed craft, plus the energy
/// from each mode's motion y = p eta relative to its interface point, plus the modes' own kinetic minus elastic energies.
fn lagrangian(p: &Parameters, x: &[f64; STATES]) -> f64 {
    let [velocity, w] = motion(x);
    let center = velocity + w.cross(&v(&p.craft.r));
    let j = p.craft.j.matrix();
    let spin = w.dot(&(Matrix3::from_fn(|i, k| j[i][k]) * w));
    let mut sum = (p.craft.mass * center.norm_squared() + spin) / 2.0;
    for (k, mode) in p.appendage[..p.appendages].iter().enumerate() {
        let (eta, rate) = (x[index::ETA + k], x[index::ETA_DOT + k]);
        let (along, about) = (v(&mode.participation), v(&mode.participation[3..]));
        let at_interface = velocity + w.cross(&v(&mode.position));
        let omega = std::f64::consts::TAU * mode.frequency;
        sum += at_interface.dot(&(along * rate + w.cross(&along) * eta)) + w.dot(&about) * rate;
        sum += (rate * rate - (omega * eta).powi(2)) / 2.0;
    }
    sum
}

fn difference(f: impl Fn(f64) -> f64, step: f64) -> f64 {
    let [p2, p1, m1, m2] = [2.0, 1.0, -1.0, -2.0].map(|s| f(s * step));
    (8.0 * (p1 - m1) - (p2 - m2)) / (12.0 * step)
}

/// In random craft with appendages, eta'' + 2 zeta omega eta' + omega^2 eta equals minus the product of the participation
/// vector and the acceleration of the craft.
#[test]
fn each_appendage_mode_follows_lagranges_equation() {
    for seed in 0..50 {
        let mut random = Random::new(seed);
        let mut p = Parameters { tanks: 0, ..random.parameters() };
        random.flex(&mut p);
        let u = Inputs { force: Ramp::held(random.vector(100.0)), ..Inputs::default() };
        let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-13).unwrap();
        let (x, rate) = (craft.continuous_states(), craft.derivatives(&u));
        for k in 0..p.appendages {
            let along = |x: &[f64; STATES], at: usize| {
                let moved = |s: f64| {
                    let mut x = *x;
                    x[at] += s;
                    lagrangian(&p, &x)
                };
                difference(moved, 1e-2)
            };
            // The time derivative of the generalised momentum dL/d(eta') along the motion.
            let momentum = |t: f64| {
                let moved = std::array::from_fn(|i| x[i] + t * rate[i]);
                along(&moved, index::ETA_DOT + k)
            };
            let mode = &p.appendage[k];
            let omega = std::f64::consts::TAU * mode.frequency;
            let drag = 2.0 * mode.zeta * omega * x[index::ETA_DOT + k];
            let force = along(&x, index::ETA + k) - drag;
            let off = difference(momentum, 1e-3) - force;
            let size = 1.0 + force.abs() + rate[index::ETA_DOT + k].abs();
            assert!(off.abs() < 1e-7 * size, "{seed} mode {k}: {off:e} of {size}");
        }
        let out = craft.outputs(&u);
        let stored: f64 = (0..p.appendages)
            .map(|k| (std::f64::consts::TAU * p.appendage[k].frequency * x[index::ETA + k]).powi(2))
            .sum();
        let energy = lagrangian(&p, &x) + stored;
        assert!((out.energy - energy).abs() < 1e-12 * energy.abs().max(stored), "{seed}");
    }
}

/// Returns eigenvalue n of a clamped-free beam: the root of cos l cosh l = -1 near (n - 1/2) pi.
fn eigenvalue(n: usize) -> f64 {
    let near = (n as f64 + 0.5) * std::f64::consts::PI;
    (0..50).fold(if n == 0 { 1.8751 } else { near }, |l, _| {
        // Newton's method for f = cos l + 1/cosh l.
        l - (l.cos() + 1.0 / l.cosh()) / (-l.sin() - l.tanh() / l.cosh())
    })
}

/// Returns mode n of a beam that is clamped at `root`, lies along x and bends along y, with mass m, length L and
/// first frequency f. With the eigenvalue l of the mode, the integrals of phi dm and x phi dm are 2 sigma/l sqrt(m)
/// and 2/l^2 L sqrt(m).
fn beam(n: usize, m: f64, length: f64, f: f64, root: f64) -> Appendage {
    let l = eigenvalue(n);
    let sigma = (l.sinh() - l.sin()) / (l.cosh() + l.cos());
    let [along, about] = [2.0 * sigma / l, 2.0 * length / (l * l)].map(|x| x * m.sqrt());
    Appendage {
        position: [root, 0.0, 0.0],
        frequency: f * (l / eigenvalue(0)).powi(2),
        zeta: 0.0,
        participation: [0.0, along, 0.0, 0.0, 0.0, root.signum() * about],
        ..Appendage::default()
    }
}

/// Returns the free-free frequencies, rad/s, of a craft that moves along y and rotates about z, up to the frequency of the
/// highest mode, and the amplitudes of the modes. The frequencies are the roots of det(M + sum of u u^T w^2/(w_n^2 - w^2)).
fn free_free(p: &Parameters) -> Vec<(f64, Vec<f64>)> {
    let (m, [x, ..]) = (p.craft.mass, p.craft.r);
    let modes: Vec<([f64; 2], f64)> = p.appendage[..p.appendages]
        .iter()
        .map(|mode| {
            let [_, along, .., about] = mode.participation;
            let turned = about + mode.position[0] * along;
            ([along, turned], std::f64::consts::TAU * mode.frequency)
        })
        .collect();
    let matrix = |w: f64| {
        let mut a = [m, m * x, p.craft.j.zz + m * x * x];
        for ([along, about], w_n) in &modes {
            let gain = w * w / (w_n * w_n - w * w);
            a[0] += gain * along * along;
            a[1] += gain * along * about;
            a[2] += gain * about * about;
        }
        a
    };
    let determinant = |w: f64| {
        let [a, b, c] = matrix(w);
        // The product removes the poles of the determinant.
        modes.iter().fold(a * c - b * b, |d, (_, w_n)| d * (1.0 - (w / w_n).powi(2)))
    };
    let top = modes.iter().fold(0.0_f64, |top, (_, w)| top.max(*w));
    let grid: Vec<f64> = (1..200_000).map(|k| top * k as f64 / 200_000.0).collect();
    let mut found = Vec::new();
    for pair in grid.windows(2) {
        let (mut low, mut high) = (pair[0], pair[1]);
        if determinant(low).signum() == determinant(high).signum() {
            continue;
        }
        for _ in 0..60 {
            let middle = (low + high) / 2.0;
            if determinant(middle).signum() == determinant(low).signum() {
                low = middle;
            } else {
                high = middle;
            }
        }
        let w = (low + high) / 2.0;
        // A root at a clamped frequency is left out, because the craft does not move at this frequency and the
        // determinant has no pole.
        if modes.iter().all(|(_, w_n)| (w / w_n - 1.0).abs() > 1e-6) {
            let [a, b, c] = matrix(w);
            let moves = if a.abs() > c.abs() { [-b, a] } else { [c, -b] };
            let amplitude = |([along, about], w_n): &([f64; 2], f64)| {
                (along * moves[0] + about * moves[1]) * w * w / (w_n * w_n - w * w)
            };
            found.push((w, modes.iter().map(amplitude).collect()));
        }
    }
    found
}

/// The craft is a hub with two beams of three modes each, or with one beam of six modes. Each of its free-free modes is
/// released at rest and has to oscillate for ten periods with a frequency that is a root of the characteristic equation.
#[test]
fn a_hub_with_beams_swings_at_the_roots_of_its_characteristic_equation() {
    for sides in [2, 1] {
        let j = Inertia { xx: 60.0, yy: 980.0, zz: 1000.0, xy: 0.0, xz: 0.0, yz: 0.0 };
        let off = if sides == 1 { 0.4 } else { 0.0 };
        let craft = Craft { mass: 350.0, r: [off, 0.0, 0.0], j };
        let mut p = Parameters { craft, tanks: 0, appendages: 6, ..Parameters::default() };
        for (k, mode) in p.appendage.iter_mut().enumerate() {
            let root = if k % sides == 0 { 0.9 } else { -0.9 };
            *mode = beam(k / sides, 30.0, 4.0, 0.15, root);
        }
        let roots = free_free(&p);
        // With two beams, half of the modes rotate the hub, and the other half translate it.
        assert_eq!(roots.len(), if sides == 2 { 4 } else { 5 }, "{roots:?}");
        for (w, amplitude) in roots {
            let largest = amplitude.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            let size = 1e-6 / largest;
            let mut p = p;
            for (mode, amplitude) in p.appendage.iter_mut().zip(&amplitude) {
                mode.eta = amplitude * size;
            }
            let u = Inputs::default();
            let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-13).unwrap();
            let step = std::f64::consts::TAU / w * 10.3 / 50.0;
            for k in 1..=50 {
                craft.step(&u, step).unwrap();
                let x = craft.continuous_states();
                let phase = w * step * f64::from(k);
                for (n, amplitude) in amplitude.iter().enumerate() {
                    let want = amplitude * size * phase.cos();
                    let got = x[index::ETA + n];
                    assert!((got - want).abs() < 1e-9 * 1e-6, "{sides} {w} {n}: {got:e} {want:e}");
                }
            }
        }
    }
}

/// A hub and a rigid panel on a hinge with a spring, in plane motion: mass and inertia of the hub, mass `m` of the panel,
/// distance `d` of the panel's centre from the hinge, inertia of the panel about its centre, position of the hinge on the
/// hub's x axis, stiffness and damping of the spring.
struct Panel {
    hub: [f64; 2],
    m: f64,
    d: f64,
    inertia: f64,
    hinge: f64,
    k: f64,
    c: f64,
}

impl Panel {
    /// Returns the time derivatives of the eight states. The states are x, y and angle of the hub and the angle of the panel, and
    /// then the rates of these four. The equations are those of two rigid bodies at any angle. `force` along the hub's y axis and
    /// `torque` act on the hub.
    fn rates(&self, z: &[f64; 8], force: f64, torque: f64) -> [f64; 8] {
        let Panel { hub: [mass, j], m, d, inertia, hinge, k, c } = *self;
        let [_, _, angle, bend, _, _, turn, swing] = *z;
        let (sin, cos) = angle.sin_cos();
        let (sin_p, cos_p) = (angle + bend).sin_cos();
        let both = turn + swing;
        // Velocity of the panel's centre per unit rate of the hub (`turned`) and of the panel (`swung`), and the part of its
        // acceleration that does not depend on second derivatives.
        let swung = [-d * sin_p, d * cos_p];
        let turned = [-hinge * sin + swung[0], hinge * cos + swung[1]];
        let left = [
            -hinge * cos * turn * turn - d * cos_p * both * both,
            -hinge * sin * turn * turn - d * sin_p * both * both,
        ];
        let columns = [[1.0, 0.0], [0.0, 1.0], turned, swung];
        let spins = [0.0, 0.0, 1.0, 1.0];
        let mut a = nalgebra::Matrix4::<f64>::zeros();
        let mut b =
            nalgebra::Vector4::new(-force * sin, force * cos, torque, -k * bend - c * swing);
        (a[(0, 0)], a[(1, 1)], a[(2, 2)]) = (mass, mass, j);
        for i in 0..4 {
            for n in 0..4 {
                let product = columns[i][0] * columns[n][0] + columns[i][1] * columns[n][1];
                a[(i, n)] += m * product + inertia * spins[i] * spins[n];
            }
            b[i] -= m * (columns[i][0] * left[0] + columns[i][1] * left[1]);
        }
        let rates = a.cholesky().unwrap().solve(&b);
        [z[4], z[5], z[6], z[7], rates[0], rates[1], rates[2], rates[3]]
    }
}

/// A rigid body on a hinge, as in Basilisk, moves as its appendage mode with eta = sqrt(I) times the hinge angle, where I is
/// the inertia about the hinge. At angles of 1e-5 rad the terms of the third order are only 1e-10 of the angle.
#[test]
fn a_hinged_panel_is_one_mode_at_small_angles() {
    let panel =
        Panel { hub: [500.0, 300.0], m: 60.0, d: 1.4, inertia: 42.0, hinge: 0.7, k: 35.0, c: 1.2 };
    let about = panel.inertia + panel.m * panel.d * panel.d;
    let root = about.sqrt();
    let omega = (panel.k / about).sqrt();
    // The undeformed panel belongs to the dry craft. The origin O of the dry craft is the centre of the hub.
    let mass = panel.hub[0] + panel.m;
    let center = panel.m * (panel.hinge + panel.d) / mass;
    let far = panel.hinge + panel.d - center;
    let zz = panel.hub[1] + panel.hub[0] * center * center + panel.inertia + panel.m * far * far;
    let j = Inertia { xx: 200.0, yy: zz, zz, xy: 0.0, xz: 0.0, yz: 0.0 };
    let craft = Craft { mass, r: [center, 0.0, 0.0], j };
    let mut p = Parameters { craft, tanks: 0, appendages: 1, ..Parameters::default() };
    p.appendage[0] = Appendage {
        position: [panel.hinge, 0.0, 0.0],
        frequency: omega / std::f64::consts::TAU,
        zeta: panel.c / (2.0 * about * omega),
        participation: [0.0, panel.m * panel.d / root, 0.0, 0.0, 0.0, root],
        eta: 1e-5 * root,
        eta_dot: 0.0,
    };
    let (force, torque) = (1e-4, 3e-4);
    let u = Inputs {
        force: Ramp::held([0.0, force, 0.0]),
        torque: Ramp::held([0.0, 0.0, torque]),
        ..Inputs::default()
    };
    let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-13).unwrap();
    let mut z = [0.0, 0.0, 0.0, 1e-5, 0.0, 0.0, 0.0, 0.0];
    let h = 0.01;
    for _ in 0..1000 {
        craft.step(&u, h).unwrap();
        let at = |z: &[f64; 8], d: &[f64; 8], h: f64| -> [f64; 8] {
            std::array::from_fn(|i| z[i] + h * d[i])
        };
        let k1 = panel.rates(&z, force, torque);
        let k2 = panel.rates(&at(&z, &k1, h / 2.0), force, torque);
        let k3 = panel.rates(&at(&z, &k2, h / 2.0), force, torque);
        let k4 = panel.rates(&at(&z, &k3, h), force, torque);
        for i in 0..8 {
            z[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
        let x = craft.continuous_states();
        let got =
            [x[index::ETA] / root, x[index::ETA_DOT] / root, x[index::OMEGA + 2], x[8], x[11]];
        let want = [z[3], z[7], z[6], z[1], z[5]];
        for (got, want) in got.iter().zip(want) {
            assert!((got - want).abs() < 1e-9 * 1e-5_f64.max(want.abs()), "{got:e} {want:e}");
        }
    }
}

/// An appendage mode with zero participation vector oscillates without moving the craft, so a craft with such modes moves like
/// a craft without them.
#[test]
fn appendage_modes_without_participation_do_not_change_the_motion_of_the_craft() {
    let mut random = Random::new(3);
    let (mut p, u) = (Parameters { tanks: 2, ..random.parameters() }, random.inputs());
    let mut without = Spacecraft::new(&p, &u, 0.0, 1e-12).unwrap();
    for mode in &mut p.appendage {
        (mode.eta, mode.eta_dot) = (random.between(-1.0, 1.0), random.between(-1.0, 1.0));
    }
    assert_eq!(p.appendages, APPENDAGES);
    let mut with = Spacecraft::new(&p, &u, 0.0, 1e-12).unwrap();
    without.step(&u, 0.5).unwrap();
    with.step(&u, 0.5).unwrap();
    let (a, b) = (without.continuous_states(), with.continuous_states());
    for i in (0..index::ETA).filter(|i| *i != index::DISSIPATED) {
        assert!((a[i] - b[i]).abs() < 1e-12 * (1.0 + a[i].abs()), "{i}: {} {}", a[i], b[i]);
    }
    let mode = &p.appendage[5];
    let (w, t) = (std::f64::consts::TAU * mode.frequency, 0.5);
    let (decay, damped) = (mode.zeta * w, w * (1.0 - mode.zeta * mode.zeta).sqrt());
    let sine = (mode.eta_dot + decay * mode.eta) / damped;
    let want = (-decay * t).exp() * (mode.eta * (damped * t).cos() + sine * (damped * t).sin());
    assert!((b[index::ETA + 5] - want).abs() < 1e-12, "{} {want}", b[index::ETA + 5]);
}

#[test]
fn errors_stay_within_the_solver_tolerance_with_appendages() {
    for seed in 0..6 {
        let mut random = Random::new(seed);
        let mut p = random.parameters();
        random.flex(&mut p);
        if seed % 2 == 1 {
            // The last two cases are a craft at rest, and a mode that is faster than the craft.
            p.appendage.iter_mut().for_each(|mode| (mode.eta, mode.eta_dot) = (0.0, 0.0));
            p.appendage[0].frequency = 20.0;
        }
        let u = random.inputs();
        let run = |tolerance: f64| {
            let mut craft = Spacecraft::new(&p, &u, 0.0, tolerance).unwrap();
            craft.step(&u, 2.0).unwrap();
            craft.continuous_states()
        };
        let exact = run(1e-13);
        for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
            let got = run(tolerance);
            for i in (0..STATES).filter(|i| !(index::POSITION..index::BOBS).contains(i)) {
                let off = (got[i] - exact[i]).abs() / (1.0 + exact[i].abs());
                assert!(off < 10.0 * tolerance, "{seed} at {tolerance:e}: x[{i}] {off:e}");
            }
        }
    }
}

/// If the sum of the squared participations exceeds the mass of the craft, the mass that remains
/// for the craft is negative. An appendage mode with a participation of 34 kg^0.5 is accepted,
/// because 34^2 kg is less than the craft's 1180 kg, but 35 kg^0.5 is refused. Excessive
/// deflections are refused at the start and in a step.
#[test]
fn appendages_heavier_than_the_craft_and_excessive_deflections_are_refused() {
    let mut p = Parameters { appendages: 1, ..Parameters::default() };
    (p.appendage[0].participation[1], p.appendage[0].position) = (34.0, p.craft.r);
    let new = |p: &Parameters| Spacecraft::new(p, &Inputs::default(), 0.0, 1e-8);
    assert!(new(&p).is_ok());
    let mut heavy = p;
    heavy.appendage[0].participation[1] = 35.0;
    let problems = new(&heavy).err().unwrap();
    assert!(problems[0].contains("appendage[].participation leaves"), "{problems:?}");
    let mut bent = p;
    bent.appendage[0].participation[1] = 10.0;
    bent.appendage[0].eta = 1e3;
    let problems = new(&bent).err().unwrap();
    assert!(problems[0].contains("appendage[].eta_0 = [1000.0]"), "{problems:?}");
    // An importer may set a deflection that is too large. The next step is then refused and changes no state.
    bent.appendage[0].eta = 0.0;
    let mut craft = new(&bent).unwrap();
    let mut x = craft.continuous_states();
    x[index::ETA] = 1e3;
    craft.set_continuous_states(&x);
    assert!(craft.derivatives(&Inputs::default()).iter().all(|x| x.is_finite()));
    assert!(craft.check_states().unwrap_err().to_string().contains("appendage[].eta"));
    let why = craft.step(&Inputs::default(), 0.1).unwrap_err().to_string();
    assert!(why.contains("small deflections"), "{why}");
    assert_eq!(craft.continuous_states(), x);
    for (field, change) in [
        ("frequency", (|mode| mode.frequency = 0.0) as fn(&mut Appendage)),
        ("zeta", |mode| mode.zeta = -0.1),
        ("participation[6]", |mode| mode.participation[5] = f64::NAN),
        ("position[2]", |mode| mode.position[1] = 1e10),
        ("eta_0", |mode| mode.eta = f64::INFINITY),
        ("eta_dot_0", |mode| mode.eta_dot = f64::NAN),
    ] {
        let mut p = p;
        change(&mut p.appendage[0]);
        let problems = new(&p).err().unwrap();
        assert!(problems[0].starts_with(&format!("appendage[1].{field}")), "{problems:?}");
        p.appendages = 0;
        assert!(new(&p).is_ok());
    }
    let problems = new(&Parameters { appendages: 7, ..p }).err().unwrap();
    assert_eq!(problems, ["appendages = 7 (allowed: 0 to 6)"]);
}

//! Tests of modes along other directions than the tangent, as in a box with modes along both axes.

use core::f64::consts::FRAC_PI_2;

use super::common::bench;
use plant::{FrictionModel, Inputs, Outputs, Parameters, Plant, Ramp, SloshModel, SloshSource};

const G: f64 = 9.81;
/// Tolerance of the balances, relative to the energy throughput. It allows for the rounding errors of some thousand steps.
const TOLERANCE: f64 = 1e-13;

/// Returns a bench with 5 kg of liquid and three modes: along the tangent, in an oblique direction, and along the radius.
fn askew(model: SloshModel, friction: FrictionModel) -> Parameters {
    let mut p = bench(model, friction);
    (p.slosh.source, p.slosh.modes) = (SloshSource::Table, 3);
    let table = &mut p.slosh.table;
    table.m_liq = 5.0;
    table.mass[..3].copy_from_slice(&[1.5, 1.2, 2.5]);
    table.length[..3].copy_from_slice(&[0.06, 0.05, 0.08]);
    table.zeta[..3].copy_from_slice(&[0.01, 0.03, 0.02]);
    table.direction[..3].copy_from_slice(&[0.0, 0.6, FRAC_PI_2]);
    (p.init.omega, p.init.slosh_angle, p.init.slosh_rate) = (1.5, 0.4, 2.0);
    p
}

fn plant(p: &Parameters) -> Plant {
    Plant::new(p, &Inputs::default(), 0.0, TOLERANCE).unwrap()
}

const MODELS: [SloshModel; 2] = [SloshModel::Linear, SloshModel::Planar];

/// On a tilted bench with damping and every friction law, energy - (energy at the start) - work + dissipated energy must be 0
/// relative to the energy throughput.
#[test]
fn energy_is_balanced_with_modes_in_any_direction() {
    for model in MODELS {
        for friction in FrictionModel::ALL {
            let mut p = askew(model, friction);
            (p.bench.tilt, p.bench.tilt_azimuth) = (0.1, 0.7);
            let mut plant = plant(&p);
            let mut inputs = Inputs::default();
            let first = plant.outputs(&inputs);
            let (mut last, mut throughput) = (first, first.energy.abs());
            for k in 0..500 {
                inputs.tau_cmd = Ramp::held(0.2 * (k as f64 * 0.3).sin());
                plant.step(&inputs, 0.02).unwrap();
                let now = plant.outputs(&inputs);
                throughput += (now.work - last.work).abs() + (now.heat - last.heat).abs();
                last = now;
                let gained = now.energy - first.energy - now.work + now.heat;
                assert!(gained.abs() < 1e-11 * throughput, "{model:?} {friction:?} {gained:.1e}");
            }
            assert!(last.heat > 0.05, "{}", last.heat);
        }
    }
}

#[test]
fn damping_of_modes_in_any_direction_does_not_change_momentum() {
    for model in MODELS {
        let p = askew(model, FrictionModel::None);
        let mut plant = plant(&p);
        let inputs = Inputs::default();
        let first = plant.outputs(&inputs);
        for _ in 0..500 {
            plant.step(&inputs, 0.02).unwrap();
            let change = plant.outputs(&inputs).momentum - first.momentum;
            assert!(change.abs() < 1e-12 * first.momentum, "{model:?} {change:.1e}");
        }
        assert!(plant.outputs(&inputs).heat > 0.01);
    }
}

/// Newton's equations of hub and slosh masses, integrated by Runge–Kutta. Each slosh mass moves on a circle of radius l
/// about a hinge at the distance r from the axis, in the horizontal direction (n_x, n_t); the force N of its guide, across
/// this path, is an unknown. The states are the angle of the hub and its rate w, then the angle al of each mode and its
/// rate. A slosh mass at P = (r + l s n_x, l s n_t, -l c) in the hub's frame, with s = sin(al) and c = cos(al), has the
/// acceleration P'' + 2 w x P' + w' x P + w x (w x P). Gravity, N and the drag along the path act on the slosh mass; -N and
/// minus the drag act on the hub.
struct Newton<'a> {
    p: &'a Parameters,
    drag: Vec<f64>,
    tau: f64,
}

impl Newton<'_> {
    fn residual(&self, x: &[f64], unknown: &[f64]) -> Vec<f64> {
        let (p, table) = (self.p, &self.p.slosh.table);
        let (r, w, w_d) = (p.tank.r, x[1], unknown[0]);
        let lateral = G * p.bench.tilt.tan();
        let (sin, cos) = (p.bench.tilt_azimuth - x[0]).sin_cos();
        let gravity = [lateral * cos, lateral * sin, -G];
        let modes = self.drag.len();
        let m_0 = table.m_liq - table.mass[..modes].iter().sum::<f64>();
        let mut torque = self.tau - p.friction.b * w + m_0 * r * gravity[1];
        let mut left = vec![0.0];
        for n in 0..modes {
            let (m, l, [al, al_d], al_dd) =
                (table.mass[n], table.length[n], [x[2 + 2 * n], x[3 + 2 * n]], unknown[1 + n]);
            let ([n_x, n_t], (s, c)) =
                ([table.direction[n].sin(), table.direction[n].cos()], al.sin_cos());
            let place = [r + l * s * n_x, l * s * n_t, -l * c];
            let (path, inwards) = ([c * n_x, c * n_t, s], [-s * n_x, -s * n_t, c]);
            let rate = path.map(|e| l * al_d * e);
            let relative: [f64; 3] =
                std::array::from_fn(|i| l * (al_dd * path[i] + al_d * al_d * inwards[i]));
            let a = [
                relative[0] - 2.0 * w * rate[1] - w_d * place[1] - w * w * place[0],
                relative[1] + 2.0 * w * rate[0] + w_d * place[0] - w * w * place[1],
                relative[2],
            ];
            let drag = -self.drag[n] * l * al_d;
            let guide: [f64; 3] = std::array::from_fn(|i| m * (a[i] - gravity[i]) - drag * path[i]);
            left.push((0..3).map(|i| guide[i] * path[i]).sum());
            let on_hub: [f64; 3] = std::array::from_fn(|i| -guide[i] - drag * path[i]);
            torque += place[0] * on_hub[1] - place[1] * on_hub[0];
        }
        left[0] = (p.hub.inertia + m_0 * r * r) * w_d - torque;
        left
    }

    fn derivative(&self, x: &[f64]) -> Vec<f64> {
        let count = 1 + self.drag.len();
        let zero = vec![0.0; count];
        let constant = self.residual(x, &zero);
        let mut rows = vec![vec![0.0; count + 1]; count];
        for j in 0..count {
            let mut unit = zero.clone();
            unit[j] = 1.0;
            for (row, (with, without)) in
                rows.iter_mut().zip(self.residual(x, &unit).iter().zip(&constant))
            {
                (row[j], row[count]) = (with - without, -without);
            }
        }
        // The row of the hub is full, and the row of each slosh mass has two elements, so that the slosh
        // masses are eliminated first.
        let (hub, bobs) = rows.split_first_mut().unwrap();
        for (n, bob) in bobs.iter().enumerate() {
            let factor = hub[1 + n] / bob[1 + n];
            hub.iter_mut().zip(bob).for_each(|(hub, bob)| *hub -= factor * bob);
        }
        let w_d = hub[count] / hub[0];
        let mut d = vec![x[1], w_d];
        for (n, bob) in bobs.iter().enumerate() {
            d.extend([x[3 + 2 * n], (bob[count] - bob[0] * w_d) / bob[1 + n]]);
        }
        d
    }

    fn step(&self, x: &mut [f64], h: f64) {
        let at = |d: &[f64], h: f64| x.iter().zip(d).map(|(x, d)| x + h * d).collect::<Vec<_>>();
        let k1 = self.derivative(x);
        let k2 = self.derivative(&at(&k1, h / 2.0));
        let k3 = self.derivative(&at(&k2, h / 2.0));
        let k4 = self.derivative(&at(&k3, h));
        for (i, x) in x.iter_mut().enumerate() {
            *x += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
        }
    }
}

/// The reference solution `Newton` is integrated by Runge–Kutta in steps h of 0.1 ms, whose relative error (omega h)^4/120
/// per radian is 1e-12 after three seconds at omega = 14 rad/s. The slosh angles reach 40 degrees.
#[test]
fn the_planar_model_moves_as_newtons_equations_with_guide_forces() {
    for tilt in [0.0, 0.1] {
        let mut p = askew(SloshModel::Planar, FrictionModel::Viscous);
        (p.bench.tilt, p.bench.tilt_azimuth) = (tilt, 0.7);
        let inputs = Inputs { tau_cmd: Ramp::held(0.1), ..Inputs::default() };
        let mut plant = plant(&p);
        let calculated = *plant.calculated();
        let drag = (0..3)
            .map(|n| {
                let omega_n = core::f64::consts::TAU * calculated.frequency[n];
                2.0 * p.slosh.table.zeta[n] * omega_n * p.slosh.table.mass[n]
            })
            .collect();
        let newton = Newton { p: &p, drag, tau: 0.1 };
        let mut x = vec![0.0, p.init.omega, p.init.slosh_angle, p.init.slosh_rate];
        x.extend([0.0; 4]);
        let mut most = [0.0f64; 3];
        for _ in 0..300 {
            (0..100).for_each(|_| newton.step(&mut x, 1e-4));
            plant.step(&inputs, 0.01).unwrap();
            let state = plant.continuous_states();
            for (n, direction) in p.slosh.table.direction[..3].iter().enumerate() {
                let (q, al) = (&state[plant::x::SLOSH + 4 * n..], x[2 + 2 * n]);
                let (sin, cos) = direction.sin_cos();
                assert!((q[0] - al * sin).abs() < 1e-10 && (q[1] - al * cos).abs() < 1e-10);
                most[n] = most[n].max(al.abs());
            }
            assert!((plant.omega() - x[1]).abs() < 1e-10, "{} {}", plant.omega(), x[1]);
        }
        assert!(most.iter().all(|most| *most > 0.05), "{most:?}");
    }
}

/// Returns the inertia J of hub and liquid about the axis while one radial mode is at the angle `be`, and the first two
/// derivatives of J with respect to `be`.
fn inertia(p: &Parameters, be: f64) -> [f64; 3] {
    let (m, l, r) = (p.slosh.table.mass[0], p.slosh.table.length[0], p.tank.r);
    let m_0 = p.slosh.table.m_liq - m;
    let (s, c) = be.sin_cos();
    let x = r + l * s;
    let value = p.hub.inertia + m_0 * r * r + m * x * x;
    [value, 2.0 * m * x * l * c, 2.0 * m * l * (l * c * c - x * s)]
}

/// A tank at the distance r from the axis has one radial mode with the mass m and the pendulum length l. On a hub that
/// rotates at the rate w, the pendulum is in equilibrium at the angle be with g tan(be) = w^2 (r + l sin be). Small
/// oscillations about this angle have the frequency Omega^2 = V''/(m l^2) with the effective potential V = H^2/(2 J) + m g l
/// (1 - cos be), where H is the constant angular momentum and J(be) the inertia about the hub's axis. If the hub is so heavy
/// that w is constant, Omega^2 = g/(l cos be) - w^2 cos^2 be.
#[test]
fn a_radial_mode_keeps_its_direction_and_swings_at_the_closed_form_frequency() {
    for (hub, shift) in [(0.1, 1.0), (1e6, -1.0)] {
        let mut p = bench(SloshModel::Planar, FrictionModel::None);
        (p.slosh.source, p.slosh.modes, p.hub.inertia) = (SloshSource::Table, 1, hub);
        let table = &mut p.slosh.table;
        (table.m_liq, table.mass[0], table.length[0]) = (2.0, 1.5, 0.05);
        table.direction[0] = FRAC_PI_2;
        let (l, r, w) = (0.05, p.tank.r, 3.0);
        let mut be: f64 = 0.0;
        for _ in 0..100 {
            be = (w * w * (r + l * be.sin()) / G).atan();
        }
        (p.init.omega, p.init.slosh_angle_radial) = (w, be);
        let inputs = Inputs::default();
        let mut still = plant(&p);
        still.step(&inputs, 5.0).unwrap();
        let o = still.outputs(&inputs);
        assert!((o.slosh_angle_radial - be).abs() < 1e-11, "{} {be}", o.slosh_angle_radial);
        assert!(be > 0.19 && o.slosh_angle.abs() < 1e-15);
        // The whole liquid exerts a centrifugal force; each of its masses contributes in proportion to its distance from the axis.
        let thrown = w * w * (0.5 * r + 1.5 * (r + l * be.sin()));
        assert!((o.f_radial - thrown).abs() < 1e-9, "{} {thrown}", o.f_radial);

        let [j, j_d, j_dd] = inertia(&p, be);
        let momentum = j * w;
        let stiffness =
            1.5 * G * l * be.cos() + momentum * momentum * (j_d * j_d / j - j_dd / 2.0) / (j * j);
        let omega = (stiffness / 1.5).sqrt() / l;
        // The rate of a heavy hub is constant, so that the centrifugal force lowers the frequency. The rate of a light hub
        // falls when the slosh mass moves outwards, which raises the frequency.
        let (no_coupling, soft) = (G / (l * be.cos()), be.cos() * be.cos() * w * w);
        assert!((omega * omega - no_coupling) * shift > 0.0, "{omega}");
        if hub > 1.0 {
            assert!((omega * omega - no_coupling + soft).abs() < 1e-4 * soft);
        }
        // The amplitude is 1e-4 rad; the relative error of the frequency is its square.
        p.init.slosh_rate_radial = 1e-4 * omega;
        let mut swings = plant(&p);
        let (mut crossings, mut before) = (Vec::new(), (0.0, 1.0));
        let h = 1e-3;
        for k in 1..=5000 {
            swings.step(&inputs, h).unwrap();
            let rate = swings.outputs(&inputs).slosh_rate_radial;
            if before.1 > 0.0 && rate <= 0.0 {
                crossings.push(before.0 + h * before.1 / (before.1 - rate));
            }
            before = (k as f64 * h, rate);
        }
        let periods = (crossings.len() - 1) as f64;
        let found =
            core::f64::consts::TAU * periods / (crossings[crossings.len() - 1] - crossings[0]);
        assert!((found / omega - 1.0).abs() < 1e-6, "{found} {omega}");
    }
}

/// In linear theory a liquid with the same modes in all directions has no preferred axes, so that two equal modes at right
/// angles have the same effect on the hub as one mode along the tangent.
#[test]
fn equal_modes_at_right_angles_are_one_mode_along_the_tangent() {
    let run = |directions: &[f64]| -> Vec<Outputs> {
        let mut p = bench(SloshModel::Linear, FrictionModel::Viscous);
        (p.slosh.source, p.slosh.modes) = (SloshSource::Table, directions.len());
        p.slosh.table.m_liq = 2.0;
        for (n, direction) in directions.iter().enumerate() {
            (p.slosh.table.mass[n], p.slosh.table.length[n]) = (1.2, 0.05);
            (p.slosh.table.zeta[n], p.slosh.table.direction[n]) = (0.01, *direction);
        }
        (p.bench.tilt, p.bench.tilt_azimuth) = (0.05, 0.7);
        let inputs = Inputs { tau_cmd: Ramp::held(0.1), ..Inputs::default() };
        let mut plant = plant(&p);
        (0..200)
            .map(|_| {
                plant.step(&inputs, 0.02).unwrap();
                plant.outputs(&inputs)
            })
            .collect()
    };
    // Only the tilt of the bench moves a mode along the radius, which also exerts a torque on the hub.
    for (one, two) in run(&[0.0, FRAC_PI_2]).iter().zip(run(&[0.4 - FRAC_PI_2, 0.4])) {
        assert!((one.omega - two.omega).abs() < 1e-11, "{} {}", one.omega, two.omega);
        assert!((one.energy - two.energy).abs() < 1e-11);
        assert!((one.f_tangential - two.f_tangential).abs() < 1e-9);
    }
}

/// The table of directions is allowed only for the slosh models `linear` and `planar`, and the sum of the modal masses along
/// one direction must not exceed the mass of the liquid.
#[test]
fn directions_of_modes_are_refused_for_slosh_models_without_directions() {
    let refused = |change: fn(&mut Parameters)| {
        let mut p = askew(SloshModel::Planar, FrictionModel::None);
        change(&mut p);
        Plant::new(&p, &Inputs::default(), 0.0, 1e-9).err().map(|problems| problems.join("; "))
    };
    assert_eq!(refused(|_| {}), None);
    let spherical = refused(|p| p.slosh.model = SloshModel::Spherical).unwrap();
    assert!(spherical.starts_with("slosh.table.direction[2]"), "{spherical}");
    // Along the radius the liquid of 5 kg may have a mode of 2.5 kg and a part of the oblique mode, but not 4.9
    // kg and this part.
    let heavy = refused(|p| p.slosh.table.mass[2] = 4.9).unwrap();
    assert!(heavy.contains("along one direction"), "{heavy}");
    // The sum of the modal masses along both directions may exceed the mass of liquid.
    assert_eq!(refused(|p| p.slosh.table.mass[..3].copy_from_slice(&[4.0, 0.1, 4.0])), None);
    let light = refused(|p| {
        p.hub.inertia = 1e-9;
        p.slosh.table.mass[..3].copy_from_slice(&[4.8, 0.1, 4.8]);
    });
    assert!(light.unwrap().contains("most unfavourable directions"));
}

/// If the start is along the direction of mode 1, the outputs equal the initial values exactly. Any other start is refused,
/// with a message that contains a valid start.
#[test]
fn an_initial_state_is_refused_if_it_is_not_along_the_direction_of_mode_1() {
    for model in MODELS {
        for direction in [0.6, -1.2, FRAC_PI_2] {
            let mut p = askew(model, FrictionModel::None);
            p.slosh.table.direction[..3].copy_from_slice(&[direction, 0.0, 0.3]);
            let (sin, cos) = f64::sin_cos(direction);
            let start = |p: &Parameters| Plant::new(p, &Inputs::default(), 0.0, TOLERANCE);
            (p.init.slosh_angle, p.init.slosh_angle_radial) = (0.3 * cos, 0.3 * sin);
            (p.init.slosh_rate, p.init.slosh_rate_radial) = (-2.0 * cos, -2.0 * sin);
            let o = start(&p).unwrap().outputs(&Inputs::default());
            let got = [o.slosh_angle, o.slosh_angle_radial, o.slosh_rate, o.slosh_rate_radial];
            let init = p.init;
            let set = [
                init.slosh_angle,
                init.slosh_angle_radial,
                init.slosh_rate,
                init.slosh_rate_radial,
            ];
            for (got, set) in got.iter().zip(set) {
                assert!((got - set).abs() < 1e-15, "{model:?} {direction}: {got} {set}");
            }
            // The start is a thousandth away from the direction, or is one that earlier versions accepted by taking only its
            // part along the direction.
            for (tangential, radial) in
                [(0.3 * cos + 3e-4 * sin, 0.3 * sin - 3e-4 * cos), (0.3 * (cos + sin), 0.0)]
            {
                (p.init.slosh_angle, p.init.slosh_angle_radial) = (tangential, radial);
                let said = start(&p).unwrap_err().join("\n");
                assert!(said.contains("init.slosh_angle_radial"), "{said}");
                assert!(said.contains("slosh.table.direction[1]"), "{said}");
                let example = |name: &str| -> f64 {
                    let after = said.rsplit(&format!("{name} = ")).next().unwrap();
                    after.split([' ', ')']).next().unwrap().parse().unwrap()
                };
                p.init.slosh_angle = example("init.slosh_angle");
                p.init.slosh_angle_radial = example("init.slosh_angle_radial");
                start(&p).unwrap();
            }
            p.init.slosh_rate += 1.0;
            let said = start(&p).unwrap_err().join("\n");
            assert!(said.contains("init.slosh_rate ="), "{said}");
        }
    }
}

/// In the slosh models `linear` and `planar` a mode without a radial component moves only tangentially, so that a radial
/// initial angle has no effect.
#[test]
fn a_radial_initial_angle_without_effect_causes_a_warning() {
    for (model, direction, warned) in [
        (SloshModel::Linear, 0.0, true),
        (SloshModel::Planar, 0.0, true),
        (SloshModel::Planar, 0.6, false),
        (SloshModel::Spherical, 0.0, false),
    ] {
        let mut p = askew(model, FrictionModel::None);
        p.slosh.table.direction = [0.0; plant::MODES];
        p.slosh.table.direction[0] = direction;
        let reason = p.overridden("init.slosh_angle_radial");
        assert_eq!(reason.is_some(), warned, "{model:?} {direction} {reason:?}");
    }
}

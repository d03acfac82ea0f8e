//! Simulates 20 ms steps (0.1 s for `telecom`) so that their instructions can be counted: `cost KIND STEPS TOLERANCE`.
//!
//! | KIND | simulated system |
//! | --- | --- |
//! | `hubslosh` | HubSlosh's bench, spherical model, no friction |
//! | `bench` | a craft with the same liquid, one tank and one mode, under 1 g, turning about one axis only because of its mass |
//! | `one` | 1180 kg under 2400 N, one tank, one mode |
//! | `two` | as `one`, with two tanks of one mode, as in the comparison with Basilisk |
//! | `four` | as `one`, with four tanks of three modes each |
//! | `telecom`, `pendulums` | the satellite of example 14 at a fill of 60 %, with and without s and κ |
//! | `flexible`, `flexible_six` | `two` with one and with six modes of appendages |
//! | `drain`, `drain_bent` | `one` with three modes while its tank drains, with and without s and κ |
//!
//! `valgrind --tool=callgrind --toggle-collect='*Spacecraft*step*' cost bench 1000 1e-6` counts the instructions of the
//! steps only (for `hubslosh` the filter is `'*Plant*step*'`).

use craft::{Inertia, Inputs, Parameters, Ramp, Spacecraft};
use plant::{FrictionModel, Plant, SloshModel};

const STEP: f64 = 0.02;

/// Returns a torque that oscillates at `w`, rad/s, at the start of step number `k`, and its slope over this step of
/// the length `step`, s.
fn torque(size: f64, w: f64, step: f64, k: usize) -> (f64, f64) {
    let at = |k: usize| size * f64::sin(w * step * k as f64);
    (at(k), (at(k + 1) - at(k)) / step)
}

fn hubslosh(steps: usize, tolerance: f64) {
    let mut p = plant::Parameters::default();
    p.slosh.model = SloshModel::Spherical;
    p.friction.model = FrictionModel::None;
    p.init.slosh_angle = 0.1;
    p.init.slosh_angle_radial = 0.05;
    let mut plant = Plant::new(&p, &plant::Inputs::default(), 0.0, tolerance).unwrap();
    for k in 0..steps {
        let (value, slope) = torque(0.05, 13.0, STEP, k);
        let tau_cmd = plant::Ramp { value, slope };
        plant.step(&plant::Inputs { tau_cmd, ..plant::Inputs::default() }, STEP).unwrap();
    }
}

/// Sets the parameters of the satellite of example 14: 1400 kg with a spherical tank and a capsule tank of two modes each.
fn telecom(p: &mut Parameters) {
    p.tanks = 2;
    p.craft.mass = 1400.0;
    p.craft.r = [0.012, -0.008, 1.05];
    p.craft.j = Inertia { xx: 1150.0, yy: 980.0, zz: 870.0, xy: -14.0, xz: 22.0, yz: 9.0 };
    p.init.omega = [0.001, -0.002, 0.003];
    let [nto, mmh, ..] = &mut p.tank;
    nto.position = [0.06, 0.42, 0.2];
    (nto.m_0, nto.h_0, nto.i_0) = (287.00845531115345, 0.5490604138460016, 0.014355023890010976);
    nto.mass[..2].copy_from_slice(&[305.3341700207052, 9.787589025775398]);
    nto.length[..2].copy_from_slice(&[0.32270709224095556, 0.10188824550999312]);
    nto.hinge[..2].copy_from_slice(&[0.5499999999993295, 0.5499999999970336]);
    nto.zeta[..2].copy_from_slice(&[0.001710917941963635, 0.0006843788123203797]);
    mmh.position = [-0.05, -0.62, 0.1];
    (mmh.m_0, mmh.h_0, mmh.i_0) = (383.84637993210924, 0.5942687717525935, 7.24933411788028);
    mmh.mass[..2].copy_from_slice(&[113.7131029867415, 3.426370558296533]);
    mmh.length[..2].copy_from_slice(&[0.24470513495019547, 0.08440492046413875]);
    mmh.hinge[..2].copy_from_slice(&[0.8280404728615534, 0.9656763273441942]);
    mmh.zeta[..2].copy_from_slice(&[0.004048859023143716, 0.001818331491886671]);
    for tank in [nto, mmh] {
        (tank.modes, tank.g_ref, tank.i_z) = (2, 0.15, 0.0);
        tank.p_0 = [[0.05, 0.1, -0.99]; craft::MODES];
    }
}

fn spacecraft(kind: &str, steps: usize, tolerance: f64) {
    let mut p = Parameters::default();
    p.tank[0].p_0[0] = [0.05, 0.1, -0.99];
    let (mut thrust, mut size, mut w, mut step, mut flow) = (2400.0, 20.0, 2.5, STEP, 0.0);
    match kind {
        "bench" => {
            let mass = 1e9;
            p.craft.mass = mass;
            p.craft.r = [0.0; 3];
            p.craft.j = Inertia { xx: mass, yy: mass, zz: 0.322414, xy: 0.0, xz: 0.0, yz: 0.0 };
            let tank = &mut p.tank[0];
            (tank.position, tank.g_ref) = ([0.225, 0.0, 0.0], 9.81);
            (tank.diameter, tank.depth) = (0.163, 0.10);
            (thrust, size, w) = (mass * 9.81, 0.05, 13.0);
        }
        "two" | "flexible" | "flexible_six" => {
            p.appendages = [("flexible", 1), ("flexible_six", 6)]
                .iter()
                .find_map(|(name, modes)| (*name == kind).then_some(*modes))
                .unwrap_or(0);
            // The two solar arrays have 40 kg and 4 m each; their modes bend across them and rotate the craft.
            for (k, mode) in p.appendage.iter_mut().enumerate() {
                let side = if k % 2 == 0 { 1.0 } else { -1.0 };
                let size = [1.0, 0.55, 0.33][k / 2];
                mode.position = [0.0, 0.8 * side, 0.0];
                mode.frequency = [0.3, 1.9, 5.2][k / 2];
                mode.participation = [0.0, 0.0, 5.0 * size, 14.0 * side * size * size, 0.0, 0.0];
            }
            p.tanks = 2;
            p.tank[1].p_0[0] = [-0.02, 0.05, -0.99];
            (p.tank[0].position, p.tank[1].position) = ([0.6, 0.0, 0.0], [-0.6, 0.0, 0.0]);
            p.init.omega = [0.01, -0.02, 0.03];
        }
        "four" => {
            p.tanks = 4;
            for (i, tank) in p.tank.iter_mut().enumerate() {
                let (x, y) = [(0.6, 0.6), (0.6, -0.6), (-0.6, 0.6), (-0.6, -0.6)][i];
                tank.position = [x, y, -0.2];
                tank.q = [0.97, 0.1 * x, -0.1 * y, 0.05];
                tank.modes = 3;
                tank.p_0 = [[0.1, 0.05, -0.99]; 3];
            }
            p.init.omega = [0.01, -0.02, 0.03];
        }
        "drain" | "drain_bent" => {
            let tank = &mut p.tank[0];
            (tank.modes, tank.fill.points) = (3, craft::POINTS);
            if kind == "drain_bent" {
                (tank.nonlinear_inertia[0], tank.nonlinear_stiffness[0]) = (1.408, 0.734);
            }
            p.init.omega = [0.01, -0.02, 0.03];
            flow = 1.0;
        }
        "telecom" | "pendulums" => {
            telecom(&mut p);
            (thrust, size, w) = (400.0, 1.0, 0.7);
            if kind == "telecom" {
                p.tank[1].nonlinear_inertia[0] = 1.4502961373348606;
                p.tank[1].nonlinear_stiffness[0] = 0.7298361502849786;
            }
            step = 0.1;
        }
        _ => p.init.omega = [0.01, -0.02, 0.03],
    }
    let mut inputs = Inputs { force: Ramp::held([0.0, 0.0, thrust]), ..Inputs::default() };
    inputs.mass_flow[0].value = flow;
    let mut craft = Spacecraft::new(&p, &inputs, 0.0, tolerance).unwrap();
    for k in 0..steps {
        let (value, slope) = torque(size, w, step, k);
        let across = if kind == "bench" { 0.0 } else { 1.0 };
        inputs.torque = Ramp {
            value: [across * value, 0.5 * across * value, value],
            slope: [across * slope, 0.5 * across * slope, slope],
        };
        craft.step(&inputs, step).unwrap();
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let kind = arguments.next().unwrap_or("one".into());
    let steps: usize = arguments.next().map_or(1000, |n| n.parse().unwrap());
    let tolerance: f64 = arguments.next().map_or(1e-6, |x| x.parse().unwrap());
    match &*kind {
        "hubslosh" => hubslosh(steps, tolerance),
        _ => spacecraft(&kind, steps, tolerance),
    }
}

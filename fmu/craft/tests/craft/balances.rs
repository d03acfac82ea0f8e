//! Momentum and angular momentum change only by the forces and torques on the craft, and the energy only by their
//! work and the dissipation:
//!
//! ```text
//! P' = C f,   H' = C (tau - r_c x f),   E = work - dissipated + const
//! ```
//!
//! The test integrates the inputs over a step by Lobatto's rule with five points, whose order is 8. In a step the craft
//! rotates by less than 0.03 rad and the liquid swings by less than 0.3 rad, so that the error is 1e-13 of a step's
//! contribution. On a pivot gravity also exerts a torque on the craft, and H is about O.

use craft::{APPENDAGES, Inputs, Mount, Outputs, Parameters, Ramp};
use serde_json::Value;

use super::component::Spacecraft;
use super::random::Random;
use super::records::{STEP, inputs, parameters, records, steps};

const END: usize = if cfg!(debug_assertions) { 5_000 } else { 50_000 };

/// Iterates over the nodes of Lobatto's rule in a step of length 1 and their weights, with the step
/// divided into `panels` parts.
fn lobatto(panels: usize) -> impl Iterator<Item = (f64, f64)> {
    let far = f64::sqrt(3.0 / 7.0) / 2.0;
    let (end, inner, middle) = (1.0 / 20.0, 49.0 / 180.0, 16.0 / 45.0);
    let nodes = [(0.0, end), (0.5 - far, inner), (0.5, middle), (0.5 + far, inner), (1.0, end)];
    let n = panels as f64;
    (0..panels).flat_map(move |k| nodes.map(|(at, weight)| ((at + k as f64) / n, weight / n)))
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn norm(a: [f64; 3]) -> f64 {
    f64::sqrt(a.iter().map(|x| x * x).sum())
}

/// Returns the vector v, which is given in body axes, in inertial axes: v + 2 u x (u x v + q0 v), where q = (q0, u)
/// is the craft's attitude.
fn turned(q: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let [q0, x, y, z] = q;
    let inner = cross([x, y, z], v);
    let outer = cross([x, y, z], [0, 1, 2].map(|i| inner[i] + q0 * v[i]));
    [0, 1, 2].map(|i| v[i] + 2.0 * outer[i])
}

struct Balance {
    start: Outputs,
    impulse: [f64; 3],
    angular: [f64; 3],
    scale: [f64; 3],
    worst: [f64; 3],
}

impl Balance {
    fn look(&mut self, out: &Outputs, vertical_only: bool, p: &Parameters) {
        let spin = norm(out.omega) * (0..3).map(|i| out.inertia[i][i]).fold(0.0, f64::max);
        self.scale[0] = self.scale[0].max(norm(out.momentum)).max(out.mass * norm(out.velocity));
        self.scale[1] = self.scale[1].max(norm(out.angular_momentum)).max(spin);
        self.scale[2] = self.scale[2].max(out.energy.abs()).max(out.work.abs());
        let residual = |now: [f64; 3], start: [f64; 3], came_in: [f64; 3]| {
            [0, 1, 2].map(|i| now[i] - start[i] - came_in[i])
        };
        let momentum = residual(out.momentum, self.start.momentum, self.impulse);
        let angular = residual(out.angular_momentum, self.start.angular_momentum, self.angular);
        let angular = if vertical_only {
            (0..3).map(|i| angular[i] * p.gravity[i]).sum::<f64>().abs() / norm(p.gravity)
        } else {
            norm(angular)
        };
        let energy = out.energy - self.start.energy - (out.work - self.start.work)
            + (out.dissipated - self.start.dissipated);
        let momentum = if p.mount == Mount::Pivot { 0.0 } else { norm(momentum) };
        for (worst, now) in self.worst.iter_mut().zip([momentum, angular, energy.abs()]) {
            *worst = if now <= *worst { *worst } else { now };
        }
    }

    fn relative(&self) -> [f64; 3] {
        [0, 1, 2].map(|i| {
            let residual = self.worst[i];
            if residual == 0.0 { 0.0 } else { residual / self.scale[i] }
        })
    }
}

/// Simulates the craft with the inputs, and then without force and torque until `end`. Returns the residuals of the balances
/// of momentum P, angular momentum H and energy E, divided by the sizes of these quantities.
fn residuals(
    p: &Parameters,
    input: impl Fn(usize) -> Inputs,
    driven: usize,
    end: usize,
    panels: usize,
) -> [f64; 3] {
    let mut craft = Spacecraft::new(p, &input(0), 0.0, 1e-13).unwrap();
    let start = craft.outputs(&input(0));
    let zero = [0.0; 3];
    let mut balance = Balance { start, impulse: zero, angular: zero, scale: zero, worst: zero };
    let at = |u: &Inputs, t: f64| {
        let moved = |ramp: &Ramp| Ramp { value: ramp.value_at(t), slope: ramp.slope };
        Inputs {
            force: moved(&u.force),
            torque: moved(&u.torque),
            h_wheels: moved(&u.h_wheels),
            ..Inputs::default()
        }
    };
    let mut held = input(0);
    for k in 0..driven {
        let u = input(k);
        let mut before = 0.0;
        for (node, weight) in lobatto(panels) {
            if node * STEP > before {
                craft.step(&at(&u, before), node * STEP - before).unwrap();
                before = node * STEP;
            }
            let now = at(&u, before);
            let out = craft.outputs(&now);
            let (f, tau) = (now.force.value, now.torque.value);
            let torque = match p.mount {
                Mount::Free => {
                    let arm = cross(out.center_of_mass, f);
                    turned(out.q, [0, 1, 2].map(|i| tau[i] - arm[i]))
                }
                Mount::Pivot => {
                    let weight = p.gravity.map(|g| out.mass * g);
                    let by_gravity = cross(turned(out.q, out.center_of_mass), weight);
                    let tau = turned(out.q, [0, 1, 2].map(|i| tau[i] + out.pivot_torque[i]));
                    [0, 1, 2].map(|i| tau[i] + by_gravity[i])
                }
            };
            let force = turned(out.q, f);
            for i in 0..3 {
                balance.impulse[i] += weight * STEP * force[i];
                balance.angular[i] += weight * STEP * torque[i];
            }
            if node == 1.0 {
                balance.look(&out, false, p);
            }
        }
        held = Inputs { h_wheels: Ramp::held(u.h_wheels.value_at(STEP)), ..Inputs::default() };
    }
    for k in driven..end {
        craft.step(&held, STEP).unwrap();
        if k % 50 == 0 {
            balance.look(&craft.outputs(&held), p.mount == Mount::Pivot, p);
        }
    }
    balance.relative()
}

fn check(name: &str, relative: [f64; 3], excess: &mut Vec<String>) {
    let [momentum, angular, energy] = relative;
    println!("{name:20} P {momentum:.1e}  H {angular:.1e}  E {energy:.1e}");
    // The condition is negated so that NaN fails, too.
    if !(momentum < 1e-12 && angular < 1e-12 && energy < 1e-10) {
        excess.push(format!("{name}: P {momentum:e}, H {angular:e}, E {energy:e}"));
    }
}

/// Each of the reference motions is simulated for 1,000 s. Momentum and angular momentum must change only by the forces and
/// torques on the craft, and the energy only by their work and by damping.
#[test]
#[ignore = "three seconds: .ci/long-tests"]
fn momentum_angular_momentum_and_energy_balance_over_1000_s_of_every_record() {
    let mut excess = Vec::new();
    for record in &records("craft") {
        let (driven, _) = steps(record);
        let relative = residuals(&parameters(record), |k| inputs(record, k), driven, END, 1);
        check(name(record), relative, &mut excess);
    }
    assert!(excess.is_empty(), "{}", excess.join("\n"));
}

fn name(record: &Value) -> &str {
    record["name"].as_str().unwrap()
}

/// Random craft are simulated for 10 s. Momentum and angular momentum must change only by the forces and torques on the
/// craft, and the energy only by their work and by damping.
#[test]
fn momentum_angular_momentum_and_energy_balance_over_10_s_of_random_craft() {
    random_craft(END / 100);
}

/// Random craft are simulated for 100 s. Momentum and angular momentum must change only by the
/// forces and torques on the craft, and the energy only by their work and by damping.
#[test]
#[ignore = "20 s: .ci/run --nightly"]
fn momentum_angular_momentum_and_energy_balance_over_100_s_of_random_craft() {
    random_craft(END / 10);
}

#[test]
#[ignore = "20 s: .ci/run --nightly"]
fn momentum_angular_momentum_and_energy_balance_over_1000_s_of_random_craft() {
    random_craft(END);
}

/// Simulates random craft for at most `most` steps, and checks the balances. One craft, whose pivot exerts a torque, is
/// simulated for at most 1,000 steps.
fn random_craft(most: usize) {
    let mut excess = Vec::new();
    for seed in 0..32 {
        let mut random = Random::new(seed);
        let mut p = random.parameters();
        if seed >= 9 {
            (p.mount, p.init.velocity) = (Mount::Pivot, [0.0; 3]);
        }
        if (19..26).contains(&seed) || seed == 31 {
            // From seed 25 on, the craft have four tanks, six appendage modes and are in free flight.
            (p.mount, p.tanks) = (if seed == 20 { Mount::Pivot } else { Mount::Free }, 4);
            random.flex(&mut p);
            while seed == 25 && p.appendages < APPENDAGES {
                random.flex(&mut p);
            }
        }
        let mut end = most;
        if seed == 10 {
            // The torque of the pivot changes the angular momentum about every axis.
            (p.pivot, end) = (random.pivot(), most.min(1000));
        }
        if (11..19).contains(&seed) || (26..31).contains(&seed) {
            p.mount = if [13, 17, 28].contains(&seed) { Mount::Pivot } else { Mount::Free };
        }
        if (11..15).contains(&seed) || seed == 27 {
            random.make_all_planar(&mut p);
        }
        if (14..21).contains(&seed) || seed >= 29 {
            random.bend_all(&mut p);
        }
        if seed >= 26 {
            random.spin_all(&mut p);
        }
        // Bobs on surfaces other than spheres move so fast that one step needs several panels of Lobatto's rule. Bobs in spinning
        // liquid move even faster.
        let panels = match seed {
            0..14 => 1,
            14..26 => 2,
            _ => 4,
        };
        if seed.is_multiple_of(3) {
            p.tank.iter_mut().for_each(|tank| random.follow(tank));
        }
        // Force, torque and wheel momentum change linearly for half a second and then jump; the thrust is constant.
        let pieces: Vec<Inputs> = (0..40).map(|_| random.inputs()).collect();
        let thrust = p.craft.mass;
        let input = |k: usize| {
            let (piece, t) = (pieces[k / 25], (k % 25) as f64 * STEP);
            let at = |ramp: Ramp| Ramp { value: ramp.value_at(t), slope: ramp.slope };
            let mut force = at(piece.force);
            force.value[2] += thrust;
            Inputs {
                force,
                torque: at(piece.torque),
                h_wheels: at(piece.h_wheels),
                ..Inputs::default()
            }
        };
        check(&format!("random {seed}"), residuals(&p, input, 1000, end, panels), &mut excess);
    }
    assert!(excess.is_empty(), "{}", excess.join("\n"));
}

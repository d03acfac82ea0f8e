//! Steps over rounded corners in the laws of drag, near which power series converge only over short times. The errors of these
//! steps must be within the tolerance.

use craft::{
    DampingLaw, Inputs, Line, Mount, Parameters, Ramp, STATES, SloshTank, Spacecraft, TANKS, Tank,
    TankInputs, TankParameters, index,
};

use super::independent::newton_rates;
use super::random::{Random, draining_tank};
use super::seeds::every_or;

/// One row of a table of thrust: its duration, s, the specific force along the tank at both ends and across the tank, the
/// angular acceleration, and the mass flows out of the tanks at both ends, kg/s.
struct Row {
    h: f64,
    along: [f64; 2],
    across: [f64; 2],
    turn: Ramp,
    flow: [[f64; 2]; TANKS],
}

impl Row {
    fn force(&self, t: f64) -> Ramp {
        let slope = (self.along[1] - self.along[0]) / self.h;
        let [x, y] = self.across;
        Ramp { value: [x, y, self.along[0] + slope * t], slope: [0.0, 0.0, slope] }
    }

    fn flow(&self, t: f64) -> [Line; TANKS] {
        self.flow.map(|[from, to]| {
            let slope = (to - from) / self.h;
            Line { value: from + slope * t, slope }
        })
    }

    fn turn(&self, t: f64) -> Ramp {
        Ramp { value: self.turn.value_at(t), slope: self.turn.slope }
    }
}

/// Returns eight rows of 0.05 to 3 s in which the thrust has ramps, jumps, zeros and short reversals.
fn table(r: &mut Random) -> Vec<Row> {
    let value = |r: &mut Random| match r.below(4) {
        0 => 0.0,
        1 => r.between(-0.3, 0.3),
        _ => r.between(0.0, 1.5),
    };
    let mut last = value(r);
    let row = |_| {
        let from = if r.below(3) == 0 { value(r) } else { last };
        last = if r.below(4) == 0 { from } else { value(r) };
        let turn = Ramp { value: r.vector(0.05), slope: r.vector(0.05) };
        let (h, across) = (r.magnitude(0.05, 3.0), r.vector(0.03));
        Row { h, along: [from, last], across, turn, flow: [[0.0; 2]; TANKS] }
    };
    (0..8).map(row).collect()
}

/// Returns a table of thrust with mass flows: valves open and close, and flows are constant, zero or reversed.
fn table_with_flows(r: &mut Random) -> Vec<Row> {
    let mut rows = table(r);
    let value = |r: &mut Random| [0.0, r.between(-3.0, 6.0)][r.below(2)];
    let mut last = [0.0; TANKS];
    for row in &mut rows {
        for (flow, last) in row.flow.iter_mut().zip(&mut last) {
            let from = if r.below(2) == 0 { value(r) } else { *last };
            *last = if r.below(2) == 0 { from } else { value(r) };
            *flow = [from, *last];
        }
    }
    rows
}

/// Returns a random craft with one or two tanks. The drag of the bobs depends on the specific force
/// by one of the damping laws. In half of the craft a_f, the specific force over which this law is
/// smoothed near weightlessness, has its default. A third of the modes has drag that grows with the
/// amplitude, and a third has breaking waves. In a sixth of the tanks the bobs move on surfaces
/// other than spheres.
fn parameters(r: &mut Random) -> Parameters {
    let mut p = Parameters { tanks: 1 + r.below(2), mount: Mount::Free, ..r.parameters() };
    p.max_steps = 1_000_000;
    for tank in &mut p.tank {
        *tank = r.tank();
        drag(r, tank);
        if r.below(6) == 0 {
            r.bend(tank);
        }
    }
    p
}

fn drag(r: &mut Random, tank: &mut Tank) {
    tank.damping_law = DampingLaw::ALL[r.below(3)];
    tank.g_floor = [0.0, r.magnitude(1e-4, 0.1)][r.below(2)];
    for n in 0..tank.modes {
        tank.zeta[n] = r.magnitude(0.001, 0.1);
        tank.length[n] = r.magnitude(0.1, 0.5);
        let [x, y] = r.vector(0.3);
        (tank.p_0[n], tank.p_dot_0[n]) = ([x, y, -1.0], r.vector(0.3));
        if r.below(3) == 0 {
            tank.zeta_amplitude[n] = r.between(0.0, 0.1);
        }
        if r.below(3) == 0 {
            tank.zeta_breaking[n] = r.between(0.0, 0.1);
            tank.breaking_steepness[n] = r.between(0.0, 0.6);
        }
    }
}

/// Replaces the tanks of a craft by draining tanks with all kinds of drag. In half of the tanks the surface on
/// which the bob moves changes with the fill.
fn drain(r: &mut Random, p: &mut Parameters) {
    for tank in &mut p.tank {
        let modes = r.below(4);
        *tank = draining_tank(r, modes);
        drag(r, tank);
        if r.below(2) == 0 {
            r.bend_by_fill(tank);
        }
    }
}

fn put_on_pivot(r: &mut Random, p: &mut Parameters) {
    (p.mount, p.pivot) = (Mount::Pivot, r.pivot());
    (p.init.position, p.init.velocity) = ([0.0; 3], [0.0; 3]);
    (p.pivot.friction.omega_s, p.pivot.friction.eps) =
        (r.magnitude(0.01, 1.0), r.magnitude(1e-3, 0.3));
}

/// Settings of a run: tolerance, longest communication step, and a displacement of the first bob at the start.
#[derive(Clone, Copy)]
struct Way {
    tolerance: f64,
    step: f64,
    shift: f64,
}

/// Calls `step` for each communication step, with the row of the table, the time since the start of the row and the length
/// of the step, s. Calls `look` after each row.
fn drive(rows: &[Row], longest: f64, mut step: impl FnMut(&Row, f64, f64), mut look: impl FnMut()) {
    for row in rows {
        let pieces = (row.h / longest).ceil().max(1.0);
        let h = row.h / pieces;
        (0..pieces as usize).for_each(|k| step(row, k as f64 * h, h));
        look();
    }
}

fn tank_states(p: &TankParameters, rows: &[Row], way: Way) -> Vec<f64> {
    let inputs = |row: &Row, t: f64| {
        let Ramp { value, slope } = row.turn;
        TankInputs {
            a: row.force(t),
            omega: [0, 1, 2].map(|i| (value[i] + slope[i] * t / 2.0) * t),
            omega_dot: row.turn(t),
            mass_flow: row.flow(t)[0],
        }
    };
    let mut tank = SloshTank::new(p, &inputs(&rows[0], 0.0), 0.0, way.tolerance).unwrap();
    let mut x = tank.continuous_states();
    x[0] += way.shift;
    tank.set_continuous_states(&x);
    let (tank, mut all) = (core::cell::RefCell::new(tank), Vec::new());
    drive(
        rows,
        way.step,
        |row, t, h| tank.borrow_mut().step(&inputs(row, t), h).unwrap(),
        || all.extend_from_slice(&tank.borrow().continuous_states()[..6 * p.tank.modes]),
    );
    all
}

fn craft_inputs(p: &Parameters, row: &Row, t: f64) -> Inputs {
    let times = |ramp: Ramp| Ramp {
        value: ramp.value.map(|x| x * p.craft.mass),
        slope: ramp.slope.map(|x| x * p.craft.mass),
    };
    Inputs {
        force: times(row.force(t)),
        torque: times(row.turn(t)),
        mass_flow: row.flow(t),
        ..Inputs::default()
    }
}

fn angles(p: &Parameters, x: &[f64; STATES]) -> Vec<f64> {
    let mut all = x[index::Q..index::Q + 7].to_vec();
    for i in 0..p.tanks {
        all.extend_from_slice(&x[index::bob(i, 0)..][..6 * p.tank[i].modes]);
    }
    all
}

fn craft_states(p: &Parameters, rows: &[Row], way: Way) -> Vec<f64> {
    let first = craft_inputs(p, &rows[0], 0.0);
    let mut craft = Spacecraft::new(p, &first, 0.0, way.tolerance).unwrap();
    let mut x = craft.continuous_states();
    x[index::bob(0, 0)] += way.shift;
    craft.set_continuous_states(&x);
    let (craft, mut all) = (core::cell::RefCell::new(craft), Vec::new());
    drive(
        rows,
        way.step,
        |row, t, h| craft.borrow_mut().step(&craft_inputs(p, row, t), h).unwrap(),
        || all.extend(angles(p, &craft.borrow().continuous_states())),
    );
    all
}

/// Returns the largest difference between the states `a` and `b`, relative to 1 rad and 1 rad/s, or
/// to the largest rate if this rate is above 1 rad/s.
fn off(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().fold(1.0, |size: f64, x| size.max(x.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size
}

/// Compares runs whose communication steps are whole rows of the table with a reference that is computed in steps of 2 ms at a
/// tolerance of 1e-13. The allowed error is 30 times the tolerance, multiplied by the factor by which a small initial
/// displacement grows, because a pendulum that falls over amplifies errors.
fn keep_the_tolerance(seeds: impl IntoIterator<Item = u64>, run: impl Fn(u64, Way) -> Vec<f64>) {
    let mut worst = (0.0, 0, 0.0);
    for seed in seeds {
        let run = |tolerance, step, shift| run(seed, Way { tolerance, step, shift });
        let exact = run(1e-13, 2e-3, 0.0);
        let growth = off(&run(1e-11, 2e-2, 1e-6), &exact) / 1e-6;
        for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
            let error =
                off(&run(tolerance, f64::INFINITY, 0.0), &exact) / tolerance / growth.max(1.0);
            assert!(error < 30.0, "{seed}: error is {error} times the tolerance {tolerance:e}");
            if error > worst.0 {
                worst = (error, seed, tolerance);
            }
        }
    }
    println!("worst error: {:.2} tolerances, seed {} at {:e}", worst.0, worst.1, worst.2);
}

fn tank_of(seed: u64, way: Way) -> Vec<f64> {
    let mut r = Random::new(seed);
    let p = parameters(&mut r);
    let p = TankParameters { tank: p.tank[0], max_steps: p.max_steps, ..TankParameters::default() };
    tank_states(&p, &table(&mut r), way)
}

fn craft_of(seed: u64, way: Way) -> Vec<f64> {
    let mut r = Random::new(seed);
    let p = parameters(&mut r);
    craft_states(&p, &table(&mut r), way)
}

fn craft_on_a_pivot_of(seed: u64, way: Way) -> Vec<f64> {
    let mut r = Random::new(seed);
    let mut p = parameters(&mut r);
    if r.below(3) == 0 {
        r.make_all_planar(&mut p);
    }
    put_on_pivot(&mut r, &mut p);
    craft_states(&p, &table(&mut r), way)
}

fn planar_craft_of(seed: u64, way: Way) -> Vec<f64> {
    let mut r = Random::new(seed);
    let mut p = parameters(&mut r);
    r.make_all_planar(&mut p);
    craft_states(&p, &table(&mut r), way)
}

fn draining_tank_of(seed: u64, way: Way) -> Vec<f64> {
    let mut r = Random::new(seed);
    let mut p = parameters(&mut r);
    drain(&mut r, &mut p);
    let p = TankParameters { tank: p.tank[0], max_steps: p.max_steps, ..TankParameters::default() };
    tank_states(&p, &table_with_flows(&mut r), way)
}

fn draining_craft_of(seed: u64, way: Way) -> Vec<f64> {
    let mut r = Random::new(seed);
    let mut p = parameters(&mut r);
    drain(&mut r, &mut p);
    if r.below(3) == 0 {
        put_on_pivot(&mut r, &mut p);
    }
    craft_states(&p, &table_with_flows(&mut r), way)
}

#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn dry_friction_of_a_pivot_keeps_the_solver_tolerance() {
    keep_the_tolerance((0..5).chain([62]), craft_on_a_pivot_of);
}

#[test]
fn thrust_that_crosses_zero_keeps_the_solver_tolerance_for_planar_modes() {
    keep_the_tolerance(0..5, planar_craft_of);
}

#[test]
fn thrust_that_crosses_zero_keeps_the_solver_tolerance_for_a_draining_tank() {
    keep_the_tolerance(0..5, draining_tank_of);
}

#[test]
#[ignore = "three seconds: .ci/long-tests"]
fn thrust_that_crosses_zero_keeps_the_solver_tolerance_for_a_draining_craft() {
    keep_the_tolerance(0..10, draining_craft_of);
}

/// The smoothed acceleration a_+ of the drag has singularities at the complex times +-i a_f/x', counted from the instant at which
/// the specific force x crosses zero. An integrator that ignored them had errors of up to 400 tolerances in a step.
#[test]
fn thrust_that_crosses_zero_keeps_the_solver_tolerance_for_a_tank() {
    keep_the_tolerance(0..10, tank_of);
}

#[test]
fn thrust_that_crosses_zero_keeps_the_solver_tolerance_for_a_craft() {
    keep_the_tolerance(0..8, craft_of);
}

/// A tank under 1,000 random histories of thrust is compared with runs in much shorter steps. The
/// results differ by at most a few times the solver's tolerance.
#[test]
#[ignore = "minutes: .ci/run --nightly"]
fn a_thousand_random_tables_of_thrust_keep_the_solver_tolerance() {
    keep_the_tolerance(0..1000, tank_of);
    keep_the_tolerance(0..1000, craft_of);
    keep_the_tolerance(0..500, craft_on_a_pivot_of);
    keep_the_tolerance(0..500, planar_craft_of);
    keep_the_tolerance(0..500, draining_tank_of);
    keep_the_tolerance(0..200, draining_craft_of);
}

/// The reference integrates Newton's law (independent.rs) by Runge-Kutta steps of 0.2 ms. It uses
/// neither the power series nor the formulas of the craft. Its rates are exact to 1e-7 only,
/// because the slope of a_+, the smoothed acceleration in the drag, may change by a factor of two
/// within a step.
#[test]
fn thrust_that_crosses_zero_moves_a_craft_as_newtons_law_with_another_integrator() {
    for seed in every_or(&[1, 30], [1, 6, 9, 30]) {
        let mut r = Random::new(seed);
        let mut p = parameters(&mut r);
        p.tanks = 1;
        let rows: Vec<Row> = table(&mut r).into_iter().take(3).collect();
        let found =
            craft_states(&p, &rows, Way { tolerance: 1e-8, step: f64::INFINITY, shift: 0.0 });
        let first = craft_inputs(&p, &rows[0], 0.0);
        let mut x = Spacecraft::new(&p, &first, 0.0, 1e-8).unwrap().continuous_states();
        let mut exact = Vec::new();
        for row in &rows {
            let pieces = (row.h / 2e-4).ceil();
            let h = row.h / pieces;
            for k in 0..pieces as usize {
                let rates =
                    |x: &[f64; STATES], t: f64| newton_rates(&p, x, &craft_inputs(&p, row, t));
                let t = k as f64 * h;
                let along =
                    |rate: &[f64; STATES], h: f64| core::array::from_fn(|i| x[i] + h * rate[i]);
                let a = rates(&x, t);
                let b = rates(&along(&a, h / 2.0), t + h / 2.0);
                let c = rates(&along(&b, h / 2.0), t + h / 2.0);
                let d = rates(&along(&c, h), t + h);
                let mean = core::array::from_fn(|i| (a[i] + 2.0 * (b[i] + c[i]) + d[i]) / 6.0);
                x = along(&mean, h);
            }
            exact.extend(angles(&p, &x));
        }
        let error = off(&found, &exact);
        assert!(error < 3e-7, "{seed}: {error:e}");
    }
}

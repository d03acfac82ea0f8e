//! Tests of liquid that leaves the bottom of a SloshTank on a rigid body that the test simulates, as a host (importer) of the FMU
//! does. The motion is compared with the motion of a Spacecraft with the same tank.
//!
//! `Host` is this rigid body. It solves (M_host + M_a) [a; w'] = rest + bias, and adds M_host^-1 times the impulses of the tank
//! to its velocity and angular velocity. Momenta and energy are computed by a Spacecraft in the same state.

use craft::{
    BallState, Coupling, Inputs, Outputs, Parameters, Ramp, SloshTank, SloshTankOutputs,
    Spacecraft, TANK_INPUTS, TANK_STATES, TankInputs, TankParameters, TankState, index,
};
use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion};

use super::ball::{V, off_axis_craft, rotation, thrust, v, with_states};
use super::equations::output_slopes;
use super::random::Random;

type Six = SVector<f64, 6>;

fn alone(p: &Parameters) -> TankParameters {
    TankParameters { tank: p.tank[0], host: Some(p.craft), ..TankParameters::default() }
}

#[derive(Clone, Copy)]
struct Host {
    q: [f64; 4],
    w: V,
    r: V,
    velocity: V,
    work: f64,
}

pub(super) struct Craft {
    p: Parameters,
    tank: SloshTank,
    host: Host,
    taken: [f64; 6],
    pub(super) impulses: usize,
}

impl Craft {
    pub(super) fn new(p: &Parameters) -> Craft {
        let [a, b, c, d] = p.init.q;
        let q = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(a, b, c, d));
        let host = Host {
            q: [q.w, q.i, q.j, q.k],
            w: v(&p.init.omega),
            r: v(&p.init.position),
            velocity: v(&p.init.velocity),
            work: 0.0,
        };
        let tank = SloshTank::new(&alone(p), &TankInputs::default(), 0.0, 1e-12).unwrap();
        Craft { p: *p, tank, host, taken: [0.0; 6], impulses: 0 }
    }

    fn body(&self, w: V) -> (SMatrix<f64, 6, 6>, Six) {
        let (m, r, j) = (self.p.craft.mass, v(&self.p.craft.r), self.p.craft.j.matrix());
        let arm = r.cross_matrix();
        let inertia = Matrix3::from_fn(|i, k| j[i][k]) - arm * arm * m;
        let mut matrix = SMatrix::<f64, 6, 6>::zeros();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() * m));
        matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&inertia);
        matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-arm * m));
        matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&(arm * m));
        let (f, tau) = (w.cross(&w.cross(&(r * m))), w.cross(&(inertia * w)));
        (matrix, Six::from_fn(|i, _| if i < 3 { f[i] } else { tau[i - 3] }))
    }

    fn added(triangle: &[f64; 21]) -> SMatrix<f64, 6, 6> {
        let mut numbers = triangle.iter();
        let mut matrix = SMatrix::zeros();
        for i in 0..6 {
            for j in i..6 {
                matrix[(i, j)] = *numbers.next().unwrap();
                matrix[(j, i)] = matrix[(i, j)];
            }
        }
        matrix
    }

    fn solve(&self, u: &Inputs, t: f64, w: V, bias: &[f64; 6], added: &[f64; 21]) -> Six {
        let (matrix, turning) = self.body(w);
        let (f, tau) = (u.force.value_at(t), u.torque.value_at(t));
        let loads = Six::from_fn(|i, _| if i < 3 { f[i] } else { tau[i - 3] });
        let right = loads - turning + Six::from_column_slice(bias);
        (matrix + Self::added(added)).lu().solve(&right).unwrap()
    }

    fn held(&self, w: V, x: &Six) -> TankInputs {
        TankInputs {
            a: Ramp::held([x[0], x[1], x[2]]),
            omega: w.into(),
            omega_dot: Ramp::held([x[3], x[4], x[5]]),
            ..TankInputs::default()
        }
    }

    /// Returns the inputs of the tank at this instant, which are the motion of the body that carries it. The slope of the
    /// acceleration may be 0, because the drag of these bobs does not depend on the acceleration.
    fn inputs(&mut self, u: &Inputs) -> TankInputs {
        let w = self.host.w;
        let still = self.held(w, &Six::zeros());
        let out = self.tank.outputs_held(&still);
        self.held(w, &self.solve(u, 0.0, w, &out.bias, &out.added_mass))
    }

    fn take_impulse(&mut self, impulse: [f64; 6]) {
        if impulse == self.taken {
            return;
        }
        let p = Six::from_fn(|i, _| impulse[i] - self.taken[i]);
        let change = self.body(self.host.w).0.lu().solve(&p).unwrap();
        self.host.velocity += rotation(&self.host.q) * V::new(change[0], change[1], change[2]);
        self.host.w += V::new(change[3], change[4], change[5]);
        (self.taken, self.impulses) = (impulse, self.impulses + 1);
    }

    pub(super) fn spacecraft_outputs(&self, u: &Inputs) -> Outputs {
        let spacecraft = Spacecraft::new(&self.p, u, 0.0, 1e-12).unwrap();
        let tank = self.tank.continuous_states();
        let Host { q, w, r, velocity, work } = self.host;
        let state = with_states(
            &spacecraft,
            |x| {
                x[index::Q..index::Q + 4].copy_from_slice(&q);
                for i in 0..3 {
                    x[index::OMEGA + i] = w[i];
                    x[index::POSITION + i] = r[i];
                    x[index::VELOCITY + i] = velocity[i];
                }
                x[index::WORK] = work;
                x[index::DISSIPATED] = tank[6 * craft::MODES];
                x[index::bob(0, 0)..index::bob(1, 0)].copy_from_slice(&tank[..6 * craft::MODES]);
                x[index::ball(0)..index::ball(1)]
                    .copy_from_slice(&tank[6 * craft::MODES + 2..TANK_STATES - 3]);
            },
            &[self.ball()],
        );
        Spacecraft::resume(&self.p, &state, 1e-12).outputs_held(u)
    }

    pub(super) fn ball(&self) -> BallState {
        let words = self.tank.state().to_words();
        BallState::ALL[words[TankState::WORDS - 1] as usize - 1]
    }

    // With the following methods all states of body and tank are integrated by Runge-Kutta, as in Model Exchange, and sign
    // changes of an indicator are located by bisection.

    pub(super) fn pack(&self) -> Vec<f64> {
        let Host { q, w, r, velocity, work } = self.host;
        let mut x = q.to_vec();
        x.extend(w.iter().chain(&r).chain(&velocity));
        x.push(work);
        x.extend(self.tank.continuous_states());
        x
    }

    pub(super) fn unpack(&mut self, x: &[f64]) {
        let q = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(x[0], x[1], x[2], x[3]));
        self.host = Host {
            q: [q.w, q.i, q.j, q.k],
            w: v(&x[4..]),
            r: v(&x[7..]),
            velocity: v(&x[10..]),
            work: x[13],
        };
        self.tank.set_continuous_states(x[14..].try_into().unwrap());
    }

    pub(super) fn rates(&mut self, u: &Inputs, x: &[f64]) -> Vec<f64> {
        self.unpack(x);
        let given = self.inputs(u);
        let (a, w_d) = (given.a.value, given.omega_dot.value);
        let acceleration = Six::from_fn(|i, _| if i < 3 { a[i] } else { w_d[i - 3] });
        let mut rate = host_rates(u, &self.pack(), &acceleration);
        rate.extend(self.tank.derivatives(&given));
        rate
    }

    fn state_after(&mut self, u: &Inputs, x: &[f64], h: f64) -> Vec<f64> {
        runge_kutta(x, h, |_, x| self.rates(u, x))
    }

    pub(super) fn event_indicators(&mut self, u: &Inputs, x: &[f64]) -> [f64; 2] {
        self.unpack(x);
        let given = self.inputs(u);
        self.tank.event_indicators(&given)
    }

    pub(super) fn is_event_overdue(&mut self, u: &Inputs, x: &[f64]) -> bool {
        self.unpack(x);
        let given = self.inputs(u);
        self.tank.is_event_overdue(&given)
    }

    fn indicators(&mut self, u: &Inputs, x: &[f64]) -> [bool; 2] {
        self.event_indicators(u, x).map(|z| z > 0.0)
    }

    pub(super) fn event(&mut self, u: &Inputs) {
        for _ in 0..8 {
            let given = self.inputs(u);
            let changed = self.tank.take_event(&given).unwrap();
            let impulse = self.tank.outputs_held(&given).impulse;
            self.take_impulse(impulse);
            if !changed {
                return;
            }
        }
        panic!("a tank has more than the allowed number of events at one instant");
    }

    fn integrate(&mut self, u: &Inputs, h: f64) {
        let mut left = h;
        while left > 0.0 {
            let x = self.pack();
            let before = self.indicators(u, &x);
            let next = self.state_after(u, &x, left);
            if self.indicators(u, &next) == before {
                self.unpack(&next);
                return;
            }
            let (mut low, mut high) = (0.0, left);
            for _ in 0..45 {
                let middle = (low + high) / 2.0;
                let there = self.state_after(u, &x, middle);
                if self.indicators(u, &there) == before { low = middle } else { high = middle }
            }
            let there = self.state_after(u, &x, high);
            self.unpack(&there);
            self.event(u);
            left -= high;
        }
    }

    // With the following methods body and tank exchange values at communication points only. The body steps first, with bias and
    // added mass extrapolated by their slopes, and then the tank steps.

    fn exchange(&mut self, u: &Inputs, h: f64) {
        let given = self.inputs(u);
        let now = self.tank.outputs_held(&given);
        let slopes = output_slopes(&mut self.tank, &given);
        let along = |t: f64| {
            let bias: [f64; 6] = std::array::from_fn(|i| now.bias[i] + slopes.bias[i] * t);
            let added: [f64; 21] =
                std::array::from_fn(|i| now.added_mass[i] + slopes.added_mass[i] * t);
            (bias, added)
        };
        let solved = |t: f64, host: &Host| {
            let (bias, added) = along(t);
            self.solve(u, t, host.w, &bias, &added)
        };
        let (start, x) = (solved(0.0, &self.host), self.pack());
        let rates = |t: f64, y: &[f64]| {
            let host = Host { q: [y[0], y[1], y[2], y[3]], w: v(&y[4..]), ..self.host };
            let acceleration = solved(t, &host);
            host_rates(u, y, &acceleration)
        };
        let y = runge_kutta(&x[..14], h, rates);
        let mut all = x;
        all[..14].copy_from_slice(&y);
        let omega = self.host.w;
        let end = solved(h, &Host { w: v(&y[4..]), ..self.host });
        self.unpack(&all);
        let ramp = |at: usize| Ramp {
            value: [start[at], start[at + 1], start[at + 2]],
            slope: [0, 1, 2].map(|i| (end[at + i] - start[at + i]) / h),
        };
        let over = TankInputs {
            a: ramp(0),
            omega: omega.into(),
            omega_dot: ramp(3),
            ..TankInputs::default()
        };
        self.tank.step(&over, h).unwrap();
        let impulse = self.tank.outputs_held(&over).impulse;
        self.take_impulse(impulse);
    }
}

fn host_rates(u: &Inputs, y: &[f64], acceleration: &Six) -> Vec<f64> {
    let (q, w) = (&y[..4], v(&y[4..]));
    let axes = rotation(q);
    let mut rate = vec![
        -(q[1] * w[0] + q[2] * w[1] + q[3] * w[2]) / 2.0,
        (q[0] * w[0] + q[2] * w[2] - q[3] * w[1]) / 2.0,
        (q[0] * w[1] + q[3] * w[0] - q[1] * w[2]) / 2.0,
        (q[0] * w[2] + q[1] * w[1] - q[2] * w[0]) / 2.0,
    ];
    let velocity = v(&y[10..]);
    rate.extend(acceleration.fixed_rows::<3>(3).iter());
    rate.extend(velocity.iter());
    rate.extend((axes * acceleration.fixed_rows::<3>(0)).iter());
    let (f, tau) = (v(&u.force.value), v(&u.torque.value));
    rate.push((axes * f).dot(&velocity) + tau.dot(&w));
    rate
}

fn runge_kutta(x: &[f64], h: f64, mut rates: impl FnMut(f64, &[f64]) -> Vec<f64>) -> Vec<f64> {
    let at = |d: &[f64], h: f64| -> Vec<f64> { x.iter().zip(d).map(|(x, d)| x + h * d).collect() };
    let k1 = rates(0.0, x);
    let k2 = rates(h / 2.0, &at(&k1, h / 2.0));
    let k3 = rates(h / 2.0, &at(&k2, h / 2.0));
    let k4 = rates(h, &at(&k3, h));
    (0..x.len()).map(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])).collect()
}

/// Returns a craft with one tank, off the craft's axis and inclined to it. The drag of its bobs does not
/// depend on the acceleration.
fn one(random: &mut Random) -> Parameters {
    let mut p = Parameters { tanks: 1, ..off_axis_craft(random) };
    let tank = &mut p.tank[0];
    (tank.damping_law, tank.zeta_amplitude) = (craft::DampingLaw::Constant, [0.0; craft::MODES]);
    tank.k = [0.0; craft::MODES];
    (tank.ball.travel, tank.ball.radius, tank.ball.contact_speed) = (1.0, 0.5, 0.05);
    (tank.q, tank.ball.drag) = ([1.0, 0.02, -0.03, 0.2], 1.5);
    p
}

fn off(a: [f64; 3], b: [f64; 3]) -> f64 {
    (v(&a) - v(&b)).norm()
}

/// Thrust acts backwards, then not at all, and then forwards. The body that carries the tank is integrated by Runge-Kutta steps
/// of 1 ms together with the liquid's states, as in Model Exchange, and events are located to 1e-16 s. Without thrust, momentum
/// and angular momentum are constant.
#[test]
fn a_host_that_integrates_slosh_tank_moves_as_spacecraft_and_keeps_momenta_and_energy() {
    let (mut seen, mut impulses) = ([0; 6], 0);
    for seed in 0..6 {
        let p = one(&mut Random::new(seed));
        let [back, forward] = [-0.2, 0.5].map(|g| thrust(g * p.craft.mass));
        let mut own = Spacecraft::new(&p, &back, 0.0, 1e-12).unwrap();
        let mut craft = Craft::new(&p);
        let mut has_settled = false;
        for (u, steps) in [(&back, 1_000), (&Inputs::default(), 5_000), (&forward, 16_000)] {
            craft.event(u);
            let start = craft.spacecraft_outputs(u);
            let mut dissipated = start.dissipated;
            for k in 0..steps {
                let before = craft.ball();
                craft.integrate(u, 1e-3);
                seen[craft.ball() as usize] += 1;
                has_settled |= before != craft.ball() && craft.ball() == BallState::Settled;
                if k % 10 > 0 && before == craft.ball() {
                    continue;
                }
                let now = craft.spacecraft_outputs(u);
                // The tolerance is the rounding error of a difference of energies of 1e3 J.
                assert!(now.dissipated >= dissipated - 1e-10, "{seed} {}", now.dissipated);
                dissipated = now.dissipated;
                // The Runge-Kutta method has an error of 1e-12.
                let balance = now.energy - now.work + now.dissipated
                    - (start.energy - start.work + start.dissipated);
                assert!(balance.abs() < 1e-10 * (1.0 + now.energy), "{seed} E {balance}");
                if u.force.value[2] == 0.0 {
                    let speed = now.mass * v(&now.velocity).norm();
                    assert!(off(now.momentum, start.momentum) < 1e-11 * speed, "{seed} P");
                    let spin = v(&now.angular_momentum).norm();
                    let gained = off(now.angular_momentum, start.angular_momentum);
                    assert!(gained < 1e-10 * (1.0 + spin), "{seed} H {gained}");
                }
            }
            own.step(u, 1e-3 * steps as f64).unwrap();
        }
        let (want, got) = (own.outputs(&forward), craft.spacecraft_outputs(&forward));
        assert_eq!(want.tank[0].ball_state, got.tank[0].ball_state, "{seed}");
        let errors = [
            off(want.omega, got.omega),
            off(want.velocity, got.velocity),
            want.dissipated - got.dissipated,
            off(want.position, got.position),
        ];
        println!("{seed}: w, V, E, r {errors:?}");
        // Each impact amplifies errors about ten times.
        assert!(errors[..3].iter().all(|error| error.abs() < 1e-8), "{seed} {errors:?}");
        // When liquid settles, a Spacecraft shifts its position to conserve the centre of mass. This body does not.
        assert!(errors[3] < if has_settled { 1e-2 } else { 1e-8 }, "{seed} {errors:?}");
        impulses += craft.impulses;
    }
    assert!(impulses > 30, "{impulses}");
    assert!(seen[1..4].iter().all(|count| *count > 3_000), "{seen:?}");
}

/// Motion along the axis does not rotate the body that carries the tank. Although the body receives the impulses one step late,
/// it therefore has the same velocity as a Spacecraft, also with only two steps a second, through a reversal of thrust, bounces
/// and settling at both ends.
#[test]
fn on_the_axis_the_host_s_velocity_is_exact_for_any_communication_step() {
    let mut p = Parameters { tanks: 1, ..Parameters::default() };
    p.tank[0].ball.travel = 0.6;
    p.tank[0].damping_law = craft::DampingLaw::Constant;
    for h in [0.5, 0.05] {
        let mut own = Spacecraft::new(&p, &thrust(60.0), 0.0, 1e-12).unwrap();
        let mut craft = Craft::new(&p);
        let (mut gained, mut seen) = (0.0, [0; 6]);
        for k in 0..(110.0 / h) as usize {
            let force = match k as f64 * h {
                ..10.0 => 60.0,
                10.0..50.0 => -11.8,
                _ => 60.0,
            };
            let u = thrust(force);
            own.step(&u, h).unwrap();
            craft.exchange(&u, h);
            gained += force * h;
            let (want, got) = (own.outputs(&u), craft.spacecraft_outputs(&u));
            seen[craft.ball() as usize] += 1;
            assert_eq!(want.tank[0].ball_state, got.tank[0].ball_state, "{h} {k}");
            let momentum = got.momentum[2] - gained;
            assert!(momentum.abs() < 1e-10 * (1.0 + gained.abs()), "{h} {k}: P {momentum}");
            let errors = [
                off(want.velocity, got.velocity),
                off(want.tank[0].ball_position, got.tank[0].ball_position),
                off(want.tank[0].ball_velocity, got.tank[0].ball_velocity),
                want.dissipated - got.dissipated,
            ];
            assert!(errors.iter().all(|error| error.abs() < 1e-9), "{h} {k} {errors:?}");
        }
        println!("{h}: states {seen:?}, impulses {}", craft.impulses);
        assert!(seen[1..4].iter().all(|count| *count > 0), "{h} {seen:?}");
        assert!(craft.impulses >= 8, "{h}");
    }
}

/// Six tanks off the craft's axis fly with thrust backwards, then forwards. In each step the body that carries the tank advances
/// first; body and tank exchange values that are linear over the step. The errors of rates, detached liquid and dissipated energy
/// are of second order in the communication step. The errors of velocity and of the momentum's direction are of first order,
/// because they depend on the attitude, which lags behind the impulses within a step.
#[test]
fn a_host_that_exchanges_at_communication_points_converges_to_the_spacecraft_s_motion() {
    let errors = |steps: usize| {
        let mut sum = [0.0; 5];
        for seed in 0..6 {
            let p = one(&mut Random::new(seed));
            let [back, forward] = [-0.2, 0.5].map(|g| thrust(g * p.craft.mass));
            let mut own = Spacecraft::new(&p, &back, 0.0, 1e-12).unwrap();
            let mut craft = Craft::new(&p);
            for (u, seconds) in [(&back, 1), (&forward, 3)] {
                own.step(u, seconds as f64).unwrap();
                (0..seconds * steps).for_each(|_| craft.exchange(u, 1.0 / steps as f64));
            }
            let (want, got) = (own.outputs(&forward), craft.spacecraft_outputs(&forward));
            let speed = v(&want.velocity).norm();
            for (sum, error) in sum.iter_mut().zip([
                off(want.omega, got.omega) / v(&want.omega).norm(),
                off(want.tank[0].ball_position, got.tank[0].ball_position),
                (want.dissipated / got.dissipated - 1.0).abs(),
                off(want.velocity, got.velocity) / speed,
                off(want.momentum, got.momentum) / v(&want.momentum).norm(),
            ]) {
                *sum += error / 6.0;
            }
        }
        sum
    };
    let [coarse, fine] = [50, 400].map(errors);
    println!("20 ms: w, ball, E, V, P {coarse:?}\n2.5 ms: {fine:?}");
    // With an eighth of the step an error of first order falls to an eighth, and an error of second order to a 64th.
    for i in 0..3 {
        assert!(fine[i] < coarse[i] / 12.0, "{i}: {coarse:?} {fine:?}");
    }
    for i in 3..5 {
        assert!(fine[i] < coarse[i] / 3.0, "{i}: {coarse:?} {fine:?}");
    }
    assert!(coarse.iter().all(|error| *error < 1e-2), "{coarse:?}");
}

/// Returns the tank of a random craft with one tank (function `one`), with its liquid in the state
/// `ball`, and its inputs. If the liquid slides, the acceleration in the inputs presses it against
/// the wall.
fn placed(seed: u64, ball: BallState) -> (SloshTank, TankInputs) {
    let mut random = Random::new(seed);
    let p = one(&mut random);
    let mut tank = SloshTank::new(&alone(&p), &TankInputs::default(), 0.0, 1e-12).unwrap();
    let mut words = tank.state().to_words();
    words[TankState::WORDS - 1] = ball as u64;
    tank.set_state(&TankState::from_words(&words).unwrap());
    let mut x = tank.continuous_states();
    // The liquid is put on the sphere of 0.5 m radius that its centre can reach.
    let center = V::new(0.0, 0.0, x[BALL + 2] + 0.5);
    let (n, rate) = (v(&random.vector::<3>(1.0)).normalize(), v(&random.vector::<3>(0.3)));
    let along = rate - n * n.dot(&rate);
    x[BALL..BALL + 3].copy_from_slice((center + n * 0.5).as_slice());
    x[BALL + 3..BALL + 6].copy_from_slice(along.as_slice());
    tank.set_continuous_states(&x);
    let u = TankInputs {
        a: Ramp { value: random.vector(1.0), slope: [0.0; 3] },
        omega: random.vector(0.5),
        omega_dot: Ramp { value: random.vector(0.5), slope: [0.0; 3] },
        ..TankInputs::default()
    };
    (tank, u)
}

const BALL: usize = 6 * craft::MODES + 2;
const STATES: [BallState; 4] =
    [BallState::Settled, BallState::Flying, BallState::Sliding, BallState::Light];

#[test]
fn force_and_torque_of_detached_liquid_equal_bias_minus_added_mass_times_acceleration() {
    for seed in 0..8 {
        for ball in STATES {
            let (mut tank, u) = placed(seed, ball);
            let out = tank.outputs_held(&u);
            let given =
                Six::from_fn(|i, _| if i < 3 { u.a.value[i] } else { u.omega_dot.value[i - 3] });
            let wrench = Six::from_row_slice(&out.bias) - Craft::added(&out.added_mass) * given;
            let (f, tau) = (out.tank.force, out.tank.torque);
            let shown = Six::new(f[0], f[1], f[2], tau[0], tau[1], tau[2]);
            assert!((wrench - shown).norm() < 1e-12 * (1.0 + shown.norm()), "{seed} {ball:?}");
        }
    }
}

#[test]
fn directional_derivatives_equal_differences_of_rates_and_outputs() {
    for seed in 0..8 {
        for ball in STATES {
            let (mut tank, u) = placed(seed, ball);
            let mut random = Random::new(seed + 50);
            let (mut dx, mut du) = ([0.0; TANK_STATES], [0.0; TANK_INPUTS]);
            dx.copy_from_slice(&random.vector::<TANK_STATES>(1.0));
            du[..9].copy_from_slice(&random.vector::<9>(1.0));
            let x = tank.continuous_states();
            let shown = |out: &SloshTankOutputs| -> Vec<f64> {
                let tank = &out.tank;
                let vectors = [tank.force, tank.torque, out.center_of_mass, tank.ball_velocity];
                let inertia = out.inertia.as_flattened();
                vectors
                    .iter()
                    .flatten()
                    .chain(inertia)
                    .chain(&out.bias)
                    .chain(&out.added_mass)
                    .copied()
                    .collect()
            };
            let mut at = |s: f64| {
                tank.set_continuous_states(&std::array::from_fn(|i| x[i] + s * dx[i]));
                let by = |ramp: Ramp, from: usize| Ramp {
                    value: [0, 1, 2].map(|i| ramp.value[i] + s * du[from + i]),
                    slope: ramp.slope,
                };
                let moved = TankInputs {
                    a: by(u.a, 0),
                    omega: [0, 1, 2].map(|i| u.omega[i] + s * du[3 + i]),
                    omega_dot: by(u.omega_dot, 6),
                    ..u
                };
                (tank.derivatives(&moved), shown(&tank.outputs_held(&moved)))
            };
            let h = 1e-5;
            let ((rates_1, out_1), (rates_2, out_2)) = (at(h), at(-h));
            at(0.0);
            let rates = tank.directional_derivative(&u, &dx, &du);
            let out = shown(&tank.output_derivatives(&u, &dx, &du));
            let differences = rates_1.iter().zip(&rates_2).chain(out_1.iter().zip(&out_2));
            for (i, (d, (a, b))) in rates.iter().chain(&out).zip(differences).enumerate() {
                let want = (a - b) / (2.0 * h);
                // The tolerance includes the error of the differences, which is of second order, and rounding errors.
                let size = 1.0 + want.abs() + a.abs();
                assert!((d - want).abs() < 1e-7 * size, "{seed} {ball:?} {i}: {d} {want}");
            }
        }
    }
}

#[test]
fn a_saved_tank_with_detached_liquid_continues_bit_for_bit_and_a_refused_step_changes_no_state() {
    let p = one(&mut Random::new(3));
    let u = TankInputs { a: Ramp::held([0.05, 0.0, -0.3]), ..TankInputs::default() };
    let mut tank = SloshTank::new(&alone(&p), &u, 0.0, 1e-8).unwrap();
    let mut seen = [0; 6];
    for k in 0..40 {
        let words = tank.state().to_words();
        seen[words[TankState::WORDS - 1] as usize] += 1;
        let mut other =
            SloshTank::resume(&alone(&p), &TankState::from_words(&words).unwrap(), 1e-8);
        let wrong = TankInputs { omega: [f64::NAN; 3], ..u };
        tank.step(&wrong, 0.37).unwrap_err();
        tank.step(&u, 0.37).unwrap();
        other.step(&u, 0.37).unwrap();
        assert_eq!(tank.state(), other.state(), "{k}");
    }
    assert!(seen[1] > 0 && seen[2] > 1 && seen[3] > 5, "{seen:?}");
    let words = tank.state().to_words();
    for wrong in [0, 6, u64::MAX] {
        let mut words = words;
        words[TankState::WORDS - 1] = wrong;
        assert_eq!(TankState::from_words(&words), None);
    }
}

#[test]
fn a_tank_that_allows_detached_liquid_moves_bit_identically_until_the_liquid_detaches() {
    let u = TankInputs {
        a: Ramp { value: [0.3, -0.2, 9.0], slope: [0.1, 0.0, 0.0] },
        omega: [0.02, 0.1, 0.05],
        omega_dot: Ramp::held([0.01, 0.0, -0.02]),
        ..TankInputs::default()
    };
    let mut p = TankParameters { host: Some(Parameters::default().craft), ..Default::default() };
    let mut without = SloshTank::new(&p, &u, 0.0, 1e-7).unwrap();
    p.tank.ball.travel = 0.6;
    let mut with = SloshTank::new(&p, &u, 0.0, 1e-7).unwrap();
    for _ in 0..50 {
        without.step(&u, 0.1).unwrap();
        with.step(&u, 0.1).unwrap();
        assert_eq!(with.continuous_states()[..BALL], without.continuous_states()[..BALL]);
    }
    let [mut with, mut without] = [with, without].map(|mut tank| tank.outputs(&u));
    with.tank.ball_position = without.tank.ball_position;
    with.tank.ranges = without.tank.ranges;
    assert_eq!(with, without);
    without.impulse[0] = 1.0;
    assert_ne!(with, without);
}

#[test]
fn detached_liquid_on_a_host_is_refused_without_the_hosts_mass_properties() {
    let p = alone(&one(&mut Random::new(0)));
    let said = |change: fn(&mut TankParameters)| {
        let mut p = p;
        change(&mut p);
        p.problems().join("\n")
    };
    assert_eq!(said(|_| ()), "");
    for (said, word) in [
        (said(|p| p.host = None), "host.mass"),
        (said(|p| p.coupling = Coupling::Lumped), "coupling = split"),
        (said(|p| p.coupling = Coupling::RigidBody), "coupling = split"),
        (said(|p| (p.tank.fill.points, p.tank.liquid_0) = (craft::POINTS, 300.0)), "fill.points"),
        (said(|p| p.tank.ball.restitution = 1.1), "restitution"),
        (said(|p| p.tank.ball.travel = f64::NAN), "travel = NaN"),
    ] {
        let has_remedy = said.contains("allowed") || said.contains(": set ");
        assert!(said.contains(word) && has_remedy, "{word}: {said}");
    }
}

#[test]
fn random_tanks_on_hosts_give_finite_results_without_allocation() {
    for seed in 0..40 {
        let mut random = Random::new(seed + 500);
        let mut p = one(&mut random);
        p.max_steps = 20_000;
        p.tank[0].ball.restitution = [0.0, 0.9, random.between(0.0, 0.9)][random.below(3)];
        p.tank[0].ball.contact_speed = random.magnitude(1e-6, 1.0);
        p.tank[0].ball.drag = [0.0, random.magnitude(1e-3, 10.0)][random.below(2)];
        let mut tank = SloshTank::new(&alone(&p), &TankInputs::default(), 0.0, 1e-7).unwrap();
        let mut w = [0.0; 3];
        for k in 0..100 {
            let size = random.magnitude(1e-4, 1.0);
            let u = TankInputs {
                a: Ramp::held(random.vector(size)),
                omega: w,
                omega_dot: Ramp::held(random.vector(0.1)),
                ..TankInputs::default()
            };
            let h = random.magnitude(1e-6, 1.0);
            let counted = allocation_counter::measure(|| {
                let done = tank.step(&u, h);
                assert!(done.is_ok(), "{seed} {k}: {done:?}");
                tank.event_indicators(&u);
                tank.take_event(&u).unwrap();
            });
            assert_eq!(counted.count_total, 0, "{seed} {k}");
            w = [0, 1, 2].map(|i| 0.9 * (w[i] + u.omega_dot.value[i] * h));
            let out = tank.outputs(&u);
            assert!(tank.continuous_states().iter().chain(&out.impulse).all(|x| x.is_finite()));
        }
    }
}

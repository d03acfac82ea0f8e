//! A craft whose tanks drain, each with its contents as in `contents.rs`.
//!
//! ```text
//! M [a; w'] = [ f - w x (w x S) + sum of force ; tau - h_w' - w x (I w + h_w) + sum of torque ]
//! M = M_R + sum of m u u^T
//! ```
//!
//! as in `motion.rs`, with the loads of what flows within. When a flow jumps, its K and L do: an impulse, the same
//! equations with the flow's slope alone.

use crate::contents::{Contents, Drains, Outflow, Place, normalise_bobs, vec_of};
use crate::integrator::{RATE_FLOOR, StepError};
use crate::motion::SCALE_TIME;
use crate::outputs::{Now, TankNow};
use crate::parameters::{Mount, Parameters, Tank};
use crate::rigid::{Factors, Rigid};
use crate::sizes::{MODES, TANKS};
use crate::state::{INPUTS, Inputs, Line, STATES, State, index};
use crate::vector::{
    Dual, Number, Vec3, add, constant, cross, dot, largest, rotation, scale, sub, times,
    transposed_times, unit_quaternion,
};

/// What acts from outside, as numbers of the wanted kind.
pub struct Acting<T> {
    pub force: Vec3<T>,
    /// tau - h_w'
    pub torque: Vec3<T>,
    pub h_wheels: Vec3<T>,
    /// Outflow of each tank.
    pub flow: [T; TANKS],
    /// Its slope.
    pub flow_slope: [f64; TANKS],
}

impl Acting<f64> {
    pub fn of(inputs: &Inputs, t: f64) -> Acting<f64> {
        let Inputs { force, torque, h_wheels, mass_flow } = inputs;
        Acting {
            force: force.at(t),
            torque: sub(torque.at(t), h_wheels.slope),
            h_wheels: h_wheels.at(t),
            flow: mass_flow.map(|flow| flow.at(t)),
            flow_slope: mass_flow.map(|flow| flow.slope),
        }
    }
}

impl Acting<f64> {
    /// Flows, and nothing else.
    fn flowing(flow: [f64; TANKS], slope: [f64; TANKS]) -> Acting<f64> {
        let lines = core::array::from_fn(|i| Line { value: flow[i], slope: slope[i] });
        Acting::of(&Inputs { mass_flow: lines, ..Inputs::default() }, 0.0)
    }
}

impl Acting<Dual> {
    /// With derivatives along du.
    pub fn along(inputs: &Inputs, du: &[f64; INPUTS]) -> Acting<Dual> {
        let now = Acting::of(inputs, 0.0);
        let with = |x: Vec3, at: usize| [0, 1, 2].map(|i| Dual::of(x[i], du[at + i]));
        Acting {
            force: with(now.force, 0),
            torque: with(now.torque, 3),
            h_wheels: with(now.h_wheels, 6),
            flow: core::array::from_fn(|i| Dual::of(now.flow[i], du[9 + i])),
            flow_slope: now.flow_slope,
        }
    }
}
/// A craft with at least one tank that can drain.
#[derive(Clone, Debug)]
pub struct Draining {
    craft: Rigid,
    mount: Mount,
    gravity: Vec3,
    tanks: Vec<Place>,
}

/// The same over one step.
pub struct Run<'a> {
    pub craft: &'a Draining,
    pub inputs: &'a Inputs,
}

impl Drains<STATES> for Run<'_> {
    fn rates(&self, t: f64, x: &[f64; STATES]) -> [f64; STATES] {
        self.craft.evaluate(x, &Acting::of(self.inputs, t)).0
    }

    fn error_scale(&self, x: &[f64; STATES], rate: &[f64; STATES], h: f64) -> [f64; STATES] {
        let time = h.min(SCALE_TIME);
        let size = |at: usize| largest(vec_of(x, at)) + largest(vec_of(rate, at)) * time;
        let turn = RATE_FLOOR + size(index::OMEGA);
        // Work, energies and liquid follow from the rest.
        let mut scale = [f64::INFINITY; STATES];
        scale[..index::OMEGA].fill(1.0);
        scale[index::OMEGA..index::POSITION].fill(turn);
        scale[index::POSITION..index::VELOCITY].fill(RATE_FLOOR + size(index::POSITION));
        scale[index::VELOCITY..index::WORK].fill(RATE_FLOOR + size(index::VELOCITY));
        for at in (index::BOBS..index::LIQUID).step_by(6) {
            scale[at..at + 3].fill(1.0);
            scale[at + 3..at + 6].fill(turn + size(at + 3));
        }
        scale
    }

    fn normalise(&self, x: &mut [f64; STATES], _: f64) {
        let q = unit_quaternion([x[0], x[1], x[2], x[3]]);
        x[index::Q..index::Q + 4].copy_from_slice(&q);
        normalise_bobs(&mut x[index::BOBS..index::LIQUID]);
    }

    fn outflows(&self) -> impl Iterator<Item = Outflow<'_>> {
        self.craft.outflows(&self.inputs.mass_flow)
    }
}

impl Draining {
    /// `None` if no tank can drain.
    pub fn new(p: &Parameters) -> Option<Draining> {
        let tanks = &p.tank[..p.tanks];
        tanks.iter().any(|tank| tank.fill.points > 0).then(|| Draining {
            craft: p.craft.rigid(),
            mount: p.mount,
            gravity: p.gravity,
            tanks: tanks.iter().map(|tank| Place::new(&tank.resolve())).collect(),
        })
    }

    /// The tanks as they are with that much liquid.
    pub fn tanks<'a>(&'a self, x: &'a [f64; STATES]) -> [Tank; TANKS] {
        core::array::from_fn(|i| match self.tanks.get(i) {
            Some(place) => Tank { liquid_0: x[index::LIQUID + i], ..place.tank }.resolve(),
            None => Tank::default(),
        })
    }

    fn outflows<'a>(&'a self, flow: &'a [Line; TANKS]) -> impl Iterator<Item = Outflow<'a>> {
        let drains = self.tanks.iter().enumerate().filter(|(_, place)| place.drains());
        drains.map(|(i, place)| {
            let (at, tank) = (index::LIQUID + i, i + 1);
            Outflow { place, flow: flow[i], at, tank }
        })
    }

    /// Whether the liquids are within their tables.
    pub fn check(&self, x: &[f64; STATES]) -> Result<(), StepError> {
        self.outflows(&Default::default()).try_for_each(|flow| flow.check(x[flow.at], 0.0))
    }

    /// Takes account of the flows being `flow` from now on: where they jump, so does the momentum of what flows within,
    /// by an impulse. What it makes of the energy has gone with the flow. Returns whether one jumps.
    pub fn set_flow(&self, state: &mut State, flow: &[Line; TANKS]) -> bool {
        let now = flow.map(|flow| flow.value);
        if now == state.flow {
            return false;
        }
        let energy = |x: &[f64; STATES], flow: [f64; TANKS]| {
            self.evaluate(x, &Acting::flowing(flow, [0.0; TANKS])).1.outputs(x).energy
        };
        let before = energy(&state.x, state.flow);
        let jump = core::array::from_fn(|i| now[i] - state.flow[i]);
        // Rates are linear in the slopes.
        let [with, without] = [jump, [0.0; TANKS]]
            .map(|slope| self.evaluate(&state.x, &Acting::flowing(now, slope)).0);
        let x = &mut state.x;
        let mut add = |at: usize| {
            for i in at..at + 3 {
                x[i] += with[i] - without[i];
            }
        };
        add(index::OMEGA);
        add(index::VELOCITY);
        for at in (index::BOBS..index::LIQUID).step_by(6) {
            add(at + 3);
        }
        state.x[index::DRAINED] += before - energy(&state.x, now);
        state.flow = now;
        true
    }

    /// The rates of the states, and what the outputs follow from.
    pub fn evaluate<T: Number>(
        &self,
        x: &[T; STATES],
        acting: &Acting<T>,
    ) -> ([T; STATES], Now<T>) {
        let c = T::constant;
        let zero = constant::<T>([0.0; 3]);
        let q = unit_quaternion([x[0], x[1], x[2], x[3]]);
        let axes = rotation(&q);
        let w = vec_of(x, index::OMEGA);
        let velocity = transposed_times(&axes, vec_of(x, index::VELOCITY));
        let contents: [Option<Contents<T>>; TANKS] = core::array::from_fn(|i| {
            let place = self.tanks.get(i)?;
            let liquid = x[index::LIQUID + i];
            let bobs = &x[index::bob(i, 0)..index::bob(i, 0) + 6 * MODES];
            Some(place.contents(bobs, w, liquid, acting.flow[i], acting.flow_slope[i]))
        });
        let all = || contents.iter().flatten();
        let rigid = all().fold(self.craft.lift::<T>(), |sum, tank| sum.and(&tank.rigid));
        let [centripetal, gyroscopic] = rigid.inertial_wrench(zero, w, zero);
        let mut force = sub(acting.force, centripetal);
        let mut torque = sub(acting.torque, add(gyroscopic, cross(w, acting.h_wheels)));
        let mut matrix = rigid.mass_matrix();
        for tank in all() {
            let [f, tau] = tank.loads();
            (force, torque) = (add(force, f), add(torque, tau));
            tank.add_rods(&mut matrix);
        }
        if self.mount == Mount::Pivot {
            let a = transposed_times(&axes, constant(self.gravity)).map(|x| -x);
            for i in 0..3 {
                let coupled = [matrix[3 + i][0], matrix[3 + i][1], matrix[3 + i][2]];
                torque[i] = torque[i] - dot(coupled, a);
            }
            for i in 0..3 {
                for k in 0..6 {
                    let one = c(if i == k { 1.0 } else { 0.0 });
                    (matrix[i][k], matrix[k][i]) = (one, one);
                }
            }
            force = a;
        }
        let [a, w_d] = Factors::of(&matrix).solve([force, torque]);

        let mut rate = [c(0.0); STATES];
        let mut put = |at: usize, numbers: &[T]| {
            rate[at..at + numbers.len()].copy_from_slice(numbers);
        };
        // q o (0, w)/2
        let v = [q[1], q[2], q[3]];
        let turned = add(scale(q[0], w), cross(v, w)).map(|x| x * 0.5);
        put(index::Q, &[dot(v, w) * -0.5, turned[0], turned[1], turned[2]]);
        put(index::OMEGA, &w_d);
        if self.mount == Mount::Free {
            put(index::POSITION, &vec_of(x, index::VELOCITY));
            put(index::VELOCITY, &times(&axes, a));
        }
        put(index::WORK, &[dot(acting.force, velocity) + dot(acting.torque, w)]);
        let dissipation = all().fold(c(0.0), |sum, tank| sum + tank.dissipation);
        put(index::DISSIPATED, &[dissipation]);
        let on_pivot = self.mount == Mount::Pivot;
        let mut drained = c(0.0);
        let mut tanks = [(); TANKS].map(|()| None);
        for (i, (tank, place)) in all().zip(&self.tanks).enumerate() {
            if place.drains() {
                put(index::LIQUID + i, &[-acting.flow[i]]);
                drained = drained + tank.drained(velocity, w, [a, w_d], on_pivot);
            }
            place.put_rates(tank, [a, w_d], |at, numbers| put(index::bob(i, 0) + at, numbers));
            tanks[i] = Some(TankNow {
                rigid: tank.rigid,
                stir: tank.stir,
                wrench: tank.wrench(a, w, w_d),
                bobs: place.bobs_now(tank),
            });
        }
        put(index::DRAINED, &[drained]);
        let now = Now {
            a,
            w,
            w_d,
            velocity,
            h_wheels: acting.h_wheels,
            axes,
            mount: self.mount,
            craft: self.craft,
            tanks,
        };
        (rate, now)
    }
}

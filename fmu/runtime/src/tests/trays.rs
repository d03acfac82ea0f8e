//! Test model with trays that fill, x_i' = q_i. A parameter gives the lengths of its arrays. The derivatives of one output vanish
//! where all levels and inflows are 0.

use crate::clock::Instant;
use crate::model::StepFailure;
use crate::model::{Dynamics, Model};
use crate::table::{About, Scalar, Table, scalar_count, scalars};
use crate::variable::Dimension::{Fixed, Sized};
use crate::variable::Variable;

pub const MOST: usize = 3;

/// The number of trays, and arrays that have no effect: one with an element per tray, one with an element per side, and one
/// of length zero.
#[derive(Clone, Debug)]
pub struct Parameters {
    rows: u8,
    w: [f64; 2 * MOST],
    m: [f64; 2 * MOST],
    k: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        let w = core::array::from_fn(|i| i as f64);
        Parameters { rows: 2, w, m: w.map(|x| 10.0 + x), k: 0.5 }
    }
}

#[derive(Clone, Copy, Debug, Default)]
pub struct Inputs {
    q: [[f64; 2]; MOST],
}

#[derive(Clone, Debug)]
pub struct Trays {
    x: [f64; MOST],
}

type V = Variable<Trays>;

#[rustfmt::skip]
static VARIABLES: &[Variable<Trays>] = &[
    V::output("level", |_, _| 0.0, "m", "Levels").shape(&[Sized("rows", MOST)]).is_state(|i| i).nominal(5.0),
    V::output("square", |square, _| *square, "m2", "Squares of levels and of what flows in")
        .depends_on(&["level", "q"]),
    V::derivative("der(level)", |i| i, "m/s", "Rates").shape(&[Sized("rows", MOST)]).depends_on(&["q[]"]),
    V::input("q", |i, n| i.q[n].each_mut(), "m/s", "What flows in").shape(&[Sized("rows", MOST)])
        .range(-8.0, 8.0).nominal(4.0),
    V::count("rows", |p, _| p.rows.into(), |p, _, n| p.rows = n as u8, "Trays").between(1, MOST as i32),
    V::parameter("w", |p, i| &mut p.w[i], "m", "By tray").shape(&[Sized("rows", MOST), Fixed(2)]),
    V::parameter("m", |p, i| &mut p.m[i], "m", "By side").shape(&[Fixed(2), Sized("rows", MOST)]),
    V::parameter("k", |p, _| &mut p.k, "m", "Of all"),
];

static SCALARS: [Scalar<Trays>; scalar_count(VARIABLES)] = scalars(VARIABLES);

static TABLE: Table<Trays> = Table::new(
    About {
        model: "Trays",
        version: "1",
        description: "Trays that fill",
        events: "",
        event_indicators: 2,
        saved_words: MOST,
    },
    VARIABLES,
    &SCALARS,
);

impl Model for Trays {
    fn table() -> &'static Table<Self> {
        &TABLE
    }
}

impl Dynamics for Trays {
    type Parameters = Parameters;
    type Inputs = Inputs;
    type Outputs = f64;
    type Discrete = ();

    fn new(_: &Parameters, _: &Inputs, _: f64, _: f64) -> Result<Self, Vec<String>> {
        Ok(Trays { x: [1.0, 2.0, 4.0] })
    }

    fn save(&self, words: &mut Vec<u64>) {
        words.extend(self.x.map(f64::to_bits));
    }

    fn resume(_: &Parameters, words: &[u64], _: f64) -> Option<Self> {
        Some(Trays { x: <[u64; MOST]>::try_from(words).ok()?.map(f64::from_bits) })
    }

    fn step(&mut self, inputs: &Inputs, h: f64) -> Result<(), StepFailure> {
        for (x, [q, slope]) in self.x.iter_mut().zip(inputs.q) {
            *x += h * (q + 0.5 * h * slope);
        }
        Ok(())
    }

    fn outputs(&mut self, inputs: &Inputs) -> f64 {
        let squares = self.x.iter().map(|x| x * x).sum::<f64>();
        squares + inputs.q.iter().map(|q| q[0] * q[0]).sum::<f64>()
    }

    fn continuous_states(&self) -> &[f64] {
        &self.x
    }

    fn set_continuous_states(&mut self, x: &[f64]) {
        self.x.copy_from_slice(x);
    }

    fn set_time(&mut self, _: Instant) {}

    fn derivatives(&mut self, inputs: &Inputs, x_dot: &mut [f64]) {
        x_dot.copy_from_slice(&inputs.q.map(|q| q[0]));
    }

    fn directional_derivative(
        &mut self,
        inputs: &Inputs,
        along: &Inputs,
        dx: &[f64],
        dx_dot: &mut [f64],
    ) -> f64 {
        dx_dot.copy_from_slice(&along.q.map(|q| q[1]));
        let of_inputs = inputs.q.iter().zip(&along.q).map(|(q, dq)| 2.0 * q[0] * dq[1]);
        self.x.iter().zip(dx).map(|(x, dx)| 2.0 * x * dx).sum::<f64>() + of_inputs.sum::<f64>()
    }

    fn event_indicators(&mut self, _: &Inputs, indicators: &mut [f64]) {
        indicators.copy_from_slice(&[0.25, -0.5]);
    }
}

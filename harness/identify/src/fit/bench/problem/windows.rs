//! The search of the bench from afar, over parts of the recordings that grow or that are loudest.

use anyhow::{Context, Result};
use nalgebra::{DMatrix, DVector};
use names::hubslosh::friction;

use super::{Answer, Problem};
use crate::fit::minimum::{self, End, SumOfSquares};
use crate::input::recording::Recording;
use crate::model::bench::unknown::Scale;
use crate::tuning::{
    BENCH_DECREMENT, BENCH_FIRST_STEP, LOUDEST, MOST_SETS, NOISE_FACTOR, RUN_IN, SHORTEST_GROWTH,
    WINDOW_JUMP, WINDOW_PRIOR,
};

/// All of the recordings at once.
const WHOLE: [f64; 1] = [1.0];

/// End of a search from afar, over all recordings or a part of them; the answer is with the stacked innovations.
pub type Rough = minimum::Minimum<(Answer, DVector<f64>), f64>;

impl Rough {
    /// Mean square of the stacked innovations.
    fn mean_square(&self) -> f64 {
        let e = &self.answer.1;
        e.norm_squared() / e.len() as f64
    }
}

impl Problem<'_> {
    /// Searches from x until steps would lessen the sum of squares by less than this part of it.
    ///
    /// # Errors
    /// If the FMU refuses the start, or a difference.
    pub fn search(&self, x: &[f64], part: f64) -> Result<Rough> {
        let end = End { decrement: BENCH_DECREMENT, part, most: MOST_SETS };
        minimum::search(
            self,
            &self.inside(x),
            vec![BENCH_FIRST_STEP; x.len()],
            end,
            &mut |_, _, _| {},
        )
    }

    /// The same over windows of the recordings that grow, each from the estimate of the one before.
    ///
    /// A start whose slosh frequency is 20 % off is out of phase after a few cycles; over a whole
    /// recording its error has as many minima as there are cycles. Over the beginning it has one,
    /// and as the window grows the estimate stays within its reach. If the residual's mean square rises by the factor [`WINDOW_JUMP`]
    /// from one window to the next (a resonance or rotary slosh begins), the window grows in smaller steps.
    pub fn search_growing(
        &self,
        x: &[f64],
        windows: &[f64],
        progress: &mut dyn FnMut(String),
    ) -> Result<Rough> {
        let mut to_come: Vec<f64> = windows.iter().rev().copied().collect();
        let (mut from, mut last) = (x.to_vec(), None);
        // the last window, its residual, its estimate; none once a leap was taken all the same
        let mut before: Option<(f64, f64, Vec<f64>)> = None;
        let mut careful = true;
        while let Some(window) = to_come.pop() {
            let part: Vec<Recording> =
                self.recordings.iter().map(|r| r.beginning(window)).collect();
            let found = self.search_part(x, &from, &part)?;
            let residual = found.mean_square();
            progress(format!("window of {:.0} %: mean square {residual:.3e}", 100.0 * window));
            if let Some((reached, less, estimate)) =
                before.take_if(|b| residual > WINDOW_JUMP * b.1)
            {
                if window - reached > SHORTEST_GROWTH {
                    to_come.extend([window, 0.5 * (reached + window)]);
                    from.clone_from(&estimate);
                    before = Some((reached, less, estimate));
                    continue;
                }
                careful = false;
            }
            if careful {
                before = Some((window, residual, found.x.clone()));
            }
            from.clone_from(&found.x);
            last = Some(found);
        }
        let mut rough = last.context("there is no window")?;
        rough.jacobian *= NOISE_FACTOR;
        Ok(rough)
    }

    /// The same over the loudest parts, from x; over the whole recordings where they have none.
    pub fn search_loudest(&self, x: &[f64]) -> Result<Rough> {
        let Some(part) = self.loudest() else { return self.search_growing(x, &WHOLE, &mut |_| {}) };
        let mut rough = self.search_part(x, x, &part)?;
        let rows = |all: &[Recording]| all.iter().map(|r| r.time.len()).sum::<usize>() as f64;
        rough.jacobian *= NOISE_FACTOR * (rows(self.recordings) / rows(&part)).sqrt();
        Ok(rough)
    }

    /// The loudest parts of the recordings; `None` where one has none.
    pub fn loudest(&self) -> Option<Vec<Recording>> {
        self.recordings.iter().map(|r| r.loudest(LOUDEST, RUN_IN)).collect()
    }

    /// Searches over parts of the recordings from x. A wide prior ([`WINDOW_PRIOR`]) holds each parameter near its first start,
    /// because a short window does not determine all. Noise of [`NOISE_FACTOR`] times the gyro's covers what the model cannot
    /// follow yet.
    fn search_part(&self, first: &[f64], x: &[f64], part: &[Recording]) -> Result<Rough> {
        let mut problem = Problem { recordings: part, ..self.clone() };
        for (unknown, &x) in problem.unknowns.iter_mut().zip(first) {
            if let Some(name) = unknown.quantity.parameter() {
                // the friction's shape is left to the search that knows of its valleys
                let shape = matches!(name, friction::D | friction::OMEGA_S);
                let width = if shape { 0.4 * WINDOW_PRIOR } else { WINDOW_PRIOR };
                let value = unknown.scale.value(x);
                let size = match unknown.scale {
                    Scale::Log | Scale::Softplus(_) => value,
                    Scale::Logit(..) | Scale::Linear(_) => unknown.scale.slope(x).abs(),
                };
                unknown.prior = Some((value, width * size));
            }
        }
        for channel in &mut problem.channels {
            channel.noise.white *= NOISE_FACTOR;
        }
        problem.search(x, 1e-3)
    }
}

impl SumOfSquares for Problem<'_> {
    type Answer = (Answer, DVector<f64>);
    type Step = f64;

    fn names(&self) -> Vec<String> {
        self.names()
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        self.unknowns.iter().map(|unknown| unknown.ends().into()).collect()
    }

    fn at(&self, x: &[f64]) -> Result<Self::Answer> {
        let answer = self.answer(x)?;
        let e = self.stacked(&answer, x);
        Ok((answer, e))
    }

    fn residuals(answer: &Self::Answer) -> &DVector<f64> {
        &answer.1
    }

    fn derivatives(
        &self,
        x: &[f64],
        answer: &Self::Answer,
        steps: &mut [f64],
    ) -> Result<DMatrix<f64>> {
        let all: Vec<usize> = (0..x.len()).collect();
        let found = self.jacobian(x, &all, &answer.0.motion, steps)?;
        steps.copy_from_slice(&Problem::steps(&found));
        Ok(found)
    }
}

//! Starts of the acceleration's least squares, and which rows show no friction law because the hub sticks.
//!
//! At a given Stribeck speed and gyro bias the residual is linear in inertia, b, c and d. So a grid of Stribeck speeds needs one
//! linear least squares each, and the sum of squares along the grid shows every basin of the nonlinear problem. From one
//! fixed start the search ends in a basin with a Stribeck speed far beyond all rates, where c and d are indistinguishable.

use analysis::statistics::{deviation, mean, median};
use nalgebra::{DMatrix, DVector};

use super::{Problem, Rows, rough_inertia};
use crate::tuning::{
    CREEPS, FOLLOWED, FREE_TORQUE, LOADED, MOVING_SHARE, REST, SPEED_GRID, STILL, STILL_RUN,
};

/// Inertia, b, c, d and a constant torque, and the sum of squares.
type Linear = ([f64; 5], f64);

/// State of the hub at a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// The hub turns.
    Slips,
    /// The hub sticks, or nearly: the row is not used.
    Sticks,
    /// The hub stands still: the row shows the gyro's bias.
    Rests,
}

impl Rows {
    /// Returns the state of each row, given this bias. Rows of a run in which the hub sticks, and their neighbours, do not follow
    /// the Stribeck law. Only the middle half of a long run counts as rest: at its ends the hub may still creep.
    pub(super) fn states(&self, bias: f64) -> Vec<State> {
        let still = |rate: &f64| (rate - bias).abs() < STILL * self.noise;
        let count = self.rate.len();
        let mut states = vec![State::Slips; count];
        let mut from = 0;
        for part in self.rate.chunk_by(|a, b| still(a) == still(b)) {
            let to = from + part.len();
            if still(&part[0]) && part.len() >= STILL_RUN {
                states[from.saturating_sub(1)..(to + 1).min(count)].fill(State::Sticks);
                let end = part.len() / 4;
                let middle = &part[end..part.len() - end];
                if middle.len() >= self.shortest_rest() && self.is_flat(middle) {
                    states[from + end..to - end].fill(State::Rests);
                }
            }
            from = to;
        }
        states
    }

    /// Rows of the shortest part in which the hub rests.
    fn shortest_rest(&self) -> usize {
        (REST / self.step).ceil().max(STILL_RUN as f64) as usize
    }

    /// Returns true if these rates are one value and the gyro's noise. A drift shows in the difference of the halves.
    fn is_flat(&self, rate: &[f64]) -> bool {
        let (first, last) = rate.split_at(rate.len() / 2);
        let drift = (mean(last) - mean(first)).abs();
        deviation(rate) < 2.0 * self.noise
            && drift < CREEPS * self.noise * (4.0 / rate.len() as f64).sqrt()
    }

    /// Reading of the gyro while the hub rests, rad/s; `None` without such a part. `inertia` is a rough one, kg·m².
    fn reading_at_rest(&self, inertia: f64) -> Option<f64> {
        let largest = self.torque.iter().fold(0.0_f64, |most, t| most.max(t.abs()));
        let rows = self.time.len();
        let readings = |length: usize, rests: &dyn Fn(usize, usize) -> bool| -> Vec<f64> {
            let parts = (0..rows / length).map(|k| (k * length, (k + 1) * length));
            let flat = parts.filter(|(a, b)| self.is_flat(&self.rate[*a..*b]) && rests(*a, *b));
            flat.map(|(a, b)| mean(&self.rate[a..b])).collect()
        };
        let is_free =
            |a: usize, b: usize| self.torque[a..b].iter().all(|t| t.abs() <= FREE_TORQUE * largest);
        let free = readings(self.shortest_rest(), &is_free);
        let loaded = (LOADED / self.step).ceil() as usize;
        median(&free).or_else(|| median(&readings(loaded, &|a, b| self.resists(a, b, inertia))))
    }

    /// Returns true if the hub stands still under a torque that changes so much that a slipping hub would show it. At a steady rate
    /// friction is constant, so the rate would follow the integral of the torque, but for a line.
    fn resists(&self, from: usize, to: usize, inertia: f64) -> bool {
        let curve = |signal: &[f64]| -> Vec<f64> {
            let (n, mean) = (signal.len() as f64, mean(signal));
            let place = |k: usize| k as f64 - (n - 1.0) / 2.0;
            let slope = signal.iter().enumerate().map(|(k, v)| place(k) * v).sum::<f64>()
                / (n * (n * n - 1.0) / 12.0);
            signal.iter().enumerate().map(|(k, v)| v - mean - slope * place(k)).collect()
        };
        let torque: Vec<f64> = self.impulse[from..to].iter().map(|i| i / inertia).collect();
        let (torque, rate) = (curve(&torque), curve(&self.rate[from..to]));
        let square: f64 = torque.iter().map(|t| t * t).sum();
        let share = torque.iter().zip(&rate).map(|(t, w)| t * w).sum::<f64>() / square;
        self.noise < MOVING_SHARE * square.sqrt() && share.abs() < 0.5
    }
}

impl Problem {
    /// Reading of the gyro at rest in each recording, rad/s.
    pub(super) fn readings_at_rest(&self) -> Vec<Option<f64>> {
        let inertia = rough_inertia(&self.rows);
        self.rows.iter().map(|rows| rows.reading_at_rest(inertia)).collect()
    }

    /// The gyro's bias in each recording, roughly: `rests`, the readings at rest, else the mean where that explains the recording better
    /// than no bias.
    pub(super) fn rough_biases(&self, rests: &[Option<f64>]) -> Vec<f64> {
        (0..self.rows.len())
            .map(|index| {
                if let Some(rest) = rests[index] {
                    return rest;
                }
                let one = Problem { rows: vec![self.rows[index].clone()], ..self.clone() };
                let cost = |bias: f64| {
                    let costs = one.grid(&[bias]).into_iter().map(|(_, (_, cost))| cost);
                    costs.fold(f64::INFINITY, f64::min)
                };
                let mean = mean(&self.rows[index].rate);
                if cost(mean) < cost(0.0) { mean } else { 0.0 }
            })
            .collect()
    }

    /// Returns true if the hub clearly turns in each direction for long enough to show its dry friction. The few rows just before a
    /// hub stops would not do: their sign is uncertain, so any asymmetry explains them with its own c and d.
    pub(super) fn turns_both_ways(&self, biases: &[f64]) -> bool {
        [1.0, -1.0].iter().all(|way| {
            let of = |(rows, bias): (&Rows, &f64)| {
                let turns = |rate: &&f64| way * (**rate - bias) > STILL * rows.noise;
                rows.rate.iter().filter(turns).count() as f64 * rows.step
            };
            self.rows.iter().zip(biases).map(of).sum::<f64>() >= REST
        })
    }

    /// Starts in the lowest basins of the grid of Stribeck speeds; values `given` by the user replace those of the grid.
    pub(super) fn starts(&self, biases: &[f64], given: &[(usize, f64)]) -> Vec<Vec<f64>> {
        let grid = self.grid(biases);
        let cost = |k: usize| grid[k].1.1;
        let is_basin = |k: &usize| {
            let neighbours = [k.checked_sub(1), Some(k + 1).filter(|k| *k < grid.len())];
            neighbours.into_iter().flatten().all(|other| cost(*k) <= cost(other))
        };
        let mut basins: Vec<usize> = (0..grid.len()).filter(is_basin).collect();
        basins.sort_by(|a, b| cost(*a).total_cmp(&cost(*b)));
        let of_grid = |k: &usize| self.start(grid[*k].0, &grid[*k].1.0, biases);
        let mut starts: Vec<Vec<f64>> = basins.iter().take(FOLLOWED).map(of_grid).collect();
        if let (Some(mut own), false) = (starts.first().cloned(), given.is_empty()) {
            for (place, value) in given.iter().filter(|(place, _)| self.is_free(&[], *place)) {
                own[*place] = self.scales[*place].variable(self.inside(*place, *value));
            }
            starts.push(own);
        }
        starts
    }

    /// Variables of a start at a Stribeck speed.
    pub(super) fn start(&self, speed: f64, linear: &[f64; 5], biases: &[f64]) -> Vec<f64> {
        let [inertia, b, c, d, constant] = *linear;
        let dry = (c + d).max(f64::MIN_POSITIVE);
        let n = self.scales.len();
        let mut values = vec![0.0; n];
        values[..6].copy_from_slice(&[inertia, b, c, d, speed, (constant / dry).clamp(-0.5, 0.5)]);
        values[n - biases.len()..].copy_from_slice(biases);
        let variable =
            |(place, value): (usize, f64)| self.scales[place].variable(self.inside(place, value));
        values.into_iter().enumerate().map(variable).collect()
    }

    /// A Stribeck speed with the least squares there, for each speed of the grid that has one.
    pub(super) fn grid(&self, biases: &[f64]) -> Vec<(f64, Linear)> {
        let (first, last, count) = SPEED_GRID;
        let fastest = self
            .rows
            .iter()
            .zip(biases)
            .flat_map(|(rows, bias)| rows.inner().map(move |k| (rows.rate[k] - bias).abs()));
        let fastest = fastest.fold(0.0, f64::max);
        let ratio = (last / first).powf(1.0 / (count as f64 - 1.0));
        let speeds = (0..count).map(|k| fastest * first * ratio.powi(k as i32));
        speeds.filter_map(|speed| Some((speed, self.linear(speed, biases)?))).collect()
    }

    /// Linear least squares of I y + b ω + s (c + d exp(−(ω/ω_s)²)) + k = τ, with b, c, d ≥ 0.
    fn linear(&self, speed: f64, biases: &[f64]) -> Option<Linear> {
        const N: usize = 5;
        let (mut normal, mut right, mut square) =
            (DMatrix::<f64>::zeros(N, N), DVector::<f64>::zeros(N), 0.0);
        for (rows, bias) in self.rows.iter().zip(biases) {
            for k in rows.inner() {
                let weight = rows.weight[k - 1];
                if weight == 0.0 {
                    continue;
                }
                let w = rows.rate[k] - bias;
                let sign = (w / (1.25 * rows.noise)).tanh();
                let shape = (-(w / speed).powi(2)).exp();
                let row = [rows.acceleration(k), w, sign, sign * shape, 1.0];
                let row = DVector::from_row_slice(&row) * weight;
                let torque = weight * rows.torque[k];
                normal += &row * row.transpose();
                right += &row * torque;
                square += torque * torque;
            }
        }
        // a constant torque is friction that acts one way, if the hub turns that way alone
        let mut free: Vec<usize> = (0..if self.one_way { N - 1 } else { N }).collect();
        loop {
            let part = normal.select_rows(&free).select_columns(&free);
            // the columns differ by orders of magnitude
            let size = part.diagonal().map(|d| d.sqrt().max(f64::MIN_POSITIVE));
            let mut scaled = part.component_div(&(&size * size.transpose()));
            for i in 0..free.len() {
                scaled[(i, i)] += 1e-9;
            }
            let r = right.select_rows(&free).component_div(&size);
            let x = scaled.cholesky()?.solve(&r).component_div(&size);
            let worst = (0..free.len())
                .filter(|i| (1..=3).contains(&free[*i]) && x[*i] < 0.0)
                .min_by(|a, b| (x[*a] * size[*a]).total_cmp(&(x[*b] * size[*b])));
            if let Some(worst) = worst {
                free.remove(worst);
                continue;
            }
            let mut values = [0.0; N];
            free.iter().zip(x.iter()).for_each(|(place, value)| values[*place] = *value);
            let cost = square - x.dot(&right.select_rows(&free));
            return (values[0] > 0.0 && cost.is_finite()).then_some((values, cost));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::recording::Recording;
    use analysis::random::Random;

    /// Readings of a gyro with a bias of 0.003 rad/s at 50 Hz for 12 s.
    fn rows(torque: &dyn Fn(f64) -> f64, rate: &dyn Fn(f64) -> f64) -> Rows {
        let mut random = Random::new(3, 0);
        let time: Vec<f64> = (0..600).map(|k| 0.02 * f64::from(k)).collect();
        let rates = time.iter().map(|t| 0.003 + rate(*t) + 4e-4 * random.normal()).collect();
        let torques = time.iter().map(|t| torque(*t)).collect();
        Rows::new(&Recording::of("rest", time, torques, rates), false)
    }

    #[test]
    fn a_hub_that_resists_a_growing_torque_shows_the_bias() {
        let ramp = |t: f64| 0.002 * t;
        // it breaks away at 4 s
        let slips = |t: f64| 0.0023 * (t - 4.0).max(0.0).powi(2);
        let found = rows(&ramp, &slips).reading_at_rest(0.43).unwrap();
        assert!((found - 0.003).abs() < 2e-4, "{found}");
        // a steady rate under a steady torque is no rest, nor is a rate that follows the torque
        assert!(rows(&|_| 0.02, &|_| 0.4).reading_at_rest(0.43).is_none());
        assert!(rows(&ramp, &|t| 0.0023 * t * t).reading_at_rest(0.43).is_none());
    }
}

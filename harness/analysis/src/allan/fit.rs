//! Fits noise parameters to Allan variances, with confidence intervals and a test of the fit.
//!
//! Averaging times are octaves, because overlapping estimates closer than that add little information. The
//! coefficients N², B², K², … are estimated by generalized least squares: the octaves are weighted with the
//! inverse of their [`Covariance`], which contains their degrees of freedom, and the estimate is repeated
//! with the covariance of the noise that was found. Coefficients are not negative.
//!
//! A 95 % interval consists of the values of a coefficient that a test does not reject. The test compares the
//! unconstrained estimate with its distribution if the tested value is true and the other terms are fitted
//! again: mean, variance and skewness (Pearson's type III, which for one octave is its χ²).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::covariance::Covariance;
use super::{LONGEST, Noise, Term, overlapping};

const NORMAL: f64 = 1.96;
/// Limit of the test of a fit: its χ², converted to a standard normal deviate. If the noise model
/// is true, 1 record in 1,000 exceeds the limit.
const MISFIT: f64 = 3.1;
const ITERATIONS: usize = 12;
/// Largest number of short averaging times that a fit may leave out, and the longest averaging time
/// that it may leave out, s.
const LEFT_OUT: (usize, f64) = (8, 2.0);
/// Number of octaves of averaging times that a fit leaves out as a margin. A filter in the gyro
/// reduces the variance at short averaging times. A fit therefore leaves out the shortest octaves
/// until its test passes, and then this number of further octaves. They are left out because the
/// effect of the filter only halves with each octave, so that an octave that just passes the test
/// can still shift N by several standard deviations.
const BEYOND: usize = 2;
/// Shortest correlation time of a Gauss–Markov bias, as a multiple of the shortest averaging time.
/// A bias with a shorter correlation time cannot be distinguished from white noise.
const SHORTEST: f64 = 10.0;

/// Overlapping Allan variances of one record, at averages of 1, 2, 4, … samples up to a tenth of
/// the record.
///
/// - `step`: time between samples, s.
/// - `count`: number of samples of the record.
/// - `factors`: number of samples in each average.
/// - `variances`: Allan variance for each of the `factors`.
#[derive(Clone, Debug, PartialEq)]
pub struct Octaves {
    step: f64,
    count: usize,
    factors: Vec<usize>,
    variances: Vec<f64>,
}

/// An estimated value with its 95 % interval.
///
/// - `low`: lower end of the 95 % interval of the value. It is 0 if the record does not show this
///   noise, and NaN if the interval could not be computed.
/// - `high`: upper end of the 95 % interval of the value. It is infinite if the record is too
///   short, and NaN if the interval could not be computed.
/// - `error`: standard error of the value; NaN if the value is 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    pub value: f64,
    pub low: f64,
    pub high: f64,
    pub error: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlier {
    pub tau: f64,
    pub ratio: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    pub noise: Noise,
    pub terms: Vec<(Term, Estimate)>,
    pub bias_time: Option<Estimate>,
    pub from: f64,
    pub chi_squared: (f64, usize),
    /// True if the noise model passes the test of the fit. If the gyro had exactly this noise, at
    /// most 1 of 1,000 records would fail the test.
    pub fits: bool,
    pub worst: Outlier,
}

#[derive(Clone, Debug)]
struct State {
    coefficients: Vec<f64>,
    time: f64,
}

struct Problem<'a> {
    octaves: &'a Octaves,
    terms: &'a [Term],
    from: usize,
}

impl Octaves {
    pub fn from_samples(step: f64, samples: &[f64]) -> Octaves {
        let longest = samples.len() / LONGEST;
        let factors: Vec<usize> =
            (0..usize::BITS).map(|k| 1 << k).take_while(|m| *m <= longest).collect();
        let points = overlapping(step, samples, factors.iter().copied());
        let variances = points.iter().map(|point| point.variance).collect();
        Octaves { step, count: samples.len(), factors, variances }
    }

    /// Fits the noise terms `terms` to the octaves. The octaves before number `from`, which have
    /// the shortest averaging times, are left out. Returns `None` if the octaves show no noise, or
    /// if there are fewer octaves than parameters.
    pub fn fit(&self, terms: &[Term], from: usize) -> Option<Fit> {
        Problem { octaves: self, terms, from }.fit()
    }

    /// Fits white noise, flicker noise and a rate random walk. If χ² shows that this model does not
    /// fit, two other explanations are tried: short averaging times are left out, because a filter
    /// in the gyro may affect them, or a ramp or a Gauss–Markov bias is added. If no model fits,
    /// the fit of the three basic terms to all octaves is returned; its `fits` is then false.
    /// Returns `None` if no fit is possible ([`Octaves::fit`]).
    pub fn describe(&self) -> Option<Fit> {
        const BASIC: [Term; 3] = [Term::White, Term::Flicker, Term::Walk];
        let first = self.fit(&BASIC, 0)?;
        if first.fits {
            return Some(first);
        }
        let extras = [None, Some(Term::Ramp), Some(Term::Markov)];
        let out = |from: &usize| self.tau(*from) <= LEFT_OUT.1;
        let found = extras.into_iter().find_map(|extra| {
            let terms: Vec<Term> = BASIC.into_iter().chain(extra).collect();
            let mut froms = (0..=LEFT_OUT.0.min(self.factors.len())).filter(out);
            froms.find_map(|from| {
                let fits = |from: usize| self.fit(&terms, from).filter(|fit| fit.fits);
                let found = fits(from)?;
                Some(if from == 0 { found } else { fits(from + BEYOND).unwrap_or(found) })
            })
        });
        Some(found.unwrap_or(first))
    }

    fn tau(&self, k: usize) -> f64 {
        self.factors.get(k).map_or(f64::INFINITY, |m| *m as f64 * self.step)
    }
}

impl Problem<'_> {
    fn factors(&self) -> &[usize] {
        &self.octaves.factors[self.from..]
    }

    fn measured(&self) -> DVector<f64> {
        DVector::from_column_slice(&self.octaves.variances[self.from..])
    }

    fn taus(&self) -> Vec<f64> {
        (self.from..self.octaves.factors.len()).map(|k| self.octaves.tau(k)).collect()
    }

    fn markov(&self) -> Option<usize> {
        self.terms.iter().position(|term| *term == Term::Markov)
    }

    /// Returns the derivatives of the Allan variances (rows) with respect to the coefficients of
    /// the noise (columns). If there is a Gauss–Markov bias, the last column is the derivative with
    /// respect to the logarithm of its correlation time.
    fn jacobian(&self, state: &State) -> DMatrix<f64> {
        let taus = self.taus();
        let columns = self.terms.len() + usize::from(self.markov().is_some());
        DMatrix::from_fn(taus.len(), columns, |row, column| match self.terms.get(column) {
            Some(term) => term.variance(taus[row], state.time),
            None => {
                let by = 1e-4;
                let at =
                    |sign: f64| Term::Markov.variance(taus[row], state.time * (sign * by).exp());
                let size = self.markov().map_or(0.0, |k| state.coefficients[k]);
                size * (at(1.0) - at(-1.0)) / (2.0 * by)
            }
        })
    }

    fn tables(&self, time: f64) -> Covariance {
        let Octaves { step, count, .. } = *self.octaves;
        Covariance::new(step, count, self.factors(), self.terms, time)
    }

    fn modelled(&self, state: &State) -> DVector<f64> {
        let coefficients = DVector::from_column_slice(&state.coefficients);
        self.jacobian(state).columns(0, self.terms.len()) * coefficients
    }

    fn covariance(&self, tables: &Covariance, state: &State) -> DMatrix<f64> {
        tables.matrix(&state.coefficients)
    }

    /// Returns first estimates of the coefficients, because the weights of
    /// [`Problem::iterate_weights`] depend on the coefficients. The first estimates assume that the
    /// relative error of each Allan variance is proportional to the square root of its averaging
    /// time.
    fn start(&self) -> Option<State> {
        let measured = self.measured();
        let taus = self.taus();
        // Inverse variance of the relative error: the number of intervals of this length in the record.
        let weights = DVector::from_iterator(
            taus.len(),
            measured.iter().zip(&taus).map(|(value, tau)| 1.0 / (value * tau.sqrt())),
        );
        let solved = |time: f64| {
            let state = State { coefficients: vec![0.0; self.terms.len()], time };
            let jacobian = self.jacobian(&state).columns(0, self.terms.len()).into_owned();
            let weighted = DMatrix::from_fn(jacobian.nrows(), jacobian.ncols(), |row, column| {
                weights[row] * jacobian[(row, column)]
            });
            let (coefficients, miss) =
                not_negative(&weighted, &measured.component_mul(&weights), &[])?;
            Some((State { coefficients, time }, miss))
        };
        let (low, high) = self.times()?;
        let looks = if self.markov().is_some() { 60 } else { 0 };
        let time = |k: usize| low * (high / low).powf(k as f64 / f64::max(1.0, looks as f64));
        let states = (0..=looks).filter_map(|k| solved(time(k)));
        states.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(state, _)| state)
    }

    fn times(&self) -> Option<(f64, f64)> {
        let taus = self.taus();
        let (first, last) = (taus.first()?, taus.last()?);
        Some(((SHORTEST * first).min(*last), *last))
    }

    /// Repeats the generalized least squares, each time with weights from the last result, until
    /// the coefficients of the noise converge. `state` has the first coefficients and the first
    /// correlation time. If `fixed` is the index and the value of a coefficient, this coefficient
    /// and the correlation time are not fitted. The precomputed covariances `tables` are updated
    /// when the correlation time changes.
    fn iterate_weights(
        &self,
        mut state: State,
        fixed: Option<(usize, f64)>,
        tables: &mut Covariance,
    ) -> Option<State> {
        let (low, high) = self.times()?;
        for iteration in 0..ITERATIONS {
            let lower = factored(&self.covariance(tables, &state))?.l();
            // The first weights come from the start values of all coefficients, because the fixed coefficient alone might
            // be 0, and with it the noise.
            if let (0, Some((place, value))) = (iteration, fixed) {
                state.coefficients[place] = value;
            }
            let mut measured = self.measured();
            let mut jacobian = self.jacobian(&state);
            let mut free: Vec<usize> = (0..jacobian.ncols()).collect();
            if let Some((place, value)) = fixed {
                measured -= jacobian.column(place) * value;
                free.retain(|k| *k != place && *k < self.terms.len());
            }
            jacobian = jacobian.select_columns(&free);
            let either: Vec<usize> =
                (0..free.len()).filter(|k| free[*k] >= self.terms.len()).collect();
            let weighted = lower.solve_lower_triangular(&jacobian)?;
            let values = lower.solve_lower_triangular(&measured)?;
            let (solved, _) = not_negative(&weighted, &values, &either)?;
            let before = state.clone();
            for (k, value) in free.iter().zip(solved) {
                match state.coefficients.get_mut(*k) {
                    Some(coefficient) => *coefficient = value,
                    None => {
                        let time = state.time * value.clamp(-0.5, 0.5).exp();
                        state.time = time.clamp(low, high);
                    }
                }
            }
            if state.coefficients.iter().all(|c| *c == 0.0) {
                return None;
            }
            if state.time != before.time {
                *tables = self.tables(state.time);
            }
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-7 * a.abs().max(b.abs());
            let mut pairs = state.coefficients.iter().zip(&before.coefficients);
            if pairs.all(|(a, b)| near(*a, *b)) && near(state.time, before.time) {
                break;
            }
        }
        Some(state)
    }

    /// Estimates the coefficients of the noise by generalized least squares with the covariance
    /// matrix `covariance` of the Allan variances, linearised at `state`. Unlike in the final fit, coefficients may be
    /// negative. Returns the estimates, the matrix that computes them from the measured variances,
    /// and their covariance. If there is a Gauss–Markov bias, the last estimate is the change of
    /// the logarithm of its correlation time.
    fn unconstrained(
        &self,
        state: &State,
        covariance: &DMatrix<f64>,
    ) -> Option<(DVector<f64>, DMatrix<f64>, DMatrix<f64>)> {
        let cholesky = factored(covariance)?;
        let mut jacobian = self.jacobian(state);
        if jacobian.ncols() > self.terms.len() && jacobian.column(self.terms.len()).norm() == 0.0 {
            jacobian = jacobian.columns(0, self.terms.len()).into_owned();
        }
        // Columns are scaled to the same norm, because the coefficients differ by orders of magnitude.
        let sizes: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
        let scaled = DMatrix::from_fn(jacobian.nrows(), jacobian.ncols(), |row, column| {
            jacobian[(row, column)] / sizes[column]
        });
        let weighted = scaled.transpose() * cholesky.inverse();
        let spread = (&weighted * &scaled).try_inverse()?;
        let unit = DMatrix::from_fn(sizes.len(), sizes.len(), |row, column| {
            spread[(row, column)] / sizes[row] / sizes[column]
        });
        let mut makes = spread * weighted;
        for (mut row, size) in makes.row_iter_mut().zip(&sizes) {
            row /= *size;
        }
        Some((&makes * self.measured(), makes, unit))
    }

    fn fit(&self) -> Option<Fit> {
        let parameters = self.terms.len() + usize::from(self.markov().is_some());
        let measured = self.measured();
        if measured.len() <= parameters || measured.iter().any(|v| !(*v > 0.0 && v.is_finite())) {
            return None;
        }
        let start = self.start()?;
        let mut tables = self.tables(start.time);
        let state = self.iterate_weights(start, None, &mut tables)?;
        let covariance = self.covariance(&tables, &state);
        let (.., spread) = self.unconstrained(&state, &covariance)?;
        let mut noise = Noise { bias_time: state.time, ..Noise::default() };
        let mut terms = Vec::new();
        for (place, term) in self.terms.iter().enumerate() {
            // The B of a Gauss–Markov bias is 0.664 of its standard deviation.
            let unit = if *term == Term::Markov { super::FLICKER } else { 1.0 };
            let value = unit * state.coefficients[place].sqrt();
            *noise.parameter(*term) = value;
            let interval = self.interval(place, &state, &mut tables);
            let error = unit * unit * spread[(place, place)].sqrt() / (2.0 * value);
            let error = if value > 0.0 { error } else { f64::NAN };
            let (low, high) = match interval {
                Some((low, high)) => {
                    ((unit * low.sqrt()).min(value), (unit * high.sqrt()).max(value))
                }
                None => (f64::NAN, f64::NAN),
            };
            terms.push((*term, Estimate { value, low, high, error }));
        }
        let bias_time = self.markov().filter(|_| spread.nrows() > self.terms.len()).map(|_| {
            let relative = spread[(self.terms.len(), self.terms.len())].sqrt();
            let around = |sign: f64| state.time * (sign * NORMAL * relative).exp();
            // If the bias may be absent, its correlation time can have any value.
            let is_shown = terms.iter().any(|(term, e)| *term == Term::Markov && e.low > 0.0);
            let (low, high) =
                if is_shown { (around(-1.0), around(1.0)) } else { (0.0, f64::INFINITY) };
            Estimate { value: state.time, low, high, error: relative * state.time }
        });
        let shown = state.coefficients.iter().filter(|c| **c > 0.0).count()
            + usize::from(bias_time.is_some());
        let (chi_squared, worst) = self.misfit(&state, &covariance)?;
        let degrees = measured.len() - shown;
        Some(Fit {
            noise,
            terms,
            bias_time,
            from: self.octaves.tau(self.from),
            chi_squared: (chi_squared, degrees),
            fits: cube_root(chi_squared / degrees as f64, degrees as f64) < MISFIT,
            worst,
        })
    }

    fn misfit(&self, state: &State, covariance: &DMatrix<f64>) -> Option<(f64, Outlier)> {
        let modelled = self.modelled(state);
        let measured = self.measured();
        let count = measured.len();
        let deviates = DVector::from_fn(count, |k, _| {
            let degrees = 2.0 * modelled[k].powi(2) / covariance[(k, k)];
            cube_root(measured[k] / modelled[k], degrees)
        });
        let correlation = DMatrix::from_fn(count, count, |i, j| {
            covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt()
        });
        let chi_squared = deviates.dot(&factored(&correlation)?.solve(&deviates));
        let worst = deviates.iamax();
        let ratio = (measured[worst] / modelled[worst]).sqrt();
        Some((chi_squared, Outlier { tau: self.taus()[worst], ratio }))
    }

    /// Returns the 95 % interval of the coefficient with the index `place`. It consists of the
    /// values for which the estimate lies within the central 95 % of its distribution if the value
    /// is true. Returns `None` if this distribution cannot be computed for one of the values that
    /// are tried.
    fn interval(&self, place: usize, state: &State, tables: &mut Covariance) -> Option<(f64, f64)> {
        // Distances of the unconstrained estimate from the ends of its 95 % range, if `value` is true.
        let mut beyond = |value: f64| -> Option<(f64, f64, f64)> {
            let there = self.iterate_weights(state.clone(), Some((place, value)), tables);
            let there = there.unwrap_or_else(|| {
                // with this value no other noise is left, so that the other coefficients keep their estimates
                let mut alone = state.clone();
                alone.coefficients[place] = value;
                alone
            });
            let covariance = self.covariance(tables, &there);
            let (estimates, makes, spread) = self.unconstrained(&there, &covariance)?;
            let deviation = spread[(place, place)].sqrt();
            let modelled = self.modelled(&there);
            let (mut third, mut second) = (0.0, 0.0);
            for (k, weight) in makes.row(place).iter().enumerate() {
                // χ² with ν degrees of freedom and mean A has the third cumulant 8 A³/ν².
                let variance = covariance[(k, k)];
                second += weight * weight * variance;
                third += weight.powi(3) * 2.0 * variance * variance / modelled[k];
            }
            let skewness = third / second.powf(1.5);
            let end = |normal: f64| value + deviation * pearson(normal, skewness);
            let estimate = estimates[place];
            // An estimate below 0 is treated as 0. Otherwise the interval of a coefficient that is truly 0 would be a
            // single point in one of forty records.
            Some((estimate - end(NORMAL), estimate.max(0.0) - end(-NORMAL), deviation))
        };
        let value = state.coefficients[place];
        let (above, _, deviation) = beyond(value)?;
        let step = deviation.max(f64::MIN_POSITIVE);
        let low = match beyond(0.0)?.0 {
            above_none if above_none > 0.0 => {
                let mut within = if above > 0.0 { value + 4.0 * step } else { value };
                // The lower end is searched downwards from the estimate, because values near 0 may pass the test again if
                // a bias has a correlation time.
                let mut out = DOWN * within;
                while beyond(out)?.0 <= 0.0 && out > LEAST * value {
                    (within, out) = (out, DOWN * out);
                }
                if out > LEAST * value {
                    for _ in 0..BISECTIONS {
                        let middle = 0.5 * (out + within);
                        if beyond(middle)?.0 > 0.0 { out = middle } else { within = middle }
                    }
                    within
                } else {
                    0.0
                }
            }
            _ => 0.0,
        };
        let (mut within, mut by) = (value, 2.0 * step);
        let mut out = value + by;
        while beyond(out)?.1 > 0.0 {
            (within, by) = (out, 2.0 * by);
            out += by;
            if by > 1e6 * (value + step) {
                return Some((low, f64::INFINITY));
            }
        }
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (out + within);
            if beyond(middle)?.1 > 0.0 { within = middle } else { out = middle }
        }
        Some((low, within))
    }
}

const BISECTIONS: usize = 14;
const DOWN: f64 = 0.7;
const LEAST: f64 = 1e-4;

/// Returns the Cholesky factors of a covariance matrix. The matrix may be indefinite if the noise
/// does not fit the record, because distant octaves count as uncorrelated. In this case the
/// diagonal is increased, at most to twice its value.
fn factored(covariance: &DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    [0.0, 1e-3, 1e-2, 0.1, 1.0].into_iter().find_map(|more| {
        let mut matrix = covariance.clone();
        for k in 0..matrix.nrows() {
            matrix[(k, k)] *= 1.0 + more;
        }
        Cholesky::new(matrix)
    })
}

/// Converts the ratio of a χ² variable to its mean into a standard normal deviate, by the
/// approximation of Wilson and Hilferty. `degrees` is the number of degrees of freedom.
fn cube_root(ratio: f64, degrees: f64) -> f64 {
    let spread = 2.0 / (9.0 * degrees);
    (ratio.cbrt() - (1.0 - spread)) / spread.sqrt()
}

/// Returns the quantile of Pearson's type III distribution with mean 0, variance 1 and this
/// skewness. `normal` is the standard normal quantile of the same probability. The approximation is
/// Wilson and Hilferty's frequency factor.
fn pearson(normal: f64, skewness: f64) -> f64 {
    if skewness.abs() < 1e-3 {
        return normal;
    }
    let base = 1.0 + skewness * normal / 6.0 - skewness * skewness / 36.0;
    2.0 / skewness * (base.powi(3) - 1.0)
}

/// Solves a least-squares problem by trying all subsets of `columns`, with the condition that
/// coefficients are not negative. Coefficients with an index in `either` may have either sign.
/// Returns the coefficients and the squared error.
fn not_negative(
    columns: &DMatrix<f64>,
    values: &DVector<f64>,
    either: &[usize],
) -> Option<(Vec<f64>, f64)> {
    let count = columns.ncols();
    let mut best: Option<(Vec<f64>, f64)> = None;
    for subset in 0..1_u32 << count {
        let free: Vec<usize> = (0..count).filter(|k| subset & 1 << k != 0).collect();
        let mut all = vec![0.0; count];
        let mut errors = values.clone();
        if !free.is_empty() {
            let mut part = columns.select_columns(&free);
            let sizes: Vec<f64> = part.column_iter().map(|column| column.norm()).collect();
            if sizes.contains(&0.0) {
                continue;
            }
            for (mut column, size) in part.column_iter_mut().zip(&sizes) {
                column /= *size;
            }
            let qr = part.clone().qr();
            let Some(solved) = qr.r().solve_upper_triangular(&(qr.q().transpose() * values)) else {
                continue;
            };
            errors -= part * &solved;
            for ((k, value), size) in free.iter().zip(solved.iter()).zip(&sizes) {
                all[*k] = value / size;
            }
        }
        let allowed = (0..count).all(|k| all[k] >= 0.0 || either.contains(&k));
        let miss = errors.norm_squared();
        if allowed && best.as_ref().is_none_or(|(_, least)| miss < *least) {
            best = Some((all, miss));
        }
    }
    best
}

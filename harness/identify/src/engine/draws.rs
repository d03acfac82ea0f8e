//! Intervals as quantiles of random draws.
//!
//! A point of the profile is drawn with the weight exp(−Δ/2), where Δ is the rise of −2 ln L at this point. The other unknowns
//! are drawn from the normal distribution about their minimum at this point. Known values with tolerances are drawn from their
//! priors, and shift the unknowns by their derivatives. Draws outside the bounds and draws with impossible values are rejected.
//! The quantities that users ask for are computed from each draw. Therefore the intervals are valid in a bent valley of the
//! likelihood, and no interval contains impossible values.

use analysis::random::Random;
use anyhow::Result;
use nalgebra::{DMatrix, DVector};

use super::minimum::{Curvature, places};
use super::problem::Role;
use super::profile::{Curve, OPEN, Point};
use super::{Fit, Solution};

/// Number of draws. With this number the error of a quantile is a fiftieth of a standard deviation.
const DRAWS: usize = 20_000;
/// Smallest number of accepted draws from which quantiles are computed.
const FEWEST: usize = 400;
/// Number of grid points over the range of the profile's coordinate; between two grid points draws are uniform.
const PLACES: usize = 400;

/// Quantities that are computed from the unknowns, for example the diameter of the tank. `values` are their values at the
/// minimum. `columns` contains random draws of each quantity, from which its interval is computed.
#[derive(Clone, Debug, Default)]
pub struct Derived {
    pub names: Vec<String>,
    pub units: Vec<String>,
    pub values: Vec<f64>,
    pub columns: Vec<Vec<f64>>,
    /// Name and random draws of each known value with a tolerance. A draw is the deviation from the stated value, divided
    /// by its standard deviation.
    pub tolerances: Vec<(String, Vec<f64>)>,
    /// Name of the quantity whose profile was followed, and for the lower and the upper end of its interval true if the end
    /// is open, because −2 ln L has not risen enough where the profile ends.
    pub open: Option<(String, [bool; 2])>,
}

struct Place {
    at: f64,
    rise: f64,
    z: Vec<f64>,
    spread: DMatrix<f64>,
    means: Vec<f64>,
}

impl Solution<'_> {
    /// Draws the derived quantities, with the tolerances of known values if `with_tolerances` is true.
    ///
    /// # Errors
    /// If the system refuses a derivative.
    pub fn draw(&mut self, with_tolerances: bool) -> Result<Derived> {
        let unknowns = &self.fit.problem.unknowns;
        let is_known: Vec<bool> =
            unknowns.iter().map(|u| with_tolerances && u.is_known()).collect();
        let tolerances = self.fit.derivatives(&self.minimum.point, &is_known)?;
        let means = self.fit.derivatives_at(&mut self.minimum)?.means + &tolerances.means;
        let bent = self.profile.as_ref().map(|(j, _)| *j);
        let points = match &self.profile {
            Some((_, points)) => points.clone(),
            None => vec![Point { at: 0.0, minimum: self.minimum.clone() }],
        };
        let least = points.iter().map(|p| p.minimum.point.cost).fold(f64::INFINITY, f64::min);
        let mut places_of: Vec<Place> = Vec::new();
        for point in points {
            if places_of.last().is_some_and(|last| point.at - last.at < 1e-9) {
                continue;
            }
            // a point without derivatives uses the derivatives at the minimum
            let found = point.minimum.derivatives.as_ref().or(self.minimum.derivatives.as_ref());
            let Some(mut jacobian) = found.map(|found| found.matrix.clone()) else { continue };
            let mut which = point.minimum.free.clone();
            for j in places(&is_known) {
                jacobian.column_mut(j).copy_from(&tolerances.matrix.column(j));
                which[j] = true;
            }
            if let Some(j) = bent {
                which[j] = false;
            }
            places_of.push(Place {
                at: point.at,
                rise: point.minimum.point.cost - least,
                spread: spread(&jacobian, &which, !self.fit.problem.rough),
                means: self.fit.mean_residuals(&point.minimum.point),
                z: point.minimum.point.z,
            });
        }
        Ok(self.drawn(&places_of, &means, &is_known, bent))
    }

    fn drawn(
        &self,
        all: &[Place],
        means: &DMatrix<f64>,
        is_known: &[bool],
        bent: Option<usize>,
    ) -> Derived {
        let (fit, problem) = (&self.fit, self.fit.problem);
        let unknowns = &problem.unknowns;
        let n = unknowns.len();
        let mut random = Random::new(1, 61);
        let x: Vec<f64> = all.iter().map(|p| p.at).collect();
        let curve = |y: Vec<f64>| Curve::new(&x, &y);
        // interpolated as square roots, because the square root of the rise is nearly a straight line
        let lowest = all.iter().enumerate().min_by(|a, b| a.1.rise.total_cmp(&b.1.rise));
        let lowest = lowest.map_or(0, |(k, _)| k);
        let root =
            |(k, p): (usize, &Place)| p.rise.max(0.0).sqrt() * if k < lowest { -1.0 } else { 1.0 };
        let roots = curve(all.iter().enumerate().map(root).collect());
        let curves = |count: usize, of: fn(&Place, usize) -> f64| -> Vec<Curve> {
            (0..count).map(|j| curve(all.iter().map(|p| of(p, j)).collect())).collect()
        };
        let middle = curves(n, |p, j| p.z[j]);
        let residual = curves(problem.signals.len(), |p, s| p.means[s]);
        let (low, high) = (x[0], x[x.len() - 1]);
        let width = (high - low) / PLACES as f64;
        let mut sums = Vec::with_capacity(PLACES);
        let mut sum = 0.0;
        for k in 0..PLACES {
            sum += (-0.5 * roots.at(low + (k as f64 + 0.5) * width).powi(2)).exp();
            sums.push(sum);
        }
        let near: Vec<&super::hold::Rival> = self.rivals.iter().filter(|r| r.is_near()).collect();
        let weights: Vec<f64> = near.iter().map(|r| (-0.5 * r.more).exp()).collect();
        let total = 1.0 + weights.iter().sum::<f64>();
        let quantities = &unknowns[..problem.system.derived(n)];
        let mut found = Derived {
            names: quantities.iter().map(|u| u.name.clone()).collect(),
            units: quantities.iter().map(|u| u.unit.clone()).collect(),
            columns: vec![Vec::with_capacity(DRAWS); quantities.len()],
            tolerances: places(is_known)
                .into_iter()
                .map(|j| (unknowns[j].name.clone(), Vec::new()))
                .collect(),
            ..Derived::default()
        };
        // the bias of a gyro over a recording includes the mean of its drift
        let biases: Vec<(usize, usize)> = (0..n)
            .filter_map(|j| {
                let Role::Bias(output, Some(recording)) = unknowns[j].role else { return None };
                let of = |s: &super::Signal| (s.output, s.recording) == (output, recording);
                let s = problem.signals.iter().position(of)?;
                // with white noise and no drift, the bias is estimated like every other unknown
                (fit.noise[s].drift > 0.0).then_some((j, s))
            })
            .collect();
        for _ in 0..DRAWS {
            let place = match all.len() {
                1 => low,
                _ => {
                    let part = random.uniform() * sum;
                    let k = sums.partition_point(|s| *s < part).min(PLACES - 1);
                    low + (k as f64 + random.uniform()) * width
                }
            };
            let closest =
                all.iter().min_by(|a, b| (a.at - place).abs().total_cmp(&(b.at - place).abs()));
            let Some(closest) = closest else { break };
            let normal = DVector::from_fn(closest.spread.ncols(), |_, _| random.normal());
            let mut step = &closest.spread * normal;
            for (j, factors) in &self.sides {
                let factor = factors[usize::from(step[*j] > 0.0)];
                step[*j] *= factor;
            }
            let mut z: Vec<f64> = (0..n).map(|j| middle[j].at(place) + step[j]).collect();
            if let Some(j) = bent {
                z[j] = place;
            }
            let mut pick = random.uniform() * total - 1.0;
            let mut shift = None;
            for (rival, weight) in near.iter().zip(&weights) {
                if pick > 0.0 && pick <= *weight {
                    shift = Some(&rival.shift);
                }
                pick -= weight;
            }
            if let Some(shift) = shift {
                z.iter_mut().zip(shift).for_each(|(z, by)| *z += by);
            }
            let refused = (0..n).any(|j| {
                (fit.free[j] || is_known[j])
                    && !(fit.ends[j].0 - 1e-12..=fit.ends[j].1 + 1e-12).contains(&z[j])
            });
            let mut values = fit.values(&z);
            for (j, s) in &biases {
                let moved: f64 = (0..n).filter(|i| i != j).map(|i| step[i] * means[(*s, i)]).sum();
                let rows = problem.signals[*s].measured_row_count() as f64;
                let own = fit.noise[*s].white / rows.sqrt() * random.normal();
                values[*j] = middle[*j].at(place) + residual[*s].at(place) - moved + own;
                if let Some(shift) = shift {
                    values[*j] += shift[*j];
                }
            }
            let Some(derived) = problem.system.derive(&values).filter(|_| !refused) else {
                continue;
            };
            found.columns.iter_mut().zip(derived).for_each(|(column, v)| column.push(v));
            for ((_, column), j) in found.tolerances.iter_mut().zip(places(is_known)) {
                column.push(z[j]);
            }
        }
        let mut values = fit.values(&self.minimum.point.z);
        let own = fit.mean_residuals(&self.minimum.point);
        for (j, s) in &biases {
            values[*j] += own[*s];
        }
        let median = |column: &Vec<f64>| analysis::statistics::median(column).unwrap_or(f64::NAN);
        found.values = match problem.system.derive(&values) {
            Some(values) => values,
            None => found.columns.iter().map(median).collect(),
        };
        if let (Some(j), [first, .., last]) = (bent, all) {
            // the interval of a quantity that only its prior determines has no open end
            let known =
                |at: f64| unknowns[j].prior.map_or(0.0, |(mean, std)| ((at - mean) / std).powi(2));
            let least = known(all[lowest].at);
            let open = [first, last].map(|end| end.rise - (known(end.at) - least) < OPEN);
            found.open = Some((unknowns[j].name.clone(), open));
        }
        found
    }
}

/// Returns a matrix that maps independent standard normal numbers to random deviations of the unknowns `which`. The
/// deviations have the covariance (JᵀJ)⁻¹ of the Jacobian J. For `keeps_flat` see [`Curvature::with_flat`].
fn spread(jacobian: &DMatrix<f64>, which: &[bool], keeps_flat: bool) -> DMatrix<f64> {
    let curvature = Curvature::new(jacobian, places(which)).with_flat(keeps_flat);
    let (vectors, inverse) = curvature.spread();
    let mut all = DMatrix::zeros(which.len(), inverse.len());
    for (i, &row) in curvature.which.iter().enumerate() {
        let scaled = vectors.row(i).component_mul(&inverse.map(f64::sqrt).transpose());
        all.row_mut(row).copy_from(&(scaled * curvature.scale[i]));
    }
    all
}

impl Fit<'_> {
    fn mean_residuals(&self, point: &super::fit::Point) -> Vec<f64> {
        let residuals = self.residuals(&point.z, &point.motion);
        let mean = |(signal, r): (&super::Signal, &Vec<f64>)| {
            analysis::statistics::mean(&signal.picked(r))
        };
        self.problem.signals.iter().zip(&residuals).map(mean).collect()
    }
}

impl Derived {
    /// Returns true if there are enough draws for quantiles.
    pub fn has_enough_draws(&self) -> bool {
        self.columns.first().is_some_and(|column| column.len() >= FEWEST)
    }

    pub fn place(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|other| other == name)
    }

    /// Returns the standard deviation of quantity `k`, NaN if there are too few draws.
    pub fn std(&self, k: usize) -> f64 {
        let std = analysis::statistics::deviation(&self.columns[k]);
        if self.has_enough_draws() { std } else { f64::NAN }
    }

    /// Returns the 95 % interval of quantity `k`, NaN if there are too few draws.
    pub fn interval(&self, k: usize) -> [f64; 2] {
        if !self.has_enough_draws() {
            return [f64::NAN; 2];
        }
        let mut sorted = self.columns[k].clone();
        sorted.sort_by(f64::total_cmp);
        let at = |part: f64| {
            let place = part * (sorted.len() - 1) as f64;
            let (k, rest) = (place as usize, place.fract());
            sorted[k] + rest * (sorted[(k + 1).min(sorted.len() - 1)] - sorted[k])
        };
        [at(0.025), at(0.975)]
    }

    /// Mixes the draws of several models that explain the recordings about equally well. Each model contributes draws in
    /// proportion to its probability.
    pub fn mixed(all: &[(f64, Derived)]) -> Derived {
        let Some((_, first)) = all.first() else { return Derived::default() };
        let columns = vec![Vec::new(); first.names.len()];
        let mut mixed = Derived { columns, tolerances: Vec::new(), ..first.clone() };
        for (probability, other) in all {
            let count = (probability * DRAWS as f64) as usize;
            for (k, name) in first.names.iter().enumerate() {
                let from = &other.columns[other.place(name).unwrap_or(k)];
                mixed.columns[k].extend(from.iter().take(count));
            }
        }
        mixed
    }
}

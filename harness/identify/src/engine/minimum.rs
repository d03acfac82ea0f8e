//! The minimum of a sum of squares within bounds.
//!
//! The method is projected Levenberg–Marquardt: a step is cut at the bounds, and the other unknowns are then solved for again.
//! Broyden's updates replace new Jacobians as long as the steps decrease the sum of squares about as much as forecast. The
//! distance to the minimum is the Newton decrement, in standard deviations.

use anyhow::Result;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SymmetricEigen};

use super::fit::{Derivatives, Fit, Point};
use super::{KEPT, SETS, WIDER};

#[derive(Clone, Debug)]
pub struct Minimum {
    pub point: Point,
    /// Derivatives at the minimum; `None` if the last Jacobian belongs to another point.
    pub derivatives: Option<Derivatives>,
    /// Newton decrement: estimated distance of `point` to the exact minimum, in standard deviations.
    pub decrement: f64,
    pub free: Vec<bool>,
}

#[derive(Clone, Copy, Debug)]
pub struct End {
    pub sets: usize,
    /// Newton decrement (estimated distance to the minimum, standard deviations) at which the search ends.
    pub decrement: f64,
    /// Sum of squares above which a minimum is of no use, so that the search is given up.
    pub above: f64,
    /// Smallest decrease of the sum of squares that the search expects from one Jacobian. The search ends if the decrease is
    /// smaller, because in a bent valley every Jacobian gains a little and the search would not end.
    pub gain: f64,
    /// True if a decrement from an updated (Broyden) Jacobian may end the search, after at least one Jacobian
    /// was computed from differences.
    pub trusts: bool,
}

impl End {
    /// Creates limits with which a search ends after `sets` Jacobians, or earlier if the Newton decrement (the estimated
    /// distance to the minimum, in standard deviations) is below `decrement`.
    pub fn new(sets: usize, decrement: f64) -> Self {
        End { sets, decrement, above: f64::INFINITY, gain: 0.0, trusts: false }
    }
}

/// Ratio of an eigenvalue to the largest eigenvalue of a curvature with unit diagonal, below which the recordings do not
/// determine the eigenvector's direction. Also the smallest regularisation of such a curvature.
const FLAT: f64 = 1e-12;
/// A direction counts as resolved if its eigenvalue is at least this many times the eigenvalue that errors of the
/// derivatives cause by chance.
const RESOLVED: f64 = 4.0;

/// The curvature JᵀJ of a sum of squares, scaled to a unit diagonal.
pub struct Curvature {
    pub(super) which: Vec<usize>,
    matrix: DMatrix<f64>,
    pub(super) scale: Vec<f64>,
    keeps_flat: bool,
}

impl Curvature {
    pub fn new(jacobian: &DMatrix<f64>, which: Vec<usize>) -> Self {
        let picked = jacobian.select_columns(&which);
        let a = picked.tr_mul(&picked);
        let scale: Vec<f64> =
            a.diagonal().iter().map(|d| if *d > 0.0 { 1.0 / d.sqrt() } else { 1.0 }).collect();
        let matrix = DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] * scale[i] * scale[j]);
        Curvature { which, matrix, scale, keeps_flat: false }
    }

    /// Sets the variance of directions that the recordings hardly determine. If `keeps_flat` is true, it is the largest
    /// variance that the curvature resolves, so that no unknown in such a direction seems to be well known. Otherwise it is
    /// 0.
    pub fn with_flat(self, keeps_flat: bool) -> Self {
        Curvature { keeps_flat, ..self }
    }

    fn scaled(&self, gradient: &DVector<f64>) -> Vec<f64> {
        self.which.iter().zip(&self.scale).map(|(j, s)| gradient[*j] * s).collect()
    }

    /// Returns the forecast decrease of the sum of squares for a full step, where `b` is the scaled negative gradient.
    fn forecast(&self, b: &[f64]) -> f64 {
        let all: Vec<usize> = (0..b.len()).collect();
        self.solve(b, &all, 0.0).iter().zip(b).map(|(s, b)| s * b).sum()
    }

    /// Returns the damped step (JᵀJ + λ D)⁻¹ b for those unknowns of the curvature that `keep` lists, with the damping λ and the
    /// diagonal D of JᵀJ. `b` and the step are scaled in the same way as the matrix, whose diagonal is 1.
    fn solve(&self, b: &[f64], keep: &[usize], damping: f64) -> DVector<f64> {
        let damped = |more: f64| {
            let entry = |i: usize, j: usize| {
                self.matrix[(keep[i], keep[j])] + if i == j { damping + more } else { 0.0 }
            };
            Cholesky::new(DMatrix::from_fn(keep.len(), keep.len(), entry))
        };
        let right = DVector::from_iterator(keep.len(), keep.iter().map(|k| b[*k]));
        let mut more = FLAT;
        loop {
            if let Some(found) = damped(more) {
                return found.solve(&right);
            }
            if more.is_nan() || more > 1.0 {
                return right * 0.0;
            }
            more *= 100.0;
        }
    }

    fn eigen(&self) -> Option<SymmetricEigen<f64, Dyn>> {
        let is_known = !self.which.is_empty() && self.matrix.iter().all(|v| v.is_finite());
        is_known.then(|| self.matrix.clone().symmetric_eigen())
    }

    /// Returns the condition number of the Jacobian with columns scaled to unit length; NaN if it has elements
    /// that are not finite.
    pub fn condition(&self) -> f64 {
        let ratio = |found: SymmetricEigen<f64, Dyn>| {
            found.eigenvalues.max() / found.eigenvalues.min().max(1e-300)
        };
        self.eigen().map_or(f64::NAN, ratio).sqrt()
    }

    /// Returns the eigenvectors of the scaled curvature, and for each the variance in its direction, which is the inverse
    /// of the eigenvalue. A direction that the recordings hardly determine has the variance that
    /// [`with_flat`](Self::with_flat) sets, by default 0.
    pub fn spread(&self) -> (DMatrix<f64>, DVector<f64>) {
        let n = self.which.len();
        let Some(found) = self.eigen() else { return (DMatrix::zeros(n, n), DVector::zeros(n)) };
        let least = FLAT * found.eigenvalues.max();
        // unknowns without any effect have no entry in the matrix
        let acts = |k: usize| -> bool {
            let parts = found.eigenvectors.column(k).map(|v| v * v);
            parts.dot(&self.matrix.diagonal()) > 0.5
        };
        let inverse = DVector::from_fn(n, |k, _| match found.eigenvalues[k] {
            v if v > least => 1.0 / v,
            _ if self.keeps_flat && acts(k) => 1.0 / least,
            _ => 0.0,
        });
        (found.eigenvectors, inverse)
    }

    /// Returns the eigenvectors, in scaled unknowns, whose eigenvalues are so small that errors of the derivatives may have
    /// caused them. `errors` are the relative errors of the derivatives by each unknown; they are taken as independent of
    /// each other.
    pub fn unresolved(&self, errors: &[f64]) -> Vec<DVector<f64>> {
        let Some(found) = self.eigen() else { return Vec::new() };
        let flat = FLAT * found.eigenvalues.max();
        let all = found.eigenvalues.iter().zip(found.eigenvectors.column_iter());
        let is_flat = |(value, v): &(&f64, nalgebra::DVectorView<f64>)| {
            let made: f64 = v.iter().zip(errors).map(|(v, error)| (v * error).powi(2)).sum();
            **value <= flat.max(RESOLVED * made)
        };
        all.filter(is_flat).map(|(_, v)| v.into_owned()).collect()
    }

    /// Returns the covariance as a matrix over `all` unknowns, with zeros for unknowns outside the curvature.
    pub fn covariance(&self, all: usize) -> DMatrix<f64> {
        let (vectors, inverse) = self.spread();
        let inner = &vectors * DMatrix::from_diagonal(&inverse) * vectors.transpose();
        let mut covariance = DMatrix::zeros(all, all);
        for (i, &row) in self.which.iter().enumerate() {
            for (j, &column) in self.which.iter().enumerate() {
                covariance[(row, column)] = inner[(i, j)] * self.scale[i] * self.scale[j];
            }
        }
        covariance
    }
}

pub fn places(which: &[bool]) -> Vec<usize> {
    (0..which.len()).filter(|j| which[*j]).collect()
}

pub fn without(which: &[bool], j: usize) -> Vec<bool> {
    let mut others = which.to_vec();
    others[j] = false;
    others
}

impl Fit<'_> {
    /// Returns the free unknowns, without those at a bound beyond which the sum of squares would decrease.
    pub fn inner(&self, z: &[f64], gradient: &DVector<f64>, free: &[bool]) -> Vec<usize> {
        let is_inner = |j: &usize| {
            let ((low, high), z, slope) = (self.ends[*j], z[*j], gradient[*j]);
            !(z <= low + 1e-12 && slope > 0.0 || z >= high - 1e-12 && slope < 0.0)
        };
        places(free).into_iter().filter(is_inner).collect()
    }

    /// Searches the minimum from z over the unknowns `free`. The search begins with `derivatives`, if given, which come
    /// from a nearby point.
    ///
    /// # Errors
    /// If the system refuses the start, or every step of an unknown.
    pub fn minimise(
        &mut self,
        z: &[f64],
        free: &[bool],
        derivatives: Option<Derivatives>,
        end: End,
    ) -> Result<Minimum> {
        let z: Vec<f64> = z.iter().zip(&self.ends).map(|(z, e)| z.clamp(e.0, e.1)).collect();
        let point = self.at(&z)?;
        self.minimise_on(point, free, derivatives, end)
    }

    /// Searches the minimum over all free unknowns, from the coordinates of a point.
    ///
    /// # Errors
    /// If the system refuses the start, or every step of an unknown.
    pub fn minimise_from(&mut self, from: &Point, end: End) -> Result<Minimum> {
        let free = self.free.clone();
        self.minimise(&from.z, &free, None, end)
    }

    /// Searches the minimum as [`Fit::minimise`] does, from a point that has already been simulated.
    ///
    /// # Errors
    /// If the system refuses every step of an unknown.
    pub fn minimise_on(
        &mut self,
        mut point: Point,
        free: &[bool],
        mut derivatives: Option<Derivatives>,
        end: End,
    ) -> Result<Minimum> {
        let n = point.z.len();
        let (mut damping, mut fresh, mut decrement, mut sets) = (1e-3, false, f64::INFINITY, 0);
        // sum of squares when the last Jacobian was computed
        let mut last = f64::INFINITY;
        loop {
            // If the residual is larger than the noise, distances and gains are relative to the standard deviation of the
            // residual, because digits below the misfit are of no use.
            let scale = (point.cost / point.e.len() as f64).max(1.0);
            if derivatives.is_none() {
                if sets == end.sets || last - point.cost < scale * end.gain {
                    break;
                }
                last = point.cost;
                derivatives = Some(self.derivatives(&point, free)?);
                sets += 1;
                fresh = true;
            }
            let Some(now) = &mut derivatives else { break };
            let jacobian = &mut now.matrix;
            let gradient = jacobian.tr_mul(&point.e);
            let curvature = Curvature::new(jacobian, self.inner(&point.z, &gradient, free));
            let which = curvature.which.clone();
            let all: Vec<usize> = (0..which.len()).collect();
            let b = curvature.scaled(&gradient);
            let won = curvature.forecast(&b);
            decrement = won.max(0.0).sqrt();
            if decrement.is_nan() {
                break;
            }
            if decrement < scale.sqrt() * end.decrement {
                if fresh || sets == end.sets || end.trusts && sets > 0 {
                    break;
                }
                derivatives = None;
                continue;
            }
            // where dry friction stops the hub, the forecast may be only half of the decrease that the steps achieve
            let is_near = decrement < 30.0 * scale.sqrt();
            if fresh && sets > 1 && is_near && point.cost - 1.5 * won > end.above {
                break;
            }
            let mut outcome = None;
            for _ in 0..SETS {
                let scaled = curvature.solve(&b, &all, damping);
                let mut step = vec![0.0; n];
                for (k, &j) in which.iter().enumerate() {
                    step[j] = -scaled[k] * curvature.scale[k];
                }
                let hits =
                    |j: usize| !(self.ends[j].0..=self.ends[j].1).contains(&(point.z[j] + step[j]));
                let keep: Vec<usize> = all.iter().copied().filter(|k| !hits(which[*k])).collect();
                if !keep.is_empty() && keep.len() < all.len() {
                    // if a bound cut the step, it is computed again without the unknowns that reached the bound
                    let mut cut = vec![0.0; n];
                    for &j in which.iter().filter(|j| hits(**j)) {
                        let (low, high) = self.ends[j];
                        cut[j] = (point.z[j] + step[j]).clamp(low, high) - point.z[j];
                    }
                    let own: Vec<f64> =
                        which.iter().zip(&curvature.scale).map(|(j, s)| cut[*j] / s).collect();
                    let moved = &curvature.matrix * DVector::from_vec(own);
                    let right: Vec<f64> = b.iter().zip(moved.iter()).map(|(b, m)| b + m).collect();
                    let rest = curvature.solve(&right, &keep, damping);
                    for (k, place) in keep.iter().enumerate() {
                        cut[which[*place]] = -rest[k] * curvature.scale[*place];
                    }
                    step = cut;
                }
                let z: Vec<f64> = (0..n)
                    .map(|j| (point.z[j] + step[j]).clamp(self.ends[j].0, self.ends[j].1))
                    .collect();
                let step = DVector::from_fn(n, |j, _| z[j] - point.z[j]);
                let there = self.at(&z).ok().filter(|there| there.cost < point.cost);
                if let Some(there) = there {
                    let foreseen = &*jacobian * &step;
                    let forecast = -(2.0 * gradient.dot(&step) + foreseen.norm_squared());
                    let gain = (point.cost - there.cost) / forecast.max(1e-30);
                    let reach = |j: usize| self.problem.unknowns[j].reach;
                    let own = DVector::from_fn(n, |j, _| step[j] / reach(j).powi(2));
                    let size: f64 = (0..n).map(|j| (step[j] / reach(j)).powi(2)).sum();
                    if size > 0.0 {
                        let off = &there.e - &point.e - foreseen;
                        jacobian.ger(1.0 / size, &off, &own, 1.0);
                    }
                    if gain > 0.5 {
                        damping = (damping / WIDER).max(1e-7);
                    }
                    point = there;
                    fresh = false;
                    outcome = Some(gain > KEPT);
                    break;
                }
                damping = (damping * WIDER).max(1e-4);
                if !fresh {
                    outcome = Some(false);
                    break;
                }
            }
            match outcome {
                // one-sided differences may mislead where the outputs are curved
                None if !self.central && decrement > super::ENDS.0 * 0.2 && sets < end.sets => {
                    self.central = true;
                    derivatives = None;
                }
                None => break,
                Some(true) => {}
                Some(false) => derivatives = None,
            }
        }
        Ok(Minimum { point, derivatives, decrement, free: free.to_vec() })
    }

    /// Returns the Newton decrement of a point over the unknowns `free`, standard deviations.
    ///
    /// # Errors
    /// If the system refuses every step of an unknown.
    pub fn decrement(&mut self, at: &mut Minimum, free: &[bool]) -> Result<f64> {
        let jacobian = self.derivatives_at(at)?.matrix;
        let gradient = jacobian.tr_mul(&at.point.e);
        let curvature = Curvature::new(&jacobian, self.inner(&at.point.z, &gradient, free));
        Ok(curvature.forecast(&curvature.scaled(&gradient)).max(0.0).sqrt())
    }

    /// Returns the derivatives at a minimum by the unknowns that were searched for. They are stored in the minimum
    /// for the next call.
    ///
    /// # Errors
    /// If the system refuses every step of an unknown.
    pub fn derivatives_at(&mut self, minimum: &mut Minimum) -> Result<Derivatives> {
        if let Some(found) = &minimum.derivatives {
            return Ok(found.clone());
        }
        let found = self.derivatives(&minimum.point, &minimum.free)?;
        minimum.derivatives = Some(found.clone());
        Ok(found)
    }
}

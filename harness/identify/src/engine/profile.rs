//! The profile likelihood of the bent unknown, along which −2 ln L of the likelihood L is not a parabola.

use anyhow::Result;
use nalgebra::DMatrix;

use super::minimum::{Curvature, End, Minimum, places, without};
use super::problem::Part;
use super::{ALIKE, DECIDES, ENDS, Fit, GAIN, SETS, VAGUE, Z};

/// Rise of the sum of squares, 1.96², that closes a 95 % interval. If the sum of squares rises less up to the end of the
/// profile's range, the interval is open on that side.
pub const OPEN: f64 = Z * Z;
/// Largest relative difference between the square root of the likelihood's rise and a straight line at which the likelihood
/// still counts as a parabola.
pub const PARABOLIC: f64 = 0.1;
/// Limits of the steps of a profile, in the coordinate of the unknown: shortest first step, longest first step
/// and longest later step.
const LENGTHS: [f64; 3] = [0.03, 0.5, 0.6];
/// Distance to the minimum, in standard deviations, at which the search for a point of the profile ends. It adds a hundredth of
/// [`OPEN`] to the sum of squares.
const NEAR: f64 = 0.2;
/// Largest number of points on each side of a profile.
const POINTS: usize = 16;
/// Factors of the start value of the bent unknown at which other minima are searched.
const GRID: [f64; 6] = [0.03, 0.1, 0.3, 1.0, 3.0, 10.0];

pub type Profile = (usize, Vec<Point>);

#[derive(Clone, Debug)]
pub struct Point {
    pub at: f64,
    pub minimum: Minimum,
}

pub fn lowest(points: &[Point]) -> Option<&Point> {
    points.iter().min_by(|a, b| a.minimum.point.cost.total_cmp(&b.minimum.point.cost))
}

impl Fit<'_> {
    /// Finds the unknown along which −2 ln L is least like a parabola, if the problem does not name one as bent. Returns
    /// true if the profile of this unknown has to be followed.
    ///
    /// # Errors
    /// If the system refuses every step of an unknown.
    pub fn find_bent(&mut self, minimum: &mut Minimum) -> Result<bool> {
        let unknowns = &self.problem.unknowns;
        if !self.problem.rough || minimum.decrement > ENDS.0 {
            return Ok(false);
        }
        let jacobian = self.derivatives_at(minimum)?.matrix;
        let gradient = jacobian.tr_mul(&minimum.point.e);
        let inner = self.inner(&minimum.point.z, &gradient, &self.free);
        let covariance = Curvature::new(&jacobian, inner.clone()).covariance(unknowns.len());
        let mut most = (PARABOLIC, None);
        for j in inner.into_iter().filter(|j| unknowns[*j].part == Part::Free) {
            let bend = self.bend(minimum, &covariance, j)?;
            if bend > most.0 {
                most = (bend, Some(j));
            }
        }
        self.bent = most.1;
        Ok(self.bent.is_some())
    }

    /// Returns how far −2 ln L (L: likelihood) along unknown `j` is from a parabola: the relative difference between the
    /// square roots of its rise and of the parabola's rise at an end of the 95 % interval, or at a bound before this end.
    /// The larger difference of the two ends counts.
    ///
    /// # Errors
    /// If the system refuses every step of an unknown.
    fn bend(&mut self, minimum: &mut Minimum, covariance: &DMatrix<f64>, j: usize) -> Result<f64> {
        let derivatives = self.derivatives_at(minimum)?;
        let (std, mut most) = (covariance[(j, j)].sqrt(), 0.0_f64);
        if std == 0.0 || !std.is_finite() {
            return Ok(most);
        }
        let free = without(&self.free, j);
        for sign in [-1.0, 1.0] {
            let z = &minimum.point.z;
            let room = if sign < 0.0 { z[j] - self.ends[j].0 } else { self.ends[j].1 - z[j] };
            let far = (Z * std).min(room);
            if far < 0.1 * std {
                continue;
            }
            let by = sign * far / std.powi(2);
            let z: Vec<f64> = (0..z.len()).map(|i| z[i] + by * covariance[(i, j)]).collect();
            let there = self.minimise(&z, &free, Some(derivatives.clone()), End::new(0, NEAR));
            let rise = there.map_or(f64::INFINITY, |t| t.point.cost - minimum.point.cost);
            most = most.max((rise.max(0.0).sqrt() * std / far - 1.0).abs());
        }
        Ok(most)
    }

    fn stated_bent(&self) -> Option<usize> {
        self.problem.unknowns.iter().zip(&self.free).position(|(u, free)| u.bent && *free)
    }

    /// Looks for a lower minimum at other values of the bent unknown, with all other unknowns free. A search cannot cross a
    /// ridge of the likelihood between two minima. Returns the points that it found.
    ///
    /// # Errors
    /// If the system refuses the minimum.
    pub fn across_ridges(&mut self, minimum: &mut Minimum) -> Result<Vec<Point>> {
        let unknowns = &self.problem.unknowns;
        // a minimum this close to 0 cannot be beaten, because a sum of squares is not negative
        let bent = self.stated_bent().filter(|_| minimum.point.cost > DECIDES);
        let Some(j) = bent else { return Ok(Vec::new()) };
        let derivatives = Some(self.derivatives_at(minimum)?);
        let free = without(&self.free, j);
        let (now, start) = (minimum.point.z[j], unknowns[j].coordinate(unknowns[j].start));
        let mut points: Vec<Point> = Vec::new();
        for factor in GRID {
            let at = (start + factor.ln()).clamp(self.ends[j].0, self.ends[j].1);
            if (at - now).abs() < LENGTHS[2] {
                continue;
            }
            let mut z = minimum.point.z.clone();
            z[j] = at;
            let above = minimum.point.cost + 3.0 * DECIDES;
            let end = End { above, trusts: true, gain: ALIKE, ..End::new(5, ENDS.0) };
            let Ok(found) = self.minimise(&z, &free, derivatives.clone(), end) else { continue };
            points.push(Point { at, minimum: found });
        }
        let lower = |low: &&Point| low.minimum.point.cost < minimum.point.cost - GAIN;
        if let Some(low) = lowest(&points).filter(lower) {
            let end = End { gain: ALIKE, ..End::new(6, ENDS.0) };
            *minimum = self.minimise_from(&low.minimum.point, end)?;
        }
        Ok(points)
    }

    /// Returns the index of the bent unknown, and its likelihood profile through `minimum` in ascending order of the
    /// coordinate. `beyond` are points that [`Fit::across_ridges`] found; points outside the range of the profile are added
    /// to it. Returns `None` if no unknown is bent, or if the recordings determine the bent unknown so well that −2 ln L is
    /// a parabola along it.
    ///
    /// # Errors
    /// If the system refuses the minimum.
    pub fn profile(&mut self, minimum: &mut Minimum, beyond: &[Point]) -> Result<Option<Profile>> {
        let unknowns = &self.problem.unknowns;
        self.central = self.problem.rough;
        let found = self.bent;
        let Some(j) = found.or(self.stated_bent()) else { return Ok(None) };
        let jacobian = self.derivatives_at(minimum)?.matrix;
        let curvature = Curvature::new(&jacobian, places(&self.free));
        let covariance = curvature.with_flat(!self.problem.rough).covariance(unknowns.len());
        let std = |i: usize| covariance[(i, i)].sqrt();
        // The unknown that compensates changes of the bent unknown `j` along the valley is a positive quantity, and not an error
        // whose expected value is 0.
        let partner = |i: &usize| {
            let correlation = covariance[(*i, j)] / (std(*i) * std(j));
            !unknowns[*i].log
                && unknowns[*i].bounds.0 >= 0.0
                && correlation.abs() > 0.5
                && std(*i) > VAGUE * minimum.point.z[*i].abs()
        };
        let has_partner = places(&self.free).iter().any(|i| *i != j && partner(i));
        // sums of squares with the current noise
        let beyond: Vec<Point> = beyond
            .iter()
            .map(|p| {
                let point = &p.minimum.point;
                let point = self.point(&point.z, point.motion.clone());
                Point { at: p.at, minimum: Minimum { point, ..p.minimum.clone() } }
            })
            .collect();
        let rivals = beyond.iter().any(|p| p.minimum.point.cost < minimum.point.cost + DECIDES);
        if found.is_none() && !(std(j) > VAGUE || has_partner || rivals) {
            return Ok(None);
        }
        // LENGTHS holds for logarithms; a coordinate without a logarithm scales them with its standard deviation
        let lengths =
            LENGTHS.map(|length| if unknowns[j].log { length } else { 2.0 * std(j) * length });
        let first = (0.25 * std(j)).clamp(lengths[0], lengths[1]);
        let free = without(&self.free, j);
        let mut points = vec![Point { at: minimum.point.z[j], minimum: minimum.clone() }];
        let base = minimum.point.cost;
        let mut least = base;
        for side in [-1.0, 1.0] {
            // direction of the valley: at first from the curvature, then from one point to the next
            let own = covariance[(j, j)];
            let along = |i: usize| if own > 0.0 { covariance[(i, j)] / own } else { 0.0 };
            let mut tangent: Vec<f64> = (0..unknowns.len()).map(along).collect();
            let (mut last, mut h, mut risen) = (minimum.clone(), first, 0.0);
            for _ in 0..POINTS {
                let at = last.point.z[j] + side * h;
                if at < self.ends[j].0 || at > self.ends[j].1 {
                    break;
                }
                let mut z = last.point.z.clone();
                places(&free).into_iter().for_each(|i| z[i] += tangent[i] * (at - last.point.z[j]));
                z[j] = at;
                let above = least + 3.0 * DECIDES;
                let end = End { above, trusts: true, gain: GAIN, ..End::new(SETS, NEAR) };
                let Ok(found) = self.minimise(&z, &free, last.derivatives.clone(), end) else {
                    break;
                };
                let rise = found.point.cost - base;
                least = least.min(found.point.cost);
                points.push(Point { at, minimum: found.clone() });
                let by = at - last.point.z[j];
                let change = found.point.z.iter().zip(&last.point.z);
                tangent = change.map(|(new, old)| (new - old) / by).collect();
                last = found;
                if rise > DECIDES {
                    break;
                }
                let factor = match rise - risen {
                    more if more < 1.5 => 1.6,
                    more if more < 6.0 => 1.0,
                    _ => 0.7,
                };
                // steps much shorter than the first one would not get ahead
                (h, risen) = ((h * factor).clamp(h.min(0.5 * first), lengths[2]), rise);
            }
        }
        points.sort_by(|a, b| a.at.total_cmp(&b.at));
        let (low, high) = (points[0].at, points[points.len() - 1].at);
        points.extend(beyond.into_iter().filter(|p| p.at < low || p.at > high));
        points.sort_by(|a, b| a.at.total_cmp(&b.at));
        Ok(Some((j, points)))
    }
}

/// A cubic interpolation that is monotone wherever its points are (Fritsch and Carlson 1980).
pub struct Curve {
    x: Vec<f64>,
    y: Vec<f64>,
    slopes: Vec<f64>,
}

impl Curve {
    pub fn new(x: &[f64], y: &[f64]) -> Self {
        let n = x.len();
        let d: Vec<f64> = (1..n).map(|k| (y[k] - y[k - 1]) / (x[k] - x[k - 1])).collect();
        let slope = |k: usize| match (k, n) {
            (_, 0 | 1) => 0.0,
            (0, _) => d[0],
            (k, n) if k + 1 == n => d[n - 2],
            _ if d[k - 1] * d[k] <= 0.0 => 0.0,
            _ => {
                let (a, b) = (x[k] - x[k - 1], x[k + 1] - x[k]);
                let (u, v) = (2.0 * b + a, b + 2.0 * a);
                (u + v) / (u / d[k - 1] + v / d[k])
            }
        };
        Curve { x: x.to_vec(), y: y.to_vec(), slopes: (0..n).map(slope).collect() }
    }

    pub fn at(&self, place: f64) -> f64 {
        if self.x.len() < 2 {
            return self.y.first().copied().unwrap_or(f64::NAN);
        }
        let k = self.x.partition_point(|x| *x <= place).clamp(1, self.x.len() - 1) - 1;
        let h = self.x[k + 1] - self.x[k];
        let u = ((place - self.x[k]) / h).clamp(0.0, 1.0);
        let (a, b, p, q) = (self.y[k], self.y[k + 1], h * self.slopes[k], h * self.slopes[k + 1]);
        let (c, d) = (3.0 * (b - a) - 2.0 * p - q, 2.0 * (a - b) + p + q);
        a + u * (p + u * (c + u * d))
    }
}

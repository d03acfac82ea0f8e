//! Unknowns of a force record with their starts: from the tank's drawing, or from the record's spectrum and levels.

use analysis::statistics::{about_mean, mean, peak};
use anyhow::{Context, Result, ensure};
use nalgebra::{Matrix3, Vector3};
use names::sloshtank::tank;
use signals::fourier::Forward;

use super::{LOADS, Raw, Task, lateral};
use crate::model::bench::breaking;
use crate::tuning::{ASSUMED_ANGLE, PADDING, SLOSHING_PART, SPECTRUM_POINTS, WIDE_SHIFT};

/// A possible unknown.
pub struct Possible {
    /// Name in SloshTank.
    pub name: String,
    /// Start.
    pub start: f64,
    /// Standard deviation of its wide prior.
    pub prior: f64,
    /// Bounds; `None`: the FMU's.
    pub bounds: Option<(f64, f64)>,
    /// Each record has its own.
    pub each: bool,
    /// False if it keeps its start.
    pub is_free: bool,
}

/// Starts of the search.
#[derive(Clone, Debug)]
pub struct Start {
    /// Number of the mode that is fitted.
    pub mode: usize,
    /// Modal mass, kg.
    pub mass: f64,
    /// Pendulum length, m.
    pub length: f64,
    /// Height of the hinge, m.
    pub hinge: f64,
    /// Centring stiffness, N/m.
    pub stiffness: f64,
    /// Damping ratio.
    pub zeta: f64,
    /// s and κ.
    pub third_order: [f64; 2],
    /// Mass, kg, height, m, and inertia, kg·m², of the rigid liquid.
    pub rigid: [f64; 3],
    /// Directions in which the mode moves.
    pub directions: [bool; 2],
    /// Tangents of the slosh angles and their rates, 1/s, at the start, along the tank's x and y axes.
    pub at_start: [[f64; 2]; 2],
    /// True if the tank moves.
    pub is_moved: bool,
    /// Source of length and masses.
    source: &'static str,
}

impl Start {
    /// Finds the starts.
    ///
    /// # Errors
    /// If the record shows no oscillation.
    pub fn of(task: &Task, raws: &[Raw]) -> Result<Start> {
        let is_moved = raws.iter().any(Raw::is_moved);
        let longest = |best: &&Raw, raw: &&Raw| best.time.len().cmp(&raw.time.len());
        let raw = raws.iter().max_by(longest).context("there is no record")?;
        let across = lateral(&task.frame, raw);
        let across = across.map(|[force, moment]| force.or(moment));
        let signal = |(k, sign): (usize, f64)| {
            let values = raw.loads[k].iter().flatten();
            values.map(|value| sign * value).collect::<Vec<f64>>()
        };
        let lateral = [0, 1].map(|axis| across[axis].map(signal));
        let size = [0, 1].map(|axis| {
            let there = lateral[axis].iter().flatten().copied().filter(|v| !v.is_nan());
            peak(&about_mean(&there.collect::<Vec<f64>>()))
        });
        let main = usize::from(size[1] > size[0]);
        let known = |name: &str| {
            let own = task.settings.iter().filter(|s| s.name == name && s.recording.is_none());
            let own = own.filter_map(|s| s.value.parse::<f64>().ok()).next_back();
            own.or_else(|| task.prediction.as_ref()?.values.get(name).map(|p| p.value))
        };
        let is_set = |name: &str| {
            let mut all = task.prediction.iter().flat_map(|p| &p.settings);
            all.any(|(other, value)| other == name && value.parse() != Ok(0.0))
        };
        // planar modes of a box: the first that moves in the record's main direction
        let moves = |n: usize, axis: usize| is_set(&tank::DIRECTION.at([n, axis + 1]));
        let planar = (1..=tank::MOST_MODES).find(|n| moves(*n, main));
        let mode = planar.unwrap_or(1);
        let directions =
            [0, 1].map(|axis| across[axis].is_some() && planar.is_none_or(|n| moves(n, axis)));
        let frequency = match known(&tank::LENGTH.at([mode])).filter(|_| is_moved) {
            Some(length) => (task.gravity / length).sqrt() / std::f64::consts::TAU,
            None => dominant(raw, &lateral)?,
        };
        let omega = std::f64::consts::TAU * frequency;
        let length = known(&tank::LENGTH.at([mode])).filter(|_| is_moved);
        let length = length.unwrap_or(task.gravity / (omega * omega));
        let fitted = lateral.each_ref().map(|signal| {
            signal.as_ref().map_or([0.0; 2], |signal| first_wave(&raw.time, signal, omega))
        });
        let amplitude = fitted.iter().map(|[a, b]| a.hypot(*b)).fold(0.0, f64::max);
        let (vertical, up) = task.frame.place(2);
        let weight = raw.loads[vertical].as_ref().map(|values| {
            let there: Vec<f64> = values.iter().copied().filter(|v| !v.is_nan()).collect();
            -up * mean(&there) / task.gravity
        });
        let weight = weight.filter(|m| *m > 0.0);
        let by_angle = |angle: f64| amplitude / (task.gravity * angle.tan());
        let of_release = task.release.map(|[x, y]| by_angle(x.hypot(y)));
        let by_motion = || {
            let accelerations = raw.motion.iter().enumerate().filter_map(|(k, values)| {
                let factor = [omega * omega, 1.0, task.gravity][k / 3];
                Some(factor * peak(&about_mean(values.as_ref()?)))
            });
            size[main] / accelerations.fold(1e-12, f64::max)
        };
        let total = weight.unwrap_or_else(|| if is_moved { by_motion() } else { f64::NAN });
        let estimated = match (is_moved, of_release) {
            (false, Some(mass)) => mass,
            _ if total.is_finite() => SLOSHING_PART * total,
            _ => by_angle(ASSUMED_ANGLE),
        };
        let mass = known(&tank::MASS.at([mode])).unwrap_or(estimated).max(1e-9);
        ensure!(
            mass.is_finite() && length.is_finite(),
            "{}: forces and moments are all 0",
            raw.name
        );
        let hinge = known(&tank::HINGE.at([mode]));
        let hinge = hinge.unwrap_or_else(|| lever(task, raw, main) + task.frame.point[2]);
        let per_angle = match self::lateral(&task.frame, raw)[main][0] {
            Some(_) => mass * task.gravity,
            None => mass * task.gravity * (hinge - task.frame.point[2]),
        };
        let at_start = match (task.release, is_moved) {
            (Some(angles), _) => angles.map(|angle| [angle.tan(), 0.0]),
            (None, true) => [[0.0; 2]; 2],
            (None, false) => fitted.map(|[a, b]| {
                [a / per_angle, b * omega / per_angle]
                    .map(|p| p.clamp(-0.9 * omega.max(1.0), 0.9 * omega.max(1.0)))
            }),
        };
        let at_start = at_start.map(|[p, rate]| [p.clamp(-0.9, 0.9), rate]);
        let m_0 = known(tank::M_0).unwrap_or(if total > mass { total - mass } else { mass });
        let height = known(tank::H_0).unwrap_or(hinge - length);
        let inertia = known(tank::I_0).unwrap_or(0.1 * m_0.abs() * length * length);
        let third_order = [tank::NONLINEAR_INERTIA, tank::NONLINEAR_STIFFNESS]
            .map(|array| known(&array.at([mode])).unwrap_or(1.0));
        Ok(Start {
            mode,
            mass,
            length,
            hinge,
            stiffness: known(&tank::K.at([mode])).unwrap_or(0.0),
            zeta: known(&tank::ZETA.at([mode])).filter(|zeta| *zeta > 0.0).unwrap_or(0.01),
            third_order,
            rigid: [m_0, height, inertia],
            directions,
            at_start,
            is_moved,
            source: if task.prediction.is_some() { "the drawing" } else { "the record" },
        })
    }

    /// Period of small waves, s.
    pub fn period(&self, gravity: f64) -> f64 {
        std::f64::consts::TAU * (self.length / gravity).sqrt()
    }

    /// The starts in words.
    pub fn words(&self) -> String {
        format!(
            "{}; starts from {}: mass {:.4} kg, length {:.4} m, hinge {:.4} m",
            if self.is_moved { "forced motion" } else { "free decay: the record has no motion" },
            self.source,
            self.mass,
            self.length,
            self.hinge
        )
    }

    /// The possible unknowns.
    pub fn unknowns(&self, task: &Task, raws: &[Raw], is_driven: bool) -> Vec<Possible> {
        let n = self.mode;
        let across = lateral(&task.frame, &raws[0]);
        let has_moment = across.iter().any(|[_, moment]| moment.is_some());
        let has_weight = raws[0].loads[task.frame.place(2).0].is_some();
        let turns = |raw: &Raw| raw.motion[6..].iter().any(Option::is_some);
        let turns = raws.iter().any(turns);
        let [m_0, h_0, i_0] = self.rigid;
        let far = 10.0 * self.length;
        let mut all = Vec::new();
        let mut add = |name: String, start: f64, prior: f64, bounds, is_free| {
            all.push(Possible { name, start, prior, bounds, each: false, is_free });
        };
        add(tank::MASS.at([n]), self.mass, self.mass, None, true);
        let lengths = (self.length / 3.0, 3.0 * self.length);
        add(tank::LENGTH.at([n]), self.length, self.length, Some(lengths), true);
        let wide = Some((self.hinge - 2.0 * far, self.hinge + 2.0 * far));
        add(tank::HINGE.at([n]), self.hinge, far, wide, has_moment);
        add(tank::ZETA.at([n]), self.zeta, (10.0 * self.zeta).max(0.05), None, true);
        add(tank::ZETA_AMPLITUDE.at([n]), 0.0, 0.1, Some((0.0, 1.0)), true);
        add(tank::ZETA_BREAKING.at([n]), 0.04, 0.2, Some((0.0, 1.0)), true);
        let (begins, known) = breaking::BEGINS;
        add(tank::BREAKING_STEEPNESS.at([n]), begins, known, Some((0.3, 1.0)), true);
        let [s, kappa] = self.third_order;
        let about = |value: f64| Some((value - 4.0, value + 6.0));
        add(tank::NONLINEAR_INERTIA.at([n]), s, WIDE_SHIFT, about(s), true);
        add(tank::NONLINEAR_STIFFNESS.at([n]), kappa, WIDE_SHIFT, about(kappa), true);
        add(tank::M_0.into(), m_0, m_0.abs().max(self.mass), None, is_driven || has_weight);
        let wide = Some((h_0 - 2.0 * far, h_0 + 2.0 * far));
        add(tank::H_0.into(), h_0, far, wide, is_driven && has_moment);
        let inertia = (10.0 * i_0).max(m_0.abs() * self.length * self.length);
        add(tank::I_0.into(), i_0, inertia, None, turns && has_moment);
        let omega = std::f64::consts::TAU / self.period(task.gravity);
        // a free decay's mass and angle are one product: as wide as the mass
        let size = self.at_start.as_flattened().chunks(2).map(|p| p[0].hypot(p[1] / omega));
        let size = size.fold(0.0, f64::max);
        let size = if self.is_moved { 0.5 } else { size.max(1e-3) };
        for axis in (0..2).filter(|axis| self.directions[*axis]) {
            let [p, rate] = self.at_start[axis];
            let is_free = task.release.is_none();
            let names = [tank::P_0.at([n, axis + 1]), tank::P_DOT_0.at([n, axis + 1])];
            for (name, start, prior, bound) in [
                (names[0].clone(), p, size, 1.0),
                (names[1].clone(), rate, size * omega, (2.0 * omega).max(2.0 * rate.abs())),
            ] {
                let bounds = Some((-bound, bound));
                all.push(Possible { name, start, prior, bounds, each: true, is_free });
            }
        }
        all
    }

    /// The quantities of the mechanical model: labels and names.
    pub fn labels(&self) -> Vec<(String, String)> {
        let n = self.mode;
        let all = [
            ("modal mass m", tank::MASS.at([n])),
            ("pendulum length l", tank::LENGTH.at([n])),
            ("hinge height h", tank::HINGE.at([n])),
            ("damping ratio ζ", tank::ZETA.at([n])),
            ("growth of damping ζ_A", tank::ZETA_AMPLITUDE.at([n])),
            ("damping by breaking ζ_b", tank::ZETA_BREAKING.at([n])),
            ("steepness of breaking s_b", tank::BREAKING_STEEPNESS.at([n])),
            ("third order s", tank::NONLINEAR_INERTIA.at([n])),
            ("third order κ", tank::NONLINEAR_STIFFNESS.at([n])),
            ("rigid mass m₀ (with the shell)", tank::M_0.into()),
            ("height of the rigid mass H₀", tank::H_0.into()),
            ("inertia of the rigid mass I₀", tank::I_0.into()),
        ];
        all.into_iter().map(|(label, name)| (label.into(), name)).collect()
    }
}

/// Amplitudes of cosine and sine over the first period.
fn first_wave(time: &[f64], signal: &[f64], omega: f64) -> [f64; 2] {
    let end = time[0] + std::f64::consts::TAU / omega;
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (t, value) in time.iter().zip(signal).filter(|(t, v)| **t <= end && !v.is_nan()) {
        let (sin, cos) = (omega * (t - time[0])).sin_cos();
        let row = Vector3::new(cos, sin, 1.0);
        matrix += row * row.transpose();
        right += row * *value;
    }
    matrix.lu().solve(&right).map_or([0.0; 2], |found| [found[0], found[1]])
}

/// Height of the force above the reference point: the regression of the moment on the force, along a tank axis.
fn lever(task: &Task, raw: &Raw, axis: usize) -> f64 {
    let [Some((force, sign)), Some((moment, turned))] = lateral(&task.frame, raw)[axis] else {
        return 0.0;
    };
    let of = |k: usize, sign: f64| raw.loads[k].iter().flatten().map(move |v| sign * v);
    let pairs = of(force, sign).zip(of(moment, turned)).filter(|(f, m)| !f.is_nan() && !m.is_nan());
    let (forces, moments): (Vec<f64>, Vec<f64>) = pairs.unzip();
    let (forces, moments) = (about_mean(&forces), about_mean(&moments));
    let product: f64 = forces.iter().zip(&moments).map(|(f, m)| f * m).sum();
    product / forces.iter().map(|f| f * f).sum::<f64>().max(f64::MIN_POSITIVE)
}

/// Frequency of the peak of the loads, Hz; in forced motion, of the ratio of loads and motion.
fn dominant(raw: &Raw, lateral: &[Option<Vec<f64>>; 2]) -> Result<f64> {
    let rows = raw.time.len();
    ensure!(rows >= 8, "{}: {rows} rows are too few (allowed: at least 8)", raw.name);
    let points = rows.min(SPECTRUM_POINTS);
    let (first, last) = (raw.time[0], raw.time[rows - 1]);
    let step = (last - first) / (points - 1) as f64;
    let spectrum = |values: &[f64]| -> Vec<f64> {
        let there: Vec<usize> = (0..rows).filter(|k| !values[*k].is_nan()).collect();
        let (mut even, mut k) = (Vec::with_capacity(points), 0);
        for point in 0..points {
            let t = first + step * point as f64;
            while k + 2 < there.len() && raw.time[there[k + 1]] < t {
                k += 1;
            }
            let (a, b) = (there[k], there[(k + 1).min(there.len() - 1)]);
            let span = (raw.time[b] - raw.time[a]).max(f64::MIN_POSITIVE);
            let part = ((t - raw.time[a]) / span).clamp(0.0, 1.0);
            even.push(values[a] + part * (values[b] - values[a]));
        }
        let mut even = about_mean(&even);
        for (point, value) in even.iter_mut().enumerate() {
            let phase = std::f64::consts::TAU * point as f64 / points as f64;
            *value *= 0.5 - 0.5 * phase.cos();
        }
        even.resize(PADDING * points, 0.0);
        Forward::new(even.len()).of(even).iter().map(|x| x.norm_sqr()).collect()
    };
    let sum = |signals: Vec<(Vec<f64>, i32)>| -> Option<Vec<f64>> {
        let mut total: Option<Vec<f64>> = None;
        for (power, slope) in signals {
            let weigh = |(k, power): (usize, f64)| power * (k as f64).powi(slope);
            let weighed = power.into_iter().enumerate().map(weigh);
            total = Some(match total {
                None => weighed.collect(),
                Some(total) => total.into_iter().zip(weighed).map(|(a, b)| a + b).collect(),
            });
        }
        total
    };
    let loads = lateral.iter().flatten().map(|values| (spectrum(values), 0)).collect();
    let mut ratio = sum(loads).with_context(|| {
        format!(
            "{}: no force or moment across the tank's axis ({})",
            raw.name,
            LOADS.map(|(name, _)| name).join(", ")
        )
    })?;
    let strongest = peak(&ratio);
    ensure!(strongest > 0.0, "{}: forces and moments do not change", raw.name);
    let motion = raw.motion.iter().enumerate();
    let motion = motion
        .filter_map(|(k, values)| Some((spectrum(values.as_ref()?), if k < 3 { 4 } else { 0 })));
    if let Some(motion) = sum(motion.collect()) {
        // an overtone of a large wave, up to 5 % of its force, is no resonance: the tank does not move at its frequency
        let floor = 1e-2 * peak(&motion);
        for (ratio, motion) in ratio.iter_mut().zip(motion) {
            *ratio = if *ratio > 1e-4 * strongest { *ratio / (motion + floor) } else { 0.0 };
        }
    }
    // from one and a half periods in the record on
    let lowest = 3 * PADDING / 2;
    let best = (lowest..ratio.len()).max_by(|a, b| ratio[*a].total_cmp(&ratio[*b]));
    let best = best.context("the record is too short for a spectrum")?;
    Ok(best as f64 / (PADDING as f64 * points as f64 * step))
}

//! Finite amplitude of a tank's first mode: dependence of the frequency on the amplitude, and the second-order wave.
//!
//! The equivalent mass with the slosh angle A = |q|/l is
//!
//! ```text
//! L = (1/2) m (q'^2 + s (q.q')^2/l^2) - (1/2) m omega^2 (q^2 + kappa q^4/(4 l^2))
//! planar  delta omega^2/omega^2 = (3 kappa/8 - s/2) A^2,   circular  (kappa/2) A^2
//! ```
//!
//! s and kappa are chosen so that the mass has the frequency shifts of potential flow to third order:
//! [`crate::third_order`] for vertical walls and a flat bottom, `contour_waves` for other bodies of revolution.

use core::f64::consts::PI;

use formulas::energy_terms::{EnergyTerms, energy_terms};
use formulas::limits::{self, AngleLimit};
use formulas::third_order::{BRIDGED, coefficients};

use crate::coefficients::{Coefficients, Energy, EnergySource, FiniteAmplitude, LimitSource};
use crate::contour::{Contour, Wall};
use crate::contour_waves;
use crate::curve::Point;
use crate::large_waves;
use crate::modal::ModalData;
use crate::shape;
use crate::sphere_waves;
use crate::tank::{Geometry, Shape, Tank};
use crate::third_order::{DETUNING, Overlaps};

const WORST: f64 = 0.05;
/// Largest distance of a contour from vertical walls with a flat bottom, relative to the tank's
/// size, at which the method for vertical walls is used.
const SAME: f64 = 1e-6;
const ROUNDING: f64 = 1e-7;
const COUNTS: [usize; 2] = [10, 20];
const DEGREES: [usize; 2] = [18, 24];
/// Relative difference of the two lengths of a box below which the first modes along both lengths
/// exchange energy. Coefficients for motion in one direction are then not valid.
const NEARLY_SQUARE: f64 = 0.1;
/// Largest value of tanh(k h) from which the depth h of a ring of liquid is computed, because tanh
/// is too flat for larger values. If tanh(k h) is larger, the depth at which it has this value is
/// used.
const DEEP: f64 = 0.999;
/// Largest slosh angle at which the third order counts as valid, rad. For example, at 26 degrees
/// the frequency of the circular wave in a cylinder with h/R = 0.613 differs by 4 % from fully
/// nonlinear flow.
const MOST_ANGLE: f64 = 30.0 * PI / 180.0;
/// Estimated angle limit of a mode, divided by the slosh angle at which the second-order wave is
/// half of the first-order wave ([`STEEPEST`]), for tanks that nobody has compared with fully
/// nonlinear flow. It is the smallest ratio in upright cylinders and in a sphere filled to h/R =
/// 1.5, where the error of a forced response reaches 3 % at 2.6 degrees.
const ESTIMATED_SHARE: f64 = 0.12;
/// Largest second-order wave at the wall, relative to the first-order wave, at which the third
/// order counts as valid.
const STEEPEST: f64 = 0.5;

const LARGEST_FREQUENCY_ERROR: f64 = 3e-3;
/// Largest accepted difference between two shifts of omega^2 per squared slosh angle: the shift
/// that the smallest computed waves have, and the shift that third-order theory predicts. At a
/// slosh angle of 10 degrees this difference changes the frequency by 0.03 %.
const LARGEST_SHIFT_ERROR: f64 = 0.02;

const ASSUMED: &str = "without them the FMUs model a pendulum (s = kappa = 1: omega^2 shifts by -0.125 A^2 in planar and by \
    +0.5 A^2 in circular motion). That is an assumption: a deep upright cylinder has -0.45 A^2 and +0.36 A^2";

/// Smallest slosh angle up to which the third order has to be valid, rad. Otherwise a warning says
/// so, and files for the FMUs leave its coefficients out.
pub(crate) const LEAST_ANGLE: f64 = 5.0 * PI / 180.0;

impl Coefficients {
    /// Combines the results of two computations, of which `fine` uses more base functions than
    /// `rough`. The coefficients come from `fine`, and the difference between the two results gives
    /// their error. `wave` is the elevation at the wall per slosh angle, m/rad.
    fn new([rough, fine]: [Found; 2], wave: f64) -> Coefficients {
        let [s, kappa] = fine.equivalent;
        let differ = |i: usize| {
            (rough.equivalent[i] - fine.equivalent[i]).abs() / (1.0 + fine.equivalent[i].abs())
        };
        Coefficients {
            nonlinear_inertia: s,
            nonlinear_stiffness: kappa,
            error: (2.0 * differ(0).max(differ(1))).max(ROUNDING),
            planar: fine.planar,
            circular: fine.circular,
            wave_second: fine.second,
            angle_limit: (ESTIMATED_SHARE * STEEPEST * wave / fine.second)
                .abs()
                .min(limits::LARGEST_FORCED),
            angle_limit_from: LimitSource::Estimate,
            frequency_limit: None,
            swirl_limit: None,
            series_limit: (STEEPEST * wave / fine.second).abs().min(MOST_ANGLE),
            bridged: false,
            energy: None,
        }
    }

    /// Adds the angle limits and the energy coefficients of an upright cylinder filled to h/R =
    /// `fill`. Near the poles of the third-order theory, s, kappa and the second-order wave are
    /// interpolated over the fill; `second` returns the second-order wave at a given fill. `wave`
    /// is the elevation at the wall per slosh angle, m/rad.
    fn cylinder_coefficients(
        self,
        fill: f64,
        wave: f64,
        second: impl Fn(f64) -> f64,
    ) -> Coefficients {
        let mut known = self;
        let [low, high] = BRIDGED;
        if fill > low && fill < high {
            let (s, kappa) = coefficients(fill);
            let [planar, circular] = formulas::third_order::shifts(s, kappa);
            let [below, above] = [low, high].map(second);
            let wave_second = below + (above - below) * (fill - low) / (high - low);
            known = Coefficients {
                nonlinear_inertia: s,
                nonlinear_stiffness: kappa,
                error: WORST,
                planar,
                circular: Some(circular),
                wave_second,
                series_limit: (STEEPEST * wave / wave_second).abs().min(MOST_ANGLE),
                bridged: true,
                ..known
            };
        }
        let limit = limits::cylinder(fill, [Some(known.planar), known.circular]);
        Coefficients {
            angle_limit: limit.forced,
            angle_limit_from: LimitSource::PotentialFlow,
            frequency_limit: Some(limit.frequency),
            swirl_limit: limits::swirl(fill, false),
            energy: cylinder_energy(fill),
            ..known
        }
    }

    fn sphere_coefficients(self, fill: f64) -> Coefficients {
        let tables = (sphere_waves::energy_terms(fill), sphere_waves::forced_limits(fill));
        let (Some(terms), Some([third, planar, rotary])) = tables else { return self };
        let pair = [self.nonlinear_inertia, self.nonlinear_stiffness];
        let errors = sphere_waves::ERRORS;
        Coefficients {
            angle_limit: third,
            angle_limit_from: LimitSource::PotentialFlow,
            frequency_limit: Some(large_waves::third_order_limit(&terms, pair).frequency),
            energy: Some(Energy {
                swirl_limit: Some(rotary),
                ..Energy::new(&terms, errors, planar, EnergySource::SphereTable)
            }),
            ..self
        }
    }

    /// Adds the coefficients `terms`, which give the energy of large waves in this tank. `errors`
    /// are the largest relative errors of frequency and energy. The large waves also limit the
    /// range of the third-order coefficients.
    fn with_large_waves(
        self,
        terms: &EnergyTerms,
        errors: [f64; 2],
        source: EnergySource,
    ) -> Coefficients {
        let pair = [self.nonlinear_inertia, self.nonlinear_stiffness];
        let AngleLimit { frequency, forced } = large_waves::third_order_limit(terms, pair);
        // Forced waves were not computed for this tank, so that the smaller angle counts.
        let (angle_limit, angle_limit_from) = match forced < self.angle_limit {
            true => (forced, LimitSource::FreeWaves),
            false => (self.angle_limit, self.angle_limit_from),
        };
        let limit = (limits::ENERGY_UNCOMPARED * angle_limit).min(limits::LARGEST_FORCED_ENERGY);
        Coefficients {
            angle_limit,
            angle_limit_from,
            frequency_limit: Some(frequency),
            energy: Some(Energy::new(terms, errors, limit, source)),
            ..self
        }
    }

    /// Returns the slosh angle, rad, above which a pendulum must not replace a slosh mass with
    /// these coefficients. At this angle the pendulum's shift of omega^2 differs too much from the
    /// shift by these coefficients; the error of s and kappa counts as part of the difference.
    fn pendulum_limit(&self) -> f64 {
        let [s, kappa] = [self.nonlinear_inertia, self.nonlinear_stiffness]
            .map(|x| self.error * (1.0 + x.abs()));
        let [planar, circular] = formulas::third_order::shifts(1.0, 1.0);
        let away = |shift: f64, exact: f64, error: f64| exact + error.copysign(exact - shift);
        let exact = [
            away(planar, self.planar, 0.375 * kappa + 0.5 * s),
            self.circular.map_or(circular, |exact| away(circular, exact, 0.5 * kappa)),
        ];
        limits::shifted(self.angle_limit, limits::FORCED, [Some(planar), Some(circular)], exact)
    }
}

impl Energy {
    /// Combines the coefficients `known` with their largest relative errors of frequency and
    /// energy, and with the slosh angle `angle_limit`, rad, above which the mode is out of range.
    fn new(
        known: &EnergyTerms,
        [frequency_error, energy_error]: [f64; 2],
        angle_limit: f64,
        source: EnergySource,
    ) -> Energy {
        let ([s, kappa], [s_2, kappa_2], [t, t_2]) = (known.pair, known.next, known.rotary);
        Energy {
            nonlinear_inertia: s,
            nonlinear_stiffness: kappa,
            nonlinear_inertia_2: s_2,
            nonlinear_stiffness_2: kappa_2,
            rotary_inertia: t,
            rotary_inertia_2: t_2,
            angle_limit: angle_limit.min(known.compared),
            swirl_limit: None,
            frequency_limit: known.compared,
            frequency_error,
            energy_error,
            source,
        }
    }
}

fn cylinder_energy(fill: f64) -> Option<Energy> {
    let (known, limit) = (energy_terms(fill)?, limits::cylinder_with_energy(fill)?);
    let errors = [1.1e-3, if fill < 0.35 { 1.1e-2 } else { 1e-3 }];
    let swirl_limit = limits::swirl(fill, true);
    Some(Energy {
        swirl_limit,
        ..Energy::new(&known, errors, limit.forced, EnergySource::CylinderTable)
    })
}

fn sphere_radius(contour: &Contour, wall: &Wall, depth: f64) -> Option<f64> {
    let Shape::Sphere { radius } = shape::recognise(wall, depth)?.shape else { return None };
    let centre = wall.z_surface - depth + radius;
    let is_on = |[r, z]: Point| (r.hypot(z - centre) - radius).abs() < SAME * radius;
    let mut points = contour
        .segments()
        .iter()
        .flat_map(|part| (0..=32).map(|i| part.point_at(f64::from(i) / 32.0)));
    points.all(is_on).then_some(radius)
}

/// Adds coefficients that give the wave's energy to `data`, which already has third-order
/// coefficients. They come from fully nonlinear potential flow in this tank at this fill, which
/// takes about 10 s. Nothing happens if `data` already has such coefficients from the tables of
/// upright cylinders and spheres. If the computation is not possible, a warning says why.
pub fn add_large_waves(tank: &Tank, data: &mut ModalData) {
    let Some(mut found) = data.finite_amplitude.clone() else { return };
    match &mut found.mode {
        Some(known) if known.energy.is_some() => {}
        Some(known) => match large_waves(tank, data, known) {
            Ok(with_energy) => *known = with_energy,
            Err(why) => found.warnings.push(format!("finite amplitude: {LEFT_OUT} {why}")),
        },
        None => found.warnings.push(format!(
            "finite amplitude: {LEFT_OUT} s and kappa of the third order are not known"
        )),
    }
    data.finite_amplitude = Some(found);
}

const LEFT_OUT: &str = "the coefficients that give the wave's energy are left out, because";

#[derive(Clone, Copy, Debug, thiserror::Error)]
enum NoEnergy {
    #[error("the tank is not a body of revolution")]
    NotRound,
    #[error("the liquid is a ring")]
    Ring,
    #[error(
        "periodic waves up to {:.0} degrees were not found: the wall has a corner near the surface, or modes of the surface have \
         multiples of the frequency of mode 1",
        large_waves::LEAST.to_degrees()
    )]
    NoWaves,
    #[error(
        "the shift of omega^2 per squared slosh angle of small waves differs by {0:.2} from the shift by third-order \
         theory (allowed: {LARGEST_SHIFT_ERROR}): for deep liquid and strong resonances this computation has too few \
         basis functions"
    )]
    OtherThirdOrder(f64),
    #[error(
        "no coefficients of a slosh mass give the frequencies of the waves within {:.1} %: the best ones have an \
         error of {:.1} %",
        100.0 * LARGEST_FREQUENCY_ERROR,
        100.0 * .0
    )]
    NoSloshMass(f64),
}

fn large_waves(
    tank: &Tank,
    data: &ModalData,
    third: &Coefficients,
) -> Result<Coefficients, NoEnergy> {
    let (Geometry::Revolution { contour, .. }, Some(wall)) = (&tank.geometry, &data.wall) else {
        return Err(NoEnergy::NotRound);
    };
    if wall.r_inner > 0.0 {
        return Err(NoEnergy::Ring);
    }
    let fit = large_waves::Side::new(contour, wall).and_then(|side| large_waves::fit(wall, &side));
    let fit = fit.ok_or(NoEnergy::NoWaves)?;
    // The third-order shifts with which the computed waves are compared come from another method.
    let exact = [third.planar, third.circular.unwrap_or(fit.shifts[1])];
    let off = (0..2).map(|i| (fit.shifts[i] - exact[i]).abs()).fold(0.0, f64::max);
    if off > LARGEST_SHIFT_ERROR {
        return Err(NoEnergy::OtherThirdOrder(off));
    }
    let [planar, rotary, energy] = fit.errors;
    if planar.max(rotary) > LARGEST_FREQUENCY_ERROR {
        return Err(NoEnergy::NoSloshMass(planar.max(rotary)));
    }
    let errors = [planar.max(rotary), energy];
    Ok(third.with_large_waves(&fit.terms, errors, EnergySource::ThisTank))
}

#[derive(Clone, Copy, Debug)]
struct Found {
    equivalent: [f64; 2],
    planar: f64,
    circular: Option<f64>,
    second: f64,
}

impl Found {
    fn from_overlaps(overlaps: &Overlaps, depth: f64) -> Found {
        let [planar, circular] = overlaps.shifts(depth);
        Found {
            equivalent: overlaps.equivalent(depth),
            planar,
            circular: overlaps.fourth[1].map(|_| circular),
            second: overlaps.second_wave(depth),
        }
    }
}

/// Coefficients of a mode, or `Err` if their error is too large for a slosh mass. The coefficients
/// in `Err` only serve to compute how far a pendulum is from the liquid.
type Judged = Result<Coefficients, Box<Coefficients>>;

/// Returns the amplitude dependence of the first mode of a tank whose modes are `data`. The
/// coefficients do not depend on the specific force, and they hold only without surface tension.
pub fn amplitude_dependence(tank: &Tank, data: &ModalData) -> FiniteAmplitude {
    let (Some(mode), depth) = (data.modes.first(), data.fill) else {
        return FiniteAmplitude::default();
    };
    let mut warnings = Vec::new();
    let modes = match (&tank.geometry, &data.axes) {
        (Geometry::Box { length_x, length_y }, Some(axes)) => {
            let wave_y = axes.y.modes.first().map_or(mode.wave, |mode| mode.wave);
            box_coefficients([*length_x, *length_y], depth, [mode.wave, wave_y], &mut warnings)
                .map(Some)
        }
        _ => {
            let known = match (ring(data), &data.wall) {
                (Some(radii), _) => {
                    Some(upright_coefficients(radii, depth, mode.wave, &mut warnings))
                }
                (None, Some(wall)) => {
                    let known = contour_coefficients(wall, mode.wave, mode.lambda, &mut warnings);
                    let radius = match &tank.geometry {
                        Geometry::Revolution { contour, .. } => sphere_radius(contour, wall, depth),
                        Geometry::Box { .. } => None,
                    };
                    let fill = radius.map(|radius| depth / radius);
                    Some(known.map(|known| match fill {
                        Some(fill) => known.sphere_coefficients(fill),
                        None => known,
                    }))
                }
                (None, None) => None,
            };
            [known, None]
        }
    };
    let mut judge = |mode: Option<Judged>| {
        let known = mode?.ok()?;
        if known.error > WORST {
            warnings.push(format!(
                "finite amplitude: s and kappa of mode 1 are known to {:.0e} of 1 + |s| only (allowed: {WORST}), so they are left out; \
                 {ASSUMED}",
                known.error
            ));
            return None;
        }
        if known.series_limit < LEAST_ANGLE {
            warnings.push(format!(
                "finite amplitude: s and kappa of mode 1 hold up to {:.2} degrees at most, where the second-order wave is {STEEPEST} \
                 of the first-order wave (shallow liquid, or a mode of the surface near twice the frequency)",
                known.series_limit.to_degrees()
            ));
        }
        Some(known)
    };
    let limit = |mode: &Judged| mode.as_ref().unwrap_or_else(|refused| refused).pendulum_limit();
    let [pendulum_limit, pendulum_limit_y] = modes.each_ref().map(|mode| mode.as_ref().map(limit));
    let [mode, mode_y] = modes.map(&mut judge);
    warnings.dedup();

    FiniteAmplitude { mode, mode_y, pendulum_limit, pendulum_limit_y, warnings }
}

/// Computes the coefficients of a tank with vertical walls and a flat bottom. The radii `inner` (0
/// without an inner wall) and `outer` and the depth are in m; `wave` is the elevation at the wall
/// per slosh angle, m/rad.
fn upright_coefficients(
    [inner, outer]: [f64; 2],
    depth: f64,
    wave: f64,
    warnings: &mut Vec<String>,
) -> Judged {
    let all = COUNTS.map(|count| Overlaps::round(inner, outer, count));
    let all = all.each_ref();
    match inner > 0.0 {
        true => coefficients_from_overlaps(all, depth, wave, warnings),
        false => Ok(cylinder_coefficients(all, depth, outer, wave, warnings)),
    }
}

fn coefficients_from_overlaps(
    [rough, fine]: [&Overlaps; 2],
    depth: f64,
    wave: f64,
    warnings: &mut Vec<String>,
) -> Judged {
    let known = Coefficients::new([rough, fine].map(|x| Found::from_overlaps(x, depth)), wave);
    let excited = fine.secondary_resonance(depth);
    let detuned = |detuning| fine.detuned_equivalent(depth, detuning);
    known.judge_near_resonance(excited, &detuned, warnings)
}

fn cylinder_coefficients(
    all: [&Overlaps; 2],
    depth: f64,
    radius: f64,
    wave: f64,
    warnings: &mut Vec<String>,
) -> Coefficients {
    let known = Coefficients::new(all.map(|x| Found::from_overlaps(x, depth)), wave);
    let known =
        known.cylinder_coefficients(depth / radius, wave, |fill| all[1].second_wave(fill * radius));
    if known.bridged {
        warnings.push(format!(
            "finite amplitude: at h/R {:.3} s and kappa are interpolated between h/R {} and {}, because modes of the surface have \
             nearly twice the frequency of mode 1, and the third order has poles there",
            depth / radius,
            BRIDGED[0],
            BRIDGED[1]
        ));
    }
    if let Some(limit) = limits::swirl_fold(depth / radius) {
        warnings.push(format!(
            "finite amplitude: at {:.1} degrees a secondary resonance folds the branch of rotary motion; beyond, the liquid moves on another branch",
            limit.to_degrees()
        ));
    }
    known
}

impl Coefficients {
    /// Takes account of `excited`, a mode with nearly twice the frequency of the first mode, if
    /// there is one: the error of the coefficients becomes at least the contribution of this mode,
    /// and the result is `Err` if the contribution is too large. `detuned` returns s and kappa for
    /// a second-order response at 2 omega (1 + its argument), with the frequency omega of the first
    /// mode.
    fn judge_near_resonance(
        mut self,
        excited: Option<[usize; 2]>,
        detuned: &dyn Fn(f64) -> [f64; 2],
        warnings: &mut Vec<String>,
    ) -> Judged {
        let Some([m, n]) = excited else { return Ok(self) };
        let known = [self.nonlinear_inertia, self.nonlinear_stiffness];
        // The contributions of the other modes change smoothly with the detuning, so that the second difference removes them.
        let [below, above] = [-2.0, 2.0].map(|factor| detuned(factor * DETUNING));
        let share = (0..2)
            .map(|i| (0.5 * (below[i] + above[i]) - known[i]).abs() / (1.0 + known[i].abs()))
            .fold(0.0, f64::max);
        let near = format!(
            "finite amplitude: mode ({m},{n}) of the surface has twice the frequency of mode 1 within {} %, where s and kappa \
             have a pole",
            100.0 * DETUNING
        );
        self.error = self.error.max(share);
        if share > WORST {
            warnings.push(format!("{near}, so they are left out; {ASSUMED}"));
            return Err(Box::new(self));
        }
        warnings.push(format!("{near}; here it changes them by at most {share:.0e} of 1 + |s|"));
        Ok(self)
    }
}

/// Returns the inner and outer radius, m, of a tank with vertical walls and a flat bottom, or
/// `None` for another tank. The inner radius is 0 without an inner wall.
fn ring(data: &ModalData) -> Option<[f64; 2]> {
    let wall = data.wall.as_ref()?;
    let (inner, outer, bottom) = (wall.r_inner, wall.r_outer, wall.z_surface - data.fill);
    let size = outer.max(data.fill);
    let is_on = |[r, z]: Point| {
        let to_inner = if inner > 0.0 { (r - inner).abs() } else { f64::INFINITY };
        (r - outer).abs().min(to_inner).min((z - bottom).abs()) < SAME * size
    };
    let mut points =
        wall.segments.iter().flat_map(|part| (0..=32).map(|i| part.point_at(f64::from(i) / 32.0)));
    points.all(is_on).then_some([inner, outer])
}

fn box_coefficients(
    [length_x, length_y]: [f64; 2],
    depth: f64,
    waves: [f64; 2],
    warnings: &mut Vec<String>,
) -> [Judged; 2] {
    if length_x == length_y {
        let [side, diagonal] = [false, true].map(|diagonal| Overlaps::square(length_x, diagonal));
        let shifts = [&side, &diagonal].map(|overlaps| overlaps.shifts(depth)[0]);
        let known = coefficients_from_overlaps([&side; 2], depth, waves[0], warnings);
        if known.is_ok() {
            warnings.push(format!(
                "finite amplitude: in a square box omega^2 shifts by {:.4} A^2 in planar motion along a side, and by {:.4} A^2 along a \
                 diagonal. s and kappa belong to motion along a side and to circular motion",
                shifts[0], shifts[1]
            ));
        }
        return [known.clone(), known];
    }
    let known = [(length_x, waves[0]), (length_y, waves[1])].map(|(length, wave)| {
        let overlaps = Overlaps::rectangle(length);
        coefficients_from_overlaps([&overlaps; 2], depth, wave, warnings)
    });
    let difference = (length_x / length_y - 1.0).abs();
    if difference < NEARLY_SQUARE {
        warnings.push(format!(
            "finite amplitude: the box's lengths differ by {:.1} %, so its modes along both exchange energy at finite amplitude; s and \
             kappa hold only for motion along one length",
            100.0 * difference
        ));
    }
    known
}

/// Computes the coefficients of a body of revolution with any wall. `wave` is the elevation at the
/// wall per slosh angle, m/rad, and `lambda`, 1/m, is the eigenvalue of the first mode from the
/// boundary integral equation. For a ring of liquid the result is `Err` with the coefficients of a
/// ring between vertical walls that has the same radii and the same lambda.
fn contour_coefficients(wall: &Wall, wave: f64, lambda: f64, warnings: &mut Vec<String>) -> Judged {
    let [Some(rough), Some(fine)] =
        DEGREES.map(|degree| contour_waves::waves(wall, degree, 1, 0.0))
    else {
        warnings.push(format!(
            "finite amplitude: s and kappa of mode 1 are not known for a ring of liquid, except between vertical walls (shape = {{ annulus \
             = … }}); {ASSUMED}"
        ));
        let radii = [wall.r_inner, wall.r_outer];
        let k = Overlaps::round(radii[0], radii[1], COUNTS[0]).k;
        let depth = (lambda / k).min(DEEP).atanh() / k;
        return Err(upright_coefficients(radii, depth, wave, &mut Vec::new())
            .map_or_else(|refused| refused, Box::new));
    };
    let radius = wall.r_outer;
    let equivalent = |[planar, circular]: [f64; 2]| [1.5 * circular - 2.0 * planar, 2.0 * circular];
    let found = [&rough, &fine].map(|waves| Found {
        equivalent: equivalent(waves.shifts),
        planar: waves.shifts[0],
        circular: Some(waves.shifts[1]),
        second: waves.second_wave * radius,
    });
    let mut known = Coefficients::new(found, wave);
    // The error of the harmonics shows in their lambda, because the boundary integral equation gives lambda to ten digits.
    known.error = known.error.max(2.0 * (fine.lambda / (lambda * radius) - 1.0).abs());
    let detuned_by = |lambda: f64| ((4.0 * fine.lambda / lambda).sqrt() - 1.0).abs();
    let excited = fine.excited.iter().find(|(_, lambda)| detuned_by(*lambda) < DETUNING);
    let detuned = |detuning| {
        let waves = contour_waves::waves(wall, DEGREES[1], 1, detuning);
        waves.map_or([f64::INFINITY; 2], |waves| equivalent(waves.shifts))
    };
    known.judge_near_resonance(excited.map(|(mode, _)| *mode), &detuned, warnings)
}

//! Pendulums that represent the liquid: for an upright cylinder from its dimensions, for any other tank from a table.
//!
//! Modal masses and lengths (`formulas::cylinder`): Rubaga's thesis, Table 4.1, which agrees with Abramson, NASA SP-106, and
//! Dodge (2000), with the exact zeros of J1'. Damping: `formulas::damping`. Capillarity, for a flat surface with a free
//! contact line, is exact in the cylinder: omega_n^2 = g/l_n + sigma xi_n^3 tanh(xi_n h/R)/(rho R^3). The lengths depend
//! only on the geometry. Capillarity acts as a centring stiffness k_n, which is equivalent to an increase of g by
//!
//! ```text
//! a_n = k_n l_n/m_n = sigma xi_n^2/(rho R^2)
//! ```
//!
//! On a tilted bench the cylinder's surface is tilted, see `leaning.rs`. Modes from a table do not change with the tilt.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use formulas::cylinder::{self, XI};
use formulas::damping;
use formulas::similarity;
use formulas::third_order::{BRIDGED, coefficients};

use crate::amplitude::{Breaking, Growth};
use crate::baffle::{self, Baffle};
use crate::leaning::{self, Leaning};
use crate::parameters::{MODES, ModeTable, Parameters, Slosh, SloshSource};
use crate::pendulum::Pendulum;
use crate::slosh_model::SloshModel;

/// Values that were calculated from the parameters; 0 for unused modes.
/// - `m_liq`, `m_0`: masses of the whole liquid and of the rigid liquid, kg.
/// - `bond`: Bond number rho g R^2/sigma.
/// - `mass`, `length`: slosh mass, kg, and pendulum length, m, of each mode; on a tilted bench the values of an oblique
///   pendulum with the same frequency.
/// - `frequency`: natural frequency of each mode, Hz.
/// - `damping`: damping ratio of each mode.
/// - `centring`: increase of g that is equivalent to the stiffness by surface tension, m/s2.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
#[allow(missing_docs)]
pub struct Calculated {
    pub m_liq: f64,
    pub m_0: f64,
    pub bond: f64,
    pub mass: [f64; MODES],
    pub length: [f64; MODES],
    pub frequency: [f64; MODES],
    pub damping: [f64; MODES],
    pub centring: [f64; MODES],
}

pub(crate) fn problems(p: &Parameters) -> Vec<String> {
    let (slosh, table) = (&p.slosh, &p.slosh.table);
    let mut problems = baffle::problems(p);
    problems.extend(leaning::problems(p));
    problems.extend(inertia_problems(p));
    if slosh.source != SloshSource::Table {
        return problems;
    }
    let along_one = slosh.model.moves_along_one();
    if table.one_axis && !along_one {
        problems.push(
            "slosh.table.one_axis = true cannot be combined with slosh.model = spherical or liquid, whose slosh masses move along \
             both axes with the same modes: set slosh.model = frozen, linear or planar, or slosh.table.one_axis = false"
                .to_string(),
        );
    }
    let modes = slosh.modes.min(MODES);
    let askew = (0..modes).find(|n| table.direction[*n] != 0.0);
    if let (Some(n), false) = (askew, along_one) {
        problems.push(format!(
            "slosh.table.direction[{}] = {} rad cannot be combined with slosh.model = spherical or liquid, whose slosh masses move \
             along all directions with the same frequency: set slosh.model = frozen, linear or planar, or the direction to 0",
            n + 1,
            table.direction[n]
        ));
    }
    let positive = |name: &str, value: f64| {
        (value.is_nan() || value <= 0.0)
            .then(|| format!("slosh.table.{name} = {value} (allowed: greater than 0)"))
    };
    problems.extend(positive("m_liq", table.m_liq));
    for n in 0..modes {
        problems.extend(positive(&format!("mass[{}]", n + 1), table.mass[n]));
        let (length, frequency, n) = (table.length[n], table.frequency[n], n + 1);
        if (length > 0.0) == (frequency > 0.0) {
            problems.push(format!(
                "slosh.table.length[{n}] = {length} m and slosh.table.frequency[{n}] = {frequency} Hz: set one of the two above 0 and \
                 the other to 0, because each determines the other"
            ));
        }
    }
    if !problems.is_empty() {
        return problems;
    }
    let length = |n: usize| table.pendulum_length(n);
    for n in (0..modes).filter(|n| length(*n).is_nan() || length(*n) <= 0.0) {
        problems.push(format!(
            "slosh.table.frequency[{0}] = {1} Hz (allowed: above the frequency that the stiffness slosh.table.k[{0}] = {2} N/m causes without \
             gravity)",
            n + 1,
            table.frequency[n],
            table.k[n]
        ));
    }
    let omega2 = |n: usize| table.g_ref / length(n) + table.k[n] / table.mass[n];
    for n in 1..modes {
        // The modes along each direction must be in the order of their own frequencies.
        let same = |m: &usize| table.direction[*m] == table.direction[n];
        let Some(before) = (0..n).rev().find(same).filter(|m| omega2(n) < omega2(*m)) else {
            continue;
        };
        problems.push(format!(
            "the modes of slosh.table are not in the order of their frequencies: mode {} has a lower \
             frequency than mode {} (allowed: ascending frequencies in each direction)",
            n + 1,
            before + 1
        ));
    }
    let sum = table.most_along_one(modes);
    // The fixed mass may be negative by the last digit of a table that is written in decimals.
    if sum > table.m_liq * (1.0 + 1e-9) {
        problems.push(format!(
            "the masses of slosh.table add up to {sum} kg along one direction (allowed: up to slosh.table.m_liq = {} kg)",
            table.m_liq
        ));
    }
    let least = p.hub.inertia + p.tank.own_inertia + table.least_inertia(modes, p.tank.r);
    if askew.is_some() && slosh.model == SloshModel::Planar && least <= 0.0 {
        problems.push(format!(
            "slosh.table.direction: at the most unfavourable directions of the slosh masses hub and liquid together have the inertia {least} \
             kg.m2 (allowed: greater than 0). Increase hub.I = {} kg.m2, or reduce slosh.table.mass",
            p.hub.inertia
        ));
    }
    problems
}

impl ModeTable {
    pub(crate) fn is_askew(&self, modes: usize) -> bool {
        self.direction[..modes].iter().any(|direction| *direction != 0.0)
    }

    /// Returns the largest sum of slosh masses that move along one direction, kg, which must not exceed the mass of the
    /// liquid. It is the larger eigenvalue of the sum of m n n^T over the first `modes` modes, with the slosh mass m and the
    /// direction n of each mode.
    fn most_along_one(&self, modes: usize) -> f64 {
        if self.direction[..modes].iter().all(|direction| *direction == self.direction[0]) {
            return self.mass[..modes].iter().sum();
        }
        let (mut half, mut cross, mut sum) = (0.0, 0.0, 0.0);
        for (n, m) in self.mass[..modes].iter().enumerate() {
            let [x, t] = self.direction_components(n);
            (half, cross, sum) = (half + m * (x * x - t * t) / 2.0, cross + m * x * t, sum + m);
        }
        sum / 2.0 + libm::hypot(half, cross)
    }

    /// Returns the smallest inertia, kg m2, that the liquid of the slosh model `planar` can have about the bearing axis
    /// while its modes move. `r` is the distance of the tank from the axis, m. The inertia is m_0 r^2 of the rigid liquid
    /// plus, for each mode with the slosh mass m and the pendulum length l, the smallest value of m [r_x^2 + 2 r_x l s +
    /// (r_t^2 + l^2) s^2], where s is the sine of the slosh angle and r_x and r_t are the components of r along the mode's
    /// direction and across it.
    fn least_inertia(&self, modes: usize, r: f64) -> f64 {
        let of_mode = |n: usize| {
            let ([n_x, n_t], l) = (self.direction_components(n), self.pendulum_length(n));
            let (r_x, r_t) = (r * n_x, r * n_t);
            let s = (-r_x * l / (r_t * r_t + l * l)).clamp(-1.0, 1.0);
            let j = r_x * r_x + 2.0 * r_x * l * s + (r_t * r_t + l * l) * s * s;
            self.mass[n] * (j - r * r)
        };
        self.m_liq * r * r + (0..modes).map(of_mode).sum::<f64>()
    }
}

pub(crate) fn warnings(p: &Parameters, g: f64) -> Vec<String> {
    let (slosh, radius) = (&p.slosh, p.tank.d / 2.0);
    let geometry = slosh.source == SloshSource::Geometry;
    let mut warnings = Vec::new();
    if slosh.model == SloshModel::Frozen {
        return warnings;
    }
    warnings.extend(baffle::warnings(p));
    warnings.extend(leaning::warnings(p));
    if !geometry && slosh.model == SloshModel::Linear && slosh.table.is_askew(slosh.modes) {
        warnings.push(
            "slosh.table.direction is set and slosh.model = linear: this model has no centrifugal and Coriolis forces, so that \
             rotation of the hub excites only the tangential part of a mode. Set slosh.model = planar for these forces"
                .to_string(),
        );
    }
    match slosh.source {
        _ if slosh.model != SloshModel::Liquid => {}
        SloshSource::Geometry => warnings.extend(third_order_warning(p.tank.h / radius)),
        SloshSource::Table if slosh.third_order(0, 0.0) == (1.0, 1.0) => warnings.push(
            "slosh.table.nonlinear_inertia[1] and slosh.table.nonlinear_stiffness[1] are 1 although slosh.model = liquid: the \
             frequency of mode 1 then falls with the amplitude like the frequency of a pendulum, whatever the tank. Set both to the coefficients of this tank"
                .to_string(),
        ),
        SloshSource::Table => {}
    }
    let calculated = Calculated::new(p, g);
    warnings.extend(breaking_warning(p, &calculated));
    let Calculated { bond, mass, centring, .. } = calculated;
    let mut used = mass.iter().zip(centring).take_while(|(mass, _)| **mass > 0.0);
    if let Some(n) = used.position(|(_, a)| g + a <= 0.0) {
        warnings.push(format!(
            "g_axial = 0 at the start: the tank is weightless, and nothing restores or damps slosh mode {}. \
             Set the input g_axial, slosh.capillarity or slosh.table.k",
            n + 1
        ));
    } else if centring[0] == 0.0 && bond < LOW_BOND {
        warnings.push(format!(
            "the Bond number is {bond:.3} (below {LOW_BOND}): surface tension changes the slosh frequency noticeably, but the model \
             does not include it. Set slosh.capillarity or slosh.table.k"
        ));
    }
    if geometry && slosh.capillarity && bond < LOW_BOND {
        warnings.push(format!(
            "slosh.capillarity = true at the Bond number {bond:.3}: the frequencies are valid for a flat surface whose contact line \
             moves freely. For other contact angles set slosh.table.k. The modal masses are the modal masses under a flat surface, \
             because those under a curved meniscus are unknown"
        ));
    }
    warnings
}

impl Slosh {
    pub(crate) fn damping_grows(&self) -> bool {
        self.zeta_amplitude > 0.0 || self.zeta_breaking > 0.0
    }

    /// Returns the parameters of breaking waves for mode `n`, where the first mode has the number 0. `wave` is the elevation
    /// at the wall per slosh angle, m/rad. If the table of modes gives no wave number, the wave number of an upright cylinder
    /// with this `radius`, m, is used.
    pub(crate) fn breaking(&self, n: usize, wave: f64, radius: f64) -> Breaking {
        let k = match self.source {
            SloshSource::Table if self.table.wave_number[n] > 0.0 => self.table.wave_number[n],
            _ => XI[n] / radius,
        };
        Breaking { zeta: self.zeta_breaking, onset: self.breaking_steepness, steepness: k * wave }
    }

    /// Returns the large-wave coefficients s (inertia) and kappa (stiffness) of mode `n` in a tank filled to h/R = `fill`;
    /// the first mode has the number 0. Both are 1, as for a pendulum, in all slosh models except `liquid`, and for all modes
    /// of a cylinder except the first.
    pub(crate) fn third_order(&self, n: usize, fill: f64) -> (f64, f64) {
        match self.source {
            _ if self.model != SloshModel::Liquid => (1.0, 1.0),
            SloshSource::Table => {
                (self.table.nonlinear_inertia[n], self.table.nonlinear_stiffness[n])
            }
            SloshSource::Geometry if n == 0 => coefficients(fill),
            SloshSource::Geometry => (1.0, 1.0),
        }
    }
}

/// Returns a message for each mode of the slosh model `liquid` whose inertia falls with the amplitude (s <= 0). These modes
/// are refused, because above some amplitude, which depends on the hub, the kinetic energy of hub and liquid would not be
/// positive.
fn inertia_problems(p: &Parameters) -> impl Iterator<Item = String> {
    let (fill, slosh) = (2.0 * p.tank.h / p.tank.d, p.slosh);
    let falling =
        move |n: usize| Some((n, slosh.third_order(n, fill).0)).filter(|(_, s)| *s <= 0.0);
    (0..slosh.modes.min(MODES)).filter_map(falling).map(move |(n, s)| match slosh.source {
        SloshSource::Geometry => format!(
            "slosh.model = liquid at tank.h / (tank.d/2) = {fill:.4}: the inertia coefficient s = {s:.3} is not above 0, so \
             the kinetic energy would be indefinite. Use a fill with s above 0, such as 0.35 and above, or \
             slosh.model = spherical"
        ),
        SloshSource::Table => format!(
            "slosh.table.nonlinear_inertia[{}] = {s} cannot be combined with slosh.model = liquid, because the kinetic energy would be \
             indefinite: set it above 0, or slosh.model = spherical",
            n + 1
        ),
    })
}

/// Fill h/R below which waves are shallow, so that the large-wave coefficients grow without bound and s becomes negative.
const SHALLOW: f64 = 0.4;

fn third_order_warning(fill: f64) -> Option<String> {
    let (s, kappa) = coefficients(fill);
    if fill < SHALLOW {
        return Some(format!(
            "slosh.model = liquid at h/R = {fill:.3}: below {SHALLOW} waves are shallow, and the third \
             order in the amplitude (s = {s:.3}, kappa = {kappa:.3}) holds only for very small waves"
        ));
    }
    let [low, high] = BRIDGED;
    (fill > low && fill < high).then(|| {
        format!(
            "slosh.model = liquid at h/R = {fill:.3}: between {low:.2} and {high:.2} the third order has poles, where other modes \
             have twice the frequency of mode 1. The coefficients (s = {s:.3}, kappa = {kappa:.3}) are interpolated between these \
             depths"
        )
    })
}

fn breaking_warning(p: &Parameters, calculated: &Calculated) -> Option<String> {
    let Slosh { zeta_breaking, breaking_steepness: onset, .. } = p.slosh;
    if zeta_breaking <= 0.0 {
        return None;
    }
    if onset <= 0.0 {
        return Some(format!(
            "slosh.zeta_breaking = {zeta_breaking} although slosh.breaking_steepness = 0: damping grows from the smallest wave \
             on. Measured waves break above a steepness of 0.60 to 0.66; for growth without a threshold use \
             slosh.zeta_amplitude"
        ));
    }
    let largest = p.slosh.model.largest_amplitude();
    let first = calculated.pendulums(p).next()?;
    let steepness = p.slosh.breaking(0, first.wave, p.tank.d / 2.0).steepness * largest;
    (onset >= steepness).then(|| {
        format!(
            "slosh.zeta_breaking has almost no effect on mode 1: the steepness of its wave reaches {steepness:.3} at an amplitude of \
             {largest:.3}, the end of the model's range, and slosh.breaking_steepness is {onset}"
        )
    })
}

/// Bond number of the tank below which surface tension adds more than 3 % to the squared frequency of mode 1.
const LOW_BOND: f64 = 100.0;

impl Calculated {
    /// Calculates the modal parameters at the specific force `g` along the tank's axis, m/s2.
    ///
    /// The correlation gives the damping ratio of the first mode. The damping ratio of each higher mode, divided by the
    /// damping ratio of the laminar layer at the wall, is the same as for the first mode (`formulas::damping`). Without
    /// restoring force, that is, without g and surface tension, there is no frequency, and the damping ratio, which then has
    /// no meaning, is 0.
    pub fn new(p: &Parameters, g: f64) -> Calculated {
        let Parameters { tank, fluid, slosh, .. } = p;
        let radius = tank.d / 2.0;
        let m_liq = match slosh.source {
            SloshSource::Geometry => fluid.rho * core::f64::consts::PI * radius * radius * tank.h,
            SloshSource::Table => slosh.table.m_liq,
        };
        let liquid = similarity::Liquid { density: fluid.rho, tension: fluid.sigma };
        let bond = liquid.bond(g, radius);
        let mut all = Calculated { m_liq, m_0: m_liq, bond, ..Default::default() };
        let modes = if slosh.model == SloshModel::Frozen { 0 } else { slosh.modes.min(MODES) };
        let leaning = Leaning::from_parameters(p);
        for n in 0..modes {
            // An upright pendulum with the mode's frequency; an oblique pendulum has another length.
            let upright;
            match slosh.source {
                SloshSource::Geometry => {
                    let xi = XI[n];
                    let pendulum = cylinder::pendulum(n, tank.d, tank.h, m_liq);
                    (all.mass[n], all.length[n]) = (pendulum.mass, pendulum.length);
                    upright = leaning.map_or(pendulum.length, |leaning| {
                        let mode = leaning.mode(n, p, &pendulum);
                        (all.mass[n], all.length[n]) = (mode.mass, mode.length);
                        mode.upright
                    });
                    if slosh.capillarity {
                        all.centring[n] = fluid.sigma * xi * xi / (fluid.rho * radius * radius);
                    }
                }
                SloshSource::Table => {
                    all.mass[n] = slosh.table.mass[n];
                    all.length[n] = slosh.table.pendulum_length(n);
                    all.centring[n] = slosh.table.k[n] * all.length[n] / all.mass[n];
                    upright = all.length[n];
                }
            }
            let restoring = g + all.centring[n];
            all.frequency[n] = libm::sqrt(restoring / upright) / core::f64::consts::TAU;
            all.damping[n] = match (slosh.source, slosh.zeta_from_correlation) {
                _ if restoring <= 0.0 => 0.0,
                (SloshSource::Table, _) => slosh.table.zeta[n],
                (_, true) if n == 0 => damping::cylinder(radius, tank.h, fluid.nu, restoring),
                // The ratio of the damping to the mode's own laminar layer is that of the first mode.
                (_, true) => {
                    let mode = |n: usize| {
                        let g = g + all.centring[n];
                        damping::Mode::from_cylinder(n, radius, tank.h, g).laminar(1.0)
                    };
                    all.damping[0] * mode(n) / mode(0)
                }
                (_, false) => slosh.zeta,
            };
            all.m_0 -= all.mass[n];
        }
        // Along one direction m_0 is negative at most by the last digit of a table.
        if slosh.source == SloshSource::Table && !slosh.table.is_askew(modes) {
            all.m_0 = f64::max(all.m_0, 0.0);
        }
        all
    }

    /// Returns the pendulums of all modes in use. Their viscous drag coefficients belong to the specific force with which
    /// [`Calculated::new`] was called; `damping.rs` computes them at other values.
    pub fn pendulums(&self, p: &Parameters) -> impl Iterator<Item = Pendulum> {
        let radius = p.tank.d / 2.0;
        let (r, slosh, p) = (p.tank.r, p.slosh, *p);
        (0..MODES).take_while(|&n| self.mass[n] > 0.0).map(move |n| {
            let (m, l) = (self.mass[n], self.length[n]);
            let c = 2.0 * self.damping[n] * core::f64::consts::TAU * self.frequency[n] * m;
            let wave = match slosh.source {
                SloshSource::Table if slosh.table.wave[n] > 0.0 => slosh.table.wave[n],
                _ => 2.0 * radius / (XI[n] * XI[n] - 1.0),
            };
            let along = match slosh.source {
                SloshSource::Table => slosh.table.direction_components(n),
                SloshSource::Geometry => [0.0, 1.0],
            };
            let [r_x, r_t] = along.map(|component| r * component);
            let (s, kappa) = slosh.third_order(n, p.tank.h / radius);
            Pendulum {
                m,
                l,
                c,
                c_0: c,
                r,
                along,
                r_x,
                r_t,
                c_m: c / m,
                r_l: r_t / l,
                inv_l: 1.0 / l,
                wave,
                spring: kappa / (2.0 * l * l),
                s,
                l_s: l / s,
                l2_s: l * l / s,
                baffle: match n == 0 && p.baffle.width > 0.0 {
                    true => Baffle::new(&p, wave, l),
                    false => Baffle::default(),
                },
                growth: match slosh.damping_grows() {
                    true => Growth::new(slosh.zeta_amplitude, slosh.breaking(n, wave, radius), l),
                    false => Growth::default(),
                },
                ..Pendulum::default()
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_names_shallow_liquid_or_a_secondary_resonance() {
        assert!(third_order_warning(0.3).is_some_and(|text| text.contains("shallow")));
        assert!(third_order_warning(SHALLOW).is_none());
        for fill in [0.71, 0.831, 1.01, 1.19] {
            assert!(third_order_warning(fill).is_some_and(|text| text.contains("interpolated")));
        }
        assert!([5.0, 1.3, 0.6].iter().all(|fill| third_order_warning(*fill).is_none()));
    }
}

//! Modes of the liquid as equivalent pendulums or spring-masses, and the rigid liquid.
//!
//! With A_n = int_F phi_n r^2 dr, N_n = int_F phi_n^2 r dr and B_n = int_F psi phi_n r dr
//! (Green: lambda_n B_n = int_W phi_n (z n_r - r n_z) r ds - A_n), the momenta of the liquid in a
//! tank that moves by X along x and turns by alpha about y are
//!
//!   P = m_liq X' + m_liq z_cg alpha' + sum m_n s_n'
//!   L = m_liq z_cg X' + I_eff alpha' + sum m_n H_n s_n',
//!   s_n'' + g lambda_n s_n = -(X'' + H_n alpha'' - g alpha)
//!
//!   m_n = rho pi lambda_n A_n^2/N_n,   H_n = B_n/A_n,   I_eff = rho pi int psi dpsi/dn r ds
//!
//! Sources: Lomen, NASA CR-230; Dodge 2000, chapter 3; signs and I_eff derived anew. A mode with hardly any mass can
//! have any height H_n, whereas m_n H_n and m_n H_n^2 are always finite. The code therefore computes with A_n/sqrt(N_n)
//! and B_n/sqrt(N_n), and returns H_n only for modes with mass.

use serde::Serialize;

use crate::coefficients::FiniteAmplitude;
use crate::contour::{Problems, Volume, Wall};
use crate::potential_flow::{Discretisation, Solution};

const MASSLESS: f64 = 1e-9;

/// A slosh mode of a tank. Heights are in m from the zero of the contour.
///
/// - `n`: number; 1 has the lowest frequency.
/// - `lambda`: omega_n^2/g, 1/m.
/// - `lambda_r`, `lambda_l`: lambda times the outer radius of the free surface, or times the length
///   of a box.
/// - `l`: length of the pendulum, m, which is 1/lambda.
/// - `m`, `m_ratio`: slosh mass, kg, and slosh mass divided by the mass of the liquid.
/// - `height`, `hinge`: height of the slosh mass at rest, and of the hinge, which is `l` above it;
///   `None` if the slosh mass is below 1e-9 of the liquid's mass.
/// - `m_h`, `m_h2`: first moment m h, kg m, and second moment m h^2, kg·m², where h is the height
///   of the slosh mass above the liquid's centre of mass.
/// - `wave`, `wave_inner`: elevation of the surface at the outer and at the inner wall per angle of
///   the pendulum, m/rad.
/// - `wave_peak`, `r_peak`: largest elevation anywhere (first mode only), and its radius, m.
/// - `shape`: points (r, m/rad) of the surface from the axis or inner wall outwards.
/// - `beta`: int_W |grad phi|^2 dS / int |grad phi|^2 dV, 1/m, from which the damping by the
///   laminar layer at the wall follows.
/// - `surface_gradient`: int_F (phi_r^2 + phi^2/r^2) r dr/int_F phi^2 r dr over the free surface F,
///   1/m², from which the stiffness by capillarity follows.
/// - `vertical_wall`: true if the walls are vertical at the free surface.
/// - `upright`: true if the bottom is flat, too, so that capillarity does not change the shape of
///   the mode.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Mode {
    pub n: usize,
    pub lambda: f64,
    #[serde(rename = "lambda_R", skip_serializing_if = "Option::is_none")]
    pub lambda_r: Option<f64>,
    #[serde(rename = "lambda_L", skip_serializing_if = "Option::is_none")]
    pub lambda_l: Option<f64>,
    pub m: f64,
    pub m_ratio: f64,
    pub l: f64,
    #[serde(rename = "H")]
    pub height: Option<f64>,
    pub hinge: Option<f64>,
    pub wave: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wave_inner: Option<f64>,
    pub beta: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wave_peak: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub r_peak: Option<f64>,
    #[serde(skip)]
    pub m_h: f64,
    #[serde(skip)]
    pub m_h2: f64,
    #[serde(skip)]
    pub shape: Vec<[f64; 2]>,
    #[serde(skip)]
    pub surface_gradient: f64,
    #[serde(skip)]
    pub vertical_wall: bool,
    #[serde(skip)]
    pub upright: bool,
}

/// Fixed mass that remains when the first `modes` modes are modelled as pendulums.
///
/// - `m_0`: mass, kg.
/// - `height`: height, m from the zero of the contour; it can lie outside the tank.
/// - `inertia`: inertia across the axis about the centre of the fixed mass, kg·m².
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rest {
    pub modes: usize,
    pub m_0: f64,
    #[serde(rename = "H_0")]
    pub height: f64,
    #[serde(rename = "I_0")]
    pub inertia: f64,
}

/// Modal parameters of a box along one of its horizontal sides.
///
/// - `i_frozen_cg`, `i_eff_cg`: inertia about the centre of mass, kg·m², of rigid liquid, and of
///   liquid under a lid.
/// - `rest`: fixed mass with 1, 2, ... modes as pendulums.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Axis {
    #[serde(rename = "I_frozen_cg")]
    pub i_frozen_cg: f64,
    #[serde(rename = "I_eff_cg")]
    pub i_eff_cg: f64,
    pub modes: Vec<Mode>,
    pub rest: Vec<Rest>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Axes {
    pub x: Axis,
    pub y: Axis,
}

/// Damping of the modes of a tank with smooth walls.
///
/// - `nu`, `gravity`: kinematic viscosity, m²/s, and specific force along the axis, m/s².
/// - `shape`: shape of the wetted wall if its damping was measured, otherwise `other`.
/// - `correlation`: damping ratio of the first mode by the correlation of this shape, if it has
///   one.
/// - `parts`: for `other`, the shapes with measured damping that parts of the wall have.
/// - `taken`: sentence that explains the chosen damping ratio.
/// - `modes`, `modes_y`: in the order of the frequencies; for a box along its first and along its
///   second side.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Damping {
    pub nu: f64,
    pub gravity: f64,
    pub shape: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correlation: Option<f64>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<DampingPart>,
    pub taken: String,
    pub modes: Vec<ModeDamping>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub modes_y: Vec<ModeDamping>,
    pub warnings: Vec<String>,
}

/// A measured shape that a part of the wetted wall has: `share` is the part's fraction of the area,
/// and `factor` the damping by the shape's correlation divided by the damping by the laminar layer
/// at its wall.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DampingPart {
    pub shape: &'static str,
    pub share: f64,
    pub factor: f64,
}

/// Natural frequencies with surface tension.
///
/// - `sigma`: surface tension, N/m.
/// - `contact_angle`: angle between surface and wall, degrees; 90 is a flat surface.
/// - `gravity`: specific force along the axis, m/s².
/// - `bond`: Bond number rho g R^2/sigma with the outer radius R of the free surface; `None` for a
///   box or without surface tension.
/// - `modes`, `modes_y`: in the order of [`ModalData::modes`]; `modes_y` are the modes along a
///   box's second side.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Capillarity {
    pub sigma: f64,
    pub contact_angle: f64,
    pub gravity: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bond: Option<f64>,
    pub modes: Vec<CapillaryMode>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub modes_y: Vec<CapillaryMode>,
    pub warnings: Vec<String>,
}

/// A mode with surface tension: natural frequency `omega`, rad/s, and the stiffness `k` that
/// surface tension adds at the slosh mass, N/m, which is negative if a curved meniscus lowers the
/// frequency. Both are `None` if no formula is valid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CapillaryMode {
    pub omega: Option<f64>,
    pub k: Option<f64>,
}

/// Damping of one mode.
///
/// - `omega`: natural frequency with capillarity, rad/s.
/// - `zeta`, `interval`: damping ratio, and the interval in which it is expected.
/// - `laminar`: damping ratio by the laminar layer at the wall only.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ModeDamping {
    pub omega: f64,
    pub zeta: f64,
    pub interval: [f64; 2],
    pub laminar: f64,
}

/// Modal parameters of a tank at one fill. Heights are in m from the zero of the contour, except
/// `fill`, the height of the free surface above the lowest point.
///
/// - `kind`: `revolution` or `box`.
/// - `rho`: density, kg/m³.
/// - `r_surface`, `r_inner`: outer and inner radius of the free surface, m; the inner radius is 0
///   if the surface reaches the axis.
/// - `length_x`, `length_y`: sides of a box, m.
/// - `m_liq`, `z_cg`: mass of the liquid, kg, and height of its centre of mass.
/// - `z_lowest`: height of the tank's lowest point, which is 0 for shapes and boxes.
/// - `i_frozen_cg`, `i_frozen_axis`: inertia of the rigid liquid, kg·m², across the axis about its
///   centre of mass, and about the axis.
/// - `i_eff_cg`: inertia of the liquid under a lid across the axis about its centre of mass, kg·m².
/// - `i_eff_axis`: inertia of the liquid that rotates with the tank about the axis, kg·m²; 0 in a
///   tank of revolution.
/// - `modes`: in the order of their frequencies; for a box the modes along its first side.
/// - `axes`: the modes of both sides of a box.
/// - `rest`: fixed mass with 1, 2, ... modes as pendulums.
/// - `capillarity`, `damping`: present if the surface tension or the viscosity is known.
/// - `finite_amplitude`: see [`crate::finite_amplitude`].
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ModalData {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    pub kind: &'static str,
    pub rho: f64,
    pub fill: f64,
    #[serde(rename = "R_surface", skip_serializing_if = "Option::is_none")]
    pub r_surface: Option<f64>,
    #[serde(rename = "R_inner", skip_serializing_if = "Option::is_none")]
    pub r_inner: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_x: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_y: Option<f64>,
    pub m_liq: f64,
    pub z_cg: f64,
    pub z_lowest: f64,
    #[serde(rename = "I_frozen_cg")]
    pub i_frozen_cg: f64,
    #[serde(rename = "I_frozen_axis")]
    pub i_frozen_axis: f64,
    #[serde(rename = "I_eff_axis", skip_serializing_if = "Option::is_none")]
    pub i_eff_axis: Option<f64>,
    #[serde(rename = "I_eff_cg")]
    pub i_eff_cg: f64,
    pub modes: Vec<Mode>,
    pub rest: Vec<Rest>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axes: Option<Axes>,
    /// Estimated error of all values except `beta` and the inertia of the fixed mass. For lambda
    /// and the length of the pendulum it is relative to their values. For other values it is
    /// relative to a reference with the mass of the liquid m_liq and the outer radius R of the free
    /// surface: m_liq for masses, m_liq R for moments of mass, m_liq R^2 for inertias, and R for
    /// waves and the centre of mass.
    pub error: f64,
    /// Estimated error of the fixed mass's inertia I_0, relative to m_liq R^2. It can be larger
    /// than `error`: for example, the fixed mass of a shallow dish is far above the dish, and this
    /// lever arm multiplies the error of m_0.
    #[serde(rename = "error_I_0")]
    pub error_i_0: f64,
    pub error_beta: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub capillarity: Option<Capillarity>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping: Option<Damping>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub finite_amplitude: Option<FiniteAmplitude>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spin: Option<Spin>,
    #[serde(skip)]
    pub wall: Option<Wall>,
}

/// Steady rotation of the liquid of a tank about the tank's axis at a specific force along the
/// axis.
///
/// - `omega`: rate at which tank and liquid rotate about the axis, rad/s.
/// - `z_cg`: height of the centre of mass of the rotating liquid, m from the zero of the contour.
/// - `i_axis`: inertia of the rotating liquid about the tank's axis, kg·m².
/// - `i_cg`: inertia of the rotating liquid across the axis about its centre of mass, kg·m².
/// - `z_apex`: height of the surface on the axis, m from the zero of the contour; `None` if the
///   axis is dry.
/// - `z_wall`: height up to which the outer wall is wet, m from the zero of the contour.
/// - `r_dry`: radius inside which the floor is dry, m: the radius of the surface at the height of
///   the lowest point. It is 0 if the floor is wet.
/// - `flatness`: flatness of the tank under spin, Omega^2 R/g with the spin rate Omega and the
///   outer radius R of the surface at rest; `None` without gravity.
/// - `ratio`: spin ratio 2 Omega/omega_0 with the spin rate Omega and the frequency omega_0 of the
///   first mode without spin; `None` without a mode.
/// - `frequencies`: frequencies of the first mode of an upright cylinder in the rotating frame of
///   the tank, Hz: of the wave that runs against the spin, and of the wave that runs with the spin.
/// - `gyroscopic`: gyroscopic coefficient of the first mode of an upright cylinder, by which the
///   spin couples its two directions.
/// - `decay`: rate at which the laminar layer at the floor of an upright cylinder brings the liquid
///   to the rate of its tank, 1/s; `None` if the viscosity is not given.
/// - `in_range`: true if the parameters of the liquid at rest still describe the motion of the
///   rotating liquid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spin {
    pub omega: f64,
    pub gravity: f64,
    pub z_cg: f64,
    #[serde(rename = "I_axis")]
    pub i_axis: f64,
    #[serde(rename = "I_cg")]
    pub i_cg: f64,
    pub z_apex: Option<f64>,
    pub z_wall: f64,
    pub r_dry: f64,
    #[serde(rename = "Omega2_R_g")]
    pub flatness: Option<f64>,
    #[serde(rename = "2Omega_omega")]
    pub ratio: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frequencies: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gyroscopic: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decay: Option<f64>,
    pub in_range: bool,
    pub warnings: Vec<String>,
}

/// The free surface in a mode. `shape` has points (r, elevation per angle) from the axis or inner
/// wall outwards, `peak` the largest elevation per angle as (r, m/rad); for the other fields see
/// [`Mode`].
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Surface {
    pub(crate) shape: Vec<[f64; 2]>,
    pub(crate) peak: Option<[f64; 2]>,
    pub(crate) gradient: f64,
    pub(crate) vertical_wall: bool,
    pub(crate) upright: bool,
}

impl Mode {
    /// Creates slosh mode number `n`. `mass` has the modal mass m, its first moment m h and its
    /// second moment m h^2, where h is the height of the slosh mass above the liquid's centre of
    /// mass at `z_cg`. `m_liq` is the mass of the liquid, kg.
    pub(crate) fn new(
        n: usize,
        lambda: f64,
        mass: [f64; 3],
        z_cg: f64,
        m_liq: f64,
        surface: Surface,
        beta: f64,
    ) -> Mode {
        let [m, m_h, m_h2] = mass;
        let l = 1.0 / lambda;
        let height = (m >= MASSLESS * m_liq).then_some(z_cg + m_h / m);
        Mode {
            n,
            lambda,
            m,
            m_ratio: m / m_liq,
            l,
            height,
            hinge: height.map(|height| height + l),
            wave: surface.shape.last().map_or(0.0, |p| p[1]),
            beta,
            wave_peak: surface.peak.map(|p| p[1]),
            r_peak: surface.peak.map(|p| p[0]),
            m_h,
            m_h2,
            shape: surface.shape,
            surface_gradient: surface.gradient,
            vertical_wall: surface.vertical_wall,
            upright: surface.upright,
            ..Mode::default()
        }
    }
}

impl ModalData {
    /// Creates the modal data of a tank. `inertias` are, in this order, the inertia of the rigid
    /// liquid across the axis about the centre of mass, the inertia of the rigid liquid about the
    /// axis, and the effective inertia across the axis, all in kg·m².
    pub(crate) fn new(
        kind: &'static str,
        rho: f64,
        fill: f64,
        m_liq: f64,
        z_cg: f64,
        inertias: [f64; 3],
        modes: Vec<Mode>,
    ) -> ModalData {
        let [i_frozen_cg, i_frozen_axis, i_eff_cg] = inertias;
        ModalData {
            kind,
            rho,
            fill,
            m_liq,
            z_cg,
            i_frozen_cg,
            i_frozen_axis,
            i_eff_cg,
            rest: (1..=modes.len()).map(|k| rest(m_liq, z_cg, i_eff_cg, &modes[..k])).collect(),
            modes,
            ..ModalData::default()
        }
    }

    /// Sets the numerical errors of all results. The error of the fixed mass's inertia, which is
    /// I_0 = I_eff - (sum m_n h_n)^2/m_0 - sum m_n h_n^2, follows by error propagation: its
    /// derivatives with respect to I_eff, sum m_n h_n and m_0 are 1, 2 h_0 and h_0^2. Here h_n and
    /// h_0 are the heights of slosh mass n and of the fixed mass above the liquid's centre of mass.
    pub(crate) fn set_error(&mut self, error: f64, error_beta: f64) {
        (self.error, self.error_beta) = (error, error_beta);
        let axes = self.axes.iter().flat_map(|axes| axes.x.rest.iter().chain(&axes.y.rest));
        let height = |rest: &Rest| (rest.height - self.z_cg).abs();
        let highest = self.rest.iter().chain(axes).map(height).fold(0.0, f64::max);
        let r = match (self.r_surface, self.length_x, self.length_y) {
            (None, Some(x), Some(y)) => 0.5 * x.min(y),
            (r, ..) => r.unwrap_or(0.0),
        };
        // a full tank has neither a fixed mass nor a radius R of the free surface
        let lever = if highest > 0.0 { highest / r } else { 0.0 };
        self.error_i_0 = error * (1.0 + lever).powi(2);
    }

    /// Returns the natural frequencies of the modes, Hz, at the specific force `gravity`, m/s². For
    /// a box they are those along its first side, or along its second side if `along_y` is true. If
    /// the data have [`Capillarity`], its frequencies are returned instead; they are `None` if no
    /// formula is valid.
    pub fn frequencies(&self, gravity: f64, along_y: bool) -> Vec<Option<f64>> {
        let omegas: Vec<Option<f64>> = match (&self.capillarity, &self.axes) {
            (Some(found), _) => {
                let modes = if along_y { &found.modes_y } else { &found.modes };
                modes.iter().map(|mode| mode.omega).collect()
            }
            (None, axes) => {
                let of_y = axes.as_ref().filter(|_| along_y).map(|axes| &axes.y.modes);
                let modes = of_y.unwrap_or(&self.modes).iter();
                modes.map(|mode| Some((gravity * mode.lambda).sqrt())).collect()
            }
        };
        omegas.iter().map(|omega| omega.map(|omega| omega / core::f64::consts::TAU)).collect()
    }

    pub fn origin(&self) -> String {
        if self.z_lowest.abs() < 1e-9 {
            return "z = 0 is the tank's lowest point, z up".to_string();
        }
        format!(
            "z = 0 is the contour's own zero, z up; the tank's lowest point is at z = {:.6} m",
            self.z_lowest
        )
    }

    pub fn rest(&self, modes: usize) -> Rest {
        rest(self.m_liq, self.z_cg, self.i_eff_cg, &self.modes[..modes])
    }
}

/// Returns the fixed mass, which remains after the slosh masses m_n of all `modes` at the heights
/// H_n are subtracted from the liquid. Its mass is m_0 = m_liq - sum m_n; its height H_0 follows
/// from m_0 H_0 = m_liq z_cg - sum m_n H_n; and with heights from z_cg its inertia is I_0 = I_eff -
/// m_0 H_0^2 - sum m_n H_n^2.
pub(crate) fn rest(m_liq: f64, z_cg: f64, i_eff_cg: f64, modes: &[Mode]) -> Rest {
    let m_0 = m_liq - modes.iter().map(|m| m.m).sum::<f64>();
    let h_0 = if m_0 == 0.0 { 0.0 } else { -modes.iter().map(|m| m.m_h).sum::<f64>() / m_0 };
    let m_h2: f64 = modes.iter().map(|m| m.m_h2).sum();
    Rest { modes: modes.len(), m_0, height: z_cg + h_0, inertia: i_eff_cg - m_0 * h_0 * h_0 - m_h2 }
}

struct Approximation {
    modes: Vec<Mode>,
    i_eff: f64,
}

/// Returns the numbers of Gauss points per panel of four discretisations, whose results are
/// compared to estimate the error. The first discretisation serves only for this estimate, and the
/// last is solved only if the first three are not accurate enough. If there are many `panels`, each
/// has fewer points, so that the matrices stay small.
fn orders(panels: usize) -> [usize; 4] {
    match panels {
        0..=24 => [12, 16, 20, 24],
        25..=40 => [8, 12, 16, 20],
        41..=70 => [6, 8, 12, 16],
        71..=120 => [4, 6, 8, 10],
        _ => [2, 4, 6, 8],
    }
}

const WANTED: f64 = 2e-7;
const ENOUGH: f64 = 1e-6;
const WORST: f64 = 1e-2;
const ROUNDING: f64 = 1e-10;
/// Estimated rounding error of `beta`. It is larger than the rounding errors of other quantities,
/// because the integrand of `beta` is not smooth at corners.
const ROUNDING_BETA: f64 = 1e-6;

struct Pair {
    better: Approximation,
    error: f64,
    error_beta: f64,
}

/// Returns the best approximation for the first `modes` modes and its estimated errors. Shorter
/// panels are used if the usual panels are not accurate enough. `rho` is the density of the liquid,
/// kg/m³.
fn pair(wall: &Wall, volume: &Volume, rho: f64, modes: usize) -> Option<Pair> {
    let usual = pair_on(wall, volume, rho, modes, false);
    if usual.as_ref().is_some_and(|pair| pair.error < ENOUGH) {
        return usual;
    }
    let fine = pair_on(wall, volume, rho, modes, true);
    [usual, fine].into_iter().flatten().min_by(|a, b| a.error.total_cmp(&b.error))
}

fn pair_on(wall: &Wall, volume: &Volume, rho: f64, modes: usize, fine: bool) -> Option<Pair> {
    let mesh = Discretisation::new(&wall.segments, modes.max(1), 16, fine);
    let [first, second, third, fourth] = orders(mesh.panel_count());
    let solve = |order| approximate(&mesh.with_order(order), wall, volume, rho, modes);
    let scale =
        if wall.r_outer > 0.0 { wall.r_outer } else { (volume.axial / volume.volume).sqrt() };
    let m_liq = rho * volume.volume;
    let differ = |a: &Approximation, b: &Approximation| difference(a, b, scale, m_liq);
    let (known, mut better) = (solve(second)?, solve(third)?);
    let (mut before, mut last) = (differ(&solve(first)?, &known), differ(&known, &better));
    if estimate(before.0, last.0) > WANTED {
        let finest = solve(fourth)?;
        (before, last) = (last, differ(&better, &finest));
        better = finest;
    }
    Some(Pair {
        better,
        error: estimate(before.0, last.0).max(ROUNDING),
        error_beta: estimate(before.1, last.1).max(ROUNDING_BETA),
    })
}

/// Estimates the error of a result from the last two differences between successive
/// discretisations, `before` and `last`. It is (`before` `last`^2)^(1/3), or `last` if this is
/// larger. `last` by itself is not a bound, because convergence is irregular and two
/// discretisations may agree by chance. The more suddenly the differences fall, the farther the
/// estimate stays above `last`.
fn estimate(before: f64, last: f64) -> f64 {
    last.max((before * last * last).cbrt())
}

/// Solves for the first `modes` modes of a liquid of the density `rho`, kg/m³, above `wall`. `fill`
/// is the height of the surface above the lowest point, m. For the wall of a full closed tank,
/// which has no free surface, the result has no modes, but the effective inertia.
///
/// # Errors
/// If the estimated error is above 1e-2.
pub(crate) fn solve(wall: Wall, rho: f64, fill: f64, modes: usize) -> Result<ModalData, Problems> {
    let volume = Volume::from_wall(&wall);
    let modes = if wall.r_outer > 0.0 { modes } else { 0 };
    let pair = pair(&wall, &volume, rho, modes);
    let Some(Pair { better, error, error_beta }) = pair.filter(|p| p.error < WORST) else {
        return Err(format!(
            "At a fill of {fill} m the modes could not be computed to better than {WORST}: the contour has details that are too fine for its size, or too many modes are asked for."
        )
        .into());
    };
    let inertias = [rho * volume.across, rho * volume.axial, better.i_eff];
    let m_liq = rho * volume.volume;
    let mut data =
        ModalData::new("revolution", rho, fill, m_liq, volume.z_cg, inertias, better.modes);
    data.r_surface = Some(wall.r_outer);
    data.r_inner = Some(wall.r_inner);
    data.set_error(error, error_beta);
    data.wall = Some(wall);
    Ok(data)
}

/// Returns twice the largest differences between two discretisations, relative to the references of
/// [`ModalData::error`]: for all values except `beta`, and for `beta`. The factor 2 is needed
/// because results at weak corners converge only with the fourth power of the order: with orders 12
/// and 16 the error of the finer discretisation is 0.46 of the difference, with orders 20 and 24 it
/// is 0.93.
fn difference(a: &Approximation, b: &Approximation, r: f64, m_liq: f64) -> (f64, f64) {
    let mut error = (a.i_eff - b.i_eff).abs() / (m_liq * r * r);
    let mut error_beta: f64 = 0.0;
    for (a, b) in a.modes.iter().zip(&b.modes) {
        let waves = (a.wave - b.wave)
            .abs()
            .max((a.wave_inner.unwrap_or(0.0) - b.wave_inner.unwrap_or(0.0)).abs());
        let all = [
            (a.lambda / b.lambda - 1.0).abs(),
            (a.m - b.m).abs() / m_liq,
            (a.m_h - b.m_h).abs() / (m_liq * r),
            (a.m_h2 - b.m_h2).abs() / (m_liq * r * r),
            waves / r,
        ];
        error = all.into_iter().fold(error, f64::max);
        error_beta = error_beta.max((a.beta / b.beta - 1.0).abs());
    }
    (2.0 * error, 2.0 * error_beta)
}

fn approximate(
    mesh: &Discretisation,
    wall: &Wall,
    volume: &Volume,
    rho: f64,
    modes: usize,
) -> Option<Approximation> {
    let pitch = mesh.pitch(volume.z_cg);
    let solution: Solution = mesh.solve(modes, &pitch)?;
    let (weights, radii) = (mesh.weights(), mesh.radii());
    let surface = mesh.surface_range();
    let sum = |range: core::ops::Range<usize>, f: &dyn Fn(usize) -> f64| -> f64 {
        range.map(|i| weights[i] * f(i)).sum()
    };
    let rho_pi = rho * core::f64::consts::PI;
    let i_eff = rho_pi * sum(0..radii.len(), &|i| solution.psi[i] * pitch[i]);
    let upright = |tangent: [f64; 2]| tangent[0].abs() < 1e-9;
    let last = wall.segments.len() - 1;
    let vertical = upright(wall.segments[last].tangent(1.0))
        && (wall.r_inner == 0.0 || upright(wall.segments[0].tangent(0.0)));
    let of_mode = |(k, (&lambda, phi)): (usize, (&f64, &Vec<f64>))| {
        let big_n = sum(surface.clone(), &|i| phi[i] * phi[i]);
        let a = sum(surface.clone(), &|i| phi[i] * radii[i]);
        let b = (sum(0..surface.start, &|i| phi[i] * pitch[i]) - a) / lambda;
        // elevation of the surface per angle of the pendulum
        let scale = a / big_n;
        let mut shape: Vec<[f64; 2]> =
            mesh.along_surface(phi, 24).iter().rev().map(|[r, u]| [*r, scale * u]).collect();
        if let Some(first) = shape.first_mut().filter(|_| wall.r_inner == 0.0) {
            *first = [0.0, 0.0];
        }
        let peak = (k == 0).then(|| mesh.surface_peak(phi)).map(|[r, u]| [r, scale * u]);
        let mass = [a * a, a * b, b * b].map(|x| rho_pi * lambda * x / big_n);
        let beta = mesh.gradient(phi, false) / (lambda * big_n);
        let surface = Surface {
            shape,
            peak,
            gradient: mesh.gradient(phi, true) / big_n,
            vertical_wall: vertical,
            upright: false,
        };
        let mut mode =
            Mode::new(k + 1, lambda, mass, volume.z_cg, rho * volume.volume, surface, beta);
        mode.lambda_r = Some(lambda * wall.r_outer);
        mode.wave_inner = mode.shape.first().filter(|_| wall.r_inner > 0.0).map(|p| p[1]);
        mode
    };
    let modes = solution.lambda.iter().zip(&solution.phi).enumerate().map(of_mode).collect();
    Some(Approximation { modes, i_eff })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The stated error is twice the difference of two discretisations, divided by a reference. For
    /// lambda and beta the reference is their own value, for masses the liquid's 5 kg, for moments
    /// 5 kg times R = 2 m, for waves R, and for inertias 5 kg R^2.
    #[test]
    fn each_stated_error_is_relative_to_its_reference_quantity() {
        let approximation = |change: &dyn Fn(&mut Mode)| {
            let surface = Surface { shape: vec![[2.0, 0.5]], ..Surface::default() };
            let mut mode = Mode::new(1, 4.0, [3.0, 0.75, 0.25], 0.0, 5.0, surface, 8.0);
            mode.wave_inner = Some(-0.25);
            change(&mut mode);
            Approximation { modes: vec![mode], i_eff: 1.5 }
        };
        let found = |a: &Approximation| {
            let b = approximation(&|_| {});
            (difference(a, &b, 2.0, 5.0), difference(&b, a, 2.0, 5.0))
        };
        assert_eq!(found(&approximation(&|_| {})), ((0.0, 0.0), (0.0, 0.0)));
        let step = 0.125;
        type Change<'a> = &'a dyn Fn(&mut Mode);
        let changes: [(Change, f64); 5] = [
            (&|mode| mode.m -= step, step / 5.0),
            (&|mode| mode.m_h -= step, step / 10.0),
            (&|mode| mode.m_h2 -= step, step / 20.0),
            (&|mode| mode.wave -= step, step / 2.0),
            (&|mode| mode.wave_inner = Some(-0.25 - step), step / 2.0),
        ];
        for (k, (change, expected)) in changes.into_iter().enumerate() {
            let error = 2.0 * expected;
            assert_eq!(found(&approximation(change)), ((error, 0.0), (error, 0.0)), "{k}");
        }
        let mut other = approximation(&|_| {});
        other.i_eff -= step;
        assert_eq!(found(&other), ((step / 10.0, 0.0), (step / 10.0, 0.0)));
        // relative differences of (3, 6) from (4, 8), and in the other order of (4, 8) from (3, 6)
        let ratios = found(&approximation(&|mode| (mode.lambda, mode.beta) = (3.0, 6.0)));
        assert_eq!(ratios.0, (0.5, 0.5));
        assert!((ratios.1.0 - 2.0 / 3.0).abs() < 1e-15 && (ratios.1.1 - 2.0 / 3.0).abs() < 1e-15);
    }

    /// The test uses a sphere that is nearly full, because its free surface is much smaller than
    /// the tank.
    #[test]
    fn stated_errors_of_modes_are_relative_to_the_radius_of_the_free_surface() {
        let segments = vec![crate::curve::Segment::arc([0.0, 1.0], 1.0, -90.0, 90.0)];
        let wall = crate::contour::Contour::new(segments).unwrap().cut(1.99).unwrap();
        let volume = Volume::from_wall(&wall);
        let found = pair_on(&wall, &volume, 2.0, 3, false).unwrap();
        let mesh = Discretisation::new(&wall.segments, 3, 16, false);
        let [a, b, c, d] = orders(mesh.panel_count())
            .map(|order| approximate(&mesh.with_order(order), &wall, &volume, 2.0, 3).unwrap());
        let radius = (1.0 - 0.99f64 * 0.99).sqrt();
        let over =
            |a: &Approximation, b: &Approximation| difference(a, b, radius, 2.0 * volume.volume).0;
        let [first, second, third] = [over(&a, &b), over(&b, &c), over(&c, &d)];
        // If the estimated error is too large, a discretisation of higher order is used.
        let mean = |before: f64, last: f64| last.max((before * last * last).cbrt());
        let first = mean(first, second);
        let expected = if first > WANTED { mean(second, third) } else { first };
        assert!(expected > 2.0 * ROUNDING, "{expected:e}");
        assert!((found.error / expected - 1.0).abs() < 1e-6, "{:e} {expected:e}", found.error);
    }

    /// Solves random contours of lines, splines and ellipses with corners, at random fills and for
    /// random numbers of modes. Returns the true errors divided by the stated errors. The true
    /// values come from panels of half the length, which have no point in common with the tested
    /// panels. Contours that the halved panels do not resolve are skipped.
    fn errors_over_stated_ones(seeds: core::ops::Range<u64>) -> Vec<f64> {
        seeds.filter_map(error_over_stated_one).collect()
    }

    fn error_over_stated_one(seed: u64) -> Option<f64> {
        use crate::curve::Segment;
        let mut state = seed;
        let mut between = |a: f64, b: f64| {
            // the random number generator splitmix64
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut x = state;
            x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            a + (b - a) * ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
        };
        let count = between(2.0, 7.0) as usize;
        let kind = between(0.0, 3.0) as usize;
        let mut points = vec![[0.0, 0.0]];
        let mut z = between(-0.2, 0.2);
        for _ in 0..count {
            points.push([between(0.15, 1.0), z]);
            z += between(0.05, 0.6);
        }
        let lines = |points: &[[f64; 2]]| -> Vec<Segment> {
            points.windows(2).map(|p| Segment::line(p[0], p[1])).collect()
        };
        let segments = match kind {
            0 => lines(&points),
            1 => crate::spline::spline(&points).ok()?,
            _ => {
                let (a, b) = (between(0.3, 1.0), between(0.1, 0.8));
                let dome = Segment::ellipse([0.0, b], a, b, -90.0, between(-40.0, 30.0));
                let mut above = vec![dome.end()];
                for _ in 0..count.min(3) {
                    let z = above[above.len() - 1][1];
                    above.push([between(0.15, 1.0), z + between(0.05, 0.6)]);
                }
                [vec![dome], lines(&above)].concat()
            }
        };
        let (share, modes) = (between(0.1, 0.95), 1 + between(0.0, 5.0) as usize);
        let contour = crate::contour::Contour::new(segments).ok()?;
        let wall = contour.cut(contour.fill_from_volume(share * contour.capacity())).ok()?;
        let volume = Volume::from_wall(&wall);
        let found = pair(&wall, &volume, 1.0, modes)?;
        let mesh = Discretisation::new(&wall.segments, modes, 16, false);
        // Above 20 points the rules for points close to the panel do not get more accurate.
        let top = (1000 / mesh.panel_count()).clamp(8, 20);
        let [rough, exact] =
            [top - 4, top].map(|order| approximate(&mesh.halve(order), &wall, &volume, 1.0, modes));
        let (rough, exact) = (rough?, exact?);
        // The stated error is twice the difference.
        let off = |a: &Approximation| {
            difference(a, &exact, wall.r_outer, volume.volume).0 / 2.0 / found.error
        };
        let ratio = off(&found.better);
        if std::env::var("HUBSLOSH_SHOW").is_ok() {
            println!("{seed}: {ratio:.3} of {:.1e}, reference {:.3}", found.error, off(&rough));
        }
        (off(&rough) < 1.0).then_some(ratio)
    }

    /// The true error must be below half of the stated error. It would not be if the stated error were only twice the last
    /// difference between two discretisations: the true error would be 0.74 of the stated error for the seed 7, and 0.99 for
    /// the seed 114.
    #[test]
    fn stated_errors_bound_the_errors_of_random_contours() {
        for seeds in [6..8, 114..115] {
            for ratio in errors_over_stated_ones(seeds.clone()) {
                assert!(ratio < 0.5, "{seeds:?}: {ratio}");
            }
        }
    }

    #[test]
    #[ignore = "some minutes: .ci/run --nightly"]
    fn stated_errors_bound_the_errors_of_a_hundred_random_contours() {
        let ratios = errors_over_stated_ones(0..115);
        let worst = ratios.iter().copied().fold(0.0, f64::max);
        println!("{} contours, the worst error is {worst:.2} of the stated one", ratios.len());
        assert!(ratios.len() > 80 && worst < 1.0, "{worst}");
    }
}

//! Tanks with modes in closed form: upright circular and annular cylinders, and boxes.
//!
//! Heights in the formulas are above the flat bottom. The modes follow by separation of variables, for the cylinder as in
//! Abramson, NASA SP-106, and Dodge (2000).

use core::f64::consts::PI;

use crate::contour::{Wall, bisect};
use crate::curve::Segment;
use crate::gauss::Gauss;
use crate::modal::{Axes, Axis, ModalData, Mode, Surface, rest};

const TERMS: usize = 400;
/// Relative error of the closed forms, which comes from rounding and from the terms that are left
/// out after the first [`TERMS`].
const ERROR: f64 = 1e-11;

/// Returns the remainder of the series sum tanh(k h/2)/k^5 after the wave number `last`. The
/// remaining wave numbers k are `step` apart, and `h` is the depth. The remaining sum is replaced
/// by the integral of its terms over k, divided by `step`, which is the midpoint rule in reverse.
/// The terms fall as k^-5 for large k h and as k^-4 for small k h. In shallow liquid the terms
/// after the first 400 add 4e-10 m R^2 to the effective inertia, with the mass m of the liquid and
/// the radius R.
fn series_remainder(last: f64, step: f64, h: f64) -> f64 {
    let end = 1.0 / (last + 0.5 * step);
    let rule = Gauss::new(20);
    let of_node = |(v, w): (&f64, &f64)| w * (v * end).powi(3) * (0.5 * h / (v * end)).tanh();
    rule.nodes.iter().zip(&rule.weights).map(of_node).sum::<f64>() * end / step
}

fn j1_slope(x: f64) -> f64 {
    libm::j0(x) - libm::j1(x) / x
}

fn y1_slope(x: f64) -> f64 {
    libm::y0(x) - libm::y1(x) / x
}

/// Returns the first `count` positive zeros xi_n of the derivative J1' of the Bessel function J1,
/// which are the wave numbers of a cylinder of radius 1. They are found by Newton's method with
/// J1'' = -J1'/x - (1 - 1/x^2) J1.
pub fn zeros_of_j1_slope(count: usize) -> Vec<f64> {
    let zero = |n: usize| {
        // McMahon: b - 7/(8 b), b = (n - 1/4) pi (DLMF 10.21.20)
        let b = (n as f64 - 0.25) * PI;
        let mut x = b - 7.0 / (8.0 * b);
        for _ in 0..5 {
            let slope = j1_slope(x);
            x += slope / (slope / x + (1.0 - 1.0 / (x * x)) * libm::j1(x));
        }
        x
    };
    (1..=count).map(zero).collect()
}

/// Returns slosh mode number `n` of a tank with vertical walls and a flat bottom, whose wave number
/// is `k`, 1/m, at the fill `h`, m. `m` is the slosh mass and `m_liq` the mass of the liquid, kg;
/// for `surface` and `beta` see [`Mode`]. The eigenvalue is lambda = k tanh(k h), and the slosh
/// mass is at the height h - (2/k) tanh(k h/2).
fn upright_mode(n: usize, k: f64, h: f64, m: f64, m_liq: f64, surface: Surface, beta: f64) -> Mode {
    let lambda = k * (k * h).tanh();
    let height = h - 2.0 / k * (0.5 * k * h).tanh();
    Mode::new(
        n,
        lambda,
        [m, m * (height - 0.5 * h), m * (height - 0.5 * h).powi(2)],
        0.5 * h,
        m_liq,
        surface,
        beta,
    )
}

/// Samples the elevation of a mode with the wave number `k`, 1/m, over the free surface between the
/// radii `inner` and `outer`, m. `elevation` is a function of the radius.
fn sample_surface([inner, outer]: [f64; 2], k: f64, elevation: impl Fn(f64) -> f64) -> Surface {
    let count = 200;
    let radius = |i: usize| inner + (outer - inner) * i as f64 / count as f64;
    Surface {
        shape: (0..=count).map(|i| [radius(i), elevation(radius(i))]).collect(),
        peak: None,
        gradient: k * k,
        vertical_wall: true,
        upright: true,
    }
}

/// Hyperbolic functions of k h, with the wave number k of a mode and the depth h, in forms that do
/// not overflow in deep liquid. For example, `floor` is 1/cosh(k h)^2.
struct Hyperbolic {
    floor: f64,
    half_tanh: f64,
    half_height: f64,
}

impl Hyperbolic {
    fn new(k: f64, h: f64) -> Hyperbolic {
        let sech = 1.0 / (k * h).cosh();
        let floor = sech * sech;
        Hyperbolic { floor, half_tanh: 0.5 * (k * h).tanh() / k, half_height: 0.5 * h * floor }
    }
}

/// Returns the modal data of an upright circular cylinder in closed form. `radius` and the fill `h`
/// are in m, `rho` is the density in kg/m³. With the zeros xi of J1', k = xi/R and beta the laminar
/// damping per length:
///
/// ```text
/// m_n/m_liq = 2 R tanh(kh)/(xi (xi^2 - 1) h), k = xi/R, wave 2 R/(xi^2 - 1)
/// I_eff/m_liq = h^2/12 - 3 R^2/4 + (16 R^3/h) sum tanh(k h/2)/(xi^3 (xi^2 - 1))
/// beta R = (xi^2 + 1)/(xi^2 - 1) + 2 xi (1 - h/R)/sinh(2 xi h/R) (Case and Parkinson 1957)
/// ```
pub fn cylinder(radius: f64, h: f64, rho: f64, modes: usize) -> ModalData {
    let (r, m_liq) = (radius, rho * PI * radius * radius * h);
    let xi = zeros_of_j1_slope(TERMS.max(modes));
    let of_mode = |n: usize| {
        let (xi, k) = (xi[n], xi[n] / r);
        let square = xi * xi - 1.0;
        let m = m_liq * 2.0 * r * (k * h).tanh() / (xi * square * h);
        let wave = 2.0 * r / square;
        let mut surface = sample_surface([0.0, r], k, |x| wave * libm::j1(k * x) / libm::j1(xi));
        if n == 0 {
            surface.peak = Some([r, wave]);
        }
        let shallow = 2.0 * xi * (1.0 - h / r) / (2.0 * k * h).sinh();
        let beta = ((xi * xi + 1.0) / square + shallow) / r;
        let mut mode = upright_mode(n + 1, k, h, m, m_liq, surface, beta);
        mode.lambda_r = Some(mode.lambda * r);
        mode
    };
    let sum: f64 = xi.iter().map(|x| (0.5 * x * h / r).tanh() / (x.powi(3) * (x * x - 1.0))).sum();
    let sum = sum + series_remainder(xi[xi.len() - 1], PI, h / r);
    let i_eff = m_liq * (h * h / 12.0 - 0.75 * r * r + 16.0 * r.powi(3) / h * sum);
    let wall = vec![Segment::line([0.0, 0.0], [r, 0.0]), Segment::line([r, 0.0], [r, h])];
    let inertias = [m_liq * (0.25 * r * r + h * h / 12.0), 0.5 * m_liq * r * r, i_eff];
    upright([0.0, r], h, rho, m_liq, inertias, (0..modes).map(of_mode).collect(), wall)
}

/// Returns the first `count` wave numbers k, 1/m, of an annulus with the radii `inner` and `outer`,
/// m. At a wave number the slope of C(r) = J1(k r) Y1'(k R) - Y1(k r) J1'(k R) is zero at the inner
/// wall, too.
pub fn annular_wave_numbers(inner: f64, outer: f64, count: usize) -> Vec<f64> {
    let slope = |k: f64| {
        j1_slope(k * inner) * y1_slope(k * outer) - y1_slope(k * inner) * j1_slope(k * outer)
    };
    // The zeros are at least 1/(mean radius) away from 0, and pi/(outer - inner) away from each other.
    let step = 0.1 / outer;
    let mut found = Vec::with_capacity(count);
    let mut k = 0.5 / outer;
    let mut before = slope(k);
    while found.len() < count {
        let after = slope(k + step);
        if (before > 0.0) != (after > 0.0) {
            found.push(bisect(k, k + step, |k| slope(k) > 0.0));
        }
        k += step;
        before = after;
    }
    found
}

/// Returns the modal data of an upright annular cylinder in closed form. The radii `inner` and
/// `outer` and the fill `h` are in m, `rho` is the density in kg/m³. With the radial elevation C(r)
/// of a mode, its wave number k and its eigenvalue lambda:
///
/// ```text
/// A = [r C]/k^2, N = [(r^2 - 1/k^2) C^2]/2 (from R_i to R), m_n = rho pi lambda A^2/N
/// I_eff = rho pi {(R^2 - R_i^2) h^3/12 - (3/4) h (R^4 - R_i^4) + sum (8 A^2/(N k)) tanh(k h/2)}
/// ```
pub fn annulus(inner: f64, outer: f64, h: f64, rho: f64, modes: usize) -> ModalData {
    let (ri, ro) = (inner, outer);
    let area = ro * ro - ri * ri;
    let m_liq = rho * PI * area * h;
    struct Radial {
        k: f64,
        a: f64,
        n: f64,
        at_inner: f64,
        at_outer: f64,
    }
    let radial = |k: f64| {
        let c = |r: f64| libm::j1(k * r) * y1_slope(k * ro) - libm::y1(k * r) * j1_slope(k * ro);
        let (at_inner, at_outer) = (c(ri), c(ro));
        let a = (ro * at_outer - ri * at_inner) / (k * k);
        let part = |r: f64, c: f64| 0.5 * (r * r - 1.0 / (k * k)) * c * c;
        Radial { k, a, n: part(ro, at_outer) - part(ri, at_inner), at_inner, at_outer }
    };
    let all: Vec<Radial> =
        annular_wave_numbers(ri, ro, 100.max(modes)).into_iter().map(radial).collect();
    let of_mode = |i: usize| {
        let Radial { k, a, n, at_inner, at_outer } = all[i];
        let m = rho * PI * k * (k * h).tanh() * a * a / n;
        let c = |r: f64| libm::j1(k * r) * y1_slope(k * ro) - libm::y1(k * r) * j1_slope(k * ro);
        let mut surface = sample_surface([ri, ro], k, |r| a * c(r) / n);
        if i == 0 {
            let peak =
                surface.shape.iter().copied().max_by(|x, y| x[1].abs().total_cmp(&y[1].abs()));
            surface.peak = peak;
        }
        // floor: k^2 N/cosh^2; wall at R: R C^2 int (k^2 sinh^2 + cosh^2/R^2) dz/cosh^2
        let t = Hyperbolic::new(k, h);
        let at_wall = |r: f64, c: f64| {
            r * c
                * c
                * (k * k * (t.half_tanh - t.half_height) + (t.half_tanh + t.half_height) / (r * r))
        };
        let layer = k * k * n * t.floor + at_wall(ri, at_inner) + at_wall(ro, at_outer);
        let mut mode =
            upright_mode(i + 1, k, h, m, m_liq, surface, layer / (k * (k * h).tanh() * n));
        mode.wave_inner = mode.shape.first().map(|p| p[1]);
        mode.lambda_r = Some(mode.lambda * ro);
        mode
    };
    // tanh(k h/2)/k^5 times a factor with a constant limit, separately for odd and even terms
    let weight = |x: &Radial| 8.0 * x.a * x.a / x.n * x.k.powi(4);
    let terms = all.iter().map(|x| weight(x) * (0.5 * x.k * h).tanh() / x.k.powi(5));
    let apart = 2.0 * PI / (ro - ri);
    let tails = all[all.len() - 2..].iter().map(|x| weight(x) * series_remainder(x.k, apart, h));
    let sum = terms.sum::<f64>() + tails.sum::<f64>();
    let rigid = area * h.powi(3) / 12.0 - 0.75 * h * (ro.powi(4) - ri.powi(4));
    let axial = 0.5 * m_liq * (ro * ro + ri * ri);
    let inertias = [0.5 * axial + m_liq * h * h / 12.0, axial, rho * PI * (rigid + sum)];
    let wall = vec![
        Segment::line([ri, h], [ri, 0.0]),
        Segment::line([ri, 0.0], [ro, 0.0]),
        Segment::line([ro, 0.0], [ro, h]),
    ];
    upright([ri, ro], h, rho, m_liq, inertias, (0..modes).map(of_mode).collect(), wall)
}

/// Returns the modal data of a body of revolution with vertical walls and a flat bottom. `inertias`
/// are, in this order, the inertia of the rigid liquid across the axis, the inertia of the rigid
/// liquid about the axis, and the effective inertia.
fn upright(
    [r_inner, r_outer]: [f64; 2],
    h: f64,
    rho: f64,
    m_liq: f64,
    inertias: [f64; 3],
    modes: Vec<Mode>,
    segments: Vec<Segment>,
) -> ModalData {
    let wall = Wall { segments, r_outer, r_inner, z_surface: h };
    let mut data = ModalData::new("revolution", rho, h, m_liq, 0.5 * h, inertias, modes);
    data.r_surface = Some(r_outer);
    data.r_inner = Some(r_inner);
    data.set_error(ERROR, ERROR);
    data.wall = Some(wall);
    data
}

/// Returns the modes of a box along its side of the length a = `length`, m, in closed form. The
/// other side has the length w = `width`, m, and `h` is the fill, m. For the n-th mode with the
/// wave number k and the laminar damping beta:
///
/// ```text
/// k = (2 n - 1) pi/a, m_n/m_liq = 8 tanh(kh)/(a^2 h k^3), wave 4/(a k^2)
/// I_eff/m_liq = h^2/12 - a^2/4 + (64/(a^2 h)) sum tanh(k h/2)/k^5
/// beta = 2/a + 2/w + 2 k (1 - 2 h/a)/sinh(2 k h) (Keulegan 1959)
/// ```
pub fn box_axis(length: f64, width: f64, h: f64, rho: f64, modes: usize) -> Axis {
    let a = length;
    let m_liq = rho * a * width * h;
    let wave_number = |n: usize| (2 * n + 1) as f64 * PI / a;
    let of_mode = |n: usize| {
        let k = wave_number(n);
        let m = m_liq * 8.0 * (k * h).tanh() / (a * a * h * k.powi(3));
        let wave = 4.0 / (a * k * k);
        let sign = if n.is_multiple_of(2) { 1.0 } else { -1.0 };
        let surface = sample_surface([0.0, 0.5 * a], k, |x| sign * wave * (k * x).sin());
        let shallow = 2.0 * k * (1.0 - 2.0 * h / a) / (2.0 * k * h).sinh();
        let beta = 2.0 / a + 2.0 / width + shallow;
        let mut mode = upright_mode(n + 1, k, h, m, m_liq, surface, beta);
        mode.lambda_l = Some(mode.lambda * a);
        mode
    };
    let modes: Vec<Mode> = (0..modes).map(of_mode).collect();
    let i_eff_cg = m_liq * effective(a, h);
    Axis {
        i_frozen_cg: m_liq * (a * a + h * h) / 12.0,
        i_eff_cg,
        rest: (1..=modes.len()).map(|k| rest(m_liq, 0.5 * h, i_eff_cg, &modes[..k])).collect(),
        modes,
    }
}

/// Returns the effective inertia per mass, m², of liquid that completely fills a rectangle of `a`
/// by `b`, m, which rotates in its plane about its centre. It is b^2/12 - a^2/4 + (64/(a^2 b)) sum
/// tanh(k b/2)/k^5 with k = (2 n - 1) pi/a, and symmetric in a and b.
fn effective(a: f64, b: f64) -> f64 {
    let sum: f64 = (0..TERMS)
        .map(|n| {
            let k = (2 * n + 1) as f64 * PI / a;
            (0.5 * k * b).tanh() / k.powi(5)
        })
        .sum();
    let sum = sum + series_remainder((2 * TERMS - 1) as f64 * PI / a, 2.0 * PI / a, b);
    b * b / 12.0 - 0.25 * a * a + 64.0 / (a * a * b) * sum
}

/// Returns the inertia about the vertical axis, kg·m², of the liquid that rotates with a box: the
/// parameter `tank.I_own` of the FMU HubSlosh. The sides `length_x` and `length_y` and the fill `h`
/// are in m. Twisting modes of the surface count as rigid.
pub fn box_yaw_inertia(length_x: f64, length_y: f64, h: f64, rho: f64) -> f64 {
    rho * length_x * length_y * h * effective(length_x, length_y)
}

pub fn rectangular(length_x: f64, length_y: f64, h: f64, rho: f64, modes: usize) -> ModalData {
    let x = box_axis(length_x, length_y, h, rho, modes);
    let y = box_axis(length_y, length_x, h, rho, modes);
    let m_liq = rho * length_x * length_y * h;
    let axial = m_liq * (length_x * length_x + length_y * length_y) / 12.0;
    let inertias = [x.i_frozen_cg, axial, x.i_eff_cg];
    let mut data = ModalData::new("box", rho, h, m_liq, 0.5 * h, inertias, x.modes.clone());
    data.length_x = Some(length_x);
    data.length_y = Some(length_y);
    data.i_eff_axis = Some(box_yaw_inertia(length_x, length_y, h, rho));
    data.axes = Some(Axes { x, y });
    data.set_error(ERROR, ERROR);
    data
}

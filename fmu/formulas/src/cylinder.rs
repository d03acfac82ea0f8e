//! Equivalent pendulums and rigid liquid of a liquid in an upright cylinder of diameter d, filled to the depth h:
//!
//! ```text
//! m_n = m_liq d tanh(2 xi_n h/d) / (xi_n (xi_n^2 - 1) h)        l_n = d/(2 xi_n tanh(2 xi_n h/d))
//! hinge above mid-depth: h/2 - (R/xi_n)(tanh(u/2) - 1/sinh u),  u = xi_n h/R,  R = d/2
//! I/m_liq = h^2/12 - 3 R^2/4 + (16 R^3/h) sum of tanh(xi_n h/(2 R))/(xi_n^3 (xi_n^2 - 1))
//! ```
//!
//! xi_n are the zeros of J1', and I is the transverse inertia of the liquid under a lid, about its centre. With all modes,
//! force and moment are those of linear potential flow in a cylinder that moves and pitches.
//!
//! Source: Abramson, NASA SP-106 (1966), chapters 2 and 6; Dodge (2000).

pub const MODES: usize = 10;

/// Zeros xi_n of J1', the derivative of the Bessel function J1, with 17 digits. The table has `MODES` zeros.
pub const XI: [f64; MODES] = [
    1.841_183_781_340_659_5,
    5.331_442_773_525_032_5,
    8.536_316_366_346_286,
    11.706_004_902_592_063,
    14.863_588_633_909_034,
    18.015_527_862_681_804,
    21.164_369_859_188_792,
    24.311_326_857_210_776,
    27.457_050_571_059_245,
    30.601_922_972_669_094,
];

/// One slosh mode as a pendulum with its hinge on the tank's axis: `mass`, kg, `length`, m, height `hinge` of the hinge
/// above the bottom, m, and `wave`, the elevation of the wave at the wall per slosh angle, 2 R/(xi_n^2 - 1), m/rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pendulum {
    pub mass: f64,
    pub length: f64,
    pub hinge: f64,
    pub wave: f64,
}

/// Returns the pendulum of mode `n`, which counts from 0 and is below [`MODES`], in a cylinder of diameter `d`, m, filled to
/// the height `h`, m, with `m_liq` kg of liquid.
pub fn pendulum(n: usize, d: f64, h: f64, m_liq: f64) -> Pendulum {
    let (xi, radius) = (XI[n], d / 2.0);
    let tanh = libm::tanh(2.0 * xi * h / d);
    // In deep liquid the bottom has no effect, and sinh overflows above 700.
    let u = f64::min(xi * h / radius, 700.0);
    Pendulum {
        mass: m_liq * d * tanh / (xi * (xi * xi - 1.0) * h),
        length: d / (2.0 * xi * tanh),
        hinge: h - radius / xi * (libm::tanh(u / 2.0) - 1.0 / libm::sinh(u)),
        wave: 2.0 * radius / (xi * xi - 1.0),
    }
}

/// Returns diameter and fill height, m, of the upright cylinder whose first mode has a pendulum with this
/// `length`, m, and `mass`, kg, with a liquid of `density`, kg/m3. The equations of the module's head give d^4 = 8
/// xi^2 (xi^2 - 1) l m/(rho pi) and tanh(2 xi h/d) = d/(2 xi l). In a deep tank the length hardly depends on the
/// fill, so that tanh is limited to 0.995.
pub fn tank_of_first_mode(length: f64, mass: f64, density: f64) -> (f64, f64) {
    let xi = XI[0];
    let d4 = 8.0 * xi * xi * (xi * xi - 1.0) * length * mass / (density * core::f64::consts::PI);
    let d = libm::sqrt(libm::sqrt(d4)).min(2.0 * xi * length * 0.995);
    let h = libm::atanh(d / (2.0 * xi * length)) * d / (2.0 * xi);
    (d, h)
}

/// Returns the transverse inertia of liquid that fills a cylinder of diameter `d` and height `h`, m, under a
/// lid, about its centre of mass and divided by its mass, m2.
pub fn capped_inertia(d: f64, h: f64) -> f64 {
    const ZEROS: usize = 400;
    let radius = d / 2.0;
    let term = |xi: f64| libm::tanh(xi * h / d) / (xi * xi * xi * (xi * xi - 1.0));
    let sum: f64 = (1..=ZEROS).rev().map(|n| term(zero(n))).sum();
    // The zeros are pi apart, from which the sum of xi^-5 over the further zeros follows.
    let end = zero(ZEROS) + core::f64::consts::FRAC_PI_2;
    let rest = 1.0 / (4.0 * core::f64::consts::PI * end * end * end * end);
    let rest = rest * libm::tanh(end * h / d);
    h * h / 12.0 - 0.75 * radius * radius + 16.0 * radius * radius * radius / h * (sum + rest)
}

/// Returns zero `n` of J1', which counts from 1. Zeros that are not in the table are computed by
/// McMahon's expansion (DLMF 10.21.20).
fn zero(n: usize) -> f64 {
    if n <= MODES { XI[n - 1] } else { mcmahon(n) }
}

fn mcmahon(n: usize) -> f64 {
    let b = (n as f64 - 0.25) * core::f64::consts::PI;
    let x = 8.0 * b;
    // McMahon's expansion for mu = 4.
    b - 7.0 / x - 4.0 * (7.0 * 16.0 + 82.0 * 4.0 - 9.0) / (3.0 * x * x * x)
}

/// Returns the mass, kg, the height of the centre of mass above the bottom, m, and the transverse inertia about the centre
/// of mass, kg m2, of the rigid liquid. The modes `kept` are pendulums, and the rigid liquid is chosen so that mass, centre
/// of mass and inertia of the whole liquid are exact while every pendulum hangs along the tank's axis.
pub fn rest(d: f64, h: f64, m_liq: f64, kept: &[Pendulum]) -> [f64; 3] {
    let z_liq = h / 2.0;
    let sum = |f: &dyn Fn(&Pendulum) -> f64| kept.iter().map(f).sum::<f64>();
    let bob = |p: &Pendulum| p.hinge - p.length;
    let m_0 = m_liq - sum(&|p| p.mass);
    let h_0 = (m_liq * z_liq - sum(&|p| p.mass * bob(p))) / m_0;
    let i_0 = m_liq * capped_inertia(d, h)
        - m_0 * (h_0 - z_liq) * (h_0 - z_liq)
        - sum(&|p| p.mass * (bob(p) - z_liq) * (bob(p) - z_liq));
    [m_0, h_0, i_0]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The reference values have six digits and are those of the tank in `fmu/craft/tests/six.json`: R = 0.45 m, filled 0.6 m
    /// deep with a liquid of 1000 kg/m3.
    #[test]
    fn the_cylinder_equals_the_reference_records() {
        let m_liq = 1000.0 * core::f64::consts::PI * 0.45 * 0.45 * 0.6;
        let kept = [pendulum(0, 0.9, 0.6, m_liq)];
        let [m_0, h_0, i_0] = rest(0.9, 0.6, m_liq, &kept);
        for (got, want) in [
            (kept[0].mass, 128.211),
            (kept[0].length, 0.248039),
            (kept[0].hinge, 0.3 + 0.136534),
            (m_0, 253.493),
            (h_0, 0.3 + 0.0563967),
            (i_0, 3.67522),
        ] {
            assert!((got / want - 1.0).abs() < 5e-6, "{got} {want}");
        }
    }

    /// The fourth root in the formula for the diameter has an error of some units in the last place. atanh near 1 amplifies
    /// this error by 1/(1 - tanh^2) = 20.
    #[test]
    fn tank_dimensions_are_recovered_from_the_first_mode() {
        for (d, h) in [(0.163, 0.1), (0.163, 0.05), (0.9, 0.3)] {
            let m_liq = 700.0 * core::f64::consts::PI * d * d / 4.0 * h;
            let Pendulum { mass, length, .. } = pendulum(0, d, h, m_liq);
            let (d_found, h_found) = tank_of_first_mode(length, mass, 700.0);
            assert!((d_found / d - 1.0).abs() < 1e-14 && (h_found / h - 1.0).abs() < 1e-13);
        }
    }

    #[test]
    fn wave_height_per_slosh_angle_of_mode_1_is_two_thirds_of_the_diameter() {
        assert!((pendulum(0, 0.163, 0.1, 1.0).wave / 0.068202 - 1.0).abs() < 1e-5);
    }

    #[test]
    fn the_constants_of_cylinder_modes_are_the_zeros_of_the_derivative_of_the_bessel_function_j1() {
        for xi in XI {
            let slope = |x: f64| libm::j0(x) - libm::j1(x) / x;
            assert!(slope(xi * (1.0 - 1e-15)) * slope(xi * (1.0 + 1e-15)) < 0.0, "{xi}");
        }
    }

    /// The expected values were computed by hand for R = 1 m and h = 1 m, with tanh(xi_2) = 0.99995313
    /// and tanh(xi_2/2) = 0.99037.
    #[test]
    fn the_second_mode_has_its_mass_length_and_hinge() {
        let second = pendulum(1, 2.0, 1.0, 3.0);
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-5, "{a} {b}");
        near(second.mass, 3.0 * 2.0 * 0.999_953_13 / (5.331_442_77 * 27.424_282));
        near(second.length, 1.0 / (5.331_442_77 * 0.999_953_13));
        near(second.hinge, 1.0 - (0.990_37 - 0.009_681) / 5.331_442_77);
        near(second.wave, 2.0 / 27.424_282);
    }

    #[test]
    fn modes_and_rigid_liquid_together_have_the_liquids_mass_and_centre() {
        let (d, h, m_liq) = (0.9, 0.6, 380.0);
        let kept: [Pendulum; 3] = core::array::from_fn(|n| pendulum(n, d, h, m_liq));
        let [m_0, h_0, _] = rest(d, h, m_liq, &kept);
        let mass: f64 = m_0 + kept.iter().map(|p| p.mass).sum::<f64>();
        let moment = m_0 * h_0 + kept.iter().map(|p| p.mass * (p.hinge - p.length)).sum::<f64>();
        assert!((mass / m_liq - 1.0).abs() < 1e-15);
        assert!((moment / (m_liq * h / 2.0) - 1.0).abs() < 1e-14);
    }

    /// In cylinders of 2 m diameter that are 20 m and 1e6 m deep, modal mass, length and the depth of the hinge below
    /// the surface are equal.
    #[test]
    fn the_pendulum_of_a_deep_cylinder_does_not_depend_on_the_depth() {
        let [deep, deeper] = [20.0, 1e6].map(|h| (h, pendulum(0, 2.0, h, h)));
        assert!((deep.1.mass / deeper.1.mass - 1.0).abs() < 1e-15);
        assert_eq!(deep.1.length, deeper.1.length);
        let below = [deep, deeper].map(|(h, p)| h - p.hinge);
        assert!((below[0] - 1.0 / XI[0]).abs() < 1e-14 && (below[1] - 1.0 / XI[0]).abs() < 1e-9);
    }

    /// The function returns diameter and depth of a cylinder from length and mass of the first mode, which do not depend on
    /// the depth in deep liquid.
    #[test]
    fn a_pendulum_of_a_very_deep_cylinder_is_assigned_a_depth_at_which_tanh_is_0_995() {
        let Pendulum { mass, length, .. } = pendulum(0, 1.0, 5.0, 5000.0);
        let (d, h) = tank_of_first_mode(length, mass, 1000.0);
        assert!((d / 0.995 - 1.0).abs() < 1e-14);
        assert!((libm::tanh(2.0 * XI[0] * h / d) - 0.995).abs() < 1e-15);
    }

    /// A thin film has no height, so that its inertia per mass is that of a disk, R^2/4. The integral that replaces the last
    /// zeros of the sum is then too small by 8/(12 pi end^3) with end = 400 pi + 1.6. In a long column the inertia per mass
    /// tends to h^2/12 - 3 R^2/4.
    #[test]
    fn the_inertia_of_a_capped_cylinder_has_the_limits_of_a_disk_and_of_a_long_column() {
        let film = capped_inertia(2.0, 1e-12);
        assert!((film - (0.25 - 1.068e-10)).abs() < 1e-12, "{film}");
        let twice = capped_inertia(4.0, 1e-12);
        assert!((twice / film - 4.0).abs() < 1e-12, "{twice}");
        let column = capped_inertia(2.0, 1e3);
        let sum = 16.0 / 1e3
            * (1..=10).map(|n| 1.0 / (XI[n - 1].powi(3) * (XI[n - 1].powi(2) - 1.0))).sum::<f64>();
        assert!((column - (1e6 / 12.0 - 0.75) - sum).abs() < 1e-6, "{column}");
        let column = capped_inertia(2.0, 1e4);
        assert!((column / (1e8 / 12.0) - 1.0).abs() < 1e-7, "{column}");
    }

    /// McMahon's expansion approximates the zeros of J1'. Its first omitted term is about 1e4/(8 b)^5, where b is the
    /// leading term of the expansion. At the tenth zero this is 1e-8.
    #[test]
    fn mcmahon_s_zeros_continue_the_table() {
        let tenth = mcmahon(10);
        assert!((tenth - XI[9]).abs() < 1e-7, "{tenth} {}", XI[9]);
        assert_eq!((zero(1), zero(10)), (XI[0], XI[9]));
        // The expected zero was computed with libm's J1'. The next term of the expansion is 1e-8 at the 11th zero.
        let eleventh = zero(11);
        assert!((libm::j0(eleventh) - libm::j1(eleventh) / eleventh).abs() < 1e-8, "{eleventh}");
    }
}

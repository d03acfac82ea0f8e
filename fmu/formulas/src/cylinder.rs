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

/// Zeros xi_n of J1', the derivative of the Bessel function J1. They are the dimensionless wave numbers of the slosh modes
/// that move liquid from side to side.
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

/// The pendulum that represents one slosh mode: its `mass`, kg; its `length`, m; the height `hinge` of its hinge above the
/// bottom, m; and `wave`, the elevation of the liquid at the wall per slosh angle, m/rad, which is 2 R/(xi_n^2 - 1) in a
/// cylinder of the radius R.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pendulum {
    pub mass: f64,
    pub length: f64,
    pub hinge: f64,
    pub wave: f64,
}

/// Returns the pendulum that represents slosh mode `n` of an upright cylinder, where the first mode has the number 0 and `n`
/// is below [`MODES`]. The cylinder has the diameter `d`, m, is filled to the height `h`, m, and contains `m_liq` kg of
/// liquid.
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

/// Returns the diameter and the fill height, m, of the upright cylinder whose first slosh mode has a pendulum of this
/// `length`, m, and `mass`, kg, if the liquid has the `density`, kg/m3.
///
/// With xi = 1.841, the first zero of J1', the diameter d and the height h follow from d^4 = 8 xi^2 (xi^2 - 1) length
/// mass/(density pi) and tanh(2 xi h/d) = d/(2 xi length). In a deep tank the length hardly depends on the fill, so that the
/// height cannot be found from it; tanh is therefore limited to 0.995.
pub fn tank_of_first_mode(length: f64, mass: f64, density: f64) -> (f64, f64) {
    let xi = XI[0];
    let d4 = 8.0 * xi * xi * (xi * xi - 1.0) * length * mass / (density * core::f64::consts::PI);
    let d = libm::sqrt(libm::sqrt(d4)).min(2.0 * xi * length * 0.995);
    let h = libm::atanh(d / (2.0 * xi * length)) * d / (2.0 * xi);
    (d, h)
}

/// Returns the moment of inertia, divided by the mass, m2, of liquid that completely fills a closed cylinder of the diameter
/// `d` and the height `h`, m, about an axis through its centre across the cylinder. It is smaller than the moment of inertia
/// of a rigid body, because a part of the liquid does not take part in the rotation.
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

/// Returns the zero number `n` (counted from 1) of J1'. Zeros beyond the table [`XI`] are computed by McMahon's asymptotic
/// expansion (DLMF 10.21.20).
fn zero(n: usize) -> f64 {
    if n <= MODES { XI[n - 1] } else { mcmahon(n) }
}

fn mcmahon(n: usize) -> f64 {
    let b = (n as f64 - 0.25) * core::f64::consts::PI;
    let x = 8.0 * b;
    // McMahon's expansion for mu = 4.
    b - 7.0 / x - 4.0 * (7.0 * 16.0 + 82.0 * 4.0 - 9.0) / (3.0 * x * x * x)
}

/// Returns the rigid liquid, that is, the part that moves with the tank like a solid body: its mass, kg, the height of its
/// centre of mass above the bottom, m, and its transverse moment of inertia about this centre, kg m2. The arguments are the
/// tank's diameter `d` and fill height `h`, m, the mass `m_liq` of the whole liquid, kg, and the pendulums `kept` that the
/// model uses; the modes without a pendulum belong to the rigid liquid. The rigid liquid is chosen so that mass, centre of
/// mass and inertia of the whole liquid are exact while all pendulums hang along the tank's axis.
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

    /// The expected values, with six digits, belong to the tank in `fmu/craft/tests/six.json`, which has a radius of 0.45 m
    /// and is filled 0.6 m deep with a liquid of 1000 kg/m3.
    #[test]
    fn the_pendulum_of_a_cylinder_equals_the_reference_values() {
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

    /// The tested function computes the diameter as a fourth root, which has a rounding error of some units in the last
    /// place. It computes the height from atanh of a number near 1, which amplifies this error by 1/(1 - tanh^2) = 20. The
    /// tolerance for the height is therefore larger.
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

    /// The expected values were computed by hand for a tank of 1 m radius that is filled 1 m deep.
    #[test]
    fn the_second_mode_of_a_cylinder_equals_values_computed_by_hand() {
        let second = pendulum(1, 2.0, 1.0, 3.0);
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-5, "{a} {b}");
        near(second.mass, 3.0 * 2.0 * 0.999_953_13 / (5.331_442_77 * 27.424_282));
        near(second.length, 1.0 / (5.331_442_77 * 0.999_953_13));
        near(second.hinge, 1.0 - (0.990_37 - 0.009_681) / 5.331_442_77);
        near(second.wave, 2.0 / 27.424_282);
    }

    #[test]
    fn modes_and_rigid_liquid_together_have_the_liquids_mass_and_centre_of_mass() {
        let (d, h, m_liq) = (0.9, 0.6, 380.0);
        let kept: [Pendulum; 3] = core::array::from_fn(|n| pendulum(n, d, h, m_liq));
        let [m_0, h_0, _] = rest(d, h, m_liq, &kept);
        let mass: f64 = m_0 + kept.iter().map(|p| p.mass).sum::<f64>();
        let moment = m_0 * h_0 + kept.iter().map(|p| p.mass * (p.hinge - p.length)).sum::<f64>();
        assert!((mass / m_liq - 1.0).abs() < 1e-15);
        assert!((moment / (m_liq * h / 2.0) - 1.0).abs() < 1e-14);
    }

    /// The modal mass, the pendulum length and the depth of the hinge below the surface are equal in cylinders of 2 m
    /// diameter that are 20 m and 1e6 m deep, because the wave does not reach the bottom.
    #[test]
    fn the_pendulum_of_a_deep_cylinder_does_not_depend_on_the_depth() {
        let [deep, deeper] = [20.0, 1e6].map(|h| (h, pendulum(0, 2.0, h, h)));
        assert!((deep.1.mass / deeper.1.mass - 1.0).abs() < 1e-15);
        assert_eq!(deep.1.length, deeper.1.length);
        let below = [deep, deeper].map(|(h, p)| h - p.hinge);
        assert!((below[0] - 1.0 / XI[0]).abs() < 1e-14 && (below[1] - 1.0 / XI[0]).abs() < 1e-9);
    }

    /// In deep liquid the pendulum does not depend on the depth, so that no depth can be computed from it. The function then
    /// returns the depth at which tanh(2 xi h/d) is 0.995.
    #[test]
    fn a_pendulum_of_a_very_deep_cylinder_is_assigned_a_depth_at_which_tanh_is_0_995() {
        let Pendulum { mass, length, .. } = pendulum(0, 1.0, 5.0, 5000.0);
        let (d, h) = tank_of_first_mode(length, mass, 1000.0);
        assert!((d / 0.995 - 1.0).abs() < 1e-14);
        assert!((libm::tanh(2.0 * XI[0] * h / d) - 0.995).abs() < 1e-15);
    }

    /// A film of liquid that is much thinner than wide has the inertia per mass of a disk, R^2/4, and a long column tends to
    /// h^2/12 - 3 R^2/4. The result for the film is too small by 1.07e-10 R^2, because the function sums only 400 terms
    /// exactly and uses a single value of tanh in all later terms.
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

    /// At the tenth zero, the last one of the table, McMahon's expansion has an error of 1e-8, the size of its first omitted
    /// term.
    #[test]
    fn mcmahon_s_expansion_continues_the_table_of_zeros() {
        let tenth = mcmahon(10);
        assert!((tenth - XI[9]).abs() < 1e-7, "{tenth} {}", XI[9]);
        assert_eq!((zero(1), zero(10)), (XI[0], XI[9]));
        // The expected zero was computed with libm's J1'. The next term of the expansion is 1e-8 at the 11th zero.
        let eleventh = zero(11);
        assert!((libm::j0(eleventh) - libm::j1(eleventh) / eleventh).abs() < 1e-8, "{eleventh}");
    }
}

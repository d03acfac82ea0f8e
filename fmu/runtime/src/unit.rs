//! Units of variables, which the model description defines.

/// A unit of the model description: a product of powers of SI base units, with the units in which a host may display values.
#[derive(Debug)]
#[allow(missing_docs)]
pub struct Unit {
    pub name: &'static str,
    /// Exponents of kg, m, s and rad, for example [1, 1, -2, 0] for N; `None` if the exponents are not integers.
    pub base: Option<[i32; 4]>,
    /// Units in which a host may display values, each with its factor: value in this unit = factor times value in the SI
    /// unit.
    pub display_units: &'static [(&'static str, f64)],
}

const DEG: f64 = 180.0 / std::f64::consts::PI;
const RPM: f64 = 30.0 / std::f64::consts::PI;

const fn unit(
    name: &'static str,
    [kg, m, s, rad]: [i32; 4],
    display_units: &'static [(&'static str, f64)],
) -> Unit {
    Unit { name, base: Some([kg, m, s, rad]), display_units }
}

/// All units that the FMUs of this project use. The model description of an FMU contains only the units of its own
/// variables.
#[rustfmt::skip]
pub static UNITS: &[Unit] = &[
    //                kg  m   s  rad
    unit("1",       [ 0,  0,  0, 0], &[]),
    unit("kg",      [ 1,  0,  0, 0], &[]),
    unit("kg/s",    [ 1,  0, -1, 0], &[]),
    unit("m",       [ 0,  1,  0, 0], &[("mm", 1e3)]),
    unit("1/m",     [ 0, -1,  0, 0], &[]),
    unit("m/rad",   [ 0,  1,  0, -1], &[("mm/rad", 1e3)]),
    unit("s",       [ 0,  0,  1, 0], &[]),
    unit("Hz",      [ 0,  0, -1, 0], &[]),
    unit("1/s",     [ 0,  0, -1, 0], &[]),
    unit("1/s2",    [ 0,  0, -2, 0], &[]),
    unit("1/rad",   [ 0,  0,  0, -1], &[]),
    unit("rad",     [ 0,  0,  0, 1], &[("deg", DEG)]),
    unit("rad/s",   [ 0,  0, -1, 1], &[("deg/s", DEG), ("deg/h", 3600.0 * DEG), ("rpm", RPM)]),
    unit("rad/s2",  [ 0,  0, -2, 1], &[("deg/s2", DEG)]),
    unit("m/s",     [ 0,  1, -1, 0], &[]),
    unit("kg.m",    [ 1,  1,  0, 0], &[]),
    unit("kg.m/s",  [ 1,  1, -1, 0], &[]),
    unit("m/s2",    [ 0,  1, -2, 0], &[]),
    unit("m2/s",    [ 0,  2, -1, 0], &[("mm2/s", 1e6)]),
    unit("kg/m3",   [ 1, -3,  0, 0], &[]),
    unit("N/m",     [ 1,  0, -2, 0], &[("mN/m", 1e3)]),
    unit("N",       [ 1,  1, -2, 0], &[]),
    unit("N.s",     [ 1,  1, -1, 0], &[]),
    unit("N.m",     [ 1,  2, -2, 0], &[("mN.m", 1e3)]),
    unit("N.m.s",   [ 1,  2, -1, 0], &[]),
    unit("N.m/s",   [ 1,  2, -3, 0], &[]),
    // The radian in the unit of a torsional stiffness or damping is that of the angle or rate to which
    // the torque is proportional.
    unit("N.m/rad", [ 1,  2, -2, -1], &[]),
    unit("N.m.s/rad", [ 1, 2, -1, -1], &[]),
    unit("kg.m2",   [ 1,  2,  0, 0], &[]),
    unit("kg.m2/s", [ 1,  2, -1, 0], &[]),
    unit("J",       [ 1,  2, -2, 0], &[]),
    unit("W",       [ 1,  2, -3, 0], &[]),
    Unit { name: "kg^0.5", base: None, display_units: &[] },
    Unit { name: "kg^0.5.m", base: None, display_units: &[] },
    Unit { name: "kg^0.5.m/s", base: None, display_units: &[] },
    Unit { name: "kg^0.5.m/s2", base: None, display_units: &[] },
    Unit { name: "rad/s/sqrt(Hz)", base: None, display_units: &[] },
    Unit { name: "rad/s/sqrt(s)", base: None, display_units: &[] },
];

/// Returns the unit with this name; `None` if it is not in [`UNITS`].
pub fn find(name: &str) -> Option<&'static Unit> {
    UNITS.iter().find(|unit| unit.name == name)
}

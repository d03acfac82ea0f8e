//! Variables of a tank for both FMUs with tanks: Spacecraft, which has several tanks, and SloshTank, which has one. The
//! table of each FMU includes them by [`tank_parameters!`] and [`tank_locals!`]. Meanings and units are in the descriptions.

#![no_std]

pub use craft::{BallState, DampingLaw, LimitedBy, MODES, POINTS, Tank, TankOutputs};
pub use runtime::variable::Dimension::{self, Fixed};
use runtime::variable::Item;
pub use runtime::variable::{Enumeration, Variable};

/// Access to the tanks of a model, whose indices count from 0. Counts of modes and points, and the integer twin of an
/// enumeration, are stored as the integers that the host has set.
#[allow(missing_docs)]
pub trait Tanks: runtime::Dynamics {
    fn tank(p: &Self::Parameters, i: usize) -> &Tank;
    fn tank_mut(p: &mut Self::Parameters, i: usize) -> &mut Tank;
    fn tank_now(o: &Self::Outputs, i: usize) -> &TankOutputs;
    fn modes(p: &mut Self::Parameters, i: usize) -> &mut i32;
    fn points(p: &mut Self::Parameters, i: usize) -> &mut i32;
    fn damping_law_kind(p: &mut Self::Parameters, i: usize) -> &mut i32;
}

pub static DAMPING_LAW: Enumeration = Enumeration {
    name: "DampingLaw",
    description: "Drag coefficient c of a mode as a function of its natural frequency omega",
    items: &[
        Item::new(
            "laminar",
            "c ~ sqrt(omega): a laminar layer at the wall, for tanks without baffles",
        ),
        Item::new("constant_ratio", "c ~ omega: constant damping ratio"),
        Item::new("constant", "c constant, independent of the specific force"),
    ],
};

pub static REGIME: Enumeration = Enumeration {
    name: "Regime",
    description: "Amplitude class of the wave at the wall; R is the free surface's radius",
    items: &[
        Item::new("linear", "Below 0.15 R: linear theory holds"),
        Item::new("transitional", "0.15 R to 0.25 R"),
        Item::new("nonlinear", "Above 0.25 R: heights and forces are only indications"),
    ],
};

static LIMITED_BY_ITEMS: [Item; LimitedBy::ITEMS.len()] = Item::list(LimitedBy::ITEMS);

pub static LIMITED_BY: Enumeration = Enumeration {
    name: "LimitedBy",
    description: "Reason why no pendulum represents the liquid",
    items: &LIMITED_BY_ITEMS,
};

/// Items of `ball.state`, the state of detached liquid. [`ball_state`] returns their numbers.
pub static BALL_STATE: Enumeration = Enumeration {
    name: "BallState",
    description: "State of a tank's liquid",
    items: &[
        Item::new("settled", "Liquid at the bottom: rigid liquid and pendulums"),
        Item::new(
            "flying",
            "Detached liquid in free flight through the tank, without force on the spacecraft",
        ),
        Item::new("sliding", "Detached liquid in contact with the wall"),
    ],
};

pub fn ball_state(state: BallState) -> i32 {
    match state {
        BallState::Settled => 1,
        BallState::Flying => 2,
        BallState::Sliding | BallState::Light | BallState::Held => 3,
    }
}

pub fn set_damping_law<M: Tanks>(p: &mut M::Parameters, tank: usize, number: i32) {
    if let Some(law) = usize::try_from(number - 1).ok().and_then(|i| DampingLaw::ALL.get(i)) {
        M::tank_mut(p, tank).damping_law = *law;
    }
}

/// Converts the number of an element of an array over tanks, modes and points of the fill table to the indices of tank, mode
/// and point, which count from 0.
pub const fn point(n: usize) -> (usize, usize, usize) {
    (n / (POINTS * MODES), n / POINTS % MODES, n % POINTS)
}

/// Converts the number of an element of an array over tanks, modes and axes to the indices of tank, mode and axis, which
/// count from 0.
pub const fn place(n: usize) -> (usize, usize, usize) {
    (n / (3 * MODES), n / 3 % MODES, n % 3)
}

/// Declares the local variables of a tank from `wave_height` to `spin_number`.
///
/// `$tank` is the name of a tank, and `$tanks` the dimension over the tanks if there are several. `$angles` are the variables
/// on which the slosh angles depend, and `$motion` those on which the ranges of validity depend.
#[macro_export]
#[rustfmt::skip]
macro_rules! tank_locals {
    ($model:ty, $tank:literal, [$($tanks:expr)?], $angles:expr, $motion:expr) => {{
        use $crate::{Dimension, LIMITED_BY, REGIME, Tanks as _};
        type M = $model;
        type V = $crate::Variable<M>;
        const PER_TANK: &[Dimension] = &[$($tanks)?];
        [
            V::local(concat!($tank, ".wave_height"), |o, n| M::tank_now(o, n).wave_height, "m",
                "Wave height at the tank wall above the surface at rest, all modes together: wave times slosh angle")
                .display_unit("mm").shape(PER_TANK).depends_on($angles),
            V::local_enumeration(concat!($tank, ".regime"), &REGIME, |o, n| M::tank_now(o, n).ranges.regime as i32,
                concat!("Amplitude class of the wave, by ", $tank, ".wave_height over the free surface's radius; nonlinear also while a bob is beyond 45 degrees or the liquid is detached"))
                .shape(PER_TANK).depends_on($angles),
            V::local_boolean(concat!($tank, ".in_range"), |o, n| M::tank_now(o, n).ranges.is_in_range(),
                concat!("True while the pendulums represent the liquid; ", $tank, ".limited_by has the reason if not. False while the liquid is detached"))
                .shape(PER_TANK).depends_on($motion),
            V::local_integer(concat!($tank, ".in_range_kind"), |o, n| i32::from(M::tank_now(o, n).ranges.is_in_range()),
                concat!($tank, ".in_range as an integer, for hosts that misread Booleans (OpenModelica up to 1.27): 0 false, 1 true"))
                .shape(PER_TANK).depends_on($motion),
            V::local_enumeration(concat!($tank, ".limited_by"), &LIMITED_BY, |o, n| M::tank_now(o, n).ranges.limited_by as i32,
                "Reason why the pendulums do not represent the liquid now; of several the first of contact, empty, spin, bond_number, secondary_resonance, breaking, third_order")
                .shape(PER_TANK).depends_on($motion),
            V::local_integer(concat!($tank, ".limited_by_kind"), |o, n| M::tank_now(o, n).ranges.limited_by as i32,
                concat!($tank, ".limited_by as an integer, for hosts that misread enumerations"))
                .shape(PER_TANK).depends_on($motion),
            V::local(concat!($tank, ".spin_ratio"), |o, n| M::tank_now(o, n).spin_ratio, "1",
                concat!("2 Omega/omega_0: spin of the liquid about the tank's axis (", $tank, ".spin[3]/spin_inertia; without spin_inertia the tank's own rate) over the natural frequency of mode 1 without spin. Above (1 + C)^(-1/2), 0.84 in deep and 0.74 in shallow liquid, out of range (limited_by = spin); 0 without modes"))
                .shape(PER_TANK).depends_on($motion),
            V::local(concat!($tank, ".spin_number"), |o, n| M::tank_now(o, n).spin_number, "1",
                "Omega^2 R/g: depth of the paraboloid of liquid that spins at Omega, with the radius R of the free surface and the specific force g along the tank. Above 0.3 out of range (limited_by = spin); 0 without modes")
                .shape(PER_TANK).depends_on($motion),
        ]
    }};
}

/// Declares the parameters of a tank.
///
/// `$tank` is the name of a tank, `$tanks` the dimension over the tanks if there are several, and `$mode` the dimension over
/// the modes. `$axes` is a text that names the axes in which the tank is mounted, and `$detached` a text that says when the
/// liquid may detach.
#[macro_export]
#[rustfmt::skip]
macro_rules! tank_parameters {
    ($model:ty, $tank:literal, [$($tanks:expr)?], $mode:expr, $axes:literal, $detached:literal) => {{
        use $crate::{DAMPING_LAW, Dimension, Fixed, MODES, POINTS, Tanks as _, place, point, set_damping_law};
        type M = $model;
        type V = $crate::Variable<M>;
        const PER_TANK: &[Dimension] = &[$($tanks)?];
        const TANK_PAIR: &[Dimension] = &[$($tanks,)? Fixed(2)];
        const TANK_VECTOR: &[Dimension] = &[$($tanks,)? Fixed(3)];
        const TANK_QUATERNION: &[Dimension] = &[$($tanks,)? Fixed(4)];
        const TABLE_OF_TANK: &[Dimension] = &[$($tanks,)? Fixed(POINTS)];
        const PER_MODE: &[Dimension] = &[$($tanks,)? $mode];
        const MODE_PAIR: &[Dimension] = &[$($tanks,)? $mode, Fixed(2)];
        const MODE_VECTOR: &[Dimension] = &[$($tanks,)? $mode, Fixed(3)];
        const TABLE_OF_MODE: &[Dimension] = &[$($tanks,)? $mode, Fixed(POINTS)];
        [
            V::parameter(concat!($tank, ".position"), |p, n| &mut M::tank_mut(p, n / 3).position[n % 3], "m",
                concat!("Position of the tank's origin from O, ", $axes))
                .shape(TANK_VECTOR).range(-1e4, 1e4),
            V::parameter(concat!($tank, ".q"), |p, n| &mut M::tank_mut(p, n / 4).q[n % 4], "1",
                concat!("Attitude quaternion of the tank, scalar first, tank to ", $axes, "; the FMU normalises it"))
                .shape(TANK_QUATERNION),
            V::parameter(concat!($tank, ".diameter"), |p, n| &mut M::tank_mut(p, n).diameter, "m", "Diameter of an upright cylindrical tank, whose origin is the centre of its bottom; 0: not a cylinder. Above 0, potential flow gives m_0, H_0, I_0 and each mode's mass, length, hinge and wave from diameter, depth and density")
                .display_unit("mm").shape(PER_TANK).range(0.0, 1e3),
            V::parameter(concat!($tank, ".depth"), |p, n| &mut M::tank_mut(p, n).depth, "m", "Fill height of the liquid in the cylinder, used if diameter is above 0")
                .display_unit("mm").shape(PER_TANK).range(1e-3, 1e3),
            V::parameter(concat!($tank, ".density"), |p, n| &mut M::tank_mut(p, n).density, "kg/m3", "Density of the liquid, used if diameter is above 0")
                .shape(PER_TANK).range(1e-3, 1e5),
            V::parameter(concat!($tank, ".m_0"), |p, n| &mut M::tank_mut(p, n).m_0, "kg", "Mass of the rigid liquid, which moves with the tank; below 0 only with planar modes (direction)")
                .shape(PER_TANK),
            V::parameter(concat!($tank, ".H_0"), |p, n| &mut M::tank_mut(p, n).h_0, "m", "Height of the rigid liquid's centre of mass on the tank's axis")
                .shape(PER_TANK),
            V::parameter(concat!($tank, ".I_0"), |p, n| &mut M::tank_mut(p, n).i_0, "kg.m2", "Moment of inertia of the rigid liquid about its centre of mass, across the tank's axis (with dI_y: about the tank's x axis); below 0 only with planar modes (direction)")
                .shape(PER_TANK),
            V::parameter(concat!($tank, ".I_z"), |p, n| &mut M::tank_mut(p, n).i_z, "kg.m2", "Moment of inertia of the rigid liquid about its centre of mass, along the tank's axis; below 0 only with planar modes (direction)")
                .shape(PER_TANK),
            V::parameter(concat!($tank, ".r_0"), |p, n| &mut M::tank_mut(p, n / 2).r_0[n % 2], "m", "Offset of the rigid liquid's centre of mass from the tank's axis, along the tank's x and y axes")
                .shape(TANK_PAIR),
            V::parameter(concat!($tank, ".dI_y"), |p, n| &mut M::tank_mut(p, n).di_y, "kg.m2", "Moment of inertia of the rigid liquid about the tank's y axis minus I_0")
                .shape(PER_TANK).range(-1e12, 1e12),
            V::parameter(concat!($tank, ".I_xy"), |p, n| &mut M::tank_mut(p, n).products[0], "kg.m2", "Product of inertia of the rigid liquid about its centre of mass, tank axes: minus the integral of x y dm")
                .shape(PER_TANK).range(-1e12, 1e12),
            V::parameter(concat!($tank, ".I_xz"), |p, n| &mut M::tank_mut(p, n).products[1], "kg.m2", "Product of inertia of the rigid liquid about its centre of mass, tank axes: minus the integral of x z dm")
                .shape(PER_TANK).range(-1e12, 1e12),
            V::parameter(concat!($tank, ".I_yz"), |p, n| &mut M::tank_mut(p, n).products[2], "kg.m2", "Product of inertia of the rigid liquid about its centre of mass, tank axes: minus the integral of y z dm")
                .shape(PER_TANK).range(-1e12, 1e12),
            V::integer(concat!($tank, ".modes"), |p, n| M::modes(p, n), "Number of slosh modes of the tank")
                .between(0, MODES as i32).shape(PER_TANK),
            V::parameter(concat!($tank, ".g_ref"), |p, n| &mut M::tank_mut(p, n).g_ref, "m/s2", "Specific force along the tank's axis at which zeta and frequency hold")
                .shape(PER_TANK).range(1e-9, 1e6),
            V::parameter(concat!($tank, ".mass"), |p, n| &mut M::tank_mut(p, n / MODES).mass[n % MODES], "kg", "Mass of a slosh mode's pendulum (modal mass)")
                .shape(PER_MODE).range(1e-9, 1e9),
            V::parameter(concat!($tank, ".length"), |p, n| &mut M::tank_mut(p, n / MODES).length[n % MODES], "m", "Length of a slosh mode's pendulum")
                .shape(PER_MODE).range(1e-6, 1e4),
            V::parameter(concat!($tank, ".frequency"), |p, n| &mut M::tank_mut(p, n / MODES).frequency[n % MODES], "Hz",
                "Natural frequency of a slosh mode with the tank held, at g_ref; above 0 it replaces length: (2 pi f)^2 = g_ref/l + k/m")
                .shape(PER_MODE).range(0.0, 1e6),
            V::parameter(concat!($tank, ".hinge"), |p, n| &mut M::tank_mut(p, n / MODES).hinge[n % MODES], "m", "Height of a slosh mode's hinge on the tank's axis")
                .shape(PER_MODE),
            V::parameter(concat!($tank, ".direction"), |p, n| &mut M::tank_mut(p, n / (2 * MODES)).direction[n / 2 % MODES][n % 2], "1",
                "Direction in which a slosh mode moves its mass, x and y in tank axes; the FMU normalises it. The mode is then planar: its bob swings in the plane of this direction and the tank's axis and moves with the tank across it. The default 0, 0 lets the mode swing in every direction")
                .shape(MODE_PAIR),
            V::parameter(concat!($tank, ".arm"), |p, n| &mut M::tank_mut(p, n / MODES).arm[n % MODES], "m",
                "Distance of a planar mode's plane from the tank's axis: lever arm about the axis of a momentum in the mode's direction")
                .shape(PER_MODE),
            V::parameter(concat!($tank, ".k"), |p, n| &mut M::tank_mut(p, n / MODES).k[n % MODES], "N/m", "Centring stiffness of a slosh mode at its bob (capillarity, diaphragm)")
                .shape(PER_MODE).range(0.0, 1e12),
            V::parameter(concat!($tank, ".zeta"), |p, n| &mut M::tank_mut(p, n / MODES).zeta[n % MODES], "1", concat!("Damping ratio of a slosh mode at g_ref; its drag coefficient there is 2 zeta m sqrt(g_ref/l + k/m). For other specific forces see ", $tank, ".damping_law"))
                .shape(PER_MODE).range(0.0, 10.0),
            V::choice(concat!($tank, ".damping_law"), &DAMPING_LAW, |p, n| M::tank(p, n).damping_law as i32, set_damping_law::<M>,
                "Damping law: dependence of a mode's drag coefficient on its natural frequency, hence on the specific force along the tank's axis")
                .shape(PER_TANK),
            V::integer(concat!($tank, ".damping_law_kind"), |p, n| M::damping_law_kind(p, n),
                concat!($tank, ".damping_law as an integer, for hosts that cannot set enumerations: 0 takes ", $tank, ".damping_law, other values are its item numbers. Setting ", $tank, ".damping_law to a different item is an error"))
                .between(0, DAMPING_LAW.items.len() as i32).shape(PER_TANK),
            V::parameter(concat!($tank, ".g_floor"), |p, n| &mut M::tank_mut(p, n).g_floor, "m/s2", "Specific force along the tank's axis below which the drag hardly depends on the specific force; 0: 1e-4 g_ref")
                .shape(PER_TANK).range(0.0, 1e6),
            V::parameter(concat!($tank, ".zeta_amplitude"), |p, n| &mut M::tank_mut(p, n / MODES).zeta_amplitude[n % MODES], "1/rad", "Growth of a mode's damping ratio with its amplitude A: zeta(A) = zeta + zeta_amplitude A; A combines angle and rate over natural frequency in both directions")
                .shape(PER_MODE).range(0.0, 10.0),
            V::parameter(concat!($tank, ".zeta_breaking"), |p, n| &mut M::tank_mut(p, n / MODES).zeta_breaking[n % MODES], "1", "Growth of a mode's damping ratio with the steepness k a of its wave, where waves break. It adds zeta_breaking max(0, k a - breaking_steepness) to zeta(A), with a rounded corner. 0: waves do not break. Measured values in water are 0.03 to 0.09")
                .shape(PER_MODE).range(0.0, 10.0),
            V::parameter(concat!($tank, ".breaking_steepness"), |p, n| &mut M::tank_mut(p, n / MODES).breaking_steepness[n % MODES], "1", "Steepness k a at which a mode's waves begin to break: wave number k times elevation a at the wall. The FMU takes the k a of an upright cylinder, in mode 1 1.54 times the slosh angle in rad. For a box set 1.21 times its steepness. Measured values in water are 0.60 to 0.66. Above 0 the mode is out of range beyond it (limited_by = breaking), and it has no other effect if zeta_breaking is 0")
                .shape(PER_MODE).range(0.0, 10.0),
            V::parameter(concat!($tank, ".nonlinear_inertia"), |p, n| &mut M::tank_mut(p, n / MODES).nonlinear_inertia[n % MODES], "1", "Third-order coefficient s of a slosh mode's inertia. The slosh angle A changes the frequency of a planar wave by the relative amount (3 kappa/8 - s/2) A^2/2. The default, a pendulum, is 1. A negative value, for shallow liquid, bounds the slosh angle")
                .shape(PER_MODE).range(-1e3, 1e3),
            V::parameter(concat!($tank, ".nonlinear_stiffness"), |p, n| &mut M::tank_mut(p, n / MODES).nonlinear_stiffness[n % MODES], "1", "Third-order coefficient kappa of a slosh mode's stiffness. The slosh angle A changes the frequency of a rotary wave by the relative amount (kappa/4 - t) A^2, with t = rotary_inertia. The default, a pendulum, is 1")
                .shape(PER_MODE).range(-1e3, 1e3),
            V::parameter(concat!($tank, ".nonlinear_inertia_2"), |p, n| &mut M::tank_mut(p, n / MODES).nonlinear_inertia_2[n % MODES], "1", "Coefficient s_2 of a slosh mode beyond the third order: kinetic energy m s_2 |q|^2 (q.q')^2/(2 l^4) with the displacement q and the length l. 0 for a pendulum; tanks with a fill table have none")
                .shape(PER_MODE).range(-1e5, 1e5),
            V::parameter(concat!($tank, ".nonlinear_stiffness_2"), |p, n| &mut M::tank_mut(p, n / MODES).nonlinear_stiffness_2[n % MODES], "1", "Coefficient kappa_2 of a slosh mode beyond the third order: the bob is l kappa_2 (|q|/l)^6/16 higher. 0 for a pendulum; tanks with a fill table have none")
                .shape(PER_MODE).range(-1e5, 1e5),
            V::parameter(concat!($tank, ".rotary_inertia"), |p, n| &mut M::tank_mut(p, n / MODES).rotary_inertia[n % MODES], "1", "Coefficient t of a slosh mode's rotary motion: kinetic energy m t (q x q')^2/(2 l^2), with q' relative to axes that do not turn about the tank's axis. The slosh angle A changes the frequency of a rotary wave by the relative amount (kappa/4 - t) A^2. 0 for a pendulum; tanks with a fill table have none")
                .shape(PER_MODE).range(-1e5, 1e5),
            V::parameter(concat!($tank, ".rotary_inertia_2"), |p, n| &mut M::tank_mut(p, n / MODES).rotary_inertia_2[n % MODES], "1", "Coefficient t_2 of a slosh mode's rotary motion: kinetic energy m t_2 |q|^2 (q x q')^2/(2 l^4). 0 for a pendulum; tanks with a fill table have none")
                .shape(PER_MODE).range(-1e5, 1e5),
            V::parameter(concat!($tank, ".gyroscopic"), |p, n| &mut M::tank_mut(p, n / MODES).gyroscopic[n % MODES], "1", concat!("Gyroscopic coefficient C of a slosh mode in liquid that spins at the rate W = ", $tank, ".spin[3]/spin_inertia. Seen from the tank a wave has the frequencies C W +- sqrt(C^2 W^2 + omega_0^2), against the spin and with it. C is 0.42 in deep and 0.84 in shallow liquid. 1 with gyroscopic_stiffness 0: a pendulum in space, which takes no part in the spin. Without effect if spin_inertia is 0; not for planar modes"))
                .shape(PER_MODE).range(-10.0, 10.0),
            V::parameter(concat!($tank, ".gyroscopic_stiffness"), |p, n| &mut M::tank_mut(p, n / MODES).gyroscopic_stiffness[n % MODES], "1", "Stiffness that the spin of the liquid adds to a slosh mode with gyroscopic other than 1: omega_0^2 + gyroscopic_stiffness W^2 replaces omega_0^2 in the frequencies")
                .shape(PER_MODE).range(-1e3, 1e3),
            V::parameter(concat!($tank, ".angle_limit"), |p, n| &mut M::tank_mut(p, n / MODES).angle_limit[n % MODES], "rad", "Slosh angle above which a mode is out of range (limited_by = third_order): the smaller of the angles at which its frequency errs by 0.3 % and a forced response by 3 %. 0: not known; mode 1 of a tank with diameter above 0 then has the limit of an upright cylinder")
                .display_unit("deg").shape(PER_MODE).range(0.0, 1.6),
            V::parameter(concat!($tank, ".swirl_limit"), |p, n| &mut M::tank_mut(p, n / MODES).swirl_limit[n % MODES], "rad", "Slosh angle above which rotary motion of a mode is out of range (limited_by = secondary_resonance), because a forced response errs by 3 % or its branch folds by a secondary resonance. 0: not known; mode 1 of a tank with diameter above 0 then has the limit of an upright cylinder")
                .display_unit("deg").shape(PER_MODE).range(0.0, 1.6),
            V::parameter(concat!($tank, ".g_bond"), |p, n| &mut M::tank_mut(p, n).g_bond, "m/s2", "Specific force along the tank's axis below which surface tension matters that the parameters do not include (limited_by = bond_number); 0: not known")
                .shape(PER_TANK).range(0.0, 1e6),
            V::parameter(concat!($tank, ".wave"), |p, n| &mut M::tank_mut(p, n / MODES).wave[n % MODES], "m", "Surface elevation at the wall per slosh angle of a slosh mode, used for wave_height only")
                .shape(PER_MODE).range(0.0, 1e9),
            V::parameter(concat!($tank, ".ball.travel"), |p, n| &mut M::tank_mut(p, n).ball.travel, "m",
                concat!("Distance along the tank's axis that the detached liquid's centre can move, from bottom to top; 0: the liquid never detaches. Above 0, all liquid becomes one body if thrust pulls it off the bottom or the bobs pass 45 degrees (mean by modal mass). The liquid flies, bounces off the wall and settles. ", $detached))
                .display_unit("mm").shape(PER_TANK).range(0.0, 1e3),
            V::parameter(concat!($tank, ".ball.radius"), |p, n| &mut M::tank_mut(p, n).ball.radius, "m",
                "Largest distance of the detached liquid's centre from the tank's axis; 0: computed so that the surface that this centre can reach has, at the bottom, the curvature of the path of the pendulums' common centre")
                .display_unit("mm").shape(PER_TANK).range(0.0, 1e3),
            V::parameter(concat!($tank, ".ball.restitution"), |p, n| &mut M::tank_mut(p, n).ball.restitution, "1",
                "Coefficient of restitution of the detached liquid's impacts on the wall: normal speed after the impact divided by the speed before it; a guess unless measured")
                .shape(PER_TANK).range(0.0, 1.0),
            V::parameter(concat!($tank, ".ball.contact_speed"), |p, n| &mut M::tank_mut(p, n).ball.contact_speed, "m/s",
                "Speed after an impact below which detached liquid that is pressed to the wall stays on it")
                .shape(PER_TANK).range(1e-9, 1e3),
            V::parameter(concat!($tank, ".ball.drag"), |p, n| &mut M::tank_mut(p, n).ball.drag, "1/s",
                "Rate at which the detached liquid's speed along the wall decays while it slides; a guess unless measured")
                .shape(PER_TANK).range(0.0, 1e3),
            V::parameter(concat!($tank, ".spin_inertia"), |p, n| &mut M::tank_mut(p, n).spin_inertia, "kg.m2",
                concat!("Inertia of the liquid that spins with the tank about its axis, for example that of the whole liquid as a solid; 0: the liquid has no spin. Above 0, the liquid has the states ", $tank, ".spin, and I_z should be 0. Allowed in a tank with fill.points = 0 and ball.travel = 0"))
                .shape(PER_TANK).range(0.0, 1e12),
            V::parameter(concat!($tank, ".spin_inertia_across"), |p, n| &mut M::tank_mut(p, n).spin_inertia_across, "kg.m2",
                "Inertia of the liquid's spin across the tank's axis, m (a^2 + c^2)/5 in a full spheroid with the semi-axes a, a, c; 0: spin_inertia")
                .shape(PER_TANK).range(0.0, 1e12),
            V::parameter(concat!($tank, ".spin_coupling"), |p, n| &mut M::tank_mut(p, n).spin_coupling, "1",
                "Share of the spin across the tank's axis that belongs to the angular momentum: 2 a c/(a^2 + c^2) in a full spheroid with the semi-axes a, a, c, 1 in a partly full tank")
                .shape(PER_TANK).range(0.0, 1.0),
            V::parameter(concat!($tank, ".spin_decay"), |p, n| &mut M::tank_mut(p, n / 2).spin_decay[n % 2], "1/s",
                "Rate at which wall friction decreases the rotation of the liquid relative to the tank, about its axis and across it: about sqrt(nu Omega)/R times 2.9 and 2.6 in a full sphere")
                .shape(TANK_PAIR).range(0.0, 1e3),
            V::parameter(concat!($tank, ".slip_0"), |p, n| &mut M::tank_mut(p, n / 3).slip_0[n % 3], "rad/s",
                "Angular velocity of the liquid relative to the tank at the start, tank axes; 0: the liquid rotates with the tank")
                .display_unit("deg/s").shape(TANK_VECTOR).range(-1e3, 1e3),
            V::integer(concat!($tank, ".fill.points"), |p, n| M::points(p, n), "Number of points in the tank's fill table; 0: the tank does not drain. From 2 on the tank can drain, and the table gives its modes and rigid liquid, interpolated monotonically with two continuous derivatives. The start values are the default tank at depths of 0.1 to 1.2 m")
                .between(0, POINTS as i32).shape(PER_TANK),
            V::parameter(concat!($tank, ".liquid_0"), |p, n| &mut M::tank_mut(p, n).liquid_0, "kg", "Mass of the whole liquid at the start, used if fill.points is above 0")
                .shape(PER_TANK).range(0.0, 1e9),
            V::parameter(concat!($tank, ".outlet"), |p, n| &mut M::tank_mut(p, n).outlet, "m", "Height of the outlet on the tank's axis, used if fill.points is above 0")
                .shape(PER_TANK).range(-1e4, 1e4),
            V::parameter(concat!($tank, ".fill.liquid"), |p, n| &mut M::tank_mut(p, n / POINTS).fill.liquid[n % POINTS], "kg", "Mass of the whole liquid at each point of the fill table, increasing")
                .shape(TABLE_OF_TANK).range(0.0, 1e9),
            V::parameter(concat!($tank, ".fill.H_0"), |p, n| &mut M::tank_mut(p, n / POINTS).fill.h_0[n % POINTS], "m", "H_0 at each point of the fill table")
                .shape(TABLE_OF_TANK),
            V::parameter(concat!($tank, ".fill.I_0"), |p, n| &mut M::tank_mut(p, n / POINTS).fill.i_0[n % POINTS], "kg.m2", "I_0 at each point of the fill table")
                .shape(TABLE_OF_TANK).range(0.0, 1e12),
            V::parameter(concat!($tank, ".fill.I_z"), |p, n| &mut M::tank_mut(p, n / POINTS).fill.i_z[n % POINTS], "kg.m2", "I_z at each point of the fill table")
                .shape(TABLE_OF_TANK).range(0.0, 1e12),
            V::parameter(concat!($tank, ".fill.mass"), |p, n| { let (i, m, k) = point(n); &mut M::tank_mut(p, i).fill.mass[m][k] }, "kg", "Mass of a slosh mode's pendulum (modal mass) at each point of the fill table")
                .shape(TABLE_OF_MODE).range(0.0, 1e9),
            V::parameter(concat!($tank, ".fill.length"), |p, n| { let (i, m, k) = point(n); &mut M::tank_mut(p, i).fill.length[m][k] }, "m", "Length of a slosh mode's pendulum at each point of the fill table")
                .shape(TABLE_OF_MODE).range(0.0, 1e4),
            V::parameter(concat!($tank, ".fill.hinge"), |p, n| { let (i, m, k) = point(n); &mut M::tank_mut(p, i).fill.hinge[m][k] }, "m", "Height of a slosh mode's hinge on the tank's axis at each point of the fill table")
                .shape(TABLE_OF_MODE),
            V::parameter(concat!($tank, ".fill.zeta"), |p, n| { let (i, m, k) = point(n); &mut M::tank_mut(p, i).fill.zeta[m][k] }, "1", "Damping ratio of a slosh mode at g_ref at each point of the fill table; 0 at all points of a mode: zeta at every fill")
                .shape(TABLE_OF_MODE).range(0.0, 10.0),
            V::parameter(concat!($tank, ".fill.nonlinear_inertia"), |p, n| { let (i, m, k) = point(n); &mut M::tank_mut(p, i).fill.nonlinear_inertia[m][k] }, "1", "Third-order coefficient s (nonlinear_inertia) of a slosh mode at each point of the fill table. If s and kappa of a mode are 1 at all points, nonlinear_inertia and nonlinear_stiffness hold at every fill")
                .shape(TABLE_OF_MODE).range(-1e3, 1e3),
            V::parameter(concat!($tank, ".fill.nonlinear_stiffness"), |p, n| { let (i, m, k) = point(n); &mut M::tank_mut(p, i).fill.nonlinear_stiffness[m][k] }, "1", "Third-order coefficient kappa (nonlinear_stiffness) of a slosh mode at each point of the fill table; see fill.nonlinear_inertia")
                .shape(TABLE_OF_MODE).range(-1e3, 1e3),
            V::parameter(concat!($tank, ".fill.angle_limit"), |p, n| { let (i, m, k) = point(n); &mut M::tank_mut(p, i).fill.angle_limit[m][k] }, "rad", "angle_limit of a slosh mode at each point of the fill table, interpolated linearly; 0 where it is not known, then angle_limit holds")
                .display_unit("deg").shape(TABLE_OF_MODE).range(0.0, 1.6),
            V::parameter(concat!($tank, ".fill.swirl_limit"), |p, n| { let (i, m, k) = point(n); &mut M::tank_mut(p, i).fill.swirl_limit[m][k] }, "rad", "swirl_limit of a slosh mode at each point of the fill table, interpolated linearly; 0 where it is not known, then swirl_limit holds")
                .display_unit("deg").shape(TABLE_OF_MODE).range(0.0, 1.6),
            V::parameter(concat!($tank, ".p_0"), |p, n| { let (i, m, k) = place(n); &mut M::tank_mut(p, i).p_0[m][k] }, "1",
                "Unit vector from hinge to bob at the start, tank axes; the FMU normalises it, for a planar mode within its plane")
                .shape(MODE_VECTOR),
            V::parameter(concat!($tank, ".p_dot_0"), |p, n| { let (i, m, k) = place(n); &mut M::tank_mut(p, i).p_dot_0[m][k] }, "1/s",
                "Rate of the unit vector from hinge to bob at the start, tank axes; the FMU keeps its tangential part")
                .shape(MODE_VECTOR),
        ]
    }};
}

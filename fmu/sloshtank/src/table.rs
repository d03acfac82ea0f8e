//! Every variable of SloshTank.fmu, once. Start values are those of
//! `craft::TankParameters::default()`; the host is at rest.

use craft::{BallState, Coupling, DampingLaw, LimitedBy, MODES, POINTS, TRIANGLE, TankState};
use runtime::table::{About, Scalar, Table, scalar_count, scalars};
use runtime::variable::Dimension::{Fixed, Sized};
use runtime::variable::{Dimension, Enumeration, Item, Variable};

use crate::model::{Model, Parameters};

pub static TABLE: Table<Model> = Table::new(
    About {
        model: "SloshTank",
        version: env!("CARGO_PKG_VERSION"),
        description: "One tank of sloshing liquid on somebody else's spacecraft: its wrench, and the \
                      added mass that breaks the algebraic loop",
        events: "",
        event_indicators: 2,
        saved_words: TankState::WORDS + 1,
    },
    VARIABLES,
    &SCALARS,
);

impl runtime::Model for Model {
    fn table() -> &'static Table<Self> {
        &TABLE
    }
}

static SCALARS: [Scalar<Model>; scalar_count(VARIABLES)] = scalars(VARIABLES);

// With coupling = split the added mass depends on neither a nor omega_dot, and the bias depends on
// them only through the drag, weakly. A host that evaluates both at its latest a therefore has no
// algebraic loop. With the other couplings the bias contains a and omega_dot of the previous step.
const WRENCH: &[&str] = &[
    "tank.p",
    "tank.p_dot",
    "tank.liquid",
    "tank.ball.position",
    "tank.ball.velocity",
    "tank.spin",
    "a",
    "omega",
    "omega_dot",
    "mass_flow",
];
const EVERYTHING: &[&str] =
    &["tank.", "a", "omega", "omega_dot", "mass_flow", "coupling", "coupling_kind"];
const TANK: &[&str] = &["tank."];
const SPINS: &[&str] = &["tank.", "omega"];
const PLACES: &[&str] = &["tank.p", "tank.liquid", "tank.ball.position"];
// Dependencies of tank.in_range.
const MOTION: &[&str] =
    &["tank.p", "tank.p_dot", "tank.liquid", "tank.spin", "a", "omega", "omega_dot"];

const MODE: Dimension = Sized("tank.modes", MODES);
const VECTOR: &[Dimension] = &[Fixed(3)];
const PER_MODE: &[Dimension] = &[MODE];
const MODE_VECTOR: &[Dimension] = &[MODE, Fixed(3)];
const MODE_PAIR: &[Dimension] = &[MODE, Fixed(2)];
const TABLE_OF_TANK: &[Dimension] = &[Fixed(POINTS)];
const TABLE_OF_MODE: &[Dimension] = &[MODE, Fixed(POINTS)];

/// Returns the index among the continuous states of element `n` of the shape [`MODE_VECTOR`].
fn bob(n: usize) -> usize {
    6 * (n / 3) + n % 3
}

const DISSIPATED: usize = 6 * MODES;
const LIQUID: usize = DISSIPATED + 1;
const BALL: usize = LIQUID + 1;
const SPIN: usize = BALL + 6;

fn ball_state(state: BallState) -> i32 {
    match state {
        BallState::Settled => 1,
        BallState::Flying => 2,
        BallState::Sliding | BallState::Light | BallState::Held => 3,
    }
}

fn set_coupling(p: &mut Parameters, _: usize, number: i32) {
    if let Some(coupling) = usize::try_from(number - 1).ok().and_then(|i| Coupling::ALL.get(i)) {
        p.coupling = *coupling;
    }
}

type V = Variable<Model>;

/// The variables. Outputs come first, in reading order.
#[rustfmt::skip]
static VARIABLES: &[Variable<Model>] = &[
    // Outputs
    V::output("force", |o, n| o.tank.force[n], "N",
        "Force of the whole liquid (sloshing and rigid) on the host, host axes")
        .shape(VECTOR).depends_on(WRENCH).initial_depends_on(EVERYTHING),
    V::output("torque", |o, n| o.tank.torque[n], "N.m",
        "Torque of the whole liquid (sloshing and rigid) on the host about O, host axes")
        .shape(VECTOR).depends_on(WRENCH).initial_depends_on(EVERYTHING),
    V::output("bias", |o, n| o.bias[n], "",
        "Bias wrench for the right-hand side of the host's equations, host axes: force (1 to 3, N) and torque about O (4 to 6, N.m). The wrench on the host is bias - added_mass [a; omega_dot]. With coupling = split, bias depends on a and omega_dot only through the drag, by about 1e-4 of the bobs' mass times a change of a, so one evaluation is enough. With tank.damping_law = constant it depends on neither. With coupling = rigid_body it suits a host with the constant added_mass in its mass, centre of mass and inertia, also in centrifugal and gyroscopic terms")
        .shape(&[Fixed(6)]).depends_on(WRENCH).initial_depends_on(EVERYTHING),
    V::output("added_mass", |o, n| o.added_mass[n], "",
        "Symmetric 6 x 6 added-mass matrix about O for the left-hand side of the host's equations, host axes, upper triangle by rows (kg, kg.m, kg.m2). With coupling = split it depends only on tank.p, tank.liquid and, for detached liquid, tank.ball.position. With coupling = lumped or rigid_body it is constant, that of rigid liquid and each bob at its hinge at the start. There the bob of a planar mode counts twice, with 2 m l^2 about the axes in its plane. A bob with nonlinear_inertia or nonlinear_stiffness counts twice, with 2 m r^2 about every axis (r: distance from the hinge)")
        .shape(&[Fixed(TRIANGLE)]).depends_on(PLACES).initial_depends_on(EVERYTHING),
    V::output("impulse", |o, n| o.impulse[n], "",
        "Sum of the impulses of detached liquid on the host since the start, host axes at the time of each: force (1 to 3, N.s) and torque about O (4 to 6, N.m.s). After each step or event the host adds M^-1 times the increase to its velocity and rate, M being its 6 x 6 mass matrix about O (host.mass to host.Jyz). Always 0 if tank.ball.travel is 0")
        .shape(&[Fixed(6)]).depends_on(&[]),

    // Inputs
    V::input("a", |i, n| [&mut i.tank.a.value[n], &mut i.tank.a.slope[n]], "m/s2",
        "Specific force at O, as an accelerometer there measures it, host axes. Held over a communication step unless an input derivative is set, which applies to one step")
        .shape(VECTOR).range(-1e9, 1e9),
    V::input("omega", |i, n| [&mut i.tank.omega[n], &mut i.omega_slope[n]], "rad/s",
        "Angular velocity of the host relative to the inertial frame, host axes, at the start of the step. Within the step it follows from omega_dot; unless it is set again, it continues from there")
        .display_unit("deg/s").shape(VECTOR).range(-1e9, 1e9).follows_inputs(),
    V::input("omega_dot", |i, n| [&mut i.tank.omega_dot.value[n], &mut i.tank.omega_dot.slope[n]], "rad/s2",
        "Angular acceleration of the host relative to the inertial frame, host axes. Held over a communication step unless an input derivative is set, which applies to one step")
        .display_unit("deg/s2").shape(VECTOR).range(-1e9, 1e9),
    V::input("mass_flow", |i, _| [&mut i.tank.mass_flow.value, &mut i.tank.mass_flow.slope], "kg/s",
        "Mass flow out of the tank, negative for inflow; it leaves with the tank's velocity at the outlet, and its thrust belongs to the host. The impulse of a jump on the host is not modelled: ramp the flow. Without effect with tank.fill.points = 0")
        .range(-1e9, 1e9),

    // Locals
    V::local("tank.wave_height", |o, _| o.tank.wave_height, "m",
        "Wave height at the tank wall above the surface at rest, all modes together: wave times slosh angle")
        .display_unit("mm").depends_on(&["tank.p"]),
    V::local_enumeration("tank.regime", &REGIME, |o, _| o.tank.ranges.regime as i32,
        "Amplitude class of the wave, by tank.wave_height over the free surface's radius; nonlinear also while a bob is beyond 45 degrees or the liquid is detached")
        .depends_on(&["tank.p"]),
    V::local_boolean("tank.in_range", |o, _| o.tank.ranges.is_in_range(),
        "True while the pendulums represent the liquid; tank.limited_by has the reason if not. False while the liquid is detached")
        .depends_on(MOTION),
    V::local_integer("tank.in_range_kind", |o, _| i32::from(o.tank.ranges.is_in_range()),
        "tank.in_range as an integer, for hosts that misread Booleans (OpenModelica up to 1.27): 0 false, 1 true")
        .depends_on(MOTION),
    V::local_enumeration("tank.limited_by", &LIMITED_BY, |o, _| o.tank.ranges.limited_by as i32,
        "Reason why the pendulums do not represent the liquid now; of several the first of contact, empty, spin, bond_number, secondary_resonance, breaking, third_order")
        .depends_on(MOTION),
    V::local_integer("tank.limited_by_kind", |o, _| o.tank.ranges.limited_by as i32,
        "tank.limited_by as an integer, for hosts that misread enumerations")
        .depends_on(MOTION),
    V::local("tank.spin_ratio", |o, _| o.tank.spin_ratio, "1",
        "2 Omega/omega_0: spin of the liquid about the tank's axis (tank.spin[3]/spin_inertia; without spin_inertia the tank's own rate) over the natural frequency of mode 1 without spin. Above (1 + C)^(-1/2), 0.84 in deep and 0.74 in shallow liquid, out of range (limited_by = spin); 0 without modes")
        .depends_on(MOTION),
    V::local("tank.spin_number", |o, _| o.tank.spin_number, "1",
        "Omega^2 R/g: depth of the paraboloid of liquid that spins at Omega, with the radius R of the free surface and the specific force g along the tank. Above 0.3 out of range (limited_by = spin); 0 without modes")
        .depends_on(MOTION),
    V::local_enumeration("tank.ball.state", &BALL_STATE, |o, _| ball_state(o.tank.ball_state),
        "State of the liquid with tank.ball.travel above 0. Unless it is settled, no pendulum represents the liquid (in_range), and slosh angles and wave_height are 0")
        .depends_on(WRENCH),
    V::local("mass", |o, _| o.mass, "kg",
        "Mass of the whole liquid").depends_on(&["tank.liquid"]),
    V::local("center_of_mass", |o, n| o.center_of_mass[n], "m",
        "Centre of mass of the whole liquid from O, host axes")
        .shape(VECTOR).depends_on(PLACES),
    V::local("inertia", |o, n| o.inertia[n / 3][n % 3], "kg.m2",
        "Inertia matrix of the whole liquid about its centre of mass, each bob a point mass at its current position, host axes")
        .shape(&[Fixed(3), Fixed(3)]).depends_on(PLACES),
    V::local("tank.angle_x", |o, n| o.tank.angle_x[n], "rad",
        "Slosh angle of a mode along the tank's x axis; its sine is the bob's displacement over the pendulum's length")
        .display_unit("deg").shape(PER_MODE).depends_on(&["tank.p"]),
    V::local("tank.angle_y", |o, n| o.tank.angle_y[n], "rad",
        "Slosh angle of a mode along the tank's y axis; its sine is the bob's displacement over the pendulum's length")
        .display_unit("deg").shape(PER_MODE).depends_on(&["tank.p"]),
    V::local("dissipated", |o, _| o.dissipated, "J",
        "Energy dissipated by the liquid since the start")
        .is_state(|_| DISSIPATED).depends_on(&["dissipated"]),
    V::state("tank.p", bob, "1",
        "Unit vector from hinge to bob of a slosh mode, tank axes; (0, 0, -1) at rest under thrust along the tank's axis")
        .shape(MODE_VECTOR).nominal(0.1).reinit().depends_on(&["tank.p[]"]).initial_depends_on(TANK),
    V::state("tank.p_dot", |n| bob(n) + 3, "1/s",
        "Rate of tank.p relative to the tank, tank axes")
        .shape(MODE_VECTOR).nominal(0.1).reinit().depends_on(&["tank.p_dot[]"]).initial_depends_on(TANK),

    V::state("tank.ball.position", |n| BALL + n, "m",
        "Centre of the detached liquid from the tank's origin, tank axes; while the liquid is settled, its centre at rest; 0 if tank.ball.travel is 0")
        .shape(VECTOR).reinit().depends_on(&["tank.ball.position[]"]).initial_depends_on(TANK),
    V::state("tank.ball.velocity", |n| BALL + 3 + n, "m/s",
        "Velocity of the detached liquid's centre relative to the tank, tank axes; 0 while the liquid is settled")
        .shape(VECTOR).nominal(0.01).reinit().depends_on(&["tank.ball.velocity[]"]).initial_depends_on(TANK),

    V::state("tank.spin", |n| SPIN + n, "kg.m2/s",
        "Angular momentum of the liquid's spin, tank axes; 0 if tank.spin_inertia is 0")
        .shape(VECTOR).nominal(0.1).depends_on(&["tank.spin[]"]).initial_depends_on(SPINS),

    V::state("tank.liquid", |_| LIQUID, "kg",
        "Mass of the whole liquid in the tank")
        .nominal(100.0).depends_on(&["tank.liquid"]).initial_depends_on(TANK),

    // The derivatives of the continuous states
    V::derivative("der(dissipated)", |_| DISSIPATED, "W", "Derivative of dissipated")
        .depends_on(WRENCH).initial_depends_on(EVERYTHING),
    V::derivative("der(tank.liquid)", |_| LIQUID, "kg/s", "Derivative of tank.liquid: minus mass_flow")
        .depends_on(&["mass_flow"]).initial_depends_on(&["mass_flow", "tank."]),
    V::derivative("der(tank.p)", bob, "1/s", "Derivative of tank.p: tank.p_dot")
        .shape(MODE_VECTOR).depends_on(&["tank.p", "tank.p_dot"]).initial_depends_on(TANK),
    V::derivative("der(tank.p_dot)", |n| bob(n) + 3, "1/s2", "Derivative of tank.p_dot")
        .shape(MODE_VECTOR).depends_on(WRENCH).initial_depends_on(EVERYTHING),
    V::derivative("der(tank.ball.position)", |n| BALL + n, "m/s", "Derivative of tank.ball.position: tank.ball.velocity")
        .shape(VECTOR).depends_on(&["tank.ball.position", "tank.ball.velocity"]).initial_depends_on(TANK),
    V::derivative("der(tank.ball.velocity)", |n| BALL + 3 + n, "m/s2", "Derivative of tank.ball.velocity")
        .shape(VECTOR).depends_on(WRENCH).initial_depends_on(EVERYTHING),
    V::derivative("der(tank.spin)", |n| SPIN + n, "N.m", "Derivative of tank.spin")
        .shape(VECTOR).depends_on(&["omega", "tank.p", "tank.p_dot", "tank.spin"]).initial_depends_on(SPINS),

    // The tank
    V::choice("coupling", &COUPLING, |p, _| p.coupling as i32, set_coupling,
        "Meaning of bias and added_mass"),
    V::integer("coupling_kind", |p, _| &mut p.coupling_kind,
        "coupling as an integer, for hosts that cannot set enumerations (ecos, libcosim): 0 takes coupling, other values are its item numbers. Setting coupling to a different item is an error")
        .between(0, COUPLING.items.len() as i32),
    V::parameter("tank.position", |p, n| &mut p.tank.position[n], "m",
        "Position of the tank's origin from O, host axes")
        .shape(VECTOR).range(-1e4, 1e4),
    V::parameter("tank.q", |p, n| &mut p.tank.q[n], "1",
        "Attitude quaternion of the tank, scalar first, tank to host axes; the FMU normalises it")
        .shape(&[Fixed(4)]),
    V::parameter("tank.diameter", |p, _| &mut p.tank.diameter, "m", "Diameter of an upright cylindrical tank, whose origin is the centre of its bottom; 0: not a cylinder. Above 0, potential flow gives m_0, H_0, I_0 and each mode's mass, length, hinge and wave from diameter, depth and density")
        .display_unit("mm").range(0.0, 1e3),
    V::parameter("tank.depth", |p, _| &mut p.tank.depth, "m", "Fill height of the liquid in the cylinder, used if diameter is above 0")
        .display_unit("mm").range(1e-3, 1e3),
    V::parameter("tank.density", |p, _| &mut p.tank.density, "kg/m3", "Density of the liquid, used if diameter is above 0")
        .range(1e-3, 1e5),
    V::parameter("tank.m_0", |p, _| &mut p.tank.m_0, "kg", "Mass of the rigid liquid, which moves with the tank; below 0 only with planar modes (direction)"),
    V::parameter("tank.H_0", |p, _| &mut p.tank.h_0, "m", "Height of the rigid liquid's centre of mass on the tank's axis"),
    V::parameter("tank.I_0", |p, _| &mut p.tank.i_0, "kg.m2", "Moment of inertia of the rigid liquid about its centre of mass, across the tank's axis (with dI_y: about the tank's x axis); below 0 only with planar modes (direction)"),
    V::parameter("tank.I_z", |p, _| &mut p.tank.i_z, "kg.m2", "Moment of inertia of the rigid liquid about its centre of mass, along the tank's axis; below 0 only with planar modes (direction)"),
    V::parameter("tank.r_0", |p, n| &mut p.tank.r_0[n], "m", "Offset of the rigid liquid's centre of mass from the tank's axis, along the tank's x and y axes")
        .shape(&[Fixed(2)]),
    V::parameter("tank.dI_y", |p, _| &mut p.tank.di_y, "kg.m2", "Moment of inertia of the rigid liquid about the tank's y axis minus I_0")
        .range(-1e12, 1e12),
    V::parameter("tank.I_xy", |p, _| &mut p.tank.products[0], "kg.m2", "Product of inertia of the rigid liquid about its centre of mass, tank axes: minus the integral of x y dm")
        .range(-1e12, 1e12),
    V::parameter("tank.I_xz", |p, _| &mut p.tank.products[1], "kg.m2", "Product of inertia of the rigid liquid about its centre of mass, tank axes: minus the integral of x z dm")
        .range(-1e12, 1e12),
    V::parameter("tank.I_yz", |p, _| &mut p.tank.products[2], "kg.m2", "Product of inertia of the rigid liquid about its centre of mass, tank axes: minus the integral of y z dm")
        .range(-1e12, 1e12),
    V::integer("tank.modes", |p, _| &mut p.modes, "Number of slosh modes of the tank")
        .between(0, MODES as i32),
    V::parameter("tank.g_ref", |p, _| &mut p.tank.g_ref, "m/s2", "Specific force along the tank's axis at which zeta and frequency hold")
        .range(1e-9, 1e6),
    V::parameter("tank.mass", |p, n| &mut p.tank.mass[n], "kg", "Mass of a slosh mode's pendulum (modal mass)")
        .shape(PER_MODE).range(1e-9, 1e9),
    V::parameter("tank.length", |p, n| &mut p.tank.length[n], "m", "Length of a slosh mode's pendulum")
        .shape(PER_MODE).range(1e-6, 1e4),
    V::parameter("tank.frequency", |p, n| &mut p.tank.frequency[n], "Hz",
        "Natural frequency of a slosh mode with the tank held, at g_ref; above 0 it replaces length: (2 pi f)^2 = g_ref/l + k/m")
        .shape(PER_MODE).range(0.0, 1e6),
    V::parameter("tank.hinge", |p, n| &mut p.tank.hinge[n], "m", "Height of a slosh mode's hinge on the tank's axis")
        .shape(PER_MODE),
    V::parameter("tank.direction", |p, n| &mut p.tank.direction[n / 2][n % 2], "1",
        "Direction in which a slosh mode moves its mass, x and y in tank axes; the FMU normalises it. The mode is then planar: its bob swings in the plane of this direction and the tank's axis and moves with the tank across it. The default 0, 0 lets the mode swing in every direction")
        .shape(MODE_PAIR),
    V::parameter("tank.arm", |p, n| &mut p.tank.arm[n], "m",
        "Distance of a planar mode's plane from the tank's axis: lever arm about the axis of a momentum in the mode's direction")
        .shape(PER_MODE),
    V::parameter("tank.k", |p, n| &mut p.tank.k[n], "N/m", "Centring stiffness of a slosh mode at its bob (capillarity, diaphragm)")
        .shape(PER_MODE).range(0.0, 1e12),
    V::parameter("tank.zeta", |p, n| &mut p.tank.zeta[n], "1", "Damping ratio of a slosh mode at g_ref; its drag coefficient there is 2 zeta m sqrt(g_ref/l + k/m). For other specific forces see tank.damping_law")
        .shape(PER_MODE).range(0.0, 10.0),
    V::choice("tank.damping_law", &DAMPING_LAW, |p, _| p.tank.damping_law as i32, set_damping_law,
        "Damping law: dependence of a mode's drag coefficient on its natural frequency, hence on the specific force along the tank's axis"),
    V::integer("tank.damping_law_kind", |p, _| &mut p.damping_law_kind,
        "tank.damping_law as an integer, for hosts that cannot set enumerations: 0 takes tank.damping_law, other values are its item numbers. Setting tank.damping_law to a different item is an error")
        .between(0, DAMPING_LAW.items.len() as i32),
    V::parameter("tank.g_floor", |p, _| &mut p.tank.g_floor, "m/s2", "Specific force along the tank's axis around which the drag stops following it; 0: 1e-4 g_ref")
        .range(0.0, 1e6),
    V::parameter("tank.zeta_amplitude", |p, n| &mut p.tank.zeta_amplitude[n], "1/rad", "Growth of a mode's damping ratio with its amplitude A: zeta(A) = zeta + zeta_amplitude A; A combines angle and rate over natural frequency in both directions")
        .shape(PER_MODE).range(0.0, 10.0),
    V::parameter("tank.zeta_breaking", |p, n| &mut p.tank.zeta_breaking[n], "1", "Growth of a mode's damping ratio with the steepness k a of its wave, where waves break. It adds zeta_breaking max(0, k a - breaking_steepness) to zeta(A), with a rounded corner. 0: waves do not break. Measured values in water are 0.03 to 0.09")
        .shape(PER_MODE).range(0.0, 10.0),
    V::parameter("tank.breaking_steepness", |p, n| &mut p.tank.breaking_steepness[n], "1", "Steepness k a at which a mode's waves begin to break: wave number k times elevation a at the wall. The FMU takes the k a of an upright cylinder, in mode 1 1.54 times the slosh angle in rad. For a box set 1.21 times its steepness. Measured values in water are 0.60 to 0.66. Above 0 the mode is out of range beyond it (limited_by = breaking), and it has no other effect if zeta_breaking is 0")
        .shape(PER_MODE).range(0.0, 10.0),
    V::parameter("tank.nonlinear_inertia", |p, n| &mut p.tank.nonlinear_inertia[n], "1", "Third-order coefficient s of a slosh mode's inertia. The slosh angle A changes the frequency of a planar wave by the share (3 kappa/8 - s/2) A^2/2. The default, a pendulum, is 1. A negative value, for shallow liquid, bounds the slosh angle")
        .shape(PER_MODE).range(-1e3, 1e3),
    V::parameter("tank.nonlinear_stiffness", |p, n| &mut p.tank.nonlinear_stiffness[n], "1", "Third-order coefficient kappa of a slosh mode's stiffness. The slosh angle A changes the frequency of a rotary wave by the share (kappa/4 - t) A^2, with t = rotary_inertia. The default, a pendulum, is 1")
        .shape(PER_MODE).range(-1e3, 1e3),
    V::parameter("tank.nonlinear_inertia_2", |p, n| &mut p.tank.nonlinear_inertia_2[n], "1", "Coefficient s_2 of a slosh mode beyond the third order: kinetic energy m s_2 |q|^2 (q.q')^2/(2 l^4) with the displacement q and the length l. 0 for a pendulum; tanks with a fill table have none")
        .shape(PER_MODE).range(-1e5, 1e5),
    V::parameter("tank.nonlinear_stiffness_2", |p, n| &mut p.tank.nonlinear_stiffness_2[n], "1", "Coefficient kappa_2 of a slosh mode beyond the third order: the bob is l kappa_2 (|q|/l)^6/16 higher. 0 for a pendulum; tanks with a fill table have none")
        .shape(PER_MODE).range(-1e5, 1e5),
    V::parameter("tank.rotary_inertia", |p, n| &mut p.tank.rotary_inertia[n], "1", "Coefficient t of a slosh mode's rotary motion: kinetic energy m t (q x q')^2/(2 l^2), with q' against axes that do not turn about the tank's axis. The slosh angle A changes the frequency of a rotary wave by the share (kappa/4 - t) A^2. 0 for a pendulum; tanks with a fill table have none")
        .shape(PER_MODE).range(-1e5, 1e5),
    V::parameter("tank.rotary_inertia_2", |p, n| &mut p.tank.rotary_inertia_2[n], "1", "Coefficient t_2 of a slosh mode's rotary motion: kinetic energy m t_2 |q|^2 (q x q')^2/(2 l^4). 0 for a pendulum; tanks with a fill table have none")
        .shape(PER_MODE).range(-1e5, 1e5),
    V::parameter("tank.gyroscopic", |p, n| &mut p.tank.gyroscopic[n], "1", "Gyroscopic coefficient C of a slosh mode in liquid that spins at the rate W = tank.spin[3]/spin_inertia. Seen from the tank a wave has the frequencies C W +- sqrt(C^2 W^2 + omega_0^2), against the spin and with it. C is 0.42 in deep and 0.84 in shallow liquid. 1 with gyroscopic_stiffness 0: a pendulum in space, which takes no part in the spin. Without effect if spin_inertia is 0; not for planar modes")
        .shape(PER_MODE).range(-10.0, 10.0),
    V::parameter("tank.gyroscopic_stiffness", |p, n| &mut p.tank.gyroscopic_stiffness[n], "1", "Stiffness that the spin of the liquid adds to a slosh mode with gyroscopic other than 1: its share of W^2 in omega_0^2 + gyroscopic_stiffness W^2, which replaces omega_0^2 in the frequencies")
        .shape(PER_MODE).range(-1e3, 1e3),
    V::parameter("tank.angle_limit", |p, n| &mut p.tank.angle_limit[n], "rad", "Slosh angle above which a mode is out of range (limited_by = third_order): the smaller of the angles at which its frequency errs by 0.3 % and a forced response by 3 %. 0: not known; mode 1 of a tank with diameter above 0 then has that of an upright cylinder")
        .display_unit("deg").shape(PER_MODE).range(0.0, 1.6),
    V::parameter("tank.swirl_limit", |p, n| &mut p.tank.swirl_limit[n], "rad", "Slosh angle above which rotary motion of a mode is out of range (limited_by = secondary_resonance), because its branch folds by a secondary resonance. 0: not known; mode 1 of a tank with diameter above 0 then has that of an upright cylinder")
        .display_unit("deg").shape(PER_MODE).range(0.0, 1.6),
    V::parameter("tank.g_bond", |p, _| &mut p.tank.g_bond, "m/s2", "Specific force along the tank's axis below which surface tension matters that the parameters do not include (limited_by = bond_number); 0: not known")
        .range(0.0, 1e6),
    V::parameter("tank.wave", |p, n| &mut p.tank.wave[n], "m", "Surface elevation at the wall per slosh angle of a slosh mode, used for wave_height only")
        .shape(PER_MODE).range(0.0, 1e9),
    V::parameter("tank.ball.travel", |p, _| &mut p.tank.ball.travel, "m",
        "Distance along the tank's axis that the detached liquid's centre can move, from bottom to top; 0: the liquid never detaches. Above 0, all liquid becomes one body if thrust pulls it off the bottom or the bobs pass 45 degrees (mean by modal mass). The liquid flies, bounces off the wall and settles. Requires coupling = split, host.mass and the host's inertia, a tank with modes that does not drain, and a host that applies impulse")
        .display_unit("mm").range(0.0, 1e3),
    V::parameter("tank.ball.radius", |p, _| &mut p.tank.ball.radius, "m",
        "Largest distance of the detached liquid's centre from the tank's axis; 0: the surface within reach has, at the bottom, the curvature of the path of the pendulums' common centre")
        .display_unit("mm").range(0.0, 1e3),
    V::parameter("tank.ball.restitution", |p, _| &mut p.tank.ball.restitution, "1",
        "Coefficient of restitution of the detached liquid's impacts on the wall: normal speed after over before; a guess unless measured")
        .range(0.0, 1.0),
    V::parameter("tank.ball.contact_speed", |p, _| &mut p.tank.ball.contact_speed, "m/s",
        "Speed after an impact below which detached liquid that is pressed to the wall stays on it")
        .range(1e-9, 1e3),
    V::parameter("tank.ball.drag", |p, _| &mut p.tank.ball.drag, "1/s",
        "Rate at which the detached liquid's speed along the wall decays while it slides; a guess unless measured")
        .range(0.0, 1e3),
    V::parameter("tank.spin_inertia", |p, _| &mut p.tank.spin_inertia, "kg.m2",
        "Inertia of the liquid that spins with the tank about its axis, for example that of the whole liquid as a solid; 0: the liquid has no spin. Above 0, the liquid has the states tank.spin, and I_z should be 0. Allowed in a tank with fill.points = 0 and ball.travel = 0")
        .range(0.0, 1e12),
    V::parameter("tank.spin_inertia_across", |p, _| &mut p.tank.spin_inertia_across, "kg.m2",
        "Inertia of the liquid's spin across the tank's axis, m (a^2 + c^2)/5 in a full spheroid with the semi-axes a, a, c; 0: spin_inertia")
        .range(0.0, 1e12),
    V::parameter("tank.spin_coupling", |p, _| &mut p.tank.spin_coupling, "1",
        "Share of the spin across the tank's axis that belongs to the angular momentum: 2 a c/(a^2 + c^2) in a full spheroid with the semi-axes a, a, c, 1 in a partly full tank")
        .range(0.0, 1.0),
    V::parameter("tank.spin_decay", |p, n| &mut p.tank.spin_decay[n], "1/s",
        "Rate at which wall friction decreases the rotation of the liquid against the tank, about its axis and across it: about sqrt(nu Omega)/R times 2.9 and 2.6 in a full sphere")
        .shape(&[Fixed(2)]).range(0.0, 1e3),
    V::parameter("tank.slip_0", |p, n| &mut p.tank.slip_0[n], "rad/s",
        "Rotation of the liquid against the tank at the start, tank axes; 0: the liquid rotates with the tank")
        .display_unit("deg/s").shape(VECTOR).range(-1e3, 1e3),
    V::integer("tank.fill.points", |p, _| &mut p.points, "Number of points in the tank's fill table; 0: the liquid stays. From 2 on the tank can drain, and the table gives its modes and rigid liquid, interpolated monotonically with two continuous derivatives. The start values are the default tank at depths of 0.1 to 1.2 m")
        .between(0, POINTS as i32),
    V::parameter("tank.liquid_0", |p, _| &mut p.tank.liquid_0, "kg", "Mass of the whole liquid at the start, used if fill.points is above 0")
        .range(0.0, 1e9),
    V::parameter("tank.outlet", |p, _| &mut p.tank.outlet, "m", "Height of the outlet on the tank's axis, used if fill.points is above 0")
        .range(-1e4, 1e4),
    V::parameter("tank.fill.liquid", |p, n| &mut p.tank.fill.liquid[n], "kg", "Mass of the whole liquid at each point of the fill table, increasing")
        .shape(TABLE_OF_TANK).range(0.0, 1e9),
    V::parameter("tank.fill.H_0", |p, n| &mut p.tank.fill.h_0[n], "m", "H_0 at each point of the fill table")
        .shape(TABLE_OF_TANK),
    V::parameter("tank.fill.I_0", |p, n| &mut p.tank.fill.i_0[n], "kg.m2", "I_0 at each point of the fill table")
        .shape(TABLE_OF_TANK).range(0.0, 1e12),
    V::parameter("tank.fill.I_z", |p, n| &mut p.tank.fill.i_z[n], "kg.m2", "I_z at each point of the fill table")
        .shape(TABLE_OF_TANK).range(0.0, 1e12),
    V::parameter("tank.fill.mass", |p, n| &mut p.tank.fill.mass[n / POINTS][n % POINTS], "kg", "Mass of a slosh mode's pendulum (modal mass) at each point of the fill table")
        .shape(TABLE_OF_MODE).range(0.0, 1e9),
    V::parameter("tank.fill.length", |p, n| &mut p.tank.fill.length[n / POINTS][n % POINTS], "m", "Length of a slosh mode's pendulum at each point of the fill table")
        .shape(TABLE_OF_MODE).range(0.0, 1e4),
    V::parameter("tank.fill.hinge", |p, n| &mut p.tank.fill.hinge[n / POINTS][n % POINTS], "m", "Height of a slosh mode's hinge on the tank's axis at each point of the fill table")
        .shape(TABLE_OF_MODE),
    V::parameter("tank.fill.zeta", |p, n| &mut p.tank.fill.zeta[n / POINTS][n % POINTS], "1", "Damping ratio of a slosh mode at g_ref at each point of the fill table; 0 at all points of a mode: zeta at every fill")
        .shape(TABLE_OF_MODE).range(0.0, 10.0),
    V::parameter("tank.fill.nonlinear_inertia", |p, n| &mut p.tank.fill.nonlinear_inertia[n / POINTS][n % POINTS], "1", "Third-order coefficient s (nonlinear_inertia) of a slosh mode at each point of the fill table. If s and kappa of a mode are 1 at all points, nonlinear_inertia and nonlinear_stiffness hold at every fill")
        .shape(TABLE_OF_MODE).range(-1e3, 1e3),
    V::parameter("tank.fill.nonlinear_stiffness", |p, n| &mut p.tank.fill.nonlinear_stiffness[n / POINTS][n % POINTS], "1", "Third-order coefficient kappa (nonlinear_stiffness) of a slosh mode at each point of the fill table; see fill.nonlinear_inertia")
        .shape(TABLE_OF_MODE).range(-1e3, 1e3),
    V::parameter("tank.fill.angle_limit", |p, n| &mut p.tank.fill.angle_limit[n / POINTS][n % POINTS], "rad", "angle_limit of a slosh mode at each point of the fill table, interpolated linearly; 0 where it is not known, then angle_limit holds")
        .display_unit("deg").shape(TABLE_OF_MODE).range(0.0, 1.6),
    V::parameter("tank.fill.swirl_limit", |p, n| &mut p.tank.fill.swirl_limit[n / POINTS][n % POINTS], "rad", "swirl_limit of a slosh mode at each point of the fill table, likewise")
        .display_unit("deg").shape(TABLE_OF_MODE).range(0.0, 1.6),
    V::parameter("tank.p_0", |p, n| &mut p.tank.p_0[n / 3][n % 3], "1",
        "Unit vector from hinge to bob at the start, tank axes; the FMU normalises it, for a planar mode within its plane")
        .shape(MODE_VECTOR),
    V::parameter("tank.p_dot_0", |p, n| &mut p.tank.p_dot_0[n / 3][n % 3], "1/s",
        "Rate of the unit vector from hinge to bob at the start, tank axes; the FMU keeps its tangential part")
        .shape(MODE_VECTOR),

    // The host (optional)
    V::parameter("host.mass", |p, _| &mut p.host.mass, "kg", "Mass of the host without this tank, for coupling_ratio and its warning and for the impulses of tank.ball.travel; 0: unknown")
        .range(0.0, 1e9),
    V::parameter("host.r", |p, n| &mut p.host.r[n], "m", "Centre of mass of the host without this tank from O, host axes")
        .shape(VECTOR).range(-1e4, 1e4),
    V::parameter("host.Jxx", |p, _| &mut p.host.j.xx, "kg.m2", "Moment of inertia of the host without this tank about its centre of mass, host x axis").at_least(0.0),
    V::parameter("host.Jyy", |p, _| &mut p.host.j.yy, "kg.m2", "Moment of inertia of the host without this tank about its centre of mass, host y axis").at_least(0.0),
    V::parameter("host.Jzz", |p, _| &mut p.host.j.zz, "kg.m2", "Moment of inertia of the host without this tank about its centre of mass, host z axis").at_least(0.0),
    V::parameter("host.Jxy", |p, _| &mut p.host.j.xy, "kg.m2", "Product of inertia of the host without this tank about its centre of mass, host axes: minus the integral of x y dm"),
    V::parameter("host.Jxz", |p, _| &mut p.host.j.xz, "kg.m2", "Product of inertia of the host without this tank about its centre of mass, host axes: minus the integral of x z dm"),
    V::parameter("host.Jyz", |p, _| &mut p.host.j.yz, "kg.m2", "Product of inertia of the host without this tank about its centre of mass, host axes: minus the integral of y z dm"),

    // Solver
    V::count("solver.max_steps", |p, _| p.max_steps as i32, |p, _, n| p.max_steps = n.max(0) as usize,
        "Largest number of internal steps in one communication step; a step that needs more is refused")
        .between(1, 1_000_000_000),

    // Calculated from the parameters
    V::calculated("coupling_ratio", |m, _| m.coupling_ratio(), "1",
        "Largest eigenvalue of the host's inverse mass matrix times the tank's added mass; 0 if host.mass is 0. A host that applies force and torque directly diverges, at any communication step, above 1 with held values and above 0.15 with extrapolated ones. It should use bias and added_mass")
        .initial_depends_on(&["tank.", "host."]),
];

fn set_damping_law(p: &mut Parameters, _: usize, number: i32) {
    if let Some(law) = usize::try_from(number - 1).ok().and_then(|i| DampingLaw::ALL.get(i)) {
        p.tank.damping_law = *law;
    }
}

static DAMPING_LAW: Enumeration = Enumeration {
    name: "DampingLaw",
    description: "Drag coefficient c of a mode as a function of its natural frequency omega",
    items: &[
        Item::new("laminar", "c ~ sqrt(omega): a laminar layer at the wall, for bare tanks"),
        Item::new("constant_ratio", "c ~ omega: constant damping ratio"),
        Item::new("constant", "c constant, independent of the specific force"),
    ],
};

static REGIME: Enumeration = Enumeration {
    name: "Regime",
    description: "Amplitude class of the wave at the wall, R being the free surface's radius",
    items: &[
        Item::new("linear", "Below 0.15 R: linear theory holds"),
        Item::new("transitional", "0.15 R to 0.25 R"),
        Item::new("nonlinear", "Above 0.25 R: heights and forces are only indications"),
    ],
};

static LIMITED_BY_ITEMS: [Item; LimitedBy::ITEMS.len()] = Item::list(LimitedBy::ITEMS);

static LIMITED_BY: Enumeration = Enumeration {
    name: "LimitedBy",
    description: "Reason why no pendulum represents the liquid",
    items: &LIMITED_BY_ITEMS,
};

static BALL_STATE: Enumeration = Enumeration {
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

static COUPLING: Enumeration = Enumeration {
    name: "Coupling",
    description: "Meaning of bias and added_mass",
    items: &[
        Item::new(
            "split",
            "Wrench at a = omega_dot = 0 and current added mass, for hosts that solve with both",
        ),
        Item::new(
            "lumped",
            "Constant added mass with each bob at its hinge, bias at the given a and omega_dot; for hosts that add it to the matrix that they solve with",
        ),
        Item::new(
            "rigid_body",
            "As lumped, for hosts that are plain rigid bodies with this mass and inertia in all their equations",
        ),
    ],
};

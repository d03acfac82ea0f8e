//! Every variable of SloshTank.fmu, once. Start values are those of
//! `craft::TankParameters::default()` and `model::START_ACCELERATION`.

use craft::{BallState, Coupling, DampingLaw, MODES, POINTS, TRIANGLE, TankState};
use runtime::table::{About, Scalar, Table, scalar_count, scalars};
use runtime::variable::Dimension::{Fixed, Sized};
use runtime::variable::{Dimension, Enumeration, Item, Variable};

use crate::Model;
use crate::model::Parameters;

/// All that is said about the FMU's variables.
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

static SCALARS: [Scalar<Model>; scalar_count(VARIABLES)] = scalars(VARIABLES);

// The added mass contains neither a nor omega_dot, the bias only by the drag, which follows them weakly: a
// host that solves with them at the a it has has no algebraic loop. With the other couplings the bias contains both, as given in the step before.
const WRENCH: &[&str] = &[
    "tank.p",
    "tank.p_dot",
    "tank.liquid",
    "tank.ball.position",
    "tank.ball.velocity",
    "a",
    "omega",
    "omega_dot",
    "mass_flow",
];
const EVERYTHING: &[&str] =
    &["tank.", "a", "omega", "omega_dot", "mass_flow", "coupling", "coupling_kind"];
const TANK: &[&str] = &["tank."];
const PLACES: &[&str] = &["tank.p", "tank.liquid", "tank.ball.position"];
// What says whether the liquid is where its pendulums stand for it.
const MOTION: &[&str] = &["tank.p", "a", "omega", "omega_dot"];

const MODE: Dimension = Sized("tank.modes", MODES);
const VECTOR: &[Dimension] = &[Fixed(3)];
const PER_MODE: &[Dimension] = &[MODE];
const MODE_VECTOR: &[Dimension] = &[MODE, Fixed(3)];
const MODE_PAIR: &[Dimension] = &[MODE, Fixed(2)];
const TABLE_OF_TANK: &[Dimension] = &[Fixed(POINTS)];
const TABLE_OF_MODE: &[Dimension] = &[MODE, Fixed(POINTS)];

/// Place among the continuous states of an element of the shape [`MODE_VECTOR`].
fn bob(n: usize) -> usize {
    6 * (n / 3) + n % 3
}

const DISSIPATED: usize = 6 * MODES;
const LIQUID: usize = DISSIPATED + 1;
const BALL: usize = LIQUID + 1;

/// Item of [`BALL_STATE`].
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
        "Force of the whole liquid on the host, rigid liquid included, host axes")
        .shape(VECTOR).depends_on(WRENCH).initial_depends_on(EVERYTHING),
    V::output("torque", |o, n| o.tank.torque[n], "N.m",
        "Torque of the whole liquid on the host about O, host axes")
        .shape(VECTOR).depends_on(WRENCH).initial_depends_on(EVERYTHING),
    V::output("bias", |o, n| o.bias[n], "",
        "Force (1 to 3, N) and torque about O (4 to 6, N.m) that the host adds on its right side: force, torque = bias - added_mass [a; omega_dot]. Split, it contains neither a nor omega_dot but through the drag that follows them (with tank.damping_law = constant not at all): of a change of a some 1e-4 of the bobs' mass, which one evaluation settles. With coupling = rigid_body it is for a body that has the constant added_mass in its own mass, centre of mass and inertia, centrifugal and gyroscopic terms included")
        .shape(&[Fixed(6)]).depends_on(WRENCH).initial_depends_on(EVERYTHING),
    V::output("added_mass", |o, n| o.added_mass[n], "",
        "Symmetric 6 x 6 added-mass matrix about O that the host adds on its left side, upper triangle by rows (kg, kg.m, kg.m2): it follows from tank.p, tank.liquid and, of liquid that is a lump, tank.ball.position alone; with coupling = lumped or rigid_body it is that of rigid liquid and each bob at its hinge at the start, constant; the bob of a planar mode counts twice there, with 2 m l^2 about the axes in its plane")
        .shape(&[Fixed(TRIANGLE)]).depends_on(PLACES).initial_depends_on(EVERYTHING),
    V::output("impulse", |o, n| o.impulse[n], "",
        "What impulses of a liquid in the ball regime (tank.ball.travel) have given the host since the start: of force (1 to 3, N.s) and of torque about O (4 to 6, N.m.s), host axes at the time of each. After each step or event the host adds M^-1 of what it has grown by to its velocity and rate, M the 6 x 6 mass matrix about O of host.mass to host.Jyz. 0 with tank.ball.travel = 0")
        .shape(&[Fixed(6)]).depends_on(&[]),

    // Inputs
    V::input("a", |i, n| [&mut i.tank.a.value[n], &mut i.tank.a.slope[n]], "m/s2",
        "Specific force at O: what an accelerometer there reads, host axes; held over a step unless its derivative is set")
        .shape(VECTOR).range(-1e9, 1e9),
    V::input("omega", |i, n| [&mut i.tank.omega[n], &mut i.omega_slope[n]], "rad/s",
        "Angular velocity of the host, host axes, at the start of the step; in the step it follows from omega_dot, and unless it is set anew it goes on from there")
        .display_unit("deg/s").shape(VECTOR).range(-1e9, 1e9).follows_inputs(),
    V::input("omega_dot", |i, n| [&mut i.tank.omega_dot.value[n], &mut i.tank.omega_dot.slope[n]], "rad/s2",
        "Angular acceleration of the host, host axes; held over a step unless its derivative is set")
        .display_unit("deg/s2").shape(VECTOR).range(-1e9, 1e9),
    V::input("mass_flow", |i, _| [&mut i.tank.mass_flow.value, &mut i.tank.mass_flow.slope], "kg/s",
        "Mass that flows out of the tank, with the tank's velocity at the outlet (its thrust is the host's); in where negative. A jump's impulse on the host is left out: ramp it. Of no effect with tank.fill.points = 0")
        .range(-1e9, 1e9),

    // Locals
    V::local("tank.wave_height", |o, _| o.tank.wave_height, "m",
        "Amplitude of the surface at the wall, all modes together: wave times slosh angle")
        .display_unit("mm").depends_on(&["tank.p"]),
    V::local_enumeration("tank.regime", &REGIME, |o, _| o.tank.ranges.regime as i32,
        "How far tank.wave_height is inside the range of linear theory; nonlinear, too, where a bob is beyond 45 degrees or the liquid has left as one lump")
        .depends_on(&["tank.p"]),
    V::local_boolean("tank.in_range", |o, _| o.tank.ranges.in_range,
        "The pendulums stand for the liquid: thrust or centring holds it at the tank's bottom, and every bob is within 45 degrees of the axis; false while the liquid is a lump")
        .depends_on(MOTION),
    V::local_integer("tank.in_range_kind", |o, _| i32::from(o.tank.ranges.in_range),
        "tank.in_range for hosts that misread Booleans (OpenModelica up to 1.27): 0 false, 1 true")
        .depends_on(MOTION),
    V::local_enumeration("tank.ball.state", &BALL_STATE, |o, _| ball_state(o.tank.ball_state),
        "What the liquid does with tank.ball.travel above 0; where it is not settled no pendulum stands for it (tank.in_range), and the angles and tank.wave_height are 0")
        .depends_on(WRENCH),
    V::local("mass", |o, _| o.mass, "kg",
        "Mass of the whole liquid").depends_on(&["tank.liquid"]),
    V::local("center_of_mass", |o, n| o.center_of_mass[n], "m",
        "Centre of mass of the whole liquid from O, host axes")
        .shape(VECTOR).depends_on(PLACES),
    V::local("inertia", |o, n| o.inertia[n / 3][n % 3], "kg.m2",
        "Inertia of the whole liquid about its centre of mass, each bob a point mass where it is, host axes")
        .shape(&[Fixed(3), Fixed(3)]).depends_on(PLACES),
    V::local("tank.angle_x", |o, n| o.tank.angle_x[n], "rad",
        "Slosh angle of a mode: its sine is the bob's displacement along the tank's x axis over the pendulum's length")
        .display_unit("deg").shape(PER_MODE).depends_on(&["tank.p"]),
    V::local("tank.angle_y", |o, n| o.tank.angle_y[n], "rad",
        "Slosh angle of a mode along the tank's y axis")
        .display_unit("deg").shape(PER_MODE).depends_on(&["tank.p"]),
    V::local("dissipated", |o, _| o.dissipated, "J",
        "Energy dissipated by the liquid since the start")
        .is_state(|_| DISSIPATED).depends_on(&["dissipated"]),
    V::state("tank.p", bob, "1",
        "Direction from hinge to bob of a slosh mode, a unit vector in tank axes; at rest under thrust along the tank's axis (0, 0, -1)")
        .shape(MODE_VECTOR).nominal(0.1).reinit().depends_on(&["tank.p[]"]).initial_depends_on(TANK),
    V::state("tank.p_dot", |n| bob(n) + 3, "1/s",
        "Rate of tank.p against the tank, tank axes")
        .shape(MODE_VECTOR).nominal(0.1).reinit().depends_on(&["tank.p_dot[]"]).initial_depends_on(TANK),

    V::state("tank.ball.position", |n| BALL + n, "m",
        "Centre of the liquid as one lump from the tank's origin, tank axes; while it is settled, where its centre is at rest; 0 with tank.ball.travel = 0")
        .shape(VECTOR).reinit().depends_on(&["tank.ball.position[]"]).initial_depends_on(TANK),
    V::state("tank.ball.velocity", |n| BALL + 3 + n, "m/s",
        "Velocity of the lump against the tank, tank axes; 0 while the liquid is settled")
        .shape(VECTOR).nominal(0.01).reinit().depends_on(&["tank.ball.velocity[]"]).initial_depends_on(TANK),

    V::state("tank.liquid", |_| LIQUID, "kg",
        "Mass of the whole liquid")
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

    // The tank
    V::choice("coupling", &COUPLING, |p, _| p.coupling as i32, set_coupling,
        "What bias and added_mass stand for"),
    V::integer("coupling_kind", |p, _| &mut p.coupling_kind,
        "For hosts that set no enumerations (ecos, libcosim): 0: as coupling says; 1 split, 2 lumped, 3 rigid_body. An error if coupling has been set to another one")
        .between(0, COUPLING.items.len() as i32),
    V::parameter("tank.position", |p, n| &mut p.tank.position[n], "m",
        "The tank's origin from O, host axes")
        .shape(VECTOR).range(-1e4, 1e4),
    V::parameter("tank.q", |p, n| &mut p.tank.q[n], "1",
        "Attitude of the tank, tank to host axes, scalar first; normalised")
        .shape(&[Fixed(4)]),
    V::parameter("tank.diameter", |p, _| &mut p.tank.diameter, "m", "Diameter of an upright cylinder; above 0 it makes with depth and density m_0, H_0, I_0 and each mode's mass, length, hinge and wave by potential flow, and the tank's origin is the centre of its bottom")
        .display_unit("mm").range(0.0, 1e3),
    V::parameter("tank.depth", |p, _| &mut p.tank.depth, "m", "Depth of the liquid in the cylinder, used where diameter is above 0")
        .display_unit("mm").range(1e-3, 1e3),
    V::parameter("tank.density", |p, _| &mut p.tank.density, "kg/m3", "Density of the liquid, used where diameter is above 0")
        .range(1e-3, 1e5),
    V::parameter("tank.m_0", |p, _| &mut p.tank.m_0, "kg", "Mass of the rigid liquid; below 0 allowed with planar modes (direction) alone"),
    V::parameter("tank.H_0", |p, _| &mut p.tank.h_0, "m", "Height of the rigid liquid's centre of mass on the tank's axis"),
    V::parameter("tank.I_0", |p, _| &mut p.tank.i_0, "kg.m2", "Moment of inertia of the rigid liquid across the axis, about its centre of mass; with dI_y that about the tank's x axis; below 0 as m_0"),
    V::parameter("tank.I_z", |p, _| &mut p.tank.i_z, "kg.m2", "Moment of inertia of the rigid liquid about the tank's axis, through its centre of mass; below 0 as m_0"),
    V::parameter("tank.r_0", |p, n| &mut p.tank.r_0[n], "m", "How far the rigid liquid's centre of mass is off the tank's axis, along the tank's x and y axis")
        .shape(&[Fixed(2)]),
    V::parameter("tank.dI_y", |p, _| &mut p.tank.di_y, "kg.m2", "By how much the moment of inertia of the rigid liquid about the tank's y axis exceeds I_0")
        .range(-1e12, 1e12),
    V::parameter("tank.I_xy", |p, _| &mut p.tank.products[0], "kg.m2", "Product of inertia of the rigid liquid about its centre of mass, tank axes, minus the integral of x y dm")
        .range(-1e12, 1e12),
    V::parameter("tank.I_xz", |p, _| &mut p.tank.products[1], "kg.m2", "Product of inertia of the rigid liquid, minus the integral of x z dm")
        .range(-1e12, 1e12),
    V::parameter("tank.I_yz", |p, _| &mut p.tank.products[2], "kg.m2", "Product of inertia of the rigid liquid, minus the integral of y z dm")
        .range(-1e12, 1e12),
    V::integer("tank.modes", |p, _| &mut p.modes, "Number of slosh modes of the tank")
        .between(0, MODES as i32),
    V::parameter("tank.g_ref", |p, _| &mut p.tank.g_ref, "m/s2", "Acceleration along the tank's axis at which zeta holds")
        .range(1e-9, 1e6),
    V::parameter("tank.mass", |p, n| &mut p.tank.mass[n], "kg", "Mass of a mode's bob")
        .shape(PER_MODE).range(1e-9, 1e9),
    V::parameter("tank.length", |p, n| &mut p.tank.length[n], "m", "Length of a mode's pendulum")
        .shape(PER_MODE).range(1e-6, 1e4),
    V::parameter("tank.frequency", |p, n| &mut p.tank.frequency[n], "Hz",
        "Natural frequency of a mode with the tank held, at g_ref; above 0 it stands in place of length: (2 pi f)^2 = g_ref/l + k/m")
        .shape(PER_MODE).range(0.0, 1e6),
    V::parameter("tank.hinge", |p, n| &mut p.tank.hinge[n], "m", "Height of a mode's hinge on the tank's axis")
        .shape(PER_MODE),
    V::parameter("tank.direction", |p, n| &mut p.tank.direction[n / 2][n % 2], "1",
        "Direction in which a mode moves its mass, x and y in tank axes, normalised: the mode is planar, its bob swings in the plane of this direction and the tank's axis and is carried along across it; 0, 0: it swings in every direction")
        .shape(MODE_PAIR),
    V::parameter("tank.arm", |p, n| &mut p.tank.arm[n], "m",
        "How far a planar mode's plane is off the tank's axis: the arm about it of a momentum in the mode's direction")
        .shape(PER_MODE),
    V::parameter("tank.k", |p, n| &mut p.tank.k[n], "N/m", "Centring stiffness of a mode (capillarity, diaphragm)")
        .shape(PER_MODE).range(0.0, 1e12),
    V::parameter("tank.zeta", |p, n| &mut p.tank.zeta[n], "1", "Damping ratio of a mode at g_ref: there its drag coefficient is 2 zeta m sqrt(g_ref/l + k/m); tank.damping_law says how it goes on")
        .shape(PER_MODE).range(0.0, 10.0),
    V::choice("tank.damping_law", &DAMPING_LAW, |p, _| p.tank.damping_law as i32, set_damping_law,
        "How the modes' drag follows the acceleration along the tank, by their natural frequencies"),
    V::integer("tank.damping_law_kind", |p, _| &mut p.damping_law_kind,
        "For hosts that set no enumerations: 0: as tank.damping_law says; otherwise the number of its item. An error if tank.damping_law has been set to another one")
        .between(0, DAMPING_LAW.items.len() as i32),
    V::parameter("tank.g_floor", |p, _| &mut p.tank.g_floor, "m/s2", "Acceleration along the axis around which the drag stops to follow it; 0: 1e-4 g_ref")
        .range(0.0, 1e6),
    V::parameter("tank.zeta_amplitude", |p, n| &mut p.tank.zeta_amplitude[n], "1/rad", "Growth of a mode's damping ratio with its amplitude A (angle and rate over natural frequency, both directions together): zeta(A) = zeta + zeta_amplitude A")
        .shape(PER_MODE).range(0.0, 10.0),
    V::parameter("tank.wave", |p, n| &mut p.tank.wave[n], "m", "Elevation of the surface at the wall per slosh angle of a mode, for wave_height alone")
        .shape(PER_MODE).range(0.0, 1e9),
    V::parameter("tank.ball.travel", |p, _| &mut p.tank.ball.travel, "m",
        "Above 0: where thrust pulls the liquid off the tank's bottom, or the bobs pass 45 degrees on average by modal mass, all of it goes on as one lump that flies, is thrown back by the wall and settles; how far its centre is moved along the axis from the bottom to the top. With coupling = split, host.mass and the host's inertia, in a tank with modes that does not drain, on a host that takes impulse")
        .display_unit("mm").range(0.0, 1e3),
    V::parameter("tank.ball.radius", |p, _| &mut p.tank.ball.radius, "m",
        "How far the lump's centre gets from the tank's axis; 0: as far as makes the surface that it reaches as curved at the bottom as the path of the pendulums' common centre")
        .display_unit("mm").range(0.0, 1e3),
    V::parameter("tank.ball.restitution", |p, _| &mut p.tank.ball.restitution, "1",
        "Coefficient of restitution of the lump's impacts on the wall: speed along the normal after over that before. A guess unless measured")
        .range(0.0, 1.0),
    V::parameter("tank.ball.contact_speed", |p, _| &mut p.tank.ball.contact_speed, "m/s",
        "Speed after an impact below which a lump that is pressed to the wall stays on it")
        .range(1e-9, 1e3),
    V::parameter("tank.ball.drag", |p, _| &mut p.tank.ball.drag, "1/s",
        "Rate at which the lump's speed along the wall decays while it slides there. A guess unless measured")
        .range(0.0, 1e3),
    V::integer("tank.fill.points", |p, _| &mut p.points, "Points of the tank's table: 0 for a tank whose liquid stays; with 2 or more the tank can drain, and modes and rigid liquid are the table's, interpolated monotonely with two continuous derivatives; as they start, the default tank at depths of 0.1 to 1.2 m")
        .between(0, POINTS as i32),
    V::parameter("tank.liquid_0", |p, _| &mut p.tank.liquid_0, "kg", "Mass of liquid at the start, used with fill.points > 0")
        .range(0.0, 1e9),
    V::parameter("tank.outlet", |p, _| &mut p.tank.outlet, "m", "Height of the outlet on the tank's axis, used with fill.points > 0")
        .range(-1e4, 1e4),
    V::parameter("tank.fill.liquid", |p, n| &mut p.tank.fill.liquid[n], "kg", "Mass of liquid at a point of the table, rising")
        .shape(TABLE_OF_TANK).range(0.0, 1e9),
    V::parameter("tank.fill.H_0", |p, n| &mut p.tank.fill.h_0[n], "m", "H_0 at a point of the table")
        .shape(TABLE_OF_TANK),
    V::parameter("tank.fill.I_0", |p, n| &mut p.tank.fill.i_0[n], "kg.m2", "I_0 at a point of the table")
        .shape(TABLE_OF_TANK).range(0.0, 1e12),
    V::parameter("tank.fill.I_z", |p, n| &mut p.tank.fill.i_z[n], "kg.m2", "I_z at a point of the table")
        .shape(TABLE_OF_TANK).range(0.0, 1e12),
    V::parameter("tank.fill.mass", |p, n| &mut p.tank.fill.mass[n / POINTS][n % POINTS], "kg", "Mass of a mode's bob at a point of the table")
        .shape(TABLE_OF_MODE).range(0.0, 1e9),
    V::parameter("tank.fill.length", |p, n| &mut p.tank.fill.length[n / POINTS][n % POINTS], "m", "Length of a mode's pendulum at a point of the table")
        .shape(TABLE_OF_MODE).range(0.0, 1e4),
    V::parameter("tank.fill.hinge", |p, n| &mut p.tank.fill.hinge[n / POINTS][n % POINTS], "m", "Height of a mode's hinge at a point of the table")
        .shape(TABLE_OF_MODE),
    V::parameter("tank.p_0", |p, n| &mut p.tank.p_0[n / 3][n % 3], "1",
        "Direction from hinge to bob at the start, tank axes; normalised, of a planar mode within its plane")
        .shape(MODE_VECTOR),
    V::parameter("tank.p_dot_0", |p, n| &mut p.tank.p_dot_0[n / 3][n % 3], "1/s",
        "Its rate at the start, tank axes; made tangential")
        .shape(MODE_VECTOR),

    // The host, if it tells
    V::parameter("host.mass", |p, _| &mut p.host.mass, "kg", "Mass of the host without this tank, for coupling_ratio and its warning, and for the impulses of tank.ball.travel; 0: not known")
        .range(0.0, 1e9),
    V::parameter("host.r", |p, n| &mut p.host.r[n], "m", "Its centre of mass from O, host axes")
        .shape(VECTOR).range(-1e4, 1e4),
    V::parameter("host.Jxx", |p, _| &mut p.host.j.xx, "kg.m2", "Its moment of inertia about its centre of mass").at_least(0.0),
    V::parameter("host.Jyy", |p, _| &mut p.host.j.yy, "kg.m2", "Its moment of inertia about its centre of mass").at_least(0.0),
    V::parameter("host.Jzz", |p, _| &mut p.host.j.zz, "kg.m2", "Its moment of inertia about its centre of mass").at_least(0.0),
    V::parameter("host.Jxy", |p, _| &mut p.host.j.xy, "kg.m2", "Its product of inertia, minus the integral of x y dm"),
    V::parameter("host.Jxz", |p, _| &mut p.host.j.xz, "kg.m2", "Its product of inertia, minus the integral of x z dm"),
    V::parameter("host.Jyz", |p, _| &mut p.host.j.yz, "kg.m2", "Its product of inertia, minus the integral of y z dm"),

    // Solver
    V::count("solver.max_steps", |p, _| p.max_steps as i32, |p, _, n| p.max_steps = n.max(0) as usize,
        "Internal steps that one communication step may take: a step that needs more is refused")
        .between(1, 1_000_000_000),

    // What follows from the parameters
    V::calculated("coupling_ratio", |m, _| m.coupling_ratio(), "1",
        "Largest eigenvalue of the host's inverse mass matrix times the tank's added mass, 0 if host.mass is 0. A host that takes force and torque as they are diverges where it is too large, at any communication step: above 1 with held values, above 0.15 with extrapolated ones; use bias and added_mass")
        .initial_depends_on(&["tank.", "host."]),
];

fn set_damping_law(p: &mut Parameters, _: usize, number: i32) {
    if let Some(law) = usize::try_from(number - 1).ok().and_then(|i| DampingLaw::ALL.get(i)) {
        p.tank.damping_law = *law;
    }
}

static DAMPING_LAW: Enumeration = Enumeration {
    name: "DampingLaw",
    description: "Drag coefficient c of a mode against its natural frequency omega",
    items: &[
        Item::new("laminar", "c ~ sqrt(omega): a laminar layer at the wall, for bare tanks"),
        Item::new("constant_ratio", "c ~ omega: the damping ratio stays"),
        Item::new("constant", "c stays, whatever the acceleration"),
    ],
};

static REGIME: Enumeration = Enumeration {
    name: "Regime",
    description: "Wave height at the wall against the free surface's radius R",
    items: &[
        Item::new("linear", "Below 0.15 R: linear theory holds"),
        Item::new("transitional", "0.15 R to 0.25 R"),
        Item::new("nonlinear", "Above 0.25 R: heights and forces are indications"),
    ],
};

static BALL_STATE: Enumeration = Enumeration {
    name: "BallState",
    description: "What the tank's liquid does",
    items: &[
        Item::new("settled", "It is at the bottom: rigid liquid and pendulums"),
        Item::new("flying", "It flies through the tank as one lump; the host feels none of it"),
        Item::new("sliding", "The lump slides on the wall"),
    ],
};

static COUPLING: Enumeration = Enumeration {
    name: "Coupling",
    description: "What bias and added_mass stand for",
    items: &[
        Item::new(
            "split",
            "Wrench at a = omega_dot = 0 and the added mass of the moment: for hosts that solve with them",
        ),
        Item::new(
            "lumped",
            "Constant added mass with each bob at its hinge, bias at the a and omega_dot given: for hosts that add it to the matrix they solve with",
        ),
        Item::new(
            "rigid_body",
            "The same for hosts that are plain rigid bodies with this mass and inertia in all their equations",
        ),
    ],
};

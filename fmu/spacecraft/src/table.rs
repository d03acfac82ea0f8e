//! Every variable of Spacecraft.fmu, once. Start values are those of `craft::Parameters::default()`,
//! turning with `model::START_RATE`.
//!
//! A variant for fewer tanks and modes is made of the same table: the arrays are shorter.
//!
//! Arrays have FMI's structured names: `tank[].p` of the shape 4, 3, 3 is `tank[1].p[1,1]`, …: tank,
//! mode, axis.

use craft::{BallState, DampingLaw, MODES, POINTS, STATES, State, TANKS, index};
use runtime::table::{About, Scalar, Table, scalar_count, scalars};
use runtime::variable::Dimension::{Fixed, Sized};
use runtime::variable::{Dimension, Enumeration, Item, Variable};

use crate::Model;
use crate::model::Parameters;

/// All that is said about the FMU's variables.
pub static TABLE: Table<Model> = Table::new(
    About {
        model: NAME,
        version: env!("CARGO_PKG_VERSION"),
        description: DESCRIPTION,
        events: "",
        event_indicators: 2 * TANKS,
        saved_words: State::WORDS,
    },
    VARIABLES,
    &SCALARS,
);

const DESCRIPTION: &str = match TANKS {
    1 => {
        "A rigid spacecraft in six degrees of freedom with a tank of sloshing liquid, free or on an air bearing"
    }
    2 => {
        "A rigid spacecraft in six degrees of freedom with up to two tanks of sloshing liquid, free or on an air bearing"
    }
    3 => {
        "A rigid spacecraft in six degrees of freedom with up to three tanks of sloshing liquid, free or on an air bearing"
    }
    _ => {
        "A rigid spacecraft in six degrees of freedom with up to four tanks of sloshing liquid, free or on an air bearing"
    }
};

/// Each variant has a name of its own, by which a host tells one's library from another's.
const NAME: &str = match (TANKS, MODES) {
    (1, 1) => "Spacecraft_1x1",
    (1, 2) => "Spacecraft_1x2",
    (1, 3) => "Spacecraft_1x3",
    (2, 1) => "Spacecraft_2x1",
    (2, 2) => "Spacecraft_2x2",
    (2, 3) => "Spacecraft_2x3",
    (3, 1) => "Spacecraft_3x1",
    (3, 2) => "Spacecraft_3x2",
    (3, 3) => "Spacecraft_3x3",
    (4, 1) => "Spacecraft_4x1",
    (4, 2) => "Spacecraft_4x2",
    _ => "Spacecraft",
};

static SCALARS: [Scalar<Model>; scalar_count(VARIABLES)] = scalars(VARIABLES);

// The accelerations balance all forces: the pull of the liquids' pendulums, their drag and centring
// follow from directions and rates, a pivot's gravity from the attitude.
const MOTION: &[&str] = &[
    "q",
    "omega",
    "tank[].p",
    "tank[].p_dot",
    "tank[].liquid",
    "tank[].ball.position",
    "tank[].ball.velocity",
    "force",
    "torque",
    "h_wheels",
    "mass_flow",
];
const MOMENTUM: &[&str] = &[
    "q",
    "omega",
    "velocity",
    "tank[].p",
    "tank[].p_dot",
    "tank[].liquid",
    "tank[].ball.position",
    "tank[].ball.velocity",
    "h_wheels",
    "mass_flow",
];
const ENERGIES: &[&str] = &[
    "q",
    "omega",
    "velocity",
    "tank[].p",
    "tank[].p_dot",
    "tank[].liquid",
    "tank[].ball.position",
    "tank[].ball.velocity",
    "force",
    "torque",
    "h_wheels",
    "mass_flow",
];
const PLACES: &[&str] = &["tank[].p", "tank[].liquid", "tank[].ball.position"];
const ANGLES: &[&str] = &["tank[].p"];
// Where they start.
const EVERYTHING: &[&str] = &[
    "force",
    "torque",
    "h_wheels",
    "mass_flow",
    "craft.",
    "mount",
    "mount_kind",
    "gravity",
    "pivot.",
    "tanks",
    "tank[].",
    "init.",
];
const BOBS: &[&str] = &["tanks", "tank[]."];

const TANK: Dimension = Sized("tanks", TANKS);
const VECTOR: &[Dimension] = &[Fixed(3)];
const QUATERNION: &[Dimension] = &[Fixed(4)];
const MATRIX: &[Dimension] = &[Fixed(3), Fixed(3)];
const PER_TANK: &[Dimension] = &[TANK];
const TANK_VECTOR: &[Dimension] = &[TANK, Fixed(3)];
const PER_MODE: &[Dimension] = &[TANK, Fixed(MODES)];
const MODE_VECTOR: &[Dimension] = &[TANK, Fixed(MODES), Fixed(3)];
const MODE_PAIR: &[Dimension] = &[TANK, Fixed(MODES), Fixed(2)];

const TABLE_OF_TANK: &[Dimension] = &[TANK, Fixed(POINTS)];
const TABLE_OF_MODE: &[Dimension] = &[TANK, Fixed(MODES), Fixed(POINTS)];

/// Tank, mode and point of an element of the shape [`TABLE_OF_MODE`].
const fn point(n: usize) -> (usize, usize, usize) {
    (n / (POINTS * MODES), n / POINTS % MODES, n % POINTS)
}

/// Tank, mode and axis of an element of the shape [`MODE_VECTOR`].
const fn place(n: usize) -> (usize, usize, usize) {
    (n / (3 * MODES), n / 3 % MODES, n % 3)
}

/// The same element's place among the continuous states.
fn bob(n: usize) -> usize {
    let (tank, mode, axis) = place(n);
    index::bob(tank, mode) + axis
}

/// The place among the continuous states of an element of a lump's position.
fn ball(n: usize) -> usize {
    index::ball(n / 3) + n % 3
}

/// Item of [`BALL_STATE`].
fn ball_state(state: BallState) -> i32 {
    match state {
        BallState::Settled => 1,
        BallState::Flying => 2,
        BallState::Sliding | BallState::Light | BallState::Held => 3,
    }
}

type V = Variable<Model>;

/// The variables. Outputs come first, in reading order.
#[rustfmt::skip]
static VARIABLES: &[Variable<Model>] = &[
    // Outputs
    V::output("q", |o, n| o.q[n], "1",
        "Attitude quaternion, scalar first, body to inertial axes")
        .shape(QUATERNION).is_state(|n| index::Q + n).depends_on(&["q[]"]).initial_depends_on(&["init.q"]),
    V::output("omega", |o, n| o.omega[n], "rad/s",
        "Angular velocity against the inertial frame, body axes")
        .display_unit("deg/s").shape(VECTOR).nominal(0.01).is_state(|n| index::OMEGA + n).reinit()
        .depends_on(&["omega[]"]).initial_depends_on(&["init.omega"]),
    V::output("omega_dot", |o, n| o.omega_dot[n], "rad/s2",
        "Angular acceleration, body axes")
        .display_unit("deg/s2").shape(VECTOR).depends_on(MOTION).initial_depends_on(EVERYTHING),
    V::output("specific_force", |o, n| o.specific_force[n], "m/s2",
        "What an accelerometer at O reads, body axes; on a pivot minus gravity")
        .shape(VECTOR).depends_on(MOTION).initial_depends_on(EVERYTHING),
    V::output("position", |o, n| o.position[n], "m",
        "Position of O in the freely falling frame")
        .shape(VECTOR).is_state(|n| index::POSITION + n).reinit().depends_on(&["position[]"]).initial_depends_on(&["init.position"]),
    V::output("velocity", |o, n| o.velocity[n], "m/s",
        "Velocity of O against the freely falling frame, inertial axes")
        .shape(VECTOR).is_state(|n| index::VELOCITY + n).reinit().depends_on(&["velocity[]"]).initial_depends_on(&["init.velocity"]),
    V::output("slosh_force", |o, n| o.slosh_force[n], "N",
        "Force of all liquids on the craft, rigid liquid included, body axes")
        .shape(VECTOR).depends_on(MOTION).initial_depends_on(EVERYTHING),
    V::output("slosh_torque", |o, n| o.slosh_torque[n], "N.m",
        "Torque of all liquids on the craft about O, body axes")
        .shape(VECTOR).depends_on(MOTION).initial_depends_on(EVERYTHING),

    // Inputs
    V::input("force", |i, n| [&mut i.force.value[n], &mut i.force.slope[n]], "N",
        "Applied force at O, body axes; held over a step unless its derivative is set")
        .shape(VECTOR).range(-1e12, 1e12),
    V::input("torque", |i, n| [&mut i.torque.value[n], &mut i.torque.slope[n]], "N.m",
        "Applied torque about O, body axes; held over a step unless its derivative is set")
        .shape(VECTOR).range(-1e12, 1e12),
    V::input("h_wheels", |i, n| [&mut i.h_wheels.value[n], &mut i.h_wheels.slope[n]], "N.m.s",
        "Angular momentum of the wheels relative to the body, body axes. Its derivative turns the craft; a jump does so by an impulse that keeps the total angular momentum. In Model Exchange, where no derivative is known, put the reaction into torque")
        .shape(VECTOR).range(-1e12, 1e12),

    V::input("mass_flow", |i, n| [&mut i.mass_flow[n].value, &mut i.mass_flow[n].slope], "kg/s",
        "Mass that flows out of each tank, with the tank's velocity at the outlet (its thrust is a part of force); in where negative. A jump sets what flows within in motion by an impulse that keeps the momentum. Of no effect in a tank with fill.points = 0")
        .shape(PER_TANK).range(-1e9, 1e9),

    // Locals
    V::local("pivot.torque", |o, n| o.pivot_torque[n], "N.m",
        "Torque of a pivot's stiffness, damping and friction on the craft, body axes; 0 while free")
        .shape(VECTOR).depends_on(&["q", "omega"]),
    V::local("momentum", |o, n| o.momentum[n], "kg.m/s",
        "Linear momentum of everything, inertial axes")
        .shape(VECTOR).depends_on(MOMENTUM),
    V::local("angular_momentum", |o, n| o.angular_momentum[n], "N.m.s",
        "Angular momentum of everything about its centre of mass (on a pivot about O), wheels included, inertial axes")
        .shape(VECTOR).depends_on(MOMENTUM),
    V::local("energy", |o, _| o.energy, "J",
        "Kinetic energy of everything, of the centring springs, and on a pivot of gravity and of its stiffness; the wheels' spin and the flow towards an outlet left out")
        .depends_on(&["q", "omega", "velocity", "tank[].p", "tank[].p_dot", "tank[].liquid", "tank[].ball.position", "tank[].ball.velocity", "mass_flow"]),
    V::local("work", |o, _| o.work, "J",
        "Work of force, torque and wheels on the craft since the start: energy - energy(0) = work - dissipated - drained")
        .is_state(|_| index::WORK).depends_on(&["work"]),
    V::local("dissipated", |o, _| o.dissipated, "J",
        "Energy dissipated by the liquids and by a pivot's damping and friction since the start")
        .is_state(|_| index::DISSIPATED).depends_on(&["dissipated"]),
    V::local("drained", |o, _| o.drained, "J",
        "Energy that has gone with the outflow since the start: the kinetic energy of what has left, and what the flow within the tanks has taken")
        .is_state(|_| index::DRAINED).depends_on(&["drained"]),
    V::local("mass", |o, _| o.mass, "kg",
        "Mass of everything")
        .depends_on(&["tank[].liquid"]),
    V::local("center_of_mass", |o, n| o.center_of_mass[n], "m",
        "Centre of mass of everything from O, body axes")
        .shape(VECTOR).depends_on(PLACES),
    V::local("inertia", |o, n| o.inertia[n / 3][n % 3], "kg.m2",
        "Inertia of everything about its centre of mass, each bob a point mass where it is, body axes")
        .shape(MATRIX).depends_on(PLACES),
    V::local("tank[].force", |o, n| o.tank[n / 3].force[n % 3], "N",
        "Force of a tank's whole liquid on the craft, body axes")
        .shape(TANK_VECTOR).depends_on(MOTION),
    V::local("tank[].torque", |o, n| o.tank[n / 3].torque[n % 3], "N.m",
        "Torque of a tank's whole liquid on the craft about O, body axes")
        .shape(TANK_VECTOR).depends_on(MOTION),
    V::local("tank[].wave_height", |o, n| o.tank[n].wave_height, "m",
        "Amplitude of a tank's surface at the wall, all modes together: wave times slosh angle")
        .display_unit("mm").shape(PER_TANK).depends_on(ANGLES),
    V::local_enumeration("tank[].regime", &REGIME, |o, n| o.tank[n].ranges.regime as i32,
        "How far a tank's wave_height is inside the range of linear theory; nonlinear, too, where a bob is beyond 45 degrees or the liquid has left as one lump")
        .shape(PER_TANK).depends_on(ANGLES),
    V::local_boolean("tank[].in_range", |o, n| o.tank[n].ranges.in_range,
        "The pendulums stand for the liquid: thrust or centring holds it at the tank's bottom, and every bob is within 45 degrees of the axis; false while the liquid is a lump")
        .shape(PER_TANK).depends_on(MOTION),
    V::local_integer("tank[].in_range_kind", |o, n| i32::from(o.tank[n].ranges.in_range),
        "tank[].in_range for hosts that misread Booleans (OpenModelica up to 1.27): 0 false, 1 true")
        .shape(PER_TANK).depends_on(MOTION),
    V::local_enumeration("tank[].ball.state", &BALL_STATE, |o, n| ball_state(o.tank[n].ball_state),
        "What the liquid of a tank does whose ball.travel is above 0; where it is not settled no pendulum stands for it (in_range), and the tank's angles and wave_height are 0")
        .shape(PER_TANK).depends_on(MOTION),
    V::local("tank[].angle_x", |o, n| o.tank[n / MODES].angle_x[n % MODES], "rad",
        "Slosh angle of a mode: its sine is the bob's displacement along the tank's x axis over the pendulum's length")
        .display_unit("deg").shape(PER_MODE).depends_on(ANGLES),
    V::local("tank[].angle_y", |o, n| o.tank[n / MODES].angle_y[n % MODES], "rad",
        "Slosh angle of a mode along the tank's y axis")
        .display_unit("deg").shape(PER_MODE).depends_on(ANGLES),

    // The modes' directions and rates
    V::state("tank[].p", bob, "1",
        "Direction from hinge to bob of a slosh mode, a unit vector in tank axes; at rest under thrust along the tank's axis (0, 0, -1)")
        .shape(MODE_VECTOR).nominal(0.1).reinit().depends_on(&["tank[].p[]"]).initial_depends_on(BOBS),
    V::state("tank[].p_dot", |n| bob(n) + 3, "1/s",
        "Rate of tank[].p against the tank, tank axes")
        .shape(MODE_VECTOR).nominal(0.1).reinit().depends_on(&["tank[].p_dot[]"]).initial_depends_on(BOBS),

    V::state("tank[].ball.position", ball, "m",
        "Centre of the liquid as one lump from the tank's origin, tank axes; while it is settled, where its centre is at rest; 0 in a tank with ball.travel = 0")
        .shape(TANK_VECTOR).reinit().depends_on(&["tank[].ball.position[]"]).initial_depends_on(BOBS),
    V::state("tank[].ball.velocity", |n| ball(n) + 3, "m/s",
        "Velocity of the lump against the tank, tank axes; 0 while the liquid is settled")
        .shape(TANK_VECTOR).nominal(0.01).reinit().depends_on(&["tank[].ball.velocity[]"]).initial_depends_on(BOBS),

    V::state("tank[].liquid", |n| index::LIQUID + n, "kg",
        "Mass of the whole liquid in a tank")
        .shape(PER_TANK).nominal(100.0).depends_on(&["tank[].liquid[]"]).initial_depends_on(BOBS),

    // The derivatives of the continuous states
    V::derivative("der(q)", |n| index::Q + n, "1/s", "Derivative of q")
        .shape(QUATERNION).depends_on(&["q", "omega"]).initial_depends_on(&["init.q", "init.omega"]),
    V::derivative("der(omega)", |n| index::OMEGA + n, "rad/s2", "Derivative of omega: omega_dot")
        .shape(VECTOR).depends_on(MOTION).initial_depends_on(EVERYTHING),
    V::derivative("der(position)", |n| index::POSITION + n, "m/s", "Derivative of position: velocity")
        .shape(VECTOR).depends_on(&["velocity[]"]).initial_depends_on(&["init.velocity", "mount"]),
    V::derivative("der(velocity)", |n| index::VELOCITY + n, "m/s2",
        "Derivative of velocity: the specific force at O in inertial axes; 0 on a pivot")
        .shape(VECTOR).depends_on(MOTION).initial_depends_on(EVERYTHING),
    V::derivative("der(work)", |_| index::WORK, "W", "Derivative of work")
        .depends_on(&["q", "omega", "velocity", "force", "torque", "h_wheels"]).initial_depends_on(EVERYTHING),
    V::derivative("der(dissipated)", |_| index::DISSIPATED, "W", "Derivative of dissipated")
        .depends_on(MOTION).initial_depends_on(EVERYTHING),
    V::derivative("der(drained)", |_| index::DRAINED, "W", "Derivative of drained")
        .depends_on(ENERGIES).initial_depends_on(EVERYTHING),
    V::derivative("der(tank[].liquid)", |n| index::LIQUID + n, "kg/s", "Derivative of tank[].liquid: minus mass_flow")
        .shape(PER_TANK).depends_on(&["mass_flow[]"]).initial_depends_on(&["mass_flow", "tanks", "tank[]."]),
    V::derivative("der(tank[].p)", bob, "1/s", "Derivative of tank[].p: tank[].p_dot")
        .shape(MODE_VECTOR).depends_on(&["tank[].p", "tank[].p_dot"]).initial_depends_on(BOBS),
    V::derivative("der(tank[].p_dot)", |n| bob(n) + 3, "1/s2", "Derivative of tank[].p_dot")
        .shape(MODE_VECTOR).depends_on(MOTION).initial_depends_on(EVERYTHING),

    V::derivative("der(tank[].ball.position)", ball, "m/s", "Derivative of tank[].ball.position: tank[].ball.velocity")
        .shape(TANK_VECTOR).depends_on(&["tank[].ball.position", "tank[].ball.velocity"]).initial_depends_on(BOBS),
    V::derivative("der(tank[].ball.velocity)", |n| ball(n) + 3, "m/s2", "Derivative of tank[].ball.velocity")
        .shape(TANK_VECTOR).depends_on(MOTION).initial_depends_on(EVERYTHING),

    // The dry craft
    V::parameter("craft.mass", |p, _| &mut p.craft.mass, "kg", "Mass of the dry craft, wheels included")
        .range(1e-6, 1e12),
    V::parameter("craft.r", |p, n| &mut p.craft.r[n], "m", "Centre of mass of the dry craft from O, body axes")
        .shape(VECTOR).range(-1e4, 1e4),
    V::parameter("craft.Jxx", |p, _| &mut p.craft.j.xx, "kg.m2", "Moment of inertia of the dry craft about its centre of mass")
        .range(1e-9, 1e12),
    V::parameter("craft.Jyy", |p, _| &mut p.craft.j.yy, "kg.m2", "Moment of inertia of the dry craft about its centre of mass")
        .range(1e-9, 1e12),
    V::parameter("craft.Jzz", |p, _| &mut p.craft.j.zz, "kg.m2", "Moment of inertia of the dry craft about its centre of mass")
        .range(1e-9, 1e12),
    V::parameter("craft.Jxy", |p, _| &mut p.craft.j.xy, "kg.m2", "Product of inertia, minus the integral of x y dm"),
    V::parameter("craft.Jxz", |p, _| &mut p.craft.j.xz, "kg.m2", "Product of inertia, minus the integral of x z dm"),
    V::parameter("craft.Jyz", |p, _| &mut p.craft.j.yz, "kg.m2", "Product of inertia, minus the integral of y z dm"),
    V::choice("mount", &MOUNT, |p, _| p.mount as i32, |p, _, n| p.mount = if n == 2 { craft::Mount::Pivot } else { craft::Mount::Free },
        "How the craft is held"),
    V::integer("mount_kind", |p, _| &mut p.mount_kind,
        "For hosts that set no enumerations: 0: as mount says; 1 free, 2 pivot. An error if mount has been set to another one")
        .between(0, MOUNT.items.len() as i32),
    V::parameter("gravity", |p, n| &mut p.gravity[n], "m/s2", "Uniform gravity, inertial axes: acts on a pivot alone")
        .shape(VECTOR).range(-1e4, 1e4),
    V::parameter("pivot.k", |p, n| &mut p.pivot.k[n], "N.m/rad",
        "Stiffness of a pivot against tilt of the body's z axis from the inertial z axis, about the body's x and y axis")
        .shape(&[Fixed(2)]).range(0.0, 1e12),
    V::parameter("pivot.c", |p, n| &mut p.pivot.c[n], "N.m.s/rad",
        "Damping coefficient of a pivot about each body axis: against omega")
        .shape(VECTOR).range(0.0, 1e12),
    V::parameter("pivot.friction.c", |p, n| &mut p.pivot.friction.c[n], "N.m",
        "Coulomb torque of a pivot about each body axis: against the sign of omega")
        .display_unit("mN.m").shape(VECTOR).range(0.0, 1e12),
    V::parameter("pivot.friction.d", |p, n| &mut p.pivot.friction.d[n], "N.m",
        "What the pivot's dry friction at rest exceeds the Coulomb torque by, about each body axis")
        .display_unit("mN.m").shape(VECTOR).range(0.0, 1e12),
    V::parameter("pivot.friction.omega_s", |p, _| &mut p.pivot.friction.omega_s, "rad/s",
        "Stribeck speed of the pivot's friction: the excess falls with exp(-(omega/omega_s)^2)")
        .display_unit("deg/s").range(1e-6, 1e6),
    V::parameter("pivot.friction.eps", |p, _| &mut p.pivot.friction.eps, "rad/s",
        "Width of the smoothed sign, tanh(omega/eps): an axis that would stick creeps at less than that")
        .display_unit("deg/s").range(1e-7, 1e3),
    V::integer("tanks", |p, _| &mut p.tanks, "Number of tanks")
        .between(0, TANKS as i32),

    // Each tank
    V::parameter("tank[].position", |p, n| &mut p.tank[n / 3].position[n % 3], "m",
        "The tank's origin from O, body axes")
        .shape(TANK_VECTOR).range(-1e4, 1e4),
    V::parameter("tank[].q", |p, n| &mut p.tank[n / 4].q[n % 4], "1",
        "Attitude of the tank, tank to body axes, scalar first; normalised")
        .shape(&[TANK, Fixed(4)]),
    V::parameter("tank[].diameter", |p, n| &mut p.tank[n].diameter, "m", "Diameter of an upright cylinder; above 0 it makes with depth and density m_0, H_0, I_0 and each mode's mass, length, hinge and wave by potential flow, and the tank's origin is the centre of its bottom")
        .display_unit("mm").shape(PER_TANK).range(0.0, 1e3),
    V::parameter("tank[].depth", |p, n| &mut p.tank[n].depth, "m", "Depth of the liquid in the cylinder, used where diameter is above 0")
        .display_unit("mm").shape(PER_TANK).range(1e-3, 1e3),
    V::parameter("tank[].density", |p, n| &mut p.tank[n].density, "kg/m3", "Density of the liquid, used where diameter is above 0")
        .shape(PER_TANK).range(1e-3, 1e5),
    V::parameter("tank[].m_0", |p, n| &mut p.tank[n].m_0, "kg", "Mass of the rigid liquid; below 0 allowed with planar modes (direction) alone")
        .shape(PER_TANK),
    V::parameter("tank[].H_0", |p, n| &mut p.tank[n].h_0, "m", "Height of the rigid liquid's centre of mass on the tank's axis")
        .shape(PER_TANK),
    V::parameter("tank[].I_0", |p, n| &mut p.tank[n].i_0, "kg.m2", "Moment of inertia of the rigid liquid across the axis, about its centre of mass; with dI_y that about the tank's x axis; below 0 as m_0")
        .shape(PER_TANK),
    V::parameter("tank[].I_z", |p, n| &mut p.tank[n].i_z, "kg.m2", "Moment of inertia of the rigid liquid about the tank's axis, through its centre of mass; below 0 as m_0")
        .shape(PER_TANK),
    V::parameter("tank[].r_0", |p, n| &mut p.tank[n / 2].r_0[n % 2], "m", "How far the rigid liquid's centre of mass is off the tank's axis, along the tank's x and y axis")
        .shape(&[TANK, Fixed(2)]),
    V::parameter("tank[].dI_y", |p, n| &mut p.tank[n].di_y, "kg.m2", "By how much the moment of inertia of the rigid liquid about the tank's y axis exceeds I_0")
        .shape(PER_TANK).range(-1e12, 1e12),
    V::parameter("tank[].I_xy", |p, n| &mut p.tank[n].products[0], "kg.m2", "Product of inertia of the rigid liquid about its centre of mass, tank axes, minus the integral of x y dm")
        .shape(PER_TANK).range(-1e12, 1e12),
    V::parameter("tank[].I_xz", |p, n| &mut p.tank[n].products[1], "kg.m2", "Product of inertia of the rigid liquid, minus the integral of x z dm")
        .shape(PER_TANK).range(-1e12, 1e12),
    V::parameter("tank[].I_yz", |p, n| &mut p.tank[n].products[2], "kg.m2", "Product of inertia of the rigid liquid, minus the integral of y z dm")
        .shape(PER_TANK).range(-1e12, 1e12),
    V::integer("tank[].modes", |p, n| &mut p.modes[n], "Number of slosh modes of the tank")
        .between(0, MODES as i32).shape(PER_TANK),
    V::parameter("tank[].g_ref", |p, n| &mut p.tank[n].g_ref, "m/s2", "Acceleration along the tank's axis at which zeta holds")
        .shape(PER_TANK).range(1e-9, 1e6),
    V::parameter("tank[].mass", |p, n| &mut p.tank[n / MODES].mass[n % MODES], "kg", "Mass of a mode's bob")
        .shape(PER_MODE).range(1e-9, 1e9),
    V::parameter("tank[].length", |p, n| &mut p.tank[n / MODES].length[n % MODES], "m", "Length of a mode's pendulum")
        .shape(PER_MODE).range(1e-6, 1e4),
    V::parameter("tank[].frequency", |p, n| &mut p.tank[n / MODES].frequency[n % MODES], "Hz",
        "Natural frequency of a mode with the tank held, at g_ref; above 0 it stands in place of length: (2 pi f)^2 = g_ref/l + k/m")
        .shape(PER_MODE).range(0.0, 1e6),
    V::parameter("tank[].hinge", |p, n| &mut p.tank[n / MODES].hinge[n % MODES], "m", "Height of a mode's hinge on the tank's axis")
        .shape(PER_MODE),
    V::parameter("tank[].direction", |p, n| &mut p.tank[n / (2 * MODES)].direction[n / 2 % MODES][n % 2], "1",
        "Direction in which a mode moves its mass, x and y in tank axes, normalised: the mode is planar, its bob swings in the plane of this direction and the tank's axis and is carried along across it; 0, 0: it swings in every direction")
        .shape(MODE_PAIR),
    V::parameter("tank[].arm", |p, n| &mut p.tank[n / MODES].arm[n % MODES], "m",
        "How far a planar mode's plane is off the tank's axis: the arm about it of a momentum in the mode's direction")
        .shape(PER_MODE),
    V::parameter("tank[].k", |p, n| &mut p.tank[n / MODES].k[n % MODES], "N/m", "Centring stiffness of a mode (capillarity, diaphragm)")
        .shape(PER_MODE).range(0.0, 1e12),
    V::parameter("tank[].zeta", |p, n| &mut p.tank[n / MODES].zeta[n % MODES], "1", "Damping ratio of a mode at g_ref: there its drag coefficient is 2 zeta m sqrt(g_ref/l + k/m); tank[].damping_law says how it goes on")
        .shape(PER_MODE).range(0.0, 10.0),
    V::choice("tank[].damping_law", &DAMPING_LAW, |p, n| p.tank[n].damping_law as i32, set_damping_law,
        "How the drag of a tank's modes follows the acceleration along the tank, by their natural frequencies")
        .shape(PER_TANK),
    V::integer("tank[].damping_law_kind", |p, n| &mut p.damping_law_kind[n],
        "For hosts that set no enumerations: 0: as damping_law says; otherwise the number of its item. An error if damping_law has been set to another one")
        .between(0, DAMPING_LAW.items.len() as i32).shape(PER_TANK),
    V::parameter("tank[].g_floor", |p, n| &mut p.tank[n].g_floor, "m/s2", "Acceleration along the axis around which the drag stops to follow it; 0: 1e-4 g_ref")
        .shape(PER_TANK).range(0.0, 1e6),
    V::parameter("tank[].zeta_amplitude", |p, n| &mut p.tank[n / MODES].zeta_amplitude[n % MODES], "1/rad", "Growth of a mode's damping ratio with its amplitude A (angle and rate over natural frequency, both directions together): zeta(A) = zeta + zeta_amplitude A")
        .shape(PER_MODE).range(0.0, 10.0),
    V::parameter("tank[].wave", |p, n| &mut p.tank[n / MODES].wave[n % MODES], "m", "Elevation of the surface at the wall per slosh angle of a mode, for wave_height alone")
        .shape(PER_MODE).range(0.0, 1e9),
    V::parameter("tank[].ball.travel", |p, n| &mut p.tank[n].ball.travel, "m",
        "Above 0: where thrust pulls the liquid off the tank's bottom, or the bobs pass 45 degrees on average by modal mass, all of it goes on as one lump that flies, is thrown back by the wall and settles; how far its centre is moved along the axis from the bottom to the top. On a free craft without tanks that drain, in a tank with modes")
        .display_unit("mm").shape(PER_TANK).range(0.0, 1e3),
    V::parameter("tank[].ball.radius", |p, n| &mut p.tank[n].ball.radius, "m",
        "How far the lump's centre gets from the tank's axis; 0: as far as makes the surface that it reaches as curved at the bottom as the path of the pendulums' common centre")
        .display_unit("mm").shape(PER_TANK).range(0.0, 1e3),
    V::parameter("tank[].ball.restitution", |p, n| &mut p.tank[n].ball.restitution, "1",
        "Coefficient of restitution of the lump's impacts on the wall: speed along the normal after over that before. A guess unless measured")
        .shape(PER_TANK).range(0.0, 1.0),
    V::parameter("tank[].ball.contact_speed", |p, n| &mut p.tank[n].ball.contact_speed, "m/s",
        "Speed after an impact below which a lump that is pressed to the wall stays on it")
        .shape(PER_TANK).range(1e-9, 1e3),
    V::parameter("tank[].ball.drag", |p, n| &mut p.tank[n].ball.drag, "1/s",
        "Rate at which the lump's speed along the wall decays while it slides there. A guess unless measured")
        .shape(PER_TANK).range(0.0, 1e3),
    V::integer("tank[].fill.points", |p, n| &mut p.points[n], "Points of the tank's table: 0 for a tank whose liquid stays; with 2 or more the tank can drain, and modes and rigid liquid are the table's, interpolated monotonely with two continuous derivatives; as they start, the default tank at depths of 0.1 to 1.2 m")
        .between(0, POINTS as i32).shape(PER_TANK),
    V::parameter("tank[].liquid_0", |p, n| &mut p.tank[n].liquid_0, "kg", "Mass of liquid at the start, used with fill.points > 0")
        .shape(PER_TANK).range(0.0, 1e9),
    V::parameter("tank[].outlet", |p, n| &mut p.tank[n].outlet, "m", "Height of the outlet on the tank's axis, used with fill.points > 0")
        .shape(PER_TANK).range(-1e4, 1e4),
    V::parameter("tank[].fill.liquid", |p, n| &mut p.tank[n / POINTS].fill.liquid[n % POINTS], "kg", "Mass of liquid at a point of the table, rising")
        .shape(TABLE_OF_TANK).range(0.0, 1e9),
    V::parameter("tank[].fill.H_0", |p, n| &mut p.tank[n / POINTS].fill.h_0[n % POINTS], "m", "H_0 at a point of the table")
        .shape(TABLE_OF_TANK),
    V::parameter("tank[].fill.I_0", |p, n| &mut p.tank[n / POINTS].fill.i_0[n % POINTS], "kg.m2", "I_0 at a point of the table")
        .shape(TABLE_OF_TANK).range(0.0, 1e12),
    V::parameter("tank[].fill.I_z", |p, n| &mut p.tank[n / POINTS].fill.i_z[n % POINTS], "kg.m2", "I_z at a point of the table")
        .shape(TABLE_OF_TANK).range(0.0, 1e12),
    V::parameter("tank[].fill.mass", |p, n| { let (i, m, k) = point(n); &mut p.tank[i].fill.mass[m][k] }, "kg", "Mass of a mode's bob at a point of the table")
        .shape(TABLE_OF_MODE).range(0.0, 1e9),
    V::parameter("tank[].fill.length", |p, n| { let (i, m, k) = point(n); &mut p.tank[i].fill.length[m][k] }, "m", "Length of a mode's pendulum at a point of the table")
        .shape(TABLE_OF_MODE).range(0.0, 1e4),
    V::parameter("tank[].fill.hinge", |p, n| { let (i, m, k) = point(n); &mut p.tank[i].fill.hinge[m][k] }, "m", "Height of a mode's hinge at a point of the table")
        .shape(TABLE_OF_MODE),
    V::parameter("tank[].p_0", |p, n| { let (i, m, k) = place(n); &mut p.tank[i].p_0[m][k] }, "1",
        "Direction from hinge to bob at the start, tank axes; normalised, of a planar mode within its plane")
        .shape(MODE_VECTOR),
    V::parameter("tank[].p_dot_0", |p, n| { let (i, m, k) = place(n); &mut p.tank[i].p_dot_0[m][k] }, "1/s",
        "Its rate at the start, tank axes; made tangential")
        .shape(MODE_VECTOR),

    // Where the motion starts
    V::parameter("init.q", |p, n| &mut p.init.q[n], "1", "q at the start; normalised")
        .shape(QUATERNION),
    V::parameter("init.omega", |p, n| &mut p.init.omega[n], "rad/s",
        "omega at the start. Not 0, so that with nothing set something moves; 0 to start at rest")
        .display_unit("deg/s").shape(VECTOR).range(-1e3, 1e3),
    V::parameter("init.position", |p, n| &mut p.init.position[n], "m", "position at the start")
        .shape(VECTOR),
    V::parameter("init.velocity", |p, n| &mut p.init.velocity[n], "m/s", "velocity at the start")
        .shape(VECTOR),

    // Solver
    V::count("solver.max_steps", |p, _| p.max_steps as i32, |p, _, n| p.max_steps = n.max(0) as usize,
        "Internal steps that one communication step may take: a step that needs more is refused")
        .between(1, 1_000_000_000),
];

fn set_damping_law(p: &mut Parameters, tank: usize, number: i32) {
    if let Some(law) = usize::try_from(number - 1).ok().and_then(|i| DampingLaw::ALL.get(i)) {
        p.tank[tank].damping_law = *law;
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
    description: "What the liquid of a tank does",
    items: &[
        Item::new("settled", "It is at the bottom: rigid liquid and pendulums"),
        Item::new("flying", "It flies through the tank as one lump; the craft feels none of it"),
        Item::new("sliding", "The lump slides on the wall"),
    ],
};

static MOUNT: Enumeration = Enumeration {
    name: "Mount",
    description: "How the craft is held",
    items: &[
        Item::new("free", "It flies: position and velocity count from a freely falling frame"),
        Item::new(
            "pivot",
            "O rests on a bearing in uniform gravity; the craft turns about it, freely unless pivot.k, pivot.c or pivot.friction is set",
        ),
    ],
};

const _: () = assert!(STATES == index::BALLS + 6 * TANKS);

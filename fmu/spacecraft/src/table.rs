//! Every variable of Spacecraft.fmu, once. Start values are those of `craft::Parameters::default()`:
//! the craft is at rest.
//!
//! Arrays have FMI's structured names: `tank[].p` of the shape 4, 3, 3 is `tank[1].p[1,1]`, … with
//! the indices tank, mode, axis.

use craft::{
    APPENDAGES, BallState, DampingLaw, LimitedBy, MODES, POINTS, STATES, State, TANKS, index,
};
use runtime::table::{About, Scalar, Table, scalar_count, scalars};
use runtime::variable::Dimension::{Fixed, Sized, Used};
use runtime::variable::{Dimension, Enumeration, Item, Variable};

use crate::model::{Model, Parameters};

pub static TABLE: Table<Model> = Table::new(
    About {
        model: "Spacecraft",
        version: env!("CARGO_PKG_VERSION"),
        description: DESCRIPTION,
        events: "",
        event_indicators: 2 * TANKS,
        saved_words: State::WORDS,
    },
    VARIABLES,
    &SCALARS,
);

impl runtime::Model for Model {
    fn table() -> &'static Table<Self> {
        &TABLE
    }
}

const DESCRIPTION: &str = "A rigid spacecraft in six degrees of freedom with up to four tanks of sloshing liquid and up to six modes of flexible appendages, free or on an air bearing";

static SCALARS: [Scalar<Model>; scalar_count(VARIABLES)] = scalars(VARIABLES);

// Direct dependencies. The accelerations balance all forces. Tension, drag and centring of the
// pendulums depend on their directions and rates, gravity on a pivot depends on the attitude.
const MOTION: &[&str] = &[
    "q",
    "omega",
    "tank[].p",
    "tank[].p_dot",
    "tank[].liquid",
    "tank[].ball.position",
    "tank[].ball.velocity",
    "tank[].spin",
    "appendage[].eta",
    "appendage[].eta_dot",
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
    "tank[].spin",
    "appendage[].eta",
    "appendage[].eta_dot",
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
    "tank[].spin",
    "appendage[].eta",
    "appendage[].eta_dot",
    "force",
    "torque",
    "h_wheels",
    "mass_flow",
];
const PLACES: &[&str] = &["tank[].p", "tank[].liquid", "tank[].ball.position", "appendage[].eta"];
const ANGLES: &[&str] = &["tank[].p"];
// Dependencies of initial values.
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
    "appendages",
    "appendage[].",
    "init.",
];
const BOBS: &[&str] = &["tanks", "tank[]."];
const DEFORMED: &[&str] = &["appendages", "appendage[]."];
const SPINS: &[&str] = &["tanks", "tank[].", "init.omega"];

const TANK: Dimension = Sized("tanks", TANKS);
const MODE: Dimension = Used("tank[].modes", MODES);
const PER_APPENDAGE: &[Dimension] = &[Used("appendages", APPENDAGES)];
const VECTOR: &[Dimension] = &[Fixed(3)];
const QUATERNION: &[Dimension] = &[Fixed(4)];
const MATRIX: &[Dimension] = &[Fixed(3), Fixed(3)];
const PER_TANK: &[Dimension] = &[TANK];
const TANK_VECTOR: &[Dimension] = &[TANK, Fixed(3)];
const PER_MODE: &[Dimension] = &[TANK, MODE];
const MODE_VECTOR: &[Dimension] = &[TANK, MODE, Fixed(3)];
const APPENDAGE_VECTOR: &[Dimension] = &[Used("appendages", APPENDAGES), Fixed(3)];
const MODE_PAIR: &[Dimension] = &[TANK, MODE, Fixed(2)];

const TABLE_OF_TANK: &[Dimension] = &[TANK, Fixed(POINTS)];
const TABLE_OF_MODE: &[Dimension] = &[TANK, MODE, Fixed(POINTS)];

/// Returns tank, mode and point of element `n` of the shape [`TABLE_OF_MODE`].
const fn point(n: usize) -> (usize, usize, usize) {
    (n / (POINTS * MODES), n / POINTS % MODES, n % POINTS)
}

/// Returns tank, mode and axis of element `n` of the shape [`MODE_VECTOR`].
const fn place(n: usize) -> (usize, usize, usize) {
    (n / (3 * MODES), n / 3 % MODES, n % 3)
}

fn bob(n: usize) -> usize {
    let (tank, mode, axis) = place(n);
    index::bob(tank, mode) + axis
}

fn ball(n: usize) -> usize {
    index::ball(n / 3) + n % 3
}

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
        "Angular velocity relative to the inertial frame, body axes")
        .display_unit("deg/s").shape(VECTOR).nominal(0.01).is_state(|n| index::OMEGA + n).reinit()
        .depends_on(&["omega[]"]).initial_depends_on(&["init.omega"]),
    V::output("omega_dot", |o, n| o.omega_dot[n], "rad/s2",
        "Angular acceleration relative to the inertial frame, body axes")
        .display_unit("deg/s2").shape(VECTOR).depends_on(MOTION).initial_depends_on(EVERYTHING),
    V::output("specific_force", |o, n| o.specific_force[n], "m/s2",
        "Specific force at O, as an accelerometer there measures it, body axes; on a pivot minus gravity")
        .shape(VECTOR).depends_on(MOTION).initial_depends_on(EVERYTHING),
    V::output("position", |o, n| o.position[n], "m",
        "Position of O in the freely falling frame, inertial axes")
        .shape(VECTOR).is_state(|n| index::POSITION + n).reinit().depends_on(&["position[]"]).initial_depends_on(&["init.position"]),
    V::output("velocity", |o, n| o.velocity[n], "m/s",
        "Velocity of O in the freely falling frame, inertial axes")
        .shape(VECTOR).is_state(|n| index::VELOCITY + n).reinit().depends_on(&["velocity[]"]).initial_depends_on(&["init.velocity"]),
    V::output("slosh_force", |o, n| o.slosh_force[n], "N",
        "Force of all liquids (sloshing and rigid) on the craft, body axes")
        .shape(VECTOR).depends_on(MOTION).initial_depends_on(EVERYTHING),
    V::output("slosh_torque", |o, n| o.slosh_torque[n], "N.m",
        "Torque of all liquids (sloshing and rigid) on the craft about O, body axes")
        .shape(VECTOR).depends_on(MOTION).initial_depends_on(EVERYTHING),

    // Inputs
    V::input("force", |i, n| [&mut i.force.value[n], &mut i.force.slope[n]], "N",
        "Applied force at O, body axes. Held over a communication step unless an input derivative is set, which applies to one step")
        .shape(VECTOR).range(-1e12, 1e12),
    V::input("torque", |i, n| [&mut i.torque.value[n], &mut i.torque.slope[n]], "N.m",
        "Applied torque about O, body axes. Held over a communication step unless an input derivative is set, which applies to one step")
        .shape(VECTOR).range(-1e12, 1e12),
    V::input("h_wheels", |i, n| [&mut i.h_wheels.value[n], &mut i.h_wheels.slope[n]], "N.m.s",
        "Angular momentum of the wheels relative to the body, body axes. Its input derivative turns the craft; a jump does so by an impulse that conserves total angular momentum. In Model Exchange, without input derivatives, add the wheels' reaction to torque")
        .shape(VECTOR).range(-1e12, 1e12),

    V::input("mass_flow", |i, n| [&mut i.mass_flow[n].value, &mut i.mass_flow[n].slope], "kg/s",
        "Mass flow out of each tank, negative for inflow; it leaves with the tank's velocity at the outlet, and its thrust is part of force. A jump starts the flow within the tank by an impulse that conserves momentum. Without effect in a tank with fill.points = 0")
        .shape(PER_TANK).range(-1e9, 1e9),

    // Locals
    V::local("pivot.torque", |o, n| o.pivot_torque[n], "N.m",
        "Torque of the pivot's stiffness, damping and friction on the craft, body axes; 0 in free flight")
        .shape(VECTOR).depends_on(&["q", "omega"]),
    V::local("momentum", |o, n| o.momentum[n], "kg.m/s",
        "Linear momentum of craft, appendages and liquids, inertial axes")
        .shape(VECTOR).depends_on(MOMENTUM),
    V::local("angular_momentum", |o, n| o.angular_momentum[n], "N.m.s",
        "Angular momentum of craft, appendages, wheels and liquids about their centre of mass (on a pivot about O), inertial axes")
        .shape(VECTOR).depends_on(MOMENTUM),
    V::local("energy", |o, _| o.energy, "J",
        "Kinetic energy of craft, appendages and liquids plus energy of the centring springs and of the appendages' stiffness, on a pivot also of gravity and of the pivot's stiffness. Excludes the spin of the wheels and the flow towards an outlet")
        .depends_on(&["q", "omega", "velocity", "tank[].p", "tank[].p_dot", "tank[].liquid", "tank[].ball.position", "tank[].ball.velocity", "tank[].spin", "appendage[].eta", "appendage[].eta_dot", "mass_flow"]),
    V::local("work", |o, _| o.work, "J",
        "Work done on the craft by force, torque and wheels since the start: energy - energy(0) = work - dissipated - drained")
        .is_state(|_| index::WORK).depends_on(&["work"]),
    V::local("dissipated", |o, _| o.dissipated, "J",
        "Energy dissipated by the liquids and appendages and by the pivot's damping and friction since the start")
        .is_state(|_| index::DISSIPATED).depends_on(&["dissipated"]),
    V::local("drained", |o, _| o.drained, "J",
        "Energy lost with the outflow since the start: kinetic energy of the liquid that has left, and energy taken by the flow within the tanks")
        .is_state(|_| index::DRAINED).depends_on(&["drained"]),
    V::local("mass", |o, _| o.mass, "kg",
        "Mass of craft and liquids")
        .depends_on(&["tank[].liquid"]),
    V::local("center_of_mass", |o, n| o.center_of_mass[n], "m",
        "Centre of mass of craft, deformed appendages and liquids from O, body axes")
        .shape(VECTOR).depends_on(PLACES),
    V::local("inertia", |o, n| o.inertia[n / 3][n % 3], "kg.m2",
        "Inertia matrix of craft, deformed appendages and liquids about their centre of mass, each bob a point mass at its current position, body axes")
        .shape(MATRIX).depends_on(PLACES),
    V::local("tank[].force", |o, n| o.tank[n / 3].force[n % 3], "N",
        "Force of a tank's whole liquid (sloshing and rigid) on the craft, body axes")
        .shape(TANK_VECTOR).depends_on(MOTION),
    V::local("tank[].torque", |o, n| o.tank[n / 3].torque[n % 3], "N.m",
        "Torque of a tank's whole liquid (sloshing and rigid) on the craft about O, body axes")
        .shape(TANK_VECTOR).depends_on(MOTION),
    V::local("tank[].wave_height", |o, n| o.tank[n].wave_height, "m",
        "Wave height at the tank wall above the surface at rest, all modes together: wave times slosh angle")
        .display_unit("mm").shape(PER_TANK).depends_on(ANGLES),
    V::local_enumeration("tank[].regime", &REGIME, |o, n| o.tank[n].ranges.regime as i32,
        "Amplitude class of the wave, by tank[].wave_height over the free surface's radius; nonlinear also while a bob is beyond 45 degrees or the liquid is detached")
        .shape(PER_TANK).depends_on(ANGLES),
    V::local_boolean("tank[].in_range", |o, n| o.tank[n].ranges.is_in_range(),
        "True while the pendulums represent the liquid; tank[].limited_by has the reason if not. False while the liquid is detached")
        .shape(PER_TANK).depends_on(MOTION),
    V::local_integer("tank[].in_range_kind", |o, n| i32::from(o.tank[n].ranges.is_in_range()),
        "tank[].in_range as an integer, for hosts that misread Booleans (OpenModelica up to 1.27): 0 false, 1 true")
        .shape(PER_TANK).depends_on(MOTION),
    V::local_enumeration("tank[].limited_by", &LIMITED_BY, |o, n| o.tank[n].ranges.limited_by as i32,
        "Reason why the pendulums do not represent the liquid now; of several the first of contact, empty, spin, bond_number, secondary_resonance, breaking, third_order")
        .shape(PER_TANK).depends_on(MOTION),
    V::local_integer("tank[].limited_by_kind", |o, n| o.tank[n].ranges.limited_by as i32,
        "tank[].limited_by as an integer, for hosts that misread enumerations")
        .shape(PER_TANK).depends_on(MOTION),
    V::local("tank[].spin_ratio", |o, n| o.tank[n].spin_ratio, "1",
        "2 Omega/omega_0: spin of the liquid about the tank's axis (tank[].spin[3]/spin_inertia; without spin_inertia the tank's own rate) over the natural frequency of mode 1 without spin. Above (1 + C)^(-1/2), 0.84 in deep and 0.74 in shallow liquid, out of range (limited_by = spin); 0 without modes")
        .shape(PER_TANK).depends_on(MOTION),
    V::local("tank[].spin_number", |o, n| o.tank[n].spin_number, "1",
        "Omega^2 R/g: depth of the paraboloid of liquid that spins at Omega, with the radius R of the free surface and the specific force g along the tank. Above 0.3 out of range (limited_by = spin); 0 without modes")
        .shape(PER_TANK).depends_on(MOTION),
    V::local_enumeration("tank[].ball.state", &BALL_STATE, |o, n| ball_state(o.tank[n].ball_state),
        "State of the liquid in a tank with tank[].ball.travel above 0. Unless it is settled, no pendulum represents the liquid (in_range), and slosh angles and wave_height are 0")
        .shape(PER_TANK).depends_on(MOTION),
    V::local("tank[].angle_x", |o, n| o.tank[n / MODES].angle_x[n % MODES], "rad",
        "Slosh angle of a mode along the tank's x axis; its sine is the bob's displacement over the pendulum's length")
        .display_unit("deg").shape(PER_MODE).depends_on(ANGLES),
    V::local("tank[].angle_y", |o, n| o.tank[n / MODES].angle_y[n % MODES], "rad",
        "Slosh angle of a mode along the tank's y axis; its sine is the bob's displacement over the pendulum's length")
        .display_unit("deg").shape(PER_MODE).depends_on(ANGLES),

    // The modes' directions and rates
    V::state("tank[].p", bob, "1",
        "Unit vector from hinge to bob of a slosh mode, tank axes; (0, 0, -1) at rest under thrust along the tank's axis")
        .shape(MODE_VECTOR).nominal(0.1).reinit().depends_on(&["tank[].p[]"]).initial_depends_on(BOBS),
    V::state("tank[].p_dot", |n| bob(n) + 3, "1/s",
        "Rate of tank[].p relative to the tank, tank axes")
        .shape(MODE_VECTOR).nominal(0.1).reinit().depends_on(&["tank[].p_dot[]"]).initial_depends_on(BOBS),

    V::state("tank[].ball.position", ball, "m",
        "Centre of the detached liquid from the tank's origin, tank axes; while the liquid is settled, its centre at rest; 0 if tank[].ball.travel is 0")
        .shape(TANK_VECTOR).reinit().depends_on(&["tank[].ball.position[]"]).initial_depends_on(BOBS),
    V::state("tank[].ball.velocity", |n| ball(n) + 3, "m/s",
        "Velocity of the detached liquid's centre relative to the tank, tank axes; 0 while the liquid is settled")
        .shape(TANK_VECTOR).nominal(0.01).reinit().depends_on(&["tank[].ball.velocity[]"]).initial_depends_on(BOBS),

    V::state("tank[].spin", |n| index::spin(n / 3) + n % 3, "kg.m2/s",
        "Angular momentum of the liquid's spin, tank axes; 0 if tank[].spin_inertia is 0")
        .shape(TANK_VECTOR).nominal(0.1).depends_on(&["tank[].spin[]"]).initial_depends_on(SPINS),

    V::state("tank[].liquid", |n| index::LIQUID + n, "kg",
        "Mass of the whole liquid in a tank")
        .shape(PER_TANK).nominal(100.0).depends_on(&["tank[].liquid[]"]).initial_depends_on(BOBS),

    V::state("appendage[].eta", |n| index::ETA + n, "kg^0.5.m",
        "Modal displacement of a mode of the appendages: a point with the mode shape phi, kg^-0.5, moves by phi eta relative to the craft")
        .shape(PER_APPENDAGE).nominal(0.1).reinit().depends_on(&["appendage[].eta[]"]).initial_depends_on(DEFORMED),
    V::state("appendage[].eta_dot", |n| index::ETA_DOT + n, "kg^0.5.m/s",
        "Rate of appendage[].eta")
        .shape(PER_APPENDAGE).nominal(0.1).reinit().depends_on(&["appendage[].eta_dot[]"]).initial_depends_on(DEFORMED),

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
    V::derivative("der(tank[].spin)", |n| index::spin(n / 3) + n % 3, "N.m", "Derivative of tank[].spin")
        .shape(TANK_VECTOR).depends_on(&["omega", "tank[].p", "tank[].p_dot", "tank[].spin"]).initial_depends_on(SPINS),

    V::derivative("der(appendage[].eta)", |n| index::ETA + n, "kg^0.5.m/s", "Derivative of appendage[].eta: appendage[].eta_dot")
        .shape(PER_APPENDAGE).depends_on(&["appendage[].eta_dot"]).initial_depends_on(DEFORMED),
    V::derivative("der(appendage[].eta_dot)", |n| index::ETA_DOT + n, "kg^0.5.m/s2", "Derivative of appendage[].eta_dot")
        .shape(PER_APPENDAGE).depends_on(MOTION).initial_depends_on(EVERYTHING),

    // The dry craft
    V::parameter("craft.mass", |p, _| &mut p.craft.mass, "kg", "Mass of the dry craft, wheels and appendages included")
        .range(1e-6, 1e12),
    V::parameter("craft.r", |p, n| &mut p.craft.r[n], "m", "Centre of mass of the dry craft from O, body axes")
        .shape(VECTOR).range(-1e4, 1e4),
    V::parameter("craft.Jxx", |p, _| &mut p.craft.j.xx, "kg.m2", "Moment of inertia of the dry craft about its centre of mass, body x axis")
        .range(1e-9, 1e12),
    V::parameter("craft.Jyy", |p, _| &mut p.craft.j.yy, "kg.m2", "Moment of inertia of the dry craft about its centre of mass, body y axis")
        .range(1e-9, 1e12),
    V::parameter("craft.Jzz", |p, _| &mut p.craft.j.zz, "kg.m2", "Moment of inertia of the dry craft about its centre of mass, body z axis")
        .range(1e-9, 1e12),
    V::parameter("craft.Jxy", |p, _| &mut p.craft.j.xy, "kg.m2", "Product of inertia of the dry craft about its centre of mass, body axes: minus the integral of x y dm"),
    V::parameter("craft.Jxz", |p, _| &mut p.craft.j.xz, "kg.m2", "Product of inertia of the dry craft about its centre of mass, body axes: minus the integral of x z dm"),
    V::parameter("craft.Jyz", |p, _| &mut p.craft.j.yz, "kg.m2", "Product of inertia of the dry craft about its centre of mass, body axes: minus the integral of y z dm"),
    V::choice("mount", &MOUNT, |p, _| p.mount as i32, |p, _, n| p.mount = if n == 2 { craft::Mount::Pivot } else { craft::Mount::Free },
        "Support of the craft: free flight or a pivot at O"),
    V::integer("mount_kind", |p, _| &mut p.mount_kind,
        "mount as an integer, for hosts that cannot set enumerations: 0 takes mount, other values are its item numbers. Setting mount to a different item is an error")
        .between(0, MOUNT.items.len() as i32),
    V::parameter("gravity", |p, n| &mut p.gravity[n], "m/s2", "Uniform gravity, inertial axes; acts only on a pivot")
        .shape(VECTOR).range(-1e4, 1e4),
    V::parameter("pivot.k", |p, n| &mut p.pivot.k[n], "N.m/rad",
        "Stiffness of the pivot about the body's x and y axes, against tilt of the body's z axis from the inertial z axis")
        .shape(&[Fixed(2)]).range(0.0, 1e12),
    V::parameter("pivot.c", |p, n| &mut p.pivot.c[n], "N.m.s/rad",
        "Damping coefficient of the pivot about each body axis, against omega")
        .shape(VECTOR).range(0.0, 1e12),
    V::parameter("pivot.friction.c", |p, n| &mut p.pivot.friction.c[n], "N.m",
        "Coulomb friction torque of the pivot about each body axis, against the sign of omega")
        .display_unit("mN.m").shape(VECTOR).range(0.0, 1e12),
    V::parameter("pivot.friction.d", |p, n| &mut p.pivot.friction.d[n], "N.m",
        "Static friction torque of the pivot in excess of the Coulomb torque, about each body axis")
        .display_unit("mN.m").shape(VECTOR).range(0.0, 1e12),
    V::parameter("pivot.friction.omega_s", |p, _| &mut p.pivot.friction.omega_s, "rad/s",
        "Stribeck speed of the pivot: the excess friction falls with exp(-(omega/omega_s)^2)")
        .display_unit("deg/s").range(1e-6, 1e6),
    V::parameter("pivot.friction.eps", |p, _| &mut p.pivot.friction.eps, "rad/s",
        "Width of the smoothed sign function tanh(omega/eps) of the pivot; an axis that would stick creeps more slowly than this")
        .display_unit("deg/s").range(1e-7, 1e3),
    V::integer("tanks", |p, _| &mut p.tanks, "Number of tanks")
        .between(0, TANKS as i32),

    // Each tank
    V::parameter("tank[].position", |p, n| &mut p.tank[n / 3].position[n % 3], "m",
        "Position of the tank's origin from O, body axes")
        .shape(TANK_VECTOR).range(-1e4, 1e4),
    V::parameter("tank[].q", |p, n| &mut p.tank[n / 4].q[n % 4], "1",
        "Attitude quaternion of the tank, scalar first, tank to body axes; the FMU normalises it")
        .shape(&[TANK, Fixed(4)]),
    V::parameter("tank[].diameter", |p, n| &mut p.tank[n].diameter, "m", "Diameter of an upright cylindrical tank, whose origin is the centre of its bottom; 0: not a cylinder. Above 0, potential flow gives m_0, H_0, I_0 and each mode's mass, length, hinge and wave from diameter, depth and density")
        .display_unit("mm").shape(PER_TANK).range(0.0, 1e3),
    V::parameter("tank[].depth", |p, n| &mut p.tank[n].depth, "m", "Fill height of the liquid in the cylinder, used if diameter is above 0")
        .display_unit("mm").shape(PER_TANK).range(1e-3, 1e3),
    V::parameter("tank[].density", |p, n| &mut p.tank[n].density, "kg/m3", "Density of the liquid, used if diameter is above 0")
        .shape(PER_TANK).range(1e-3, 1e5),
    V::parameter("tank[].m_0", |p, n| &mut p.tank[n].m_0, "kg", "Mass of the rigid liquid, which moves with the tank; below 0 only with planar modes (direction)")
        .shape(PER_TANK),
    V::parameter("tank[].H_0", |p, n| &mut p.tank[n].h_0, "m", "Height of the rigid liquid's centre of mass on the tank's axis")
        .shape(PER_TANK),
    V::parameter("tank[].I_0", |p, n| &mut p.tank[n].i_0, "kg.m2", "Moment of inertia of the rigid liquid about its centre of mass, across the tank's axis (with dI_y: about the tank's x axis); below 0 only with planar modes (direction)")
        .shape(PER_TANK),
    V::parameter("tank[].I_z", |p, n| &mut p.tank[n].i_z, "kg.m2", "Moment of inertia of the rigid liquid about its centre of mass, along the tank's axis; below 0 only with planar modes (direction)")
        .shape(PER_TANK),
    V::parameter("tank[].r_0", |p, n| &mut p.tank[n / 2].r_0[n % 2], "m", "Offset of the rigid liquid's centre of mass from the tank's axis, along the tank's x and y axes")
        .shape(&[TANK, Fixed(2)]),
    V::parameter("tank[].dI_y", |p, n| &mut p.tank[n].di_y, "kg.m2", "Moment of inertia of the rigid liquid about the tank's y axis minus I_0")
        .shape(PER_TANK).range(-1e12, 1e12),
    V::parameter("tank[].I_xy", |p, n| &mut p.tank[n].products[0], "kg.m2", "Product of inertia of the rigid liquid about its centre of mass, tank axes: minus the integral of x y dm")
        .shape(PER_TANK).range(-1e12, 1e12),
    V::parameter("tank[].I_xz", |p, n| &mut p.tank[n].products[1], "kg.m2", "Product of inertia of the rigid liquid about its centre of mass, tank axes: minus the integral of x z dm")
        .shape(PER_TANK).range(-1e12, 1e12),
    V::parameter("tank[].I_yz", |p, n| &mut p.tank[n].products[2], "kg.m2", "Product of inertia of the rigid liquid about its centre of mass, tank axes: minus the integral of y z dm")
        .shape(PER_TANK).range(-1e12, 1e12),
    V::integer("tank[].modes", |p, n| &mut p.modes[n], "Number of slosh modes of the tank")
        .between(0, MODES as i32).shape(PER_TANK),
    V::parameter("tank[].g_ref", |p, n| &mut p.tank[n].g_ref, "m/s2", "Specific force along the tank's axis at which zeta and frequency hold")
        .shape(PER_TANK).range(1e-9, 1e6),
    V::parameter("tank[].mass", |p, n| &mut p.tank[n / MODES].mass[n % MODES], "kg", "Mass of a slosh mode's pendulum (modal mass)")
        .shape(PER_MODE).range(1e-9, 1e9),
    V::parameter("tank[].length", |p, n| &mut p.tank[n / MODES].length[n % MODES], "m", "Length of a slosh mode's pendulum")
        .shape(PER_MODE).range(1e-6, 1e4),
    V::parameter("tank[].frequency", |p, n| &mut p.tank[n / MODES].frequency[n % MODES], "Hz",
        "Natural frequency of a slosh mode with the tank held, at g_ref; above 0 it replaces length: (2 pi f)^2 = g_ref/l + k/m")
        .shape(PER_MODE).range(0.0, 1e6),
    V::parameter("tank[].hinge", |p, n| &mut p.tank[n / MODES].hinge[n % MODES], "m", "Height of a slosh mode's hinge on the tank's axis")
        .shape(PER_MODE),
    V::parameter("tank[].direction", |p, n| &mut p.tank[n / (2 * MODES)].direction[n / 2 % MODES][n % 2], "1",
        "Direction in which a slosh mode moves its mass, x and y in tank axes; the FMU normalises it. The mode is then planar: its bob swings in the plane of this direction and the tank's axis and moves with the tank across it. The default 0, 0 lets the mode swing in every direction")
        .shape(MODE_PAIR),
    V::parameter("tank[].arm", |p, n| &mut p.tank[n / MODES].arm[n % MODES], "m",
        "Distance of a planar mode's plane from the tank's axis: lever arm about the axis of a momentum in the mode's direction")
        .shape(PER_MODE),
    V::parameter("tank[].k", |p, n| &mut p.tank[n / MODES].k[n % MODES], "N/m", "Centring stiffness of a slosh mode at its bob (capillarity, diaphragm)")
        .shape(PER_MODE).range(0.0, 1e12),
    V::parameter("tank[].zeta", |p, n| &mut p.tank[n / MODES].zeta[n % MODES], "1", "Damping ratio of a slosh mode at g_ref; its drag coefficient there is 2 zeta m sqrt(g_ref/l + k/m). For other specific forces see tank[].damping_law")
        .shape(PER_MODE).range(0.0, 10.0),
    V::choice("tank[].damping_law", &DAMPING_LAW, |p, n| p.tank[n].damping_law as i32, set_damping_law,
        "Damping law: dependence of a mode's drag coefficient on its natural frequency, hence on the specific force along the tank's axis")
        .shape(PER_TANK),
    V::integer("tank[].damping_law_kind", |p, n| &mut p.damping_law_kind[n],
        "tank[].damping_law as an integer, for hosts that cannot set enumerations: 0 takes tank[].damping_law, other values are its item numbers. Setting tank[].damping_law to a different item is an error")
        .between(0, DAMPING_LAW.items.len() as i32).shape(PER_TANK),
    V::parameter("tank[].g_floor", |p, n| &mut p.tank[n].g_floor, "m/s2", "Specific force along the tank's axis around which the drag stops following it; 0: 1e-4 g_ref")
        .shape(PER_TANK).range(0.0, 1e6),
    V::parameter("tank[].zeta_amplitude", |p, n| &mut p.tank[n / MODES].zeta_amplitude[n % MODES], "1/rad", "Growth of a mode's damping ratio with its amplitude A: zeta(A) = zeta + zeta_amplitude A; A combines angle and rate over natural frequency in both directions")
        .shape(PER_MODE).range(0.0, 10.0),
    V::parameter("tank[].zeta_breaking", |p, n| &mut p.tank[n / MODES].zeta_breaking[n % MODES], "1", "Growth of a mode's damping ratio with the steepness k a of its wave, where waves break. It adds zeta_breaking max(0, k a - breaking_steepness) to zeta(A), with a rounded corner. 0: waves do not break. Measured values in water are 0.03 to 0.09")
        .shape(PER_MODE).range(0.0, 10.0),
    V::parameter("tank[].breaking_steepness", |p, n| &mut p.tank[n / MODES].breaking_steepness[n % MODES], "1", "Steepness k a at which a mode's waves begin to break: wave number k times elevation a at the wall. The FMU takes the k a of an upright cylinder, in mode 1 1.54 times the slosh angle in rad. For a box set 1.21 times its steepness. Measured values in water are 0.60 to 0.66. Above 0 the mode is out of range beyond it (limited_by = breaking), and it has no other effect if zeta_breaking is 0")
        .shape(PER_MODE).range(0.0, 10.0),
    V::parameter("tank[].nonlinear_inertia", |p, n| &mut p.tank[n / MODES].nonlinear_inertia[n % MODES], "1", "Third-order coefficient s of a slosh mode's inertia. The slosh angle A changes the frequency of a planar wave by the share (3 kappa/8 - s/2) A^2/2. The default, a pendulum, is 1. A negative value, for shallow liquid, bounds the slosh angle")
        .shape(PER_MODE).range(-1e3, 1e3),
    V::parameter("tank[].nonlinear_stiffness", |p, n| &mut p.tank[n / MODES].nonlinear_stiffness[n % MODES], "1", "Third-order coefficient kappa of a slosh mode's stiffness. The slosh angle A changes the frequency of a rotary wave by the share (kappa/4 - t) A^2, with t = rotary_inertia. The default, a pendulum, is 1")
        .shape(PER_MODE).range(-1e3, 1e3),
    V::parameter("tank[].nonlinear_inertia_2", |p, n| &mut p.tank[n / MODES].nonlinear_inertia_2[n % MODES], "1", "Coefficient s_2 of a slosh mode beyond the third order: kinetic energy m s_2 |q|^2 (q.q')^2/(2 l^4) with the displacement q and the length l. 0 for a pendulum; tanks with a fill table have none")
        .shape(PER_MODE).range(-1e5, 1e5),
    V::parameter("tank[].nonlinear_stiffness_2", |p, n| &mut p.tank[n / MODES].nonlinear_stiffness_2[n % MODES], "1", "Coefficient kappa_2 of a slosh mode beyond the third order: the bob is l kappa_2 (|q|/l)^6/16 higher. 0 for a pendulum; tanks with a fill table have none")
        .shape(PER_MODE).range(-1e5, 1e5),
    V::parameter("tank[].rotary_inertia", |p, n| &mut p.tank[n / MODES].rotary_inertia[n % MODES], "1", "Coefficient t of a slosh mode's rotary motion: kinetic energy m t (q x q')^2/(2 l^2), with q' against axes that do not turn about the tank's axis. The slosh angle A changes the frequency of a rotary wave by the share (kappa/4 - t) A^2. 0 for a pendulum; tanks with a fill table have none")
        .shape(PER_MODE).range(-1e5, 1e5),
    V::parameter("tank[].rotary_inertia_2", |p, n| &mut p.tank[n / MODES].rotary_inertia_2[n % MODES], "1", "Coefficient t_2 of a slosh mode's rotary motion: kinetic energy m t_2 |q|^2 (q x q')^2/(2 l^4). 0 for a pendulum; tanks with a fill table have none")
        .shape(PER_MODE).range(-1e5, 1e5),
    V::parameter("tank[].gyroscopic", |p, n| &mut p.tank[n / MODES].gyroscopic[n % MODES], "1", "Gyroscopic coefficient C of a slosh mode in liquid that spins at the rate W = tank[i].spin[3]/spin_inertia. Seen from the tank a wave has the frequencies C W +- sqrt(C^2 W^2 + omega_0^2), against the spin and with it. C is 0.42 in deep and 0.84 in shallow liquid. 1 with gyroscopic_stiffness 0: a pendulum in space, which takes no part in the spin. Without effect if spin_inertia is 0; not for planar modes")
        .shape(PER_MODE).range(-10.0, 10.0),
    V::parameter("tank[].gyroscopic_stiffness", |p, n| &mut p.tank[n / MODES].gyroscopic_stiffness[n % MODES], "1", "Stiffness that the spin of the liquid adds to a slosh mode with gyroscopic other than 1: its share of W^2 in omega_0^2 + gyroscopic_stiffness W^2, which replaces omega_0^2 in the frequencies")
        .shape(PER_MODE).range(-1e3, 1e3),
    V::parameter("tank[].angle_limit", |p, n| &mut p.tank[n / MODES].angle_limit[n % MODES], "rad", "Slosh angle above which a mode is out of range (limited_by = third_order): the smaller of the angles at which its frequency errs by 0.3 % and a forced response by 3 %. 0: not known; mode 1 of a tank with diameter above 0 then has that of an upright cylinder")
        .display_unit("deg").shape(PER_MODE).range(0.0, 1.6),
    V::parameter("tank[].swirl_limit", |p, n| &mut p.tank[n / MODES].swirl_limit[n % MODES], "rad", "Slosh angle above which rotary motion of a mode is out of range (limited_by = secondary_resonance), because its branch folds by a secondary resonance. 0: not known; mode 1 of a tank with diameter above 0 then has that of an upright cylinder")
        .display_unit("deg").shape(PER_MODE).range(0.0, 1.6),
    V::parameter("tank[].g_bond", |p, n| &mut p.tank[n].g_bond, "m/s2", "Specific force along the tank's axis below which surface tension matters that the parameters do not include (limited_by = bond_number); 0: not known")
        .shape(PER_TANK).range(0.0, 1e6),
    V::parameter("tank[].wave", |p, n| &mut p.tank[n / MODES].wave[n % MODES], "m", "Surface elevation at the wall per slosh angle of a slosh mode, used for wave_height only")
        .shape(PER_MODE).range(0.0, 1e9),
    V::parameter("tank[].ball.travel", |p, n| &mut p.tank[n].ball.travel, "m",
        "Distance along the tank's axis that the detached liquid's centre can move, from bottom to top; 0: the liquid never detaches. Above 0, all liquid becomes one body if thrust pulls it off the bottom or the bobs pass 45 degrees (mean by modal mass). The liquid flies, bounces off the wall and settles. Allowed on a free craft without draining tanks, in a tank with modes")
        .display_unit("mm").shape(PER_TANK).range(0.0, 1e3),
    V::parameter("tank[].ball.radius", |p, n| &mut p.tank[n].ball.radius, "m",
        "Largest distance of the detached liquid's centre from the tank's axis; 0: the surface within reach has, at the bottom, the curvature of the path of the pendulums' common centre")
        .display_unit("mm").shape(PER_TANK).range(0.0, 1e3),
    V::parameter("tank[].ball.restitution", |p, n| &mut p.tank[n].ball.restitution, "1",
        "Coefficient of restitution of the detached liquid's impacts on the wall: normal speed after over before; a guess unless measured")
        .shape(PER_TANK).range(0.0, 1.0),
    V::parameter("tank[].ball.contact_speed", |p, n| &mut p.tank[n].ball.contact_speed, "m/s",
        "Speed after an impact below which detached liquid that is pressed to the wall stays on it")
        .shape(PER_TANK).range(1e-9, 1e3),
    V::parameter("tank[].ball.drag", |p, n| &mut p.tank[n].ball.drag, "1/s",
        "Rate at which the detached liquid's speed along the wall decays while it slides; a guess unless measured")
        .shape(PER_TANK).range(0.0, 1e3),
    V::parameter("tank[].spin_inertia", |p, n| &mut p.tank[n].spin_inertia, "kg.m2",
        "Inertia of the liquid that spins with the tank about its axis, for example that of the whole liquid as a solid; 0: the liquid has no spin. Above 0, the liquid has the states tank[].spin, and I_z should be 0. Allowed in a tank with fill.points = 0 and ball.travel = 0")
        .shape(PER_TANK).range(0.0, 1e12),
    V::parameter("tank[].spin_inertia_across", |p, n| &mut p.tank[n].spin_inertia_across, "kg.m2",
        "Inertia of the liquid's spin across the tank's axis, m (a^2 + c^2)/5 in a full spheroid with the semi-axes a, a, c; 0: spin_inertia")
        .shape(PER_TANK).range(0.0, 1e12),
    V::parameter("tank[].spin_coupling", |p, n| &mut p.tank[n].spin_coupling, "1",
        "Share of the spin across the tank's axis that belongs to the angular momentum: 2 a c/(a^2 + c^2) in a full spheroid with the semi-axes a, a, c, 1 in a partly full tank")
        .shape(PER_TANK).range(0.0, 1.0),
    V::parameter("tank[].spin_decay", |p, n| &mut p.tank[n / 2].spin_decay[n % 2], "1/s",
        "Rate at which wall friction decreases the rotation of the liquid against the tank, about its axis and across it: about sqrt(nu Omega)/R times 2.9 and 2.6 in a full sphere")
        .shape(&[TANK, Fixed(2)]).range(0.0, 1e3),
    V::parameter("tank[].slip_0", |p, n| &mut p.tank[n / 3].slip_0[n % 3], "rad/s",
        "Rotation of the liquid against the tank at the start, tank axes; 0: the liquid rotates with the tank")
        .display_unit("deg/s").shape(TANK_VECTOR).range(-1e3, 1e3),
    V::integer("tank[].fill.points", |p, n| &mut p.points[n], "Number of points in the tank's fill table; 0: the liquid stays. From 2 on the tank can drain, and the table gives its modes and rigid liquid, interpolated monotonically with two continuous derivatives. The start values are the default tank at depths of 0.1 to 1.2 m")
        .between(0, POINTS as i32).shape(PER_TANK),
    V::parameter("tank[].liquid_0", |p, n| &mut p.tank[n].liquid_0, "kg", "Mass of the whole liquid at the start, used if fill.points is above 0")
        .shape(PER_TANK).range(0.0, 1e9),
    V::parameter("tank[].outlet", |p, n| &mut p.tank[n].outlet, "m", "Height of the outlet on the tank's axis, used if fill.points is above 0")
        .shape(PER_TANK).range(-1e4, 1e4),
    V::parameter("tank[].fill.liquid", |p, n| &mut p.tank[n / POINTS].fill.liquid[n % POINTS], "kg", "Mass of the whole liquid at each point of the fill table, increasing")
        .shape(TABLE_OF_TANK).range(0.0, 1e9),
    V::parameter("tank[].fill.H_0", |p, n| &mut p.tank[n / POINTS].fill.h_0[n % POINTS], "m", "H_0 at each point of the fill table")
        .shape(TABLE_OF_TANK),
    V::parameter("tank[].fill.I_0", |p, n| &mut p.tank[n / POINTS].fill.i_0[n % POINTS], "kg.m2", "I_0 at each point of the fill table")
        .shape(TABLE_OF_TANK).range(0.0, 1e12),
    V::parameter("tank[].fill.I_z", |p, n| &mut p.tank[n / POINTS].fill.i_z[n % POINTS], "kg.m2", "I_z at each point of the fill table")
        .shape(TABLE_OF_TANK).range(0.0, 1e12),
    V::parameter("tank[].fill.mass", |p, n| { let (i, m, k) = point(n); &mut p.tank[i].fill.mass[m][k] }, "kg", "Mass of a slosh mode's pendulum (modal mass) at each point of the fill table")
        .shape(TABLE_OF_MODE).range(0.0, 1e9),
    V::parameter("tank[].fill.length", |p, n| { let (i, m, k) = point(n); &mut p.tank[i].fill.length[m][k] }, "m", "Length of a slosh mode's pendulum at each point of the fill table")
        .shape(TABLE_OF_MODE).range(0.0, 1e4),
    V::parameter("tank[].fill.hinge", |p, n| { let (i, m, k) = point(n); &mut p.tank[i].fill.hinge[m][k] }, "m", "Height of a slosh mode's hinge on the tank's axis at each point of the fill table")
        .shape(TABLE_OF_MODE),
    V::parameter("tank[].fill.zeta", |p, n| { let (i, m, k) = point(n); &mut p.tank[i].fill.zeta[m][k] }, "1", "Damping ratio of a slosh mode at g_ref at each point of the fill table; 0 at all points of a mode: zeta at every fill")
        .shape(TABLE_OF_MODE).range(0.0, 10.0),
    V::parameter("tank[].fill.nonlinear_inertia", |p, n| { let (i, m, k) = point(n); &mut p.tank[i].fill.nonlinear_inertia[m][k] }, "1", "Third-order coefficient s (nonlinear_inertia) of a slosh mode at each point of the fill table. If s and kappa of a mode are 1 at all points, nonlinear_inertia and nonlinear_stiffness hold at every fill")
        .shape(TABLE_OF_MODE).range(-1e3, 1e3),
    V::parameter("tank[].fill.nonlinear_stiffness", |p, n| { let (i, m, k) = point(n); &mut p.tank[i].fill.nonlinear_stiffness[m][k] }, "1", "Third-order coefficient kappa (nonlinear_stiffness) of a slosh mode at each point of the fill table; see fill.nonlinear_inertia")
        .shape(TABLE_OF_MODE).range(-1e3, 1e3),
    V::parameter("tank[].fill.angle_limit", |p, n| { let (i, m, k) = point(n); &mut p.tank[i].fill.angle_limit[m][k] }, "rad", "angle_limit of a slosh mode at each point of the fill table, interpolated linearly; 0 where it is not known, then angle_limit holds")
        .display_unit("deg").shape(TABLE_OF_MODE).range(0.0, 1.6),
    V::parameter("tank[].fill.swirl_limit", |p, n| { let (i, m, k) = point(n); &mut p.tank[i].fill.swirl_limit[m][k] }, "rad", "swirl_limit of a slosh mode at each point of the fill table, likewise")
        .display_unit("deg").shape(TABLE_OF_MODE).range(0.0, 1.6),
    V::parameter("tank[].p_0", |p, n| { let (i, m, k) = place(n); &mut p.tank[i].p_0[m][k] }, "1",
        "Unit vector from hinge to bob at the start, tank axes; the FMU normalises it, for a planar mode within its plane")
        .shape(MODE_VECTOR),
    V::parameter("tank[].p_dot_0", |p, n| { let (i, m, k) = place(n); &mut p.tank[i].p_dot_0[m][k] }, "1/s",
        "Rate of the unit vector from hinge to bob at the start, tank axes; the FMU keeps its tangential part")
        .shape(MODE_VECTOR),

    // Each mode of the flexible appendages
    V::integer("appendages", |p, _| &mut p.appendages, "Number of modes of flexible appendages that are used, with the interface held and unit modal mass (Craig-Bampton). Modes without participation have no effect. Mass and inertia of the undeformed appendages belong to craft.mass, craft.r and craft.Jxx to craft.Jyz")
        .between(0, APPENDAGES as i32),
    V::parameter("appendage[].position", |p, n| &mut p.appendage[n / 3].position[n % 3], "m", "Position of the point from O at which a mode's appendage is attached, body axes; modes of one appendage share it")
        .shape(APPENDAGE_VECTOR).range(-1e4, 1e4),
    V::parameter("appendage[].frequency", |p, n| &mut p.appendage[n].frequency, "Hz", "Natural frequency of a mode with the interface held")
        .shape(PER_APPENDAGE).range(1e-6, 1e6),
    V::parameter("appendage[].zeta", |p, n| &mut p.appendage[n].zeta, "1", "Damping ratio of a mode with the interface held")
        .shape(PER_APPENDAGE).range(0.0, 10.0),
    V::parameter("appendage[].participation", |p, n| &mut p.appendage[n / 6].participation[n % 6], "kg^0.5", "Participation of a mode with unit modal mass, body axes: 1 to 3 in translation, kg^0.5, the integral of the mode shape over the mass; 4 to 6 in rotation about appendage[].position, kg^0.5.m. Their squares are the effective masses and inertias")
        .shape(&[Used("appendages", APPENDAGES), Fixed(6)]).range(-1e6, 1e6),
    V::parameter("appendage[].eta_0", |p, n| &mut p.appendage[n].eta, "kg^0.5.m", "appendage[].eta at the start")
        .shape(PER_APPENDAGE).range(-1e9, 1e9),
    V::parameter("appendage[].eta_dot_0", |p, n| &mut p.appendage[n].eta_dot, "kg^0.5.m/s", "appendage[].eta_dot at the start")
        .shape(PER_APPENDAGE).range(-1e9, 1e9),

    // Initial conditions
    V::parameter("init.q", |p, n| &mut p.init.q[n], "1", "q at the start; the FMU normalises it")
        .shape(QUATERNION),
    V::parameter("init.omega", |p, n| &mut p.init.omega[n], "rad/s",
        "omega at the start")
        .display_unit("deg/s").shape(VECTOR).range(-1e3, 1e3),
    V::parameter("init.position", |p, n| &mut p.init.position[n], "m", "position at the start")
        .shape(VECTOR),
    V::parameter("init.velocity", |p, n| &mut p.init.velocity[n], "m/s", "velocity at the start")
        .shape(VECTOR),

    // Solver
    V::count("solver.max_steps", |p, _| p.max_steps as i32, |p, _, n| p.max_steps = n.max(0) as usize,
        "Largest number of internal steps in one communication step; a step that needs more is refused")
        .between(1, 1_000_000_000),
];

fn set_damping_law(p: &mut Parameters, tank: usize, number: i32) {
    if let Some(law) = usize::try_from(number - 1).ok().and_then(|i| DampingLaw::ALL.get(i)) {
        p.tank[tank].damping_law = *law;
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

static MOUNT: Enumeration = Enumeration {
    name: "Mount",
    description: "Support of the craft",
    items: &[
        Item::new("free", "Free flight: position and velocity are those in a freely falling frame"),
        Item::new(
            "pivot",
            "O rests on a bearing in uniform gravity; the craft turns about it, freely unless pivot.k, pivot.c or pivot.friction is set",
        ),
    ],
};

const _: () = assert!(STATES == index::SPINS + 3 * TANKS + 2 * APPENDAGES);

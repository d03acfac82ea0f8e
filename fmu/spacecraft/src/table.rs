//! All variables of Spacecraft.fmu. The start values are those of `craft::Parameters::default()`, with the craft at rest.
//!
//! Array elements have structured names as FMI defines them: the elements of `tank[].p` with the shape 4, 3, 3 are
//! `tank[1].p[1,1]`, … with the indices tank, mode, axis.

use craft::{APPENDAGES, MODES, STATES, State, TANKS, index};
use runtime::table::{About, Scalar, Table, join, scalar_count, scalars};
use runtime::variable::Dimension::{Fixed, Sized, Used};
use runtime::variable::{Dimension, Enumeration, Item, Variable};
use tank_variables::{BALL_STATE, Tanks, ball_state, place, tank_locals, tank_parameters};

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

// Inputs and states on which outputs depend directly. The accelerations depend on all forces. Tension, drag and centring force of
// the pendulums depend on their directions and rates, and gravity on a pivot depends on the attitude.
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
// Parameters and inputs on which initial values depend.
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

fn bob(n: usize) -> usize {
    let (tank, mode, axis) = place(n);
    index::bob(tank, mode) + axis
}

fn ball(n: usize) -> usize {
    index::ball(n / 3) + n % 3
}

type V = Variable<Model>;

impl Tanks for Model {
    fn tank(p: &Parameters, i: usize) -> &craft::Tank {
        &p.tank[i]
    }

    fn tank_mut(p: &mut Parameters, i: usize) -> &mut craft::Tank {
        &mut p.tank[i]
    }

    fn tank_now(o: &craft::Outputs, i: usize) -> &craft::TankOutputs {
        &o.tank[i]
    }

    fn modes(p: &mut Parameters, i: usize) -> &mut i32 {
        &mut p.modes[i]
    }

    fn points(p: &mut Parameters, i: usize) -> &mut i32 {
        &mut p.points[i]
    }

    fn damping_law_kind(p: &mut Parameters, i: usize) -> &mut i32 {
        &mut p.damping_law_kind[i]
    }
}

static VARIABLES: &[V] = &join::<
    _,
    { OUTPUTS.len() + TANK_LOCALS.len() + MOTIONS.len() + TANK_PARAMETERS.len() + OTHERS.len() },
>(&[OUTPUTS, TANK_LOCALS, MOTIONS, TANK_PARAMETERS, OTHERS]);

const TANK_LOCALS: &[V] = &tank_locals!(Model, "tank[]", [TANK], ANGLES, MOTION);

const TANK_PARAMETERS: &[V] = &tank_parameters!(
    Model,
    "tank[]",
    [TANK],
    MODE,
    "body axes",
    "Allowed on a free craft without draining tanks, in a tank with modes"
);

#[rustfmt::skip]
const OUTPUTS: &[V] = &[
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
];

#[rustfmt::skip]
const MOTIONS: &[V] = &[
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
];

#[rustfmt::skip]
const OTHERS: &[V] = &[
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

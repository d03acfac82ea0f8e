//! All variables of SloshTank.fmu. The start values are those of `craft::TankParameters::default()`, with the
//! carrying craft at rest.

use craft::{Coupling, MODES, TRIANGLE, TankState};
use runtime::table::{About, Scalar, Table, join, scalar_count, scalars};
use runtime::variable::Dimension::{Fixed, Sized};
use runtime::variable::{Dimension, Enumeration, Item, Variable};
use tank_variables::{BALL_STATE, Tanks, ball_state, tank_locals, tank_parameters};

use crate::model::{Model, Parameters};

pub static TABLE: Table<Model> = Table::new(
    About {
        model: "SloshTank",
        version: env!("CARGO_PKG_VERSION"),
        description: "One tank of sloshing liquid on a spacecraft that the host simulates: its force and torque, \
                      and the added mass with which the host needs no algebraic loop",
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

// With coupling = split the added mass depends neither on a nor on omega_dot, and the bias depends on them only weakly, through
// the drag. If the importer computes both from its last a, there is therefore no algebraic loop. With the other couplings the
// bias contains a and omega_dot of the previous step.
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
// Inputs and states on which tank.in_range depends directly.
const MOTION: &[&str] =
    &["tank.p", "tank.p_dot", "tank.liquid", "tank.spin", "a", "omega", "omega_dot"];

const MODE: Dimension = Sized("tank.modes", MODES);
const VECTOR: &[Dimension] = &[Fixed(3)];
const PER_MODE: &[Dimension] = &[MODE];
const MODE_VECTOR: &[Dimension] = &[MODE, Fixed(3)];

fn bob(n: usize) -> usize {
    6 * (n / 3) + n % 3
}

const DISSIPATED: usize = 6 * MODES;
const LIQUID: usize = DISSIPATED + 1;
const BALL: usize = LIQUID + 1;
const SPIN: usize = BALL + 6;

fn set_coupling(p: &mut Parameters, _: usize, number: i32) {
    if let Some(coupling) = usize::try_from(number - 1).ok().and_then(|i| Coupling::ALL.get(i)) {
        p.coupling = *coupling;
    }
}

type V = Variable<Model>;

impl Tanks for Model {
    fn tank(p: &Parameters, _: usize) -> &craft::Tank {
        &p.tank
    }

    fn tank_mut(p: &mut Parameters, _: usize) -> &mut craft::Tank {
        &mut p.tank
    }

    fn tank_now(o: &craft::SloshTankOutputs, _: usize) -> &craft::TankOutputs {
        &o.tank
    }

    fn modes(p: &mut Parameters, _: usize) -> &mut i32 {
        &mut p.modes
    }

    fn points(p: &mut Parameters, _: usize) -> &mut i32 {
        &mut p.points
    }

    fn damping_law_kind(p: &mut Parameters, _: usize) -> &mut i32 {
        &mut p.damping_law_kind
    }
}

static VARIABLES: &[V] = &join::<
    _,
    { OUTPUTS.len() + TANK_LOCALS.len() + MOTIONS.len() + TANK_PARAMETERS.len() + OTHERS.len() },
>(&[OUTPUTS, TANK_LOCALS, MOTIONS, TANK_PARAMETERS, OTHERS]);

const TANK_LOCALS: &[V] = &tank_locals!(Model, "tank", [], &["tank.p"], MOTION);

const TANK_PARAMETERS: &[V] = &tank_parameters!(
    Model,
    "tank",
    [],
    MODE,
    "craft axes",
    "Requires coupling = split, host.mass and host.Jxx to host.Jyz, a tank with modes that does not drain, and a host that applies impulse"
);

#[rustfmt::skip]
const OUTPUTS: &[V] = &[
    // Outputs
    V::output("force", |o, n| o.tank.force[n], "N",
        "Force of the whole liquid (sloshing and rigid) on the host's craft, craft axes")
        .shape(VECTOR).depends_on(WRENCH).initial_depends_on(EVERYTHING),
    V::output("torque", |o, n| o.tank.torque[n], "N.m",
        "Torque of the whole liquid (sloshing and rigid) on the host's craft about O, craft axes")
        .shape(VECTOR).depends_on(WRENCH).initial_depends_on(EVERYTHING),
    V::output("bias", |o, n| o.bias[n], "",
        "Bias wrench for the right-hand side of the host's equations, craft axes: force (1 to 3, N) and torque about O (4 to 6, N.m). The wrench on the craft is bias - added_mass [a; omega_dot]. With coupling = split, bias depends on a and omega_dot only through the drag, by about 1e-4 of the bobs' mass times a change of a, so one evaluation is enough. With tank.damping_law = constant it depends on neither. With coupling = rigid_body it suits a host with the constant added_mass in its mass, centre of mass and inertia, also in centrifugal and gyroscopic terms")
        .shape(&[Fixed(6)]).depends_on(WRENCH).initial_depends_on(EVERYTHING),
    V::output("added_mass", |o, n| o.added_mass[n], "",
        "Symmetric 6 x 6 added-mass matrix about O for the left-hand side of the host's equations, craft axes, upper triangle by rows (kg, kg.m, kg.m2). With coupling = split it depends only on tank.p, tank.liquid and, for detached liquid, tank.ball.position. With coupling = lumped or rigid_body it is constant: the matrix of the rigid liquid and of each bob at its hinge, at the start. In this matrix the bob of a planar mode counts twice, with 2 m l^2 about the axes in its plane. A bob with nonlinear_inertia or nonlinear_stiffness counts twice, with 2 m r^2 about every axis (r: distance from the hinge)")
        .shape(&[Fixed(TRIANGLE)]).depends_on(PLACES).initial_depends_on(EVERYTHING),
    V::output("impulse", |o, n| o.impulse[n], "",
        "Sum of the impulses of detached liquid on the host's craft since the start, craft axes at the time of each: force (1 to 3, N.s) and torque about O (4 to 6, N.m.s). After each step or event the host adds M^-1 times the increase to the velocity and angular velocity of its craft, where M is the craft's 6 x 6 mass matrix about O (host.mass to host.Jyz). Always 0 if tank.ball.travel is 0")
        .shape(&[Fixed(6)]).depends_on(&[]),

    // Inputs
    V::input("a", |i, n| [&mut i.tank.a.value[n], &mut i.tank.a.slope[n]], "m/s2",
        "Specific force at O, as an accelerometer there measures it, craft axes. Held over a communication step unless an input derivative is set, which applies to one step")
        .shape(VECTOR).range(-1e9, 1e9),
    V::input("omega", |i, n| [&mut i.tank.omega[n], &mut i.omega_slope[n]], "rad/s",
        "Angular velocity of the host's craft relative to the inertial frame, craft axes, at the start of the step. Within the step it follows from omega_dot; unless it is set again, it continues from there")
        .display_unit("deg/s").shape(VECTOR).range(-1e9, 1e9).follows_inputs(),
    V::input("omega_dot", |i, n| [&mut i.tank.omega_dot.value[n], &mut i.tank.omega_dot.slope[n]], "rad/s2",
        "Angular acceleration of the host's craft relative to the inertial frame, craft axes. Held over a communication step unless an input derivative is set, which applies to one step")
        .display_unit("deg/s2").shape(VECTOR).range(-1e9, 1e9),
    V::input("mass_flow", |i, _| [&mut i.tank.mass_flow.value, &mut i.tank.mass_flow.slope], "kg/s",
        "Mass flow out of the tank, negative for inflow; it leaves with the tank's velocity at the outlet, and the host applies its thrust to the craft. The impulse of a jump of the flow is not modelled: ramp the flow. Without effect with tank.fill.points = 0")
        .range(-1e9, 1e9),

    // Locals
];

#[rustfmt::skip]
const MOTIONS: &[V] = &[
    V::local_enumeration("tank.ball.state", &BALL_STATE, |o, _| ball_state(o.tank.ball_state),
        "State of the liquid with tank.ball.travel above 0. Unless it is settled, no pendulum represents the liquid (in_range), and slosh angles and wave_height are 0")
        .depends_on(WRENCH),
    V::local("mass", |o, _| o.mass, "kg",
        "Mass of the whole liquid").depends_on(&["tank.liquid"]),
    V::local("center_of_mass", |o, n| o.center_of_mass[n], "m",
        "Centre of mass of the whole liquid from O, craft axes")
        .shape(VECTOR).depends_on(PLACES),
    V::local("inertia", |o, n| o.inertia[n / 3][n % 3], "kg.m2",
        "Inertia matrix of the whole liquid about its centre of mass, each bob a point mass at its current position, craft axes")
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
];

#[rustfmt::skip]
const OTHERS: &[V] = &[
    // Mass properties of the craft that carries the tank (optional)
    V::parameter("host.mass", |p, _| &mut p.host.mass, "kg", "Mass of the host's craft without this tank, for coupling_ratio and its warning and for the impulses of tank.ball.travel; 0: unknown")
        .range(0.0, 1e9),
    V::parameter("host.r", |p, n| &mut p.host.r[n], "m", "Centre of mass of the host's craft without this tank from O, craft axes")
        .shape(VECTOR).range(-1e4, 1e4),
    V::parameter("host.Jxx", |p, _| &mut p.host.j.xx, "kg.m2", "Moment of inertia of the host's craft without this tank about its centre of mass, craft x axis").at_least(0.0),
    V::parameter("host.Jyy", |p, _| &mut p.host.j.yy, "kg.m2", "Moment of inertia of the host's craft without this tank about its centre of mass, craft y axis").at_least(0.0),
    V::parameter("host.Jzz", |p, _| &mut p.host.j.zz, "kg.m2", "Moment of inertia of the host's craft without this tank about its centre of mass, craft z axis").at_least(0.0),
    V::parameter("host.Jxy", |p, _| &mut p.host.j.xy, "kg.m2", "Product of inertia of the host's craft without this tank about its centre of mass, craft axes: minus the integral of x y dm"),
    V::parameter("host.Jxz", |p, _| &mut p.host.j.xz, "kg.m2", "Product of inertia of the host's craft without this tank about its centre of mass, craft axes: minus the integral of x z dm"),
    V::parameter("host.Jyz", |p, _| &mut p.host.j.yz, "kg.m2", "Product of inertia of the host's craft without this tank about its centre of mass, craft axes: minus the integral of y z dm"),

    // Solver
    V::count("solver.max_steps", |p, _| p.max_steps as i32, |p, _, n| p.max_steps = n.max(0) as usize,
        "Largest number of internal steps in one communication step; a step that needs more is refused")
        .between(1, 1_000_000_000),

    // Calculated from the parameters
    V::calculated("coupling_ratio", |m, _| m.coupling_ratio(), "1",
        "Largest eigenvalue of the inverse mass matrix of the host's craft times the tank's added mass; 0 if host.mass is 0. A host that applies force and torque directly diverges, at any communication step, above 1 with held values and above 0.15 with extrapolated ones. It should use bias and added_mass")
        .initial_depends_on(&["tank.", "host."]),
];

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

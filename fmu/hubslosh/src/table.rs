//! All variables of HubSlosh.fmu.
//!
//! A variable exists if and only if it has an entry in this table. The model description, the value references, reading and
//! setting, start values, range checks, saved states and the GUID follow from the table. Start values come from
//! `plant::Parameters::default()`, with the liquid released at `model::START_ANGLE`, and from `plant::Inputs::default()`.
//!
//! The ranges exclude values that no plant can have, such as a negative inertia, and are wide otherwise. `Plant::new`
//! checks combinations of parameters.

use plant::{
    DampingLaw, FrictionModel, INDICATORS, LimitedBy, MODES, Ramp, SloshModel, SloshSource, x,
};
use runtime::table::{About, Scalar, Table, scalar_count, scalars};
use runtime::variable::Dimension::{Fixed, Sized};
use runtime::variable::{Dimension, Enumeration, Item, Variable};

use crate::model::{HubSlosh, SAVED_WORDS, set_item};

pub static TABLE: Table<HubSlosh> = Table::new(
    About {
        model: "HubSlosh",
        version: env!("CARGO_PKG_VERSION"),
        description: "A spacecraft hub on a bearing with dry friction that can stick, and on it a \
                      tank with sloshing liquid, a reaction wheel and a rate gyro",
        events: "Each time the hub sticks in its bearing or breaks away",
        event_indicators: INDICATORS,
        saved_words: SAVED_WORDS,
    },
    VARIABLES,
    &SCALARS,
);

impl runtime::Model for HubSlosh {
    fn table() -> &'static Table<Self> {
        &TABLE
    }
}

static SCALARS: [Scalar<HubSlosh>; scalar_count(VARIABLES)] = scalars(VARIABLES);

// Inputs and states on which outputs depend directly. The hub's acceleration depends on all torques, including the liquid's
// restoring force, which is proportional to g_axial. While the hub sticks, the friction torque depends on them as well.
// Forces and torques of the liquid contain the hub's acceleration. Hub angle and rate affect the friction, and wheel_speed
// affects the wheel's limits.
#[rustfmt::skip]
const ALL_TORQUES: &[&str] = &[
    "theta", "omega", "wheel_speed", "bristle",
    "slosh.q_radial", "slosh.q_tangential", "slosh.v_radial", "slosh.v_tangential",
    "tau_cmd", "tau_ext", "g_axial",
];
const HUB_AND_LIQUID: &[&str] =
    &["omega", "slosh.q_radial", "slosh.q_tangential", "slosh.v_radial", "slosh.v_tangential"];
#[rustfmt::skip]
const HEAT: &[&str] = &[
    "theta", "omega", "bristle",
    "slosh.q_radial", "slosh.q_tangential", "slosh.v_radial", "slosh.v_tangential",
    "g_axial",
];
#[rustfmt::skip]
const RANGE: &[&str] = &[
    "omega",
    "slosh.q_radial", "slosh.q_tangential", "slosh.v_radial", "slosh.v_tangential",
    "g_axial",
];
const MODE_1: &[&str] = &["slosh.q_radial[1]", "slosh.q_tangential[1]"];
const MODE_1_MOVING: &[&str] =
    &["slosh.q_radial[1]", "slosh.q_tangential[1]", "slosh.v_radial[1]", "slosh.v_tangential[1]"];
const WAVE_1: &[&str] = &[
    "slosh.q_radial[1]",
    "slosh.q_tangential[1]",
    "slosh.v_radial[1]",
    "slosh.v_tangential[1]",
    "g_axial",
];
// Parameters and inputs on which initial values depend. The damping depends on the initial g_axial.
#[rustfmt::skip]
const DYNAMICS: &[&str] = &[
    "tau_cmd", "tau_ext", "g_axial",
    "hub.", "tank.", "fluid.", "slosh.", "baffle.", "bench.", "friction.", "init.", "wheel.",
];
const LIQUID: &[&str] = &["tank.", "fluid.", "slosh."];
// On a tilted bench the modes depend on the tank's initial position relative to gravity.
const LIQUID_MODES: &[&str] = &["tank.", "fluid.", "slosh.", "bench.", "init.theta"];
// The plant stores positions and velocities relative to inertial axes. The conversion to and from angles couples the two
// directions in the last digit.
const SLOSH_START: &[&str] = &["tank.", "slosh.", "bench.", "init."];

const PER_MODE: &[Dimension] = &[Sized("slosh.modes", MODES)];
const TABLE_OF_MODES: &[Dimension] = &[Fixed(MODES)];

type V = Variable<HubSlosh>;

/// The variables of the FMU. The outputs come first and in a useful order, because importing tools plot all of them.
#[rustfmt::skip]
static VARIABLES: &[Variable<HubSlosh>] = &[
    // Outputs
    V::output("theta", |o, _| o.theta, "rad",
        "Hub angle about the bearing axis, positive counter-clockwise seen from above, not wrapped")
        .display_unit("deg").is_state(|_| x::THETA).depends_on(&["theta"]).initial_depends_on(&["init.theta"]),
    V::output("omega", |o, _| o.omega, "rad/s",
        "Hub angular rate about the bearing axis, derivative of theta")
        .display_unit("deg/s").nominal(0.01).is_state(|_| x::OMEGA).reinit().depends_on(&["omega"]).initial_depends_on(&["init.omega"]),
    V::output("omega_dot", |o, _| o.omega_dot, "rad/s2",
        "Hub angular acceleration about the bearing axis, derivative of omega; 0 while the hub sticks")
        .display_unit("deg/s2").depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),
    V::output("slosh_angle", |o, _| o.slosh_angle, "rad",
        "Tangential slosh angle of mode 1, positive when the liquid is displaced towards +theta; its sine is displacement over pendulum length")
        .display_unit("deg").nominal(0.1).depends_on(MODE_1).initial_depends_on(SLOSH_START),
    V::output("slosh_rate", |o, _| o.slosh_rate, "rad/s",
        "Derivative of slosh_angle")
        .display_unit("deg/s").depends_on(MODE_1_MOVING).initial_depends_on(SLOSH_START),
    V::output("slosh_angle_radial", |o, _| o.slosh_angle_radial, "rad",
        "Radial slosh angle of mode 1, positive when the liquid is displaced away from the bearing axis; 0 in planar models")
        .display_unit("deg").nominal(0.1).depends_on(MODE_1).initial_depends_on(SLOSH_START),
    V::output("tau_friction", |o, _| o.tau_friction, "N.m",
        "Friction torque of the bearing on the hub, positive towards +theta; while the hub sticks, it balances all other torques")
        .display_unit("mN.m").nominal(0.01).depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),
    V::output("tau_fluid", |o, _| o.tau_fluid, "N.m",
        "Torque of the whole liquid (sloshing and rigid) on the hub about the bearing axis, positive towards +theta: hub.I omega_dot = tau_actuator + tau_ext + tau_friction + tau_fluid + tau_gravity + tau_suspension")
        .display_unit("mN.m").nominal(0.1).depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),
    V::output("F_tangential", |o, _| o.f_tangential, "N",
        "Tangential force of the whole liquid (sloshing and rigid) on the tank, hub frame, positive towards +theta")
        .depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),
    V::output("F_radial", |o, _| o.f_radial, "N",
        "Radial force of the whole liquid (sloshing and rigid) on the tank, hub frame, positive outwards")
        .depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),
    V::output("wave_height", |o, _| o.wave_height, "m",
        "Wave height at the tank wall above the surface at rest, from linear theory; only an indication above a quarter of the tank's radius")
        .display_unit("mm").nominal(0.01)
        .depends_on(&["slosh.q_radial", "slosh.q_tangential"]).initial_depends_on(SLOSH_START),
    V::output("omega_imu", |o, _| o.omega_imu, "rad/s",
        "Hub angular rate as measured by the rate gyro: sampled, noisy and quantised; equal to omega while imu.enabled is false")
        .display_unit("deg/s").nominal(0.1).depends_on(&["omega"]).initial_depends_on(&["init.omega", "imu."]),

    // Inputs
    V::input("tau_cmd", |i, _| parts(&mut i.tau_cmd), "N.m",
        "Torque command to the actuator, positive towards +theta. Held over a communication step unless an input derivative is set, which applies to one step")
        .display_unit("mN.m").range(-1e12, 1e12).nominal(0.1),
    V::input("tau_ext", |i, _| parts(&mut i.tau_ext), "N.m",
        "External torque on the hub about the bearing axis, positive towards +theta. Held over a communication step unless an input derivative is set, which applies to one step")
        .display_unit("mN.m").range(-1e12, 1e12).nominal(0.1),
    V::input("g_axial", |i, _| parts(&mut i.g_axial), "m/s2",
        "Specific force along the tank's axis, positive when it presses the liquid to the bottom: gravity on a bench, thrust acceleration in flight. Held over a communication step unless an input derivative is set, which applies to one step")
        .range(0.0, 1e9).nominal(10.0),

    // Locals
    V::local("slosh_rate_radial", |o, _| o.slosh_rate_radial, "rad/s",
        "Derivative of slosh_angle_radial")
        .display_unit("deg/s").depends_on(MODE_1_MOVING),
    V::local("tau_gravity", |o, _| o.tau_gravity, "N.m",
        "Gravity torque on the dry hub of a tilted bench, positive towards +theta; 0 while bench.tilt or hub.imbalance is 0. Gravity on the liquid is part of tau_fluid")
        .display_unit("mN.m").depends_on(&["theta", "g_axial"]).initial_depends_on(&["hub.", "bench.", "init.theta"]),
    V::local("tau_suspension", |o, _| o.tau_suspension, "N.m",
        "Torque of the suspension line on the hub, positive towards +theta: -hub.k (theta - hub.theta_0) - hub.c omega; 0 while hub.k and hub.c are 0")
        .display_unit("mN.m").depends_on(&["theta", "omega"]).initial_depends_on(&["hub.", "init.theta", "init.omega"]),
    V::local("energy", |o, _| o.energy, "J",
        "Kinetic and potential energy of hub, suspension line and liquid; 0 at rest on an upright bench with an untwisted line")
        .nominal(0.01).depends_on(ALL_TORQUES),
    V::local("momentum", |o, _| o.momentum, "kg.m2/s",
        "Angular momentum of hub and liquid about the bearing axis, positive towards +theta")
        .depends_on(HUB_AND_LIQUID),
    V::local("power_dissipated", |o, _| o.power_dissipated, "W",
        "Power dissipated by bearing, suspension line and liquid, never negative")
        .depends_on(HEAT),
    V::local("work", |o, _| o.work, "J",
        "Work done on the hub by tau_actuator and tau_ext since the start")
        .nominal(0.01).is_state(|_| x::WORK).depends_on(&["work"]),
    V::local("heat", |o, _| o.heat, "J",
        "Energy dissipated by bearing, suspension line and liquid since the start")
        .nominal(0.01).is_state(|_| x::HEAT).depends_on(&["heat"]),
    V::local("work_axial", |o, _| o.work_axial, "J",
        "Work done on the liquid by changes of g_axial since the start: energy - energy(0) = work + work_axial - heat. Exact in Co-Simulation, also for jumps. In Model Exchange summed at accepted steps, to fourth order in their length if g_axial is linear in time")
        .nominal(0.01).depends_on(&["theta", "slosh.q_radial", "slosh.q_tangential", "g_axial"]),
    V::local_of_inputs("slosh.damping", |model, inputs, n| model.damping_ratio(n, inputs), "1",
        "Damping ratio of a slosh mode at the current g_axial, without the ring baffle; 0 for unused modes")
        .shape(PER_MODE).depends_on(&["g_axial"]).initial_depends_on(LIQUID),
    V::local("baffle.zeta", |o, _| o.baffle_zeta, "1",
        "Damping ratio that the ring baffle adds to slosh.damping[1] at the current wave amplitude; 0 without a baffle")
        .depends_on(WAVE_1).initial_depends_on(&["baffle.", "tank.", "fluid.", "slosh.", "bench.", "init."]),
    V::local("baffle.wave", |o, _| o.baffle_wave, "m",
        "Oscillation amplitude of mode 1 at the wall, from its angle and rate, at which baffle.zeta holds; 0 without a baffle")
        .display_unit("mm").nominal(0.01)
        .depends_on(WAVE_1).initial_depends_on(&["baffle.", "tank.", "fluid.", "slosh.", "bench.", "init."]),
    V::local("tau_actuator", |o, _| o.tau_actuator, "N.m",
        "Torque of the actuator on the hub, positive towards +theta: tau_cmd within the reaction wheel's limits")
        .display_unit("mN.m").depends_on(&["tau_cmd", "wheel_speed"]),
    V::local("wheel_speed", |o, _| o.wheel_speed, "rad/s",
        "Angular rate of the wheel's rotor in the inertial frame, positive towards +theta; a positive tau_actuator decreases it")
        .display_unit("rpm").nominal(100.0).is_state(|_| x::WHEEL_SPEED).reinit().depends_on(&["wheel_speed"]).initial_depends_on(&["wheel.speed_0"]),
    V::local_boolean("stuck", |o, _| o.discrete.stuck,
        "True while dry friction holds the hub at rest")
        .depends_on(ALL_TORQUES),
    V::local_integer("stuck_kind", |o, _| i32::from(o.discrete.stuck),
        "stuck as an integer, for hosts that misread Booleans (OpenModelica up to 1.27): 0 false, 1 true")
        .depends_on(ALL_TORQUES),
    V::local_enumeration("regime", &REGIME, |o, _| o.discrete.regime as i32,
        "Amplitude class of the wave, by wave_height over the tank's radius")
        .depends_on(&["slosh.q_radial", "slosh.q_tangential"]),
    V::local_boolean("in_range", |o, _| o.discrete.limited_by == LimitedBy::None,
        "True while the slosh modes represent the liquid; limited_by has the reason if not")
        .depends_on(RANGE),
    V::local_integer("in_range_kind", |o, _| i32::from(o.discrete.limited_by == LimitedBy::None),
        "in_range as an integer, for hosts that misread Booleans (OpenModelica up to 1.27): 0 false, 1 true")
        .depends_on(RANGE),
    V::local_enumeration("limited_by", &LIMITED_BY, |o, _| o.discrete.limited_by as i32,
        "Reason why the slosh modes do not represent the liquid now; of several the first of spin, bond_number, secondary_resonance, breaking, third_order")
        .depends_on(RANGE),
    V::local_integer("limited_by_kind", |o, _| o.discrete.limited_by as i32,
        "limited_by as an integer, for hosts that misread enumerations")
        .depends_on(RANGE),
    V::local_boolean("baffle.in_range", |o, _| o.discrete.baffle_in_range,
        "True while the damping law of the ring baffle holds: the liquid's stroke at the ring is 0.64 to 6.4 times its width, the wave does not uncover it, and it covers less than a quarter of the tank's cross-section. True without a baffle")
        .depends_on(WAVE_1),
    V::local_integer("baffle.in_range_kind", |o, _| i32::from(o.discrete.baffle_in_range),
        "baffle.in_range as an integer, for hosts that misread Booleans (OpenModelica up to 1.27): 0 false, 1 true")
        .depends_on(WAVE_1),
    V::local_integer("friction_mode", |o, _| o.discrete.friction_mode,
        "Contact state of the set-valued friction law: -1 slipping backwards, 0 stuck, 1 slipping forwards; 1 with other laws")
        .depends_on(ALL_TORQUES),
    V::local_integer("event_count", |o, _| o.discrete.event_count,
        "Number of changes of friction_mode since the start"),
    V::local("event_time", |o, _| o.discrete.event_time, "s",
        "Time of the last change of friction_mode"),
    V::local("stuck_time", |o, _| o.stuck_time, "s",
        "Time during which the hub has been stuck since the start")
        .is_state(|_| x::STUCK_TIME).depends_on(&["stuck_time"]),

    V::state("bristle", |_| x::BRISTLE, "rad",
        "Mean deflection of the bearing's bristles, positive towards +theta; 0 unless friction.model = lugre")
        .nominal(1e-6).depends_on(&["bristle"]),

    // The coordinates of the slosh modes. The other continuous states are `bristle` and those outputs and locals
    // that are marked `is_state`.
    V::state("slosh.q_radial", |n| x::SLOSH + 4 * n, "",
        "Radial coordinate of a slosh mode, positive outwards. Models linear and planar: unused. Model spherical: stereographic, tangent of half the pendulum's angle from the vertical times the radial part of its direction (unit 1). Model liquid: displacement (m)")
        .shape(PER_MODE)
        .nominal(1e-3).depends_on(&["slosh.q_radial[]"]).initial_depends_on(SLOSH_START),
    V::state("slosh.q_tangential", |n| x::SLOSH + 4 * n + 1, "",
        "Tangential coordinate of a slosh mode, positive towards +theta. Models linear and planar: slosh angle (rad). Model spherical: stereographic, as slosh.q_radial (unit 1). Model liquid: displacement (m)")
        .shape(PER_MODE)
        .nominal(1e-3).depends_on(&["slosh.q_tangential[]"]).initial_depends_on(SLOSH_START),
    V::state("slosh.v_radial", |n| x::SLOSH + 4 * n + 2, "",
        "Derivative of slosh.q_radial, in its unit per second")
        .shape(PER_MODE)
        .nominal(0.01).depends_on(&["slosh.v_radial[]"]).initial_depends_on(SLOSH_START),
    V::state("slosh.v_tangential", |n| x::SLOSH + 4 * n + 3, "",
        "Derivative of slosh.q_tangential, in its unit per second")
        .shape(PER_MODE)
        .nominal(0.01).depends_on(&["slosh.v_tangential[]"]).initial_depends_on(SLOSH_START),

    // The derivatives of the continuous states, in the order in which a Model Exchange host receives them.
    V::derivative("der(theta)", |_| x::THETA, "rad/s",
        "Derivative of theta: omega")
        .depends_on(&["omega"]).initial_depends_on(&["init.omega"]),
    V::derivative("der(omega)", |_| x::OMEGA, "rad/s2",
        "Derivative of omega: omega_dot")
        .depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),
    V::derivative("der(work)", |_| x::WORK, "W",
        "Derivative of work: power of tau_actuator and tau_ext")
        .depends_on(&["omega", "wheel_speed", "tau_cmd", "tau_ext"]).initial_depends_on(&["init.omega", "wheel."]),
    V::derivative("der(heat)", |_| x::HEAT, "W",
        "Derivative of heat: power_dissipated")
        .depends_on(HEAT).initial_depends_on(DYNAMICS),
    V::derivative("der(stuck_time)", |_| x::STUCK_TIME, "1",
        "Derivative of stuck_time: 1 while stuck, 0 otherwise")
        .depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),
    V::derivative("der(wheel_speed)", |_| x::WHEEL_SPEED, "rad/s2",
        "Derivative of wheel_speed: -tau_actuator/wheel.I")
        .depends_on(&["wheel_speed", "tau_cmd"]).initial_depends_on(&["wheel."]),
    V::derivative("der(bristle)", |_| x::BRISTLE, "rad/s",
        "Derivative of bristle: omega - friction.sigma0 |omega| bristle over the dry friction")
        .depends_on(&["theta", "omega", "bristle"]).initial_depends_on(&["init.theta", "init.omega", "friction."]),
    V::derivative("der(slosh.q_radial)", |n| x::SLOSH + 4 * n, "",
        "Derivative of slosh.q_radial: slosh.v_radial")
        .shape(PER_MODE)
        .depends_on(&["slosh.v_radial[]"]).initial_depends_on(SLOSH_START),
    V::derivative("der(slosh.q_tangential)", |n| x::SLOSH + 4 * n + 1, "",
        "Derivative of slosh.q_tangential: slosh.v_tangential")
        .shape(PER_MODE)
        .depends_on(&["slosh.v_tangential[]"]).initial_depends_on(SLOSH_START),
    V::derivative("der(slosh.v_radial)", |n| x::SLOSH + 4 * n + 2, "",
        "Derivative of slosh.v_radial")
        .shape(PER_MODE)
        .depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),
    V::derivative("der(slosh.v_tangential)", |n| x::SLOSH + 4 * n + 3, "",
        "Derivative of slosh.v_tangential")
        .shape(PER_MODE)
        .depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),

    // Hub, tank, liquid
    V::parameter("hub.I", |p, _| &mut p.hub.inertia, "kg.m2",
        "Moment of inertia of hub and dry tank about the bearing axis, without the wheel's rotor")
        .range(1e-6, 1e12),
    V::parameter("hub.imbalance", |p, _| &mut p.hub.imbalance, "kg.m",
        "Static imbalance of hub and dry tank: their mass times the distance of their centre of mass from the bearing axis; acts only if bench.tilt is not 0")
        .range(0.0, 1e6),
    V::parameter("hub.imbalance_angle", |p, _| &mut p.hub.imbalance_angle, "rad",
        "Direction of the centre of mass of hub and dry tank in the hub frame, from radial (0) towards tangential")
        .display_unit("deg").range(-7.0, 7.0),
    V::parameter("hub.k", |p, _| &mut p.hub.k, "N.m/rad",
        "Torsional stiffness of the suspension line; 0: none")
        .range(0.0, 1e6),
    V::parameter("hub.theta_0", |p, _| &mut p.hub.theta_0, "rad",
        "Hub angle at which the suspension line is untwisted")
        .display_unit("deg").range(-1e6, 1e6),
    V::parameter("hub.c", |p, _| &mut p.hub.c, "N.m.s/rad",
        "Damping coefficient of the suspension line; unlike friction.b it acts with every friction.model")
        .range(0.0, 1e6),
    V::parameter("bench.tilt", |p, _| &mut p.bench.tilt, "rad",
        "Tilt of the bearing axis from the vertical. The component of gravity across the axis, g_axial tan(bench.tilt), acts on hub and liquid and tilts the surface. The tilt changes the modes of slosh.source = geometry, not those of slosh.table")
        .display_unit("deg").range(0.0, 1.5),
    V::parameter("bench.tilt_azimuth", |p, _| &mut p.bench.tilt_azimuth, "rad",
        "Hub angle at which the tank is lowest: direction of gravity's component across the bearing axis")
        .display_unit("deg").range(-7.0, 7.0),
    V::parameter("tank.d", |p, _| &mut p.tank.d, "m",
        "Inner diameter of the upright cylindrical tank")
        .display_unit("mm").range(1e-3, 100.0),
    V::parameter("tank.h", |p, _| &mut p.tank.h, "m",
        "Fill height of the liquid")
        .display_unit("mm").range(1e-4, 100.0),
    V::parameter("tank.r", |p, _| &mut p.tank.r, "m",
        "Distance of the tank's axis from the bearing axis")
        .display_unit("mm").range(0.0, 1000.0),
    V::parameter("tank.I_own", |p, _| &mut p.tank.own_inertia, "kg.m2",
        "Moment of inertia about the tank's axis of the liquid that turns with the tank; 0 for inviscid liquid in an upright cylinder")
        .range(0.0, 1e6),
    V::parameter("fluid.rho", |p, _| &mut p.fluid.rho, "kg/m3",
        "Density of the liquid")
        .range(1e-6, 1e5),
    V::parameter("fluid.nu", |p, _| &mut p.fluid.nu, "m2/s",
        "Kinematic viscosity of the liquid")
        .display_unit("mm2/s").range(0.0, 1.0),
    V::parameter("fluid.sigma", |p, _| &mut p.fluid.sigma, "N/m",
        "Surface tension of the liquid")
        .display_unit("mN/m").range(1e-9, 10.0),

    // Slosh model
    V::choice("slosh.model", &SLOSH_MODEL, |p, _| p.slosh.model as i32,
        |p, _, n| set_item(&mut p.slosh.model, &SloshModel::ALL, n),
        "Mechanical model of the liquid"),
    V::integer("slosh.kind", |p, _| &mut p.slosh_kind,
        "slosh.model as an integer, for hosts that cannot set enumerations: 0 takes slosh.model, other values are its item numbers. Setting slosh.model to a different item is an error")
        .between(0, SLOSH_MODEL.items.len() as i32),
    V::choice("slosh.source", &SLOSH_SOURCE, |p, _| p.slosh.source as i32,
        |p, _, n| set_item(&mut p.slosh.source, &SloshSource::ALL, n),
        "Source of the modes' masses, lengths and damping ratios"),
    V::integer("slosh.source_kind", |p, _| &mut p.slosh_source_kind,
        "slosh.source as an integer, for hosts that cannot set enumerations: 0 takes slosh.source, other values are its item numbers. Setting slosh.source to a different item is an error")
        .between(0, SLOSH_SOURCE.items.len() as i32),
    V::count("slosh.modes", |p, _| p.slosh.modes as i32, |p, _, n| p.slosh.modes = n.max(0) as usize,
        "Number of slosh modes in use; the mass of the other modes moves with the tank")
        .between(1, MODES as i32),
    V::switch("slosh.zeta_from_correlation", |p| &mut p.slosh.zeta_from_correlation,
        "True: damping ratio of mode 1 from the correlation of Mikishev and Dorozhkin (of Stephens below tank.h = tank.d/4), of higher modes in proportion to their laminar layers. False: slosh.zeta"),
    V::integer("slosh.zeta_from_correlation_kind", |p, _| &mut p.zeta_from_correlation_kind,
        "slosh.zeta_from_correlation as an integer, for hosts that misread Booleans (OpenModelica up to 1.27): 0 takes slosh.zeta_from_correlation; 1 (false) and 2 (true) override it")
        .between(0, 2),
    V::parameter("slosh.zeta", |p, _| &mut p.slosh.zeta, "1",
        "Damping ratio of every slosh mode if slosh.zeta_from_correlation is false")
        .range(0.0, 0.999),
    V::choice("slosh.damping_law", &DAMPING_LAW, |p, _| p.slosh.damping_law as i32,
        |p, _, n| set_item(&mut p.slosh.damping_law, &DampingLaw::ALL, n),
        "Damping law: dependence of a mode's drag coefficient on its natural frequency, hence on the specific force along the tank's axis"),
    V::integer("slosh.damping_law_kind", |p, _| &mut p.damping_law_kind,
        "slosh.damping_law as an integer, for hosts that cannot set enumerations: 0 takes slosh.damping_law, other values are its item numbers. Setting slosh.damping_law to a different item is an error")
        .between(0, DAMPING_LAW.items.len() as i32),
    V::parameter("slosh.zeta_amplitude", |p, _| &mut p.slosh.zeta_amplitude, "1/rad",
        "Growth of a mode's damping ratio with its amplitude A: zeta(A) = zeta + zeta_amplitude A; A combines angle and rate over natural frequency in both directions")
        .range(0.0, 10.0),
    V::parameter("slosh.zeta_breaking", |p, _| &mut p.slosh.zeta_breaking, "1",
        "Growth of a mode's damping ratio with the steepness of its wave above slosh.breaking_steepness: zeta_breaking per unit of steepness. 0: waves do not break")
        .range(0.0, 10.0),
    V::parameter("slosh.breaking_steepness", |p, _| &mut p.slosh.breaking_steepness, "1",
        "Steepness from which a mode's wave breaks. Steepness is wave number times amplitude at the wall. In an upright cylinder it is 1.541 times the amplitude of slosh_angle for mode 1; elsewhere slosh.table.wave_number times slosh.table.wave times the amplitude. Only if slosh.zeta_breaking is not 0")
        .range(0.0, 10.0),
    V::switch("slosh.capillarity", |p| &mut p.slosh.capillarity,
        "True: surface tension centres the liquid (flat surface, free contact line); for slosh.source = geometry only"),
    V::integer("slosh.capillarity_kind", |p, _| &mut p.capillarity_kind,
        "slosh.capillarity as an integer, for hosts that misread Booleans (OpenModelica up to 1.27): 0 takes slosh.capillarity; 1 (false) and 2 (true) override it")
        .between(0, 2),

    // The modes of a tank of any shape
    V::switch("slosh.table.one_axis", |p| &mut p.slosh.table.one_axis,
        "True: the table holds the modes along one axis of the tank (a box, for example), and this axis lies along the tangent. Models spherical and liquid, which move along both axes, are then refused"),
    V::integer("slosh.table.one_axis_kind", |p, _| &mut p.one_axis_kind,
        "slosh.table.one_axis as an integer, for hosts that misread Booleans (OpenModelica up to 1.27): 0 takes slosh.table.one_axis; 1 (false) and 2 (true) override it")
        .between(0, 2),
    V::parameter("slosh.table.m_liq", |p, _| &mut p.slosh.table.m_liq, "kg",
        "Mass of the whole liquid, source table. The part that exceeds the modal masses moves with the tank. With this source, tank.d is the diameter of the free surface, and tank.h is not used")
        .range(0.0, 1e9),
    V::parameter("slosh.table.g_ref", |p, _| &mut p.slosh.table.g_ref, "m/s2",
        "Specific force along the tank's axis at which slosh.table.frequency holds and the modes are ordered by frequency")
        .range(1e-9, 1e4),
    V::parameter("slosh.table.mass", |p, n| &mut p.slosh.table.mass[n], "kg",
        "Mass of a slosh mode's pendulum (modal mass), source table; the slosh.modes modes with the lowest frequencies are used")
        .shape(TABLE_OF_MODES).range(0.0, 1e9),
    V::parameter("slosh.table.length", |p, n| &mut p.slosh.table.length[n], "m",
        "Length of a slosh mode's pendulum, source table; 0: from slosh.table.frequency")
        .shape(TABLE_OF_MODES).display_unit("mm").range(0.0, 1e4),
    V::parameter("slosh.table.frequency", |p, n| &mut p.slosh.table.frequency[n], "Hz",
        "Natural frequency of a slosh mode at slosh.table.g_ref, source table; used if slosh.table.length is 0")
        .shape(TABLE_OF_MODES).range(0.0, 1e4),
    V::parameter("slosh.table.hinge", |p, n| &mut p.slosh.table.hinge[n], "m",
        "Height of a slosh mode's hinge on the tank's axis, source table; without effect on the motion about the bearing axis")
        .shape(TABLE_OF_MODES).range(-1e6, 1e6),
    V::parameter("slosh.table.k", |p, n| &mut p.slosh.table.k[n], "N/m",
        "Centring stiffness of a slosh mode at its bob (capillarity, diaphragm), source table")
        .shape(TABLE_OF_MODES).range(0.0, 1e9),
    V::parameter("slosh.table.zeta", |p, n| &mut p.slosh.table.zeta[n], "1",
        "Damping ratio of a slosh mode, source table")
        .shape(TABLE_OF_MODES).range(0.0, 0.999),
    V::parameter("slosh.table.wave", |p, n| &mut p.slosh.table.wave[n], "m/rad",
        "Surface elevation at the wall per slosh angle of a slosh mode, source table; 0: as in an upright cylinder of diameter tank.d")
        .shape(TABLE_OF_MODES).range(0.0, 1e4),
    V::parameter("slosh.table.wave_number", |p, n| &mut p.slosh.table.wave_number[n], "1/m",
        "Wave number of a slosh mode, source table, for slosh.breaking_steepness: pi/L in a box of length L; 0: as in an upright cylinder of diameter tank.d")
        .shape(TABLE_OF_MODES).range(0.0, 1e6),
    V::parameter("slosh.table.nonlinear_inertia", |p, n| &mut p.slosh.table.nonlinear_inertia[n], "1",
        "Coefficient s of a slosh mode, source table and slosh.model = liquid: its inertia grows with 1 + s A^2 along the amplitude A. The amplitude changes the squared frequency of planar motion by (3 kappa/8 - s/2) A^2. 1 for a pendulum")
        .shape(TABLE_OF_MODES).range(-1e6, 1e6),
    V::parameter("slosh.table.nonlinear_stiffness", |p, n| &mut p.slosh.table.nonlinear_stiffness[n], "1",
        "Coefficient kappa of a slosh mode, source table and slosh.model = liquid: its restoring force grows with 1 + kappa A^2/2 over the amplitude A. The amplitude changes the squared frequency of circular motion by kappa/2 A^2. 1 for a pendulum")
        .shape(TABLE_OF_MODES).range(-1e6, 1e6),
    V::parameter("slosh.table.angle_limit", |p, n| &mut p.slosh.table.angle_limit[n], "rad",
        "Slosh angle above which a slosh mode is out of range (limited_by = third_order), source table: the smaller of the angles at which the frequency of slosh.model = liquid errs by 0.3 % and a forced response by 3 %. Other models end at smaller angles, which follow from nonlinear_inertia and nonlinear_stiffness. 0: not known")
        .shape(TABLE_OF_MODES).display_unit("deg").range(0.0, 1.6),
    V::parameter("slosh.table.swirl_limit", |p, n| &mut p.slosh.table.swirl_limit[n], "rad",
        "Slosh angle above which rotary motion of a slosh mode is out of range (limited_by = secondary_resonance), source table: there a forced response errs by 3 %, or its branch folds by a secondary resonance. 0: not known")
        .shape(TABLE_OF_MODES).display_unit("deg").range(0.0, 1.6),
    V::parameter("slosh.table.direction", |p, n| &mut p.slosh.table.direction[n], "rad",
        "Direction in which a slosh mode moves its mass, source table: angle from the tangent, positive outwards (0 tangential, 90 deg radial). For slosh.model = linear and planar. List modes of the same direction in the order of their frequencies")
        .shape(TABLE_OF_MODES).display_unit("deg").range(-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2),

    // Ring baffle
    V::parameter("baffle.width", |p, _| &mut p.baffle.width, "m",
        "Width of the flat ring baffle at the tank's wall; 0: no baffle. Its damping of mode 1 grows with the square root of the wave amplitude (Miles 1958)")
        .display_unit("mm").range(0.0, 100.0),
    V::parameter("baffle.depth", |p, _| &mut p.baffle.depth, "m",
        "Depth of the ring baffle below the surface at rest")
        .display_unit("mm").range(0.0, 100.0),

    // Bearing
    V::choice("friction.model", &FRICTION_MODEL, |p, _| p.friction.model as i32,
        |p, _, n| set_item(&mut p.friction.model, &FrictionModel::ALL, n),
        "Friction law of the bearing")
        .tunable(),
    V::integer("friction.kind", |p, _| &mut p.friction_kind,
        "friction.model as an integer, for hosts that cannot set enumerations: 0 takes friction.model, other values are its item numbers. Setting friction.model to a different item is an error")
        .between(0, FRICTION_MODEL.items.len() as i32).tunable(),
    V::parameter("friction.b", |p, _| &mut p.friction.b, "N.m.s",
        "Viscous friction coefficient of the bearing")
        .range(0.0, 1e6).tunable(),
    V::parameter("friction.c", |p, _| &mut p.friction.c, "N.m",
        "Coulomb friction torque of the bearing")
        .display_unit("mN.m").range(0.0, 1e6).tunable(),
    V::parameter("friction.d", |p, _| &mut p.friction.d, "N.m",
        "Static friction torque of the bearing in excess of the Coulomb torque")
        .display_unit("mN.m").range(0.0, 1e6).tunable(),
    V::parameter("friction.omega_s", |p, _| &mut p.friction.omega_s, "rad/s",
        "Stribeck speed of the bearing: the excess friction falls with exp(-(omega/omega_s)^2)")
        .display_unit("deg/s").range(1e-6, 1e6).tunable(),
    V::parameter("friction.eps", |p, _| &mut p.friction.eps, "rad/s",
        "Width of the smoothed sign function, for friction.model = stribeck_smooth only")
        .display_unit("deg/s").range(1e-7, 1e3).tunable(),
    V::parameter("friction.sigma0", |p, _| &mut p.friction.sigma0, "N.m/rad",
        "Stiffness of the bristles, for friction.model = lugre only")
        .range(1e-3, 1e9).tunable(),
    V::parameter("friction.sigma1", |p, _| &mut p.friction.sigma1, "N.m.s/rad",
        "Damping of the bristles, for friction.model = lugre only; passivity of the bearing limits it to friction.b over the relative range of dry friction")
        .range(0.0, 1e6).tunable(),
    V::parameter("friction.asymmetry", |p, _| &mut p.friction.asymmetry, "1",
        "Asymmetry of dry friction: factor 1 + asymmetry forwards, 1 - asymmetry backwards")
        .range(-0.999, 0.999).tunable(),
    V::parameter("friction.forward_cos1", |p, _| &mut p.friction.harmonics_forward[0], "1",
        "Relative variation of dry friction with cos(theta) while turning forwards")
        .range(-1.0, 1.0).tunable(),
    V::parameter("friction.forward_sin1", |p, _| &mut p.friction.harmonics_forward[1], "1",
        "Relative variation of dry friction with sin(theta) while turning forwards")
        .range(-1.0, 1.0).tunable(),
    V::parameter("friction.forward_cos2", |p, _| &mut p.friction.harmonics_forward[2], "1",
        "Relative variation of dry friction with cos(2 theta) while turning forwards")
        .range(-1.0, 1.0).tunable(),
    V::parameter("friction.forward_sin2", |p, _| &mut p.friction.harmonics_forward[3], "1",
        "Relative variation of dry friction with sin(2 theta) while turning forwards")
        .range(-1.0, 1.0).tunable(),
    V::parameter("friction.backward_cos1", |p, _| &mut p.friction.harmonics_backward[0], "1",
        "Relative variation of dry friction with cos(theta) while turning backwards")
        .range(-1.0, 1.0).tunable(),
    V::parameter("friction.backward_sin1", |p, _| &mut p.friction.harmonics_backward[1], "1",
        "Relative variation of dry friction with sin(theta) while turning backwards")
        .range(-1.0, 1.0).tunable(),
    V::parameter("friction.backward_cos2", |p, _| &mut p.friction.harmonics_backward[2], "1",
        "Relative variation of dry friction with cos(2 theta) while turning backwards")
        .range(-1.0, 1.0).tunable(),
    V::parameter("friction.backward_sin2", |p, _| &mut p.friction.harmonics_backward[3], "1",
        "Relative variation of dry friction with sin(2 theta) while turning backwards")
        .range(-1.0, 1.0).tunable(),

    // Initial conditions
    V::parameter("init.theta", |p, _| &mut p.init.theta, "rad",
        "Hub angle at the start")
        .display_unit("deg"),
    V::parameter("init.omega", |p, _| &mut p.init.omega, "rad/s",
        "Hub rate at the start")
        .display_unit("deg/s").range(-1e3, 1e3),
    V::parameter("init.slosh_angle", |p, _| &mut p.init.slosh_angle, "rad",
        "slosh_angle at the start; not 0 by default, so that a run without settings moves. If slosh.table.direction[1] is not 0, the start must lie along that direction")
        .display_unit("deg").range(-1.5, 1.5),
    V::parameter("init.slosh_angle_radial", |p, _| &mut p.init.slosh_angle_radial, "rad",
        "slosh_angle_radial at the start. Models linear and planar: radial part of a start along slosh.table.direction[1]; without effect if that is 0")
        .display_unit("deg").range(-1.5, 1.5),
    V::parameter("init.slosh_rate", |p, _| &mut p.init.slosh_rate, "rad/s",
        "slosh_rate at the start. If slosh.table.direction[1] is not 0, the start must lie along that direction")
        .display_unit("deg/s").range(-1e3, 1e3),
    V::parameter("init.slosh_rate_radial", |p, _| &mut p.init.slosh_rate_radial, "rad/s",
        "slosh_rate_radial at the start. Models linear and planar: radial part of a start along slosh.table.direction[1]; without effect if that is 0")
        .display_unit("deg/s").range(-1e3, 1e3),

    // Reaction wheel
    V::switch("wheel.enabled", |p| &mut p.wheel.enabled,
        "True: the actuator is a reaction wheel with limits. False: tau_actuator equals tau_cmd"),
    V::integer("wheel.enabled_kind", |p, _| &mut p.wheel_enabled_kind,
        "wheel.enabled as an integer, for hosts that misread Booleans (OpenModelica up to 1.27): 0 takes wheel.enabled; 1 (false) and 2 (true) override it")
        .between(0, 2),
    V::parameter("wheel.I", |p, _| &mut p.wheel.inertia, "kg.m2",
        "Moment of inertia of the wheel's rotor, not part of hub.I")
        .range(1e-9, 1e6),
    V::parameter("wheel.speed_0", |p, _| &mut p.wheel.speed_0, "rad/s",
        "wheel_speed at the start")
        .display_unit("rpm").range(-1e5, 1e5),
    V::parameter("wheel.speed_min", |p, _| &mut p.wheel.speed_min, "rad/s",
        "Lowest wheel_speed; at this speed the wheel gives only torque that increases it")
        .display_unit("rpm").range(-1e5, 1e5),
    V::parameter("wheel.speed_max", |p, _| &mut p.wheel.speed_max, "rad/s",
        "Highest wheel_speed; at this speed the wheel gives only torque that decreases it")
        .display_unit("rpm").range(-1e5, 1e5),
    V::parameter("wheel.tau_max", |p, _| &mut p.wheel.tau_max, "N.m",
        "Largest torque of the wheel in either direction")
        .display_unit("mN.m").range(0.0, 1e6),

    // Rate gyro
    V::switch("imu.enabled", |p| &mut p.imu.enabled,
        "True: omega_imu is sampled, noisy and quantised. False: it equals omega"),
    V::integer("imu.enabled_kind", |p, _| &mut p.imu_enabled_kind,
        "imu.enabled as an integer, for hosts that misread Booleans (OpenModelica up to 1.27): 0 takes imu.enabled; 1 (false) and 2 (true) override it")
        .between(0, 2),
    V::parameter("imu.rate", |p, _| &mut p.imu.rate, "Hz",
        "Sampling rate of the gyro")
        .range(0.1, 1e4),
    V::parameter("imu.arw", |p, _| &mut p.imu.arw, "rad/s/sqrt(Hz)",
        "Angle random walk of the gyro; one sample has the standard deviation imu.arw sqrt(imu.rate)")
        .range(0.0, 10.0),
    V::parameter("imu.bias_instability", |p, _| &mut p.imu.bias_instability, "rad/s",
        "Bias instability of the gyro; its bias is a first-order Gauss-Markov process of standard deviation imu.bias_instability/0.664")
        .display_unit("deg/h").range(0.0, 10.0),
    V::parameter("imu.bias_time", |p, _| &mut p.imu.bias_time, "s",
        "Correlation time of the gyro's bias")
        .range(1e-3, 1e9),
    V::parameter("imu.flicker", |p, _| &mut p.imu.flicker, "rad/s",
        "Bias instability of the gyro's flicker noise, whose Allan deviation is flat at 0.664 imu.flicker from 0.3 s to 3 h; 0: none")
        .display_unit("deg/h").range(0.0, 10.0),
    V::parameter("imu.rrw", |p, _| &mut p.imu.rrw, "rad/s/sqrt(s)",
        "Rate random walk of the gyro; its Allan deviation is imu.rrw sqrt(averaging time/3), and it is 0 at the start; 0: none")
        .range(0.0, 10.0),
    V::parameter("imu.lsb", |p, _| &mut p.imu.lsb, "rad/s",
        "Quantisation step of the gyro; 0: none")
        .display_unit("deg/s").range(0.0, 10.0),
    V::integer("imu.seed", |p, _| &mut p.imu.seed,
        "Seed of the gyro's noise; the same seed gives the same noise on every platform"),

    // Solver
    V::count("solver.max_steps", |p, _| p.solver.max_steps as i32,
        |p, _, n| p.solver.max_steps = n.max(0) as usize,
        "Largest number of internal steps, and of gyro samples, in one communication step; a step that needs more is refused")
        .between(1, 1_000_000_000),

    // Calculated from the parameters
    V::calculated("tank.m_liq", |m, _| m.calculated().m_liq, "kg",
        "Mass of the whole liquid")
        .initial_depends_on(LIQUID),
    V::calculated("tank.m_0", |m, _| m.calculated().m_0, "kg",
        "Mass of the rigid liquid, which moves with the tank")
        .initial_depends_on(LIQUID_MODES),
    V::calculated("tank.bond", |m, _| m.calculated().bond, "1",
        "Bond number: gravity divided by surface tension; the model holds far above 1")
        .depends_on(&["g_axial"]).initial_depends_on(&["tank.", "fluid."]),
    V::calculated("slosh.mass", |m, n| m.calculated().mass[n], "kg",
        "Mass of a slosh mode's pendulum (modal mass); on a tilted bench, of the equivalent oblique pendulum; 0 for unused modes")
        .shape(PER_MODE)
        .initial_depends_on(LIQUID_MODES),
    V::calculated("slosh.length", |m, n| m.calculated().length[n], "m",
        "Length of a slosh mode's pendulum; on a tilted bench, of the equivalent oblique pendulum; 0 for unused modes")
        .shape(PER_MODE)
        .display_unit("mm").initial_depends_on(LIQUID_MODES),
    V::calculated("slosh.frequency", |m, n| m.calculated().frequency[n], "Hz",
        "Natural frequency of a slosh mode in the tank at rest, at the initial g_axial; 0 for unused modes")
        .shape(PER_MODE)
        .depends_on(&["g_axial"]).initial_depends_on(LIQUID_MODES),
];

static SLOSH_MODEL_ITEMS: [Item; SloshModel::ITEMS.len()] = Item::list(SloshModel::ITEMS);

static SLOSH_MODEL: Enumeration = Enumeration {
    name: "SloshModel",
    description: "Mechanical models of the liquid",
    items: &SLOSH_MODEL_ITEMS,
};

static SLOSH_SOURCE: Enumeration = Enumeration {
    name: "SloshSource",
    description: "Sources of the modal parameters",
    items: &[
        Item::new("geometry", "Upright cylinder given by tank.d, tank.h and fluid.rho"),
        Item::new("table", "Modal parameters in slosh.table, for a tank of any shape"),
    ],
};

static DAMPING_LAW: Enumeration = Enumeration {
    name: "DampingLaw",
    description: "Drag coefficient c of a mode as a function of its natural frequency omega",
    items: &[
        Item::new(
            "laminar",
            "c ~ sqrt(omega): a laminar layer at the wall, for tanks without baffles",
        ),
        Item::new("constant_ratio", "c ~ omega: constant damping ratio"),
        Item::new(
            "by_source",
            "laminar if the damping ratio comes from the correlation, constant_ratio if it is given",
        ),
    ],
};

static FRICTION_MODEL: Enumeration = Enumeration {
    name: "FrictionModel",
    description: "Friction laws of the bearing",
    items: &[
        Item::new("none", "Bearing without friction"),
        Item::new("viscous", "Viscous friction b omega"),
        Item::new(
            "stribeck_smooth",
            "Stribeck curve with a smoothed sign: the hub creeps and never sticks",
        ),
        Item::new("stribeck", "Stribeck curve as a set-valued law: the hub can stick"),
        Item::new("lugre", "LuGre: bristles that deflect before they slide"),
    ],
};

static REGIME: Enumeration = Enumeration {
    name: "Regime",
    description: "Amplitude class of the wave at the wall; R is the tank's radius",
    items: &[
        Item::new("linear", "Below 0.15 R: linear theory holds"),
        Item::new("transitional", "0.15 R to 0.25 R"),
        Item::new("nonlinear", "Above 0.25 R: heights and forces are only indications"),
    ],
};

static LIMITED_BY_ITEMS: [Item; LimitedBy::ITEMS.len()] = Item::list(LimitedBy::ITEMS);

static LIMITED_BY: Enumeration = Enumeration {
    name: "LimitedBy",
    description: "Reason why no slosh mode represents the liquid",
    items: &LIMITED_BY_ITEMS,
};

fn parts(ramp: &mut Ramp) -> [&mut f64; 2] {
    [&mut ramp.value, &mut ramp.slope]
}

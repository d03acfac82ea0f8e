//! Names of SloshTank.fmu. Written by `cargo run --release -p model-description`; do not edit.

pub const FORCE: crate::Array<1> = crate::Array("force");
pub const TORQUE: crate::Array<1> = crate::Array("torque");
pub const BIAS: crate::Array<1> = crate::Array("bias");
pub const ADDED_MASS: crate::Array<1> = crate::Array("added_mass");
pub const IMPULSE: crate::Array<1> = crate::Array("impulse");
pub const A: crate::Array<1> = crate::Array("a");
pub const OMEGA: crate::Array<1> = crate::Array("omega");
pub const OMEGA_DOT: crate::Array<1> = crate::Array("omega_dot");
pub const MASS_FLOW: &str = "mass_flow";
pub const MASS: &str = "mass";
pub const CENTER_OF_MASS: crate::Array<1> = crate::Array("center_of_mass");
pub const INERTIA: crate::Array<2> = crate::Array("inertia");
pub const DISSIPATED: &str = "dissipated";
pub const COUPLING: &str = "coupling";
pub const COUPLING_KIND: &str = "coupling_kind";
pub const COUPLING_RATIO: &str = "coupling_ratio";

pub mod tank {
    pub const WAVE_HEIGHT: &str = "tank.wave_height";
    pub const REGIME: &str = "tank.regime";
    pub const IN_RANGE: &str = "tank.in_range";
    pub const IN_RANGE_KIND: &str = "tank.in_range_kind";
    pub const LIMITED_BY: &str = "tank.limited_by";
    pub const LIMITED_BY_KIND: &str = "tank.limited_by_kind";
    pub const SPIN_RATIO: &str = "tank.spin_ratio";
    pub const SPIN_NUMBER: &str = "tank.spin_number";
    pub const ANGLE_X: crate::Array<1> = crate::Array("tank.angle_x");
    pub const ANGLE_Y: crate::Array<1> = crate::Array("tank.angle_y");
    pub const P: crate::Array<2> = crate::Array("tank.p");
    pub const P_DOT: crate::Array<2> = crate::Array("tank.p_dot");
    pub const SPIN: crate::Array<1> = crate::Array("tank.spin");
    pub const LIQUID: &str = "tank.liquid";
    pub const POSITION: crate::Array<1> = crate::Array("tank.position");
    pub const Q: crate::Array<1> = crate::Array("tank.q");
    pub const DIAMETER: &str = "tank.diameter";
    pub const DEPTH: &str = "tank.depth";
    pub const DENSITY: &str = "tank.density";
    pub const M_0: &str = "tank.m_0";
    pub const H_0: &str = "tank.H_0";
    pub const I_0: &str = "tank.I_0";
    pub const I_Z: &str = "tank.I_z";
    pub const R_0: crate::Array<1> = crate::Array("tank.r_0");
    pub const DI_Y: &str = "tank.dI_y";
    pub const I_XY: &str = "tank.I_xy";
    pub const I_XZ: &str = "tank.I_xz";
    pub const I_YZ: &str = "tank.I_yz";
    pub const MODES: &str = "tank.modes";
    pub const MOST_MODES: usize = 3;
    pub const G_REF: &str = "tank.g_ref";
    pub const MASS: crate::Array<1> = crate::Array("tank.mass");
    pub const LENGTH: crate::Array<1> = crate::Array("tank.length");
    pub const FREQUENCY: crate::Array<1> = crate::Array("tank.frequency");
    pub const HINGE: crate::Array<1> = crate::Array("tank.hinge");
    pub const DIRECTION: crate::Array<2> = crate::Array("tank.direction");
    pub const ARM: crate::Array<1> = crate::Array("tank.arm");
    pub const K: crate::Array<1> = crate::Array("tank.k");
    pub const ZETA: crate::Array<1> = crate::Array("tank.zeta");
    pub const DAMPING_LAW: &str = "tank.damping_law";
    pub const DAMPING_LAW_KIND: &str = "tank.damping_law_kind";
    pub const G_FLOOR: &str = "tank.g_floor";
    pub const ZETA_AMPLITUDE: crate::Array<1> = crate::Array("tank.zeta_amplitude");
    pub const ZETA_BREAKING: crate::Array<1> = crate::Array("tank.zeta_breaking");
    pub const BREAKING_STEEPNESS: crate::Array<1> = crate::Array("tank.breaking_steepness");
    pub const NONLINEAR_INERTIA: crate::Array<1> = crate::Array("tank.nonlinear_inertia");
    pub const NONLINEAR_STIFFNESS: crate::Array<1> = crate::Array("tank.nonlinear_stiffness");
    pub const NONLINEAR_INERTIA_2: crate::Array<1> = crate::Array("tank.nonlinear_inertia_2");
    pub const NONLINEAR_STIFFNESS_2: crate::Array<1> = crate::Array("tank.nonlinear_stiffness_2");
    pub const ROTARY_INERTIA: crate::Array<1> = crate::Array("tank.rotary_inertia");
    pub const ROTARY_INERTIA_2: crate::Array<1> = crate::Array("tank.rotary_inertia_2");
    pub const GYROSCOPIC: crate::Array<1> = crate::Array("tank.gyroscopic");
    pub const GYROSCOPIC_STIFFNESS: crate::Array<1> = crate::Array("tank.gyroscopic_stiffness");
    pub const ANGLE_LIMIT: crate::Array<1> = crate::Array("tank.angle_limit");
    pub const SWIRL_LIMIT: crate::Array<1> = crate::Array("tank.swirl_limit");
    pub const G_BOND: &str = "tank.g_bond";
    pub const WAVE: crate::Array<1> = crate::Array("tank.wave");
    pub const SPIN_INERTIA: &str = "tank.spin_inertia";
    pub const SPIN_INERTIA_ACROSS: &str = "tank.spin_inertia_across";
    pub const SPIN_COUPLING: &str = "tank.spin_coupling";
    pub const SPIN_DECAY: crate::Array<1> = crate::Array("tank.spin_decay");
    pub const SLIP_0: crate::Array<1> = crate::Array("tank.slip_0");
    pub const LIQUID_0: &str = "tank.liquid_0";
    pub const OUTLET: &str = "tank.outlet";
    pub const P_0: crate::Array<2> = crate::Array("tank.p_0");
    pub const P_DOT_0: crate::Array<2> = crate::Array("tank.p_dot_0");

    pub mod ball {
        pub const STATE: &str = "tank.ball.state";
        pub const POSITION: crate::Array<1> = crate::Array("tank.ball.position");
        pub const VELOCITY: crate::Array<1> = crate::Array("tank.ball.velocity");
        pub const TRAVEL: &str = "tank.ball.travel";
        pub const RADIUS: &str = "tank.ball.radius";
        pub const RESTITUTION: &str = "tank.ball.restitution";
        pub const CONTACT_SPEED: &str = "tank.ball.contact_speed";
        pub const DRAG: &str = "tank.ball.drag";
    }

    pub mod fill {
        pub const POINTS: &str = "tank.fill.points";
        pub const MOST_POINTS: usize = 12;
        pub const LIQUID: crate::Array<1> = crate::Array("tank.fill.liquid");
        pub const H_0: crate::Array<1> = crate::Array("tank.fill.H_0");
        pub const I_0: crate::Array<1> = crate::Array("tank.fill.I_0");
        pub const I_Z: crate::Array<1> = crate::Array("tank.fill.I_z");
        pub const MASS: crate::Array<2> = crate::Array("tank.fill.mass");
        pub const LENGTH: crate::Array<2> = crate::Array("tank.fill.length");
        pub const HINGE: crate::Array<2> = crate::Array("tank.fill.hinge");
        pub const ZETA: crate::Array<2> = crate::Array("tank.fill.zeta");
        pub const NONLINEAR_INERTIA: crate::Array<2> = crate::Array("tank.fill.nonlinear_inertia");
        pub const NONLINEAR_STIFFNESS: crate::Array<2> =
            crate::Array("tank.fill.nonlinear_stiffness");
        pub const ANGLE_LIMIT: crate::Array<2> = crate::Array("tank.fill.angle_limit");
        pub const SWIRL_LIMIT: crate::Array<2> = crate::Array("tank.fill.swirl_limit");
    }
}

pub mod host {
    pub const MASS: &str = "host.mass";
    pub const R: crate::Array<1> = crate::Array("host.r");
    pub const JXX: &str = "host.Jxx";
    pub const JYY: &str = "host.Jyy";
    pub const JZZ: &str = "host.Jzz";
    pub const JXY: &str = "host.Jxy";
    pub const JXZ: &str = "host.Jxz";
    pub const JYZ: &str = "host.Jyz";
}

pub mod solver {
    pub const MAX_STEPS: &str = "solver.max_steps";
}

/// Parameters that determine the sizes of arrays.
#[rustfmt::skip]
pub const SIZES: &[crate::Size] = &[
    crate::Size {
        parameter: "tank.modes",
        most: 3,
        has_indicators: false,
        arrays: &[
            ("tank.angle_x", 0), ("tank.angle_y", 0), ("tank.p", 0), ("tank.p_dot", 0),
            ("der(tank.p)", 0), ("der(tank.p_dot)", 0), ("tank.mass", 0), ("tank.length", 0),
            ("tank.frequency", 0), ("tank.hinge", 0), ("tank.direction", 0), ("tank.arm", 0),
            ("tank.k", 0), ("tank.zeta", 0), ("tank.zeta_amplitude", 0), ("tank.zeta_breaking", 0),
            ("tank.breaking_steepness", 0), ("tank.nonlinear_inertia", 0),
            ("tank.nonlinear_stiffness", 0), ("tank.nonlinear_inertia_2", 0),
            ("tank.nonlinear_stiffness_2", 0), ("tank.rotary_inertia", 0),
            ("tank.rotary_inertia_2", 0), ("tank.gyroscopic", 0), ("tank.gyroscopic_stiffness", 0),
            ("tank.angle_limit", 0), ("tank.swirl_limit", 0), ("tank.wave", 0),
            ("tank.fill.mass", 0), ("tank.fill.length", 0), ("tank.fill.hinge", 0),
            ("tank.fill.zeta", 0), ("tank.fill.nonlinear_inertia", 0),
            ("tank.fill.nonlinear_stiffness", 0), ("tank.fill.angle_limit", 0),
            ("tank.fill.swirl_limit", 0), ("tank.p_0", 0), ("tank.p_dot_0", 0),
        ],
    },
];

enumeration! {
    Regime: Linear = 1 "linear", Transitional = 2 "transitional", Nonlinear = 3 "nonlinear"
}

enumeration! {
    LimitedBy: None = 1 "none", ThirdOrder = 2 "third_order", Breaking = 3 "breaking", SecondaryResonance = 4 "secondary_resonance", Spin = 5 "spin", BondNumber = 6 "bond_number", Empty = 7 "empty", Contact = 8 "contact"
}

enumeration! {
    BallState: Settled = 1 "settled", Flying = 2 "flying", Sliding = 3 "sliding"
}

enumeration! {
    Coupling: Split = 1 "split", Lumped = 2 "lumped", RigidBody = 3 "rigid_body"
}

enumeration! {
    DampingLaw: Laminar = 1 "laminar", ConstantRatio = 2 "constant_ratio", Constant = 3 "constant"
}

//! Names of HubSlosh.fmu. Written by `cargo run --release -p model-description`; do not edit.

pub const THETA: &str = "theta";
pub const OMEGA: &str = "omega";
pub const OMEGA_DOT: &str = "omega_dot";
pub const SLOSH_ANGLE: &str = "slosh_angle";
pub const SLOSH_RATE: &str = "slosh_rate";
pub const SLOSH_ANGLE_RADIAL: &str = "slosh_angle_radial";
pub const TAU_FRICTION: &str = "tau_friction";
pub const TAU_FLUID: &str = "tau_fluid";
pub const F_TANGENTIAL: &str = "F_tangential";
pub const F_RADIAL: &str = "F_radial";
pub const WAVE_HEIGHT: &str = "wave_height";
pub const OMEGA_IMU: &str = "omega_imu";
pub const TAU_CMD: &str = "tau_cmd";
pub const TAU_EXT: &str = "tau_ext";
pub const G_AXIAL: &str = "g_axial";
pub const SLOSH_RATE_RADIAL: &str = "slosh_rate_radial";
pub const TAU_GRAVITY: &str = "tau_gravity";
pub const TAU_SUSPENSION: &str = "tau_suspension";
pub const ENERGY: &str = "energy";
pub const MOMENTUM: &str = "momentum";
pub const POWER_DISSIPATED: &str = "power_dissipated";
pub const WORK: &str = "work";
pub const HEAT: &str = "heat";
pub const WORK_AXIAL: &str = "work_axial";
pub const TAU_ACTUATOR: &str = "tau_actuator";
pub const WHEEL_SPEED: &str = "wheel_speed";
pub const STUCK: &str = "stuck";
pub const STUCK_KIND: &str = "stuck_kind";
pub const REGIME: &str = "regime";
pub const IN_RANGE: &str = "in_range";
pub const IN_RANGE_KIND: &str = "in_range_kind";
pub const LIMITED_BY: &str = "limited_by";
pub const LIMITED_BY_KIND: &str = "limited_by_kind";
pub const FRICTION_MODE: &str = "friction_mode";
pub const EVENT_COUNT: &str = "event_count";
pub const EVENT_TIME: &str = "event_time";
pub const STUCK_TIME: &str = "stuck_time";
pub const BRISTLE: &str = "bristle";

pub mod slosh {
    pub const DAMPING: crate::Array<1> = crate::Array("slosh.damping");
    pub const Q_RADIAL: crate::Array<1> = crate::Array("slosh.q_radial");
    pub const Q_TANGENTIAL: crate::Array<1> = crate::Array("slosh.q_tangential");
    pub const V_RADIAL: crate::Array<1> = crate::Array("slosh.v_radial");
    pub const V_TANGENTIAL: crate::Array<1> = crate::Array("slosh.v_tangential");
    pub const MODEL: &str = "slosh.model";
    pub const KIND: &str = "slosh.kind";
    pub const SOURCE: &str = "slosh.source";
    pub const SOURCE_KIND: &str = "slosh.source_kind";
    pub const MODES: &str = "slosh.modes";
    pub const MOST_MODES: usize = 10;
    pub const ZETA_FROM_CORRELATION: &str = "slosh.zeta_from_correlation";
    pub const ZETA_FROM_CORRELATION_KIND: &str = "slosh.zeta_from_correlation_kind";
    pub const ZETA: &str = "slosh.zeta";
    pub const DAMPING_LAW: &str = "slosh.damping_law";
    pub const DAMPING_LAW_KIND: &str = "slosh.damping_law_kind";
    pub const ZETA_AMPLITUDE: &str = "slosh.zeta_amplitude";
    pub const ZETA_BREAKING: &str = "slosh.zeta_breaking";
    pub const BREAKING_STEEPNESS: &str = "slosh.breaking_steepness";
    pub const CAPILLARITY: &str = "slosh.capillarity";
    pub const CAPILLARITY_KIND: &str = "slosh.capillarity_kind";
    pub const MASS: crate::Array<1> = crate::Array("slosh.mass");
    pub const LENGTH: crate::Array<1> = crate::Array("slosh.length");
    pub const FREQUENCY: crate::Array<1> = crate::Array("slosh.frequency");

    pub mod table {
        pub const ONE_AXIS: &str = "slosh.table.one_axis";
        pub const ONE_AXIS_KIND: &str = "slosh.table.one_axis_kind";
        pub const M_LIQ: &str = "slosh.table.m_liq";
        pub const G_REF: &str = "slosh.table.g_ref";
        pub const MASS: crate::Array<1> = crate::Array("slosh.table.mass");
        pub const LENGTH: crate::Array<1> = crate::Array("slosh.table.length");
        pub const FREQUENCY: crate::Array<1> = crate::Array("slosh.table.frequency");
        pub const HINGE: crate::Array<1> = crate::Array("slosh.table.hinge");
        pub const K: crate::Array<1> = crate::Array("slosh.table.k");
        pub const ZETA: crate::Array<1> = crate::Array("slosh.table.zeta");
        pub const WAVE: crate::Array<1> = crate::Array("slosh.table.wave");
        pub const WAVE_NUMBER: crate::Array<1> = crate::Array("slosh.table.wave_number");
        pub const NONLINEAR_INERTIA: crate::Array<1> =
            crate::Array("slosh.table.nonlinear_inertia");
        pub const NONLINEAR_STIFFNESS: crate::Array<1> =
            crate::Array("slosh.table.nonlinear_stiffness");
        pub const ANGLE_LIMIT: crate::Array<1> = crate::Array("slosh.table.angle_limit");
        pub const SWIRL_LIMIT: crate::Array<1> = crate::Array("slosh.table.swirl_limit");
        pub const DIRECTION: crate::Array<1> = crate::Array("slosh.table.direction");
    }
}

pub mod baffle {
    pub const ZETA: &str = "baffle.zeta";
    pub const WAVE: &str = "baffle.wave";
    pub const IN_RANGE: &str = "baffle.in_range";
    pub const IN_RANGE_KIND: &str = "baffle.in_range_kind";
    pub const WIDTH: &str = "baffle.width";
    pub const DEPTH: &str = "baffle.depth";
}

pub mod hub {
    pub const I: &str = "hub.I";
    pub const IMBALANCE: &str = "hub.imbalance";
    pub const IMBALANCE_ANGLE: &str = "hub.imbalance_angle";
    pub const K: &str = "hub.k";
    pub const THETA_0: &str = "hub.theta_0";
    pub const C: &str = "hub.c";
}

pub mod bench {
    pub const TILT: &str = "bench.tilt";
    pub const TILT_AZIMUTH: &str = "bench.tilt_azimuth";
}

pub mod tank {
    pub const D: &str = "tank.d";
    pub const H: &str = "tank.h";
    pub const R: &str = "tank.r";
    pub const I_OWN: &str = "tank.I_own";
    pub const M_LIQ: &str = "tank.m_liq";
    pub const M_0: &str = "tank.m_0";
    pub const BOND: &str = "tank.bond";
}

pub mod fluid {
    pub const RHO: &str = "fluid.rho";
    pub const NU: &str = "fluid.nu";
    pub const SIGMA: &str = "fluid.sigma";
}

pub mod friction {
    pub const MODEL: &str = "friction.model";
    pub const KIND: &str = "friction.kind";
    pub const B: &str = "friction.b";
    pub const C: &str = "friction.c";
    pub const D: &str = "friction.d";
    pub const OMEGA_S: &str = "friction.omega_s";
    pub const EPS: &str = "friction.eps";
    pub const SIGMA0: &str = "friction.sigma0";
    pub const SIGMA1: &str = "friction.sigma1";
    pub const ASYMMETRY: &str = "friction.asymmetry";
    pub const FORWARD_COS1: &str = "friction.forward_cos1";
    pub const FORWARD_SIN1: &str = "friction.forward_sin1";
    pub const FORWARD_COS2: &str = "friction.forward_cos2";
    pub const FORWARD_SIN2: &str = "friction.forward_sin2";
    pub const BACKWARD_COS1: &str = "friction.backward_cos1";
    pub const BACKWARD_SIN1: &str = "friction.backward_sin1";
    pub const BACKWARD_COS2: &str = "friction.backward_cos2";
    pub const BACKWARD_SIN2: &str = "friction.backward_sin2";
}

pub mod init {
    pub const THETA: &str = "init.theta";
    pub const OMEGA: &str = "init.omega";
    pub const SLOSH_ANGLE: &str = "init.slosh_angle";
    pub const SLOSH_ANGLE_RADIAL: &str = "init.slosh_angle_radial";
    pub const SLOSH_RATE: &str = "init.slosh_rate";
    pub const SLOSH_RATE_RADIAL: &str = "init.slosh_rate_radial";
}

pub mod wheel {
    pub const ENABLED: &str = "wheel.enabled";
    pub const ENABLED_KIND: &str = "wheel.enabled_kind";
    pub const I: &str = "wheel.I";
    pub const SPEED_0: &str = "wheel.speed_0";
    pub const SPEED_MIN: &str = "wheel.speed_min";
    pub const SPEED_MAX: &str = "wheel.speed_max";
    pub const TAU_MAX: &str = "wheel.tau_max";
}

pub mod imu {
    pub const ENABLED: &str = "imu.enabled";
    pub const ENABLED_KIND: &str = "imu.enabled_kind";
    pub const RATE: &str = "imu.rate";
    pub const ARW: &str = "imu.arw";
    pub const BIAS_INSTABILITY: &str = "imu.bias_instability";
    pub const BIAS_TIME: &str = "imu.bias_time";
    pub const FLICKER: &str = "imu.flicker";
    pub const RRW: &str = "imu.rrw";
    pub const LSB: &str = "imu.lsb";
    pub const SEED: &str = "imu.seed";
}

pub mod solver {
    pub const MAX_STEPS: &str = "solver.max_steps";
}

/// Parameters that determine the sizes of arrays.
#[rustfmt::skip]
pub const SIZES: &[crate::Size] = &[
    crate::Size {
        parameter: "slosh.modes",
        most: 10,
        has_indicators: false,
        arrays: &[
            ("slosh.damping", 0), ("slosh.q_radial", 0), ("slosh.q_tangential", 0),
            ("slosh.v_radial", 0), ("slosh.v_tangential", 0), ("der(slosh.q_radial)", 0),
            ("der(slosh.q_tangential)", 0), ("der(slosh.v_radial)", 0),
            ("der(slosh.v_tangential)", 0), ("slosh.mass", 0), ("slosh.length", 0),
            ("slosh.frequency", 0),
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
    SloshModel: Frozen = 1 "frozen", Linear = 2 "linear", Planar = 3 "planar", Spherical = 4 "spherical", Liquid = 5 "liquid"
}

enumeration! {
    SloshSource: Geometry = 1 "geometry", Table = 2 "table"
}

enumeration! {
    DampingLaw: Laminar = 1 "laminar", ConstantRatio = 2 "constant_ratio", BySource = 3 "by_source"
}

enumeration! {
    FrictionModel: None = 1 "none", Viscous = 2 "viscous", StribeckSmooth = 3 "stribeck_smooth", Stribeck = 4 "stribeck", Lugre = 5 "lugre"
}

//! The table of all torque profiles. The parser, `--help`, the keys `profile.…` of plans, a table of the
//! documentation and the torque functions are all generated from it.

use std::sync::Arc;

use analysis::sweep::{Law, Sweep};
use files::budget::FREQUENCY;

use super::Values;
use super::noise::Noise;
use super::shape::{Dwell, Piece, Pieces, Shape};

/// A kind of torque history, with times in s, frequencies in Hz and torques in N·m. `description` is for
/// readers of help and documentation. Every kind has the parameter `duration`. `demands` are conditions on
/// several parameters, and `shape` creates the torque from allowed values.
#[derive(Debug)]
pub struct Kind {
    pub name: &'static str,
    pub description: &'static str,
    pub parameters: &'static [Parameter],
    pub(super) demands: &'static [Demand],
    pub(super) shape: fn(&Values) -> Arc<dyn Shape>,
}

pub(super) type Demand = (fn(&Values) -> bool, &'static str);

/// A parameter of a profile or a sensor: its name, default, unit (empty without one), label on axes, and
/// allowed values.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    pub name: &'static str,
    pub default: f64,
    pub unit: &'static str,
    pub label: &'static str,
    pub allowed: Allowed,
}

/// Allowed values of a parameter, all of which are finite: numbers with an absolute value up to the limit
/// (`Within`), whole numbers from 0 to the limit (`Whole`), and others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Allowed {
    Any,
    NotZero,
    Positive,
    NotNegative,
    Within(f64),
    Whole(f64),
}

impl Allowed {
    /// Returns what is wrong with a value, as a phrase that a message puts after the parameter's name;
    /// `None` for an allowed value.
    pub(super) fn fault(self, value: f64) -> Option<String> {
        let (met, demand) = match self {
            Allowed::Any => (true, String::new()),
            Allowed::NotZero => (value != 0.0, "must not be 0; use zero".into()),
            Allowed::Positive => (value > 0.0, "must be positive".into()),
            Allowed::NotNegative => (value >= 0.0, "must not be negative".into()),
            Allowed::Within(most) => {
                (value.abs() <= most, format!("must be from -{most} to {most}"))
            }
            Allowed::Whole(most) => (
                (0.0..=most).contains(&value) && value.fract() == 0.0,
                format!("expects a whole number from 0 to {most:e}"),
            ),
        };
        (!met).then_some(demand)
    }
}

impl Parameter {
    /// Parses a number in the parameter's unit. Angles may be in degrees (90deg) and lengths in mm (5mm).
    pub(super) fn number(&self, text: &str) -> Option<f64> {
        let (text, factor) = match self.unit {
            "rad" => text.strip_suffix("deg").map_or((text, 1.0), |t| (t, 1f64.to_radians())),
            "m" => text.strip_suffix("mm").map_or((text, 1.0), |t| (t, 1e-3)),
            _ => (text, 1.0),
        };
        text.trim().parse().ok().map(|number: f64| number * factor)
    }
}

pub(crate) const fn parameter(
    name: &'static str,
    default: f64,
    unit: &'static str,
    label: &'static str,
    allowed: Allowed,
) -> Parameter {
    Parameter { name, default, unit, label, allowed }
}

const fn duration(default: f64) -> Parameter {
    parameter("duration", default, "s", "duration", Allowed::Positive)
}

const fn time(name: &'static str, default: f64, label: &'static str) -> Parameter {
    parameter(name, default, "s", label, Allowed::NotNegative)
}

const fn sweep_from(first: Allowed) -> [Parameter; 4] {
    [
        parameter(
            "amplitude",
            Sweep::THESIS.amplitude,
            "N·m",
            "torque amplitude",
            Allowed::NotZero,
        ),
        parameter("f0", Sweep::THESIS.f0, "Hz", "first frequency", first),
        parameter("f1", Sweep::THESIS.f1, "Hz", "last frequency", Allowed::Positive),
        duration(Sweep::THESIS.duration),
    ]
}
const MOVES: Demand = (|v| v.value("f0") != v.value("f1"), "f0 and f1 are equal; use sine");
/// Condition on the frequencies of a profile. Outside the allowed range the phase of the sine would
/// have no valid digits.
const BAND: Demand = (
    |v| ["f0", "f1"].iter().all(|name| (1.0 / FREQUENCY..=FREQUENCY).contains(&v.value(name))),
    "f0 and f1 must be from 1e-9 to 1e9 Hz",
);

const BAND_FROM_ZERO: Demand = (
    |v| {
        let band = 1.0 / FREQUENCY..=FREQUENCY;
        let (f0, f1) = (v.value("f0"), v.value("f1"));
        (f0 == 0.0 || band.contains(&f0)) && band.contains(&f1)
    },
    "f0 must be 0 or, as f1, from 1e-9 to 1e9 Hz",
);
const NOISE_BAND: [Demand; 2] =
    [(|v| v.value("f0") < v.value("f1"), "f0 must be less than f1"), BAND_FROM_ZERO];

fn noise(v: &Values) -> Noise {
    let [rms, f0, f1, exponent, seed, limit] =
        ["rms", "f0", "f1", "exponent", "seed", "limit"].map(|n| v.value(n));
    Noise::new(rms, (f0, f1), exponent, seed as u64, limit)
}

fn dwell(v: &Values) -> Dwell {
    Dwell { amplitude: v.value("amplitude"), frequency: v.value("frequency") }
}

fn sweep(v: &Values, law: Law) -> Arc<dyn Shape> {
    let [amplitude, f0, f1, duration] = ["amplitude", "f0", "f1", "duration"].map(|n| v.value(n));
    Arc::new(Sweep { amplitude, f0, f1, duration, law })
}

fn pieces(list: impl Into<Vec<Piece>>) -> Arc<dyn Shape> {
    Arc::new(Pieces(list.into()))
}

pub const KINDS: &[Kind] = &[
    Kind {
        name: "exp-sweep",
        description: "A sin φ, φ = 2π f0 (e^(at) - 1)/a, a = ln(f1/f0)/duration: a sine whose frequency changes exponentially from f0 to f1, upwards or downwards (thesis 5.1.4)",
        parameters: &sweep_from(Allowed::Positive),
        demands: &[MOVES, BAND],
        shape: |v| sweep(v, Law::Exponential),
    },
    Kind {
        name: "lin-sweep",
        description: "A sin φ, φ = 2π (f0 t + s t²/2), s = (f1 - f0)/duration: a sine whose frequency changes linearly in time",
        parameters: &sweep_from(Allowed::NotNegative),
        demands: &[MOVES, BAND_FROM_ZERO],
        shape: |v| sweep(v, Law::Linear),
    },
    Kind {
        name: "sine",
        description: "A sin 2πft: a sine of constant frequency",
        parameters: &[
            parameter("amplitude", 0.1, "N·m", "torque amplitude", Allowed::Any),
            parameter("frequency", 2.4, "Hz", "frequency", Allowed::Within(FREQUENCY)),
            duration(60.0),
        ],
        demands: &[],
        shape: |v| Arc::new(dwell(v)),
    },
    Kind {
        name: "constant",
        description: "constant torque",
        parameters: &[
            parameter("amplitude", 0.1, "N·m", "torque amplitude", Allowed::Any),
            duration(20.0),
        ],
        demands: &[],
        shape: |v| pieces([Piece::constant(v.value("amplitude"))]),
    },
    Kind {
        name: "pulse",
        description: "constant torque for `width` seconds from `start` on, otherwise no torque",
        parameters: &[
            parameter("amplitude", 0.05, "N·m", "torque amplitude", Allowed::Any),
            time("start", 0.0, "start of the torque"),
            time("width", 1.0, "length of the pulse"),
            duration(20.0),
        ],
        demands: &[],
        shape: |v| pieces([Piece::new(v.value("start"), v.value("width"), v.value("amplitude"))]),
    },
    Kind {
        name: "bang-stop-bang",
        description: "+amplitude for `bang` seconds from `start` on, no torque for `stop` seconds, then -amplitude for `bang` seconds: the hub is accelerated, coasts and is stopped (thesis 2.7.1)",
        parameters: &[
            parameter("amplitude", 0.1, "N·m", "torque amplitude", Allowed::Any),
            time("start", 0.0, "start of the torque"),
            time("bang", 1.0, "length of each pulse"),
            time("stop", 10.0, "time between the pulses"),
            duration(60.0),
        ],
        demands: &[],
        shape: |v| {
            let [amplitude, start, bang, stop] =
                ["amplitude", "start", "bang", "stop"].map(|n| v.value(n));
            pieces([
                Piece::new(start, bang, amplitude),
                Piece::new(start + bang + stop, bang, -amplitude),
            ])
        },
    },
    Kind {
        name: "acceleration-step",
        description: "constant torque `inertia` × `acceleration` for `width` seconds from `start` on, as by a reaction wheel whose speed changes linearly (thesis 2.7.1)",
        parameters: &[
            parameter("acceleration", 0.1, "rad/s²", "acceleration", Allowed::Any),
            // inertia of the hub with its liquid, hub.I + tank.m_liq tank.r², at the FMU's start values
            parameter("inertia", 0.428054, "kg·m²", "inertia", Allowed::Positive),
            time("start", 1.0, "start of the torque"),
            time("width", 5.0, "length of the pulse"),
            duration(60.0),
        ],
        demands: &[],
        shape: |v| {
            let torque = v.value("inertia") * v.value("acceleration");
            pieces([Piece::new(v.value("start"), v.value("width"), torque)])
        },
    },
    Kind {
        name: "noise",
        description: "band-limited noise with a power density proportional to f^exponent (0 white, -1 pink, -2 brown), clipped at ±limit",
        parameters: &[
            parameter("rms", 0.05, "N·m", "torque, rms", Allowed::Positive),
            parameter("f0", 1.25, "Hz", "lowest frequency", Allowed::NotNegative),
            parameter("f1", 3.5, "Hz", "highest frequency", Allowed::Positive),
            parameter("exponent", 0.0, "", "spectral exponent", Allowed::Within(10.0)),
            parameter("seed", 1.0, "", "seed", Allowed::Whole(9e15)),
            parameter("limit", 0.26, "N·m", "torque limit", Allowed::Positive), // the wheel's (thesis 5.1.3)
            duration(600.0),
        ],
        demands: &[
            NOISE_BAND[0],
            NOISE_BAND[1],
            (
                |v| v.value("rms") <= v.value("limit") / 2.0,
                "rms must be at most half of limit (else too much of it is clipped)",
            ),
        ],
        shape: |v| Arc::new(noise(v)),
    },
    Kind {
        name: "sine-noise",
        description: "A sin 2πft plus the noise of the profile `noise`, the sum clipped at ±limit: a steady wave, with noise that excites the other modes (thesis 8.6.1)",
        parameters: &[
            parameter("amplitude", 0.1, "N·m", "torque amplitude of the sine", Allowed::Any),
            parameter("frequency", 2.4, "Hz", "frequency of the sine", Allowed::Within(FREQUENCY)),
            parameter("rms", 0.03, "N·m", "torque of the noise, rms", Allowed::Positive),
            parameter("f0", 0.0, "Hz", "lowest frequency of the noise", Allowed::NotNegative),
            parameter("f1", 20.0, "Hz", "highest frequency of the noise", Allowed::Positive),
            parameter("exponent", 0.0, "", "spectral exponent", Allowed::Within(10.0)),
            parameter("seed", 1.0, "", "seed", Allowed::Whole(9e15)),
            parameter("limit", 0.26, "N·m", "torque limit", Allowed::Positive),
            duration(600.0),
        ],
        demands: &[
            NOISE_BAND[0],
            NOISE_BAND[1],
            (
                |v| v.value("amplitude").abs() + 2.0 * v.value("rms") <= v.value("limit"),
                "amplitude and twice rms together must be within limit (else too much is clipped)",
            ),
        ],
        shape: |v| Arc::new(Noise { sine: Some(dwell(v)), ..noise(v) }),
    },
    Kind {
        name: "zero",
        description: "no torque",
        parameters: &[duration(20.0)],
        demands: &[],
        shape: |_| pieces([]),
    },
];

pub const FILE: (&str, &str) = (
    "file:path=FILE,hold=false",
    "the rows of a CSV or Parquet file with the columns `time` and `tau_cmd`, interpolated linearly, or held with hold=true; a relative path begins at the current directory",
);

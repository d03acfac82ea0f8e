//! A mass on a spring,
//!
//! ```text
//! m x'' = F - d x' - k x
//! ```
//!
//! integrated with Runge-Kutta 4 in steps of 1 ms at most; the force is a line over a step.

use runtime::Model;
use runtime::table::{About, Scalar, Table, scalar_count, scalars};
use runtime::variable::Variable;

/// Parameters: mass (kg), damping (N s/m), stiffness (N/m), initial displacement (m).
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct Parameters {
    pub m: f64,
    pub d: f64,
    pub k: f64,
    pub x0: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Parameters { m: 1.0, d: 0.1, k: 10.0, x0: 0.1 }
    }
}

/// The force and its slope, N, N/s.
#[derive(Clone, Copy, Debug, Default)]
pub struct Force([f64; 2]);

/// Acceleration and energy.
#[derive(Clone, Copy, Debug)]
pub struct Outputs {
    a: f64,
    energy: f64,
}

/// Displacement and velocity, and the parameters.
#[derive(Clone, Debug)]
pub struct Spring {
    p: Parameters,
    time: f64,
    x: [f64; 2],
}

impl Spring {
    fn rate(&self, [x, v]: [f64; 2], force: f64) -> [f64; 2] {
        [v, (force - self.p.d * v - self.p.k * x) / self.p.m]
    }
}

type V = Variable<Spring>;

#[rustfmt::skip]
static VARIABLES: &[Variable<Spring>] = &[
    V::output("x", |_, _| 0.0, "m", "Displacement").is_state(|_| 0)
        .depends_on(&["x"]).initial_depends_on(&["x0"]),
    V::output("a", |o, _| o.a, "m/s2", "Acceleration")
        .depends_on(&["x", "v", "F"]).initial_depends_on(&["x0", "m", "d", "k"]),
    V::input("F", |f, _| f.0.each_mut(), "N", "Force, positive towards +x"),
    V::state("v", |_| 1, "m/s", "Velocity").depends_on(&["v"]),
    V::local("energy", |o, _| o.energy, "J", "Kinetic and potential energy").depends_on(&["x", "v"]),
    V::derivative("der(x)", |_| 0, "m/s", "Derivative of x").depends_on(&["v"]),
    V::derivative("der(v)", |_| 1, "m/s2", "Derivative of v")
        .depends_on(&["x", "v", "F"]).initial_depends_on(&["x0", "m", "d", "k"]),
    V::parameter("m", |p, _| &mut p.m, "kg", "Mass").range(1e-3, 1e3),
    V::parameter("d", |p, _| &mut p.d, "kg/s", "Damping").at_least(0.0),
    V::parameter("k", |p, _| &mut p.k, "N/m", "Stiffness").at_least(0.0),
    V::parameter("x0", |p, _| &mut p.x0, "m", "Displacement at the start"),
    V::calculated("f", |s, _| (s.p.k / s.p.m).sqrt() / std::f64::consts::TAU, "Hz",
        "Natural frequency without damping").initial_depends_on(&["m", "k"]),
];

static SCALARS: [Scalar<Spring>; scalar_count(VARIABLES)] = scalars(VARIABLES);

static TABLE: Table<Spring> = Table::new(
    About {
        model: "Spring",
        version: env!("CARGO_PKG_VERSION"),
        description: "A mass on a spring",
        events: "",
        event_indicators: 0,
        saved_words: 3,
    },
    VARIABLES,
    &SCALARS,
);

impl Model for Spring {
    type Parameters = Parameters;
    type Inputs = Force;
    type Outputs = Outputs;
    type Discrete = ();

    fn table() -> &'static Table<Self> {
        &TABLE
    }

    fn new(p: &Parameters, _: &Force, time: f64, _: f64) -> Result<Self, Vec<String>> {
        Ok(Spring { p: *p, time, x: [p.x0, 0.0] })
    }

    fn save(&self, words: &mut Vec<u64>) {
        words.extend([self.time, self.x[0], self.x[1]].map(f64::to_bits));
    }

    fn resume(p: &Parameters, words: &[u64], _: f64) -> Option<Self> {
        let [time, x, v] = <[u64; 3]>::try_from(words).ok()?.map(f64::from_bits);
        [time, x, v].iter().all(|x| x.is_finite()).then_some(Spring { p: *p, time, x: [x, v] })
    }

    fn step(&mut self, force: &Force, h: f64) -> Result<(), String> {
        let steps = (h / 1e-3).ceil();
        if steps > 1e6 {
            return Err(format!("h = {h} s takes more than 1e6 internal steps"));
        }
        let (dt, mut x) = (h / steps, self.x);
        for n in 0..steps as usize {
            let at = |s: f64| force.0[0] + force.0[1] * (n as f64 + s) * dt;
            let moved = |k: [f64; 2], s: f64| [x[0] + s * dt * k[0], x[1] + s * dt * k[1]];
            let k1 = self.rate(x, at(0.0));
            let k2 = self.rate(moved(k1, 0.5), at(0.5));
            let k3 = self.rate(moved(k2, 0.5), at(0.5));
            let k4 = self.rate(moved(k3, 1.0), at(1.0));
            x = [0, 1].map(|i| x[i] + dt * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0);
        }
        (self.x, self.time) = (x, self.time + h);
        Ok(())
    }

    fn outputs(&mut self, force: &Force) -> Outputs {
        let ([x, v], p) = (self.x, self.p);
        Outputs { a: self.rate(self.x, force.0[0])[1], energy: (p.m * v * v + p.k * x * x) / 2.0 }
    }

    fn continuous_states(&self) -> &[f64] {
        &self.x
    }

    fn set_continuous_states(&mut self, x: &[f64]) {
        self.x.copy_from_slice(x);
    }

    fn set_time(&mut self, time: f64) {
        self.time = time;
    }

    fn derivatives(&mut self, force: &Force, x_dot: &mut [f64]) {
        x_dot.copy_from_slice(&self.rate(self.x, force.0[0]));
    }

    fn directional_derivative(&mut self, f: &Force, dx: &[f64], dx_dot: &mut [f64]) -> Outputs {
        dx_dot.copy_from_slice(&self.rate([dx[0], dx[1]], f.0[1]));
        let energy = self.p.m * self.x[1] * dx[1] + self.p.k * self.x[0] * dx[0];
        Outputs { a: dx_dot[1], energy }
    }
}

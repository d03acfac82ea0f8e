//! A mass on a spring, m x'' = F - d x' - k x, integrated by Runge-Kutta 4 with steps of at most 1 ms.

use runtime::model::{Dynamics, Instant, Model, StepFailure};
use runtime::table::{About, Scalar, Table, scalar_count, scalars};
use runtime::variable::Variable;

/// Parameters: mass, kg; damping, N s/m; stiffness, N/m; initial displacement, m.
#[derive(Clone, Copy, Debug)]
pub struct Parameters {
    m: f64,
    d: f64,
    k: f64,
    x0: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Parameters { m: 1.0, d: 0.1, k: 10.0, x0: 0.1 }
    }
}

#[derive(Clone, Debug)]
pub struct Spring {
    p: Parameters,
    x: [f64; 2], // displacement (m) and velocity (m/s)
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
    V::output("a", |a, _| *a, "m/s2", "Acceleration")
        .depends_on(&["x", "v", "F"]).initial_depends_on(&["x0", "m", "d", "k"]),
    V::input("F", |f, _| f.each_mut(), "N", "Force, positive towards +x"),
    V::state("v", |_| 1, "m/s", "Velocity").depends_on(&["v"]),
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
        saved_words: 2,
    },
    VARIABLES,
    &SCALARS,
);

impl Model for Spring {
    fn table() -> &'static Table<Self> {
        &TABLE
    }
}

impl Dynamics for Spring {
    type Parameters = Parameters;
    type Inputs = [f64; 2]; // the force and its slope, N, N/s
    type Outputs = f64; // the acceleration, m/s2
    type Discrete = ();

    fn new(p: &Parameters, _: &[f64; 2], _: f64, _: f64) -> Result<Self, Vec<String>> {
        Ok(Spring { p: *p, x: [p.x0, 0.0] })
    }

    fn save(&self, words: &mut Vec<u64>) {
        words.extend(self.x.map(f64::to_bits));
    }

    fn resume(p: &Parameters, words: &[u64], _: f64) -> Option<Self> {
        let x = <[u64; 2]>::try_from(words).ok()?.map(f64::from_bits);
        x.iter().all(|x| x.is_finite()).then_some(Spring { p: *p, x })
    }

    fn step(&mut self, [force, slope]: &[f64; 2], h: f64) -> Result<(), StepFailure> {
        let steps = (h / 1e-3).ceil();
        (steps <= 1e6).then_some(()).ok_or("it takes more than 1e6 internal steps")?;
        let (dt, mut x) = (h / steps, self.x);
        for n in 0..steps as usize {
            let at = |s: f64| force + slope * (n as f64 + s) * dt;
            let moved = |k: [f64; 2], s: f64| [x[0] + s * dt * k[0], x[1] + s * dt * k[1]];
            let k1 = self.rate(x, at(0.0));
            let k2 = self.rate(moved(k1, 0.5), at(0.5));
            let k3 = self.rate(moved(k2, 0.5), at(0.5));
            let k4 = self.rate(moved(k3, 1.0), at(1.0));
            x = [0, 1].map(|i| x[i] + dt * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0);
        }
        self.x = x;
        Ok(())
    }

    fn outputs(&mut self, [force, _]: &[f64; 2]) -> f64 {
        self.rate(self.x, *force)[1]
    }

    fn continuous_states(&self) -> &[f64] {
        &self.x
    }

    fn set_continuous_states(&mut self, x: &[f64]) {
        self.x.copy_from_slice(x);
    }

    fn set_time(&mut self, _: Instant) {}

    fn derivatives(&mut self, [force, _]: &[f64; 2], x_dot: &mut [f64]) {
        x_dot.copy_from_slice(&self.rate(self.x, *force));
    }

    fn directional_derivative(
        &mut self,
        _: &[f64; 2],
        [_, slope]: &[f64; 2],
        dx: &[f64],
        dx_dot: &mut [f64],
    ) -> f64 {
        dx_dot.copy_from_slice(&self.rate([dx[0], dx[1]], *slope));
        dx_dot[1]
    }
}

//! A PD controller with a low-pass filter: t_f tau' = -k_p theta - k_d omega - tau.
//!
//! The output tau is a state, so that no input acts on tau at once. A loop with this controller therefore
//! has one result, independent of the order in which a master reads outputs and sets inputs.

use runtime::model::{Dynamics, Instant, Model, StepFailure};
use runtime::table::{About, Scalar, Table, scalar_count, scalars};
use runtime::variable::Variable;

/// Parameters of the controller: gains of angle (N m/rad) and rate (N m s/rad), and time constant
/// of the filter (s).
#[derive(Clone, Copy, Debug)]
pub struct Parameters {
    k_p: f64,
    k_d: f64,
    t_f: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        // 0.5 Hz and a damping ratio of 0.7 on 0.428 kg·m²
        Parameters { k_p: 4.22, k_d: 1.88, t_f: 0.02 }
    }
}

/// Inputs of the controller: errors of angle (rad) and rate (rad/s), each with its time derivative.
#[derive(Clone, Copy, Debug, Default)]
pub struct Inputs {
    theta: [f64; 2],
    omega: [f64; 2],
}

#[derive(Clone, Debug)]
pub struct Controller {
    p: Parameters,
    tau: [f64; 1],
}

type V = Variable<Controller>;

#[rustfmt::skip]
static VARIABLES: &[Variable<Controller>] = &[
    V::output("tau", |_, _| 0.0, "N.m", "Torque command").is_state(|_| 0)
        .depends_on(&["tau"]),
    V::input("theta", |i, _| i.theta.each_mut(), "rad", "Angle minus its reference"),
    V::input("omega", |i, _| i.omega.each_mut(), "rad/s", "Rate minus its reference"),
    V::derivative("der(tau)", |_| 0, "N.m/s", "Derivative of tau")
        .depends_on(&["tau", "theta", "omega"]).initial_depends_on(&["k_p", "k_d", "t_f"]),
    V::parameter("k_p", |p, _| &mut p.k_p, "N.m/rad", "Gain of the angle").at_least(0.0),
    V::parameter("k_d", |p, _| &mut p.k_d, "N.m.s/rad", "Gain of the rate").at_least(0.0),
    V::parameter("t_f", |p, _| &mut p.t_f, "s", "Time constant of the filter").range(1e-6, 1e3),
];

static SCALARS: [Scalar<Controller>; scalar_count(VARIABLES)] = scalars(VARIABLES);

static TABLE: Table<Controller> = Table::new(
    About {
        model: "Controller",
        version: env!("CARGO_PKG_VERSION"),
        description: "PD controller with a low-pass filter",
        events: "",
        event_indicators: 0,
        saved_words: 1,
    },
    VARIABLES,
    &SCALARS,
);

impl Controller {
    /// Returns the torque of the control law, N m, before the filter. The output tau follows it
    /// with the filter's time constant.
    fn unfiltered(&self, theta: f64, omega: f64) -> f64 {
        -self.p.k_p * theta - self.p.k_d * omega
    }
}

impl Model for Controller {
    fn table() -> &'static Table<Self> {
        &TABLE
    }
}

impl Dynamics for Controller {
    type Parameters = Parameters;
    type Inputs = Inputs;
    type Outputs = ();
    type Discrete = ();

    fn new(p: &Parameters, _: &Inputs, _: f64, _: f64) -> Result<Self, Vec<String>> {
        Ok(Controller { p: *p, tau: [0.0] })
    }

    fn save(&self, words: &mut Vec<u64>) {
        words.extend(self.tau.map(f64::to_bits));
    }

    fn resume(p: &Parameters, words: &[u64], _: f64) -> Option<Self> {
        let tau = <[u64; 1]>::try_from(words).ok()?.map(f64::from_bits);
        tau[0].is_finite().then_some(Controller { p: *p, tau })
    }

    /// Advances the filter by h seconds. The result is exact for inputs that change linearly: with
    /// the unfiltered torque v(t) = v0 + v1 t and the filter's time constant t_f, the output is
    ///
    /// ```text
    /// tau(h) = v(h) - t_f v1 + (tau(0) - v0 + t_f v1) exp(-h/t_f)
    /// ```
    fn step(&mut self, Inputs { theta, omega }: &Inputs, h: f64) -> Result<(), StepFailure> {
        let [v0, v1] = [0, 1].map(|k| self.unfiltered(theta[k], omega[k]));
        let lag = self.p.t_f * v1;
        self.tau[0] = v0 + v1 * h - lag + (self.tau[0] - v0 + lag) * (-h / self.p.t_f).exp();
        Ok(())
    }

    fn outputs(&mut self, _: &Inputs) {}

    fn continuous_states(&self) -> &[f64] {
        &self.tau
    }

    fn set_continuous_states(&mut self, x: &[f64]) {
        self.tau.copy_from_slice(x);
    }

    fn set_time(&mut self, _: Instant) {}

    fn derivatives(&mut self, inputs: &Inputs, x_dot: &mut [f64]) {
        x_dot[0] = (self.unfiltered(inputs.theta[0], inputs.omega[0]) - self.tau[0]) / self.p.t_f;
    }

    fn directional_derivative(
        &mut self,
        _: &Inputs,
        Inputs { theta, omega }: &Inputs,
        dx: &[f64],
        dx_dot: &mut [f64],
    ) {
        dx_dot[0] = (self.unfiltered(theta[1], omega[1]) - dx[0]) / self.p.t_f;
    }
}

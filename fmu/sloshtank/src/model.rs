//! The tank as a model of the runtime.

use std::ops::{Deref, DerefMut};

use craft::{
    Coupling, Craft, SloshTank, SloshTankOutputs, TANK_INPUTS, TANK_STATES, TankInputs,
    TankParameters, TankState,
};
use runtime::table::Table;

use crate::table::TABLE;

/// Coupling by the total wrench, both sides extrapolated, is stable up to 2/sqrt(3) - 1 = 0.155.
const LIMIT: f64 = 0.15;

/// One tank.
#[derive(Clone, Debug)]
pub struct Model {
    tank: SloshTank,
    coupling_ratio: f64,
}

impl Model {
    /// Largest eigenvalue of the host's inverse mass matrix times the added mass; 0 if the host's
    /// mass is not known.
    pub fn coupling_ratio(&self) -> f64 {
        self.coupling_ratio
    }
}

/// The tank's parameters; the number of modes is an integer here, and a host without mass is none.
#[derive(Clone, Debug)]
pub struct Parameters {
    tank: TankParameters,
    /// The coupling's number if it is not 0, for hosts that set no enumerations.
    pub coupling_kind: i32,
    /// Number of slosh modes.
    pub modes: i32,
    /// Number of points of the tank's table.
    pub points: i32,
    /// The host's mass properties; mass 0: not known.
    pub host: Craft,
}

impl Default for Parameters {
    fn default() -> Self {
        let tank = TankParameters::default();
        let host = Craft { mass: 0.0, ..craft::Parameters::default().craft };
        let (modes, points) = (tank.tank.modes as i32, tank.tank.fill.points as i32);
        Parameters { coupling_kind: 0, modes, points, host, tank }
    }
}

impl Deref for Parameters {
    type Target = TankParameters;

    fn deref(&self) -> &TankParameters {
        &self.tank
    }
}

impl DerefMut for Parameters {
    fn deref_mut(&mut self) -> &mut TankParameters {
        &mut self.tank
    }
}

impl Parameters {
    /// What the tank is made of. `coupling_kind` may not contradict a `coupling` that has been set.
    fn resolved(&self) -> Result<TankParameters, Vec<String>> {
        let mut p = self.tank;
        let (coupling, kind) = (p.coupling as i32, self.coupling_kind);
        if kind != 0 && p.coupling != TankParameters::default().coupling && coupling != kind {
            return Err(vec![format!(
                "coupling_kind = {kind} contradicts coupling = {coupling} (allowed: 0, or the same number; coupling \
                 left at its start value)"
            )]);
        }
        if let Some(coupling) = usize::try_from(kind - 1).ok().and_then(|i| Coupling::ALL.get(i)) {
            p.coupling = *coupling;
        }
        p.tank.modes = usize::try_from(self.modes).unwrap_or(0);
        p.tank.fill.points = usize::try_from(self.points).unwrap_or(0);
        p.host = (self.host.mass > 0.0).then_some(self.host);
        Ok(p)
    }
}

/// The host's motion. A slope that a host gives for omega is not used: it follows from omega_dot.
#[derive(Clone, Copy, Debug, Default)]
pub struct Inputs {
    /// As the tank takes it.
    pub tank: TankInputs,
    /// The slope of omega, rad/s2.
    pub omega_slope: [f64; 3],
}

impl runtime::Model for Model {
    type Parameters = Parameters;
    type Inputs = Inputs;
    type Outputs = SloshTankOutputs;
    type Discrete = ();

    const OUTPUTS_USE_SLOPES: bool = true;

    fn table() -> &'static Table<Self> {
        &TABLE
    }

    fn new(
        parameters: &Parameters,
        inputs: &Inputs,
        start_time: f64,
        tolerance: f64,
    ) -> Result<Self, Vec<String>> {
        let p = parameters.resolved()?;
        let mut tank = SloshTank::new(&p, &inputs.tank, start_time, tolerance)?;
        let coupling_ratio = tank.coupling_ratio().unwrap_or(0.0);
        Ok(Model { tank, coupling_ratio })
    }

    fn warnings(&self, parameters: &Parameters, _: &Inputs) -> Vec<String> {
        let ratio = self.coupling_ratio;
        let is_split = parameters.resolved().is_ok_and(|p| p.coupling == Coupling::Split);
        if !is_split || ratio <= LIMIT {
            return Vec::new();
        }
        vec![format!(
            "coupling_ratio = {ratio:.3}: a host that takes force and torque as they are diverges above 1 \
             (values held), 1/3 or {LIMIT} (extrapolated), at any communication step; use bias and \
             added_mass instead, and leave host.mass at 0 if you do"
        )]
    }

    fn save(&self, words: &mut Vec<u64>) {
        words.extend(self.tank.state().to_words());
        words.push(self.coupling_ratio.to_bits());
    }

    fn resume(parameters: &Parameters, words: &[u64], tolerance: f64) -> Option<Self> {
        let p = parameters.resolved().ok()?;
        let (ratio, state) = words.split_last()?;
        let state = TankState::from_words(state.try_into().ok()?)?;
        let tank = p.problems().is_empty().then(|| SloshTank::resume(&p, &state, tolerance))?;
        let coupling_ratio = f64::from_bits(*ratio);
        coupling_ratio.is_finite().then_some(Model { tank, coupling_ratio })
    }

    fn step(&mut self, inputs: &Inputs, h: f64) -> Result<(), String> {
        self.tank.step(&inputs.tank, h).map_err(|why| why.to_string())
    }

    fn outputs(&mut self, inputs: &Inputs) -> SloshTankOutputs {
        self.tank.outputs(&inputs.tank)
    }

    fn set_dependent_slopes(inputs: &mut Inputs, h: f64) -> bool {
        // omega at the step's end is then omega + omega_dot h + omega_dot' h^2/2. Where that
        // overflows the step is refused.
        let rate = &inputs.tank.omega_dot;
        let slope = [0, 1, 2].map(|i| rate.value[i] + rate.slope[i] * h / 2.0);
        inputs.omega_slope = slope.map(|x| if x.is_finite() { x } else { 0.0 });
        true
    }

    fn continuous_states(&self) -> &[f64] {
        self.tank.borrow_states()
    }

    fn set_continuous_states(&mut self, x: &[f64]) {
        if let Some(x) = x.first_chunk::<TANK_STATES>() {
            self.tank.set_continuous_states(x);
        }
    }

    fn set_time(&mut self, time: f64) {
        self.tank.set_time(time);
    }

    fn derivatives(&mut self, inputs: &Inputs, x_dot: &mut [f64]) {
        x_dot.copy_from_slice(&self.tank.derivatives(&inputs.tank));
    }

    fn directional_derivative(
        &mut self,
        inputs: &Inputs,
        along: &Inputs,
        dx: &[f64],
        dx_dot: &mut [f64],
    ) -> SloshTankOutputs {
        let mut direction = [0.0; TANK_STATES];
        direction.copy_from_slice(dx);
        let slopes = [along.tank.a.slope, along.omega_slope, along.tank.omega_dot.slope];
        let mut du = [0.0; TANK_INPUTS];
        du[..9].copy_from_slice(slopes.as_flattened());
        du[9] = along.tank.mass_flow.slope;
        dx_dot.copy_from_slice(&self.tank.directional_derivative(&inputs.tank, &direction, &du));
        self.tank.output_derivatives(&inputs.tank, &direction, &du)
    }
}

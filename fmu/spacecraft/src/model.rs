//! The craft as a model of the runtime.

use std::ops::{Deref, DerefMut};

use craft::{INPUTS, Inputs, Mount, Outputs, STATES, Spacecraft, State, TANKS};
use runtime::table::Table;

use crate::table::TABLE;

/// A spacecraft with its tanks.
#[derive(Clone, Debug)]
pub struct Model {
    craft: Spacecraft,
    /// Whether the present inputs are applied: a jump of the wheels' momentum or of an outflow acts
    /// at once in Co-Simulation.
    present: bool,
}

/// The craft's parameters; counts are integers here.
#[derive(Clone, Debug)]
pub struct Parameters {
    craft: craft::Parameters,
    /// The mount's number if it is not 0, for hosts that set no enumerations.
    pub mount_kind: i32,
    /// Number of tanks.
    pub tanks: i32,
    /// Number of slosh modes of each tank.
    pub modes: [i32; TANKS],
    /// Number of points of each tank's table.
    pub points: [i32; TANKS],
}

impl Default for Parameters {
    fn default() -> Self {
        let craft = craft::Parameters::default();
        let modes = craft.tank.map(|tank| tank.modes as i32);
        let points = craft.tank.map(|tank| tank.fill.points as i32);
        Parameters { mount_kind: 0, tanks: craft.tanks as i32, modes, points, craft }
    }
}

impl Deref for Parameters {
    type Target = craft::Parameters;

    fn deref(&self) -> &craft::Parameters {
        &self.craft
    }
}

impl DerefMut for Parameters {
    fn deref_mut(&mut self) -> &mut craft::Parameters {
        &mut self.craft
    }
}

impl Parameters {
    /// What the craft is made of. `mount_kind` may not contradict a `mount` that has been set.
    fn resolved(&self) -> Result<craft::Parameters, Vec<String>> {
        let mut p = self.craft;
        let (mount, kind) = (p.mount as i32, self.mount_kind);
        if kind != 0 && p.mount != craft::Parameters::default().mount && mount != kind {
            return Err(vec![format!(
                "mount_kind = {kind} contradicts mount = {mount} (allowed: 0, or the same number; mount left at its \
                 start value)"
            )]);
        }
        if let Some(mount) = usize::try_from(kind - 1).ok().and_then(|i| Mount::ALL.get(i)) {
            p.mount = *mount;
        }
        p.tanks = usize::try_from(self.tanks).unwrap_or(0);
        for (i, tank) in p.tank.iter_mut().enumerate() {
            tank.modes = usize::try_from(self.modes[i]).unwrap_or(0);
            tank.fill.points = usize::try_from(self.points[i]).unwrap_or(0);
        }
        Ok(p)
    }
}

impl runtime::Model for Model {
    type Parameters = Parameters;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Discrete = ();

    // h_wheels turns the craft by its slope.
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
        let craft = Spacecraft::new(&parameters.resolved()?, inputs, start_time, tolerance)?;
        Ok(Model { craft, present: false })
    }

    fn save(&self, words: &mut Vec<u64>) {
        words.extend(self.craft.state().to_words());
    }

    fn resume(parameters: &Parameters, words: &[u64], tolerance: f64) -> Option<Self> {
        let p = parameters.resolved().ok()?;
        let state = State::from_words(words.try_into().ok()?)?;
        let craft = p.problems().is_empty().then(|| Spacecraft::resume(&p, &state, tolerance))?;
        Some(Model { craft, present: false })
    }

    fn step(&mut self, inputs: &Inputs, h: f64) -> Result<(), String> {
        self.craft.step(inputs, h).map_err(|why| why.to_string())
    }

    fn outputs(&mut self, inputs: &Inputs) -> Outputs {
        if self.present { self.craft.outputs(inputs) } else { self.craft.outputs_held(inputs) }
    }

    fn continuous_states(&self) -> &[f64] {
        self.craft.borrow_states()
    }

    fn set_continuous_states(&mut self, x: &[f64]) {
        if let Some(x) = x.first_chunk::<STATES>() {
            self.craft.set_continuous_states(x);
        }
    }

    fn set_time(&mut self, time: f64) {
        self.craft.set_time(time);
    }

    fn derivatives(&mut self, inputs: &Inputs, x_dot: &mut [f64]) {
        x_dot.copy_from_slice(&self.craft.derivatives(inputs));
    }

    fn directional_derivative(
        &mut self,
        inputs: &Inputs,
        along: &Inputs,
        dx: &[f64],
        dx_dot: &mut [f64],
    ) -> Outputs {
        let mut direction = [0.0; STATES];
        direction.copy_from_slice(dx);
        let slopes = [along.force.slope, along.torque.slope, along.h_wheels.slope];
        let mut du = [0.0; INPUTS];
        du[..9].copy_from_slice(slopes.as_flattened());
        for (du, flow) in du[9..].iter_mut().zip(&along.mass_flow) {
            *du = flow.slope;
        }
        dx_dot.copy_from_slice(&self.craft.directional_derivative(inputs, &direction, &du));
        self.craft.output_derivatives(inputs, &direction, &du)
    }

    fn apply_present_inputs(&mut self, _: &Inputs) {
        self.present = true;
    }

    fn revert(&mut self, (): ()) {
        self.present = false;
    }

    fn handle_event(&mut self, inputs: &Inputs) -> Result<bool, String> {
        self.craft.take_event(inputs).map_err(|why| why.to_string())
    }

    fn accept_step(&mut self, inputs: &Inputs) -> Result<bool, String> {
        self.craft.follow_inputs(inputs);
        self.craft.check_liquids().map(|()| false).map_err(|why| why.to_string())
    }
}

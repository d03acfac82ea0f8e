use std::ops::{Deref, DerefMut};

use craft::{
    Coupling, Craft, DampingLaw, SloshTank, SloshTankOutputs, TANK_INPUTS, TANK_STATES, TankInputs,
    TankParameters, TankState,
};
use runtime::Dynamics;
use runtime::clock::Instant;
use runtime::model::StepFailure;

/// Largest `coupling_ratio` without a warning: added mass of the liquid divided by the mass of the craft that carries the
/// tank. If the simulations of craft and tank exchange forces once a step and both extrapolate, they are stable up to
/// 2/sqrt(3) - 1 = 0.155.
const LIMIT: f64 = 0.15;

const OUT_OF_RANGE: &str = "the tank leaves its range (tank.in_range). Thrust pulls the tank off its liquid and nothing \
                            centres the liquid, or a bob is more than 45 degrees from the axis. Results are not \
                            physical from here on";

const LUMP: &str = "the liquid leaves the tank's bottom and moves on as detached liquid (tank.ball.state). Times and \
                    momenta of crossings are valid. Impact forces, and the motion after an impact, are right only to an \
                    order of magnitude. The host must apply impulse";

#[derive(Clone, Debug)]
pub struct Model {
    tank: SloshTank,
    coupling_ratio: f64,
    /// True between [`Dynamics::apply_present_inputs`] and [`Dynamics::revert`]. In this time the outputs that describe the
    /// ranges of validity belong to the present inputs; otherwise they keep the values of the last event.
    present: bool,
    has_left_range: bool,
    has_had_lump: bool,
}

impl Model {
    /// Returns the largest eigenvalue of M_host^-1 M_a, where M_host is the mass matrix of the craft that carries the tank,
    /// and M_a the added mass of the tank. Returns 0 if the mass of the craft (`host.mass`) is unknown.
    pub fn coupling_ratio(&self) -> f64 {
        self.coupling_ratio
    }
}

/// The parameters of the tank, with counts as integers for FMI. A host that cannot set enumerations sets `coupling_kind`, the
/// integer twin of `coupling`, to the number of the item; if it is 0, it has no effect.
#[derive(Clone, Debug)]
pub struct Parameters {
    tank: TankParameters,
    pub coupling_kind: i32,
    pub damping_law_kind: i32,
    pub modes: i32,
    pub points: i32,
    pub host: Craft,
}

impl Default for Parameters {
    fn default() -> Self {
        let tank = TankParameters::default();
        let host = Craft { mass: 0.0, ..craft::Parameters::default().craft };
        let (modes, points) = (tank.tank.modes as i32, tank.tank.fill.points as i32);
        Parameters { coupling_kind: 0, damping_law_kind: 0, modes, points, host, tank }
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
    /// Returns the parameters of the tank after the integer twins have replaced their enumerations.
    ///
    /// # Errors
    /// If an enumeration and its twin have different values.
    fn resolved(&self) -> Result<TankParameters, Vec<String>> {
        let mut p = self.tank;
        let (coupling, kind) = (p.coupling as i32, self.coupling_kind);
        if kind != 0 && p.coupling != TankParameters::default().coupling && coupling != kind {
            return Err(vec![format!(
                "coupling_kind = {kind} contradicts coupling = {coupling}: set coupling_kind to 0 or {coupling}, or \
                 leave coupling at its start value"
            )]);
        }
        if let Some(coupling) = usize::try_from(kind - 1).ok().and_then(|i| Coupling::ALL.get(i)) {
            p.coupling = *coupling;
        }
        let (law, kind) = (p.tank.damping_law, self.damping_law_kind);
        let given = usize::try_from(kind - 1).ok().and_then(|i| DampingLaw::ALL.get(i));
        if let Some(given) = given {
            if law != TankParameters::default().tank.damping_law && law != *given {
                let law = law as i32;
                return Err(vec![format!(
                    "tank.damping_law_kind = {kind} contradicts tank.damping_law = {law}: set tank.damping_law_kind \
                     to 0 or {law}, or leave tank.damping_law at its start value"
                )]);
            }
            p.tank.damping_law = *given;
        }
        p.tank.modes = usize::try_from(self.modes).unwrap_or(0);
        p.tank.fill.points = usize::try_from(self.points).unwrap_or(0);
        p.host = (self.host.mass > 0.0).then_some(self.host);
        Ok(p)
    }
}

/// Inputs of the tank: the motion of the craft that carries it, by default rest without specific force. The slope of the
/// angular velocity omega within a step is always omega_dot, whatever slope the host sets.
#[derive(Clone, Copy, Debug, Default)]
pub struct Inputs {
    pub tank: TankInputs,
    pub omega_slope: [f64; 3],
}

impl Dynamics for Model {
    type Parameters = Parameters;
    type Inputs = Inputs;
    type Outputs = SloshTankOutputs;
    type Discrete = ();

    const OUTPUTS_USE_SLOPES: bool = true;

    fn new(
        parameters: &Parameters,
        inputs: &Inputs,
        start_time: f64,
        tolerance: f64,
    ) -> Result<Self, Vec<String>> {
        let p = parameters.resolved()?;
        let mut tank = SloshTank::new(&p, &inputs.tank, start_time, tolerance)?;
        let coupling_ratio = tank.coupling_ratio().unwrap_or(0.0);
        Ok(Model {
            tank,
            coupling_ratio,
            present: false,
            has_left_range: false,
            has_had_lump: false,
        })
    }

    fn warnings(&self, parameters: &Parameters, _: &Inputs) -> Vec<String> {
        let mut warnings = Vec::new();
        if !self.tank.has_ball() && !self.tank.ranges_held().is_physical {
            warnings.push(format!("at the start {OUT_OF_RANGE}"));
        }
        let ratio = self.coupling_ratio;
        let is_split = parameters.resolved().is_ok_and(|p| p.coupling == Coupling::Split);
        // No warning with a model of detached liquid: host.mass is then required, so that the user could not switch the warning
        // off, and an importer that uses this model uses bias and added_mass anyway.
        if !is_split || ratio <= LIMIT || self.tank.has_ball() {
            return warnings;
        }
        warnings.push(format!(
            "coupling_ratio = {ratio:.3}: a host that applies force and torque directly diverges, at any communication \
             step, if the ratio is above 1 (values held), above 1/3 (extrapolated by the host or the tank) or above {LIMIT} \
             (extrapolated by both). Use bias and added_mass instead; then leave host.mass at 0 to suppress this warning"
        ));
        warnings
    }

    fn overridden(parameters: &Parameters, name: &str, indices: &[usize]) -> Option<String> {
        let tank = parameters.resolved().ok()?.tank;
        Some(format!("tank.{}", tank.overridden(name.strip_prefix("tank.")?, indices)?))
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
        let model = Model {
            tank,
            coupling_ratio,
            present: false,
            has_left_range: false,
            has_had_lump: false,
        };
        coupling_ratio.is_finite().then_some(model)
    }

    fn step(&mut self, inputs: &Inputs, h: f64) -> Result<(), StepFailure> {
        self.tank.step(&inputs.tank, h).map_err(|why| StepFailure {
            text: why.to_string(),
            shorter_may_succeed: why.shorter_may_succeed(),
        })?;
        self.has_left_range |= !self.tank.is_physical_after(&inputs.tank, h);
        self.has_had_lump |= self.tank.has_lump();
        Ok(())
    }

    fn outputs(&mut self, inputs: &Inputs) -> SloshTankOutputs {
        if self.present {
            self.tank.outputs(&inputs.tank)
        } else {
            self.tank.outputs_held(&inputs.tank)
        }
    }

    fn apply_present_inputs(&mut self, _: &Inputs) {
        self.present = true;
    }

    fn revert(&mut self, (): ()) {
        self.present = false;
    }

    fn handle_event(&mut self, inputs: &Inputs) -> Result<bool, String> {
        self.tank.take_event(&inputs.tank).map_err(|why| why.to_string())
    }

    fn accept_step(&mut self, inputs: &Inputs) -> Result<bool, String> {
        self.tank.check_surfaces().map_err(|why| why.to_string())?;
        let ranges = self.tank.ranges(&inputs.tank);
        self.has_left_range |= !ranges.is_physical && !self.tank.has_ball();
        self.has_had_lump |= self.tank.has_lump();
        Ok(ranges != self.tank.ranges_held() || self.tank.is_event_overdue(&inputs.tank))
    }

    fn step_warning(&self) -> Option<&'static str> {
        if self.has_left_range {
            return Some(OUT_OF_RANGE);
        }
        self.has_had_lump.then_some(LUMP)
    }

    fn event_indicators(&mut self, inputs: &Inputs, indicators: &mut [f64]) {
        indicators.copy_from_slice(&self.tank.event_indicators(&inputs.tank));
    }

    fn set_dependent_slopes(inputs: &mut Inputs, h: f64) -> bool {
        // With this slope the omega at the end of the step is omega + omega_dot h + omega_dot' h^2/2. If this overflows,
        // the step is refused.
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

    fn set_time(&mut self, now: Instant) {
        self.tank.set_time(now.time);
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

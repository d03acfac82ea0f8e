use std::ops::{Deref, DerefMut};

use craft::{DampingLaw, INPUTS, Inputs, Mount, Outputs, STATES, Spacecraft, State, TANKS};
use runtime::Dynamics;
use runtime::clock::Instant;
use runtime::model::StepFailure;

#[derive(Clone, Debug)]
pub struct Model {
    craft: Spacecraft,
    /// True between [`Dynamics::apply_present_inputs`] and [`Dynamics::revert`]. In this time the outputs include a jump of
    /// the wheels' momentum or of a mass flow since the last step; otherwise they leave it out and keep the ranges of
    /// validity of the last event.
    present: bool,
    wheels: Wheels,
    has_left_range: bool,
    has_had_lump: bool,
}

const OUT_OF_RANGE: &str = "a tank leaves its range (tank[].in_range). Thrust pulls the tank off its liquid and nothing \
                            centres the liquid, or a bob is more than 45 degrees from the axis. Results for this tank \
                            are not physical from here on";

const LUMP: &str = "the liquid of a tank leaves the bottom and moves on as detached liquid (tank[].ball.state). Times \
                    and momenta of crossings are valid. Impact forces, and the motion after an impact, are right only \
                    to an order of magnitude";

/// Detects a wrong use in Model Exchange: the host changes `h_wheels`, the angular momentum of the wheels, but leaves the
/// reaction −h_wheels' out of the torque on the craft. `torque` is true for each axis on which a torque has acted, and
/// `moved` counts, for each axis without torque, the steps in which h_wheels changed. One of these steps is accepted, because
/// it may be the end of a ramp whose torque has already ended.
#[derive(Clone, Copy, Debug, Default)]
struct Wheels {
    torque: [bool; 3],
    moved: [u8; 3],
}

impl Wheels {
    fn record_torque(&mut self, inputs: &Inputs) {
        for i in 0..3 {
            self.torque[i] |= inputs.torque.value[i] != 0.0;
        }
    }

    fn record_step(&mut self, before: [f64; 3], inputs: &Inputs) {
        self.record_torque(inputs);
        for i in 0..3 {
            if inputs.h_wheels.value[i] != before[i] && !self.torque[i] {
                self.moved[i] = self.moved[i].saturating_add(1);
            }
        }
    }

    fn is_reaction_missing(&self) -> bool {
        (0..3).any(|i| self.moved[i] >= 2 && !self.torque[i])
    }
}

/// The parameters of the craft, with counts as integers for FMI. A host that cannot set enumerations sets `mount_kind` and
/// `damping_law_kind`, the integer twins of `mount` and `tank[].damping_law`, to the number of the item. A twin that is 0 has
/// no effect.
#[derive(Clone, Debug)]
pub struct Parameters {
    craft: craft::Parameters,
    pub mount_kind: i32,
    pub damping_law_kind: [i32; TANKS],
    pub tanks: i32,
    pub appendages: i32,
    pub modes: [i32; TANKS],
    pub points: [i32; TANKS],
}

impl Default for Parameters {
    fn default() -> Self {
        let craft = craft::Parameters::default();
        let modes = craft.tank.map(|tank| tank.modes as i32);
        let points = craft.tank.map(|tank| tank.fill.points as i32);
        let (tanks, appendages) = (craft.tanks as i32, craft.appendages as i32);
        let damping_law_kind = [0; TANKS];
        Parameters { mount_kind: 0, damping_law_kind, tanks, appendages, modes, points, craft }
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
    /// Returns the parameters of the craft after the integer twins have replaced their enumerations.
    ///
    /// # Errors
    /// If an enumeration and its twin have different values.
    fn resolved(&self) -> Result<craft::Parameters, Vec<String>> {
        let mut p = self.craft;
        let (mount, kind) = (p.mount as i32, self.mount_kind);
        if kind != 0 && p.mount != craft::Parameters::default().mount && mount != kind {
            return Err(vec![format!(
                "mount_kind = {kind} contradicts mount = {mount}: set mount_kind to 0 or {mount}, or leave mount at its \
                 start value"
            )]);
        }
        if let Some(mount) = usize::try_from(kind - 1).ok().and_then(|i| Mount::ALL.get(i)) {
            p.mount = *mount;
        }
        p.tanks = usize::try_from(self.tanks).unwrap_or(0);
        p.appendages = usize::try_from(self.appendages).unwrap_or(0);
        for (i, tank) in p.tank.iter_mut().enumerate().take(p.tanks) {
            let (law, kind) = (tank.damping_law, self.damping_law_kind[i]);
            let given = usize::try_from(kind - 1).ok().and_then(|i| DampingLaw::ALL.get(i));
            if let Some(given) = given {
                if law != craft::Tank::default().damping_law && law != *given {
                    let (law, number) = (law as i32, i + 1);
                    return Err(vec![format!(
                        "tank[{number}].damping_law_kind = {kind} contradicts tank[{number}].damping_law = {law}: set \
                         damping_law_kind to 0 or {law}, or leave damping_law at its start value"
                    )]);
                }
                tank.damping_law = *given;
            }
            tank.modes = usize::try_from(self.modes[i]).unwrap_or(0);
            tank.fill.points = usize::try_from(self.points[i]).unwrap_or(0);
        }
        Ok(p)
    }
}

impl Dynamics for Model {
    type Parameters = Parameters;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Discrete = ();

    // The slope of h_wheels is a torque on the craft.
    const OUTPUTS_USE_SLOPES: bool = true;
    const INDICATORS_OF: Option<&'static str> = Some("tanks");

    fn new(
        parameters: &Parameters,
        inputs: &Inputs,
        start_time: f64,
        tolerance: f64,
    ) -> Result<Self, Vec<String>> {
        let craft = Spacecraft::new(&parameters.resolved()?, inputs, start_time, tolerance)?;
        Ok(Model {
            craft,
            present: false,
            wheels: Wheels::default(),
            has_left_range: false,
            has_had_lump: false,
        })
    }

    fn overridden(parameters: &Parameters, name: &str, indices: &[usize]) -> Option<String> {
        parameters.resolved().ok()?.overridden(name, indices)
    }

    fn save(&self, words: &mut Vec<u64>) {
        words.extend(self.craft.state().to_words());
    }

    fn resume(parameters: &Parameters, words: &[u64], tolerance: f64) -> Option<Self> {
        let p = parameters.resolved().ok()?;
        let state = State::from_words(words.try_into().ok()?)?;
        let craft = p.problems().is_empty().then(|| Spacecraft::resume(&p, &state, tolerance))?;
        Some(Model {
            craft,
            present: false,
            wheels: Wheels::default(),
            has_left_range: false,
            has_had_lump: false,
        })
    }

    fn step(&mut self, inputs: &Inputs, h: f64) -> Result<(), StepFailure> {
        self.craft.step(inputs, h).map_err(|why| StepFailure {
            text: why.to_string(),
            shorter_may_succeed: why.shorter_may_succeed(),
        })?;
        self.has_left_range |= !self.craft.is_physical();
        self.has_had_lump |= self.craft.has_lump();
        Ok(())
    }

    fn warnings(&self, _: &Parameters, _: &Inputs) -> Vec<String> {
        let left = self.craft.leaves_range(&self.craft.ranges_held());
        left.then(|| format!("at the start {OUT_OF_RANGE}")).into_iter().collect()
    }

    fn outputs(&mut self, inputs: &Inputs) -> Outputs {
        if self.present { self.craft.outputs(inputs) } else { self.craft.outputs_held(inputs) }
    }

    fn set_discrete_outputs(&mut self, inputs: &Inputs, outputs: &mut Outputs) -> bool {
        let known = if self.present { self.craft.discrete_outputs(inputs) } else { None };
        for (tank, (ranges, ball_state)) in outputs.tank.iter_mut().zip(known.unwrap_or_default()) {
            (tank.ranges, tank.ball_state) = (ranges, ball_state);
        }
        known.is_some()
    }

    fn continuous_states(&self) -> &[f64] {
        self.craft.borrow_states()
    }

    fn set_continuous_states(&mut self, x: &[f64]) {
        if let Some(x) = x.first_chunk::<STATES>() {
            self.craft.set_continuous_states(x);
        }
    }

    fn set_time(&mut self, now: Instant) {
        self.craft.set_time(now.time);
    }

    fn derivatives(&mut self, inputs: &Inputs, x_dot: &mut [f64]) {
        self.wheels.record_torque(inputs);
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
        self.wheels.record_step(self.craft.state().h_wheels(), inputs);
        self.craft.follow_inputs(inputs);
        self.craft.check_states().map_err(|why| why.to_string())?;
        let ranges = self.craft.ranges(inputs);
        self.has_left_range |= self.craft.leaves_range(&ranges);
        self.has_had_lump |= self.craft.has_lump();
        Ok(ranges != self.craft.ranges_held() || self.craft.is_event_overdue(inputs))
    }

    fn event_indicators(&mut self, inputs: &Inputs, indicators: &mut [f64]) {
        self.craft.event_indicators(inputs, indicators);
    }

    fn step_warning(&self) -> Option<&'static str> {
        if self.has_left_range && !self.wheels.is_reaction_missing() {
            return Some(OUT_OF_RANGE);
        }
        if self.has_had_lump && !self.wheels.is_reaction_missing() {
            return Some(LUMP);
        }
        self.wheels.is_reaction_missing().then_some(
            "h_wheels changes on an axis on which torque has always been 0. In Model Exchange the FMU does not know the \
             slope of an input, and without the wheels' reaction momentum and angular_momentum are wrong: add \
             -d(h_wheels)/dt to torque",
        )
    }
}

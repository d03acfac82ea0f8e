use std::ops::{Deref, DerefMut};

use plant::{
    Calculated, Contact, DampingLaw, FrictionModel, Inputs, Outputs, Plant, STATES, SloshModel,
    SloshSource, State, StepError, StoppedStep,
};
use runtime::Dynamics;
use runtime::clock::Instant;
use runtime::model::{StepEnd, StepFailure};

#[derive(Clone, Debug)]
pub struct HubSlosh {
    plant: Plant,
    /// True between [`Dynamics::apply_present_inputs`] and [`Dynamics::revert`]. In this time the outputs show the contact
    /// (stick or slip) that the present inputs cause; otherwise they show the contact at the last event.
    present: bool,
}

impl HubSlosh {
    pub fn calculated(&self) -> &Calculated {
        self.plant.calculated()
    }

    pub fn damping_ratio(&self, n: usize, inputs: &Inputs) -> [f64; 2] {
        self.plant.damping_ratio(n, inputs)
    }
}

/// The parameters of the plant, and integer twins of its enumerations and Booleans, whose names end in `_kind`. A host that
/// cannot set an enumeration sets its twin to the number of the item. A host that misreads Booleans sets a twin to 1 for
/// false and to 2 for true. A twin that is 0 has no effect.
#[derive(Clone, Debug)]
pub struct Parameters {
    plant: plant::Parameters,
    pub slosh_kind: i32,
    pub slosh_source_kind: i32,
    pub damping_law_kind: i32,
    pub friction_kind: i32,
    pub zeta_from_correlation_kind: i32,
    pub capillarity_kind: i32,
    pub one_axis_kind: i32,
    pub wheel_enabled_kind: i32,
    pub imu_enabled_kind: i32,
}

/// Start value of `init.slosh_angle`, rad, 2 degrees. With it a first plot with default settings shows liquid that moves, the
/// response of the hub, and a bearing that sticks.
pub const START_ANGLE: f64 = 0.035;

impl Default for Parameters {
    fn default() -> Self {
        let mut plant = plant::Parameters::default();
        plant.init.slosh_angle = START_ANGLE;
        Parameters {
            plant,
            slosh_kind: 0,
            slosh_source_kind: 0,
            damping_law_kind: 0,
            friction_kind: 0,
            zeta_from_correlation_kind: 0,
            capillarity_kind: 0,
            one_axis_kind: 0,
            wheel_enabled_kind: 0,
            imu_enabled_kind: 0,
        }
    }
}

impl Deref for Parameters {
    type Target = plant::Parameters;

    fn deref(&self) -> &plant::Parameters {
        &self.plant
    }
}

impl DerefMut for Parameters {
    fn deref_mut(&mut self) -> &mut plant::Parameters {
        &mut self.plant
    }
}

impl Parameters {
    /// Returns the parameters of the plant after the integer twins have replaced their enumerations and Booleans.
    ///
    /// # Errors
    /// If an enumeration and its twin have different values. A Boolean may differ from its twin, because hosts that need the
    /// twin set the Boolean to any value.
    fn resolved(&self) -> Result<plant::Parameters, Vec<String>> {
        let mut p = self.plant;
        let start = plant::Parameters::default();
        let mut problems = Vec::new();
        let mut conflict = |(name, model): (&str, i32), start: i32, (number, kind): (&str, i32)| {
            if kind != 0 && model != start && model != kind {
                problems.push(format!(
                    "{number} = {kind} contradicts {name} = {model}: set {number} to 0 or {model}, \
                     or leave {name} at its start value {start}"
                ));
            }
        };
        conflict(
            ("slosh.model", p.slosh.model as i32),
            start.slosh.model as i32,
            ("slosh.kind", self.slosh_kind),
        );
        conflict(
            ("slosh.source", p.slosh.source as i32),
            start.slosh.source as i32,
            ("slosh.source_kind", self.slosh_source_kind),
        );
        conflict(
            ("slosh.damping_law", p.slosh.damping_law as i32),
            start.slosh.damping_law as i32,
            ("slosh.damping_law_kind", self.damping_law_kind),
        );
        conflict(
            ("friction.model", p.friction.model as i32),
            start.friction.model as i32,
            ("friction.kind", self.friction_kind),
        );
        set_item(&mut p.slosh.model, &SloshModel::ALL, self.slosh_kind);
        set_item(&mut p.slosh.source, &SloshSource::ALL, self.slosh_source_kind);
        set_item(&mut p.slosh.damping_law, &DampingLaw::ALL, self.damping_law_kind);
        set_item(&mut p.friction.model, &FrictionModel::ALL, self.friction_kind);
        for (flag, kind) in [
            (&mut p.slosh.zeta_from_correlation, self.zeta_from_correlation_kind),
            (&mut p.slosh.capillarity, self.capillarity_kind),
            (&mut p.slosh.table.one_axis, self.one_axis_kind),
            (&mut p.wheel.enabled, self.wheel_enabled_kind),
            (&mut p.imu.enabled, self.imu_enabled_kind),
        ] {
            if kind != 0 {
                *flag = kind == 2;
            }
        }
        if problems.is_empty() { Ok(p) } else { Err(problems) }
    }
}

pub(crate) fn set_item<T: Copy>(field: &mut T, items: &[T], number: i32) {
    if let Some(item) = usize::try_from(number).ok().and_then(|n| items.get(n.checked_sub(1)?)) {
        *field = *item;
    }
}

fn failure(why: StepError) -> StepFailure {
    StepFailure { text: why.to_string(), shorter_may_succeed: why.shorter_may_succeed() }
}

pub const SAVED_WORDS: usize = State::WORDS + 1 + StoppedStep::WORDS;

impl Dynamics for HubSlosh {
    type Parameters = Parameters;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Discrete = Option<Contact>;

    fn new(
        parameters: &Parameters,
        inputs: &Inputs,
        start_time: f64,
        tolerance: f64,
    ) -> Result<Self, Vec<String>> {
        let plant = Plant::new(&parameters.resolved()?, inputs, start_time, tolerance)?;
        Ok(HubSlosh { plant, present: false })
    }

    fn warnings(&self, parameters: &Parameters, inputs: &Inputs) -> Vec<String> {
        parameters.resolved().map_or(Vec::new(), |p| Plant::warnings(&p, inputs))
    }

    fn overridden(parameters: &Parameters, name: &str, _: &[usize]) -> Option<String> {
        parameters.resolved().ok()?.overridden(name)
    }

    fn save(&self, words: &mut Vec<u64>) {
        words.extend(self.plant.state().to_words());
        let stopped = self.plant.stopped().map(StoppedStep::to_words);
        words.push(stopped.is_some().into());
        words.extend(stopped.unwrap_or([0; StoppedStep::WORDS]));
    }

    fn resume(parameters: &Parameters, words: &[u64], tolerance: f64) -> Option<Self> {
        let (state, words) = words.split_first_chunk()?;
        let (stopped, words) = words.split_first()?;
        let stopped = match stopped {
            0 => None,
            1 => Some(StoppedStep::from_words(words.try_into().ok()?)?),
            _ => return None,
        };
        let state = State::from_words(state)?;
        let p = parameters.resolved().ok()?;
        let mut plant =
            Plant::problems(&p).is_empty().then(|| Plant::resume(&p, &state, tolerance))?;
        plant.set_stopped(stopped);
        Some(HubSlosh { plant, present: false })
    }

    #[inline]
    fn step(&mut self, inputs: &Inputs, h: f64) -> Result<(), StepFailure> {
        self.plant.step(inputs, h).map_err(failure)
    }

    fn step_to_event(&mut self, inputs: &Inputs, h: f64) -> Result<StepEnd, StepFailure> {
        let end = self.plant.step_to_event(inputs, h).map_err(failure)?;
        Ok(match end {
            plant::StepEnd::End => StepEnd::End,
            plant::StepEnd::EventAtEnd => StepEnd::EventAtEnd,
            plant::StepEnd::Event(after) => StepEnd::Event(after),
        })
    }

    fn take_present_inputs(&mut self, inputs: &Inputs) {
        self.plant.take_present_contact(inputs);
    }

    #[inline]
    fn outputs(&mut self, inputs: &Inputs) -> Outputs {
        let mut outputs = self.plant.outputs_held(inputs);
        if self.present {
            self.plant.update_ranges(&mut outputs);
        }
        outputs
    }

    #[inline]
    fn continuous_states(&self) -> &[f64] {
        self.plant.continuous_states()
    }

    fn set_continuous_states(&mut self, x: &[f64]) {
        if let Some(x) = x.first_chunk::<STATES>() {
            self.plant.set_continuous_states(x);
        }
    }

    fn set_time(&mut self, now: Instant) {
        self.plant.set_time(now.time, now.since_start, now.resolution);
    }

    fn derivatives(&mut self, inputs: &Inputs, x_dot: &mut [f64]) {
        x_dot.copy_from_slice(&self.plant.derivatives(inputs));
    }

    fn directional_derivative(
        &mut self,
        inputs: &Inputs,
        along: &Inputs,
        dx: &[f64],
        dx_dot: &mut [f64],
    ) -> Outputs {
        let du = [along.tau_cmd.slope, along.tau_ext.slope, along.g_axial.slope];
        let mut direction = [0.0; STATES];
        direction.copy_from_slice(dx);
        dx_dot.copy_from_slice(&self.plant.directional_derivative(inputs, &direction, &du));
        self.plant.output_derivatives(inputs, &direction, &du)
    }

    #[inline]
    fn apply_present_inputs(&mut self, inputs: &Inputs) -> Option<Contact> {
        self.present = true;
        Some(self.plant.apply_present_contact(inputs))
    }

    #[inline]
    fn revert(&mut self, before: Option<Contact>) {
        self.present = false;
        if let Some(contact) = before {
            self.plant.revert_contact(contact);
        }
    }

    fn tune(&mut self, parameters: &Parameters, inputs: &Inputs) -> Result<(), Vec<String>> {
        self.plant.set_friction(&parameters.resolved()?.friction, inputs)
    }

    fn event_indicators(&mut self, inputs: &Inputs, indicators: &mut [f64]) {
        indicators.copy_from_slice(&self.plant.event_indicators(inputs));
    }

    fn handle_event(&mut self, inputs: &Inputs) -> Result<bool, String> {
        self.plant.take_event(inputs).map_err(|why| why.to_string())
    }

    fn next_time_event(&self) -> Option<f64> {
        self.plant.next_time_event()
    }

    fn accept_step(&mut self, inputs: &Inputs) -> Result<bool, String> {
        self.plant.check_range().map_err(|why| why.to_string())?;
        self.plant.accept_step(inputs).map_err(|why| why.to_string())?;
        Ok(self.plant.is_event_overdue(inputs))
    }

    #[inline]
    fn event_count(&self) -> i32 {
        self.plant.last_contact().0
    }

    fn last_event(&self) -> String {
        let (_, time, contact) = self.plant.last_contact();
        let what = match contact {
            0 => "stuck",
            1 => "broke away forwards",
            _ => "broke away backwards",
        };
        format!("the hub {what} at t = {time:?} s")
    }
}

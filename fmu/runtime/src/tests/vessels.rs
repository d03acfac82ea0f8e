//! A test model that uses all features of the runtime: two leaking vessels on a platform that can rise.
//!
//! A level x rises by the inflow q and falls by the leak, x' = q - k x. If q changes with the slope s, x(h) = x e + q (1 -
//! e)/k + s (h - (1 - e)/k)/k with e = exp(-k h). If the platform is higher than [`OPENS`], a valve opens and half of the
//! first vessel is spilt.

use crate::clock::Instant;
use crate::model::{Dynamics, Model};
use crate::model::{StepEnd, StepFailure};
use crate::table::{About, Scalar, Table, scalar_count, scalars};
use crate::variable::Dimension::Fixed;
use crate::variable::{Enumeration, Item, Variable};

/// Height of the platform at which the valve opens, m.
pub const OPENS: f64 = 2.0;
/// Level at which a vessel overflows, m.
pub const OVERFLOWS: f64 = 80.0;

/// Leak of the vessels, 1/s; their levels at the start, m; time of an inspection, s; and further parameters without effect.
#[derive(Clone, Debug)]
pub struct Parameters {
    pub k: f64,
    pub level_0: [f64; 2],
    pub inspection: f64,
    pub has_lid: bool,
    pub number: i32,
    pub gauges: u8,
    pub material: u8,
}

impl Default for Parameters {
    fn default() -> Self {
        Parameters {
            k: 0.5,
            level_0: [3.0, 4.0],
            inspection: 1e9,
            has_lid: true,
            number: 2,
            gauges: 3,
            material: 1,
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub struct Inputs {
    q: [[f64; 2]; 2],
    /// Height of the platform, m; its slope is the platform's rate.
    z: [f64; 2],
    w: [f64; 2],
}

impl Default for Inputs {
    fn default() -> Self {
        Inputs { q: [[1.0, 0.0], [2.0, 0.0]], z: [0.0; 2], w: [0.0; 2] }
    }
}

#[derive(Clone, Copy, Debug)]
pub struct Outputs {
    sum: f64,
    trend: f64,
    net: [f64; 2],
    open: bool,
    events: i32,
    valve: i32,
}

/// Vessels with a leak, and a valve that a rising platform opens. The model stores the levels in reverse order, so that the
/// host reads the last one first.
#[derive(Clone, Debug)]
pub struct Vessels {
    k: f64,
    inspection: f64,
    time: f64,
    x: [f64; 2],
    open: bool,
    events: i32,
    longest: f64,
}

impl Vessels {
    fn net(&self, inputs: &Inputs) -> [f64; 2] {
        [0, 1].map(|i| inputs.q[i][0] - self.k * self.x[1 - i])
    }
}

static MATERIAL: Enumeration = Enumeration {
    name: "Material",
    description: "What a vessel is made of",
    items: &[Item::new("glass", "Glass"), Item::new("steel", "Steel")],
};
static VALVE: Enumeration = Enumeration {
    name: "Valve",
    description: "Where the valve is",
    items: &[Item::new("closed", "Closed"), Item::new("open", "Open")],
};

type V = Variable<Vessels>;

#[rustfmt::skip]
static VARIABLES: &[Variable<Vessels>] = &[
    V::output("level", |_, _| 0.0, "m", "Levels").shape(&[Fixed(2)]).is_state(|i| 1 - i).reinit().nominal(5.0)
        .depends_on(&["level[]"]).initial_depends_on(&["start."]),
    V::output("sum", |o, _| o.sum, "m", "Sum of the levels")
        .depends_on(&["level"]).initial_depends_on(&["start."]),
    V::local("trend", |o, _| o.trend, "1/s2", "Sum of the slopes of q, with a step's memory"),
    V::local("net", |o, i| o.net[i], "m/s", "Rates of the levels").shape(&[Fixed(2)])
        .depends_on(&["level[]", "q[]"]).initial_depends_on(&["start.level[1]", "leak"]),
    V::local_of_inputs("room", |_, i, _| [OPENS - i.z[0], -i.z[1]], "m", "Room below the valve")
        .depends_on(&["z"]),
    V::local_boolean("open", |o, _| o.open, "Whether the valve is open"),
    V::local_integer("events", |o, _| o.events, "How often the valve has moved"),
    V::local_enumeration("valve", &VALVE, |o, _| o.valve, "Where the valve is"),
    V::derivative("der(level)", |i| 1 - i, "m/s", "Derivatives of the levels").shape(&[Fixed(2)])
        .depends_on(&["level[]", "q[]"]).initial_depends_on(&["start.", "leak"]),
    V::input("q", |i, n| i.q[n].each_mut(), "m/s", "What flows in").shape(&[Fixed(2)]).range(1.0, 10.0),
    V::input("z", |i, _| i.z.each_mut(), "m", "Height of the platform").follows_inputs(),
    V::input("w", |i, _| i.w.each_mut(), "m/s", "Rate of the platform").range(-8.0, 2.0),
    V::parameter("leak", |p, _| &mut p.k, "1/s", "Leak").at_least(0.0).tunable(),
    V::parameter("start.level", |p, i| &mut p.level_0[i], "m", "Levels at the start")
        .shape(&[Fixed(2)]).range(0.0, 100.0).display_unit("mm"),
    V::parameter("inspection", |p, _| &mut p.inspection, "s", "Time of the inspection"),
    V::switch("has_lid", |p| &mut p.has_lid, "Whether there is a lid"),
    V::integer("number", |p, _| &mut p.number, "A number").between(-3, 5),
    V::count("gauges", |p, _| p.gauges.into(), |p, _, n| p.gauges = n as u8, "Gauges").between(0, 9),
    V::choice("material", &MATERIAL, |p, _| p.material.into(), |p, _, n| p.material = n as u8, "Material"),
    V::calculated("time_constant", |m, _| 1.0 / m.k, "s", "Time constant of the leak")
        .initial_depends_on(&["leak"]),
];

static SCALARS: [Scalar<Vessels>; scalar_count(VARIABLES)] = scalars(VARIABLES);

pub static TABLE: Table<Vessels> = Table::new(
    About {
        model: "Vessels",
        version: "1",
        description: "Two vessels that leak",
        events: "The valve moves",
        event_indicators: 1,
        saved_words: 6,
    },
    VARIABLES,
    &SCALARS,
);

fn failure(text: String) -> StepFailure {
    StepFailure { text, shorter_may_succeed: false }
}

impl Model for Vessels {
    fn table() -> &'static Table<Self> {
        &TABLE
    }
}

impl Dynamics for Vessels {
    type Parameters = Parameters;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Discrete = bool;

    const OUTPUTS_USE_SLOPES: bool = true;

    fn new(p: &Parameters, inputs: &Inputs, time: f64, _: f64) -> Result<Self, Vec<String>> {
        let [a, b] = p.level_0;
        let mut problems = Vec::new();
        if a > OVERFLOWS {
            problems.push("the first vessel is too full".into());
        }
        if b > OVERFLOWS {
            problems.push("the second vessel is too full".into());
        }
        let open = inputs.z[0] > OPENS;
        let made = Vessels {
            k: p.k,
            inspection: p.inspection,
            time,
            x: [b, a],
            open,
            events: 0,
            longest: 0.0,
        };
        if problems.is_empty() { Ok(made) } else { Err(problems) }
    }

    fn warnings(&self, p: &Parameters, inputs: &Inputs) -> Vec<String> {
        let z = inputs.z[0];
        let all = format!("leak {} of {}, levels {:?}, platform at {z} m", self.k, p.k, self.x);
        if p.k > 5.0 { vec![all] } else { Vec::new() }
    }

    fn overridden(p: &Parameters, name: &str, indices: &[usize]) -> Option<String> {
        let is_first = indices.first().is_none_or(|i| *i == 0);
        let is_of_lid = ["number", "gauges", "start.level"].contains(&name) && is_first;
        (is_of_lid && p.has_lid).then(|| "has_lid is true".into())
    }

    fn save(&self, words: &mut Vec<u64>) {
        words.extend([self.time, self.x[0], self.x[1], self.longest].map(f64::to_bits));
        words.extend([u64::from(self.open), self.events as u64]);
    }

    fn resume(p: &Parameters, words: &[u64], _: f64) -> Option<Self> {
        let words = <[u64; 6]>::try_from(words).ok()?;
        let [time, a, b, longest, ..] = words.map(f64::from_bits);
        let (open, events) = (words[4] == 1, i32::try_from(words[5]).ok()?);
        let is_one = [time, a, b, longest].iter().all(|x| x.is_finite()) && words[4] <= 1;
        let Parameters { k, inspection, .. } = *p;
        is_one.then_some(Vessels { k, inspection, time, x: [a, b], open, events, longest })
    }

    fn step(&mut self, inputs: &Inputs, h: f64) -> Result<(), StepFailure> {
        if inputs.z[0] > 100.0 {
            return Err(failure("the platform is too high".into()));
        }
        let mut x = self.x;
        for (i, [q, slope]) in inputs.q.into_iter().enumerate() {
            let (k, e) = (self.k, (-self.k * h).exp());
            x[1 - i] = x[1 - i] * e + q * (1.0 - e) / k + slope * (h - (1.0 - e) / k) / k;
        }
        if x.iter().any(|x| *x > OVERFLOWS) {
            return Err(failure("a vessel overflows".into()));
        }
        self.x = x;
        self.time += h;
        self.handle_event(inputs).map(|_| ()).map_err(failure)
    }

    fn step_to_event(&mut self, inputs: &Inputs, h: f64) -> Result<StepEnd, StepFailure> {
        let left = self.inspection - self.time;
        if left <= 0.0 || left > h {
            return self.step(inputs, h).map(|()| StepEnd::End);
        }
        self.step(inputs, left)?;
        Ok(if left == h { StepEnd::EventAtEnd } else { StepEnd::Event(left) })
    }

    fn outputs(&mut self, inputs: &Inputs) -> Outputs {
        Outputs {
            sum: self.x[0] + self.x[1],
            trend: inputs.q[0][1] + inputs.q[1][1],
            net: self.net(inputs),
            open: self.open,
            events: self.events,
            valve: 1 + i32::from(self.open),
        }
    }

    fn set_dependent_slopes(inputs: &mut Inputs, h: f64) -> bool {
        inputs.z[1] = inputs.w[0] + inputs.w[1] * h / 2.0;
        inputs.z[1] != 0.0
    }

    fn continuous_states(&self) -> &[f64] {
        &self.x
    }

    fn set_continuous_states(&mut self, x: &[f64]) {
        self.x.copy_from_slice(x);
    }

    fn set_time(&mut self, now: Instant) {
        self.longest = self.longest.max(now.time - self.time);
        self.time = now.time;
    }

    fn derivatives(&mut self, inputs: &Inputs, x_dot: &mut [f64]) {
        let [a, b] = self.net(inputs);
        x_dot.copy_from_slice(&[b, a]);
    }

    fn directional_derivative(
        &mut self,
        _: &Inputs,
        along: &Inputs,
        dx: &[f64],
        dx_dot: &mut [f64],
    ) -> Outputs {
        let net = [0, 1].map(|i| along.q[i][1] - self.k * dx[1 - i]);
        dx_dot.copy_from_slice(&[net[1], net[0]]);
        let sum = dx[0] + dx[1];
        Outputs { sum, trend: 0.0, net, open: false, events: 0, valve: 0 }
    }

    fn apply_present_inputs(&mut self, inputs: &Inputs) -> bool {
        std::mem::replace(&mut self.open, inputs.z[0] > OPENS)
    }

    fn revert(&mut self, before: bool) {
        self.open = before;
    }

    fn tune(&mut self, p: &Parameters, inputs: &Inputs) -> Result<(), Vec<String>> {
        if p.k > 100.0 && inputs.z[0] > OPENS {
            return Err(vec!["the leak is too fast".into(), "the valve is open".into()]);
        }
        self.k = p.k;
        Ok(())
    }

    fn event_indicators(&mut self, inputs: &Inputs, indicators: &mut [f64]) {
        indicators[0] = inputs.z[0] - OPENS;
    }

    fn handle_event(&mut self, inputs: &Inputs) -> Result<bool, String> {
        let [z, _] = inputs.z;
        if z > 100.0 {
            return Err("the platform is too high".into());
        }
        let was_open = std::mem::replace(&mut self.open, z > OPENS);
        self.events += i32::from(was_open != self.open);
        let spills = self.open && !was_open;
        if spills {
            self.x[1] /= 2.0;
        }
        Ok(spills)
    }

    fn next_time_event(&self) -> Option<f64> {
        (self.time < self.inspection).then_some(self.inspection)
    }

    fn accept_step(&mut self, inputs: &Inputs) -> Result<bool, String> {
        if self.x.iter().any(|x| *x < -1.0) {
            return Err("a level is below the ground".into());
        }
        Ok((inputs.z[0] > OPENS) != self.open)
    }

    fn step_warning(&self) -> Option<&'static str> {
        (self.longest > 1.0).then_some("the host's steps are long")
    }

    fn event_count(&self) -> i32 {
        self.events
    }

    fn last_event(&self) -> String {
        format!("valve {} at {} s", if self.open { "opens" } else { "closes" }, self.time)
    }
}

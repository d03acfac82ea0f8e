//! Fuzzing with hosts that make the same sequence of calls but compute the simulation time in different ways: multiplied (k h),
//! accumulated (t += h), wrong by a unit in the last place, or started at 1e9 s. All of them must get the same outputs.

use arbitrary::{Result, Unstructured};

use runtime::Model;
use runtime::call::{Events, InstanceState, Interface};
use runtime::instance::Instance;
use runtime::snapshot::{from_bytes, to_bytes};
use runtime::table::Scalar;
use runtime::v2::Fmi2;
use runtime::v3::Fmi3;
use runtime::variable::{Access, Causality, Value};

use crate::states::settings;
use crate::{Values, place, set, survives_being_saved, to_steps};

const CALLS: usize = 40;
const TOLERANCE: f64 = 1e-9;
const LONGEST: u32 = 8;

#[derive(Clone, Copy, Debug)]
enum Call {
    Input(usize, f64),
    Slope(usize, f64),
    Tune(usize, f64),
    GoBack(u32),
    Save,
    Derivatives,
    Step(u32),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Multiplied,
    Added,
    Off,
    Differences,
}

#[derive(Clone, Debug)]
struct Clock {
    kind: Kind,
    start: f64,
    origin: f64,
    tick: f64,
    ticks: u32,
    time: f64,
    noise: u64,
}

impl Clock {
    fn new(kind: Kind, start: f64, tick: f64) -> Clock {
        let noise = 0x9E37_79B9_7F4A_7C15;
        Clock { kind, start, origin: start, tick, ticks: 0, time: start, noise }
    }

    fn started_at_zero(&self) -> Clock {
        Clock { origin: self.origin, ..Clock::new(self.kind, 0.0, self.tick) }
    }

    fn name(&mut self, time: f64) -> f64 {
        if self.kind != Kind::Off {
            return time;
        }
        self.noise = self.noise.rotate_left(7).wrapping_mul(0xD6E8_FEB8_6659_FD93);
        if self.noise >> 63 == 0 { time.next_up() } else { time.next_down() }
    }

    fn now(&mut self) -> f64 {
        self.name(self.time)
    }

    fn length(&self, ticks: u32) -> f64 {
        let at = |ticks: u32| self.origin + f64::from(ticks) * self.tick;
        match self.kind {
            Kind::Differences => at(self.ticks + ticks) - at(self.ticks),
            _ => f64::from(ticks) * self.tick,
        }
    }

    fn after(&self, ticks: u32) -> f64 {
        match self.kind {
            Kind::Added => self.time + f64::from(ticks) * self.tick,
            Kind::Differences if self.origin != self.start => self.time + self.length(ticks),
            _ => self.start + f64::from(self.ticks + ticks) * self.tick,
        }
    }

    fn advance_ticks(&mut self, ticks: u32) {
        (self.time, self.ticks) = (self.after(ticks), self.ticks + ticks);
    }
}

type Rows = Vec<Vec<f64>>;

/// Simulates one motion with several hosts whose clocks have different rounding errors, and compares their outputs. The first
/// byte of `data` determines the FMI version, the interface, and who handles events; the other bytes determine parameters and
/// calls.
///
/// # Panics
/// If two hosts get different outputs.
pub fn run<M: Model>(data: &[u8]) {
    let Some((how, data)) = data.split_first() else { return };
    let data = &mut Unstructured::new(data);
    // The simulation ends when no bytes are left.
    _ = match how % 5 {
        0 => compare::<M, Fmi2>((Interface::CoSimulation, Events::InStep), data),
        1 => compare::<M, Fmi3>((Interface::CoSimulation, Events::InStep), data),
        2 => compare::<M, Fmi3>((Interface::CoSimulation, Events::Reported), data),
        3 => compare::<M, Fmi2>((Interface::ModelExchange, Events::ByHost), data),
        _ => compare::<M, Fmi3>((Interface::ModelExchange, Events::ByHost), data),
    };
}

fn compare<M: Model, V: Values>(
    (interface, events): (Interface, Events),
    data: &mut Unstructured,
) -> Result<()> {
    let table = M::table();
    let mut settings = data.choose(&settings(table.about.model))?.clone();
    let tick = *data.choose(&[0.005, 1.0 / 128.0, 0.01])?;
    if table.find("imu.rate").is_some() {
        // The time is a multiple of the communication step, and in Co-Simulation also a fraction of it.
        let ticks = f64::from(data.int_in_range(1..=6)?);
        let is_between = interface == Interface::CoSimulation && data.ratio(1, 3)?;
        let rate = if is_between { 37.3 } else { 1.0 / (ticks * tick) };
        settings.push(("imu.rate", Value::Real(rate)));
    }
    let mut calls = Vec::new();
    for _ in 0..CALLS {
        let Ok(call) = call::<M>(data) else { break };
        calls.push(call);
    }
    let play = |clock: Clock| match interface {
        Interface::CoSimulation => co_simulation::<M, V>(events, &settings, &calls, clock),
        Interface::ModelExchange => model_exchange::<M, V>(&settings, &calls, clock),
    };
    let even_steps = play(Clock::new(Kind::Multiplied, 0.0, tick));
    for kind in [Kind::Multiplied, Kind::Added, Kind::Off, Kind::Differences] {
        let start = *data.choose(&[0.0, 0.1, -3.0, 1e9]).unwrap_or(&1e9);
        let clock = Clock::new(kind, start, tick);
        let has_own_steps = kind == Kind::Differences && interface == Interface::CoSimulation;
        let same_steps = has_own_steps.then(|| play(clock.started_at_zero()));
        let same_steps = same_steps.as_ref().unwrap_or(&even_steps);
        let off = play(clock);
        let what =
            || format!("{interface:?}, {events:?}, {kind:?}, {start:?}, {settings:?}, {calls:?}");
        assert_eq!(
            off.len(),
            same_steps.len(),
            "the hosts made different numbers of steps: {}",
            what()
        );
        for (n, scalar) in outputs::<M>().enumerate() {
            // At 1e9 s rounding of the host's times makes a step slightly shorter. The gyro still takes the sample that is due at
            // the end of this step, but it would not take it at the end of a step in which the size itself is that much smaller.
            // Therefore the gyro's output is compared with the run with even steps.
            let is_sampled = scalar.variable.name == "omega_imu" && has_own_steps;
            let exact = if is_sampled { &even_steps } else { same_steps };
            let is_placed = is_sampled || interface == Interface::ModelExchange;
            let mut allowed = allowed(exact, n, tick, is_placed, start);
            // This output is a simulation time, so that it is shifted by the start time of the host.
            let is_time = scalar.variable.name == "event_time";
            let begin = if is_time { start } else { 0.0 };
            allowed += if is_time { last_digits(start) } else { 0.0 };
            for (k, (one, other)) in exact.iter().zip(&off).enumerate() {
                let (one, other) = (one[n], other[n] - begin);
                let difference = (one - other).abs();
                assert!(
                    difference <= allowed,
                    "{} at step {k}: {one:?} {other:?}, {difference:e} for {allowed:e}: {}",
                    scalar.name(),
                    what()
                );
            }
        }
    }
    Ok(())
}

/// Returns the difference that two hosts may have in output number `n`: 1e-9 of its magnitude. `rows` contains the values of
/// all outputs after each step, and `tick` is the shortest step, s. If the host's clock determines the ends of steps
/// (`is_placed`: Model Exchange, gyro samples), its rounding errors shift the motion in time: a unit in the last place is
/// 1.2e-7 s at 1e9 s. The allowed difference then includes the rounding error at the time `start` times the fastest change
/// of the output.
fn allowed(rows: &Rows, n: usize, tick: f64, is_placed: bool, start: f64) -> f64 {
    let size = rows.iter().fold(1.0f64, |most, row| most.max(row[n].abs()));
    let pairs = rows.windows(2).map(|pair| (pair[1][n] - pair[0][n]).abs());
    let fastest = if is_placed { pairs.fold(0.0, f64::max) / tick } else { 0.0 };
    TOLERANCE * size + last_digits(start) * fastest
}

fn last_digits(start: f64) -> f64 {
    2.0 * f64::EPSILON * (start.abs() + 10.0)
}

/// Iterates over all outputs and local variables except the derivatives of states. The derivatives follow from the states,
/// so that the fuzzer need not compare them, and reading them one by one would be slow.
fn outputs<M: Model>() -> impl Iterator<Item = &'static Scalar<M>> {
    let is_shown = |s: &&Scalar<M>| {
        matches!(s.variable.causality, Causality::Output | Causality::Local)
            && !matches!(s.variable.access, Access::Derivative(_))
    };
    M::table().scalars.iter().filter(is_shown)
}

fn read<M: Model, V: Values>(instance: &mut Instance<M, V>) -> Option<Vec<f64>> {
    let value = |scalar: &Scalar<M>| match instance.get(V::GET[place(scalar)], V::reference(scalar))
    {
        Ok(Value::Real(x)) => Some(x),
        Ok(Value::Integer(n)) => Some(f64::from(n)),
        Ok(Value::Boolean(b)) => Some(f64::from(u8::from(b))),
        Err(_) => None,
    };
    outputs().map(value).collect()
}

fn call<M: Model>(data: &mut Unstructured) -> Result<Call> {
    let inputs = M::table().inputs();
    let n = data.int_in_range(0..=inputs.len() - 1)?;
    let variable = inputs[n].variable;
    let share = f64::from(data.int_in_range(-100..=100i32)?) / 100.0;
    let least = variable.min().unwrap_or(f64::NEG_INFINITY).max(-1e6);
    let value = (share * variable.nominal_value()).max(least);
    let ticks = data.int_in_range(1..=LONGEST)?;
    Ok(match data.int_in_range(0..=11)? {
        0 | 1 => Call::Input(n, value),
        2 => Call::Slope(n, if least < 0.0 { value } else { value.abs() }),
        3 => Call::Tune(n, 1.0 + 0.5 * share),
        4 => Call::GoBack(ticks),
        5 => Call::Save,
        6 => Call::Derivatives,
        _ => Call::Step(ticks),
    })
}

fn begin<M: Model, V: Values>(
    interface: Interface,
    events: Events,
    settings: &[(&str, Value)],
    clock: &mut Clock,
) -> Option<Instance<M, V>> {
    let mut instance = Instance::<M, V>::with_events(interface, events);
    for (name, value) in settings {
        let scalar = M::table().find(name).expect("the table has the variable");
        set(&mut instance, &M::table().scalars[scalar as usize], *value).expect("a good value");
    }
    instance.setup_experiment(Some(1e-10), clock.start, None).expect("a good experiment");
    instance.enter_initialization_mode().expect("allowed");
    instance.exit_initialization_mode().ok()?;
    Some(instance)
}

/// Makes a call that exists in both Co-Simulation and Model Exchange. Returns the instance with which the simulation
/// continues, because a call may replace it by a deserialised one.
fn common<M: Model, V: Values>(mut instance: Instance<M, V>, call: Call) -> Instance<M, V> {
    let table = M::table();
    match call {
        Call::Input(n, value) => _ = set(&mut instance, &table.inputs()[n], Value::Real(value)),
        Call::Tune(n, share) => {
            let mut tunable = table.parameters().iter().filter(|s| s.variable.tunable);
            let count = tunable.clone().count();
            if let Some(scalar) = tunable.nth(if count > 0 { n % count } else { 0 })
                && let Some(Value::Real(x)) = scalar.start()
            {
                _ = set(&mut instance, scalar, Value::Real(x * share));
            }
        }
        Call::Save => {
            let again = survives_being_saved(&instance);
            assert!(instance.restore(&again).is_ok(), "its own state is refused");
        }
        Call::Derivatives => {
            let output = V::reference(&table.scalars[0]);
            _ = instance.output_derivatives(&[output], &[1], &mut [0.0]);
        }
        _ => {}
    }
    instance
}

fn co_simulation<M: Model, V: Values>(
    events: Events,
    settings: &[(&str, Value)],
    calls: &[Call],
    mut clock: Clock,
) -> Rows {
    let mut rows = Vec::new();
    let Some(mut instance) = begin::<M, V>(Interface::CoSimulation, events, settings, &mut clock)
    else {
        return rows;
    };
    to_steps(&mut instance);
    rows.extend(read(&mut instance));
    for call in calls {
        match *call {
            Call::Slope(n, slope) => {
                let input = V::reference(&M::table().inputs()[n]);
                _ = instance.set_input_derivatives(&[input], &[1], &[slope]);
            }
            Call::GoBack(ticks) => {
                let saved = to_bytes(&instance);
                let went = step_all(&mut instance, &mut clock.clone(), ticks);
                if went {
                    rows.extend(read(&mut instance));
                }
                let saved = from_bytes(&saved).expect("own bytes");
                instance.restore(&saved).expect("its own state");
            }
            Call::Step(ticks) => {
                if !step_all(&mut instance, &mut clock, ticks) {
                    return rows;
                }
                rows.extend(read(&mut instance));
            }
            other => instance = common(instance, other),
        }
    }
    rows
}

fn step_all<M: Model, V: Values>(
    instance: &mut Instance<M, V>,
    clock: &mut Clock,
    ticks: u32,
) -> bool {
    let (mut at, mut h) = (clock.now(), clock.length(ticks));
    let end = clock.after(ticks);
    loop {
        match instance.step_to_event(at, h, true) {
            Err(_) => return false,
            Ok(info) => {
                if info.event {
                    instance.enter_event_mode().expect("the step has reported an event");
                    to_steps(instance);
                }
                if !info.early {
                    break;
                }
                at = clock.name(instance.time());
                h = end - at;
                // The end is reached, except for the host's rounding error.
                if h <= 0.0 {
                    break;
                }
            }
        }
    }
    clock.advance_ticks(ticks);
    true
}

fn model_exchange<M: Model, V: Values>(
    settings: &[(&str, Value)],
    calls: &[Call],
    mut clock: Clock,
) -> Rows {
    let mut rows = Vec::new();
    let begun = begin::<M, V>(Interface::ModelExchange, Events::ByHost, settings, &mut clock);
    let Some(mut instance) = begun else { return rows };
    let table = M::table();
    let nx = table.places().len();
    let (mut x, mut rates) = (vec![0.0; nx], vec![0.0; nx]);
    let mut indicators = [(); 2].map(|()| vec![0.0; table.about.event_indicators]);
    let mut next = instance.new_discrete_states().expect("in event mode").next_time;
    instance.enter_continuous_time_mode().expect("allowed");
    rows.extend(read(&mut instance));
    for call in calls {
        let Call::Step(ticks) = *call else {
            // Inputs may jump at events.
            instance.enter_event_mode().expect("allowed");
            instance = common(instance, *call);
            let Ok(info) = instance.new_discrete_states() else { return rows };
            next = info.next_time;
            instance.enter_continuous_time_mode().expect("allowed");
            continue;
        };
        // The step is so short that Euler's method is accurate enough.
        for _ in 0..ticks {
            let h = clock.tick;
            instance.event_indicators(&mut indicators[0]).expect("allowed");
            instance.continuous_states(&mut x).expect("allowed");
            if instance.derivatives(&mut rates).is_err() {
                return rows;
            }
            for (x, rate) in x.iter_mut().zip(&rates) {
                *x += h * rate;
            }
            clock.advance_ticks(1);
            let now = clock.now();
            instance.set_time(now).expect("a good time");
            if instance.set_continuous_states(&x).is_err() {
                return rows;
            }
            instance.event_indicators(&mut indicators[1]).expect("allowed");
            let Ok(wanted) = instance.completed_integrator_step() else { return rows };
            let [before, after] = &indicators;
            let crossed = before.iter().zip(after).any(|(a, b)| (*a > 0.0) != (*b > 0.0));
            // The host is at the time of the event, or before it by a rounding error.
            let due = next.is_some_and(|next| next <= now + 0.01 * h);
            if wanted || crossed || due {
                instance.enter_event_mode().expect("allowed");
                let Ok(info) = instance.new_discrete_states() else { return rows };
                assert!(
                    info.next_time.is_none_or(|next| next > now + 0.01 * h),
                    "an event at {:?} is still due at {now:?}",
                    info.next_time
                );
                next = info.next_time;
                instance.enter_continuous_time_mode().expect("allowed");
            }
        }
        rows.extend(read(&mut instance));
    }
    assert!(instance.state() == InstanceState::Continuous);
    rows
}

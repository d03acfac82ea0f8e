//! A saved state as bytes.
//!
//! A saved state is a copy of the instance. It is written here in little-endian form, so that it can be moved to
//! another process or machine:
//!
//! | part | bytes |
//! | --- | --- |
//! | "FMUstate" | 8 |
//! | version of this format | 4 |
//! | total length | 4 |
//! | GUID or token of the variable table | 38 |
//! | instance state, flags (1: stop time, 2: model, 4: slopes, 8: slopes of the step before, 16: values of
//! discrete outputs) | 1 + 1 |
//! | interface, handler of events | 1 + 1 |
//! | start, stop, tolerance, time, last event | 5 x 8 |
//! | parameters in the table's order: number, or 0/1 | 8 each |
//! | inputs: value, slope | 16 each |
//! | discrete outputs as the host sees them | 4 each |
//! | the model's words | 8 each |
//! | checksum of all before | 16 |
//!
//! All other data of a model follow from its parameters.

use std::sync::Arc;

use crate::call::{Events, InstanceState, Interface};
use crate::clock::Clock;
use crate::extent::Extent;
use crate::hash::Hash;
use crate::instance::{Instance, TOLERANCES};
use crate::model::Model;
use crate::table::{Layout, Scalar};
use crate::variable::{Access, Value};
use crate::version::Version;

const MAGIC: &[u8; 8] = b"FMUstate";
const FORMAT: u32 = 4;
const HAS_STOP: u8 = 1;
const HAS_MODEL: u8 = 2;
const HAS_SLOPES: u8 = 4;
const HAS_PAST_SLOPES: u8 = 8;
const HAS_SHOWN: u8 = 16;

/// Returns the number of bytes of a saved state, which is the same for all states of a model.
pub fn size<M: Model>() -> usize {
    let table = M::table();
    let head = 8 + 4 + 4 + 38 + 4 + 5 * 8;
    let set =
        table.parameters().len() * 8 + table.inputs().len() * 16 + table.discrete().count() * 4;
    head + set + table.about.saved_words * 8 + 16
}

/// Converts a saved state to bytes. [`from_bytes`] restores it from them, also in another process.
pub fn to_bytes<M: Model, V: Version>(saved: &Instance<M, V>) -> Vec<u8> {
    let (table, size) = (M::table(), size::<M>());
    let mut bytes = Vec::with_capacity(size);
    bytes.extend(MAGIC);
    bytes.extend(FORMAT.to_le_bytes());
    bytes.extend((size as u32).to_le_bytes());
    bytes.extend(saved.token().as_bytes());
    let flag = |is: bool, flag: u8| if is { flag } else { 0 };
    let flags = flag(saved.clock.stop.is_some(), HAS_STOP)
        | flag(saved.model.is_some(), HAS_MODEL)
        | flag(saved.sloped, HAS_SLOPES)
        | flag(saved.past_slopes, HAS_PAST_SLOPES)
        | flag(!saved.shown.is_empty(), HAS_SHOWN);
    bytes.extend([saved.state as u8, flags, saved.interface as u8, saved.events as u8]);
    // If the start time is not set yet, its number has no meaning but must be finite.
    let Clock { start, stop, time, last_event, .. } = saved.clock;
    let last_event = last_event.max(f64::MIN);
    let stop = stop.unwrap_or(0.0);
    for time in [start, stop, saved.tolerance, time, last_event] {
        bytes.extend(time.to_le_bytes());
    }
    for value in &saved.parameters {
        bytes.extend(match value {
            Value::Real(x) => x.to_le_bytes(),
            Value::Integer(n) => i64::from(*n).to_le_bytes(),
            Value::Boolean(b) => i64::from(*b).to_le_bytes(),
        });
    }
    let mut inputs = saved.inputs;
    for scalar in table.inputs() {
        if let Access::Input(ramp) = scalar.access {
            for number in ramp(&mut inputs, scalar.element) {
                bytes.extend(number.to_le_bytes());
            }
        }
    }
    for n in 0..table.discrete().count() {
        bytes.extend(saved.shown.get(n).copied().unwrap_or(0).to_le_bytes());
    }
    let mut words = Vec::with_capacity(table.about.saved_words);
    if let Some(model) = &saved.model {
        model.save(&mut words);
    }
    words.resize(table.about.saved_words, 0);
    for word in words {
        bytes.extend(word.to_le_bytes());
    }
    let checksum = Hash::new().bytes(&bytes).value();
    bytes.extend(checksum.to_le_bytes());
    bytes
}

/// Restores a saved state from the bytes that [`to_bytes`] has written.
///
/// # Errors
/// The reason if the bytes are not a saved state of this model, or are damaged.
pub fn from_bytes<M: Model, V: Version>(bytes: &[u8]) -> Result<Instance<M, V>, String> {
    let (table, size) = (M::table(), size::<M>());
    let model = table.about.model;
    let mut rest = Reader(bytes);
    if rest.take::<8>()? != *MAGIC {
        return Err(format!("these bytes are not a saved state of {model}"));
    }
    let format = u32::from_le_bytes(rest.take()?);
    if format != FORMAT {
        return Err(format!(
            "the saved state has format {format}, but this FMU reads only format {FORMAT}"
        ));
    }
    let length = u32::from_le_bytes(rest.take()?) as usize;
    if length != bytes.len() {
        return Err(format!("the saved state should have {length} bytes but has {}", bytes.len()));
    }
    let guid = rest.take::<38>()?;
    let of = |layout: &Layout| guid == V::token::<M>(*layout).as_bytes();
    let layout = Layout::ALL.into_iter().find(of);
    let text = String::from_utf8_lossy(&guid);
    let extent = match layout {
        Some(_) => None,
        None => Extent::from_token::<M>(&text, V::token::<M>(Layout::Scalars)).map(Arc::new),
    };
    let Some(layout) = layout.or(extent.is_some().then_some(Layout::Scalars)) else {
        let guid = text;
        return Err(format!(
            "the saved state belongs to another FMU, or another version of {model}, with the GUID {guid}"
        ));
    };
    if length != size {
        return Err(format!(
            "saved states of this FMU have {size} bytes, but this one has {length}"
        ));
    }
    let (body, checksum) = bytes.split_at(length - 16);
    if Hash::new().bytes(body).value().to_le_bytes() != checksum {
        return Err("the saved state is damaged: its checksum is wrong".into());
    }

    let [state, flags, interface, events] = rest.take()?;
    let interface = match interface {
        0 => Interface::ModelExchange,
        1 => Interface::CoSimulation,
        _ => {
            return Err(
                "the saved state is damaged: it names an interface that does not exist".into()
            );
        }
    };
    let events = Events::ALL.get(usize::from(events)).copied();
    let events = events.filter(|events| V::allows(interface, *events));
    let events = events.ok_or("the saved state is damaged: who handles events")?;
    let mut saved = Instance::with_events(interface, events).with_extent(extent);
    saved.layout = layout;
    let possible =
        |s: &InstanceState| *s != InstanceState::Fatal && s.is_reachable(interface, saved.events);
    let state = InstanceState::ALL.get(usize::from(state)).copied().filter(possible);
    let state = state.ok_or("the saved state is damaged: no such instance state")?;
    saved.state = state;
    saved.sloped = flags & HAS_SLOPES != 0;
    saved.past_slopes = flags & HAS_PAST_SLOPES != 0;
    saved.clock.start = rest.finite("start time")?;
    saved.clock.stop = Some(rest.finite("stop time")?).filter(|_| flags & HAS_STOP != 0);
    saved.tolerance = rest.finite("tolerance")?;
    saved.clock.time = rest.finite("time")?;
    saved.clock.last_event = rest.finite("last event")?;
    if !TOLERANCES.contains(&saved.tolerance) {
        return Err("the saved state is damaged: its tolerance is out of range".into());
    }
    for (scalar, value) in table.parameters().iter().zip(&mut saved.parameters) {
        *value = rest.value(scalar, *value)?;
    }
    for scalar in table.inputs() {
        if let Access::Input(ramp) = scalar.access {
            for number in ramp(&mut saved.inputs, scalar.element) {
                *number = rest.finite(scalar.variable.name)?;
            }
            let [value, slope] = ramp(&mut saved.inputs, scalar.element);
            if let Some(problem) = scalar.problem(Value::Real(*value)) {
                return Err(format!("the saved state is damaged: {problem}"));
            }
            if !scalar.variable.allows_rate(*slope) {
                let name = scalar.name();
                return Err(format!(
                    "the saved state is damaged: derivative of {name} = {slope:?}"
                ));
            }
        }
    }
    for _ in table.discrete() {
        let shown = i32::from_le_bytes(rest.take()?);
        if flags & HAS_SHOWN != 0 && saved.events == Events::Reported {
            saved.shown.push(shown);
        }
    }
    let mut words = vec![0; table.about.saved_words];
    for word in &mut words {
        *word = u64::from_le_bytes(rest.take()?);
    }
    if flags & HAS_MODEL != 0 {
        let parameters = saved.model_parameters().map_err(|problems| problems.join("; "))?;
        let model = M::resume(&parameters, &words, saved.tolerance);
        let mut model = model.ok_or("the saved state is damaged: the model's state")?;
        model.set_time(saved.clock.now());
        saved.model = Some(model);
    } else if saved.is_running() {
        return Err("the saved state is damaged: the model is missing".into());
    }
    Ok(saved)
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let (head, tail) =
            self.0.split_first_chunk::<N>().ok_or("the saved state is cut off".to_string())?;
        self.0 = tail;
        Ok(*head)
    }

    fn finite(&mut self, what: &str) -> Result<f64, String> {
        let x = f64::from_le_bytes(self.take()?);
        if x.is_finite() { Ok(x) } else { Err(format!("the saved state is damaged: {what}")) }
    }

    /// Reads the value of a parameter, whose type is the type of `like`. A value outside the parameter's range is accepted,
    /// because a state can be saved before the parameters are checked at the end of initialization mode.
    fn value<M: Model>(&mut self, scalar: &Scalar<M>, like: Value) -> Result<Value, String> {
        let bytes = self.take()?;
        let number = i32::try_from(i64::from_le_bytes(bytes));
        match (like, number) {
            (Value::Real(_), _) => Ok(Value::Real(f64::from_le_bytes(bytes))),
            (Value::Integer(_), Ok(n)) => Ok(Value::Integer(n)),
            (Value::Boolean(_), Ok(n @ (0 | 1))) => Ok(Value::Boolean(n == 1)),
            _ => Err(format!("the saved state is damaged: {}", scalar.name())),
        }
    }
}

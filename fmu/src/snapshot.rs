//! A saved state as bytes.
//!
//! A saved state is a copy of the instance; its bytes are the copy written out,
//! little-endian, so that they can be moved to another process or machine:
//!
//! | part | bytes |
//! | --- | --- |
//! | "HubSlosh" | 8 |
//! | version of this format | 4 |
//! | length of the whole | 4 |
//! | GUID of the variable table | 38 |
//! | state of life, flags (1: stop time, 2: plant) | 1 + 1 |
//! | interface, 0 | 1 + 1 |
//! | start, stop, tolerance, time | 4 x 8 |
//! | parameters in the table's order: number, or 0/1 | 8 each |
//! | inputs: value, slope | 16 each |
//! | the plant's words | 8 each |
//! | checksum of all before | 16 |
//!
//! Everything else about a plant follows from its parameters.

use plant::{Plant, Ramp, State};

use crate::calls::{Interface, Mode};
use crate::hash::Hash;
use crate::instance::{Instance, TOLERANCES};
use crate::table;
use crate::variable::{Value, Variable};

const MAGIC: &[u8; 8] = b"HubSlosh";
const FORMAT: u32 = 3;
const HAS_STOP: u8 = 1;
const HAS_PLANT: u8 = 2;

/// The number of bytes; the same for every state.
pub fn size() -> usize {
    let head = 8 + 4 + 4 + 38 + 4 + 4 * 8;
    let set = table::parameters().count() * 8 + table::ramps().count() * 16;
    head + set + State::WORDS * 8 + 16
}

/// A state as bytes.
pub fn to_bytes(saved: &Instance) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(size());
    bytes.extend(MAGIC);
    bytes.extend(FORMAT.to_le_bytes());
    bytes.extend((size() as u32).to_le_bytes());
    bytes.extend(table::guid().as_bytes());
    let stop = if saved.stop.is_some() { HAS_STOP } else { 0 };
    let plant = if saved.plant.is_some() { HAS_PLANT } else { 0 };
    bytes.extend([saved.mode as u8, stop | plant, saved.interface as u8, 0]);
    for time in [saved.start, saved.stop.unwrap_or(0.0), saved.tolerance, saved.time] {
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
    for (_, ramp) in table::ramps() {
        let Ramp { value, slope } = *ramp(&mut inputs);
        bytes.extend(value.to_le_bytes());
        bytes.extend(slope.to_le_bytes());
    }
    let words = saved.plant.as_ref().map_or([0; State::WORDS], |plant| plant.state().to_words());
    for word in words {
        bytes.extend(word.to_le_bytes());
    }
    let checksum = Hash::new().bytes(&bytes).value();
    bytes.extend(checksum.to_le_bytes());
    bytes
}

/// The state that the bytes hold, or why they hold none.
pub fn from_bytes(bytes: &[u8]) -> Result<Instance, String> {
    let mut rest = Reader(bytes);
    if rest.take::<8>()? != *MAGIC {
        return Err("these bytes are not a saved state of HubSlosh".into());
    }
    let format = u32::from_le_bytes(rest.take()?);
    if format != FORMAT {
        return Err(format!("the saved state has format {format}; known: {FORMAT}"));
    }
    let length = u32::from_le_bytes(rest.take()?) as usize;
    if length != bytes.len() {
        return Err(format!("the saved state should have {length} bytes, not {}", bytes.len()));
    }
    let guid = rest.take::<38>()?;
    if guid != table::guid().as_bytes() {
        let guid = String::from_utf8_lossy(&guid);
        return Err(format!("the saved state is of another HubSlosh, {guid}"));
    }
    if length != size() {
        return Err(format!("a saved state has {} bytes, not {length}", size()));
    }
    let (body, checksum) = bytes.split_at(length - 16);
    if Hash::new().bytes(body).value().to_le_bytes() != checksum {
        return Err("the saved state is damaged: its checksum is wrong".into());
    }

    let [mode, flags, interface, _] = rest.take()?;
    let interface = match interface {
        0 => Interface::ModelExchange,
        1 => Interface::CoSimulation,
        _ => return Err("the saved state is damaged: no such interface".into()),
    };
    let possible = |m: &Mode| *m != Mode::Fatal && m.only_in().is_none_or(|only| only == interface);
    let mode = Mode::ALL.get(usize::from(mode)).copied().filter(possible);
    let mode = mode.ok_or("the saved state is damaged: no such state of life")?;
    let mut saved = Instance::new(interface);
    saved.mode = mode;
    saved.start = rest.finite("start time")?;
    saved.stop = Some(rest.finite("stop time")?).filter(|_| flags & HAS_STOP != 0);
    saved.tolerance = rest.finite("tolerance")?;
    saved.time = rest.finite("time")?;
    if !TOLERANCES.contains(&saved.tolerance) {
        return Err("the saved state is damaged: tolerance".into());
    }
    for (variable, value) in table::parameters().zip(&mut saved.parameters) {
        *value = rest.value(variable, *value)?;
    }
    for (variable, ramp) in table::ramps() {
        let value = rest.finite(variable.name)?;
        let slope = rest.finite(variable.name)?;
        *ramp(&mut saved.inputs) = Ramp { value, slope };
    }
    let mut words = [0; State::WORDS];
    for word in &mut words {
        *word = u64::from_le_bytes(rest.take()?);
    }
    if flags & HAS_PLANT != 0 {
        let parameters = saved.plant_parameters().map_err(|problems| problems.join("; "))?;
        let state = State::from_words(&words);
        let state = state.ok_or("the saved state is damaged: the plant's state")?;
        saved.plant = Some(Plant::resume(&parameters, &state, saved.tolerance));
    } else if saved.is_running() {
        return Err("the saved state is damaged: the plant is missing".into());
    }
    Ok(saved)
}

/// Bytes that are still to be read.
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

    /// A parameter's value, of the same type as `like`. Wrong values are
    /// possible: they can be saved before initialization ends.
    fn value(&mut self, variable: &Variable, like: Value) -> Result<Value, String> {
        let bytes = self.take()?;
        let number = i32::try_from(i64::from_le_bytes(bytes));
        match (like, number) {
            (Value::Real(_), _) => Ok(Value::Real(f64::from_le_bytes(bytes))),
            (Value::Integer(_), Ok(n)) => Ok(Value::Integer(n)),
            (Value::Boolean(_), Ok(n @ (0 | 1))) => Ok(Value::Boolean(n == 1)),
            _ => Err(format!("the saved state is damaged: {}", variable.name)),
        }
    }
}

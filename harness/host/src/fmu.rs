//! An FMU of either version, for a host that runs it by co-simulation: what differs between FMI 2.0 and 3.0 is told
//! apart here and nowhere above.
//!
//! FMI 3.0 is driven without event mode and early return, as FMI 2.0: the FMU handles its events itself. Inputs that go
//! in straight lines through a step are told by their derivatives in FMI 2.0; in FMI 3.0 they are set in intermediate
//! update, where the FMU provides it.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, bail};

use crate::archive::Archive;
use crate::c_abi::{CallError, Called, Message, Status};
use crate::description::{CType, ModelDescription, Type, Value, Variable};
use crate::temporary;
use crate::{fmi2, fmi3};

/// An opened FMU: unpacked to a temporary directory, its binary loaded.
pub enum Fmu {
    /// FMI 2.0.
    V2(fmi2::Fmu),
    /// FMI 3.0.
    V3(fmi3::Fmu),
}

/// One instance for co-simulation; freed when dropped. Belongs to the thread that made it.
pub enum Instance<'fmu> {
    /// FMI 2.0.
    V2(fmi2::Instance<'fmu>, &'fmu Fmu),
    /// FMI 3.0.
    V3(fmi3::Instance<'fmu>, &'fmu Fmu),
}

/// A snapshot of an instance.
pub enum State {
    /// FMI 2.0.
    V2(fmi2::FmuState),
    /// FMI 3.0.
    V3(fmi3::FmuState),
}

impl Fmu {
    /// Opens a packed FMU and loads the binary for this platform.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        Fmu::open_with(path, &[])
    }

    /// The same; of the settings it takes those that are structural parameters of FMI 3.0, which say how long arrays are. Every
    /// instance sets them before anything else, and the description has the elements that there are then.
    ///
    /// # Errors
    /// Also if the FMU refuses such a parameter.
    pub fn open_with(path: impl AsRef<Path>, settings: &[(String, String)]) -> Result<Self> {
        let path = path.as_ref();
        let name = path.display();
        let archive = Archive::open(path)?;
        let text = archive.description().with_context(|| format!("{name} is not an FMU"))?;
        let description =
            ModelDescription::from_xml(&text).with_context(|| format!("{name} cannot be used"))?;
        if !description.is_fmi3() {
            return fmi2::Fmu::open(path).map(Fmu::V2);
        }
        if description.co_simulation.is_none() {
            bail!("{name} offers no co-simulation; this host drives nothing else");
        }
        let directory = temporary::Folder::new()?;
        archive.unpack(directory.path()).with_context(|| format!("{name} is not an FMU"))?;
        let mut fmu = fmi3::Fmu::load(directory.path(), path)?;
        let hash = archive.hash().with_context(|| format!("{name} cannot be read"))?;
        fmu.keep(hash, directory);
        let structural: Vec<&str> = description
            .variables
            .iter()
            .filter(|v| v.is_structural())
            .map(|v| v.name.as_str())
            .collect();
        let settings: Vec<(&str, &str)> = settings
            .iter()
            .map(|(name, value)| (name.as_str(), value.as_str()))
            .filter(|(name, _)| structural.contains(name))
            .collect();
        if !settings.is_empty() {
            fmu.configure(&text, &settings)?;
        }
        Ok(Fmu::V3(fmu))
    }

    /// Model description of the FMU.
    pub fn description(&self) -> &ModelDescription {
        match self {
            Fmu::V2(fmu) => fmu.description(),
            Fmu::V3(fmu) => fmu.description(),
        }
    }

    /// SHA-256 of the `.fmu` file, in hexadecimal digits.
    pub fn hash(&self) -> &str {
        match self {
            Fmu::V2(fmu) => fmu.hash(),
            Fmu::V3(fmu) => fmu.hash(),
        }
    }

    /// SHA-256 of the binary that is loaded, in hexadecimal digits.
    pub fn binary_hash(&self) -> &str {
        match self {
            Fmu::V2(fmu) => fmu.binary_hash(),
            Fmu::V3(fmu) => fmu.binary_hash(),
        }
    }

    /// Changes of the whole process by loading the binary, such as the rounding mode.
    pub fn changed(&self) -> &[&'static str] {
        match self {
            Fmu::V2(fmu) => fmu.changed(),
            Fmu::V3(fmu) => fmu.changed(),
        }
    }

    /// The file it was opened from.
    pub fn path(&self) -> &Path {
        match self {
            Fmu::V2(fmu) => fmu.path(),
            Fmu::V3(fmu) => fmu.path(),
        }
    }

    /// A new co-simulation instance with logging on.
    pub fn instantiate(&self, name: &str) -> Called<Instance<'_>> {
        Ok(match self {
            Fmu::V2(fmu) => Instance::V2(fmu.instantiate(name)?, self),
            Fmu::V3(fmu) => Instance::V3(fmu.instantiate(name)?, self),
        })
    }

    /// The same, at rest: [`ModelDescription::moving_starts`] are 0. What then moves was asked for.
    pub fn instantiate_at_rest(&self, name: &str) -> Result<Instance<'_>> {
        let mut instance = self.instantiate(name)?;
        for start in self.description().moving_starts() {
            instance.set(start, "0")?;
        }
        Ok(instance)
    }
}

impl<'fmu> Instance<'fmu> {
    /// The FMU it is an instance of.
    pub fn fmu(&self) -> &'fmu Fmu {
        match self {
            Instance::V2(_, fmu) | Instance::V3(_, fmu) => fmu,
        }
    }

    fn variable(&self, reference: u32) -> &'fmu Variable {
        let variables = &self.fmu().description().variables;
        let of = variables.iter().find(|v| v.reference == reference && v.kind() == Type::Real);
        of.expect("a reference of one of the FMU's Reals")
    }

    /// Everything logged since the last time somebody asked.
    pub fn take_messages(&self) -> Vec<Message> {
        match self {
            Instance::V2(instance, _) => instance.take_messages(),
            Instance::V3(instance, _) => instance.take_messages(),
        }
    }

    /// Returns the FMU's warnings since the last call.
    pub fn take_warnings(&self) -> Vec<String> {
        match self {
            Instance::V2(instance, _) => instance.take_warnings(),
            Instance::V3(instance, _) => instance.take_warnings(),
        }
    }

    /// Into initialization mode: times in s; `tolerance` is relative.
    pub fn enter_initialization_mode(
        &mut self,
        tolerance: Option<f64>,
        start: f64,
        stop: Option<f64>,
    ) -> Called {
        match self {
            Instance::V2(instance, _) => {
                instance.setup_experiment(tolerance, start, stop)?;
                instance.enter_initialization_mode()
            }
            Instance::V3(instance, _) => instance.enter_initialization_mode(tolerance, start, stop),
        }
    }

    /// Out of initialization mode, ready for the first step.
    pub fn exit_initialization_mode(&mut self) -> Called {
        match self {
            Instance::V2(instance, _) => instance.exit_initialization_mode(),
            Instance::V3(instance, _) => instance.exit_initialization_mode(),
        }
    }

    /// A snapshot of the instance. Must be given back with [`Instance::free_state`]; otherwise its memory is lost.
    pub fn get_state(&mut self) -> Called<State> {
        Ok(match self {
            Instance::V2(instance, _) => State::V2(instance.get_state()?),
            Instance::V3(instance, _) => State::V3(instance.get_state()?),
        })
    }

    /// Goes back to a snapshot of this instance.
    ///
    /// # Panics
    /// If it is of an FMU of the other version.
    pub fn set_state(&mut self, state: &State) -> Called {
        match (self, state) {
            (Instance::V2(instance, _), State::V2(state)) => instance.set_state(state),
            (Instance::V3(instance, _), State::V3(state)) => instance.set_state(state),
            _ => panic!("a snapshot of the other version of FMI"),
        }
    }

    /// Gives a snapshot of this instance back.
    ///
    /// # Panics
    /// If it is of an FMU of the other version.
    pub fn free_state(&mut self, state: State) -> Called {
        match (self, state) {
            (Instance::V2(instance, _), State::V2(state)) => instance.free_state(state),
            (Instance::V3(instance, _), State::V3(state)) => instance.free_state(state),
            _ => panic!("a snapshot of the other version of FMI"),
        }
    }

    /// Makes a step from `time` by `step`, s, inputs held.
    pub fn do_step(&mut self, time: f64, step: f64) -> Called {
        match self {
            Instance::V2(instance, _) => instance.do_step(time, step),
            Instance::V3(instance, _) => whole(instance, time, step, instance_step),
        }
    }

    /// Makes a step through which these Reals, inputs that were set just now to `values`, go with `slopes`, per s. An
    /// FMU 3.0 hears of them in intermediate update.
    pub fn do_step_along(
        &mut self,
        time: f64,
        step: f64,
        references: &[u32],
        values: &[f64],
        slopes: &[f64],
    ) -> Called {
        match self {
            Instance::V2(instance, _) => {
                assert_eq!(references.len(), slopes.len());
                // no allocation in a step, so as many at a time as there are ones
                let ones = [1; 16];
                for (some, slopes) in references.chunks(ones.len()).zip(slopes.chunks(ones.len())) {
                    instance.set_real_input_derivatives(some, &ones[..some.len()], slopes)?;
                }
                instance.do_step(time, step)
            }
            Instance::V3(instance, _) => {
                let mut line = Line::of(instance, references, values)?;
                let mut refused = Status::Ok;
                let done = whole(instance, time, step, |instance, from, h| {
                    instance.do_step_hearing(
                        from,
                        h,
                        Some(&mut |update: &fmi3::Update| {
                            if update.set_requested && !line.moving.is_empty() {
                                for (place, i) in &line.moving {
                                    line.values[*place] =
                                        values[*i] + slopes[*i] * (update.time - time);
                                }
                                let set = update.set(&line.references, &line.values);
                                refused = refused.max(set);
                            }
                            None
                        }),
                    )
                });
                done?;
                match refused {
                    Status::Ok | Status::Warning => Ok(()),
                    status => Err(CallError {
                        call: "fmi3SetFloat64",
                        status,
                        messages: instance.take_messages(),
                    }),
                }
            }
        }
    }

    /// Reads Reals by reference.
    pub fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Called {
        if let Instance::V2(instance, _) = self {
            return instance.get_real(references, values);
        }
        let is_plain = matches!(self.fmu(), Fmu::V3(fmu) if fmu.is_plain(references));
        for (reference, value) in references.iter().zip(values.iter_mut()) {
            if is_plain {
                break;
            }
            if let Value::Real(x) = self.value(self.variable(*reference))? {
                *value = x;
            }
        }
        match self {
            Instance::V3(instance, _) if is_plain => instance.fetch(references, values),
            _ => Ok(()),
        }
    }

    /// Sets Reals by reference.
    pub fn set_real(&mut self, references: &[u32], values: &[f64]) -> Called {
        if let Instance::V2(instance, _) = self {
            return instance.set_real(references, values);
        }
        let is_plain = matches!(self.fmu(), Fmu::V3(fmu) if fmu.is_plain(references));
        match self {
            Instance::V3(instance, _) if is_plain => instance.give(references, values),
            _ => {
                for (reference, value) in references.iter().zip(values) {
                    self.set_value(self.variable(*reference), Value::Real(*value))?;
                }
                Ok(())
            }
        }
    }

    /// The value of a variable of the FMU's description.
    pub fn value(&mut self, variable: &Variable) -> Called<Value> {
        match self {
            Instance::V2(instance, _) => instance.value(variable),
            Instance::V3(instance, _) => instance.value(variable),
        }
    }

    fn set_value(&mut self, variable: &Variable, value: Value) -> Called {
        match self {
            Instance::V2(instance, _) => instance.set_value(variable, value),
            Instance::V3(instance, _) => instance.set_value(variable, value),
        }
    }

    /// The value of a variable by name.
    pub fn get(&mut self, name: &str) -> Result<Value> {
        let variable = self.fmu().description().variable(name)?;
        if matches!(variable.kind(), Type::Binary | Type::Clock) {
            bail!("{name} is a {:?}, of which this host reads no values", variable.kind());
        }
        Ok(self.value(variable)?)
    }

    /// The value of a real variable.
    pub fn real(&mut self, name: &str) -> Result<f64> {
        match self.get(name)? {
            Value::Real(value) => Ok(value),
            other => bail!("{name} is not a Real but {other:?}"),
        }
    }

    /// Sets a variable from text: a number, `true`/`false`, or an enumeration's value by name or number.
    ///
    /// # Errors
    /// If the text is not of its type, or the FMU refuses it. A structural parameter of FMI 3.0 keeps the value that it has since
    /// [`Fmu::open_with`].
    pub fn set(&mut self, name: &str, text: &str) -> Result<()> {
        let description = self.fmu().description();
        let variable = description.variable(name)?;
        let value = description.value(variable, text)?;
        if variable.is_structural() {
            let now = variable.attributes().start.as_deref().unwrap_or_default();
            if description.value(variable, now).is_ok_and(|now| now == value) {
                return Ok(());
            }
            bail!(
                "{name} cannot be set to {text}: it is a structural parameter, by which arrays have their size, and that is \
                 {now} for all that is done with the FMU here (`hubslosh run` and `step-cost` set it)"
            );
        }
        self.set_value(variable, value).with_context(|| format!("{name}={text} was refused"))
    }
}

/// Inputs of an FMU 3.0 within a step, by its own value references: of an array all elements.
#[derive(Default)]
struct Line {
    references: Vec<u32>,
    values: Vec<f64>,
    /// Places among the values that move, each with the place of its input among those that were asked for.
    moving: Vec<(usize, usize)>,
}

impl Line {
    /// Those of these inputs, at `values` now, that the FMU takes within a step.
    fn of(instance: &mut fmi3::Instance, references: &[u32], values: &[f64]) -> Called<Line> {
        let description = instance.fmu().description();
        let mut line = Line::default();
        let mut begins = BTreeMap::new();
        for (i, reference) in references.iter().enumerate() {
            let is_taken = |v: &Variable| v.intermediate && v.c_type() == CType::Float64;
            if !description.variables.iter().any(|v| v.reference == *reference && is_taken(v)) {
                continue;
            }
            let Some(element) = description.element(*reference) else {
                line.moving.push((line.values.len(), i));
                line.references.push(*reference);
                line.values.push(values[i]);
                continue;
            };
            let begin = match begins.get(&element.array) {
                Some(begin) => *begin,
                None => {
                    let length = description.array(element.array).map_or(0, |array| array.length);
                    let begin = line.values.len();
                    line.values.resize(begin + length, 0.0);
                    instance.fetch(&[element.array], &mut line.values[begin..])?;
                    line.references.push(element.array);
                    begins.insert(element.array, begin);
                    begin
                }
            };
            line.moving.push((begin + element.index, i));
        }
        Ok(line)
    }
}

fn instance_step(instance: &mut fmi3::Instance, time: f64, step: f64) -> Called<fmi3::Step> {
    instance.do_step(time, step)
}

/// Makes a whole step of an FMU 3.0 that was allowed no early return.
fn whole(
    instance: &mut fmi3::Instance,
    time: f64,
    step: f64,
    mut make: impl FnMut(&mut fmi3::Instance, f64, f64) -> Called<fmi3::Step>,
) -> Called {
    let done = make(instance, time, step)?;
    if done.terminate == 1 {
        // as FMI 2.0 says it: the step was not done to its end
        let mut messages = instance.take_messages();
        messages.push(Message {
            status: Status::Discard,
            category: String::new(),
            text: format!("it asks for the end of the simulation at t = {} s", done.last_time),
        });
        return Err(CallError { call: "fmi3DoStep", status: Status::Discard, messages });
    }
    if done.early_return == 1 {
        let text =
            format!("it returns early, at t = {} s, which it was not allowed to", done.last_time);
        let message = Message { status: Status::Error, category: String::new(), text };
        return Err(CallError {
            call: "fmi3DoStep",
            status: Status::Error,
            messages: vec![message],
        });
    }
    Ok(())
}

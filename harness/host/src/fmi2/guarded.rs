//! Calls with a margin of known bytes before and after each array. The margins show if an FMU writes outside an array,
//! and the array itself if an FMU writes into an array that it may only read.

use super::*;
use crate::c_abi::version::{GetVector, State};

const MARGIN: usize = 1024;
const FILL: u64 = 0xa5c3_5a3c_a53c_5ac3;

struct Guarded {
    words: Vec<u64>,
    bytes: usize,
    /// Content of the array before the call, if the FMU may only read the array. `None` for an
    /// array that the FMU may write.
    input: Option<Vec<u8>>,
}

impl Guarded {
    fn output<T>(count: usize) -> Guarded {
        let bytes = count * size_of::<T>();
        let words = vec![FILL; 2 * MARGIN / 8 + bytes.div_ceil(8)];
        Guarded { words, bytes, input: None }
    }

    fn input<T: Copy>(values: &[T]) -> Guarded {
        let mut array = Guarded::output::<T>(values.len());
        // SAFETY: the array has room for the values, and the two do not overlap.
        unsafe { array.pointer::<T>().copy_from_nonoverlapping(values.as_ptr(), values.len()) };
        array.input = Some(array.content());
        array
    }

    fn pointer<T>(&mut self) -> *mut T {
        self.words[MARGIN / 8..].as_mut_ptr().cast()
    }

    fn all_bytes(&self) -> Vec<u8> {
        self.words.iter().flat_map(|word| word.to_ne_bytes()).collect()
    }

    fn content(&self) -> Vec<u8> {
        self.all_bytes()[MARGIN..MARGIN + self.bytes].to_vec()
    }

    fn fault(&self) -> Option<String> {
        let all = self.all_bytes();
        let fill = FILL.to_ne_bytes();
        let is_touched = |at: &usize| all[*at] != fill[at % 8];
        let end = MARGIN + self.bytes;
        let (before, after) = ((0..MARGIN).find(is_touched), (end..all.len()).rfind(is_touched));
        match (before, after) {
            (_, Some(last)) => {
                Some(format!("it writes up to {} bytes past its end", last + 1 - end))
            }
            (Some(first), None) => {
                Some(format!("it writes up to {} bytes before its beginning", MARGIN - first))
            }
            (None, None) if self.input.as_ref().is_some_and(|input| *input != self.content()) => {
                Some("it changes an array that it may only read".into())
            }
            (None, None) => None,
        }
    }
}

/// A fault of an FMU: it has written outside an array of the host, or into an array that it may
/// only read.
#[derive(Clone, Debug)]
pub struct StrayWrite {
    pub call: &'static str,
    pub array: String,
    pub fault: String,
}

#[derive(Clone, Debug, Default)]
pub struct Lists {
    pub reals: Vec<u32>,
    pub integers: Vec<u32>,
    pub booleans: Vec<u32>,
    pub strings: Vec<u32>,
    pub inputs: Vec<(u32, f64)>,
    pub unknowns: Vec<u32>,
    pub knowns: Vec<u32>,
    pub outputs: Vec<u32>,
    pub states: Option<usize>,
    pub indicators: Option<usize>,
    pub serializes: bool,
}

fn lengths(all: usize) -> Vec<usize> {
    let mut lengths = vec![1, all.div_ceil(2), all];
    lengths.retain(|n| *n > 0 && *n <= all);
    lengths.dedup();
    lengths
}

impl Instance<'_> {
    /// Calls the functions that take arrays with guard bytes around every array. Returns the places
    /// where the FMU has written beyond an array, or into an array that it may only read. Calls
    /// that the FMU refuses are checked, too.
    pub fn find_stray_writes(&mut self, lists: &Lists) -> Vec<StrayWrite> {
        let mut found = Vec::new();
        self.begin_call();
        self.check_values(lists, &mut found);
        self.check_derivatives(lists, &mut found);
        self.check_vectors(lists, &mut found);
        if lists.serializes {
            self.check_states(&mut found);
        }
        self.calls.end();
        self.take_messages();
        found
    }

    fn check_values(&mut self, lists: &Lists, found: &mut Vec<StrayWrite>) {
        let f = self.functions();
        self.check_reads(f.get_real, &lists.reals, found);
        self.check_reads(f.get_integer, &lists.integers, found);
        self.check_reads(f.get_boolean, &lists.booleans, found);
        self.check_reads(f.get_string, &lists.strings, found);
        let (references, values): (Vec<u32>, Vec<f64>) = lists.inputs.iter().copied().unzip();
        for n in lengths(references.len()) {
            let (mut vr, mut x) = (Guarded::input(&references[..n]), Guarded::input(&values[..n]));
            // SAFETY: all arrays have n values; the same holds for all calls of this file.
            unsafe { (f.set_real.call)(self.component, vr.pointer(), n, x.pointer()) };
            record_faults(found, f.set_real.name, n, &[("vr", &vr), ("value", &x)]);
        }
    }

    fn check_reads<T>(
        &self,
        function: Function<Get<T>>,
        references: &[u32],
        found: &mut Vec<StrayWrite>,
    ) {
        for n in lengths(references.len()) {
            let (mut vr, mut x) = (Guarded::input(&references[..n]), Guarded::output::<T>(n));
            // SAFETY: the same as in `check_values`.
            unsafe { (function.call)(self.component, vr.pointer(), n, x.pointer()) };
            record_faults(found, function.name, n, &[("vr", &vr), ("value", &x)]);
        }
    }

    fn check_derivatives(&mut self, lists: &Lists, found: &mut Vec<StrayWrite>) {
        let (f, c) = (self.functions().get_directional_derivative, self.component);
        for n in lengths(lists.unknowns.len()) {
            let m = lists.knowns.len();
            let (mut unknown, mut known) =
                (Guarded::input(&lists.unknowns[..n]), Guarded::input(&lists.knowns));
            let (mut along, mut answer) =
                (Guarded::input(&vec![1.0; m]), Guarded::output::<f64>(n));
            // SAFETY: the same as in `check_values`.
            unsafe {
                (f.call)(
                    c,
                    unknown.pointer(),
                    n,
                    known.pointer(),
                    m,
                    along.pointer(),
                    answer.pointer(),
                )
            };
            let arrays = [
                ("vUnknown_ref", &unknown),
                ("vKnown_ref", &known),
                ("dvKnown", &along),
                ("dvUnknown", &answer),
            ];
            record_faults(found, f.name, n, &arrays);
        }
        let Some(stepping) = &self.fmu.own.stepping else { return };
        let f = stepping.get_real_output_derivatives;
        for n in lengths(lists.outputs.len()) {
            let (mut vr, mut order) =
                (Guarded::input(&lists.outputs[..n]), Guarded::input(&vec![1 as c_int; n]));
            let mut x = Guarded::output::<f64>(n);
            // SAFETY: the same as in `check_values`.
            unsafe { (f.call)(c, vr.pointer(), n, order.pointer(), x.pointer()) };
            let arrays = [("vr", &vr), ("order", &order), ("value", &x)];
            record_faults(found, f.name, n, &arrays);
        }
    }

    fn check_vectors(&mut self, lists: &Lists, found: &mut Vec<StrayWrite>) {
        let c = self.component;
        let (Some(f), Some(events)) = (&self.fmu.exchange, &self.fmu.own.events) else { return };
        let vectors: [(Function<GetVector>, Option<usize>); 4] = [
            (f.get_continuous_states, lists.states),
            (f.get_derivatives, lists.states),
            (f.get_nominals, lists.states),
            (f.get_event_indicators, lists.indicators),
        ];
        for (function, count) in vectors {
            let Some(n) = count else { continue };
            let mut x = Guarded::output::<f64>(n);
            // SAFETY: the same as in `check_values`.
            unsafe { (function.call)(c, x.pointer(), n) };
            record_faults(found, function.name, n, &[("the vector", &x)]);
        }
        if let Some(n) = lists.states.filter(|n| *n > 0) {
            let mut now = vec![0.0; n];
            // SAFETY: the same as in `check_values`.
            unsafe { (f.get_continuous_states.call)(c, now.as_mut_ptr(), n) };
            let mut x = Guarded::input(&now);
            // SAFETY: the same as in `check_values`.
            unsafe { (f.set_continuous_states.call)(c, x.pointer(), n) };
            record_faults(found, f.set_continuous_states.name, n, &[("x", &x)]);
        }
        if lists.states.is_some() {
            let (mut enter, mut end) = (Guarded::output::<c_int>(1), Guarded::output::<c_int>(1));
            // SAFETY: the same as in `check_values`.
            unsafe { (f.completed_integrator_step.call)(c, 1, enter.pointer(), end.pointer()) };
            let arrays = [("enterEventMode", &enter), ("terminateSimulation", &end)];
            record_faults(found, f.completed_integrator_step.name, 1, &arrays);
            let mut info = Guarded::output::<EventInfo>(1);
            // SAFETY: the same as in `check_values`; the host returns to continuous-time mode.
            unsafe {
                (events.enter_event_mode.call)(c);
                (events.new_discrete_states.call)(c, info.pointer());
                (f.enter_continuous_time_mode.call)(c);
            }
            record_faults(found, events.new_discrete_states.name, 1, &[("fmi2EventInfo", &info)]);
        }
    }

    fn check_states(&mut self, found: &mut Vec<StrayWrite>) {
        let (f, c) = (&self.fmu.common, self.component);
        let Ok(state) = self.get_state() else { return };
        let mut size = Guarded::output::<usize>(1);
        // SAFETY: the same as in `check_values`.
        let status = unsafe { (f.serialized_fmu_state_size.call)(c, state.0, size.pointer()) };
        record_faults(found, f.serialized_fmu_state_size.name, 1, &[("size", &size)]);
        let n = size.words[MARGIN / 8] as usize;
        if status == 0 && n < 1 << 30 {
            let mut bytes = Guarded::output::<u8>(n);
            // SAFETY: the same as in `check_values`.
            let status = unsafe { (f.serialize_fmu_state.call)(c, state.0, bytes.pointer(), n) };
            record_faults(found, f.serialize_fmu_state.name, n, &[("serializedState", &bytes)]);
            if status == 0 {
                let mut bytes = Guarded::input(&bytes.content());
                let mut copy: State = null_mut();
                // SAFETY: the same as in `check_values`.
                unsafe { (f.deserialize_fmu_state.call)(c, bytes.pointer(), n, &mut copy) };
                record_faults(
                    found,
                    f.deserialize_fmu_state.name,
                    n,
                    &[("serializedState", &bytes)],
                );
                let _ = self.free_state(FmuState(copy));
            }
        }
        let _ = self.free_state(state);
    }
}

fn record_faults(
    found: &mut Vec<StrayWrite>,
    call: &'static str,
    n: usize,
    arrays: &[(&str, &Guarded)],
) {
    for (name, array) in arrays {
        if let Some(fault) = array.fault() {
            found.push(StrayWrite { call, array: format!("{name}, {n} long"), fault });
        }
    }
}

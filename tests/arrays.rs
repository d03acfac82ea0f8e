//! The FMU 3.0 with arrays has the same library, the same variables and bit-identical results as the FMU 3.0 with
//! scalars. The sizes of its arrays can be set before initialisation. An FMU with only a part of the variables
//! also has identical results.

use std::collections::BTreeMap;
use std::path::Path;

use host::archive::Archive;
use host::c_abi::{CallError, Status};
use host::description::{CType, Value};
use host::fmi3::{Fmu, Instance, Instantiation, Interface};
use host::part::Limit;
use host::xml::Element;
use pack::{Fmi, MODELS, Model, packed_version_for_tests};

/// Identifies one scalar value of the model: the name of its variable without brackets, and all indices.
type Key = (String, Vec<usize>);

/// Splits the name of a scalar into name and indices, for example `tank[1].p[2,3]` into tank.p and 1, 2, 3.
fn key(name: &str) -> Key {
    let (mut plain, mut indices) = (String::new(), Vec::new());
    let mut rest = name;
    while let Some((before, after)) = rest.split_once('[') {
        let (inside, after) = after.split_once(']').unwrap();
        plain += before;
        indices.extend(inside.split(',').map(|n| n.parse::<usize>().unwrap()));
        rest = after;
    }
    (plain + rest, indices)
}

struct Variable {
    name: String,
    reference: u32,
    kind: String,
    causality: String,
    /// Length of each dimension, or the value reference of the structural parameter that determines the length.
    dimensions: Vec<Result<usize, u32>>,
    xml: Element,
}

impl Variable {
    fn all(root: &Element) -> Vec<Variable> {
        let number = |text: &str| text.parse::<u32>().unwrap();
        root.list("ModelVariables")
            .map(|e| Variable {
                name: e.get("name").unwrap().into(),
                reference: number(e.get("valueReference").unwrap()),
                kind: e.name.to_string(),
                causality: e.get("causality").unwrap().into(),
                dimensions: e
                    .children
                    .iter()
                    .filter(|child| child.name == "Dimension")
                    .map(|d| match d.get("start") {
                        Some(start) => Ok(start.parse().unwrap()),
                        None => Err(number(d.get("valueReference").unwrap())),
                    })
                    .collect(),
                xml: e.clone(),
            })
            .collect()
    }

    /// Returns the elements of the variable in row-major order. `sizes` are the values of the structural parameters.
    fn keys(&self, sizes: &BTreeMap<u32, usize>) -> Vec<Key> {
        let mut all = vec![Vec::new()];
        for dimension in &self.dimensions {
            let length = dimension.unwrap_or_else(|reference| sizes[&reference]);
            let longer = |n: usize| move |head: &Vec<usize>| [&head[..], &[n]].concat();
            all = all.iter().flat_map(|head| (1..=length).map(move |n| longer(n)(head))).collect();
        }
        let name = key(&self.name).0;
        // For the layout with scalars, the name itself contains the indices.
        let own = key(&self.name).1;
        all.into_iter().map(|indices| (name.clone(), [&own[..], &indices].concat())).collect()
    }

    fn c_type(&self) -> CType {
        CType::from_element_name(&self.kind).unwrap().0
    }
}

struct Opened {
    fmu: Fmu,
    variables: Vec<Variable>,
    _folder: tempfile::TempDir,
}

impl Opened {
    fn new(model: &'static Model, fmi: Fmi) -> Opened {
        Opened::from(packed_version_for_tests(model, fmi))
    }

    fn from(path: &Path) -> Opened {
        let archive = Archive::open(path).unwrap();
        let folder = tempfile::tempdir().unwrap();
        archive.unpack(folder.path()).unwrap();
        let root = Element::parse(archive.description().unwrap().as_bytes()).unwrap();
        let fmu = Fmu::load_for(None, folder.path(), path, &root).unwrap();
        Opened { fmu, variables: Variable::all(&root), _folder: folder }
    }

    fn variable(&self, name: &str) -> &Variable {
        self.variables.iter().find(|v| v.name == name).unwrap()
    }

    fn instance(&self, interface: Interface) -> Run<'_> {
        let with = Instantiation {
            interface,
            intermediate_update: false,
            required: Vec::new(),
            ..self.fmu.instantiation("one")
        };
        let instance = self.fmu.instantiate_with(&with).unwrap();
        let starts = self.variables.iter().filter(|v| v.kind == "UInt64");
        let starts =
            starts.map(|v| (v.reference, v.xml.get("start").unwrap().parse().unwrap())).collect();
        Run { opened: self, instance, sizes: starts }
    }
}

struct Run<'a> {
    opened: &'a Opened,
    instance: Instance<'a>,
    sizes: BTreeMap<u32, usize>,
}

impl Run<'_> {
    fn resize(&mut self, name: &str, size: usize) {
        let reference = self.opened.variable(name).reference;
        self.instance.enter_configuration_mode().unwrap();
        self.instance.set_numbers(&[reference], &[size as u64]).unwrap();
        self.instance.exit_configuration_mode().unwrap();
        self.sizes.insert(reference, size);
    }

    fn set(&mut self, value: impl Fn(&Key) -> Option<Value>) {
        for v in &self.opened.variables {
            let keys = v.keys(&self.sizes);
            let values: Option<Vec<Value>> = keys.iter().map(&value).collect();
            if let Some(values) = values.filter(|all| !all.is_empty()) {
                self.instance.set_values(v.c_type(), v.reference, &values).unwrap();
            }
        }
    }

    fn all_values(&mut self) -> BTreeMap<Key, u64> {
        let mut all = BTreeMap::new();
        for v in self.opened.variables.iter().filter(|v| v.kind != "UInt64") {
            let keys = v.keys(&self.sizes);
            let values = self.instance.values(v.c_type(), v.reference, keys.len()).unwrap();
            all.extend(keys.into_iter().zip(values.iter().map(bits)));
        }
        all
    }

    fn initialise(&mut self) {
        self.instance.enter_initialization_mode(Some(1e-8), 0.0, None).unwrap();
        self.instance.exit_initialization_mode().unwrap();
    }
}

fn bits(value: &Value) -> u64 {
    match value {
        Value::Real(x) => x.to_bits(),
        Value::Integer(n) => *n as u64,
        Value::Boolean(b) => (*b).into(),
        Value::String(_) => panic!("there are no strings"),
    }
}

/// Asserts that the FMU with scalars has every value of the FMU with arrays, bit for bit. Further values of the FMU with
/// scalars must be beyond the sizes of the arrays.
fn assert_same(arrays: &BTreeMap<Key, u64>, scalars: &BTreeMap<Key, u64>, when: &str) {
    for (key, bits) in arrays {
        assert_eq!(scalars.get(key), Some(bits), "{key:?} {when}");
    }
}

struct Case {
    model: &'static Model,
    size: Option<(&'static str, usize)>,
}

fn cases() -> Vec<Case> {
    let case = |n: usize, size| Case { model: &MODELS[n], size };
    vec![
        case(0, None),
        case(0, Some(("slosh.modes", 3))),
        case(1, None),
        case(1, Some(("tanks", 3))),
        case(1, Some(("tanks", 0))),
        case(2, None),
        case(2, Some(("tank.modes", 3))),
        case(2, Some(("tank.modes", 0))),
    ]
}

/// Returns a value for a parameter that differs from its start value and between tanks and modes; `None` if the parameter
/// keeps its start value.
fn parameter(model: &Model, (name, indices): &Key) -> Option<Value> {
    let real = |x: f64| Some(Value::Real(x));
    let integer = |n: usize| Some(Value::Integer(n as i64));
    match (model.name, &**name, &indices[..]) {
        ("HubSlosh", "slosh.model", _) => integer(4),
        ("HubSlosh", "init.slosh_angle", _) => real(0.4),
        ("HubSlosh", "init.slosh_angle_radial", _) => real(0.2),
        ("Spacecraft", "tank.position", [tank, axis]) => {
            real(0.3 * (*tank as f64) - 0.2 * (*axis as f64) * (*tank as f64 - 1.5))
        }
        ("Spacecraft", "tank.modes", [tank]) => integer(*tank),
        ("Spacecraft", "tank.zeta", [tank, mode]) => real(1e-3 * (3 * tank + mode) as f64),
        ("Spacecraft", "tank.p_0", [tank, mode, axis]) => real(match axis {
            3 => -1.0,
            axis => 0.02 * (*tank as f64) - 0.03 * (*mode as f64) + 0.01 * (*axis as f64),
        }),
        ("SloshTank", "tank.zeta", [mode]) => real(2e-3 * *mode as f64),
        ("SloshTank", "tank.p_0", [mode, axis]) => real(match axis {
            3 => -1.0,
            axis => 0.05 - 0.02 * (*mode as f64) + 0.01 * (*axis as f64),
        }),
        _ => None,
    }
}

fn input(model: &Model, inputs: &[String], (name, indices): &Key, time: f64) -> Option<Value> {
    if !inputs.contains(name) {
        return None;
    }
    let n = indices.first().map_or(1.0, |n| *n as f64);
    let size = match (model.name, &**name) {
        ("HubSlosh", "g_axial") => return Some(Value::Real(9.81 + 0.1 * (3.0 * time).sin())),
        ("HubSlosh", _) => 0.05,
        ("SloshTank", "a") if n == 3.0 => return Some(Value::Real(1.5 + 0.1 * time.cos())),
        (_, "force") if n == 3.0 => return Some(Value::Real(2340.0)),
        (_, "force") => 10.0,
        (_, "mass_flow") => 0.0,
        _ => 0.02,
    };
    Some(Value::Real(size * (n * time + 0.3 * n).sin()))
}

fn set_up<'a>(
    case: &Case,
    [arrays, scalars]: [&'a Opened; 2],
    interface: Interface,
) -> [Run<'a>; 2] {
    let mut two = [arrays.instance(interface), scalars.instance(interface)];
    if let Some((name, size)) = case.size {
        two[0].resize(name, size);
        two[1].set(|(key, _)| (key == name).then_some(Value::Integer(size as i64)));
    }
    // Elements beyond the size keep their start values in both FMUs.
    let most = case.size.map_or(1, |(_, size)| size);
    for run in &mut two {
        run.set(|key| {
            let is_beyond = key.0.starts_with("tank.") && key.1.first().is_some_and(|n| *n > most);
            parameter(case.model, key).filter(|_| !is_beyond)
        });
    }
    two
}

fn inputs(opened: &Opened) -> Vec<String> {
    let all = opened.variables.iter().filter(|v| v.causality == "input");
    let mut names: Vec<String> = all.map(|v| key(&v.name).0).collect();
    names.dedup();
    names
}

#[test]
fn an_fmu_with_arrays_steps_bit_identically_to_one_with_scalars() {
    for case in cases() {
        let opened = [Fmi::V3Arrays, Fmi::V3].map(|fmi| Opened::new(case.model, fmi));
        assert_eq!(opened[0].fmu.binary_hash(), opened[1].fmu.binary_hash(), "one library");
        let names = inputs(&opened[0]);
        let mut two = set_up(&case, [&opened[0], &opened[1]], Interface::CoSimulation);
        for run in &mut two {
            run.initialise();
        }
        let h = 0.02;
        for n in 0..30 {
            let time = f64::from(n) * h;
            let all = two.each_mut().map(|run| {
                run.set(|key| input(case.model, &names, key, time));
                run.instance.do_step(time, h).unwrap();
                run.all_values()
            });
            assert_same(&all[0], &all[1], &format!("of {} at {time} s", case.model.name));
        }
    }
}

#[test]
fn fmus_with_arrays_and_with_scalars_have_equal_states_derivatives_and_indicators() {
    for case in cases() {
        let opened = [Fmi::V3Arrays, Fmi::V3].map(|fmi| Opened::new(case.model, fmi));
        let names = inputs(&opened[0]);
        let mut two = set_up(&case, [&opened[0], &opened[1]], Interface::ModelExchange);
        let h = 1e-3;
        for run in &mut two {
            let known = run.opened.variables.iter().filter(|v| v.xml.get("derivative").is_some());
            let expected: usize = known.map(|v| v.keys(&run.sizes).len()).sum();
            assert_eq!(run.instance.number_of_states().unwrap(), expected);
            run.initialise();
            run.instance.update_discrete_states().unwrap();
            run.instance.enter_continuous_time_mode().unwrap();
        }
        let indicators = two.each_mut().map(|run| run.instance.number_of_indicators().unwrap());
        assert_eq!(indicators[0], indicators[1]);
        // Euler's method is enough, because only bits are compared.
        for n in 1..50 {
            let time = f64::from(n) * h;
            let all = two.each_mut().map(|run| {
                let mut x = vec![0.0; run.instance.number_of_states().unwrap()];
                let (mut x_dot, mut z) = (x.clone(), vec![0.0; indicators[0]]);
                run.instance.continuous_states(&mut x).unwrap();
                run.instance.derivatives(&mut x_dot).unwrap();
                for (x, x_dot) in x.iter_mut().zip(&x_dot) {
                    *x += h * x_dot;
                }
                run.instance.set_time(time).unwrap();
                run.set(|key| input(case.model, &names, key, time));
                run.instance.set_continuous_states(&x).unwrap();
                let step = run.instance.completed_integrator_step().unwrap();
                if step.enter_event_mode {
                    run.instance.enter_event_mode().unwrap();
                    run.instance.update_discrete_states().unwrap();
                    run.instance.enter_continuous_time_mode().unwrap();
                }
                run.instance.event_indicators(&mut z).unwrap();
                run.instance.nominals(&mut x).unwrap();
                let z: Vec<u64> = z.iter().map(|z| z.to_bits()).collect();
                (run.all_values(), z, x.len())
            });
            assert_same(&all[0].0, &all[1].0, &format!("of {} at {time} s", case.model.name));
            assert_eq!(all[0].1, all[1].1);
            assert!(all[0].2 <= all[1].2);
        }
    }
}

fn refusal<T>(called: Result<T, CallError>) -> (Status, String) {
    let error = called.err().expect("it is refused");
    let texts: Vec<_> = error.messages.iter().map(|message| &*message.text).collect();
    (error.status, texts.join("\n"))
}

/// A change of the number of tanks of Spacecraft changes the number of states and sets the elements of arrays to their start
/// values.
#[test]
fn array_sizes_are_set_only_in_configuration_mode_and_reset_the_arrays() {
    let craft = Opened::new(pack::model("Spacecraft").unwrap(), Fmi::V3Arrays);
    let tanks = craft.variable("tanks").reference;
    let position = craft.variable("tank.position").reference;
    let mut run = craft.instance(Interface::ModelExchange);
    let states = |tanks: usize| 4 + 3 + 3 + 3 + 3 + 2 * 6 + tanks * (1 + 3 * 6 + 6 + 3);
    assert_eq!(run.instance.number_of_states().unwrap(), states(1));
    let mut size = [0u64];
    run.instance.get_numbers(&[tanks], &mut size).unwrap();
    assert_eq!(size, [1]);
    let start: Vec<f64> = vec![0.0, 0.0, -0.45];
    run.instance.set_numbers(&[position], &[7.0, 8.0, 9.0]).unwrap();
    run.resize("tanks", 4);
    let said: Vec<_> = run.instance.take_messages();
    let said: Vec<_> = said.iter().map(|m| (&*m.category, m.status, &*m.text)).collect();
    let text = "fmi3SetUInt64: tanks changed: the values set earlier for tank.position are lost. Set them again";
    assert_eq!(said, [("logStatusWarning", Status::Warning, text)], "nobody else is named");
    assert_eq!(run.instance.number_of_states().unwrap(), states(4));
    let mut there = vec![0.0; 12];
    run.instance.get_numbers(&[position], &mut there).unwrap();
    assert_eq!(there[..3], start, "what was set before is gone");
    let far: Vec<f64> = (0..12).map(f64::from).collect();
    run.instance.set_numbers(&[position], &far).unwrap();
    // Setting the same size again changes nothing, and values that were beyond a smaller size are not restored.
    run.resize("tanks", 4);
    run.instance.get_numbers(&[position], &mut there).unwrap();
    assert_eq!(there, far);
    run.resize("tanks", 1);
    run.resize("tanks", 2);
    let mut two = vec![0.0; 6];
    run.instance.get_numbers(&[position], &mut two).unwrap();
    assert_eq!(two[..3], start);
    assert_ne!(two[3..], far[3..6]);
    run.initialise();
    let mut x = vec![0.0; states(2)];
    run.instance.continuous_states(&mut x).unwrap();
    run.instance.reset().unwrap();
    run.instance.get_numbers(&[tanks], &mut size).unwrap();
    assert_eq!((size, run.instance.number_of_states().unwrap()), ([1], states(1)), "reset");
}

#[test]
fn wrong_sizes_counts_and_types_of_arrays_are_refused_in_words() {
    let craft = Opened::new(pack::model("Spacecraft").unwrap(), Fmi::V3Arrays);
    let reference = |name: &str| craft.variable(name).reference;
    let (tanks, mass) = (reference("tanks"), reference("tank.mass"));
    let said = |what: &mut dyn FnMut(&mut Instance) -> Result<(), CallError>| {
        let mut run = craft.instance(Interface::CoSimulation);
        refusal(what(&mut run.instance))
    };
    let (status, text) = said(&mut |i| i.set_numbers(&[tanks], &[2u64]));
    assert_eq!(status, Status::Error);
    assert_eq!(
        text,
        "fmi3SetUInt64: not allowed in state \"instantiated\"; allowed in: configuration mode"
    );
    for wrong in [5, u64::MAX] {
        let mut run = craft.instance(Interface::CoSimulation);
        run.instance.enter_configuration_mode().unwrap();
        let (status, text) = refusal(run.instance.set_numbers(&[tanks], &[wrong]));
        assert_eq!(status, Status::Discard);
        assert!(text.contains("tanks = ") && text.contains("(allowed: 0 to 4)"), "{text}");
        // After the refused calls the instance can still be used.
        run.instance.set_numbers(&[tanks], &[3u64]).unwrap();
        let (_, text) = refusal(run.instance.set_numbers(&[mass], &[1.0]));
        assert!(text.contains("configuration mode"), "{text}");
    }
    let (status, text) = said(&mut |i| i.set_numbers(&[mass], &[1.0]));
    assert_eq!(status, Status::Error);
    assert_eq!(text, "fmi3SetFloat64: nValues = 1 (allowed: 3, by rows: tank.mass[1,3])");
    let (_, text) = said(&mut |i| i.get_numbers(&[reference("q"), mass], &mut [0.0; 8]));
    assert_eq!(text, "fmi3GetFloat64: nValues = 8 (allowed: 7, by rows: q[4], tank.mass[1,3])");
    let (_, text) = said(&mut |i| i.set_numbers(&[tanks], &[2i32]));
    assert_eq!(text, format!("fmi3SetInt32: tanks (value reference {tanks}) is of type UInt64"));
    let (_, text) = said(&mut |i| i.get_numbers(&[mass], &mut [0u64; 3]));
    assert_eq!(
        text,
        format!("fmi3GetUInt64: tank.mass (value reference {mass}) is of type Float64")
    );
    let (_, text) = said(&mut |i| i.get_numbers(&[mass], &mut [0u8; 3]));
    assert!(text.ends_with(&format!("tank.mass (value reference {mass}) is of type Float64")));
    let most = craft.variables.len();
    let (_, text) = said(&mut |i| i.get_numbers(&[0], &mut [0.0]));
    assert_eq!(
        text,
        format!("fmi3GetFloat64: no variable has the value reference 0 (allowed: 1 to {most})")
    );
}

/// A state of SloshTank with arrays of three modes is restored in an instance with other array sizes. SloshTank with scalar
/// variables refuses it.
#[test]
fn a_saved_state_contains_array_sizes_and_the_fmu_with_scalars_refuses_it() {
    let opened =
        [Fmi::V3Arrays, Fmi::V3].map(|fmi| Opened::new(pack::model("SloshTank").unwrap(), fmi));
    let mut three = opened[0].instance(Interface::CoSimulation);
    three.resize("tank.modes", 3);
    three.initialise();
    three.instance.do_step(0.0, 0.1).unwrap();
    let there = three.all_values();
    let state = three.instance.get_state().unwrap();
    let bytes = three.instance.serialize(&state).unwrap();
    // The state is restored in an instance with arrays of another size, which then get the size in the state.
    let mut one = opened[0].instance(Interface::CoSimulation);
    let state = one.instance.deserialize(&bytes).unwrap();
    one.instance.set_state(&state).unwrap();
    one.sizes = three.sizes.clone();
    assert_eq!(one.all_values(), there);
    for run in [&mut one, &mut three] {
        run.instance.do_step(0.1, 0.1).unwrap();
    }
    assert_eq!(one.all_values(), three.all_values());
    let mut other = opened[1].instance(Interface::CoSimulation);
    let (status, text) = refusal(other.instance.deserialize(&bytes));
    assert_eq!(status, Status::Error);
    assert!(
        text.contains("one of the two FMUs has array variables, the other has only scalars"),
        "{text}"
    );
}

#[test]
fn derivatives_and_dependencies_of_arrays_equal_those_of_their_elements_by_rows() {
    for case in cases() {
        let opened = [Fmi::V3Arrays, Fmi::V3].map(|fmi| Opened::new(case.model, fmi));
        let mut two = set_up(&case, [&opened[0], &opened[1]], Interface::CoSimulation);
        for run in &mut two {
            run.initialise();
            run.instance.do_step(0.0, 0.05).unwrap();
        }
        let [arrays, scalars] = &mut two;
        let of_scalar: BTreeMap<Key, u32> =
            opened[1].variables.iter().map(|v| (key(&v.name), v.reference)).collect();
        let is_derivative = |v: &&Variable| v.xml.get("derivative").is_some();
        let derivatives: Vec<_> = opened[0].variables.iter().filter(is_derivative).collect();
        let states = derivatives.iter().map(|v| v.xml.get("derivative").unwrap());
        let mut known: Vec<u32> = states.map(|r| r.parse().unwrap()).collect();
        let inputs = opened[0].variables.iter().filter(|v| v.causality == "input");
        known.extend(inputs.map(|v| v.reference));
        let outputs = opened[0].variables.iter().filter(|v| v.causality == "output");
        let unknown: Vec<_> = derivatives.iter().copied().chain(outputs).collect();
        let unknowns: Vec<u32> = unknown.iter().map(|v| v.reference).collect();
        let elements = |references: &[u32], run: &Run| -> Vec<Key> {
            let at = |r: &u32| &opened[0].variables[*r as usize - 1];
            references.iter().flat_map(|r| at(r).keys(&run.sizes)).collect()
        };
        let (columns, rows) = (elements(&known, arrays), elements(&unknowns, arrays));
        let of = |keys: &[Key]| -> Vec<u32> { keys.iter().map(|key| of_scalar[key]).collect() };
        let seed: Vec<f64> = (0..columns.len()).map(|n| (n as f64).sin()).collect();
        let along = arrays.instance.directional_derivative(&unknowns, &known, &seed, rows.len());
        let (of_rows, of_columns) = (of(&rows), of(&columns));
        let expected =
            scalars.instance.directional_derivative(&of_rows, &of_columns, &seed, rows.len());
        assert_eq!(along.unwrap(), expected.unwrap(), "{}", case.model.name);
        let weights: Vec<f64> = (0..rows.len()).map(|n| (n as f64).cos()).collect();
        let along = arrays.instance.adjoint_derivative(&unknowns, &known, &weights, columns.len());
        let expected =
            scalars.instance.adjoint_derivative(&of_rows, &of_columns, &weights, columns.len());
        assert_eq!(along.unwrap(), expected.unwrap(), "{}", case.model.name);
        // Time derivatives of the outputs; the call has one order for each array.
        let outputs: Vec<_> =
            unknown.iter().filter(|v| v.causality == "output").map(|v| v.reference).collect();
        let keys = elements(&outputs, arrays);
        let mut rates = [vec![0.0; keys.len()], vec![0.0; keys.len()]];
        let of_keys = of(&keys);
        let orders = vec![1; keys.len()];
        arrays
            .instance
            .output_derivatives(&outputs, &orders[..outputs.len()], &mut rates[0])
            .unwrap();
        scalars.instance.output_derivatives(&of_keys, &orders, &mut rates[1]).unwrap();
        assert_eq!(rates[0], rates[1]);
        // Dependencies of each element of the unknowns at this point.
        for v in &unknown {
            let found = arrays.instance.dependencies(v.reference).unwrap();
            let own = v.keys(&arrays.sizes);
            let mut mapped: Vec<(Key, Key)> = Vec::new();
            for d in found {
                let known = &opened[0].variables[d.independent as usize - 1];
                let known = known.keys(&arrays.sizes)[d.independent_element - 1].clone();
                mapped.push((own[d.element - 1].clone(), known));
            }
            let name: BTreeMap<u32, Key> =
                of_scalar.iter().map(|(key, reference)| (*reference, key.clone())).collect();
            let mut expected = Vec::new();
            for key in &own {
                for d in scalars.instance.dependencies(of_scalar[key]).unwrap() {
                    expected.push((key.clone(), name[&d.independent].clone()));
                }
            }
            // Elements beyond the size are not variables of this FMU.
            expected.retain(|(_, known)| columns.contains(known));
            assert_eq!(mapped, expected, "{}", v.name);
        }
    }
}

/// Within a communication step, a host changes the torques of Spacecraft linearly by intermediate update, in the FMU with
/// arrays and in the FMU with scalars.
#[test]
fn input_arrays_changed_in_intermediate_update_act_as_scalar_inputs() {
    let model = pack::model("Spacecraft").unwrap();
    let opened = [Fmi::V3Arrays, Fmi::V3].map(|fmi| Opened::new(model, fmi));
    let all = opened.each_ref().map(|opened| {
        let required: Vec<u32> = opened
            .variables
            .iter()
            .filter(|v| ["torque", "omega"].contains(&&*key(&v.name).0))
            .map(|v| v.reference)
            .collect();
        let (omega, torque) = required.split_at(required.len() / 2);
        let with = Instantiation {
            intermediate_update: true,
            required: required.clone(),
            ..opened.fmu.instantiation("one")
        };
        let mut instance = opened.fmu.instantiate_with(&with).unwrap();
        instance.enter_initialization_mode(None, 0.0, None).unwrap();
        instance.exit_initialization_mode().unwrap();
        let mut seen = Vec::new();
        for n in 0..10 {
            let mut within = |update: &host::fmi3::Update| {
                if update.set_requested {
                    let at = f64::from(n) + 1.0;
                    let status = update.set(torque, &[0.1 * at, -0.2 * at, 0.3 * at.sin()]);
                    assert_eq!(status, Status::Ok);
                } else {
                    let mut rates = [0.0; 3];
                    assert_eq!(update.get(omega, &mut rates), Status::Ok);
                    seen.push(rates.map(f64::to_bits));
                }
                None
            };
            instance.do_step_with_updates(f64::from(n) * 0.1, 0.1, Some(&mut within)).unwrap();
        }
        seen
    });
    assert_eq!(all[0].len(), 10);
    assert_eq!(all[0], all[1]);
}

#[test]
fn array_elements_have_the_attributes_of_the_scalar_variables() {
    for model in &MODELS {
        let read = |fmi: Fmi| {
            let archive = Archive::open(packed_version_for_tests(model, fmi)).unwrap();
            Element::parse(archive.description().unwrap().as_bytes()).unwrap()
        };
        let (with_arrays, with_scalars) = (read(Fmi::V3Arrays), read(Fmi::V3));
        let scalars: BTreeMap<Key, Variable> =
            Variable::all(&with_scalars).into_iter().map(|v| (key(&v.name), v)).collect();
        let arrays = Variable::all(&with_arrays);
        let sizes: BTreeMap<u32, usize> = arrays
            .iter()
            .filter(|v| v.kind == "UInt64")
            .map(|v| (v.reference, v.xml.get("start").unwrap().parse().unwrap()))
            .collect();
        assert_eq!(sizes.len(), 1, "{}", model.name);
        for (n, v) in arrays.iter().enumerate() {
            assert_eq!(v.reference as usize, n + 1, "{}: references are places", v.name);
            assert!(!v.name.contains('['), "{}", v.name);
            let starts: Vec<_> = v.xml.get("start").unwrap_or_default().split(' ').collect();
            let keys = v.keys(&sizes);
            assert!([1, keys.len()].contains(&starts.len()), "{}", v.name);
            for (n, key) in keys.iter().enumerate() {
                let scalar = &scalars[key];
                let own = |name: &str| scalar.xml.get(name);
                for attribute in [
                    "unit",
                    "displayUnit",
                    "min",
                    "max",
                    "nominal",
                    "initial",
                    "variability",
                    "declaredType",
                    "reinit",
                    "intermediateUpdate",
                ] {
                    assert_eq!(v.xml.get(attribute), own(attribute), "{} {attribute}", v.name);
                }
                let description = own("description").map(|text| text.replace("[]", ""));
                assert_eq!(v.xml.get("description"), description.as_deref());
                let start = starts.get(n).unwrap_or(&starts[0]);
                assert_eq!(*start, own("start").unwrap_or_default(), "{}", v.name);
                let structural = v.kind == "UInt64";
                assert_eq!(structural, sizes.contains_key(&v.reference));
                if !structural {
                    assert_eq!((&v.kind, &v.causality), (&scalar.kind, &scalar.causality));
                }
                // A state and its derivative have the same shape.
                if let Some(state) = v.xml.get("derivative") {
                    let state = &arrays[state.parse::<usize>().unwrap() - 1];
                    assert_eq!(v.dimensions, state.dimensions, "{}", v.name);
                    let of = own("derivative").unwrap().parse::<u32>().unwrap();
                    assert_eq!(scalars[&state.keys(&sizes)[n]].reference, of, "{}", v.name);
                }
            }
        }
        let token = |root: &Element| root.get("instantiationToken").map(String::from);
        assert_ne!(token(&with_arrays), token(&with_scalars));
    }
}

fn part_of_spacecraft(starts: &[(&str, &str)]) -> (Opened, tempfile::TempDir) {
    let size = |size: &'static names::Size| Limit {
        parameter: size.parameter,
        size: match size.parameter {
            "tanks" => 2,
            "appendages" => 3,
            _ => 1,
        },
        most: size.most,
        has_indicators: size.has_indicators,
        arrays: size.arrays,
    };
    let limits: Vec<_> = names::spacecraft::SIZES.iter().map(size).collect();
    let starts = starts.iter().map(|(name, text)| (name.to_string(), text.to_string())).collect();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("part.fmu");
    let whole = packed_version_for_tests(pack::model("Spacecraft").unwrap(), Fmi::V3);
    pack::part::pack(whole, &limits, &starts, &out).unwrap();
    (Opened::from(&out), folder)
}

const STARTS: [(&str, f64); 8] = [
    ("tanks", 2.0),
    ("tank[2].position[1]", 0.4),
    ("tank[1].p_0[1,2]", 0.1),
    ("craft.mass", 900.25),
    ("appendages", 3.0),
    ("appendage[3].participation[2]", 8.0),
    ("appendage[3].eta_0", 0.5),
    ("solver.max_steps", 5000.0),
];

/// `pack --tanks --modes` removes variables from the description of Spacecraft; the binary stays the same.
#[test]
fn an_fmu_packed_with_fewer_tanks_moves_bit_identically_to_the_full_fmu() {
    let text = STARTS.map(|(name, x)| (name, x.to_string()));
    let (part, _folder) = part_of_spacecraft(&text.each_ref().map(|(n, x)| (*n, &**x)));
    let whole = Opened::new(pack::model("Spacecraft").unwrap(), Fmi::V3);
    assert_eq!(part.fmu.binary_hash(), whole.fmu.binary_hash(), "one library");
    assert!(part.variables.len() < whole.variables.len() / 3);
    for interface in [Interface::CoSimulation, Interface::ModelExchange] {
        let mut two = [part.instance(interface), whole.instance(interface)];
        let setting = |wanted: &Key| STARTS.iter().find(|(name, _)| key(name) == *wanted);
        two[1].set(|key| {
            let (name, x) = setting(key)?;
            let is_whole = ["tanks", "appendages", "solver.max_steps"].contains(name);
            Some(if is_whole { Value::Integer(*x as i64) } else { Value::Real(*x) })
        });
        let names = inputs(&whole);
        for run in &mut two {
            run.initialise();
        }
        let steps = interface == Interface::CoSimulation;
        if !steps {
            for run in &mut two {
                run.instance.update_discrete_states().unwrap();
                run.instance.enter_continuous_time_mode().unwrap();
            }
            // The continuous states are those from attitude to dissipation, and drained; for each tank one mode, liquid, ball and
            // spin; and eta and eta_dot.
            let counts = two.each_mut().map(|run| run.instance.number_of_states().unwrap());
            assert_eq!(counts, [15 + 1 + 2 * (6 + 1 + 6 + 3) + 2 * 3, 140]);
            let counts = two.each_mut().map(|run| run.instance.number_of_indicators().unwrap());
            assert_eq!(counts, [4, 8]);
        }
        let h = if steps { 0.02 } else { 1e-3 };
        for n in 0..100 {
            let time = f64::from(n) * h;
            let all = two.each_mut().map(|run| {
                let model = pack::model("Spacecraft").unwrap();
                run.set(|key| input(model, &names, key, time));
                if steps {
                    run.instance.do_step(time, h).unwrap();
                } else {
                    let mut x = vec![0.0; run.instance.number_of_states().unwrap()];
                    let mut x_dot = x.clone();
                    run.instance.continuous_states(&mut x).unwrap();
                    run.instance.derivatives(&mut x_dot).unwrap();
                    for (x, x_dot) in x.iter_mut().zip(&x_dot) {
                        *x += h * x_dot;
                    }
                    run.instance.nominals(&mut x_dot).unwrap();
                    run.instance.set_time(time + h).unwrap();
                    run.instance.set_continuous_states(&x).unwrap();
                    let mut z = vec![0.0; run.instance.number_of_indicators().unwrap()];
                    run.instance.event_indicators(&mut z).unwrap();
                }
                run.all_values()
            });
            assert_same(&all[0], &all[1], &format!("at {time} s"));
        }
    }
}

/// Spacecraft is packed with variables for two tanks. It refuses `tanks = 3` and a saved state of the full FMU.
#[test]
fn an_fmu_with_fewer_variables_refuses_more_tanks_and_states_of_the_full_fmu() {
    let (part, _folder) = part_of_spacecraft(&[]);
    let mut run = part.instance(Interface::CoSimulation);
    let tanks = part.variable("tanks").reference;
    run.instance.set_values(CType::Int32, tanks, &[Value::Integer(3)]).unwrap();
    run.instance.enter_initialization_mode(None, 0.0, None).unwrap();
    let (_, text) = refusal(run.instance.exit_initialization_mode());
    assert!(text.contains("tanks = 3 (allowed: at most 2"), "{text}");
    let whole = Opened::new(pack::model("Spacecraft").unwrap(), Fmi::V3);
    let mut other = whole.instance(Interface::CoSimulation);
    let state = other.instance.get_state().unwrap();
    let bytes = other.instance.serialize(&state).unwrap();
    let mut run = part.instance(Interface::CoSimulation);
    let (_, text) = refusal(run.instance.deserialize(&bytes));
    assert!(text.contains("an FMU whose model description has other variables"), "{text}");
    let mut run = part.instance(Interface::CoSimulation);
    let own = run.instance.get_state().unwrap();
    let bytes = run.instance.serialize(&own).unwrap();
    let again = run.instance.deserialize(&bytes).unwrap();
    run.instance.set_state(&again).unwrap();
}

/// A packed FMU has its own start values in its description and in the file start_values.txt, with a checksum. If the file is
/// missing or was changed, the FMU refuses instantiation.
#[test]
fn start_values_that_differ_from_the_description_are_refused() {
    let (part, folder) = part_of_spacecraft(&[("craft.mass", "900.0")]);
    let archive = Archive::open(&folder.path().join("part.fmu")).unwrap();
    let resources = folder.path().join("resources");
    archive.unpack(folder.path()).unwrap();
    let file = resources.join("start_values.txt");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "craft.mass = 900.0\n");
    let made = |path: Option<&Path>| {
        let resources = path.map(|path| path.display().to_string());
        let with = Instantiation {
            resources: resources.as_deref(),
            interface: Interface::CoSimulation,
            intermediate_update: false,
            required: Vec::new(),
            ..part.fmu.instantiation("one")
        };
        refusal(part.fmu.instantiate_with(&with)).1
    };
    assert!(made(None).contains("names no folder of resources"));
    std::fs::write(&file, "craft.mass = 901.0\n").unwrap();
    assert!(made(Some(&resources)).contains("its checksum differs"));
    std::fs::remove_file(&file).unwrap();
    assert!(made(Some(&resources)).contains("start_values.txt"));
}

//! Wraps Spacecraft.fmu and SloshTank.fmu in the interface of the crate `craft`.
//!
//! Only calls of the C interface are used: parameters and inputs are set by name, slopes as input derivatives; then
//! follow fmi2DoStep, fmi2GetReal for each requested output, and fmi2GetDirectionalDerivative. When states are set for
//! the first time, the instance is replaced by one for Model Exchange.

use std::collections::HashMap;
use std::fs::File;
use std::sync::LazyLock;

use craft::{
    Appendage, Craft, INPUTS, Inputs, LimitedBy, MODES, Outputs, POINTS, Parameters, Ramp, Ranges,
    STATES, SloshTankOutputs, TANK_INPUTS, TANK_STATES, TANKS, TRIANGLE, Tank, TankInputs,
    TankOutputs, TankParameters,
};
use host::fmi2::{CO_SIMULATION, CallError, Fmu, FmuState, Instance, MODEL_EXCHANGE, Status};
use pack::models::model;
use pack::packed_model_for_tests;
use runtime::table::Table;

pub fn load(name: &str) -> Fmu {
    let packed = packed_model_for_tests(model(name).unwrap());
    let directory = tempfile::tempdir().unwrap();
    zip::ZipArchive::new(File::open(packed).unwrap()).unwrap().extract(directory.path()).unwrap();
    Fmu::load(directory.path(), packed).unwrap()
}

/// A loaded FMU with the value references of its variables. Searching the description for each of the hundreds of parameters
/// would take most of the time of an instantiation.
struct Loaded {
    fmu: Fmu,
    references: HashMap<String, u32>,
}

impl Loaded {
    fn new(name: &str) -> Loaded {
        let fmu = load(name);
        let variables = fmu.description().variables.iter();
        let references = variables.map(|v| (v.name.clone(), v.reference)).collect();
        Loaded { fmu, references }
    }

    fn reference(&self, name: &str) -> u32 {
        self.references[name]
    }
}

static SPACECRAFT: LazyLock<Loaded> = LazyLock::new(|| Loaded::new("Spacecraft"));
static SLOSH_TANK: LazyLock<Loaded> = LazyLock::new(|| Loaded::new("SloshTank"));

pub fn elements(name: &str, n: usize) -> impl Iterator<Item = String> {
    (1..=n).map(move |i| format!("{name}[{i}]"))
}

fn rows(name: &str, (n, m): (usize, usize)) -> impl Iterator<Item = String> {
    (1..=n).flat_map(move |i| (1..=m).map(move |j| format!("{name}[{i},{j}]")))
}

#[derive(Clone, Default)]
struct Settings {
    reals: Vec<(String, f64)>,
    integers: Vec<(String, i32)>,
}

impl Settings {
    fn real(&mut self, name: impl Into<String>, value: f64) {
        self.reals.push((name.into(), value));
    }

    fn reals(&mut self, names: impl Iterator<Item = String>, values: &[f64]) {
        self.reals.extend(names.zip(values.iter().copied()));
    }

    fn integer(&mut self, name: impl Into<String>, value: i32) {
        self.integers.push((name.into(), value));
    }

    fn craft(&mut self, name: &str, craft: &Craft) {
        let j = &craft.j;
        self.real(format!("{name}.mass"), craft.mass);
        self.reals(elements(&format!("{name}.r"), 3), &craft.r);
        let moments = [("xx", j.xx), ("yy", j.yy), ("zz", j.zz)];
        let products = [("xy", j.xy), ("xz", j.xz), ("yz", j.yz)];
        for (axes, value) in moments.into_iter().chain(products) {
            self.real(format!("{name}.J{axes}"), value);
        }
    }

    fn appendage(&mut self, name: &str, mode: &Appendage) {
        let of = |what: &str| format!("{name}.{what}");
        self.reals(elements(&of("position"), 3), &mode.position);
        self.reals(elements(&of("participation"), 6), &mode.participation);
        for (what, value) in [
            ("frequency", mode.frequency),
            ("zeta", mode.zeta),
            ("eta_0", mode.eta),
            ("eta_dot_0", mode.eta_dot),
        ] {
            self.real(of(what), value);
        }
    }

    fn tank(&mut self, name: &str, tank: &Tank) {
        let of = |what: &str| format!("{name}.{what}");
        self.reals(elements(&of("position"), 3), &tank.position);
        self.reals(elements(&of("q"), 4), &tank.q);
        for (what, value) in [
            ("m_0", tank.m_0),
            ("H_0", tank.h_0),
            ("I_0", tank.i_0),
            ("I_z", tank.i_z),
            ("g_ref", tank.g_ref),
            ("diameter", tank.diameter),
            ("depth", tank.depth),
            ("density", tank.density),
            ("g_floor", tank.g_floor),
            ("g_bond", tank.g_bond),
        ] {
            self.real(of(what), value);
        }
        self.integer(of("modes"), tank.modes as i32);
        self.integer(of("damping_law_kind"), tank.damping_law as i32);
        if tank.fill.points > 0 {
            self.fill(name, tank);
        }
        for (what, value) in [
            ("dI_y", tank.di_y),
            ("I_xy", tank.products[0]),
            ("I_xz", tank.products[1]),
            ("I_yz", tank.products[2]),
        ] {
            if value != 0.0 {
                self.real(of(what), value);
            }
        }
        if tank.r_0 != [0.0; 2] {
            self.reals(elements(&of("r_0"), 2), &tank.r_0);
        }
        if tank.direction != [[0.0; 2]; MODES] {
            self.reals(rows(&of("direction"), (MODES, 2)), tank.direction.as_flattened());
            self.reals(elements(&of("arm"), MODES), &tank.arm);
        }
        if tank.spin_inertia > 0.0 {
            for (what, value) in [
                ("spin_inertia", tank.spin_inertia),
                ("spin_inertia_across", tank.spin_inertia_across),
                ("spin_coupling", tank.spin_coupling),
            ] {
                self.real(of(what), value);
            }
            self.reals(elements(&of("spin_decay"), 2), &tank.spin_decay);
            self.reals(elements(&of("slip_0"), 3), &tank.slip_0);
            self.reals(elements(&of("gyroscopic"), MODES), &tank.gyroscopic);
            self.reals(elements(&of("gyroscopic_stiffness"), MODES), &tank.gyroscopic_stiffness);
        }
        if tank.ball.travel > 0.0 {
            for (what, value) in [
                ("travel", tank.ball.travel),
                ("radius", tank.ball.radius),
                ("restitution", tank.ball.restitution),
                ("contact_speed", tank.ball.contact_speed),
                ("drag", tank.ball.drag),
            ] {
                self.real(of(&format!("ball.{what}")), value);
            }
        }
        for (what, values) in [
            ("mass", &tank.mass),
            ("length", &tank.length),
            ("frequency", &tank.frequency),
            ("hinge", &tank.hinge),
            ("k", &tank.k),
            ("zeta", &tank.zeta),
            ("zeta_amplitude", &tank.zeta_amplitude),
            ("zeta_breaking", &tank.zeta_breaking),
            ("breaking_steepness", &tank.breaking_steepness),
            ("nonlinear_inertia", &tank.nonlinear_inertia),
            ("nonlinear_stiffness", &tank.nonlinear_stiffness),
            ("nonlinear_inertia_2", &tank.nonlinear_inertia_2),
            ("nonlinear_stiffness_2", &tank.nonlinear_stiffness_2),
            ("rotary_inertia", &tank.rotary_inertia),
            ("rotary_inertia_2", &tank.rotary_inertia_2),
            ("wave", &tank.wave),
            ("angle_limit", &tank.angle_limit),
            ("swirl_limit", &tank.swirl_limit),
        ] {
            self.reals(elements(&of(what), MODES), values);
        }
        self.reals(rows(&of("p_0"), (MODES, 3)), tank.p_0.as_flattened());
        self.reals(rows(&of("p_dot_0"), (MODES, 3)), tank.p_dot_0.as_flattened());
    }
}

impl Settings {
    fn fill(&mut self, name: &str, tank: &Tank) {
        let of = |what: &str| format!("{name}.fill.{what}");
        let table = &tank.fill;
        self.integer(of("points"), table.points as i32);
        self.real(format!("{name}.liquid_0"), tank.liquid_0);
        self.real(format!("{name}.outlet"), tank.outlet);
        for (what, values) in [
            ("liquid", &table.liquid),
            ("H_0", &table.h_0),
            ("I_0", &table.i_0),
            ("I_z", &table.i_z),
        ] {
            self.reals(elements(&of(what), POINTS), values);
        }
        for (what, values) in [
            ("mass", &table.mass),
            ("length", &table.length),
            ("hinge", &table.hinge),
            ("zeta", &table.zeta),
        ] {
            self.reals(rows(&of(what), (MODES, POINTS)), values.as_flattened());
        }
    }
}

struct Bound {
    loaded: &'static Loaded,
    instance: Instance<'static>,
    settings: Settings,
    tolerance: f64,
    start: f64,
    time: f64,
    kind: i32,
    inputs: Vec<u32>,
    outputs: Vec<u32>,
    /// Value references of states and derivatives in the order of the crate `craft`.
    states: Vec<u32>,
    derivatives: Vec<u32>,
    places: Vec<usize>,
}

impl Bound {
    fn new<M: runtime::Model>(
        (loaded, table): (&'static Loaded, &'static Table<M>),
        settings: Settings,
        names: [Vec<String>; 2],
        inputs: &[f64],
        (start, tolerance): (f64, f64),
    ) -> Result<Bound, CallError> {
        let reference = |name: &String| loaded.reference(name);
        let [inputs_named, outputs] = names.map(|names| names.iter().map(reference).collect());
        let places: Vec<usize> = table.places().collect();
        let (mut states, mut derivatives) = (vec![0; places.len()], vec![0; places.len()]);
        for (place, derivative) in places.iter().zip(table.derivatives()) {
            states[*place] = reference(&table.state_at(*place).unwrap().name());
            derivatives[*place] = reference(&derivative.name());
        }
        let mut bound = Bound {
            loaded,
            instance: loaded.fmu.instantiate("six")?,
            settings,
            tolerance,
            start,
            time: start,
            kind: CO_SIMULATION,
            inputs: inputs_named,
            outputs,
            states,
            derivatives,
            places,
        };
        bound.set_up(inputs)?;
        Ok(bound)
    }

    fn set_up(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        let Bound { loaded, instance, settings, .. } = self;
        for (name, value) in &settings.reals {
            instance.set_real(&[loaded.reference(name)], &[*value])?;
        }
        for (name, value) in &settings.integers {
            instance.set_integer(&[loaded.reference(name)], &[*value])?;
        }
        instance.set_real(&self.inputs, inputs)?;
        instance.setup_experiment(Some(self.tolerance), self.start, None)?;
        instance.enter_initialization_mode()?;
        instance.exit_initialization_mode()
    }

    fn set(&mut self, values: &[f64], slopes: &[f64]) -> Result<(), CallError> {
        self.instance.set_real(&self.inputs, values)?;
        if self.kind == CO_SIMULATION {
            let orders = vec![1; slopes.len()];
            self.instance.set_real_input_derivatives(&self.inputs, &orders, slopes)?;
        }
        Ok(())
    }

    fn step(&mut self, values: &[f64], slopes: &[f64], h: f64) -> Result<(), CallError> {
        self.set(values, slopes)?;
        self.instance.do_step(self.time, h)?;
        self.time += h;
        Ok(())
    }

    fn outputs(&mut self) -> Vec<f64> {
        let mut values = vec![0.0; self.outputs.len()];
        self.instance.get_real(&self.outputs, &mut values).unwrap();
        values
    }

    fn states(&mut self) -> Vec<f64> {
        let mut values = vec![0.0; self.states.len()];
        self.instance.get_real(&self.states, &mut values).unwrap();
        values
    }

    fn set_states(&mut self, x: &[f64]) {
        if self.kind == CO_SIMULATION {
            let mut inputs = vec![0.0; self.inputs.len()];
            self.instance.get_real(&self.inputs, &mut inputs).unwrap();
            let mut with = self.instance.fmu().instantiation("six");
            with.kind = MODEL_EXCHANGE;
            self.instance = self.instance.fmu().instantiate_with(&with).unwrap();
            self.kind = MODEL_EXCHANGE;
            self.set_up(&inputs).unwrap();
            self.instance.new_discrete_states().unwrap();
            self.instance.enter_continuous_time_mode().unwrap();
        }
        let ordered: Vec<f64> = self.places.iter().map(|place| x[*place]).collect();
        self.instance.set_continuous_states(&ordered).unwrap();
    }

    fn derivatives(&mut self) -> Vec<f64> {
        let mut values = vec![0.0; self.derivatives.len()];
        self.instance.get_real(&self.derivatives, &mut values).unwrap();
        values
    }

    fn directional(&mut self, dx: &[f64], du: &[f64]) -> Vec<f64> {
        let knowns = [&self.states[..], &self.inputs[..]].concat();
        let change = [dx, du].concat();
        self.instance.get_directional_derivative(&self.derivatives, &knowns, &change).unwrap()
    }
}

struct Numbers<'a>(std::slice::Iter<'a, f64>);

impl Numbers<'_> {
    fn one(&mut self) -> f64 {
        *self.0.next().unwrap()
    }

    fn array<const N: usize>(&mut self) -> [f64; N] {
        [(); N].map(|()| self.one())
    }

    fn matrix<const N: usize>(&mut self) -> [[f64; 3]; N] {
        [(); N].map(|()| self.array())
    }
}

fn tank_outputs(name: &str) -> Vec<String> {
    let of = |what: &str| format!("{name}{what}");
    rows(&of("p"), (MODES, 3))
        .chain(rows(&of("p_dot"), (MODES, 3)))
        .chain(elements(&of("angle_x"), MODES))
        .chain(elements(&of("angle_y"), MODES))
        .chain(["wave_height", "spin_ratio", "spin_number"].map(of))
        .collect()
}

fn read_tank(force: [f64; 3], torque: [f64; 3], next: &mut Numbers) -> TankOutputs {
    TankOutputs {
        force,
        torque,
        p: next.matrix(),
        p_dot: next.matrix(),
        angle_x: next.array(),
        angle_y: next.array(),
        wave_height: next.one(),
        spin_ratio: next.one(),
        spin_number: next.one(),
        // The following outputs are not read, because tests compare only forces and motion.
        axial: 0.0,
        turning: 0.0,
        ranges: craft::Ranges::default(),
        ball_state: craft::BallState::Settled,
        ball_position: [0.0; 3],
        ball_velocity: [0.0; 3],
    }
}

/// Returns the values of three vectors as nine numbers, and their slopes in the same way.
fn flat(ramps: [&Ramp; 3]) -> [[f64; 9]; 2] {
    [|ramp: &Ramp| ramp.value, |ramp: &Ramp| ramp.slope].map(|part| {
        let vectors = ramps.map(part);
        std::array::from_fn(|i| vectors[i / 3][i % 3])
    })
}

pub struct Spacecraft(Bound);

impl Spacecraft {
    pub fn new(
        p: &Parameters,
        inputs: &Inputs,
        start: f64,
        tolerance: f64,
    ) -> Result<Spacecraft, CallError> {
        let mut settings = Settings::default();
        settings.craft("craft", &p.craft);
        settings.integer("mount", p.mount as i32);
        settings.reals(elements("gravity", 3), &p.gravity);
        settings.reals(elements("pivot.k", 2), &p.pivot.k);
        settings.reals(elements("pivot.c", 3), &p.pivot.c);
        settings.reals(elements("pivot.friction.c", 3), &p.pivot.friction.c);
        settings.reals(elements("pivot.friction.d", 3), &p.pivot.friction.d);
        settings.real("pivot.friction.omega_s", p.pivot.friction.omega_s);
        settings.real("pivot.friction.eps", p.pivot.friction.eps);
        settings.integer("tanks", p.tanks as i32);
        settings.integer("appendages", p.appendages as i32);
        for (j, mode) in p.appendage[..p.appendages].iter().enumerate() {
            settings.appendage(&format!("appendage[{}]", j + 1), mode);
        }
        settings.integer("solver.max_steps", p.max_steps as i32);
        for (i, tank) in p.tank.iter().enumerate() {
            settings.tank(&format!("tank[{}]", i + 1), tank);
        }
        settings.reals(elements("init.q", 4), &p.init.q);
        settings.reals(elements("init.omega", 3), &p.init.omega);
        settings.reals(elements("init.position", 3), &p.init.position);
        settings.reals(elements("init.velocity", 3), &p.init.velocity);
        let vectors = |names: &[&str]| -> Vec<String> {
            names.iter().flat_map(|name| elements(name, 3)).collect()
        };
        let mut outputs: Vec<String> = elements("q", 4).collect();
        outputs.extend(vectors(&[
            "omega",
            "omega_dot",
            "specific_force",
            "position",
            "velocity",
            "slosh_force",
            "slosh_torque",
            "pivot.torque",
            "momentum",
            "angular_momentum",
            "center_of_mass",
        ]));
        outputs.extend(["energy", "work", "dissipated", "drained", "mass"].map(String::from));
        outputs.extend(rows("inertia", (3, 3)));
        for name in elements("tank", TANKS) {
            outputs.extend(vectors(&[&format!("{name}.force"), &format!("{name}.torque")]));
            outputs.extend(tank_outputs(&format!("{name}.")));
        }
        let mut inputs_named = vectors(&["force", "torque", "h_wheels"]);
        inputs_named.extend(elements("mass_flow", TANKS));
        let names = [inputs_named, outputs];
        let fmu = (&*SPACECRAFT, &::Spacecraft::table::TABLE);
        let [values, _] = Spacecraft::flat(inputs);
        Bound::new(fmu, settings, names, &values, (start, tolerance)).map(Spacecraft)
    }

    fn flat(inputs: &Inputs) -> [[f64; INPUTS]; 2] {
        let [values, slopes] = flat([&inputs.force, &inputs.torque, &inputs.h_wheels]);
        let flow = &inputs.mass_flow;
        [
            std::array::from_fn(|i| if i < 9 { values[i] } else { flow[i - 9].value }),
            std::array::from_fn(|i| if i < 9 { slopes[i] } else { flow[i - 9].slope }),
        ]
    }

    pub fn step(&mut self, inputs: &Inputs, h: f64) -> Result<(), CallError> {
        let [values, slopes] = Spacecraft::flat(inputs);
        self.0.step(&values, &slopes, h)
    }

    pub fn outputs(&mut self, inputs: &Inputs) -> Outputs {
        let [values, slopes] = Spacecraft::flat(inputs);
        self.0.set(&values, &slopes).unwrap();
        self.outputs_after_step()
    }

    pub fn all(&mut self) -> Vec<f64> {
        self.0.outputs()
    }

    pub fn outputs_after_step(&mut self) -> Outputs {
        let numbers = self.0.outputs();
        let next = &mut Numbers(numbers.iter());
        let q = next.array();
        let [omega, omega_dot, specific_force, position, velocity] = next.matrix();
        let [slosh_force, slosh_torque, pivot_torque] = next.matrix();
        let [momentum, angular_momentum, center_of_mass] = next.matrix();
        Outputs {
            q,
            omega,
            omega_dot,
            specific_force,
            position,
            velocity,
            slosh_force,
            slosh_torque,
            pivot_torque,
            momentum,
            angular_momentum,
            center_of_mass,
            energy: next.one(),
            work: next.one(),
            dissipated: next.one(),
            drained: next.one(),
            mass: next.one(),
            inertia: next.matrix(),
            tank: [(); TANKS].map(|()| {
                let (force, torque) = (next.array(), next.array());
                read_tank(force, torque, next)
            }),
        }
    }

    pub fn continuous_states(&mut self) -> [f64; STATES] {
        self.0.states().try_into().unwrap()
    }

    pub fn set_continuous_states(&mut self, x: &[f64; STATES]) {
        self.0.set_states(x);
    }

    pub fn derivatives(&mut self, inputs: &Inputs) -> [f64; STATES] {
        let [values, slopes] = Spacecraft::flat(inputs);
        self.0.set(&values, &slopes).unwrap();
        self.0.derivatives().try_into().unwrap()
    }

    pub fn directional_derivative(
        &mut self,
        inputs: &Inputs,
        dx: &[f64; STATES],
        du: &[f64; INPUTS],
    ) -> [f64; STATES] {
        let [values, slopes] = Spacecraft::flat(inputs);
        self.0.set(&values, &slopes).unwrap();
        self.0.directional(dx, du).try_into().unwrap()
    }
}

pub struct SloshTank(Bound);

impl SloshTank {
    pub fn new(
        p: &TankParameters,
        inputs: &TankInputs,
        start: f64,
        tolerance: f64,
    ) -> Result<SloshTank, CallError> {
        let mut settings = Settings::default();
        settings.tank("tank", &p.tank);
        settings.integer("coupling", p.coupling as i32);
        settings.integer("solver.max_steps", p.max_steps as i32);
        if let Some(host) = &p.host {
            settings.craft("host", host);
        }
        let mut inputs_named: Vec<String> =
            ["a", "omega", "omega_dot"].iter().flat_map(|name| elements(name, 3)).collect();
        inputs_named.push("mass_flow".into());
        let mut outputs: Vec<String> = elements("force", 3).chain(elements("torque", 3)).collect();
        outputs.extend(elements("bias", 6).chain(elements("added_mass", TRIANGLE)));
        outputs.extend(elements("impulse", 6));
        outputs.extend(["dissipated", "tank.liquid", "mass"].map(String::from));
        outputs.extend(elements("center_of_mass", 3).chain(rows("inertia", (3, 3))));
        outputs.extend(tank_outputs("tank."));
        let names = [inputs_named, outputs];
        let fmu = (&*SLOSH_TANK, &::SloshTank::table::TABLE);
        let [values, _] = SloshTank::flat(inputs);
        Bound::new(fmu, settings, names, &values, (start, tolerance)).map(SloshTank)
    }

    fn flat(inputs: &TankInputs) -> [[f64; TANK_INPUTS]; 2] {
        let [values, slopes] = flat([&inputs.a, &Ramp::held(inputs.omega), &inputs.omega_dot]);
        let flow = &inputs.mass_flow;
        [(values, flow.value), (slopes, flow.slope)]
            .map(|(nine, flow)| std::array::from_fn(|i| if i < 9 { nine[i] } else { flow }))
    }

    pub fn step(&mut self, inputs: &TankInputs, h: f64) -> Result<(), CallError> {
        let [values, slopes] = SloshTank::flat(inputs);
        self.0.step(&values, &slopes, h)
    }

    pub fn outputs(&mut self, inputs: &TankInputs) -> SloshTankOutputs {
        let [values, slopes] = SloshTank::flat(inputs);
        self.0.set(&values, &slopes).unwrap();
        self.outputs_after_step()
    }

    pub fn all(&mut self) -> Vec<f64> {
        self.0.outputs()
    }

    pub fn outputs_after_step(&mut self) -> SloshTankOutputs {
        let numbers = self.0.outputs();
        let next = &mut Numbers(numbers.iter());
        let (force, torque) = (next.array(), next.array());
        SloshTankOutputs {
            bias: next.array(),
            added_mass: next.array(),
            impulse: next.array(),
            dissipated: next.one(),
            liquid: next.one(),
            mass: next.one(),
            center_of_mass: next.array(),
            inertia: next.matrix(),
            tank: read_tank(force, torque, next),
        }
    }

    pub fn ranges(&mut self, inputs: &TankInputs) -> Ranges {
        let [values, slopes] = SloshTank::flat(inputs);
        self.0.set(&values, &slopes).unwrap();
        self.ranges_held()
    }

    pub fn ranges_held(&mut self) -> Ranges {
        let Bound { loaded, instance, .. } = &mut self.0;
        let [kind, in_range] =
            ["tank.limited_by_kind", "tank.in_range"].map(|name| loaded.reference(name));
        let (mut reason, mut is_in_range) = ([0], [0]);
        instance.get_integer(&[kind], &mut reason).unwrap();
        instance.get_boolean(&[in_range], &mut is_in_range).unwrap();
        let limited_by = LimitedBy::from_number(u8::try_from(reason[0]).unwrap()).unwrap();
        assert_eq!(is_in_range[0] != 0, limited_by == LimitedBy::None);
        Ranges { limited_by, ..Ranges::default() }
    }

    pub fn warning(&mut self) -> Option<String> {
        let mut messages = self.0.instance.take_messages();
        assert!(messages.len() < 2, "{messages:?}");
        let message = messages.pop()?;
        assert_eq!((message.status, &*message.category), (Status::Warning, "logStatusWarning"));
        Some(message.text)
    }

    pub fn save(&mut self) -> (FmuState, f64) {
        (self.0.instance.get_state().unwrap(), self.0.time)
    }

    pub fn restore(&mut self, (state, time): (FmuState, f64)) {
        self.0.instance.set_state(&state).unwrap();
        self.0.instance.free_state(state).unwrap();
        self.0.time = time;
    }

    pub fn coupling_ratio(&mut self) -> Option<f64> {
        let ratio = self.0.instance.real("coupling_ratio").unwrap();
        (ratio > 0.0).then_some(ratio)
    }

    pub fn continuous_states(&mut self) -> [f64; TANK_STATES] {
        self.0.states().try_into().unwrap()
    }

    pub fn set_continuous_states(&mut self, x: &[f64; TANK_STATES]) {
        self.0.set_states(x);
    }

    pub fn derivatives(&mut self, inputs: &TankInputs) -> [f64; TANK_STATES] {
        let [values, slopes] = SloshTank::flat(inputs);
        self.0.set(&values, &slopes).unwrap();
        self.0.derivatives().try_into().unwrap()
    }
}

//! Model Exchange: a host that integrates the equations of the packed FMU gets the motion and the events of Co-Simulation.

use std::collections::BTreeMap;

use host::causality::Causality;
use host::description::{Type, Value};
use host::fmi2::{EventInfo, Fmu, Instance, MODEL_EXCHANGE, Status};
use pack::packed_for_tests;

fn open() -> Fmu {
    Fmu::open(packed_for_tests()).unwrap()
}

const STATES: usize = plant::STATES;
const INDICATORS: usize = plant::INDICATORS;

type Changes<'a> = &'a [(f64, &'a str, &'a str)];

fn set_up<'fmu>(fmu: &'fmu Fmu, kind: i32, settings: &[(&str, &str)]) -> Instance<'fmu> {
    let mut with = fmu.instantiation("one");
    with.kind = kind;
    let mut instance = fmu.instantiate_with(&with).unwrap();
    for (name, value) in settings {
        instance.set(name, value).unwrap();
    }
    instance.setup_experiment(Some(1e-12), 0.0, None).unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    instance
}

/// A host with a fixed step: Runge–Kutta of order 4, and bisection for events.
struct Host<'fmu> {
    instance: Instance<'fmu>,
    time: f64,
    x: [f64; STATES],
    events: [usize; 3],
    next: EventInfo,
}

impl<'fmu> Host<'fmu> {
    fn new(fmu: &'fmu Fmu, settings: &[(&str, &str)]) -> Self {
        let instance = set_up(fmu, MODEL_EXCHANGE, settings);
        let mut host = Host {
            instance,
            time: 0.0,
            x: [0.0; STATES],
            events: [0; 3],
            next: EventInfo::default(),
        };
        host.event_iteration();
        host
    }

    fn event_iteration(&mut self) {
        loop {
            self.next = self.instance.new_discrete_states().unwrap();
            assert_eq!(self.next.terminate_simulation, 0);
            if self.next.new_discrete_states_needed == 0 {
                break;
            }
        }
        self.instance.enter_continuous_time_mode().unwrap();
        self.instance.continuous_states(&mut self.x).unwrap();
    }

    fn rates(&mut self, time: f64, x: &[f64; STATES]) -> [f64; STATES] {
        let mut rates = [0.0; STATES];
        self.instance.set_time(time).unwrap();
        self.instance.set_continuous_states(x).unwrap();
        self.instance.derivatives(&mut rates).unwrap();
        rates
    }

    fn indicators(&mut self, time: f64, x: &[f64; STATES]) -> [f64; INDICATORS] {
        let mut indicators = [0.0; INDICATORS];
        self.instance.set_time(time).unwrap();
        self.instance.set_continuous_states(x).unwrap();
        self.instance.event_indicators(&mut indicators).unwrap();
        indicators
    }

    fn step(&mut self, h: f64) -> [f64; STATES] {
        let (t, x) = (self.time, self.x);
        let moved = |rate: &[f64; STATES], h: f64| std::array::from_fn(|i| x[i] + h * rate[i]);
        let k1 = self.rates(t, &x);
        let k2 = self.rates(t + h / 2.0, &moved(&k1, h / 2.0));
        let k3 = self.rates(t + h / 2.0, &moved(&k2, h / 2.0));
        let k4 = self.rates(t + h, &moved(&k3, h));
        std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
    }

    fn run(&mut self, end: f64, h: f64) {
        while self.time < end - 1e-12 {
            let due = match self.next.next_event_time_defined {
                0 => f64::INFINITY,
                _ => self.next.next_event_time,
            };
            let is_due = due <= (self.time + h).min(end);
            let goal = if is_due { due } else { (self.time + h).min(end) };
            let before = self.indicators(self.time, &self.x.clone());
            // An indicator that starts at zero belongs to an event that was just handled, so that it does not count.
            let crosses =
                |z: &[f64; INDICATORS]| before.iter().zip(z).any(|(before, z)| before * z < 0.0);
            let mut length = goal - self.time;
            let mut x = self.step(length);
            let crossed = crosses(&self.indicators(goal, &x));
            if crossed {
                let (mut low, mut high) = (0.0, length);
                for _ in 0..60 {
                    let middle = (low + high) / 2.0;
                    let there = self.step(middle);
                    let z = self.indicators(self.time + middle, &there);
                    if crosses(&z) { high = middle } else { low = middle }
                }
                length = high;
                x = self.step(length);
            }
            self.time = if crossed { self.time + length } else { goal };
            self.x = x;
            self.instance.set_time(self.time).unwrap();
            self.instance.set_continuous_states(&x).unwrap();
            let step = self.instance.completed_integrator_step().unwrap();
            assert!(!step.terminate);
            if crossed || is_due || step.enter_event_mode {
                let kind = if crossed {
                    0
                } else if is_due {
                    1
                } else {
                    2
                };
                self.events[kind] += 1;
                self.instance.enter_event_mode().unwrap();
                self.event_iteration();
            }
        }
    }
}

fn values(instance: &mut Instance) -> BTreeMap<String, f64> {
    let variables = &instance.fmu().description().variables;
    let outputs =
        variables.iter().filter(|v| v.causality == Causality::Output).map(|v| v.name.as_str());
    let locals = ["energy", "momentum", "work", "heat", "stuck_time", "wheel_speed"];
    let names: Vec<&str> = outputs.chain(locals).collect();
    names.into_iter().map(|name| (name.to_string(), instance.real(name).unwrap())).collect()
}

/// Simulates HubSlosh with `settings` in this host (to the time `end`, with the step `h`, both in s) and in Co-Simulation,
/// sets the inputs in `changes` at their times, and compares all values once a second; they may differ by `allowed`. Returns
/// how many events of each kind the host has handled, and how often the contact has changed.
fn compare(
    settings: &[(&str, &str)],
    changes: Changes,
    (end, h, allowed): (f64, f64, f64),
) -> ([usize; 3], i32) {
    let fmu = open();
    let mut own = set_up(&fmu, host::fmi2::CO_SIMULATION, settings);
    let mut host = Host::new(&fmu, settings);
    let mut stops: Vec<f64> = (1..=end as usize).map(|n| n as f64).collect();
    stops.extend(changes.iter().map(|change| change.0));
    stops.sort_unstable_by(f64::total_cmp);
    let mut time = 0.0;
    for stop in stops {
        if stop > time {
            own.do_step(time, stop - time).unwrap();
            host.run(stop, h);
            time = stop;
        }
        for (_, name, value) in changes.iter().filter(|change| change.0 == time) {
            own.set(name, value).unwrap();
            host.instance.enter_event_mode().unwrap();
            host.instance.set(name, value).unwrap();
            host.event_iteration();
        }
        let (own, exchanged) = (values(&mut own), values(&mut host.instance));
        for (name, expected) in own {
            let got = exchanged[&name];
            assert!(
                (got - expected).abs() <= allowed * expected.abs().max(1.0),
                "{name} at {time} s: {got} {expected} {settings:?}"
            );
        }
    }
    let count = own.get("event_count").unwrap();
    assert_eq!(host.instance.get("event_count").unwrap(), count);
    for name in ["stuck", "friction_mode"] {
        assert_eq!(host.instance.get(name).unwrap(), own.get(name).unwrap(), "{name}");
    }
    let Value::Integer(count) = count else { panic!() };
    (host.events, count as i32)
}

/// The Runge–Kutta method of order 4 with steps of 0.5 ms has, at 15 rad/s, a phase lag of omega (omega h)^4/120 = 4e-10 rad
/// per second, that is 1e-8 after 20 s. Forces are some newtons, slosh rates some rad/s.
#[test]
fn a_model_exchange_host_equals_co_simulation_with_stick_and_slip() {
    for model in ["frozen", "linear", "planar", "spherical", "liquid"] {
        let settings = [
            ("slosh.model", model),
            ("init.omega", "0.08"),
            ("init.slosh_angle", "0.3"),
            ("init.slosh_angle_radial", "0.1"),
            ("friction.asymmetry", "0.1"),
            ("friction.forward_cos1", "0.2"),
        ];
        let changes = [(7.0, "tau_cmd", "0.03"), (8.5, "tau_cmd", "-0.02"), (12.0, "tau_cmd", "0")];
        let (events, count) = compare(&settings, &changes, (20.0, 5e-4, 1e-7));
        assert!(count >= 3, "{model}: {count} changes of contact, {events:?}");
    }
}

#[test]
fn a_model_exchange_host_equals_co_simulation_with_every_friction_law() {
    for friction in ["none", "viscous", "stribeck_smooth"] {
        let settings = [
            ("slosh.model", "spherical"),
            ("slosh.modes", "2"),
            ("friction.model", friction),
            ("friction.eps", "0.01"),
            ("init.slosh_angle", "0.2"),
            ("init.slosh_rate_radial", "1"),
            ("tau_cmd", "0.01"),
        ];
        compare(&settings, &[], (10.0, 2.5e-4, 1e-7));
    }
}

/// The wheel saturates in torque and in speed, and the samples of the gyro are time events. The noise must be bit-identical,
/// and the rate must agree to 1e-7.
#[test]
fn limits_of_the_wheel_and_samples_of_the_gyro_are_events_of_model_exchange() {
    let settings = [
        ("wheel.enabled", "true"),
        ("wheel.tau_max", "0.05"),
        ("imu.enabled", "true"),
        ("imu.rate", "7"),
        ("init.slosh_angle", "0.2"),
    ];
    let changes = [
        (1.0, "tau_cmd", "0.2"),
        (6.0, "tau_cmd", "-0.04"),
        (9.0, "tau_ext", "-0.03"),
        (12.0, "tau_cmd", "0.01"),
    ];
    let (events, _) = compare(&settings, &changes, (15.0, 5e-4, 1e-7));
    assert_eq!(events[1], 15 * 7);
}

/// Large waves end the linear regime. This is a step event, which the FMU notices at the end of a step.
#[test]
fn the_slosh_regime_changes_only_at_events() {
    let fmu = open();
    let settings = [("slosh.model", "planar"), ("init.slosh_angle", "0.5"), ("tau_cmd", "0.02")];
    let mut host = Host::new(&fmu, &settings);
    let mut seen = Vec::new();
    for n in 1..=200 {
        host.run(f64::from(n) * 0.01, 1e-3);
        let ratio = host.instance.real("wave_height").unwrap() / (0.163 / 2.0);
        let regime = host.instance.get("regime").unwrap();
        let expected = if ratio < 0.15 {
            1
        } else if ratio <= 0.25 {
            2
        } else {
            3
        };
        assert_eq!(regime, host::description::Value::Integer(expected), "{n}");
        seen.push(expected);
    }
    assert!(host.events[2] > 5 && seen.contains(&1) && seen.contains(&3), "{:?}", host.events);

    // Between events the regime does not change, for any values of the states.
    let mut x = host.x;
    let before = host.instance.get("regime").unwrap();
    x[6..].fill(0.0);
    let other = host.instance.real("wave_height").unwrap();
    host.instance.set_continuous_states(&x).unwrap();
    assert_ne!(host.instance.real("wave_height").unwrap(), other);
    assert_eq!(host.instance.get("regime").unwrap(), before);
}

#[test]
fn euler_in_model_exchange_converges_to_co_simulation_with_first_order() {
    let fmu = open();
    let settings = [("init.omega", "0.08"), ("init.slosh_angle", "0.3")];
    let mut own = set_up(&fmu, host::fmi2::CO_SIMULATION, &settings);
    own.do_step(0.0, 5.0).unwrap();
    let mut worst = Vec::new();
    for h in [1e-4, 5e-5] {
        let mut host = Host::new(&fmu, &settings);
        let steps = (5.0f64 / h).round() as usize;
        let mut events = 0;
        for n in 1..=steps {
            let rates = host.rates(host.time, &host.x.clone());
            host.x = std::array::from_fn(|i| host.x[i] + h * rates[i]);
            host.time = n as f64 * h;
            host.instance.set_time(host.time).unwrap();
            host.instance.set_continuous_states(&host.x.clone()).unwrap();
            // The FMU requests event mode when a change is overdue.
            if host.instance.completed_integrator_step().unwrap().enter_event_mode {
                events += 1;
                host.instance.enter_event_mode().unwrap();
                host.event_iteration();
            }
        }
        assert!(events > 0);
        let got = host.instance.real("theta").unwrap();
        worst.push((got - own.real("theta").unwrap()).abs());
    }
    // The error of the energy is (omega_1 h)/2 per radian, which is one per cent after 5 s in steps of 50 us.
    assert!(worst[1] < 1e-3 && worst[1] < 0.7 * worst[0], "{worst:?}");
}

#[test]
fn calls_of_model_exchange_in_the_wrong_state_are_refused() {
    let fmu = open();
    let mut with = fmu.instantiation("one");
    with.kind = MODEL_EXCHANGE;
    let mut instance = fmu.instantiate_with(&with).unwrap();
    let mut x = [0.0; STATES];
    macro_rules! refused {
        ($call:expr, $($part:expr),*) => {
            let error = $call.unwrap_err();
            assert_eq!(error.status, Status::Error, "{error}");
            $(assert!(error.text().contains::<&str>($part), "{} is not in {error}", $part);)*
        };
    }
    refused!(instance.continuous_states(&mut x), "\"instantiated\"");
    refused!(instance.new_discrete_states(), "\"instantiated\"", "event mode");
    refused!(instance.do_step(0.0, 0.1), "Co-Simulation", "Model Exchange");
    refused!(instance.set_continuous_states(&x), "\"instantiated\"", "continuous-time mode");
    instance.nominals(&mut x).unwrap();
    assert!(x.iter().all(|x| *x > 0.0));

    instance.enter_initialization_mode().unwrap();
    refused!(instance.set_time(0.0), "\"initialization mode\"", "event mode");
    refused!(instance.set_continuous_states(&x), "\"initialization mode\"", "event mode");
    refused!(instance.enter_event_mode(), "\"initialization mode\"", "continuous-time mode");
    instance.continuous_states(&mut x).unwrap();
    instance.exit_initialization_mode().unwrap();

    refused!(instance.completed_integrator_step(), "\"event mode\"", "continuous-time mode");
    refused!(instance.status(0), "Co-Simulation");
    instance.new_discrete_states().unwrap();
    instance.set("friction.c", "0.01").unwrap();
    let error = instance.set("tank.h", "0.05").unwrap_err();
    assert!(format!("{error:#}").contains("fixed parameter"), "{error:#}");
    instance.enter_continuous_time_mode().unwrap();

    refused!(instance.new_discrete_states(), "\"continuous-time mode\"");
    refused!(instance.set_time(f64::NAN), "time = NaN s");
    refused!(instance.derivatives(&mut [0.0; 3]), "nx = 3", &STATES.to_string());
    refused!(
        instance.event_indicators(&mut [0.0; STATES]),
        &format!("ni = {STATES}"),
        &plant::INDICATORS.to_string()
    );
    refused!(instance.set_continuous_states(&x[1..]), &format!("nx = {}", STATES - 1));
    let before = x;
    x[3] = f64::NAN;
    let error = instance.set_continuous_states(&x).unwrap_err();
    assert_eq!(error.status, Status::Discard);
    assert!(error.text().contains("stuck_time") || error.text().contains("heat"), "{error}");
    x[3] = 1e30; // its square may overflow in a product
    let error = instance.set_continuous_states(&x).unwrap_err();
    assert_eq!(error.status, Status::Discard);
    instance.continuous_states(&mut x).unwrap();
    assert_eq!(x, before);
    // Inputs may change, but parameters may not.
    instance.set("tau_cmd", "0.1").unwrap();
    let error = instance.set("friction.c", "0.02").unwrap_err();
    assert!(format!("{error:#}").contains("event mode"), "{error:#}");

    instance.terminate().unwrap();
    instance.derivatives(&mut x).unwrap();
    refused!(instance.enter_event_mode(), "\"terminated\"");
    refused!(instance.set_continuous_states(&x), "\"terminated\"");
    instance.reset().unwrap();
    refused!(instance.enter_event_mode(), "\"instantiated\"");
}

/// Returns Booleans as OpenModelica up to 1.27 passes them: as an array of bytes, which the FMU reads as an array of
/// fmi2Boolean with four bytes each, followed by zeros (fmi2SetBoolean_OMC in its FMI2Common.c).
fn misread(booleans: &[i32]) -> Vec<i32> {
    let mut bytes: Vec<u8> = booleans.iter().map(|b| *b as u8).collect();
    bytes.resize(4 * booleans.len(), 0);
    bytes.chunks_exact(4).map(|four| i32::from_le_bytes(four.try_into().unwrap())).collect()
}

/// OpenModelica 1.21 to 1.27 ends the initialization first and sets all parameters except enumerations afterwards, and it
/// enters event mode when the instance already is in event mode (issue 12893 of its tracker; the template
/// importFMU2ModelExchange of its CodegenFMU.tpl). It cannot set enumerations, and its Booleans arrive as random numbers.
/// Therefore integer parameters whose names end in `kind` repeat these parameters and determine their values.
#[test]
fn openmodelica_up_to_1_27_gets_the_motion_of_the_parameters_it_sets() {
    let settings = [
        ("tank.h", "0.05"),
        ("slosh.modes", "2"),
        ("slosh.kind", "3"),
        ("slosh.zeta_from_correlation_kind", "1"),
        ("slosh.capillarity_kind", "2"),
        ("wheel.enabled_kind", "2"),
        ("imu.enabled_kind", "2"),
        ("friction.d", "0.004"),
        ("init.slosh_angle", "0.3"),
        ("init.omega", "0.08"),
    ];
    let inputs = [("tau_cmd", "0.02"), ("tau_ext", "0"), ("g_axial", "8")];
    let fmu = open();
    let mut with = fmu.instantiation("one");
    with.kind = MODEL_EXCHANGE;
    let mut instance = fmu.instantiate_with(&with).unwrap();
    instance.setup_experiment(None, 0.0, None).unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();

    let (mut reals, mut integers, mut booleans) = (vec![], vec![], vec![]);
    let variables = &fmu.description().variables;
    for v in variables.iter().filter(|v| v.causality == Causality::Parameter) {
        let set = settings.iter().find(|(name, _)| *name == v.name).map(|(_, value)| *value);
        let text = set.or(v.attributes().start.as_deref()).unwrap();
        match fmu.description().value(v, text).unwrap() {
            _ if v.kind() == Type::Enumeration => {}
            Value::Real(x) => reals.push((v.reference, x)),
            Value::Integer(n) => integers.push((v.reference, n as i32)),
            Value::Boolean(b) => booleans.push((v.reference, i32::from(b))),
            Value::String(_) => panic!("{} is a text", v.name),
        }
    }
    let (references, given): (Vec<_>, Vec<_>) = reals.into_iter().unzip();
    instance.set_real(&references, &given).unwrap();
    let (references, given): (Vec<_>, Vec<_>) = integers.into_iter().unzip();
    instance.set_integer(&references, &given).unwrap();
    let (references, given): (Vec<_>, Vec<_>) = booleans.into_iter().unzip();
    instance.set_boolean(&references, &misread(&given)).unwrap();
    // slosh.zeta_from_correlation is true, but its integer twin is false.
    assert!(misread(&given)[0] != 0, "the first Boolean arrives as any of the first four");

    // OpenModelica sets states or inputs first, depending on how it sorts the equations.
    let mut host =
        Host { instance, time: 0.0, x: [0.0; STATES], events: [0; 3], next: EventInfo::default() };
    host.instance.continuous_states(&mut host.x).unwrap();
    for (name, value) in inputs {
        host.instance.set(name, value).unwrap();
    }
    host.instance.set_continuous_states(&host.x).unwrap();
    host.instance.event_indicators(&mut [0.0; INDICATORS]).unwrap();
    host.indicators(0.0, &host.x.clone());
    host.instance.enter_event_mode().unwrap();
    host.event_iteration();
    // At this time the gyro takes no sample.
    host.run(5.01, 5e-4);

    let meant = [
        ("slosh.model", "planar"),
        ("slosh.zeta_from_correlation", "false"),
        ("slosh.capillarity", "true"),
        ("wheel.enabled", "true"),
        ("imu.enabled", "true"),
    ];
    let reals = settings.into_iter().filter(|(name, _)| !name.contains("kind"));
    let all: Vec<_> = reals.chain(meant).chain(inputs).collect();
    let mut own = set_up(&fmu, host::fmi2::CO_SIMULATION, &all);
    own.do_step(0.0, 5.01).unwrap();
    let exchanged = values(&mut host.instance);
    for (boolean, twin) in [("stuck", "stuck_kind"), ("baffle.in_range", "baffle.in_range_kind")] {
        let as_boolean = host.instance.get(boolean).unwrap() == Value::Boolean(true);
        let as_integer = host.instance.get(twin).unwrap();
        assert_eq!(as_integer, Value::Integer(i64::from(as_boolean)), "{twin}");
    }
    for (name, expected) in values(&mut own) {
        let got = exchanged[&name];
        // This is the tolerance of the test with stick and slip above.
        let allowed = 1e-7 * expected.abs().max(1.0);
        assert!((got - expected).abs() <= allowed, "{name}: {got} {expected}");
    }
}

/// A host that omits the start value of an input sets 0, as OpenModelica does after the initialization.
#[test]
fn a_warning_names_a_weightless_tank_without_restoring_force() {
    let fmu = open();
    let said = |instance: &mut Instance| {
        let texts = instance.take_messages().into_iter().map(|message| message.text);
        texts.filter(|text| text.contains("g_axial = 0")).collect::<Vec<_>>()
    };
    let started = |settings: &[(&str, &str)]| {
        said(&mut set_up(&fmu, host::fmi2::CO_SIMULATION, settings)).concat()
    };
    let weightless = ("g_axial", "0");
    assert!(started(&[weightless]).contains("nothing restores or damps slosh mode 1"));
    let table = [
        weightless,
        ("slosh.source", "table"),
        ("slosh.modes", "2"),
        ("slosh.table.m_liq", "2"),
        ("slosh.table.mass[1]", "0.5"),
        ("slosh.table.mass[2]", "0.1"),
        ("slosh.table.length[1]", "0.05"),
        ("slosh.table.length[2]", "0.02"),
        ("slosh.table.k[1]", "2"),
    ];
    assert!(started(&table).contains("slosh mode 2"));
    for restored in [
        &[][..],
        &[weightless, ("slosh.model", "frozen")],
        &[weightless, ("slosh.capillarity", "true")],
        &[weightless, ("slosh.capillarity_kind", "2")],
        &[("g_axial", "1e-9")],
        &[table.as_slice(), &[("slosh.table.k[2]", "1")]].concat(),
    ] {
        assert_eq!(started(restored), "", "{restored:?}");
    }

    // The parameter is set late. The warning is about the values with which the motion begins, and comes only once.
    let mut late = set_up(&fmu, MODEL_EXCHANGE, &[]);
    late.set("g_axial", "0").unwrap();
    assert_eq!(said(&mut late).len(), 0);
    late.new_discrete_states().unwrap();
    assert_eq!(said(&mut late).len(), 1);
    late.enter_continuous_time_mode().unwrap();
    assert_eq!(said(&mut late).len(), 0);
    let mut set_right = set_up(&fmu, MODEL_EXCHANGE, &[weightless]);
    set_right.set("g_axial", "9.81").unwrap();
    set_right.new_discrete_states().unwrap();
    assert_eq!(said(&mut set_right).len(), 0);
}

/// In Model Exchange HubSlosh also accepts parameters in its first event mode. Values out of range are refused at once;
/// limits of the wheel that contradict each other are refused by fmi2NewDiscreteStates.
#[test]
fn parameters_set_in_event_mode_act_as_if_set_before_initialization_and_wrong_values_are_refused() {
    let fmu = open();
    let mut late = set_up(&fmu, MODEL_EXCHANGE, &[]);
    late.set("init.slosh_angle", "0.3").unwrap();
    let error = late.set("tank.h", "-1").unwrap_err();
    assert!(format!("{error:#}").contains("tank.h = -1.0 m (allowed: "), "{error:#}");
    // The test sets the two limits one after the other, so that they contradict each other until both are set.
    late.set("wheel.speed_min", "400").unwrap();
    let error = late.new_discrete_states().unwrap_err();
    assert!(error.text().contains("wheel.speed_max"), "{error}");
    late.set("wheel.speed_max", "500").unwrap();
    late.set("wheel.speed_0", "450").unwrap();
    let saved = late.get_state().unwrap();
    let mut early = set_up(
        &fmu,
        MODEL_EXCHANGE,
        &[
            ("init.slosh_angle", "0.3"),
            ("wheel.speed_min", "400"),
            ("wheel.speed_max", "500"),
            ("wheel.speed_0", "450"),
        ],
    );
    early.new_discrete_states().unwrap();
    late.new_discrete_states().unwrap();
    assert_eq!(values(&mut late), values(&mut early));
    assert_eq!(late.get("event_count").unwrap(), Value::Integer(0));
    // Event mode is now entered as usual, so that parameters are refused; restoring a state restores the first event mode.
    assert!(late.set("init.slosh_angle", "0.2").is_err());
    let bytes = late.serialize(&saved).unwrap();
    let read = late.deserialize(&bytes).unwrap();
    late.set_state(&read).unwrap();
    late.set("init.slosh_angle", "0.2").unwrap();
    assert_eq!(late.real("slosh_angle").unwrap(), 0.2);
    for state in [saved, read] {
        late.free_state(state).unwrap();
    }
}

/// When a value is read, the FMU computes the initial state; if a parameter is set afterwards, the FMU computes it again.
#[test]
fn after_initialization_the_order_of_setting_and_reading_does_not_matter() {
    let fmu = open();
    let changes = [("tank.h", "0.05"), ("g_axial", "1"), ("tau_cmd", "0.3")];
    let mut early = set_up(&fmu, MODEL_EXCHANGE, &changes);
    early.new_discrete_states().unwrap();
    let names = ["slosh.frequency[1]", "slosh.damping[1]", "event_count", "stuck"];
    for order in [[0, 1, 2], [2, 1, 0], [1, 0, 2]] {
        for reads in [false, true] {
            let mut late = set_up(&fmu, MODEL_EXCHANGE, &[]);
            for n in order {
                late.set(changes[n].0, changes[n].1).unwrap();
                if reads {
                    late.real("slosh.frequency[1]").unwrap();
                }
            }
            late.new_discrete_states().unwrap();
            for name in names {
                assert_eq!(late.get(name).unwrap(), early.get(name).unwrap(), "{name} {order:?}");
            }
            assert_eq!(values(&mut late), values(&mut early), "{order:?}");
        }
    }
}

#[test]
fn a_refused_event_leaves_the_parameters_to_be_corrected() {
    let fmu = open();
    let mut with = fmu.instantiation("one");
    with.kind = MODEL_EXCHANGE;
    let mut instance = fmu.instantiate_with(&with).unwrap();
    instance.set("imu.enabled", "true").unwrap();
    // The time is so large that a step to the next gyro sample does not change it.
    instance.setup_experiment(None, 1e16, None).unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    let error = instance.new_discrete_states().unwrap_err();
    assert!(error.text().contains("imu.rate"), "{error}");
    instance.set("imu.enabled", "false").unwrap();
    instance.new_discrete_states().unwrap();
}

/// An integrator may evaluate derivatives at times after the stop time, but no step may end there.
#[test]
fn in_model_exchange_a_completed_step_after_the_stop_time_is_refused_and_a_trial_time_is_not() {
    let fmu = open();
    let mut with = fmu.instantiation("one");
    with.kind = MODEL_EXCHANGE;
    let mut instance = fmu.instantiate_with(&with).unwrap();
    instance.setup_experiment(None, 0.0, Some(1.0)).unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    instance.new_discrete_states().unwrap();
    instance.enter_continuous_time_mode().unwrap();
    instance.set_time(1.1).unwrap();
    instance.derivatives(&mut [0.0; STATES]).unwrap();
    assert!(instance.completed_integrator_step().unwrap_err().text().contains("stop time"));
    instance.set_time(1.0 + 1e-12).unwrap();
    instance.completed_integrator_step().unwrap();
}

/// A host moves a slosh mass of the model `liquid` outside the range of the model. fmi2CompletedIntegratorStep returns an
/// error that names the mode, and the instance refuses further calls.
#[test]
fn states_out_of_the_models_range_end_the_run() {
    let fmu = open();
    let mut host = Host::new(&fmu, &[("slosh.model", "liquid")]);
    let mut x = host.x;
    // This state is slosh.q_radial[1], m; the pendulum is 4.5 cm long.
    x[plant::x::SLOSH] = 0.1;
    host.instance.set_continuous_states(&x).unwrap();
    let error = host.instance.completed_integrator_step().unwrap_err();
    assert!(error.text().contains("slosh mode 1 left its range"), "{error}");
    assert!(host.instance.enter_event_mode().is_err());
    host.instance.terminate().unwrap();
}

/// The state is saved in continuous-time mode and restored in a new instance.
#[test]
fn a_saved_state_of_model_exchange_continues_bit_for_bit() {
    let fmu = open();
    let settings =
        [("slosh.model", "spherical"), ("imu.enabled", "true"), ("init.slosh_angle", "0.3")];
    let mut host = Host::new(&fmu, &settings);
    host.run(1.0, 1e-3);
    let saved = host.instance.get_state().unwrap();
    let bytes = host.instance.serialize(&saved).unwrap();
    let (time, x, next) = (host.time, host.x, host.next);
    host.run(3.0, 1e-3);
    let there = values(&mut host.instance);

    let mut with = fmu.instantiation("two");
    with.kind = MODEL_EXCHANGE;
    let mut instance = fmu.instantiate_with(&with).unwrap();
    let read = instance.deserialize(&bytes).unwrap();
    instance.set_state(&read).unwrap();
    instance.free_state(read).unwrap();
    let mut other = Host { instance, time, x, events: [0; 3], next };
    other.run(3.0, 1e-3);
    assert_eq!(values(&mut other.instance), there);

    host.instance.set_state(&saved).unwrap();
    (host.time, host.x, host.next) = (time, x, next);
    host.run(3.0, 1e-3);
    assert_eq!(values(&mut host.instance), there);
    host.instance.free_state(saved).unwrap();

    let mut own = fmu.instantiate("three").unwrap();
    let read = own.deserialize(&bytes).unwrap();
    assert!(own.set_state(&read).unwrap_err().text().contains("Model Exchange"));
    own.free_state(read).unwrap();
}

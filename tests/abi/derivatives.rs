//! Directional and adjoint derivatives of the packed FMUs 3.0 at random operating points, through the functions that
//! hosts call. The adjoint derivatives are the transpose of the directional ones, and both equal finite differences
//! of the FMU's values.

use fastrand::Rng;
use host::causality::{Causality, Variability};
use host::description::{ModelDescription, Type, Value, Variable};
use host::fmi3::{Fmu, Instance, Interface};
use pack::{Fmi, model, packed_version_for_tests};

/// Rounding error of a sum of up to 100 products, relative to the sum of their magnitudes. The derivatives in these products
/// have rounding errors as well.
const ROUNDING: f64 = 1e-13;
/// Error of central differences of order 4 with a step of 1e-3 of a known's size. The truncation error is (1e-3)^4 of the
/// fifth derivative; the rounding error is 1e-16/1e-3, or more if large terms cancel in a value.
const DIFFERENCES: f64 = 1e-6;

fn open(name: &str) -> Fmu {
    let path = packed_version_for_tests(model(name).unwrap(), Fmi::V3);
    let host::fmu::Fmu::V3(fmu) = host::fmu::Fmu::open(path).unwrap() else { panic!("{name}") };
    fmu
}

struct Sides {
    unknowns: Vec<u32>,
    knowns: Vec<u32>,
    /// Number of knowns that are inputs. They come first in the list of knowns; the states follow.
    inputs: usize,
    names: Vec<String>,
}

fn is_real(v: &Variable) -> bool {
    v.kind() == Type::Real && v.variability == Variability::Continuous
}

fn is_computed(v: &Variable) -> bool {
    ["output", "local"].contains(&v.causality.as_str())
}

impl Sides {
    fn new(description: &ModelDescription) -> Sides {
        let real = || description.variables.iter().filter(|v| is_real(v));
        let derivatives: Vec<&Variable> = real().filter(|v| v.name.starts_with("der(")).collect();
        let state = |v: &&Variable| {
            let name = v.name.trim_start_matches("der(").trim_end_matches(')');
            description.variable(name).unwrap().reference
        };
        let inputs: Vec<u32> =
            real().filter(|v| v.causality == Causality::Input).map(|v| v.reference).collect();
        let unknowns: Vec<&Variable> =
            real().filter(|v| is_computed(v) && !v.name.starts_with("event_indicator")).collect();
        Sides {
            names: unknowns.iter().map(|v| v.name.clone()).collect(),
            unknowns: unknowns.iter().map(|v| v.reference).collect(),
            inputs: inputs.len(),
            knowns: inputs.into_iter().chain(derivatives.iter().map(state)).collect(),
        }
    }
}

/// An operating point of an instance: the values `x` of its inputs and states, and their typical magnitudes `sizes`.
struct Point<'a, 'fmu> {
    sides: &'a Sides,
    instance: Instance<'fmu>,
    x: Vec<f64>,
    sizes: Vec<f64>,
    what: String,
}

impl Point<'_, '_> {
    fn values(&mut self) -> Vec<f64> {
        let mut values = vec![f64::NAN; self.sides.unknowns.len()];
        self.instance.get_numbers(&self.sides.unknowns, &mut values).unwrap();
        values
    }

    /// Returns the values of the unknowns after the knowns were moved by `s` times `direction` from the operating point.
    fn unknowns_at(&mut self, s: f64, direction: &[f64]) -> Vec<f64> {
        let there: Vec<f64> = self.x.iter().zip(direction).map(|(x, d)| x + s * d).collect();
        self.go(&there, direction);
        let values = self.values();
        let here = self.x.clone();
        self.go(&here, direction);
        values
    }

    fn go(&mut self, to: &[f64], direction: &[f64]) {
        let n = self.sides.inputs;
        self.instance.set_numbers(&self.sides.knowns[..n], &to[..n]).unwrap();
        if direction[n..].iter().any(|d| *d != 0.0) {
            self.instance.set_continuous_states(&to[n..]).unwrap();
        }
    }

    fn forward(&mut self, direction: &[f64]) -> Vec<f64> {
        let Sides { unknowns, knowns, .. } = self.sides;
        self.instance
            .directional_derivative(unknowns, knowns, direction, unknowns.len())
            .unwrap_or_else(|error| panic!("{}: {error}", self.what))
    }

    fn adjoint(&mut self, weights: &[f64]) -> Vec<f64> {
        let Sides { unknowns, knowns, .. } = self.sides;
        self.instance
            .adjoint_derivative(unknowns, knowns, weights, knowns.len())
            .unwrap_or_else(|error| panic!("{}: {error}", self.what))
    }

    /// Compares adjoint and directional derivatives with each other, and with finite differences with respect to the knowns
    /// at the positions `moved`.
    fn check(&mut self, rng: &mut Rng, moved: &[usize]) {
        let sides = self.sides;
        let y = self.values();
        let mut random = |sizes: &[f64]| -> Vec<f64> {
            sizes.iter().map(|size| size * (2.0 * rng.f64() - 1.0)).collect()
        };
        let direction = random(&self.sizes);
        // Each unknown is weighted by the inverse of its change along the direction, so that all unknowns count equally.
        let forward = self.forward(&direction);
        // Derivatives are linear in the seed; a factor of two is exact in every product.
        let none = self.forward(&vec![0.0; direction.len()]);
        let twice = self.forward(&direction.iter().map(|d| 2.0 * d).collect::<Vec<_>>());
        for (i, name) in sides.names.iter().enumerate() {
            assert_eq!(none[i], 0.0, "{}: {name} along the seed 0", self.what);
            assert_eq!(twice[i], 2.0 * forward[i], "{}: {name} along twice the seed", self.what);
        }
        let weigh: Vec<f64> =
            forward.iter().zip(&y).map(|(d, y)| 1.0 / d.abs().max(y.abs()).max(1e-3)).collect();
        let weights = random(&weigh);
        let adjoint = self.adjoint(&weights);

        // Checks w.(J v) = (J^T w).v, and J itself column by column.
        let mut columns = Vec::new();
        for j in 0..sides.knowns.len() {
            let mut one = vec![0.0; sides.knowns.len()];
            one[j] = 1.0;
            columns.push(self.forward(&one));
        }
        let mut products = 0.0;
        for (j, column) in columns.iter().enumerate() {
            let terms: Vec<f64> = weights.iter().zip(column).map(|(w, d)| w * d).collect();
            let sum: f64 = terms.iter().sum();
            let size: f64 = terms.iter().map(|term| term.abs()).sum();
            assert!(
                (adjoint[j] - sum).abs() <= ROUNDING * size,
                "{}: known {j}: adjoint {}, transposed {sum}",
                self.what,
                adjoint[j]
            );
            products += size * direction[j].abs();
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (one, other) = (dot(&weights, &forward), dot(&adjoint, &direction));
        assert!(
            (one - other).abs() <= ROUNDING * products,
            "{}: w.(J v) = {one}, (J^T w).v = {other}, of products {products}",
            self.what
        );

        // Compares both kinds of derivatives with finite differences; the adjoint derivatives for each known separately.
        const H: f64 = 1e-3;
        let directions = moved.iter().map(|j| {
            let mut one = vec![0.0; sides.knowns.len()];
            one[*j] = self.sizes[*j];
            one
        });
        let along: Vec<f64> = (0..direction.len())
            .map(|j| if moved.contains(&j) { direction[j] } else { 0.0 })
            .collect();
        let directions: Vec<Vec<f64>> = directions.chain([along]).collect();
        for (j, direction) in directions.iter().enumerate() {
            let forward = self.forward(direction);
            let [p2, p1, m1, m2] =
                [2.0, 1.0, -1.0, -2.0].map(|k| self.unknowns_at(k * H, direction));
            let (mut by_differences, mut size) = (0.0, 0.0);
            let mut by_forward = 0.0;
            for i in 0..forward.len() {
                // wave_height as a function of the slosh angles is a cone; differences across its tip have no meaning.
                let is_tip = [&p2, &p1, &m1, &m2].iter().any(|p| p[i] < 5e-3);
                if sides.names[i] == "wave_height" && is_tip {
                    by_forward += weights[i] * forward[i];
                    continue;
                }
                let difference = (8.0 * (p1[i] - m1[i]) - (p2[i] - m2[i])) / (12.0 * H);
                let scale = difference.abs().max(y[i].abs()).max(1e-3);
                assert!(
                    (forward[i] - difference).abs() <= DIFFERENCES * scale,
                    "{}: {} along direction {j}: {}, by differences {difference}",
                    self.what,
                    sides.names[i],
                    forward[i]
                );
                by_differences += weights[i] * difference;
                size += (weights[i] * scale).abs();
            }
            let by_adjoint = dot(&adjoint, direction) - by_forward;
            assert!(
                (by_adjoint - by_differences).abs() <= DIFFERENCES * size,
                "{}: adjoint along direction {j}: {by_adjoint}, by differences {by_differences}",
                self.what
            );
        }
    }
}

/// Start time, s. It is not 0, so that outputs that are times differ from their derivatives.
const START: f64 = 1.0;

/// Returns an instance for Model Exchange in continuous-time mode, with its inputs set, and its initial states.
fn exchange<'fmu>(fmu: &'fmu Fmu, settings: &[(String, String)]) -> (Instance<'fmu>, Vec<f64>) {
    let mut with = fmu.instantiation("one");
    with.interface = Interface::ModelExchange;
    let mut instance = fmu.instantiate_with(&with).unwrap();
    set(&mut instance, settings);
    instance.enter_initialization_mode(None, START, None).unwrap();
    instance.exit_initialization_mode().unwrap();
    while instance.update_discrete_states().unwrap().needs_update != 0 {}
    instance.enter_continuous_time_mode().unwrap();
    let mut states = vec![0.0; instance.number_of_states().unwrap()];
    instance.continuous_states(&mut states).unwrap();
    (instance, states)
}

fn instance_after_step<'fmu>(fmu: &'fmu Fmu, settings: &[(String, String)]) -> Instance<'fmu> {
    let mut instance = fmu.instantiate("one").unwrap();
    set(&mut instance, settings);
    instance.enter_initialization_mode(None, START, None).unwrap();
    instance.exit_initialization_mode().unwrap();
    instance.do_step(START, 0.3).unwrap();
    instance
}

fn set(instance: &mut Instance, settings: &[(String, String)]) {
    let description = instance.fmu().description();
    for (name, text) in settings {
        let variable = description.variable(name).unwrap();
        let value = description.value(variable, text).unwrap();
        instance.set_value(variable, value).unwrap();
    }
}

fn uniform(rng: &mut Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.f64()
}

fn setting(name: impl Into<String>, value: impl ToString) -> (String, String) {
    (name.into(), value.to_string())
}

/// Checks the derivatives at three operating points: at the start of Model Exchange with `settings`; after the states were
/// moved by random numbers in the ranges of `scatter`; and after 0.3 s of Co-Simulation, where a host can change only inputs.
/// Inputs whose jumps are impulses are not moved there, because they would change states. `sizes` returns the typical
/// magnitude of a variable, and `expect` checks the instance at each point.
fn check(
    fmu: &Fmu,
    rng: &mut Rng,
    settings: &[(String, String)],
    sizes: impl Fn(&str) -> f64,
    scatter: impl Fn(&str) -> [f64; 2],
    expect: impl Fn(&mut Instance, &str),
) {
    let sides = Sides::new(fmu.description());
    let name_of = |reference: &u32| {
        let of =
            fmu.description().variables.iter().find(|v| v.reference == *reference && is_real(v));
        of.unwrap().name.as_str()
    };
    let names: Vec<&str> = sides.knowns.iter().map(name_of).collect();
    let sizes: Vec<f64> = names.iter().map(|name| sizes(name)).collect();
    let (mut instance, mut states) = exchange(fmu, settings);
    for (name, state) in names[sides.inputs..].iter().zip(&mut states) {
        let [low, high] = scatter(name);
        *state += uniform(rng, low, high);
    }
    instance.set_continuous_states(&states).unwrap();
    let what = format!("Model Exchange, {settings:?}");
    expect(&mut instance, &what);
    let mut inputs = vec![0.0; sides.inputs];
    instance.get_numbers(&sides.knowns[..sides.inputs], &mut inputs).unwrap();
    let x: Vec<f64> = inputs.iter().copied().chain(states).collect();
    let all: Vec<usize> = (0..x.len()).collect();
    Point { sides: &sides, instance, x, sizes: sizes.clone(), what }.check(rng, &all);

    let mut instance = instance_after_step(fmu, settings);
    let mut x = vec![0.0; sides.knowns.len()];
    instance.get_numbers(&sides.knowns, &mut x).unwrap();
    let what = format!("Co-Simulation, {settings:?}");
    expect(&mut instance, &what);
    let is_impulse = |name: &str| name.starts_with("h_wheels") || name.starts_with("mass_flow");
    let moved: Vec<usize> = (0..sides.inputs).filter(|j| !is_impulse(names[*j])).collect();
    Point { sides: &sides, instance, x, sizes, what }.check(rng, &moved);
}

/// Covers every slosh model with every friction law while the hub slips, a stuck hub, and the wheel at the limits of its
/// torque and of its speed.
#[test]
fn adjoint_and_directional_derivatives_of_hubslosh_equal_differences_in_slip_stick_and_at_wheel_limits()
 {
    let fmu = open("HubSlosh");
    let mut rng = Rng::with_seed(73);
    let description = fmu.description();
    let names = |name: &str| {
        let items = description.items(description.variable(name).unwrap()).iter();
        items.map(|item| item.name.as_str()).collect::<Vec<_>>()
    };
    let (models, frictions) = (names("slosh.model"), names("friction.model"));
    let wheels = ["none", "torque", "speed"];
    for model in models {
        // States are angles; in the model `liquid` they are lengths, and the pendulum of the third mode is 9 mm long.
        let unit = if model == "liquid" { 0.009 } else { 1.0 };
        for (k, friction) in frictions.iter().copied().chain(["stick"]).enumerate() {
            let is_stuck = friction == "stick";
            let friction = if is_stuck { "stribeck" } else { friction };
            let wheel = wheels[(k + usize::from(unit < 1.0)) % 3];
            let modes = if model == "liquid" { 1 } else { 3 };
            let torque = if is_stuck { 1e-3 } else { 0.1 };
            let mut settings = vec![
                setting("slosh.model", model),
                setting("slosh.modes", modes),
                setting("friction.model", friction),
                // With the default of 1e-5 the friction curve bends within a range that differences cannot resolve.
                setting("friction.eps", 0.05),
                setting("friction.forward_cos1", uniform(&mut rng, -0.2, 0.2)),
                setting("friction.asymmetry", uniform(&mut rng, -0.2, 0.2)),
                setting("init.omega", if is_stuck { 0.0 } else { 0.2 }),
                setting("init.slosh_angle", if is_stuck { 1e-3 } else { 0.1 }),
                setting("tau_cmd", uniform(&mut rng, -torque, torque)),
                setting("tau_ext", uniform(&mut rng, -torque, torque)),
                setting("g_axial", uniform(&mut rng, 5.0, 20.0)),
                setting("wheel.enabled", wheel != "none"),
            ];
            // The torque of the wheel on the hub must stay below the limit of the friction.
            match wheel {
                "torque" => settings
                    .extend([setting("wheel.tau_max", torque / 2.0), setting("tau_cmd", torque)]),
                "speed" => settings.extend([
                    setting("wheel.speed_0", 314.1592653589793),
                    setting("tau_cmd", -torque),
                ]),
                _ => {}
            }
            let sizes = |name: &str| match name {
                "tau_cmd" | "tau_ext" => torque,
                "g_axial" | "wheel_speed" => 1.0,
                "bristle" => 1e-6,
                "omega" if is_stuck => 1e-3,
                "omega" => 0.05,
                _ if name.starts_with("slosh.") => 0.3 * unit,
                _ => 1.0,
            };
            // The host handles events, so that states may have any values within continuous-time mode. Exactly at its
            // limit the wheel's torque jumps with its speed; the host has passed this limit.
            let scatter = |name: &str| match name {
                "theta" => [-3.0, 3.0],
                "omega" if !is_stuck => [-0.1, 0.1],
                "bristle" => [-1e-6, 1e-6],
                "wheel_speed" if wheel == "speed" => [1.0, 2.0],
                _ if name.starts_with("slosh.") && is_stuck => [-1e-3 * unit, 1e-3 * unit],
                _ if name.starts_with("slosh.q") => [-0.3 * unit, 0.3 * unit],
                _ if name.starts_with("slosh.") => [-2.0 * unit, 2.0 * unit],
                _ => [0.0, 0.0],
            };
            let expect = |instance: &mut Instance, what: &str| {
                let description = instance.fmu().description();
                let mut get = |name| instance.value(description.variable(name).unwrap()).unwrap();
                assert_eq!(get("stuck"), Value::Boolean(is_stuck), "{what}");
                match wheel {
                    "torque" => {
                        assert_eq!(get("tau_actuator"), Value::Real(torque / 2.0), "{what}")
                    }
                    "speed" => assert_eq!(get("tau_actuator"), Value::Real(0.0), "{what}"),
                    _ => {}
                }
            };
            check(&fmu, &mut rng, &settings, sizes, scatter, expect);
        }
    }
}

/// Covers a free craft and one on a pivot, with one to three tanks of one to three modes.
#[test]
fn adjoint_and_directional_derivatives_of_spacecraft_equal_differences() {
    let fmu = open("Spacecraft");
    let mut rng = Rng::with_seed(74);
    for (mount, tanks, modes) in [("free", 1, 1), ("pivot", 1, 2), ("free", 3, 3), ("pivot", 2, 1)]
    {
        let mut settings = vec![setting("mount", mount), setting("tanks", tanks)];
        for i in 1..=3 {
            settings.push(setting(format!("gravity[{i}]"), [0.3, -0.2, -9.8][i - 1]));
            settings.push(setting(format!("force[{i}]"), [100.0, -50.0, 2400.0][i - 1]));
            settings.push(setting(format!("torque[{i}]"), uniform(&mut rng, -20.0, 20.0)));
            settings.push(setting(format!("h_wheels[{i}]"), uniform(&mut rng, -5.0, 5.0)));
            settings.push(setting(format!("init.omega[{i}]"), uniform(&mut rng, -0.2, 0.2)));
        }
        for tank in 1..=tanks {
            settings.push(setting(format!("tank[{tank}].modes"), modes));
            settings.push(setting(format!("tank[{tank}].damping_law"), "constant"));
            for i in 1..=3 {
                let name = format!("tank[{tank}].position[{i}]");
                settings.push(setting(name, uniform(&mut rng, -0.6, 0.6)));
                for mode in 1..=modes {
                    let p = if i == 3 { -1.0 } else { uniform(&mut rng, -0.3, 0.3) };
                    settings.push(setting(format!("tank[{tank}].p_0[{mode},{i}]"), p));
                    let rate = uniform(&mut rng, -0.5, 0.5);
                    settings.push(setting(format!("tank[{tank}].p_dot_0[{mode},{i}]"), rate));
                }
            }
        }
        check(&fmu, &mut rng, &settings, of_craft, |_| [0.0, 0.0], |_, _| ());
    }
}

fn of_craft(name: &str) -> f64 {
    match name.split('[').next() {
        Some("force") => 100.0,
        Some("torque" | "h_wheels") => 5.0,
        Some("mass_flow") => 1.0,
        Some("omega" | "omega_dot") => 0.1,
        _ if name.contains(".p") => 0.1,
        _ => 1.0,
    }
}

/// Covers each form in which the tank can be coupled to the craft that carries it.
#[test]
fn adjoint_and_directional_derivatives_of_sloshtank_equal_differences() {
    let fmu = open("SloshTank");
    let mut rng = Rng::with_seed(75);
    for (coupling, modes) in [("split", 1), ("lumped", 2), ("rigid_body", 3)] {
        let mut settings = vec![setting("coupling", coupling), setting("tank.modes", modes)];
        settings.push(setting("tank.damping_law", "constant"));
        for i in 1..=3 {
            settings.push(setting(format!("a[{i}]"), [0.3, -0.2, 1.5][i - 1]));
            settings.push(setting(format!("omega[{i}]"), uniform(&mut rng, -0.3, 0.3)));
            settings.push(setting(format!("omega_dot[{i}]"), uniform(&mut rng, -0.1, 0.1)));
            settings.push(setting(format!("tank.position[{i}]"), uniform(&mut rng, -0.6, 0.6)));
            for mode in 1..=modes {
                let p = if i == 3 { -1.0 } else { uniform(&mut rng, -0.3, 0.3) };
                settings.push(setting(format!("tank.p_0[{mode},{i}]"), p));
                let rate = uniform(&mut rng, -0.5, 0.5);
                settings.push(setting(format!("tank.p_dot_0[{mode},{i}]"), rate));
            }
        }
        check(&fmu, &mut rng, &settings, of_craft, |_| [0.0, 0.0], |_, _| ());
    }
}

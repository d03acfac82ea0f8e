//! Tests of the LuGre friction law: passivity, presliding loops and frictional lag as Canudas de Wit et al. (1995) show
//! them, the limit of stiff bristles, and events.

use plant::{
    Friction, FrictionModel, Inputs, Outputs, Parameters, Plant, Ramp, STATES, SloshModel,
    indicator, x,
};

const TOLERANCE: f64 = 1e-9;

fn bench(slosh: SloshModel) -> Parameters {
    let mut p = Parameters::default();
    (p.slosh.model, p.friction.model) = (slosh, FrictionModel::Lugre);
    p
}

fn torque(value: f64) -> Inputs {
    Inputs { tau_cmd: Ramp::held(value), ..Inputs::default() }
}

/// Break-away torque of the bearing with the default parameters, N m: Coulomb friction plus the excess at rest.
const G_MAX: f64 = 0.003498 + 0.002423;

#[test]
fn with_lugre_friction_energy_is_balanced_and_the_bearing_never_adds_energy() {
    for slosh in SloshModel::ALL {
        for (sigma0, asymmetry) in [(30.0, 0.0), (1000.0, 0.05)] {
            let mut p = bench(slosh);
            (p.friction.sigma0, p.friction.asymmetry) = (sigma0, asymmetry);
            p.friction.sigma1 = 0.03;
            p.friction.harmonics_forward = [0.02, -0.01, 0.01, 0.0];
            (p.init.slosh_angle, p.init.slosh_angle_radial) = (0.05, 0.02);
            let mut plant = Plant::new(&p, &torque(0.0), 0.0, TOLERANCE).unwrap();
            let first = plant.outputs(&torque(0.0));
            let (mut last, mut throughput) = (first, first.energy);
            for k in 0..300 {
                let t = k as f64 * 0.02;
                let inputs = torque(0.1 * libm::cos(9.0 * t));
                plant.step(&inputs, 0.02).unwrap();
                let now = plant.outputs(&inputs);
                throughput += (now.work - last.work).abs() + (now.heat - last.heat).abs();
                let balance = now.energy - first.energy - now.work + now.heat;
                assert!(balance.abs() < 1e-8 * throughput, "{slosh:?} {balance:e} {throughput:e}");
                assert!(now.heat >= last.heat - 1e-13 * throughput, "{slosh:?}");
                assert!(now.power_dissipated >= 0.0);
                last = now;
            }
            assert!(last.discrete.event_count > 10, "the hub must have reversed often");
            assert!(
                last.heat > 0.1 * throughput,
                "friction must have dissipated a part of the energy"
            );
        }
    }
}

fn dissipation(plant: &mut Plant, p: &Friction, omega: f64, share: f64) -> f64 {
    let mut x = [0.0; STATES];
    (x[x::OMEGA], x[x::BRISTLE]) = (omega, share * G_MAX / p.sigma0);
    plant.set_continuous_states(&x);
    plant.take_event(&torque(0.0)).unwrap();
    plant.outputs_held(&torque(0.0)).power_dissipated
}

#[test]
fn dissipation_of_lugre_friction_is_negative_only_if_sigma1_exceeds_its_limit() {
    let mut p = bench(SloshModel::Frozen);
    let limit = p.friction.b * p.friction.c / p.friction.d;
    p.friction.sigma1 = limit;
    let mut plant = Plant::new(&p, &torque(0.0), 0.0, TOLERANCE).unwrap();
    let mut least: f64 = 1.0;
    for k in 0..200 {
        for j in -50..=50 {
            let omega = 10f64.powf(k as f64 / 20.0 - 5.0);
            for omega in [omega, -omega] {
                let power = dissipation(&mut plant, &p.friction, omega, f64::from(j) / 50.0);
                // The tolerance allows for rounding errors of terms that cancel.
                assert!(power >= -1e-13 * omega * omega, "{omega} {j}: {power}");
                least = least.min(power / (p.friction.b * omega * omega));
            }
        }
    }
    assert!(least < 1e-3, "the passivity condition is not sharp: {least}");
    p.friction.sigma1 = limit * 1.001;
    let problems = Plant::new(&p, &torque(0.0), 0.0, TOLERANCE).err().unwrap();
    assert!(problems.len() == 1 && problems[0].contains("friction.sigma1"), "{problems:?}");
    // Without Stribeck effect every sigma1 is passive. With friction that depends on the direction, only
    // smaller values are passive.
    p.friction.d = 0.0;
    p.friction.sigma1 = 10.0;
    Plant::new(&p, &torque(0.0), 0.0, TOLERANCE).unwrap();
    p.friction.asymmetry = 0.5;
    // The limit is b (1 - 0.5)/(1.5 - 0.5).
    assert!(Plant::new(&p, &torque(0.0), 0.0, TOLERANCE).is_err());
    p.friction.sigma1 = p.friction.b / 2.0;
    Plant::new(&p, &torque(0.0), 0.0, TOLERANCE).unwrap();
    p.friction.c = 0.0;
    let problems = Plant::new(&p, &torque(0.0), 0.0, TOLERANCE).err().unwrap();
    assert!(problems[0].contains("friction.c"), "{problems:?}");
}

#[test]
fn stiff_lugre_bristles_approach_the_set_valued_law() {
    // The torque is a sine. The hub follows it with sliding, reversal and rest.
    let run = |model: FrictionModel, sigma0: f64| {
        let mut p = bench(SloshModel::Linear);
        p.friction.model = model;
        (p.friction.sigma0, p.friction.sigma1) = (sigma0, 0.05);
        let mut plant = Plant::new(&p, &torque(0.0), 0.0, TOLERANCE).unwrap();
        let mut rates = Vec::new();
        for k in 0..100 {
            plant.step(&torque(0.009 * libm::sin(3.0 * 0.02 * k as f64)), 0.02).unwrap();
            rates.push(plant.omega());
        }
        rates
    };
    let set_valued = run(FrictionModel::Stribeck, 1.0);
    let difference = |sigma0: f64| {
        let rates = run(FrictionModel::Lugre, sigma0);
        let squares = rates.iter().zip(&set_valued).map(|(a, b)| (a - b) * (a - b));
        (squares.sum::<f64>() / 100.0).sqrt()
    };
    let differences = [1e3, 1e4, 1e5].map(difference);
    // The lost motion is g/sigma_0, of first order. After a stop, bristles and hub oscillate with a rate proportional to
    // sigma_0^(-1/2), which decays, so that the measured order is between 1/2 and 1.
    for pair in differences.windows(2) {
        let order = (pair[0] / pair[1]).log10();
        assert!(order > 0.5, "{differences:?}");
    }
    assert!(differences[2] < 2e-5, "{differences:?}");
}

/// Computes the friction torque while the hub moves at the prescribed rate `omega`, rad/s. Only the bristles are integrated,
/// by `steps` Runge–Kutta steps of `h` seconds. Returns the rate, the friction torque and the dissipated power after each
/// step.
fn driven(
    p: &Parameters,
    omega: impl Fn(f64) -> f64,
    h: f64,
    steps: usize,
) -> Vec<(f64, f64, f64)> {
    let inputs = torque(0.0);
    let mut plant = Plant::new(p, &inputs, 0.0, TOLERANCE).unwrap();
    let mut z = 0.0;
    let mut all = Vec::new();
    for k in 0..steps {
        let t = k as f64 * h;
        let mut rate = |t: f64, z: f64| {
            let mut x = [0.0; STATES];
            (x[x::OMEGA], x[x::BRISTLE]) = (omega(t), z);
            plant.set_continuous_states(&x);
            plant.take_event(&inputs).unwrap();
            plant.derivatives(&inputs)[x::BRISTLE]
        };
        let k1 = rate(t, z);
        let k2 = rate(t + h / 2.0, z + h / 2.0 * k1);
        let k3 = rate(t + h / 2.0, z + h / 2.0 * k2);
        let k4 = rate(t + h, z + h * k3);
        z += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
        rate(t + h, z);
        let o = plant.outputs_held(&inputs);
        all.push((o.omega, o.tau_friction, o.power_dissipated));
    }
    all
}

#[test]
fn the_bristle_force_of_lugre_friction_from_rest_follows_dahls_curve() {
    // The hub moves slowly from rest, so that g stays c + d and F = g (1 - exp(-sigma_0 x/g)).
    let mut p = bench(SloshModel::Frozen);
    p.friction.sigma1 = 0.0;
    p.friction.b = 0.0;
    let (rate, h) = (1e-6, 0.01);
    let all = driven(&p, |_| rate, h, 2000);
    for (k, (_, friction, _)) in all.iter().enumerate() {
        let x = rate * h * (k + 1) as f64;
        let dahl = G_MAX * (1.0 - (-p.friction.sigma0 * x / G_MAX).exp());
        // The errors are (w/w_s)^2 = 1e-10 of d, and (sigma_0 w h/g)^4/120 in each step.
        assert!((friction + dahl).abs() < 1e-9 * G_MAX, "{k}: {friction} {dahl}");
    }
}

/// Before a hub with LuGre friction slides, its friction torque as a function of the deflection is a hysteresis loop, which
/// is closed from the second cycle on.
#[test]
fn lugre_friction_before_sliding_follows_a_closed_hysteresis_loop() {
    let mut p = bench(SloshModel::Frozen);
    p.friction.sigma1 = 0.0;
    p.friction.b = 0.0;
    // The amplitude is 3 µrad, half of the deflection at g_max, and the phase advances slowly, by 0.1 rad/s.
    let (amplitude, frequency) = (3e-6, 0.1);
    let period = core::f64::consts::TAU / frequency;
    let steps = 4000;
    let h = period / steps as f64;
    let rate = |t: f64| amplitude * frequency * libm::cos(frequency * t);
    let all = driven(&p, rate, h, 3 * steps);
    let cycle = |n: usize| &all[n * steps..(n + 1) * steps];
    // The loop is closed from the second cycle on.
    let (second, third) = (cycle(1), cycle(2));
    let gap = second.iter().zip(third).map(|(a, b)| (a.1 - b.1).abs()).fold(0.0, f64::max);
    assert!(gap < 0.02 * G_MAX, "{gap}");
    // The area of the loop, by the trapezoidal rule, is the energy that the bristles dissipate, and is positive.
    let area: f64 = third.iter().map(|(w, friction, _)| -w * friction * h).sum();
    let dissipated: f64 = third.iter().map(|(.., power)| power * h).sum();
    assert!(area > 0.05 * amplitude * G_MAX, "{area}");
    assert!((area / dissipated - 1.0).abs() < 0.02, "{area} {dissipated}");
    // Before sliding the friction torque is always smaller than during sliding.
    assert!(third.iter().all(|(_, friction, _)| friction.abs() < 0.8 * G_MAX));
}

/// Returns the lag of the friction: the torque at the mean rate while the rate rises, minus the torque at this rate while it
/// falls, N m. The rate oscillates with `frequency`, rad/s.
fn lag(frequency: f64) -> f64 {
    let mut p = bench(SloshModel::Frozen);
    // Only the Stribeck effect is left: the rate is within w_s, and there is no viscous friction.
    (p.friction.b, p.friction.sigma1, p.friction.sigma0) = (0.0, 0.0, 10.0);
    let (mean, amplitude) = (0.08, 0.05);
    let rate = |t: f64| mean + amplitude * libm::sin(frequency * t);
    let steps = 20_000;
    let h = core::f64::consts::TAU / frequency / steps as f64;
    let all = driven(&p, rate, h, 2 * steps);
    // Both instants have the mean rate: it rises at the end of the first period, and falls half a period later.
    -all[steps - 1].1 + all[steps - 1 + steps / 2].1
}

#[test]
fn lugre_friction_lags_behind_the_rate_the_more_the_faster_the_rate_changes() {
    let [slow, middle, fast] = [1.0, 4.0, 16.0].map(lag);
    // The friction is larger while the rate rises than while it falls, because Stribeck's curve falls with the rate.
    assert!(slow > 0.0 && middle > 2.0 * slow && fast > 2.0 * middle, "{slow} {middle} {fast}");
    assert!(fast < 0.002423, "the lag must be within the range of Stribeck's curve");
}

#[test]
fn lugre_friction_breaks_away_at_less_torque_the_faster_the_torque_rises() {
    // As in figure 4 of Canudas de Wit et al. w_s is as small as theirs, so that the rate passes w_s while
    // the bristles still deflect.
    let break_away = |slope: f64| {
        let mut p = bench(SloshModel::Frozen);
        (p.friction.sigma0, p.friction.omega_s) = (10.0, 1e-3);
        let mut plant = Plant::new(&p, &torque(0.0), 0.0, TOLERANCE).unwrap();
        let mut inputs = torque(0.0);
        inputs.tau_cmd.slope = slope;
        let mut largest: f64 = 0.0;
        // This is ten times the deflection g_max/sigma_0.
        while plant.continuous_states()[x::THETA] < 6e-3 {
            plant.step(&inputs, 1e-5 / slope).unwrap();
            inputs.tau_cmd.value += 1e-5;
            let viscous = p.friction.b * plant.omega();
            largest = largest.max(-plant.outputs(&inputs).tau_friction - viscous);
        }
        largest
    };
    let [slow, middle, fast] = [1e-4, 1e-3, 1e-2].map(break_away);
    assert!(slow < 1.001 * G_MAX && slow > 0.9 * G_MAX, "{slow}");
    assert!(middle < 0.95 * slow && fast < 0.95 * middle, "{slow} {middle} {fast}");
    assert!(fast > 0.003498 * 0.99, "the torque must not fall below Coulomb friction: {fast}");
}

/// A torque of 2 mN·m, less than the break-away torque, turns the hub by torque divided by bristle stiffness.
#[test]
fn a_lugre_hub_below_break_away_torque_stays_at_a_deflection() {
    let mut p = bench(SloshModel::Frozen);
    p.friction.sigma0 = 200.0;
    let mut plant = Plant::new(&p, &torque(0.0), 0.0, TOLERANCE).unwrap();
    plant.step(&torque(0.002), 200.0).unwrap();
    let o = plant.outputs(&torque(0.002));
    assert!(o.omega.abs() < 1e-8, "{}", o.omega);
    assert!((o.tau_friction + 0.002).abs() < 1e-7, "{}", o.tau_friction);
    assert!((plant.continuous_states()[x::BRISTLE] - 0.002 / 200.0).abs() < 1e-9);
    // At first the hub is at rest under a torque that falls from 0. The contact must have the direction of the
    // following motion at once.
    let mut plant = Plant::new(&p, &torque(0.0), 0.0, TOLERANCE).unwrap();
    let mut mirrored = plant.clone();
    let ramp = |slope| Inputs { tau_cmd: Ramp { value: 0.0, slope }, ..Inputs::default() };
    plant.step(&ramp(0.01), 2.0).unwrap();
    mirrored.step(&ramp(-0.01), 2.0).unwrap();
    assert_eq!(plant.omega(), -mirrored.omega());
}

#[test]
fn internal_steps_are_shorter_with_stiffer_lugre_bristles() {
    // The hub slides at 0.05 rad/s for 1 s, with relaxation times from 0.1 s to 0.1 ms. The number of internal steps grows
    // with the stiffness, by at most about one per ten relaxation times.
    for sigma0 in [1.0, 100.0, 10_000.0] {
        let mut p = bench(SloshModel::Frozen);
        p.friction.sigma0 = sigma0;
        let relaxations = sigma0 * 0.1 / 0.0035;
        p.solver.max_steps = 50 + relaxations as usize;
        p.init.omega = 0.05;
        let mut plant = Plant::new(&p, &torque(0.006), 0.0, TOLERANCE).unwrap();
        plant.step(&torque(0.006), 1.0).unwrap();
    }
}

#[test]
fn a_model_exchange_host_that_locates_reversals_reproduces_co_simulation_with_lugre_friction() {
    let mut p = bench(SloshModel::Spherical);
    p.friction.sigma0 = 30.0;
    p.init.slosh_angle = 0.1;
    let inputs = torque(0.004);
    let mut plant = Plant::new(&p, &inputs, 0.0, 1e-12).unwrap();
    let mut own = plant.clone();
    let step = |plant: &mut Plant, h: f64| {
        let x = *plant.continuous_states();
        let mut derivatives = |direction: &[f64; STATES], s: f64| {
            plant.set_continuous_states(&core::array::from_fn(|i| x[i] + s * direction[i]));
            plant.derivatives(&inputs)
        };
        let k1 = derivatives(&[0.0; STATES], 0.0);
        let k2 = derivatives(&k1, h / 2.0);
        let k3 = derivatives(&k2, h / 2.0);
        let k4 = derivatives(&k3, h);
        let mean = core::array::from_fn(|i| (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0);
        derivatives(&mean, h);
    };
    let (h, end): (f64, f64) = (1e-4, 2.0);
    let mut t = 0.0;
    let mut events = 0;
    while t < end {
        let length = h.min(end - t);
        let before = plant.clone();
        step(&mut plant, length);
        let (mut low, mut high) = (0.0, length);
        if plant.event_indicators(&inputs)[indicator::REST] < 0.0 {
            for _ in 0..60 {
                let middle = (low + high) / 2.0;
                plant = before.clone();
                step(&mut plant, middle);
                if plant.event_indicators(&inputs)[indicator::REST] < 0.0 {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            plant = before;
            step(&mut plant, high);
            events += 1;
        }
        t += high;
        plant.set_time(t, Some(t), 0.0);
        plant.take_event(&inputs).unwrap();
    }
    own.step(&inputs, end).unwrap();
    assert!(events > 3);
    assert_eq!(plant.last_contact().0, own.last_contact().0, "the numbers of reversals differ");
    let (a, b): (Outputs, Outputs) = (plant.outputs(&inputs), own.outputs(&inputs));
    // The error of the Runge-Kutta method is (lambda h)^4 with lambda = sigma_0 w/g of at most 1000 1/s.
    assert!((a.omega - b.omega).abs() < 1e-8, "{} {}", a.omega, b.omega);
    assert!((a.heat - b.heat).abs() < 1e-8 && (a.energy - b.energy).abs() < 1e-8);
}

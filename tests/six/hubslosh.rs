//! Motion about one axis: Spacecraft.fmu and SloshTank.fmu compared with HubSlosh.fmu's spherical model.

use craft::{Inertia, Inputs, Parameters, Ramp, Tank, TankInputs, TankParameters};
use host::fmi2::{Fmu, Instance};

use super::component::{SloshTank, Spacecraft, load};

const KNOT: f64 = 0.01;
const G: f64 = 9.81;

/// Returns the torque on the hub between the instants `k` and `k` + 1 of the table, N m, and its slope. The torque makes the
/// liquid swing to about 30 degrees.
fn torque(k: usize) -> (f64, f64) {
    let at = |k: usize| 1.5 * f64::sin(13.0 * k as f64 * KNOT);
    (at(k), (at(k + 1) - at(k)) / KNOT)
}

const ANGLES: [f64; 2] = [-0.1, 0.2];
const RATES: [f64; 2] = [0.5, 0.3];

fn bench(fmu: &Fmu) -> Instance<'_> {
    let mut bench = fmu.instantiate("bench").unwrap();
    for (name, value) in [
        ("slosh.model", "spherical".to_string()),
        ("friction.model", "none".into()),
        ("slosh.zeta_from_correlation", "false".into()),
        ("slosh.zeta", "0.02".into()),
        ("tank.I_own", "0.002".into()),
        ("g_axial", G.to_string()),
        ("init.slosh_angle", ANGLES[0].to_string()),
        ("init.slosh_angle_radial", ANGLES[1].to_string()),
        ("init.slosh_rate", RATES[0].to_string()),
        ("init.slosh_rate_radial", RATES[1].to_string()),
    ] {
        bench.set(name, &value).unwrap();
    }
    bench.setup_experiment(Some(1e-12), 0.0, None).unwrap();
    bench.enter_initialization_mode().unwrap();
    bench.exit_initialization_mode().unwrap();
    bench
}

fn step(bench: &mut Instance, k: usize) {
    let (tau, slope) = torque(k);
    let reference = [bench.fmu().description().variable("tau_cmd").unwrap().reference];
    bench.set_real(&reference, &[tau]).unwrap();
    bench.set_real_input_derivatives(&reference, &[1], &[slope]).unwrap();
    bench.do_step(k as f64 * KNOT, KNOT).unwrap();
}

/// Returns the tank of the bench: upright, on the x axis. For motion about one axis its heights and its inertia I_0 have no
/// effect.
fn tank(bench: &mut Instance) -> Tank {
    let mut get = |name: &str| bench.real(name).unwrap();
    let mut tank = Tank {
        position: [get("tank.r"), 0.0, 0.3],
        m_0: get("tank.m_0"),
        h_0: -0.04,
        i_0: 0.01,
        i_z: get("tank.I_own"),
        modes: 1,
        g_ref: G,
        ..Tank::default()
    };
    (tank.mass[0], tank.length[0], tank.hinge[0]) =
        (get("slosh.mass[1]"), get("slosh.length[1]"), 0.02);
    tank.zeta[0] = get("slosh.damping[1]");
    // The wave height per slosh angle in a cylinder is 2 R/(xi_1^2 - 1).
    tank.wave[0] = get("tank.d") / (1.841_183_781_340_659_5_f64.powi(2) - 1.0);
    let [y, x] = ANGLES.map(f64::sin);
    let [y_dot, x_dot] = [0, 1].map(|i| ANGLES[i].cos() * RATES[i]);
    let z = -f64::sqrt(1.0 - x * x - y * y);
    tank.p_0[0] = [x, y, z];
    tank.p_dot_0[0] = [x_dot, y_dot, -(x * x_dot + y * y_dot) / z];
    tank
}

#[track_caller]
fn assert_close(got: f64, want: f64, allowed: f64, what: &str) {
    assert!((got - want).abs() < allowed, "{what}: {got} {want}");
}

/// A craft with a mass of 1e11 kg, and with large moments of inertia about all axes but one, moves almost only about this
/// axis. Its other motion is inversely proportional to the mass.
#[test]
fn spacecraft_that_can_turn_about_one_axis_only_moves_like_hubslosh() {
    let fmu = load("HubSlosh");
    for (mass, allowed) in [(1e9, 1e-7), (1e11, 1e-9)] {
        let mut bench = bench(&fmu);
        let mut p = Parameters { tanks: 1, ..Parameters::default() };
        let i_hub = bench.real("hub.I").unwrap();
        (p.craft.mass, p.craft.r) = (mass, [0.0; 3]);
        p.craft.j = Inertia { xx: mass, yy: mass, zz: i_hub, xy: 0.0, xz: 0.0, yz: 0.0 };
        p.tank[0] = tank(&mut bench);
        let force = Ramp::held([0.0, 0.0, (mass + p.tank[0].mass[0] + p.tank[0].m_0) * G]);
        let input = |k: usize| {
            let (tau, slope) = torque(k);
            let torque = Ramp { value: [0.0, 0.0, tau], slope: [0.0, 0.0, slope] };
            Inputs { force, torque, ..Inputs::default() }
        };
        let mut craft = Spacecraft::new(&p, &input(0), 0.0, 1e-12).unwrap();
        let mut most = 0.0_f64;
        for k in 0..2000 {
            step(&mut bench, k);
            craft.step(&input(k), KNOT).unwrap();
            let out = craft.outputs_after_step();
            most = most.max(out.tank[0].angle_y[0].abs());
            for (name, got) in [
                ("omega", out.omega[2]),
                ("slosh_angle", out.tank[0].angle_y[0]),
                ("slosh_angle_radial", out.tank[0].angle_x[0]),
                ("wave_height", out.tank[0].wave_height),
            ] {
                assert_close(got, bench.real(name).unwrap(), allowed, name);
            }
            // The errors are relative to accelerations and torques of some 10 N m/(kg m2) and 2 N m.
            let [omega_dot, tau] = ["omega_dot", "tau_fluid"].map(|name| bench.real(name).unwrap());
            assert_close(out.omega_dot[2], omega_dot, 10.0 * allowed, "omega_dot");
            assert_close(out.slosh_torque[2], tau, 10.0 * allowed, "tau_fluid");
        }
        // The motion must be clearly nonlinear.
        assert!(most > 0.3, "{most}");
    }
}

/// The hub that carries the tank is simulated here. In every stage of the integrator it solves I_hub w' = tau + bias_6 -
/// M_a,6 [0, 0, g, 0, 0, w'], with row 6 of the tank's bias and added mass. The error of Runge–Kutta at 0.25 ms, (15 h)^4/120
/// of the motion per radian, is 1e-11 after five seconds.
#[test]
fn sloshtank_on_a_simulated_hub_moves_like_hubslosh() {
    const STEPS: usize = 40;
    let fmu = load("HubSlosh");
    let mut bench = bench(&fmu);
    let i_hub = bench.real("hub.I").unwrap();
    let p = TankParameters { tank: tank(&mut bench), ..TankParameters::default() };
    let mut tank = SloshTank::new(&p, &TankInputs::default(), 0.0, 1e-9).unwrap();
    let start = tank.continuous_states();
    let mut x = [0.0; 7];
    x[1..].copy_from_slice(&start[..6]);
    let mut rates = |x: &[f64; 7], tau: f64| {
        let mut states = start;
        states[..6].copy_from_slice(&x[1..]);
        tank.set_continuous_states(&states);
        let a = Ramp::held([0.0, 0.0, G]);
        let mut u = TankInputs { a, omega: [0.0, 0.0, x[0]], ..TankInputs::default() };
        let out = tank.outputs(&u);
        // These are elements 36 and 66 of M_a; the upper triangle is stored in row-major order.
        let (m_36, m_66) = (out.added_mass[14], out.added_mass[20]);
        let w_d = (tau + out.bias[5] - m_36 * G) / (i_hub + m_66);
        u.omega_dot = Ramp::held([0.0, 0.0, w_d]);
        let d = tank.derivatives(&u);
        [w_d, d[0], d[1], d[2], d[3], d[4], d[5]]
    };
    let h = KNOT / STEPS as f64;
    for k in 0..500 {
        let (from, slope) = torque(k);
        for j in 0..STEPS {
            let tau = |share: f64| from + slope * (j as f64 + share) * h;
            let at = |x: &[f64; 7], d: &[f64; 7], h: f64| -> [f64; 7] {
                std::array::from_fn(|i| x[i] + h * d[i])
            };
            let k1 = rates(&x, tau(0.0));
            let k2 = rates(&at(&x, &k1, h / 2.0), tau(0.5));
            let k3 = rates(&at(&x, &k2, h / 2.0), tau(0.5));
            let k4 = rates(&at(&x, &k3, h), tau(1.0));
            for i in 0..7 {
                x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
        }
        step(&mut bench, k);
    }
    for (name, got) in
        [("omega", x[0]), ("slosh_angle", x[2].asin()), ("slosh_angle_radial", x[1].asin())]
    {
        assert_close(got, bench.real(name).unwrap(), 1e-9, name);
    }
}

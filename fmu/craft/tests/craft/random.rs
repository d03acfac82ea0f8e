//! Random craft, states and inputs, with the sizes of real spacecraft.

use craft::{
    APPENDAGES, Craft, DampingLaw, FillTable, Inertia, Init, Inputs, Line, Mount, POINTS,
    Parameters, Pivot, PivotFriction, Ramp, TANKS, Tank,
};

pub struct Random(fastrand::Rng);

impl Random {
    pub fn new(seed: u64) -> Random {
        Random(fastrand::Rng::with_seed(seed))
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.f64()
    }

    pub fn magnitude(&mut self, low: f64, high: f64) -> f64 {
        low * f64::powf(high / low, self.0.f64())
    }

    pub fn below(&mut self, n: usize) -> usize {
        self.0.usize(..n)
    }

    pub fn vector<const N: usize>(&mut self, size: f64) -> [f64; N] {
        [(); N].map(|()| self.between(-size, size))
    }

    /// Returns a random tank. Half of the bobs have centring stiffness, and a third have no damping. The drag depends
    /// neither on acceleration nor on amplitude.
    pub fn tank(&mut self) -> Tank {
        let mut tank = Tank {
            position: self.vector(0.8),
            q: self.vector(1.0),
            m_0: self.magnitude(10.0, 300.0),
            h_0: self.between(-0.2, 0.2),
            i_0: self.between(0.0, 5.0),
            i_z: self.between(0.0, 2.0),
            modes: 1 + self.below(3),
            g_ref: 1.5,
            damping_law: DampingLaw::Constant,
            ..Tank::default()
        };
        for n in 0..tank.modes {
            tank.mass[n] = self.magnitude(0.5, 150.0);
            tank.length[n] = self.magnitude(0.05, 0.5);
            tank.hinge[n] = self.between(-0.3, 0.5);
            tank.k[n] = [0.0, tank.mass[n] * self.between(0.1, 5.0)][self.below(2)];
            tank.zeta[n] = [0.0, self.magnitude(0.001, 0.1), 0.02][self.below(3)];
            let [x, y] = self.vector(0.7);
            tank.p_0[n] = [x, y, -1.0];
            tank.p_dot_0[n] = self.vector(1.0);
        }
        tank
    }

    /// Makes the drag of a tank's bobs depend on acceleration and amplitude; the damping law is chosen at random. Half of the
    /// bobs have drag that grows with the amplitude, and half of these have breaking waves.
    pub fn follow(&mut self, tank: &mut Tank) {
        tank.damping_law = DampingLaw::ALL[self.below(3)];
        // Under reversed thrust a_+ has a corner, which this g_floor rounds so widely that finite differences resolve it.
        tank.g_floor = self.between(0.3, 1.0);
        for growth in &mut tank.zeta_amplitude {
            *growth = [0.0, self.between(0.0, 0.1)][self.below(2)];
        }
        for (n, growth) in tank.zeta_amplitude.iter_mut().enumerate() {
            if *growth > 0.05 {
                // The coefficient of the damping by breaking waves is 0.025 to 0.05, and the steepness at which they break is 0
                // to 0.5. Every second of these modes has no amplitude damping below this steepness.
                (tank.zeta_breaking[n], tank.breaking_steepness[n]) =
                    (0.5 * *growth, 10.0 * (*growth - 0.05));
                *growth *= f64::from((*growth * 1e6) as u32 % 2);
            }
        }
    }

    pub fn make_all_planar(&mut self, p: &mut Parameters) {
        p.tanks = p.tanks.max(1);
        p.tank.iter_mut().for_each(|tank| self.make_planar(tank));
    }

    pub fn bend_all(&mut self, p: &mut Parameters) {
        p.tanks = p.tanks.max(1);
        p.tank.iter_mut().for_each(|tank| self.bend(tank));
        p.tank.iter_mut().for_each(|tank| self.bend_further(tank));
    }

    /// Gives the bobs of a tank that does not drain coefficients beyond the third order, and in modes with rotary motion
    /// also rotary inertia. The inertia is positive at every angle.
    pub fn bend_further(&mut self, tank: &mut Tank) {
        if tank.fill.points > 0 {
            return;
        }
        for n in 0..craft::MODES {
            tank.nonlinear_inertia_2[n] = self.between(-0.1, 1.0);
            tank.nonlinear_stiffness_2[n] = self.between(-0.5, 1.0);
            let rotary = [self.between(0.0, 1.5), self.between(-0.3, 0.5)];
            if tank.direction[n] == [0.0; 2] {
                [tank.rotary_inertia[n], tank.rotary_inertia_2[n]] = rotary;
            }
        }
    }

    pub fn spin_all(&mut self, p: &mut Parameters) {
        p.tanks = p.tanks.max(1);
        p.tank.iter_mut().for_each(|tank| self.spin(tank));
    }

    pub fn spin(&mut self, tank: &mut Tank) {
        tank.spin_inertia = self.magnitude(0.5, 50.0);
        tank.spin_inertia_across = [0.0, self.magnitude(0.5, 50.0)][self.below(2)];
        tank.spin_coupling = self.between(0.2, 1.0);
        tank.spin_decay = [[0.0; 2], [0.3, 0.1]][self.below(2)];
        tank.slip_0 = self.vector(2.0);
        for n in 0..craft::MODES {
            let coefficients = [self.between(0.3, 1.3), self.between(-0.5, 0.5)];
            if tank.direction[n] == [0.0; 2] && self.below(3) > 0 {
                [tank.gyroscopic[n], tank.gyroscopic_stiffness[n]] = coefficients;
            }
        }
    }

    pub fn bend(&mut self, tank: &mut Tank) {
        for s in &mut tank.nonlinear_inertia {
            *s = self.between(0.7, 2.5);
        }
        for kappa in &mut tank.nonlinear_stiffness {
            *kappa = self.between(0.3, 2.5);
        }
    }

    pub fn bend_by_fill(&mut self, tank: &mut Tank) {
        let FillTable { nonlinear_inertia, nonlinear_stiffness, .. } = &mut tank.fill;
        nonlinear_inertia.as_flattened_mut().fill_with(|| self.between(0.7, 2.5));
        nonlinear_stiffness.as_flattened_mut().fill_with(|| self.between(0.3, 2.5));
    }

    /// Makes a tank asymmetric: two thirds of its modes are planar, and the mass of its rigid liquid is smaller than the
    /// mass of these modes.
    pub fn make_planar(&mut self, tank: &mut Tank) {
        let bobs: f64 = tank.mass[..tank.modes].iter().sum();
        tank.m_0 = f64::max(tank.m_0 * self.between(-0.1, 1.0), -0.5 * bobs);
        tank.i_0 = self.between(-1.0, 5.0);
        (tank.r_0, tank.di_y) = (self.vector(0.1), self.between(-2.0, 2.0));
        tank.products = self.vector(0.5);
        for n in 0..tank.modes {
            if self.below(3) > 0 {
                tank.direction[n] = self.vector(2.0);
                tank.arm[n] = self.between(-0.3, 0.3);
            }
        }
        // At least one mode is planar, which allows a negative m_0.
        if tank.direction[0] == [0.0; 2] {
            tank.direction[0] = [0.0, 1.0];
        }
    }

    pub fn parameters(&mut self) -> Parameters {
        let mass = self.magnitude(150.0, 3000.0);
        let size = mass * self.between(0.3, 1.0);
        let j = Inertia {
            xx: size * self.between(0.8, 1.2),
            yy: size * self.between(0.8, 1.2),
            zz: size * self.between(0.8, 1.2),
            xy: size * self.between(-0.05, 0.05),
            xz: size * self.between(-0.05, 0.05),
            yz: size * self.between(-0.05, 0.05),
        };
        Parameters {
            craft: Craft { mass, r: self.vector(0.3), j },
            mount: Mount::Free,
            gravity: [0.3, -0.2, -9.81],
            tanks: self.below(TANKS + 1),
            tank: [(); TANKS].map(|()| self.tank()),
            init: Init {
                q: self.vector(1.0),
                omega: self.vector(0.4),
                position: self.vector(10.0),
                velocity: self.vector(2.0),
            },
            ..Parameters::default()
        }
    }

    /// Gives a craft up to six modes of appendages, below 2 Hz. Each mode participates with at most a tenth of the mass and
    /// inertia of the craft. The initial deflections are larger than a real appendage could have.
    pub fn flex(&mut self, p: &mut Parameters) {
        let (mass, moment) = (p.craft.mass.sqrt(), p.craft.j.xx.min(p.craft.j.zz).sqrt());
        p.appendages = 1 + self.below(APPENDAGES);
        for appendage in &mut p.appendage[..p.appendages] {
            let [along, about]: [[f64; 3]; 2] =
                [self.vector(0.1 * mass), self.vector(0.1 * moment)];
            appendage.participation[..3].copy_from_slice(&along);
            appendage.participation[3..].copy_from_slice(&about);
            appendage.position = self.vector(0.6);
            appendage.frequency = self.magnitude(0.2, 2.0);
            appendage.zeta = [0.0, self.magnitude(0.001, 0.1)][self.below(2)];
            appendage.eta = self.between(-0.1, 0.1) * mass;
            appendage.eta_dot = self.between(-0.3, 0.3) * mass;
        }
    }

    pub fn pivot(&mut self) -> Pivot {
        let k = [(); 2].map(|()| self.magnitude(1e2, 1e4));
        let mut torques = || [(); 3].map(|()| self.magnitude(0.1, 10.0));
        let (c, d) = (torques(), torques());
        // The Stribeck curve is so wide that finite differences and sums over time resolve it; narrow curves
        // are tested in tilting.rs.
        let friction = PivotFriction { c, d, omega_s: 2.0, eps: 0.5 };
        Pivot { k, c: [(); 3].map(|()| self.magnitude(1.0, 100.0)), friction }
    }

    pub fn inputs(&mut self) -> Inputs {
        let mut ramp = |size: f64| Ramp { value: self.vector(size), slope: self.vector(size) };
        Inputs {
            force: ramp(1000.0),
            torque: ramp(100.0),
            h_wheels: ramp(20.0),
            ..Inputs::default()
        }
    }
}

/// Returns a tank with a fill table: an upright cylinder of 0.45 m radius with `modes` modes, rotated and off the craft's
/// centre. If the number of modes is odd, the table contains damping ratios.
pub fn draining_tank(random: &mut Random, modes: usize) -> Tank {
    let mut tank = Tank { modes, diameter: 0.0, ..random.tank() };
    let mut table = FillTable { points: POINTS, ..tank.fill };
    for i in 0..POINTS {
        let depth = 0.15 + 0.1 * i as f64;
        let liquid = 1000.0 * std::f64::consts::PI * 0.45 * 0.45 * depth;
        table.liquid[i] = liquid;
        // By potential flow the first mode of a half-full tank contains some 40 % of the liquid, and less in a fuller tank.
        let mut left = liquid;
        for n in 0..modes {
            let xi = [1.8412, 5.3314, 8.5363][n];
            let tanh = f64::tanh(xi * depth / 0.45);
            table.mass[n][i] = liquid * 0.9 * tanh / (xi * (xi * xi - 1.0) * depth);
            table.length[n][i] = 0.45 / (xi * tanh);
            table.hinge[n][i] = depth - 0.2 * tanh;
            table.zeta[n][i] = if modes % 2 == 1 { 0.004 * (n + 1) as f64 / depth } else { 0.0 };
            left -= table.mass[n][i];
        }
        table.h_0[i] = 0.45 * depth;
        table.i_0[i] = left * (0.05 + 0.08 * depth * depth);
        table.i_z[i] = 0.01 * left;
    }
    tank.fill = table;
    tank.liquid_0 = 400.0;
    tank.outlet = -0.05;
    tank
}

/// Returns a craft with one to three draining tanks and one tank that does not drain. From seed 20 on the bobs move on
/// surfaces other than spheres, and from seed 40 on these surfaces depend on the fill.
pub fn draining_craft(seed: u64, modes: usize) -> (Parameters, Inputs) {
    let mut random = Random::new(seed);
    let mut p = random.parameters();
    p.tanks = 2 + seed as usize % 3;
    p.tank = [(); 4].map(|()| draining_tank(&mut random, modes));
    p.tank[p.tanks - 1] = random.tank();
    if seed >= 20 {
        random.bend_all(&mut p);
    }
    if seed >= 40 {
        p.tank.iter_mut().for_each(|tank| random.bend_by_fill(tank));
    }
    let mut u = random.inputs();
    u.force.value[2] += 2.0 * p.craft.mass;
    for flow in &mut u.mass_flow[..p.tanks - 1] {
        *flow = Line { value: random.between(1.0, 5.0), slope: random.between(-2.0, 4.0) };
    }
    (p, u)
}

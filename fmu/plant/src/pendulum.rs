use alloc::format;
use alloc::string::String;

use taylor::number::Number;
use taylor::series::{Series, ZERO, mul, mul_ramp, values};

use crate::amplitude::Growth;
use crate::baffle::Baffle;
use crate::parameters::Init;

/// Angle, rad, by which the start values of mode 1 may deviate from the direction in which this mode moves. Smaller
/// deviations count as rounding errors of decimal parameters.
const ALONG: f64 = 1e-6;

/// Largest step as a fraction of the time to the nearest singularity of the drag's power series.
const SHARE_OF_RADIUS: f64 = 0.5;

/// One slosh mode as a pendulum whose hinge is on the tank's axis.
/// - `m`, `l`: slosh mass, kg, and length of the pendulum, m; `inv_l` is 1/l.
/// - `c`: drag coefficient of the slosh mass relative to the tank, N s/m; `c_m` is c/m; `c_0` is the viscous coefficient at
///   the reference specific force; `course` is the drag divided by its value at the start of a power series.
/// - `r`: distance of the hinge from the bearing axis, m.
/// - `along`: radial and tangential component of the unit vector along which a mode moves in models with one direction;
///   `r_x`, `r_t` are r times these components, and `r_l` is r_t/l.
/// - `wave`: elevation of the wave at the wall per slosh angle, m/rad.
/// - `spring`, `s`, `l_s`, `l2_s`: coefficient of the quartic spring, 1/m2, coefficient s of the inertia that grows with the
///   amplitude, l/s and l^2/s; only `third_order.rs` uses them.
/// - `g`: specific force plus the equivalent of surface tension, m/s2, with its rate; `omega_n`: natural frequency, rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pendulum {
    pub m: f64,
    pub l: f64,
    pub c: f64,
    pub c_0: f64,
    pub r: f64,
    pub along: [f64; 2],
    pub r_x: f64,
    pub r_t: f64,
    pub c_m: f64,
    pub r_l: f64,
    pub inv_l: f64,
    pub wave: f64,
    pub spring: f64,
    pub s: f64,
    pub l_s: f64,
    pub l2_s: f64,
    pub g: [f64; 2],
    pub omega_n: f64,
    pub course: Series,
    pub baffle: Baffle,
    pub growth: Growth,
}

impl Default for Pendulum {
    fn default() -> Self {
        Pendulum {
            m: 1.0,
            l: 1.0,
            c: 0.0,
            c_0: 0.0,
            r: 0.0,
            along: [0.0, 1.0],
            r_x: 0.0,
            r_t: 0.0,
            c_m: 0.0,
            r_l: 0.0,
            inv_l: 1.0,
            wave: 0.0,
            spring: 0.0,
            s: 1.0,
            l_s: 1.0,
            l2_s: 1.0,
            g: [0.0; 2],
            omega_n: 0.0,
            course: ZERO,
            baffle: Baffle::default(),
            growth: Growth::default(),
        }
    }
}

impl Pendulum {
    pub fn set_restoring(&mut self, g: [f64; 2]) {
        self.g = g;
        self.omega_n = libm::sqrt(f64::max(g[0], 0.0) / self.l);
    }

    /// Sets the viscous drag coefficient of the slosh mass to `factor` times its value at the reference specific force.
    /// `course` is the series of the coefficient, divided by its value at the start.
    pub fn set_damping(&mut self, factor: f64, course: Series) {
        self.c = factor * self.c_0;
        self.c_m = self.c / self.m;
        self.course = course;
    }

    #[inline(always)]
    pub fn follows_amplitude(&self) -> bool {
        self.baffle.zeta > 0.0 || self.growth.acts
    }

    /// Adds the drag of the baffle, and the drag that grows with the amplitude, to the viscous drag. `at` contains the
    /// squares of the slosh angle and of its rate.
    pub fn add_amplitude_drag(&mut self, at: [f64; 2]) {
        let w = self.g.map(|g| g * self.inv_l);
        if self.baffle.zeta > 0.0 {
            self.c = self.baffle.start(w, at, self.m, self.c, self.course);
        }
        if self.growth.acts {
            self.c = self.growth.start(w, at, self.m, self.c, self.course);
        }
        self.c_m = self.c / self.m;
        self.course[0] = 1.0;
    }

    /// Computes Taylor coefficient n of the drag, which depends on the amplitude. `at` contains coefficient n of the squared
    /// slosh angle and of its squared rate.
    pub fn expand_drag(&mut self, n: usize, at: [f64; 2]) {
        let Pendulum { baffle, growth, .. } = self;
        let other = if baffle.zeta > 0.0 { baffle.expand(n, at) } else { growth.viscous[n] };
        self.course[n] = if growth.acts { growth.expand(n, at, other) } else { other };
    }

    /// Returns the time, s, over which the series of the amplitude-dependent drag converge reliably, from their first three
    /// coefficients.
    pub fn convergence_radius(&self) -> f64 {
        let baffle =
            if self.baffle.zeta > 0.0 { self.baffle.convergence_radius() } else { f64::INFINITY };
        let growth =
            if self.growth.acts { self.growth.convergence_radius() } else { f64::INFINITY };
        SHARE_OF_RADIUS * baffle.min(growth)
    }

    /// Returns the error of the slosh mass's rate, rad/s, `h` seconds after the start of the series, that arises because the
    /// series of the amplitude-dependent drag end at order n.
    pub fn defect(&self, n: usize, h: f64) -> f64 {
        let Pendulum { baffle, growth, course, .. } = self;
        let [mut drag, mut rate2] = [0.0; 2];
        if baffle.zeta > 0.0 {
            [drag, rate2] = baffle.drag_at(n, h);
        }
        if growth.acts {
            let other = if baffle.zeta > 0.0 { drag } else { values([&growth.viscous], n, h)[0] };
            [drag, rate2] = growth.drag_at(n, h, other);
        }
        let off = (drag - values([course], n, h)[0]).abs();
        self.c_m * off * libm::sqrt(rate2) * h
    }

    #[inline(always)]
    pub fn is_askew(&self) -> bool {
        self.along[0] != 0.0
    }

    /// Returns a message if mode 1 cannot start with the displacement and rate in `init`, because the mode moves along one
    /// direction only, and the displacement or the rate has another direction.
    pub fn start_problem(&self, init: &Init) -> Option<String> {
        let [x, t] = self.along;
        let starts = [
            ("angle", "rad", init.slosh_angle_radial, init.slosh_angle),
            ("rate", "rad/s", init.slosh_rate_radial, init.slosh_rate),
        ];
        starts.into_iter().find_map(|(name, unit, radial, tangential)| {
            let size = libm::hypot(radial, tangential);
            let off = libm::fabs(radial * t - tangential * x) > ALONG * size;
            // Start values along the direction of motion with the same magnitude, for the message.
            let along = libm::copysign(size, radial * x + tangential * t);
            (self.is_askew() && off).then(|| {
                format!(
                    "init.slosh_{name} = {tangential:?} {unit} and init.slosh_{name}_radial = {radial:?} {unit} are not along \
                     slosh.table.direction[1] = {:?} rad, the only direction in which mode 1 moves. Set both to 0, or for example \
                     init.slosh_{name} = {:?} and init.slosh_{name}_radial = {:?}",
                    libm::atan2(x, t),
                    along * t,
                    along * x
                )
            })
        })
    }

    #[inline(always)]
    pub fn spread<T: Number>(&self, a: T) -> [T; 2] {
        let [x, t] = self.along;
        if self.is_askew() { [a * x, a * t] } else { [T::constant(0.0), a] }
    }

    /// Converts the angle of the slosh mass along its direction of motion, and the rate of this angle, to coordinates: the
    /// radial and the tangential angle, and their rates.
    #[inline(always)]
    pub fn coordinates(&self, [al, al_d]: [f64; 2]) -> [f64; 4] {
        let [x, t] = self.along;
        if self.is_askew() { [al * x, al * t, al_d * x, al_d * t] } else { [0.0, al, 0.0, al_d] }
    }

    /// Converts coordinates, which are the radial and the tangential angle and their rates, to the angle along the slosh
    /// mass's direction of motion and the rate of this angle.
    #[inline(always)]
    pub fn angle_and_rate(&self, [q_x, q_y, x_d, y_d]: [f64; 4]) -> [f64; 2] {
        let [x, t] = self.along;
        if self.is_askew() { [x * q_x + t * q_y, x * x_d + t * y_d] } else { [q_y, y_d] }
    }

    /// Returns Taylor coefficient n of the component of the vector (`a_x`, `a_t`) along the slosh mass's direction of motion.
    #[inline(always)]
    pub fn component(&self, n: usize, [a_x, a_t]: &[Series; 2]) -> f64 {
        self.along[0] * a_x[n] + self.along[1] * a_t[n]
    }

    #[inline(always)]
    pub fn component_times(&self, n: usize, [a_x, a_t]: &[Series; 2], b: &Series) -> f64 {
        let radial = if self.is_askew() { self.along[0] * mul(n, a_x, b) } else { 0.0 };
        radial + self.along[1] * mul(n, a_t, b)
    }

    /// Returns Taylor coefficient n of a product: the component of the vector (`a_x`, `a_t`) across the slosh mass's
    /// direction of motion, times the series `b`.
    #[inline(always)]
    pub fn across_times(&self, n: usize, [a_x, a_t]: &[Series; 2], b: &Series) -> f64 {
        let tangential = if self.is_askew() { self.along[0] * mul(n, a_t, b) } else { 0.0 };
        self.along[1] * mul(n, a_x, b) - tangential
    }

    pub fn restoring_and_drag<T: Number>(&self) -> [T; 2] {
        [T::with_slope(self.g[0], self.g[1]), T::with_slope(self.c, self.c * self.course[1])]
    }

    #[inline(always)]
    pub fn weight(&self, n: usize, varies: bool, a: &Series) -> f64 {
        if varies { mul_ramp(n, &self.g, a) } else { self.g[0] * a[n] }
    }

    /// Returns Taylor coefficient n of the product of the drag coefficient and the rate `v`. The drag coefficient is divided
    /// by its value at the start of the series; if `varies` is false, this ratio is always 1.
    #[inline(always)]
    pub fn drag(&self, n: usize, varies: bool, v: &Series) -> f64 {
        if varies { mul(n, &self.course, v) } else { v[n] }
    }
}

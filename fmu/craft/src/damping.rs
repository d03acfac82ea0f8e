//! Drag of a slosh mode as a function of the specific force along the tank and of the amplitude.
//!
//! ```text
//! drag on the bob: -c l p',   c = 2 m [ zeta w_ref (w/w_ref)^q + zeta_A w A + zeta_b w f(k a) ]
//! w^2 = a_+/l + k/m,          w_ref: w at a_+ = g_ref
//! a_+ = (x + sqrt(x^2 + a_f^2))/2
//! A^2 = angle^2 + |p'|^2/w^2 + A_0^2,   angle: of the rod from the axis (`taylor::angle`)
//! k a = 2 xi_n/(xi_n^2 - 1) A
//! f(x) = (d + sqrt(d^2 + delta^2))/2 - (-s_b + sqrt(s_b^2 + delta^2))/2,   d = x - s_b
//! ```
//!
//! q depends on the `DampingLaw`: 1/2 for a laminar layer at the wall, 1 for a constant damping ratio, 0 for a constant c. x is
//! the specific force along the tank's axis at the hinge. SloshTank computes x from the given motion of its tank, Spacecraft from
//! the motion of craft and liquids as one rigid body (`motion.rs`). The drag of the bobs would change x by about 1e-4, but x
//! would then be the solution of an equation. a_+ equals x if thrust presses the liquid to the tank's bottom, falls smoothly to 0
//! if thrust pulls the tank away, and is a_f/2 without thrust. With zeta_A the damping ratio grows with the amplitude A, as zeta
//! + zeta_A A. A_0 is far below any motion of interest and keeps the root analytic.
//!
//! Breaking waves dissipate in proportion to max(0, k a - s_b). k a is the steepness: wave number times elevation at the
//! wall. In an upright cylinder k = xi_n/R, and the elevation per slosh angle is 2 R/(xi_n^2 - 1), at any depth
//! (`formulas::cylinder`). A tank of another shape has no parameter for its wave number, and its `wave` may be 0. Therefore
//! every mode of every tank uses the cylinder's steepness per angle, which is 1.54 for mode 1, and s_b refers to this
//! steepness. For a box, where k a = 4/pi A, a measured s_b has to be multiplied by 1.21. f is the function max(0, x - s_b)
//! with its corner rounded over delta and shifted so that f(0) = 0. Written as
//!
//! ```text
//! f(x) = x [1 + (x - 2 s_b)/(sqrt(d^2 + delta^2) + sqrt(s_b^2 + delta^2))]/2
//! ```
//!
//! f is never negative, not even by rounding. Since every part of c is positive or 0, the drag never drives the motion.
//!
//! Source: peaks of forced waves in a box, measured by Baeuerlein and Avila. To reproduce the peaks at k a = 0.22, 0.40,
//! 0.66 and 0.81 the damping ratio must be 0.0079, 0.0082, 0.0091 and 0.0142. This gives s_b from 0.60 to 0.66 and zeta_b of
//! about 0.04; other records give 0.03 to 0.09.

use taylor::angle::{self, SquaredAngle};
use taylor::number::Number;
use taylor::series::{Series, ZERO, constant, mul, mul_tail, sqrt, time_within, values};

use crate::parameters::{DampingLaw, Tank};
use formulas::cylinder::XI;

const SMALLEST: f64 = 1e-4;

const CORNER: f64 = 0.02;

/// Damping of a mode by breaking waves: zeta_b, the steepness s_b at which breaking `begins`, `root` = sqrt(s_b^2 +
/// delta^2), and the steepness per amplitude, k a/A, 1/rad.
#[derive(Clone, Copy, Debug)]
struct Breaking {
    zeta: f64,
    begins: f64,
    root: f64,
    steepness: f64,
}

impl Breaking {
    fn new(tank: &Tank, n: usize) -> Option<Breaking> {
        let begins = tank.breaking_steepness[n];
        (tank.zeta_breaking[n] > 0.0).then(|| Breaking {
            zeta: tank.zeta_breaking[n],
            begins,
            root: libm::sqrt(begins * begins + CORNER * CORNER),
            steepness: 2.0 * XI[n] / (XI[n] * XI[n] - 1.0),
        })
    }
}

/// Largest step of the solver as a fraction of the estimated radius of convergence of a power series.
const SHARE_OF_RADIUS: f64 = 0.5;

/// Power series of the additional damping by breaking waves, w f(k a).
#[derive(Clone, Debug)]
struct Excess {
    law: Breaking,
    w: Series,
    above: Series,
    root: Series,
    steep: Series,
    divisor: Series,
    quotient: Series,
}

impl Excess {
    fn new(law: Breaking) -> Excess {
        let [w, above, root, steep, divisor, quotient] = [ZERO; 6];
        Excess { law, w, above, root, steep, divisor, quotient }
    }

    /// Returns coefficient n of the damping by breaking waves, from the coefficients n of w^2 (squared natural
    /// frequency) and of w A (frequency times amplitude).
    fn expand(&mut self, n: usize, w2: f64, speed: f64) -> f64 {
        let Breaking { begins, steepness, .. } = self.law;
        self.w[n] = sqrt(n, w2, &self.w);
        self.steep[n] = steepness * speed;
        self.above[n] = self.steep[n] - begins * self.w[n];
        let square = mul(n, &self.above, &self.above) + CORNER * CORNER * w2;
        self.root[n] = sqrt(n, square, &self.root);
        self.divisor[n] = self.root[n] + self.law.root * self.w[n];
        let over = self.above[n] - begins * self.w[n];
        self.quotient[n] = if n == 0 {
            over / self.divisor[0]
        } else {
            (over - mul_tail(n, &self.divisor, &self.quotient)) / self.divisor[0]
        };
        if n == 0 {
            return 0.5 * self.steep[0] * (1.0 + self.quotient[0]);
        }
        0.5 * (self.steep[n] + mul(n, &self.steep, &self.quotient))
    }

    /// Estimates the time, s, over which the series of the damping by breaking waves converges,
    /// from its coefficients 0 to 2. The series has a singularity where d, the steepness minus s_b,
    /// is +-i delta (symbols of the module's head).
    fn convergence_radius(&self) -> f64 {
        let Excess { root, above, w, .. } = self;
        let [slope, bend] = [1, 2].map(|n| above[n].abs() + CORNER * w[n].abs());
        time_within(root[0], slope, bend)
    }
}

/// Drag of one mode in a tank that does not drain, with the power series of the drag coefficient c
/// (symbols of the module's head).
#[derive(Clone, Debug)]
pub struct Drag {
    law: DampingLaw,
    growth: f64, // 2 m zeta_A, kg/rad
    c_ref: f64,  // c at g_ref without the terms that depend on the amplitude, N s/m
    inv_l: f64,
    k_m: f64,
    w2_ref: f64, // w_ref^2
    floor2: f64, // a_f^2
    x: Series,
    root: Series,
    divisor: Series,
    above: Series,
    w2: Series,
    power: Series,
    angle2: SquaredAngle,
    tilt2: Series,
    speed2: Series,
    speed: Series,
    instant: (Law, [f64; 2]), // computes c directly, to find the error of the series
    excess: Option<Excess>,
    twice_m: f64,
    grows: bool,
    pub c: Series,
}

fn exponent(law: DampingLaw) -> f64 {
    match law {
        DampingLaw::Laminar => 0.5,
        DampingLaw::ConstantRatio => 1.0,
        DampingLaw::Constant => 0.0,
    }
}

impl Drag {
    pub fn new(tank: &Tank, n: usize) -> Drag {
        let (m, l) = (tank.mass[n], tank.length[n]);
        let floor = tank.smallest_acceleration();
        Drag {
            law: tank.damping_law,
            growth: 2.0 * m * tank.zeta_amplitude[n],
            c_ref: tank.drag(n),
            inv_l: 1.0 / l,
            k_m: tank.k[n] / m,
            w2_ref: tank.g_ref / l + tank.k[n] / m,
            floor2: floor * floor,
            x: ZERO,
            root: ZERO,
            divisor: ZERO,
            above: ZERO,
            w2: ZERO,
            power: ZERO,
            angle2: SquaredAngle::default(),
            tilt2: ZERO,
            speed2: ZERO,
            speed: ZERO,
            instant: (Law::new(tank, n), [m, l]),
            excess: Breaking::new(tank, n).map(Excess::new),
            twice_m: 2.0 * m,
            grows: tank.zeta_amplitude[n] > 0.0 || tank.zeta_breaking[n] > 0.0,
            c: ZERO,
        }
    }

    #[inline(always)]
    pub fn set_axial(&mut self, n: usize, x: f64) {
        self.x[n] = x;
    }

    /// Returns coefficient n of the drag coefficient c, from coefficient n of the specific force x along the tank, of
    /// |p + e|^2, which determines the slosh angle, and of |p'|^2, the squared rate of the bob's direction.
    pub fn expand(&mut self, n: usize, chord2: f64, rate2: f64) -> f64 {
        let square = mul(n, &self.x, &self.x) + constant(n, self.floor2);
        self.root[n] = sqrt(n, square, &self.root);
        // This form avoids cancellation for x < 0: a_f^2/2 over sqrt(x^2 + a_f^2) - x.
        self.above[n] = if self.x[0] >= 0.0 {
            0.5 * (self.x[n] + self.root[n])
        } else {
            self.divisor[n] = self.root[n] - self.x[n];
            let rest = mul_tail(n, &self.divisor, &self.above);
            (constant(n, 0.5 * self.floor2) - rest) / self.divisor[0]
        };
        self.w2[n] = self.above[n] * self.inv_l + constant(n, self.k_m);
        // The power (w2/w2_ref)^(q/2), with q from the damping law.
        let q = 0.5 * exponent(self.law);
        self.power[n] = if n == 0 {
            libm::pow(self.w2[0] / self.w2_ref, q)
        } else {
            let term = |j: usize| (q * j as f64 - (n - j) as f64) * self.w2[j] * self.power[n - j];
            (1..=n).map(term).sum::<f64>() / (n as f64 * self.w2[0])
        };
        self.c[n] = self.c_ref * self.power[n];
        if self.grows {
            self.tilt2[n] = self.angle2.expand(n, chord2) + constant(n, SMALLEST * SMALLEST);
            self.speed2[n] = mul(n, &self.w2, &self.tilt2) + rate2;
            self.speed[n] = sqrt(n, self.speed2[n], &self.speed);
            self.c[n] += self.growth * self.speed[n];
            if let Some(excess) = &mut self.excess {
                let share = self.twice_m * excess.law.zeta;
                self.c[n] += share * excess.expand(n, self.w2[n], self.speed[n]);
            }
        }
        self.c[n]
    }

    /// Estimates the time, s, over which the series of the drag coefficient c converges reliably,
    /// from coefficients 0 to 2 of the quantities on which c depends.
    ///
    /// The square roots in a_+ and in A (symbols of the module's head) have singularities at the
    /// imaginary values x = i a_f and x = -i a_f, and where w^2 A^2 = 0. Thrust that crosses zero
    /// passes close to the first of these points. Before and after the crossing a_+ is almost
    /// linear in x, or almost 0, so that its coefficients do not show the singularity.
    pub fn convergence_radius(&self) -> f64 {
        let [_, slope, bend] = [0, 1, 2].map(|n| self.x[n].abs());
        let mut time = time_within(self.root[0], slope, bend);
        if self.grows {
            let [distance, slope, bend] = [0, 1, 2].map(|n| self.speed2[n].abs());
            time = time.min(time_within(distance, slope, bend));
        }
        let excess = self.excess.as_ref().map_or(f64::INFINITY, Excess::convergence_radius);
        SHARE_OF_RADIUS * time.min(excess)
    }

    /// Returns the error, 1/s, of c/m (drag coefficient divided by mass) at the time `h`, s, after the start of the
    /// expansion that arises because the series of c ends at order n.
    pub fn defect(&self, n: usize, h: f64) -> f64 {
        let (law, size) = self.instant;
        let [x, c] = values([&self.x, &self.c], n, h);
        let [mut tilt2, mut rate2] = [0.0; 2];
        if self.grows {
            let [w2, speed2, tilt] = values([&self.w2, &self.speed2, &self.tilt2], n, h);
            (tilt2, rate2) = (tilt.max(0.0), (speed2 - w2 * tilt).max(0.0));
        }
        (law.coefficient(size, None, x, || [tilt2, rate2]) - c).abs() / size[0]
    }
}

#[derive(Clone, Copy, Debug)]
pub struct Law {
    law: DampingLaw,
    zeta: f64,
    zeta_amplitude: f64,
    breaking: Option<Breaking>,
    k: f64,
    g_ref: f64,
    floor: f64,
    follows: bool,
}

impl Law {
    pub fn new(tank: &Tank, n: usize) -> Law {
        Law {
            law: tank.damping_law,
            zeta: tank.zeta[n],
            zeta_amplitude: tank.zeta_amplitude[n],
            breaking: Breaking::new(tank, n),
            k: tank.k[n],
            g_ref: tank.g_ref,
            floor: tank.smallest_acceleration(),
            follows: tank.follows(n),
        }
    }

    /// Returns the drag coefficient c (kg/s) of a slosh mode in a tank in which the mass m and the length l of the mode
    /// change, from the specific force x along the tank (m/s2), from |p + e|^2, which determines the slosh angle, and from
    /// |p'|^2, the squared rate of the bob's direction. `zeta` replaces the mode's own damping ratio.
    pub fn coefficient_at<T: Number>(
        &self,
        size: [T; 2],
        zeta: Option<T>,
        x: T,
        [chord2, rate2]: [T; 2],
    ) -> T {
        let motion = || [angle::squared(chord2) + T::constant(SMALLEST * SMALLEST), rate2];
        self.coefficient(size, zeta, x, motion)
    }

    /// Returns the drag coefficient c (kg/s) of a slosh mode with the mass m (kg) and the pendulum length l (m). It
    /// depends on the specific force x along the tank's axis (m/s2) and on the amplitude, given as [angle^2 + A_0^2,
    /// |p'|^2]: squared slosh angle plus the constant A_0^2, and squared rate of the bob's direction. `zeta` replaces
    /// the mode's own damping ratio.
    #[inline(always)]
    fn coefficient<T: Number>(
        &self,
        [m, l]: [T; 2],
        zeta: Option<T>,
        x: T,
        motion: impl FnOnce() -> [T; 2],
    ) -> T {
        let stiffness = m.recip() * self.k;
        let reference = (l.recip() * self.g_ref + stiffness).sqrt();
        // The order of evaluation is as in `Tank::drag`, so that a constant c is bit-identical to it.
        let viscous = match zeta {
            Some(zeta) => m * reference * (zeta * 2.0),
            None => m * reference * (2.0 * self.zeta),
        };
        if !self.follows {
            return viscous;
        }
        let floor = self.floor;
        let root = (x * x + T::constant(floor * floor)).sqrt();
        let above = if x.value() >= 0.0 {
            (x + root) * 0.5
        } else {
            T::constant(0.5 * floor * floor) / (root - x)
        };
        let w = (above / l + stiffness).sqrt();
        let viscous = match self.law {
            DampingLaw::Laminar => viscous * (w / reference).sqrt(),
            DampingLaw::ConstantRatio => viscous * (w / reference),
            DampingLaw::Constant => viscous,
        };
        if self.zeta_amplitude == 0.0 && self.breaking.is_none() {
            return viscous;
        }
        let [amplitude2, rate2] = motion();
        let speed = (w * w * amplitude2 + rate2).sqrt();
        let c = viscous + m * speed * (2.0 * self.zeta_amplitude);
        let Some(Breaking { zeta, begins, root, steepness }) = self.breaking else { return c };
        let steep = speed * steepness;
        let above = steep - w * begins;
        let divisor = (above * above + w * w * (CORNER * CORNER)).sqrt() + w * root;
        c + m * steep * (T::constant(1.0) + (above - w * begins) / divisor) * zeta
    }
}

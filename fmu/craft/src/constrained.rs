//! Power series of a bob (slosh mass) that does not move as a pendulum: either the bob lies on another surface than a sphere
//! (`surface.rs`), or the tank guides it in a plane (`contents.rs`). The tank does not drain. The quantities of one bob are:
//!
//! ```text
//! r   position of the bob from its hinge P over l, tank axes, e = e_z: rho = P + l r,  r = p + (kappa - 1) u^2/8 e
//! q   displacement across the tank's axis over l, p_perp = (r_x, r_y, 0),   u = q.q,   eta = p.e = r_z - (kappa - 1) u^2/8
//! n   normal of the surface, p - beta eta q,   beta = (kappa - 1) u/2
//! d   direction of the meridian on the surface, q - (n.q/n.n) n
//! V = r' + w x r                   velocity relative to the hinge over l
//! B = a + w' x P + w x (w x P)     specific force at the hinge
//! V' = -w x V - B/l - f            Newton's law
//! f  = T n + S q + N b + (c/m) r' + (k/m) q        force on the craft at rho over m l
//! S  = (s - 1) sigma',   sigma = q.r'              force from the kinetic energy within the liquid, rate along the meridian
//! ```
//!
//! The force T n holds the bob on its surface, and N b holds it in the plane perpendicular to b. The force S q does the same work
//! in every motion on the surface as the kinetic energy within the liquid requires. The multipliers of order n follow from the
//! coefficients n + 1 of n.r' = 0, b.r' = 0 and sigma. All other terms are products, so every order solves the same equations:
//!
//! ```text
//! f = H Y + known terms,   r'' = Y - T n - S q - N b,   H = n n^T/n.n + (s - 1) (n.n/I) d d^T + b b^T
//! ```
//!
//! I is the inertia along the meridian relative to the inertia of a pendulum. H is the matrix N of `surface.rs`, so that the
//! craft's mass matrix contains m J^T H J.
//!
//! **Coefficients beyond the third order** (`surface.rs`, with S, T, tau and beta from there) add to f, with P = T tau, m = e x q,
//! w_e = w.e, and to the craft's torque
//!
//! ```text
//! f  gains D q + P' m + 2 P e x q' in place of S q,   D = (S sigma)' - s_2 sigma^2 - t_2 tau^2 - 2 P w_e
//! torque gains -m l^2 [(u P)' e + u P w x e]
//! r'     becomes r' + S sigma q + T (q x r') m in the drag
//! ```
//!
//! In liquid that spins at the rate W (`spin.rs`) P = T tau - (1 - C) W, and D gains epsilon W^2.
//!
//! The accelerations sigma' and tau' = (q x r' + w_e u)' belong to the newest order. m is perpendicular to n and d, so that
//! H gains T/(1 + T u) m m^T. The coefficients of [a; w'] in tau' contain - l u e in addition (`surface.rs`).
//!
//! Source: Lagrange's equations of the first kind for the energies in `surface.rs`. tests/craft/independent.rs checks
//! them against Newton's law in other variables, exchange.rs against `contents.rs`.

use alloc::boxed::Box;
use alloc::string::String;

use taylor::root::first_root;
use taylor::series::{Series, ZERO, mul, square};
use taylor::space::{self, Pair, Vector, ZERO_PAIR, ZERO_VECTOR};
use taylor::vector::{
    Mat3, Vec3, add, cross, dot, largest, on_sphere, rotation, scale, sub, times, transposed_times,
    unit_quaternion,
};

use crate::damping::Drag;
use crate::parameters::Tank;
use crate::rigid::{Mat6, add_rank_one, along_rod};
use crate::surface::{self, Higher, LEAST_INERTIA, Surface};

/// One bob that is guided in a plane or moves on another surface than a sphere: its parameters and
/// the power series of its motion, in tank axes (symbols of the module's head).
#[derive(Clone, Debug)]
pub(crate) struct ConstrainedBob {
    pub tank: usize,
    pub mode: usize,
    pub m: f64,
    pub l: f64,
    inv_l: f64,
    c_m: f64,
    k_m: f64,
    follows: bool, // true if c depends on acceleration or amplitude
    drag: Drag,
    dragged: Vector,
    p_d: Vector,
    axes: Mat3,
    pub hinge: Vec3,
    across: Option<Vec3>, // b of a planar mode
    surface: Surface,
    coefficients: [f64; 2], // s and kappa
    higher: Option<Box<HigherSeries>>,
    highest: Option<f64>, // eta at which the model ends
    in_tank: Vector,
    w: Pair,
    both: Pair,
    r: Vector,
    v: Vector,
    r_d: Vector,
    u: Series,
    u2: Series,
    eta: Series,
    slope: Series,
    n: Vector,
    tension: Series,
    inner: Series,
    f: Vector,
    n2: f64,
    ratio: f64,
    share: f64,
    d: Vec3,
    fall: Vec3,
    known: Vec3,
    multipliers: [f64; 2],
    rest: Vec3,
    ahead: Vector,
    specific_force: Vec3,
    slope_at_end: Vec3,
}

/// Power series of a bob's terms beyond the third order and of its coupling to spinning liquid
/// (symbols of the module's head).
#[derive(Clone, Debug)]
struct HigherSeries {
    by: Higher,
    liquid: Series, // spin rate W
    u3: Series,
    beta: Series,
    turning: Series,
    sigma: Series,
    tau: Series,
    swirl: Series,
    spin: Series,
    inwards: Series,
    around: Series,
    turned: Series,
    radial: Series,
    tangential: Series,
    rate: Vector,
    inertia: [f64; 2],
    share: f64,
    m: Vec3,
    known: [f64; 3], // terms of D, P' and tau' of the current order without [a; w']
}

impl HigherSeries {
    fn new(by: Higher) -> Box<HigherSeries> {
        Box::new(HigherSeries {
            by,
            liquid: ZERO,
            u3: ZERO,
            beta: ZERO,
            turning: ZERO,
            sigma: ZERO,
            tau: ZERO,
            swirl: ZERO,
            spin: ZERO,
            inwards: ZERO,
            around: ZERO,
            turned: ZERO,
            radial: ZERO,
            tangential: ZERO,
            rate: ZERO_VECTOR,
            inertia: [0.0; 2],
            share: 0.0,
            m: [0.0; 3],
            known: [0.0; 3],
        })
    }

    /// Starts an expansion at the bob's displacement `q` across the tank's axis, divided by l, and
    /// its square `u`. `s` is the value of the coefficient S (module's head) at this displacement.
    fn start(&mut self, q: Vec3, u: f64, s: f64) {
        self.u3[0] = u * u * u;
        let t = self.by.rotary_inertia(u);
        self.inertia = [s, t];
        self.share = t / f64::max(1.0 + t * u, 0.5 * LEAST_INERTIA);
        self.m = [-q[1], q[0], 0.0];
    }

    /// Computes coefficient `n` of the force of the bob's terms beyond the third order, divided by
    /// m l. The position `r` and the squared displacement `u` must be known up to order n + 1, the
    /// rate `r_d` and the angular velocity `w_e` about the tank's axis up to order n. Returns the
    /// part that does not contain the craft's accelerations of order n.
    #[inline(never)]
    fn expand(&mut self, n: usize, w_e: f64, r: &Vector, r_d: &Vector, u: &Series) -> [f64; 2] {
        let HigherSeries { by, .. } = *self;
        let order = (n + 1) as f64;
        self.turning[n] = w_e;
        // sigma = q.q', tau = q x q' + w_e u
        let (mut inwards, mut twist, mut relative) = ([0.0; 2], [0.0; 2], 0.0);
        // Terms of order n, and terms of order n + 1 without those that depend on [a; w'] of order n.
        for (k, last) in [n, n + 1].into_iter().enumerate() {
            for j in k..=last {
                let (a, b) = (r[j], r_d[last - j]);
                inwards[k] += a[0] * b[0] + a[1] * b[1];
                twist[k] += a[0] * b[1] - a[1] * b[0];
            }
            if k == 0 {
                relative = twist[0];
            }
            for j in k..=last {
                twist[k] += u[j] * self.turning[last - j];
            }
        }
        (self.sigma[n], self.tau[n]) = (inwards[0], twist[0]);
        self.turned[n] = relative;
        // S sigma of order n + 1, and T tau of orders n and n + 1; both without the products that contain coefficient 0
        // of S or T.
        let (mut faster, mut swirls) = (0.0, [0.0; 2]);
        for j in 1..=n + 1 {
            faster += by.inertia * u[j] * self.sigma[n + 1 - j];
            swirls[1] += by.rotary[1] * u[j] * self.tau[n + 1 - j];
        }
        for j in 1..=n {
            swirls[0] += by.rotary[1] * u[j] * self.tau[n - j];
        }
        self.swirl[n] = self.inertia[1] * self.tau[n] + swirls[0];
        let [gyroscopic, stiffness] = by.gyroscopic;
        if gyroscopic != 0.0 {
            self.swirl[n] -= gyroscopic * self.liquid[n];
            swirls[1] -= gyroscopic * self.liquid[n + 1];
        }
        self.spin[n] = mul(n, u, &self.swirl);
        let mut inwards_known = order * faster
            - by.inertia * square(n, &self.sigma)
            - by.rotary[1] * square(n, &self.tau)
            - 2.0 * mul(n, &self.swirl, &self.turning);
        if stiffness != 0.0 {
            inwards_known += stiffness * square(n, &self.liquid);
        }
        self.known = [inwards_known, order * swirls[1], order * twist[1]];
        let mut f = [0.0; 2];
        for j in 0..=n {
            let (swirl, rate) = (2.0 * self.swirl[j], r_d[n - j]);
            f = [f[0] - swirl * rate[1], f[1] + swirl * rate[0]];
        }
        for j in 0..n {
            let (d, p, at) = (self.inwards[j], self.around[j], r[n - j]);
            f = [f[0] + d * at[0] - p * at[1], f[1] + d * at[1] + p * at[0]];
        }
        [
            f[0] + self.known[0] * r[0][0] - self.known[1] * r[0][1],
            f[1] + self.known[0] * r[0][1] + self.known[1] * r[0][0],
        ]
    }

    /// Sets coefficient n of the bob's rate that enters the drag. [`HigherSeries::expand`] must have computed order n.
    fn set_rate(&mut self, n: usize, r: &Vector, r_d: Vec3, u: &Series) {
        let (mut radial, mut tangential) = (0.0, 0.0);
        for j in 1..=n {
            radial += self.by.inertia * u[j] * self.sigma[n - j];
            tangential += self.by.rotary[1] * u[j] * self.turned[n - j];
        }
        self.radial[n] = self.inertia[0] * self.sigma[n] + radial;
        self.tangential[n] = self.inertia[1] * self.turned[n] + tangential;
        self.rate[n] = r_d;
        for j in 0..=n {
            let (s, t, at) = (self.radial[j], self.tangential[j], r[n - j]);
            self.rate[n][0] += s * at[0] - t * at[1];
            self.rate[n][1] += s * at[1] + t * at[0];
        }
    }

    fn pull(&self, y: Vec3, w_e_d: f64, u: f64) -> f64 {
        self.share * (self.known[2] + dot(self.m, y) + w_e_d * u)
    }

    /// Sets coefficient `n` of the force of the terms beyond the third order: D along the bob's
    /// displacement across the tank's axis, and P' perpendicular to it. `inner` and `pull` are the
    /// parts S sigma' and T tau' of D and P' (module's head) at the newest order.
    fn set(&mut self, n: usize, inner: f64, pull: f64) {
        (self.inwards[n], self.around[n]) = (self.known[0] + inner, self.known[1] + pull);
    }

    /// Returns coefficient `n` of the torque that the mode's terms beyond the third order exert on
    /// the craft, divided by -m l^2 (torque in the module's head). `w` is the angular velocity, `u`
    /// the squared displacement of the bob, and `pull` the part T tau' of order n.
    fn couple(&self, n: usize, pull: f64, w: &Vector, u: &Series) -> Vec3 {
        let mut couple = [0.0, 0.0, u[0] * (self.known[1] + pull)];
        for j in 0..n {
            couple[2] += u[n - j] * self.around[j];
        }
        couple[2] += 2.0 * mul(n, &self.sigma, &self.swirl);
        for j in 0..=n {
            let (spin, w) = (self.spin[j], w[n - j]);
            couple = [couple[0] + spin * w[1], couple[1] - spin * w[0], couple[2]];
        }
        couple
    }
}

fn dot_from_1(n: usize, a: &Vector, b: &Vector) -> f64 {
    let mut sum = [0.0; 3];
    for (a, b) in a[1..=n].iter().zip(b[..n].iter().rev()) {
        for i in 0..3 {
            sum[i] += a[i] * b[i];
        }
    }
    sum[0] + sum[1] + sum[2]
}

/// Returns coefficient n of the squared length of the part of `a`, in tank axes, that is
/// perpendicular to the tank's axis.
fn square_across(n: usize, a: &Vector) -> f64 {
    let mut sum = [0.0; 2];
    for (a, b) in a[..=n].iter().zip(a[..=n].iter().rev()) {
        sum = [sum[0] + a[0] * b[0], sum[1] + a[1] * b[1]];
    }
    sum[0] + sum[1]
}

impl ConstrainedBob {
    /// Creates the bob of mode `mode` of tank number `index`; both count from 0. Returns `None` for a pendulum that swings
    /// in every direction, because [`Bob`](crate::bob::Bob) models it.
    pub fn new(tank: &Tank, index: usize, mode: usize) -> Option<ConstrainedBob> {
        let (surface, across) = (tank.surface(mode), tank.plane_normal(mode));
        if surface.is_none() && across.is_none() {
            return None;
        }
        let surface = surface.unwrap_or(Surface::SPHERE);
        let (m, l) = (tank.mass[mode], tank.length[mode]);
        Some(ConstrainedBob {
            tank: index,
            mode,
            m,
            l,
            inv_l: 1.0 / l,
            c_m: tank.drag(mode) / m,
            k_m: tank.k[mode] / m,
            follows: tank.follows(mode),
            drag: Drag::new(tank, mode),
            dragged: ZERO_VECTOR,
            p_d: ZERO_VECTOR,
            axes: rotation(&unit_quaternion(tank.q)),
            hinge: tank.hinge_and_across(mode).0,
            across,
            surface,
            coefficients: [tank.nonlinear_inertia[mode], tank.nonlinear_stiffness[mode]],
            higher: surface.higher().map(HigherSeries::new),
            in_tank: ZERO_VECTOR,
            highest: surface.highest(),
            w: ZERO_PAIR,
            both: ZERO_PAIR,
            r: ZERO_VECTOR,
            v: ZERO_VECTOR,
            r_d: ZERO_VECTOR,
            u: ZERO,
            u2: ZERO,
            eta: ZERO,
            slope: ZERO,
            n: ZERO_VECTOR,
            tension: ZERO,
            inner: ZERO,
            f: ZERO_VECTOR,
            n2: 1.0,
            ratio: 0.0,
            share: 0.0,
            d: [0.0; 3],
            fall: [0.0; 3],
            known: [0.0; 3],
            multipliers: [0.0; 2],
            rest: [0.0; 3],
            ahead: ZERO_VECTOR,
            specific_force: [0.0; 3],
            slope_at_end: [0.0; 3],
        })
    }

    /// Starts an expansion at the bob's direction and rate `x` (six numbers in tank axes), which are normalised first, while
    /// the craft rotates with the angular velocity `w`.
    #[inline(never)]
    pub fn start(&mut self, x: &[f64; 6], w: Vec3) {
        let [p, p_d] = self.projected([x[0], x[1], x[2]], [x[3], x[4], x[5]]);
        let q = [p[0], p[1], 0.0];
        let (u, sigma) = (dot(q, q), dot(q, p_d));
        self.r[0] = [p[0], p[1], p[2] + self.surface.lift(u)];
        (self.u[0], self.u2[0], self.eta[0]) = (u, u * u, p[2]);
        let r_d = [p_d[0], p_d[1], p_d[2] + self.surface.rise(u) * sigma];
        let turned = cross(transposed_times(&self.axes, w), self.r[0]);
        self.v[0] = add(r_d, turned);
        self.ahead[0] = [0.0; 3];
        if let Some(higher) = &mut self.higher {
            higher.start(q, u, self.surface.inner_at(u));
        }
        self.set_normal(0);
        let n = self.n[0];
        let (n2, nq) = (dot(n, n), dot(n, q));
        let inertia = self.surface.meridian_inertia(p[2], u);
        (self.n2, self.ratio) = (n2, nq / n2);
        self.share = self.surface.inner_at(u) * n2 / f64::max(inertia, 0.5 * LEAST_INERTIA);
        self.d = sub(q, scale(self.ratio, n));
    }

    /// Projects direction and rate onto the unit sphere and, for a planar mode, into its plane.
    #[inline(never)]
    fn projected(&self, p: Vec3, p_d: Vec3) -> [Vec3; 2] {
        let flat = |x: Vec3| match self.across {
            Some(b) => sub(x, scale(dot(b, x), b)),
            None => x,
        };
        on_sphere(flat(p), flat(p_d))
    }

    #[inline(never)]
    fn set_normal(&mut self, n: usize) {
        self.n[n] = [self.r[n][0], self.r[n][1], self.eta[n]];
        if self.surface.is_sphere() {
            return;
        }
        self.slope[n] = match &mut self.higher {
            Some(higher) => {
                let by_square = 0.375 * higher.by.stiffness * self.u2[n];
                higher.beta[n] = self.surface.bend() * self.u[n] + by_square;
                mul(n, &higher.beta, &self.eta)
            }
            None => self.surface.bend() * mul(n, &self.u, &self.eta),
        };
        let mut bent = [0.0; 2];
        for (s, r) in self.slope[..=n].iter().zip(self.r[..=n].iter().rev()) {
            bent = [bent[0] + s * r[0], bent[1] + s * r[1]];
        }
        self.n[n][0] -= bent[0];
        self.n[n][1] -= bent[1];
    }

    fn place(&self) -> Vec3 {
        add(self.hinge, scale(self.l, times(&self.axes, self.r[0])))
    }

    fn held(&self, x: Vec3) -> Vec3 {
        let n = self.n[0];
        let mut held = scale(dot(n, x) / self.n2, n);
        held = add(held, scale(self.share * dot(self.d, x), self.d));
        match self.across {
            Some(b) => add(held, scale(dot(b, x), b)),
            None => held,
        }
    }

    /// Adds the inertia of the bob, m J^T H J, to the craft's mass matrix. J maps the accelerations
    /// [a; w'] to the acceleration a + w' x rho of the bob's place. H takes the place of the
    /// projection p p^T of a pendulum and is defined in the module's head.
    pub fn add_inertia(&self, matrix: &mut Mat6) {
        let rho = self.place();
        let across = self.across.map(|b| (1.0, b));
        let parts = [Some((1.0 / self.n2, self.n[0])), Some((self.share, self.d)), across];
        for (share, direction) in parts.into_iter().flatten() {
            let u = along_rod(times(&self.axes, direction), rho);
            add_rank_one(matrix, self.m * share, &u);
        }
        if let Some(higher) = &self.higher {
            let mut u = along_rod(times(&self.axes, higher.m), rho);
            for (u, row) in u[3..].iter_mut().zip(&self.axes) {
                *u -= self.l * self.u[0] * row[2];
            }
            add_rank_one(matrix, self.m * higher.share, &u);
        }
    }

    /// Returns coefficient n of the power series of force and torque about O with which the bob acts on the craft. The
    /// terms that contain coefficient n of the accelerations [a; w'] are left out, because the mass matrix contains
    /// them. `w` is coefficient n of the angular velocity, and `w2` is coefficient n of the matrix that maps a vector y to
    /// w x (w x y).
    #[inline(never)]
    pub fn reaction(&mut self, n: usize, w: Vec3, w2: &Mat3) -> [Vec3; 2] {
        let w = transposed_times(&self.axes, w);
        self.w.set(n, w, w);
        let order = (n + 1) as f64;
        let turned = add(self.ahead[n], cross(w, self.r[0]));
        self.r_d[n] = sub(self.v[n], turned);
        self.r[n + 1] = scale(1.0 / order, self.r_d[n]);
        self.both.set(n, self.r[n + 1], self.v[n]);
        self.u[n + 1] = square_across(n + 1, &self.r);
        self.eta[n + 1] = self.r[n + 1][2];
        if !self.surface.is_sphere() {
            self.u2[n + 1] = square(n + 1, &self.u);
            self.eta[n + 1] -= self.surface.lift_of_square() * self.u2[n + 1];
            if let Some(higher) = &mut self.higher {
                higher.u3[n + 1] = mul(n + 1, &self.u, &self.u2);
                self.eta[n + 1] -= 0.0625 * higher.by.stiffness * higher.u3[n + 1];
            }
        }
        self.set_normal(n + 1);

        let turned = space::cross_pair_coefficient(n, &self.w, &self.both);
        self.ahead[n + 1] = turned.map(|pair| pair[0]);
        let centripetal = transposed_times(&self.axes, times(w2, self.hinge));
        let fall = add(turned.map(|pair| pair[1]), scale(self.inv_l, centripetal));
        self.fall = scale(-1.0, fall);

        let mut by_higher = [0.0; 2];
        if let Some(higher) = &mut self.higher {
            self.in_tank[n] = w;
            by_higher = higher.expand(n, w[2], &self.r, &self.r_d, &self.u);
            higher.set_rate(n, &self.r, self.r_d[n], &self.u);
        }
        // The force f of order n, without the terms that contain the multipliers of order n.
        let mut f = if self.follows {
            self.set_drag(n);
            scale(1.0 / self.m, self.dragged[n])
        } else {
            scale(self.c_m, self.higher.as_ref().map_or(self.r_d[n], |higher| higher.rate[n]))
        };
        f[0] += self.k_m * self.r[n][0];
        f[1] += self.k_m * self.r[n][1];
        for (t, normal) in self.tension[..n].iter().zip(self.n[1..=n].iter().rev()) {
            for i in 0..3 {
                f[i] += t * normal[i];
            }
        }
        let normal = dot_from_1(n + 1, &self.n, &self.r_d);
        let mut inwards = 0.0;
        if self.higher.is_some() {
            (f[0], f[1]) = (f[0] + by_higher[0], f[1] + by_higher[1]);
            for (r, r_d) in self.r[1..=n + 1].iter().zip(self.r_d[..=n].iter().rev()) {
                inwards += r[0] * r_d[0] + r[1] * r_d[1];
            }
        } else if self.surface.inner() != 0.0 {
            for (s, r) in self.inner[..n].iter().zip(self.r[1..=n].iter().rev()) {
                f[0] += s * r[0];
                f[1] += s * r[1];
            }
            for (r, r_d) in self.r[1..=n + 1].iter().zip(self.r_d[..=n].iter().rev()) {
                inwards += r[0] * r_d[0] + r[1] * r_d[1];
            }
        }
        self.rest = f;
        self.known = sub(sub(self.fall, f), scale(order, self.ahead[n + 1]));
        self.multipliers = [order * normal, order * inwards];
        let known = self.force(self.known, 0.0);
        self.f[n] = known;
        let force = times(&self.axes, scale(self.m * self.l, known));
        let mut arm = space::cross_coefficient(n, &self.r, &self.f);
        if let Some(higher) = &self.higher {
            let pull = higher.pull(self.known, 0.0, self.u[0]);
            arm = sub(arm, higher.couple(n, pull, &self.in_tank, &self.u));
        }
        let twist = times(&self.axes, scale(self.m * self.l * self.l, arm));
        [force, add(cross(self.hinge, force), twist)]
    }

    fn multipliers(&self, y: Vec3) -> [f64; 2] {
        let [normal, inwards] = self.multipliers;
        let normal = normal + dot(self.n[0], y);
        let inwards = inwards + self.r[0][0] * y[0] + self.r[0][1] * y[1];
        let inner = self.share * (inwards - self.ratio * normal);
        [normal / self.n2 - self.ratio * inner, inner]
    }

    fn force(&self, y: Vec3, w_e_d: f64) -> Vec3 {
        let [tension, inner] = self.multipliers(y);
        let mut f = add(self.rest, scale(tension, self.n[0]));
        f[0] += inner * self.r[0][0];
        f[1] += inner * self.r[0][1];
        if let Some(higher) = &self.higher {
            f = add(f, scale(higher.pull(y, w_e_d, self.u[0]), higher.m));
        }
        match self.across {
            Some(b) => add(f, scale(dot(b, y), b)),
            None => f,
        }
    }

    #[inline(never)]
    fn set_drag(&mut self, n: usize) {
        self.p_d[n] = [self.r_d[n][0], self.r_d[n][1], (n + 1) as f64 * self.eta[n + 1]];
        // |p + e|^2 = 2 + 2 p.e. At order 0 this form avoids cancellation near rest.
        let chord2 = if n == 0 {
            let above = self.eta[0] + 1.0;
            self.u[0] + above * above
        } else {
            2.0 * self.eta[n]
        };
        self.drag.expand(n, chord2, space::square_coefficient(n, &self.p_d));
        let mut dragged = [0.0; 3];
        let rate = self.higher.as_ref().map_or(&self.r_d, |higher| &higher.rate);
        for (c, r_d) in self.drag.c[..=n].iter().zip(rate[..=n].iter().rev()) {
            for i in 0..3 {
                dragged[i] += c * r_d[i];
            }
        }
        self.dragged[n] = dragged;
    }

    /// Sets coefficient n of the constraint forces (multipliers) and of the force f on the bob's
    /// surface, and coefficient n + 1 of the bob's velocity V, from coefficient n of the craft's
    /// accelerations [a; w'].
    #[inline(never)]
    pub fn accelerate(&mut self, n: usize, a: Vec3, w_d: Vec3) {
        let at_hinge = add(a, cross(w_d, self.hinge));
        let at_hinge = scale(self.inv_l, transposed_times(&self.axes, at_hinge));
        let w_d = transposed_times(&self.axes, w_d);
        let y = sub(sub(self.known, at_hinge), cross(w_d, self.r[0]));
        [self.tension[n], self.inner[n]] = self.multipliers(y);
        self.f[n] = self.force(y, w_d[2]);
        if let Some(higher) = &mut self.higher {
            let pull = higher.pull(y, w_d[2], self.u[0]);
            higher.set(n, self.inner[n], pull);
        }
        if n == 0 {
            self.specific_force = sub(at_hinge, self.fall);
        }
        let rate = sub(sub(self.fall, at_hinge), self.f[n]);
        self.v[n + 1] = scale(1.0 / (n + 1) as f64, rate);
    }

    pub fn dissipation(&self, n: usize) -> f64 {
        let l2 = self.l * self.l;
        if let (Some(higher), false) = (&self.higher, self.follows) {
            let power = dot_from_1(n, &self.r_d, &higher.rate) + dot(self.r_d[0], higher.rate[n]);
            return self.m * self.c_m * l2 * power;
        }
        if !self.follows {
            return self.m * self.c_m * l2 * space::square_coefficient(n, &self.r_d);
        }
        l2 * (dot_from_1(n, &self.r_d, &self.dragged) + dot(self.r_d[0], self.dragged[n]))
    }

    /// Returns direction and rate at `t` after the start, tank axes, normalised, from the series up to order
    /// n. `w` is the craft's angular velocity at that time.
    pub fn state_at(&self, n: usize, t: f64, w: Vec3) -> [f64; 6] {
        let (r, v) = (space::value(&self.r, n, t), space::value(&self.v, n, t));
        let r_d = sub(v, cross(transposed_times(&self.axes, w), r));
        let u = r[0] * r[0] + r[1] * r[1];
        let sigma = r[0] * r_d[0] + r[1] * r_d[1];
        let p = [r[0], r[1], r[2] - self.surface.lift(u)];
        let p_d = [r_d[0], r_d[1], r_d[2] - self.surface.rise(u) * sigma];
        let [p, p_d] = self.projected(p, p_d);
        [p[0], p[1], p[2], p_d[0], p_d[1], p_d[2]]
    }

    /// Returns the first time within `h`, s, at which the bob reaches the end of its surface (the
    /// slosh angle up to which the model is valid), from the series up to order n.
    pub fn bound(&self, n: usize, h: f64) -> Option<f64> {
        let highest = self.highest?;
        let mut below = self.eta.map(|eta| -eta);
        below[0] += highest;
        first_root(&below[..=n], h)
    }

    /// Returns the message for a bob that has passed the end of its surface, the slosh angle up to
    /// which the model is valid. `name` is the tank's name in the FMU.
    pub fn bound_message(&self, name: &str) -> String {
        let higher = self.surface.higher().unwrap_or_default();
        surface::bound_message(self.coefficients, higher, self.mode, name)
    }

    /// Sets coefficient n of the liquid's rate of spin W.
    pub fn set_spin(&mut self, n: usize, turning: f64) {
        if let Some(higher) = &mut self.higher {
            higher.liquid[n] = turning;
        }
    }

    /// Returns coefficient n of the mode's contribution to I_zz s_z, where I_zz is the moment of inertia of the spinning liquid
    /// about the tank's axis and s_z its slip (`spin.rs`). It must be called before [`ConstrainedBob::reaction`] of order n; `w`
    /// is coefficient n of the angular velocity.
    pub fn reaction_on_spin(&self, n: usize, w: Vec3) -> f64 {
        let Some(higher) = self.higher.as_ref().filter(|it| it.by.gyroscopic != [0.0; 2]) else {
            return 0.0;
        };
        let w = transposed_times(&self.axes, w);
        let r_d = sub(self.v[n], add(self.ahead[n], cross(w, self.r[0])));
        let mut tau = self.r[0][0] * r_d[1] - self.r[0][1] * r_d[0] + w[2] * self.u[0];
        for j in 1..=n {
            let (a, b) = (self.r[j], self.r_d[n - j]);
            tau += a[0] * b[1] - a[1] * b[0] + self.u[j] * self.in_tank[n - j][2];
        }
        let turned = mul(n, &higher.liquid, &self.u);
        self.m * self.l * self.l * higher.by.reaction(tau, turned)
    }

    pub fn follows(&self) -> bool {
        self.follows
    }

    /// Sets coefficient n of the specific force at the hinge along the tank's axis, on which the drag depends.
    pub fn set_axial(&mut self, n: usize, x: f64) {
        self.drag.set_axial(n, x);
    }

    /// Returns the unit vector e of the tank's axis, and its moment P x e about the origin O, where
    /// P is the position of the hinge. The scalar product of these six numbers with the craft's
    /// accelerations [a; w'] is their contribution to the acceleration of the hinge along the axis.
    pub fn along_axis(&self) -> [Vec3; 2] {
        let e = self.axes.map(|row| row[2]);
        [e, cross(self.hinge, e)]
    }

    pub fn at_rest(&self) -> Vec3 {
        sub(self.hinge, scale(self.l, self.along_axis()[0]))
    }

    pub fn rate_scale(&self) -> f64 {
        let stiffness = largest(self.specific_force) + self.k_m;
        let [x, y, _] = self.r[0];
        largest(self.r_d[0]) + libm::sqrt(stiffness) * f64::max(x.abs(), y.abs())
    }

    /// Estimates the time, s, over which the series of the drag converges reliably, from
    /// coefficients 0 to 2.
    pub fn convergence_radius(&self) -> f64 {
        if self.follows { self.drag.convergence_radius() } else { f64::INFINITY }
    }

    /// Returns the error, 1/s, of the bob's velocity V at the time `h`, s, after the start of the
    /// expansion. The error arises because the series of the drag end at order n.
    pub fn defect(&self, n: usize, h: f64) -> f64 {
        if !self.follows {
            return 0.0;
        }
        let rates = self.higher.as_ref().map_or(&self.r_d, |higher| &higher.rate);
        let end = largest(space::value(rates, n - 1, h));
        let rate = f64::max(largest(rates[0]) + largest(rates[1]) * h, end);
        self.drag.defect(n - 1, h) * rate * h
    }

    /// Stores V', the derivative of the bob's velocity V, at `h`, s, after the start of the
    /// expansion, from the series up to order n. [`ConstrainedBob::slope_defect`] compares it with
    /// V' at the start of the next expansion.
    pub fn store_slope(&mut self, n: usize, h: f64) {
        let horner = |sum: Vec3, k: usize| add(scale(h, sum), scale(k as f64, self.v[k]));
        self.slope_at_end = (1..=n).rev().fold([0.0; 3], horner);
    }

    /// Returns the error of the series at the end of the last expansion, 1/s^2: the derivative V'
    /// that [`ConstrainedBob::store_slope`] has stored minus V' at the start of the present
    /// expansion.
    pub fn slope_defect(&self) -> f64 {
        largest(sub(self.slope_at_end, self.v[1]))
    }

    pub fn coefficient_norm(&self, n: usize) -> f64 {
        largest(self.v[n])
    }

    /// Updates the rate of the bob after an impulse that changes the velocity of O by `dv` and the
    /// angular velocity by `dw`, both in body axes. The bob keeps its velocity in the directions in
    /// which its surface lets it move. `x` has the bob's six states at the start of the expansion.
    pub fn after_impulse(&self, x: &mut [f64; 6], dv: Vec3, dw: Vec3) {
        let kick = transposed_times(&self.axes, add(dv, cross(dw, self.place())));
        let mut change = scale(-self.inv_l, sub(kick, self.held(kick)));
        if let Some(higher) = &self.higher {
            let turned = self.u[0] * transposed_times(&self.axes, dw)[2];
            let pull = higher.share * (turned - self.inv_l * dot(higher.m, kick));
            change = sub(change, scale(pull, higher.m));
        }
        let [r_x, r_y, _] = self.r[0];
        let sigma = r_x * change[0] + r_y * change[1];
        x[3] += change[0];
        x[4] += change[1];
        x[5] += change[2] - self.surface.rise(self.u[0]) * sigma;
    }
}

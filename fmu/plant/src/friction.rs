//! The bearing's friction.
//!
//! ```text
//! tau_f = -b w - sgn(w) T_C(w) B(theta),   T_C(w) = c + d exp(-(w/w_s)^2)
//! ```
//!
//! (thesis eq. 5.1), with the directional factor of thesis 5.4,
//!
//! ```text
//! B+-(theta) = 1 +- eta + sum over h = 1, 2 of a_h+- cos(h theta) + b_h+- sin(h theta),
//! ```
//!
//! with + while the hub turns forwards, - backwards. At rest the law is set-valued:
//! the bearing holds any torque between -(c + d) B- and (c + d) B+. The smooth
//! variant replaces sgn(w) by T = tanh(w/eps) and blends the two directions,
//! sgn(w) B -> T [(B+ + B-)/2 + T (B+ - B-)/2], which never drives the hub.

use crate::series::{self, Series, ZERO};
use crate::{Friction, FrictionModel};

/// How the hub stands to the bearing under the set-valued law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i8)]
pub enum Contact {
    /// Turning backwards, w < 0.
    Backward = -1,
    /// At rest, held by dry friction.
    Stuck = 0,
    /// Turning forwards, w > 0.
    Forward = 1,
}

/// B+-(theta) of one direction.
#[derive(Clone, Copy, Debug)]
struct Bracket {
    mean: f64,
    /// Coefficients of cos theta, sin theta, cos 2 theta, sin 2 theta.
    harmonics: [f64; 4],
}

impl Bracket {
    fn at(&self, theta: f64) -> f64 {
        let [a1, b1, a2, b2] = self.harmonics;
        if self.harmonics == [0.0; 4] {
            return self.mean;
        }
        let (s1, c1) = libm::sincos(theta);
        let (s2, c2) = libm::sincos(2.0 * theta);
        self.mean + a1 * c1 + b1 * s1 + a2 * c2 + b2 * s2
    }

    /// A lower bound of B over all angles, exact to 2e-6 of the harmonics' size.
    fn lowest(&self) -> f64 {
        const POINTS: usize = 4096;
        let angle = |j: usize| core::f64::consts::TAU * j as f64 / POINTS as f64;
        let lowest = (0..POINTS).map(|j| self.at(angle(j))).fold(f64::INFINITY, f64::min);
        // Between two points B falls below both by at most |B''| (spacing/2)^2 / 2.
        let [a1, b1, a2, b2] = self.harmonics.map(f64::abs);
        let bend = a1 + b1 + 4.0 * (a2 + b2);
        lowest - bend * (angle(1) / 2.0) * (angle(1) / 2.0) / 2.0
    }
}

/// The law of friction with the power series of its parts.
#[derive(Clone, Debug)]
pub struct Law {
    pub model: FrictionModel,
    b: f64,
    c: f64,
    d: f64,
    /// 1/w_s^2
    inv_omega_s2: f64,
    eps: f64,
    forward: Bracket,
    backward: Bracket,
    /// Does B depend on the angle?
    angular: bool,
    /// u' with u = -(w/w_s)^2, e = exp u, t_c = T_C(w)
    u_d: Series,
    e: Series,
    t_c: Series,
    /// v' with v = w/eps, t = tanh v, sech2 = 1 - t^2
    v_d: Series,
    t: Series,
    sech2: Series,
    /// cos and sin of theta and 2 theta in turn, as in `Bracket::harmonics`
    trig: [Series; 4],
    /// theta' and 2 theta'
    angles_d: [Series; 2],
    /// B of the present direction, or (smooth) the blend of both
    bracket: Series,
    /// (B+ + B-)/2 and (B+ - B-)/2 for the smooth law
    even: Series,
    odd: Series,
    /// T [even + T odd]
    sign: Series,
    /// tau_f
    pub tau_f: Series,
}

impl Law {
    pub fn new(p: &Friction) -> Law {
        let forward = Bracket { mean: 1.0 + p.asymmetry, harmonics: p.harmonics_forward };
        let backward = Bracket { mean: 1.0 - p.asymmetry, harmonics: p.harmonics_backward };
        Law {
            model: p.model,
            b: p.b,
            c: p.c,
            d: p.d,
            inv_omega_s2: 1.0 / (p.omega_s * p.omega_s),
            eps: p.eps,
            forward,
            backward,
            angular: [forward, backward].iter().any(|b| b.harmonics != [0.0; 4]),
            u_d: ZERO,
            e: ZERO,
            t_c: ZERO,
            v_d: ZERO,
            t: ZERO,
            sech2: ZERO,
            trig: [ZERO; 4],
            angles_d: [ZERO; 2],
            bracket: ZERO,
            even: ZERO,
            odd: ZERO,
            sign: ZERO,
            tau_f: ZERO,
        }
    }

    /// What is wrong with the parameters together: dry friction may not drive.
    pub fn problems(p: &Friction) -> Vec<String> {
        let law = Law::new(p);
        let directions = [(law.forward, "forward", '+'), (law.backward, "backward", '-')];
        let wrong = directions.into_iter().filter(|(b, ..)| b.lowest() <= 0.0);
        wrong
            .map(|(bracket, name, sign)| {
                format!(
                    "friction.asymmetry and friction.{name}_* make the dry friction's factor \
                     1 {sign} asymmetry + harmonics as low as {:.6}, so the bearing would drive \
                     the hub; it must stay above 0 at every angle",
                    bracket.lowest()
                )
            })
            .collect()
    }

    /// Is rest a state of its own (the set-valued law)?
    pub fn can_stick(&self) -> bool {
        self.model == FrictionModel::Stribeck
    }

    /// The largest torques that the bearing holds at rest against a push
    /// backwards and forwards, N m (both >= 0).
    pub fn holds(&self, theta: f64) -> (f64, f64) {
        let dry = self.c + self.d;
        (dry * self.backward.at(theta), dry * self.forward.at(theta))
    }

    /// How far ahead the series of tau_f can converge, s, from w, w' and w''. tanh has
    /// its nearest poles at distance sqrt(v^2 + (pi/2)^2) from v = w/eps, and it is so
    /// flat away from 0 that its coefficients there do not tell; half the way is safe.
    pub fn reach(&self, omega: &Series) -> f64 {
        if self.model != FrictionModel::StribeckSmooth {
            return f64::INFINITY;
        }
        let [v, v1, v2] = [omega[0], omega[1], omega[2]].map(|x| (x / self.eps).abs());
        let half = libm::sqrt(v * v + 2.4674) / 2.0;
        2.0 * half / (v1 + libm::sqrt(v1 * v1 + 4.0 * v2 * half))
    }

    /// How many small terms in a row show that the series has converged. One term may
    /// vanish by symmetry; of tanh(w/eps) from w = w' = 0 on, three in a row do.
    pub fn quiet_terms(&self) -> usize {
        if self.model == FrictionModel::StribeckSmooth { 4 } else { 2 }
    }

    /// Coefficient N of tau_f while the hub slips.
    #[inline(always)]
    pub fn slip<const N: usize>(
        &mut self,
        contact: Contact,
        theta: &Series,
        omega: &Series,
        omega2: &Series,
    ) {
        let dry = match self.model {
            FrictionModel::None => {
                self.tau_f[N] = 0.0;
                return;
            }
            FrictionModel::Viscous => 0.0,
            FrictionModel::Stribeck => {
                self.dry_torque::<N>(omega2);
                let bracket =
                    if contact == Contact::Forward { self.forward } else { self.backward };
                let size = if self.angular {
                    self.harmonics::<N>(theta[N]);
                    self.bracket[N] = combine::<N>(&bracket, &self.trig);
                    series::mul::<N>(&self.t_c, &self.bracket)
                } else {
                    bracket.mean * self.t_c[N]
                };
                if contact == Contact::Forward { size } else { -size }
            }
            FrictionModel::StribeckSmooth => {
                self.dry_torque::<N>(omega2);
                self.t[N] = if N == 0 {
                    libm::tanh(omega[0] / self.eps)
                } else {
                    series::chain::<N>(omega[N] / self.eps, &mut self.v_d, &self.sech2)
                };
                let t2 = series::square::<N>(&self.t);
                self.sech2[N] = if N == 0 { 1.0 - t2 } else { -t2 };
                if self.angular {
                    self.harmonics::<N>(theta[N]);
                }
                let forward = combine::<N>(&self.forward, &self.trig);
                let backward = combine::<N>(&self.backward, &self.trig);
                self.even[N] = (forward + backward) / 2.0;
                self.odd[N] = (forward - backward) / 2.0;
                self.bracket[N] = self.even[N] + series::mul::<N>(&self.t, &self.odd);
                self.sign[N] = series::mul::<N>(&self.t, &self.bracket);
                series::mul::<N>(&self.t_c, &self.sign)
            }
        };
        self.tau_f[N] = -self.b * omega[N] - dry;
    }

    /// Coefficient N of T_C(w) = c + d exp(-(w/w_s)^2).
    #[inline(always)]
    fn dry_torque<const N: usize>(&mut self, omega2: &Series) {
        let u = -omega2[N] * self.inv_omega_s2;
        self.e[N] =
            if N == 0 { libm::exp(u) } else { series::chain::<N>(u, &mut self.u_d, &self.e) };
        self.t_c[N] = series::constant::<N>(self.c) + self.d * self.e[N];
    }

    fn harmonics<const N: usize>(&mut self, theta: f64) {
        let [c1, s1, c2, s2] = &mut self.trig;
        let [once_d, twice_d] = &mut self.angles_d;
        (s1[N], c1[N]) = series::sin_cos::<N>(theta, once_d, s1, c1);
        (s2[N], c2[N]) = series::sin_cos::<N>(2.0 * theta, twice_d, s2, c2);
    }
}

/// Coefficient N of B+-(theta).
fn combine<const N: usize>(bracket: &Bracket, trig: &[Series; 4]) -> f64 {
    let mean = series::constant::<N>(bracket.mean);
    let terms = bracket.harmonics.iter().zip(trig);
    mean + terms.map(|(coefficient, series)| coefficient * series[N]).sum::<f64>()
}

//! A craft whose tanks drain: masses, lengths and heights follow the liquid that is left.
//!
//! ```text
//! f  outflow, kg/s: m_liq' = -f;  m_0 = m_liq - sum of m_n   every quantity of the tank's table by m_liq
//! rho = P + l p,  P = d + h e                                a bob from O; h, l, m change
//! m [a + w' x rho + w x (w x rho) + 2 w x rho' + rho''] = -T p - phi       Newton for what stays in the bob
//! T = T_0 - m u.[a; w'],   u = [p; P x p]
//! T_0 = m (l |p'|^2 - p.(w x (w x rho) + 2 w x rho' + P'') - l'') - k l |p_perp|^2
//! p'' = -(1 - p p^T) G/l - |p'|^2 p
//! G = a + w' x rho + w x (w x rho) + 2 w x rho' + P'' + 2 l' p' + (c l/m) p' + (k l/m) p_perp
//! ```
//!
//! Mass leaves a bob with the bob's velocity and the craft with the velocity of the tank at the outlet,
//! r_out = d + z_out e. On its way, along the tank's axis and level to it from the bobs, it has the
//! momentum K against the tank, and the moment of momentum L about O:
//!
//! ```text
//! K = j e + sum of m_n' l p_perp,   j = (m_0 H_0)' + sum of m_n' b_n + f z_out,   b_n = h + l e.p
//! L = d x j e + sum of (d + b_n e) x (m_n' l p_perp)
//! ```
//!
//! What bobs and rigid liquid do to the craft beyond their forces at constant mass keeps the momentum of
//! everything, with the flow that leaves, to the letter:
//!
//! ```text
//! force  = -2 w x K - K' - sum of m_n' rho_n'
//! torque = -I_0' w - sum of m_n' (rho x (w x rho) + rho x rho') - f r_out x (w x r_out) - w x L - L'
//! ```
//!
//! I_0: the rigid liquid about O.
//!
//! Source: momentum and moment of momentum of a volume fixed in the craft, with d(m s)/dt = K - f r_out.

use crate::integrator::{RATE_FLOOR, StepError, advance_by_extrapolation};
use crate::motion::SCALE_TIME;
use crate::outputs::{BobNow, Now, TankNow};
use crate::parameters::{MODES, Mount, Parameters, TANKS, Tank};
use crate::rigid::{Factors, Rigid};
use crate::state::{INPUTS, Inputs, Line, STATES, index};
use crate::table::POINTS;
use crate::vector::{
    Dual, Mat3, Number, Vec3, add, constant, cross, dot, largest, on_sphere, rotation, scale, sub,
    times, transposed_times, unit_quaternion,
};

/// What acts from outside, as numbers of the wanted kind.
pub struct Acting<T> {
    pub force: Vec3<T>,
    /// tau - h_w'
    pub torque: Vec3<T>,
    pub h_wheels: Vec3<T>,
    /// Outflow of each tank.
    pub flow: [T; TANKS],
    /// Its slope.
    pub flow_slope: [f64; TANKS],
}

impl Acting<f64> {
    pub fn of(inputs: &Inputs, t: f64) -> Acting<f64> {
        let Inputs { force, torque, h_wheels, mass_flow } = inputs;
        Acting {
            force: force.at(t),
            torque: sub(torque.at(t), h_wheels.slope),
            h_wheels: h_wheels.at(t),
            flow: mass_flow.map(|flow| flow.at(t)),
            flow_slope: mass_flow.map(|flow| flow.slope),
        }
    }
}

impl Acting<Dual> {
    /// With derivatives along du.
    pub fn along(inputs: &Inputs, du: &[f64; INPUTS]) -> Acting<Dual> {
        let now = Acting::of(inputs, 0.0);
        let with = |x: Vec3, at: usize| [0, 1, 2].map(|i| Dual::of(x[i], du[at + i]));
        Acting {
            force: with(now.force, 0),
            torque: with(now.torque, 3),
            h_wheels: with(now.h_wheels, 6),
            flow: core::array::from_fn(|i| Dual::of(now.flow[i], du[9 + i])),
            flow_slope: now.flow_slope,
        }
    }
}

/// What the errors of a step of length `h` are compared with, from states and rates.
fn error_scale(x: &[f64; STATES], rate: &[f64; STATES], h: f64) -> [f64; STATES] {
    let time = h.min(SCALE_TIME);
    let size = |at: usize| largest(vec_of(x, at)) + largest(vec_of(rate, at)) * time;
    let turn = RATE_FLOOR + size(index::OMEGA);
    // Work, dissipation and liquid follow from the rest.
    let mut scale = [f64::INFINITY; STATES];
    scale[..index::OMEGA].fill(1.0);
    scale[index::OMEGA..index::POSITION].fill(turn);
    scale[index::POSITION..index::VELOCITY].fill(RATE_FLOOR + size(index::POSITION));
    scale[index::VELOCITY..index::WORK].fill(RATE_FLOOR + size(index::VELOCITY));
    for at in (index::BOBS..index::LIQUID).step_by(6) {
        scale[at..at + 3].fill(1.0);
        scale[at + 3..at + 6].fill(turn + size(at + 3));
    }
    scale
}

/// A tank in its place.
#[derive(Clone, Debug)]
struct Place {
    tank: Tank,
    axes: Mat3,
    e: Vec3,
    d: Vec3,
}

/// A craft with at least one tank that can drain.
#[derive(Clone, Debug)]
pub struct Draining {
    craft: Rigid,
    mount: Mount,
    gravity: Vec3,
    tanks: Vec<Place>,
}

/// A quantity and its first two derivatives by time.
type Jet<T> = [T; 3];

fn jet<T: Number>(x: f64) -> Jet<T> {
    [x, 0.0, 0.0].map(T::constant)
}

/// A bob, with what its equation has besides [a; w'].
struct Swing<T> {
    m: T,
    l: T,
    p: Vec3<T>,
    p_d: Vec3<T>,
    rho: Vec3<T>,
    rho_d: Vec3<T>,
    /// [p; P x p]
    u: [T; 6],
    t_0: T,
    /// phi, and G without a + w' x rho
    phi: Vec3<T>,
    known: Vec3<T>,
    centring: T,
}

/// A tank's contents at an instant.
struct Contents<T> {
    rigid: Rigid<T>,
    /// Force and torque about O that the flow within makes.
    stirring: [Vec3<T>; 2],
    /// K and L.
    stir: [Vec3<T>; 2],
    bobs: [Option<Swing<T>>; MODES],
    /// Power dissipated, W.
    dissipation: T,
}

fn vec_of<T: Number>(x: &[T], at: usize) -> Vec3<T> {
    [x[at], x[at + 1], x[at + 2]]
}

impl Place {
    fn new(tank: &Tank) -> Place {
        let axes = rotation(&unit_quaternion(tank.q));
        Place { tank: *tank, axes, e: axes.map(|row| row[2]), d: tank.position }
    }

    /// x: p and p' of each mode, tank axes; `liquid` and `flow` count for tanks with a table.
    fn contents<T: Number>(
        &self,
        x: &[T],
        w: Vec3<T>,
        liquid: T,
        flow: T,
        slope: f64,
    ) -> Contents<T> {
        let Place { tank, axes, .. } = self;
        let table = &tank.fill;
        let drains = table.points > 0;
        let c = T::constant;
        let flow = if drains { flow } else { c(0.0) };
        let slope = if drains { slope } else { 0.0 };
        // By the mass of liquid, m' = -f, m'' = -f'.
        let follow = |y: &[f64; POINTS], constant: f64| -> Jet<T> {
            if !drains {
                return jet(constant);
            }
            let [value, first, second] = table.at(y, liquid);
            [value, -(first * flow), second * flow * flow - first * slope]
        };
        let (e, d) = (constant::<T>(self.e), constant::<T>(self.d));
        let outlet = add(d, e.map(|x| x * tank.outlet));
        let mut m_0 = if drains { [liquid, -flow, c(-slope)] } else { jet(tank.m_0) };
        let axes: Mat3<T> = axes.map(constant);
        let zero = constant::<T>([0.0; 3]);
        let mut bobs = [(); MODES].map(|()| None);
        // K and L without the axial part, with their derivatives; sum of m_n' b_n and its derivative.
        let (mut level, mut level_d) = ([zero; 2], [zero; 2]);
        let mut sinking = [c(0.0); 2];
        let mut stirring = [zero; 2];
        let mut dissipation = c(0.0);
        for n in 0..tank.modes {
            let m = follow(&table.mass[n], tank.mass[n]);
            let l = follow(&table.length[n], tank.length[n]);
            let h = follow(&table.hinge[n], tank.hinge[n]);
            let k = tank.k[n];
            if drains {
                m_0 = [m_0[0] - m[0], m_0[1] - m[1], m_0[2] - m[2]];
            }
            let p = times(&axes, vec_of(x, 6 * n));
            let p_d = times(&axes, vec_of(x, 6 * n + 3));
            let [p, p_d] = on_sphere(p, p_d);
            let hinge = add(d, scale(h[0], e));
            let rho = add(hinge, scale(l[0], p));
            let rho_d = add(add(scale(h[1], e), scale(l[1], p)), scale(l[0], p_d));
            let (height, height_d) = (dot(e, p), dot(e, p_d));
            let p_perp = sub(p, scale(height, e));
            let p_perp_d = sub(p_d, scale(height_d, e));
            // c = 2 zeta m sqrt(g_ref/l + k/m)
            let stiffness = l[0].recip() * tank.g_ref + m[0].recip() * k;
            let drag = m[0] * stiffness.sqrt() * (2.0 * tank.zeta[n]);
            let phi = add(scale(drag * l[0], p_d), scale(l[0] * k, p_perp));
            let centripetal = add(cross(w, cross(w, rho)), cross(w, rho_d).map(|x| x * 2.0));
            let settling = add(centripetal, scale(h[2], e));
            let t_0 = m[0] * (l[0] * dot(p_d, p_d) - dot(p, settling) - l[2])
                - l[0] * dot(p_perp, p_perp) * k;
            let known = add(add(settling, scale(l[1] * 2.0, p_d)), scale(m[0].recip(), phi));
            let turned = cross(hinge, p);
            // What leaves the bob.
            let b = h[0] + l[0] * height;
            let b_d = h[1] + l[1] * height + l[0] * height_d;
            let lost = scale(m[1] * l[0], p_perp);
            let lost_d =
                add(scale(m[2] * l[0] + m[1] * l[1], p_perp), scale(m[1] * l[0], p_perp_d));
            let foot = add(d, scale(b, e));
            sinking = [sinking[0] + m[1] * b, sinking[1] + m[2] * b + m[1] * b_d];
            level = [add(level[0], lost), add(level[1], cross(foot, lost))];
            level_d = [
                add(level_d[0], lost_d),
                add(level_d[1], add(cross(foot, lost_d), cross(scale(b_d, e), lost))),
            ];
            let speed = add(cross(w, rho), rho_d);
            stirring = [
                sub(stirring[0], scale(m[1], rho_d)),
                sub(stirring[1], scale(m[1], cross(rho, speed))),
            ];
            dissipation = dissipation + drag * l[0] * l[0] * dot(p_d, p_d);
            bobs[n] = Some(Swing {
                m: m[0],
                l: l[0],
                p,
                p_d,
                rho,
                rho_d,
                u: [p[0], p[1], p[2], turned[0], turned[1], turned[2]],
                t_0,
                phi,
                known,
                centring: l[0] * l[0] * dot(p_perp, p_perp) * (0.5 * k),
            });
        }
        let h_0 = follow(&table.h_0, tank.h_0);
        let [i_0, i_z] = [follow(&table.i_0, tank.i_0), follow(&table.i_z, tank.i_z)];
        // The rigid liquid about O.
        let s = add(d, scale(h_0[0], e));
        let s_d = scale(h_0[1], e);
        let rigid = Rigid::axial(m_0[0], s, i_0[0], i_z[0], e);
        if drains {
            let moment = m_0[1] * h_0[0] + m_0[0] * h_0[1];
            let moment_d = m_0[2] * h_0[0] + m_0[1] * h_0[1] * 2.0 + m_0[0] * h_0[2];
            let j = moment + sinking[0] + flow * tank.outlet;
            let j_d = moment_d + sinking[1] + c(slope * tank.outlet);
            let axial = scale(j, e);
            let axial_d = scale(j_d, e);
            level = [add(level[0], axial), add(level[1], cross(d, axial))];
            level_d = [add(level_d[0], axial_d), add(level_d[1], cross(d, axial_d))];
            let [k, l] = level;
            let force = add(cross(w, k).map(|x| x * 2.0), level_d[0]);
            // I_0' w
            let along = dot(e, w);
            let own = add(scale(i_0[1], w), scale((i_z[1] - i_0[1]) * along, e));
            let shrinking = scale(m_0[1], cross(s, cross(w, s)));
            let moving = scale(m_0[0], add(cross(s_d, cross(w, s)), cross(s, cross(w, s_d))));
            let leaving = scale(flow, cross(outlet, cross(w, outlet)));
            let torque = [own, shrinking, moving, leaving, cross(w, l), level_d[1]];
            stirring = [
                sub(stirring[0], force),
                torque.into_iter().fold(stirring[1], |sum, part| sub(sum, part)),
            ];
        }
        Contents { rigid, stirring, stir: level, bobs, dissipation }
    }
}

impl Draining {
    /// `None` if no tank can drain.
    pub fn new(p: &Parameters) -> Option<Draining> {
        let tanks = &p.tank[..p.tanks];
        tanks.iter().any(|tank| tank.fill.points > 0).then(|| Draining {
            craft: Rigid::of_craft(&p.craft),
            mount: p.mount,
            gravity: p.gravity,
            tanks: tanks.iter().map(|tank| Place::new(&tank.resolve())).collect(),
        })
    }

    /// The tanks as they are with that much liquid.
    pub fn tanks<'a>(&'a self, x: &'a [f64; STATES]) -> [Tank; TANKS] {
        core::array::from_fn(|i| match self.tanks.get(i) {
            Some(place) => Tank { liquid_0: x[index::LIQUID + i], ..place.tank }.resolve(),
            None => Tank::default(),
        })
    }

    /// Whether the flows can go on for `h`.
    pub fn check(&self, x: &[f64; STATES], flow: &[Line; TANKS], h: f64) -> Result<(), StepError> {
        for (i, flow) in flow.iter().enumerate() {
            let table = self.tanks.get(i).map(|place| &place.tank.fill);
            let Some(table) = table.filter(|table| table.points > 0) else { continue };
            let ends = [table.liquid[0], table.liquid[table.points - 1]];
            // Where the flow turns, and at the end.
            let turn = (-flow.value / flow.slope).clamp(0.0, h);
            for t in [if turn.is_finite() { turn } else { h }, h] {
                let liquid = x[index::LIQUID + i] - flow.integral(t);
                let slack = 1e-12 * ends[1];
                // NaN is beyond, too.
                if !(ends[0] - slack..=ends[1] + slack).contains(&liquid) {
                    return Err(StepError::BeyondTable { tank: i + 1, liquid, ends });
                }
            }
        }
        Ok(())
    }

    /// The first time after `t` at which a tank passes a point of its table, or `h`.
    fn next_point(&self, x: &[f64; STATES], flow: &[Line; TANKS], t: f64, h: f64) -> f64 {
        let mut next = h;
        for (i, (place, flow)) in self.tanks.iter().zip(flow).enumerate() {
            for point in place.tank.fill.masses() {
                // f t + f' t^2/2 = gone
                let gone = x[index::LIQUID + i] - point;
                let root = libm::sqrt(flow.value * flow.value + 2.0 * flow.slope * gone);
                let sum = flow.value + if flow.value < 0.0 { -root } else { root };
                for at in [2.0 * gone / sum, sum / flow.slope] {
                    if at > t + 1e-9 * h && at < next {
                        next = at;
                    }
                }
            }
        }
        next
    }

    /// Moves the states on by `h`.
    pub fn advance(
        &self,
        x: &mut [f64; STATES],
        inputs: &Inputs,
        h: f64,
        tolerance: f64,
    ) -> Result<(), StepError> {
        self.check(x, &inputs.mass_flow, h)?;
        let start = *x;
        let mut rates = |t: f64, x: &[f64; STATES]| self.evaluate(x, &Acting::of(inputs, t)).0;
        let mut t = 0.0;
        while t < h {
            let end = self.next_point(&start, &inputs.mass_flow, t, h);
            let scale = error_scale(x, &rates(t, x), end - t);
            advance_by_extrapolation(&mut rates, x, (t, end), &scale, tolerance)?;
            let q = unit_quaternion([x[0], x[1], x[2], x[3]]);
            x[index::Q..index::Q + 4].copy_from_slice(&q);
            for at in (index::BOBS..index::LIQUID).step_by(6) {
                let [p, p_d] = on_sphere(vec_of(x, at), vec_of(x, at + 3));
                x[at..at + 3].copy_from_slice(&p);
                x[at + 3..at + 6].copy_from_slice(&p_d);
            }
            for (i, flow) in inputs.mass_flow.iter().enumerate() {
                x[index::LIQUID + i] = start[index::LIQUID + i] - flow.integral(end);
            }
            t = end;
        }
        Ok(())
    }

    /// The rates of the states, and what the outputs follow from.
    pub fn evaluate<T: Number>(
        &self,
        x: &[T; STATES],
        acting: &Acting<T>,
    ) -> ([T; STATES], Now<T>) {
        let c = T::constant;
        let zero = constant::<T>([0.0; 3]);
        let q = unit_quaternion([x[0], x[1], x[2], x[3]]);
        let axes = rotation(&q);
        let w = vec_of(x, index::OMEGA);
        let velocity = transposed_times(&axes, vec_of(x, index::VELOCITY));
        let contents: [Option<Contents<T>>; TANKS] = core::array::from_fn(|i| {
            let place = self.tanks.get(i)?;
            let liquid = x[index::LIQUID + i];
            let bobs = &x[index::bob(i, 0)..index::bob(i, 0) + 6 * MODES];
            Some(place.contents(bobs, w, liquid, acting.flow[i], acting.flow_slope[i]))
        });
        let all = || contents.iter().flatten();
        let rigid = all().fold(self.craft.lift::<T>(), |sum, tank| sum.and(&tank.rigid));
        let [centripetal, gyroscopic] = rigid.inertial_wrench(zero, w, zero);
        let mut force = sub(acting.force, centripetal);
        let mut torque = sub(acting.torque, add(gyroscopic, cross(w, acting.h_wheels)));
        let mut matrix = rigid.mass_matrix();
        for tank in all() {
            force = add(force, tank.stirring[0]);
            torque = add(torque, tank.stirring[1]);
            for bob in tank.bobs.iter().flatten() {
                let pull = add(scale(bob.t_0, bob.p), bob.phi);
                force = add(force, pull);
                torque = add(torque, cross(bob.rho, pull));
                for i in 0..6 {
                    for k in 0..6 {
                        matrix[i][k] = matrix[i][k] + bob.m * bob.u[i] * bob.u[k];
                    }
                }
            }
        }
        if self.mount == Mount::Pivot {
            let a = transposed_times(&axes, constant(self.gravity)).map(|x| -x);
            for i in 0..3 {
                let coupled = [matrix[3 + i][0], matrix[3 + i][1], matrix[3 + i][2]];
                torque[i] = torque[i] - dot(coupled, a);
            }
            for i in 0..3 {
                for k in 0..6 {
                    let one = c(if i == k { 1.0 } else { 0.0 });
                    (matrix[i][k], matrix[k][i]) = (one, one);
                }
            }
            force = a;
        }
        let [a, w_d] = Factors::of(&matrix).solve([force, torque]);

        let mut rate = [c(0.0); STATES];
        let mut put = |at: usize, numbers: &[T]| {
            rate[at..at + numbers.len()].copy_from_slice(numbers);
        };
        // q o (0, w)/2
        let v = [q[1], q[2], q[3]];
        let turned = add(scale(q[0], w), cross(v, w)).map(|x| x * 0.5);
        put(index::Q, &[dot(v, w) * -0.5, turned[0], turned[1], turned[2]]);
        put(index::OMEGA, &w_d);
        if self.mount == Mount::Free {
            put(index::POSITION, &vec_of(x, index::VELOCITY));
            put(index::VELOCITY, &times(&axes, a));
        }
        put(index::WORK, &[dot(acting.force, velocity) + dot(acting.torque, w)]);
        let dissipation = all().fold(c(0.0), |sum, tank| sum + tank.dissipation);
        put(index::DISSIPATED, &[dissipation]);
        let mut tanks = [(); TANKS].map(|()| None);
        for (i, (tank, place)) in all().zip(&self.tanks).enumerate() {
            if place.tank.fill.points > 0 {
                put(index::LIQUID + i, &[-acting.flow[i]]);
            }
            let [f, tau] = tank.rigid.inertial_wrench(a, w, w_d);
            let mut wrench = [sub(tank.stirring[0], f), sub(tank.stirring[1], tau)];
            let mut bobs = [(); MODES].map(|()| None);
            for (n, bob) in tank.bobs.iter().flatten().enumerate() {
                let u = bob.u;
                let along = dot([u[0], u[1], u[2]], a) + dot([u[3], u[4], u[5]], w_d);
                let pull = add(scale(bob.t_0 - bob.m * along, bob.p), bob.phi);
                let turning = cross(bob.rho, pull);
                wrench = [add(wrench[0], pull), add(wrench[1], turning)];
                let g = add(add(a, cross(w_d, bob.rho)), bob.known);
                let across = sub(g, scale(dot(bob.p, g), bob.p));
                let p_dd = add(scale(bob.l.recip(), across), scale(dot(bob.p_d, bob.p_d), bob.p));
                let axes: Mat3<T> = place.axes.map(constant);
                let at = index::bob(i, n);
                put(at, &transposed_times(&axes, bob.p_d));
                put(at + 3, &transposed_times(&axes, p_dd).map(|x| -x));
                bobs[n] = Some(BobNow {
                    m: bob.m,
                    rho: bob.rho,
                    rate: bob.rho_d,
                    in_tank: transposed_times(&axes, bob.p),
                    wave: place.tank.wave[n],
                    centring: bob.centring,
                });
            }
            tanks[i] = Some(TankNow { rigid: tank.rigid, stir: tank.stir, wrench, bobs });
        }
        let now = Now {
            a,
            w,
            w_d,
            velocity,
            h_wheels: acting.h_wheels,
            axes,
            mount: self.mount,
            craft: self.craft,
            tanks,
        };
        (rate, now)
    }
}

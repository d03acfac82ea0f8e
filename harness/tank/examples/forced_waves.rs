//! Compares forced waves of the slosh mass with fully nonlinear potential flow (`src/large_waves/forced.rs`), with a damping
//! ratio of 0.01 on every mode.
//!
//! ```text
//! cargo run --release -p hubslosh-tank --features studies --example forced_waves -- sphere circle 9 4 0.2 0.4 0.6
//! ```
//!
//! prints one row for each wave in a tank that moves on a line (`line`) or on a circle (`circle`): the fill; the frequency
//! divided by the frequency of small waves; the acceleration over g; and the wave's largest slosh angle, phase (degrees) and
//! force over the weight of the slosh mass. Then follow the errors of the third-order slosh mass in angle (%), phase
//! (degrees) and force (%), and the same errors of the slosh mass with the wave's energy, if its coefficients are known. In
//! the command, 9 is the degree of the harmonics, 4 the largest multiple of the frequency, and the fills
//! follow. A fill takes about a minute.
//!
//! With `swirl` the tank moves on a line while its liquid rotates. After one fill follow the forcings: frequency ratio,
//! acceleration over g and damping ratio, for example
//!
//! ```text
//! cargo run --release -p hubslosh-tank --features studies --example forced_waves -- cylinder swirl 9 4 0.5 1.001,0.0014,0.003
//! ```
//!
//! Each row has the forcing; the largest slosh angle, the phase along the line and the force; amplitude and phase
//! across the line; and, after `|`, the same five numbers of the slosh mass. A forcing takes about 15 seconds.
use std::f64::consts::{PI, TAU};

use formulas::energy_terms::EnergyTerms;
use hubslosh_tank::forced::{Forced, ForcedWave, PHASES, Space, Walls, first_harmonic};
use hubslosh_tank::{Tank, finite_amplitude};

/// Slosh mass in steady motion. Its displacement q and its momentum are in units in which mass,
/// length and specific force are 1.
#[derive(Clone, Copy)]
struct Bob {
    terms: EnergyTerms,
    zeta: f64,
}

impl Bob {
    fn rates(&self, [x, y, p_x, p_y]: [f64; 4], [a_x, a_y]: [f64; 2]) -> [f64; 4] {
        let EnergyTerms { pair: [s, kappa], next: [s_2, kappa_2], rotary: [t, t_2], .. } =
            self.terms;
        let u = x * x + y * y;
        let root = (1.0 - u).sqrt();
        let z_1 = 0.5 / root + 0.25 * (kappa - 1.0) * u + 0.1875 * kappa_2 * u * u;
        let z_2 = 0.25 / root.powi(3) + 0.25 * (kappa - 1.0) + 0.375 * kappa_2 * u;
        let along = 4.0 * z_1 * z_1 + s - 1.0 + s_2 * u;
        let along_1 = 8.0 * z_1 * z_2 + s_2;
        let (round, round_1) = (t + t_2 * u, t_2);
        let sigma = (x * p_x + y * p_y) / (1.0 + along * u);
        let tau = (x * p_y - y * p_x) / (1.0 + round * u);
        let v =
            [p_x - along * sigma * x + round * tau * y, p_y - along * sigma * y - round * tau * x];
        let central = along_1 * sigma * sigma + round_1 * tau * tau - 2.0 * z_1;
        let drag = 2.0 * self.zeta;
        [
            v[0],
            v[1],
            along * sigma * v[0] + round * tau * v[1] + central * x - a_x - drag * p_x,
            along * sigma * v[1] - round * tau * v[0] + central * y - a_y - drag * p_y,
        ]
    }

    /// Integrates the motion of the slosh mass over `periods` periods, starting from the state of
    /// `wave` and with the same forcing, and returns the last period.
    fn steady(&self, wave: &ForcedWave, periods: usize) -> Option<ForcedWave> {
        let steps = 2 * PHASES;
        let h = TAU / wave.ratio / steps as f64;
        let push = |tau: f64| {
            let (sin, cos) = tau.sin_cos();
            wave.push.map(|[c, s]| c * cos + s * sin)
        };
        let rate = |q: &[f64]| wave.ratio * first_harmonic(q)[1];
        let start = [wave.q[0][0], wave.q[1][0]];
        let v = [rate(&wave.q[0]), rate(&wave.q[1])];
        // the momentum of the slosh mass, computed from its velocity
        let mut x = [start[0], start[1], v[0], v[1]];
        for _ in 0..50 {
            let r = self.rates(x, [0.0; 2]);
            x[2] += v[0] - r[0];
            x[3] += v[1] - r[1];
        }
        let mut q = [Vec::new(), Vec::new()];
        for k in 0..periods * steps {
            if k >= (periods - 1) * steps && k % 2 == 0 {
                q[0].push(x[0]);
                q[1].push(x[1]);
            }
            let tau = TAU * k as f64 / steps as f64;
            let d = TAU / steps as f64;
            let add = |x: [f64; 4], k: [f64; 4], h: f64| core::array::from_fn(|i| x[i] + h * k[i]);
            let k_1 = self.rates(x, push(tau));
            let k_2 = self.rates(add(x, k_1, 0.5 * h), push(tau + 0.5 * d));
            let k_3 = self.rates(add(x, k_2, 0.5 * h), push(tau + 0.5 * d));
            let k_4 = self.rates(add(x, k_3, h), push(tau + d));
            x = core::array::from_fn(|i| {
                x[i] + h / 6.0 * (k_1[i] + 2.0 * k_2[i] + 2.0 * k_3[i] + k_4[i])
            });
            let r2 = x[0] * x[0] + x[1] * x[1];
            if r2.is_nan() || r2 >= 0.6 {
                return None;
            }
        }
        Some(ForcedWave { q, push: wave.push, ratio: wave.ratio })
    }
}

fn degrees(sine: f64) -> f64 {
    sine.min(1.0).asin().to_degrees()
}

fn largest(q: &[Vec<f64>; 2]) -> f64 {
    (0..PHASES).map(|i| q[0][i].hypot(q[1][i])).fold(0.0, f64::max)
}

/// Returns the amplitude of the first harmonic of the displacement along `axis`, and its phase
/// relative to the acceleration along x, degrees.
fn phase(wave: &ForcedWave, axis: usize) -> [f64; 2] {
    let [c, s] = first_harmonic(&wave.q[axis]);
    let [a, b] = wave.push[0];
    let turn = (-s).atan2(c) + b.atan2(a);
    let turn = (turn + PI).rem_euclid(TAU) - PI;
    [c.hypot(s), turn.to_degrees()]
}

fn summary(wave: &ForcedWave, share: f64) -> [f64; 4] {
    let [_, turn] = phase(wave, 0);
    let force = largest(&wave.force(share));
    [largest(&wave.q), turn, force, wave.push[0][0].hypot(wave.push[0][1])]
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [shape, motion, degree, order, fills @ ..] = &arguments[..] else {
        println!("usage: forced_waves sphere|cylinder line|circle DEGREE ORDER FILL...");
        println!("       forced_waves sphere|cylinder swirl DEGREE ORDER FILL RATIO,PUSH,ZETA...");
        return;
    };
    let height = if shape == "cylinder" { ", height = 4.0" } else { "" };
    let text = format!("density = 1000.0\nshape = {{ {shape} = {{ radius = 1.0{height} }} }}");
    let tank = Tank::parse(&text, std::path::Path::new("")).unwrap();
    let resolution = [degree, order].map(|number| number.parse().unwrap());
    let filled = |fill: &String| Filled::new(&tank, fill.parse().unwrap());
    if motion == "swirl" {
        let forcing = |text: &String| {
            let mut parts = text.split(',').map(|part| part.parse().unwrap());
            core::array::from_fn(|_| parts.next().unwrap())
        };
        let forcings: Vec<[f64; 3]> = fills[1..].iter().map(forcing).collect();
        filled(&fills[0]).swirl(resolution, &forcings);
        return;
    }
    for fill in fills {
        filled(fill).steady(motion == "circle", resolution);
    }
}

const ZETA: f64 = 0.01;

struct Filled {
    fill: f64,
    share: f64,
    walls: Walls,
    shifts: [f64; 2],
    bobs: Vec<Bob>,
}

impl Filled {
    fn new(tank: &Tank, fill: f64) -> Filled {
        let data = tank.solve(fill, 1).unwrap();
        let known = finite_amplitude::amplitude_dependence(tank, &data).mode.unwrap();
        let third = EnergyTerms {
            pair: [known.nonlinear_inertia, known.nonlinear_stiffness],
            next: [0.0; 2],
            rotary: [0.0; 2],
            compared: 0.0,
        };
        let energy = known.energy.map(|of| EnergyTerms {
            pair: [of.nonlinear_inertia, of.nonlinear_stiffness],
            next: [of.nonlinear_inertia_2, of.nonlinear_stiffness_2],
            rotary: [of.rotary_inertia, of.rotary_inertia_2],
            compared: of.frequency_limit,
        });
        Filled {
            fill,
            share: data.modes[0].m / data.m_liq,
            walls: Walls::new(tank, fill).unwrap(),
            shifts: [known.planar, known.circular.unwrap()],
            bobs: [third]
                .into_iter()
                .chain(energy)
                .map(|terms| Bob { terms, zeta: ZETA })
                .collect(),
        }
    }

    /// Computes steady waves of 2 to 14 degrees at the frequency of free waves of 9 degrees and at
    /// frequencies 1 % from it, and prints them with the motion of the slosh masses. The waves
    /// move on a circle if `is_circle` is true, otherwise in a plane.
    fn steady(&self, is_circle: bool, resolution: [usize; 2]) {
        let space = if is_circle { Space::Circle } else { Space::Plane };
        let peak = 1.0 + 0.5 * self.shifts[usize::from(is_circle)] * 9f64.to_radians().powi(2);
        for ratio in [-0.01, 0.0, 0.01].map(|off| peak + off) {
            let forced = Forced::new(&self.walls, space, resolution, [ratio, ZETA]).unwrap();
            let sizes = [2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0].map(|x: f64| x.to_radians().sin());
            for (_, wave) in forced.waves(&[1.0, 0.0], &sizes) {
                let [sine, turn, force, push] = summary(&wave, self.share);
                print!(
                    "{} {ratio:.4} {push:.6} {:.3} {turn:.2} {force:.4}",
                    self.fill,
                    degrees(sine)
                );
                for bob in &self.bobs {
                    let Some(end) = bob.steady(&wave, 150) else { continue };
                    let end = summary(&end, self.share);
                    print!(
                        " | {:+.2} {:+.2} {:+.2}",
                        100.0 * (degrees(end[0]) / degrees(sine) - 1.0),
                        end[1] - turn,
                        100.0 * (end[2] / force - 1.0)
                    );
                }
                println!();
            }
        }
    }

    /// Prints the rotary wave for each forcing, which is a frequency ratio, an acceleration over g,
    /// and a damping ratio. Newton's method starts from the amplitudes and phases of the rotary
    /// motion of a slosh mass with the last coefficients in `bobs`.
    fn swirl(&self, resolution: [usize; 2], forcings: &[[f64; 3]]) {
        for &[ratio, push, zeta] in forcings {
            let bob = Bob { zeta, ..self.bobs[self.bobs.len() - 1] };
            let periods = (1.5 / zeta) as usize;
            let circle = |turn: f64| -> Vec<f64> {
                (0..PHASES).map(|i| 0.15 * (TAU * i as f64 / PHASES as f64 + turn).cos()).collect()
            };
            let q = [circle(PI / 2.0), circle(0.0)];
            let start = ForcedWave { q, push: [[push, 0.0], [0.0; 2]], ratio };
            let start = bob.steady(&start, periods).unwrap();
            let [[x, x_turn], [y, y_turn]] = [0, 1].map(|axis| phase(&start, axis));
            let part = |size: f64, turn: f64| {
                let (sin, cos) = turn.to_radians().sin_cos();
                [size * cos, -size * sin]
            };
            let shape = [part(x, x_turn), part(y, y_turn)].concat();
            let forced = Forced::new(&self.walls, Space::All, resolution, [ratio, zeta]).unwrap();
            let waves = forced.waves(&shape, &[0.3, 0.6, 0.8, 1.0]);
            let Some((near, _)) = waves.last() else { continue };
            let Some(wave) = forced.on_a_line(near, push) else {
                println!("{} {ratio} {push} {zeta} none", self.fill);
                continue;
            };
            let show = |wave: &ForcedWave| {
                let [sine, turn, force, _] = summary(wave, self.share);
                let [y, y_turn] = phase(wave, 1);
                let angle = degrees(sine);
                format!("{angle:.3} {turn:.2} {force:.4} {:.3} {y_turn:.2}", degrees(y))
            };
            let end = bob.steady(&wave, periods).map(|end| show(&end));
            println!(
                "{} {ratio:.4} {push:.6} {zeta} {} | {}",
                self.fill,
                show(&wave),
                end.unwrap_or_default()
            );
        }
    }
}

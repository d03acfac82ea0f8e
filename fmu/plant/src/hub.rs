//! The hub's motion as power series, and gravity across the axis of a tilted bench.

use taylor::number::Number;
use taylor::series::{Series, ZERO, mul_ramp, number};

/// The motion of the hub as power series, as far as liquid and bearing depend on it: its angle `theta`, rad; its rate
/// `omega`, rad/s, and the square of its rate, `omega2`; and its angular acceleration `omega_dot`, rad/s2. `g` is the
/// specific force along the tank's axis, m/s2, with its rate. `damping_reach` is the time, s, over which the series of the
/// liquid's damping are valid.
#[derive(Clone, Debug)]
pub struct HubMotion {
    pub theta: Series,
    pub omega: Series,
    pub omega2: Series,
    pub omega_dot: Series,
    pub g: [f64; 2],
    pub damping_reach: f64,
    pub tilt: Tilt,
}

/// The component of gravity across the axis of a tilted bench, as a power series in the frame of the hub. With the specific
/// force g along the axis, the tangent t of the tilt angle, the azimuth phi of the component, and the angle theta and the
/// rate w of the hub,
///
/// ```text
/// e = g d,   d = t (cos(phi - theta), sin(phi - theta)),   d' = w (d_y, -d_x)
/// ```
///
/// `direction` is d and `e` is e, m/s2. A mass M at the position X has the potential energy -M e.X.
#[derive(Clone, Debug)]
pub struct Tilt {
    pub tangent: f64,
    pub azimuth: f64,
    pub direction: [Series; 2],
    pub e: [Series; 2],
}

impl Tilt {
    const NONE: Tilt = Tilt { tangent: 0.0, azimuth: 0.0, direction: [ZERO; 2], e: [ZERO; 2] };

    /// Computes Taylor coefficient n of gravity's component across the axis, `e`, m/s2, and of `direction`, which is `e`
    /// divided by the specific force along the axis. The specific force is `g`, with its rate. The angle of the hub,
    /// `theta`, must be known up to order n.
    pub fn expand(&mut self, n: usize, theta: &Series, g: &[f64; 2]) {
        if self.tangent == 0.0 {
            return;
        }
        if n == 0 {
            let (sin, cos) = libm::sincos(self.azimuth - theta[0]);
            (self.direction[0][0], self.direction[1][0]) = (self.tangent * cos, self.tangent * sin);
        } else {
            // The series follows from d' = theta' (d_y, -d_x).
            let [x, y] = &self.direction;
            let turned = |d: &Series| {
                (1..=n).map(|j| j as f64 * theta[j] * d[n - j]).sum::<f64>() / n as f64
            };
            let (x_n, y_n) = (turned(y), -turned(x));
            (self.direction[0][n], self.direction[1][n]) = (x_n, y_n);
        }
        for i in 0..2 {
            self.e[i][n] = mul_ramp(n, g, &self.direction[i]);
        }
    }

    /// Returns Taylor coefficient n of the height, m, of a point of the hub above the horizontal plane through the origin,
    /// measured along the axis of the tilted bench. `x(j)` returns Taylor coefficient j of the position of the point in the
    /// hub's frame, m.
    pub fn height(&self, n: usize, x: impl Fn(usize) -> [f64; 2]) -> f64 {
        if self.tangent == 0.0 {
            return 0.0;
        }
        let [d_x, d_y] = &self.direction;
        let term = |j: usize| {
            let [x, y] = x(j);
            x * d_x[n - j] + y * d_y[n - j]
        };
        -(0..=n).map(term).sum::<f64>()
    }

    pub fn now<T: Number>(&self) -> [T; 2] {
        [number(&self.e[0]), number(&self.e[1])]
    }

    /// Returns the height, m, of a point above the horizontal plane through the origin, measured along the axis of the
    /// tilted bench, and the rate of this height, m/s. The point has the position (`x`, `y`), m, and the rate (`x_d`,
    /// `y_d`), m/s, in the frame of a hub that turns at the rate `w`, rad/s.
    pub fn height_now<T: Number>(&self, [x, y]: [T; 2], [x_d, y_d]: [T; 2], w: T) -> [T; 2] {
        let [d_x, d_y]: [T; 2] = [number(&self.direction[0]), number(&self.direction[1])];
        [-(x * d_x + y * d_y), -(x_d * d_x + y_d * d_y + w * (x * d_y - y * d_x))]
    }
}

impl HubMotion {
    pub const REST: HubMotion = HubMotion {
        theta: ZERO,
        omega: ZERO,
        omega2: ZERO,
        omega_dot: ZERO,
        g: [0.0; 2],
        damping_reach: f64::INFINITY,
        tilt: Tilt::NONE,
    };
}

//! The slosh models, and the properties of each model on which the rest of the plant depends. The power series of the
//! modes are in `slosh/`.

use core::f64::consts::FRAC_PI_2;

use formulas::third_order;

macro_rules! models {
    ($($name:ident = $number:literal, $item:literal, $description:literal;)+) => {
        /// Mechanical models of the liquid.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum SloshModel {
            $(#[doc = $description] $name = $number,)+
        }

        impl SloshModel {
            /// All models in the order of their numbers.
            pub const ALL: [SloshModel; [$($number),+].len()] = [$(SloshModel::$name),+];

            /// Items of the FMU's parameter `slosh.model` with their descriptions, in the order of the models' numbers.
            pub const ITEMS: [(&str, &str); SloshModel::ALL.len()] = [$(($item, $description)),+];

            /// Returns the item of the FMU's parameter `slosh.model` that stands for this model.
            pub const fn name(self) -> &'static str {
                SloshModel::ITEMS[self as usize - 1].0
            }
        }
    };
}

models! {
    Frozen = 1, "frozen", "The whole liquid is rigid";
    Linear = 2, "linear", "Linear planar pendulums";
    Planar = 3, "planar", "Nonlinear planar pendulums";
    Spherical = 4, "spherical", "Spherical pendulums: the liquid can rotate";
    Liquid = 5, "liquid", "Modes to third order in their amplitude: of an upright cylinder mode 1 from potential flow, of other tanks by slosh.table";
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Oblique {
    pub stiffness: f64,
    pub share: f64,
}

impl SloshModel {
    pub(crate) fn moves_along_one(self) -> bool {
        match self {
            SloshModel::Frozen | SloshModel::Linear | SloshModel::Planar => true,
            SloshModel::Spherical | SloshModel::Liquid => false,
        }
    }

    /// Returns the largest amplitude for which the slosh model is defined: an angle, rad, or in the model `liquid` a
    /// displacement divided by the pendulum length.
    pub(crate) fn largest_amplitude(self) -> f64 {
        match self {
            SloshModel::Frozen
            | SloshModel::Linear
            | SloshModel::Planar
            | SloshModel::Spherical => FRAC_PI_2,
            SloshModel::Liquid => 1.0,
        }
    }

    /// Returns the relative change of the squared natural frequency per squared slosh angle, in planar and in circular
    /// motion, of a mode with the large-wave coefficients `s` (inertia) and `kappa` (stiffness). `None` stands for a motion
    /// that the model cannot make.
    pub(crate) fn shifts(self, s: f64, kappa: f64) -> [Option<f64>; 2] {
        match self {
            SloshModel::Frozen | SloshModel::Linear => [Some(0.0), None],
            SloshModel::Planar => [Some(third_order::shifts(1.0, 1.0)[0]), None],
            SloshModel::Spherical => third_order::shifts(1.0, 1.0).map(Some),
            SloshModel::Liquid => third_order::shifts(s, kappa).map(Some),
        }
    }

    /// Compares the oblique pendulum that represents a mode on a tilted bench with an upright pendulum. Returns the factors
    /// (F and M at the head of `leaning.rs`) by which its squared frequency (`stiffness`) and its slosh mass (`share`)
    /// differ. `slope` is the tangent of the tilt angle, and `n2` the squared tangential component of the unit vector along
    /// gravity's component across the axis. `s` and `kappa` are the large-wave coefficients of the pendulum.
    pub(crate) fn oblique(self, slope: f64, n2: f64, (s, kappa): (f64, f64)) -> Oblique {
        let s2 = slope * slope;
        match self {
            SloshModel::Frozen | SloshModel::Linear => Oblique { stiffness: 1.0, share: 1.0 },
            SloshModel::Planar => {
                let t = 1.0 + s2 * n2;
                Oblique { stiffness: libm::sqrt(t), share: 1.0 / t }
            }
            SloshModel::Spherical => {
                Oblique { stiffness: libm::sqrt(1.0 + s2), share: 1.0 - n2 * s2 / (1.0 + s2) }
            }
            SloshModel::Liquid => {
                let spring = kappa / 2.0;
                let u = rest(spring, slope);
                let (u2, c2) = (u * u, 1.0 - n2);
                let share = c2 + n2 / (1.0 + s * u2);
                let soft = c2 / (1.0 + spring * u2) + n2 / (1.0 + 3.0 * spring * u2);
                Oblique { stiffness: share / soft, share }
            }
        }
    }
}

/// Returns the displacement u, divided by the pendulum length, at which a nonlinear spring holds a mass on a slope: the
/// solution of u (1 + `spring` u^2) = `slope` by Newton's method. A softening spring has several solutions; the one nearest
/// to 0 is returned if it exists.
fn rest(spring: f64, slope: f64) -> f64 {
    let mut u = if spring > 0.0 { slope } else { 0.0 };
    for _ in 0..60 {
        u -= (u * (1.0 + spring * u * u) - slope) / (1.0 + 3.0 * spring * u * u);
    }
    u
}

//! One estimator for any simulated system. It knows nothing of slosh: a [`Problem`] holds all the data of a system.
//!
//! ```text
//! minimise Σ e_k² + Σ ((z_i − μ_i)/s_i)²,   e = whitened( y_k − (1 + g) y(t_k; z) − b )
//! ```
//!
//! z are the coordinates of the unknowns, y(t; z) is the output of the simulated [`System`], y_k are the measured values, and g
//! and b are the scale error and the bias of a sensor. The second sum holds the priors with mean μ and standard deviation s. Each
//! signal has white noise and a drift, whose sizes are estimated from the residual.
//!
//! * [`search`] looks for the minimum from several starts. Over a whole oscillation the sum of squares has a minimum for each
//!   cycle; therefore a search begins with a short part of the recordings, which grows until it is the whole. Another search
//!   takes the whole recordings at once, with the noise multiplied by 100, by 10 and by 1. A minimum is accepted when two
//!   searches have found it, or if its sum of squares is so small that no other minimum can be lower.
//! * [`hold`] compares zero-order hold, first-order hold and band-limited inputs by their likelihood.
//! * [`profile`] follows an unknown along which the likelihood is no parabola.
//! * [`cause`] tests effects that were not estimated, if the residual is more than noise.
//! * [`draws`] computes intervals as quantiles of draws along the profile. The tolerances of known values are
//!   priors of these draws.

pub mod cause;
pub mod draws;
pub mod fit;
pub mod hold;
pub mod knowledge;
pub mod minimum;
pub mod noise;
pub mod problem;
pub mod profile;
pub mod search;
pub mod solver_error;

pub use fit::Fit;
pub use problem::{Drift, Hold, Motion, Part, Problem, Recorded, Role, Signal, System, Unknown};
pub use search::Solution;

/// Difference of −2 ln L that decides between two explanations (Kass and Raftery 1995: very strong).
pub const DECIDES: f64 = 10.0;
/// Difference of −2 ln L that does not decide between two explanations (Kass and Raftery 1995: not worth more than a bare
/// mention).
pub const ALIKE: f64 = 2.0;
/// Relative standard deviation of an estimate above which its likelihood may not be a parabola.
pub const VAGUE: f64 = 0.05;
/// A step of a finite difference is chosen so that the change of the whitened residuals has about this norm: large enough
/// to exceed the errors of a solver, and small enough for curvature not to matter.
pub const MOVE: f64 = 0.3;
/// Shortest and longest step of a finite difference, as a fraction of the unknown's `reach`.
pub const STEPS: (f64, f64) = (1e-7, 0.2);
/// If the norm of the second difference of the residuals is more than this fraction of the norm of their first difference,
/// errors of the solver may dominate the derivative, and a longer step is tried. For differences that contain only errors
/// of the solver, the fraction is √3.
pub const BEND: f64 = 0.3;
/// Factor by which the step of a finite difference becomes longer if [`BEND`] is exceeded, and by which the damping of
/// Levenberg–Marquardt steps changes.
pub const WIDER: f64 = 8.0;
/// Distance to the minimum, in standard deviations, at which a search ends: 0.5 while starts are compared, and 0.02 in the last
/// search, whose result is reported.
pub const ENDS: (f64, f64) = (0.5, 0.02);
/// Factors of the noise in successive searches over the whole recordings. A large factor gives the priors more weight, so that a
/// start may be far from the minimum.
pub const INFLATIONS: [f64; 3] = [100.0, 10.0, 1.0];
/// Largest number of iterations of a loop that usually ends earlier, for example of the Jacobians of one search.
pub const SETS: usize = 8;
/// Decrease of the sum of squares below which another Jacobian is not worth its simulations, and below which two minima
/// count as equally low.
pub const GAIN: f64 = 0.3;
/// Relative size below which a quantity may be an error of the derivatives, which are finite differences with a relative
/// error of about 0.001.
pub const SEEN: f64 = 1e-2;
/// Largest number of searches in a row, each of which begins at the end of the search before.
pub const ROUNDS: usize = 4;
/// If the standard deviation of a value with the recordings is more than this fraction of its prior standard deviation,
/// the recordings do not determine the value.
pub const PRIOR_ALONE: f64 = 0.9;
/// Absolute correlation of two unknowns above which only a combination of the two is known.
pub const PAIR: f64 = 0.99;
/// Two-sided 95 % quantile of the normal distribution.
pub const Z: f64 = 1.96;
/// Fraction of the forecast decrease that a step must reach for the Jacobian to be updated (Broyden) instead of computed again.
pub const KEPT: f64 = 0.4;

//! One estimator for any simulated system. It knows nothing of slosh: a [`Problem`] is its data.
//!
//! ```text
//! minimise Σ e_k² + Σ ((z_i − μ_i)/s_i)²,   e = whitened( y_k − (1 + g) y(t_k; z) − b )
//! ```
//!
//! y(t; z) is the answer of the [`System`] for the coordinates z of the unknowns, g and b are errors of the sensors, and the second sum
//! holds the priors. Each signal has white noise and a drift, whose sizes are estimated from the residual.
//!
//! [`search`] looks for the minimum from several starts: over beginnings of the recordings that grow to the whole, because over a
//! whole oscillation the sum of squares has a minimum for each cycle, and over the whole at once with the noise counted 100, 10 and 1
//! times. A minimum counts once two searches have found it, or if its sum of squares is so small that no other can be lower.
//! [`hold`] compares how the inputs may run between rows, by the likelihood.
//! [`profile`] follows an unknown whose likelihood is no parabola. [`cause`] tests a residual that is more than noise for effects that
//! were not estimated. [`draws`] gives intervals as quantiles of draws along the profile, with the tolerances of known values as priors.

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
/// Relative standard deviation above which a value is vague, so that its likelihood may not be a parabola.
pub const VAGUE: f64 = 0.05;
/// Change of the residuals that the step of a difference aims at, as the norm of the whitened residuals: large enough to exceed
/// the errors of a solver, small enough for curvature not to matter.
pub const MOVE: f64 = 0.3;
/// Shortest and longest step of a difference, in units of an unknown's reach.
pub const STEPS: (f64, f64) = (1e-7, 0.2);
/// Ratio of the second to the first difference above which errors of a solver may decide a derivative; these errors alone make
/// the ratio √3.
pub const BEND: f64 = 0.3;
/// Factor between the wider steps that are tried if the ratio is above [`BEND`].
pub const WIDER: f64 = 8.0;
/// Distance from a minimum, in standard deviations, up to which a search has converged, because the stated deviations contain it, and
/// at which the last search ends.
pub const ENDS: (f64, f64) = (0.5, 0.02);
/// Factors by which the noise counts in a search over the whole recordings: large ones let the priors lead at first, so that a
/// start may be far from the minimum.
pub const INFLATIONS: [f64; 3] = [100.0, 10.0, 1.0];
/// Most sets of derivatives of a search that goes to the end.
pub const SETS: usize = 8;
/// Fall of the sum of squares below which a set of derivatives is the last one, and a minimum is no lower than another.
pub const GAIN: f64 = 0.3;
/// Part of a quantity below which it does not differ from errors of the derivatives, which are differences and good to a
/// thousandth.
pub const SEEN: f64 = 1e-2;
/// Largest number of rounds of a search each of which begins at the end of the round before.
pub const ROUNDS: usize = 4;
/// If the standard deviation of a value with the recordings is more than this fraction of its prior standard deviation,
/// the recordings do not determine the value.
pub const PRIOR_ALONE: f64 = 0.9;
/// Correlation, without its sign, above which only a combination of two unknowns is known.
pub const PAIR: f64 = 0.99;
/// Two-sided 95 % of the normal distribution.
pub const Z: f64 = 1.96;
/// Part of the forecast that a step must gain for the derivatives to be kept.
pub const KEPT: f64 = 0.4;

use analysis::innovations::{self, Tests};

pub const DOES_NOT_FIT: &str = "DOES NOT FIT";
pub const NO_MINIMUM: &str = "The search did not end at a minimum";

/// Beginning of a verdict if the solver's errors are too large to judge the fit.
pub const NOT_JUDGED: &str = "CANNOT BE JUDGED";
/// Beginnings of verdicts whose estimates are not reliable.
pub const DOUBTS: [&str; 3] = [DOES_NOT_FIT, NO_MINIMUM, NOT_JUDGED];

/// Returns a phrase for each test that a residual fails, with the size of the failure in standard deviations of chance. `input`
/// is the name of the signal with which the residual may be correlated.
pub fn failed(tests: &Tests, input: &str) -> Vec<String> {
    let (time, frequency) = (tests.in_time, tests.in_frequency);
    let all = [
        (tests.whiteness, "it is not white".to_string()),
        (time.0, format!("it is too large around {:.1} s", time.1)),
        (frequency.0, format!("it is too large around {:.2} Hz", frequency.1)),
        (tests.torque, format!("it is correlated with {input}")),
        (tests.torque_squared, format!("it is correlated with the square of {input}")),
    ];
    let failed = all.into_iter().filter(|(deviations, _)| *deviations >= innovations::LIMIT);
    failed.map(|(deviations, what)| format!("{what} ({deviations:.0} σ)")).collect()
}

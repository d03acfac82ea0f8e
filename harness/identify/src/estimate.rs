use analysis::statistics::about_mean;
use serde::Serialize;

#[derive(Clone, Debug, Serialize)]
pub struct Estimated {
    pub value: f64,
    /// Standard deviation from noise and tolerances. If the interval is asymmetric, it is the longer side divided by 1.96.
    pub std: f64,
    pub std_noise: f64,
    /// 95 % interval. If the recording does not determine the upper end, it is infinite, and null in JSON; a lower end that is
    /// not determined is 0.
    pub interval: [f64; 2],
    /// True if the recording determines the value: both ends of the interval are finite, and the standard deviation is less than
    /// half the value, unless the value may be zero by nature.
    pub determined: bool,
    pub unit: String,
}

impl Estimated {
    pub fn normal(value: f64, std: f64, unit: &str) -> Self {
        let interval = [value - 1.96 * std, value + 1.96 * std];
        Estimated { value, std, std_noise: std, interval, determined: true, unit: unit.into() }
    }

    /// Returns `amount`, for example a standard deviation, as a percentage of the estimated value. Returns `None` if the
    /// value is zero within its standard deviation, because a percentage would then be meaningless.
    pub fn percent(&self, amount: f64) -> Option<f64> {
        (self.value.abs() > self.std).then(|| 100.0 * amount / self.value)
    }

    /// Returns the change `by` of the value as text: in percent or, if the value is near zero, in its own unit.
    pub fn change(&self, by: f64) -> String {
        match self.percent(by) {
            Some(percent) => format!("{percent:+.2} %"),
            None => format!("{by:+.1e} {}", prose(&self.unit)).trim_end_matches(" 1").into(),
        }
    }
}

/// Sum or product of two unknowns, where the recordings do not determine either of the two.
#[derive(Clone, Debug, Serialize)]
pub struct Combination {
    pub name: String,
    pub of: [String; 2],
    pub value: f64,
    pub std: f64,
    pub unit: String,
    pub correlation: f64,
}

impl Combination {
    pub fn words(&self) -> String {
        format!(
            "{} and {} cannot be distinguished (correlation {:.4}); only {} = {:.6} ± {:.6} {} is determined.",
            self.of[0],
            self.of[1],
            self.correlation,
            self.name,
            self.value,
            self.std,
            prose(&self.unit)
        )
    }
}

pub(crate) fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64
}

/// Returns the share of measured values y that a model explains, %: 100 (1 − ‖r‖/‖y − mean y‖), with the residual r.
pub(crate) fn fit_percent(residual: &[f64], measured: &[f64]) -> f64 {
    100.0 * (1.0 - (mean_square(residual) / mean_square(&about_mean(measured))).sqrt())
}

/// Converts a unit from FMI's spelling to the spelling in prose, for example kg.m2 to kg·m².
pub fn prose(unit: &str) -> String {
    unit.replace('.', "·").replace('2', "²")
}

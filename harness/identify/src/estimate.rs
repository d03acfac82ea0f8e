//! A number with its uncertainty.

use serde::Serialize;

/// An estimated number.
#[derive(Clone, Debug, Serialize)]
pub struct Estimated {
    /// SI.
    pub value: f64,
    /// Standard deviation, everything in it; where the interval is skew, that of its longer side.
    pub std: f64,
    /// Standard deviation from the noise alone.
    pub std_noise: f64,
    /// 95 % interval. Where the recording sets no upper end it is infinite, and null in JSON; no lower end is 0.
    pub interval: [f64; 2],
    /// The recording shows it: both ends are there, and it is known to better than half its size or is near zero by nature.
    pub determined: bool,
    /// Unit as in modelDescription.xml.
    pub unit: String,
}

impl Estimated {
    /// A number whose only uncertainty is noise, normally distributed.
    pub fn normal(value: f64, std: f64, unit: &str) -> Self {
        let interval = [value - 1.96 * std, value + 1.96 * std];
        Estimated { value, std, std_noise: std, interval, determined: true, unit: unit.into() }
    }

    /// A number as a percentage of the value; `None` where the value is zero within its standard deviation, and a share of it
    /// would say nothing.
    pub fn percent(&self, of: f64) -> Option<f64> {
        (self.value.abs() > self.std).then(|| 100.0 * of / self.value)
    }

    /// A change of the value: in percent, or in its own unit.
    pub fn change(&self, by: f64) -> String {
        match self.percent(by) {
            Some(percent) => format!("{percent:+.2} %"),
            None => format!("{by:+.1e} {}", prose(&self.unit)).trim_end_matches(" 1").into(),
        }
    }
}

/// A unit of the FMU as prose has it: kg·m² for kg.m2.
pub fn prose(unit: &str) -> String {
    unit.replace('.', "·").replace('2', "²")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_end_that_is_open_is_null_in_json() {
        let open =
            Estimated { interval: [0.02, f64::INFINITY], ..Estimated::normal(0.1, 0.2, "rad/s") };
        let json = serde_json::to_value(&open).unwrap();
        assert_eq!(json["interval"], serde_json::json!([0.02, null]));
    }
}

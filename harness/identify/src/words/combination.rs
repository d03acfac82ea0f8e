use serde::Serialize;

use crate::estimate::prose;

/// Two unknowns of which the recordings determine only a sum or a product.
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

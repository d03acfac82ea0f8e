use anyhow::Result;
use host::fmu::Fmu;
use names::hubslosh::FrictionModel;
use names::hubslosh::SloshModel::{Frozen, Linear, Planar, Spherical};

use crate::bench::nominal::Nominal;
use crate::bench::system::Target;
use crate::engine::Hold;
use crate::input::recording::Recording;
use crate::input::tolerance::Tolerances;

#[derive(Clone, Debug)]
pub struct Options {
    pub models: Vec<String>,
    pub friction: Vec<String>,
    pub settings: Vec<(String, String)>,
    pub known: Vec<(String, f64, f64)>,
    pub starts: Vec<(String, f64)>,
    /// True to estimate delay, gyro bias and friction asymmetry as well.
    pub sensor_errors: bool,
    /// Effects that the FMU does not model but the fit estimates, such as [`Target::ActuatorLag`].
    pub effects: Vec<Target>,
    /// True to estimate the damping by breaking waves, if the waves of the fit are steep enough.
    pub breaking: bool,
    /// Standard deviation of the gyro's scale about 1, from its data sheet; 0 for an exact scale.
    pub gyro_scale: f64,
    pub tolerances: Tolerances,
    /// Intersample behaviour of the torque; `None` to choose the best by the likelihood.
    pub intersample: Option<Hold>,
    /// True if the rate's time stamps may be early. A negative delay then raises no doubt.
    pub acausal: bool,
    pub validation: Vec<Recording>,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            models: [Frozen, Linear, Planar, Spherical].map(|model| model.name().into()).to_vec(),
            friction: vec![FrictionModel::Stribeck.name().into()],
            settings: Vec::new(),
            known: Vec::new(),
            starts: Vec::new(),
            sensor_errors: true,
            effects: Vec::new(),
            breaking: false,
            gyro_scale: 0.01,
            tolerances: Tolerances::default(),
            intersample: None,
            acausal: false,
            validation: Vec::new(),
        }
    }
}

impl Options {
    pub fn nominal(&self, fmu: &Fmu) -> Result<Nominal> {
        let known = self.known.iter().map(|(name, mean, _)| (name.clone(), *mean));
        let expected: Vec<(String, f64)> = known.chain(self.starts.iter().cloned()).collect();
        Nominal::of(fmu, &self.settings, &expected)
    }
}

//! Lengths of the windows, lags and segments with which the frequency response is estimated. They follow from the
//! frequency band and the duration of the torque, so that slosh with a period of 20 s in a spacecraft is resolved as well
//! as slosh with a period of 0.4 s on a bench. For the thesis's sweep, 1.25 to 3.5 Hz in 2700 s, a window has 24 cycles,
//! the longest lag is 200 s, and a segment has 20 s.

use crate::response::BAND;
use crate::sweep::Sweep;
use crate::{spa, welch};

/// Smallest number of samples per cycle, at the highest frequency of the band, to which a record
/// may be decimated. The sweep of Rubaga's thesis has 14.3 and is not decimated.
const SAMPLES: f64 = 14.0;
const MOST_LAG: f64 = 0.5;

/// Lengths that an estimate of a frequency response from a whole record uses.
///
/// - `lag`: longest lag of [`spa`], s. It contains as many cycles at the centre of the band as 200
///   s contain for the sweep of Rubaga's thesis, but is at most half of the record. The frequency
///   resolution is 1/lag.
/// - `segment`: length of the segments for the coherence, s. For a sweep it is sqrt(1/(3 rate))
///   with the sweep rate in Hz/s, so that six half-overlapping segments contain each frequency. For
///   noise, a segment has as many cycles as 20 s of the sweep of Rubaga's thesis.
/// - `decimation`: number of samples that are averaged to one sample, in torque and rate alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lengths {
    pub lag: f64,
    pub segment: f64,
    pub decimation: usize,
}

impl Lengths {
    /// Returns suitable lengths for a record of `duration` seconds that is sampled every `step`
    /// seconds. `band` is the range of frequencies with the power of the torque, Hz, and `sweep` is
    /// the torque if it is a sweep.
    pub fn for_record(band: (f64, f64), sweep: Option<&Sweep>, duration: f64, step: f64) -> Self {
        let middle = |(from, to): (f64, f64)| (from * to).sqrt();
        let slower = middle(BAND) / middle(band);
        let rate = sweep.map(|sweep| (sweep.f1 - sweep.f0).abs() / sweep.duration);
        Lengths {
            lag: (spa::LAG * slower).min(MOST_LAG * duration),
            segment: rate.map_or(welch::SEGMENT * slower, |rate| (1.0 / (3.0 * rate)).sqrt()),
            decimation: ((1.0 / (step * band.1 * SAMPLES)) as usize).max(1),
        }
    }
}

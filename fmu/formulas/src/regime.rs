//! Range of linear slosh theory, by the wave height at the wall divided by the radius R of the free surface (Rubaga's
//! thesis, section 2.3.5, after Dodge).

/// Class of a wave by its height at the wall, divided by the radius of the free surface. Linear theory is valid below 0.15.
/// Above 0.25 a computed height or force is only an indication.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Regime {
    Linear = 1,
    Transitional = 2,
    Nonlinear = 3,
}

impl Regime {
    pub fn from_ratio(ratio: f64) -> Regime {
        match ratio {
            ratio if ratio < 0.15 => Regime::Linear,
            ratio if ratio <= 0.25 => Regime::Transitional,
            _ => Regime::Nonlinear,
        }
    }

    pub fn from_number(number: u8) -> Option<Regime> {
        [Regime::Linear, Regime::Transitional, Regime::Nonlinear]
            .into_iter()
            .find(|regime| *regime as u8 == number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slosh_regime_changes_at_wave_heights_of_0_15_and_0_25_radii() {
        assert_eq!([0.1499, 0.15].map(Regime::from_ratio), [Regime::Linear, Regime::Transitional]);
        assert_eq!(
            [0.25, 0.2501].map(Regime::from_ratio),
            [Regime::Transitional, Regime::Nonlinear]
        );
        assert_eq!(Regime::from_ratio(f64::NAN), Regime::Nonlinear);
    }

    #[test]
    fn slosh_regimes_and_their_numbers_are_one_to_one() {
        for regime in [Regime::Linear, Regime::Transitional, Regime::Nonlinear] {
            assert_eq!(Regime::from_number(regime as u8), Some(regime));
        }
        assert_eq!([0, 4, 255].map(Regime::from_number), [None; 3]);
    }
}

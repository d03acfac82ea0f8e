//! `--columns time=t,tau_cmd=T_cmd:mNm,omega=gyro_z:deg/s`: which column of a file is which signal, in what
//! unit.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use anyhow::{Context, Error, Result, bail, ensure};

use super::unit::Quantity;

/// A column of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Name in the file, or `#3`: the third.
    pub name: String,
    /// Unit, if it is given.
    pub unit: Option<String>,
}

/// Signals by name, each with its column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    of: BTreeMap<String, Column>,
    /// Rows a second, of files without times.
    rate: Option<f64>,
}

/// The signals that recordings may have, with what they measure.
pub const SIGNALS: [(&str, Quantity); 10] = [
    ("time", Quantity::Time),
    ("tau_cmd", Quantity::Torque),
    ("omega", Quantity::Rate),
    ("omega_x", Quantity::Rate),
    ("omega_y", Quantity::Rate),
    ("theta", Quantity::Angle),
    ("g_axial", Quantity::Acceleration),
    ("wheel_speed", Quantity::Rate),
    ("wave_height", Quantity::Length),
    ("force", Quantity::Force),
];

/// Quantity of a signal.
///
/// # Errors
/// If there is no such signal.
pub fn quantity(signal: &str) -> Result<Quantity> {
    let known = SIGNALS.iter().find(|(name, _)| *name == signal).map(|(_, quantity)| *quantity);
    known.with_context(|| {
        let names: Vec<&str> = SIGNALS.iter().map(|(name, _)| *name).collect();
        format!("{signal} is not a signal of a recording (allowed: {})", names.join(", "))
    })
}

impl FromStr for Columns {
    type Err = Error;

    /// The error lists everything that is wrong with it.
    fn from_str(text: &str) -> Result<Self> {
        Columns::parse(text.split(','), one)
    }
}

/// `SIGNAL=COLUMN[:UNIT]`; what follows the last colon is the unit.
fn one(item: &str) -> Result<(String, Column)> {
    let (signal, column) = named(item)?;
    let quantity = quantity(&signal)?;
    if let Some(unit) = &column.unit {
        ensure!(
            quantity.factor(unit).is_some(),
            "{signal}: \"{unit}\" is not a unit of {quantity} (allowed: {})",
            quantity.units()
        );
    }
    Ok((signal, column))
}

/// The same, of any signal and unit.
fn named(item: &str) -> Result<(String, Column)> {
    let Some((signal, column)) = item.split_once('=') else {
        bail!("\"{item}\" is not SIGNAL=COLUMN or SIGNAL=COLUMN:UNIT")
    };
    let (name, unit) = match column.rsplit_once(':') {
        Some((name, unit)) => (name.trim(), Some(unit.trim().to_string())),
        None => (column.trim(), None),
    };
    ensure!(!name.is_empty(), "\"{item}\" names no column");
    Ok((signal.trim().into(), Column { name: name.into(), unit }))
}

impl fmt::Display for Columns {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for (k, (signal, column)) in self.of.iter().enumerate() {
            write!(f, "{}{signal}={}", if k == 0 { "" } else { "," }, column.name)?;
            if let Some(unit) = &column.unit {
                write!(f, ":{unit}")?;
            }
        }
        Ok(())
    }
}

impl Columns {
    /// Columns of an FMU's variables, `NAME=COLUMN[:UNIT]`, not split at commas.
    ///
    /// # Errors
    /// All that is wrong with them.
    pub fn of_variables<'a>(items: impl IntoIterator<Item = &'a str>) -> Result<Self> {
        Columns::parse(items, named)
    }

    fn parse<'a>(
        items: impl IntoIterator<Item = &'a str>,
        one: impl Fn(&str) -> Result<(String, Column)>,
    ) -> Result<Self> {
        let (mut columns, mut problems) = (BTreeMap::new(), Vec::new());
        for item in items.into_iter().map(str::trim).filter(|item| !item.is_empty()) {
            match one(item) {
                Ok((signal, _)) if columns.contains_key(&signal) => {
                    problems.push(format!("{signal} is given twice"));
                }
                Ok((signal, column)) => drop(columns.insert(signal, column)),
                Err(error) => problems.push(error.to_string()),
            }
        }
        ensure!(problems.is_empty(), "{}", problems.join("; "));
        Ok(Columns { of: columns, rate: None })
    }

    /// The same for files without times, whose rows come this many times a second.
    ///
    /// # Errors
    /// If that is not a positive number.
    pub fn with_rate(self, rate: Option<f64>) -> Result<Self> {
        if let Some(rate) = rate {
            ensure!(
                rate > 0.0 && rate.is_finite(),
                "--rate {rate}: it must be a positive number of rows a second"
            );
        }
        Ok(Columns { rate, ..self })
    }

    /// Rows a second, if the files have no times.
    pub fn rate(&self) -> Option<f64> {
        self.rate
    }

    /// The column of a signal; the one of its own name unless another is given.
    pub fn of(&self, signal: &str) -> Column {
        let own = || Column { name: signal.into(), unit: None };
        self.of.get(signal).cloned().unwrap_or_else(own)
    }

    /// Returns true if the user named the signal's column.
    pub fn names(&self, signal: &str) -> bool {
        self.of.contains_key(signal)
    }

    /// The signals whose columns were given.
    pub fn signals(&self) -> impl Iterator<Item = &str> {
        self.of.keys().map(String::as_str)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_and_units_are_told_apart_and_every_fault_is_named() {
        let columns: Columns = "time=t,tau_cmd=T_cmd:mNm, omega=gyro_z:deg/s".parse().unwrap();
        let column = |name: &str, unit: Option<&str>| Column {
            name: name.into(),
            unit: unit.map(String::from),
        };
        assert_eq!(columns.of("tau_cmd"), column("T_cmd", Some("mNm")));
        assert_eq!(columns.of("time"), column("t", None));
        assert_eq!(columns.of("theta"), column("theta", None));
        let error = "torque=T,omega=w:deg,time".parse::<Columns>().unwrap_err().to_string();
        for words in [
            "torque is not a signal of a recording (allowed: time, tau_cmd,",
            "omega: \"deg\" is not a unit of a rate (allowed: rad/s, mrad/s, deg/s,",
            "\"time\" is not SIGNAL=COLUMN",
        ] {
            assert!(error.contains(words), "{error}");
        }
    }
}

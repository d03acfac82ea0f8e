//! The option `--columns time=t,tau_cmd=T_cmd:mNm,omega=gyro_z:deg/s`, which assigns columns of a file, and
//! their units, to signals.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use anyhow::{Context, Error, Result, bail, ensure};

use super::unit::Quantity;

/// A column of a file, by its name in the file, or `#3` for the third column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    pub name: String,
    pub unit: Option<String>,
}

/// Assignment of a column to each signal by its name, and the rate (rows per second) of files
/// without a time column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    by_signal: BTreeMap<String, Column>,
    rate: Option<f64>,
}

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

/// Returns the quantity, such as a torque or an angle, that a signal of the bench measures.
///
/// # Errors
/// If no signal of the bench has this name.
pub fn quantity(signal: &str) -> Result<Quantity> {
    let known = SIGNALS.iter().find(|(name, _)| *name == signal).map(|(_, quantity)| *quantity);
    known.with_context(|| {
        let names: Vec<&str> = SIGNALS.iter().map(|(name, _)| *name).collect();
        format!("{signal} is not a signal of a recording (allowed: {})", names.join(", "))
    })
}

impl FromStr for Columns {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Columns::parse(text.split(','), parse_signal)
    }
}

/// Parses `SIGNAL=COLUMN[:UNIT]` for a signal of the bench. The text after the last colon is the unit, which
/// must fit the signal's quantity.
fn parse_signal(item: &str) -> Result<(String, Column)> {
    let (signal, column) = parse_variable(item)?;
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

/// Parses `NAME=COLUMN[:UNIT]` for a signal of any name and a unit of any quantity.
fn parse_variable(item: &str) -> Result<(String, Column)> {
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
        for (k, (signal, column)) in self.by_signal.iter().enumerate() {
            write!(f, "{}{signal}={}", if k == 0 { "" } else { "," }, column.name)?;
            if let Some(unit) = &column.unit {
                write!(f, ":{unit}")?;
            }
        }
        Ok(())
    }
}

impl Columns {
    /// Parses columns for the variables of an FMU, `NAME=COLUMN[:UNIT]`. Items are not split at commas,
    /// because names like `p[1,2]` contain them.
    ///
    /// # Errors
    /// Lists all items that are wrong.
    pub fn for_variables<'a>(items: impl IntoIterator<Item = &'a str>) -> Result<Self> {
        Columns::parse(items, parse_variable)
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
        Ok(Columns { by_signal: columns, rate: None })
    }

    /// Sets the rate of files without times, in rows per second.
    ///
    /// # Errors
    /// If the rate is not a positive number.
    pub fn with_rate(self, rate: Option<f64>) -> Result<Self> {
        if let Some(rate) = rate {
            ensure!(
                rate > 0.0 && rate.is_finite(),
                "rate {rate}: it must be a positive number of rows a second"
            );
        }
        Ok(Columns { rate, ..self })
    }

    pub fn rate(&self) -> Option<f64> {
        self.rate
    }

    /// Returns the column of a signal: the given one, otherwise the column with the signal's own name.
    pub fn column(&self, signal: &str) -> Column {
        let own = || Column { name: signal.into(), unit: None };
        self.by_signal.get(signal).cloned().unwrap_or_else(own)
    }

    pub fn names(&self, signal: &str) -> bool {
        self.by_signal.contains_key(signal)
    }

    pub fn signals(&self) -> impl Iterator<Item = &str> {
        self.by_signal.keys().map(String::as_str)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn column_options_are_split_into_columns_and_units_and_every_fault_is_reported() {
        let columns: Columns = "time=t,tau_cmd=T_cmd:mNm, omega=gyro_z:deg/s".parse().unwrap();
        let column = |name: &str, unit: Option<&str>| Column {
            name: name.into(),
            unit: unit.map(String::from),
        };
        assert_eq!(columns.column("tau_cmd"), column("T_cmd", Some("mNm")));
        assert_eq!(columns.column("time"), column("t", None));
        assert_eq!(columns.column("theta"), column("theta", None));
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

//! Meaning of a column's values, by physical, logical and converted type.

use std::fmt;

use anyhow::{Result, bail, ensure};
use chrono::DateTime;
use parquet::basic::{ConvertedType, LogicalType, TimeUnit, Type as Physical};
use parquet::schema::types::ColumnDescriptor;

use super::Time;

/// Unit in which a time is counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tick {
    Day,
    Second,
    Millisecond,
    Microsecond,
    Nanosecond,
}

impl Tick {
    /// Ticks in a second; of a day none.
    fn per_second(self) -> i64 {
        match self {
            Tick::Day | Tick::Second => 1,
            Tick::Millisecond => 1_000,
            Tick::Microsecond => 1_000_000,
            Tick::Nanosecond => 1_000_000_000,
        }
    }

    /// Seconds of a count, correctly rounded.
    fn seconds(self, count: i64) -> f64 {
        match self {
            Tick::Day => count as f64 * 86_400.0,
            tick => count as f64 / tick.per_second() as f64,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Tick::Day => "days",
            Tick::Second => "s",
            Tick::Millisecond => "ms",
            Tick::Microsecond => "us",
            Tick::Nanosecond => "ns",
        }
    }
}

/// A type of times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Temporal {
    pub tick: Tick,
    /// A date, which counts from 1970; else a duration or a time of day.
    pub is_date: bool,
}

impl Temporal {
    /// A count as a date in RFC 3339, if it is one.
    pub fn date(&self, count: i64) -> Option<String> {
        if !self.is_date {
            return None;
        }
        let (seconds, rest) = match self.tick {
            Tick::Day => (count.checked_mul(86_400)?, 0),
            tick => (count.div_euclid(tick.per_second()), count.rem_euclid(tick.per_second())),
        };
        let nanoseconds = rest * (1_000_000_000 / self.tick.per_second());
        Some(DateTime::from_timestamp(seconds, nanoseconds as u32)?.to_rfc3339())
    }
}

/// Meaning of a column's values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Floating-point numbers.
    Real,
    /// Integers.
    Integer { signed: bool },
    /// Integers of 10^−scale each.
    Decimal { scale: i32 },
    /// Floating-point numbers of 16 bits.
    Half,
    /// Times.
    Time(Temporal),
    /// Durations of months, days and milliseconds, 12 bytes.
    Interval,
    /// True and false, which are 1 and 0.
    Boolean,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Kind::Time(Temporal { tick, is_date: true }) => write!(f, "dates in {}", tick.name()),
            Kind::Time(Temporal { tick, .. }) => write!(f, "durations in {}", tick.name()),
            Kind::Interval => f.write_str("durations"),
            Kind::Boolean => f.write_str("true and false"),
            _ => f.write_str("numbers"),
        }
    }
}

fn tick_of(unit: &TimeUnit) -> Tick {
    match unit {
        TimeUnit::MILLIS => Tick::Millisecond,
        TimeUnit::MICROS => Tick::Microsecond,
        TimeUnit::NANOS => Tick::Nanosecond,
    }
}

impl Kind {
    /// The kind of a column; `arrow` is its type by Arrow's schema, where Parquet has none of its own.
    ///
    /// # Errors
    /// What the column holds, if that is not numbers or times.
    pub fn of(column: &ColumnDescriptor, arrow: Option<Temporal>) -> Result<Kind, String> {
        if column.max_rep_level() > 0 {
            return Err("it holds lists".into());
        }
        let time = |tick, is_date| Ok(Kind::Time(Temporal { tick, is_date }));
        let physical = column.physical_type();
        let binary = matches!(physical, Physical::BYTE_ARRAY | Physical::FIXED_LEN_BYTE_ARRAY);
        let integer = matches!(physical, Physical::INT32 | Physical::INT64);
        match column.logical_type_ref() {
            Some(LogicalType::Timestamp(of)) if integer => return time(tick_of(&of.unit), true),
            Some(LogicalType::Time(of)) if integer => return time(tick_of(&of.unit), false),
            Some(LogicalType::Date) if integer => return time(Tick::Day, true),
            Some(LogicalType::Integer(of)) if integer => {
                return Ok(Kind::Integer { signed: of.is_signed });
            }
            Some(LogicalType::Decimal(of)) if integer || binary => {
                return Ok(Kind::Decimal { scale: of.scale });
            }
            Some(LogicalType::Float16) if column.type_length() == 2 => return Ok(Kind::Half),
            Some(other) => return Err(format!("its type is {other:?}")),
            None => {}
        }
        match column.converted_type() {
            ConvertedType::NONE => {}
            ConvertedType::TIMESTAMP_MILLIS if integer => return time(Tick::Millisecond, true),
            ConvertedType::TIMESTAMP_MICROS if integer => return time(Tick::Microsecond, true),
            ConvertedType::TIME_MILLIS if integer => return time(Tick::Millisecond, false),
            ConvertedType::TIME_MICROS if integer => return time(Tick::Microsecond, false),
            ConvertedType::DATE if integer => return time(Tick::Day, true),
            ConvertedType::DECIMAL if integer || binary => {
                return Ok(Kind::Decimal { scale: column.type_scale() });
            }
            ConvertedType::INTERVAL if column.type_length() == 12 => return Ok(Kind::Interval),
            ConvertedType::INT_8
            | ConvertedType::INT_16
            | ConvertedType::INT_32
            | ConvertedType::INT_64
                if integer =>
            {
                return Ok(Kind::Integer { signed: true });
            }
            ConvertedType::UINT_8
            | ConvertedType::UINT_16
            | ConvertedType::UINT_32
            | ConvertedType::UINT_64
                if integer =>
            {
                return Ok(Kind::Integer { signed: false });
            }
            other => return Err(format!("its type is {other}")),
        }
        match physical {
            Physical::INT96 => time(Tick::Nanosecond, true),
            Physical::INT32 | Physical::INT64 => {
                Ok(arrow.map_or(Kind::Integer { signed: true }, Kind::Time))
            }
            Physical::FLOAT | Physical::DOUBLE => Ok(Kind::Real),
            Physical::BOOLEAN => Ok(Kind::Boolean),
            other => Err(format!("its type is {other}")),
        }
    }

    /// Fails unless the column can be the time, in a unit that is known and the one that is stated, if one is.
    pub fn check_time(&self, name: &str, time: &Time) -> Result<()> {
        match (self, time.stated) {
            (Kind::Integer { .. }, None) => bail!(
                "column {name} holds integers, and their unit of time is not known (allowed: dates and durations with their \
                 unit, floating-point numbers in s, integers of a unit that is stated): {}",
                time.remedy
            ),
            (Kind::Time(temporal), Some(stated)) => {
                let own = temporal.tick.seconds(1);
                ensure!(
                    (stated / own - 1.0).abs() < 1e-9,
                    "column {name} holds {self}, but another unit is stated for it, of {stated} s: leave the unit out"
                );
                Ok(())
            }
            (Kind::Interval, Some(_)) => {
                bail!("column {name} holds durations, which have a unit: leave the stated one out")
            }
            _ => Ok(()),
        }
    }

    /// An integer of 32 bits as one of 64.
    pub fn widened(&self, value: i32) -> i64 {
        match self {
            Kind::Integer { signed: false } => i64::from(value as u32),
            _ => i64::from(value),
        }
    }

    /// The number that an integer stands for; times in s, dates from the first one, which becomes the origin.
    pub fn integer(&self, value: i64, origin: &mut Option<i64>) -> f64 {
        match self {
            Kind::Integer { signed: false } => value as u64 as f64,
            Kind::Decimal { scale } => scaled(value as f64, *scale),
            Kind::Time(Temporal { tick, is_date: true }) => {
                let from = *origin.get_or_insert(value);
                match value.checked_sub(from) {
                    Some(count) => tick.seconds(count),
                    None => tick.seconds(value) - tick.seconds(from),
                }
            }
            Kind::Time(Temporal { tick, .. }) => tick.seconds(value),
            _ => value as f64,
        }
    }

    /// The number that bytes stand for.
    pub fn bytes(&self, bytes: &[u8]) -> Result<f64> {
        match (self, bytes) {
            (Kind::Decimal { scale }, [first, ..]) => {
                // two's complement, most significant byte first
                let start = if *first >= 0x80 { -1.0 } else { 0.0 };
                let sum = bytes.iter().fold(start, |sum, byte| 256.0 * sum + f64::from(*byte));
                let exact = || {
                    let bytes = bytes.iter().fold(start as i128, |n, b| (n << 8) | i128::from(*b));
                    bytes as f64
                };
                Ok(scaled(if bytes.len() < 16 { exact() } else { sum }, *scale))
            }
            (Kind::Half, [low, high]) => Ok(half(u16::from_le_bytes([*low, *high]))),
            (Kind::Interval, [m0, m1, m2, m3, d0, d1, d2, d3, s0, s1, s2, s3]) => {
                let months = u32::from_le_bytes([*m0, *m1, *m2, *m3]);
                ensure!(months == 0, "a duration has {months} months, whose length is not known");
                let days = u32::from_le_bytes([*d0, *d1, *d2, *d3]);
                let milliseconds = u32::from_le_bytes([*s0, *s1, *s2, *s3]);
                Ok(f64::from(days) * 86_400.0 + f64::from(milliseconds) / 1000.0)
            }
            _ => bail!("a value of {} bytes is not a number", bytes.len()),
        }
    }
}

/// `value` · 10^−scale; correctly rounded up to 10^22.
fn scaled(value: f64, scale: i32) -> f64 {
    if scale >= 0 { value / 10f64.powi(scale) } else { value * 10f64.powi(-scale) }
}

/// The value of a number of 16 bits (IEEE 754 binary16).
fn half(bits: u16) -> f64 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
    sign * match exponent {
        0 => fraction * 2f64.powi(-24),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction / 1024.0) * 2f64.powi(exponent - 15),
    }
}

/// Nanoseconds since 1970 of a date as Impala and Spark write it: nanoseconds of the day, Julian day.
pub fn of_int96(words: &[u32]) -> Option<i64> {
    let [low, high, day] = words else { return None };
    let in_day = i64::try_from(u64::from(*high) << 32 | u64::from(*low)).ok()?;
    let days = i64::from(*day) - 2_440_588; // the Julian day of 1 January 1970
    days.checked_mul(86_400_000_000_000)?.checked_add(in_day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_decimals_and_dates_have_their_values() {
        assert_eq!(
            [0x3c00, 0xc000, 0x0001, 0x7bff].map(half),
            [1.0, -2.0, 2f64.powi(-24), 65504.0]
        );
        let decimal = Kind::Decimal { scale: 2 };
        assert_eq!(decimal.bytes(&[0xff, 0x85]).unwrap(), -1.23);
        assert_eq!(decimal.bytes(&[0x00, 0x7b]).unwrap(), 1.23);
        assert_eq!(decimal.integer(250, &mut None), 2.5);
        assert_eq!(of_int96(&[1, 0, 2_440_589]), Some(86_400_000_000_001));
        let date = Temporal { tick: Tick::Millisecond, is_date: true };
        assert_eq!(date.date(1_500).unwrap(), "1970-01-01T00:00:01.500+00:00");
    }
}

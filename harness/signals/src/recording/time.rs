//! Parses dates and clock times; all times that are read from text are parsed here.
//!
//! Dates may be written by ISO 8601 (also without separators), as 2026/01/31, 31.01.2026, 31-Jan-2026, Jan
//! 31, 2026, or with slashes or dashes in any order that the file makes unambiguous. Clock times have 24 or
//! 12 hours and any number of decimals, `12:00:00:020`, with an offset from UTC as Z, UTC, +01:00, +0100 or
//! +01. Durations are written as `1 days 00:00:00.02`. A text with two possible meanings is an error.

use chrono::{DateTime, Datelike as _, NaiveDate, NaiveTime, Timelike as _};

const SECOND: i64 = 1_000_000_000;
const DAY: i64 = 86_400 * SECOND;

/// Reason why a field is not read as a time, as a phrase that a message puts after the text of the field.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unreadable {
    #[error("has no date: there is no day {day} of month {month} in {year}")]
    Day { day: u32, month: u32, year: i32 },
    #[error("has no month: neither {0} nor {1} is one")]
    Month(u32, u32),
    #[error(
        "ends in \"{0}\", which is neither an offset from UTC (allowed: Z, UTC, +01:00, +0100) nor AM or PM"
    )]
    Offset(String),
    #[error(
        "is no time of day (allowed: hours, minutes and seconds: 0:00:00 to 23:59:59.999, 12:00:00 AM to 11:59:59 PM, and 3, 6 or \
         9 digits after a fourth colon; in Excel the format hh:mm:ss.000; durations in seconds)"
    )]
    Clock,
    #[error("has day and month in another order than the lines above")]
    OtherOrder,
    #[error(
        "has another date than the lines above, and a year of two digits does not show the order of day, month and \
         year (allowed: years of four digits)"
    )]
    ShortYear,
    #[error(
        "may have the day first or the month, and no date of the file shows which (allowed: 2026-01-31 or 31.01.2026)"
    )]
    UnknownOrder,
    #[error("is a date, where the lines above have none")]
    DateAmongClocks,
    #[error("is a clock time, where the lines above have dates")]
    ClockAmongDates,
    #[error("is a date in another form than those above")]
    OtherForm,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Moment {
    /// Nanoseconds since 1970, UTC unless the text has another offset.
    Date(i64),
    Clock(i64),
    /// A date whose order of day and month is unknown, and nanoseconds since its midnight.
    Ordered(Ordered, i64),
}

/// A date such as 3/4/2026, whose first number may be the day or the month. If the year has two digits
/// (`is_short`), the first number may also be the year.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ordered {
    first: u32,
    second: u32,
    year: i32,
    is_short: bool,
}

impl Ordered {
    /// Returns the date in days since 1970. `day_first` is true if the first number is the day.
    fn day(self, day_first: bool) -> Result<i64, Unreadable> {
        let Ordered { first, second, year, .. } = self;
        let (day, month) = if day_first { (first, second) } else { (second, first) };
        days(year, month, day)
    }
}

fn days(year: i32, month: u32, day: u32) -> Result<i64, Unreadable> {
    let date = NaiveDate::from_ymd_opt(year, month, day);
    let date = date.ok_or(Unreadable::Day { day, month, year })?;
    Ok(i64::from(date.num_days_from_ce()) - 719_163) // 1 January 1970
}

const MONTHS: [&str; 12] =
    ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"];
const WEEKDAYS: [&str; 7] = ["mon", "tue", "wed", "thu", "fri", "sat", "sun"];

/// Parses a field as a date or a clock time; `None` if it is neither.
///
/// # Errors
/// If it cannot be read, or has two possible meanings. The error is the reason, worded to follow the
/// text of the field.
pub fn moment(field: &str) -> Result<Option<Moment>, Unreadable> {
    if field.len() < 4
        || field.len() > 60
        || !field.starts_with(|c: char| c.is_ascii_alphanumeric())
    {
        return Ok(None);
    }
    let Some(colon) = field.find(':') else { return basic(field) };
    // A comma may be a decimal sign, because Python's module logging writes decimal commas.
    let bytes = field.as_bytes();
    let decimal = field.rfind(',').filter(|at| {
        *at > colon
            && !field[colon..].contains('.')
            && bytes.get(at + 1).is_some_and(u8::is_ascii_digit)
            && bytes[at - 1].is_ascii_digit()
    });
    let mut text = field.to_string();
    if let Some(at) = decimal {
        text.replace_range(at..=at, ".");
    }
    let start = text[..colon].rfind([' ', 'T', 't']).map_or(0, |at| at + 1);
    let (before, clock) = text.split_at(start);
    let before = before.trim_end_matches(['T', 't', ' ', ',']).trim();
    if !clock.starts_with(|c: char| c.is_ascii_digit())
        || !text[..colon].ends_with(|c: char| c.is_ascii_digit())
    {
        return Ok(None);
    }
    let Some((clock, offset)) = zoned(clock)? else { return Ok(None) };
    let Some(time) = clock_time(&clock, !before.is_empty())? else { return Ok(None) };
    if before.is_empty() {
        return Ok(Some(Moment::Clock(time - offset)));
    }
    // Durations as pandas and Python print them: 1 days 00:00:00.02; 1 day, 0:00:00.02.
    if let Some((count, word)) = before.split_once(' ')
        && matches!(word, "day" | "days")
    {
        let count = count.parse::<i64>().ok().filter(|days| (0..100_000).contains(days));
        return Ok(count.map(|count| Moment::Clock(count * DAY + time)));
    }
    Ok(match date(before)? {
        None => None,
        Some(Day::Known(day)) => {
            (day.checked_mul(DAY)).and_then(|at| at.checked_add(time - offset)).map(Moment::Date)
        }
        Some(Day::Either(ordered)) => Some(Moment::Ordered(ordered, time - offset)),
    })
}

/// Parses an ISO 8601 date with a clock time and without separators, such as 20260131T120000.020.
fn basic(field: &str) -> Result<Option<Moment>, Unreadable> {
    let Some((day, clock)) = field.split_once(['T', ' ', '_']) else { return Ok(None) };
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let clock = clock.strip_suffix('Z').unwrap_or(clock);
    let whole = clock.split(['.', ',']).next().unwrap_or_default();
    if day.len() != 8 || whole.len() != 6 || !is_number(day) || !is_number(whole) {
        return Ok(None);
    }
    let signs = format!("{}:{}:{}", &clock[..2], &clock[2..4], clock[4..].replace(',', "."));
    let (day, time) = (date(day)?, clock_time(&signs, true)?);
    Ok(match (day, time) {
        (Some(Day::Known(day)), Some(time)) => Some(Moment::Date(day * DAY + time)),
        _ => None,
    })
}

/// Splits a clock time such as `1:00 pm +01:00` into the time with am or pm, and the offset from UTC, ns.
fn zoned(clock: &str) -> Result<Option<(String, i64)>, Unreadable> {
    let end = clock.find(|c: char| !matches!(c, '0'..='9' | ':' | '.')).unwrap_or(clock.len());
    let (time, rest) = clock.split_at(end);
    let is_zone = |c: char| c.is_alphanumeric() || matches!(c, '+' | '-' | '−' | ':' | '.' | ' ');
    let begins = rest.trim_start().chars().next();
    let fits = begins.is_none_or(|c| c.is_alphabetic() || matches!(c, '+' | '-' | '−'));
    if rest.len() > 12 || !fits || !rest.chars().all(is_zone) {
        return Ok(None);
    }
    let lower = rest.trim().replace('.', "").replace('−', "-").to_lowercase();
    let (half, zone) = match lower.get(..2) {
        Some(half @ ("am" | "pm")) => (half, lower[2..].trim()),
        _ => ("", lower.as_str()),
    };
    let zone = zone.strip_prefix("utc").or_else(|| zone.strip_prefix("gmt")).unwrap_or(zone);
    // The date is added because chrono parses an offset only after a date.
    let offset = DateTime::parse_from_str(&format!("2000-01-01 0:0 {zone}"), "%Y-%m-%d %H:%M %#z");
    let offset = match (zone, offset) {
        ("" | "z", _) => 0,
        (_, Ok(offset)) => i64::from(offset.offset().local_minus_utc()),
        _ => {
            return Err(Unreadable::Offset(rest.trim().into()));
        }
    };
    Ok(Some((format!("{time}{half}"), offset * SECOND)))
}

/// Parses a clock time to nanoseconds since midnight: `12:00:00.020`, `12:00:00:020`, `12:00:00.020pm` and,
/// next to a date, `12:00`.
fn clock_time(text: &str, has_date: bool) -> Result<Option<i64>, Unreadable> {
    let mut text = text.to_string();
    // Three, six or nine digits after a third colon are milli-, micro- or nanoseconds; two digits would be
    // frames of a film and are refused.
    if let Some((whole, part)) = text.rsplit_once(':')
        && whole.matches(':').count() == 2
        && [3, 6, 9].contains(&part.trim_end_matches(['a', 'p', 'm']).len())
    {
        text = format!("{whole}.{part}");
    }
    let format = match (text.ends_with('m'), text.matches(':').count()) {
        (false, 1) if has_date && !text.contains('.') => "%H:%M",
        (false, _) => "%H:%M:%S%.f",
        (true, _) => "%I:%M:%S%.f%p",
    };
    match NaiveTime::parse_from_str(&text, format) {
        // A leap second is refused, because it has no place among the 86,400 seconds of a day.
        Ok(time) if i64::from(time.nanosecond()) < SECOND => {
            let seconds = i64::from(time.num_seconds_from_midnight());
            Ok(Some(seconds * SECOND + i64::from(time.nanosecond())))
        }
        _ => Err(Unreadable::Clock),
    }
}

enum Day {
    Known(i64),
    Either(Ordered),
}

fn date(text: &str) -> Result<Option<Day>, Unreadable> {
    let signs = [' ', '-', '/', '.', ','];
    let mut parts: Vec<&str> = text.split(signs).filter(|part| !part.is_empty()).collect();
    let starts = |part: &str, names: &[&str]| {
        let lower = part.to_lowercase();
        names.iter().position(|name| lower.starts_with(name))
    };
    if parts.len() == 4 && starts(parts[0], &WEEKDAYS).is_some() {
        parts.remove(0);
    }
    let number = |text: &str| -> Option<u32> {
        text.parse().ok().filter(|_| text.len() < 5 && text.bytes().all(|b| b.is_ascii_digit()))
    };
    let year_of = |text: &str| -> Option<i32> {
        let year = number(text)? as i32;
        match text.len() {
            4 => Some(year),
            2 => Some(2000 + year),
            _ => None,
        }
    };
    let known = |year: Option<i32>, month: Option<u32>, day: Option<u32>| {
        let (Some(year), Some(month), Some(day)) = (year, month, day) else { return Ok(None) };
        days(year, month, day).map(|day| Some(Day::Known(day)))
    };
    match parts[..] {
        [day] if day.len() == 8 => {
            let part = |from: usize, to: usize| day.get(from..to).and_then(number);
            known(part(0, 4).map(|year| year as i32), part(4, 6), part(6, 8))
        }
        [a, b, c] => match (starts(a, &MONTHS), starts(b, &MONTHS)) {
            (Some(month), _) => known(year_of(c), Some(month as u32 + 1), number(b)),
            (_, Some(month)) if a.len() == 4 => {
                known(year_of(a), Some(month as u32 + 1), number(c))
            }
            (_, Some(month)) => known(year_of(c), Some(month as u32 + 1), number(a)),
            _ if a.len() == 4 => known(year_of(a), number(b), number(c)),
            _ if text.contains('.') => known(year_of(c), number(b), number(a)),
            _ => {
                let (Some(first), Some(second), Some(year)) = (number(a), number(b), year_of(c))
                else {
                    return Ok(None);
                };
                if first.min(second) > 12 || first.max(second) > 31 || first.min(second) == 0 {
                    return Err(Unreadable::Month(first, second));
                }
                Ok(Some(Day::Either(Ordered { first, second, year, is_short: c.len() == 2 })))
            }
        },
        _ => Ok(None),
    }
}

/// Converts the times of a column to seconds since the first one. `last` is the last clock time plus the days
/// that have passed, ns; `day_first` is unknown until a date shows the order of day and month.
#[derive(Default)]
pub struct Times {
    first: Option<(Moment, String)>,
    last: i64,
    day_first: Option<bool>,
}

impl Times {
    pub fn is_empty(&self) -> bool {
        self.first.is_none()
    }

    /// Converts a time to seconds since the first one. `field` is the text that messages repeat. If a clock
    /// time jumps back by more than half a day, midnight has passed.
    ///
    /// # Errors
    /// If the time is of another kind than the first, or its date has two possible meanings.
    pub fn seconds(&mut self, moment: Moment, field: &str) -> Result<f64, Unreadable> {
        if let Moment::Ordered(Ordered { first, second, .. }, _) = moment
            && first.max(second) > 12
        {
            let day_first = first > 12;
            if *self.day_first.get_or_insert(day_first) != day_first {
                return Err(Unreadable::OtherOrder);
            }
        }
        let (first, _) = self.first.get_or_insert_with(|| {
            if let Moment::Clock(at) = moment {
                self.last = at;
            }
            (moment.clone(), field.into())
        });
        let elapsed = match (&*first, moment) {
            (Moment::Date(first), Moment::Date(at)) => i128::from(at) - i128::from(*first),
            (Moment::Clock(first), Moment::Clock(at)) => {
                // A jump back by half a day or more is a midnight.
                let days = (self.last - at + DAY / 2).div_euclid(DAY).max(0);
                self.last = at + days * DAY;
                i128::from(self.last) - i128::from(*first)
            }
            (Moment::Ordered(day, from), Moment::Ordered(other, to)) => {
                let days = if *day == other {
                    0
                } else if day.is_short || other.is_short {
                    return Err(Unreadable::ShortYear);
                } else if let Some(day_first) = self.day_first {
                    other.day(day_first)? - day.day(day_first)?
                } else {
                    return Err(Unreadable::UnknownOrder);
                };
                i128::from(days) * i128::from(DAY) + i128::from(to - from)
            }
            (Moment::Clock(_), _) => return Err(Unreadable::DateAmongClocks),
            (_, Moment::Clock(_)) => return Err(Unreadable::ClockAmongDates),
            _ => return Err(Unreadable::OtherForm),
        };
        Ok(elapsed as f64 * 1e-9)
    }

    /// Returns the first time as a text: a date in RFC 3339, or the clock time as in the file.
    pub fn origin(&self) -> Option<String> {
        self.first.as_ref().map(|(moment, field)| match moment {
            Moment::Date(at) => DateTime::from_timestamp_nanos(*at).to_rfc3339(),
            _ => field.clone(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(fields: &[&str]) -> anyhow::Result<Vec<f64>> {
        let mut times = Times::default();
        fields
            .iter()
            .map(|field| match moment(field)? {
                Some(moment) => Ok(times.seconds(moment, field)?),
                None => anyhow::bail!("is not a time"),
            })
            .collect()
    }

    #[test]
    fn dates_and_clock_times_in_many_notations_are_converted_to_seconds() {
        for fields in [
            ["2026-01-31T23:59:59.990Z", "2026-02-01T00:00:00.010Z"],
            ["2026-01-31T23:59:59.990+0100", "2026-02-01T00:00:00.010+0100"],
            ["2026-01-31 23:59:59.990 +01", "2026-01-31 23:00:00.010Z"],
            ["2026-01-31 23:59:59,990 UTC", "2026-02-01 00:00:00,010 UTC"],
            ["20260131T235959.990", "20260201T000000.010"],
            ["2026/01/31 23:59:59.99", "2026/02/01 0:00:00.01"],
            ["31.01.26 23:59:59.99", "1.2.26 00:00:00.01"],
            ["31/01/2026 23:59:59:990", "01/02/2026 00:00:00:010"],
            ["1/31/2026 11:59:59.990 PM", "2/1/2026 12:00:00.010 AM"],
            ["12/01/2026 23:59:59.99", "13/01/2026 00:00:00.01"],
            ["31-Jan-2026 11:59:59.99 p.m.", "01-Feb-2026 12:00:00.01 a.m."],
            ["Sat, Jan 31, 2026 23:59:59.99", "Sun, Feb 1, 2026 00:00:00.01"],
            ["01/02/2026 12:00:00.00", "01/02/2026 12:00:00.02"],
            ["12:59:59.990 PM", "1:00:00.010 PM"],
            ["11:59:59.990pm", "12:00:00.010am"],
            ["23:59:59:990", "00:00:00:010"],
            ["0 days 23:59:59.990000", "1 days 00:00:00.010000"],
            ["23:59:59.99", "1 day, 0:00:00.010000"],
        ] {
            let found = column(&fields);
            assert!(
                found.as_ref().is_ok_and(|t| (t[1] - 0.02).abs() < 1e-9),
                "{fields:?}: {found:?}"
            );
        }
    }

    #[test]
    fn ambiguous_and_unreadable_times_are_refused_with_a_reason() {
        for (fields, words) in [
            (&["01/02/2026 23:59:59", "02/02/2026 00:00:01"][..], "the day first or the month"),
            (
                &["26/01/31 23:59:59", "26/02/01 00:00:01"],
                "a year of two digits does not show the order",
            ),
            (&["31/01/2026 1:00:00", "01/31/2026 1:00:01"], "in another order"),
            (&["31/31/2026 1:00:00"], "neither 31 nor 31 is one"),
            (&["30.02.2026 1:00:00"], "there is no day 30 of month 2"),
            (&["24:00:00.010"], "is no time of day (allowed: hours, minutes and seconds"),
            (&["13:00:00 PM"], "is no time of day (allowed: hours, minutes and seconds"),
            (&["12:00:00:05"], "is no time of day (allowed: hours, minutes and seconds"),
            (&["00:20.0"], "is no time of day (allowed: hours, minutes and seconds"),
            (&["2026-01-31 12:00:00 CET"], "ends in \"CET\", which is neither an offset"),
            (&["12:00:00", "2026-01-31 12:00:01"], "is a date, where the lines above have none"),
            (&["1/2/2026 12:00:00", "2026-01-31 12:00:01"], "in another form"),
            (&["ab:cd"], "is not a time"),
        ] {
            let error = column(fields).unwrap_err();
            assert!(error.to_string().contains(words), "{fields:?}: {error}");
        }
    }
}

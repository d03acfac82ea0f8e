//! Numbers as people and programs of all countries write them: 1234.5, 1,234.5, 1.234,5, 1'234.5, 1 234,5, −1,5.
//!
//! A column is read by one convention, that of its own fields. Each is parsed by what those above have shown; a field that
//! contradicts them is an error.

/// Role of a comma within a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Comma {
    /// It separates columns: a field has none.
    Separates,
    /// It may be decimal or separate thousands alike: a quoted field where commas separate columns.
    Either,
    /// It is decimal unless the column shows otherwise.
    Decimal,
}

/// Decimal and thousands separators of a column, as far as its fields have shown them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Style {
    /// The decimal sign.
    decimal: Option<char>,
    /// The sign between thousands, `.` or `,`.
    thousands: Option<char>,
}

/// Digits in groups of three after a first one of one to three, which is not 0.
fn grouped(text: &str, sign: char) -> bool {
    let mut groups = text.split(sign);
    let digits = |group: &str| group.bytes().all(|byte| byte.is_ascii_digit());
    let first = groups.next().unwrap_or_default();
    (1..=3).contains(&first.len())
        && digits(first)
        && !first.starts_with('0')
        && groups.all(|group| group.len() == 3 && digits(group))
}

impl Style {
    /// The number of a field; `None`: it is not one.
    ///
    /// # Errors
    /// If it can be read in two ways, or in another one than the fields above.
    pub fn number(&mut self, field: &str, comma: Comma) -> Result<Option<f64>, String> {
        if (self.decimal != Some(',') || !field.contains('.'))
            && let Ok(value) = field.parse::<f64>()
        {
            if field.contains('.') {
                self.decimal = Some('.');
            }
            return Ok(value.is_finite().then_some(value));
        }
        if !field.contains(|c: char| c.is_ascii_digit()) {
            return Ok(None);
        }
        let plain = plain(field);
        let (sign, size) = match plain.strip_prefix(['-', '+']) {
            Some(size) => (&plain[..1], size),
            None => ("", plain.as_str()),
        };
        let signs: Vec<char> = size.chars().filter(|c| matches!(c, '.' | ',')).collect();
        if comma == Comma::Separates && signs.contains(&',') {
            return Ok(None);
        }
        let (first, last) = (signs.first().copied(), signs.last().copied());
        // the decimal sign of this field, and the sign between its thousands
        let (decimal, thousands) = match (first, last, signs.len()) {
            (Some(first), Some(last), _) if first != last => (Some(last), Some(first)),
            (Some(sign), _, 1) => match self.read(size, sign, comma)? {
                true => (None, Some(sign)),
                false => (Some(sign), None),
            },
            (Some(sign), ..) => (None, Some(sign)),
            (None, ..) => (None, None),
        };
        let (whole, rest) = match decimal.and_then(|sign| size.rsplit_once(sign)) {
            Some((whole, rest)) => (whole, Some(rest)),
            None => (size, None),
        };
        if let Some(sign) = thousands
            && (!grouped(whole, sign) || rest.is_some_and(|rest| rest.contains(sign)))
        {
            return Ok(None);
        }
        if decimal == Some(',')
            && !rest.is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
        {
            return Ok(None);
        }
        let whole: String = whole.chars().filter(|c| Some(*c) != thousands).collect();
        let text = rest.map_or(format!("{sign}{whole}"), |rest| format!("{sign}{whole}.{rest}"));
        let Some(value) = text.parse::<f64>().ok().filter(|value| value.is_finite()) else {
            return Ok(None);
        };
        let implied = decimal.or(thousands.map(|sign| if sign == ',' { '.' } else { ',' }));
        if let (Some(now), Some(before)) = (implied, self.decimal)
            && now != before
        {
            let name = |sign| if sign == ',' { "comma" } else { "point" };
            return Err(format!(
                "is read with a decimal {}, the lines above with a decimal {} (allowed: one of them in a column)",
                name(now),
                name(before)
            ));
        }
        self.decimal = implied.or(self.decimal);
        self.thousands = thousands.or(self.thousands);
        Ok(Some(value))
    }

    /// Returns true if the one sign in a number is between thousands.
    fn read(self, size: &str, sign: char, comma: Comma) -> Result<bool, String> {
        if !grouped(size, sign) {
            return Ok(false);
        }
        match (self.decimal, self.thousands) {
            (Some(decimal), _) if decimal == sign => Ok(false),
            (_, Some(thousands)) if thousands == sign => Ok(true),
            // a point where the column has decimal commas, a comma where it has decimal points
            (Some('.'), _) => Ok(true),
            (None, _) if sign == '.' || comma == Comma::Decimal => Ok(false),
            _ => Err(format!(
                "may be {} or {} (allowed: numbers without separators of thousands, or lines above that show what \
                 the {} is)",
                size.replace(sign, ""),
                size.replace(sign, "."),
                if sign == ',' { "comma" } else { "point" }
            )),
        }
    }
}

/// A field with a plain minus, and without the blanks and apostrophes that separate thousands.
fn plain(field: &str) -> String {
    let field = field.replace(['\u{2212}', '\u{2012}', '\u{2013}'], "-");
    let spaces =
        |c: char| matches!(c, ' ' | '\u{a0}' | '\u{202f}' | '\u{2009}' | '\'' | '\u{2019}');
    if !field.contains(spaces) {
        return field;
    }
    let uniform = field.replace(spaces, " ");
    let size = uniform.trim_start_matches(['-', '+']);
    let whole = size.split(['.', ',']).next().unwrap_or_default();
    // blanks elsewhere make it no number
    if grouped(whole, ' ') { uniform.replace(' ', "") } else { uniform }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The numbers of a column, the last of which may be an error.
    fn column(fields: &[&str], comma: Comma) -> Vec<Result<Option<f64>, String>> {
        let mut style = Style::default();
        fields.iter().map(|field| style.number(field, comma)).collect()
    }

    #[test]
    fn a_column_is_read_by_one_convention() {
        let cases: [(&[&str], Comma, &[f64]); 9] = [
            (
                &["0.5", "1,000.25", "-1,234,567.5", "2,000"],
                Comma::Either,
                &[0.5, 1000.25, -1_234_567.5, 2000.0],
            ),
            (&["0,5", "1.000,25", "2.000"], Comma::Decimal, &[0.5, 1000.25, 2000.0]),
            (&["1'234.5", "1\u{2019}234.5"], Comma::Separates, &[1234.5, 1234.5]),
            (
                &["1\u{202f}234,5", "1 234,5", "1\u{a0}234"],
                Comma::Decimal,
                &[1234.5, 1234.5, 1234.0],
            ),
            (&["\u{2212}1.5", "\u{2212}2e\u{2212}3"], Comma::Separates, &[-1.5, -2e-3]),
            (&["1.234", "1234.5"], Comma::Separates, &[1.234, 1234.5]),
            (&["1,234", "0,5"], Comma::Decimal, &[1.234, 0.5]),
            (&["1,234,567", "1,234"], Comma::Either, &[1_234_567.0, 1234.0]),
            (&["12", "0,25", "-,5"], Comma::Either, &[12.0, 0.25, -0.5]),
        ];
        for (fields, comma, expected) in cases {
            let expected: Vec<_> = expected.iter().map(|value| Ok(Some(*value))).collect();
            assert_eq!(column(fields, comma), expected, "{fields:?}");
        }
    }

    #[test]
    fn what_can_be_read_in_two_ways_is_refused() {
        let cases: [(&[&str], Comma, &str); 4] = [
            (&["1,234"], Comma::Either, "may be 1234 or 1.234"),
            (&["0,5", "1.234"], Comma::Decimal, "may be 1234 or 1.234"),
            (
                &["1,234", "0.5"],
                Comma::Decimal,
                "a decimal point, the lines above with a decimal comma",
            ),
            (
                &["0.5", "0,5"],
                Comma::Decimal,
                "a decimal comma, the lines above with a decimal point",
            ),
        ];
        for (fields, comma, words) in cases {
            let last = column(fields, comma).pop().unwrap();
            assert!(last.as_ref().is_err_and(|error| error.contains(words)), "{last:?}");
        }
        for field in ["1,2,3", "12,34.5", "1 2", "1.2.3", "abc", "1e999", "1,", "--1", "0x10"] {
            assert_eq!(Style::default().number(field, Comma::Decimal), Ok(None), "{field}");
        }
    }
}

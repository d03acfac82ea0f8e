//! Describes for which reasons the tanks of a run were out of the range of their model, each with its share of the time
//! and the time at which it first occurred.

use formulas::limits::LimitedBy;

use crate::{hubslosh, sloshtank, spacecraft};

/// Names of the output variables of an FMU that give the reason why a tank is outside the range of
/// its model, one for each tank. Each name is paired with the words that precede the reason in
/// messages, for example `tank 2: `.
pub struct Limits {
    tanks: Vec<(String, String)>,
}

impl Limits {
    /// Finds the output variables of an FMU that tell why a tank is out of the range of its model.
    /// `has` returns true for the names of variables of the FMU.
    pub fn find(has: impl Fn(&str) -> bool) -> Limits {
        let several = (1..=spacecraft::MOST_TANKS)
            .map(|i| (spacecraft::tank::LIMITED_BY_KIND.element([i]), format!("tank {i}: ")));
        let one = [hubslosh::LIMITED_BY_KIND, sloshtank::tank::LIMITED_BY_KIND]
            .map(|name| (name.to_string(), String::new()));
        Limits { tanks: one.into_iter().chain(several).filter(|(name, _)| has(name)).collect() }
    }

    pub fn required_columns(&self) -> impl Iterator<Item = &str> {
        self.tanks.iter().map(|(name, _)| name.as_str())
    }

    /// Returns a sentence for each tank that was out of the range of its model in a run. The
    /// sentence lists the reasons with their shares of the time, the largest first, and the time at
    /// which each reason first occurred. `column` returns the column of the run's table with a
    /// given name. The reason in a row is taken to hold until the next row.
    pub fn describe<'t>(&self, column: impl Fn(&str) -> Option<&'t [f64]>) -> Vec<String> {
        let of_tank = |(name, tank): &(String, String)| {
            let found = reasons(column("time")?, column(name)?);
            let out: f64 = found.iter().map(|(_, share, _)| share).sum();
            let list: Vec<String> = found
                .iter()
                .map(|(reason, share, first)| {
                    let (share, first) = (percent(*share), (first * 1e3).round() / 1e3);
                    format!("{} ({share}, first at {first} s)", lower(reason.meaning()))
                })
                .collect();
            (!list.is_empty()).then(|| {
                format!("{tank}out of range for {} of the time: {}", percent(out), list.join("; "))
            })
        };
        self.tanks.iter().filter_map(of_tank).collect()
    }
}

fn reasons(time: &[f64], numbers: &[f64]) -> Vec<(LimitedBy, f64, f64)> {
    let end = time.len();
    let span = match (time.first(), time.last()) {
        (Some(first), Some(last)) if last > first => last - first,
        // a table with a single row has no duration
        _ => 0.0,
    };
    let lasts = |i: usize| match span > 0.0 {
        true => (time[(i + 1).min(end - 1)] - time[i]) / span,
        false => 1.0 / end as f64,
    };
    let mut all: Vec<(LimitedBy, f64, f64)> = LimitedBy::ALL[1..]
        .iter()
        .filter_map(|reason| {
            let number = f64::from(*reason as u8);
            let rows: Vec<usize> =
                (0..end.min(numbers.len())).filter(|i| numbers[*i] == number).collect();
            Some((*reason, rows.iter().map(|i| lasts(*i)).sum(), time[*rows.first()?]))
        })
        .collect();
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    all
}

fn lower(sentence: &str) -> String {
    sentence[..1].to_lowercase() + &sentence[1..]
}

fn percent(share: f64) -> String {
    match 100.0 * share {
        x if x < 0.1 => "less than 0.1 %".to_string(),
        x => format!("{x:.1} %"),
    }
}

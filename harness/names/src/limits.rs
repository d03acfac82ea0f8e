//! Reasons for which the tanks of a run were out of the range of their model, each with its share of the time.

use formulas::limits::LimitedBy;
use host::description::ModelDescription;
use names::{hubslosh, sloshtank, spacecraft};
use signals::table::Table;

/// Variables that say by what a tank is limited.
pub struct Limits {
    /// Name of the variable, and words before the reason.
    tanks: Vec<(String, String)>,
}

impl Limits {
    /// Finds the variables of an FMU by which its tanks say why they are out of range.
    pub fn find(description: &ModelDescription) -> Limits {
        let several = (1..=spacecraft::MOST_TANKS)
            .map(|i| (spacecraft::tank::LIMITED_BY_KIND.at([i]), format!("tank {i}: ")));
        let one = [hubslosh::LIMITED_BY_KIND, sloshtank::tank::LIMITED_BY_KIND]
            .map(|name| (name.to_string(), String::new()));
        let all = one.into_iter().chain(several);
        Limits { tanks: all.filter(|(name, _)| description.variable(name).is_ok()).collect() }
    }

    /// Returns the columns that [`Limits::describe`] reads.
    pub fn needs(&self) -> impl Iterator<Item = &str> {
        self.tanks.iter().map(|(name, _)| name.as_str())
    }

    /// Returns a sentence for each tank that was out of range: the reasons with their shares of the time, the longest first.
    /// A row holds until the next one.
    pub fn describe(&self, table: &Table) -> Vec<String> {
        let of_tank = |(name, tank): &(String, String)| {
            let reasons = table.column(name)?;
            let shares = shares(table.column("time")?, reasons);
            let out: f64 = shares.iter().map(|(_, share)| share).sum();
            let list: Vec<String> = shares
                .iter()
                .map(|(reason, share)| format!("{} ({})", lower(reason.meaning()), percent(*share)))
                .collect();
            (out > 0.0).then(|| {
                format!("{tank}out of range for {} of the time: {}", percent(out), list.join("; "))
            })
        };
        self.tanks.iter().filter_map(of_tank).collect()
    }
}

/// Returns the reasons with their shares of the time, the longest first.
fn shares(time: &[f64], reasons: &[f64]) -> Vec<(LimitedBy, f64)> {
    let end = time.len();
    let span = match (time.first(), time.last()) {
        (Some(first), Some(last)) if last > first => last - first,
        // a single row
        _ => 0.0,
    };
    let lasts = |i: usize| match span > 0.0 {
        true => (time[(i + 1).min(end - 1)] - time[i]) / span,
        false => 1.0 / end as f64,
    };
    let mut all: Vec<(LimitedBy, f64)> = LimitedBy::ALL[1..]
        .iter()
        .map(|reason| {
            let rows = reasons.iter().enumerate().filter(|(_, x)| **x == f64::from(*reason as u8));
            (*reason, rows.map(|(i, _)| lasts(i)).sum())
        })
        .filter(|(_, share)| *share > 0.0)
        .collect();
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    all
}

fn lower(sentence: &str) -> String {
    sentence[..1].to_lowercase() + &sentence[1..]
}

/// Returns a share in per cent, never rounded to nothing.
fn percent(share: f64) -> String {
    match 100.0 * share {
        x if x < 0.1 => "less than 0.1 %".to_string(),
        x => format!("{x:.1} %"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_have_their_shares_of_the_time() {
        let time = [0.0, 1.0, 3.0, 4.0, 10.0];
        let found = shares(&time, &[1.0, 2.0, 5.0, 2.0, 5.0]);
        assert_eq!(found, [(LimitedBy::ThirdOrder, 0.8), (LimitedBy::Spin, 0.1)]);
        assert_eq!(shares(&time, &[1.0; 5]), []);
        assert_eq!(shares(&[2.0], &[8.0]), [(LimitedBy::Contact, 1.0)]);
        assert_eq!(percent(1e-5), "less than 0.1 %");
        assert_eq!(percent(0.123_45), "12.3 %");
    }
}

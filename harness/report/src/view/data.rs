//! Columns of a run for the page: every k-th row of the columns that move an object, and envelopes of columns
//! that are only plotted.

use base64ct::{Base64, Encoding};
use serde_json::{Value, json};

use crate::svg::range;

/// Largest number of values for the moving objects of one page. With 32 bits each they are 6.4 MB of text.
const MOST_VALUES: usize = 1_200_000;

const INTERVALS: usize = 4_000;

/// Smallest number of frames per oscillation with which the animation shows it correctly.
const FEWEST_FRAMES: f64 = 8.0;

pub(super) struct Thinning {
    pub every: usize,
}

impl Thinning {
    pub fn new(rows: usize, columns: usize) -> Thinning {
        Thinning { every: (rows * columns).div_ceil(MOST_VALUES).max(1) }
    }

    pub fn rows(&self, rows: usize) -> Vec<usize> {
        let mut kept: Vec<usize> = (0..rows).step_by(self.every).collect();
        // The last row is always kept.
        if kept.last() != Some(&(rows - 1)) {
            kept.push(rows - 1);
        }
        kept
    }

    /// Returns a number if the animation has too few rows to show an oscillation: the number of rows per oscillation
    /// of the column that oscillates fastest. Otherwise returns `None`.
    pub fn too_few(&self, columns: &[&[f64]]) -> Option<f64> {
        let frames = |column: &&[f64]| {
            let (low, high) = range(column.iter().copied());
            // crossings of the middle are counted with hysteresis, so that noise does
            // not count as oscillation
            let (mut above, mut crossings) = (column[0] > 0.5 * (low + high), 0usize);
            for value in column.iter() {
                let middle = 0.5 * (low + high) + if above { -0.1 } else { 0.1 } * (high - low);
                if (*value > middle) != above {
                    above = !above;
                    crossings += 1;
                }
            }
            2.0 * column.len() as f64 / crossings.max(1) as f64 / self.every as f64
        };
        let fewest = columns.iter().map(frames).fold(f64::INFINITY, f64::min);
        (fewest < FEWEST_FRAMES).then_some(fewest)
    }
}

fn text(values: impl Iterator<Item = f64>) -> String {
    let bytes: Vec<u8> = values.flat_map(|v| (v as f32).to_le_bytes()).collect();
    Base64::encode_string(&bytes)
}

pub(super) fn thinned(values: &[f64], rows: &[usize]) -> String {
    text(rows.iter().map(|row| values[*row]))
}

/// Encodes the times of the kept rows: as start and step if they are equally spaced, otherwise
/// each with 64 bits.
pub(super) fn times(time: &[f64], rows: &[usize]) -> Value {
    let (first, count) = (time[rows[0]], rows.len());
    let step = (time[rows[count - 1]] - first) / (count - 1).max(1) as f64;
    let even = rows
        .iter()
        .enumerate()
        .all(|(k, row)| (time[*row] - first - step * k as f64).abs() < 1e-6 * step);
    if even {
        return json!({ "first": first, "step": step, "count": count });
    }
    let bytes: Vec<u8> = rows.iter().flat_map(|row| time[*row].to_le_bytes()).collect();
    json!({ "times": Base64::encode_string(&bytes), "count": count })
}

pub(super) fn envelope(time: &[f64], values: &[f64]) -> Value {
    let each = values.len().div_ceil(INTERVALS);
    let parts = || values.chunks(each);
    let middles = time.chunks(each).map(|part| part[part.len() / 2]);
    json!({
        "times": text(middles),
        "low": text(parts().map(|part| range(part.iter().copied()).0)),
        "high": text(parts().map(|part| range(part.iter().copied()).1)),
        "each": each,
    })
}

pub(super) fn integral(time: &[f64], rate: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let steps = time.windows(2).zip(rate.windows(2));
    let rest = steps.map(|(t, v)| {
        sum += 0.5 * (v[0] + v[1]) * (t[1] - t[0]);
        sum
    });
    std::iter::once(0.0).chain(rest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_viewer_keeps_the_last_row_and_limits_the_number_of_values() {
        for (rows, columns) in [(2, 5), (100_000, 40), (1_000_003, 9)] {
            let kept = Thinning::new(rows, columns).rows(rows);
            assert!(kept.len() * columns <= MOST_VALUES + columns, "{rows} x {columns}");
            assert_eq!((kept[0], kept[kept.len() - 1]), (0, rows - 1));
        }
    }

    #[test]
    fn an_envelope_misses_no_peak() {
        let time: Vec<f64> = (0..50_000).map(|k| k as f64 * 0.01).collect();
        let mut values = vec![0.0; time.len()];
        (values[31_234], values[4]) = (7.5, -2.0);
        let made = envelope(&time, &values);
        let read = |key: &str| {
            let bytes = Base64::decode_vec(made[key].as_str().unwrap()).unwrap();
            bytes
                .chunks(4)
                .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
                .fold((0f32, 0f32), |(low, high), v| (low.min(v), high.max(v)))
        };
        assert_eq!((read("low").0, read("high").1), (-2.0, 7.5));
    }

    #[test]
    fn a_run_with_too_few_rows_per_period_for_the_viewer_is_reported() {
        let wave: Vec<f64> = (0..10_000).map(|k| (0.5 * k as f64).sin()).collect(); // 12.6 rows a period
        assert!(Thinning { every: 1 }.too_few(&[&wave]).is_none());
        let few = Thinning { every: 2 }.too_few(&[&wave]).expect("6.3 frames");
        assert!((few - std::f64::consts::TAU).abs() < 0.05, "{few}");
        assert!(Thinning { every: 2 }.too_few(&[&[1.0; 9]]).is_none());
    }
}

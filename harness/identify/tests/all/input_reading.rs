use std::f64::consts::TAU;

use identify::input::reading::{Source, prepare, read, starts_at_rest};
use identify::input::recording::{Recording, fresh};
use identify::tuning::COARSEST;
use signals::recording::Columns;

fn rigid() -> Recording {
    let time: Vec<f64> = (0..15_000).map(|k| 0.02 * f64::from(k)).collect();
    let phase = |t: f64| TAU * (1.0 + t / 300.0) * t;
    let f = |t: f64| TAU * (1.0 + t / 150.0);
    let torque = time.iter().map(|&t| 0.1 * phase(t).sin()).collect();
    let rate = time.iter().map(|&t| -0.1 / 0.4 / f(t) * phase(t).cos()).collect();
    Recording { from_rest: false, ..Recording::of("a.csv", time, torque, rate) }
}

/// A gyro at rest reads its bias. If the bias were taken for a motion, the initial rate would be an unknown that the
/// recording does not determine, because dry friction stops the hub at once.
#[test]
fn a_constant_rate_is_a_bias_and_a_hub_that_turns_is_not_at_rest() {
    let mut random = analysis::random::Random::new(1, 0);
    let noise: Vec<f64> = (0..15_000).map(|_| 4e-4 * random.normal()).collect();
    // The first torque gives the hub a mean rate, which friction reduces to 0 with a time constant of 3 s.
    let first = rigid().rate[0];
    let from_rest = |offset: f64| {
        let mut all = rigid();
        for (k, rate) in all.rate.iter_mut().enumerate() {
            *rate += offset + noise[k] - first * (-all.time[k] / 3.0).exp();
        }
        all
    };
    assert!([0.0, 8e-3, -1e-2].iter().all(|bias| starts_at_rest(&from_rest(*bias))));
    // an encoder distinguishes a bias from a hub that keeps turning
    let with_encoder = |turns: f64| {
        let all = from_rest(8e-3);
        let angle = all.time.iter().map(|t| 0.6 + turns * t).collect();
        Recording { angle: Some(angle), ..all }
    };
    assert!(starts_at_rest(&with_encoder(0.0)) && !starts_at_rest(&with_encoder(8e-3)));
    // a mean rate above the changes of the rate, and a beginning in the middle of a motion
    assert!(!starts_at_rest(&from_rest(0.5)));
    let later = from_rest(8e-3);
    let zero = (5_000..).find(|k| later.torque[*k] * later.torque[k + 1] < 0.0).unwrap();
    assert!(!starts_at_rest(&later.rows(zero, 15_000)));
}

fn refusal(change: impl Fn(&mut Recording)) -> String {
    let mut bad = rigid();
    change(&mut bad);
    format!("{:#}", prepare(bad, COARSEST, &mut |_| {}).unwrap_err())
}

#[test]
fn a_recording_without_faults_is_accepted() {
    assert_eq!(prepare(rigid(), COARSEST, &mut |_| {}).unwrap().len(), 1);
}

#[test]
fn each_fault_of_a_recording_is_named_in_its_error() {
    type Change = fn(&mut Recording);
    let faults: [(Change, &str); 8] = [
        (|r| r.torque.fill(0.1), "tau_cmd is constant (0.1 N·m)"),
        (|r| *r = r.rows(0, 500), "9.98 s of data are too few"),
        (|r| std::mem::swap(&mut r.torque, &mut r.rate), "swapped"),
        (|r| r.rate.iter_mut().for_each(|w| *w = -*w), "wrong sign"),
        (|r| r.time.iter_mut().for_each(|t| *t *= 1e3), "Is time in milliseconds?"),
        (
            |r| {
                let mut random = analysis::random::Random::new(3, 0);
                r.rate.iter_mut().for_each(|w| *w = 1e-3 + 6e-4 * random.normal());
            },
            "the hub does not turn: omega is noise of 6",
        ),
        (|r| r.time[7] = r.time[6], "row 8: time must grow"),
        (|r| r.time.iter_mut().for_each(|t| *t *= 1e-9), "give the time in seconds"),
    ];
    for (change, word) in faults {
        let error = refusal(change);
        assert!(error.contains(word), "{error}");
    }
}

fn without(all: &Recording, lost: &[std::ops::Range<usize>]) -> Recording {
    let mut parts: Vec<Recording> = Vec::new();
    let mut from = 0;
    let end = all.time.len()..all.time.len();
    for range in lost.iter().cloned().chain(std::iter::once(end)) {
        parts.push(all.rows(from, range.start));
        from = range.end;
    }
    let column = |of: fn(&Recording) -> &Vec<f64>| parts.iter().flat_map(of).copied().collect();
    Recording {
        from_rest: false,
        ..Recording::of("a.csv", column(|r| &r.time), column(|r| &r.torque), column(|r| &r.rate))
    }
}

/// The recorded torque has gaps of 10 and 50 rows. In a sweep the lost rows are predicted from the rows around a gap; in
/// noise they are not.
#[test]
fn lost_rows_of_a_sweep_are_interpolated_and_lost_rows_of_noise_split_the_recording() {
    let mut random = analysis::random::Random::new(1, 0);
    let noise: Vec<f64> = (0..15_000).map(|_| 4e-4 * random.normal()).collect();
    let noisy = |mut recording: Recording| {
        recording.rate.iter_mut().zip(&noise).for_each(|(w, n)| *w += n);
        recording
    };
    let lost = [3_000..3_010, 7_000..7_050];
    let mut said = Vec::new();
    let sweep = noisy(rigid());
    let parts = prepare(without(&sweep, &lost), COARSEST, &mut |line| said.push(line)).unwrap();
    assert_eq!(parts.len(), 1, "{said:?}");
    let (found, fresh) = (&parts[0], parts[0].fresh.as_ref().unwrap());
    assert_eq!((found.time.len(), fresh.iter().filter(|f| **f).count()), (15_000, 14_935));
    let off = found.torque.iter().zip(&sweep.torque).map(|(a, b)| (a - b).abs());
    assert!(off.fold(0.0, f64::max) < 2e-4, "{said:?}");
    assert!(
        said[0].contains("60 samples of tau_cmd are missing in 2 gaps of up to 1.02 s"),
        "{said:?}"
    );
    // a torque that cannot be predicted in its gaps
    let mut jumps = sweep.clone();
    jumps.torque.iter_mut().for_each(|t| *t += 0.05 * random.normal());
    said.clear();
    let parts = prepare(without(&jumps, &lost), COARSEST, &mut |line| said.push(line)).unwrap();
    assert_eq!(parts.iter().map(|p| p.time.len()).collect::<Vec<_>>(), [3_000, 3_990, 7_950]);
    assert!(said[0].contains("tau_cmd is missing for 0.22 s and cannot be predicted"), "{said:?}");
    assert!(!parts[1].from_rest);
}

/// Rows in which a slow gyro has no value still drive the model with their torque.
#[test]
fn rows_without_a_gyro_value_still_drive_the_model() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.csv");
    let mut text = String::from("time,tau_cmd,omega,theta\n");
    let all = rigid();
    for k in 0..15_000 {
        let rate = if k % 5 == 2 { all.rate[k].to_string() } else { String::new() };
        let angle = if k % 2 == 0 { "0.1" } else { "" };
        text += &format!("{},{},{rate},{angle}\n", all.time[k], all.torque[k]);
    }
    std::fs::write(&path, text).unwrap();
    let source = Source { columns: Columns::default(), trim: None };
    let mut said = Vec::new();
    let parts = read(&path, &source, COARSEST, &mut |line| said.push(line)).unwrap();
    assert_eq!((parts.len(), parts[0].torque.len()), (1, 15_000), "{said:?}");
    assert_eq!(parts[0].torque, all.torque);
    let (rate, angle) = (parts[0].fresh.as_ref().unwrap(), parts[0].angle_fresh.as_ref().unwrap());
    let count = |mask: &[bool]| mask.iter().filter(|new| **new).count();
    // without the first 0.1 s, because the recording begins in motion
    assert_eq!((count(rate), count(angle)), (2_999, 7_497));
    assert!(
        said.iter()
            .any(|line| line
                .contains("omega has a value in 3000 of 15000 rows, usually every 0.1000 s")),
        "{said:?}"
    );
}

/// A rate that repeats each value three times comes from a gyro with a third of the sampling rate of the rows.
#[test]
fn a_gyro_slower_than_the_rows_is_recognised_by_repeated_values() {
    let mut random = analysis::random::Random::new(1, 0);
    let mut noisy = rigid();
    noisy.rate.iter_mut().for_each(|w| *w += 4e-4 * random.normal());
    assert!(fresh(&noisy.rate).is_none());
    // a new value in every third row, from row 2 on
    let held: Vec<f64> =
        (0..noisy.rate.len()).map(|k| noisy.rate[((k + 1) / 3 * 3).min(14_999)]).collect();
    let found = fresh(&held).unwrap();
    assert_eq!(found.iter().filter(|new| **new).count(), held.len() / 3);
    assert!(found[2] && !found[3] && !found[4]);
    // a gyro with a coarse resolution repeats values by chance
    let coarse: Vec<f64> = noisy.rate.iter().map(|w| (w / 1e-3).round() * 1e-3).collect();
    assert!(fresh(&coarse).is_none());
    // a gyro whose clock is independent of the clock of the rows
    let other: Vec<f64> =
        (0..noisy.rate.len()).map(|k| noisy.rate[(k as f64 / 1.37) as usize]).collect();
    let new = fresh(&other).unwrap().iter().filter(|new| **new).count();
    assert!((new as f64 * 1.37 / other.len() as f64 - 1.0).abs() < 0.01, "{new}");
}

use host::schedule::{History, Schedule};

fn schedule(span: (f64, f64), step: Option<f64>, knots: &[f64]) -> Vec<(f64, bool)> {
    let schedule = Schedule::new(span, step, [knots]).unwrap();
    (0..schedule.time.len()).map(|k| (schedule.time[k], schedule.is_row(k))).collect()
}

#[test]
fn every_row_of_an_input_and_of_the_result_is_a_communication_point() {
    let inputs = [0.0, 0.015, 0.02, 0.02, 0.06, 0.07];
    assert_eq!(
        schedule((0.0, 0.07), Some(0.02), &inputs),
        [
            (0.0, true),
            (0.015, false),
            (0.02, true),
            (0.04, true),
            // in floating-point numbers, 3 · 0.02 is one ulp above 0.06
            (0.06, true),
            (0.07, true)
        ]
    );
    let rows = [0.0, 0.015, 0.02, 0.06, 0.07].map(|t| (t, true));
    assert_eq!(schedule((0.0, 0.07), None, &inputs), rows);
    // values before the first row and after the last row of the inputs
    assert_eq!(
        schedule((-0.02, 0.01), Some(0.02), &[0.0, 0.005]),
        [(-0.02, true), (0.0, true), (0.005, false), (0.01, true)]
    );
    // A row of the result that differs from a row of an input by less than 1e-6 of a step is moved to this row, instead of
    // being an additional point.
    let near = [0.0, 0.02 + 1e-9, 0.04 - 1e-9, 0.06];
    let found = schedule((0.0, 0.06), Some(0.02), &near);
    assert_eq!(found, near.map(|t| (t, true)));
}

#[test]
fn an_input_history_is_piecewise_linear_and_may_jump() {
    let lines = |hold| {
        let (time, values) = (vec![0.0, 1.0, 1.0, 3.0], vec![0.0, 2.0, 5.0, 1.0]);
        History::new(time, values, None, hold).unwrap()
    };
    let at = |history: &History, t| history.after(t);
    assert_eq!(at(&lines(false), 0.5), (1.0, 2.0));
    assert_eq!(at(&lines(false), 1.0), (5.0, -2.0));
    assert_eq!(at(&lines(false), 9.0), (1.0, 0.0));
    assert_eq!(at(&lines(false), -1.0), (0.0, 0.0));
    assert_eq!(at(&lines(true), 2.9), (5.0, 0.0));
    assert_eq!(lines(false).held(), lines(true));
    // in floating-point numbers, 3 · 0.1 is one ulp above 0.3, and 1 - 0.9 is three ulps below 0.1
    assert_eq!(lines(true).near(1.0 - 1e-12), 5.0);
    let given =
        History::new(vec![0.0, 1.0, 2.0], vec![1.0, 1.0, 1.0], Some(vec![0.5, 0.0, 7.0]), false);
    let given = given.unwrap();
    assert_eq!(
        [at(&given, 0.5), at(&given, 1.0), at(&given, 3.0)],
        [(1.25, 0.5), (1.0, 0.0), (1.0, 0.0)]
    );
    let mut cursor = given.cursor();
    for t in [-1.0, 0.0, 0.7, 1.0, 2.0, 5.0] {
        assert_eq!(cursor.after(t), given.after(t), "{t}");
    }
}

#[test]
fn invalid_input_histories_and_too_many_communication_points_are_refused() {
    for (time, word) in [
        (vec![0.0], "the table of inputs has 1 rows (allowed: at least two)"),
        (vec![0.0, 1.0, 0.5], "row 3: time goes from 1 to 0.5 s; it must not go back"),
        (vec![0.0, f64::NAN, 1.0], "row 2: time goes from 0 to NaN s"),
    ] {
        let values = vec![0.0; time.len()];
        let error = History::new(time, values, None, false).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
    let error = Schedule::new((0.0, 1.0), Some(1e-9), []).unwrap_err().to_string();
    assert!(error.contains("allowed: at most 20000000"), "{error}");
}

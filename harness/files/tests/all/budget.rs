use files::budget::{BYTES, ROWS, jobs, reading, steps, table};

#[test]
fn sizes_above_a_limit_are_refused_with_the_allowed_size() {
    assert_eq!(steps(2700.0, 0.02).unwrap(), 135_000);
    assert_eq!(steps(1.0, 0.3).unwrap(), 4);
    assert!(reading(ROWS, 3, 0).is_ok() && reading(ROWS, 20, 1 << 30).is_ok());
    for (refused, words) in [
        (steps(1e12, 0.02).map(drop), "5.000e13 steps (allowed: at most 20000000)"),
        (steps(1.0, 1e-300).map(drop), "1.000e300 steps"),
        (steps(1.0, 0.0).map(drop), "must be a positive number of seconds, not 0"),
        (steps(f64::NAN, 0.1).map(drop), "seconds, not NaN"),
        (steps(f64::INFINITY, 0.1).map(drop), "seconds, not inf"),
        (table(ROWS + 2, 1).map(drop), "rows (allowed: at most 20000000)"),
        (table(ROWS, 100).map(drop), "take 16.0 GB (allowed: at most 4.3 GB)"),
        (table(usize::MAX, usize::MAX).map(drop), "allowed"),
        (reading(ROWS, 20, 1000).map(drop), "take 3.2 GB in a file of 0.0 MB (allowed: 0.5 GB,"),
        (reading(ROWS, 100, 1 << 40).map(drop), "take 16.0 GB (allowed: at most 4.3 GB)"),
        (jobs(100_000, 1).map(drop), "100000 runs at once (allowed: 1 to 512)"),
    ] {
        let error = refused.unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn parallel_jobs_together_stay_within_the_memory_limit() {
    assert_eq!(jobs(8, BYTES / 3).unwrap(), 3);
    assert_eq!(jobs(8, BYTES * 2).unwrap(), 1);
    assert_eq!(jobs(8, 0).unwrap(), 8);
    assert!(jobs(0, 1).unwrap() >= 1);
}

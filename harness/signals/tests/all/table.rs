//! Tables are read as they were written, and errors about damaged tables name the row and the column.

use std::collections::BTreeMap;

use signals::table::{Table, metadata};

fn table() -> Table {
    let names = ["time", "tau_cmd", "omega"].map(String::from).to_vec();
    Table::new(names, vec![vec![0.0, 0.02], vec![0.1, 1.0 / 3.0], vec![-1e-300, 2e17]])
}

#[test]
fn numbers_are_read_back_bit_for_bit_from_both_formats() {
    let directory = tempfile::tempdir().unwrap();
    for name in ["a.csv", "a.parquet"] {
        let path = directory.path().join(name);
        table().write(&path, &BTreeMap::from([("k".into(), "v".into())])).unwrap();
        let back = Table::read(&path, &["omega", "time"]).unwrap();
        assert_eq!(back, table().select(&["omega", "time"]));
    }
    assert_eq!(metadata(&directory.path().join("a.parquet")).unwrap()["k"], "v");
}

#[test]
fn tables_with_a_missing_column_or_a_nan_are_refused_with_column_and_row() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.csv");
    std::fs::write(&path, "time,torque\n0,1\n").unwrap();
    let error = format!("{:#}", Table::read(&path, &["time", "tau_cmd"]).unwrap_err());
    assert!(error.contains("no column tau_cmd (columns in it: time, torque)"), "{error}");
    std::fs::write(&path, "time,tau_cmd\n0,1\n1,NaN\n").unwrap();
    let error = format!("{:#}", Table::read(&path, &["time", "tau_cmd"]).unwrap_err());
    assert!(error.contains("a.csv, row 2: tau_cmd is NaN"), "{error}");
}

#[test]
fn a_table_with_a_value_that_is_not_finite_is_not_written() {
    let directory = tempfile::tempdir().unwrap();
    let names = ["time", "omega"].map(String::from).to_vec();
    let table = Table::new(names, vec![vec![0.0, 1.0], vec![0.5, f64::NAN]]);
    for name in ["a.csv", "a.parquet"] {
        let path = directory.path().join(name);
        let error = format!("{:#}", table.write(&path, &BTreeMap::new()).unwrap_err());
        let why = "cannot be written: row 2: omega is NaN (allowed: finite numbers)";
        assert!(error.contains(why) && error.contains(name), "{error}");
        assert!(!path.exists());
    }
    assert!(table.write_csv(Vec::new()).is_err());
}

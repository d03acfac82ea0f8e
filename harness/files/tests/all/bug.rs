use files::bug::{catch_panic, report};

#[test]
fn a_panic_becomes_a_report_of_a_bug_in_this_program() {
    assert_eq!(catch_panic(|| 3), Ok(3));
    let told = catch_panic(|| -> i32 { panic!("row {} is odd", 7) }).unwrap_err().0;
    assert!(told.starts_with("row 7 is odd"), "{told}");
    let report = report(&told);
    assert!(report.starts_with("this is a bug of hubslosh") && report.contains("row 7 is odd"));
}

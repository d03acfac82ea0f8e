use identify::words::page::format_to_deviation;

#[test]
fn reported_numbers_are_rounded_to_the_digits_that_their_standard_deviation_justifies() {
    assert_eq!(format_to_deviation(-1.4e-14, 9.3e-9), "0");
    assert_eq!(format_to_deviation(0.32241, 8.1e-4), "0.32241");
    assert_eq!(format_to_deviation(-1.82e-8, 9.3e-9), "-1.8e-8");
}

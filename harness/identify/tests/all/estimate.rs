use identify::estimate::Estimated;

#[test]
fn an_open_end_of_an_interval_is_null_in_json() {
    let open =
        Estimated { interval: [0.02, f64::INFINITY], ..Estimated::normal(0.1, 0.2, "rad/s") };
    let json = serde_json::to_value(&open).unwrap();
    assert_eq!(json["interval"], serde_json::json!([0.02, null]));
}

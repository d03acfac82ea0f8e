use identify::input::tolerance::Tolerances;

#[test]
fn a_text_of_tolerances_sets_the_named_values_or_names_its_fault() {
    let found = Tolerances::default().with("torque=2%, tank.r=0.001").unwrap();
    assert_eq!(found, Tolerances { torque: 0.02, arm: 0.001, ..Tolerances::default() });
    for (text, says) in [
        ("torque", "NAME=NUMBER"),
        ("mass=1%", "no tolerance"),
        ("clock=80%", "0 to 50 %"),
        ("clock=x", "not a number"),
    ] {
        let error = Tolerances::default().with(text).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}

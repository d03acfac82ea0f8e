use host::description::Value;
use host::parameter_set::ParameterSet;

#[test]
fn a_parameter_that_is_given_twice_is_refused_with_both_lines() {
    let folder = tempfile::tempdir().unwrap();
    let error = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        format!("{:#}", ParameterSet::read(&path).unwrap_err())
    };
    let one =
        |value: f64| format!("<Parameter name=\"tank.h\"><Real value=\"{value}\"/></Parameter>\n");
    let ssv = format!(
        "<ParameterSet>\n<Parameters>\n{}{}</Parameters></ParameterSet>",
        one(0.1),
        one(0.2)
    );
    for (name, text, words) in [
        ("a.ssv", &*ssv, "a.ssv: line 4: tank.h is given twice, first in line 3 (allowed: once)"),
        (
            "a.toml",
            "\"tank.h\" = 1\n\n[tank]\nh = 2\n",
            "line 4: tank.h is given twice, first in line 1",
        ),
        ("a.toml", "\"tank.h\" = 1\n\"tank.h\" = 2\n", "line 2"),
        (
            "a.json",
            "{\"parameters\": {\"hub.I\": {\"value\": 1},\n\"hub.I\": {\"value\": 2}}}",
            "hub.I is given twice (allowed: once) at line 2",
        ),
        ("a.json", "{\"parameters\": {},\n\"parameters\": {}}", "duplicate field `parameters`"),
    ] {
        let error = error(name, text);
        assert!(error.contains(words), "{words}: {error}");
    }
}

#[test]
fn numbers_booleans_and_texts_of_a_parameter_file_in_toml_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.toml");
    std::fs::write(&path, "a = 1_000.5\nb.c = 0x10\nd = true\ne = 'x'\nf = inf").unwrap();
    let found = ParameterSet::read(&path).unwrap();
    let values: Vec<_> = found.parameters.iter().map(|p| (&*p.name, p.value.clone())).collect();
    let expected = [
        ("a", Value::Real(1000.5)),
        ("b.c", Value::Integer(16)),
        ("d", Value::Boolean(true)),
        ("e", Value::String("x".into())),
        ("f", Value::Real(f64::INFINITY)),
    ];
    assert_eq!(values, expected);
}

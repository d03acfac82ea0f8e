//! FMUs 3.0 with array variables, whose length a structural parameter determines. It is set
//! like any other parameter.

use experiments::profile::Torque;
use experiments::run::{Run, parameters};
use host::fmu::Fmu;
use pack::{Fmi, packed_version_for_tests};
use signals::table::Table;

const SCALARS: [(&str, &str); 6] = [
    ("tank[1].position[3]", "-0.55"),
    ("tank[2].position[3]", "0.45"),
    ("tank[2].diameter", "800 mm"),
    ("tank[2].depth", "0.35"),
    ("tank[2].modes", "2"),
    ("tanks", "2"),
];

const COLUMNS: [&str; 4] = ["omega[1]", "tank[1].p[1,2]", "tank[2].p[2,2]", "tank[2].wave_height"];

fn in_arrays(name: &str) -> String {
    let Some((tank, rest)) = name.strip_prefix("tank[").and_then(|rest| rest.split_once("]."))
    else {
        return name.into();
    };
    match rest.split_once('[') {
        Some((name, indices)) => format!("tank.{name}[{tank},{indices}"),
        None => format!("tank.{rest}[{tank}]"),
    }
}

fn settings(pairs: &[(&str, &str)]) -> Vec<(String, String)> {
    pairs.iter().map(|(name, value)| (name.to_string(), value.to_string())).collect()
}

fn run(settings: Vec<(String, String)>) -> Run {
    Run {
        settings,
        input: Some("torque[1]".into()),
        torque: Torque::Profile("sine:amplitude=5,frequency=0.5".parse().unwrap()),
        others: Vec::new(),
        step: 0.1,
        sample: 0.1,
        stop: 5.0,
        tolerance: None,
        hold: false,
    }
}

fn record(fmu: &Fmu, run: &Run, columns: &[&str]) -> Table {
    let mut instance = run.initialise(fmu).unwrap();
    run.drive(&mut instance, columns, |_| {}).unwrap()
}

fn spacecraft(fmi: Fmi, settings: &[(String, String)]) -> anyhow::Result<Fmu> {
    let model = pack::model("Spacecraft").unwrap();
    Fmu::open_with(packed_version_for_tests(model, fmi), settings)
}

/// The same parameters are set as array elements of a Spacecraft with arrays, and as scalars of a Spacecraft with scalars.
/// `tanks` sets the size.
#[test]
fn spacecraft_with_arrays_and_spacecraft_with_scalars_move_bit_identically() {
    let set = settings(&SCALARS);
    let scalars = spacecraft(Fmi::V3, &set).unwrap();
    let expected = record(&scalars, &run(set), &COLUMNS);
    // elements that exist only with the larger size are set before the size
    let set: Vec<_> =
        SCALARS.iter().map(|(name, value)| (in_arrays(name), value.to_string())).collect();
    assert_eq!((&*set[1].0, &*set[2].0), ("tank.position[2,3]", "tank.diameter[2]"));
    let arrays = spacecraft(Fmi::V3Arrays, &set).unwrap();
    let names = COLUMNS.map(in_arrays);
    let names: Vec<_> = names.iter().map(String::as_str).collect();
    let found = record(&arrays, &run(set.clone()), &names);
    for (name, scalar) in names.iter().zip(COLUMNS) {
        assert_eq!(found.column(name), expected.column(scalar), "{scalar}");
        let moves = found.column(name).unwrap().iter().any(|x| x.abs() > 1e-6);
        assert!(moves, "{scalar}");
    }
    // the metadata of a run's table contain the size, the settings, and the start values of everything else
    let all = parameters(arrays.description(), &set, &[]);
    let of = |name: &str| all.get(name).map(String::as_str);
    assert_eq!((of("tanks"), of("tank.modes[2]")), (Some("2"), Some("2")));
    let same = parameters(scalars.description(), &settings(&SCALARS), &[]);
    assert_eq!(of("tank.hinge[2,1]"), same.get("tank[2].hinge[1]").map(String::as_str));
    assert_eq!(of("tank.diameter[3]"), None);
    // The description has the set size, and as many elements of each array as this size requires, in row-major order.
    let description = arrays.description();
    let size = description.variable("tanks").unwrap().attributes().start.as_deref();
    let last = description.variable("tank.position[2,3]").unwrap().reference;
    let last = description.element(last).unwrap();
    let length = description.array(last.array).unwrap().length;
    assert_eq!((size, last.index, length), (Some("2"), 5, 6));
}

#[test]
fn arrays_have_the_declared_size_unless_a_setting_changes_it() {
    let fmu = spacecraft(Fmi::V3Arrays, &settings(&[("tank.position[1,3]", "-0.5")])).unwrap();
    assert!(fmu.description().variable("tank.position[1,3]").is_ok());
    assert!(fmu.description().variable("tank.position[2,3]").is_err());
    // with a size of 0 the arrays are empty
    let fmu = spacecraft(Fmi::V3Arrays, &settings(&[("tanks", "0")])).unwrap();
    assert!(fmu.description().variable("tank.position[1,3]").is_err());
    let table = record(&fmu, &run(settings(&[("tanks", "0")])), &["omega[1]"]);
    assert!(table.column("omega[1]").unwrap().iter().any(|rate| rate.abs() > 1e-3));
}

#[test]
fn array_sizes_that_are_refused_are_reported_with_allowed_values() {
    let wrong = |value: &str| {
        let error = spacecraft(Fmi::V3Arrays, &settings(&[("tanks", value)]));
        format!("{:#}", error.err().expect("it is refused"))
    };
    assert!(wrong("5").contains("tanks = 5 (allowed: 0 to 4)"), "{}", wrong("5"));
    assert!(wrong("-1").contains("tanks expects a whole number"), "{}", wrong("-1"));
    let most = wrong("9000000000000000000");
    assert!(most.contains("(allowed: 0 to 4)"), "{most}");
    let fmu = spacecraft(Fmi::V3Arrays, &[]).unwrap();
    let late = run(settings(&[("tanks", "2")])).initialise(&fmu);
    let late = format!("{:#}", late.err().expect("it is refused"));
    assert!(late.contains("tanks cannot be set to 2: it is a structural parameter"), "{late}");
    // in the FMU with scalars `tanks` is an ordinary parameter
    let fmu = spacecraft(Fmi::V3, &[]).unwrap();
    run(settings(&[("tanks", "2")])).initialise(&fmu).unwrap();
}

//! Tests of the properties of a model that follow from its table of variables.

use super::*;
use crate::table::{About, Layout, Scalar, Table, scalar_count, scalars};
use crate::unit::{self, UNITS};
use crate::variable::{Dimension, Enumeration, Item, Quantity, Variable};

fn names<'a>(of: impl IntoIterator<Item = &'a Scalar<Vessels>>) -> Vec<String> {
    of.into_iter().map(Scalar::name).collect()
}

fn scalar(name: &str) -> &'static Scalar<Vessels> {
    &TABLE.scalars[reference(name) as usize]
}

#[test]
fn the_table_of_variables_lists_inputs_parameters_and_states() {
    assert_eq!(TABLE.scalars.len(), 25);
    assert_eq!(names(TABLE.inputs()), ["q[1]", "q[2]", "z", "w"]);
    assert_eq!(
        names(TABLE.parameters()),
        [
            "leak",
            "start.level[1]",
            "start.level[2]",
            "inspection",
            "has_lid",
            "number",
            "gauges",
            "material"
        ]
    );
    let slots: Vec<_> = TABLE.parameters().iter().map(|s| s.slot).collect();
    assert_eq!(slots, [0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(names(TABLE.derivatives()), ["der(level[1])", "der(level[2])"]);
    assert_eq!(TABLE.places().collect::<Vec<_>>(), [1, 0]);
    assert_eq!(names(TABLE.state_at(0)), ["level[2]"]);
    assert_eq!(names(TABLE.state_at(1)), ["level[1]"]);
    assert!(TABLE.state_at(2).is_none());
    assert_eq!((scalar("level[2]").state(), scalar("sum").state()), (Some(0), None));
    for (n, scalar) in TABLE.scalars.iter().enumerate() {
        assert_eq!(scalar.index as usize, n);
        let first = TABLE.find(&scalar.variable.element_name(0)).unwrap() as usize;
        assert_eq!(scalar.element, n - first);
    }
    assert_eq!(TABLE.find("level"), None);
    // The first entry of the table is found, and lists of kinds that the table does not contain are empty.
    let spring = Spring::table();
    assert_eq!(spring.inputs().len(), 1);
    assert_eq!(spring.derivatives().len(), 2);
}

#[test]
fn start_values_equal_those_of_the_model() {
    use Value::{Boolean, Integer, Real};
    let starts = [
        Real(0.5),
        Real(3.0),
        Real(4.0),
        Real(1e9),
        Boolean(true),
        Integer(2),
        Integer(3),
        Integer(1),
    ];
    assert_eq!(TABLE.starts(), starts);
    assert_eq!(scalar("q[2]").start(), Some(Real(2.0)));
    assert_eq!(scalar("start.level[2]").start(), Some(Real(4.0)));
    assert_eq!(scalar("sum").start(), None);
}

/// The dependency list of an array may contain the name of another array with empty brackets, which stands for the element
/// with the same index. For example, `net[2]` depends on `level[2]` and `q[2]`. The name of an array without brackets stands
/// for all its elements.
#[test]
fn names_of_arrays_in_dependency_lists_stand_for_their_elements() {
    let depends = |name: &str| names(scalar(name).depends_on());
    let initially = |name: &str| names(scalar(name).initial_depends_on());
    assert_eq!(depends("level[2]"), ["level[2]"]);
    assert_eq!(depends("sum"), ["level[1]", "level[2]"]);
    assert_eq!(depends("net[2]"), ["level[2]", "q[2]"]);
    assert_eq!(depends("room"), ["z"]);
    assert!(depends("open").is_empty());
    assert_eq!(initially("sum"), ["start.level[1]", "start.level[2]"]);
    assert_eq!(initially("net[2]"), ["q[2]", "leak", "start.level[1]"]);
    assert_eq!(initially("room"), ["z"]);
}

#[test]
fn the_table_declares_only_units_and_enumerations_that_it_uses() {
    let units: Vec<_> = TABLE.units().map(|unit| unit.name).collect();
    assert_eq!(units, ["m", "s", "1/s", "1/s2", "m/s"]);
    let enumerations: Vec<_> = TABLE.enumerations().iter().map(|e| e.name).collect();
    assert_eq!(enumerations, ["Valve", "Material"]);
    let twice = [TABLE.variables, TABLE.variables].concat().leak();
    let twice = Table::new(TABLE.about, twice, &[]);
    assert_eq!(twice.enumerations().len(), 2);
    assert!(Spring::table().enumerations().is_empty());
}

/// Returns the exponents of kg, m, s and rad of one factor in the name of a unit, for example [1, 1, -2, 0] for `N` in `N.m`.
fn base(symbol: &str) -> [i32; 4] {
    match symbol {
        "1" => [0, 0, 0, 0],
        "kg" => [1, 0, 0, 0],
        "m" => [0, 1, 0, 0],
        "s" => [0, 0, 1, 0],
        "rad" => [0, 0, 0, 1],
        "Hz" => [0, 0, -1, 0],
        "N" => [1, 1, -2, 0],
        "J" => [1, 2, -2, 0],
        "W" => [1, 2, -3, 0],
        _ => panic!("{symbol}"),
    }
}

#[test]
fn the_exponents_of_every_unit_follow_from_its_name() {
    for unit in UNITS {
        let Some(found) = unit.base else {
            assert!(["sqrt", "^0.5"].iter().any(|root| unit.name.contains(root)), "{}", unit.name);
            continue;
        };
        let mut exponents = [0; 4];
        for (n, part) in unit.name.split('/').enumerate() {
            for factor in part.split('.') {
                let symbol = factor.trim_end_matches(|c: char| c.is_ascii_digit() && factor != "1");
                let power: i32 = factor[symbol.len()..].parse().unwrap_or(1);
                let sign = if n == 0 { 1 } else { -1 };
                let base = base(symbol);
                exponents = std::array::from_fn(|i| exponents[i] + sign * power * base[i]);
            }
        }
        assert_eq!(found, exponents, "{}", unit.name);
    }
}

#[test]
fn every_display_unit_is_a_common_unit() {
    let of = |name: &str| unit::find(name).unwrap().display_units;
    assert_eq!(of("m"), [("mm", 1e3)]);
    for (turn, name) in [(360.0, "deg/s"), (3600.0 * 360.0, "deg/h"), (60.0, "rpm")] {
        let (_, factor) = of("rad/s").iter().find(|(unit, _)| *unit == name).unwrap();
        close(factor * std::f64::consts::TAU, turn, 1e-15);
    }
    assert_eq!(unit::find("N.m").unwrap().name, "N.m");
    assert!(unit::find("furlong").is_none());
}

type Change = fn(&mut Vec<Variable<Vessels>>);

static OTHER_ITEMS: Enumeration = Enumeration {
    name: "Valve",
    description: "",
    items: &[Item::new("x", ""), Item::new("y", "")],
};
static OTHER_NAME: Enumeration = Enumeration {
    name: "Other",
    description: "",
    items: &[Item::new("x", ""), Item::new("y", "")],
};

#[test]
fn the_guid_changes_with_everything_that_a_host_depends_on() {
    let guid = |about: About, variables: Vec<Variable<Vessels>>| {
        Table::new(about, variables.leak(), &[]).guid().to_string()
    };
    let own = TABLE.guid();
    assert_eq!(own, "{bbe32794-f28d-7a5f-1635-f5b0c3d60d1d}");
    let about = TABLE.about;
    let all = || TABLE.variables.to_vec();
    assert_eq!(guid(about, all()), own);
    let silent: [Change; 2] = [|v| v[0].description = "other", |v| v[10].follows_inputs = false];
    for change in silent {
        let mut variables = all();
        change(&mut variables);
        assert_eq!(guid(about, variables), own);
    }
    for about in [
        About { model: "Other", ..about },
        About { version: "2", ..about },
        About { event_indicators: 2, ..about },
    ] {
        assert_ne!(guid(about, all()), own);
    }
    fn quantity(variable: &mut Variable<Vessels>) -> &mut Quantity {
        match &mut variable.kind {
            Kind::Real(quantity) => quantity,
            _ => panic!("{} has no unit", variable.name),
        }
    }
    let changes: [Change; 19] = [
        |v| v[0].name = "other",
        |v| v[0].causality = v[2].causality,
        |v| v[0].shape = &[],
        |v| v[0].reinit = false,
        |v| v[12].tunable = false,
        |v| v[0].depends_on = &[],
        |v| v[0].initial_depends_on = &[],
        |v| quantity(&mut v[0]).unit = "s",
        |v| quantity(&mut v[13]).display_unit = None,
        |v| quantity(&mut v[13]).min = None,
        |v| quantity(&mut v[13]).max = None,
        |v| quantity(&mut v[0]).nominal = None,
        |v| v[16].kind = Kind::Integer { min: Some(-3), max: Some(6) },
        |v| v[16].kind = Kind::Integer { min: None, max: Some(5) },
        |v| v[5].kind = Kind::Integer { min: None, max: None },
        |v| v[7].kind = Kind::Enumeration(&OTHER_ITEMS),
        |v| v[7].kind = Kind::Enumeration(&OTHER_NAME),
        // The following changes alter start values:
        |v| v[12].access = v[14].access,
        |v| v.swap(0, 1),
    ];
    for (n, change) in changes.into_iter().enumerate() {
        let mut variables = all();
        change(&mut variables);
        assert_ne!(guid(about, variables), own, "change {n}");
    }
}

#[test]
fn the_fmi_3_token_depends_on_which_inputs_can_be_set_within_a_step() {
    let token = |variables: Vec<Variable<Vessels>>| {
        Table::new(TABLE.about, variables.leak(), &[]).token(Layout::Scalars).to_string()
    };
    let mut variables = TABLE.variables.to_vec();
    assert_eq!(
        (variables[10].name, token(variables.clone())),
        ("z", TABLE.token(Layout::Scalars).into())
    );
    variables[10].follows_inputs = false;
    assert_ne!(token(variables), TABLE.token(Layout::Scalars));
}

#[test]
#[should_panic(expected = "each stand together in the table")]
fn a_table_of_variables_whose_inputs_are_not_adjacent_is_refused() {
    let apart = [9, 0, 10].map(|n| TABLE.variables[n]).to_vec().leak();
    const N: usize = 4 + 1;
    assert_eq!(scalar_count(apart), N);
    Table::new(TABLE.about, apart, scalars::<Vessels, N>(apart).to_vec().leak());
}

#[test]
fn the_token_of_a_description_with_arrays_depends_on_its_structural_parameters() {
    let tokens = |shape: &'static [Dimension]| {
        let mut variables = TABLE.variables.to_vec();
        variables[0] = variables[0].shape(shape);
        let table = Table::new(TABLE.about, variables.leak(), &[]);
        Layout::ALL.map(|layout| table.token(layout).to_string())
    };
    let fixed = tokens(&[Dimension::Fixed(2)]);
    let sized = tokens(&[Dimension::Sized("gauges", 2)]);
    assert_eq!(fixed[0], sized[0]);
    assert_ne!(fixed[1], sized[1]);
    assert_ne!(fixed[0], fixed[1]);
}

use formulas::limits::LimitedBy;
use names::hubslosh::LIMITED_BY_KIND;
use names::limits::Limits;

/// Returns the sentences about one tank that is out of its range for the reasons with these `numbers` at these times.
fn words(time: &[f64], numbers: &[f64]) -> Vec<String> {
    let limits = Limits::find(|name| name == LIMITED_BY_KIND);
    limits.describe(|name| if name == "time" { Some(time) } else { Some(numbers) })
}

#[test]
fn each_reason_for_leaving_the_model_s_range_has_its_share_of_time_and_first_time() {
    let of = |reason: LimitedBy, share: &str, first: f64| {
        let meaning = reason.meaning();
        let meaning = meaning[..1].to_lowercase() + &meaning[1..];
        format!("{meaning} ({share}, first at {first} s)")
    };
    let out = |share: &str, reasons: &[String]| {
        [format!("out of range for {share} of the time: {}", reasons.join("; "))]
    };
    let time = [0.0, 1.0, 3.0, 4.0, 10.0];
    let all = [of(LimitedBy::ThirdOrder, "80.0 %", 1.0), of(LimitedBy::Spin, "10.0 %", 3.0)];
    assert_eq!(words(&time, &[1.0, 2.0, 5.0, 2.0, 5.0]), out("90.0 %", &all));
    assert!(words(&time, &[1.0; 5]).is_empty());
    let contact = of(LimitedBy::Contact, "100.0 %", 2.0);
    assert_eq!(words(&[2.0], &[8.0]), out("100.0 %", &[contact]));
    // A reason in the last row has no share, because the table ends there.
    let small = "less than 0.1 %";
    let last = of(LimitedBy::ThirdOrder, small, 10.0);
    assert_eq!(words(&time, &[1.0, 1.0, 1.0, 1.0, 2.0]), out(small, &[last]));
    for (share, text) in [(1e-5, small), (0.123_45, "12.3 %")] {
        let first = of(LimitedBy::ThirdOrder, text, 0.0);
        assert_eq!(words(&[0.0, share, 1.0], &[2.0, 1.0, 1.0]), out(text, &[first]));
    }
}

#[test]
fn the_report_has_a_sentence_for_each_tank_that_left_its_range() {
    let names = ["tank[1].limited_by_kind", "tank[2].limited_by_kind"];
    let limits = Limits::find(|name| names.contains(&name));
    assert_eq!(limits.required_columns().collect::<Vec<_>>(), names);
    let (time, inside, outside) = ([0.0, 1.0, 4.0], [1.0; 3], [1.0, 5.0, 5.0]);
    let words = limits.describe(|name| match name {
        "time" => Some(&time[..]),
        name if name == names[0] => Some(&inside),
        name if name == names[1] => Some(&outside),
        _ => None,
    });
    assert_eq!(
        words,
        [
            "tank 2: out of range for 75.0 % of the time: the tank turns about its axis so fast that the spin of the liquid \
          matters (75.0 %, first at 1 s)"
        ]
    );
}

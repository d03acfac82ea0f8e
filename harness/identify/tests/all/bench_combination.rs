use identify::bench::combination::way;

#[test]
fn a_hub_counts_as_turning_one_way_if_nearly_all_of_its_path_is_in_one_direction() {
    assert_eq!(way([1.0, 2.0, -0.1].into_iter()), Some(1.0));
    assert_eq!(way([-1.0, -2.0, 0.1].into_iter()), Some(-1.0));
    assert_eq!(way([1.0, -1.0].into_iter()), None);
    assert_eq!(way([0.0, 0.0].into_iter()), None);
}

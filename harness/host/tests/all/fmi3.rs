use host::fmi3::Fmu;

#[test]
fn an_fmu_3_must_export_75_functions() {
    let mut all = Fmu::symbols();
    all.sort_unstable();
    all.dedup();
    assert_eq!(all.len(), 75);
}

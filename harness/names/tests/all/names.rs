use names::{hubslosh, sloshtank, spacecraft};

#[test]
fn array_elements_have_the_names_in_the_model_descriptions() {
    assert_eq!(hubslosh::slosh::MASS.element([10]), "slosh.mass[10]");
    assert_eq!(sloshtank::tank::P.element([1, 3]), "tank.p[1,3]");
    assert_eq!(spacecraft::tank::M_0.element([4]), "tank[4].m_0");
    assert_eq!(spacecraft::tank::P.element([2, 1, 3]), "tank[2].p[1,3]");
}

#[test]
fn enumeration_items_are_found_by_their_names() {
    use hubslosh::FrictionModel;
    assert_eq!(FrictionModel::named("stribeck_smooth"), Some(FrictionModel::StribeckSmooth));
    assert_eq!(FrictionModel::named("Stribeck"), None);
    assert_eq!((FrictionModel::Lugre.name(), FrictionModel::Lugre as i32), ("lugre", 5));
}

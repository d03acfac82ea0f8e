use identify::input::names::list;
use identify::input::question::*;

#[test]
fn options_of_identify_are_read_from_text() {
    let free: Free = "tank[1].mass[1]@each=2:0.5:inf".parse().unwrap();
    assert_eq!((free.name.as_str(), free.each), ("tank[1].mass[1]", true));
    assert_eq!((free.start, free.bounds), (2.0, Some((0.5, f64::INFINITY))));
    let setting: Setting = "init.omega[1]@2=0.1".parse().unwrap();
    assert_eq!((setting.name.as_str(), setting.recording), ("init.omega[1]", Some(1)));
    let triad: Triad = "w[1],w[2],w[3]=0.01:5e-3".parse().unwrap();
    assert_eq!((triad.outputs[2].as_str(), triad.angle), ("w[3]", 5e-3));
    assert_eq!(list("a,inertia[1,2], b").collect::<Vec<_>>(), ["a", "inertia[1,2]", "b"]);
    for wrong in ["k", "k=1:2", "k=3:4:5", "k=1:2:0", "k=x"] {
        assert!(wrong.parse::<Free>().is_err(), "{wrong}");
    }
    let size = |text: &str| text.parse::<Tolerance>().unwrap().size;
    assert_eq!(size("m=0.5%"), Size::Part(0.005));
    assert_eq!(size("scale(force[3])=0.003"), Size::Part(0.003));
    assert_eq!(size("tank.h=5mm"), Size::Absolute("5mm".into()));
    assert_eq!(size("x=±0.1"), Size::Absolute("0.1".into()));
    assert!("m=80%".parse::<Tolerance>().is_err() && "m".parse::<Tolerance>().is_err());
    assert_eq!((scaled("scale(w[1])"), scaled("w[1]")), (Some("w[1]"), None));
    assert!("k=1:0".parse::<Prior>().is_err() && "w=0".parse::<Bias>().is_err());
}

use bench::profile::{Profile, Torque};
use host::fmi2::Fmu;
use identify::{fit::*, simulate::Setup, twin, unknown::Unknown};
fn main() -> anyhow::Result<()> {
    let fmu = Fmu::open(pack::packed_for_tests())?;
    let torque = Torque::Profile("lin-sweep:amplitude=0.1".parse::<Profile>()?);
    let rec = twin::record(&fmu, &[("slosh.zeta_from_correlation","false"),("slosh.zeta","0.0029757")], &torque, Some(1), Default::default())?;
    let truth = [("tank.d",0.163),("tank.h",0.1),("slosh.zeta",0.0029757),("hub.I",0.322414),("friction.b",0.03793),("friction.c",0.003498),("friction.d",0.002423),("friction.omega_s",0.08581)];
    let setup = Setup { settings: vec![("slosh.zeta_from_correlation".into(),"false".into())], held: false };
    println!("{:?}", identify::start::from_data(&[rec.clone()], identify::start::Bench{arm:0.225,density:1000.,gravity:9.81})?);
    for (case, signs) in [(0,0u32),(1,0xff)] {
        let unknowns: Vec<_> = truth.iter().enumerate().map(|(i,(n,v))| Unknown::positive(n,"",v*(if case==0 {1.05} else if signs>>i&1==1 {1.4} else {0.6}))).chain([Unknown::gyro_bias(0)]).collect();
        let recs=[rec.clone()];
        let mut p = Problem::new(&fmu, setup.clone(), &recs, unknowns);
        let t=std::time::Instant::now();
        let e = if case==0 {p.fit_growing(&p.start(),&WHOLE,&mut |l| println!("{l}"))?} else {p.fit_growing(&p.start(), &WINDOWS, &mut |l| println!("{l}"))?};
        println!("{case} {:?} {} {} {:?}", t.elapsed(), e.reason, e.simulations, p.values(&e.x));
        let a=p.answer(&e.x)?;
        println!("chi2/N {}", p.innovations(&a).iter().flatten().map(|e|e*e).sum::<f64>()/135001.0);
        p.estimate_noise(&a);
        println!("{:?} {:?}", p.noise, t.elapsed()); let e=p.fit(&e.x)?; let a=p.answer(&e.x)?; println!("refit {} {:?}", e.simulations, t.elapsed());
        let j=p.jacobian(&e.x,&a,&vec![1e-5;9],Differences::Central)?;
        let j=p.jacobian(&e.x,&a,&Problem::steps(&j),Differences::Central)?;
        let c=(j.transpose()*&j).try_inverse().unwrap();
        for (i,(n,v)) in truth.iter().enumerate() { println!("{n} err {:.4}% std {:.4}%", 100.0*(p.values(&e.x)[i]/v-1.0), 100.0*c[(i,i)].sqrt()); }
    }
    Ok(())
}

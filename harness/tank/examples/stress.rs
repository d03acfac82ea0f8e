//! stress
use hubslosh_tank::tank::Tank;
use std::path::Path;
fn run(name: &str, text: &str, fills: &[f64], modes: usize) {
    let tank = match Tank::parse(&format!("density = 1000.0\n{text}"), Path::new("/tmp")) {
        Ok(t) => t,
        Err(e) => {
            println!("{name}: {e}");
            return;
        }
    };
    for &fill in fills {
        let t = std::time::Instant::now();
        match tank.solve(fill, modes) {
            Ok(d) => {
                let ms = t.elapsed().as_secs_f64() * 1e3;
                let rest_ok = (0..=modes).map(|k| d.rest(k)).all(|r| {
                    r.m_0 > 0.0 && r.inertia > -1e-9 * d.m_liq * d.r_surface.unwrap_or(1.0).powi(2)
                });
                println!(
                    "{name:12} {fill:7} {ms:6.1}ms err {:.0e} beta {:.0e} l1 {:.9} l3 {:.9} m1 {:.9} hinge {:?} I_eff {:.3e} {}",
                    d.error,
                    d.error_beta,
                    d.modes[0].lambda,
                    d.modes[2].lambda,
                    d.modes[0].m_ratio,
                    d.modes[0].hinge,
                    d.i_eff_cg,
                    if rest_ok { "" } else { "REST" }
                );
            }
            Err(e) => println!("{name:12} {fill:7} {e}"),
        }
    }
}
fn main() {
    run(
        "sphere",
        "shape={sphere={radius=1.0}}",
        &[0.001, 0.01, 0.05, 0.5, 1.0, 1.5, 1.95, 1.99, 1.999, 1.9999, 2.0],
        5,
    );
    run("sphere20", "shape={sphere={radius=1.0}}", &[0.05, 1.0, 1.9], 20);
    run(
        "torus",
        "shape={torus={ring_radius=1.0,tube_radius=0.4}}",
        &[0.01, 0.1, 0.4, 0.7, 0.79],
        5,
    );
    run(
        "thin annulus",
        "profile=[{line=[0.98,1,0.98,0]},{line=[0.98,0,1,0]},{line=[1,0,1,1]}]",
        &[0.01, 0.1, 0.9],
        5,
    );
    run(
        "column",
        "profile=[{line=[0.01,1,0.01,0]},{line=[0.01,0,1,0]},{line=[1,0,1,1]}]",
        &[0.1, 0.9],
        5,
    );
    run("pancake", "profile=[{line=[0,0,1,0]},{line=[1,0,1,1]}]", &[0.001, 0.01, 0.1], 5);
    run("deep", "profile=[{line=[0,0,1,0]},{line=[1,0,1,40]}]", &[10.0, 40.0], 5);
    run(
        "domed",
        "shape={domed_cylinder={radius=1.0,height=1.0,bottom=-0.4,top=0.5}}",
        &[0.2, 0.39, 0.4, 0.41, 0.7, 1.0, 1.3],
        5,
    );
    run(
        "toris",
        "shape={torispherical={radius=1.0,height=1.0,crown_radius=2.0,knuckle_radius=0.2}}",
        &[0.1, 0.3, 1.0, 1.5, 1.7],
        5,
    );
    run(
        "bottle",
        "profile=[{line=[0,0,1,0]},{line=[1,0,1,1]},{line=[1,1,0.1,1.2]},{line=[0.1,1.2,0.1,2]}]",
        &[0.9, 1.1, 1.19, 1.5],
        5,
    );
    run(
        "pear",
        "profile=[{arc=[0,1,1,-90,0]},{cosine=[0.75,0.25,1,3,0,1]}]",
        &[0.9, 1.5, 2.5, 2.9],
        5,
    );
    for n in [25, 50, 100, 200] {
        let mut s = String::new();
        for i in 0..=n {
            let a = std::f64::consts::PI * (i as f64 / n as f64 - 0.5);
            s += &format!(
                "{},{}\n",
                a.cos().abs().max(1e-300) * if i == 0 || i == n { 0.0 } else { 1.0 },
                1.0 + a.sin()
            );
        }
        std::fs::write(format!("/tmp/sphere{n}.csv"), s).unwrap();
        run(&format!("poly{n}"), &format!("points=\"sphere{n}.csv\""), &[1.0, 1.333], 5);
        run(
            &format!("spline{n}"),
            &format!("points=\"sphere{n}.csv\"\nspline=true"),
            &[1.0, 1.333],
            5,
        );
    }
}

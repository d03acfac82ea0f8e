//! probe
use hubslosh_tank::curve::*;
use serde_json::Value;
fn main() {
    let d: Value = serde_json::from_str(include_str!("../tests/tanks.json")).unwrap();
    for c in d["cases"].as_array().unwrap() {
        if c["kind"] != "revolution" { continue; }
        let segs: Vec<Segment> = c["profile"].as_array().unwrap().iter().map(|s| {
            let (k, v) = s.as_object().unwrap().iter().next().unwrap();
            let v: Vec<f64> = v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
            match k.as_str() {
                "line" => Segment::line([v[0], v[1]], [v[2], v[3]]),
                "arc" => Segment::arc([v[0], v[1]], v[2], v[3], v[4]),
                "ellipse" => Segment::ellipse([v[0], v[1]], v[2], v[3], v[4], v[5]),
                "cassini" => Segment { curve: Curve::Cassini { zc: v[0], a: v[1], c: v[2] }, from: v[3].to_radians(), to: v[4].to_radians() },
                _ => panic!(),
            }
        }).collect();
        print!("{:17}", c["name"].as_str().unwrap());
        let t = std::time::Instant::now();
        let r = match hubslosh_tank::probe(segs, c["fill"].as_f64().unwrap(), c["rho"].as_f64().unwrap()) { Ok(r) => r, Err(e) => { println!("{e}"); continue; } };
        let ms = t.elapsed().as_secs_f64() * 1e3;
        let f = |v: &Value| v.as_f64().unwrap();
        let rad = f(&c["R_surface"]);
        let m = f(&c["m_liq"]);
        let geo = [(r.m_liq / m - 1.0).abs(), (r.z_cg - f(&c["z_cg"])).abs() / rad, (r.i_frozen_cg - f(&c["I_frozen_cg"])).abs() / m / rad / rad, (r.i_frozen_axis - f(&c["I_frozen_axis"])).abs() / m / rad / rad].into_iter().fold(0.0, f64::max);
        let mut e = [0.0f64; 6];
        let mut beta = 0.0f64;
        for (a, b) in r.modes.iter().zip(c["modes"].as_array().unwrap()) {
            e[0] = e[0].max((a.lambda / f(&b["lambda"]) - 1.0).abs());
            e[1] = e[1].max((a.m - f(&b["m"])).abs() / m);
            if let (Some(x), Some(y)) = (a.height, b["H"].as_f64()) { e[2] = e[2].max((x - y).abs() * a.m / m / rad); }
            e[3] = e[3].max((a.wave - f(&b["wave"])).abs() / rad);
            if let Some(y) = b.get("wave_inner") { e[3] = e[3].max((a.wave_inner.unwrap() - f(y)).abs() / rad); }
            if let Some(y) = b.get("wave_peak") { e[4] = e[4].max((a.wave_peak.unwrap() - f(y)).abs() / rad); }
            beta = beta.max((a.beta / f(&b["beta"]) - 1.0).abs());
        }
        let mut rest = (r.i_eff_cg - f(&c["I_eff_cg"])).abs() / m / rad / rad;
        for (a, b) in r.rest.iter().zip(c["rest"].as_array().unwrap()) {
            rest = rest.max((a.m_0 - f(&b["m_0"])).abs() / m);
            rest = rest.max((a.m_0 * a.height - f(&b["m_0"]) * f(&b["H_0"])).abs() / m / rad);
            rest = rest.max((a.inertia - f(&b["I_0"])).abs() / m / rad / rad);
        }
        let worst = e[0].max(e[1]).max(e[2]).max(e[3]).max(rest);
        println!("{ms:5.1}ms geo {geo:.0e} lam {:.0e} m {:.0e} mH {:.0e} wave {:.0e} peak {:.0e} rest {rest:.0e} | stated {:.0e} {} | beta {beta:.0e} stated {:.0e} {}", e[0], e[1], e[2], e[3], e[4], r.error, if worst > r.error { "LIE" } else { "ok" }, r.error_beta, if beta > r.error_beta + f(&c["error_beta"]) { "LIE" } else { "ok" });
    }
}

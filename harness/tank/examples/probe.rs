//! probe
use hubslosh_tank::curve::*;
use serde_json::Value;
fn main() {
    let orders: Vec<usize> = std::env::args().skip(1).map(|a| a.parse().unwrap()).collect();
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
        print!("{:18}", c["name"].as_str().unwrap());
        for &o in &orders {
            let t = std::time::Instant::now();
            let (n, l) = hubslosh_tank::probe(&segs, o);
            let ms = t.elapsed().as_secs_f64() * 1e3;
            let e: Vec<String> = c["modes"].as_array().unwrap().iter().zip(&l).map(|(m, l)| format!("{:.0e}", (l / m["lambda"].as_f64().unwrap() - 1.0).abs())).collect();
            print!(" | {n:4} {ms:5.1}ms {}", e.join(" "));
        }
        println!();
    }
}

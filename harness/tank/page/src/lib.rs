//! The tank solver for a page: text in, text out.
//!
//! A WebAssembly module has no strings, and a page's memory is separate. Text therefore passes byte by byte (UTF-8), in
//! a few thousand calls, which is little compared with a solution of millions of operations. A host writes the text of
//! a tank's file with [`put`], calls [`solve`], and reads the answer with [`get`]. The answer is JSON with `problems`,
//! or with `modal` (as written by `hubslosh tank --json`), `depth` and `surfaces`.

mod abi;

use std::path::Path;

use hubslosh_tank::curve::{Curve, Point};
use hubslosh_tank::tank::Geometry;
use hubslosh_tank::{Fill, ModalData, Problems, Tank};
use serde::Serialize;

/// Results for a tank, as the page receives them.
#[derive(Serialize)]
struct Answer {
    /// Modal parameters.
    modal: ModalData,
    /// Largest fill, m above the lowest point.
    depth: Option<f64>,
    /// The wall, (r, z) from the axis along the bottom and up, m above the contour's own zero; of a box nothing.
    outline: Vec<Point>,
    /// Elevation of each mode per angle along the surface: (r, m/rad), from the axis or inner wall outwards.
    surfaces: Vec<Vec<[f64; 2]>>,
}

#[derive(Serialize)]
struct Refused {
    problems: Vec<String>,
}

/// The answer to a tank's file, as JSON: `share` of its volume is liquid, 0 to 1.
pub fn answer(file: &str, share: f64, modes: usize) -> String {
    let text = match solved(file, share, modes) {
        Ok(answer) => serde_json::to_string(&answer),
        Err(Problems(problems)) => serde_json::to_string(&Refused { problems }),
    };
    text.unwrap_or_else(|error| format!("{{\"problems\":[\"{error}\"]}}"))
}

fn solved(file: &str, share: f64, modes: usize) -> Result<Answer, Problems> {
    let tank = Tank::parse(file, Path::new(""))?;
    let fill = tank.height_of(Fill::Share(share))?;
    let modal = tank.solve(fill, modes)?;
    let mut outline: Vec<Point> = Vec::new();
    if let Geometry::Revolution { contour, .. } = &tank.geometry {
        for segment in contour.segments() {
            let parts = if matches!(segment.curve, Curve::Line { .. }) { 1 } else { 24 };
            outline.extend((0..=parts).map(|i| segment.at(f64::from(i) / f64::from(parts))));
        }
        outline.dedup_by(|a, b| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9);
    }
    let surfaces = modal.modes.iter().map(|mode| mode.shape.clone()).collect();
    Ok(Answer { depth: tank.depth(), outline, surfaces, modal })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Through the module's own functions, as a page calls them.
    fn asked(file: &str, share: f64) -> serde_json::Value {
        file.bytes().for_each(|byte| abi::put(byte.into()));
        let length = abi::solve(share, 2);
        let text: Vec<u8> = (0..length).map(|place| abi::get(place) as u8).collect();
        serde_json::from_slice(&text).expect("JSON")
    }

    /// A half-full sphere: lambda_1 R = 1.56016 (Budiansky 1960; McIver 1989).
    #[test]
    fn a_half_full_sphere_has_its_known_frequency_twice_in_a_row() {
        for _ in 0..2 {
            let answer = asked("density = 1000\nshape.sphere = { radius = 0.5 }", 0.5);
            let found = answer["modal"]["modes"][0]["lambda_R"].as_f64().expect("a number");
            assert!((found - 1.56016).abs() < 1e-5, "{found}");
            let outline = answer["outline"].as_array().expect("points");
            let [first, last] = [&outline[0], &outline[outline.len() - 1]];
            for (point, z) in [(first, 0.0), (last, 1.0)] {
                assert!(point[0].as_f64().unwrap().abs() < 1e-12 && point[1] == z, "{point}");
            }
        }
    }

    #[test]
    fn what_is_wrong_is_said_all_at_once_and_the_next_tank_is_solved() {
        let refused = asked("density = -1\nshape.sphere = { radius = 0.0 }", 0.5);
        assert_eq!(refused["problems"].as_array().map(Vec::len), Some(2), "{refused}");
        assert!(asked("density = 1\nshape.sphere = { radius = 1.0 }", 0.3)["modal"].is_object());
    }
}

//! Builds the `geometry` of the scene (harness/web/scene/README.md): bodies, tanks and arrows.

use std::collections::BTreeMap;

use host::causality::Causality;
use names::hubslosh::{
    F_RADIAL, F_TANGENTIAL, TAU_ACTUATOR, TAU_CMD, TAU_EXT, TAU_FLUID, TAU_FRICTION,
};
use names::spacecraft;
use serde_json::{Map, Value, json};
use signals::table::Table;

use super::geometry::{self, Outline, Parameters, Tank};
use super::{Columns, Kind, vector};

const FULL_ARC: f64 = 2.4;

struct Arrows<'a, 'c, 't> {
    parameters: &'a Parameters<'a>,
    table: &'a Table,
    columns: &'c mut Columns<'t>,
    drawn: Vec<Value>,
    of: Map<String, Value>,
}

impl Arrows<'_, '_, '_> {
    /// Adds an arrow that shows the columns `names`, if the run contains them and they are not always 0. An
    /// input without a column keeps its start value.
    fn add(&mut self, name: &str, label: &str, mut arrow: Value, names: &[String]) {
        let constant = |name: &String| {
            let variable = self.parameters.description.variable(name).ok()?;
            (variable.causality == Causality::Input).then(|| self.parameters.number(name))
        };
        let there: Vec<String> = names.iter().filter(|n| self.columns.has(n)).cloned().collect();
        if there.is_empty() || names.iter().any(|n| !self.columns.has(n) && constant(n).is_none()) {
            return;
        }
        let at = |name: &String, k: usize| match self.table.column(name) {
            Some(values) => values[k],
            None => constant(name).unwrap_or(0.0),
        };
        let size = |k: usize| names.iter().map(|name| at(name, k).powi(2)).sum::<f64>().sqrt();
        let most = (0..self.table.rows()).map(size).fold(0.0, f64::max);
        if most > 0.0 {
            let source = |n: &String| if there.contains(n) { json!(n) } else { json!(constant(n)) };
            let all: Vec<Value> = names.iter().map(source).collect();
            (arrow["name"], arrow["label"], arrow["most"]) =
                (json!(name), json!(label), json!(most));
            self.drawn.push(arrow);
            self.of.insert(name.into(), if all.len() == 1 { all[0].clone() } else { json!(all) });
            self.columns.take(&there);
        }
    }

    /// Gives all arrows with the same unit the same scale, so that their lengths can be compared.
    fn share_scales(&mut self) {
        let mut most: BTreeMap<String, f64> = BTreeMap::new();
        for arrow in &self.drawn {
            let one = most.entry(arrow["unit"].to_string()).or_insert(0.0);
            *one = one.max(arrow["most"].as_f64().unwrap_or(0.0));
        }
        for arrow in &mut self.drawn {
            arrow["most"] = json!(most[&arrow["unit"].to_string()]);
        }
    }
}

pub fn scene(
    kind: Kind,
    parameters: &Parameters,
    tanks: &[Tank],
    table: &Table,
    columns: &mut Columns,
    notes: &mut Vec<String>,
) -> Value {
    let mut arrows = Arrows { parameters, table, columns, drawn: Vec::new(), of: Map::new() };
    let (mut geometry, reach) = match kind {
        Kind::Bench => bench(&tanks[0], &mut arrows),
        Kind::Craft => craft(tanks, &mut arrows, notes),
        Kind::Tank => host_tank_scene(&tanks[0], &mut arrows),
    };
    arrows.share_scales();
    geometry["reach"] = json!(reach);
    geometry["tanks"] = tanks.iter().map(tank_scene).collect();
    geometry["arrows"] = json!(arrows.drawn);
    json!({ "geometry": geometry, "arrows": arrows.of })
}

fn tank_scene(tank: &Tank) -> Value {
    let shape = match &tank.outline {
        Outline::Revolved(contour) => json!({ "contour": contour }),
        Outline::Box([a, b, bottom, top]) => json!({ "box": [a, b], "bottom": bottom, "top": top }),
    };
    let modes: Vec<Value> = tank
        .modes
        .iter()
        .enumerate()
        .map(|(n, m)| {
            let shape = tank.shapes.get(n);
            json!({ "hinge": m.hinge, "length": m.length, "wave": m.wave, "order": m.order, "mass": m.mass, "shape": shape })
        })
        .collect();
    json!({ "position": tank.position, "q": tank.q, "shape": shape, "level": tank.level, "modes": modes })
}

fn bench(tank: &Tank, arrows: &mut Arrows) -> (Value, f64) {
    let r = tank.position[0];
    let radius = match &tank.outline {
        Outline::Revolved(points) => points.iter().map(|p| p[0]).fold(0.0, f64::max),
        Outline::Box([a, b, ..]) => 0.5 * a.hypot(*b),
    };
    let reach = r + 1.25 * radius;
    let wheel = 0.0625_f64.min(0.4 * reach);
    let below = r < radius + 1.1 * wheel;
    let actuator = match arrows.columns.has(TAU_ACTUATOR) {
        true => (TAU_ACTUATOR, "actuator torque"),
        false => (TAU_CMD, "torque command"),
    };
    let torques = [
        actuator,
        (TAU_EXT, "external torque"),
        (TAU_FRICTION, "friction torque"),
        (TAU_FLUID, "liquid torque"),
    ];
    let [inner, outer] =
        if below { [1.1 * radius, 1.4 * radius] } else { [1.25 * wheel, 0.42 * reach] };
    for (i, (name, label)) in torques.into_iter().enumerate() {
        let arc = json!({
            "radius": inner + (outer - inner) * (i as f64 + 0.5) / 4.0, "z": 0.03 * reach,
            "from": std::f64::consts::PI, "most": FULL_ARC,
        });
        let torque = json!({ "kind": "torque", "unit": "N·m", "arc": arc });
        arrows.add(name, label, torque, &[name.into()]);
    }
    let force = json!({
        "kind": "force", "unit": "N", "length": 0.7 * reach,
        "at": [r, 0.0, tank.position[2] + tank.level],
    });
    let names = [F_RADIAL, F_TANGENTIAL].map(String::from);
    arrows.add("force", "liquid force on the tank", force, &names);
    let geometry = json!({
        "bench": {
            "wheel": wheel, "below": below,
            "arm": { "length": r, "width": 1.2 * radius, "plate": 1.12 * radius },
        },
        "target": [0.3 * r, 0.0, -0.07 * reach], "from": [0.55, -1.25, 0.75], "radius": 0.87 * reach,
        "axes": {
            "length": 0.2 * reach, "names": ["radial", "tangential", "z"],
            "at": if below { [0.0, 0.0, 0.0] } else { [0.0, 0.0, 0.5 * wheel] },
        },
    });
    (geometry, reach)
}

fn craft(tanks: &[Tank], arrows: &mut Arrows, notes: &mut Vec<String>) -> (Value, f64) {
    let length = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let at = |tank: &Tank| length(&tank.position) + tank.extent();
    let mut reach = tanks.iter().map(at).fold(0.0, f64::max);
    let size = geometry::craft_box(arrows.parameters);
    let center = [1, 2, 3].map(|i| arrows.parameters.number(&spacecraft::craft::R.element([i])));
    if let Some(size) = size {
        reach = reach.max(0.5 * length(&size) + length(&center));
        notes.push(
            "The craft is drawn as the box with the dry craft's mass and moments of inertia, its middle at the dry craft's centre \
             of mass."
                .into(),
        );
    } else {
        notes.push(
            "No box has the dry craft's moments of inertia: the craft itself is not drawn.".into(),
        );
    }
    let long = 0.8 * reach;
    let force = |at: [f64; 3], tip: bool| json!({ "kind": "force", "unit": "N", "length": long, "at": at, "tip": tip });
    let torque = json!({ "kind": "torque", "unit": "N·m", "length": long });
    arrows.add("force", "force at O", force([0.0; 3], true), &vector("force"));
    arrows.add("torque", "torque about O", torque.clone(), &vector("torque"));
    let own = |tank: &Tank| vector(&format!("{}.force", tank.prefix));
    if tanks.len() > 1 && tanks.iter().flat_map(own).all(|name| arrows.columns.has(&name)) {
        for tank in tanks {
            let name = format!("{}.force", tank.prefix);
            let label = format!("liquid force, {}", tank.prefix);
            arrows.add(&name, &label, force(tank.position, false), &own(tank));
        }
    } else {
        let slosh = force([0.0; 3], false);
        arrows.add("slosh_force", "liquid force at O", slosh, &vector("slosh_force"));
    }
    arrows.add("slosh_torque", "liquid torque about O", torque, &vector("slosh_torque"));
    let geometry = json!({
        "body": { "size": size, "center": center },
        "from": [1.0, -1.25, 0.55], "axes": { "length": 0.85 * reach },
    });
    (geometry, reach)
}

/// Returns the 3-D scene of SloshTank: the tank, the reference point O of the craft, and arrows at O. The scene is
/// centred on the middle of the tank. Also returns the radius of a sphere that contains the scene, m.
fn host_tank_scene(tank: &Tank, arrows: &mut Arrows) -> (Value, f64) {
    let [middle, half] = tank.middle_and_extent();
    let [x, y, z] = tank.position;
    let off = x.hypot(y).hypot(z + middle);
    let reach = half.max(off);
    let long = 0.6 * reach;
    for (name, label, kind, unit) in [
        ("force", "liquid force on the host at O", "force", "N"),
        ("torque", "liquid torque about O", "torque", "N·m"),
        ("a", "specific force at O", "acceleration", "m/s²"),
    ] {
        let arrow = json!({ "kind": kind, "unit": unit, "length": long });
        arrows.add(name, label, arrow, &vector(name));
    }
    let geometry = json!({
        "from": [1.0, -1.25, 0.55], "axes": { "length": 0.5 * reach },
        "radius": f64::max(1.1 * half, off + 1.1 * long), "target": [x, y, z + middle],
    });
    (geometry, reach)
}

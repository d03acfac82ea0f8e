//! Two unknowns of which the recordings determine only a sum or a product.

use analysis::statistics::{deviation, mean};
use names::hubslosh::friction;

use crate::engine::draws::Derived;
use crate::engine::{PAIR, VAGUE};
use crate::estimate::Combination;

/// Standard deviation above which an asymmetry of the friction counts as not determined.
pub const ONE_WAY: f64 = 0.25;
/// If the angle that the hub turns against its main direction is more than this fraction of the angle in the main direction, the
/// hub counts as turning both ways.
const BOTH_WAYS: f64 = 0.05;

/// Returns the direction of a hub that turns only one way, from its rates: 1 counter-clockwise, −1 clockwise. Returns `None` for
/// a hub at rest, or if more than [`BOTH_WAYS`] of its path leads the other way.
pub fn way(rates: impl Iterator<Item = f64>) -> Option<f64> {
    let (mut forwards, mut backwards) = (0.0, 0.0);
    rates.for_each(|rate| *if rate < 0.0 { &mut backwards } else { &mut forwards } += rate.abs());
    let (way, along, against) =
        if backwards > forwards { (-1.0, backwards, forwards) } else { (1.0, forwards, backwards) };
    (along > 0.0 && against <= BOTH_WAYS * along).then_some(way)
}

/// Returns combinations of two unknowns that the draws determine better than either of the two. If the hub turns only one `way`,
/// these are c (1 ± asymmetry) and d (1 ± asymmetry) of the dry friction; otherwise c + d.
pub fn combinations(draws: &Derived, way: Option<f64>) -> Vec<Combination> {
    let place = |name: &str| draws.place(name);
    let mut found = Vec::new();
    let mut add = |i: usize, j: usize, name: String, values: Vec<f64>| {
        let [a, b] = [&draws.columns[i], &draws.columns[j]];
        found.push(Combination {
            name,
            of: [draws.names[i].clone(), draws.names[j].clone()],
            value: mean(&values),
            std: deviation(&values),
            unit: draws.units[i].clone(),
            correlation: analysis::statistics::correlation(a, b),
        });
    };
    let is_vague = |i: usize| draws.std(i) > VAGUE * draws.values[i].abs();
    let asymmetry = place(friction::ASYMMETRY).filter(|a| draws.std(*a) > ONE_WAY);
    if let (Some(way), Some(a)) = (way, asymmetry) {
        let sign = if way > 0.0 { '+' } else { '-' };
        for i in [friction::C, friction::D].iter().filter_map(|name| place(name)) {
            let pairs = draws.columns[i].iter().zip(&draws.columns[a]);
            let values = pairs.map(|(c, a)| c * (1.0 + way * a)).collect();
            add(i, a, format!("{} (1 {sign} {})", draws.names[i], friction::ASYMMETRY), values);
        }
    } else if let (Some(c), Some(d)) = (place(friction::C), place(friction::D)) {
        let [a, b] = [&draws.columns[c], &draws.columns[d]];
        let correlation = analysis::statistics::correlation(a, b);
        if correlation < -PAIR && is_vague(c) && is_vague(d) {
            let values = a.iter().zip(b).map(|(c, d)| c + d).collect();
            add(c, d, format!("{} + {}", friction::C, friction::D), values);
        }
    }
    found
}

//! Tanks.
pub mod curve;
mod gauss;
mod panel;
mod potential_flow;
mod ring;
/// probe
pub fn probe(wall: &[curve::Segment], order: usize) -> (usize, Vec<f64>) {
    let d = potential_flow::Discretisation::new(wall, order);
    (d.len(), d.solve(5, 0.0).lambda)
}

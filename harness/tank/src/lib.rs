//! Tanks.
pub mod contour;
pub mod curve;
mod gauss;
pub mod modal;
mod panel;
mod potential_flow;
mod ring;
/// probe
pub fn probe(wall: Vec<curve::Segment>, fill: f64, rho: f64) -> Result<modal::ModalData, contour::Problems> {
    modal::solve(&contour::Contour::new(wall)?, rho, fill, 5)
}

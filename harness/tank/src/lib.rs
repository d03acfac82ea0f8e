//! Tanks.
pub mod closed_form;
pub mod contour;
pub mod curve;
mod gauss;
pub mod modal;
mod panel;
mod potential_flow;
mod ring;
mod spline;
pub mod tank;
/// probe
pub fn probe(wall: Vec<curve::Segment>, fill: f64, rho: f64) -> Result<modal::ModalData, contour::Problems> {
    Ok(modal::solve(contour::Contour::new(wall)?.cut(fill)?, rho, fill, 5))
}

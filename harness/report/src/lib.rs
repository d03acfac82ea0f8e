//! What people look at: the page about a campaign ([`campaign::page`]), charts in SVG.

pub mod campaign;
pub mod gyro;
pub mod svg;

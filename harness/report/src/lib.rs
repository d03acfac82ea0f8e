//! HTML pages about a campaign ([`campaign::page`]) or one run ([`view::page`]), and charts in SVG.

pub mod campaign;
pub mod gyro;
pub mod page;
pub mod svg;
pub mod view;

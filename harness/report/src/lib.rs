//! Pages and charts: the page about a campaign ([`campaign::page`]), about one run ([`view::page`]), charts in SVG.

pub mod campaign;
pub mod gyro;
pub mod page;
pub mod svg;
pub mod view;

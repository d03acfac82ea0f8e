//! The FMU's icon as pixels, drawn from `modelDescription/icon/icon.svg`. Importers want a PNG;
//! only few draw an SVG.

use resvg::{tiny_skia, usvg};

/// The drawing.
pub const SOURCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/icon/icon.svg");
/// Where the committed picture is; each FMU has it as `model.png`.
pub const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/icon/icon.png");
/// Width and height, px.
pub const SIZE: u32 = 512;

/// The picture, drawn from the SVG's text.
pub fn draw(svg: &str) -> Result<tiny_skia::Pixmap, usvg::Error> {
    let tree = usvg::Tree::from_str(svg, &usvg::Options::default())?;
    let mut picture = tiny_skia::Pixmap::new(SIZE, SIZE).ok_or(usvg::Error::InvalidSize)?;
    let (x, y) = (SIZE as f32 / tree.size().width(), SIZE as f32 / tree.size().height());
    resvg::render(&tree, tiny_skia::Transform::from_scale(x, y), &mut picture.as_mut());
    Ok(picture)
}

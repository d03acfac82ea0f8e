//! Draws the FMU's icon from `modelDescription/icon/icon.svg`, because FMI importers expect a PNG and few
//! can display an SVG.
//!
//! `icon/SHA256SUMS` contains the hash of the drawing from which the committed picture was made. The feature `icon` is
//! needed to draw, because its library takes longer to compile than everything else.

use sha2::{Digest, Sha256};

/// Folder with the drawing of the FMUs' icon (`icon.svg`), the picture (`icon.png`, which becomes
/// `model.png` of each FMU) and their hashes.
pub const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/icon");
pub const SIZE: u32 = 512;

#[cfg(feature = "icon")]
pub fn draw(svg: &str) -> Result<resvg::tiny_skia::Pixmap, resvg::usvg::Error> {
    use resvg::{tiny_skia, usvg};
    let tree = usvg::Tree::from_str(svg, &usvg::Options::default())?;
    let mut picture = tiny_skia::Pixmap::new(SIZE, SIZE).ok_or(usvg::Error::InvalidSize)?;
    let (x, y) = (SIZE as f32 / tree.size().width(), SIZE as f32 / tree.size().height());
    resvg::render(&tree, tiny_skia::Transform::from_scale(x, y), &mut picture.as_mut());
    Ok(picture)
}

pub fn hashes() -> std::io::Result<String> {
    let mut lines = String::new();
    for name in ["icon.svg", "icon.png"] {
        let hash = Sha256::digest(std::fs::read(format!("{FOLDER}/{name}"))?);
        lines += &format!("{}  {name}\n", base16ct::lower::encode_string(&hash));
    }
    Ok(lines)
}

#[cfg(all(test, feature = "icon"))]
mod tests {
    use super::*;

    #[test]
    fn the_committed_icon_equals_the_drawn_icon() {
        let shown = std::fs::read(format!("{FOLDER}/icon.png")).unwrap();
        let shown = resvg::tiny_skia::Pixmap::decode_png(&shown).unwrap();
        let drawn = draw(&std::fs::read_to_string(format!("{FOLDER}/icon.svg")).unwrap()).unwrap();
        // Other processors may round differently, which changes the shades at edges by one or two steps.
        let pixels = shown.data().iter().zip(drawn.data());
        assert_eq!(pixels.filter(|(a, b)| a.abs_diff(**b) > 2).count(), 0);
    }
}

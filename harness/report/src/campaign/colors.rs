/// Palette of Okabe and Ito, which is safe for colour-blind readers, without black and yellow.
const CATEGORIES: [&str; 8] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#8c6bb1", "#7f7f7f"];

/// Colour map "viridis", whose lightness increases steadily and which is safe for colour-blind readers. Its
/// ends are left out, because they are invisible on black and on white.
const VIRIDIS: [[f64; 3]; 8] = [
    [72.0, 40.0, 120.0],
    [62.0, 73.0, 137.0],
    [49.0, 104.0, 142.0],
    [38.0, 130.0, 142.0],
    [31.0, 158.0, 137.0],
    [53.0, 183.0, 121.0],
    [110.0, 206.0, 88.0],
    [170.0, 205.0, 40.0],
];

pub(super) fn category(i: usize) -> &'static str {
    CATEGORIES[i % CATEGORIES.len()]
}

pub(super) fn symbol(i: usize) -> &'static str {
    ["circle", "square", "diamond", "cross"][i / CATEGORIES.len() % 4]
}

pub(super) fn line(i: usize) -> (&'static str, &'static str) {
    const LINES: [(&str, &str); 5] = [
        ("solid", "solid"),
        ("dash", "dashed"),
        ("dashdot", "dash-dotted"),
        ("longdash", "long dashes"),
        ("longdashdot", "long dashes and dots"),
    ];
    LINES[i % LINES.len()]
}

pub(super) fn dash(i: usize) -> &'static str {
    ["solid", "dash", "dot", "dashdot", "longdash", "longdashdot"][i / CATEGORIES.len() % 6]
}

pub(super) fn ordered(i: usize, count: usize) -> String {
    let place = if count > 1 { i as f64 / (count - 1) as f64 } else { 0.3 } * 7.0;
    let (low, mix) = ((place as usize).min(6), place - (place as usize).min(6) as f64);
    let [r, g, b] = [0, 1, 2].map(|c| VIRIDIS[low][c] * (1.0 - mix) + VIRIDIS[low + 1][c] * mix);
    format!("rgb({r:.0},{g:.0},{b:.0})")
}

/// Placeholder for the colour of reference curves: dark in the light scheme of the page, and light
/// in the dark scheme.
pub(super) const INK: &str = "@ink";

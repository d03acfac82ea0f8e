//! Draws the figure of HubSlosh's documentation that shows how the frequency depends on the amplitude.

use core::fmt::Write as _;

use hubslosh_tank::picture::{COLOURS, FAINT, Frame, page, text};
use hubslosh_tank::third_order::Overlaps;

/// Draws the amplitude dependence of the first frequency of an upright cylinder over the depth as
/// SVG: shifts of omega^2 per squared slosh angle in planar and in circular motion, for the liquid
/// and for a pendulum. The third order has poles at the secondary resonances. Points mark the fills
/// of the bench, 5 and 10 cm.
pub fn draw(overlaps: &Overlaps) -> String {
    let frame =
        Frame { left: 80.0, top: 96.0, width: 620.0, height: 360.0, x: [0.1, 2.0], y: [-1.0, 1.0] };
    let mut svg = String::new();
    frame.axes(&mut svg, "h/R", Some("shift of ω² per squared slosh angle"));
    frame.curve(&mut svg, &[[frame.x[0], 0.0], [frame.x[1], 0.0]], &format!("stroke=\"{FAINT}\""));
    let resonances = resonances(overlaps);
    for &(depth, [azimuth, number]) in &resonances {
        let dashed = format!("stroke=\"{FAINT}\" stroke-dasharray=\"5 4\"");
        frame.curve(&mut svg, &[[depth, frame.y[0]], [depth, frame.y[1]]], &dashed);
        let (x, y) = frame.place(depth, frame.y[1]);
        text(&mut svg, x, y - 6.0, "middle", &format!("({azimuth},{number})"));
    }
    // intervals between the poles, with points that get denser towards them
    let mut ends = vec![frame.x[0]];
    ends.extend(
        resonances.iter().map(|(depth, _)| *depth).filter(|d| (frame.x[0]..frame.x[1]).contains(d)),
    );
    ends.push(frame.x[1]);
    let depth = |ends: &[f64], i: i32| {
        let part = 0.5 - 0.5 * (core::f64::consts::PI * f64::from(i) / 300.0).cos();
        ends[0] + (ends[1] - ends[0]) * part
    };
    for (kind, name) in ["planar", "circular"].into_iter().enumerate() {
        let colour = COLOURS[kind];
        let style = format!("stroke=\"{colour}\" stroke-width=\"2\"");
        for ends in ends.windows(2) {
            let points: Vec<[f64; 2]> = (1..300)
                .map(|i| depth(ends, i))
                .map(|depth| [depth, overlaps.shifts(depth)[kind]])
                .collect();
            for piece in points.split(|p| p[1] < frame.y[0] || p[1] > frame.y[1]) {
                if piece.len() > 1 {
                    frame.curve(&mut svg, piece, &style);
                }
            }
        }
        let pendulum = [-0.125, 0.5][kind];
        frame.curve(
            &mut svg,
            &[[frame.x[0], pendulum], [frame.x[1], pendulum]],
            &format!("stroke=\"{colour}\" stroke-dasharray=\"1 4\" stroke-width=\"1.6\""),
        );
        for fill in [0.05, 0.10] {
            let depth = fill / 0.0815;
            let (x, y) = frame.place(depth, overlaps.shifts(depth)[kind]);
            let _ =
                writeln!(svg, "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"4\" fill=\"{colour}\"/>");
        }
        let x = frame.left + 260.0 * kind as f64;
        let _ = writeln!(svg, "<path d=\"M{x} 50h24\" stroke=\"{colour}\" stroke-width=\"2\"/>");
        text(&mut svg, x + 30.0, 54.0, "start", &format!("{name}; dotted: of a pendulum"));
    }
    let title = "First mode of an upright cylinder: frequency and amplitude, third order";
    text(&mut svg, frame.left, 26.0, "start", title);
    page(720.0, frame.top + frame.height + 50.0, title, &svg)
}

/// Returns the depths, m, at which an excited mode has twice the frequency of the first mode, in
/// ascending order, each with the excited mode. Near these depths the third order is not valid.
pub fn resonances(overlaps: &Overlaps) -> Vec<(f64, [usize; 2])> {
    let mut found = Vec::new();
    for mode in &overlaps.excited {
        let detuning = |depth: f64| {
            4.0 * overlaps.k * (overlaps.k * depth).tanh()
                - mode.kappa * (mode.kappa * depth).tanh()
        };
        let grid: Vec<f64> = (1..400).map(|i| f64::from(i) * 0.02 / overlaps.k).collect();
        for pair in grid.windows(2) {
            let [mut low, mut high] = [pair[0], pair[1]];
            if detuning(low) * detuning(high) < 0.0 {
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    let left = detuning(low) * detuning(middle) <= 0.0;
                    (low, high) = if left { (low, middle) } else { (middle, high) };
                }
                found.push((low, mode.mode));
            }
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found
}

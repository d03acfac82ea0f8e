use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::svg::{self, Axis, Chart, Series, Style};

const STYLE: &str = "
:root{color-scheme:light dark;--ink:#1c1c1e;--paper:#fff;--soft:#6b6b70;--rule:#d8d8dc;--a:#0b62c4;--b:#c2410c;--c:#15803d;--d:#7e22ce;--warn:#fde8d7}
@media(prefers-color-scheme:dark){:root{--ink:#e8e8ea;--paper:#16171a;--soft:#a0a0a8;--rule:#3a3b40;--a:#6cb1ff;--b:#ff9a5c;--c:#5fd38d;--d:#c79bff;--warn:#4a2a12}}
body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--paper);max-width:62rem;margin:2rem auto;padding:0 1rem}
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-variant-numeric:tabular-nums}
th,td{padding:.2rem .5rem;border-bottom:1px solid var(--rule);text-align:right;white-space:nowrap}
table{font-size:.88rem}th{white-space:normal;vertical-align:bottom}.numbered th,.numbered td{padding:.2rem .35rem}
th:first-child,td:first-child{text-align:left}
th{color:var(--soft);font-weight:500}.doubt{background:var(--warn);padding:.5rem .8rem;border-radius:4px}
svg{width:100%;min-width:40rem;height:auto;display:block;margin:.6rem 0}
svg text{fill:var(--ink);font:12px system-ui,sans-serif}svg .tick,svg .label{fill:var(--soft);font-size:11px}
svg .title{font-weight:600}svg .grid{stroke:var(--rule);stroke-width:.6;fill:none}svg .frame{stroke:var(--soft);fill:none}svg .curve path{fill:none;stroke-width:1.4}
details{margin:.6rem 0}summary{cursor:pointer}
";

pub fn document(title: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width,initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { (title) }
                (body)
            }
        }
    };
    page.into_string()
}

/// Embeds a chart that scrolls on a narrow screen, because its labels could not be read if it were made
/// smaller.
pub fn render_chart(chart: &Chart) -> Markup {
    html! { div class="scroll" { (PreEscaped(chart.svg())) } }
}

pub fn table<'a>(
    head: impl IntoIterator<Item = &'a str>,
    rows: impl IntoIterator<Item = Vec<String>>,
) -> Markup {
    html! {
        div class="scroll" {
            table {
                tr { @for cell in head { th { (cell) } } }
                @for row in rows { tr { @for cell in row { td { (cell) } } } }
            }
        }
    }
}

pub fn axis_chart(title: &str, x: &str, y: &str, series: Vec<Series>, logarithmic: bool) -> Chart {
    let points = || series.iter().flat_map(|s| &s.points);
    let x = Axis::linear(x, points().map(|p| p.0), 0.0, 8);
    let y = match logarithmic {
        true => Axis::decades(y, points().map(|p| p.1)),
        false => Axis::linear(y, points().map(|p| p.1), 0.0, 5),
    };
    Chart { size: (900.0, 260.0), ..Chart::new(title, x, y, series) }
}

/// Creates a curve in one of the colours of [`STYLE`], for example `a`.
pub fn series(points: Vec<(f64, f64)>, color: &str, style: Style, title: &str) -> Series {
    svg::series(points, &format!("var(--{color})"), style, title)
}

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::svg::{self, Axis, Chart, Series, Style};

pub fn document(title: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width,initial-scale=1";
                title { (title) }
                style { (PreEscaped(include_str!("page.css"))) }
            }
            body {
                h1 { (title) }
                (body)
            }
        }
    };
    page.into_string()
}

/// Embeds a chart that scrolls on a narrow screen, because its labels would be too small to read if
/// it were scaled down.
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

pub fn series(points: Vec<(f64, f64)>, color: &str, style: Style, title: &str) -> Series {
    svg::series(points, &format!("var(--{color})"), style, title)
}

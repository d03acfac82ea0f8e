use maud::{Markup, html};
use serde_json::json;

use super::colors;
use super::figure::{Figure, Figures, Panel, dots, line};
use crate::svg::{Chart, Style};

#[derive(Clone, Debug, Default)]
pub struct Chapter {
    pub title: String,
    pub text: Vec<String>,
    pub table: Vec<Vec<String>>,
    pub illustrations: Vec<Illustration>,
}

/// A figure in a chapter of the report: the chart, whose colours are replaced by the colours of the page, a
/// caption that states what the figure shows, and the numbers of the corresponding figures about the bench
/// in Rubaga's thesis. `equal` is true if both axes have the same scale.
#[derive(Clone, Debug)]
pub struct Illustration {
    pub chart: Chart,
    pub caption: String,
    pub thesis: &'static str,
    pub equal: bool,
}

impl Chapter {
    pub(super) fn section(self, figures: &mut Figures) -> (String, Markup) {
        let mut rows = self.table.iter();
        let content = html! {
            @for paragraph in &self.text { p { (paragraph) } }
            @if let Some(head) = rows.next() {
                div .wide {
                    table {
                        thead { tr { @for cell in head { th { (cell) } } } }
                        tbody { @for row in rows { tr { @for cell in row { td { (cell) } } } } }
                    }
                }
            }
            @for illustration in self.illustrations { (figures.add(illustration.into())) }
        };
        (self.title, content)
    }
}

impl From<Illustration> for Figure {
    fn from(illustration: Illustration) -> Figure {
        let Illustration { chart, caption, thesis, equal } = illustration;
        let traces = chart.series.iter().enumerate().map(|(i, series)| {
            let (name, color) = (series.title.as_str(), colors::category(i));
            match series.style {
                Style::Line => line(0, name, color, "solid", &series.points),
                Style::Dashed => line(0, name, colors::INK, "dash", &series.points),
                Style::Dots | Style::OpenDots | Style::Cloud => {
                    let points: Vec<_> =
                        series.points.iter().map(|(x, y)| (*x, *y, None)).collect();
                    let mut trace = dots(0, name, color, "circle", &points);
                    if series.style == Style::Cloud {
                        trace["mode"] = json!("markers");
                        trace["marker"]["size"] = json!(4);
                    }
                    trace
                }
            }
        });
        Figure {
            title: chart.title.clone(),
            caption: html! { (caption) },
            thesis,
            height: if equal { 480 } else { 330 },
            half: true,
            panels: vec![Panel {
                log_x: chart.x.logarithmic,
                log_y: chart.y.logarithmic,
                equal,
                ..Panel::new(&chart.x.label, &chart.y.label)
            }],
            traces: traces.collect(),
            ..Figure::default()
        }
    }
}

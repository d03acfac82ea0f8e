//! Third-order coefficients over the fill of a tank that drains: columns for the FMUs' fill tables.
//!
//! At some fills s and kappa are not known: near poles, in a nearly full tank, and in shallow liquid. However, the FMU
//! needs a value at every point of the table. At a fill between two known fills the table has the value that the FMU would
//! interpolate between them; at other fills it has the nearest known value.

use crate::coefficients::Coefficients;
use crate::interpolation::Monotone;
use crate::modal::ModalData;
use crate::parameters::ParameterSet;
use crate::table::{format_length, significant};

/// Largest interpolation error between two points of a fill table that is accepted without a
/// warning: of s relative to 1 + |s|, and of kappa relative to 1 + |kappa|.
const LARGEST: f64 = 0.05;

/// Parameters `set` of the tank at the fill `fill`, m above the lowest point, and the mass `liquid`
/// of the liquid there, kg.
pub(crate) struct AtFill<'a> {
    pub fill: f64,
    pub liquid: f64,
    pub set: &'a ParameterSet,
}

impl<'a> AtFill<'a> {
    pub fn from_rows(rows: &[ModalData], sets: &'a [ParameterSet]) -> Vec<AtFill<'a>> {
        let at_fill = |(row, set): (&ModalData, &'a ParameterSet)| {
            let (fill, liquid) = (row.fill, row.m_liq);
            AtFill { fill, liquid, set }
        };
        rows.iter().zip(sets).map(at_fill).collect()
    }

    fn coefficients(&self, n: usize) -> Option<Coefficients> {
        self.set.third_order.iter().find(|(mode, _)| *mode == n).map(|(_, known)| *known)
    }

    fn reason(&self) -> &str {
        let mut reasons = self.set.notes.iter().rev().filter_map(|note| note.strip_prefix(PREFIX));
        let reason = reasons.next().unwrap_or("no formula is known for this mode");
        reason.split(", so they are left out").next().unwrap_or(reason)
    }
}

pub(crate) const PREFIX: &str = "finite amplitude: ";

pub(crate) struct Columns {
    pub values: [Vec<f64>; 2],
    pub notes: Vec<String>,
    pub warnings: Vec<String>,
}

fn coefficients(known: &Coefficients) -> [f64; 2] {
    [known.nonlinear_inertia, known.nonlinear_stiffness]
}

fn fills(rows: &[&AtFill]) -> String {
    let all: Vec<String> = rows.iter().map(|at| format_length(at.fill)).collect();
    all.join(", ")
}

#[derive(Debug, thiserror::Error)]
#[error(
    "{PREFIX}s and kappa of mode {mode} are known only at {known} of {fills} fills. Therefore the table has no values for them, and the FMU models the mode as a pendulum: {why}"
)]
pub(crate) struct TooFewFills {
    mode: usize,
    known: usize,
    fills: usize,
    why: String,
}

/// Returns the columns of s and kappa of mode `n`, counted from 1, for a table with the ascending
/// fills `points`. The interpolation error of the table is measured at the fills `between`. The
/// result is an error if the coefficients are known at fewer than two fills.
pub(crate) fn columns(
    n: usize,
    points: &[AtFill],
    between: &[AtFill],
) -> Result<Columns, TooFewFills> {
    let mut known: Vec<(f64, [f64; 2])> = points
        .iter()
        .chain(between)
        .filter_map(|at| Some((at.liquid, coefficients(&at.coefficients(n)?))))
        .collect();
    known.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (missing, found): (Vec<&AtFill>, Vec<&AtFill>) =
        points.iter().partition(|at| at.coefficients(n).is_none());
    if found.len() < 2 {
        let why = missing.first().map_or("", |at| at.reason()).to_string();
        return Err(TooFewFills { mode: n, known: found.len(), fills: points.len(), why });
    }
    let masses: Vec<f64> = known.iter().map(|(liquid, _)| *liquid).collect();
    let curves = [0, 1].map(|i| {
        let y: Vec<f64> = known.iter().map(|(_, pair)| pair[i]).collect();
        Monotone::bounded(&masses, &y)
    });
    let pair_at = |at: &AtFill| match at.coefficients(n) {
        Some(known) => coefficients(&known),
        None => curves.each_ref().map(|curve| curve.evaluate(at.liquid)),
    };
    let pairs: Vec<[f64; 2]> = points.iter().map(pair_at).collect();
    let values = [0, 1].map(|i| pairs.iter().map(|pair| pair[i]).collect::<Vec<f64>>());

    let mut notes = vec![format!(
        "fill.nonlinear_inertia and fill.nonlinear_stiffness of mode {n}: third order of potential flow; errors are relative to \
         1 + |s| and 1 + |kappa|"
    )];
    for (at, [s, kappa]) in points.iter().zip(&pairs) {
        let from = match at.coefficients(n) {
            Some(known) => format!(
                "error {:.0e}, for slosh angles up to {:.0} degrees",
                known.error,
                known.angle_limit.to_degrees()
            ),
            None => format!("error not known, bounded by the neighbours: {}", at.reason()),
        };
        notes.push(format!(
            "fill {} m: s = {}, kappa = {}, {from}",
            format_length(at.fill),
            significant(*s),
            significant(*kappa)
        ));
    }
    let mut warnings = Vec::new();
    if !missing.is_empty() {
        warnings.push(format!(
            "{PREFIX}s and kappa of mode {n} are not known at the fills {} m, where the table has values bounded by its other \
             fills: {}",
            fills(&missing),
            missing[0].reason()
        ));
    }
    let masses: Vec<f64> = points.iter().map(|at| at.liquid).collect();
    let table = values.each_ref().map(|y| Monotone::bounded(&masses, y));
    let off = |at: &AtFill| {
        let exact = coefficients(&at.coefficients(n)?);
        let off =
            |i: usize| (table[i].evaluate(at.liquid) - exact[i]).abs() / (1.0 + exact[i].abs());
        Some((off(0).max(off(1)), at.fill))
    };
    let worst = between.iter().filter_map(off).max_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((worst, fill)) = worst {
        let text = format!(
            "between the points of the table the errors of s and kappa of mode {n} are at most {worst:.0e} of 1 + |s| \
             and 1 + |kappa|; they are largest at a fill of {} m",
            format_length(fill)
        );
        if worst > LARGEST {
            warnings.push(format!("{PREFIX}{text}: {} points are too few there", points.len()));
        }
        notes.push(text);
    }
    Ok(Columns { values, notes, warnings })
}

//! Modal parameters over the fill, as a table.

use crate::coefficients::Coefficients;
use crate::contour::Problems;
use crate::finite_amplitude;
use crate::modal::{ModalData, Mode, ModeDamping};
use crate::parameters::{Liquid, tank_damping};
use crate::tank::Tank;

/// Modal parameters at ascending fills, one row each. The row of a fill without liquid or without a
/// free surface has no modes.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    pub rows: Vec<ModalData>,
}

/// Solves for `modes` modes of a tank at each of the `fills`, m above the lowest point. A fill of
/// 0, and a fill without a free surface, give a row without modes.
///
/// # Errors
/// The problems of all fills, listed; also fills that do not ascend.
pub fn sweep(tank: &Tank, fills: &[f64], modes: usize) -> Result<Sweep, Problems> {
    let mut problems = Vec::new();
    if fills.is_empty() {
        problems.push("There is no fill to sweep over.".to_string());
    }
    if let Some(pair) = fills.windows(2).find(|p| p[1] <= p[0]) {
        problems.push(format!("The fills must ascend: {} m comes before {} m.", pair[0], pair[1]));
    }
    let mut rows = Vec::with_capacity(fills.len());
    for &fill in fills {
        let solved = if fill == 0.0 { Ok(tank.empty()) } else { tank.solve(fill, modes) };
        match solved {
            Ok(data) => rows.push(data),
            Err(more) => problems.extend(more.0),
        }
    }
    if problems.is_empty() { Ok(Sweep { rows }) } else { Err(Problems(problems)) }
}

impl Sweep {
    pub fn add_damping(&mut self, tank: &Tank, nu: f64, liquid: Liquid) -> Result<(), Problems> {
        for row in self.rows.iter_mut().filter(|row| !row.modes.is_empty()) {
            row.damping = Some(tank_damping(tank, row, nu, liquid)?);
        }
        Ok(())
    }

    pub fn add_third_order(&mut self, tank: &Tank) {
        for row in self.rows.iter_mut().filter(|row| !row.modes.is_empty()) {
            row.finite_amplitude = Some(finite_amplitude::amplitude_dependence(tank, row));
        }
    }

    /// Returns the rows as comma-separated values with a heading, in SI units. Heights count from
    /// the zero of the contour. Damping ratios with their intervals, and the third-order
    /// coefficients of mode 1 with their error and the largest angle of their validity, rad, have
    /// columns if they are known in at least one row. A cell is empty if its value is not known, or
    /// if the row has fewer modes.
    pub fn to_csv(&self) -> String {
        let modes = self.rows.iter().map(|r| r.modes.len()).max().unwrap_or(0);
        let is_damped = self.rows.iter().any(|row| row.damping.is_some());
        let has_third_order = self.rows.iter().any(|row| row.finite_amplitude.is_some());
        let mut columns: Vec<(String, Cell)> = Vec::new();
        for (name, value) in LIQUID {
            columns.push((name.into(), Box::new(move |row| Some(value(row)))));
        }
        for n in 0..modes {
            for (name, value) in MODE {
                let cell = move |row: &ModalData| value(row.modes.get(n)?);
                columns.push((format!("{name}_{}", n + 1), Box::new(cell)));
            }
            for (name, value) in DAMPING.iter().filter(|_| is_damped) {
                let cell = move |row: &ModalData| Some(value(row.damping.as_ref()?.modes.get(n)?));
                columns.push((format!("{name}_{}", n + 1), Box::new(cell)));
            }
        }
        for (name, value) in THIRD_ORDER.iter().filter(|_| has_third_order) {
            let cell = |row: &ModalData| Some(value(&row.finite_amplitude.as_ref()?.mode?));
            columns.push((name.to_string(), Box::new(cell)));
        }
        let heading = columns.iter().map(|(name, _)| name.clone()).collect();
        let cells = |row| {
            let text = |value: Option<f64>| value.map_or(String::new(), |v| v.to_string());
            columns.iter().map(|(_, cell)| text(cell(row))).collect()
        };
        let lines: Vec<Vec<String>> =
            [heading].into_iter().chain(self.rows.iter().map(cells)).collect();
        lines.iter().map(|line| line.join(",") + "\n").collect()
    }
}

type Cell = Box<dyn Fn(&ModalData) -> Option<f64>>;
type Column<T, V> = (&'static str, fn(&T) -> V);

const LIQUID: [Column<ModalData, f64>; 10] = [
    ("fill", |row| row.fill),
    ("m_liq", |row| row.m_liq),
    ("z_cg", |row| row.z_cg),
    ("I_frozen_cg", |row| row.i_frozen_cg),
    ("I_frozen_axis", |row| row.i_frozen_axis),
    ("I_eff_cg", |row| row.i_eff_cg),
    ("m_0", |row| row.rest(row.modes.len()).m_0),
    ("H_0", |row| row.rest(row.modes.len()).height),
    ("I_0", |row| row.rest(row.modes.len()).inertia),
    ("error", |row| row.error),
];
const MODE: [Column<Mode, Option<f64>>; 7] = [
    ("lambda", |mode| Some(mode.lambda)),
    ("m", |mode| Some(mode.m)),
    ("l", |mode| Some(mode.l)),
    ("H", |mode| mode.height),
    ("hinge", |mode| mode.hinge),
    ("wave", |mode| Some(mode.wave)),
    ("beta", |mode| Some(mode.beta)),
];
const DAMPING: [Column<ModeDamping, f64>; 3] = [
    ("zeta", |mode| mode.zeta),
    ("zeta_low", |mode| mode.interval[0]),
    ("zeta_high", |mode| mode.interval[1]),
];
const THIRD_ORDER: [Column<Coefficients, f64>; 4] = [
    ("nonlinear_inertia_1", |mode| mode.nonlinear_inertia),
    ("nonlinear_stiffness_1", |mode| mode.nonlinear_stiffness),
    ("finite_amplitude_error_1", |mode| mode.error),
    ("angle_limit_1", |mode| mode.angle_limit),
];

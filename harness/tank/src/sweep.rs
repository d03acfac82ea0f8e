//! Modal parameters over the fill: a table, and its interpolation for a tank that empties.

use core::fmt::Write as _;

use crate::contour::Problems;
use crate::finite_amplitude;
use crate::interpolation::Monotone;
use crate::modal::{ModalData, Mode, Rest, rest};
use crate::parameters::{Liquid, tank_damping};
use crate::tank::Tank;

/// Modal parameters at ascending fills, one row each. Without liquid or without a free surface a row has no
/// modes.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    pub rows: Vec<ModalData>,
}

/// Solves at each of the `fills`, m above the lowest point, for `modes` modes.
///
/// A fill of 0 or without a free surface gives a row without modes.
///
/// # Errors Lists the problems of all fills; also if the fills do not ascend.
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
    /// Computes the damping of every row that has modes, with the errors of [`tank_damping`].
    pub fn damp(&mut self, tank: &Tank, nu: f64, liquid: Liquid) -> Result<(), Problems> {
        for row in self.rows.iter_mut().filter(|row| !row.modes.is_empty()) {
            row.damping = Some(tank_damping(tank, row, nu, liquid)?);
        }
        Ok(())
    }

    /// Computes the third-order coefficients of every row that has modes, see
    /// [`finite_amplitude::amplitude_dependence`].
    pub fn add_third_order(&mut self, tank: &Tank) {
        for row in self.rows.iter_mut().filter(|row| !row.modes.is_empty()) {
            row.finite_amplitude = Some(finite_amplitude::amplitude_dependence(tank, row));
        }
    }

    /// Returns comma-separated values with a heading; columns of modes that a row lacks are empty. Units are
    /// SI; H and hinge count from the contour's own zero. Damping ratios with the ends of their intervals,
    /// and the third-order coefficients of mode 1 with their error and the largest angle of their validity,
    /// rad, have columns if any row has them. The columns are empty where they are not known.
    pub fn to_csv(&self) -> String {
        let modes = self.rows.iter().map(|r| r.modes.len()).max().unwrap_or(0);
        let is_damped = self.rows.iter().any(|row| row.damping.is_some());
        let has_third_order = self.rows.iter().any(|row| row.finite_amplitude.is_some());
        let mut text =
            "fill,m_liq,z_cg,I_frozen_cg,I_frozen_axis,I_eff_cg,m_0,H_0,I_0,error".to_string();
        for n in 1..=modes {
            for name in ["lambda", "m", "l", "H", "hinge", "wave", "beta"] {
                let _ = write!(text, ",{name}_{n}");
            }
            if is_damped {
                let _ = write!(text, ",zeta_{n},zeta_low_{n},zeta_high_{n}");
            }
        }
        if has_third_order {
            text.push_str(
                ",nonlinear_inertia_1,nonlinear_stiffness_1,finite_amplitude_error_1,angle_limit_1",
            );
        }
        text.push('\n');
        for row in &self.rows {
            let rest = row.rest(row.modes.len());
            let values = [
                row.fill,
                row.m_liq,
                row.z_cg,
                row.i_frozen_cg,
                row.i_frozen_axis,
                row.i_eff_cg,
                rest.m_0,
                rest.height,
                rest.inertia,
                row.error,
            ];
            let mut cells: Vec<String> = values.iter().map(|v| v.to_string()).collect();
            for n in 0..modes {
                let mode = row.modes.get(n);
                let column = |f: &dyn Fn(&Mode) -> Option<f64>| {
                    mode.and_then(f).map_or(String::new(), |v| v.to_string())
                };
                cells.extend([
                    column(&|m| Some(m.lambda)),
                    column(&|m| Some(m.m)),
                    column(&|m| Some(m.l)),
                    column(&|m| m.height),
                    column(&|m| m.hinge),
                    column(&|m| Some(m.wave)),
                    column(&|m| Some(m.beta)),
                ]);
                if is_damped {
                    let found = row.damping.as_ref().and_then(|damping| damping.modes.get(n));
                    cells.extend(match found {
                        Some(mode) => {
                            [mode.zeta, mode.interval[0], mode.interval[1]].map(|v| v.to_string())
                        }
                        None => Default::default(),
                    });
                }
            }
            if has_third_order {
                let found = row.finite_amplitude.as_ref().and_then(|found| found.mode);
                cells.extend(match found {
                    Some(mode) => [
                        mode.nonlinear_inertia,
                        mode.nonlinear_stiffness,
                        mode.error,
                        mode.angle_limit,
                    ]
                    .map(|v| v.to_string()),
                    None => Default::default(),
                });
            }
            text.push_str(&cells.join(","));
            text.push('\n');
        }
        text
    }
}

/// Modal parameters of a tank that empties, as functions of the fill with two continuous derivatives,
/// monotone wherever the table is (see [`Monotone`]). Where the wall has a corner or a jump of curvature, the
/// true functions are less smooth. The error there is that of the fills' spacing.
///
/// Interpolation covers m_liq, z_cg, the pendulums' l_n, and, over m_liq, the masses m_n, m_n h_n (H is
/// unbounded for small m), the rigid inertias and I_0. m_0, H_0 and I_eff follow from these, so that mass and
/// moment are those of the liquid and I_0 stays positive.
#[derive(Clone, Debug)]
pub struct Depletion {
    range: [f64; 2],
    liquid: [Monotone; 5],
    modes: Vec<ModeTable>,
}

/// Curves of one mode: l, m, m h, m h^2 (over m_liq), wave, beta.
#[derive(Clone, Debug)]
struct ModeTable([Monotone; 6]);

/// Modal parameters at one fill, interpolated, with the names and units of [`ModalData`]. The modes have no
/// shapes, and `rest` is the fixed mass when all these modes are pendulums.
#[derive(Clone, Debug, PartialEq)]
pub struct AtFill {
    pub fill: f64,
    pub m_liq: f64,
    pub z_cg: f64,
    pub i_frozen_cg: f64,
    pub i_frozen_axis: f64,
    pub i_eff_cg: f64,
    pub modes: Vec<Mode>,
    pub rest: Rest,
}

impl Depletion {
    /// Creates the functions from the rows of a sweep that have modes.
    ///
    /// # Errors If fewer than two rows have modes.
    pub fn new(sweep: &Sweep) -> Result<Depletion, Problems> {
        let rows: Vec<&ModalData> = sweep.rows.iter().filter(|r| !r.modes.is_empty()).collect();
        if rows.len() < 2 {
            return Err("A table of fills needs at least two that have modes.".to_string().into());
        }
        let fills: Vec<f64> = rows.iter().map(|r| r.fill).collect();
        let table = |f: &dyn Fn(&ModalData) -> f64| {
            Monotone::new(&fills, &rows.iter().map(|r| f(r)).collect::<Vec<_>>())
        };
        let modes = rows.iter().map(|r| r.modes.len()).min().unwrap_or(0);
        let mode = |n: usize| {
            let mode_table = |f: fn(&Mode) -> f64| table(&move |r: &ModalData| f(&r.modes[n]));
            let over = |f: fn(&Mode) -> f64| table(&move |r: &ModalData| f(&r.modes[n]) / r.m_liq);
            ModeTable([
                mode_table(|m| m.l),
                over(|m| m.m),
                over(|m| m.m_h),
                over(|m| m.m_h2),
                mode_table(|m| m.wave),
                mode_table(|m| m.beta),
            ])
        };
        Ok(Depletion {
            range: [fills[0], fills[fills.len() - 1]],
            liquid: [
                table(&|r| r.m_liq),
                table(&|r| r.z_cg),
                table(&|r| r.i_frozen_cg / r.m_liq),
                table(&|r| r.i_frozen_axis / r.m_liq),
                table(&|r| r.rest(modes).inertia / r.m_liq),
            ],
            modes: (0..modes).map(mode).collect(),
        })
    }

    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// Returns the parameters at a fill, m; outside the table's range those at its nearest end.
    pub fn parameters_at(&self, fill: f64) -> AtFill {
        let fill = fill.clamp(self.range[0], self.range[1]);
        let [m_liq, z_cg, across, axial, inertia] =
            self.liquid.each_ref().map(|t| t.evaluate(fill));
        let mode = |(i, table): (usize, &ModeTable)| {
            let [l, m, m_h, m_h2, wave, beta] = table.0.each_ref().map(|t| t.evaluate(fill));
            // m h^2 follows from m and m h, unless m is too small to divide by
            let m_h2 = if m > 1e-6 { m_h * m_h / m } else { m_h2 };
            Mode::interpolated(i + 1, l, [m, m_h, m_h2].map(|x| x * m_liq), z_cg, m_liq, wave, beta)
        };
        let modes: Vec<Mode> = self.modes.iter().enumerate().map(mode).collect();
        let i_0 = inertia * m_liq;
        let without = rest(m_liq, z_cg, 0.0, &modes);
        AtFill {
            fill,
            m_liq,
            z_cg,
            i_frozen_cg: across * m_liq,
            i_frozen_axis: axial * m_liq,
            i_eff_cg: i_0 - without.inertia,
            rest: Rest { inertia: i_0, ..without },
            modes,
        }
    }

    /// Returns the fill with this mass of liquid, kg, within the table's range.
    pub fn fill_from_mass(&self, m_liq: f64) -> f64 {
        let [mut low, mut high] = self.range;
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.liquid[0].evaluate(middle) < m_liq {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }
}

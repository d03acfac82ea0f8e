//! Tables over the fill for the FMUs Spacecraft and SloshTank, with fills chosen so that few points are enough.
//!
//! Between the points of a table an FMU interpolates 1/l, the height of the slosh mass at rest, and m/m_liq, all as
//! functions of the mass of liquid (`fmu/craft/src/table.rs`, with the slopes of [`formulas::interpolation`]). [`place`]
//! solves for the modes at many fills, and chooses from them the points that minimise the largest interpolation error.

use core::f64::consts::PI;

use names::sloshtank::tank::MOST_MODES as MODES;
use names::sloshtank::tank::fill;
pub use names::sloshtank::tank::fill::MOST_POINTS as POINTS;
use names::sloshtank::tank::{
    ANGLE_LIMIT, H_0, HINGE, I_0, I_Z, LENGTH, LIQUID_0, M_0, MASS, NONLINEAR_INERTIA,
    NONLINEAR_STIFFNESS, OUTLET, SWIRL_LIMIT, ZETA,
};

use crate::contour::Problems;
use crate::fill_amplitude::{self, AtFill, Columns, TooFewFills};
use crate::interpolation::Monotone;
use crate::modal::ModalData;
use crate::parameters::{Liquid, ParameterSet, Target, Value};
use crate::sweep::{self, Sweep};
use crate::table::{format_length, significant};
use crate::tank::Tank;

const CANDIDATES: usize = 97;

/// Largest acceptable interpolation error of a fill table: 0.5 % of a frequency, of a mass, or of
/// the largest radius of the surface.
const LIMIT: f64 = 5e-3;

#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    pub sweep: Sweep,
    pub between: Between,
}

/// Solutions `rows` near the middle between every two neighbouring points of a table, and the
/// largest interpolation `error` of the first mode there: of its frequency (relative), of its mass
/// (relative), and of its hinge (divided by the largest radius of the surface).
#[derive(Clone, Debug, PartialEq)]
pub struct Between {
    pub error: [f64; 3],
    pub rows: Vec<ModalData>,
}

/// Quantities of the modes at many fills, from which the points of a fill table are chosen: the
/// mass of the liquid, kg, and for each mode omega^2/g, 1/m, the height of the slosh mass at rest,
/// m, and the slosh mass divided by the mass of the liquid.
struct Curves {
    liquid: Vec<f64>,
    modes: Vec<[Vec<f64>; 3]>,
    radius: f64,
}

impl Curves {
    fn new(rows: &[ModalData], modes: usize) -> Curves {
        let curves = |n: usize| {
            [
                rows.iter().map(|row| 1.0 / row.modes[n].l).collect(),
                rows.iter().map(|row| bob_height(row, n)).collect(),
                rows.iter().map(|row| row.modes[n].m / row.m_liq).collect(),
            ]
        };
        let radius =
            |row: &ModalData| row.r_surface.or(row.length_x.map(|l| l / 2.0)).unwrap_or(1.0);
        Curves {
            liquid: rows.iter().map(|row| row.m_liq).collect(),
            modes: (0..modes).map(curves).collect(),
            radius: rows.iter().map(radius).fold(0.0, f64::max),
        }
    }

    fn errors(&self, n: usize, points: &[usize]) -> [f64; 3] {
        let taken = |y: &[f64]| points.iter().map(|i| y[*i]).collect::<Vec<_>>();
        let x = taken(&self.liquid);
        let mode = &self.modes[n];
        let curves = mode.each_ref().map(|y| Monotone::bounded(&x, &taken(y)));
        let mut worst = [0.0_f64; 3];
        for (i, liquid) in self.liquid.iter().enumerate() {
            let [stiffness, bob, share] = curves.each_ref().map(|curve| curve.evaluate(*liquid));
            let hinge = bob + 1.0 / stiffness - mode[1][i] - 1.0 / mode[0][i];
            let off = [
                (stiffness / mode[0][i]).sqrt() - 1.0,
                share / mode[2][i] - 1.0,
                hinge / self.radius,
            ];
            worst = core::array::from_fn(|k| worst[k].max(off[k].abs()));
        }
        worst
    }

    /// Returns the largest interpolation error of a fill table whose rows are at the fills with the
    /// indices `points`. The errors of a mode that is lighter than the first mode are weighted with
    /// the ratio of the masses.
    fn cost(&self, points: &[usize]) -> f64 {
        let heaviest = |n: usize| self.modes[n][2].iter().copied().fold(0.0, f64::max);
        let weighted = |n: usize| {
            let largest = self.errors(n, points).into_iter().fold(0.0, f64::max);
            largest * (heaviest(n) / heaviest(0)).min(1.0)
        };
        (0..self.modes.len()).map(weighted).fold(0.0, f64::max)
    }
}

fn bob_height(row: &ModalData, n: usize) -> f64 {
    row.modes[n].height.unwrap_or(row.z_cg)
}

fn count_carrying_modes(rows: &[ModalData]) -> usize {
    let most = rows.iter().map(|row| row.modes.len()).min().unwrap_or(0);
    let carries = |n: &usize| rows.iter().all(|row| row.modes[*n].m > 1e-6 * row.m_liq);
    (1..most.min(MODES)).take_while(carries).last().map_or(1, |n| n + 1)
}

/// Chooses [`POINTS`] fills from `low` to `high`, m above the lowest point, including both ends, so
/// that interpolation between them has small errors. `modes` is the number of modes.
///
/// # Errors
/// The errors of [`Tank::solve`]; also if there is no free surface at an end.
pub fn place(tank: &Tank, low: f64, high: f64, modes: usize) -> Result<Placed, Problems> {
    // Fills are denser near the ends, where the surface of a closed tank gets narrow and the modes change most.
    let share = |i: usize| 0.5 - 0.5 * (PI * i as f64 / (CANDIDATES - 1) as f64).cos();
    let fills: Vec<f64> = (0..CANDIDATES)
        .map(|i| match i {
            0 => low,
            _ if i == CANDIDATES - 1 => high,
            _ => low + (high - low) * share(i),
        })
        .collect();
    let dense = sweep::sweep(tank, &fills, modes)?.rows;
    check_surfaces(&dense)?;
    let curves = Curves::new(&dense, count_carrying_modes(&dense));
    let mut points: Vec<usize> =
        (0..POINTS).map(|i| (i * (CANDIDATES - 1) + (POINTS - 1) / 2) / (POINTS - 1)).collect();
    let mut best = curves.cost(&points);
    let mut step = 8;
    while step > 0 {
        let mut moved = false;
        for k in 1..POINTS - 1 {
            for forwards in [true, false] {
                let to = if forwards { points[k] + step } else { points[k].saturating_sub(step) };
                if to <= points[k - 1] || to >= points[k + 1] {
                    continue;
                }
                let from = core::mem::replace(&mut points[k], to);
                let cost = curves.cost(&points);
                if cost < best * (1.0 - 1e-9) {
                    (best, moved) = (cost, true);
                } else {
                    points[k] = from;
                }
            }
        }
        if !moved {
            step /= 2;
        }
    }
    let solved = |places: &[usize]| places.iter().map(|i| dense[*i].clone()).collect();
    let middles: Vec<usize> = points
        .windows(2)
        .filter(|pair| pair[1] > pair[0] + 1)
        .map(|pair| (pair[0] + pair[1]) / 2)
        .collect();
    let between = Between { error: curves.errors(0, &points), rows: solved(&middles) };
    Ok(Placed { sweep: Sweep { rows: solved(&points) }, between })
}

fn check_surfaces(rows: &[ModalData]) -> Result<(), Problems> {
    if rows.iter().any(|row| row.modes.is_empty()) {
        return Err("A table over the fill needs a free surface at every fill: an empty tank and a full one have none."
            .into());
    }
    Ok(())
}

/// Returns the parameters of a tank that can drain: its parameters at the largest fill of `sweep`,
/// where it starts, and its fill table. `between` has the interpolation errors of the table, if
/// they are known.
///
/// # Errors
/// The errors of [`ParameterSet::new`]; also if the target is the FMU HubSlosh, whose tank does not
/// drain, or if there are fewer than two fills or more than [`POINTS`].
pub fn parameters(
    tank: &Tank,
    sweep: &Sweep,
    between: Option<&Between>,
    target: Target,
    liquid: Liquid,
) -> Result<ParameterSet, Problems> {
    if target == Target::HubSlosh {
        return Err(
            "HubSlosh's tank does not drain: a table over the fill is for SloshTank or Spacecraft."
                .into(),
        );
    }
    let prefix = target.name("tank");
    let rows = &sweep.rows;
    if !(2..=POINTS).contains(&rows.len()) {
        return Err(
            format!("A table over the fill has 2 to {POINTS} points, not {}.", rows.len()).into()
        );
    }
    check_surfaces(rows)?;
    let (first, last) = (&rows[0], &rows[rows.len() - 1]);
    let modes = count_carrying_modes(rows);
    let solved = |rows: &[ModalData], liquid: Liquid| {
        let with_modes = |row: &ModalData| {
            let row = ModalData { modes: row.modes[..modes].to_vec(), ..row.clone() };
            ParameterSet::with_energy(tank, &row, target, liquid, false)
        };
        rows.iter().map(with_modes).collect::<Result<Vec<_>, _>>()
    };
    let mut sets = solved(rows, liquid)?;
    let value = |set: &ParameterSet, what: &str, n: usize| {
        let name = format!("{prefix}.{what}[{n}]");
        set.values.iter().find_map(|(other, value)| match value {
            Value::Real(x) if *other == name => Some(*x),
            _ => None,
        })
    };
    let ratio = |set: &ParameterSet, n: usize| value(set, "zeta", n).unwrap_or(0.0);
    let ratios: Vec<Vec<f64>> =
        sets.iter().map(|set| (1..=modes).map(|n| ratio(set, n)).collect()).collect();
    let limits = |what: &str, n: usize| -> Vec<Option<f64>> {
        sets.iter().map(|set| value(set, what, n)).collect()
    };
    let limits: Vec<_> =
        (1..=modes).map(|n| [limits("angle_limit", n), limits("swirl_limit", n)]).collect();
    let middle = between.map_or(&[][..], |between| &between.rows);
    let middle_sets = solved(middle, Liquid { nu: None, ..liquid })?;
    let third_order =
        third_order(AtFill::from_rows(rows, &sets), AtFill::from_rows(middle, &middle_sets));
    let [low, high] = [sets.first(), sets.last()]
        .map(|set| set.and_then(|set| value(set, "k", 1)).unwrap_or(0.0));
    let mut set = sets.pop().unwrap_or_else(|| unreachable!("there are at least two rows"));
    if low != high {
        let text = format!(
            "while the tank drains, the stiffnesses keep their values of the largest fill: k[1] is {} N/m there, {} N/m at the smallest fill",
            significant(high),
            significant(low)
        );
        set.notes.push(text.clone());
        set.warnings.push(text);
    }
    // The columns of the table replace the coefficients of the largest fill.
    set.third_order.clear();
    set.notes
        .retain(|note| !note.starts_with(fill_amplitude::PREFIX) && !note.starts_with(INERTIA));
    let mut of_fills = Vec::new();
    for (n, found) in third_order {
        match found {
            Ok(columns) => {
                set.notes.extend(columns.notes);
                set.warnings.extend(columns.warnings);
                of_fills.push((n, columns.values));
            }
            Err(too_few) => set.notes.push(too_few.to_string()),
        }
    }
    if liquid.nu.is_some() {
        let text = "fill.zeta has the damping ratios of every fill; the interval above belongs to the largest fill";
        set.notes.push(text.to_string());
    }
    set.notes.push(format!(
        "table of {} fills, {} to {} m; liquid_0 is the mass of liquid at the largest fill, outlet is the tank's lowest point",
        rows.len(),
        format_length(first.fill),
        format_length(last.fill)
    ));
    if let Some(Between { error: [frequency, mass, hinge], .. }) = between {
        set.notes.push(format!(
            "largest interpolation errors of mode 1: frequency {:.2} %, mass {:.2} %, hinge {:.2} % of the surface's \
             largest radius",
            100.0 * frequency,
            100.0 * mass,
            100.0 * hinge
        ));
        if frequency.max(*mass).max(*hinge) > LIMIT {
            set.warnings.push(format!(
                "{} points are too few for this tank between these fills: the interpolation error is above {} %",
                rows.len(),
                100.0 * LIMIT
            ));
        }
    }
    // names of the parameters that the table replaces
    let of_modes =
        [MASS, LENGTH, HINGE, NONLINEAR_INERTIA, NONLINEAR_STIFFNESS, ANGLE_LIMIT, SWIRL_LIMIT];
    let of_modes = of_modes.into_iter().chain(liquid.nu.map(|_| ZETA));
    let of_modes = of_modes.flat_map(|array| (1..=modes).map(move |n| array.element([n])));
    let replaced = [M_0, H_0, I_0, I_Z].map(String::from).into_iter().chain(of_modes);
    let replaced: Vec<String> = replaced.map(|name| target.name(&name)).collect();
    set.values.retain(|(name, _)| !replaced.contains(name));
    let mut real = |name: &str, value: f64| {
        set.values.push((target.name(name), Value::Real(value)));
    };
    real(LIQUID_0, last.m_liq);
    real(OUTLET, last.z_lowest);
    for (i, row) in rows.iter().enumerate() {
        let (at, rest) = (i + 1, row.rest(modes));
        real(&fill::LIQUID.element([at]), row.m_liq);
        real(&fill::H_0.element([at]), rest.height);
        // With the largest number of modes, rounding errors can make I_0 negative.
        real(&fill::I_0.element([at]), rest.inertia.max(0.0));
        real(&fill::I_Z.element([at]), row.i_eff_axis.unwrap_or(0.0));
        for n in 0..modes {
            let mode = &row.modes[n];
            real(&fill::MASS.element([n + 1, at]), mode.m);
            real(&fill::LENGTH.element([n + 1, at]), mode.l);
            real(&fill::HINGE.element([n + 1, at]), bob_height(row, n) + mode.l);
            if liquid.nu.is_some() {
                real(&fill::ZETA.element([n + 1, at]), ratios[i][n]);
            }
        }
    }
    for (n, [s, kappa]) in of_fills {
        for (i, (s, kappa)) in s.into_iter().zip(kappa).enumerate() {
            real(&fill::NONLINEAR_INERTIA.element([n, i + 1]), s);
            real(&fill::NONLINEAR_STIFFNESS.element([n, i + 1]), kappa);
        }
    }
    for (n, [angle, swirl]) in limits.into_iter().enumerate() {
        for (i, (angle, swirl)) in angle.into_iter().zip(swirl).enumerate() {
            for (array, limit) in [(fill::ANGLE_LIMIT, angle), (fill::SWIRL_LIMIT, swirl)] {
                if let Some(limit) = limit {
                    real(&array.element([n + 1, i + 1]), limit);
                }
            }
        }
    }
    set.values.push((target.name(fill::POINTS), Value::Integer(rows.len() as i64)));
    Ok(set)
}

const INERTIA: &str = "nonlinear_inertia[";

fn third_order(
    points: Vec<AtFill>,
    between: Vec<AtFill>,
) -> Vec<(usize, Result<Columns, TooFewFills>)> {
    let numbers = points.iter().flat_map(|at| at.set.third_order.iter().map(|(n, _)| *n));
    // Mode 1 is listed even if its coefficients are known at no fill, so that the reason is reported.
    let most = numbers.max().unwrap_or(1);
    (1..=most).map(|n| (n, fill_amplitude::columns(n, &points, &between))).collect()
}

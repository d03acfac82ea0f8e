//! Estimates on the terminal, whatever they were identified from.

use std::collections::BTreeMap;

use identify::estimate::Estimated;

/// Prints a table of estimates.
pub(super) fn print_estimates(tables: &[&BTreeMap<String, Estimated>]) {
    println!("{:24} {:>14} {:>12} {:>9}  unit", "", "value", "std", "std %");
    for (name, p) in tables.iter().flat_map(|table| table.iter()) {
        let percent =
            p.percent(p.std).map_or("–".into(), |percent| format!("{:.4}", percent.abs()));
        println!("{name:24} {:>14.7} {:>12.2e} {percent:>9}  {}", p.value, p.std, p.unit);
    }
}

/// Returns a standard deviation that is foreseen, for a table; NaN: the inputs tell nothing of it.
pub(super) fn deviation(std: f64) -> String {
    if std.is_finite() { format!("{std:.2e}") } else { "not told".into() }
}

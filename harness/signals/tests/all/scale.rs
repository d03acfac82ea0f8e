//! Reads random valid files with times in every unit, type and layout, whose true times are known. The reader returns the true
//! times or refuses the file: a wrong factor between units never goes unnoticed.

use std::collections::BTreeMap;
use std::sync::Arc;

use fastrand::Rng;
use parquet::basic::{LogicalType, Repetition, TimeUnit, Type as Physical};
use parquet::data_type::{DoubleType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use signals::recording::{self, Between, Columns, Signal, Wanted};

const UNITS: [(&str, i64); 6] = [
    ("s", 1_000_000_000),
    ("ms", 1_000_000),
    ("us", 1000),
    ("ns", 1),
    ("min", 60_000_000_000),
    ("h", 3_600_000_000_000),
];
const STEPS: [i64; 7] = [1, 2, 10, 20, 25, 100, 250];
const BEGIN: i64 = 1_769_860_800;
/// Largest fraction of files that may be refused, although each of them states a unit, a date or a clock time.
const REFUSED: f64 = 1e-3;

#[derive(Clone, Default)]
struct Truth {
    columns: String,
    /// True time of each row since the first row, s. The file may lack the last rows.
    time: Vec<f64>,
    is_unstated: bool,
}

fn judge(ending: &str, count: u64, make: fn(&mut Rng) -> (Vec<u8>, Truth)) {
    let seed = std::env::var("HUBSLOSH_FUZZ_SEED").ok().and_then(|seed| seed.parse().ok());
    let mut dice = Rng::with_seed(seed.unwrap_or(1));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("input.{ending}"));
    // number of refused files, and the first of them, by the reason
    let mut refused: BTreeMap<String, (u64, String)> = BTreeMap::new();
    let mut foreign = 0;
    for n in 0..count {
        let (bytes, Truth { columns, time, is_unstated }) = make(&mut dice);
        // the old file is deleted, because some file systems write a replaced file to the disk at once
        let _ = std::fs::remove_file(&path);
        std::fs::write(&path, &bytes).unwrap();
        let text = || format!("file {n}, {columns}:\n{}", String::from_utf8_lossy(&bytes));
        let signal = Signal { name: "omega", required: true, between: Between::Held, unit: None };
        let columns: Columns = columns.parse().unwrap();
        let wanted = Wanted { signals: &[signal], columns: &columns };
        let table = match recording::read_here(&path, &path, &wanted, &mut |_| {}) {
            Ok(Some(table)) => table,
            // only the Python package reads times of day and integers
            Ok(None) => {
                foreign += 1;
                continue;
            }
            Err(_) if is_unstated => continue,
            Err(error) => {
                let words = format!("{error:#}").replace(|c: char| !c.is_alphabetic(), " ");
                let words = words.split_whitespace().collect::<Vec<_>>().join(" ");
                refused.entry(words).or_insert_with(|| (0, format!("{error:#}\n{}", text()))).0 +=
                    1;
                continue;
            }
        };
        assert!(!is_unstated, "times without a unit were read: {}", text());
        let (found, omega) = (table.column("time").unwrap(), table.column("omega").unwrap());
        assert!(found.len() + 1 >= time.len(), "{} rows: {}", found.len(), text());
        for (k, (found, time)) in found.iter().map(|t| t - found[0]).zip(&time).enumerate() {
            let off = (found - time).abs() / (1.0 + time);
            assert!(off < 1e-5, "row {k} is at {found} s, not at {time} s: {}", text());
            assert_eq!(omega[k], k as f64 + 0.5, "row {k}: {}", text());
        }
    }
    let share = refused.values().map(|(n, _)| n).sum::<u64>() as f64 / count as f64;
    println!("{ending}: {count} files, {:.2} % refused", 100.0 * share);
    for (n, first) in refused.values() {
        println!("{n} refused, the first as\n{first}\n");
    }
    assert!(share <= REFUSED, "{share} of the files are refused");
    assert!(foreign < count / 2 && (ending == "parquet") == (foreign > 0), "{foreign} of {count}");
}

fn number(ns: i64, unit: i64) -> String {
    match ns % unit {
        0 => (ns / unit).to_string(),
        _ => format!("{:.9}", ns as f64 / unit as f64),
    }
}

fn clock(ns: i64) -> String {
    let ms = ns / 1_000_000;
    format!(
        "{:02}:{:02}:{:02}.{:03}",
        12 + ms / 3_600_000,
        ms / 60_000 % 60,
        ms / 1000 % 60,
        ms % 1000
    )
}

fn text(dice: &mut Rng) -> (Vec<u8>, Truth) {
    let (step, rows) = (STEPS[dice.usize(..STEPS.len())] * 1_000_000, dice.usize(5..40));
    let time = |k: usize| step * k as i64;
    let (unit, ns) = UNITS[dice.usize(..UNITS.len())];
    let form = dice.u8(..10);
    let separator = match dice.u8(..4) {
        0 => ";",
        1 => "\t",
        2 if form < 6 => " ",
        _ => ",",
    };
    let has_commas = separator != "," && dice.bool();
    let decimal = |text: String| if has_commas { text.replace('.', ",") } else { text };
    let quotes = if separator != " " && dice.u8(..4) == 0 { "\"" } else { "" };
    let (mut name, mut below, mut columns) = ("t".to_string(), None, "time=t".to_string());
    match form {
        0 => name = format!("t [{unit}]"),
        1 => name = format!("t ({unit})"),
        2 | 3 => below = Some(""),
        4 | 5 => columns = format!("time=t:{unit}"),
        _ => {}
    }
    if separator == " " && form < 2 {
        name = format!("\"{name}\"");
    }
    let stamp = |k: usize| match form {
        6 => format!("2026-01-31T{}Z", clock(time(k))),
        7 => format!("31.01.2026 {}", clock(time(k))),
        8 => clock(time(k)),
        9 => number(time(k), 1_000_000_000),
        _ => number(time(k), ns),
    };
    // a column before the time, with row names or a keyword in the first row
    let first = match dice.u8(..4) {
        0 if separator != " " => Some("rows"),
        1 if below.is_none() && separator != " " => Some("keyword"),
        _ => None,
    };
    let (is_closed, has_words) = (separator != " " && dice.u8(..5) == 0, dice.u8(..4) == 0);
    let row = |fields: &[String], closed: bool| {
        let mut line = fields.join(separator);
        if closed {
            line += separator;
        }
        line + "\n"
    };
    let quoted = |text: String| format!("{quotes}{text}{quotes}");
    let mut out = String::new();
    for _ in 0..dice.usize(..3) {
        out += ["Logger 3000\n", "# bench\n", "\n", "Date: 31.01.2026\n", "***\n"][dice.usize(..5)];
    }
    let mut head = Vec::new();
    let mut units = Vec::new();
    if let Some(first) = first {
        head.push(if first == "rows" { "\"\"".to_string() } else { "name".into() });
        units.push(String::new());
    }
    head.extend([name, "omega".into()]);
    units.extend([unit.to_string(), "rad/s".into()]);
    if has_words {
        head.push("state".into());
        units.push(String::new());
    }
    out += &row(&head, false);
    if below.is_some() {
        // the header has as many fields as the rows
        let cells =
            units.iter().map(|unit| if separator == " " && unit.is_empty() { "-" } else { unit });
        out += &row(&cells.map(String::from).collect::<Vec<_>>(), false);
    }
    for k in 0..rows {
        let mut cells = Vec::new();
        match first {
            Some("rows") => cells.push(format!("\"{}\"", k + 1)),
            Some(_) if separator == " " => cells.push("\"\"".into()),
            Some(_) => cells.push(if k == 0 { "trace_values".into() } else { String::new() }),
            None => {}
        }
        cells.push(quoted(decimal(stamp(k))));
        cells.push(quoted(decimal(format!("{k}.5"))));
        if has_words {
            cells.push("\"idle\"".into());
        }
        out += &row(&cells, is_closed);
    }
    if dice.u8(..5) == 0 {
        out.truncate(out.len() - 1);
    }
    let time = (0..rows).map(|k| time(k) as f64 * 1e-9).collect();
    (out.into_bytes(), Truth { columns, time, is_unstated: false })
}

fn columns(dice: &mut Rng) -> (Vec<u8>, Truth) {
    let (step, rows) = (STEPS[dice.usize(..STEPS.len())] * 1_000_000, dice.usize(5..40));
    let (unit, ns) = UNITS[dice.usize(..4)];
    let kind = dice.u8(..6);
    let logical = |unit: &str| match unit {
        "ms" => TimeUnit::MILLIS,
        "us" => TimeUnit::MICROS,
        _ => TimeUnit::NANOS,
    };
    // timestamps and times of day cannot have the unit s
    let ns = if kind < 2 && unit == "s" { 1 } else { ns };
    let name = if kind == 3 { format!("t [{unit}]") } else { "t".to_string() };
    let first = Type::primitive_type_builder(
        &name,
        if kind == 5 { Physical::DOUBLE } else { Physical::INT64 },
    );
    let first = match kind {
        0 => first.with_logical_type(Some(LogicalType::timestamp(dice.bool(), logical(unit)))),
        1 if unit != "ms" => {
            first.with_logical_type(Some(LogicalType::time(dice.bool(), logical(unit))))
        }
        _ => first,
    };
    // a time of day in ms is an i32, which is written as a plain integer without a unit
    let is_integer = kind == 2 || kind == 1 && unit == "ms";
    // the steps of these times show that their unit cannot be s
    let is_unstated = is_integer || kind == 5 && step.max(ns) >= 1_000_000_000;
    let omega = Type::primitive_type_builder("omega", Physical::DOUBLE);
    let fields =
        [first, omega].map(|f| Arc::new(f.with_repetition(Repetition::REQUIRED).build().unwrap()));
    let schema = Type::group_type_builder("schema").with_fields(fields.to_vec()).build().unwrap();
    let mut bytes = Vec::new();
    let properties = Arc::new(WriterProperties::builder().build());
    let mut writer = SerializedFileWriter::new(&mut bytes, Arc::new(schema), properties).unwrap();
    let mut group = writer.next_row_group().unwrap();
    let origin = if kind == 0 { BEGIN * 1_000_000_000 } else { 0 };
    // the step is a whole number of the unit
    let step = (step / ns).max(1) * ns;
    let times: Vec<i64> = (0..rows).map(|k| (origin + step * k as i64) / ns).collect();
    let mut column = group.next_column().unwrap().unwrap();
    if kind == 5 {
        let seconds: Vec<f64> = times.iter().map(|t| *t as f64 * ns as f64 * 1e-9).collect();
        column.typed::<DoubleType>().write_batch(&seconds, None, None).unwrap();
    } else {
        column.typed::<Int64Type>().write_batch(&times, None, None).unwrap();
    }
    column.close().unwrap();
    let omega: Vec<f64> = (0..rows).map(|k| k as f64 + 0.5).collect();
    let mut column = group.next_column().unwrap().unwrap();
    column.typed::<DoubleType>().write_batch(&omega, None, None).unwrap();
    column.close().unwrap();
    group.close().unwrap();
    writer.close().unwrap();
    let columns = if kind == 4 { format!("time=t:{unit}") } else { "time=t".to_string() };
    let time = (0..rows).map(|k| (step * k as i64) as f64 * 1e-9).collect();
    (bytes, Truth { columns, time, is_unstated })
}

const FEW: u64 = 1000;

#[test]
fn times_of_a_text_are_read_in_their_unit_or_refused() {
    judge("csv", FEW, text);
}

#[test]
fn times_of_a_parquet_file_are_read_in_their_unit_or_refused() {
    judge("parquet", FEW, columns);
}

/// Reads 100,000 random text files and as many Parquet files, in which the times have different units.
/// `HUBSLOSH_FUZZ_INPUTS` sets another number.
#[test]
#[ignore = "takes long: .ci/fuzz-readers"]
fn no_random_file_is_read_in_a_wrong_unit() {
    let count =
        std::env::var("HUBSLOSH_FUZZ_INPUTS").unwrap_or_default().parse().unwrap_or(100_000);
    judge("csv", count, text);
    judge("parquet", count, columns);
}

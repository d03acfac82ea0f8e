//! Writes the logs of a simulated day on a bench whose equations are independent of the FMU, as input
//! of `hubslosh analyse --bench-day`.
//!
//! ```text
//! cargo run --release -p identify --features studies --example bench_day -- target/day          # 22 sweeps of 45 minutes
//! cargo run --release -p identify --features studies --example bench_day -- target/day short    # 6 sweeps of 450 s
//! hubslosh analyse --bench-day target/day --out dist/day
//! ```

#[path = "../twins/bench.rs"]
#[allow(dead_code, reason = "the twins use the rest of it")]
mod bench;
mod logs;

use std::path::PathBuf;

use anyhow::{Context, Result};
use bench::Liquid;
use experiments::plan::{AMPLITUDES, FILLS};

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let directory: PathBuf = arguments.next().context("usage: bench_day DIRECTORY [short]")?.into();
    std::fs::create_dir_all(&directory)?;
    let whole = logs::Day {
        bias: [1.0, -2.0, 0.5],
        liquid: Liquid::Spherical,
        fills: &FILLS,
        amplitudes: &AMPLITUDES,
        sweep: 2700.0,
        rest: 3600.0,
        friction: true,
        models: "\"linear\", \"spherical\"",
        clock: 0.0,
        lost: 0.0,
    };
    let is_short = arguments.next().is_some_and(|word| word == "short");
    Ok(if is_short { logs::SHORT } else { whole }.write(&directory)?)
}

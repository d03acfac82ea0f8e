//! Runs the calls of one rule for the tests, as `hubslosh` does for `hubslosh check`.

use std::env::args_os;
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result};
use check::process::Unpacked;
use files::bug;
use host::guard;

fn main() -> Result<()> {
    bug::keep_panics();
    let arguments: Vec<_> = args_os().collect();
    let [_, _, _, rule, directory, path, description, limit] = &arguments[..] else {
        anyhow::bail!("this is for the tests of check alone")
    };
    let [rule, limit] = [rule, limit].map(|text| text.to_str().context("not UTF-8"));
    let limit = Duration::try_from_secs_f64(limit?.parse()?)?;
    guard::enter()?;
    let [path, directory, description] = [path, directory, description].map(Path::new);
    check::process::check_in_child(rule?, Unpacked { path, directory, description }, limit)?;
    guard::done(0);
    Ok(())
}

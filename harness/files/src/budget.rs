//! Limits of one command, which are checked before anything is allocated or started, so that a mistyped
//! number gives a message.

use anyhow::{Result, ensure};

/// Largest number of rows of a table, and of steps of a run. At 50 Hz this is a recording of 111
/// hours.
pub const ROWS: usize = 20_000_000;
/// Largest memory that a command may use for numbers at the same time, bytes. The columns of the
/// longest run of the FMU HubSlosh ([`ROWS`] rows) need half of it.
pub const BYTES: u64 = 4 << 30;
/// Largest text file that is read as a whole, bytes, for example a plan or a parameter set. Tables
/// are read in parts, so that they are limited by [`ROWS`] instead.
pub const TEXT: u64 = 64 << 20;
/// Size of the table of numbers that a recording of any file size may contain, bytes: three columns
/// of [`ROWS`] rows. Larger tables must come from a large file, see [`PER_BYTE`].
pub const RECORDING: u64 = 512 << 20;
/// Largest ratio of the size of a table in memory to the size of the file from which it is read,
/// for tables larger than [`RECORDING`]. The ratio is at most 10 in compressed tables that HubSlosh
/// writes; a larger ratio shows that the file is damaged or malicious.
pub const PER_BYTE: u64 = 32;
/// Largest total size of the decompressed pages of a column chunk of a Parquet file (one column in
/// one row group), bytes. Pages whose rows are skipped also count, because they must be
/// decompressed.
pub const INFLATED: u64 = 2 << 30;
pub const RUNS: usize = 100_000;
pub const JOBS: usize = 512;
pub const LINES: usize = 20_000;
/// Largest number of sines that are evaluated for a multisine: the number of frequencies times the
/// number of rows. This takes half a minute.
pub const SINES: u64 = 2_000_000_000;
/// Largest product of rows and frequencies for the frequency responses of one run, because each
/// frequency needs one multiplication in each row. The computation takes about ten seconds at this
/// limit.
pub const PRODUCTS: f64 = 4e9;
/// Highest frequency that a torque may have, Hz. The lowest frequency is the inverse of this
/// number, Hz.
pub const FREQUENCY: f64 = 1e9;
pub const NAME: usize = 200;

/// Returns the number of steps of `step` seconds in `span` seconds. The last step may be shorter
/// than the others.
///
/// # Errors
/// If there are more than [`ROWS`] steps, or a length is not positive and finite.
pub fn steps(span: f64, step: f64) -> Result<usize> {
    ensure!(
        step > 0.0 && step.is_finite(),
        "the step must be a positive number of seconds, not {step}"
    );
    ensure!(
        span > 0.0 && span.is_finite(),
        "the duration must be a positive number of seconds, not {span}"
    );
    let exact = span / step;
    ensure!(
        exact <= ROWS as f64,
        "{span:?} s in steps of {step:?} s are {exact:.3e} steps (allowed: at most {ROWS})"
    );
    // 2700 s / 0.02 s counts as 135000 steps, although the quotient may have a rounding error.
    let whole = (exact - exact.round()).abs() < 1e-6;
    Ok(if whole { exact.round() } else { exact.ceil() } as usize)
}

/// Returns the memory that a table of numbers takes, bytes, so that the caller can refuse it before
/// it allocates.
///
/// # Errors
/// If the table has more than [`ROWS`] rows, or takes more than [`BYTES`].
pub fn table(rows: usize, columns: usize) -> Result<u64> {
    ensure!(rows <= ROWS + 1, "{rows} rows (allowed: at most {ROWS})");
    let bytes = (rows as u64).saturating_mul(columns as u64).saturating_mul(8);
    ensure!(
        bytes <= BYTES,
        "{rows} rows of {columns} columns take {:.1} GB (allowed: at most {:.1} GB); larger steps or \
         fewer columns take less",
        bytes as f64 / 1e9,
        BYTES as f64 / 1e9
    );
    Ok(bytes)
}

/// Returns the memory for a table of numbers that is read from a file of `size` bytes, in bytes. A
/// small file that claims to contain many numbers is damaged or malicious.
///
/// # Errors
/// If [`table`] fails, or the numbers take more than [`RECORDING`] and also more than [`PER_BYTE`]
/// times the size of the file.
pub fn reading(rows: usize, columns: usize, size: u64) -> Result<u64> {
    let bytes = table(rows, columns)?;
    let most = RECORDING.max(size.saturating_mul(PER_BYTE));
    ensure!(
        bytes <= most,
        "{rows} rows of {columns} columns take {:.1} GB in a file of {:.1} MB (allowed: {:.1} GB, or {PER_BYTE} times \
         the size of the file); fewer columns take less",
        bytes as f64 / 1e9,
        size as f64 / 1e6,
        RECORDING as f64 / 1e9
    );
    Ok(bytes)
}

/// Returns the number of threads for jobs that each use `bytes` of memory. The user wants `wanted`
/// jobs at the same time, or as many as the processor has cores if `wanted` is 0. If they would not
/// fit into [`BYTES`], fewer threads are returned.
///
/// # Errors
/// If more than [`JOBS`] jobs are wanted.
pub fn jobs(wanted: usize, bytes: u64) -> Result<usize> {
    ensure!(wanted <= JOBS, "{wanted} runs at once (allowed: 1 to {JOBS})");
    let cores = std::thread::available_parallelism().map_or(1, usize::from).min(JOBS);
    let fitting = usize::try_from(BYTES / bytes.max(1)).unwrap_or(usize::MAX);
    Ok(if wanted == 0 { cores } else { wanted }.min(fitting).max(1))
}

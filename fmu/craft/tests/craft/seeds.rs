//! Choice between all random craft of a test and a few of them.

/// Returns `all` seeds if the environment variable HUBSLOSH_EVERY_SEED is set, which `.ci/long-tests --nightly` does. Otherwise
/// returns only the `few` seeds, so that `cargo test` takes minutes.
pub fn every_or(few: &[u64], all: impl IntoIterator<Item = u64>) -> Vec<u64> {
    match std::env::var_os("HUBSLOSH_EVERY_SEED") {
        Some(_) => all.into_iter().collect(),
        None => few.to_vec(),
    }
}

//! Folders in which Python stores the runs of studies and campaigns, and the random numbers of these runs.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use ::files::input;
use ::files::output;
use ::files::store::{self, CAMPAIGN, Definition, STUDY};
use analysis::random::Random;
use anyhow::{Context, Result, bail};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::{Value, json};
use signals::table;

use crate::fmu::error;

/// Version of the file format of a study. Format 1 has no types and hashes (HubSlosh 0.5.0); format 2 has random
/// numbers of NumPy's generator (0.6.1).
const FORMAT: u32 = 3;

/// Return `count` random numbers, uniform from 0 (included) to 1 (excluded), of stream number `run` for this seed.
#[pyfunction]
pub fn uniforms(seed: u64, run: u64, count: usize) -> Vec<f64> {
    let mut random = Random::new(seed, run);
    (0..count).map(|_| random.uniform()).collect()
}

/// A folder of stored runs. It is locked until `close`, so that no other process writes into it.
#[pyclass(frozen, module = "hubslosh")]
pub struct Store(Mutex<Option<store::Store>>);

impl Store {
    /// Runs `work` on the store without holding Python's lock.
    fn with<T: Send>(
        &self,
        py: Python,
        work: impl FnOnce(&store::Store) -> T + Send,
    ) -> PyResult<T> {
        py.detach(|| {
            let store = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            Ok(work(store.as_ref().context("the folder of the study is closed")?))
        })
        .map_err(|why: anyhow::Error| error(why))
    }
}

#[pymethods]
impl Store {
    /// Open the folder of a Monte Carlo study. `seed` and `ranges` (pairs of a name and a text) define the study; a folder with
    /// another definition is refused.
    #[staticmethod]
    fn study(
        py: Python,
        path: PathBuf,
        seed: u64,
        ranges: Vec<(String, String)>,
    ) -> PyResult<Store> {
        let text = json!({ "format": FORMAT, "seed": seed, "ranges": ranges });
        let store = py.detach(|| {
            let compare =
                |there: &str| differences(there, &text).with_context(|| path.display().to_string());
            let definition = Definition { text: &format!("{text:#}\n"), compare: &compare };
            store::Store::take(&path, STUDY, "monte_carlo", Some(definition))
        });
        Ok(Store(Mutex::new(Some(store.map_err(error)?))))
    }

    /// Open the folder of a campaign. If another program tries to open it meanwhile, it gets the text `about` as the reason for
    /// the refusal.
    #[staticmethod]
    fn campaign(py: Python, path: PathBuf, about: &str) -> PyResult<Store> {
        let store = py.detach(|| store::Store::take(&path, CAMPAIGN, about, None));
        Ok(Store(Mutex::new(Some(store.map_err(error)?))))
    }

    /// Return the bytes of a stored run, and a text that says why they are damaged. The text is None if they are the
    /// bytes that were stored. The bytes are None if the run was never stored or its file cannot be read.
    fn read<'py>(
        &self,
        py: Python<'py>,
        run: &str,
    ) -> PyResult<(Option<Bound<'py, PyBytes>>, Option<String>)> {
        let read = |store: &store::Store| match store.read(run) {
            Ok(bytes) => (bytes, None),
            // The bytes may show what has happened to the file.
            Err(damage) => (input::bytes(&store.run(run)).ok(), Some(damage.to_string())),
        };
        let (bytes, damage) = self.with(py, read)?;
        Ok((bytes.map(|bytes| PyBytes::new(py, &bytes)), damage))
    }

    /// Return the reason why a stored run of a campaign cannot be used, or None if it can be used or was never stored.
    fn damage(&self, py: Python, run: &str) -> PyResult<Option<String>> {
        let found = self.with(py, |store| store.check(run, table::is_ours))?;
        Ok(found.err().map(|damage| damage.to_string()))
    }

    /// Store the bytes of a run. When the call returns, they are on the disk.
    fn add(&self, py: Python, run: &str, content: &[u8]) -> PyResult<()> {
        self.with(py, |store| store.add(run, |path| output::write(path, content)))?.map_err(error)
    }

    /// Write the files that summarise all runs, pairs of a name and bytes, and close the folder.
    fn publish(&self, py: Python, files: Vec<(String, Vec<u8>)>) -> PyResult<()> {
        let store = self.0.lock().unwrap_or_else(PoisonError::into_inner).take();
        py.detach(|| {
            let files = files.iter().map(|(name, bytes)| (name.as_str(), bytes.clone()));
            store.context("the folder of the study is closed")?.publish(files.collect())
        })
        .map_err(error)
    }

    fn close(&self) {
        drop(self.0.lock().unwrap_or_else(PoisonError::into_inner).take());
    }
}

fn differences(there: &str, wanted: &Value) -> Result<()> {
    let there: Value = serde_json::from_str(there)
        .context("study.json is damaged; restore it, or give another folder")?;
    if there == *wanted {
        return Ok(());
    }
    if there["format"] != wanted["format"] {
        bail!(
            "the folder holds a study of another version of HubSlosh, which drew other values; give another folder"
        );
    }
    let ranges =
        |study: &Value| -> Vec<Value> { study["ranges"].as_array().cloned().unwrap_or_default() };
    let (mine, other) = (ranges(wanted), ranges(&there));
    let differ = mine.iter().filter(|range| !other.contains(range));
    let differ = differ.chain(other.iter().filter(|range| !mine.contains(range)));
    let mut names: Vec<&str> = differ.filter_map(|range| range[0].as_str()).collect();
    if there["seed"] != wanted["seed"] {
        names.insert(0, "seed");
    }
    let mut seen = BTreeSet::new();
    names.retain(|name| seen.insert(*name));
    let names = if names.is_empty() { "the order of the names".into() } else { names.join(", ") };
    bail!("the folder holds another study, different in {names}; give another folder")
}

//! Fuzzing of the readers: recordings and tables (CSV, Parquet), parameter sets (SSV), plans, tanks and the data of a
//! run's page. Inputs are valid files with random changes. No input may cause a panic, take more than 10 s, or more
//! than 1 GB of memory.
//!
//! The fuzzer is a plain loop and not libFuzzer, because every reader processes whole files mostly in other crates, all
//! of which would have to be compiled again with coverage. `.ci/fuzz-readers 1000000` makes a million inputs for each
//! reader; the tests here make some hundred. `HUBSLOSH_FUZZ_SEED` sets another seed.

// the module of the command `hubslosh` that reads parameter sets
#[allow(dead_code)]
#[path = "../../src/set_file.rs"]
mod set_file;

/// Replaces the terminal of the command, to which `set_file` writes warnings.
mod terminal {
    pub fn warn(_: impl std::fmt::Display) {}
}

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use experiments::plan::{BUILT_IN, Plan};
use fastrand::Rng;
use host::description::ModelDescription;
use hubslosh_tank::Tank;
use report::view;
use signals::recording::{self, Between, Columns, Signal, Wanted};
use signals::table::{self, Table};

/// Longest time that a reader may take for one input, s.
const LIMIT: u64 = 10;
const MEMORY: u64 = 1_000_000;

const TOKENS: [&str; 22] = [
    "1e308",
    "-1e308",
    "1e-308",
    "nan",
    "inf",
    "-0",
    "0",
    "1e12",
    "99999999999999999999",
    "\"",
    ",",
    ";",
    "\n",
    "=",
    "[",
    "]",
    "{",
    "}",
    "<",
    "°",
    "2026-01-31T12:00:00Z",
    "../",
];

fn mutated(seeds: &[Vec<u8>], dice: &mut Rng) -> Vec<u8> {
    let mut bytes = seeds[dice.usize(..seeds.len())].clone();
    for _ in 0..dice.usize(1..6) {
        if bytes.is_empty() {
            return bytes;
        }
        let at = dice.usize(..bytes.len());
        let end = (at + dice.usize(1..64)).min(bytes.len());
        match dice.u8(..9) {
            0 | 1 => bytes[at] = dice.u8(..),
            2 => bytes[at] ^= 1 << dice.u8(..8),
            3 => drop(bytes.drain(at..end)),
            4 => {
                let copy = bytes[at..end].to_vec();
                bytes.splice(at..at, copy);
            }
            5 => {
                let token = TOKENS[dice.usize(..TOKENS.len())].bytes();
                bytes.splice(at..at, token);
            }
            6 => {
                let words = [0_u32, 1, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, dice.u32(..)];
                let word = words[dice.usize(..words.len())].to_le_bytes();
                for (byte, new) in bytes[at..].iter_mut().zip(word) {
                    *byte = new;
                }
            }
            7 => bytes.truncate(at),
            _ => {
                let other = &seeds[dice.usize(..seeds.len())];
                let from = dice.usize(..other.len());
                let to = (from + dice.usize(1..256)).min(other.len());
                bytes.splice(at..end, other[from..to].iter().copied());
            }
        }
    }
    bytes
}

fn memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|rest| rest.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}

fn keep(name: &str, ending: &str, bytes: &[u8]) -> PathBuf {
    let path = std::env::temp_dir().join(format!("hubslosh-fuzz-{name}.{ending}"));
    std::fs::write(&path, bytes).unwrap();
    path
}

fn fuzz(
    name: &'static str,
    ending: &'static str,
    seeds: &[Vec<u8>],
    count: u64,
    read: impl Fn(&Path, &[u8]),
) {
    let seed = std::env::var("HUBSLOSH_FUZZ_SEED").ok().and_then(|seed| seed.parse().ok());
    let mut dice = Rng::with_seed(seed.unwrap_or(1));
    // Panics that a reader catches itself become errors, which need no backtrace each.
    files::bug::keep_panics();
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(format!("input.{ending}"));
    // the start time and the present input, for the thread that checks the time limit
    let (began, now) = (Instant::now(), Arc::new((AtomicU64::new(0), Mutex::new(Vec::new()))));
    let watched = now.clone();
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_millis(500));
            let since = watched.0.load(Ordering::SeqCst);
            if since > 0 && began.elapsed().as_secs() > since + LIMIT {
                let path = keep(name, ending, &watched.1.lock().unwrap());
                eprintln!("{name}: an input takes more than {LIMIT} s: {}", path.display());
                std::process::abort();
            }
        }
    });
    for _ in 0..count {
        let bytes = mutated(seeds, &mut dice);
        // A new file is created, because some file systems write a replaced file to the disk immediately.
        let _ = std::fs::remove_file(&path);
        std::fs::write(&path, &bytes).unwrap();
        now.1.lock().unwrap().clone_from(&bytes);
        now.0.store(began.elapsed().as_secs() + 1, Ordering::SeqCst);
        if let Err(panic) = files::bug::catch_panic(|| read(&path, &bytes)) {
            let kept = keep(name, ending, &bytes);
            eprintln!("{name}: {panic}: {}", kept.display());
            panic!("{name}: {panic}: {}", kept.display());
        }
        now.0.store(0, Ordering::SeqCst);
        if memory() > MEMORY {
            panic!("{name}: {} kB of memory: {}", memory(), keep(name, ending, &bytes).display());
        }
    }
    println!(
        "{name}: {count} inputs in {:.0} s, {} MB",
        began.elapsed().as_secs_f64(),
        memory() / 1000
    );
}

fn description() -> ModelDescription {
    let xml = include_str!("../../../../modelDescription/HubSlosh/modelDescription.xml");
    ModelDescription::from_xml(xml).unwrap()
}

fn files(folder: &str, ending: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(folder);
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let of_kind = paths.iter().filter(|path| path.extension().is_some_and(|e| e == ending));
    of_kind.map(|path| std::fs::read(path).unwrap()).collect()
}

fn recording_of(path: &Path, columns: &str) {
    let signal = |name, required| Signal { name, required, between: Between::Held, unit: None };
    let signals = [signal("omega", true), signal("tau_cmd", false), signal("theta", false)];
    let columns: Columns = columns.parse().unwrap();
    let wanted = Wanted { signals: &signals, columns: &columns };
    let found = recording::read_here(path, path, &wanted, &mut |_| {});
    if let Ok(Some(table)) = found {
        let _ = recording::even(table, &mut |_| {});
    }
}

fn table_of(path: &Path) {
    let _ = table::names(path);
    let _ = Table::read(path, &["time", "omega"]);
}

fn csv(count: u64) {
    let texts = [
        "time,tau_cmd,omega\n0,0.1,0\n0.02,0.25,1\n0.04,-0.3,-1.5\n0.06,0,2\n",
        "t [ms];T;omega\r\nms;mN·m;°/s\r\n0;100;0\r\n20;250;1\r\n40;-300;-1,5\r\n",
        "# bench\ntime\ttau_cmd\tomega\n2026-01-31T23:59:59.990Z\t1\t0\n2026-02-01T00:00:00.010Z\t2\t1\n",
        "\"time\",\"omega\"\n\"0\",\"1,5\"\n\"1\",\"\"\n\"2\",\"3\"\n",
        "Channels\t2\t\nY_Unit_Label\tmN.m\tdeg/s\t\ntime\ttau_cmd\tomega\tComment\n0\t0\t1\tbegin\n1\t0\t2\n",
        "name,time,tau_cmd,omega\nunit,ms,mNm,deg/s\ntrace_values,0,100,0\n,20,250,1\n,40,-300,-1.5\n",
        "\"time\" \"omega\" \"state\"\n\"1\" 0 1.5 \"slow sweep\"\n\"2\" 1 2 NA\n",
        "3,-1.2\n[12:00:00.020] 1,2,3\n12:00:00.040 -> 1,2,3\n12:00:00.060 1,2,3\n",
        "FMT, 128, 89, FMT, BBnNZ, Type,Length\nIMU, 20, 0, 0.1, 1\nATT, 20, 0.1\nIMU, 40, 0, 0.1, 1\nATT, 40, 0.1\n",
    ];
    let seeds: Vec<Vec<u8>> = texts.iter().map(|text| text.as_bytes().to_vec()).collect();
    fuzz("csv", "csv", &seeds, count, |path, _| {
        recording_of(path, "");
        table_of(path);
    });
}

fn parquet(count: u64) {
    let seeds = files("harness/signals/tests/all/data", "parquet");
    fuzz("parquet", "parquet", &seeds, count, |path, _| {
        recording_of(path, "");
        table_of(path);
        let _ = table::metadata(path);
    });
}

fn ssv(count: u64) {
    let text = "<?xml version=\"1.0\"?>\n<ssv:ParameterSet version=\"1.0\" name=\"p\" \
        xmlns:ssv=\"http://ssp-standard.org/SSP1/SystemStructureParameterValues\" \
        xmlns:ssc=\"http://ssp-standard.org/SSP1/SystemStructureCommon\"><ssv:Parameters>\
        <ssv:Parameter name=\"tank.h\"><ssv:Real value=\"50\" unit=\"mm\"/></ssv:Parameter>\
        <ssv:Parameter name=\"friction.b\"><ssv:Real value=\"1\" unit=\"u\"/></ssv:Parameter></ssv:Parameters>\
        <ssv:Units><ssc:Unit name=\"u\"><ssc:BaseUnit kg=\"1\" m=\"2\" s=\"-1\" rad=\"-1\" factor=\"0.001\"/></ssc:Unit>\
        </ssv:Units></ssv:ParameterSet>";
    let description = description();
    fuzz("ssv", "ssv", &[text.into()], count, |path, _| {
        if let Ok(settings) = set_file::read(path, &|| Ok(description.clone())) {
            for (name, value) in settings {
                let _ = description.variable(&name).and_then(|v| description.value(v, &value));
            }
        }
    });
}

fn plan(count: u64) {
    let seeds: Vec<Vec<u8>> = BUILT_IN.iter().map(|(_, text)| text.as_bytes().to_vec()).collect();
    let description = description();
    fuzz("plan", "toml", &seeds, count, |_, bytes| {
        if let Ok(plan) = Plan::parse(&String::from_utf8_lossy(bytes)) {
            let _ = plan.cases(&description);
        }
    });
}

fn tank(count: u64) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tank/examples");
    let seeds = files("harness/tank/examples", "toml");
    fuzz("tank", "toml", &seeds, count, |_, bytes| {
        let _ = Tank::parse(&String::from_utf8_lossy(bytes), &folder);
    });
}

fn page(count: u64) {
    let text = "time,omega,slosh_angle,slosh_angle_radial,tau_cmd,theta\n0,0.1,0,0,0.1,0\n0.02,0.1,0.1,0.1,0,0.1\n0.04,0,0.2,0,0,0.2\n";
    let description = description();
    fuzz("page", "csv", &[text.into()], count, |path, bytes| {
        let Ok(names) = table::names(path) else { return };
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let Ok(table) = Table::read(path, &names) else { return };
        let pairs = String::from_utf8_lossy(bytes);
        let parameters: BTreeMap<String, String> = pairs
            .split(',')
            .zip(pairs.split('\n'))
            .map(|(name, value)| (name.to_string(), value.to_string()))
            .chain([("tank.h".to_string(), pairs.chars().skip(60).take(4).collect())])
            .collect();
        let run = view::Run {
            title: pairs.chars().take(40).collect(),
            source: pairs.chars().rev().take(40).collect(),
            description: &description,
            parameters: &parameters,
            parameters_known: true,
            drawings: &BTreeMap::new(),
            table: &table,
        };
        let _ = view::page(&run);
    });
}

const FEW: u64 = 300;

macro_rules! targets {
    ($($name:ident $test:ident),*) => {$(
        #[test]
        fn $test() {
            $name(FEW);
        }
    )*

        /// Fuzzes the readers that the environment variable HUBSLOSH_FUZZ_TARGETS names, or all of
        /// them. HUBSLOSH_FUZZ_INPUTS is the number of inputs for each reader.
        #[test]
        #[ignore = "takes long: .ci/fuzz-readers"]
        fn no_random_change_of_a_file_makes_a_reader_crash_or_hang() {
            let count = std::env::var("HUBSLOSH_FUZZ_INPUTS").unwrap_or_default().parse().unwrap_or(100_000);
            let chosen = std::env::var("HUBSLOSH_FUZZ_TARGETS").unwrap_or_default();
            $(if chosen.is_empty() || chosen.split(' ').any(|name| name == stringify!($name)) {
                $name(count);
            })*
        }
    };
}

targets!(
    csv a_damaged_csv_file_is_an_error_at_worst,
    parquet a_damaged_parquet_file_is_an_error_at_worst,
    ssv a_damaged_parameter_set_is_an_error_at_worst,
    plan a_damaged_plan_is_an_error_at_worst,
    tank a_damaged_tank_is_an_error_at_worst,
    page a_damaged_run_is_an_error_at_worst
);

//! Checks the invariants of ARCHITECTURE.md that the compiler does not enforce.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::Command;

use cargo_metadata::{DependencyKind, MetadataCommand};

use crate::common::run;

fn dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let metadata =
        MetadataCommand::new().current_dir(pack::root()).no_deps().exec().expect("cargo metadata");
    let linked = |package: &cargo_metadata::Package| {
        let normal = package.dependencies.iter().filter(|d| d.kind == DependencyKind::Normal);
        normal.map(|d| d.name.clone()).collect()
    };
    metadata.packages.iter().map(|package| (package.name.to_string(), linked(package))).collect()
}

#[test]
fn the_physics_does_not_depend_on_fmi_or_the_runtime_on_physics() {
    let all = dependencies();
    for physics in ["plant", "craft"] {
        let of_both = BTreeSet::from(["formulas".into(), "libm".into(), "taylor".into()]);
        assert_eq!(all[physics], of_both, "{physics}");
    }
    for core in ["formulas", "taylor"] {
        assert_eq!(all[core], BTreeSet::from(["libm".into()]), "{core}");
    }
    assert_eq!(all["runtime"], BTreeSet::new());
}

/// The test looks for `#![no_std]` in each crate. The compiler does the rest: a crate with this attribute that uses the
/// standard library does not compile.
#[test]
fn the_models_and_their_dependencies_need_no_standard_library() {
    for krate in ["formulas", "taylor", "plant", "craft"] {
        let file = pack::root().join("fmu").join(krate).join("src/lib.rs");
        let text = fs::read_to_string(file).expect("a crate's root");
        let is_free = ["#![no_std]", "#![cfg_attr(not(test), no_std)]"];
        assert!(text.lines().any(|line| is_free.contains(&line)), "{krate}");
        assert!(!text.contains("extern crate std"), "{krate}");
    }
}

/// The packages of the harness, each with the packages of the workspace that it may link. Of the packages in `fmu/` only
/// `formulas` is allowed, because it contains no model.
const HARNESS: [(&str, &[&str]); 15] = [
    ("files", &[]),
    ("names", &["formulas"]),
    ("host", &["files"]),
    ("signals", &["files"]),
    ("fourier", &[]),
    ("check", &["files", "host"]),
    ("analysis", &["fourier"]),
    ("experiments", &["files", "formulas", "fourier", "host", "names", "signals", "analysis"]),
    ("web", &[]),
    ("pack", &["files", "host"]),
    ("report", &["formulas", "host", "names", "signals", "analysis", "experiments", "web"]),
    (
        "identify",
        &[
            "files",
            "formulas",
            "fourier",
            "host",
            "names",
            "signals",
            "analysis",
            "experiments",
            "report",
        ],
    ),
    ("hubslosh-tank", &["formulas", "names"]),
    ("hubslosh-native", &["analysis", "files", "host", "hubslosh-tank", "names", "signals"]),
    (
        "hubslosh",
        &[
            "files",
            "formulas",
            "host",
            "names",
            "signals",
            "check",
            "pack",
            "analysis",
            "experiments",
            "report",
            "identify",
            "hubslosh-tank",
        ],
    ),
];

#[test]
fn the_harness_never_links_a_model_and_its_packages_have_no_cyclic_dependencies() {
    let all = dependencies();
    for (package, allowed) in HARNESS {
        let own = all[package].iter().map(String::as_str).filter(|name| all.contains_key(*name));
        assert_eq!(own.collect::<BTreeSet<_>>(), allowed.iter().copied().collect(), "{package}");
    }
    let harness = pack::root().join("harness");
    for folder in fs::read_dir(harness).expect("the harness").flatten() {
        if let Ok(manifest) = fs::read_to_string(folder.path().join("Cargo.toml")) {
            let named =
                |(package, _): &(&str, _)| manifest.contains(&format!("name = \"{package}\""));
            assert!(HARNESS.iter().any(named), "{} is not in the list", folder.path().display());
        }
    }
}

/// With further features, `cargo run`, a test that builds the program, and `pack::build_native` would compile packages again
/// that `cargo test` has already compiled.
#[test]
fn tests_and_the_python_package_enable_no_further_features_of_the_program_s_dependencies() {
    let packages = |edges: &str, selection: &[&str]| -> BTreeSet<String> {
        let mut tree = Command::new(env!("CARGO"));
        tree.current_dir(pack::root()).args(["tree", "--locked", "--offline", "--edges", edges]);
        tree.args(selection);
        tree.args(["--prefix", "none", "--no-dedupe", "--format", "{p}: {f};"]);
        let said = run(&mut tree, "cargo does not say what this is made of");
        said.lines().filter_map(|line| Some(line.split_once(';')?.0.into())).collect()
    };
    let name = |package: &String| package.split(": ").next().unwrap_or_default().to_string();
    let program = packages("normal,build", &[]);
    let names: BTreeSet<String> = program.iter().map(name).collect();
    let mut tested = packages("normal,build,dev", &[]);
    tested.retain(|package| names.contains(&name(package)));
    assert!(names.len() > 100);
    assert_eq!(tested, program);
    let both = ["--package", "hubslosh", "--package", "hubslosh-native"];
    let native = packages("normal,build", &both);
    let more: Vec<&String> = native.difference(&program).collect();
    assert!(more.is_empty(), "{more:?}");
}

#[test]
fn only_the_command_line_package_prints_progress() {
    for (package, dependencies) in dependencies() {
        assert!(package == "hubslosh" || !dependencies.contains("indicatif"), "{package}");
    }
}

#[test]
fn unsafe_code_is_only_in_the_files_of_the_c_interface() {
    let root = pack::root();
    let mut found = Vec::new();
    collect(&root, &root, &mut found);
    let lifted = format!("allow({}", "unsafe_code)");
    found.retain(|file| {
        file.ends_with(".rs")
            && fs::read_to_string(root.join(file))
                .expect("a source file")
                .lines()
                .any(|line| line.trim_start().starts_with('#') && line.contains(&lifted))
    });
    let found: BTreeSet<String> = found.into_iter().collect();
    let known = [
        "fmu/fuzz/src/calls.rs",
        "fmu/runtime/src/c_abi.rs",
        "fmu/runtime/src/tests/v3.rs",
        "fmu/runtime/src/tests/v3_arrays.rs",
        "fmu/runtime/src/v2.rs",
        "fmu/runtime/src/v3.rs",
        "fmu/runtime/src/v3/dependencies.rs",
        "fmu/runtime/src/v3/derivatives.rs",
        "fmu/runtime/src/v3/life.rs",
        "fmu/runtime/src/v3/model_exchange.rs",
        "fmu/runtime/src/v3/stepping.rs",
        "fmu/runtime/src/v3/values.rs",
        "harness/host/src/c_abi.rs", // this file and its submodules
        "harness/host/src/fmi2.rs",  // this file and its submodules
        "harness/host/src/fmi3.rs",
        "harness/native/src/instance.rs",
        "harness/native/src/numbers.rs",
    ];
    assert_eq!(found, known.map(String::from).into());
}

/// `cargo test` skips ignored tests, so that a script in `.ci` must run each of them. `.ci/long-tests` runs all ignored tests
/// except those whose names contain a part that is listed for the nightly script or for `.ci/fuzz-readers`; the reason of an
/// ignored test names its script. Each listed part must belong to a test, because `cargo test` also succeeds if it finds no
/// test.
#[test]
fn a_script_runs_every_test_that_is_ignored() {
    let root = pack::root();
    let script = fs::read_to_string(root.join(".ci/long-tests")).expect("the script");
    let list = |name: &str| -> Vec<&str> {
        let text = script.split(&format!("\n{name}=(")).nth(1).expect("a list of the script");
        text.split(')').next().expect("its end").split_whitespace().collect()
    };
    let (nightly, readers) = (list("nightly"), list("readers"));
    let fuzz = fs::read_to_string(root.join(".ci/fuzz-readers")).expect("the script");
    let has = |words: &[&str], name: &str| words.iter().any(|word| name.contains(word));
    let mut files = Vec::new();
    collect(&root, &root, &mut files);
    let ignored = format!("#[{}", "ignore");
    let mut names = Vec::new();
    for file in files.iter().filter(|file| file.ends_with(".rs")) {
        let text = fs::read_to_string(root.join(file)).expect("a source file");
        for after in text.split(&ignored).skip(1) {
            let name = after.split("fn ").nth(1).and_then(|rest| rest.split('(').next());
            let name = name.expect("a test after its attribute");
            let reason = after.split(']').next().expect("the end of the attribute");
            let (is_nightly, is_reader) = (has(&nightly, name), has(&readers, name));
            let runs_it = if reason.contains(": .ci/long-tests") {
                !is_nightly && !is_reader
            } else if reason.contains(": .ci/run --nightly") {
                is_nightly
            } else {
                reason.contains(": .ci/fuzz-readers") && is_reader && fuzz.contains(name)
            };
            assert!(runs_it, "{file}: {name}: the script that the reason names does not run it");
            names.push(name.to_string());
        }
    }
    assert!(names.len() > 10, "{names:?}");
    let all = [nightly, readers].concat();
    let stale: Vec<&&str> =
        all.iter().filter(|word| !names.iter().any(|name| name.contains(**word))).collect();
    assert!(stale.is_empty(), "no ignored test has these words in its name: {stale:?}");
}

/// ARCHITECTURE.md and the page of decisions name a file by its path from the root or by the end of this path.
#[test]
fn source_files_named_in_the_architecture_exist() {
    let text: String = ["ARCHITECTURE.md", "book/decisions.md"]
        .map(|page| fs::read_to_string(pack::root().join(page)).expect("a page"))
        .concat();
    let is_file =
        |name: &&str| [".rs", ".py", ".js", ".c", ".h"].iter().any(|ending| name.ends_with(ending));
    let named: BTreeSet<&str> = text.split('`').skip(1).step_by(2).filter(is_file).collect();
    assert!(named.len() > 60, "{named:?}");
    let mut files = Vec::new();
    collect(&pack::root(), &pack::root(), &mut files);
    let is_there = |name: &str| {
        files.iter().any(|f| f.strip_suffix(name).is_some_and(|f| f.is_empty() || f.ends_with('/')))
    };
    let missing: Vec<&&str> = named.iter().filter(|name| !is_there(name)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

/// Two entries with the same beginning are two wordings of one change, which can happen in a merge.
#[test]
fn each_change_has_one_entry_in_the_changelog() {
    let text = fs::read_to_string(pack::root().join("CHANGELOG.md")).expect("the changelog");
    let versions = text.split("\n## ").skip(1);
    for version in versions {
        let mut beginnings = BTreeSet::new();
        for entry in version.lines().filter(|line| line.starts_with("* ")) {
            let beginning: String = entry.chars().take(60).collect();
            assert!(beginnings.insert(beginning), "two entries begin like this one: {entry}");
        }
    }
}

#[test]
fn tests_named_in_comments_on_tuning_constants_exist() {
    let mut files = Vec::new();
    collect(&pack::root(), &pack::root().join("harness/identify"), &mut files);
    let read = |name: &str| fs::read_to_string(pack::root().join(name)).expect("a source file");
    let code: String = files.iter().filter(|f| f.ends_with(".rs")).map(|f| read(f)).collect();
    let tuning = read("harness/identify/src/tuning.rs");
    let named = tuning.lines().filter(|line| line.starts_with("// Tests: "));
    let named: Vec<&str> = named.flat_map(|line| line.split('`').skip(1).step_by(2)).collect();
    assert!(named.len() > 30, "{named:?}");
    let is_there = |name: &&&str| match name.contains('/') {
        true => pack::root().join(name).is_file(),
        false => code.contains(&format!("fn {name}()")),
    };
    let missing: Vec<&&str> = named.iter().filter(|name| !is_there(name)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

fn collect(root: &Path, folder: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).expect("a folder of the project").flatten() {
        let path = entry.path();
        let name = entry.file_name();
        if path.is_dir() && name != "target" && !name.to_string_lossy().starts_with('.') {
            collect(root, &path, found);
        } else if path.is_file() {
            let relative = path.strip_prefix(root).expect("below the root");
            found.push(relative.to_string_lossy().replace('\\', "/"));
        }
    }
}

/// Lists the functions in the `code` of a file of the harness whose errors are plain texts, each with the name of the `file`.
fn textual_errors(file: &str, code: &str) -> Vec<String> {
    let tokens = tokens(code);
    let mut found = Vec::new();
    for at in 0..tokens.len() {
        if tokens[at] != "Result" || tokens.get(at + 1) != Some(&"<") {
            continue;
        }
        // Collect the arguments of the type, each as a list of tokens.
        let (mut depth, mut arguments) = (1, vec![Vec::new()]);
        for token in &tokens[at + 2..] {
            depth += i32::from(matches!(*token, "<" | "(" | "["));
            depth -= i32::from(matches!(*token, ">" | ")" | "]"));
            match (depth, *token) {
                (0, _) => break,
                (1, ",") => arguments.push(Vec::new()),
                (_, token) => arguments.last_mut().expect("it begins with one").push(token),
            }
        }
        let is_text = |error: &Vec<&str>| {
            matches!(
                error[..],
                ["String"]
                    | ["&", "str"]
                    | ["&", "'", _, "str"]
                    | ["Cow", ..]
                    | ["Vec", "<", "String", ">"]
            )
        };
        if arguments.get(1).is_some_and(is_text) {
            found.push(format!(
                "{file}: Result<{}, {}>",
                arguments[0].concat(),
                arguments[1].concat()
            ));
        }
    }
    let texts = tokens.windows(4).filter(|window| window[..3] == ["type", "Err", "="]);
    found.extend(texts.filter(|window| window[3] == "String").map(|_| format!("{file}: type Err")));
    found
}

#[test]
fn functions_of_the_harness_return_typed_errors_and_no_texts() {
    let mut found = Vec::new();
    for krate in ONE_WAY.iter().filter(|krate| krate.starts_with("harness/")) {
        let mut all = BTreeMap::new();
        sources(&pack::root().join(krate).join("src"), &[], &mut all);
        for (module, code) in all {
            found.extend(textual_errors(&format!("{krate}/{}", module.join("/")), &code));
        }
    }
    assert!(found.is_empty(), "a type with thiserror, or anyhow: {found:#?}");
}

#[test]
fn errors_made_from_text_are_found_in_every_form() {
    for code in [
        "fn f() -> Result<f64, String> {",
        "fn f() -> anyhow::Result<Result<(), &'static str>> {",
        "fn f(\n    a: f64,\n) -> Result<\n    Vec<(f64, f64)>,\n    String,\n> {",
        "binary: Result<Binary, Vec<String>>,",
        "type Err = String;",
    ] {
        assert_eq!(textual_errors("a", code).len(), 1, "{code}");
    }
    for code in
        ["Result<String>", "Result<(String, String), Fault>", "Result<Result<String>, Fault>"]
    {
        assert_eq!(textual_errors("a", code), [""; 0], "{code}");
    }
}

const ONE_WAY: [&str; 25] = [
    "fmu/plant",
    "fmu/craft",
    "fmu/formulas",
    "fmu/taylor",
    "fmu/runtime",
    "fmu/hubslosh",
    "fmu/spacecraft",
    "fmu/sloshtank",
    "fmu/tank_variables",
    "fmu/fuzz",
    "modelDescription",
    "harness/files",
    "harness/names",
    "harness/host",
    "harness/signals",
    "harness/fourier",
    "harness/check",
    "harness/pack",
    "harness/analysis",
    "harness/experiments",
    "harness/report",
    "harness/identify",
    "harness/tank",
    "harness/cli",
    "harness/native",
];

/// A module, as its path within the crate, for example `["methods", "page"]`. The root of the crate is `[]`.
type Module = Vec<String>;

/// Collects the modules of a crate below `folder`, which belongs to `module`, with their code in `all`. Comments, and tests
/// inside the files, are left out.
fn sources(folder: &Path, module: &[String], all: &mut BTreeMap<Module, String>) {
    for entry in fs::read_dir(folder).expect("a folder of modules").flatten() {
        let path = entry.path();
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut inner = module.to_vec();
        if path.is_dir() {
            inner.push(name);
            sources(&path, &inner, all);
        } else if path.extension().is_some_and(|e| e == "rs") {
            if !matches!(name.as_str(), "lib" | "main" | "mod") {
                inner.push(name);
            }
            let file = fs::read_to_string(&path).expect("a source file");
            let tests = ["#[cfg(test)]", "#[cfg(all(test"].map(|mark| file.find(mark));
            let code = &file[..tests.into_iter().flatten().min().unwrap_or(file.len())];
            let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
            all.entry(inner).or_default().extend(lines.flat_map(|line| [line, "\n"]));
        }
    }
}

/// Splits Rust code into words, `::` and other signs, without white space.
fn tokens(code: &str) -> Vec<&str> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let (mut found, mut rest) = (Vec::new(), code.trim_start());
    while let Some(first) = rest.chars().next() {
        let length = match first {
            _ if is_word(first) => rest.find(|c| !is_word(c)).unwrap_or(rest.len()),
            _ if rest.starts_with("::") => 2,
            _ => first.len_utf8(),
        };
        let (token, after) = rest.split_at(length);
        found.push(token);
        rest = after.trim_start();
    }
    found
}

/// Collects every path of the import tree that begins at `tokens[0]`: with the base `[]`, `a::{b, c::d as e}` has the paths
/// `a::b` and `a::c::d`. Returns the number of tokens of the tree.
fn paths(tokens: &[&str], base: &Module, found: &mut Vec<Module>) -> usize {
    let mut taken = 1;
    match tokens.first() {
        Some(&"{") => {
            while tokens.get(taken).is_some_and(|token| *token != "}") {
                taken += match tokens[taken] {
                    "," => 1,
                    "as" => 2,
                    _ => paths(&tokens[taken..], base, found),
                };
            }
            taken + 1
        }
        Some(name) => {
            let path: Module = base.iter().cloned().chain([name.to_string()]).collect();
            match tokens.get(1) {
                Some(&"::") => 2 + paths(&tokens[2..], &path, found),
                _ => {
                    found.push(path);
                    1
                }
            }
        }
        None => 0,
    }
}

/// Lists the paths, from the root of the crate, that the `code` of a module names with `crate::`, `self::` and `super::`.
fn named(module: &Module, code: &str) -> Vec<Module> {
    let (tokens, mut found) = (tokens(code), Vec::new());
    for at in 0..tokens.len() {
        let mut base = match tokens[at] {
            "crate" => Module::new(),
            "self" => module.clone(),
            "super" => module[..module.len().saturating_sub(1)].to_vec(),
            _ => continue,
        };
        if at > 0 && tokens[at - 1] == "::" || tokens.get(at + 1) != Some(&"::") {
            continue;
        }
        let mut rest = &tokens[at + 2..];
        while let ["super", "::", after @ ..] = rest {
            base.pop();
            rest = after;
        }
        paths(rest, &base, &mut found);
    }
    found
}

/// Maps names that modules import to the paths for which they stand. An inner module uses such a name as `super::Name`; other
/// modules use it if it is re-exported.
fn imported(sources: &BTreeMap<Module, String>) -> BTreeMap<Module, Module> {
    let mut all = BTreeMap::new();
    for (module, code) in sources {
        let tokens = tokens(code);
        for at in (0..tokens.len()).filter(|at| tokens[*at] == "use") {
            let mut found = Vec::new();
            let relative = tokens.get(at + 1).is_some_and(|first| {
                let inner: Module = module.iter().cloned().chain([first.to_string()]).collect();
                sources.keys().any(|other| other.starts_with(&inner))
            });
            if relative {
                paths(&tokens[at + 1..], module, &mut found);
            } else {
                let end = tokens[at..].iter().position(|token| *token == ";");
                found = named(module, &tokens[at + 1..at + end.unwrap_or(1)].join(" "));
            }
            for path in found {
                let name: Module = module.iter().chain(path.last()).cloned().collect();
                // A function may have the name of its module.
                if !path.starts_with(&name) {
                    all.insert(name, path);
                }
            }
        }
    }
    all
}

/// Follows a path through the imports of the modules that it names to the item that it means.
fn resolved(mut path: Module, imported: &BTreeMap<Module, Module>) -> Module {
    let mut seen = BTreeSet::new();
    while seen.insert(path.clone()) {
        let import = (1..=path.len()).find_map(|n| Some((n, imported.get(&path[..n])?)));
        if let Some((n, target)) = import {
            path = target.iter().chain(&path[n..]).cloned().collect();
        }
    }
    path
}

/// For each folder of a crate, returns its modules (a subfolder counts as one module), each with the modules of the same
/// folder that it uses, directly or through an import of another module. Items that are defined in `mod.rs` or `lib.rs`
/// belong to the folder and do not count.
fn modules(
    sources: &BTreeMap<Module, String>,
) -> BTreeMap<Module, BTreeMap<String, BTreeSet<String>>> {
    let mut all: BTreeMap<Module, BTreeMap<String, BTreeSet<String>>> = BTreeMap::new();
    let imported = imported(sources);
    for (module, code) in sources {
        let paths = named(module, code).into_iter();
        for path in paths.flat_map(|path| [resolved(path.clone(), &imported), path]) {
            let common = module.iter().zip(&path).take_while(|(a, b)| a == b).count();
            let (folder, own, other) = (&path[..common], module.get(common), path.get(common));
            let is_module = |name: &&String| {
                sources.keys().any(|m| m.starts_with(folder) && m.get(common) == Some(name))
            };
            if let (Some(own), Some(other)) = (own, other.filter(is_module)) {
                let beside = all.entry(folder.to_vec()).or_default();
                beside.entry(own.clone()).or_default().insert(other.clone());
                beside.entry(other.clone()).or_default();
            }
        }
    }
    all
}

fn circles(mut left: BTreeMap<String, BTreeSet<String>>) -> BTreeMap<String, BTreeSet<String>> {
    // A module that uses no remaining module is not part of a cycle.
    while let Some(leaf) =
        left.iter().find(|(_, used)| used.is_empty()).map(|(name, _)| name.clone())
    {
        left.remove(&leaf);
        left.values_mut().for_each(|used| {
            used.remove(&leaf);
        });
    }
    left
}

/// Crates in which modules must import an item from the module that defines it, and not through a re-export of the crate's
/// root. The root imports every module, so that a module that imports from the root would be in a cycle with it.
const NAMED_AT_HOME: [&str; 17] = [
    "fmu/plant",
    "fmu/craft",
    "fmu/formulas",
    "fmu/hubslosh",
    "fmu/spacecraft",
    "fmu/sloshtank",
    "harness/files",
    "harness/host",
    "harness/signals",
    "harness/check",
    "harness/analysis",
    "harness/cli",
    "harness/identify",
    "harness/experiments",
    "harness/report",
    "harness/tank",
    "harness/native",
];

#[test]
fn modules_do_not_import_from_the_root_of_their_crate() {
    for krate in NAMED_AT_HOME {
        let mut all = BTreeMap::new();
        sources(&pack::root().join(krate).join("src"), &[], &mut all);
        let is_module = |name: &String| all.keys().any(|module| module.first() == Some(name));
        for (module, code) in all.iter().filter(|(module, _)| !module.is_empty()) {
            let mut from_root = named(module, code);
            from_root.retain(|path| path.first().is_some_and(|name| !is_module(name)));
            assert!(from_root.is_empty(), "{krate}: {module:?} imports {from_root:?}");
        }
    }
}

#[test]
fn modules_of_a_crate_have_no_cyclic_dependencies() {
    for krate in ONE_WAY {
        let mut all = BTreeMap::new();
        sources(&pack::root().join(krate).join("src"), &[], &mut all);
        for (folder, beside) in modules(&all) {
            let left = circles(beside);
            let folder = folder.join("/");
            assert!(left.is_empty(), "{krate}/src/{folder}: in a circle or above one: {left:?}");
        }
    }
}

#[test]
fn circular_imports_are_found_in_every_form_of_an_import() {
    let crate_of = |files: &[(&str, &str)]| -> BTreeMap<Module, String> {
        let module =
            |path: &str| path.split('/').filter(|s| !s.is_empty()).map(String::from).collect();
        files.iter().map(|(path, code)| (module(path), code.to_string())).collect()
    };
    let by_ways = [
        "use crate::one::first::A;",
        "use super::first::A;",
        "use super::{Kept, first::{self, A as B}};",
        "use crate::{two, one::{Kept, first}};",
        "fn f() { super::super::one::first::g() }",
        "html! { p { (super::first::text()) } }",
        "use super::A;",
        "use crate::one::{Kept, A};",
        "use crate::A;",
    ];
    for way in by_ways {
        let files = [
            ("", "pub use self::one::A;"),
            ("one", "mod first; mod second; pub use first::{A, B};"),
            ("one/first", "use super::second::C;"),
            ("one/second", way),
            ("two", ""),
        ];
        let found = modules(&crate_of(&files)).remove(&vec!["one".into()]).unwrap_or_default();
        assert_eq!(circles(found).len(), 2, "{way}");
    }
    // one/first names one/second, and one/second names an item of their common folder: this is no cycle.
    let files = [("one/first", "use super::second::C;"), ("one/second", "use super::Kept;")];
    assert!(modules(&crate_of(&files)).into_values().all(|beside| circles(beside).is_empty()));
}

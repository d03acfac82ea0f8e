//! The words of README, documentation, command line, messages, descriptions of variables, report,
//! plans, Python and notebooks: those of textbooks, standards and well-known tools.

use std::path::{Path, PathBuf};
use std::process::Command;

use host::description::ModelDescription;

/// A word that no textbook uses for it, the field's word, and what is not meant.
const WORDS: &[(&str, &str)] = &[
    // frequency responses; the columns f_dip_hz and snr_dip_db keep their names
    ("dip", "antiresonance"),
    ("dips", "antiresonances"),
    ("dip and peak", "antiresonance and resonance"),
    ("distance of the two", "separation"),
    // slosh: NASA SP-106 and Dodge (2000); `slosh.model = frozen` keeps its name
    ("liquid turns", "rotary slosh (swirl)"),
    ("make the liquid turn", "make the slosh rotary"),
    ("liquid turns round", "rotary slosh (swirl)"),
    ("liquid goes round", "rotary slosh (swirl)"),
    ("time turning", "time in rotary slosh"),
    ("frozen liquid", "rigid liquid"),
    ("frozen part", "fixed mass"),
    // energy; the variable `heat` keeps its name, so the bare word is allowed in formulas
    ("heat made", "dissipated energy"),
    ("into heat", "dissipated"),
    ("work and heat", "work and dissipated energy"),
    ("energy turned over", "energy throughput"),
    ("book-keeping", "energy balance"),
    ("bookkeeping", "energy balance"),
    // numbers: IEEE 754
    ("numbers that are none", "non-finite numbers"),
    ("was no number", "was NaN"),
    ("that is no number", "is NaN or infinite"),
    ("are no numbers", "are NaN or infinite"),
    // gyro: IEEE Std 952
    ("wandering bias", "Gauss–Markov bias"),
    ("what was put in", "what is specified"),
    ("asked | found", "specified | estimated"),
    // signal analysis
    ("signal over noise", "signal-to-noise ratio"),
    // identification: Ljung, System Identification, chapter 16
    ("not described by", "does not fit"),
    ("described by the model", "the model fits"),
    ("nothing told", "no prior given"),
    ("coherence of the rest", "residual coherence"),
    ("one linear model reaches", "validity of a linear fit"),
    ("how the figures are found", "methods"),
    ("broken line", "dashed line"),
    ("evenly", "linearly in frequency, or in equal steps"),
    // comparisons
    ("beside the thesis", "comparison with the thesis"),
    ("beside basilisk", "comparison with Basilisk"),
    ("beside fmpy", "compared with FMPy"),
    ("beside what", "comparison with"),
    ("the thesis's 22 sweeps", "the 22 sine sweeps of Rubaga's thesis"),
    // similarity
    ("tank in flight", "flight tank"),
    ("tanks in flight", "flight tanks"),
    ("bench stands for", "flight tank that the bench represents"),
    // simulation
    ("how time is cut", "choice of communication step"),
    ("cutting of time", "choice of communication steps"),
    ("processor time", "CPU time"),
    ("processor's time", "CPU time"),
    ("runs made", "simulated runs"),
    ("were there already", "reused"),
    ("made again", "simulated again"),
    ("same luck", "common random numbers"),
    ("state of life", "instance state"),
    // messages
    ("not whole", "incomplete"),
    ("wants a number", "expects a number"),
    ("does not belong into", "is not allowed in"),
    ("part of every system", "guaranteed on every system"),
    ("disk refused", "could not write"),
    ("nobody objects", "accepted without error"),
    ("tries to break it", "fuzzing"),
    ("what each can't do", "limitations"),
    ("the bill", "SBOM"),
];

/// Where a text is from, and the text.
type Text = (String, String);

/// All Markdown below a folder of the project, without code: names in it are the program's.
fn markdown(folder: &Path, texts: &mut Vec<Text>) {
    for entry in folder.read_dir().unwrap().flatten() {
        let (path, name) = (entry.path(), entry.file_name());
        let name = name.to_string_lossy();
        if name.starts_with('.') || ["target", "dist"].contains(&&*name) {
            continue;
        }
        if path.is_dir() {
            markdown(&path, texts);
        } else if name.ends_with(".md") {
            let text = std::fs::read_to_string(&path).unwrap();
            texts.push((path.display().to_string(), without_code(&text)));
        }
    }
}

fn without_code(markdown: &str) -> String {
    let prose: Vec<_> = markdown.split("```").step_by(2).collect();
    let prose: String = prose.join("\n");
    prose.split('`').step_by(2).collect::<Vec<_>>().join(" … ")
}

/// What `--help` of a command says, and of its subcommands.
fn help(command: &[&str], texts: &mut Vec<Text>) {
    let program = env!("CARGO_BIN_EXE_hubslosh");
    let output = Command::new(program).args(command).arg("--help").output().unwrap();
    assert!(output.status.success(), "{command:?} --help");
    let text = String::from_utf8(output.stdout).unwrap();
    let listed = text.split("Commands:\n").nth(1).unwrap_or("");
    let listed = listed.lines().take_while(|line| line.starts_with("  "));
    for name in listed.filter_map(|line| line.split_whitespace().next()) {
        if name != "help" {
            help(&[command, &[name]].concat(), texts);
        }
    }
    texts.push((format!("hubslosh {} --help", command.join(" ")), text));
}

/// Descriptions of variables.
fn descriptions(texts: &mut Vec<Text>) {
    for model in &pack::MODELS {
        let path = model.folder().join("modelDescription.xml");
        let xml = std::fs::read_to_string(&path).unwrap();
        for variable in ModelDescription::from_xml(&xml).unwrap().variables {
            texts.push((format!("{} {}", model.name, variable.name), variable.description));
        }
    }
}

/// Files with this ending below a folder, without hidden folders, built things and tests of Rust.
fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for path in folder.read_dir().unwrap().flatten().map(|entry| entry.path()) {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if path.is_dir() && !name.starts_with('.') && !["target", "tests"].contains(&&*name) {
            found.extend(files(&path, ending));
        } else if name.ends_with(ending) {
            found.push(path);
        }
    }
    found
}

/// Plans, notebooks, and text in drawings.
fn whole_files(texts: &mut Vec<Text>) {
    let root = pack::root();
    for (folder, ending) in [
        ("harness", ".toml"),
        ("harness", ".ipynb"),
        ("book", ".svg"),
        ("modelDescription", ".svg"),
    ] {
        for path in files(&root.join(folder), ending) {
            let text = std::fs::read_to_string(&path).unwrap();
            // a comment goes on in the next line; of a drawing what stands between its tags
            let text = match ending {
                ".svg" => text
                    .split('<')
                    .filter_map(|part| part.split_once('>'))
                    .map(|(_, t)| t)
                    .collect::<Vec<_>>()
                    .join(" | "),
                _ => text.replace("\n# ", "\n"),
            };
            texts.push((path.display().to_string(), text));
        }
    }
}

/// Docstrings of Python, without what stands in ``double backquotes``, which are names.
fn docstrings(texts: &mut Vec<Text>) {
    let root = pack::root();
    for path in ["harness", "examples"].iter().flat_map(|folder| files(&root.join(folder), ".py")) {
        let source = std::fs::read_to_string(&path).unwrap();
        let strings: Vec<_> = source.split("\"\"\"").skip(1).step_by(2).collect();
        let prose: Vec<_> = strings.iter().flat_map(|text| text.split('`').step_by(2)).collect();
        texts.push((path.display().to_string(), prose.join(" | ")));
    }
}

/// String literals of the source: what stands between two quotation marks in a line.
fn literals(texts: &mut Vec<Text>) {
    let root = pack::root();
    let paths = ["harness", "fmu", "modelDescription"].iter();
    for path in paths.flat_map(|folder| files(&root.join(folder), ".rs")) {
        let source = std::fs::read_to_string(&path).unwrap();
        // comments are for developers, and test code too
        let source = source.split("#[cfg(test)]").next().unwrap();
        let lines = source.lines().filter(|line| !line.trim_start().starts_with("//"));
        let source: String = lines.collect::<Vec<_>>().join("\n");
        let source = source.replace("\\\n", " ").replace("\\\"", "'").replace("'\"'", " ");
        // a subscript is part of a name
        let source = source.replace("sub { \"", "sub { \"_");
        let literals: Vec<_> = source.split('"').skip(1).step_by(2).collect();
        texts.push((path.display().to_string(), literals.join(" | ")));
    }
}

/// The words in lower case, with single spaces; `_` is part of a name and so of a word.
fn plain(text: &str) -> String {
    let mark = |c: char| if c.is_alphanumeric() || "_'-|".contains(c) { c } else { ' ' };
    let words: String = text.to_lowercase().replace('’', "'").chars().map(mark).collect();
    format!(" {} ", words.split_whitespace().collect::<Vec<_>>().join(" "))
}

#[test]
fn texts_use_the_words_of_the_field() {
    let mut texts = Vec::new();
    markdown(&pack::root(), &mut texts);
    help(&[], &mut texts);
    descriptions(&mut texts);
    literals(&mut texts);
    docstrings(&mut texts);
    whole_files(&mut texts);
    for (kind, count) in [
        (".md", 20),
        ("--help", 10),
        ("HubSlosh ", 100),
        (".rs", 100),
        (".py", 40),
        (".toml", 14),
        (".ipynb", 3),
        (".svg", 3),
    ] {
        let found = texts.iter().filter(|(from, _)| from.contains(kind)).count();
        assert!(found >= count, "{found} texts of {kind}");
    }
    let mut faults = Vec::new();
    for (from, text) in &texts {
        let text = plain(text);
        for (wrong, right) in WORDS {
            if let Some(at) = text.find(&format!(" {wrong} ")) {
                let near: Vec<_> = text[at..].split(' ').take(10).collect();
                let near = near.join(" ");
                faults.push(format!("{from}: \"{wrong}\" should be \"{right}\": …{near} …"));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn words_are_found_across_lines_and_not_in_names_or_code() {
    let found = |text: &str, word: &str| plain(&without_code(text)).contains(&format!(" {word} "));
    assert!(found("the frozen\nliquid.", "frozen liquid"));
    assert!(found("Dip, and", "dip"));
    assert!(!found("`dip` and f_dip and diploma", "dip"));
    assert!(!found("```\ndip\n```\n", "dip"));
}

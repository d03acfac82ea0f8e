//! `hubslosh review`: the Python package computes it.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail, ensure};

/// Reviews the attitude controller of a craft at all fills of its tanks, and writes a page with stability margins,
/// slosh modes and the worst case.
///
/// Several projects, or one with several cases, are compared on one page. The exit code is 1 if a requirement fails.
/// The command needs a Python with the packages hubslosh and matplotlib.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  hubslosh review project.toml\n  \
                  hubslosh review first.toml second.toml --out comparison.html\n  \
                  hubslosh review project.toml --out review.html --python /usr/bin/python3")]
pub struct ReviewArgs {
    /// Project file, .toml, with the craft, its controller and fills, the ranges of uncertain parameters,
    /// requirements and cases.
    #[arg(value_name = "PROJECT", required = true)]
    projects: Vec<PathBuf>,
    /// File for the page, .html [default: the name of the project with .html; if several projects are compared,
    /// comparison.html in the folder of the first one].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Python that has the package hubslosh [default: the Python next to this command, then python3 and python on PATH].
    #[arg(long, value_name = "PROGRAM")]
    python: Option<PathBuf>,
}

impl ReviewArgs {
    pub fn run(self) -> Result<()> {
        let own = std::env::current_exe().context("the path of this program cannot be found")?;
        let mut arguments = vec![OsString::from("-m"), "hubslosh.project".into()];
        arguments.extend(self.projects.into_iter().map(PathBuf::into_os_string));
        arguments
            .extend(self.out.into_iter().flat_map(|out| ["--out".into(), out.into_os_string()]));
        let pythons = match self.python {
            Some(python) => vec![python],
            None => python_candidates(&own),
        };
        for python in &pythons {
            let mut command = Command::new(python);
            command.args(&arguments).env("HUBSLOSH", &own).stdout(Stdio::inherit());
            match command.output() {
                Ok(done) => {
                    let printed = String::from_utf8_lossy(&done.stderr);
                    if done.status.success() {
                        eprint!("{printed}");
                        return Ok(());
                    }
                    ensure!(
                        !printed.contains("No module named 'hubslosh'"),
                        "{} does not have the package hubslosh: pip install hubslosh there, or name another Python \
                         by --python",
                        python.display()
                    );
                    let (warnings, why) = match printed.strip_prefix("error: ") {
                        Some(why) => ("", why),
                        None => printed.split_once("\nerror: ").unwrap_or(("", &printed)),
                    };
                    if !warnings.is_empty() {
                        eprintln!("{warnings}");
                    }
                    ensure!(
                        !why.trim().is_empty(),
                        "{} ended with {}",
                        python.display(),
                        done.status
                    );
                    bail!("{}", why.trim());
                }
                Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
                Err(error) => {
                    return Err(error)
                        .with_context(|| format!("{} did not start", python.display()));
                }
            }
        }
        let names: Vec<_> = pythons.iter().map(|python| python.display().to_string()).collect();
        bail!(
            "no Python was found (tried: {}); give --python PROGRAM, a Python that has the package hubslosh",
            names.join(", ")
        )
    }
}

/// Returns the Python programs that may have the package: first the program in the folder of this
/// command, because the command may be installed in a Python environment, then the programs on
/// PATH. `own` is the path of this command.
fn python_candidates(own: &Path) -> Vec<PathBuf> {
    let near = own.with_file_name(if cfg!(windows) { "python.exe" } else { "python3" });
    [near, "python3".into(), "python".into()].to_vec()
}

//! Inputs of size 0 and 1: rows, inputs, outputs, unknowns, steps, fills, files. Each command ends with a result or
//! with one error, and never with a panic or with NaN.

use std::path::Path;
use std::process::{Command, Output};

use pack::packed_for_tests;

use crate::foreign;

fn prepare(folder: &Path) {
    let write = |name: &str, text: String| std::fs::write(folder.join(name), text).unwrap();
    let head = "time,tau_cmd,omega,theta,wave_height,slosh_angle\n";
    let rows = |count: usize, row: &dyn Fn(f64) -> String| {
        (0..count).map(|k| row(0.02 * k as f64)).collect::<String>()
    };
    for count in 0..=2 {
        let row = |t: f64| format!("{t},0.1,{},0,0.001,{t}\n", 0.05 * t);
        write(&format!("rows{count}.csv"), head.to_string() + &rows(count, &row));
        let row = |t: f64| format!("{t},0.1,{}\n", 2.0 * (-t).exp());
        write(&format!("small{count}.csv"), "time,u,y\n".to_string() + &rows(count, &row));
    }
    write("rest.csv", head.to_string() + &rows(60, &|t| format!("{t},0,0,0,0,0\n")));
    write("empty.csv", head.to_string() + &rows(60, &|t| format!("{t},,,,,\n")));
    write("still.csv", "time,omega\n".to_string() + &rows(60, &|t| format!("{t},0\n")));
    write(
        "decay.csv",
        "time,u,y\n".to_string() + &rows(60, &|t| format!("{t},0,{}\n", 2.0 * (-t).exp())),
    );
    write("nothing", String::new());
    write("none.toml", String::new());
    let tank = "density = 1000\nshape = { cylinder = { radius = 0.1, height = 0.3 } }\n";
    write("tank.toml", tank.into());
    write("flat.toml", "density = 1000\nbox = [0, 0]\n".into());
    write("short.toml", "profile = \"zero:duration=0\"\n".into());
    std::fs::copy(packed_for_tests(), folder.join("HubSlosh.fmu")).unwrap();
    foreign::model(&folder.join("Model3.fmu"), 0);
}

const COMMANDS: &str = "
identify @ --out a.json
identify friction @ --out a.json
identify decay @ --out a.json
identify fmu @ --out a.json
identify @ --validate @ --out a.json
identify @ --free hub.I=0.5 --outputs omega --inputs tau_cmd --out a.json
identify @ --free hub.I=0.5 --outputs omega --inputs tau_cmd --out a.json
identify @ --fmu Model3.fmu --free k=0.7 --outputs y --inputs u --out a.json
identify @ --fmu Model3.fmu --free k=0.7 --outputs y --inputs u --solver host --out a.json
identify decay.csv --fmu Model3.fmu --free k=0.7 --outputs y --inputs u --out a.json
identify decay.csv --fmu Model3.fmu --free k=0.7 --outputs y --inputs u --solver host --out a.json
identify decay.csv --fmu Model3.fmu --free k=0.7 --outputs y --out a.json
identify decay.csv --fmu Model3.fmu --free k=0.1:0.05:0.1 --outputs y --inputs u --solver host --out a.json
identify rest.csv --free hub.I=0.5 --outputs omega --inputs tau_cmd --out a.json
design @ --fmu Model3.fmu --free k=0.7 --outputs y --inputs u --noise y=1e-3
design decay.csv --fmu Model3.fmu --free k=0.7 --outputs y --noise y=1e-3
design --multisine 0.1 --duration 0
design --multisine 0.1 --duration 0.02
design --multisine 0.1 --duration 0.2
design --multisine 0.1 --band 1,1
analyse @ --out campaign
gyro --recording @
gyro --recording still.csv --chunk 0.02
gyro --recording still.csv --chunk 1e9
run --input @ --ignore-columns --out run.csv
run --fmu Model3.fmu --input @ --out run.csv
run --profile zero --stop 0 --out run.csv
run --profile zero --stop 1e-9 --out run.csv
run --profile zero --stop 0.1 --step 0.2 --columns time --out run.csv
run --fmu Model3.fmu --stop 0 --out run.csv
run --fmu Model3.fmu --profile zero --stop 1e-9 --out run.csv
run --fmu nothing --profile zero --out run.csv
view @ --out page.html
view rest.csv --from 0 --to 0 --out page.html
torque --profile zero --stop 0 --out torque.csv
torque --profile zero --step 1e9 --stop 1 --out torque.csv
campaign --plan none.toml --out campaign
campaign --plan short.toml --out campaign
campaign --fills 0 --amplitudes 0.1 --model linear --out campaign
check nothing
check Model3.fmu --only zip.names
check Model3.fmu --only nothing
tank none.toml --fill 0.1
tank flat.toml --fill 0.1
tank tank.toml --fill 0
tank tank.toml --fill 100%
tank tank.toml --fill-mass 0
tank tank.toml --fill 0.1 --modes 0
tank tank.toml --fill 0.1 --modes 1
tank tank.toml --fill 0.1 --gravity 0
tank tank.toml --sweep 0.1 --modes 1 --parameters tank_parameters.toml
variables --fmu nothing
variables --fmu Model3.fmu --causality input
example --fmu nothing
scale numbers --radius 0 --acceleration 0 --velocity 0
review none.toml --out review.html
";

/// Each command runs with 0 and with 1 rows, modes, runs or points, in its options and in its
/// files.
#[test]
fn options_with_sizes_0_and_1_give_a_result_or_one_error() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    prepare(folder);
    let mut commands = Vec::new();
    for command in COMMANDS.lines().filter(|line| !line.is_empty()) {
        const OF_FMUS: [&str; 6] = ["analyse", "campaign", "design", "identify", "run", "view"];
        let takes_fmu = OF_FMUS.iter().any(|begin| command.starts_with(begin));
        let ours = takes_fmu && !command.contains("--fmu") && !command.contains("identify decay");
        let recordings = if command.contains("Model3") { "small" } else { "rows" };
        let command = if ours { format!("{command} --fmu HubSlosh.fmu") } else { command.into() };
        match command.contains('@') {
            true => commands.extend(
                (0..=2).map(|rows| command.replace('@', &format!("{recordings}{rows}.csv"))),
            ),
            false => commands.push(command),
        }
    }
    let mut wrong = Vec::new();
    for command in commands {
        let Output { status, stdout, stderr } = Command::new(env!("CARGO_BIN_EXE_hubslosh"))
            .current_dir(folder)
            .args(command.split(' '))
            .stdin(std::process::Stdio::null())
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&[stdout, stderr].concat()).into_owned();
        let errors = said.lines().filter(|line| line.starts_with("error")).count();
        let as_it_should = match status.code() {
            Some(0) => errors == 0,
            Some(1 | 2) => errors > 0,
            _ => false,
        };
        let words = ["bug of hubslosh", "panicked", "NaN"];
        if !as_it_should || words.iter().any(|word| said.contains(word)) {
            wrong.push(format!("{command}: {status}\n{said}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

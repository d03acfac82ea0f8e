//! `hubslosh tank`.

use std::process::Command;

fn tank(arguments: &[&str]) -> (bool, String, String) {
    let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/../tank/examples");
    let done = Command::new(env!("CARGO_BIN_EXE_hubslosh"))
        .current_dir(examples)
        .arg("tank")
        .args(arguments)
        .output()
        .unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (done.status.success(), text(done.stdout), text(done.stderr))
}

/// Half a sphere: lambda_1 R and m_1/m_liq of Budiansky's case (1960); the hinges are its centre.
#[test]
fn a_half_full_sphere_has_its_published_first_mode() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("sphere.toml"), folder.path().join("result.json"));
    std::fs::write(&file, "density = 1000\nshape = { sphere = { radius = 2 } }\n").unwrap();
    let (file, out) = (file.to_str().unwrap(), out.to_str().unwrap());
    let (ok, _, error) = tank(&[file, "--fill", "2", "--out", out]);
    assert!(ok, "{error}");
    let text = std::fs::read_to_string(out).unwrap();
    let result: serde_json::Value = serde_json::from_str(&text).unwrap();
    let number = |pointer: &str| result.pointer(pointer).unwrap().as_f64().unwrap();
    // 1.56015717 and 0.57969303 are given to 9 digits.
    assert!((number("/modes/0/lambda") * 2.0 - 1.56015717).abs() < 1e-8);
    assert!((number("/modes/0/m") / number("/m_liq") - 0.57969303).abs() < 1e-8);
    let centre = number("/modes/0/hinge") - number("/modes/1/hinge");
    assert!(centre.abs() < 1e-6 * 2.0 && number("/error") < 1e-6);
}

#[test]
fn a_bad_tank_is_refused_in_a_sentence_and_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("bad.toml"), folder.path().join("result.json"));
    std::fs::write(&file, "density = 1000\nprofile = [{ line = [0, 0, 1, 0] }]\n").unwrap();
    let arguments = [file.to_str().unwrap(), "--fill", "0.5", "--out", out.to_str().unwrap()];
    let (ok, _, error) = tank(&arguments);
    assert!(!ok && error.contains("bad.toml") && !error.contains("panicked"), "{error}");
    assert!(!out.exists());
}

//! The texts that pages embed: three.js, the scene, and JSON.

use sha2::{Digest, Sha256};
use web::{SCENE, THREE, THREE_LICENSE, json_in_script};

#[test]
fn the_bundle_of_three_js_equals_the_bundle_of_the_lock_file() {
    let sum = |text: &str| base16ct::lower::encode_string(&Sha256::digest(text));
    let sums = format!("{}  LICENSE\n{}  three.min.js\n", sum(THREE_LICENSE), sum(THREE));
    assert_eq!(sums, include_str!("../../three/SHA256SUMS"), "run harness/web/three/build");
}

#[test]
fn embedded_scripts_do_not_end_their_script_element() {
    for text in [THREE, THREE_LICENSE, SCENE] {
        assert!(!text.contains("</script") && !text.contains("<!--"));
    }
}

#[test]
fn json_in_a_script_has_no_character_of_markup() {
    let text = json_in_script("{\"unit\":\"<!--<script>&amp;\u{2028}\u{2029}</script>é\"}");
    assert_eq!(
        text,
        "{\"unit\":\"\\u003c!--\\u003cscript\\u003e\\u0026amp;\\u2028\\u2029\\u003c/script\\u003eé\"}"
    );
}

/// The bundle of three.js contains only the names in `used.js`. A missing name would cause an
/// error only in the browser.
#[test]
fn the_bundle_of_three_js_has_every_name_that_the_scene_uses() {
    let exported = include_str!("../../three/used.js");
    for rest in SCENE.split("THREE.").skip(1) {
        let name: String = rest.chars().take_while(|c| c.is_alphanumeric()).collect();
        let listed = exported.split(|c: char| !c.is_alphanumeric()).any(|word| word == name);
        assert!(listed || name.is_empty(), "{name} is not in used.js");
    }
}

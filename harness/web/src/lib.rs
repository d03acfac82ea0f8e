//! JavaScript that several pages of the project contain, as text to be put between `<script>` and `</script>`. Data for
//! it must be escaped by [`json_in_script`].

/// The parts of the library three.js that [`SCENE`] uses, as a script that defines the global
/// `THREE`. Its licence (MIT) requires [`THREE_LICENSE`] in each page.
pub static THREE: &str = include_str!("../three/three.min.js");

pub static THREE_LICENSE: &str = include_str!("../three/LICENSE");

/// The 3-D scene as a script that defines the global `HubSloshScene`. It draws a bench or a
/// spacecraft with its liquid (`scene/README.md`), and needs [`THREE`].
pub static SCENE: &str = include_str!("../scene/scene.js");

/// Escapes JSON so that it can be embedded in a script element of any page, or in a script. No text
/// in the escaped JSON ends the element (`</script`), hides its end (`<!--<script`: HTML,
/// 13.2.5.20), becomes an entity, or ends a line of JavaScript. The value stays the same, because
/// JSON has these characters only in strings.
pub fn json_in_script(json: &str) -> String {
    let mut text = String::with_capacity(json.len());
    for c in json.chars() {
        match c {
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => text += &format!("\\u{:04x}", c as u32),
            c => text.push(c),
        }
    }
    text
}

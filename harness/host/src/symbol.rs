//! Makes symbols of libraries readable for messages: returns the names of C++ and Rust functions without
//! mangling and without arguments.

use std::fmt::{self, Write};

use cpp_demangle::{DemangleOptions, Symbol};

const LONGEST: usize = 60;

/// A text that stores only the first characters of a symbol's name. Writing fails when it is full,
/// because short mangled symbols of C++ may stand for extremely long names.
#[derive(Default)]
struct Short(String);

impl Write for Short {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for character in text.chars() {
            if self.0.chars().count() == LONGEST {
                self.0.push('…');
                return Err(fmt::Error);
            }
            self.0.push(character);
        }
        Ok(())
    }
}

/// Returns the readable and shortened name of `symbol`, a function of a binary in Rust, C or C++,
/// for a message. The result is `None` if the symbol is mangled and cannot be decoded.
pub fn readable(symbol: &str) -> Option<String> {
    let mut name = Short::default();
    let written = if let Ok(rust) = rustc_demangle::try_demangle(symbol) {
        write!(name, "{rust:#}") // without its hash
    } else if symbol.starts_with('?') {
        name.write_str(&demangle_microsoft(symbol)?)
    } else if symbol.starts_with("_Z") || symbol.starts_with("__Z") {
        let options = DemangleOptions::new().no_params().no_return_type();
        Symbol::new(symbol).ok()?.structured_demangle(&mut name, &options)
    } else {
        name.write_str(symbol)
    };
    // An error is accepted if the text is full, because a shortened name is valid.
    (written.is_ok() || name.0.ends_with('…')).then_some(name.0)
}

/// Decodes simple names of Microsoft's C++ compiler: `?method@type@ns@@QEAAXXZ` becomes
/// `ns::type::method`. Names with templates or operators give `None`.
fn demangle_microsoft(symbol: &str) -> Option<String> {
    let (name, _) = symbol.strip_prefix('?')?.split_once("@@")?;
    let parts: Vec<&str> = name.split('@').rev().collect();
    (!name.contains(['?', '$'])).then(|| parts.join("::"))
}

//! Symbols of libraries as people read them: names of C++ and Rust without mangling and arguments.

/// Bytes of a name that are shown.
const LONGEST: usize = 60;

/// A symbol in a message: its name, shortened; a mangled one of a form that is not known here is `None`.
pub fn readable(symbol: &str) -> Option<String> {
    let bare = symbol.trim_start_matches('_');
    let is_mangled = bare.len() < symbol.len() && bare.starts_with(['Z', 'R']);
    let name = match symbol {
        _ if symbol.starts_with('?') => of_microsoft(symbol)?,
        _ if is_mangled => of_itanium(symbol)?,
        _ => symbol.to_string(),
    };
    Some(match name.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &name[..end]),
        None => name,
    })
}

/// Names of the Itanium C++ ABI (5.1), which Rust's older mangling follows: `_ZN2ns4type6methodEv` is ns::type::method.
fn of_itanium(symbol: &str) -> Option<String> {
    let mut rest = symbol.trim_start_matches('_').strip_prefix('Z')?;
    // virtual tables, type information, guards
    for special in ["TV", "TT", "TI", "TS", "GV"] {
        rest = rest.strip_prefix(special).unwrap_or(rest);
    }
    rest = rest.strip_prefix('N').unwrap_or(rest).trim_start_matches(['r', 'V', 'K', 'R', 'O']);
    let mut parts: Vec<&str> = Vec::new();
    loop {
        let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
        if let Ok(length) = rest[..digits].parse::<usize>() {
            parts.push(rest[digits..].get(..length)?);
            rest = &rest[digits + length..];
        } else if let Some(after) = rest.strip_prefix("St") {
            parts.push("std");
            rest = after;
        } else {
            break;
        }
    }
    let is_hash = |part: &str| part.len() == 17 && part.starts_with('h');
    parts.pop_if(|part| is_hash(part));
    (!parts.is_empty()).then(|| parts.join("::"))
}

/// Names of Microsoft's compiler: `?method@type@ns@@QEAAXXZ` is ns::type::method.
fn of_microsoft(symbol: &str) -> Option<String> {
    let (name, _) = symbol.strip_prefix('?')?.split_once("@@")?;
    let parts: Vec<&str> = name.split('@').rev().collect();
    (!name.contains(['?', '$'])).then(|| parts.join("::"))
}

#[cfg(test)]
mod tests {
    use super::readable;

    #[test]
    fn mangled_names_are_read_or_left_out() {
        for (symbol, name) in [
            ("cos", Some("cos")),
            ("_Py_NoneStruct", Some("_Py_NoneStruct")),
            ("_ZN9pythonfmu7PyState4callEv", Some("pythonfmu::PyState::call")),
            ("_ZNK9pythonfmu7PyState4callEv", Some("pythonfmu::PyState::call")),
            ("_ZTVN7fmu4cpp9fmu_slaveE", Some("fmu4cpp::fmu_slave")),
            ("_ZNSt6vectorIdSaIdEE9push_backEOd", Some("std::vector")),
            ("_Z4openPKc", Some("open")),
            ("__ZN4core3fmt5write17h0123456789abcdefE", Some("core::fmt::write")),
            ("?push@Stack@ns@@QEAAXXZ", Some("ns::Stack::push")),
            ("??0Stack@ns@@QEAA@XZ", None),
            ("_RNvCs1234_7mycrate3foo", None),
            ("_ZdlPv", None),
        ] {
            assert_eq!(readable(symbol).as_deref(), name, "{symbol}");
        }
        let long = "a".repeat(1000);
        assert_eq!(readable(&long).unwrap().chars().count(), 61);
    }
}

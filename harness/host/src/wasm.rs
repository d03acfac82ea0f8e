//! Imports and exports of a WebAssembly module, read from the file.
//!
//! Layout of a module: WebAssembly Core Specification 2.0, chapter 5.5.

use anyhow::{Context, Result, ensure};

/// Exports that a host needs in addition to FMI functions: the memory of arrays, and the table of
/// functions for callbacks.
const OTHERS: [&str; 2] = ["memory", "__indirect_function_table"];
const IMPORTS: u8 = 2;
const EXPORTS: u8 = 7;

/// A module, seen from outside.
#[derive(Debug, PartialEq, Eq)]
pub struct Module {
    /// Imports that a host has to provide, as `module.name`.
    pub imports: Vec<String>,
    /// Names of its functions, memories, tables and globals that a host can reach.
    pub exports: Vec<String>,
}

impl Module {
    /// Reads a module.
    ///
    /// # Errors
    /// If it is none, or damaged.
    pub fn read(bytes: &[u8]) -> Result<Module> {
        let head = b"\0asm\x01\0\0\0";
        ensure!(bytes.starts_with(head), "not a module for WebAssembly");
        read_sections(Cursor(&bytes[head.len()..])).context("a damaged module for WebAssembly")
    }

    /// Lists what prevents use as an FMU with the functions `wanted`; one sentence each.
    pub fn faults(&self, wanted: &[&str]) -> Vec<String> {
        let mut faults = Vec::new();
        if !self.imports.is_empty() {
            faults.push(format!("it imports {}, which no page has", self.imports.join(", ")));
        }
        let is_there = |name: &str| self.exports.iter().any(|export| export == name);
        let all = wanted.iter().chain(&OTHERS).copied();
        let lacking: Vec<_> = all.filter(|name| !is_there(name)).collect();
        if !lacking.is_empty() {
            faults.push(format!("it does not export {}", lacking.join(", ")));
        }
        faults
    }
}

fn read_sections(mut rest: Cursor) -> Result<Module> {
    let mut module = Module { imports: Vec::new(), exports: Vec::new() };
    while !rest.0.is_empty() {
        let kind = rest.byte()?;
        let size = rest.number()?;
        let mut section = Cursor(rest.take(size)?);
        match kind {
            IMPORTS => {
                for _ in 0..section.number()? {
                    let (from, name) = (section.name()?, section.name()?);
                    module.imports.push(format!("{from}.{name}"));
                    section.import()?;
                }
            }
            EXPORTS => {
                for _ in 0..section.number()? {
                    module.exports.push(section.name()?);
                    section.byte()?; // kind
                    section.number()?; // place in the list of its kind
                }
            }
            _ => {}
        }
    }
    Ok(module)
}

/// The bytes that are still to be read.
struct Cursor<'a>(&'a [u8]);

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count).context("it ends too early")?;
        self.0 = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8> {
        Ok(self.take(1)?[0])
    }

    /// An unsigned number of up to 32 bits, seven bits a byte, the lowest first.
    fn number(&mut self) -> Result<usize> {
        let mut number = 0;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Ok(u32::try_from(number)? as usize);
            }
        }
        anyhow::bail!("a number is too long")
    }

    fn name(&mut self) -> Result<String> {
        let length = self.number()?;
        Ok(String::from_utf8(self.take(length)?.to_vec())?)
    }

    /// Reads the type of an import after its name.
    fn import(&mut self) -> Result<()> {
        match self.byte()? {
            0 => _ = self.number()?, // function: its type
            1 => {
                self.byte()?; // table: of what
                self.limits()?;
            }
            2 => self.limits()?,    // memory
            3 => _ = self.take(2)?, // global: type, mutable
            kind => anyhow::bail!("an import is of kind {kind} (allowed: 0 to 3)"),
        }
        Ok(())
    }

    fn limits(&mut self) -> Result<()> {
        let has_maximum = self.byte()? & 1 == 1;
        self.number()?;
        if has_maximum {
            self.number()?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Imports the memory `e.m` and the function `e.f`, exports the function `f`.
    const SMALL: &[u8] = b"\0asm\x01\0\0\0\
        \x01\x04\x01\x60\0\0\
        \x02\x0e\x02\x01e\x01m\x02\0\x01\x01e\x01f\0\0\
        \x07\x05\x01\x01f\0\0";

    #[test]
    fn imports_and_exports_are_read_and_the_faults_named() {
        let module = Module::read(SMALL).unwrap();
        assert_eq!(module.imports, ["e.m", "e.f"]);
        assert_eq!(module.exports, ["f"]);
        let faults = module.faults(&["f", "fmi2DoStep"]);
        assert_eq!(faults[0], "it imports e.m, e.f, which no page has");
        assert_eq!(faults[1], "it does not export fmi2DoStep, memory, __indirect_function_table");
    }

    #[test]
    fn every_beginning_of_a_module_is_whole_or_refused() {
        let whole: Vec<_> =
            (0..SMALL.len()).filter(|&n| Module::read(&SMALL[..n]).is_ok()).collect();
        // after the head, and after each section
        assert_eq!(whole, [8, 14, 30]);
    }
}

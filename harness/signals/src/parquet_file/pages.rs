//! Checks the sizes that the page headers of a Parquet column state, before the Parquet library allocates
//! memory for them: a header of a few bytes may state 2 GB.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};

use anyhow::{Context, Result, ensure};
use files::budget;

/// Largest page that is accepted, bytes: 500 times the size that common writers use.
const LARGEST: u64 = 512 << 20;
/// Longest page header that is accepted, bytes. Real headers are short, because their
/// statistics are two numbers.
const HEADER: u64 = 1 << 16;
const DEEPEST: usize = 16;

/// Checks the pages in the `length` bytes from `start` of a file with `size` bytes.
///
/// # Errors
/// If a header is damaged, or the pages are larger than the memory budget.
pub fn check(mut file: &File, start: u64, length: u64, size: u64) -> Result<()> {
    let end = start.checked_add(length).filter(|end| *end <= size);
    let end = end.context("the column lies outside the file")?;
    let (mut at, mut sum) = (start, 0_u64);
    let mut buffer = Vec::new();
    while at < end {
        buffer.clear();
        file.seek(SeekFrom::Start(at))?;
        file.take(HEADER.min(end - at)).read_to_end(&mut buffer)?;
        let mut header = Header { bytes: &buffer, at: 0 };
        let (inflated, stored) = header.sizes()?;
        ensure!(
            inflated <= LARGEST,
            "a page takes {:.1} GB (allowed: at most {:.1} GB)",
            inflated as f64 / 1e9,
            LARGEST as f64 / 1e9
        );
        sum += inflated;
        ensure!(
            sum <= budget::INFLATED,
            "the pages of the column take more than {:.1} GB (allowed: less)",
            budget::INFLATED as f64 / 1e9
        );
        at = at + header.at as u64 + stored;
    }
    Ok(())
}

struct Header<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Header<'_> {
    fn sizes(&mut self) -> Result<(u64, u64)> {
        let (mut inflated, mut stored) = (None, None);
        let mut id = 0_i64;
        while let Some((next, kind)) = self.field(id)? {
            id = next;
            match (id, kind) {
                (2, 5) => inflated = u64::try_from(self.integer()?).ok(),
                (3, 5) => stored = u64::try_from(self.integer()?).ok(),
                _ => self.skip(kind, 0)?,
            }
        }
        inflated.zip(stored).context("a page has no size")
    }

    fn byte(&mut self) -> Result<u8> {
        let byte = self.bytes.get(self.at).context("the header of a page is damaged")?;
        self.at += 1;
        Ok(*byte)
    }

    fn unsigned(&mut self) -> Result<u64> {
        let mut value = 0_u64;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(value);
            }
        }
        anyhow::bail!("the header of a page is damaged")
    }

    fn integer(&mut self) -> Result<i64> {
        let value = self.unsigned()?;
        Ok((value >> 1) as i64 ^ -((value & 1) as i64))
    }

    /// Reads the number and type of the next field; `None` at the end of a structure. `last` is the number of
    /// the preceding field, because a header stores field numbers as differences.
    fn field(&mut self, last: i64) -> Result<Option<(i64, u8)>> {
        let byte = self.byte()?;
        if byte == 0 {
            return Ok(None);
        }
        let id = match byte >> 4 {
            0 => self.integer()?,
            more => last.wrapping_add(i64::from(more)),
        };
        Ok(Some((id, byte & 15)))
    }

    fn skip(&mut self, kind: u8, depth: usize) -> Result<()> {
        ensure!(depth < DEEPEST, "the header of a page is damaged");
        match kind {
            1 | 2 => {} // true and false are two types without further bytes
            3 => drop(self.byte()?),
            4..=6 => drop(self.unsigned()?),
            7 => self.pass(8)?,
            8 => {
                let length = self.unsigned()?;
                self.pass(length)?;
            }
            9 | 10 => {
                let byte = self.byte()?;
                let count = match byte >> 4 {
                    15 => self.unsigned()?,
                    count => u64::from(count),
                };
                for _ in 0..count {
                    // In a list of Booleans each element takes one byte.
                    match byte & 15 {
                        1 | 2 => drop(self.byte()?),
                        kind => self.skip(kind, depth + 1)?,
                    }
                }
            }
            12 => {
                let mut id = 0;
                while let Some((next, kind)) = self.field(id)? {
                    id = next;
                    self.skip(kind, depth + 1)?;
                }
            }
            _ => anyhow::bail!("the header of a page is damaged"),
        }
        Ok(())
    }

    fn pass(&mut self, bytes: u64) -> Result<()> {
        let left = (self.bytes.len() - self.at) as u64;
        ensure!(bytes <= left, "the header of a page is damaged");
        self.at += bytes as usize;
        Ok(())
    }
}

//! The module's functions, by C's names: an attribute that Rust calls unsafe, for another library may have the same.
#![allow(unsafe_code)]

use std::cell::RefCell;

thread_local! {
    static TEXT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// One more byte of the file.
#[unsafe(no_mangle)]
pub extern "C" fn put(byte: u32) {
    TEXT.with_borrow_mut(|text| text.push(byte as u8));
}

/// Solves what was put; the answer stands in its place. Returns its length.
#[unsafe(no_mangle)]
pub extern "C" fn solve(share: f64, modes: u32) -> u32 {
    TEXT.with_borrow_mut(|text| {
        *text = crate::answer(&String::from_utf8_lossy(text), share, modes as usize).into_bytes();
        text.len() as u32
    })
}

/// One byte of the answer; 0 beyond its end. Reading the last one makes room for the next file.
#[unsafe(no_mangle)]
pub extern "C" fn get(place: u32) -> u32 {
    TEXT.with_borrow_mut(|text| {
        let byte = text.get(place as usize).copied().unwrap_or(0);
        if place as usize + 1 == text.len() {
            text.clear();
        }
        u32::from(byte)
    })
}

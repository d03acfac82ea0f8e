//! FNV-1a hash with 128 bits, which distinguishes tables and byte strings identically on every platform. It protects against
//! mistakes, not against attackers.

/// A hash value to which bytes and texts are added one after another.
#[derive(Clone, Copy, Debug)]
pub struct Hash(u128);

#[allow(missing_docs)]
impl Hash {
    pub const fn new() -> Hash {
        Hash(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d)
    }

    pub fn bytes(mut self, bytes: &[u8]) -> Hash {
        for byte in bytes {
            self.0 ^= u128::from(*byte);
            self.0 = self.0.wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013B);
        }
        self
    }

    /// Returns the hash after the text and a mark of its end were added. Because of the mark, the texts "ab", "c" have
    /// another hash than "a", "bc".
    pub fn text(self, text: &str) -> Hash {
        self.bytes(text.as_bytes()).bytes(&[0xff])
    }

    pub const fn value(self) -> u128 {
        self.0
    }
}

impl Default for Hash {
    fn default() -> Self {
        Hash::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_of_the_letter_a_is_the_published_value() {
        // FNV-1a 128 test vector for "a".
        let a = Hash::new().bytes(b"a").value();
        assert_eq!(a, 0xd228_cb69_6f1a_8caf_7891_2b70_4e4a_8964);
    }

    #[test]
    fn the_hash_of_two_texts_depends_on_where_the_first_text_ends() {
        let hash = |texts: [&str; 2]| Hash::new().text(texts[0]).text(texts[1]).value();
        assert_ne!(hash(["ab", "c"]), hash(["a", "bc"]));
    }
}

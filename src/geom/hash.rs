//! Maps keyed by indices and by the bits of places. Keys come from meshes, not from strangers, so their hash
//! may be quick.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// A map with that hash.
pub type FastMap<K, V> = HashMap<K, V, BuildHasherDefault<Mixer>>;

/// A hasher that folds in each word by a multiplication whose high and low halves are both kept.
#[derive(Default)]
pub struct Mixer(u64);

impl Hasher for Mixer {
    #[inline]
    fn finish(&self) -> u64 {
        self.0
    }

    #[inline]
    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.write_u64(u64::from_le_bytes(word));
        }
    }

    #[inline]
    fn write_u32(&mut self, x: u32) {
        self.write_u64(u64::from(x));
    }

    #[inline]
    fn write_usize(&mut self, x: usize) {
        self.write_u64(x as u64);
    }

    #[inline]
    fn write_u64(&mut self, x: u64) {
        // Any odd number of many bits would do, and any other keeps zeros from vanishing.
        let product = u128::from(self.0 ^ x ^ 0x5851_f42d_4c95_7f2d) * 0x9e37_79b9_7f4a_7c15;
        self.0 = (product >> 64) as u64 ^ product as u64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::hash::{BuildHasher, Hash};

    /// Places of a grid differ in few bits, most of them the high ones.
    #[test]
    fn neighbouring_keys_fall_apart() {
        let build = BuildHasherDefault::<Mixer>::default();
        let mut buckets = vec![0u32; 1 << 12];
        let mut count = |key: &dyn Fn(&mut Mixer)| {
            let mut h = build.build_hasher();
            key(&mut h);
            // A map takes its bucket from the low bits.
            buckets[(h.finish() & 0xfff) as usize] += 1;
        };
        for i in 0..64u32 {
            for j in 0..64u32 {
                let place = [f64::from(i) * 0.25, f64::from(j), 1.0].map(f64::to_bits);
                count(&|h| place.hash(h));
                count(&|h| (i, j).hash(h));
            }
        }
        // Two keys a bucket; chance alone puts fewer than 12 into each.
        assert!(buckets.iter().all(|n| *n < 16), "{:?}", buckets.iter().max());
        assert!(buckets.iter().filter(|n| **n == 0).count() < 1000);
    }
}

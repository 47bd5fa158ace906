//! Maps keyed by indices and by the bits of places. Keys come from meshes, not from strangers, so their hash
//! may be quick.

use crate::base::tasks::Tasks;
use rayon::prelude::*;
use std::collections::HashMap;
use std::hash::{BuildHasher, BuildHasherDefault, Hash, Hasher};

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

/// What [`firsts`] gives of an item without a key.
pub const NO_KEY: u32 = u32::MAX;
/// Items of which one task finds the keys.
const PART: usize = 1024;
/// So many items are looked up by one task.
const FEW: usize = 4 * PART;
/// Bits of a hash by which items are dealt to tasks.
const DEAL_BITS: u32 = 4;

/// Of each of `count` items the first one with the same key, or [`NO_KEY`]. The answer does not depend on the number of threads.
pub fn firsts<K: Hash + Eq + Send + Sync>(count: usize, key: impl Fn(usize) -> Option<K> + Sync) -> Vec<u32> {
    if count <= FEW {
        let mut known: FastMap<K, u32> = FastMap::with_capacity_and_hasher(count, Default::default());
        let first = |i: usize| key(i).map_or(NO_KEY, |k| *known.entry(k).or_insert(i as u32));
        return (0..count).map(first).collect();
    }
    let build = BuildHasherDefault::<Mixer>::default();
    let parts = |p: usize| {
        (p * PART..count.min((p + 1) * PART)).map(&key).map(|k| k.map(|k| (build.hash_one(&k), k))).collect()
    };
    let keys: Vec<Vec<Option<(u64, K)>>> =
        (0..count.div_ceil(PART)).into_par_iter().map_tasks(parts).collect();
    // A map takes the low bits.
    let dealt_to = |hash: u64| hash >> (64 - DEAL_BITS);
    let found = |task: u64| -> Vec<[u32; 2]> {
        let mut known: FastMap<&K, u32> = FastMap::default();
        let own = keys.iter().flatten().enumerate().filter_map(|(i, k)| {
            k.as_ref().filter(|(hash, _)| dealt_to(*hash) == task).map(|(_, k)| (i as u32, k))
        });
        own.map(|(i, k)| [i, *known.entry(k).or_insert(i)]).collect()
    };
    let mut first = vec![NO_KEY; count];
    for dealt in (0..1 << DEAL_BITS).into_par_iter().map_tasks(found).collect::<Vec<_>>() {
        dealt.into_iter().for_each(|[i, of]| first[i as usize] = of);
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn firsts_are_those_of_a_plain_search() {
        for count in [0, 1, 7, PART, 5 * PART + 3] {
            let key = |i: usize| (i % 11 != 3).then(|| [(i * i % 97) as i64, -((i / 1000) as i64)]);
            let plain =
                |i: usize| key(i).map_or(NO_KEY, |k| (0..=i).find(|j| key(*j) == Some(k)).unwrap() as u32);
            assert_eq!(firsts(count, key), (0..count).map(plain).collect::<Vec<_>>(), "{count}");
        }
    }
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

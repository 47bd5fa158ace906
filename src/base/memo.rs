//! Values that follow from a key alone and are asked for again and again, kept so that each is made once.

use super::error::Result;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// Number of values that a memo keeps; the one that was made first goes first.
const KEPT: usize = 8;

/// The values of the last few keys. What `get` gives does not depend on what is kept.
pub struct Memo<K, V> {
    kept: Mutex<VecDeque<(K, Arc<V>)>>,
}

impl<K: PartialEq + Clone, V> Default for Memo<K, V> {
    fn default() -> Self {
        Memo::new()
    }
}

impl<K: PartialEq + Clone, V> Memo<K, V> {
    /// An empty memo.
    pub const fn new() -> Memo<K, V> {
        Memo { kept: Mutex::new(VecDeque::new()) }
    }

    /// The value of a key, made by `make` where it is not kept. Nobody waits while it is made: two who ask at once may both make it.
    ///
    /// # Errors
    /// Returns the errors of `make`, which are not kept.
    pub fn get(&self, key: &K, make: impl FnOnce() -> Result<V>) -> Result<Arc<V>> {
        let find = |kept: &VecDeque<(K, Arc<V>)>| {
            kept.iter().rev().find(|(k, _)| k == key).map(|(_, value)| Arc::clone(value))
        };
        if let Some(known) = find(&self.kept.lock().unwrap_or_else(PoisonError::into_inner)) {
            return Ok(known);
        }
        let new = Arc::new(make()?);
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = find(&kept) {
            return Ok(known);
        }
        if kept.len() == KEPT {
            kept.pop_front();
        }
        kept.push_back((key.clone(), Arc::clone(&new)));
        Ok(new)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::error::Error;
    use std::cell::Cell;

    #[test]
    fn values_are_made_once_and_the_oldest_go() {
        let memo: Memo<usize, usize> = Memo::new();
        let made = Cell::new(0);
        let square = |n: usize| {
            memo.get(&n, || {
                made.set(made.get() + 1);
                Ok(n * n)
            })
        };
        for n in 0..KEPT + 4 {
            assert_eq!(*square(n).unwrap(), n * n);
        }
        assert_eq!((*square(KEPT).unwrap(), made.get()), (KEPT * KEPT, KEPT + 4));
        assert_eq!((*square(0).unwrap(), made.get()), (0, KEPT + 5));
        assert!(memo.get(&99, || Err(Error::Failed("no".into()))).is_err());
        assert_eq!(*memo.get(&99, || Ok(1)).unwrap(), 1);
    }
}

//! A value that is borrowed, or shared by those who work with it.

use std::ops::Deref;
use std::sync::Arc;

/// A borrowed value, or a share of one that lives as long as any of its holders.
#[derive(Debug)]
pub enum Held<'a, T> {
    /// It lives elsewhere.
    Borrowed(&'a T),
    /// It lives here too.
    Shared(Arc<T>),
}

impl<T> Clone for Held<'_, T> {
    fn clone(&self) -> Self {
        match self {
            Held::Borrowed(value) => Held::Borrowed(value),
            Held::Shared(value) => Held::Shared(Arc::clone(value)),
        }
    }
}

impl<T> Deref for Held<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        match self {
            Held::Borrowed(value) => value,
            Held::Shared(value) => value,
        }
    }
}

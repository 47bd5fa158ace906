//! Wide BVH.

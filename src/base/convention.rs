//! Bounces: how many a chain has at most, and which of them radiate.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Largest number of bounces of a chain.
pub const MAX_BOUNCES: usize = 8;

/// Bounces of a chain that radiate to the receiver.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Convention {
    /// The physical-optics current of every bounce radiates to the receiver.
    #[default]
    Every,
    /// Only the current of the last bounce, from which the ray leaves the scene, radiates.
    Last,
}

//! Files of other tools.

mod batches;
mod interop;

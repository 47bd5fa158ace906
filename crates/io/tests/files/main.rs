//! Files of other tools.

mod interop;

//! Files of other tools, and what cubes say of their radar.

mod batches;
mod interop;
mod sensor_fit;

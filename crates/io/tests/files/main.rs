//! Files of other tools, and what cubes say of their radar.

mod batches;
mod interop;
mod old_dataset;
mod sensor_fit;

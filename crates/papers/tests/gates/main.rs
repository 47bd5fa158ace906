//! Figures of the documents and gates of the build.

mod austin;
mod bad_meshes;
mod beam_times;
mod clipping;
mod device_frames;
mod echoes;
mod gates;
mod gpu_beams;
mod line_echoes;
mod lines;
mod meshes;
mod radar_gates;
mod scenario;
mod study;
mod vehicles;

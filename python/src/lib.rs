//! `catseye._catseye`: what the Python package calls. NumPy in and out, no physics; the interpreter is let go during
//! work, and Ctrl-C ends it.
#![deny(unsafe_code)]

mod arrays;
mod dataset;
mod diff;
mod drawn;
mod dsp;
mod engine;
mod errors;
mod lane;
mod process;
mod radar;
mod rcs;
mod scene;
mod show;
mod simulate;
mod tracking;
mod work;

use pyo3::prelude::*;

#[pymodule]
fn _catseye(m: &Bound<'_, PyModule>) -> PyResult<()> {
    catseye::gpu::quieten_loader();
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add("BadInput", m.py().get_type::<errors::BadInput>())?;
    m.add("Failed", m.py().get_type::<errors::Failed>())?;
    m.add_class::<engine::Engine>()?;
    m.add_class::<scene::Scene>()?;
    m.add_class::<radar::Radar>()?;
    m.add_class::<rcs::RcsResult>()?;
    m.add_class::<simulate::Scenario>()?;
    m.add_class::<simulate::Frames>()?;
    m.add_class::<simulate::Frame>()?;
    m.add_class::<process::Detections>()?;
    m.add_class::<dataset::Store>()?;
    m.add_class::<lane::LaneEstimator>()?;
    m.add_function(wrap_pyfunction!(lane::lane, m)?)?;
    m.add_function(wrap_pyfunction!(lane::lane_compare, m)?)?;
    m.add_function(wrap_pyfunction!(lane::lane_methods, m)?)?;
    m.add_function(wrap_pyfunction!(dataset::dataset, m)?)?;
    m.add_function(wrap_pyfunction!(dataset::recipe_facts, m)?)?;
    m.add_function(wrap_pyfunction!(dataset::verify, m)?)?;
    m.add_function(wrap_pyfunction!(diff::diff, m)?)?;
    m.add_function(wrap_pyfunction!(engine::devices, m)?)?;
    m.add_function(wrap_pyfunction!(scene::reflector, m)?)?;
    m.add_function(wrap_pyfunction!(scene::reflector_kinds, m)?)?;
    m.add_function(wrap_pyfunction!(scene::materials, m)?)?;
    m.add_function(wrap_pyfunction!(scene::road_scene, m)?)?;
    m.add_function(wrap_pyfunction!(radar::presets, m)?)?;
    m.add_function(wrap_pyfunction!(rcs::rcs, m)?)?;
    m.add_function(wrap_pyfunction!(simulate::simulate, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_range_transform, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_doppler_transform, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_range_doppler, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_power, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_cfar, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_threshold, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_separate, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_directions, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_angle_spectrum, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_grid, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_tensor, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_amplitudes, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_chirp_amplitudes, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_strongest, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_seen, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_masks, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_confidence, m)?)?;
    m.add_function(wrap_pyfunction!(dsp::dsp_object_cells, m)?)?;
    m.add_function(wrap_pyfunction!(tracking::dsp_cluster, m)?)?;
    m.add_function(wrap_pyfunction!(tracking::dsp_plots, m)?)?;
    m.add_class::<tracking::Tracker>()?;
    m.add_function(wrap_pyfunction!(show::picture_map, m)?)?;
    m.add_function(wrap_pyfunction!(show::picture_rcs, m)?)?;
    m.add_function(wrap_pyfunction!(show::picture_scene, m)?)?;
    m.add_function(wrap_pyfunction!(show::write_page, m)?)?;
    m.add_function(wrap_pyfunction!(process::process, m)?)
}

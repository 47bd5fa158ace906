//! Chains of facets to echoes, on the gpu engine; and the whole stage from a fan to returns.

use super::rays::{self, GeometryBuffers, cell_words, columns};
use super::{MAX_BOUNCES, Return, Returns, TraceOptions, scan};
use crate::error::Result;
use crate::frames::{Pose, Sensor, World};
use crate::geom::Geometry;
use crate::geom::upload::{GeometryArrays, split3};
use crate::gpu::{Access, Gpu, Kernel, Threads, Tolerance};
use crate::gpu_struct;
use crate::trace::ends::Ends;
use crate::trace::launch::Fan;
use crate::units::wavenumber;
use glam::DVec3;
use num_complex::Complex64;

gpu_struct! {
    /// Uniform of `shaders/trace/contribute.wgsl`.
    pub struct Params {
        pub origin_hi: [f32; 3],
        pub wavenumber: f32,
        pub origin_lo: [f32; 3],
        pub bounces: u32,
        pub axis0: [f32; 3],
        pub tubes: u32,
        pub axis1: [f32; 3],
        pub zero: u32,
        pub axis2: [f32; 3],
        pub pad0: u32,
        pub velocity: [f32; 3],
        pub pad1: u32,
        pub sensor0: [f32; 3],
        pub pad2: u32,
        pub sensor1: [f32; 3],
        pub pad3: u32,
        pub sensor2: [f32; 3],
        pub pad4: u32,
    }
}

gpu_struct! {
    /// One return as the shader writes it; directions in the world.
    pub struct Echo {
        pub spread_v: [f32; 4],
        pub spread_h: [f32; 4],
        pub departure: [f32; 3],
        pub first_range: f32,
        pub arrival: [f32; 3],
        pub last_range: f32,
        pub path_hi: f32,
        pub path_lo: f32,
        pub path_rate: f32,
        pub bounces: u32,
        pub chain: [u32; 4],
        pub half_phase: f32,
        pub goes_on: u32,
        pub pad0: u32,
        pub pad1: u32,
    }
}

pub static KERNEL: Kernel = Kernel {
    stem: "trace/contribute",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/complex.wgsl"),
        include_str!("../../shaders/shared/phase.wgsl"),
        include_str!("../../shaders/shared/df64.wgsl"),
        include_str!("../../shaders/shared/facet.wgsl"),
        include_str!("../../shaders/shared/field.wgsl"),
        include_str!("../../shaders/trace/contribute.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(Params::LAYOUT),
    storage: &[
        Access::Read,
        Access::Read,
        Access::Read,
        Access::Read,
        Access::Read,
        Access::Read,
        Access::Read,
        Access::ReadWrite,
    ],
    structs: &[Echo::LAYOUT],
    tolerance: Tolerance {
        relative_l2: 1e-4,
        reason: "f32 fields over a few reflections: some ten roundings of 6e-8, times the tube's phase span in the sinc",
    },
};

/// All echoes of a frame, as `cpu::trace::contribute::returns` gives them.
pub fn returns(
    gpu: &Gpu,
    geometry: &Geometry,
    fan: &Fan,
    pose: &Pose<Sensor, World>,
    velocity_mps: DVec3,
    options: &TraceOptions,
) -> Result<Returns> {
    let mut all = Vec::new();
    let to_sensor = pose.rotation.inverse();
    if !geometry.triangles.is_empty() && !fan.cells.is_empty() {
        let arrays = GeometryArrays::new(geometry)?;
        let mut recorder = gpu.recorder("geometry");
        let buffers = GeometryBuffers::upload(&mut recorder, &arrays);
        recorder.submit()?;
        // So many tubes that even if every bounce of each is seen the echoes fit one binding.
        let largest = (options.bounces * size_of::<Echo>()).max(32) as u64;
        let chunk = (gpu.max_binding_bytes() / largest).clamp(1, 1 << 22) as usize;
        for cells in fan.cells.chunks(chunk) {
            let tubes = cells.len();
            let mut recorder = gpu.recorder("trace");
            let words = recorder.upload("cells", &cell_words(fan, cells));
            let chains = recorder.buffer::<u32>("chains", tubes * (options.bounces + 2));
            let counts = recorder.buffer::<u32>("counts", tubes);
            rays::record(
                &mut recorder,
                &buffers,
                fan,
                tubes,
                options,
                geometry.t_min_m,
                &words,
                &chains,
                &counts,
            );
            let total = scan::record(&mut recorder, &counts, tubes);
            let total = recorder.read(&total);
            let mut done = recorder.submit()?;
            let echoes = done.take(total)[0] as usize;
            if echoes == 0 {
                continue;
            }
            let mut recorder = gpu.recorder("contribute");
            let out = recorder.buffer::<Echo>("echoes", echoes);
            let [origin_hi, origin_lo] = split3(fan.origin_m);
            let [axis0, axis1, axis2] = columns(fan.rotation);
            let [sensor0, sensor1, sensor2] = columns(pose.rotation);
            let params = Params {
                origin_hi,
                wavenumber: wavenumber(geometry.freq_hz) as f32,
                origin_lo,
                bounces: options.bounces as u32,
                axis0,
                tubes: tubes as u32,
                axis1,
                axis2,
                velocity: velocity_mps.as_vec3().to_array(),
                sensor0,
                sensor1,
                sensor2,
                ..Default::default()
            };
            recorder.dispatch(
                &KERNEL,
                &params,
                &[
                    &buffers.triangles,
                    &buffers.planes,
                    &buffers.surfaces,
                    &buffers.body_velocities,
                    &words,
                    &chains,
                    &counts,
                    &out,
                ],
                Threads::Linear(tubes as u64),
            );
            let read = recorder.read(&out);
            let mut done = recorder.submit()?;
            for e in done.take(read) {
                let goes_on = [e.goes_on & 1 != 0, e.goes_on & 2 != 0];
                if let Some(ends) = Ends::of(goes_on) {
                    let r = return_from_echo(&e, geometry, to_sensor);
                    ends.emit(r, e.half_phase as f64, wavenumber(geometry.freq_hz), &mut all);
                }
            }
        }
    }
    all.extend(super::points::point_returns(geometry, fan.origin_m, velocity_mps, to_sensor));
    super::drop_weak(&mut all, options.amplitude_floor);
    Ok(Returns { returns: all, rays: fan.cells.len() as u64 })
}

fn return_from_echo(e: &Echo, geometry: &Geometry, to_sensor: glam::DQuat) -> Return {
    let v = |a: [f32; 3]| DVec3::from_array(a.map(f64::from));
    let z = |s: &[f32; 4], i: usize| Complex64::new(s[2 * i] as f64, s[2 * i + 1] as f64);
    let mut chain = [0; MAX_BOUNCES];
    for (b, id) in chain.iter_mut().enumerate().take(e.bounces as usize) {
        *id = geometry.bodies[(e.chain[b / 2] >> (16 * (b % 2)) & 0xffff) as usize].id;
    }
    Return {
        path_length_m: e.path_hi as f64 + e.path_lo as f64,
        path_rate_mps: e.path_rate as f64,
        departure: to_sensor * v(e.departure),
        first_range_m: e.first_range as f64,
        arrival: to_sensor * v(e.arrival),
        last_range_m: e.last_range as f64,
        spread: [[z(&e.spread_v, 0), z(&e.spread_h, 0)], [z(&e.spread_v, 1), z(&e.spread_h, 1)]],
        chain,
        bounces: e.bounces as u8,
    }
}

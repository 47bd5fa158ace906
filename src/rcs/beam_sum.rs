//! Scattering matrix from exact beams, on the gpu engine (CONVENTIONS eq. 50-54).
//!
//! Beams of many aspects advance together, one bounce at a time (`trace::clipper`). The host adds up each aspect's polygons in f64.

use super::{BistaticAspect, Distance, Scattering};
use crate::base::error::{BadInput, Result};
use crate::base::units::C0;
use crate::geom::upload::surface_words;
use crate::geom::{Geometry, Surface};
use crate::gpu::{Access, AnyBuffer, Buffer, Done, Gpu, Kernel, Pending, Recorder, Tolerance};
use crate::trace::MAX_BOUNCES;
use crate::trace::beams::{BeamOptions, BeamParams, Port, RECORD};
use crate::trace::clipper::{Ahead, Beams, ClipBatch, Clipper, check};
use crate::trace::{beam_ahead, beam_clip, scan};
use num_complex::Complex64;

/// The kernel's row: sources, parameters, bindings and tolerance.
pub static KERNEL: Kernel = Kernel {
    stem: "rcs/beam_sum",
    sources: &[
        include_str!("../../shaders/shared/linear.wgsl"),
        include_str!("../../shaders/shared/complex.wgsl"),
        include_str!("../../shaders/shared/phase.wgsl"),
        include_str!("../../shaders/shared/field.wgsl"),
        include_str!("../../shaders/shared/polygon.wgsl"),
        include_str!("../../shaders/shared/beams.wgsl"),
        include_str!("../../shaders/rcs/beam_sum.wgsl"),
    ],
    workgroup: [64, 1, 1],
    params: Some(BeamParams::LAYOUT),
    storage: &[
        Access::Read,
        Access::Read,
        Access::Read,
        Access::Read,
        Access::Read,
        Access::Read,
        Access::ReadWrite,
        Access::ReadWrite,
    ],
    structs: &[],
    tolerance: Tolerance {
        relative_l2: 1e-4,
        reason: "f32 places: some roundings of 1e-7 of the target's size, as phase (1e-5 seen at 77 GHz on targets of \
                 0.1 to 0.2 m); at finite range also cells that rounding halves the other way",
    },
};

/// A frequency and the materials at it.
pub struct FrequencyPoint<'a> {
    /// Wavenumber, rad/m.
    pub wavenumber: f64,
    /// Surfaces at that frequency.
    pub surfaces: &'a [Surface],
}

/// Pairs of aspects and faces in one batch where the device is the cpu's driver, and at most elsewhere.
const ITEMS: [usize; 2] = [1 << 18, 1 << 22];

/// Pairs of aspects and faces in one batch: a GPU takes as many as one binding holds what is lit of, since each submission waits.
fn items(gpu: &Gpu) -> usize {
    let [few, many] = ITEMS;
    let room = gpu.max_binding_bytes() as usize / (RECORD * size_of::<[u32; 4]>());
    if gpu.is_hardware() { many.min(room.saturating_sub(1)) } else { few }
}

/// Stands in a contribution that is none, before the number of what the thread had no room for, as in the shader.
const NO_SUM: f32 = 3e38;

/// Cuts by which a polygon is shared out among threads where its phase is curved, which may make thousands
/// of cells.
const HALVINGS: u32 = 4;

/// Returns S of the geometry's facets for each aspect and each frequency (`[aspect][frequency]`), as
/// `rcs::cpu::beam_sum::by_beams` does.
///
/// # Errors
/// Returns an error for a polygon with more corners or pieces than a thread has room for, for more work than the adapter's driver allows
/// it, and for a single aspect that does not fit the adapter's buffers.
pub fn by_beams(
    gpu: &Gpu,
    geometry: &Geometry,
    frequencies: &[FrequencyPoint],
    aspects: &[BistaticAspect],
    distance: Distance,
    options: &BeamOptions,
) -> Result<Vec<Vec<Scattering>>> {
    let faces = geometry.faces();
    if faces.faces.is_empty() {
        return Ok(vec![vec![Scattering::default(); frequencies.len()]; aspects.len()]);
    }
    if options.bounces == 0 || options.bounces > MAX_BOUNCES {
        return Err(BadInput::new("the number of bounces is out of range")
            .key("bounces")
            .value(options.bounces)
            .allowed(format!("1 to {MAX_BOUNCES}"))
            .into());
    }
    if geometry.surfaces.len() > 1 << 16 {
        return Err(BadInput::new("too many materials for the gpu engine")
            .key("materials")
            .value(geometry.surfaces.len())
            .allowed("at most 65536")
            .remedy("use --device cpu")
            .into());
    }
    let kernels = [&KERNEL, &beam_clip::KERNEL, &scan::KERNEL, &beam_ahead::KERNEL];
    gpu.prepare(if options.bounces > 1 { &kernels } else { &kernels[..2] })?;
    // Monostatic aspects spare themselves the receiver's view.
    let monostatic = aspects.iter().all(BistaticAspect::is_monostatic);
    let halvings = if let Distance::At(_) = distance { HALVINGS } else { 0 };
    let mut recorder = gpu.recorder("beams");
    let clipper = Clipper::new(gpu, faces, options, monostatic, halvings, &mut recorder)?;
    let surfaces = frequencies.iter().map(|t| {
        let freq_hz = t.wavenumber * C0 / std::f64::consts::TAU;
        Ok(recorder.upload("surfaces", &surface_words(t.surfaces, freq_hz)?))
    });
    let sweep = BeamSweep { surfaces: surfaces.collect::<Result<Vec<_>>>()?, clipper, options, frequencies };
    // The first batch takes these uploads along.
    let mut begun = Some(recorder);
    let mut out = Vec::with_capacity(aspects.len());
    let mut rest = aspects;
    let mut most = (items(gpu) / faces.faces.len()).max(1);
    while !rest.is_empty() {
        let (batch, after) = rest.split_at(most.min(rest.len()));
        let ports: Vec<[Port; 2]> =
            batch.iter().map(|l| [distance.port(l.transmit), distance.port(l.receive)]).collect();
        let recorder = begun.take().unwrap_or_else(|| gpu.recorder("beams"));
        match sweep.batch(&ports, recorder)? {
            Some(mut sums) => {
                if let Distance::At(r) = distance {
                    // E_s = S e^{-jk 2r} / r^2, with the phase of the way to the origin and back taken out.
                    sums.iter_mut().flatten().for_each(|s| s.scale(r * r));
                }
                out.append(&mut sums);
                rest = after;
            }
            None if batch.len() > 1 => most = batch.len().div_ceil(2),
            None => {
                return Err(BadInput::new("the beams of one aspect exceed the adapter's buffers")
                    .key("bytes of a binding")
                    .value(gpu.max_binding_bytes())
                    .remedy("use --device cpu")
                    .into());
            }
        }
    }
    Ok(out)
}

/// What all batches of a sweep share.
struct BeamSweep<'a> {
    clipper: Clipper<'a>,
    options: &'a BeamOptions,
    frequencies: &'a [FrequencyPoint<'a>],
    /// Surfaces at each frequency.
    surfaces: Vec<Buffer<[f32; 4]>>,
}

/// What the receiver sees of each face.
struct VisibleFaces {
    records: Buffer<[u32; 4]>,
    from: Buffer<u32>,
}

/// The batch does not fit; half of it may.
struct TooMuch;

/// Contributions on their way to the host, for each frequency, with the beams that they belong to.
struct Radiated {
    starts: Vec<u32>,
    pending: Vec<Pending<[f32; 4]>>,
    last: bool,
}

/// Sums of a batch, for each aspect and each frequency.
struct Sums {
    of_aspect: Vec<Vec<Scattering>>,
    /// Words of a polygon among the contributions.
    shares: usize,
}

impl BeamSweep<'_> {
    /// Returns the sums of a batch, or None where it does not fit.
    fn batch(&self, ports: &[[Port; 2]], recorder: Recorder<'_>) -> Result<Option<Vec<Vec<Scattering>>>> {
        let mut sums = Sums {
            of_aspect: vec![vec![Scattering::default(); self.frequencies.len()]; ports.len()],
            shares: 2 << self.clipper.params.halvings,
        };
        if self.add_all(ports, recorder, &mut sums)?.is_err() {
            return Ok(None);
        }
        let mut sums = sums.of_aspect;
        for (of_aspect, [transmit, receive]) in sums.iter_mut().zip(ports) {
            let centre = self.clipper.centre;
            let ((lead_t, spread_t), (lead_r, spread_r)) = (transmit.lead(centre), receive.lead(centre));
            for (s, point) in of_aspect.iter_mut().zip(self.frequencies) {
                let z = Complex64::from_polar(spread_t * spread_r, -point.wavenumber * (lead_t + lead_r));
                s.every.iter_mut().chain(&mut s.last).flatten().for_each(|x| *x *= z);
            }
        }
        Ok(Some(sums))
    }

    /// Whether so many polygons and what they radiate fit.
    fn fit_beams(&self, len: usize) -> bool {
        let c = &self.clipper;
        c.fits_records(len) && c.fits::<[[f32; 4]; 2]>(len << c.params.halvings)
    }

    /// Follows the beams of all aspects, and adds up what they radiate.
    fn add_all(
        &self,
        ports: &[[Port; 2]],
        mut recorder: Recorder<'_>,
        sums: &mut Sums,
    ) -> Result<std::result::Result<(), TooMuch>> {
        let (clipper, options) = (&self.clipper, self.options);
        let faces = clipper.params.faces as usize;
        let items = ports.len() * faces;
        if !clipper.fits_records(items + 1) {
            // Uploads that stand in it are not this batch's alone.
            recorder.submit()?;
            return Ok(Err(TooMuch));
        }
        let batch = clipper.batch(&mut recorder, ports);

        // What the ports see of each face.
        let views = if clipper.params.monostatic != 0 { 1 } else { 2 };
        let mut counts = Vec::new();
        for view in 0..views {
            let lit = batch.count_lit(&mut recorder, items, view, None);
            let read = recorder.read(&lit.counts);
            counts.push((lit, read));
        }
        let trouble = recorder.read(&batch.troubles);
        let mut done = recorder.submit()?;
        check(done.take(trouble)[0])?;
        let counts: Vec<_> = counts.into_iter().map(|(b, pending)| (b, done.take(pending))).collect();
        if counts.iter().any(|(_, c)| !self.fit_beams(c[items] as usize)) {
            return Ok(Err(TooMuch));
        }

        let mut recorder = clipper.gpu.recorder("beams");
        let mut views = Vec::new();
        for (lit, host) in counts {
            let count = host[items] as usize;
            let records = batch.emit_lit(&mut recorder, &lit, None, count);
            let starts = (0..=ports.len()).map(|l| host[l * faces]).collect();
            views.push((Beams { records, count, starts }, lit.counts));
        }
        let Some((receiver, from)) = views.pop() else { return Ok(Err(TooMuch)) };
        let seen = VisibleFaces { records: receiver.records.clone(), from };
        let mut beams = views.pop().map_or(receiver, |(transmitter, _)| transmitter);

        for bounce in 1..=options.bounces {
            let go_on = bounce < options.bounces;
            let mut radiated = vec![self.radiate(&mut recorder, &batch, &beams, &seen, false)];
            if !go_on && !options.last {
                let trouble = recorder.read(&batch.troubles);
                let mut done = recorder.submit()?;
                check(done.take(trouble)[0])?;
                sums.add(done, radiated)?;
                break;
            }
            // What the reflected beams meet.
            let n = beams.count;
            let ahead = batch.count_ahead(&mut recorder, &beams, go_on);
            let counts = recorder.read(&ahead.counts);
            let trouble = recorder.read(&batch.troubles);
            let mut done = recorder.submit()?;
            check(done.take(trouble)[0])?;
            let [met, leaving] = Ahead::split(done.take(counts));
            sums.add(done, radiated)?;
            let (items, leave) = (met[n] as usize, leaving[n] as usize);
            if !self.fit_beams(leave) || !clipper.fits_records(items) {
                return Ok(Err(TooMuch));
            }

            recorder = clipper.gpu.recorder("beams");
            let (targets, records) = batch.emit_ahead(&mut recorder, &beams, &ahead, [items, leave]);
            let starts =
                |counts: &[u32]| beams.starts.iter().map(|s| counts[*s as usize]).collect::<Vec<_>>();
            let exits = Beams { records, count: leave, starts: starts(&leaving) };
            radiated = match options.last {
                true => vec![self.radiate(&mut recorder, &batch, &exits, &seen, true)],
                false => Vec::new(),
            };
            let counted = batch.count_lit(&mut recorder, items, 0, Some((&beams, &targets)));
            let read_counts = recorder.read(&counted.counts);
            let trouble = recorder.read(&batch.troubles);
            let mut done = recorder.submit()?;
            check(done.take(trouble)[0])?;
            let counts = done.take(read_counts);
            sums.add(done, radiated)?;
            let lit = counts[items] as usize;
            if lit == 0 {
                break;
            }
            if !self.fit_beams(lit) {
                return Ok(Err(TooMuch));
            }

            recorder = clipper.gpu.recorder("beams");
            let records = batch.emit_lit(&mut recorder, &counted, Some((&beams, &targets)), lit);
            let starts = starts(&met).iter().map(|i| counts[*i as usize]).collect();
            beams = Beams { records, count: lit, starts };
        }
        Ok(Ok(()))
    }

    fn radiate(
        &self,
        recorder: &mut Recorder<'_>,
        batch: &ClipBatch<'_>,
        beams: &Beams,
        seen: &VisibleFaces,
        last: bool,
    ) -> Radiated {
        let clipper = &self.clipper;
        let shares = 1 << clipper.params.halvings;
        let mut pending = Vec::with_capacity(self.frequencies.len());
        for (point, surfaces) in self.frequencies.iter().zip(&self.surfaces) {
            let sums = recorder.buffer::<[f32; 4]>("contributions", 2 * shares * beams.count);
            let params = BeamParams {
                count: (shares * beams.count) as u32,
                wavenumber: point.wavenumber as f32,
                ..clipper.params
            };
            let storage: [&dyn AnyBuffer; 8] = [
                &clipper.body,
                &batch.aspects,
                &beams.records,
                &seen.records,
                &seen.from,
                surfaces,
                &sums,
                &clipper.scratch,
            ];
            clipper.dispatch(recorder, &KERNEL, params, &storage);
            pending.push(recorder.read(&sums));
        }
        Radiated { starts: beams.starts.clone(), pending, last }
    }
}

impl Sums {
    /// Adds what was radiated, or says what a thread had no room for.
    fn add(&mut self, mut done: Done, radiated: Vec<Radiated>) -> Result<()> {
        for r in radiated {
            for (point, pending) in r.pending.into_iter().enumerate() {
                let sums = done.take(pending);
                for (aspect, range) in r.starts.windows(2).enumerate() {
                    let s = &mut self.of_aspect[aspect][point];
                    let s = if r.last { &mut s.last } else { &mut s.every };
                    let of_beams = &sums[self.shares * range[0] as usize..self.shares * range[1] as usize];
                    for of_beam in of_beams.chunks_exact(2) {
                        if of_beam[0][0] == NO_SUM {
                            check(of_beam[0][1] as u32)?;
                        }
                        for (tx, z) in of_beam.iter().enumerate() {
                            s[0][tx] += Complex64::new(z[0].into(), z[1].into());
                            s[1][tx] += Complex64::new(z[2].into(), z[3].into());
                        }
                    }
                }
            }
        }
        Ok(())
    }
}

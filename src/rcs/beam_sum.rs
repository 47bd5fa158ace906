//! Scattering matrix from exact beams, on the gpu engine (CONVENTIONS eq. 50-54).
//!
//! Beams of many aspects advance together, one bounce at a time. What comes out of a step is first counted,
//! then written to slots that prefix sums give, so that all beams of a aspect stand together and in the same
//! order in every run. The host adds up each aspect's polygons in f64.

use super::{BistaticAspect, Distance, Scattering};
use crate::base::error::{BadInput, Error, Result};
use crate::base::units::C0;
use crate::geom::upload::surface_words;
use crate::geom::{Geometry, Surface};
use crate::gpu::{Access, AnyBuffer, Buffer, Gpu, Kernel, Pending, Recorder, Threads, Tolerance};
use crate::trace::beams::{BeamArrays, BeamOptions, MOST_FACES, Params, Port, RECORD, SCRATCH};
use crate::trace::{MAX_BOUNCES, beam_ahead, beam_clip, scan};
use glam::DVec3;
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
    params: Some(Params::LAYOUT),
    storage: &[
        Access::Read,
        Access::Read,
        Access::Read,
        Access::Read,
        Access::Read,
        Access::Read,
        Access::ReadWrite,
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

/// Pairs of aspects and faces in one batch.
const ITEMS: usize = 1 << 18;
/// Threads of a dispatch, whose scratch memory is theirs alone: many for a GPU; few for a driver on the cpu,
/// where it is to stay in the cache, and no power of two, which would put a thread's words into one set.
const THREADS: [usize; 2] = [1 << 15, 1016];

/// Cuts by which a polygon is shared out among threads where its phase is curved, which may make thousands
/// of cells.
const HALVINGS: u32 = 4;

/// S of the geometry's facets for each aspect and each frequency (`[aspect][frequency]`), as
/// `rcs::cpu::beam_sum::by_beams` gives it.
///
/// # Errors
/// A polygon with more corners or pieces than a thread has room for, or more work than the adapter's driver allows
/// it; a single aspect that does not fit the adapter's buffers.
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
    if faces.faces.len() > MOST_FACES || faces.nodes.iter().any(|n| n.count > 255) {
        return Err(BadInput::new("too many faces for the gpu engine")
            .key("faces")
            .value(faces.faces.len())
            .allowed(format!("at most {MOST_FACES}, 255 of them in one place"))
            .remedy("use --device cpu")
            .into());
    }
    // Monostatic aspects spare themselves the receiver's view.
    let monostatic = aspects.iter().all(BistaticAspect::is_monostatic);
    let mut arrays = BeamArrays::new(faces, options, monostatic);
    if let Distance::At(_) = distance {
        arrays.params.halvings = HALVINGS;
    }
    let mut recorder = gpu.recorder("faces");
    let threads = THREADS[!gpu.report().is_hardware as usize]
        .min((gpu.max_binding_bytes() / (8 * SCRATCH as u64)) as usize)
        .max(64);
    let shared = Shared {
        gpu,
        options,
        frequencies,
        centre: faces.centre_m,
        params: arrays.params,
        body: recorder.upload("faces", &arrays.body),
        surfaces: frequencies
            .iter()
            .map(|t| {
                let freq_hz = t.wavenumber * C0 / std::f64::consts::TAU;
                Ok(recorder.upload("surfaces", &surface_words(t.surfaces, freq_hz)?))
            })
            .collect::<Result<Vec<_>>>()?,
        no_records: recorder.zeros("none", 1),
        no_items: recorder.zeros("none", 1),
        threads,
        scratch: recorder.buffer("scratch", threads * SCRATCH),
    };
    recorder.submit()?;
    let mut out = Vec::with_capacity(aspects.len());
    let mut rest = aspects;
    let mut most = (ITEMS / faces.faces.len()).max(1);
    while !rest.is_empty() {
        let (batch, after) = rest.split_at(most.min(rest.len()));
        let ports: Vec<[Port; 2]> =
            batch.iter().map(|l| [distance.port(l.transmit), distance.port(l.receive)]).collect();
        match shared.batch(&ports)? {
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
                return Err(BadInput::new("the beams of one look do not fit the adapter's buffers")
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
struct Shared<'a> {
    gpu: &'a Gpu,
    options: &'a BeamOptions,
    frequencies: &'a [FrequencyPoint<'a>],
    centre: DVec3,
    params: Params,
    body: Buffer<[u32; 4]>,
    /// For each frequency.
    surfaces: Vec<Buffer<[f32; 4]>>,
    no_records: Buffer<[u32; 4]>,
    no_items: Buffer<[u32; 2]>,
    threads: usize,
    scratch: Buffer<[f32; 2]>,
}

/// Polygons of one bounce, those of a aspect side by side.
#[derive(Clone)]
struct Beams {
    records: Buffer<[u32; 4]>,
    count: usize,
    /// First beam of each aspect, and the number of all.
    starts: Vec<u32>,
}

/// Beams and the faces that they may light (a record's index and a face's); None: all faces from the ports.
type Targets<'a> = Option<(&'a Beams, &'a Buffer<[u32; 2]>)>;

/// Where to write the faces that beams meet and the parts of them that leave.
type Found<'a> = (&'a Buffer<[u32; 2]>, &'a Buffer<[u32; 4]>);

/// What is lit of each item, counted.
struct Lit {
    items: usize,
    view: usize,
    counts: Buffer<u32>,
    singles: Buffer<[u32; 4]>,
}

/// What the receiver sees of each face.
struct VisibleFaces {
    records: Buffer<[u32; 4]>,
    from: Buffer<u32>,
}

/// The batch does not fit; half of it may.
struct TooMuch;

impl Shared<'_> {
    fn batch(&self, ports: &[[Port; 2]]) -> Result<Option<Vec<Vec<Scattering>>>> {
        let mut run = Batch {
            shared: self,
            aspects: None,
            troubles: None,
            sums: vec![vec![Scattering::default(); self.frequencies.len()]; ports.len()],
        };
        if run.all(ports)?.is_err() {
            return Ok(None);
        }
        let mut sums = run.sums;
        for (of_aspect, [transmit, receive]) in sums.iter_mut().zip(ports) {
            let ((lead_t, spread_t), (lead_r, spread_r)) =
                (transmit.lead(self.centre), receive.lead(self.centre));
            for (s, point) in of_aspect.iter_mut().zip(self.frequencies) {
                let z = Complex64::from_polar(spread_t * spread_r, -point.wavenumber * (lead_t + lead_r));
                s.every.iter_mut().chain(&mut s.last).flatten().for_each(|x| *x *= z);
            }
        }
        Ok(Some(sums))
    }

    fn fits<T>(&self, len: usize) -> bool {
        len < u32::MAX as usize / RECORD && (len * size_of::<T>()) as u64 <= self.gpu.max_binding_bytes()
    }

    /// Whether so many polygons and what they radiate fit.
    fn fit_beams(&self, len: usize) -> bool {
        self.fits::<[[u32; 4]; RECORD]>(len) && self.fits::<[[f32; 4]; 2]>(len << self.params.halvings)
    }
}

struct Batch<'a> {
    shared: &'a Shared<'a>,
    aspects: Option<Buffer<[f32; 4]>>,
    troubles: Option<Buffer<u32>>,
    sums: Vec<Vec<Scattering>>,
}

/// Contributions on their way to the host, for each frequency, with the beams that they belong to.
struct Radiated {
    starts: Vec<u32>,
    pending: Vec<Pending<[f32; 4]>>,
    last: bool,
}

impl Batch<'_> {
    fn all(&mut self, ports: &[[Port; 2]]) -> Result<std::result::Result<(), TooMuch>> {
        let shared = self.shared;
        let (options, faces) = (shared.options, shared.params.faces as usize);
        let items = ports.len() * faces;
        if !shared.fits::<[[u32; 4]; RECORD]>(items + 1) {
            return Ok(Err(TooMuch));
        }
        let words: Vec<[f32; 4]> = ports.iter().flatten().flat_map(|p| p.words(shared.centre)).collect();
        let mut recorder = shared.gpu.recorder("beams");
        let aspects = recorder.upload("aspects", &words);
        let troubles = recorder.zeros::<u32>("troubles", 1);
        (self.aspects, self.troubles) = (Some(aspects), Some(troubles.clone()));

        // What the ports see of each face.
        let views = if shared.params.monostatic != 0 { 1 } else { 2 };
        let mut counts = Vec::new();
        for view in 0..views {
            let lit = self.count_lit(&mut recorder, items, view, None);
            let read = recorder.read(&lit.counts);
            counts.push((lit, read));
        }
        let trouble = recorder.read(&troubles);
        let mut done = recorder.submit()?;
        check(done.take(trouble)[0])?;
        let mut ahead: Vec<(Lit, Vec<u32>)> =
            counts.into_iter().map(|(b, pending)| (b, done.take(pending))).collect();
        if ahead.iter().any(|(_, c)| !shared.fit_beams(c[items] as usize)) {
            return Ok(Err(TooMuch));
        }

        let mut recorder = shared.gpu.recorder("beams");
        let mut views = Vec::new();
        for (lit, host) in ahead.drain(..) {
            let count = host[items] as usize;
            let records = recorder.buffer("beams", count * RECORD);
            self.emit_lit(&mut recorder, &lit, None, &records);
            let starts = (0..=ports.len()).map(|l| host[l * faces]).collect();
            views.push((Beams { records, count, starts }, lit.counts));
        }
        let Some((receiver, from)) = views.pop() else { return Ok(Err(TooMuch)) };
        let seen = VisibleFaces { records: receiver.records.clone(), from };
        let mut beams = views.pop().map_or(receiver, |(transmitter, _)| transmitter);

        for bounce in 1..=options.bounces {
            let go_on = bounce < options.bounces;
            let mut radiated = vec![self.radiate(&mut recorder, &beams, &seen, false)];
            if !go_on && !options.last {
                let trouble = recorder.read(&troubles);
                let mut done = recorder.submit()?;
                check(done.take(trouble)[0])?;
                self.add(done, radiated);
                break;
            }
            // What the reflected beams meet.
            let n = beams.count;
            let met = recorder.zeros::<u32>("faces met", n + 1);
            let leaving = recorder.zeros::<u32>("parts that leave", n + 1);
            self.ahead(&mut recorder, &beams, 0, go_on, [&met, &leaving], None);
            scan::record(&mut recorder, &met, n + 1);
            scan::record(&mut recorder, &leaving, n + 1);
            let (read_met, read_leaving) = (recorder.read(&met), recorder.read(&leaving));
            let trouble = recorder.read(&troubles);
            let mut done = recorder.submit()?;
            check(done.take(trouble)[0])?;
            let (met_host, leaving_host) = (done.take(read_met), done.take(read_leaving));
            self.add(done, radiated);
            let (items, leave) = (met_host[n] as usize, leaving_host[n] as usize);
            if !shared.fit_beams(leave) || !shared.fits::<[[u32; 4]; RECORD]>(items) {
                return Ok(Err(TooMuch));
            }

            recorder = shared.gpu.recorder("beams");
            let targets = recorder.buffer::<[u32; 2]>("targets", items);
            let records = recorder.buffer("parts that leave", leave * RECORD);
            self.ahead(&mut recorder, &beams, 1, go_on, [&met, &leaving], Some((&targets, &records)));
            let starts =
                |counts: &[u32]| beams.starts.iter().map(|s| counts[*s as usize]).collect::<Vec<_>>();
            let exits = Beams { records, count: leave, starts: starts(&leaving_host) };
            radiated = match options.last {
                true => vec![self.radiate(&mut recorder, &exits, &seen, true)],
                false => Vec::new(),
            };
            let counted = self.count_lit(&mut recorder, items, 0, Some((&beams, &targets)));
            let read_counts = recorder.read(&counted.counts);
            let trouble = recorder.read(&troubles);
            let mut done = recorder.submit()?;
            check(done.take(trouble)[0])?;
            let counts_host = done.take(read_counts);
            self.add(done, radiated);
            let lit = counts_host[items] as usize;
            if lit == 0 {
                break;
            }
            if !shared.fit_beams(lit) {
                return Ok(Err(TooMuch));
            }

            recorder = shared.gpu.recorder("beams");
            let records = recorder.buffer("beams", lit * RECORD);
            self.emit_lit(&mut recorder, &counted, Some((&beams, &targets)), &records);
            let starts = starts(&met_host).iter().map(|i| counts_host[*i as usize]).collect();
            beams = Beams { records, count: lit, starts };
        }
        Ok(Ok(()))
    }

    /// Counts what is lit into the buffer returned, which holds their sums then, and keeps single pieces; from
    /// a port (`view` 1 is the receiver's) or from beams to their targets.
    fn count_lit(&self, recorder: &mut Recorder<'_>, items: usize, view: usize, from: Targets<'_>) -> Lit {
        let counts = recorder.zeros("lit counts", items + 1);
        let singles = recorder.buffer("single pieces", items * RECORD);
        let lit = Lit { items, view, counts, singles };
        self.clip(recorder, &lit, 0, from, &lit.singles, &self.shared.no_records);
        scan::record(recorder, &lit.counts, items + 1);
        lit
    }

    /// Writes what was counted.
    fn emit_lit(&self, recorder: &mut Recorder<'_>, lit: &Lit, from: Targets<'_>, out: &Buffer<[u32; 4]>) {
        self.clip(recorder, lit, 1, from, out, &lit.singles);
    }

    fn clip(
        &self,
        recorder: &mut Recorder<'_>,
        lit: &Lit,
        mode: u32,
        from: Targets<'_>,
        out: &Buffer<[u32; 4]>,
        singles: &Buffer<[u32; 4]>,
    ) {
        let shared = self.shared;
        let (Some(aspects), Some(troubles)) = (&self.aspects, &self.troubles) else { return };
        let params = Params {
            count: lit.items as u32,
            mode,
            level: from.is_some() as u32,
            port: lit.view as u32,
            ..shared.params
        };
        let (records, targets) = match from {
            Some((beams, targets)) => (&beams.records, targets),
            None => (&shared.no_records, &shared.no_items),
        };
        let storage: [&dyn AnyBuffer; 9] =
            [&shared.body, aspects, records, targets, &lit.counts, out, &shared.scratch, singles, troubles];
        self.dispatch(recorder, &beam_clip::KERNEL, params, &storage);
    }

    fn ahead(
        &self,
        recorder: &mut Recorder<'_>,
        beams: &Beams,
        mode: u32,
        go_on: bool,
        [met, leaving]: [&Buffer<u32>; 2],
        out: Option<Found<'_>>,
    ) {
        let shared = self.shared;
        let (Some(aspects), Some(troubles)) = (&self.aspects, &self.troubles) else { return };
        let params = Params { count: beams.count as u32, mode, go_on: go_on as u32, ..shared.params };
        let (items, exits) = out.unwrap_or((&shared.no_items, &shared.no_records));
        let storage: [&dyn AnyBuffer; 9] =
            [&shared.body, aspects, &beams.records, met, leaving, items, exits, &shared.scratch, troubles];
        self.dispatch(recorder, &beam_ahead::KERNEL, params, &storage);
    }

    /// As many threads at a time as have scratch memory.
    fn dispatch(
        &self,
        recorder: &mut Recorder<'_>,
        kernel: &'static Kernel,
        params: Params,
        storage: &[&dyn AnyBuffer],
    ) {
        let most = self.shared.threads as u32;
        for first in (0..params.count).step_by(most as usize) {
            let threads = most.min(params.count - first);
            let params = Params { first, threads, ..params };
            recorder.dispatch(kernel, &params, storage, Threads::Linear(threads.into()));
        }
    }

    fn radiate(
        &self,
        recorder: &mut Recorder<'_>,
        beams: &Beams,
        seen: &VisibleFaces,
        last: bool,
    ) -> Radiated {
        let shared = self.shared;
        let shares = 1 << shared.params.halvings;
        let mut pending = Vec::with_capacity(shared.frequencies.len());
        if let (Some(aspects), Some(troubles)) = (&self.aspects, &self.troubles) {
            for (point, surfaces) in shared.frequencies.iter().zip(&shared.surfaces) {
                let sums = recorder.buffer::<[f32; 4]>("contributions", 2 * shares * beams.count);
                let params = Params {
                    count: (shares * beams.count) as u32,
                    wavenumber: point.wavenumber as f32,
                    ..shared.params
                };
                let storage: [&dyn AnyBuffer; 9] = [
                    &shared.body,
                    aspects,
                    &beams.records,
                    &seen.records,
                    &seen.from,
                    surfaces,
                    &sums,
                    &shared.scratch,
                    troubles,
                ];
                self.dispatch(recorder, &KERNEL, params, &storage);
                pending.push(recorder.read(&sums));
            }
        }
        Radiated { starts: beams.starts.clone(), pending, last }
    }

    fn add(&mut self, mut done: crate::gpu::Done, radiated: Vec<Radiated>) {
        let shares = 2 << self.shared.params.halvings;
        for r in radiated {
            for (point, pending) in r.pending.into_iter().enumerate() {
                let sums = done.take(pending);
                for (aspect, range) in r.starts.windows(2).enumerate() {
                    let s = &mut self.sums[aspect][point];
                    let s = if r.last { &mut s.last } else { &mut s.every };
                    for of_beam in
                        sums[shares * range[0] as usize..shares * range[1] as usize].chunks_exact(2)
                    {
                        for (tx, z) in of_beam.iter().enumerate() {
                            s[0][tx] += Complex64::new(z[0].into(), z[1].into());
                            s[1][tx] += Complex64::new(z[2].into(), z[3].into());
                        }
                    }
                }
            }
        }
    }
}

/// What a thread had no room for.
fn check(trouble: u32) -> Result<()> {
    let causes = [
        "polygons of more than 22 corners",
        "more than 32 pieces of a face in view",
        "more steps than the adapter's driver allows a thread",
    ];
    if trouble == 0 {
        return Ok(());
    }
    let found: Vec<&str> =
        causes.iter().enumerate().filter(|(i, _)| trouble >> i & 1 != 0).map(|(_, c)| *c).collect();
    Err(Error::Failed(format!(
        "the target is too intricate for the beams of the gpu engine ({}): use --device cpu",
        found.join(", ")
    )))
}

//! Clipping of beams on the device, level by level: what ports light of faces (`beam_clip`), which faces stand ahead of reflected beams
//! and what leaves between them (`beam_ahead`). What comes out of a step is first counted, then written to slots that prefix sums give, so
//! that all beams of one aspect stand together and in the same order in every run.

use super::beams::{BeamArrays, BeamOptions, BeamParams, MOST_FACES, Port, RECORD, SCRATCH};
use super::{beam_ahead, beam_clip, scan};
use crate::base::error::{BadInput, Error, Result};
use crate::geom::faces::Faces;
use crate::gpu::{AnyBuffer, Buffer, Gpu, Kernel, Recorder, Threads};
use glam::DVec3;

/// Threads of a dispatch, whose scratch memory is theirs alone: many for a GPU; few for a driver on the cpu,
/// where it is to stay in the cache, and no power of two, which would put a thread's words into one set.
const THREADS: [usize; 2] = [1 << 15, 1016];

/// The faces of a scene on the device, and the memory in which beams are clipped against them.
pub struct Clipper<'a> {
    /// The device.
    pub gpu: &'a Gpu,
    /// Point to which places on the device are relative, m.
    pub centre: DVec3,
    /// What holds for every dispatch.
    pub params: BeamParams,
    /// Faces, their corners and the tree over them ([`BeamArrays::body`]).
    pub body: Buffer<[u32; 4]>,
    no_records: Buffer<[u32; 4]>,
    no_items: Buffer<[u32; 2]>,
    threads: usize,
    /// Scratch memory of each thread.
    pub scratch: Buffer<[f32; 2]>,
}

/// Polygons of one level on the device, those of an aspect side by side.
#[derive(Clone)]
pub struct Beams {
    /// [`RECORD`] words for each polygon.
    pub records: Buffer<[u32; 4]>,
    /// Number of polygons.
    pub count: usize,
    /// Index of the first beam of each aspect, and the number of all at the end.
    pub starts: Vec<u32>,
}

/// Beams with the faces that each may light, as pairs of a record's index and a face's; with None all faces are lit
/// from the ports.
pub type Targets<'a> = Option<(&'a Beams, &'a Buffer<[u32; 2]>)>;

/// Numbers of the polygons that each item lights.
pub struct Lit {
    items: usize,
    view: usize,
    /// Exclusive prefix sums of the polygons of each item, with their number at the end, once [`ClipBatch::count_lit`]
    /// is recorded.
    pub counts: Buffer<u32>,
    singles: Buffer<[u32; 4]>,
}

/// Numbers of what stands ahead of each beam.
pub struct Ahead {
    go_on: bool,
    /// Exclusive prefix sums of the faces that each beam meets and then of its parts that leave, in one row ([`Self::split`]).
    pub counts: Buffer<u32>,
}

impl Ahead {
    /// Returns the exclusive prefix sums of the faces that beams meet and of the parts of beams that leave the target, each with its
    /// total at the end, given the values of [`Ahead::counts`].
    pub fn split(mut counts: Vec<u32>) -> [Vec<u32>; 2] {
        let mut leaving = counts.split_off(counts.len() / 2);
        let all_met = leaving.first().copied().unwrap_or(0);
        leaving.iter_mut().for_each(|sum| *sum = sum.wrapping_sub(all_met));
        [counts, leaving]
    }
}

impl<'a> Clipper<'a> {
    /// Uploads `faces`; `monostatic` says that every receiver is at its transmitter. A polygon is shared out among 2^`halvings` threads
    /// where it is summed up.
    ///
    /// # Errors
    /// Returns an error for more faces than the shaders' tree can tell apart.
    pub fn new(
        gpu: &'a Gpu,
        faces: &Faces,
        options: &BeamOptions,
        monostatic: bool,
        halvings: u32,
        recorder: &mut Recorder<'_>,
    ) -> Result<Clipper<'a>> {
        if faces.faces.len() > MOST_FACES || faces.nodes.iter().any(|n| n.count > 255) {
            return Err(BadInput::new("too many faces for the gpu engine")
                .key("faces")
                .value(faces.faces.len())
                .allowed(format!("at most {MOST_FACES}, 255 of them at one position"))
                .remedy("use --device cpu")
                .into());
        }
        let arrays = BeamArrays::new(faces, options, monostatic);
        let threads = THREADS[!gpu.is_hardware() as usize]
            .min((gpu.max_binding_bytes() / (8 * SCRATCH as u64)) as usize)
            .max(64);
        Ok(Clipper {
            gpu,
            centre: faces.centre_m,
            params: BeamParams { halvings, ..arrays.params },
            body: recorder.upload("faces", &arrays.body),
            no_records: recorder.zeros("none", 1),
            no_items: recorder.zeros("none", 1),
            threads,
            scratch: recorder.buffer("scratch", threads * SCRATCH),
        })
    }

    /// Whether a buffer of `len` values fits one binding, and its words an index.
    pub fn fits<T>(&self, len: usize) -> bool {
        len < u32::MAX as usize / RECORD && (len * size_of::<T>()) as u64 <= self.gpu.max_binding_bytes()
    }

    /// Whether a buffer of `len` polygons fits one binding.
    pub fn fits_records(&self, len: usize) -> bool {
        self.fits::<[[u32; 4]; RECORD]>(len)
    }

    /// Uploads the ports of a batch of aspects, transmitter and receiver of each.
    pub fn batch(&self, recorder: &mut Recorder<'_>, ports: &[[Port; 2]]) -> ClipBatch<'_> {
        let words: Vec<[f32; 4]> = ports.iter().flatten().flat_map(|p| p.words(self.centre)).collect();
        ClipBatch {
            clipper: self,
            aspects: recorder.upload("aspects", &words),
            troubles: recorder.zeros::<u32>("troubles", 1),
        }
    }

    /// Dispatches `params.count` threads of `kernel`, as many at a time as have scratch memory.
    pub fn dispatch(
        &self,
        recorder: &mut Recorder<'_>,
        kernel: &'static Kernel,
        params: BeamParams,
        storage: &[&dyn AnyBuffer],
    ) {
        let most = self.threads as u32;
        for first in (0..params.count).step_by(most as usize) {
            let threads = most.min(params.count - first);
            let params = BeamParams { first, threads, ..params };
            recorder.dispatch(kernel, &params, storage, Threads::Linear(threads.into()));
        }
    }
}

/// Aspects whose beams are clipped together.
pub struct ClipBatch<'a> {
    clipper: &'a Clipper<'a>,
    /// Frames of the ports, three words each ([`Port::words`]).
    pub aspects: Buffer<[f32; 4]>,
    /// One word, in which threads mark what they had no room for ([`check`] reads it).
    pub troubles: Buffer<u32>,
}

impl ClipBatch<'_> {
    /// Counts what is lit of `items`, from a port (`view` 1 is the receiver's) or from beams to their targets, and keeps single pieces.
    pub fn count_lit(
        &self,
        recorder: &mut Recorder<'_>,
        items: usize,
        view: usize,
        from: Targets<'_>,
    ) -> Lit {
        let counts = recorder.zeros("lit counts", items + 1);
        let singles = recorder.buffer("single pieces", items * RECORD);
        let lit = Lit { items, view, counts, singles };
        let params = self.clip_params(&lit, 0, from);
        self.clipper.dispatch(
            recorder,
            &beam_clip::KERNEL,
            params,
            &self.clip_storage(&lit, from, &lit.singles),
        );
        scan::record(recorder, &lit.counts, items + 1);
        lit
    }

    /// Writes the `count` polygons that [`Self::count_lit`] counted.
    pub fn emit_lit(
        &self,
        recorder: &mut Recorder<'_>,
        lit: &Lit,
        from: Targets<'_>,
        count: usize,
    ) -> Buffer<[u32; 4]> {
        let records = recorder.buffer("beams", count * RECORD);
        let params = self.clip_params(lit, 1, from);
        let mut storage = self.clip_storage(lit, from, &records);
        self.clipper.dispatch(recorder, &beam_clip::KERNEL, params, &storage);
        // Copying takes no scratch memory, so all items go at once.
        storage[2] = &lit.singles;
        let params = BeamParams { threads: params.count, mode: 2, ..params };
        recorder.dispatch(&beam_clip::KERNEL, &params, &storage, Threads::Linear(params.count.into()));
        records
    }

    fn clip_params(&self, lit: &Lit, mode: u32, from: Targets<'_>) -> BeamParams {
        BeamParams {
            count: lit.items as u32,
            mode,
            level: from.is_some() as u32,
            port: lit.view as u32,
            ..self.clipper.params
        }
    }

    fn clip_storage<'b>(
        &'b self,
        lit: &'b Lit,
        from: Targets<'b>,
        out: &'b Buffer<[u32; 4]>,
    ) -> [&'b dyn AnyBuffer; 8] {
        let clipper = self.clipper;
        let (records, targets) = match from {
            Some((beams, targets)) => (&beams.records, targets),
            None => (&clipper.no_records, &clipper.no_items),
        };
        [&clipper.body, &self.aspects, records, targets, &lit.counts, out, &clipper.scratch, &self.troubles]
    }

    /// Counts the faces that `beams` meet, if they `go_on`, and the parts of them that leave.
    pub fn count_ahead(&self, recorder: &mut Recorder<'_>, beams: &Beams, go_on: bool) -> Ahead {
        let n = 2 * (beams.count + 1);
        let ahead = Ahead { go_on, counts: recorder.zeros("faces met and parts that leave", n) };
        let clipper = self.clipper;
        self.ahead(recorder, beams, 0, &ahead, &clipper.no_items, &clipper.no_records);
        scan::record(recorder, &ahead.counts, n);
        ahead
    }

    /// Writes what [`Self::count_ahead`] counted: `met` pairs of a beam's index and a face's, and `leaving` polygons.
    pub fn emit_ahead(
        &self,
        recorder: &mut Recorder<'_>,
        beams: &Beams,
        ahead: &Ahead,
        [met, leaving]: [usize; 2],
    ) -> (Buffer<[u32; 2]>, Buffer<[u32; 4]>) {
        let targets = recorder.buffer("targets", met);
        let records = recorder.buffer("parts that leave", leaving * RECORD);
        self.ahead(recorder, beams, 1, ahead, &targets, &records);
        (targets, records)
    }

    fn ahead(
        &self,
        recorder: &mut Recorder<'_>,
        beams: &Beams,
        mode: u32,
        ahead: &Ahead,
        items: &Buffer<[u32; 2]>,
        exits: &Buffer<[u32; 4]>,
    ) {
        let clipper = self.clipper;
        let params =
            BeamParams { count: beams.count as u32, mode, go_on: ahead.go_on as u32, ..clipper.params };
        let storage: [&dyn AnyBuffer; 8] = [
            &clipper.body,
            &self.aspects,
            &beams.records,
            &ahead.counts,
            items,
            exits,
            &clipper.scratch,
            &self.troubles,
        ];
        clipper.dispatch(recorder, &beam_ahead::KERNEL, params, &storage);
    }
}

/// Reports what threads had no room for, given the word of [`ClipBatch::troubles`].
///
/// # Errors
/// Returns an error if the word is not 0, which says what a thread had no room for.
pub fn check(trouble: u32) -> Result<()> {
    let causes = [
        "polygons of more than 22 corners",
        "more than 32 fragments of a face in the beam",
        "more steps than the adapter's driver allows a thread",
    ];
    if trouble == 0 {
        return Ok(());
    }
    let found: Vec<&str> =
        causes.iter().enumerate().filter(|(i, _)| trouble >> i & 1 != 0).map(|(_, c)| *c).collect();
    Err(Error::Failed(format!(
        "the target is too complex for the beams of the gpu engine ({}): use --device cpu",
        found.join(", ")
    )))
}

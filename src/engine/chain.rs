//! From geometry to detected cells.

use super::{AnyCube, Engine, Extent, Precision, Stage, StageCounts};
use crate::adc::convert::Convert;
use crate::adc::cpu::front_end::Inputs;
use crate::adc::front_end::{Chain, channels};
use crate::adc::grid_device;
use crate::adc::interference::Arrival;
use crate::adc::methods::Methods;
use crate::adc::noise::Noise;
use crate::adc::shaping::Shaping;
use crate::adc::synthesis::{EchoSummary, Plan};
use crate::adc::{Cube, DeviceCube};
use crate::base::control::Control;
use crate::base::error::{Error, Result};
use crate::dsp::device::{CELLS, PendingFrame, PendingMap, TakenFrame};
use crate::dsp::doa_beamform::{BeamCells, Beamformer};
use crate::dsp::doa_spectrum::{Forms, Steering};
use crate::dsp::stream::Source;
use crate::dsp::transform::Transform;
use crate::dsp::zero_doppler::AtRest;
use crate::dsp::{self, RangeDoppler, Snapshots};
use crate::gpu::{Gpu, Pending, Recorder};
use crate::scene::front_end::FrontEndSettings;
use crate::scene::radar::{Cfar, Radar};
use crate::scene::waveform::Multiplex;
use crate::trace::Echoes;
use num_complex::{Complex32, Complex64};
use std::time::Instant;

/// What the samples can be made of.
trait Precise:
    crate::adc::cpu::synthesis::Precision + crate::adc::cpu::noise::Precision + dsp::Real + std::ops::AddAssign
{
    /// Lines of a plan by the cpu engine, and how they were summed.
    fn lines(plan: &Plan<'_>, control: Control<'_>) -> Result<(Cube<Self>, Methods)>;
}

impl Precise for f32 {
    fn lines(plan: &Plan<'_>, control: Control<'_>) -> Result<(Cube<f32>, Methods)> {
        crate::adc::cpu::gridding::synthesise(plan, control)
    }
}

/// The direct sum always: the truth.
impl Precise for f64 {
    fn lines(plan: &Plan<'_>, control: Control<'_>) -> Result<(Cube<f64>, Methods)> {
        Ok((crate::adc::cpu::synthesis::synthesise(plan, control)?, Methods::default()))
    }
}

/// Samples and spectrum of one block of channels.
const STREAM_BYTES: usize = 256 << 20;

/// What comes to the receivers of one frame.
struct Received<'a> {
    echoes: &'a Echoes,
    interference: &'a [Arrival],
    seed: u64,
    frame: u32,
}

/// Chirps of several cubes of one shape in turn.
fn interleaved<T: Clone + Default + Copy>(mut cubes: Vec<Cube<T>>) -> Cube<T> {
    if cubes.len() == 1
        && let Some(only) = cubes.pop()
    {
        return only;
    }
    let (chirps, channels, samples) = (cubes[0].chirps, cubes[0].channels, cubes[0].samples);
    let row = channels * samples;
    let mut data = Vec::with_capacity(cubes.len() * chirps * row);
    for m in 0..chirps {
        for cube in &cubes {
            data.extend_from_slice(&cube.data[m * row..(m + 1) * row]);
        }
    }
    Cube { chirps: chirps * cubes.len(), channels, samples, data }
}

/// What a frame is made of.
#[derive(Debug, Clone, Copy)]
pub struct FrameInput<'a> {
    /// The radar.
    pub radar: &'a Radar,
    /// Echoes that come to its receivers.
    pub echoes: &'a Echoes,
    /// What other radars send into the receivers.
    pub interference: &'a [Arrival],
    /// Seed of the radar's noise.
    pub seed: u64,
    /// Number of the frame, by which its noise differs from that of others.
    pub frame: u32,
    /// How far the frame is carried, and whether the samples are wanted.
    pub extent: Extent,
}

/// A frame that was recorded and not yet submitted, with what finds its cells.
struct RecordedFrame<F> {
    /// The cube's shape and what its samples are read back with, where they are wanted.
    cube: Option<(DeviceCube, Vec<Pending<[f32; 2]>>)>,
    found: Found<F>,
    echo_summary: EchoSummary,
    ran: StageCounts,
}

/// What a recorded frame finds in its samples.
enum Found<F> {
    /// Nothing: nobody asks for more than the samples.
    Nothing,
    /// The power map alone.
    Map(PendingMap),
    /// Detected cells.
    Cells(F),
}

/// Records a frame from echoes to detected cells, which `find` records.
fn recorded<'a, F>(
    gpu: &Gpu,
    recorder: &mut Recorder<'_>,
    input: &FrameInput<'a>,
    plan: &Plan<'_>,
    find: impl FnOnce(&mut Recorder<'_>, &DeviceCube, &Transform, &'a Cfar) -> Result<F>,
) -> Result<RecordedFrame<F>> {
    let radar = input.radar;
    let (device, echo_summary) = recorded_cube(gpu, recorder, radar, plan, (input.seed, input.frame))?;
    let mut ran = StageCounts::default();
    ran.count(Stage::Synthesis);
    let pending = input.extent.samples.then(|| device.read(recorder));
    let mut found = Found::Nothing;
    if input.extent.reaches(Stage::Transform) {
        if radar.processing.remove_static {
            dsp::zero_doppler::record(recorder, &device, &AtRest::of(radar));
        }
        let transform = Transform::of_shape([device.chirps, device.channels, device.samples], radar)?;
        ran.count(Stage::Transform);
        found = if input.extent.reaches(Stage::Detection) {
            ran.count(Stage::Detection);
            Found::Cells(find(recorder, &device, &transform, &radar.processing.cfar)?)
        } else {
            Found::Map(dsp::device::record_map(recorder, gpu, &device, &transform)?)
        };
    }
    // The memory of the samples serves the next frame.
    let shape = DeviceCube { pieces: Vec::new(), ..device };
    Ok(RecordedFrame { cube: pending.map(|pending| (shape, pending)), found, echo_summary, ran })
}

/// Records synthesis, noise and conversion of a plan's cube.
fn recorded_cube(
    gpu: &Gpu,
    recorder: &mut Recorder<'_>,
    radar: &Radar,
    plan: &Plan<'_>,
    (seed, frame): (u64, u32),
) -> Result<(DeviceCube, EchoSummary)> {
    let (device, synthesis) = grid_device::record(plan, gpu, recorder)?;
    if let Some(n) = Noise::thermal(radar, seed, frame) {
        n.record(recorder, &device);
    }
    if let Some(c) = Convert::new(&radar.front_end, radar.sampling) {
        c.record(recorder, &device);
    }
    Ok((device, EchoSummary { synthesis, ..plan.echo_summary }))
}

/// What an engine makes of a frame's echoes.
#[derive(Debug, Clone, PartialEq)]
pub struct MadeFrame {
    /// The samples, where they were wanted.
    pub cube: Option<AnyCube>,
    /// Statistics of synthesis and front end.
    pub echo_summary: EchoSummary,
    /// The map of each ramp; none where the frame ends before [`Stage::Transform`], and without cells where it ends before
    /// [`Stage::Detection`].
    pub maps: Vec<RangeDoppler<f64>>,
    /// The stages that ran.
    pub ran: StageCounts,
    /// Time of synthesis and of processing, s; of a single submission all counts as the first.
    pub seconds: [f64; 2],
}

impl Engine {
    /// Samples of one frame as the receiver's converter delivers them: `[chirp, channel, sample]`, ramps in turn along chirps.
    /// `interference` is what other radars send into the receivers.
    ///
    /// # Errors
    /// Returns an error if an echo is not finite, the plan does not fit the adapter, the engine fails, or `control` is
    /// cancelled.
    pub fn cube(
        &self,
        radar: &Radar,
        echoes: &Echoes,
        interference: &[Arrival],
        seed: u64,
        frame: u32,
        control: Control<'_>,
    ) -> Result<(AnyCube, EchoSummary)> {
        if let Engine::Gpu(gpu) = self
            && let Some(plan) = self.plan_of_cube(radar, echoes, interference)?
        {
            let mut recorder = gpu.recorder("frame");
            let (device, seen) = recorded_cube(gpu, &mut recorder, radar, &plan, (seed, frame))?;
            let pending = device.read(&mut recorder);
            let mut done = recorder.submit()?;
            return Ok((AnyCube::F32(device.take(&mut done, pending)), seen));
        }
        let with = Received { echoes, interference, seed, frame };
        Ok(match self {
            Engine::Cpu(Precision::F64) => {
                let (cube, seen) = self.received::<f64>(radar, &with, control)?;
                (AnyCube::F64(cube), seen)
            }
            _ => {
                let (cube, seen) = self.received::<f32>(radar, &with, control)?;
                (AnyCube::F32(cube), seen)
            }
        })
    }

    /// [`Engine::cube`] and [`Engine::maps`] of one frame. The usual radar's frame is one submission on the gpu engine, from echoes to
    /// detected cells. The samples come back where they are wanted.
    ///
    /// # Errors
    /// Returns the errors of [`Engine::cube`] and [`Engine::maps`].
    pub fn frame(&self, input: &FrameInput<'_>, control: Control<'_>) -> Result<MadeFrame> {
        if let Engine::Gpu(gpu) = self
            && let Some(plan) = self.plan_on_device(input)?
        {
            let start = Instant::now();
            let mut recorder = gpu.recorder("frame");
            let recorded = recorded(gpu, &mut recorder, input, &plan, |r, cube, transform, cfar| {
                dsp::device::record(r, gpu, cube, transform, cfar)
            })?;
            let mut done = recorder.submit()?;
            let RecordedFrame { cube, found, echo_summary, ran } = recorded;
            let cube = cube.map(|(device, pending)| AnyCube::F32(device.take(&mut done, pending)));
            let maps = match found {
                Found::Nothing => Vec::new(),
                Found::Map(pending) => vec![pending.take(&mut done)?.widened()],
                Found::Cells(found) => vec![found.take(gpu, &mut done)?.1.widened()],
            };
            return Ok(MadeFrame {
                cube,
                echo_summary,
                maps,
                ran,
                seconds: [start.elapsed().as_secs_f64(), 0.0],
            });
        }
        let FrameInput { radar, echoes, interference, seed, frame, extent } = *input;
        let mut ran = StageCounts::default();
        if !extent.reaches(Stage::Synthesis) {
            let echo_summary = EchoSummary::of_echoes(echoes);
            return Ok(MadeFrame { cube: None, echo_summary, maps: Vec::new(), ran, seconds: [0.0; 2] });
        }
        let start = Instant::now();
        let (cube, seen) = self.cube(radar, echoes, interference, seed, frame, control)?;
        ran.count(Stage::Synthesis);
        let synthesis = start.elapsed().as_secs_f64();
        let maps = match (extent.reaches(Stage::Transform), extent.reaches(Stage::Detection)) {
            (false, _) => Vec::new(),
            (true, is_detected) => {
                ran.count(Stage::Transform);
                // With several Doppler folds the map is put together from what the detector finds in each.
                if is_detected || radar.migration_ambiguities().count() > 1 {
                    ran.count(Stage::Detection);
                    self.maps(radar, &cube)?
                } else {
                    (0..radar.waveform.parts())
                        .map(|i| self.power_map(&radar.part(i), &cube))
                        .collect::<Result<_>>()?
                }
            }
        };
        let seconds = [synthesis, start.elapsed().as_secs_f64() - synthesis];
        Ok(MadeFrame { cube: extent.samples.then_some(cube), echo_summary: seen, maps, ran, seconds })
    }

    /// Makes frames, of any radars, with one result for each in their order, to the bit as [`Engine::frame`] makes them. On the gpu
    /// engine neighbours of the usual kind share a submission as far as [`Engine::batch_bytes`] reach; all others, and all frames
    /// of the cpu engine, are made singly. After a failure the frames behind it are not made, and have no result.
    ///
    /// # Errors
    /// The last frame may have an error of [`Engine::frame`].
    pub fn frames(&self, inputs: &[FrameInput<'_>], control: Control<'_>) -> Vec<Result<MadeFrame>> {
        self.frames_with_room(inputs, CELLS, control)
    }

    /// [`Engine::frames`] with room for so many detected cells, beyond which a frame is recorded twice.
    fn frames_with_room(
        &self,
        inputs: &[FrameInput<'_>],
        cells: usize,
        control: Control<'_>,
    ) -> Vec<Result<MadeFrame>> {
        let mut made: Vec<Result<MadeFrame>> = Vec::with_capacity(inputs.len());
        while made.len() < inputs.len() && !matches!(made.last(), Some(Err(_))) {
            let left = &inputs[made.len()..];
            let many = match self {
                // Where the usual room did not do, a frame alone would find that out once more.
                Engine::Gpu(gpu) if left.len() > 1 || cells > CELLS => {
                    self.together(gpu, left, cells, control)
                }
                _ => Vec::new(),
            };
            match many.is_empty() {
                true => made.push(self.frame(&left[0], control)),
                false => made.extend(many),
            }
        }
        if let Some(failed) = made.iter().position(Result::is_err) {
            made.truncate(failed + 1);
        }
        made
    }

    /// Frames from the front of `inputs` in one submission, or one after another where that fails. Empty where the first of them has to be
    /// made singly: because its radar is not of the usual kind, or because it failed, so that its error is found again.
    fn together(
        &self,
        gpu: &Gpu,
        inputs: &[FrameInput<'_>],
        cells: usize,
        control: Control<'_>,
    ) -> Vec<Result<MadeFrame>> {
        let start = Instant::now();
        let most = self.batch_bytes();
        let mut recorder = gpu.recorder("frames");
        let mut frames: Vec<RecordedFrame<PendingFrame>> = Vec::new();
        let mut largest = 0;
        for input in inputs {
            let before = recorder.bytes();
            // The next frame is taken to be as large as the largest so far.
            if !frames.is_empty() && before + largest > most {
                break;
            }
            let Ok(Some(plan)) = self.plan_on_device(input) else { break };
            let frame = recorded(gpu, &mut recorder, input, &plan, |r, cube, transform, cfar| {
                dsp::device::record_with_room(r, gpu, cube, transform, cfar, cells)
            });
            let Ok(frame) = frame else { break };
            frames.push(frame);
            largest = largest.max(recorder.bytes() - before);
        }
        if frames.is_empty() {
            return Vec::new();
        }
        let Ok(mut done) = recorder.submit() else {
            // Alone they may have memory enough, and an error is that of a frame.
            let mut made = Vec::with_capacity(frames.len());
            for input in &inputs[..frames.len()] {
                made.push(self.frame(input, control));
                if matches!(made.last(), Some(Err(_))) {
                    break;
                }
            }
            return made;
        };
        // None where there were more cells than room, with their number in `crowded`.
        let mut made: Vec<Option<Result<MadeFrame>>> = Vec::with_capacity(frames.len());
        let mut crowded: Vec<(usize, usize)> = Vec::new();
        let a_frame_s = start.elapsed().as_secs_f64() / frames.len() as f64;
        for (i, RecordedFrame { cube, found, echo_summary, ran }) in frames.into_iter().enumerate() {
            let cube = cube.map(|(shape, pending)| AnyCube::F32(shape.take(&mut done, pending)));
            let maps = match found {
                Found::Nothing => Ok(Vec::new()),
                Found::Map(pending) => pending.take(&mut done).map(|map| vec![map.widened()]),
                Found::Cells(found) => match found.take(&mut done) {
                    Ok(TakenFrame::Whole(found)) => Ok(vec![found.widened()]),
                    Ok(TakenFrame::Crowded(count)) => {
                        crowded.push((i, count));
                        made.push(None);
                        continue;
                    }
                    Err(e) => Err(e),
                },
            };
            let seconds = [a_frame_s, 0.0];
            made.push(Some(maps.map(|maps| MadeFrame { cube, echo_summary, maps, ran, seconds })));
        }
        drop(done);
        if let Some(most) = crowded.iter().map(|(_, count)| *count).max() {
            let again: Vec<FrameInput<'_>> = crowded.iter().map(|(i, _)| inputs[*i]).collect();
            for ((i, _), one) in crowded.into_iter().zip(self.frames_with_room(&again, most, control)) {
                made[i] = Some(one);
            }
        }
        // What is missing now stands behind a frame that failed.
        made.into_iter().map_while(|one| one).collect()
    }

    /// [`Engine::range_doppler`] of each ramp.
    ///
    /// # Errors
    /// Returns the errors of [`Engine::range_doppler`].
    pub fn maps(&self, radar: &Radar, cube: &AnyCube) -> Result<Vec<RangeDoppler<f64>>> {
        (0..radar.waveform.parts()).map(|i| self.range_doppler(&radar.part(i), cube)).collect()
    }

    /// The plan of a frame that goes from echoes to detected cells on the device alone. None for other radars, for frames without samples
    /// and for the cpu engine.
    fn plan_on_device<'a>(&self, input: &FrameInput<'a>) -> Result<Option<Plan<'a>>> {
        match input.radar.migration_ambiguities().count() {
            _ if !input.extent.reaches(Stage::Synthesis) => Ok(None),
            1 => self.plan_of_cube(input.radar, input.echoes, input.interference),
            _ => Ok(None),
        }
    }

    /// The plan of a cube that is complete on the device: one ramp, lines that are samples, channels that are ways, and nothing
    /// in the front end but what acts on single samples. None otherwise, and for the cpu engine.
    fn plan_of_cube<'a>(
        &self,
        radar: &'a Radar,
        echoes: &'a Echoes,
        interference: &[Arrival],
    ) -> Result<Option<Plan<'a>>> {
        // What acts on single samples has a kernel; the rest of the front end runs on the host.
        let pointwise = |s: &FrontEndSettings| FrontEndSettings {
            iq: None,
            dc: None,
            saturation: None,
            adc: None,
            ..s.clone()
        };
        let plain = pointwise(&radar.front_end) == FrontEndSettings::default() && interference.is_empty();
        let on_device = matches!(self, Engine::Gpu(_));
        if !on_device || !plain || radar.waveform.parts() > 1 || Shaping::of(radar, 0.0).is_some() {
            return Ok(None);
        }
        let plan = Plan::new(radar, echoes)?;
        Ok((plan.channels == radar.channels()).then_some(plan))
    }

    /// Samples of all ramps. What the receiver hears at once is added up, lines of pulses and codes become samples, and
    /// the front end does what it does, on the host.
    fn received<T: Precise>(
        &self,
        radar: &Radar,
        with: &Received<'_>,
        control: Control<'_>,
    ) -> Result<(Cube<T>, EchoSummary)> {
        let built = match &radar.front_end.channels {
            Some(errors) => channels::displaced(radar, errors),
            None => radar.clone(),
        };
        let parts = radar.waveform.parts();
        let mut made = Vec::with_capacity(parts);
        let mut echo_summary = EchoSummary::default();
        for i in 0..parts {
            let part = built.part(i);
            let chain = Chain::new(&part, &part.front_end);
            let margin = chain.margin();
            let (clean, seen) = self.clean::<T>(&part, with.echoes, margin, control)?;
            echo_summary = if i == 0 { seen } else { echo_summary.and(&seen) };
            // Each ramp of a loop has draws of its own.
            let seed = with.seed ^ ((i as u64) << 40);
            let noise = Noise::thermal(&part, seed, with.frame);
            let inputs = Inputs {
                noise: noise.as_ref(),
                interference: with.interference,
                seed,
                frame: with.frame,
                interference_seed: with.seed,
            };
            made.push(crate::adc::cpu::front_end::apply(clean, margin, &chain, inputs)?);
        }
        Ok((interleaved(made), echo_summary))
    }

    /// Echoes of one ramp alone, with `margin` further samples before and after each record.
    fn clean<T: Precise>(
        &self,
        part: &Radar,
        echoes: &Echoes,
        margin: usize,
        control: Control<'_>,
    ) -> Result<(Cube<T>, EchoSummary)> {
        let largest_rate = echoes.list.iter().map(|r| r.path_rate_mps.abs()).fold(0.0, f64::max);
        let Some(shaping) = Shaping::of(part, largest_rate) else {
            let plan = Plan::with_lines(part, part.lines().wider(margin), echoes)?;
            let (cube, synthesis) = self.lines::<T>(&plan, control)?;
            return Ok((cube, EchoSummary { synthesis, ..plan.echo_summary }));
        };
        let mut samples = Cube::zeros(part.chirps, part.channels(), part.samples);
        let mut seen = EchoSummary::default();
        for order in 0..shaping.orders(largest_rate)? {
            let plan = shaping.plan(part, echoes, order)?;
            let (lines, synthesis) = self.lines::<T>(&plan, control)?;
            if order == 0 {
                seen = EchoSummary { synthesis, ..plan.echo_summary };
            }
            crate::adc::cpu::shaping::add(&shaping, &lines, order, &mut samples);
        }
        Ok((samples, seen))
    }

    /// Lines of a plan by this engine, the ways that are received at once added up, and how echoes were summed.
    fn lines<T: Precise>(&self, plan: &Plan<'_>, control: Control<'_>) -> Result<(Cube<T>, Methods)> {
        let (cube, methods) = match self {
            Engine::Cpu(_) => T::lines(plan, control)?,
            Engine::Gpu(gpu) => {
                let mut recorder = gpu.recorder("synthesis");
                let (device, methods) = grid_device::record(plan, gpu, &mut recorder)?;
                let pending = device.read(&mut recorder);
                let mut done = recorder.submit()?;
                let cube = device.take(&mut done, pending);
                let round = |z: &Complex32| {
                    <T as crate::adc::cpu::synthesis::Precision>::round(Complex64::new(
                        z.re.into(),
                        z.im.into(),
                    ))
                };
                let data = cube.data.iter().map(round).collect();
                (Cube { chirps: cube.chirps, channels: cube.channels, samples: cube.samples, data }, methods)
            }
        };
        Ok((plan.fold(cube), methods))
    }

    /// From samples to detected cells of one ramp (`radar` is [`Radar::part`] of it; a radar with one ramp as it is). The stages run
    /// in the precision of the engine; what they found is handed on in f64.
    ///
    /// # Errors
    /// Returns an error if the cube's shape is not the radar's, its samples are not in the engine's precision or not
    /// finite, or the adapter fails.
    pub fn range_doppler(&self, radar: &Radar, cube: &AnyCube) -> Result<RangeDoppler<f64>> {
        use crate::dsp::cpu::{lines::prepared as lines, process_by};
        use crate::dsp::folds::over_ambiguities;
        match (self, cube) {
            (Engine::Cpu(_), AnyCube::F64(cube)) => {
                let cube = &*lines(cube, radar)?;
                over_ambiguities(radar, cube, |t, cfar| Ok(process_by(cube, t, cfar)?.1))
            }
            (Engine::Cpu(_), AnyCube::F32(cube)) => {
                let cube = &*lines(cube, radar)?;
                over_ambiguities(radar, cube, |t, cfar| Ok(process_by(cube, t, cfar)?.1.widened()))
            }
            (Engine::Gpu(gpu), AnyCube::F32(cube)) => {
                let cube = &*lines(cube, radar)?;
                over_ambiguities(radar, cube, |t, cfar| {
                    Ok(dsp::device::process_by(gpu, cube, t, cfar)?.1.widened())
                })
            }
            (Engine::Gpu(_), AnyCube::F64(_)) => {
                Err(Error::Failed("a cube of complex128 needs the cpu engine".into()))
            }
        }
    }

    /// The power map of one ramp without a detector: the map of [`Engine::range_doppler`] with neither cells nor mask. For a radar with one
    /// Doppler fold.
    ///
    /// # Errors
    /// Returns the errors of [`Engine::range_doppler`].
    fn power_map(&self, radar: &Radar, cube: &AnyCube) -> Result<RangeDoppler<f64>> {
        use crate::dsp::cpu::{lines::prepared as lines, map_by};
        match (self, cube) {
            (Engine::Cpu(_), AnyCube::F64(cube)) => {
                let cube = &*lines(cube, radar)?;
                map_by(cube, &Transform::of_cube(cube, radar)?)
            }
            (Engine::Cpu(_), AnyCube::F32(cube)) => {
                let cube = &*lines(cube, radar)?;
                Ok(map_by(cube, &Transform::of_cube(cube, radar)?)?.widened())
            }
            (Engine::Gpu(gpu), AnyCube::F32(cube)) => {
                let cube = &*lines(cube, radar)?;
                Ok(dsp::device::map_by(gpu, cube, &Transform::of_cube(cube, radar)?)?.widened())
            }
            (Engine::Gpu(_), AnyCube::F64(_)) => {
                Err(Error::Failed("a cube of complex128 needs the cpu engine".into()))
            }
        }
    }

    /// Whether [`Engine::range_doppler_streamed`] knows this radar: its lines are its samples, without Doppler
    /// bands, without removal of what rests and with one Doppler fold.
    pub fn can_stream(radar: &Radar) -> bool {
        let p = &radar.processing;
        radar.waveform.parts() == 1
            && Shaping::of(radar, 0.0).is_none()
            && !matches!(radar.multiplex, Multiplex::Ddm { .. })
            && !p.remove_static
            && radar.migration_ambiguities().count() == 1
    }

    /// [`Engine::range_doppler`] in f32 of a cube larger than memory should hold: `source` fills in blocks of
    /// channels, each up to twice.
    ///
    /// # Errors
    /// Returns an error for a radar that [`Engine::can_stream`] does not know, or if the source fails.
    pub fn range_doppler_streamed(
        &self,
        radar: &Radar,
        source: &mut Source<'_, f32>,
    ) -> Result<RangeDoppler<f64>> {
        if !Engine::can_stream(radar) {
            return Err(Error::Failed("this radar's cube cannot be processed in blocks".into()));
        }
        let shape = [radar.chirps, radar.channels(), radar.samples];
        let transform = Transform::of_shape(shape, radar)?;
        let cfar = &radar.processing.cfar;
        Ok(match self {
            Engine::Cpu(_) => {
                crate::dsp::cpu::stream::process(&transform, cfar, STREAM_BYTES, source)?.widened()
            }
            Engine::Gpu(gpu) => dsp::stream::process(gpu, &transform, cfar, source)?.widened(),
        })
    }

    /// Quadratic forms of cells over a grid of directions, `[cell, direction]` (CONVENTIONS eq. 94).
    ///
    /// # Errors
    /// Returns an error if the adapter fails.
    pub fn forms(&self, steering: &Steering, forms: &Forms) -> Result<Vec<f64>> {
        let widen = |p: Vec<f32>| p.into_iter().map(f64::from).collect();
        Ok(match self {
            Engine::Cpu(Precision::F64) => crate::dsp::cpu::doa_spectrum::spectra(steering, forms),
            Engine::Cpu(Precision::F32) => widen(crate::dsp::cpu::doa_spectrum::spectra(steering, forms)),
            Engine::Gpu(gpu) => widen(dsp::doa_spectrum::spectra(gpu, steering, forms)?),
        })
    }

    /// [`Engine::angular_power`] of several beamformers, which share a submission on the gpu engine.
    ///
    /// # Errors
    /// Returns an error if the adapter fails.
    pub fn angular_powers(&self, all: &[BeamCells<'_>]) -> Result<Vec<Vec<f64>>> {
        match self {
            _ if all.is_empty() => Ok(Vec::new()),
            Engine::Cpu(_) => {
                all.iter().map(|c| self.angular_power(c.beam, &c.snapshots, &c.range_rates_mps)).collect()
            }
            Engine::Gpu(gpu) => {
                let powers = dsp::doa_beamform::spectra_of_all(gpu, all)?;
                Ok(powers.into_iter().map(|p| p.into_iter().map(f64::from).collect()).collect())
            }
        }
    }

    /// |y|^2 in W over the beamformer's grid, `[cell, elevation, azimuth]` (CONVENTIONS eq. 19).
    ///
    /// # Errors
    /// Returns an error if the adapter fails.
    pub fn angular_power(
        &self,
        beam: &Beamformer,
        snapshots: &Snapshots<f64>,
        range_rates_mps: &[f64],
    ) -> Result<Vec<f64>> {
        let widen = |p: Vec<f32>| p.into_iter().map(f64::from).collect();
        Ok(match self {
            Engine::Cpu(Precision::F64) => {
                crate::dsp::cpu::doa_beamform::spectra(beam, snapshots, range_rates_mps)
            }
            Engine::Cpu(Precision::F32) => {
                widen(crate::dsp::cpu::doa_beamform::spectra(beam, &snapshots.narrowed(), range_rates_mps))
            }
            Engine::Gpu(gpu) => {
                widen(dsp::doa_beamform::spectra(gpu, beam, &snapshots.narrowed(), range_rates_mps)?)
            }
        })
    }
}

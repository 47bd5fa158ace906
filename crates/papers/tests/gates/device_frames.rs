//! Frames that shaders trace beside those that the host traces in f64: sums by chain, echo by echo, and in maps, each with how much the
//! method itself changes at a sixteenth of the accuracy.

use super::clipping::{Sums, changes, sums_of};
use catseye::adc::Cube;
use catseye::adc::synthesis::{Levels, passes};
use catseye::base::control::Control;
use catseye::base::units::wavenumber;
use catseye::dsp::PowerMap;
use catseye::engine::{AnyCube, Engine, Precision, reach};
use catseye::geom::Geometry;
use catseye::geom::faces::Faces;
use catseye::gpu::compare::{opened_for_tests, test_gpu};
use catseye::road::site::Site;
use catseye::scene::radar::Radar;
use catseye::scene::scenario;
use catseye::trace::beams::BeamOptions;
use catseye::trace::cpu::beams::{self, Ends};
use catseye::trace::cpu::echoes::echoes_by;
use catseye::trace::cpu::regions::region_areas_m2;
use catseye::trace::cpu::volume;
use catseye::trace::view_clipper::{self, Traced};
use catseye::trace::windows::windows;
use catseye::trace::{Echo, Echoes, MAX_BOUNCES, TraceOptions, merge};
use catseye_io::{dataset, recipe::Recipe};
use catseye_papers::bench::frame::Frame;
use catseye_papers::bench::{cells, frame_of, noise_w, relative_l2};
use glam::DVec3;
use num_complex::Complex64;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// By so much of the power may f32 move a frame, whose own accuracy may be finer: -67 dB. The bent road moves by 1.2e-7.
const F32_MOVES: f64 = 2e-7;
/// The reference of the method's own error is so many times stricter.
const FINER: f64 = 16.0;
/// Loops of the compared maps, so that synthesis takes no longer than tracing.
const LOOPS: usize = 64;
/// Echoes nearer than this in path, and in the places of their first and last bounce, are one place, m: half of a thousandth of a turn
/// at 77 GHz, and twice the step in which the tracer adds echoes up.
const SAME_M: f64 = 2e-6;
/// An echo without one at its place is compared with the nearest of its chain, by path and places, within so many turns and m.
const NEAR_TURNS: f64 = 0.125;
const NEAR_M: f64 = 0.05;
/// Echoes agree when their paths differ by no more turns, and their amplitudes by no more decibels.
const TURNS: f64 = 1e-3;
const DB: f64 = 0.01;
/// Share of the power whose echoes have to agree, and largest relative L2 of maps.
const MATCHED: f64 = 0.9999;
const MAP_L2: f64 = 1e-3;
/// An echo counts as strong from this share of the power on: -60 dB. Below it are rests of corners whose facets cancel, and slivers at
/// grazing, which split differently from one order of cuts to another; sums by chain hold those.
const STRONG: f64 = 1e-6;

/// All echoes at one place by one way.
#[derive(Debug, Clone, Copy, Default)]
struct Place {
    /// Number of echoes.
    count: usize,
    /// Their sum as the receiver hears it, sqrt(W).
    sum: Complex64,
    /// Path length, and places of the first and of the last bounce, means by amplitude, m.
    path_m: f64,
    ends_m: [DVec3; 2],
    weight: f64,
}

impl Place {
    fn add(&mut self, radar: &Radar, amplitude: Complex64, r: &Echo) {
        // Echoes without amplitude have a place too.
        let weight = amplitude.norm().max(f64::MIN_POSITIVE.sqrt());
        self.weight += weight;
        let share = weight / self.weight;
        self.count += 1;
        self.sum += amplitude * Complex64::cis(-wavenumber(radar.carrier_hz) * r.path_length_m);
        self.path_m += share * (r.path_length_m - self.path_m);
        for (mean, at) in self.ends_m.iter_mut().zip(ends_m(r)) {
            *mean += share * (at - *mean);
        }
    }

    fn off_m(&self, other: &Place) -> f64 {
        let ends: f64 = self.ends_m.iter().zip(&other.ends_m).map(|(a, b)| a.distance(*b)).sum();
        ends + (self.path_m - other.path_m).abs()
    }

    fn power(&self) -> f64 {
        self.sum.norm_sqr()
    }
}

fn ends_m(r: &Echo) -> [DVec3; 2] {
    [r.departure * r.first_range_m, r.arrival * r.last_range_m]
}

/// What two lists of echoes have at one place, the host's and the device's.
struct Pair {
    chain: [u32; MAX_BOUNCES],
    host: Option<Place>,
    device: Option<Place>,
}

impl Pair {
    fn both(&self) -> Option<(&Place, &Place)> {
        self.host.as_ref().zip(self.device.as_ref())
    }

    /// Difference of the paths in turns of the carrier, and of the amplitudes, dB; None for an echo without a partner.
    fn off(&self, turns_per_m: f64) -> Option<[f64; 2]> {
        let (h, d) = self.both()?;
        Some([
            (d.path_m - h.path_m).abs() * turns_per_m,
            (20.0 * (d.sum.norm() / h.sum.norm()).log10()).abs(),
        ])
    }

    fn host_w(&self) -> f64 {
        self.host.map_or(0.0, |p| p.power())
    }

    fn device_w(&self) -> f64 {
        self.device.map_or(0.0, |p| p.power())
    }

    /// Power of what is between the two.
    fn between_w(&self) -> f64 {
        (self.device.unwrap_or_default().sum - self.host.unwrap_or_default().sum).norm_sqr()
    }
}

/// The representative of a place's number.
fn root(of: &mut [usize], mut i: usize) -> usize {
    while of[i] != i {
        of[i] = of[of[i]];
        i = of[i];
    }
    i
}

/// Places of two lists beside each other: first those that are the same, then for each that is left, strongest first, the nearest of its
/// chain.
fn pairs(radar: &Radar, host: &[Echo], device: &[Echo]) -> Vec<Pair> {
    let levels = Levels::new(radar);
    let mut all: Vec<(bool, &Echo)> =
        host.iter().map(|r| (false, r)).chain(device.iter().map(|r| (true, r))).collect();
    all.retain(|(_, r)| passes(radar, r));
    all.sort_by(|a, b| a.1.chain.cmp(&b.1.chain).then(a.1.path_length_m.total_cmp(&b.1.path_length_m)));
    let mut of: Vec<usize> = (0..all.len()).collect();
    for (i, (_, a)) in all.iter().enumerate() {
        let ends = ends_m(a);
        let later = all[i + 1..]
            .iter()
            .enumerate()
            .take_while(|(_, (_, b))| b.chain == a.chain && b.path_length_m - a.path_length_m <= SAME_M);
        for (j, (_, b)) in later {
            if ends.iter().zip(ends_m(b)).all(|(p, q)| p.distance(q) <= SAME_M) {
                let (i, j) = (root(&mut of, i), root(&mut of, i + 1 + j));
                of[j.max(i)] = i.min(j);
            }
        }
    }
    let mut places: BTreeMap<usize, Pair> = BTreeMap::new();
    for (i, (on_device, r)) in all.iter().enumerate() {
        let pair =
            places.entry(root(&mut of, i)).or_insert(Pair { chain: r.chain, host: None, device: None });
        let place = if *on_device { &mut pair.device } else { &mut pair.host };
        place.get_or_insert_default().add(radar, levels.amplitude(r), r);
    }
    let (mut found, mut alone): (Vec<Pair>, Vec<Pair>) =
        places.into_values().partition(|p| p.both().is_some());
    alone.sort_by(|a, b| (b.host_w() + b.device_w()).total_cmp(&(a.host_w() + a.device_w())));
    let (hosts, devices): (Vec<Pair>, Vec<Pair>) = alone.into_iter().partition(|p| p.host.is_some());
    let mut by_chain: BTreeMap<[u32; MAX_BOUNCES], Vec<Place>> = BTreeMap::new();
    for d in &devices {
        by_chain.entry(d.chain).or_default().extend(d.device);
    }
    let near_m = NEAR_TURNS * TAU / wavenumber(radar.carrier_hz);
    for mut pair in hosts {
        let left = by_chain.entry(pair.chain).or_default();
        let Some(h) = pair.host else { continue };
        let near = left.iter().enumerate().filter(|(_, d)| (d.path_m - h.path_m).abs() < near_m);
        let nearest = near.map(|(i, d)| (h.off_m(d), i)).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, i)) = nearest.filter(|n| n.0 < NEAR_M) {
            pair.device = Some(left.swap_remove(i));
        }
        found.push(pair);
    }
    for (chain, left) in by_chain {
        found.extend(left.into_iter().map(|d| Pair { chain, host: None, device: Some(d) }));
    }
    found
}

/// Two lists of echoes beside each other.
#[derive(Debug, Clone, Copy, Default)]
struct Agreement {
    /// Shares of the power whose echoes have a partner, and whose partner agrees in path and amplitude.
    matched: f64,
    agreeing: f64,
    /// Share of the power in strong echoes.
    strong: f64,
    /// Largest differences of strong echoes with a partner, turns of the carrier and dB.
    worst_turns: f64,
    worst_db: f64,
}

impl Agreement {
    fn of(radar: &Radar, pairs: &[Pair]) -> Agreement {
        let turns_per_m = wavenumber(radar.carrier_hz) / TAU;
        let host_w: f64 = pairs.iter().map(Pair::host_w).sum();
        let strays_w: f64 = pairs.iter().filter(|p| p.host.is_none()).map(Pair::device_w).sum();
        let mut a = Agreement::default();
        for pair in pairs {
            let share = pair.host_w() / (host_w + strays_w);
            let is_strong = pair.host_w().max(pair.device_w()) >= STRONG * host_w;
            a.strong += share * f64::from(is_strong);
            let Some([turns, db]) = pair.off(turns_per_m) else { continue };
            a.matched += share;
            a.agreeing += share * f64::from(turns <= TURNS && db <= DB);
            if is_strong {
                a.worst_turns = a.worst_turns.max(turns);
                a.worst_db = a.worst_db.max(db);
            }
        }
        a
    }
}

/// Sums of echoes by chain and by range cell, which is as far as a receiver tells echoes of a chain apart.
type CellSums = BTreeMap<([u32; MAX_BOUNCES], i64), Complex64>;

fn cell_sums(radar: &Radar, list: &[Echo]) -> CellSums {
    let levels = Levels::new(radar);
    let k = wavenumber(radar.carrier_hz);
    let mut sums = CellSums::new();
    for r in list.iter().filter(|r| passes(radar, r)) {
        let cell = (r.range_m() / radar.range_bin_m()).round() as i64;
        *sums.entry((r.chain, cell)).or_default() +=
            levels.amplitude(r) * Complex64::cis(-k * r.path_length_m);
    }
    sums
}

/// Share of the power of such sums that agree within `DB`, in amplitude and phase.
fn sums_agreeing(host: &CellSums, device: &CellSums) -> f64 {
    let (mut all, mut same) = (0.0, 0.0);
    for key in host.keys().chain(device.keys().filter(|k| !host.contains_key(k))) {
        let [h, d] = [host, device].map(|sums| sums.get(key).copied().unwrap_or_default());
        let power = h.norm_sqr().max(d.norm_sqr());
        all += power;
        if (d - h).norm() <= (10f64.powf(DB / 20.0) - 1.0) * h.norm() {
            same += power;
        }
    }
    same / all
}

/// Says in which cells over the noise the maps differ by more than 0.1 dB, and which chain moves most in their range.
fn say_cells(frame: &Frame, radar: &Radar, maps: [&PowerMap<f64>; 3], noise_w: f64, sums: [&CellSums; 2]) {
    let [want, got, finer] = maps;
    let mut off: Vec<(f64, usize)> = (0..want.data.len())
        .filter(|i| want.data[*i] > noise_w)
        .map(|i| (10.0 * (got.data[i] / want.data[i]).log10(), i))
        .filter(|o| o.0.abs() > 0.1)
        .collect();
    off.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
    let peak = want.data.iter().copied().fold(0.0, f64::max);
    for (db, i) in off.iter().take(5) {
        let (row, bin) = (i / want.range_bins, i % want.range_bins);
        let mut moved: Vec<(f64, &[u32; MAX_BOUNCES])> = sums[0]
            .iter()
            .filter(|(key, _)| (key.1 - bin as i64).abs() <= 1)
            .map(|(key, h)| ((sums[1].get(key).copied().unwrap_or_default() - h).norm_sqr(), &key.0))
            .collect();
        moved.sort_by(|a, b| b.0.total_cmp(&a.0));
        let name = |id: &u32| frame.scene.object_by_id(*id).map_or("?", |o| o.name.as_str());
        let of = moved.first().map_or(String::new(), |(w, chain)| {
            let chain: Vec<&str> = chain.iter().take_while(|id| **id != 0).map(name).collect();
            format!("{} moves by {:.1} dB over the noise", chain.join(" > "), 10.0 * (w / noise_w).log10())
        });
        println!(
            "    cell at {:.1} m, row {row}: {:.1} dB over the noise, {:.1} under the peak, off by {db:.2} dB, by the accuracy {:.2} dB; {of}",
            bin as f64 * radar.range_bin_m(),
            10.0 * (want.data[*i] / noise_w).log10(),
            10.0 * (peak / want.data[*i]).log10(),
            10.0 * (finer.data[*i] / want.data[*i]).log10()
        );
    }
}

/// Says which echoes differ most.
fn say_worst(frame: &Frame, pairs: &[Pair], how_many: usize) {
    let turns_per_m = wavenumber(frame.radar.carrier_hz) / TAU;
    let total: f64 = pairs.iter().map(Pair::host_w).sum();
    let mut worst: Vec<&Pair> = pairs.iter().collect();
    worst.sort_by(|a, b| b.between_w().total_cmp(&a.between_w()));
    for p in worst.iter().take(how_many).filter(|p| p.between_w() > 1e-8 * total) {
        let name = |id: &u32| frame.scene.object_by_id(*id).map_or("?", |o| o.name.as_str());
        let chain: Vec<&str> = p.chain.iter().take_while(|id| **id != 0).map(name).collect();
        let at = p.host.or(p.device).unwrap_or_default();
        println!(
            "    {}: path {:.4} m from {:.2} to {:.2}; {} and {} echoes; {:.1e} and {:.1e} of the power, {:.1e} between; off by {:?}",
            chain.join(" > "),
            at.path_m,
            at.ends_m[0],
            at.ends_m[1],
            p.host.map_or(0, |p| p.count),
            p.device.map_or(0, |p| p.count),
            p.host_w() / total,
            p.device_w() / total,
            p.between_w() / total,
            p.off(turns_per_m)
        );
    }
    let mut lost: BTreeMap<[u32; MAX_BOUNCES], [f64; 3]> = BTreeMap::new();
    for p in pairs {
        let of = lost.entry(p.chain).or_default();
        match p.off(turns_per_m) {
            None => of[0] += (p.host_w() + p.device_w()) / total,
            Some([turns, db]) if turns > TURNS || db > DB => of[1] += p.host_w() / total,
            Some(_) => of[2] += p.host_w() / total,
        }
    }
    let mut lost: Vec<_> = lost.into_iter().collect();
    lost.sort_by(|a, b| (b.1[0] + b.1[1]).total_cmp(&(a.1[0] + a.1[1])));
    for (chain, [alone, off, same]) in lost.iter().take(how_many).filter(|l| l.1[0] + l.1[1] > 1e-6) {
        let name = |id: &u32| frame.scene.object_by_id(*id).map_or("?", |o| o.name.as_str());
        let chain: Vec<&str> = chain.iter().take_while(|id| **id != 0).map(name).collect();
        println!(
            "    chain {}: {alone:.1e} without a partner, {off:.1e} off, {same:.1e} the same",
            chain.join(" > ")
        );
    }
}

/// Every number of an echo to the bit.
fn bits(r: &Echo) -> Vec<u64> {
    let numbers = [r.path_length_m, r.path_rate_mps, r.first_range_m, r.last_range_m];
    let vectors = [r.departure, r.first_velocity_mps, r.arrival, r.last_velocity_mps];
    let gains = r.path_gain.as_flattened().iter().flat_map(|z| [z.re, z.im]);
    let all = numbers.into_iter().chain(r.path_acceleration_and_jerk);
    let all = all.chain(vectors.iter().flat_map(DVec3::to_array)).chain(gains).map(f64::to_bits);
    all.chain(r.chain.map(u64::from)).collect()
}

/// Samples and map of echoes, without noise.
struct Received {
    samples: Vec<Complex64>,
    map: PowerMap<f64>,
}

impl Received {
    fn of(radar: &Radar, echoes: &Echoes) -> Received {
        Received::map_of(radar, cube(radar, &echoes.list))
    }

    /// The same of other echoes. Only what differs is synthesised and added to the samples: grids err by 1e-4 of what they hold, which lies
    /// over the weakest cells of frames with strong echoes, and would be taken for a difference.
    fn with(&self, radar: &Radar, echoes: &Echoes, other: &Echoes, reach_s: f64) -> Received {
        let mut between = other.list.clone();
        between.extend(echoes.list.iter().map(|r| {
            let mut r = r.clone();
            r.path_gain.as_flattened_mut().iter_mut().for_each(|z| *z = -*z);
            r
        }));
        merge::merge(&mut between, wavenumber(radar.carrier_hz), reach_s);
        let mut sum = cube(radar, &between);
        for (to, z) in sum.data.iter_mut().zip(&self.samples) {
            *to += num_complex::Complex32::new(z.re as f32, z.im as f32);
        }
        Received::map_of(radar, sum)
    }

    fn map_of(radar: &Radar, cube: Cube<f32>) -> Received {
        let z = |z: &num_complex::Complex32| Complex64::new(z.re.into(), z.im.into());
        let samples = cube.data.iter().map(z).collect();
        let engine = Engine::Cpu(Precision::F32);
        Received { samples, map: engine.range_doppler(radar, &AnyCube::F32(cube)).unwrap().map }
    }
}

fn cube(radar: &Radar, list: &[Echo]) -> Cube<f32> {
    let echoes = Echoes { list: list.to_vec(), ..Echoes::default() };
    let engine = Engine::Cpu(Precision::F32);
    engine.cube(radar, &echoes, &[], 0, 0, Control::default()).unwrap().0.into_f32()
}

/// Maps beside each other.
#[derive(Debug, Clone, Copy)]
struct Maps {
    /// Relative L2 of samples, amplitudes with their phases, and of the map's powers.
    amplitude_l2: f64,
    map_l2: f64,
    /// Cells of the reference over the noise, and how many of them differ by more than 0.1 dB.
    over: usize,
    differ: usize,
}

impl Maps {
    fn of(got: &Received, want: &Received, noise_w: f64) -> Maps {
        let parts = |h: &Received| h.samples.iter().flat_map(|z| [z.re, z.im]).collect::<Vec<_>>();
        let (over, near) = cells(&got.map, &want.map, noise_w);
        Maps {
            amplitude_l2: relative_l2(parts(got), parts(want)),
            map_l2: relative_l2(got.map.data.iter().copied(), want.map.data.iter().copied()),
            over,
            differ: over - near,
        }
    }
}

/// How a look is measured.
struct Extent {
    /// Whether the device traces twice.
    twice: bool,
    /// Whether outlines of regions are compared with what they are made of, which traces once more.
    regions: bool,
    /// Whether the device traces by lines.
    lines: bool,
}

/// All that is measured of one look.
struct Measured {
    echoes: [usize; 2],
    bounces: usize,
    agreement: Agreement,
    /// The same of the host when it cuts in another order.
    recut: Agreement,
    recut_maps: Maps,
    /// Shares of the power in chains and range cells whose sums agree, for both.
    sums: [f64; 2],
    device: Maps,
    own: Maps,
    /// Share of the power that the device and the accuracy move, by sums of chains.
    moved: f64,
    own_moved: f64,
    fallback: Option<Cow<'static, str>>,
    /// Regions, and those whose outline does not enclose what they are made of.
    regions: Option<[usize; 2]>,
    /// None where the device traced once.
    same_bits: Option<bool>,
    seconds: [f64; 3],
}

impl Measured {
    /// What does not hold of all that is asked.
    fn wrong(&self) -> Vec<(&'static str, f64)> {
        let (a, d, own) = (&self.agreement, &self.device, &self.own);
        let gates = [
            ("few echoes", self.echoes[0] as f64, self.echoes[0] > 1000),
            ("left to the host", 1.0, self.fallback.is_none()),
            ("power matched", a.matched, a.matched >= MATCHED),
            ("power agreeing", a.agreeing, a.agreeing >= MATCHED),
            ("turns", a.worst_turns, a.worst_turns <= TURNS),
            ("dB", a.worst_db, a.worst_db <= DB),
            ("amplitude L2", d.amplitude_l2, d.amplitude_l2 <= own.amplitude_l2),
            ("map L2", d.map_l2, d.map_l2 <= MAP_L2),
            ("cells", d.differ as f64, d.differ <= own.differ),
            ("moved by chains", self.moved, self.moved <= self.own_moved.max(F32_MOVES)),
            ("other bits the second time", 1.0, self.same_bits != Some(false)),
        ];
        gates.into_iter().filter(|g| !g.2).map(|(what, value, _)| (what, value)).collect()
    }
}

fn measure(frame: &Frame, extent: &Extent) -> Measured {
    let Frame { radar, pose, ego_mps, options, .. } = frame;
    let geometry = frame.geometry(&frame.refined(options.accuracy_db).unwrap()).unwrap();
    let engine = Engine::Cpu(Precision::F64);
    // The bounces that the frame begins with, for all of them: how many more it asks for goes with the accuracy.
    let options = TraceOptions { least: 0.0, most_bounces: 0, least_cut: None, ..*options };
    let timed = |f: &dyn Fn() -> Echoes| {
        let start = Instant::now();
        let echoes = f();
        (echoes, start.elapsed().as_secs_f64())
    };
    let (host, host_s) = timed(&|| engine.echoes(&geometry, radar, pose, *ego_mps, &options));
    let finer = TraceOptions { accuracy_db: options.accuracy_db / FINER, ..options };
    let (finer, finer_s) = timed(&|| engine.echoes(&geometry, radar, pose, *ego_mps, &finer));
    let gpu = Engine::Gpu(Box::new(opened_for_tests().with_lines(extent.lines)));
    let on_device = || gpu.trace(&geometry, radar, pose, *ego_mps, &options).unwrap();
    let (device, device_s) = timed(&on_device);
    let again = extent.twice.then(|| {
        let again = on_device();
        again.list.len() == device.list.len()
            && again.list.iter().zip(&device.list).all(|(a, b)| bits(a) == bits(b))
    });
    assert_eq!((device.broken, host.broken), (0, 0));

    let otherwise = cut_otherwise(frame, &geometry, &options);
    let found = pairs(radar, &host.list, &device.list);
    println!("  the device:");
    say_worst(frame, &found, 4);
    let recut = pairs(radar, &host.list, &otherwise.list);
    println!("  the host, cut in another order:");
    say_worst(frame, &recut, 4);
    let [h, d, f] = [&host, &device, &finer].map(|e| sums_of(radar, &e.list));
    let moved = |a: &Sums, b: &Sums| changes(a, b, 1e-4)[1];

    let noise_w = noise_w(radar);
    let mut short = Radar { thermal_noise: false, chirps: LOOPS.min(radar.chirps), ..radar.clone() };
    short.processing.doppler_fft = short.chirps;
    let want = Received::of(&short, &host);
    let received = |other: &Echoes| want.with(&short, &host, other, geometry.reach_s);
    let (got, stricter) = (received(&device), received(&finer));
    let [in_host, in_device, in_other] = [&host, &device, &otherwise].map(|e| cell_sums(radar, &e.list));
    say_cells(frame, &short, [&want.map, &got.map, &stricter.map], noise_w, [&in_host, &in_device]);
    let device_maps = Maps::of(&got, &want, noise_w);
    let own = Maps::of(&stricter, &want, noise_w);
    let recut_maps = Maps::of(&received(&otherwise), &want, noise_w);
    Measured {
        echoes: [host.list.len(), device.list.len()],
        bounces: host.bounces,
        agreement: Agreement::of(radar, &found),
        recut: Agreement::of(radar, &recut),
        recut_maps,
        sums: [sums_agreeing(&in_host, &in_device), sums_agreeing(&in_host, &in_other)],
        device: device_maps,
        own,
        moved: moved(&h, &d),
        own_moved: moved(&f, &h),
        fallback: device.fallback.clone(),
        regions: extent.regions.then(|| open_regions(frame, &geometry, &options)).flatten(),
        same_bits: again,
        seconds: [host_s, finer_s, device_s],
    }
}

/// What the host traces in f64 when every target asks the tree for what hides it: the same lit parts, cut in another order. What a curved
/// facet returns is summed up in cells that go with the cuts, so this is how far single echoes of the method are determined.
fn cut_otherwise(frame: &Frame, geometry: &Geometry, options: &TraceOptions) -> Echoes {
    let Frame { radar, pose, ego_mps, .. } = frame;
    let windows = windows(radar, pose);
    let clip = |faces: &Faces, beams: &BeamOptions, ends: Option<Ends<'_>>| {
        let beams = BeamOptions { occluders_listed: 0, ..*beams };
        Ok::<_, Infallible>(beams::clip_windows(faces, &windows, &beams, ends))
    };
    let rate_mps = reach::fastest_path_mps(geometry, *ego_mps, options.bounces);
    let reach_m = options.reach_m.min(reach::reach_m(radar, rate_mps));
    let options = TraceOptions { reach_m, ..*options };
    let Ok(mut all) = echoes_by(geometry, clip, pose, *ego_mps, &options);
    if let Some(air) = &options.air {
        all.list.extend(volume::echoes(geometry, radar, pose, *ego_mps, air, &options));
        air.attenuate(&mut all.list);
    }
    if options.merge {
        merge::merge(&mut all.list, wavenumber(geometry.freq_hz), geometry.reach_s);
    }
    all
}

/// Number of regions that the device lights, and of those whose outline encloses another area than their pieces cover: such a region would
/// have to be made by the host. None where the device refuses the frame.
fn open_regions(frame: &Frame, geometry: &Geometry, options: &TraceOptions) -> Option<[usize; 2]> {
    let windows = windows(&frame.radar, &frame.pose);
    let beams = BeamOptions {
        images: options.images,
        ..BeamOptions::new(options.bounces, options.accuracy_db, false)
    };
    let faces: &Faces = geometry.faces();
    match view_clipper::clip_windows(test_gpu(), faces, &windows, &beams, None).unwrap() {
        Traced::Refused(_) => None,
        Traced::Whole(clipped) => {
            let areas = region_areas_m2(geometry, &clipped);
            let open = areas.iter().filter(|[pieces, outline]| (outline - pieces).abs() > 1e-9 * pieces);
            Some([areas.len(), open.count()])
        }
    }
}

fn say(name: &str, m: &Measured) {
    let echoes = |what: &str, a: &Agreement| {
        println!(
            "  {what}: matched {:.7}, agreeing {:.7}, strong {:.4}, worst {:.1e} turns and {:.1e} dB",
            a.matched, a.agreeing, a.strong, a.worst_turns, a.worst_db
        );
    };
    let maps = |what: &str, m: &Maps| {
        println!(
            "  {what}: amplitude L2 {:.1e}, map L2 {:.1e}, {} of {} cells differ",
            m.amplitude_l2, m.map_l2, m.differ, m.over
        );
    };
    println!("{name}: {:?} echoes of {} bounces, in {:.1?} s", m.echoes, m.bounces, m.seconds);
    echoes("device", &m.agreement);
    echoes("cut otherwise", &m.recut);
    maps("device", &m.device);
    maps("cut otherwise", &m.recut_maps);
    maps("sixteenth of the accuracy", &m.own);
    println!("  sums by chain and range cell agree to {:.6}, cut otherwise {:.6}", m.sums[0], m.sums[1]);
    println!(
        "  chains move {:.1e} of the power, by the accuracy {:.1e}; regions {:?}, fallback {:?}, same bits {:?}; does not hold: {:.3?}",
        m.moved,
        m.own_moved,
        m.regions,
        m.fallback,
        m.same_bits,
        m.wrong()
    );
}

/// A scene of a recipe.
pub(super) fn drawn(recipe: &str, scene: u32) -> Frame {
    let path = scenes().join(format!("recipes/{recipe}.toml"));
    // What is stored is of no matter here, and not every build can write arrays.
    let text = std::fs::read_to_string(&path).unwrap().replace("\"zarr\"", "\"frames\"");
    let site = dataset::drawn_scene(&Recipe::parse(&path, &text, None).unwrap(), scene).unwrap();
    Frame::of(&site.scenario, std::sync::Arc::unwrap_or_clone(site.scene)).unwrap()
}

/// A road that beams hardly tell apart, and one with a manhole, whose facets are millimetres wide: name, scene, most facets.
const ROADS: [(&str, &str, usize); 2] = [
    ("straight road", "road = \"road_model_straight.toml\"", 0),
    ("marked road", "builtin = \"marked-road\"", 50_000),
];

/// A road and one radar on it.
fn road(scene: &str, facets: usize) -> Frame {
    let text = format!(
        "name = \"other\"\nradar = \"demo77\"\n[scene]\n{scene}\n[ego]\nspeed_mps = 10\nposition_m = [0, -1.75, 0]\n[trace]\nfacets = {facets}\n"
    );
    let site = Site::new(&scenario::parse(&scenes().join("road/scenario.toml"), &text).unwrap()).unwrap();
    Frame::of(&site.scenario, site.scene).unwrap()
}

fn scenes() -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes")).to_path_buf()
}

/// All looks of the table in docs/trust.md; CATSEYE_LOOKS chooses those whose name contains it.
#[test]
#[ignore = "takes six minutes"]
fn every_look_that_a_device_traces() {
    let only = std::env::var("CATSEYE_LOOKS").unwrap_or_default();
    let mut looks: Vec<(String, Box<dyn Fn() -> Frame>)> = Vec::new();
    for name in ["W3-static", "W3-moving", "W7", "W8", "W9"] {
        looks.push((name.into(), Box::new(move || frame_of(name).unwrap())));
    }
    for (recipe, scenes) in [("template", 0..10), ("highways", 0..6)] {
        for scene in scenes {
            looks.push((format!("{recipe}, scene {scene}"), Box::new(move || drawn(recipe, scene))));
        }
    }
    for (name, scene, facets) in ROADS {
        looks.push((name.into(), Box::new(move || road(scene, facets))));
    }
    let lines = std::env::var_os("CATSEYE_LINES").is_some();
    let extent = Extent { twice: true, regions: !lines, lines };
    for (name, frame) in looks.iter().filter(|l| l.0.contains(&only)) {
        say(name, &measure(&frame(), &extent));
    }
}

/// What does not hold yet of the looks that are tested, and why (docs/trust.md). A cut by shaders is another one than the host's: strips as
/// narrow as their rounding are lit by one and not by the other, and single echoes of car bodies move by hundredths of a decibel. Where
/// lines of two facets are one, it is open on which of their corners a wave ends: pairs that cancel in sum are there with one and not with
/// the other.
const OPEN: [(&str, &[&str]); 3] = [
    ("template, scene 0", &["power matched", "power agreeing", "dB"]),
    ("template, scene 2", &["power agreeing", "dB"]),
    ("highways, scene 2", &["power matched", "power agreeing", "dB"]),
];

/// Shaders that clip the beams of a frame change its echoes and maps by less than the method's own error.
#[test]
fn a_device_traces_what_the_host_traces() {
    let mut looks: Vec<(String, Frame)> =
        ["W3-static", "W3-moving", "W7"].map(|name| (name.into(), frame_of(name).unwrap())).into();
    // The others take minutes more.
    for (recipe, scene) in [("template", 3), ("template", 0), ("template", 2), ("highways", 2)] {
        looks.push((format!("{recipe}, scene {scene}"), drawn(recipe, scene)));
    }
    looks.extend(ROADS.map(|(name, scene, facets)| (name.into(), road(scene, facets))));
    let mut wrong = Vec::new();
    for (name, frame) in looks {
        // What takes longer is traced twice by the test of the whole table.
        let quick = ["W3", "straight", "template, scene 2"];
        let extent =
            Extent { twice: quick.iter().any(|q| name.starts_with(q)), regions: false, lines: false };
        let m = measure(&frame, &extent);
        say(&name, &m);
        let open = OPEN.iter().find(|o| o.0 == name).map_or(&[][..], |o| o.1);
        let new = m.wrong().into_iter().filter(|(what, _)| !open.contains(what));
        wrong.extend(new.map(|(what, value)| format!("{name}: {what} {value:e}")));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Frames that the device traces by lines hold what is asked of those that it traces by polygons. The host traces them by polygons, in f64.
#[test]
fn a_device_traces_by_lines_what_the_host_traces() {
    let mut looks = vec![("W3-moving".to_string(), frame_of("W3-moving").unwrap())];
    looks.push(("template, scene 2".into(), drawn("template", 2)));
    let (name, scene, facets) = ROADS[0];
    looks.push((name.into(), road(scene, facets)));
    for (name, frame) in looks {
        let m = measure(&frame, &Extent { twice: true, regions: false, lines: true });
        say(&name, &m);
        assert!(m.wrong().is_empty(), "{name}: {:?}", m.wrong());
    }
}

/// An echo of an amplitude at a place.
fn echo(x_m: f64, gain: f64) -> Echo {
    let mut chain = [0; MAX_BOUNCES];
    chain[0] = 7;
    Echo {
        path_length_m: 2.0 * x_m,
        path_rate_mps: 0.0,
        path_acceleration_and_jerk: [0.0; 2],
        departure: DVec3::X,
        first_range_m: x_m,
        first_velocity_mps: DVec3::ZERO,
        arrival: DVec3::X,
        last_range_m: x_m,
        last_velocity_mps: DVec3::ZERO,
        path_gain: [[gain.into(), Complex64::ZERO], [Complex64::ZERO, gain.into()]],
        chain,
        bounces: 1,
        between_m: Box::default(),
    }
}

/// What is wrong shows: a path, an amplitude, an echo that is missing, one too many, and one of another chain; sums in other portions do
/// not.
#[test]
fn echoes_that_differ_are_told() {
    let radar = frame_of("W3-static").unwrap().radar;
    let agreement = |host: &[Echo], device: &[Echo]| Agreement::of(&radar, &pairs(&radar, host, device));
    let host = [echo(20.0, 1e-3), echo(20.3, 1e-3), echo(30.0, 1e-3), echo(40.0, 1e-3)];
    let near = |x: f64, want: f64| (x - want).abs() < 1e-6;
    let same = agreement(&host, &host);
    assert!(near(same.matched, 1.0) && near(same.agreeing, 1.0) && near(same.strong, 1.0), "{same:?}");
    assert_eq!([same.worst_turns, same.worst_db], [0.0; 2]);
    let with = |change: &dyn Fn(&mut Vec<Echo>)| {
        let mut device = host.to_vec();
        change(&mut device);
        agreement(&host, &device)
    };
    let parts = with(&|d| {
        d[1] = echo(20.3 + 1e-7, 0.4e-3);
        d.push(echo(20.3, 0.6e-3));
    });
    assert!(near(parts.agreeing, 1.0) && parts.worst_db < 1e-3, "{parts:?}");
    let moved = with(&|d| d[2] = echo(30.0 + 1.5e-3 * radar.wavelength_m(), 1e-3));
    assert!(near(moved.matched, 1.0) && moved.agreeing < 0.8, "{moved:?}");
    assert!((moved.worst_turns - 3e-3).abs() < 1e-6, "{moved:?}");
    let louder = with(&|d| d[2] = echo(30.0, 1.01e-3));
    assert!(near(louder.matched, 1.0) && louder.agreeing < 0.8, "{louder:?}");
    assert!((louder.worst_db - 20.0 * 1.01f64.log10()).abs() < 1e-6, "{louder:?}");
    let lacking = with(&|d| drop(d.remove(0)));
    assert!(lacking.matched < 0.8, "{lacking:?}");
    let more = with(&|d| d.push(echo(50.0, 1e-3)));
    assert!(more.matched < 0.9 && more.agreeing < 0.9, "{more:?}");
    let other = with(&|d| d[0].chain[0] = 8);
    assert!(other.matched < 0.8, "{other:?}");
}

/// The same for maps: half a decibel in one sample's echo is a cell that differs.
#[test]
fn maps_that_differ_are_told() {
    let received = |a: f64| Received {
        samples: vec![Complex64::new(a, 0.0), Complex64::new(0.0, 1.0)],
        map: PowerMap { data: vec![a * a, 1.0, 1e-9], doppler_bins: 1, range_bins: 3 },
    };
    let m = Maps::of(&received(1.0), &received(1.0), 1e-6);
    assert_eq!((m.amplitude_l2, m.map_l2, m.over, m.differ), (0.0, 0.0, 2, 0));
    let m = Maps::of(&received(1.1), &received(1.0), 1e-6);
    assert!(
        (m.amplitude_l2 - 0.1 / 2f64.sqrt()).abs() < 1e-12 && (m.map_l2 - 0.21 / 2f64.sqrt()).abs() < 1e-12
    );
    assert_eq!((m.over, m.differ), (2, 1));
}

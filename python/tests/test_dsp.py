"""Stages of the chain one by one, tensors of cubes and their labels."""

import pickle
import re
import zipfile
from pathlib import Path

import numpy as np
import pytest

import catseye
from catseye import dsp

ROOT = Path(__file__).resolve().parents[2]
ONE_TX = "[[tx]]\nposition_half_wavelengths = [0, -4, 0]\n", "[[tx]]\nposition_half_wavelengths = [0, 4, 0]\n"


def engines():
    """Engines whose stages are compared with their own chains."""
    names = [("cpu", "f32"), ("cpu", "f64")]
    for adapter in catseye.devices()["adapters"]:
        if "llvmpipe" in adapter["name"] and adapter["self_test"] == "passed":
            names.append(("llvmpipe", "f32"))
    return names


@pytest.fixture(scope="module", params=engines(), ids="-".join)
def each(request):
    device, precision = request.param
    return catseye.Engine(device, precision=precision)


@pytest.fixture(scope="module")
def line(radar_text):
    """A radar of one transmitter, whose channels are its virtual channels."""
    for part in ONE_TX:
        radar_text = radar_text.replace(part, "")
    return catseye.Radar.parse(radar_text)


def scene(radar, folder, *, position_m=(30, 4, 0), velocity_mps=(-3, 0, 0), rcs_dbsm=15):
    """A frame of one point target before the radar, whose mounting is taken out."""
    (folder / "radar.toml").write_text(radar.to_toml())
    text = f'name = "p"\nseed = 7\nradar = "radar.toml"\n[[point]]\nposition_m = {list(position_m)}\n'
    text += f'velocity_mps = {list(velocity_mps)}\nrcs_dbsm = {rcs_dbsm}\nclass = "car"\n[frames]\ncount = 1\n'
    (folder / "scenario.toml").write_text(text)
    return catseye.Scenario(folder / "scenario.toml")


@pytest.fixture(scope="module")
def frame(line, engine, tmp_path_factory):
    return next(catseye.simulate(scene(line, tmp_path_factory.mktemp("line")), engine=engine))


@pytest.fixture(scope="module")
def seen(frame):
    """The target as the radar sees it."""
    pose = {k: getattr(frame, k) for k in ("position_m", "rotation_xyzw", "velocity_mps")}
    return dsp.objects(frame.truth["boxes"], **pose)


def test_stages_give_what_the_chain_gives(scenario, radar, each):
    frame = next(catseye.simulate(scenario, engine=each))
    whole = catseye.process(frame.adc, radar=radar, engine=each)
    ranges = dsp.range_transform(frame.adc, radar=radar, engine=each)
    assert ranges.shape == (32, 12, 256)
    spectrum = dsp.doppler_transform(ranges, radar=radar, engine=each)
    np.testing.assert_array_equal(spectrum, dsp.range_doppler(frame.adc, radar=radar, engine=each))
    power = dsp.power(spectrum, radar=radar, engine=each)
    np.testing.assert_array_equal(power, frame.range_doppler)
    assert power.dtype == whole.range_doppler.dtype
    found = dsp.cfar(power, radar=radar, engine=each)
    np.testing.assert_array_equal(found.mask, whole.mask)
    above = power > dsp.threshold(power, radar=radar, engine=each)
    # Products are rounded, so that a cell at the threshold may lie on either side of it.
    assert (above != found.mask).sum() <= 2
    cells = dsp.snapshots(spectrum, found.cells)
    split = dsp.separate(power, found.cells, found.noise_w, cells, radar=radar)
    sources = dsp.directions(split.snapshots, range_m=split.range_m, radar=radar, engine=each)
    order = np.argsort(-whole.points["power_dbm"], kind="stable")
    best = whole.points[order[0]]
    at = np.argmax(sources["power_w"])
    # Points are at the range of their own estimate of the beat, so that the wavelength differs by 1e-9.
    assert sources["azimuth_deg"][at] == pytest.approx(best["azimuth_deg"], abs=1e-6)
    assert all(np.abs(sources["azimuth_deg"] - a).min() < 1e-6 for a in whole.points["azimuth_deg"])
    assert split.range_m[sources["cell"][at]] == pytest.approx(best["range_m"], abs=1e-6)
    # Without a range they are by the carrier (CONVENTIONS eq. 16a).
    carrier = dsp.directions(split.snapshots, radar=radar, engine=each)["azimuth_deg"][at]
    assert 1e-4 < abs(carrier - best["azimuth_deg"]) < 1e-2
    with pytest.raises(catseye.BadInput, match="range_m"):
        dsp.directions(split.snapshots, range_m=[1.0, 2.0, 3.0, 4.0, 5.0] * 1000, radar=radar, engine=each)
    assert split.range_rate_mps[sources["cell"][at]] == pytest.approx(best["range_rate_mps"], abs=1e-9)
    assert split.ambiguity[sources["cell"][at]] in ("unambiguous", "resolved", "ambiguous", "unresolved")


def changed(text, *pairs):
    """A radar's text with parts replaced, each of which it has."""
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new)
    return catseye.Radar.parse(text)


def kinds(text):
    """Radars whose chains differ: samples, waveforms, ramps, multiplex, what is done about motion."""
    # Maps of Doppler bands have few rows.
    small = ("guard_doppler_cells = 2", "guard_doppler_cells = 1"), ("train_doppler_cells = 4", "train_doppler_cells = 1")
    yield "real", changed(text, ('sampling = "iq"', 'sampling = "real"'))
    yield "static", changed(text).with_processing(remove_static=True)
    yield "keystone", changed(text).with_processing(range_migration="keystone")
    yield "padded", changed(text).with_processing(range_fft=300, doppler_fft=45, range_window="blackman")
    for name in ("bpm", "ddm"):
        yield name, changed(text, ("chirps = 32", f'chirps = 32\nmultiplex = "{name}"'), *small)
    for name in ("fmcw76", "uwb9"):
        yield name, catseye.Radar(name)


@pytest.mark.parametrize("kind", ["real", "static", "keystone", "padded", "bpm", "ddm", "fmcw76", "uwb9"])
def test_stages_of_every_kind_of_radar(radar_text, kind, each):
    """On noise, of every ramp; tensors of them are in W as the map is."""
    radar = dict(kinds(radar_text))[kind]
    draws = np.random.default_rng(11).normal(size=(2, *radar.shape))
    adc = draws[0] if kind in ("real", "uwb9") else draws[0] + 1j * draws[1]
    whole = catseye.process(adc, radar=radar, engine=each)
    for ramp, expected in enumerate(whole.maps):
        spectrum = dsp.range_doppler(adc, radar=radar, ramp=ramp, engine=each)
        np.testing.assert_array_equal(dsp.power(spectrum, radar=radar, ramp=ramp, engine=each), expected)
        if kind != "keystone":
            ranges = dsp.range_transform(adc, radar=radar, ramp=ramp, engine=each)
            np.testing.assert_array_equal(dsp.doppler_transform(ranges, radar=radar, ramp=ramp, engine=each), spectrum)
        # A beam is a mean over channels with weights, whose power is at most the largest of a channel.
        rad = dsp.rad(adc, radar=radar, ramp=ramp, azimuth=8, engine=each)
        assert rad.shape == (expected.shape[1], 8, expected.shape[0])
        assert 0 < rad.max() <= (abs(spectrum) ** 2).max() * (1 + 1e-5)
    found = dsp.cfar(whole.range_doppler, radar=radar, engine=each)
    np.testing.assert_array_equal(found.mask, whole.mask)


@pytest.mark.parametrize("kind", ["ca", "go", "so", "os"])
def test_detectors_of_every_kind(frame, line, each, kind):
    detector = {"kind": kind, "guard_range_cells": 1, "train_range_cells": 6}
    changed = line.with_processing(cfar=detector)
    whole = catseye.process(frame.adc, radar=changed, engine=each)
    spectrum = dsp.range_doppler(frame.adc, radar=line, engine=each)
    power = dsp.power(spectrum, radar=line, engine=each)
    by_keywords = dsp.cfar(power, radar=line, kind=kind, guard=(2, 1), train=(4, 6), engine=each)
    np.testing.assert_array_equal(by_keywords.mask, whole.mask)
    alone = dsp.cfar(power, kind=kind, guard=(2, 1), train=(4, 6), false_alarm_probability=1e-5, looks=4, engine=each)
    np.testing.assert_array_equal(alone.mask, whole.mask)
    assert alone.mask.any() and (alone.noise_w > 0).all()


def test_false_alarms_are_as_many_as_asked_for(engine):
    """On exponential noise the number of cells found is binomial; 1e-6 of it lies outside of five deviations."""
    noise = np.random.default_rng(5).exponential(size=(256, 1024))
    for kind in ("ca", "os"):
        settings = {"kind": kind, "guard": (1, 1), "train": (3, 4), "false_alarm_probability": 1e-2, "looks": 1}
        count = dsp.cfar(noise, **settings, engine=engine).mask.sum()
        expected = 1e-2 * noise.size
        # Neighbouring cells share training cells, so that they do not decide quite independently.
        assert abs(count - expected) < 10 * np.sqrt(expected), (kind, count)


METHODS = ["bartlett", "capon", "ml", "music", "root-music", "esprit", "bi-svd"]


@pytest.mark.parametrize("method", METHODS)
def test_directions_by_every_method(line, engine, method):
    """Plane waves on the line, as eq. 90 has them; Python's own steering vector."""
    place = (line.tx_position_m[:, None] + line.rx_position_m).reshape(-1, 3)[:, 1]
    azimuth = np.radians([-20.0, 10.0, 33.0])
    x = np.exp(-2j * np.pi / line.wavelength_m * np.sin(azimuth)[:, None] * place)
    found = dsp.directions(x, radar=line, method=method, sources=1, engine=engine)
    assert list(found["cell"]) == [0, 1, 2]
    np.testing.assert_allclose(found["azimuth_deg"], np.degrees(azimuth), atol=0.6 if method == "bartlett" else 0.02)
    covariance = x[:, :, None] * x[:, None, :].conj()
    again = dsp.directions(covariance=covariance, radar=line, method=method, sources=1, engine=engine)
    np.testing.assert_allclose(again["azimuth_deg"], np.degrees(azimuth), atol=0.6 if method == "bartlett" else 0.05)
    if method in ("root-music", "esprit"):
        with pytest.raises(catseye.BadInput, match="has no spectrum"):
            dsp.angle_spectrum(x, radar=line, method=method, sources=1, engine=engine)
    else:
        values, azimuth_deg, elevation_deg = dsp.angle_spectrum(x, radar=line, method=method, sources=1, engine=engine)
        assert values.shape == (3, 1, 64) and list(elevation_deg) == [0]
        top = azimuth_deg[values[:, 0].argmax(axis=1)]
        assert np.abs(np.sin(np.radians(top)) - np.sin(azimuth)).max() < 0.03


def test_many_looks_and_two_sources(line, engine):
    place = (line.tx_position_m[:, None] + line.rx_position_m).reshape(-1, 3)[:, 1]
    azimuth = np.radians([-15.0, 22.0])
    steering = np.exp(-2j * np.pi / line.wavelength_m * np.sin(azimuth)[:, None] * place)
    draws = np.random.default_rng(3)
    normal = lambda *shape: (draws.normal(size=shape) + 1j * draws.normal(size=shape)) / np.sqrt(2)
    looks = normal(1, 400, 2) @ steering + 0.05 * normal(1, 400, 4)
    for options in ({"sources": 2}, {"sources": "mdl"}):
        found = dsp.directions(looks, radar=line, method="music", engine=engine, **options)
        np.testing.assert_allclose(sorted(found["azimuth_deg"]), [-15, 22], atol=0.5)
        np.testing.assert_allclose(found["power_w"], 1, rtol=0.2)
    with pytest.raises(catseye.BadInput, match="criterion"):
        dsp.directions(covariance=np.eye(4), radar=line, method="music", sources="mdl", engine=engine)


def test_processing_by_keyword_is_that_of_the_file(frame, line, radar_text, engine):
    text = line.to_toml().replace('[processing.range_window]\nkind = "hann"', '[processing.range_window]\nkind = "blackman"')
    assert text != line.to_toml()
    of_file = catseye.process(frame.adc, radar=catseye.Radar.parse(text), engine=engine).range_doppler
    spectrum = dsp.range_doppler(frame.adc, radar=line, engine=engine, range_window="blackman")
    np.testing.assert_array_equal(dsp.power(spectrum, radar=line, engine=engine), of_file)
    assert line.with_processing().to_toml() == line.to_toml()
    assert line.with_processing(doppler_fft=64).range_rate_mps.shape == (64,)
    assert line.with_processing(angle={"method": "music"}).processing["angle"]["method"] == "music"
    assert pickle.loads(pickle.dumps(line)).to_toml() == line.to_toml()
    # Zeros in front and no window: NumPy's own transform.
    plain = {"range_window": "rectangle", "doppler_window": "rectangle"}
    own = np.fft.fft(frame.adc, axis=2) / frame.adc.shape[2]
    np.testing.assert_allclose(dsp.range_transform(frame.adc, radar=line, engine=engine, **plain), own, atol=1e-6 * abs(own).max())


def test_real_samples_and_other_types_are_taken(line, engine):
    ones = np.ones(line.shape)
    spectrum = dsp.range_doppler(ones, radar=line, engine=engine)
    assert spectrum.dtype == np.complex64
    for other in (ones.astype(np.int16), ones.astype(np.complex128), np.asfortranarray(ones), ones.tolist()):
        np.testing.assert_array_equal(dsp.range_doppler(other, radar=line, engine=engine), spectrum)


def test_what_is_wrong_is_said(line, engine):
    ones = np.ones(line.shape)
    broken = ones.copy()
    broken[3, 1, 7] = np.nan
    power = np.ones((32, 256))
    for call, part in [
        (lambda: dsp.range_doppler(ones[1:], radar=line, engine=engine), "radar's shape"),
        (lambda: dsp.range_doppler(ones[0], radar=line, engine=engine), "number of axes"),
        (lambda: dsp.range_doppler(broken, radar=line, engine=engine), r"adc\[3, 1, 7\]"),
        (lambda: dsp.range_doppler(np.full(line.shape, "x"), radar=line, engine=engine), "another type of numbers"),
        (lambda: dsp.range_doppler(ones, radar=line, engine=engine, range_windows="hann"), "range_windows"),
        (lambda: dsp.range_doppler(ones, radar=line, engine=engine, range_window="hat"), "range_window"),
        (lambda: dsp.range_doppler(ones, radar=line, ramp=1, engine=engine), "no such ramp"),
        (lambda: dsp.doppler_transform(ones[:, :, 1:], radar=line, engine=engine), "range spectrum"),
        (lambda: dsp.range_transform(ones, radar=line, engine=engine, range_migration="keystone"), "keystone"),
        (lambda: dsp.power(ones[1:], radar=line, engine=engine), "range-Doppler spectrum"),
        (lambda: dsp.cfar(-power, radar=line, engine=engine), "negative"),
        (lambda: dsp.cfar(power * np.inf, radar=line, engine=engine), "finite"),
        (lambda: dsp.cfar(power, radar=line, kind="mean", engine=engine), "ca, go, so, os"),
        (lambda: dsp.cfar(power, radar=line, kind="ca", rank=3, engine=engine), "rank"),
        (lambda: dsp.cfar(power, kind="ca", engine=engine), "guard"),
        (lambda: dsp.cfar(power[:5], radar=line, engine=engine), "taller"),
        (lambda: dsp.directions(np.ones(5), radar=line, engine=engine), "virtual channels"),
        (lambda: dsp.directions(np.ones(4), radar=line, method="matched", engine=engine), "method"),
        (lambda: dsp.directions(np.ones(4), radar=line, method="music", engine=engine), "noise"),
        (lambda: dsp.directions(radar=line, engine=engine), "snapshots or covariance"),
        (lambda: dsp.directions(covariance=np.ones((4, 4)) * 1j, radar=line, engine=engine), "Hermitian"),
        (lambda: dsp.separate(power, [[40, 3]], [1.0], np.ones((1, 4)), radar=line), "outside the map"),
        (lambda: dsp.range_azimuth(ones, radar=line, azimuth=[0, 95.0], engine=engine), "ahead"),
        (lambda: dsp.range_azimuth(ones, radar=line, azimuth=1, engine=engine), "Fourier"),
        (lambda: dsp.range_azimuth(ones, radar=line, reduce="median", engine=engine), "max, sum, mean"),
        (lambda: dsp.chirps_azimuth(ones, radar=line, chirps=[32], engine=engine), "no such chirp"),
        (lambda: dsp.chirps_azimuth(ones, radar=line, chirps=[-1], engine=engine), "no such chirp"),
        (lambda: dsp.rad(ones, radar=line, complex=True, elevation=[0, 1], engine=engine), "one elevation"),
        (lambda: dsp.sparse(power, share=0), "share"),
        (lambda: dsp.cluster({"x_m": [1.0], "y_m": [0.0]}), "range_rate_mps"),
        (lambda: dsp.cluster({"x_m": [1.0], "y_m": [0.0], "range_rate_mps": [0.0]}, min_points=0), "min_points"),
        (lambda: dsp.Tracker(confirm_hits=9), "confirm_hits"),
    ]:
        with pytest.raises(catseye.BadInput, match=part):
            call()


def test_clusters_and_tracks(engine):
    """A car drives away at 5 m/s, seen as two points in every scan, as in the library's own example."""
    tracker = dsp.Tracker()
    for step in range(10):
        time_s = 0.1 * step
        ranges, azimuth = np.array([20.0, 20.3, 60.0]) + 5 * time_s, np.array([0.02, -0.03, 0.5])
        points = {
            "range_m": ranges,
            "range_rate_mps": np.full(3, 5.0),
            "azimuth_deg": np.degrees(azimuth),
            "elevation_deg": np.zeros(3),
            "x_m": ranges * np.cos(azimuth),
            "y_m": ranges * np.sin(azimuth),
            "range_std_m": np.full(3, 0.1),
            "range_rate_std_mps": np.full(3, 0.1),
            "azimuth_std_deg": np.full(3, np.degrees(0.01)),
        }
        labels = dsp.cluster(points)
        assert list(labels) == [0, 0, -1]
        plots = dsp.plots(points, labels)
        assert len(plots) == 1 and plots["points"][0] == 2
        np.testing.assert_allclose(plots["range_m"], np.hypot(*[points[k][:2].mean() for k in ("x_m", "y_m")]))
        tracks = tracker.step(time_s, plots, frame=step)
    assert len(tracks) == 1 and tracks["state"][0] == "confirmed" and tracks["frame"][0] == 9
    assert tracks["vx_mps"][0] == pytest.approx(5, abs=0.1) and tracks["points"][0] == 2
    with pytest.raises(catseye.BadInput, match="order of their times"):
        tracker.step(0.0, plots)


def predicted(line, seen):
    """Range column and Doppler row of the target by the closed forms of CONVENTIONS, with a cell of slack for its walk and its coupling."""
    return seen["range_m"][0] / line.range_bin_m, seen["range_rate_mps"][0] / line.velocity_bin_mps + len(line.range_rate_mps) // 2


@pytest.mark.parametrize("azimuth", [None, 64, np.arange(-50.0, 51.0, 2.0)], ids=["radar", "fourier", "degrees"])
def test_a_point_target_is_in_its_cell_of_every_tensor(frame, line, seen, engine, azimuth):
    arguments = {"radar": line, "azimuth": azimuth, "engine": engine}
    axis = dsp.grid(radar=line, azimuth=azimuth)[0]
    column, row = predicted(line, seen)
    across = np.degrees(np.arctan2(seen["y_m"][0], seen["x_m"][0]))
    step = np.diff(np.sin(np.radians(axis))).max()
    cell = dsp.object_cells(seen, radar=line, azimuth=azimuth)[0]
    assert abs(cell[0] - row) <= 0.5 and abs(cell[1] - column) <= 1
    assert abs(np.sin(np.radians(axis[cell[2]])) - np.sin(np.radians(across))) <= 0.51 * step

    def near(top, *axes):
        for at, name in zip(top, axes, strict=True):
            wanted = cell["dra".index(name)]
            assert abs(int(at) - int(wanted)) <= (2 if name == "a" else 1), (name, top, cell)

    rad = dsp.rad(frame.adc, **arguments)
    assert rad.shape == (256, len(axis), 32) and rad.dtype == np.float32
    near(np.unravel_index(rad.argmax(), rad.shape), *"rad")
    ra, ad = dsp.range_azimuth(frame.adc, **arguments), dsp.angle_doppler(frame.adc, **arguments)
    near(np.unravel_index(ra.argmax(), ra.shape), *"ra")
    near(np.unravel_index(ad.argmax(), ad.shape), *"ad")
    np.testing.assert_array_equal(ra, rad.max(axis=2))
    np.testing.assert_array_equal(ad, rad.max(axis=0))
    np.testing.assert_allclose(dsp.range_azimuth(frame.adc, reduce="sum", **arguments), rad.sum(axis=2, dtype=float), rtol=1e-6)
    np.testing.assert_allclose(dsp.angle_doppler(frame.adc, reduce="mean", **arguments), rad.mean(axis=0, dtype=float), rtol=1e-6)
    values = dsp.rad(frame.adc, complex=True, **arguments)
    np.testing.assert_allclose(abs(values) ** 2, rad, rtol=1e-5)
    chirps = dsp.chirps_azimuth(frame.adc, chirps=[0, 5], **arguments)
    assert chirps.shape == (2, 256, len(axis)) and chirps.dtype == np.complex64
    for one in chirps:
        near(np.unravel_index(abs(one).argmax(), one.shape), *"ra")
    # The amplitudes turn from chirp to chirp with the range rate: slow-time frequency +2v/lambda.
    turn = np.angle(chirps[1, cell[1], cell[2]] / chirps[0, cell[1], cell[2]]) / (2 * np.pi)
    loops = 5 * line.frame_time_s / 32 * 2 * seen["range_rate_mps"][0] / line.wavelength_m
    assert abs((turn - loops + 0.5) % 1 - 0.5) < 0.02
    four = dsp.tensor4d(frame.adc, elevation=[-5.0, 0.0, 5.0], **arguments)
    assert four.shape == (32, 256, 3, len(axis))
    np.testing.assert_array_equal(four[:, :, 1], rad.transpose(2, 0, 1))


def test_rad_is_the_fourier_transform_over_the_line(frame, line, engine):
    """RADDet's cube by NumPy: the line's channels, windowed, padded with zeros and transformed."""
    place = (line.tx_position_m[:, None] + line.rx_position_m).reshape(-1, 3)[:, 1]
    assert np.allclose(np.diff(place), 0.5 * line.wavelength_m)
    own = {"angle_window": "rectangle"}
    values = dsp.rad(frame.adc, radar=line, azimuth=256, complex=True, engine=engine, **own)
    spectrum = dsp.range_doppler(frame.adc, radar=line, engine=engine)
    # sin = 2k/N - 1 on half a wavelength turns channel c by k c / N turns, less half a turn: an inverse transform, shifted, and as seen from the middle.
    k = np.arange(256) - 128
    transform = np.fft.fftshift(np.fft.ifft(spectrum, 256, axis=1) * 256 / 4, axes=1)
    transform = transform * np.exp(2j * np.pi * k * place[0] / line.wavelength_m * 2 / 256)[None, :, None]
    np.testing.assert_allclose(values, transform.transpose(2, 1, 0), atol=2e-6 * abs(values).max())
    # Over all bins the power is that of the channels (Parseval): the sum over azimuth agrees with the range-Doppler map.
    power = dsp.power(spectrum, radar=line, engine=engine)
    np.testing.assert_allclose((abs(values) ** 2).sum(axis=1).T * 4 / 256, power, rtol=2e-3, atol=1e-5 * power.max())


def test_tensors_are_the_chains_own_where_it_has_them(frame, line, each):
    """With one transmitter a detected cell's spectrum over angle is the tensor's column."""
    spectrum = dsp.range_doppler(frame.adc, radar=line, engine=each)
    found = dsp.cfar(dsp.power(spectrum, radar=line, engine=each), radar=line, engine=each)
    assert len(found.cells)
    values, azimuth_deg, _ = dsp.angle_spectrum(dsp.snapshots(spectrum, found.cells), radar=line, engine=each)
    np.testing.assert_array_equal(azimuth_deg, dsp.grid(radar=line)[0])
    rad = dsp.rad(frame.adc, radar=line, engine=each)
    for (row, column), one in zip(found.cells, values, strict=True):
        np.testing.assert_array_equal(rad[column, :, row], one[0])


def test_transmitters_in_turn_are_turned_back(scenario, radar, engine):
    frame = next(catseye.simulate(scenario, engine=engine))
    pose = {k: getattr(frame, k) for k in ("position_m", "rotation_xyzw", "velocity_mps")}
    seen = dsp.objects(frame.truth["boxes"], **pose)
    assert seen["range_rate_mps"][0] == pytest.approx(-3 * seen["x_m"][0] / seen["range_m"][0], rel=1e-6)
    rad = dsp.rad(frame.adc, radar=radar, azimuth=128, engine=engine)
    top = np.unravel_index(rad.argmax(), rad.shape)
    row, column, across = dsp.object_cells(seen, radar=radar, azimuth=128)[0]
    assert abs(top[0] - column) <= 1 and abs(top[1] - across) <= 1 and abs(top[2] - row) <= 1


def test_the_shape_of_kradar_and_its_sparse_cells(engine):
    """A planar array of 64 chirps and 256 samples on K-Radar's grid, with a target above the horizon."""
    text = catseye.Radar("demo77").to_toml()
    rows = "".join(f"[[rx]]\nposition_m = [0, {y}, {z}]\n" for y in (0, 0.00195) for z in (0, 0.00195, 0.0039))
    radar = catseye.Radar.parse(text).with_processing()
    head = text[: text.index("[[tx]]")] + "[[tx]]\nposition_m = [0, 0, 0]\n" + rows
    head += text[text.index("[mounting]") :]
    radar = catseye.Radar.parse(head.replace("chirps = 128", "chirps = 64").replace("doppler_fft = 128", "doppler_fft = 64"))
    assert radar.shape == (64, 6, 256)
    place = (radar.tx_position_m[:, None] + radar.rx_position_m).reshape(-1, 3)
    azimuth, elevation, column, row = np.radians(20.0), np.radians(9.0), 40, 20
    u = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    channels = np.exp(-2j * np.pi / radar.wavelength_m * place @ u)
    slow = np.exp(2j * np.pi * np.arange(64) * (row - 32) / 64)
    fast = np.exp(2j * np.pi * np.arange(256) * column / 256)
    adc = slow[:, None, None] * channels[None, :, None] * fast
    tensor = dsp.tensor4d(adc, radar=radar, azimuth=dsp.KRADAR_AZIMUTH_DEG, elevation=dsp.KRADAR_ELEVATION_DEG, engine=engine)
    assert tensor.shape == (64, 256, 37, 107)
    assert np.unravel_index(tensor.argmax(), tensor.shape) == (row, column, 18 + 9, 53 + 20)
    assert tensor.max() == pytest.approx(1, rel=1e-4)
    few = dsp.sparse(tensor, share=1e-4)
    assert few.indices.shape == (int(np.ceil(1e-4 * tensor.size)), 4)
    assert tuple(few.indices[0]) == (row, column, 27, 73)
    assert (np.diff(few.power_w) <= 0).all() and few.power_w[-1] >= np.quantile(tensor, 1 - 1.01e-4)
    np.testing.assert_array_equal(tensor[tuple(few.indices.T)], few.power_w)


def test_masks_and_confidence_of_points_and_boxes(frame, line, seen):
    arguments = {"radar": line, "classes": ["truck", "car"], "azimuth": 64}
    row, column, across = dsp.object_cells(seen, radar=line, azimuth=64)[0]
    masks = dsp.masks(seen, **arguments)
    assert [m.shape for m in masks] == [(256, 64), (32, 256), (64, 32)]
    assert masks.range_azimuth[column, across] == masks.range_doppler[row, column] == masks.angle_doppler[across, row] == 2
    assert [(m > 0).sum() for m in masks] == [1, 1, 1]
    of_points = dsp.masks(frame.points, **arguments)
    assert (of_points.range_doppler == 2).any()
    for r, d in zip(*np.nonzero(of_points.range_doppler.T), strict=True):
        assert abs(r - column) <= 1 and abs(d - row) <= 1
    # A box fills more, and the same cell in its middle.
    box = seen.copy()
    box["length_m"], box["width_m"], box["height_m"] = 4.5, 1.8, 1.5
    bigger = dsp.masks(box, **arguments)
    assert bigger.range_azimuth[column, across] == 2 and (bigger.range_azimuth > 0).sum() > 5
    map_ = dsp.confidence(box, **arguments)
    assert map_.shape == (2, 256, 64) and map_.dtype == np.float32
    assert map_[1, column, across] == 1 and (map_ == 1).sum() == 1 and not map_[0].any()
    sigma = max(2.25 / line.range_bin_m, 1)
    assert map_[1, column + 4, across] == pytest.approx(np.exp(-8 / sigma**2), rel=1e-5)
    narrow = dsp.confidence(box, sigma_m={"car": 0.1}, **arguments)
    assert narrow[1, column + 1, across] == pytest.approx(np.exp(-0.5), rel=1e-5)
    assert not dsp.masks(seen, radar=line, classes=["truck"]).range_azimuth.any()
    with pytest.raises(catseye.BadInput, match="is empty"):
        dsp.masks(seen, radar=line, classes=[])
    with pytest.raises(catseye.BadInput, match="table of objects"):
        dsp.masks([1, 2], radar=line, classes=["car"])


TENSORS = {
    "range_doppler": {},
    "range_azimuth": {"azimuth": 64},
    "angle_doppler": {"azimuth": 64},
    "rad": {"azimuth": 32},
    "chirps_azimuth": {"chirps": [0, 3], "azimuth": 64},
    "tensor4d": {},
    "sparse": {"share": 0.01},
    "masks": {"classes": ["car", "target", "point"], "azimuth": 64},
    "confidence": {"classes": ["car", "target", "point"], "azimuth": 64},
    "objects": {},
}


@pytest.fixture(scope="module")
def tiny_radar(recipe):
    return recipe.with_name("tiny_radar.toml")


def test_a_dataset_computes_tensors_on_read(data, tiny_radar, engine):
    plain = catseye.Dataset(data)
    classes = sorted({c for s in plain for c in s["boxes"]["class"][s["boxes"]["visible"]]})
    options = {**TENSORS, **{name: {"classes": classes, "azimuth": 64} for name in ("masks", "confidence")}}
    dataset = catseye.Dataset(data, tensors=options, radar=tiny_radar, engine=engine)
    radar = catseye.Radar(tiny_radar)
    shapes = {
        "range_doppler": (16, 64),
        "range_azimuth": (64, 64),
        "angle_doppler": (64, 16),
        "rad": (64, 32, 16),
        "chirps_azimuth": (2, 64, 64),
        "tensor4d": (16, 64, 1, 64),
        "sparse_indices": (656, 4),
        "sparse_power_w": (656,),
        "mask_range_azimuth": (64, 64),
        "mask_range_doppler": (16, 64),
        "mask_angle_doppler": (64, 16),
        "confidence": (len(classes), 64, 64),
    }
    marked = 0
    for item, stored in zip(dataset, plain, strict=True):
        assert set(item) == set(stored) | set(shapes) | {"objects"}
        assert {name: item[name].shape for name in shapes} == shapes
        # The stored map is the chain's, and the computed one the same bits.
        np.testing.assert_array_equal(item["range_doppler"], stored["range_doppler"])
        np.testing.assert_array_equal(item["rad"], dsp.rad(stored["adc"], radar=radar, azimuth=32, engine=engine))
        np.testing.assert_array_equal(item["adc"], stored["adc"])
        cells = dsp.object_cells(item["objects"], radar=radar, azimuth=64)
        for (row, column, across), name in zip(cells, item["objects"]["class"], strict=True):
            if column >= 0 and across >= 0:
                marked += 1
                assert item["mask_range_azimuth"][column, across] and item["mask_range_doppler"][row, column]
                assert item["mask_angle_doppler"][across, row]
                assert item["confidence"][classes.index(name), column, across] == 1
    assert marked > 10
    few = catseye.Dataset(data, arrays=[], tables=[], tensors=["range_azimuth"], radar=tiny_radar, engine=engine)
    assert set(few[0]) == {"frame", "range_azimuth"}
    again = pickle.loads(pickle.dumps(few))[2:]
    np.testing.assert_array_equal(again[0]["range_azimuth"], few[2]["range_azimuth"])


def test_torch_batches_of_tensors(data, tiny_radar, engine, torch):
    options = {"rad": {"azimuth": 32}, "objects": {}, "sparse": {}}
    dataset = catseye.Dataset(data, tables=["points"], tensors=options, radar=tiny_radar, engine=engine)
    loader = torch.utils.data.DataLoader(dataset.torch(), batch_size=5, num_workers=0)
    batch = next(iter(loader))
    assert np.asarray(batch["rad"]).shape == (5, 64, 32, 16)
    for i in range(5):
        item = dataset[i]
        np.testing.assert_array_equal(np.asarray(batch["rad"][i]), item["rad"])
        valid = np.asarray(batch["objects"]["valid"][i])
        assert valid.sum() == len(item["objects"])
        np.testing.assert_array_equal(np.asarray(batch["objects"]["x_m"][i])[valid], item["objects"]["x_m"].astype(np.float32))


def test_datasets_that_cannot_have_tensors(data, tiny_radar, recipe, radar, engine, tmp_path):
    for arguments, part in [
        ({"tensors": ["radar"], "radar": tiny_radar}, "range_azimuth"),
        ({"tensors": ["rad"], "radar": radar}, "not the radar of the samples"),
        ({"tensors": ["masks"], "radar": tiny_radar}, "classes"),
    ]:
        with pytest.raises(catseye.BadInput, match=part):
            catseye.Dataset(data, **arguments)
    other = tmp_path / "other.toml"
    other.write_text(tiny_radar.read_text().replace("carrier_hz = 77e9", "carrier_hz = 76.5e9"))
    with pytest.raises(catseye.BadInput, match="not the radar of the samples"):
        catseye.Dataset(data, tensors=["rad"], radar=other, engine=engine)[0]
    (tmp_path / "tiny_radar.toml").write_text(tiny_radar.read_text())
    bare = tmp_path / "bare.toml"
    bare.write_text(recipe.read_text().replace("adc = true\n", ""))
    catseye.dataset(bare, tmp_path / "bare", engine=engine)
    with pytest.raises(catseye.BadInput, match="adc = true") as e:
        catseye.Dataset(tmp_path / "bare", tensors=["rad"], radar=tiny_radar)
    assert e.value.key == "tensors" and e.value.remedy


def _inline(recipe, tiny_radar, **drawn):
    """The tiny recipe with its radar written out, some of whose numbers are drawn."""
    radar = re.sub(r"(?m)^(\[\[?)", r"\1scenario.radar.", tiny_radar.read_text())
    for key, value in drawn.items():
        radar, count = re.subn(rf"(?m)^{key} = .*$", f"{key} = {value}", radar)
        assert count == 1
    return recipe.read_text().replace('radar = "tiny_radar.toml"\n', "") + f"\n[scenario.radar]\n{radar}"


def test_datasets_contain_their_radars(data, tiny_radar, engine, tmp_path, monkeypatch):
    """The dataset's own radar is the default; another one is refused by the key in which it differs, and another search over angle is not."""
    own = catseye.Dataset(data, tables=[], tensors=["range_azimuth"], engine=engine)
    given = catseye.Dataset(data, tables=[], tensors=["range_azimuth"], radar=tiny_radar, engine=engine)
    np.testing.assert_array_equal(own[3]["range_azimuth"], given[3]["range_azimuth"])
    named = pickle.loads(pickle.dumps(catseye.Dataset(data, tables=[], tensors=["range_azimuth"], radar="tiny", engine=engine)))
    np.testing.assert_array_equal(own[3]["range_azimuth"], named[3]["range_azimuth"])
    text = tiny_radar.read_text()
    lines = [line for line in text.splitlines() if line.startswith("position_half_wavelengths")]
    swapped = text.replace(lines[1], "first").replace(lines[2], lines[1]).replace("first", lines[2])
    for other, key in [
        (text.replace("-1.5, 0]", "-3, 0]").replace("-0.5, 0]", "-1, 0]"), "rx[0].position_m"),
        (swapped, "rx[0].position_m"),
        (text.replace("bandwidth_hz = 375e6", "bandwidth_hz = 750e6"), "waveform.bandwidth_hz"),
        (text.replace("chirp_period_s = 16e-6", "chirp_period_s = 32e-6"), "waveform.chirp_period_s"),
        (text.replace('doppler_window = { kind = "hann" }', 'doppler_window = { kind = "blackman" }'), "processing.doppler_window"),
        (text.replace('angle_window = { kind = "hann" }', 'angle_window = { kind = "rectangle" }'), "processing.angle_window"),
    ]:
        assert other != text
        path = tmp_path / "other.toml"
        path.write_text(other)
        with pytest.raises(catseye.BadInput, match="not the radar of the samples") as e:
            catseye.Dataset(data, tensors=["range_azimuth"], radar=path, engine=engine)
        assert e.value.key.startswith(f"radar.{key}") and e.value.value and e.value.allowed, str(e.value)
    free = catseye.Radar(tiny_radar).with_processing(azimuth_bins=16, cfar={"false_alarm_probability": 1e-3})
    catseye.Dataset(data, tensors=["range_azimuth"], radar=free, engine=engine)[0]
    # A window of one tensor.
    options = {"range_doppler": {"range_window": "blackman"}}
    blackman = catseye.Dataset(data, tables=[], tensors=options, engine=engine)[3]
    other = catseye.dsp.range_doppler(blackman["adc"], radar=free, range_window="blackman", engine=engine)
    np.testing.assert_array_equal(blackman["range_doppler"], catseye.dsp.power(other, radar=free, engine=engine))
    # A relative folder stays what it is.
    monkeypatch.chdir(data.parent)
    relative = catseye.Dataset(data.name, tables=[], tensors=["range_azimuth"], engine=engine)
    monkeypatch.chdir(tmp_path)
    again = pickle.loads(pickle.dumps(relative))
    for dataset in (relative, again):
        np.testing.assert_array_equal(dataset[3]["range_azimuth"], own[3]["range_azimuth"])


def test_drawn_radars_are_those_of_each_scene(recipe, tiny_radar, engine, tmp_path):
    """Each frame's tensors are those of the radar that its scene drew: axes of the table `radars` are those of the radar."""
    drawn = _inline(recipe, tiny_radar, bandwidth_hz="{ uniform = [300e6, 450e6] }", noise_figure_db="{ uniform = [10, 16] }")
    (tmp_path / "drawn.toml").write_text(drawn)
    catseye.dataset(tmp_path / "drawn.toml", tmp_path / "data", engine=engine)
    dataset = catseye.Dataset(tmp_path / "data", tensors=["range_azimuth"], engine=engine)
    bins = set()
    for frame in (0, 3, 6, 9):
        sample = dataset[frame]
        radar = dataset.radar(frame)
        assert radar.range_bin_m == pytest.approx(sample["radars"]["range_bin_m"][0], rel=1e-12)
        bins.add(radar.range_bin_m)
        np.testing.assert_array_equal(sample["range_azimuth"], catseye.dsp.range_azimuth(sample["adc"], radar=radar, engine=engine))
    assert len(bins) == 4
    with pytest.raises(catseye.BadInput, match="not the radar of the samples") as e:
        catseye.Dataset(tmp_path / "data", tensors=["range_azimuth"], radar=tiny_radar, engine=engine)
    assert e.value.key == "radar.waveform.bandwidth_hz"


def test_a_draw_of_the_shape_is_refused_before_the_first_frame(recipe, tiny_radar, engine, tmp_path):
    drawn = _inline(recipe, tiny_radar, chirps="{ choice = [16, 32] }").replace("seed = 3", "seed = 5")
    (tmp_path / "drawn.toml").write_text(drawn)
    with pytest.raises(catseye.BadInput, match="make a dataset for each") as e:
        catseye.dataset(tmp_path / "drawn.toml", tmp_path / "data", engine=engine)
    assert e.value.key == "scenario.radar.waveform.chirps" and e.value.line
    assert not (tmp_path / "data").exists()


def test_tensors_of_several_radars(recipe, tiny_radar, engine, tmp_path):
    """Two radars of one file, 0.8 m apart: each has tensors of its own samples."""
    text = recipe.read_text().replace('radar = "tiny_radar.toml"\n', "")
    for name, y in (("front-left", 0.4), ("right", -0.4)):
        text += f'\n[[scenario.radars]]\nname = "{name}"\nradar = "tiny_radar.toml"\nmounting = {{ position_m = [3.6, {y}, 0.5] }}\n'
    (tmp_path / "two.toml").write_text(text.replace("[keep]\n", "[keep]\nmasks = true\n"))
    (tmp_path / "tiny_radar.toml").write_text(tiny_radar.read_text())
    folder = tmp_path / "data"
    catseye.dataset(tmp_path / "two.toml", folder, engine=engine)
    both = catseye.Dataset(folder, tensors={"range_azimuth": {}, "objects": {}}, engine=engine)
    sample = both[1]
    radar = catseye.Radar(tiny_radar)
    for suffix in ("front_left", "right"):
        expected = catseye.dsp.range_azimuth(sample[f"adc_{suffix}"], radar=radar, engine=engine)
        np.testing.assert_array_equal(sample[f"range_azimuth_{suffix}"], expected)
    assert not np.array_equal(sample["range_azimuth_front_left"], sample["range_azimuth_right"])
    assert both.tables[-2:] == ["objects_front_left", "objects_right"]
    left, right = sample["objects_front_left"], sample["objects_right"]
    shared = np.intersect1d(left["id"], right["id"])
    assert len(shared)
    for number in shared:
        apart = right[right["id"] == number]["y_m"][0] - left[left["id"] == number]["y_m"][0]
        assert apart == pytest.approx(0.8)
    one = catseye.Dataset(folder, tensors=["range_azimuth"], radar="right", engine=engine)[1]
    np.testing.assert_array_equal(one["range_azimuth"], sample["range_azimuth_right"])
    given = catseye.Dataset(folder, tensors=["range_azimuth"], radar={"right": tiny_radar}, engine=engine)[1]
    np.testing.assert_array_equal(given["range_azimuth_right"], sample["range_azimuth_right"])
    with pytest.raises(catseye.BadInput, match="several radars") as e:
        catseye.Dataset(folder, tensors=["range_azimuth"], radar=tiny_radar, engine=engine)
    assert "right" in e.value.allowed
    with pytest.raises(catseye.BadInput, match="no radar of this name"):
        catseye.Dataset(folder, tensors=["range_azimuth"], radar=["back"], engine=engine)


def test_datasets_of_version_1(tiny_radar, engine, tmp_path):
    """A dataset that contains no radars is read with the given one, with a warning, and its frames are in the parts that it says."""
    with zipfile.ZipFile(ROOT / "crates/io/tests/dataset_v1.zip") as archive:
        archive.extractall(tmp_path / "old")
    text = tiny_radar.read_text()
    for old, new in [
        ("\nsamples = 64", "\nsamples = 16"),
        ("chirps = 16", "chirps = 4"),
        ("train_range_cells = 4", "train_range_cells = 2"),
        ("train_doppler_cells = 4", "train_doppler_cells = 1"),
        ("guard_doppler_cells = 2", "guard_doppler_cells = 0"),
        ("guard_range_cells = 2", "guard_range_cells = 1"),
        ("bandwidth_hz = 375e6", "bandwidth_hz = 93.75e6"),
    ]:
        text = text.replace(old, new)
    (tmp_path / "radar.toml").write_text(text)
    plain = catseye.Dataset(tmp_path / "old")
    for frame in (0, 1):
        sample = plain[frame]
        assert sample["grid_road"].shape == (4, 450, 300) and sample["mask_road"].max() > 0
        np.testing.assert_array_equal(sample["grid_road"], np.load(tmp_path / f"old/frame_{frame:06}/grid_road.npy"))
        assert frame in plain.split(sample["frames"]["split"][0]).frames
    assert plain.radars == []
    with pytest.raises(catseye.BadInput, match="before datasets contained their radars"):
        plain.radar()
    with pytest.raises(catseye.BadInput, match="before datasets contained their radars"):
        catseye.Dataset(tmp_path / "old", tensors=["range_azimuth"])
    with pytest.warns(UserWarning, match="cannot be checked"):
        read = catseye.Dataset(tmp_path / "old", tensors=["range_azimuth"], radar=tmp_path / "radar.toml", engine=engine)
    assert read[1]["range_azimuth"].shape[0] == 16
    (tmp_path / "wide.toml").write_text(text.replace("bandwidth_hz = 93.75e6", "bandwidth_hz = 187.5e6"))
    with pytest.warns(UserWarning):
        read = catseye.Dataset(tmp_path / "old", tensors=["range_azimuth"], radar=tmp_path / "wide.toml", engine=engine)
    with pytest.raises(catseye.BadInput, match="not the radar of the samples"):
        read[0]

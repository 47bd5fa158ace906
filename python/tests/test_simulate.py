import os
import signal
import subprocess
import sys
import threading
import warnings

import numpy as np
import pytest

import catseye


def test_radar_facts(radar):
    assert radar.name == "demo77" and "demo77" in catseye.presets()
    chirps, channels, samples = radar.shape
    assert channels == len(radar.tx_position_m) * len(radar.rx_position_m) and chirps == 32
    assert radar.wavelength_m == pytest.approx(299_792_458 / radar.carrier_hz)
    assert radar.range_m[1] - radar.range_m[0] == pytest.approx(radar.range_bin_m)
    assert catseye.Radar.parse(radar.to_toml()).to_toml() == radar.to_toml()
    with pytest.raises(catseye.BadInput, match="did you mean 'demo77'"):
        catseye.Radar("demo7")
    with pytest.raises(catseye.BadInput) as e:
        catseye.Radar.parse(radar.to_toml().replace("noise_figure_db", "noise_figur_db"))
    assert e.value.line and "noise_figur_db" in str(e.value)


def test_a_point_is_where_it_was_put(scenario, engine):
    frames = catseye.simulate(scenario, engine=engine)
    assert len(frames) == 3
    frame = next(frames)
    assert len(frames) == 2
    assert frame.adc.dtype == np.complex64 and frame.adc.shape == scenario.radars[0].shape
    assert frame.adc.flags.c_contiguous and frame.adc.flags.aligned
    assert frame.range_doppler.shape == (len(frame.range_rate_mps), len(frame.range_m))
    assert frame.range_doppler.dtype == np.float32
    # Radar and target from the truth.
    box = frame.truth["boxes"][0]
    to = np.array(box["centre_m"]) - frame.position_m
    rate = to @ (np.array(box["velocity_mps"]) - frame.velocity_mps) / np.linalg.norm(to)
    best = frame.points[np.argmax(frame.points["snr_db"])]
    assert abs(best["range_m"] - np.linalg.norm(to)) < 0.2
    assert abs(best["range_rate_mps"] - rate) < 0.2
    assert abs(best["azimuth_deg"] - np.degrees(np.arctan2(to[1], to[0]))) < 2
    assert abs(best["rcs_dbsm"] - 15) < 2
    assert best["class"] == "car" and best["object_id"] == box["id"]
    cell = np.unravel_index(frame.range_doppler.argmax(), frame.range_doppler.shape)
    assert abs(frame.range_m[cell[1]] - np.linalg.norm(to)) < 2 * scenario.radars[0].range_bin_m
    echo = frame.returns[0]
    assert len(frame.returns) == 1 and echo["chain"][0] == box["id"] and echo["bounces"] == 1
    assert echo["path_length_m"] == pytest.approx(2 * np.linalg.norm(to), rel=1e-9)
    # |S|^2 4 pi is the cross section.
    s = abs(echo["spread"][0, 0]) * np.linalg.norm(to) ** 2
    assert 10 * np.log10(4 * np.pi * s**2) == pytest.approx(15, abs=1e-6)
    assert set(frame.seconds) == {"geometry", "trace", "synthesis", "processing", "angles"}


def test_frames_repeat_and_stand_alone(scenario, engine):
    first = [f.adc for f in catseye.simulate(scenario, engine=engine)]
    alone = next(catseye.simulate(scenario, frames=[2], engine=engine))
    assert alone.index == 2
    np.testing.assert_array_equal(alone.adc, first[2])
    other = next(catseye.simulate(scenario, frames=1, seed=8, engine=engine))
    assert np.any(other.adc != first[0])
    assert len(catseye.simulate(scenario, frames=range(5, 7), engine=engine)) == 2
    for bad in (0, [-1], "ab"):
        with pytest.raises((catseye.BadInput, TypeError, OverflowError, ValueError)):
            catseye.simulate(scenario, frames=bad, engine=engine)
    with pytest.raises(catseye.BadInput, match="radar = rear"):
        catseye.simulate(scenario, radar="rear", engine=engine)


def test_a_frame_without_noise_processes_to_itself(scenario, radar, engine):
    frame = next(catseye.simulate(scenario, engine=engine))
    found = catseye.process(frame.adc, radar=radar, engine=engine)
    np.testing.assert_array_equal(found.range_doppler, frame.range_doppler)
    assert found.mask.shape == found.range_doppler.shape and found.mask.dtype == bool and found.mask.any()
    for column in ("range_m", "range_rate_mps", "azimuth_deg", "snr_db"):
        np.testing.assert_array_equal(found.points[column], frame.points[column])
    assert not found.points["object_id"].any()
    # Any memory layout and precision.
    strided = np.asfortranarray(frame.adc.astype(np.complex128))
    np.testing.assert_array_equal(catseye.process(strided, radar=radar, engine=engine).range_doppler, frame.range_doppler)


def test_process_says_what_looks_wrong(scenario, radar, engine):
    frame = next(catseye.simulate(scenario, engine=engine))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        whole = catseye.process(frame.adc, radar=radar, engine=engine)
    # Packets that were lost are zeros; they are filled.
    adc = frame.adc.copy()
    adc[[5, 20], :, :] = 0
    with pytest.warns(UserWarning, match="2 of 32 chirps hold runs of zeros"):
        found = catseye.process(adc, radar=radar, engine=engine)
    strongest = np.argsort(-whole.points["power_dbm"])[0]
    again = np.argsort(-found.points["power_dbm"])[0]
    for column in ("range_m", "range_rate_mps", "azimuth_deg"):
        assert abs(found.points[column][again] - whole.points[column][strongest]) < 0.02
    with pytest.warns(UserWarning, match="opposite sign of phase"):
        catseye.process(frame.adc.conj(), radar=radar, engine=engine)


def test_process_refuses_what_is_no_cube(radar, engine):
    adc = np.zeros(radar.shape, np.complex64)
    with pytest.raises(catseye.BadInput, match="not a cube of this radar"):
        catseye.process(adc[1:], radar=radar, engine=engine)
    adc[0, 0, 0] = np.nan
    with pytest.raises(catseye.BadInput):
        catseye.process(adc, radar=radar, engine=engine)
    with pytest.raises(TypeError):
        catseye.process([1, 2], radar=radar, engine=engine)


def test_f64_engine_gives_wide_arrays(scenario):
    engine = catseye.Engine("cpu", precision="f64")
    frame = next(catseye.simulate(scenario, engine=engine))
    narrow = next(catseye.simulate(scenario, engine="cpu"))
    assert frame.adc.dtype == np.complex128 and frame.range_doppler.dtype == np.float64
    error = np.linalg.norm(frame.adc - narrow.adc) / np.linalg.norm(frame.adc)
    assert 0 < error < 1e-3


def test_own_scene_with_truth_of_the_road(scenario, engine):
    scene = catseye.road_scene('name = "r"\n[[road]]\nname = "a"\nplan = [{ kind = "straight", length_m = 30 }]\nright = [{ width_m = 3 }]\n')
    scene.add_point(position_m=[12, 0, 0.5], rcs_dbsm=20, name="mine")
    frame = next(catseye.simulate(scenario, scene=scene, frames=1, engine=engine))
    assert [b["name"] for b in frame.truth["boxes"]][-1] == "mine"
    assert frame.truth["road"]["roads"][0]["name"] == "a"
    assert any(frame.points["object_id"] == scene.objects[-1]["id"])


def test_frames_remark_on_meshes(scenario, engine):
    scene = catseye.Scene()
    for name, width in [("wall", 0.5), ("sign", 0.2)]:
        scene.add(catseye.reflector("plate", width_m=width, height_m=width), position_m=[15, 0, 1], yaw_deg=180, name=name)
    with pytest.warns(UserWarning, match="sign"):
        frames = catseye.simulate(scenario, scene=scene, frames=1, engine=engine)
    assert any("sign" in line and "wall" in line for line in frames.remarks)
    assert catseye.simulate(scenario, frames=1, engine=engine).remarks == []


def test_arrays_outlive_their_frame(scenario, engine):
    frame = next(catseye.simulate(scenario, engine=engine))
    adc, expected = frame.adc, frame.adc.copy()
    # Always the same array: nothing is copied for each look.
    assert frame.adc is adc and sys.getrefcount(adc) > 2
    del frame
    np.testing.assert_array_equal(adc, expected)


SLOW = """
name = "slow"
radar = "front77"
[scene]
builtin = "w3"
[frames]
count = 100
"""


def test_another_radar_listens_to_a_run(tmp_path, engine):
    """Frames of kept echoes are those of a run that traces, to the bit; another seed changes the noise and not the echoes."""
    text = "name = \"kept\"\nradar = \"demo77\"\n[frames]\ncount = 2\ninterval_s = 0.1\n[[point]]\nposition_m = [14, 2, 1]\nrcs_dbsm = 5\n[output]\nechoes = true\nplots = false\n"
    path = tmp_path / "scenario.toml"
    path.write_text(text)
    program = os.environ.get("CATSEYE_PROGRAM")
    if not program:
        pytest.skip("CATSEYE_PROGRAM names no program that keeps echoes")
    subprocess.run([program, "simulate", str(path), "-o", str(tmp_path / "run"), "--device", "cpu", "--quiet"], check=True)
    scenario = catseye.Scenario(path)
    kept = list(catseye.simulate(scenario, engine=engine, source=tmp_path / "run"))
    whole = list(catseye.simulate(scenario, engine=engine))
    assert len(kept) == len(whole) == 2
    for a, b in zip(kept, whole):
        np.testing.assert_array_equal(a.adc, b.adc)
        assert a.points.tobytes() == b.points.tobytes()
    other = next(catseye.simulate(scenario, engine=engine, source=tmp_path / "run", seed=99))
    assert not np.array_equal(other.adc, kept[0].adc)
    np.testing.assert_array_equal(other.returns["power_dbm"], kept[0].returns["power_dbm"])
    # Fewer frames than the run has are served, more are not.
    assert next(catseye.simulate(scenario, engine=engine, source=tmp_path / "run", frames=[1])).index == 1
    with pytest.raises(catseye.BadInput, match="more frames than the run"):
        catseye.simulate(scenario, engine=engine, source=tmp_path / "run", frames=5)
    with pytest.raises(catseye.BadInput, match="manifest"):
        catseye.simulate(scenario, engine=engine, source=tmp_path)
    moved = catseye.Scenario.parse(text.replace("14, 2, 1", "15, 2, 1"))
    with pytest.raises(catseye.BadInput):
        next(catseye.simulate(moved, engine=engine, source=tmp_path / "run"))


def test_ctrl_c_ends_a_frame_and_the_iterator_goes_on():
    frames = catseye.simulate(catseye.Scenario.parse(SLOW), engine="cpu")
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        for _ in frames:
            pass
    timer.join()
    left = len(frames)
    assert 0 < left <= 100
    assert next(frames).index == 100 - left


def test_bad_scenario_names_its_line(tmp_path):
    with pytest.raises(catseye.BadInput) as e:
        catseye.Scenario.parse('name = "x"\nradar = "demo77"\n[[point]]\nposition_m = [1, 2]\nrcs_dbsm = 1\n')
    assert e.value.line == 4
    with pytest.raises(catseye.BadInput, match="no such file"):
        catseye.simulate(tmp_path / "none.toml")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_forked_child_computes(scenario, engine):
    """Threads of the parent's are not there in a child: it makes its own."""
    expected = next(catseye.simulate(scenario, engine=engine)).adc
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        status = 1
        try:
            signal.alarm(60)
            same = np.array_equal(next(catseye.simulate(scenario, engine=engine)).adc, expected)
            os.write(write, b"1" if same else b"0")
            status = 0
        finally:
            os._exit(status)
    os.close(write)
    answer = os.read(read, 1)
    os.waitpid(child, 0)
    assert answer == b"1"


def test_devices():
    listing = catseye.devices()
    assert listing["auto"] in ("cpu", "gpu") and listing["cpu_threads"] >= 1
    for adapter in listing["adapters"]:
        assert adapter["self_test"]


def test_engine_facts_and_pickle():
    import pickle

    engine = catseye.Engine("cpu", precision="f64")
    assert (engine.kind, engine.precision, engine.adapter) == ("cpu", "f64", "cpu")
    again = pickle.loads(pickle.dumps(engine))
    assert again.precision == "f64" and again.description == engine.description

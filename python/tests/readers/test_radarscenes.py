"""RadarScenes sequences, read by h5py and, where it is installed, by the data set's own package `radar_scenes`."""

import json

import h5py
import numpy as np
import pytest
from sweep_truth import column, rate_over_ground, sensor_to_vehicle, vehicle_to_world

RADAR = "timestamp sensor_id range_sc azimuth_sc rcs vr vr_compensated x_cc y_cc x_seq y_seq uuid track_id label_id".split()
ODOMETRY = "timestamp x_seq y_seq yaw_seq vx yaw_rate".split()


@pytest.fixture(scope="module")
def tables(samples):
    with h5py.File(samples / "radarscenes/sequence_1/radar_data.h5") as f:
        assert sorted(f) == ["odometry", "radar_data"]
        return f["radar_data"][:], f["odometry"][:]


def test_types(tables):
    radar, odometry = tables
    assert list(radar.dtype.names) == RADAR and list(odometry.dtype.names) == ODOMETRY
    assert radar.dtype["timestamp"] == odometry.dtype["timestamp"] == np.int64
    assert radar.dtype["sensor_id"] == radar.dtype["label_id"] == np.uint8
    assert radar.dtype["uuid"] == radar.dtype["track_id"] == np.dtype("S32")
    floats = RADAR[2:11] + ODOMETRY[1:]
    assert all((radar if n in RADAR else odometry).dtype[n] == np.float32 for n in floats)


def test_values_signs_and_frames(tables, expected):
    radar, odometry = tables
    assert len(radar) == sum(len(s["points"]) for s in expected)
    at = 0
    for sweep in expected:
        n = len(sweep["points"])
        rows, at = radar[at : at + n], at + n
        if n == 0:
            continue
        assert set(rows["sensor_id"]) == {1 if sweep["radar"] == "front" else 2}
        for name, key in [("range_sc", "range_m"), ("azimuth_sc", "azimuth_rad"), ("rcs", "rcs_dbsm"), ("vr", "range_rate_mps")]:
            np.testing.assert_allclose(rows[name], column(sweep, key), rtol=1e-6)
        np.testing.assert_allclose(rows["vr_compensated"], rate_over_ground(sweep), rtol=1e-5, atol=2e-5)
        car = sensor_to_vehicle(sweep)(column(sweep, "position_m"))
        world = vehicle_to_world(sweep)(car)
        for name, values in [("x_cc", car[:, 0]), ("y_cc", car[:, 1]), ("x_seq", world[:, 0]), ("y_seq", world[:, 1])]:
            np.testing.assert_allclose(rows[name], values, rtol=1e-6, atol=1e-5)
        # Receding is positive: the rail ahead of the front radar comes closer.
        if sweep["radar"] == "front":
            assert rows["vr"][2] < -5
        assert list(rows["label_id"]) == [0, 2, 11, 11, 11], "car, truck, rail, nothing, ghost"
        tracks = [int(t, 16) if t else None for t in rows["track_id"]]
        assert tracks == [7, 8, None, None, None]
    assert len(set(radar["uuid"])) == len(radar)


def test_odometry(tables, expected):
    _, odometry = tables
    assert len(odometry) == 2
    for row, sweep in zip(odometry, expected[::2], strict=True):
        pose = vehicle_to_world(sweep)
        ahead = pose.rotation[:, 0]
        assert row["timestamp"] * 1000 == sweep["time_ns"]
        want = [*pose.position[:2], np.arctan2(ahead[1], ahead[0]), ahead @ sweep["vehicle_velocity_mps"]]
        np.testing.assert_allclose([row[n] for n in ODOMETRY[1:5]], want, rtol=1e-6)
        assert row["yaw_rate"] == pytest.approx(sweep["yaw_rate_rad_per_s"])


def test_scenes(samples, tables, expected):
    radar, odometry = tables
    scenes = json.loads((samples / "radarscenes/sequence_1/scenes.json").read_text())
    times = [int(t) for t in scenes["scenes"]]
    assert times == sorted(times) and len(set(times)) == len(expected)
    assert (scenes["first_timestamp"], scenes["last_timestamp"]) == (times[0], times[-1])
    for time, (sweep, scene) in zip(times, zip(expected, scenes["scenes"].values(), strict=True)):
        assert abs(time * 1000 - sweep["time_ns"]) <= 1000
        rows = radar[slice(*scene["radar_indices"])]
        assert len(rows) == len(sweep["points"]) and set(rows["timestamp"]) <= {time}
        assert odometry[scene["odometry_index"]]["timestamp"] == scene["odometry_timestamp"]
    sensors = json.loads((samples / "radarscenes/sensors.json").read_text())
    mount = sensor_to_vehicle(expected[1])
    ahead = mount.rotation[:, 0]
    assert sensors["radar_2"]["x"] == pytest.approx(mount.position[0])
    assert sensors["radar_2"]["yaw"] == pytest.approx(np.arctan2(ahead[1], ahead[0]))


def test_read_by_the_tools_of_the_data_set(samples, expected):
    sequence_module = pytest.importorskip("radar_scenes.sequence")
    from radar_scenes.coordinate_transformation import transform_detections_sequence_to_car
    from radar_scenes.labels import Label
    from radar_scenes.sensors import get_mounting

    root = samples / "radarscenes"
    sequence = sequence_module.Sequence.from_json(str(root / "sequence_1/scenes.json"))
    scenes = list(sequence.scenes())
    assert [len(s.radar_data) for s in scenes] == [len(s["points"]) for s in expected]
    assert [s.sensor_id for s in sequence.scenes(sensor_id=2)] == [2, 2]
    for scene in scenes[:3]:
        data = scene.radar_data
        x, y = transform_detections_sequence_to_car(data["x_seq"], data["y_seq"], scene.odometry_data)
        np.testing.assert_allclose(x, data["x_cc"], atol=1e-4)
        np.testing.assert_allclose(y, data["y_cc"], atol=1e-4)
        # The place from mounting, range and azimuth, as in the paper: level but for the mounting's pitch and roll.
        mount = get_mounting(scene.sensor_id, str(root / "sensors.json"))
        angle = data["azimuth_sc"] + mount["yaw"]
        np.testing.assert_allclose(mount["x"] + data["range_sc"] * np.cos(angle), data["x_cc"], atol=0.3)
        np.testing.assert_allclose(mount["y"] + data["range_sc"] * np.sin(angle), data["y_cc"], atol=0.3)
        assert Label(scene.radar_data["label_id"][1]) is Label.TRUCK
    names = sequence_module.get_training_sequences(str(root / "sequences.json"))
    assert names == ["sequence_1"]

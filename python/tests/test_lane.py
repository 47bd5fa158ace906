"""Lanes: methods on scenarios, and estimators on anybody's points."""

import json
from pathlib import Path

import numpy as np
import pytest

import catseye

ROOT = Path(__file__).resolve().parents[2]


def marked_lane(offset_m=0.2, spacing_m=2.0, speed_mps=10.0):
    """Points of two rows of markers 3 m apart, seen from the origin."""
    x = np.arange(6.0, 30.0, spacing_m)
    place = np.concatenate([np.stack([x, np.full_like(x, y - offset_m)], axis=1) for y in (-1.5, 1.5)])
    distance = np.hypot(place[:, 0], place[:, 1])
    azimuth = np.arctan2(place[:, 1], place[:, 0])
    return {
        "range_m": distance,
        "azimuth_deg": np.degrees(azimuth),
        "range_rate_mps": -speed_mps * np.cos(azimuth),
        "range_std_m": np.full_like(distance, 0.03),
        "range_rate_std_mps": np.full_like(distance, 0.02),
        "azimuth_std_deg": np.full_like(distance, 0.2),
    }


def test_methods():
    assert catseye.lane_methods() == [
        "uwb",
        "markers",
        "range-doppler",
        "signature",
        "road-shape",
        "hd-map",
        "camera-fusion",
    ]


def test_estimator_on_own_points():
    method = catseye.LaneEstimator("markers", {"spacing_m": [2.0], "nearest_m": 2.0})
    lane = method.estimate(0.0, points=marked_lane(), speed_mps=10.0)
    assert lane["no_lane"] is None
    assert len(lane["lines"]) == 2
    assert lane["offset_m"]["value"] == pytest.approx(0.2, abs=0.05)
    assert lane["width_m"]["value"] == pytest.approx(3.0, abs=0.1)
    assert abs(lane["heading_rad"]["value"]) < 0.02
    points = np.asarray(lane["lines"][1]["points_m"])
    assert points.shape[1] == 2 and abs(points[:, 1] - 1.3).max() < 0.1
    # A structured array does as well, and the points of a frame have more columns.
    columns = marked_lane()
    table = np.zeros(len(columns["range_m"]), dtype=[(n, "f8") for n in columns] + [("class", "U8")])
    for name, values in columns.items():
        table[name] = values
    again = catseye.LaneEstimator("markers", {"spacing_m": [2.0], "nearest_m": 2.0})
    assert again.estimate(0.0, points=table, speed_mps=10.0)["offset_m"] == lane["offset_m"]


@pytest.mark.parametrize("method", ["markers", "range-doppler", "road-shape", "camera-fusion"])
def test_nothing_is_invented(method):
    estimator = catseye.LaneEstimator(method)
    empty = {"range_m": [], "azimuth_deg": [], "range_rate_mps": []}
    broken = {"range_m": [np.nan, 10.0], "azimuth_deg": [0.0, np.nan], "range_rate_mps": [np.inf, 0.0]}
    one = {"range_m": [10.0], "azimuth_deg": [5.0], "range_rate_mps": [-9.96]}
    for time_s, points in enumerate([empty, broken, one]):
        lane = estimator.estimate(float(time_s), points=points, speed_mps=10.0)
        assert lane["lines"] == [] and lane["no_lane"], (method, points)


def test_bad_input():
    with pytest.raises(catseye.BadInput, match="is not a lane method"):
        catseye.LaneEstimator("marker")
    with pytest.raises(catseye.BadInput, match="spacing"):
        catseye.LaneEstimator("markers", {"spacing": [2.0]})
    with pytest.raises(catseye.BadInput, match="uwb"):
        catseye.LaneEstimator("uwb")
    with pytest.raises(catseye.BadInput, match="points.range_rate_mps"):
        catseye.LaneEstimator("markers").estimate(0.0, points={"range_m": [1.0], "azimuth_deg": [0.0]})
    with pytest.raises(catseye.BadInput, match="differ in length"):
        wrong = {"range_m": [1.0], "azimuth_deg": [0.0, 1.0], "range_rate_mps": [0.0]}
        catseye.LaneEstimator("markers").estimate(0.0, points=wrong)


def test_a_run(tmp_path):
    (tmp_path / "road.toml").write_text((ROOT / "scenes/road/road_lane_3m.toml").read_text())
    radar = (ROOT / "scenes/presets/feng77.toml").read_text()
    radar = radar.replace("chirps = 1024", "chirps = 128").replace("doppler_fft = 2048", "doppler_fft = 128")
    (tmp_path / "radar.toml").write_text(radar)
    (tmp_path / "scenario.toml").write_text(
        'name = "small"\nradar = "radar.toml"\n[scene]\nroad = "road.toml"\n'
        "[ego]\nspeed_mps = 10\non_road = { lane = 1, s_m = 10 }\n"
        "[frames]\ncount = 1\n[trace]\nbounces = 1\nrays = 2000\n[lane.markers]\nlevels = false\n"
    )
    seen = []
    out = tmp_path / "out"
    report = catseye.lane(
        "markers", tmp_path / "scenario.toml", out, engine="cpu", progress=lambda done, n: seen.append((done, n))
    )
    assert report["method"] == "markers" and any(r["quantity"] == "F1 within 0.3 m" for r in report["rows"])
    lines = (out / "estimates.jsonl").read_text().splitlines()
    assert len(lines) == 1 and "estimate" in json.loads(lines[0])
    with pytest.raises(catseye.BadInput):
        catseye.lane("markers", tmp_path / "scenario.toml", out, engine="cpu")

"""nuScenes point clouds, read by `RadarPointCloud` of nuscenes-devkit."""

import json

import numpy as np
import pytest
from sweep_truth import column, rate_over_ground, rotation, sensor_to_vehicle, vehicle_to_world
from nuscenes.utils.data_classes import RadarPointCloud

FIELDS = (
    "x y z dyn_prop id rcs vx vy vx_comp vy_comp is_quality_valid ambig_state x_rms y_rms invalid_state pdh0 vx_rms vy_rms"
).split()


def load(samples, sweep):
    name = f"pcd/{sweep['radar']}/frame_{sweep['frame']:06}.pcd"
    return RadarPointCloud.from_file(str(samples / name)).points


def test_no_point_is_filtered_out(samples, expected):
    assert [load(samples, s).shape for s in expected] == [(18, len(s["points"])) for s in expected]


def test_values_and_signs(samples, expected):
    for sweep in expected[:3]:
        row = dict(zip(FIELDS, load(samples, sweep)))
        position = column(sweep, "position_m")
        np.testing.assert_allclose(np.stack([row["x"], row["y"], row["z"]], 1), position, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(row["rcs"], column(sweep, "rcs_dbsm"), rtol=1e-6)
        np.testing.assert_array_equal(row["id"], range(len(position)))
        azimuth = np.arctan2(position[:, 1], position[:, 0])
        rate = column(sweep, "range_rate_mps")
        np.testing.assert_allclose(row["vx"], rate * np.cos(azimuth), rtol=1e-5, atol=1e-5)
        np.testing.assert_allclose(row["vy"], rate * np.sin(azimuth), rtol=1e-5, atol=1e-5)
        ground = rate_over_ground(sweep)
        np.testing.assert_allclose(row["vx_comp"], ground * np.cos(azimuth), rtol=1e-5, atol=1e-5)
        np.testing.assert_allclose(row["vy_comp"], ground * np.sin(azimuth), rtol=1e-5, atol=1e-5)
        # The rail stands still and comes closer to the front radar; the truck drives towards it.
        rail, truck = 2, 1
        assert np.hypot(row["vx_comp"][rail], row["vy_comp"][rail]) < 1e-4
        assert row["dyn_prop"][rail] == 1 and row["dyn_prop"][truck] == 2
        assert row["vx_comp"][truck] * row["x"][truck] + row["vy_comp"][truck] * row["y"][truck] < 0
        assert row["dyn_prop"][3] == 4, "no object, so nothing is known of its motion"
        np.testing.assert_array_equal(row["pdh0"], np.where(column(sweep, "ghost"), 7, 1))
        assert np.all(row["is_quality_valid"] == 1)
    front = dict(zip(FIELDS, load(samples, expected[0])))
    assert front["vx"][2] < -5


def test_codes_of_deviations(samples, expected):
    """x_rms and y_rms are codes whose bounds hold the deviation; 31 where it is not known."""
    bound = [0.005, 0.006, 0.008, 0.011, 0.014, 0.018, 0.023, 0.029, 0.038, 0.049, 0.063, 0.081, 0.105, 0.135, 0.174]
    bound += [0.224, 0.288, 0.371, 0.478, 0.616, 0.794, 1.023, 1.317, 1.697, 2.187, 2.817, 3.63, 4.676, 6.025, 7.762, 10]
    sweep = expected[0]
    row = dict(zip(FIELDS, load(samples, sweep)))
    for i, p in enumerate(sweep["points"]):
        if p["azimuth_std_rad"] is None:
            assert row["x_rms"][i] == row["y_rms"][i] == 31
            continue
        sa, ca = np.sin(p["azimuth_rad"]), np.cos(p["azimuth_rad"])
        ce = np.cos(p["elevation_rad"])
        for name, by_range, by_azimuth in [("x", ce * ca, -ce * sa), ("y", ce * sa, ce * ca)]:
            std = np.hypot(by_range * p["range_std_m"], by_azimuth * p["range_m"] * p["azimuth_std_rad"])
            code = int(row[f"{name}_rms"][i])
            assert std < bound[code] and (code == 0 or std >= bound[code - 1])
        code = int(row["vx_rms"][i])
        assert bound[code - 1] <= p["range_rate_std_mps"] < bound[code]


def test_poses_of_the_manifest(samples, expected):
    manifest = json.loads((samples / "pcd/manifest.json").read_text())
    for record, sweep in zip(manifest["sweeps"], expected, strict=True):
        assert record["timestamp"] * 1000 == sweep["time_ns"] and record["channel"] == sweep["radar"]
        for key, pose in [("calibrated_sensor", sensor_to_vehicle(sweep)), ("ego_pose", vehicle_to_world(sweep))]:
            w, x, y, z = record[key]["rotation"]
            np.testing.assert_allclose(rotation([x, y, z, w]), pose.rotation, atol=1e-12)
            np.testing.assert_allclose(record[key]["translation"], pose.position, atol=1e-12)


def test_a_cloud_that_is_cut_off_is_refused(samples, expected, tmp_path):
    whole = (samples / "pcd/front/frame_000000.pcd").read_bytes()
    (tmp_path / "short.pcd").write_bytes(whole[:-10])
    with pytest.raises(AssertionError):
        RadarPointCloud.from_file(str(tmp_path / "short.pcd"))

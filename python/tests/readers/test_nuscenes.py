"""Whole nuScenes data sets, opened by `NuScenes` of nuscenes-devkit, against truth.json."""

import json

import numpy as np
import pytest
import shapely
from sweep_truth import Pose, rotation, sensor_to_vehicle, vehicle_to_world
from nuscenes.nuscenes import NuScenes
from nuscenes.utils.data_classes import LidarPointCloud, RadarPointCloud
from nuscenes.utils.geometry_utils import points_in_box

CHANNEL = "RADAR_DEMO77"
CATEGORIES = {
    "car": "vehicle.car",
    "truck": "vehicle.truck",
    "cyclist": "vehicle.bicycle",
    "pedestrian": "human.pedestrian.adult",
}
VERSION = "v1.0-catseye"


@pytest.fixture(scope="module")
def run(exported):
    folder = exported.export("nuscenes", "--sequence", "scene-0007")
    offset = np.array(json.loads((folder / "manifest.json").read_text())["world_offset_m"])
    return NuScenes(version=VERSION, dataroot=str(folder), verbose=False), offset


@pytest.fixture(scope="module")
def made(samples):
    folder = samples / "nuscenes"
    offset = np.array(json.loads((folder / "manifest.json").read_text())["world_offset_m"])
    return NuScenes(version=VERSION, dataroot=str(folder), verbose=False), offset


def in_time(nusc, channel=CHANNEL):
    """The records of a channel in the order of its links."""
    data = [r for r in nusc.sample_data if r["channel"] == channel]
    (record,) = [r for r in data if r["prev"] == ""]
    found = [record]
    while record["next"]:
        record = nusc.get("sample_data", record["next"])
        assert record["prev"] == found[-1]["token"]
        found.append(record)
    assert len(found) == len(data)
    return found


def road_users(truth):
    return {a["name"]: a for a in truth["actors"] if a["class"] in CATEGORIES}


def near(box, actors, centre):
    """The actor whose centre, as `centre` gives it, lies nearest to a box."""
    return min(actors, key=lambda a: np.linalg.norm(centre(a) - box.center))


def test_scene_and_samples(run, capsys):
    nusc, _ = run
    nusc.list_scenes()
    assert "scene-0007" in capsys.readouterr().out
    (scene,) = nusc.scene
    assert [s["timestamp"] for s in nusc.sample] == [0, 500_000, 700_000]
    assert scene["nbr_samples"] == 3
    assert scene["first_sample_token"] == nusc.sample[0]["token"]
    assert scene["last_sample_token"] == nusc.sample[-1]["token"]
    sample = nusc.sample[0]
    times = [sample["timestamp"]]
    while sample["next"]:
        sample = nusc.get("sample", sample["next"])
        times.append(sample["timestamp"])
    assert times == [0, 500_000, 700_000] and sample["token"] == scene["last_sample_token"]
    nusc.list_sample(sample["token"])
    tokens = [r["token"] for name in nusc.table_names for r in getattr(nusc, name) if name != "visibility"]
    assert len(set(tokens)) == len(tokens) and all(len(t) == 32 for t in tokens)


def test_boxes_lie_where_truth_says(exported, run):
    """In the sensor's axes, where no offset of the world matters, and in the world less its offset."""
    nusc, offset = run
    records = in_time(nusc)
    assert [r["timestamp"] for r in records] == [100_000 * i for i in range(8)]
    for record, truth in zip(records, exported.frames, strict=True):
        radar = Pose(truth["radar"])
        actors = list(road_users(truth).values())
        path, boxes, _ = nusc.get_sample_data(record["token"])
        assert len(boxes) == len(actors) >= 4
        for box in boxes:
            actor = near(box, actors, lambda a: radar.back(a["centre_m"]))
            key = record["is_key_frame"]
            # Between key frames the reader goes straight from one to the other, and so do the objects; but limbs and wheels
            # move the middle of the box around them.
            tolerance = 1e-6 if key else 2e-2 if actor["class"] == "car" else 0.15
            np.testing.assert_allclose(box.center, radar.back(actor["centre_m"]), atol=tolerance)
            length, width, height = actor["size_m"]
            np.testing.assert_allclose(box.wlh, [width, length, height], atol=1e-9 if key else 0.3)
            assert box.name == CATEGORIES[actor["class"]]
            turn = radar.rotation.T @ rotation(actor["rotation_xyzw"])
            np.testing.assert_allclose(box.orientation.rotation_matrix, turn, atol=1e-6 if key else 1e-2)
        for box in nusc.get_boxes(record["token"]) if record["is_key_frame"] else []:
            actor = near(box, actors, lambda a: a["centre_m"] + offset)
            np.testing.assert_allclose(box.center - offset, actor["centre_m"], atol=1e-9)


def test_objects_over_time(exported, run):
    nusc, offset = run
    first, last = road_users(exported.frames[0]), road_users(exported.frames[7])
    assert len(nusc.instance) == len(first)
    moving = 0
    for instance in nusc.instance:
        annotation = nusc.get("sample_annotation", instance["first_annotation_token"])
        at = np.array(annotation["translation"]) - offset
        name = min(first, key=lambda n: np.linalg.norm(at - first[n]["centre_m"]))
        end = nusc.get("sample_annotation", instance["last_annotation_token"])
        np.testing.assert_allclose(np.array(end["translation"]) - offset, last[name]["centre_m"], atol=1e-9)
        middle = nusc.get("sample_annotation", annotation["next"])
        velocity = (np.array(last[name]["centre_m"]) - first[name]["centre_m"]) / 0.7
        np.testing.assert_allclose(nusc.box_velocity(middle["token"]), velocity, atol=1e-6)
        attributes = {nusc.get("attribute", t)["name"] for t in annotation["attribute_tokens"]}
        speed = np.linalg.norm(first[name]["velocity_mps"])
        moving += speed > 0
        expected = {
            "car": "vehicle.moving" if speed > 0 else "vehicle.stopped",
            "pedestrian": "pedestrian.moving" if speed > 0 else "pedestrian.standing",
            "cyclist": "cycle.with_rider",
        }
        assert attributes == {expected[first[name]["class"]]}
        assert nusc.get("visibility", annotation["visibility_token"])["level"].startswith("v")
    assert moving >= 3


def test_points_in_boxes(run):
    """num_radar_pts is what the reader's own count gives."""
    nusc, _ = run
    total = 0
    for sample in nusc.sample:
        path, boxes, _ = nusc.get_sample_data(sample["data"][CHANNEL])
        cloud = RadarPointCloud.from_file(path)
        for box in boxes:
            count = int(points_in_box(box, cloud.points[:3]).sum())
            assert count == nusc.get("sample_annotation", box.token)["num_radar_pts"]
            total += count
    assert total > 0


def test_the_lidar(exported, run):
    """Its points in its own axes, where the tables put them in the world, and num_lidar_pts as the reader counts."""
    nusc, offset = run
    records = in_time(nusc, "LIDAR_TOP")
    assert len(records) == len(exported.frames)
    assert [r["sensor_modality"] for r in records] == ["lidar"] * len(records)
    total = 0
    for number, (record, truth) in enumerate(zip(records, exported.frames, strict=True)):
        path, boxes, _ = nusc.get_sample_data(record["token"])
        cloud = LidarPointCloud.from_file(path).points
        rows = exported.points(number, "lidar")
        assert cloud.shape == (4, len(rows)) and len(rows) > 1000
        mounting = nusc.get("calibrated_sensor", record["calibrated_sensor_token"])
        np.testing.assert_allclose(mounting["translation"], [1.1, 0.2, 1.7], atol=1e-9)
        w, x, y, z = mounting["rotation"]
        vehicle = cloud[:3].T @ rotation([x, y, z, w]).T + mounting["translation"]
        np.testing.assert_allclose(vehicle, [[float(r[k]) for k in ("x_m", "y_m", "z_m")] for r in rows], atol=2e-5)
        cosine = np.cos(np.radians([float(r["incidence_deg"]) for r in rows]))
        np.testing.assert_allclose(cloud[3], 255 * cosine, atol=1e-3)
        raw = np.fromfile(path, "<f4").reshape(-1, 5)
        np.testing.assert_array_equal(raw[:, 4], [int(r["channel"]) for r in rows])
        # The file says the same pose in the world as truth.json.
        lidar = Pose(truth["lidar"])
        ego = Pose(truth["ego"])
        np.testing.assert_allclose(ego(np.array(mounting["translation"])), lidar.position, atol=1e-9)
        if record["is_key_frame"]:
            actors = list(road_users(truth).values())
            for box in boxes:
                told = nusc.get("sample_annotation", box.token)["num_lidar_pts"]
                # Surfaces lie on the faces of their box, where single precision decides either way.
                least, most = (int(points_in_box(box, cloud[:3], 1 + e).sum()) for e in (-1e-4, 1e-4))
                assert least <= told <= most
                # All that is seen of the object itself lies in its box.
                actor = near(box, actors, lambda a: lidar.back(a["centre_m"]))
                own = sum(int(r["object_id"]) in actor["parts"] for r in rows)
                assert own <= told
                total += own
    assert total > 50


def test_sweeps_are_joined(exported, run):
    """`from_file_multisweep` brings earlier points into the last radar's axes by the poses of the tables."""
    nusc, _ = run
    sample = nusc.sample[1]
    cloud, times = RadarPointCloud.from_file_multisweep(nusc, sample, CHANNEL, CHANNEL, nsweeps=4, min_distance=0)
    last = Pose(exported.frames[5]["radar"])
    expected, lags = [], []
    for back in range(4):
        radar = Pose(exported.frames[5 - back]["radar"])
        points = np.array([[float(p[k]) for k in ("x_m", "y_m", "z_m")] for p in exported.points(5 - back)])
        expected.append(last.back(radar(points)))
        lags += [0.1 * back] * len(points)
    np.testing.assert_allclose(cloud.points[:3].T, np.concatenate(expected), atol=1e-4)
    np.testing.assert_allclose(times[0], lags, atol=1e-6)
    kinds = [r["filename"].split("/")[0] for r in in_time(nusc)]
    assert kinds == ["samples", *["sweeps"] * 4, "samples", "sweeps", "samples"]


def test_the_map_shows_the_lanes(exported, run):
    nusc, offset = run
    mask = nusc.map[0]["mask"]
    lanes = []
    for truth in exported.frames:
        for lane in truth["lanes"]:
            if lane["kind"] not in ("sidewalk", "median", "verge"):
                edge = [p[:2] for p in lane["left_m"]] + [p[:2] for p in reversed(lane["right_m"])]
                lanes.append(shapely.Polygon(edge))
    paved = shapely.unary_union(lanes)
    # Places of the picture itself: the reader rounds to them.
    rng = np.random.default_rng(1)
    places = rng.integers([0, 0], [1200, 350], (4000, 2)) / 10
    inside = shapely.contains_xy(paved, *(places - offset[:2]).T)
    clear = shapely.distance(paved.boundary, shapely.points(places - offset[:2])) > 1e-6
    assert 500 < inside.sum() < 3500
    np.testing.assert_array_equal(mask.is_on_mask(*places.T)[clear], inside[clear])
    for pose in nusc.ego_pose:
        assert mask.is_on_mask(*pose["translation"][:2]).all()


def test_two_radars_and_their_mountings(made, expected):
    nusc, offset = made
    kinds = {"LIDAR_TOP": "lidar", "RADAR_FRONT": "radar", "RADAR_LEFT": "radar"}
    assert {s["channel"]: s["modality"] for s in nusc.sensor} == kinds
    for sweep in expected:
        channel = f"RADAR_{sweep['radar'].upper()}"
        record = in_time(nusc, channel)[sweep["frame"]]
        assert record["timestamp"] * 1000 == sweep["time_ns"]
        mounting = nusc.get("calibrated_sensor", record["calibrated_sensor_token"])
        np.testing.assert_allclose(mounting["translation"], sensor_to_vehicle(sweep).position, atol=1e-9)
        ego = nusc.get("ego_pose", record["ego_pose_token"])
        np.testing.assert_allclose(np.array(ego["translation"]) - offset, vehicle_to_world(sweep).position, atol=1e-9)
        w, x, y, z = ego["rotation"]
        np.testing.assert_allclose(rotation([x, y, z, w]), vehicle_to_world(sweep).rotation, atol=1e-12)
        path, boxes, _ = nusc.get_sample_data(record["token"])
        # The rail is no road user.
        assert [b.name for b in boxes] == ["vehicle.car", "vehicle.truck"]
        for box, truth in zip(boxes, sweep["boxes"]):
            place = sensor_to_vehicle(sweep).back(vehicle_to_world(sweep).back(truth["centre_m"]))
            np.testing.assert_allclose(box.center, place, atol=1e-6)
        assert RadarPointCloud.from_file(path).points.shape == (18, len(sweep["points"]))
    # The truth of both radars: the point on the car's rear is counted for each of them, the car's mirror image for none.
    counts = [a["num_radar_pts"] for a in nusc.sample_annotation if a["category_name"] == "vehicle.car"]
    assert counts == [2, 1]

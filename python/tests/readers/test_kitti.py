"""KITTI's folders with View-of-Delft's radar points: labels back into the world, and View-of-Delft's own loader."""

import json
import sys
import types

import numpy as np
import pytest
from sweep_truth import Pose, column, rate_over_ground, rotation, sensor_to_vehicle, vehicle_to_world

# Its package imports a viewer that needs a browser; nothing here draws.
sys.modules.setdefault("k3d", types.ModuleType("k3d"))
from vod.configuration import KittiLocations  # noqa: E402
from vod.frame import FrameDataLoader, FrameLabels, FrameTransformMatrix  # noqa: E402

TYPES = {"car": "Car", "cyclist": "Cyclist", "pedestrian": "Pedestrian", "truck": "Truck"}
WIDTH, HEIGHT = 1280, 720


class Frame:
    """One frame, read as the format is described."""

    def __init__(self, folder, number):
        self.points = np.fromfile(folder / f"training/velodyne/{number:06}.bin", "<f4").reshape(-1, 7)
        lines = (folder / f"training/calib/{number:06}.txt").read_text().splitlines()
        calib = {k: np.array(v.split(), float) for k, v in (line.split(":") for line in lines)}
        assert list(calib) == ["P0", "P1", "P2", "P3", "R0_rect", "Tr_velo_to_cam", "Tr_imu_to_velo"]
        self.projection = calib["P2"].reshape(3, 4)
        assert np.array_equal(calib["R0_rect"].reshape(3, 3), np.eye(3))
        self.radar_to_camera = np.vstack([calib["Tr_velo_to_cam"].reshape(3, 4), [0, 0, 0, 1]])
        self.vehicle_to_radar = np.vstack([calib["Tr_imu_to_velo"].reshape(3, 4), [0, 0, 0, 1]])
        poses = [json.loads(line) for line in (folder / f"training/pose/{number:06}.json").read_text().splitlines()]
        assert [list(p) for p in poses] == [["odomToCamera"], ["mapToCamera"], ["UTMToCamera"]]
        self.odometry, self.to_world, _ = [np.array(next(iter(p.values()))).reshape(4, 4) for p in poses]
        self.labels = []
        for line in (folder / f"training/label_2/{number:06}.txt").read_text().splitlines():
            kind, *numbers = line.split(" ")
            assert len(numbers) == 14
            self.labels.append((kind, np.array(numbers, float)))

    def box(self, numbers):
        """Corners of a label in the world, from its lower middle, size and rotation_y."""
        height, width, length = numbers[7:10]
        turn = np.array(
            [
                [np.cos(numbers[13]), 0, np.sin(numbers[13])],
                [0, 1, 0],
                [-np.sin(numbers[13]), 0, np.cos(numbers[13])],
            ]
        )
        corners = [
            [x * length / 2, y, z * width / 2] for x in (1, -1) for y in (0, -height) for z in (1, -1)
        ]
        camera = np.array(corners) @ turn.T + numbers[10:13]
        return camera @ self.to_world[:3, :3].T + self.to_world[:3, 3]


def true_corners(box):
    x, y, z = np.array(box["size_m"]) / 2
    corners = np.array([[i * x, j * y, k * z] for i in (1, -1) for j in (1, -1) for k in (1, -1)])
    return corners @ rotation(box["rotation_xyzw"]).T + box["centre_m"]


def same_places(a, b):
    """Largest distance from a corner of one box to the nearest corner of the other."""
    return np.linalg.norm(a[:, None] - b[None], axis=2).min(axis=1).max()


@pytest.fixture(scope="module")
def both(exported):
    """The folders of radar and lidar beside each other."""
    return exported.export("kitti")


@pytest.fixture(scope="module")
def run(both):
    return both / "demo77"


def test_labels_go_back_to_the_world(exported, run):
    count = 0
    for number, truth in enumerate(exported.frames):
        frame = Frame(run, number)
        actors = [a for a in truth["actors"] if a["class"] in TYPES]
        for kind, numbers in frame.labels:
            corners = frame.box(numbers)
            actor = min(actors, key=lambda a: np.linalg.norm(corners.mean(axis=0) - a["centre_m"]))
            assert same_places(corners, true_corners(actor)) < 1e-3
            assert kind == TYPES[actor["class"]]
            # The first corners lie at the object's front.
            ahead = corners[:4].mean(axis=0) - corners[4:].mean(axis=0)
            assert ahead @ rotation(actor["rotation_xyzw"])[:, 0] > 0
            assert numbers[1] in (0, 1, 2) and -np.pi <= numbers[2] <= np.pi
            azimuth = np.arctan2(numbers[10], numbers[12])
            assert abs(np.exp(1j * numbers[2]) - np.exp(1j * (numbers[13] - azimuth))) < 1e-5
            count += 1
    assert count >= 3 * len(exported.frames)


def test_boxes_in_the_picture(exported, run):
    """The bounds of the projected corners, and the share of them that the picture cuts off."""
    whole = 0
    for number in range(len(exported.frames)):
        frame = Frame(run, number)
        for _, numbers in frame.labels:
            world = np.hstack([frame.box(numbers), np.ones((8, 1))])
            camera = world @ np.linalg.inv(frame.to_world).T
            if camera[:, 2].min() < 0.2:
                continue
            u, v, w = frame.projection @ camera.T
            low, high = np.array([(u / w).min(), (v / w).min()]), np.array([(u / w).max(), (v / w).max()])
            shown_low = np.clip(low, 0, [WIDTH - 1, HEIGHT - 1])
            shown_high = np.clip(high, 0, [WIDTH - 1, HEIGHT - 1])
            np.testing.assert_allclose(numbers[3:7], [*shown_low, *shown_high], atol=0.02)
            cut = 1 - np.prod(shown_high - shown_low) / np.prod(high - low)
            assert abs(numbers[0] - cut) < 1e-4
            whole += cut == 0
    assert whole > 0


def test_points_and_calibration(samples, expected):
    for sweep in expected:
        frame = Frame(samples / "kitti" / sweep["radar"], sweep["frame"])
        points = frame.points
        assert points.shape == (len(sweep["points"]), 7)
        if len(points):
            np.testing.assert_allclose(points[:, :3], column(sweep, "position_m"), rtol=1e-6, atol=1e-6)
            np.testing.assert_allclose(points[:, 3], column(sweep, "rcs_dbsm"), rtol=1e-6)
            np.testing.assert_allclose(points[:, 4], column(sweep, "range_rate_mps"), rtol=1e-5, atol=1e-5)
            np.testing.assert_allclose(points[:, 5], rate_over_ground(sweep), rtol=1e-5, atol=1e-5)
            assert np.all(points[:, 6] == 0)
        # A point of the radar, by camera and pose and by the truth; and from the vehicle to the radar.
        place = np.array([12.0, -3.0, 1.5])
        world = frame.to_world @ frame.radar_to_camera @ [*place, 1]
        np.testing.assert_allclose(world[:3], vehicle_to_world(sweep)(sensor_to_vehicle(sweep)(place)), atol=1e-9)
        vehicle = sensor_to_vehicle(sweep)(place)
        np.testing.assert_allclose((frame.vehicle_to_radar @ [*vehicle, 1])[:3], place, atol=1e-9)
        start = vehicle_to_world(expected[0])
        np.testing.assert_allclose((frame.odometry @ frame.radar_to_camera @ [*place, 1])[:3], start.back(world[:3]), atol=1e-9)
        # Straight ahead of the camera lies the picture's middle.
        u, v, w = frame.projection @ [0, 0, 30, 1]
        assert (u / w, v / w) == (WIDTH / 2, HEIGHT / 2)
        for kind, numbers in frame.labels:
            truth = {"Car": sweep["boxes"][0], "Truck": sweep["boxes"][1]}[kind]
            assert same_places(frame.box(numbers), true_corners(truth)) < 1e-3
    front = Frame(samples / "kitti/front", 0)
    assert [kind for kind, _ in front.labels] == ["Car", "Truck"]
    splits = {p.stem: p.read_text().split() for p in (samples / "kitti/left/ImageSets").iterdir()}
    assert splits == {"train": ["000000", "000001"], "val": [], "trainval": ["000000", "000001"], "test": []}


def test_the_lidar_of_samples(samples, expected):
    """x, y, z and a reflectance, and a calibration that puts the points where the truth says."""
    for sweep in expected:
        folder = samples / "kitti/lidar/training"
        points = np.fromfile(folder / f"velodyne/{sweep['frame']:06}.bin", "<f4").reshape(-1, 4)
        lidar = sweep["lidar"]
        np.testing.assert_allclose(points[:, :3], lidar["position_m"], rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(points[:, 3], lidar["cos_incidence"], rtol=1e-6)
        lines = (folder / f"calib/{sweep['frame']:06}.txt").read_text().splitlines()
        calib = {k: np.array(v.split(), float) for k, v in (line.split(":") for line in lines)}
        to_camera = np.vstack([calib["Tr_velo_to_cam"].reshape(3, 4), [0, 0, 0, 1]])
        pose = json.loads((folder / f"pose/{sweep['frame']:06}.json").read_text().splitlines()[1])
        to_world = np.array(pose["mapToCamera"]).reshape(4, 4) @ to_camera
        in_vehicle = Pose(lidar["in_vehicle"])
        for place in lidar["position_m"]:
            truth = vehicle_to_world(sweep)(in_vehicle(np.array(place)))
            np.testing.assert_allclose((to_world @ [*place, 1])[:3], truth, atol=1e-9)
            from_vehicle = np.vstack([calib["Tr_imu_to_velo"].reshape(3, 4), [0, 0, 0, 1]])
            np.testing.assert_allclose((from_vehicle @ [*in_vehicle(np.array(place)), 1])[:3], place, atol=1e-9)
    assert (samples / "kitti/lidar/ImageSets/train.txt").read_text().split() == ["000000", "000001"]


def test_the_loader_of_view_of_delft(exported, both, tmp_path):
    """It wants radar and lidar in folders of these names, and a score behind each label."""
    for sensor, folder in (("radar", "demo77"), ("lidar", "lidar")):
        (tmp_path / sensor).symlink_to(both / folder)
    for number, truth in enumerate(exported.frames):
        data = FrameDataLoader(KittiLocations(root_dir=str(tmp_path)), f"{number:06}")
        transforms = FrameTransformMatrix(data)
        rows = exported.points(number)
        np.testing.assert_allclose(data.radar_data[:, 0], [float(r["x_m"]) for r in rows], rtol=1e-5)
        np.testing.assert_allclose(data.radar_data[:, 4], [float(r["range_rate_mps"]) for r in rows], rtol=1e-4, atol=1e-4)
        radar = Pose(truth["radar"])
        points = np.hstack([data.radar_data[:, :3], np.ones((len(rows), 1))])
        world = points @ (transforms.t_map_camera @ transforms.t_camera_radar).T
        np.testing.assert_allclose(world[:, :3], radar(data.radar_data[:, :3]), atol=1e-4)
        # The lidar's points, in its own axes and by its own calibration.
        seen = exported.points(number, "lidar")
        assert data.lidar_data.shape == (len(seen), 4) and len(seen) > 1000
        vehicle = np.array([[float(r[k]) for k in ("x_m", "y_m", "z_m")] for r in seen])
        world = np.hstack([data.lidar_data[:, :3], np.ones((len(seen), 1))]) @ (transforms.t_map_camera @ transforms.t_camera_lidar).T
        np.testing.assert_allclose(world[:, :3], Pose(truth["ego"])(vehicle), atol=1e-4)
        cosine = np.cos(np.radians([float(r["incidence_deg"]) for r in seen]))
        np.testing.assert_allclose(data.lidar_data[:, 3], cosine, atol=1e-6)
        labels = FrameLabels([f"{line.rstrip()} 1" for line in data.raw_labels]).labels_dict
        assert labels
        for label in labels:
            camera = np.array([label["x"], label["y"] - label["h"] / 2, label["z"], 1])
            centre = (transforms.t_map_camera @ camera)[:3]
            assert min(np.linalg.norm(centre - a["centre_m"]) for a in truth["actors"]) < 1e-3

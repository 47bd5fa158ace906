"""TuSimple lane lines against an independent projection (OpenCV's) of the expected lanes."""

import json

import cv2
import numpy as np
import pytest

WIDTH, HEIGHT, FOCAL = 1280, 720, 1266.4 * 1280 / 1600
CAMERA = np.array([1.70, 0.0, 1.51])


@pytest.fixture(scope="module")
def frames(samples):
    return [json.loads(line) for line in (samples / "lanes.json").read_text().splitlines()]


def test_shape(frames):
    assert [f["raw_file"] for f in frames] == ["frame_000000/camera.jpg", "frame_000001/camera.jpg"]
    for f in frames:
        assert list(f) == ["raw_file", "lanes", "h_samples"]
        assert f["h_samples"] == list(range(160, 720, 10))
        assert len(f["lanes"]) == 2
        for lane in f["lanes"]:
            assert len(lane) == len(f["h_samples"])
            assert all(isinstance(x, int) and (x == -2 or 0 <= x < WIDTH) for x in lane)


def test_columns(frames, expected):
    # OpenCV's camera: x right, y down, z ahead.
    turn, _ = cv2.Rodrigues(np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]))
    shift = -np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]) @ CAMERA
    matrix = np.array([[FOCAL, 0, WIDTH / 2], [0, FOCAL, HEIGHT / 2], [0, 0, 1]])
    for frame, sweep in zip(frames, expected[::2], strict=True):
        assert [lane["name"] for lane in sweep["lanes"]] == ["left", "right"]
        for found, lane in zip(frame["lanes"], sweep["lanes"], strict=True):
            # Fine points along the line's straight pieces, in front of the camera.
            corners = np.array(lane["points_m"])
            t = np.linspace(0, len(corners) - 1, 200_001)
            i = np.minimum(t.astype(int), len(corners) - 2)
            points = corners[i] + (t - i)[:, None] * (corners[i + 1] - corners[i])
            points = points[points[:, 0] > CAMERA[0] + 0.1]
            pixels, _ = cv2.projectPoints(points, turn, shift, matrix, None)
            pixels = pixels[:, 0]
            shown = 0
            for row, x in zip(frame["h_samples"], found):
                # Where the line passes the row, the nearest first.
                above = pixels[:, 1] < row
                passes = np.flatnonzero(above[1:] != above[:-1])
                want = pixels[passes[0], 0] if len(passes) else np.nan
                if x == -2:
                    assert not 1 <= want <= WIDTH - 2
                else:
                    shown += 1
                    assert abs(x - want) <= 0.6, (row, x, want)
            assert shown > 10


def test_left_is_left(frames):
    for f in frames:
        both = [(a, b) for a, b in zip(*f["lanes"]) if a >= 0 and b >= 0]
        assert both and all(a < b for a, b in both)

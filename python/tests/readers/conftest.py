"""Files of catseye's exporters, read by the formats' own public readers.

The samples and `expected.json`, which says what is in them, are written by the Rust test
`formats::interop::samples::written_for_the_public_readers` into the folder that the environment variable
`CATSEYE_SAMPLES` names.
"""

import json
import os
from pathlib import Path

import numpy as np
import pytest


@pytest.fixture(scope="session")
def samples():
    folder = os.environ.get("CATSEYE_SAMPLES")
    if not folder:
        pytest.fail("CATSEYE_SAMPLES does not name the folder of the samples (see conftest.py)")
    folder = Path(folder)
    assert (folder / "expected.json").is_file(), f"{folder} holds no samples"
    return folder


@pytest.fixture(scope="session")
def expected(samples):
    """Sweeps in the order in which they were written."""
    sweeps = json.loads((samples / "expected.json").read_text())
    assert len(sweeps) == 4
    return sweeps


def rotation(xyzw):
    """Rotation matrix of a quaternion x, y, z, w."""
    x, y, z, w = xyzw
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class Pose:
    """From one frame of reference to another."""

    def __init__(self, record):
        self.rotation = rotation(record["rotation_xyzw"])
        self.position = np.array(record["position_m"])

    def __call__(self, points):
        return np.asarray(points) @ self.rotation.T + self.position

    def back(self, points):
        return (np.asarray(points) - self.position) @ self.rotation


def sensor_to_vehicle(sweep):
    return Pose(sweep["sensor_in_vehicle"])


def vehicle_to_world(sweep):
    return Pose(sweep["vehicle_in_world"])


def column(sweep, key):
    return np.array([p[key] for p in sweep["points"]])


def rate_over_ground(sweep):
    """Range rates that a radar at rest would measure: the definition, in the world."""
    to_vehicle, to_world = sensor_to_vehicle(sweep), vehicle_to_world(sweep)
    points = to_world(to_vehicle(column(sweep, "position_m")))
    radar = to_world(to_vehicle(np.zeros(3)))
    rays = (points - radar) / np.linalg.norm(points - radar, axis=1)[:, None]
    return column(sweep, "range_rate_mps") + rays @ np.array(sweep["sensor_velocity_mps"])

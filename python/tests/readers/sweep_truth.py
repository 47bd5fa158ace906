"""What is true of the sweeps in `expected.json`, worked out from the definitions."""

import numpy as np


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

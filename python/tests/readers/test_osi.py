"""ASAM OSI traces: the published 3.8 messages of the package `betterosi`, read by it and by Google's protobuf with its descriptors."""

import importlib.resources
import struct

import numpy as np
import pytest
from sweep_truth import column, sensor_to_vehicle, vehicle_to_world
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

betterosi = pytest.importorskip("betterosi")


def rotation(o):
    """OSI's Orientation3d: yaw, then pitch about the new y, then roll about the new x."""
    cy, sy, cp, sp, cr, sr = [f(a) for a in (o.yaw, o.pitch, o.roll) for f in (np.cos, np.sin)]
    z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    return z @ y @ x


def vector(v):
    return np.array([v.x, v.y, v.z])


@pytest.fixture(scope="module")
def messages(samples):
    """By Google's protobuf, which keeps what it does not know apart."""
    text = importlib.resources.files("betterosi").joinpath("generated", "3.8.0", "osi3_descriptor_set.pb").read_bytes()
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(text).file:
        pool.Add(file)
    sensor_data = message_factory.GetMessageClass(pool.FindMessageTypeByName("osi3.SensorData"))
    data = (samples / "run_sd.osi").read_bytes()
    out = []
    while data:
        (length,) = struct.unpack("<I", data[:4])
        message = sensor_data.FromString(data[4 : 4 + length])
        # Every field that was written is one of the standard, with its type.
        again = sensor_data.FromString(message.SerializeToString())
        again.DiscardUnknownFields()
        assert again == message and again.ByteSize() == length
        out.append(message)
        data = data[4 + length :]
    return out


def test_frames_of_reference(messages, expected):
    for m, sweep in zip(messages, expected, strict=True):
        assert (m.version.version_major, m.version.version_minor) == (3, 8)
        assert m.timestamp.seconds * 10**9 + m.timestamp.nanos == sweep["time_ns"]
        assert m.sensor_id.value == (1 if sweep["radar"] == "front" else 2)
        mount = sensor_to_vehicle(sweep)
        np.testing.assert_allclose(vector(m.mounting_position.position), mount.position)
        np.testing.assert_allclose(rotation(m.mounting_position.orientation), mount.rotation, atol=1e-12)
        header = m.feature_data.radar_sensor[0].header
        assert header.mounting_position == m.mounting_position
        assert header.cycle_counter == sweep["frame"]
        assert header.number_of_valid_detections == len(sweep["points"])


def test_detections(messages, expected):
    for m, sweep in zip(messages, expected, strict=True):
        detections = m.feature_data.radar_sensor[0].detection
        assert len(detections) == len(sweep["points"])
        if not detections:
            continue
        # Positive towards the sensor.
        np.testing.assert_allclose([d.radial_velocity for d in detections], -column(sweep, "range_rate_mps"))
        np.testing.assert_allclose([d.rcs for d in detections], column(sweep, "rcs_dbsm"))
        np.testing.assert_allclose([d.snr for d in detections], column(sweep, "snr_db"))
        for d, p in zip(detections, sweep["points"], strict=True):
            # The place by OSI's own definition of its angles.
            turn = rotation(type(m.mounting_position.orientation)(yaw=d.position.azimuth, pitch=d.position.elevation))
            np.testing.assert_allclose(turn[:, 0] * d.position.distance, p["position_m"], atol=1e-9)
            assert d.object_id.value == (p["object_id"] or 2**64 - 1)
            assert d.HasField("existence_probability") == bool(p["object_id"])
            if p["object_id"]:
                assert d.existence_probability == (0 if p["ghost"] else 1)
            assert d.position_rmse.HasField("azimuth") == (p["azimuth_std_rad"] is not None)
            assert d.classification == (2 if p["ghost"] else 0)
        if sweep["radar"] == "front":
            assert detections[2].radial_velocity > 5, "the rail ahead comes closer"


def test_objects(messages, expected):
    for m, sweep in zip(messages, expected, strict=True):
        to_vehicle, to_world = sensor_to_vehicle(sweep), vehicle_to_world(sweep)
        pose = to_world.rotation @ to_vehicle.rotation
        by_id = {b["id"]: b for b in sweep["boxes"]}
        moving = {o.header.tracking_id.value: o for o in m.moving_object}
        standing = {o.header.tracking_id.value: o for o in m.stationary_object}
        assert (set(moving), set(standing)) == ({7, 8}, {12})
        kinds = {i: (o.candidate[0].type, o.candidate[0].vehicle_classification.type) for i, o in moving.items()}
        assert kinds == {7: (2, 4), 8: (2, 7)}, "vehicles: a medium car and a heavy truck"
        assert standing[12].candidate[0].classification.type == 8, "barrier"
        for i, o in (moving | standing).items():
            b = by_id[i]
            np.testing.assert_allclose(to_world(to_vehicle(vector(o.base.position))), b["centre_m"], atol=1e-9)
            size = o.base.dimension
            np.testing.assert_allclose([size.length, size.width, size.height], b["size_m"])
            ahead = pose @ rotation(o.base.orientation)[:, 0]
            yaw = np.arctan2(ahead[1], ahead[0])
            x, y, z, w = b["rotation_xyzw"]
            np.testing.assert_allclose(yaw, 2 * np.arctan2(z, w), atol=1e-9)
            measured = any(p["object_id"] == i and not p["ghost"] for p in sweep["points"])
            assert o.header.measurement_state == (2 if measured else 1)
        for i, o in moving.items():
            # Over the ground again: the frame's own motion and turning put back.
            spin = np.array([0, 0, sweep["yaw_rate_rad_per_s"]])
            arm = pose @ vector(o.base.position)
            ground = pose @ vector(o.base.velocity) + np.cross(spin, arm) + np.array(sweep["sensor_velocity_mps"])
            np.testing.assert_allclose(ground, by_id[i]["velocity_mps"], atol=1e-9)


def test_lanes(messages, expected):
    for m, sweep in zip(messages, expected, strict=True):
        for boundary, lane in zip(m.lane_boundary, sweep["lanes"], strict=True):
            points = np.array([vector(p.position) for p in boundary.boundary_line])
            np.testing.assert_allclose(sensor_to_vehicle(sweep)(points), lane["points_m"], atol=1e-9)


def test_read_by_betterosi(samples, messages):
    own = list(betterosi.read(str(samples / "run_sd.osi"), version="3.8.0"))
    assert len(own) == len(messages)
    for a, b in zip(own, messages):
        assert type(a).__name__ == "SensorData"
        assert a.timestamp.seconds == b.timestamp.seconds
        rates = [d.radial_velocity for d in a.feature_data.radar_sensor[0].detection]
        assert rates == [d.radial_velocity for d in b.feature_data.radar_sensor[0].detection]

"""MCAP recordings, read by `mcap` and `mcap-protobuf-support` with the descriptors in the file."""

import importlib
import io
from collections import defaultdict

import cv2
import numpy as np
import pytest
from sweep_truth import Pose, column, sensor_to_vehicle, vehicle_to_world
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


@pytest.fixture(scope="module")
def recording(samples):
    """Decoded messages by topic, and the summary and metadata."""
    topics = defaultdict(list)
    with open(samples / "run.mcap", "rb") as f:
        reader = make_reader(f, decoder_factories=[DecoderFactory()], validate_crcs=True)
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            assert message.log_time == message.publish_time
            topics[channel.topic].append((schema.name, message.log_time, decoded))
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
        summary = reader.get_summary()
    return topics, summary, metadata


def test_topics(recording, expected):
    topics, summary, _ = recording
    assert {t: (len(m), m[0][0]) for t, m in topics.items()} == {
        "/tf": (4, "foxglove.FrameTransforms"),
        "/truth": (2, "foxglove.SceneUpdate"),
        "/front/points": (2, "foxglove.PointCloud"),
        "/left/points": (2, "foxglove.PointCloud"),
        "/front/range_doppler": (2, "foxglove.CompressedImage"),
        "/left/range_doppler": (2, "foxglove.CompressedImage"),
    }
    assert summary.statistics.message_count == 14
    assert summary.statistics.message_start_time == expected[0]["time_ns"]
    assert [t for _, t, _ in topics["/tf"]] == [s["time_ns"] for s in expected]


def test_descriptors_are_those_of_the_published_package(recording):
    _, summary, _ = recording
    compared = set()
    for schema in summary.schemas.values():
        assert schema.encoding == "protobuf"
        pool = DescriptorPool()
        for file in FileDescriptorSet.FromString(schema.data).file:
            pool.Add(file)
        for file in FileDescriptorSet.FromString(schema.data).file:
            if file.package != "foxglove":
                continue
            name = file.message_type[0].name
            theirs = getattr(importlib.import_module(f"foxglove_schemas_protobuf.{name}_pb2"), name).DESCRIPTOR
            ours = pool.FindMessageTypeByName(f"foxglove.{name}")

            def fields(d):
                kind = lambda f: (f.message_type or f.enum_type).full_name if f.message_type or f.enum_type else f.type
                return sorted((f.number, f.name, f.is_repeated, kind(f)) for f in d.fields)

            def enums(d):
                return {e.name: sorted((v.number, v.name) for v in e.values) for e in d.enum_types}

            assert fields(ours) == fields(theirs), name
            assert enums(ours) == enums(theirs), name
            compared.add(name)
    assert {"PointCloud", "SceneEntity", "LinePrimitive", "PackedElementField"} <= compared and len(compared) > 15


def test_points(recording, expected):
    topics, _, _ = recording
    dtype = {7: "<f4", 5: "<u4", 1: "u1"}
    seen = defaultdict(int)
    for sweep in expected:
        _, _, cloud = topics[f"/{sweep['radar']}/points"][seen[sweep["radar"]]]
        seen[sweep["radar"]] += 1
        assert cloud.frame_id == sweep["radar"]
        assert cloud.timestamp.ToNanoseconds() == sweep["time_ns"]
        fields = np.dtype(
            {
                "names": [f.name for f in cloud.fields],
                "formats": [dtype[f.type] for f in cloud.fields],
                "offsets": [f.offset for f in cloud.fields],
                "itemsize": cloud.point_stride,
            }
        )
        points = np.frombuffer(cloud.data, fields)
        assert len(points) == len(sweep["points"])
        if len(points) == 0:
            continue
        position = np.stack([points["x"], points["y"], points["z"]], 1)
        np.testing.assert_allclose(position, column(sweep, "position_m"), rtol=1e-6, atol=1e-6)
        for name, key in [("velocity", "range_rate_mps"), ("rcs", "rcs_dbsm"), ("snr", "snr_db")]:
            np.testing.assert_allclose(points[name], column(sweep, key), rtol=1e-6)
        np.testing.assert_array_equal(points["object_id"], column(sweep, "object_id"))
        np.testing.assert_array_equal(points["ghost"], column(sweep, "ghost"))


def pose_of(translation, rotation):
    return Pose(
        {
            "position_m": [translation.x, translation.y, translation.z],
            "rotation_xyzw": [rotation.x, rotation.y, rotation.z, rotation.w],
        }
    )


def test_points_lie_in_their_boxes(recording, expected):
    """Through the transforms of the file alone: the chain world, vehicle, sensor is the right way round."""
    topics, _, _ = recording
    for (_, _, transforms), sweep in zip(topics["/tf"], expected, strict=True):
        by_child = {t.child_frame_id: t for t in transforms.transforms}
        assert by_child["vehicle"].parent_frame_id == "world"
        assert by_child[sweep["radar"]].parent_frame_id == "vehicle"
        chain = [pose_of(by_child[c].translation, by_child[c].rotation) for c in (sweep["radar"], "vehicle")]
        np.testing.assert_allclose(chain[0].rotation, sensor_to_vehicle(sweep).rotation, atol=1e-12)
        np.testing.assert_allclose(chain[1].rotation, vehicle_to_world(sweep).rotation, atol=1e-12)
        _, _, scene = topics["/truth"][sweep["frame"]]
        boxes = {e.id: e.cubes[0] for e in scene.entities if e.cubes}
        for p in sweep["points"]:
            if p["object_id"] == 0 or p["ghost"]:
                continue
            cube = boxes[f"object {p['object_id']}"]
            inside = pose_of(cube.pose.position, cube.pose.orientation).back(chain[1](chain[0](p["position_m"])))
            assert np.all(np.abs(inside) <= 0.5 * np.array([cube.size.x, cube.size.y, cube.size.z]) + 1e-9)


def test_truth(recording, expected):
    topics, _, _ = recording
    for (_, _, scene), sweep in zip(topics["/truth"], expected[::2], strict=True):
        assert [d.type for d in scene.deletions] == [1], "ALL: what was there before goes"
        cubes = [e for e in scene.entities if e.cubes]
        assert [e.frame_id for e in cubes] == ["world"] * 3
        assert [{m.key: m.value for m in e.metadata}["class"] for e in cubes] == ["car", "truck", "guard_rail"]
        lines = [e for e in scene.entities if e.lines]
        assert [e.frame_id for e in lines] == ["vehicle"] * 2
        for entity, lane in zip(lines, sweep["lanes"], strict=True):
            points = [[p.x, p.y, p.z] for p in entity.lines[0].points]
            np.testing.assert_allclose(points, lane["points_m"])
            assert entity.lines[0].type == 0


def test_pictures(recording, expected):
    topics, _, metadata = recording
    about = metadata["range_doppler"]
    white, step = float(about["white_dbm"]), float(about["db_per_grey_level"])
    assert set(about) == {"front", "left", "white_dbm", "db_per_grey_level"}
    for (_, _, message), sweep in zip(topics["/front/range_doppler"], expected[::2], strict=True):
        assert message.format == "png" and message.frame_id == "front"
        grey = cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_UNCHANGED)
        assert grey.dtype == np.uint8
        map_ = sweep["range_doppler"]
        power = np.array(map_["power_w"]).reshape(map_["rows"], map_["columns"])
        level = 10 * np.log10(power) + 30
        # The top row is the highest range rate, the last of the map.
        shown = white - step * (255 - grey[::-1].astype(float))
        assert shown.shape == level.shape
        assert np.max(np.abs(shown - level)) <= 0.5 * step + 1e-4


def test_a_flipped_bit_is_found(samples):
    """The check sums of the file are real."""
    data = bytearray((samples / "run.mcap").read_bytes())
    data[len(data) // 3] ^= 1
    with pytest.raises(Exception):
        reader = make_reader(io.BytesIO(bytes(data)), decoder_factories=[DecoderFactory()], validate_crcs=True)
        list(reader.iter_decoded_messages())

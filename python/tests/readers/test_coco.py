"""COCO's annotations of grids, opened by pycocotools, against the masks and grids of the run."""

import cv2
import numpy as np
import pytest
from pycocotools import mask as codes
from pycocotools.coco import COCO
from scipy import ndimage
from sweep_truth import Pose, sensor_to_vehicle, vehicle_to_world

GRIDS = ["road", "markers"]
CLASSES = ["undefined", "lane", "vehicle", "guard rail", "marker", "pedestrian", "cyclist"]


def check(coco, image, mask):
    """Every connected object of a mask has its annotation, and nothing else has one."""
    objects = []
    for number in range(1, len(CLASSES)):
        labels, count = ndimage.label(mask == number, structure=np.ones((3, 3)))
        objects += [(number, labels == i + 1) for i in range(count)]
    annotations = coco.loadAnns(coco.getAnnIds(imgIds=image["id"]))
    assert len(annotations) == len(objects)
    seen = np.zeros_like(mask)
    for a in annotations:
        cells = coco.annToMask(a).astype(bool)
        assert any(number == a["category_id"] and np.array_equal(cells, truth) for number, truth in objects)
        assert not seen[cells].any()
        seen[cells] = a["category_id"]
        code = coco.annToRLE(a)
        assert a["area"] == codes.area(code) == cells.sum()
        assert a["bbox"] == codes.toBbox(code).tolist()
        rows, columns = np.nonzero(cells)
        x, y, w, h = a["bbox"]
        assert [x, y] == [columns.min(), rows.min()] and [x + w - 1, y + h - 1] == [columns.max(), rows.max()]
        assert a["iscrowd"] == 0
    np.testing.assert_array_equal(seen, mask)
    return len(objects)


def picture(path):
    """Red, green and blue."""
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)[:, :, ::-1]


def channels(planes, farthest):
    levels = [planes[0], 255 * planes[1].astype(float), 255 * planes[2].astype(float) / farthest]
    return np.stack([np.floor(np.clip(level, 0, 255) + 0.5) for level in levels], axis=2)


@pytest.mark.parametrize("name", GRIDS)
def test_samples(samples, expected, name):
    folder = samples / "coco" / name
    coco = COCO(str(folder / "annotations.json"))
    grids = {(s["radar"], s["frame"]): g for s in expected for g in s["grids"] if g["name"] == name}
    assert len(coco.imgs) == len(grids) == 4
    shown = sorted(["lane", *next(iter(grids.values()))["classes"]])
    assert sorted(c["name"] for c in coco.loadCats(coco.getCatIds())) == shown
    assert all(CLASSES[c["id"]] == c["name"] for c in coco.loadCats(coco.getCatIds()))
    for image in coco.loadImgs(coco.getImgIds()):
        grid = grids[image["radar"], image["frame"]]
        shape = (grid["rows"], grid["columns"])
        assert (image["height"], image["width"]) == shape
        (sweep,) = [s for s in expected if (s["radar"], s["frame"]) == (image["radar"], image["frame"])]
        assert image["radar_in_vehicle"] == sweep["sensor_in_vehicle"]
        assert image["vehicle_in_world"] == sweep["vehicle_in_world"]
        np.testing.assert_allclose(image["extent_m"], np.array(grid["cell_m"]) * shape)
        # The grid's axes: level, at the radar, and its x in plan along the boresight.
        pose = Pose(image["grid_in_world"])
        radar = vehicle_to_world(sweep)(sensor_to_vehicle(sweep)(np.zeros(3)))
        np.testing.assert_allclose(pose.position, radar, atol=1e-9)
        ahead = vehicle_to_world(sweep)(sensor_to_vehicle(sweep)(np.array([1.0, 0, 0]))) - radar
        level = np.array([*ahead[:2], 0]) / np.hypot(*ahead[:2])
        np.testing.assert_allclose(pose.rotation, np.array([level, np.cross([0, 0, 1], level), [0, 0, 1]]).T, atol=1e-9)
        mask = np.array(grid["mask"], np.uint8).reshape(shape)
        np.testing.assert_array_equal(cv2.imread(str(folder / image["mask_file_name"]), cv2.IMREAD_UNCHANGED), mask)
        assert check(coco, image, mask) >= 4
        planes = np.array(grid["planes"], np.float32).reshape(4, *shape)
        ahead, across = np.array(grid["cell_m"]) * shape
        np.testing.assert_array_equal(
            picture(folder / "images" / image["file_name"]), channels(planes, np.hypot(ahead, across / 2))
        )


@pytest.mark.parametrize(("name", "farthest"), [("road", np.hypot(60, 20)), ("markers", np.hypot(40, 20))])
def test_run(exported, name, farthest):
    folder = exported.folder / "coco"
    if not folder.exists():
        exported.export("coco")
    coco = COCO(str(folder / name / "annotations.json"))
    assert len(coco.imgs) == len(exported.frames)
    found = 0
    for image in coco.loadImgs(coco.getImgIds()):
        frame = exported.folder / f"run/frame_{image['frame']:06}"
        mask = np.load(frame / f"mask_{name}.npy")
        found += check(coco, image, mask)
        planes = np.load(frame / f"grid_{name}.npy")
        shown = picture(folder / name / "images" / image["file_name"])
        assert np.abs(shown - channels(planes, farthest)).max() <= 1
        np.testing.assert_array_equal(shown[:, :, 0], planes[0])
    vehicles = coco.getAnnIds(catIds=coco.getCatIds(catNms=["vehicle"]))
    assert found > len(vehicles) > 0

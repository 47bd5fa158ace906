import numpy as np
import pytest

import catseye

ROAD = """
name = "short"
[[road]]
name = "road"
plan = [{ kind = "straight", length_m = 40 }]
right = [{ width_m = 3.5, line = "solid" }]
[[road.markers]]
name = "row"
reflector = "type1:width_m=0.16,height_m=0.004,material=aluminium"
lateral = { lane = 1, side = "left", offset_m = -0.1 }
spacing_m = 8
"""


def test_reflectors_are_listed_and_made():
    kinds = catseye.reflector_kinds()
    assert kinds["plate"]["parameters"]["width_m"]["doc"]
    scene = catseye.reflector("plate", width_m=0.5, height_m=0.25)
    assert len(scene) == 1 and scene.triangle_count == 2
    np.testing.assert_allclose(np.ptp(scene.bounds_m(), axis=0), [0, 0.5, 0.25])
    with pytest.raises(catseye.BadInput, match="use one of the two"):
        catseye.reflector("plate:width_m=1", height_m=1)
    with pytest.raises(catseye.BadInput, match="width_m"):
        catseye.reflector("plate", width_m=-1)


def test_a_scene_is_put_together():
    scene = catseye.Scene()
    assert scene.bounds_m() is None and len(scene) == 0
    point = scene.add_point(position_m=(10, 0, 1), rcs_dbsm=5, velocity_mps=np.array([1.0, 0, 0]), name="p", class_name="car")
    ids = scene.add("plate:width_m=2,height_m=1", position_m=[20, -3, 0.5], yaw_deg=90, name="sign", class_name="sign")
    assert len({point, *ids}) == 2 == len(scene)
    by_id = {o["id"]: o for o in scene.objects}
    assert by_id[point]["rcs_dbsm"] == 5 and by_id[ids[0]]["rcs_dbsm"] is None
    assert by_id[ids[0]]["triangles"] == 2 and by_id[ids[0]]["name"] == "sign"
    # Turned by 90 degrees its width lies along x.
    box = next(b for b in scene.boxes() if b["id"] == ids[0])
    assert box["yaw_rad"] == pytest.approx(np.pi / 2) and box["centre_m"] == pytest.approx([20, -3, 0.5])
    corners = scene.triangles()
    assert corners["corners_m"].shape == (2, 3, 3) and set(corners["object_id"]) == set(ids)
    np.testing.assert_allclose(np.ptp(corners["corners_m"].reshape(-1, 3), axis=0), [2, 0, 1], atol=1e-12)
    np.testing.assert_allclose(scene.bounds_m(time_s=2.0)[0], [12, -3, 0])
    # To itself: twice as many, with ids of their own.
    scene.add(scene, position_m=[0, 50, 0])
    assert len(scene) == 4 == len({o["id"] for o in scene.objects})
    for bad in ({"position_m": [1, 2]}, {"position_m": [0, 0, np.inf]}, {"yaw_deg": 1e9}):
        with pytest.raises(catseye.BadInput):
            scene.add("plate", **bad)


CORNERS = [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]]
FACES = [[0, 1, 2], [0, 2, 3]]


def test_a_mesh_is_given_by_arrays():
    scene = catseye.Scene.from_mesh(np.array(CORNERS, np.float32), np.array(FACES, np.uint8), material=["steel", "pec"], name="door", class_name="car")
    assert scene.materials == ["steel", "pec"] and scene.notes == []
    assert scene.objects[0]["name"] == "door" and scene.objects[0]["class"] == "car"
    np.testing.assert_array_equal(scene.triangles()["corners_m"], np.array(CORNERS, float)[np.array(FACES)])
    np.testing.assert_array_equal(scene.triangles()["material"], [0, 1])
    # Columns of a larger array, in another order of memory.
    wide = np.asfortranarray(np.pad(np.array(CORNERS, float), ((0, 0), (0, 2))))
    assert catseye.Scene.from_mesh(wide[:, :3], FACES).to_glb() == catseye.Scene.from_mesh(CORNERS, FACES).to_glb()
    # A plane stays one, whatever its normals say; a quarter of a tube is curved by its own normals, and by an angle where it has none.
    tilted = catseye.Scene.from_mesh(CORNERS, FACES, normals=[[1, 0, z] for z in (-0.1, -0.1, 0.1, 0.1)])
    assert tilted.to_glb() == catseye.Scene.from_mesh(CORNERS, FACES, normals=[[5, 0, 0]] * 4).to_glb()
    turn = np.radians(15 * np.arange(7))
    tube = np.array([[np.cos(a), np.sin(a), z] for a in turn for z in (0, 1)])
    strips = [t for i in range(0, 12, 2) for t in ([i, i + 2, i + 3], [i, i + 3, i + 1])]
    flat = catseye.Scene.from_mesh(tube, strips).to_glb()
    assert catseye.Scene.from_mesh(tube, strips, normals=tube * [1, 1, 0]).to_glb() != flat
    smooth = catseye.Scene.from_mesh(tube, strips, smooth_deg=20)
    assert smooth.to_glb() != flat and "smooth_deg" in smooth.notes[0]
    with pytest.raises(catseye.BadInput, match="smooth_deg"):
        catseye.Scene.from_mesh(tube, strips, smooth_deg=61)
    # The same metal twice is reported.
    twice = catseye.Scene.from_mesh([*CORNERS, *CORNERS], [*FACES, *(np.array(FACES) + 4)])
    assert any("counts once" in line for line in twice.check())
    dropped = catseye.Scene.from_mesh(CORNERS, [*FACES, [1, 1, 2]])
    assert dropped.triangle_count == 2 and "1 triangles without area" in dropped.notes[0]
    world = catseye.Scene()
    world.add(dropped, position_m=[10, 0, 0])
    assert world.triangle_count == 2


@pytest.mark.parametrize(
    "arguments, parts",
    [
        ({"vertices_m": np.zeros((4, 2))}, ("vertices_m", "shape (4, 2)", "float64", "(n, 3)")),
        ({"vertices_m": np.zeros(3)}, ("vertices_m", "shape (3)")),
        ({"vertices_m": [[0, 0, 0], [1, 1]]}, ("vertices_m", "not an array of numbers")),
        ({"vertices_m": [["a", "b", "c"]]}, ("vertices_m", "has elements of")),
        ({"vertices_m": [[0, 0, 0], [0, np.nan, 0], [0, 1, 1], [0, 0, 1]]}, ("vertices_m[1]", "finite")),
        ({"vertices_m": [[0, 0, 0], [0, 2e9, 0], [0, 1, 1], [0, 0, 1]]}, ("vertices_m[1]", "1e9 m")),
        ({"triangles": [[0.0, 1.0, 2.0]]}, ("triangles", "elements of float64", "int64")),
        ({"triangles": [0, 1, 2]}, ("triangles", "shape (3)", "(n, 3)")),
        ({"triangles": [[0, 1, 4]]}, ("triangles[0] = [0, 1, 4]", "0..=3")),
        ({"triangles": [[0, 1, 2], [0, -1, 2]]}, ("triangles[1] = [0, -1, 2]", "0..=3")),
        ({"triangles": np.zeros((0, 3), int)}, ("triangles", "no triangle")),
        ({"triangles": [[0, 0, 1]]}, ("triangles", "no area")),
        ({"normals": [[0, 0, 1]]}, ("normals = 1", "allowed: 4")),
        ({"normals": [[0, 0, np.inf]] * 4}, ("normals[0]", "not finite")),
        ({"material": "chees"}, ("chees",)),
        ({"material": ["pec"] * 3}, ("material = 3 names", "1 or 2")),
    ],
)
def test_arrays_that_are_no_mesh(arguments, parts):
    with pytest.raises(catseye.BadInput) as e:
        catseye.Scene.from_mesh(**({"vertices_m": CORNERS, "triangles": FACES} | arguments))
    for part in parts:
        assert part in str(e.value), str(e.value)
    with pytest.raises(TypeError):
        catseye.Scene.from_mesh(CORNERS, FACES, material=3)


def test_files_come_back(tmp_path):
    scene = catseye.reflector("trihedral")
    path = scene.save(tmp_path / "t.glb")
    again = catseye.Scene.load(path)
    assert again.triangle_count == scene.triangle_count and again.materials == scene.materials
    np.testing.assert_allclose(again.bounds_m(), scene.bounds_m(), atol=1e-6)
    assert catseye.Scene.from_glb(scene.to_glb()).triangle_count == scene.triangle_count
    with pytest.raises(catseye.BadInput, match="exists"):
        scene.save(path)
    scene.save(path, force=True)
    with pytest.raises(catseye.BadInput, match="no such file") as e:
        catseye.Scene.load(tmp_path / "none.glb")
    assert e.value.file.endswith("none.glb")
    with pytest.raises(catseye.BadInput, match="unit"):
        catseye.Scene.load(path, unit="furlong")
    with pytest.raises(catseye.BadInput, match="cheese"):
        catseye.Scene.load(path, default_material="cheese")
    assert catseye.Scene.load(path, materials={"pec": "steel"}).triangle_count == scene.triangle_count


def test_road_scene_with_truth(tmp_path):
    scene = catseye.road_scene(ROAD)
    assert scene.name == "short"
    road = scene.truth["roads"][0]
    assert road["length_m"] == pytest.approx(40) and len(road["lanes"]) == 1
    markers = scene.truth["marker_rows"][0]["markers"]
    assert {m["id"] for m in markers} == {o["id"] for o in scene.objects if o["class"] == "marker"}
    # Text and file are the same, and a .glb keeps the labels.
    (tmp_path / "road.toml").write_text(ROAD)
    assert catseye.road_scene(tmp_path / "road.toml").to_glb() == scene.to_glb()
    assert catseye.Scene.load(scene.save(tmp_path / "road.glb")).truth == scene.truth
    assert catseye.reflector("plate").truth is None
    with pytest.raises(catseye.BadInput) as e:
        catseye.road_scene(ROAD.replace("length_m = 40", "length_m = -40"))
    assert e.value.line == 5 and "-40" in str(e.value)


def test_materials_are_listed():
    assert {"pec", "aluminium", "concrete"} <= set(catseye.materials())

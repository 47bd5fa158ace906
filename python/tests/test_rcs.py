import os
import signal
import threading
import time

import numpy as np
import pytest

import catseye

C0 = 299_792_458.0


def test_plate_has_its_closed_form(engine):
    frequency = np.array([24e9, 77e9])
    found = catseye.rcs("plate:width_m=0.1,height_m=0.05", frequency_hz=frequency, engine=engine)
    exact = 10 * np.log10(4 * np.pi * (0.1 * 0.05) ** 2 * (frequency / C0) ** 2)
    np.testing.assert_allclose(found.vv_dbsm[:, 0, 0], exact, atol=1e-6)
    np.testing.assert_allclose(found.hh_dbsm[:, 0, 0], exact, atol=1e-6)
    assert np.all(found.vh_dbsm < exact[:, None, None] - 100)


def test_axes_and_their_order(engine):
    azimuth, elevation = [-10.0, 0.0, 10.0, 20.0], [0.0, 30.0]
    found = catseye.rcs(
        "plate:width_m=0.02,height_m=0.03", frequency_hz=77e9, azimuth_deg=azimuth, elevation_deg=elevation, engine=engine
    )
    assert found.s.shape == (1, 2, 4, 2, 2) and found.s.dtype == np.complex128
    assert found.dbsm.shape == found.s.shape and found.vv_dbsm.shape == (1, 2, 4)
    np.testing.assert_allclose(found.dbsm, 10 * np.log10(4 * np.pi * np.abs(found.s) ** 2))
    np.testing.assert_array_equal(found.azimuth_deg, azimuth)
    for i, el in enumerate(elevation):
        for j, az in enumerate(azimuth):
            alone = catseye.rcs("plate:width_m=0.02,height_m=0.03", azimuth_deg=az, elevation_deg=el, engine=engine)
            np.testing.assert_array_equal(alone.s[0, 0, 0], found.s[0, i, j])


def test_a_raised_target_is_seen_from_its_foot(engine):
    """As in `catseye rcs` and in studies: two rays over a conductor, and without one the level of the point itself."""
    distance = 40.0
    elevation, range_m = np.degrees(np.arctan2(0.5, distance)), np.hypot(0.5, distance)
    place = dict(elevation_deg=elevation, range_m=range_m, height_m=0.3, engine=engine)
    found = catseye.rcs("point:rcs_dbsm=10", ground="pec", **place)
    straight, reflected = np.hypot(distance, 0.2), np.hypot(distance, 0.8)
    two = 1 + straight / reflected * np.exp(-2j * np.pi * 77e9 / C0 * (reflected - straight))
    assert abs(found.vv_dbsm[0, 0, 0] - 10 - 40 * np.log10(abs(two))) < 0.05
    alone = catseye.rcs("point:rcs_dbsm=10", range_m=10.0, height_m=5.0, engine=engine)
    assert abs(alone.vv_dbsm[0, 0, 0] - 10) < 1e-9


def test_where_physical_optics_ends_is_a_warning(engine):
    with pytest.warns(UserWarning, match="size: .*0.26 wavelengths"):
        found = catseye.rcs("plate:width_m=0.001,height_m=0.001", engine=engine)
    assert found.warnings[0].startswith("size: ")
    with pytest.warns(UserWarning, match="ground: at elevation 1.000 deg"):
        catseye.rcs("plate:width_m=0.1,height_m=0.002", elevation_deg=1, ground="pec", height_m=0.0015, engine=engine)
    assert catseye.rcs("plate:width_m=0.1,height_m=0.1", engine=engine).warnings == []


def test_bistatic_axes_and_reciprocity(engine):
    target = catseye.reflector("dihedral")
    there = catseye.rcs(target, azimuth_deg=[5.0], bistatic_azimuth_deg=[12.0, 20.0], bistatic_elevation_deg=[3.0], engine=engine)
    assert there.s.shape == (1, 1, 1, 1, 2, 2, 2)
    back = catseye.rcs(target, azimuth_deg=[12.0], elevation_deg=[3.0], bistatic_azimuth_deg=[5.0], engine=engine)
    np.testing.assert_array_equal(there.bistatic_azimuth_deg, [12.0, 20.0])
    assert back.bistatic_elevation_deg == 0.0
    # Physical optics is reciprocal for double bounces between plates only roughly; shapes and finiteness are what is asked here.
    assert np.all(np.isfinite(back.s)) and np.all(np.isfinite(there.s))


def test_circular_of_a_plate_is_cross_polar(engine):
    found = catseye.rcs("plate:width_m=0.1,height_m=0.1", engine=engine)
    circular = found.in_polarisation("circular")
    assert circular.shape == found.s.shape
    level = np.abs(circular[0, 0, 0])
    # A mirror turns the hand of a wave: right is received as left.
    assert level[0, 1] > 1e3 * level[0, 0]


def test_scene_and_specification_agree(engine):
    a = catseye.rcs("type1:width_m=0.1,height_m=0.006", azimuth_deg=[0, 7], engine=engine)
    b = catseye.rcs(catseye.reflector("type1", width_m=0.1, height_m=0.006), azimuth_deg=[0, 7], engine=engine)
    np.testing.assert_array_equal(a.s, b.s)
    assert a.target == b.target


def test_a_turned_target_is_seen_from_elsewhere(engine):
    level = dict(elevation_deg=0.0, engine=engine)
    turned = catseye.rcs("plate:width_m=0.1,height_m=0.05", azimuth_deg=20.0, yaw_deg=20.0, **level)
    straight = catseye.rcs("plate:width_m=0.1,height_m=0.05", azimuth_deg=0.0, **level)
    np.testing.assert_allclose(turned.s, straight.s, rtol=1e-9, atol=1e-12)
    assert turned.turned_deg == (20.0, 0.0, 0.0) and straight.turned_deg == (0.0, 0.0, 0.0)
    # Yaw, then pitch, then roll, as a scene turns what is added to it; the scene that is given stays as it is.
    target = catseye.reflector("dihedral")
    angles = dict(yaw_deg=10.0, pitch_deg=-20.0, roll_deg=30.0)
    placed = catseye.Scene()
    placed.add(target, **angles)
    azimuth = np.arange(-30, 31, 10.0)
    np.testing.assert_array_equal(catseye.rcs(target, azimuth_deg=azimuth, engine=engine, **angles).s, catseye.rcs(placed, azimuth_deg=azimuth, engine=engine).s)
    np.testing.assert_array_equal(catseye.rcs(target, engine=engine).s, catseye.rcs("dihedral", engine=engine).s)


def test_the_rule_of_auto_is_told():
    found = catseye.rcs("plate")
    on_gpu = catseye.devices()["auto"] != "cpu"
    assert (found.engine_rule is not None) == on_gpu
    assert catseye.rcs("plate", engine="cpu").engine_rule is None


def test_a_mesh_of_arrays_has_the_cross_section_of_its_reflector(engine):
    y, z = 0.05, 0.025
    vertices = np.array([[0, -y, -z], [0, y, -z], [0, y, z], [0, -y, z]])
    mesh = catseye.Scene.from_mesh(vertices, [[0, 1, 2], [0, 2, 3]], name="sign")
    assert mesh.name == "sign" and mesh.materials == ["pec"] and mesh.triangle_count == 2
    azimuth = np.arange(-20, 21, 5.0)
    a = catseye.rcs(mesh, azimuth_deg=azimuth, engine=engine)
    b = catseye.rcs("plate:width_m=0.1,height_m=0.05,material=pec", azimuth_deg=azimuth, engine=engine)
    np.testing.assert_allclose(a.s, b.s, rtol=1e-9, atol=1e-9)


def test_a_plot_is_saved_as_its_name_says(tmp_path, engine):
    found = catseye.rcs("plate:width_m=0.05,height_m=0.05", azimuth_deg=range(-30, 31), frequency_hz=[76e9, 77e9], engine=engine)
    starts = {"a.png": b"\x89PNG", "a.svg": b"<svg", "a.pdf": b"%PDF-"}
    for name, start in starts.items():
        path = found.save_plot(tmp_path / name, polarisation=["circular", "linear45"])
        assert path == tmp_path / name and path.read_bytes().startswith(start)
    text = (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert '"RL, 77 GHz"' in text and '"VV, 76 GHz"' in text
    with pytest.raises(catseye.BadInput, match="exists"):
        found.save_plot(tmp_path / "a.svg")
    found.save_plot(tmp_path / "a.svg", force=True)
    assert "RL" not in (tmp_path / "a.svg").read_text(encoding="utf-8")
    with pytest.raises(catseye.BadInput, match=r"\.png, \.svg, \.pdf"):
        found.save_plot(tmp_path / "a.jpg")
    with pytest.raises(catseye.BadInput, match="linear45, circular"):
        found.save_plot(tmp_path / "b.png", polarisation="elliptic")
    with pytest.raises(catseye.BadInput, match="single direction"):
        catseye.rcs("plate", engine=engine).save_plot(tmp_path / "b.png")


@pytest.mark.parametrize(
    "arguments, parts",
    [
        ({"yaw_deg": 400.0}, ("yaw_deg = 400", "-360..360")),
        ({"roll_deg": float("nan")}, ("roll_deg = NaN", "-360..360")),
        ({"bounces": 0}, ("bounces = 0", "1..=8")),
        ({"range_m": -1.0}, ("range_m = -1", "a positive number, or inf")),
        ({"range_m": 0.01}, ("range_m = 0.01", "bounding sphere")),
        ({"frequency_hz": 1.0}, ("frequency_hz = 1", "1e8..1e12")),
        ({"frequency_hz": []}, ("frequency_hz", "empty")),
        ({"azimuth_deg": [0.0, 400.0]}, ("azimuth_deg = 400", "-360..360")),
        ({"elevation_deg": [91.0]}, ("elevation_deg = 91", "-90..90")),
        ({"azimuth_deg": [float("nan")]}, ("azimuth_deg", "not a finite number")),
        ({"azimuth_deg": np.zeros(4000), "elevation_deg": np.zeros(4000)}, ("too many directions", "16000000")),
        ({"convention": "all"}, ("convention = all", "every, last")),
        ({"ground": "chees"}, ("ground = chees", "no material is named")),
        ({"accuracy_db": 0.0}, ("accuracy_db = 0", "1e-4..=3")),
    ],
)
def test_bad_arguments_are_one_line(arguments, parts, engine):
    with pytest.raises(catseye.BadInput) as e:
        catseye.rcs("plate", engine=engine, **arguments)
    text = str(e.value)
    assert "\n" not in text and e.value.problem
    for part in parts:
        assert part in text, text


def test_errors_have_the_text_of_the_command_line_and_parts():
    with pytest.raises(ValueError) as e:
        catseye.reflector("plat:width_m=1")
    assert isinstance(e.value, catseye.BadInput)
    assert "plate" in str(e.value)
    assert (e.value.file, e.value.line) == (None, None)


def test_wrong_types_are_type_errors(engine):
    with pytest.raises(TypeError):
        catseye.rcs(3.5)
    with pytest.raises(TypeError):
        catseye.rcs("plate", engine=4)
    with pytest.raises(TypeError):
        catseye.rcs("plate", 77e9)
    with pytest.raises(catseye.BadInput, match="precision = f16"):
        catseye.Engine("cpu", precision="f16")
    with pytest.raises(catseye.BadInput):
        catseye.Engine("no such adapter")


def long_sweep(**more):
    # Half a million directions of a lattice of small corners: far longer than the test waits.
    azimuth = np.linspace(-60, 60, 5000)
    return catseye.rcs("crossing", azimuth_deg=azimuth, elevation_deg=np.linspace(-30, 30, 100), engine="cpu", **more)


def test_ctrl_c_ends_a_sweep():
    timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        long_sweep()
    assert time.monotonic() - start < 10
    timer.join()


def test_other_threads_run_during_a_sweep():
    """The interpreter is let go: a counting thread gets on."""
    count, stop = 0, threading.Event()

    def counting():
        nonlocal count
        while not stop.is_set():
            count += 1
            time.sleep(0.001)

    class Enough(Exception):
        pass

    def progress(done, of):
        assert 0 < done <= of == 500_000
        if count > 100:
            raise Enough

    thread = threading.Thread(target=counting)
    thread.start()
    try:
        # What the callback raises ends the work and comes out.
        with pytest.raises(Enough):
            long_sweep(progress=progress)
    finally:
        stop.set()
        thread.join()
    assert count > 100

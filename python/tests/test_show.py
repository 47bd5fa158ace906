"""What notebooks show: pictures with numbers, pages of `catseye view`, and plots."""

import base64
import html.parser
import io
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import catseye
from catseye import _plot

HOSTILE = "<script>alert('1')</script> & \"quoted\" $x$"


class Reader(html.parser.HTMLParser):
    """Elements with their attributes, and all text, as a browser takes them."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.text = [], ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.text += data

    def one(self, tag):
        (found,) = [attributes for name, attributes in self.elements if name == tag]
        return found


def pixels(shown):
    """The picture in a cell."""
    kind, data = Reader(shown).one("img")["src"].split(",")
    assert kind == "data:image/png;base64"
    from matplotlib.image import imread

    return imread(io.BytesIO(base64.b64decode(data)), format="png")


def page_data(text):
    """What a page is given to draw."""
    return json.loads(re.search(r'id="data">(.*?)</script>', text, re.DOTALL)[1])


@pytest.fixture(scope="module")
def frame(scenario, engine):
    return next(catseye.simulate(scenario, engine=engine))


@pytest.fixture(scope="module")
def table(engine):
    return catseye.rcs("plate:width_m=0.1,height_m=0.05", azimuth_deg=np.arange(-30, 31), elevation_deg=[0.0, 2.0], engine=engine)


@pytest.fixture(autouse=True)
def figures():
    """Closes them; matplotlib keeps each figure that pyplot made."""
    import matplotlib.pyplot as plt

    yield
    plt.close("all")


@pytest.fixture
def hostile():
    scene = catseye.Scene()
    scene.add_point(position_m=(30, 4, 0), rcs_dbsm=15, name=HOSTILE, class_name="<b>car</b>")
    scene.add("plate:width_m=1,height_m=1", position_m=(10, 0, 0), name=HOSTILE)
    return scene


def test_a_frame_shows_itself(frame, radar):
    shown = frame._repr_html_()
    text = Reader(shown).text
    chirps, channels, samples = radar.shape
    assert f"{chirps} chirps × {channels} channels × {samples}" in text
    row, column = np.unravel_index(np.argmax(frame.range_doppler), frame.range_doppler.shape)
    peak_dbm = 10 * np.log10(frame.range_doppler[row, column]) + 30
    assert f"{peak_dbm:.1f} dBm at {frame.range_m[column]:.1f} m, {frame.range_rate_mps[row]:.2f} m/s" in text
    picture = pixels(shown)
    # A drawing of many colours, no empty sheet.
    assert picture.shape[0] > 300 and len(np.unique(picture.reshape(-1, picture.shape[2]), axis=0)) > 50
    assert repr(frame).startswith("<catseye.Frame 0 of demo77")


def test_detections_show_themselves(frame, radar, engine):
    found = catseye.process(frame.adc, radar=radar, engine=engine)
    assert f"points{len(found.points)}" in Reader(found._repr_html_()).text
    assert pixels(found._repr_html_()).shape == pixels(frame._repr_html_()).shape
    axes = found.plot()
    np.testing.assert_array_equal(axes.images[0].get_array(), frame.plot().images[0].get_array())


def test_an_empty_map_is_shown(radar, engine):
    """Samples of zeros have no level in dB."""
    found = catseye.process(np.zeros(radar.shape, np.complex64), radar=radar, engine=engine)
    assert "points0" in Reader(found._repr_html_()).text
    assert np.all(np.isfinite(found.plot().images[0].get_array()))


def test_a_scene_shows_itself(hostile):
    shown = hostile._repr_html_()
    read = Reader(shown)
    # Markup in a name is text: a browser sees no element of it, and the name as it is.
    assert not {"script", "b"} & {tag for tag, _ in read.elements[3:]}
    assert "<script>" not in shown and HOSTILE in read.text and "<b>car</b>" in read.text
    assert pixels(shown).shape[0] > 100
    body = catseye.reflector("type1", width_m=0.16)
    assert "0.16" in Reader(body._repr_html_()).text
    assert not np.array_equal(pixels(body._repr_html_()), pixels(catseye.reflector("sphere")._repr_html_()))
    empty = Reader(catseye.Scene()._repr_html_())
    assert "objects0" in empty.text and "img" not in [tag for tag, _ in empty.elements]


def test_a_name_in_a_frame_is_text(scenario, hostile, engine):
    frame = next(catseye.simulate(scenario, scene=hostile, engine=engine))
    assert "<b>car</b>" in frame.points["class"]
    shown = frame._repr_html_()
    assert "<b>car" not in shown and "<b>car</b>" in Reader(shown).text


def test_cross_sections_show_themselves(table, engine):
    text = Reader(table._repr_html_()).text
    assert f"{table.vv_dbsm.max():.2f} dBsm at azimuth 0°, elevation 0°" in text and "-30 to 30 deg, 61 values" in text
    assert pixels(table._repr_html_()).shape[0] > 100
    # One direction is no curve.
    alone = Reader(catseye.rcs("plate", engine=engine)._repr_html_())
    assert "largest VV" in alone.text and "img" not in [tag for tag, _ in alone.elements]
    with pytest.warns(UserWarning, match="size: "):
        small = catseye.rcs("plate:width_m=0.001,height_m=0.001", engine=engine)
    assert small.warnings[0] in Reader(small._repr_html_()).text


def test_a_page_stands_in_a_cell(hostile, monkeypatch, tmp_path):
    page = hostile.view(output=tmp_path / "page.html")
    text = page.path.read_text(encoding="utf-8")
    assert page.path == tmp_path / "page.html" and page.bytes == len(text.encode()) and page.frames == 0 and page.beside is None
    names = {o["name"] for o in page_data(text)["scene"]["objects"]}
    assert names == {HOSTILE} or HOSTILE in names
    frame = Reader(page._repr_html_()).one("iframe")
    # A browser hands the frame the page itself, whose scripts reach nothing of the notebook.
    assert frame["srcdoc"] == text
    assert "allow-same-origin" not in frame["sandbox"] and "allow-scripts" in frame["sandbox"]
    assert [tag for tag, _ in Reader(page._repr_html_()).elements] == ["iframe"]
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda address: not opened.append(address))
    page.open()
    assert opened == [(tmp_path / "page.html").as_uri()]
    monkeypatch.setattr("webbrowser.open", lambda address: False)
    with pytest.raises(catseye.Failed, match="page.html"):
        page.open()
    with pytest.raises(catseye.BadInput, match="page.html"):
        hostile.view(output=page.path)
    assert hostile.view(output=page.path, force=True).bytes == page.bytes


def test_a_page_without_a_place_lies_in_a_temporary_folder(table):
    first, second = table.view(), table.view()
    assert first.path != second.path and first.path.read_bytes() == second.path.read_bytes()


def test_a_long_page_is_no_part_of_a_notebook(tmp_path):
    page = catseye.View(tmp_path / "<run>.html", bytes=100 << 20, frames=7, beside=tmp_path / "frames")
    read = Reader(page._repr_html_())
    assert "iframe" not in [tag for tag, _ in read.elements]
    assert "<run>.html" in read.text and "7 frames beside it" in read.text


def test_pages_of_cross_sections_hold_the_levels(table, tmp_path, engine):
    other = catseye.rcs("plate:width_m=0.2,height_m=0.05", azimuth_deg=[0.0, 1.0], bistatic_azimuth_deg=[3.0], engine=engine)
    page = catseye.view([table, other], output=tmp_path / "page.html")
    drawn = page_data(page.path.read_text(encoding="utf-8"))
    assert drawn["scene"] is None
    drawn = drawn["rcs"]
    assert [t["name"] for t in drawn] == [table.target, other.target]
    for result, shown in zip((table, other), drawn):
        number = lambda name: np.frombuffer(base64.b64decode(shown[name]["f64"]))
        for name in ("vv_dbsm", "vh_dbsm", "hv_dbsm", "hh_dbsm"):
            np.testing.assert_array_equal(number(name), getattr(result, name).ravel())
        np.testing.assert_array_equal(number("vv_re_m"), result.s[..., 0, 0].real.ravel())
    rows = np.meshgrid(table.frequency_hz, table.elevation_deg, table.azimuth_deg, indexing="ij")
    for name, axis in zip(("frequency_hz", "elevation_deg", "azimuth_deg"), rows):
        np.testing.assert_array_equal(np.frombuffer(base64.b64decode(drawn[0][name]["f64"])), axis.ravel())


def test_a_target_stands_beside_its_results(table, tmp_path):
    plate = catseye.reflector("plate:width_m=0.1,height_m=0.05")
    beside = page_data(catseye.view([plate, table], output=tmp_path / "page.html").path.read_text(encoding="utf-8"))
    alone = page_data(plate.view(output=tmp_path / "alone.html").path.read_text(encoding="utf-8"))
    assert beside["scene"] == alone["scene"] and len(beside["rcs"]) == 1


def test_a_dataset_has_a_page(data, tmp_path):
    page = catseye.view(data, output=tmp_path / "page.html")
    assert page.frames == len(catseye.Dataset(data)) == 12


def test_pages_are_those_of_the_program(scenario, tmp_path):
    program = os.environ.get("CATSEYE_PROGRAM") or pytest.skip("the program was not built beside the package")
    run = lambda *words: subprocess.run([program, *map(str, words), "--quiet"], check=True)
    (tmp_path / "scenario.toml").write_text('name = "road"\nseed = 1\nradar = "demo77"\n[[point]]\nposition_m = [30, 4, 0]\nrcs_dbsm = 15\n[frames]\ncount = 2\n')
    run("simulate", tmp_path / "scenario.toml", "-o", tmp_path / "run", "--device", "cpu")
    run("rcs", "plate:width_m=0.1,height_m=0.05", "--azimuth-deg", "-10:10:1", "-o", tmp_path / "plate.csv", "--device", "cpu")
    run("scene", Path(__file__).resolve().parents[2] / "scenes/road/road_lane_3m.toml", "-o", tmp_path / "road.glb")
    asked = []
    run("reflector", "plate", "--width-m", 0.1, "--height-m", 0.05, "-o", tmp_path / "plate.glb")
    for thing in ("run", "run/frame_000001", "plate.csv", "road.glb", "plate.glb plate.csv"):
        paths = [tmp_path / part for part in thing.split()]
        run("view", *paths, "-o", tmp_path / "theirs.html", "--force")
        page = catseye.view(paths if len(paths) > 1 else paths[0], output=tmp_path / "ours.html", force=True, progress=lambda done, all: asked.append((done, all)))
        assert page.path.read_bytes() == (tmp_path / "theirs.html").read_bytes(), thing
        assert page.frames == {"run": 2, "run/frame_000001": 1}.get(thing, 0)
    assert (2, 2) in asked


def test_what_no_page_can_show_is_refused(table, tmp_path):
    (tmp_path / "notes.txt").write_text("nothing")
    (tmp_path / "empty").mkdir()
    several = [tmp_path / "notes.txt", tmp_path / "other.txt"]
    for thing, problem in [(tmp_path / "empty", "no manifest.json"), (several[0], "notes.txt"), (several, "together"), ([], "nothing to show"), ("nosuch", "nosuch")]:
        with pytest.raises(catseye.BadInput, match=problem):
            catseye.view(thing, output=tmp_path / "page.html")
    with pytest.raises(catseye.BadInput, match="html"):
        table.view(output=tmp_path / "page.png")
    for thing in (3, [table, "plate"], [table, catseye.Scene()]):
        with pytest.raises(TypeError, match="expected a path"):
            catseye.view(thing, output=tmp_path / "page.html")
    assert not (tmp_path / "page.html").exists()


def test_a_map_is_plotted_in_its_cells(frame):
    axes = frame.plot()
    image, power = axes.images[0], frame.range_doppler.astype(float)
    shown, levels = np.asarray(image.get_array()), 10 * np.log10(power) + 30
    above = levels > image.norm.vmin
    np.testing.assert_allclose(shown[above], levels[above], rtol=1e-12)
    assert np.all(shown[~above] == image.norm.vmin) and image.norm.vmax == levels.max() and image.cmap.name == "viridis"
    # The middles of the cells lie on the axes of the frame.
    left, right, bottom, top = image.get_extent()
    middles = lambda a, b, n: a + (np.arange(n) + 0.5) * (b - a) / n
    np.testing.assert_allclose(middles(left, right, len(frame.range_m)), frame.range_m, atol=1e-9)
    np.testing.assert_allclose(middles(bottom, top, len(frame.range_rate_mps)), frame.range_rate_mps, atol=1e-9)
    np.testing.assert_allclose(axes.collections[0].get_offsets()[:, 0], frame.points["range_m"])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("range (m)", "range rate (m/s)")
    assert image.colorbar.ax.get_ylabel() == "power (dBm)"
    assert len(frame.plot(points=False).collections) == 0
    assert frame.plot(ax=axes) is axes


def test_range_rates_fold_into_the_map():
    axis = np.arange(-4, 4) * 0.5
    rates = np.array([-2.25, -2.0, 1.74, 1.8, 2.0, 5.5, -6.1])
    expected = [-2.25, -2.0, 1.74, -2.2, -2.0, 1.5, -2.1]
    np.testing.assert_allclose(_plot.folded(rates, axis), expected, atol=1e-12)
    np.testing.assert_array_equal(_plot.folded([7.0], [0.0]), [7.0])


def test_boxes_stand_in_the_radars_frame():
    """A radar that looks to the left sees a body ahead of it in the world on its right."""
    quarter = [0, 0, np.sqrt(0.5), np.sqrt(0.5)]
    seen = _plot.footprints([[10, 0, 1]], [[4, 2, 2]], [[0, 0, 0, 1]], [0, 0, 0], quarter)
    np.testing.assert_allclose(seen[0].mean(axis=0), [0, -10], atol=1e-12)
    np.testing.assert_allclose(np.ptp(seen[0], axis=0), [2, 4], atol=1e-12)
    turned = _plot.footprints([[10, 0, 1]], [[4, 2, 2]], [quarter], [2, 0, 0], [0, 0, 0, 1])
    np.testing.assert_allclose(turned[0].mean(axis=0), [8, 0], atol=1e-12)
    np.testing.assert_allclose(np.ptp(turned[0], axis=0), [2, 4], atol=1e-12)


def test_a_view_from_above(frame):
    axes = frame.plot("birds_eye")
    places = axes.collections[0].get_offsets()
    np.testing.assert_allclose(places, np.column_stack([frame.points["y_m"], frame.points["x_m"]]))
    np.testing.assert_array_equal(axes.collections[0].get_array(), frame.points["range_rate_mps"])
    # Left is left, and a metre is as long both ways.
    assert axes.get_xlim()[0] > 0 > axes.get_xlim()[1] and axes.get_aspect() == 1 and axes.collections[0].cmap.name == "cividis"
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("y left (m)", "x forward (m)")
    # The point target stands where the truth says.
    box = frame.truth["boxes"][0]["centre_m"]
    marks = [line.get_xydata()[0] for line in axes.get_lines() if line.get_marker() == "D"]
    assert frame.truth["boxes"][0]["size_m"] == [0, 0, 0]
    np.testing.assert_allclose(marks, [[box[1] - frame.position_m[1], box[0] - frame.position_m[0]]])
    with pytest.raises(catseye.BadInput, match="allowed: range_doppler, birds_eye"):
        frame.plot("above")


def test_cuts_of_a_table(table):
    axes = table.plot()
    assert axes.get_xlabel() == "azimuth (deg), positive left" and axes.get_ylabel() == "RCS (dBsm)"
    for line, levels, label in zip(axes.get_lines(), table.vv_dbsm[0], ["elevation 0°", "elevation 2°"], strict=True):
        np.testing.assert_array_equal(line.get_xdata(), table.azimuth_deg)
        np.testing.assert_array_equal(line.get_ydata(), levels)
        assert line.get_label() == label
    one = table.plot(["hh", "vh"], at={"elevation_deg": 2.0})
    np.testing.assert_array_equal(one.get_lines()[0].get_ydata(), table.hh_dbsm[0, 1])
    assert [line.get_label() for line in one.get_lines()] == ["HH", "VH"]
    round_about = table.plot(["vv", "circular"], at={"elevation_deg": 2.0})
    assert [line.get_label() for line in round_about.get_lines()] == ["VV", "RR", "RL", "LR", "LL"]
    right_left = 4 * np.pi * np.abs(table.in_polarisation("circular")[0, 1, :, 0, 1]) ** 2
    np.testing.assert_allclose(round_about.get_lines()[2].get_ydata(), np.maximum(10 * np.log10(right_left), -400))
    # Cross-polarisation that symmetry forbids does not stretch the axis.
    assert one.get_ylim()[1] - one.get_ylim()[0] < 70
    up = table.plot(over="elevation_deg", at={"azimuth_deg": 0})
    np.testing.assert_array_equal(up.get_lines()[0].get_ydata(), table.vv_dbsm[0, :, 30])


def test_cuts_on_a_disc(table):
    import matplotlib.pyplot as plt

    axes = table.plot(polar=True, at={"elevation_deg": 0})
    np.testing.assert_allclose(axes.get_lines()[0].get_xdata(), np.radians(table.azimuth_deg))
    # 0 is up, and positive azimuth turns to the left.
    assert axes.name == "polar" and axes.get_theta_offset() == pytest.approx(np.pi / 2) and axes.get_theta_direction() == 1
    _, flat = plt.subplots()
    with pytest.raises(catseye.BadInput, match="polar Axes"):
        table.plot(polar=True, ax=flat)


@pytest.mark.parametrize(
    "keywords, parts",
    [
        ({"polarisation": "xx"}, ("polarisation = xx", "vv, vh, hv, hh")),
        ({"over": "range_m"}, ("over = range_m", "azimuth_deg")),
        ({"over": "frequency_hz", "polar": True, "at": {"azimuth_deg": 0}}, ("polar", "an angle")),
        ({"at": {"elevation_deg": 1}}, ("at.elevation_deg = 1", "0, 2")),
        ({"at": {"azimuth_deg": 1}}, ("at = azimuth_deg", "elevation_deg")),
        ({"over": "elevation_deg"}, ("61 curves", "up to 10", '"azimuth_deg": -30')),
    ],
)
def test_cuts_that_are_none(table, keywords, parts):
    with pytest.raises(catseye.BadInput) as e:
        table.plot(**keywords)
    for part in parts:
        assert part in str(e.value), str(e.value)


def test_frames_of_a_dataset_are_plotted(data):
    dataset = catseye.Dataset(data, split="train")
    sample = dataset[1]
    axes = dataset.plot(1)
    row = sample["radars"][0]
    levels = 10 * np.log10(sample["range_doppler"].astype(float)) + 30
    image = axes.images[0]
    np.testing.assert_allclose(image.get_array(), np.maximum(levels, image.norm.vmin), rtol=1e-12)
    assert image.get_extent()[0] == pytest.approx(row["first_range_m"] - row["range_bin_m"] / 2)
    assert image.get_extent()[3] == pytest.approx(row["first_range_rate_mps"] + (len(levels) - 0.5) * row["range_rate_bin_mps"])
    np.testing.assert_allclose(axes.collections[0].get_offsets()[:, 0], sample["points"]["range_m"])
    assert axes.get_title() == f"frame {dataset.frames[1]}"
    above = dataset.plot(1, "birds_eye", ax=axes.figure.add_subplot(), colorbar=False)
    np.testing.assert_allclose(above.collections[0].get_offsets()[:, 1], sample["points"]["x_m"])
    # Cars and markers are drawn, the road is not.
    boxes = sample["boxes"]
    drawn = boxes[(boxes["part"] == "") & ~np.isin(boxes["class"].astype(str), ["road", "lane_line"])]
    ahead = drawn[drawn["x_m"] > row["x_m"]]
    assert 0 < len(above.patches) <= len(drawn) and len(above.patches) >= len(ahead[ahead["x_m"] < row["x_m"] + 20])
    with pytest.raises(IndexError, match="frame 99 of 6"):
        dataset.plot(99)
    with pytest.raises(catseye.BadInput, match="allowed: tiny"):
        dataset.plot(0, radar="rear")


def test_a_name_is_no_formula(frame, table):
    assert _plot._plain("a$b$") == r"a\$b\$"
    axes = table.plot(at={"elevation_deg": 0})
    axes.set_title(_plot._short(HOSTILE))
    axes.figure.canvas.draw()


def test_matplotlib_is_asked_for_by_plots_alone(frame, table, monkeypatch):
    code = "import catseye, sys; catseye.rcs('plate', engine='cpu')._repr_html_(); assert 'matplotlib' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    for plot in (frame.plot, table.plot):
        with pytest.raises(ImportError, match="pip install matplotlib"):
            plot()

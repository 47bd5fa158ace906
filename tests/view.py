#!/usr/bin/env python3
"""Opens pages of `catseye view` in a real headless Chromium and looks at what they show.

tests/view.py PROGRAM [--write]     --write makes the pictures anew to which the scenes are compared
CATSEYE_VIEW_PARTS="a_run studies" runs these parts alone; CATSEYE_LOOK=DIR saves pictures of new pages for eyes.
Needs the package playwright, and Chromium as `chromium` or in CATSEYE_CHROMIUM.
"""

import csv
import http.client
import io
import math
import json
import math
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

HERE = Path(__file__).resolve().parent
PICTURES = HERE / "data" / "view"
# A software renderer, so that pictures do not depend on a GPU.
FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
# Mean difference of a picture's values, 0 to 255: other versions of the browser smooth edges otherwise.
MOST_DIFFERENT = 3.0
HOSTILE = "<img src=x onerror=window.broken=1></script><script>window.broken=1</script>"

RUN = """
name = "NAME"
seed = 3
radar = "demo77"
[scene]
builtin = "marked-road"
[ego]
position_m = [0, -1.75, 0]
speed_mps = 10
[[point]]
name = "NAME"
class = "car"
position_m = [20, 3, 0.5]
rcs_dbsm = 20
[frames]
count = FRAMES
interval_s = 0.1
[output]
adc = false
plots = false
scene = SCENE
return_places = true
cfar_threshold = true
angle_spectra = true
"""

program = str(Path(sys.argv[1]).resolve())
write = "--write" in sys.argv
failures = []


def check(what, good, told=""):
    print(f"{'ok  ' if good else 'FAIL'} {what}{'' if good else f': {told}'}", flush=True)
    if not good:
        failures.append(what)


def run(*arguments, expect=0):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode != expect:
        raise SystemExit(f"{arguments}: exit {done.returncode}, {done.stderr}")
    return done


def simulate(folder, frames=1, scene=True, name="a road"):
    text = RUN.replace("NAME", name).replace("FRAMES", str(frames)).replace("SCENE", str(scene).lower())
    file = folder.with_suffix(".toml")
    file.write_text(text)
    run("simulate", file, "-o", folder, "--quiet", "--device", "cpu")
    return folder


def wait(page, expression, seconds=30):
    """Waits until an expression holds. Playwright's own way has the page read text as script, which the page forbids."""
    end = time.monotonic() + seconds
    while not page.evaluate(expression):
        if time.monotonic() > end:
            raise SystemExit(f"waited {seconds} s for {expression}")
        time.sleep(0.05)


class Opened:
    """A page in the browser, with what it complained of."""

    def __init__(self, browser, file, size=(1366, 768)):
        self.page = browser.new_page(viewport={"width": size[0], "height": size[1]}, color_scheme="light")
        self.told = []
        self.page.on("console", lambda m: self.told.append(m.text) if m.type in ("error", "warning") else None)
        self.page.on("pageerror", lambda e: self.told.append(str(e)))
        # Nothing may be asked of the network, and of a server only the page itself.
        url = file if isinstance(file, str) else file.resolve().as_uri()
        own = ("file:", "data:", "blob:") + ((url,) if isinstance(file, str) else ())
        self.page.on("request", lambda r: None if r.url.startswith(own) else self.told.append(f"asks for {r.url}"))
        began = time.monotonic()
        self.page.goto(url)
        wait(self.page, "window.catseye?.ready", seconds=60)
        self.seconds = time.monotonic() - began

    def scene(self):
        """The scene's canvas at a tenth of its pixels."""
        png = self.page.locator(".scene canvas").screenshot()
        return Image.open(io.BytesIO(png)).convert("RGB").resize((160, 120), Image.Resampling.BOX)

    def quiet(self, what):
        # SwiftShader says of itself that it is slow.
        told = [t for t in self.told if "GPU stall" not in t and "GroupMarkerNotSet" not in t]
        check(f"{what}: nothing is complained of", not told, told[:3])


# Columns of points.csv that are words.
WORDS = ("class", "ambiguity", "angle_ambiguity", "other_angles_deg")


def like(name, picture):
    file = PICTURES / f"{name}.png"
    if write:
        PICTURES.mkdir(parents=True, exist_ok=True)
        picture.save(file, optimize=True)
    want = Image.open(file).convert("RGB")
    pairs = zip(picture.tobytes(), want.tobytes())
    mean = sum(abs(a - b) for a, b in pairs) / len(want.tobytes())
    check(f"{name}: the scene looks as it did", mean < MOST_DIFFERENT, f"differs by {mean:.2f} on average")
    # An empty picture would look alike to an empty one.
    check(f"{name}: the scene has something in it", len(picture.getcolors(160 * 120)) > 5)


def a_run(browser, room):
    """Every number of every point is that of points.csv, by each way to choose it."""
    folder = simulate(room / "run", frames=3)
    run("view", folder, "-o", room / "run.html", "--quiet")
    o = Opened(browser, room / "run.html")
    page = o.page
    for index in range(3):
        page.evaluate(f"catseye.view.go({index})")
        wait(page, f"catseye.view.frame.index === {index}")
        with open(folder / f"frame_{index:06d}" / "points.csv", newline="") as f:
            rows = list(csv.DictReader(f))
        check(f"frame {index}: all points are there", page.evaluate("catseye.view.count") == len(rows))
        wrong = []
        for i, row in enumerate(rows):
            page.evaluate(f"catseye.view.choose({i})")
            shown = dict(page.evaluate(
                "[...document.querySelectorAll('.columns dt')].map((t) => [t.textContent, t.nextSibling.textContent])"))
            for name, cell in row.items():
                told = shown[name].split(" ")[0]
                same = told == "–" if cell == "" else shown[name].removesuffix(" °") == cell if name in WORDS else float(told) == float(cell)
                if not same:
                    wrong.append((i, name, cell, shown[name]))
        check(f"frame {index}: numbers are those of points.csv", not wrong, wrong[:3])
    # A click on the strongest point in the scene chooses a point that is drawn there.
    page.evaluate("catseye.view.choose(null), catseye.view.go(0)")
    wait(page, "catseye.view.frame.index === 0")
    page.wait_for_timeout(300)
    x, y = page.evaluate("catseye.view.scene.project([...catseye.view.positions.subarray(0, 3)])")[:2]
    box = page.locator(".scene canvas").bounding_box()
    page.mouse.click(box["x"] + x, box["y"] + y)
    near = page.evaluate("(([a, b]) => { const v = catseye.view, i = v.chosen; if (i == null) return null; const p = v.scene.project([...v.positions.subarray(3 * i, 3 * i + 3)]); return Math.hypot(p[0] - a, p[1] - b); })", [x, y])
    check("a click chooses the point under it", near is not None and near < 12, near)
    told = page.locator(".echoes li").all_inner_texts()
    check("why it is there is told by echoes from radar to radar", bool(told) and all("radar →" in t and "dBm" in t for t in told), told[:2])
    check("their ways are drawn", page.evaluate("catseye.view.scene.layers.paths.children.length") == len(told))
    # The map's level under the pointer is the file's, to the hundredth of a dB that it shows.
    page.keyboard.press("Escape")
    page.keyboard.press("1")
    cell = page.locator(".map canvas").bounding_box()
    page.mouse.move(cell["x"] + 0.5 * cell["width"], cell["y"] + 0.5 * cell["height"])
    note = page.locator(".map .note").inner_text()
    check("the map tells level and threshold", "dBm, threshold" in note, note)
    page.keyboard.press("ArrowRight")
    wait(page, "catseye.view.frame.index === 1")
    check("keys step through frames", page.locator(".clock").inner_text().startswith("frame 1"))
    page.evaluate("catseye.view.go(0)")
    wait(page, "catseye.view.frame.index === 0")
    page.keyboard.press("r")
    page.wait_for_timeout(500)
    like("run", o.scene())
    page.keyboard.press("t")
    page.wait_for_timeout(500)
    like("run_above", o.scene())
    # How fast it turns, on this renderer of the CPU.
    frames = page.evaluate("""async () => { const s = catseye.view.scene, t = performance.now(); let n = 0;
        while (performance.now() - t < 2000) { s.camera.position.x += 0.01; s.draw(); await new Promise(requestAnimationFrame); n++; } return n / 2; }""")
    print(f"     opens in {o.seconds:.2f} s, {(room / 'run.html').stat().st_size / 2**20:.2f} MiB; {frames:.0f} pictures a second on SwiftShader")
    o.quiet("run")
    sticks_out(page, [(1366, 768), (1920, 1080), (800, 900)])
    page.close()


def names_are_text(browser, room):
    folder = simulate(room / "hostile", name=HOSTILE)
    run("view", folder, "-o", room / "hostile.html", "--quiet")
    o = Opened(browser, room / "hostile.html")
    check("markup in names is shown as text", HOSTILE in o.page.locator("h1").inner_text())
    o.page.evaluate("for (let i = 0; i < catseye.view.count; i++) catseye.view.choose(i)")
    check("no name is run", o.page.evaluate("window.broken === undefined && document.querySelectorAll('img').length === 0"))
    o.quiet("hostile names")
    o.page.close()


def frames_beside(browser, room):
    """Frames beside a page come when they are wanted; one that is gone is told of, and the page goes on."""
    folder = simulate(room / "many", frames=12, scene=False)
    run("view", folder, "-o", room / "many.html", "--inline-mib", "0.5", "--quiet")
    beside = room / "many_frames"
    check("frames lie beside the page", len(list(beside.glob("*.js"))) == 12)
    o = Opened(browser, room / "many.html")
    o.page.evaluate("catseye.view.go(11)")
    wait(o.page, "catseye.view.frame.index === 11")
    check("the last frame comes", o.page.evaluate("catseye.view.count > 0"))
    check("boxes stand for a scene that was not kept", o.page.evaluate("catseye.view.scene.layers.boxes.children.length > 50"))
    o.quiet("frames beside")
    (beside / "000005.js").unlink()
    o.page.evaluate("catseye.view.go(5)")
    o.page.wait_for_selector(".details .missing")
    check("a frame that is gone is told of", "many_frames" in o.page.locator(".details .missing").inner_text())
    o.page.evaluate("catseye.view.go(6)")
    wait(o.page, "catseye.view.frame.index === 6")
    o.page.close()


def cross_sections(browser, room):
    a, b = room / "a.csv", room / "b.csv"
    run("rcs", "plate:width_m=0.1,height_m=0.1", "--azimuth-deg=-60:60:1", "--elevation-deg=-2:2:1", "-o", a, "--quiet", "--device", "cpu")
    run("rcs", "trihedral:leg_m=0.1", "--azimuth-deg=-60:60:2", "-o", b, "--quiet", "--device", "cpu")
    run("view", a, b, "-o", room / "rcs.html", "--quiet")
    o = Opened(browser, room / "rcs.html")
    o.page.evaluate("catseye.view.fixed.elevation_deg = 2, catseye.view.update()")
    with open(a, newline="") as f:
        rows = [r for r in csv.DictReader(line for line in f if not line.startswith("#")) if float(r["elevation_deg"]) == 0]
    want = [[float(r["azimuth_deg"]), float(r["vv_dbsm"])] for r in rows]
    got = o.page.evaluate("catseye.view.cuts[0].map(([x, y]) => [x, Number.isFinite(y) ? y : '-inf'])")
    check("a cut is the table's", [[x, float(y)] for x, y in got] == want)
    check("two tables lie over each other", o.page.evaluate("catseye.view.cuts.length") == 2)
    check("the map is there", o.page.locator(".map canvas").is_visible())
    o.page.set_input_files("input[type=file]", str(b))
    wait(o.page, "catseye.view.tables.length === 3")
    wrong = room / "wrong.csv"
    wrong.write_text("angle,level\n0,1\n")
    o.page.set_input_files("input[type=file]", str(wrong))
    wait(o.page, "document.body.innerText.includes('has no column')")
    check("a table that is none is told of and not taken", o.page.evaluate("catseye.view.tables.length") == 3)
    o.quiet("cross sections")
    o.page.close()


def an_image(browser, room):
    """The flash of a sphere lies on its front, by so much as the sphere is thick; and a target turns with what is read."""
    table = room / "sphere.csv"
    run("rcs", "sphere:radius_m=0.06", "--frequency-hz=74e9:80e9:0.2e9", "--azimuth-deg=-6:6:0.5", "-o", table, "--quiet", "--device", "cpu")
    run("view", "sphere:radius_m=0.06", table, "-o", room / "sphere.html", "--quiet")
    o = Opened(browser, room / "sphere.html")
    x, y, level, cell = o.page.evaluate("""() => { const v = catseye.view; v.shown = 'image'; v.draw_map(); const m = v.map.map;
        let best = [0, 0, -Infinity]; for (let r = 0; r < m.rows; r++) for (let c = 0; c < m.columns; c++) if (m.at(r, c) > best[2]) best = [r, c, m.at(r, c)];
        return [m.y.first + best[0] * m.y.step, m.x.first + best[1] * m.x.step, best[2], m.y.step]; }""")
    check("an image puts a sphere's flash on its front", abs(x - 0.06) < 0.5 * cell + 0.005 and abs(y) < 0.02, (x, y, cell))
    # Its cross section is that of a sphere, pi r^2.
    check("an image has the level of the flash", abs(level - (-19.47)) < 1.0, level)
    o.page.evaluate("catseye.view.turn(90, 0)")
    place = o.page.evaluate("catseye.view.body.camera.position.toArray()")
    check("the target is seen from where the radar stands", abs(place[0]) < 0.05 and place[1] > 0.1, place)
    o.quiet("image")
    o.page.close()


def a_dataset(browser, room):
    run("examples", "tiny", "-o", room / "recipe", "--quiet")
    recipe = next((room / "recipe").rglob("tiny.toml"))
    run("dataset", recipe, "-o", room / "data", "--quiet", "--device", "cpu")
    run("view", room / "data", "-o", room / "data.html", "--quiet")
    o = Opened(browser, room / "data.html")
    o.page.keyboard.press("ArrowRight")
    wait(o.page, "catseye.view.frame.index === 1")
    check("a dataset's frames have their points", o.page.evaluate("catseye.view.count") > 0)
    told = o.page.locator(".clock").inner_text()
    check("a dataset's frames tell scene and split", "scene" in told and any(s in told for s in ("train", "validation", "test")), told)
    o.quiet("dataset")
    o.page.close()


def values_of(table):
    with open(table, newline="") as f:
        return list(csv.DictReader(line for line in f if not line.startswith("#")))


def a_design(browser, room):
    """The physics of the page is that of the program as it is now, and what it saves is read by the program."""
    spec = "type1:width_m=0.16,height_m=0.004"
    run("view", spec, "-o", room / "type1.html", "--quiet")
    o = Opened(browser, room / "type1.html")
    page = o.page
    print(f"     design page {(room / 'type1.html').stat().st_size / 2**20:.2f} MiB, ready in {o.seconds:.2f} s")
    page.wait_for_timeout(500)
    like("reflector", o.scene())
    for kind, more in [("type1", "width_m=0.16,height_m=0.004"), ("trihedral", "leg_m=0.1"), ("sphere", "radius_m=0.03"), ("dihedral", "width_m=0.08,height_m=0.05"), ("manhole-round", ""), ("type1", "fill=polypropylene,height_m=0.016")]:
        one = f"{kind}:{more}" if more else kind
        for ptd in (False, True):
            state = "Object.assign(v.parse(spec), {from: -20, to: 20, steps: 41, elevation: 3, bounces: 2, ptd})"
            told = page.evaluate("([spec, ptd]) => { const v = catseye.view; v.state = STATE; v.update(); return v.done.then(() => v.told.textContent); }".replace("STATE", state), [one, ptd])
            if told:
                other = run("rcs", one, "--azimuth-deg=0", "--diffraction", "ptd" if ptd else "none", "-o", room / "none.csv", "--quiet", "--device", "cpu", "--precision", "f64", "--force", expect=2)
                check(f"{one}{' with edges' if ptd else ''} is refused with the program's words", told.split(";")[0] in other.stderr or other.stderr.strip().endswith(told), (told, other.stderr))
                continue
            (room / "page.csv").write_text(page.evaluate("catseye.view.csv()"))
            run("rcs", one, "--azimuth-deg=-20:20:1", "--elevation-deg=3", "--bounces=2", "--diffraction", "ptd" if ptd else "none", "-o", room / "own.csv", "--quiet", "--device", "cpu", "--precision", "f64", "--force")
            pairs = list(zip(values_of(room / "page.csv"), values_of(room / "own.csv"), strict=True))
            scale = max(float(b[k]) ** 2 for _, b in pairs for k in b if k.endswith("_re_m") or k.endswith("_im_m")) ** 0.5
            apart = max(abs(float(a[k]) - float(b[k])) for a, b in pairs for k in b if k.endswith("_m"))
            check(f"{one}{' with edges' if ptd else ''}: the page's S is the program's", apart < 1e-6 * scale, f"{apart} of {scale}: run scripts/page-module")
    page.evaluate("s => { const v = catseye.view; v.state = v.parse(s); v.make_controls(); v.update(); return v.done; }", spec)
    before = page.evaluate("catseye.view.levels[0][225]")
    field = page.get_by_label("height_m", exact=True)
    field.fill("0.008")
    field.press("Enter")
    page.evaluate("catseye.view.done")
    after = page.evaluate("catseye.view.levels[0][225]")
    check("a value changes the curve", abs(after - before) > 1.0, (before, after))
    field.fill("-1")
    field.press("Enter")
    told = page.locator(".told").inner_text()
    check("a bad value tells what is allowed and changes nothing", "height_m" in told and "allowed" in told and page.evaluate("catseye.view.levels[0][225]") == after, told)
    page.get_by_title("Undo (Ctrl+Z)").click()
    page.evaluate("catseye.view.done")
    check("undo takes it back", page.evaluate("catseye.view.levels[0][225]") == before)
    # Spheres take some 0.1 s a direction: the page answers between slices, and a new value ends the cut before it is complete.
    gap = page.evaluate("""async () => { const v = catseye.view; v.state = v.parse("sphere"); v.update(); const gaps = []; let t = performance.now();
        for (let i = 0; i < 20; i++) { await new Promise((go) => setTimeout(go)); gaps.push(performance.now() - t); t = performance.now(); }
        return [v.cut.at, v.cut.x.length, v.levels[0].length, Math.max(...gaps)]; }""")
    check("a long cut is drawn while it is computed", 0 < gap[2] <= gap[0] < gap[1], gap)
    print(f"     sphere: {gap[0]} of {gap[1]} directions, longest time without an answer {gap[3]:.0f} ms")
    page.evaluate("s => { const v = catseye.view; v.state = v.parse(s); v.make_controls(); v.update(); return v.done; }", spec)
    check("a new value ends the long cut", page.evaluate("catseye.view.levels[0].length") == gap[1] and page.evaluate("catseye.view.levels[0][225]") == before)
    # From a slider's step to the drawn curve.
    ms = page.evaluate("""async () => { const s = document.querySelector('[aria-label="width_m by a slider"]'), all = [];
        for (let i = 0; i < 20; i++) { const t = performance.now(); s.value = 400 + 10 * i; s.dispatchEvent(new Event('input')); await new Promise(requestAnimationFrame); all.push(performance.now() - t); }
        return all.sort((a, b) => a - b)[10]; }""")
    print(f"     slider to curve, {page.evaluate('catseye.view.state.steps')} directions: median {ms:.0f} ms, of it the physics {page.evaluate('catseye.view.ms'):.1f} ms")
    with page.expect_download() as saved:
        page.get_by_title("The reflector with its radar material").click()
    saved.value.save_as(room / "saved.glb")
    run("rcs", room / "saved.glb", "--azimuth-deg=-45:45:0.2", "-o", room / "saved.csv", "--quiet", "--device", "cpu", "--precision", "f64")
    levels = page.evaluate("catseye.view.levels[0]")
    # Places in the file are f32, which turns phases a little.
    apart = max(abs(float(r["vv_dbsm"]) - v) for r, v in zip(values_of(room / "saved.csv"), levels, strict=True) if v is not None and v > max(levels) - 30)
    check("the saved GLB has the curve's levels", apart < 0.05, apart)
    (room / "saved.toml").write_text(page.evaluate("catseye.view.toml()"))
    run("study", room / "saved.toml", "-o", room / "study", "--quiet", "--device", "cpu")
    rows = values_of(next((room / "study").glob("*.csv")))
    apart = max(abs(float(r["rcs_dbsm"]) - v) for r, v in zip(rows, levels, strict=True) if v is not None and v > max(levels) - 30)
    check("the saved TOML is a study of that curve", apart < 0.02, apart)
    o.quiet("design")
    page.close()


STUDY = """
name = "sweep"
title = "TITLE"
reference = "REFERENCE"
quantities = ["rcs_dbsm", "view_range_m"]
[set]
radar_height_m = 0.5
lateral_m = 0
frequency_hz = 77e9
polarisation = "vv"
target = "type1:width_m=0.16"
[[sweep]]
parameter = "longitudinal_m"
start = 5
stop = 25
step = 1
[[sweep]]
parameter = "target.height_m"
values = [0.004, 0.008]
names = ["H 4 mm", "NAMED"]
[[sweep]]
parameter = "ground"
values = ["none", "pec"]
[[fact]]
text = "at 10 m"
document = 0
unit = "dBsm"
of = "value"
at = { "longitudinal_m" = 10, "target.height_m" = 0.004, "ground" = "none" }
why = "NAMED"
[[fact]]
text = "distance"
document = 10
unit = "m"
of = "value"
quantity = "view_range_m"
at = { "longitudinal_m" = 10, "target.height_m" = 0.004, "ground" = "none" }
[[fact]]
text = "words"
document = "much"
unit = "dB"
of = "maximum"
"""
SEARCH = """
name = "search"
title = "A search"
quantities = ["rcs_dbsm"]
[set]
azimuth_deg = 0
range_m = inf
frequency_hz = 77e9
polarisation = "vv"
target = "type1"
[[sweep]]
parameter = "elevation_deg"
values = [1, 3]
[search]
goal = "least-rcs"
front = "target.height_m"
front_values = [0.004, 0.008]
starts = 1
steps = 20
[[search.parameter]]
name = "target.width_m"
min = 0.1
max = 0.2
"""


def studies(browser, room):
    """Lines, map and table of a study have the table's numbers; facts are judged as the program judges them."""
    files = room / "studies"
    files.mkdir()
    (files / "a.toml").write_text(STUDY.replace("TITLE", HOSTILE).replace("REFERENCE", HOSTILE).replace("NAMED", HOSTILE))
    (files / "b.toml").write_text(SEARCH)
    out = room / "studied"
    run("study", files, "-o", out, "--quiet", "--device", "cpu")
    run("view", out, "-o", room / "studies.html", "--quiet")
    rows = values_of(out / "sweep.csv")
    o = Opened(browser, room / "studies.html")
    page = o.page
    check("markup in a study is shown as text", HOSTILE in page.locator(".details h2").inner_text() and HOSTILE in page.locator(".judged").inner_text())
    # Every line of each quantity along each axis, and every cell of the map, at each place of the sliders.
    cells = {tuple(r[c] for c in ("longitudinal_m", "target.height_m", "ground")): r for r in rows}
    wrong = []
    for x, over in ((0, 1), (0, 2), (1, 2), (2, 0), (1, None)):
        for field, name in enumerate(("rcs_dbsm", "view_range_m")):
            state = "Object.assign(v, {kind: 'lines', x: X, over: OVER, field: FIELD, places: [3, 1, 1]}), v.update()"
            state = state.replace("X", str(x)).replace("OVER", "null" if over is None else str(over)).replace("FIELD", str(field))
            got = page.evaluate("(() => { const v = catseye.view; STATE; const a = v.study.axes; return v.lines.last[1].map((l, j) => l.values.map((y, i) => { const p = [...v.places]; p[v.x] = v.order[i]; if (v.over != null) p[v.over] = v.shown[j]; return [p.map((q, k) => a[k].names[q]), y]; })).flat(); })()".replace("STATE", state))
            wrong += [(at, y) for at, y in got if y != float(cells[tuple(at)][name])]
            check(f"lines of {name} along axis {x}, one for each of {over}: as many as the table has", len(got) == [21, 2, 2][x] * (1 if over is None else min(12, [21, 2, 2][over])), len(got))
    check("lines are the table's", not wrong, wrong[:3])
    page.evaluate("(() => { const v = catseye.view; Object.assign(v, {kind: 'map', x: 0, over: 1, field: 0, places: [0, 0, 1]}); v.update(); })()")
    got = page.evaluate("(() => { const v = catseye.view, m = v.map.map, a = v.study.axes; return Array.from({ length: m.rows * m.columns }, (_, i) => [[a[0].names[i % m.columns], a[1].names[Math.floor(i / m.columns)], 'pec'], m.at(Math.floor(i / m.columns), i % m.columns)]); })()")
    check("the map is the table's", len(got) == 42 and all(y == float(cells[tuple(at)]["rcs_dbsm"]) for at, y in got), got[:2])
    box = page.locator(".map canvas").bounding_box()
    page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 0.7 * box["height"])
    note = page.locator(".map .note").inner_text()
    value = note.rsplit(": ", 1)[1].replace("−", "-")
    check("the value under the pointer is one of the table's", value in {r["rcs_dbsm"] for r in rows}, note)
    # The table, sorted downwards by what is shown.
    header = page.locator(".list th button").nth(3)
    header.click()
    header.click()
    shown = [t.replace("−", "-") for t in page.locator(".list tbody tr td:nth-child(4)").all_inner_texts()]
    check("the table sorts by its numbers", shown == [str(v) for v in sorted((r["rcs_dbsm"] for r in rows), key=float, reverse=True)], shown[:4])
    # A row's reflector is read by the program as what the row says.
    page.locator(".list tbody tr").first.click()
    told = dict(page.evaluate("[...document.querySelectorAll('.details .facts dt')].map((t) => [t.textContent, t.nextSibling.textContent])"))
    spec = page.locator(".spec code").inner_text()
    height = {"H 4 mm": "0.004", HOSTILE: "0.008"}[next(v for v in told.values() if v in ("H 4 mm", HOSTILE))]
    check("a row has its reflector as text", f"height_m={height}" in spec and "width_m=0.16" in spec, spec)
    run("view", spec, "-o", room / "of_row.html", "--quiet")
    facts = {tr[0].split("\n")[0]: tr[-1] for tr in (r.locator("td").all_inner_texts() for r in page.locator(".judged tbody tr").all())}
    check("facts are passed, not passed and not judged", "not passed" in facts["at 10 m"] and facts["distance"] == "✓ passed" and facts["words"] == "not judged", facts)
    check("their number is told", "1 of 2 that" in page.locator(".details").inner_text())
    # The search: its front is an axis, what was sought are its quantities.
    page.evaluate("catseye.view.take(1)")
    found = values_of(out / "search.csv")
    got = page.evaluate("(() => { const v = catseye.view; return v.study.fields.map((f) => [f.name, v.lines.last[0].map((x, i) => [x, f.cells[v.drawn[0][i]]])]); })()")
    check("a search's designs are those of its table", all([[float(r["target.height_m"]), float(r[name])] for r in found] == pairs for name, pairs in got) and [n for n, _ in got][:2] == ["target.width_m", "least_rcs_dbsm"], got)
    page.locator(".list tbody tr").nth(1).click()
    spec = page.locator(".spec code").inner_text()
    check("a design has its reflector as text", f"height_m={found[1]['target.height_m']}" in spec and f"width_m={found[1]['target.width_m']}" in spec, spec)
    check("no name of a study is run", page.evaluate("window.broken === undefined && document.querySelectorAll('img').length === 0"))
    page.evaluate("catseye.view.take(0)")
    sticks_out(page, [(900, 600), (1366, 768), (1920, 1080)])
    looked_at(page, "study")
    o.quiet("studies")
    page.close()
    # A table that is gone leaves the picture; one that is cut short is told of.
    (out / "sweep.csv").unlink()
    run("view", out, "-o", room / "pictures.html", "--quiet")
    o = Opened(browser, room / "pictures.html")
    check("without a table its picture is shown", o.page.evaluate("(async () => { const i = document.querySelector('img.picture'); await i.decode(); return i.naturalWidth > 100; })()"))
    o.quiet("a picture")
    o.page.close()
    table = out / "search.csv"
    table.write_text("\n".join(table.read_text().splitlines()[:-1]) + "\n")
    told = run("view", out, "-o", room / "none.html", "--quiet", expect=2).stderr
    check("a study's table that is cut short is told of in one line", told.count("\n") == 1 and "search.csv" in told and "the number of rows differs" in told, told)


def lane_estimates(browser, room):
    """Lines that a method found lie where its curves say, and errors are those of its scores."""
    scenario = HERE.parent / "scenes" / "lane" / "markers_turn.toml"
    own, found = room / "lane_run", room / "lanes"
    run("simulate", scenario, "-o", own, "--frames", "3", "--quiet", "--device", "cpu")
    run("lane", "markers", scenario, "-o", found, "--runs", "2", "--frames", "2", "--quiet", "--device", "cpu")
    run("view", own, found, "-o", room / "lanes.html", "--quiet")
    looks = [json.loads(line) for line in (found / "estimates.jsonl").read_text().splitlines()]
    looks = {look["frame"]: look for look in looks if look["run"] == 0}
    o = Opened(browser, room / "lanes.html")
    page = o.page
    told_errors = 0
    for index in (0, 1):
        page.evaluate(f"catseye.view.go({index})")
        wait(page, f"catseye.view.frame.index === {index}")
        ego = json.loads((own / f"frame_{index:06d}" / "truth.json").read_text())["ego"]
        x, y, z, w = ego["rotation_xyzw"]
        yaw = math.atan2(2 * (x * y + z * w), 1 - 2 * (y * y + z * z))
        apart, lines = 0.0, looks[index]["estimate"]["lines"]
        got = page.evaluate("catseye.view.scene.layers.estimates.children.map((l) => { const a = l.geometry.attributes, n = a.instanceStart.count; return [a.instanceStart, a.instanceEnd].map((b, k) => [b.getX(k * (n - 1)), b.getY(k * (n - 1)), b.getZ(k * (n - 1))]); })")
        check(f"frame {index}: as many lines are drawn as were found", len(got) == len(lines) > 0, len(got))
        for line, ends in zip(lines, got, strict=True):
            c = line["fitted"]["curve"]
            # Both ends, the far one by small steps along the clothoid.
            (px, py), h, k, n = c["start_m"], c["heading_rad"], c["curvature_per_m"], 20000
            places, d = [(px, py)], c["length_m"] / 20000
            for i in range(n):
                s = (i + 0.5) * d
                at = h + k * s + 0.5 * c["curvature_rate_per_m2"] * s * s
                px, py = px + d * math.cos(at), py + d * math.sin(at)
            places.append((px, py))
            for (px, py), end in zip(places, ends, strict=True):
                wx = ego["position_m"][0] + math.cos(yaw) * px - math.sin(yaw) * py
                wy = ego["position_m"][1] + math.sin(yaw) * px + math.cos(yaw) * py
                apart = max(apart, abs(wx - end[0]), abs(wy - end[1]))
        check(f"frame {index}: lines lie where their curves do", apart < 2e-3, apart)
        text = page.locator(".found").inner_text().replace("−", "-")
        score = looks[index]["score"]
        for name, key, scale, digits in (("offset error", "offset_error_m", 1, 3), ("heading error", "heading_error_rad", 180 / math.pi, 3), ("curvature error", "curvature_error_per_m", 1, 5)):
            shown = re.search(rf"{name} (\S+)", text).group(1).rstrip("°")
            value = score[key]
            told_errors += value is not None
            check(f"frame {index}: {name} is the score's", shown == "–" if value is None else abs(float(shown) - scale * value) <= 0.51 * 10**-digits, (shown, value))
    check("some errors are numbers", told_errors > 0)
    page.get_by_label("lane estimates").uncheck()
    check("estimates can be hidden", page.evaluate("catseye.view.scene.layers.estimates.visible === false && catseye.view.scene.layers.lanes.visible"))
    page.get_by_label("lane estimates").check()
    page.evaluate("catseye.view.go(2)")
    wait(page, "catseye.view.frame.index === 2")
    check("a frame without a look says so", "no look" in page.locator(".found").inner_text() and page.evaluate("catseye.view.scene.layers.estimates.children.length === 0"))
    page.evaluate("catseye.view.go(1)")
    wait(page, "catseye.view.frame.index === 1")
    sticks_out(page, [(900, 600), (1366, 768), (1920, 1080)])
    looked_at(page, "lanes")
    o.quiet("lane estimates")
    page.close()
    told = run("view", found, "-o", room / "none.html", "--quiet", expect=2).stderr
    check("lanes without their run lead to it", "catseye view RUN LANES" in told and told.count("\n") == 1, told)


# Reads the colour that a body is drawn in and that of its name in the legend.
MATERIALS = """(v) => ({ key: Object.fromEntries([...v.key.querySelectorAll('span')].map((s) => [s.textContent, getComputedStyle(s.querySelector('i')).backgroundColor])),
    drawn: v.bodies.flatMap(({ body }) => [body.material].flat().filter((_, i) => !body.geometry.groups.length || body.geometry.groups.some((g) => g.materialIndex === i)).map((m) => { const c = m.color.getHexString(); return `rgb(${[0, 2, 4].map((k) => parseInt(c.slice(k, k + 2), 16)).join(', ')})`; })) })"""


def materials(browser, room):
    """Bodies are drawn in the colours of their materials, which a legend tells; triangles are where the physics has them."""
    colours = {}
    for spec, names in (("plate:width_m=0.1,height_m=0.1,material=aluminium", {"aluminium"}), ("plate:width_m=0.1,height_m=0.1,material=glass", {"glass"}),
                        ("plate:width_m=0.1,height_m=0.1,material=stainless-steel", {"stainless-steel"}), ("type1:fill=polypropylene,height_m=0.016,material=copper", {"copper", "polypropylene"})):
        run("view", spec, "-o", room / "material.html", "--quiet", "--force")
        o = Opened(browser, room / "material.html")
        page = o.page
        told = page.evaluate(f"({MATERIALS})(catseye.view.scene)")
        check(f"{spec}: the legend has its materials", set(told["key"]) == names, told)
        check(f"{spec}: it is drawn in their colours", set(told["drawn"]) == set(told["key"].values()) and len(set(told["drawn"])) == len(names), told)
        colours |= told["key"]
        low, high = page.evaluate("catseye.view.scene.bounds()")
        count = page.evaluate("catseye.view.scene.bodies.reduce((n, { body }) => n + body.geometry.attributes.position.count / 3, 0)")
        with page.expect_download() as saved:
            page.get_by_title("The reflector with its radar material").click()
        saved.value.save_as(room / "material.glb")
        looked_at(page, f"material_{spec.split(':')[0]}")
        o.quiet(spec)
        page.close()
        # The same body by the program's own reader of such files.
        run("view", room / "material.glb", "-o", room / "body.html", "--quiet", "--force")
        o = Opened(browser, room / "body.html")
        want = o.page.evaluate("catseye.view.scene.bounds()")
        apart = max(abs(a - b) for p, q in zip((low, high), want, strict=True) for a, b in zip(p, q, strict=True))
        check(f"{spec}: it is as large as the program has it", apart < 1e-6 and count == o.page.evaluate("catseye.data.scene.meshes.reduce((n, m) => n + m.materials.reduce((k, [, c]) => k + c, 0), 0)"), (apart, count))
        told = o.page.evaluate(f"({MATERIALS})(catseye.view.scene)")
        check(f"{spec}: its file's page has the same colours", set(told["key"]) >= names and all(told["key"][n] == colours[n] for n in names) and set(told["drawn"]) == set(told["key"].values()), told)
        o.quiet(f"{spec} as a file")
        o.page.close()
    check("materials have colours of their own", len(set(colours.values())) == len(colours) == 5, colours)


def too_many_points(browser, room):
    """Of more points than a page draws the strongest are shown, with their rows of the file, and the page says how many; damaged files are told of."""
    whole = room / "run"
    many = room / "very_many"
    shutil.copytree(whole, many)
    points = many / "frame_000000" / "points.csv"
    head, *rows = points.read_text().splitlines()
    at = head.split(",").index("power_dbm")
    cells = [rows[i % len(rows)].split(",") for i in range(30000)]
    for i, row in enumerate(cells):
        row[at] = str(-60 - (7919 * i % 30000) / 1000)
    points.write_text("\n".join([head, *(",".join(row) for row in cells)]) + "\n")
    run("view", many / "frame_000000", "-o", room / "many_points.html", "--quiet")
    o = Opened(browser, room / "many_points.html")
    strongest = sorted(sorted(range(30000), key=lambda i: -float(cells[i][at]))[:20000])
    told = o.page.locator(".part").inner_text()
    check("of too many points the page says how many it shows", "20000" in told and "30000" in told and o.page.evaluate("catseye.view.count") == 20000, told)
    check("these are the strongest ones of the file", o.page.evaluate("[...catseye.view.file_rows]") == strongest)
    o.page.evaluate("catseye.view.choose(7)")
    check("a point has its row's number", f"Point {strongest[7]}:" in o.page.locator(".details h2").inner_text())
    o.quiet("too many points")
    o.page.close()
    # Files that were cut short: one error each.
    points.write_text(points.read_text()[:-30])
    truth = whole / "frame_000001" / "truth.json"
    kept = truth.read_text()
    truth.write_text(kept[: len(kept) // 2])
    manifest = whole / "manifest.json"
    about = manifest.read_text()
    for what, thing, words in (("points.csv", many / "frame_000000", "points.csv:"), ("truth.json", whole, "truth.json")):
        told = run("view", thing, "-o", room / "none.html", "--quiet", "--force", expect=2).stderr
        check(f"a {what} that is cut short is told of in one line", words in told and told.count("\n") == 1, told)
    manifest.write_text(re.sub(r'"catseye": "[^"]*"', '"catseye": "9.9.9"', about, count=1).replace('"axes"', '"axes_of_old"', 1))
    told = run("view", whole, "-o", room / "none.html", "--quiet", "--force", expect=2).stderr
    check("a manifest of another version is told of in one line", "manifest.json" in told and "9.9.9" in told and told.count("\n") == 1, told)
    manifest.write_text(about)
    truth.write_text(kept)


LIVE = """name = "HOSTILE"  # 7 in a comment is no number
seed = 3
radar = "demo77"

[scene]
builtin = "empty"

[[point]]
name = "target 12"
position_m = [
    30, 2.5,  # two of three
    0.5,
]
rcs_dbsm = 10.0

[[point]]
name = "other"
position_m = [50, -4, 0.5]
rcs_dbsm = 15
"""


def live(browser, room):
    """A scenario that is changed in the page gives what `simulate` gives of the changed file."""
    file = room / "live.toml"
    file.write_text(LIVE.replace("HOSTILE", "<b>live</b>"))
    scratch = room / "scratch"
    scratch.mkdir()
    environment = {**os.environ, "TMPDIR": str(scratch)}
    server = subprocess.Popen([program, "view", file, "--live", "--device", "cpu"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    try:
        served(browser, room, file, server.stdout.readline().strip())
    finally:
        server.send_signal(signal.SIGINT)
        server.wait(20)
    check("Ctrl-C ends the server and takes its folder away", not list(scratch.iterdir()), list(scratch.iterdir()))
    check("the scenario's file stays as it is", "<b>live</b>" in file.read_text() and "30, 2.5" in file.read_text())


def served(browser, room, file, url):
    port = int(url.split(":")[2].split("/")[0])

    def status(path, host=f"127.0.0.1:{port}", method="GET"):
        asked = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
        asked.request(method, path, headers={"Host": host})
        return asked.getresponse().status

    token = "/" + url.split("/", 3)[3]
    answers = [status(token), status("/"), status("/" + "0" * 32 + "/"), status(token, "evil.example"), status(token + "simulate"), status(token + "../etc")]
    check("only the page with its token is served, to this machine's own name", answers == [200, 404, 404, 403, 404, 404], answers)
    # Who sends too much, or nothing more, neither ends the server nor holds it up.
    for head in (f"POST {token}simulate HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Length: 18446744073709551615\r\n\r\n", "POST /x HTTP/1.1\r\nHost: x\r\nContent-Length: 1000000000000\r\n\r\n", "\x00\xff\r\n\r\n", "GET " + "a" * 100_000):
        with socket.create_connection(("127.0.0.1", port), timeout=20) as s:
            s.sendall(head.encode("latin-1"))
    silent = [socket.create_connection(("127.0.0.1", port), timeout=20) for _ in range(8)]
    for s in silent:
        s.sendall(f"POST {token}simulate HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Length: 100000\r\n\r\nabc".encode())
    began = time.monotonic()
    check("who is silent holds nobody up", status(token) == 200 and time.monotonic() - began < 5)
    for s in silent:
        s.close()
    taken = run("view", file, "--live", "--port", str(port), "--device", "cpu", expect=2).stderr
    check("a port in use is told of", "--port" in taken and str(port) in taken, taken)

    o = Opened(browser, url)
    page = o.page
    check("the first frame is there", page.evaluate("catseye.view.view.count > 0"))
    like("live", o.scene())

    def points():
        return page.evaluate("Object.fromEntries(['range_m','range_rate_mps','azimuth_deg','snr_db'].map((n) => [n, Array.from(catseye.view.view.own.points[n])]))")

    def simulated(text):
        changed = room / "changed.toml"
        changed.write_text(text)
        out = room / "changed"
        run("simulate", changed, "-o", out, "--quiet", "--force", "--device", "cpu")
        with open(out / "frame_000000" / "points.csv", newline="") as f:
            rows = list(csv.DictReader(f))
        return {n: [float(r[n]) for r in rows] for n in points()}

    def field(label):
        return page.locator(f'input[type=text][aria-label="{label}"]')

    def change(label, text):
        before = page.evaluate("catseye.view.done")
        field(label).fill(text)
        field(label).press("Enter")
        wait(page, f"catseye.view.done > {before} && !catseye.view.busy")

    whole = file.read_text()
    check("its points are those of simulate", points() == simulated(whole))
    labels = page.evaluate("[...document.querySelectorAll('.bench input[type=text]')].map((e) => e.getAttribute('aria-label'))")
    want = ["seed", *[f"point 1 position_m {k}" for k in (1, 2, 3)], "point 1 rcs_dbsm", *[f"point 2 position_m {k}" for k in (1, 2, 3)], "point 2 rcs_dbsm"]
    check("every number has a field, and what is in names and remarks has none", labels == want, labels)
    change("point 1 position_m 1", "41.5")
    other = whole.replace("30, 2.5", "41.5, 2.5")
    moved = points()
    check("a changed place moves the points as simulate does", moved == simulated(other) and min(abs(r - math.hypot(41.5 - 3.6, 2.5)) for r in moved["range_m"]) < 0.5)
    check("the text keeps what was not changed", page.evaluate("catseye.view.text") == other)
    # A value out of range: what is allowed is told, at its field, and what was shown stays.
    change("point 2 position_m 2", "1e99")
    told = page.locator(".told").inner_text()
    check("a value out of range is told with what is allowed", "live.toml:18" in told and "allowed" in told, told)
    marked = "[...document.querySelectorAll('.bench [aria-invalid=true]')].map((e) => e.getAttribute('aria-label'))"
    check("the fields of its line are marked", page.evaluate(marked) == [f"point 2 position_m {k}" for k in (1, 2, 3)], page.evaluate(marked))
    check("what was shown stays", points() == moved)
    before = page.evaluate("catseye.view.done")
    page.locator("h1").click()
    page.keyboard.press("Control+z")
    wait(page, f"catseye.view.done > {before} && !catseye.view.busy")
    check("undo takes it back", page.evaluate("catseye.view.text") == other and not page.locator(".told").inner_text())
    # A list over several lines, told by the line of its key.
    change("point 1 position_m 1", "1e99")
    check("a list over several lines is marked", page.evaluate(marked) == [f"point 1 position_m {k}" for k in (1, 2, 3)], page.evaluate(marked))
    field("point 1 rcs_dbsm").fill("0x10")
    field("point 1 rcs_dbsm").press("Enter")
    check("what is no decimal number is told, and changes nothing", "no number" in page.locator(".told").inner_text() and "0x10" not in page.evaluate("catseye.view.text"))
    change("point 1 rcs_dbsm", ".5")
    check("numbers are written as TOML has them", "rcs_dbsm = 0.5\n" in page.evaluate("catseye.view.text"))
    before = page.evaluate("catseye.view.done")
    page.locator("button", has_text="as it was").click()
    wait(page, f"catseye.view.done > {before} && !catseye.view.busy")
    check("all changes can be given up", page.evaluate("catseye.view.text") == whole and points() == simulated(whole))
    # The text itself, with a name that is markup.
    page.locator("button", has_text="text").first.click()
    before = page.evaluate("catseye.view.done")
    page.locator(".bench textarea").fill(whole.replace("other", "<img src=x onerror=window.broken=1>"))
    wait(page, f"catseye.view.done > {before} && !catseye.view.busy")
    check("the text can be written", points() == simulated(whole))
    check("names stay text", page.evaluate("window.broken") is None)
    slider(page)
    sticks_out(page, [(900, 600), (1366, 768), (1920, 1080)])
    looked_at(page, "live")
    o.quiet("a live scenario")
    page.close()


def slider(page):
    """How long a step of a slider takes to be drawn."""
    page.locator("button", has_text="numbers").first.click()
    times = page.evaluate("""async () => {
        const s = document.querySelector('.bench input[aria-label="point 2 position_m 1 by a slider"]'), out = [];
        for (const v of [510, 520, 530, 540, 550]) {
            const began = performance.now(), before = catseye.view.done;
            s.value = v;
            s.dispatchEvent(new Event('input', { bubbles: true }));
            while (catseye.view.done === before || catseye.view.busy) await new Promise((r) => setTimeout(r, 5));
            out.push(performance.now() - began);
        }
        return out;
    }""")
    print(f"     a step of a live scenario's slider is drawn after {sorted(times)[2]:.0f} ms (median of 5)")
    # Steps in quick succession: of those in between the last one counts, and all is one step back.
    past = page.evaluate("""async () => {
        const s = document.querySelector('.bench input[aria-label="point 2 position_m 1 by a slider"]'), before = catseye.view.past.length;
        s.dispatchEvent(new Event('change', { bubbles: true }));
        for (const v of [600, 610, 620, 630]) { s.value = v; s.dispatchEvent(new Event('input', { bubbles: true })); }
        s.dispatchEvent(new Event('change', { bubbles: true }));
        while (catseye.view.busy) await new Promise((r) => setTimeout(r, 5));
        return [catseye.view.past.length - before, catseye.view.text.includes('[63, -4')];
    }""")
    check("a drag is one step back and its end is what is shown", past == [1, True], past)


def sticks_out(page, sizes):
    for size in sizes:
        page.set_viewport_size({"width": size[0], "height": size[1]})
        page.wait_for_timeout(200)
        wide = page.evaluate("document.documentElement.scrollWidth - innerWidth")
        check(f"nothing sticks out at {size[0]} x {size[1]}", wide <= 0, wide)


def looked_at(page, name):
    """Pictures of a page in light and dark at three sizes, for eyes: only where CATSEYE_LOOK names a folder."""
    folder = os.environ.get("CATSEYE_LOOK")
    if not folder:
        return
    for theme in ("light", "dark"):
        for size in [(900, 600), (1366, 768), (1920, 1080)]:
            page.set_viewport_size({"width": size[0], "height": size[1]})
            page.wait_for_timeout(400)
            page.screenshot(path=Path(folder) / f"{name}_{size[0]}_{theme}.png")
        page.keyboard.press("d")


def main():
    chromium = os.environ.get("CATSEYE_CHROMIUM") or shutil.which("chromium")
    if not chromium:
        raise SystemExit("no Chromium: install Debian's package chromium, or name one in CATSEYE_CHROMIUM")
    with tempfile.TemporaryDirectory() as room, sync_playwright() as p:
        browser = p.chromium.launch(executable_path=chromium, args=FLAGS)
        print(f"Chromium {browser.version}", flush=True)
        parts = (a_run, names_are_text, frames_beside, cross_sections, an_image, a_dataset, a_design, studies, lane_estimates, materials, too_many_points, live)
        only = os.environ.get("CATSEYE_VIEW_PARTS", "").split()
        for part in parts:
            if not only or part.__name__ in only:
                part(browser, Path(room))
        browser.close()
    if failures:
        raise SystemExit(f"{len(failures)} of the checks failed: {', '.join(failures)}")


main()

"""The Python that README and the book show runs, block after block of a page in one name space."""

import csv
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

import catseye

ROOT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# What a page takes as given, because its words have told.
BEFORE = {
    "docs/datasets.md": "import catseye, h5py, pyarrow.dataset, zarr",
    "docs/guides/dsp.md": """
import catseye, numpy as np, shutil, torch
noise = np.random.default_rng(1).normal(size=(2, *catseye_radar("front77").shape))
adc = (1e-8 * (noise[0] + 1j * noise[1])).astype(np.complex64)
adc += 1e-7 * np.exp(2j * np.pi * 0.1 * np.arange(adc.shape[2])).astype(np.complex64)
shutil.copy("tiny_radar.toml", "radar.toml")
""",
    # What the commands above the block do.
    "docs/guides/exports.md": """
import os, pytest, subprocess, sys
if not hasattr(sys.modules.get("torch"), "Tensor"):
    sys.modules.pop("torch", None)  # The devkit asks PyTorch for more than what stands in for it has.
program = os.environ.get("CATSEYE_PROGRAM") or pytest.skip("the program was not built beside the package")
subprocess.run([program, "simulate", "scenario.toml", "-o", "exported", "--frames", "3", "--device", "cpu", "--quiet"], check=True)
subprocess.run([program, "export", "exported", "--format", "nuscenes", "-o", "nuscenes", "--quiet"], check=True)
""",
    "docs/lanes.md": "import catseye",
    # What the command above the block does.
    "docs/tutorial/notebooks.md": """
import os, pytest, subprocess
program = os.environ.get("CATSEYE_PROGRAM") or pytest.skip("the program was not built beside the package")
subprocess.run([program, "simulate", "scenario.toml", "-o", "drive", "--frames", "2", "--device", "cpu", "--quiet"], check=True)
""",
    "python/README.md": "import numpy as np, torch\nadc = np.zeros(catseye_radar('front77').shape, np.complex64)",
}


def blocks(page):
    return BLOCK.findall(page.read_text(encoding="utf-8"))


PAGES = [ROOT / "README.md", ROOT / "python/README.md", *sorted((ROOT / "docs").rglob("*.md"))]
SHOWN = {page.relative_to(ROOT).as_posix(): blocks(page) for page in PAGES if blocks(page)}


def test_the_blocks_are_found():
    assert {"README.md", "python/README.md", "docs/datasets.md", "docs/guides/labels.md", "docs/guides/libraries.md", "docs/tutorial/notebooks.md", "docs/tutorial/points.md"} <= set(SHOWN)


@pytest.fixture(scope="module")
def place(tmp_path_factory, scenario, engine):
    """A folder with what the blocks name: a scenario with a road, a frame of its run, a recipe, and its datasets."""
    at = tmp_path_factory.mktemp("documents")
    shutil.copytree(ROOT / "scenes", at / "scenes")
    lane = (ROOT / "scenes/lane/markers_fig_5_1.toml").read_text(encoding="utf-8")
    lane = lane.replace('"../road/', '"scenes/road/').replace('radar = "', 'radar = "scenes/lane/')
    lane = re.sub(r"(?m)^count = \d+", "count = 2", re.sub(r"(?m)^runs = \d+", "runs = 1", lane))
    (at / "scenario.toml").write_text(lane, encoding="utf-8")
    folder = at / "run/frame_000000"
    folder.mkdir(parents=True)
    frame = next(iter(catseye.simulate(scenario, engine=engine)))
    np.save(folder / "adc.npy", frame.adc)
    (folder / "truth.json").write_text(json.dumps(frame.truth), encoding="utf-8")
    with open(folder / "points.csv", "w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(frame.points.dtype.names)
        rows.writerows([[int(v) if isinstance(v, bool) else v for v in row.tolist()] for row in frame.points])
    shutil.copy(ROOT / "scenes/recipes/tiny_radar.toml", at)
    recipe = (ROOT / "scenes/recipes/tiny.toml").read_text(encoding="utf-8")
    recipe = recipe.replace("scenes = 4", "scenes = 12").replace("frames_per_shard = 2", "frames_per_shard = 12")
    # A car with wheels.
    assert "passenger-car" in recipe
    recipe = recipe.replace("passenger-car", "sedan").replace("[keep]", "[keep]\nlidar = true")
    recipe = recipe.replace("train = [0, 2]\nvalidation = [1]\ntest = [3]", "train = 0.75\ntest = 0.25")
    for name, kind, out in [("recipe.toml", "zarr", "data"), ("recipe-h5.toml", "hdf5", "data-h5")]:
        (at / name).write_text(recipe.replace('"frames"', f'"{kind}"'), encoding="utf-8")
        catseye.dataset(at / name, at / out)
    return at


def pandas_parts(names):
    """What the parts of all frames are called."""
    return names["pd"].read_parquet("data/tables/boxes")["part"]


@pytest.mark.parametrize("page", sorted(SHOWN))
def test_the_blocks_run(page, place, monkeypatch, torch):
    monkeypatch.chdir(place)
    shutil.rmtree(place / "out", ignore_errors=True)
    names = {"catseye_radar": catseye.Radar}
    exec(BEFORE.get(page, ""), names)
    for number, block in enumerate(SHOWN[page]):
        exec(compile(block, f"{page}, block {number + 1}", "exec"), names)
    # One row for each car, with its points; parts lead to it, and so they do without pandas.
    if page == "docs/guides/labels.md":
        cars, on_car, boxes, wholes = (names[n] for n in ("cars", "on_car", "boxes", "wholes"))
        assert len(cars) > 3 and len(on_car) > 0 and cars["length_m"].between(3.5, 5.5).all()
        assert on_car["class"].str.startswith("car").all() and (on_car["class_box"] == "car").all()
        assert (wholes["id"] == wholes["parent_id"]).all() and {"wheel"} <= set(pandas_parts(names))
        assert set(names["owner"]) <= {0, *wholes["id"]} and len(names["owner"]) == len(names["points"])
    # What README shows is what a loader takes, with workers too.
    if page == "README.md":
        batch = next(iter(names["loader"]))
        assert batch["range_doppler"].shape[0] == 8 and batch["points"]["range_m"].shape == batch["points"]["valid"].shape

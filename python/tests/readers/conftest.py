"""Files of catseye's exporters, read by the formats' own public readers.

The samples and `expected.json`, which says what is in them, are written by the Rust test
`samples::written_for_the_public_readers` of catseye-export into the folder that the environment variable
`CATSEYE_SAMPLES` names. The run of `exported` is made by the program that `CATSEYE_PROGRAM` names, as a user makes one.
"""

import csv
import json
import os
import subprocess
from pathlib import Path

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


SCENARIO = """
name = "a bend, for readers of exports"
seed = 5
radar = "demo77"
[scene]
builtin = "marked-road"
[ego.trajectory]
waypoint = [
    { time_s = 0, position_m = [2, -1.75, 0] },
    { time_s = 1, position_m = [10, -1.0, 0] },
]
[[object]]
name = "overtakes"
vehicle = "hatchback"
[object.trajectory]
waypoint = [{ time_s = 0, position_m = [14, 1.75, 0] }, { time_s = 1, position_m = [26, 1.25, 0] }]
[[object]]
name = "cyclist"
vehicle = "cyclist"
[object.trajectory]
waypoint = [{ time_s = 0, position_m = [24, -4.2, 0] }, { time_s = 1, position_m = [29, -4.0, 0] }]
[[object]]
name = "child"
vehicle = "child"
[object.trajectory]
waypoint = [{ time_s = 0, position_m = [34, -6.8, 0] }, { time_s = 1, position_m = [34, -5.8, 0] }]
[frames]
count = 8
interval_s = 0.1
[trace]
facets = 0
bounces = 1
[output]
plots = false
adc = false
masks = true
lidar = true
[lidar]
channels = 24
azimuth_step_deg = 1
[lidar.mounting]
position_m = [1.1, 0.2, 1.7]
yaw_deg = 20
pitch_deg = 2
"""


class Exported:
    """A run of the program, its truth, and the folders of its exports."""

    def __init__(self, folder, program):
        self.folder = folder
        self.program = program
        (folder / "scenario.toml").write_text(SCENARIO)
        self.call("simulate", "scenario.toml", "-o", "run", "--device", "cpu", "--quiet")
        frames = sorted((folder / "run").glob("frame_*"))
        self.frames = [json.loads((frame / "truth.json").read_text()) for frame in frames]
        assert len(self.frames) == 8

    def call(self, *arguments):
        done = subprocess.run([self.program, *arguments], cwd=self.folder, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr

    def export(self, layout, *arguments):
        self.call("export", "run", "--format", layout, "-o", layout, *arguments)
        return self.folder / layout

    def points(self, frame, table="points"):
        with open(self.folder / f"run/frame_{frame:06}/{table}.csv") as lines:
            return list(csv.DictReader(line for line in lines if not line.startswith("#")))


@pytest.fixture(scope="session")
def exported(tmp_path_factory):
    program = os.environ.get("CATSEYE_PROGRAM")
    if not program:
        pytest.skip("CATSEYE_PROGRAM does not name the program")
    return Exported(tmp_path_factory.mktemp("exported"), program)

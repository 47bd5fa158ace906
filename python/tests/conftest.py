"""What the tests share: small scenes, a small radar, and a dataset that is made once."""

import signal
from pathlib import Path

import pytest

import catseye

ROOT = Path(__file__).resolve().parents[2]

SCENARIO = """
name = "point"
seed = 7
[radar]
{radar}
[[point]]
position_m = [30, 4, 0]
velocity_mps = [-3, 0, 0]
rcs_dbsm = 15
class = "car"
[frames]
count = 3
interval_s = 0.1
"""


@pytest.fixture(scope="session", autouse=True)
def interrupts():
    # A job in the background of a script starts with Ctrl-C ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def engine():
    return catseye.Engine("cpu")


@pytest.fixture(scope="session")
def radar_text():
    """A preset with few chirps, at the world's origin."""
    text = (ROOT / "scenes/presets/demo77.toml").read_text()
    return text.replace("chirps = 128", "chirps = 32")


@pytest.fixture(scope="session")
def radar(radar_text):
    return catseye.Radar.parse(radar_text)


@pytest.fixture(scope="session")
def scenario(radar_text, tmp_path_factory):
    folder = tmp_path_factory.mktemp("scenario")
    (folder / "radar.toml").write_text(radar_text)
    text = SCENARIO.replace("[radar]\n{radar}\n", "").replace("seed = 7\n", 'seed = 7\nradar = "radar.toml"\n')
    path = folder / "scenario.toml"
    path.write_text(text)
    return catseye.Scenario(path)


@pytest.fixture(scope="session")
def recipe():
    return ROOT / "scenes/recipes/tiny.toml"


@pytest.fixture(scope="session")
def data(recipe, engine, tmp_path_factory):
    """The tiny recipe's dataset."""
    folder = tmp_path_factory.mktemp("data") / "tiny"
    catseye.dataset(recipe, folder, engine=engine)
    return folder

"""What the tests share: small scenes, a small radar, and a dataset that is made once."""

import os
import signal
import sys
import types
from pathlib import Path

import numpy as np
import pytest

import catseye

# Plots are drawn without a desktop.
os.environ.setdefault("MPLBACKEND", "Agg")

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


class _Tensors(types.ModuleType):
    """What the tests use of PyTorch, where it is not installed: tensors are arrays, and a loader collates as PyTorch's own does."""

    class DataLoader:
        def __init__(self, dataset, *, batch_size=1, num_workers=0):
            self.dataset, self.batch_size = dataset, batch_size

        def __iter__(self):
            for first in range(0, len(self.dataset), self.batch_size):
                end = min(first + self.batch_size, len(self.dataset))
                yield self.collate([self.dataset[i] for i in range(first, end)])

        def collate(self, batch):
            first = batch[0]
            if isinstance(first, dict):
                return {key: self.collate([item[key] for item in batch]) for key in first}
            if isinstance(first, np.ndarray):
                if first.dtype.kind not in "biufc":
                    raise TypeError(f"can't convert np.ndarray of type {first.dtype}")
                return np.stack(batch)
            if isinstance(first, int):
                return np.array(batch)
            raise TypeError(f"batches hold no {type(first)}")

    def __init__(self):
        super().__init__("torch")
        self.from_numpy = self.as_tensor = np.asarray
        self.utils = types.ModuleType("torch.utils")
        self.utils.data = types.ModuleType("torch.utils.data")
        self.utils.data.DataLoader = self.DataLoader


@pytest.fixture
def torch(monkeypatch):
    """PyTorch, else what stands in for it."""
    try:
        import torch
        import torch.utils.data
    except ImportError:
        torch = _Tensors()
        monkeypatch.setitem(sys.modules, "torch", torch)
        monkeypatch.setitem(sys.modules, "torch.utils", torch.utils)
        monkeypatch.setitem(sys.modules, "torch.utils.data", torch.utils.data)
    return torch

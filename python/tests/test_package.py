"""The package itself: stubs that agree with the module, examples that run."""

import doctest
import subprocess
import sys
from pathlib import Path

import pytest

import catseye

PYTHON = Path(__file__).resolve().parents[1]


def test_everything_is_documented():
    for name in catseye.__all__:
        assert name.startswith("__") or getattr(catseye, name).__doc__, name


def test_documented_examples():
    done = doctest.testmod(catseye)
    assert done.attempted == 3 and done.failed == 0
    done = doctest.testmod(catseye.dsp)
    assert done.attempted == 6 and done.failed == 0


def test_every_stage_is_documented():
    for name in catseye.dsp.__all__:
        assert name.startswith("KRADAR") or getattr(catseye.dsp, name).__doc__, name


def test_stubs_agree():
    pytest.importorskip("mypy")
    command = [sys.executable, "-m", "mypy.stubtest", "catseye._catseye", "--ignore-disjoint-bases"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_package_is_typed():
    pytest.importorskip("mypy")
    command = [sys.executable, "-m", "mypy", "--strict", "--ignore-missing-imports"]
    command += [str(PYTHON / "catseye" / f) for f in ("__init__.py", "_plot.py", "_reader.py", "_show.py", "dsp.py", "ray.py")]
    done = subprocess.run(command, capture_output=True, text=True, cwd=PYTHON)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    "script, arguments",
    [
        ("first_frame.py", ["cpu"]),
        ("rcs_of_a_marker.py", ["cpu"]),
        ("dataset_training.py", ["../../scenes/recipes/tiny.toml", "--device", "cpu"]),
    ],
)
def test_examples_run(script, arguments):
    command = [sys.executable, script, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, cwd=PYTHON / "examples")
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("name", ["segmentation_training", "point_training"])
def test_the_training_examples(tmp_path, name):
    """Where PyTorch is missing the scripts still compile; else they train, and their loss falls. Unknown classes are refused."""
    script = PYTHON / "examples" / f"{name}.py"
    compile(script.read_text(), str(script), "exec")
    pytest.importorskip("torch")
    recipes = PYTHON.parent / "scenes" / "recipes"
    command = [sys.executable, str(script), str(recipes / "tiny.toml")]
    command += [str(recipes / "tiny_radar.toml")] if name == "segmentation_training" else []
    command += ["--epochs", "3", "-o", str(tmp_path / "model.pt"), "--classes"]
    done = subprocess.run([*command, "marker"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "model.pt").exists() and (tmp_path / "model.json").exists()
    wrong = subprocess.run([*command, "unicorn"], capture_output=True, text=True)
    assert wrong.returncode == 1 and "unicorn" in wrong.stderr, wrong.stderr

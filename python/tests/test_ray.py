"""The dataset engine over a local cluster of two workers."""

import os
import shutil
import signal
import threading
import time
from pathlib import Path

import pytest

import catseye

ray = pytest.importorskip("ray")


@pytest.fixture(scope="module")
def cluster():
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, object_store_memory=80 << 20)
    yield
    ray.shutdown()


def workers():
    """Processes at work on a shard (Ray gives them the task's name)."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                if b"catseye shard" in (entry / "cmdline").read_bytes():
                    found.append(int(entry.name))
            except OSError:
                pass
    return found


def files(folder):
    return {p.relative_to(folder): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_same_bytes_as_one_machine_with_a_worker_killed(cluster, recipe, tmp_path):
    import catseye.ray

    # Longer than the shared one, so that there is a middle of the run.
    split = "[split]\ntrain = [0, 2]\nvalidation = [1]\ntest = [3]\n"
    text = recipe.read_text()
    assert split in text and "scenes = 4\n" in text
    text = text.replace(split, "").replace("scenes = 4\n", "scenes = 24\n")
    longer = tmp_path / "longer.toml"
    longer.write_text(text)
    for beside in recipe.parent.glob("*_radar.toml"):
        shutil.copy(beside, tmp_path)
    one, many = tmp_path / "one", tmp_path / "many"
    catseye.dataset(longer, one, engine="cpu")

    killed = []

    def kill():
        while not killed:
            for pid in workers():
                # After some shards are done, and amid another.
                if len(list((many / "shards").glob("*.json"))) >= 3:
                    os.kill(pid, signal.SIGKILL)
                    killed.append(pid)
                    return
            time.sleep(0.005)

    thread = threading.Thread(target=kill, daemon=True)
    thread.start()
    steps = []
    report = catseye.ray.dataset(longer, many, device="cpu", in_flight=3, progress=lambda done, of: steps.append((done, of)))
    thread.join(timeout=5)
    assert killed, "no worker was there to be killed"
    assert report["complete"]
    assert [done for done, _ in steps] == list(range(1, report["shards"] + 1))
    assert files(many) == files(one)
    # What is there is not made again.
    assert catseye.ray.dataset(longer, many, device="cpu")["shards_resumed"] == report["shards"]


def test_bad_input_is_the_librarys_own(cluster, recipe, tmp_path):
    import catseye.ray

    with pytest.raises(catseye.BadInput, match="no such shards"):
        catseye.ray.dataset(recipe, tmp_path / "a", shards=(500, 501), device="cpu")
    with pytest.raises(catseye.BadInput):
        catseye.ray.dataset(tmp_path / "none.toml", tmp_path / "a", device="cpu")
    with pytest.raises(catseye.BadInput, match="in_flight"):
        catseye.ray.dataset(recipe, tmp_path / "a", in_flight=0)

import csv
import os
import pickle
import re
import shutil
import signal
import sys
import threading

import numpy as np
import pytest

import catseye


def files(folder):
    return {p.relative_to(folder): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_reads_what_was_written(data, recipe):
    facts = catseye.recipe_facts(recipe)
    dataset = catseye.Dataset(data)
    assert len(dataset) == facts["frames"] == facts["scenes"] * facts["frames_per_scene"]
    assert catseye.verify(data)["problems"] == []
    for i, sample in enumerate(dataset):
        assert sample["frame"] == i and sample["frames"]["frame_in_scene"][0] == i % facts["frames_per_scene"]
        # The format `frames` is read by NumPy and csv too.
        folder = data / f"frame_{i:06}"
        np.testing.assert_array_equal(sample["adc"], np.load(folder / "adc.npy"))
        assert sample["adc"].dtype == np.complex64
        with open(folder / "points.csv", newline="") as f:
            rows = list(csv.DictReader(line for line in f if not line.startswith("#")))
        np.testing.assert_array_equal(sample["points"]["range_m"], [float(r["range_m"]) for r in rows])
        assert list(sample["points"]["class"]) == [r["class"] for r in rows]


def test_random_access_slices_and_choices(data):
    dataset = catseye.Dataset(data)
    assert dataset[-1]["frame"] == len(dataset) - 1
    part = dataset[2:7:2]
    assert len(part) == 3 and [s["frame"] for s in part] == [2, 4, 6] and part[1]["frame"] == 4
    with pytest.raises(IndexError):
        dataset[len(dataset)]
    few = catseye.Dataset(data, arrays=["adc"], tables=[])[0]
    assert set(few) == {"frame", "adc"}
    with pytest.raises(KeyError, match="adcs"):
        catseye.Dataset(data, arrays=["adcs"])


def test_splits_are_by_scene_and_whole(data):
    dataset = catseye.Dataset(data)
    splits = {name: catseye.Dataset(data, split=name) for name in ("train", "validation", "test")}
    assert sorted(f for s in splits.values() for f in s.frames) == list(range(len(dataset)))
    for name, split in splits.items():
        assert all(s["frames"]["split"][0] == name for s in split)
        np.testing.assert_array_equal(dataset.split(name).frames, split.frames)
    with pytest.raises(KeyError):
        dataset.split("tain")


def test_pickles_and_workers(data):
    dataset = catseye.Dataset(data)[3:]
    again = pickle.loads(pickle.dumps(dataset))
    np.testing.assert_array_equal(again[0]["adc"], dataset[0]["adc"])
    assert again[0]["frame"] == 3


@pytest.mark.skipif(sys.platform == "win32", reason="no fork")
@pytest.mark.parametrize("start", ["fork", "spawn"])
def test_processes_read_as_a_loader_does(data, start):
    import multiprocessing

    dataset = catseye.Dataset(data, tables=[])
    expected = [s["adc"] for s in dataset]
    with multiprocessing.get_context(start).Pool(2) as pool:
        for got, wanted in zip(pool.map(dataset.__getitem__, range(len(dataset))), expected, strict=True):
            np.testing.assert_array_equal(got["adc"], wanted)


@pytest.mark.parametrize("workers", [0, 2])
def test_torch_batches(data, torch, workers):
    """PyTorch's own collation takes what README shows: all arrays, and all tables filled up to one length."""
    plain = catseye.Dataset(data)
    dataset = plain.torch()
    assert len(dataset) == len(plain)
    most = {t: max(len(s[t]) for s in plain) for t in plain.tables}
    assert dataset.rows == most
    assert len({len(s["points"]) for s in plain}) > 1
    seen = 0
    for batch in torch.utils.data.DataLoader(dataset, batch_size=5, num_workers=workers):
        frames = np.asarray(batch["frame"])
        for i, frame in enumerate(frames):
            sample = plain[int(frame)]
            for name in ("adc", "range_doppler"):
                got = np.asarray(batch[name][i])
                assert got.dtype == sample[name].dtype
                np.testing.assert_array_equal(got, sample[name])
            for table in plain.tables:
                rows, columns = sample[table], batch[table]
                n = len(rows)
                valid = np.asarray(columns["valid"])
                assert valid.shape == (len(frames), most[table]) and valid.dtype == bool
                assert valid[i, :n].all() and not valid[i, n:].any()
                for key in rows.dtype.names:
                    kind = rows.dtype[key].kind
                    if key == "class":
                        got = np.asarray(columns[key][i])
                        assert got.dtype == np.int64 and (got[n:] == -1).all()
                        assert [dataset.classes[c] for c in got[:n]] == list(rows[key])
                    elif kind == "O":
                        assert key not in columns
                    else:
                        got = np.asarray(columns[key][i])
                        assert got.dtype == {"f": np.float32, "i": np.int64, "u": np.int64, "b": bool}[kind]
                        np.testing.assert_array_equal(got[:n], rows[key].astype(got.dtype))
                        assert np.isnan(got[n:]).all() if kind == "f" else not got[n:].any()
        seen += len(frames)
    assert seen == len(plain)


def test_tensors_hold_the_labels(data, torch):
    """Wholes by numbers alone, and points that no object made have a class of their own."""
    dataset = catseye.Dataset(data).torch()
    nothing = {"leakage", "noise", "weather"}
    for i, sample in enumerate(catseye.Dataset(data)):
        boxes, points = ({k: np.asarray(v) for k, v in dataset[i][t].items()} for t in ("boxes", "points"))
        wholes = boxes["valid"] & (boxes["id"] == boxes["parent_id"])
        assert wholes.sum() == (sample["boxes"]["part"] == "").sum() > 0
        assert {"visible", "occluded", "outside_view", "points", "ghosts", "side_lobes", "folded", "aliased"} <= boxes.keys()
        flags = np.stack([points[name] for name in ("ghost", "side_lobe", "folded", "aliased")])
        assert flags.dtype == bool and (flags.sum(axis=0) <= 1).all()
        for valid, class_, object_ in zip(points["valid"], points["class"], points["object_id"]):
            if valid:
                assert (dataset.classes[class_] in nothing) == (object_ == 0)
        own = {name: sample["points"][name] for name in ("ghost", "side_lobe", "folded", "aliased")}
        in_place = ~np.any(list(own.values()), axis=0) & (sample["points"]["object_id"] > 0)
        assert boxes["points"][wholes].sum() == in_place.sum()


def test_torch_lengths_and_transforms(data, torch, tmp_path):
    plain = catseye.Dataset(data, tables=["points"])
    longer = plain.torch(rows={"points": 100})
    assert longer[0]["points"]["range_m"].shape == (100,)
    with pytest.raises(ValueError, match="rows in table 'points'"):
        [plain.torch(rows={"points": 0})[i] for i in range(len(plain))]
    with pytest.raises(KeyError, match="boxes"):
        plain.torch(rows={"boxes": 3})
    made = catseye.Dataset(data).torch(transform=lambda s: s["frame"] + 1)
    assert [made[i] for i in range(3)] == [1, 2, 3]
    item = plain.torch(transform=lambda s: {"points": s["points"][:2], "x": s["adc"].real})[0]
    assert np.asarray(item["points"]["valid"]).sum() == min(2, len(plain[0]["points"])) and "adc" not in item
    # Without the statistics every frame is asked, to the same end.
    copy = tmp_path / "copy"
    shutil.copytree(data, copy)
    (copy / "statistics.json").unlink()
    again = catseye.Dataset(copy).torch()
    assert again.rows == catseye.Dataset(data).torch().rows and set(again.classes) <= set(made.classes)


def test_shards_apart_give_the_same_bytes(data, recipe, engine, tmp_path):
    shards = catseye.recipe_facts(recipe)["shards"]
    out = tmp_path / "data"
    report = catseye.dataset(recipe, out, shards=(1, shards), engine=engine, jobs=1)
    assert not report["complete"] and report["shards_complete"] == shards - 1
    assert catseye.verify(out)["problems"]
    with pytest.raises(catseye.BadInput):
        catseye.Dataset(out)[0]
    seen = []
    report = catseye.dataset(recipe, out, engine=engine, progress=lambda done, of: seen.append((done, of)))
    assert report["complete"] and report["shards_resumed"] == shards - 1
    assert seen and seen[-1][0] == seen[-1][1] == report["frames_made"]
    assert files(out) == files(data)


def test_ctrl_c_leaves_what_can_go_on(data, recipe, engine, tmp_path):
    out = tmp_path / "data"
    timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    try:
        catseye.dataset(recipe, out, engine=engine)
        timer.join()
        pytest.skip("the dataset was done before the signal")
    except KeyboardInterrupt:
        timer.join()
    catseye.dataset(recipe, out, engine=engine)
    assert files(out) == files(data)


def test_other_recipes_and_damage_are_found(data, recipe, engine, tmp_path):
    with pytest.raises(catseye.BadInput):
        catseye.dataset(recipe, data, seed=99, engine=engine)
    copy = tmp_path / "copy"
    shutil.copytree(data, copy)
    victim = copy / "frame_000001" / "adc.npy"
    raw = bytearray(victim.read_bytes())
    raw[-1] ^= 1
    victim.write_bytes(raw)
    problems = catseye.verify(copy)["problems"]
    assert any("frame_000001/adc.npy" in name for p in problems for name in p["names"])
    victim.write_bytes(raw[:100])
    with pytest.raises(catseye.BadInput, match="adc.npy"):
        catseye.Dataset(copy)[1]
    with pytest.raises(catseye.BadInput):
        catseye.Dataset(tmp_path / "none")
    with pytest.raises(catseye.BadInput):
        catseye.dataset(tmp_path / "none.toml", tmp_path / "out", engine=engine)


def test_another_radar_listens_to_kept_echoes(recipe, engine, tmp_path):
    text = recipe.read_text()
    assert "[keep]" in text
    shutil.copy(recipe.with_name("tiny_radar.toml"), tmp_path)
    traced = tmp_path / "traced.toml"
    traced.write_text(text.replace("[keep]", "[keep]\nechoes = true"))
    report = catseye.dataset(traced, tmp_path / "traced", engine=engine)
    assert report["complete"]
    catseye.dataset(recipe, tmp_path / "whole", engine=engine)
    catseye.dataset(recipe, tmp_path / "listened", engine=engine, source=tmp_path / "traced")
    whole, listened = catseye.Dataset(tmp_path / "whole"), catseye.Dataset(tmp_path / "listened")
    assert len(whole) == len(listened) > 0
    for a, b in zip(whole, listened):
        np.testing.assert_array_equal(a["adc"], b["adc"])
        # Column by column, where what is not a number equals itself.
        for name in a["points"].dtype.names:
            np.testing.assert_array_equal(a["points"][name], b["points"][name])
    echoes = catseye.Dataset(tmp_path / "traced")[0]["echoes"]
    assert {"path_length_m", "gain_vv_re", "object_1", "bounces"} <= set(echoes.dtype.names)
    with pytest.raises(catseye.BadInput, match="keep.echoes"):
        catseye.dataset(recipe, tmp_path / "no", engine=engine, source=tmp_path / "whole")
    with pytest.raises(catseye.BadInput, match="seed"):
        catseye.dataset(recipe, tmp_path / "no", engine=engine, source=tmp_path / "traced", seed=12345)


@pytest.mark.parametrize("layout", ["frames", "zarr", "hdf5"])
def test_the_lidar_of_every_format(recipe, engine, tmp_path, layout):
    """Points lie at their range from the lidar's place in the world, on objects of the frame, and the same in every format."""
    text = recipe.read_text()
    assert "[keep]\n" in text
    text = text.replace("[keep]\n", "[keep]\nlidar = true\n")
    text += "\n[scenario.lidar]\nchannels = 8\nazimuth_step_deg = 5\nmax_range_m = 60\n"
    if "[store]\n" in text:
        text = re.sub(r"(?m)^format = .*\n", "", text).replace("[store]\n", f'[store]\nformat = "{layout}"\n')
    else:
        text += f'\n[store]\nformat = "{layout}"\n'
    for name in recipe.parent.iterdir():
        if name.is_file():
            shutil.copy(name, tmp_path)
    (tmp_path / "lidar.toml").write_text(text)
    catseye.dataset(tmp_path / "lidar.toml", tmp_path / "data", engine=engine)
    total = 0
    for sample in catseye.Dataset(tmp_path / "data"):
        points, place, ego = sample["lidar"], sample["lidars"], sample["frames"]
        assert len(place) == 1
        # From the vehicle's axes to the world, by the quaternion of the table `frames`.
        x, y, z, w = (ego[f"rotation_{axis}"][0] for axis in "xyzw")
        turn = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        world = np.stack([points[f"{a}_m"] for a in "xyz"], axis=1) @ turn.T + [ego[f"{a}_m"][0] for a in "xyz"]
        distance = np.linalg.norm(world - [place[f"{a}_m"][0] for a in "xyz"], axis=1)
        np.testing.assert_allclose(distance, points["range_m"], atol=1e-9)
        assert (points["range_m"] < 60).all() and (points["channel"] < 8).all()
        assert ((points["incidence_deg"] >= 0) & (points["incidence_deg"] <= 90)).all()
        classes = dict(zip(sample["boxes"]["id"], sample["boxes"]["class"]))
        assert [classes[i] for i in points["object_id"]] == list(points["class"])
        total += len(points)
    assert total > 100

"""Datasets as zarr-python, pyarrow and h5py read them.

The folder that CATSEYE_SAMPLES names holds what the library's test `samples_for_other_readers` writes: seven frames, three a
shard, once for each format and compression. The numbers follow the formulas of `sample` in crates/io/src/store/tests.rs.
"""

import json
import os
import warnings
from pathlib import Path

import numpy as np
import pytest

FRAMES = 7
PER_SHARD = 3
DIMS = {
    "adc": ["frame", "chirp", "virtual_channel", "sample"],
    "range_doppler": ["frame", "doppler", "range"],
    "mask": ["frame", "azimuth"],
    "cells": ["frame", "cell"],
}
UNITS = {"adc": "sqrt(W)", "range_doppler": "W", "mask": "1", "cells": "1"}
CLASSES = ["car", 'Straße, "β"', ""]


def folder(name: str) -> Path:
    samples = os.environ.get("CATSEYE_SAMPLES")
    if not samples:
        pytest.skip("CATSEYE_SAMPLES names no folder of samples")
    path = Path(samples) / name
    assert path.is_dir(), f"{path} is missing"
    return path


def expected_arrays(frame: int) -> dict[str, np.ndarray]:
    f = np.float32(frame)
    i = np.arange(4 * 3 * 8, dtype=np.float32)
    adc = np.empty(i.size, np.complex64)
    adc.real = f + i / np.float32(16)
    adc.imag = -i - f / np.float32(4)
    j = np.arange(5 * 6, dtype=np.float32)
    return {
        "adc": adc.reshape(4, 3, 8),
        "range_doppler": np.exp(j * np.float32(0.1) - f).reshape(5, 6),
        "mask": ((np.arange(7) * 37 + frame) % 251).astype(np.uint8),
        "cells": (np.arange(4) * 1_000_003 - 70_000 * frame).astype(np.int32),
    }


def expected_points(frame: int) -> dict[str, list]:
    rows = range(frame * 3 % 5)
    return {
        "frame": [frame for _ in rows],
        "time_ns": [frame * 1_000_000_007 - i for i in rows],
        "object_id": [4_294_967_295 - i for i in rows],
        "range_m": [(frame + 0.1) * (i + 1) / 3.0 for i in rows],
        "snr_db": [np.float32("nan") if i == 1 else np.float32(i) / np.float32(7) for i in rows],
        "is_ghost": [i % 2 == 0 for i in rows],
        "class": [CLASSES[i % 3] for i in rows],
    }


def all_points(frames: range) -> dict[str, list]:
    parts = [expected_points(f) for f in frames]
    return {name: [x for part in parts for x in part[name]] for name in parts[0]}


def assert_array(name: str, got: np.ndarray, want: np.ndarray) -> None:
    assert got.dtype == want.dtype, name
    assert got.shape == want.shape, name
    if name == "range_doppler":
        # exp is rounded by each library in its own way.
        np.testing.assert_allclose(got, want, rtol=3e-7)
    else:
        np.testing.assert_array_equal(got, want)


def assert_column(name: str, got: list, want: list) -> None:
    assert len(got) == len(want), name
    for a, b in zip(got, want, strict=True):
        assert a == b or (a != a and b != b), (name, a, b)


@pytest.mark.parametrize("name", ["zarr_none", "zarr_zstd_1", "zarr_zstd_9"])
def test_zarr_python(name: str) -> None:
    zarr = pytest.importorskip("zarr", minversion="3")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        group = zarr.open_group(folder(name), mode="r")
        members = dict(group.members())
    assert set(members) == set(DIMS)
    assert group.attrs["recipe"] == "seed = 1\n"
    for key, dims in DIMS.items():
        # As a member of the group, and opened alone.
        for array in (members[key], zarr.open_array(folder(name) / key, mode="r")):
            assert list(array.metadata.dimension_names) == dims
            assert array.attrs["units"] == UNITS[key]
            assert array.shape[0] == FRAMES
            assert array.chunks == (1, *array.shape[1:])
            assert array.shards == (PER_SHARD, *array.shape[1:])
            for frame in reversed(range(FRAMES)):
                assert_array(key, array[frame], expected_arrays(frame)[key])
            assert_array(key, array[:], np.stack([expected_arrays(f)[key] for f in range(FRAMES)]))


def test_zarr_python_writes_the_same_numbers(tmp_path: Path) -> None:
    """What zarr-python makes of our metadata is what we wrote: same keys, same chunks when decoded."""
    zarr = pytest.importorskip("zarr", minversion="3")
    source = zarr.open_array(folder("zarr_zstd_1") / "adc", mode="r")
    copy = zarr.create_array(
        tmp_path / "adc",
        shape=source.shape,
        chunks=source.chunks,
        shards=source.shards,
        dtype=source.dtype,
        compressors=source.compressors,
        fill_value=source.fill_value,
        dimension_names=source.metadata.dimension_names,
        attributes=dict(source.attrs),
    )
    copy[:] = source[:]
    ours = json.loads((folder("zarr_zstd_1") / "adc" / "zarr.json").read_text())
    theirs = json.loads((tmp_path / "adc" / "zarr.json").read_text())
    for key in ("shape", "data_type", "chunk_grid", "chunk_key_encoding", "fill_value", "dimension_names", "codecs"):
        assert ours[key] == theirs[key], key
    keys = {p.relative_to(tmp_path).as_posix() for p in (tmp_path / "adc" / "c").rglob("*") if p.is_file()}
    base = folder("zarr_zstd_1")
    assert keys == {p.relative_to(base).as_posix() for p in (base / "adc" / "c").rglob("*") if p.is_file()}


def test_zarr_python_finds_a_wrong_bit(tmp_path: Path) -> None:
    zarr = pytest.importorskip("zarr", minversion="3")
    import shutil

    shutil.copytree(folder("zarr_none"), tmp_path / "copy")
    shard = tmp_path / "copy" / "adc" / "c" / "0" / "0" / "0" / "0"
    data = bytearray(shard.read_bytes())
    data[100] ^= 1
    shard.write_bytes(data)
    array = zarr.open_array(tmp_path / "copy" / "adc", mode="r")
    with pytest.raises(ValueError, match="checksum"):
        array[0]
    assert_array("adc", array[1], expected_arrays(1)["adc"])


def test_missing_shards_are_nan(tmp_path: Path) -> None:
    zarr = pytest.importorskip("zarr", minversion="3")
    import shutil

    shutil.copytree(folder("zarr_none"), tmp_path / "copy")
    shutil.rmtree(tmp_path / "copy" / "adc" / "c" / "1")
    array = zarr.open_array(tmp_path / "copy" / "adc", mode="r")
    assert np.isnan(array[3].real).all() and np.isnan(array[3].imag).all()


@pytest.mark.parametrize("name", ["zarr_none", "zarr_zstd_1"])
def test_pyarrow(name: str) -> None:
    pq = pytest.importorskip("pyarrow.parquet")
    import pyarrow.dataset as ds

    tables = folder(name) / "tables"
    assert sorted(p.name for p in tables.iterdir()) == ["ego", "points"]
    types = {
        "frame": "int64",
        "time_ns": "int64",
        "object_id": "uint32",
        "range_m": "double",
        "snr_db": "float",
        "is_ghost": "bool",
        "class": "string",
    }
    for shard in range(3):
        frames = range(shard * PER_SHARD, min((shard + 1) * PER_SHARD, FRAMES))
        table = pq.read_table(tables / "points" / f"part-{shard:06}.parquet")
        assert {f.name: str(f.type) for f in table.schema} == types
        assert not any(f.nullable for f in table.schema)
        for column, want in all_points(frames).items():
            assert_column(column, table[column].to_pylist(), want)
    # The statistics of row groups let a reader of one frame skip the rest.
    meta = pq.read_metadata(tables / "points" / "part-000001.parquet")
    assert meta.row_group(0).column(0).statistics.min == 3
    # Frame 5 has no rows.
    assert meta.row_group(0).column(0).statistics.max == 4
    assert json.loads(meta.metadata[b"catseye"])["rows"] == [frame * 3 % 5 for frame in (3, 4, 5)]
    whole = ds.dataset(tables / "points", format="parquet")
    assert whole.count_rows() == sum(f * 3 % 5 for f in range(FRAMES))
    one = whole.to_table(filter=ds.field("frame") == 4)
    for column, want in expected_points(4).items():
        assert_column(column, one[column].to_pylist(), want)
    ego = ds.dataset(tables / "ego", format="parquet").to_table()
    assert ego["x_m"].to_pylist() == [f / 8 for f in range(FRAMES)]


@pytest.mark.parametrize("name", ["hdf5_none", "hdf5_deflate_4"])
def test_h5py(name: str) -> None:
    h5py = pytest.importorskip("h5py")
    for shard in range(3):
        frames = range(shard * PER_SHARD, min((shard + 1) * PER_SHARD, FRAMES))
        with h5py.File(folder(name) / "data" / f"part-{shard:06}.h5") as file:
            assert file.attrs["first_frame"] == frames.start
            assert json.loads(file.attrs["attributes"])["recipe"] == "seed = 1\n"
            for key, dims in DIMS.items():
                dataset = file[key]
                assert dataset.attrs["units"] == UNITS[key]
                assert [d.label for d in dataset.dims] == dims
                assert dataset.chunks == (1, *dataset.shape[1:])
                assert dataset.fletcher32
                assert dataset.compression == ("gzip" if name == "hdf5_deflate_4" else None)
                assert_array(key, dataset[:], np.stack([expected_arrays(f)[key] for f in frames]))
            points = file["tables/points"]
            assert points["row_offsets"][:].tolist() == [0, *np.cumsum([f * 3 % 5 for f in frames]).tolist()]
            kinds = {"object_id": "<u4", "range_m": "<f8", "snr_db": "<f4", "is_ghost": "|b1", "time_ns": "<i8"}
            for column, kind in kinds.items():
                assert points[column].dtype.str == kind
            for column, want in all_points(frames).items():
                cells = points[column].asstr() if column == "class" else points[column]
                assert_column(column, cells[:].tolist() if len(want) else [], want)


def test_numpy_and_csv() -> None:
    import csv

    for frame in range(FRAMES):
        base = folder("frames_none") / f"frame_{frame:06}"
        for key, want in expected_arrays(frame).items():
            assert_array(key, np.load(base / f"{key}.npy"), want)
        with open(base / "points.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        want = expected_points(frame)
        read = {"class": str, "is_ghost": {"true": True, "false": False}.get, "snr_db": np.float32, "range_m": float}
        for column in want:
            assert_column(column, [read.get(column, int)(row[column]) for row in rows], want[column])

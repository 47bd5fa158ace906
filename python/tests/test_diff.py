"""catseye.diff: two results within tolerances."""

import numpy as np
import pytest

import catseye


def test_arrays_and_tables(tmp_path):
    cube = np.arange(24, dtype=np.complex64).reshape(2, 3, 4)
    np.save(tmp_path / "a.npy", cube)
    cube[1, 2, 0] += 1
    np.save(tmp_path / "b.npy", cube)
    assert catseye.diff(tmp_path / "a.npy", tmp_path / "a.npy")["alike"]
    found = catseye.diff(tmp_path / "a.npy", tmp_path / "b.npy")
    assert not found["alike"] and found["kind"] == "array"
    peak = next(d for d in found["differences"] if d["what"] == "largest difference / peak")
    assert (peak["place"], peak["allowed"]) == ("index [1, 2, 0]", 1e-3)
    assert peak["apart"] == pytest.approx(1 / 23)
    calls = []
    assert catseye.diff(tmp_path / "a.npy", tmp_path / "b.npy", relative=0.1, progress=lambda *n: calls.append(n))["alike"]
    assert calls[-1] == (1, 1)
    # Fortran's order, of both.
    np.save(tmp_path / "a.npy", np.asfortranarray(cube))
    cube[0, 1, 2] = 50
    np.save(tmp_path / "b.npy", np.asfortranarray(cube))
    assert "index [0, 1, 2]" in str(catseye.diff(tmp_path / "a.npy", tmp_path / "b.npy")["differences"])


def test_bad_input(tmp_path):
    (tmp_path / "t.csv").write_text("x_m\n1\n")
    np.save(tmp_path / "a.npy", np.zeros(3))
    with pytest.raises(catseye.BadInput, match="one kind"):
        catseye.diff(tmp_path / "t.csv", tmp_path / "a.npy")
    with pytest.raises(catseye.BadInput) as e:
        catseye.diff(tmp_path / "t.csv", tmp_path / "t.csv", tolerance_db=-1.0)
    assert e.value.key == "tolerance_db"


def test_datasets_of_other_formats(data, recipe, engine, tmp_path):
    text = recipe.read_text()
    assert 'format = "frames"' in text
    (tmp_path / "tiny_radar.toml").write_bytes((recipe.parent / "tiny_radar.toml").read_bytes())
    for name in ("zarr", "hdf5"):
        other = tmp_path / f"{name}.toml"
        other.write_text(text.replace('format = "frames"', f'format = "{name}"'))
        catseye.dataset(other, tmp_path / name, engine=engine)
        found = catseye.diff(data, tmp_path / name, tolerance_db=0, relative=0, tolerance_m=0)
        assert found["alike"] and found["kind"] == "dataset" and found["values"] > 1e5
    # Another seed, other scenes.
    catseye.dataset(recipe, tmp_path / "seed", engine=engine, seed=4)
    found = catseye.diff(data, tmp_path / "seed")
    assert not found["alike"] and {"frame_000000/adc"} <= {d["file"] for d in found["differences"]}

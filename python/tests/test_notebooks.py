"""The notebooks run in a kernel, and assert what they show."""

import json
from pathlib import Path

import nbclient
import nbformat
import pytest

NOTEBOOKS = sorted((Path(__file__).resolve().parents[1] / "notebooks").glob("*.ipynb"))


def run(notebook, folder):
    """Runs all cells. Raises CellExecutionError for one that fails."""
    nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(folder)}}).execute()
    return notebook


def shown(notebook):
    """The data of all outputs, by their kinds."""
    return [output["data"] for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs if "data" in output]


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    # What Jupyter keeps beside a kernel is left in no home folder.
    for name in ("JUPYTER_RUNTIME_DIR", "JUPYTER_DATA_DIR", "JUPYTER_CONFIG_DIR", "IPYTHONDIR"):
        monkeypatch.setenv(name, str(tmp_path / name.lower()))
    # The kernel draws into its cells.
    monkeypatch.delenv("MPLBACKEND", raising=False)
    return tmp_path


def test_the_notebooks_are_found():
    assert [path.stem for path in NOTEBOOKS] == ["dataset_for_learning", "first_frame", "reflector_design"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_run(path, place):
    text = path.read_text(encoding="utf-8")
    notebook = nbformat.reads(text, as_version=4)
    nbformat.validate(notebook)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    # Kept small: without what they put out.
    assert len(text) < 20_000 and all(not cell.outputs and cell.execution_count is None for cell in code)
    assert sum(cell.source.count("assert ") for cell in code) >= 4
    outputs = shown(run(notebook, place))
    assert sum("image/png" in data for data in outputs) >= 1
    assert list(place.glob("*.ipynb")) == []
    if path.stem == "first_frame":
        scene, frame = outputs[:2]
        assert "<img" in scene["text/html"] and scene["text/plain"].startswith("<catseye.Scene")
        assert "<img" in frame["text/html"] and frame["text/plain"].startswith("<catseye.Frame 0 of demo77")


def test_a_wrong_number_fails(place):
    """The check itself is checked: an assertion of a cell that does not hold ends the run."""
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("import catseye\nassert len(catseye.presets()) == 0")])
    with pytest.raises(nbclient.exceptions.CellExecutionError, match="AssertionError"):
        run(notebook, place)


def test_a_page_is_an_output(place):
    source = 'import catseye\ncatseye.view(catseye.reflector("plate"))'
    notebook = run(nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source)]), place)
    (data,) = shown(notebook)
    assert data["text/html"].startswith("<iframe") and data["text/plain"].startswith("<catseye.View")
    assert "plate" in json.dumps(data["text/html"])

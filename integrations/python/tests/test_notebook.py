"""Runs all cells of the book's notebooks."""

from pathlib import Path

import pytest

nbclient = pytest.importorskip("nbclient", reason="nbclient is not there")
nbformat = pytest.importorskip("nbformat", reason="nbformat is not there")
pytest.importorskip("ipykernel", reason="ipykernel is not there")
pytest.importorskip("matplotlib", reason="matplotlib is not there")

NOTEBOOKS = Path(__file__).resolve().parents[3] / "docs/notebooks"


@pytest.mark.parametrize("path", sorted(NOTEBOOKS.glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook_runs(path, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    assert all(not cell.get("outputs") for cell in notebook.cells), "notebooks are kept without outputs"
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(path.parent)}}).execute()

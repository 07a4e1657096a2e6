"""Runs the Python code blocks of two pages of the book and of the README."""

import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
PAGES = [ROOT / "docs/how-to/python.md", ROOT / "docs/how-to/study.md", ROOT / "integrations/python/README.md"]
BLOCKS = [
    pytest.param(page, block, id=f"{page.name}-{number}")
    for page in PAGES
    for number, block in enumerate(re.findall(r"^```python\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL))
    # The client is a file that other tests run.
    if "class Loop" not in block
]


@pytest.mark.parametrize(("page", "block"), BLOCKS)
def test_a_block_runs(page, block, tmp_path, monkeypatch):
    if "unified_planning" in block:
        pytest.importorskip("unified_planning", reason="unified-planning is not there")
    if "dask" in block:
        pytest.importorskip("dask", reason="Dask is not there")
    monkeypatch.chdir(ROOT)
    file = tmp_path / "block.py"
    file.write_text(block)
    runpy.run_path(str(file), run_name="__main__")

"""The walk-through notebook runs completely, its output is as shown, and its code passes the type checker."""

from __future__ import annotations

import copy
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from conftest import MYPY_CACHE, ROOT

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")
NOTEBOOK = ROOT / "python" / "notebooks" / "walk-through.ipynb"
#: A picture in a page, and the text that replaces a figure.
PICTURE = r'<img alt="plot" src="[^"]*">|<Figure size [^>]*>'


def printed(notebook: Any) -> list[dict[str, str]]:
    """Output of each code cell, by kind."""
    shown = []
    for cell in notebook.cells:
        kinds: dict[str, str] = {}
        for output in cell.get("outputs", []):
            of = {output.name: output.text} if output.output_type == "stream" else output.get("data", {"error": output.get("evalue")})
            kinds.update({k: kinds.get(k, "") + v for k, v in of.items()})
        if cell.cell_type == "code":
            shown.append(kinds)
    return shown


def test_it_runs_and_shows_what_it_shows() -> None:
    notebook = nbformat.read(NOTEBOOK, 4)
    before = printed(copy.deepcopy(notebook))
    nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(NOTEBOOK.parent)}}).execute()
    after = printed(notebook)
    if os.environ.get("UPDATE_NOTEBOOK"):
        for cell in notebook.cells:
            cell.metadata = {}
        notebook.metadata = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}, "language_info": {"name": "python"}}
        nbformat.write(notebook, NOTEBOOK)
        return
    for source, shown, now in zip([c.source for c in notebook.cells if c.cell_type == "code"], before, after, strict=True):
        # tables of pandas and pictures of matplotlib depend on their versions
        now = {k: re.sub(PICTURE, "", v) for k, v in now.items() if k != "image/png"}
        shown = {k: re.sub(PICTURE, "", v) for k, v in shown.items() if k != "image/png"}
        kinds = [k for k in now if k != "text/html" or "dataframe" not in now[k]]
        assert {k: now[k] for k in kinds} == {k: shown.get(k) for k in kinds}, source


def test_it_says_nothing_of_the_machine() -> None:
    notebook = nbformat.read(NOTEBOOK, 4)
    text = "\n".join(v for kinds in printed(notebook) for v in kinds.values())
    assert len(text) > 10_000
    assert not re.search(r"/(tmp|home|root|work|usr|Users)/|\b\d+\.\d+ ?(ms|us)\b|20\d\d-\d\d-\d\d|\d\d:\d\d:\d\d", text)
    assert all(set(c) <= {"cell_type", "id", "metadata", "source", "outputs", "execution_count"} for c in notebook.cells)


def test_its_code_has_types(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    cells = [c.source for c in nbformat.read(NOTEBOOK, 4).cells if c.cell_type == "code"]
    script = tmp_path / "walk_through.py"
    script.write_text("\n".join(cells) + "\n")
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--config-file", str(ROOT / "pyproject.toml"), "--cache-dir", str(MYPY_CACHE), str(script)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout

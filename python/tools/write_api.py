"""Writes the pages of the API from the docstrings.

    python python/tools/write_api.py [FOLDER]

FOLDER is `target/api` by default; `index.html` is its first page.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import pdoc

MODULES = [
    "obsdeg",
    "obsdeg.options",
    "obsdeg.shapes",
    "obsdeg.campaign",
    "obsdeg.importers",
    *(f"obsdeg.importers.{name}" for name in ("sbml", "petab", "sijl", "strike_goldd", "sympy_system", "exporters", "system", "problem")),
]


def written(folder: Path) -> None:
    """Writes the pages into a folder."""
    pdoc.render.configure(docformat="google", show_source=False)
    with warnings.catch_warnings():
        # options that several commands share appear in each command
        warnings.simplefilter("ignore")
        pdoc.pdoc(*MODULES, output_directory=folder)


if __name__ == "__main__":
    written(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[2] / "target" / "api")

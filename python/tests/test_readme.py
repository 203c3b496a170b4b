"""The READMEs and the chapter of the book print what they show."""

from __future__ import annotations

import doctest
import shutil
from pathlib import Path

import obsdeg
import pytest
from conftest import ROOT

PAGES = ["README.md", "python/README.md", "book/src/python.md"]


@pytest.mark.parametrize("page", PAGES)
def test_pages_print_what_they_show(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    # a block ends with its fence, which is no part of what is printed
    text = (ROOT / page).read_text(encoding="utf-8").replace("\n```", "\n\n```")
    tested = doctest.DocTestParser().get_doctest(text, {}, page, page, 0)
    assert len(tested.examples) >= 2
    failed = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE).run(tested)
    assert failed.failed == 0


def test_docstrings_print_what_they_show() -> None:
    assert doctest.testmod(obsdeg).failed == 0

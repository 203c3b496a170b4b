"""The READMEs and the chapter of the book print what they show."""

from __future__ import annotations

import doctest
import importlib
import inspect
import shutil
from pathlib import Path

import obsdeg
import pytest
from conftest import ROOT
from obsdeg import campaign, options

PAGES = ["README.md", "python/README.md", "book/src/python.md"]


@pytest.mark.parametrize("page", PAGES)
def test_pages_print_what_they_show(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    # the fence at the end of a block is not part of the output
    text = (ROOT / page).read_text(encoding="utf-8").replace("\n```", "\n\n```")
    tested = doctest.DocTestParser().get_doctest(text, {}, page, page, 0)
    assert len(tested.examples) >= 2
    failed = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE).run(tested)
    assert failed.failed == 0


@pytest.mark.parametrize("module", ["obsdeg", "obsdeg._scheme", "obsdeg._model", "obsdeg._results", "obsdeg._sweeps", "obsdeg.campaign"])
def test_docstrings_print_what_they_show(module: str) -> None:
    assert doctest.testmod(importlib.import_module(module), optionflags=doctest.ELLIPSIS).failed == 0


#: Answers whose examples are those of their commands.
_WITHOUT = (
    *(obsdeg.Answer, obsdeg.Judgement, obsdeg.Part, obsdeg.Report, obsdeg.Walks),
    *(obsdeg.SystemCalibration, obsdeg.SystemEvidence, obsdeg.SystemRun),
)


def test_every_command_and_object_shows_an_example() -> None:
    of = [getattr(obsdeg, name) for name in obsdeg.__all__]
    functions = [f for f in of if inspect.isfunction(f)]
    assert len(functions) >= 9
    answers = [a for a in of if inspect.isclass(a) and issubclass(a, obsdeg.Answer) and a not in _WITHOUT]
    assert len(answers) >= 12
    of_sweeps = [campaign.table, campaign.read, campaign.to_xarray, campaign.plot]
    for one in [*functions, *answers, *of_sweeps, obsdeg.Scheme, obsdeg.Model, obsdeg.Scheme.replace, obsdeg.Model.replace, obsdeg.Answer.from_json]:
        assert "Examples\n" in one.__doc__ and ">>> " in one.__doc__, one


@pytest.mark.parametrize("command", ["analyze", "simulate", "crosscheck", "procedure", "calibrate", "allan", "compare", "design", "report"])
def test_options_are_keyword_parameters(command: str) -> None:
    parameters = inspect.signature(getattr(obsdeg, command)).parameters
    known = set(getattr(options, command.title()).__annotations__)
    assert known <= parameters.keys() and "options" not in parameters
    assert all(parameters[name].kind is inspect.Parameter.KEYWORD_ONLY for name in known)
    assert {"digits", "progress"} <= parameters.keys()


def test_names_are_those_that_users_need() -> None:
    assert dir(obsdeg) == sorted({*obsdeg.__all__, "campaign", "importers"})
    assert all(hasattr(obsdeg, name) for name in dir(obsdeg))

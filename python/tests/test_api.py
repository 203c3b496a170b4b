"""The pages of the API list every public name with its description."""

from __future__ import annotations

import importlib
import inspect
import re
import subprocess
import sys
from pathlib import Path

import obsdeg
import pytest
from conftest import AT_LENGTH, ROOT
from obsdeg._records import fields
from obsdeg._results import KINDS

pytest.importorskip("pdoc")
TOOL = ROOT / "python" / "tools" / "write_api.py"


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if not AT_LENGTH:
        pytest.skip("pages of the API are written at full length, with AT_LENGTH=1, as `.ci/run release` does")
    folder = tmp_path_factory.mktemp("api")
    subprocess.run([sys.executable, str(TOOL), str(folder)], check=True, capture_output=True)
    return folder


def names(page: Path) -> set[str]:
    return set(re.findall(r'id="([\w.]+)"', page.read_text(encoding="utf-8")))


def test_everything_public_is_there(pages: Path) -> None:
    sys.path.insert(0, str(TOOL.parent))
    import write_api

    modules = write_api.MODULES
    for name in modules:
        module = importlib.import_module(name)
        assert module.__doc__, name
        page = pages / f"{name.replace('.', '/')}.html"
        public = getattr(module, "__all__", None) or [
            n for n, v in vars(module).items() if not n.startswith("_") and getattr(v, "__module__", "") == name and (inspect.isclass(v) or inspect.isfunction(v))
        ]
        missing = {n for n in public if n not in names(page) and f"{name}.{n}" not in modules}
        assert public and not missing, (name, missing)
    assert set(obsdeg.__all__) <= names(pages / "obsdeg.html") | {"options", "shapes"}


def test_attributes_of_answers_and_options_of_commands_are_there(pages: Path) -> None:
    there = names(pages / "obsdeg.html")
    for kind in KINDS.values():
        assert {f"{kind.__name__}.{n}" for n in fields(kind) if not hasattr(obsdeg.Answer, n)} <= there
    there = names(pages / "obsdeg" / "options.html")
    assert {"Analyze.latitude", "Design.criterion", "Calibrate.gate"} <= there
    there = names(pages / "obsdeg" / "shapes.html")
    assert {"Quantity.degree", "FindingClock.by_earth"} <= there


def test_everything_public_says_what_it_is() -> None:
    for name in obsdeg.__all__:
        of = getattr(obsdeg, name)
        if name != "__version__":
            assert of.__doc__, name
        if inspect.isclass(of):
            for method, value in vars(of).items():
                if not method.startswith("_") and callable(value):
                    assert value.__doc__, f"{name}.{method}"

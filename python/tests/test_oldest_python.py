"""The package uses only names of the oldest Python that it supports."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT

#: Modules of the standard library added after Python 3.10.
LATER = {"tomllib": (3, 11), "wsgiref.types": (3, 11), "compression": (3, 14), "concurrent.interpreters": (3, 14), "annotationlib": (3, 14)}
#: Names added after Python 3.10 in older modules.
LATER_NAMES = {
    "typing": {"Self", "Never", "Unpack", "TypeVarTuple", "LiteralString", "Required", "NotRequired", "assert_never", "assert_type", "reveal_type", "override"},
    "datetime": {"UTC"},
    "enum": {"StrEnum"},
    "asyncio": {"TaskGroup", "timeout", "Runner"},
    "itertools": {"batched"},
    "contextlib": {"chdir"},
    "hashlib": {"file_digest"},
    "warnings": {"deprecated"},
}

FILES = sorted((ROOT / "python" / "obsdeg").rglob("*.py"))


class Later(ast.NodeVisitor):
    """Imports that Python 3.10 lacks, except those only for later versions or type checkers."""

    def __init__(self) -> None:
        self.found: list[str] = []

    def visit_If(self, node: ast.If) -> None:
        test = ast.unparse(node.test)
        if "sys.version_info >=" in test or test == "TYPE_CHECKING":
            for rest in node.orelse:
                self.visit(rest)
        else:
            self.generic_visit(node)

    def visit_Import(self, node: ast.Import) -> None:
        self.found += [alias.name for alias in node.names if alias.name in LATER]

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None:
        module = node.module or ""
        names = [alias.name for alias in node.names]
        if node.level == 0:
            self.found += [module] if module in LATER else []
            self.found += [f"{module}.{name}" for name in names if name in LATER_NAMES.get(module, ()) or f"{module}.{name}" in LATER]

    def visit_Attribute(self, node: ast.Attribute) -> None:
        if isinstance(node.value, ast.Name) and node.attr in LATER_NAMES.get(node.value.id, ()):
            self.found.append(f"{node.value.id}.{node.attr}")
        self.generic_visit(node)


def later(text: str) -> list[str]:
    # match, walrus and the like are read as in Python 3.10; except* and type parameters are refused
    visitor = Later()
    visitor.visit(ast.parse(text, feature_version=(3, 10)))
    return visitor.found


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.name)
def test_modules_and_names_are_those_of_python_3_10(path: Path) -> None:
    assert later(path.read_text()) == []


def test_what_is_later_is_found() -> None:
    assert later("import tomllib") == ["tomllib"]
    assert later("def f():\n    from typing import Any, Self") == ["typing.Self"]
    assert later("import datetime\nx = datetime.UTC") == ["datetime.UTC"]
    assert later("import sys\nif sys.version_info >= (3, 11):\n    import tomllib\nelse:\n    import tomli as tomllib") == []
    with pytest.raises(SyntaxError):
        later("try:\n    pass\nexcept* ValueError:\n    pass")


def as_python_3_10(script: str, *, tomli: bool) -> subprocess.CompletedProcess[str]:
    """Script under a simulated Python 3.10 without `tomllib`; `tomli` replaces it or is missing too."""
    head = f"import sys, tomllib\nsys.modules['tomli'] = tomllib if {tomli} else None\nsys.modules['tomllib'] = None\nsys.version_info = (3, 10, 13, 'final', 0)\n"
    return subprocess.run([sys.executable, "-c", head + script], cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)


@pytest.mark.skipif(sys.version_info < (3, 11), reason="this is Python 3.10")
def test_models_are_exported_with_python_3_10() -> None:
    pytest.importorskip("sympy")
    script = """
from obsdeg import _toml, importers
from obsdeg.importers import exporters
model = importers.load("examples/lotka-volterra/model.toml")
assert exporters.to_si_jl(model.text).startswith(("using", "ode", "#")), exporters.to_si_jl(model.text)[:80]
print(_toml.loads("a = 1"))
"""
    done = as_python_3_10(script, tomli=True)
    assert (done.returncode, done.stdout) == (0, "{'a': 1}\n"), done.stderr
    done = as_python_3_10(script, tomli=False)
    assert done.returncode == 1 and "ImportError: Python 3.10 reads TOML with the package `tomli`, which is not installed" in done.stderr


def test_the_package_of_toml_is_required_where_it_is_needed() -> None:
    text = (ROOT / "pyproject.toml").read_text()
    assert re.search(r'^requires-python = ">=3\.10"$', text, re.MULTILINE)
    assert re.search(r"""^dependencies = \["tomli>=2; python_version < '3\.11'"\]$""", text, re.MULTILINE)

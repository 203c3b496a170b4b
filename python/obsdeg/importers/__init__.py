"""Models from elsewhere in obsdeg's own format.

`load` reads SBML, PEtab problems, `@ODEmodel` and `@DDSmodel` texts of StructuralIdentifiability.jl, MATLAB scripts of
STRIKE-GOLDD, systems written with SymPy, and obsdeg's own models and schemes. An unsupported construct raises
an `ImportProblem`, which names construct and place.
"""

from __future__ import annotations

import importlib
import json
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import _toml
from .._files import TEXT, read_text
from .problem import ImportProblem

if TYPE_CHECKING:
    from .exporters import to_si_jl as to_si_jl
    from .exporters import to_sympy as to_sympy
    from .system import System as System
    from .system import to_toml as to_toml

__all__ = ["ImportProblem", "Imported", "load"]

#: Names of modules that import SymPy.
_LATER = {"System": ".system", "to_toml": ".system", "to_si_jl": ".exporters", "to_sympy": ".exporters"}


@dataclass(frozen=True)
class Imported:
    """A model or scheme as text.

    Attributes:
        text: A model file (TOML, or obsdeg's JSON), or a scheme file.
        kind: ``"model"`` or ``"scheme"``.
        source: Format of the source: ``"SBML"``, ``"PEtab"``, ``"SI.jl"``, ``"STRIKE-GOLDD"``, ``"SymPy"`` or
            ``"obsdeg"``.
        notes: Remarks on the import for readers of an answer.
    """

    text: str
    kind: str
    source: str
    notes: tuple[str, ...] = field(default=())


def load(path: str | Path, **options: Any) -> Imported:
    """Reads a file of any known kind.

    Arguments:
        path: The file. Its kind follows from its content, then from its extension.
        options: Options of the reader: `sbml.load`, `petab.load`, `sijl.load`, `strike_goldd.load`.

    Raises:
        ImportProblem: unsupported construct, or file of unknown kind.
        FileNotFoundError: no such file.
        ImportError: the package that reads this kind is not installed; the message names it.
    """
    path = Path(path)
    try:
        text = _text(path)
    except IsADirectoryError:
        raise ImportProblem("a folder", "a file, as problem.yaml", file=str(path)) from None
    source, module = _kind(text, path)
    if not module:
        if options:
            raise ImportProblem(f"`{next(iter(options))}`", "no options for obsdeg's own files", file=str(path))
        _own(text, path)
        return Imported(text, source, "obsdeg")
    reader = _needed(module, source)
    try:
        system = reader.load(path, **options)
    except (RecursionError, MemoryError) as error:
        construct = f"more than this machine can take on ({type(error).__name__})"
        raise ImportProblem(construct, "a smaller model", file=str(path)) from None
    except TypeError as error:
        if "keyword argument" not in str(error):
            raise
        raise ImportProblem(f"the option in `{error}`", f"those of the reader of {source}", file=str(path)) from None
    try:
        return Imported(_needed("system", source).to_toml(system), "model", source, tuple(system.notes))
    except ImportProblem as problem:
        raise problem.located(file=str(path)) from None
    except RecursionError:
        construct = "formulas with too many operations in each other"
        raise ImportProblem(construct, "a simpler model", file=str(path)) from None


def _text(path: Path) -> str:
    try:
        return read_text(path, errors="replace").lstrip("\ufeff")
    except ValueError:
        expected = f"a text of at most {TEXT}"
        raise ImportProblem(f"more than {TEXT} characters", expected, file=str(path)) from None


def _own(text: str, path: Path) -> None:
    """Refuses a text that is not in a format of obsdeg; its content is read when it is judged."""
    is_json = text.lstrip().startswith("{")
    try:
        found: Any = json.loads(text) if is_json else _toml.loads(text)
    except ValueError as error:
        raise ImportProblem(f"a text that is no {'JSON' if is_json else 'TOML'} ({error})", "a model or scheme", file=str(path)) from None
    if not found:
        raise ImportProblem("nothing", "a model or scheme", file=str(path))


def __dir__() -> list[str]:
    return sorted([*__all__, *_LATER])


def __getattr__(name: str) -> Any:
    # SymPy is imported when something is read
    if name in _LATER:
        return getattr(importlib.import_module(_LATER[name], __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def _needed(module: str, source: str) -> Any:
    try:
        return importlib.import_module(f".{module}", __name__)
    except ModuleNotFoundError as error:
        packages = {"libsbml": "python-libsbml", "yaml": "pyyaml"}
        message = f"{source} is read with the package `{packages.get(error.name or '', error.name)}`, which is not installed"
        raise ImportError(message, name=error.name) from None


def _kind(text: str, path: Path) -> tuple[str, str]:
    """Kind of a file and the module that reads it; None for a model or scheme of obsdeg's own."""
    ending = path.suffix.lower()
    head = text.lstrip()
    if head.startswith("<"):
        if re.search(r"<(\w+:)?sbml[\s>]", head[:4000]):
            return "SBML", "sbml"
        raise ImportProblem("XML that is no SBML", "<sbml ...>", file=str(path))
    if re.search(r"^format_version\s*:", text, re.MULTILINE):
        return "PEtab", "petab"
    if "@ODEmodel" in text or "@DDSmodel" in text:
        return "SI.jl", "sijl"
    if ending == ".m" or (re.search(r"^\s*syms\s", text, re.MULTILINE) and re.search(r"^\s*save\b", text, re.MULTILINE)):
        return "STRIKE-GOLDD", "strike_goldd"
    if ending == ".py" and re.search(r"^rates\s*=", text, re.MULTILINE):
        return "SymPy", "sympy_system"
    if head.startswith("{"):
        return ("model" if '"equations"' in text else "scheme"), ""
    if re.search(r"^\s*\[(states|outputs)\b", text, re.MULTILINE):
        return "model", ""
    if ending == ".toml" or re.search(r"^\s*(\[\[position\]\]|positions?\s*=|angles\s*=)", text, re.MULTILINE):
        return "scheme", ""
    expected = "SBML, PEtab (its YAML), @ODEmodel, @DDSmodel, a script of STRIKE-GOLDD, SymPy, or a model or scheme of obsdeg"
    raise ImportProblem(f"a file of no known kind (`{ending or path.name}`)", expected, file=str(path))

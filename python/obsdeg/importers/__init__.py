"""Models from elsewhere in obsdeg's own format.

`load` reads SBML, PEtab problems, `@ODEmodel` texts of StructuralIdentifiability.jl, MATLAB scripts of STRIKE-GOLDD, systems written with SymPy, and obsdeg's own
models and schemes. What has no counterpart is refused with an `ImportProblem`, which names construct and place.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .problem import ImportProblem
from .system import System, to_toml

__all__ = ["ImportProblem", "Imported", "System", "load", "to_toml"]


@dataclass(frozen=True)
class Imported:
    """A model or scheme as text.

    Attributes:
        text: A model file (TOML, or obsdeg's JSON), or a scheme file.
        kind: ``"model"`` or ``"scheme"``.
        source: What it was read from: ``"SBML"``, ``"PEtab"``, ``"SI.jl"``, ``"STRIKE-GOLDD"``, ``"SymPy"`` or ``"obsdeg"``.
        notes: What the reader of an answer has to know of the import.
    """

    text: str
    kind: str
    source: str
    notes: tuple[str, ...] = field(default=())


def load(path: str | Path, **options: Any) -> Imported:
    """Reads a file of any known kind.

    Arguments:
        path: The file; what it is, is seen from what it says, and then from its ending.
        options: Those of the reader: `sbml.load`, `petab.load`, `sijl.load`, `strike_goldd.load`.

    Raises:
        ImportProblem: a construct without a counterpart, or a file of no known kind.
        FileNotFoundError: there is none.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8", errors="replace").lstrip("\ufeff")
    except IsADirectoryError:
        raise ImportProblem("a folder", "a file, as problem.yaml", file=str(path)) from None
    source, reader = _kind(text, path)
    if reader is None:
        if options:
            raise ImportProblem(f"`{next(iter(options))}`", "no options for obsdeg's own files", file=str(path))
        return Imported(text, source, "obsdeg")
    try:
        system = reader(path, **options)
    except TypeError as error:
        if "keyword argument" not in str(error):
            raise
        raise ImportProblem(f"the option in `{error}`", f"those of the reader of {source}", file=str(path)) from None
    try:
        return Imported(to_toml(system), "model", source, tuple(system.notes))
    except ImportProblem as problem:
        raise problem.located(file=str(path)) from None


def _kind(text: str, path: Path) -> tuple[str, Callable[..., System] | None]:
    """What a file is, and who reads it; a model or scheme of obsdeg's own has no reader."""
    ending = path.suffix.lower()
    head = text.lstrip()
    if head.startswith("<"):
        if re.search(r"<(\w+:)?sbml[\s>]", head[:4000]):
            from . import sbml

            return "SBML", sbml.load
        raise ImportProblem("XML that is no SBML", "<sbml ...>", file=str(path))
    if re.search(r"^format_version\s*:", text, re.MULTILINE):
        from . import petab

        return "PEtab", petab.load
    if "@ODEmodel" in text:
        from . import sijl

        return "SI.jl", sijl.load
    if ending == ".m" or (re.search(r"^\s*syms\s", text, re.MULTILINE) and re.search(r"^\s*save\b", text, re.MULTILINE)):
        from . import strike_goldd

        return "STRIKE-GOLDD", strike_goldd.load
    if ending == ".py" and re.search(r"^rates\s*=", text, re.MULTILINE):
        from . import sympy_system

        return "SymPy", sympy_system.load
    if head.startswith("{"):
        return ("model" if '"equations"' in text else "scheme"), None
    if re.search(r"^\s*\[(states|outputs)\b", text, re.MULTILINE):
        return "model", None
    if ending == ".toml" or re.search(r"^\s*(\[\[position\]\]|positions?\s*=|angles\s*=)", text, re.MULTILINE):
        return "scheme", None
    expected = "SBML, PEtab (its YAML), @ODEmodel, a script of STRIKE-GOLDD, SymPy, or a model or scheme of obsdeg"
    raise ImportProblem(f"a file of no known kind (`{ending or path.name}`)", expected, file=str(path))

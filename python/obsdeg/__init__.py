"""Exact observable degrees: which unknowns a system's output determines, and with how many derivatives.

>>> import obsdeg
>>> answer = obsdeg.analyze(angles=[(0, 0, 0), (180, 0, 0)], carry="inertial")
>>> answer.degrees["D_FX"]
1

Options are those of the command line in snake case; answers are its JSON, byte for byte, with attributes. Angles are exact: an ``int``,
a ``str``, a ``Decimal``, or a ``float`` by its shortest text. What is wrong with a request is a :class:`ProblemError`, a ``ValueError`` with ``message``,
``file``, ``line`` and ``column``.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from . import _obsdeg
from ._files import Judged, Model, Scheme, source
from ._obsdeg import ProblemError, __version__
from ._progress import heard
from ._results import (
    Analysis,
    Answer,
    Audit,
    Calibration,
    Comparison,
    CrossCheck,
    Design,
    Part,
    Progress,
    Record,
    Report,
    Simulation,
    SystemAnalysis,
)
from ._texts import Attitude, Number, assignments, attitude, decimal

__all__ = [
    "Analysis",
    "Answer",
    "Audit",
    "Calibration",
    "Comparison",
    "CrossCheck",
    "Design",
    "Model",
    "Part",
    "ProblemError",
    "Record",
    "Report",
    "Scheme",
    "Simulation",
    "SystemAnalysis",
    "__version__",
    "analyze",
    "calibrate",
    "compare",
    "crosscheck",
    "design",
    "load",
    "paper",
    "report",
    "simulate",
]

#: Options that are lists of `NAME=X`.
_ASSIGNED = {"requirement", "value", "prior", "estimate", "max_degree"}
#: Options that are exact decimals.
_EXACT = {"latitude", "filter_latitude", "round"}


def _option(name: str, value: Any) -> Any:
    if value is None:
        return None
    if name == "angles":
        return [attitude(a) for a in value]
    if name in _EXACT:
        return decimal(value)
    if name in _ASSIGNED and not isinstance(value, (int, float)):
        return assignments(value)
    if name == "max_degree":
        return [str(value)]
    if name in ("terms", "combination", "gimbal", "observable", "profile"):
        texts = [value] if isinstance(value, str) else list(value)
        return ",".join(texts) if name == "terms" else texts
    if isinstance(value, (list, tuple)):
        return ",".join(map(decimal, value)) if name in ("angle_random_walk", "rate_random_walk", "bias_instability") else list(value)
    if isinstance(value, (bool, str, int)):
        return value
    return float(decimal(value))


def _request(options: Mapping[str, Any], **files: Any) -> str:
    asked = {name: _option(name, value) for name, value in options.items()}
    asked.update({name: value for name, value in files.items() if value})
    return json.dumps({name: value for name, value in asked.items() if value is not None})


def _ask(kind: type[Any], command: str, request: str, progress: Progress | bool | None = None) -> Any:
    show, bar = heard(progress)
    try:
        return kind(_obsdeg.answer(command, request, show), (command, request, None))
    finally:
        if bar is not None:
            bar.close()


def _several(what: Iterable[Judged]) -> list[dict[str, str]]:
    return [source(w) for w in what]



def analyze(*what: Judged, progress: Progress | bool | None = None, **options: Any) -> Any:
    """The observable degree of every unknown of schemes and models.

    Args:
        what: schemes, models, or files with them; none where ``angles`` are given.
        options: ``angles``, ``carry``, ``latitude`` [deg], ``terms``, ``axes``, ``combination``, ``path``, ``measured_azimuth``, ``order``,
            ``count_limit``, ``solutions``, ``frame``, ``formulas``, ``seed``: those of ``obsdeg analyze``.

    Returns:
        An :class:`Analysis`, of a model a :class:`SystemAnalysis`; of several files an :class:`Answer` with a list.

    Raises:
        ProblemError: what is wrong, with its place.
    """
    sources = _several(what)
    kind: type[Answer] = Analysis if len(sources) < 2 else Answer
    if len(sources) == 1 and (isinstance(what[0], Model) or _says_model(sources[0])):
        kind = SystemAnalysis
    return _ask(kind, "analyze", _request(options, sources=sources), progress)


def _says_model(one: Mapping[str, str]) -> bool:
    text = one["text"]
    return text.lstrip().startswith("{") or "[outputs]" in text


def simulate(*what: Judged, **options: Any) -> Simulation:
    """One run of the filter against a simulated truth; options are those of ``obsdeg simulate`` (noise in g, dwell and step in s).

    Raises:
        ProblemError: what is wrong, with its place.
    """
    answer: Simulation = _ask(Simulation, "simulate", _request(options, sources=_several(what)))
    return answer


def crosscheck(*what: Judged, progress: Progress | bool | None = None, **options: Any) -> CrossCheck:
    """The exact verdicts against a filter; ``passed`` is False where something disagrees.

    Raises:
        ProblemError: what is wrong, with its place.
    """
    answer: CrossCheck = _ask(CrossCheck, "crosscheck", _request(options, sources=_several(what)), progress)
    return answer


def compare(*what: Judged, **options: Any) -> Comparison:
    """Schemes side by side; options are those of ``obsdeg compare``.

    Raises:
        ProblemError: what is wrong, with its place.
    """
    answer: Comparison = _ask(Comparison, "compare", _request(options, sources=_several(what)))
    return answer


def design(
    positions: int | None = None,
    *,
    candidates: str | Scheme | os.PathLike[str] | None = None,
    part: tuple[int, int] | None = None,
    resume: Part | str | None = None,
    merge: Iterable[Part | str] | None = None,
    progress: Progress | bool | None = None,
    **options: Any,
) -> Any:
    """Finds schemes: the best of so many positions, or with ``minimum=True`` the fewest that do.

    Args:
        positions: how many.
        candidates: ``"cardinal"``, ``"grid:45"``, ``"free"``, or a scheme whose positions are chosen from.
        part: (I, N): only part I of N of all sequences; the answer is a :class:`Part`.
        resume: that part as far as it came.
        merge: the parts, put together to the answer of the whole.
        progress: hears how far the search is; ``True`` for a bar of tqdm. Where it returns False, and on a keyboard interrupt, the search ends
            with the best so far.
        options: the others of ``obsdeg design``.

    Raises:
        ProblemError: what is wrong; nothing was found.
    """
    files: dict[str, Any] = {}
    if isinstance(candidates, str) and (candidates in ("cardinal", "free") or candidates.startswith("grid:")):
        options["candidates"] = candidates
    elif candidates is not None:
        files["candidates_file"] = source(candidates)
    if resume is not None:
        files["resume"] = _part(resume, "resume")
    if merge is not None:
        files["merge"] = [_part(p, f"part {i + 1}") for i, p in enumerate(merge)]
    if part is not None:
        options["part"] = list(part)
    if positions is not None:
        options["positions"] = positions
    return _ask(Part if part is not None else Design, "design", _request(options, **files), progress)


def _part(part: Part | str, name: str) -> dict[str, str]:
    return {"name": name, "text": part if isinstance(part, str) else part.json()}


def calibrate(
    what: Judged,
    *records: Any,
    prior: Calibration | str | os.PathLike[str] | None = None,
    progress: Progress | bool | None = None,
    **options: Any,
) -> Calibration:
    """What a scheme or model determines, estimated from the records of its runs.

    Args:
        what: the scheme or model.
        records: files (CSV, Parquet), or pandas DataFrames whose columns are named as in files (``t [s]``, ``fx [g]``).
        prior: a calibration before.

    Raises:
        ProblemError: what is wrong with a record, with its line.
    """
    files: dict[str, Any] = {"sources": [source(what)]}
    if prior is not None:
        text = prior.json() if isinstance(prior, Calibration) else Path(prior).read_text(encoding="utf-8")
        files["before"] = {"name": "prior", "text": text}
    request = _request(options, **files)
    given = [_record(r, i) for i, r in enumerate(records)]
    show, bar = heard(progress)
    try:
        return Calibration(_obsdeg.calibrate(request, given, show), ("calibrate", request, given))
    finally:
        if bar is not None:
            bar.close()


def _record(record: Any, i: int) -> tuple[str, bytes | None]:
    if hasattr(record, "to_csv"):
        return f"record {i + 1}", record.to_csv(index=False).encode()
    return os.fspath(record), None


def report(
    *what: Judged,
    calibrations: Mapping[str, Calibration] | None = None,
    progress: Progress | bool | None = None,
    **options: Any,
) -> Report:
    """The design review of schemes and models, as a page.

    Raises:
        ProblemError: what is wrong, with its place.
    """
    given = [{"name": name, "source": {"name": name, "text": c.json()}} for name, c in (calibrations or {}).items()]
    request = _request(options, sources=_several(what), calibrations=given, command="obsdeg.report(...) in Python")
    answer: Report = _ask(Report, "report", request, progress)
    return answer


def paper(*, seed: int = 1) -> Audit:
    """The equations and claims of the paper against the algebra."""
    answer: Audit = _ask(Audit, "paper", _request({"seed": seed}))
    return answer


def load(path: str | os.PathLike[str], **options: Any) -> Any:
    """A scheme or a model from a file, of this program or of others: TOML, JSON, SBML, PEtab, ``@ODEmodel``, STRIKE-GOLDD.

    Raises:
        obsdeg.importers.ImportProblem: what cannot be imported, by construct and place.
    """
    from .importers import load as imported

    found = imported(Path(path), **options)
    kind = Scheme if getattr(found, "kind", "model") == "scheme" else Model
    return kind.from_text(found.text, name=os.fspath(path))

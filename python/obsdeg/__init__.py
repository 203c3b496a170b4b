"""Exact observable degrees: which unknowns a system's output determines, and with how many derivatives.

>>> import obsdeg
>>> answer = obsdeg.analyze(angles=[(0, 0, 0), (180, 0, 0)], carry="inertial")
>>> answer.degrees["D_FX"]
1

Options are those of the command line in snake case; answers are the JSON of a command line without the symbolic engine, byte for byte, with attributes. Angles are exact: an ``int``,
a ``str``, a ``Decimal``, or a ``float`` by its shortest text. What is wrong with a request is a :class:`ProblemError`, a ``ValueError`` with ``message``,
``file``, ``line`` and ``column``.
"""

from __future__ import annotations

import importlib
import operator
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, overload

from . import _obsdeg
from . import options as options
from . import shapes as shapes
from ._files import Judged, Model, Scheme, Text, Texted, read_text, source
from ._obsdeg import ProblemError, __version__
from ._progress import heard
from ._records import Record
from ._results import (
    KINDS,
    Analysis,
    Answer,
    Audit,
    Calibration,
    Comparison,
    CrossCheck,
    Design,
    Judgement,
    Judgements,
    Part,
    Progress,
    Report,
    Simulation,
    SystemAnalysis,
    SystemCalibration,
    SystemEvidence,
    SystemRun,
    Walks,
)
from ._texts import as_json, assignments, attitudes, decimal

if TYPE_CHECKING:
    import pandas
    from typing_extensions import Unpack

    class _Calibrate(options.Calibrate, total=False):
        prior: Calibration | SystemCalibration | str | os.PathLike[str]
        progress: Progress | bool

__all__ = [
    "Analysis",
    "Answer",
    "Audit",
    "Calibration",
    "Comparison",
    "CrossCheck",
    "Design",
    "Judgement",
    "Judgements",
    "Model",
    "Part",
    "ProblemError",
    "Record",
    "Report",
    "Scheme",
    "SensorNoise",
    "Simulation",
    "SystemAnalysis",
    "SystemCalibration",
    "SystemEvidence",
    "SystemRun",
    "Text",
    "Walks",
    "__version__",
    "allan",
    "analyze",
    "calibrate",
    "compare",
    "crosscheck",
    "design",
    "load",
    "options",
    "paper",
    "report",
    "shapes",
    "simulate",
]


def _texts(value: Any) -> list[str]:
    return [value] if isinstance(value, str) else list(value)


def _plain(value: Any) -> Any:
    if isinstance(value, (bool, str, int)):
        return value
    if type(value).__name__ in ("bool_", "bool"):
        # of numpy
        return bool(value)
    if hasattr(value, "__index__"):
        return operator.index(value)
    return list(value) if isinstance(value, (list, tuple)) else float(decimal(value))


def _per_axis(value: Any) -> Any:
    several = isinstance(value, (list, tuple)) or getattr(value, "ndim", 0) == 1
    return ",".join(map(decimal, value)) if several else _plain(value)


def _max_degree(value: Any) -> list[str]:
    return [str(value)] if isinstance(value, int) else assignments(value)


#: How options are read that are not as JSON has them.
_READ: dict[str, Callable[[Any], Any]] = {
    "angles": attitudes,
    "latitude": decimal,
    "filter_latitude": decimal,
    "round": decimal,
    "requirement": assignments,
    "bench": assignments,
    "value": assignments,
    "prior": assignments,
    "estimate": assignments,
    "max_degree": _max_degree,
    "terms": lambda value: ",".join(_texts(value)),
    "combination": _texts,
    "gimbal": _texts,
    "observable": _texts,
    "profile": _texts,
    "angle_random_walk": _per_axis,
    "rate_random_walk": _per_axis,
    "bias_instability": _per_axis,
}


def _request(options: Mapping[str, Any], **files: Any) -> str:
    read = _READ.get
    asked = {name: read(name, _plain)(value) for name, value in options.items() if value is not None}
    for name, value in files.items():
        if value:
            asked[name] = value
    return as_json(asked)


def _ask(kinds: tuple[type[Answer], ...], command: str, request: str, progress: Progress | bool | None = None) -> Any:
    """What a command answers; where that may be of several kinds it says which."""
    asked = (command, request, None)
    if progress is None:
        return _as(kinds, _obsdeg.answer(command, request), asked)
    show, bar = heard(progress)
    try:
        return _as(kinds, _obsdeg.answer(command, request, show), asked)
    finally:
        if bar is not None:
            bar.close()


def _as(kinds: tuple[type[Answer], ...], rust: _obsdeg.Answer, asked: Any) -> Any:
    if len(kinds) == 1:
        return kinds[0](rust, asked)
    kind = Judgements if rust.layout is None else KINDS[rust.layout]
    return kind(rust, asked)


def _kinds(what: tuple[Judged, ...], of_scheme: type[Answer], of_model: type[Answer]) -> tuple[type[Answer], ...]:
    """Whether it is a scheme or a model is known of all but files."""
    if not what or len(what) == 1 and isinstance(what[0], Scheme):
        return (of_scheme,)
    if len(what) == 1 and isinstance(what[0], Model):
        return (of_model,)
    return (of_scheme, of_model)


def _several(what: Iterable[Judged]) -> list[dict[str, str]]:
    return [source(w) for w in what]


@overload
def analyze(*, progress: Progress | bool | None = ..., **options: Unpack[options.Analyze]) -> Analysis: ...


@overload
def analyze(what: Scheme, /, *, progress: Progress | bool | None = ..., **options: Unpack[options.Analyze]) -> Analysis: ...


@overload
def analyze(what: Model, /, *, progress: Progress | bool | None = ..., **options: Unpack[options.Analyze]) -> SystemAnalysis: ...


@overload
def analyze(
    what: str | os.PathLike[str] | Texted, /, *, progress: Progress | bool | None = ..., **options: Unpack[options.Analyze]
) -> Analysis | SystemAnalysis: ...


@overload
def analyze(
    what: Judged, other: Judged, /, *more: Judged, progress: Progress | bool | None = ..., **options: Unpack[options.Analyze]
) -> Judgements: ...


def analyze(*what: Judged, progress: Progress | bool | None = None, **options: Any) -> Any:
    """The observable degree of every unknown of schemes and models.

    Args:
        what: schemes, models, or files with them; none where ``angles`` are given.
        progress: called ten times a second; ``True`` for a bar of tqdm. Where it returns False the analysis ends
            with a ``KeyboardInterrupt``, as it does where a key is pressed.
        options: ``angles``, ``carry``, ``latitude`` [deg], ``terms``, ``axes``, ``combination``, ``path``, ``measured_azimuth``, ``order``,
            ``count_limit``, ``solutions``, ``frame``, ``formulas``, ``seed``: those of ``obsdeg analyze``.

    Returns:
        An :class:`Analysis`, of a model a :class:`SystemAnalysis`; of several :class:`Judgements`.

    Raises:
        ProblemError: what is wrong, with its place.
    """
    kinds = (Judgements,) if len(what) > 1 else _kinds(what, Analysis, SystemAnalysis)
    return _ask(kinds, "analyze", _request(options, sources=_several(what)), progress)


@overload
def simulate(*, progress: Progress | bool | None = ..., **options: Unpack[options.Simulate]) -> Simulation: ...


@overload
def simulate(what: Scheme, /, *, progress: Progress | bool | None = ..., **options: Unpack[options.Simulate]) -> Simulation: ...


@overload
def simulate(what: Model, /, *, progress: Progress | bool | None = ..., **options: Unpack[options.Simulate]) -> SystemRun: ...


@overload
def simulate(
    what: str | os.PathLike[str] | Texted, /, *, progress: Progress | bool | None = ..., **options: Unpack[options.Simulate]
) -> Simulation | SystemRun: ...


def simulate(*what: Judged, progress: Progress | bool | None = None, **options: Any) -> Any:
    """One run of the filter against a simulated truth.

    Args:
        what: a scheme or model with numbers, or a file with one; none where ``angles`` are given.
        progress: called ten times a second; where it returns False the run ends with a ``KeyboardInterrupt``.
        options: those of ``obsdeg simulate``: ``dwell`` and ``step`` [s], ``noise`` [g], ``requirement``, ``truth``, ``filter``, ...

    Returns:
        A :class:`Simulation`, of a model a :class:`SystemRun`.

    Raises:
        ProblemError: what is wrong, with its place.
    """
    return _ask(_kinds(what, Simulation, SystemRun), "simulate", _request(options, sources=_several(what)), progress)


@overload
def crosscheck(*, progress: Progress | bool | None = ..., **options: Unpack[options.Crosscheck]) -> CrossCheck: ...


@overload
def crosscheck(what: Scheme, /, *, progress: Progress | bool | None = ..., **options: Unpack[options.Crosscheck]) -> CrossCheck: ...


@overload
def crosscheck(what: Model, /, *, progress: Progress | bool | None = ..., **options: Unpack[options.Crosscheck]) -> SystemEvidence: ...


@overload
def crosscheck(
    what: str | os.PathLike[str] | Texted, /, *, progress: Progress | bool | None = ..., **options: Unpack[options.Crosscheck]
) -> CrossCheck | SystemEvidence: ...


def crosscheck(*what: Judged, progress: Progress | bool | None = None, **options: Any) -> Any:
    """The exact verdicts against a filter; ``passed`` is False where something disagrees.

    Args:
        what: a scheme or model with numbers, or a file with one; none where ``angles`` are given.
        progress: hears how far it is, and ends it where it returns False; ``True`` for a bar of tqdm.
        options: those of ``obsdeg crosscheck``: of :func:`simulate`, and ``runs``, ``filter_carry``, ``filter_latitude`` [deg], ``filter_drop``.

    Returns:
        A :class:`CrossCheck`, of a model a :class:`SystemEvidence`.

    Raises:
        ProblemError: what is wrong, with its place.
    """
    return _ask(_kinds(what, CrossCheck, SystemEvidence), "crosscheck", _request(options, sources=_several(what)), progress)


def compare(*what: Judged, progress: Progress | bool | None = None, **options: Unpack[options.Compare]) -> Comparison:
    """Schemes side by side: degrees, and sigmas of the coefficients at the end of each.

    Args:
        what: schemes, or files with them.
        progress: called ten times a second; where it returns False the comparison ends with a
            ``KeyboardInterrupt``.
        options: those of ``obsdeg compare``: ``dwell`` and ``step`` [s], ``noise`` [g], ``requirement``, ...

    Raises:
        ProblemError: what is wrong, with its place.
    """
    answer: Comparison = _ask((Comparison,), "compare", _request(options, sources=_several(what)), progress)
    return answer


@overload
def design(
    positions: int | None = None,
    *,
    part: tuple[int, int],
    conditions: Scheme | str | os.PathLike[str] | None = ...,
    candidates: Literal["cardinal", "free"] | str | Scheme | os.PathLike[str] | None = ...,
    resume: Part | str | None = ...,
    progress: Progress | bool | None = ...,
    **options: Unpack[options.Design],
) -> Part: ...


@overload
def design(
    positions: int,
    *,
    candidates: Literal["cardinal", "free"] | str | Scheme | os.PathLike[str] | None = ...,
    part: None = ...,
    conditions: Scheme | str | os.PathLike[str] | None = ...,
    merge: Iterable[Part | str] | None = ...,
    progress: Progress | bool | None = ...,
    **options: Unpack[options.Design],
) -> Design: ...


@overload
def design(
    positions: int | None = None,
    *,
    candidates: Literal["cardinal", "free"] | str | Scheme | os.PathLike[str] | None = ...,
    part: None = ...,
    conditions: Scheme | str | os.PathLike[str] | None = ...,
    merge: Iterable[Part | str] | None = ...,
    progress: Progress | bool | None = ...,
    **options: Unpack[options.Design],
) -> Design | Walks: ...


def design(
    positions: int | None = None,
    *,
    candidates: str | Scheme | os.PathLike[str] | None = None,
    part: tuple[int, int] | None = None,
    conditions: Scheme | str | os.PathLike[str] | None = None,
    resume: Part | str | None = None,
    merge: Iterable[Part | str] | None = None,
    progress: Progress | bool | None = None,
    **options: Any,
) -> Any:
    """Finds schemes: the best of so many positions, or with ``minimum=True`` the fewest that do.

    Args:
        positions: how many.
        candidates: ``"cardinal"``, ``"grid:45"``, ``"free"``, or a scheme whose positions are chosen from.
        conditions: a scheme whose conditions hold; as many positions as it has are searched where no number is asked for.
        part: (I, N): only part I of N of all sequences; the answer is a :class:`Part`.
        resume: that part as far as it came.
        merge: the parts, put together to the answer of the whole; they know the options of their search. What they list is evaluated again;
            that they were searched as they state is believed, but for ``check=N`` blocks that are searched again.
        progress: hears how far the search is; ``True`` for a bar of tqdm. Where it returns False, and on a keyboard interrupt, the search ends
            with the best so far.
        options: the others of ``obsdeg design``.

    Returns:
        A :class:`Design`; a :class:`Part` of one with ``part``; :class:`Walks` with ``minimum=True`` where torquer errors are among the ``terms``.

    Raises:
        ProblemError: what is wrong; nothing was found.
    """
    files: dict[str, Any] = {}
    if isinstance(candidates, str) and (candidates in ("cardinal", "free") or candidates.startswith("grid:")):
        options["candidates"] = candidates
    elif candidates is not None:
        files["candidates_file"] = source(candidates)
    if conditions is not None:
        files["conditions_file"] = source(conditions)
    if resume is not None:
        files["resume"] = _part(resume, "resume")
    if merge is not None:
        if not merge:
            raise ValueError("merge: found no part; expected every part of a search")
        files["merge"] = [_part(p, f"part {i + 1}") for i, p in enumerate(merge)]
    if part is not None:
        options["part"] = list(part)
    if positions is not None:
        options["positions"] = positions
    kinds = (Part,) if part is not None else (Design, Walks) if positions is None else (Design,)
    return _ask(kinds, "design", _request(options, **files), progress)


def _part(part: Part | str, name: str) -> dict[str, str]:
    if not isinstance(part, (str, Answer)):
        raise TypeError(f"{name}: found a {type(part).__name__}; expected a part of a search, or its JSON")
    return {"name": name, "text": part if isinstance(part, str) else part.json()}


@overload
def calibrate(what: Scheme, *records: str | os.PathLike[str] | pandas.DataFrame, **options: Unpack[_Calibrate]) -> Calibration: ...


@overload
def calibrate(what: Model, *records: str | os.PathLike[str] | pandas.DataFrame, **options: Unpack[_Calibrate]) -> SystemCalibration: ...


@overload
def calibrate(
    what: str | os.PathLike[str] | Texted, *records: str | os.PathLike[str] | pandas.DataFrame, **options: Unpack[_Calibrate]
) -> Calibration | SystemCalibration: ...


def calibrate(what: Judged, *records: Any, prior: Any = None, progress: Progress | bool | None = None, **options: Any) -> Any:
    """What a scheme or model determines, estimated from the records of its runs; ``passed`` is False where the model does not explain them.

    Args:
        what: the scheme or model, or a file with one.
        records: files (CSV, Parquet), or pandas DataFrames whose columns are named as in files (``t [s]``, ``fx [g]``).
        prior: a calibration before, or the file that ``obsdeg calibrate -o`` wrote of it.
        progress: hears how far it is, and ends it where it returns False; ``True`` for a bar of tqdm.
        options: those of ``obsdeg calibrate``: ``noise`` [g], ``step`` [s], ``gravity`` [m/s^2], ``gate``, ``starts``, ``profile``, ...

    Returns:
        A :class:`Calibration`, of a model a :class:`SystemCalibration`.

    Raises:
        ProblemError: what is wrong with a record, with its line.
    """
    files: dict[str, Any] = {"sources": [source(what)]}
    if prior is not None:
        text = prior.json() if isinstance(prior, Answer) else read_text(prior)
        files["before"] = {"name": "prior", "text": text}
    request = _request(options, **files)
    given = [_record(r, i) for i, r in enumerate(records)]
    if not given:
        raise TypeError("no record; expected files or pandas DataFrames of the runs, after the scheme or model")
    show, bar = heard(progress)
    try:
        return _as(_kinds((what,), Calibration, SystemCalibration), _obsdeg.calibrate(request, given, show), ("calibrate", request, given))
    finally:
        if bar is not None:
            bar.close()


def allan(record: str | os.PathLike[str] | pandas.DataFrame, *, progress: Progress | bool | None = None, **options: Unpack[options.Allan]) -> SensorNoise:
    """The noise of gyros and accelerometers at rest: overlapping Allan deviation, coefficients with sigma, and the settings for simulations.

    Args:
        record: a file (CSV, Parquet), or a pandas DataFrame whose columns are named as in files (``t [s]``, ``wx [deg/h]``, ``fx [g]``).
        progress: hears how far it is, and ends it where it returns False; ``True`` for a bar of tqdm.
        options: those of ``obsdeg allan``: ``column``, ``confidence``, ``gravity`` [m/s^2].

    Returns:
        A :class:`SensorNoise`; ``passed`` is False where noise of these kinds does not explain the deviations.

    Raises:
        ProblemError: what is wrong with the record, with its line.
    """
    request, given = _request(options), [_record(record, 0)]
    show, bar = heard(progress)
    try:
        answer: SensorNoise = _as((SensorNoise,), _obsdeg.allan(request, given, show), ("allan", request, given))
        return answer
    finally:
        if bar is not None:
            bar.close()


def _record(record: Any, i: int) -> tuple[str, bytes | None]:
    if hasattr(record, "to_csv"):
        return f"record {i + 1}", record.to_csv(index=False).encode()
    if not isinstance(record, (str, os.PathLike)):
        kind = type(record).__name__
        raise TypeError(f"record {i + 1}: found a {kind}; expected a file (CSV, Parquet) or a pandas DataFrame, as to_pandas() of others gives")
    return os.fspath(record), None


def report(
    *what: Judged,
    calibrations: Mapping[str, Calibration | SystemCalibration] | None = None,
    progress: Progress | bool | None = None,
    **options: Unpack[options.Report],
) -> Report:
    """The design review of schemes and models, as a page.

    Args:
        what: schemes and models, or files with them.
        calibrations: what was estimated from records, by the names that the page calls them.
        progress: hears how far it is; ``True`` for a bar of tqdm.
        options: those of ``obsdeg report``: of :func:`simulate`, and ``runs``.

    Raises:
        ProblemError: what is wrong, with its place.
    """
    given = [{"name": name, "source": {"name": name, "text": c.json()}} for name, c in (calibrations or {}).items()]
    request = _request(options, sources=_several(what), calibrations=given, command="obsdeg.report(...) in Python")
    answer: Report = _ask((Report,), "report", request, progress)
    return answer


def paper(*, seed: int = 1) -> Audit:
    """The equations and claims of the paper against the algebra.

    Args:
        seed: seed of all random choices.
    """
    answer: Audit = _ask((Audit,), "paper", _request({"seed": seed}))
    return answer


def load(path: str | os.PathLike[str], **options: Any) -> Scheme | Model:
    """A scheme or a model from a file, of this program or of others: TOML, JSON, SBML, PEtab, ``@ODEmodel``, STRIKE-GOLDD.

    Raises:
        obsdeg.importers.ImportProblem: what cannot be imported, by construct and place.
    """
    from .importers import load as imported

    found = imported(Path(path), **options)
    kind = Scheme if found.kind == "scheme" else Model
    return kind.from_text(found.text, name=os.fspath(path))


def __getattr__(name: str) -> Any:
    # what is not always wanted is loaded when it is asked for
    if name in ("campaign", "importers"):
        return importlib.import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

"""The commands of the command line as functions."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, overload

from . import _obsdeg, options
from ._files import Texted
from ._model import Model
from ._progress import heard
from ._request import Judged, are_positions, request, source, sources
from ._results import (
    KINDS,
    Analysis,
    Answer,
    Audit,
    Calibration,
    Comparison,
    CrossCheck,
    Design,
    Judgements,
    NextPositions,
    Part,
    Procedure,
    Progress,
    Report,
    Sensors,
    Simulation,
    SystemAnalysis,
    SystemCalibration,
    SystemEvidence,
    SystemRun,
    Walks,
)
from ._scheme import Scheme
from ._signatures import named
from ._texts import DIGITS, Attitude, Rounded

if TYPE_CHECKING:
    from typing_extensions import Unpack

    Platform = Scheme | Iterable[Attitude]
    File = str | os.PathLike[str] | Texted


def ask(
    kinds: tuple[type[Answer], ...],
    command: str,
    request: str,
    rounded: list[Rounded],
    progress: Progress | bool | None = None,
) -> Any:
    """Answer of a command, as one of the given classes."""
    asked = (command, request, None)
    if progress is None:
        return answered(kinds, _obsdeg.answer(command, request), asked, rounded)
    show, bar = heard(progress)
    try:
        return answered(kinds, _obsdeg.answer(command, request, show), asked, rounded)
    finally:
        if bar is not None:
            bar.close()


def answered(kinds: tuple[type[Answer], ...], rust: _obsdeg.Answer, asked: Any, rounded: list[Rounded]) -> Any:
    """Answer of the engine in its class; the layout decides between several classes."""
    kind = kinds[0]
    if len(kinds) > 1:
        kind = Judgements if rust.layout is None else KINDS[rust.layout]
    return kind(rust, asked, tuple(rounded))


def kinds_of(what: tuple[Any, ...], of_scheme: type[Answer], of_model: type[Answer]) -> tuple[type[Answer], ...]:
    """Possible classes of an answer; both for a file, whose kind is not known yet."""
    if not what or isinstance(what[0], Scheme):
        return (of_scheme,)
    if isinstance(what[0], Model):
        return (of_model,)
    return (of_scheme,) if are_positions(what[0]) else (of_scheme, of_model)


def _one(
    command: str,
    kinds: tuple[type[Answer], ...],
    what: tuple[Judged, ...],
    options: Mapping[str, Any],
    digits: int | None,
    progress: Progress | bool | None,
) -> Any:
    """Calls a command that takes angles, schemes or models."""
    log: list[Rounded] = []
    if len(what) == 1 and "angles" not in options and are_positions(what[0]):
        asked = request({"angles": what[0], **options}, digits, log)
    else:
        given = sources(what, digits, log) if what else None
        asked = request(options, digits, log, sources=given)
    return ask(kinds, command, asked, log, progress)


@overload
def analyze(
    what: Platform = ..., /, *, digits: int | None = ..., progress: Progress | bool | None = ..., **options: Unpack[options.Analyze]
) -> Analysis: ...


@overload
def analyze(
    what: Model, /, *, digits: int | None = ..., progress: Progress | bool | None = ..., **options: Unpack[options.Analyze]
) -> SystemAnalysis: ...


@overload
def analyze(
    what: File, /, *, digits: int | None = ..., progress: Progress | bool | None = ..., **options: Unpack[options.Analyze]
) -> Analysis | SystemAnalysis: ...


@overload
def analyze(
    what: Judged,
    other: Judged,
    /,
    *more: Judged,
    digits: int | None = ...,
    progress: Progress | bool | None = ...,
    **options: Unpack[options.Analyze],
) -> Judgements: ...


@named(options.Analyze)
def analyze(*what: Judged, digits: int | None = DIGITS, progress: Progress | bool | None = None, **options: Any) -> Any:
    """The observable degree of every unknown of schemes and models.

    Parameters
    ----------
    *what : positions, Scheme, Model or path
        Systems to judge, one or several; none if ``angles`` are given.
    digits : int or None
        Decimals, 0 to 9, to which computed angles and latitudes are rounded; None rounds nothing.
        ``answer.rounded`` lists rounded values.
    progress : callable or bool
        Called ten times a second; True shows a bar of tqdm. If it returns False, the analysis ends with a
        ``KeyboardInterrupt``, as it does on Ctrl-C.
    **options
        Options of ``obsdeg analyze``, see :class:`obsdeg.options.Analyze` for units: ``carry``, ``latitude``
        [deg], ``terms``, ``axes``, ``combination``, ``path``, ``measured_azimuth``, ``order``, ``solutions``,
        ``frame``, ``formulas``, ``certificate``, ``seed``, ...

    Returns
    -------
    Analysis, SystemAnalysis or Judgements
        Answer for a scheme, for a model, or for several.

    Raises
    ------
    ProblemError
        Invalid request; the message gives the place.

    Examples
    --------
    >>> import obsdeg
    >>> answer = obsdeg.analyze([(0, 0, 0), (180, 0, 0)], carry="inertial")
    >>> answer["D_FX"].degree, answer["D_IX"].status
    (1, 'not_excited')
    >>> third = 100 / 3
    >>> print(obsdeg.analyze(["NUE", (third, 0, 0)]).rounded[0])
    alpha of position 2: 33.333333333333336 taken as 33.333333333
    """
    kinds = (Judgements,) if len(what) > 1 else kinds_of(what, Analysis, SystemAnalysis)
    return _one("analyze", kinds, what, options, digits, progress)


@overload
def simulate(
    what: Platform = ..., /, *, digits: int | None = ..., progress: Progress | bool | None = ..., **options: Unpack[options.Simulate]
) -> Simulation: ...


@overload
def simulate(
    what: Model, /, *, digits: int | None = ..., progress: Progress | bool | None = ..., **options: Unpack[options.Simulate]
) -> SystemRun: ...


@overload
def simulate(
    what: File, /, *, digits: int | None = ..., progress: Progress | bool | None = ..., **options: Unpack[options.Simulate]
) -> Simulation | SystemRun: ...


@named(options.Simulate)
def simulate(*what: Judged, digits: int | None = DIGITS, progress: Progress | bool | None = None, **options: Any) -> Any:
    """One run of the filter against a simulated truth.

    Parameters
    ----------
    *what : positions, Scheme, Model or path
        Scheme or model with numbers; none if ``angles`` are given.
    digits : int or None
        Same as for :func:`analyze`.
    progress : callable or bool
        Called ten times a second; if it returns False, the run ends with a ``KeyboardInterrupt``.
    **options
        Options of ``obsdeg simulate``, see :class:`obsdeg.options.Simulate` for units: ``dwell`` and ``step``
        [s], ``noise`` [g], ``requirement``, ``value`` and ``prior`` [deg, deg/h, deg/h/g], ``truth``,
        ``filter``, ...

    Returns
    -------
    Simulation or SystemRun
        Answer for a scheme, or for a model. ``run["D_FX"].sigma`` is in ``run["D_FX"].unit``.

    Raises
    ------
    ProblemError
        Invalid request; the message gives the place.

    Examples
    --------
    >>> import obsdeg
    >>> run = obsdeg.simulate([(0, 0, 0), (180, 0, 0)], carry="inertial", requirement={"D_FX": 0.05})
    >>> run["D_FX"].outcome, run["D_FX"].sigma < 0.05, run["D_FX"].unit
    ('reached', True, 'deg/h')
    """
    return _one("simulate", kinds_of(what, Simulation, SystemRun), what, options, digits, progress)


@named(options.Procedure)
def procedure(
    *what: Judged,
    rotations: File | None = None,
    digits: int | None = DIGITS,
    progress: Progress | bool | None = None,
    **options: Any,
) -> Procedure:
    """Sheet by which a scheme is run on the bench: steps in order of time with gimbal angles, turns, what the
    accelerometers should read, and what is known after each position.

    Parameters
    ----------
    *what : positions, Scheme or path
        Scheme with numbers; none if ``angles`` or ``rotations`` are given.
    rotations : path or text stream
        Rotation table instead of a scheme: rows k, Ux, Uy, Uz, angle [deg], T, T0, T1 [s].
    digits : int or None
        Same as for :func:`analyze`.
    progress : callable or bool
        Called ten times a second; if it returns False, the work ends with a ``KeyboardInterrupt``.
    **options
        Options of ``obsdeg procedure``, see :class:`obsdeg.options.Procedure` for units: ``settle`` [s],
        ``tilt`` [deg], ``slew_rate`` [deg/s], ``dwell`` [s], ``requirement``, ...

    Returns
    -------
    Procedure
        The sheet; ``passed`` is False if the gimbals cannot execute it.

    Raises
    ------
    ProblemError
        Invalid request; the message gives the place.

    Examples
    --------
    >>> import obsdeg
    >>> sheet = obsdeg.procedure([(0, 0, 0), (180, 0, 0)], carry="inertial", slew_rate=2, settle=30)
    >>> [step.kind for step in sheet.steps]
    ['set', 'wait', 'record', 'turn', 'wait', 'record']
    >>> sheet.total_s
    2090.0
    """
    if rotations is None:
        answer: Procedure = _one("procedure", (Procedure,), what, options, digits, progress)
        return answer
    log: list[Rounded] = []
    table = source(rotations, digits, log, "rotations")
    asked = request(options, digits, log, sources=sources(what, digits, log) if what else None, rotations=table)
    answer = ask((Procedure,), "procedure", asked, log, progress)
    return answer


@overload
def crosscheck(
    what: Platform = ..., /, *, digits: int | None = ..., progress: Progress | bool | None = ..., **options: Unpack[options.Crosscheck]
) -> CrossCheck: ...


@overload
def crosscheck(
    what: Model, /, *, digits: int | None = ..., progress: Progress | bool | None = ..., **options: Unpack[options.Crosscheck]
) -> SystemEvidence: ...


@overload
def crosscheck(
    what: File, /, *, digits: int | None = ..., progress: Progress | bool | None = ..., **options: Unpack[options.Crosscheck]
) -> CrossCheck | SystemEvidence: ...


@named(options.Crosscheck)
def crosscheck(*what: Judged, digits: int | None = DIGITS, progress: Progress | bool | None = None, **options: Any) -> Any:
    """Checks the exact verdicts against a filter; ``passed`` is False if they disagree.

    Parameters
    ----------
    *what : positions, Scheme, Model or path
        Scheme or model with numbers; none if ``angles`` are given.
    digits : int or None
        Same as for :func:`analyze`.
    progress : callable or bool
        Called with the progress; ends the work if it returns False. True shows a bar of tqdm.
    **options
        Options of ``obsdeg crosscheck``, see :class:`obsdeg.options.Crosscheck`: options of :func:`simulate`,
        and ``runs``, ``filter_carry``, ``filter_latitude`` [deg], ``filter_drop``.

    Returns
    -------
    CrossCheck or SystemEvidence
        Answer for a scheme, or for a model.

    Raises
    ------
    ProblemError
        Invalid request; the message gives the place.

    Examples
    --------
    >>> import obsdeg
    >>> pair = obsdeg.Scheme([(0, 0, 0), (180, 0, 0)], carry="inertial")
    >>> obsdeg.crosscheck(pair, runs=20).passed
    True
    >>> obsdeg.crosscheck(pair, runs=20, filter_carry="platform").passed
    False
    """
    return _one("crosscheck", kinds_of(what, CrossCheck, SystemEvidence), what, options, digits, progress)


@named(options.Compare)
def compare(
    *what: Judged, digits: int | None = DIGITS, progress: Progress | bool | None = None, **options: Unpack[options.Compare]
) -> Comparison:
    """Compares schemes side by side: degrees, and sigmas of the coefficients at the end of each.

    Parameters
    ----------
    *what : positions, Scheme or path
        Two schemes or more; schemes given as positions are called ``scheme 1``, ``scheme 2``, ...
    digits : int or None
        Same as for :func:`analyze`.
    progress : callable or bool
        Called ten times a second; if it returns False, the comparison ends with a ``KeyboardInterrupt``.
    **options
        Options of ``obsdeg compare``, see :class:`obsdeg.options.Compare`: ``dwell`` and ``step`` [s],
        ``noise`` [g], ``requirement``, ...

    Raises
    ------
    ProblemError
        Invalid request; the message gives the place.

    Examples
    --------
    >>> import obsdeg
    >>> three, four = [(0, 0, 0), (180, 0, 0), (90, 0, 0)], [(0, 0, 0), (180, 0, 0), (90, 0, 0), (0, 90, 0)]
    >>> [scheme.rank for scheme in obsdeg.compare(three, four, carry="inertial")]
    [(11, 15), (12, 15)]
    """
    log: list[Rounded] = []
    given = sources(what, digits, log)
    answer: Comparison = ask((Comparison,), "compare", request(options, digits, log, sources=given), log, progress)
    return answer


@overload
def design(
    positions: int | None = None,
    *,
    part: tuple[int, int],
    conditions: Platform | File | None = ...,
    candidates: Literal["cardinal", "free"] | str | Platform | File | None = ...,
    resume: Part | str | None = ...,
    digits: int | None = ...,
    progress: Progress | bool | None = ...,
    **options: Unpack[options.Design],
) -> Part: ...


@overload
def design(
    positions: int,
    *,
    candidates: Literal["cardinal", "free"] | str | Platform | File | None = ...,
    part: None = ...,
    conditions: Platform | File | None = ...,
    merge: Iterable[Part | str] | None = ...,
    digits: int | None = ...,
    progress: Progress | bool | None = ...,
    **options: Unpack[options.Design],
) -> Design: ...


@overload
def design(
    positions: int | None = None,
    *,
    candidates: Literal["cardinal", "free"] | str | Platform | File | None = ...,
    part: None = ...,
    conditions: Platform | File | None = ...,
    merge: Iterable[Part | str] | None = ...,
    digits: int | None = ...,
    progress: Progress | bool | None = ...,
    **options: Unpack[options.Design],
) -> Design | Walks: ...


@named(options.Design)
def design(
    positions: int | None = None,
    *,
    candidates: Any = None,
    part: tuple[int, int] | None = None,
    conditions: Any = None,
    resume: Part | str | None = None,
    merge: Iterable[Part | str] | None = None,
    digits: int | None = DIGITS,
    progress: Progress | bool | None = None,
    **options: Any,
) -> Any:
    """Finds the best schemes with a given number of positions, or the fewest sufficient positions with
    ``minimum=True``.

    Parameters
    ----------
    positions : int
        Number of positions.
    candidates : str, positions, Scheme or path
        Candidate attitudes: ``"cardinal"``, ``"grid:45"`` [deg], ``"free"``, or a scheme with the positions
        to choose from.
    part : (int, int)
        (I, N): searches part I of N of all sequences; the answer is a :class:`Part`.
    conditions : Scheme or path
        Scheme whose conditions apply. Its number of positions is the default of ``positions``.
    resume : Part or str
        Unfinished part to continue.
    merge : iterable of Part or str
        Parts to merge into the answer of the whole search; they contain its options. Listed schemes are
        evaluated again. The search itself is repeated only for ``check=N`` blocks.
    digits : int or None
        Same as for :func:`analyze`.
    progress : callable or bool
        Called with the progress; True shows a bar of tqdm. If it returns False, and on Ctrl-C, the search
        ends with the best scheme so far.
    **options
        Options of ``obsdeg design``, see :class:`obsdeg.options.Design`: ``minimum``, ``observable``,
        ``criterion``, ``dwell`` [s], ``max_time`` [s], ``gimbal`` [deg], ...

    Returns
    -------
    Design, Part or Walks
        A :class:`Part` if ``part`` is given; :class:`Walks` with ``minimum=True`` if the ``terms`` include
        torquer errors.

    Raises
    ------
    ProblemError
        Invalid request, or no scheme was found.

    Examples
    --------
    >>> import obsdeg
    >>> found = obsdeg.design(4, carry="inertial", observable="D_F")
    >>> len(found), len(found.winner()), found[0].positions[:2]
    (10, 4, ['NUE', 'UNW'])
    """
    files: dict[str, Any] = {}
    log: list[Rounded] = []
    if isinstance(candidates, str) and (candidates in ("cardinal", "free") or candidates.startswith("grid:")):
        options["candidates"] = candidates
    elif candidates is not None:
        files["candidates_file"] = source(candidates, digits, log, "candidates")
    if conditions is not None:
        files["conditions_file"] = source(conditions, digits, log, "conditions")
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
    return ask(kinds, "design", request(options, digits, log, **files), log, progress)


@named(options.Measure)
def measure(
    model: Model | File,
    candidates: str | Iterable[str] | None = None,
    *,
    own_outputs: bool = False,
    progress: Progress | bool | None = None,
    **options: Unpack[options.Measure],
) -> Sensors:
    """Finds the quantities to measure so that the unknowns of a model are observable: minimal sets, with
    proof.

    Parameters
    ----------
    model : Model or path
        The model.
    candidates : str or iterable of str
        Candidate quantities: ``"states"``, ``"outputs"``, ``"inputs"``, ``"parameters"``, ``"candidates"``
        (those of the file), ``"experiment"`` (the same outputs from another start), names and expressions such as ``"x1 + x3"`` [default: candidates if the file has
        any, else states].
    own_outputs : bool
        True: candidates are added to the outputs of the model. By default they replace the outputs.
    progress : callable or bool
        Called ten times a second; True shows a bar of tqdm. If it returns False, the search ends.
    **options
        Options, see :class:`obsdeg.options.Measure`: ``observable``, ``max_degree``, ``unique``, ``cost``,
        ``keep``, ``order``, ``work_limit``, ``seed``.

    Returns
    -------
    Sensors
        ``front`` from the cheapest set to the set with the smallest degree, ``sets``, ``quantities``, and
        their proofs. ``files()`` has the front and the degrees with each candidate as figures.

    Raises
    ------
    ProblemError
        Invalid request; the message gives the place.

    Examples
    --------
    >>> import obsdeg
    >>> chain = obsdeg.Model(states={"a": "-k*a", "b": "k*a - b"}, parameters=["k"], outputs={"y": "b"})
    >>> found = obsdeg.measure(chain, "states")
    >>> [(s.outputs, s.degree) for s in found.front]
    [(['b'], 2), (['a', 'b'], 1)]
    >>> found["b"].cheapest.outputs
    ['b']
    """
    asked: dict[str, Any] = dict(options)
    # an empty text means the candidates of the model
    if candidates is not None and not isinstance(candidates, Iterable):
        raise TypeError(f"candidates: found {candidates!r} of type {type(candidates).__name__}; expected a list of outputs")
    asked["measure"] = candidates if isinstance(candidates, str) else ", ".join(map(str, candidates or ()))
    log: list[Rounded] = []
    given = request({**asked, "own_outputs": own_outputs}, DIGITS, log, conditions_file=source(model, DIGITS, log, "model"))
    answer: Sensors = ask((Sensors,), "design", given, log, progress)
    return answer


@named(options.NextMeasurement)
def next_measurement(
    scheme: Platform | File,
    added: int = 1,
    *,
    candidates: Any = None,
    after: Calibration | None = None,
    days: Iterable[float] | None = None,
    digits: int | None = DIGITS,
    progress: Progress | bool | None = None,
    **options: Unpack[options.NextMeasurement],
) -> NextPositions:
    """Finds the next one or two positions to measure: compares all extensions of a scheme by candidates.

    Parameters
    ----------
    scheme : Scheme or path
        Scheme to extend, with its conditions and requirements.
    added : int
        Number of added positions: 1 or 2.
    candidates : str, positions, Scheme or path
        Candidate attitudes: ``"cardinal"`` (default), ``"grid:45"`` [deg], or a scheme with the positions to
        choose from.
    after : Calibration
        Previous calibration. The added positions are then a separate run.
    days : iterable of float
        Days since the calibration, ascending. The coefficients age as stated by ``[ageing]`` of the scheme.
        ``schedule`` has the runs that meet the requirements again after each number of days; the other fields
        hold for the last.
    digits : int or None
        Same as for :func:`analyze`.
    progress : callable or bool
        Called with the progress; True shows a bar of tqdm. If it returns False, the comparison ends with the
        best extensions so far.
    **options
        Options, see :class:`obsdeg.options.NextMeasurement`: ``observable``, ``requirement``, ``dwell`` [s],
        ``max_time`` [s], ``carry``, ...

    Returns
    -------
    NextPositions
        ``found`` (extensions, best first), ``before``, and ``meets`` (dwell that meets the requirements). With
        one added position ``by_candidate`` has every candidate, and ``files()`` has them as figures: a map of
        the attitudes, and the degrees with each.

    Raises
    ------
    ProblemError
        Invalid request; the message gives the place.

    Examples
    --------
    >>> import obsdeg
    >>> pair = obsdeg.Scheme(["NUE", "NDW"])
    >>> best = obsdeg.next_measurement(pair, observable="D_F", dwell=100)[0]
    >>> [r.name for r in best.resolves]
    ['D_FZ']
    """
    asked: dict[str, Any] = {**options, "next": added}
    files: dict[str, Any] = {}
    log: list[Rounded] = []
    if isinstance(candidates, str) and (candidates == "cardinal" or candidates.startswith("grid:")):
        asked["candidates"] = candidates
    elif candidates is not None:
        files["candidates_file"] = source(candidates, digits, log, "candidates")
    if days is not None:
        asked["days"] = [float(x) for x in days]
    if after is not None:
        if not isinstance(after, Answer):
            raise TypeError(f"after: found {after!r} of type {type(after).__name__}; expected a Calibration")
        files["after"] = {"name": "after", "text": after.json()}
    given = request(asked, digits, log, conditions_file=source(scheme, digits, log, "scheme"), **files)
    answer: NextPositions = ask((NextPositions,), "design", given, log, progress)
    return answer


def _part(part: Part | str, name: str) -> dict[str, str]:
    if not isinstance(part, (str, Answer)):
        raise TypeError(f"{name}: found a {type(part).__name__}; expected a part of a search, or its JSON")
    return {"name": name, "text": part if isinstance(part, str) else part.json()}


@named(options.Report)
def report(
    *what: Judged,
    calibrations: Mapping[str, Calibration | SystemCalibration] | None = None,
    digits: int | None = DIGITS,
    progress: Progress | bool | None = None,
    **options: Unpack[options.Report],
) -> Report:
    """Writes the design review of schemes and models as a page.

    Parameters
    ----------
    *what : positions, Scheme, Model or path
        Systems to review, one or several.
    calibrations : mapping
        Calibrations by their names on the page.
    digits : int or None
        Same as for :func:`analyze`.
    progress : callable or bool
        Called with the progress; True shows a bar of tqdm.
    **options
        Options of ``obsdeg report``, see :class:`obsdeg.options.Report`: options of :func:`simulate`, and
        ``runs``.

    Raises
    ------
    ProblemError
        Invalid request; the message gives the place.

    Examples
    --------
    >>> import obsdeg
    >>> page = obsdeg.report([(0, 0, 0), (180, 0, 0)], runs=2)  # doctest: +SKIP
    >>> page.write("review.html")  # doctest: +SKIP
    """
    log: list[Rounded] = []
    if calibrations is not None and not isinstance(calibrations, Mapping):
        raise TypeError(f"calibrations: found {calibrations!r} of type {type(calibrations).__name__}; expected calibrations by name")
    given = [{"name": name, "source": {"name": name, "text": c.json()}} for name, c in (calibrations or {}).items()]
    of = sources(what, digits, log)
    asked = request(options, digits, log, sources=of, calibrations=given, command="obsdeg.report(...) in Python")
    answer: Report = ask((Report,), "report", asked, log, progress)
    return answer


def paper(*, seed: int = 1) -> Audit:
    """Checks the equations and claims of the paper against the algebra.

    Parameters
    ----------
    seed : int
        Seed of all random choices.

    Examples
    --------
    >>> import obsdeg
    >>> obsdeg.paper().passed
    True
    """
    answer: Audit = ask((Audit,), "paper", request({"seed": seed}), [])
    return answer


def load(path: str | os.PathLike[str], **options: Any) -> Scheme | Model:
    """Reads a scheme or a model from a file of this program or of others: TOML, JSON, SBML, PEtab,
    ``@ODEmodel``, STRIKE-GOLDD.

    Parameters
    ----------
    path : path
        The file.
    **options
        Options of the reader for its kind, such as ``outputs={"y": "A + B"}`` for SBML.

    Raises
    ------
    obsdeg.importers.ImportProblem
        Unsupported construct; the message gives construct and place.

    Examples
    --------
    >>> import obsdeg, pathlib, tempfile
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "decay.jl"
    >>> length = file.write_text("ode = @ODEmodel(\\n    x1'(t) = -a*b*x1(t),\\n    y(t) = x1(t)\\n)\\n")
    >>> obsdeg.load(file).parameters
    ('a', 'b')
    """
    from .importers import load as imported

    found = imported(Path(path), **options)
    kind = Scheme if found.kind == "scheme" else Model
    return kind.from_text(found.text, name=os.fspath(path))

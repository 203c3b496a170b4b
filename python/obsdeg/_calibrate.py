"""Estimates from records: files, frames and arrays."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, overload

from . import _obsdeg, options
from ._commands import answered, kinds_of
from ._files import Texted, read_text
from ._model import Model
from ._progress import heard
from ._request import Judged, are_positions, request, source
from ._results import Answer, Calibration, Progress, SensorNoise, SystemCalibration
from ._scheme import Scheme
from ._signatures import named
from ._texts import DIGITS, Attitude, Rounded

if TYPE_CHECKING:
    from typing_extensions import Unpack

    #: A file, a text stream, a frame, or columns by name.
    Record = Any

    class _Calibrate(options.Calibrate, total=False):
        prior: Calibration | SystemCalibration | str | os.PathLike[str]
        digits: int | None
        progress: Progress | bool


@overload
def calibrate(
    what: Scheme | Iterable[Attitude],
    *records: Record,
    t: Any = ...,
    f: Any = ...,
    position: Any = ...,
    **options: Unpack[_Calibrate],
) -> Calibration: ...


@overload
def calibrate(
    what: Model, *records: Record, t: Any = ..., outputs: Mapping[str, Any] | None = ..., **options: Unpack[_Calibrate]
) -> SystemCalibration: ...


@overload
def calibrate(
    what: str | os.PathLike[str] | Texted,
    *records: Record,
    t: Any = ...,
    f: Any = ...,
    position: Any = ...,
    outputs: Mapping[str, Any] | None = ...,
    **options: Unpack[_Calibrate],
) -> Calibration | SystemCalibration: ...


@named(options.Calibrate)
def calibrate(
    what: Judged,
    *records: Any,
    t: Any = None,
    f: Any = None,
    position: Any = None,
    outputs: Mapping[str, Any] | None = None,
    prior: Any = None,
    digits: int | None = DIGITS,
    progress: Progress | bool | None = None,
    **options: Any,
) -> Any:
    """Estimates the unknowns that a scheme or model determines from the records of its runs; ``passed`` is
    False if the model does not explain them.

    Records are files, frames or arrays. Missing values (None, NaN, null, empty cells) are missing samples.
    The answer counts them by column (``answer.records[0].empty_cells`` of a scheme).

    Parameters
    ----------
    what : Scheme, Model, positions or path
        The scheme or model.
    *records : path, text stream, frame or mapping
        Files (CSV, Parquet), streams of CSV, frames of pandas, polars, pyarrow and others with the C
        interface of Arrow, or columns by name. Columns have the names of files: ``t [s]``, ``position``, ``fx
        [g]``, ``fy [g]``, ``fz [g]``; for a model ``t`` in its unit and the outputs. A time index of pandas
        is used as the time. Dates count from 1970 in UTC. A time that is not that of the run (its first position
        begins at 0 s) leaves the start of the record open: it is estimated too, and sigmas grow.
    t : array, optional
        Times of a record of arrays: numbers in s (for a model in its unit), dates, or time spans.
    f : array of shape (n, 3), frame of three columns, or mapping, optional
        Specific force along X, Y, Z of the platform, in g.
    position : array, optional
        Position of every sample: its name, or its number from 1. Samples between positions have 0, None, NaN
        or an empty text.
    outputs : mapping of arrays, optional
        Outputs and known inputs of a model by name, in their units.
    prior : Calibration, SystemCalibration or path
        Previous calibration, or the file that ``obsdeg calibrate -o`` wrote for it.
    digits : int or None
        Same as for :func:`analyze`.
    progress : callable or bool
        Called with the progress; ends the work if it returns False. True shows a bar of tqdm.
    **options
        Options of ``obsdeg calibrate``, see :class:`obsdeg.options.Calibrate`: ``noise`` [g], ``step`` [s],
        ``gravity`` [m/s^2], ``gate``, ``starts``, ``profile``, ...

    Returns
    -------
    Calibration or SystemCalibration
        Answer for a scheme, or for a model.

    Raises
    ------
    ProblemError
        Invalid record; the message gives the line. The header of a frame or of arrays is line 1.
    TypeError, ValueError
        Not a record, or arrays of different lengths.

    Examples
    --------
    >>> import obsdeg
    >>> decay = obsdeg.Model(states={"x": "-k*x"}, outputs={"y": "x"})
    >>> fit = obsdeg.calibrate(decay, t=[0, 1, 2, 3], outputs={"y": [1.0, 0.6065, None, 0.2231]})
    >>> round(fit["k"].estimate, 3), fit.outputs[0].measurements
    (0.5, 3)
    """
    from ._frames import arrays, record

    log: list[Rounded] = []
    files: dict[str, Any] = {"sources": [source(what, digits, log)]}
    if prior is not None:
        text = prior.json() if isinstance(prior, Answer) else read_text(prior)
        files["before"] = {"name": "prior", "text": text}
    asked = request(options, digits, log, **files)
    given = [record(r, i) for i, r in enumerate(records, 1)]
    kinds = kinds_of((what,), Calibration, SystemCalibration)
    time = "t [s]" if outputs is None else "t"
    if (more := arrays(t, f, position, outputs, _names(what), time)) is not None:
        given.append(more)
    if not given:
        raise TypeError("no record; expected files, frames or arrays of the runs, after the scheme or model")
    show, bar = heard(progress)
    try:
        return answered(kinds, _obsdeg.calibrate(asked, given, show), ("calibrate", asked, given), log)
    finally:
        if bar is not None:
            bar.close()


@named(options.Allan)
def allan(
    record: Record, *, digits: int | None = DIGITS, progress: Progress | bool | None = None, **options: Any
) -> SensorNoise:
    """Noise of gyros and accelerometers at rest: Allan deviation, coefficients with sigma, and settings for
    simulations.

    Parameters
    ----------
    record : path, text stream, frame or mapping
        A record as for :func:`calibrate`, with the column names of files (``t [s]``, ``wx [deg/h]``, ``fx
        [g]``).
    digits : int or None
        Same as for :func:`analyze`.
    progress : callable or bool
        Called with the progress; ends the work if it returns False. True shows a bar of tqdm.
    **options
        Options of ``obsdeg allan``, see :class:`obsdeg.options.Allan`: ``column``, ``confidence``,
        ``gravity`` [m/s^2].

    Returns
    -------
    SensorNoise
        Noise coefficients; ``passed`` is False if these kinds of noise do not explain the deviations.

    Raises
    ------
    ProblemError
        Invalid record; the message gives the line.

    Examples
    --------
    >>> import obsdeg
    >>> noise = obsdeg.allan("tests/data/static/imu.csv")
    >>> len(noise.columns) > 0
    True
    """
    from ._frames import record as read

    log: list[Rounded] = []
    asked, given = request(options, digits, log), [read(record, 1)]
    show, bar = heard(progress)
    try:
        answer: SensorNoise = answered((SensorNoise,), _obsdeg.allan(asked, given, show), ("allan", asked, given), log)
        return answer
    finally:
        if bar is not None:
            bar.close()


def _names(what: Judged) -> list[str]:
    """Names of the positions of a scheme; empty for a file, which is not read here."""
    if not isinstance(what, Scheme):
        return [f"p{i}" for i in range(1, len(list(what)) + 1)] if are_positions(what) else []  # type: ignore[arg-type]
    return [str(table.get("name") or f"p{i}") for i, table in enumerate(what._read()["position"], 1)]

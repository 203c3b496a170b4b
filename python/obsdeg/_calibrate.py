"""Estimates from records: files, frames and arrays."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, overload

from . import _obsdeg, options
from ._commands import answered, kinds_of
from ._files import Texted, read_text
from ._model import Model
from ._progress import heard
from ._request import Judged, request, source
from ._results import Answer, Calibration, Progress, SystemCalibration
from ._scheme import Scheme
from ._signatures import named
from ._texts import DIGITS, Attitude, Rounded

if TYPE_CHECKING:
    import pandas
    from typing_extensions import Unpack

    class _Calibrate(options.Calibrate, total=False):
        prior: Calibration | SystemCalibration | str | os.PathLike[str]
        digits: int | None
        progress: Progress | bool


@overload
def calibrate(
    what: Scheme | Iterable[Attitude], *records: str | os.PathLike[str] | pandas.DataFrame, **options: Unpack[_Calibrate]
) -> Calibration: ...


@overload
def calibrate(what: Model, *records: str | os.PathLike[str] | pandas.DataFrame, **options: Unpack[_Calibrate]) -> SystemCalibration: ...


@overload
def calibrate(
    what: str | os.PathLike[str] | Texted, *records: str | os.PathLike[str] | pandas.DataFrame, **options: Unpack[_Calibrate]
) -> Calibration | SystemCalibration: ...


@named(options.Calibrate)
def calibrate(
    what: Judged,
    *records: Any,
    prior: Any = None,
    digits: int | None = DIGITS,
    progress: Progress | bool | None = None,
    **options: Any,
) -> Any:
    """What a scheme or model determines, estimated from the records of its runs; ``passed`` is False where the model does not explain them.

    Parameters
    ----------
    what : Scheme, Model, positions or path
        The scheme or model.
    *records : path or pandas.DataFrame
        Files (CSV, Parquet), or frames whose columns are named as in files (``t [s]``, ``fx [g]``).
    prior : Calibration, SystemCalibration or path
        A calibration before, or the file that ``obsdeg calibrate -o`` wrote of it.
    digits : int or None
        As of :func:`analyze`.
    progress : callable or bool
        Hears how far it is, and ends it where it returns False; True for a bar of tqdm.
    **options
        Those of ``obsdeg calibrate``, in :class:`obsdeg.options.Calibrate`: ``noise`` [g], ``step`` [s], ``gravity`` [m/s^2],
        ``gate``, ``starts``, ``profile``, ...

    Returns
    -------
    Calibration or SystemCalibration
        Of a scheme, or of a model.

    Raises
    ------
    ProblemError
        What is wrong with a record, with its line.

    Examples
    --------
    >>> import obsdeg, pandas
    >>> decay = obsdeg.Model(states={"x": "-k*x"}, outputs={"y": "x"})
    >>> record = pandas.DataFrame({"t": [0, 1, 2, 3], "y": [1.0, 0.6065, 0.3679, 0.2231]})
    >>> round(obsdeg.calibrate(decay, record)["k"].estimate, 3)
    0.5
    """
    log: list[Rounded] = []
    files: dict[str, Any] = {"sources": [source(what, digits, log)]}
    if prior is not None:
        text = prior.json() if isinstance(prior, Answer) else read_text(prior)
        files["before"] = {"name": "prior", "text": text}
    asked = request(options, digits, log, **files)
    given = [_record(r, i) for i, r in enumerate(records)]
    if not given:
        raise TypeError("no record; expected files or pandas DataFrames of the runs, after the scheme or model")
    show, bar = heard(progress)
    kinds = kinds_of((what,), Calibration, SystemCalibration)
    try:
        return answered(kinds, _obsdeg.calibrate(asked, given, show), ("calibrate", asked, given), log)
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

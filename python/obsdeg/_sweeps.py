"""Sweeps as tidy tables: one row per unknown of a task, numbers as numbers, with the user's own tags."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from . import _plots
from ._asked import checked, short
from ._judged import COLUMNS, FOUND, TAKEN, WHAT, judged_rows, said
from ._packages import check_package
from ._work import INPUT, Ended

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

#: Number of tasks that a thread or worker takes at a time.
_CHUNK = 20
_NUMBERS = ("latitude", "filter_latitude")
_WIDTH: dict[str, str] = {"rank": "Int64", "degree": "Int64", "sigma": "float64"}


def threads() -> Executor:
    """Executor with one thread per core: the engine releases the interpreter."""
    return ThreadPoolExecutor(os.cpu_count() or 1)


def table(
    tasks: Iterable[Mapping[str, Any]],
    *,
    executor: Callable[[], Executor] = threads,
    errors: Literal["record", "raise"] = "record",
    heard: Callable[[int], None] | None = None,
) -> pandas.DataFrame:
    """Judges many schemes and models. Returns a tidy table with one row per unknown, in the order of the
    tasks.

    Parameters
    ----------
    tasks : iterable of mappings
        Same as for :func:`sweep`: options of :func:`obsdeg.analyze` (and of :func:`obsdeg.simulate` if sigmas
        are needed), with ``angles``, ``scheme`` or ``model``, and ``tags``: names and values of additional
        columns.
    executor : callable
        Makes an executor of :mod:`concurrent.futures`; by default threads of this process, one per core.
    errors : {"record", "raise"}
        "record": a task that cannot be judged gets one row with the message in the column ``error``. "raise":
        it ends the sweep.
    heard : callable, optional
        Called with the number of finished tasks.

    Returns
    -------
    pandas.DataFrame
        Columns: ``task`` (number of the task, from 0), the tags, the options that are numbers or texts,
        ``rank``, ``name``, ``status``, ``degree``; with simulated runs ``sigma`` in ``unit`` and ``outcome``;
        ``rounded`` for tasks with computed angles that were rounded; ``error`` for tasks with an error.
        :func:`to_xarray` converts it to a data set of xarray, :func:`plot` draws it.

    Raises
    ------
    ProblemError
        Invalid task, with ``errors="raise"``.

    Examples
    --------
    >>> from obsdeg import campaign
    >>> rows = campaign.table(dict(angles=[(0, 0, 0), (180, 0, 0), (x, 0, 0)], tags={"x": x}) for x in (0, 30, 60))
    >>> rows[rows.status == "observable"].groupby("x").size().to_dict()
    {0: 7, 30: 12, 60: 12}
    """
    from .campaign import failed, run

    if errors not in ("raise", "record"):
        raise ValueError(f"errors: found {errors!r}; expected 'raise' or 'record'")
    if not callable(executor):
        raise TypeError(f"executor: found a {type(executor).__name__}; expected a function that makes an executor, such as campaign.threads")
    if isinstance(tasks, Mapping) or not isinstance(tasks, Iterable):
        raise TypeError(f"tasks: found a {type(tasks).__name__}; expected a list or another iterable of mappings")
    check_package("pandas", "a table of a sweep", "obsdeg[frames]")
    found: dict[int, list[dict[str, Any]]] = {}
    done = 0
    for _, chunk in run(partial(_judged, record=errors == "record"), _chunks(tasks), executor=executor):
        for number, rows in chunk:
            if isinstance(rows, Ended):
                raise failed(rows, str(number))
            found[number] = rows
        done += len(chunk)
        if heard is not None:
            heard(done)
    return _frame([row for number in sorted(found) for row in found[number]])


def read(folder: str | os.PathLike[str]) -> pandas.DataFrame:
    """Files of a :func:`sweep` as the tidy table of :func:`table`, even if tasks have different options.

    Parameters
    ----------
    folder : path
        Folder of a sweep. Tasks are numbered in the order of their texts.

    Returns
    -------
    pandas.DataFrame
        Same as for :func:`table`.

    Raises
    ------
    FileNotFoundError
        The folder has no files of a sweep.

    Examples
    --------
    >>> import tempfile
    >>> from obsdeg import campaign
    >>> tasks = campaign.grid(angles=[[(0, 0, 0), (180, 0, 0)]], latitude=[0, 45])
    >>> rows = campaign.read(campaign.sweep(tempfile.mkdtemp(), tasks, executor=campaign.threads))
    >>> rows.groupby("latitude")["rank"].first().to_dict()
    {0: 8, 45: 8}
    """
    for package in ("pandas", "pyarrow"):
        check_package(package, "a table of a sweep", "obsdeg[frames]")
    import pyarrow.parquet

    files = sorted(Path(folder).glob("*.parquet"))
    if not files:
        raise FileNotFoundError(f"{os.fspath(folder)}: found no files of a sweep (*.parquet); expected the folder of one")
    by_task: dict[str, list[dict[str, Any]]] = {}
    for file in files:
        there = pyarrow.parquet.read_schema(file).names
        names = [name for name in ("task", *FOUND) if name in there]
        for row in pyarrow.parquet.read_table(file, columns=names).to_pylist():
            by_task.setdefault(row.pop("task"), []).append(row)
    rows: list[dict[str, Any]] = []
    for number, text in enumerate(sorted(by_task)):
        asked = json.loads(text)
        asked = _asked(number, asked if isinstance(asked, dict) else {"found": text})
        rows += [{**asked, **row} for row in by_task[text]]
    return _frame(rows)


def to_xarray(rows: pandas.DataFrame, dims: Sequence[str] | None = None) -> xarray.Dataset:
    """Table of :func:`table` or :func:`read` as a data set of xarray (package ``xarray``).

    Parameters
    ----------
    rows : pandas.DataFrame
        Table of a sweep.
    dims : sequence of str, optional
        Tags and options that become dimensions, and that distinguish all tasks; by default those with more
        than one value.

    Returns
    -------
    xarray.Dataset
        ``rank`` along ``dims``; ``status``, ``degree`` and, of simulated runs, ``sigma``, ``unit`` and
        ``outcome`` along ``dims`` and ``name``; ``error`` along ``dims`` if there is one. Tasks that are not
        in the table or have an error have missing values.

    Raises
    ------
    ValueError
        Two tasks have the same values of ``dims``, or a task has none.
    ImportError
        xarray is not installed.

    Examples
    --------
    >>> from obsdeg import campaign
    >>> pair = [(0, 0, 0), (180, 0, 0)]
    >>> tasks = [dict(angles=[*pair, (x, 0, 0)], latitude=at, tags={"x": x}) for x in (0, 30) for at in (0, 45)]
    >>> data = campaign.to_xarray(campaign.table(tasks))
    >>> dict(data.sizes)
    {'x': 2, 'latitude': 2, 'name': 15}
    >>> data["rank"].sel(latitude=45).to_series().to_dict()
    {0: 8.0, 30: 12.0}
    """
    check_package("xarray", "a data set")
    _check_rows(rows)
    import xarray

    asked = _options_of(rows)
    tasks = rows.groupby("task").first()
    if dims is None:
        dims = [name for name in asked if tasks[name].nunique() > 1]
    if unknown := [name for name in dims if name not in asked]:
        raise ValueError(f"dims: found {unknown[0]!r}; expected some of {', '.join(asked)}")
    if not dims:
        raise ValueError("dims: found no tag or option with more than one value; expected one")
    if (missing := tasks[list(dims)].isna().any(axis=1)).any():
        found = f"task {missing.idxmax()} without a value of {', '.join(dims)}"
        raise ValueError(f"dims: found {found}; expected one of each")
    if (double := tasks.duplicated(list(dims), keep=False)).any():
        alike = next(iter(tasks[double].groupby(list(dims), sort=False).groups.values()))
        same = " and ".join(map(str, alike[:2]))
        raise ValueError(f"dims: found tasks {same} with the same {', '.join(dims)}; expected different ones")
    judged = rows[rows["name"].notna()]
    of_tasks = tasks[[name for name in ("rank", "error") if name in rows]].astype({"rank": "float64"})
    of_tasks.index = _index(tasks, dims)
    kinds = [name for name in ("status", "degree", "sigma", "unit", "outcome") if name in rows]
    of_unknowns = judged[kinds].astype({name: "float64" for name in ("degree", "sigma") if name in kinds})
    of_unknowns.index = _index(judged, [*dims, "name"])
    data = xarray.merge([of_tasks.to_xarray(), of_unknowns.to_xarray()], join="outer")
    # texts in the order of the table, numbers by size
    texts = [name for name in (*dims, "name") if data[name].dtype.kind not in "iufb"]
    ordered: xarray.Dataset = data.sel({name: list(rows[name].dropna().unique()) for name in texts})
    return ordered


def plot(rows: pandas.DataFrame, x: str | None = None, *, figure: Figure | SubFigure | None = None) -> list[Axes]:
    """Draws a table of :func:`table` or :func:`read` with matplotlib: the degree of every unknown along a tag or
    an option and, of simulated runs, the sigmas below.

    Parameters
    ----------
    rows : pandas.DataFrame
        Table of a sweep. One task for each value of ``x``: select some rows if there are more.
    x : str, optional
        Tag or option along the horizontal axis; by default the only one with more than one value.
    figure : matplotlib Figure or SubFigure, optional
        Figure to draw in; by default a new figure of pyplot.

    Returns
    -------
    list of matplotlib Axes
        The panels.

    Raises
    ------
    ValueError
        ``x`` is no tag or option, or two tasks have the same value of it.
    ImportError
        matplotlib is not installed (``pip install 'obsdeg[plots]'``).

    Examples
    --------
    >>> from obsdeg import campaign
    >>> pair = [(0, 0, 0), (180, 0, 0)]
    >>> rows = campaign.table(dict(angles=[*pair, (x, 0, 0)], tags={"x": x}) for x in (0, 30, 60))
    >>> axes = campaign.plot(rows)
    >>> axes[0].get_xlabel()
    'x'
    """
    _check_rows(rows)
    varied = [name for name in _options_of(rows) if rows[name].nunique() > 1]
    if x is None and len(varied) != 1:
        found = ", ".join(varied) if varied else "none"
        raise ValueError(f"x: found {found} with more than one value; expected the name of one, and one task for each of its values")
    x = varied[0] if x is None else x
    if x not in _options_of(rows):
        raise ValueError(f"x: found {x!r}; expected one of {', '.join(_options_of(rows))}")
    tasks = rows.groupby("task")[x].first()
    if (double := tasks[tasks.duplicated(keep=False)]).size:
        same = " and ".join(map(str, tasks[tasks == double.iloc[0]].index[:2]))
        others = ", ".join(name for name in varied if name != x) or "another tag"
        raise ValueError(f"x: found tasks {same} with the same {x}; expected different ones: select rows by {others}")
    height = _plots.height_of(rows["name"].nunique()) + (3.0 if "sigma" in rows else 0.6)
    return _plots.sweep(rows, x, _plots.figure_of(7.0, height) if figure is None else figure)


def _check_rows(rows: Any) -> None:
    """Checks that a table is one of a sweep, with a row at least."""
    expected = "a table of campaign.table or campaign.read"
    columns = getattr(rows, "columns", None)
    if columns is None:
        raise TypeError(f"rows: found {rows!r} of type {type(rows).__name__}; expected {expected}")
    if not {"task", "name"} <= set(columns):
        found = f"the columns {', '.join(map(str, columns))}" if len(columns) else "no columns"
        raise ValueError(f"rows: found {found}; expected {expected} with a task")
    if len(rows) == 0:
        raise ValueError(f"rows: found no row; expected {expected} with a task")


def _options_of(rows: pandas.DataFrame) -> list[str]:
    """Names of the columns with tags and options."""
    return [str(name) for name in rows.columns if name not in ("task", *FOUND)]


def _index(frame: pandas.DataFrame, names: Sequence[str]) -> pandas.Index:
    import pandas

    return pandas.MultiIndex.from_frame(frame[list(names)]) if len(names) > 1 else pandas.Index(frame[names[0]])


def _chunks(tasks: Iterable[Mapping[str, Any]]) -> Iterator[list[tuple[int, Any]]]:
    left = enumerate(tasks)
    while chunk := list(islice(left, _CHUNK)):
        yield chunk


def _judged(chunk: list[tuple[int, Any]], *, record: bool) -> list[tuple[int, list[dict[str, Any]] | Ended]]:
    """Rows of some tasks, up to the first with an error unless these are recorded."""
    found: list[tuple[int, list[dict[str, Any]] | Ended]] = []
    for number, given in chunk:
        asked = _stand_in(number, given)
        try:
            task, _ = checked(given, number, COLUMNS, TAKEN)
            asked = _asked(number, task)
            rows = judged_rows(task)
        except INPUT as problem:
            if not record:
                return [*found, (number, Ended(given, error=problem))]
            rows = [{**dict.fromkeys(FOUND), "error": said(problem)}]
        found.append((number, [{**asked, **row} for row in rows]))
    return found


def _stand_in(number: int, given: Any) -> dict[str, Any]:
    """Columns of a row for a task that may be invalid: tags and options that a table can hold."""
    try:
        asked = _asked(number, given if isinstance(given, Mapping) else {})
    except Exception:
        return {"task": number}

    def held(value: Any) -> Any:
        if value is None or isinstance(value, (bool, int, float)):
            return value
        return value.encode("utf-8", "backslashreplace").decode() if isinstance(value, str) else short(value)

    return {str(held(name)): held(value) for name, value in asked.items()}


def _asked(number: int, task: Mapping[str, Any]) -> dict[str, Any]:
    """Columns of a row that contain the options of the task."""
    options = {name: _value(name, value) for name, value in task.items() if isinstance(name, str) and name not in (*WHAT, "angles", *COLUMNS)}
    given = task.get("tags")
    given = given if isinstance(given, Mapping) else {}
    tags = {name: _tag(value) for name, value in given.items() if isinstance(name, str) and name not in COLUMNS}
    return {"task": number, **tags, **options}


def _tag(value: Any) -> Any:
    """Tag as a number or a text."""
    if hasattr(value, "item"):
        value = value.item()
    if hasattr(value, "isoformat"):
        return value.isoformat()
    exact = not isinstance(value, (bool, int, float, str)) and hasattr(value, "__float__")
    return float(value) if exact else value


def _value(name: str, value: Any) -> Any:
    """Option as a number or a text."""
    if hasattr(value, "item"):
        value = value.item()
    if value is None or isinstance(value, (bool, int, float)):
        return value
    if isinstance(value, str):
        if name not in _NUMBERS:
            return value
    elif not hasattr(value, "__float__"):
        return ", ".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)
    try:
        return float(value)
    except ValueError:
        return value


def _frame(rows: list[dict[str, Any]]) -> pandas.DataFrame:
    import pandas

    names = list(dict.fromkeys(name for row in rows for name in row if name not in FOUND))
    frame = pandas.DataFrame(rows, columns=[*names, *FOUND])
    for name, kind in _WIDTH.items():
        frame[name] = frame[name].astype(kind)
    unused = [name for name in ("sigma", "unit", "outcome", "rounded", "error") if frame[name].isna().all()]
    return frame.drop(columns=unused)

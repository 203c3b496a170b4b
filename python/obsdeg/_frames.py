"""Records in the form of the engine, from files, frames and arrays of any kind."""

from __future__ import annotations

import csv
import datetime
import io
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ._packages import check_package

#: Record in the form of the engine: name, and content if it is not a file.
Given = tuple[str, "bytes | None"]
_EXPECTED = "a file (CSV, Parquet), a text stream, a frame of pandas, polars or pyarrow, or columns by name"


def record(given: Any, place: int) -> Given:
    """Record from one object: a file, a stream, a frame or columns.

    Raises:
        TypeError: the object has no columns.
        ImportError: pyarrow, which reads frames of other libraries, is not installed.
    """
    name = f"record {place}"
    if isinstance(given, str) and "\n" in given:
        raise ValueError(f"{name}: found a text of {len(given.splitlines())} lines; expected a path, or io.StringIO of the text")
    if isinstance(given, (str, os.PathLike)):
        return os.fspath(given), None
    if callable(getattr(given, "read", None)):
        text = given.read()
        return name, text.encode() if isinstance(text, str) else bytes(text)
    if isinstance(given, Mapping) and given:
        return name, _csv(given, name)
    if not hasattr(given, "columns") and hasattr(given, "index") and hasattr(given, "to_frame"):
        # a series of pandas
        given = given.to_frame()
    if hasattr(given, "to_csv") and hasattr(given, "columns"):
        return name, _csv(_of_pandas(given), name)
    if hasattr(given, "__arrow_c_stream__"):
        return name, _csv(_of_arrow(given), name)
    raise TypeError(f"{name}: found a {type(given).__name__}; expected {_EXPECTED}")


def arrays(
    t: Any, f: Any, position: Any, outputs: Mapping[str, Any] | None, names: Sequence[str] = (), time: str = "t [s]"
) -> Given | None:
    """Record from arrays; None if there are no arrays.

    Args:
        t: times in s (for a model in its unit), or dates; None uses the index of `f` or of an output.
        f: specific force along X, Y, Z of the platform in g, one row per sample.
        position: label of every sample, or its number from 1 in `names`.
        outputs: outputs and inputs of a model by name.
        names: names of the positions of the scheme.
        time: header of a time without dates.

    Raises:
        TypeError: both f and outputs, or no times.
        ValueError: different lengths, or a force without three components.
    """
    if f is None and outputs is None:
        if t is not None or position is not None:
            raise TypeError("found t or position without f or outputs; expected f=... of a scheme, outputs={...} of a model")
        return None
    if f is not None and outputs is not None:
        raise TypeError("found f and outputs; expected f=... of a scheme, or outputs={...} of a model")
    if outputs is not None and not isinstance(outputs, Mapping):
        raise TypeError(f"outputs: found a {type(outputs).__name__}; expected values by the name of an output, as in outputs={{'y': values}}")
    columns: dict[str, Any] = {}
    sources: list[Any] = [f] if f is not None else list((outputs or {}).values())
    if t is None:
        t = next((index for index in map(_time_index, sources) if index is not None), None)
        if t is None:
            raise TypeError("found no times; expected t=..., or f or outputs of pandas with an index of dates, or named t or time")
    times = _values(t)
    columns["t" if _are_dates(times) else time] = times
    if position is not None:
        columns["position"] = [_label(p, names) for p in _values(position)]
    if f is not None:
        columns.update(_forces(f))
    for name, values in (outputs or {}).items():
        columns[str(name)] = _values(values)
    return "arrays", _csv(columns, "arrays")


def _forces(f: Any) -> dict[str, list[Any]]:
    """Columns of a force given as three columns, or as rows of three."""
    if isinstance(f, Mapping):
        parts = [_values(f[axis]) for axis in _axes_of(list(f))]
    elif hasattr(f, "columns") or hasattr(f, "column_names"):
        frame = _of_pandas(f, False) if hasattr(f, "to_csv") else _of_arrow(f)
        parts = [_values(frame[axis]) for axis in _axes_of(list(frame))]
    else:
        rows = f.tolist() if hasattr(f, "tolist") else list(f)
        lengths = {len(row) if isinstance(row, (list, tuple)) else 1 for row in rows}
        if lengths - {3}:
            raise ValueError(f"f: found rows of {', '.join(map(str, sorted(lengths)))} numbers; expected three, along X, Y and Z in g")
        parts = [[row[k] for row in rows] for k in range(3)]
    return dict(zip(("fx [g]", "fy [g]", "fz [g]"), parts, strict=True))


def _axes_of(names: list[Any]) -> list[Any]:
    """Names of the three columns along X, Y, Z: by their first letters, otherwise in the given order."""
    if len(names) != 3:
        raise ValueError(f"f: found the columns {', '.join(map(str, names))}; expected three, along X, Y and Z in g")
    found = [[n for n in names if str(n).lower().startswith((f"f{axis}", axis))] for axis in "xyz"]
    return [n for several in found for n in several] if all(len(several) == 1 for several in found) else names


def _label(position: Any, names: Sequence[str]) -> Any:
    """Name of a position that is given by its number."""
    if isinstance(position, (int, float)) and not isinstance(position, bool) and position == position:
        number = int(position)
        if number != position or number < 0 or (names and number > len(names)):
            last = len(names) or "that of the last"
            raise ValueError(f"position: found {position!r}; expected a name, or a number from 1 to {last} (0: none)")
        return None if number == 0 else names[number - 1] if names else f"p{number}"
    return position


def _time_index(of: Any) -> Any:
    """Index of a pandas object, if it is a time."""
    index = getattr(of, "index", None)
    if index is None or not hasattr(index, "dtype"):
        return None
    is_time = str(index.dtype).startswith(("datetime", "timedelta")) or str(index.name or "").split(" ")[0] in ("t", "time")
    return index if is_time else None


def _of_pandas(frame: Any, with_time: bool = True) -> dict[str, Any]:
    """Columns by name; a time index becomes the time column if there is none."""
    columns: dict[str, Any] = {}
    there = {str(name).split(" ")[0] for name in frame.columns}
    if with_time and "t" not in there and (index := _time_index(frame)) is not None:
        values = _values(index)
        named = str(index.name) if str(index.name or "").split(" ")[0] == "t" else "t [s]"
        columns["t" if _are_dates(values) else named] = values
    return {**columns, **{str(name): frame[name] for name in frame.columns}}


def _of_arrow(frame: Any) -> dict[str, Any]:
    """Columns of a frame with the C interface of Arrow."""
    check_package("pyarrow", f"a record of type {type(frame).__name__}", "obsdeg[frames]")
    import pyarrow

    table = pyarrow.table(frame)
    return {str(name): column for name, column in zip(table.column_names, table.columns, strict=True)}


def _values(column: Any) -> list[Any]:
    """Column as a list: None for missing values, Python dates (to us), seconds for time spans."""
    kind = str(getattr(column, "dtype", ""))
    if kind.startswith(("datetime64", "timedelta64")) and not hasattr(column, "isna"):
        # numpy makes numbers of time units that are finer than those of Python
        column = column.astype(f"{kind.partition('[')[0]}[us]")
    if hasattr(column, "isna") and hasattr(column, "astype"):
        found = [None if missing else value for value, missing in zip(column.tolist(), column.isna().tolist(), strict=True)]
    elif hasattr(column, "to_pylist"):
        found = column.to_pylist()
    elif hasattr(column, "to_list"):
        found = column.to_list()
    elif hasattr(column, "tolist"):
        found = column.tolist()
    elif isinstance(column, Iterable) and not isinstance(column, (str, bytes)):
        found = list(column)
    else:
        raise TypeError(f"found a column of type {type(column).__name__}; expected a list or an array")
    return [_plain(value) for value in found]


def _plain(value: Any) -> Any:
    if value is None or isinstance(value, (str, int)):
        return value
    if isinstance(value, datetime.datetime):
        if value != value:
            return None
        return value.astimezone(datetime.timezone.utc).replace(tzinfo=None) if value.tzinfo is not None else value
    if isinstance(value, datetime.timedelta):
        return value.total_seconds()
    if hasattr(value, "tolist") and getattr(value, "ndim", 0) == 0:
        return _plain(value.tolist())
    return None if value != value else value


def _are_dates(values: Sequence[Any]) -> bool:
    first = next((v for v in values if v is not None), None)
    return isinstance(first, datetime.datetime) or (isinstance(first, str) and first[:1].isdigit() and "-" in first[1:])


def _csv(columns: Mapping[str, Any], name: str) -> bytes:
    """Record as CSV text: shortest texts of floats, empty cells for missing values, ISO 8601 for dates.

    Raises:
        ValueError: columns of different lengths.
    """
    values = {str(key): _values(column) for key, column in columns.items()}
    lengths = {key: len(column) for key, column in values.items()}
    if len(set(lengths.values())) > 1:
        said = ", ".join(f"{length} of {key}" for key, length in lengths.items())
        raise ValueError(f"{name}: found {said}; expected as many of each")
    # a column of dates has no unit
    head = [key.partition(" [")[0] if _are_dates(column) else key for key, column in values.items()]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([[_text(v) for v in row] for row in zip(*values.values(), strict=True)])
    return text.getvalue().encode()


def _text(value: Any) -> Any:
    return value.isoformat() if isinstance(value, datetime.datetime) else value

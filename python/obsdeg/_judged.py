"""Tasks of a sweep as rows: work of a worker on a chunk, and tasks in the files of a folder."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import obsdeg

from ._asked import digest, key, key_of, written
from ._files import place
from ._packages import check_package
from ._work import INPUT
from .options import Analyze, Simulate

# options that only a simulation has: noise, dwells, requirements
_MEASURED = Simulate.__optional_keys__ - Analyze.__optional_keys__
_JUDGED = Analyze.__optional_keys__ - Simulate.__optional_keys__


#: Keys of a task that are no options.
WHAT = ("scheme", "model", "tags")


def judged_rows(task: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Results of a task, one row per unknown."""
    what: list[Any] = []
    for key_, kind in (("scheme", obsdeg.Scheme), ("model", obsdeg.Model)):
        if key_ in task:
            given = task[key_]
            what.append(given if isinstance(given, kind) else kind.from_text(given))
    if len(what) > 1:
        raise ValueError("found a scheme and a model; expected one of them")
    options = {name: value for name, value in task.items() if name not in WHAT}
    # only schemes have classes of omitted errors
    bare = {"solutions": False} if "model" in task else {"solutions": False, "omitted": False}
    exact = {**bare, **{k: v for k, v in options.items() if k not in _MEASURED}}
    answer = obsdeg.analyze(*what, **exact)
    verdicts, rounded = answer.to_dict(), "; ".join(map(str, answer.rounded)) or None
    numbers = {}
    if _MEASURED & options.keys():
        run = obsdeg.simulate(*what, **{k: v for k, v in options.items() if k not in _JUDGED}).to_dict()
        numbers = {q["name"]: q for q in run["quantities"]}
    rows = []
    for q in verdicts["quantities"]:
        n = numbers.get(q["name"], {})
        verdict = {"name": q["name"], "status": q["status"], "degree": q.get("degree")}
        number = {name: n.get(name) for name in ("sigma", "unit", "outcome")}
        rows.append({"rank": verdicts["rank"], **verdict, **number, "rounded": rounded, "error": None})
    return rows


def _rows(task: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Options and results of a task, one row per unknown."""
    asked = _options(task)
    return [{**asked, **row} for row in judged_rows(task)]


def _options(task: Mapping[str, Any]) -> dict[str, Any]:
    """Columns with the options of a task."""
    return {"task": name_of(task), **{name: str(value) for name, value in task.items() if name not in WHAT}}


def name_of(task: Mapping[str, Any]) -> str:
    try:
        return written(task)
    except (TypeError, ValueError):
        return json.dumps({name: repr(value) for name, value in task.items()}, sort_keys=True)


#: Columns of results, with their types in Parquet.
FOUND = {
    "rank": "int64",
    "name": "string",
    "status": "string",
    "degree": "int32",
    "sigma": "double",
    "unit": "string",
    "outcome": "string",
    "rounded": "string",
    "error": "string",
}


#: Names of the columns of every table, which are therefore no options of a task.
COLUMNS = frozenset(("task", *FOUND))


#: Names that a tag cannot have.
TAKEN = COLUMNS | Analyze.__optional_keys__ | Simulate.__optional_keys__


def row_of(task: Mapping[str, Any], error: BaseException) -> dict[str, Any]:
    """Row of a task without an answer."""
    return {**_options(task), **dict.fromkeys(FOUND), "error": said(error)}


def said(error: BaseException) -> str:
    """Text of an error in a row."""
    return str(error) if isinstance(error, INPUT) else f"{type(error).__name__}: {error}"


def parquet(rows: list[dict[str, Any]], columns: list[str]) -> bytes:
    """Rows as a Parquet file that begins with the given columns, even if no row has them."""
    check_package("pyarrow", "a file of a sweep", "obsdeg[frames]")
    import pyarrow
    import pyarrow.parquet

    sink = pyarrow.BufferOutputStream()
    names = dict.fromkeys([*columns, *(name for row in rows for name in row)])
    kinds = [(name, pyarrow.type_for_alias(FOUND.get(name, "string"))) for name in names]
    table = pyarrow.Table.from_pylist(rows, pyarrow.schema(kinds, {"obsdeg": obsdeg.__version__}))
    pyarrow.parquet.write_table(table, sink)
    return bytes(sink.getvalue())


@dataclass(frozen=True)
class Judged:
    """Result of a chunk: seconds, name of its file, its bytes if the worker does not see the folder, errors
    with the index of their task, and number of tasks that were judged."""

    seconds: float
    name: str | None
    table: bytes | None
    wrong: list[tuple[int, Exception]]
    count: int


#: Tasks, the folder for their file if the worker may see it, and the seconds after which no other task begins.
Chunk = tuple[list[dict[str, Any]], "str | None", "float | None"]


def judge(chunk: Chunk, *, columns: list[str], record: bool) -> Judged:
    """Judges the tasks of a chunk, and writes the file with their rows into a folder if one is given."""
    tasks, stage, limit = chunk
    start = time.perf_counter()
    rows: list[dict[str, Any]] = []
    keys: list[str] = []
    wrong: list[tuple[int, Exception]] = []
    count = 0
    for i, task in enumerate(tasks):
        if limit is not None and i > 0 and time.perf_counter() - start >= limit:
            break
        count += 1
        try:
            found = _rows(task)
        except (MemoryError, OSError, KeyboardInterrupt, SystemExit):
            # an error of the machine, not of the task: the task is tried again
            raise
        except BaseException as e:
            # a panic of the engine is no Exception, and cannot be pickled
            problem = e if isinstance(e, INPUT) else RuntimeError(f"{type(e).__name__}: {e}")
            wrong.append((i, problem))
            if not record:
                continue
            found = [row_of(task, problem)]
        rows += found
        keys.append(key(task).hex())
    if not rows:
        return Judged(time.perf_counter() - start, None, None, wrong, count)
    name, table = f"{digest(keys)}.parquet", parquet(rows, columns)
    if stage is not None and Path(stage).is_dir():
        place(Path(stage) / name, table)
        return Judged(time.perf_counter() - start, name, None, wrong, count)
    return Judged(time.perf_counter() - start, name, table, wrong, count)


def done(folder: Path) -> set[bytes]:
    """Tasks of this version that the files of a folder contain, by value."""
    import pyarrow
    import pyarrow.parquet

    there: set[bytes] = set()
    for file in sorted(folder.glob("*.parquet")):
        try:
            head = pyarrow.parquet.read_schema(file)
            version = (head.metadata or {}).get(b"obsdeg", b"").decode()
            if "task" not in head.names or version != obsdeg.__version__:
                continue
            tasks = pyarrow.parquet.read_table(file, columns=["task"]).column("task").unique().to_pylist()
        except pyarrow.ArrowInvalid as e:
            advice = "remove it, and its tasks are asked again"
            raise ValueError(f"{file}: found what is no Parquet file ({e}); {advice}") from None
        there.update(map(key_of, tasks))
    return there

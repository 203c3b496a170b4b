"""Searches and sweeps on as many machines as there are, through any executor of :mod:`concurrent.futures`.

A search is cut into parts (``obsdeg design --part``), a sweep into chunks; each is a file in a folder, written whole or not at all and named by what was asked, so that a
driver that was killed goes on where it was, and a worker that was killed costs what it had in hand. There is no scheduler here: that is the executor's.

With Dask Distributed::

    with distributed.Client("scheduler:8786") as client:
        found = campaign.design("search", 40, executor=client.get_executor, positions=7, carry="inertial")

With Ray: ``executor=campaign.RayExecutor``. On one machine, the default: :func:`processes`. A script that starts processes has its work below
``if __name__ == "__main__":``, as everywhere in Python.
"""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, ProcessPoolExecutor, wait
from decimal import Decimal
from itertools import islice, product
from pathlib import Path
from typing import Any

import obsdeg

from ._files import Text
from .options import Analyze, Simulate

#: Makes an executor; one that is broken, because a worker was killed, is replaced by another.
Executors = Callable[[], Executor]


def processes(workers: int | None = None) -> ProcessPoolExecutor:
    """A pool of processes on this machine, as many as cores where nothing else is said.

    They do not begin as copies of this process (``fork``): the threads of the engine, which are no part of a copy, would be waited for without end.
    """
    start = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"
    return ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context(start))


class CampaignError(RuntimeError):
    """A task failed as often as it may: `task` says which."""

    def __init__(self, task: Any, tries: int, cause: BaseException) -> None:
        super().__init__(f"{task!r} failed {tries} times, last with {type(cause).__name__}: {cause}")
        self.task = task


def run(
    function: Callable[[Any], Any],
    tasks: Iterable[Any],
    *,
    executor: Executors = processes,
    retries: int = 2,
    ahead: int = 64,
) -> Iterator[tuple[Any, Any]]:
    """Yields every task with its result, in the order in which they end.

    Args:
        function: what is done, importable by the workers.
        tasks: hashable or not; at most ``ahead`` are handed out at a time, so that memory does not grow with them.
        executor: makes the executor.
        retries: how often a task is tried again when its worker was lost. An error that the function raises itself is not tried again where it is one
            of input (:class:`obsdeg.ProblemError`).

    Raises:
        CampaignError: a task failed too often.
    """
    _check("ahead", ahead, 1)
    _check("retries", retries, 0)
    left = iter(enumerate(tasks))
    again: list[tuple[int, Any]] = []
    tries: dict[int, int] = {}
    pool = executor()
    waiting: dict[Future[Any], tuple[int, Any]] = {}
    try:
        while True:
            try:
                for i, task in [*again, *islice(left, ahead - len(waiting) - len(again))]:
                    again = [a for a in again if a[0] != i]
                    waiting[pool.submit(function, task)] = (i, task)
            except RuntimeError:
                # broken since: what it was not given comes again with another
                again.append((i, task))
                again.extend(waiting.values())
                waiting.clear()
                pool = _another(pool, executor)
                continue
            if not waiting:
                return
            done, _ = wait(waiting, return_when=FIRST_COMPLETED)
            lost = False
            for future in done:
                i, task = waiting.pop(future)
                try:
                    result = future.result()
                except obsdeg.ProblemError:
                    raise
                except (Exception, CancelledError) as e:
                    tries[i] = tries.get(i, 0) + 1
                    if tries[i] > retries:
                        raise CampaignError(task, tries[i], e) from e
                    again.append((i, task))
                    lost |= _is_broken(pool, e)
                else:
                    tries.pop(i, None)
                    yield task, result
            if lost:
                again.extend(waiting.values())
                waiting.clear()
                pool = _another(pool, executor)
    finally:
        _close(pool)


def _check(name: str, found: int, least: int) -> None:
    if found < least:
        raise ValueError(f"{name}: found {found}; expected at least {least}")


def _is_whole(part: Path) -> bool:
    """Whether a part is there, as it was written."""
    try:
        json.loads(part.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        return False
    return True


def _is_broken(pool: Executor, e: BaseException) -> bool:
    return isinstance(pool, ProcessPoolExecutor) and "Broken" in type(e).__name__


def _another(pool: Executor, executor: Executors) -> Executor:
    _close(pool)
    return executor()


def _close(pool: Executor) -> None:
    try:
        pool.shutdown(wait=False, cancel_futures=True)
    except TypeError:
        # Dask's has no such option
        pool.shutdown(wait=False)


def _plain(value: Any) -> Any:
    """What is no JSON by itself, with all its digits."""
    if isinstance(value, Text):
        return value.text
    if isinstance(value, (Decimal, os.PathLike)):
        return str(value)
    if isinstance(value, range):
        return list(value)
    if hasattr(value, "tolist"):
        # arrays and numbers of numpy
        return value.tolist()
    raise TypeError(f"found {value!r} of type {type(value).__name__}; expected what JSON can hold, a decimal, an array or a Scheme")


def _asked(options: Any) -> str:
    return json.dumps(options, sort_keys=True, default=_plain)


def _digest(asked: Any) -> str:
    return hashlib.sha256(_asked([obsdeg.__version__, asked]).encode()).hexdigest()[:16]


def _place(path: Path, text: bytes) -> None:
    """Writes a file whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise


def _search(task: tuple[dict[str, Any], int, int]) -> str:
    options, number, of = task
    return str(obsdeg.design(**options, part=(number, of)).json())


def design(
    folder: str | os.PathLike[str],
    parts: int,
    *,
    executor: Executors = processes,
    retries: int = 2,
    heard: Callable[[int, int], None] | None = None,
    **options: Any,
) -> obsdeg.Design:
    """Searches in parts, and puts them together: the answer of ``obsdeg.design(**options)``, byte for byte.

    Args:
        folder: holds the parts that are done; the same search in the same folder goes on with them.
        parts: how many.
        heard: told how many parts are done, of how many.
        options: those of :func:`obsdeg.design`.

    Raises:
        CampaignError: a part failed too often.
        obsdeg.ProblemError: what is wrong with the options.
    """
    _check("parts", parts, 1)
    files = {i: Path(folder) / f"{_digest([options, parts])}-{i}-of-{parts}.json" for i in range(1, parts + 1)}
    missing = [(options, i, parts) for i, file in files.items() if not _is_whole(file)]
    done = parts - len(missing)
    for (_, i, _), text in run(_search, missing, executor=executor, retries=retries):
        _place(files[i], text.encode())
        done += 1
        if heard is not None:
            heard(done, parts)
    merged: obsdeg.Design = obsdeg.design(**options, merge=[f.read_text(encoding="utf-8") for f in files.values()])
    return merged


def grid(**axes: Iterable[Any]) -> Iterator[dict[str, Any]]:
    """Every combination of options: ``grid(angles=[...], latitude=range(0, 91), carry=["platform", "inertial"])``."""
    for name, values_of in axes.items():
        if isinstance(values_of, (str, bytes)):
            raise TypeError(f"{name}: found {values_of!r}; expected a list of values, as in [{values_of!r}]")
    names, values = list(axes), [list(v) for v in axes.values()]
    return (dict(zip(names, chosen, strict=True)) for chosen in product(*values))


# what only numbers have: noise, dwells, requirements
_MEASURED = Simulate.__optional_keys__ - Analyze.__optional_keys__
_JUDGED = Analyze.__optional_keys__ - Simulate.__optional_keys__


def _rows(task: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """What is found of a task, a row per unknown."""
    given: Any = task.get("scheme")
    what = [given if isinstance(given, obsdeg.Scheme) else obsdeg.Scheme.from_text(given)] if "scheme" in task else []
    options = {name: value for name, value in task.items() if name != "scheme"}
    verdicts = obsdeg.analyze(*what, **{"solutions": False, **{k: v for k, v in options.items() if k not in _MEASURED}}).to_dict()
    numbers = {}
    if _MEASURED & options.keys():
        run = obsdeg.simulate(*what, **{k: v for k, v in options.items() if k not in _JUDGED}).to_dict()
        numbers = {q["name"]: q for q in run["quantities"]}
    asked = {"task": _asked(task), **{name: str(value) for name, value in options.items()}}
    for q in verdicts["quantities"]:
        n = numbers.get(q["name"], {})
        found = {"rank": verdicts["rank"], "name": q["name"], "status": q["status"], "degree": q.get("degree")}
        yield {**asked, **found, "sigma": n.get("sigma"), "unit": n.get("unit"), "outcome": n.get("outcome")}


def _verdicts(tasks: list[dict[str, Any]]) -> bytes:
    import pyarrow
    import pyarrow.parquet

    sink = pyarrow.BufferOutputStream()
    rows = [row for task in tasks for row in _rows(task)]
    kinds = {"rank": pyarrow.int64(), "degree": pyarrow.int32(), "sigma": pyarrow.float64()}
    names = dict.fromkeys(name for row in rows for name in row)
    schema = pyarrow.schema([(name, kinds.get(name, pyarrow.string())) for name in names], {"obsdeg": obsdeg.__version__})
    table = pyarrow.Table.from_pylist(rows, schema)
    pyarrow.parquet.write_table(table, sink)
    return bytes(sink.getvalue())


def _done(folder: Path) -> set[str]:
    """The tasks of this version that the files of a folder hold."""
    import pyarrow.parquet

    done: set[str] = set()
    for file in folder.glob("*.parquet"):
        head = pyarrow.parquet.read_schema(file)
        if "task" in head.names and (head.metadata or {}).get(b"obsdeg") == obsdeg.__version__.encode():
            tasks = pyarrow.parquet.read_table(file, columns=["task"]).column("task").unique().to_pylist()
            done.update(hashlib.sha256(task.encode()).hexdigest()[:16] for task in tasks)
    return done


def sweep(
    folder: str | os.PathLike[str],
    tasks: Iterable[Mapping[str, Any]],
    *,
    chunk: int = 500,
    executor: Executors = processes,
    retries: int = 2,
    heard: Callable[[int], None] | None = None,
) -> Path:
    """Judges many schemes: a row per unknown, in Parquet files that come as they are done.

    Args:
        folder: holds the files, one a chunk, named by what it asks; tasks that are there are not asked again, whatever the chunks. Read all with
            ``pandas.read_parquet(folder)``. The column ``task`` holds all options of a row as JSON; each option is a column of text too, in the files
            where a task has it (pandas shows the columns of one file: where options differ from file to file, take them from ``task``).
        tasks: options of :func:`obsdeg.analyze` each, as :func:`grid` makes them; ``scheme`` is a :class:`obsdeg.Scheme`, or the text of a scheme file. A task with options that only
            :func:`obsdeg.simulate` has, such as ``noise`` [g], ``dwell`` [s] or ``requirement``, is simulated too: ``sigma`` is the standard deviation at the
            end of the run in ``unit``, and ``outcome`` says whether it is a measured one; elsewhere these are empty.
        chunk: tasks that are judged together.
        heard: told how many tasks are done.

    Raises:
        CampaignError: a chunk failed too often.
        obsdeg.ProblemError: what is wrong with a task.
    """
    _check("chunk", chunk, 1)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    done = told = 0
    there = _done(folder)

    def is_missing(task: dict[str, Any]) -> bool:
        nonlocal done
        known = bool(there) and hashlib.sha256(_asked(task).encode()).hexdigest()[:16] in there
        done += known
        return not known

    def missing() -> Iterator[list[dict[str, Any]]]:
        rest = filter(is_missing, map(dict, tasks))
        while some := list(islice(rest, chunk)):
            yield some

    for some, table in run(_verdicts, missing(), executor=executor, retries=retries):
        _place(folder / f"{_digest(some)}.parquet", table)
        done += len(some)
        told = done
        if heard is not None:
            heard(done)
    if heard is not None and told != done:
        heard(done)
    return folder


def _call(fn: Callable[..., Any], args: Any, kwargs: Any) -> Any:
    # what Ray takes must be a function; a partial one is none
    return fn(*args, **kwargs)


class RayExecutor(Executor):
    """Ray as an executor.

    Args:
        options: those of ``ray.init``, where Ray does not run yet; it then runs until the process ends.
    """

    def __init__(self, **options: Any) -> None:
        import ray

        if not ray.is_initialized():
            ray.init(**options)
        # what a lost worker had in hand is tried again by the campaign, not there
        self._remote = ray.remote(max_retries=0)(_call)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Hands a call to Ray."""
        future: Future[Any] = self._remote.remote(fn, args, kwargs).future()
        return future

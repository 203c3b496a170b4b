"""Searches and sweeps on any number of machines, through any executor of :mod:`concurrent.futures`.

A search is divided into parts (``obsdeg design --part``), a sweep into chunks. Each is a file in a folder,
written completely or not at all and named by its request. A killed driver resumes where it was; a
killed worker costs its current work. Every task is done, pending, or reported by name. The
executor does the scheduling.

With Dask Distributed::

    with distributed.Client("scheduler:8786") as client:
        found = campaign.design("search", 40, executor=client.get_executor, positions=7, carry="inertial")

With Ray: ``executor=campaign.RayExecutor``. Default, on one machine: :func:`processes`. A script that
starts processes needs ``if __name__ == "__main__":`` around its work, as everywhere in Python; without it
it ends in a :class:`CampaignError` that says so.
"""

from __future__ import annotations

import json
import os
import shutil
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from itertools import chain, islice, product
from math import prod
from operator import length_hint
from pathlib import Path
from typing import Any, Literal

import obsdeg

from ._asked import checked, digest, key, key_of, stand_in
from ._executors import Executors, RayExecutor, check_main, processes
from ._files import place
from ._judged import COLUMNS, FOUND, TAKEN, WHAT, Chunk, Judged, judge, name_of, parquet, row_of
from ._judged import done as there_in
from ._sweeps import plot, read, table, threads, to_xarray
from ._work import END, INPUT, CampaignError, Ended, Work

__all__ = ["CampaignError", "Executors", "RayExecutor"]
__all__ += ["design", "grid", "plot", "processes", "read", "run", "sweep", "table", "threads", "to_xarray"]



def __dir__() -> list[str]:
    return sorted(__all__)


#: Seconds of work per file of a sweep, if the size of chunks follows the measured time.
FILE_SECONDS = 10.0
#: Number of workers above which a file has more work, so that about ten files end in a second.
MANY = 100
#: Largest number of tasks in such a file.
FILE_TASKS = 5000
#: Number of first tasks whose options are columns of every file; options of later tasks add columns to their
#: files.
FIRST = 500
#: Seconds after which an unfinished part of a search is written.
CHECKPOINT = 300.0


def run(
    function: Callable[[Any], Any],
    tasks: Iterable[Any],
    *,
    executor: Executors = processes,
    retries: int = 2,
    ahead: int | None = None,
) -> Iterator[tuple[Any, Any]]:
    """Yields every task with its result, in the order of their ends.

    Parameters
    ----------
    function : callable
        Called with each task; importable by the workers.
    tasks : iterable
        Any objects; they are drawn when handed out, so that memory does not grow with their number.
    executor : callable
        Makes the executor.
    retries : int
        Number of times that a task is tried again if its worker was lost or its function failed.
        Errors of input (``ValueError``, ``TypeError``) are not tried again.
    ahead : int, optional
        Largest number of tasks handed out at a time; by default twice the number of workers, at
        least 8.

    Raises
    ------
    CampaignError
        A task failed too often, no executor is available, or the scheduler of a cluster has not
        answered for 30 s; ``pending`` lists the drawn tasks that are not finished.
    obsdeg.ProblemError
        A task is invalid; the message names it, and ``task`` is the task.
    """
    check_main()
    if ahead is not None:
        _check("ahead", ahead, 1)
    _check("retries", retries, 0)
    left = iter(tasks)
    work = Work(function, lambda: next(left, END), executor, retries, ahead)
    for end in work.ended():
        if end.error is not None:
            raise failed(end, repr(end.task), work)
        yield end.task, end.result


def failed(end: Ended, name: str, work: Work | None = None) -> Exception:
    """Error that names its task: an error of input keeps its type, with the task before its text."""
    error = end.error
    assert error is not None
    if isinstance(error, INPUT):
        try:
            named = type(error)(f"task {name}: {error}")
        except TypeError:
            named = ValueError(f"task {name}: {error}")
        named.__dict__.update(error.__dict__, task=end.task)
        named.__cause__ = error
        return named
    text = f"{name} failed {end.tries} times, last with {type(error).__name__}: {error}"
    failed = CampaignError(text, end.task, work.open() if work else [])
    failed.__cause__ = error
    return failed


def _check(name: str, found: int, least: int) -> None:
    if found < least:
        raise ValueError(f"{name}: found {found}; expected at least {least}")


#: Part of a search: options, its number, number of parts, unfinished part, and seconds until the next
#: checkpoint.
_Part = tuple[dict[str, Any], int, int, "str | None", float]


def _search(task: _Part) -> tuple[str, bool]:
    """A part up to the next checkpoint, and True if it is complete."""
    options, number, of, before, seconds = task
    end = time.monotonic() + seconds
    resumed = {} if before is None else {"resume": before}
    asked = {**options, **resumed, "part": (number, of), "progress": lambda *_: time.monotonic() < end}
    found = obsdeg.design(**asked)
    return found.json(), bool(found.to_dict()["complete"])


def _part(file: Path) -> tuple[str | None, bool]:
    """A written part, and True if it is complete; None if there is none."""
    try:
        text = file.read_text(encoding="utf-8")
        return text, bool(json.loads(text)["complete"])
    except (FileNotFoundError, ValueError, KeyError, TypeError):
        return None, False


def design(
    folder: str | os.PathLike[str],
    parts: int,
    *,
    executor: Executors = processes,
    retries: int = 2,
    checkpoint: float = CHECKPOINT,
    check: int = 0,
    heard: Callable[[int, int], None] | None = None,
    **options: Any,
) -> obsdeg.Design:
    """Searches in parts and merges them. Returns the answer of ``obsdeg.design(**options)`` with a report on
    the parts in ``search.parts``.

    Parameters
    ----------
    folder : path
        Folder of the parts; the same search in the same folder resumes them.
    parts : int
        Number of parts.
    checkpoint : float
        Seconds after which an unfinished part is written: the largest amount of work on a part that
        a kill costs.
    check : int
        Number of random blocks of the parts that are searched again at the end.
    heard : callable, optional
        Called with the number of finished parts and the number of all parts.
    **options
        Options of :func:`obsdeg.design`.

    Raises
    ------
    CampaignError
        A part failed too often, or the scheduler of a cluster does not answer.
    obsdeg.ProblemError
        Invalid options.
    OSError
        A part cannot be written; the message gives its number. Other parts are kept.
    """
    check_main()
    _check("parts", parts, 1)
    if not checkpoint > 0:
        raise ValueError(f"checkpoint: found {checkpoint}; expected more than 0 s")
    asked = digest([options, parts])
    files = {i: Path(folder) / f"{asked}-{i}-of-{parts}.json" for i in range(1, parts + 1)}
    there = {i: _part(file) for i, file in files.items()}
    missing = {i: text for i, (text, complete) in there.items() if not complete}
    left: deque[_Part] = deque((options, i, parts, text, checkpoint) for i, text in missing.items())
    done = parts - len(left)
    work = Work(_search, lambda: left.popleft() if left else END, executor, retries, None)
    for end in work.ended():
        _, i, _, before, seconds = end.task
        if isinstance(end.error, INPUT):
            raise end.error
        if end.error is not None:
            raise failed(end, f"part {i} of {parts}", work)
        text, complete = end.result
        try:
            place(files[i], text.encode())
        except OSError as e:
            raise OSError(e.errno, f"part {i} of {parts} cannot be written: {e.strerror}", str(files[i])) from e
        if not complete:
            # a step that cannot be interrupted may need more time than one checkpoint
            left.append((options, i, parts, text, 2 * seconds if text == before else seconds))
            continue
        done += 1
        if heard is not None:
            heard(done, parts)
    found = [file.read_text(encoding="utf-8") for file in files.values()]
    if check:
        options = {**options, "check": check}
    merged: obsdeg.Design = obsdeg.design(**options, merge=found)
    return merged


def grid(**axes: Iterable[Any]) -> Iterator[dict[str, Any]]:
    """Every combination of options: ``grid(angles=[...], latitude=range(91), carry=["platform", "reset"])``.
    """
    for name, values_of in axes.items():
        if isinstance(values_of, (str, bytes)):
            raise TypeError(f"{name}: found {values_of!r}; expected a list of values, as in [{values_of!r}]")
    return _Grid(axes)


class _Grid(Iterator[dict[str, Any]]):
    """Combinations of options, whose number is known."""

    def __init__(self, axes: Mapping[str, Iterable[Any]]) -> None:
        values = [list(v) for v in axes.values()]
        self._names, self._rest, self._left = list(axes), product(*values), prod(map(len, values))

    def __next__(self) -> dict[str, Any]:
        chosen = next(self._rest)
        self._left -= 1
        return dict(zip(self._names, chosen, strict=True))

    def __length_hint__(self) -> int:
        return self._left


@contextmanager
def _alone(folder: Path) -> Iterator[Path]:
    """Folder for the output of workers inside a folder, while no other driver works there."""
    lock = _locked(folder)
    try:
        for left in folder.glob(".sweep-*"):
            # left by a killed driver; its workers, if still running, cannot write any more
            shutil.rmtree(left, ignore_errors=True)
        stage = Path(tempfile.mkdtemp(prefix=".sweep-", dir=folder))
        try:
            # workers may belong to other users
            stage.chmod(folder.stat().st_mode & 0o777)
            yield stage
        finally:
            shutil.rmtree(stage, ignore_errors=True)
    finally:
        if lock is not None:
            os.close(lock)


def _locked(folder: Path) -> int | None:
    """Locks a folder for the life of this process; None if the system has no such locks."""
    if os.name != "posix":
        return None
    import fcntl

    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(handle)
        raise RuntimeError(f"{folder}: found another sweep at work in it; expected one at a time") from None
    except OSError:
        # some network file systems have no locks
        os.close(handle)
        return None
    return handle


class _Chunks:
    """Number of tasks per file: fixed, or that of some seconds by the measured time of earlier ones.

    Args:
        fixed: number of tasks; None follows the time.
        tasks: number of all tasks; 0 if it is not known. Towards their end files have less work, so that all
            workers end at about the same time.
    """

    def __init__(self, fixed: int | None, tasks: int) -> None:
        self.fixed, self.tasks, self.drawn = fixed, tasks, 0
        self.each, self.size = 0.0, 1

    def next(self, workers: int) -> int:
        """Number of tasks of the next chunk."""
        if self.fixed is not None:
            return self.fixed
        if self.tasks == 0:
            return self.size
        # each worker has a chunk at work and one that waits
        fair = (self.tasks - self.drawn) // (2 * max(1, workers))
        return max(1, min(self.size, max(fair, self.size // 30)))

    def limit(self, workers: int) -> float | None:
        """Seconds after which a chunk ends before its last task; None for a fixed number of tasks."""
        return 2 * self._seconds(workers) if self.fixed is None else None

    def took(self, seconds: float, tasks: int, workers: int) -> None:
        """Counts the time of a chunk."""
        each = seconds / tasks
        self.each = each if self.each == 0 else 0.7 * self.each + 0.3 * each
        # at most four times as many: the first tasks may be the easy ones
        self.size = max(1, min(FILE_TASKS, 4 * self.size, int(self._seconds(workers) / max(self.each, 1e-6))))

    def _seconds(self, workers: int) -> float:
        return FILE_SECONDS * max(1.0, workers / MANY)


def sweep(
    folder: str | os.PathLike[str],
    tasks: Iterable[Mapping[str, Any]],
    *,
    chunk: int | None = None,
    executor: Executors = processes,
    retries: int = 2,
    errors: Literal["raise", "record"] = "raise",
    heard: Callable[[int], None] | None = None,
) -> Path:
    """Judges many schemes. Writes one row per unknown into Parquet files, which appear as they are finished.

    Parameters
    ----------
    folder : path
        Folder of the files, one per chunk and named by its request. Workers that see the folder
        write them; only one sweep at a time works in it. Tasks in the folder are not judged again,
        whatever their chunks. Tasks are equal if their options have equal values: 0, ``"0"`` and
        ``numpy.float64(0)`` are equal. :func:`read` returns a tidy table with numbers and tags. The
        column ``task`` contains all options of a row as JSON. Each option of the first 500 tasks is
        also a text column; options of other tasks are columns in their own files only (pandas shows
        the columns of one file: use ``task``).
    tasks : iterable
        Options of :func:`obsdeg.analyze`, as :func:`grid` makes them; ``scheme`` is a
        :class:`obsdeg.Scheme`, or the text of a scheme file, ``model`` a :class:`obsdeg.Model` or
        its text; ``tags`` are additional names and values. A task with options that only
        :func:`obsdeg.simulate` has, such as ``noise`` [g], ``dwell`` [s] or ``requirement``, is
        simulated too: ``sigma`` is the standard deviation at the end of the run in ``unit``, and
        ``outcome`` tells if it comes from the samples. Without simulation these are empty.
    chunk : int, optional
        Number of tasks judged together; by default about 10 s of work, by measured time, with more
        than 100 workers as much as lets ten files end in a second. Chunks become smaller towards
        the end if the number of tasks is known: that of a list or of :func:`grid`, not that of a
        generator. A chunk that takes twice the intended time ends early, and its other tasks are
        handed out again.
    retries : int
        Number of times that tasks of a lost worker are tried again. Then the chunk is divided until
        the responsible task is found.
    errors : {"raise", "record"}
        A task that cannot be judged ends the sweep and is named (``"raise"``), or gets one row with
        the message in the column ``error`` (``"record"``), and counts as done.
    heard : callable, optional
        Called with the number of finished tasks.

    Raises
    ------
    CampaignError
        A task failed too often, or the scheduler of a cluster does not answer; the folder keeps the
        finished tasks, and the same sweep resumes with the rest.
    obsdeg.ProblemError
        A task is invalid; the message names it, and ``task`` is the task. The rest of its chunk is
        kept.
    RuntimeError
        Another sweep works in the folder.
    """
    check_main()
    if chunk is not None:
        _check("chunk", chunk, 1)
    _check("retries", retries, 0)
    if errors not in ("raise", "record"):
        raise ValueError(f"errors: found {errors!r}; expected 'raise' or 'record'")
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    with _alone(folder) as stage:
        chunks = _Chunks(chunk, length_hint(tasks))
        _sweep(folder, stage, tasks, chunks, executor, retries, errors == "record", heard)
    return folder


def _sweep(
    folder: Path,
    stage: Path,
    tasks: Iterable[Mapping[str, Any]],
    chunks: _Chunks,
    executor: Executors,
    retries: int,
    record: bool,
    heard: Callable[[int], None] | None,
) -> None:
    there = there_in(folder)
    done, told = 0, 0
    seen_by_workers = True
    again: deque[list[dict[str, Any]]] = deque()
    returned: deque[dict[str, Any]] = deque()
    rest = iter(tasks)
    first = list(islice(rest, FIRST))
    named = [name for task in first if isinstance(task, Mapping) for name in task if isinstance(name, str)]
    options = [name for name in named if name not in WHAT and name not in COLUMNS]
    columns = list(dict.fromkeys(["task", *options, *FOUND]))

    def wrong(end: Ended, task: dict[str, Any]) -> None:
        """Records the error of a task without an answer in a separate file, or raises it."""
        assert end.error is not None
        if not record:
            raise failed(Ended(task, error=end.error, tries=end.tries), name_of(task), work)
        name = digest(["error", name_of(task)])
        place(folder / f"{name}.parquet", parquet([row_of(task, end.error)], columns))

    def missing() -> Iterator[dict[str, Any]]:
        nonlocal done
        for number, given in enumerate(chain(first, rest)):
            error: Exception | None = None
            chunks.drawn += 1
            try:
                task, text = checked(given, number, COLUMNS, TAKEN)
                by_value = key_of(text)
            except (TypeError, ValueError) as e:
                task, error = stand_in(given, number), e
                by_value = key(task)
            if by_value in there:
                done += 1
                continue
            there.add(by_value)
            if error is not None:
                wrong(Ended(task, error=error), task)
                done += 1
                continue
            yield task

    fresh = missing()

    def draw() -> Any:
        if again:
            some = again.popleft()
        else:
            count = chunks.next(work.workers)
            some = [returned.popleft() for _ in range(min(count, len(returned)))] or list(islice(fresh, count))
        return (some, str(stage) if seen_by_workers else None, chunks.limit(work.workers)) if some else END

    work = Work(partial(judge, columns=columns, record=record), draw, executor, retries, None, divide=_halves)
    for end in work.ended():
        some: list[dict[str, Any]] = end.task[0]
        if end.error is not None:
            wrong(end, some[0])
        else:
            judged: Judged = end.result
            if not _published(judged, stage, folder):
                seen_by_workers = False
                again.append(some)
                continue
            chunks.took(judged.seconds, judged.count, work.workers)
            returned.extendleft(reversed(some[judged.count :]))
            if judged.wrong and not record:
                i, error = judged.wrong[0]
                wrong(Ended(some[i], error=error), some[i])
            some = some[: judged.count]
        done += len(some)
        told = done
        if heard is not None:
            heard(done)
    if heard is not None and told != done:
        heard(done)


def _halves(chunk: Chunk) -> list[Chunk]:
    """The two halves of a chunk that failed too often; empty for a single task."""
    tasks, stage, limit = chunk
    half = len(tasks) // 2
    return [(tasks[:half], stage, limit), (tasks[half:], stage, limit)] if half else []


def _published(judged: Judged, stage: Path, folder: Path) -> bool:
    """Moves the file of a chunk to its final place; False if the worker wrote it where this machine does not
    see it."""
    if judged.name is None:
        return True
    if judged.table is not None:
        place(folder / judged.name, judged.table)
        return True
    try:
        os.replace(stage / judged.name, folder / judged.name)
    except FileNotFoundError:
        return False
    return True

"""Executors of campaigns: number of workers, whether a cluster still answers, replacement of one that
broke."""

from __future__ import annotations

import copy
import multiprocessing
import os
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, Executor, Future, ProcessPoolExecutor
from typing import Any

#: Makes an executor; one that is broken, because a worker was killed, is replaced by another.
Executors = Callable[[], Executor]

#: Seconds between two looks at a cluster from which nothing comes, and until it has to answer one.
PULSE = 5.0
#: Name of the processes of :func:`processes`.
WORKER = "obsdeg campaign worker"
#: Exit code of such a process that was to begin a campaign itself.
UNGUARDED = 71
#: Seconds for which the thread of a broken pool is waited for.
BROKEN = 5.0
GUARD = (
    "the script begins its campaign again in every worker, which imports it, so that no worker can start; "
    'put what the script does below a line `if __name__ == "__main__":`'
)


def processes(workers: int | None = None) -> ProcessPoolExecutor:
    """A pool of processes on this machine, by default as many as it has cores.

    They do not begin as copies of this process (``fork``), of which another thread may be half way through
    something, and end when it ends, also where it is killed.
    """
    start = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"
    context = copy.copy(multiprocessing.get_context(start))
    begin: Callable[..., Any] = getattr(context, "Process")  # no attribute of the type

    def named(*args: Any, **options: Any) -> Any:
        return begin(*args, **{**options, "name": WORKER})

    context.__dict__["Process"] = named
    return ProcessPoolExecutor(workers, context, initializer=_end_with_parent)


def check_main() -> None:
    """Refuses to begin a campaign in a process that is still importing the script that started it.

    A process of :func:`processes` ends in silence: its driver has the error, once (:func:`unguarded`).

    Raises:
        RuntimeError: what the script lacks.
        SystemExit: the same, in the server that newer versions of Python fork workers from.
    """
    here = multiprocessing.current_process()
    if not getattr(here, "_inheriting", False):
        return
    if here.name == WORKER:
        os._exit(UNGUARDED)
    raise SystemExit(GUARD) if here.name == "MainProcess" else RuntimeError(GUARD)


def unguarded(pool: Executor) -> str | None:
    """Why no process of a broken pool can begin, if one ended in :func:`check_main`; None otherwise."""
    processes = dict(getattr(pool, "_processes", None) or {}) if isinstance(pool, ProcessPoolExecutor) else {}
    manager = getattr(pool, "_executor_manager_thread", None)
    if manager is not None:
        # it asks for exit codes too, and each can be read once
        manager.join(BROKEN)
    return GUARD if any(process.exitcode == UNGUARDED for process in processes.values()) else None


def _end_with_parent() -> None:
    """Ends a worker whose parent was killed; it would wait for ever for what comes after its last task."""
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def workers_of(pool: Executor) -> int:
    """Number of tasks that an executor works on at once; 32 where it does not say."""
    client = _dask(pool)
    if client is not None:
        try:
            return sum(worker["nthreads"] for worker in _identity(client)["workers"].values())
        except Exception:  # a scheduler that does not answer is noticed by `unreachable`
            return 1
    counted = getattr(pool, "workers", None)
    if callable(counted):
        return int(counted())
    most = getattr(pool, "_max_workers", None)
    return most if isinstance(most, int) else 32


def unreachable(pool: Executor) -> str | None:
    """Why nothing more can come from a cluster, or None. Asks the scheduler of Dask; waits at most
    :data:`PULSE` seconds."""
    client = _dask(pool)
    if client is None:
        return None
    try:
        _identity(client)
    except Exception as e:
        return f"the scheduler of Dask does not answer ({type(e).__name__})"
    return None


def _identity(client: Any) -> Any:
    """What the scheduler of Dask says of itself and its workers, or an error after :data:`PULSE` seconds."""
    if client.status not in ("running", "connecting"):
        raise RuntimeError(f"the client of Dask is {client.status}")
    return client.sync(client.scheduler.identity, callback_timeout=PULSE)


def _dask(pool: Executor) -> Any:
    client = getattr(pool, "_client", None)
    return client if hasattr(client, "scheduler") and hasattr(client, "nthreads") else None


def close(pool: Executor, at_once: bool) -> None:
    """Ends an executor; never raises.

    Args:
        at_once: processes of this machine that still work are killed: one that began while its pool broke
            would be waited for without end when this process ends.
    """
    processes = dict(getattr(pool, "_processes", None) or {}) if isinstance(pool, ProcessPoolExecutor) else {}
    try:
        try:
            pool.shutdown(wait=False, cancel_futures=True)
        except TypeError:
            # Dask's has no such option
            pool.shutdown(wait=False)
    except (Exception, CancelledError):
        # the executor of a lost cluster cannot even be closed; the loss is reported by who noticed it
        pass
    for process in processes.values() if at_once else ():
        try:
            process.kill()
        except (OSError, ValueError):
            # it has ended
            continue


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

    def workers(self) -> int:
        """Number of processors of the cluster."""
        import ray

        resources: Any = ray.cluster_resources()
        return max(1, int(resources.get("CPU", 1)))

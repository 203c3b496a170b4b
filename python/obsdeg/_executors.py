"""Executors of campaigns: number of workers, reachability of a cluster, replacement of a broken executor."""

from __future__ import annotations

import copy
import multiprocessing
import os
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, Executor, Future, ProcessPoolExecutor
from typing import Any

#: Makes an executor; called again if it broke because a worker was killed.
Executors = Callable[[], Executor]

#: Seconds between two checks of a silent cluster, and limit of its answer time.
PULSE = 5.0
#: Name of the processes of :func:`processes`.
WORKER = "obsdeg campaign worker"
#: Exit code of a worker process that was about to start a campaign itself.
UNGUARDED = 71
#: Seconds to wait for the manager thread of a broken pool.
BROKEN = 5.0
GUARD = (
    "the script begins its campaign again in every worker, which imports it, so that no worker can start; "
    'put what the script does below a line `if __name__ == "__main__":`'
)


def processes(workers: int | None = None) -> ProcessPoolExecutor:
    """Pool of processes on this machine, by default one per core.

    The processes are not copies of this process (``fork``), since another of its threads may hold a lock.
    They end when this process ends, even if it is killed.
    """
    start = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"
    context = copy.copy(multiprocessing.get_context(start))
    begin: Callable[..., Any] = getattr(context, "Process")  # no attribute of the type

    def named(*args: Any, **options: Any) -> Any:
        return begin(*args, **{**options, "name": WORKER})

    context.__dict__["Process"] = named
    return ProcessPoolExecutor(workers, context, initializer=_end_with_parent)


def check_main() -> None:
    """Refuses to start a campaign in a process that is still importing the script of its parent.

    A process of :func:`processes` exits silently: its driver reports the error, once (:func:`unguarded`).

    Raises:
        RuntimeError: the script has no guard of its main part.
        SystemExit: the same, in the server process from which newer versions of Python fork workers.
    """
    here = multiprocessing.current_process()
    if not getattr(here, "_inheriting", False):
        return
    if here.name == WORKER:
        os._exit(UNGUARDED)
    raise SystemExit(GUARD) if here.name == "MainProcess" else RuntimeError(GUARD)


def unguarded(pool: Executor) -> str | None:
    """Reason why no process of a broken pool can start, if one ended in :func:`check_main`; None otherwise.
    """
    processes = dict(getattr(pool, "_processes", None) or {}) if isinstance(pool, ProcessPoolExecutor) else {}
    manager = getattr(pool, "_executor_manager_thread", None)
    if manager is not None:
        # the manager thread reads exit codes too, and each can be read only once
        manager.join(BROKEN)
    return GUARD if any(process.exitcode == UNGUARDED for process in processes.values()) else None


def _end_with_parent() -> None:
    """Ends a worker whose parent was killed; it would wait for further tasks for ever."""
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def workers_of(pool: Executor) -> int:
    """Number of tasks that an executor works on at once; 32 if it is not known."""
    client = _dask(pool)
    if client is not None:
        try:
            return int(_identity(client)["total_threads"])
        except Exception:  # `unreachable` reports a scheduler that does not answer
            return 1
    counted = getattr(pool, "workers", None)
    if callable(counted):
        return int(counted())
    most = getattr(pool, "_max_workers", None)
    return most if isinstance(most, int) else 32


def unreachable(pool: Executor) -> str | None:
    """Reason why a cluster can return nothing more, or None. Asks the scheduler of Dask and waits at most
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
    """Description of the scheduler of Dask without its workers; an error after :data:`PULSE` seconds."""
    if client.status not in ("running", "connecting"):
        raise RuntimeError(f"the client of Dask is {client.status}")
    return client.sync(client.scheduler.identity, n_workers=0, callback_timeout=PULSE)


def _dask(pool: Executor) -> Any:
    client = getattr(pool, "_client", None)
    return client if hasattr(client, "scheduler") and hasattr(client, "nthreads") else None


def close(pool: Executor, at_once: bool) -> None:
    """Closes an executor; never raises.

    Args:
        at_once: True kills working processes on this machine: this process would otherwise wait
            for ever for one that started while its pool broke.
    """
    processes = dict(getattr(pool, "_processes", None) or {}) if isinstance(pool, ProcessPoolExecutor) else {}
    try:
        try:
            pool.shutdown(wait=False, cancel_futures=True)
        except TypeError:
            # Dask has no such option
            pool.shutdown(wait=False)
    except (Exception, CancelledError):
        # the executor of a lost cluster cannot be closed either; its loss is reported elsewhere
        pass
    for process in processes.values() if at_once else ():
        try:
            process.kill()
        except (OSError, ValueError):
            # the process has ended
            continue


def _call(fn: Callable[..., Any], args: Any, kwargs: Any) -> Any:
    # Ray accepts plain functions only, not partial ones
    return fn(*args, **kwargs)


class RayExecutor(Executor):
    """Executor on Ray.

    Args:
        options: options of ``ray.init`` if Ray does not run yet; it then runs until the process ends.
    """

    def __init__(self, **options: Any) -> None:
        import ray

        if not ray.is_initialized():
            ray.init(**options)
        # the campaign, not Ray, repeats the tasks of a lost worker
        self._remote = ray.remote(max_retries=0)(_call)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Submits a call to Ray."""
        future: Future[Any] = self._remote.remote(fn, args, kwargs).future()
        return future

    def workers(self) -> int:
        """Number of processors of the cluster."""
        import ray

        resources: Any = ray.cluster_resources()
        return max(1, int(resources.get("CPU", 1)))

"""A sweep on a simulated cluster: how busy its workers are, and what the driver costs.

    python python/benches/cluster.py [WORKERS]

The driver is the real one: it checks tasks, divides them into chunks, hands them out and moves their files. The workers are simulated:
a chunk takes the sum of the seconds that its tasks state, and its file is written. The simulated clock advances by the
processor time of the driver while the driver works, and to the next event while it waits. So 1,000 workers need one core.
"""

from __future__ import annotations

import heapq
import pickle
import queue
import random
import statistics
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any
from unittest.mock import patch

from obsdeg import _work, campaign
from obsdeg._judged import Judged, name_of, parquet

#: Seconds between two chunks of a worker.
LATENCY = 0.005
PAIR = [(0, 0, 0), (180, 0, 0)]


class Cluster(Executor):
    """Simulated workers and their clock.

    Args:
        count: number of workers.
        driver: seconds of the clock per second of the driver; 0 for a driver that takes no time.
        files: True if workers write the tasks into their files, so that another sweep goes on; False for empty files.

    Attributes:
        clock: seconds since the start.
        driving: processor seconds of the driver.
        working: seconds of all chunks that began.
        chunks: seconds of every chunk that began.
        begun: numbers of the tasks that began.
    """

    def __init__(self, count: int, driver: float = 1.0, files: bool = False) -> None:
        self.count, self.driver, self.files = count, driver, files
        self.clock, self.driving, self.working, self._since = 0.0, 0.0, 0.0, time.thread_time()
        self.chunks: list[float] = []
        self.begun: list[int] = []
        self._idle = count
        self._queue: deque[tuple[Future[Any], bytes]] = deque()
        self._events: list[tuple[float, int, Future[Any], Judged]] = []
        self._ended: deque[Future[Any]] = deque()

    def workers(self) -> int:
        """Number of workers."""
        return self.count

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Takes a chunk. It begins when a worker is idle."""
        sent = pickle.dumps(args[0])
        self._paused()
        self._advance(self.clock)
        future: Future[Any] = Future()
        self._queue.append((future, sent))
        self._begin(self.clock)
        self._since = time.thread_time()
        return future

    # the part of SimpleQueue that a campaign uses for the futures that ended

    def put(self, future: Future[Any]) -> None:
        """Called when a future ends."""
        self._ended.append(future)

    def get(self, timeout: float) -> Future[Any]:
        """The next future that ended. The clock advances to its end."""
        self._paused()
        self._advance(self.clock)
        if not self._ended:
            self.clock = max(self.clock, self._events[0][0])
            self._advance(self.clock)
        self._since = time.thread_time()
        return self._ended.popleft()

    def get_nowait(self) -> Future[Any]:
        """The next future that has ended."""
        if not self._ended:
            raise queue.Empty
        return self._ended.popleft()

    def _paused(self) -> None:
        """Counts the time of the driver until now."""
        spent = time.thread_time() - self._since
        self.driving += spent
        self.clock += self.driver * spent

    def _advance(self, now: float) -> None:
        """Ends the chunks whose time has come."""
        while self._events and self._events[0][0] <= now:
            then, _, future, judged = heapq.heappop(self._events)
            self._idle += 1
            self._begin(then)
            future.set_result(judged)

    def _begin(self, now: float) -> None:
        """Gives waiting chunks to idle workers."""
        while self._queue and self._idle:
            future, sent = self._queue.popleft()
            tasks, stage, limit = pickle.loads(sent)  # noqa: S301
            self._idle -= 1
            seconds, count = 0.0, 0
            while count < len(tasks) and (count == 0 or limit is None or seconds < limit):
                seconds += tasks[count]["tags"]["seconds"]
                count += 1
            name = f"{len(self.chunks)}-{id(self)}.parquet"
            rows = [{"task": name_of(task)} for task in tasks[:count]] if self.files else []
            (Path(stage) / name).write_bytes(parquet(rows, ["task"]) if rows else b"")
            self.begun += [task["tags"]["number"] for task in tasks[:count]]
            self.working += seconds
            self.chunks.append(seconds)
            end = now + LATENCY + seconds
            heapq.heappush(self._events, (end, len(self.chunks), future, Judged(seconds, name, None, [], count)))


def tasks(seconds: Iterable[float]) -> Iterator[dict[str, Any]]:
    """Different tasks that take these times."""
    for i, each in enumerate(seconds):
        yield dict(angles=PAIR, latitude=i % 90, noise=1e-5 * (1 + i // 90), tags={"number": i, "seconds": each})


def sweep(cluster: Cluster, folder: Path, some: Iterable[dict[str, Any]], heard: Callable[[int], None] | None = None) -> None:
    """A sweep on the cluster."""
    with patch.object(_work, "SimpleQueue", lambda: cluster):
        cluster._since = time.thread_time()
        campaign.sweep(folder, some, executor=lambda: cluster, heard=heard)


def main(workers: int) -> None:
    """Sweeps of different tasks, with the driver's time and without it."""
    draws = random.Random(1)
    cases: dict[str, list[float]] = {
        "10 s each": [10.0] * 50_000,
        "1 s each": [1.0] * 500_000,
        "0.1 s each": [0.1] * 500_000,
        "10 ms each": [0.01] * 500_000,
        "1 s, log-normal": [draws.lognormvariate(-0.5, 1.0) for _ in range(500_000)],
        "1 ms, then 1 s": [0.001] * 250_000 + [1.0] * 250_000,
    }
    print(f"{workers} workers\n\n| tasks | number | least time | sweep | workers busy | files | seconds of a file, median and largest | driver per task |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for name, seconds in cases.items():
        cluster = Cluster(workers)
        with tempfile.TemporaryDirectory() as folder:
            sweep(cluster, Path(folder), list(tasks(seconds)))
        assert sorted(cluster.begun) == list(range(len(seconds)))
        least = sum(seconds) / workers
        spread = f"{statistics.median(cluster.chunks):.3g} and {max(cluster.chunks):.3g}"
        busy, each = f"{least / cluster.clock:.0%}", f"{cluster.driving / len(seconds) * 1e6:.0f} us"
        print(f"| {name} | {len(seconds)} | {least:.4g} s | {cluster.clock:.4g} s | {busy} | {len(cluster.chunks)} | {spread} | {each} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)

"""A sweep of many schemes in one process, and by Dask with two workers.

    python python/benches/sweep.py [SCHEMES]

Prints the seconds of both and their ratio, each with a folder of its own; what they found is the same.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import Executor, Future
from itertools import islice
from pathlib import Path
from typing import Any

import distributed
import pyarrow.parquet
from obsdeg import campaign


class Here(Executor):
    """This process."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Calls at once."""
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


def tasks(n: int) -> Iterator[dict[str, Any]]:
    """Schemes of two positions at four latitudes."""
    angles = ([(a, b, 0), (180, c, 0)] for a in range(0, 180, 5) for b in range(0, 90, 3) for c in range(0, 120, 5))
    every = ({"angles": pair, "latitude": latitude, "carry": "inertial"} for pair in angles for latitude in (0, 28, 45, 60))
    return islice(every, n)


def rows(folder: Path) -> int:
    """How many rows were written."""
    return sum(pyarrow.parquet.read_metadata(f).num_rows for f in folder.glob("*.parquet"))


def main(n: int) -> None:
    """Both, one after the other."""
    with tempfile.TemporaryDirectory() as folder:
        one, two = Path(folder) / "one", Path(folder) / "two"
        begun = time.perf_counter()
        campaign.sweep(one, tasks(n), executor=Here)
        alone = time.perf_counter() - begun
        print(f"one process       {alone:7.1f} s, {rows(one)} rows", flush=True)
        with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, distributed.Client(cluster) as client:
            # workers import it once, which is no part of the work
            client.run(__import__, "obsdeg.campaign")
            begun = time.perf_counter()
            campaign.sweep(two, tasks(n), executor=client.get_executor)
            together = time.perf_counter() - begun
        print(f"Dask, two workers {together:7.1f} s, {rows(two)} rows", flush=True)
        same = {f.name for f in one.iterdir()} == {f.name for f in two.iterdir()} and rows(one) == rows(two)
        print(f"{alone / together:.2f} times as fast; {'the same' if same else 'NOT the same'} files")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)

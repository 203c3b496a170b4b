"""1,000 simulated workers: the driver keeps them busy, chunks follow the time, and a killed campaign goes on."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import pytest
from conftest import ROOT
from obsdeg import campaign

pytest.importorskip("pyarrow")
SIMULATED: dict[str, Any] = runpy.run_path(str(ROOT / "python" / "benches" / "cluster.py"))
WORKERS = 1000


def played(folder: Path, seconds: list[float], driver: float = 0.0, known: bool = True) -> Any:
    """Cluster after a sweep of tasks that take these seconds, each of which was judged once."""
    cluster = SIMULATED["Cluster"](WORKERS, driver)
    tasks = SIMULATED["tasks"](seconds)
    SIMULATED["sweep"](cluster, folder, list(tasks) if known else tasks)
    assert sorted(cluster.begun) == list(range(len(seconds)))
    return cluster


def test_a_thousand_workers_are_busy(tmp_path: Path) -> None:
    cluster = played(tmp_path, [50.0] * 10_000)
    assert cluster.working / WORKERS / cluster.clock > 0.9
    # ten files per second, and small ones at both ends
    assert len(cluster.chunks) < 8 * WORKERS and max(cluster.chunks) <= 100


def test_the_driver_needs_little_per_chunk(tmp_path: Path) -> None:
    # a wait for each of 2,000 chunks would need 6 ms whenever one ends; 0.2 ms are measured on a machine without other work
    cluster = played(tmp_path, [1000.0] * 3000)
    assert len(cluster.chunks) == 3000 and cluster.driving / len(cluster.chunks) < 2e-3


def test_small_chunks_at_the_end(tmp_path: Path) -> None:
    """With a known number of tasks all workers end at about the same time."""
    seconds = [5.0] * 8_000
    known, unknown = (played(tmp_path / str(known), seconds, known=known) for known in (True, False))
    assert known.clock < 1.1 * 40 < 1.5 * 40 < unknown.clock


def test_a_chunk_ends_at_its_limit(tmp_path: Path) -> None:
    """Chunks that were made for easy tasks do not keep a worker for hours when tasks become hard."""
    cluster = played(tmp_path, [0.001] * 10_000 + [10.0] * 5_000, known=False)
    # twice 100 s, and one task
    assert 100 < max(cluster.chunks) <= 210


def test_grids_know_their_number() -> None:
    grid = campaign.grid(angles=[1, 2, 3], latitude=range(4))
    assert grid.__length_hint__() == 12 and next(grid) == {"angles": 1, "latitude": 0}
    assert grid.__length_hint__() == 11 and len(list(grid)) == 11


def test_it_goes_on_after_a_kill(tmp_path: Path) -> None:
    tasks = list(SIMULATED["tasks"]([5.0] * 1000))

    def killed(done: int) -> None:
        if done > 400:
            raise KeyboardInterrupt

    first, second = (SIMULATED["Cluster"](200, 0.0, files=True) for _ in range(2))
    with pytest.raises(KeyboardInterrupt):
        SIMULATED["sweep"](first, tmp_path, tasks, heard=killed)
    heard: list[int] = []
    SIMULATED["sweep"](second, tmp_path, tasks, heard=heard.append)
    assert heard[-1] == 1000 and 400 < 1000 - len(second.begun) <= len(first.begun)
    assert len(set(second.begun)) == len(second.begun) and {*first.begun, *second.begun} == set(range(1000))

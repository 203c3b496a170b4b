"""The best nine of the 24 cardinal positions, proven, in parts.

    python search.py FOLDER                  all parts, on the cores of this machine
    python search.py FOLDER --dask ADDRESS   on the workers of a Dask cluster
    python search.py --measure               one part, and what the whole will cost

FOLDER holds the parts that are done; the same command goes on with them. --positions makes it another number of positions.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from concurrent.futures import Executor

import obsdeg
from obsdeg import campaign

#: What is searched: as `obsdeg design --positions 9 --carry inertial`.
CANDIDATES = 24


def measure(positions: int) -> None:
    """One part of 24: the sequences that begin with one of the second positions (the first is any, by turns of the axes)."""
    sequences = CANDIDATES ** (positions - 2)
    begun = time.process_time()
    part = obsdeg.design(positions, carry="inertial", part=(2, CANDIDATES))
    seconds = time.process_time() - begun
    assert part.complete
    print(f"{sequences:.3g} sequences in {seconds:.1f} s of one core: {seconds / sequences * 1e9:.1f} s per 1e9")
    print(f"all {CANDIDATES} parts: {sequences * CANDIDATES:.3g} sequences, {seconds * CANDIDATES / 60:.1f} minutes of one core")


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?")
    parser.add_argument("--positions", type=int, default=9)
    parser.add_argument("--dask")
    parser.add_argument("--measure", action="store_true")
    asked = parser.parse_args()
    if asked.measure or not asked.folder:
        measure(asked.positions)
        return
    executor: Callable[[], Executor] = campaign.processes
    if asked.dask:
        import distributed

        executor = distributed.Client(asked.dask).get_executor
    found = campaign.design(
        asked.folder,
        CANDIDATES,
        executor=executor,
        heard=lambda done, of: print(f"{done} of {of} parts", flush=True),
        positions=asked.positions,
        carry="inertial",
    )
    print(found)


if __name__ == "__main__":
    main()

"""A million verdicts in a loop: the memory of the process at the start, in the middle, at the end.

    python python/benches/memory.py [VERDICTS]

Prints MB; exits with 1 where the second half took more than 2 MB. A tenth is asked before the start, so that what is kept once is there.
"""

from __future__ import annotations

import sys
import time

import obsdeg


def resident() -> float:
    """MB of memory that the process has (Linux)."""
    with open("/proc/self/status", encoding="ascii") as file:
        return next(int(line.split()[1]) for line in file if line.startswith("VmRSS")) / 1024


def ask(begin: int, end: int) -> int:
    """Asks one after another, all of them different; every tenth is read."""
    ranks = 0
    for i in range(begin, end):
        answer = obsdeg.analyze(angles=[(i % 360, 0, 0), (180, i // 360 % 360, 0)], carry="inertial", solutions=False)
        if i % 10 == 0:
            ranks += answer.rank + sum(d or 0 for d in answer.degrees.values())
    return ranks


def main(verdicts: int) -> int:
    """The three numbers."""
    begun = time.perf_counter()
    at = [0, verdicts // 10, verdicts * 11 // 20, verdicts]
    seen = []
    for begin, end in zip(at, at[1:], strict=False):
        ask(begin, end)
        seen.append(resident())
        print(f"{end:8} verdicts  {seen[-1]:7.2f} MB  {time.perf_counter() - begun:6.0f} s", flush=True)
    return 1 if seen[2] - seen[1] > 2 else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000))

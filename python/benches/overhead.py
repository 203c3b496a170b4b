"""What the package adds to a call: the same request asked in Python, and in Rust in the same process.

    python python/benches/overhead.py [CALLS]

Prints us of the processor per call, with the answer alone and with its JSON: medians of turns of 20 calls, one in Rust and one in Python, since the machine is not alone with it.
"""

from __future__ import annotations

import sys
import time
from statistics import median

import obsdeg
from obsdeg import _obsdeg

#: Calls that are measured together.
TURN = 20
ANGLES = [(0, 0, 0), (180, 0, 0)]
SCHEME = obsdeg.Scheme([(0, 0, 0), (180, 0, 0), (0, 90, 0), (45, 30, 0)], carry="inertial", latitude="28.2")


def python(times: int, written: bool, scheme: bool) -> float:
    """Seconds in Python."""
    begun = time.process_time()
    for _ in range(times):
        answer = obsdeg.analyze(SCHEME, solutions=False) if scheme else obsdeg.analyze(angles=ANGLES, carry="inertial", solutions=False)
        if written:
            answer.json()
    return time.process_time() - begun


def rust(times: int, written: bool, scheme: bool) -> float:
    """Seconds of the request that this was."""
    answer = obsdeg.analyze(SCHEME, solutions=False) if scheme else obsdeg.analyze(angles=ANGLES, carry="inertial", solutions=False)
    assert answer._asked is not None
    command, request, _ = answer._asked
    begun = time.process_time()
    _obsdeg.seconds(command, request, times, written)
    return time.process_time() - begun


def main(calls: int) -> None:
    """The table."""
    for scheme in (False, True):
        for written in (False, True):
            turns = [(rust(TURN, written, scheme), python(TURN, written, scheme)) for _ in range(max(1, calls // TURN))]
            theirs, ours = (median(t[i] for t in turns) / TURN * 1e6 for i in (0, 1))
            added = median(t[1] - t[0] for t in turns) / TURN * 1e6
            what = f"{'a scheme' if scheme else 'angles':8} {'with its JSON' if written else 'answer alone':13}"
            print(f"{what}  Rust {theirs:6.1f} us  Python {ours:6.1f} us  added {added:5.1f} us")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5000)

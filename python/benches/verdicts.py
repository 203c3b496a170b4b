"""Random schemes through the package and through the program: the same JSON, each.

    python python/benches/verdicts.py PROGRAM [SCHEMES]

Exits with 1 where one differs. Angles are special and any, carries and latitudes of every kind, terms of gyros and accelerometers.
"""

from __future__ import annotations

import json
import random
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import obsdeg

ANGLES: list[Any] = [0, 90, 180, -90, 45, 30, 60, -120]


def scheme(draw: random.Random) -> obsdeg.Scheme:
    """A scheme of one to five positions."""
    kinds: list[Callable[[], Any]] = [lambda: draw.choice(ANGLES), lambda: draw.randint(-180, 180), lambda: f"{draw.uniform(-180, 180):.{draw.randint(1, 6)}f}"]
    angle = draw.choice(kinds)
    positions = [[angle() for _ in range(3)] for _ in range(draw.randint(1, 5))]
    keys: dict[str, Any] = {"terms": draw.choice([["F"], ["F", "I"], ["F", "I", "O", "S"], ["F", "II", "IO"], ["F", "K0", "K1"]])} if draw.random() < 0.5 else {}
    latitude = draw.choice([None, 0, 90, "28.2", -45, f"{draw.uniform(-90, 90):.3f}"])
    return obsdeg.Scheme(positions, carry=draw.choice(["platform", "inertial", "reset"]), latitude=latitude, **keys)


def main(program: str, schemes: int, together: int = 500) -> int:
    """Judges and compares."""
    draw = random.Random(20)
    differ = unknowns = observable = 0
    with tempfile.TemporaryDirectory() as folder:
        for begin in range(0, schemes, together):
            some = [scheme(draw) for _ in range(begin, min(begin + together, schemes))]
            files = [Path(folder) / f"{i}.toml" for i in range(len(some))]
            for one, file in zip(some, files, strict=True):
                one.write(file)
            command = [program, "analyze", *map(str, files), "--solutions", "off", "--format", "json"]
            theirs = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
            for one, answer in zip(some, theirs, strict=True):
                ours = obsdeg.analyze(one, solutions=False)
                if ours.to_dict() != answer["answer"]:
                    differ += 1
                    print(f"differs:\n{one.text}")
                unknowns += len(ours.statuses)
                observable += sum(s == "observable" for s in ours.statuses.values())
    print(f"{schemes} schemes, {unknowns} unknowns of which {observable} are observable: {differ} schemes differ")
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 10_000))

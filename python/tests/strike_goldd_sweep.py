"""Reads all models of STRIKE-GOLDD and compares the equations with those that Octave evaluates.

    python strike_goldd_sweep.py FOLDER

FOLDER contains scripts (`*.m`, at any depth), which are not part of this project. Octave runs each with a
`syms` that gives numbers, so that its own reader decides their meaning. Prints one line per script that
differs or is refused, and the totals; exits with 1 if any differs.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from obsdeg.importers import ImportProblem, strike_goldd, to_toml
from obsdeg.importers.formula import names_in


def number_of(name: str) -> float:
    """Number of a symbol in Octave, as in `octave/number_of.m`."""
    h = 0
    for c in name.encode():
        h = (31 * h + c) % 1000003
    return 1.1 + 7919 * h % 1000003 / 1000003


def octave(script: Path) -> list[tuple[str, list[float], list[float]]]:
    """Variables that a script saves: names, f and h."""
    folder = Path(__file__).with_name("octave")
    program = f"warning('off','all'); addpath('{folder}'); run('{script}');"
    done = subprocess.run(["octave-cli", "--no-init-file", "--eval", program], capture_output=True, text=True, timeout=60, check=False)
    lines = [line.split() for line in done.stdout.splitlines()]
    names = [line[1] for line in lines if line[:1] == ["model"]]
    rows = [[[float(x) for x in line[1:]] for line in lines if line[:1] == [key]] for key in "fh"]
    return list(zip(names, *rows, strict=True))


def same(script: Path) -> tuple[int, list[str]]:
    """Number of models in a script, and the differences."""
    text = script.read_text(encoding="utf-8", errors="replace")
    names = strike_goldd.models(text)
    systems = [strike_goldd.read(text, model=i + 1) for i in range(len(names))]
    found = octave(script)
    if len(found) != len(names):
        return 0, [f"Octave saves {len(found)} models, {len(names)} were read"]
    wrong = []
    for i, (name, f, h) in enumerate(found):
        to_toml(systems[i])
        formulas = [*(s.rate for s in systems[i].states.values()), *systems[i].outputs.values()]
        mine = [complex(e.subs({n: number_of(n) for n in names_in(e)}).evalf(30)) for e in formulas]
        if len(mine) != len(f) + len(h) or any(abs(a - b) > 1e-11 * max(1, abs(b)) for a, b in zip(mine, f + h, strict=True)):
            wrong.append(name)
    return len(found), wrong


def main(folder: str) -> int:
    """Reads and compares all scripts."""
    models = scripts = differ = refused = 0
    for script in sorted(Path(folder).rglob("*.m")):
        try:
            count, wrong = same(script)
        except ImportProblem as problem:
            refused += 1
            print(f"refused  {script.name}: {problem}")
            continue
        models, scripts, differ = models + count, scripts + 1, differ + len(wrong)
        for name in wrong:
            print(f"differs  {script.name}: {name}")
    print(f"{models} models of {scripts} scripts: {differ} differ; {refused} scripts refused")
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))

"""The loop from the sheet to the decision: a simulated rate table on loopback plays a sheet, its record is calibrated.

The table (`examples/rate-table/rate_table.py`) is independent of obsdeg. `LOOP_RUNS` is the number of runs with every coefficient
at one of its limits (default 6; the full length is 200).
"""

from __future__ import annotations

import math
import os
import random
import runpy
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import obsdeg

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "examples" / "rate-table"
TABLE = runpy.run_path(str(FOLDER / "rate_table.py"))
LIMITS = {"D_F": 1.0, "D_I": 1.0, "D_O": 0.8, "D_S": 0.8}
SETTLE = 20
#: The scheme with the wait, which `obsdeg procedure` writes into its folder.
SCHEME = f"record = {{ settle = {SETTLE} }}\n" + (FOLDER / "scheme.toml").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def sheet() -> Any:
    return obsdeg.procedure(FOLDER / "scheme.toml", settle=SETTLE)


def played(
    sheet: Any,
    drifts: dict[str, float],
    seed: int,
    of_steps: Callable[[Any], None] | None = None,
    of_platform: Callable[[Any], None] | None = None,
) -> list[list[Any]]:
    """Record of a run of the sheet on a table with these drifts; steps and platform may be changed before."""
    tilt = [random.Random(seed).gauss(0.0, 0.05) for _ in range(3)]
    platform = TABLE["Platform"](drifts, tilt, 48.2, 1e-5, seed)
    steps = sheet.to_dict()
    if of_steps:
        of_steps(steps)
    if of_platform:
        of_platform(platform)
    with TABLE["Server"](platform) as server:
        rows: list[list[Any]] = TABLE["play"](steps, ("127.0.0.1", server.server_address[1]), 4.0)
    return rows


def calibrated(rows: list[list[Any]]) -> obsdeg.Calibration:
    """Calibration of the scheme from these rows."""
    columns = list(zip(*rows))
    names = ["t [s]", "position", "fx [g]", "fy [g]", "fz [g]"]
    answer = obsdeg.calibrate(obsdeg.Scheme.from_text(SCHEME), dict(zip(names, map(list, columns))))
    assert isinstance(answer, obsdeg.Calibration)
    return answer


def test_a_run_is_what_the_sheet_promises(sheet: Any) -> None:
    """Estimates agree with the truth, their sigmas with the sheet, and all coefficients are accepted."""
    drifts = TABLE["drawn"](3, {"D_F": 0.4, "D_I": 0.3, "D_O": 0.3, "D_S": 0.3})
    found = calibrated(played(sheet, drifts, 3))
    assert found.consistent
    for coefficient in sheet.coefficients:
        own = found[coefficient.name]
        assert abs(own.estimate - drifts[coefficient.name]) < 4.5 * own.sigma, coefficient.name
        assert own.predicted_sigma == pytest.approx(coefficient.uncertainty, rel=0.01)
    assert all(limit.decision == "accepted" for limit in found.acceptance.limits)


def test_what_is_known_early_is_known(sheet: Any) -> None:
    """A record that ends with the position from which all requirements are met has the uncertainties of that position."""
    last = next(after for after in sheet.after if after.met == 12)
    assert last.position == "p5"
    shorter = SCHEME[: SCHEME.index('[[position]]\nname = "p6"')]
    drifts = TABLE["drawn"](5, {"D_F": 0.4, "D_I": 0.3, "D_O": 0.3, "D_S": 0.3})
    rows = [row for row in played(sheet, drifts, 5) if row[1] != "p6"]
    names = ["t [s]", "position", "fx [g]", "fy [g]", "fz [g]"]
    found = obsdeg.calibrate(obsdeg.Scheme.from_text(shorter), dict(zip(names, map(list, zip(*rows)))))
    assert found.requirements is not None and found.requirements.met == 12
    for coefficient, uncertainty in zip(sheet.coefficients, last.uncertainty):
        assert found[coefficient.name].predicted_sigma == pytest.approx(uncertainty, rel=0.01)


def test_a_wrong_table_is_stopped(sheet: Any) -> None:
    """Exchanged axes, a wrong sign and a step that is left out end the run at the next reading."""
    drifts = dict.fromkeys((family + axis for family in LIMITS for axis in "XYZ"), 0.0)

    def exchanged(platform: Any) -> None:
        force = platform.force
        platform.force = lambda: [force()[k] for k in (1, 0, 2)]

    def reversed_sense(steps: Any) -> None:
        for step in steps["steps"]:
            if step["turn"]:
                step["turn"]["about_platform"] = [-x for x in step["turn"]["about_platform"]]

    def without_a_turn(steps: Any) -> None:
        del steps["steps"][3]

    stopped = TABLE["StoppedError"]
    with pytest.raises(stopped, match="step 2, p1: read"):
        played(sheet, drifts, 1, of_platform=exchanged)
    with pytest.raises(stopped, match="p2: read"):
        played(sheet, drifts, 1, of_steps=reversed_sense)
    with pytest.raises(stopped, match="p2: read"):
        played(sheet, drifts, 1, of_steps=without_a_turn)


def most(n: int, p: float) -> int:
    """Number that a binomial variable exceeds with a probability below 1e-4."""
    tail, k = 1.0, -1
    while tail >= 1e-4:
        k += 1
        tail -= math.comb(n, k) * p**k * (1 - p) ** (n - k)
    return k


def test_false_decisions_are_as_rare_as_stated(sheet: Any) -> None:
    """Every coefficient lies at one of its limits: at most 5 % are accepted, at most 5 % rejected."""
    runs = int(os.environ.get("LOOP_RUNS", "6"))
    accepted = rejected = inconsistent = 0
    for seed in range(runs):
        source = random.Random(1000 + seed)
        drifts = {family + axis: source.choice((-1, 1)) * limit for family, limit in LIMITS.items() for axis in "XYZ"}
        found = calibrated(played(sheet, drifts, seed))
        inconsistent += not found.consistent
        decisions = [limit.decision for limit in found.acceptance.limits]
        accepted += decisions.count("accepted")
        rejected += decisions.count("rejected")
    print(f"{runs} runs, {12 * runs} coefficients: {accepted} accepted, {rejected} rejected, {inconsistent} records not consistent")
    # coefficients of one run are correlated: their number of independent ones is taken as a third
    bound = 3 * most(4 * runs, 0.05)
    assert accepted <= bound and rejected <= bound and inconsistent <= most(runs, 0.01)
    # a rule that never decides would pass
    assert runs < 100 or min(accepted, rejected) > 0.02 * 12 * runs


def test_the_commands_of_the_example(tmp_path: Path) -> None:
    """The three commands of the README, as a user types them."""
    program = os.environ.get("OBSDEG_PROGRAM") or str(ROOT / "target" / "debug" / "obsdeg")
    if not Path(program).exists():
        pytest.skip("no program")
    run = tmp_path / "run"
    command = [program, "procedure", str(FOLDER / "scheme.toml"), "--settle", "20", "-o", str(run), "--quiet"]
    subprocess.run(command, check=True, capture_output=True)
    done = subprocess.run([sys.executable, str(FOLDER / "rate_table.py"), str(run)], check=True, capture_output=True, text=True)
    assert done.stdout.startswith("600 rows; true drifts")
    command = [program, "calibrate", str(run / "scheme.toml"), str(run / "record.csv"), "--require-met"]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    assert "Every coefficient with limits is accepted, 12 of 12." in done.stdout

"""The examples beside pybounds, python-control and pyPESTO, and the recipes for clusters against the packages that they name.

`.ci/run release` runs them with OTHER_TOOLS=1; their packages are those of `other_tools.txt`.
"""

from __future__ import annotations

import os
import runpy
from pathlib import Path
from typing import Any

import pytest
from conftest import ROOT

pytestmark = pytest.mark.skipif("OTHER_TOOLS" not in os.environ, reason="at release length, with OTHER_TOOLS=1")
FOLDER = ROOT / "examples" / "other-tools"


def example(name: str, package: str) -> dict[str, Any]:
    """Names of an example."""
    pytest.importorskip(package, reason=f"{package} is not installed: pip install -r python/tests/other_tools.txt")
    return runpy.run_path(str(FOLDER / name))


def test_pybounds_bounds_what_obsdeg_calls_observable(capsys: pytest.CaptureFixture[str]) -> None:
    shown = example("with_pybounds.py", "pybounds")
    found = shown["main"]()
    # exact verdicts do not depend on the size of the acceleration
    assert {name: {state.status for state in of.values()} for name, of in found.items()} == {
        "none": {"inseparable"},
        "1e-5 m/s^2": {"observable"},
        "1 m/s^2": {"observable"},
    }
    assert {state.degree for state in found["1 m/s^2"].values()} == {1}
    assert "observable instead: g/d" in capsys.readouterr().out
    # without acceleration: the prior of 1/lam along the line g/d = const
    ceiling = shown["LAM"] ** -0.5
    g, d = (found["none"][name].sigma for name in ("g", "d"))
    assert (g**2 + d**2) ** 0.5 == pytest.approx(ceiling, rel=0.1) and g / d == pytest.approx(5 / 3, rel=0.01)
    # a small one looks alike to a factor of ten, although it is observable; a large one is determined to a few centimetres
    assert g / 10 < found["1e-5 m/s^2"]["g"].sigma < g and found["1 m/s^2"]["g"].sigma < 0.05


def test_the_rank_of_control_depends_on_units(capsys: pytest.CaptureFixture[str]) -> None:
    found = example("with_control.py", "control")["main"]()
    assert {name: (of.numeric, of.exact) for name, of in found.items()} == {"end, seconds": (4, 6), "end, hours": (6, 6), "middle, hours": (3, 3)}
    # the middle sees only the sum of two cells at equal distances
    shown = capsys.readouterr().out.split()
    assert [shown[i + 1 : i + 4] for i, word in enumerate(shown) if word == "instead:"] == [["T1", "+", "T5"], ["T2", "+", "T4"]]


def test_a_gate_before_a_fit_with_pypesto() -> None:
    found, without, within = example("with_pypesto.py", "pypesto")["main"]()
    assert sorted(found.open) == ["F", "V"] and len(found.fix) == 1 and found.combine in (["F/V"], ["V/F"])
    assert without is None
    # the volume of the literature is the clearance by the rate of elimination: exp(-3.9159 + 2.9196) in examples/theophylline
    low, high = within
    assert low < 0.3692 < high and high - low < 0.2


def test_recipes_are_what_their_packages_take(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    jobqueue = pytest.importorskip("dask_jobqueue", reason="dask-jobqueue is not installed: pip install -r python/tests/other_tools.txt")
    operator = pytest.importorskip("dask_kubernetes.operator", reason="dask-kubernetes is not installed: pip install -r python/tests/other_tools.txt")
    from test_recipes import run

    with monkeypatch.context() as patched:
        slurm, scaled = run("dask_jobqueue", tmp_path, patched)
        (kubernetes,) = run("dask_kubernetes.operator", tmp_path, patched)
    with jobqueue.SLURMCluster(**slurm, scheduler_options={"dashboard_address": None}) as cluster:
        script = cluster.job_script()
    assert scaled == {"jobs": 63}
    for part in ("-p batch", "-A gyros", "--cpus-per-task=16", "-t 04:00:00"):
        assert f"#SBATCH {part}\n" in script
    for part in ("--nworkers 16", "--nthreads 1", "--lifetime 225m --lifetime-stagger 10m"):
        assert part in script
    spec = operator.make_cluster_spec(**kubernetes)
    worker = spec["spec"]["worker"]
    assert worker["replicas"] == 1000 and worker["spec"]["containers"][0]["resources"]["limits"] == {"cpu": "1", "memory": "2Gi"}
    assert worker["spec"]["containers"][0]["image"] == kubernetes["image"]

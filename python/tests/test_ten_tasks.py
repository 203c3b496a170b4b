"""Ten tasks of a new user in a few lines each, and the walk-through of 40 lines."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import obsdeg
import pytest
from conftest import ROOT
from obsdeg import campaign

pandas = pytest.importorskip("pandas")
pytest.importorskip("matplotlib").use("Agg")
PAIR = [(0, 0, 0), (180, 0, 0)]


def test_1_analyze_as_a_frame() -> None:
    frame = obsdeg.analyze([(0, 0, 0), (180, 0, 0)], carry="inertial").to_frame()
    assert frame.set_index("name").loc["D_FX", "degree"] == 1


def test_2_a_sweep() -> None:
    # SWEEP=10000 judges ten thousand tasks; a hundred every day
    count = int(os.environ.get("SWEEP", "100"))
    numpy = pytest.importorskip("numpy")
    angles = numpy.random.default_rng(1).uniform(-180, 180, (count, 2, 3))
    rows = campaign.table(dict(angles=a, terms="F", carry="inertial") for a in angles)
    # two random attitudes determine psi and three drifts
    assert len(rows) == 6 * count and (rows["status"] == "observable").all()


def test_3_a_design() -> None:
    best = obsdeg.design(4, carry="inertial", observable="D_F").winner()
    assert {obsdeg.analyze(best)[name].status for name in ("D_FX", "D_FY", "D_FZ")} == {"observable"}


def test_4_a_plot(tmp_path: Path) -> None:
    axes = obsdeg.compare(PAIR, [*PAIR, "DNE"], carry="inertial").plot()
    axes[0].figure.savefig(tmp_path / "compared.png")
    assert (tmp_path / "compared.png").stat().st_size > 10_000


def test_5_calibrate_arrays() -> None:
    numpy = pytest.importorskip("numpy")
    t = numpy.arange(0, 10, 0.1)
    decay = obsdeg.Model(states={"x": "-k*x"}, outputs={"y": "x"})
    fit = obsdeg.calibrate(decay, t=t, outputs={"y": 3 * numpy.exp(-0.7 * t)})
    assert (fit["x"].estimate, fit["k"].estimate) == (pytest.approx(3), pytest.approx(0.7))


def test_6_a_model_of_sympy() -> None:
    sympy = pytest.importorskip("sympy")
    s, i, beta, gamma = sympy.symbols("s i beta gamma")
    model = obsdeg.Model(states={s: -beta * s * i, i: beta * s * i - gamma * i}, outputs={"ill": i})
    assert set(obsdeg.analyze(model).statuses.values()) == {"observable"}


def test_7_import(tmp_path: Path) -> None:
    (tmp_path / "decay.jl").write_text("ode = @ODEmodel(\n    x1'(t) = -a*b*x1(t),\n    y(t) = x1(t)\n)\n")
    assert obsdeg.analyze(obsdeg.load(tmp_path / "decay.jl"))["a"].partners == ["b"]


def test_8_export(tmp_path: Path) -> None:
    from obsdeg.importers import exporters

    (tmp_path / "decay.jl").write_text(exporters.to_si_jl(obsdeg.Model(states={"x": "-a*x"}, outputs={"y": "x"})))
    assert obsdeg.analyze(obsdeg.load(tmp_path / "decay.jl")).statuses == {"x": "observable", "a": "observable"}


def test_9_an_interrupt() -> None:
    # interrupted as soon as there is a first scheme
    found = obsdeg.design(9, carry="inertial", restarts=100_000, progress=lambda what, done, total, examined, best: best is None)
    assert len(found.winner()) == 9 and found.search is not None and found.search.interrupted


def test_10_a_report_inline() -> None:
    page = obsdeg.report(PAIR, runs=2)._repr_html_()
    assert page.startswith("<iframe srcdoc=") and "D_FX" in page and page.count("&lt;svg") >= 1


def test_the_walk_through_of_40_lines() -> None:
    script = ROOT / "python" / "notebooks" / "walk_through.py"
    text = script.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 40
    assert not any(word in text for word in ("open(", "read", "write", ".csv", ".toml", "import re"))
    done = subprocess.run([sys.executable, str(script)], env={**os.environ, "MPLBACKEND": "Agg"}, capture_output=True, text=True, check=True, timeout=300)
    degrees, verdict, *drifts = done.stdout.splitlines()
    assert "'D_FY': 2" in degrees and verdict == "the model explains the record"
    for line in drifts:
        # the truth of the script, within four sigma
        name, _, estimate, _, sigma, _, _, true = line.replace(",", "").split()
        assert abs(float(estimate) - float(true)) < 4 * float(sigma) < 0.01, name

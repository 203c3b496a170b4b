"""Pictures contain the numbers of their answers, and notebooks show them."""

from __future__ import annotations

import base64
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import obsdeg
import pytest
from conftest import ROOT

matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("Agg")
PAIR = [(0, 0, 0), (180, 0, 0)]


@pytest.fixture(autouse=True)
def in_root(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


def points(axes: Any) -> dict[str, list[tuple[float, float]]]:
    """Drawn points by label in the legend."""
    return {line.get_label(): list(zip(line.get_xdata(), line.get_ydata(), strict=True)) for line in axes.lines}


def names(axes: Any) -> list[str]:
    return [text.get_text() for text in axes.get_yticklabels()]


def test_a_run_has_its_sigmas_and_histories(monkeypatch: pytest.MonkeyPatch) -> None:
    run = obsdeg.simulate(PAIR, carry="inertial", requirement={"D_F": 0.05}, step=100)
    (axes,) = run.plot()
    rows = run.to_dict()["quantities"]
    drawn = points(axes)
    assert drawn["end of the run"] == [(q["sigma"], i) for i, q in enumerate(rows)]
    assert drawn["prior"] == [(q["prior_sigma"], i) for i, q in enumerate(rows)]
    assert drawn["required"] == [(0.05, i) for i, q in enumerate(rows) if q["name"].startswith("D_F")]
    assert names(axes) == [f"{q['name']} [{q['unit']}]" for q in rows]
    series = run.series()
    # the series is made once
    monkeypatch.setattr(type(run), "files", lambda self, **_: pytest.fail("drawn again"))
    panels = run.plot("D_FX", "psi_x")
    assert [p.get_ylabel() for p in panels] == ["D_FX [deg/h]", "psi_x [deg]"]
    found = points(panels[0])
    assert found["estimate"] == list(zip(series["t_s"], series["D_FX_estimate_dph"], strict=True))
    assert found["truth"] == list(zip(series["t_s"], series["D_FX_true_dph"], strict=True))
    with pytest.raises(KeyError, match="no unknown 'D_XX' in this run"):
        run.plot("D_XX")


def test_schemes_side_by_side() -> None:
    both = obsdeg.compare(PAIR, [*PAIR, "DNE"], carry="inertial")
    drawn = points(both.plot()[0])
    for scheme in both:
        assert [x for x, _ in drawn[scheme.name]] == [q.sigma for q in scheme.quantities if q.status == "observable"]


def test_searches_calibrations_and_cross_checks() -> None:
    found = obsdeg.design(3, carry="inertial", observable="D_F")
    panels = found.plot()
    assert [x for x, _ in next(iter(points(panels[0]).values()))] == [f.value for f in found]
    fit = obsdeg.calibrate("examples/bench-day/scheme.toml", "examples/bench-day/record.csv")
    residuals, sigmas = fit.plot()
    for series in fit.to_dict()["series"]:
        assert points(residuals)[series["channel"]] == [(t, r / s) for t, r, s in series["points"]]
    assert points(sigmas)["by the noise"] == [(q.sigma, i) for i, q in enumerate(fit)]
    assert names(sigmas)[3].startswith("D_FX = 1.301 \u00b1 0.0027 deg/h")
    model = obsdeg.calibrate("examples/influenza/model.toml", "examples/influenza/data.csv")
    measured = model.plot()[0]
    # the noise was estimated from the residuals, with two degrees of freedom less
    of = [r for _, r in points(measured)["in_bed"]]
    assert len(of) == 14 and sum(r * r for r in of) == pytest.approx(model.chi_square, rel=1e-6)
    crossed = obsdeg.crosscheck(PAIR, carry="inertial", runs=5)
    lines = [list(zip(line.get_xdata(), line.get_ydata(), strict=True)) for line in crossed.plot()[0].lines]
    slopes = crossed.to_dict()["slopes"]
    assert sorted(lines) == sorted([p for p in map(tuple, c["points"]) if p[1] > 0] for c in slopes if c["points"])
    said = " ".join(line.get_label() for line in crossed.plot()[0].lines)
    assert all(c["name"] in said.replace("\n", " ") for c in slopes)
    evidence = obsdeg.crosscheck("examples/sir/model.toml")
    drawn = points(evidence.plot()[0])
    assert drawn["predicted"] == [(q.slope.predicted, i) for i, q in enumerate(evidence.quantities)]


def test_pages_of_notebooks_have_figures(tmp_path: Path) -> None:
    shown: dict[str, obsdeg.Answer] = {
        "<svg": obsdeg.analyze(PAIR),
        "simulation": obsdeg.simulate(PAIR),
        "comparison": obsdeg.compare(PAIR, ["NUE", "NDW", "DNE"]),
        "cross-check": obsdeg.crosscheck(PAIR, runs=5),
    }
    for kind, answer in shown.items():
        page = answer._repr_html_()
        assert answer._repr_mimebundle_()["text/html"] == page
        if kind == "<svg":
            assert kind in page
        else:
            image = re.search(r'<img alt="plot" src="data:image/png;base64,([^"]+)">', page)
            assert image and base64.b64decode(image[1]).startswith(b"\x89PNG")
        assert answer._repr_html_() == page
    # they leave no figure of pyplot open
    from matplotlib import pyplot

    before = len(pyplot.get_fignums())
    shown["simulation"]._repr_html_()
    assert len(pyplot.get_fignums()) == before
    pyplot.close("all")


def test_a_figure_of_the_user_is_drawn_into() -> None:
    from matplotlib.figure import Figure

    figure = Figure()
    left, right = figure.subfigures(1, 2)
    run = obsdeg.simulate(PAIR)
    assert run.plot(figure=left)[0].figure is left and run.plot(figure=right)[0].figure is right
    assert len(figure.axes) == 2


def test_without_matplotlib_it_is_said() -> None:
    script = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "import obsdeg\n"
        "run = obsdeg.simulate([(0, 0, 0)])\n"
        "assert '<img' not in run._repr_html_()\n"
        "try: run.plot()\n"
        "except ImportError as e: print(e)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.strip() == "plot() needs the package `matplotlib`, which is not installed: pip install 'obsdeg[plots]'"


def test_importing_loads_none_of_what_is_optional() -> None:
    script = "import obsdeg, sys; obsdeg.analyze([(0, 0, 0)]); print([m for m in ('matplotlib', 'numpy', 'pandas', 'pyarrow', 'sympy') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.strip() == "[]"


def test_a_series_needs_no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    run = obsdeg.simulate(PAIR, carry="inertial", step=100)
    plain, whole = run.files(pictures=False), run.files()
    assert sorted(plain) == ["series.csv", "series.parquet"]
    assert all(whole[name] == text for name, text in plain.items())
    assert any(name.endswith(".svg") for name in whole) and any(name.endswith(".png") for name in whole)
    asked: list[bool] = []
    files = type(run).files

    def counted(self: Any, *, pictures: bool = True) -> dict[str, bytes]:
        asked.append(pictures)
        return files(self, pictures=pictures)

    monkeypatch.setattr(type(run), "files", counted)
    run.series()
    assert asked == [False]

"""Pictures of answers by matplotlib, which is imported when one is drawn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from ._packages import check_package

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from . import _results

    Canvas = Figure | SubFigure

#: Height in inches of a row with a name, and largest number of names.
_ROW, _NAMES = 0.24, 60


def figure_of(width: float, height: float) -> Figure:
    """Empty figure of pyplot, with its size in inches.

    Raises:
        ImportError: matplotlib is not installed.
    """
    check_package("matplotlib", "plot()", "obsdeg[plots]")
    from matplotlib import pyplot

    return pyplot.figure(figsize=(width, height), layout="constrained")


def picture(draw: Callable[[Canvas], list[Axes]], width: float, height: float) -> str | None:
    """Picture in a page as HTML; None if matplotlib is not installed."""
    try:
        from matplotlib.figure import Figure
    except ModuleNotFoundError:
        return None
    import base64
    import io

    figure = Figure(figsize=(width, height), layout="constrained")
    draw(figure)
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=80, metadata={"Software": None})
    return f'<img alt="plot" src="data:image/png;base64,{base64.b64encode(data.getvalue()).decode("ascii")}">'


def height_of(names: int) -> float:
    """Height in inches of a panel with `n` names."""
    return 1.0 + _ROW * max(4, min(names, _NAMES))


#: Group of points beside names: label, values (None if missing), marker, colour, True if filled.
_Group = tuple[str, Sequence[Any], str, str, bool]


def _dots(axes: Axes, labels: Sequence[str], groups: Sequence[_Group], x: str) -> None:
    """Draws positive numbers by name on a logarithmic axis, with the first name on top."""
    places = range(len(labels))
    drawn = False
    for label, values, marker, colour, filled in groups:
        points = [(v, i) for i, v in zip(places, values, strict=True) if v is not None and v > 0]
        if points:
            face = colour if filled or marker in "|x" else "none"
            size = 14 if marker == "|" else 6
            style: dict[str, Any] = {"linestyle": "", "marker": marker, "color": colour, "markerfacecolor": face, "markersize": size}
            axes.plot(*zip(*points, strict=True), **style, label=label)
            drawn = True
    axes.set_xlabel(x)
    axes.set_ylim(len(labels) - 0.4, -0.6)
    if drawn:
        axes.set_xscale("log")
        longest = max(len(group[0]) for group in groups)
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=max(1, min(4, 70 // longest)), frameon=False, fontsize="small")
    if len(labels) <= _NAMES:
        axes.set_yticks(list(places), labels)
    axes.tick_params(labelsize="small")
    axes.grid(axis="x", alpha=0.3)
    axes.grid(axis="y", alpha=0.15)


def _panels(canvas: Canvas, count: int, **options: Any) -> list[Axes]:
    found: list[Axes] = list(canvas.subplots(count, 1, squeeze=False, **options)[:, 0])
    return found


def simulation(of: _results.Simulation | _results.SystemRun, canvas: Canvas) -> list[Axes]:
    """Draws sigmas at the start and at the end of a run, predicted and required sigmas."""
    rows = of.to_dict()["quantities"]
    labels = [f"{q['name']} [{q['unit']}]" if q["unit"] else q["name"] for q in rows]
    groups: list[_Group] = [
        ("prior", [q["prior_sigma"] for q in rows], "o", "0.5", False),
        ("end of the run", [q["sigma"] for q in rows], "o", "tab:blue", True),
        ("predicted", [q.get("predicted_sigma") for q in rows], "x", "tab:orange", True),
        ("required", [q.get("required_sigma") for q in rows], "|", "tab:red", True),
    ]
    axes = canvas.subplots()
    _dots(axes, labels, groups, "sigma [unit of the unknown]")
    return [axes]


def histories(of: _results.Simulation | _results.SystemRun, names: Sequence[str], canvas: Canvas) -> list[Axes]:
    """Draws truth, estimate and sigma over time, one panel per unknown."""
    series = of.series()
    units = {q["name"]: q["unit"] for q in of.to_dict()["quantities"]}
    time = next(c for c in series if c == "t_s" or c == "t" or c.startswith("t_"))
    panels = _panels(canvas, len(names), sharex=True)
    runs = series.groupby("experiment") if "experiment" in series else [(None, series)]
    for axes, name in zip(panels, names, strict=True):
        columns = {kind: next(c for c in series if c.startswith(f"{name}_{kind}")) for kind in ("true", "estimate", "sigma")}
        for i, (_, run) in enumerate(runs):
            t, estimate, sigma = run[time], run[columns["estimate"]], run[columns["sigma"]]
            axes.fill_between(t, estimate - sigma, estimate + sigma, color="tab:blue", alpha=0.2, label=None if i else "one sigma")
            axes.plot(t, estimate, color="tab:blue", label=None if i else "estimate")
            axes.plot(t, run[columns["true"]], color="black", linestyle="--", label=None if i else "truth")
        # the first samples have large errors and would set the scale
        settled = series.iloc[len(series) // 10 :]
        low = min((settled[columns["estimate"]] - settled[columns["sigma"]]).min(), series[columns["true"]].min())
        high = max((settled[columns["estimate"]] + settled[columns["sigma"]]).max(), series[columns["true"]].max())
        margin = 0.05 * (high - low) or 1.0
        axes.set_ylim(low - margin, high + margin)
        axes.set_ylabel(f"{name} [{units[name]}]" if units[name] else name, fontsize="small")
        axes.grid(alpha=0.3)
        for part in of.to_dict().get("timeline", [])[1:]:
            axes.axvline(part["start_s"], color="0.7", linewidth=0.8)
    panels[0].legend(fontsize="small", ncols=3, loc="upper right")
    panels[-1].set_xlabel("time [s]" if time == "t_s" else "time")
    return panels


def comparison(of: _results.Comparison, canvas: Canvas) -> list[Axes]:
    """Draws sigmas of the coefficients at the end of each scheme."""
    schemes = of.to_dict()["schemes"]
    names = list(dict.fromkeys(q["name"] for s in schemes for q in s["quantities"]))
    tables = [{q["name"]: q for q in s["quantities"]} for s in schemes]
    units = {n: next(t[n]["unit"] for t in tables if n in t) for n in names}
    groups: list[_Group] = []
    for i, (scheme, table) in enumerate(zip(schemes, tables, strict=True)):
        sigmas = [table[n]["sigma"] if n in table and table[n]["status"] == "observable" else None for n in names]
        groups.append((_short(scheme["name"]), sigmas, "os^vDP*"[i % 7], f"C{i}", True))
    required = [next((t[n]["requirement"] for t in tables if n in t and t[n].get("requirement")), None) for n in names]
    groups.append(("required", required, "|", "tab:red", True))
    axes = canvas.subplots()
    _dots(axes, [f"{n} [{units[n]}]" for n in names], groups, "predicted sigma [unit of the unknown]; without a mark: not observable")
    return [axes]


def design(of: _results.Design, canvas: Canvas) -> list[Axes]:
    """Draws the criterion of the found schemes, and its smallest value by total time."""
    answer = of.to_dict()
    found, front = answer["found"], answer["front"]
    search = answer["search"] or {}
    value = f"{search.get('criterion', 'criterion')} [{search.get('unit', '')}]"
    count = 1 + (len(front) > 1)
    panels = list(canvas.subplots(1, count, squeeze=False)[0]) if found else []
    if found:
        shown = found[:20]
        labels = [" ".join(f["positions"]) if len(f["positions"]) <= 8 else f"{len(f['positions'])} positions" for f in shown]
        panels[0].plot([f["value"] for f in shown], range(len(shown)), "o", color="tab:blue")
        panels[0].set_yticks(range(len(shown)), labels, fontsize="x-small")
        panels[0].invert_yaxis()
        # equal values differ by rounding, which the axis must not show
        least, most = shown[0]["value"], shown[-1]["value"]
        if abs(most - least) < 1e-3 * abs(least):
            panels[0].set_xlim(sorted((0.9 * least, 1.1 * least)))
        panels[0].ticklabel_format(axis="x", useOffset=False)
        panels[0].locator_params(axis="x", nbins=5)
        panels[0].set_xlabel(value)
        panels[0].set_title("Schemes found, best first", fontsize="medium")
        panels[0].grid(alpha=0.3)
    if found and count == 2:
        panels[1].step([f["total_s"] for f in front], [f["value"] for f in front], where="post", color="0.6")
        panels[1].plot([f["total_s"] for f in front], [f["value"] for f in front], "o", color="tab:orange")
        for f in front:
            panels[1].annotate(f" {len(f['positions'])}", (f["total_s"], f["value"]), fontsize="small")
        panels[1].set_yscale("log")
        panels[1].set_xlabel("total time [s]")
        panels[1].set_ylabel(value)
        panels[1].set_title("Least value by time; numbers of positions", fontsize="medium")
        panels[1].grid(alpha=0.3)
    return panels


def calibration(of: _results.Calibration, canvas: Canvas) -> list[Axes]:
    """Draws residuals over time, and sigmas beside predicted and required ones."""
    answer = of.to_dict()
    panels = _panels(canvas, 2, height_ratios=[1, max(1.0, _ROW * len(answer["quantities"]) / 2.2)])
    for i, series in enumerate(answer["series"]):
        t, residual, sigma = zip(*series["points"], strict=True) if series["points"] else ((), (), ())
        label = series["channel"] if len(answer["records"]) == 1 else f"{series['record']}, {series['channel']}"
        panels[0].plot(t, [r / s for r, s in zip(residual, sigma, strict=True)], ".", markersize=3, color=f"C{i}", label=label)
    _residuals(panels[0], "time [s]")
    _estimates(panels[1], answer["quantities"])
    return panels


def system_calibration(of: _results.SystemCalibration, canvas: Canvas) -> list[Axes]:
    """Draws residuals over time, and sigmas of the estimates."""
    import io

    import pandas

    answer = of.to_dict()
    panels = _panels(canvas, 2, height_ratios=[1, max(1.0, _ROW * len(answer["quantities"]) / 2.2)])
    residuals = pandas.read_csv(io.BytesIO(of.files(pictures=False)["residuals.csv"]))
    for i, (name, rows) in enumerate(residuals.groupby("output", sort=False)):
        panels[0].plot(rows["t"], rows["residual"] / rows["sigma"], ".", color=f"C{i}", label=str(name))
    _residuals(panels[0], "time")
    _estimates(panels[1], answer["quantities"])
    return panels


def _residuals(axes: Axes, time: str) -> None:
    axes.axhline(0, color="0.6", linewidth=0.8)
    for level in (-2, 2):
        axes.axhline(level, color="0.6", linewidth=0.8, linestyle=":")
    axes.set_xlabel(time)
    axes.set_ylabel("residual [sigma]")
    axes.legend(fontsize="small", ncols=4, loc="upper right")
    axes.grid(alpha=0.3)


def _estimates(axes: Axes, rows: list[dict[str, Any]]) -> None:
    """Draws sigmas beside the estimates in words."""

    def label(q: dict[str, Any]) -> str:
        if q["estimate"] is None or q["sigma"] is None:
            return f"{q['name']}: not determined"
        return f"{q['name']} = {q['estimate']:.4g} \u00b1 {q['sigma']:.2g} {q['unit']}".rstrip()

    groups: list[_Group] = [
        ("rescaled", [q["sigma_rescaled"] for q in rows], "o", "0.4", False),
        ("by the noise", [q["sigma"] for q in rows], "o", "tab:blue", True),
        ("predicted", [q.get("predicted_sigma") for q in rows], "x", "tab:orange", True),
    ]
    _dots(axes, [label(q) for q in rows], groups, "sigma of the estimate [unit of the unknown]")


def crosscheck(of: _results.CrossCheck, canvas: Canvas) -> list[Axes]:
    """Draws sigma against the dwell, by accuracy order."""
    axes = canvas.subplots()
    curves: dict[Any, list[Any]] = {}
    for curve in of.to_dict()["slopes"]:
        if any(y > 0 for _, y in curve["points"]):
            curves.setdefault(curve["accuracy_order"], []).append(curve)
    for order, some in curves.items():
        style = {"color": "0.7", "linestyle": "--"} if order is None else {"color": f"C{order}"}
        title = "not observable" if order is None else f"accuracy order {order}"
        label: str | None = "\n".join(wrap(f"{title}: {', '.join(curve['name'] for curve in some)}", 34))
        for curve in some:
            points = [(x, y) for x, y in curve["points"] if y > 0]
            axes.loglog(*zip(*points, strict=True), **style, linewidth=1, label=label)
            label = None
    axes.set_xlabel("dwell of a position [s]")
    axes.set_ylabel("sigma [unit of the unknown]")
    axes.set_title("Slope of sigma: minus accuracy order minus one half", fontsize="medium")
    if curves:
        axes.legend(fontsize="x-small", loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    axes.grid(alpha=0.3)
    return [axes]


def system_evidence(of: _results.SystemEvidence, canvas: Canvas) -> list[Axes]:
    """Draws slopes of sigma against the horizon, predicted and measured."""
    rows = of.to_dict()["quantities"]
    axes = canvas.subplots()
    for key, marker, colour in (("predicted", "o", "0.4"), ("measured", "x", "tab:blue")):
        points = [(q["slope"][key], i) for i, q in enumerate(rows) if q["slope"][key] is not None]
        if points:
            face = "none" if marker == "o" else colour
            axes.plot(*zip(*points, strict=True), linestyle="", marker=marker, color=colour, markerfacecolor=face, label=key)
    axes.set_yticks(range(len(rows)), [q["name"] for q in rows], fontsize="small")
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_xlabel("slope of log sigma against log horizon")
    axes.legend(fontsize="small")
    axes.grid(alpha=0.3)
    return [axes]


#: Degrees with a colour of their own in the picture of a sweep; larger ones have the last colour.
_DEGREES = 8
#: Colours of cells without a degree, by what they mean.
_CELLS = {"not observable": "white", "no such unknown": "0.88", "error": "mistyrose"}
_STYLES = ("-", "--", ":", "-.")


def sweep(rows: pandas.DataFrame, x: str, canvas: Canvas) -> list[Axes]:
    """Draws the degree of every unknown along a tag or option of a sweep, one column per task, and the sigmas of
    observable unknowns of simulated runs below."""
    import pandas
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    values = rows[x].drop_duplicates()
    if values.dtype.kind in "iuf":
        values = values.sort_values()
    place = {str(v): i for i, v in enumerate(values)}
    names = list(rows["name"].dropna().unique())
    faces: list[Any] = [*(colormaps["viridis_r"](d / (_DEGREES - 1)) for d in range(_DEGREES)), *_CELLS.values()]
    other = {what: _DEGREES + i for i, what in enumerate(_CELLS)}
    grid = [[other["no such unknown"]] * len(place) for _ in names]
    for row in rows.to_dict("records"):
        column = place[str(row[x])]
        if isinstance(row.get("error"), str):
            for line in grid:
                line[column] = other["error"]
        elif isinstance(row["name"], str):
            degree = other["not observable"] if pandas.isna(row["degree"]) else min(int(row["degree"]), _DEGREES - 1)
            grid[names.index(row["name"])][column] = degree
    runs = "sigma" in rows and rows["sigma"].notna().any()
    panels = _panels(canvas, 1 + runs, height_ratios=[1, 0.8] if runs else [1])
    if names:
        panels[0].imshow(grid, aspect="auto", interpolation="nearest", cmap=ListedColormap(faces), vmin=-0.5, vmax=len(faces) - 0.5)
    if len(names) <= _NAMES:
        panels[0].set_yticks(range(len(names)), names, fontsize="small")
    found = sorted({cell for line in grid for cell in line})
    label = {_DEGREES - 1: f"{_DEGREES - 1} or more", **{number: what for what, number in other.items()}}
    patches = [Patch(facecolor=faces[d], edgecolor="0.7", label=label.get(d, str(d))) for d in found]
    if patches:
        panels[0].legend(handles=patches, title="observable degree", loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=6, frameon=False, fontsize="small")
    if runs:
        _sigmas(panels[1], rows[rows["degree"].notna()], x, place)
    for axes in panels:
        _task_axis(axes, x, [_short(v) for v in values])
    return panels


def _sigmas(axes: Axes, rows: pandas.DataFrame, x: str, place: dict[str, int]) -> None:
    for i, (name, of) in enumerate(rows.groupby("name", sort=False)):
        along: list[float] = [float("nan")] * len(place)
        for row in of.to_dict("records"):
            along[place[str(row[x])]] = row["sigma"]
        unit = next((u for u in of["unit"] if isinstance(u, str) and u), "")
        style: dict[str, Any] = {"linestyle": _STYLES[i // 10 % len(_STYLES)], "marker": "os^v"[i // 40 % 4], "color": f"C{i % 10}"}
        axes.plot(range(len(place)), along, markersize=3, **style, label=f"{name} [{unit}]" if unit else name)
    axes.set_yscale("log")
    axes.set_ylabel("sigma at the end of the run")
    axes.legend(fontsize="x-small", ncols=1 + len(axes.lines) // 16, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    axes.grid(alpha=0.3)


def _task_axis(axes: Axes, x: str, labels: list[str]) -> None:
    """One place per task, with as many labels as fit."""
    longest = max(map(len, labels), default=1)
    step = -(-len(labels) // (12 if longest > 6 else 20))
    slanted: dict[str, Any] = {"rotation": 45, "ha": "right", "rotation_mode": "anchor"} if longest * len(labels[::step]) > 60 else {}
    axes.set_xticks(range(0, len(labels), step), labels[::step], fontsize="small", **slanted)
    axes.set_xlim(-0.5, max(len(labels), 1) - 0.5)
    axes.set_xlabel(x)


def _short(value: object) -> str:
    if value is None or value != value:
        return "not stated"
    text = f"{value:.4g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 24 else f"{text[:11]}...{text[-10:]}"

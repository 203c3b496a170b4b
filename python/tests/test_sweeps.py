"""Sweeps as tidy tables: each task has the same result as alone."""

from __future__ import annotations

import re
import sys
from concurrent.futures import ThreadPoolExecutor
from decimal import Decimal
from pathlib import Path
from typing import Any

import obsdeg
import pytest
from obsdeg import campaign

numpy = pytest.importorskip("numpy")
pandas = pytest.importorskip("pandas")
PAIR = [(0, 0, 0), (180, 0, 0)]


def test_rows_are_those_of_each_task_alone() -> None:
    tasks: list[dict[str, Any]] = [
        dict(angles=[*PAIR, (x, 0, 0)], latitude=latitude, carry="inertial", tags={"x": x, "group": "pairs"})
        for x in numpy.linspace(0, 90, 4)
        for latitude in (0, Decimal("28.2"), "60")
    ]
    rows = campaign.table(tasks)
    assert list(rows) == ["task", "x", "group", "latitude", "carry", "rank", "name", "status", "degree"]
    assert rows["x"].dtype == float and rows["latitude"].dtype == float and rows["degree"].dtype == "Int64"
    assert len(rows) == 12 * 15 and list(rows["task"].unique()) == list(range(12))
    for number, task in enumerate(tasks):
        own = obsdeg.analyze(task["angles"], latitude=task["latitude"], carry="inertial", solutions=False)
        mine = rows[rows["task"] == number]
        assert set(mine["x"]) == {task["tags"]["x"]} and set(mine["latitude"]) == {float(task["latitude"])}
        assert dict(zip(mine["name"], mine["status"], strict=True)) == own.statuses and set(mine["rank"]) == {own.rank}
        assert [None if pandas.isna(d) else d for d in mine["degree"]] == list(own.degrees.values())


def test_models_schemes_and_runs() -> None:
    decay = obsdeg.Model(states={"x": "-a*b*x"}, outputs={"y": "x"})
    better = decay.replace(outputs={"z": "a"})
    rows = campaign.table([dict(model=m, tags={"outputs": len(m.outputs)}) for m in (decay, better)] + [dict(model=decay.text, tags={"outputs": 0})])
    statuses = {n: dict(zip(of["name"], of["status"], strict=True)) for n, of in rows.groupby("outputs")}
    assert statuses == {0: obsdeg.analyze(decay).statuses, 1: obsdeg.analyze(decay).statuses, 2: obsdeg.analyze(better).statuses}
    scheme = obsdeg.Scheme(PAIR, carry="inertial", latitude=28.2)
    runs = campaign.table(dict(scheme=scheme, noise=noise, angle_random_walk=0) for noise in (1e-5, 2e-5))
    for noise, of in runs.groupby("noise"):
        own = obsdeg.simulate(scheme, noise=noise, angle_random_walk=0)  # type: ignore[arg-type]
        for column in ("sigma", "unit", "outcome"):
            assert dict(zip(of["name"], of[column], strict=True)) == {q.name: getattr(q, column) for q in own}


def test_errors_are_rows() -> None:
    tasks: list[dict[str, Any]] = [dict(angles=PAIR, latitude=45), dict(angles=PAIR, latitude=95), dict(angles=[(0, 0)]), dict(angles=PAIR, latitud=3)]
    tasks.append(dict(model="[states]", scheme="", tags={"x": 1}))
    rows = campaign.table(tasks)
    wrong = rows[rows["error"].notna()].set_index("task")["error"]
    assert list(wrong.index) == [1, 2, 3, 4] and rows["error"].isna().sum() == 15
    for number, part in {1: "95 is out of range", 2: "found 2 angles", 3: "no option `latitud`", 4: "a scheme and a model"}.items():
        assert part in wrong[number]
    with pytest.raises(obsdeg.ProblemError, match="95 is out of range") as raised:
        campaign.table(tasks[:2], errors="raise")
    # named by its number, not by the whole chunk
    assert str(raised.value).startswith("task 1: ") and raised.value.task == tasks[1]
    with pytest.raises(ValueError, match="errors: found 'ignore'"):
        campaign.table([], errors="ignore")  # type: ignore[arg-type]


def test_a_folder_is_read_as_the_same_table(tmp_path: Path) -> None:
    tasks: list[dict[str, Any]] = [dict(angles=[*PAIR, (x, 0, 0)], tags={"x": x}) for x in (0, 45)]
    tasks += [dict(angles=PAIR, latitude=latitude, terms=["F", "I"]) for latitude in (10, 20.5)]
    tasks += [dict(model=obsdeg.Model(states={"x": "-k*x"}, outputs={"y": "x"}), tags={"x": 0.5}), dict(angles=PAIR, latitude=95)]
    campaign.sweep(tmp_path, tasks, chunk=2, errors="record", executor=lambda: ThreadPoolExecutor(1))
    rows, own = campaign.read(tmp_path), campaign.table(tasks)
    keys = ["x", "latitude", "terms", "name", "status", "degree", "rank", "error"]
    plain = [frame[keys].astype(object).where(frame[keys].notna(), None) for frame in (rows, own)]
    mine, theirs = (sorted(map(repr, of.itertuples(index=False, name=None))) for of in plain)
    # whole numbers beside others are floats in only one of the two
    assert [re.sub(r"\b(\d+)\.0\b", r"\1", m) for m in mine] == [re.sub(r"\b(\d+)\.0\b", r"\1", t) for t in theirs]
    assert rows["x"].dtype == float and rows["latitude"].dtype == float
    # no task is judged again, including models and tags
    files = {file: file.stat().st_mtime_ns for file in tmp_path.glob("*.parquet")}
    campaign.sweep(tmp_path, tasks, errors="record", executor=lambda: ThreadPoolExecutor(1))
    assert {file: file.stat().st_mtime_ns for file in tmp_path.glob("*.parquet")} == files


def test_rounded_angles_are_listed(tmp_path: Path) -> None:
    tasks = [dict(angles=[*PAIR, (x, 0, 0)], tags={"x": x}) for x in (30, 0.1 + 0.2)]
    for executor in (campaign.threads, campaign.processes):
        rows = campaign.table(tasks, executor=executor)
        assert rows[rows["task"] == 0]["rounded"].isna().all()
        (text,) = rows[rows["task"] == 1]["rounded"].unique()
        assert "0.30000000000000004" in text and text == str(obsdeg.Scheme(tasks[1]["angles"]).rounded[0])  # type: ignore[arg-type]
    campaign.sweep(tmp_path, tasks, executor=campaign.threads)
    assert set(campaign.read(tmp_path)["rounded"].dropna()) == {text}
    assert "rounded" not in campaign.table(tasks[:1])
    # a folder of before has no such column
    import pyarrow.parquet

    for file in tmp_path.glob("*.parquet"):
        pyarrow.parquet.write_table(pyarrow.parquet.read_table(file).drop_columns(["rounded"]), file)
    assert "rounded" not in campaign.read(tmp_path) and len(campaign.read(tmp_path)) == len(rows)


def test_a_table_by_processes() -> None:
    tasks = [dict(angles=[*PAIR, (x, 0, 0)], latitude=lat, tags={"x": x}) for x in (0, 30) for lat in (0, 45)]
    rows = campaign.table(tasks)
    assert campaign.table(tasks, executor=campaign.processes).equals(rows)


def test_a_data_set_of_xarray() -> None:
    xarray = pytest.importorskip("xarray", reason="xarray is not installed")
    tasks: list[dict[str, Any]] = [
        dict(angles=[*PAIR, (x, 0, 0)], latitude=at, tags={"x": x, "side": side}) for side in ("west", "east") for x in (30, 0) for at in (0, 45, 95)
    ]
    rows = campaign.table(tasks)
    data = campaign.to_xarray(rows)
    assert isinstance(data, xarray.Dataset) and dict(data.sizes) == {"x": 2, "side": 2, "latitude": 3, "name": 15}
    assert set(data.data_vars) == {"rank", "status", "degree", "error"}
    assert data["rank"].dims == data["error"].dims == ("x", "side", "latitude")
    # numbers by size, texts and unknowns in the order of the table
    assert data["x"].values.tolist() == [0, 30] and data["side"].values.tolist() == ["west", "east"]
    assert data["name"].values.tolist() == rows["name"].dropna().unique().tolist()
    # a task with an error has missing values and its message
    assert all(data[name].sel(latitude=95).isnull().all() for name in ("rank", "status", "degree"))
    assert data["error"].sel(latitude=[0, 45]).isnull().all()
    assert "95 is out of range" in data["error"].sel(x=0, side="east", latitude=95).item()
    for row in rows[rows["error"].isna()].itertuples():
        cell = data.sel(x=row.x, side=row.side, latitude=row.latitude, name=row.name)
        assert cell["status"].item() == row.status and cell["rank"].item() == row.rank
        assert cell["degree"].item() == row.degree if row.degree is not pandas.NA else numpy.isnan(cell["degree"].item())
    west = rows[(rows["side"] == "west") & (rows["x"] == 0)]
    assert campaign.to_xarray(west)["status"].dims == ("latitude", "name")


def test_a_data_set_needs_dimensions_that_tell_tasks_apart() -> None:
    pytest.importorskip("xarray", reason="xarray is not installed")
    tasks: list[dict[str, Any]] = [dict(angles=PAIR, latitude=at, tags={"x": x}) for x in (1, 2) for at in (0, 45)]
    rows = campaign.table([*tasks, dict(angles=PAIR, latitude=10)])
    messages = {"x": "task 4 without a value of x", "y": "'y'; expected some of x, latitude", "latitude": "tasks 0 and 2 with the same latitude"}
    for dims, message in messages.items():
        with pytest.raises(ValueError, match=f"dims: found {message}"):
            campaign.to_xarray(rows, [dims])
    with pytest.raises(ValueError, match="no tag or option with more than one value"):
        campaign.to_xarray(rows[rows["task"] == 0])


def test_without_xarray_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(ImportError, match="package `xarray`, which is not installed"):
        campaign.to_xarray(pandas.DataFrame())


def test_tags_have_names_of_their_own() -> None:
    for name in ("rank", "task", "error", "latitude"):
        task = dict(angles=[(0, 0, 0)], latitude=28, tags={name: 3})
        with pytest.raises(ValueError, match=f"task number 0: found the tag '{name}'; expected a name of its own"):
            campaign.table([task], errors="raise")
        (row,) = campaign.table([task]).to_dict("records")
        assert row["task"] == 0 and f"found the tag '{name}'" in row["error"]


def test_what_is_no_sweep(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "none"):
        with pytest.raises(FileNotFoundError, match="found no files of a sweep"):
            campaign.read(folder)
    with pytest.raises(TypeError, match="executor: found a int; expected a function that makes an executor"):
        campaign.table([], executor=3)  # type: ignore[arg-type]
    for tasks in (3, {"angles": [(0, 0, 0)]}):
        with pytest.raises(TypeError, match="expected a list or another iterable of mappings"):
            campaign.table(tasks)  # type: ignore[arg-type]
    assert dir(campaign) == sorted(campaign.__all__)


def test_pictures_of_sweeps() -> None:
    pytest.importorskip("matplotlib").use("Agg")
    tasks: list[dict[str, Any]] = [dict(angles=[*PAIR, (x, 0, 0)], latitude=at, tags={"x": x}) for x in (0, 30, 60) for at in (0, 45)]
    rows = campaign.table(tasks)
    one = rows[rows["latitude"] == 45]
    (axes,) = campaign.plot(one)
    names = [text.get_text() for text in axes.get_yticklabels()]
    assert names == one["name"].unique().tolist() and [text.get_text() for text in axes.get_xticklabels()] == ["0", "30", "60"]
    grid = axes.get_images()[0].get_array()
    for i, name in enumerate(names):
        for j, x in enumerate((0, 30, 60)):
            degree = one[(one["name"] == name) & (one["x"] == x)]["degree"].item()
            # after eight degrees: not observable, no such unknown, error
            assert grid[i, j] == (8 if pandas.isna(degree) else degree)
    with pytest.raises(ValueError, match="x: found x, latitude with more than one value; expected the name of one"):
        campaign.plot(rows)
    with pytest.raises(ValueError, match="tasks 0 and 1 with the same x; expected different ones: select rows by latitude"):
        campaign.plot(rows, "x")
    with pytest.raises(ValueError, match="x: found 'y'; expected one of x, latitude"):
        campaign.plot(rows, "y")
    with pytest.raises(ValueError, match="rows: found the columns a; expected a table of campaign"):
        campaign.plot(pandas.DataFrame({"a": [1]}))
    scheme = obsdeg.Scheme(PAIR, carry="inertial", latitude=28.2)
    runs = campaign.table(dict(scheme=scheme, noise=noise) for noise in (1e-5, 2e-5, 4e-5))
    above, below = campaign.plot(runs)
    assert below.get_xlabel() == above.get_xlabel() == "noise"
    assert above.get_xlim() == below.get_xlim() == (-0.5, 2.5)
    drawn = {line.get_label(): list(line.get_ydata()) for line in below.get_lines()}
    assert len(drawn) == runs[runs["degree"].notna()]["name"].nunique()
    own = runs[runs["name"] == "D_FX"]
    assert drawn[f"D_FX [{own['unit'].iloc[0]}]"] == own["sigma"].tolist()
    # texts in the order of the table
    models = [dict(model=obsdeg.Model(states={"x": "-k*x"}, outputs={"y": y}), tags={"seen": y}) for y in ("x", "k*x", "k")]
    (axes,) = campaign.plot(campaign.table(models))
    assert [text.get_text() for text in axes.get_xticklabels()] == ["x", "k*x", "k"]
    # tasks with an error, and unknowns that a task does not have, are not called unobservable
    both = [dict(angles=PAIR, latitude=95, tags={"case": "wrong"}), dict(angles=PAIR, tags={"case": "pair"}), dict(model=models[0]["model"], tags={"case": "model"})]
    (axes,) = campaign.plot(campaign.table(both), "case")
    cells = numpy.asarray(axes.get_images()[0].get_array())
    names = [text.get_text() for text in axes.get_yticklabels()]
    assert (cells[:, 0] == 10).all() and cells[names.index("D_IX"), 2] == cells[names.index("k"), 1] == 9
    assert [text.get_text() for text in axes.get_legend().get_texts()][-2:] == ["no such unknown", "error"]
    assert campaign.plot(campaign.table(both[:1]), "case")[0].get_xlabel() == "case"


def test_dates_and_exact_numbers_are_tags() -> None:
    import datetime
    from fractions import Fraction

    given = [datetime.date(2026, 1, 31), pandas.Timestamp("2026-02-01 12:00"), numpy.datetime64("2026-03-01"), Fraction(1, 4), Decimal("0.5")]
    rows = campaign.table(dict(angles=PAIR, tags={"x": x}) for x in given)
    assert rows.groupby("task")["x"].first().tolist() == ["2026-01-31", "2026-02-01T12:00:00", "2026-03-01", 0.25, 0.5]
    assert "error" not in rows
    # an option of the commands is no tag, also if the task does not have it
    (row,) = campaign.table([dict(angles=PAIR, tags={"latitude": 90})]).to_dict("records")
    assert "found the tag 'latitude'" in row["error"]

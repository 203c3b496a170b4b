"""Campaigns: merged parts equal the whole search with any executor, and with killed workers and drivers."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, ThreadPoolExecutor
from decimal import Decimal
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import obsdeg
import pytest
import sympy
from conftest import at_length
from obsdeg import campaign

PAIR = [(0, 0, 0), (180, 0, 0)]


def without_parts(found: obsdeg.Design) -> dict[str, Any]:
    """The answer without the report on its parts."""
    answer = found.to_dict()
    assert answer["search"].pop("parts")["versions"] == [obsdeg.__version__]
    return answer


SEARCH: dict[str, Any] = {"positions": 3, "carry": "inertial", "observable": ["D_F"]}


def _once_killed(folder: Path, task: int) -> int:
    """Kills its worker at the first call with 5."""
    mark = folder / "killed"
    if task == 5 and not mark.exists():
        mark.write_text(str(os.getpid()))
        os.kill(os.getpid(), signal.SIGKILL)
    return task * task


def _always_wrong(task: int) -> int:
    raise OSError(f"no {task}")


def test_a_killed_worker_costs_what_it_had_in_hand(tmp_path: Path) -> None:
    done = dict(campaign.run(partial(_once_killed, tmp_path), range(20)))
    assert (tmp_path / "killed").exists()
    assert done == {i: i * i for i in range(20)}


def test_the_threads_of_the_engine_are_not_waited_for(tmp_path: Path) -> None:
    # a search in this process first: its threads would not be part of a forked copy
    whole = obsdeg.design(**SEARCH)
    assert without_parts(campaign.design(tmp_path, 2, **SEARCH)) == whole.to_dict()
    assert campaign.processes(1).submit(os.getppid).result() != os.getpid()


def test_what_fails_too_often_is_named() -> None:
    with pytest.raises(campaign.CampaignError, match="7 failed 3 times, last with OSError"):
        list(campaign.run(_always_wrong, [7], executor=lambda: ThreadPoolExecutor(1)))


def test_tasks_are_handed_out_as_they_are_needed() -> None:
    asked = 0

    def tasks() -> Any:
        nonlocal asked
        for i in range(1000):
            asked += 1
            yield i

    results = campaign.run(abs, tasks(), executor=lambda: ThreadPoolExecutor(2), ahead=10)
    next(results)
    assert asked <= 20
    assert sum(1 for _ in results) == 999


def test_parts_are_the_whole(tmp_path: Path) -> None:
    heard: list[tuple[int, int]] = []
    found = campaign.design(tmp_path, 4, heard=lambda *now: heard.append(now), **SEARCH)
    assert without_parts(found) == obsdeg.design(**SEARCH).to_dict()
    repeated = campaign.design(tmp_path, 4, check=1000, **SEARCH).to_dict()["search"]["parts"]
    assert repeated["searched_again"] == repeated["blocks"]
    assert heard == [(1, 4), (2, 4), (3, 4), (4, 4)]
    # finished work is not repeated; another request has other files
    again = campaign.design(tmp_path, 4, heard=lambda *_: pytest.fail("done already"), **SEARCH)
    assert again.json() == found.json()
    with pytest.raises(obsdeg.ProblemError):
        campaign.design(tmp_path, 4, **{**SEARCH, "carry": "sideways"})


DRIVER = """
import sys, obsdeg
from obsdeg import campaign
tasks = campaign.grid(angles=[[(a, 0, 0), (180, b, 0)] for a in range(0, 60, 10) for b in range(0, 60, 10)], latitude=range(0, 90, 20))
if __name__ == "__main__":
    campaign.sweep(sys.argv[1], tasks, chunk=6, heard=lambda n: print(n, flush=True))
"""


def test_a_driver_that_was_killed_goes_on(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    script = tmp_path / "driver.py"
    script.write_text(DRIVER)
    folder = tmp_path / "sweep"
    first = subprocess.Popen([sys.executable, str(script), str(folder)], stdout=subprocess.PIPE, text=True, start_new_session=True)
    assert first.stdout is not None and int(first.stdout.readline()) > 0
    os.killpg(first.pid, signal.SIGKILL)
    first.wait()
    there = {f: f.stat().st_mtime_ns for f in folder.glob("*.parquet")}
    assert 0 < len(there) < 30
    subprocess.run([sys.executable, str(script), str(folder)], check=True, stdout=subprocess.DEVNULL, timeout=300)
    files = set(folder.glob("*.parquet"))
    assert len(files) == 30 and all(f.stat().st_mtime_ns == t for f, t in there.items())
    rows = pandas.read_parquet(sorted(files))
    assert len(rows) == 36 * 5 * 15
    # against single answers of the program
    for angles, latitude in [("[(0, 0, 0), (180, 0, 0)]", "0"), ("[(30, 0, 0), (180, 50, 0)]", "40")]:
        own = obsdeg.analyze(angles=eval(angles), latitude=latitude, solutions=False)  # noqa: S307
        mine = rows[(rows["angles"] == angles) & (rows["latitude"] == latitude)]
        assert dict(zip(mine["name"], mine["status"], strict=True)) == own.statuses
        assert set(mine["rank"]) == {own.rank}


def test_noise_is_an_axis(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    pair = [(0, 0, 0), (180, 0, 0)]
    asked: dict[str, Any] = {"angles": pair, "carry": "inertial"}
    # white noise of Z only
    tasks = [asked, *(asked | {"noise": n, "angle_random_walk": 0} for n in (1e-5, 2e-5))]
    own = {task["noise"]: obsdeg.simulate(**task) for task in tasks[1:]}
    for chunk in (1, 3):
        folder = tmp_path / str(chunk)
        rows = pandas.read_parquet(campaign.sweep(folder, tasks, chunk=chunk, executor=lambda: ThreadPoolExecutor(1)))
        assert len(rows) == 3 * 15 and set(rows["degree"].dropna()) == {0, 1, 2}
        noise_of = rows["task"].map(lambda task: json.loads(task).get("noise"))
        plain = rows[noise_of.isna()]
        assert len(plain) == 15 and plain["sigma"].isna().all() and plain["outcome"].isna().all()
        sigma = {}
        for noise, run in own.items():
            mine = rows[noise_of == noise].set_index("name")
            assert dict(mine["sigma"]) == {q.name: q.sigma for q in run.quantities}
            assert dict(mine["outcome"]) == {q.name: q.outcome for q in run.quantities}
            assert dict(mine["unit"]) == {q.name: q.unit for q in run.quantities}
            sigma[noise] = mine["sigma"]
        # observable sigmas double with the noise; sigmas from the prior only do not change
        ratio = sigma[2e-5] / sigma[1e-5]
        assert ratio["D_FX"] == pytest.approx(2, rel=1e-3) and ratio["D_IX"] == pytest.approx(1)


def _slowly(task: int) -> int:
    time.sleep(0.05)
    return task + 1


def test_dask_with_a_worker_killed(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, distributed.Client(cluster) as client:

        def executor() -> Executor:
            made: Executor = client.get_executor(retries=3)
            return made

        victim = next(iter(client.run(os.getpid).values()))
        results = campaign.run(_slowly, range(60), executor=executor)
        done = dict(next(results) for _ in range(5))
        os.kill(victim, signal.SIGKILL)
        done.update(results)
        assert done == {i: i + 1 for i in range(60)}
        search_with_a_worker_killed(tmp_path, executor, next(iter(client.run(os.getpid).values())))


def search_with_a_worker_killed(folder: Path, executor: Any, victim: int) -> None:
    """Merged parts equal the whole search although a worker is killed when the first part exists."""
    killed: list[int] = []

    def heard(done: int, of: int) -> None:
        if not killed:
            assert done < of
            os.kill(victim, signal.SIGKILL)
            killed.append(victim)

    search: dict[str, Any] = {"positions": 4, "carry": "inertial", "observable": ["D_F"]}
    found = campaign.design(folder, 8, executor=executor, heard=heard, **search)
    assert killed and without_parts(found) == obsdeg.design(**search).to_dict()


@at_length
def test_ray_with_a_worker_killed(tmp_path: Path) -> None:
    ray = pytest.importorskip("ray", reason="Ray is not installed: that its executor works is not tested")
    try:

        def executor() -> Executor:
            # workers find the functions of this file too
            path = os.pathsep.join([str(Path(__file__).parent), *filter(None, [os.environ.get("PYTHONPATH")])])
            where = {"env_vars": {"PYTHONPATH": path}}
            return campaign.RayExecutor(num_cpus=2, include_dashboard=False, log_to_driver=False, runtime_env=where)

        marks = tmp_path / "marks"
        marks.mkdir()
        # the worker kills itself during its task
        assert dict(campaign.run(partial(_once_killed, marks), range(20), executor=executor)) == {i: i * i for i in range(20)}
        assert (marks / "killed").exists()
        search_with_a_worker_killed(tmp_path / "search", executor, executor().submit(os.getpid).result())
    finally:
        ray.shutdown()


def test_the_example_in_parts_is_the_whole(tmp_path: Path) -> None:
    script = Path(__file__).resolve().parents[2] / "examples" / "nine-of-24" / "search.py"
    command = [sys.executable, str(script)]
    done = subprocess.run([*command, str(tmp_path), "--positions", "5"], capture_output=True, text=True, check=True)
    lines, table = done.stdout.split("24 of 24 parts\n")
    assert lines.startswith("1 of 24 parts\n") and len(list(tmp_path.glob("*-of-24.json"))) == 24
    whole = obsdeg.design(5, carry="inertial")
    listed = [line for line in str(whole).splitlines() if line.startswith("  1 ")]
    assert listed and listed[0] in table and "proven if the parts were searched as they state" in " ".join(table.split())
    measured = subprocess.run([*command, "--measure", "--positions", "5"], capture_output=True, text=True, check=True)
    assert "all 24 parts: 3.32e+05 sequences" in measured.stdout


def test_arrays_are_told_apart_by_all_their_digits(tmp_path: Path) -> None:
    numpy, pandas = pytest.importorskip("numpy"), pytest.importorskip("pandas")
    near = [numpy.array([[0, 0, 0], [28.123456789, 0, 0]]), numpy.array([[0, 0, 0], [28.123456788, 0, 0]])]
    long = [numpy.zeros((400, 3)), numpy.zeros((400, 3))]
    long[1][200, 0] = 90
    tasks: list[dict[str, Any]] = [dict(angles=a, terms="F") for a in [*near, *long]]
    rows = pandas.read_parquet(campaign.sweep(tmp_path, tasks, chunk=1, executor=lambda: ThreadPoolExecutor(1)))
    assert rows["task"].nunique() == 4
    # each task can be judged again from its row
    for asked in rows["task"].unique():
        found = rows[rows["task"] == asked]
        assert dict(zip(found["name"], found["status"], strict=True)) == obsdeg.analyze(**json.loads(asked), solutions=False).statuses
    with pytest.raises(TypeError, match="of type set; expected what JSON can hold"):
        campaign.sweep(tmp_path, [dict(angles={1})])


def test_a_sweep_goes_on_with_other_chunks_and_orders(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    tasks = list(campaign.grid(angles=[[(0, 0, 0), (a, 0, 0)] for a in (90, 120, 150)], latitude=[0, 45]))

    def sweep(tasks: list[dict[str, Any]], chunk: int) -> list[int]:
        heard: list[int] = []
        campaign.sweep(tmp_path, tasks, chunk=chunk, executor=lambda: ThreadPoolExecutor(1), heard=heard.append)
        return heard

    assert sweep(tasks[:3], 2) == [2, 3]
    assert sweep([tasks[5], *tasks[:5]], 4)[-1] == 6
    assert sweep(tasks[::-1], 1) == [6]
    rows = pandas.read_parquet(tmp_path)
    assert len(rows) == 6 * 15 and rows["task"].nunique() == 6


def test_the_rest_of_a_chunk_that_takes_too_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A chunk ends at its limit, and its other tasks are handed out again."""
    pandas = pytest.importorskip("pandas")
    from obsdeg import _judged

    counts: list[tuple[int, int]] = []

    def slowly(task: dict[str, Any]) -> list[dict[str, Any]]:
        time.sleep(0.02 if task["latitude"] >= 40 else 0.001)
        return [{"task": _judged.name_of(task), **dict.fromkeys(_judged.FOUND), "rank": 1, "name": "x"}]

    def judge(*args: Any, **options: Any) -> Any:
        judged = _judged.judge(*args, **options)
        counts.append((len(args[0][0]), judged.count))
        return judged

    monkeypatch.setattr(campaign, "FILE_SECONDS", 0.03)
    monkeypatch.setattr(_judged, "_rows", slowly)
    monkeypatch.setattr(campaign, "judge", judge)
    tasks = ({"angles": PAIR, "latitude": i} for i in range(80))
    heard: list[int] = []
    campaign.sweep(tmp_path, tasks, executor=lambda: ThreadPoolExecutor(1), heard=heard.append)
    assert any(count < given for given, count in counts) and sum(count for _, count in counts) == 80
    # no task begins after twice the time
    assert all(count <= 4 for given, count in counts[-8:]) and heard[-1] == 80
    rows = pandas.read_parquet(tmp_path)
    assert len(rows) == 80 and rows["task"].nunique() == 80


def test_options_of_some_tasks_and_schemes(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    pair = [(0, 0, 0), (180, 0, 0)]
    scheme = obsdeg.Scheme(pair, carry="inertial", latitude=28.2)
    tasks: list[dict[str, Any]] = [dict(angles=pair), dict(angles=pair, latitude=45, noise=2e-5), dict(scheme=scheme), dict(scheme=scheme.text, noise=1e-5)]
    rows = pandas.read_parquet(campaign.sweep(tmp_path, tasks, executor=lambda: ThreadPoolExecutor(1)))
    assert rows["latitude"].isna().sum() == 45 and set(rows["latitude"].dropna()) == {"45"}
    assert set(rows["noise"].dropna()) == {"2e-05", "1e-05"} and rows["sigma"].notna().sum() == 30
    own = obsdeg.analyze(scheme, solutions=False).statuses
    asked = rows["task"].map(json.loads)
    mine = rows[asked.map(lambda task: "scheme" in task and "noise" not in task)]
    assert dict(zip(mine["name"], mine["status"], strict=True)) == own


def test_a_malformed_task_is_named_and_loses_nothing(tmp_path: Path) -> None:
    """A task that a folder cannot store is named by its number or gets a row; the others are finished, and
    the folder is readable."""
    good = [dict(angles=PAIR, latitude=x) for x in (1, 2)]
    circular: list[Any] = []
    circular.append(circular)
    deep: list[Any] = []
    for _ in range(5000):
        deep = [deep]
    bad: list[Any] = [
        dict(angles=PAIR, task=1), dict(angles=PAIR, rank=1), dict(angles=PAIR, tags={"t": {1, 2}}), dict(angles=PAIR, tags={"t": circular}),
        dict(angles=PAIR, tags=5), dict(angles=PAIR, tags=["a"]), dict(angles=PAIR, tags="north"), dict(angles=PAIR, tags={"t": "\ud800"}),
        dict(angles=PAIR, latitude="\ud800"), None, 7, "text", {1: 2, "angles": PAIR}, dict(angles=PAIR, tags={"t": deep}),
    ]
    for i, task in enumerate(bad):
        folder = tmp_path / str(i)
        for _ in range(2):
            campaign.sweep(folder, [good[0], task, good[1]], executor=campaign.threads, errors="record")
        campaign.sweep(folder, good, executor=campaign.threads)
        rows = campaign.read(folder)
        assert len(rows) == 31 and rows.error.notna().sum() == 1, (task if i < 13 else "deep", rows)
        assert "task number 1" in rows.error.dropna().iloc[0]
        with pytest.raises((TypeError, ValueError), match="task number 1"):
            campaign.sweep(tmp_path / f"raise-{i}", [good[0], task, good[1]], executor=campaign.threads)
        rows = campaign.table([good[0], task, good[1]])
        assert len(rows) == 31 and rows.error.notna().sum() == 1


def test_decimals_are_numbers(tmp_path: Path) -> None:
    """A decimal keeps its value for every option; a text that an option refuses stays a different task."""
    forms: list[Any] = [1000, 1000.0, Decimal("1000"), Decimal("1E3")]
    campaign.sweep(tmp_path, [dict(angles=PAIR, latitude=28, dwell=d) for d in forms], executor=campaign.threads)
    assert len(campaign.read(tmp_path)) == 15
    refused: dict[str, Any] = dict(angles=PAIR, latitude=28, noise="0.00001")
    campaign.sweep(tmp_path, [refused], executor=campaign.threads, errors="record")
    campaign.sweep(tmp_path, [{**refused, "noise": Decimal("0.00001")}], executor=campaign.threads)
    assert len(campaign.read(tmp_path)) == 31


def test_fractions_are_numbers() -> None:
    """Fractions and rationals of SymPy are accepted, alone and in lists, as by `analyze`."""
    latitudes: list[Any] = [Fraction(1, 2), Fraction(100, 3), sympy.Rational(100, 3)]
    rows = campaign.table([dict(angles=PAIR, latitude=x) for x in latitudes], executor=campaign.threads)
    assert len(rows) == 45
    assert all(abs(rows.latitude[15 * i] - float(x)) < 1e-9 for i, x in enumerate(latitudes))
    turned = campaign.table([dict(angles=[(0, 0, Fraction(90)), (180, 0, 0)])], executor=campaign.threads)
    assert len(turned) == 15

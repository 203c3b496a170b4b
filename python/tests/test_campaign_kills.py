"""No task is lost or repeated with executors that break at random, and with killed workers, pools and
drivers.

`CAMPAIGN_RUNS` is the number of sweeps with kills, by default 2; `.ci/run release` makes 200.
"""

from __future__ import annotations

import errno
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path
from typing import Any

import obsdeg
import pytest
from obsdeg import _work, campaign


def without_parts(found: obsdeg.Design) -> dict[str, Any]:
    """The answer without the report on its parts."""
    answer = found.to_dict()
    assert answer["search"].pop("parts")["versions"] == [obsdeg.__version__]
    return answer


RUNS = int(os.environ.get("CAMPAIGN_RUNS", "2"))
PAIR = [(0, 0, 0), (180, 0, 0)]


class Frail(Executor):
    """Executor in a thread that runs its calls in random order until `breaks` is true for one of them."""

    def __init__(self, draws: random.Random, breaks: Callable[[Any], bool], refuses: float = 0.0) -> None:
        self.draws, self.breaks, self.refuses = draws, breaks, refuses
        self.broken = False
        self.queue: list[tuple[Future[Any], Callable[[], Any], Any]] = []
        self.lock = threading.Lock()
        self.news = threading.Semaphore(0)
        threading.Thread(target=self._work, daemon=True).start()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        with self.lock:
            if self.broken or self.draws.random() < self.refuses:
                self.broken = True
                raise self.draws.choice([BrokenProcessPool("broken"), RuntimeError("after shutdown")])
            future: Future[Any] = Future()
            self.queue.append((future, lambda: fn(*args, **kwargs), args[0]))
        self.news.release()
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        self.broken = True
        self.news.release()

    def _work(self) -> None:
        while True:
            self.news.acquire()
            with self.lock:
                i = self.draws.randrange(max(1, len(self.queue)))
                if self.queue and (self.broken or self.breaks(self.queue[i][2])):
                    self.broken = True
                    for future, _, _ in self.queue:
                        future.set_exception(BrokenProcessPool("a worker ended"))
                    self.queue.clear()
                if self.broken:
                    return
                if not self.queue:
                    continue
                future, call, _ = self.queue.pop(i)
            try:
                future.set_result(call())
            except Exception as e:
                future.set_exception(e)


def _square(draws: random.Random, faults: float, task: int) -> int:
    if draws.random() < faults:
        raise OSError("no memory")
    return task * task


@pytest.mark.parametrize("seed", range(max(25, RUNS)))
def test_every_task_is_done_pending_or_named(seed: int) -> None:
    draws = random.Random(seed)
    chance, faults, refuses = (draws.choice([0, most / 6, most]) for most in (0.3, 0.3, 0.01))
    count, retries, ahead = draws.randrange(120), draws.randrange(4), draws.choice([None, 1, 5, 64])
    tasks = iter(range(count))
    done: dict[int, int] = {}
    try:
        results = campaign.run(
            partial(_square, draws, faults),
            tasks,
            executor=lambda: Frail(draws, lambda _: draws.random() < chance, refuses),
            retries=retries,
            ahead=ahead,
        )
        for task, result in results:
            assert task not in done, "done twice"
            done[task] = result
    except campaign.CampaignError as e:
        named = [e.task] if e.task is not None else []
        assert "failed" in str(e) or "tasks that were handed out are not done" in str(e)
        assert Counter([*done, *named, *e.pending, *tasks]) == Counter(range(count))
    else:
        assert done == {i: i * i for i in range(count)}
        assert count == len(done)


def test_a_task_that_kills_its_worker_is_found(tmp_path: Path) -> None:
    done = {}
    two = partial(campaign.processes, 2)
    with pytest.raises(campaign.CampaignError, match="^13 failed 2 times, last with Broken") as caught:
        for task, result in campaign.run(_kills_at_13, range(30), executor=two, retries=1):
            done[task] = result
    assert caught.value.task == 13 and caught.value.pending == []
    assert sorted(done) == [i for i in range(30) if i != 13]


def _kills_at_13(task: int) -> int:
    if task == 13:
        os.kill(os.getpid(), signal.SIGKILL)
    return task


def _rows(folder: Path) -> Any:
    return pytest.importorskip("pandas").read_parquet(folder)


def test_a_chunk_that_breaks_every_pool_is_divided(tmp_path: Path) -> None:
    draws = random.Random(1)
    tasks = [dict(angles=PAIR, latitude=i, terms="F") for i in range(40)]

    def frail() -> Frail:
        return Frail(draws, lambda order: any(task["latitude"] == 17 for task in order[0]))

    message = '"latitude": 17.* failed 3 times, last with BrokenProcessPool'
    with pytest.raises(campaign.CampaignError, match=message):
        campaign.sweep(tmp_path, tasks, chunk=15, executor=frail)
    rows = _rows(tmp_path)
    assert set(rows["latitude"]) == {str(i) for i in range(40) if i != 17} and len(rows) == 39 * 6
    campaign.sweep(tmp_path, tasks, chunk=15, executor=frail, errors="record")
    rows = _rows(tmp_path)
    assert len(rows) == 39 * 6 + 1
    assert list(rows[rows["latitude"] == "17"]["error"]) == ["BrokenProcessPool: a worker ended"]


def test_a_bad_task_is_named_or_recorded(tmp_path: Path) -> None:
    tasks: list[dict[str, Any]] = [dict(angles=PAIR, latitude=i / 4, terms="F") for i in range(300)]
    tasks.insert(150, dict(angles=PAIR, latitude=95, terms="F"))

    def thread() -> ThreadPoolExecutor:
        return ThreadPoolExecutor(1)

    message = r'^task \{.*"latitude": 95.*\}: latitude: latitude 95 is out'
    with pytest.raises(obsdeg.ProblemError, match=message) as caught:
        campaign.sweep(tmp_path, tasks, chunk=50, executor=thread)
    assert vars(caught.value)["task"] == tasks[150]
    # the rest of its chunk is kept
    before = _rows(tmp_path)
    assert before["task"].nunique() >= 199 and before["error"].isna().all()
    tasks.append(dict(angles=[(0, 0)], terms="F"))
    tasks.append(dict(angles={1}, terms="F"))
    told: list[int] = []
    for _ in range(2):
        campaign.sweep(tmp_path, tasks, chunk=50, executor=thread, errors="record", heard=told.append)
        rows = _rows(tmp_path)
        assert len(rows) == 300 * 6 + 3 and told[-1] == 303
        wrong = rows[rows["error"].notna()]
        assert set(wrong["latitude"].dropna()) == {"95"} and wrong["name"].isna().all()
        said = sorted(text[:20] for text in wrong["error"])
        assert said == ["found {1} of type se", "latitude: latitude 9", "position 1: found 2 "]
    with pytest.raises(ValueError, match="errors: found 'ignore'; expected 'raise' or 'record'"):
        campaign.sweep(tmp_path, [], errors="ignore")  # type: ignore[arg-type]


def test_a_task_is_its_values(tmp_path: Path) -> None:
    numpy = pytest.importorskip("numpy")
    for zero in (0, numpy.float64(0), "0", 0.0, -0.0, "0.00", numpy.int32(0)):
        pairs = [[(zero, 0, 0), (180, a, 0)] for a in range(5)]
        tasks = [dict(angles=pair, latitude=10, carry=None, terms=("F",)) for pair in pairs]
        campaign.sweep(tmp_path, [*tasks, *tasks], executor=lambda: ThreadPoolExecutor(1))
        assert len(_rows(tmp_path)) == 5 * 6
    campaign.sweep(tmp_path, [dict(angles=[("0.000000001", 0, 0), (180, 0, 0)], latitude=10, terms="F")])
    assert len(_rows(tmp_path)) == 6 * 6


def test_a_drift_noise_is_its_value_with_its_unit() -> None:
    from obsdeg._asked import key

    one = {key(dict(angles=PAIR, drift_noise=text)) for text in ("0.01 deg/h", "0.010deg/h", "1e-2 deg/h", " 0.01  deg/h ")}
    assert len(one) == 1
    none = {key(dict(angles=PAIR, drift_noise=text)) for text in (0, "0", "0.0", "0 deg/h")}
    assert len(none) == 1
    others = {key(dict(angles=PAIR, drift_noise=text)) for text in ("0.01 deg/sqrt(h)", "0.02 deg/h", "0.01 deg", "0.01", "1 deg/h")}
    assert len(others | one | none) == 5 + 1 + 1


def test_a_part_that_cannot_be_written_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, text: bytes) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))

    options = dict(positions=3, carry="inertial", executor=lambda: ThreadPoolExecutor(1))
    monkeypatch.setattr(campaign, "place", full)
    with pytest.raises(OSError, match="part 1 of 2 cannot be written: No space left on device") as said:
        campaign.design(tmp_path, 2, **options)
    assert said.value.errno == errno.ENOSPC and "-1-of-2.json" in str(said.value.filename)


def test_one_sweep_at_a_time(tmp_path: Path) -> None:
    def tasks() -> Iterator[dict[str, Any]]:
        with pytest.raises(RuntimeError, match="found another sweep at work in it; expected one at a time"):
            campaign.sweep(tmp_path, [])
        yield dict(angles=PAIR)

    campaign.sweep(tmp_path, tasks(), executor=lambda: ThreadPoolExecutor(1))
    assert len(_rows(tmp_path)) == 15


def test_workers_that_do_not_see_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # workers write elsewhere, as on a machine with another disk under the same name
    from obsdeg import _judged

    elsewhere = tmp_path / "elsewhere"
    monkeypatch.setattr(_judged, "place", lambda path, text: _judged_place(elsewhere / path.name, text))
    tasks = [dict(angles=PAIR, latitude=i) for i in range(9)]
    folder = campaign.sweep(tmp_path / "here", tasks, executor=lambda: ThreadPoolExecutor(2))
    assert len(list(elsewhere.iterdir())) > 0 and len(_rows(folder)) == 9 * 15
    assert sorted(p.suffix for p in folder.iterdir()) == [".parquet"] * len(list(folder.iterdir()))


def _judged_place(path: Path, text: bytes) -> None:
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(text)


def test_files_grow_with_the_measured_time() -> None:
    chunks = campaign._Chunks(None, 0)
    sizes = []
    for _ in range(12):
        sizes.append(chunks.next(1))
        chunks.took(0.01 * chunks.next(1), chunks.next(1), 1)
    assert sizes[:3] == [1, 4, 16] and sizes[-1] == 1000
    chunks.took(4000.0, 1000, 1)
    assert chunks.next(1) < 10


def test_handed_out_by_the_number_of_workers() -> None:
    for workers, expected in ((1, 8), (100, 200)):
        most, out = 0, 0
        lock = threading.Lock()

        class Counting(ThreadPoolExecutor):
            def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Any:
                nonlocal most, out
                with lock:
                    out += 1
                    most = max(most, out)
                future = super().submit(fn, *args, **kwargs)
                return future

        done = 0
        for _ in campaign.run(_sleeps, range(300), executor=partial(Counting, workers)):
            done += 1
            with lock:
                out -= 1
        assert done == 300 and most == expected


def _sleeps(task: int) -> int:
    time.sleep(0.001)
    return task


def test_a_part_goes_on_from_its_checkpoint(tmp_path: Path) -> None:
    options: dict[str, Any] = {"positions": 5, "carry": "inertial", "observable": "D_F"}
    whole = obsdeg.design(**options)
    incomplete = 0

    class Watched(ThreadPoolExecutor):
        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Any:
            nonlocal incomplete
            incomplete += args[0][3] is not None
            return super().submit(fn, *args, **kwargs)

    found = campaign.design(tmp_path, 2, executor=lambda: Watched(1), checkpoint=0.05, **options)
    assert without_parts(found) == whole.to_dict() and incomplete > 1
    assert len(list(tmp_path.iterdir())) == 2
    # a killed driver left one unfinished part
    task = (options, 2, 2, None, 0.05)
    text, complete = campaign._search(task)
    assert not complete
    next(tmp_path.glob("*-2-of-2.json")).write_text(text, encoding="utf-8")
    found = campaign.design(tmp_path, 2, executor=lambda: ThreadPoolExecutor(1), **options)
    assert without_parts(found) == whole.to_dict()


def _scheduler(folder: Path) -> tuple[Any, list[subprocess.Popen[bytes]]]:
    """Client of Dask whose scheduler and worker run in separate processes."""
    distributed = pytest.importorskip("distributed")
    file = str(folder / "scheduler.json")
    python = [sys.executable, "-m"]
    path = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    common = ["--scheduler-file", file, "--no-dashboard"]
    commands = [
        [*python, "distributed.cli.dask_scheduler", "--port", "0", *common],
        [*python, "distributed.cli.dask_worker", "--nthreads", "1", *common],
    ]
    environment = {**os.environ, "PYTHONPATH": path}
    started = [subprocess.Popen(c, stderr=subprocess.DEVNULL, env=environment) for c in commands]
    client = distributed.Client(scheduler_file=file, timeout=30)
    client.wait_for_workers(1, timeout=60)
    return client, started


class Silent(Executor):
    """Stands in for Dask's executor with a silent scheduler: no call ever ends."""

    class Client:
        status = "running"
        scheduler = type("Scheduler", (), {"identity": None})
        nthreads = None

        def sync(self, ask: Any, **options: Any) -> Any:
            raise TimeoutError

    def __init__(self) -> None:
        self._client = self.Client()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        return Future()

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        raise RuntimeError("no scheduler")


def test_a_cluster_that_does_not_answer_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_work, "PATIENCE", 0.3)
    monkeypatch.setattr(_work, "PULSE", 0.1)
    message = "scheduler of Dask does not answer .TimeoutError.: 8 tasks that were handed out are not done"
    with pytest.raises(campaign.CampaignError, match=message) as caught:
        list(campaign.run(abs, range(20), executor=Silent))
    assert caught.value.task is None and caught.value.pending == list(range(8))


@pytest.mark.skipif(RUNS <= 2, reason="takes a minute: at release length")
@pytest.mark.parametrize("how", [signal.SIGSTOP, signal.SIGKILL])
def test_a_lost_scheduler_is_noticed(tmp_path: Path, how: signal.Signals) -> None:
    client, started = _scheduler(tmp_path)
    tasks = [dict(angles=PAIR, latitude=i / 10, terms="F") for i in range(300)]
    lost: list[float] = []

    def heard(done: int) -> None:
        if done >= 20 and not lost:
            lost.append(time.monotonic())
            started[0].send_signal(how)

    try:
        message = r"Dask .*: \d+ tasks that were handed out are not done"
        with pytest.raises(campaign.CampaignError, match=message) as caught:
            campaign.sweep(tmp_path / "sweep", tasks, chunk=1, executor=client.get_executor, heard=heard)
        assert time.monotonic() - lost[0] < 60 and len(caught.value.pending) >= 1
    finally:
        for process in started:
            process.kill()
            process.wait()
    there = _rows(tmp_path / "sweep")["task"].nunique()
    assert 20 <= there < 300
    campaign.sweep(tmp_path / "sweep", tasks, executor=lambda: ThreadPoolExecutor(1))
    rows = _rows(tmp_path / "sweep")
    assert len(rows) == 300 * 6 and rows["task"].nunique() == 300


DRIVER = """
import sys
from functools import partial
from obsdeg import campaign
pairs = [[(a, 0, 0), (180, b, 0)] for a in range(0, 100, 5) for b in range(0, 40, 5)]
tasks = campaign.grid(angles=pairs, terms=["F"])
if __name__ == "__main__":
    fixed = int(sys.argv[2]) or None
    two = partial(campaign.processes, 2)
    campaign.sweep(sys.argv[1], tasks, chunk=fixed, executor=two, heard=lambda n: print(n, flush=True))
"""


def _workers(driver: int) -> list[int]:
    """Processes of a driver's pool, and the server from which they fork."""
    children: dict[int, list[int]] = {}
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and b"forkserver" in (entry / "cmdline").read_bytes():
                parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
                children.setdefault(parent, []).append(int(entry.name))
        except OSError:
            continue
    found, queue = [], [driver]
    while queue:
        below = children.get(queue.pop(), [])
        found += below
        queue += below
    return found


def _kill(process: int) -> None:
    try:
        os.kill(process, signal.SIGKILL)
    except ProcessLookupError:
        pass


def _lives(process: int) -> bool:
    try:
        return (Path("/proc") / str(process) / "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="no /proc, in which processes are found")
@pytest.mark.parametrize("seed", range(RUNS))
def test_kills_lose_nothing_and_repeat_nothing(tmp_path: Path, seed: int) -> None:
    draws = random.Random(seed)
    script = tmp_path / "driver.py"
    script.write_text(DRIVER)
    folder = tmp_path / "sweep"
    kills, what = draws.randrange(1, 5), []
    for _ in range(20):
        chunk = draws.choice(["0", "1", "7", "30"])
        command, pipe = [sys.executable, str(script), str(folder), chunk], subprocess.PIPE
        driver = subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True)
        assert driver.stdout is not None and driver.stderr is not None
        driver.stdout.readline()
        while kills > 0 and driver.poll() is None:
            time.sleep(draws.uniform(0, 0.3))
            kills -= 1
            workers = _workers(driver.pid)
            what.append(draws.choice(["worker", "pool", "driver"]))
            if what[-1] == "driver":
                _kill(driver.pid)
                driver.wait()
                end = time.monotonic() + 10
                while any(map(_lives, workers)) and time.monotonic() < end:
                    time.sleep(0.02)
                assert not any(map(_lives, workers)), "workers of a driver that was killed go on"
            else:
                for worker in workers if what[-1] == "pool" else draws.sample(workers, min(1, len(workers))):
                    _kill(worker)
        output, said = driver.communicate(timeout=120)
        if driver.returncode == 0:
            break
        assert driver.returncode == -signal.SIGKILL, (what, said)
    else:
        pytest.fail("does not end")
    rows = _rows(folder)
    counted = Counter(rows["task"])
    assert len(counted) == 160 and set(counted.values()) == {6}, what
    assert rows["error"].isna().all()
    assert [p.name for p in folder.iterdir() if p.suffix != ".parquet"] == []


UNGUARDED = """
import sys
from obsdeg import campaign
{start}
if sys.argv[1] == "design":
    campaign.design(sys.argv[2], 3, positions=3, carry="inertial", observable=["D_F"])
elif sys.argv[1] == "sweep":
    campaign.sweep(sys.argv[2], campaign.grid(angles=[[(0, 0, 0), (180, 0, 0)]], latitude=range(40)))
else:
    list(campaign.run(abs, range(5)))
"""
#: Workers started as on systems without a fork server.
SPAWNED = """
import multiprocessing
multiprocessing.get_all_start_methods = lambda: ["spawn"]
"""


@pytest.mark.parametrize("start", ["", SPAWNED], ids=["default", "spawn"])
@pytest.mark.parametrize("command", ["design", "sweep", "run"])
def test_a_script_without_a_guard_ends_with_one_error(tmp_path: Path, command: str, start: str) -> None:
    script = tmp_path / "script.py"
    script.write_text(UNGUARDED.format(start=start))
    asked = [sys.executable, str(script), command, str(tmp_path / "out")]
    ended = subprocess.run(asked, capture_output=True, text=True, timeout=120)
    assert ended.returncode == 1
    assert ended.stderr.count("Traceback") == 1, ended.stderr
    assert 'below a line `if __name__ == "__main__":`' in ended.stderr
    assert not list(tmp_path.glob("out/*")) and not list(tmp_path.glob("out/.*"))

"""The package against the program: equal bytes, Python answers, errors, interrupts."""

from __future__ import annotations

import copy
import json
import os
import pickle
import random
import subprocess
import sys
import threading
import time
from decimal import Decimal
from pathlib import Path
from typing import Any

import obsdeg
import pytest
from conftest import ROOT, _program


PAPER = [(0, 0, 0), (180, 0, 0)]
JUDGED = sorted(str(p.relative_to(ROOT)) for p in (ROOT / "examples").glob("*/*.toml"))


def printed(*arguments: str) -> str:
    done = subprocess.run([_program(), *arguments, "--format", "json"], cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert done.stdout, done.stderr
    return done.stdout


@pytest.fixture(autouse=True)
def in_root(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


@pytest.mark.parametrize("file", JUDGED)
def test_every_example_is_judged_the_same(file: str) -> None:
    done = subprocess.run([_program(), "analyze", file, "--solutions", "off", "--format", "json"], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        assert obsdeg.analyze(file, solutions=False).json() == done.stdout
    else:
        with pytest.raises(obsdeg.ProblemError) as wrong:
            obsdeg.analyze(file, solutions=False)
        assert wrong.value.message.splitlines()[0].split(": ")[-1] in done.stderr


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [
        (lambda: obsdeg.simulate(angles=PAPER, latitude=28.2, requirement={"D": 0.05}, step=20), ["simulate", "--latitude", "28.2", "--requirement", "D=0.05", "--step", "20"]),
        (lambda: obsdeg.crosscheck(angles=PAPER, runs=20, filter_carry="inertial"), ["crosscheck", "--runs", "20", "--filter-carry", "inertial"]),
        (lambda: obsdeg.analyze(angles=PAPER, terms=["F", "I"], combination="D_IX - D_IY", solutions=False), ["analyze", "--terms", "F,I", "--combination", "D_IX - D_IY", "--solutions", "off"]),
        (lambda: obsdeg.simulate(angles=PAPER, rate_random_walk=(0.001, 0.002, 0.003), prior={"D_F": 30}), ["simulate", "--rate-random-walk", "0.001,0.002,0.003", "--prior", "D_F=30"]),
    ],
)
def test_options_are_those_of_the_command_line(ours: Any, theirs: list[str]) -> None:
    assert ours().json() == printed(theirs[0], "--angles", "0,0,0", "--angles", "180,0,0", *theirs[1:])


def test_commands_without_angles() -> None:
    five, six = "examples/five-positions/scheme.toml", "examples/six-positions/scheme.toml"
    assert obsdeg.compare(five, six, dwell=500).json() == printed("compare", five, six, "--dwell", "500")
    assert obsdeg.paper(seed=7).json() == printed("paper", "--seed", "7")
    found = obsdeg.design(5, carry="inertial", restarts=5)
    assert found.json() == printed("design", "--positions", "5", "--carry", "inertial", "--restarts", "5")
    model, data = "examples/influenza/model.toml", "examples/influenza/data.csv"
    assert obsdeg.calibrate(model, data).json() == printed("calibrate", model, data)


def test_random_schemes_have_the_verdicts_of_the_program(tmp_path: Path) -> None:
    draw = random.Random(7)
    files = []
    for i in range(int(os.environ.get("SCHEMES", "50"))):
        angles = [[draw.choice([0, 90, 180, -90, 45, 30, draw.randint(-180, 180)]) for _ in range(3)] for _ in range(draw.randint(1, 5))]
        scheme = obsdeg.Scheme(angles, carry=draw.choice(["platform", "inertial", "reset"]), latitude=draw.choice([None, 0, 90, "28.2"]))
        files.append(tmp_path / f"{i:03}.toml")
        scheme.write(files[-1])
    theirs = json.loads(printed("analyze", *map(str, files), "--solutions", "off"))
    for file, one in zip(files, theirs, strict=True):
        ours = obsdeg.analyze(file, solutions=False)
        assert ours.to_dict() == one["answer"]
        assert ours.degrees == {q["name"]: q.get("degree") for q in one["answer"]["quantities"]}


def test_parts_are_the_whole() -> None:
    whole = obsdeg.design(3, carry="inertial", observable=["D_F"])
    parts = [obsdeg.design(3, carry="inertial", observable=["D_F"], part=(i, 3)) for i in (1, 2, 3)]
    assert all(p.passed for p in parts)
    merged = obsdeg.design(3, carry="inertial", observable=["D_F"], merge=reversed(parts), check=1).to_dict()
    assert merged["search"].pop("parts")["searched_again"] == 1
    assert merged == whole.to_dict()
    forged = parts[1].to_dict()
    forged["levels"][0]["best"]["found"][0]["worth"]["value"] = 0.001
    with pytest.raises(obsdeg.ProblemError, match="part 2: it was changed after it was written"):
        obsdeg.design(3, carry="inertial", observable=["D_F"], merge=[parts[0], json.dumps(forged), parts[2]])
    with pytest.raises(obsdeg.ProblemError, match="part"):
        obsdeg.design(3, carry="inertial", observable=["D_F"], merge=parts[:2])


@pytest.mark.parametrize("latitude", ["28.2", 28.2, Decimal("28.2"), Decimal("28.20")])
def test_decimals_are_exact(latitude: Any) -> None:
    assert obsdeg.analyze(angles=PAPER, latitude=latitude, solutions=False).json() == printed(
        "analyze", "--angles", "0,0,0", "--angles", "180,0,0", "--latitude", "28.2", "--solutions", "off"
    )


def test_requests_are_json() -> None:
    from obsdeg._texts import as_json

    for value in [{"a": [1, True, "\u00e9\n\"\\\U0001f600", {}, [], 1.5, None]}, "\x00", -7, {"b": {"c": False}}]:
        assert json.loads(as_json(value)) == json.loads(json.dumps(value)) == value


def test_numpy_numbers() -> None:
    numpy = pytest.importorskip("numpy")
    ours = obsdeg.analyze(angles=numpy.array([[0, 0, 0], [180, 0, 0]]), solutions=False)
    assert ours == obsdeg.analyze(angles=PAPER, solutions=False)
    assert obsdeg.analyze(angles=[(numpy.float64(0.1), 0, 0)], solutions=False) == obsdeg.analyze(angles=["0.1,0,0"], solutions=False)
    with pytest.raises(TypeError, match="float32.*exact"):
        obsdeg.analyze(angles=[(numpy.float32(0.1), 0, 0)])


def test_answers_are_pickled_and_copied() -> None:
    answer = obsdeg.analyze(angles=PAPER, carry="inertial")
    for again in (pickle.loads(pickle.dumps(answer)), copy.deepcopy(answer), copy.copy(answer)):
        assert again == answer
        assert again.degrees == answer.degrees
        # the engine is asked again for parts that the JSON does not contain
        assert again._repr_html_() == answer._repr_html_()
        assert again.files() == answer.files()
    scheme = obsdeg.Scheme(PAPER, latitude=28.2)
    assert pickle.loads(pickle.dumps(scheme)) == scheme


def test_answers_as_tables_and_pages() -> None:
    pandas = pytest.importorskip("pandas")
    answer = obsdeg.analyze(angles=PAPER, carry="inertial")
    frame = answer.to_frame()
    assert list(frame["name"]) == [q.name for q in answer.quantities]
    assert frame["degree"].dtype.kind == "f"
    assert isinstance(answer.to_frame("combinations"), pandas.DataFrame)
    with pytest.raises(obsdeg.ProblemError, match="combinations"):
        answer.to_frame("nothing")
    page = answer._repr_mimebundle_()["text/html"]
    assert "<table>" in page and "<script" not in page
    assert set(answer.files()) == {"positions.svg"}
    assert answer.text("markdown").startswith("# Observable degrees")
    with pytest.raises(AttributeError, match="rank"):
        answer.ranks  # noqa: B018


def test_problems_have_their_place() -> None:
    with pytest.raises(obsdeg.ProblemError) as wrong:
        obsdeg.analyze(obsdeg.Scheme.from_text('\n\ncarry = "sideways"\n', name="mine.toml"))
    assert (wrong.value.file, wrong.value.line) == ("mine.toml", 3)
    assert "platform, inertial or reset" in wrong.value.message
    with pytest.raises(ValueError, match="no option `angels`"):
        obsdeg.analyze(angels=PAPER)
    with pytest.raises(ValueError, match="found 2 angles"):
        obsdeg.analyze(angles=[(0, 0)])
    with pytest.raises(FileNotFoundError):
        obsdeg.analyze("nowhere.toml")
    with pytest.raises(obsdeg.ProblemError, match="nowhere.csv"):
        obsdeg.calibrate("examples/influenza/model.toml", "nowhere.csv")
    # option names have Python's form
    with pytest.raises(obsdeg.ProblemError, match="within 200"):
        obsdeg.design(5, within=200)


def test_progress_ends_a_search_with_the_best_so_far() -> None:
    heard: list[Any] = []

    def enough(*now: Any) -> bool:
        heard.append(now)
        return len(heard) < 3

    began = time.monotonic()
    found = obsdeg.design(9, carry="inertial", restarts=100_000, progress=enough)
    assert len(heard) >= 3 and heard[0][0] == "searching"
    assert found.winner().text.count("[[position]]") == 9
    # a hundred thousand restarts would take minutes
    assert time.monotonic() - began < 60
    with pytest.raises(ZeroDivisionError):
        obsdeg.design(9, carry="inertial", restarts=100_000, progress=lambda *_: 1 // 0)


def test_a_keyboard_interrupt_ends_a_search() -> None:
    code = "import obsdeg; print('begun', flush=True); d = obsdeg.design(9, carry='inertial', restarts=100_000); print(len(d.found) > 0)"
    import os
    import signal

    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "begun\n"
    time.sleep(1.5)
    os.kill(process.pid, signal.SIGINT)
    said, _ = process.communicate(timeout=60)
    assert said == "True\n"


def test_other_threads_go_on() -> None:
    ticks = 0
    done = threading.Event()

    def tick() -> None:
        nonlocal ticks
        while not done.is_set():
            ticks += 1
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    began = time.monotonic()
    obsdeg.design(6, carry="inertial", restarts=2)
    took = time.monotonic() - began
    done.set()
    thread.join()
    # with the lock of the interpreter held there would be none
    assert ticks > 20 * min(took, 1), (ticks, took)


def test_a_record_as_a_frame() -> None:
    pandas = pytest.importorskip("pandas")
    model, data = "examples/influenza/model.toml", "examples/influenza/data.csv"
    frame = pandas.read_csv(data, comment="#")
    of_frame, of_file = obsdeg.calibrate(model, frame), obsdeg.calibrate(model, data)
    assert of_frame.passed == of_file.passed
    assert of_frame.to_frame().equals(of_file.to_frame())


def test_models_of_other_tools(tmp_path: Path) -> None:
    file = tmp_path / "decay.jl"
    file.write_text("ode = @ODEmodel(\n    x1'(t) = -a*b*x1(t),\n    y(t) = x1(t)\n)\n", encoding="utf-8")
    statuses = obsdeg.analyze(obsdeg.load(file), solutions=False).statuses
    assert statuses == {"x1": "observable", "a": "inseparable", "b": "inseparable"}
    assert isinstance(obsdeg.load("examples/six-positions/scheme.toml"), obsdeg.Scheme)

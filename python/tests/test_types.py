"""Answers match their types: their classes are those of the program's schemas, and every value of the
examples has its type."""

from __future__ import annotations

import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import obsdeg
import pytest
from conftest import AT_LENGTH, MYPY_CACHE, ROOT, _program
from obsdeg import options
from obsdeg._records import Record, fields
from obsdeg._results import KINDS

sys.path.insert(0, str(ROOT / "python" / "tools"))
PAPER = [(0, 0, 0), (180, 0, 0)]
FIVE, SIX = "examples/five-positions/scheme.toml", "examples/six-positions/scheme.toml"
PLAIN = (str, int, float, bool, type(None))


@pytest.fixture(autouse=True)
def in_root(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


def test_classes_are_those_of_the_schemas() -> None:
    import write_shapes

    there = (ROOT / "python" / "obsdeg" / "shapes.py").read_text(encoding="utf-8")
    if there != write_shapes.written(_program()):
        pytest.fail("the schemas of answers have changed: python python/tools/write_shapes.py writes their types again")


def answers() -> Iterator[obsdeg.Answer]:
    """Answers of every kind; of examples every fourth, at full length all."""
    for file in sorted(Path("examples").glob("*/*.toml"))[:: 1 if AT_LENGTH else 4]:
        if not file.parent.name.startswith("wrong-"):
            yield obsdeg.analyze(file)
            try:
                yield obsdeg.simulate(file)
            except obsdeg.ProblemError:
                # without numbers there is no run
                continue
    yield obsdeg.analyze(angles=PAPER, formulas=True, combination="D_IX - D_IY", sensitivities=True)
    yield obsdeg.analyze(angles=["NUE@X_p:360", "alpha,0,0"], latitude=90)
    yield obsdeg.analyze(angles=PAPER, terms="all", carry="inertial", path="gimbals", solutions=False)
    yield obsdeg.paper()
    yield obsdeg.compare(FIVE, SIX)
    yield obsdeg.simulate(angles=PAPER, truth="exact", filter="iterated", requirement={"D": 0.05}, rate_random_walk=(0.001, 0.002, 0.003))
    yield obsdeg.crosscheck(angles=PAPER, runs=20)
    yield obsdeg.crosscheck(angles=PAPER, runs=20, filter_carry="inertial")
    yield obsdeg.crosscheck("examples/lotka-volterra/model.toml")
    yield obsdeg.calibrate("examples/bench-day/scheme.toml", "examples/bench-day/record.csv")
    yield obsdeg.calibrate("examples/hudson-bay/model.toml", "examples/hudson-bay/data.csv", starts=2, profile="a")
    yield obsdeg.procedure("examples/rate-table/scheme.toml", settle=20)
    turn = "carry = 'inertial'\n{}[[position]]\nattitude = 'NUE'\n[[position]]\nattitude = 'NDW'\n"
    for head in ("path = 'gimbals'\n", "gimbals.alpha_deg = [-90, 90]\n"):
        yield obsdeg.procedure(obsdeg.Scheme.from_text(turn.format(head)), slew_rate=2)
    yield obsdeg.allan("tests/data/static/imu.csv")
    yield obsdeg.design(4, observable="D_F", carry="inertial")
    yield obsdeg.design(6, carry="reset")
    yield obsdeg.design(5, carry="inertial", refine=True, divide=True, front=[5, 6], restarts=2)
    yield obsdeg.design(7, carry="inertial", slew_rate=1, restarts=5)
    yield obsdeg.design(6, carry="reset", candidates="free")
    yield obsdeg.design(5, carry="inertial", criterion="margin", meet=True, requirement={"D": 10, "psi": 10}, dwell=2000, step=100)
    yield obsdeg.design(minimum=True)
    yield obsdeg.design(minimum=True, terms="gyros", carry="inertial")
    yield obsdeg.measure("examples/sir/model.toml", "states, beta", own_outputs=True, observable="k", max_degree=3)
    yield obsdeg.measure("examples/lotka-volterra/model.toml")
    yield obsdeg.design(5, carry="inertial", part=(1, 400))
    parts = [obsdeg.design(4, observable="D_F", carry="inertial", part=(i, 2)) for i in (1, 2)]
    yield obsdeg.design(4, observable="D_F", carry="inertial", merge=parts)
    yield obsdeg.design(4, observable="D_F", carry="inertial", bench={"K0": 20})
    yield obsdeg.analyze(angles=PAPER, why=["D_FZ", "D_FY"])
    yield obsdeg.analyze("examples/sir/model.toml", why="k")
    one = obsdeg.Scheme(["NUE"], carry="inertial", latitude=48)
    yield obsdeg.next_measurement(one, candidates=obsdeg.Scheme(["NDW"]), slew_rate=2)
    bench_day = obsdeg.calibrate("examples/bench-day/scheme.toml", "examples/bench-day/record.csv")
    storage = "examples/year-of-storage/scheme.toml"
    yield obsdeg.next_measurement(storage, candidates=obsdeg.Scheme(["NUE", "USE", "NWU", "DNE"]), after=bench_day, days=[30, 365])


def wrong(value: Any, hint: Any, path: str, seen: dict[type, set[str]]) -> Iterator[str]:
    """Place of a value with a wrong type; collects the keys of each class."""
    origin, inside = get_origin(hint), get_args(hint)
    if isinstance(hint, type) and (issubclass(hint, Record) or hint in KINDS.values()):
        if not isinstance(value, dict):
            yield f"{path} = {value!r:.60} is no {hint.__name__}"
            return
        hints = {n[:-1] if n.endswith("_") else n: h for n, h in get_type_hints(hint).items() if not n.startswith("_")}
        yield from (f"{path}.{k} is not an attribute of {hint.__name__}" for k in value if k not in hints)
        for name, of in hints.items():
            if name in value:
                seen[hint].add(name)
                yield from wrong(value[name], of, f"{path}.{name}", seen)
            elif get_origin(of) is not list and type(None) not in get_args(of):
                yield f"{path}.{name} is missing"
    elif origin in (Union, UnionType):
        each = [list(wrong(value, k, path, defaultdict(set))) for k in inside]
        if [] not in each:
            yield f"{path} = {value!r:.60} is none of {hint}"
        else:
            yield from wrong(value, inside[each.index([])], path, seen)
    elif origin is list and isinstance(value, list):
        for i, v in enumerate(value):
            yield from wrong(v, inside[0], f"{path}[{i}]", seen)
    elif origin is tuple and isinstance(value, list) and len(value) == len(inside):
        for i, (v, k) in enumerate(zip(value, inside, strict=True)):
            yield from wrong(v, k, f"{path}[{i}]", seen)
    elif origin is dict and isinstance(value, dict):
        for k, v in value.items():
            yield from wrong(v, inside[1], f"{path}.{k}", seen)
    elif origin is Literal:
        if value not in inside:
            yield f"{path} = {value!r} is none of {inside}"
    elif not (hint in PLAIN and (type(value) is hint or hint is float and type(value) is int)):
        yield f"{path} = {value!r:.60} is no {hint}"


#: Keys that the answers above omit, by class.
RARE = {
    "ConditionsReport.accelerometer_bias", "ConditionsReport.settle_s", "Design.gimbals", "Geometry.accelerometers",
    "MeasurementReport.accelerometer_bias", "MeasurementReport.gyro_noise", "MeasurementReport.settle_s",
    "NextPositions.unused_ageing", "OtherCarry.not_judged", "Review.gimbals", "Review.noise_floor", "SearchReport.ranked",
    "SystemAnalysis.discrete",
}


def test_every_value_of_the_examples_is_of_its_type() -> None:
    seen: dict[type, set[str]] = defaultdict(set)
    mistakes: list[str] = []
    kinds = set()
    for answer in answers():
        of = answer.to_dict()
        # the promised class is that of the JSON
        assert type(answer) is KINDS[of["schema"]]
        kinds.add(type(answer))
        mistakes += wrong(of, type(answer), of["schema"], seen)
    assert not mistakes, mistakes[:20]
    assert kinds == set(KINDS.values())
    unseen = {f"{kind.__name__}.{name}" for kind in seen for name in fields(kind) if name not in seen[kind]}
    assert unseen <= RARE and len(seen) > 100, (sorted(unseen), len(seen))


def test_attributes_are_objects_of_their_types() -> None:
    answer = obsdeg.analyze(angles=PAPER, carry="inertial", combination="D_IX - D_IY")
    first = answer.quantities[0]
    assert (type(first).__name__, first.name, first.degree) == ("Quantity", "psi_x", 0)
    assert first.degree == first["degree"] == first.to_dict()["degree"] == dict(first)["degree"]
    assert isinstance(answer.positions[0].angles_deg, tuple)
    # a key that the JSON omits
    assert answer.geometry.accelerometers is None
    assert type(answer.geometry.X).__name__ == "GyroAxes" and answer.geometry.X.I == "+x"
    system = obsdeg.analyze("examples/sir/model.toml")
    assert isinstance(system, obsdeg.SystemAnalysis) and type(system.quantities[0]).__name__ == "SystemQuantity"
    found = obsdeg.calibrate("examples/hudson-bay/model.toml", "examples/hudson-bay/data.csv", starts=2)
    assert [type(f).__name__ for f in found.findings] == [f"SystemFinding{f.kind.title().replace('_', '')}" for f in found.findings]
    # keywords of Python
    crosschecked = obsdeg.crosscheck(angles=PAPER, runs=20)
    assert crosschecked.ranking.pass_ is crosschecked.ranking["pass"]
    # several files of models of one kind
    several = obsdeg.analyze(FIVE, "examples/sir/model.toml", solutions=False)
    assert [type(a) for a in several] == [obsdeg.Analysis, obsdeg.SystemAnalysis]
    assert several[0].degrees == obsdeg.analyze(FIVE, solutions=False).degrees
    assert several[1]._repr_html_() == obsdeg.analyze("examples/sir/model.toml", solutions=False)._repr_html_()


def said(command: str) -> set[str]:
    """Options in the signature of a command."""
    with pytest.raises(obsdeg.ProblemError) as wrong:
        obsdeg._obsdeg.answer(command, '{"no such option": 1}')
    return set(wrong.value.message.split("expected one of ")[1].split(", "))


@pytest.mark.parametrize("command", ["analyze", "simulate", "crosscheck", "procedure", "calibrate", "allan", "compare", "design", "report"])
def test_options_are_those_of_the_commands(command: str) -> None:
    mine = set(getattr(options, command.title()).__annotations__)
    files = {"sources", "records", "before", "calibrations", "command", "rotations", "candidates_file", "conditions_file", "merge", "resume", "after"}
    named = {"positions", "candidates", "part"} if command == "design" else set()
    if command == "design":
        # `measure` uses the same command with a model
        named |= {"measure", "own_outputs", *options.Measure.__annotations__}
        # and `next_measurement` with a scheme
        named |= {"next", "days"}
        assert set(options.NextMeasurement.__annotations__) <= mine
    assert mine | named == said(command) - files


#: Refused words, one for each option with a fixed list: the message lists the accepted ones.
WORDS = {
    "carry": "analyze",
    "axes": "analyze",
    "path": "analyze",
    "frame": "analyze",
    "truth": "simulate",
    "filter": "simulate",
    "propagation": "simulate",
    "filter_carry": "crosscheck",
    "criterion": "design",
}


@pytest.mark.parametrize("option", WORDS)
def test_words_of_options_are_those_of_the_commands(option: str) -> None:
    with pytest.raises(obsdeg.ProblemError) as wrong:
        obsdeg._obsdeg.answer(WORDS[option], f'{{"{option}": "no such word"}}')
    hints = get_type_hints(getattr(options, WORDS[option].title()))[option]
    words = {w for k in (get_args(hints) if get_origin(hints) is not Literal else [hints]) for w in get_args(k)}
    said = set(re.split(r"[\s`,()]+", wrong.value.message))
    assert words and words <= said


TYPED = """
import obsdeg

answer = obsdeg.analyze(angles=[(0, 0, 0), (180, 0, 0)], carry="inertial")
reveal_type(answer.quantities[0].degree)
reveal_type(answer.degrees)
reveal_type(obsdeg.analyze(obsdeg.Model("")).quantities[0].number_of_solutions)
reveal_type(obsdeg.analyze("a.toml", "b.toml")[0])
reveal_type(obsdeg.design(5).found[0].positions)
reveal_type(obsdeg.design(5, part=(1, 2)))
reveal_type(obsdeg.calibrate(obsdeg.Scheme([]), "a.csv").findings)
answer.quantities[0].degre
answer.ranks
obsdeg.analyze(angles=[(0, 0, 0)], carry="sideways")
obsdeg.analyze(angels=[(0, 0, 0)])
obsdeg.simulate(angles=[(0, 0, 0)], dwell="long")
"""


def test_types_are_seen_by_mypy(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    script = tmp_path / "typed.py"
    script.write_text(TYPED)
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", "--cache-dir", str(MYPY_CACHE), str(script)],
        env={"MYPYPATH": str(ROOT / "python"), "PATH": ""},
        capture_output=True,
        text=True,
        check=False,
    )
    lines = [line.split(":", 1)[1] for line in done.stdout.splitlines() if "typed.py" in line]
    revealed = [line.split('"')[1] for line in lines if "Revealed" in line]
    errors = {int(line.split(":")[0]): line for line in lines if "error:" in line}
    assert revealed[0] == "int | None" and revealed[1] == "dict[str, int | None]", done.stdout + done.stderr
    assert "NumberOfSolutionsCounted" in revealed[2] and revealed[3] == "obsdeg._results.Judgement"
    assert revealed[5] == "obsdeg._results.Part" and "FindingForce" in revealed[6]
    assert sorted(errors) == [12, 13, 14, 15, 16], done.stdout
    assert 'maybe "degree"' in errors[12]

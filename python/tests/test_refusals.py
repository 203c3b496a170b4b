"""Wrong values are refused where they are given, with the expected ones."""

from __future__ import annotations

import itertools
import json
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import obsdeg
import pytest
from obsdeg import campaign, importers
from obsdeg.importers import ImportProblem

PAIR = [(0, 0, 0), (180, 0, 0)]


@pytest.mark.parametrize(
    ("angles", "message"),
    [
        ([b"NUE"], "found the position b'NUE'; expected alpha, beta, gamma"),
        ({(0, 0, 0), (180, 0, 0)}, "expected a list of positions"),
        ((0, 0, 0), "found the position 0; expected alpha"),
        ("NUE", "found 'NUE'; expected a list of positions"),
        ([(0, 0)], "found 2 angles"),
        ([(0, 0, None)], r"position 1, \(0, 0, None\): found None"),
        ([(0, float("nan"), 0)], "expected a finite number"),
    ],
)
def test_positions(angles: Any, message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        obsdeg.analyze(angles=angles)
    with pytest.raises((TypeError, ValueError), match=message):
        obsdeg.Scheme(angles)


def test_positions_without_end() -> None:
    for positions in (itertools.repeat((0, 0, 0)), ((i, 0, 0) for i in itertools.count())):
        with pytest.raises(ValueError, match="found more than 1000 positions; expected at most 1000"):
            obsdeg.analyze(angles=positions)
        with pytest.raises(ValueError, match="found more than 1000 positions; expected at most 1000"):
            obsdeg.Scheme(positions)
    # the largest number that the engine accepts
    assert len(obsdeg.Scheme([(0, 0, 0)] * 1000)) == 1000


def test_numbers_of_numpy() -> None:
    numpy = pytest.importorskip("numpy")
    plain = obsdeg.analyze(angles=PAIR, seed=5, measured_azimuth=True)
    theirs = obsdeg.analyze(angles=numpy.array(PAIR), seed=numpy.int64(5), measured_azimuth=numpy.bool_(True))
    assert plain.json() == theirs.json()
    # the reason names this number; 0.5 and 45 are exact
    with pytest.raises(TypeError, match="float32: it holds 30.1000003"):
        obsdeg.analyze(angles=[(numpy.float32(30.1), 0, 0)])


def test_files_and_parts(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"expected a file that ends in .html"):
        obsdeg.report("examples/pole/scheme.toml", runs=2).write(tmp_path / "x.pdf")
    assert not any(tmp_path.iterdir())
    with pytest.raises(ValueError, match="merge: found no part"):
        obsdeg.design(2, merge=[])
    with pytest.raises(TypeError, match="part 1: found a int"):
        obsdeg.design(2, merge=[3])  # type: ignore[list-item]
    with pytest.raises(TypeError, match="no record; expected files"):
        obsdeg.calibrate("examples/bench-day/scheme.toml")
    with pytest.raises(TypeError, match="record 1: found a dict; expected a file"):
        obsdeg.calibrate("examples/bench-day/scheme.toml", {})


def test_campaigns(tmp_path: Path) -> None:
    for name, ask in {
        "ahead": lambda: list(campaign.run(str, [1], ahead=0)),
        "retries": lambda: list(campaign.run(str, [1], retries=-1)),
        "chunk": lambda: campaign.sweep(tmp_path, [], chunk=0),
        "parts": lambda: campaign.design(tmp_path, 0, positions=5),
    }.items():
        with pytest.raises(ValueError, match=f"{name}: found -?[01]; expected at least"):
            ask()
    with pytest.raises(TypeError, match="carry: found 'platform'; expected a list"):
        campaign.grid(carry="platform")
    assert campaign.sweep(tmp_path / "empty", []).is_dir()


def test_rows_of_mixed_tasks_are_told_apart(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    tasks: list[dict[str, Any]] = [dict(angles=PAIR), dict(angles=PAIR, latitude=45), dict(angles=PAIR, terms=["F", "I"])]
    campaign.sweep(tmp_path, tasks, chunk=1, executor=lambda: ThreadPoolExecutor(2))
    frame = pandas.read_parquet(tmp_path)
    assert frame["task"].nunique() == 3
    assert len(frame) == 15 + 15 + 9


def test_a_part_that_was_cut_is_made_again(tmp_path: Path) -> None:
    options: dict[str, Any] = {"positions": 5, "carry": "inertial", "candidates": "examples/six-positions/scheme.toml"}

    def threads() -> ThreadPoolExecutor:
        return ThreadPoolExecutor(2)

    whole = campaign.design(tmp_path, 2, executor=threads, **options)
    part = next(tmp_path.glob("*-1-of-2.json"))
    part.write_text(part.read_text(encoding="utf-8")[:50], encoding="utf-8")
    assert campaign.design(tmp_path, 2, executor=threads, **options).json() == whole.json()


@pytest.mark.parametrize(("name", "text", "found"), [("a.toml", "\x00\x01", "no TOML"), ("a.json", '{"a":', "no JSON"), ("a.yaml", "{{{", "no JSON"), ("b.toml", "", "nothing")])
def test_what_is_no_scheme_is_not_loaded(tmp_path: Path, name: str, text: str, found: str) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(importers.ImportProblem, match=found):
        obsdeg.load(tmp_path / name)


def test_no_record_is_said() -> None:
    """The engine itself, which the browser page and others call without the checks of `obsdeg.calibrate`."""
    scheme = {"name": "s", "text": '[[position]]\nattitude = "NUE"\n[[position]]\nattitude = "NDW"\n'}
    with pytest.raises(obsdeg.ProblemError, match="found no record; expected one of each run"):
        obsdeg._obsdeg.calibrate(json.dumps({"sources": [scheme]}), [])
    model = {"name": "m", "text": 'name = "m"\n[states]\nx = "-x"\n[outputs]\ny = "x"\n'}
    with pytest.raises(obsdeg.ProblemError, match="found 0 records; expected one of a model"):
        obsdeg._obsdeg.calibrate(json.dumps({"sources": [model]}), [])


@pytest.mark.parametrize("digits", [-1, 3.0, True, "a", 10])
def test_digits(digits: Any) -> None:
    message = f"digits: found {digits!r}; expected a whole number from 0 to 9, or None"
    for call in (obsdeg.Scheme, obsdeg.analyze):
        with pytest.raises(ValueError, match=re.escape(message)):
            call([(0, 0, 0.1234567891)], digits=digits)


def test_models() -> None:
    sympy = pytest.importorskip("sympy")
    x, k = sympy.symbols("x k")
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"states": {x: -k * x}, "outputs": [x]}, "outputs: found [x] of type list; expected a dictionary"),
        ({"states": {"x": "-k*x"}, "outputs": "x"}, "outputs: found 'x' of type str; expected a dictionary"),
        ({"states": sympy.Eq(x, k), "outputs": {"y": x}}, "states: found Eq(x, k) of type Equality; expected a dictionary"),
        ({"states": {"x": "-k*x"}, "outputs": {"y": "x"}, "starts": 3}, "starts: found 3 of type int; expected a dictionary"),
    ]
    for keys, message in wrong:
        with pytest.raises(TypeError, match=re.escape(message)):
            obsdeg.Model(**keys)
    with pytest.raises(TypeError, match="outputs: found a list; expected values by the name of an output"):
        obsdeg.calibrate(obsdeg.Model(states={"x": "-k*x"}, outputs={"y": "x"}), t=[0, 1], outputs=[1, 2])


def test_a_function_of_time_without_a_meaning() -> None:
    # it was an unknown constant once
    sympy = pytest.importorskip("sympy")
    t, k = sympy.symbols("t k")
    x, u = sympy.Function("x"), sympy.Function("u")
    equations = [sympy.Eq(x(t).diff(t), -k * x(t) + u(t))]
    with pytest.raises(ImportProblem, match=re.escape("found `u(t)`, a function without a meaning; expected a state, or one of known_inputs")):
        obsdeg.Model(states=equations, outputs={"y": x(t)})
    of_inputs = [obsdeg.analyze(obsdeg.Model(states=equations, outputs={"y": x(t)}, **{kind: [u(t)]})) for kind in ("known_inputs", "unknown_inputs")]
    assert [answer.statuses["k"] for answer in of_inputs] == ["observable", "not_seen"]
    # functions as keys
    assert obsdeg.analyze(obsdeg.Model(states={x(t): -k * x(t)}, outputs={"y": x(t)})).degrees == {"x": 0, "k": 1}


def test_kinds_of_options_are_said_in_words() -> None:
    for options, message in (
        (dict(seed="abc"), "seed: found the text \"abc\"; expected a whole number, not negative"),
        (dict(seed=-1), "seed: found the number -1; expected a whole number, not negative"),
        (dict(solutions="yes"), "solutions: found the text \"yes\"; expected true or false"),
    ):
        with pytest.raises(obsdeg.ProblemError) as raised:
            obsdeg.analyze(PAIR, **options)  # type: ignore[call-overload]
        assert str(raised.value) == message
    with pytest.raises(obsdeg.ProblemError, match='dwell: found the text "long"; expected a number'):
        obsdeg.simulate(PAIR, dwell="long")  # type: ignore[call-overload]


def test_exports_take_models_only() -> None:
    for export in (importers.to_si_jl, importers.to_sympy):
        for wrong in (3, obsdeg.Scheme(PAIR), None):
            with pytest.raises(TypeError, match=f"found a {type(wrong).__name__}; expected a Model"):
                export(wrong)  # type: ignore[arg-type]


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    answer = obsdeg.analyze(PAIR)
    monkeypatch.setitem(sys.modules, "pandas", None)
    for use, call in (("to_frame()", answer.to_frame), ("a table of a sweep", lambda: campaign.table([]))):
        with pytest.raises(ImportError) as raised:
            call()
        assert str(raised.value) == f"{use} needs the package `pandas`, which is not installed: pip install 'obsdeg[frames]'"


def test_options_are_named() -> None:
    for options, message in (
        (dict(terms=5), "terms: found 5 of type int; expected a text, or a list of texts"),
        (dict(latitude=float("nan")), "latitude: found NaN; expected a finite number"),
        (dict(why=[5, 6]), "why: "),
    ):
        with pytest.raises((TypeError, ValueError)) as raised:
            obsdeg.analyze(PAIR, **options)  # type: ignore[call-overload]
        assert str(raised.value).startswith(message)
    scheme = obsdeg.Scheme(PAIR, latitude_deg=90)
    assert scheme.latitude == 90 and obsdeg.Scheme(PAIR, latitude=90) == scheme
    with pytest.raises(TypeError, match="latitude and latitude_deg"):
        obsdeg.Scheme(PAIR, latitude=1, latitude_deg=2)
    with pytest.raises(TypeError, match="found position; expected positions"):
        obsdeg.Scheme(PAIR, position=[{}])
    with pytest.raises(ValueError, match="found a text of 2 lines; expected a path"):
        obsdeg.calibrate(PAIR, "t [s],fx [g]\n0,1\n")
    with pytest.raises(LookupError, match="no scheme was found"):
        obsdeg.design(minimum=True, carry="inertial").plot()


def test_algebraic_and_discrete_models_from_parts() -> None:
    divider = obsdeg.Model(states={"x": "-k*z"}, algebraic={"z": "z - 2*x"}, outputs={"y": "x"})
    assert divider.parameters == ("k",)
    assert obsdeg.analyze(divider).statuses == dict.fromkeys(("x", "z", "k"), "observable")
    for export in (importers.to_si_jl, importers.to_sympy):
        with pytest.raises(ImportProblem, match="algebraic"):
            export(divider)
    import sympy  # type: ignore[import-untyped]

    with pytest.raises(ImportProblem, match="algebraic equations beside expressions of SymPy"):
        obsdeg.Model(states={"x": sympy.Symbol("k") * sympy.Symbol("z")}, algebraic={"z": "z - x"}, outputs={"y": "x"})
    daily = obsdeg.Model(states={"x": "a*x"}, outputs={"y": "x"}, discrete=True)
    assert obsdeg.analyze(daily)["a"].degree == 1
    assert obsdeg.analyze(daily.replace(outputs={"z": "a"}).check())["a"].degree == 0
    with pytest.raises(obsdeg.ProblemError, match="nobody"):
        obsdeg.Model(states={"x": "nobody*x"}, parameters=[], outputs={"y": "x"}, discrete=True)


def test_wrong_objects_are_refused_in_words() -> None:
    answer = obsdeg.analyze(PAIR)
    scheme = obsdeg.Scheme(PAIR)
    for call, message in (
        (lambda: obsdeg.Scheme.from_text(5), "text: found 5 of type int; expected the text of a file"),  # type: ignore[arg-type]
        (lambda: obsdeg.Scheme.read(5), "path: found 5 of type int; expected the path of a file"),  # type: ignore[arg-type]
        (lambda: obsdeg.Answer.from_json(None), "text: found None of type NoneType; expected the JSON of an answer"),  # type: ignore[arg-type]
        (lambda: obsdeg.analyze(PAIR, progress=5), "progress: found 5 of type int; expected a function, or True for a bar"),  # type: ignore[arg-type]
        (lambda: campaign.plot(5), "rows: found 5 of type int; expected a table"),  # type: ignore[arg-type]
        (lambda: obsdeg.report(PAIR, calibrations=5), "calibrations: found 5 of type int"),  # type: ignore[call-overload]
        (lambda: obsdeg.next_measurement(scheme, after=5), "after: found 5 of type int; expected a Calibration"),  # type: ignore[arg-type]
    ):
        with pytest.raises(TypeError) as raised:
            call()
        assert str(raised.value).startswith(message)
    with pytest.raises(ValueError, match="found a text that is no JSON"):
        obsdeg.Answer.from_json("")
    for of, name in ((scheme, "text"), (answer, "rank")):
        with pytest.raises(AttributeError, match=f"does not change: found a deletion of `{name}`"):
            delattr(of, name)
    with pytest.raises(ValueError, match="name: found 'a b'; expected the name of a variable"):
        importers.to_si_jl(obsdeg.Model(states={"x": "-k*x"}, outputs={"y": "x"}), name="a b")
    with pytest.raises(ValueError, match="position 51: found 2 angles"):
        obsdeg.Scheme([*[(0, 0, 0)] * 50, (0, 0)])  # type: ignore[list-item]

"""Schemes, models and answers as objects: made from Python values, checked, named, and immutable."""

from __future__ import annotations

import copy
import json
import math
import pickle
import random
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import obsdeg
import pytest
from conftest import ROOT
from obsdeg.importers import exporters
from obsdeg.importers.sympy_system import system

PAIR = [(0, 0, 0), (180, 0, 0)]


@pytest.fixture(autouse=True)
def in_root(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


def test_schemes_know_their_parts() -> None:
    scheme = obsdeg.Scheme(positions=["NUE", (180, 0, "22.5"), ("alpha", 0, 0)], carry="inertial", latitude=28.2)
    assert len(scheme) == 3 and scheme.carry == "inertial" and scheme.latitude == Decimal("28.2")
    assert scheme.positions == ("NUE", (180, 0, Decimal("22.5")), ("alpha", 0, 0))
    assert scheme.angles == ((0.0, 0.0, 0.0), (180.0, 0.0, 22.5), ("alpha", 0.0, 0.0))
    assert obsdeg.Scheme(PAIR).carry == "platform" and obsdeg.Scheme(PAIR).latitude is None
    # the old name of the positions, and positions of a scheme as those of another
    assert obsdeg.Scheme(angles=PAIR) == obsdeg.Scheme(PAIR) == obsdeg.Scheme(obsdeg.Scheme(PAIR).positions)
    with pytest.raises(TypeError, match="both positions and angles"):
        obsdeg.Scheme(PAIR, angles=PAIR)
    with pytest.raises(TypeError, match="no positions"):
        obsdeg.Scheme(carry="reset")


#: Rows are the directions of X_p, Y_p, Z_p in North, Up, East: C_c^n = Mx(alpha) My(beta) Mz(gamma), written
#: out by hand.
def matrix(alpha: float, beta: float, gamma: float) -> list[list[float]]:
    from math import cos, radians, sin

    (ca, sa), (cb, sb), (cg, sg) = ((cos(radians(a)), sin(radians(a))) for a in (alpha, beta, gamma))
    mx = [[1, 0, 0], [0, ca, sa], [0, -sa, ca]]
    my = [[cb, 0, -sb], [0, 1, 0], [sb, 0, cb]]
    mz = [[cg, sg, 0], [-sg, cg, 0], [0, 0, 1]]

    def times(a: list[Any], b: list[Any]) -> list[list[float]]:
        return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]

    return times(times(mx, my), mz)


def test_angles_of_letters_turn_the_axes_there() -> None:
    axes = {"N": (1, 0, 0), "S": (-1, 0, 0), "U": (0, 1, 0), "D": (0, -1, 0), "E": (0, 0, 1), "W": (0, 0, -1)}
    letters = ["NUE", "NDW", "DNE", "ESD", "WUN", "UNW"]
    for words, angles in zip(letters, obsdeg.Scheme(letters).angles, strict=True):
        found = matrix(*(float(a) for a in angles))
        # columns of C_c^n are the axes of the platform
        for k, letter in enumerate(words):
            assert [found[i][k] for i in range(3)] == pytest.approx(axes[letter], abs=1e-12), (words, angles)


def test_schemes_of_files_are_read_as_the_engine_reads_them() -> None:
    for file in sorted(Path("examples").glob("*/scheme.toml")):
        if file.parent.name.startswith("wrong-"):
            continue
        scheme = obsdeg.Scheme.read(file)
        own = obsdeg.analyze(scheme, solutions=False).to_dict()
        assert len(scheme) == len(own["positions"]) and scheme.carry == own["carry"]
        assert [[a if isinstance(a, str) else pytest.approx(a) for a in p] for p in scheme.angles] == [p["angles_deg"] for p in own["positions"]], file
        assert (None if scheme.latitude is None else float(scheme.latitude)) == own["latitude_deg"]


def test_replacing_a_key_is_writing_it() -> None:
    bench = obsdeg.Scheme.read("examples/bench-day/scheme.toml")
    changed = bench.replace(carry="reset", latitude=None)
    assert changed.carry == "reset" and changed.latitude is None and changed.positions == bench.positions
    text = bench.text.replace('carry = "inertial"', 'carry = "reset"').replace("latitude_deg = 48.2\n", "")
    assert text != bench.text
    asked = dict(solutions=False)
    assert obsdeg.analyze(changed, **asked).to_dict() == obsdeg.analyze(obsdeg.Scheme.from_text(text), **asked).to_dict()
    # an empty change keeps names, dwells, requirements and noise of every example
    for file in sorted(Path("examples").glob("*/scheme.toml")):
        if not file.parent.name.startswith("wrong-"):
            scheme = obsdeg.Scheme.read(file)
            assert obsdeg.analyze(scheme.replace(), **asked).json() == obsdeg.analyze(scheme, **asked).json(), file
    fewer = bench.replace(positions=bench.positions[:2])
    assert tuple(fewer) == bench.positions[:2] and len(fewer) == 2 and "dwell_s" in fewer.text and 'name = "p2"' in fewer.text and bench.text.count("[[position]]") == 6
    with pytest.raises(ValueError, match="carry: found 'sideways'"):
        bench.replace(carry="sideways")
    with pytest.raises(obsdeg.ProblemError, match="unknown key `dwel_s`"):
        bench.replace(simulation={"dwel_s": 3})


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: obsdeg.Scheme(PAIR, carry="sideways"), "carry: found 'sideways'; expected platform, inertial or reset"),
        (lambda: obsdeg.Scheme(PAIR, latitude=95), "latitude: found 95; expected a number from -90 to 90"),
        (lambda: obsdeg.Scheme(PAIR, latitude="north"), "latitude: found 'north'"),
        (lambda: obsdeg.Scheme(["NNE"]), "position 1: found 'NNE'; expected the directions"),
        (lambda: obsdeg.Scheme(["NUE", "NUW"]), "position 2: found 'NUW'"),
        (lambda: obsdeg.Scheme([("1/3", 0, 0)]), "position 1: found the angle '1/3'"),
        (lambda: obsdeg.Scheme([("0.12345678901", 0, 0)]), "found 0.12345678901 with 11 decimals; expected at most 9"),
        (lambda: obsdeg.Scheme([(0.12345678901, 0, 0)], digits=None), "with 11 decimals; expected at most 9"),
        (lambda: obsdeg.Scheme([]), "positions: found none"),
        (lambda: obsdeg.Scheme(PAIR, terms=["Q"]), "Q"),
        (lambda: obsdeg.Scheme(PAIR, simulation={"dwel_s": 3}), "unknown key `dwel_s`"),
        (lambda: obsdeg.Scheme.from_text("carry = 3").check(), "line 1, column 9"),
    ],
)
def test_schemes_are_checked_when_they_are_made(ask: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ask()


def test_texts_and_answers_do_not_change() -> None:
    scheme, answer = obsdeg.Scheme(PAIR), obsdeg.analyze(PAIR, solutions=False)
    for of, name in ((scheme, "text"), (scheme, "carry"), (answer, "rank"), (answer, "anything"), (answer["D_FX"], "degree")):
        with pytest.raises(AttributeError, match="does not change"):
            setattr(of, name, 3)
    before = answer.json()
    answer.to_dict()["quantities"].clear()
    answer.degrees.clear()
    answer.quantities.clear()
    answer["D_FX"].to_dict()["degree"] = 7
    answer.rank_profile.append(3)
    assert answer.json() == before and answer["D_FX"].degree == 1 and len(answer) == 15
    assert json.dumps(answer.to_dict()) == json.dumps(json.loads(before))
    assert pickle.loads(pickle.dumps(scheme)) == copy.deepcopy(scheme) == scheme
    assert scheme.replace(carry="reset") != scheme


def test_answers_by_name() -> None:
    answer = obsdeg.analyze(PAIR, solutions=False)
    for quantity, listed in zip(answer, answer.to_dict()["quantities"], strict=True):
        assert answer[quantity.name] == quantity and quantity.to_dict() == listed
    assert answer.names == [q.name for q in answer] and "D_FX" in answer and "D_XX" not in answer
    with pytest.raises(KeyError, match="no unknown 'D_XX' in this answer; there are psi_x"):
        answer["D_XX"]
    run = obsdeg.simulate(PAIR)
    assert run["D_FX"].sigma == {q["name"]: q["sigma"] for q in run.to_dict()["quantities"]}["D_FX"]
    both = obsdeg.compare(PAIR, ["NUE", "NDW", "DNE"], carry="inertial")
    assert [scheme.name for scheme in both] == ["scheme 1", "scheme 2"] and both["scheme 2"] == both[1]
    own = obsdeg.analyze(["NUE", "NDW", "DNE"], carry="inertial").degrees
    assert {q.name: q.degree for q in both[1].quantities} == {n: own[n] for n in (q.name for q in both[1].quantities)}
    found = obsdeg.design(3, carry="inertial", observable="D_F")
    assert [f.positions for f in found] == [f["positions"] for f in found.to_dict()["found"]] and found[0] == found.found[0]
    lotka = obsdeg.analyze("examples/lotka-volterra/model.toml", solutions=False)
    assert isinstance(lotka, obsdeg.SystemAnalysis) and lotka["x1"].degree == 0 and len(lotka) == 6


def test_positions_are_asked_as_they_stand() -> None:
    numpy = pytest.importorskip("numpy")
    asked: dict[str, Any] = dict(carry="inertial", solutions=False)
    whole = obsdeg.analyze(angles=PAIR, **asked).json()
    for what in (PAIR, tuple(PAIR), numpy.array(PAIR), [numpy.array(p) for p in PAIR], [(0, 0, 0), ["180", 0, 0.0]]):
        assert obsdeg.analyze(what, **asked).json() == whole
    assert obsdeg.simulate(PAIR).json() == obsdeg.simulate(angles=PAIR).json()
    assert obsdeg.crosscheck(PAIR, runs=10).json() == obsdeg.crosscheck(angles=PAIR, runs=10).json()
    several = obsdeg.analyze(PAIR, obsdeg.Scheme(PAIR, carry="reset"), "examples/sir/model.toml", solutions=False)
    assert several.names == ["scheme 1", "scheme.toml", "examples/sir/model.toml"] and several[1]["D_FZ"].status == "inseparable"
    with pytest.raises(TypeError, match="found 3 of type int; expected a Scheme"):
        obsdeg.analyze(3)  # type: ignore[call-overload]


def test_answers_are_read_from_their_json() -> None:
    pandas = pytest.importorskip("pandas")
    answers: list[obsdeg.Answer] = [
        obsdeg.analyze(PAIR),
        obsdeg.simulate(PAIR),
        obsdeg.compare(PAIR, ["NUE", "NDW", "DNE"]),
        obsdeg.design(3, carry="inertial", observable="D_F"),
        obsdeg.crosscheck(PAIR, runs=5),
        obsdeg.analyze("examples/sir/model.toml", "examples/pole/scheme.toml", solutions=False),
        obsdeg.calibrate("examples/influenza/model.toml", "examples/influenza/data.csv"),
        obsdeg.paper(),
    ]
    for answer in answers:
        again = obsdeg.Answer.from_json(answer.json())
        assert type(again) is type(answer) and again == answer and repr(again) == repr(answer)
        assert pickle.loads(pickle.dumps(again)) == answer
        with pytest.raises(ValueError, match="read from JSON; expected one of the engine"):
            again.text()
    for answer in answers[:2]:
        # the main table equals that of the engine; texts of empty cells differ
        own, again = answer.to_frame(), obsdeg.Answer.from_json(answer.json()).to_frame()
        for column in own:
            theirs = [x if isinstance(x, (int, float, str)) else None for x in again[column]] if column in again else [None] * len(own)
            assert all(a == b or pandas.isna(a) and (b is None or pandas.isna(b)) for a, b in zip(own[column], theirs, strict=True)), column
    judged = obsdeg.Answer.from_json(answers[5].json())
    assert isinstance(judged, obsdeg.Judgements) and judged[0].degrees == answers[5][0].degrees  # type: ignore[index]
    assert obsdeg.Answer.from_json(answers[4].json()).passed is answers[4].passed
    with pytest.raises(ValueError, match="layout 'x/1'; expected one of obsdeg.analysis/1"):
        obsdeg.Answer.from_json('{"schema": "x/1"}')


def test_computed_angles_are_rounded_and_said() -> None:
    sympy = pytest.importorskip("sympy")
    draw = random.Random(3)
    for _ in range(40):
        angle = draw.uniform(-180, 180)
        # rounded by Python's own formatting, half to even
        text = format(Decimal(repr(angle)), ".9f")
        mine = obsdeg.analyze([(0, 0, 0), (angle, 0, 0)], solutions=False)
        assert mine.json() == obsdeg.analyze([(0, 0, 0), (text, 0, 0)], solutions=False).json()
        assert [(r.name, r.given) for r in mine.rounded] == [("alpha of position 2", repr(angle))]
        assert Decimal(mine.rounded[0].taken) == Decimal(text)
    for given, taken in [
        (0.1 + 0.2, "0.3"),
        (Fraction(100, 3), "33.333333333"),
        (sympy.Rational(-2, 3), "-0.666666667"),
        (Decimal("1.0000000005"), "1"),
        (Decimal("1.0000000015"), "1.000000002"),
        (Fraction(1, 2 * 10**9), "0"),
        (Fraction(3, 2 * 10**9), "0.000000002"),
        (1.234567e-9, "0.000000001"),
        (1e-12, "0"),
    ]:
        answer = obsdeg.analyze([(given, 0, 0)], solutions=False)
        assert [r.taken for r in answer.rounded] == [taken]
        assert answer == obsdeg.analyze([(taken, 0, 0)], solutions=False)
    for exact in (0.3, 28.2, Fraction(45, 2), sympy.Integer(4), sympy.Rational(1, 8), Decimal("0.10"), 7, "0.5", 1e5):
        assert obsdeg.analyze([(exact, 0, 0)], solutions=False).rounded == ()


def test_where_rounding_is_said() -> None:
    third = Fraction(1, 3)
    of_scheme = obsdeg.analyze(obsdeg.Scheme([(third, 0, 0)], latitude=60 * third), solutions=False)
    assert [str(r) for r in of_scheme.rounded] == ["alpha of position 1: 1/3 taken as 0.333333333"]
    answer = obsdeg.analyze([(third, 0, 0)], latitude=100 * third, solutions=False)
    said = "Rounded before it was judged: alpha of position 1: 1/3 taken as 0.333333333 and 1 more"
    assert said in repr(answer) and str(answer).endswith(f"{said}\n") and said in answer._repr_html_()
    # texts for people say it; JSON and CSV are those of the command line
    assert all(answer.text(of).endswith(f"{said}\n") for of in ("table", "markdown"))
    assert said not in answer.json() + answer.text("csv") + answer.text("latex")
    # a replaced number is no longer rounded; several schemes say whose it is
    kept = obsdeg.Scheme([(third, 0, 0)], latitude=60 * third)
    again = obsdeg.Scheme([(0, 0, 0)], latitude=third)
    assert [r.name for r in again.replace(latitude=10).rounded] == [] and len(again.replace(positions=[(1, 0, 0)]).rounded) == 1
    assert [r.name for r in kept.replace(positions=[(1, 0, 0)]).rounded] == []
    both = obsdeg.analyze(kept, again)
    assert [r.name for r in both.rounded] == ["alpha of position 1 of scheme 1", "latitude of scheme 2"]
    assert [[r.name for r in one.rounded] for one in both] == [["alpha of position 1"], ["latitude"]]
    assert both.names == ["scheme 1", "scheme 2"]
    compared = obsdeg.compare(kept, again)
    assert compared["scheme 2"].name == "scheme 2" and "Rounded" not in obsdeg.report(kept).text()
    sympy = pytest.importorskip("sympy")
    assert [r.taken for r in obsdeg.Scheme([(sympy.Float(1) / 3, 0, 0)]).rounded] == ["0.333333333"]
    assert pickle.loads(pickle.dumps(answer)).rounded == answer.rounded
    assert obsdeg.analyze([(0.123456, 0, 0)], digits=2, solutions=False).rounded[0].taken == "0.12"
    assert obsdeg.analyze([(2.5, 0, 0), (3.5, 0, 0)], digits=0, solutions=False).rounded[1].taken == "4"
    with pytest.raises(obsdeg.ProblemError, match="17 decimals; expected at most 9"):
        obsdeg.analyze([(0.1 + 0.2, 0, 0)], digits=None)
    with pytest.raises(ValueError, match="found 1/3, which has no decimal text"):
        obsdeg.analyze([(third, 0, 0)], digits=None)


def test_numbers_that_need_not_be_exact_are_of_any_kind() -> None:
    numpy = pytest.importorskip("numpy")
    plain = obsdeg.simulate(PAIR, noise=0.25, requirement={"D_FX": 0.5}, dwell=500)
    theirs = obsdeg.simulate(PAIR, noise=numpy.float32(0.25), requirement={"D_FX": Fraction(1, 2)}, dwell=numpy.int32(500))  # type: ignore[arg-type, dict-item]
    assert theirs.json() == plain.json()
    tenth = obsdeg.simulate(PAIR, noise=numpy.float32(0.1), angle_random_walk=numpy.array([0.1, 0.2, 0.3], dtype="float32"))  # type: ignore[arg-type]
    assert tenth.json() == obsdeg.simulate(PAIR, noise=0.1, angle_random_walk=(0.1, 0.2, 0.3)).json()


MODEL = """name = "model"

[states]
x = "-a*b*x"

[parameters]
a = {}
b = { unit = "1/h" }

[outputs]
y = "x"
"""


def test_models_of_dictionaries() -> None:
    decay = obsdeg.Model(states={"x": "-a*b*x"}, parameters={"a": "", "b": "1/h"}, outputs={"y": "x"})
    assert obsdeg.analyze(decay).json() == obsdeg.analyze(obsdeg.Model(MODEL)).json()
    assert decay.states == {"x": "-a*b*x"} and decay.outputs == {"y": "x"} and decay.parameters == ("a", "b")
    # names without another meaning are the parameters, in order of appearance
    named = obsdeg.Model(states={"x": "-k_1*x + 1e3*sin(w*t)*c + q/pi", "q": "s0"}, outputs={"y": "abs (x)"}, starts={"x": "x0"}, constants={"c": 2})
    assert named.parameters == ("k_1", "w", "x0", "s0")
    # rates, starts, inputs, constants and numbers of every kind, against a file written by hand
    full = obsdeg.Model(
        name="full",
        states={"x": "-k*x + u + w", "z": {"equation": "c*x - q*z", "unit": "mg"}},
        parameters=["k", "q"],
        outputs={"y": "x", "v": {"expression": "s", "unit": "mg"}},
        starts={"x": Fraction(1, 3), "z": "known"},
        known_inputs={"u": 2},
        unknown_inputs=["w"],
        constants={"c": None, "d": 0.5},
        definitions={"s": "x + d*z"},
        combinations=["k*q"],
    )
    text = """name = "full"
combinations = ["k*q"]
parameters = ["k", "q"]
[states]
x = { equation = "-k*x + u + w", initial = "1/3" }
z = { equation = "c*x - q*z", unit = "mg", initial = "known" }
[known_inputs]
u = { polynomial = 2 }
[unknown_inputs]
w = "arbitrary"
[constants]
c = "generic"
d = "0.5"
[definitions]
s = "x + d*z"
[outputs]
y = "x"
v = { expression = "s", unit = "mg" }
"""
    assert obsdeg.analyze(full).json() == obsdeg.analyze(obsdeg.Model(text)).json()
    assert full.states == {"x": "-k*x + u + w", "z": "c*x - q*z"}
    assert obsdeg.analyze(decay.replace(outputs={"z": "a"})).statuses == {"x": "observable", "a": "observable", "b": "observable"}
    assert decay.replace(outputs={"z": "a", "y": None}).outputs == {"z": "a"}
    for file in sorted(Path("examples").glob("*/model.toml")):
        model = obsdeg.Model.read(file)
        if "wrong" not in str(file):
            assert obsdeg.analyze(model.replace(), solutions=False).json() == obsdeg.analyze(model, solutions=False).json(), file


def test_check_refuses_what_the_engine_refuses() -> None:
    refused = 0
    for file in sorted(Path("examples").glob("*/*.toml")):
        if file.stem == "division-by-zero":
            # the message concerns all points at which the model is judged, not a text
            continue
        is_model = file.parent.name == "wrong-models" or "[[position]]" not in file.read_text(encoding="utf-8")
        text = (obsdeg.Model if is_model else obsdeg.Scheme).read(file)
        try:
            obsdeg.analyze(text, solutions=False)
        except obsdeg.ProblemError as problem:
            refused += 1
            with pytest.raises(obsdeg.ProblemError) as mine:
                text.check()
            assert (mine.value.message, mine.value.line) == (problem.message, problem.line)
        else:
            assert text.check() is text
    assert refused >= 14


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (dict(states={"x": "-k*x"}, outputs={"y": "x"}, parameters=["q"]), "`k` is not known here"),
        (dict(states={"x": "-x*("}, outputs={"y": "x"}), "equation of x"),
        (dict(states={"x": "-x"}, outputs={}), "output"),
        (dict(states={"x": "-x"}, outputs={"y": "x"}, starts={"z": 1}), "starts: found 'z'; expected a state: x"),
        (dict(states={"x": "-x"}, outputs={"y": "x"}, simulation={"duratio": 3}), "duratio"),
    ],
)
def test_models_are_checked_when_they_are_made(made: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        obsdeg.Model(**made)
    with pytest.raises(TypeError, match="a text and states"):
        obsdeg.Model(MODEL, states={"x": "-x"})


def test_models_of_sympy_and_of_importers() -> None:
    sympy = pytest.importorskip("sympy")
    x, a, b, t = sympy.symbols("x a b t")
    f = sympy.Function("x")
    statuses = obsdeg.analyze(obsdeg.Model(MODEL)).statuses
    of_symbols = obsdeg.Model(states={x: -a * b * x}, outputs={"y": x})
    of_names = obsdeg.Model(states={"x": -a * b * x}, outputs={"y": "x"}, parameters=["a", "b"])
    of_equations = obsdeg.Model(states=[sympy.Eq(f(t).diff(t), -a * b * f(t))], outputs={"y": f(t)})
    of_system = obsdeg.Model(system({x: -a * b * x}, {"y": x}))
    for model in (of_symbols, of_names, of_equations, of_system):
        assert obsdeg.analyze(model).statuses == statuses
    known = obsdeg.Model(states={x: -a * x / 3}, outputs={"y": b * x}, starts={x: sympy.Rational(1, 2)}, combinations=["a*b"])
    assert obsdeg.analyze(known).statuses == {"a": "observable", "b": "observable"}
    with pytest.raises(ValueError, match="a state, parameter, input or constant"):
        obsdeg.Model(states={x: -a * b * x}, outputs={"y": x}, parameters=[a])


def test_exporters_take_models() -> None:
    model = obsdeg.Model(MODEL)
    assert exporters.to_sympy(model) == exporters.to_sympy(MODEL) and exporters.to_si_jl(model) == exporters.to_si_jl(MODEL)
    back = obsdeg.Model(exporters.read_model(model))
    assert obsdeg.analyze(back).statuses == obsdeg.analyze(model).statuses


def test_analyze_gives_the_changes_per_unit() -> None:
    """Changes per unit exist only on request: 1 ug of K0 is a tilt of 1e-6 rad in psi of a position."""
    asked = obsdeg.analyze([(0, 0, 0), (180, 0, 0)], carry="reset", sensitivities=True).sensitivities
    assert asked is not None
    k0 = next(t for t in asked.effects.terms if t.name == "K0_X")
    psi = next(s for s in k0.sensitivities if s.unknown == "psi_z@1")
    # Z1 = psi_z + K0_X: the tilt cancels all of it, in deg per ug
    assert abs(abs(psi.per_unit) / math.degrees(1e-6) - 1) < 1e-9
    assert obsdeg.analyze([(0, 0, 0), (180, 0, 0)]).sensitivities is None


def test_names_tell_schemes_and_models_apart() -> None:
    several = [obsdeg.Scheme(["NUE", "NDW"], name=name, latitude=10) for name in ("Alpha", "Beta / 2")]
    compared = obsdeg.compare(*several)
    assert [found.name for found in compared] == ["Alpha", "Beta - 2"] and compared["Alpha"].name == "Alpha"
    assert [s.name for s in several] == ["Alpha.toml", "Beta - 2.toml"]
    assert several[0].replace(carry="reset").name == "Alpha.toml"
    models = [obsdeg.Model(states={"x": "-k*x"}, outputs={"y": "x"}, name=name) for name in ("one", "two")]
    assert sorted(set(obsdeg.analyze(*models).to_frame()["file"])) == ["one.toml", "two.toml"]


def test_an_answer_of_json_prints_as_a_summary() -> None:
    read = obsdeg.Answer.from_json(obsdeg.analyze(["NUE"]).json())
    assert str(read) == repr(read) == "<Analysis: 15 unknowns, rank 5>"
    assert read._repr_mimebundle_()["text/html"] == "<p>&lt;Analysis: 15 unknowns, rank 5&gt;</p>"
    with pytest.raises(ValueError, match="read from JSON"):
        read.text()


def test_models_are_replaced_in_formulas_and_starts() -> None:
    sympy = pytest.importorskip("sympy")
    x, k = sympy.symbols("x k")
    decay = obsdeg.Model(states={"x": "-k*x"}, outputs={"y": "x"})
    assert decay.replace(outputs={"y": x**2}).outputs == {"y": "x^2"}
    known = decay.replace(states={"x": -k * x**2}, starts={x: 3})
    assert known.states == {"x": "-k*x^2"} and list(obsdeg.analyze(known).statuses) == ["k"]
    with pytest.raises(ValueError, match="starts: found 'q'; expected a state: x"):
        decay.replace(starts={"q": 1})

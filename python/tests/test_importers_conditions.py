"""Constructed PEtab problems: cases of conditions, segments, steady states and options that the published
ones lack or combine."""

from __future__ import annotations

from pathlib import Path

import mpmath
import pytest
import sympy
from conftest import judge, statuses
from petab_oracle import written
from test_importers_petab import says_the_problem
from test_importers_sbml import CONC, document, mathml, reaction
from toml_numbers import Numbers, value

from obsdeg.importers import ImportProblem, load, to_toml
from obsdeg.importers.generic import loosened
from obsdeg.importers.system import State, System

RATE = "c*(k*A - piecewise(dose, time < off, 0) - piecewise(0, time < 1, later))"
SBML = document(
    {"A": CONC, "B": CONC},
    parameters={"k": 0.3, "g": 0.2, "dose": 1.0, "off": 3.0, "later": 0.0, "V": 2.0},
    reactions=reaction("r", RATE, {"A": 1}, {"B": 0.5}) + reaction("s", "c*g*B", {"B": 1}, {}),
)
TABLES = {
    "parameters": """
parameterId parameterScale lowerBound upperBound nominalValue estimate
k log10 0.01 10 0.3 1
g_1 lin 0.01 10 0.2 1
g_2 lin 0.01 10 0.4 1
B_0 lin 0.01 10 0.7 1
s_1 lin 0.01 10 1.5 1
s_2 lin 0.01 10 2.5 1
V log 0.01 10 2 0
noise lin 0.01 10 0.1 1
""",
    "conditions": """
conditionId dose off later g A B
one 2 V 0 g_1 1.5 B_0
two 0.5 9 0 g_2 - B_0
three 0.5 9 4 g_2 2.5 0.25
""",
    "observables": """
observableId observableFormula observableTransformation noiseFormula noiseDistribution
y observableParameter1_y*A/V+observableParameter2_y log noise normal
z log10(B+1)+exp(-time) lin noiseParameter1_z normal
""",
    "measurements": """
observableId simulationConditionId time measurement observableParameters noiseParameters
y one 1 0.1 s_1;0.5 -
y one 5 0.1 s_1;0.5 -
y two 5 0.1 s_2;0.5 -
y three 5 0.1 s_2;V -
y three 4 0.1 s_1;0.25 -
z two 3 0.1 - 0.2
""",
}


def test_conditions_parameters_and_segments(tmp_path: Path) -> None:
    path = written(tmp_path, SBML, TABLES)
    found = load(path)
    numbers = Numbers(found.text)
    # divided at 1 and 2, at 1, at 1
    assert (numbers.experiments, numbers.segments) == (3, 3)
    assert list(numbers.parameters) == ["k", "g_1", "g_2", "B_0", "s_1", "s_2"]
    assert any(n.endswith("of the noise alone: noise") for n in found.notes) and any("logarithm" in n for n in found.notes)
    # after t = 2 the other experiments stay in their last segment
    says_the_problem(path, found.text, (0.5, 1.5, 2.5))
    assert set(numbers.file["outputs"]) == {"y", "y_2", "z"}


def test_more_conditions_than_experiments_are_copies_of_the_states(tmp_path: Path) -> None:
    doses = "\n".join(f"c{i} {i + 1} 9 0 g_{1 + i % 2} {2 + i % 3} B_0" for i in range(24))
    rows = "\n".join(
        f"{'z' if i % 3 else 'y'} c{i} 0.5 0.1 {'-' if i % 3 else f's_{1 + i % 2};0.5'} {'0.2' if i % 3 else '-'}" for i in range(24)
    )
    tables = TABLES | {
        "conditions": "conditionId dose off later g A B\n" + doses,
        "measurements": TABLES["measurements"].strip().splitlines()[0] + "\n" + rows,
    }
    path = written(tmp_path, SBML, tables)
    found = load(path)
    numbers = Numbers(found.text)
    assert numbers.experiments == 1 and len([n for n in numbers.states if n.startswith("A_at")]) == 24
    assert len(numbers.file["outputs"]) == 24
    says_the_problem(path, found.text, (0.3,))
    assert set(statuses(found.text).values()) == {"observable"}
    segments = tables | {"measurements": tables["measurements"].replace(" 0.5 0.1", " 5 0.1")}
    (tmp_path / "long").mkdir()
    with pytest.raises(ImportProblem, match="24 experiments with segments"):
        load(written(tmp_path / "long", SBML, segments))


def test_conditions_that_differ_in_nothing_are_one_experiment(tmp_path: Path) -> None:
    conditions = "conditionId dose off later g\na 1 9 0 g_1\nb 1 9 0 g_1\n"
    rows = (
        "observableId simulationConditionId time measurement observableParameters noiseParameters\ny a 0.5 1 s_1;0 -\ny b 0.5 1 s_2;0 -\n"
    )
    text = load(written(tmp_path, SBML, TABLES | {"conditions": conditions, "measurements": rows})).text
    numbers = Numbers(text)
    assert numbers.experiments == 1 and set(numbers.file["outputs"]) == {"y", "y_2"}
    says_the_problem(tmp_path / "problem.yaml", text, (0.5,))


STEADY = document(
    {"A": CONC, "B": CONC, "C": CONC},
    parameters={"make": 0.3, "lose": 0.2, "on": 0.5, "off": 0.7, "push": 1.0},
    reactions=reaction("m", "c*make", {}, {"A": 1}) + reaction("l", "c*lose*A", {"A": 1}, {}) + reaction("b", "c*on*push*A*B", {"B": 1}, {"C": 1}) + reaction("u", "c*off*C", {"C": 1}, {"B": 1}),
)  # fmt: skip
STEADY_TABLES = {
    "parameters": "parameterId parameterScale lowerBound upperBound nominalValue estimate\n"
    + "\n".join(f"{n} lin 0.01 10 0.5 1" for n in ("make", "lose", "on", "off")),
    "conditions": "conditionId push\nrest 1\nrun 3\n",
    "observables": "observableId observableFormula noiseFormula\ny C 0.1\n",
    "measurements": "observableId preequilibrationConditionId simulationConditionId time measurement\ny rest run 1 0.1\ny rest run 2 0.1\n",
}


def test_a_steady_state_keeps_what_reactions_keep(tmp_path: Path) -> None:
    """A = make/lose and C = 3 on A/(off + on A), with the sum 3 of B and C. The run then shows A and off, but
    not on, make and lose."""
    found = load(written(tmp_path, STEADY, STEADY_TABLES))
    numbers = Numbers(found.text)
    a, c = 0.4 / 0.3, 3 * 0.9 * (0.4 / 0.3) / (0.6 + 0.9 * 0.4 / 0.3)
    values = {"make": 0.4, "lose": 0.3, "on": 0.9, "off": 0.6, "A_ss": a, "B_ss": 3 - c, "C_ss": c}
    names = numbers.names({n: mpmath.mpf(v) for n, v in values.items()})
    for constraint in numbers.file["constraints"]:
        assert abs(value(constraint.rpartition("=")[0], names)) < 1e-14
        assert (
            abs(
                value(
                    constraint.rpartition("=")[0],
                    numbers.names({n: mpmath.mpf(v) for n, v in (values | {"A_ss": a + 1, "B_ss": 5}).items()}),
                )
            )
            > 0.1
        )
    lost = {n for n, s in statuses(found.text).items() if s != "observable"}
    assert lost == {"make", "lose", "on", "A_ss"}


def test_a_condition_may_start_elsewhere_than_in_the_steady_state_before(tmp_path: Path) -> None:
    tables = STEADY_TABLES | {"conditions": "conditionId push A\nrest 1 -\nrun 3 2.5\n"}
    numbers = Numbers(load(written(tmp_path, STEADY, tables)).text)
    assert [numbers.states[n]["initial"] for n in "ABC"] == ["2.5", "B_ss", "C_ss"]


def test_what_is_measured_at_the_end_of_time_is_a_steady_state(tmp_path: Path) -> None:
    rows = "observableId simulationConditionId time measurement\ny run inf 0.1\n"
    found = load(written(tmp_path, STEADY, STEADY_TABLES | {"measurements": rows}))
    # one number is determined: C
    assert judge(found.text)["rank"] == 1 + 3
    assert {n for n, s in statuses(found.text).items() if s == "observable"} == {"B_ss", "C_ss"}


def test_the_time_may_not_stand_in_what_settles(tmp_path: Path) -> None:
    moving = STEADY.replace(mathml("c*make"), mathml("c*make*(1 + sin(time))"))
    with pytest.raises(ImportProblem, match="without the time") as found:
        load(written(tmp_path, moving, STEADY_TABLES))
    assert found.value.place == "reaction m"


def test_numbers_of_any_value_keep_zeros_switches_and_exponents() -> None:
    x, k, n, on, dose = (sympy.Symbol(s) for s in ("x", "k", "n", "on", "dose"))
    zero, one = sympy.S.Zero, sympy.S.One
    system = System("m", states={"x": State(-k * x**n + on * dose, sympy.Integer(3))}, outputs={"y": x}, experiments=3)
    system.constants = {
        "k": sympy.Rational(1, 3), "n": sympy.Integer(2), "on": ((one,), (zero,), (one,)), "dose": ((sympy.Integer(5),), (zero,), (sympy.Integer(7),)),
    }  # fmt: skip
    text = to_toml(loosened(system))
    numbers = Numbers(text)
    assert numbers.file["constants"] == {
        "k": "generic",
        "n": "2",
        "x_start": "generic",
        "dose_is": "generic",
        "dose_is_2": "generic",
        "on": "1",
        "dose": "dose_is",
    }
    assert [e["constants"] for e in numbers.file["experiment"]] == [
        {"on": "1", "dose": "dose_is"},
        {"on": "0", "dose": "0"},
        {"on": "1", "dose": "dose_is_2"},
    ]
    assert numbers.states["x"]["initial"] == "x_start"

"""Quantities of a model to measure."""

from __future__ import annotations

import itertools

import obsdeg
import pytest
from obsdeg.shapes import NumberOfSolutionsCounted

CHAIN = """
name = "chain"
parameters = ["k", "m"]
[states]
a = "-k*a"
b = "k*a - m*b"
c = "m*b"
[outputs]
y = "c"
[candidates]
last = { expression = "c", cost = 0.5 }
first = { expression = "a", cost = 2 }
"""


def chain() -> obsdeg.Model:
    return obsdeg.Model.from_text(CHAIN)


def degree(outputs: tuple[str, ...]) -> int | None:
    """Largest degree with these outputs, by the verdicts."""
    text = CHAIN.replace('y = "c"', "\n".join(f'o{i} = "{o}"' for i, o in enumerate(outputs)))
    degrees = [q.degree for q in obsdeg.analyze(obsdeg.Model.from_text(text), solutions=False)]
    return None if None in degrees else max(d for d in degrees if d is not None)


def test_figures_are_files() -> None:
    files = obsdeg.measure(chain(), "states").files()
    assert sorted(files) == ["degrees.png", "degrees.svg", "front.png", "front.svg"]
    assert files["front.png"].startswith(b"\x89PNG")
    assert all(f">{name}<".encode() in files["degrees.svg"] for name in "abckm")


def test_sets_are_those_of_verdicts_on_all() -> None:
    found = obsdeg.measure(chain(), "states")
    sets = [s for n in (1, 2, 3) for s in itertools.combinations("abc", n)]
    worst = {s: degree(s) for s in sets}
    front: list[tuple[int, int]] = []
    for n in (1, 2, 3):
        best = min((d for s, d in worst.items() if len(s) == n and d is not None), default=None)
        if best is not None and (not front or best < front[-1][1]):
            front.append((n, best))
    assert [(len(s.outputs), s.degree) for s in found.front] == front
    minimal = [s for s in sets if worst[s] is not None and all(worst.get(tuple(c for c in s if c != x)) is None for x in s)]
    assert sorted(tuple(s.outputs) for s in found.sets) == sorted(minimal)
    assert found.minimal_sets == len(minimal) and found.confirmed_sets > 0


def test_costs_names_and_tables() -> None:
    found = obsdeg.measure(chain())
    assert [c.name for c in found.candidates] == ["last", "first"]
    assert [(s.outputs, s.cost) for s in found.front][0] == (["last"], 0.5)
    assert found["m"].cheapest.cost == 0.5 and found["m"].required
    dear = obsdeg.measure(chain(), ["a", "c"], cost={"c": 5}, observable="k", max_degree=9)
    assert dear.required == ["k"] and dear.front[0].outputs == ["a"]
    frame = found.to_frame()
    assert list(frame["degree"]) == [s.degree for s in found.front]
    assert obsdeg.Answer.from_json(found.json()) == found
    assert "chain" in str(found) and len(found) == 5
    stay = obsdeg.measure(chain(), "a", own_outputs=True)
    assert stay.own_outputs == ["y"] and stay.front[0].outputs == []


def test_what_is_wrong() -> None:
    with pytest.raises(obsdeg.ProblemError, match="no unknown of the model"):
        obsdeg.measure(chain(), observable="q")
    with pytest.raises(obsdeg.ProblemError, match="no such candidate"):
        obsdeg.measure(chain(), "a", cost={"b": 2})
    with pytest.raises(obsdeg.ProblemError, match="measure is about models"):
        obsdeg.measure(obsdeg.Scheme([(0, 0, 0)]), "states")  # type: ignore[arg-type]


def test_one_more_experiment_and_one_solution() -> None:
    """By hand: two starts spare a derivative; `x^2` and `x*V` leave the sign of x, V and K open."""
    enzyme = obsdeg.Model(states={"x": "-V*x/(K+x)"}, parameters=["V", "K"], outputs={"y": "x"})
    found = obsdeg.measure(enzyme, ["x", "experiment"], cost={"experiment": 3})
    assert [(s.outputs, s.cost, s.degree) for s in found.front] == [(["x"], 1.0, 2), (["x", "experiment"], 4.0, 1)]
    unique = obsdeg.measure(enzyme, ["x^2", "x*V"], unique=True)
    two = {u.name: u.number_of_solutions for u in unique.unattainable}
    assert unique.required == [] and all(isinstance(n, NumberOfSolutionsCounted) and n.counted == 2 for n in two.values())
    assert list(two) == ["x", "V", "K"]
    assert obsdeg.measure(enzyme, ["x^2", "x"], unique=True).sets[0].outputs == ["x"]

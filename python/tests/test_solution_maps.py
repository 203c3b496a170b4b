"""Maps between solutions, checked by SymPy: outputs of both have the same derivatives at a rational point."""

from __future__ import annotations

import json
import random
import re
from pathlib import Path

import pytest
import sympy

import obsdeg

MODELS = Path(__file__).resolve().parents[2] / "tests" / "data" / "models"
#: Number of compared derivatives.
ORDERS = 5
DIGITS = str.maketrans("₀₁₂₃₄₅₆₇₈₉", "0123456789")


def mapped(words: str) -> dict[str, str]:
    """Replacement of every name that changes: of ``replace a by b``, ``swap a and b``, ``negate a``."""
    verb, rest = words.split(" ", 1)
    if verb == "negate":
        return {name: f"-{name}" for name in rest.split(", ")}
    if verb == "swap":
        pairs = [pair.split(" and ") for pair in rest.split(", ")]
        return {a: b for pair in pairs for a, b in (pair, reversed(pair))}
    return dict(part.split(" by ") for part in re.split(r", (?=\S+ by )", rest))


@pytest.mark.parametrize("name", ["biohydrogenation", "daisy_ex3", "seir34", "lorenz_z", "mamillary3", "llw1987"])
def test_both_solutions_have_the_same_outputs(name: str) -> None:
    path = MODELS / f"{name}.json"
    (words,) = obsdeg.analyze(path).solution_maps
    model = json.loads(path.read_text(encoding="utf-8").translate(DIGITS))
    inputs = list(model.get("known_inputs") or [])
    names = [*model["states"], *model["params"], *(model.get("known_constants") or [])]
    symbols = {n: sympy.Symbol(f"s{i}") for i, n in enumerate([*names, *inputs])}

    def read(text: str) -> sympy.Expr:
        return sympy.sympify(text.replace("^", "**"), locals=dict(symbols))

    jets = [[symbols[u], *(sympy.Symbol(f"{symbols[u]}_{k}") for k in range(1, ORDERS + 1))] for u in inputs]
    rng = random.Random(1)
    free = [*symbols.values(), *(s for list_ in jets for s in list_[1:])]
    point = {s: sympy.Rational(rng.randint(2, 99), rng.randint(2, 9)) for s in free}
    image = {**point, **{symbols[n]: read(e).subs(point) for n, e in mapped(words.translate(DIGITS)).items()}}
    assert image != point
    rates = {symbols[s]: read(model["equations"][s]) for s in model["states"]}
    rates |= {a: b for list_ in jets for a, b in zip(list_, list_[1:])}
    outputs = [read(e) for e in model["outputs"].values()]
    for _ in range(ORDERS):
        assert all(y.subs(point) == y.subs(image) for y in outputs), words
        outputs = [sum((y.diff(s) * rate for s, rate in rates.items()), sympy.Integer(0)) for y in outputs]

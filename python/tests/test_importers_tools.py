"""Texts of other tools: the 141 published systems read back from their syntax have their known verdicts."""

from __future__ import annotations

import pytest
import scripts
from conftest import AT_LENGTH, judge, references, statuses

from obsdeg.importers import (
    ImportProblem,
    exporters,
    sijl,
    strike_goldd,
    sympy_system,
    to_toml,
)

MODELS = {n: scripts.renamed(m) for n, m in references().items() if scripts.is_plain(m)}
#: Models that texts of the tools can express: rational functions only.
RATIONAL = {n: m for n, m in MODELS.items() if not m.get("unknown_inputs") and not m.get("known_constants") and "(t)" not in str(m)}


def agrees(model: scripts.Model, text: str) -> None:
    """Asserts every verdict and, if known, the rank order by order."""
    answer = judge(text)
    found = {q["name"]: q["status"] == "observable" for q in answer["quantities"]}
    expected = model["expected"]
    for name in expected["observable"]:
        assert found[name], f"{name} is observable"
    for name in expected["unobservable"]:
        assert not found[name], f"{name} is not observable"
    if "min_order" in model:
        degrees = {q["name"]: q["degree"] for q in answer["quantities"]}
        assert {n: degrees[n] for n in model["min_order"] if n in degrees} == {n: k for n, k in model["min_order"].items() if n in degrees}


def test_most_reference_models_can_be_said_in_the_tools() -> None:
    assert len(MODELS) >= 130 and len(RATIONAL) >= 110


@pytest.mark.parametrize("name", sorted(MODELS)[:: 1 if AT_LENGTH else 3])
def test_scripts_of_strike_goldd_have_the_verdicts_that_are_known(name: str) -> None:
    model = MODELS[name]
    degree = model.get("unknown_input_max_derivative")
    system = strike_goldd.read(scripts.matlab(model), unknown_inputs="arbitrary" if degree is None else degree)
    assert list(system.states) == model["states"] and list(system.parameters) == model["params"]
    assert set(system.constants) <= set(model.get("known_constants", []))
    agrees(model, to_toml(system))


@pytest.mark.parametrize("name", sorted(RATIONAL)[:: 1 if AT_LENGTH else 3])
def test_models_of_si_jl_have_the_verdicts_that_are_known(name: str) -> None:
    model = RATIONAL[name]
    system = sijl.read(scripts.julia(model))
    assert list(system.states) == model["states"]
    # names that occur in no equation are missing in the text
    assert set(system.parameters) <= set(model["params"]) and set(system.known_inputs) <= set(model["known_inputs"])
    unseen = set(model["params"]) - set(system.parameters)
    expected = {k: [n for n in v if n not in unseen] for k, v in model["expected"].items() if isinstance(v, list)}
    agrees({**model, "expected": {**model["expected"], **expected}}, to_toml(system))


@pytest.mark.parametrize("name", sorted(RATIONAL)[::4])
def test_exports_say_the_same_system(name: str) -> None:
    model = RATIONAL[name]
    toml = to_toml(strike_goldd.read(scripts.matlab(model)))
    before = statuses(toml)
    back = sympy_system.read(exporters.to_sympy(toml))
    # a keyword of Python, such as lambda, becomes lambda_
    assert {n.rstrip("_"): s for n, s in statuses(to_toml(back)).items()} == {n.rstrip("_"): s for n, s in before.items()}
    if any(f"{f}(" in toml for f in ("sin", "cos", "tan", "exp", "sqrt")):
        with pytest.raises(ImportProblem, match="rational function"):
            exporters.to_si_jl(toml)
        return
    julia = statuses(to_toml(sijl.read(exporters.to_si_jl(toml))))
    assert julia == {n: s for n, s in before.items() if n in julia}
    assert all(s != "observable" for n, s in before.items() if n not in julia)

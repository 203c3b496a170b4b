"""SBML: every supported construct against a simulator or a verdict by hand, every refused construct with its
place."""

from __future__ import annotations

import random
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mpmath
import pytest
import roadrunner
from conftest import judge, statuses
from toml_numbers import Numbers

from obsdeg.importers import ImportProblem, load, sbml, to_toml

MATH = 'xmlns="http://www.w3.org/1998/Math/MathML"'
TIME = '<csymbol encoding="text" definitionURL="http://www.sbml.org/sbml/symbols/time">t</csymbol>'
NONE: Mapping[str, Any] = {}


def mathml(formula: str) -> str:
    """Content MathML of a formula of level 3."""
    import libsbml

    node = libsbml.parseL3Formula(formula)
    assert node is not None, libsbml.getLastParseL3Error()
    return libsbml.writeMathMLToString(node).split("?>")[-1]


def document(
    species: Mapping[str, str] = NONE, *, parameters: Mapping[str, float] = NONE, reactions: str = "", more: str = "", volume: float = 2.0
) -> str:
    """SBML text of level 3: species with attributes, constant parameters, reactions, and further elements."""
    kinds = 'substanceUnits="mole" constant="false" compartment="c"'
    listed = "".join(f'<species id="{n}" {kinds} {a}/>' for n, a in species.items())
    values = "".join(f'<parameter id="{n}" value="{v!r}" constant="true"/>' for n, v in parameters.items())
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<sbml xmlns="http://www.sbml.org/sbml/level3/version1/core" level="3" version="1">\n'
        f'<model id="m">{FUNCTIONS if "twice" in reactions + more else ""}<listOfCompartments><compartment id="c" size="{volume}" constant="true" spatialDimensions="3"/></listOfCompartments>'
        f"{f'<listOfSpecies>{listed}</listOfSpecies>' if listed else ''}<listOfParameters>{values}{PLAIN if 'moving' in more else ''}</listOfParameters>"
        f"{_ordered(more, reactions)}</model></sbml>"
    )


FUNCTIONS = (
    f'<listOfFunctionDefinitions><functionDefinition id="twice"><math {MATH}><lambda><bvar><ci> x </ci></bvar><apply><times/><cn> 2 </cn><ci> x </ci></apply></lambda></math></functionDefinition>'
    f'<functionDefinition id="mm"><math {MATH}><lambda><bvar><ci> s </ci></bvar><bvar><ci> k </ci></bvar><apply><divide/><ci> s </ci><apply><plus/><ci> k </ci><apply><ci> twice </ci><ci> s </ci></apply></apply></apply></lambda></math></functionDefinition></listOfFunctionDefinitions>'
)
PLAIN = '<parameter id="moving" value="1" constant="false"/>'


def _ordered(more: str, reactions: str) -> str:
    before, _, events = more.partition("<listOfEvents>")
    return f"{before}{f'<listOfReactions>{reactions}</listOfReactions>' if reactions else ''}{f'<listOfEvents>{events}' if events else ''}"


def reaction(name: str, rate: str, takes: dict[str, float], gives: dict[str, float], local: Mapping[str, float] = NONE) -> str:
    """SBML text of a reaction."""
    refs = lambda kind, of: (
        f"<{kind}>"
        + "".join(f'<speciesReference species="{n}" stoichiometry="{k}" constant="true"/>' for n, k in of.items())
        + f"</{kind}>"
        if of
        else ""
    )
    own = "".join(f'<localParameter id="{n}" value="{v!r}"/>' for n, v in local.items())
    return (
        f'<reaction id="{name}" reversible="false" fast="false">{refs("listOfReactants", takes)}{refs("listOfProducts", gives)}'
        f"<kineticLaw>{mathml(rate)}{f'<listOfLocalParameters>{own}</listOfLocalParameters>' if own else ''}</kineticLaw></reaction>"
    )


def rule(kind: str, target: str, formula: str) -> str:
    return f'<listOfRules><{kind}Rule variable="{target}">{mathml(formula)}</{kind}Rule></listOfRules>'


CONC = 'initialConcentration="1.5" hasOnlySubstanceUnits="false" boundaryCondition="false"'
AMOUNT = 'initialAmount="3" hasOnlySubstanceUnits="true" boundaryCondition="false"'
HELD = 'initialConcentration="2" hasOnlySubstanceUnits="false" boundaryCondition="true"'

#: Texts with their measured quantities.
KINDS = {
    "concentrations and amounts": (
        document({"A": CONC, "B": AMOUNT}, parameters={"k": 0.3}, reactions=reaction("r", "c*k*A*B", {"A": 2}, {"B": 1.5})),
        "A",
    ),
    "a boundary species": (
        document({"A": CONC, "H": HELD}, parameters={"k": 0.3}, reactions=reaction("r", "k*A*H^2", {"A": 1, "H": 1}, {})),
        "A",
    ),
    "local parameters that hide others": (
        document(
            {"A": CONC, "B": CONC},
            parameters={"k": 0.3},
            reactions=reaction("r", "k*A", {"A": 1}, {"B": 1}, {"k": 0.7}) + reaction("s", "k*B", {"B": 1}, {}),
        ),
        "B",
    ),
    "functions in functions": (
        document({"A": CONC}, parameters={"k": 0.3}, reactions=reaction("r", "mm(A, k) + twice(k)", {"A": 1}, {})),
        "A",
    ),
    "a rate rule and the time": (
        document(
            {"A": CONC},
            parameters={"k": 0.3},
            reactions=reaction("r", "k*A*moving", {"A": 1}, {}),
            more=rule("rate", "moving", "-k*moving + sin(time)"),
        ),
        "A",
    ),
    "an assignment rule": (
        document(
            {"A": CONC},
            parameters={"k": 0.3},
            reactions=reaction("r", "A*moving", {"A": 1}, {}),
            more=rule("assignment", "moving", "k*exp(-2*k*time) + A^k"),
        ),
        "A",
    ),
    "functions and piecewise": (
        document(
            {"A": CONC},
            parameters={"k": 0.3, "q": 2.5},
            reactions=reaction(
                "r",
                "tanh(A)*arctan(k) + log10(A) + ln(k + 1) + abs(A - 9) + root(3, A) + piecewise(k, 2 < q, A*k) + sinh(k)/cosh(A)",
                {"A": 1},
                {},
            ),
        ),
        "A",
    ),
    "a reaction that makes nothing of a species": (
        document({"A": CONC, "B": CONC}, parameters={"k": 0.3}, reactions=reaction("r", "k*A*B", {"A": 1, "B": 1}, {"B": 1})),
        "A",
    ),
}


@pytest.fixture
def file(tmp_path: Path) -> Any:
    def write(text: str) -> Path:
        path = tmp_path / "model.xml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.mark.parametrize("kind", KINDS)
def test_rates_and_starts_are_those_of_a_simulator(kind: str, file: Any) -> None:
    text, seen = KINDS[kind]
    numbers = Numbers(load(file(text), outputs={"y": f"{seen}^2"}, unknown=["k"]).text)
    simulator, rng = roadrunner.RoadRunner(text), random.Random(kind)
    amounts = {"B"} if "amounts" in kind else set()
    key = lambda n: n if n in amounts or n == "moving" else f"[{n}]"
    fixed: dict[str, Any] = {"k": mpmath.mpf(simulator["k"])}
    states = [n for n in numbers.states if not n.startswith("exp_")]
    for n, x in numbers.starts(numbers.names(fixed)).items():
        assert n not in states or abs(x - simulator[key(n)]) < 1e-14
    for _ in range(5):
        point = {n: rng.uniform(0.5, 1.5) for n in states}
        time = rng.uniform(0, 2)
        simulator.model.setTime(time)
        for n, x in point.items():
            simulator[key(n)] = x
        own = {"exp_1": mpmath.exp(-2 * fixed["k"] * time)} if "exp_1" in numbers.states else {}
        names = numbers.names({**fixed, **own, **{n: mpmath.mpf(x) for n, x in point.items()}}, time=time)
        rates = numbers.rates(names)
        for n in states:
            assert abs(rates[n] - simulator[key(n) + "'"]) <= 1e-12 * (1 + abs(rates[n])), n
        assert abs(numbers.outputs(names)["y"] - point[seen] ** 2) < 1e-14


def event(trigger: str, target: str, value: str, extra: str = "") -> str:
    return (
        f'<listOfEvents><event id="dose" useValuesFromTriggerTime="true"><trigger initialValue="true" persistent="true">{mathml(trigger)}</trigger>{extra}'
        f'<listOfEventAssignments><eventAssignment variable="{target}">{mathml(value)}</eventAssignment></listOfEventAssignments></event></listOfEvents>'
    )


DECAY = reaction("r", "c*k*A", {"A": 1}, {})


def test_a_known_dose_tells_the_scale_of_what_is_measured(file: Any) -> None:
    """y = s A: s and the unknown A(0) are distinguished only if a known amount is added."""
    options: dict[str, Any] = {"outputs": {"y": "s*A"}, "unknown": ["k", "s"], "starts": "unknown"}
    species, parameters = {"A": CONC}, {"k": 0.3, "s": 2.0}
    without = statuses(load(file(document(species, parameters=parameters, reactions=DECAY)), **options).text)
    assert without == {"A": "inseparable", "k": "observable", "s": "inseparable"}
    dosed = load(file(document(species, parameters=parameters, reactions=DECAY, more=event("time >= 2", "A", "A + 5"))), **options)
    assert set(statuses(dosed.text).values()) == {"observable"}
    assert any("reached at once" in note for note in dosed.notes)


def test_a_parameter_that_an_event_changes_is_a_state_at_rest(file: Any) -> None:
    text = document(
        {"A": CONC},
        parameters={"k": 0.3},
        reactions=reaction("r", "c*k*moving*A", {"A": 1}, {}),
        more=event("time > 1", "moving", "moving + 1/2"),
    )
    numbers = Numbers(load(file(text), outputs={"y": "A"}, unknown=["k"]).text)
    assert numbers.segments == 2 and numbers.states["moving"]["equation"] == "0" and numbers.states["moving"]["initial"] == "1"
    assert numbers.file["segment"][1]["carry"] == {"moving": "0.5 + moving"}


def test_piecewise_in_time_is_cut_into_segments_of_constants(file: Any) -> None:
    rate = "A*(k + piecewise(0, time < 1, 2, (time >= 1) && (time < 3), 5))"
    numbers = Numbers(
        load(
            file(document({"A": CONC}, parameters={"k": 0.3}, reactions=reaction("r", rate, {"A": 1}, {}))),
            outputs={"y": "A"},
            unknown=["k"],
        ).text
    )
    simulator = roadrunner.RoadRunner(document({"A": CONC}, parameters={"k": 0.3}, reactions=reaction("r", rate, {"A": 1}, {})))
    assert numbers.segments == 3
    for segment, time in enumerate((0.5, 2.0, 4.0)):
        simulator.model.setTime(time)
        names = numbers.names({"A": mpmath.mpf(simulator["[A]"]), "k": mpmath.mpf("0.3")}, segment=segment)
        assert abs(numbers.rates(names)["A"] - simulator["[A]'"]) < 1e-14


def test_initial_assignments_are_starts_of_parameters(file: Any) -> None:
    start = f'<listOfInitialAssignments><initialAssignment symbol="A">{mathml("k*3 + 1")}</initialAssignment></listOfInitialAssignments>'
    text = load(
        file(document({"A": CONC}, parameters={"k": 0.3}, reactions=reaction("r", "c*A", {"A": 1}, {}), more=start)),
        outputs={"y": "A"},
        unknown=["k"],
    ).text
    assert Numbers(text).states["A"]["initial"] == "1 + 3*k"
    assert statuses(text) == {"k": "observable"}


def test_unknowns_are_all_parameters_when_none_are_named(file: Any) -> None:
    answer = judge(load(file(KINDS["local parameters that hide others"][0]), outputs={"y": "B"}).text)
    assert {q["name"]: q["status"] for q in answer["quantities"]} == {"k": "observable", "r_k": "observable"}


REFUSED = {
    "no output": (KINDS["a boundary species"][0], {}, "", "no outputs", "outputs="),
    "an unknown that is none": (KINDS["a boundary species"][0], {"unknown": ["q"]}, "", "`q`", ""),
    "an output of nothing": (KINDS["a boundary species"][0], {"outputs": {"y": "nothing + A"}}, "", "`nothing`", ""),
    "a delay": (
        document({"A": CONC}, parameters={"k": 1}, reactions=reaction("slow", "delay(A, 2)", {"A": 1}, {})),
        {},
        "the kinetic law of slow",
        "the delay",
        "",
    ),
    "an algebraic rule": (
        document(
            {"A": CONC}, parameters={"k": 1}, more=f"<listOfRules><algebraicRule>{mathml('A - moving')}</algebraicRule></listOfRules>"
        ),
        {},
        "the list of rules",
        "an algebraic rule",
        "solve",
    ),
    "a switch by a state": (
        document({"A": CONC}, parameters={"k": 1}, reactions=reaction("r", "piecewise(1, A < k, 2)", {"A": 1}, {})),
        {},
        "the equation of A",
        "a condition on the state `A`",
        "",
    ),
    "a floor": (
        document({"A": CONC}, parameters={"k": 1}, reactions=reaction("r", "floor(A)", {"A": 1}, {})),
        {},
        "the kinetic law of r",
        "`floor(A)`",
        "",
    ),
    "a delayed event": (
        document({"A": CONC}, parameters={"k": 1}, reactions=DECAY, more=event("time > 1", "A", "2", f"<delay>{mathml('3')}</delay>")),
        {},
        "event dose",
        "a delay",
        "",
    ),
    "an event of a state": (
        document({"A": CONC}, parameters={"k": 1}, reactions=DECAY, more=event("A < 1", "A", "2")),
        {},
        "event dose",
        "a condition on the state `A`",
        "until_events",
    ),
    "a constant without a value": (
        document({"A": CONC}, parameters={"k": 1}, reactions=reaction("r", "k*A", {"A": 1}, {})).replace('value="1"', ""),
        {"unknown": []},
        "",
        "`k`, which has no value",
        "",
    ),
    "no SBML": ("<?xml version='1.0'?><svg/>", {}, "", "XML that is no SBML", ""),
    "broken SBML": (KINDS["a boundary species"][0].replace("</model>", ""), {}, "line", "", ""),
    "an unknown element": (
        document({"A": CONC}, parameters={"k": 1}, reactions=reaction("r", "twice(A)", {"A": 1}, {})).replace('id="twice"', 'id="thrice"'),
        {},
        "",
        "twice",
        "",
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_has_no_counterpart_is_refused(kind: str, file: Any) -> None:
    text, options, place, construct, hint = REFUSED[kind]
    with pytest.raises(ImportProblem) as found:
        load(file(text), **({"outputs": {"y": "A"}} if kind != "no output" else {}) | options)
    problem = found.value
    assert problem.file.endswith("model.xml") and place in problem.place and construct in problem.construct and hint in problem.hint
    assert problem.expected and str(problem).startswith(problem.file)


def test_systems_are_written_only_as_what_a_model_file_can_say(file: Any) -> None:
    system = sbml.load(file(KINDS["a boundary species"][0]), outputs={"y": "A"})
    system.experiments = 21
    with pytest.raises(ImportProblem, match="21 experiments"):
        to_toml(system)

"""The published PEtab problems: judged ones with their verdicts, refused ones, and the agreement of the
imported text with the problem."""

from __future__ import annotations

import random
from functools import cache
from pathlib import Path
from typing import Any

import mpmath
import pytest
from conftest import at_length, judge, shared
from petab_oracle import Model, Tables, observed, prepared
from toml_numbers import Numbers, value

from obsdeg.importers import ImportProblem, load, petab

#: Judged problems by first author: options, number of unknowns, and the unobservable ones.
JUDGED: dict[str, tuple[dict[str, Any], int, set[str]]] = {
    "Armistead": ({}, 10, set()),
    "Bachmann": ({}, 101, {"init_EpoRJAK2"}),
    "Bertozzi": ({}, 6, set()),
    "Boehm": ({}, 6, set()),
    "Borghans": (
        {},
        22,
        {"K2", "Ka", "Kd", "Kp", "Ky", "Kz", "Vd", "Vm2", "Vm3", "Vp", "beta_par", "init_A_state", "init_Y_state", "init_Z_state"}
        | {"scale", "v0", "v1"},
    ),
    "Brannmark": ({}, 27, set()),
    "Bruno": ({}, 13, set()),
    "Crauste": ({}, 12, set()),
    "Elowitz": (
        {},
        20,
        {"KM", "eff", "eff_GFP", "scale", "tps_active", "tps_repr", "init_GFP", "init_GFP_mRNA"}
        | {f"init_{x}_{kind}" for x in "XYZ" for kind in ("mRNA", "protein")},
    ),
    "Fiedler": ({}, 21, set()),
    "Fujita": ({}, 19, set()),
    "Laske": ({"starts": "unknown"}, 110, {"V_rel@1", "V_rel@3"} | {f"R_M{i}@3" for i in range(1, 9)}),
    "Liu": ({"until_events": True}, 7, set()),
    "Okuonghae": ({}, 14, set()),
    "Oliveira": ({}, 10, {"beta_2"}),
    "Perelson": ({}, 2, set()),
    "Rahman": ({"numbers": "generic"}, 9, set()),
    "Raia": (
        {},
        23,
        {"CD274mRNA_production", "SOCS3_accumulation", "SOCS3mRNA_production", "scaling_CD274mRNA", "scaling_SOCS3mRNA"},
    ),
    "Schwen": ({}, 28, set()),
    "Sneyd": ({}, 14, {"k1", "k4", "k_1", "k_4", "l2", "l6", "l_2", "l_6"}),
    "Weber": ({}, 38, set()),
    "Zhao": ({}, 21, set()),
    "Zheng": ({}, 60, set()),
}
#: Refused problems by first author: refused construct without options, and its place.
REFUSED = {
    "Blasi": ("the steady state before a run", "16 equations that must be solved together"),
    "Liu": ("event _E0", "a condition on the state `U`"),
}
#: Times in every segment, for problems with several.
TIMES = {"Brannmark": (1.0, 9.0), "Oliveira": (10.0, 50.0, 150.0), "Weber": (10.0, 24.5)}


def problem(name: str) -> Path:
    """YAML file of a problem."""
    return min(shared("data/petab").glob(f"{name}_*/*.yaml"))


@cache
def imported(name: str) -> str:
    return load(problem(name), **JUDGED[name][0]).text


def test_all_problems_are_judged_or_refused() -> None:
    assert {p.name.partition("_")[0] for p in shared("data/petab").iterdir() if p.is_dir()} == JUDGED.keys() | REFUSED.keys()
    assert sum(not options for options, _, _ in JUDGED.values()) >= 20


@pytest.mark.parametrize("name", [pytest.param(n, marks=at_length) if n == "Bachmann" else n for n in sorted(JUDGED)])
def test_verdicts(name: str) -> None:
    # 36 experiments of 101 unknowns need 2.2e9 operations, and the default limit says so
    answer = judge(imported(name), *(["--work-limit", "3000"] if name == "Bachmann" else []))
    _, unknowns, lost = JUDGED[name]
    assert answer["unknowns"] == unknowns
    assert {q["name"] for q in answer["quantities"] if q["status"] != "observable"} == lost


def test_a_condition_is_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    # Lang_PLOSComputBiol2024 has 9,600 measurements under a condition of 124 columns
    read = []
    overrides = petab._Problem._overrides
    monkeypatch.setattr(petab._Problem, "_overrides", lambda self, name: read.append(name) or overrides(self, name))
    load(problem("Bachmann"))
    assert len(read) > 20 and len(read) == len(set(read))


@pytest.mark.parametrize("name", sorted(REFUSED))
def test_what_has_no_counterpart_is_refused_by_construct_and_place(name: str) -> None:
    place, construct = REFUSED[name]
    with pytest.raises(ImportProblem) as found:
        load(problem(name))
    assert found.value.place == place and construct in found.value.construct and found.value.file.endswith(".yaml")
    assert found.value.expected


def drawn(tables: Tables, numbers: Numbers, rng: random.Random) -> dict[str, float]:
    """Random values of the estimated parameters; switching times keep the values of the table."""
    values = {n: rng.uniform(0.5, 1.5) for n in tables.parameters}
    for n, row in tables.parameters.items():
        if row["estimate"] != "1" or n not in numbers.parameters:
            values[n] = float(row["nominalValue"])
    return values


def close(a: Any, b: Any, size: float) -> bool:
    return bool(abs(a - b) <= 1e-12 * max(abs(a), abs(b), size))


class Imported:
    """Imported text of a problem at a point, experiment by experiment."""

    def __init__(self, text: str, values: dict[str, float]) -> None:
        self.numbers = Numbers(text)
        self.values: dict[str, Any] = {n: mpmath.mpf(v) for n, v in values.items()}
        self.copies = "_at1" in "".join(self.numbers.states)
        self.values |= {n: mpmath.mpf("1.25") for n in self.numbers.parameters if n not in self.values}
        if "root" in self.numbers.parameters:
            square = next(c for c in self.numbers.file["constraints"] if c.startswith(("root", "-root", "root^2")) or "root^2" in c)
            left = square.rpartition("=")[0]
            names = self.numbers.names({**self.values, "root": mpmath.mpf(0)})
            self.values["root"] = mpmath.sqrt(abs(value(left, names)))

    def plain(self, found: dict[str, Any], experiment: int) -> dict[str, Any]:
        """Name without the number of its copy."""
        tail = f"_at{experiment + 1}"
        return {n.removesuffix(tail): v for n, v in found.items() if n.endswith(tail)} if self.copies else found

    @property
    def experiments(self) -> int:
        tails = {n.rpartition("_at")[2] for n in self.numbers.states}
        return max(map(int, tails)) if self.copies else self.numbers.experiments

    def starts(self, experiment: int) -> dict[str, Any]:
        names = self.numbers.names(self.values, 0 if self.copies else experiment)
        return self.plain(self.numbers.starts(names), experiment)

    def at(self, point: dict[str, float], experiment: int, segment: int, time: float) -> tuple[dict[str, Any], dict[str, Any]]:
        """Rates and outputs."""
        states = {
            n: mpmath.mpf(point[n.rpartition("_at")[0] if self.copies else n]) for n in self.numbers.states if not n.startswith("exp_")
        }
        names = self.numbers.names({**self.values, **states}, 0 if self.copies else experiment, segment, time)
        for n, s in self.numbers.states.items():
            if n.startswith("exp_"):
                names[n] = value(s["description"], names)
                slope = mpmath.diff(lambda t, n=n, s=s: value(s["description"], dict(names) | {"t": t, "exp": mpmath.exp}), time)
                assert abs(value(s["equation"], names) - slope) < 1e-15 * (1 + abs(slope)), n
        return self.plain(self.numbers.rates(names), experiment), self.plain(self.numbers.outputs(names), experiment)


@pytest.mark.parametrize(
    "name",
    sorted(set(JUDGED) - {"Rahman", "Laske"}) + ["Rahman exact", "Laske exact"],
)
def test_equations_outputs_and_starts_are_those_of_a_simulator(name: str) -> None:
    name, _, exact = name.partition(" ")
    text = load(problem(name)).text if exact else imported(name)
    says_the_problem(problem(name), text, TIMES.get(name, (0.7,)))


def says_the_problem(path: Path, text: str, times: tuple[float, ...]) -> None:
    """Asserts that every condition is an experiment of the text and vice versa, at random points at one time
    in every segment."""
    tables, rng = Tables.read(path), random.Random(path.name)
    values = drawn(tables, Numbers(text), rng)
    mine = Imported(text, values)
    used: dict[str, list[dict[str, str]]] = {}
    for row in tables.measurements:
        used.setdefault(row["simulationConditionId"], []).append(row)
    conditions = list(used)
    matched: set[int] = set()
    for condition in conditions if len(conditions) <= 9 else conditions[:: len(conditions) // 4]:
        model = Model.of(prepared(tables, condition, values), tables.sbml)
        start = {n: model[n] for n in model.states}
        point = {n: rng.uniform(0.5, 1.5) for n in model.states}
        fits = set(range(mine.experiments))
        settled = any(row.get("preequilibrationConditionId") for row in used[condition])
        for segment, time in enumerate(times):
            model.move(point, time)
            rates = {n: (model.rate(n), model.size(n)) for n in model.states}
            rows = {str(sorted(r.items())): r for r in _observations(used[condition])}.values()
            seen = [(row, observed(model, tables, row, values, time)) for row in rows]
            for experiment in sorted(fits):
                found, outputs = mine.at(point, experiment, segment, time)
                assert {n for n in found if not n.startswith("exp_")} == set(rates), "the states"
                same = all(close(found[n], *rates[n]) for n in rates)
                heard = all(any(close(y, z, 0.0) for n, y in outputs.items() if n.startswith(row["observableId"])) for row, z in seen)
                begun = settled or all(close(x, start[n], 0.0) for n, x in mine.starts(experiment).items() if n in start)
                if not (same and heard and begun):
                    fits.discard(experiment)
        assert fits, f"no experiment is the condition {condition}"
        matched |= fits
    if len(conditions) <= 9:
        assert matched == set(range(mine.experiments))


def _observations(rows: list[dict[str, str]]) -> list[dict[str, str]]:
    keys = ("observableId", "observableParameters")
    return [{k: row.get(k) or "" for k in keys} for row in rows]


@pytest.mark.parametrize(("name", "before"), [("Brannmark", "Dose_0"), ("Weber", "model1_data1"), ("Zheng", "preequilibration")])
def test_steady_states_of_a_simulator_hold_the_constraints(name: str, before: str) -> None:
    tables, numbers = Tables.read(problem(name)), Numbers(imported(name))
    values = {n: float(row["nominalValue"]) for n, row in tables.parameters.items()}
    model = Model.of(prepared(tables, before, values), tables.sbml)
    model.simulator.integrator.relative_tolerance, model.simulator.integrator.absolute_tolerance = 1e-11, 1e-14
    model.simulator.simulate(0, 1e9, 2)
    rest = {n: mpmath.mpf(model[n]) for n in model.states}
    unknown = [n for n in numbers.parameters if n.endswith("_ss")]
    constraints = [c.rpartition("=")[0] for c in numbers.file["constraints"]]
    assert len(constraints) == len(unknown) > 5

    def left(states: dict[str, Any]) -> list[Any]:
        own = {f"{n}_ss": x for n, x in states.items()}
        names = {**{n: mpmath.mpf(v) for n, v in values.items()}, **own}
        return [value(c, numbers.names(names)) for c in constraints]

    rng = random.Random(name)
    elsewhere = [left({n: x * rng.uniform(0.5, 2) for n, x in rest.items()}) for _ in range(4)]
    for k, c in enumerate(left(rest)):
        assert abs(c) < 1e-5 * max(abs(other[k]) for other in elsewhere), constraints[k]

"""Unobservable unknowns of PEtab problems, confirmed by a simulator."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

import pytest
from conftest import shared
from petab_oracle import Model, Tables, observed, prepared


def scaled(*factors: tuple[int, str]) -> Callable[[dict[str, float], float], dict[str, float]]:
    """Change that multiplies each name (separated by blanks) by c^power."""

    def change(values: dict[str, float], c: float) -> dict[str, float]:
        powers = {n: k for k, names in factors for n in names.split()}
        return {n: v * c ** powers.get(n, 0) for n, v in values.items()}

    return change


def sneyd(number: str, other: str) -> Callable[[dict[str, float], float], dict[str, float]]:
    """Change that keeps k_i + l_-j, l_j/l_-j and k_-i/k_i, the observable combinations of these four."""

    def change(values: dict[str, float], c: float) -> dict[str, float]:
        v = values
        low = v[f"l_{other}"] * c
        back = v[f"k_{number}"] + v[f"l_{other}"] - low
        return v | {
            f"l_{other}": low,
            f"k_{number}": back,
            f"l{other}": v[f"l{other}"] * c,
            f"k{number}": v[f"k{number}"] * back / v[f"k_{number}"],
        }

    return change


mrna, proteins = "init_X_mRNA init_Y_mRNA init_Z_mRNA tps_active tps_repr", "init_X_protein init_Y_protein init_Z_protein"
#: Changes that affect no output.
UNSEEN = {
    "Bachmann": [scaled((1, "init_EpoRJAK2"))],
    "Borghans": [
        scaled((1, "Vp v1"), (-1, "beta_par")),
        scaled((1, "Ka Kp Vd Vp init_A_state")),
        scaled((1, "K2 Kd Ky Kz Vm2 Vm3 init_Y_state init_Z_state v0 v1"), (-1, "scale")),
    ],
    "Elowitz": [scaled((1, "eff_GFP"), (-1, "init_GFP_mRNA")), scaled((1, f"KM eff {proteins}")), scaled((1, "eff scale"), (-1, f"eff_GFP init_GFP {mrna}"))],
    "Oliveira": [scaled((1, "beta_2"))],
    "Raia": [scaled((1, "CD274mRNA_production"), (-1, "scaling_CD274mRNA")), scaled((1, "SOCS3_accumulation SOCS3mRNA_production"), (-1, "scaling_SOCS3mRNA"))],
    "Sneyd": [sneyd("1", "2"), sneyd("4", "6")],
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(UNSEEN))
def test_what_is_not_observable_can_be_changed_and_no_simulation_sees_it(name: str) -> None:
    tables = Tables.read(min(shared("data/petab").glob(f"{name}_*/*.yaml")))
    nominal = {n: float(row["nominalValue"]) for n, row in tables.parameters.items()}
    measured: dict[str, dict[str, dict[str, str]]] = {}
    for row in tables.measurements:
        key = f"{row['observableId']} {row.get('observableParameters')}"
        measured.setdefault(row["simulationConditionId"], {})[key] = row
    rng = random.Random(name)
    if name == "Sneyd":
        # nominal values differ so much in size that the effect of some would be hidden
        nominal = {n: rng.uniform(0.5, 1.5) for n in nominal}
    conditions = rng.sample(sorted(measured), min(4, len(measured)))

    def run(values: dict[str, float]) -> list[float]:
        out = []
        for condition in conditions:
            end = max(float(r["time"]) for r in tables.measurements if r["simulationConditionId"] == condition)
            model = Model.of(prepared(tables, condition, values), tables.sbml)
            model.simulator.integrator.relative_tolerance = 1e-11
            # one tolerance for all states would be scaled by the starts, which may be zero
            model.simulator.integrator.absolute_tolerance = [1e-13] * len(model.states)
            before = 0.0
            for time in (0.1 * end, 0.4 * end, end):
                model.simulator.simulate(before, time, 2)
                before = time
                out += [float(observed(model, tables, row, values, time)) for row in measured[condition].values()]
        return out

    first = run(nominal)
    assert any(abs(y) > 1e-9 for y in first)
    for change in UNSEEN[name]:
        changed = change(nominal, 1.3)
        assert sum(changed[n] != v for n, v in nominal.items()) >= 1
        for a, b in zip(first, run(changed), strict=True):
            assert abs(a - b) <= 1e-6 * max(abs(a), abs(b)) + 1e-9
        # changing only one of several parameters affects an output
        parts = [n for n, v in nominal.items() if changed[n] != v]
        if len(parts) > 1:
            alone = (run(nominal | {n: changed[n]}) for n in parts)
            assert any(abs(a - b) > 1e-4 * max(abs(a), abs(b)) for other in alone for a, b in zip(first, other, strict=True))

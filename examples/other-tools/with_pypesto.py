"""A gate before a fit with pyPESTO: parameters of a PEtab problem that no data determine are fixed, or combined.

    python examples/other-tools/with_pypesto.py

The problem in `theophylline` is an oral dose with its bioavailability F and volume V. The gate names what is not identifiable, fixes one
parameter after the other until the rest is, and names what the data determine instead. The profile of V shows what it is good for: without
the gate it is flat up to its bounds, with it there is a finite confidence interval.
"""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import obsdeg
import pypesto.optimize
import pypesto.petab
import pypesto.profile

PROBLEM = Path(__file__).resolve().parent / "theophylline" / "problem.yaml"


class Gate(NamedTuple):
    """Parameters that are not identifiable, those of them to fix, and identifiable combinations to estimate instead."""

    open: list[str]
    fix: list[str]
    combine: list[str]


def gate(problem: Path) -> Gate:
    """Parameters that a fit cannot determine, and the remedy of each."""
    model = obsdeg.Model(obsdeg.load(problem))
    parameters = list(model.parameters)
    answer = obsdeg.analyze(model)
    open_, fix = [name for name in parameters if answer[name].status != "observable"], []
    combine = [c.expression for c in answer.invariants]
    left = open_
    while left:
        fix.append(left[0])
        # a known constant of any value
        rest = [name for name in parameters if name not in fix]
        model = model.replace(parameters=rest, constants=dict.fromkeys(fix, "generic"))
        statuses = obsdeg.analyze(model).statuses
        left = [name for name in left[1:] if statuses[name] != "observable"]
    return Gate(open_, fix, combine)


def interval(problem: Path, profiled: str, fixed: dict[str, float]) -> tuple[float, float] | None:
    """Bounds of the 95 % confidence interval of a parameter by its profile; None if a bound is that of the search.

    Args:
        fixed: values of the parameters that are not estimated.
    """
    task = pypesto.petab.PetabImporter.from_yaml(str(problem), simulator_type="roadrunner").create_problem()
    for name, value in fixed.items():
        task.fix_parameters(task.x_names.index(name), np.log10(value))
    np.random.seed(1)
    optimizer = pypesto.optimize.ScipyOptimizer("L-BFGS-B")
    result = pypesto.optimize.minimize(task, optimizer=optimizer, n_starts=3, progress_bar=False)
    index = task.x_names.index(profiled)
    result = pypesto.profile.parameter_profile(task, result, optimizer, profile_index=[index], progress_bar=False)
    profile = result.profile_result.list[-1][index]
    limit = pypesto.profile.chi2_quantile_to_ratio(0.95)
    if min(profile.ratio_path[0], profile.ratio_path[-1]) > limit or max(profile.ratio_path[0], profile.ratio_path[-1]) > limit:
        return None
    low, high = pypesto.profile.calculate_approximate_ci(profile.x_path[index], profile.ratio_path, limit)
    return float(10**low), float(10**high)


def main() -> tuple[Gate, Any, Any]:
    """The gate, and the profile of V without it and with it."""
    logging.disable(logging.WARNING)
    found = gate(PROBLEM)
    print(f"not identifiable: {', '.join(found.open)}: fix {', '.join(found.fix)}, or estimate {', '.join(found.combine)}")
    without = interval(PROBLEM, "V", {})
    print(f"V without the gate: {'no finite interval' if without is None else without}")
    within = interval(PROBLEM, "V", dict.fromkeys(found.fix, 1.0))
    print(f"V with {', '.join(found.fix)} = 1: {'no finite interval' if within is None else '{:.3f} to {:.3f} l/kg'.format(*within)}")
    return found, without, within


if __name__ == "__main__":
    main()

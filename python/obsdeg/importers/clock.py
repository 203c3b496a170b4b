"""Exponentials of the time as states: `e = exp(c t)` is `e' = c e`, `e(0) = 1`, and the equations stay
rational."""

from __future__ import annotations

import sympy  # type: ignore[import-untyped]

from .formula import TIME, Expr, names_in, symbol, text_of
from .system import State, System


def exponentials_as_states(system: System) -> None:
    """Replaces `exp(c t + d)` in rates, definitions and outputs that depend on the time; c and d contain
    constants and parameters only."""
    fixed = {*system.parameters, *system.constants}
    while more := {n for n, d in system.definitions.items() if n not in fixed and TIME not in d.free_symbols and names_in(d) <= fixed}:
        fixed |= more
    taken = set(system.names())
    swaps: dict[Expr, Expr] = {}
    found = {e for x in _formulas(system) for e in x.atoms(sympy.exp) if TIME in e.free_symbols}
    for e in sorted(found, key=sympy.default_sort_key):
        exponent = sympy.expand(e.args[0])
        slope = exponent.diff(TIME)
        rest = sympy.expand(exponent - slope * TIME)
        if TIME in slope.free_symbols or TIME in rest.free_symbols or not names_in(exponent) <= fixed:
            continue
        number, label = 1, "exp_1"
        while label in taken:
            number += 1
            label = f"exp_{number}"
        taken.add(label)
        system.states[label] = State(slope * symbol(label), sympy.S.One, description=text_of(sympy.exp(slope * TIME)))
        swaps[e] = symbol(label) * sympy.exp(rest)
    if not swaps:
        return
    for state in system.states.values():
        state.rate = state.rate.xreplace(swaps)
    system.definitions = {n: d.xreplace(swaps) for n, d in system.definitions.items()}
    system.outputs = {n: y.xreplace(swaps) for n, y in system.outputs.items()}


def _formulas(system: System) -> list[Expr]:
    return [*(s.rate for s in system.states.values()), *system.definitions.values(), *system.outputs.values()]

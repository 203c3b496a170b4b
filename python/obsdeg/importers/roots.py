"""Square roots in starts as separate unknowns: `r^2 = g`, so that the starts are rational.

A start that solves a quadratic equation, as a steady state often does, contains the root of one polynomial in
many places.
"""

from __future__ import annotations

import sympy  # type: ignore[import-untyped]

from .formula import Expr, symbol
from .system import System


def roots_as_unknowns(system: System) -> None:
    """Replaces the roots in the starts if all are of one polynomial in parameters and constants that all
    experiments share."""
    shared = {*system.parameters, *(n for n, v in system.constants.items() if not isinstance(v, tuple))}
    starts = {n: s.start for n, s in system.states.items() if s.start is not None and not isinstance(s.start, str)}
    roots = {p for e in starts.values() for p in e.atoms(sympy.Pow) if p.exp.is_Rational and p.exp.q == 2 and p.base.free_symbols}
    below = {p.base: sympy.factor(p.base) for p in roots}
    if len(set(below.values())) != 1:
        return
    square = below.popitem()[1]
    if not square.is_polynomial() or not {s.name for s in square.free_symbols} <= shared:
        return
    name = "root"
    while name in system.names():
        name += "_"
    swaps: dict[Expr, Expr] = {p: symbol(name) ** (2 * p.exp) for p in roots}
    for n, start in starts.items():
        system.states[n].start = start.xreplace(swaps)
    system.parameters[name] = "a square root in the starts"
    system.constraints.append(symbol(name) ** 2 - square)

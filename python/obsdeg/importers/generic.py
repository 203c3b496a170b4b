"""Known numbers as known constants with generic values, for verdicts that hold for almost all values."""

from __future__ import annotations

import sympy  # type: ignore[import-untyped]

from .formula import Expr, names_in, symbol
from .system import System, Table


def loosened(system: System) -> System:
    """The same system with generic values for its known constants and starts, unless the number is zero.

    Equal numbers of one constant become one new constant. Numbers in formulas, switches (0 and 1 in tables)
    and exponents do not change.
    """
    taken = set(system.names())
    powers: set[str] = set()
    expressions = [*system.definitions.values(), *system.outputs.values(), *(s.rate for s in system.states.values())]
    for expression in expressions:
        for power in expression.atoms(sympy.Pow):
            powers |= names_in(power.exp)
    while more := {n for p in powers for n in names_in(system.definitions.get(p, sympy.S.Zero))} - powers:
        powers |= more
    fresh: dict[tuple[str, Expr], str] = {}

    def named(value: Expr, owner: str) -> Expr:
        if value == 0:
            return value
        if (owner, value) not in fresh:
            number, label = 1, owner
            while label in taken:
                number += 1
                label = f"{owner}_{number}"
            taken.add(label)
            fresh[owner, value] = label
        return symbol(fresh[owner, value])

    constants: dict[str, Expr | Table | None] = {}
    later: dict[str, Expr | Table | None] = {}
    for name, value in system.constants.items():
        if isinstance(value, tuple):
            numbers = {v for row in value for v in row}
            switch = numbers <= {sympy.S.Zero, sympy.S.One}
            later[name] = value if switch or name in powers else tuple(tuple(named(v, f"{name}_is") for v in row) for row in value)
        elif value is None or name in powers or value == 0 or not value.is_Rational:
            constants[name] = value
        else:
            constants[name] = None
    for name, state in system.states.items():
        if state.start is not None and not isinstance(state.start, str) and state.start.is_Rational:
            state.start = named(state.start, f"{name}_start")
    system.constants = {**constants, **dict.fromkeys(fresh.values()), **later}
    system.notes.append("known numbers are known constants of any value, but for zeros, exponents and those in formulas")
    return system

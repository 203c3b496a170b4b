"""Steady state before a run: unknowns that constraints tie to the parameters.

At rest `N v(x, p) = 0`, with the stoichiometric matrix N of the non-zero reactions. Combinations that no
reaction changes keep their value from the
start: `w N = 0` gives `w (V x - V x_0) = 0`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import sympy  # type: ignore[import-untyped]

from .formula import TIME, Expr, expand, names_in, put, shortened, symbol
from .problem import ImportProblem
from .sbml import Kinetics


class SteadyState:
    """Steady state of a model.

    Attributes:
        start: Symbol of the value of every state, or the value itself if nothing changes it.
        constraints: Expressions that are zero.
    """

    def __init__(self, k: Kinetics, values: Mapping[str, Expr], begin: Mapping[str, Expr], suffix: str) -> None:
        """Ties states to constants.

        Arguments:
            k: Equations of the model.
            values: Constants while the model settles: numbers or expressions of parameters.
            begin: Starts of the states before the model settles.
            suffix: Suffix of the names of states.
        """
        table = {**k.rules, **k.assigned, **values}
        if k.events:
            raise ImportProblem("events before a steady state", "equations that rest", place=k.events[0].name)

        def inline(expression: Expr, place: str) -> Expr:
            found = expand(expression, table, place)
            found = found.replace(lambda e: isinstance(e, sympy.Piecewise), lambda e: e.simplify() if TIME not in e.free_symbols else e)
            if TIME in found.free_symbols:
                raise ImportProblem(f"`{shortened(str(found))}`", "equations without the time, before a steady state", place=place)
            return found

        fluxes = {r: inline(v, f"reaction {r}") for r, v in k.fluxes.items()}
        moving = [r for r, v in fluxes.items() if v != 0]
        reacting = [n for n in k.rates if n in k.changes]
        matrix = sympy.Matrix([[k.changes[n].get(r, 0) for r in moving] for n in reacting])
        if any(not x.is_Rational for x in matrix):
            raise ImportProblem("a stoichiometry that is no number", "numbers, where a steady state is sought", place="the reactions")
        laws = [list(w) for w in matrix.T.nullspace()] if moving else sympy.eye(len(reacting)).tolist()
        self.start = {n: symbol(n + suffix) for n in k.rates}
        for w in laws:
            alone = [n for n, c in zip(reacting, w, strict=True) if c != 0]
            if len(alone) == 1:
                self.start[alone[0]] = begin[alone[0]]
        self.constraints: list[Expr] = []
        # rows of N v = 0 in which a parameter occurs that no other row contains, as far as possible, so that
        # each row can be solved for it
        private = [r for r in moving if self._own(r, moving, fluxes, begin)]
        order = private + [r for r in moving if r not in private]
        reduced, pivots = matrix[:, [moving.index(r) for r in order]].rref() if moving else (matrix, ())
        for i, pivot in enumerate(pivots):
            terms = [reduced[i, j] * fluxes[r] for j, r in enumerate(order) if reduced[i, j] != 0]
            self._add(sympy.Add(*terms), f"reaction {order[pivot]}")
        for n in [n for n in k.rates if n not in k.changes]:
            rate = inline(k.rates[n], f"the rule of {n}")
            if rate == 0:
                self.start[n] = begin[n]
            else:
                self._add(rate, n)
        for w in laws:
            if sum(c != 0 for c in w) == 1:
                continue
            terms = []
            for n, c in zip(reacting, w, strict=True):
                volume = expand(k.volumes[n], table, f"the volume of {n}")
                terms.append(c * volume * (symbol(n) - begin[n]))
            self._add(sympy.Add(*terms), "a sum that reactions keep")
        self.constraints = [sympy.fraction(sympy.together(put(c, self.start)))[0] for c in self.constraints]
        _check(self.constraints)

    @staticmethod
    def _own(reaction: str, moving: Sequence[str], fluxes: Mapping[str, Expr], begin: Mapping[str, Expr]) -> bool:
        """True if a name that is not a state occurs in the rate of this reaction only."""
        others = names_in(*(fluxes[r] for r in moving if r != reaction), *begin.values())
        return bool(names_in(fluxes[reaction]) - others - begin.keys())

    def _add(self, expression: Expr, place: str) -> None:
        if expression.has(sympy.Function, sympy.Piecewise):
            raise ImportProblem("a function in the equation of a steady state", "+ - * / and whole powers", place=place)
        if any(p.exp.is_Integer is not True for p in expression.atoms(sympy.Pow)):
            raise ImportProblem("a power that is no whole number, in the equation of a steady state", "whole powers", place=place)
        self.constraints.append(expression)


def _check(constraints: Sequence[Expr]) -> None:
    """Checks that the constraints can be solved one after the other, each for a name that earlier ones left
    open.

    Points on the constraints are found in this way: constraints with the fewest open names come first.
    """
    left = [names_in(c) for c in constraints]
    while left:
        names = min(left, key=len)
        block = [x for x in left if x <= names]
        if len(names) < len(block):
            raise ImportProblem(
                f"a steady state of {len(constraints)} equations that must be solved together",
                "equations that can be solved one after the other",
                place="the steady state before a run",
                hint="rate constants that stand in one reaction alone make that possible",
            )
        left = [x - names for x in left if not x <= names]

"""Switches at given times: piecewise functions and events become segments.

The time and known numbers must decide every condition. Every experiment is divided where one of its
conditions changes. A piecewise function becomes the sum of its branches, each times a constant that is 1 in
the segments where the branch holds and 0 elsewhere.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import sympy  # type: ignore[import-untyped]

from .clock import exponentials_as_states
from .formula import TIME, Expr, expand, names_in, put, shortened, symbol
from .problem import ImportProblem
from .sbml import Event
from .system import System, Table

#: Reason why segments determine less than a run of finite length.
REACHED_AT_ONCE = (
    "segments are reached at once: what is observable stays so at almost all switching times; where starts are known, "
    "longer segments may tell more apart"
)


class Timeline:
    """Segments of all experiments of a system, and the constants that change with them."""

    def __init__(
        self,
        system: System,
        definitions: Mapping[str, Expr],
        values: Sequence[Mapping[str, Expr]],
        ends: Sequence[Expr | None],
        events: Sequence[Event] = (),
        *,
        nominal: Mapping[str, Expr] | None = None,
        until_events: bool = False,
    ) -> None:
        """Divides the runs into segments.

        Arguments:
            system: The system; its rates are replaced here, its outputs by `settled`.
            definitions: Definitions of the whole model, which become those of the system.
            values: Values of the constants in every experiment.
            ends: Time of the last measurement of every experiment; None if it never ends.
            events: Events of the model.
            nominal: Values of unknowns that decide when something switches; only the order of the switches
                counts.
            until_events: Omits events that depend on states: the verdict covers the time before them.
        """
        self.system, self.values, self.events = system, values, list(events)
        self.nominal, self.switching = dict(nominal or {}), set[str]()
        self.definitions = dict(definitions)
        self.tables: dict[Table, str] = {}
        self.taken = {*system.names(), *definitions}
        places = [(f"the equation of {n}", s.rate) for n, s in system.states.items()]
        places += [(f"the rule of {n}", e) for n, e in definitions.items()]
        if until_events:
            late = [e for e in events if names_in(expand(e.trigger, self.definitions, e.name)) & system.states.keys()]
            self.events = [e for e in events if e not in late]
            system.notes += [f"the runs are judged up to {e.name}, which depends on states" for e in late]
        self.cuts: list[list[Expr]] = []
        for numbers, end in zip(values, ends, strict=True):
            cuts: set[Expr] = set()
            for place, expression in places:
                for condition in _conditions(expression):
                    cuts |= self._switches(condition, numbers, place)
            for event in self.events:
                cuts |= self._switches(event.trigger, numbers, event.name)
            self.cuts.append(sorted(c for c in cuts if c > 0 and (end is None or c < end)))
        self.segments = max(map(len, self.cuts), default=0) + 1
        for name, expression in self.definitions.items():
            self.definitions[name] = self.settled(expression, f"the rule of {name}")
        for name, state in system.states.items():
            state.rate = self.settled(state.rate, f"the equation of {name}")

    def _decided(self, condition: Expr, experiment: int | Mapping[str, Expr], place: str) -> Expr:
        """Condition in terms of the time only."""
        numbers = self.values[experiment] if isinstance(experiment, int) else experiment
        found = expand(condition, {**self.definitions, **numbers}, place)
        self.switching |= names_in(found) & self.nominal.keys()
        found = put(found, self.nominal)
        if left := sorted(names_in(found)):
            state = [n for n in left if n in self.system.states]
            what = f"the state `{state[0]}`" if state else f"`{left[0]}`, which is not known"
            raise ImportProblem(
                f"`{shortened(str(condition))}`, a condition on {what}",
                "a condition on the time and known numbers",
                place=place,
                hint="of an event that depends on states, until_events=True judges what comes before",
            )
        return found

    def _switches(self, condition: Expr, numbers: Mapping[str, Expr], place: str) -> set[Expr]:
        found = self._decided(condition, numbers, place)
        cuts: set[Expr] = set()
        for relation in sympy.sympify(found).atoms(sympy.core.relational.Relational):
            difference = sympy.expand(relation.lhs - relation.rhs)
            slope = difference.diff(TIME)
            if TIME in slope.free_symbols:
                raise ImportProblem(f"`{shortened(str(relation))}`", "a condition linear in the time", place=place)
            if slope != 0:
                cuts.add(sympy.nsimplify(-difference.subs(TIME, 0) / slope))
        return cuts

    def _middle(self, experiment: int, segment: int) -> Expr:
        cuts = self.cuts[experiment]
        bounds = [sympy.S.Zero, *cuts, (cuts[-1] if cuts else sympy.S.Zero) + 1]
        here = min(segment, len(cuts))
        return (bounds[here] + bounds[here + 1]) / 2

    def _table(self, condition: Expr, place: str) -> Table:
        """1 where a condition holds, otherwise 0, by experiment and segment."""
        rows = []
        for e in range(len(self.values)):
            found = self._decided(condition, e, place)
            holds = [sympy.sympify(found).subs(TIME, self._middle(e, s)) for s in range(self.segments)]
            if not all(h in (sympy.true, sympy.false) for h in holds):
                raise ImportProblem(f"`{shortened(str(condition))}`", "a condition that is true or false", place=place)
            rows.append(tuple(sympy.Integer(1 if h == sympy.true else 0) for h in holds))
        return tuple(rows)

    def switch(self, table: Table, name: str = "on") -> Expr:
        """Constant with these values by experiment and segment; a number if they agree."""
        values = {v for row in table for v in row}
        if len(values) == 1:
            return values.pop()
        if table not in self.tables:
            fresh, number = name, 1
            while fresh in self.taken:
                number += 1
                fresh = f"{name}_{number}"
            self.taken.add(fresh)
            self.tables[table] = fresh
        return symbol(self.tables[table])

    def settled(self, expression: Expr, place: str) -> Expr:
        """Expression without piecewise functions."""
        pieces = {p for p in expression.atoms(sympy.Piecewise)}
        swaps: dict[Expr, Expr] = {}
        for piece in pieces:
            out, open_ = sympy.S.Zero, sympy.S.One
            for value, condition in piece.args:
                on = sympy.S.One if condition == sympy.true else self.switch(self._table(condition, place))
                inner = self.settled(value, place)
                out, open_ = out + open_ * on * inner, open_ * (1 - on)
            swaps[piece] = out
        outer = {p: e for p, e in swaps.items() if not any(p in q.atoms(sympy.Piecewise) and p != q for q in pieces)}
        return expression.xreplace(outer | swaps) if swaps else expression

    def spread(self, values: Sequence[Expr], name: str) -> Expr:
        """Expression with these values in the experiments: a common one, a constant of the experiment, or a
        sum with switches."""
        if all(v == values[0] for v in values):
            return values[0]
        if all(v.is_Rational for v in values):
            return self.switch(tuple((v,) * self.segments for v in values), name)
        out = sympy.S.Zero
        for value in dict.fromkeys(values):
            on = tuple((sympy.Integer(1 if v == value else 0),) * self.segments for v in values)
            out += self.switch(on, "in_condition") * value
        return out

    def finish(self) -> None:
        """Gives the system its segments, jumps, constants and definitions."""
        system = self.system
        system.segments, system.experiments = self.segments, len(self.values)
        if self.segments > 1:
            system.notes.append(REACHED_AT_ONCE)
        self._jumps()
        system.definitions.update(self.definitions)
        system.constants.update({name: table for table, name in self.tables.items()})
        exponentials_as_states(system)

    def _jumps(self) -> None:
        system = self.system
        system.carry = [{} for _ in range(self.segments)]
        for event in self.events:
            table = self._table(event.trigger, event.name)
            if any(row[0] == 1 for row in table):
                raise ImportProblem("a trigger that is true at the start", "one that becomes true later", place=event.name)
            for target, value in event.assignments.items():
                if target not in system.states:
                    raise ImportProblem(f"an assignment to `{target}`", "one to a state, or a number to a constant", place=event.name)
                new = self.settled(expand(value, self.definitions, event.name), event.name)
                for s in range(1, self.segments):
                    fires = [int(row[s] == 1 and row[s - 1] == 0) for row in table]
                    if any(fires):
                        # constants have their value after the jump, and no other experiment may use it
                        column = tuple(tuple(sympy.Integer(f) for _ in range(self.segments)) for f in fires)
                        on = self.switch(column, "fires")
                        old = system.carry[s].get(target, symbol(target))
                        system.carry[s][target] = on * new + (1 - on) * old


def _conditions(expression: Expr) -> list[Expr]:
    return [c for p in expression.atoms(sympy.Piecewise) for _, c in p.args if c != sympy.true]

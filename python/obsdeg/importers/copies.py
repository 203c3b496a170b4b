"""Several experiments written as one: every experiment has copies of the states, definitions and outputs."""

from __future__ import annotations

from .formula import Expr, names_in, put, symbol
from .problem import ImportProblem
from .system import State, System


def unrolled(system: System) -> System:
    """The same system with one experiment; `x` of the third is `x_at3`.

    Outputs that are always zero, since nothing is measured there, are omitted.

    Raises:
        ImportProblem: experiments with segments or unknown inputs.
    """
    if system.segments > 1 or system.unknown_inputs or system.known_inputs:
        raise ImportProblem(f"{system.experiments} experiments with segments or inputs", "at most 20 of them")
    out = System(
        system.name, system.description, parameters=dict(system.parameters), notes=list(system.notes), constraints=list(system.constraints)
    )
    tables = {n: v for n, v in system.constants.items() if isinstance(v, tuple)}
    out.constants = {n: v for n, v in system.constants.items() if n not in tables}
    for e in range(system.experiments):
        numbers: dict[str, Expr] = {n: t[e][0] for n, t in tables.items()}
        own = {n: symbol(f"{n}_at{e + 1}") for n in system.states}
        moved = {*own, *numbers}
        while more := {n for n, d in system.definitions.items() if n not in moved and names_in(d) & moved}:
            moved |= more
        swaps = {**numbers, **own, **{n: symbol(f"{n}_at{e + 1}") for n in system.definitions if n in moved}}
        for n, d in system.definitions.items():
            out.definitions[swaps[n].name if n in moved else n] = put(d, swaps)
        for n, s in system.states.items():
            start = s.start if s.start is None or isinstance(s.start, str) else put(s.start, numbers)
            out.states[own[n].name] = State(put(s.rate, swaps), start, s.unit, s.description)
        for n, y in system.outputs.items():
            found = put(y, swaps)
            if found != 0:
                out.outputs[f"{n}_at{e + 1}"] = found
    out.drop_unused()
    return out

"""Imported system, and its text in obsdeg's model format."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import sympy  # type: ignore[import-untyped]

from .formula import FUNCTIONS, Expr, names_in, text_of
from .problem import ImportProblem

#: Largest number of experiments of a model file.
MAX_EXPERIMENTS = 20
#: Names with a meaning in expressions.
RESERVED = frozenset(
    [
        *FUNCTIONS,
        "atan2",
        "t",
        "pi",
        "deg",
        "generic",
        "cross",
        "dot",
        "norm",
        "transpose",
        "skew",
        "qmul",
        "conj",
        "qdot",
        "Rx",
        "Ry",
        "Rz",
    ]
)


@dataclass
class State:
    """State of a system.

    Attributes:
        rate: Derivative, per unit of the time of the file.
        start: Value at the start, in terms of parameters and constants; ``"known"`` for a known one of
            generic value; None for an unknown one.
    """

    rate: Expr
    start: Expr | str | None = None
    unit: str = ""
    description: str = ""


#: Values by experiment and segment, ``table[experiment][segment]``.
Table = tuple[tuple[Expr, ...], ...]


@dataclass
class System:
    """States, constants and outputs, with all further keys of a model file.

    Expressions name states, parameters, inputs, constants and definitions; `formula.TIME` is the time.

    Attributes:
        constants: Known constants: None for a generic value, an expression of other constants, or a table
            ``[experiment][segment]`` of numbers.
        known_inputs: ``"generic"``, ``"constant"`` or the degree of a polynomial in time.
        unknown_inputs: ``"arbitrary"`` or the degree of a polynomial in time.
        carry: States that jump at the beginning of each segment.
        constraints: Expressions that are zero at the start.
        notes: Remarks on the import for readers of an answer.
        discrete: True in discrete time: the rate of a state is its value one step later.
    """

    name: str
    description: str = ""
    states: dict[str, State] = field(default_factory=dict)
    parameters: dict[str, str] = field(default_factory=dict)
    known_inputs: dict[str, str | int] = field(default_factory=dict)
    unknown_inputs: dict[str, str | int] = field(default_factory=dict)
    constants: dict[str, Expr | Table | None] = field(default_factory=dict)
    definitions: dict[str, Expr] = field(default_factory=dict)
    outputs: dict[str, Expr] = field(default_factory=dict)
    experiments: int = 1
    segments: int = 1
    carry: list[dict[str, Expr]] = field(default_factory=list)
    constraints: list[Expr] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    discrete: bool = False

    def names(self) -> list[str]:
        """All names that expressions may contain, in the order of the file."""
        groups: Sequence[Mapping[str, object]] = (
            self.states,
            self.parameters,
            self.known_inputs,
            self.unknown_inputs,
            self.constants,
            self.definitions,
        )
        return [name for group in groups for name in group]

    def used(self) -> set[str]:
        """Names that equations, outputs, starts, jumps and constraints need."""
        needed: set[str] = set()
        open_ = names_in(
            *(s.rate for s in self.states.values()),
            *(s.start for s in self.states.values() if s.start is not None and not isinstance(s.start, str)),
            *self.outputs.values(),
            *self.constraints,
            *(e for c in self.carry for e in c.values()),
        )
        while open_:
            name = open_.pop()
            if name in needed:
                continue
            needed.add(name)
            value = self.definitions.get(name, self.constants.get(name))
            if value is not None and not isinstance(value, tuple):
                open_ |= names_in(value)
        return needed

    def check(self) -> None:
        """Checks that every name is defined exactly once.

        Raises:
            ImportProblem: a name defined twice, or never.
        """
        listed = self.names()
        if twice := sorted({n for n in listed if listed.count(n) > 1}):
            raise ImportProblem(f"`{twice[0]}` for two things", "names of their own")
        if lost := sorted(self.used() - set(listed)):
            raise ImportProblem(f"`{lost[0]}`, which has no value", "a value, or one of the unknowns")

    def drop_unused(self) -> None:
        """Removes definitions and constants that nothing needs."""
        needed = self.used()
        self.definitions = {n: e for n, e in self.definitions.items() if n in needed}
        self.constants = {n: e for n, e in self.constants.items() if n in needed}


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def renamed(system: System) -> dict[str, str]:
    """New names for names that have a meaning in a model file: `sign` becomes `sign_`."""
    taken = set(system.names())
    out: dict[str, str] = {}
    for name in system.names():
        plain = "".join(c if c.isalnum() or c == "_" else "_" for c in name)
        new = plain if plain[:1].isalpha() or plain[:1] == "_" else "_" + plain
        while new in RESERVED or (new != name and new in taken):
            new += "_"
        if new != name:
            out[name] = new
            taken.add(new)
    return out


def to_toml(system: System) -> str:
    """Model file of a system.

    Raises:
        ImportProblem: too many experiments, names defined twice or never, or unsupported functions.
    """
    if system.experiments > MAX_EXPERIMENTS:
        raise ImportProblem(f"{system.experiments} experiments", f"at most {MAX_EXPERIMENTS}")
    names = renamed(system)
    system.check()

    def text(expression: Expr, place: str) -> str:
        try:
            return _quoted(text_of(expression, names))
        except ImportProblem as problem:
            raise problem.located(place=place) from None

    def key(name: str) -> str:
        new = names.get(name, name)
        return new if new.isascii() else _quoted(new)

    lines = [f"# {note}" for note in system.notes]
    lines += [f"name = {_quoted(system.name)}"]
    if system.description:
        lines += [f"description = {_quoted(system.description)}"]
    if system.discrete:
        lines += ["discrete = true"]
    tables = {n: v for n, v in system.constants.items() if isinstance(v, tuple)}
    own = [
        [f"{key(n)} = {text(t[e][0], n)}" for n, t in tables.items() if any(row != t[0] for row in t)] for e in range(system.experiments)
    ]
    steps, later = _segments(tables, system.segments, text, key)
    own = [mine + more for mine, more in zip(own, later[1], strict=True)] if later[1] else own
    if system.experiments > 1 and not any(own):
        lines += [f"experiments = {system.experiments}"]
    if system.constraints:
        lines += ["constraints = ["] + [f'    {text(c, "a constraint")[:-1]} = 0",' for c in system.constraints] + ["]"]
    if system.states:
        lines += ["", "[states]"]
    for name, state in system.states.items():
        more = ""
        if state.start is not None:
            start = _quoted("known") if isinstance(state.start, str) else text(state.start, f"the start of {name}")
            more += f", initial = {start}"
        more += f", unit = {_quoted(state.unit)}" if state.unit else ""
        more += f", description = {_quoted(state.description)}" if state.description else ""
        lines.append(f"{key(name)} = {{ equation = {text(state.rate, f'the equation of {name}')}{more} }}")
    if system.parameters:
        lines += ["", "[parameters]"]
        for name, words in system.parameters.items():
            lines.append(f"{key(name)} = {{{f' description = {_quoted(words)} ' if words else ''}}}")
    for title, inputs in (("known_inputs", system.known_inputs), ("unknown_inputs", system.unknown_inputs)):
        if inputs:
            lines += ["", f"[{title}]"]
            lines += [f"{key(n)} = " + (_quoted(k) if isinstance(k, str) else f"{{ polynomial = {k} }}") for n, k in inputs.items()]
    if system.constants or later[0]:
        lines += ["", "[constants]"]
        for name, value in system.constants.items():
            first = value[0][0] if isinstance(value, tuple) else value
            lines.append(f"{key(name)} = {_quoted('generic') if first is None else text(first, name)}")
        lines += later[0]
    if system.definitions:
        lines += ["", "[definitions]"]
        lines += [f"{key(n)} = {text(e, n)}" for n, e in system.definitions.items()]
    lines += ["", "[outputs]"]
    lines += [f"{n if n.isascii() else _quoted(n)} = {text(e, f'the output {n}')}" for n, e in system.outputs.items()]
    for mine in own if any(own) else []:
        lines += ["", "[[experiment]]"] + ([f"constants = {{ {', '.join(mine)} }}"] if mine else [])
    for s in range(system.segments if system.segments > 1 else 0):
        lines += ["", "[[segment]]"]
        if s and steps[s]:
            lines.append(f"constants = {{ {', '.join(steps[s])} }}")
        jumps = system.carry[s] if s < len(system.carry) else {}
        if jumps:
            lines.append("carry = { " + ", ".join(f"{key(n)} = {text(e, f'the jump of {n}')}" for n, e in jumps.items()) + " }")
    return "\n".join(lines) + "\n"


def _segments(
    tables: Mapping[str, Table], count: int, text: object, key: object
) -> tuple[list[list[str]], tuple[list[str], list[list[str]]]]:
    """Values of constants in later segments: direct if all experiments agree, otherwise through an additional
    constant."""
    assert callable(text) and callable(key)
    steps: list[list[str]] = [[] for _ in range(count)]
    fresh: list[str] = []
    own: list[list[str]] = []
    for name, table in tables.items():
        if all(value == row[0] for row in table for value in row):
            continue
        for s in range(1, count):
            column = [row[s] for row in table]
            if all(value == column[0] for value in column):
                steps[s].append(f"{key(name)} = {text(column[0], name)}")
                continue
            later = f"{key(name)}_{s + 1}"
            fresh.append(f"{later} = {text(column[0], name)}")
            own = own or [[] for _ in column]
            for e, value in enumerate(column):
                own[e].append(f"{later} = {text(value, name)}")
            steps[s].append(f'{key(name)} = "{later}"')
    return steps, (fresh, own)


#: Shared zero and one.
ZERO, ONE = sympy.S.Zero, sympy.S.One

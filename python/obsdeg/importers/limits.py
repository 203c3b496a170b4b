"""Limits of the importers: work is counted before it is done, so that excessive input ends with a message.

| what | limit |
| --- | --- |
| characters of a text | `TEXT` |
| characters of a formula or statement | `FORMULA` |
| nested brackets, functions and powers | `DEPTH` |
| nested elements of XML | `ELEMENTS` |
| operations of a formula with definitions inserted | `OPERATIONS` |
| operations of a formula with max and min written by abs | `WRITTEN` |
| digits of a number from powers | `DIGITS` |
| digits and exponent of a written number | `LITERAL` |
| entries of a vector | `ENTRIES` |
| equations of an `@ODEmodel` | `EQUATIONS` |
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any
from xml.parsers import expat

import sympy  # type: ignore[import-untyped]

from .._files import TEXT, read_text
from .problem import OverLimit

#: Limit in bytes of a file of a PEtab problem.
TABLE = 100_000_000
FORMULA = 100_000
DEPTH = 150
ELEMENTS = 2_000
OPERATIONS = 100_000
WRITTEN = 1_000_000
DIGITS = 10_000
LITERAL = 1_000
ENTRIES = 10_000
EQUATIONS = 4_000


def text_of_file(path: str | Path, *, errors: str = "strict") -> str:
    """Text of a file.

    Raises:
        OverLimit: the text is longer than `TEXT`.
    """
    try:
        return read_text(path, errors=errors)
    except ValueError as error:
        if isinstance(error, UnicodeDecodeError):
            raise
        raise OverLimit(f"more than {TEXT} characters", f"a text of at most {TEXT}", file=str(path)) from None


def bounded_power(base: Any, exponent: Any) -> Any:
    """Power `base ** exponent`, if it is not a number of more than `DIGITS` digits.

    Raises:
        OverLimit: the power is such a number.
    """
    _hold_power(base, exponent)
    return base**exponent


def bounded_exp(argument: Any) -> Any:
    """Exponential `exp(argument)`, which SymPy turns into a power if the argument contains logarithms of
    numbers.

    Raises:
        OverLimit: the power is a number of more than `DIGITS` digits.
    """
    for term in sympy.Add.make_args(argument):
        coefficient, rest = term.as_coeff_Mul()
        for factor in sympy.Mul.make_args(rest):
            if isinstance(factor, sympy.log):
                _hold_power(factor.args[0], coefficient)
    return sympy.exp(argument)


def _hold_power(base: Any, exponent: Any) -> None:
    if not (isinstance(exponent, sympy.Rational) and isinstance(base, sympy.Expr)):
        return
    digits = _digits(base)
    if digits and digits * abs(int(exponent.p)) > DIGITS * int(exponent.q):
        raise OverLimit("a power that is a number of too many digits", f"at most {DIGITS} digits")


def _digits(base: Any) -> float:
    """Digits of the numbers among the factors of an expression; 0 if all are 1 or -1."""
    if isinstance(base, sympy.Rational):
        largest = max(abs(int(base.p)), int(base.q))
        return 0.0 if largest <= 1 else largest.bit_length() * math.log10(2)
    if base.is_Pow and isinstance(base.exp, sympy.Rational):
        return _digits(base.base) * abs(float(base.exp))
    if base.is_Mul:
        return sum(map(_digits, base.args))
    return 0.0


#: Number of operations and their nesting depth.
Size = tuple[int, int]


def measured(expression: Any, sizes: Callable[[Any], Size | None] = lambda leaf: None) -> Size:
    """Number of operations of an expression when written out, and their nesting depth.

    Common parts are counted at every occurrence, but visited once.

    Arguments:
        expression: Expression to measure.
        sizes: Sizes of the replacements of symbols; None for a symbol that stays.

    Raises:
        OverLimit: a power in it is a number of more than `DIGITS` digits, which SymPy would evaluate during a
            replacement.
    """
    known: dict[Any, Size] = {}
    stack = [(sympy.sympify(expression, strict=True), False)]
    while stack:
        part, visited = stack.pop()
        if part in known:
            continue
        if not part.args:
            known[part] = (sizes(part) if part.is_Symbol else None) or (1, 0)
        elif visited:
            if part.is_Pow:
                _hold_power(*part.args)
            parts = [known[a] for a in part.args]
            known[part] = (1 + sum(p[0] for p in parts), 1 + max(p[1] for p in parts))
        else:
            stack.append((part, True))
            stack.extend((a, False) for a in part.args)
    return known[sympy.sympify(expression, strict=True)]


def hold(size: Size, what: str) -> None:
    """Checks that operations and depth are within their limits.

    Raises:
        OverLimit: one of them is not.
    """
    operations, depth = size
    if operations > OPERATIONS:
        raise OverLimit(f"{what} of more than {OPERATIONS} operations", f"at most {OPERATIONS}")
    if depth > DEPTH:
        raise OverLimit(f"{what} with {depth} operations in each other", f"at most {DEPTH}")


def entries(rows: str, columns: str) -> int:
    """Number of entries of an array, from its numbers of rows and columns.

    Raises:
        OverLimit: a vector of more than `ENTRIES` entries.
    """
    # longer texts are not converted to a number
    number = ENTRIES + 1 if max(len(rows), len(columns)) > 9 else int(rows) * int(columns)
    if number > ENTRIES:
        raise OverLimit(f"an array of {rows[:20]} x {columns[:20]} entries", f"at most {ENTRIES}")
    return number


def hold_brackets(text: str, pairs: Iterable[str] = ("()", "[]", "{}")) -> None:
    """Checks that brackets are not nested too deeply for the parser of Python, which may crash.

    Raises:
        OverLimit: the brackets are nested too deeply.
    """
    steps = {p[0]: 1 for p in pairs} | {p[1]: -1 for p in pairs}
    depth = 0
    for c in text:
        depth += steps.get(c, 0)
        if depth > DEPTH:
            raise OverLimit(f"more than {DEPTH} brackets in each other", f"at most {DEPTH}")


def hold_xml(path: str | Path) -> None:
    """Checks that an XML file is neither too long nor too deep for libSBML, which would end the interpreter.

    Raises:
        OverLimit: the file is too long or too deep, or defines entities, which may grow without bound.
    """
    text = text_of_file(path, errors="replace")
    parser = expat.ParserCreate()
    depth = 0

    def place() -> str:
        return f"line {parser.CurrentLineNumber}"

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > ELEMENTS:
            construct = f"more than {ELEMENTS} elements in each other"
            raise OverLimit(construct, f"at most {ELEMENTS}", place=place(), file=str(path))

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1

    def entity(name: str, *rest: Any) -> None:
        raise OverLimit(f"the entity `{name}`", "XML without its own entities", place=place(), file=str(path))

    parser.StartElementHandler, parser.EndElementHandler, parser.EntityDeclHandler = start, end, entity
    try:
        parser.Parse(text.encode(), True)
    except expat.ExpatError:
        # libSBML reports files that are not XML
        return

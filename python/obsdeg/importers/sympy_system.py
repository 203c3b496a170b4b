"""Systems written with SymPy: from its objects, or from the text that `exporters.to_sympy` writes.

The text defines `rates`, `outputs` and other keys as dictionaries and lists of formulas; it is parsed, never
run.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import sympy  # type: ignore[import-untyped]

from .formula import TIME, Expr, exactly, names_in, parse, shortened, symbol
from .limits import hold, hold_brackets, measured, text_of_file
from .problem import ImportProblem
from .system import State, System

#: Functions in addition to those of formulas.
_CALLS = {"Rational": lambda p, q=sympy.S.One: p / q, "Abs": sympy.Abs}
#: Keys of a text.
KEYS = ("name", "rates", "outputs", "starts", "parameters", "known_inputs", "unknown_inputs", "constants", "definitions")


def system(
    rates: Mapping[Any, Any] | Iterable[Any],
    outputs: Mapping[str, Any],
    *,
    name: str = "system",
    starts: Mapping[Any, Any] | None = None,
    parameters: Iterable[Any] | None = None,
    known_inputs: Iterable[Any] = (),
    unknown_inputs: Iterable[Any] = (),
    constants: Mapping[Any, Any] | None = None,
) -> System:
    """System of SymPy objects.

    Arguments:
        rates: Derivative of every state, by symbol or function `x(t)`, as an expression or the text of a
            formula; or equations `Eq(x(t).diff(t), ...)`.
        outputs: Measured quantities by name.
        starts: Known values at the start by state; `"known"` for a generic value.
        parameters: Unknown constants; by default all other symbols.
        known_inputs: Known functions of time.
        unknown_inputs: Unknown functions of time.
        constants: Known constants: numbers, or None for a generic value.

    Raises:
        ImportProblem: equations that are not solved for a derivative, names without a meaning.
    """
    pairs = dict(rates.items()) if isinstance(rates, Mapping) else dict(_equation(e) for e in rates)
    time = {a for key in pairs if not isinstance(key, str) for a in _expression(key).args if a.is_Symbol}
    if len(time) > 1:
        raise ImportProblem("functions of " + ", ".join(sorted(map(str, time))), "functions of one time")

    applied: dict[str, Expr] = {}

    def plain(value: Any) -> Expr:
        expression = _expression(value)
        # SymPy visits common parts at every occurrence
        hold(measured(expression), "a formula")
        functions = {f: symbol(f.func.__name__) for f in expression.atoms(sympy.core.function.AppliedUndef)}
        applied.update((name.name, f) for f, name in functions.items())
        if expression.has(sympy.Derivative):
            raise ImportProblem(f"`{expression}`", "an equation without derivatives on the right")
        found = expression.xreplace(functions)
        return exactly(found.xreplace(dict.fromkeys(time, TIME)))

    out = System(name)
    for key, value in pairs.items():
        out.states[_label(key)] = State(plain(value))
    for key, value in (starts or {}).items():
        if _label(key) not in out.states:
            raise ImportProblem(f"the start of `{_label(key)}`", "one of a state: " + ", ".join(out.states))
        out.states[_label(key)].start = value if isinstance(value, str) and value == "known" else plain(value)
    out.known_inputs = {_label(u): "generic" for u in known_inputs}
    out.unknown_inputs = {_label(w): "arbitrary" for w in unknown_inputs}
    out.constants = {_label(c): None if v is None else plain(v) for c, v in (constants or {}).items()}
    out.outputs = {str(n): plain(y) for n, y in outputs.items()}
    for name in sorted(applied):
        if name not in (*out.states, *out.known_inputs, *out.unknown_inputs, *out.constants):
            raise ImportProblem(f"`{applied[name]}`, a function without a meaning", "a state, or one of known_inputs or unknown_inputs")
    given = set(out.names())
    formulas = [*(s.rate for s in out.states.values()), *out.outputs.values()]
    formulas += [s.start for s in out.states.values() if s.start is not None and not isinstance(s.start, str)]
    others = sorted(names_in(*formulas) - given)
    if parameters is None:
        out.parameters = dict.fromkeys(others, "")
    else:
        out.parameters = {_label(p): "" for p in parameters}
        if lost := [n for n in others if n not in out.parameters]:
            raise ImportProblem(f"`{lost[0]}`", "a state, parameter, input or constant")
    if not out.outputs:
        raise ImportProblem("no outputs", "what is measured")
    return out


def _expression(value: Any) -> Expr:
    """Expression of SymPy unchanged; a text by the grammar of formulas, since SymPy would run it as Python.

    Raises:
        ImportProblem: the value is neither.
    """
    if isinstance(value, str):
        return parse(value, calls=_CALLS)
    try:
        return sympy.sympify(value, strict=True)
    except sympy.SympifyError:
        construct = f"{type(value).__name__} `{shortened(repr(value))}`"
        raise ImportProblem(construct, "an expression of SymPy, a number or the text of a formula") from None


def _label(key: Any) -> str:
    found = symbol(key) if isinstance(key, str) else _expression(key)
    return str(found.func.__name__ if isinstance(found, sympy.core.function.AppliedUndef) else found)


def _equation(equation: Any) -> tuple[Any, Any]:
    left = getattr(equation, "lhs", None)
    if not isinstance(left, sympy.Derivative) or left.derivative_count != 1:
        raise ImportProblem(f"`{equation}`", "Eq(x(t).diff(t), ...)")
    return left.expr, equation.rhs


def load(path: str | Path) -> System:
    """System of a file that `exporters.to_sympy` wrote, or of a similar file.

    Raises:
        ImportProblem: the file has other statements.
    """
    try:
        return read(text_of_file(path), name=Path(path).stem)
    except ImportProblem as problem:
        raise problem.located(file=str(path)) from None


def read(text: str, *, name: str = "system") -> System:
    """System of a text; otherwise as `load`."""
    hold_brackets(text)
    try:
        tree = ast.parse(text)
    except SyntaxError as error:
        raise ImportProblem(f"`{error.msg}`", "Python", place=f"line {error.lineno}") from None
    except (RecursionError, MemoryError, ValueError):
        expected = "assignments of dictionaries and lists of formulas"
        raise ImportProblem("a text that Python cannot read", expected) from None
    given: dict[str, Any] = {}
    for statement in tree.body:
        match statement:
            case ast.Import() | ast.ImportFrom() | ast.Expr(value=ast.Constant()):
                continue
            case ast.Assign(targets=[ast.Name(id=key)], value=value) if key in KEYS:
                given[key] = _literal(value, text)
            case ast.Assign(value=ast.Call(func=ast.Name(id="symbols" | "Symbol"))):
                continue
            case _:
                source = " ".join((ast.get_source_segment(text, statement) or "").split())
                raise ImportProblem(f"`{source[:60]}`", "symbols, and " + ", ".join(KEYS), place=f"line {statement.lineno}")
    if "rates" not in given or "outputs" not in given:
        raise ImportProblem("no `rates` or no `outputs`", "both")
    definitions = given.get("definitions", {})
    time = {symbol("t"): TIME} if "t" not in {str(s) for s in given["rates"]} else {}
    table = {n: e.xreplace(time) for n, e in definitions.items()}
    known = dict.fromkeys(table)
    out = system(
        given["rates"],
        given["outputs"],
        name=given.get("name", name),
        starts=given.get("starts"),
        known_inputs=given.get("known_inputs", ()),
        unknown_inputs=given.get("unknown_inputs", ()),
        constants={**given.get("constants", {}), **known},
        parameters=given.get("parameters"),
    )
    for n in known:
        del out.constants[n]
    out.definitions = table
    for state in out.states.values():
        state.rate = state.rate.xreplace(time)
    out.outputs = {n: y.xreplace(time) for n, y in out.outputs.items()}
    return out


def _literal(node: ast.expr, text: str) -> Any:
    """Dictionary or list of formulas, text, or None."""
    match node:
        case ast.Dict(keys=keys, values=values):
            return {_key(k, text): _literal(v, text) for k, v in zip(keys, values, strict=True)}
        case ast.List(elts=parts) | ast.Tuple(elts=parts):
            return [_key(p, text) for p in parts]
        case ast.Constant(value=None):
            return None
        case ast.Constant(value=str(words)):
            return words
    try:
        return parse(ast.get_source_segment(text, node) or "", calls=_CALLS)
    except ImportProblem as problem:
        raise problem.located(place=f"line {node.lineno}") from None


def _key(node: ast.expr | None, text: str) -> str:
    match node:
        case ast.Name(id=name) | ast.Constant(value=str(name)):
            return name
    raise ImportProblem("a key that is no name", "a symbol or a text", place=f"line {getattr(node, 'lineno', '?')}")

"""SBML's MathML as formulas: functions expanded, numbers exact."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import libsbml  # type: ignore[import-untyped]
import sympy  # type: ignore[import-untyped]

from .formula import DERIVED, FUNCTIONS, TIME, Expr, exact, put, shortened, symbol
from .limits import DEPTH, bounded_exp, bounded_power, hold, measured
from .problem import ImportProblem


@dataclass(frozen=True)
class Lambda:
    """Function definition: arguments and value."""

    arguments: tuple[str, ...]
    body: Expr


def _log(*args: Expr) -> Expr:
    # log(base, x); with one argument it is the decimal logarithm
    base, x = args if len(args) == 2 else (sympy.Integer(10), args[0])
    return sympy.log(x) / sympy.log(base)


def _root(*args: Expr) -> Expr:
    degree, x = args if len(args) == 2 else (sympy.Integer(2), args[0])
    return bounded_power(x, 1 / degree)


def _chain(relation: Callable[[Expr, Expr], Expr]) -> Callable[..., Expr]:
    return lambda *args: sympy.And(*(relation(a, b) for a, b in itertools.pairwise(args)))


def _minus(*args: Expr) -> Expr:
    return -args[0] if len(args) == 1 else args[0] - args[1]


L = libsbml
_OPERATIONS: dict[int, Callable[..., Expr]] = {
    L.AST_PLUS: lambda *a: sympy.Add(*a),
    L.AST_TIMES: lambda *a: sympy.Mul(*a),
    L.AST_MINUS: _minus,
    L.AST_DIVIDE: lambda a, b: a / b,
    L.AST_POWER: bounded_power,
    L.AST_FUNCTION_POWER: bounded_power,
    L.AST_FUNCTION_ROOT: _root,
    L.AST_FUNCTION_LOG: _log,
    L.AST_FUNCTION_LN: sympy.log,
    L.AST_FUNCTION_EXP: bounded_exp,
    L.AST_FUNCTION_ABS: FUNCTIONS["abs"],
    L.AST_FUNCTION_SIN: FUNCTIONS["sin"],
    L.AST_FUNCTION_COS: FUNCTIONS["cos"],
    L.AST_FUNCTION_TAN: FUNCTIONS["tan"],
    L.AST_FUNCTION_ARCSIN: FUNCTIONS["asin"],
    L.AST_FUNCTION_ARCCOS: FUNCTIONS["acos"],
    L.AST_FUNCTION_ARCTAN: FUNCTIONS["atan"],
    L.AST_FUNCTION_TANH: FUNCTIONS["tanh"],
    L.AST_FUNCTION_SINH: DERIVED["sinh"],
    L.AST_FUNCTION_COSH: DERIVED["cosh"],
    L.AST_FUNCTION_SEC: DERIVED["sec"],
    L.AST_FUNCTION_CSC: DERIVED["csc"],
    L.AST_FUNCTION_COT: DERIVED["cot"],
    L.AST_FUNCTION_MIN: sympy.Min,
    L.AST_FUNCTION_MAX: sympy.Max,
    L.AST_RELATIONAL_LT: _chain(sympy.Lt),
    L.AST_RELATIONAL_LEQ: _chain(sympy.Le),
    L.AST_RELATIONAL_GT: _chain(sympy.Gt),
    L.AST_RELATIONAL_GEQ: _chain(sympy.Ge),
    L.AST_RELATIONAL_EQ: _chain(sympy.Eq),
    L.AST_RELATIONAL_NEQ: sympy.Ne,
    L.AST_LOGICAL_AND: sympy.And,
    L.AST_LOGICAL_OR: sympy.Or,
    L.AST_LOGICAL_NOT: sympy.Not,
    L.AST_LOGICAL_XOR: sympy.Xor,
    L.AST_LOGICAL_IMPLIES: sympy.Implies,
}
_CONSTANTS: dict[int, Expr] = {
    L.AST_CONSTANT_PI: sympy.pi,
    L.AST_CONSTANT_E: sympy.E,
    L.AST_CONSTANT_TRUE: sympy.true,
    L.AST_CONSTANT_FALSE: sympy.false,
    L.AST_NAME_TIME: TIME,
    L.AST_NAME_AVOGADRO: exact("6.02214179e23"),
}


#: Nesting depth of elements above which the depth of the expression is measured; below, the expression cannot
#: be deeper.
MEASURED = DEPTH // 3


def formula(node: Any, functions: Mapping[str, Lambda], place: str) -> Expr:
    """Formula of a MathML tree.

    Arguments:
        node: A `libsbml.ASTNode`, or None if there is no formula.
        functions: The function definitions of the model.
        place: Place of the formula in the model.

    Raises:
        ImportProblem: unsupported construct, or too much work.
    """
    if node is None:
        raise ImportProblem("no formula", "one", place=place)
    # not recursive, since Python's limit is a thousand nested calls; SymPy flattens sums of sums
    stack: list[tuple[Any, bool]] = [(node, False)]
    values: list[tuple[Expr, int]] = []
    while stack:
        here, visited = stack.pop()
        count = here.getNumChildren()
        if not visited and count:
            stack.append((here, True))
            stack.extend((here.getChild(i), False) for i in reversed(range(count)))
            continue
        parts = values[len(values) - count :]
        del values[len(values) - count :]
        height = 1 + max((p[1] for p in parts), default=0)
        try:
            value = _applied(here, [p[0] for p in parts], functions)
            if height > MEASURED or not stack:
                hold(size := measured(value), "a formula")
                height = size[1]
        except ImportProblem as problem:
            raise problem.located(place=place) from None
        values.append((value, height))
    return values[0][0]


def _applied(node: Any, parts: list[Expr], functions: Mapping[str, Lambda]) -> Expr:
    """Expression of a node from those of its children."""
    kind = node.getType()
    if node.isNumber():
        if kind == L.AST_INTEGER:
            return sympy.Integer(node.getInteger())
        if kind == L.AST_RATIONAL:
            return sympy.Rational(node.getNumerator(), node.getDenominator())
        return exact(float(node.getReal()))
    if kind in _CONSTANTS:
        return _CONSTANTS[kind]
    if kind == L.AST_NAME:
        return symbol(node.getName())
    if kind == L.AST_FUNCTION_PIECEWISE:
        if len(parts) % 2 == 0:
            raise ImportProblem("a piecewise function without `otherwise`", "a value at all times")
        return sympy.Piecewise(*zip(parts[0::2], parts[1::2], strict=False), (parts[-1], True))
    if kind == L.AST_FUNCTION:
        name = node.getName()
        if name not in functions:
            raise ImportProblem(f"the function `{name}`", "one that the model defines")
        function = functions[name]
        if len(parts) != len(function.arguments):
            expected = f"{len(function.arguments)} of them, as it is defined"
            raise ImportProblem(f"`{name}` of {len(parts)} arguments", expected)
        return put(function.body, dict(zip(function.arguments, parts, strict=True)))
    if kind in _OPERATIONS:
        return _OPERATIONS[kind](*parts)
    construct = f"`{shortened(L.formulaToL3String(node) or '?')}`"
    names = {L.AST_FUNCTION_DELAY: "the delay ", L.AST_FUNCTION_RATE_OF: "the rate "}
    raise ImportProblem(names.get(kind, "") + construct, "arithmetic, the usual functions, piecewise and time")


def lambdas(model: Any) -> dict[str, Lambda]:
    """Function definitions of a model; each may use earlier ones."""
    out: dict[str, Lambda] = {}
    for definition in model.getListOfFunctionDefinitions():
        name = definition.getId()
        arguments = tuple(definition.getArgument(i).getName() for i in range(definition.getNumArguments()))
        out[name] = Lambda(arguments, formula(definition.getBody(), out, f"the function {name}"))
    return out

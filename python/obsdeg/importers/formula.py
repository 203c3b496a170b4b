"""Formulas: SymPy expressions with exact numbers, read from text and written as obsdeg reads them."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterable, Mapping
from decimal import Decimal
from functools import reduce
from operator import mul
from typing import Any, TypeAlias

import sympy  # type: ignore[import-untyped]

from .limits import DEPTH, FORMULA, LITERAL, WRITTEN, bounded_exp, bounded_power, hold, measured
from .problem import ImportProblem, OverLimit

#: SymPy expression (SymPy has no types of its own).
Expr: TypeAlias = Any

#: Time of a run, 0 at its start. No name in a file has this form.
TIME: Expr = sympy.Symbol("<time>")

#: Functions of one argument in obsdeg, by name.
FUNCTIONS: dict[str, Callable[[Expr], Expr]] = {
    "sin": sympy.sin,
    "cos": sympy.cos,
    "tan": sympy.tan,
    "asin": sympy.asin,
    "acos": sympy.acos,
    "atan": sympy.atan,
    "exp": sympy.exp,
    "log": sympy.log,
    "sqrt": sympy.sqrt,
    "tanh": sympy.tanh,
    "abs": sympy.Abs,
    "sign": sympy.sign,
}
#: Functions that are written by means of those.
DERIVED: dict[str, Callable[..., Expr]] = {
    "ln": sympy.log,
    "log10": lambda x: sympy.log(x) / sympy.log(10),
    "log2": lambda x: sympy.log(x) / sympy.log(2),
    "sinh": lambda x: (bounded_exp(x) - bounded_exp(-x)) / 2,
    "cosh": lambda x: (bounded_exp(x) + bounded_exp(-x)) / 2,
    "sec": lambda x: 1 / sympy.cos(x),
    "csc": lambda x: 1 / sympy.sin(x),
    "cot": lambda x: 1 / sympy.tan(x),
    "atan2": sympy.atan2,
    "min": sympy.Min,
    "max": sympy.Max,
    "power": bounded_power,
    "pow": bounded_power,
}
_READ = {**FUNCTIONS, **DERIVED, "exp": bounded_exp}
_PRINTED = {f: name for name, f in FUNCTIONS.items() if name != "sqrt"} | {sympy.atan2: "atan2"}

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?)"
    r"|(?P<name>[^\W\d][\w!]*)|(?P<sign>\*\*|//|[-+*/^(),]))"
)
#: Number of factors above which a product is formed in one step.
LONG = 64
_SUM, _PRODUCT, _POWER, _ATOM = 1, 2, 3, 4


def exact(number: float | str) -> Expr:
    """Rational number of a decimal text; of a float, the number of its shortest text.

    Raises:
        ImportProblem: the number is infinite or invalid.
    """
    text = repr(float(number)) if isinstance(number, float) else str(number)
    exponent = re.search(r"[eE]([+-]?\d+)\s*$", text[-LITERAL:])
    if len(text) > LITERAL or (exponent and abs(int(exponent.group(1))) > LITERAL):
        expected = f"at most {LITERAL} digits, and exponents of at most {LITERAL}"
        raise OverLimit(f"the number `{shortened(text)}`", expected)
    try:
        return sympy.Rational(text.strip())
    except (TypeError, ValueError):
        raise ImportProblem(f"the number `{text}`", "a finite decimal number") from None


def exactly(expression: Expr) -> Expr:
    """The same expression with rational numbers for its floats, and symbols without assumptions."""
    swaps: dict[Expr, Expr] = {f: exact(float(f)) for f in expression.atoms(sympy.Float)}
    swaps |= {s: sympy.Symbol(s.name) for s in expression.atoms(sympy.Symbol) if s != TIME}
    return expression.xreplace(swaps)


def symbol(name: str) -> Expr:
    """Symbol of a name."""
    return sympy.Symbol(name)


def names_in(*expressions: Expr) -> set[str]:
    """Names in expressions, without the time."""
    found: set[Expr] = set().union(*(sympy.sympify(e).free_symbols for e in expressions))
    return {s.name for s in found if s != TIME}


def put(expression: Expr, values: Mapping[str, Expr]) -> Expr:
    """Replaces names, all at the same time and once each.

    Raises:
        ImportProblem: the result would have too many operations.
    """
    swaps = {s: values[s.name] for s in expression.free_symbols if s != TIME and s.name in values}
    if not swaps:
        return expression
    sizes = {s: measured(e) for s, e in swaps.items()}
    hold(measured(expression, sizes.get), "a formula, with what it names put in,")
    return expression.xreplace(swaps)


def expand(expression: Expr, values: Mapping[str, Expr], what: str) -> Expr:
    """Replaces names by their definitions until none is left.

    Raises:
        ImportProblem: circular definitions.
    """
    for _ in range(len(values) + 2):
        if not names_in(expression) & values.keys():
            return expression
        expression = put(expression, values)
    circle = ", ".join(sorted(names_in(expression) & values.keys()))
    raise ImportProblem(f"{what} through itself ({circle})", "rules that can be put into each other")


def written_names(text: str) -> list[str]:
    """Names in the text of a formula, in its order, without functions; also those that cancel."""
    names = (m for m in _TOKEN.finditer(text) if m.group("name"))
    return [m.group("name") for m in names if not text[m.end() :].lstrip().startswith("(")]


def parse(text: str, *, calls: Mapping[str, Callable[..., Expr]] | None = None, julia: bool = False) -> Expr:
    """Reads ``+ - * / ^ **``, brackets, exact decimals, names and functions.

    Arguments:
        text: The formula.
        calls: Additional functions by name.
        julia: True for the precedence of Julia, whose quotients ``//`` bind before ``*`` and ``/``; a number
            directly in front of a name or bracket multiplies it before all these: ``a/2x`` is ``a/(2*x)``,
            ``2^3x`` is ``2^(3*x)``. The name ``pi`` is one like others.

    Raises:
        ImportProblem: invalid formula, or too much work; the message names the construct.
    """
    if len(text) > FORMULA:
        raise OverLimit(f"a formula of {len(text)} characters", f"at most {FORMULA}")
    return _Reader(text, {**_READ, **(calls or {})}, julia).whole()


class _Reader:
    """Formula from its tokens: numbers as expressions, all others as texts."""

    def __init__(self, text: str, known: Mapping[str, Callable[..., Expr]], julia: bool) -> None:
        self.text, self.known, self.julia = text, known, julia
        self.tokens: list[Expr | str] = []
        #: Tokens without a space before them.
        self.close: set[int] = set()
        self.at = place = 0
        for match in _TOKEN.finditer(text):
            if match.start() != place:
                raise self.refused()
            if not match.group()[:1].isspace():
                self.close.add(len(self.tokens))
            place = match.end()
            number = match.group("number")
            self.tokens.append(exact(number) if number else match.group("name") or match.group("sign"))
        if text[place:].strip():
            raise self.refused()

    def refused(self) -> ImportProblem:
        expected = "a formula of + - * / ^, brackets, numbers, names and functions"
        return ImportProblem(f"`{shortened(self.text)}`", expected)

    def hold(self, depth: int, what: str) -> None:
        if depth > DEPTH:
            construct = f"`{shortened(self.text)}` with more than {DEPTH} {what} in each other"
            raise OverLimit(construct, f"at most {DEPTH}")

    def take(self, *signs: str) -> str | None:
        """Next token if it is one of the given ones."""
        found = self.tokens[self.at] if self.at < len(self.tokens) else None
        if not isinstance(found, str) or found not in signs:
            return None
        self.at += 1
        return found

    def whole(self) -> Expr:
        found = self.sum(0)
        if self.at < len(self.tokens):
            raise self.refused()
        return found

    def sum(self, depth: int) -> Expr:
        self.hold(depth, "brackets")
        terms = []
        sign: str | None = "+"
        while sign:
            factors = [self.quotient(depth)]
            while by := self.take("*", "/", "//"):
                factor = self.quotient(depth)
                factors.append(factor if by == "*" else 1 / factor)
            # SymPy distributes a number over a sum of two factors only; long products are formed in one step
            product = sympy.Mul(*factors) if len(factors) > LONG else reduce(mul, factors)
            terms.append(-product if sign == "-" else product)
            sign = self.take("+", "-")
        return terms[0] if len(terms) == 1 else sympy.Add(*terms)

    def quotient(self, depth: int) -> Expr:
        value = self.factor(depth)
        while self.julia and self.take("//"):
            value = value / self.factor(depth)
        return value

    def factor(self, depth: int) -> Expr:
        minus = False
        while sign := self.take("+", "-"):
            minus ^= sign == "-"
        value = self.atom(depth)
        if self.julia and self.is_coefficient():
            self.hold(depth + 1, "coefficients")
            value = value * self.factor(depth + 1)
        elif self.take("^", "**"):
            self.hold(depth + 1, "powers")
            value = bounded_power(value, self.factor(depth + 1))
        return -value if minus else value

    def is_coefficient(self) -> bool:
        """True if the last token is a number, and a name or bracket follows without a space."""
        if self.at not in self.close or self.at >= len(self.tokens) or isinstance(self.tokens[self.at - 1], str):
            return False
        token = self.tokens[self.at]
        return isinstance(token, str) and (token == "(" or token[0].isalpha() or token[0] == "_")

    def atom(self, depth: int) -> Expr:
        if self.take("("):
            value = self.sum(depth + 1)
            if not self.take(")"):
                raise self.refused()
            return value
        if self.at == len(self.tokens):
            raise self.refused()
        token = self.tokens[self.at]
        self.at += 1
        if not isinstance(token, str):
            if not (self.julia and self.at in self.close) and self.take("("):
                raise ImportProblem(f"the function `{token}`", "one of " + ", ".join(sorted(self.known)))
            return token
        if not (token[0].isalpha() or token[0] == "_"):
            raise self.refused()
        if not self.take("("):
            return sympy.pi if token == "pi" and not self.julia else sympy.Symbol(token)
        arguments = []
        if not self.take(")"):
            arguments.append(self.sum(depth + 1))
            while self.take(","):
                arguments.append(self.sum(depth + 1))
            if not self.take(")"):
                raise self.refused()
        if token not in self.known:
            raise ImportProblem(f"the function `{token}`", "one of " + ", ".join(sorted(self.known)))
        try:
            return self.known[token](*arguments)
        except TypeError:
            raise ImportProblem(f"`{token}` of {len(arguments)} arguments", "as many as it takes") from None


def shortened(text: str) -> str:
    """Text shortened for use in a sentence."""
    text = " ".join(text.split())
    return text if len(text) <= 60 else text[:57] + "..."


def number_text(value: Expr) -> str:
    """Text of a rational number: a decimal of at most 30 digits if possible, otherwise a fraction in
    brackets."""
    p, q = int(value.p), int(value.q)
    sign, rest = "-" if p < 0 else "", q
    for prime in (2, 5):
        while rest % prime == 0:
            rest //= prime
    if rest == 1:
        shift = next(k for k in itertools.count() if 10**k % q == 0)
        digits = str(abs(p) * 10**shift // q)
        figures = digits.rstrip("0") or "0"
        power = len(digits) - len(figures) - shift
        if len(figures) <= 30:
            plain = format(Decimal(f"{figures}e{power}"), "f")
            return sign + (plain if len(plain) <= 12 else f"{figures}e{power}" if power else figures)
    return f"({sign}{_whole(abs(p))}{f'/{_whole(q)}' if q != 1 else ''})"


def _whole(n: int) -> str:
    # obsdeg reads at most 36 digits
    return str(n) if n < 10**30 else f"({_whole(n // 10**30)}*1e30 + {n % 10**30})"


def text_of(expression: Expr, names: Mapping[str, str] | None = None, *, power: str = "^", time: str = "t") -> str:
    """Formula in the notation of obsdeg.

    Arguments:
        expression: The formula.
        names: New names by the old ones.
        power: The sign of powers.
        time: The name of the time.

    Raises:
        ImportProblem: a function or condition that obsdeg does not know.
    """
    names = names or {}
    hold(measured(expression), "a formula")
    written = 0

    def wrap(e: Expr, level: int) -> str:
        text, own = write(e)
        return text if own >= level else f"({text})"

    def factors(parts: Iterable[Expr]) -> tuple[str, str]:
        above, below = [], []
        for part in parts:
            base, exponent = part.as_base_exp() if part.is_Pow else (part, sympy.S.One)
            if exponent.is_Rational and exponent.is_negative:
                below.append(wrap(base ** (-exponent), _POWER))
            else:
                above.append(wrap(part, _POWER))
        return "*".join(above), below[0] if len(below) == 1 else f"({'*'.join(below)})" if below else ""

    def write(e: Expr) -> tuple[str, int]:
        nonlocal written
        written += 1
        if written > WRITTEN:
            # max and min contain their arguments twice
            construct = f"a formula of more than {WRITTEN} operations as obsdeg reads it"
            raise OverLimit(construct, f"at most {WRITTEN}")
        if e == TIME:
            return time, _ATOM
        if e.is_Symbol:
            return names.get(e.name, e.name), _ATOM
        if e.is_Rational:
            text = number_text(e)
            return text, _SUM if text.startswith("-") else _ATOM
        if e is sympy.E:
            return "exp(1)", _ATOM
        if e is sympy.pi:
            return "pi", _ATOM
        if e.is_Add:
            out = ""
            for term in e.args:
                text = wrap(term, _PRODUCT)
                if term.could_extract_minus_sign():
                    out += f" - {wrap(-term, _PRODUCT)}" if out else f"-{wrap(-term, _PRODUCT)}"
                else:
                    out += f" + {text}" if out else text
            return out, _SUM
        if e.is_Mul:
            coefficient, rest = e.as_coeff_Mul()
            if coefficient.is_negative:
                text, _ = write(-e)
                return f"-{text}" if (-e).is_Mul or (-e).is_Atom or (-e).is_Pow or (-e).is_Function else f"-({text})", _SUM
            above, below = factors(rest.args if rest.is_Mul else (rest,))
            if coefficient != 1:
                size = number_text(coefficient)
                above = f"{size}*{above}" if above else size
            return f"{above or '1'}/{below}" if below else above, _PRODUCT
        if e.is_Pow:
            base, exponent = e.args
            if exponent == sympy.S.Half:
                return f"sqrt({write(base)[0]})", _ATOM
            if exponent.is_Rational and exponent.is_negative:
                return f"1/{wrap(base ** (-exponent), _POWER)}", _PRODUCT
            return f"{wrap(base, _ATOM)}{power}{wrap(exponent, _ATOM)}", _POWER
        if isinstance(e, sympy.exp):
            return f"exp({write(e.args[0])[0]})", _ATOM
        if e.func in _PRINTED:
            return f"{_PRINTED[e.func]}({', '.join(write(a)[0] for a in e.args)})", _ATOM
        if isinstance(e, (sympy.Max, sympy.Min)):
            # max(a, b) = (a + b + |a - b|)/2
            first, rest = e.args[0], e.func(*e.args[1:])
            sign = 1 if isinstance(e, sympy.Max) else -1
            return write((first + rest + sign * sympy.Abs(first - rest)) / 2)
        if e.func in (sympy.sinh, sympy.cosh):
            return write(e.rewrite(sympy.exp))
        raise ImportProblem(f"`{shortened(str(e))}`", "+ - * / ^ and " + ", ".join([*FUNCTIONS, "atan2"]))

    return write(sympy.sympify(expression))[0]

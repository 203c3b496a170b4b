"""Numbers as exact decimals and schemes as texts, for requests from Python."""

from __future__ import annotations

import json
import operator
from collections.abc import Iterable, Mapping, Sequence
from decimal import Decimal
from itertools import islice
from json.encoder import encode_basestring_ascii
from numbers import Rational
from typing import Any, NamedTuple, Union

#: Number that is taken exactly: integers, fractions (of SymPy too) and floats by the rule of :func:`exact`; a
#: text as written.
Number = Union[int, float, str, Decimal, Rational]
#: Three Euler angles in degrees, three direction letters (``"NUE"``), or a text as on the command line
#: (``"0,0,0@X_p:360"``).
Attitude = Union[str, Sequence[Number]]
#: Decimals of an angle in degrees: the engine accepts at most nine.
DIGITS = 9
#: Largest number of positions of a scheme.
POSITIONS = 1000


def check_digits(digits: Any) -> None:
    """Checks the number of decimals of computed angles.

    Raises:
        ValueError: neither None nor a number from 0 to nine.
    """
    if digits is not None and (type(digits) is not int or not 0 <= digits <= DIGITS):
        raise ValueError(f"digits: found {digits!r}; expected a whole number from 0 to {DIGITS}, or None")


class Rounded(NamedTuple):
    """A number that was rounded before the verdict."""

    name: str
    """Name of the number, such as ``alpha of position 2`` or ``latitude``."""
    given: str
    """Number as it was given, in degrees."""
    taken: str
    """Number as it was judged, in degrees."""

    def __str__(self) -> str:
        return f"{self.name}: {self.given} taken as {self.taken}"


def _no_number(x: Any) -> TypeError:
    return TypeError(f"found {x!r} of type {type(x).__name__}; expected a number")


def exact(x: Number, digits: int | None = DIGITS) -> str:
    """Decimal text of a number that decides verdicts.

    A computed number (float, `Decimal`, `Fraction`, rational of SymPy) is rounded to `digits` decimals, half
    to even; an `int` and a text stay as they are. None keeps all digits of the shortest text of a float,
    which the engine then refuses beyond nine.

    Raises:
        TypeError: not a number, or a 32-bit or 16-bit float, whose shortest text is not what was written.
        ValueError: not finite, or a fraction without a decimal text if `digits` is None.
    """
    if type(x) is int:
        return str(x)
    if isinstance(x, str):
        return x.strip()
    if isinstance(x, float):
        text = float.__repr__(x)
        whole, point, decimals = text.partition(".")
        if digits is None or not (point and len(decimals) <= digits and whole.lstrip("-").isdigit() and decimals.isdigit()):
            return _rounded(Decimal(text), digits)
        return text
    if isinstance(x, bool):
        raise _no_number(x)
    if isinstance(x, Decimal):
        return _rounded(x, digits)
    kind = type(x).__name__
    if kind.startswith("float"):
        held = f"it holds {Decimal(float(x))}, which may not be what was written" if float(x) == float(x) else "it is no number"
        raise TypeError(f"found {x!r} of type {kind}: {held}, and numbers are exact here; expected a str, int, Decimal or 64-bit float")
    if getattr(x, "is_Float", False):
        # numbers of SymPy
        return exact(float(x), digits)
    try:
        return str(operator.index(x))  # type: ignore[arg-type]
    except TypeError:
        found = _fraction(x)
    if found is None:
        raise _no_number(x)
    return _of_fraction(*found, digits)


def _fraction(x: Any) -> tuple[int, int] | None:
    """Numerator and denominator of a `Fraction` or a rational of SymPy, whose parts are `p` and `q`."""
    parts = (getattr(x, "numerator", None), getattr(x, "denominator", None))
    if callable(parts[0]) or parts[0] is None:
        parts = (getattr(x, "p", None), getattr(x, "q", None))
    try:
        return operator.index(parts[0]), operator.index(parts[1])  # type: ignore[arg-type]
    except TypeError:
        return None


def _rounded(x: Decimal, digits: int | None) -> str:
    if not x.is_finite():
        raise ValueError(f"found {x}; expected a finite number")
    exponent = x.as_tuple().exponent
    if digits is None or not isinstance(exponent, int) or -exponent <= digits:
        return format(x, "f")
    text = format(x, f".{digits}f")
    return _trimmed(text)


def _trimmed(text: str) -> str:
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text == "-0" else text


def _of_fraction(p: int, q: int, digits: int | None) -> str:
    if digits is None:
        from fractions import Fraction

        text = _of_fraction(p, q, 400)
        if Fraction(text) != Fraction(p, q):
            raise ValueError(f"found {p}/{q}, which has no decimal text; expected digits=9, or fewer")
        return text
    scaled, rest = divmod(abs(p) * 10**digits, q)
    scaled += 2 * rest > q or (2 * rest == q and scaled % 2)
    whole, decimals = divmod(scaled, 10**digits)
    return _trimmed(f"{'-' if p < 0 else ''}{whole}.{decimals:0{digits}d}" if digits else f"{'-' if p < 0 else ''}{whole}")


def changed(given: Number, taken: str) -> bool:
    """True if the judged text differs from the given number."""
    if isinstance(given, float):
        text = float.__repr__(given)
        return taken != text and Decimal(taken) != Decimal(text)
    if isinstance(given, Decimal):
        return Decimal(taken) != given
    if getattr(given, "is_Float", False):
        return changed(float(given), taken)
    found = None if isinstance(given, (int, str)) else _fraction(given)
    if found is None or found[1] == 1:
        return False
    from fractions import Fraction

    return Fraction(taken) != Fraction(*found)


def decimal(x: Number) -> str:
    """Decimal with all digits of a number; a 32-bit number of numpy is taken by its shortest text.

    Raises:
        TypeError: not a number.
        ValueError: not finite.
    """
    if type(x).__name__ in ("float32", "float16"):
        return decimal(float(str(x)))
    found = None if isinstance(x, (int, float, str, Decimal)) else _fraction(x)
    if found is not None and found[1] != 1:
        return decimal(found[0] / found[1])
    return exact(x, None)


def attitude(angles: Attitude, digits: int | None = DIGITS, place: int = 1, log: list[Rounded] | None = None) -> str:
    """Attitude in the notation of the command line.

    Args:
        digits: decimals to which computed angles are rounded.
        place: number of the position, from 1.
        log: list to which rounded numbers are added.

    Raises:
        TypeError: not angles.
        ValueError: not three angles.
    """
    if isinstance(angles, str):
        return angles
    if type(angles) not in (tuple, list):
        if isinstance(angles, (bytes, bytearray, set, frozenset, Mapping)) or not isinstance(angles, Iterable):
            raise TypeError(f"position {place}: found the position {angles!r}; expected alpha, beta, gamma in degrees, or letters such as 'NUE'")
        angles = list(angles)
    if len(angles) != 3:
        raise ValueError(f"position {place}: found {len(angles)} angles in {angles!r}; expected alpha, beta, gamma in degrees")
    texts = []
    try:
        for x in angles:
            if type(x) is int:
                texts.append(str(x))
                continue
            text = exact(x, digits)
            if log is not None and changed(x, text):
                log.append(Rounded(f"{('alpha', 'beta', 'gamma')[len(texts)]} of position {place}", str(x), text))
            texts.append(text)
    except (TypeError, ValueError) as e:
        raise type(e)(f"position {place}, {angles!r}: {e}") from None
    return ",".join(texts)


def attitudes(positions: Iterable[Attitude], digits: int | None = DIGITS, log: list[Rounded] | None = None) -> list[str]:
    """Attitudes of positions, in order; computed angles are rounded to `digits` decimals and added to `log`.

    Raises:
        TypeError: not a list of positions.
        ValueError: more positions than a scheme may have.
    """
    if isinstance(positions, (str, bytes, bytearray, set, frozenset, Mapping)) or not isinstance(positions, Iterable):
        raise TypeError(f"angles: found {positions!r}; expected a list of positions, as in [(0, 0, 0), (180, 0, 0)]")
    found = [attitude(a, digits, i, log) for i, a in enumerate(islice(positions, POSITIONS + 1), 1)]
    if len(found) > POSITIONS:
        # a generator may be endless
        raise ValueError(f"angles: found more than {POSITIONS} positions; expected at most {POSITIONS}")
    return found


def assignments(given: Mapping[str, Any] | Iterable[str]) -> list[str]:
    """Numbers by the names of unknowns or families, ``{"D": 0.05}``, in the notation of the command line."""
    if isinstance(given, str):
        return [given]
    if isinstance(given, Mapping):
        return [f"{name}={decimal(value)}" for name, value in given.items()]
    return list(given)


def as_json(value: Any) -> str:
    """Value in JSON: the text of ``json.dumps`` in a third of its time between calls of the engine."""
    kind = type(value)
    if kind is str:
        return encode_basestring_ascii(value)
    if kind is bool:
        return "true" if value else "false"
    if kind is int:
        return str(value)
    if kind is list:
        return f"[{','.join(map(as_json, value))}]"
    if kind is dict:
        return f"{{{','.join([f'{encode_basestring_ascii(k)}:{as_json(v)}' for k, v in value.items()])}}}"
    return json.dumps(value)


def toml(value: Any) -> str:
    """Value in TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        escaped = "".join(c if c >= " " and c not in '"\\' and c != "\x7f" else f"\\u{ord(c):04X}" for c in value)
        return f'"{escaped}"'
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{toml(str(k))} = {toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml(v) for v in value) + "]"
    return decimal(value)

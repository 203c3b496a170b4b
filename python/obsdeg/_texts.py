"""Numbers as exact decimals, schemes as texts: what goes from Python into a request."""

from __future__ import annotations

import json
import operator
from collections.abc import Iterable, Mapping, Sequence
from decimal import Decimal
from json.encoder import encode_basestring_ascii
from typing import Any, Union

#: A decimal number. A float goes through its shortest text, so that 28.2 is 28.2.
Number = Union[int, float, str, Decimal]
#: Three Euler angles in degrees, three direction letters (``"NUE"``), or a text as on the command line (``"0,0,0@X_p:360"``).
Attitude = Union[str, Sequence[Number]]


def decimal(x: Number) -> str:
    """A number as an exact decimal.

    Raises:
        TypeError: not a number; a 32-bit or 16-bit float, whose shortest text is not what was written.
        ValueError: not finite.
    """
    if type(x) is int:
        return str(x)
    if isinstance(x, str):
        return x.strip()
    if isinstance(x, bool):
        raise TypeError(f"found {x!r}; expected a number")
    if isinstance(x, Decimal):
        if not x.is_finite():
            raise ValueError(f"found {x}; expected a finite number")
        return format(x, "f")
    if isinstance(x, float):
        return decimal(Decimal(float.__repr__(x)))
    kind = type(x).__name__
    if kind.startswith("float"):
        held = f"it holds {Decimal(float(x))}, which may not be what was written" if float(x) == float(x) else "it is no number"
        raise TypeError(f"found {x!r} of type {kind}: {held}, and numbers are exact here; expected a str, int, Decimal or 64-bit float")
    try:
        return str(operator.index(x))
    except TypeError:
        raise TypeError(f"found {x!r} of type {kind}; expected a number") from None


def attitude(angles: Attitude) -> str:
    """An attitude as on the command line.

    Raises:
        ValueError: not three angles.
    """
    if isinstance(angles, str):
        return angles
    if isinstance(angles, (bytes, bytearray, set, frozenset, Mapping)) or not isinstance(angles, Iterable):
        raise TypeError(f"found the position {angles!r}; expected alpha, beta, gamma in degrees, or letters such as 'NUE'")
    given = list(angles)
    if len(given) != 3:
        raise ValueError(f"found {len(given)} angles in {angles!r}; expected alpha, beta, gamma in degrees")
    try:
        return ",".join([decimal(x) for x in given])
    except (TypeError, ValueError) as e:
        raise type(e)(f"the position {angles!r}: {e}") from None


def attitudes(positions: Iterable[Attitude]) -> list[str]:
    """Attitudes of positions in their order.

    Raises:
        TypeError: no list of positions.
    """
    if isinstance(positions, (str, bytes, bytearray, set, frozenset, Mapping)) or not isinstance(positions, Iterable):
        raise TypeError(f"angles: found {positions!r}; expected a list of positions, as in [(0, 0, 0), (180, 0, 0)]")
    return [attitude(a) for a in positions]


def assignments(given: Mapping[str, Any] | Iterable[str]) -> list[str]:
    """Numbers by the names of unknowns or families, ``{"D": 0.05}``, as on the command line."""
    if isinstance(given, str):
        return [given]
    if isinstance(given, Mapping):
        return [f"{name}={decimal(value)}" for name, value in given.items()]
    return list(given)


def as_json(value: Any) -> str:
    """A value as JSON: what ``json.dumps`` writes, for a third of what that takes between calls of the engine."""
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
    """A value as TOML."""
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

"""Tasks of a sweep as text: as written by the user, and in canonical form for comparison by value."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Container, Mapping
from decimal import Context, Decimal
from functools import lru_cache
from typing import Any

import obsdeg

from ._files import Text
from ._request import READ
from ._request import plain as plain_option
from ._texts import POSITIONS, _fraction, _of_fraction, _trimmed, exact

_DECIMAL = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)", re.ASCII)
_NUMBER = re.compile(_DECIMAL.pattern + r"([eE][+-]?\d{1,4})?", re.ASCII)
# a drift noise: blanks are ignored, and zero needs no unit
_WITH_UNIT = re.compile(rf"({_NUMBER.pattern})(deg/h|deg/sqrt\(h\))", re.ASCII)


def plain(value: Any) -> Any:
    """JSON value of an object that JSON does not know, with all digits.

    Raises:
        TypeError: JSON cannot represent the value.
    """
    if isinstance(value, Text):
        return value.text
    fraction = None if isinstance(value, (int, float, Decimal)) else _fraction(value)
    if fraction is not None:
        # rounded by the rule of analyze
        value = Decimal(_of_fraction(*fraction, 9))
    if isinstance(value, Decimal):
        # a JSON number, unless a double would lose digits
        number = float(value)
        return number if value.is_finite() and Decimal(repr(number)) == value else str(value)
    if isinstance(value, os.PathLike):
        return str(value)
    if isinstance(value, range):
        return list(value)
    if hasattr(value, "isoformat"):
        return value.isoformat()
    if hasattr(value, "tolist"):
        # arrays and numbers of numpy
        return value.tolist()
    expected = "what JSON can hold, a decimal, an array or a Scheme"
    raise TypeError(f"found {value!r} of type {type(value).__name__}; expected {expected}")


_WRITER = json.JSONEncoder(sort_keys=True, default=plain)


def written(options: Any) -> str:
    """Options as JSON text, as they were given.

    Raises:
        TypeError: JSON cannot represent the value.
    """
    return _WRITER.encode(options)


def checked(task: Any, number: int, reserved: Container[str], taken: Container[str]) -> tuple[dict[str, Any], str]:
    """The task as a dict and as JSON text, checked so that a folder can store it: names of options and tags,
    and text that can be written. No option has a `reserved` name, no tag a `taken` one.

    Raises:
        ValueError: the task is invalid; the message gives its number.
        TypeError: JSON cannot represent the value.
    """
    if not isinstance(task, Mapping):
        raise ValueError(f"task number {number}: found {short(task)}; expected a mapping of options by name")
    for name in task:
        if not isinstance(name, str) or name in reserved:
            raise ValueError(f"task number {number}: found the option {short(name)}; expected the name of an option")
    tags = task.get("tags")
    if tags is not None and not isinstance(tags, Mapping):
        raise ValueError(f"task number {number}: found the tags {short(tags)}; expected values by name")
    for name in tags or ():
        if not isinstance(name, str) or name in taken or name in task:
            expected = "a name of its own, since an option or a column of results has this one"
            raise ValueError(f"task number {number}: found the tag {short(name)}; expected {expected}")
    try:
        text = written(task)
        held = json.loads(text)
        if "\\u" in text:
            json.dumps(held, ensure_ascii=False).encode()
    except TypeError as e:
        raise TypeError(f"{e} (task number {number})") from None
    except (ValueError, RecursionError) as e:
        said = "it is nested too deep" if isinstance(e, RecursionError) else e
        raise ValueError(f"task number {number}: it cannot be written: {said}") from None
    return dict(task), text


def stand_in(task: Any, number: int) -> dict[str, Any]:
    """Record that a folder stores in place of a task that cannot be stored."""
    return {"number": number, "found": short(task)}


def short(value: Any) -> str:
    """Text of a value, at most 200 ASCII characters."""
    try:
        text = ascii(value)
    except (RecursionError, ValueError):
        text = f"<{type(value).__name__}>"
    return text if len(text) <= 200 else text[:197] + "..."


def key(task: Mapping[str, Any]) -> bytes:
    """Digest of a task by value: 0, ``0.0``, ``"0"``, ``Decimal("0.00")`` and numpy's 0 are equal, and a
    missing option equals None.

    Raises:
        TypeError: JSON cannot represent the value.
    """
    return key_of(written(task))


def key_of(text: str) -> bytes:
    """Digest by value of a task that is given as JSON text."""
    as_read = json.loads(text)
    by_value = {name: _canonical(name, value) for name, value in as_read.items() if value is not None}
    return hashlib.sha256(written(by_value).encode()).digest()[:16]


def digest(asked: Any) -> str:
    """Name of a request to this version of the program."""
    return hashlib.sha256(written([obsdeg.__version__, asked]).encode()).hexdigest()[:16]


def _canonical(name: str, value: Any) -> Any:
    if name in ("scheme", "model", "tags"):
        return value
    if name == "angles" and _are_numbers(value):
        try:
            return [f"{_angle(a)},{_angle(b)},{_angle(c)}" for a, b, c in value]
        except ValueError:
            return value
    return _scalar(name, value) if isinstance(value, (str, int, float)) else _read(name, value)


def _read(name: str, value: Any) -> Any:
    try:
        if name == "drift_noise":
            return _drift_noise(str(plain_option(value)))
        return _by_value(READ.get(name, plain_option)(value))
    except (TypeError, ValueError):
        # an invalid option keeps its text here; the error is raised when the task is judged
        return value


#: The tasks of a sweep have few values of an option. 1, 1.0 and True are different keys.
_scalar = lru_cache(maxsize=10_000, typed=True)(_read)


def _are_numbers(angles: Any) -> bool:
    """True for a list of three numbers for each position."""
    if type(angles) is not list or len(angles) > POSITIONS:
        return False
    return all(type(of) is list and len(of) == 3 and all(type(x) in (int, float) for x in of) for of in angles)


def _angle(x: float) -> str:
    """Number as :func:`_by_value` writes it in a list of angles, in a tenth of the time."""
    return str(x) if type(x) is int else _trimmed(exact(x))


def _by_value(value: Any) -> Any:
    """The options of a request with one text per number; a text and a number stay different."""
    if isinstance(value, (list, tuple)):
        return [_by_value(v) for v in value]
    if isinstance(value, bool):
        return value
    if isinstance(value, (int, float)):
        return {"number": _number(repr(value), _NUMBER)}
    if isinstance(value, str):
        return ",".join(map(_part, value.split(",")))
    return value


def _part(text: str) -> str:
    # angles have no exponents, values of unknowns may have them
    name, equals, value = text.rpartition("=")
    return name.strip() + equals + _number(value.strip(), _NUMBER if equals else _DECIMAL)


def _drift_noise(text: str) -> str:
    compact = "".join(text.split())
    found = _WITH_UNIT.fullmatch(compact)
    if found is None:
        return _number(compact, _NUMBER)
    number = _number(found[1], _NUMBER)
    return number if number == "0" else f"{number} {found[found.re.groups]}"


def _number(text: str, form: re.Pattern[str]) -> str:
    if not form.fullmatch(text):
        return text
    number = Decimal(text).normalize(Context(prec=len(text)))
    return format(number, "f") if number else "0"

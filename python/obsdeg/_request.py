"""Requests to the engine: schemes, models and options."""

from __future__ import annotations

import operator
import os
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Union

from ._files import Text, Texted, read_text
from ._model import Model
from ._scheme import Scheme
from ._texts import DIGITS, Attitude, Rounded, as_json, assignments, attitudes, changed, check_digits, decimal, exact

#: Scheme, model, or path of a file with one.
Source = Union[Scheme, Model, str, "os.PathLike[str]", Texted]
#: System to judge: scheme, model, path of a file with one, or positions.
Judged = Union[Source, Iterable[Attitude]]


def _texts(value: Any) -> list[str]:
    return [value] if isinstance(value, str) else list(value)


def plain(value: Any) -> Any:
    """Boolean, text, whole number, list or number in JSON's form."""
    if isinstance(value, (bool, str, int)):
        return value
    if type(value).__name__ in ("bool_", "bool"):
        # booleans of numpy
        return bool(value)
    if hasattr(value, "__index__"):
        return operator.index(value)
    return list(value) if isinstance(value, (list, tuple)) else float(decimal(value))


def _per_axis(value: Any) -> Any:
    several = isinstance(value, (list, tuple)) or getattr(value, "ndim", 0) == 1
    return ",".join(map(decimal, value)) if several else plain(value)


def _max_degree(value: Any) -> list[str]:
    return [str(value)] if isinstance(value, int) else assignments(value)


def _immune(value: Any) -> list[str]:
    names = isinstance(value, (str, list, tuple))
    return _texts(value) if names else assignments(value)


#: Readers of options that differ from their form in JSON.
READ: dict[str, Callable[[Any], Any]] = {
    "angles": attitudes,
    "latitude": exact,
    "filter_latitude": exact,
    "round": decimal,
    "requirement": assignments,
    "bench": assignments,
    "value": assignments,
    "prior": assignments,
    "estimate": assignments,
    "cost": assignments,
    "max_degree": _max_degree,
    "immune": _immune,
    "terms": lambda value: ",".join(_texts(value)),
    "column": _texts,
    "combination": _texts,
    "gimbal": _texts,
    "observable": _texts,
    "profile": _texts,
    "why": _texts,
    "angle_random_walk": _per_axis,
    "rate_random_walk": _per_axis,
    "bias_instability": _per_axis,
}
#: Options that decide verdicts and are read exactly, besides the angles.
_EXACT = ("latitude", "filter_latitude")


def _read(name: str, value: Any) -> Any:
    """Value of an option; errors name it."""
    try:
        return READ.get(name, plain)(value)
    except (TypeError, ValueError, AttributeError) as error:
        text = str(error)
        if not text.startswith("found "):
            text = f"found {value!r} of type {type(value).__name__}; expected {'a text, or a list of texts' if name in READ else 'a number'}"
        kind = ValueError if isinstance(error, ValueError) else TypeError
        raise kind(f"{name}: {text}") from None


def request(options: Mapping[str, Any], digits: int | None = DIGITS, log: list[Rounded] | None = None, **files: Any) -> str:
    """Request in JSON.

    Args:
        options: options by name; None means "not given".
        digits: decimals to which computed angles and latitudes are rounded; None keeps all.
        log: list to which rounded numbers are added.
        files: texts of files, and lists of them; empty ones are omitted.
    """
    if digits != DIGITS or type(digits) is not int:
        check_digits(digits)
    asked: dict[str, Any] = {}
    for name, value in options.items():
        if value is None:
            continue
        if type(value) is bool:
            asked[name] = value
        elif name == "angles":
            asked[name] = attitudes(value, digits, log)
        elif name in _EXACT:
            try:
                text = asked[name] = exact(value, digits)
            except (TypeError, ValueError) as error:
                raise type(error)(f"{name}: {error}") from None
            if log is not None and changed(value, text):
                log.append(Rounded(name, str(value), text))
        else:
            asked[name] = _read(name, value)
    for name, value in files.items():
        if value:
            asked[name] = value
    return as_json(asked)


def are_positions(what: Any) -> bool:
    """True for a list of positions; false for a scheme, a model or the path of a file."""
    return not isinstance(what, (Text, str, os.PathLike)) and not hasattr(what, "text") and isinstance(what, Iterable)


def source(what: Judged, digits: int | None = DIGITS, log: list[Rounded] | None = None, name: str = "scheme.toml") -> dict[str, str]:
    """Entry of a request for a scheme, a model, a file, or positions, which become a scheme with this name.

    Raises:
        TypeError: another type.
    """
    if isinstance(what, Text):
        if log is not None and what.rounded:
            log.extend(what.rounded)
        return what._source()
    if hasattr(what, "text") and hasattr(what, "name"):
        return {"name": str(what.name), "text": str(what.text)}
    if are_positions(what):
        scheme = Scheme(what, digits=digits)  # type: ignore[arg-type]
        return {**source(scheme, digits, log), "name": name}
    if not isinstance(what, (str, os.PathLike)):
        expected = "a Scheme, a Model, the path of a file, or a list of positions"
        raise TypeError(f"found {what!r} of type {type(what).__name__}; expected {expected}")
    file = os.fspath(what)
    return {"name": file, "text": read_text(file)}


def sources(what: Iterable[Judged], digits: int | None, log: list[Rounded]) -> list[dict[str, str]]:
    """Entries of a request for schemes, models and files, in order."""
    several = list(what)
    if len(several) == 1:
        return [source(several[0], digits, log)]
    logs: list[list[Rounded]] = [[] for _ in several]
    found = [source(w, digits, own, f"scheme {i}") for i, (w, own) in enumerate(zip(several, logs, strict=True), 1)]
    names = [of["name"] for of in found]
    for i, (of, own) in enumerate(zip(found, logs, strict=True), 1):
        if names.count(of["name"]) > 1 and isinstance(several[i - 1], Text):
            # objects with the same name, such as none of their own
            of["name"] = f"{of['name'].removesuffix('.toml')} {i}"
        log.extend(r._replace(name=f"{r.name} of {of['name']}") for r in own)
    return found

"""Signatures that name every option, for tab completion and ``inspect.signature``."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, TypeVar

_F = TypeVar("_F", bound=Callable[..., Any])


def named(options: Any) -> Callable[[_F], _F]:
    """Gives a function that takes ``**options`` a signature with the keys of a `TypedDict` as keyword
    parameters.

    Each has the default None, which selects the engine's default.
    """

    def decorated(function: _F) -> _F:
        own = inspect.signature(function)
        plain = [p for p in own.parameters.values() if p.kind is not p.VAR_KEYWORD]
        there = own.parameters.keys()
        kind = inspect.Parameter.KEYWORD_ONLY
        more = [inspect.Parameter(k, kind, default=None, annotation=_text(v)) for k, v in _annotations(options).items() if k not in there]
        function.__signature__ = own.replace(parameters=[*plain, *more])  # type: ignore[attr-defined]
        function.__module__ = "obsdeg"
        return function

    return decorated


def _annotations(options: Any) -> dict[str, Any]:
    # keys of the parents come first
    found: dict[str, Any] = {}
    for base in getattr(options, "__orig_bases__", ()):
        found.update(_annotations(base) if hasattr(base, "__total__") else {})
    return {**found, **options.__annotations__}


def _text(hint: Any) -> str:
    return str(getattr(hint, "__forward_arg__", hint))

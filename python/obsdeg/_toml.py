"""Texts in TOML: Python 3.10 has no reader in its library."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any


def loads(text: str, parse_float: Callable[[str], Any] = float) -> dict[str, Any]:
    """Keys of a text in TOML.

    Raises:
        ValueError: the text is not TOML.
        ImportError: Python 3.10 without the package `tomli`.
    """
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        try:
            import tomli as tomllib
        except ModuleNotFoundError:
            raise ImportError("Python 3.10 reads TOML with the package `tomli`, which is not installed") from None
    return tomllib.loads(text, parse_float=parse_float)

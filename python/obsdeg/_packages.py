"""Optional packages."""

from __future__ import annotations

from importlib.util import find_spec


def check_package(name: str, use: str, extra: str | None = None) -> None:
    """Checks that an optional package is installed.

    Raises:
        ImportError: it is not; the message states what it is needed for and how to install it.
    """
    if find_spec(name) is None:
        command = f"pip install '{extra}'" if extra else f"pip install {name}"
        raise ImportError(f"{use} needs the package `{name}`, which is not installed: {command}")

"""Numbers of a model file by a reader that is independent of the importers, for tests of their output.

Formulas are evaluated by Python itself in decimals of 40 digits (mpmath).
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from typing import Any

import mpmath

mpmath.mp.dps = 40

_NUMBER = re.compile(r"(?<![\w.])((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)")
_FUNCTIONS = {
    n: getattr(mpmath, n) for n in ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "exp", "log", "sqrt", "tanh", "sign")
} | {"abs": abs, "pi": mpmath.pi}

Number = Any


class _Names(dict[str, Any]):
    """Names of a formula: numbers, functions, and definitions, which are evaluated at first use."""

    def __init__(self, numbers: Mapping[str, Number], formulas: Mapping[str, str]) -> None:
        super().__init__(numbers)
        self.formulas = dict(formulas)

    def __missing__(self, name: str) -> Number:
        if name in self.formulas:
            self[name] = value(self.formulas[name], self)
            return self[name]
        return _FUNCTIONS[name]


def value(text: str | float, names: dict[str, Any]) -> Number:
    """Value of a formula."""
    python = _NUMBER.sub(r"mpf('\1')", str(text)).replace("^", "**")
    return eval(python, {"__builtins__": {}, "mpf": mpmath.mpf}, names)


class Numbers:
    """A model file as numbers.

    Arguments:
        text: The file (TOML, scalars).
    """

    def __init__(self, text: str) -> None:
        self.file = tomllib.loads(text)
        self.states = {n: s if isinstance(s, dict) else {"equation": s} for n, s in self.file.get("states", {}).items()}
        self.parameters = list(self.file.get("parameters", {}))
        self.experiments = max(len(self.file.get("experiment", [])), self.file.get("experiments", 1))
        self.segments = max(len(self.file.get("segment", [])), 1)

    def names(self, values: Mapping[str, Number], experiment: int = 0, segment: int = 0, time: Number = 0) -> _Names:
        """All names: states with a given start, parameters and inputs."""
        constants: dict[str, str] = {n: c["value"] if isinstance(c, dict) else c for n, c in self.file.get("constants", {}).items()}
        if "experiment" in self.file:
            constants |= self.file["experiment"][experiment].get("constants", {})
        generic = {n: values[n] for n, c in constants.items() if c == "generic"}
        fixed = _Names(generic, {n: c for n, c in constants.items() if c != "generic"})
        known = {n: fixed[n] for n in constants}
        for step in self.file.get("segment", [])[: segment + 1]:
            known |= {n: value(c, _Names(known, {})) for n, c in step.get("constants", {}).items()}
        return _Names({**known, "t": mpmath.mpf(time), **values}, self.file.get("definitions", {}))

    def rates(self, names: _Names) -> dict[str, Number]:
        """Derivative of every state."""
        return {n: value(s["equation"], names) for n, s in self.states.items()}

    def outputs(self, names: _Names) -> dict[str, Number]:
        """Values of the outputs."""
        texts = {n: y["expression"] if isinstance(y, dict) else y for n, y in self.file["outputs"].items()}
        return {n: value(y, names) for n, y in texts.items()}

    def starts(self, names: _Names) -> dict[str, Number]:
        """Given starts."""
        return {n: value(s["initial"], names) for n, s in self.states.items() if s.get("initial", "known") != "known"}

"""A rank of python-control depends on the units; the verdict of obsdeg does not.

    python examples/other-tools/with_control.py

The cells of a rod exchange heat with their neighbours at 1e-4 1/s = 0.36 1/h. One end of six cells is heated and measured.
`control.obsv` gives the matrix of C, C A, C A^2, ..., whose rows become smaller by 1e-4 each in seconds: its numeric rank is too small.
obsdeg judges the same numbers as exact decimals. A rod of five cells that is measured in the middle is not observable, and obsdeg names
what is observable instead.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any, NamedTuple

import control
import numpy as np
import obsdeg


class Compared(NamedTuple):
    """Rank of the observability matrix by floating-point numbers, and the exact one."""

    numeric: int
    exact: int


def rod(cells: int, rate: str, measured: int) -> Any:
    """State-space model of a rod: heated at the first cell, the temperature of one cell is measured."""
    k = float(rate)
    dynamics = k * (np.eye(cells, k=1) + np.eye(cells, k=-1) - np.diag([1.0, *[2.0] * (cells - 2), 1.0]))
    output = np.eye(1, cells, measured)
    names = [f"T{i + 1}" for i in range(cells)]
    return control.ss(dynamics, np.eye(cells, 1), output, 0, states=names, inputs=["heating"], outputs=["y"])


def model_of(system: Any) -> obsdeg.Model:
    """Model of obsdeg for a state-space model of python-control: x' = A x + B u, y = C x + D u with the numbers as they are written."""

    def row(numbers: Any, names: list[str]) -> list[str]:
        return [f"({Fraction(repr(float(n)))})*{name}" for n, name in zip(numbers, names, strict=True) if n != 0]

    states, inputs, outputs = system.state_labels, system.input_labels, system.output_labels
    derivatives = {x: " + ".join(row(a, states) + row(b, inputs)) or "0" for x, a, b in zip(states, system.A, system.B, strict=True)}
    measured = {y: " + ".join(row(c, states) + row(d, inputs)) or "0" for y, c, d in zip(outputs, system.C, system.D, strict=True)}
    return obsdeg.Model(states=derivatives, outputs=measured, known_inputs=inputs)


def compared(system: Any) -> tuple[Compared, Any]:
    """Both ranks of a system, and the answer of obsdeg."""
    answer = obsdeg.analyze(model_of(system))
    return Compared(int(np.linalg.matrix_rank(control.obsv(system.A, system.C))), answer.rank), answer


def main() -> dict[str, Compared]:
    """The rod in seconds and in hours, and measured in the middle."""
    cases = {"end, seconds": rod(6, "1e-4", 0), "end, hours": rod(6, "0.36", 0), "middle, hours": rod(5, "0.36", 2)}
    found = {}
    print(f"{'measured, unit':<16}{'states':<8}{'rank by control.obsv':<22}rank by obsdeg")
    for name, system in cases.items():
        found[name], answer = compared(system)
        print(f"{name:<16}{system.nstates:<8}{found[name].numeric:<22}{found[name].exact}")
        for function in answer.invariants:
            print(f"{'':<16}observable instead: {function.expression}")
    return found


if __name__ == "__main__":
    main()

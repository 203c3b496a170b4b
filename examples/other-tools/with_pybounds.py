"""pybounds tells how well a state is observable on a trajectory, obsdeg whether it is observable at all, and what is if it is not.

    python examples/other-tools/with_pybounds.py

A camera looks down from a vehicle. It measures the optic flow r = g/d of the ground: speed g, altitude d, known acceleration u.
pybounds simulates, perturbs the start and inverts the Fisher information, with a small number `lam` on its diagonal: no variance exceeds
1/lam, whether the state is unobservable or only weakly observable. The verdict of obsdeg tells which of them it is.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import obsdeg
import pybounds

#: Acceleration in m/s^2, with what is known of it.
CASES = {"none": 0.0, "1e-5 m/s^2": 1e-5, "1 m/s^2": 1.0}
START = {"g": 5.0, "d": 3.0}
#: Standard deviation of a measurement of r in 1/s.
NOISE = 1e-3
LAM = 1e-8


class Compared(NamedTuple):
    """Verdict of obsdeg on a state, and bound of pybounds on its standard deviation."""

    status: str
    degree: int | None
    sigma: float


def sigmas(acceleration: float) -> dict[str, float]:
    """Smallest standard deviations of the states after 50 measurements in 0.5 s, by pybounds."""
    camera = pybounds.Simulator(
        lambda x, u: [u[0], 0.0 * u[0]], lambda x, u: [x[0] / x[1]], dt=0.01, state_names=["g", "d"], input_names=["u"], measurement_names=["r"]
    )
    empirical = pybounds.EmpiricalObservabilityMatrix(camera, START, {"u": np.full(50, acceleration)}, eps=1e-4)
    information = pybounds.FisherObservability(empirical.O_df, R=NOISE**2, lam=LAM)
    variances = np.diag(np.asarray(information.F_inv))
    return {name: float(np.sqrt(v)) for name, v in zip(START, variances, strict=True)}


def verdicts(acceleration: float) -> Any:
    """Answer of obsdeg for a constant acceleration, zero or not."""
    states = {"g": "u" if acceleration else "0", "d": "0"}
    inputs = {"u": "constant"} if acceleration else {}
    return obsdeg.analyze(obsdeg.Model(states=states, outputs={"r": "g/d"}, known_inputs=inputs))


def main() -> dict[str, dict[str, Compared]]:
    """Both for every acceleration."""
    found: dict[str, dict[str, Compared]] = {}
    print(f"{'acceleration':<14}{'state':<7}{'obsdeg':<14}{'degree':<8}{'sigma by pybounds [m/s, m]'}")
    for name, acceleration in CASES.items():
        answer, bounds = verdicts(acceleration), sigmas(acceleration)
        found[name] = {state: Compared(answer[state].status, answer[state].degree, bounds[state]) for state in START}
        for state, (status, degree, sigma) in found[name].items():
            print(f"{name:<14}{state:<7}{status:<14}{'-' if degree is None else degree:<8}{sigma:.3g}")
        for function in answer.invariants:
            print(f"{'':<14}observable instead: {function.expression}")
    return found


if __name__ == "__main__":
    main()

"""The options of the commands: those of the command line in snake case, as types."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from decimal import Decimal
from typing import Literal, TypedDict, Union

from ._texts import Attitude, Number

#: A number that need not be exact.
Real = Union[int, float, Decimal]

Carry = Literal["platform", "inertial", "reset"]
#: One number, or one each for X, Y and Z.
PerAxis = Union[Real, tuple[Real, Real, Real]]
#: Numbers by the names of unknowns or families: ``{"D_FX": 11, "D_I": 5}``.
ByName = Union[Mapping[str, Real], Sequence[str]]
Names = Union[str, Sequence[str]]


class Seeded(TypedDict, total=False):
    """Random choices."""

    seed: int
    """Seed of all random choices [default: 1]."""


class Assumed(TypedDict, total=False):
    """Assumptions that hold for all schemes, whatever their files state."""

    carry: Carry | None
    """Quantity that continues from one position to the next: psi in platform axes, as in the paper, psi in geographic
    axes (real torqued slews), or none (a psi of its own each)."""
    latitude: Number | None
    """Latitude in degrees, exact; left out: generic, or 28.2 where numbers need one."""


class Terms(TypedDict, total=False):
    """Unknowns of the model."""

    terms: Names
    """Unknown terms: F, I, O, S, II, OO, SS, IO, IS, OS (drifts of gyros), GS, GM, GM3 (torquers), K0, K1, M6, M3, K2, K3, Kx (accelerometers), or
    the families gyros, accelerometers, all; or drift for eps^n of one position."""
    axes: Literal["accelerometers", "gyros", "body"]
    """Definition of the platform axes, and so which misalignments the families have."""


class Positions(Assumed, Terms, total=False):
    """Positions, and what is assumed of them."""

    angles: Iterable[Attitude]
    """A position each: Euler angles alpha, beta, gamma in degrees (C_c^n = Mx My Mz), names for any angle, or direction letters (``"NUE"``);
    ``"0,0,0@X_p:360"`` turns from there."""
    combination: Names
    """Linear combinations of unknowns to be judged too, such as ``"D_IX - D_IY"``."""
    path: Literal["one-axis", "gimbals"]
    """Path of the platform from one position to the next: the shortest turn, or alpha, beta, gamma one by one."""
    measured_azimuth: bool
    """The azimuth psi_y^n is measured too."""
    work_limit: int
    """Limit of the work of a verdict on a model, in millions of operations, with half as many bytes [default: 600]."""


class GyroNoise(TypedDict, total=False):
    """The noise of the gyros."""

    angle_random_walk: PerAxis
    """Angle random walk in deg/sqrt(h)."""
    rate_random_walk: PerAxis
    """Rate random walk in deg/h/sqrt(h)."""
    bias_instability: PerAxis
    """Bias instability in deg/h: B of IEEE Std 952."""
    correlation_time: Real
    """Its correlation time in s [default: 3600]."""


class Judged(TypedDict, total=False):
    """Requirements, and the bench that adds to sigmas."""

    requirement: ByName
    """Largest standard deviation allowed at the end, in deg, deg/h, deg/h/g, ppm, arcsec, ug: ``{"D": 0.05}`` [default: none, so that nothing is judged]."""
    bench: ByName
    """Standard deviations of errors that are not estimated, in ug, ppm, arcsec: ``{"K0": 20, "latitude": 10}`` [default: none]. Sigmas that are
    judged are then total."""


class Measured(Judged, total=False):
    """Durations and noise of measurements."""

    dwell: Real
    """Dwell of positions that do not say theirs, in s [default: 1000]."""
    step: Real
    """Largest sampling step in s [default: 10]."""
    noise: Real
    """White noise of Z per sample and axis in g [default: 1e-5]."""
    accelerometer_instability: Real
    """Bias instability of the accelerometers in ug."""
    accelerometer_correlation_time: Real
    """Its correlation time in s [default: 3600]."""
    azimuth_noise: Real
    """Noise of a measured azimuth per sample in deg [default: 0.001]."""
    drift_noise: str
    """Random drift with its unit: ``"0.01 deg/h"`` is a bias held for one step, ``"0.001 deg/sqrt(h)"`` a random walk [default: none in
    predictions, 0.01 deg/h in simulated runs]."""
    prior: ByName
    """Standard deviations beforehand in deg, deg/h, deg/h/g, ppm, arcsec, ug [default: none in predictions]."""


class Filtered(Measured, GyroNoise, total=False):
    """Simulated truth and filter."""

    truth: Literal["linear", "exact"]
    """Equations of the simulated truth: the model itself, or direction cosines."""
    filter: Literal["linear", "extended", "iterated"]
    """The filter [default: linear where its model holds, else iterated]."""
    slew_rate: Real
    """Positions are reached by rotations at this rate in deg/s; inertial carry only."""
    propagation: Literal["exponential", "rk4"]
    """Transition matrix of the filter: the matrix exponential, or Runge-Kutta of fourth order."""
    value: ByName
    """True values in deg, deg/h, deg/h/g, ppm, arcsec, ug."""
    estimate: ByName
    """Initial estimates, likewise."""
    drift_scale: Real
    """Factor on the true drifts and their priors [default: 1]."""


class Analyze(Seeded, Positions, total=False):
    """The options of :func:`obsdeg.analyze`."""

    order: int
    """The highest order of derivatives to look at in a model that has no proven end."""
    count_limit: int
    """Limit of the work of counting the solutions of a model: millions of products at each of two points."""
    relation_limit: int
    """Limit of the work of relations among output derivatives: millions of products at each of two points; 0: none [default: 50]."""
    solutions: bool
    """Solving expressions and numbers of solutions [default: True]."""
    frame: Literal["n", "platform"]
    """Axes of Z in solutions [default: n]."""
    formulas: bool
    """Z and its derivatives, and psi and eps at each position, as formulas."""
    omitted: bool
    """Exact classes (no effect, silent, visible) of the errors that a scheme does not estimate [default: True]."""
    sensitivities: bool
    """Changes of the estimates per unit of each error that a scheme does not estimate, by the weights of the record
    that the scheme states [default: False]."""
    why: Names
    """Unknowns whose verdicts are explained: deciding derivatives, assumptions, and the changes that make each
    observable or lower its degree, in order of cost, each tried."""
    certificate: bool
    """``certificate.json`` among the files of the answer: the witness of the verdicts on one scheme."""
    reduced: bool
    """``reduced.toml`` among the files of the answer: an equivalent model that is fully observable."""


class Simulate(Seeded, Positions, Filtered, total=False):
    """The options of :func:`obsdeg.simulate`."""


class Procedure(Seeded, Positions, Filtered, total=False):
    """The options of :func:`obsdeg.procedure`."""

    settle: Real
    """Time at rest before each recording in s, within the dwell of the position [default: 0]."""
    tilt: Real
    """Tilt that the tolerance of a reading always allows, in degrees [default: 1]."""
    dialect: Literal["generic", "psins"]
    """Table for a controller: every step, or rotations of the PSINS kind [default: generic]."""
    start: str
    """Attitude at the start of a rotation table: ``"alpha,beta,gamma"`` in degrees, or letters [default: 0,0,0]."""


class Crosscheck(Seeded, Positions, Filtered, total=False):
    """The options of :func:`obsdeg.crosscheck`."""

    runs: int
    """Monte Carlo runs [default: 200]."""
    filter_carry: Carry
    """Makes the filter wrong: another carry."""
    filter_latitude: Number
    """Makes the filter wrong: another latitude in degrees."""
    filter_drop: str
    """Makes the filter wrong: it does not know of this position."""


class Compare(Seeded, Assumed, Measured, GyroNoise, total=False):
    """The options of :func:`obsdeg.compare`."""


class Calibrate(Seeded, Assumed, Judged, GyroNoise, total=False):
    """The options of :func:`obsdeg.calibrate`."""

    starts: int
    """Starts of the iteration for a model [default: 16]."""
    profile: Names
    """Unknowns whose profiles are drawn, what the data say of each when all others follow."""
    noise: Real
    """White noise of Z per sample and axis in g [default: that of the scheme]."""
    azimuth_noise: Real
    """Noise of a measured azimuth per sample in deg [default: that of the scheme]."""
    estimate_noise: bool
    """Estimate the noise of every component of Z from what the estimate leaves of it."""
    step: Real
    """Samples within so many s are taken together as one measurement."""
    slew_rate: Real
    """Rate of the turns between positions in deg/s."""
    drift_noise: str
    """Random drift with its unit, as of a simulation."""
    gravity: Real
    """Value of one g, in m/s^2 [default: 9.80665]."""
    gate: Real
    """Probability that no measurement of a right record is left out as an outlier [default: 0.999]."""


class Allan(TypedDict, total=False):
    """The options of :func:`obsdeg.allan`."""

    column: Names
    """Columns to use, by their names [default: all with a unit of a rate or a specific force]."""
    confidence: Real
    """Probability that a confidence band holds a deviation [default: 0.95]."""
    gravity: Real
    """Value of one g, in m/s^2 [default: 9.80665]."""


class Design(Seeded, Assumed, Terms, Measured, total=False):
    """The options of :func:`obsdeg.design` beside those that it names itself."""

    minimum: bool
    """Only find the fewest positions that make every required coefficient observable, with the proof."""
    round: Number
    """With ``candidates="free"``: angles are rounded to multiples of so many degrees [default: 5]."""
    max_turn: Real
    """With ``minimum`` and torquer errors: the largest turn from one position to the next, in degrees [default: 90]."""
    keep: int
    """Number of listed schemes [default: 10]."""
    restarts: int
    """Restarts of the exchange [default: 200]."""
    within: Real
    """Under reset carry: a scheme is enough when it is within so many percent of what is possible at all [default: 0.01]."""
    certificate: bool
    """``certificate.json`` among the files of the answer: the proof of the best sequence, for checkers."""
    refine: bool
    """Move the angles of the best scheme continuously, to hundredths of a degree."""
    divide: bool
    """Divide the total time among the positions of the best scheme."""
    front: Sequence[int]
    """Other numbers of positions for the front of total time against the criterion."""
    check: int
    """With ``merge``: number of blocks of the parts, chosen at random, that are searched again [default: 0]."""
    observable: Names
    """Coefficients or families that must be observable and that the criterion is about [default: all]."""
    max_degree: int | ByName
    """Largest degree, of all required coefficients or by name: ``1``, ``{"D_F": 1}``."""
    immune: Names | ByName
    """Only schemes that are immune to errors that they do not estimate: without effect, ``"K0"``, or shown at 3 sigma
    from a size on, ``{"K0": 20}``."""
    criterion: Literal["worst", "a", "d", "e", "margin"]
    """Criterion by which a scheme is better: the largest sigma, trace, determinant, largest eigenvalue, or the largest sigma over its requirement."""
    meet: bool
    """Only schemes that meet every stated requirement."""
    max_time: Real
    """Largest total time with slews in s."""
    max_slew: Real
    """Longest slew between successive positions in s."""
    slew_rate: Real
    """Positions are reached by rotations at this rate in deg/s; inertial carry only."""
    gimbal: Names
    """Limits of the gimbal angles in degrees: ``["alpha=-90:90", "beta=-80:80"]``; alpha is the outer gimbal, about
    North, beta the middle one, gamma the inner one, about Z_p. Schemes have angles within the limits."""


class Measure(Seeded, total=False):
    """The options of :func:`obsdeg.measure` beside those that it names itself."""

    observable: Names
    """Unknowns that must be observable [default: all]."""
    max_degree: int | ByName
    """Largest degree, of all required unknowns or by name: ``4``, ``{"k1": 4}``."""
    unique: bool
    """True: every required unknown must have one solution (globally identifiable); a number that is not decided counts as several."""
    cost: ByName
    """Costs of candidates by their names, above 0 [default: those of the file, or 1]: ``{"x1": 2.5}``."""
    keep: int
    """Number of minimal sets that are listed [default: 10]."""
    order: int
    """The highest order of derivatives to look at in a model that has no proven end."""
    work_limit: int
    """Limit of the work of a verdict, in millions of operations [default: 600]; the search may take fifty times as much."""


class NextMeasurement(Seeded, Assumed, Terms, Measured, total=False):
    """Options of :func:`obsdeg.next_measurement`."""

    observable: Names
    """Coefficients or families that must be observable and are compared [default: all]."""
    keep: int
    """Number of listed extensions [default: 10]."""
    max_time: Real
    """Largest total time with slews in s."""
    max_slew: Real
    """Longest slew to an added position in s."""
    slew_rate: Real
    """Positions are reached by rotations at this rate in deg/s; inertial carry only."""
    gimbal: Names
    """Limits of the gimbal angles in degrees: ``["alpha=-90:90"]``."""


class Report(Seeded, Assumed, Filtered, total=False):
    """The options of :func:`obsdeg.report`."""

    runs: int
    """Monte Carlo runs of the evidence [default: 100]."""

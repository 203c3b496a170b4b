"""Types of answers: a class for each type of JSON. Written by `python/tools/write_shapes.py`, not by hand."""

from __future__ import annotations

from typing import Literal, Union

from ._records import Record, Shape

Carry = Literal["platform", "inertial", "reset"]
"""Carry: quantity that continues from one position to the next (the paper does not state it). platform: Platform carry: `psi^c`
continues, as in the paper's simulation. inertial: Inertial carry: `psi^n` continues, as in real torqued slews. reset: Reset carry:
`psi` is a new unknown at each position.
"""

SignedAxis = str
"""Signed platform axis such as `+x` or `-z`."""


class GyroAxes(Record):
    """Axes of one gyro: input I, output O, spin S, as signed platform axes."""

    __slots__ = ()

    I: SignedAxis
    """Input axis of the gyro, a signed platform axis."""
    O: SignedAxis
    """Output axis of the gyro, a signed platform axis."""
    S: SignedAxis
    """Spin axis of the gyro, a signed platform axis."""


class Accelerometers(Record):
    """Input axes of the accelerometers as signed platform axes; X_p, Y_p, Z_p by default."""

    __slots__ = ()

    X: SignedAxis
    """Input axis of accelerometer X, whose coefficients end in X or have it first."""
    Y: SignedAxis
    """Input axis of accelerometer Y, a signed platform axis."""
    Z: SignedAxis
    """Input axis of accelerometer Z, a signed platform axis."""


class Geometry(Record):
    """Mounting of the X, Y and Z gyro. The default is the paper's, as it follows from its (22), (23), (27) and (28)."""

    __slots__ = ()

    X: GyroAxes
    """Axes of the gyro whose coefficients end in X."""
    Y: GyroAxes
    """Axes of the gyro whose coefficients end in Y."""
    Z: GyroAxes
    """Axes of the gyro whose coefficients end in Z."""
    accelerometers: Accelerometers | None
    """Input axes of the accelerometers; X_p, Y_p, Z_p when left out."""

AngleReport = Union[float, str]
"""Angle in degrees, or name of a generic angle."""


class Turn(Record):
    """Turn of the platform about a fixed axis."""

    __slots__ = ()

    about: tuple[float, float, float]
    """Axis of the turn: a unit vector (North, Up, East), dimensionless."""
    angle_deg: float
    """Angle of the turn in degrees, right-handed about the axis, above 0."""


class PositionReport(Record):
    """Position of the scheme, with gravity in platform axes."""

    __slots__ = ()

    name: str
    """Name of the position in the scheme."""
    angles_deg: tuple[AngleReport, AngleReport, AngleReport]
    """Euler angles alpha, beta, gamma in degrees, or names of generic angles."""
    attitude: str | None
    """Directions of X_p, Y_p, Z_p for a cardinal attitude, as in 'NUE'; null for others."""
    rotation: str | None
    """Rotation that starts at the position, such as `X_p:360`; null for none."""
    turns: list[Turn]
    """Turns from the position before to this one, where torquer errors act on them."""
    g_c: tuple[float, float, float] | None
    """Gravity in platform axes (at the start of a rotation), in g; null for generic angles."""


class StationLabel(Record):
    """Label, in formulas, of a station: a point at which derivatives of Z are taken."""

    __slots__ = ()

    label: str
    """Label in formulas: `p1`, `'about X'`, `p1[45 deg]`."""
    position: str
    """Name of the position or rotation."""
    turned_deg: float | None
    """Angle of the rotation at this station, in degrees, right-handed; null for a position at rest. Derivatives of Z at such a station
    are those of a turning platform, not of one that stopped there.
    """
    about: str | None
    """Axis of the rotation: `X_p`, `Y_p`, `Z_p`, `N`, `U` or `E`; null for a position at rest."""
    rate: str | None
    """Rate of turning in formulas, such as `w@p1`: the derivative of that angle by time, in rad/s; null for a position at rest."""

Status = Literal["observable", "inseparable", "not_excited", "not_seen"]
"""Verdict on an unknown or a combination. observable: Observable: the unknown is in the span of the derivative rows. inseparable:
Inseparable: it affects Z, but only together with its partners. not_excited: Not excited: it does not affect Z at all. not_seen: Not
resolved up to the bound on the order; a higher order may resolve it. For systems with special starts, jumps or arbitrary inputs.
"""


class SolutionTerm(Record):
    """Term of a solution, machine-readable."""

    __slots__ = ()

    coefficient: str
    """Coefficient with its sign, such as `-wU*w@p1/(2*wN)`; decimals with all their digits."""
    observation: str
    """Derivative of the observation, such as `Z1'`."""
    station: str
    """Label of the station at which the derivative is taken."""

Form = Literal["exact", "symbolic", "decimal"]
"""Form of a printed coefficient. exact: Rational numbers and square roots, exact. symbolic: Sines and cosines of angles. decimal:
Decimals, rounded to six places (small ones to six digits).
"""

FoundBy = Literal["prime_fields", "symbolic_engine", "floating_point"]
"""Source of the coefficients of a solution. prime_fields: Numbers `a + b sqrt 2 + c sqrt 3 + d sqrt 6`, and these times short products
of sines and cosines, recovered from their images in two prime fields. symbolic_engine: Formulas in sines and cosines, solved by the
symbolic engine; their images in the prime fields are the same. floating_point: Decimals from floating-point arithmetic.
"""

Verification = Literal["symbolic", "modular", "numeric"]
"""Check that a solution passed before it was printed. symbolic: Exact substitution of the derivatives of Z, and substitution in two
prime fields. modular: Substitution in two prime fields. numeric: Substitution in floating point: residual below 1e-9 of the sum of
magnitudes.
"""


class Solution(Record):
    """Solving expression of an unknown or a combination."""

    __slots__ = ()

    text: str
    """Solving expression in one line."""
    terms: list[SolutionTerm]
    """Terms of the solving expression, one by one."""
    turning: bool
    """True if derivatives in it are taken while the platform turns: at stations with a rate."""
    form: Form
    """Form of its coefficients: exact, symbolic or decimal."""
    found_by: FoundBy
    """Source of its coefficients: prime fields, symbolic engine or floating point."""
    verification: Verification
    """Check that the expression passed before it was printed."""


class Elsewhere(Record):
    """Observable degrees of an unobservable unknown under other conditions; each is null if the unknown stays unobservable or the
    condition is the given one.
    """

    __slots__ = ()

    other_latitudes: int | None
    """Observable degree at other latitudes; null unless the given one is special (equator, pole), or if unobservable there too."""
    other_angles: int | None
    """Observable degree with the same number of positions at generic angles; null if unobservable there too, or if they were not judged."""


class Quantity(Record):
    """Verdict on one unknown of a scheme."""

    __slots__ = ()

    name: str
    """Name of the unknown, as in the model."""
    unit: str
    """Unit of the unknown: deg, deg/h, deg/h/g, ..."""
    status: Status
    """Verdict: observable, inseparable or not excited."""
    degree: int | None
    """Observable degree: the smallest order of derivatives that determines the unknown; null if it is not observable."""
    accuracy_order: int | None
    """Accuracy order: the best error falls with the dwell T as T^-(order + 1/2); null if no dwell makes it observable."""
    partners: list[str]
    """Unknowns indistinguishable from it: those in a common unobservable direction of minimal support."""
    solution: Solution | None
    """Solving expression of the unknown; null if there is none."""
    elsewhere: Elsewhere | None
    """Degrees under conditions where the unknown is observable; null if it is observable, or under none of them."""


class CombinationReport(Record):
    """Observable combination of unknowns, or one that was asked for."""

    __slots__ = ()

    expression: str
    """Combination of unknowns, as an expression."""
    requested: bool
    """True if the combination was asked for."""
    status: Status
    """Verdict: observable, inseparable or not excited."""
    degree: int | None
    """Observable degree of the combination; null if it is not observable."""
    accuracy_order: int | None
    """Accuracy order of the combination, as of an unknown; null if no dwell makes it observable."""
    solution: Solution | None
    """Solving expression of the combination; null if there is none."""


class Component(Record):
    """Component of a null vector."""

    __slots__ = ()

    name: str
    """Name of the unknown, as in the model."""
    coefficient: str | None
    """Coefficient of the unknown in the null vector; null if it was not computed."""


class Verdict(Record):
    """Verdict on one unknown: status and degree."""

    __slots__ = ()

    status: Status
    """Status: observable, inseparable, not excited or not seen."""
    degree: int | None
    """Observable degree of the unknown; null if it is not observable."""


class Difference(Record):
    """Verdict that depends on the carry."""

    __slots__ = ()

    name: str
    """Name of the unknown whose verdict differs."""
    here: Verdict
    """Verdict under the carry of the scheme, or at generic angles."""
    there: Verdict
    """Verdict under the other carry, or at the special angles."""


class CarryReport(Record):
    """Verdicts of the scheme under another carry."""

    __slots__ = ()

    carry: Carry
    """Carry for which these verdicts hold."""
    rank_profile: list[int]
    """Rank profile under this carry: dim V_0, dim V_1, ..."""
    unknowns: int
    """Number of unknowns under this carry."""
    differs: list[Difference]
    """Unknowns of both carries whose verdict differs."""

OmittedClass = Literal["no_effect", "silent", "visible"]
"""Class of an omitted error for one scheme. Exact: no noise, no weights. no_effect: Error that enters no sample: every estimate is
immune, whatever the weights. silent: Error whose effect on all samples equals that of a change of the unknowns: no record of the
scheme shows it, and estimates change by exactly that. visible: Error that no change of the unknowns imitates: a record shows it if it
is large enough.
"""


class ExactChange(Record):
    """Exact change of one unknown by a silent error."""

    __slots__ = ()

    unknown: str
    """Name of the unknown whose estimate changes."""
    change: str
    """Change of the estimate as a multiple of the error, in SI units (rad, rad/s, g), such as `-wN*K0_X`."""


class OmittedVerdict(Record):
    """Verdict on one omitted error."""

    __slots__ = ()

    name: str
    """Name of the error, such as `K0_X`, `latitude` or `attitude_x@2`."""
    family: str
    """Family of the error, such as `K0` or `latitude`."""
    unit: str
    """Unit of the error: ug, ppm, arcsec, ..."""
    class_: OmittedClass
    """Exact class of the error: no effect, silent or visible."""
    changes: list[str]
    """Unknowns that a silent error changes, among those that the samples determine, by name; empty for other classes."""
    exact: list[ExactChange] | None
    """Exact changes of these unknowns, where they are numbers with roots times powers of wN and wU; null if they are not, or for other
    classes.
    """


class OmittedVerdicts(Record):
    """Verdicts on everything that a scheme does not estimate."""

    __slots__ = ()

    terms: list[OmittedVerdict]
    """Verdicts in the order of the error model."""
    torquers_in_turns: bool
    """True if torquer errors act in the stated turns; otherwise they act at the earth rate alone."""
    error_bound: float
    """Bound on the probability that any of the classes is wrong."""


class ChangeKnown(Record):
    """Known value of an unknown: of a parameter, of psi or a coefficient, of a state at the start of every experiment, of an input at
    all times.
    """

    __slots__ = ()

    kind: Literal["known"]
    name: str
    """Name of the unknown whose value is given."""


class ChangeOutput(Record):
    """State that becomes one more output of the model."""

    __slots__ = ()

    kind: Literal["output"]
    state: str
    """Name of the state that becomes an output."""


class ChangeAttitude(Record):
    """Position that is added at the end of the scheme."""

    __slots__ = ()

    kind: Literal["attitude"]
    position: str
    """Name of the position that is added."""
    attitude: str
    """Cardinal attitude: directions of X_p, Y_p and Z_p."""


class ChangeCarry(Record):
    """Carry between positions that replaces the scheme's own."""

    __slots__ = ()

    kind: Literal["carry"]
    carry: Carry
    """Carry of the changed scheme."""

Change = Union[ChangeKnown, ChangeOutput, ChangeAttitude, ChangeCarry]
"""Change of a scheme or model."""


class Resolved(Record):
    """Unknown that a remedy makes observable."""

    __slots__ = ()

    name: str
    """Name of the resolved unknown."""
    degree: int
    """Observable degree of the unknown after the change."""


class Remedy(Record):
    """Change of the scheme or model, or two changes that are needed together."""

    __slots__ = ()

    changes: list[Change]
    """Changes that resolve the unknowns, one or two."""
    resolves: list[Resolved]
    """Unknowns that are observable with the changes and not without them, in model order; without those whose value is given."""
    loses: list[str]
    """Unknowns that are observable without the changes and not with them: possible under another carry only."""


class Remedies(Record):
    """Remedies of the unknowns that are not observable."""

    __slots__ = ()

    remedies: list[Remedy]
    """Remedies, each tried by the exact engine: single changes first, then pairs for unknowns that no single change resolves."""
    unresolved: list[str]
    """Unobservable unknowns without a remedy: of the changes that were tried only the value of the unknown itself resolves them."""
    not_tried: list[str]
    """Candidates left out because of the limits on the work, one sentence for each kind; empty when all were tried."""
    verdicts: int
    """Number of changed schemes or models that the exact engine judged."""


class OutputDerivative(Record):
    """Time derivative of an output."""

    __slots__ = ()

    output: str
    """Output: `Z1` (north), `Z2` (up), `Z3` (east) in local geographic axes, `Za` of a measured azimuth, or the name of an output of a
    model.
    """
    order: int
    """Order of the derivative by time."""
    place: str | None
    """Position of the scheme, or segment or experiment of the model (`segment 2`, `experiment 1`); null for a model with one of each."""


class UnseenDirection(Record):
    """Direction in which unknowns change together while no output derivative up to an order changes. Every component is needed: in a
    direction of fewer of these unknowns a derivative changes.
    """

    __slots__ = ()

    up_to_order: int
    """Highest order of the output derivatives that do not change."""
    at_every_order: bool
    """True if no derivative of any order changes."""
    components: list[Component]
    """Unknowns that change, with the coefficients of the direction; the unknown itself first, with 1."""
    seen_by: list[OutputDerivative]
    """Derivatives of the next order, out of `determined_by`, that change along the direction; empty if the unknown is not observable."""

AssumptionKind = Literal[
    "carry",
    "latitude",
    "angles",
    "azimuth",
    "position",
    "output",
    "known_start",
    "known_constant",
    "known_input",
    "constraint",
]
"""Kind of an assumption of a verdict. carry: Carry between positions of the scheme. latitude: Latitude: generic, or the stated one.
angles: Angles of the positions of the scheme. azimuth: Azimuth as a measured output. position: Presence of a position in the scheme.
output: Presence of an output in the model. known_start: Known initial value of a state. known_constant: Known constant of the model.
known_input: Known input function of the model. constraint: Constraint that the model states.
"""


class Otherwise(Record):
    """Verdict under another condition."""

    __slots__ = ()

    condition: str
    """Condition that replaces the assumption: `inertial`, `pole`, `without it`, `unknown`."""
    degree: int | None
    """Observable degree of the unknown under the condition; null if it is not observable."""


class Assumption(Record):
    """Assumption of a verdict, and verdicts without it."""

    __slots__ = ()

    kind: AssumptionKind
    """Kind of the assumption, such as carry."""
    stated: str
    """Assumption as stated: `platform`, `48.2 deg`, `p2`, `x1`."""
    otherwise: list[Otherwise]
    """Verdicts under other conditions."""
    decides: bool
    """True if the degree differs under one of the other conditions: the verdict rests on the assumption."""


class Improvement(Record):
    """Change that makes an unknown observable or lowers its degree."""

    __slots__ = ()

    changes: list[Change]
    """Changes, one or two that are needed together."""
    degree: int
    """Observable degree of the unknown with the changes."""
    resolves: list[Resolved]
    """Other unknowns that are observable with the changes and not without them, without those whose value is given."""
    loses: list[str]
    """Unknowns that are observable without the changes and not with them: possible under another carry only."""


class Why(Record):
    """Explanation of the verdict on one unknown."""

    __slots__ = ()

    name: str
    """Name of the unknown that the explanation concerns."""
    status: Status
    """Verdict: observable, inseparable, not excited, or not resolved up to the bound on the order."""
    degree: int | None
    """Observable degree of the unknown; null if it is not observable."""
    determined_by: list[OutputDerivative]
    """Output derivatives that determine the unknown, with the constraints and the known quantities (of a scheme: the unknown is a linear
    combination of the derivatives); none of the derivatives can be left out. Other sets of derivatives may do the same. Empty if the
    unknown is not observable, or if `not_explained` has the reason.
    """
    unseen: UnseenDirection | None
    """Unobserved direction: proof that no lower order, or no order at all, is enough; null for degree 0."""
    symmetries: list[str]
    """Symmetries that change the unknown and leave every output unchanged, in words; empty for schemes."""
    assumptions: list[Assumption]
    """Assumptions of the verdict, each with the verdicts without it."""
    remedies: list[Improvement]
    """Changes that make the unknown observable, or lower its degree, each tried by the exact engine. In order of cost: a value known,
    one more position, one more output, another carry, two changes; those of one kind by the degree that they lead to. Two changes are
    listed only if no single one makes the unknown observable.
    """
    not_explained: list[str]
    """Parts of the explanation that are missing and changes that were not tried, one sentence each; empty if there are none."""
    verdicts: int
    """Number of changed schemes or models that the exact engine judged."""


class Locus(Record):
    """Condition on generic angles, and its effect on the verdicts."""

    __slots__ = ()

    condition: str
    """Condition: `alpha = 0, 180 deg`, `alpha = -beta`, or a polynomial in tangents of half angles that vanishes; one that is too long
    to print is described.
    """
    points_deg: list[dict[str, float]]
    """Points on the locus, in degrees by angle: all of them when `complete`, examples otherwise."""
    complete: bool
    """True if the condition is on a single angle and `points_deg` certainly holds all its values."""
    rank_profile: list[int]
    """Rank profile at a general point of the locus."""
    changes: list[Difference]
    """Unknowns whose verdict changes on the locus."""


class Formula(Record):
    """Formula of Z or of one of its derivatives."""

    __slots__ = ()

    position: str | None
    """Label of the station; null for formulas that hold at every station."""
    left: str
    """Left side of the formula, such as `Z1'`."""
    right: str
    """Right side of the formula."""

Frame = Literal["n", "platform"]
"""Axes in which Z is printed in solutions. n: Local geographic axes, as in the paper: `Z1` and `Z3` (`Z2` is zero). platform: Platform
axes: `Zx`, `Zy`, `Zz`.
"""


class BeyondLimits(Record):
    """Position written with angles beyond a gimbal limit."""

    __slots__ = ()

    position: str
    """Name of the position in the scheme."""
    angles: str
    """Euler angles as written, in degrees."""
    within: str
    """Euler angles of the same attitude within the limits, in degrees."""


class GimbalStop(Record):
    """Obstacle of a turn about one axis: a gimbal reaches its limit, or near `beta = +-90` degrees alpha and gamma would have to turn
    more than a hundred times as fast as the platform.
    """

    __slots__ = ()

    gimbal: str | None
    """Gimbal that reaches its limit: alpha, beta or gamma; null near `beta = +-90` degrees."""
    at_deg: float
    """Limit that is reached, in degrees; without a gimbal, beta in degrees."""
    after_deg: float
    """Angle that the platform has turned by when it stops, in degrees."""


class GimbalTurn(Record):
    """Turn of the platform, followed from gimbal angles within the limits."""

    __slots__ = ()

    position: str
    """Name of the position that the turn leads to, or whose rotation it is."""
    rotation: bool
    """True for the rotation of a segment."""
    by_gimbals: bool
    """True if the scheme states that the platform turns gimbal by gimbal."""
    turn: Turn | None
    """Turn about one axis; null if the attitude stays the same, or gimbal by gimbal."""
    stays: bool
    """True if all gimbal angles stay within their limits during the turn; gimbal by gimbal, judged by the angles as written."""
    stop: GimbalStop | None
    """Obstacle of the turn about one axis; null if it stays within the limits, and gimbal by gimbal."""
    ends_deg: tuple[float, float, float] | None
    """Gimbal angles at the end of the turn in degrees (alpha, beta, gamma); null if it stops, or ends at the angles listed."""
    gimbals_deg: tuple[float, float, float] | None
    """Changes of alpha, beta and gamma, in degrees, of the slew path gimbal by gimbal (`path = 'gimbals'`) between angles within the
    limits, which stays within them; null for a rotation.
    """


class GimbalReport(Record):
    """Gimbal limits of a scheme, with the angles and turns that exceed them."""

    __slots__ = ()

    limits: str
    """Gimbal limits in words, in degrees."""
    beyond: list[BeyondLimits]
    """Positions written with angles beyond a limit, each with angles of the same attitude within the limits."""
    turns: list[GimbalTurn]
    """Turns to every position but the first, and rotations of segments; empty for generic angles."""


class Certainty(Record):
    """Certainty of the verdicts: method, error bound, primes and seed."""

    __slots__ = ()

    method: str
    """Method of the verdicts, in words."""
    error_bound: float
    """Bound on the probability that any verdict is wrong."""
    primes: tuple[str, str]
    """Random primes of the two prime fields, as text (61 bits)."""
    seed: int
    """Seed of all random choices."""


class EngineBusy(Record):
    """Mark of an answer without the solutions that need the symbolic engine, because other processes held it. The verdicts do not depend
    on it.
    """

    __slots__ = ()

    waited_s: int
    """Time after which the wait for the engine ended, in s."""
    advice: str
    """Advice on how to get the missing solutions."""


class AccelerometerBias(Record):
    """Bias instability of the accelerometers: a first-order Gauss-Markov process of each, which continues in platform axes."""

    __slots__ = ()

    instability_ug: float
    """Coefficient B of the bias instability, in ug; sigma of the process is 1.076 B."""
    correlation_time_s: float
    """Correlation time of the process, in s."""

PerGyro = tuple[float, float, float]
"""Noise of the X, Y and Z gyro, in the unit of the key; zero for none."""


class GyroNoise(Record):
    """Noise of the gyros X, Y, Z by their datasheet."""

    __slots__ = ()

    angle_random_walk_deg_sqrt_h: PerGyro
    """Angle random walk of each gyro, in deg/sqrt(h)."""
    rate_random_walk_dph_sqrt_h: PerGyro
    """Rate random walk of each gyro, in deg/h/sqrt(h)."""
    bias_instability_dph: PerGyro
    """Bias instability of each gyro, in deg/h: the coefficient B of IEEE Std 952, whose Allan floor is 0.664 B."""
    correlation_time_s: float
    """Correlation time, in s, of the Gauss-Markov process that represents the bias instability."""


class MeasurementReport(Record):
    """Conditions of predicted sigmas: the information of all samples with the noise, the random drift and the priors that are stated."""

    __slots__ = ()

    latitude_deg: float
    """Latitude of the scheme, in degrees."""
    latitude_by_default: bool
    """True if the program chose the latitude."""
    dwell_s: float
    """Dwell, in s, of positions that do not state their own."""
    step_s: float
    """Largest step between samples in s; a position is divided into equal steps."""
    settle_s: float | None
    """Time at the start of each position at rest, in s, whose samples do not count; left out where all count."""
    accelerometer_noise_g: float
    """Noise of the observation per sample and axis, in g."""
    accelerometer_bias: AccelerometerBias | None
    """Bias instability of the accelerometers; left out where there is none."""
    azimuth_noise_deg: float | None
    """Noise of the azimuth per sample, in deg; null if it is not measured."""
    slew_rate_deg_s: float | None
    """Rate of slews in deg/s unless a position states its own; null for instantaneous slews."""
    drift_noise: str | None
    """Random drift that is stated, with its unit; null if none is."""
    gyro_noise: GyroNoise | None
    """Noise of the gyros by their datasheet; left out where they have no noise of their own."""
    prior: str | None
    """Priors that are stated, as 1 sigma in the units of the unknowns; null if none are."""
    bench: str | None
    """Bench that is stated: sizes (one sigma) of errors that are not estimated, in their units; left out where none is."""
    by_default: list[str]
    """Keys of the conditions above that nobody states, so that the program chose them: latitude_deg, accelerometer_noise_g, step_s,
    dwell_s, azimuth_noise_deg.
    """


class ChangePerUnit(Record):
    """Change of one estimate per unit of an error."""

    __slots__ = ()

    unknown: str
    """Name of the unknown whose estimate changes."""
    unit: str
    """Unit of the unknown whose estimate changes."""
    per_unit: float
    """Estimate minus truth, in the unit of the unknown per unit of the error."""


class UsesUp(Record):
    """Size of an error at which a requirement is just met."""

    __slots__ = ()

    unknown: str
    """Name of the unknown with this requirement."""
    size: float
    """Size (one sigma) of the error at which the total uncertainty reaches the requirement, in the unit of the error; a requirement that
    is missed without the error has no such size.
    """


class FamilyEffect(Record):
    """Effect of a family of errors."""

    __slots__ = ()

    family: str
    """Name of the family, such as `K0` or `latitude`."""
    unit: str
    """Unit of its sizes: ug, ppm, arcsec, ..."""
    terms: int
    """Number of terms of the family that the scheme does not estimate."""
    no_effect: int | None
    """Number of terms without effect; null where no classes were computed."""
    silent: int | None
    """Number of terms that no record can show; null where no classes were computed."""
    worst: ChangePerUnit | None
    """Largest change of a drift coefficient per unit size of all terms (root of the sum of squares); null if no drift coefficient
    changes.
    """
    worst_in_sigmas: float | None
    """Largest change of a drift coefficient per unit size in its own sigma (dimensionless per unit of the error); null if no drift
    coefficient changes.
    """
    visible_from: float | None
    """Smallest size of a single term that a record shows at three sigma, in the unit of `unit`; null if none is visible."""
    uses_up: UsesUp | None
    """Smallest size of all terms of the family together that uses up the margin of a requirement; null if none does."""
    one_uses_up: UsesUp | None
    """Smallest size of a single term, the others being zero, that uses up the margin of a requirement; null if none does."""


class OmittedEffect(Record):
    """Effect of one error that is not estimated."""

    __slots__ = ()

    name: str
    """Name of the error, such as `K0_X`, `latitude` or `attitude_x@2`."""
    family: str
    """Family of the error, such as `K0`, `latitude` or `attitude`."""
    unit: str
    """Unit of its sizes: ug, ppm, arcsec, ..."""
    class_: OmittedClass | None
    """Exact class: no effect, silent or visible; null where none was computed."""
    exact: list[ExactChange] | None
    """Exact changes by a silent error, in SI units; null if they have no exact form, or for other classes."""
    visible_from: float | None
    """Size that a record of this scheme shows at three sigma, in the unit of `unit`; null unless the error is visible."""
    size: float | None
    """Size stated by the bench (one sigma), in the unit of `unit`; null where the bench states none."""
    sensitivities: list[ChangePerUnit]
    """Changes of the estimates per unit of the error; estimates that it does not change are left out."""
    uses_up: UsesUp | None
    """Size at which the error uses up the margin of a requirement; null if there is no requirement, or none that it affects."""

Evaluation = Literal["A", "B"]
"""Evaluation of a standard uncertainty, by the GUM. A: Type A: statistical, from the scatter of the samples that the estimates are
computed from. B: Type B: by other means, such as a datasheet or an earlier calibration.
"""


class BudgetLine(Record):
    """Source of uncertainty in a budget."""

    __slots__ = ()

    source: str
    """Source: the samples (with the random drift and the priors that are stated), or the name of an error."""
    evaluation: Evaluation
    """Evaluation of its standard uncertainty: type A or B."""
    value: float
    """Standard uncertainty of the source, in the unit of `value_unit`."""
    value_unit: str
    """Unit of the standard uncertainty of the source."""
    sensitivity: float
    """ChangePerUnit of the unknown to the source, in the unit of the unknown per `value_unit`."""
    contribution: float
    """Contribution to the standard uncertainty of the unknown, in its unit: value times sensitivity, positive."""
    percent: float
    """Part of the squared total, in percent."""


class Budget(Record):
    """Uncertainty budget of one unknown."""

    __slots__ = ()

    unknown: str
    """Name of the unknown of the budget."""
    unit: str
    """Unit of the unknown, of its contributions and of the total."""
    total: float
    """Total standard uncertainty: root of the sum of the squared contributions, in the unit of `unit`."""
    requirement: float | None
    """Largest standard uncertainty allowed, in the unit of `unit`; null if none is required."""
    lines: list[BudgetLine]
    """Sources of uncertainty, the largest contribution first."""


class Composition(Record):
    """Uncertainty of one unknown: by the samples, by the bench, and both."""

    __slots__ = ()

    unknown: str
    """Name of the unknown with these figures."""
    unit: str
    """Unit of sigma, bias and total."""
    sigma: float
    """Sigma by the samples, in the unit of `unit`."""
    bias: float
    """Contribution of the errors of the bench (root of the sum of squares), in the unit of `unit`."""
    total: float
    """Total uncertainty: root of the sum of both squares, in the unit of `unit`."""


class CarryUncertainty(Record):
    """Uncertainty of a scheme under one carry, with the bench."""

    __slots__ = ()

    carry: Carry
    """Carry: quantity that continues from one position to the next."""
    without_slews: bool
    """True if the slews of the scheme are left out, since only inertial carry has slews."""
    worst: Composition | None
    """Drift coefficient with the largest total; null if one is not observable, or if nothing was judged."""

AdviceKind = Literal["estimate", "relevel", "add_position"]
"""Kind of a change that lowers a total uncertainty. estimate: Families of errors are estimated: terms among the unknowns. relevel: The
platform is levelled again before each position: reset carry. add_position: One more position, as long as the last one.
"""


class Advice(Record):
    """Change of a scheme that lowers the largest total uncertainty over its requirement, as it was tried."""

    __slots__ = ()

    kind: AdviceKind
    """Kind of the change: errors estimated too, the platform levelled again, or a position added."""
    what: str
    """Terms that become unknowns, the carry, or the attitude that is added."""
    total_over_required: float
    """Largest total uncertainty over its requirement with the change, dimensionless."""
    now: float
    """The same without the change, dimensionless."""
    sigma_factor: float
    """Largest factor on the sigma of a drift coefficient, dimensionless: what the change costs."""
    met: bool
    """True if every requirement is met with the change."""


class CorrelatedNoise(Record):
    """Effect of correlated noise: sigmas with it over sigmas of the white noise alone."""

    __slots__ = ()

    smallest: float
    """Smallest factor on the sigma of a drift coefficient, dimensionless."""
    largest: float
    """Largest factor on the sigma of a drift coefficient, dimensionless."""
    unknown: str
    """Name of the drift coefficient with the largest factor."""


class OmittedEffects(Record):
    """Effect of everything that a scheme does not estimate: the other terms of the error model, the site, and the attitudes of the
    positions.
    """

    __slots__ = ()

    families: list[FamilyEffect]
    """Effects family by family: all terms of a family have the same size, and their changes add up as squares."""
    terms: list[OmittedEffect]
    """Effects term by term, in the order of the error model."""
    budgets: list[Budget]
    """Uncertainty budgets of the unknowns that have a sigma; empty without a bench."""
    carries: list[CarryUncertainty]
    """Uncertainty of the scheme under every carry, its own first; empty without a bench."""
    advice: list[Advice]
    """Changes that lower the largest total over its requirement, the lowest first; empty unless sigma meets every requirement and the
    total with the bench does not.
    """
    correlated_noise: CorrelatedNoise | None
    """Effect of correlated noise on the sigmas; null if no correlated noise is stated."""
    torquers_in_turns: bool
    """True if torquer errors (GS, GM) act in the stated turns; otherwise they act at the earth rate alone."""
    error_bound: float | None
    """Bound on the probability that a class is wrong, dimensionless; null where no classes were computed."""
    not_classified: str | None
    """Reason why there are no exact classes; null if there are."""
    estimated: list[str]
    """Names in the bench that are among the unknowns: estimated, so that their sizes do not count."""
    priors: bool
    """True if priors are stated: figures count them, exact changes by silent errors do not."""
    attitudes: bool
    """True if attitudes of the positions are among the terms: those of rotating positions, and of more than 64, are not computed."""


class Sensitivities(Record):
    """Changes of the estimates of a scheme per unit of each error that it does not estimate, by the weights of one record."""

    __slots__ = ()

    conditions: MeasurementReport
    """Conditions of the record whose noise and priors weight the samples."""
    effects: OmittedEffects
    """Effects of the errors on the estimates from this record."""


class Analysis(Shape):
    """Verdicts on a scheme, with the sensitivities of its estimates where they are asked for."""

    schema: str
    """Layout of this answer: `obsdeg.analysis/1`."""
    version: str
    """Version of the program that wrote it."""
    carry: Carry
    """Carry: quantity that continues from one position to the next."""
    latitude_deg: float | None
    """Latitude in degrees; null when generic."""
    geometry: Geometry
    """Mounting of the gyros and accelerometers."""
    terms: str
    """Unknown terms of the gyro model, or `drift`."""
    measured_azimuth: bool
    """True if psi_y^n is measured."""
    positions: list[PositionReport]
    """Positions of the scheme, in order of time."""
    stations: list[StationLabel]
    """Stations: points at which the derivatives in solutions are taken, that is the positions and attitudes during rotations."""
    rank_profile: list[int]
    """Rank profile: dim V_0, dim V_1, ..., the rank of the derivatives of Z up to each order."""
    rank: int
    """Rank of all derivatives of Z up to the last order."""
    unknowns: list[str]
    """Names of the unknowns, in model order."""
    has_accuracy_orders: bool
    """True if accuracy orders were computed. They are not for rotating segments; notes give other reasons."""
    quantities: list[Quantity]
    """Verdicts on the unknowns, best first."""
    combinations: list[CombinationReport]
    """Observable combinations beyond single unknowns, by degree, and those asked for."""
    null_space: list[list[Component]]
    """Basis of the directions that Z does not observe, without unknowns that are not excited."""
    carries: list[CarryReport]
    """Verdicts under the other carries, where they differ."""
    omitted: OmittedVerdicts | None
    """Exact classes of the errors that the scheme does not estimate; null with `--omitted off` and where none are computed (rotating
    segments, the drift as unknown, very many columns).
    """
    to_resolve: Remedies
    """Changes that make the unobservable unknowns observable."""
    why: list[Why]
    """Explanations of the verdicts that `--why` names; left out without it."""
    degenerate_loci: list[Locus] | None
    """Conditions on generic angles under which a verdict changes; null if they were not computed."""
    degenerate_loci_incomplete: str | None
    """Reason why `degenerate_loci` may lack some, or was not computed although angles are generic; null if it has all that one equation
    describes.
    """
    formulas: list[Formula] | None
    """Formulas of Z and its derivatives, position by position; null if not asked for."""
    frame: Frame
    """Axes in which Z is printed in solutions."""
    gimbals: GimbalReport | None
    """Angles and turns beyond the gimbal limits of the scheme; left out where it states none."""
    certainty: Certainty
    """Certainty of the verdicts: method, error bound, primes and seed."""
    notes: list[str]
    """Limitations of this answer, each with its reason."""
    engine_busy: EngineBusy | None
    """Mark of an answer without the formulas that need the symbolic engine, because other processes held it for the whole of --engine-
    wait; null otherwise.
    """
    sensitivities: Sensitivities | None
    """Changes of the estimates per unit of each error that is not estimated; left out unless they are asked for."""


class NumberOfSolutionsCounted(Record):
    """Number of solutions, complex ones included, by elimination at a random point modulo each prime."""

    __slots__ = ()

    counted: int


class NumberOfSolutionsUndecided(Record):
    """Locally unique. The text is the reason why the number of solutions is not decided."""

    __slots__ = ()

    undecided: str

NumberOfSolutions = Union[Literal["one_by_expression"], NumberOfSolutionsCounted, NumberOfSolutionsUndecided]
"""Number of values of an unknown among all points with the same outputs. one_by_expression: Single value: the solving expression depends
on outputs, inputs, constants and unknowns that have one solution.
"""

Identifiability = Literal["globally_identifiable", "locally_identifiable", "not_identifiable", "not_decided"]
"""Identifiability of an unknown (of a state: observability), in the usual terms. globally_identifiable: Globally identifiable: the
outputs of a generic point have one solution for the unknown. locally_identifiable: Locally identifiable: no other value nearby gives
the same outputs; several solutions, or their number is not decided. not_identifiable: Not identifiable: values as near as one likes
give the same outputs. not_decided: Not decided: the unknown is not observable up to the bound on the order, where no end is proven.
"""


class SystemQuantity(Record):
    """Verdict on one unknown of a system."""

    __slots__ = ()

    name: str
    """Name of the unknown, as in the model."""
    kind: str
    """Kind of the unknown: state, algebraic, parameter or input."""
    unit: str
    """Unit of the unknown, as in the model file."""
    description: str
    """Description of the unknown, as in the model file."""
    status: Status
    """Verdict: locally observable (no other value nearby gives the same outputs), inseparable from its partners, not excited, or not
    resolved up to the bound on the order.
    """
    degree: int | None
    """Observable degree: the smallest order of derivatives that determines the unknown; null if it is not observable."""
    partners: list[str]
    """Unknowns indistinguishable from it: those in a common unobservable direction of minimal support."""
    solution: str | None
    """Expression of the unknown in outputs, inputs, their derivatives (up to two orders beyond the degree) and unknowns of no higher
    degree, in which it is linear; verified in both fields. Null if none was found.
    """
    number_of_solutions: NumberOfSolutions | None
    """Number of solutions for the unknown; null if it is not observable, or if solutions were not sought."""
    identifiability: Identifiability
    """Identifiability of the unknown in the usual terms: `globally_identifiable`, `locally_identifiable` (the number of solutions is in
    `number_of_solutions`), `not_identifiable` or `not_decided`.
    """


class ConstraintFactor(Record):
    """A constraint that is a product, and the factor that was taken for it."""

    __slots__ = ()

    constraint: str
    """Constraint that is a product, as written."""
    factor: str
    """Factor that is zero where the verdicts are judged."""
    others: list[str]
    """Other factors of the constraint, by which it could hold as well."""
    given: bool
    """True if the factor is the one that is zero at the values under `[simulation.values]`; otherwise it is the first with a real point
    at which the others are not zero, unknowns alone last.
    """


class SystemCombination(Record):
    """Combination of unknowns, with its verdict."""

    __slots__ = ()

    expression: str
    """Combination as written in the model, or `b*x1`."""
    degree: int | None
    """Observable degree of the combination; null if it is not observable."""
    number_of_solutions: NumberOfSolutions | None
    """Number of values of an identifiable function among all points with the same outputs; null if it is not observable or solutions
    were not sought.
    """


class SymmetryReport(Record):
    """Symmetry of the system, in words."""

    __slots__ = ()

    words: str
    """Change that leaves every output as it is (if `rests_on_bound`: its derivatives up to the bound at the start), for every `c` (every
    positive one where something is multiplied or divided): `multiply alpha by c; divide gamma by c`. At c = 1, and where nothing is
    multiplied or divided at c = 0, nothing changes.
    """
    unknowns: list[str]
    """Unknowns that the symmetry changes."""


class BranchSide(Record):
    """Side of a branch of abs or sign on which the verdicts were computed."""

    __slots__ = ()

    condition: str
    """Condition on the argument of abs or sign that holds at the start of the runs at both random points, and with it where the verdicts
    hold: `t - 7 < 0`. An argument that had either sign is named with both.
    """
    of_time: bool
    """True if the argument depends on the time."""
    given: bool
    """True if the file gives the value of the argument at the start: known starts and constants, and no second segment."""


class DigitsReport(Record):
    """Margin of rank decisions in real numbers of many digits, at two random points."""

    __slots__ = ()

    digits: tuple[int, int]
    """Number of decimal digits at the first and at the second point."""
    nonzero_log10: float
    """Decimal logarithm (dimensionless) of the smallest number, relative to its row, that is proven to differ from zero."""
    zero_log10: float | None
    """Decimal logarithm (dimensionless) of the widest error bound, relative to its row, of a number that counts as zero; null if all
    were exact.
    """


class SystemAnalysis(Shape):
    """Analysis of one system: verdicts, combinations, symmetries and remedies."""

    schema: str
    """Layout of this answer: `obsdeg.system/1`."""
    version: str
    """Version of the program that wrote it."""
    name: str
    """Name of the system, as in its file."""
    description: str
    """Description of the system, as in its file."""
    equations: list[str]
    """Equations as written: `u = ...` of known inputs that are functions of time, definitions, `x' = ...`, `y = ...`."""
    rank_profile: list[int]
    """Rank profile: dim V_0, dim V_1, ..., the rank of the output derivatives up to each order."""
    rank: int
    """Rank of all output derivatives up to the last order."""
    unknowns: int
    """Number of unknowns that are judged."""
    quantities: list[SystemQuantity]
    """Verdicts on the unknowns, in model order."""
    known: list[str]
    """States with a known initial value."""
    time: str | None
    """Time at which the first segment was judged: a number, or `generic` (almost every time, as in all later segments); null if the
    equations do not depend on time.
    """
    constraints: list[str]
    """Equations that hold at the start; their differentials count as rows of order 0."""
    constraint_factors: list[ConstraintFactor]
    """Factors that stand for those of these equations that are products: verdicts are those where they are zero."""
    combinations: list[SystemCombination]
    """Combinations of unknowns that the model asks for."""
    unobservable_directions: int
    """Number of independent directions that change no output."""
    symmetries: list[SymmetryReport]
    """Scalings, translations and polynomials among the unobservable directions, exactly; up to the bound on the order only if
    `rests_on_bound`.
    """
    other_directions: list[list[str]]
    """Unknowns affected by each remaining unobservable direction: at a generic point, no polynomial that was found describes it."""
    invariants: list[SystemCombination]
    """Observable combinations of unobservable unknowns."""
    missing_functions: int
    """Number of independent identifiable functions of unobservable unknowns that exist beyond `invariants`: the rank less the observable
    unknowns less those listed.
    """
    last_order: int
    """Highest order of derivatives that was examined."""
    bound: int
    """Order of derivatives at which the search ends at the latest."""
    discrete: bool | None
    """True for a model in discrete time: orders and degrees count steps, `y[t+1]`, instead of derivatives. Left out for a model in
    continuous time.
    """
    closed: bool
    """True if the end is proven: an order that adds nothing is the last. If false, unobservable verdicts hold up to the bound on the
    order only.
    """
    rests_on_bound: bool
    """True if a verdict holds up to the bound on the order only."""
    branches: list[str]
    """Functions with branches (abs, sign, roots, asin, acos) of unknowns, inputs, generic constants or the time. The verdicts hold on
    the branch of points near one, or where the model is undefined there, on the first branch that was found.
    """
    branch_sides: list[BranchSide]
    """Sides of the branches of abs and sign on which the verdicts hold."""
    to_resolve: Remedies
    """Changes that make the unobservable unknowns observable."""
    why: list[Why]
    """Explanations of the verdicts that `--why` names; left out without it."""
    note: str | None
    """Reason why solving expressions were not sought, or not all of them; null otherwise."""
    solution_maps: list[str]
    """Maps that take every solution to another with the same outputs: `negate q1, q2`, `swap k1 and k2`. Sought among changes of signs
    and exchanges of places, then, of two solutions, among short expressions; empty if none was found.
    """
    counting_order: int | None
    """Order of the derivatives with which solutions were counted by elimination; null if none were."""
    independent_functions: int | None
    """Number of functions whose values are proven to be independent of each other at a generic point (Ax 1971, doi:10.2307/1970774), so
    that random values in prime fields replace them; 0 for a rational model, null if functions were evaluated in real numbers.
    """
    primes: list[str] | None
    """Random primes of the two prime fields, as text (61 bits), and a third one for a model so large that two might be wrong with a
    probability above 1e-9; null for a model judged in real numbers.
    """
    error_bound: float | None
    """Bound on the probability that a verdict is wrong; null for a model judged in real numbers."""
    digits: DigitsReport | None
    """Margin of the rank decisions in real numbers; null for a model judged in prime fields."""
    seed: int
    """Seed of all random choices."""


class Slew(Record):
    """Slew of finite duration to a position."""

    __slots__ = ()

    to: str
    """Name of the position that the slew leads to."""
    turn: Turn
    """Turn of the slew: its axis and angle."""


class ComparisonQuantity(Record):
    """Verdict, sigma and requirement of one unknown of a scheme."""

    __slots__ = ()

    name: str
    """Name of the unknown, as in the scheme's model."""
    unit: str
    """Unit of sigma, of the requirement and of `sigma_extended`."""
    status: Status
    """Verdict: observable, inseparable or not excited."""
    degree: int | None
    """Observable degree; null if the unknown is not observable."""
    accuracy_order: int | None
    """Accuracy order; null if no dwell makes the unknown observable, or if none were computed."""
    sigma: float | None
    """Predicted standard deviation at the end of the scheme under the stated conditions, in the unit of `unit`; null if neither samples
    nor stated priors bound it.
    """
    by_prior: bool
    """True if the samples do not determine the unknown, so that sigma depends on stated priors alone."""
    sigma_extended: float | None
    """Standard deviation of a coefficient at the end by a filter with full attitudes, with the prior, in the unit of `unit`; null if the
    small-angle model holds for the stated drifts, or none are stated.
    """
    requirement: float | None
    """Largest sigma allowed, in the unit of `unit`; null if none is required."""
    total: float | None
    """Total uncertainty with the errors of the bench, in the unit of `unit`; null without a bench or a sigma."""
    margin: float | None
    """Requirement over sigma (total uncertainty with a bench), dimensionless: met from 1; null if there is no requirement or no sigma."""
    excitation: list[float]
    """Factors by which the unknown enters the drift, position by position, dimensionless: products of components of g (1 for D_F), root
    mean square over the arc of a rotating segment. Empty for psi.
    """
    carried_by: list[str]
    """Positions without which the unknown is not observable."""


class Worst(Record):
    """Largest sigma, with a bench the largest total uncertainty, of a drift coefficient."""

    __slots__ = ()

    name: str
    """Name of the coefficient with this sigma."""
    sigma_dph: float
    """Standard deviation of the coefficient, with a bench its total uncertainty, in deg/h (per g, per g^2)."""

Basis = Literal["predicted", "predicted_with_prior", "run", "record"]
"""Source of the sigmas that are compared with requirements. The prediction alone decides whether a scheme meets its requirements; a run
is an example, a record its confirmation. predicted: Information of all samples with the stated noise and random drift, psi at the end
of the scheme (under reset carry at the end of each position); no prior knowledge. predicted_with_prior: Information of all samples as
in `predicted`, with the stated priors. run: Filter at the end of a simulated run, with its prior and its random drift, whether they
are stated or chosen by the program. record: Estimates of a calibration from a record.
"""


class Margin(Record):
    """Margin of a requirement, with its unknown."""

    __slots__ = ()

    name: str
    """Name of the unknown with this margin."""
    margin: float
    """Required over found sigma, dimensionless: met from 1."""

Miss = Literal["too_large", "not_observable", "rests_on_prior", "inconsistent", "no_number"]
"""Reason why a requirement is missed. too_large: Sigma above the requirement. not_observable: Unknown that the outputs do not determine.
rests_on_prior: Sigma hardly below the prior's: it repeats the prior. inconsistent: Error beyond four sigma: the filter is wrong.
no_number: Sigma or estimate that is not a finite number.
"""


class Missed(Record):
    """Unknown that misses its requirement."""

    __slots__ = ()

    name: str
    """Name of the unknown that misses."""
    why: Miss
    """Reason why the requirement is missed."""


class Requirements(Record):
    """Outcome of all requirements: those met, those missed and the smallest margin."""

    __slots__ = ()

    basis: Basis
    """Source of the sigmas that decide."""
    stated: int
    """Number of unknowns with a requirement."""
    met: int
    """Number of unknowns that meet their requirement."""
    worst: Margin | None
    """Smallest margin among the sigmas that count; null if there is none."""
    missed: list[Missed]
    """Unknowns that miss their requirement, in model order."""
    with_bench: bool | None
    """True if the sigmas are total uncertainties, with the errors of a stated bench."""
    on_prior: list[str]
    """Unknowns with a requirement that the samples do not determine, so that their sigma depends on stated priors alone."""


class OtherCarry(Record):
    """Scheme under another carry than its own: same positions, dwells, noise and requirements. Slews, which only inertial carry has, are
    left out.
    """

    __slots__ = ()

    carry: Carry
    """Carry: quantity that continues from one position to the next."""
    worst: Worst | None
    """Largest sigma of a drift coefficient in deg/h (per g); null if a coefficient is not observable, or if nothing was judged."""
    without_slews: bool
    """True if the slews of the scheme are left out there, since only inertial carry has slews."""
    requirements: Requirements | None
    """Outcome of the requirements; null if nothing was judged."""
    not_judged: str | None
    """Reason why nothing was judged; left out where something was."""


class Validity(Record):
    """Validity of the small-angle model at the drifts of a run."""

    __slots__ = ()

    largest_psi_deg: float
    """Largest platform error `|psi|`, in deg."""
    neglected_g: float
    """Largest `|psi|^2/2`, in g: the term that the observation model (6) neglects."""
    accelerometer_noise_g: float
    """Noise of the observation per sample, in g."""
    neglected_dph: float
    """Largest g-sensitive coefficient times the largest `|psi|`, in deg/h: the term that the drift model (3) neglects."""
    smallest_requirement_dph: float | None
    """Smallest sigma required of a drift coefficient, in deg/h (per g); null if none is required."""
    holds: bool
    """True if `neglected_g` is at most the noise and `neglected_dph` at most the smallest requirement."""


class DropOne(Record):
    """Scheme without one of its positions."""

    __slots__ = ()

    position: str
    """Name of the position that is left out."""
    lost: list[str]
    """Unknowns that are not observable without the position."""
    worst: Worst | None
    """Worst sigma without the position; null if a coefficient is not observable."""
    requirements: Requirements
    """Outcome of the requirements without the position."""


class Sensitivity(Record):
    """Worst sigma of the scheme under another condition."""

    __slots__ = ()

    condition: str
    """Condition: `latitude 60 deg`, `dwell x 2`, `reset carry`; `platform carry, no slews` for a scheme with slews, which only inertial
    carry has.
    """
    rank: tuple[int, int]
    """Rank with dwell, then the number of unknowns, under the condition."""
    worst: Worst | None
    """Worst sigma under the condition; null if a coefficient is not observable."""
    worst_determined: Worst | None
    """Worst sigma, under the condition, of the coefficients that are observable in the scheme itself; null if one is not."""

Reached = Literal["at_the_shortest", "within", "still_falls"]
"""Range of dwells in which a sigma comes within 5 % of the least. at_the_shortest: Shortest dwell examined: shorter ones may give the
same or a smaller sigma. within: Dwell between the shortest and a quarter of the longest examined. still_falls: Dwell beyond a quarter
of the longest examined: sigma still falls.
"""


class CoefficientFloor(Record):
    """Noise floor of one coefficient, which is a constant: a drift coefficient D_F is the bias at the start of the run."""

    __slots__ = ()

    name: str
    """Name of the coefficient, as in the model."""
    unit: str
    """Unit of the sigmas of the coefficient."""
    sigma: float | None
    """Sigma with the dwells of the scheme, without prior, in the unit of `unit`; null if samples do not determine it."""
    least_sigma: float | None
    """Least sigma over all dwells examined, in the unit of `unit`; null if samples do not determine it."""
    reached: Reached | None
    """Range of dwells in which the least sigma is reached; null if samples do not determine it."""
    dwell_s: float | None
    """Shortest dwell, in s (mean of the positions), at which sigma is within 5 % of the least; null unless it lies within the dwells
    examined.
    """


class NoiseFloor(Record):
    """Noise floor: the least sigmas of coefficients under random drift, however long the dwells."""

    __slots__ = ()

    drift_noise_deg_sqrt_h: float
    """Density of the random drift besides the noise of the gyros, in deg/sqrt(h)."""
    gyro_noise: GyroNoise
    """Noise of the gyros by their datasheet."""
    dwells_s: tuple[float, float]
    """Shortest and longest dwell that were examined, in s: the mean of the positions, all in proportion."""
    coefficients: list[CoefficientFloor]
    """Noise floor of each coefficient, in model order."""


class Review(Record):
    """Scheme of a comparison, with its predicted sigmas."""

    __slots__ = ()

    name: str
    """Name of the scheme: that of its file."""
    carry: Carry
    """Carry: quantity that continues from one position to the next."""
    conditions: MeasurementReport
    """Conditions of the predicted sigmas."""
    positions: list[str]
    """Names of the positions, in order of time."""
    slews: list[Slew]
    """Slews of finite duration, each with the position that it leads to."""
    total_s: float
    """Total time of the scheme with slews, in s."""
    rank: tuple[int, int]
    """Rank with dwell (by derivatives if accuracy orders are not computed), then the number of unknowns."""
    quantities: list[ComparisonQuantity]
    """Verdict, sigma and requirement of each unknown."""
    worst: Worst | None
    """Largest sigma of a coefficient; null if one is not observable."""
    meets_requirements: bool
    """True if requirements are stated and every one is met."""
    requirements: Requirements
    """Outcome of the requirements by the predicted sigmas."""
    other_carries: list[OtherCarry]
    """Outcome of the same scheme under the other carries."""
    omitted: OmittedEffects
    """Effect of what the scheme does not estimate, by the weights of the predicted sigmas."""
    has_accuracy_orders: bool
    """True if accuracy orders are computed. They are not for rotating segments."""
    validity: Validity | None
    """Validity of the small-angle model at the drifts that are stated; null where none are (`values`), or for very many steps."""
    drop_one: list[DropOne]
    """Schemes with one position left out, for each position."""
    sensitivity: list[Sensitivity]
    """Worst sigmas under other conditions."""
    noise_floor: NoiseFloor | None
    """Noise floor: the least sigmas under random drift, however long the dwells; left out where the gyros have no noise of their own."""
    gimbals: GimbalReport | None
    """Angles and turns beyond the gimbal limits of the scheme; left out where it states none."""


class Comparison(Shape):
    """Comparison of several schemes under the same method."""

    schema: str
    """Layout of this answer: `obsdeg.comparison/2`."""
    version: str
    """Version of the program that wrote it."""
    schemes: list[Review]
    """Schemes of the comparison, in the order given."""
    differ: list[str]
    """Differences between the schemes besides positions, dwells and slews: carry, latitude, unknowns, requirements, noise, random drift
    or bias instability, prior, bench, step, settle.
    """
    seed: int
    """Seed of all random choices."""


class Minimum(Record):
    """Smallest number of positions that makes every required coefficient observable."""

    __slots__ = ()

    positions: int | None
    """Number of positions; null if all candidates together are not enough, or if the sets are too many to be examined."""
    witness: list[str]
    """Smallest candidate set that makes all required coefficients observable; empty if none was found."""
    counting_bound: int
    """Number of positions below which no set is enough: the required coefficients over the rows of a position, rounded up (0 where
    torquer errors act in every turn).
    """
    rows_per_position: int
    """Largest number of independent rows on the unknowns that a candidate adds, under reset carry without those that its psi takes."""
    none_of: list[tuple[int, int]]
    """Sets excluded by exhaustion: `[size, number of sets]`, none of which is enough."""
    never: list[str]
    """Coefficients that all candidates together leave unobservable."""
    proven: bool
    """True if `positions` is proven minimal, or the coefficients in `never` proven unobservable: no smaller set was left out, and the
    bound on the probability of an error is below 1e-12.
    """


class PartsReport(Record):
    """Parts of a search that were put together: every sequence that they list was evaluated again, and their starts and counts add up to
    the whole.
    """

    __slots__ = ()

    parts: int
    """Number of parts put together."""
    versions: list[str]
    """Versions of the program that searched the parts, each once."""
    blocks: int
    """Number of blocks of starts in all parts, at all worst degrees that were searched."""
    searched_again: int
    """Number of blocks, chosen at random, that were searched again with the same result (`--check`)."""


class TiesReport(Record):
    """Number of sequences that are as good as the best."""

    __slots__ = ()

    sequences: int
    """Number of sequences as good as the best, with the best and all images under turns of the platform axes."""
    within: float
    """Largest relative difference of two criteria, in double precision and dimensionless, that counts as equal; their worst degrees must
    be equal too.
    """


class Weight(Record):
    """Candidate attitude with its weight."""

    __slots__ = ()

    candidate: str
    """Candidate attitude: its name, or its Euler angles in degrees."""
    weight: float
    """Weight of the candidate: its fraction of all positions, dimensionless, as it is before the division by the sum of all."""


class Finer(Record):
    """Better scheme that rounding of the angles excludes."""

    __slots__ = ()

    value: float
    """Criterion of the scheme, in the unit of `unit`."""
    angles: list[str]
    """Euler angles of its positions, in degrees."""


class Rounded(Record):
    """Rounding of the angles of free attitudes: every scheme is evaluated at the rounded angles."""

    __slots__ = ()

    step_deg: float
    """Step of the angles, in degrees. Exceptions: the cardinal attitudes, which may be chosen too, and angles that gimbal limits
    require: the twin (alpha+180, 180-beta, gamma+180) of rounded angles, and at beta = +-90 another alpha.
    """
    finer: Finer | None
    """Better scheme, by the same search with angles in hundredths of a degree; null if none was found."""


class EverywhereReport(Record):
    """Bound on the criterion of the best scheme of any attitudes, whatever the candidates and the gimbals are, without requirements on
    psi. Attitudes are added where they contribute most. Between the points of a net of 3 degrees their contribution is bounded as a
    trigonometric polynomial, and rounding with it, so that the bound holds for all.
    """

    __slots__ = ()

    best_possible: float
    """Lower bound on the criterion of schemes of the same number of any attitudes, equal dwells, in the unit of `unit`."""
    within_percent: float
    """Largest excess of the first unrefined scheme's criterion over the bound, in percent of the bound."""
    rounding: float | None
    """Relative rounding tolerance of that criterion, dimensionless, with that of the attitudes of the scheme; null if it is unknown."""
    attained: float
    """Criterion that the weights would have as a scheme, in the unit of `unit`: all of them, with angles to hundredths of a degree and
    weights as they are rounded here.
    """
    weights: list[Weight]
    """Ten heaviest attitudes, each once, with their weights, heaviest first: Euler angles in degrees, beta up to 90, the others above
    -180 and up to 180. Weights are fractions of the sum of all, rounded to two digits, or to as many as lose no more than a
    thousandth of the variance; those below 1e-7 are left out.
    """
    lighter: int
    """Number of lighter attitudes, which are not listed."""
    lighter_weight: float
    """Sum of the weights of the lighter attitudes, dimensionless, 0 to 1."""
    rounded: Rounded | None
    """Rounding of the angles of free attitudes, and its cost; null if candidates were given."""


class Certificate(Record):
    """Bound on the criterion of the best scheme of the same number of these candidates, from the optimal weights of the candidates
    (approximate design theory). It holds for schemes of any worst degree, within the constraints or not, and allows for the rounding
    in its evaluation; the information of each position is in double precision, the same as in the search.
    """

    __slots__ = ()

    best_possible: float
    """Lower bound on the criterion of schemes of the same number of these candidates, equal dwells, in the unit of `unit`."""
    within_percent: float
    """Largest excess of the first unrefined scheme's criterion over the bound, in percent of the bound."""
    efficiency: float
    """Efficiency, dimensionless, 0 to 1: square of the bound over that criterion, the least fraction of the best possible information
    (for D the D-efficiency).
    """
    rounding: float | None
    """Relative rounding tolerance of that criterion, dimensionless, by the residual of the inverse; it is added before the criterion is
    compared with the bound. Null if the remaining unknowns are not determined: then it is unknown and nothing is added.
    """
    attained: float
    """Criterion that the weights would have as a scheme, exactly as they are listed, in the unit of `unit`; the bound cannot be larger."""
    weights: list[Weight]
    """Weights that divide the time among the candidates: fractions of their sum, rounded to two digits, or to as many as lose no more
    than a thousandth of the variance; those below 1e-7 are left out.
    """
    everywhere: EverywhereReport | None
    """Bound for any attitudes instead of the candidates; null if it was not asked for."""
    front: list[tuple[float, float]]
    """Lower bound over time: `[total time in s, criterion in the unit of unit]`. No scheme of these candidates, in equal dwells and one
    of the numbers of positions asked for, is below at this time.
    """


class SearchReport(Record):
    """Search for the best schemes, with its conditions and coverage."""

    __slots__ = ()

    positions: int
    """Number of positions of every scheme."""
    conditions: MeasurementReport
    """Conditions of every sigma: the information of all samples on psi and all coefficients, with the stated random drift and priors.
    Every position has the dwell, slews are about the eigenaxis, Z is not used meanwhile.
    """
    drift_noise: str | None
    """Random drift that is stated: the search leaves it out, and the figures of all listed schemes include it; null for none."""
    prior: str | None
    """Priors that are stated, which sigmas and the bound include beside the samples; null for none. The samples alone decide
    observability.
    """
    criterion: str
    """Criterion that orders schemes: worst, A, D, E or margin."""
    unit: str | None
    """Unit of the criterion: deg/h (per g), ug (per g), ppm or arcsec; null for margin, and for D of coefficients in several units, each
    in its own.
    """
    examined: int
    """Number of sequences whose sigma was computed."""
    lost: int
    """Number of examined sequences that the exact verdict, of repositioning at once, calls observable, but whose samples do not
    determine every required coefficient in double precision. They rank below all others.
    """
    sequences: int | None
    """Number of sequences, up to turns of the platform axes, in an exhaustive search if the search was not exhaustive (`within` 0); null
    if it was, and if they are too many to be held or counted.
    """
    excluded: int
    """Number of sequences, observable or not, that a bound excluded from examination: in double precision their criterion is larger than
    that of all listed.
    """
    proven: bool
    """True if no sequence of candidates within the constraints is better than the first, by exhaustion or by a bound: none has a smaller
    worst degree, or the same and a smaller criterion. With `parts` this holds if the parts were searched as they state.
    """
    parts: PartsReport | None
    """Parts that the answer was put together from; left out for a search as a whole."""
    ties: TiesReport | None
    """Number of sequences as good as the first; null if the search was not exhaustive."""
    order_matters: bool
    """True if orders of the same positions count as different schemes."""
    interrupted: bool
    """True if the search was interrupted; if the first is proven nevertheless, before the front was complete."""
    degree_floor: int | None
    """Smallest worst degree that all candidates together allow; null if torquer errors act during slews, so that sets have no degree."""
    constraints: list[str]
    """Constraints of the search, in words."""
    ranked: int | None
    """Number of schemes of least sigma that were ranked by total uncertainty, and left out if not immune, where the search does not
    count errors that are not estimated; left out where it counts them, and where none is stated.
    """
    certificate: Certificate | None
    """Bound on the criterion of the best scheme; null if no such bound is known: under platform and inertial carry, and where the noise
    of Z is correlated, information is no sum over positions.
    """


class HalfTurn(Record):
    """Half turn to a position, with its direction."""

    __slots__ = ()

    to: int
    """Index, from 1, of the position that the half turn leads to."""
    about: tuple[float, float, float]
    """Axis of the half turn, right-handed: a unit vector (North, Up, East), dimensionless."""


class Found(Record):
    """Scheme that the search found, with its figures."""

    __slots__ = ()

    positions: list[str]
    """Candidates of the scheme, in order of time."""
    image_of: int | None
    """Index, from 1, of the scheme listed before that a turn of the platform axes turns into this one (coefficients renamed): the same
    scheme in other axes; null for none.
    """
    angles: list[str]
    """Gimbal angles alpha,beta,gamma of the positions, in degrees: within the gimbal limits, each with the shortest gimbal path from the
    position before (without limits as the candidates have them, in (-180, 180]).
    """
    half_turns: list[HalfTurn]
    """Half turns between the positions, each with its direction; the other direction makes another scheme."""
    refined: bool
    """True if its angles were refined continuously."""
    dwell_s: float
    """Dwell of each position, in s; the mean if the dwells differ."""
    dwells_s: list[float]
    """Dwell of each position, in s, if the total time was divided among the positions; empty if the dwells are equal. Moving 1/256 of an
    equal dwell (at least the time between samples) from one position to another makes none of them better.
    """
    total_s: float
    """Total time with turns, in s."""
    value: float
    """Criterion of the scheme, in the unit of `unit`, with a bench of its total uncertainties; for margin the largest sigma over its
    requirement, psi included where it counts.
    """
    worst_sigma_dph: float | None
    """Largest sigma of a required drift coefficient, in deg/h (per g): information of all samples, prior if one is stated, no drift
    noise; with a bench the largest total uncertainty; null if none is required.
    """
    worst: str | None
    """Coefficient with the largest sigma; null if none is required."""
    requirements: Requirements
    """Outcome of the requirements on the required coefficients, and on psi (of the start, under reset carry of every position) if every
    coefficient is required.
    """
    worst_degree: int
    """Largest observable degree of a required coefficient."""
    worst_accuracy_order: int | None
    """Largest accuracy order of a required coefficient; null if it was not computed."""
    rank: tuple[int, int]
    """Rank by derivatives, exact, then the number of unknowns."""


class BiasPoint(Record):
    """Scheme on the front of sigma against bias: all figures in the unit of the criterion."""

    __slots__ = ()

    positions: list[str]
    """Candidates of the scheme, in order of time."""
    sigma: float
    """Criterion of the sigmas alone, in the unit of the criterion."""
    bias: float
    """Criterion of what the errors of the bench add alone, in the unit of the criterion."""
    total: float
    """Criterion of the total uncertainties, in the unit of the criterion."""


class Design(Shape):
    """Search for the best schemes of candidate attitudes."""

    schema: str
    """Layout of this answer: `obsdeg.design/2`."""
    version: str
    """Version of the program that wrote it."""
    carry: Carry
    """Carry: quantity that continues from one position to the next."""
    latitude_deg: float
    """Latitude of the scheme, in degrees."""
    latitude_by_default: bool
    """True if the program chose the latitude."""
    geometry: Geometry
    """Mounting of the gyros and accelerometers."""
    terms: str
    """Terms of the error model that are unknown besides psi; all of them are estimated."""
    candidates: list[str]
    """Candidate attitudes of the search."""
    beyond_gimbals: list[str]
    """Attitudes that the gimbals do not reach."""
    symmetry: int
    """Number of rotations of the platform axes that turn schemes into equally good ones (1: the identity)."""
    required: list[str]
    """Coefficients that must be observable; the criterion is computed from their sigmas."""
    minimum: Minimum
    """Smallest number of positions that makes every required coefficient observable."""
    search: SearchReport | None
    """Search that was done, with its conditions; null when only the minimum was asked for."""
    found: list[Found]
    """Best schemes that were found, best first."""
    front: list[Found]
    """Schemes that no scheme found beats in both total time and criterion, by total time."""
    bias_front: list[BiasPoint]
    """Schemes that no scheme found beats in both sigma and bias by the bench, by sigma; left out where the search counts no bench."""
    bias_front_complete: bool
    """True if `bias_front` is of all sequences whose total is at most 100 times the best; false where it is of those that are best with
    other sizes of the bench, by exchange.
    """
    not_judged: list[str]
    """Unknowns and families with a stated requirement that is not judged, since only some coefficients are asked for."""
    omitted: OmittedEffects | None
    """Effect of what the first scheme does not estimate, by the weights of its sigmas; null without a search."""
    other_carries: list[OtherCarry]
    """Outcome of the first scheme under the other carries; empty if no scheme was searched."""
    gimbals: GimbalReport | None
    """Turns of the first scheme beyond the gimbal limits, and positions of the file of candidates whose angles lie beyond. Left out
    where no limits are stated.
    """
    primes: int
    """Number of independent random 61-bit primes by which every set is judged: it counts as observable when one of them says so."""
    error_bound: float
    """Bound on the probability that an observable set was overlooked, or a degree taken too large. Nothing is called proven unless it is
    below 1e-12.
    """
    seed: int
    """Seed of all random choices."""


class Walks(Shape):
    """Shortest slew sequence that makes every required coefficient observable."""

    schema: str
    """Layout of this answer: `obsdeg.walks/1`."""
    version: str
    """Version of the program that wrote it."""
    terms: str
    """Terms of the error model that are unknown besides psi."""
    candidates: list[str]
    """Candidate attitudes of the search."""
    most_turn_deg: float
    """Largest turn from one position to the next, in degrees, about one axis by the shortest path."""
    turns: int
    """Number of turns between candidates up to this size."""
    required: list[str]
    """Coefficients that must be observable."""
    positions: int | None
    """Number of positions of the shortest slew sequence that was found; null if none was."""
    walk: list[str]
    """Slew sequence that makes all required coefficients observable: its candidates, in order; empty if none was found."""
    angles: list[str]
    """Euler angles of its positions, in degrees."""
    rank: tuple[int, int]
    """Rank of the slew sequence, then the number of unknowns."""
    latitude_deg: float | None
    """Latitude of the scheme in degrees; null when generic."""
    never: list[str]
    """Coefficients that even the tour of all turns leaves unobservable; then no slew sequence is searched."""
    counting_bound: int
    """Number of positions below which no slew sequence is enough: the required coefficients over the rows of a position, rounded up."""
    rows_per_position: int
    """Largest number of independent rows that a position adds."""
    none_of: list[tuple[int, int]]
    """Slew sequences excluded by exhaustion: `[positions, number of sequences]`, none of which is enough."""
    proven: bool
    """True if `positions` is proven minimal for these candidates and turns: no shorter sequence was left out, and the bound on the
    probability of an error is below 1e-12.
    """
    interrupted: bool
    """True if the search was interrupted."""
    error_bound: float
    """Bound on the probability that a sufficient slew sequence was overlooked."""
    seed: int
    """Seed of all random choices."""


class SensorCandidate(Record):
    """Quantity that can be measured, or one more experiment."""

    __slots__ = ()

    name: str
    """Name: that of a state, input or parameter, the key in the file, or the expression itself."""
    experiment: bool
    """True for one more experiment: the outputs of a set, measured again from another start."""
    tells: bool
    """True if the candidate depends on an unknown; if false it adds nothing to any set."""
    expression: str
    """Expression of the candidate, as written; empty for an experiment."""
    unit: str
    """Unit, as in the model file."""
    description: str
    """Description, as in the model file."""
    cost: float
    """Cost of measuring it, dimensionless."""
    degree: int | None
    """Worst degree of the required unknowns if it alone is measured; null if one of them is not observable."""
    observable: int
    """Number of required unknowns that are observable if it alone is measured."""
    degrees: list[int | None]
    """Degrees of the unknowns if it alone is measured, in the order of `quantities`; null of one that is not observable."""


class Unattainable(Record):
    """Unknown that no set makes observable as asked for."""

    __slots__ = ()

    name: str
    """Name of the unknown, as in the model."""
    degree: int | None
    """Observable degree if all candidates are measured; null if it is not observable."""
    number_of_solutions: NumberOfSolutions | None
    """Number of solutions if all candidates are measured; null if one solution is not required, or if its degree already excludes the
    unknown.
    """


class CountedSets(Record):
    """Sets whose solutions were counted, at the seed of the answer, as `analyze` counts them."""

    __slots__ = ()

    counted: int
    """Number of sets whose solutions were counted."""
    undecided: int
    """Number of these under which the number of solutions of some required unknown is not decided. They count as failing: a cheaper set
    than those in `front` may leave one solution.
    """


class FrontSet(Record):
    """Set of outputs on the front, with the proof that no cheaper one does."""

    __slots__ = ()

    outputs: list[str]
    """Candidates that are measured."""
    cost: float
    """Sum of the costs of these candidates, dimensionless."""
    degree: int
    """Worst degree: the largest one of the required unknowns."""
    below: int | None
    """Observable degree up to which no cheaper set makes all required unknowns observable; null if no cheaper set does so with any
    degree that `max_degree` allows.
    """
    one_of_each: list[list[str]]
    """Proof: every set with degrees of at most `below` and `max_degree` holds a candidate of each of these groups, since all candidates
    outside a group fail together; the cheapest choice has the cost of this set if `examined` is 0.
    """
    examined: int
    """Number of sets that hold a candidate of each group, cost less than this set, and were judged one by one: all of them fail."""


class SensorSet(Record):
    """Set of outputs that are measured together."""

    __slots__ = ()

    outputs: list[str]
    """Candidates that are measured."""
    cost: float
    """Sum of the costs of these candidates, dimensionless."""
    degree: int
    """Worst degree: the largest one of the required unknowns."""


class SensorUnknown(Record):
    """Cheapest set for one unknown."""

    __slots__ = ()

    name: str
    """Name of the unknown, as in the model."""
    unit: str
    """Unit of the unknown, as in the model file."""
    required: bool
    """True if it is one of the required unknowns."""
    cheapest: SensorSet | None
    """Cheapest set that makes the unknown observable, of the smallest degree at this cost; null if all candidates together do not, or if
    the search ended before.
    """
    own_degree: int | None
    """Observable degree of the unknown with the outputs of the model alone; null if it is not observable, if sets replace the outputs,
    or if the search ended before.
    """
    least_degree: int | None
    """Observable degree of the unknown if all candidates are measured; null if it is not observable."""


class Sensors(Shape):
    """Sets of outputs of a model that make its unknowns observable."""

    schema: str
    """Layout of this answer: `obsdeg.sensors/1`."""
    version: str
    """Version of the program that wrote it."""
    name: str
    """Name of the system, as in its file."""
    own_outputs: list[str]
    """Outputs of the model that are measured in every set; empty if sets replace the outputs."""
    candidates: list[SensorCandidate]
    """Quantities that sets are chosen from."""
    required: list[str]
    """Unknowns that every set in `front` and `sets` makes observable: those asked for, or all, without those in `unattainable`."""
    max_degree: list[str]
    """Largest degrees that were asked for, as written: `6`, `k1=4`."""
    unattainable: list[Unattainable]
    """Unknowns asked for that all candidates together leave unobservable, observable with a larger degree than asked for, or without the
    one solution that is required.
    """
    one_solution: CountedSets | None
    """Counts of solutions, by which every set leaves one for every required unknown; null if this is not required."""
    least_degree: int | None
    """Worst degree of the required unknowns if all candidates are measured; null if none is required."""
    front: list[FrontSet]
    """Front of cost against the largest degree: per cost the set with the smallest, if it is smaller than for every lower cost. Cheapest
    first.
    """
    sets: list[SensorSet]
    """Minimal sets: without any of its outputs a set fails. Cheapest first, then by degree; at most as many as asked for."""
    minimal_sets: int | None
    """Number of minimal sets; null if not all were found."""
    minimal_sets_found: int
    """Number of minimal sets that were found, whether or not they are listed."""
    complete_to: int | None
    """All minimal sets with up to so many outputs were found; null if all were, whatever their number of outputs."""
    quantities: list[SensorUnknown]
    """Per unknown the cheapest set that makes it observable."""
    judged_sets: int
    """Number of sets whose degrees were computed, at one point each."""
    relied_on_sets: int
    """Number of sets, out of these, that the answer rests on: those listed, and those whose failure or whose degree its proofs use.
    Their degrees were computed at a second point too, and are the same.
    """
    confirmed_sets: int
    """Number of sets, out of those in this answer and those that its proofs rest on, that `analyze` judged again as a model with these
    outputs: the degrees are the same.
    """
    closed: bool
    """True if all derivatives that can add to a rank were examined; if false, unobservable verdicts hold up to order `last_order` only."""
    last_order: int
    """Order of derivatives at which the search ends at the latest."""
    stopped: str | None
    """Reason why the search ended early; null if it did not. What is listed is true, but there may be more, and cheaper sets for lower
    degrees.
    """
    error_bound: float | None
    """Bound on the probability that the degrees of a set that the answer rests on are wrong; null for a model judged in real numbers."""
    digits: DigitsReport | None
    """Margin of the rank decisions on all candidates together, in real numbers; null for a model judged in prime fields."""
    seed: int
    """Seed of all random choices."""


class Standing(Record):
    """State of the required coefficients."""

    __slots__ = ()

    not_observable: list[str]
    """Required coefficients that neither the samples nor prior knowledge determine."""
    worst_degree: int | None
    """Largest observable degree of a required coefficient; null if one has none."""
    requirements: Requirements
    """Outcome of the requirements."""
    worst: Worst | None
    """Largest sigma (with a bench: total uncertainty) of the determined required drift coefficients; null if none is determined."""
    total_s: float
    """Duration of all positions and slews, in s."""


class AddedPosition(Record):
    """Position that is added to a scheme."""

    __slots__ = ()

    name: str
    """Name of the position in the extended scheme."""
    candidate: str
    """Candidate: directions of X_p, Y_p and Z_p, angles, or a name."""
    angles: str
    """Euler angles alpha, beta, gamma in degrees, as text."""
    half_turn_about: tuple[float, float, float] | None
    """Axis of the half turn to the position: dimensionless components North, Up, East; left out for other turns, and if slews take no
    time.
    """


class Extension(Record):
    """Extension of a scheme by one or two positions."""

    __slots__ = ()

    positions: list[AddedPosition]
    """Added positions, in order."""
    resolves: list[Resolved]
    """Required coefficients that become observable, with their degrees."""
    lowers: list[Resolved]
    """Required coefficients whose degree becomes lower, with the new degrees."""
    then: Standing
    """State with the added positions."""


class Quickest(Record):
    """Shortest run that meets the requirements."""

    __slots__ = ()

    positions: list[AddedPosition]
    """Positions of the run, in order."""
    dwell_s: float
    """Dwell at each position, in s, in whole seconds."""
    total_s: float
    """Duration of the run with its slews, in s."""


class Requalification(Record):
    """Requalification after a number of days: runs that meet the requirements again."""

    __slots__ = ()

    days: float
    """Number of days since the calibration."""
    before: Standing
    """State of the aged coefficients without a measurement."""
    fewest: int | None
    """Smallest number of positions with the stated dwell that meets every requirement: 0 if they are met without a measurement; null if
    no extension by up to `added` positions meets them.
    """
    best: Extension | None
    """Best extension with the fewest positions; null if `fewest` is 0 or null."""
    quickest: Quickest | None
    """Shortest run of up to `added` positions, with an equal dwell at each, that meets every requirement; null if `fewest` is 0, or if
    no run meets them with 16 times the stated dwell.
    """
    examined: int
    """Number of extensions compared: all by the candidates."""


class CandidateGain(Record):
    """State of the required coefficients with one candidate added."""

    __slots__ = ()

    candidate: str
    """Candidate: directions of X_p, Y_p and Z_p, angles, or a name."""
    angles: str
    """Euler angles alpha, beta, gamma in degrees, as text."""
    not_observable: int
    """Number of required coefficients that neither the samples nor prior knowledge determine."""
    ratio: float | None
    """Largest ratio of uncertainty to requirement, dimensionless; null without requirements, or if no coefficient with a requirement is
    determined.
    """
    worst: Worst | None
    """Largest sigma (with a bench: total uncertainty) of the determined required drift coefficients; null if none is determined."""
    degrees: list[int | None]
    """Observable degrees in the order of `required`; null for a coefficient that is not observable."""


class AttitudeBound(Record):
    """Bound on sigmas with one more position of the stated dwell, whatever its attitude: without a bench and without random drift, which
    only add to sigmas.
    """

    __slots__ = ()

    sigmas: list[Worst]
    """Smallest sigma of each required drift coefficient by any attitude, each by itself."""
    ratio: float | None
    """Smallest value by any attitude of the largest ratio of sigma to requirement over these coefficients, dimensionless; null without
    requirements on them.
    """
    worst_dph: float | None
    """Smallest value by any attitude of the largest of these sigmas, in deg/h or deg/h/g; null with requirements on them."""


class Meeting(Record):
    """Shortest dwell that meets the requirements."""

    __slots__ = ()

    dwell_s: float
    """Dwell at each added position, in s, in whole seconds."""
    total_s: float
    """Duration of all positions and slews with this dwell, in s."""


class NextPositions(Shape):
    """Positions by which a scheme gains most."""

    schema: str
    """Layout of this answer: `obsdeg.next/1`."""
    version: str
    """Version of the program that wrote it."""
    carry: Carry
    """Carry: quantity that continues from one position to the next."""
    geometry: Geometry
    """Mounting of the gyros and accelerometers."""
    terms: str
    """Unknown terms of the gyro model."""
    positions: list[str]
    """Positions of the scheme before the added ones; empty after a calibration."""
    position_angles: list[str]
    """Euler angles alpha, beta, gamma of each of the `positions` in degrees, as text; of one with a rotation at its start."""
    after_calibration: bool
    """True if the covariance of a calibration is known beforehand: the added positions are a run of their own."""
    days: float | None
    """Number of days of ageing since the calibration; null without ageing."""
    ageing: dict[str, float] | None
    """Ageing of the coefficients as stated: random walk in the unit of the coefficient per sqrt(day)."""
    unused_ageing: list[str]
    """Names of the table of ageing that are no coefficients of the scheme, and have no effect."""
    schedule: list[Requalification]
    """Requalification after each requested number of days; left out without days."""
    candidates: list[str]
    """Candidates for the added positions, within the gimbal limits."""
    beyond_gimbals: list[str]
    """Candidates beyond the gimbal limits."""
    added: int
    """Number of added positions."""
    required: list[str]
    """Coefficients that must be observable and are compared."""
    conditions: MeasurementReport
    """Conditions of the measurement."""
    before: Standing | None
    """State before the added positions; null for a scheme without positions."""
    degrees_before: list[int | None]
    """Observable degrees before the added positions, in the order of `required`: null for a coefficient that is not observable; empty
    for a scheme without positions and after a calibration.
    """
    found: list[Extension]
    """Best extensions, best first."""
    by_candidate: list[CandidateGain]
    """State with each single candidate added, best first; left out where two positions are added. Candidates beyond the limits of time
    are missing, and those not compared before an interruption.
    """
    as_good: int
    """Number of extensions as good as the first, including the first."""
    bound: AttitudeBound | None
    """Bound over all attitudes, not the candidates alone; null unless one position is added after a calibration that determines the
    first-order drift coefficients one by one.
    """
    meets: Meeting | None
    """Shortest dwell, equal at all positions of the first extension, with which every requirement is met; null without requirements, or
    if no dwell up to 16 times the stated one meets them.
    """
    examined: int
    """Number of extensions compared."""
    proven: bool
    """True if every extension by the candidates was compared, so that the first is the best of all."""
    interrupted: bool
    """True if the comparison was stopped early."""
    not_judged: list[str]
    """Requirements on unknowns outside `required`: this answer does not judge them."""
    error_bound: float
    """Bound on the probability that the verdicts of one extension are wrong."""
    seed: int
    """Seed of all random choices."""


class Worth(Record):
    """Score of a sequence, better first: constraints kept, then a small worst degree, then a small criterion."""

    __slots__ = ()

    violation: float
    """Violation of time limits, requirements and degree caps, dimensionless; 0 when kept."""
    degree: int
    """Largest observable degree of a required coefficient."""
    value: float
    """Criterion of the sequence, in the unit of the criterion asked for."""


class Stop(Record):
    """Position of a sequence: the candidate, and the slew path to it."""

    __slots__ = ()

    candidate: int
    """Index of the candidate, from 0."""
    reversed: bool
    """True if a half turn to the position goes the other way round than by default: about the axis whose first non-zero component is
    negative.
    """


class Scored(Record):
    """Sequence of candidates with its score."""

    __slots__ = ()

    worth: Worth
    """Score: constraints, worst degree and criterion."""
    seconds: float
    """Total time of dwells and turns, in s."""
    sequence: list[Stop]
    """Candidates of the sequence, in order, with the slew paths to them."""


class Ties(Record):
    """Sequences near the best so far, counted by criterion."""

    __slots__ = ()

    degree: int
    """Smallest worst degree of the sequences."""
    counts: list[tuple[float, int, int]]
    """Criterion (in the unit of the criterion asked for), number of searched images of a sequence, number of sequences."""


class Best(Record):
    """Best sequences, best first, and the front of time against the criterion."""

    __slots__ = ()

    found: list[Scored]
    """Best sequences that were found, best first, up to the number to keep."""
    front: list[Scored]
    """Sequences of the smallest worst degree that none of these beats in both time and criterion, by time."""
    ties: Ties
    """Number of sequences as good as the best, by criterion."""
    complete: bool
    """True if the search was complete."""
    examined: int
    """Number of sequences whose sigma was computed."""
    excluded: int
    """Number of sequences, observable or not, that a bound excluded: they are worse than those kept."""
    lost: int
    """Number of examined sequences that are observable (by the exact verdict, of repositioning at once) but whose samples do not
    determine the required coefficients in double precision.
    """


class Block(Record):
    """Block of successive starts, and what its search found."""

    __slots__ = ()

    starts: tuple[int, int]
    """Starts of the block: index of the first, index behind the last (both from 0)."""
    counts: tuple[int, int, int]
    """Number of sequences examined, excluded by a bound, and lost to rounding."""
    digest: str
    """SHA-256 over the best sequences, the front, the ties and the counts of the block."""


class Level(Record):
    """Sequences found with one worst degree."""

    __slots__ = ()

    next: int
    """Index of the first start that is not yet searched."""
    best: Best
    """Best sequences, the front and the counts at this worst degree."""
    blocks: list[Block]
    """Blocks of starts that were searched, in order: any can be searched again by itself."""


class Part(Shape):
    """Part of an exhaustive search, done or interrupted."""

    schema: str
    """Layout of this answer: `obsdeg.part/2`."""
    version: str
    """Version of the program that wrote it."""
    digest: str
    """SHA-256 of all inputs: the parts of one search have the same."""
    inputs: dict[str, str]
    """Inputs of the search as a user writes them: options by name, and lines of the scheme file that states all conditions as
    `section.key`. They show the difference if digests differ.
    """
    asked: str | None
    """Options and files of the command that wrote it, as the JSON text that the command reads: its merge needs no others; null if no
    command did.
    """
    part: tuple[int, int]
    """Index of the part, from 1, then the number of parts."""
    starts: tuple[int, int, int]
    """Starts of the part: index of the first, index behind the last (both from 0), and the number of all starts."""
    levels: list[Level]
    """Sequences found, by worst degree, smallest first (under reset carry all degrees together)."""
    complete: bool
    """True if all of its starts were searched, at as many worst degrees as the whole may need."""
    seal: str
    """SHA-256 over all other fields: a part that was changed after it was written is refused."""

Truth = Literal["linear", "exact"]
"""Model that generates the truth of a simulated run. linear: Linear model of the filter: (2), (6). exact: Direction cosines: the drift
turns the true attitude, the specific force is taken in the true platform frame.
"""

Propagation = Literal["exponential", "rk4"]
"""Computation of the filter's transition matrix. exponential: Matrix exponential of the linear model. rk4: Runge-Kutta integration of
order four, as in the paper.
"""


class ConditionsReport(Record):
    """Conditions of a run with their units."""

    __slots__ = ()

    truth: Truth
    """Model that generates the truth: linear or exact."""
    latitude_deg: float
    """Latitude of the run, in degrees."""
    latitude_by_default: bool
    """True if the program chose the latitude."""
    step_s: float
    """Largest step between samples, in s."""
    settle_s: float | None
    """Time at the start of each position at rest, in s, whose samples do not count; left out where all count."""
    slew_rate_deg_s: float | None
    """Rate of slews in deg/s unless a position states its own; null for instantaneous slews."""
    accelerometer_noise_g: float
    """Noise of the observation per sample, in g."""
    accelerometer_bias: AccelerometerBias | None
    """Bias instability of the accelerometers, states of the filter and of the truth; left out where there is none."""
    drift_noise: str
    """Random drift with its unit."""
    drift_noise_density_deg_sqrt_h: tuple[float, float]
    """Density of the random drift, in deg/sqrt(h), in the shortest and in the longest step of the timeline."""
    drift_noise_step_s: float | None
    """Step, in s, for which a bias of one step was given; null for a density."""
    drift_noise_differs: bool
    """True if the density differs by more than 1 % from that with the given step."""
    gyro_noise: GyroNoise | None
    """Noise of the gyros by their datasheet, states of the filter and of the truth; left out where there is none."""
    propagation: Propagation
    """Propagation of the filter: exponential or rk4."""
    drift_scale: float
    """Factor on the true drifts and their priors, dimensionless."""
    bench: str | None
    """Bench that is stated: sizes (one sigma) of errors that are not estimated, in their units; left out where none is."""
    by_default: list[str]
    """Keys of the conditions that nobody states, so that the run has those of the program: latitude_deg, accelerometer_noise_g, step_s,
    dwell_s, azimuth_noise_deg, drift_noise, values, priors; other_values and other_priors where they are stated for some of the
    unknowns only.
    """


class TimelineReport(Record):
    """Position or slew of the timeline."""

    __slots__ = ()

    position: str
    """Name of the position, or of the one that a slew leads to."""
    slew: bool
    """True if this is a slew, false for a position."""
    start_s: float
    """Start of the position or slew, in s."""
    end_s: float
    """End of the position or slew, in s."""
    turn: Turn | None
    """Turn of the slew: its axis and angle; null for a position."""


class LinearEstimate(Record):
    """Estimate of the linear filter at the end of the run."""

    __slots__ = ()

    error: float
    """Estimate minus true value, in the unit of the unknown."""
    sigma: float
    """Standard deviation of the error by the linear filter, in the unit of the unknown."""

Outcome = Literal[
    "reached",
    "converging",
    "determined",
    "rests_on_prior",
    "prior_only",
    "large_angles_only",
    "inconsistent",
    "no_number",
]
"""Outcome of a run for one unknown or combination. reached: Reached: sigma, with a bench the total uncertainty, is at or below the
requirement. converging: Converging: sigma fell, but it, or with a bench the total uncertainty, is above the requirement. determined:
Determined: sigma fell; nothing is required of it. rests_on_prior: Determined by the samples, but sigma is (nearly) that of the prior.
prior_only: Not determined by the samples: sigma comes from the prior alone. large_angles_only: Not determined for small angles; a
filter with full attitudes learns of it through large ones. inconsistent: Inconsistent: the error is beyond four sigma, so the filter
is wrong. no_number: Error or sigma that is not a finite number.
"""


class Estimate(Record):
    """Estimate of one unknown or combination at the end of the run."""

    __slots__ = ()

    name: str
    """Name of the unknown, or the combination."""
    unit: str
    """Unit of the truth, the estimates and the sigmas."""
    status: Status
    """Verdict: observable, inseparable or not excited."""
    degree: int | None
    """Observable degree; null if not observable."""
    accuracy_order: int | None
    """Accuracy order; null if no dwell makes it observable, or if none were computed."""
    truth: float
    """True value, in the unit of `unit`."""
    estimate: float
    """Estimate at the end of the run, in the unit of `unit`."""
    error: float
    """Estimate minus true value, in the unit of `unit`."""
    sigma: float
    """Standard deviation of the error by the filter, in the unit of `unit`."""
    predicted_sigma: float | None
    """Predicted sigma under the stated conditions, in the unit of `unit`; null if neither samples nor stated priors bound it."""
    error_over_sigma: float
    """Error over sigma, dimensionless; about -3 to 3 for a consistent filter."""
    linear: LinearEstimate | None
    """Estimate of the linear filter from the same measurements; null if the run's filter is linear."""
    prior_sigma: float
    """Standard deviation at the start of the run, in the unit of `unit`."""
    required_sigma: float | None
    """Largest sigma allowed, in the unit of `unit`; null if none is required."""
    time_to_requirement_s: float | None
    """Time, in s, from which sigma meets the requirement to the end; null if it does not, if the total with a bench does not, or if the
    samples do not determine the unknown.
    """
    outcome: Outcome
    """Outcome of the run for this unknown or combination."""
    prior_of: list[str]
    """Indistinguishable unknowns whose priors the estimate relies on besides its own. Empty unless it is known from the prior only."""


class SigmaRatio(Record):
    """Ratio of a run's sigma to the predicted one."""

    __slots__ = ()

    name: str
    """Name of the unknown with this ratio."""
    ratio: float
    """Sigma of the run over the predicted sigma, dimensionless."""

RunDiffers = Literal["random_drift", "prior", "full_attitudes"]
"""Reason why the sigmas of a run may differ from the predicted ones. random_drift: Random drift of the program, since none is stated.
prior: Priors of the program, since not every unknown has a stated one. full_attitudes: Filter with full attitudes, while the
prediction is for small angles.
"""


class RunRequirements(Record):
    """Requirements by the sigmas of a run, beside the prediction."""

    __slots__ = ()

    requirements: Requirements
    """Outcome of the requirements in the run."""
    largest_ratio: SigmaRatio | None
    """Largest ratio of a sigma of the run to the predicted one, over the unknowns that have both; null if none has."""
    smallest_ratio: SigmaRatio | None
    """Smallest ratio of a sigma of the run to the predicted one; null if no unknown has both."""
    differs: list[RunDiffers]
    """Reasons why the sigmas of the run may differ from the predicted ones."""

Doubt = Literal["no_number", "nis", "nees", "error", "correlated"]
"""Statistical evidence against a run. no_number: Statistic, estimate or sigma that is not a finite number. nis: Mean NIS outside its
acceptance band of 99.9 %. nees: NEES above its acceptance band of 99.9 %. error: Error beyond four sigma of the filter. correlated:
Innovations that are not white.
"""


class Consistency(Record):
    """Consistency statistics of one run: NIS, NEES, whiteness and errors."""

    __slots__ = ()

    nis: float
    """Mean normalised innovation squared (NIS), dimensionless; its expectation is the number of outputs."""
    nis_band: tuple[float, float]
    """Band of 95 % of the mean NIS, dimensionless."""
    nis_wide_band: tuple[float, float]
    """Acceptance band of 99.9 % of the mean NIS, dimensionless."""
    nees: float
    """Normalised estimation error squared (NEES) at the end, dimensionless. Its expectation is the number of states (unknowns, and gyro
    biases that are states) without the directions left out.
    """
    unresolved_directions: int
    """Number of directions that the NEES leaves out: a filter linearised at its estimates claims to know them more than a million times
    better than the unknowns themselves. 0 for a linear model.
    """
    held_directions: int
    """Number of directions that the NEES leaves out because constraints of the model hold them: nothing is estimated there. 0 for a
    platform.
    """
    nees_band: tuple[float, float]
    """Band of 95 % of the NEES, dimensionless."""
    nees_limit: float
    """Upper end of the acceptance band of 99.9 % of the NEES, dimensionless. A small NEES is no evidence: true values are given, not
    drawn.
    """
    whiteness_probability: float
    """Probability that white noise has autocorrelations as large as the innovations', smallest over outputs."""
    beyond: list[str]
    """Unknowns with an error beyond four sigma."""
    doubts: list[Doubt]
    """Evidence against the run; empty if there is none."""
    consistent: bool
    """True if NIS, NEES, whiteness and errors all pass."""

FilterKind = Literal["linear", "extended", "iterated"]
"""Filter that estimates the unknowns. linear: Linear model with gains that are known beforehand: small psi. extended: Extended filter:
full attitudes, Jacobians at the current estimate. iterated: Iterated filter: full attitudes, relinearised along the whole run until
it converges.
"""

FilterReason = Literal["given", "linear_truth", "valid", "not_valid"]
"""Reason for the choice of a filter. given: Choice by a file or an option. linear_truth: Truth of the linear model. valid: Validity of
the small-angle model at the truth. not_valid: Invalidity of the small-angle model at the truth.
"""


class FilterReport(Record):
    """Filter of the run, and the reason for it."""

    __slots__ = ()

    kind: FilterKind
    """Filter of the run: linear, extended or iterated."""
    reason: FilterReason
    """Reason for the choice of this filter."""
    passes: int
    """Number of linearisations of the whole run: 1 except for the iterated filter."""
    converged: bool
    """True if the linearisations converged."""
    trusted: bool
    """False if the sigmas are not to be trusted even where one run is consistent: the small-angle model does not hold for the truth, and
    the filter is linear, or extended and so linearised before drifts are known.
    """


class Simulation(Shape):
    """Run of the filter against a simulated truth."""

    schema: str
    """Layout of this answer: `obsdeg.simulation/2`."""
    version: str
    """Version of the program that wrote it."""
    carry: Carry
    """Carry: quantity that continues from one position to the next."""
    conditions: ConditionsReport
    """Conditions of the run, with their units."""
    timeline: list[TimelineReport]
    """Positions and slews of the run, in order of time."""
    quantities: list[Estimate]
    """Estimates of the unknowns at the end of the run, in model order."""
    combinations: list[Estimate]
    """Estimates of observable combinations of unknowns that are not observable alone."""
    requirements: Requirements
    """Outcome of the requirements by prediction, as in every other command: the information of all samples with the noise, the random
    drift and the priors that are stated.
    """
    run: RunRequirements
    """Outcome of the requirements in this run, by the sigmas of its filter at the end; with a bench by their totals with its errors,
    which the truth of the run does not have.
    """
    other_carries: list[OtherCarry]
    """Outcome of the same scheme under the other carries."""
    omitted: OmittedEffects
    """Effect of what the scheme does not estimate, by the weights of the predicted sigmas."""
    consistency: Consistency
    """Consistency of errors and innovations with the filter's covariances."""
    filter: FilterReport
    """Filter of the run, and the reason for it."""
    validity: Validity
    """Validity of the small-angle model at these drifts."""
    noise_floor: NoiseFloor | None
    """Noise floor: the least sigmas of coefficients, however long the dwells; left out where the gyros have no noise of their own."""
    gimbals: GimbalReport | None
    """Angles and turns beyond the gimbal limits of the scheme; left out where it states none."""
    seed: int
    """Seed of the noise and of all random choices."""


class SystemEstimate(Record):
    """Estimate of one unknown at the end of the run."""

    __slots__ = ()

    name: str
    """Name of the unknown, as in the model."""
    unit: str
    """Unit of the unknown, as in the model file."""
    status: Status | None
    """Verdict on the unknown; null for a state with a known initial value."""
    degree: int | None
    """Observable degree; null if the unknown is not observable."""
    truth: float
    """True value of the unknown, in its unit."""
    estimate: float
    """Estimate of the unknown, in its unit."""
    error: float
    """Estimate minus true value, in the unit of the unknown."""
    sigma: float
    """Standard deviation of the error by the filter, in the unit of the unknown."""
    error_over_sigma: float
    """Error over sigma, dimensionless; about -3 to 3 for a consistent filter."""
    prior_sigma: float
    """Standard deviation at the start of the run, in the unit of the unknown."""
    outcome: Outcome
    """Outcome for the unknown; requirements do not exist here."""


class SystemRun(Shape):
    """Simulated run of a system with an extended Kalman filter."""

    schema: str
    """Layout of this answer: `obsdeg.system-run/1`."""
    version: str
    """Version of the program that wrote it."""
    name: str
    """Name of the system, as in its file."""
    quantities: list[SystemEstimate]
    """Estimates of the unknowns at the end of the run."""
    consistency: Consistency
    """Consistency of errors and innovations with the filter's covariances."""
    time: float | None
    """Time of the model at which the run begins, in its unit; 1 stands for a generic time. Null where neither the equations nor the
    known inputs hold the time.
    """
    duration: float
    """Duration of every experiment, in the unit of `t` in the model."""
    step: float
    """Time between two samples, in the unit of `t` in the model."""
    noise: list[tuple[str, float]]
    """Standard deviation of the noise of a sample, by output, in its unit."""
    priors_by_default: list[str]
    """Names of the unknowns whose prior the file does not state, so that the program chose it: the size of the true value, and 1 where
    that is zero.
    """
    error_bound: float | None
    """Bound on the probability that a verdict is wrong; null for a model judged in real numbers."""
    digits: DigitsReport | None
    """Margin of the rank decisions in real numbers; null for a model judged in prime fields."""
    seed: int
    """Seed of the noise and of the initial errors."""


class Counts(Record):
    """Number of checks by outcome."""

    __slots__ = ()

    agree: int
    """Number of checks that agree with the verdicts."""
    disagree: int
    """Number of checks that disagree with the verdicts."""
    not_resolvable: int
    """Number of checks that are not resolvable."""
    not_tested: int
    """Number of checks that were skipped."""

Agreement = Literal["agrees", "disagrees", "not_resolvable", "not_tested"]
"""Outcome of a check of a verdict. agrees: Agreement: the measurement confirms the verdict. disagrees: Disagreement: the measurement
contradicts the verdict. not_resolvable: Measurement that neither supports nor contradicts the verdict, by a test that the answer
states. not_tested: Check that was skipped: nothing was measured.
"""


class SpaceCheck(Record):
    """Property that is no number, predicted and measured."""

    __slots__ = ()

    what: str
    """Property that is compared with the samples."""
    predicted: str
    """Value by the exact verdicts."""
    measured: str
    """Value by the samples; empty if nothing was measured."""
    outcome: Agreement
    """Outcome of the comparison of both values."""


class Measured(Record):
    """Coverage of the predicted orders by measured slopes."""

    __slots__ = ()

    measured: int
    """Number of orders that were measured by a slope."""
    of: int
    """Number of unknowns and combinations that have an order."""


class Check(Record):
    """Number that was predicted and measured."""

    __slots__ = ()

    predicted: float
    """Predicted number by the exact verdict: a slope, factor, part or correlation, dimensionless."""
    measured: float | None
    """Measured number by the filter, dimensionless; null if it could not be measured."""
    outcome: Agreement
    """Outcome of the comparison of both numbers."""


class Partners(Record):
    """Unknowns indistinguishable from one: those in a common direction of minimal support that Z does not observe."""

    __slots__ = ()

    predicted: list[str]
    """Partners by the exact verdicts."""
    measured: list[str] | None
    """Partners by the directions that the samples do not show; null if they were not measured."""
    outcome: Agreement
    """Outcome of the comparison of both lists."""


class QuantityEvidence(Record):
    """Evidence on one unknown or combination."""

    __slots__ = ()

    name: str
    """Name of the unknown, or the combination."""
    status: Status
    """Verdict: observable, inseparable or not excited."""
    degree: int | None
    """Observable degree; null if not observable."""
    accuracy_order: int | None
    """Accuracy order; null if no dwell makes it observable, or if none were computed."""
    modelled: bool
    """True if the filter contains the unknown. A filter with a deliberate error may lack it; then nothing is measured."""
    degree_slope: Check
    """Evidence a: log-log slope of sigma against the dwell, with psi of the start of each position handed on to the next. Predicted
    -(degree + 1/2); 0 if nothing is learnt.
    """
    status_measured: Status | None
    """Evidence a: status by the same information, from the column of the unknown and the span of the rows; null if it was not measured."""
    status_outcome: Agreement
    """Outcome of the comparison with the verdict."""
    partners: Partners | None
    """Unknowns indistinguishable from it by derivatives; null for a combination."""
    slope: Check
    """Evidence a: log-log slope of sigma (psi: of the start) against the dwell. Predicted -(accuracy order + 1/2); 0 if nothing is
    learnt.
    """
    slope_at_end: Check
    """Log-log slope of sigma with psi of the end, as in a filter."""
    inflation: Check
    """Evidence b: factor on sigma (psi: of the end) when the prior variance is multiplied by 100."""


class NullEvidence(Record):
    """Evidence on one null vector."""

    __slots__ = ()

    direction: str
    """Null vector, as in `psi_y = 1, D_FZ = 6.4e-5`, in SI units."""
    seen: Check
    """Effect of the null vector on Z, relative to the most observable direction: predicted 0."""
    correlation: Check | None
    """Smallest correlation of its unknowns under a diffuse prior, signed by the prediction: predicted 1; null if other null vectors
    share its unknowns, or if it has only one.
    """


class Count(Record):
    """Count that was predicted and measured."""

    __slots__ = ()

    predicted: int
    """Number that the exact verdicts predict."""
    measured: int
    """Number that the samples show."""
    outcome: Agreement
    """Outcome of the comparison of both numbers."""


class CrossCheckDifference(Record):
    """Largest difference of two covariances."""

    __slots__ = ()

    name: str
    """Covariances or models that are compared."""
    difference: float
    """Largest relative difference, dimensionless: `max |P_ij - Q_ij| / sqrt(Q_ii Q_jj)`."""
    limit: float
    """Largest difference allowed, dimensionless."""
    outcome: Agreement
    """Outcome: agreement within the limit. Not resolvable if rounding may reach a tenth of the limit: largest variance of the prior,
    over the smallest at the end, times steps times 2e-16.
    """


class Statistic(Record):
    """Averaged statistic with its acceptance bands."""

    __slots__ = ()

    name: str
    """Name of the averaged statistic."""
    expected: float
    """Expectation of the average, dimensionless."""
    measured: float
    """Average over runs and samples, dimensionless."""
    band: tuple[float, float]
    """Band of 95 % of the average, dimensionless."""
    wide_band: tuple[float, float]
    """Acceptance band of 99.9 % of the average, dimensionless."""
    pass_: bool
    """True if `measured` lies inside its acceptance band."""


class HistoryPoint(Record):
    """Averages over the runs at one time."""

    __slots__ = ()

    t_s: float
    """Time since the start of the run, in s."""
    nees: float
    """Average NEES of all unknowns, dimensionless."""
    nis: float
    """Mean NIS since the point before, dimensionless."""
    samples: int
    """Number of samples in the mean NIS, all runs together."""


class MonteCarlo(Record):
    """Evidence d: statistics of Monte Carlo runs."""

    __slots__ = ()

    filter: FilterKind
    """Filter of the runs: linear, extended or iterated."""
    about_the_truth: bool
    """True if all runs have the scheme's own truth and draw initial estimates about it from the prior. If false, truths are drawn about
    the initial estimate.
    """
    runs: int
    """Number of runs, each with its own noise."""
    unsettled: int
    """Number of runs whose linearisations did not converge."""
    statistics: list[Statistic]
    """Average NEES and NIS, with their bands."""
    whiteness_probability: float
    """Probability that white innovations have autocorrelations as large."""
    white: bool
    """True if `whiteness_probability` is above 0.001."""
    history: list[HistoryPoint]
    """Average NEES and mean NIS over time."""


class Ranking(Record):
    """Rank correlation of all unknowns by predicted and measured orders."""

    __slots__ = ()

    kendall_tau: float | None
    """Kendall's tau-b of predicted and measured accuracy orders, dimensionless, -1 to 1; null if all are tied."""
    pass_: bool
    """True if `kendall_tau` is 1 (or all orders are tied on both sides)."""
    errors: float | None
    """Kendall's tau-b, dimensionless, of the predicted orders at the end and the errors of runs with full attitudes, root mean square in
    sigmas of the prior; null for a linear filter. It decides nothing: orders hold for short dwells, errors for those of the scheme.
    """


class Control(Record):
    """Filter with a deliberate model error, which the checks must detect."""

    __slots__ = ()

    name: str
    """Deliberate error of the filter's model."""
    failed: int
    """Number of checks of evidence a and b that fail with the filter."""
    checks: int
    """Number of checks of evidence a and b performed."""
    nis: float
    """Mean NIS of the filter, dimensionless."""
    band: tuple[float, float]
    """Band of 99.9 % of the mean NIS of a right filter, dimensionless."""
    off_deg: float
    """Angle in degrees by which the filter's latitude or attitude is wrong."""
    outcome: Agreement
    """Outcome: agreement if the error was detected. Not resolvable if it was not, and need not be."""


class SlopeCurve(Record):
    """Sigma against the dwell, for one unknown or combination."""

    __slots__ = ()

    name: str
    """Name of the unknown, or the combination."""
    unit: str
    """Unit of the sigmas in `points`."""
    accuracy_order: int | None
    """Accuracy order; null if no dwell makes it observable."""
    points: list[tuple[float, float]]
    """Points of the curve: `(dwell in s, sigma)`, sigma in the unit of `unit`."""


class Correlation(Record):
    """Correlation matrix of the estimates."""

    __slots__ = ()

    names: list[str]
    """Names of the unknowns, in the order of rows and columns."""
    values: list[list[float]]
    """Rows of the matrix: correlations, dimensionless, -1 to 1."""


class CrossCheck(Shape):
    """Cross-check of the verdicts on one scheme against filters and samples."""

    schema: str
    """Layout of this answer: `obsdeg.crosscheck/1`."""
    version: str
    """Version of the program that wrote it."""
    carry: Carry
    """Carry: quantity that continues from one position to the next."""
    filter: str | None
    """Deliberate error of the filter's model; null for the right filter."""
    conditions: ConditionsReport
    """Conditions of the runs, with their units."""
    bench: str | None
    """Bench that is stated, in words; no part of a cross-check. Null where none is stated."""
    timeline: list[TimelineReport]
    """Positions and slews of the run, in order of time."""
    passed: bool
    """True if no check disagrees, evidence a to f."""
    verdicts_agree: bool
    """True if no check but evidence d disagrees. Evidence d compares the filter with drawn truths and also fails if the small-angle
    model does not hold.
    """
    disagreements: list[str]
    """Disagreements of the checks, in words."""
    unresolved: list[str]
    """Reasons why checks are not resolvable, one for each such check."""
    counts: Counts
    """Number of checks by outcome."""
    method: list[str]
    """Method of measuring slopes, and criteria for a check that is not resolvable."""
    not_tested: list[str]
    """Statements of an analysis that no evidence checks."""
    spaces: list[SpaceCheck]
    """Evidence a: ranks, null space and combinations against the samples."""
    orders: Measured
    """Coverage of the accuracy orders by measured slopes."""
    quantities: list[QuantityEvidence]
    """Evidence a and b on each unknown and combination."""
    null_space: list[NullEvidence]
    """Evidence on each direction that Z does not observe."""
    defect: Count
    """Number of independent directions that Z does not observe."""
    covariance: list[CrossCheckDifference]
    """Evidence c: covariance of the filter against the inverse information."""
    monte_carlo: MonteCarlo
    """Evidence d: Monte Carlo statistics."""
    ranking: Ranking
    """Evidence e: rank correlation of predicted and measured orders."""
    controls: list[Control]
    """Evidence f: filters with a deliberate model error."""
    validity: Validity
    """Validity of the small-angle model at the true values."""
    slopes: list[SlopeCurve]
    """Sigma against dwell, for the plot."""
    correlation: Correlation
    """Correlation matrix of the estimates under a diffuse prior."""
    seed: int
    """Seed of the noise and of all random choices."""
    error_bound: float
    """Bound on the probability that a prediction is wrong."""


class SystemQuantityEvidence(Record):
    """Evidence on one unknown of a system, by the information of the samples."""

    __slots__ = ()

    name: str
    """Name of the unknown, as in the model."""
    status: Status
    """Verdict on the unknown by the exact analysis."""
    degree: int | None
    """Observable degree; null if the unknown is not observable."""
    slope: Check
    """Log-log slope of sigma against the horizon: predicted -(degree + 1/2); measured null if it does not settle above rounding."""
    inflation: Check
    """Factor on sigma at the full duration when the prior is ten times as loose: 1, or 10 for an unobservable unknown."""


class SymmetryEvidence(Record):
    """Evidence on one symmetry, by the information of the samples."""

    __slots__ = ()

    words: str
    """Symmetry in words, as in the analysis."""
    seen: Check
    """Information along the symmetry, relative to the largest: predicted 0."""


class SystemEvidence(Shape):
    """Cross-check of the verdicts on one system against the information of simulated samples."""

    schema: str
    """Layout of this answer: `obsdeg.system-evidence/1`."""
    version: str
    """Version of the program that wrote it."""
    name: str
    """Name of the system, as in its file."""
    quantities: list[SystemQuantityEvidence]
    """Evidence on each unknown, in model order."""
    symmetries: list[SymmetryEvidence]
    """Symmetries: the information along each, relative to the largest."""
    defect: Count
    """Number of unobservable directions: exact, and singular values that vanish."""
    failures: int
    """Number of checks that failed."""
    orders: Measured
    """Coverage of the degrees by measured slopes."""
    checks: int
    """Number of checks that agree or disagree, without those that are not resolvable or were skipped."""
    not_resolvable: int
    """Number of checks that neither support nor contradict a verdict: an unknown that affects the outputs by no more than rounding, or
    whose diffuse prior shrinks by less than a hundredth; singular values between observable and unobservable.
    """
    passed: bool
    """True if no check of the model failed."""
    seen_up_to: int | None
    """Bound on the order of derivatives up to which an unknown that is not seen was looked for; samples may see it by higher ones, which
    contradicts nothing. Null where the end is proven.
    """
    time: float | None
    """Time of the model at which the run begins, in its unit; 1 stands for a generic time. Null where neither the equations nor the
    known inputs hold the time.
    """
    duration: float
    """Longest horizon, of every experiment, in the unit of `t` in the model."""
    error_bound: float | None
    """Bound on the probability that a verdict is wrong; null for a model judged in real numbers."""
    digits: DigitsReport | None
    """Margin of the rank decisions in real numbers; null for a model judged in prime fields."""
    seed: int
    """Seed of all random choices."""


class TitleBlock(Record):
    """Title block of a review, as the file states it: nothing of it comes from the clock or from the computer."""

    __slots__ = ()

    reference: str
    """Number or reference of the document; empty when left out."""
    revision: str
    """Revision of the document, such as `B`; empty when left out."""
    date: str
    """Date of the document, as a text or a date of TOML; empty when left out."""
    author: str
    """Author of the document; empty when left out."""
    signatures: list[str]
    """Roles that sign the document, such as `['Checked', 'Approved']`: a line for each in a review."""


class ForceLength(Record):
    """Length of the specific force at a position."""

    __slots__ = ()

    position: str
    """Name of the position with this length."""
    length_g: float
    """Length of the specific force, in g."""

ForceError = Literal["scale", "zero"]
"""Kind of error of one axis. scale: Scale error, a fraction of the output. zero: Zero error, in g of the output."""


class ForceCause(Record):
    """Error of one axis that explains why the specific force is not one g long."""

    __slots__ = ()

    error: ForceError
    """Kind of the error: scale or zero."""
    axis: str
    """Output of the accelerometer: fx, fy, fz."""
    by: float
    """Error of the axis: scale as a fraction (dimensionless) or zero in g, by which the recorded output is larger."""
    sigma: float
    """Standard deviation of the error, as `by`: dimensionless (scale) or in g (zero)."""
    besides: float | None
    """Fraction by which the force is longer besides, at all positions alike, dimensionless; null for none."""

CellKind = Literal["code", "stuck"]
"""Kind of cells that hold one value again and again. code: Code of missing values: far from its neighbours. stuck: Stuck output: equal
to the rows before it to the last digit.
"""


class ClockRate(Record):
    """Rate error of the clock of a record, with its sigma."""

    __slots__ = ()

    fast: float
    """Fraction by which the clock is fast, dimensionless."""
    sigma: float
    """Standard deviation of `fast`, dimensionless: a fraction not much larger is not significant."""


class FindingInterrupted(Record):
    """Interrupted iteration: the estimates are where it was then."""

    __slots__ = ()

    kind: Literal["interrupted"]


class FindingNotSettled(Record):
    """Iteration that did not converge."""

    __slots__ = ()

    kind: Literal["not_settled"]


class FindingForce(Record):
    """Specific force that is not one g long, with no unknown that explains it."""

    __slots__ = ()

    kind: Literal["force"]
    record: str
    """Name of the record with this finding."""
    length_g: float
    """Mean length of the specific force in the record, in g."""
    alike: bool
    """True if the length is the same at all positions."""
    least: ForceLength
    """Position with the shortest specific force."""
    most: ForceLength
    """Position with the longest specific force."""
    causes: list[ForceCause]
    """Errors of one axis, each of which alone makes the force one g long; empty if several axes are wrong, or all alike."""


class FindingCells(Record):
    """Cells of a column that hold one value again and again, far from their neighbours or many times in a row; they were left out."""

    __slots__ = ()

    kind: Literal["cells"]
    record: str
    """Name of the record with this finding."""
    column: str
    """Column of these cells, as in the header of the record."""
    kind_of_cells: CellKind
    """Kind of these cells: a code of missing values, or a stuck output."""
    value: float
    """Value of these cells, in the unit of the column."""
    count: int
    """Number of cells that hold the value."""
    lines: tuple[int, int]
    """First and last line number of these cells in the record."""


class FindingSuccession(Record):
    """Measurements in succession that lie off to the same side; they were left out. Outliers are independent of each other: these are a
    step of an output, or the platform moved.
    """

    __slots__ = ()

    kind: Literal["succession"]
    record: str
    """Name of the record with this finding."""
    position: str
    """Name of the position at which these measurements lie."""
    channel: str
    """Component of Z (`Z1`, `Z2`, `Z3` or `Za`) or, for single cells, the column of the record."""
    count: int
    """Number of these measurements."""
    lines: tuple[int, int]
    """First and last line number in the record."""
    span_s: tuple[float, float]
    """Times of the first and the last one, in s of the record's timeline."""
    sigmas: tuple[float, float]
    """Least and largest distance from the expected value, in standard deviations (dimensionless)."""


class FindingCopy(Record):
    """Record with the noise of another one: a copy, whose numbers count twice."""

    __slots__ = ()

    kind: Literal["copy"]
    record: str
    """Name of the record with this finding."""
    other: str
    """Name of the record with the same noise."""
    correlation: float
    """Coefficient of correlation of the residuals of both, dimensionless, -1 to 1."""


class FindingTurns(Record):
    """Turns that last longer or shorter than in the scheme, while positions do not."""

    __slots__ = ()

    kind: Literal["turns"]
    record: str
    """Name of the record with this finding."""
    factor: float
    """Duration of a turn in the record over that in the scheme, dimensionless."""
    slew_rate_deg_s: float | None
    """Slew rate of the record, in deg/s; null where the scheme states none for all slews."""


class FindingClockJump(Record):
    """Clock of a record that was set forward during the run: with the times behind a gap corrected, chi-square falls to a twentieth or
    less.
    """

    __slots__ = ()

    kind: Literal["clock_jump"]
    record: str
    """Name of the record with this finding."""
    line: int
    """Line number of the first row behind the jump."""
    place: str
    """Position of the rows before and behind the jump, or both positions if they differ."""
    from_s: float
    """Time of the last row before the jump, in s as in the record."""
    by_s: float
    """Time by which the clock was set forward, in s."""
    chi_square: float
    """Chi-square per degree of freedom with the times corrected, dimensionless."""
    explains: bool
    """True if the model explains the records with the times corrected; there are no other findings then."""


class FindingClock(Record):
    """Clock of a record that does not run as fast as that of the scheme, or as the earth turns."""

    __slots__ = ()

    kind: Literal["clock"]
    record: str
    """Name of the record with this finding."""
    by_durations: float | None
    """Fraction by which the clock is fast, by the times at which positions begin and end, dimensionless; null if they show none."""
    by_durations_sigma: float | None
    """Standard deviation of `by_durations`, dimensionless: rows leave the begin and the end of a position open by the time between two
    of them; null without `by_durations`.
    """
    by_changes: ClockRate | None
    """Rate error of the clock by the times at which the drift changes with the position; null if that is within chance."""
    by_earth: ClockRate | None
    """Fraction by which the clock is fast by the rate of the earth; null if that is within chance."""


class FindingPosition(Record):
    """Position that fits worse than its measurements allow."""

    __slots__ = ()

    kind: Literal["position"]
    record: str
    """Name of the record with this finding."""
    position: str
    """Name of the position with this finding."""
    chi_square: float
    """Chi-square per degree of freedom, dimensionless; 1 is expected."""
    factor: float
    """Factor by which the sigmas are too small there, dimensionless: the root of `chi_square`."""


class FindingNoise(Record):
    """Positions that all fit alike, and not as their sigmas say."""

    __slots__ = ()

    kind: Literal["noise"]
    chi_square: float
    """Chi-square per degree of freedom, dimensionless; 1 is expected."""
    factor: float
    """Factor to multiply the sigmas by, dimensionless."""


class FindingChannel(Record):
    """Component of Z that does not fit as its sigma says."""

    __slots__ = ()

    kind: Literal["channel"]
    channel: str
    """Component of Z: `Z1`, `Z2`, `Z3` or `Za`."""
    chi_square: float
    """Chi-square per degree of freedom, dimensionless; 1 is expected."""
    factor: float
    """Factor to multiply its sigma by, dimensionless."""


class FindingCorrelated(Record):
    """Residuals of a component that are not independent of each other."""

    __slots__ = ()

    kind: Literal["correlated"]
    record: str
    """Name of the record with this finding."""
    channel: str
    """Component of Z: `Z1`, `Z2`, `Z3` or `Za`."""
    probability: float
    """Probability that independent residuals are as correlated as these."""


class FindingTemperature(Record):
    """Residuals of a component that follow the temperature."""

    __slots__ = ()

    kind: Literal["temperature"]
    record: str
    """Name of the record with this finding."""
    channel: str
    """Component of Z: `Z1`, `Z2`, `Z3` or `Za`."""
    correlation: float
    """Coefficient of correlation of residuals and temperature, dimensionless, -1 to 1."""
    probability: float
    """Probability that chance alone gives such a correlation."""


class FindingOutliers(Record):
    """Too many measurements lie far off for all of them to be outliers; none of these was left out."""

    __slots__ = ()

    kind: Literal["outliers"]
    count: int
    """Number of measurements that lie far off."""
    of: int
    """Total number of measurements."""


class FindingRepeatability(Record):
    """Records that do not agree on the coefficients."""

    __slots__ = ()

    kind: Literal["repeatability"]
    chi_square: float
    """Chi-square per degree of freedom, dimensionless; 1 is expected."""


class FindingSecondPath(Record):
    """Filter and least squares that do not agree."""

    __slots__ = ()

    kind: Literal["second_path"]
    difference: float
    """Largest difference of both, in sigma, dimensionless."""


class FindingSuspect(Record):
    """Error that is not among the unknowns and explains the residuals: see `omitted`."""

    __slots__ = ()

    kind: Literal["suspect"]
    errors: list[str]
    """Names of the errors: one, or a pair where a second one explains more than chance would."""
    chi_square_fall: float
    """Fall of chi-square with them among the unknowns, dimensionless."""


class FindingKnown(Record):
    """Prior knowledge that does not agree with the records."""

    __slots__ = ()

    kind: Literal["known"]
    chi_square: float
    """Chi-square per degree of freedom, dimensionless; 1 is expected."""

Finding = Union[
    FindingInterrupted,
    FindingNotSettled,
    FindingForce,
    FindingCells,
    FindingSuccession,
    FindingCopy,
    FindingTurns,
    FindingClockJump,
    FindingClock,
    FindingPosition,
    FindingNoise,
    FindingChannel,
    FindingCorrelated,
    FindingTemperature,
    FindingOutliers,
    FindingRepeatability,
    FindingSecondPath,
    FindingSuspect,
    FindingKnown,
]
"""Evidence against the model or its sigmas."""


class Estimated(Record):
    """Estimate of an unknown or a combination."""

    __slots__ = ()

    name: str
    """Name of the unknown, or the combination."""
    unit: str
    """Unit of the estimate: deg, deg/h, deg/h/g, ..."""
    status: Status
    """Verdict of the scheme on the unknown or combination."""
    degree: int | None
    """Observable degree; null if not observable."""
    determined: bool
    """True if scheme and records determine it. If false, there is no estimate."""
    estimate: float | None
    """Estimate in the unit of `unit`; null if not determined."""
    sigma: float | None
    """Standard deviation of the estimate by the assumed noise, in the unit of `unit`; null if not determined."""
    sigma_rescaled: float | None
    """Standard deviation, in the unit of `unit`, with errors of the records times the root of chi-square per degree of freedom, where
    that is above one; prior knowledge stays as it is. Null if not determined.
    """
    predicted_sigma: float | None
    """Standard deviation, in the unit of `unit`, by the linear model at the attitudes of the scheme, with the times and the noise of the
    records (and prior knowledge); null if not determined.
    """
    total: float | None
    """Total uncertainty that requirements are judged by, in the unit of `unit`: the larger sigma, what the bench adds, and how far a
    suspected error moves the estimate; null where these add nothing.
    """
    required_sigma: float | None
    """Largest sigma that the scheme requires, in the unit of `unit`; null if none is stated."""
    held_factor: float | None
    """Sigma over that with all undetermined unknowns known, dimensionless: above one if the nonlinear model couples an unknown that
    stays open within its box to the estimate. Null if not determined.
    """
    open_sigma: float | None
    """Part of sigma, in the unit of `unit`, by what the records leave open within its box (see `assumed.held`): zero if nothing of it
    bends into the estimate. Null if not determined.
    """
    from_prior: bool
    """True if the estimate rests on a stated prior: scheme and records alone do not determine it."""
    prior_shift: float | None
    """Shift that the program's prior would make to the estimate, in sigma (dimensionless); null if not determined, and if priors are
    stated: these are in the estimate.
    """
    prior_factor: float | None
    """Factor on sigma that the program's prior would make, dimensionless: 1 where it does not matter; null as `prior_shift`."""
    left_open: bool
    """True if scheme and records determine it at small drifts, but at the drifts of these records what they leave open bends the run, so
    that no sigma describes its error. `determined` is false then.
    """

Decision = Literal["accepted", "rejected", "undecided"]
"""Decision on a coefficient with limits. accepted: Estimate within the limits by more than the guard band. rejected: Estimate beyond a
limit by more than the guard band. undecided: Estimate within the guard band of a limit, a coefficient that is not determined or
bounded by priors alone, or a calibration that is not consistent.
"""


class AcceptanceLimit(Record):
    """Coefficient with its limits and the decision on it."""

    __slots__ = ()

    name: str
    """Name of the coefficient, such as D_FX."""
    unit: str
    """Unit of the limits, the estimate and the uncertainty."""
    low: float
    """Lowest value allowed, in the unit of `unit`."""
    high: float
    """Highest value allowed, in the unit of `unit`."""
    uncertainty: float | None
    """Standard uncertainty of the estimate, in the unit of `unit`; null if the coefficient is not determined."""
    accepted: tuple[float, float] | None
    """Lowest and highest estimate that is accepted, in the unit of `unit`; null if the uncertainty allows none."""
    rejected_beyond: tuple[float, float] | None
    """Estimates, in the unit of `unit`, below and above which the coefficient is rejected; null without an uncertainty."""
    by_prior: bool
    """True if the samples do not determine the coefficient, so that stated priors alone bound it: it stays undecided."""
    estimate: float | None
    """Estimate of the coefficient, in the unit of `unit`; null before a run, and if it is not determined."""
    decision: Decision | None
    """Decision on the estimate; null before a run."""


class AcceptanceReport(Record):
    """Decisions on all coefficients with limits."""

    __slots__ = ()

    risk: float
    """Largest probability, dimensionless, that an accepted coefficient lies outside its limits, and that a coefficient within them is
    rejected.
    """
    valid: bool
    """True if the decisions stand; false for a calibration that is not consistent, whose uncertainties do not count."""
    limits: list[AcceptanceLimit]
    """Coefficients with limits, in model order."""


class NextRun(Record):
    """A further run that brings a coefficient closer to its requirement: a dwell at one attitude, calibrated with this answer as prior
    (`--prior`).
    """

    __slots__ = ()

    unknown: str
    """Name of the coefficient whose requirement is missed."""
    unit: str
    """Unit of the sigmas of the coefficient, such as deg/h."""
    sigma: float | None
    """Sigma by this answer, rescaled, in the unit of `unit`; null if not determined."""
    required_sigma: float
    """Largest sigma that meets the requirement, in the unit of `unit`; zero if a bench alone uses it up. It is less than the requirement
    if a bench adds to it.
    """
    attitude: str | None
    """Attitude of the run: the name of a cardinal attitude, or of a position of the scheme. Null if no attitude makes sigma smaller by 1
    %.
    """
    dwell_s: float | None
    """Dwell in s: the shortest that meets the requirement to 1 %; if none does, 16 times the longest dwell of the scheme. Null as
    `attitude`.
    """
    sigma_then: float | None
    """Sigma after this run, in the unit of `unit`, by the linear model. Null as `attitude`."""
    met: bool
    """True if that meets the requirement."""


class CovarianceTable(Record):
    """Estimates with the covariance of their errors."""

    __slots__ = ()

    names: list[str]
    """Names, in the order of rows and columns."""
    units: list[str]
    """Units of the estimates, in the same order."""
    estimates: list[float]
    """Estimates in the same order, each in its unit."""
    covariance: list[list[float]]
    """Covariance of the errors by the assumed noise, in products of the units of row and column."""
    rescaled: list[list[float]]
    """Covariance, in products of the units of row and column, with errors of the data times the root of chi-square per degree of
    freedom, where that is above one; prior knowledge stays as it is.
    """


class Fit(Record):
    """Quality of the whole fit: chi-square, its band and its factor."""

    __slots__ = ()

    chi_square: float
    """Chi-square: the sum of squares of all residuals in sigma, dimensionless."""
    degrees_of_freedom: float
    """Number of degrees of freedom of chi-square; fractions occur."""
    band: tuple[float, float]
    """Acceptance band of 99.9 % of chi-square per degree of freedom, dimensionless."""
    factor: float
    """Factor to multiply sigmas by: the root of chi-square per degree of freedom, dimensionless."""
    passes: int
    """Number of linearisations until convergence."""


class Curvature(Record):
    """Curvature of the estimates over what the records and priors leave open."""

    __slots__ = ()

    kappa: float | None
    """Largest difference of the run and its linear model along the longest axes of the estimates' errors, in sigma (dimensionless):
    below 0.4 the linear covariance holds. Null if the run cannot be followed there, or if another minimum fits nearly as well.
    """
    samples: int
    """Number of weighted samples of the posterior (0 below a curvature of 0.4)."""
    failed: int
    """Number of samples that were not found (the equation of each is solved by iteration): the first ends the search, with no estimate."""
    from_samples: bool
    """True if estimates and sigmas are mean and covariance of the samples of the posterior."""


class Moved(Record):
    """Change of an unknown or combination without one position."""

    __slots__ = ()

    name: str
    """Name of the unknown, or the combination."""
    sigmas: float
    """Change over its standard deviation, dimensionless."""


class PositionFit(Record):
    """Quality of the fit at one position of a record."""

    __slots__ = ()

    record: str
    """Name of the record with this position."""
    position: str
    """Name of the position in the scheme."""
    start_s: float
    """Start of the position, in s of the record's timeline."""
    end_s: float
    """End of the position, in s of the record's timeline."""
    force_g: float | None
    """Length of the specific force at the position, in g: a median, which single samples do not affect; null if the record has no
    forces.
    """
    measurements: int
    """Number of measurements: components of Z of bins."""
    chi_square: float
    """Chi-square per degree of freedom, dimensionless; 1 is expected."""
    degrees_of_freedom: float
    """Number of degrees of freedom of chi-square; fractions occur."""
    moves: Moved | None
    """Unknown that changes most without the position; null if there is none."""
    loses: list[str]
    """Unknowns and combinations that are not determined without the position."""


class Warmth(Record):
    """Correlation of residuals and temperature, position by position."""

    __slots__ = ()

    correlation: float
    """Coefficient of correlation at the position where it is strongest, dimensionless, -1 to 1."""
    probability: float
    """Probability that residuals independent of the temperature are as correlated, all positions together (R. A. Fisher, Metron 1,
    1921).
    """


class ChannelFit(Record):
    """Quality of the fit of one component of Z."""

    __slots__ = ()

    channel: str
    """Component of Z: `Z1`, `Z2`, `Z3` or `Za`."""
    unit: str
    """Unit of `sigma` and `scatter`: g or rad."""
    sigma: float
    """Standard deviation of a sample as assumed, in the unit of `unit`."""
    scatter: float | None
    """Standard deviation of a sample, in the unit of `unit`, by the scatter of the samples of a bin about a line; null if bins have too
    few.
    """
    chi_square: float
    """Chi-square per degree of freedom, dimensionless; 1 is expected."""
    degrees_of_freedom: float
    """Number of degrees of freedom of chi-square; fractions occur."""
    whiteness_probability: float | None
    """Smallest probability over the records that independent residuals are as correlated as these; null for few."""
    temperature: Warmth | None
    """Correlation of residuals and temperature in the record where chance is least likely; null without temperature, and for few."""


class Outlier(Record):
    """Measurement that was left out as an outlier."""

    __slots__ = ()

    record: str
    """Name of the record with the outlier."""
    lines: tuple[int, int]
    """First and last line number of the measurement in the record."""
    t_s: float
    """Time of the measurement, in s of the record's timeline."""
    channel: str
    """Component of Z (`Z1`, `Z2`, `Z3` or `Za`) or, for a single cell, the column of the record."""
    sigmas: float
    """Distance from the expected value, in standard deviations (dimensionless)."""


class SecondPath(Record):
    """Filter against least squares, with one wide prior for both."""

    __slots__ = ()

    difference: float
    """Largest difference of the estimates at the end of a record, in sigma (dimensionless)."""
    sigma_difference: float
    """Largest relative difference of sigmas there, dimensionless."""


class Repeatability(Record):
    """Agreement of several records of one platform."""

    __slots__ = ()

    chi_square: float
    """Chi-square per degree of freedom of the differences between the records' coefficients, dimensionless."""
    degrees_of_freedom: float
    """Number of degrees of freedom of chi-square; fractions occur."""
    band: tuple[float, float]
    """Acceptance band of 99.9 % of chi-square per degree of freedom, dimensionless."""


class Gap(Record):
    """Gap in a record: an interval without rows."""

    __slots__ = ()

    from_s: float
    """Time of the row before the gap, in s as in the record."""
    to_s: float
    """Time of the row after the gap, in s as in the record."""
    line: int
    """Line number of the row after the gap."""
    place: str
    """Position of the rows before and after the gap, or both positions if they differ."""


class EmptyCells(Record):
    """Number of empty cells in a column of a record."""

    __slots__ = ()

    column: str
    """Column of the cells, as in the header of the record."""
    count: int
    """Number of cells that are empty or NaN, in rows at positions."""

PositionsBy = Literal["labels", "timeline", "both", "static"]
"""Source of the position of each sample. labels: Column of labels: a position ends behind its last sample, and the next begins when the
slew is over; a change lies in the middle of what the rows beside it leave open. timeline: Timeline of the scheme, by the times of the
samples. both: Column of labels that agrees with the timeline of the scheme, which sets the start and end of a position. static:
Intervals at rest that were found, as many as the scheme has positions; slews lie in the middle between them.
"""


class Clock(Record):
    """Offset and rate error of the clock of a record."""

    __slots__ = ()

    offset_s: float | None
    """Time of the record, in s, at which the scheme begins; null where positions are held otherwise than in the scheme, so that rows
    alone say when each begins.
    """
    offset_sigma_s: float | None
    """Standard deviation of that time, in s; null where it was not estimated: the labels of the rows agree with it."""
    by_durations: float | None
    """Fraction by which the clock is fast, dimensionless, if positions begin and end as in a scheme with all times stretched by it: a
    clock, or a scheme run so; null if not.
    """
    by_durations_sigma: float | None
    """Standard deviation of `by_durations`, dimensionless: rows leave the begin and the end of a position open by the time between two
    of them; null without `by_durations`.
    """
    by_changes: ClockRate | None
    """Rate error of the clock by the times at which the drift changes with the position, on the timeline of the scheme: a clock, or
    positions held longer or shorter. Null where positions are held otherwise than in the scheme, or where drifts change too little.
    """
    by_earth: ClockRate | None
    """Fraction by which the clock is fast by the rate of the earth when all unknowns follow; drifts are too small by the same fraction.
    Null if its sigma would be above a third.
    """


class RecordReport(Record):
    """Record that was read, with its clock and columns."""

    __slots__ = ()

    name: str
    """Name of the record, as it was given."""
    samples: int
    """Number of samples in the record."""
    interval_s: float
    """Usual interval between rows, in s."""
    gaps: list[Gap]
    """Intervals of more than three usual ones without rows, beyond the time of the slew where one lies between; at most 1000."""
    empty_cells: list[EmptyCells]
    """Number of empty cells at positions, by column that is read; columns without are left out."""
    psi_at_s: float
    """Time of the record, in s, at which psi is estimated: the start of the scheme's first position, or the first row at it where only
    rows say when positions begin.
    """
    unused: int
    """Number of samples at no position of the scheme."""
    waiting: int
    """Number of samples at positions that were left out because the platform waits for rest (`settle` of the scheme file)."""
    bins: int
    """Number of bins of the samples."""
    span_s: tuple[float, float]
    """First and last time of the record, in s."""
    positions_by: PositionsBy
    """Source of the position of each sample."""
    change_open_s: float | None
    """Longest interval, in s, in which a change of position may lie by the rows beside it: its time is uniform there, which is part of
    the sigmas. Null where the scheme says when positions change, or no drift passes from one to the next.
    """
    ignored: list[str]
    """Columns that are not used."""
    force_g: float | None
    """Mean length of the specific force, in g; null if the record has no forces."""
    gimbals_deg: float | None
    """Largest distance of the gimbals from the attitudes of the scheme, in deg; null if the record has no gimbal angles."""
    clock: Clock
    """Rate error of the clock of the record."""


class Assumed(Record):
    """Assumptions of the estimates: conditions, noise, priors and gate."""

    __slots__ = ()

    latitude_deg: float
    """Latitude of the calibration, in deg."""
    latitude_by_default: bool
    """True if the scheme states no latitude."""
    gravity_m_s2: float
    """Acceleration of one g, in m/s^2."""
    bin_s: float
    """Width of a bin, in s: samples within it are taken together."""
    accelerometer_noise_g: float
    """White noise of Z per sample and axis as given, in g."""
    noise_estimated: bool
    """True if the noise was estimated from the records."""
    drift_noise_deg_sqrt_h: float
    """Density of the white drift, in deg/sqrt(h)."""
    gate: float
    """Probability that no measurement of a right record is left out."""
    known: list[str]
    """Names of the unknowns and combinations taken from a calibration before."""
    known_differs: list[str]
    """Differences of the scheme of that calibration."""
    priors: list[tuple[str, float, str]]
    """Priors that the estimates hold as stated: name of the unknown, standard deviation in its unit, and that unit. Empty: estimates by
    the data alone.
    """
    held: list[tuple[str, float, str]]
    """Box of what the records leave open: name of the unknown, one standard deviation in its unit, and that unit."""
    by_default: list[str]
    """Keys of the conditions that nobody states, so that the program chose them: latitude_deg, accelerometer_noise_g, drift_noise."""
    seed: int
    """Seed of the exact verdicts."""


class SuspectedError(Record):
    """Error that explains residuals, with its estimate."""

    __slots__ = ()

    name: str
    """Name of the error, such as `K0_Y`."""
    unit: str
    """Unit of its estimate and sigma."""
    estimate: float
    """Estimate of the error from the residuals, in the unit of `unit`."""
    sigma: float
    """Standard deviation of the estimate by the stated noise, in the unit of `unit`."""
    indistinguishable: list[str]
    """Other errors that this record does not distinguish from this one, by name."""


class SuspectedChange(Record):
    """Estimate without and with suspected errors among the unknowns."""

    __slots__ = ()

    unknown: str
    """Name of the unknown that is estimated."""
    unit: str
    """Unit of both estimates of the unknown."""
    estimate: float
    """Estimate of the fit, in the unit of `unit`."""
    with_: float
    """Estimate with the suspected errors among the unknowns, in the unit of `unit`."""
    lowest: float
    """Lowest estimate with the suspected error or one of `indistinguishable` among the unknowns, in the unit of `unit`."""
    highest: float
    """Highest estimate with the suspected error or one of `indistinguishable` among the unknowns, in the unit of `unit`."""


class Suspicion(Record):
    """Suspicion that errors that are not estimated are in a record."""

    __slots__ = ()

    errors: list[SuspectedError]
    """One error, or a pair where a second one explains more of the residuals than chance would."""
    indistinguishable: list[str]
    """Other errors that this record does not distinguish from the first one, by name."""
    explained: bool
    """True if the residuals are within their band with the errors among the unknowns; false if something is left that they do not
    explain.
    """
    chi_square_fall: float
    """Fall of chi-square with the errors among the unknowns, dimensionless."""
    probability: float
    """Bound on the probability that chance gives such a fall to any of the errors that were tried."""
    changes: list[SuspectedChange]
    """Estimates that the errors, or an indistinguishable one, change most in their own sigma, the largest change first."""


class SilentError(Record):
    """Error that no record of a scheme shows."""

    __slots__ = ()

    name: str
    """Name of the error, such as `K0_X`."""
    unit: str
    """Unit of its size: ug, ppm, arcsec, ..."""
    changes: list[str]
    """Names of the unknowns whose estimates it changes."""
    sensitivities: list[ChangePerUnit]
    """Changes of the coefficients per unit of the error: the same whatever the record says."""


class FamilyLimit(Record):
    """Size of all terms of a family of errors at which a requirement is just met."""

    __slots__ = ()

    family: str
    """Name of the family, such as `K0` or `latitude`."""
    unit: str
    """Unit of its sizes: ug, ppm, arcsec, ..."""
    unknown: str
    """Name of the unknown whose requirement is reached first."""
    size: float
    """Size (one sigma) of each term of the family, in the unit of `unit`."""


class Omitted(Record):
    """Errors that a calibration does not estimate."""

    __slots__ = ()

    tried: int
    """Number of errors that were tried, each by a score test on the residuals: those that a record can show."""
    suspicion: Suspicion | None
    """Error or pair that explains residuals better than chance; null where chance is enough."""
    silent: list[SilentError]
    """Errors that no record of this scheme shows and that change a coefficient."""
    limits: list[FamilyLimit]
    """Sizes of families that the bench does not state in full, at which one by itself uses up the margin of a requirement; empty where a
    requirement is missed or none is stated.
    """


class Setup(Record):
    """Setup of a scheme: the meaning of its coefficients, and the identity of records of its runs."""

    __slots__ = ()

    terms: str
    """Terms of the error model, as in `--terms`."""
    geometry: Geometry
    """Mounting of the gyros and accelerometers."""
    carry: Carry
    """Carry: quantity that continues from one position to the next."""
    latitude_deg: float
    """Latitude in deg; 28.2 if the scheme states none."""
    measured_azimuth: bool
    """True if psi_y is measured."""
    positions: list[tuple[str, str]]
    """Names and Euler angles in deg of the positions."""


class Basis2(Record):
    """Record that estimates rest on."""

    __slots__ = ()

    record: str
    """Name of the record, as it was given."""
    digest: str
    """Digest of the numbers of the record."""


class ResidualSeries(Record):
    """Residuals of a component in a record, in order of time."""

    __slots__ = ()

    record: str
    """Name of the record with these residuals."""
    channel: str
    """Component of Z: `Z1`, `Z2`, `Z3` or `Za`."""
    unit: str
    """Unit of the residuals: g or rad."""
    points: list[tuple[float, float, float]]
    """Time in s, residual and its sigma by the assumed noise in the unit of `unit`: at most a thousand points, evenly picked."""
    autocorrelation: list[float]
    """Correlation of the residuals with those one, two, ... measurements later, dimensionless."""
    count: int
    """Number of residuals, listed here or not."""
    allan: list[tuple[float, float, float]]
    """Cluster time in s, overlapping Allan deviation of the residuals (IEEE Std 952-1997, C.1), and that of white residuals of the
    assumed sigma, both in the unit of `unit`; slews take no time here.
    """


class Calibration(Shape):
    """Calibration of a scheme from one or several records."""

    schema: str
    """Layout of this answer: `obsdeg.calibration/1`."""
    version: str
    """Version of the program that wrote it."""
    name: str
    """Name of the scheme; empty if it has none."""
    document: TitleBlock
    """Title block of the scheme's documents."""
    consistent: bool
    """True if the model and its sigmas explain the records."""
    findings: list[Finding]
    """Evidence against the model or its sigmas, the gravest first; empty if there is none."""
    quantities: list[Estimated]
    """Estimates of the unknowns, psi of the start of each record."""
    requirements: Requirements | None
    """Outcome of the requirements on coefficients by the sigmas of the estimates, rescaled where they are too small, with what a bench
    adds and what a suspected error would change; null if none is stated. Requirements on psi are not judged: a calibration estimates
    psi of the start of a record.
    """
    acceptance: AcceptanceReport | None
    """Acceptance of the coefficients within the limits of the scheme, by the same uncertainties; null if no limits are stated."""
    next_runs: list[NextRun]
    """Further runs that bring coefficients to requirements they miss; empty if none is missed."""
    combinations: list[Estimated]
    """Estimates of combinations of unknowns that are not determined alone, and of those asked for."""
    covariance: CovarianceTable
    """Covariance of all estimates that do not follow from others."""
    fit: Fit
    """Quality of the whole fit: chi-square, its band and its factor."""
    curvature: Curvature
    """Curvature of the estimates over what the records and priors leave open."""
    positions: list[PositionFit]
    """Quality of the fit by record and position."""
    channels: list[ChannelFit]
    """Quality of the fit by component of Z."""
    outliers: list[Outlier]
    """Measurements that were left out as outliers."""
    outlier_count: int
    """Number of measurements that were left out as outliers."""
    second_path: SecondPath
    """Second path to the estimate: the filter against least squares."""
    repeatability: Repeatability | None
    """Agreement of the coefficients of several records; null for one record."""
    records: list[RecordReport]
    """Records that were read, with their clocks and columns."""
    assumed: Assumed
    """Assumptions of the estimates: conditions, noise, priors and gate."""
    omitted: Omitted
    """Errors that the scheme does not estimate: suspicion in these records, and what they cannot show."""
    setup: Setup
    """Scheme, geometry and carry that were calibrated."""
    rests_on: list[Basis2]
    """Records that the estimates rest on, including those of the calibration before."""
    series: list[ResidualSeries]
    """Residuals over time, by record and component."""


class SystemFindingInterrupted(Record):
    """Interrupted iteration: the estimates are where the best one was then."""

    __slots__ = ()

    kind: Literal["interrupted"]


class SystemFindingNotSettled(Record):
    """Iteration that did not converge from any start."""

    __slots__ = ()

    kind: Literal["not_settled"]


class SystemFindingNoise(Record):
    """Chi-square that is outside its acceptance band."""

    __slots__ = ()

    kind: Literal["noise"]
    chi_square: float
    """Chi-square per degree of freedom, dimensionless; 1 is expected."""
    factor: float
    """Factor to multiply the sigmas by, dimensionless."""


class SystemFindingCorrelated(Record):
    """Residuals of an output that are not independent of each other."""

    __slots__ = ()

    kind: Literal["correlated"]
    output: str
    """Name of the output with this finding."""
    probability: float
    """Probability that independent residuals are as correlated as these."""


class SystemFindingOutlier(Record):
    """Measurement that is far from its expected value."""

    __slots__ = ()

    kind: Literal["outlier"]
    output: str
    """Name of the output with this finding."""
    line: int
    """Line number of the measurement in the record."""
    sigmas: float
    """Residual in sigma by the other measurements (at least the given sigma), dimensionless."""

SystemFinding = Union[
    SystemFindingInterrupted,
    SystemFindingNotSettled,
    SystemFindingNoise,
    SystemFindingCorrelated,
    SystemFindingOutlier,
]
"""Evidence against the model or the noise."""


class SystemEstimated(Record):
    """Estimate of an unknown or a combination."""

    __slots__ = ()

    name: str
    """Name of the unknown, or the combination."""
    unit: str
    """Unit of the estimate, as in the model file."""
    status: Status | None
    """Verdict on the unknown or combination; null if it is known."""
    degree: int | None
    """Observable degree; null if not observable."""
    determined: bool
    """True if model and data determine it."""
    estimate: float | None
    """Estimate in the unit of `unit`; null if not determined."""
    sigma: float | None
    """Standard deviation of the estimate by the noise, in the unit of `unit`; null if not determined."""
    sigma_rescaled: float | None
    """Standard deviation, in the unit of `unit`, with errors of the data times the root of chi-square per degree of freedom, where that
    is above one; prior knowledge stays as it is. Null if not determined.
    """


class OutputFit(Record):
    """Quality of the fit of one output."""

    __slots__ = ()

    output: str
    """Name of the output in the model."""
    measurements: int
    """Number of measurements of the output."""
    sigma: float | None
    """Standard deviation of the noise of a measurement, in the unit of the output; null if rows have different ones."""
    estimated: bool
    """True if the noise was estimated from the residuals."""
    chi_square: float
    """Chi-square per degree of freedom, dimensionless; 1 is expected."""
    rms: float
    """Root mean square of the residuals, in the unit of the output."""
    expected_rms: float
    """Root mean square of the residuals that the sigmas predict, in the unit of the output."""
    degrees_of_freedom: float
    """Number of degrees of freedom: measurements minus the unknowns that they determine; fractions occur."""
    outlier_gate: float | None
    """Residual in sigma by the other measurements (dimensionless) above which a measurement is an outlier; null if there are too few
    others.
    """
    whiteness_probability: float | None
    """Probability that independent residuals are as correlated as these; null for few."""


class OtherSolution(Record):
    """Other solution that fits nearly as well."""

    __slots__ = ()

    chi_square: float
    """Sum of squares of all residuals in sigma, dimensionless."""
    starts: int
    """Number of starts that led to this solution."""
    values: list[float]
    """Values of the unknowns, in their order and units."""


class OtherStarts(Record):
    """Ends of the starts that did not lead to the solution. The numbers and that of the starts that led there add up to the number of
    starts.
    """

    __slots__ = ()

    near: int
    """Number of starts that led to other solutions that fit nearly as well."""
    higher: int
    """Number of starts that ended at a minimum with a larger chi-square."""
    least_higher_chi_square: float | None
    """Least chi-square of those minima, dimensionless; null if there are none."""
    unsettled: int
    """Number of starts whose iteration did not settle."""
    failed: int
    """Number of starts from which the model gives no numbers."""


class Profile(Record):
    """Profile of one unknown: the fit as a function of its value when all others follow."""

    __slots__ = ()

    name: str
    """Name of the unknown that is fixed."""
    points: list[tuple[float, float]]
    """Value of the unknown, in its unit, and the sum of squares there minus that at the solution, dimensionless."""
    flat: bool
    """True if the profile is flat: no value changes the sum of squares by more than 0.01."""

StatesStart = Literal["model", "rows", "far_rows"]
"""Rule of the start of the states. model: Time at which the model lets a run begin (`time` in its file; 0 without it). rows: First row
of every experiment, as the model asks for (`time = 'generic'`). far_rows: First row of every experiment, since the record begins long
after 0 and the model states no time: more than the length of an experiment where no start is known, more than 100 times the length of
every experiment where a start or a constraint is known and no function depends on the time.
"""


class SystemCalibrationBasis(Record):
    """Record that estimates rest on."""

    __slots__ = ()

    record: str
    """Name of the record, as it was given."""
    digest: str
    """Digest of the numbers of the record."""


class SystemCalibration(Shape):
    """Calibration of a system from one record."""

    schema: str
    """Layout of this answer: `obsdeg.system-calibration/1`."""
    version: str
    """Version of the program that wrote it."""
    name: str
    """Name of the system, as in its file."""
    consistent: bool | None
    """True if model and noise explain the data; null if the noise was estimated from the residuals, which then decide nothing."""
    findings: list[SystemFinding]
    """Evidence against the model or the noise; empty if there is none."""
    quantities: list[SystemEstimated]
    """Estimates of states at the start of every experiment, parameters, and unknowns of inputs."""
    combinations: list[SystemEstimated]
    """Estimates of combinations that the model asks for, and of products and sums that are determined though their unknowns alone are
    not.
    """
    covariance: CovarianceTable
    """Covariance of all unknowns that are determined."""
    chi_square: float
    """Chi-square: the sum of squares of all residuals in sigma, dimensionless."""
    degrees_of_freedom: int
    """Number of degrees of freedom: measurements minus determined unknowns."""
    band: tuple[float, float]
    """Acceptance band of 99.9 % of chi-square per degree of freedom, dimensionless."""
    factor: float
    """Root of chi-square per degree of freedom, dimensionless; 1 is expected."""
    outputs: list[OutputFit]
    """Quality of the fit of each output."""
    others: list[OtherSolution]
    """Other solutions that fit nearly as well, the best first: the values of the unknowns."""
    starts: tuple[int, int]
    """Number of starts that were tried, then the number that led to the solution."""
    other_starts: OtherStarts
    """Ends of the starts that did not lead to the solution."""
    starts_at_most: int
    """Largest number of starts; fewer are enough when no other solution is to be expected."""
    profiles: list[Profile]
    """Profiles of the unknowns that were asked for."""
    samples: int
    """Number of rows of the record."""
    intervals: int | None
    """Number of intervals at rest; null if the file does not ask for them."""
    begins: float | None
    """Time of the record at which the states start (those of the first experiment), in the unit of the model; null where that is 0."""
    states_start: StatesStart
    """Rule of the start of the states."""
    before_first_row: float | None
    """Time from the start of the states to the first row, in the unit of the model, where it is longer than the record; null elsewhere."""
    rows: int
    """Number of rows that the model is fitted to: those of the record, or the intervals and the runs between them."""
    ignored: list[str]
    """Columns that are not used."""
    model: str
    """Digest of the model, to recognise it."""
    rests_on: list[SystemCalibrationBasis]
    """Records that the estimates rest on, including those of the calibration before."""
    shared: bool
    """True if the calibration before rests on the same record, by another model."""
    substeps: int
    """Largest number of integration steps between two rows."""
    seed: int
    """Seed of starts and verdicts."""

ObstacleKind = Literal["stop", "limits", "elsewhere", "misses"]
"""Kind of an obstacle of the gimbals. stop: A gimbal stops at its limit or at the lock during the turn. limits: No gimbal angles of the
attitude lie within the limits. elsewhere: The path gimbal by gimbal starts at other gimbal angles than those where the gimbals stand.
misses: The stated turn does not lead to the position.
"""


class Obstacle(Record):
    """Obstacle of the gimbals on the way to a position."""

    __slots__ = ()

    position: str
    """Name of the position that is not reached, or whose rotation is not possible."""
    kind: ObstacleKind
    """Kind of the obstacle on the way."""
    gimbal: str | None
    """Gimbal that stops: alpha, beta or gamma; null near beta = +-90 deg and for other kinds."""
    at_deg: float | None
    """Limit at which the gimbal stops, in degrees; null for other kinds."""
    after_deg: float | None
    """Angle that the platform has turned by then, in degrees; null for other kinds."""

StepKind = Literal["set", "gimbals", "turn", "wait", "record", "rotate"]
"""Kind of a step of the sheet. set: Set the gimbals to the first position. gimbals: Turn alpha and gamma together at beta = +-90 deg,
while the platform rests and is recorded. turn: Turn to the next position, without recording. wait: Wait at rest, without recording.
record: Record the outputs at rest. rotate: Record the outputs during a rotation.
"""


class StepTurn(Record):
    """Turn of the platform in a step."""

    __slots__ = ()

    about: tuple[float, float, float]
    """Axis in n (North, Up, East): a unit vector, dimensionless."""
    about_platform: tuple[float, float, float]
    """Axis in the platform (X_p, Y_p, Z_p): a unit vector, dimensionless."""
    angle_deg: float
    """Angle of the turn in degrees, right-handed about the axis, above 0."""
    rate_deg_s: float | None
    """Rate of the turn in deg/s; null if none is stated."""
    from_deg: tuple[float, float, float]
    """Gimbal angles before the turn, in degrees: alpha, beta, gamma."""
    gimbal_rates_deg_s: tuple[float, float, float] | None
    """Largest rates of alpha, beta and gamma during the turn, in deg/s; null if no rate is stated."""
    gimbal: str | None
    """Gimbal that makes the turn alone: alpha, beta or gamma; null about one axis."""


class Step(Record):
    """Step of the sheet, with its times."""

    __slots__ = ()

    number: int
    """Number of the step, from 1."""
    kind: StepKind
    """Kind of the step: what is done."""
    position: str
    """Name of the position in which the step takes place, or to which it leads."""
    start_s: float
    """Start of the step after the start of the first position, in s."""
    duration_s: float
    """Duration of the step, in s; 0 for turns of unstated rate."""
    gimbals_deg: tuple[float, float, float]
    """Gimbal angles at the end of the step, in degrees: alpha (outer), beta (middle), gamma (inner)."""
    turn: StepTurn | None
    """Turn of the platform; null at rest."""
    force_g: tuple[float, float, float] | None
    """Readings of the accelerometers X_p, Y_p, Z_p at rest, in g, of a platform without errors; null while it turns."""
    tolerance_g: float | None
    """Largest deviation of a reading, in g, that the stated drifts explain; null while the platform turns."""


class Tolerance(Record):
    """Basis of the tolerances of the readings."""

    __slots__ = ()

    tilt_deg: float
    """Tilt that is always allowed, in degrees."""
    by_values: bool
    """True if true values of coefficients or psi are stated, whose drift is added."""
    by_priors: bool
    """True if priors are stated, of which three sigma are added."""
    by_noise: bool
    """True if random drift or biases are stated, of whose tilt three sigma are added."""
    accelerometers_g: float
    """Part of the tolerance, in g, for errors of the accelerometers, of attitudes and of gravity: stated values, and three sigma of the
    stated priors, of the bench and of the bias instability.
    """
    not_counted: list[str]
    """Families of the bench that are not part of the tolerance."""
    wide: list[str]
    """Names of the positions whose tolerance is so large that the readings tell little: above 0.25 g."""


class AfterPosition(Record):
    """State of the coefficients after a position."""

    __slots__ = ()

    position: str
    """Name of the position that has ended."""
    end_s: float
    """End of the position, in s."""
    met: int
    """Number of requirements that are met."""
    determines: list[str]
    """Coefficients that the samples determine from here on, whatever the priors."""
    meets: list[str]
    """Coefficients that meet their requirement from here on."""
    uncertainty: list[float | None]
    """Uncertainty of each coefficient, in the order of `coefficients` and in its unit; null where neither samples nor stated priors
    bound it.
    """


class CoefficientProgress(Record):
    """Coefficient with the positions from which it is known."""

    __slots__ = ()

    name: str
    """Name of the coefficient, such as D_FX."""
    unit: str
    """Unit of the uncertainty and the requirement."""
    uncertainty: float | None
    """Uncertainty at the end, in the unit of `unit`; null if neither samples nor stated priors bound the coefficient."""
    by_prior: bool
    """True if the samples do not determine the coefficient, so that stated priors alone bound it."""
    required: float | None
    """Largest uncertainty allowed, in the unit of `unit`; null without a requirement."""
    determined_from: str | None
    """Position from whose end on the samples determine the coefficient; null if they do not at the end, and for a scheme of more than
    100 positions.
    """
    met_from: str | None
    """Position from whose end on the requirement is met; null without a requirement, if it is missed at the end, and for a scheme of
    more than 100 positions.
    """


class RotationRow(Record):
    """Row of a rotation table: `[k, Ux, Uy, Uz, angle, T, T0, T1]`."""

    __slots__ = ()

    number: int
    """Number of the row, from 1."""
    axis: tuple[float, float, float]
    """Axis in the body (right, front, up): a unit vector, dimensionless."""
    angle_deg: float
    """Angle about the axis in degrees, right-handed."""
    rotate_s: float
    """Duration of the rotation, in s."""
    before_s: float
    """Time at rest before the rotation, in s."""
    after_s: float
    """Time at rest after the rotation, in s."""


class Procedure(Shape):
    """Executable sheet of a scheme: turns, waits and recordings in order of time."""

    schema: str
    """Layout of this answer: `obsdeg.procedure/1`."""
    version: str
    """Version of the program that wrote it."""
    name: str
    """Name of the scheme; empty if it has none."""
    document: TitleBlock
    """Title block of the printed sheet."""
    carry: Carry
    """Carry of psi between positions."""
    executable: bool
    """True if the gimbals can execute every step."""
    obstacles: list[Obstacle]
    """Obstacles of the gimbals; empty if the sheet is executable."""
    steps: list[Step]
    """Steps of the sheet, in order of time."""
    total_s: float
    """Total time of the sheet, in s."""
    timed_turns: bool
    """True if the time of the turns is part of the times: a slew rate is stated."""
    free_gimbals: tuple[bool, bool, bool]
    """True for each of alpha, beta and gamma that has no limits, so that its angle may wind up."""
    row_s: float
    """Longest interval between rows that the uncertainties rest on, in s."""
    earth_rate_dph: tuple[float, float]
    """Rate of the earth in North and Up, in deg/h, by which the platform is torqued."""
    settle_s: float
    """Time at rest before each recording, in s, within the dwell of the position."""
    tolerance: Tolerance
    """Basis of the tolerances of the readings."""
    after: list[AfterPosition]
    """State of the coefficients after each position; of a scheme with many positions, after the last one."""
    coefficients: list[CoefficientProgress]
    """Coefficients with the position from which each is known."""
    requirements: Requirements
    """Outcome of the requirements at the end, by prediction, without the samples of the waits."""
    acceptance: AcceptanceReport | None
    """Acceptance limits with their guard bands by the predicted uncertainties; null if none are stated."""
    conditions: MeasurementReport
    """Conditions of the predictions."""
    start_attitude_deg: tuple[float, float, float]
    """Attitude at the start as PSINS has it: pitch, roll and yaw in degrees of a body with the axes right, front and up along Z_p, X_p
    and Y_p.
    """
    rotations: list[RotationRow]
    """Rotation table of the PSINS kind; empty without a slew rate."""
    seed: int
    """Seed of the exact verdicts."""

SensorKind = Literal["gyro", "accelerometer"]
"""Kind of a sensor, by the unit of its column. gyro: Gyro: the column is a rate of rotation. accelerometer: Accelerometer: the column is
a specific force.
"""

NoiseKind = Literal["random_walk", "bias_instability", "rate_random_walk"]
"""Kind of noise of a sensor (IEEE Std 952-1997, Annex C). random_walk: White noise of a rate: angle random walk of a gyro, velocity
random walk of an accelerometer; the deviation falls with the root of the cluster time. bias_instability: Flicker noise: bias
instability; the deviation does not change with the cluster time. rate_random_walk: Random walk of a rate: rate random walk of a gyro,
acceleration random walk of an accelerometer; the deviation grows with the root of the cluster time.
"""


class NoiseCoefficient(Record):
    """Noise coefficient of a sensor."""

    __slots__ = ()

    noise: NoiseKind
    """Kind of the noise that the coefficient is of."""
    name: str
    """Name of the coefficient in words."""
    unit: str
    """Unit of the coefficient, such as deg/sqrt(h)."""
    resolved: bool
    """True if the record resolves the coefficient: its square is more than three standard deviations."""
    value: float | None
    """Estimate in the unit of `unit`; null if not resolved."""
    sigma: float | None
    """Standard deviation of the estimate in the unit of `unit`; null if not resolved."""
    limit: float
    """Upper limit in the unit of `unit`: the coefficient lies below it with probability 0.95."""
    least_resolved: float
    """Least coefficient that this record resolves beside its other noise, in the unit of `unit`."""


class AllanDeviation(Record):
    """Overlapping Allan deviation at one cluster time."""

    __slots__ = ()

    tau_s: float
    """Cluster time of the deviation, in s."""
    samples: int
    """Number of samples of a cluster."""
    deviation: float
    """Deviation, in the unit of the column's `unit`."""
    low: float
    """Lower end of the confidence band, in the unit of the column's `unit`."""
    high: float
    """Upper end of the confidence band, in the unit of the column's `unit`."""
    degrees_of_freedom: float
    """Degrees of freedom of the variance, by the fitted noise (dimensionless)."""
    fitted: float
    """Deviation of the fitted noise, in the unit of the column's `unit`."""


class ColumnNoise(Record):
    """Noise of one column of a record."""

    __slots__ = ()

    column: str
    """Column, as in the header of the record."""
    sensor: SensorKind
    """Kind of the sensor, by the unit of the column."""
    unit: str
    """Unit of the deviations: deg/h (gyro) or ug (accelerometer)."""
    samples: int
    """Number of samples that count."""
    empty_cells: int
    """Number of cells that are empty or NaN."""
    left_out: int
    """Number of cells far from both neighbours, which were left out."""
    left_out_lines: list[int]
    """Numbers of the first lines with cells that were left out (dimensionless); at most 20."""
    mean: float
    """Mean of the samples, in the unit of `unit`."""
    coefficients: list[NoiseCoefficient]
    """Noise coefficients by a fit to the Allan variances."""
    chi_square: float
    """Sum of squared residuals of the fit by the covariance of the Allan variances, dimensionless."""
    degrees_of_freedom: int
    """Number of degrees of freedom of the fit."""
    probability: float
    """Probability that noise of these kinds leaves a larger sum."""
    explained: bool
    """True if noise of these kinds explains the deviations (probability above 0.001)."""
    deviations: list[AllanDeviation]
    """Overlapping Allan deviation by cluster time."""


class NoiseSetting(Record):
    """Key of a `[simulation]` table."""

    __slots__ = ()

    key: str
    """Key of the table, with its unit, such as `angle_random_walk_deg_sqrt_h`."""
    values: list[float]
    """Values in the unit of the name of `key`: one, or three for the gyros X, Y, Z."""


class SensorNoiseReport(Shape):
    """Noise of the sensors of a static record, by its overlapping Allan deviation."""

    schema: str
    """Layout of this answer: `obsdeg.allan/1`."""
    version: str
    """Version of the program that wrote it."""
    record: str
    """Name of the record, as it was given."""
    samples: int
    """Number of rows of the record."""
    span_s: tuple[float, float]
    """First and last time of the record, in s."""
    interval_s: float
    """Usual interval between rows, in s."""
    gaps: int
    """Number of gaps: intervals between rows of more than one and a half usual ones, or less than half of one."""
    jitter: float
    """Largest deviation of another interval from the usual one, as a fraction of it (dimensionless)."""
    ignored: list[str]
    """Columns that are not used, as in the header of the record."""
    columns: list[ColumnNoise]
    """Noise by column of the record."""
    settings: list[NoiseSetting]
    """Keys of a `[simulation]` table for the noise that is resolved."""
    simulation_table: str
    """Text of the `[simulation]` table of a scheme file with the keys of `settings`, in TOML."""
    notes: list[str]
    """Statements on the record and on how noise maps to settings."""

AuditFinding = Literal["agree", "conditional", "disagree", "not_covered"]
"""Outcome of checking an equation or claim of the paper. agree: True as printed in the paper. conditional: True under a condition that
the paper does not state; the reason states it. disagree: False as printed in the paper. not_covered: Not judged; the reason gives the
cause.
"""


class Line(Record):
    """Equation or claim of the paper, with its outcome."""

    __slots__ = ()

    place: str
    """Place in the paper, such as `(21)` or `conclusion 2`."""
    claim: str
    """Equation or claim, in words."""
    finding: AuditFinding
    """Outcome: agree, conditional, disagree or not covered."""
    reason: str
    """Reason of the outcome: the computation, for a slip the correction, and for a line that is not covered the cause."""


class Audit(Shape):
    """Audit of the paper, equation by equation and claim by claim."""

    schema: str
    """Layout of this answer: `obsdeg.audit/1`."""
    seed: int
    """Seed of all random points and of the noise."""
    lines: list[Line]
    """Equations by number, then claims in the order of the paper, then everything that is not covered."""

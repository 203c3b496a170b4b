"""What answers hold: a class for each type of their JSON. Written by `python/tools/write_shapes.py` from `obsdeg schema`; not by hand."""

from __future__ import annotations

from typing import Literal, Union

from ._records import Record, Shape

Carry = Literal["platform", "inertial", "reset"]
"""What is carried from one position to the next (the paper does not say). platform: `psi^c` is carried: what the paper's simulation did.
inertial: `psi^n` is carried: right for real torqued slews. reset: `psi` is a new unknown at each position.
"""

SignedAxis = str
"""A signed platform axis such as `+x` or `-z`."""


class GyroAxes(Record):
    """The axes of one gyro: input I, output O, spin S, as signed platform axes."""

    __slots__ = ()

    I: SignedAxis
    """Input axis."""
    O: SignedAxis
    """Output axis."""
    S: SignedAxis
    """Spin axis."""


class Accelerometers(Record):
    """The input axes of the accelerometers as signed platform axes; X_p, Y_p, Z_p by default."""

    __slots__ = ()

    X: SignedAxis
    """Of the accelerometer whose coefficients end in X, or have it first."""
    Y: SignedAxis
    """Of Y."""
    Z: SignedAxis
    """Of Z."""


class Geometry(Record):
    """The mounting of the X, Y and Z gyro. The default is the paper's, as it follows from its (22), (23), (27) and (28)."""

    __slots__ = ()

    X: GyroAxes
    """The gyro whose coefficients end in X."""
    Y: GyroAxes
    """The gyro whose coefficients end in Y."""
    Z: GyroAxes
    """The gyro whose coefficients end in Z."""
    accelerometers: Accelerometers | None
    """The input axes of the accelerometers."""

AngleReport = Union[float, str]
"""An angle."""


class Turn(Record):
    """A turn about a fixed axis."""

    __slots__ = ()

    about: tuple[float, float, float]
    """The axis: a unit vector (North, Up, East)."""
    angle_deg: float
    """The angle in degrees, right-handed about the axis, above 0."""


class PositionReport(Record):
    """One position."""

    __slots__ = ()

    name: str
    """Its name."""
    angles_deg: tuple[AngleReport, AngleReport, AngleReport]
    """Euler angles alpha, beta, gamma in degrees, or names."""
    attitude: str | None
    """Where X_p, Y_p, Z_p point, for a cardinal attitude."""
    rotation: str | None
    """The rotation that starts there, such as `X_p:360`."""
    turns: list[Turn]
    """The turns that lead there from the position before, where torquer errors act on them."""
    g_c: tuple[float, float, float] | None
    """Gravity in platform axes (at the start of a rotation), in g; null for generic angles."""


class StationLabel(Record):
    """Where derivatives of Z are taken, as formulas name it."""

    __slots__ = ()

    label: str
    """As in formulas: `p1`, `'about X'`, `p1[45 deg]`."""
    position: str
    """The name of the position or rotation."""
    turned_deg: float | None
    """How far the rotation has come, in degrees, right-handed; null for a position that stands. Derivatives of Z at such a station are
    those of a platform that is turning, not of one that stopped there.
    """
    about: str | None
    """What it turns about: `X_p`, `Y_p`, `Z_p`, `N`, `U` or `E`."""
    rate: str | None
    """The rate of turning in formulas, such as `w@p1`: the derivative of that angle by time, in rad/s."""

Status = Literal["observable", "inseparable", "not_excited", "not_seen"]
"""Whether an unknown can be solved. observable: It is in the span of the derivative rows. inseparable: It moves Z, but only together
with its partners. not_excited: It does not move Z at all. not_seen: No order up to the last that was looked at solves it, and a
higher one may: of systems with special starts, jumps or arbitrary inputs.
"""


class SolutionTerm(Record):
    """One term of a solution, for programs."""

    __slots__ = ()

    coefficient: str
    """The coefficient with its sign, such as `-wU*w@p1/(2*wN)`; decimals with all their digits."""
    observation: str
    """The derivative of the observation, such as `Z1'`."""
    station: str
    """Where it is taken: a label of the stations."""

Form = Literal["exact", "symbolic", "decimal"]
"""How exact a printed coefficient is. exact: Rationals and square roots. symbolic: Sines and cosines of angles. decimal: Decimals,
rounded to six places (small ones to six digits).
"""

FoundBy = Literal["prime_fields", "symbolic_engine", "floating_point"]
"""Where the coefficients of a solution come from. prime_fields: Numbers `a + b sqrt 2 + c sqrt 3 + d sqrt 6` recovered from their images
in two prime fields. symbolic_engine: Formulas in sines and cosines, solved by the symbolic engine; their images in the prime fields
are the same. floating_point: Decimals.
"""

Verification = Literal["symbolic", "modular", "numeric"]
"""How a solution was checked before it was printed. symbolic: By exact substitution of the derivatives of Z, and by substitution in two
prime fields. modular: By substitution in two prime fields. numeric: By substitution in floating point: residual below 1e-9 of the sum
of magnitudes.
"""


class Solution(Record):
    """A solving expression."""

    __slots__ = ()

    text: str
    """The expression in one line."""
    terms: list[SolutionTerm]
    """Its terms one by one."""
    turning: bool
    """Whether derivatives in it are taken while the platform turns: at stations with a rate."""
    form: Form
    """How exact its coefficients are."""
    found_by: FoundBy
    """Where its coefficients come from."""
    verification: Verification
    """How it was checked."""


class Elsewhere(Record):
    """Degrees of an unobservable unknown under other conditions; null where it stays unobservable or the condition is the given one."""

    __slots__ = ()

    other_latitudes: int | None
    """At other latitudes (the given one is special)."""
    other_angles: int | None
    """With the same number of positions at generic angles."""


class Quantity(Record):
    """The verdict on one unknown."""

    __slots__ = ()

    name: str
    """Its name."""
    unit: str
    """Its unit."""
    status: Status
    """Whether it can be solved."""
    degree: int | None
    """The observable degree; null when it is not observable."""
    accuracy_order: int | None
    """The accuracy order: the best error falls with the dwell T as T^-(order + 1/2); null when no dwell makes it observable."""
    partners: list[str]
    """Unknowns that it cannot be told from: those that share with it a direction that Z does not see and that holds no shorter one."""
    solution: Solution | None
    """How it is solved."""
    elsewhere: Elsewhere | None
    """Where it would be observable."""


class CombinationReport(Record):
    """An observable combination, or one that was asked for."""

    __slots__ = ()

    expression: str
    """The combination."""
    requested: bool
    """Whether it was asked for."""
    status: Status
    """Whether it can be solved."""
    degree: int | None
    """Its observable degree."""
    accuracy_order: int | None
    """Its accuracy order."""
    solution: Solution | None
    """How it is solved."""


class Component(Record):
    """One component of a null vector."""

    __slots__ = ()

    name: str
    """The unknown."""
    coefficient: str | None
    """Its coefficient; null when it was not computed."""


class Verdict(Record):
    """Status and degree."""

    __slots__ = ()

    status: Status
    """Whether it can be solved."""
    degree: int | None
    """The observable degree."""


class Difference(Record):
    """A verdict that depends on the carry."""

    __slots__ = ()

    name: str
    """The unknown."""
    here: Verdict
    """Under the carry of the scheme."""
    there: Verdict
    """Under the other one."""


class CarryReport(Record):
    """What changes under another carry."""

    __slots__ = ()

    carry: Carry
    """The carry."""
    rank_profile: list[int]
    """Its rank profile."""
    unknowns: int
    """Its number of unknowns."""
    differs: list[Difference]
    """The unknowns of both carries whose verdict differs."""


class ChangeKnown(Record):
    """The value of an unknown is known: of a parameter, of psi or a coefficient, of a state at the start of every experiment, of an
    input at all times.
    """

    __slots__ = ()

    kind: Literal["known"]
    name: str
    """Name of the unknown."""


class ChangeOutput(Record):
    """A state is one more output of the model."""

    __slots__ = ()

    kind: Literal["output"]
    state: str
    """Name of the state."""


class ChangeAttitude(Record):
    """One more position at the end of the scheme."""

    __slots__ = ()

    kind: Literal["attitude"]
    position: str
    """Name of the new position."""
    attitude: str
    """Cardinal attitude: where X_p, Y_p and Z_p point."""


class ChangeCarry(Record):
    """Another carry between positions."""

    __slots__ = ()

    kind: Literal["carry"]
    carry: Carry
    """The carry."""

Change = Union[ChangeKnown, ChangeOutput, ChangeAttitude, ChangeCarry]
"""A change of a scheme or model."""


class Resolved(Record):
    """An unknown that a remedy makes observable."""

    __slots__ = ()

    name: str
    """Name of the unknown."""
    degree: int
    """Observable degree of the unknown after the change."""


class Remedy(Record):
    """One change, or two changes that are needed together."""

    __slots__ = ()

    changes: list[Change]
    """The changes."""
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


class Locus(Record):
    """A condition and what it does."""

    __slots__ = ()

    condition: str
    """Where: `alpha = 0, 180 deg`, `alpha = -beta`, or a polynomial in tangents of half angles that vanishes; one that is too long to be
    read is described.
    """
    points_deg: list[dict[str, float]]
    """Points of it, in degrees by angle: all of them when `complete`, examples otherwise."""
    complete: bool
    """Whether the condition is on a single angle, and these are certainly all its values."""
    rank_profile: list[int]
    """The rank profile at a general point of the locus."""
    changes: list[Difference]
    """The unknowns whose verdict changes there."""


class Formula(Record):
    """One formula."""

    __slots__ = ()

    position: str | None
    """The label of the station; null for formulas that hold at every one."""
    left: str
    """Left side, such as `Z1'`."""
    right: str
    """Right side."""

Frame = Literal["n", "platform"]
"""The axes in which Z is printed. n: Local geographic axes, as in the paper: `Z1` and `Z3` (`Z2` is zero). platform: Platform axes:
`Zx`, `Zy`, `Zz`.
"""


class BeyondLimits(Record):
    """A position written with angles beyond a gimbal limit."""

    __slots__ = ()

    position: str
    """Name of the position."""
    angles: str
    """Its Euler angles as written, in degrees."""
    within: str
    """Euler angles of the same attitude within the limits, in degrees."""


class GimbalStop(Record):
    """Why a turn about one axis cannot go on: a gimbal reaches its limit, or near `beta = +-90` degrees alpha and gamma would have to
    turn more than a hundred times as fast as the platform.
    """

    __slots__ = ()

    gimbal: str | None
    """The gimbal that reaches its limit: alpha, beta or gamma; null near `beta = +-90` degrees."""
    at_deg: float
    """The limit in degrees; without a gimbal beta in degrees."""
    after_deg: float
    """Angle that the platform has turned by, in degrees."""


class GimbalTurn(Record):
    """A turn of the platform, followed from gimbal angles within the limits."""

    __slots__ = ()

    position: str
    """Name of the position that it leads to, or whose rotation it is."""
    rotation: bool
    """True for the rotation of a segment."""
    by_gimbals: bool
    """True if the scheme states that the platform turns gimbal by gimbal."""
    turn: Turn | None
    """The turn about one axis; null where the attitude stays, and gimbal by gimbal."""
    stays: bool
    """True if all gimbal angles stay within their limits on the way; gimbal by gimbal, of the angles as they are written."""
    stop: GimbalStop | None
    """Where the turn about one axis cannot go on; null where it stays within the limits, and gimbal by gimbal."""
    ends_deg: tuple[float, float, float] | None
    """Gimbal angles at the end of the turn in degrees (alpha, beta, gamma), where they are others of the same attitude than those
    listed.
    """
    gimbals_deg: tuple[float, float, float] | None
    """Change of alpha, beta and gamma in degrees of the way gimbal by gimbal (`path = 'gimbals'`) between angles within the limits,
    which stays within them; null for a rotation.
    """


class GimbalReport(Record):
    """Gimbal limits and a scheme: which angles and which turns lie beyond."""

    __slots__ = ()

    limits: str
    """The limits in words, in degrees."""
    beyond: list[BeyondLimits]
    """Positions whose angles, as they are written, lie beyond a limit, with angles of the same attitude that do not."""
    turns: list[GimbalTurn]
    """The turn to every position but the first, and the rotation of every segment that turns; none for generic angles."""


class Certainty(Record):
    """How certain the verdicts are."""

    __slots__ = ()

    method: str
    """The method, in words."""
    error_bound: float
    """Bound on the probability that any verdict is wrong."""
    primes: tuple[str, str]
    """The two primes, as text (61 bits)."""
    seed: int
    """The seed of all random choices."""


class Analysis(Shape):
    """The answer for one scheme."""

    schema: str
    """`obsdeg.analysis/1`."""
    version: str
    """Version of the program."""
    carry: Carry
    """What is carried between positions."""
    latitude_deg: float | None
    """Latitude in degrees; null when generic."""
    geometry: Geometry
    """How the gyros are mounted."""
    terms: str
    """Unknown terms of the gyro model, or `drift`."""
    measured_azimuth: bool
    """Whether psi_y^n is measured."""
    positions: list[PositionReport]
    """The positions."""
    stations: list[StationLabel]
    """Where the terms of solutions are taken: the positions, and attitudes of rotations."""
    rank_profile: list[int]
    """`dim V_0, dim V_1, ...`."""
    rank: int
    """The final rank."""
    unknowns: list[str]
    """The unknowns in model order."""
    has_accuracy_orders: bool
    """Whether accuracy orders were computed: none are for rotating segments, and notes say why else."""
    quantities: list[Quantity]
    """The verdicts, best first."""
    combinations: list[CombinationReport]
    """Observable combinations beyond single unknowns, by degree, and those asked for."""
    null_space: list[list[Component]]
    """Basis of the directions that Z does not see (unknowns that are not excited left out)."""
    carries: list[CarryReport]
    """The verdicts under the other carries, where they differ."""
    to_resolve: Remedies
    """Changes that make the unobservable unknowns observable."""
    degenerate_loci: list[Locus] | None
    """Conditions on generic angles under which the verdict changes."""
    formulas: list[Formula] | None
    """Formulas of Z and its derivatives, position by position."""
    frame: Frame
    """Axes of Z in solutions."""
    gimbals: GimbalReport | None
    """Angles and turns beyond the gimbal limits that the scheme states; left out where it states none."""
    certainty: Certainty
    """How certain all this is."""
    notes: list[str]
    """What could not be said, and why."""


class NumberOfSolutionsCounted(Record):
    """So many, complex ones counted: by elimination at a random point modulo each prime."""

    __slots__ = ()

    counted: int


class NumberOfSolutionsUndecided(Record):
    """Locally unique. Why the number of solutions is not decided."""

    __slots__ = ()

    undecided: str

NumberOfSolutions = Union[Literal["one_by_expression"], NumberOfSolutionsCounted, NumberOfSolutionsUndecided]
"""How many values an unknown takes among all points with the same outputs. one_by_expression: One: its solving expression rests on
outputs, inputs, constants and unknowns that have one solution.
"""


class SystemQuantity(Record):
    """One unknown."""

    __slots__ = ()

    name: str
    """Its name."""
    kind: str
    """state, parameter or input."""
    unit: str
    """Its unit, as the file says."""
    description: str
    """What it is, as the file says."""
    status: Status
    """The verdict: locally observable (no other value nearby gives the same outputs), inseparable from its partners, not excited, or not
    seen up to the bound on the order.
    """
    degree: int | None
    """The smallest order of derivatives that solves it."""
    partners: list[str]
    """Unknowns that it cannot be told from: those that share with it a direction that changes no output and that holds no shorter one."""
    solution: str | None
    """What it is in outputs, inputs, their derivatives (up to two orders beyond the degree) and unknowns of no higher degree, where it
    enters linearly; verified in both fields.
    """
    number_of_solutions: NumberOfSolutions | None
    """How many solutions it has; null where it is not observable, or where they were not sought."""


class SystemCombination(Record):
    """A combination."""

    __slots__ = ()

    expression: str
    """As written, or `b*x1`."""
    degree: int | None
    """Its degree; null when it is not observable."""


class SymmetryReport(Record):
    """A symmetry in words."""

    __slots__ = ()

    words: str
    """What changes no output, for every `c` (every positive one where something is multiplied or divided): `multiply alpha by c; divide
    gamma by c`. At c = 1, and where nothing is multiplied or divided at c = 0, nothing changes.
    """
    unknowns: list[str]
    """The unknowns that it moves."""


class DigitsReport(Record):
    """How clear ranks were that real numbers of many digits decided, at two random points."""

    __slots__ = ()

    digits: tuple[int, int]
    """Decimal digits at the first point and at the second."""
    nonzero_log10: float
    """Decimal logarithm of the smallest number, relative to its row, that counts as different from zero; it is proven to be."""
    zero_log10: float | None
    """Decimal logarithm of the widest error bound, relative to its row, of a number that counts as zero; null where all were exact."""


class SystemAnalysis(Shape):
    """The answer for one system."""

    schema: str
    """`obsdeg.system/1`."""
    version: str
    """Version of the program."""
    name: str
    """The system."""
    description: str
    """What it is, as its file says."""
    equations: list[str]
    """The equations, `x' = ...` and `y = ...`, as written."""
    rank_profile: list[int]
    """`dim V_0, dim V_1, ...`."""
    rank: int
    """The final rank."""
    unknowns: int
    """The number of unknowns."""
    quantities: list[SystemQuantity]
    """The verdicts in model order."""
    known: list[str]
    """States whose start is known."""
    time: str | None
    """Time at which the first segment was judged, where the equations hold it: a number, or `generic` (almost every time, as in all
    later segments); null where they do not.
    """
    constraints: list[str]
    """Equations that hold at the start; their differentials count as rows of order 0."""
    combinations: list[SystemCombination]
    """Combinations that were asked for."""
    unobservable_directions: int
    """The number of independent directions that no output sees."""
    symmetries: list[SymmetryReport]
    """Scalings, translations and polynomials among them, exactly."""
    other_directions: list[list[str]]
    """What is moved by each direction that is none of these: at a generic point, no polynomial that was found describes it."""
    invariants: list[SystemCombination]
    """Combinations of unobservable unknowns that are observable."""
    last_order: int
    """The highest order that was looked at."""
    bound: int
    """Orders end at this bound."""
    closed: bool
    """The end is proven: an order that adds nothing is the last. Otherwise what is not observable rests on the bound."""
    rests_on_bound: bool
    """Whether a verdict rests on the bound."""
    branches: list[str]
    """Functions of unknowns that have branches (abs, sign, roots, asin, acos): the verdicts are those of the branch that points near one
    lie in, or where the model is not defined there, of the first that was found.
    """
    to_resolve: Remedies
    """Changes that make the unobservable unknowns observable."""
    note: str | None
    """Why there are no solving expressions, if there are none."""
    counting_order: int | None
    """The order of the derivatives with which solutions were counted by elimination; null when none were."""
    independent_functions: int | None
    """Functions that take part whose values are proven to be independent of each other at a generic point (Ax 1971,
    doi:10.2307/1970774), so that random values in prime fields stand for them; 0 for a rational model, null where functions were
    evaluated truly, in real numbers.
    """
    primes: tuple[str, str] | None
    """Of a model judged in prime fields: the two random primes, as text (61 bits)."""
    error_bound: float | None
    """Of a model judged in prime fields: bound on the probability that a verdict is wrong."""
    digits: DigitsReport | None
    """Of a model judged in real numbers: how clear its ranks were."""
    seed: int
    """Seed of all random choices."""


class AccelerometerBias(Record):
    """The bias instability of the accelerometers: a first-order Gauss-Markov process of each, which goes on in platform axes."""

    __slots__ = ()

    instability_ug: float
    """The coefficient B in ug; sigma of the process is 1.076 B."""
    correlation_time_s: float
    """Its correlation time in s."""

PerGyro = tuple[float, float, float]
"""A noise of each gyro: X, Y, Z; zero for none."""


class GyroNoise(Record):
    """The datasheet of the gyros X, Y, Z."""

    __slots__ = ()

    angle_random_walk_deg_sqrt_h: PerGyro
    """Angle random walk in deg/sqrt(h)."""
    rate_random_walk_dph_sqrt_h: PerGyro
    """Rate random walk in deg/h/sqrt(h)."""
    bias_instability_dph: PerGyro
    """Bias instability in deg/h: the coefficient B of IEEE Std 952, whose Allan floor is 0.664 B."""
    correlation_time_s: float
    """Correlation time in s of the Gauss-Markov process that stands for it."""


class MeasurementReport(Record):
    """Conditions of predicted sigmas: the information of all samples with the noise, the random drift and the priors that are stated."""

    __slots__ = ()

    latitude_deg: float
    """Latitude in degrees."""
    latitude_by_default: bool
    """Whether the latitude was chosen by the program."""
    dwell_s: float
    """Dwell of positions that do not say theirs, in s."""
    step_s: float
    """Largest step between samples in s; a position is divided into equal steps."""
    accelerometer_noise_g: float
    """Noise of the observation per sample and axis in g."""
    accelerometer_bias: AccelerometerBias | None
    """Bias instability of the accelerometers; left out where there is none."""
    azimuth_noise_deg: float | None
    """Noise of the azimuth per sample in deg; null where it is not measured."""
    slew_rate_deg_s: float | None
    """Rate of slews in deg/s where a position does not say its own; null: instantaneous."""
    drift_noise: str | None
    """Random drift that is stated, with its unit; null: none counts."""
    gyro_noise: GyroNoise | None
    """Datasheet of the gyros; left out where they have no noise of their own."""
    prior: str | None
    """Priors that are stated, as 1 sigma in the units of the unknowns; null: none counts."""
    by_default: list[str]
    """Keys of the conditions above that nobody states, so that the program chose them: latitude_deg, accelerometer_noise_g, step_s,
    dwell_s, azimuth_noise_deg.
    """


class Slew(Record):
    """A turn to a position."""

    __slots__ = ()

    to: str
    """The position."""
    turn: Turn
    """How it turns."""


class ComparisonQuantity(Record):
    """One unknown of a scheme."""

    __slots__ = ()

    name: str
    """Its name."""
    unit: str
    """Unit of sigma."""
    status: Status
    """The exact verdict."""
    degree: int | None
    """The observable degree."""
    accuracy_order: int | None
    """The accuracy order."""
    sigma: float | None
    """Predicted standard deviation at the end of the scheme, by the conditions that are stated; null when neither samples nor stated
    priors bound it.
    """
    by_prior: bool
    """True if the samples do not determine it, so that sigma rests on stated priors alone."""
    sigma_extended: float | None
    """Standard deviation of a coefficient, where the small-angle model does not hold for the drifts that are stated, by a filter with
    full attitudes at the end, with the prior.
    """
    requirement: float | None
    """The largest sigma allowed."""
    margin: float | None
    """Requirement over sigma: above 1 is met."""
    excitation: list[float]
    """Per position: how it moves the drift there, as a product of components of g (1 for D_F); its root mean square over the arc of a
    rotating segment; empty for psi.
    """
    carried_by: list[str]
    """Positions without which it is not observable."""


class Worst(Record):
    """The largest sigma of a drift coefficient."""

    __slots__ = ()

    name: str
    """The coefficient."""
    sigma_dph: float
    """Its sigma in deg/h (per g, per g^2)."""

Basis = Literal["predicted", "predicted_with_prior", "run", "record"]
"""Sigmas that are held against requirements. Whether a scheme meets its requirements is decided by the prediction alone; a run is one
example of it, a record its confirmation. predicted: The information of all samples with the noise and the random drift that are
stated, psi at the end of the scheme (under reset carry at the end of each position); nothing is known beforehand.
predicted_with_prior: The same with the priors that are stated. run: The filter at the end of a simulated run, with its prior and its
random drift, whether they are stated or chosen by the program. record: The estimates from a record.
"""


class Margin(Record):
    """A margin and whose it is."""

    __slots__ = ()

    name: str
    """The unknown."""
    margin: float
    """Required over found sigma: at least 1 is met."""

Miss = Literal["too_large", "not_observable", "rests_on_prior", "inconsistent", "no_number"]
"""Why a requirement is missed. too_large: Sigma is above it. not_observable: The unknown is not determined by the outputs.
rests_on_prior: Sigma is hardly below the prior's: it says what the prior says. inconsistent: The filter is wrong about it: its error
is beyond four sigma. no_number: Sigma or the estimate is no number.
"""


class Missed(Record):
    """An unknown that misses its requirement."""

    __slots__ = ()

    name: str
    """The unknown."""
    why: Miss
    """Why."""


class Requirements(Record):
    """What became of all requirements."""

    __slots__ = ()

    basis: Basis
    """Under what this is decided."""
    stated: int
    """Unknowns with a requirement."""
    met: int
    """How many of them meet it."""
    worst: Margin | None
    """The smallest margin of those whose sigma counts."""
    missed: list[Missed]
    """Those that miss theirs, in model order."""
    on_prior: list[str]
    """Unknowns with a requirement that the samples do not determine, so that their sigma rests on stated priors alone."""


class OtherCarry(Record):
    """A scheme under another carry than its own: same positions, dwells, noise and requirements. Slews, which only inertial carry has,
    are left out.
    """

    __slots__ = ()

    carry: Carry
    """Carry: what of psi goes on between positions."""
    worst: Worst | None
    """The largest sigma of a drift coefficient in deg/h (per g); null where a coefficient is not observable, or where nothing was
    judged.
    """
    without_slews: bool
    """True if the slews of the scheme are left out there, since only inertial carry has slews."""
    requirements: Requirements | None
    """Outcome of the requirements; null where nothing was judged."""
    not_judged: str | None
    """The reason why nothing was judged; left out where it was."""


class Validity(Record):
    """Whether the small-angle model holds for the drifts of a run."""

    __slots__ = ()

    largest_psi_deg: float
    """Largest `|psi|`, in deg."""
    neglected_g: float
    """Largest `|psi|^2/2`, in g: what the observation model (6) leaves out."""
    accelerometer_noise_g: float
    """Noise of the observation, in g."""
    neglected_dph: float
    """Largest g-sensitive coefficient times the largest `|psi|`, in deg/h: what the drift model (3) leaves out."""
    smallest_requirement_dph: float | None
    """The smallest sigma required of a drift coefficient, in deg/h (per g)."""
    holds: bool
    """Whether both are small."""


class DropOne(Record):
    """A scheme without one of its positions."""

    __slots__ = ()

    position: str
    """The position left out."""
    lost: list[str]
    """Unknowns that are not observable without it."""
    worst: Worst | None
    """The worst sigma without it."""
    requirements: Requirements
    """Outcome of the requirements without it."""


class Sensitivity(Record):
    """The worst sigma under another condition."""

    __slots__ = ()

    condition: str
    """The condition: `latitude 60 deg`, `dwell x 2`, `reset carry`; `platform carry, no slews` where the scheme has slews, which only
    inertial carry knows.
    """
    rank: tuple[int, int]
    """The rank with dwell and the number of unknowns there."""
    worst: Worst | None
    """The worst sigma there."""
    worst_determined: Worst | None
    """The worst sigma there of the coefficients that the scheme itself makes observable; null when one is not."""

Reached = Literal["at_the_shortest", "within", "still_falls"]
"""Where a sigma is within 5 % of the least. at_the_shortest: At the shortest dwell looked at already: shorter ones may do as well, or
better. within: Within the dwells looked at. still_falls: Beyond a quarter of the longest dwell: sigma still falls.
"""


class CoefficientFloor(Record):
    """The floor of one coefficient, which is a constant: a drift coefficient D_F is the bias at the start of the run."""

    __slots__ = ()

    name: str
    """Its name."""
    unit: str
    """The unit of its sigmas."""
    sigma: float | None
    """Sigma with the dwells of the scheme, without prior; null when samples do not determine it."""
    least_sigma: float | None
    """The least sigma over all dwells looked at; null when samples do not determine it."""
    reached: Reached | None
    """Where it is reached; null when samples do not determine it."""
    dwell_s: float | None
    """The shortest dwell (mean of the positions) in s at which sigma is within 5 % of the least, where this lies within the dwells
    looked at.
    """


class NoiseFloor(Record):
    """How well coefficients can be known under random drift, however long the dwells."""

    __slots__ = ()

    drift_noise_deg_sqrt_h: float
    """Density of the random drift besides what the gyros have, in deg/sqrt(h)."""
    gyro_noise: GyroNoise
    """The gyros."""
    dwells_s: tuple[float, float]
    """The shortest and the longest dwell looked at, in s: the mean of the positions, all in proportion."""
    coefficients: list[CoefficientFloor]
    """Per coefficient."""


class Review(Record):
    """One scheme."""

    __slots__ = ()

    name: str
    """Its name: the file's."""
    carry: Carry
    """What is carried between positions."""
    conditions: MeasurementReport
    """What its sigmas rest on."""
    positions: list[str]
    """Its positions."""
    slews: list[Slew]
    """The turns between them that take time, with the position that each leads to."""
    total_s: float
    """Total time with slews, in s."""
    rank: tuple[int, int]
    """The rank with dwell (by derivatives where accuracy orders are not computed), and the number of unknowns."""
    quantities: list[ComparisonQuantity]
    """Per unknown."""
    worst: Worst | None
    """The largest sigma of a coefficient; null when one is not observable."""
    meets_requirements: bool
    """True if requirements are stated and every one is met."""
    requirements: Requirements
    """Outcome of the requirements by the predicted sigmas."""
    other_carries: list[OtherCarry]
    """The same scheme under the other carries."""
    has_accuracy_orders: bool
    """Whether accuracy orders are computed: none are for rotating segments."""
    validity: Validity | None
    """Validity of the small-angle model at the drifts that are stated; null where none are (`values`), or for very many steps."""
    drop_one: list[DropOne]
    """What happens without each of the positions."""
    sensitivity: list[Sensitivity]
    """The worst sigma under other conditions."""
    noise_floor: NoiseFloor | None
    """How well coefficients can be known under random drift, however long the dwells; left out where the gyros have no noise of their
    own.
    """
    gimbals: GimbalReport | None
    """Angles and turns beyond the gimbal limits that the scheme states; left out where it states none."""


class Comparison(Shape):
    """Several schemes, judged alike."""

    schema: str
    """`obsdeg.comparison/2`."""
    version: str
    """Version of the program."""
    schemes: list[Review]
    """The schemes in the order given."""
    differ: list[str]
    """What differs between the schemes besides positions, dwells and slews: carry, latitude, unknowns, requirements, noise, step."""
    seed: int
    """Seed of all random choices."""


class Minimum(Record):
    """The fewest positions that make every required coefficient observable."""

    __slots__ = ()

    positions: int | None
    """Their number; null when all candidates together do not do, or when the sets are too many to be examined."""
    witness: list[str]
    """A set that does."""
    counting_bound: int
    """No fewer can do: the required coefficients over the rows of a position, rounded up (0 where torquer errors act in every turn)."""
    rows_per_position: int
    """The most independent rows on the unknowns that a candidate adds, under reset carry without those that its psi takes."""
    none_of: list[tuple[int, int]]
    """`[size, number of sets]`: none of these does, by exhaustion."""
    never: list[str]
    """Coefficients that all candidates together leave unobservable."""
    proven: bool
    """Whether `positions` is the fewest, or `never` is never, by more than rounding and chance: nothing smaller was left out, and the
    bound on the probability of an error is below 1e-12.
    """


class TiesReport(Record):
    """Sequences that are as good as the best."""

    __slots__ = ()

    sequences: int
    """How many, the best and all their images under turns of the platform axes among them."""
    within: float
    """Two tie when their worst degrees are equal and their criteria, as double precision gives them, differ by less than this part."""


class Weight(Record):
    """A candidate and its weight."""

    __slots__ = ()

    candidate: str
    """The candidate."""
    weight: float
    """Its part of all positions, before it is divided by the sum of all."""


class Finer(Record):
    """A scheme that rounding leaves out."""

    __slots__ = ()

    value: float
    """Its criterion."""
    angles: list[str]
    """Euler angles of its positions in degrees."""


class Rounded(Record):
    """Free attitudes with rounded angles: every scheme is evaluated at the angles as they are rounded."""

    __slots__ = ()

    step_deg: float
    """Angles are multiples of so many degrees, but for the cardinal attitudes, which may be chosen too, and for what gimbal limits ask
    for: the twin (alpha+180, 180-beta, gamma+180) of such angles, and at beta = +-90 another alpha.
    """
    finer: Finer | None
    """A better scheme, by the same search with angles in hundredths of a degree; null where none was found."""


class EverywhereReport(Record):
    """How good the best scheme of any attitudes can be, whatever the candidates and the gimbals are; requirements on psi left out.
    Attitudes are taken up where they add most; between the points of a net of 3 degrees what they add is bounded as a trigonometric
    polynomial, and rounding with it, so that the bound holds for all.
    """

    __slots__ = ()

    best_possible: float
    """No scheme of so many attitudes, equal dwells, has a smaller criterion."""
    within_percent: float
    """The criterion of the first scheme that is not refined is at most so much above, in percent of the bound."""
    rounding: float | None
    """What rounding may hide of that criterion, as a part of it: as above, that of the attitudes of the scheme with it."""
    attained: float
    """The criterion that the weights would have as a scheme: all of them, with angles to hundredths of a degree and weights as they are
    rounded here.
    """
    weights: list[Weight]
    """The ten heaviest attitudes, each once, with their weights, heaviest first: Euler angles in degrees, beta up to 90, the others
    above -180 and up to 180. Weights are parts of the sum of all, rounded to two digits, or to as many as lose no more than a
    thousandth of the variance; those below 1e-7 are left out.
    """
    lighter: int
    """Number of lighter attitudes, which are not listed."""
    lighter_weight: float
    """Sum of the weights of the lighter attitudes."""
    rounded: Rounded | None
    """Where attitudes were free: how their angles were rounded, and what that costs; null where candidates were given."""


class Certificate(Record):
    """How good the best scheme of so many of these candidates can be: a bound from the optimal weights of the candidates (approximate
    design theory). It holds for schemes of any worst degree, within the constraints or not, and allows for the rounding in its
    evaluation; the information of each position is as double precision gives it, the same as in the search.
    """

    __slots__ = ()

    best_possible: float
    """No scheme of so many of these candidates, equal dwells, has a smaller criterion."""
    within_percent: float
    """The criterion of the first scheme that is not refined is at most so much above, in percent of the bound."""
    efficiency: float
    """The square of the bound over that criterion: how much of the information that the best could have it has at least (for D the
    D-efficiency).
    """
    rounding: float | None
    """What rounding may hide of that criterion, as a part of it: it is added before the criterion is held against the bound. By the
    residual of the inverse; null where what does not count is not determined, so that nothing is known of it and nothing added.
    """
    attained: float
    """The criterion that the weights would have as a scheme, exactly as they are listed; the bound cannot be larger."""
    weights: list[Weight]
    """How the weights divide the time among the candidates: parts of their sum, rounded to two digits, or to as many as lose no more
    than a thousandth of the variance; those below 1e-7 are left out.
    """
    everywhere: EverywhereReport | None
    """The same for all attitudes; null where it was not asked for."""
    front: list[tuple[float, float]]
    """`[total time in s, criterion]`: no scheme of these candidates, in equal dwells and one of the numbers of positions asked for, is
    below at this time.
    """


class SearchReport(Record):
    """What was searched, and how."""

    __slots__ = ()

    positions: int
    """The number of positions."""
    conditions: MeasurementReport
    """Conditions of every sigma: the information of all samples on psi and all coefficients, with the random drift and the priors that
    are stated. Every position has the dwell, slews are about the eigenaxis, Z is not used meanwhile.
    """
    drift_noise: str | None
    """Random drift that is stated: the search leaves it out, and the figures of all schemes that are listed count it; null: none."""
    prior: str | None
    """Knowledge beforehand that sigmas and the bound count beside the samples: the priors that are stated; null: none. What is
    observable is by the samples alone.
    """
    criterion: str
    """What makes a scheme better: worst, A, D, E or margin."""
    unit: str | None
    """Its unit: deg/h (per g), ug (per g), ppm or arcsec; null for margin, and for D of coefficients in several units, each in its own."""
    examined: int
    """Sequences whose sigma was computed."""
    lost: int
    """Of these, sequences that the exact verdict, of repositioning at once, calls observable, but whose samples do not determine every
    required coefficient as far as double precision tells: they count as worse than all others.
    """
    sequences: int | None
    """Number of sequences, up to turns of the platform axes, that a search of all would go through where not all were searched (`within`
    0); null where all were, and where they are too many to be held or counted.
    """
    excluded: int
    """Sequences, observable or not, that were not examined because a bound leaves no doubt: as far as double precision tells their
    criterion is larger than that of all listed.
    """
    proven: bool
    """Whether no sequence of candidates within the constraints is better than the first, by exhaustion, or because a bound excludes the
    rest: none has a smaller worst degree, or the same and a smaller criterion.
    """
    ties: TiesReport | None
    """How many sequences are as good as the first; null where not all were searched."""
    order_matters: bool
    """Whether orders of the same positions count as different schemes."""
    interrupted: bool
    """Whether the search was interrupted; if the first is proven nevertheless, before the front was complete."""
    degree_floor: int | None
    """The smallest worst degree that all candidates together allow; null where torquer errors act on the way, so that sets have no
    degree.
    """
    constraints: list[str]
    """The constraints in words."""
    certificate: Certificate | None
    """How good the best can be; null where no such bound is known: under platform and inertial carry, and where the noise of Z is
    correlated, information is no sum over positions.
    """


class HalfTurn(Record):
    """Half a turn to a position."""

    __slots__ = ()

    to: int
    """Which position it leads to, counted from 1."""
    about: tuple[float, float, float]
    """The axis, about which it is right-handed: a unit vector (North, Up, East)."""


class Found(Record):
    """A scheme that was found."""

    __slots__ = ()

    positions: list[str]
    """Its positions in order."""
    image_of: int | None
    """Which of those listed before it, counted from 1, a turn of the platform axes turns into it (coefficients renamed): the same scheme
    in other axes; null: none.
    """
    angles: list[str]
    """Their gimbal angles alpha,beta,gamma in degrees: within the gimbal limits, each with the shortest gimbal way from the position
    before (without limits as the candidates have them, in (-180, 180]).
    """
    half_turns: list[HalfTurn]
    """The half turns between them, each with its direction: the other one is another scheme."""
    refined: bool
    """Its angles were refined continuously."""
    dwell_s: float
    """Dwell of each position, in s; the mean where they have dwells of their own."""
    dwells_s: list[float]
    """Where the total time was divided among the positions: the dwell of each, in s; empty where they are equal. Moving a two hundred
    and fifty-sixth of an equal dwell (at least the time between samples) from one position to another makes none of them better.
    """
    total_s: float
    """Total time with turns, in s."""
    value: float
    """The criterion: a sigma in its unit, or for margin the largest sigma over its requirement, psi's too where it counts."""
    worst_sigma_dph: float | None
    """The largest sigma of a required drift coefficient in deg/h (per g): information of all samples, prior if one is stated, no drift
    noise; null when none is required.
    """
    worst: str | None
    """The coefficient that has it."""
    requirements: Requirements
    """What became of the requirements on what must be observable, and on psi (of the start, under reset carry of every position) when
    that is every coefficient.
    """
    worst_degree: int
    """Its largest degree of a required coefficient."""
    worst_accuracy_order: int | None
    """Its largest accuracy order of a required coefficient."""
    rank: tuple[int, int]
    """Its exact rank by derivatives, and the number of unknowns."""


class Design(Shape):
    """The result of a search."""

    schema: str
    """`obsdeg.design/2`."""
    version: str
    """Version of the program."""
    carry: Carry
    """What is carried between positions."""
    latitude_deg: float
    """Latitude in degrees."""
    latitude_by_default: bool
    """Whether the latitude was chosen by the program."""
    geometry: Geometry
    """Axes of the gyros."""
    terms: str
    """Unknown besides psi; all of them are estimated."""
    candidates: list[str]
    """The attitudes to choose from."""
    beyond_gimbals: list[str]
    """Attitudes that the gimbals do not reach."""
    symmetry: int
    """Rotations of the platform axes that turn schemes into equally good ones (1: the identity)."""
    required: list[str]
    """Coefficients that must be observable, and that the criterion is about."""
    minimum: Minimum
    """The fewest positions."""
    search: SearchReport | None
    """What was searched; null when only the minimum was asked for."""
    found: list[Found]
    """The best schemes, best first."""
    front: list[Found]
    """Schemes that none found beats in both total time and criterion, by total time."""
    not_judged: list[str]
    """Unknowns and families with a stated requirement that is not judged, since only some coefficients are asked for."""
    other_carries: list[OtherCarry]
    """The first scheme under the other carries; empty where none was searched."""
    gimbals: GimbalReport | None
    """Turns of the first scheme beyond the gimbal limits, and positions of the file of candidates whose angles lie beyond. Left out
    where no limits are stated.
    """
    primes: int
    """How many independent random 61-bit primes every set is judged by: it counts as observable when one of them says so."""
    error_bound: float
    """Bound on the probability that an observable set was overlooked, or a degree taken too large; nothing is called proven unless it is
    below 1e-12.
    """
    seed: int
    """Seed of all random choices."""


class Walks(Shape):
    """The fewest positions of a walk."""

    schema: str
    """`obsdeg.walks/1`."""
    version: str
    """Version of the program."""
    terms: str
    """Unknown besides psi."""
    candidates: list[str]
    """The attitudes to choose from."""
    most_turn_deg: float
    """The largest turn from one position to the next, in degrees: by one axis, the shortest way."""
    turns: int
    """Turns between candidates that are not larger."""
    required: list[str]
    """Coefficients that must be observable."""
    positions: int | None
    """The fewest positions that were found; null when no walk does."""
    walk: list[str]
    """A walk that does."""
    angles: list[str]
    """Its Euler angles in degrees."""
    rank: tuple[int, int]
    """Its rank, and the number of unknowns."""
    latitude_deg: float | None
    """The latitude in degrees; null when generic."""
    never: list[str]
    """Coefficients that even the tour of all turns leaves unobservable; no walk is sought then."""
    counting_bound: int
    """No fewer can do: the required coefficients over the rows of a position, rounded up."""
    rows_per_position: int
    """The most independent rows that a position adds."""
    none_of: list[tuple[int, int]]
    """`[positions, walks]`: none of these does, by exhaustion."""
    proven: bool
    """Whether `positions` is the fewest of these candidates and turns: nothing smaller was left out, and the bound on the probability of
    an error is below 1e-12.
    """
    interrupted: bool
    """Whether the search was interrupted."""
    error_bound: float
    """Bound on the probability that a walk that does was overlooked."""
    seed: int
    """Seed of all random choices."""


class Worth(Record):
    """What a sequence is worth, better first: constraints kept, then a small worst degree, then a small criterion."""

    __slots__ = ()

    violation: float
    """How far time limits, requirements and degree caps are missed; 0 when kept."""
    degree: int
    """The largest degree of a required coefficient."""
    value: float
    """The criterion."""


class Stop(Record):
    """A position of a sequence: which candidate, and which way there."""

    __slots__ = ()

    candidate: int
    """The candidate."""
    reversed: bool
    """A half turn to it goes the other way round than `Slew::to` says."""


class Scored(Record):
    """A sequence with its worth."""

    __slots__ = ()

    worth: Worth
    """What it is worth."""
    seconds: float
    """Dwells and turns, in s."""
    sequence: list[Stop]
    """The candidates in order, with the ways there."""


class Ties(Record):
    """The sequences near the best so far: how many there are of each criterion."""

    __slots__ = ()

    degree: int
    """The smallest worst degree."""
    counts: list[tuple[float, int, int]]
    """Criterion, searched images of a sequence, how many there are."""


class Best(Record):
    """The best sequences, best first, and the front of time against the criterion."""

    __slots__ = ()

    found: list[Scored]
    """At most as many as are kept."""
    front: list[Scored]
    """Sequences of the smallest worst degree that none of these beats in both time and criterion, by time."""
    ties: Ties
    """Those that are as good as the best."""
    complete: bool
    """Whether everything was searched."""
    examined: int
    """Sequences whose sigma was computed."""
    excluded: int
    """Sequences, observable or not, that a bound left out: they are worse than those kept."""
    lost: int
    """Of those examined, observable ones (by the exact verdict, of repositioning at once) whose samples do not determine what is
    required, as far as double precision tells.
    """


class Level(Record):
    """What was found among the sequences of one worst degree."""

    __slots__ = ()

    next: int
    """The first start that is not yet searched."""
    best: Best
    """What was examined, found, and the front."""


class Part(Shape):
    """One part of an exhaustive search, done or interrupted."""

    schema: str
    """`obsdeg.part/1`."""
    version: str
    """Version of the program."""
    digest: str
    """SHA-256 of all inputs: the parts of one search have the same."""
    inputs: dict[str, str]
    """The inputs by name, as the library writes them: which differ, where digests do."""
    asked: str | None
    """Options and files of the command that wrote it, as the JSON text that the command reads: its merge needs no others; null where no
    command did.
    """
    part: tuple[int, int]
    """Which part, counted from 1, of how many."""
    starts: tuple[int, int, int]
    """The starts that are its own, counted from 0: the first, the one behind the last, and how many there are in all."""
    levels: list[Level]
    """What was found, by worst degree, smallest first (under reset carry all degrees together)."""
    complete: bool
    """Whether all of its starts were searched, at as many worst degrees as the whole may need."""

Truth = Literal["linear", "exact"]
"""How the truth is generated. linear: By the linear model of the filter: (2), (6). exact: By direction cosines: the drift turns the true
attitude, the specific force is taken in the true platform frame.
"""

Propagation = Literal["exponential", "rk4"]
"""How the filter gets its transition matrix. exponential: The matrix exponential of the linear model. rk4: Runge-Kutta of order four, as
the paper.
"""


class ConditionsReport(Record):
    """The conditions of a run with their units."""

    __slots__ = ()

    truth: Truth
    """How the truth is generated."""
    latitude_deg: float
    """Latitude in degrees."""
    latitude_by_default: bool
    """Whether the latitude was chosen by the program."""
    step_s: float
    """Largest step in s."""
    slew_rate_deg_s: float | None
    """Rate of slews in deg/s where a position does not say its own; null: instantaneous."""
    accelerometer_noise_g: float
    """Noise of the observation per sample in g."""
    accelerometer_bias: AccelerometerBias | None
    """Bias instability of the accelerometers, states of the filter and of the truth; left out where there is none."""
    drift_noise: str
    """Random drift with its unit."""
    drift_noise_density_deg_sqrt_h: tuple[float, float]
    """Its density in deg/sqrt(h) in the shortest and in the longest step of the timeline."""
    drift_noise_step_s: float | None
    """The step in s for which a bias of one step was given; null for a density."""
    drift_noise_differs: bool
    """Whether the density is another than with that step, by more than 1 %."""
    gyro_noise: GyroNoise | None
    """What the datasheet of the gyros says besides, states of the filter and of the truth; left out where there is none."""
    propagation: Propagation
    """Propagation of the filter."""
    drift_scale: float
    """Factor on true drifts and their priors."""
    by_default: list[str]
    """Keys of the conditions that nobody states, so that the run has those of the program: latitude_deg, accelerometer_noise_g, step_s,
    dwell_s, azimuth_noise_deg, drift_noise, values, priors.
    """


class TimelineReport(Record):
    """A position or slew of the timeline."""

    __slots__ = ()

    position: str
    """The position, or the one a slew goes to."""
    slew: bool
    """Whether it is a slew."""
    start_s: float
    """Start in s."""
    end_s: float
    """End in s."""
    turn: Turn | None
    """How a slew turns; null at a position."""


class LinearEstimate(Record):
    """What the linear filter says at the end of the run."""

    __slots__ = ()

    error: float
    """Estimate minus truth."""
    sigma: float
    """What it believes of the error."""

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
"""What a run says of one unknown. reached: Sigma is at or below what is required. converging: Sigma fell, but not to what is required.
determined: Sigma fell; nothing is required of it. rests_on_prior: The samples determine it, but sigma is (nearly) that of the prior.
prior_only: The samples do not determine it: whatever sigma says, it comes of the prior. large_angles_only: The verdict, which is
about small angles, has it undetermined; a filter with full attitudes learns of it through large ones. inconsistent: The error is
beyond four sigma: the filter is wrong about it. no_number: The error or sigma is no number.
"""


class Estimate(Record):
    """The estimate of one unknown or combination at the end of the run."""

    __slots__ = ()

    name: str
    """The unknown or combination."""
    unit: str
    """Unit of all its numbers."""
    status: Status
    """The exact verdict."""
    degree: int | None
    """The observable degree."""
    accuracy_order: int | None
    """The accuracy order."""
    truth: float
    """The truth."""
    estimate: float
    """The estimate."""
    error: float
    """Estimate minus truth."""
    sigma: float
    """What the filter believes of the error."""
    predicted_sigma: float | None
    """Predicted sigma by the conditions that are stated; null where neither samples nor stated priors bound it."""
    error_over_sigma: float
    """Error over sigma."""
    linear: LinearEstimate | None
    """What the linear filter makes of the same measurements; null where it is the filter."""
    prior_sigma: float
    """Sigma at the start."""
    required_sigma: float | None
    """The sigma to be reached."""
    time_to_requirement_s: float | None
    """When it was reached first, in s; null for what the samples do not determine."""
    outcome: Outcome
    """What came out."""
    prior_of: list[str]
    """On whose prior it rests besides its own: what the outputs do not tell it from. Empty unless it is known from the prior only."""


class SigmaRatio(Record):
    """The ratio of a run's sigma to the predicted one."""

    __slots__ = ()

    name: str
    """The unknown."""
    ratio: float
    """Sigma of the run over the predicted sigma, dimensionless."""

RunDiffers = Literal["random_drift", "prior", "full_attitudes"]
"""Reason why the sigmas of a run may differ from the predicted ones. random_drift: The random drift of the program: none is stated.
prior: Priors of the program: not every unknown has a stated one. full_attitudes: A filter with full attitudes: the prediction is that
of small angles.
"""


class RunRequirements(Record):
    """A run's sigmas against the requirements, beside the prediction."""

    __slots__ = ()

    requirements: Requirements
    """Outcome of the requirements in the run."""
    largest_ratio: SigmaRatio | None
    """The largest ratio of a sigma of the run to the predicted one, over the unknowns that have both; null where none has."""
    smallest_ratio: SigmaRatio | None
    """The smallest such ratio; null where no unknown has both."""
    differs: list[RunDiffers]
    """Reasons why the sigmas of the run may differ from the predicted ones."""

Doubt = Literal["no_number", "nis", "nees", "error", "correlated"]
"""What speaks against a run. no_number: A statistic, an estimate or a sigma is no number. nis: The mean NIS is outside its band of 99.9
%. nees: The NEES is above the band of 99.9 %. error: An error is beyond four sigma. correlated: The innovations are not white.
"""


class Consistency(Record):
    """Statistics of one run."""

    __slots__ = ()

    nis: float
    """Mean normalised innovation squared; its expectation is the number of outputs."""
    nis_band: tuple[float, float]
    """The band of the mean NIS, 95 %."""
    nis_wide_band: tuple[float, float]
    """The band of 99.9 %, in which it must be."""
    nees: float
    """Normalised estimation error squared at the end; its expectation is the number of states: unknowns, and the biases of the gyros
    where these are states, but for the directions that are left out.
    """
    unresolved_directions: int
    """Directions that the NEES leaves out: known more than a million times better than the unknowns themselves, which a filter
    linearised at its estimates believes but cannot know. None where the model is linear.
    """
    nees_band: tuple[float, float]
    """Its band, 95 %."""
    nees_limit: float
    """The upper end of its band of 99.9 %, which it must not exceed. A small one says nothing: true values are given, not drawn."""
    whiteness_probability: float
    """Probability that white noise has autocorrelations as large as the innovations', smallest over outputs."""
    beyond: list[str]
    """Unknowns whose error is beyond four sigma."""
    doubts: list[Doubt]
    """What speaks against the run."""
    consistent: bool
    """Whether nothing does."""

FilterKind = Literal["linear", "extended", "iterated"]
"""Which filter estimates. linear: Of the linear model, with gains that are known beforehand: small psi. extended: With full attitudes,
its Jacobians at the estimate of the moment. iterated: The same, linearised again along the whole run until that settles.
"""

FilterReason = Literal["given", "linear_truth", "valid", "not_valid"]
"""Why a filter was chosen. given: It was asked for. linear_truth: The truth is that of the linear model. valid: The small-angle model
holds for the truth. not_valid: It does not.
"""


class FilterReport(Record):
    """Which filter ran."""

    __slots__ = ()

    kind: FilterKind
    """The filter."""
    reason: FilterReason
    """Why this one."""
    passes: int
    """Linearisations of the whole run: 1 but for the iterated filter."""
    converged: bool
    """Whether they settled."""


class Simulation(Shape):
    """One run of the filter against a simulated truth."""

    schema: str
    """`obsdeg.simulation/2`."""
    version: str
    """Version of the program."""
    carry: Carry
    """What is carried between positions."""
    conditions: ConditionsReport
    """Under which conditions."""
    timeline: list[TimelineReport]
    """The timeline."""
    quantities: list[Estimate]
    """The unknowns in model order: at the end of the run."""
    combinations: list[Estimate]
    """Observable combinations of unknowns that are not observable alone."""
    requirements: Requirements
    """Outcome of the requirements by prediction, as in every other command: the information of all samples with the noise, the random
    drift and the priors that are stated.
    """
    run: RunRequirements
    """Outcome of the requirements in this run, by the sigmas of its filter at the end."""
    other_carries: list[OtherCarry]
    """The same scheme under the other carries."""
    consistency: Consistency
    """Whether errors and innovations are what the filter believes."""
    filter: FilterReport
    """Which filter it is, and why."""
    validity: Validity
    """Whether the linear model holds for these drifts."""
    noise_floor: NoiseFloor | None
    """How well coefficients can be known however long the dwells; left out where the gyros have no noise of their own."""
    gimbals: GimbalReport | None
    """Angles and turns beyond the gimbal limits that the scheme states; left out where it states none."""
    seed: int
    """Seed of the noise."""


class SystemEstimate(Record):
    """The estimate of one unknown at the end."""

    __slots__ = ()

    name: str
    """Its name."""
    unit: str
    """Its unit, as the file says."""
    status: Status | None
    """The exact verdict; null for a state whose start is known."""
    degree: int | None
    """The degree."""
    truth: float
    """The truth."""
    estimate: float
    """The estimate."""
    error: float
    """Estimate minus truth."""
    sigma: float
    """What the filter believes of the error."""
    error_over_sigma: float
    """Error over sigma."""
    prior_sigma: float
    """Sigma at the start."""
    outcome: Outcome
    """What came out; nothing is required."""


class SystemRun(Shape):
    """A run of a system."""

    schema: str
    """`obsdeg.system-run/1`."""
    version: str
    """Version of the program."""
    name: str
    """The system."""
    quantities: list[SystemEstimate]
    """Estimates at the end."""
    consistency: Consistency
    """Whether errors and innovations are what the filter believes."""
    time: float | None
    """Time of the model at which the run begins, in its unit; 1 stands for a generic time. Null where neither the equations nor the
    known inputs hold the time.
    """
    duration: float
    """How long every experiment ran, in the unit of the model."""
    step: float
    """Between two samples."""
    noise: list[tuple[str, float]]
    """Standard deviation of the noise of a sample, by output."""
    error_bound: float | None
    """Of a model judged in prime fields: bound on the probability that a verdict is wrong."""
    digits: DigitsReport | None
    """Of a model judged in real numbers: how clear its ranks were."""
    seed: int
    """Seed of the noise and of the initial errors."""


class Counts(Record):
    """How many checks came out how."""

    __slots__ = ()

    agree: int
    """Agree."""
    disagree: int
    """Disagree."""
    not_resolvable: int
    """Are not resolvable."""
    not_tested: int
    """Were not made."""

Agreement = Literal["agrees", "disagrees", "not_resolvable", "not_tested"]
"""What evidence makes of a verdict. agrees: What was measured is what the verdict says. disagrees: It is not. not_resolvable: Something
was measured, but neither for nor against the verdict, by a test that the answer states. not_tested: Nothing was measured.
"""


class SpaceCheck(Record):
    """Something that is no number, predicted and measured."""

    __slots__ = ()

    what: str
    """What is held against the samples."""
    predicted: str
    """By the exact verdicts."""
    measured: str
    """By the samples; empty when nothing was measured."""
    outcome: Agreement
    """Whether they agree."""


class Measured(Record):
    """How many of the orders that the verdicts say were measured by a slope."""

    __slots__ = ()

    measured: int
    """Slopes that were measured."""
    of: int
    """Unknowns and combinations that have an order."""


class Check(Record):
    """A predicted and a measured number."""

    __slots__ = ()

    predicted: float
    """What the exact verdict says."""
    measured: float | None
    """What the filter shows; null when it could not be measured."""
    outcome: Agreement
    """Whether they agree."""


class Partners(Record):
    """Unknowns that share with one a direction that Z does not see and that holds no shorter one."""

    __slots__ = ()

    predicted: list[str]
    """By the exact verdicts."""
    measured: list[str] | None
    """Those of the directions that the samples do not show; null when they were not measured."""
    outcome: Agreement
    """Whether they are the same."""


class QuantityEvidence(Record):
    """Evidence on one unknown or combination."""

    __slots__ = ()

    name: str
    """The unknown or combination."""
    status: Status
    """The exact verdict."""
    degree: int | None
    """The observable degree."""
    accuracy_order: int | None
    """The accuracy order."""
    modelled: bool
    """Whether the filter has it: one that was made wrong may lack an unknown, and nothing is measured then."""
    degree_slope: Check
    """a: log-log slope of sigma against the dwell, psi handed on between positions as it was at the start of each: -(degree + 1/2); 0
    when nothing is learnt.
    """
    status_measured: Status | None
    """a: whether its column of that information is zero, and whether it is in the span; null when it was not measured."""
    status_outcome: Agreement
    """Whether that is the verdict."""
    partners: Partners | None
    """Unknowns that derivatives do not tell it from; null for a combination."""
    slope: Check
    """a: log-log slope of sigma (psi: of the start) against the dwell: -(accuracy order + 1/2); 0 when nothing is learnt."""
    slope_at_end: Check
    """The same with psi of the end, which is what a filter shows."""
    inflation: Check
    """b: factor on sigma (psi: of the end) when the prior variance is multiplied by 100."""


class NullEvidence(Record):
    """Evidence on one null vector."""

    __slots__ = ()

    direction: str
    """`psi_y = 1, D_FZ = 6.4e-5` in SI units."""
    seen: Check
    """How much of it Z sees, relative to the best seen direction: predicted 0."""
    correlation: Check | None
    """Smallest correlation of its unknowns under a diffuse prior, signed by the prediction: predicted 1; null when other null vectors
    share its unknowns, or when it has only one.
    """


class Count(Record):
    """A predicted and a measured count."""

    __slots__ = ()

    predicted: int
    """By the exact verdicts."""
    measured: int
    """By the samples."""
    outcome: Agreement
    """Whether they agree."""


class CrossCheckDifference(Record):
    """The largest difference of two covariances."""

    __slots__ = ()

    name: str
    """What is compared."""
    difference: float
    """`max |P_ij - Q_ij| / sqrt(Q_ii Q_jj)`."""
    limit: float
    """The limit."""
    outcome: Agreement
    """Whether it is kept; not resolvable where rounding may make a tenth of it: the largest variance of the prior, beside the smallest
    at the end, times the steps times 2e-16.
    """


class Statistic(Record):
    """A statistic with its bands."""

    __slots__ = ()

    name: str
    """What is averaged."""
    expected: float
    """Its expectation."""
    measured: float
    """The average."""
    band: tuple[float, float]
    """The band of 95 %."""
    wide_band: tuple[float, float]
    """The band of 99.9 %, in which it must be."""
    pass_: bool
    """Whether it is."""


class HistoryPoint(Record):
    """Averages over the runs at one time."""

    __slots__ = ()

    t_s: float
    """Time in s."""
    nees: float
    """ANEES of all unknowns."""
    nis: float
    """Mean NIS since the point before."""
    samples: int
    """Number of samples in it, all runs together."""


class MonteCarlo(Record):
    """Monte Carlo evidence."""

    __slots__ = ()

    filter: FilterKind
    """Which filter."""
    about_the_truth: bool
    """Whether all runs have the scheme's own truth, with initial estimates drawn about it from the prior; otherwise truths are drawn
    about the initial estimate.
    """
    runs: int
    """Number of runs."""
    unsettled: int
    """Runs whose linearisations did not settle."""
    statistics: list[Statistic]
    """ANEES and NIS."""
    whiteness_probability: float
    """Probability that white innovations have autocorrelations as large."""
    white: bool
    """Whether that is above 0.001."""
    history: list[HistoryPoint]
    """ANEES and mean NIS over time."""


class Ranking(Record):
    """Agreement of the order of all unknowns."""

    __slots__ = ()

    kendall_tau: float | None
    """Kendall's tau-b of predicted and measured accuracy orders; null when all are tied."""
    pass_: bool
    """Whether it is 1 (or all are tied on both sides)."""
    errors: float | None
    """Of runs with full attitudes: Kendall's tau-b of the predicted orders at the end and the errors there, root mean square in sigmas
    of the prior; null where the filter is linear. It decides nothing: orders are of short dwells, errors of those of the scheme.
    """


class Control(Record):
    """A filter that is wrong on purpose, and must be found out."""

    __slots__ = ()

    name: str
    """What is wrong with it."""
    failed: int
    """How many checks of a and b fail with it."""
    checks: int
    """Out of how many."""
    nis: float
    """Its mean NIS."""
    band: tuple[float, float]
    """The band in which a right filter's would be (99.9 %)."""
    off_deg: float
    """By how many degrees its latitude or an attitude is off."""
    outcome: Agreement
    """Whether it was found out; not resolvable where it was not, and need not be."""


class SlopeCurve(Record):
    """Sigma against the dwell."""

    __slots__ = ()

    name: str
    """The unknown or combination."""
    unit: str
    """Unit of sigma."""
    accuracy_order: int | None
    """The accuracy order."""
    points: list[tuple[float, float]]
    """`(dwell in s, sigma)`."""


class Correlation(Record):
    """A correlation matrix."""

    __slots__ = ()

    names: list[str]
    """The unknowns."""
    values: list[list[float]]
    """Row by row."""


class CrossCheck(Shape):
    """The cross-check of one scheme."""

    schema: str
    """`obsdeg.crosscheck/1`."""
    version: str
    """Version of the program."""
    carry: Carry
    """What is carried between positions."""
    filter: str | None
    """How the filter was made to differ from the truth; null for a right one."""
    conditions: ConditionsReport
    """Under which conditions."""
    timeline: list[TimelineReport]
    """The timeline."""
    passed: bool
    """Whether everything agrees."""
    verdicts_agree: bool
    """Whether all but d agrees: d holds the filter against drawn truths, which fails where the small-angle model does, too."""
    disagreements: list[str]
    """What disagrees, in words."""
    unresolved: list[str]
    """Reasons why checks are not resolvable, one for each such check."""
    counts: Counts
    """How many checks agree, disagree, are not resolvable, were not made."""
    method: list[str]
    """How slopes are measured, and when something is not resolvable."""
    not_tested: list[str]
    """What an analysis says and nothing here is held against."""
    spaces: list[SpaceCheck]
    """a: ranks, null space and combinations against the samples."""
    orders: Measured
    """How many accuracy orders were measured."""
    quantities: list[QuantityEvidence]
    """Evidence a and b per unknown and combination."""
    null_space: list[NullEvidence]
    """Directions that Z does not see."""
    defect: Count
    """Number of directions that Z does not see."""
    covariance: list[CrossCheckDifference]
    """Evidence c: covariance of the filter against the inverse information."""
    monte_carlo: MonteCarlo
    """Evidence d: Monte Carlo statistics."""
    ranking: Ranking
    """Evidence e: rank correlation of predicted and measured orders."""
    controls: list[Control]
    """Evidence f: filters that are wrong on purpose."""
    validity: Validity
    """Whether the small-angle model holds for the true values."""
    slopes: list[SlopeCurve]
    """Sigma against dwell, for the plot."""
    correlation: Correlation
    """Correlation of the estimate under a diffuse prior."""
    seed: int
    """Seed of the noise."""
    error_bound: float
    """Bound on the probability that a prediction is wrong."""


class SystemQuantityEvidence(Record):
    """What the information says of one unknown."""

    __slots__ = ()

    name: str
    """The unknown."""
    status: Status
    """The exact verdict."""
    degree: int | None
    """The degree."""
    slope: Check
    """Log-log slope of sigma against the horizon: -(degree + 1/2); measured null where it does not settle above rounding."""
    inflation: Check
    """Factor on sigma at the full duration when the prior is ten times as loose: 1, or 10 where not observable."""


class SymmetryEvidence(Record):
    """A symmetry against the information."""

    __slots__ = ()

    words: str
    """In words."""
    seen: Check
    """The information along it."""


class SystemEvidence(Shape):
    """The evidence for one system."""

    schema: str
    """`obsdeg.system-evidence/1`."""
    version: str
    """Version of the program."""
    name: str
    """The system."""
    quantities: list[SystemQuantityEvidence]
    """Per unknown."""
    symmetries: list[SymmetryEvidence]
    """Symmetries: the information along each, relative to the largest."""
    defect: Count
    """Unobservable directions: exact, and singular values that vanish."""
    failures: int
    """Checks that failed."""
    orders: Measured
    """How many degrees were measured."""
    checks: int
    """Checks that were made: what could not be measured, or not be resolved, is none."""
    not_resolvable: int
    """What was measured and is neither for nor against a verdict: an unknown that moves no output by more than rounding, or less than a
    hundredth of its diffuse prior is learnt of it; singular values between what is seen and what is not.
    """
    passed: bool
    """Whether none failed."""
    time: float | None
    """Time of the model at which the run begins, in its unit; 1 stands for a generic time. Null where neither the equations nor the
    known inputs hold the time.
    """
    duration: float
    """The longest horizon, of every experiment, in the unit of the model."""
    error_bound: float | None
    """Of a model judged in prime fields: bound on the probability that a verdict is wrong."""
    digits: DigitsReport | None
    """Of a model judged in real numbers: how clear its ranks were."""
    seed: int
    """Seed of all random choices."""


class ForceLength(Record):
    """How long the specific force is at a position."""

    __slots__ = ()

    position: str
    """The position."""
    length_g: float
    """In g."""

ForceError = Literal["scale", "zero"]
"""What an axis is off in. scale: Its scale. zero: Its zero."""


class ForceCause(Record):
    """What one axis may be off by, so that the specific force is not one g long."""

    __slots__ = ()

    error: ForceError
    """What it is an error of."""
    axis: str
    """The output of the accelerometer: fx, fy, fz."""
    by: float
    """What is recorded is larger by this: as a part (scale), or in g (zero)."""
    sigma: float
    """Its standard deviation."""
    besides: float | None
    """The part by which the force is longer besides, at all positions alike."""

CellKind = Literal["code", "stuck"]
"""What cells may be that hold one value again and again. code: A code of missing values: it is far from its neighbours. stuck: An output
that is stuck: it is what the rows before it have to the last digit.
"""


class ClockByEarth(Record):
    """A clock by the rate of the earth."""

    __slots__ = ()

    fast: float
    """The part by which it is fast."""
    sigma: float
    """Its standard deviation: a part that is not much larger does not show."""


class FindingInterrupted(Record):
    """The iteration was interrupted: the estimates are where it was then."""

    __slots__ = ()

    kind: Literal["interrupted"]


class FindingNotSettled(Record):
    """The iteration did not settle."""

    __slots__ = ()

    kind: Literal["not_settled"]


class FindingForce(Record):
    """The specific force is not one g long, and no unknown explains that."""

    __slots__ = ()

    kind: Literal["force"]
    record: str
    """The record."""
    length_g: float
    """Its mean length, in g."""
    alike: bool
    """Whether it is as long at all positions."""
    least: ForceLength
    """Where it is shortest."""
    most: ForceLength
    """Where it is longest."""
    causes: list[ForceCause]
    """Each of these alone makes it one g long: none where several axes are off, or all alike."""


class FindingCells(Record):
    """Cells of a column that hold one value again and again, far from their neighbours or many times in a row; they were left out."""

    __slots__ = ()

    kind: Literal["cells"]
    record: str
    """The record."""
    column: str
    """The column, as its header is written."""
    kind_of_cells: CellKind
    """What these cells may be."""
    value: float
    """The value, as it is written."""
    count: int
    """Number of cells."""
    lines: tuple[int, int]
    """First and last line."""


class FindingClock(Record):
    """The clock of a record does not go as fast as that of the scheme, or as the earth turns."""

    __slots__ = ()

    kind: Literal["clock"]
    record: str
    """The record."""
    by_durations: float | None
    """By which part it is fast, as positions begin and end."""
    by_earth: ClockByEarth | None
    """The same by the rate of the earth, where that is beyond chance."""


class FindingPosition(Record):
    """A position fits worse than its measurements allow."""

    __slots__ = ()

    kind: Literal["position"]
    record: str
    """The record."""
    position: str
    """The position."""
    chi_square: float
    """Chi-square per degree of freedom."""
    factor: float
    """How many times too small the sigmas are there: its root."""


class FindingNoise(Record):
    """All positions fit alike, and not as their sigmas say."""

    __slots__ = ()

    kind: Literal["noise"]
    chi_square: float
    """Chi-square per degree of freedom."""
    factor: float
    """What the sigmas are to be multiplied by."""


class FindingChannel(Record):
    """A component of Z fits not as its sigma says."""

    __slots__ = ()

    kind: Literal["channel"]
    channel: str
    """The component."""
    chi_square: float
    """Chi-square per degree of freedom."""
    factor: float
    """What its sigma is to be multiplied by."""


class FindingCorrelated(Record):
    """The residuals of a component are not independent of each other."""

    __slots__ = ()

    kind: Literal["correlated"]
    record: str
    """The record."""
    channel: str
    """The component."""
    probability: float
    """Probability that independent ones are correlated so."""


class FindingTemperature(Record):
    """The residuals of a component go with the temperature."""

    __slots__ = ()

    kind: Literal["temperature"]
    record: str
    """The record."""
    channel: str
    """The component."""
    correlation: float
    """The coefficient of correlation."""
    probability: float
    """Probability of that by chance."""


class FindingOutliers(Record):
    """Too many measurements lie far off for all of them to be outliers; none of these was left out."""

    __slots__ = ()

    kind: Literal["outliers"]
    count: int
    """How many."""
    of: int
    """Of so many."""


class FindingRepeatability(Record):
    """The records do not agree on the coefficients."""

    __slots__ = ()

    kind: Literal["repeatability"]
    chi_square: float
    """Chi-square per degree of freedom."""


class FindingSecondPath(Record):
    """Filter and least squares do not agree."""

    __slots__ = ()

    kind: Literal["second_path"]
    difference: float
    """The largest difference, in sigma."""


class FindingKnown(Record):
    """What was known before does not agree with the records."""

    __slots__ = ()

    kind: Literal["known"]
    chi_square: float
    """Chi-square per degree of freedom."""

Finding = Union[
    FindingInterrupted,
    FindingNotSettled,
    FindingForce,
    FindingCells,
    FindingClock,
    FindingPosition,
    FindingNoise,
    FindingChannel,
    FindingCorrelated,
    FindingTemperature,
    FindingOutliers,
    FindingRepeatability,
    FindingSecondPath,
    FindingKnown,
]
"""What speaks against the model or its sigmas."""


class Estimated(Record):
    """An unknown or a combination."""

    __slots__ = ()

    name: str
    """Its name."""
    unit: str
    """Its unit: deg, deg/h, deg/h/g, ..."""
    status: Status
    """The exact verdict of the scheme."""
    degree: int | None
    """The observable degree."""
    determined: bool
    """Whether scheme and records determine it; otherwise there is no estimate."""
    estimate: float | None
    """The estimate."""
    sigma: float | None
    """Its standard deviation, by the noise that was assumed."""
    sigma_rescaled: float | None
    """The same with errors of the records times the root of chi-square per degree of freedom, where that is above one; what was known
    before stays as it is.
    """
    predicted_sigma: float | None
    """What the linear model has at the times and with the noise of the records (and what was known before), where the platform is at the
    attitudes of the scheme.
    """
    held_factor: float | None
    """What sigma is times that with all known that nothing determines: above one where the nonlinear model bends what is held within its
    prior into the estimate.
    """
    prior_shift: float | None
    """How far the prior of the scheme would move the estimate, in sigma."""
    prior_factor: float | None
    """What it would make of sigma: 1 where it does not matter."""


class CovarianceTable(Record):
    """Estimates with their covariance."""

    __slots__ = ()

    names: list[str]
    """Names, in the order of rows and columns."""
    units: list[str]
    """Their units."""
    estimates: list[float]
    """Their estimates."""
    covariance: list[list[float]]
    """The covariance of their errors, by the noise that was assumed."""
    rescaled: list[list[float]]
    """The same with errors of the data times the root of chi-square per degree of freedom, where that is above one; what was known
    before stays as it is.
    """


class Fit(Record):
    """How well everything fits."""

    __slots__ = ()

    chi_square: float
    """The sum of squares of all residuals, in sigma."""
    degrees_of_freedom: float
    """Its degrees of freedom."""
    band: tuple[float, float]
    """Where chi-square per degree of freedom lies with a probability of 99.9 %."""
    factor: float
    """The root of chi-square per degree of freedom: what sigmas are to be multiplied by."""
    passes: int
    """Linearisations."""


class Moved(Record):
    """An unknown that moves."""

    __slots__ = ()

    name: str
    """Its name."""
    sigmas: float
    """By how much, in standard deviations."""


class PositionFit(Record):
    """How well a position fits."""

    __slots__ = ()

    record: str
    """The record."""
    position: str
    """The position."""
    start_s: float
    """From when, in s of the record's timeline."""
    end_s: float
    """To when."""
    force_g: float | None
    """How long the specific force is there, in g, where the record has it: a median, which single samples do not move."""
    measurements: int
    """Measurements: components of Z of bins."""
    chi_square: float
    """Chi-square per degree of freedom."""
    degrees_of_freedom: float
    """The degrees of freedom."""
    moves: Moved | None
    """Without it: the unknown that moves most, in standard deviations of the move."""
    loses: list[str]
    """Without it these are not determined."""


class Warmth(Record):
    """How residuals go with the temperature, position by position."""

    __slots__ = ()

    correlation: float
    """The coefficient of correlation at the position where it is strongest."""
    probability: float
    """Probability that residuals that do not depend on it are correlated so, all positions together (R. A. Fisher, Metron 1, 1921)."""


class ChannelFit(Record):
    """How well a component of Z fits."""

    __slots__ = ()

    channel: str
    """`Z1`, `Z2`, `Z3` or `Za`."""
    unit: str
    """Unit of its sigmas."""
    sigma: float
    """Of a sample, as it was used."""
    scatter: float | None
    """Of a sample, by the scatter of the samples of a bin about a line; null where bins have too few."""
    chi_square: float
    """Chi-square per degree of freedom."""
    degrees_of_freedom: float
    """The degrees of freedom."""
    whiteness_probability: float | None
    """Smallest probability over the records that independent residuals are correlated as these are; null for few."""
    temperature: Warmth | None
    """How residuals go with the temperature, in the record where that is least likely by chance; null without one, and for few."""


class Outlier(Record):
    """A measurement that was left out."""

    __slots__ = ()

    record: str
    """The record."""
    lines: tuple[int, int]
    """Its lines, from and to."""
    t_s: float
    """When, in s of the record's timeline."""
    channel: str
    """The component of Z or, of a single cell, the column of the record."""
    sigmas: float
    """How far it is off, in standard deviations."""


class SecondPath(Record):
    """The filter against least squares, with one wide prior for both."""

    __slots__ = ()

    difference: float
    """The largest difference of the estimates at the end of a record, in sigma."""
    sigma_difference: float
    """The largest difference of sigmas there, as a part."""


class Repeatability(Record):
    """Several records, one platform."""

    __slots__ = ()

    chi_square: float
    """What the coefficients of the records differ by, as chi-square per degree of freedom."""
    degrees_of_freedom: float
    """The degrees of freedom."""
    band: tuple[float, float]
    """Where it lies with a probability of 99.9 %."""


class Gap(Record):
    """An interval without rows."""

    __slots__ = ()

    from_s: float
    """Time of the row before it, in s as it is in the record."""
    to_s: float
    """Time of the row after it, in s as it is in the record."""
    line: int
    """Line of the row after it."""
    place: str
    """Position that the rows before and after it were taken at, or the two positions."""


class EmptyCells(Record):
    """Empty cells of a column."""

    __slots__ = ()

    column: str
    """The column, as its header is written."""
    count: int
    """Number of its cells that are empty or NaN, in rows at positions."""

PositionsBy = Literal["labels", "timeline", "both", "static"]
"""What says where a sample was taken. labels: A column of labels: a position ends with its last sample, and the next begins when the
slew is over. timeline: The timeline of the scheme. both: A column of labels that agrees with the timeline of the scheme, which says
when a position begins and ends. static: Intervals at rest that were found, as many as the scheme has positions: turns are in the
middle of what is between them.
"""


class Clock(Record):
    """How right the clock of a record is."""

    __slots__ = ()

    offset_s: float | None
    """Time of the record, in s, at which the scheme begins; null where positions are held otherwise than in the scheme, so that rows
    alone say when each begins.
    """
    offset_sigma_s: float | None
    """Standard deviation of that time, in s; null where it was not estimated: the labels of the rows agree with it."""
    by_durations: float | None
    """By which part it is fast, where positions begin and end as in a scheme whose times are so many times as long: a clock, or a scheme
    that was run so.
    """
    by_earth: ClockByEarth | None
    """By which part it is fast by the rate of the earth when all unknowns follow; drifts are too small by the same part. Nothing where
    sigma would be above a third.
    """


class RecordReport(Record):
    """A record that was read."""

    __slots__ = ()

    name: str
    """Its name."""
    samples: int
    """Its samples."""
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
    """Samples at no position of the scheme."""
    bins: int
    """Bins."""
    span_s: tuple[float, float]
    """First and last time, in s as they are in the record."""
    positions_by: PositionsBy
    """What says where each sample was taken."""
    ignored: list[str]
    """Columns that nothing was made of."""
    force_g: float | None
    """The mean length of the specific force, in g, where the record has it."""
    gimbals_deg: float | None
    """How far the gimbals are from the attitudes of the scheme at most, in deg, where the record has their angles."""
    clock: Clock
    """Its clock."""


class Assumed(Record):
    """What was assumed."""

    __slots__ = ()

    latitude_deg: float
    """In deg."""
    latitude_by_default: bool
    """Whether the scheme names no latitude."""
    gravity_m_s2: float
    """What one g is."""
    bin_s: float
    """Samples within so many s are taken together."""
    accelerometer_noise_g: float
    """White noise of Z per sample and axis in g, as it was given."""
    noise_estimated: bool
    """Whether the noise was estimated from the records."""
    drift_noise_deg_sqrt_h: float
    """White drift."""
    gate: float
    """Probability that no measurement of a right record is left out."""
    known: list[str]
    """Names taken from a calibration before."""
    known_differs: list[str]
    """What is different in the scheme of that."""
    held: list[tuple[str, float, str]]
    """What nothing determines, unknown by unknown: the standard deviation within which it is held, in its unit."""
    by_default: list[str]
    """Keys of the conditions that nobody states, so that the program chose them: latitude_deg, accelerometer_noise_g, drift_noise."""
    seed: int
    """Seed of the exact verdicts."""


class Setup(Record):
    """What of a scheme says what its coefficients mean, and which records are of its runs."""

    __slots__ = ()

    terms: str
    """The terms, as in `--terms`."""
    geometry: Geometry
    """How gyros and accelerometers are mounted."""
    carry: Carry
    """What is carried between positions."""
    latitude_deg: float
    """In deg, by default that of the paper."""
    measured_azimuth: bool
    """Whether psi_y is measured."""
    positions: list[tuple[str, str]]
    """Names and Euler angles in deg of the positions."""


class Basis2(Record):
    """A record that estimates rest on."""

    __slots__ = ()

    record: str
    """What it was called."""
    digest: str
    """The digest of its numbers."""


class ResidualSeries(Record):
    """What is left of a component of a record, in the order of time."""

    __slots__ = ()

    record: str
    """The record."""
    channel: str
    """The component."""
    unit: str
    """The unit of residuals."""
    points: list[tuple[float, float, float]]
    """Time in s, residual and its sigma by the noise that was assumed: at most a thousand, evenly picked."""
    autocorrelation: list[float]
    """Their correlation with those one, two, ... measurements later."""
    count: int
    """How many there are."""
    allan: list[tuple[float, float, float]]
    """Cluster time in s, the overlapping Allan deviation of the residuals (IEEE Std 952-1997, C.1), and that of white ones of the
    assumed sigma; turns between positions take no time here.
    """


class Calibration(Shape):
    """A calibration from records."""

    schema: str
    """`obsdeg.calibration/1`."""
    version: str
    """Version of the program."""
    consistent: bool
    """Whether the model and its sigmas explain the records."""
    findings: list[Finding]
    """What speaks against that, the gravest first; empty when nothing does."""
    quantities: list[Estimated]
    """Every unknown, psi of the start of each record."""
    requirements: Requirements | None
    """Outcome of the requirements on coefficients by the sigmas of the estimates, rescaled where they are too small; null where none is
    stated. Those on psi are not judged: a calibration estimates psi of the start of a record.
    """
    combinations: list[Estimated]
    """Combinations of what is not told apart one by one, and those asked for."""
    covariance: CovarianceTable
    """Of all that has an estimate."""
    fit: Fit
    """The whole fit."""
    positions: list[PositionFit]
    """By record and position."""
    channels: list[ChannelFit]
    """By component of Z."""
    outliers: list[Outlier]
    """Measurements that were left out."""
    outlier_count: int
    """How many samples were left out in all."""
    second_path: SecondPath
    """The second path to the estimate."""
    repeatability: Repeatability | None
    """How far the coefficients of several records agree."""
    records: list[RecordReport]
    """What was read."""
    assumed: Assumed
    """What was assumed."""
    setup: Setup
    """What it is of."""
    rests_on: list[Basis2]
    """The records that it rests on, those of the calibration before too."""
    series: list[ResidualSeries]
    """What is left over time, by record and component."""


class SystemFindingInterrupted(Record):
    """Interrupted: the estimates are where the best iteration was then."""

    __slots__ = ()

    kind: Literal["interrupted"]


class SystemFindingNotSettled(Record):
    """No start settled."""

    __slots__ = ()

    kind: Literal["not_settled"]


class SystemFindingNoise(Record):
    """Chi-square is outside its band."""

    __slots__ = ()

    kind: Literal["noise"]
    chi_square: float
    """Per degree of freedom."""
    factor: float
    """What sigmas are to be multiplied by."""


class SystemFindingCorrelated(Record):
    """The residuals of an output are not independent of each other."""

    __slots__ = ()

    kind: Literal["correlated"]
    output: str
    """The output."""
    probability: float
    """Probability that independent ones are correlated so."""


class SystemFindingOutlier(Record):
    """A measurement is far off."""

    __slots__ = ()

    kind: Literal["outlier"]
    output: str
    """The output."""
    line: int
    """Its line in the record."""
    sigmas: float
    """By how much the others leave it off, in sigma as these have it (at least as it was given)."""

SystemFinding = Union[
    SystemFindingInterrupted,
    SystemFindingNotSettled,
    SystemFindingNoise,
    SystemFindingCorrelated,
    SystemFindingOutlier,
]
"""What speaks against model or noise."""


class SystemEstimated(Record):
    """An unknown or a combination."""

    __slots__ = ()

    name: str
    """Its name."""
    unit: str
    """Its unit, as the file says."""
    status: Status | None
    """The exact verdict; null for what is known."""
    degree: int | None
    """The degree."""
    determined: bool
    """Whether model and data determine it."""
    estimate: float | None
    """The estimate."""
    sigma: float | None
    """Its standard deviation by the noise."""
    sigma_rescaled: float | None
    """The same with errors of the data times the root of chi-square per degree of freedom, where that is above one; what was known
    before stays as it is.
    """


class OutputFit(Record):
    """How well an output fits."""

    __slots__ = ()

    output: str
    """The output."""
    measurements: int
    """Its measurements."""
    sigma: float | None
    """The noise of a measurement; null where every row has its own."""
    estimated: bool
    """Whether it was estimated from what is left."""
    chi_square: float
    """Chi-square per degree of freedom."""
    rms: float
    """Root of the mean square of what is left, in the unit of the output."""
    expected_rms: float
    """The same of what sigmas let expect."""
    degrees_of_freedom: float
    """Measurements minus what they determine."""
    outlier_gate: float | None
    """Further off than this, in sigma as the others have it, a measurement is named; null where too few others are left to say."""
    whiteness_probability: float | None
    """Probability that independent residuals are correlated as these are; null for few."""


class OtherSolution(Record):
    """Another solution."""

    __slots__ = ()

    chi_square: float
    """Its sum of squares."""
    starts: int
    """How many starts led there."""
    values: list[float]
    """Values of the unknowns, in their order."""


class Profile(Record):
    """What the data say of one unknown when all others follow."""

    __slots__ = ()

    name: str
    """The unknown."""
    points: list[tuple[float, float]]
    """Its values, and by how much the sum of squares is larger there than at the solution."""
    flat: bool
    """Whether it is flat: no value changes the sum of squares by more than a hundredth of one."""


class SystemCalibrationBasis(Record):
    """A record that estimates rest on."""

    __slots__ = ()

    record: str
    """What it was called."""
    digest: str
    """The digest of its numbers."""


class SystemCalibration(Shape):
    """A calibration of a system."""

    schema: str
    """`obsdeg.system-calibration/1`."""
    version: str
    """Version of the program."""
    name: str
    """The system."""
    consistent: bool | None
    """Whether model and noise explain the data; null where the noise was estimated from what is left, which then decides nothing."""
    findings: list[SystemFinding]
    """What speaks against it."""
    quantities: list[SystemEstimated]
    """States at the start of every experiment, parameters, and what is unknown of inputs."""
    combinations: list[SystemEstimated]
    """The combinations that the model asks for, and products and sums of what is not determined alone that it determines."""
    covariance: CovarianceTable
    """Of all unknowns that are determined."""
    chi_square: float
    """The sum of squares of all residuals, in sigma."""
    degrees_of_freedom: int
    """Measurements minus what they determine."""
    band: tuple[float, float]
    """Where chi-square per degree of freedom lies with a probability of 99.9 %."""
    factor: float
    """The root of chi-square per degree of freedom."""
    outputs: list[OutputFit]
    """By output."""
    others: list[OtherSolution]
    """Other solutions that fit nearly as well, the best first: the values of the unknowns."""
    starts: tuple[int, int]
    """Starts that were tried, and how many led to the solution."""
    starts_at_most: int
    """How many would have been tried at most: fewer are enough when no other solution is to be expected."""
    profiles: list[Profile]
    """Profiles that were asked for."""
    samples: int
    """Rows of the record."""
    intervals: int | None
    """Intervals at rest, where the file says how they are found."""
    begins: float | None
    """Time of the record at which the model starts, in its unit; null where that is 0. A record that begins more than 100 times its own
    length after 0 starts with its first row.
    """
    rows: int
    """Rows that the model is held against: those of the record, or the intervals and what is between them."""
    ignored: list[str]
    """Columns that nothing was made of."""
    model: str
    """The digest of the model."""
    rests_on: list[SystemCalibrationBasis]
    """The records that the estimates rest on, those of the calibration before too."""
    shared: bool
    """Whether the calibration before rests on the same record, by another model."""
    substeps: int
    """Steps of integration between two rows, at most."""
    seed: int
    """Seed of starts and verdicts."""

AuditFinding = Literal["agree", "conditional", "disagree", "not_covered"]
"""Whether the paper is right. agree: It holds as printed. conditional: It holds under a condition that the paper does not state; the
reason does. disagree: It does not. not_covered: It was not judged; the reason says why.
"""


class Line(Record):
    """One equation or claim."""

    __slots__ = ()

    place: str
    """Where in the paper, such as `(21)` or `conclusion 2`."""
    claim: str
    """What it says."""
    finding: AuditFinding
    """Whether it holds."""
    reason: str
    """Why: what was computed, for a slip the correction, and for what is not covered why it is not."""


class Audit(Shape):
    """The whole audit."""

    schema: str
    """`obsdeg.audit/1`."""
    seed: int
    """Seed of all random points and of the noise."""
    lines: list[Line]
    """The equations by number, then the claims in the order of the paper, then what is not covered."""

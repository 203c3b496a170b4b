"""Answers: attributes named as in the JSON, tables as data frames, pages for notebooks."""

from __future__ import annotations

import io
import json
import os
from collections.abc import Callable, Iterator
from html import escape
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from . import _obsdeg, _plots, shapes
from ._packages import check_package
from ._records import Record, fields, found, rows
from ._texts import Rounded

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from ._scheme import Scheme

#: Request that restores the engine's side of an answer after pickle: (command, request, records).
_Asked = tuple[str, str, list[tuple[str, bytes | None]] | None]


class Answer:
    """Answer of a command. The keys of its JSON are attributes; the JSON is parsed at the first access."""

    #: Path of the main table, a list of the JSON.
    _main = "quantities"

    def __init__(self, rust: _obsdeg.Answer | None, asked: _Asked | None, rounded: tuple[Rounded, ...] = ()) -> None:
        # same effect as setting attributes, but faster
        self.__dict__.update(_rust=rust, _asked=asked, _json=None, _data=None, _rounded=rounded)

    if TYPE_CHECKING:
        _rust: _obsdeg.Answer | None
        _asked: _Asked | None
        _json: str | None
        _data: Any
        _rounded: tuple[Rounded, ...]

    @staticmethod
    def from_json(text: str) -> Answer:
        """Answer from its JSON, as :meth:`json`, a file of ``-o`` or ``--format json`` contains it.

        It has attributes, names, iteration and its main table, and prints as a summary. Texts, pages and
        files come from the engine only and need a new call.

        Parameters
        ----------
        text : str
            JSON of an answer.

        Returns
        -------
        Answer
            Answer in the class of its layout, such as :class:`Analysis`.

        Raises
        ------
        ValueError
            The text is not JSON, or has no layout of this version.

        Examples
        --------
        >>> import obsdeg
        >>> answer = obsdeg.analyze([(0, 0, 0), (180, 0, 0)])
        >>> obsdeg.Answer.from_json(answer.json()) == answer
        True
        """
        if not isinstance(text, (str, bytes)):
            raise TypeError(f"text: found {text!r} of type {type(text).__name__}; expected the JSON of an answer")
        try:
            data = json.loads(text)
        except ValueError as error:
            raise ValueError(f"found a text that is no JSON ({error}); expected the JSON of an answer") from None
        if isinstance(data, list) and all(isinstance(one, dict) and one.keys() == {"file", "answer"} for one in data):
            kind: type[Answer] = Judgements
        else:
            layout = data.get("schema") if isinstance(data, dict) else None
            if layout not in KINDS:
                raise ValueError(f"found JSON with the layout {layout!r}; expected one of {', '.join(KINDS)}")
            kind = KINDS[layout]
        made = kind(None, None)
        made._json, made._data = text, data
        return made

    def _answer(self) -> _obsdeg.Answer:
        if self._rust is None:
            if self._asked is None:
                raise ValueError("found an answer that was read from JSON; expected one of the engine, which alone writes this: ask again")
            command, request, records = self._asked
            self._rust = _obsdeg.answer(command, request) if records is None else getattr(_obsdeg, command)(request, records)
        return self._rust

    @property
    def rounded(self) -> tuple[Rounded, ...]:
        """Computed angles and latitudes that were rounded before the verdict, with the given and the used
        numbers in degrees."""
        return self._rounded

    def _rounding(self) -> str:
        """Sentence on rounded numbers; empty if none was rounded."""
        if not self._rounded:
            return ""
        several = f" and {len(self._rounded) - 1} more" if len(self._rounded) > 1 else ""
        return f"Rounded before it was judged: {self._rounded[0]}{several}"

    def __setattr__(self, name: str, value: Any) -> None:
        if not name.startswith("_"):
            raise AttributeError(f"an answer does not change: found an assignment to `{name}`")
        object.__setattr__(self, name, value)

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"an answer does not change: found a deletion of `{name}`")

    @property
    def passed(self) -> bool:
        """True if the command line would exit with 0: no check disagrees, and the data are explained."""
        if self._asked is None and self._rust is None and isinstance(self._dict().get("passed"), bool):
            return bool(self._dict()["passed"])
        return self._answer().passed

    def json(self) -> str:
        """Output of ``obsdeg COMMAND --format json``, byte for byte."""
        if self._json is None:
            self._json = self._answer().written("json")
        return self._json

    def _dict(self) -> Any:
        """JSON as dicts and lists, which must not be changed."""
        if self._data is None:
            self._data = json.loads(self.json())
        return self._data

    def to_dict(self) -> Any:
        """Independent copy of the JSON as plain dicts and lists."""
        return json.loads(self.json())

    def text(self, format: str = "table") -> str:
        """Output of the command line: table, json, markdown, csv or latex. Tables and Markdown end with the
        computed numbers that were rounded, if there are any."""
        written = self._answer().written(format)
        return f"{written}\n{self._rounding()}\n" if self._rounded and format in ("table", "markdown") else written

    def csv(self, table: str | None = None) -> str:
        """List of the JSON as CSV, by default the main one."""
        return self._answer().table(table)

    def to_frame(self, table: str | None = None) -> pandas.DataFrame:
        """List of the JSON as a pandas DataFrame (with the dataframe interchange protocol, for polars and
        others).

        Raises:
            ProblemError: no such list; the message lists the available names.
        """
        check_package("pandas", "to_frame()", "obsdeg[frames]")
        import pandas

        if self._rust is None and self._asked is None:
            return pandas.DataFrame(rows(self._dict(), table or self._main))
        text = self.csv(table)
        return pandas.read_csv(io.StringIO(text)) if text.strip() else pandas.DataFrame()

    def files(self, *, pictures: bool = True) -> dict[str, bytes]:
        """Files that ``-o`` writes into a folder beside the JSON, by name.

        Parameters
        ----------
        pictures : bool
            True to draw the figures (SVG and PNG) and the page of a calibration too, which takes longer than
            most answers.

        Returns
        -------
        dict of str to bytes
            Series, found schemes and figures.

        Examples
        --------
        >>> import obsdeg
        >>> run = obsdeg.simulate([(0, 0, 0), (180, 0, 0)], carry="inertial")
        >>> sorted(run.files(pictures=False))
        ['series.csv', 'series.parquet']
        """
        return self._answer().files(pictures)

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            if name.startswith("_"):
                raise AttributeError(name)
            return found(type(self), self._dict(), name, "in this answer")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *fields(type(self))]

    def _is_read(self) -> bool:
        """True for an answer that was read from JSON, of which there are no texts."""
        return self._rust is None and self._asked is None

    def __str__(self) -> str:
        if self._is_read():
            return repr(self)
        return self.text("table")

    def __repr__(self) -> str:
        rounded = f"; {self._rounding()}" if self._rounded else ""
        return f"<{type(self).__name__}: {self._summary()}{rounded}>"

    def _summary(self) -> str:
        return str(self._dict()["schema"])

    def _repr_html_(self) -> str:
        if self._is_read():
            return f"<p>{escape(repr(self))}</p>"
        page = self._answer().fragment()
        if self._rounded:
            page += f"<p>{escape(self._rounding())}</p>"
        return page + (self._figure() or "")

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, Any]:
        bundle: dict[str, Any] = {"text/plain": str(self), "text/html": self._repr_html_()}
        return {kind: data for kind, data in bundle.items() if (not include or kind in include) and (not exclude or kind not in exclude)}

    def _figure(self) -> str | None:
        """Picture below the answer in a notebook, as HTML or SVG."""
        return None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Answer) and self.json() == other.json()

    def __hash__(self) -> int:
        return hash(self.json())

    def __getstate__(self) -> tuple[_Asked | None, str, tuple[Rounded, ...]]:
        return self._asked, self.json(), self._rounded

    def __setstate__(self, state: tuple[_Asked | None, str, tuple[Rounded, ...]]) -> None:
        self._rust, self._data = None, None
        self._asked, self._json, self._rounded = state


def _drawn(of: Answer, *names: str) -> str | None:
    files = of.files()
    for name in names:
        if name in files:
            return files[name].decode("utf-8")
    return None


class Drawn(Answer):
    """An answer with a picture."""

    def plot(self, *, figure: Figure | SubFigure | None = None) -> list[Axes]:
        """Draws the answer with matplotlib.

        Parameters
        ----------
        figure : matplotlib Figure or SubFigure, optional
            Figure to draw in; by default a new figure of pyplot.

        Returns
        -------
        list of matplotlib Axes
            The panels, to which titles and lines can be added; ``axes[0].figure.savefig("answer.png")``
            writes the picture.

        Raises
        ------
        ImportError
            matplotlib is not installed (``pip install 'obsdeg[plots]'``).

        Examples
        --------
        >>> import obsdeg
        >>> pair = [(0, 0, 0), (180, 0, 0)]
        >>> axes = obsdeg.compare(pair, [*pair, "DNE"], carry="inertial").plot()
        >>> axes[0].get_xlabel()
        'predicted sigma [unit of the unknown]; without a mark: not observable'
        """
        return self._draw(_plots.figure_of(*self._size()) if figure is None else figure)

    def _draw(self, figure: Figure | SubFigure) -> list[Axes]:
        raise NotImplementedError

    def _size(self) -> tuple[float, float]:
        """Width and height in inches."""
        return 7.0, _plots.height_of(len(self._dict().get("quantities", ())))

    def _figure(self) -> str | None:
        return _plots.picture(self._draw, *self._size())


class Run(Drawn):
    """A run of a filter, with estimates over time."""

    if TYPE_CHECKING:

        @property
        def names(self) -> list[str]: ...

    def series(self) -> pandas.DataFrame:
        """Truth, estimate and sigma over time, one column each, with units."""
        if "_series" not in self.__dict__:
            check_package("pandas", "series()", "obsdeg[frames]")
            import pandas

            self._series = pandas.read_csv(io.BytesIO(self.files(pictures=False)["series.csv"]))
        found: pandas.DataFrame = self._series
        return found.copy()

    def plot(self, *names: str, figure: Figure | SubFigure | None = None) -> list[Axes]:
        """Draws the run with matplotlib: sigmas of all unknowns, or histories of selected ones.

        Parameters
        ----------
        *names : str
            Unknowns whose truth, estimate and sigma are drawn over time, one panel each. Without names:
            sigmas of all unknowns at the start and at the end, with predicted and required sigmas.
        figure : matplotlib Figure or SubFigure, optional
            Figure to draw in; by default a new figure of pyplot.

        Returns
        -------
        list of matplotlib Axes
            The panels.

        Raises
        ------
        ImportError
            matplotlib is not installed (``pip install 'obsdeg[plots]'``).
        KeyError
            No such unknown.

        Examples
        --------
        >>> import obsdeg
        >>> run = obsdeg.simulate([(0, 0, 0), (180, 0, 0)], carry="inertial")
        >>> len(run.plot())
        1
        """
        for name in names:
            if name not in self.names:
                raise KeyError(f"there is no unknown {name!r} in this run; there are {', '.join(self.names)}")
        size = (7.0, 1.0 + 1.7 * len(names)) if names else self._size()
        canvas = _plots.figure_of(*size) if figure is None else figure
        return _plots.histories(self, names, canvas) if names else self._draw(canvas)  # type: ignore[arg-type]

    def _draw(self, figure: Figure | SubFigure) -> list[Axes]:
        return _plots.simulation(self, figure)  # type: ignore[arg-type]


_R = TypeVar("_R", bound=Record)


class Named(Generic[_R]):
    """An answer on unknowns: ``answer["D_FX"]`` is the entry of one, and iteration goes through all in order.
    """

    if TYPE_CHECKING:

        quantities: list[_R]

        def _dict(self) -> Any: ...

    @property
    def names(self) -> list[str]:
        """Names of the unknowns, in the order of the model."""
        return [q["name"] for q in self._dict()["quantities"]]

    def __getitem__(self, name: str) -> _R:
        if not isinstance(name, str):
            raise TypeError(f"found {name!r}; expected the name of an unknown, such as {self.names[0]!r}")
        for i, q in enumerate(self._dict()["quantities"]):
            if q["name"] == name:
                return self.quantities[i]
        raise KeyError(f"there is no unknown {name!r} in this answer; there are {', '.join(self.names)}")

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __iter__(self) -> Iterator[_R]:
        return iter(self.quantities)

    def __len__(self) -> int:
        return len(self._dict()["quantities"])


class Judgement(Answer):
    """Observable degree of every unknown of a scheme (:class:`Analysis`) or any system
    (:class:`SystemAnalysis`)."""

    if TYPE_CHECKING:
        rank: int

        def __getitem__(self, name: str) -> Any: ...

        def __iter__(self) -> Iterator[Any]: ...

        def __len__(self) -> int: ...

    @property
    def degrees(self) -> dict[str, int | None]:
        """Observable degree by unknown; None if it is not determined."""
        return {q["name"]: q["degree"] for q in self._dict()["quantities"]}

    @property
    def statuses(self) -> dict[str, shapes.Status]:
        """Status by unknown."""
        return {q["name"]: q["status"] for q in self._dict()["quantities"]}

    def _summary(self) -> str:
        of = self._dict()
        return f"{len(of['quantities'])} unknowns, rank {of['rank']}"


class Analysis(Named[shapes.Quantity], Judgement, shapes.Analysis):
    """Observable degree of every unknown of a scheme.

    Examples
    --------
    >>> import obsdeg
    >>> answer = obsdeg.analyze([(0, 0, 0), (180, 0, 0)])
    >>> answer["D_FX"].degree, answer["D_FX"].unit
    (1, 'deg/h')
    >>> [quantity.name for quantity in answer if quantity.degree == 2]
    ['D_FY', 'D_IY']
    """

    def _figure(self) -> str | None:
        return _drawn(self, "positions.svg")


class SystemAnalysis(Named[shapes.SystemQuantity], Judgement, shapes.SystemAnalysis):
    """Observable degree of every unknown of a model.

    Examples
    --------
    >>> import obsdeg
    >>> decay = obsdeg.Model(states={"x": "-k*x"}, outputs={"y": "x"})
    >>> answer = obsdeg.analyze(decay)
    >>> answer["k"].degree, answer["k"].identifiability
    (1, 'globally_identifiable')
    """


class Judgements(Answer):
    """Answers on several schemes and models, in order: a sequence of :class:`Judgement`.

    Examples
    --------
    >>> import obsdeg
    >>> pair = obsdeg.Scheme([(0, 0, 0), (180, 0, 0)], carry="inertial", latitude=28.2)
    >>> both = obsdeg.analyze(pair, pair.replace(carry="reset"))
    >>> [one.rank for one in both]
    [8, 10]
    """

    def __len__(self) -> int:
        return len(self._dict())

    def __getitem__(self, i: int) -> Judgement:
        one = self._dict()[i]
        part: _Asked | None = None
        if self._asked is not None:
            command, request, _ = self._asked
            asked = json.loads(request)
            # a single request only for what the common JSON does not contain
            part = (command, json.dumps({**asked, "sources": [asked["sources"][i]]}), None)
        of = f" of {one['file']}"
        rounded = tuple(r._replace(name=r.name.removesuffix(of)) for r in self._rounded if r.name.endswith(of))
        judgement = KINDS[one["answer"]["schema"]](None, part, rounded)
        if part is None:
            judgement._json = json.dumps(one["answer"])
        judgement._data = one["answer"]
        return judgement  # type: ignore[return-value]

    def __iter__(self) -> Iterator[Judgement]:
        return (self[i] for i in range(len(self)))

    @property
    def names(self) -> list[str]:
        """Names of the judged schemes and models."""
        return [one["file"] for one in self._dict()]

    def _summary(self) -> str:
        return f"{len(self)} judged"


class Comparison(Drawn, shapes.Comparison):
    """Schemes side by side: ``comparison["a.toml"]`` or ``comparison[0]`` is the entry of one; iteration goes
    through all.

    Examples
    --------
    >>> import obsdeg
    >>> pair = obsdeg.Scheme([(0, 0, 0), (180, 0, 0)], carry="inertial", latitude=28.2)
    >>> third = pair.replace(positions=[*pair, "DNE"], name="three")
    >>> [(one.name, one.rank) for one in obsdeg.compare(pair, third)]
    [('scheme', (8, 15)), ('three', (11, 15))]
    """

    _main = "schemes"

    def __getitem__(self, scheme: str | int) -> shapes.Review:
        if isinstance(scheme, int):
            return self.schemes[scheme]
        names = [one["name"] for one in self._dict()["schemes"]]
        if scheme not in names:
            raise KeyError(f"there is no scheme {scheme!r} in this comparison; there are {', '.join(names)}")
        return self.schemes[names.index(scheme)]

    def __iter__(self) -> Iterator[shapes.Review]:
        return iter(self.schemes)

    def __contains__(self, scheme: object) -> bool:
        return any(scheme == one["name"] for one in self._dict()["schemes"])

    def __len__(self) -> int:
        return len(self._dict()["schemes"])

    def _draw(self, figure: Figure | SubFigure) -> list[Axes]:
        return _plots.comparison(self, figure)

    def _size(self) -> tuple[float, float]:
        return 7.0, _plots.height_of(max((len(one["quantities"]) for one in self._dict()["schemes"]), default=1))


class Design(Drawn, shapes.Design):
    """Found schemes, the best first: ``design[0]`` is the best; iteration goes through all.

    Examples
    --------
    >>> import obsdeg
    >>> found = obsdeg.design(4, carry="inertial", observable="D_F")
    >>> found[0].positions
    ['NUE', 'UNW', 'NDW', 'DNE']
    >>> obsdeg.analyze(found.winner())["D_FX"].status
    'observable'
    """

    _main = "found"

    def __getitem__(self, place: int) -> shapes.Found:
        return self.found[place]

    def __iter__(self) -> Iterator[shapes.Found]:
        return iter(self.found)

    def __len__(self) -> int:
        return len(self._dict()["found"])

    def __bool__(self) -> bool:
        return True

    def winner(self) -> Scheme:
        """Best scheme of the search.

        Raises:
            LookupError: no scheme was found.
        """
        return _winner(self)

    def _figure(self) -> str | None:
        return _drawn(self, "front.svg", "positions.svg")

    def _draw(self, figure: Figure | SubFigure) -> list[Axes]:
        if not self._dict()["found"]:
            raise LookupError("no scheme was found")
        return _plots.design(self, figure)

    def _size(self) -> tuple[float, float]:
        return 9.0, _plots.height_of(min(20, len(self)))


class Walks(Answer, shapes.Walks):
    """Fewest positions of slew sequences on which torquer errors act (``design(minimum=True)`` with their
    terms)."""

    def winner(self) -> Scheme:
        """Scheme of the slew sequence.

        Raises:
            LookupError: no scheme was found.
        """
        return _winner(self)


def _winner(of: Answer) -> Scheme:
    from ._scheme import Scheme

    files = of.files(pictures=False)
    if "winner.toml" not in files:
        raise LookupError("no scheme was found")
    return Scheme.from_text(files["winner.toml"].decode("utf-8"), name="winner.toml")


class Sensors(Named[shapes.SensorUnknown], Answer, shapes.Sensors):
    """Sets of outputs of a model that make its unknowns observable, with proof.

    ``found["k1"]`` is the cheapest set for an unknown. ``found.front`` lists the sets from the cheapest to
    the set with the smallest degree.

    Examples
    --------
    >>> import obsdeg
    >>> chain = obsdeg.Model(states={"x1": "-k1*x1", "x2": "k1*x1-k2*x2"}, outputs={"y1": "x1", "y2": "x2"})
    >>> found = obsdeg.measure(chain)
    >>> found["k1"].cheapest.outputs, [one.outputs for one in found.front]
    (['x1'], [['x2'], ['x1', 'x2']])
    """

    _main = "front"


class NextPositions(Answer, shapes.NextPositions):
    """Extensions of a scheme by one or two positions, best first: ``found[0]`` is the best.

    Examples
    --------
    >>> import obsdeg
    >>> pair = obsdeg.Scheme([(0, 0, 0), (180, 0, 0)], carry="inertial", latitude=28.2)
    >>> [added.candidate for added in obsdeg.next_measurement(pair)[0].positions]
    ['SWD']
    """

    _main = "found"

    def __len__(self) -> int:
        return len(self._dict()["found"])

    def __getitem__(self, index: int) -> shapes.Extension:
        return self.found[index]


class Part(Answer, shapes.Part):
    """A part of a search, to be merged with the others by ``design(merge=...)``."""

    def _repr_html_(self) -> str:
        part = self._dict()
        return f"<p>part {part['part'][0]} of {part['part'][1]}, {'complete' if part['complete'] else 'interrupted'}</p>"


class Simulation(Named[shapes.Estimate], Run, shapes.Simulation):
    """A run of the filter on a scheme against a simulated truth.

    Examples
    --------
    >>> import obsdeg
    >>> pair = obsdeg.Scheme([(0, 0, 0), (180, 0, 0)], carry="inertial", latitude=28.2)
    >>> run = obsdeg.simulate(pair)
    >>> run["D_FX"].unit, run["D_FX"].sigma < run["D_FX"].prior_sigma
    ('deg/h', True)
    """

class SystemRun(Named[shapes.SystemEstimate], Run, shapes.SystemRun):
    """A run of the filter on a model against a simulated truth."""

class CrossCheck(Named[shapes.QuantityEvidence], Drawn, shapes.CrossCheck):
    """The exact verdicts on a scheme against a filter.

    Examples
    --------
    >>> import obsdeg
    >>> pair = obsdeg.Scheme([(0, 0, 0), (180, 0, 0)], carry="inertial", latitude=28.2)
    >>> obsdeg.crosscheck(pair).passed
    True
    """

    if TYPE_CHECKING:
        # attribute of both the answer and its JSON, with equal values
        passed: bool

    def _draw(self, figure: Figure | SubFigure) -> list[Axes]:
        return _plots.crosscheck(self, figure)

    def _size(self) -> tuple[float, float]:
        return 7.0, 4.5


class SystemEvidence(Named[shapes.SystemQuantityEvidence], Drawn, shapes.SystemEvidence):
    """The exact verdicts on a model against a filter and integrators."""

    if TYPE_CHECKING:
        passed: bool

    def _draw(self, figure: Figure | SubFigure) -> list[Axes]:
        return _plots.system_evidence(self, figure)


class Calibration(Named[shapes.Estimated], Drawn, shapes.Calibration):
    """Estimates of the unknowns that a scheme determines, from records.

    Examples
    --------
    >>> import obsdeg
    >>> pair = obsdeg.Scheme([(0, 0, 0), (180, 0, 0)], carry="inertial", latitude=28.2)
    >>> t = range(0, 4000, 100)
    >>> f = [(0, 1, 0) if s < 2000 else (0, -1, 0) for s in t]
    >>> fit = obsdeg.calibrate(pair, t=t, f=f, position=[1 if s < 2000 else 2 for s in t], noise=1e-5)
    >>> fit["D_FX"].unit, fit["D_FX"].determined, fit["D_IZ"].determined
    ('deg/h', True, False)
    """

    def covariance_frame(self) -> pandas.DataFrame:
        """Covariance matrix of the estimates."""
        return self.to_frame("covariance")

    def _draw(self, figure: Figure | SubFigure) -> list[Axes]:
        return _plots.calibration(self, figure)

    def _size(self) -> tuple[float, float]:
        return 7.0, 2.5 + _plots.height_of(len(self))


class Procedure(Answer, shapes.Procedure):
    """Sheet of a run: turns, waits and recordings in order of time.

    Examples
    --------
    >>> import obsdeg
    >>> pair = obsdeg.Scheme([(0, 0, 0), (180, 0, 0)], carry="inertial", latitude=28.2)
    >>> [step.kind for step in obsdeg.procedure(pair).steps]
    ['set', 'record', 'turn', 'record']
    """

    def controller(self) -> str:
        """Table for a controller, as the command line writes it to ``controller.csv`` or ``controller.txt``."""
        files = self.files(pictures=False)
        return next(text.decode() for name, text in files.items() if name.startswith("controller."))


class SensorNoise(Answer, shapes.SensorNoiseReport):
    """Noise of sensors at rest, by the Allan deviation of a record.

    Examples
    --------
    >>> import obsdeg
    >>> noise = obsdeg.allan("tests/data/static/imu.csv")
    >>> [column.column for column in noise.columns]
    ['wx [deg/h]', 'fx [g]']
    """


class SystemCalibration(Named[shapes.SystemEstimated], Drawn, shapes.SystemCalibration):
    """Estimates of the unknowns that a model determines, from records."""

    def covariance_frame(self) -> pandas.DataFrame:
        """Covariance matrix of the estimates."""
        return self.to_frame("covariance")

    def _draw(self, figure: Figure | SubFigure) -> list[Axes]:
        return _plots.system_calibration(self, figure)

    def _size(self) -> tuple[float, float]:
        return 7.0, 2.5 + _plots.height_of(len(self))


class Audit(Answer, shapes.Audit):
    """Equations and claims of the paper, checked against the algebra.

    Examples
    --------
    >>> import obsdeg
    >>> audit = obsdeg.paper()
    >>> audit.passed, len(audit.lines) > 0
    (True, True)
    """


#: Classes of answers by the schemas that they name.
KINDS: dict[str, type[Answer]] = {
    "obsdeg.analysis/1": Analysis,
    "obsdeg.system/1": SystemAnalysis,
    "obsdeg.comparison/2": Comparison,
    "obsdeg.design/2": Design,
    "obsdeg.walks/1": Walks,
    "obsdeg.next/1": NextPositions,
    "obsdeg.sensors/1": Sensors,
    "obsdeg.part/2": Part,
    "obsdeg.simulation/2": Simulation,
    "obsdeg.system-run/1": SystemRun,
    "obsdeg.crosscheck/1": CrossCheck,
    "obsdeg.system-evidence/1": SystemEvidence,
    "obsdeg.calibration/1": Calibration,
    "obsdeg.system-calibration/1": SystemCalibration,
    "obsdeg.procedure/1": Procedure,
    "obsdeg.allan/1": SensorNoise,
    "obsdeg.audit/1": Audit,
}


class Report(Answer):
    """Design review as a page."""

    @property
    def html(self) -> str:
        """HTML of the page."""
        return self.json()

    def to_dict(self) -> dict[str, str]:
        """The page alone: a report has no JSON."""
        return {"html": self.html}

    def write(self, path: Any) -> None:
        """Writes the page to a file with the extension ``.html``; an existing file is replaced.

        Raises:
            ValueError: another extension; ``obsdeg report`` writes PDF, Markdown and LaTeX.
        """
        if os.path.splitext(os.fspath(path))[1].lower() not in (".html", ".htm"):
            raise ValueError(f"found {os.fspath(path)!r}; expected a file that ends in .html (`obsdeg report` writes .pdf, .md and .tex)")
        with open(path, "w", encoding="utf-8", newline="") as file:
            file.write(self.html)

    def text(self, format: str = "table") -> str:
        """HTML of the page."""
        return self._answer().written(format)

    def _summary(self) -> str:
        return f"a page of {len(self.html)} characters"

    def __str__(self) -> str:
        return self._summary()

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{escape(self.html, quote=True)}" width="100%" height="600"></iframe>'


#: Called with the progress: current work, amount done, total amount (if known), number of examined sequences,
#: best value so far. Returning False ends the work.
Progress = Callable[[str, int, "int | None", "int | None", "float | None"], "bool | None"]

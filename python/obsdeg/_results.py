"""Answers: attributes as the JSON names them, tables as data frames, pages for notebooks."""

from __future__ import annotations

import io
import json
import os
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from . import _obsdeg, shapes
from ._records import fields, found

if TYPE_CHECKING:
    import pandas

    from ._files import Scheme

#: Asks again for an answer whose Rust side is gone, after pickle: (command, request, records).
_Asked = tuple[str, str, list[tuple[str, bytes | None]] | None]


class Answer:
    """What a command answers. Keys of its JSON are attributes; that is read when one is asked for."""

    def __init__(self, rust: _obsdeg.Answer | None, asked: _Asked) -> None:
        self._rust, self._asked = rust, asked
        self._json: str | None = None
        self._data: Any = None

    def _answer(self) -> _obsdeg.Answer:
        if self._rust is None:
            command, request, records = self._asked
            self._rust = _obsdeg.answer(command, request) if records is None else getattr(_obsdeg, command)(request, records)
        return self._rust

    @property
    def passed(self) -> bool:
        """Whether the command line would exit with 0: False where something disagrees or is not explained."""
        return self._answer().passed

    def json(self) -> str:
        """What ``obsdeg COMMAND --format json`` prints, byte for byte."""
        if self._json is None:
            self._json = self._answer().written("json")
        return self._json

    def to_dict(self) -> Any:
        """The JSON as plain dicts and lists."""
        if self._data is None:
            self._data = json.loads(self.json())
        return self._data

    def text(self, format: str = "table") -> str:
        """As the command line prints it: table, json, markdown, csv or latex."""
        return self._answer().written(format)

    def csv(self, table: str | None = None) -> str:
        """A list of the JSON as CSV, the main one where none is named."""
        return self._answer().table(table)

    def to_frame(self, table: str | None = None) -> pandas.DataFrame:
        """A list of the JSON as a pandas DataFrame (which has the dataframe interchange protocol, for polars and others).

        Raises:
            ProblemError: there is no such list; the error names those that there are.
        """
        import pandas

        text = self.csv(table)
        return pandas.read_csv(io.StringIO(text)) if text.strip() else pandas.DataFrame()

    def files(self) -> dict[str, bytes]:
        """What ``-o`` writes into a folder beside the JSON: figures (SVG, PNG), series, schemes that were found."""
        return self._answer().files()

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            if name.startswith("_"):
                raise AttributeError(name)
            return found(type(self), self.to_dict(), name, "in this answer")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *fields(type(self))]

    def __str__(self) -> str:
        return self.text("table")

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self._summary()}>"

    def _summary(self) -> str:
        return str(self.to_dict()["schema"])

    def _repr_html_(self) -> str:
        return self._answer().fragment()

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, Any]:
        bundle: dict[str, Any] = {"text/plain": str(self), "text/html": self._repr_html_()}
        figure = self._figure()
        if figure is not None:
            bundle["text/html"] += figure
        return {kind: data for kind, data in bundle.items() if (not include or kind in include) and (not exclude or kind not in exclude)}

    def _figure(self) -> str | None:
        """The picture that belongs below the answer in a notebook, as SVG."""
        return None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Answer) and self.json() == other.json()

    def __hash__(self) -> int:
        return hash(self.json())

    def __getstate__(self) -> tuple[_Asked, str]:
        return self._asked, self.json()

    def __setstate__(self, state: tuple[_Asked, str]) -> None:
        self._rust, self._data = None, None
        self._asked, self._json = state


def _drawn(of: Answer, *names: str) -> str | None:
    files = of.files()
    for name in names:
        if name in files:
            return files[name].decode("utf-8")
    return None


class Judgement(Answer):
    """The observable degree of every unknown, of a scheme (:class:`Analysis`) or any system (:class:`SystemAnalysis`)."""

    if TYPE_CHECKING:
        rank: int

    @property
    def degrees(self) -> dict[str, int | None]:
        """The observable degree by unknown; None where it is not determined."""
        return {q["name"]: q["degree"] for q in self.to_dict()["quantities"]}

    @property
    def statuses(self) -> dict[str, shapes.Status]:
        """The status by unknown."""
        return {q["name"]: q["status"] for q in self.to_dict()["quantities"]}

    def _summary(self) -> str:
        of = self.to_dict()
        return f"{len(of['quantities'])} unknowns, rank {of['rank']}"


class Analysis(Judgement, shapes.Analysis):
    """The observable degree of every unknown of a scheme."""


class SystemAnalysis(Judgement, shapes.SystemAnalysis):
    """The observable degree of every unknown of a model."""


class Judgements(Answer):
    """The answers on several schemes and models, in their order: a sequence of :class:`Judgement`."""

    def __len__(self) -> int:
        return len(self.to_dict())

    def __getitem__(self, i: int) -> Judgement:
        one = self.to_dict()[i]
        command, request, _ = self._asked
        asked = json.loads(request)
        # asked again only for what the JSON of all does not hold
        part = json.dumps({**asked, "sources": [asked["sources"][i]]})
        judgement = KINDS[one["answer"]["schema"]](None, (command, part, None))
        judgement._data = one["answer"]
        return judgement  # type: ignore[return-value]

    def __iter__(self) -> Iterator[Judgement]:
        return (self[i] for i in range(len(self)))

    @property
    def names(self) -> list[str]:
        """The names of what was judged."""
        return [one["name"] for one in self.to_dict()]

    def _summary(self) -> str:
        return f"{len(self)} judged"


class Comparison(Answer, shapes.Comparison):
    """Schemes side by side."""


class Design(Answer, shapes.Design):
    """Schemes that were found."""

    def winner(self) -> Scheme:
        """The best scheme that was found.

        Raises:
            LookupError: there is none.
        """
        return _winner(self)

    def _figure(self) -> str | None:
        return _drawn(self, "front.svg", "positions.svg")


class Walks(Answer, shapes.Walks):
    """The fewest positions where torquer errors make schemes walks (``design(minimum=True)`` with their terms)."""

    def winner(self) -> Scheme:
        """The scheme that was found.

        Raises:
            LookupError: there is none.
        """
        return _winner(self)


def _winner(of: Answer) -> Scheme:
    from ._files import Scheme

    files = of.files()
    if "winner.toml" not in files:
        raise LookupError("no scheme was found")
    return Scheme.from_text(files["winner.toml"].decode("utf-8"), name="winner.toml")


class Part(Answer, shapes.Part):
    """A part of a search, to be put together with the others by ``design(merge=...)``."""

    def _repr_html_(self) -> str:
        part = self.to_dict()
        return f"<p>part {part['part'][0]} of {part['part'][1]}, {'complete' if part['complete'] else 'interrupted'}</p>"


class Simulation(Answer, shapes.Simulation):
    """A run of the filter on a scheme against a simulated truth."""

    def series(self) -> pandas.DataFrame:
        """Truth, estimate and sigma over time."""
        return _series(self)


class SystemRun(Answer, shapes.SystemRun):
    """A run of the filter on a model against a simulated truth."""

    def series(self) -> pandas.DataFrame:
        """Truth, estimate and sigma over time."""
        return _series(self)


def _series(of: Answer) -> pandas.DataFrame:
    import pandas

    return pandas.read_csv(io.BytesIO(of.files()["series.csv"]))


class CrossCheck(Answer, shapes.CrossCheck):
    """The exact verdicts on a scheme against a filter."""

    if TYPE_CHECKING:
        # of the answer and of its JSON, which are the same
        passed: bool


class SystemEvidence(Answer, shapes.SystemEvidence):
    """The exact verdicts on a model against a filter and integrators."""

    if TYPE_CHECKING:
        passed: bool


class Calibration(Answer, shapes.Calibration):
    """What a scheme determines, estimated from records."""

    def covariance_frame(self) -> pandas.DataFrame:
        """The covariance matrix of the estimates."""
        return self.to_frame("covariance")


class SensorNoise(Answer, shapes.SensorNoiseReport):
    """Noise of sensors at rest, by the Allan deviation of a record."""


class SystemCalibration(Answer, shapes.SystemCalibration):
    """What a model determines, estimated from records."""

    def covariance_frame(self) -> pandas.DataFrame:
        """The covariance matrix of the estimates."""
        return self.to_frame("covariance")


class Audit(Answer, shapes.Audit):
    """The paper against the algebra."""


#: The answers by the schemas that they name.
KINDS: dict[str, type[Answer]] = {
    "obsdeg.analysis/1": Analysis,
    "obsdeg.system/1": SystemAnalysis,
    "obsdeg.comparison/2": Comparison,
    "obsdeg.design/2": Design,
    "obsdeg.walks/1": Walks,
    "obsdeg.part/2": Part,
    "obsdeg.simulation/2": Simulation,
    "obsdeg.system-run/1": SystemRun,
    "obsdeg.crosscheck/1": CrossCheck,
    "obsdeg.system-evidence/1": SystemEvidence,
    "obsdeg.calibration/1": Calibration,
    "obsdeg.system-calibration/1": SystemCalibration,
    "obsdeg.allan/1": SensorNoise,
    "obsdeg.audit/1": Audit,
}


class Report(Answer):
    """The design review as a page."""

    @property
    def html(self) -> str:
        """The page."""
        return self.json()

    def to_dict(self) -> dict[str, str]:
        """The page alone: a report has no JSON."""
        return {"html": self.html}

    def write(self, path: Any) -> None:
        """To a file that ends in ``.html``; one that is there is replaced.

        Raises:
            ValueError: another ending; PDF, Markdown and LaTeX are written by ``obsdeg report``.
        """
        if os.path.splitext(os.fspath(path))[1].lower() not in (".html", ".htm"):
            raise ValueError(f"found {os.fspath(path)!r}; expected a file that ends in .html (`obsdeg report` writes .pdf, .md and .tex)")
        with open(path, "w", encoding="utf-8", newline="") as file:
            file.write(self.html)

    def _summary(self) -> str:
        return f"a page of {len(self.html)} characters"

    def __str__(self) -> str:
        return self._summary()

    def _repr_html_(self) -> str:
        import html

        return f'<iframe srcdoc="{html.escape(self.html, quote=True)}" width="100%" height="600"></iframe>'


#: Hears how far an answer is: what is done, how much, of how much (if known), sequences examined, best so far; ends it by False.
Progress = Callable[[str, int, "int | None", "int | None", "float | None"], "bool | None"]

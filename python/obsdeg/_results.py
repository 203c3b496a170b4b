"""Answers: attributes as the JSON names them, tables as data frames, pages for notebooks."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from . import _obsdeg

#: Asks again for an answer whose Rust side is gone, after pickle: (command, request, records).
_Asked = tuple[str, str, list[tuple[str, bytes | None]] | None]


class Record(Mapping[str, Any]):
    """An object of the JSON: its keys are attributes."""

    __slots__ = ("_of",)

    def __init__(self, of: dict[str, Any]) -> None:
        self._of = of

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or name == "_of":
            raise AttributeError(name)
        try:
            return wrapped(self._of[name])
        except KeyError:
            raise AttributeError(f"there is no `{name}` here; there are {', '.join(self._of)}") from None

    def __getitem__(self, name: str) -> Any:
        return wrapped(self._of[name])

    def __iter__(self) -> Iterator[str]:
        return iter(self._of)

    def __len__(self) -> int:
        return len(self._of)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._of]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{k}={v!r}' for k, v in self._of.items())})"

    def to_dict(self) -> dict[str, Any]:
        """As plain dicts and lists."""
        return self._of

    def __getstate__(self) -> dict[str, Any]:
        return self._of

    def __setstate__(self, of: dict[str, Any]) -> None:
        self._of = of


def wrapped(value: Any) -> Any:
    """A value of the JSON, with its keys as attributes."""
    if isinstance(value, dict):
        return Record(value)
    if isinstance(value, list):
        return [wrapped(v) for v in value]
    return value


class Answer:
    """What a command answers. Keys of its JSON are attributes; that is read when one is asked for."""

    def __init__(self, rust: _obsdeg.Answer | None, asked: _Asked) -> None:
        self._rust, self._asked = rust, asked
        self._json: str | None = None
        self._data: Any = None

    def _answer(self) -> _obsdeg.Answer:
        if self._rust is None:
            command, request, records = self._asked
            self._rust = _obsdeg.answer(command, request) if records is None else _obsdeg.calibrate(request, records)
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

    def to_frame(self, table: str | None = None) -> Any:
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

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        data = self.to_dict()
        if not isinstance(data, dict) or name not in data:
            known = ", ".join(data) if isinstance(data, dict) else "none"
            raise AttributeError(f"there is no `{name}` in this answer; there are {known}")
        return wrapped(data[name])

    def __dir__(self) -> list[str]:
        data = self.to_dict()
        return [*super().__dir__(), *(data if isinstance(data, dict) else [])]

    def __str__(self) -> str:
        return self.text("table")

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self._summary()}>"

    def _summary(self) -> str:
        return str(self.to_dict().get("schema", self._asked[0])) if isinstance(self.to_dict(), dict) else self._asked[0]

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


class Analysis(Answer):
    """The observable degree of every unknown of a scheme."""

    def _summary(self) -> str:
        return f"{len(self.quantities)} unknowns, rank {self.to_dict()['rank']}"

    @property
    def degrees(self) -> dict[str, int | None]:
        """The observable degree by unknown; None where it is not determined."""
        return {q["name"]: q.get("degree") for q in self.to_dict()["quantities"]}

    @property
    def statuses(self) -> dict[str, str]:
        """The status by unknown."""
        return {q["name"]: q["status"] for q in self.to_dict()["quantities"]}


class SystemAnalysis(Analysis):
    """The same of any system."""


class Comparison(Answer):
    """Schemes side by side."""


class Design(Answer):
    """Schemes that were found."""

    def winner(self) -> Any:
        """The best scheme that was found.

        Raises:
            LookupError: there is none.
        """
        from ._files import Scheme

        files = self.files()
        if "winner.toml" not in files:
            raise LookupError("no scheme was found")
        return Scheme.from_text(files["winner.toml"].decode("utf-8"), name="winner.toml")

    def _figure(self) -> str | None:
        return _drawn(self, "front.svg", "positions.svg")


class Part(Answer):
    """A part of a search, to be put together with the others by ``design(merge=...)``."""

    def _repr_html_(self) -> str:
        part = self.to_dict()
        return f"<p>part {part['part'][0]} of {part['part'][1]}, {'complete' if part['complete'] else 'interrupted'}</p>"


class Simulation(Answer):
    """A run of the filter against a simulated truth."""

    def series(self) -> Any:
        """Truth, estimate and sigma over time as a pandas DataFrame."""
        import pandas

        return pandas.read_csv(io.BytesIO(self.files()["series.csv"]))


class CrossCheck(Answer):
    """The exact verdicts against a filter."""


class Calibration(Answer):
    """What a scheme or model determines, estimated from records."""

    def covariance(self) -> Any:
        """The covariance matrix of the estimates as a pandas DataFrame."""
        return self.to_frame("covariance")


class Audit(Answer):
    """The paper against the algebra."""


class Report(Answer):
    """The design review as a page."""

    @property
    def html(self) -> str:
        """The page."""
        return self.json()

    def write(self, path: Any) -> None:
        """To a file."""
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

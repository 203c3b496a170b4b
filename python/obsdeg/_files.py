"""Texts with names: what schemes and models are, and what files hold."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol, Union

from . import _obsdeg, _toml
from ._texts import Rounded, as_json

if TYPE_CHECKING:
    from typing_extensions import Self

#: A file, or what is in one.
Path_ = Union[str, "os.PathLike[str]"]


def place(path: Path, text: bytes) -> None:
    """Writes a file whole or not at all."""
    import tempfile

    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise


#: Most characters of a text that is read: as many as bytes on the command line.
TEXT = 50_000_000


def read_text(path: str | os.PathLike[str], *, errors: str = "strict") -> str:
    """The text of a file, which may be a device or a pipe that has no end.

    Raises:
        ValueError: more than :data:`TEXT` characters.
    """
    with open(path, encoding="utf-8", errors=errors) as file:
        text = file.read(TEXT + 1)
    if len(text) > TEXT:
        raise ValueError(f"{os.fspath(path)}: found more than {TEXT} characters; expected a text of at most {TEXT}")
    return text


class Text:
    """A text with a name: what :class:`Scheme` and :class:`Model` are. It does not change once it is made.

    Attributes
    ----------
    text : str
        What a file holds.
    name : str
        What errors and reports call it.
    rounded : tuple of Rounded
        Computed angles that were rounded when it was made; see :class:`Scheme`.
    """

    kind = "any"
    __slots__ = ("_data", "name", "rounded", "text")

    text: str
    name: str
    rounded: tuple[Rounded, ...]
    _data: Any

    def __init__(self, text: str, *, name: str = "") -> None:
        self._set(text, name or f"{self.kind}.toml")

    def _set(self, text: str, name: str, rounded: tuple[Rounded, ...] = (), data: Any = None) -> None:
        for slot, value in (("text", text), ("name", name), ("rounded", rounded), ("_data", data)):
            object.__setattr__(self, slot, value)

    def __setattr__(self, name: str, value: Any) -> None:
        advice = "; `replace` makes a changed copy" if hasattr(self, "replace") else ""
        raise AttributeError(f"{type(self).__name__} does not change: found an assignment to `{name}`{advice}")

    __delattr__ = __setattr__  # type: ignore[assignment]

    @classmethod
    def read(cls, path: Path_) -> Self:
        """From a file (TOML; a model may be JSON)."""
        made: Self = cls._of(read_text(path), os.fspath(path))
        return made

    @classmethod
    def _of(cls, text: str, name: str, rounded: tuple[Rounded, ...] = ()) -> Any:
        made = cls.__new__(cls)
        made._set(text, name, rounded)
        return made

    def write(self, path: Path_) -> None:
        """To a file."""
        Path(path).write_text(self.text, encoding="utf-8")

    def check(self) -> Self:
        """Reads it as the engine does, without judging it.

        Returns
        -------
        Scheme or Model
            The same object.

        Raises
        ------
        ProblemError
            What is wrong with it, with its line and column.
        """
        try:
            # reads the text, then finds that a record without a time is none
            _obsdeg.calibrate(as_json({"sources": [self._source()]}), [("check", b"x\n1\n")])
        except _obsdeg.ProblemError as problem:
            # others are of records, or of schemes and models that have no numbers
            if problem.file is not None or problem.message.startswith(self.name):
                raise
        return self

    def _read(self) -> Mapping[str, Any]:
        """The keys of the text; numbers with a point are decimals."""
        if self._data is None:
            object.__setattr__(self, "_data", MappingProxyType(_parsed(self.text, self.name)))
        data: Mapping[str, Any] = self._data
        return data

    def _source(self) -> dict[str, str]:
        return {"name": self.name, "text": self.text, "must_be": self.kind}

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name!r}, {len(self.text.splitlines())} lines)"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Text) and (self.kind, self.text) == (other.kind, other.text)

    def __hash__(self) -> int:
        return hash((self.kind, self.text))

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: Any) -> Self:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self)._of, (self.text, self.name, self.rounded))


def _parsed(text: str, name: str) -> dict[str, Any]:
    """The keys of a text in TOML or JSON.

    Raises:
        ValueError: it is neither.
        ImportError: this Python reads no TOML.
    """
    try:
        if text.lstrip().startswith("{"):
            found: dict[str, Any] = json.loads(text, parse_float=Decimal)
            return found
        return _toml.loads(text, parse_float=Decimal)
    except ValueError as e:
        raise ValueError(f"{name}: found a text that is no TOML ({e}); expected a scheme or a model") from None


class Texted(Protocol):
    """What an importer gives: a model's text, and what it is called."""

    @property
    def name(self) -> str:
        """What it is called."""

    @property
    def text(self) -> str:
        """A scheme or model."""

"""Texts with names: schemes and models, and the contents of files."""

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

#: Path of a file, or its content.
Path_ = Union[str, "os.PathLike[str]"]


def place(path: Path, text: bytes) -> None:
    """Writes a file completely or not at all."""
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


#: Largest number of characters of a text, equal to the limit of bytes on the command line.
TEXT = 50_000_000


def read_text(path: str | os.PathLike[str], *, errors: str = "strict") -> str:
    """Text of a file, which may be a device or an endless pipe.

    Raises:
        ValueError: more than :data:`TEXT` characters.
    """
    with open(path, encoding="utf-8", errors=errors) as file:
        text = file.read(TEXT + 1)
    if len(text) > TEXT:
        raise ValueError(f"{os.fspath(path)}: found more than {TEXT} characters; expected a text of at most {TEXT}")
    return text


def file_name(name: str | None, kind: str) -> str:
    """Name of the text of a scheme or model, by which answers call it: that of its key `name`, if it has one."""
    return f"{' '.join(str(name or '').replace('/', '-').split()) or kind}.toml"


class Text:
    """A text with a name, the base of :class:`Scheme` and :class:`Model`. It is immutable.

    Attributes
    ----------
    text : str
        Content of a file.
    name : str
        Name in errors and reports.
    rounded : tuple of Rounded
        Computed angles that were rounded at construction; see :class:`Scheme`.
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

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"{type(self).__name__} does not change: found a deletion of `{name}`")

    @classmethod
    def read(cls, path: Path_) -> Self:
        """Reads a file (TOML; a model may be JSON)."""
        if not isinstance(path, (str, os.PathLike)):
            raise TypeError(f"path: found {path!r} of type {type(path).__name__}; expected the path of a file")
        made: Self = cls._of(read_text(path), os.fspath(path))
        return made

    @classmethod
    def _of(cls, text: str, name: str, rounded: tuple[Rounded, ...] = ()) -> Any:
        if not isinstance(text, str):
            raise TypeError(f"text: found {text!r} of type {type(text).__name__}; expected the text of a file")
        made = cls.__new__(cls)
        made._set(text, name, rounded)
        return made

    def write(self, path: Path_) -> None:
        """Writes the text to a file."""
        Path(path).write_text(self.text, encoding="utf-8")

    def check(self) -> Self:
        """Reads the text as the engine does, without judging it.

        Returns
        -------
        Scheme or Model
            The same object.

        Raises
        ------
        ProblemError
            Invalid text; the message gives line and column.
        """
        try:
            # the engine reads the text, and then rejects the record because it has no time
            _obsdeg.calibrate(as_json({"sources": [self._source()]}), [("check", b"x\n1\n")])
        except _obsdeg.ProblemError as problem:
            # other messages concern records, or schemes and models without numbers
            if "in discrete time; expected a model in continuous time" in problem.message:
                # it has no records
                _obsdeg.answer("analyze", as_json({"sources": [self._source()], "solutions": False, "order": 0}))
            elif problem.file is not None or problem.message.startswith(self.name):
                raise
        return self

    def _read(self) -> Mapping[str, Any]:
        """Keys of the text; numbers with a decimal point are decimals."""
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
    """Keys of a text in TOML or JSON.

    Raises:
        ValueError: the text is neither.
        ImportError: this Python has no reader of TOML.
    """
    try:
        if text.lstrip().startswith("{"):
            found: dict[str, Any] = json.loads(text, parse_float=Decimal)
            return found
        return _toml.loads(text, parse_float=Decimal)
    except ValueError as e:
        raise ValueError(f"{name}: found a text that is no TOML ({e}); expected a scheme or a model") from None


class Texted(Protocol):
    """Result of an importer: text of a model and its name."""

    @property
    def name(self) -> str:
        """Name of the model."""

    @property
    def text(self) -> str:
        """Text of the scheme or model."""

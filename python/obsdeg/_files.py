"""Schemes and models: texts with names."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Union

from ._texts import Attitude, Number, attitudes, decimal, toml

if TYPE_CHECKING:
    from typing_extensions import Self

#: A file, or what is in one.
Path_ = Union[str, "os.PathLike[str]"]


def place(path: Path, text: bytes) -> None:
    """Writes a file whole or not at all."""
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


#: Most characters of a text that is read.
TEXT = 10_000_000


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
    """A text with a name: what :class:`Scheme` and :class:`Model` are.

    Attributes:
        text: what a file holds.
        name: what errors and reports call it.
    """

    kind = "any"
    __slots__ = ("name", "text")

    def __init__(self, text: str, *, name: str = "") -> None:
        self.text = text
        self.name = name or f"{self.kind}.toml"

    @classmethod
    def read(cls, path: Path_) -> Self:
        """From a file (TOML; a model may be JSON)."""
        made: Self = cls._of(read_text(path), os.fspath(path))
        return made

    @classmethod
    def _of(cls, text: str, name: str) -> Any:
        made = cls.__new__(cls)
        made.text, made.name = text, name
        return made

    def write(self, path: Path_) -> None:
        """To a file."""
        Path(path).write_text(self.text, encoding="utf-8")

    def _source(self) -> dict[str, str]:
        return {"name": self.name, "text": self.text, "must_be": self.kind}

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name!r}, {len(self.text.splitlines())} lines)"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Text) and (self.kind, self.text) == (other.kind, other.text)

    def __hash__(self) -> int:
        return hash((self.kind, self.text))

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self)._of, (self.text, self.name))


class Scheme(Text):
    """A torquing scheme: positions, and how the platform gets from one to the next.

    Args:
        angles: a position each: three Euler angles in degrees, exact, or direction letters of X_p, Y_p, Z_p (``"NUE"``).
        name: what reports call it.
        carry: what is carried between positions: platform (default), inertial or reset.
        latitude: in degrees; generic where it is left out.
        keys: other keys of a scheme file, such as ``slew_rate_deg_s`` below ``simulation={...}``.
    """

    kind = "scheme"
    __slots__ = ()

    def __init__(
        self,
        angles: Iterable[Attitude],
        *,
        name: str = "",
        carry: str | None = None,
        latitude: Number | None = None,
        **keys: Any,
    ) -> None:
        head = {"name": name or None, "carry": carry, **keys}
        lines = [f"{key} = {toml(value)}" for key, value in head.items() if value is not None]
        if latitude is not None:
            lines.append(f"latitude_deg = {decimal(latitude)}")
        for text in attitudes(angles):
            lines.append("[[position]]")
            if "@" in text:
                raise ValueError(f"found {text!r}; expected an attitude (segments that turn are written in a scheme file)")
            parts = text.split(",")
            lines.append(f"attitude = {toml(text)}" if len(parts) == 1 else f"angles_deg = {_angles(parts)}")
        super().__init__("\n".join(lines) + "\n", name="scheme.toml")

    @classmethod
    def from_text(cls, text: str, *, name: str = "scheme.toml") -> Scheme:
        """From the text of a scheme file (TOML)."""
        made: Scheme = cls._of(text, name)
        return made


def _angles(parts: list[str]) -> str:
    return "[" + ", ".join(p if _is_number(p) else toml(p) for p in parts) + "]"


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return text.strip().lstrip("+-")[:1].isdigit()


class Model(Text):
    """Any system x' = f(x, u, p, t), z = h, as the text of a model file (TOML or JSON)."""

    kind = "model"
    __slots__ = ()

    @classmethod
    def from_text(cls, text: str, *, name: str = "model.toml") -> Model:
        """From the text of a model file (TOML or JSON)."""
        made: Model = cls._of(text, name)
        return made


class Texted(Protocol):
    """What an importer gives: a model's text, and what it is called."""

    @property
    def name(self) -> str:
        """What it is called."""

    @property
    def text(self) -> str:
        """A scheme or model."""


#: What is judged: a scheme, a model, or a file with one.
Judged = Union[Scheme, Model, Path_, Texted]


def source(what: Judged) -> dict[str, str]:
    """What a request has of a scheme, a model or a file."""
    if isinstance(what, Text):
        return what._source()
    if hasattr(what, "text") and hasattr(what, "name"):
        return {"name": str(what.name), "text": str(what.text)}
    name = os.fspath(what)
    return {"name": name, "text": read_text(name)}

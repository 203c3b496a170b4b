"""Errors of imports."""

from __future__ import annotations


class ImportProblem(ValueError):
    """Construct that a model of obsdeg does not support, and its place.

    Attributes:
        file: File, or name of the text.
        place: Line (``line 7``) or the element (``event_1``, ``the rule of k1``).
        construct: Construct that was found.
        expected: Supported alternatives.
        hint: Advice; empty if there is none.
    """

    def __init__(self, construct: str, expected: str, *, place: str = "", hint: str = "", file: str = "") -> None:
        self.file, self.place, self.construct = file, place, construct
        self.expected, self.hint = expected, hint
        super().__init__(construct)

    def located(self, *, file: str = "", place: str = "") -> ImportProblem:
        """The same problem with file and place filled in if they were unknown."""
        self.file, self.place = self.file or file, self.place or place
        return self

    def __str__(self) -> str:
        where = ": ".join(part for part in (self.file, self.place) if part)
        hint = f" ({self.hint})" if self.hint else ""
        return visible(f"{where + ': ' if where else ''}found {self.construct}; expected {self.expected}{hint}")

    def __reduce__(self) -> tuple[object, ...]:
        return (_again, (self.construct, self.expected, self.place, self.hint, self.file))


class OverLimit(ImportProblem):
    """Construct that would need too much work or memory."""


def _again(construct: str, expected: str, place: str, hint: str, file: str) -> ImportProblem:
    return ImportProblem(construct, expected, place=place, hint=hint, file=file)


def visible(text: str) -> str:
    """Text with escapes for unprintable characters, so that a quoted file cannot control a terminal."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)

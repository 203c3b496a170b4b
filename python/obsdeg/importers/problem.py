"""Why something cannot be imported."""

from __future__ import annotations


class ImportProblem(ValueError):
    """A construct that has no counterpart in a model of obsdeg, and where it stands.

    Attributes:
        file: The file, or what the text was called.
        place: The line (``line 7``) or the element (``event_1``, ``the rule of k1``).
        construct: What was found.
        expected: What could stand there.
        hint: What may be done about it; empty when nothing is known.
    """

    def __init__(self, construct: str, expected: str, *, place: str = "", hint: str = "", file: str = "") -> None:
        self.file, self.place, self.construct = file, place, construct
        self.expected, self.hint = expected, hint
        super().__init__(construct)

    def located(self, *, file: str = "", place: str = "") -> ImportProblem:
        """The same problem, with file and place filled in where they were not known."""
        self.file, self.place = self.file or file, self.place or place
        return self

    def __str__(self) -> str:
        where = ": ".join(part for part in (self.file, self.place) if part)
        hint = f" ({self.hint})" if self.hint else ""
        return visible(f"{where + ': ' if where else ''}found {self.construct}; expected {self.expected}{hint}")

    def __reduce__(self) -> tuple[object, ...]:
        return (_again, (self.construct, self.expected, self.place, self.hint, self.file))


class OverLimit(ImportProblem):
    """A construct that would take too much work or memory."""


def _again(construct: str, expected: str, place: str, hint: str, file: str) -> ImportProblem:
    return ImportProblem(construct, expected, place=place, hint=hint, file=file)


def visible(text: str) -> str:
    """The text with an escape in place of every character that is not printed: a quoted file does not steer a terminal."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)

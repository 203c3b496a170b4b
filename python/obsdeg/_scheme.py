"""Torquing schemes: positions, and what is carried from one to the next."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from decimal import Decimal
from typing import TYPE_CHECKING, Any, Literal, Union, cast

from . import _obsdeg
from ._files import Text, file_name
from ._texts import DIGITS, Attitude, Number, Rounded, as_json, attitudes, changed, check_digits, exact, toml

if TYPE_CHECKING:
    from typing_extensions import Self

#: Carry of psi between positions.
Carry = Literal["platform", "inertial", "reset"]
CARRIES = ("platform", "inertial", "reset")
#: Position in a scheme: direction letters, three exact angles in degrees, or names of generic angles.
Position = Union[str, "tuple[Decimal | str, Decimal | str, Decimal | str]"]

_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)", re.ASCII)
_NAME = re.compile(r"[^\W\d]\w*")
_AXES = {"N": (1, 0, 0), "S": (-1, 0, 0), "U": (0, 1, 0), "D": (0, -1, 0), "E": (0, 0, 1), "W": (0, 0, -1)}


class Scheme(Text):
    """A torquing scheme: positions, and the slews of the platform between them.

    It is checked at construction and immutable; :meth:`replace` makes a changed copy.

    Parameters
    ----------
    positions : iterable of positions
        Positions: three Euler angles alpha, beta, gamma in degrees (`C_c^n = Mx My Mz`; a text names a
        generic angle), or the directions of X_p, Y_p, Z_p as letters (``"NUE"``).
    name : str
        Name of the scheme in reports, comparisons and tables.
    carry : {"platform", "inertial", "reset"}, optional
        Part of psi that is carried between positions; by default "platform".
    latitude : number, optional
        Latitude in degrees, -90 to 90; generic by default.
    digits : int or None
        Decimals, 0 to 9, to which computed angles and latitudes (float, `Decimal`, `Fraction`, rationals of
        SymPy) are rounded. ``rounded`` and every answer on the scheme list the rounded ones. With None
        nothing is rounded, and more than nine decimals are an error. An ``int`` and a text are always exact.
    angles : iterable of positions
        Alternative name of `positions`.
    **keys
        Other keys of a scheme file, such as ``simulation={"slew_rate_deg_s": 2}`` or ``terms=["F", "I"]``.

    Raises
    ------
    ValueError
        Invalid position, carry or latitude; a :class:`ProblemError` for other keys.
    TypeError
        A value of another type.

    Examples
    --------
    >>> import obsdeg
    >>> pair = obsdeg.Scheme([(0, 0, 0), (180, 0, 0)], carry="inertial")
    >>> len(pair), pair.carry, pair.angles
    (2, 'inertial', ((0.0, 0.0, 0.0), (180.0, 0.0, 0.0)))
    >>> third = pair.replace(positions=[*pair.positions, "NWU"], latitude=28.2)
    >>> third.positions[-1], third.angles[-1], third.latitude
    ('NWU', (90.0, 0.0, 0.0), Decimal('28.2'))
    >>> obsdeg.Scheme([(0, 0, 0), (0.1 + 0.2, 0, 0)]).rounded[0].taken
    '0.3'
    """

    kind = "scheme"
    __slots__ = ()

    def __init__(
        self,
        positions: Iterable[Attitude] | None = None,
        *,
        name: str = "",
        carry: str | None = None,
        latitude: Number | None = None,
        digits: int | None = DIGITS,
        angles: Iterable[Attitude] | None = None,
        **keys: Any,
    ) -> None:
        given = angles if positions is None else positions
        if given is None or (positions is not None and angles is not None):
            raise TypeError(f"found {'no' if given is None else 'both'} positions and angles; expected a list of positions")
        if "latitude_deg" in keys:
            if latitude is not None:
                raise TypeError("found latitude and latitude_deg; expected one of them")
            latitude = keys.pop("latitude_deg")
        if "position" in keys:
            raise TypeError("found position; expected positions, and replace() or a scheme file for other keys of a position")
        check_digits(digits)
        log: list[Rounded] = []
        data: dict[str, Any] = {"name": name or None, "carry": _carry(carry), **keys, "latitude_deg": _latitude(latitude, digits, log)}
        data = {key: value for key, value in data.items() if value is not None}
        data["position"] = [_table(text, i) for i, text in enumerate(attitudes(given, digits, log), 1)]
        self._make(data, tuple(log), bool(keys))

    def _make(self, data: dict[str, Any], rounded: tuple[Rounded, ...], check: bool) -> None:
        if not data["position"]:
            raise ValueError("positions: found none; expected at least one")
        lines = [f"{key} = {toml(value)}" for key, value in data.items() if key != "position"]
        for table in data["position"]:
            lines += ["[[position]]", *(f"{key} = {toml(value)}" for key, value in table.items())]
        self._set("\n".join(lines) + "\n", file_name(data.get("name"), "scheme"), rounded, None if check else data)
        if check:
            self.check()

    @classmethod
    def from_text(cls, text: str, *, name: str = "scheme.toml") -> Scheme:
        """Scheme from the text of a scheme file (TOML), which is read at its first use or by :meth:`check`.
        """
        made: Scheme = cls._of(text, name)
        return made

    def replace(self, *, positions: Iterable[Attitude] | None = None, digits: int | None = DIGITS, **changes: Any) -> Self:
        """Copy with other positions or other keys.

        Parameters
        ----------
        positions : iterable of positions, optional
            All positions of the copy, as for :class:`Scheme`. Names, dwells and slews of the scheme
            apply to the position of the copy at the same place.
        digits : int or None
            Same as for :class:`Scheme`.
        **changes
            ``carry``, ``latitude`` [deg], ``name``, and other keys of a scheme file; None removes a key.

        Raises
        ------
        ValueError
            Same as for :class:`Scheme`.

        Examples
        --------
        >>> import obsdeg
        >>> pair = obsdeg.Scheme(["NUE", "NDW"], carry="inertial")
        >>> [obsdeg.analyze(pair.replace(carry=c), solutions=False).rank for c in ("platform", "inertial", "reset")]
        [8, 8, 10]
        """
        check_digits(digits)
        log: list[Rounded] = []
        data = dict(self._read())
        if "carry" in changes:
            _carry(changes["carry"])
        if "latitude" in changes:
            changes["latitude_deg"] = _latitude(changes.pop("latitude"), digits, log)
        if "angles" in changes:
            positions = changes.pop("angles")
        if positions is not None:
            before: list[dict[str, Any]] = data.get("position", [])
            tables = [_table(text, i) for i, text in enumerate(attitudes(positions, digits, log), 1)]
            for table, old in zip(tables, before, strict=False):
                table.update({key: value for key, value in old.items() if key not in ("angles_deg", "attitude")})
            data["position"] = tables
        data.update(changes)
        data = {key: value for key, value in data.items() if value is not None}
        made = type(self).__new__(type(self))
        replaced = {"latitude": "latitude_deg" in changes}
        kept = [r for r in self.rounded if not replaced.get(r.name, positions is not None)]
        made._make(data, (*kept, *log), True)
        return made

    @property
    def positions(self) -> tuple[Position, ...]:
        """Positions in order of time: direction letters, or three exact angles in degrees."""
        return tuple(_position(table) for table in self._read().get("position", ()))

    @property
    def angles(self) -> tuple[tuple[float | str, float | str, float | str], ...]:
        """Euler angles alpha, beta, gamma of every position in degrees; the name of a generic angle is a
        text."""
        positions = self.positions
        of_letters = self._angles_of_letters() if any(isinstance(p, str) for p in positions) else {}
        found = [of_letters[p] if isinstance(p, str) else tuple(a if isinstance(a, str) else float(a) for a in p) for p in positions]
        return cast("tuple[tuple[float | str, float | str, float | str], ...]", tuple(found))

    def _angles_of_letters(self) -> dict[str, tuple[float, ...]]:
        letters = sorted({p for p in self.positions if isinstance(p, str)})
        asked = as_json({"angles": letters, "terms": "F", "solutions": False})
        import json

        found = json.loads(_obsdeg.answer("analyze", asked).written("json"))["positions"]
        return {p: tuple(map(float, of["angles_deg"])) for p, of in zip(letters, found, strict=True)}

    @property
    def carry(self) -> Carry:
        """Part of psi that is carried between positions."""
        return cast("Carry", self._read().get("carry", "platform"))

    @property
    def latitude(self) -> Decimal | None:
        """Latitude in degrees; None if generic."""
        found = self._read().get("latitude_deg")
        return None if found is None else Decimal(found)

    def __len__(self) -> int:
        return len(self._read().get("position", ()))

    def __iter__(self) -> Iterator[Position]:
        return iter(self.positions)

    def __bool__(self) -> bool:
        return True


def _carry(carry: str | None) -> str | None:
    if carry is not None and carry not in CARRIES:
        raise ValueError(f"carry: found {carry!r}; expected platform, inertial or reset")
    return carry


def _latitude(latitude: Number | None, digits: int | None, log: list[Rounded]) -> Decimal | None:
    if latitude is None:
        return None
    text = exact(latitude, digits)
    if not _NUMBER.fullmatch(text) or not -90 <= Decimal(text) <= 90:
        raise ValueError(f"latitude: found {latitude!r}; expected a number from -90 to 90 degrees")
    _decimals(text, "latitude")
    if changed(latitude, text):
        log.append(Rounded("latitude", str(latitude), text))
    return Decimal(text)


def _decimals(text: str, what: str) -> None:
    decimals = len(text.partition(".")[2])
    if decimals > DIGITS:
        raise ValueError(f"{what}: found {text} with {decimals} decimals; expected at most {DIGITS}, as digits={DIGITS} rounds a number")


def _table(text: str, place: int) -> dict[str, Any]:
    """Keys of a position in a scheme file."""
    if "@" in text:
        raise ValueError(f"found {text!r}; expected an attitude (segments that turn are written in a scheme file)")
    parts = [part.strip() for part in text.split(",")]
    if len(parts) == 1:
        axes = [_AXES.get(letter) for letter in parts[0]]
        if len(axes) != 3 or not _right_handed(axes):
            expected = "the directions of X_p, Y_p, Z_p out of N S U D E W, perpendicular and right-handed, as in NUE or NDW"
            raise ValueError(f"position {place}: found {text!r}; expected {expected}, or three angles")
        return {"attitude": parts[0]}
    if len(parts) != 3:
        raise ValueError(f"position {place}: found {len(parts)} angles in {text!r}; expected alpha, beta, gamma in degrees")
    return {"angles_deg": [_angle(part, place) for part in parts]}


def _angle(text: str, place: int) -> Decimal | str:
    if _NUMBER.fullmatch(text):
        _decimals(text, f"position {place}")
        return Decimal(text)
    if not _NAME.fullmatch(text):
        expected = "decimal degrees such as -90 or 12.5, or a name such as alpha"
        raise ValueError(f"position {place}: found the angle {text!r}; expected {expected}")
    return text


def _right_handed(axes: list[Any]) -> bool:
    if None in axes:
        return False
    (a, b, c), (d, e, f), (g, h, i) = axes
    return bool(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) == 1)


def _position(table: Mapping[str, Any]) -> Position:
    if "attitude" in table:
        return str(table["attitude"])
    angles = (a if isinstance(a, str) and not _NUMBER.fullmatch(a) else Decimal(a) for a in table.get("angles_deg", ()))
    return cast("Position", tuple(angles))

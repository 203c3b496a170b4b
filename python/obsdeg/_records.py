"""Objects of the JSON as objects of their types."""

from __future__ import annotations

import copy
import json
import keyword
import types
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Literal, Union, get_args, get_origin, get_type_hints

Read = Callable[[Any], Any]


class Record:
    """Object of the JSON: its keys are attributes (with ``_`` appended to keywords of Python: ``pass_``) and
    items.

    A key that the JSON omits is None, or an empty list.
    """

    __slots__ = ("_of",)

    if TYPE_CHECKING:
        _of: dict[str, Any]

    def __init__(self, of: dict[str, Any]) -> None:
        object.__setattr__(self, "_of", of)

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            if name.startswith("__") or name == "_of":
                raise AttributeError(name)
            return found(type(self), self._of, name, "here")

    def __getitem__(self, name: str) -> Any:
        return fields(type(self)).get(name, untyped)(self._of[name])

    def __contains__(self, name: object) -> bool:
        return name in self._of

    def __iter__(self) -> Iterator[str]:
        return iter(self._of)

    def __len__(self) -> int:
        return len(self._of)

    def keys(self) -> Any:
        """Names of the keys; ``dict(record)`` has all of them."""
        return self._of.keys()

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *fields(type(self)), *self._of]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{k}={v!r}' for k, v in self._of.items())})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Record) and self._of == other._of

    def __hash__(self) -> int:
        return hash(json.dumps(self._of, sort_keys=True))

    def to_dict(self) -> dict[str, Any]:
        """Independent copy as plain dicts and lists."""
        return copy.deepcopy(self._of)

    def __getstate__(self) -> dict[str, Any]:
        return self._of

    def __setstate__(self, of: dict[str, Any]) -> None:
        object.__setattr__(self, "_of", of)

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"an answer does not change: found an assignment to `{name}`")


class Shape:
    """JSON of an answer, with types of its attributes."""


def found(kind: type, of: Any, name: str, where: str) -> Any:
    """Attribute of an object.

    Raises:
        AttributeError: no such attribute; the message lists the available names.
    """
    known = fields(kind)
    key = _key(name)
    if isinstance(of, dict) and key in of:
        return known.get(key, untyped)(of[key])
    if key in known:
        return known[key](None)
    names = [*of, *(k for k in known if k not in of)] if isinstance(of, dict) else []
    raise AttributeError(f"there is no `{name}` {where}; there are {', '.join(names) or 'none'}")


def _key(name: str) -> str:
    return name[:-1] if name.endswith("_") and keyword.iskeyword(name[:-1]) else name


def rows(of: Any, table: str) -> list[dict[str, Any]]:
    """List of an answer as rows: nested objects have dotted names, lists of words are joined by semicolons.

    Raises:
        ValueError: no such list.
    """
    if not isinstance(of, dict) or not isinstance(of.get(table), list):
        lists = [key for key, value in of.items() if isinstance(value, list)] if isinstance(of, dict) else []
        raise ValueError(f"no list `{table}` in this answer; expected one of {', '.join(lists)}")
    return [_row(one, "") for one in of[table]]


def _row(of: dict[str, Any], above: str) -> dict[str, Any]:
    row: dict[str, Any] = {}
    for key, value in of.items():
        if isinstance(value, dict):
            row.update(_row(value, f"{above}{key}."))
        elif isinstance(value, list):
            if value and not any(isinstance(v, (dict, list)) for v in value):
                row[above + key] = "; ".join(map(str, value))
        else:
            row[above + key] = value
    return row


def untyped(value: Any) -> Any:
    """Value of an unknown type."""
    if isinstance(value, dict):
        return Record(value)
    return [untyped(v) for v in value] if isinstance(value, list) else value


_FIELDS: dict[type, dict[str, Read]] = {}


def fields(kind: type) -> dict[str, Read]:
    """Reader of each attribute of a class; a missing value is read from None."""
    if kind not in _FIELDS:
        hints = {_key(name): hint for name, hint in get_type_hints(kind).items() if not name.startswith("_")}
        _FIELDS[kind] = {name: _reader(hint) for name, hint in hints.items()}
    return _FIELDS[kind]


def _plain(value: Any) -> Any:
    # nested values of an answer must not change
    return copy.deepcopy(value) if isinstance(value, (dict, list)) else value


def _reader(hint: Any) -> Read:
    origin, inside = get_origin(hint), get_args(hint)
    if isinstance(hint, type) and issubclass(hint, Record):
        return hint
    if origin in (Union, types.UnionType):
        kinds = [k for k in inside if k is not type(None)]
        records = [k for k in kinds if isinstance(k, type) and issubclass(k, Record)]
        others = [r for r in (_reader(k) for k in kinds if k not in records) if r is not _plain]
        return _chosen(records, others[0] if others else _plain) if records or others else _plain
    if origin is list:
        one = _reader(inside[0])
        return (lambda value: [_plain(v) for v in value or ()]) if one is _plain else (lambda value: [one(v) for v in value or ()])
    if origin is tuple:
        each = [_reader(k) for k in inside]
        return lambda value: tuple(read(v) for read, v in zip(each, value, strict=True))
    if origin is dict:
        one = _reader(inside[1])
        return lambda value: {k: one(v) for k, v in value.items()}
    return _plain


def _chosen(records: list[type[Record]], other: Read) -> Read:
    """The type among several that fits a value: its constants match, and it has all keys."""

    def read(value: Any) -> Any:
        if value is None:
            return None
        if not isinstance(value, dict):
            return other(value)
        if len(records) == 1:
            return records[0](value)
        for kind in records:
            hints = get_type_hints(kind)
            constants = {k: get_args(h) for k, h in hints.items() if get_origin(h) is Literal and len(get_args(h)) == 1}
            if value.keys() <= fields(kind).keys() and all(value.get(k) in c for k, c in constants.items()):
                return kind(value)
        return Record(value)

    return read

"""Models: any system x' = f(x, u, p, t), z = h(x, u, p, t)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from ._files import Text, file_name
from ._texts import exact, toml

#: Name that is neither a function nor part of a number.
_NAME = re.compile(r"(?<![\w.])([^\W\d]\w*)(?!\w|\s*\()")
_GROUPS = ("parameters", "known_inputs", "unknown_inputs", "constants", "definitions")


class Model(Text):
    """Any system x' = f(x, u, p, t), z = h(x, u, p, t): states, unknown constants and outputs.

    A model made of parts is checked at construction. It is immutable; :meth:`replace` makes a changed copy.

    Parameters
    ----------
    text : str or system, optional
        Text of a model file (TOML or JSON), which is read at its first use or by :meth:`check`; or the result
        of an importer.
    name : str
        Name of the system in reports; of a text, what errors call it.
    states : mapping, or iterable of SymPy equations
        The derivative of every state by name, as a formula (``{"x": "-k*x"}``), an expression of SymPy, or
        the keys of a model file (``{"x": {"equation": "-k*x", "unit": "mg"}}``); or equations
        ``Eq(x(t).diff(t), -k*x(t))``.
    parameters : iterable of names or symbols, or mapping of names to units
        Unknown constants; by default all names without another meaning.
    outputs : mapping
        Measured quantities by name.
    starts : mapping, optional
        Exact known values at the start by state; ``"known"`` for a known but generic value. Other starts are
        unknown.
    known_inputs, unknown_inputs : iterable of names, or mapping, optional
        Functions of time. A mapping states their kinds as in a model file: ``{"u": "constant"}``.
    constants : mapping, optional
        Known constants: exact values, or None for a generic value.
    definitions : mapping, optional
        Names of subexpressions.
    **keys
        Other keys of a model file, such as ``simulation={"duration": 10, ...}`` or ``combinations=["a*b"]``.

    Raises
    ------
    ProblemError
        Invalid model, such as a name without a meaning.
    ImportProblem
        Unsupported expression of SymPy.

    Examples
    --------
    >>> import obsdeg
    >>> decay = obsdeg.Model(states={"x": "-a*b*x"}, parameters=["a", "b"], outputs={"y": "x"})
    >>> obsdeg.analyze(decay).statuses
    {'x': 'observable', 'a': 'inseparable', 'b': 'inseparable'}
    >>> import sympy
    >>> x, k = sympy.symbols("x k")
    >>> obsdeg.analyze(obsdeg.Model(states={x: -k * x}, outputs={"y": x**2}))["k"].degree
    1
    """

    kind = "model"
    __slots__ = ()

    def __init__(
        self,
        text: Any = None,
        *,
        name: str = "",
        states: Mapping[Any, Any] | Iterable[Any] | None = None,
        parameters: Iterable[Any] | Mapping[Any, Any] | None = None,
        outputs: Mapping[Any, Any] | None = None,
        starts: Mapping[Any, Any] | None = None,
        known_inputs: Iterable[Any] | Mapping[Any, Any] = (),
        unknown_inputs: Iterable[Any] | Mapping[Any, Any] = (),
        constants: Mapping[Any, Any] | None = None,
        definitions: Mapping[Any, Any] | None = None,
        **keys: Any,
    ) -> None:
        for part, found in (("outputs", outputs), ("starts", starts), ("constants", constants), ("definitions", definitions)):
            if found is not None and not isinstance(found, Mapping):
                raise TypeError(f"{part}: found {found!r} of type {type(found).__name__}; expected a dictionary, as in {part}={{'y': 'x'}}")
        if states is not None and (isinstance(states, str) or not isinstance(states, Iterable)):
            raise TypeError(f"states: found {states!r} of type {type(states).__name__}; expected a dictionary, or a list of equations of SymPy")
        parameters, known_inputs, unknown_inputs = _several(parameters), _several(known_inputs), _several(unknown_inputs)
        parts = dict(
            states=states,
            parameters=parameters,
            outputs=outputs,
            starts=starts,
            known_inputs=known_inputs,
            unknown_inputs=unknown_inputs,
            constants=constants,
            definitions=definitions,
        )
        given = [part for part, value in parts.items() if value is not None and value != ()] + list(keys)
        if text is not None:
            if given:
                raise TypeError(f"found a text and {given[0]}; expected one of them")
            self._set(_text_of(text), name or "model.toml")
            return
        if states is None and outputs is None:
            raise TypeError("found no states and no outputs; expected states={...} and outputs={...}, or the text of a model file")
        written = _of_sympy(name, parts, keys) if _has_sympy(parts) else _written(name, parts, keys)
        self._set(written, file_name(name, "model"))
        self.check()

    @classmethod
    def from_text(cls, text: str, *, name: str = "model.toml") -> Model:
        """Model from the text of a model file (TOML or JSON), which is read at its first use or by
        :meth:`check`."""
        made: Model = cls._of(text, name)
        return made

    def replace(self, **changes: Any) -> Model:
        """Copy with changed keys of its file.

        Parameters
        ----------
        **changes
            Keys of a model file. In the tables ``states``, ``outputs``, ``constants``, ``definitions`` and
            ``simulation`` only the given entries change, and None removes an entry. Other keys are replaced,
            and None removes a key. ``starts`` are known values of states at the start, as for
            :class:`Model`. Formulas are texts, numbers or expressions of SymPy.

        Raises
        ------
        ProblemError
            Invalid copy.

        Examples
        --------
        >>> import obsdeg
        >>> decay = obsdeg.Model(states={"x": "-a*b*x"}, parameters=["a", "b"], outputs={"y": "x"})
        >>> obsdeg.analyze(decay.replace(outputs={"z": "a"})).statuses
        {'x': 'observable', 'a': 'observable', 'b': 'observable'}
        """
        data = dict(self._read())
        if starts := changes.pop("starts", None):
            states = {**data.get("states", {}), **{str(k): _formula(v) if _is_sympy(v) else v for k, v in changes.pop("states", {}).items()}}
            for state, start in starts.items():
                if str(state) not in states:
                    raise ValueError(f"starts: found {str(state)!r}; expected a state: {', '.join(states)}")
                before = states[str(state)]
                states[str(state)] = {**(before if isinstance(before, Mapping) else {"equation": before}), "initial": _formula(start)}
            changes["states"] = states
        for key, value in changes.items():
            old = data.get(key)
            if isinstance(value, Mapping) and isinstance(old, Mapping):
                both = {**old, **{str(k): _formula(v) if _is_sympy(v) else v for k, v in value.items()}}
                data[key] = {k: v for k, v in both.items() if v is not None}
            else:
                data[key] = value
        made: Model = type(self)._of(_toml({k: v for k, v in data.items() if v is not None}), self.name)
        return made.check()

    @property
    def states(self) -> dict[str, str]:
        """Derivative of every state, as a formula."""
        return _formulas(self._read().get("states", {}), "equation")

    @property
    def outputs(self) -> dict[str, str]:
        """Every output, as a formula."""
        return _formulas(self._read().get("outputs", {}), "expression")

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the unknown constants."""
        return tuple(self._read().get("parameters") or ())


def _several(given: Any) -> Any:
    """Names as a collection, also if it is a single one."""
    return [given] if isinstance(given, str) or (given is not None and not isinstance(given, Iterable)) else given


def _formulas(table: Mapping[str, Any], key: str) -> dict[str, str]:
    return {name: str(of[key] if isinstance(of, Mapping) else of) for name, of in table.items()}


def _text_of(given: Any) -> str:
    if isinstance(given, str):
        return given
    if hasattr(given, "unknown_inputs") and hasattr(given, "states"):
        from .importers.system import to_toml

        return to_toml(given)
    if getattr(given, "kind", "model") == "model" and isinstance(getattr(given, "text", None), str):
        return str(given.text)
    raise TypeError(f"found {given!r} of type {type(given).__name__}; expected the text of a model file, or a system of the importers")


def _is_sympy(value: Any) -> bool:
    # classes of functions such as x(t) have no module
    return any((kind.__module__ or "").partition(".")[0] == "sympy" for kind in type(value).__mro__)


def _has_sympy(parts: Mapping[str, Any]) -> bool:
    """True if an expression or a name belongs to SymPy."""
    for part in parts.values():
        entries = [*part.keys(), *part.values()] if isinstance(part, Mapping) else part
        if entries is not None and not isinstance(entries, str) and any(map(_is_sympy, entries)):
            return True
    return False


def _of_sympy(name: str, parts: Mapping[str, Any], keys: Mapping[str, Any]) -> str:
    from .importers.problem import ImportProblem
    from .importers.sympy_system import system
    from .importers.system import to_toml

    given = {key: value for key, value in parts.items() if value is not None}
    if "algebraic" in keys:
        raise ImportProblem("algebraic equations beside expressions of SymPy", "all formulas as texts")
    if "definitions" in given:
        raise ImportProblem("definitions beside expressions of SymPy", "expressions with them put in")
    rates, outputs = given.pop("states", {}), given.pop("outputs", {})
    text = to_toml(system(rates, outputs, name=name or "model", **given))
    # top-level keys come before the first table
    values = {k: v for k, v in keys.items() if not isinstance(v, Mapping)}
    tables = {k: v for k, v in keys.items() if isinstance(v, Mapping)}
    return "".join(f"{k} = {_value(v)}\n" for k, v in values.items()) + text + _tables(tables)


def _written(name: str, parts: Mapping[str, Any], keys: Mapping[str, Any]) -> str:
    """Text of a model file with all formulas as texts."""
    starts = dict(parts["starts"] or {})
    states = {}
    for state, rate in dict(parts["states"] or {}).items():
        table = dict(rate) if isinstance(rate, Mapping) else {"equation": _formula(rate)}
        if state in starts:
            table["initial"] = _formula(starts.pop(state))
        states[state] = table if len(table) > 1 else table["equation"]
    if starts:
        raise ValueError(f"starts: found {next(iter(starts))!r}; expected a state: {', '.join(map(str, states)) or 'there are none'}")
    data: dict[str, Any] = {"name": name or "model", **keys, "states": states}
    for group in _GROUPS:
        if parts[group]:
            data[group] = _group(group, parts[group])
    data["outputs"] = {n: y if isinstance(y, Mapping) else _formula(y) for n, y in dict(parts["outputs"] or {}).items()}
    if parts["parameters"] is None and (others := _others(data)):
        data["parameters"] = others
    return _toml(data)


def _others(data: Mapping[str, Any]) -> list[str]:
    """Parameters: names in formulas without another meaning, in order of appearance."""
    formulas: list[str] = []
    for table in ("states", "algebraic", "definitions", "outputs", "constants"):
        for value in data.get(table, {}).values():
            entries = [value.get(key, "") for key in ("equation", "initial", "expression")] if isinstance(value, Mapping) else [value]
            formulas += [text for text in entries if isinstance(text, str) and text not in ("known", "generic")]
    groups = ("states", "algebraic", "known_inputs", "unknown_inputs", "constants", "definitions")
    known = {"t", "pi", "deg", *(str(name).partition("[")[0] for group in groups for name in data.get(group, ()))}
    names = (found[1] for text in formulas for found in _NAME.finditer(text))
    return [name for name in dict.fromkeys(names) if name not in known]


def _group(group: str, given: Any) -> Any:
    if group == "parameters":
        if isinstance(given, Mapping):
            return {n: u if isinstance(u, Mapping) else {"unit": str(u)} if u else {} for n, u in given.items()}
        return [given] if isinstance(given, str) else list(given)
    if not isinstance(given, Mapping):
        kind = "arbitrary" if group == "unknown_inputs" else "generic"
        return dict.fromkeys([given] if isinstance(given, str) else given, kind)
    if group.endswith("inputs"):
        return {n: {"polynomial": u} if isinstance(u, int) else u for n, u in given.items()}
    return {n: "generic" if v is None else v if isinstance(v, Mapping) else _formula(v) for n, v in given.items()}


def _formula(value: Any) -> str:
    """Formula as text; a number with all its digits, a fraction as a quotient."""
    if isinstance(value, str):
        return value
    parts = (getattr(value, "numerator", None), getattr(value, "denominator", 1))
    if isinstance(parts[0], int) and parts[1] != 1:
        return f"{parts[0]}/{parts[1]}"
    if _is_sympy(value) and not value.is_number:
        from .importers.formula import exactly, text_of

        return text_of(exactly(value))
    return exact(value, None)


def _toml(data: Mapping[str, Any]) -> str:
    """Text of a model file; tables come last, with one line per entry."""
    tables = {k: v for k, v in data.items() if isinstance(v, Mapping)}
    lists = {k: v for k, v in data.items() if isinstance(v, (list, tuple)) and v and all(isinstance(x, Mapping) for x in v)}
    head = [f"{_key(k)} = {_value(v)}" for k, v in data.items() if k not in tables and k not in lists]
    text = "\n".join(head) + "\n" + _tables(tables)
    for name, entries in lists.items():
        text += "".join(f"\n[[{_key(name)}]]\n" + "".join(f"{_key(k)} = {_value(v)}\n" for k, v in entry.items()) for entry in entries)
    return text


def _tables(tables: Mapping[str, Any]) -> str:
    lines = []
    for name, table in tables.items():
        lines += [f"\n[{_key(name)}]\n", *(f"{_key(str(k))} = {_value(v)}\n" for k, v in table.items())]
    return "".join(lines)


def _key(name: str) -> str:
    return name if name.isascii() and name.replace("_", "a").replace("-", "a").isalnum() else toml(name)


def _value(value: Any) -> str:
    """Value in TOML; keys of tables are quoted if necessary."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(str(k))} = {_value(v)}" for k, v in value.items()) + " }" if value else "{}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_value, value)) + "]"
    return toml(value)

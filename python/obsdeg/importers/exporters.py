"""Models of obsdeg as texts for others: `@ODEmodel` of StructuralIdentifiability.jl, and Python with SymPy.
"""

from __future__ import annotations

import json
import keyword
from collections.abc import Mapping
from typing import Any

import sympy  # type: ignore[import-untyped]

from .. import _toml
from .._files import Text
from .._scheme import Scheme
from .formula import TIME, Expr, exact, expand, parse, put, text_of
from .problem import ImportProblem
from .system import State, System

#: Names that the text for SymPy imports and uses.
_IMPORTED = ("Abs", "Rational", "acos", "asin", "atan", "atan2", "cos", "exp", "log", "pi", "sign", "sin", "sqrt", "symbols", "tan", "tanh")
_KEYS = ("name", "rates", "outputs", "starts", "parameters", "known_inputs", "unknown_inputs", "constants", "definitions")


def read_model(model: str | Text) -> System:
    """System of an obsdeg model, TOML or JSON, without vectors.

    Raises:
        ImportProblem: vectors and matrices, segments, or experiments with different values, which no export
            supports.
    """
    text = model.text if isinstance(model, Text) else model
    if not isinstance(text, str) or isinstance(model, Scheme):
        found = f"a {type(model).__name__}"
        raise TypeError(f"found {found}; expected a Model, the text of a model file, or a system of the importers")
    if text.lstrip().startswith("{"):
        return _json(text)
    try:
        file = _toml.loads(text)
    except ValueError as error:
        raise ImportProblem(f"`{error}`", "a model file") from None
    for key, words in (("experiment", "experiments with values of their own"), ("segment", "segments"), ("constraints", "constraints"), ("algebraic", "algebraic equations")):
        if file.get(key):
            raise ImportProblem(words, "one run from a free start", place=f"[{key}]")
    if file.get("experiments", 1) != 1:
        raise ImportProblem(f"{file['experiments']} experiments", "one", place="experiments")
    out = System(str(file.get("name", "model")), str(file.get("description", "")), discrete=bool(file.get("discrete", False)))

    def formula(value: Any, place: str) -> Expr:
        if isinstance(value, int | float):
            return exact(value if isinstance(value, float) else str(value))
        if not isinstance(value, str):
            raise ImportProblem("a vector", "a scalar formula", place=place)
        try:
            return parse(value).xreplace({sympy.Symbol("t"): TIME} if "t" not in file.get("states", {}) else {})
        except ImportProblem as problem:
            raise problem.located(place=place) from None

    def scalar(name: str) -> str:
        if "[" in name:
            raise ImportProblem(f"the vector `{name}`", "scalars", place=name)
        return name

    for name, value in file.get("states", {}).items():
        table = value if isinstance(value, dict) else {"equation": value}
        start = table.get("initial")
        begin = None if start in (None, "unknown") else start if start == "known" else formula(start, f"the start of {name}")
        rate = formula(table["equation"], f"the equation of {name}")
        out.states[scalar(name)] = State(rate, begin, table.get("unit", ""), table.get("description", ""))
    parameters = file.get("parameters", {})
    out.parameters = {scalar(n): "" if isinstance(parameters, list) else parameters[n].get("description", "") for n in parameters}
    for key, inputs in (("known_inputs", out.known_inputs), ("unknown_inputs", out.unknown_inputs)):
        for name, kind in file.get(key, {}).items():
            if isinstance(kind, dict) and "function" in kind:
                out.definitions[scalar(name)] = formula(kind["function"], name)
            else:
                inputs[scalar(name)] = kind["polynomial"] if isinstance(kind, dict) else kind
    for name, value in file.get("constants", {}).items():
        value = value.get("value", "generic") if isinstance(value, dict) else value
        out.constants[scalar(name)] = None if value == "generic" else formula(value, name)
    out.definitions |= {scalar(n): formula(e, n) for n, e in file.get("definitions", {}).items()}
    for name, value in file.get("outputs", {}).items():
        out.outputs[scalar(name)] = formula(value["expression"] if isinstance(value, dict) else value, f"the output {name}")
    return out


def _json(text: str) -> System:
    file = json.loads(text)
    for key in ("experiments", "segments", "input_assumption"):
        if file.get(key) not in (None, 1, [], {}):
            raise ImportProblem(key, "one run from a free start", place=key)
    out = System(file["name"], file.get("description", ""))
    values, known = file.get("known_initial_values", {}), file.get("known_initial_conditions", [])
    for name in file["states"]:
        start = parse(values[name]) if name in values else "known" if name in known else None
        out.states[name] = State(parse(file["equations"][name]), start)
    out.parameters = dict.fromkeys(file.get("params", []), "")
    out.known_inputs = dict.fromkeys(file.get("known_inputs", []), "generic")
    degree = file.get("unknown_input_max_derivative")
    out.unknown_inputs = dict.fromkeys(file.get("unknown_inputs", []), "arbitrary" if degree is None else degree)
    out.constants = dict.fromkeys(file.get("known_constants", []))
    out.outputs = {n: parse(y) for n, y in file["outputs"].items()}
    return out


def to_si_jl(model: str | Text | System, *, name: str = "ode") -> str:
    """Text of `@ODEmodel`, in discrete time of `@DDSmodel`, for StructuralIdentifiability.jl.

    Arguments:
        model: A `Model`, its text (TOML or JSON), or a system.
        name: Variable to which the model is assigned.

    Known constants with a generic value become outputs, since every constant is unknown there.

    Raises:
        ImportProblem: functions, the time, given starts, unknown inputs, segments or constraints, which the
            macro does not support.
    """
    if not isinstance(name, str) or not name.isidentifier():
        raise ValueError(f"name: found {name!r}; expected the name of a variable")
    system = model if isinstance(model, System) else read_model(model)
    _plain(system)
    if system.unknown_inputs:
        raise ImportProblem(f"the unknown input `{next(iter(system.unknown_inputs))}`", "known inputs")
    bounded = [n for n, kind in system.known_inputs.items() if kind != "generic"]
    if bounded:
        raise ImportProblem(f"the input `{bounded[0]}`, {system.known_inputs[bounded[0]]}", "generic inputs")
    numbers: dict[str, Expr] = {n: v for n, v in system.constants.items() if v is not None}
    table = {**system.definitions, **numbers}
    of_time = {n: f"{n}(t)" for n in [*system.states, *system.known_inputs]}

    def text(expression: Expr, place: str) -> str:
        found = expand(expression, table, place)
        if found.atoms(sympy.Function) or TIME in found.free_symbols or any(not p.exp.is_Integer for p in found.atoms(sympy.Pow)):
            raise ImportProblem(f"`{text_of(expression)}`", "a rational function without the time", place=place)
        swaps = {r: sympy.Symbol(f"{r.p}//{r.q}") for r in found.atoms(sympy.Rational) if r.q != 1}
        out = text_of(found.xreplace(swaps), of_time)
        for r in swaps.values():
            out = out.replace(r.name, f"({r.name})")
        return out

    taken = {*system.states, *system.known_inputs}
    lines, known = [], []
    for n, s in system.states.items():
        if s.start is not None and not isinstance(s.start, str):
            raise ImportProblem(f"the start of `{n}`", "unknown starts, or known ones of any value", place=f"the start of {n}")
        known += [n] if s.start == "known" else []
        left = f"{n}(t + 1)" if system.discrete else f"{n}'(t)"
        lines.append(f"    {left} = {text(s.rate, f'the equation of {n}')}")
    generic = [n for n, v in system.constants.items() if v is None and n in system.used()]
    for n, y in {**system.outputs, **{f"known_{c}": sympy.Symbol(c) for c in generic}}.items():
        label = n
        while label in taken:
            label += "_out"
        taken.add(label)
        lines.append(f"    {label}(t) = {text(y, f'the output {n}')}")
    # functions of SI.jl take known starts as an argument
    tail = f"known_ic = [{', '.join(known)}]\n" if known else ""
    return f"using StructuralIdentifiability\n\n{name} = @{'DDS' if system.discrete else 'ODE'}model(\n" + ",\n".join(lines) + "\n)\n" + tail


def to_sympy(model: str | Text | System) -> str:
    """Python text of the system for SymPy: `rates`, `outputs` and all else by name; `sympy_system.load` reads
    it.

    Raises:
        ImportProblem: discrete time, segments, constraints, or bounded inputs.
    """
    system = model if isinstance(model, System) else read_model(model)
    _plain(system)
    if system.discrete:
        raise ImportProblem("discrete time", "derivatives by time")
    system = _python_names(system)
    names = system.names()
    imports = f"from sympy import {', '.join(_IMPORTED)}"

    def text(expression: Expr) -> str:
        return (
            sympy.sstr(expression.xreplace({TIME: sympy.Symbol("t")}), full_prec=False)
            if not expression.is_Rational
            else _number(expression)
        )

    def table(values: Mapping[str, Expr | str | None]) -> str:
        parts = [f"    {n}: {json.dumps(v) if isinstance(v, str) else 'None' if v is None else text(v)},\n" for n, v in values.items()]
        return "{\n" + "".join(parts) + "}"

    def quoted(values: Mapping[str, Expr]) -> str:
        return "{\n" + "".join(f"    {json.dumps(n)}: {text(y)},\n" for n, y in values.items()) + "}"

    bounded = [n for n, kind in {**system.known_inputs, **system.unknown_inputs}.items() if kind not in ("generic", "arbitrary")]
    if bounded:
        raise ImportProblem(f"the input `{bounded[0]}` with a bound", "generic or arbitrary inputs")
    lines = [imports, ""]
    symbols = [*names, *(["t"] if "t" not in names else [])]
    lines.append(f"{', '.join(symbols)} = symbols({json.dumps(' '.join(symbols))})")
    lines.append(f"name = {json.dumps(system.name, ensure_ascii=False)}")
    lines.append(f"rates = {table({n: s.rate for n, s in system.states.items()})}")
    if any(s.start is not None for s in system.states.values()):
        lines.append(f"starts = {table({n: s.start for n, s in system.states.items() if s.start is not None})}")
    for key, group in (("parameters", system.parameters), ("known_inputs", system.known_inputs), ("unknown_inputs", system.unknown_inputs)):
        lines.append(f"{key} = [{', '.join(group)}]")
    constants = {n: v for n, v in system.constants.items() if not isinstance(v, tuple)}
    lines.append(f"constants = {table(constants)}")
    if system.definitions:
        lines.append(f"definitions = {table(system.definitions)}")
    lines.append(f"outputs = {quoted(system.outputs)}")
    return "\n".join(lines) + "\n"


def _python_names(system: System) -> System:
    """The system with names that Python accepts: `lambda` becomes `lambda_`."""
    taken = {*system.names(), *_IMPORTED, *_KEYS, "t"}
    new: dict[str, str] = {}
    for n in system.names():
        if keyword.iskeyword(n) or n in _IMPORTED or n in _KEYS:
            label = f"{n}_"
            while label in taken:
                label += "_"
            taken.add(label)
            new[n] = label
    if not new:
        return system
    swaps = {n: sympy.Symbol(label) for n, label in new.items()}

    def named(values: Mapping[str, Any]) -> dict[str, Any]:
        return {new.get(n, n): v if v is None or isinstance(v, str | int) else put(v, swaps) for n, v in values.items()}

    out = System(system.name, system.description, parameters=named(system.parameters), known_inputs=named(system.known_inputs))
    for n, s in system.states.items():
        start = s.start if s.start is None or isinstance(s.start, str) else put(s.start, swaps)
        out.states[new.get(n, n)] = State(put(s.rate, swaps), start, s.unit, s.description)
    out.unknown_inputs, out.constants = named(system.unknown_inputs), named(system.constants)
    out.definitions, out.outputs = named(system.definitions), {n: put(y, swaps) for n, y in system.outputs.items()}
    return out


def _number(value: Expr) -> str:
    return str(value.p) if value.q == 1 else f"Rational({value.p}, {value.q})"


def _plain(system: System) -> None:
    """Refuses constructs that neither text supports."""
    if system.experiments > 1 or system.segments > 1 or system.constraints:
        what = "constraints" if system.constraints else f"{system.experiments} experiments of {system.segments} segments"
        raise ImportProblem(what, "one run from a free start")
    if system.carry and any(system.carry):
        raise ImportProblem("jumps", "one run")

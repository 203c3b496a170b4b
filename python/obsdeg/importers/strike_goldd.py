"""Models of STRIKE-GOLDD: MATLAB scripts that give `x`, `p`, `h`, `f`, `u`, `w`, `ics` and `known_ics` and
save them.

The statements are parsed, not run: `syms`, assignments of formulas and of vectors, `save`. Symbols in none of
`x p u w` are known constants with generic values; numbers keep their values.
"""

from __future__ import annotations

import re
from pathlib import Path

import sympy  # type: ignore[import-untyped]

from .formula import Expr, expand, names_in, parse, put, symbol
from .limits import FORMULA, entries, hold_brackets, text_of_file
from .problem import ImportProblem, OverLimit
from .system import State, System

#: Formula, or entries of a vector.
Value = Expr | list[Expr]

_IGNORED = re.compile(r"^(clear|clc|close|clearvars|format|disp|fprintf|warning|addpath|cd|hold|tic|toc)\b")
_ASSIGN = re.compile(r"^([A-Za-z]\w*)\s*=(?!=)(.*)$", re.DOTALL)
_PLACE = re.compile(r"^([A-Za-z]\w*)\((\d+)\)\s*=(?!=)(.*)$", re.DOTALL)
_FILLED = re.compile(r"(?:sym\()?\s*(zeros|ones)\((\d+)\s*,\s*(\d+)\)\s*\)?")
_NUMBERED = re.compile(r"sym\(\s*'([A-Za-z]\w*)'\s*,\s*\[\s*(\d+)[\s,]+(\d+)\s*\]\s*\)")
_CHOSEN = re.compile(r"([A-Za-z]\w*)\(\s*\[([\d\s,]+)\]\s*\)")
_SAVE = re.compile(r"^save\b(.*)$", re.DOTALL)
_TRANSPOSE = re.compile(r"(\.'|'|\.\s*')\s*$")


def models(text: str) -> list[str]:
    """Names under which a script saves models, in order."""
    return [name for name, _ in _saved(text)]


def load(
    path: str | Path,
    *,
    model: str | int = 1,
    known_inputs: str | int = "generic",
    unknown_inputs: str | int = "arbitrary",
    starts: str = "unknown",
) -> System:
    """System of a script.

    Arguments:
        path: The file.
        model: Name or number (from 1) of one of the saved models.
        known_inputs: Kind of `u`: `generic`, or the degree of its polynomial in time (`nnzDerU` of the
            options).
        unknown_inputs: Kind of `w`: `arbitrary`, or the degree of its polynomial in time (`nnzDerW` of the
            options).
        starts: `unknown`, the default of STRIKE-GOLDD; `given`: the starts marked by `known_ics` are those of
            `ics`.

    Raises:
        ImportProblem: unsupported statement, or no model.
    """
    try:
        text = text_of_file(path, errors="replace")
        return read(text, model=model, known_inputs=known_inputs, unknown_inputs=unknown_inputs, starts=starts)
    except ImportProblem as problem:
        raise problem.located(file=str(path)) from None


def read(
    text: str,
    *,
    model: str | int = 1,
    known_inputs: str | int = "generic",
    unknown_inputs: str | int = "arbitrary",
    starts: str = "unknown",
) -> System:
    """System of a script's text; otherwise as `load`."""
    saved = _saved(text)
    names = [name for name, _ in saved]
    if isinstance(model, str):
        if model not in names:
            raise ImportProblem(f"no model `{model}`", "one of " + ", ".join(names))
        name, values = next(s for s in saved if s[0] == model)
    else:
        if not 1 <= model <= len(saved):
            raise ImportProblem(
                f"{len(saved)} models that are saved", f"at least {model}", hint="a script ends with save('name','x','p','h','f',...)"
            )
        name, values = saved[model - 1]

    def entries(key: str) -> list[Expr]:
        value = values.get(key, [])
        return value if isinstance(value, list) else [value]

    def symbols(key: str) -> list[str]:
        for e in entries(key):
            if not e.is_Symbol:
                raise ImportProblem(f"`{e}` in `{key}`", "symbols", place=f"the vector {key}")
        return [e.name for e in entries(key)]

    states, rates, outputs = symbols("x"), entries("f"), entries("h")
    if len(states) != len(rates):
        raise ImportProblem(f"{len(rates)} equations for {len(states)} states", "one for each", place="the vector f")
    if not outputs:
        raise ImportProblem("no output", "one", place="the vector h")
    system = System(name)
    given = entries("known_ics") if starts == "given" else []
    ics = entries("ics")
    for i, (state, rate) in enumerate(zip(states, rates, strict=True)):
        start = ics[i] if i < len(given) and given[i] == 1 and i < len(ics) else None
        system.states[state] = State(rate, start)
    fixed = {n: s.start for n, s in system.states.items() if s.start is not None and s.start != symbol(n)}
    for n, s in system.states.items():
        if s.start is not None:
            s.start = None if s.start == symbol(n) else expand(s.start, fixed, f"the start of {n}")
    # [u, w] and symbols of a state that is no state
    system.known_inputs = {n: known_inputs for n in symbols("u") if n not in states}
    system.unknown_inputs = {n: unknown_inputs for n in symbols("w")}
    system.parameters = {n: "" for n in symbols("p")}
    system.outputs = {f"y{i + 1}": y for i, y in enumerate(outputs)}
    while system.outputs.keys() & set(system.names()):
        system.outputs = {f"{n}_": y for n, y in system.outputs.items()}
    known = {*states, *system.parameters, *system.known_inputs, *system.unknown_inputs}
    formulas = [*rates, *outputs, *(s.start for s in system.states.values() if s.start is not None)]
    system.constants = {n: None for n in sorted(names_in(*formulas) - known)}
    if len(saved) > 1:
        others = [n for n in names if n != name]
        system.notes.append(f"model {name}; the script saves others: {', '.join(others[:8])}{', ...' if len(others) > 8 else ''}")
    return system


def _saved(text: str) -> list[tuple[str, dict[str, Value]]]:
    """Saves of a script: names, and the variables at that point."""
    values: dict[str, Value] = {}
    declared: set[str] = set()
    out: list[tuple[str, dict[str, Value]]] = []
    # functions of time: C(t) is C
    timed = re.compile(r"\b(" + "|".join(re.findall(r"([A-Za-z]\w*)\(t\)", text)) + r")\(t\)") if "(t)" in text else None
    for line, statement in _statements(text):
        statement = timed.sub(r"\1", statement) if timed else statement
        try:
            if _IGNORED.match(statement):
                if statement.startswith("clear") and len(statement.split()) <= 2:
                    values, declared = {}, set()
            elif statement.startswith("syms"):
                for word in re.split(r"[\s,]+", statement[4:].strip()):
                    values.pop(word, None)
                    declared.add(word)
            elif found := _SAVE.match(statement):
                name, *listed = re.findall(r"[\w.-]+", found.group(1)) or ["model"]
                saved = {n: v for n, v in values.items() if n in listed or not listed}
                # a symbol saved without an assignment: `syms u`
                own = {n: symbol(n) for n in listed if n in declared and n not in values}
                out.append((name, {**saved, **own}))
            elif found := _PLACE.match(statement):
                vector = values.get(found.group(1))
                if not isinstance(vector, list):
                    raise ImportProblem(f"`{found.group(1)}({found.group(2)})`", "an entry of a vector that was given before")
                _entry(vector, sympy.Integer(found.group(2)), found.group(1))
                changed = list(vector)
                changed[int(found.group(2)) - 1] = _value(found.group(3), values)
                values[found.group(1)] = changed
            elif found := _ASSIGN.match(statement):
                values[found.group(1)] = _value(found.group(2), values)
            else:
                raise ImportProblem(f"`{statement[:60]}`", "syms, assignments of formulas and vectors, save")
        except ImportProblem as problem:
            raise problem.located(place=f"line {line}") from None
    return out


def _value(text: str, values: dict[str, Value]) -> Value:
    text = text.strip()
    if len(text) > FORMULA:
        raise OverLimit(f"a statement of {len(text)} characters", f"at most {FORMULA}")
    hold_brackets(text)
    while _TRANSPOSE.search(text) and not text.startswith("'"):
        text = _TRANSPOSE.sub("", text).strip()
    if found := re.fullmatch(r"transpose\s*\((.*)\)", text, re.DOTALL):
        return _value(found.group(1), values)
    if re.fullmatch(r"'[^']*'|\"[^\"]*\"", text):
        return []
    if text.startswith("[") and _closes(text) == len(text) - 1:
        out: list[Expr] = []
        for part in _entries(text[1:-1]):
            value = _value(part, values)
            out += value if isinstance(value, list) else [value]
        return out
    if text in values:
        return values[text]
    if found := _FILLED.fullmatch(text):
        return [sympy.Integer(found.group(1) == "ones")] * entries(found.group(2), found.group(3))
    if found := _NUMBERED.fullmatch(text):
        return [symbol(f"{found.group(1)}{i + 1}") for i in range(entries(found.group(2), found.group(3)))]
    if (found := _CHOSEN.fullmatch(text)) and isinstance(vector := values.get(found.group(1)), list):
        return [_entry(vector, sympy.Integer(i), found.group(1)) for i in re.findall(r"\d+", found.group(2))]
    if "[" in text:
        raise ImportProblem(
            f"`{' '.join(text.split())[:60]}`", "a formula, or a vector alone", hint="write products of matrices as formulas"
        )
    plain = re.sub(r"\.([*/^])", r"\1", text)
    plain = re.sub(r"(?<=[\d.])[dD](?=[+-]?\d)", "e", plain)
    # v(2) is an entry
    vectors = {n: v for n, v in values.items() if isinstance(v, list)}
    calls = {n: (lambda index, v=v, n=n: _entry(v, index, n)) for n, v in vectors.items()}
    # an array of one entry equals that entry
    single = {n: v[0] for n, v in vectors.items() if len(v) == 1}
    expression = put(parse(plain, calls=calls), single)
    vectors = {n: v for n, v in vectors.items() if n not in single}
    if used := sorted(names_in(expression) & vectors.keys()):
        raise ImportProblem(f"the vector `{used[0]}` in a formula", "its entries")
    return put(expression, {n: v for n, v in values.items() if not isinstance(v, list)})


def _entry(vector: list[Expr], index: Expr, name: str) -> Expr:
    if not index.is_Integer or not 1 <= int(index) <= len(vector):
        raise ImportProblem(f"`{name}({index})`", f"an entry from 1 to {len(vector)}")
    return vector[int(index) - 1]


def _closes(text: str) -> int:
    depth = 0
    for i, c in enumerate(text):
        depth += {"[": 1, "(": 1, "]": -1, ")": -1}.get(c, 0)
        if depth == 0:
            return i
    return -1


def _entries(text: str) -> list[str]:
    """Entries of a vector, separated by `;`, `,`, line ends, and blanks between two entries."""
    out, depth, current = [], 0, ""
    for i, c in enumerate(text):
        depth += {"[": 1, "(": 1, "]": -1, ")": -1}.get(c, 0)
        if depth == 0 and c in ";,\n" or depth == 0 and c in " \t" and _apart(text[:i], text[i:]):
            out.append(current)
            current = ""
        else:
            current += c
    return [e.strip() for e in [*out, current] if e.strip()]


def _apart(before: str, after: str) -> bool:
    """True if a blank separates two entries: `a -b` does, `a - b` and `a* b` do not."""
    left, right = before.rstrip(" \t"), after.lstrip(" \t")
    if not left or not right or left[-1] in "+-*/^;,\n([" or right[0] in "*/^;,\n)]":
        return False
    if right.startswith((".*", "./", ".^", ".'")):
        return False
    return not (right[0] in "+-" and right[1:2] in (" ", "\t"))


def _statements(text: str) -> list[tuple[int, str]]:
    """Statements of a script with their lines, without comments and with continued lines joined."""
    out: list[tuple[int, str]] = []
    current, begin, depth = "", 0, 0

    def end() -> None:
        nonlocal current
        if current.strip():
            out.append((begin, current.strip()))
        current = ""

    block = False
    for number, raw in enumerate(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), 1):
        stripped = raw.strip()
        if stripped in ("%{", "%}"):
            block = stripped == "%{"
            continue
        line = "" if block else _code(raw)
        line, dots, _ = line.partition("...")
        for c in line:
            depth += {"[": 1, "(": 1, "]": -1, ")": -1}.get(c, 0)
            if not current.strip():
                current, begin = "", number
            if depth == 0 and c in ";" or depth == 0 and c == "," and not current.lstrip().startswith(("save", "syms")):
                end()
            else:
                current += c
        if dots:
            current += " "
        elif depth == 0:
            end()
        else:
            current += "\n"
    end()
    return out


def _code(line: str) -> str:
    """Line without its comment; `%` within quotes starts none."""
    quoted = False
    for i, c in enumerate(line):
        if c == "'" and (quoted or not re.search(r"[\w\])'.]$", line[:i])):
            quoted = not quoted
        elif c == "%" and not quoted:
            return line[:i]
    return line

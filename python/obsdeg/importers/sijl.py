"""Models of StructuralIdentifiability.jl: the text of its macros `@ODEmodel` and `@DDSmodel`.

`x'(t) = ...` declares a state, in discrete time `x(t + 1) = ...`, and `y(t) = ...` an output. Any other function
of the time is a known input, and every other name an unknown parameter.
"""

from __future__ import annotations

import re
from pathlib import Path

from .formula import Expr, names_in, parse, written_names
from .limits import EQUATIONS, text_of_file
from .problem import ImportProblem, OverLimit
from .system import State, System

_MACRO = re.compile(r"@(ODE|DDS)model\s*\(")
_LEFT = {
    "ODE": re.compile(r"\s*([^\W\d][\w!]*)\s*('?)\s*\(\s*t\s*\)\s*$"),
    "DDS": re.compile(r"\s*([^\W\d][\w!]*)\s*\(\s*t\s*(\+\s*1)?\s*\)\s*$"),
}
_EXPECTED = {"ODE": "x'(t) = ... or y(t) = ...", "DDS": "x(t + 1) = ... or y(t) = ..."}
_OF_TIME = re.compile(r"([^\W\d][\w!]*)\s*\(\s*t\s*\)")
_OTHER_TIME = re.compile(r"([^\W\d][\w!]*)\s*\([^()]*\)")
# numbers as Julia writes them: 1_000, 0x1F, 1f3
_GROUPED = re.compile(r"(?<![\w.!])\d+(?:_\d+)+")
_HEXADECIMAL = re.compile(r"(?<![\w.!])0x([0-9a-fA-F]+)\b")
_SINGLE = re.compile(r"(?<![\w.!])(\d+(?:\.\d*)?)f([+-]?\d+)\b")
#: Calls beside a model that change what is known.
_BESIDE = ("set_parameter_values", "known_ic")


def load(path: str | Path, *, model: int = 1) -> System:
    """System of the n-th `@ODEmodel` or `@DDSmodel` of a file.

    Raises:
        ImportProblem: not such a model.
    """
    try:
        return read(text_of_file(path), model=model, name=Path(path).stem)
    except ImportProblem as problem:
        raise problem.located(file=str(path)) from None


def read(text: str, *, model: int = 1, name: str = "model") -> System:
    """System of the n-th `@ODEmodel` or `@DDSmodel` of a text.

    Raises:
        ImportProblem: not such a model.
    """
    text = re.sub(r"#=.*?=#", lambda m: "\n" * m.group().count("\n"), text, flags=re.DOTALL)
    text = re.sub(r"#[^\n]*", "", text)
    macros = list(_MACRO.finditer(text))
    starts = [m.end() for m in macros]
    if not 1 <= model <= len(starts):
        raise ImportProblem(f"{len(starts)} `@ODEmodel(` or `@DDSmodel(`", f"at least {model} of them")
    kind = macros[model - 1].group(1)
    named = re.search(r"([^\W\d]\w*)\s*=\s*$", text[: text.rindex("@", 0, starts[model - 1])])
    system = System(named.group(1) if named else name, discrete=kind == "DDS")
    of_time: dict[str, str] = {}
    outputs: dict[str, tuple[str, str]] = {}
    rates: dict[str, tuple[str, str]] = {}
    equations = _equations(text, starts[model - 1])
    if len(equations) > EQUATIONS:
        raise OverLimit(f"{len(equations)} equations", f"at most {EQUATIONS}")
    for line, equation in equations:
        place = f"line {line}"
        left, equals, right = equation.partition("=")
        found = _LEFT[kind].match(left)
        if strange := re.search(r"[^\s\w!'()+*/^,.=-]+", equation):
            raise ImportProblem(f"the sign `{strange.group()}`", "names of letters, digits, _ and !", place=place)
        if not equals or not found:
            raise ImportProblem(f"`{' '.join(equation.split())}`", _EXPECTED[kind], place=place)
        label, state = found.groups()
        target = rates if state else outputs
        if label in rates or label in outputs:
            raise ImportProblem(f"a second equation of `{label}`", "one", place=place)
        target[label] = (right, place)
        of_time.update({m.group(1): place for m in _OF_TIME.finditer(right)})

    def formula(right: str, place: str) -> Expr:
        for m in _OTHER_TIME.finditer(_OF_TIME.sub(r"\1", right)):
            if m.group(1) in rates or m.group(1) in outputs or m.group(1) in of_time:
                raise ImportProblem(f"`{m.group()}`", f"values at the time t, {m.group(1)}(t)", place=place)
        try:
            expression = parse(_numbers(_OF_TIME.sub(r"\1", right)), julia=True)
        except ImportProblem as problem:
            raise problem.located(place=place) from None
        if "t" in names_in(expression):
            clock = "clock'(t) = 1" if kind == "ODE" else "clock(t + 1) = clock(t) + 1"
            raise ImportProblem("the time `t` by itself", "functions of it, as x(t)", place=place, hint=f"make it a state: {clock}")
        return expression

    for label, (right, place) in [*rates.items(), *outputs.items()]:
        expression = formula(right, place)
        if lost := sorted(names_in(expression) & outputs.keys()):
            raise ImportProblem(f"the output `{lost[0]}` in an equation", "states, inputs and parameters", place=place)
        if label in rates:
            system.states[label] = State(expression)
        else:
            system.outputs[label] = expression
    if not outputs:
        raise ImportProblem("no output", "y(t) = ...")
    system.known_inputs = {n: "generic" for n in of_time if n not in rates}
    # a parameter that cancels is one still, and not identifiable
    texts = [_numbers(_OF_TIME.sub("", right)) for right, _ in [*rates.values(), *outputs.values()]]
    order = [name for right in texts for name in written_names(right)]
    system.parameters = dict.fromkeys((n for n in order if n not in rates and n not in system.known_inputs), "")
    if called := [call for call in _BESIDE if re.search(rf"\b{call}\b", text)]:
        system.notes.append(f"{' and '.join(called)} beside the model are not read: values and starts are unknown")
    return system


def _numbers(text: str) -> str:
    """Text with decimal numbers for those that only Julia reads."""
    text = _GROUPED.sub(lambda m: m.group().replace("_", ""), text)
    return _SINGLE.sub(r"\1e\2", _HEXADECIMAL.sub(lambda m: str(int(m.group(1), 16)), text))


def _equations(text: str, start: int) -> list[tuple[int, str]]:
    """Equations between the brackets, with the numbers of their first lines."""
    depth, begin, out = 1, start, []
    for i in range(start, len(text)):
        depth += {"(": 1, "[": 1, ")": -1, "]": -1}.get(text[i], 0)
        if depth == 0 or (depth == 1 and text[i] == ","):
            equation = text[begin:i]
            if equation.strip():
                first = begin + len(equation) - len(equation.lstrip())
                out.append((text.count("\n", 0, first) + 1, equation))
            begin = i + 1
        if depth == 0:
            return out
    raise ImportProblem("the end of the text", "`)`", place=f"line {text.count(chr(10)) + 1}")

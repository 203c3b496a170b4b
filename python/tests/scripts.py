"""Reference models as texts in the syntax of other tools, for tests that read them back.

The formulas are those of the data, unchanged; only names are written in the syntax of the tool.
"""

from __future__ import annotations

import re
from typing import Any

Model = dict[str, Any]


def is_plain(model: Model) -> bool:
    """True for models with one run from a free start, which all tools can express."""
    special = ("experiments", "segments", "segment_constants", "known_initial_values", "known_initial_conditions", "input_assumption")
    return not any(model.get(key) for key in special)


#: Variables of a script, which no symbol may use as its name.
VARIABLES = ("x", "u", "w", "p", "h", "f", "h1", "ics", "known_ics")


def renamed(model: Model) -> Model:
    """Model with other names in place of a script's variables: `x` becomes `x0`."""

    def names(value: Any) -> Any:
        if isinstance(value, str):
            return re.sub(r"[A-Za-z_]\w*", lambda m: f"{m[0]}0" if m[0] in VARIABLES else m[0], value)
        if isinstance(value, list):
            return [names(v) for v in value]
        return {names(k): names(v) for k, v in value.items()} if isinstance(value, dict) else value

    keys = ("states", "params", "known_inputs", "unknown_inputs", "known_constants", "equations", "outputs", "expected", "min_order")
    return {k: names(v) if k in keys else v for k, v in model.items()}


def _close(formula: str) -> str:
    """Formula without blanks, which separate the entries of a vector: `[a +b]` has two."""
    return formula.replace(" ", "").replace("+", " + ")


def matlab(model: Model) -> str:
    """Script in the style of STRIKE-GOLDD: continued lines, comments, rows separated by blanks, commas and
    lines, transposes."""
    states, parameters, inputs = model["states"], model["params"], model["known_inputs"]
    unknown, constants = model.get("unknown_inputs", []), model.get("known_constants", [])
    names = [*states, *parameters, *inputs, *unknown, *constants]
    lines = [f"% {model['name']}: {model['source']}", "clear all;", "", "syms ..."]
    lines += ["    " + " ".join(names[i : i + 6]) + "..." for i in range(0, len(names), 6)] + [""]
    lines += [
        f"x = [{'; '.join(states)}];   % {len(states)} states",
        f"u = [{' '.join(inputs)}].';",
        f"w = [{', '.join(unknown)}];",
        "p = [" + ";...\n  ".join(parameters) + "];",
    ]
    lines += [
        "% dynamic equations [50% of them]:",
        "f = [" + ";   % a row\n     ".join(_close(model["equations"][s]) for s in states) + "];",
    ]
    outputs = [_close(y) for y in model["outputs"].values()]
    lines += [f"h1 = {outputs[0]};", f"h = [{', '.join(['h1', *outputs[1:]])}].';"]
    lines += ["ics = [];", f"known_ics = zeros(1,{len(states)});", f"save('{model['name']}','x','p','h','f','u','w','ics','known_ics');"]
    return "\n".join(lines) + "\n"


def julia(model: Model) -> str:
    """Text with `@ODEmodel`."""
    of_time = {*model["states"], *model["known_inputs"]}

    def text(formula: str) -> str:
        # decimals are written as rationals
        formula = re.sub(r"(?<![\w.])(\d+)\.(\d+)", lambda m: f"({int(m[1] + m[2])}//{10 ** len(m[2])})", formula)
        return re.sub(r"[A-Za-z_]\w*", lambda m: f"{m[0]}(t)" if m[0] in of_time else m[0], formula)

    lines = [f"    {s}'(t) = {text(model['equations'][s])}" for s in model["states"]]
    taken = set(model["states"])
    lines += [f"    {n if n not in taken else n + '_out'}(t) = {text(y)}" for n, y in model["outputs"].items()]
    return f"# {model['source']}\nusing StructuralIdentifiability\n\node = @ODEmodel(\n" + ", # next\n".join(lines) + "\n)\n"

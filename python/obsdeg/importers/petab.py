"""PEtab problems (version 1, by the `petab` library): conditions become experiments, observables outputs,
estimated parameters unknowns.

Measurements count as continuous in time: an observable measured in a condition is measured there at all
times. Scales of parameters and transformations of observables are one to one and change no verdict.
Parameters of the noise only are omitted: the mean of a measurement does not depend on them.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import sympy  # type: ignore[import-untyped]
import yaml
from petab import v1  # type: ignore[import-untyped]
from petab.v1.math import sympify_petab  # type: ignore[import-untyped]

from .copies import unrolled
from .formula import TIME, Expr, exact, exactly, expand, names_in, parse, put, symbol
from .generic import loosened
from .limits import TABLE, hold_brackets, hold_xml, text_of_file
from .problem import ImportProblem, OverLimit
from .roots import roots_as_unknowns
from .sbml import Kinetics, kinetics
from .steady import SteadyState
from .system import MAX_EXPERIMENTS, State, System, Table
from .timeline import Timeline

#: Values that a condition gives to entities, by name.
Overrides = dict[str, Expr]


@dataclass
class _Run:
    """Conditions with equal equations and starts, and their measurements.

    Attributes:
        before: Values in the steady state before the run; None without one.
        during: Values during the run.
        rests: True if nothing changes after the steady state: measurements are those of infinite time.
        measured: Lists of parameters of every observable.
        last: Time of the last measurement.
    """

    before: Overrides | None
    during: Overrides
    rests: bool = False
    measured: dict[str, list[tuple[Expr, ...]]] = field(default_factory=dict)
    last: float = 0.0


def load(path: str | Path, *, numbers: str = "exact", starts: str = "given", until_events: bool = False) -> System:
    """System of a PEtab problem (its YAML file).

    Arguments:
        path: The file.
        numbers: `exact`: fixed numbers keep their values; `generic`: non-zero numbers are known with generic
            values (`generic.loosened`).
        starts: `given`: starts of the problem; `unknown`: unknown starts, for which the verdict "observable"
            implies it for given ones too.
        until_events: Judges runs up to events that depend on states; otherwise such events are refused.

    Raises:
        ImportProblem: unsupported construct.
    """
    file = str(path)
    if numbers not in ("exact", "generic") or starts not in ("given", "unknown"):
        raise ImportProblem(f"numbers=`{numbers}`, starts=`{starts}`", "`exact` or `generic`, `given` or `unknown`", file=file)
    try:
        layout = _layout(file)
        for part in layout.get("problems", []):
            part.pop("visualization_files", None)  # not part of the mathematics
        _hold_files(layout, Path(file).parent)
        with warnings.catch_warnings():
            # warnings from dependencies of the library
            warnings.filterwarnings("ignore", module="petab")
            problem = v1.Problem.from_yaml(layout, base_path=str(Path(file).parent))
    except ImportProblem as found:
        raise found.located(file=file) from None
    except (ValueError, KeyError, OSError, TypeError, AttributeError, yaml.YAMLError) as error:
        raise ImportProblem(f"a problem that the petab library refuses: {error}", "PEtab of version 1", file=file) from error
    document = getattr(problem.model, "sbml_document", None)
    if document is None:
        raise ImportProblem("a model that is no SBML", "SBML", file=file)
    try:
        k = kinetics(document, file)
        out = _Problem(problem, k, Path(file).stem).system(starts, until_events)
        if numbers == "generic":
            out = loosened(out)
        return unrolled(out) if out.experiments > MAX_EXPERIMENTS else out
    except ImportProblem as found:
        raise found.located(file=file) from None


def _layout(file: str) -> Any:
    """Content of the YAML file."""
    text = text_of_file(file)
    hold_brackets(text)
    if any(isinstance(token, yaml.AliasToken) for token in yaml.scan(text)):
        # aliases that contain aliases grow without bound
        raise ImportProblem("an alias (`*name`)", "YAML without aliases")
    return yaml.safe_load(text)


def _hold_files(layout: Any, folder: Path) -> None:
    """Checks that the files of a problem are files, and not too long."""
    stack = [layout]
    while stack:
        found = stack.pop()
        if isinstance(found, dict):
            stack += found.values()
        elif isinstance(found, list):
            stack += found
        elif isinstance(found, str) and (path := folder / found).exists():
            if not path.is_file():
                raise ImportProblem(f"`{found}`, which is no file", "files")
            if path.stat().st_size > TABLE:
                raise OverLimit(f"`{found}` of {path.stat().st_size} bytes", f"at most {TABLE}")
            if path.suffix in (".xml", ".sbml"):
                hold_xml(path)


def _formula(text: Any) -> Expr:
    """A formula of PEtab."""
    try:
        # our own grammar counts before it works; PEtab's grammar is larger
        parse(str(text))
    except OverLimit:
        raise
    except ImportProblem:
        hold_brackets(str(text))
    return sympify_petab(text)


def _cell(value: Any) -> Expr | None:
    """Number or parameter name in a cell; None for an empty cell."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return None
    try:
        return exact(float(value)) if not isinstance(value, str) else exact(value)
    except ImportProblem:
        text = str(value).strip()
        if text.lower() in ("", "nan"):
            return None
        if not text.isidentifier():
            raise ImportProblem(f"`{text}`", "a number or the name of a parameter") from None
        return symbol(text)


class _Problem:
    def __init__(self, problem: Any, k: Kinetics, name: str) -> None:
        self.problem, self.k = problem, k
        self.out = System(name, k.name)
        table = problem.parameter_df
        self.estimated = [str(n) for n in table.index if int(float(table.loc[n, "estimate"])) == 1]
        fixed = [str(n) for n in table.index if str(n) not in self.estimated]
        self.fixed = {n: exact(float(table.loc[n, "nominalValue"])) for n in fixed}
        for n in [*self.estimated, *self.fixed]:
            k.values.pop(n, None)
            k.assigned.pop(n, None)
        self.observables, self.noise = self._observables()
        self.conditions: dict[str, Overrides] = {}
        self.runs = self._runs()
        self.steady: dict[Any, dict[str, Expr]] = {}
        self.switching: set[str] = set()

    def _observables(self) -> tuple[dict[str, Expr], set[str]]:
        table = self.problem.observable_df
        formulas: dict[str, Expr] = {}
        noise: set[str] = set()
        transformed: set[str] = set()
        for name in table.index:
            formulas[str(name)] = self._petab(_formula(table.loc[name, "observableFormula"]))
            noise |= names_in(exactly(_formula(table.loc[name, "noiseFormula"])))
            if "observableTransformation" in table and table.loc[name, "observableTransformation"] in ("log", "log10"):
                transformed.add(str(name))
        if transformed:
            self.out.notes.append("the logarithm of an output is written as the output: they determine the same, by as many derivatives")
        return formulas, noise

    def _petab(self, expression: Expr) -> Expr:
        known = {*self.k.rates, *self.k.values, *self.k.rules, *self.fixed, *self.estimated}
        found = exactly(expression)
        return found if "time" in known else found.xreplace({symbol("time"): TIME})

    def _condition(self, name: str) -> Overrides:
        if name not in self.conditions:
            self.conditions[name] = self._overrides(name)
        return self.conditions[name]

    def _overrides(self, name: str) -> Overrides:
        table = self.problem.condition_df
        if name not in table.index:
            raise ImportProblem(f"the condition `{name}`", "one of the condition table", place="the measurements")
        out: Overrides = {}
        known = {*self.k.rates, *self.k.values, *self.k.assigned}
        for column, cell in table.loc[name].items():
            if column == "conditionName":
                continue
            value = _cell(cell)
            if value is None:
                continue
            target = str(column)
            if target in known:
                out[target] = value
            else:
                what = "which a rule defines" if target in self.k.rules else "which the model does not have"
                raise ImportProblem(f"`{target}`, {what}", "a state or a constant of the model", place=f"condition {name}")
        return out

    def _runs(self) -> list[_Run]:
        runs: list[_Run] = []
        # by the names of their conditions, some of which may be the same
        named: dict[tuple[str | None, str, bool], _Run] = {}
        table = self.problem.measurement_df
        for row in table.to_dict("records"):
            before = _cell(row.get("preequilibrationConditionId"))
            rests = math.isinf(float(row["time"]))
            names = (None if before is None else str(before), str(row["simulationConditionId"]), rests)
            if names not in named:
                named[names] = self._run(names, runs)
            run = named[names]
            given = row.get("observableParameters")
            text = "" if given is None or (isinstance(given, float) and math.isnan(given)) else str(given)
            parameters = tuple(_cell(part) for part in text.split(";") if part)
            measured = run.measured.setdefault(str(row["observableId"]), [])
            if parameters not in measured:
                measured.append(parameters)
            self.noise |= {p for p in str(row.get("noiseParameters", "")).split(";") if p.isidentifier()}
            if not rests:
                run.last = max(run.last, float(row["time"]))
        return runs

    def _run(self, names: tuple[str | None, str, bool], runs: list[_Run]) -> _Run:
        """Run of conditions, one of `runs` if it has the same."""
        before, name, rests = names
        during = self._condition(name)
        first = None if before is None else self._condition(before)
        if rests and first is not None:
            raise ImportProblem("a steady state behind a steady state", "one of them", place="the measurements")
        first = during if rests else first
        run = next((r for r in runs if (r.before, r.during, r.rests) == (first, during, rests)), None)
        if run is None:
            runs.append(run := _Run(first, during, rests))
        return run

    def system(self, starts: str, until_events: bool) -> System:
        out, k, runs = self.out, self.k, self.runs
        overridden = list(dict.fromkeys(n for r in runs for n in r.during))
        constants = [n for n in overridden if n not in k.rates]
        assigned = self.assigned = dict(k.assigned)
        for n in constants:
            # unless a condition sets it
            k.assigned.pop(n, None)
        out.states = {n: State(rate) for n, rate in k.rates.items()}
        out.parameters = {n: "" for n in self.estimated}
        numbers = [{**k.values, **self.fixed, **{n: v for n, v in r.during.items() if n not in k.rates and v.is_Rational}} for r in runs]
        for mine, r in zip(numbers, runs, strict=True):
            mine.update({n: self.fixed[v.name] for n, v in r.during.items() if v.is_Symbol and v.name in self.fixed})
            for n, v in r.during.items():
                if n not in k.rates and v.is_Symbol and v.name not in self.fixed:
                    mine.pop(n, None)
        free = {n: e for n, e in assigned.items() if n not in constants}
        nominal = {n: exact(float(self.problem.parameter_df.loc[n, "nominalValue"])) for n in self.estimated}
        steps = Timeline(out, {**k.rules, **free}, numbers, [exact(r.last) for r in runs], k.events, nominal=nominal, until_events=until_events)
        out.constants = {n: v for n, v in {**k.values, **self.fixed}.items() if n not in constants}
        for n in constants:
            default = k.values.get(n, assigned.get(n))
            values = [r.during.get(n, default) for r in runs]
            if any(v is None for v in values):
                raise ImportProblem(f"no value of `{n}`", "one in the model or in every condition", place="the conditions")
            steps.taken.discard(n)
            value = steps.spread(values, n)
            if value == symbol(n):
                continue
            if value.is_Rational:
                out.constants[n] = value
            else:
                steps.definitions[n] = value
        if starts == "given":
            self._starts(steps)
        elif any(r.before is not None for r in runs):
            raise ImportProblem("a steady state before a run", "starts=`given`")
        self._outputs(steps)
        steps.finish()
        self.switching = steps.switching
        roots_as_unknowns(out)
        out.drop_unused()
        self._left_out(starts == "given")
        self._priors()
        return out

    def _starts(self, steps: Timeline) -> None:
        k, runs, out = self.k, self.runs, self.out
        for n in [n for n in k.rates if n not in k.starts and not all(n in r.during for r in runs)]:
            raise ImportProblem(f"no start of `{n}`", "one in the model or in every condition", place=f"species {n}")
        given = {n: [r.during.get(n, k.starts.get(n)) for r in runs] for n in k.rates}
        begin = {n: steps.spread(values, f"{n}_start") for n, values in given.items()}
        table = {**begin, **steps.definitions}
        # an initial assignment may name states: their starts are meant
        for n in list(k.assigned):
            if n in steps.definitions:
                steps.definitions[n] = steps.settled(k.at_start(steps.definitions[n], table, n), n)
        inline = {**steps.definitions, **begin}

        def start(expression: Expr, place: str) -> Expr:
            found = expand(k.at_start(expression, inline, place), steps.definitions, place)
            return steps.settled(found, place).xreplace({TIME: sympy.S.Zero})

        settled = {n: [start(v, f"the start of {n}") for v in values] for n, values in given.items()}
        for index, run in enumerate(runs):
            if run.before is None:
                continue
            steady = self._steady(run, start)
            for n in k.rates:
                if run.rests or n not in run.during:
                    settled[n][index] = steady[n]
        for n, values in settled.items():
            out.states[n].start = steps.spread(values, f"{n}_start")

    def _steady(self, run: _Run, start: Any) -> dict[str, Expr]:
        """Unknowns for the steady state before a run."""
        k, out = self.k, self.out
        assert run.before is not None
        assigned = {n: start(e, f"the initial assignment of {n}") for n, e in self.assigned.items()}
        values = {**assigned, **k.values, **self.fixed, **{n: v for n, v in run.before.items() if n not in k.rates}}
        begin = {n: start(run.before.get(n, k.starts.get(n)), f"the start of {n}") for n in k.rates}
        key = (tuple(sorted(values.items(), key=str)), tuple(begin.items()))
        if key not in self.steady:
            suffix = "_ss" if not self.steady else f"_ss{len(self.steady) + 1}"
            found = SteadyState(k, values, begin, suffix)
            self.steady[key] = found.start
            out.parameters.update({s.name: "at the steady state before" for s in found.start.values() if s.is_Symbol})
            out.constraints += found.constraints
            if len(self.steady) == 1:
                out.notes.append(
                    "a steady state is one of the solutions of its equations: unknowns that the constraints tie to the parameters"
                )
        return self.steady[key]

    def _outputs(self, steps: Timeline) -> None:
        runs = self.runs
        for name, formula in self.observables.items():
            lists = [r.measured.get(name, []) for r in runs]
            for number in range(max(map(len, lists), default=0)):
                seen = [len(mine) > number for mine in lists]
                other = next(mine[number] for mine in lists if len(mine) > number)
                rows = [mine[number] if here else other for mine, here in zip(lists, seen, strict=True)]
                label = name if number == 0 else f"{name}_{number + 1}"
                places = {f"observableParameter{j + 1}_{name}": [row[j] for row in rows] for j in range(len(other))}
                values = {n: steps.spread([self._number(v) for v in column], n) for n, column in places.items()}
                found = put(formula, values)
                if lost := [n for n in names_in(formula) - places.keys() if n.startswith("observableParameter")]:
                    raise ImportProblem(f"no value of `{lost[0]}`", "one with every measurement", place=f"observable {name}")
                known = {*self.out.names(), *steps.definitions, *steps.tables.values()}
                if lost := sorted(names_in(found) - known):
                    raise ImportProblem(f"`{lost[0]}`", "a name of the model or of the parameter table", place=f"observable {name}")
                on: Table = tuple((sympy.Integer(int(s)),) * steps.segments for s in seen)
                found = steps.settled(found, f"observable {name}")
                self.out.outputs[label] = steps.switch(on, f"measured_{name}") * found

    def _number(self, value: Expr) -> Expr:
        return self.fixed.get(value.name, value) if value.is_Symbol else value

    def _priors(self) -> None:
        table = self.problem.parameter_df
        if "objectivePriorType" not in table:
            return
        named = [n for n in self.out.parameters if n in table.index and isinstance(table.loc[n, "objectivePriorType"], str)]
        if named:
            self.out.notes.append("priors are no outputs, those of: " + ", ".join(named))

    def _left_out(self, given: bool) -> None:
        out = self.out
        used = out.used()
        only = [n for n in self.estimated if n not in used and n in self.noise]
        for n in only:
            del out.parameters[n]
        unseen = [n for n in self.estimated if n not in used and n not in only and n not in self.switching] if not given else []
        for n in unseen:
            del out.parameters[n]
        if unseen:
            out.notes.append("left out, of the starts alone: " + ", ".join(unseen))
        if only:
            out.notes.append("left out, of the noise alone: " + ", ".join(only))
        if times := [n for n in self.estimated if n in self.switching and n not in used]:
            for n in times:
                del out.parameters[n]
            out.notes.append(f"left out, seen where something switches, in the order of the nominal values: {', '.join(times)}")

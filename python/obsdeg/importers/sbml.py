"""SBML models (levels 2 and 3, by libSBML): reactions, rules, initial assignments, events.

The state of a species is its concentration, or its amount with `hasOnlySubstanceUnits`, as its name means in
formulas.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import libsbml  # type: ignore[import-untyped]
import sympy  # type: ignore[import-untyped]

from .formula import TIME, Expr, exact, expand, names_in, parse, put, symbol
from .limits import hold_xml
from .problem import ImportProblem
from .sbml_math import formula, lambdas
from .system import State, System


@dataclass
class Event:
    """Event: when `trigger` becomes true, `assignments` happen instantaneously."""

    name: str
    trigger: Expr
    assignments: dict[str, Expr]


@dataclass
class Kinetics:
    """Equations of an SBML model, before outputs and known constants are chosen.

    Attributes:
        rates: Derivative of every state, in its unit per unit of time.
        starts: Value of every state at time 0.
        rules: Definitions by assignment rules.
        values: Values of all constants.
        assigned: Constants and states with an initial assignment.
        changes: Amount of every species that each reaction produces, and the volume of the species (1 for
            amounts).
        fluxes: Rate of every reaction, amount per unit of time.
        events: Events.
    """

    name: str
    rates: dict[str, Expr] = field(default_factory=dict)
    starts: dict[str, Expr] = field(default_factory=dict)
    rules: dict[str, Expr] = field(default_factory=dict)
    values: dict[str, Expr] = field(default_factory=dict)
    assigned: dict[str, Expr] = field(default_factory=dict)
    changes: dict[str, dict[str, Expr]] = field(default_factory=dict)
    volumes: dict[str, Expr] = field(default_factory=dict)
    fluxes: dict[str, Expr] = field(default_factory=dict)
    events: list[Event] = field(default_factory=list)

    def at_start(self, expression: Expr, values: Mapping[str, Expr], place: str) -> Expr:
        """Expression at time 0, without names that have a rule or a start; `values` take precedence over
        those of the model."""
        table = {**self.rules, **self.starts, **self.assigned, **values}
        return expand(expression, table, place).xreplace({TIME: sympy.S.Zero})


def read(path: str | Path) -> Kinetics:
    """Equations of an SBML file.

    Raises:
        ImportProblem: not SBML, or an unsupported construct.
    """
    hold_xml(path)
    document = libsbml.readSBMLFromFile(str(path))
    return kinetics(document, str(path))


def kinetics(document: Any, file: str) -> Kinetics:
    """Equations of a `libsbml.SBMLDocument`."""
    for i in range(document.getNumErrors()):
        error = document.getError(i)
        if error.getSeverity() >= libsbml.LIBSBML_SEV_ERROR:
            words = " ".join(error.getShortMessage().split())
            raise ImportProblem(f"`{words}`", "valid SBML", file=file, place=f"line {error.getLine()}")
    try:
        return _Reader(document).out
    except ImportProblem as problem:
        raise problem.located(file=file) from None


class _Reader:
    def __init__(self, document: Any) -> None:
        self.model = model = document.getModel()
        if model is None:
            raise ImportProblem("no model", "one in the SBML file")
        self.out = out = Kinetics(model.getName() or model.getId() or "SBML model")
        for i in range(document.getNumPlugins()):
            plugin = document.getPlugin(i)
            package = plugin.getPackageName()
            # level 2 stores layout in annotations
            if package in ("layout", "render", "groups", "l3v2extendedmath") or not document.getPackageRequired(package):
                continue
            if package == "comp" and model.getPlugin("comp").getNumSubmodels() == 0:
                continue
            raise ImportProblem(
                f"the package `{package}`", "core SBML", hint="submodels can be flattened by libSBML" if package == "comp" else ""
            )
        self.functions = lambdas(model)
        self.rated: dict[str, Expr] = {}
        for rule in model.getListOfRules():
            self._rule(rule)
        for c in model.getListOfCompartments():
            if c.getId() in out.rules or c.getId() in self.rated:
                raise ImportProblem("a compartment of variable size", "a constant one", place=f"compartment {c.getId()}")
            out.values[c.getId()] = self._number(c.getSize() if c.isSetSize() else 1.0, c)
        for p in model.getListOfParameters():
            self._quantity(p.getId(), self._number(p.getValue(), p) if p.isSetValue() else None)
        for r in model.getListOfReactions():
            for reference in [*r.getListOfReactants(), *r.getListOfProducts()]:
                if reference.isSetIdAttribute() and reference.getId():
                    self._quantity(reference.getId(), self._number(reference.getStoichiometry(), reference))
        moved = self._reactions()
        for s in model.getListOfSpecies():
            self._species(s, moved)
        for a in model.getListOfInitialAssignments():
            out.assigned[a.getSymbol()] = self._formula(a, f"the initial assignment of {a.getSymbol()}")
        for name, value in out.assigned.items():
            if name in out.rates:
                out.starts[name] = value
            out.values.pop(name, None)
        out.assigned = {n: e for n, e in out.assigned.items() if n not in out.rates}
        for e in model.getListOfEvents():
            self._event(e)
        for name in [n for e in out.events for n in e.assignments if n not in out.rates]:
            # a constant that events change becomes a state with rate zero
            start = out.values.pop(name, None) or out.assigned.pop(name, None)
            if start is None:
                raise ImportProblem(f"an assignment to `{name}`", "one to a state or a constant", place=f"an event on {name}")
            out.rates[name], out.starts[name] = sympy.S.Zero, start

    def _formula(self, owner: Any, place: str) -> Expr:
        return formula(owner.getMath(), self.functions, place)

    def _number(self, value: float, owner: Any) -> Expr:
        try:
            return exact(float(value))
        except ImportProblem as problem:
            raise problem.located(place=f"{owner.getElementName()} {owner.getId()}") from None

    def _rule(self, rule: Any) -> None:
        name = rule.getVariable()
        if rule.isAlgebraic():
            raise ImportProblem(
                "an algebraic rule", "assignment and rate rules", place="the list of rules", hint="solve it for one of its variables"
            )
        place = f"the rule of {name}"
        (self.rated if rule.isRate() else self.out.rules)[name] = self._formula(rule, place)

    def _quantity(self, name: str, value: Expr | None) -> None:
        """Adds a quantity that is constant unless a rule changes it."""
        if name in self.rated:
            self.out.rates[name] = self.rated[name]
            if value is not None:
                self.out.starts[name] = value
        elif name not in self.out.rules and value is not None:
            self.out.values[name] = value

    def _species(self, s: Any, moved: Mapping[str, dict[str, Expr]]) -> None:
        name, out = s.getId(), self.out
        amounts = s.getHasOnlySubstanceUnits()
        volume = sympy.S.One if amounts else symbol(s.getCompartment())
        start: Expr | None = None
        if s.isSetInitialConcentration():
            start = self._number(s.getInitialConcentration(), s) * (symbol(s.getCompartment()) if amounts else 1)
        elif s.isSetInitialAmount():
            start = self._number(s.getInitialAmount(), s) / volume
        held = s.getConstant() or s.getBoundaryCondition()
        if held or name in out.rules or name in self.rated:
            self._quantity(name, start)
            return
        factor = s.getConversionFactor() or self.model.getConversionFactor()
        scale = symbol(factor) if factor else sympy.S.One
        changes = {r: scale * n for r, n in moved.get(name, {}).items()}
        out.changes[name], out.volumes[name] = changes, volume
        out.rates[name] = sympy.Add(*(n * out.fluxes[r] / volume for r, n in changes.items()))
        if start is not None:
            out.starts[name] = start

    def _reactions(self) -> dict[str, dict[str, Expr]]:
        """Amounts of every species that reactions produce per unit of their rates."""
        moved: dict[str, dict[str, Expr]] = {}
        for reaction in self.model.getListOfReactions():
            name = reaction.getId()
            if reaction.isSetFast() and reaction.getFast():
                raise ImportProblem("a fast reaction", "reactions with a rate", place=f"reaction {name}")
            law = reaction.getKineticLaw()
            if law is None:
                raise ImportProblem("no kinetic law", "one", place=f"reaction {name}")
            flux = self._formula(law, f"the kinetic law of {name}")
            own: dict[str, Expr] = {}
            for p in [*law.getListOfParameters(), *law.getListOfLocalParameters()]:
                own[p.getId()] = symbol(f"{name}_{p.getId()}")
                self.out.values[f"{name}_{p.getId()}"] = self._number(p.getValue(), p)
            self.out.fluxes[name] = put(flux, own)
            for sign, references in ((-1, reaction.getListOfReactants()), (1, reaction.getListOfProducts())):
                for reference in references:
                    change = moved.setdefault(reference.getSpecies(), {})
                    change[name] = change.get(name, sympy.S.Zero) + sign * self._stoichiometry(reference, name)
        return moved

    def _stoichiometry(self, reference: Any, reaction: str) -> Expr:
        math = reference.getStoichiometryMath() if reference.isSetStoichiometryMath() else None
        if math is not None:
            return self._formula(math, f"a stoichiometry of {reaction}")
        label = reference.getId() if reference.isSetIdAttribute() else ""
        if label and (label in self.out.rules or label in self.rated or self.model.getInitialAssignment(label) is not None):
            return symbol(label)
        return self._number(reference.getStoichiometry(), reference) / int(reference.getDenominator() or 1)

    def _event(self, e: Any) -> None:
        name = f"event {e.getId() or e.getName() or '(unnamed)'}"
        if e.isSetDelay():
            raise ImportProblem("a delay", "an event at once", place=name)
        if e.isSetPriority():
            raise ImportProblem("a priority", "events whose order does not matter", place=name)
        trigger = self._formula(e.getTrigger(), name)
        assignments = {a.getVariable(): self._formula(a, name) for a in e.getListOfEventAssignments()}
        self.out.events.append(Event(name, trigger, assignments))


def load(
    path: str | Path,
    *,
    outputs: Mapping[str, str] | None = None,
    unknown: Iterable[str] | None = None,
    starts: str = "given",
) -> System:
    """System of an SBML file.

    Arguments:
        path: The file.
        outputs: Measured quantities: formulas by name, in names of the model. SBML does not contain them.
        unknown: Unknown constants; by default all parameters of the model, local ones as
            `reaction_parameter`.
        starts: `given`: starts of the file; `unknown`: unknown starts.

    Raises:
        ImportProblem: unsupported construct, or no outputs.
    """
    from .timeline import Timeline

    k = read(path)
    file = str(path)
    if not outputs:
        hint = 'say what is measured: load(path, outputs={"y": "' + next(iter(k.rates), "A") + '"})'
        raise ImportProblem("no outputs", "what is measured, of which SBML says nothing", file=file, hint=hint)
    if starts not in ("given", "unknown"):
        raise ImportProblem(f"starts=`{starts}`", "`given` or `unknown`", file=file)
    try:
        model = libsbml.readSBMLFromFile(file).getModel()
        volumes = {c.getId() for c in model.getListOfCompartments()}
        species = {s.getId() for s in model.getListOfSpecies()}
        chosen = list(k.values.keys() - volumes - species) if unknown is None else list(unknown)
        if wrong := [n for n in chosen if n not in k.values]:
            raise ImportProblem(f"the unknown `{wrong[0]}`", "a constant of the model: " + ", ".join(k.values))
        system = System(k.name)
        system.parameters = {n: "" for n in k.values if n in chosen}
        constants = {n: v for n, v in k.values.items() if n not in chosen}
        measured = {n: parse(t) for n, t in outputs.items()}
        definitions = {**k.rules, **{n: k.at_start(e, {}, f"the initial assignment of {n}") for n, e in k.assigned.items()}}
        known = {*k.rates, *k.values, *definitions}
        if lost := sorted(names_in(*measured.values()) - known):
            raise ImportProblem(f"`{lost[0]}` in the outputs", "names of the model: " + ", ".join(sorted(known)))
        for name, rate in k.rates.items():
            start = k.at_start(k.starts[name], {}, f"the start of {name}") if name in k.starts and starts == "given" else None
            system.states[name] = State(rate, start)
        system.constants = dict(constants)
        timeline = Timeline(system, definitions, [constants], [None], k.events)
        system.outputs = {n: timeline.settled(e, f"the output {n}") for n, e in measured.items()}
        timeline.finish()
        system.drop_unused()
        return system
    except ImportProblem as problem:
        raise problem.located(file=file) from None

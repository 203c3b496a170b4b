"""PEtab problems by other programs: tables read with csv, model simulated by libRoadRunner, observables
evaluated by Python."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import libsbml
import mpmath
import roadrunner
import yaml
from toml_numbers import value


@dataclass
class Tables:
    """Tables of a problem, and its SBML."""

    folder: Path
    conditions: dict[str, dict[str, str]]
    measurements: list[dict[str, str]]
    parameters: dict[str, dict[str, str]]
    observables: dict[str, dict[str, str]]
    sbml: str

    @staticmethod
    def read(problem: Path) -> Tables:
        """Tables that a YAML file names."""
        layout = yaml.safe_load(problem.read_text())
        part, folder = layout["problems"][0], problem.parent

        def rows(files: list[str]) -> list[dict[str, str]]:
            return [r for f in files for r in csv.DictReader((folder / f).open(newline=""), delimiter="\t")]

        parameters = layout["parameter_file"]
        return Tables(
            folder,
            {r["conditionId"]: r for r in rows(part["condition_files"])},
            rows(part["measurement_files"]),
            {r["parameterId"]: r for r in rows([parameters] if isinstance(parameters, str) else parameters)},
            {r["observableId"]: r for r in rows(part["observable_files"])},
            (folder / part["sbml_files"][0]).read_text(),
        )

    def estimated(self) -> list[str]:
        """Estimated parameters."""
        return [n for n, p in self.parameters.items() if p["estimate"] == "1"]


def _number(text: str, values: Mapping[str, float]) -> float | None:
    """Cell of a table: a number, a parameter, or None."""
    text = (text or "").strip()
    if not text or text.lower() == "nan":
        return None
    try:
        return float(text)
    except ValueError:
        return values[text]


def prepared(tables: Tables, condition: str, values: Mapping[str, float]) -> roadrunner.RoadRunner:
    """Model in a condition at its start, with the given parameters."""
    document = libsbml.readSBMLFromString(tables.sbml)
    model = document.getModel()
    numbers = dict(values)
    for name, cell in tables.conditions[condition].items():
        number = None if name in ("conditionId", "conditionName") else _number(cell, values)
        if number is not None:
            numbers[name] = number
    for name, number in numbers.items():
        if (parameter := model.getParameter(name)) is not None:
            if model.getRule(name) is not None and model.getRule(name).isAssignment():
                continue
            parameter.setValue(number)
        elif (species := model.getSpecies(name)) is not None:
            if species.getHasOnlySubstanceUnits():
                species.setInitialAmount(number)
            else:
                species.setInitialConcentration(number)
        elif (compartment := model.getCompartment(name)) is not None:
            compartment.setSize(number)
        else:
            continue
        model.removeInitialAssignment(name)
    return roadrunner.RoadRunner(libsbml.writeSBMLToString(document))


def written(folder: Path, sbml: str, tables: Mapping[str, str]) -> Path:
    """Problem of a model and tables (`parameters`, `conditions`, `observables`, `measurements`) with columns
    separated by blanks; `-` is an empty cell."""
    (folder / "model.xml").write_text(sbml)
    for name, text in tables.items():
        rows = [["" if cell == "-" else cell for cell in line.split()] for line in text.strip().splitlines()]
        (folder / f"{name}.tsv").write_text("".join("\t".join(row) + "\n" for row in rows))
    part = {f"{n.rstrip('s')}_files": [f"{n}.tsv"] for n in ("conditions", "observables", "measurements")} | {"sbml_files": ["model.xml"]}
    path = folder / "problem.yaml"
    path.write_text(yaml.safe_dump({"format_version": 1, "parameter_file": "parameters.tsv", "problems": [part]}))
    return path


@dataclass
class Model:
    """Simulator with the names of its states as the model means them: concentrations, or amounts."""

    simulator: roadrunner.RoadRunner
    states: list[str]
    keys: dict[str, str]

    @staticmethod
    def of(simulator: roadrunner.RoadRunner, sbml: str) -> Model:
        """States of a simulator."""
        model = libsbml.readSBMLFromString(sbml).getModel()
        keys = {s.getId(): s.getId() if s.getHasOnlySubstanceUnits() else f"[{s.getId()}]" for s in model.getListOfSpecies()}
        rated = [r.getVariable() for r in model.getListOfRules() if r.isRate()]
        moved = [s for s in simulator.model.getFloatingSpeciesIds() if s not in rated]
        still = {r.getVariable() for r in model.getListOfRules() if r.isAssignment()}
        return Model(simulator, [n for n in [*moved, *rated] if n not in still], keys)

    def __getitem__(self, name: str) -> float:
        return float(self.simulator[self.keys.get(name, name)])

    def move(self, values: Mapping[str, float], time: float) -> None:
        """Sets the states."""
        self.simulator.model.setTime(time)
        for name in self.states:
            self.simulator[self.keys.get(name, name)] = values[name]

    def rate(self, name: str) -> float:
        """Derivative of a state."""
        return float(self.simulator[self.keys.get(name, name) + "'"])

    def size(self, name: str) -> float:
        """Size of a rate: the sum of the magnitudes of all reactions that change a state."""
        if not self.simulator.model.getNumReactions():
            return abs(self.rate(name))
        matrix = self.simulator.getFullStoichiometryMatrix()
        if name not in matrix.rownames:
            return abs(self.rate(name))
        row = matrix.rownames.index(name)
        rates = self.simulator.model.getReactionRates()
        return sum(abs(float(matrix[row, j]) * rates[j]) for j in range(len(rates))) / min(1.0, self._volume(name))

    def _volume(self, name: str) -> float:
        return abs(self.simulator[name] / self[name]) if self[name] else 1.0


def observed(model: Model, tables: Tables, row: Mapping[str, str], values: Mapping[str, float], time: float) -> Any:
    """Value of an observable at the present state."""
    name = row["observableId"]
    given = [p for p in (row.get("observableParameters") or "").split(";") if p]
    names: dict[str, Any] = {f"observableParameter{i + 1}_{name}": mpmath.mpf(_number(p, values) or 0) for i, p in enumerate(given)}
    names["time"] = mpmath.mpf(time)
    names |= {"log10": mpmath.log10, "mpf": mpmath.mpf}

    class Names(dict[str, Any]):
        def __missing__(self, key: str) -> Any:
            if key in values:
                return mpmath.mpf(values[key])
            return getattr(mpmath, key) if key in ("log", "exp", "sqrt") else mpmath.mpf(model[key])

    return value(tables.observables[name]["observableFormula"], Names(names))

"""Exact observable degrees: which unknowns a system's output determines, and with how many derivatives.

>>> import obsdeg
>>> answer = obsdeg.analyze([(0, 0, 0), (180, 0, 0)], carry="inertial")
>>> answer["D_FX"].degree
1

Functions: :func:`analyze`, :func:`simulate`, :func:`crosscheck`, :func:`compare`, :func:`design`,
    :func:`measure`, :func:`next_measurement`, :func:`calibrate` and :func:`report`
take a :class:`Scheme` or a :class:`Model`. :func:`allan` estimates the noise of sensors at rest. :func:`load`
reads models of other tools. :mod:`obsdeg.campaign` runs searches and sweeps of many tasks.

Options have the names of the command line in snake case. Answers have the attributes of the command line's
JSON (without the symbolic engine), which they return byte for byte. Angles and latitudes are exact: an
``int`` and a ``str`` as they are, a ``float`` by its shortest text. A computed number (``0.1 + 0.2``) is
rounded to nine decimals, and the answer lists it (``answer.rounded``). An invalid request raises a
``ValueError`` or ``TypeError``; that of the engine is a :class:`ProblemError`, a ``ValueError`` with
``message``, ``file``, ``line`` and ``column``.
"""

from __future__ import annotations

import importlib
from typing import Any

from . import options as options
from . import shapes as shapes
from ._calibrate import allan, calibrate
from ._commands import analyze, compare, crosscheck, design, load, measure, next_measurement, paper, procedure, report, simulate
from ._files import Text
from ._model import Model
from ._obsdeg import ProblemError, __version__
from ._records import Record
from ._results import (
    Analysis,
    Answer,
    Audit,
    Calibration,
    Comparison,
    CrossCheck,
    Design,
    Judgement,
    Judgements,
    NextPositions,
    Part,
    Procedure,
    Report,
    SensorNoise,
    Sensors,
    Simulation,
    SystemAnalysis,
    SystemCalibration,
    SystemEvidence,
    SystemRun,
    Walks,
)
from ._scheme import Scheme
from ._texts import Rounded

__all__ = [
    "Analysis",
    "Answer",
    "Audit",
    "Calibration",
    "Comparison",
    "CrossCheck",
    "Design",
    "Judgement",
    "Judgements",
    "Model",
    "NextPositions",
    "Part",
    "ProblemError",
    "Procedure",
    "Record",
    "Report",
    "Rounded",
    "Scheme",
    "SensorNoise",
    "Sensors",
    "Simulation",
    "SystemAnalysis",
    "SystemCalibration",
    "SystemEvidence",
    "SystemRun",
    "Text",
    "Walks",
    "__version__",
    "allan",
    "analyze",
    "calibrate",
    "compare",
    "crosscheck",
    "design",
    "load",
    "measure",
    "next_measurement",
    "options",
    "paper",
    "procedure",
    "report",
    "shapes",
    "simulate",
]

#: Format of the docstrings.
__docformat__ = "numpy"
load.__module__ = paper.__module__ = __name__


def __getattr__(name: str) -> Any:
    # optional modules are imported at their first use
    if name in ("campaign", "importers"):
        return importlib.import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "campaign", "importers"])

"""Exact observable degrees: which unknowns a system's output determines, and with how many derivatives.

>>> import obsdeg
>>> answer = obsdeg.analyze([(0, 0, 0), (180, 0, 0)], carry="inertial")
>>> answer["D_FX"].degree
1

Ask with :func:`analyze`, :func:`simulate`, :func:`crosscheck`, :func:`compare`, :func:`design`, :func:`measure`, :func:`next_measurement`, :func:`calibrate` and :func:`report`,
of a :class:`Scheme` or a :class:`Model`; :func:`allan` gives the noise of sensors at rest; :func:`load` reads models of other tools, :mod:`obsdeg.campaign` asks many times.

Options are those of the command line in snake case; answers are the JSON of a command line without the symbolic engine, byte for byte,
with attributes. Angles and latitudes are exact: an ``int`` and a ``str`` as they are, a ``float`` by its shortest text. What is computed
(``0.1 + 0.2``) is rounded to nine decimals, which the answer says (``answer.rounded``). What is wrong with a request is a
:class:`ProblemError`, a ``ValueError`` with ``message``, ``file``, ``line`` and ``column``.
"""

from __future__ import annotations

import importlib
from typing import Any

from . import options as options
from . import shapes as shapes
from ._calibrate import allan, calibrate
from ._commands import analyze, compare, crosscheck, design, load, measure, next_measurement, paper, report, simulate
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
    "report",
    "shapes",
    "simulate",
]

#: Of the docstrings.
__docformat__ = "numpy"
load.__module__ = paper.__module__ = __name__


def __getattr__(name: str) -> Any:
    # what is not always wanted is loaded when it is asked for
    if name in ("campaign", "importers"):
        return importlib.import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "campaign", "importers"])

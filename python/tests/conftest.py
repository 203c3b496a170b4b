"""Shared parts of the tests of the importers: judge, reference models, published problems."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

# A shell that runs the tests in the background makes them ignore the interrupt key, which some tests press.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

#: Folder of the checkout.
ROOT = Path(__file__).resolve().parents[2]
#: True where all is tested, as by `.ci/run release`; otherwise long tests take a sample of their cases.
AT_LENGTH = "AT_LENGTH" in os.environ
#: Mark of tests that run at full length only.
at_length = pytest.mark.skipif(not AT_LENGTH, reason="at full length, with AT_LENGTH=1, as `.ci/run release` does")
#: What mypy found of the libraries, which one run reads and the next one uses: `cache_dir` in pyproject.toml.
MYPY_CACHE = ROOT / "target" / "mypy"

try:
    import obsdeg.importers  # noqa: F401
except ModuleNotFoundError:
    # without an installed package: the sources
    sys.path.insert(0, str(ROOT / "python"))


def _program() -> str:
    built = [p for p in (ROOT / "target" / profile / "obsdeg" for profile in ("release", "debug")) if p.exists()]
    newest = str(max(built, key=lambda p: p.stat().st_mtime)) if built else shutil.which("obsdeg")
    found = os.environ.get("OBSDEG_PROGRAM") or newest
    if found is None:
        pytest.fail("no program `obsdeg`: build it (cargo build), or name it in OBSDEG_PROGRAM")
    return found


def judge(model: str, *options: str) -> dict[str, Any]:
    """JSON answer of `analyze` to the text of a model. All tests of the importers judge models through this
    function."""
    command = [_program(), "analyze", "-", "--format", "json", "--solutions", "off", *options]
    done = subprocess.run(command, input=model, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


def statuses(model: str) -> dict[str, str]:
    """Status of every unknown."""
    return {q["name"]: q["status"] for q in judge(model)["quantities"]}


def shared(part: str) -> Path:
    """Folder of the data beside the checkout; a test fails if it is missing."""
    found = ROOT.parent / "shared" / part
    if not found.is_dir():
        pytest.fail(f"{found} is missing: the data of these tests stand beside the checkout, in `shared`")
    return found


def references() -> dict[str, dict[str, Any]]:
    """Published systems with known verdicts, `tests/data/models`, by name."""
    files = sorted((ROOT / "tests" / "data" / "models").glob("*.json"))
    return {f.stem: json.loads(f.read_text(encoding="utf-8")) for f in files}

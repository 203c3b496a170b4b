"""The checker that needs neither the package nor the program accepts a certificate of the package."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import obsdeg
import pytest
from conftest import ROOT

CHECKER = ROOT / "tools" / "verify_certificate.py"
SCHEME = "[[position]]\nangles_deg = [0, 0, 0]\n[[position]]\nangles_deg = [180, 0, 0]\n"

pytestmark = pytest.mark.skipif(sys.version_info < (3, 11), reason="tomllib is new in 3.11")


def checked(certificate: bytes, folder: Path) -> tuple[int, str]:
    (folder / "c.json").write_bytes(certificate)
    (folder / "s.toml").write_text(SCHEME, encoding="utf-8")
    command = [sys.executable, "-B", str(CHECKER), "c.json", "s.toml"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout


def test_it_is_accepted_and_a_change_of_it_refused(tmp_path: Path) -> None:
    answer = obsdeg.analyze(angles=[(0, 0, 0), (180, 0, 0)], certificate=True)
    certificate = answer.files()["certificate.json"]
    code, printed = checked(certificate, tmp_path)
    assert code == 0 and "D_FX: observable with degree 1 " in printed and "Rank 8 of 15; verified exactly." in printed
    value = json.loads(certificate)
    value["verdicts"][3]["degree"] = 2
    code, printed = checked(json.dumps(value).encode(), tmp_path)
    assert (code, printed) == (1, "refused: D_FX, degree: the certificate says 2; found 1\n")


def test_what_has_no_certificate_says_so() -> None:
    with pytest.raises(obsdeg.ProblemError, match="generic angle alpha"):
        obsdeg.analyze(angles=["alpha,0,0"], certificate=True)
    assert "certificate.json" not in obsdeg.analyze(angles=[(0, 0, 0)]).files()

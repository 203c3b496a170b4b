"""What to measure next: the explanation of a verdict, and further positions."""

from __future__ import annotations

import itertools
import math

import obsdeg
import pytest


def test_a_verdict_is_explained() -> None:
    answer = obsdeg.analyze(["NUE", "NDW"], why="D_FZ", solutions=False)
    (why,) = answer.why
    assert (why.name, why.status, why.degree) == ("D_FZ", "inseparable", None)
    # (17): D_FZ - wN psi_y is observable
    assert [(c.name, c.coefficient) for c in why.unseen.components] == [("D_FZ", "1"), ("psi_y", "1/wN")]
    # with the value of psi_y known it is
    assert why.remedies[0].changes[0].to_dict() == {"kind": "known", "name": "psi_y"}
    assert obsdeg.analyze(["NUE", "NDW"], solutions=False).to_dict().get("why") is None


def test_every_attitude_that_is_said_to_help_does() -> None:
    (why,) = obsdeg.analyze(["NUE", "NDW"], why=["D_IX"], solutions=False).why
    added = [r for r in why.remedies if r.changes[0].kind == "attitude"]
    assert added
    for remedy in added:
        after = obsdeg.analyze(["NUE", "NDW", remedy.changes[0].attitude], solutions=False)
        assert after["D_IX"].degree == remedy.degree


def test_a_model_is_explained() -> None:
    chain = obsdeg.Model(states={"a": "-k*a", "b": "k*a - b"}, parameters=["k"], outputs={"y": "b"})
    (why,) = obsdeg.analyze(chain, why="a", solutions=False).why
    assert [(d.output, d.order) for d in why.determined_by] == [("y", 0), ("y", 1), ("y", 2)]
    assert (why.unseen.up_to_order, [c.name for c in why.unseen.components]) == (1, ["a", "k"])
    assert why.remedies[0].changes[0].name == "k"


def test_figures_are_files() -> None:
    found = obsdeg.next_measurement(obsdeg.Scheme(["NUE", "NDW"]), dwell=500)
    files = found.files()
    assert sorted(files) == ["attitudes.png", "attitudes.svg", "degrees.png", "degrees.svg"]
    assert len(found.by_candidate) == 24
    assert all(f"<title>{c.candidate}: ".encode() in files["attitudes.svg"] for c in found.by_candidate)
    assert obsdeg.next_measurement(obsdeg.Scheme(["NUE"]), 2, dwell=500, keep=1).files() == {}


def test_the_next_position_is_the_best_of_all() -> None:
    candidates = ["NUE", "USE", "SDE", "DES"]
    pair = obsdeg.Scheme(["NUE", "NDW"], carry="inertial", latitude=48)
    found = obsdeg.next_measurement(pair, candidates=candidates, dwell=100, observable="D_F")
    assert len(found) == len(candidates) and found.proven
    sigma = {e.positions[0].candidate: e.then.worst.sigma_dph for e in found.found}
    best = min(sigma, key=lambda name: sigma[name])
    assert found[0].positions[0].candidate == best
    two = obsdeg.next_measurement(pair, 2, candidates=candidates, dwell=100, observable="D_F", keep=100)
    assert two.examined == math.prod([len(candidates)] * 2) == len(list(itertools.product(candidates, repeat=2)))


def test_wrong_names_are_refused() -> None:
    with pytest.raises(obsdeg.ProblemError, match="no unknown `D_FW`"):
        obsdeg.analyze(["NUE"], why="D_FW", solutions=False)
    with pytest.raises(obsdeg.ProblemError, match="1 to 2"):
        obsdeg.next_measurement(obsdeg.Scheme(["NUE"]), 3)

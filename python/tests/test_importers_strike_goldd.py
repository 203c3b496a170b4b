"""Models of STRIKE-GOLDD in its syntax have their published verdicts.

The texts are written here from the published equations; no file of the tool is included. Each verdict names
its source: the manual, the authors' supplement of AutoRepar (boxes: output of the tool), StrikePy, the same
authors' tool in Python, or another tool, StructuralIdentifiability.jl.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest
import scripts
from conftest import references, statuses

from obsdeg.importers import strike_goldd, to_toml

C2M = """
syms x1 x2 k1e k12 k21 b v
x = [x1; x2]; h = x1;
{inputs}
f = [-(k1e + k12)*x1 + k21*x2 + b*v;  % the measured one
     k12*x1 - k21*x2];
p = [{unknown}].';
save('C2M','x','p','h','f','u','w');
"""
VAJDA = """
% S. Vajda et al., Math. Biosciences 93 (1989) 217: two states, one input
syms x1 x2 t1 t2 t3 t4 w
x = [x1 x2].'; p = [{unknown}]; u = []; h = x1;
f = [t1*x1^2 + {t2}*x1*x2 + w;
     t3*x1^2 + t4*x1*x2];
save('Vajda','x','p','w','u','h','f');
"""
BIG = """
% beta cells, insulin, glucose: B. Topp et al., J. Theor. Biol. 206 (2000) 605; O. Karin et al., Mol. Syst. Biol. 12 (2016) 886
syms G B I
x = [G, B, I];
syms v u0 P si gamma c alpha
p = [{unknown} gamma c alpha]; u = v;
up = 0.021/(24*60); down = 0.025/(24*60);   % per minute
grow = up/(1 + (8.4/G)^1.7);
die  = down/(1 + (G/4.8)^8.5);
h = G;
f = [u0 + v - (c + {si}*I)*G; B*(grow - die); {P}*B*G^2/(alpha^2 + G^2) - gamma*I];
save('BIG','x','p','h','u','f');
"""
PK = """
% pharmacokinetics: B. Merkt et al., Phys. Rev. E 92 (2015) 012920
syms x1 x2 x3 x4 k1 k2 k3 k4 k5 k6 k7 s2 s3 u1
x = [x1; x2; x3; x4]; w = u1; u = [];
p = [{unknown} k2 k3 k4 k5 k6 k7 s2];
h = [s2*x2; {s3}*x3];
f = [u1 - x1*({k1} + k2); {k1}*x1 + k5*x4 - x2*(k3 + k6 + k7); ...
     k2*x1 + k3*x2 - k4*x3; k6*x2 - k5*x4];
save('PK','x','p','h','f','u','w');
"""
NFKB = """
% T. Lipniacki et al., J. Theor. Biol. 228 (2004) 195, as B. Merkt et al. (2015) have it: rates k2 to k5, k7, k9, k11 are known
syms x1 x2 x3 x4 x5 x6 x7 x8 x9 x10 u1
syms k0 k1 k1p k2 k3 k4 k5 k6 k7 k8 k9 k10 k11 s1 s2 s3 s4 I0cyt I0nuc rhovol
x = [x1 x2 x3 x4 x5 x6 x7 x8 x9 x10]; u = []; w = u1;
p = [s1 s2 s3 s4 k1 k8 {unknown}];
on = x1*(k1p + k1*u1/({k0}*u1 + 1));
binds = {k10}*x6*x9;
f = [k11*x10 - on; on - k2*x2; k2*x2 - k3*x3; k2*x2 - k4*x4
     k3*rhovol*x3 - k5*x5; k5*x5 - binds; {k6}*x6 - k7*x7; k8*x7 - k9*x8
     k9*rhovol*x8 - binds; binds - k11*rhovol*x10];
h = [I0cyt + s1*(x1 + x2 + x3); I0nuc + s2*(x5 + x6 + x10); s3*(x2 + x3); s4*(x2 + x4)];
save('NFKB','x','p','h','f','u','w');
"""


def c2m(unknown: str, known: bool) -> str:
    inputs = "u = [v]; w = [];" if known else "w = v; u = [];"
    return C2M.format(unknown=unknown, inputs=inputs)


def without(text: str, *ones: str, of: str) -> str:
    """Text with unknown parameters `of`; those equal to 1 are known."""
    every = of.split()
    return text.format(unknown=" ".join(n for n in every if n not in ones), **{n: "1" if n in ones else n for n in every})


def names(text: str) -> set[str]:
    """Words of a text, with `x1..4` for x1 x2 x3 x4."""
    out: set[str] = set()
    for word in text.split():
        head, dots, last = word.partition("..")
        out |= {f"{head[:-1]}{i}" for i in range(int(head[-1]), int(last) + 1)} if dots else {word}
    return out


MANUAL, REPAIR, PORT = "STRIKE-GOLDD manual 4.3", "supplement of AutoRepar", "StrikePy 1.0"
OTHER = "StructuralIdentifiability.jl 0.1"
RAMP: dict[str, Any] = {"unknown_inputs": 1}
X10 = "x1..9 x10 s1..4"
#: Texts, options, unobservable names, and source of the verdict.
PUBLISHED: dict[str, tuple[str, dict[str, Any], str, str]] = {
    "two compartments, any input": (c2m("k1e k12 k21 b", True), {}, "", f"{MANUAL}.1"),
    "two compartments, constant input": (c2m("k1e k12 k21 b", True), {"known_inputs": 0}, "x2 k1e k12 k21 b", f"{MANUAL}.1"),
    "two compartments, a ramp": (c2m("k1e k12 k21 b", True), {"known_inputs": 1}, "", f"{MANUAL}.1"),
    "two compartments, unknown input": (c2m("k1e, k12, k21", False), {"unknown_inputs": 0}, "x2 v k1e k12 k21", f"{MANUAL}.2"),
    "two compartments, unknown ramp": (c2m("k1e, k12, k21", False), RAMP, "x2 v v' k1e k12 k21", f"{MANUAL}.2"),
    "two compartments, elimination known": (c2m("k12 k21", False), {"unknown_inputs": 0}, "", f"{MANUAL}.2"),
    "two compartments, elimination known, ramp": (c2m("k12 k21", False), RAMP, "", f"{MANUAL}.2"),
    # box 1 calls x2 observable, although the third of its symmetries changes it: this list has the three
    "Vajda": (VAJDA.format(unknown="t1;t2;t3;t4", t2="t2"), RAMP, "t2 t3 x2", f"{REPAIR}, 1: symmetry (3)"),
    "Vajda, repaired": (VAJDA.format(unknown="t1;t3;t4", t2="1"), RAMP, "", f"{REPAIR}, 1: box 4"),
    "pharmacokinetics": (without(PK, of="k1 s3"), RAMP, "k1 k2 k3 k7 s2 s3 x1..4 u1 u1'", f"{REPAIR}, 2: box 1"),
    "pharmacokinetics, half repaired": (without(PK, "k1", of="k1 s3"), RAMP, "s2 s3 x1..4 u1 u1'", f"{REPAIR}, 2: box 5"),
    "pharmacokinetics, repaired": (without(PK, "k1", "s3", of="k1 s3"), RAMP, "", f"{REPAIR}, 2: box 8"),
    "glucose alone": (without(BIG, of="P si"), {}, "P si B I", f"{REPAIR}, 3: box 1"),
    "glucose alone, half repaired": (without(BIG, "P", of="P si"), {}, "si B I", f"{REPAIR}, 3: box 5"),
    "glucose alone, repaired": (without(BIG, "P", "si", of="P si"), {}, "", f"{REPAIR}, 3: box 6"),
    # box 1 lists the names that each symmetry changes
    "NFkB": (without(NFKB, of="k0 k6 k10"), RAMP, f"k0 k1 k6 k8 k10 u1 u1' {X10}", f"{REPAIR}, 4: box 1"),
    "NFkB, a third repaired": (without(NFKB, "k0", of="k0 k6 k10"), RAMP, f"k6 k8 k10 {X10}", f"{REPAIR}, 4: box 4"),
    "NFkB, two thirds repaired": (without(NFKB, "k0", "k6", of="k0 k6 k10"), RAMP, f"k10 {X10}", f"{REPAIR}, 4: box 8"),
    "NFkB, repaired": (without(NFKB, "k0", "k6", "k10", of="k0 k6 k10"), RAMP, "", f"{REPAIR}, 4: box 11"),
}  # fmt: skip
#: Reference models that the collections of STRIKE-GOLDD or StrikePy contain, with the tool that judged them.
COLLECTED = {
    "bolie_glucose": PORT,
    "clock_reaction_cr": PORT,
    "hiv_miao_unknown_input": PORT,
    "integral_controller_1A": PORT,
    "nonlinear_controller_1C": PORT,
    "prop_integral_controller_1B": PORT,
    "glv_microbial": OTHER,
    "hiv_miao_known_input": OTHER,
    "jak_stat_bachmann": OTHER,
    "jak_stat_raia": OTHER,
    "nfkb_all_symbolic": OTHER,
    "p53": OTHER,
    "phosphorylation": OTHER,
    "pk_merkt_known_input": OTHER,
    "siwr_cholera": OTHER,
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_verdicts_are_those_that_are_published(name: str) -> None:
    text, options, lost, _ = PUBLISHED[name]
    found = statuses(to_toml(strike_goldd.read(text, **options)))
    assert {n for n, s in found.items() if s != "observable"} == names(lost)


@pytest.mark.parametrize("name", COLLECTED)
def test_verdicts_are_those_of_other_tools(name: str) -> None:
    model = references()[name]
    # the model names the tool of its verdict
    assert COLLECTED[name].split()[0] in model["reference"]
    model = scripts.renamed(model)
    degree = model.get("unknown_input_max_derivative")
    system = strike_goldd.read(scripts.matlab(model), unknown_inputs="arbitrary" if degree is None else degree)
    found = statuses(to_toml(system))
    assert {n for n in model["expected"]["observable"] if found[n] != "observable"} == set()
    assert {n for n in model["expected"]["unobservable"] if found[n] == "observable"} == set()


def test_there_are_more_than_thirty() -> None:
    sources = Counter(s.partition(",")[0].partition(" 4.3")[0] for *_, s in PUBLISHED.values()) + Counter(COLLECTED.values())
    assert sources["STRIKE-GOLDD manual"] == 7 and sources[REPAIR] == 12 and sources[PORT] == 6
    assert sum(sources.values()) == 34
    # the same system is used once with each input
    assert len({text for text, *_ in PUBLISHED.values()}) == 15

"""Formulas, styles of other tools' texts, refusals by line, and `load`, which recognises the kind of a file.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import mpmath
import pytest
import sympy
from conftest import ROOT, shared, statuses
from toml_numbers import value

import obsdeg
from obsdeg.importers import (
    ImportProblem,
    exporters,
    load,
    sijl,
    strike_goldd,
    sympy_system,
    to_toml,
)
from obsdeg.importers.formula import exact, number_text, parse, text_of

FORMULAS = [
    "a - b - c", "a - (b - c)", "-a^2", "(-a)^2", "2^-b", "a^b^c", "(a^b)^c", "a/b/c", "a/(b*c)", "-a/b*c", "1.5e-3*a", "3/7 - a/9", "sqrt(a)/b", "1/sqrt(a*b)",
    "exp(-a*b)^2/c", "log(a + b)", "log10(a)", "log2(c)", "sinh(a) + cosh(b)", "min(a, b)*max(a, c, 2)", "atan2(a, b)", "tanh(a - b)", "abs(a - c)", "a^(1/3)", "a^-1.5", "a^(b - 1)",
    "(a + b)^2*(a - b)^3/(c + 1)^2", "-(a + b)", "-(a + b)*c", "2*(a + b)/3", "123456789012345678901234567890123456789*a", "a*1e-30", "1e22 + a*1e22", "sign(a - b)", "power(a, 2)", "sec(a)*csc(b)*cot(c)",
]  # fmt: skip


@pytest.mark.parametrize("text", FORMULAS)
def test_what_is_written_is_worth_what_was_read(text: str) -> None:
    names: dict[str, Any] = {"a": mpmath.mpf("1.25"), "b": mpmath.mpf("0.75"), "c": mpmath.mpf("2.5")}
    own = {"log10": mpmath.log10, "log2": lambda x: mpmath.log(x, 2), "min": min, "max": max, "power": pow} | {
        n: getattr(mpmath, n) for n in ("sinh", "cosh", "sec", "csc", "cot")
    }

    class Names(dict[str, Any]):
        def __missing__(self, key: str) -> Any:
            if key == "mpf":
                raise KeyError(key)
            return getattr(mpmath, key) if key != "abs" else abs

    before = value(text, Names(names | own))
    after = value(text_of(parse(text)), Names(names))
    assert abs(before - after) < mpmath.mpf(10) ** -35 * (1 + abs(before))


@pytest.mark.parametrize(
    "number", ["0", "-3", "0.1", "-1.25e-7", "6.02214179e23", "1234567.875", "1e-300", "123456789.123456789", "9007199254740993"]
)
def test_decimals_stay_decimals(number: str) -> None:
    text = number_text(exact(number))
    assert sympy.Rational(text) == sympy.Rational(number) and "/" not in text


def test_floats_go_through_their_shortest_text() -> None:
    assert exact(0.1) == sympy.Rational(1, 10)
    with pytest.raises(ImportProblem, match="inf"):
        exact(float("inf"))


BOLIE = """\
% J. W. Bolie, J. Appl. Physiol. 16 (1961) 783: glucose and insulin
clear;
syms q1 q2 p1 p2 p3 ...
     p4 Vp  % symbols, on two lines
syms delta real
x = [q1; q2];  u = delta;
%{
x = [nothing];
%}
w = [];
rate1 = p1*q1-p2*q2+u;
f = [rate1
     p3*q2 + p4*q1];   h = q1/Vp;
p = transpose([p1, p2 p3 p4, ...
      Vp]);
ics  = []; known_ics = [0,0];
save('Bolie','x','p','u','h','f','ics','known_ics');
h = x;
save('Bolie_both','x','p','u','h','f','ics','known_ics');
"""


def test_a_script_may_save_several_models() -> None:
    assert strike_goldd.models(BOLIE) == ["Bolie", "Bolie_both"]
    first = strike_goldd.read(BOLIE)
    assert first.notes == ["model Bolie; the script saves others: Bolie_both"] and list(first.known_inputs) == ["delta"]
    # the scale of the second state is not observable
    assert {n for n, s in statuses(to_toml(first)).items() if s != "observable"} == {"q2", "p2", "p4"}
    both = strike_goldd.read(BOLIE, model="Bolie_both")
    assert {n for n, s in statuses(to_toml(both)).items() if s != "observable"} == {"Vp"}
    assert strike_goldd.read(BOLIE, model=2).outputs == both.outputs


KNOWN = """\
syms x1 x2 a b D
x = [x1 x2].'; p = [a b].'; h = x2; u = [];
f = [-a*x1; a*x1 - b*x2];
ics = [D, 0]; known_ics = [1, 1];
save('chain','x','p','h','f','u','ics','known_ics');
"""


def test_starts_are_used_when_they_are_asked_for() -> None:
    assert [s.start for s in strike_goldd.read(KNOWN).states.values()] == [None, None]
    given = strike_goldd.read(KNOWN, starts="given")
    assert [str(s.start) for s in given.states.values()] == ["D", "0"] and given.constants == {"D": None}
    assert set(statuses(to_toml(given)).values()) == {"observable"}


def test_entries_of_a_vector_are_apart_as_in_matlab() -> None:
    def entries(text: str) -> list[str]:
        system = strike_goldd.read(f"syms a b c\nx = a; p = []; f = 0; h = [{text}];\nsave('m','x','p','f','h');")
        return [str(y) for y in system.outputs.values()]

    assert (
        entries("a b") == ["a", "b"]
        and entries("a -b") == ["a", "-b"]
        and entries("a - b") == ["a - b"]
        and entries("a-b c") == ["a - b", "c"]
    )
    assert entries("a* b, (a + b)*c; a") == ["a*b", "c*(a + b)", "a"] and entries("a\n b") == ["a", "b"] and entries("a.*b./c") == ["a*b/c"]


def test_vectors_are_numbered_chosen_and_filled() -> None:
    text = "x = sym('x', [3 1]);\np = sym('k',[2,1]);\nh = x([3 1]);\nf = [-k1*x(1); k1*x1 - k2*x(2); k2*x2 - 1.5D0*x3];\nics = sym(zeros(1,3)); ics(2) = 4;\nknown_ics = ones(1,3);\nsave('n','x','p','h','f','ics','known_ics');"
    system = strike_goldd.read(text, starts="given")
    assert [str(y) for y in system.outputs.values()] == ["x3", "x1"] and [int(s.start) for s in system.states.values()] == [0, 4, 0]
    assert str(system.states["x3"].rate) == "k2*x2 - 3*x3/2"


def test_what_is_saved_counts() -> None:
    """An input may be a symbol of this name; variables that are not saved are not part of the model."""
    text = "syms x1 a u w v\nx = x1; p = a; f = -a*x1 + u + w + v; h = x1;\nsave('m','x','p','h','f','u','w')\nu = v;\nsave('n','x','p','h','f')"
    first, second = strike_goldd.read(text), strike_goldd.read(text, model="n")
    assert (list(first.known_inputs), list(first.unknown_inputs), list(first.constants)) == (["u"], ["w"], ["v"])
    assert (list(second.known_inputs), list(second.unknown_inputs), list(second.constants)) == ([], [], ["u", "v", "w"])


JULIA = """\
# two models; x'(t) = 1 in a comment is none
using StructuralIdentifiability
first = @ODEmodel(S'(t) = -beta * S(t) * I(t), I'(t) = beta*S(t)*I(t) - gamma*I(t), y(t) = k*I(t))
second = @ODEmodel(
    x1'(t) = -(a01 + a21) * x1(t) + 2a12 * x2(t) + 1//2*u(t), #= a block =#
    x2'(t) = a21*x1(t) - a12 * x2(t),
    y(t) = x1(t)
)
"""


def test_texts_with_several_macros() -> None:
    first, second = sijl.read(JULIA), sijl.read(JULIA, model=2)
    assert (first.name, list(first.states), list(first.parameters)) == ("first", ["S", "I"], ["beta", "gamma", "k"])
    assert statuses(to_toml(first)) == {
        "S": "inseparable",
        "I": "inseparable",
        "k": "inseparable",
        "beta": "inseparable",
        "gamma": "observable",
    }
    assert list(second.known_inputs) == ["u"] and str(second.states["x1"].rate) == "2*a12*x2 + u/2 + x1*(-a01 - a21)"
    assert exporters.to_si_jl(to_toml(second)).count("(1//2)*u(t)") + exporters.to_si_jl(to_toml(second)).count("u(t)*(1//2)") == 1


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ("a*x(t)/b//c", "a*c*x/b"),
        ("1/3//2*x(t)", "2*x/3"),
        ("a/2x(t)", "a/(2*x)"),
        ("a/2(x(t) + 1)", "a/(2*x + 2)"),
        ("2^2x(t)", "2**(2*x)"),
        ("2x(t)^3 - 3(a + b)", "-3*a - 3*b + 2*x**3"),
        ("-2x(t)", "-2*x"),
        ("1_000*x(t) + 0x1F + 1e3x(t) + 2f1", "2000*x + 51"),
        ("pi*x(t)", "pi*x"),
    ],
)
def test_precedence_of_julia(text: str, read: str) -> None:
    """By the table of precedence in the manual of Julia."""
    names = {n: sympy.Symbol(n) for n in ["a", "b", "c", "x", "pi"]}
    rate = sijl.read(f"@ODEmodel(x'(t) = {text}, y(t) = x(t))").states["x"].rate
    assert sympy.simplify(rate - sympy.sympify(read, locals=names)) == 0


def test_parameters_that_cancel_stay() -> None:
    """Parameters that cancel are parameters in StructuralIdentifiability.jl, not identifiable; so is `pi`."""
    system = sijl.read("@ODEmodel(x'(t) = a*x(t)/a + b - b + 0*c + 2e5*u(t)*pi, y(t) = x(t))")
    assert list(system.parameters) == ["a", "b", "c", "pi"] and list(system.known_inputs) == ["u"]
    found = obsdeg.analyze(obsdeg.Model(to_toml(system)))
    assert {q.name for q in found if q.degree is None} == {"a", "b", "c"}


def test_what_stands_beside_a_model_is_noted() -> None:
    system = sijl.read("ode = @ODEmodel(x'(t) = a*x(t), y(t) = x(t))\node = set_parameter_values(ode, Dict(a => 1))")
    assert len(system.notes) == 1 and "set_parameter_values" in system.notes[0]


LINES: list[tuple[Any, str, str, str]] = [
    (strike_goldd.read, "syms a\nx = a;\nfor i = 1:3\n y = a;\nend\nsave('m','x')", "line 3", "`for i = 1:3`"),
    (strike_goldd.read, "syms a\nx = a;\nf = besselj(a, 2);\nsave('m','x')", "line 3", "the function `besselj`"),
    (strike_goldd.read, "syms a b\nx = [a; b];\nf = [1 2; 3 4]*x;\nsave('m','x')", "line 3", "`[1 2; 3 4]*x`"),
    (strike_goldd.read, "syms a b\nx = [a; b];\nf = x + 1;\nsave('m','x')", "line 3", "the vector `x`"),
    (strike_goldd.read, "syms a b\nx = [a; b]; h = a;\nf = a;\nsave('m','x','h','f')", "the vector f", "1 equations for 2 states"),
    (strike_goldd.read, "syms a\nx = a; f = a;\nsave('m','x','f')", "the vector h", "no output"),
    (strike_goldd.read, "syms a\nx = [a; b](3);\nsave('m')", "line 2", "[a; b](3)"),
    (strike_goldd.read, "x = 1", "", "0 models that are saved"),
    (strike_goldd.read, "syms a\nx = a + ;\nsave('m')", "line 2", "`a +`"),
    (sijl.read, "@ODEmodel(\n x'(t) = a*x(t),\n y(t) = foo(x(t))\n)", "line 3", "the function `foo`"),
    (sijl.read, "@ODEmodel(\n x'(t) = a*x(t)*t,\n y(t) = x(t)\n)", "line 2", "the time `t`"),
    (sijl.read, "@ODEmodel(\n x'(t) = a*x(t),\n x'(t) = 1,\n y(t) = x(t)\n)", "line 3", "a second equation of `x`"),
    (sijl.read, "@ODEmodel(\n x' = a*x(t),\n y(t) = x(t)\n)", "line 2", "`x' = a*x(t)`"),
    (sijl.read, "@ODEmodel(\n x'(t) = a*x(t)\n)", "", "no output"),
    (sijl.read, "@ODEmodel(\n x'(t) = a*x(t),\n", "line 3", "the end of the text"),
    (sijl.read, "@DDSmodel(\n x(t + 2) = a*x(t),\n y(t) = x(t)\n)", "line 2", "`x(t + 2) = a*x(t)`"),
    (sijl.read, "@DDSmodel(\n x'(t) = a*x(t),\n y(t) = x(t)\n)", "line 2", "`x'(t) = a*x(t)`"),
    (sijl.read, "@DDSmodel(\n x(t + 1) = t*x(t),\n y(t) = x(t)\n)", "line 2", "the time `t`"),
    (sijl.read, "ode = 1", "", "0 `@ODEmodel(`"),
    (sijl.read, "@ODEmodel(\n 🐁'(t) = a*🐁(t),\n y(t) = 🐁(t)\n)", "line 2", "the sign `🐁`"),
    (sijl.read, "@ODEmodel(\n x'(t) = a*x(t - 1),\n y(t) = x(t)\n)", "line 2", "`x(t - 1)`"),
    (sijl.read, "@ODEmodel(\n x'(t) = a*x(0),\n y(t) = x(t)\n)", "line 2", "`x(0)`"),
    (sijl.read, "@ODEmodel(\n x'(t) = a*y(t),\n y(t) = x(t)\n)", "line 2", "the output `y`"),
    (sympy_system.read, "rates = {x: f(x)}\noutputs = {'y': x}", "line 1", "the function `f`"),
    (sympy_system.read, "import os\nos.remove('x')", "line 2", "`os.remove('x')`"),
    (sympy_system.read, "rates = {x: -x}", "", "no `rates` or no `outputs`"),
    (sympy_system.read, "rates = {", "line 1", "never closed"),
    (exporters.read_model, 'name = "m"\n[states]\n"q[4]" = "q"\n[outputs]\ny = "q[1]"', "q[4]", "the vector `q[4]`"),
    (exporters.to_si_jl, 'name = "m"\n[states]\nx = "-exp(x)"\n[outputs]\ny = "x"', "the equation of x", "`-exp(x)`"),
    (exporters.to_si_jl, 'name = "m"\n[states]\nx = { equation = "-x", initial = "1" }\n[outputs]\ny = "x"', "the start of x", "the start of `x`"),
    (exporters.to_si_jl, 'name = "m"\n[states]\nx = "-w*x"\n[unknown_inputs]\nw = "arbitrary"\n[outputs]\ny = "x"', "", "the unknown input `w`"),
    (exporters.to_sympy, 'name = "m"\nexperiments = 2\n[states]\nx = "-x"\n[outputs]\ny = "x"', "experiments", "2 experiments"),
    (exporters.to_sympy, 'name = "m"\n[states]\nx = "-x"\n[outputs]\ny = "x"\n[[segment]]\n', "[segment]", "segments"),
]  # fmt: skip


@pytest.mark.parametrize(("reader", "text", "place", "construct"), LINES, ids=[str(i) for i in range(len(LINES))])
def test_what_is_not_read_is_refused_by_construct_and_line(reader: Any, text: str, place: str, construct: str) -> None:
    with pytest.raises(ImportProblem) as found:
        reader(text)
    assert found.value.place == place and construct in found.value.construct and found.value.expected


def test_discrete_time(tmp_path: Path) -> None:
    """The epidemic of the tutorial of StructuralIdentifiability.jl, with its Greek letters: read, judged, written
    and read again."""
    text = """dds = @DDSmodel(
        S(t + 1) = S(t) - β * S(t) * I(t),
        I(t + 1) = I(t) + β * S(t) * I(t) - α * I(t),
        R(t + 1) = R(t) + α * I(t),
        y(t) = I(t)
    )"""
    path = tmp_path / "sir.jl"
    path.write_text(text, encoding="utf-8")
    found = obsdeg.analyze(obsdeg.load(path))
    assert found.statuses == {"S": "observable", "I": "observable", "R": "not_excited", "α": "observable", "β": "observable"}
    # I[t+1]/I is 1 + βS - α; of the next quotients one gives β^2 S, the other β
    assert found.degrees == {"S": 3, "I": 0, "R": None, "α": 3, "β": 3}
    assert found.discrete is True and found.equations[0].startswith("S[t+1] = ")
    back = exporters.to_si_jl(to_toml(sijl.load(path)))
    assert "@DDSmodel" in back and statuses(to_toml(sijl.read(back))) == found.statuses
    with pytest.raises(ImportProblem, match="discrete time"):
        exporters.to_sympy(sijl.load(path))


def test_known_constants_are_outputs_of_their_own_elsewhere() -> None:
    model = 'name = "m"\n[constants]\nV = "generic"\n[states]\nx = "-k*x"\n[parameters]\nk = {}\n[outputs]\ny = "x/V"'
    before = statuses(model)
    after = statuses(to_toml(sijl.read(exporters.to_si_jl(model))))
    assert before == {"x": "observable", "k": "observable"} and after == before | {"V": "observable"}


def test_sympy_objects() -> None:
    t, a, b, V = sympy.symbols("t a b V")
    x, y = sympy.Function("x")(t), sympy.Function("y")(t)
    by_equations = sympy_system.system(
        [sympy.Eq(x.diff(t), -a * x + 0.5 * y), sympy.Eq(y.diff(t), -b * y * sympy.exp(-t))],
        {"z": x / V},
        constants={V: 2.5},
        starts={x: 0},
    )
    assert list(by_equations.parameters) == ["a", "b"]
    assert 'x = { equation = "0.5*y - a*x", initial = "0" }' in to_toml(by_equations) and "exp(-t)" in to_toml(by_equations)
    p, q = sympy.symbols("p q")
    by_symbols = sympy_system.system({p: -a * p, q: a * p - b * q}, {"z": q}, parameters=[a, b])
    assert (
        statuses(to_toml(by_symbols)) == dict.fromkeys(["p", "q", "a", "b"], "observable")
        or "inseparable" in statuses(to_toml(by_symbols)).values()
    )
    for wrong, construct in (
        (lambda: sympy_system.system([sympy.Eq(x, a)], {"z": x}), "Eq(x(t), a)"),
        (lambda: sympy_system.system({p: -a * p}, {"z": p}, parameters=[]), "`a`"),
        (lambda: sympy_system.system({p: -a * p}, {}), "no outputs"),
        (lambda: sympy_system.system({p: -a * p}, {"z": p}, starts={q: 1}), "the start of `q`"),
        (lambda: sympy_system.system({p: sympy.gamma(p)}, {"z": p}), "gamma(p)"),
    ):
        with pytest.raises(ImportProblem) as found:
            to_toml(wrong())
        assert construct in str(found.value)


def test_names_that_mean_something_get_others(tmp_path: Path) -> None:
    system = sympy_system.system(
        {sympy.Symbol("exp"): -sympy.Symbol("t") * sympy.Symbol("pi")}, {"y": sympy.Symbol("exp")}, parameters=["t", "pi"]
    )
    text = to_toml(system)
    assert 'exp_ = { equation = "-pi_*t_" }' in text
    assert statuses(text)["exp_"] == "observable"


KINDS = {"model.m": BOLIE, "ode.jl": JULIA, "ode.txt": JULIA, "script.txt": BOLIE, "s.py": "rates = {x: -a*x}\noutputs = {'y': x}\n"}


@pytest.mark.parametrize(("name", "text"), KINDS.items())
def test_load_sees_what_a_file_is(name: str, text: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    found = load(tmp_path / name)
    source = "STRIKE-GOLDD" if "clear" in text else "SI.jl" if "@ODE" in text else "SymPy"
    assert (found.kind, found.source) == ("model", source) and "[states]" in found.text


def test_load_passes_own_files_on() -> None:
    files = sorted((ROOT / "examples").glob("*/*.toml"))
    assert len(files) > 30
    for path in files:
        if "wrong" in path.parent.name:
            continue
        found = load(path)
        assert (found.kind, found.source, found.text) == (
            path.stem if path.stem in ("model", "scheme") else found.kind,
            "obsdeg",
            path.read_text(),
        )
    reference = next((ROOT / "tests" / "data" / "models").glob("*.json"))
    assert load(reference).kind == "model"


def test_load_refuses_what_it_does_not_know(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text("1,2,3")
    with pytest.raises(ImportProblem, match="no known kind") as found:
        load(path)
    again = pickle.loads(pickle.dumps(found.value))
    assert str(again) == str(found.value) and again.file == str(path)
    with pytest.raises(ImportProblem, match="a folder"):
        load(tmp_path)
    (tmp_path / "s.m").write_text(BOLIE)
    with pytest.raises(ImportProblem, match="model_number"):
        load(tmp_path / "s.m", model_number=2)
    with pytest.raises(FileNotFoundError):
        load(tmp_path / "none.xml")


def test_a_package_that_is_missing_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "m.xml"
    path.write_text('<sbml level="3">')
    monkeypatch.setitem(sys.modules, "libsbml", None)
    for module in ("sbml", "sbml_math"):
        monkeypatch.delitem(sys.modules, f"obsdeg.importers.{module}", raising=False)
    with pytest.raises(ImportError, match="SBML is read with the package `python-libsbml`"):
        load(path)


def test_own_files_need_no_package() -> None:
    script = "import sys; sys.path[:0] = sys.argv[1:2]; from obsdeg.importers import load; load(sys.argv[2]); assert not {'sympy', 'libsbml', 'petab'} & sys.modules.keys()"
    scheme = ROOT / "examples" / "six-positions" / "scheme.toml"
    subprocess.run([sys.executable, "-c", script, str(Path(strike_goldd.__file__).parents[2]), str(scheme)], check=True)


def test_petab_problems_say_what_is_missing(tmp_path: Path) -> None:
    source = shared("data/petab") / "Boehm_JProteomeRes2014"
    for file in source.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    problem = tmp_path / "Boehm_JProteomeRes2014.yaml"
    assert load(problem).kind == "model"
    observables = tmp_path / "observables_Boehm_JProteomeRes2014.tsv"
    observables.write_text(observables.read_text().replace("pApB", "pApC"))
    with pytest.raises(ImportProblem, match="pApC") as found:
        load(problem)
    assert found.value.place == "observable pSTAT5A_rel"
    with pytest.raises(ImportProblem, match="numbers=`most`"):
        load(problem, numbers="most")
    (tmp_path / "parameters_Boehm_JProteomeRes2014.tsv").unlink()
    with pytest.raises(ImportProblem, match="petab library refuses"):
        load(problem)

"""The importers count work before doing it: hostile texts are refused at once with a sentence."""

from __future__ import annotations

import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import obsdeg
import pytest
from obsdeg.importers import ImportProblem, load, sijl
from obsdeg.importers.formula import parse, text_of

sympy = pytest.importorskip("sympy")

MATLAB = """syms x1 x2 k
{before}
x=[x1;x2];
p=[k];
h=[x1];
u=[];
w=[];
f=[{rate};-k*x2];
save('m','x','p','h','f','u','w');
"""
JULIA = "ode = @ODEmodel(\n x'(t) = {rate},\n y(t) = x(t)\n)\n"
PYTHON = "rates = {{'x': {rate}}}\noutputs = {{'y': 'x'}}\n"


def doubled(times: int, form: str, end: str = "\n") -> str:
    """Definitions that each use the previous one twice."""
    return end.join(form.format(new=f"a{i + 1}", old=f"a{i}") for i in range(times))


SBML = """<?xml version="1.0" encoding="UTF-8"?>
<sbml xmlns="http://www.sbml.org/sbml/level3/version1/core" level="3" version="1"><model id="m">
{functions}<listOfParameters><parameter id="x" value="1" constant="false"/></listOfParameters>
<listOfRules><rateRule variable="x">
<math xmlns="http://www.w3.org/1998/Math/MathML">{rate}</math>
</rateRule></listOfRules>
</model></sbml>
"""
X = "<ci> x </ci>"


def nested(depth: int) -> str:
    return "<apply><sin/>" * depth + X + "</apply>" * depth


def doubling(times: int) -> str:
    """Functions that each call the previous one twice."""
    math = '<math xmlns="http://www.w3.org/1998/Math/MathML"><lambda><bvar><ci> x </ci></bvar>'
    form = '<functionDefinition id="f{}">' + math + "{}</lambda></math></functionDefinition>"
    out = [form.format(0, "<apply><sin/><ci> x </ci></apply>")]
    for i in range(1, times + 1):
        call = f"<apply><ci> f{i - 1} </ci>{X}</apply>"
        twice = f"<apply><plus/><apply><sin/>{call}</apply><apply><cos/>{call}</apply></apply>"
        out.append(form.format(i, twice))
    return f"<listOfFunctionDefinitions>{''.join(out)}</listOfFunctionDefinitions>"


#: File, expected message, and text.
HOSTILE: dict[str, tuple[str, Callable[[], str]]] = {
    "tower.jl": ("too many digits", lambda: JULIA.format(rate="9^9^9^9*x(t)")),
    "power.jl": ("too many digits", lambda: JULIA.format(rate="2^10000000000*x(t)")),
    "product.jl": ("too many digits", lambda: JULIA.format(rate="(2*x(t))^10000000000")),
    "root.jl": ("too many digits", lambda: JULIA.format(rate="sqrt(2)^10000000000*x(t)")),
    "exp.jl": ("too many digits", lambda: JULIA.format(rate="exp(10000000000*log(2))*x(t)")),
    "literal.jl": ("the number", lambda: JULIA.format(rate="1e999999999*x(t)")),
    "digits.jl": ("the number", lambda: JULIA.format(rate="1" * 5000 + "*x(t)")),
    "brackets.jl": ("brackets in each other", lambda: JULIA.format(rate="(" * 3000 + "x(t)" + ")" * 3000)),
    "powers.jl": ("powers in each other", lambda: JULIA.format(rate="x(t)" + "^x(t)" * 3000)),
    "digits.jl": ("digits", lambda: JULIA.format(rate="1" * 100_000)),
    "long.jl": ("a formula of", lambda: JULIA.format(rate="x(t)" + "+x(t)" * 60_000)),
    "huge.jl": ("more than 50000000 characters", lambda: "#" * 50_000_001),
    "zeros.m": ("100000 x 100000", lambda: MATLAB.format(before="A=zeros(100000,100000);", rate="k")),
    "numbered.m": ("999999999 x 9", lambda: MATLAB.format(before="A=sym('a',[999999999 9]);", rate="k")),
    "doubling.m": (
        "with what it names put in",
        lambda: MATLAB.format(before="a0=x1;\n" + doubled(26, "{new}=sin({old})+cos({old});"), rate="k*a26"),
    ),
    "matrix.m": (
        "in each other",
        lambda: MATLAB.format(before="A=" + "[" * 3000 + "x1" + "]" * 3000 + ";", rate="k*x1"),
    ),
    "tower.py": ("too many digits", lambda: PYTHON.format(rate="9**9**9**9")),
    "brackets.py": ("brackets in each other", lambda: PYTHON.format(rate="(" * 100_000 + "x")),
    "signs.py": ("a text that Python cannot read", lambda: PYTHON.format(rate="-" * 1_000_000 + "x")),
    "apply.xml": ("in each other", lambda: SBML.format(functions="", rate=nested(900))),
    "apply3000.xml": ("elements in each other", lambda: SBML.format(functions="", rate=nested(3000))),
    "apply100000.xml": ("elements in each other", lambda: SBML.format(functions="", rate=nested(100_000))),
    "functions.xml": (
        "the function f15: found a formula of more than 100000 operations",
        lambda: SBML.format(functions=doubling(26), rate=f"<apply><ci> f26 </ci>{X}</apply>"),
    ),
    "entities.xml": (
        "the entity",
        lambda: '<?xml version="1.0"?><!DOCTYPE sbml [<!ENTITY a "aaaaaaaaaa">]>' + SBML.partition("?>")[2],
    ),
    "alias.yaml": ("an alias", lambda: "format_version: 1\na: &a [1, 1]\nb: [*a, *a]\n"),
    "deep.yaml": ("in each other", lambda: "format_version: 1\na: " + "[" * 3000 + "]" * 3000 + "\n"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_texts_end_in_a_sentence(tmp_path: Path, name: str) -> None:
    match, text = HOSTILE[name]
    if name.endswith(".xml"):
        pytest.importorskip("libsbml")
    if name.endswith(".yaml"):
        pytest.importorskip("petab")
    file = tmp_path / name
    file.write_text(text(), encoding="utf-8")
    options: dict[str, Any] = {"outputs": {"y": "x"}} if name.endswith(".xml") else {}
    begin = time.process_time()
    with pytest.raises(ImportProblem, match=match) as caught:
        load(file, **options)
    assert time.process_time() - begin < 5
    assert len(str(caught.value)) < 500 and str(file) in str(caught.value)


def test_what_is_within_the_limits_is_read(tmp_path: Path) -> None:
    long = parse("+".join(f"{i}*k{i % 50}*x1*x2" for i in range(2000)))
    x1, x2, *k = sympy.symbols("x1 x2 k:50")
    assert long == sympy.Add(*(sum(range(i, 2000, 50)) * k[i] * x1 * x2 for i in range(50)))
    deep = "sin(" * 100 + "x" + ")" * 100
    assert text_of(parse(deep)) == deep
    file = tmp_path / "doubling.m"
    doubling = "a0=x1;\n" + doubled(8, "{new}=sin({old})+cos({old});")
    file.write_text(MATLAB.format(before=doubling, rate="k*a8"))
    assert load(file).text.count("sin") >= 255
    assert sijl.read(JULIA.format(rate="1e5*x(t) + 2e1k")).states["x"].rate == parse("100000*x + 20*k")
    assert parse("2^100") == 2**100 and parse("x^10000000000") == sympy.Symbol("x") ** 10000000000


def test_devices_without_an_end_are_refused() -> None:
    if not Path("/dev/zero").exists():
        pytest.skip("no /dev/zero")
    for ask in (obsdeg.analyze, obsdeg.simulate, obsdeg.load, obsdeg.Scheme.read, obsdeg.Model.read):
        with pytest.raises(ValueError, match="/dev/zero: found more than 50000000 characters"):
            ask("/dev/zero")
    # the device's endless output did not grow the memory of this process
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < 2_000_000


def test_texts_of_sympy_are_read_and_never_run(tmp_path: Path) -> None:
    from obsdeg.importers import sympy_system

    mark = tmp_path / "mark"
    hostile = f"__import__('pathlib').Path({str(mark)!r}).touch() or x"
    for rates, outputs, more in [
        ({"x": hostile}, {"y": "x"}, {}),
        ({hostile: "-x"}, {"y": "x"}, {}),
        ({"x": "-x"}, {"y": hostile}, {}),
        ({"x": "-x"}, {"y": "x"}, {"starts": {"x": hostile}}),
        ({"x": "-x"}, {"y": "x"}, {"constants": {"c": hostile}}),
        ({"x": "().__class__.__base__.__subclasses__()"}, {"y": "x"}, {}),
    ]:
        try:
            sympy_system.system(rates, outputs, **more)
        except ImportProblem as problem:
            assert "found" in str(problem)
        assert not mark.exists()
    known: dict[str, Any] = {"starts": {"x": "known"}, "constants": {"a": None}}
    system = sympy_system.system({"x": "-a*x + 1/3"}, {"y": "2*x"}, **known)
    x, a = sympy.symbols("x a")
    assert system.states["x"].rate == -a * x + sympy.Rational(1, 3) and system.outputs == {"y": 2 * x}

    class Text:
        def __str__(self) -> str:
            return hostile

    with pytest.raises(ImportProblem, match="found Text"):
        sympy_system.system({"x": Text()}, {"y": "x"})
    assert not mark.exists()


def test_parts_in_common_are_counted_as_often_as_they_stand() -> None:
    """40 nested sums of a term with its own square: 2**40 operations of 40 objects."""
    x = sympy.Symbol("x")
    doubled, nested = x, x
    for _ in range(40):
        doubled = sympy.Add(doubled, sympy.Mul(doubled, doubled, evaluate=False), evaluate=False)
    for _ in range(300):
        nested = sympy.sin(nested)
    for expression, message in ((doubled, "a formula of more than 100000 operations"), (nested, "a formula with 300 operations in each other")):
        for states, outputs in (({"x": expression}, {"y": x}), ({"x": x}, {"y": expression})):
            with pytest.raises(ImportProblem, match=message):
                obsdeg.Model(states=states, outputs=outputs)


def test_powers_that_are_not_evaluated_are_held() -> None:
    x = sympy.Symbol("x")
    # SymPy would evaluate the number; here nothing is evaluated
    power = sympy.Pow(2, 10**9, evaluate=False)
    nested = sympy.Pow(sympy.Pow(3, 10**5, evaluate=False), 10**5, evaluate=False)
    for expression in (power, sympy.Mul(power, x, evaluate=False), sympy.Add(nested, x, evaluate=False)):
        with pytest.raises(ImportProblem, match="a power that is a number of too many digits"):
            obsdeg.Model(states={"x": expression}, outputs={"y": x})
    small = obsdeg.Model(states={"x": sympy.Pow(2, 10, evaluate=False) * x}, outputs={"y": x})
    assert "1024" in str(small.text)


def test_a_bar_without_tqdm_says_what_to_install() -> None:
    script = (
        "import sys; sys.modules['tqdm'] = sys.modules['tqdm.auto'] = None\n"
        "import obsdeg\n"
        "try: obsdeg.design(4, carry='inertial', progress=True)\n"
        "except ImportError as e: print(e)\n"
    )
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    said = "progress=True draws a bar with the package `tqdm`, which is not installed"
    assert done.stdout.strip() == f"{said}: pip install 'obsdeg[progress]', or give a function"


def test_what_is_quoted_does_not_steer_a_terminal(tmp_path: Path) -> None:
    file = tmp_path / "\x1b[31m.jl"
    file.write_text(JULIA.format(rate="x(t) \x1b\u202e \x07 y"))
    for raised in (lambda: parse("x \x1b\u202e\x00 y"), lambda: load(file)):
        with pytest.raises(ImportProblem) as problem:
            raised()
        said = str(problem.value)
        assert said.isprintable() and "\\x1b\\u202e" in said, said


def test_a_system_of_too_many_equations_is_refused(tmp_path: Path) -> None:
    """More equations than the program accepts states are counted before any is read."""
    file = tmp_path / "chain.jl"
    chain = [f" x{i}'(t) = x{i + 1}(t)," for i in range(20_000)]
    file.write_text("\n".join(["ode = @ODEmodel(", *chain, " x20000'(t) = x0(t),", " y(t) = x0(t)", ")"]))
    begun = time.process_time()
    with pytest.raises(ImportProblem, match="20002 equations; expected at most 4000"):
        load(file)
    assert time.process_time() - begun < 5

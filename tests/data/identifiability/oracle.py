"""Numbers of solutions of random small systems, by Groebner bases of SymPy: written to counts.json.

A system has two states, one to three parameters and one or two outputs, all polynomials with small
coefficients. At a random point the derivatives of the outputs are numbers. Equating them to these numbers
gives a system of equations modulo a prime. Its lexicographic basis with an unknown last contains a polynomial
in this unknown alone. The distinct roots of this polynomial are the values of the unknown. Systems without
full rank, and those that exceed a time limit, are omitted. `python oracle.py N` writes N systems;
`python oracle.py N conserved` writes N to conserved.json whose states have a constant sum (first integral).
"""

from __future__ import annotations

import json
import random
import signal
import sys
from pathlib import Path

import sympy
from sympy import GF, Poly, groebner, symbols

PRIME = 2147483629
SECONDS = 10


def drawn(rng: random.Random, conserved: bool) -> dict[str, list[str]]:
    parameters = [f"p{i}" for i in range(rng.choice([1, 1, 2, 2, 3]))]
    factors = ["x1", "x2", *parameters]

    def polynomial(terms: int, degree: int) -> str:
        text = []
        for _ in range(terms):
            product = [rng.choice(factors) for _ in range(rng.randint(1, degree))]
            text.append("*".join([str(rng.choice([-2, -1, 1, 1, 2, 3])), *product]))
        return " + ".join(text)

    outputs = [rng.choice(["x1", "x1^2", "x1*x2", "x1 + x2", "x1^2 + x2", polynomial(2, 2)])]
    if rng.random() < 0.3:
        outputs.append(polynomial(rng.randint(1, 2), 2))
    rates = [polynomial(rng.randint(1, 3), 2), polynomial(rng.randint(1, 3), 2)]
    if conserved:
        rates[1] = f"-1*({rates[0]})"
    return {"parameters": parameters, "rates": rates, "outputs": outputs}


def counted(system: dict[str, list[str]], rng: random.Random) -> dict[str, int] | None:
    """Number of values of every unknown; None if the rank is not full."""
    unknowns = symbols(["x1", "x2", *system["parameters"]])
    read = {str(u): u for u in unknowns}
    rates = [sympy.sympify(r.replace("^", "**"), locals=read) for r in system["rates"]]
    derivatives = [sympy.sympify(o.replace("^", "**"), locals=read) for o in system["outputs"]]
    point = {u: rng.randrange(1, PRIME) for u in unknowns}
    equations, rows = [], []
    for _ in range(len(unknowns) + 2):
        for d in derivatives:
            value = Poly(d, *unknowns, domain=GF(PRIME)).eval(tuple(point.values()))
            equations.append(sympy.expand(d - int(value)))
            row = [Poly(d.diff(u), *unknowns, domain=GF(PRIME)).eval(tuple(point.values())) for u in unknowns]
            rows.append([int(x) for x in row])
        derivatives = [sympy.expand(sum(d.diff(x) * r for x, r in zip(unknowns, rates))) for d in derivatives]
    if rank(rows) < len(unknowns):
        return None
    out = {}
    first = groebner(equations, *unknowns, order="grevlex", modulus=PRIME)
    for unknown in unknowns:
        others = [u for u in unknowns if u != unknown]
        basis = groebner(first.exprs, *others, unknown, order="lex", modulus=PRIME)
        alone = [e for e in basis.exprs if e.free_symbols == {unknown}]
        roots = Poly(alone[-1], unknown, modulus=PRIME)
        out[str(unknown)] = roots.quo(roots.gcd(roots.diff(unknown))).degree()
    return out


def rank(rows: list[list[int]]) -> int:
    rows, found = [list(r) for r in rows], 0
    for column in range(len(rows[0])):
        pivot = next((i for i in range(found, len(rows)) if rows[i][column] % PRIME), None)
        if pivot is None:
            continue
        rows[found], rows[pivot] = rows[pivot], rows[found]
        inverse = pow(rows[found][column], -1, PRIME)
        for i in range(found + 1, len(rows)):
            factor = rows[i][column] * inverse
            rows[i] = [(a - factor * b) % PRIME for a, b in zip(rows[i], rows[found])]
        found += 1
    return found


class TooLong(Exception):
    """Raised when the time limit is exceeded."""


def ended(*_: object) -> None:
    raise TooLong


def main() -> None:
    conserved = "conserved" in sys.argv
    rng = random.Random(39 if conserved else 38)
    signal.signal(signal.SIGALRM, ended)
    out: list[dict[str, object]] = []
    while len(out) < int(sys.argv[1]):
        system = drawn(rng, conserved)
        try:
            signal.alarm(SECONDS)
            numbers = counted(system, rng)
        except (TooLong, IndexError):
            continue
        finally:
            signal.alarm(0)
        # one in three of those with a single solution only
        if numbers and (max(numbers.values()) > 1 or rng.random() < 0.34):
            out.append({**system, "numbers": numbers})
            print(len(out), numbers, file=sys.stderr, flush=True)
    lines = ",\n".join(json.dumps(o) for o in out)
    Path(__file__).with_name("conserved.json" if conserved else "counts.json").write_text(f"[\n{lines}\n]\n")


main()

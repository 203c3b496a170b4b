#!/usr/bin/env python3
"""Checks a certificate of obsdeg (book/src/certificate.md) with the standard library alone.

    verify_certificate.py CERTIFICATE.json [SCHEME.toml]

Certificates of models need verify_model_certificate.py beside this file, those of optima verify_optimum_certificate.py.

One sentence per unknown. Exit codes: 0 accepted, 1 refused, 2 not readable or bad usage.
"""

import hashlib
import json
import math
import re
import sys
import tomllib
from decimal import Decimal
from fractions import Fraction
from itertools import product

GRAVITY = ["F", "I", "O", "S", "II", "OO", "SS", "IO", "IS", "OS"]
RATE = ["GS", "GM", "GM3"]
FORCE = ["K0", "K1", "M6", "M3", "K2", "K3", "Kx"]
ORDERS = 4  # F^4 = -(wN^2 + wU^2) F^2: rows of orders 0 to 3 suffice
TURN = 360 * 10**9
SENSORS = "XYZ"
NEGATIVE_POWERS = (-9, 9)


class Refused(Exception):
    """Raised if a certificate is not accepted; its text is the reason."""


class Unreadable(Refused):
    """Raised if nothing can be judged: a scheme file that is not TOML."""


def need(holds, place, says, found):
    if not holds:
        raise Refused(f"{place}: {says}; {found}")


def same(place, certificate, found):
    need(plain(certificate) == plain(found), place, f"the certificate says {text(certificate)}", f"found {text(found)}")


def plain(value):
    return json.dumps(value, default=str, sort_keys=True)


def text(value):
    shown = plain(value)
    return shown if len(shown) < 120 else shown[:117] + "..."


def keys(place, value, expected):
    need(isinstance(value, dict), place, "expected an object", f"found {text(value)}")
    need(sorted(value) == sorted(expected), place, f"expected the keys {sorted(expected)}", f"found {text(sorted(value))}")
    return [value[k] for k in expected]


def listed(place, value, most, least=0):
    need(isinstance(value, list), place, "expected a list", f"found {text(value)}")
    need(least <= len(value) <= most, place, f"expected {least} to {most} entries", f"found {len(value)}")
    return value


def integer(place, value, low, high):
    need(type(value) is int and low <= value <= high, place, f"expected an integer from {low} to {high}", f"found {text(value)}")
    return value


def nanodeg(place, value):
    form = isinstance(value, str) and re.fullmatch(r"-?(0|[1-9]\d{0,6})(\.\d{0,8}[1-9])?", value, re.ASCII)
    need(form and value != "-0", place, "expected a decimal of degrees as text", f"found {text(value)}")
    result = int(Decimal(value) * 10**9)
    need(abs(result) <= 10**15, place, "expected at most 1000000 in magnitude", f"found {text(value)}")
    return result


def axis(place, value):
    need(isinstance(value, str) and re.fullmatch("[+-][xyz]", value), place, "expected an axis such as +x", f"found {text(value)}")
    return "xyz".index(value[1]), -1 if value[0] == "-" else 1


class Number:
    """A sum of p/q sqrt(r) wN^a wU^b: {(r, a, b): p/q} without zeros."""

    def __init__(self, terms):
        self.terms = {k: v for k, v in terms.items() if v}

    @staticmethod
    def read(place, value, pole, equator):
        terms = {}
        for term in listed(place, value, 400):
            p, q, r, a, b = listed(place, term, 5, 5)
            integer(place, p, -(2**31) + 1, 2**31 - 1)
            integer(place, q, 1, 2**31 - 1)
            need(type(r) is int and r in (1, 2, 3, 6), place, "expected a root 1, 2, 3 or 6", f"found {text(r)}")
            for power in (a, b):
                integer(place, power, *NEGATIVE_POWERS)
            need(p != 0 and math.gcd(p, q) == 1, place, "expected a fraction in lowest terms", f"found {p}/{q}")
            need((r, a, b) not in terms, place, "expected every power once", f"found {text(term)} again")
            need(not (pole and a) and not (equator and b), place, "expected no power of a rate that is 0", f"found {text(term)}")
            terms[r, a, b] = Fraction(p, q)
        return Number(terms)

    def __add__(self, other):
        terms = dict(self.terms)
        for k, v in other.terms.items():
            terms[k] = terms.get(k, 0) + v
        return Number(terms)

    def __neg__(self):
        return Number({k: -v for k, v in self.terms.items()})

    def __mul__(self, other):
        terms = {}
        for (r, a, b), v in self.terms.items():
            for (s, c, d), w in other.terms.items():
                g = math.gcd(r, s)
                k = r * s // g**2, a + c, b + d
                terms[k] = terms.get(k, 0) + v * w * g
        return Number(terms)

    def __bool__(self):
        return bool(self.terms)


class Problem:
    """Scheme of a certificate, parsed and checked."""

    def __init__(self, value):
        names = ["carry", "latitude_deg", "measured_azimuth", "terms", "gyros", "accelerometers", "positions", "slews"]
        self.carry, latitude, self.azimuth, self.terms, gyros, accelerometers, positions, slews = keys("problem", value, names)
        need(self.carry in ("platform", "inertial", "reset"), "problem.carry", "expected a carry", f"found {text(self.carry)}")
        need(type(self.azimuth) is bool, "problem.measured_azimuth", "expected true or false", f"found {text(self.azimuth)}")
        order = GRAVITY + RATE + FORCE
        listed("problem.terms", self.terms, len(order), 1)
        known = all(isinstance(t, str) and t in order for t in self.terms)
        need(known and self.terms == [t for t in order if t in self.terms], "problem.terms", f"expected some of {order} in this order", f"found {text(self.terms)}")
        for both in ({"M3", "M6"}, {"GM", "GM3"}):
            need(not both <= set(self.terms), "problem.terms", f"expected one of {sorted(both)}", "found both")
        self.latitude_deg = latitude
        self.latitude = None if latitude is None else nanodeg("problem.latitude_deg", latitude)
        need(abs(self.latitude or 0) <= TURN // 4, "problem.latitude_deg", "expected -90 to 90", f"found {text(latitude)}")
        self.pole = self.latitude is not None and abs(self.latitude) == TURN // 4
        self.equator = self.latitude == 0
        self.gyros = []
        for i, gyro in enumerate(listed("problem.gyros", gyros, 3, 3)):
            place = f"problem.gyros.{i}"
            axes = [axis(place, a) for a in keys(place, gyro, "IOS")]
            (i1, si), (i2, so), (i3, ss) = axes
            right = len({i1, i2, i3}) == 3 and si * so * (1 if (i2 - i1) % 3 == 1 else -1) == ss
            need(right, place, "expected I x O = S", f"found {text(gyro)}")
            self.gyros.append(axes)
        self.inputs = [axis(f"problem.accelerometers.{i}", a) for i, a in enumerate(listed("problem.accelerometers", accelerometers, 3, 3))]
        for place, inputs in (("gyros", [g[0] for g in self.gyros]), ("accelerometers", self.inputs)):
            need(len({a for a, _ in inputs}) == 3, f"problem.{place}", "expected three different input axes", "found one twice")
        self.positions = []
        for i, angles in enumerate(listed("problem.positions", positions, 1000, 1)):
            place = f"problem.positions.{i}"
            self.positions.append([nanodeg(place, a) for a in listed(place, angles, 3, 3)])
        self.names = [f"psi_{a}" for a in "xyz"]
        if self.carry == "reset":
            self.names = [f"{n}@{i + 1}" for i in range(len(self.positions)) for n in self.names]
        self.psi = len(self.names)
        # per coefficient: (terms of its kind, input axis, axes of the factors)
        self.coefficients = []
        for term in self.terms:
            for name, coefficient in self.of_term(term):
                self.names.append(name)
                self.coefficients.append(coefficient)
        self.force = any(t in FORCE for t in self.terms)
        need(len(self.names) <= 300, "problem", "expected at most 300 unknowns", f"found {len(self.names)}")
        act = self.carry == "inertial" and len(self.positions) > 1 and any(t in RATE for t in self.terms)
        need((slews is not None) == act, "problem.slews", f"expected {'a list' if act else 'null'}", f"found {text(slews)}")
        self.slews = self.read_slews(slews) if act else None

    def read_slews(self, slews):
        """Slews to each position: axes and angles."""
        n, out = len(self.positions), []
        for i, turns in enumerate(listed("problem.slews", slews, n, n)):
            place = f"problem.slews.{i}"
            out.append([])
            for turn in listed(place, turns, 3 if i else 0):
                about, angle = keys(place, turn, ["about", "angle_deg"])
                if isinstance(about, list):
                    about = [Number.read(place, x, self.pole, self.equator) for x in listed(place, about, 3, 3)]
                    need(not any(a or b for x in about for _, a, b in x.terms), place, "expected numbers without rates", "found a rate")
                else:
                    need(about in (None, "X_p", "Y_p", "Z_p", "N", "U", "E", "middle"), place, "expected an axis", f"found {text(about)}")
                    need(about is not None or len(turns) == 1, place, "expected an axis where there are several turns", "found null")
                out[-1].append((about, nanodeg(place, angle)))
        return out

    def of_term(self, term):
        if term in GRAVITY:
            for letter, gyro in zip(SENSORS, self.gyros):
                factors = [] if term == "F" else [gyro["IOS".index(a)] for a in term]
                yield f"D_{term}{letter}", ("gravity", gyro[0], factors)
        elif term in ("K0", "K1", "K2", "K3"):
            for letter, own in zip(SENSORS, self.inputs):
                yield f"{term}_{letter}", ("force", own, [own] * int(term[1]))
        elif term == "GS":
            for letter, gyro in zip(SENSORS, self.gyros):
                yield f"GS_{letter}", ("rate", gyro[0], [gyro[0]])
        else:
            kind, inputs = ("force", self.inputs) if term in FORCE else ("rate", [g[0] for g in self.gyros])
            family = {"M6": "M", "M3": "M", "GM3": "GM"}.get(term, term)
            for i, j in product(range(3), range(3)):
                if j < i or (j > i and term not in ("M3", "GM3")):
                    factors = [inputs[i], inputs[j]] if term == "Kx" else [inputs[j]]
                    yield f"{family}_{SENSORS[i]}{SENSORS[j]}", (kind, inputs[i], factors)

    def components(self):
        return [1] + [2] * self.force + [3] + [4] * self.azimuth

    def list_rows(self):
        n = len(self.positions)
        return [(i + 1, k, c) for k in range(ORDERS) for i in range(n) for c in self.components()]

    def rows(self, cos_sin, zero, one, w_n, w_u, left=None):
        """All rows in the listed order, in the arithmetic of the arguments; `left` gives the effect of slews
        on psi."""

        def dot(a, b):
            total = zero
            for x, y in zip(a, b):
                if x and y:
                    total = total + x * y
            return total

        def times(a, b):
            return [[dot(row, column) for column in zip(*b)] for row in a]

        def matrix(angles):
            (ca, sa), (cb, sb), (cg, sg) = map(cos_sin, angles)
            x = [[one, zero, zero], [zero, ca, sa], [zero, -sa, ca]]
            y = [[cb, zero, -sb], [zero, one, zero], [sb, zero, cb]]
            z = [[cg, sg, zero], [-sg, cg, zero], [zero, zero, one]]
            return times(times(x, y), z)

        attitudes = [matrix(angles) for angles in self.positions]
        n, minus_one = len(self.names), -one
        torqued = left(self, attitudes) if self.slews else None
        local = []  # per position the nine local quantities as rows over the unknowns
        for i, c in enumerate(attitudes):
            s = [[zero] * n for _ in range(9)]
            carried = attitudes[0] if self.carry == "inertial" else c
            first = 3 * i if self.carry == "reset" else 0
            for r in range(3):
                s[r][first : first + 3] = carried[r]
            force = c[1]
            rate = [c[0][j] * w_n + c[1][j] * w_u for j in range(3)]
            of = {"gravity": [-x for x in force], "force": force, "rate": rate}
            for k, (kind, (j, sign), factors) in enumerate(self.coefficients):
                e = one
                for a, factor_sign in factors:
                    e = e * (of[kind][a] if factor_sign > 0 else -of[kind][a])
                for r in range(3):
                    s[(6 if kind == "force" else 3) + r][self.psi + k] = c[r][j] * (e if sign > 0 else -e)
                    if torqued:
                        s[r][self.psi + k] = torqued[i][r][k]
            local.append(s)
        f = [[zero] * 9 for _ in range(9)]
        f[0][2], f[1][2], f[2][0], f[2][1] = -w_u, w_n, w_u, -w_n
        f[0][3] = f[1][4] = f[2][5] = one
        outputs = {1: {2: one, 6: one}, 2: {7: one}, 3: {0: minus_one, 8: one}, 4: {1: one}}
        measured = {c: [[outputs[c].get(j, zero) for j in range(9)]] for c in self.components()}
        for chain in measured.values():
            for _ in range(1, ORDERS):
                chain.append([dot(chain[-1], column) for column in zip(*f)])
        out = []
        for i, k, c in self.list_rows():
            functional = [(x, row) for x, row in zip(measured[c][k], local[i - 1]) if x]
            row = [zero] * n
            for x, entries in functional:
                for column, y in enumerate(entries):
                    if y:
                        row[column] = row[column] + x * y
            out.append(row)
        return out


class Randomness:
    """Numbers that the author of a certificate cannot choose: SHA-256 of the certificate, with a counter."""

    def __init__(self, data):
        self.seed, self.count = hashlib.sha256(data).digest(), 0

    def below(self, m):
        block = hashlib.sha256(self.seed + self.count.to_bytes(8, "big")).digest()
        self.count += 1
        return int.from_bytes(block[:8], "big") % m


def is_prime(n):
    small = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37]
    if any(n % q == 0 for q in small):
        return n in small
    s = ((n - 1) & (1 - n)).bit_length() - 1
    for base in small:
        x = pow(base, (n - 1) >> s, n)
        if x not in (1, n - 1) and not any((x := x * x % n) == n - 1 for _ in range(s - 1)):
            return False
    return True


def order_of(problem):
    angles = [a for p in problem.positions for a in p]
    angles += [angle for turns in problem.slews or [] for _, angle in turns]
    return TURN // math.gcd(15 * 10**9, problem.latitude or 0, *angles)


class PrimeField:
    """Random prime p = 1 mod N with a random root of unity and random rates."""

    def __init__(self, problem, random):
        n = self.n = order_of(problem)
        while True:
            self.p = 1 + n * (2**60 // n + 1 + random.below(2**60 // n - 1))
            if is_prime(self.p):
                break
        while True:
            self.z = pow(2 + random.below(self.p - 2), (self.p - 1) // n, self.p)
            if all(pow(self.z, n // q, self.p) != 1 for q in (2, 3, 5) if n % q == 0):
                break
        self.w_n, self.w_u, self.pi = (1 + random.below(self.p - 1) for _ in range(3))
        if problem.latitude is not None:
            c, s = self.cos_sin(problem.latitude)
            self.w_n, self.w_u = self.w_n * c % self.p, self.w_n * s % self.p
        self.two = (self.root(8) + self.root(-8)) % self.p
        self.three = (self.root(12) + self.root(-12)) % self.p

    def root(self, part):
        return pow(self.z, self.n // part, self.p)

    def cos_sin(self, angle):
        z = pow(self.z, angle % TURN * self.n // TURN, self.p)
        back, half = pow(z, -1, self.p), (self.p + 1) // 2
        return (z + back) * half % self.p, (z - back) * half * self.root(-4) % self.p

    def image(self, number):
        roots = {1: 1, 2: self.two, 3: self.three, 6: self.two * self.three}
        total = 0
        for (r, a, b), q in number.terms.items():
            rates = pow(self.w_n, a, self.p) * pow(self.w_u, b, self.p)
            total += q.numerator * pow(q.denominator, -1, self.p) * roots[r] * rates
        return total % self.p

    def rows(self, problem):
        rows = problem.rows(self.cos_sin, 0, 1, self.w_n, self.w_u, self.left)
        return [(triple, [x % self.p for x in row]) for triple, row in zip(problem.list_rows(), rows)]

    def left(self, problem, attitudes):
        """Effect of the torquer errors on psi^n in the slews to each position: 3 rows, one column per
        coefficient."""
        p = self.p
        total, out = [[0] * len(problem.coefficients) for _ in range(3)], []

        def times(a, b):
            return [[sum(x * y for x, y in zip(row, column)) % p for column in zip(*b)] for row in a]

        for i, turns in enumerate(problem.slews):
            a = attitudes[i - 1] if i else attitudes[0]
            for about, angle in turns:
                place = f"problem.slews.{i}"
                c, s = self.cos_sin(angle)
                back = [list(row) for row in zip(*a)]
                if about is None:
                    need(s, place, "expected an axis at a half turn", "found null")
                    r, half = times(attitudes[i], back), pow(2 * s, -1, p)
                    v = [(r[2][1] - r[1][2]) * half, (r[0][2] - r[2][0]) * half, (r[1][0] - r[0][1]) * half]
                elif isinstance(about, list):
                    v = [self.image(x) for x in about]
                elif about == "middle":
                    cg, sg = self.cos_sin(problem.positions[i - 1][2])
                    v = [-sg, cg, 0]
                else:
                    v = [int(about[0] in pair) for pair in ("XN", "YU", "ZE")]
                in_c = about in ("X_p", "Y_p", "Z_p", "middle")
                u = v if in_c else [row[0] for row in times(back, [[x] for x in v])]
                need(sum(x * x for x in u) % p == 1, place, "expected an axis of length 1 and a turn between the attitudes", "found another")
                cross = [[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]]
                phi = self.pi * angle * pow(TURN // 2, -1, p) % p

                def mixed(unit, skew, outer):
                    return [[unit * (j == k) + skew * cross[j][k] + outer * u[j] * u[k] for k in range(3)] for j in range(3)]

                e = [[0] * len(problem.coefficients) for _ in range(3)]
                for k, (kind, (j, sign), factors) in enumerate(problem.coefficients):
                    if kind == "rate":
                        (axis_, factor_sign), = factors
                        e[j][k] = sign * factor_sign * u[axis_]
                jump = times(times(a, mixed(s, 1 - c, phi - s)), e)
                total = [[(x + y) % p for x, y in zip(*rows)] for rows in zip(total, jump)]
                a = times(a, mixed(c, s, 1 - c))
            arrived = all((x - y) % p == 0 for rows in zip(a, attitudes[i]) for x, y in zip(*rows))
            need(arrived, f"problem.slews.{i}", "expected turns that lead to the position", "they lead elsewhere")
            out.append(total)
        return out


def judge(p, names, rows, functionals):
    """Basis, ranks, and status, degree and witness of each functional, from rows (segment, order, component;
    entries) modulo a prime."""
    n = len(names)
    found = [{"degree": None, "solution": None, "hidden_by": None, "excited_by": None} for _ in functionals]
    # reduced echelon form; the columns after n express each row by the basis rows
    basis, reduced, ranks = [], {}, []
    for k in range(1 + max((triple[1] for triple, _ in rows), default=0)):
        for triple, row in rows:
            if triple[1] != k:
                continue
            v = row + [0] * n
            if len(basis) < n:
                v[n + len(basis)] = 1
            for pivot, e in reduced.items():
                if factor := v[pivot]:
                    v = [(x - factor * y) % p if y else x for x, y in zip(v, e)]
            pivot = next((j for j in range(n) if v[j]), None)
            if pivot is None:
                continue
            scale = pow(v[pivot], -1, p)
            v = [x * scale % p for x in v]
            for other, e in reduced.items():
                if factor := e[pivot]:
                    reduced[other] = [(x - factor * y) % p if y else x for x, y in zip(e, v)]
            reduced[pivot] = v
            basis.append([*triple, names[pivot]])
        ranks.append(len(basis))
        for c, verdict in zip(functionals, found):
            if verdict["degree"] is not None:
                continue
            made = [0] * n + [0] * n
            for j, x in c.items():
                made[j] += x
            for j, x in c.items():
                if j in reduced:
                    made = [(a - x * e) % p for a, e in zip(made, reduced[j])]
            rest = next((j for j in range(n) if made[j] % p), None)
            if rest is None:
                verdict["degree"] = k
                verdict["solution"] = [basis[j][:3] for j in range(len(basis)) if made[n + j]]
            else:
                verdict["hidden_by"] = names[rest]
    ranks = ranks[: ranks.index(ranks[-1]) + 1]
    for c, verdict in zip(functionals, found):
        excited = next((list(t) for t, row in rows if any(row[j] for j in c)), None)
        observable = verdict["degree"] is not None
        verdict["status"] = "observable" if observable else "inseparable" if excited else "not_excited"
        verdict["excited_by"] = None if observable else excited
    return basis, ranks, found


def exact_cos_sin(angle):
    step = 15 * 10**9
    need(angle % step == 0, "kind", "exact", "an angle is no multiple of 15 degrees")
    quarter = {(1, 0, 0): Fraction(1, 4)}
    half, both = Fraction(1, 2), {(6, 0, 0): Fraction(1, 4), (2, 0, 0): Fraction(1, 4)}
    sines = [{}, {(6, 0, 0): Fraction(1, 4), (2, 0, 0): -Fraction(1, 4)}, {(1, 0, 0): half}, {(2, 0, 0): half}]
    sines += [{(3, 0, 0): half}, both, {(1, 0, 0): quarter[1, 0, 0] * 4}]

    def sine(m):
        m %= 24
        return -sine(m - 12) if m >= 12 else Number(sines[min(m, 12 - m)])

    return sine(angle // step + 6), sine(angle // step)


class Exact:
    """Rows in exact arithmetic."""

    def __init__(self, problem):
        zero, one = Number({}), Number({(1, 0, 0): Fraction(1)})
        w_n = zero if problem.pole else Number({(1, 1, 0): Fraction(1)})
        w_u = zero if problem.equator else Number({(1, 0, 1): Fraction(1)})
        rows = problem.rows(exact_cos_sin, zero, one, w_n, w_u)
        sparse = [{name: x for name, x in zip(problem.names, row) if x} for row in rows]
        self.problem, self.zero, self.rows = problem, zero, dict(zip(problem.list_rows(), sparse))

    def null_vectors(self, certificate, basis, ranks):
        """Checks that all rows up to the order of each listed vector map it to zero."""
        names = self.problem.names
        orders = listed("null_vectors", certificate, len(ranks), len(ranks))
        for k, vectors in enumerate(orders):
            pivots = {row[3] for row in basis[: ranks[k]]}
            free = [n for n in names if n not in pivots]
            last = ORDERS - 1 if k == len(ranks) - 1 else k
            for f, vector in zip(free, listed(f"null_vectors.{k}", vectors, len(free), len(free))):
                place = f"null_vectors.{k}.{f}"
                vector = read_functional(place, vector, self.problem)
                need(vector.get(f) and vector[f].terms == {(1, 0, 0): 1}, place, "expected the entry 1 at its free unknown", "found another")
                need(all(n == f or n in pivots for n in vector), place, "expected no entry at other free unknowns", "found one")
                for (i, order, c), row in self.rows.items():
                    if order <= last:
                        total = self.zero
                        for name, x in vector.items():
                            if name in row:
                                total = total + x * row[name]
                        need(not total, place, f"row ({i}, {order}, {c}) must take it to 0", "it does not")

    def solution(self, place, functional, rows, coefficients):
        """Checks that the coefficients times the rows equal the functional."""
        total = {name: -x for name, x in functional.items()}
        pole, equator = self.problem.pole, self.problem.equator
        for triple, number in zip(rows, listed(place, coefficients, len(rows), len(rows))):
            y = Number.read(place, number, pole, equator)
            for name, x in self.rows[tuple(triple)].items():
                total[name] = total.get(name, self.zero) + y * x
        wrong = next((name for name, x in total.items() if x), None)
        need(wrong is None, place, "the rows times the coefficients must make the functional", f"the entry at {wrong} differs")


def read_functional(place, value, problem):
    need(isinstance(value, dict) and value, place, "expected an object of names and numbers", f"found {text(value)}")
    out = {}
    for name, number in value.items():
        need(name in problem.names, place, "expected names of unknowns", f"found {text(name)}")
        out[name] = Number.read(f"{place}.{name}", number, problem.pole, problem.equator)
        need(out[name], f"{place}.{name}", "expected a number other than 0", "found 0")
    return out


def error_bound(problem, levels, combinations):
    """Bound on the probability that one prime misleads."""
    n, order = len(problem.names), order_of(problem)
    phi = order
    for q in (2, 3, 5):
        phi = phi * (q - 1) // q if order % q == 0 else phi
    factors = max((len(f) for _, _, f in problem.coefficients), default=0)
    turns = sum(map(len, problem.slews or []))
    bits = 3 * (factors + 1) + 9 + math.log2(n) / 2 + (bits_of_turns(problem.slews) if turns else 0)
    t = max((sum(len(x.terms) for x in c.values()) for c in combinations), default=0)
    decisions = levels * (1 + n + len(combinations)) + 2 * turns
    prime = (n * bits + 40 * (t + 1)) * phi * math.log(2**61) / (60 * 2**60)
    return decisions * ((5 * n + 40) / 2**60 + prime)


def bits_of_turns(slews):
    """Binary logarithms of the denominators and sizes that turns contribute to the norm of a row."""
    turns = [turn for turns in slews for turn in turns]
    denominators = [q.denominator for about, _ in turns if isinstance(about, list) for x in about for q in x.terms.values()]
    # exponents of 2 and of the common denominator that make an attitude integral, and the largest one of a
    # jump
    two = own = 0
    for position in slews:
        a2, a_own = 3, 0
        for about, _ in position:
            u2, u_own = {"X_p": (0, 0), "Y_p": (0, 0), "Z_p": (0, 0), "middle": (1, 0), None: (6, 0)}.get(about if not isinstance(about, list) else "", (a2, a_own))
            u_own += isinstance(about, list)
            two, own = max(two, a2 + 1 + 3 * u2), max(own, a_own + 3 * u_own)
            a2, a_own = a2 + 1 + 2 * u2, a_own + 2 * u_own
    angles = [abs(angle) for _, angle in turns]
    half = TURN // 2
    sizes = math.log2(len(turns)) + math.log2(half // math.gcd(half, *angles)) + math.log2(4 + max(angles) / half) + 3
    return two + own * (math.lcm(1, *denominators) - 1).bit_length() + 3 * sum(about is None for about, _ in turns) + sizes


def verify(data, scheme=None, blocks=None, seed=None):
    """Sentences on an accepted certificate (bytes), checked against a scheme file (text) if given. `blocks`
    is the number of blocks of an optimum to search again."""
    need(len(data) <= 16 * 10**6, "certificate", "expected at most 16 MB", f"found {len(data)} bytes")
    try:
        value = json.loads(data.decode("utf-8"), object_pairs_hook=no_repetition)
    except (ValueError, RecursionError) as e:
        raise Refused(f"certificate: expected JSON; {str(e)[:200]}") from None
    if isinstance(value, dict) and value.get("layout") == "obsdeg.model-certificate/1":
        from verify_model_certificate import verify_model

        return verify_model(value, data, scheme)
    if isinstance(value, dict) and value.get("layout") == "obsdeg.optimum-certificate/1":
        from verify_optimum_certificate import verify_optimum

        return verify_optimum(value, data, scheme, blocks, seed)
    names = ["layout", "problem", "unknowns", "kind", "ranks", "basis", "null_vectors", "verdicts", "combinations"]
    layout, problem, unknowns, kind, ranks, basis, null_vectors, verdicts, combinations = keys("certificate", value, names)
    same("layout", layout, "obsdeg.certificate/1")
    if scheme is not None:
        try:
            of_file = read_scheme(scheme, problem)
        except (AttributeError, KeyError, TypeError, ValueError, ArithmeticError) as e:
            raise Refused(f"scheme: expected a scheme file; {type(e).__name__} {e}") from None
        for key in of_file:
            same(f"problem.{key}, against the scheme file", problem.get(key) if isinstance(problem, dict) else None, of_file[key])
    problem = Problem(problem)
    same("unknowns", unknowns, problem.names)
    need(kind in ("exact", "modular"), "kind", "expected exact or modular", f"found {text(kind)}")
    exact = kind == "exact"
    witness = ["status", "degree", "solution", "coefficients", "hidden_by", "excited_by"]
    n = len(problem.names)
    for i, v in enumerate(listed("verdicts", verdicts, n, n)):
        same(f"verdicts.{i}.unknown", keys(f"verdicts.{i}", v, ["unknown", *witness])[0], problem.names[i])
    asked = [keys(f"combinations.{i}", c, ["terms", *witness])[0] for i, c in enumerate(listed("combinations", combinations, 100))]
    asked = [read_functional(f"combinations.{i}.terms", c, problem) for i, c in enumerate(asked)]
    functionals = [{name: Number({(1, 0, 0): Fraction(1)})} for name in problem.names] + asked
    claims = [(v["unknown"], v) for v in verdicts] + [(f"combination {i + 1}", c) for i, c in enumerate(combinations)]
    count, bound = (1, 0) if exact else primes(error_bound(problem, len(ranks), asked))
    random = Randomness(data)
    for _ in range(count):
        field = PrimeField(problem, random)
        images = [{problem.names.index(k): field.image(v) for k, v in c.items()} for c in functionals]
        need(all(x for c in images for x in c.values()), "combinations", "expected numbers other than 0", "found one that is 0 at this latitude")
        compare(judge(field.p, problem.names, field.rows(problem), images), ranks, basis, claims)
    if exact:
        rows = Exact(problem)
        rows.null_vectors(null_vectors, basis, ranks)
        for functional, (name, claim) in zip(functionals, claims):
            if claim["degree"] is not None:
                rows.solution(f"{name}, coefficients", functional, claim["solution"], claim["coefficients"])
            else:
                same(f"{name}, coefficients", claim["coefficients"], None)
            if claim["status"] == "not_excited":
                unseen = not any(unknown in row for row in rows.rows.values() for unknown in functional)
                need(unseen, f"{name}, status", "not_excited", "found an entry other than 0")
    else:
        same("null_vectors", null_vectors, None)
        for name, claim in claims:
            same(f"{name}, coefficients", claim["coefficients"], None)
    how = "exactly" if exact else by_primes(count, bound)
    return sentences(problem, claims, len(basis), how, scheme is not None)


def compare(found, ranks, basis, claims):
    """Refuses claims that differ from the results modulo a prime."""
    found_basis, found_ranks, witnesses = found
    same("ranks", ranks, found_ranks)
    same("basis", basis, found_basis)
    for (name, claim), witness in zip(claims, witnesses):
        for key in ("status", "degree", "solution", "hidden_by", "excited_by"):
            same(f"{name}, {key}", claim[key], witness[key])


def primes(each):
    """Number of primes, and the probability that all mislead, if one misleads with a probability of at most
    `each`."""
    count = next((m for m in range(2, 9) if min(each, 1.0) ** m < 1e-12), None)
    need(count, "problem", "expected one that eight primes decide with a probability of error below 1e-12", "found a larger one")
    return count, each**count


def by_primes(count, bound):
    return f"modulo {count} primes (wrong with probability below {rounded_up(bound)})"


def rounded_up(x):
    """Number rounded up to one digit and an exponent."""
    shown = f"{x:.0e}"
    if float(shown) >= x:
        return shown
    digit, exponent = shown.split("e")
    return f"{int(digit) + 1}e{exponent}" if digit != "9" else f"1e{int(exponent) + 1:03d}"


def fewest_positions(problem, seen):
    """Smallest number of positions that can determine a number of coefficients; None if the counting argument
    does not apply."""
    if problem.pole:
        return None
    torqued = problem.carry == "inertial" and any(t in RATE for t in problem.terms)
    rows = 5 + problem.force + problem.azimuth
    k = 1
    while True:
        most = rows * k - (3 * k if problem.carry == "reset" else 3)
        if not problem.force and not torqued:
            # rows without drift concern psi only
            most = min(most, 3 * k - (problem.carry == "inertial" and not problem.azimuth))
        if most >= seen:
            return k
        k += 1


def sentence(name, claim, how):
    if claim["status"] == "observable":
        lower = f", no lower one suffices (null vector of {claim['hidden_by']})" if claim["degree"] else ""
        return f"{name}: observable with degree {claim['degree']} from {len(claim['solution'])} rows{lower}; verified {how}."
    if claim["status"] == "inseparable":
        return f"{name}: inseparable at every order (null vector of {claim['hidden_by']}), excited by row {tuple(claim['excited_by'])}; verified {how}."
    return f"{name}: not excited, every row has the entry 0; verified {how}."


def sentences(problem, claims, rank, how, compared):
    yield from (sentence(name, claim, how) for name, claim in claims)
    latitude = "generic latitude" if problem.latitude is None else f"latitude {problem.latitude_deg} deg"
    yield f"Rank {rank} of {len(problem.names)}; verified {how}."
    seen = sum(claim["degree"] is not None for _, claim in claims[problem.psi : len(problem.names)])
    if seen and (fewest := fewest_positions(problem, seen)):
        as_few = " This one has as few." if fewest == len(problem.positions) else ""
        yield f"Counting: no scheme of fewer than {fewest} positions makes {seen} coefficients observable under {problem.carry} carry.{as_few}"
    yield f"Assumption: the model of book/src/certificate.md with {problem.carry} carry and {latitude}, {len(problem.positions)} positions."
    yield "The scheme file is that of the certificate." if compared else "No scheme file was compared."


def no_repetition(pairs):
    out = dict(pairs)
    if len(out) < len(pairs):
        raise ValueError("a key is repeated")
    return out


def stated_slews(file, positions, claimed, decimal):
    """Slews that a scheme file states; for a shortest slew the claimed ones, if they have its form."""
    out = [[]]
    difference = lambda a, b: decimal(Decimal(a) - Decimal(b))
    for i in range(1, len(positions)):
        slew = file["position"][i].get("slew", {})
        about, before, here = slew.get("about"), positions[i - 1], positions[i]
        turns = claimed[i] if isinstance(claimed, list) and len(claimed) == len(positions) else None
        if isinstance(about, list):
            need(is_along(turns, about, slew.get("angle_deg"), decimal), "scheme", "expected the turn about the direction of the slew", "found another")
            out.append(turns)
        elif about is not None:
            need(isinstance(about, str) and "angle_deg" in slew, "scheme", "expected a slew with a named axis and angle_deg", f"found {text(about)}")
            out.append([{"about": about, "angle_deg": decimal(slew["angle_deg"])}])
        elif file.get("path") == "gimbals":
            turns = [difference(a, b) for a, b in zip(before, here)]
            out.append([{"about": a, "angle_deg": x} for a, x in zip(("N", "middle", "Z_p"), turns) if x != "0"])
        else:
            out.append(turns if turns == [] or is_shortest(turns) else "the shortest turn")
    return out


def is_shortest(turns):
    """True for one turn below 180 degrees about the axis of the attitudes, or a half turn about a direction
    whose first non-zero component is positive."""
    if not (isinstance(turns, list) and len(turns) == 1 and isinstance(turns[0], dict)):
        return False
    about, angle = turns[0].get("about"), nanodeg("slews", turns[0].get("angle_deg"))
    if about is None:
        return 0 < angle < TURN // 2
    if not isinstance(about, list) or angle != TURN // 2:
        return False
    return next((x > 0 for x in direction(about) if abs(x) > 1e-9), False)


def direction(about):
    return [sum(float(v) * math.sqrt(r) for (r, _, _), v in Number.read("slews", x, False, False).terms.items()) for x in about]


def is_along(turns, stated, angle, decimal):
    """True for one turn about a stated direction by the stated angle, otherwise by a half turn or by the
    angle below 180 degrees of the attitudes."""
    if not (isinstance(turns, list) and len(turns) == 1 and isinstance(turns[0], dict) and len(stated) == 3):
        return False
    about, claimed = turns[0].get("about"), nanodeg("slews", turns[0].get("angle_deg"))
    angle = claimed if angle is None else nanodeg("scheme", decimal(angle))
    if abs(angle) != claimed:
        return False
    if about is None:
        return 0 < claimed < TURN // 2
    stated = [float(x) for x in stated]
    length = math.copysign(math.sqrt(sum(x * x for x in stated)), angle)
    return isinstance(about, list) and claimed == TURN // 2 and all(abs(x - y / length) < 1e-9 for x, y in zip(direction(about), stated))


KEYS_OF_SCHEME = (
    "name description carry latitude_deg terms frame path measured_azimuth geometry combinations simulation requirements bench gimbals record position"
)


def known_keys(table, known):
    """Refuses unknown keys that may affect the problem."""
    other = [key for key in table if key not in known.split()]
    need(not other, "scheme", "expected keys of standing positions", f"found {text(other)}")


def by_key(axes, keys):
    """Axes of a scheme file as a table, from a table or from a list in the order of the keys."""
    own = dict(zip(keys, axes)) if isinstance(axes, list) and len(axes) == len(keys) else axes
    good = isinstance(own, dict) and sorted(own) == sorted(keys) and all(isinstance(a, str) for a in own.values())
    need(good, "scheme", f"expected axes {', '.join(keys)}", f"found {text(axes)}")
    return own


def scheme_terms(file):
    """Terms of a scheme file, with families written out."""
    terms, frame = file.get("terms", ["F", "I", "O", "S"]), file.get("frame", "accelerometers")
    misalignments = {"accelerometers": ["GM", "M3"], "gyros": ["GM3", "M6"], "body": ["GM", "M6"]}
    need(isinstance(frame, str) and frame in misalignments, "scheme", "expected accelerometers, gyros or body", f"found {text(frame)}")
    gyros, accelerometers = ["F", "I", "O", "S", "GS"], ["K0", "K1", "K2"]
    of_gyros, of_accelerometers = misalignments[frame]
    families = {"gyros": [*gyros, of_gyros], "accelerometers": [*accelerometers, of_accelerometers]}
    families["all"] = families["gyros"] + families["accelerometers"]
    listed("scheme", terms, 100)
    out = [t for name in terms for t in (families.get(name, [name]) if isinstance(name, str) else [name])]
    need(all(isinstance(t, str) and t in GRAVITY + RATE + FORCE for t in out), "scheme", "expected terms that certificates cover", f"found {text(terms)}")
    return out


def read_scheme(scheme, claimed):
    """Problem of a scheme file."""
    try:
        file = tomllib.loads(scheme, parse_float=Decimal)
    except tomllib.TOMLDecodeError as e:
        raise Unreadable(f"scheme: expected TOML; {e}") from None

    def decimal(x):
        need(type(x) in (int, Decimal) and Decimal(x).is_finite(), "scheme", "expected decimal degrees", f"found {text(x)}")
        shown = f"{Decimal(x):f}"
        shown = shown.rstrip("0").rstrip(".") if "." in shown else shown
        return "0" if shown in ("-0", "") else shown

    def position(entry):
        need(isinstance(entry, dict), "scheme", "expected a table for each position", f"found {text(entry)}")
        known_keys(entry, "name angles_deg attitude dwell_s slew")
        slew = entry.get("slew", {})
        need(isinstance(slew, dict), "scheme", "expected a table for each slew", f"found {text(slew)}")
        known_keys(slew, "about angle_deg rate_deg_s")
        if "attitude" in entry:
            return cardinal(entry["attitude"])
        return [decimal(a) for a in entry.get("angles_deg", [])]

    known_keys(file, KEYS_OF_SCHEME)
    terms = scheme_terms(file)
    geometry = file.get("geometry", {})
    need(isinstance(geometry, dict), "scheme", "expected a table of the geometry", f"found {text(geometry)}")
    known_keys(geometry, "X Y Z accelerometers")
    default = ["+x -z +y", "+y -z -x", "+z +x +y"]
    signed = lambda a: a if a[:1] in "+-" else f"+{a}"
    gyros = []
    for letter, axes in zip(SENSORS, default):
        own = by_key(geometry.get(letter, axes.split()), "IOS")
        gyros.append({k: signed(own[k]) for k in "IOS"})
    inputs = by_key(geometry.get("accelerometers", ["+x", "+y", "+z"]), SENSORS)
    latitude = file.get("latitude_deg")
    positions = [position(p) for p in file.get("position", [])]
    act = file.get("carry") == "inertial" and len(positions) > 1 and any(t in RATE for t in terms)
    slews = claimed.get("slews") if isinstance(claimed, dict) else None
    return {
        "carry": file.get("carry", "platform"),
        "latitude_deg": None if latitude is None else decimal(latitude),
        "measured_azimuth": file.get("measured_azimuth", False),
        "terms": [t for t in GRAVITY + RATE + FORCE if t in terms],
        "gyros": gyros,
        "accelerometers": [signed(inputs[k]) for k in SENSORS],
        "positions": positions,
        "slews": stated_slews(file, positions, slews, decimal) if act else None,
    }


def cardinal(letters):
    """Euler angles of an attitude given by the directions of X_p, Y_p, Z_p."""
    directions = {"N": (1, 0, 0), "U": (0, 1, 0), "E": (0, 0, 1), "S": (-1, 0, 0), "D": (0, -1, 0), "W": (0, 0, -1)}
    circle = {0: (1, 0), 90: (0, 1), 180: (-1, 0), -90: (0, -1)}
    need(isinstance(letters, str) and len(letters) == 3 and set(letters) <= set(directions), "scheme", "expected an attitude", f"found {text(letters)}")
    target, found = [directions[a] for a in letters], []
    for angles in product(circle, repeat=3):
        (ca, sa), (cb, sb), (cg, sg) = (circle[a] for a in angles)
        # columns of C = Mx My Mz
        x = (cb * cg, -ca * sg + sa * sb * cg, sa * sg + ca * sb * cg)
        y = (cb * sg, ca * cg + sa * sb * sg, -sa * cg + ca * sb * sg)
        if [x, y] == target[:2] and (-sb, sa * cb, ca * cb) == target[2]:
            found.append(angles)
    need(found, "scheme", "expected a right-handed attitude", f"found {text(letters)}")
    return [str(a) for a in min(found, key=lambda a: sum(map(bool, a)))]


def main():
    if not 2 <= len(sys.argv) <= 3:
        print(__doc__, file=sys.stderr)
        return 2
    try:
        with open(sys.argv[1], "rb") as file:
            data = file.read()
        scheme = None
        if len(sys.argv) == 3:
            with open(sys.argv[2], encoding="utf-8") as file:
                scheme = file.read()
    except (OSError, UnicodeDecodeError) as e:
        print(f"error: {e}", file=sys.stderr)
        return 2
    try:
        print("\n".join(verify(data, scheme)))
    except Unreadable as e:
        print(f"error: {e}", file=sys.stderr)
        return 2
    except Refused as e:
        print(f"refused: {e}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

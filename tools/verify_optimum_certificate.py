#!/usr/bin/env python3
"""Checks certificates of optima (book/src/certificate.md); verify_certificate.py calls it.

    verify_optimum_certificate.py CERTIFICATE.json [--blocks N] [--seed N]

--blocks N searches N blocks again, chosen at random (default: all up to 20000 sequences, otherwise as many as these fill).
Exit codes: 0 accepted, 1 refused, 2 not readable or bad usage.
"""

import argparse
import math
import secrets
import sys
from itertools import product as tuples

import verify_certificate as base
from verify_certificate import FORCE, RATE, TURN, PrimeField, Problem, Randomness, Refused, integer, keys, listed, need, same, text

LAYOUT = "obsdeg.optimum-certificate/1"
KEYS = ["layout", "problem", "degree", "best", "sequences", "blocks"]
PROBLEM = "carry latitude_deg measured_azimuth terms gyros accelerometers candidates positions dwell_s samples noise_g azimuth_noise_deg criterion required".split()
EARTH_RATE = 7.292115e-5  # rad/s
ARCSEC = math.pi / 648000
TOLERANCE = 1e-5
PIVOT = 1e-13
SURE_PIVOT = 1e-9
ALL_UP_TO = 20_000


def number(place, value, most=1e300):
    good = type(value) in (int, float) and 0 < value <= most
    need(good, place, f"expected a number above 0 and up to {most:g}", f"found {text(value)}")
    return float(value)


def times(a, b):
    columns = list(zip(*b))
    return [[sum(x * y for x, y in zip(row, column) if x) for column in columns] for row in a]


def dot(a, b):
    return math.fsum(x * y for x, y in zip(a, b)) if len(a) > 20 else sum(x * y for x, y in zip(a, b))


def attitude(cos_sin, angles):
    (ca, sa), (cb, sb), (cg, sg) = map(cos_sin, angles)
    z = [[cg, sg, 0], [-sg, cg, 0], [0, 0, 1]]
    return times(times([[1, 0, 0], [0, ca, sa], [0, -sa, ca]], [[cb, 0, -sb], [0, 1, 0], [sb, 0, cb]]), z)


def effects(problem, c, w_n, w_u):
    """Effects of one unit of each coefficient on the drift and the accelerometer errors in n: six numbers."""
    rate = [c[0][j] * w_n + c[1][j] * w_u for j in range(3)]
    of = {"gravity": [-x for x in c[1]], "force": c[1], "rate": rate}
    out = []
    for kind, (j, sign), factors in problem.coefficients:
        e = sign
        for axis, factor_sign in factors:
            e = e * of[kind][axis] * factor_sign
        column = [c[r][j] * e for r in range(3)]
        out.append([0, 0, 0] + column if kind == "force" else column + [0, 0, 0])
    return out


def cos_sin(angle):
    """Cosine and sine of an angle in 1e-9 degrees; exact at multiples of 90 degrees."""
    quarter = TURN // 4
    turns = (angle + quarter // 2) // quarter
    x = math.radians((angle - turns * quarter) * 1e-9)
    c, s = math.cos(x), math.sin(x)
    return [(c, s), (-s, c), (-c, -s), (s, -c)][turns % 4]


def behind(w_n, w_u, t):
    """psi^n after t seconds as rows over psi^n and eps^n before: exp(W t) and its integral, three rows of
    six."""
    w = [[0, 0, -w_u], [0, 0, w_n], [w_u, -w_n, 0]]
    square, rate = times(w, w), math.hypot(w_n, w_u)
    x = rate * t
    half = 2 * (math.sin(x / 2) / rate) ** 2
    third = (x - math.sin(x)) / rate**3
    if x < 0.5:
        third, term, k = 0.0, t**3 / 6, 3
        while abs(term) > 1e-20 * t**3:
            third, term, k = third + term, -term * x * x / ((k + 1) * (k + 2)), k + 2
    one = lambda i, j: float(i == j)
    turned = [[one(i, j) + math.sin(x) / rate * w[i][j] + half * square[i][j] for j in range(3)] for i in range(3)]
    drifted = [[t * one(i, j) + half * w[i][j] + third * square[i][j] for j in range(3)] for i in range(3)]
    return [a + b for a, b in zip(turned, drifted)]


class Accuracy:
    """Criterion of sequences: computed value and lower bound."""

    def __init__(self, problem, raw, required):
        self.carry, self.criterion = raw["carry"], raw["criterion"]
        c, s = cos_sin(problem.latitude)
        w_n, w_u = EARTH_RATE * c, EARTH_RATE * s
        d = len(problem.coefficients)
        counting = [column for column, _, _ in required]
        order = [k for k in range(d) if k not in counting] + counting
        self.limits = [limit for _, _, limit in required]
        arc = lambda k: problem.names[3 + k].startswith(("D_", "GM_", "M_"))
        units = [ARCSEC if arc(k) else 1e-6 for k in order]
        kinds = [problem.coefficients[k][0] for k in order]
        self.scales = [[unit * (EARTH_RATE if kind == "rate" else 1) * (kind != "force") for unit, kind in zip(units, kinds)]]
        self.scales.append([unit * (kind == "force") for unit, kind in zip(units, kinds)])
        self.attitudes, self.effects = [], []
        for angles in problem.positions:
            c = attitude(cos_sin, angles)
            columns = effects(problem, c, w_n, w_u)
            self.attitudes.append(c)
            self.effects.append([[columns[k][r] * unit for k, unit in zip(order, units)] for r in range(6)])
        self.seconds, self.samples = float(raw["dwell_s"]), raw["samples"]
        self.behind = behind(w_n, w_u, self.seconds)
        self.root = self.root_of_dwell(problem, raw, w_n, w_u)
        self.sizes = [[sum(map(abs, row[k : k + 3])) for k in (0, 3, 6)] for row in self.root]
        if self.carry == "reset":
            self.alone = [self.rows_alone(e) for e in self.effects]

    def root_of_dwell(self, problem, raw, w_n, w_u):
        """U with U^T U equal to the information of a dwell on psi, eps, a; by Givens rotations, sample by
        sample."""
        root = [[0.0] * 9 for _ in range(9)]
        for j in range(1, self.samples + 1):
            of_psi = behind(w_n, w_u, self.seconds * j / self.samples)
            for component in problem.components():
                axis, sign = {1: (2, 1), 2: (None, 1), 3: (0, -1), 4: (1, 1)}[component]
                row = [sign * x for x in of_psi[axis]] + [0.0] * 3 if axis is not None else [0.0] * 9
                if problem.force and component < 4:
                    row[5 + component] = 1.0
                noise = math.radians(raw["azimuth_noise_deg"]) if component == 4 else raw["noise_g"]
                row = [x / noise for x in row]
                for i in range(9):
                    if row[i]:
                        length = math.hypot(root[i][i], row[i])
                        c, s = root[i][i] / length, row[i] / length
                        root[i], row = [c * a + s * b for a, b in zip(root[i], row)], [c * b - s * a for a, b in zip(root[i], row)]
                        row[i] = 0.0
        return [row for row in root if any(row)]

    def rows_alone(self, effect):
        """Rows of a position with its own psi, and the psi that minimises them."""
        rows = times([row[3:] for row in self.root], effect)
        psi = [[0.0] * len(effect[0]) for _ in range(3)]
        leading = {next(j for j in range(9) if row[j]): i for i, row in enumerate(self.root)}
        for j in (2, 1, 0):
            if j not in leading:
                continue
            pivot = leading[j]
            psi[j] = [-x / self.root[pivot][j] for x in rows[pivot]]
            rows = [[x + self.root[r][j] * y for x, y in zip(row, psi[j])] for r, row in enumerate(rows)]
            rows[pivot] = [0.0] * len(psi[j])
        return [row for row in rows if any(row)], psi

    def start(self):
        n = len(self.scales[0]) + 3 * (self.carry != "reset")
        return [[float(i == j) for j in range(n)] for i in range(3)], [], [], [[0.0] * n for _ in range(n)]

    def extended(self, state, candidate):
        psi, rows, own, information = state
        if self.carry == "reset":
            new, free = self.alone[candidate]
            own = own + [free]
        else:
            c = self.attitudes[candidate]
            local = psi if self.carry == "inertial" else times(c, psi)
            local = local + [[0.0] * 3 + e for e in self.effects[candidate]]
            psi = times(self.behind, local[:6])
            if self.carry == "platform":
                psi = times([list(column) for column in zip(*c)], psi)
            new = times(self.root, local)
        information = [row[:] for row in information]
        for row in new:
            for i, x in enumerate(row):
                if x:
                    total = information[i]
                    for j in range(i + 1):
                        total[j] += x * row[j]
        return psi, rows + [new], own, information

    def value(self, state):
        """Computed criterion; its lower bound in spite of rounding; smallest pivot relative to its diagonal
        entry, 0 if only rounding determines a coefficient; number of omitted unknowns."""
        information = state[3]
        n, d = len(information), len(self.limits)
        first = n - d
        smallest, left_out = 1.0, 0
        lower = [[0.0] * n for _ in range(n)]
        for i in range(n):
            row = lower[i]
            for j in range(i):
                if lower[j][j]:
                    row[j] = (information[i][j] - sum(a * b for a, b in zip(row[:j], lower[j]))) / lower[j][j]
            given = information[i][i]
            pivot = given - sum(a * a for a in row[:i])
            if pivot > PIVOT * given:
                row[i], smallest = math.sqrt(pivot), min(smallest, pivot / given)
            elif i < first:
                left_out += 1
            else:
                smallest = 0.0
                row[i] = math.sqrt(PIVOT * given) or 1.0

        def backward(x):
            x = x[:]
            for i in reversed(range(n)):
                x[i] = x[i] / lower[i][i] if lower[i][i] else 0.0
                for j in range(i):
                    x[j] -= lower[i][j] * x[i]
            return x

        def forward(v):
            y = []
            for i in range(n):
                rest = v[i] - sum(a * b for a, b in zip(lower[i], y))
                y.append(rest / lower[i][i] if lower[i][i] else 0.0)
            return y

        def bound(v):
            x = backward(forward(v))
            return sum(a * b for a, b in zip(v, x)) ** 2 / self.energy(state, x) ** 2

        units = [[float(i == first + k) for i in range(n)] for k in range(d)]
        if self.criterion == "d":
            spread = math.exp(-2 / d * sum(math.log(lower[i][i]) for i in range(first, n)))
            squared, least = spread, spread * d / sum(self.energy(state, backward(u)) ** 2 for u in units)
        else:
            inverse = [forward(u) for u in units]
            if self.criterion == "e":
                squared, vector = principal([[dot(a, b) for b in inverse] for a in inverse])
                least = bound([0.0] * first + vector) / dot(vector, vector)
            elif self.criterion == "a":
                squared = sum(dot(y, y) for y in inverse) / d
                least = sum(map(bound, units)) / d
            else:
                variances = [dot(y, y) / limit**2 for y, limit in zip(inverse, self.limits)]
                k = max(range(d), key=lambda k: variances[k])
                squared, least = variances[k], bound(units[k]) / self.limits[k] ** 2
        return math.sqrt(squared), math.sqrt(least) * (1 - 1e-13), smallest, left_out

    def energy(self, state, x):
        """Upper bound of |Y x| in spite of rounding."""
        _, rows, own, _ = state
        psi = len(x) - len(self.scales[0])
        eps, a = (sum(abs(y) * s for y, s in zip(x[psi:], scale)) for scale in self.scales)
        of_psi = sum(map(abs, x[:psi]))
        total = hidden = 0.0
        for i, position in enumerate(rows):
            total += sum(sum(y * z for y, z in zip(row, x)) ** 2 for row in position)
            free = sum(abs(y * z) for row in own[i] for y, z in zip(row, x)) if own else 0.0
            carried = of_psi + free + i * self.seconds * eps
            hidden += sum((p * carried + q * eps + r * a) ** 2 for p, q, r in self.sizes)
        return math.sqrt(total) + (self.samples + 40 * len(rows) + 200) * 2.0**-48 * math.sqrt(hidden)


def principal(a):
    """Largest eigenvalue of a symmetric matrix and its vector, by Jacobi rotations."""
    n = len(a)
    vectors = [[float(i == j) for j in range(n)] for i in range(n)]
    for _ in range(30):
        if max((a[i][j] ** 2 / (a[i][i] * a[j][j]) for i in range(n) for j in range(i)), default=0.0) < 1e-26:
            break
        for p in range(n):
            for q in range(p):
                if not a[p][q]:
                    continue
                theta = (a[q][q] - a[p][p]) / (2 * a[p][q])
                t = (-1 if theta < 0 else 1) / (abs(theta) + math.hypot(theta, 1))
                c = 1 / math.hypot(t, 1)
                s = t * c
                for row in a:
                    row[p], row[q] = c * row[p] - s * row[q], s * row[p] + c * row[q]
                for m in (a, vectors):
                    m[p], m[q] = [c * x - s * y for x, y in zip(m[p], m[q])], [s * x + c * y for x, y in zip(m[p], m[q])]
    best = max(range(n), key=lambda i: a[i][i])
    return a[best][best], vectors[best]


class Space:
    """Worst degrees of sets of candidates, and the symmetric turns of the platform axes."""

    def __init__(self, problem, carry, required, primes, random):
        self.problem, self.reset, self.required, self.known, self.fields = problem, carry == "reset", required, {}, []
        maps = None
        for _ in range(primes):
            field = PrimeField(problem, random)
            rows = [[] for _ in problem.positions]
            attitudes = [attitude(field.cos_sin, angles) for angles in problem.positions]
            for triple, row in field.rows(problem):
                i = triple[0] - 1
                if carry == "inertial":
                    # psi^n is carried: the map from psi^n = C psi becomes a map from psi by C^T
                    row[:3] = [sum(x * y for x, y in zip(row, line)) % field.p for line in attitudes[i]]
                rows[i].append((triple, row))
            if self.reset:
                rows = [without_psi(field.p, own) for own in rows]
            self.fields.append((field.p, rows))
            here = self.turns(field, random)
            maps = here if maps is None else [a if a == b else None for a, b in zip(maps, here)]
        self.maps = [m for m in maps if m is not None]

    def turns(self, field, random):
        problem, p = self.problem, field.p
        reduced = lambda m: tuple(tuple(x % p for x in row) for row in m)
        attitudes = [reduced(attitude(field.cos_sin, angles)) for angles in problem.positions]
        places = {c: i for i, c in reversed(list(enumerate(attitudes)))}
        c = [[random.below(p) for _ in range(3)] for _ in range(3)]
        columns = lambda m: [[x % p for x in column] for column in effects(problem, m, field.w_n, field.w_u)]
        before = columns(c)
        counts = {column: (cap, limit) for column, cap, limit in self.required}
        units = [unit(name) for name in problem.names[3:]]

        def renames(after):
            used = set()
            for j, column in enumerate(after):
                negative = [-x % p for x in column]
                fits = (i for i, b in enumerate(before) if i not in used and counts.get(i) == counts.get(j) and units[i] == units[j] and b in (column, negative))
                found = next(fits, None)
                if found is None:
                    return False
                used.add(found)
            return True

        out = []
        for signs in tuples((1, -1), repeat=3):
            for a, b, third in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (1, 0, 2), (0, 2, 1), (2, 1, 0)):
                if math.prod(signs) != (1 if (b - a) % 3 == 1 else -1):
                    continue
                turn = [[s * (j == axis) for j in range(3)] for s, axis in zip(signs, (a, b, third))]
                image = [places.get(reduced(times(m, turn))) for m in attitudes]
                good = None not in image and renames(columns(times(c, turn)))
                out.append(image if good else None)
        return out

    def worst_degree(self, sequence):
        members = tuple(sorted(set(sequence)))
        if members not in self.known:
            found = [self.judged(p, rows, members)[0] for p, rows in self.fields]
            self.known[members] = min((degree for degree in found if degree is not None), default=None)
        return self.known[members]

    def certain(self, sequence):
        """Largest degree by all primes (a single prime could give too small a degree), and number of
        undetermined unknowns."""
        found = [self.judged(p, rows, tuple(sorted(set(sequence)))) for p, rows in self.fields]
        degrees = [degree for degree, _ in found]
        return None if None in degrees else max(degrees), min(left for _, left in found)

    def judged(self, p, candidates, members):
        d = len(self.problem.names) - 3
        psi = 0 if self.reset else 3  # under reset carry no row has entries at psi
        rows = [((i + 1, k, component), row) for i, c in enumerate(members) for (_, k, component), row in candidates[c]]
        names = [""] * (psi + d)
        _, ranks, witnesses = base.judge(p, names, rows, [{psi + column: 1} for column, _, _ in self.required])
        degrees = [w["degree"] for w in witnesses]
        good = all(x is not None and x <= cap for x, (_, cap, _) in zip(degrees, self.required))
        return max(degrees) if good else None, psi + d - (ranks[-1] if ranks else 0)


def without_psi(p, rows):
    """Combinations of the rows of one candidate without entries at its psi, by order, for the coefficients
    only."""
    reduced, out = [], []
    for triple, row in rows:
        for pivot, e in reduced:
            if factor := row[pivot]:
                row = [(x - factor * y) % p for x, y in zip(row, e)]
        pivot = next((j for j in range(3) if row[j]), None)
        if pivot is not None:
            scale = pow(row[pivot], -1, p)
            reduced.append((pivot, [x * scale % p for x in row]))
        elif any(row):
            out.append((triple, row[3:]))
    return out


def read_required(raw, problem):
    out, before = [], -1
    margin = raw["criterion"] == "margin"
    for entry in listed("problem.required", raw["required"], 63, 1):
        name, cap, limit = keys("problem.required", entry, ["name", "max_degree", "limit"])
        known = isinstance(name, str) and name in problem.names[3:] and problem.names.index(name) - 3 > before
        need(known, "problem.required", "expected names of coefficients in their order", f"found {text(name)}")
        before = problem.names.index(name) - 3
        need(margin or limit is None, f"problem.required.{name}", "expected no limit", f"found {text(limit)}")
        cap = math.inf if cap is None else integer(f"problem.required.{name}", cap, 0, 2**63)
        limit = (math.inf if margin else 1.0) if limit is None else between(f"problem.required.{name}.limit", limit, 1e-12, 1e12)
        out.append((before, cap, limit))
    need(not margin or any(limit < math.inf for _, _, limit in out), "problem.required", "expected a limit", "found none")
    return out


class Search:
    """Search of a certificate: request and claimed answer."""

    def __init__(self, raw, data):
        keys("problem", raw, PROBLEM)
        need(raw["carry"] in ("platform", "inertial", "reset"), "problem.carry", "expected a carry", f"found {text(raw['carry'])}")
        need(isinstance(raw["latitude_deg"], str), "problem.latitude_deg", "expected a latitude", f"found {text(raw['latitude_deg'])}")
        own = {key: raw[key] for key in ("latitude_deg", "measured_azimuth", "terms", "gyros", "accelerometers")}
        self.problem = problem = Problem({"carry": "platform", **own, "positions": raw["candidates"], "slews": None})
        self.carry, self.n = raw["carry"], len(problem.positions)
        need(len(problem.names) <= 66, "problem.terms", "expected at most 63 coefficients", f"found {len(problem.names) - 3}")
        self.k = integer("problem.positions", raw["positions"], 1, 100)
        torqued = self.carry == "inertial" and self.k > 1 and any(t in RATE for t in problem.terms)
        need(not torqued, "problem.terms", "expected no torquer errors under inertial carry: they act in slews", "found some")
        integer("problem.samples", raw["samples"], 5, 10_000)
        between("problem.dwell_s", raw["dwell_s"], 10, 1e6)
        between("problem.noise_g", raw["noise_g"], 1e-9, 1e-2)
        precise(raw, problem)
        if problem.azimuth:
            between("problem.azimuth_noise_deg", raw["azimuth_noise_deg"], 1e-6, 10)
        else:
            need(raw["azimuth_noise_deg"] is None, "problem.azimuth_noise_deg", "expected null", "found a number")
        criteria = ("worst", "a", "d", "e", "margin")
        need(raw["criterion"] in criteria, "problem.criterion", f"expected one of {criteria}", f"found {text(raw['criterion'])}")
        required = read_required(raw, problem)
        unknowns = len(problem.names) + (3 * (self.k - 1) if self.carry == "reset" else 0)
        each = chance(problem, unknowns, 4 * (1 + len(required)))
        sets = sum(math.comb(self.n, size) for size in range(1, min(self.k, self.n) + 1))
        self.primes = next((m for m in range(2, 9) if sets * each**m < 1e-12), None)
        need(self.primes, "problem", "expected sets that eight primes decide with a probability of error below 1e-12", "found more")
        self.error = sets * each**self.primes
        self.space = Space(problem, self.carry, required, self.primes, Randomness(data))
        self.accuracy = Accuracy(problem, raw, required)
        self.unit = unit_of(problem, raw["criterion"], required)

    def value(self, sequence):
        state = self.accuracy.start()
        for c in sequence:
            state = self.accuracy.extended(state, c)
        return self.accuracy.value(state)

    def lowest(self, before):
        return before if self.carry == "reset" else 0

    def starts(self, firsts, depth):
        """All starts with these first candidates, in lexicographic order."""
        out = [[c] for c in firsts]
        for _ in range(depth - 1):
            out = [start + [c] for start in out for c in range(self.lowest(start[-1]), self.n)]
        return out

    def behind(self, start):
        left = self.k - len(start)
        return math.comb(self.n - start[-1] + left - 1, left) if self.carry == "reset" else self.n**left

    def cover(self, blocks, least):
        """Checks that the blocks cover all sequences up to turns of the platform axes; returns the first
        candidates."""
        for i, block in enumerate(listed("blocks", blocks, 100_000, 1)):
            for c in listed(f"blocks.{i}.start", keys(f"blocks.{i}", block, ["start", "sequences", "bound"])[0], self.k, 1):
                integer(f"blocks.{i}.start", c, 1, self.n)
        given = [[c - 1 for c in block["start"]] for block in blocks]
        firsts = sorted({start[0] for start in given})
        for c in range(self.n):
            smallest = min(m[c] for m in self.space.maps)
            need(smallest in firsts, "blocks", f"expected blocks that start with candidate {smallest + 1}", f"found those of {[f + 1 for f in firsts]}")
        depth = len(given[0])
        many = sum(math.comb(self.n - f + depth - 2, depth - 1) if self.carry == "reset" else self.n ** (depth - 1) for f in firsts)
        same("blocks, their number", len(given), many)
        expected = self.starts(firsts, depth)
        for i, (a, b) in enumerate(zip(given, expected)):
            same(f"blocks.{i}.start", [c + 1 for c in a], [c + 1 for c in b])
        for i, (block, start) in enumerate(zip(blocks, given)):
            same(f"blocks.{i}.sequences", block["sequences"], self.behind(start))
            if block["bound"] is not None:
                number(f"blocks.{i}.bound", block["bound"])
                need(block["bound"] >= least * (1 - TOLERANCE), f"blocks.{i}.bound", f"expected at least the value {least:e} of the first of the best", f"found {block['bound']}")
        return firsts

    def replay(self, start, degree):
        """All sequences of a block: number, number of valid ones, smallest value and its sequence."""
        state = self.accuracy.start()
        for c in start:
            state = self.accuracy.extended(state, c)
        found = [0, 0, None, None]
        self.visit(list(start), state, degree, found)
        return found

    def visit(self, sequence, state, degree, found):
        if len(sequence) == self.k:
            found[0] += 1
            own = self.space.worst_degree(sequence)
            need(own is None or own >= degree, f"sequence {[c + 1 for c in sequence]}", f"expected a worst degree of at least {degree}", f"found {own}")
            if own == degree:
                found[1] += 1
                value = self.accuracy.value(state)
                if found[2] is None or value[1] < found[2][1]:
                    found[2:] = value, [c + 1 for c in sequence]
            return
        for c in range(self.lowest(sequence[-1]), self.n):
            sequence.append(c)
            own = self.space.worst_degree(sequence) if len(sequence) == self.k else degree
            if own is not None and own <= degree:
                self.visit(sequence, self.accuracy.extended(state, c), degree, found)
            else:
                found[0] += 1
            sequence.pop()


def chance(problem, n, decisions):
    """Bound on the probability that one prime misleads in a number of decisions on n unknowns."""
    own, problem.names = problem.names, [""] * n
    each = base.error_bound(problem, 1, []) / (1 + n)
    problem.names = own
    return each * decisions


def unit(name):
    """Unit of a coefficient, after a blank."""
    if name.startswith("D_"):
        return " deg/h"
    if name.startswith(("GM_", "M_")):
        return " arcsec"
    return " ppm" if name.startswith(("GS_", "K1_")) else " ug"


def between(place, x, least, most):
    need(least <= number(place, x, most), place, f"expected a number from {least:g} to {most:g}", f"found {text(x)}")
    return float(x)


def precise(raw, problem):
    """True for searches that double precision decides: cardinal candidates, all coefficients, away from
    equator and poles."""
    for angle in (angle for angles in raw["candidates"] for angle in angles):
        need(float(angle) % 90 == 0, "problem.candidates", "expected multiples of 90 degrees", f"found {text(angle)}")
    away = 1 <= abs(float(raw["latitude_deg"])) <= 89
    need(away, "problem.latitude_deg", "expected 1 to 89 degrees, north or south", f"found {text(raw['latitude_deg'])}")
    every = len(problem.names) - 3
    need(len(raw["required"]) == every, "problem.required", f"expected all {every} coefficients", f"found {len(raw['required'])}")


def unit_of(problem, criterion, required):
    units = {unit(problem.names[3 + column]) for column, _, _ in required}
    if criterion == "margin" or (criterion == "d" and len(units) > 1):
        return ""
    need(len(units) == 1, "problem.required", "expected coefficients of one unit, or the criterion d or margin", f"found {sorted(units)}")
    return units.pop()


def verify_optimum(value, data, scheme, blocks=None, seed=None):
    """Sentences on an accepted certificate."""
    need(scheme is None, "scheme file", "expected no file beside the certificate of an optimum: compare its candidates", "found one")
    _, raw, degree, best, sequences, all_blocks = keys("certificate", value, KEYS)
    search = Search(raw, data)
    integer("degree", degree, 0, 3)
    before = 0.0
    for i, entry in enumerate(listed("best", best, 1000, 1)):
        place = f"best.{i}"
        sequence, claimed = keys(place, entry, ["sequence", "value"])
        listed(place, sequence, search.k, search.k)
        for c in sequence:
            integer(place, c, 1, search.n)
        need(number(place, claimed) >= before, place, "expected values in ascending order", f"found {claimed}")
        before = claimed
        own = [c - 1 for c in sequence]
        worst, undetermined = search.space.certain(own)
        same(f"{place}, worst degree", degree, worst)
        place = f"{place}.value"
        computed, at_least, pivot, left_out = search.value(own)
        need(abs(claimed / computed - 1) <= TOLERANCE, place, f"expected {computed:e}", f"found {claimed}")
        sure = pivot >= SURE_PIVOT and left_out <= undetermined
        expected = f"expected pivots from {SURE_PIVOT:g} on, and {undetermined} unknowns left out at most"
        need(sure, place, expected, f"found {pivot:e}, {left_out} left out")
        need(at_least <= computed * (1 + TOLERANCE), place, f"expected at least {at_least:e}, its own bound", f"found {claimed}")
    firsts = search.cover(all_blocks, best[0]["value"])
    same("sequences", sequences, sum(block["sequences"] for block in all_blocks))
    chosen, seed = choice(all_blocks, sequences, data, blocks, seed)
    total = counted = 0
    least = math.inf
    for i in chosen:
        block = all_blocks[i]
        many, here, found, where = search.replay([c - 1 for c in block["start"]], degree)
        total, counted = total + many, counted + here
        if found:
            bound = math.inf if block["bound"] is None else block["bound"]
            claim = "none" if block["bound"] is None else bound
            need(found[1] >= bound * (1 - TOLERANCE), f"blocks.{i}", f"expected no sequence of degree {degree} below the bound {claim}", f"found {found[0]:.6e} of sequence {where}")
            least = min(least, found[1])
    return told(search, value, firsts, (len(chosen), seed), (total, counted, least))


def choice(blocks, sequences, data, count, seed):
    """Indices of the blocks to search again, and the seed of the choice."""
    if count is None:
        largest = max(block["sequences"] for block in blocks)
        count = len(blocks) if sequences <= ALL_UP_TO else ALL_UP_TO // largest
    if count >= len(blocks):
        return range(len(blocks)), None
    seed = secrets.randbits(64) if seed is None else seed
    random, places = Randomness(data + seed.to_bytes(8, "big")), list(range(len(blocks)))
    for i in range(count):
        other = i + random.below(len(blocks) - i)
        places[i], places[other] = places[other], places[i]
    return sorted(places[:count]), seed


def told(search, value, firsts, chosen, found):
    raw, blocks, degree = value["problem"], value["blocks"], value["degree"]
    names = ", ".join(entry["name"] for entry in raw["required"])
    order = ", order is of no account" if search.carry == "reset" else ""
    yield f"Question: {search.k} positions of {search.n} candidates, carry {search.carry}, latitude {raw['latitude_deg']} deg{order}; {raw['criterion']} of {names}, dwell {raw['dwell_s']} s, {raw['samples']} samples."
    for entry in value["best"][:3]:
        attitudes = " | ".join(",".join(raw["candidates"][c - 1]) for c in entry["sequence"])
        yield f"Sequence {attitudes}: worst degree {degree}, criterion {entry['value']:.6e}{search.unit}; evaluated again."
    if len(value["best"]) > 3:
        yield f"{len(value['best']) - 3} more sequences of the list; evaluated again."
    depth, all_of_them = len(blocks[0]["start"]), value["sequences"]
    yield f"Blocks: {len(blocks)} of starts of {depth}, {all_of_them} sequences, stand for all: first candidates {[f + 1 for f in firsts]}, {len(search.space.maps)} turns of the platform axes."
    (replayed, seed), (total, counted, least) = chosen, found
    by_seed = f", chosen by seed {seed}" if seed is not None else ""
    none = f"none below {least * (1 - 1e-6):.6e}{search.unit}" if counted else "none of this degree within the caps"
    how = base.by_primes(search.primes, search.error)
    if replayed == 0:
        yield f"No block searched again: each has more than {ALL_UP_TO} sequences; --blocks 1 searches one."
    else:
        yield f"{replayed} of {len(blocks)} blocks searched again{by_seed}: {total} sequences, {counted} of worst degree {degree}, none of a smaller one, {none}; {len(search.space.known)} sets judged {how}."
    left = len(blocks) - replayed
    if left:
        yield f"Believed only: the bounds of the other {left} blocks, {all_of_them - total} sequences."
    else:
        yield f"Proven: the first sequence is the best of all, to a part of 3e-5."
    yield "Assumption: the model of book/src/certificate.md, white noise of Z, nothing known beforehand, repositioning at once."


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("certificate")
    parser.add_argument("--blocks", type=int)
    parser.add_argument("--seed", type=int)
    asked = parser.parse_args()
    if not (asked.blocks is None or asked.blocks > 0) or not (asked.seed is None or 0 <= asked.seed < 2**64):
        parser.error("expected --blocks from 1 and --seed from 0 to 2^64 - 1")
    try:
        with open(asked.certificate, "rb") as file:
            data = file.read()
    except OSError as e:
        print(f"error: {e}", file=sys.stderr)
        return 2
    try:
        print("\n".join(base.verify(data, None, asked.blocks, asked.seed)))
    except Refused as e:
        print(f"refused: {e}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Checks certificates of rational models (book/src/certificate.md); verify_certificate.py calls it."""

import math
import re
from fractions import Fraction

from verify_certificate import Randomness, by_primes, compare, integer, is_prime, judge, keys, listed, need, primes, same, sentence, text

KEYS = ["layout", "problem", "unknowns", "ranks", "basis", "verdicts"]
PROBLEM = ["states", "parameters", "constants", "inputs", "program", "rates", "outputs"]
CLAIM = ["unknown", "status", "degree", "solution", "coefficients", "hidden_by", "excited_by"]
LONG = 200  # length of a subexpression above which it gets a name


def verify_model(value, data, scheme):
    """Sentences on an accepted certificate."""
    need(scheme is None, "scheme file", "expected no file beside the certificate of a model: compare its equations", "found one")
    _, problem, unknowns, ranks, basis, verdicts = keys("certificate", value, KEYS)
    model = Model(problem)
    names, n = model.slots[: model.unknowns], model.unknowns
    same("unknowns", unknowns, names)
    for rank in listed("ranks", ranks, n + 1, 1):
        integer("ranks", rank, 0, n)
    need(all(a < b for a, b in zip(ranks, ranks[1:])), "ranks", "expected each larger than the one before", f"found {text(ranks)}")
    for i, claim in enumerate(listed("verdicts", verdicts, n, n)):
        same(f"verdicts.{i}.unknown", keys(f"verdicts.{i}", claim, CLAIM)[0], names[i])
        same(f"{names[i]}, coefficients", claim["coefficients"], None)
    claims = list(zip(names, verdicts))
    last = len(ranks)
    count, bound = primes(model.error_bound(last))
    random = Randomness(data)
    for _ in range(count):
        while not is_prime(p := 2**60 + 1 + 2 * random.below(2**59)):
            pass
        compare(judge(p, names, model.rows(p, random, last), [{i: 1} for i in range(n)]), ranks, basis, claims)
    how = by_primes(count, bound)
    yield from (sentence(name, claim, how) for name, claim in claims)
    yield f"Rank {len(basis)} of {n}; verified {how}."
    yield from model.equations()
    yield "Assumption: the equations above, at almost all starts, parameters, constants and inputs."


class Model:
    """Equations of a certificate, parsed and checked."""

    def __init__(self, value):
        states, parameters, constants, inputs, program, self.rates, outputs = keys("problem", value, PROBLEM)
        for key, names in (("states", states), ("parameters", parameters), ("constants", constants)):
            need(all(isinstance(name, str) for name in listed(key, names, 1000)), f"problem.{key}", "expected names", "found others")
        for pair in listed("problem.inputs", inputs, 1000) + listed("problem.outputs", outputs, 100, 1):
            need(isinstance(listed("problem", pair, 2, 2)[0], str), "problem", "expected names", f"found {text(pair)}")
        self.degrees = [degree for _, degree in inputs]
        for degree in self.degrees:
            need(degree is None or integer("problem.inputs", degree, 0, 50) == degree, "problem.inputs", "expected a degree", "found another")
        self.states, self.unknowns, self.outputs = len(states), len(states) + len(parameters), outputs
        self.slots = states + parameters + constants + [name for name, _ in inputs]
        self.state_names = states
        for name in self.slots + [name for name, _ in outputs]:
            form = name[:1].isalpha() or name[:1] == "_"
            form = form and len(name) <= 256 and all(c.isalnum() or c in "_[],.@'" for c in name)
            need(form, "problem", "expected names of letters, digits and _ that begin with a letter or _", f"found {text(name)}")
        need(len(set(self.slots)) == len(self.slots), "problem", "expected different names", "found one twice")
        need(1 <= self.unknowns <= 300 and len(self.slots) <= 1000, "problem", "expected 1 to 300 unknowns, 1000 names", f"found {len(self.slots)}")
        listed("problem.rates", self.rates, self.states, self.states)
        self.program = []
        for i, operation in enumerate(listed("problem.program", program, 20_000)):
            place = f"problem.program.{i}"
            kind = listed(place, operation, 3, 2)[0]
            if kind == "=":
                number = listed(place, operation, 2, 2)[1]
                form = isinstance(number, str) and re.fullmatch(r"-?\d{1,400}(/0*[1-9]\d*)?", number, re.ASCII) and len(number) <= 802
                need(form, place, "expected a fraction such as -3/10", f"found {text(number)}")
                self.program.append(("=", Fraction(number), number))
            else:
                need(kind in ("+", "-", "*", "/"), place, "expected an operation", f"found {text(kind)}")
                operands = [integer(place, node, 0, len(self.slots) + i - 1) for node in listed(place, operation, 3, 3)[1:]]
                self.program.append((kind, *operands))
        for node in self.rates + [node for _, node in outputs]:
            integer("problem", node, 0, len(self.slots) + len(self.program) - 1)

    def rows(self, p, random, last):
        """Derivatives of the outputs' Taylor coefficients with respect to the unknowns, orders 0 to `last`,
        at a random point modulo `p`."""
        size, n, first_input = len(self.slots), self.unknowns, len(self.slots) - len(self.degrees)
        values = [[] for _ in range(size + len(self.program))]  # Taylor coefficients
        duals = [[] for _ in values]  # derivatives with respect to the unknowns, None for zeros
        rows = []

        def combined(terms):
            """Sum of factor times dual."""
            out = None
            for factor, dual in terms:
                if dual is not None and factor:
                    out = [factor * y for y in dual] if out is None else [x + factor * y for x, y in zip(out, dual)]
            return out and [x % p for x in out]

        for k in range(last + 1):
            for slot in range(size):
                degree = 0 if slot < first_input else self.degrees[slot - first_input]
                if k and slot < self.states:
                    factor = pow(k, -1, p)
                    values[slot].append(values[self.rates[slot]][k - 1] * factor % p)
                    duals[slot].append(combined([(factor, duals[self.rates[slot]][k - 1])]))
                else:
                    values[slot].append(random.below(p) if degree is None or k <= degree else 0)
                    duals[slot].append([int(j == slot) for j in range(n)] if slot < n and not k else None)
            for node, (kind, *operands) in enumerate(self.program, size):
                if kind == "=":
                    number = operands[0]
                    need(number.denominator % p, "problem.program", "expected a denominator that p does not divide", "found another")
                    values[node].append(0 if k else number.numerator * pow(number.denominator, -1, p) % p)
                    duals[node].append(None)
                    continue
                (a, da), (b, db), (c, dc) = ((values[i], duals[i]) for i in (*operands, node))
                if kind == "*":
                    value = sum(a[i] * b[k - i] for i in range(k + 1))
                    dual = combined([t for i in range(k + 1) for t in ((b[k - i], da[i]), (a[i], db[k - i]))])
                elif kind == "/":
                    # b c = a, solved for the last coefficient of c
                    need(b[0], "problem.program", "expected a divisor other than 0", "found 0")
                    inverse = pow(b[0], -1, p)
                    value = (a[k] - sum(b[i] * c[k - i] for i in range(1, k + 1))) * inverse % p
                    terms = [t for i in range(1, k + 1) for t in ((-b[i], dc[k - i]), (-c[k - i], db[i]))]
                    dual = combined([(inverse, combined([(1, da[k]), (-value, db[0]), *terms]))])
                else:
                    sign = 1 if kind == "+" else -1
                    value, dual = a[k] + sign * b[k], combined([(1, da[k]), (sign, db[k])])
                values[node].append(value % p)
                duals[node].append(dual)
            rows += [((1, k, c), duals[node][k] or [0] * n) for c, (_, node) in enumerate(self.outputs, 1)]
        return rows

    def error_bound(self, last):
        """Bound on the probability that one prime misleads."""
        sizes = [((1.0, 0.0), (0.0, 0.0))] * len(self.slots)  # degrees of numerator and denominator, bits of both

        def over(kind, a, b, carry):
            if kind == "*":
                return a[0] + b[0], a[1] + b[1]
            if kind == "/":
                return a[0] + b[1], a[1] + b[0]
            return max(a[0] + b[1], b[0] + a[1]) + carry, a[1] + b[1]

        for kind, *operands in self.program:
            if kind == "=":
                p, q = (abs(int(x)) for x in (operands[1].split("/") + ["1"])[:2])
                sizes.append(((0.0, 0.0), tuple(float((x - 1).bit_length()) if x else 0.0 for x in (p, q))))
            else:
                a, b = (sizes[i] for i in operands)
                sizes.append((over(kind, a[0], b[0], 0), over(kind, a[1], b[1], 1)))
        used = [sizes[node] for node in self.rates + [node for _, node in self.outputs]]
        denominators = [sum(size[i][1] for size in used) for i in (0, 1)]
        (d_n, b_n), (d_d, b_d) = [max(s[i][0] + denominators[i] - s[i][1] for s in used) for i in (0, 1)], denominators
        n, variables = self.unknowns, self.states + len(self.degrees) * (last + 1)
        degree, bits = d_n, b_n
        for k in range(last):
            bits += math.log2(variables * max(1, degree + (2 * k + 1) * d_d)) + b_n + 2 * b_d
            degree += max(d_n, d_d) + d_d
        bits += b_d + math.log2(max(1, degree + (2 * last + 1) * d_d))
        degree += d_d
        prime = n * (bits + math.log2(n)) * 61 * math.log(2) / (60 * 2**60)
        return last * (1 + n) * (n * degree / 2**60 + prime)

    def equations(self):
        texts = list(self.slots)
        for kind, *operands in self.program:
            number = operands[1] if operands[1:] and kind == "=" else ""
            shown = number if number.isdigit() else f"({number})" if number else f"({texts[operands[0]]} {kind} {texts[operands[1]]})"
            if len(shown) > LONG:
                yield f"Abbreviation: #{len(texts)} = {shown}."
                shown = f"#{len(texts)}"
            texts.append(shown)
        yield from (f"Equation: {name}' = {texts[node]}." for name, node in zip(self.state_names, self.rates))
        yield from (f"Output {i}: {name} = {texts[node]}." for i, (name, node) in enumerate(self.outputs, 1))

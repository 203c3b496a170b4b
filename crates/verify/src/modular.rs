//! Check modulo primes: random fields, and ranks and witnesses in one of them.

use num_bigint::BigInt;
use sha2::{Digest, Sha256};

use crate::file::{Functional, Number, RowName, Witness};
use crate::problem::{Matrix, Problem, Ring, Slew, Source, TURN, TurnAxis, times as product};
use crate::{Refused, need, refusal};

/// Random numbers that the writer of a certificate cannot choose: SHA-256 of it, with a counter.
pub(crate) struct Randomness {
    seed: [u8; 32],
    count: u64,
}

impl Randomness {
    pub(crate) fn new(certificate: &[u8]) -> Self {
        Self { seed: Sha256::digest(certificate).into(), count: 0 }
    }

    /// A random number below `m`.
    pub(crate) fn below(&mut self, m: u64) -> u64 {
        let block: [u8; 32] =
            Sha256::new().chain_update(self.seed).chain_update(self.count.to_be_bytes()).finalize().into();
        self.count += 1;
        block[..8].iter().fold(0, |x, &byte| x << 8 | u64::from(byte)) % m
    }
}

pub(crate) fn times(a: u64, b: u64, p: u64) -> u64 {
    (u128::from(a) * u128::from(b) % u128::from(p)) as u64
}

fn power(mut a: u64, mut e: u64, p: u64) -> u64 {
    let mut out = 1;
    while e > 0 {
        if e & 1 == 1 {
            out = times(out, a, p);
        }
        a = times(a, a, p);
        e >>= 1;
    }
    out
}

/// The inverse of a number that is not 0 modulo the prime `p`.
pub(crate) fn inverse(a: u64, p: u64) -> u64 {
    power(a, p - 2, p)
}

/// Miller and Rabin with the first twelve primes, which decides all numbers below 2^64.
pub(crate) fn is_prime(n: u64) -> bool {
    let small = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37];
    if small.iter().any(|q| n.is_multiple_of(*q)) {
        return small.contains(&n);
    }
    let s = (n - 1).trailing_zeros();
    small.iter().all(|&base| {
        let mut x = power(base, (n - 1) >> s, n);
        x == 1
            || x == n - 1
            || (1..s).any(|_| {
                x = times(x, x, n);
                x == n - 1
            })
    })
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Order of the roots of unity that represent all angles.
fn order_of(problem: &Problem) -> u64 {
    let turns = problem.slews.iter().flatten().map(|s| &s.angle);
    let angles = problem.positions.iter().flatten().chain(&problem.latitude).chain(turns);
    TURN as u64 / angles.fold(15_000_000_000, |g, a| gcd(g, a.unsigned_abs()))
}

/// A random prime field with a root of unity and rates.
pub(crate) struct PrimeField {
    pub p: u64,
    z: u64,
    order: u64,
    rates: [u64; 2],
    /// Image of pi.
    pi: u64,
    /// Images of the square roots of 1, 2, 3, 6 at these indices.
    roots: [u64; 7],
}

impl PrimeField {
    pub(crate) fn new(problem: &Problem, random: &mut Randomness) -> Self {
        let order = order_of(problem);
        let first = (1 << 60) / order;
        let p = loop {
            let p = 1 + order * (first + 1 + random.below(first - 1));
            if is_prime(p) {
                break p;
            }
        };
        let z = loop {
            let z = power(2 + random.below(p - 2), (p - 1) / order, p);
            if [2, 3, 5].iter().all(|q| !order.is_multiple_of(*q) || power(z, order / q, p) != 1) {
                break z;
            }
        };
        let mut field = Self { p, z, order, rates: [0; 2], pi: 0, roots: [1; 7] };
        field.rates = [1 + random.below(p - 1), 1 + random.below(p - 1)];
        field.pi = 1 + random.below(p - 1);
        if let Some(latitude) = problem.latitude {
            let (cos, sin) = field.cos_sin(latitude);
            field.rates = [cos, sin].map(|x| times(field.rates[0], x, p));
        }
        let sum = |part| (field.root(part) + field.root(order - part)) % p;
        let (two, three) = (sum(order / 8), sum(order / 12));
        (field.roots[2], field.roots[3], field.roots[6]) = (two, three, times(two, three, p));
        field
    }

    fn root(&self, exponent: u64) -> u64 {
        power(self.z, exponent, self.p)
    }

    fn inverse(&self, a: u64) -> u64 {
        inverse(a, self.p)
    }

    /// The image of an exact number.
    fn image(&self, number: &Number) -> u64 {
        let p = self.p;
        let of = |n: &BigInt| u64::try_from(((n % p) + p) % p).unwrap_or(0);
        let rate =
            |w: u64, e: i32| power(if e < 0 { self.inverse(w) } else { w }, e.unsigned_abs().into(), p);
        number.0.iter().fold(0, |sum, ((r, a, b), q)| {
            let factors = [
                self.inverse(of(q.denom())),
                self.roots[usize::from(*r)],
                rate(self.rates[0], *a),
                rate(self.rates[1], *b),
            ];
            (sum + factors.into_iter().fold(of(q.numer()), |x, y| times(x, y, p))) % p
        })
    }
}

impl PrimeField {
    /// Matrix `a I + b [u x] + c u u^T`.
    fn mixed(&self, u: &[u64], [a, b, c]: [u64; 3]) -> Matrix<u64> {
        let mut out = vec![vec![0; 3]; 3];
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            for (column, slot) in out[i].iter_mut().enumerate() {
                let skew = match column {
                    _ if column == k => u[j],
                    _ if column == j => self.neg(&u[k]),
                    _ => 0,
                };
                let skew = self.mul(&b, &skew);
                let unit = if column == i { a } else { 0 };
                let outer = self.mul(&c, &self.mul(&u[i], &u[column]));
                *slot = self.add(&self.add(&unit, &skew), &outer);
            }
        }
        out
    }

    /// Axis of a turn in c, from the attitude `a` to `to`; zero if the attitudes determine none.
    fn axis(&self, turn: &Slew, a: &Matrix<u64>, to: &Matrix<u64>) -> Vec<u64> {
        let back: Matrix<u64> = (0..3).map(|i| a.iter().map(|row| row[i]).collect()).collect();
        let unit = |i: usize| (0..3).map(|j| u64::from(i == j)).collect::<Vec<u64>>();
        let v = match &turn.about {
            TurnAxis::Platform(i) => return unit(*i),
            TurnAxis::Middle(gamma) => {
                let (cos, sin) = self.cos_sin(*gamma);
                return vec![self.neg(&sin), cos, 0];
            }
            TurnAxis::Geographic(i) => unit(*i),
            TurnAxis::Direction(v) => v.iter().map(|x| self.image(x)).collect(),
            TurnAxis::Shortest => {
                let (r, sin) = (product(self, to, &back), self.cos_sin(turn.angle).1);
                let half = self.inverse(self.add(&sin, &sin));
                let difference =
                    |j: usize, k: usize| self.mul(&half, &self.add(&r[k][j], &self.neg(&r[j][k])));
                vec![difference(1, 2), difference(2, 0), difference(0, 1)]
            }
        };
        let column: Matrix<u64> = v.into_iter().map(|x| vec![x]).collect();
        product(self, &back, &column).into_iter().flatten().collect()
    }

    /// Refuses slews whose axes do not have length 1, or that do not lead from position to position.
    pub(crate) fn check_slews(&self, problem: &Problem) -> Result<(), Refused> {
        let attitudes = problem.attitudes(self);
        for (i, turns) in problem.slews.iter().enumerate() {
            let mut a = attitudes[i.saturating_sub(1)].clone();
            let mut length = true;
            for turn in turns {
                let u = self.axis(turn, &a, &attitudes[i]);
                length &= u.iter().fold(0, |sum, x| self.add(&sum, &self.mul(x, x))) == 1;
                a = self.turned(&a, turn, &u);
            }
            let expected = "turns about axes of length 1 that lead to the position";
            need(length && a == attitudes[i], &format!("problem.slews.{i}"), expected, "others")?;
        }
        Ok(())
    }

    /// Attitude after a turn: `A exp([u x] phi)`.
    fn turned(&self, a: &Matrix<u64>, turn: &Slew, u: &[u64]) -> Matrix<u64> {
        let (cos, sin) = self.cos_sin(turn.angle);
        product(self, a, &self.mixed(u, [cos, sin, self.add(&1, &self.neg(&cos))]))
    }
}

impl Ring for PrimeField {
    type Element = u64;
    fn zero(&self) -> u64 {
        0
    }
    fn one(&self) -> u64 {
        1
    }
    fn add(&self, a: &u64, b: &u64) -> u64 {
        (a + b) % self.p
    }
    fn mul(&self, a: &u64, b: &u64) -> u64 {
        times(*a, *b, self.p)
    }
    fn neg(&self, a: &u64) -> u64 {
        (self.p - a) % self.p
    }
    fn is_zero(&self, a: &u64) -> bool {
        *a == 0
    }
    fn cos_sin(&self, angle: i64) -> (u64, u64) {
        let (turn, order) = (TURN as u64, self.order);
        let z = self.root(angle.rem_euclid(TURN) as u64 / (turn / order));
        let (back, half) = (self.inverse(z), self.p.div_ceil(2));
        let sin = times(times((z + self.p - back) % self.p, half, self.p), self.root(order / 4 * 3), self.p);
        (times((z + back) % self.p, half, self.p), sin)
    }
    fn rates(&self) -> [u64; 2] {
        self.rates
    }
    fn left(&self, problem: &Problem, attitudes: &[Matrix<u64>]) -> Vec<Matrix<u64>> {
        let n = problem.coefficients.len();
        let mut total = vec![vec![0; n]; 3];
        let mut out = Vec::with_capacity(attitudes.len());
        for (i, turns) in problem.slews.iter().enumerate() {
            let mut a = attitudes[i.saturating_sub(1)].clone();
            for turn in turns {
                let u = self.axis(turn, &a, &attitudes[i]);
                let (cos, sin) = self.cos_sin(turn.angle);
                let turn_angle = (turn.angle.rem_euclid(self.p as i64)) as u64;
                let phi = times(times(self.pi, turn_angle, self.p), self.inverse(TURN as u64 / 2), self.p);
                let j = self.mixed(&u, [sin, self.add(&1, &self.neg(&cos)), self.add(&phi, &self.neg(&sin))]);
                // E(u): along the input axis, times the component of u
                let mut e = vec![vec![0; n]; 3];
                for (k, c) in problem.coefficients.iter().enumerate().filter(|(_, c)| c.of == Source::Rate) {
                    let negative = c.factors.iter().fold(c.input.1, |sign, f| sign != f.1);
                    let x = c.factors.iter().fold(1, |x, f| self.mul(&x, &u[f.0]));
                    e[c.input.0][k] = if negative { self.neg(&x) } else { x };
                }
                let jump = product(self, &product(self, &a, &j), &e);
                for (row, jump) in total.iter_mut().zip(&jump) {
                    for (x, y) in row.iter_mut().zip(jump) {
                        *x = self.add(x, y);
                    }
                }
                a = self.turned(&a, turn, &u);
            }
            out.push(total.clone());
        }
        out
    }
}

/// Basis rows, ranks and witnesses in one field.
pub(crate) struct Judged {
    pub basis: Vec<(usize, usize, usize, String)>,
    pub ranks: Vec<usize>,
    pub witnesses: Vec<Witness>,
}

/// Subtracts `factor e` from `v`.
pub(crate) fn subtract(v: &mut [u64], factor: u64, e: &[u64], p: u64) {
    for (x, &y) in v.iter_mut().zip(e).filter(|(_, y)| **y != 0) {
        *x = (*x + p - times(factor, y, p)) % p;
    }
}

/// Images of functionals, as long as a row. Entries that are 0 at the latitude of the problem are
/// refused, such as `wN - wU` at 45 deg.
pub(crate) fn images(
    problem: &Problem,
    field: &PrimeField,
    functionals: &[Functional],
) -> Result<Vec<Vec<u64>>, Refused> {
    let dense = |c: &Functional| {
        let mut v = vec![0; problem.names.len()];
        for (name, number) in &c.0 {
            if let Some(column) = problem.column(name) {
                v[column] = field.image(number);
                need(v[column] != 0, &format!("combinations, {name}"), "a number other than 0", "0")?;
            }
        }
        Ok(v)
    };
    functionals.iter().map(dense).collect()
}

/// Processes rows modulo `p` from the lowest order up: basis rows, pivots, ranks, and the witness of
/// every functional.
pub(crate) fn judge(
    p: u64,
    names: &[String],
    rows: &[(RowName, Vec<u64>)],
    functionals: &[Vec<u64>],
) -> Judged {
    let mut witnesses: Vec<Witness> = functionals.iter().map(|_| Witness::default()).collect();
    let mut form = EchelonForm { p, n: names.len(), reduced: Vec::new() };
    let (mut basis, mut ranks) = (Vec::new(), Vec::new());
    for k in 0..=rows.iter().map(|r| r.0.1).max().unwrap_or(0) {
        for ((i, order, c), row) in rows.iter().filter(|r| r.0.1 == k) {
            if basis.len() == names.len() {
                break;
            }
            if let Some(pivot) = form.insert(row) {
                basis.push((*i, *order, *c, names[pivot].clone()));
            }
        }
        ranks.push(basis.len());
        for (c, witness) in functionals.iter().zip(&mut witnesses).filter(|(_, w)| w.degree.is_none()) {
            let rest = form.rest(c);
            match (0..names.len()).find(|&j| rest[j] != 0) {
                Some(hidden) => witness.hidden_by = Some(names[hidden].clone()),
                None => {
                    let used = basis.iter().enumerate().filter(|(j, _)| rest[names.len() + j] != 0);
                    witness.degree = Some(k);
                    witness.solution = Some(used.map(|(_, (i, k, c, _))| (*i, *k, *c)).collect());
                }
            }
        }
    }
    let last = ranks.iter().position(|r| *r == basis.len()).unwrap_or(0);
    ranks.truncate(last + 1);
    for (c, witness) in functionals.iter().zip(&mut witnesses) {
        set_status(witness, c, rows);
    }
    Judged { basis, ranks, witnesses }
}

/// Reduced echelon form modulo `p` of rows of `n` entries.
struct EchelonForm {
    p: u64,
    n: usize,
    /// Pivots and rows; the columns beyond n hold the combination of basis rows.
    reduced: Vec<(usize, Vec<u64>)>,
}

impl EchelonForm {
    /// Adds a row as the next basis row; returns its pivot, `None` for a combination of the rows before.
    fn insert(&mut self, row: &[u64]) -> Option<usize> {
        let (p, n) = (self.p, self.n);
        let mut v = row.to_vec();
        v.resize(2 * n, 0);
        v[n + self.reduced.len()] = 1;
        for (pivot, e) in &self.reduced {
            let factor = v[*pivot];
            subtract(&mut v, factor, e, p);
        }
        let pivot = (0..n).find(|&j| v[j] != 0)?;
        let scale = inverse(v[pivot], p);
        v.iter_mut().for_each(|x| *x = times(*x, scale, p));
        for (_, e) in &mut self.reduced {
            let factor = e[pivot];
            subtract(e, factor, &v, p);
        }
        self.reduced.push((pivot, v));
        Some(pivot)
    }

    /// Rest of a functional, zero for one in the span; then minus the combination of basis rows.
    fn rest(&self, functional: &[u64]) -> Vec<u64> {
        let mut rest = functional.to_vec();
        rest.resize(2 * self.n, 0);
        for (pivot, e) in self.reduced.iter().filter(|(pivot, _)| functional[*pivot] != 0) {
            subtract(&mut rest, functional[*pivot], e, self.p);
        }
        rest
    }
}

/// Status of a functional by its degree, and the first row that excites one without a degree.
fn set_status(witness: &mut Witness, functional: &[u64], rows: &[(RowName, Vec<u64>)]) {
    let excites = |row: &[u64]| row.iter().zip(functional).any(|(x, c)| *x != 0 && *c != 0);
    let excited = rows.iter().find(|(_, row)| excites(row)).map(|(name, _)| *name);
    let status = match (witness.degree, excited) {
        (Some(_), _) => "observable",
        (None, Some(_)) => "inseparable",
        (None, None) => "not_excited",
    };
    witness.status = status.into();
    witness.excited_by = excited.filter(|_| witness.degree.is_none());
}

/// Number of primes, at least 2, with which a false claim passes with a probability below 1e-12, and
/// that probability; `each` bounds the probability for one prime.
///
/// # Errors
/// [`Refused`] if eight primes do not suffice.
pub(crate) fn primes(each: f64) -> Result<(usize, f64), Refused> {
    let of = |count: usize| each.powi(count as i32);
    let count = (2..=8).find(|&count| of(count) < 1e-12);
    let expected = "a problem that eight primes decide with a probability of error below 1e-12";
    count.map_or_else(|| Err(refusal("problem", expected, "a larger one")), |count| Ok((count, of(count))))
}

/// Bound on the probability that one prime gives a wrong result.
pub(crate) fn error_bound(problem: &Problem, levels: usize, functionals: &[Functional]) -> f64 {
    let terms = |c: &Functional| c.0.values().map(|x| x.0.len()).sum::<usize>();
    let t = functionals[problem.names.len()..].iter().map(terms).max().unwrap_or(0) as f64;
    // decisions for every turn: its axis has length 1, and it leads to the position
    let turns: usize = problem.slews.iter().map(Vec::len).sum();
    chance_of(problem, problem.names.len(), levels * (1 + functionals.len()) + 2 * turns, t)
}

/// Bound as [`error_bound`] for `decisions` decisions about `n` unknowns.
pub(crate) fn chance(problem: &Problem, n: usize, decisions: usize) -> f64 {
    chance_of(problem, n, decisions, 0.0)
}

fn chance_of(problem: &Problem, n: usize, decisions: usize, t: f64) -> f64 {
    let order = order_of(problem);
    let parts = [2, 3, 5].into_iter().filter(|q| order.is_multiple_of(*q));
    let phi = parts.fold(order, |phi, q| phi / q * (q - 1)) as f64;
    let n = n as f64;
    let bits = 3.0 * (problem.factors() as f64 + 1.0) + 9.0 + n.log2() / 2.0 + of_turns(problem);
    let two60 = 2f64.powi(60);
    let prime = (n * bits + 40.0 * (t + 1.0)) * phi * 61.0 * std::f64::consts::LN_2 / (60.0 * two60);
    decisions as f64 * ((5.0 * n + 40.0) / two60 + prime)
}

/// Increase of the binary logarithm of the norm of a row by turns: denominators and absolute values.
fn of_turns(problem: &Problem) -> f64 {
    let half = TURN as u64 / 2;
    let turns: Vec<&Slew> = problem.slews.iter().flatten().collect();
    if turns.is_empty() {
        return 0.0;
    }
    let common = turns.iter().fold(half, |g, turn| gcd(g, turn.angle.unsigned_abs()));
    let largest = turns.iter().map(|turn| turn.angle.unsigned_abs()).max().unwrap_or(0);
    let denominators: BigInt = turns.iter().fold(BigInt::from(1), |all, turn| match &turn.about {
        TurnAxis::Direction(v) => v.iter().flat_map(|x| x.0.values()).fold(all, |all, q| lcm(all, q.denom())),
        _ => all,
    });
    // exponents of 2 and of the common denominator that make an attitude integer, and the largest of a
    // jump
    let (mut two, mut own) = (0, 0);
    for turns in &problem.slews {
        let mut attitude = (3, 0);
        for turn in turns {
            let axis = match turn.about {
                TurnAxis::Platform(_) => (0, 0),
                TurnAxis::Middle(_) => (1, 0),
                TurnAxis::Geographic(_) => attitude,
                TurnAxis::Direction(_) => (attitude.0, attitude.1 + 1),
                TurnAxis::Shortest => (6, 0),
            };
            two = two.max(attitude.0 + 1 + 3 * axis.0);
            own = own.max(attitude.1 + 3 * axis.1);
            attitude = (attitude.0 + 1 + 2 * axis.0, attitude.1 + 2 * axis.1);
        }
    }
    let shortest = turns.iter().filter(|turn| matches!(turn.about, TurnAxis::Shortest)).count();
    f64::from(two)
        + f64::from(own) * (denominators - BigInt::from(1)).bits() as f64
        + 3.0 * shortest as f64
        + (turns.len() as f64).log2()
        + ((half / common) as f64).log2()
        + (4.0 + largest as f64 / half as f64).log2()
        + 3.0
}

/// Least common multiple of positive numbers.
fn lcm(a: BigInt, b: &BigInt) -> BigInt {
    let (mut x, mut y) = (a.clone(), b.clone());
    while y != BigInt::from(0) {
        (x, y) = (y.clone(), x % y);
    }
    a / x * b
}

#[cfg(test)]
mod tests {
    use num_rational::BigRational;

    use super::*;
    use crate::file::{RawAxis, RawGyro, RawProblem, RawTurn};

    type ExactMatrix = Vec<Vec<BigRational>>;

    fn rational(p: i64, q: i64) -> BigRational {
        BigRational::new(p.into(), q.into())
    }

    fn product_of(a: &ExactMatrix, b: &ExactMatrix) -> ExactMatrix {
        let entry = |row: &[BigRational], j: usize| {
            row.iter().zip(b).fold(rational(0, 1), |sum, (x, row)| sum + x * &row[j])
        };
        a.iter().map(|row| (0..3).map(|j| entry(row, j)).collect()).collect()
    }

    /// Matrix `a 1 + b [u x] + c u u^T`.
    fn mixed(u: &[BigRational], [a, b, c]: [i64; 3]) -> ExactMatrix {
        let [a, b, c] = [a, b, c].map(|x| rational(x, 1));
        let skew = [
            [None, Some((2, -1)), Some((1, 1))],
            [Some((2, 1)), None, Some((0, -1))],
            [Some((1, -1)), Some((0, 1)), None],
        ];
        let entry = |i: usize, j: usize| {
            let unit = if i == j { a.clone() } else { rational(0, 1) };
            let cross =
                skew[i][j].map_or(rational(0, 1), |(k, sign): (usize, i64)| rational(sign, 1) * &u[k]);
            unit + &b * cross + &c * &u[i] * &u[j]
        };
        (0..3).map(|i| (0..3).map(|j| entry(i, j)).collect()).collect()
    }

    /// Axis of length 1 with denominator `m^2 + n^2`.
    fn direction(m: i64, n: i64) -> Vec<BigRational> {
        let q = m * m + n * n;
        vec![rational(m * m - n * n, q), rational(2 * m * n, q), rational(0, 1)]
    }

    /// Half turns about rational directions, in exact arithmetic. The denominators of the effects of
    /// turns (`A J u`, the parts with and without pi) stay within the bits allowed for them, which are
    /// many for a denominator near 2^31.
    #[test]
    fn bits_of_turns_hold_the_denominators() {
        for parameters in
            [vec![(2, 1)], vec![(46_340, 1)], vec![(2, 1), (3, 2)], vec![(40_001, 2), (5, 4), (46_340, 1)]]
        {
            let identity = mixed(&[rational(0, 1), rational(0, 1), rational(0, 1)], [1, 0, 0]);
            let (mut a, mut denominators) = (identity, BigInt::from(1));
            let mut turns = Vec::new();
            for &(m, n) in &parameters {
                let v = direction(m, n);
                let u: Vec<BigRational> =
                    (0..3).map(|j| (0..3).fold(rational(0, 1), |sum, i| sum + &a[i][j] * &v[i])).collect();
                for parts in [[0, 2, 0], [0, 0, 1]] {
                    let jump = product_of(&a, &mixed(&u, parts));
                    for x in jump.iter().flatten().flat_map(|x| u.iter().map(move |u| x * u)) {
                        denominators = lcm(denominators, x.denom());
                    }
                }
                a = product_of(&a, &mixed(&u, [-1, 0, 2]));
                let number = |x: &BigRational| {
                    let zero = *x == rational(0, 1);
                    Number(if zero { [].into() } else { [((1, 0, 0), x.clone())].into() })
                };
                let about = RawAxis::Direction([number(&v[0]), number(&v[1]), number(&v[2])]);
                turns.push(RawTurn { about: Some(about), angle_deg: "180".into() });
            }
            let axes = |i: &str, o: &str, s: &str| RawGyro { I: i.into(), O: o.into(), S: s.into() };
            let zero = || ["0", "0", "0"].map(String::from);
            let problem = Problem::new(&RawProblem {
                carry: "inertial".into(),
                latitude_deg: None,
                measured_azimuth: false,
                terms: vec!["GS".into()],
                gyros: [axes("+x", "-z", "+y"), axes("+y", "-z", "-x"), axes("+z", "+x", "+y")],
                accelerometers: ["+x", "+y", "+z"].map(String::from),
                positions: vec![zero(), zero()],
                slews: Some(vec![Vec::new(), turns]),
            });
            let Ok(problem) = problem else { panic!("a problem") };
            let bits = of_turns(&problem);
            assert!(denominators.bits() as f64 <= bits, "{parameters:?}: {} {bits}", denominators.bits());
            assert!(
                parameters.len() > 1 || denominators.bits() as f64 > bits - 40.0,
                "{parameters:?}: {bits}"
            );
        }
    }
}

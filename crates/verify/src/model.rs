//! Certificates of rational models: the equations as a straight-line program, evaluated at random points
//! modulo random primes.

use serde::Deserialize;

use num_bigint::{BigInt, BigUint};

use crate::file::{Claimed, RowName};
use crate::modular::{Randomness, inverse, is_prime, judge, primes, times};
use crate::{Claim, Refused, by_primes, compare, need, no_coefficients, parsed, refusal, same, sentence};

pub(crate) const LAYOUT: &str = "obsdeg.model-certificate/1";

/// Length of a subexpression's text above which it gets a name of its own.
const LONG: usize = 200;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ModelCertificate {
    #[serde(rename = "layout")]
    _layout: String,
    problem: RawModel,
    unknowns: Vec<String>,
    ranks: Vec<usize>,
    basis: Vec<(usize, usize, usize, String)>,
    verdicts: Vec<Claimed>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawModel {
    states: Vec<String>,
    parameters: Vec<String>,
    constants: Vec<String>,
    inputs: Vec<(String, Option<usize>)>,
    program: Vec<RawOperation>,
    rates: Vec<usize>,
    outputs: Vec<(String, usize)>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum RawOperation {
    Number(String, String),
    Binary(String, usize, usize),
}

/// Operation of the program; operands are indices of slots, then of operations before it.
enum Operation {
    /// Numerator, denominator, and the fraction as text.
    Number(BigInt, BigUint, String),
    Binary(char, usize, usize),
}

/// Checked model.
struct Model {
    raw: RawModel,
    /// States and parameters, then constants, then inputs.
    slots: Vec<String>,
    unknowns: usize,
    program: Vec<Operation>,
}

/// Checks the certificate of a model.
pub(crate) fn verify(certificate: &[u8], compared: bool) -> Result<Vec<String>, Refused> {
    need(
        !compared,
        "scheme file",
        "no file beside the certificate of a model: compare its equations",
        "one",
    )?;
    let file: ModelCertificate = parsed(certificate)?;
    let model = Model::new(file.problem)?;
    let names = model.slots[..model.unknowns].to_vec();
    let n = names.len();
    same("unknowns", &file.unknowns, &names)?;
    let last = file.ranks.len();
    let grows = file.ranks.windows(2).all(|pair| pair[0] < pair[1]);
    let form = grows && file.ranks.last().is_some_and(|rank| *rank <= n);
    need(
        form,
        "ranks",
        "numbers up to that of unknowns, each larger than the one before",
        format!("{:?}", file.ranks),
    )?;
    need(file.verdicts.len() == n, "verdicts", &format!("{n} entries"), file.verdicts.len())?;
    let mut claims: Vec<Claim<'_>> = Vec::new();
    for (i, (verdict, name)) in file.verdicts.iter().zip(&names).enumerate() {
        same(&format!("verdicts.{i}.unknown"), verdict.unknown.as_ref().unwrap_or(&String::new()), name)?;
        need(verdict.terms.is_none(), &format!("verdicts.{i}"), "no terms", "some")?;
        claims.push((name.clone(), &verdict.witness));
    }
    no_coefficients(&claims)?;
    let (count, bound) = primes(model.error_bound(last))?;
    let unit = |i: usize| (0..n).map(|j| u64::from(i == j)).collect::<Vec<u64>>();
    let functionals: Vec<Vec<u64>> = (0..n).map(unit).collect();
    let mut random = Randomness::new(certificate);
    for _ in 0..count {
        let p = loop {
            let p = (1 << 60) + 1 + 2 * random.below(1 << 59);
            if is_prime(p) {
                break p;
            }
        };
        let rows = model.rows(p, &mut random, last)?;
        compare(&judge(p, &names, &rows, &functionals), &file.ranks, &file.basis, &claims)?;
    }
    let how = by_primes(count, bound);
    let mut out: Vec<String> = claims.iter().map(|claim| sentence(claim, &how)).collect();
    out.push(format!("Rank {} of {n}; verified {how}.", file.basis.len()));
    out.extend(model.equations());
    out.push(
        "Assumption: the equations above, at almost all starts, parameters, constants and inputs.".into(),
    );
    Ok(out)
}

/// True for at most 256 letters, digits and `_ [ ] , . @ '`, with a letter or `_` first: such a name
/// cannot pass for an expression or for a sentence of the answer.
fn is_name(name: &str) -> bool {
    let first = name.chars().next().is_some_and(|c| c.is_alphabetic() || c == '_');
    first && name.chars().count() <= 256 && name.chars().all(|c| c.is_alphanumeric() || "_[],.@'".contains(c))
}

impl Model {
    fn new(raw: RawModel) -> Result<Self, Refused> {
        let inputs = raw.inputs.iter().map(|input| &input.0);
        let slots: Vec<String> =
            raw.states.iter().chain(&raw.parameters).chain(&raw.constants).chain(inputs).cloned().collect();
        let wrong = slots.iter().chain(raw.outputs.iter().map(|o| &o.0)).find(|name| !is_name(name));
        if let Some(name) = wrong {
            return Err(refusal(
                "problem",
                "names of letters, digits and _ that begin with a letter or _",
                name,
            ));
        }
        let mut sorted: Vec<&String> = slots.iter().collect();
        sorted.sort();
        let twice = sorted.windows(2).find(|pair| pair[0] == pair[1]);
        need(twice.is_none(), "problem", "different names", "one twice")?;
        let unknowns = raw.states.len() + raw.parameters.len();
        need((1..=300).contains(&unknowns), "problem", "1 to 300 unknowns", unknowns)?;
        need(slots.len() <= 1000, "problem", "at most 1000 names", slots.len())?;
        need(raw.program.len() <= 20_000, "problem.program", "at most 20000 operations", raw.program.len())?;
        need(
            raw.inputs.iter().all(|i| i.1.is_none_or(|d| d <= 50)),
            "problem.inputs",
            "degrees up to 50",
            "more",
        )?;
        need(raw.rates.len() == raw.states.len(), "problem.rates", "one rate per state", raw.rates.len())?;
        need(
            (1..=100).contains(&raw.outputs.len()),
            "problem.outputs",
            "1 to 100 outputs",
            raw.outputs.len(),
        )?;
        let mut program = Vec::with_capacity(raw.program.len());
        for (i, operation) in raw.program.iter().enumerate() {
            let place = format!("problem.program.{i}");
            program.push(match operation {
                RawOperation::Number(kind, text) if kind == "=" => number(&place, text)?,
                RawOperation::Binary(kind, a, b)
                    if ["+", "-", "*", "/"].contains(&kind.as_str()) && (*a).max(*b) < slots.len() + i =>
                {
                    Operation::Binary(kind.chars().next().unwrap_or('+'), *a, *b)
                }
                _ => {
                    return Err(refusal(
                        &place,
                        "a number or an operation on values before it",
                        "another entry",
                    ));
                }
            });
        }
        let end = slots.len() + program.len();
        let known = raw.rates.iter().chain(raw.outputs.iter().map(|o| &o.1)).all(|&node| node < end);
        need(known, "problem", "rates and outputs among the values", "another index")?;
        Ok(Self { raw, slots, unknowns, program })
    }

    /// Derivatives of the Taylor coefficients of all outputs with respect to the unknowns, of orders 0
    /// to `last`, at a random point modulo `p`.
    fn rows(
        &self,
        p: u64,
        random: &mut Randomness,
        last: usize,
    ) -> Result<Vec<(RowName, Vec<u64>)>, Refused> {
        let (states, slots) = (self.raw.states.len(), self.slots.len());
        let first_input = slots - self.raw.inputs.len();
        let mut series: Vec<Series> = (0..slots + self.program.len()).map(|_| Series::default()).collect();
        let mut rows = Vec::new();
        for k in 0..=last {
            for slot in 0..slots {
                let degree =
                    slot.checked_sub(first_input).map(|i| self.raw.inputs[i].1.unwrap_or(usize::MAX));
                let (value, dual) = if slot < states && k > 0 {
                    let rate = &series[self.raw.rates[slot]];
                    let factor = inverse(k as u64, p);
                    (times(rate.values[k - 1], factor, p), scaled(factor, &rate.duals[k - 1], p))
                } else if k == 0 && slot < self.unknowns {
                    (random.below(p), (0..self.unknowns).map(|j| u64::from(j == slot)).collect())
                } else {
                    let value = if k <= degree.unwrap_or(0) { random.below(p) } else { 0 };
                    (value, Vec::new())
                };
                series[slot].push(value, dual);
            }
            for (i, operation) in self.program.iter().enumerate() {
                let (value, dual) = match operation {
                    Operation::Number(numerator, denominator, _) if k == 0 => {
                        let of = |x: BigInt| u64::try_from((x % p + p) % p).unwrap_or(0);
                        let (a, b) = (of(numerator.clone()), of(denominator.clone().into()));
                        need(
                            b != 0,
                            &format!("problem.program.{i}"),
                            "a denominator that p does not divide",
                            "another",
                        )?;
                        (times(a, inverse(b, p), p), Vec::new())
                    }
                    Operation::Number(..) => (0, Vec::new()),
                    Operation::Binary(kind, a, b) => {
                        let of = (&series[*a], &series[*b], &series[slots + i]);
                        let value = term(*kind, of, k, p);
                        value.ok_or_else(|| {
                            refusal(&format!("problem.program.{i}"), "a divisor other than 0", "0")
                        })?
                    }
                };
                series[slots + i].push(value, dual);
            }
            for (c, (_, node)) in self.raw.outputs.iter().enumerate() {
                let mut row = series[*node].duals[k].clone();
                row.resize(self.unknowns, 0);
                rows.push(((1, k, c + 1), row));
            }
        }
        Ok(rows)
    }

    /// Bound on the probability that one prime gives a wrong result, with rows of orders 0 to `last`.
    fn error_bound(&self, last: usize) -> f64 {
        let mut sizes = vec![Size { degrees: [1.0, 0.0], bits: [0.0, 0.0] }; self.slots.len()];
        for operation in &self.program {
            sizes.push(match operation {
                Operation::Number(p, q, _) => {
                    let bits = |x: &BigUint| if *x == BigUint::from(0u8) { 0 } else { (x - 1u8).bits() };
                    Size { degrees: [0.0; 2], bits: [bits(p.magnitude()) as f64, bits(q) as f64] }
                }
                Operation::Binary(kind, a, b) => Size::of(*kind, sizes[*a], sizes[*b]),
            });
        }
        let used: Vec<Size> = self
            .raw
            .rates
            .iter()
            .chain(self.raw.outputs.iter().map(|o| &o.1))
            .map(|&node| sizes[node])
            .collect();
        // the common denominator, and the numerators above it
        let common = |part: fn(&Size) -> [f64; 2]| {
            let denominator: f64 = used.iter().map(|s| part(s)[1]).sum();
            let over = |s: &Size| part(s)[0] + denominator - part(s)[1];
            [used.iter().map(over).fold(0.0, f64::max), denominator]
        };
        let ([d_n, d_d], [b_n, b_d]) = (common(|s| s.degrees), common(|s| s.bits));
        let n = self.unknowns as f64;
        let variables = (self.raw.states.len() + self.raw.inputs.len() * (last + 1)) as f64;
        let (mut degree, mut bits) = (d_n, b_n);
        for k in 0..last {
            let derivative = (degree + (2 * k + 1) as f64 * d_d).max(1.0);
            bits += (variables * derivative).log2() + b_n + 2.0 * b_d;
            degree += d_n.max(d_d) + d_d;
        }
        bits += b_d + (degree + (2 * last + 1) as f64 * d_d).max(1.0).log2();
        degree += d_d;
        let two60 = 2f64.powi(60);
        let prime = n * (bits + n.log2()) * 61.0 * std::f64::consts::LN_2 / (60.0 * two60);
        last as f64 * (1.0 + n) * (n * degree / two60 + prime)
    }

    /// Equations in the names of the model; long subexpressions have names of their own.
    fn equations(&self) -> Vec<String> {
        let (mut texts, mut out) = (self.slots.clone(), Vec::new());
        for operation in &self.program {
            let text = match operation {
                Operation::Number(_, _, text) if text.bytes().all(|b| b.is_ascii_digit()) => text.clone(),
                Operation::Number(_, _, text) => format!("({text})"),
                Operation::Binary(kind, a, b) => format!("({} {kind} {})", texts[*a], texts[*b]),
            };
            let name = format!("#{}", texts.len());
            texts.push(if text.chars().count() > LONG { name.clone() } else { text.clone() });
            if text.chars().count() > LONG {
                out.push(format!("Abbreviation: {name} = {text}."));
            }
        }
        let states = self.raw.states.iter().zip(&self.raw.rates);
        out.extend(states.map(|(name, node)| format!("Equation: {name}' = {}.", texts[*node])));
        let outputs = self.raw.outputs.iter().enumerate();
        out.extend(outputs.map(|(i, (name, node))| format!("Output {}: {name} = {}.", i + 1, texts[*node])));
        out
    }
}

/// A fraction in lowest terms, `p` or `p/q`.
fn number(place: &str, text: &str) -> Result<Operation, Refused> {
    let (numerator, denominator) = text.split_once('/').unwrap_or((text, "1"));
    let digits = |s: &str| (1..=400).contains(&s.len()) && s.bytes().all(|b| b.is_ascii_digit());
    let form = digits(numerator.strip_prefix('-').unwrap_or(numerator)) && digits(denominator);
    let read = (numerator.parse::<BigInt>(), denominator.parse::<BigUint>());
    match read {
        (Ok(p), Ok(q)) if form && q != BigUint::from(0u8) => Ok(Operation::Number(p, q, text.into())),
        _ => Err(refusal(place, "a fraction such as -3/10", text)),
    }
}

/// Taylor coefficients of a value, and their derivatives with respect to the unknowns; empty for zeros.
#[derive(Default)]
struct Series {
    values: Vec<u64>,
    duals: Vec<Vec<u64>>,
}

impl Series {
    fn push(&mut self, value: u64, dual: Vec<u64>) {
        self.values.push(value);
        self.duals.push(dual);
    }
}

fn scaled(factor: u64, v: &[u64], p: u64) -> Vec<u64> {
    v.iter().map(|&x| times(factor, x, p)).collect()
}

/// Adds `factor v` to `out`.
fn add(out: &mut Vec<u64>, factor: u64, v: &[u64], p: u64) {
    if factor != 0 && !v.is_empty() {
        out.resize(v.len(), 0);
        for (x, &y) in out.iter_mut().zip(v) {
            *x = (*x + times(factor, y, p)) % p;
        }
    }
}

/// Coefficient `k` of `c = a kind b`, with the lower ones known; `None` where a divisor is 0.
fn term(kind: char, (a, b, c): (&Series, &Series, &Series), k: usize, p: u64) -> Option<(u64, Vec<u64>)> {
    let (mut value, mut dual) = (0, Vec::new());
    match kind {
        '*' => {
            for i in 0..=k {
                value = (value + times(a.values[i], b.values[k - i], p)) % p;
                add(&mut dual, b.values[k - i], &a.duals[i], p);
                add(&mut dual, a.values[i], &b.duals[k - i], p);
            }
        }
        '/' => {
            if b.values[0] == 0 {
                return None;
            }
            // b c = a, solved for the last coefficient of c
            for i in 1..=k {
                value = (value + times(b.values[i], c.values[k - i], p)) % p;
                add(&mut dual, b.values[i], &c.duals[k - i], p);
                add(&mut dual, c.values[k - i], &b.duals[i], p);
            }
            let factor = inverse(b.values[0], p);
            value = times((a.values[k] + p - value) % p, factor, p);
            add(&mut dual, value, &b.duals[0], p);
            dual.iter_mut().for_each(|x| *x = (p - *x) % p);
            add(&mut dual, 1, &a.duals[k], p);
            dual = scaled(factor, &dual, p);
        }
        _ => {
            let sign = if kind == '-' { p - 1 } else { 1 };
            value = (a.values[k] + times(sign, b.values[k], p)) % p;
            add(&mut dual, 1, &a.duals[k], p);
            add(&mut dual, sign, &b.duals[k], p);
        }
    }
    Some((value, dual))
}

/// Bounds for a quotient of polynomials with integer coefficients, numerator then denominator: degrees,
/// and binary logarithms of the sums of the absolute coefficients.
#[derive(Clone, Copy)]
struct Size {
    degrees: [f64; 2],
    bits: [f64; 2],
}

impl Size {
    fn of(kind: char, a: Self, b: Self) -> Self {
        let combined = |[an, ad]: [f64; 2], [bn, bd]: [f64; 2], carry: f64| match kind {
            '*' => [an + bn, ad + bd],
            '/' => [an + bd, ad + bn],
            _ => [(an + bd).max(bn + ad) + carry, ad + bd],
        };
        Self { degrees: combined(a.degrees, b.degrees, 0.0), bits: combined(a.bits, b.bits, 1.0) }
    }
}

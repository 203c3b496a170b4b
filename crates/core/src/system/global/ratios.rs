//! Ratios of the coefficients of a relation, as rational functions of the constants: their degrees and
//! gradients from values on lines, and the functions themselves by interpolation.

use std::collections::{BTreeMap, BTreeSet};

use obsdeg_exact::dense::ColumnEchelon;
use obsdeg_exact::groebner::{OverLimit, RemainingWork};
use obsdeg_exact::multivariate::Polynomial;
use obsdeg_exact::reconstruct::{Abscissae, Quotient};
use obsdeg_exact::{Field, SplitMix64};

use super::jets::JetSource;
use super::relation::Relation;

/// Highest degree of numerator and denominator of a ratio that is used.
const DEGREE: usize = 6;
/// Number of points on a line through all constants, and on one along a constant.
const LINE: usize = 16;
const ALONG: usize = 8;
/// Largest number of ratios of a relation that are kept, lowest degrees first.
const KEPT: usize = 1500;
/// Number of points that confirm an interpolation, beyond those that determine it.
const SPARE: usize = 3;

/// Ratio of two coefficients of a relation that is not constant.
#[derive(Debug, Clone)]
pub(super) struct CoefficientRatio {
    pub(super) relation: usize,
    above: usize,
    below: usize,
    /// Total degrees of numerator and denominator.
    degrees: (usize, usize),
    /// Degrees of numerator and denominator in each variable.
    own: Vec<(usize, usize)>,
    /// Derivative at the base point by each variable.
    pub(super) gradient: Vec<u64>,
}

/// Coefficients of a relation at the points of a line through the base point.
fn on_line(
    source: &JetSource<'_>,
    relation: &Relation,
    at: &[u64],
    direction: &[(usize, u64)],
    first: Option<&Vec<u64>>,
    number: usize,
    (rng, work): (&mut SplitMix64, &mut RemainingWork),
) -> Result<Vec<Vec<u64>>, OverLimit> {
    let f = source.f;
    let mut out: Vec<Vec<u64>> = first.into_iter().cloned().collect();
    for s in out.len()..number {
        let mut here = at.to_vec();
        for &(unknown, speed) in direction {
            here[unknown] = f.add(here[unknown], f.mul(speed, f.from_u64(s as u64)));
        }
        out.push(relation.coefficients(source, &here, rng, work)?.ok_or(OverLimit)?);
    }
    Ok(out)
}

/// Coefficients on a line, with their inverses.
struct LineValues {
    f: Field,
    abscissae: Abscissae,
    values: Vec<Vec<u64>>,
    inverses: Vec<Vec<u64>>,
}

impl LineValues {
    fn new(f: Field, values: Vec<Vec<u64>>) -> Self {
        let inverses = values.iter().map(|v| v.iter().map(|&x| f.inv(x)).collect()).collect();
        Self { f, abscissae: Abscissae::new(&f, values.len()), values, inverses }
    }

    fn ratio(&self, s: usize, i: usize, j: usize) -> u64 {
        self.f.mul(self.values[s][i], self.inverses[s][j])
    }

    fn rational(&self, i: usize, j: usize) -> Option<Quotient> {
        let ys: Vec<u64> = (0..self.values.len()).map(|s| self.ratio(s, i, j)).collect();
        self.abscissae.rational(&ys)
    }
}

/// Ratios of a relation's coefficients at the base point `at`, as functions of `variables`, low degrees
/// first.
///
/// # Errors
/// [`OverLimit`].
pub(super) fn ratios(
    source: &JetSource<'_>,
    (number, relation): (usize, &Relation),
    at: &[u64],
    variables: &[usize],
    rng: &mut SplitMix64,
    work: &mut RemainingWork,
) -> Result<Vec<CoefficientRatio>, OverLimit> {
    let f = source.f;
    let direction: Vec<(usize, u64)> = variables.iter().map(|&v| (v, rng.below(f.modulus()))).collect();
    let line = on_line(source, relation, at, &direction, None, LINE, (&mut *rng, &mut *work))?;
    let base = line[0].clone();
    let line = LineValues::new(f, line);
    let mut along = Vec::new();
    for &v in variables {
        let both = (&mut *rng, &mut *work);
        let values = on_line(source, relation, at, &[(v, f.one())], Some(&base), ALONG, both)?;
        along.push(LineValues::new(f, values));
    }
    let size = base.len();
    let mut seen: BTreeSet<u64> = BTreeSet::new();
    let mut low: Vec<(usize, usize, usize, (usize, usize))> = Vec::new();
    for j in 0..size {
        for i in 0..j {
            let (first, second) = (line.ratio(0, i, j), line.ratio(1, i, j));
            if first == second || second == 0 || line.values[0][j] == 0 || line.values[1][j] == 0 {
                continue;
            }
            let inverse = line.ratio(1, j, i);
            // the same function, its opposite, or its inverse
            let again = [second, f.neg(second), inverse, f.neg(inverse)];
            if again.iter().any(|x| seen.contains(x)) {
                continue;
            }
            work.take((LINE * LINE * 8) as u64)?;
            seen.insert(second);
            if let Some(q) = line.rational(i, j) {
                let (a, b) = q.degrees();
                if a.max(b) <= DEGREE {
                    low.push((a + b, i, j, (a, b)));
                }
            }
        }
    }
    low.sort_unstable();
    low.truncate(KEPT);
    let mut out = Vec::new();
    for (_, above, below, degrees) in low {
        work.take((variables.len() * ALONG * ALONG * 8) as u64)?;
        let parts = along.iter().map(|values| {
            let q = values.rational(above, below)?;
            Some((q.degrees(), q.slope_at_zero(&f)?))
        });
        if let Some(parts) = parts.collect::<Option<Vec<_>>>() {
            let (own, gradient) = parts.into_iter().unzip();
            out.push(CoefficientRatio { relation: number, above, below, degrees, own, gradient });
        }
    }
    Ok(out)
}

/// Exponents of total degree up to `total` and of each variable up to its limit, sorted by degree.
fn boxed(total: usize, limits: &[usize]) -> Vec<Vec<usize>> {
    let mut out = vec![(0, Vec::new())];
    for &limit in limits {
        let longer = out.into_iter().flat_map(|(d, e): (usize, Vec<usize>)| {
            (0..=limit.min(total - d)).map(move |k| (d + k, [&e[..], &[k]].concat()))
        });
        out = longer.collect();
    }
    out.sort_unstable();
    out.into_iter().map(|e| e.1).collect()
}

/// Number of [`boxed`] exponents.
fn boxed_count(total: usize, limits: &[usize]) -> usize {
    let mut table = vec![0usize; total + 1];
    table[0] = 1;
    for &limit in limits.iter().filter(|l| **l > 0) {
        let before = table.clone();
        for (d, x) in table.iter_mut().enumerate() {
            *x = (d.saturating_sub(limit)..=d).fold(0, |s: usize, k| s.saturating_add(before[k]));
        }
    }
    table.iter().fold(0, |s: usize, &x| s.saturating_add(x))
}

impl CoefficientRatio {
    /// Limits of the degrees in the open variables, of the numerator or (`below`) of the denominator.
    fn limits(&self, open: &[usize], below: bool) -> Vec<usize> {
        open.iter().map(|&k| if below { self.own[k].1 } else { self.own[k].0 }).collect()
    }

    /// Number of evaluations that the interpolation in the open variables (indices in the list of variables)
    /// takes.
    pub(super) fn cost(&self, open: &[usize]) -> usize {
        let (above, below) = (self.limits(open, false), self.limits(open, true));
        let unknown = boxed_count(self.degrees.0, &above).saturating_add(boxed_count(self.degrees.1, &below));
        unknown.saturating_add(SPARE)
    }
}

/// Random values of the open variables, with the coefficients of relations at them.
pub(super) struct Pool<'s, 'a> {
    source: &'s JetSource<'a>,
    relations: &'s [Relation],
    at: Vec<u64>,
    /// Unknowns that are drawn.
    open: Vec<usize>,
    drawn: Vec<Vec<u64>>,
    coefficients: BTreeMap<usize, Vec<Vec<u64>>>,
}

impl<'s, 'a> Pool<'s, 'a> {
    pub(super) fn new(
        source: &'s JetSource<'a>,
        relations: &'s [Relation],
        at: &[u64],
        open: Vec<usize>,
    ) -> Self {
        let (at, drawn) = (at.to_vec(), Vec::new());
        Self { source, relations, at, open, drawn, coefficients: BTreeMap::new() }
    }

    fn fill(
        &mut self,
        relation: usize,
        number: usize,
        rng: &mut SplitMix64,
        work: &mut RemainingWork,
    ) -> Result<(), OverLimit> {
        let f = self.source.f;
        while self.drawn.len() < number {
            let mut here = self.at.clone();
            self.open.iter().for_each(|&v| here[v] = rng.below(f.modulus()));
            self.drawn.push(here);
        }
        let known = self.coefficients.entry(relation).or_default();
        while known.len() < number {
            let here = &self.drawn[known.len()];
            let found = self.relations[relation].coefficients(self.source, here, rng, work)?;
            known.push(found.ok_or(OverLimit)?);
        }
        Ok(())
    }

    /// Numerator and denominator of a ratio as polynomials in the open variables (numbered as unknowns);
    /// `None` if the points contradict its degrees.
    ///
    /// # Errors
    /// [`OverLimit`].
    pub(super) fn function(
        &mut self,
        ratio: &CoefficientRatio,
        open: &[usize],
        rng: &mut SplitMix64,
        work: &mut RemainingWork,
    ) -> Result<Option<[Polynomial; 2]>, OverLimit> {
        let f = self.source.f;
        let above = boxed(ratio.degrees.0, &ratio.limits(open, false));
        let below = boxed(ratio.degrees.1, &ratio.limits(open, true));
        let size = above.len() + below.len();
        self.fill(ratio.relation, size + SPARE, rng, work)?;
        let product = |e: &Vec<usize>, here: &[u64]| {
            let factors = e.iter().zip(&self.open).filter(|p| *p.0 > 0);
            factors.fold(f.one(), |x, (&k, &v)| f.mul(x, f.pow(here[v], k as u64)))
        };
        let coefficients = &self.coefficients[&ratio.relation];
        let row = |(here, c): (&Vec<u64>, &Vec<u64>)| -> Vec<u64> {
            let (n, d) = (c[ratio.above], f.neg(c[ratio.below]));
            // numerator * d - denominator * n = 0
            let first = above.iter().map(|e| f.mul(d, product(e, here)));
            first.chain(below.iter().map(|e| f.mul(n, product(e, here)))).collect()
        };
        work.take((size * size * 4) as u64)?;
        let rows = self.drawn[..size + SPARE].iter().zip(coefficients).map(row).collect();
        let echelon = ColumnEchelon::new(&f, size, rows, work)?;
        let Some(&free) = echelon.free().first().filter(|c| **c >= above.len()) else { return Ok(None) };
        let c = echelon.dependency(free);
        let polynomial = |exponents: &[Vec<usize>], c: &[u64]| {
            let mut out = Polynomial::default();
            for (e, &c) in exponents.iter().zip(c) {
                let powers = e.iter().zip(&self.open).filter(|p| *p.0 > 0);
                let mut m: Vec<(u32, u32)> = powers.map(|(&k, &v)| (v as u32, k as u32)).collect();
                m.sort_unstable();
                out.put(&f, m, c);
            }
            out
        };
        let parts = c.split_at(above.len());
        Ok(Some([polynomial(&above, parts.0), polynomial(&below, parts.1)]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_counted() {
        for (total, limits) in [(0, vec![3, 1]), (3, vec![2, 0, 1, 3]), (5, vec![1, 1, 1]), (2, vec![])] {
            let list = boxed(total, &limits);
            assert_eq!(list.len(), boxed_count(total, &limits));
            let brute = (0..4usize.pow(limits.len() as u32)).filter(|code| {
                let e: Vec<usize> = (0..limits.len()).map(|i| code / 4usize.pow(i as u32) % 4).collect();
                e.iter().sum::<usize>() <= total && e.iter().zip(&limits).all(|(e, l)| e <= l)
            });
            assert_eq!(list.len(), brute.count());
        }
    }
}

//! Polynomial relations among jets, found as dependencies among products of jets at random points, small
//! ones first.

use std::collections::BTreeMap;

use obsdeg_exact::dense::ColumnEchelon;
use obsdeg_exact::groebner::{OverLimit, RemainingWork};
use obsdeg_exact::{Field, SplitMix64};

use super::jets::{BEYOND, Jet, JetSource, JetStructure};

/// Largest number of products of jets among which a relation is sought.
const MONOMIALS: usize = 4000;
/// First budget of products; it doubles up to [`MONOMIALS`].
const FIRST: usize = 60;
/// Highest degree of a product.
const DEGREE: usize = 8;
/// Largest number of products among which all relations of all outputs are sought at once.
const TOGETHER: usize = 400;
/// Number of points beyond the number of products: a dependency that holds at all of them is a relation.
const SPARE: usize = 4;

/// Exponents, one per jet.
type Exponents = Vec<u8>;

/// Relation `sum_i c_i m_i(jets) = 0`, the only one among its products up to a factor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Relation {
    jets: Vec<Jet>,
    pub(super) products: Vec<Exponents>,
}

/// Degree and weighted degree of a product.
fn degrees(e: &[u8], weights: &[usize]) -> (usize, usize) {
    let degree = e.iter().map(|&k| usize::from(k)).sum();
    (degree, e.iter().zip(weights).map(|(&k, w)| usize::from(k) * w).sum())
}

/// Numbers of exponents of degree up to `degree`, one for each largest weighted degree up to `weighted`.
fn counts(weights: &[usize], degree: usize, weighted: usize) -> Vec<usize> {
    // indexed by degree and weighted degree
    let mut table = vec![vec![0usize; weighted + 1]; degree + 1];
    table[0][0] = 1;
    for &w in weights {
        for d in 1..=degree {
            for e in w..=weighted {
                table[d][e] = table[d][e].saturating_add(table[d - 1][e - w]);
            }
        }
    }
    let mut sum = 0usize;
    let of = |e: usize| table.iter().fold(0, |s: usize, row| s.saturating_add(row[e]));
    let mut up_to = |e: usize| {
        sum = sum.saturating_add(of(e));
        sum
    };
    (0..=weighted).map(&mut up_to).collect()
}

/// Number of exponents of a degree and a weighted degree up to a limit.
fn count(weights: &[usize], degree: usize, weighted: usize) -> usize {
    counts(weights, degree, weighted)[weighted]
}

/// All exponents up to a degree and a weighted degree, sorted by degree and then by the last jets.
fn exponents(weights: &[usize], degree: usize, weighted: usize) -> Vec<Exponents> {
    let mut out = vec![(Exponents::new(), 0, 0)];
    for &w in weights {
        let longer = out.into_iter().flat_map(|(e, d, s): (Exponents, usize, usize)| {
            let most = (weighted - s).checked_div(w).map_or(degree - d, |most| most.min(degree - d));
            (0..=most).map(move |k| ([&e[..], &[k as u8]].concat(), d + k, s + k * w))
        });
        out = longer.collect();
    }
    out.sort_by_cached_key(|e| (e.1, e.0.iter().rev().copied().collect::<Vec<u8>>()));
    out.into_iter().map(|e| e.0).collect()
}

/// Value of every product at a point.
fn values(f: &Field, products: &[Exponents], point: &[u64]) -> Vec<u64> {
    let most = products.iter().flatten().copied().max().unwrap_or(0);
    let mut powers = vec![vec![f.one(); point.len()]];
    for k in 0..usize::from(most) {
        powers.push(powers[k].iter().zip(point).map(|(&a, &b)| f.mul(a, b)).collect());
    }
    let value = |e: &Exponents| {
        let factors = e.iter().enumerate().filter(|p| *p.1 > 0);
        factors.fold(f.one(), |x, (j, &k)| f.mul(x, powers[usize::from(k)][j]))
    };
    products.iter().map(value).collect()
}

/// Points at the given constants, drawn on demand.
struct JetPoints<'s, 'a> {
    source: &'s JetSource<'a>,
    at: &'s [u64],
    jets: Vec<Jet>,
    drawn: Vec<Vec<u64>>,
}

impl JetPoints<'_, '_> {
    /// Rows of the products of some of the jets, one per point.
    fn rows(
        &mut self,
        jets: &[Jet],
        products: &[Exponents],
        number: usize,
        rng: &mut SplitMix64,
        work: &mut RemainingWork,
    ) -> Result<Vec<Vec<u64>>, OverLimit> {
        while self.drawn.len() < number {
            let point = self.source.point(self.at, &self.jets, rng, work)?;
            self.drawn.push(point.ok_or(OverLimit)?);
        }
        let places: Vec<usize> =
            jets.iter().filter_map(|j| self.jets.iter().position(|own| own == j)).collect();
        work.take((2 * number * products.len()) as u64)?;
        let row = |point: &Vec<u64>| {
            let own: Vec<u64> = places.iter().map(|&p| point[p]).collect();
            values(&self.source.f, products, &own)
        };
        Ok(self.drawn[..number].iter().map(row).collect())
    }
}

/// Relations at the given constants (values of the unknowns, then of the known constants): one for every
/// output, or all of a few products if these suffice. Contains what was found when the work ended.
pub(super) fn relations(
    source: &JetSource<'_>,
    structure: &JetStructure,
    at: &[u64],
    rng: &mut SplitMix64,
    work: &mut RemainingWork,
) -> Vec<Relation> {
    let mut out: Vec<Relation> = Vec::new();
    let outputs = structure.first_dependent.len();
    if outputs > 1 {
        let jets = structure.jets(None, 0);
        out.extend(together(source, jets, at, rng, work).unwrap_or_default());
    }
    for leader in 0..outputs {
        let order = structure.first_dependent[leader];
        let leads = |r: &Relation| {
            let of = |j: &Jet| j.is_output && j.index == leader && j.order >= order;
            r.jets.iter().any(of)
        };
        if !out.iter().any(leads) {
            out.extend(led_by(source, structure, leader, at, rng, work).ok().flatten());
        }
    }
    out.sort_by_key(|r| r.products.len());
    let mut kept: Vec<Relation> = Vec::new();
    for r in out {
        if !kept.contains(&r) && r.determined_by_one_trajectory(source, at, rng, work).unwrap_or(false) {
            kept.push(r);
        }
    }
    kept
}

/// All relations among products of degree one or two of jets, sorted by the highest derivative in them.
fn together(
    source: &JetSource<'_>,
    jets: Vec<Jet>,
    at: &[u64],
    rng: &mut SplitMix64,
    work: &mut RemainingWork,
) -> Result<Vec<Relation>, OverLimit> {
    let weights: Vec<usize> = jets.iter().map(|j| j.order).collect();
    let mut points = JetPoints { source, at, jets: jets.clone(), drawn: Vec::new() };
    for degree in 1..=2 {
        let weighted = degree * weights.iter().max().unwrap_or(&0);
        if count(&weights, degree, weighted) > TOGETHER {
            break;
        }
        let mut products = exponents(&weights, degree, weighted);
        let highest =
            |e: &Exponents| e.iter().zip(&weights).filter(|p| *p.0 > 0).map(|p| *p.1).max().unwrap_or(0);
        products.sort_by_cached_key(|e| (highest(e), degrees(e, &weights)));
        let rows = points.rows(&jets, &products, products.len() + SPARE, rng, work)?;
        let echelon = ColumnEchelon::new(&source.f, products.len(), rows, work)?;
        if !echelon.free().is_empty() {
            let relation = |&free: &usize| Relation::of(&jets, &products, &echelon.dependency(free));
            return Ok(echelon.free().iter().map(relation).collect());
        }
    }
    Ok(Vec::new())
}

/// Relation with the first dependent derivative of an output, or with up to [`BEYOND`] more; it is sought in
/// the smallest set of products that has one.
fn led_by(
    source: &JetSource<'_>,
    structure: &JetStructure,
    leader: usize,
    at: &[u64],
    rng: &mut SplitMix64,
    work: &mut RemainingWork,
) -> Result<Option<Relation>, OverLimit> {
    let sets: Vec<Vec<Jet>> = (0..=BEYOND).map(|b| structure.jets(Some(leader), b)).collect();
    let weights: Vec<Vec<usize>> = sets.iter().map(|s| s.iter().map(|j| j.order).collect()).collect();
    let mut points =
        JetPoints { source, at, jets: sets.last().cloned().unwrap_or_default(), drawn: Vec::new() };
    // a set without a relation has no subset with one
    let mut failed: Vec<(usize, usize, usize)> = Vec::new();
    let mut budget = FIRST;
    while budget <= MONOMIALS {
        let mut tried: Vec<(usize, usize, usize, usize)> = Vec::new();
        for (beyond, weights) in weights.iter().enumerate() {
            let highest = *weights.iter().max().unwrap_or(&0);
            for degree in 1..=DEGREE {
                let counts = counts(weights, degree, degree * highest);
                // without a product of the leader, the set belongs to fewer jets
                match counts.iter().rposition(|&n| n <= budget) {
                    None => break,
                    Some(weighted) if weighted < highest => {}
                    Some(weighted) => tried.push((counts[weighted], beyond, degree, weighted)),
                }
            }
        }
        tried.sort_unstable();
        for (size, beyond, degree, weighted) in tried {
            let known = |&(b, d, w): &(usize, usize, usize)| beyond <= b && degree <= d && weighted <= w;
            if size < budget / 4 || failed.iter().any(known) {
                continue;
            }
            let products = exponents(&weights[beyond], degree, weighted);
            let rows = points.rows(&sets[beyond], &products, size + SPARE, rng, work)?;
            let echelon = ColumnEchelon::new(&source.f, size, rows, work)?;
            if let Some(&free) = echelon.free().first() {
                return Ok(Some(Relation::of(&sets[beyond], &products, &echelon.dependency(free))));
            }
            failed.push((beyond, degree, weighted));
        }
        budget *= 2;
    }
    Ok(None)
}

impl Relation {
    /// Relation of the products with a non-zero coefficient, without the jets that occur in none.
    fn of(jets: &[Jet], products: &[Exponents], coefficients: &[u64]) -> Self {
        let own: Vec<&Exponents> =
            products.iter().zip(coefficients).filter(|p| *p.1 != 0).map(|p| p.0).collect();
        let used: Vec<usize> = (0..jets.len()).filter(|&j| own.iter().any(|e| e[j] > 0)).collect();
        let products = own.iter().map(|e| used.iter().map(|&j| e[j]).collect()).collect();
        Self { jets: used.iter().map(|&j| jets[j]).collect(), products }
    }

    /// Coefficients at the given constants, with a one at the last product; `None` if they are not
    /// determined.
    ///
    /// # Errors
    /// [`OverLimit`].
    pub(super) fn coefficients(
        &self,
        source: &JetSource<'_>,
        at: &[u64],
        rng: &mut SplitMix64,
        work: &mut RemainingWork,
    ) -> Result<Option<Vec<u64>>, OverLimit> {
        let size = self.products.len();
        let mut points = JetPoints { source, at, jets: self.jets.clone(), drawn: Vec::new() };
        let rows = points.rows(&self.jets, &self.products, size + 1, rng, work)?;
        let echelon = ColumnEchelon::new(&source.f, size, rows, work)?;
        Ok((echelon.free() == [size - 1]).then(|| echelon.dependency(size - 1)))
    }

    /// True if one trajectory determines the coefficients: the products are series in time whose only
    /// dependency is the relation. Coefficients that only several trajectories determine are unknown in one
    /// experiment.
    fn determined_by_one_trajectory(
        &self,
        source: &JetSource<'_>,
        at: &[u64],
        rng: &mut SplitMix64,
        work: &mut RemainingWork,
    ) -> Result<bool, OverLimit> {
        let (f, size) = (source.f, self.products.len());
        let length = size + SPARE;
        let Some(jets) = source.trajectory(at, &self.jets, length, rng, work)? else { return Ok(false) };
        let mut one = vec![0; length];
        one[0] = f.one();
        let mut known: BTreeMap<Exponents, Vec<u64>> = BTreeMap::from([(vec![0; self.jets.len()], one)]);
        for product in &self.products {
            // multiply factor by factor; common beginnings are shared
            let mut part = vec![0; self.jets.len()];
            for (j, &power) in product.iter().enumerate() {
                for _ in 0..power {
                    let before = part.clone();
                    part[j] += 1;
                    if !known.contains_key(&part) {
                        work.take((length * length / 2) as u64)?;
                        let a = &known[&before];
                        let term = |k: usize| f.dot(0, (0..=k).map(|i| (a[i], jets[j][k - i])));
                        let series: Vec<u64> = (0..length).map(term).collect();
                        known.insert(part.clone(), series);
                    }
                }
            }
        }
        let rows = (0..length).map(|k| self.products.iter().map(|p| known[p][k]).collect()).collect();
        Ok(ColumnEchelon::new(&f, size, rows, work)?.rank() == size - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_are_counted_and_ordered() {
        for (degree, weighted) in [(1, 0), (2, 3), (3, 4), (4, 2)] {
            let weights = [0, 1, 2, 1];
            let list = exponents(&weights, degree, weighted);
            assert_eq!(list.len(), count(&weights, degree, weighted));
            // by enumeration of all exponents up to the degree
            let n = degree as u8 + 1;
            let mut brute = 0;
            for code in 0..usize::from(n).pow(4) {
                let e: Exponents =
                    (0..4).map(|i| (code / usize::from(n).pow(i) % usize::from(n)) as u8).collect();
                let (d, w) = degrees(&e, &weights);
                if d <= degree && w <= weighted {
                    assert!(list.contains(&e));
                    brute += 1;
                }
            }
            assert_eq!(list.len(), brute);
            assert!(list.is_sorted_by_key(|e| degrees(e, &weights).0));
        }
    }
}

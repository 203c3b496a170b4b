//! Polynomial relations among jets, found as dependencies among products of jets at random points, small
//! ones first.

use std::collections::BTreeMap;

use obsdeg_exact::dense::ColumnEchelon;
use obsdeg_exact::groebner::{OverLimit, RemainingWork};
use obsdeg_exact::{Field, SplitMix64};

use super::jets::{BEYOND, Jet, JetSource, JetStructure, Start};

/// Largest number of products of jets among which a relation is sought.
const MONOMIALS: usize = 4000;
/// First budget of products; it doubles up to [`MONOMIALS`].
const FIRST: usize = 60;
/// Highest degree of a product.
const DEGREE: usize = 8;
/// Largest number of products among which all relations of all outputs are sought at once.
const TOGETHER: usize = 400;
/// Number of points beyond the number of products: a dependency that holds at all of them is a relation.
pub(super) const SPARE: usize = 4;

/// Exponents, one per jet.
pub(super) type Exponents = Vec<u8>;

/// Relation `sum_i c_i m_i(jets) = 0`, the only one among its products up to a factor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Relation {
    jets: Vec<Jet>,
    pub(super) products: Vec<Exponents>,
    /// Starts of the trajectories that have the relation: any at the same constants, or only the one from
    /// the given states.
    start: Start,
}

/// Degree and weighted degree of a product.
pub(super) fn degrees(e: &[u8], weights: &[usize]) -> (usize, usize) {
    let degree = e.iter().map(|&k| usize::from(k)).sum();
    (degree, e.iter().zip(weights).map(|(&k, w)| usize::from(k) * w).sum())
}

/// Largest weight of a jet in a product.
pub(super) fn highest(e: &[u8], weights: &[usize]) -> usize {
    e.iter().zip(weights).filter(|p| *p.0 > 0).map(|p| *p.1).max().unwrap_or(0)
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
pub(super) fn count(weights: &[usize], degree: usize, weighted: usize) -> usize {
    counts(weights, degree, weighted)[weighted]
}

/// All exponents up to a degree and a weighted degree, sorted by degree and then by the last jets.
pub(super) fn exponents(weights: &[usize], degree: usize, weighted: usize) -> Vec<Exponents> {
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
/// output, or all of a few products if these suffice; true if there are others whose coefficients one
/// trajectory does not determine. Contains what was found when the work ended.
pub(super) fn relations(
    source: &JetSource<'_>,
    structure: &JetStructure,
    at: &[u64],
    rng: &mut SplitMix64,
    work: &mut RemainingWork,
) -> (Vec<Relation>, bool) {
    let mut found: Vec<Relation> = Vec::new();
    let outputs = structure.first_dependent.len();
    if outputs > 1 {
        let jets = structure.jets(None, 0);
        // those found before the work ended are relations
        let _ended = together(source, structure, jets, at, &mut found, rng, work);
    }
    let (mut kept, mut several) = (Vec::new(), false);
    let mut leaders = 0..outputs;
    loop {
        found.sort_by_key(|r| r.products.len());
        for r in found.drain(..).filter(|r| !kept.contains(r)).collect::<Vec<_>>() {
            match r.determined_by_one_trajectory(source, at, rng, work) {
                Ok(true) => kept.push(r),
                Ok(false) => several = true,
                Err(OverLimit) => {}
            }
        }
        // relations along one trajectory are smaller
        if several && !source.has_inputs() {
            break;
        }
        let Some(leader) = leaders.next() else { break };
        let order = structure.first_dependent[leader];
        let is_led =
            |r: &Relation| r.jets.iter().any(|j| j.is_output && j.index == leader && j.order >= order);
        if !kept.iter().any(is_led) {
            let half = work.left / 2;
            let mut share = RemainingWork::new(half);
            found.extend(led_by(source, structure, leader, at, rng, &mut share).ok().flatten());
            work.left -= half - share.left;
        }
    }
    (kept, several)
}

/// Appends all relations among products of jets of degree one, then of degree two without the jets that the
/// linear ones give; sorted by the highest derivative in them.
fn together(
    source: &JetSource<'_>,
    structure: &JetStructure,
    mut jets: Vec<Jet>,
    at: &[u64],
    out: &mut Vec<Relation>,
    rng: &mut SplitMix64,
    work: &mut RemainingWork,
) -> Result<(), OverLimit> {
    let mut points = JetPoints { source, at, jets: jets.clone(), drawn: Vec::new() };
    for degree in 1..=2 {
        let weights: Vec<usize> = jets.iter().map(|j| j.order).collect();
        let weighted = degree * weights.iter().max().unwrap_or(&0);
        if count(&weights, degree, weighted) > TOGETHER {
            break;
        }
        let mut products = exponents(&weights, degree, weighted);
        products.sort_by_cached_key(|e| (highest(e, &weights), degrees(e, &weights)));
        let rows = points.rows(&jets, &products, products.len() + SPARE, rng, work)?;
        let echelon = ColumnEchelon::new(&source.f, products.len(), rows, work)?;
        out.extend(
            echelon
                .free()
                .iter()
                .map(|&c| Relation::of(&jets, &products, &echelon.dependency(c), Start::Random)),
        );
        // a jet that a linear relation gives needs no other, and neither do its derivatives
        let last = |&c: &usize| products[c].iter().position(|&k| k > 0).map(|j| jets[j]);
        let given: Vec<Jet> = echelon.free().iter().filter_map(last).collect();
        let follows =
            |j: &Jet, g: &Jet| (j.is_output, j.index) == (g.is_output, g.index) && j.order >= g.order;
        jets.retain(|j| !given.iter().any(|g| follows(j, g)));
        jets = structure.without_independent(jets);
    }
    Ok(())
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
                return Ok(Some(Relation::of(
                    &sets[beyond],
                    &products,
                    &echelon.dependency(free),
                    Start::Random,
                )));
            }
            failed.push((beyond, degree, weighted));
        }
        budget *= 2;
    }
    Ok(None)
}

impl Relation {
    /// Relation of the products with a non-zero coefficient, without the jets that occur in none.
    pub(super) fn of(jets: &[Jet], products: &[Exponents], coefficients: &[u64], start: Start) -> Self {
        let own: Vec<&Exponents> =
            products.iter().zip(coefficients).filter(|p| *p.1 != 0).map(|p| p.0).collect();
        let used: Vec<usize> = (0..jets.len()).filter(|&j| own.iter().any(|e| e[j] > 0)).collect();
        let products = own.iter().map(|e| used.iter().map(|&j| e[j]).collect()).collect();
        Self { jets: used.iter().map(|&j| jets[j]).collect(), products, start }
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
        let rows = match self.start {
            Start::Random => {
                let mut points = JetPoints { source, at, jets: self.jets.clone(), drawn: Vec::new() };
                points.rows(&self.jets, &self.products, size + 1, rng, work)?
            }
            Start::Given => {
                let set = (&self.jets[..], &self.products[..]);
                match along_trajectory(source, at, set, (size + 1, self.start), rng, work)? {
                    Some(rows) => rows,
                    None => return Ok(None),
                }
            }
        };
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
        let size = self.products.len();
        let set = (&self.jets[..], &self.products[..]);
        let rows = along_trajectory(source, at, set, (size + SPARE, Start::Random), rng, work)?;
        let Some(rows) = rows else { return Ok(false) };
        Ok(ColumnEchelon::new(&source.f, size, rows, work)?.rank() == size - 1)
    }
}

/// Taylor coefficients of products of jets along one trajectory, one row per order up to `length`; `None` if
/// the series is not defined.
pub(super) fn along_trajectory(
    source: &JetSource<'_>,
    at: &[u64],
    (jets, products): (&[Jet], &[Exponents]),
    (length, start): (usize, Start),
    rng: &mut SplitMix64,
    work: &mut RemainingWork,
) -> Result<Option<Vec<Vec<u64>>>, OverLimit> {
    let f = source.f;
    let Some(series) = source.trajectory(at, (jets, length), start, rng, work)? else { return Ok(None) };
    let mut one = vec![0; length];
    one[0] = f.one();
    let mut known: BTreeMap<Exponents, Vec<u64>> = BTreeMap::from([(vec![0; jets.len()], one)]);
    for product in products {
        // multiply factor by factor; common beginnings are shared
        let mut part = vec![0; jets.len()];
        for (j, &power) in product.iter().enumerate() {
            for _ in 0..power {
                let before = part.clone();
                part[j] += 1;
                if !known.contains_key(&part) {
                    work.take((length * length / 2) as u64)?;
                    let a = &known[&before];
                    let term = |k: usize| f.dot(0, (0..=k).map(|i| (a[i], series[j][k - i])));
                    let made: Vec<u64> = (0..length).map(term).collect();
                    known.insert(part.clone(), made);
                }
            }
        }
    }
    Ok(Some((0..length).map(|k| products.iter().map(|p| known[p][k]).collect()).collect()))
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

//! Relations that hold along one trajectory only: their coefficients are functions of the constants and of
//! first integrals (conserved amounts), which have other values on other trajectories.

use obsdeg_exact::SplitMix64;
use obsdeg_exact::dense::ColumnEchelon;
use obsdeg_exact::groebner::{OverLimit, RemainingWork};

use super::jets::{Jet, JetSource, JetStructure, Start};
use super::relation::{Relation, SPARE, along_trajectory, count, degrees, exponents, highest};

/// Largest number of products of jets among which relations are sought.
const PRODUCTS: usize = 1200;
/// Highest degree of a product.
const DEGREE: usize = 4;

/// Jets with their powers.
type JetProduct = Vec<(Jet, u8)>;

/// Search for relations along the trajectory from the values `at` of the unknowns.
struct TrajectorySearch<'s, 'a> {
    source: &'s JetSource<'a>,
    at: &'s [u64],
    outputs: usize,
    found: Vec<Relation>,
    /// Product that each relation gives by others before it.
    given: Vec<JetProduct>,
}

/// Relations along the trajectory from the values `at` of the unknowns, sought in ever larger sets of
/// products. Contains what was found when the work ended.
pub(super) fn relations_along(
    source: &JetSource<'_>,
    structure: &JetStructure,
    at: &[u64],
    rng: &mut SplitMix64,
    work: &mut RemainingWork,
) -> Vec<Relation> {
    let outputs = structure.first_dependent.len();
    let last = structure.first_dependent.iter().copied().max().unwrap_or(0);
    let size = |order: usize, degree: usize| {
        let weights: Vec<usize> = (0..=order).flat_map(|k| vec![k; outputs]).collect();
        count(&weights, degree, degree * order)
    };
    let pairs = (0..=last).flat_map(|order| (1..=DEGREE).map(move |degree| (order, degree)));
    let mut sets: Vec<(usize, usize, usize)> = pairs.map(|(k, d)| (size(k, d), k, d)).collect();
    sets.sort_unstable();
    let mut search = TrajectorySearch { source, at, outputs, found: Vec::new(), given: Vec::new() };
    for (_, order, degree) in sets {
        // as many relations as outputs determine all further derivatives
        if search.found.len() >= outputs || search.set((order, degree), rng, work).is_err() {
            break;
        }
    }
    search.found.sort_by_key(|r| r.products.len());
    search.found
}

impl TrajectorySearch<'_, '_> {
    /// True if a relation gives the jet, or one of which it is a derivative.
    fn is_given(&self, jet: &Jet) -> bool {
        let gives =
            |p: &JetProduct| matches!(p[..], [(g, 1)] if g.index == jet.index && g.order <= jet.order);
        self.given.iter().any(gives)
    }

    /// True if a product is a multiple of one that a relation gives.
    fn is_multiple(&self, jets: &[Jet], exponents: &[u8]) -> bool {
        let power = |jet: &Jet| jets.iter().zip(exponents).find(|p| p.0 == jet).map_or(0, |p| *p.1);
        self.given.iter().any(|p| p.iter().all(|(jet, k)| power(jet) >= *k))
    }

    /// Appends the relations among the products of jets up to an order and a degree, without those that are
    /// given.
    fn set(
        &mut self,
        (order, degree): (usize, usize),
        rng: &mut SplitMix64,
        work: &mut RemainingWork,
    ) -> Result<(), OverLimit> {
        let of_order = |order| (0..self.outputs).map(move |index| Jet { order, is_output: true, index });
        let jets: Vec<Jet> = (0..=order).flat_map(of_order).filter(|j| !self.is_given(j)).collect();
        let weights: Vec<usize> = jets.iter().map(|j| j.order).collect();
        if count(&weights, degree, degree * order) > PRODUCTS || !weights.contains(&order) {
            return Ok(());
        }
        let mut products = exponents(&weights, degree, degree * order);
        products.retain(|e| !self.is_multiple(&jets, e));
        products.sort_by_cached_key(|e| (highest(e, &weights), degrees(e, &weights)));
        let length = (products.len() + SPARE, Start::Given);
        let rows = along_trajectory(self.source, self.at, (&jets, &products), length, rng, work)?;
        let Some(rows) = rows else { return Ok(()) };
        let echelon = ColumnEchelon::new(&self.source.f, products.len(), rows, work)?;
        for &column in echelon.free() {
            if self.is_multiple(&jets, &products[column]) {
                continue;
            }
            self.found.push(Relation::of(&jets, &products, &echelon.dependency(column), Start::Given));
            let own = jets.iter().zip(&products[column]).filter(|p| *p.1 > 0);
            self.given.push(own.map(|(j, k)| (*j, *k)).collect());
        }
        Ok(())
    }
}

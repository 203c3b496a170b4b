//! Symmetry and verdicts of the sequences of a search: turns of the platform axes that map them to
//! equally good ones, and worst degrees of sets.

use std::collections::HashMap;

use crate::file::RowName;
use crate::modular::{PrimeField, Randomness, inverse, judge, subtract, times};
use crate::problem::{Matrix, Problem, Ring, times as product};

/// Rows of one candidate by order and component: psi first, then the coefficients.
type CandidateRows = Vec<(RowName, Vec<u64>)>;

/// Verdicts on sets of candidates.
pub(super) struct SetVerdicts {
    fields: Vec<(u64, Vec<CandidateRows>)>,
    reset: bool,
    /// Names of the unknowns of one candidate.
    names: Vec<String>,
    /// Columns of the required coefficients among the coefficients, with their largest degrees.
    required: Vec<(usize, usize)>,
    known: HashMap<Vec<usize>, Option<usize>>,
    /// Images of every candidate under turns of the platform axes, including the identity.
    pub maps: Vec<Vec<usize>>,
}

impl SetVerdicts {
    /// Verdicts for a problem with the candidates as positions and carry platform; `alike(i, j)` is
    /// true if coefficients i and j are equivalent for the criterion.
    pub(super) fn new(
        problem: &Problem,
        carry: &str,
        required: Vec<(usize, usize)>,
        primes: usize,
        random: &mut Randomness,
        alike: &dyn Fn(usize, usize) -> bool,
    ) -> Self {
        let (mut fields, mut maps) = (Vec::new(), None::<Vec<Option<Vec<usize>>>>);
        for _ in 0..primes {
            let field = PrimeField::new(problem, random);
            let mut of: Vec<CandidateRows> = vec![Vec::new(); problem.positions.len()];
            let attitudes = problem.attitudes(&field);
            for (name, mut row) in problem.rows(&field) {
                let i = name.0 - 1;
                if carry == "inertial" {
                    // psi^n is carried: a row on psi^n = C psi is the row on psi times C^T
                    let of_psi: Matrix<u64> = vec![row[..3].to_vec()];
                    row[..3].copy_from_slice(&product(&field, &of_psi, &transposed(&attitudes[i]))[0]);
                }
                of[i].push((name, row));
            }
            let here = turns(problem, &field, random, alike);
            maps = Some(match maps {
                None => here,
                Some(all) => {
                    all.into_iter().zip(here).map(|(a, b)| a.filter(|a| Some(a) == b.as_ref())).collect()
                }
            });
            if carry == "reset" {
                of = of.iter().map(|rows| without_psi(field.p, rows)).collect();
            }
            fields.push((field.p, of));
        }
        let maps = maps.into_iter().flatten().flatten().collect();
        Self {
            fields,
            reset: carry == "reset",
            names: problem.names.clone(),
            required,
            known: HashMap::new(),
            maps,
        }
    }

    /// Smallest member of the orbit of every candidate.
    pub(super) fn firsts(&self, candidates: usize) -> Vec<usize> {
        let smallest = |c: usize| self.maps.iter().map(|map| map[c]).min().unwrap_or(c);
        let mut firsts: Vec<usize> = (0..candidates).map(smallest).collect();
        firsts.sort_unstable();
        firsts.dedup();
        firsts
    }

    /// Largest degree of a required coefficient; `None` if one is not observable or above its cap.
    pub(super) fn worst_degree(&mut self, sequence: &[usize]) -> Option<usize> {
        let mut set = sequence.to_vec();
        set.sort_unstable();
        set.dedup();
        if let Some(known) = self.known.get(&set) {
            return *known;
        }
        // a set counts if any prime judges it observable
        let found = self.fields.iter().filter_map(|field| self.judged(field, &set)).min();
        self.known.insert(set, found);
        found
    }

    /// Largest degree by all primes, of which a single one may give too small a degree, and the number
    /// of undetermined unknowns. `None` if a required coefficient is not observable or above its cap.
    pub(super) fn certain(&self, sequence: &[usize]) -> Option<(usize, usize)> {
        let mut set = sequence.to_vec();
        set.sort_unstable();
        set.dedup();
        let all: Option<Vec<(usize, usize)>> =
            self.fields.iter().map(|field| self.found(field, &set)).collect();
        let all = all?;
        Some((all.iter().map(|f| f.0).max()?, all.iter().map(|f| f.1).min()?))
    }

    /// Number of sets that were judged.
    pub(super) fn judged_sets(&self) -> usize {
        self.known.len()
    }

    fn judged(&self, field: &(u64, Vec<CandidateRows>), set: &[usize]) -> Option<usize> {
        self.found(field, set).map(|found| found.0)
    }

    /// Worst degree and number of undetermined unknowns by one prime.
    fn found(&self, (p, candidates): &(u64, Vec<CandidateRows>), set: &[usize]) -> Option<(usize, usize)> {
        let d = self.names.len() - 3;
        // under reset carry no row has entries at psi
        let psi = if self.reset { 0 } else { 3 };
        let mut rows: CandidateRows = Vec::new();
        for (i, &c) in set.iter().enumerate() {
            rows.extend(candidates[c].iter().map(|(name, row)| ((i + 1, name.1, name.2), row.clone())));
        }
        let unit = |k: usize| (0..psi + d).map(|j| u64::from(j == psi + k)).collect();
        let functionals: Vec<Vec<u64>> = self.required.iter().map(|r| unit(r.0)).collect();
        let names = vec![String::new(); psi + d];
        let judged = judge(*p, &names, &rows, &functionals);
        let degrees = judged.witnesses.iter().zip(&self.required);
        let degrees: Option<Vec<usize>> =
            degrees.map(|(w, (_, cap))| w.degree.filter(|degree| degree <= cap)).collect();
        let undetermined = psi + d - judged.ranks.last().copied().unwrap_or(0);
        Some((degrees?.into_iter().max()?, undetermined))
    }
}

/// Combinations of the rows of one candidate without entries at its psi, by order, on the coefficients
/// alone: its contribution to candidates with a psi of their own.
fn without_psi(p: u64, rows: &CandidateRows) -> CandidateRows {
    let mut reduced: Vec<(usize, Vec<u64>)> = Vec::new();
    let mut out = Vec::new();
    for (name, row) in rows {
        let mut row = row.clone();
        for (pivot, e) in &reduced {
            let factor = row[*pivot];
            subtract(&mut row, factor, e, p);
        }
        match (0..3).find(|&j| row[j] != 0) {
            Some(pivot) => {
                let scale = inverse(row[pivot], p);
                reduced.push((pivot, row.iter().map(|x| times(*x, scale, p)).collect()));
            }
            None if row.iter().any(|x| *x != 0) => out.push((*name, row[3..].to_vec())),
            None => {}
        }
    }
    out
}

/// Images of the candidates under the 24 rotations of the platform axes; `None` for a rotation that
/// maps a candidate to none, or the coefficients to others.
fn turns(
    problem: &Problem,
    field: &PrimeField,
    random: &mut Randomness,
    alike: &dyn Fn(usize, usize) -> bool,
) -> Vec<Option<Vec<usize>>> {
    let attitudes = problem.attitudes(field);
    let places: HashMap<&Matrix<u64>, usize> =
        attitudes.iter().enumerate().rev().map(|(i, c)| (c, i)).collect();
    let c: Matrix<u64> = (0..3).map(|_| (0..3).map(|_| random.below(field.p)).collect()).collect();
    let columns = |c: &Matrix<u64>| -> Vec<Vec<u64>> {
        let local = problem.local(field, 0, c, c);
        (problem.psi..problem.names.len()).map(|j| local[3..].iter().map(|row| row[j]).collect()).collect()
    };
    let before = columns(&c);
    let renames = |after: &[Vec<u64>]| {
        let mut used = vec![false; before.len()];
        after.iter().enumerate().all(|(j, column)| {
            let negative: Vec<u64> = column.iter().map(|x| field.neg(x)).collect();
            let fits =
                |i: &usize| !used[*i] && alike(*i, j) && (before[*i] == *column || before[*i] == negative);
            let found = (0..before.len()).find(fits);
            found.map(|i| used[i] = true).is_some()
        })
    };
    let mut out = Vec::new();
    for code in 0..216 {
        let axes = [code % 6, code / 6 % 6, code / 36];
        let turn: Matrix<u64> = axes.iter().map(|&a| unit(field, a)).collect();
        if !is_rotation(axes) {
            continue;
        }
        let map = |c: &Matrix<u64>| places.get(&product(field, c, &turn)).copied();
        let map: Option<Vec<usize>> = attitudes.iter().map(map).collect();
        out.push(map.filter(|_| renames(&columns(&product(field, &c, &turn)))));
    }
    out
}

fn transposed(c: &Matrix<u64>) -> Matrix<u64> {
    (0..3).map(|j| c.iter().map(|row| row[j]).collect()).collect()
}

/// Row along axis `a % 3`, negative for `a` from 3 on.
fn unit(field: &PrimeField, a: usize) -> Vec<u64> {
    let sign = if a < 3 { 1 } else { field.p - 1 };
    (0..3).map(|j| if j == a % 3 { sign } else { 0 }).collect()
}

/// True if three signed axes are a right-handed frame.
fn is_rotation(axes: [usize; 3]) -> bool {
    let [a, b, c] = axes.map(|x| x % 3);
    let signs = axes.iter().filter(|x| **x >= 3).count();
    a != b && b != c && a != c && ((b + 3 - a) % 3 == 1) == (signs % 2 == 0)
}

/// Number of multisets of `k` out of `n`; `None` beyond 2^63.
pub(super) fn multisets(n: u64, k: u64) -> Option<u64> {
    let mut out: u128 = 1;
    for i in 0..u128::from(k) {
        out = out.checked_mul(u128::from(n) + i)? / (i + 1);
        (out < 1 << 63).then_some(())?;
    }
    u64::try_from(out).ok()
}

/// Power `n^k`; `None` beyond 2^63.
pub(super) fn power(n: u64, k: u64) -> Option<u64> {
    n.checked_pow(u32::try_from(k).ok()?).filter(|x| *x < 1 << 63)
}

//! Functionals as short sums of derivatives of Z: their terms, and the check of them.

use std::collections::BTreeMap;

use obsdeg_exact::SplitMix64;
use schemars::JsonSchema;
use serde::Serialize;

use super::problem::{LinearSystem, TurningCorrection};
use super::solver::{Frame, Functional, MAX_SYMBOLIC_ANGLES, PRINTABLE, Solver, float_point, tidy};
use super::substitution::{Substitution, binomial};
use super::support::short_support;
use super::term::DerivativeTerm;
use super::turning::attitude_derivative;
use crate::degree::coefficient::{Coefficient, Form, Number, READABLE, Rates, power, readable};
use crate::model::platform::{AZIMUTH, PlatformPoint};
use crate::model::ring::Ring;

/// Values of `(wN, wU)` and of every rate of turning at which decimals are checked.
const OTHER_RATES: (f64, f64, f64) = (0.8, 0.5, 1.3);
/// Largest difference between the sum of terms with decimals and its target, relative to the sum of their
/// magnitudes.
const RESIDUAL: f64 = 1e-9;

/// Source of the coefficients of a solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FoundBy {
    /// Numbers `a + b sqrt 2 + c sqrt 3 + d sqrt 6`, and these times short products of sines and cosines,
    /// recovered from their images in two prime fields.
    PrimeFields,
    /// Formulas in sines and cosines, solved by the symbolic engine; their images in the prime fields are the
    /// same.
    SymbolicEngine,
    /// Decimals from floating-point arithmetic.
    FloatingPoint,
}

/// Check that a solution passed before it was printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Verification {
    /// Exact substitution of the derivatives of Z, and substitution in two prime fields.
    Symbolic,
    /// Substitution in two prime fields.
    Modular,
    /// Substitution in floating point: residual below 1e-9 of the sum of magnitudes.
    Numeric,
}

/// Observable quantity as a sum of derivatives of Z.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    /// Terms, sorted by power of the turning rate, order, component and station.
    pub terms: Vec<DerivativeTerm>,
    /// Source of the coefficients.
    pub found_by: FoundBy,
    /// Check that the solution passed.
    pub verification: Verification,
}

impl Solved {
    /// Least exact form among the coefficients.
    pub fn form(&self) -> Form {
        self.terms.iter().map(|t| t.coefficient.form()).max().unwrap_or(Form::Exact)
    }
}

/// Reasons why no solution is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Unsolved {
    /// The rows do not span the functional, although the degree says that they do: an internal error.
    #[error("the rows of its order do not span it")]
    NotSpanned,
    /// A coefficient could not be recovered.
    #[error("its coefficients have no short exact form")]
    NoForm,
    /// The contribution of a rotation could not be eliminated.
    #[error("the motion of the platform is not in the span of its stations")]
    Motion,
    /// The engine solved another system: an internal error.
    #[error("its coefficients do not solve the system in the prime fields: please report this scheme")]
    Disagreement,
    /// A coefficient is too long to read, and generic angles have no decimals.
    #[error("its longest coefficient has {characters} characters")]
    TooLong {
        /// Number of characters of the longest coefficient.
        characters: usize,
    },
    /// There is no symbolic engine.
    #[error("formulas in generic angles need the symbolic engine")]
    NoEngine,
    /// There are more sines and cosines than the limit for formulas.
    #[error("formulas in more than {MAX_SYMBOLIC_ANGLES} different angles are not attempted")]
    TooManyAngles,
    /// The engine was refused, or failed.
    #[error("no formula of it came from the symbolic engine")]
    NoFormula,
    /// A solution was found, but its check failed: an internal error.
    #[error("it did not survive its substitution: please report this scheme")]
    Refuted,
}

/// Place of a term in a solution; the order is the order of printing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct TermKey {
    pub(super) turns: usize,
    pub(super) order: usize,
    pub(super) component: usize,
    pub(super) azimuth: bool,
    pub(super) rates: Rates,
    pub(super) station: usize,
}

/// Contribution to a term: an unknown of the system, times a factor, times an entry of a derivative of
/// `C_c^n` by the angle of the turn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contribution {
    pub(super) unknown: usize,
    pub(super) factor: i64,
    /// Component of Z in n.
    in_n: usize,
    /// Order of the derivative of `C_c^n`.
    derivative: usize,
}

/// Unknown of the system: a row of the tables, with the rates that multiply its amount.
#[derive(Debug, Clone, Copy)]
pub(super) struct UsedRow {
    pub(super) row: usize,
    pub(super) rates: Rates,
    pub(super) turns: usize,
}

/// System of linear equations for the amounts of some rows, and its solution.
struct RowSystem {
    system: LinearSystem,
    /// Rates and numbers of every unknown, in the order of the tables.
    amounts: Vec<(Rates, Vec<u64>)>,
    used: Vec<UsedRow>,
}

impl Solver<'_> {
    /// True if the terms, as printed, sum up to `targets` (one row per table) when every derivative of Z is
    /// replaced by its row, at rest or turning, in all tables; terms with decimals are summed in floating
    /// point.
    fn holds(&self, terms: &[DerivativeTerm], functional: &Functional, targets: &[Vec<u64>]) -> bool {
        if terms.iter().any(|t| matches!(t.coefficient.number, Number::Decimal(_))) {
            return self.holds_in_floats(terms, functional).unwrap_or(false);
        }
        self.all_tables().zip(targets).all(|((field, table), target)| {
            let f = table.sample.roots.field;
            // every position has its own turning rate
            let turning = |i: usize| f.from_u64(SplitMix64::new(f.modulus() ^ i as u64).next_u64());
            let coefficient = |t: &DerivativeTerm| {
                let image = self.image(&t.coefficient, field, table)?;
                Some(f.mul(image, f.pow(turning(self.stations[t.station].0), t.turns as u64)))
            };
            let coefficients: Option<Vec<u64>> = terms.iter().map(coefficient).collect();
            let substitution = Substitution::new(self.platform, &table.sample.point, self.frame);
            coefficients.is_some_and(|c| substitution.sum(terms, &c, turning) == *target)
        })
    }

    /// True if the terms sum up to the functional in floating point at other rates; `None` for generic
    /// angles.
    fn holds_in_floats(&self, terms: &[DerivativeTerm], functional: &Functional) -> Option<bool> {
        let (w_n, w_u, turning) = OTHER_RATES;
        let point = float_point(self.platform, &self.tables, (w_n, w_u));
        let number = |c: &Coefficient| Some(self.number(c)? * w_n.powi(c.rates[0]) * w_u.powi(c.rates[1]));
        let coefficient = |t: &DerivativeTerm| Some(number(&t.coefficient)? * turning.powi(t.turns as i32));
        let coefficients: Vec<f64> = terms.iter().map(coefficient).collect::<Option<_>>()?;
        let mut rest =
            Substitution::new(self.platform, &point, self.frame).sum(terms, &coefficients, |_| turning);
        let mut size: f64 = coefficients.iter().map(|c| c.abs()).sum();
        for (column, c) in &functional.terms {
            let target = number(c)?;
            rest[*column] -= target;
            size += target.abs();
        }
        Some(rest.iter().all(|x| x.abs() <= RESIDUAL * size))
    }

    /// A functional of the given observable degree as a short sum of derivatives of Z. `Err` is the reason
    /// why there is none to print.
    pub(crate) fn solve(&mut self, functional: &Functional, degree: usize) -> Result<Solved, Unsolved> {
        let targets = self.targets(functional);
        let system = self.row_system(&targets, degree)?;
        let plan = self.plan(&system.used);
        let (numbers, found_by, verification) = self.numbers(functional, &system, &plan)?;
        let mut terms: Vec<DerivativeTerm> = plan
            .iter()
            .zip(numbers)
            .map(|((key, _), number)| DerivativeTerm {
                station: key.station,
                component: key.component,
                azimuth: key.azimuth,
                order: key.order,
                turns: key.turns,
                coefficient: Coefficient { number, rates: key.rates },
            })
            .collect();
        terms.retain(|t| !t.coefficient.is_zero());
        if !self.holds(&terms, functional, &targets) {
            return Err(Unsolved::Refuted);
        }
        let printed = readable(terms.iter().map(|t| t.coefficient.clone()).collect());
        for (term, coefficient) in terms.iter_mut().zip(printed) {
            term.coefficient = coefficient;
        }
        Ok(Solved { terms, found_by, verification })
    }

    /// Images of a functional as full rows, one per table.
    fn targets(&self, functional: &Functional) -> Vec<Vec<u64>> {
        let scatter = |values: &Vec<u64>| {
            let mut row = vec![0; self.platform.names().len()];
            for ((column, _), &value) in functional.terms.iter().zip(values) {
                row[*column] = value;
            }
            row
        };
        functional.images.iter().map(scatter).collect()
    }

    /// Few rows up to the order `degree` that span the targets, with their amounts.
    fn row_system(&self, targets: &[Vec<u64>], degree: usize) -> Result<RowSystem, Unsolved> {
        let first = self.tables.first();
        let cost = |j: usize| self.tables.observables[j % self.tables.observables.len()].solution.len();
        let allowed = self.tables.rows_up_to(degree);
        // a functional that is a row is solved by this row
        let support = match allowed.iter().find(|&&j| first.rows[j] == targets[0]) {
            Some(&j) => vec![j],
            None => short_support(first.sample.roots.field, &first.rows, &allowed, &targets[0], cost)
                .ok_or(Unsolved::NotSpanned)?,
        };
        let columns = self.platform.names().len();
        let mut system = LinearSystem::solution(&support, columns, &[]);
        let mut amounts = self.amounts(&system, targets).ok_or(Unsolved::NoForm)?;
        let motions = self.motions(&support, &amounts).ok_or(Unsolved::Motion)?;
        if !motions.is_empty() {
            system = LinearSystem::solution(&support, columns, &motions);
            amounts = self.amounts(&system, targets).ok_or(Unsolved::NoForm)?;
        }
        let rows = support.iter().map(|&row| (row, [0, 0], 0));
        // the motion enters (16) with w/wN
        let moved = motions.iter().flat_map(|m| m.rows.iter().map(|&row| (row, [-1, 0], 1)));
        let used = (rows.chain(moved).zip(&amounts))
            .map(|((row, by, turns), (r, _))| UsedRow { row, rates: [r[0] + by[0], r[1] + by[1]], turns })
            .collect();
        Ok(RowSystem { system, amounts, used })
    }

    /// Solution of a system in all tables: rates and numbers of each unknown; `None` if it has none of this
    /// form.
    fn amounts(&self, system: &LinearSystem, targets: &[Vec<u64>]) -> Option<Vec<(Rates, Vec<u64>)>> {
        let tables = self.all_tables().zip(targets);
        let y = tables.map(|((_, t), target)| system.solve_in_field(&t.sample.roots.field, &t.rows, target));
        self.split_rates(&y.collect::<Option<Vec<_>>>()?)
    }

    /// Numbers of the printed terms: roots if possible, or formulas of the engine, or short products of sines
    /// and cosines, or decimals.
    fn numbers(
        &mut self,
        functional: &Functional,
        RowSystem { system, amounts, used }: &RowSystem,
        plan: &[(TermKey, Vec<Contribution>)],
    ) -> Result<(Vec<Number>, FoundBy, Verification), Unsolved> {
        // numbers of the printed terms in every field
        let images: Vec<Vec<u64>> = self
            .all_tables()
            .enumerate()
            .map(|(s, (_, t))| {
                let x: Vec<u64> = amounts.iter().map(|(_, numbers)| numbers[s]).collect();
                self.term_numbers(&t.sample.point, plan, &x)
            })
            .collect();
        let of_term = |i: usize| -> Vec<u64> { images.iter().map(|v| v[i]).collect() };
        let exact: Option<Vec<Number>> =
            (0..plan.len()).map(|i| self.recover(&of_term(i)).map(Number::Radical)).collect();
        if let Some(exact) = exact {
            return Ok((exact, FoundBy::PrimeFields, Verification::Modular));
        }
        let Some(texts) = self.ask_for_solution(functional, system, used, plan) else {
            let closed: Option<Vec<Number>> =
                (0..plan.len()).map(|i| self.closed_form(&of_term(i))).collect();
            if let Some(numbers) = closed {
                return Ok((numbers, FoundBy::PrimeFields, Verification::Modular));
            }
            let missing = match &self.worker {
                None => Unsolved::NoEngine,
                Some(_) if self.too_many_angles() => Unsolved::TooManyAngles,
                Some(_) => Unsolved::NoFormula,
            };
            let numbers = self.decimals(functional, system, plan).ok_or(missing)?;
            return Ok((numbers, FoundBy::FloatingPoint, Verification::Numeric));
        };
        if !texts.iter().enumerate().all(|(i, t)| self.agrees(t, &of_term(i))) {
            return Err(Unsolved::Disagreement);
        }
        let longest = texts.iter().map(|t| self.symbols.display(t).len()).max().unwrap_or(0);
        let limit = if self.floats.is_some() { READABLE } else { PRINTABLE };
        if longest <= limit {
            let numbers = texts.into_iter().map(|t| self.text_number(t)).collect();
            return Ok((numbers, FoundBy::SymbolicEngine, Verification::Symbolic));
        }
        let decimals = self.decimals(functional, system, plan);
        let numbers = decimals.ok_or(Unsolved::TooLong { characters: longest })?;
        Ok((numbers, FoundBy::FloatingPoint, Verification::Numeric))
    }

    /// Motions of a solution by the rows `support` while the platform turns: one per rotation and rates of
    /// the amounts, in rows of the rotation itself up to order one. `None` if these rows do not span it,
    /// which does not happen.
    fn motions(&self, support: &[usize], split: &[(Rates, Vec<u64>)]) -> Option<Vec<TurningCorrection>> {
        let first = self.tables.first();
        let f = first.sample.roots.field;
        let mut groups: BTreeMap<(usize, Rates), Vec<usize>> = BTreeMap::new();
        for (j, (&row, (rates, _))) in support.iter().zip(split).enumerate() {
            let (position, axis) = self.stations[self.tables.station(row)];
            if axis.is_some() && self.tables.order(row) == 2 {
                groups.entry((position, *rates)).or_default().push(j);
            }
        }
        let mut out = Vec::new();
        for ((position, rates), members) in groups {
            let of: Vec<(usize, usize)> = members
                .iter()
                .map(|&j| (j, self.tables.motion_row(self.tables.station(support[j]))))
                .collect();
            let factor = power(&f, first.rates(), rates)?;
            let mut target = vec![0; self.platform.names().len()];
            for &(j, row) in &of {
                let amount = f.neg(f.mul(split[j].1[0], factor));
                for (slot, &x) in target.iter_mut().zip(&first.rows[row]) {
                    *slot = f.add(*slot, f.mul(amount, x));
                }
            }
            if target.iter().all(|&x| x == 0) {
                continue;
            }
            let mut own = self.tables.rows_up_to(1);
            own.retain(|&row| self.stations[self.tables.station(row)].0 == position);
            let cost = |j: usize| self.tables.observables[j % self.tables.observables.len()].solution.len();
            out.push(TurningCorrection { rows: short_support(f, &first.rows, &own, &target, cost)?, of });
        }
        Some(out)
    }

    /// Printed terms of a solution that uses the rows `used`.
    fn plan(&self, used: &[UsedRow]) -> Vec<(TermKey, Vec<Contribution>)> {
        let mut plan: BTreeMap<TermKey, Vec<Contribution>> = BTreeMap::new();
        for (j, u) in used.iter().enumerate() {
            let station = self.tables.station(u.row);
            let turns = self.stations[station].1.is_some();
            for z in &self.tables.observables[u.row % self.tables.observables.len()].solution {
                let azimuth = z.component == AZIMUTH;
                let in_platform = self.frame == Frame::Platform && !azimuth;
                // Z^n = C_c^n Z^c, and C_c^n changes while the platform turns
                for derivative in 0..=if in_platform && turns { z.order } else { 0 } {
                    for component in if in_platform { 1..=3 } else { z.component..=z.component } {
                        let key = TermKey {
                            turns: u.turns + derivative,
                            order: z.order - derivative,
                            component,
                            azimuth,
                            rates: [u.rates[0] + z.rates[0], u.rates[1] + z.rates[1]],
                            station,
                        };
                        plan.entry(key).or_default().push(Contribution {
                            unknown: j,
                            factor: z.sign * binomial(z.order, derivative) as i64,
                            in_n: z.component,
                            derivative,
                        });
                    }
                }
            }
        }
        plan.into_iter().collect()
    }

    /// Numbers `sum factor * x_j * (axis factor)` of all printed terms.
    fn term_numbers<R: Ring>(
        &self,
        point: &PlatformPoint<R>,
        plan: &[(TermKey, Vec<Contribution>)],
        x: &[R::Element],
    ) -> Vec<R::Element> {
        let ring = &point.ring;
        plan.iter()
            .map(|(key, contributions)| {
                contributions.iter().fold(ring.zero(), |sum, c| {
                    ring.add(&sum, &ring.mul(&self.weight(point, key, c), &x[c.unknown]))
                })
            })
            .collect()
    }

    /// Factor of the amount of a row in a printed term.
    pub(super) fn weight<R: Ring>(
        &self,
        point: &PlatformPoint<R>,
        key: &TermKey,
        c: &Contribution,
    ) -> R::Element {
        let ring = &point.ring;
        let axis = match (self.frame, self.stations[key.station].1) {
            (Frame::Platform, Some(axis)) if !key.azimuth => {
                let slope = attitude_derivative(ring, &point.attitudes[key.station], axis, c.derivative);
                slope[c.in_n - 1][key.component - 1].clone()
            }
            (Frame::Platform, None) if !key.azimuth => {
                point.attitudes[key.station][c.in_n - 1][key.component - 1].clone()
            }
            _ => ring.one(),
        };
        let times = (1..c.factor.unsigned_abs()).fold(axis.clone(), |sum, _| ring.add(&sum, &axis));
        if c.factor < 0 { ring.neg(&times) } else { times }
    }

    fn decimals(
        &self,
        functional: &Functional,
        problem: &LinearSystem,
        plan: &[(TermKey, Vec<Contribution>)],
    ) -> Option<Vec<Number>> {
        let (point, rows) = self.floats.as_ref()?;
        let mut target = vec![0.0; self.platform.names().len()];
        for (column, c) in &functional.terms {
            target[*column] = self.number(c)?;
        }
        let x = problem.solve_in_floats(rows, &target)?;
        Some(self.term_numbers(point, plan, &x).into_iter().map(|v| Number::Decimal(tidy(v))).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::degree::ensemble::judge;
    use crate::model::platform::Platform;
    use crate::model::scheme::{Scheme, parse_attitude};

    /// In both frames the printed solutions of a scheme pass their substitution; with a wrong sign, position
    /// or order they fail.
    #[test]
    fn substitution_tells_right_from_wrong() {
        for (frame, measured_azimuth) in
            [(Frame::N, false), (Frame::Platform, false), (Frame::Platform, true)]
        {
            let angles = ["0,0,0", "180,0,0", "30,45,0"].map(|a| parse_attitude(a).expect("an attitude"));
            let scheme = Scheme { measured_azimuth, ..Scheme::of_angles(angles) };
            let platform = Platform::new(scheme).expect("valid");
            let verdicts = judge(&platform, 1).expect("judged");
            let mut solver = Solver::new(&platform, &verdicts, 1, frame, None);
            let d_fx = platform.names().iter().position(|n| n == "D_FX").expect("known");
            let degree = verdicts.degrees.degree[0].expect("psi_x is observable");
            let psi_x = solver.functional(vec![(0, Coefficient::one())]).expect("exact");
            assert!(solver.solve(&psi_x, degree).is_ok());
            let functional = solver.functional(vec![(d_fx, Coefficient::one())]).expect("exact");
            let degree = verdicts.degrees.degree[d_fx].expect("D_FX is observable");
            let solved = solver.solve(&functional, degree).expect("solved");
            let mut row = vec![0; platform.names().len()];
            let targets: Vec<Vec<u64>> = functional
                .images
                .iter()
                .map(|v| {
                    row[d_fx] = v[0];
                    row.clone()
                })
                .collect();
            assert!(solver.holds(&solved.terms, &functional, &targets));
            let mut wrong = solved.terms.clone();
            wrong[0].coefficient = wrong[0].coefficient.negated();
            assert!(!solver.holds(&wrong, &functional, &targets));
            let mut wrong = solved.terms.clone();
            wrong[0].order += 1;
            assert!(!solver.holds(&wrong, &functional, &targets));
        }
    }
}

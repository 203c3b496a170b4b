//! Coefficients and solutions: recovered from the fields, solved and verified by the symbolic worker,
//! or as decimals.

use std::collections::BTreeMap;

use obsdeg_exact::Radical;
use obsdeg_symbolic::Worker;
use schemars::JsonSchema;
use serde::Serialize;

use super::problem::Problem;
use super::support::short_support;
use super::symbols::Symbols;
use crate::degree::coefficient::{
    Coefficient, Form, Image, Number, READABLE, Rates, power, rates_between, readable, recover_radical,
};
use crate::degree::ensemble::{Table, Tables, Verdicts};
use crate::model::platform::{LOCAL, Platform, Point, local_dynamics, local_output};
use crate::model::ring::{Float, Ring, Text};
use crate::solution::local::rows_at;

/// Most angles with symbols of their own for which formulas are attempted.
const MAX_SYMBOLIC_ANGLES: usize = 4;
/// Longest number that is printed when there are no decimals to fall back to.
const PRINTABLE: usize = 1000;
/// Values of `(wN, wU)` for decimals; coefficients are homogeneous in them.
const FLOAT_RATES: (f64, f64) = (1.0, 1.0);

/// The axes in which Z is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Frame {
    /// Local geographic axes, as in the paper: `Z1` and `Z3` (`Z2` is zero).
    #[default]
    N,
    /// Platform axes: `Zx`, `Zy`, `Zz`.
    Platform,
}

/// How a solution was checked before it was printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Verification {
    /// By exact substitution of the derivatives of Z, and by substitution in two prime fields.
    Symbolic,
    /// By substitution in two prime fields.
    Modular,
    /// By substitution in floating point: residual below 1e-9.
    Numeric,
}

/// `coefficient * Z_component^(order) @ position`.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// Index of the position.
    pub position: usize,
    /// 1, 2, 3: component in n (2 is a measured azimuth) or platform axis.
    pub component: usize,
    /// Whether this is the measured azimuth.
    pub azimuth: bool,
    /// Derivative order.
    pub order: usize,
    /// The coefficient.
    pub coefficient: Coefficient,
}

/// An observable quantity as a sum of derivatives of Z.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    /// The terms, by order, component and position.
    pub terms: Vec<Term>,
    /// How it was checked.
    pub verification: Verification,
}

impl Solved {
    /// The least exact form among the coefficients.
    pub fn form(&self) -> Form {
        self.terms.iter().map(|t| t.coefficient.form()).max().unwrap_or(Form::Exact)
    }
}

/// Columns and their coefficients.
pub type Sparse = Vec<(usize, Coefficient)>;

/// A linear functional of the unknowns.
#[derive(Debug, Clone, PartialEq)]
pub struct Functional {
    /// Columns and coefficients, as printed.
    pub terms: Sparse,
    /// The exact images of the coefficients, one vector per table in the order of the tables.
    images: Vec<Vec<u64>>,
}

/// Place of a term in a solution: (order, component, azimuth, rates, position).
pub(super) type Key = (usize, usize, bool, Rates, usize);

/// Which row enters a term: (index in the support, sign, component in n).
pub(super) type Contribution = (usize, i64, usize);

/// Everything that coefficients are computed from.
pub struct Solver<'a> {
    pub(super) platform: &'a Platform,
    pub(super) verdicts: &'a Verdicts,
    /// The tables in the fields.
    pub tables: Tables,
    pub(super) symbols: Symbols,
    pub(super) text: Vec<Vec<String>>,
    pub(super) text_point: Point<Text>,
    pub(super) floats: Option<(Point<Float>, Vec<Vec<f64>>)>,
    pub(super) worker: Option<&'a mut Worker>,
    pub(super) frame: Frame,
}

impl<'a> Solver<'a> {
    /// A solver for `platform`; without a worker nothing symbolic is started.
    pub fn new(
        platform: &'a Platform,
        verdicts: &'a Verdicts,
        seed: u64,
        frame: Frame,
        worker: Option<&'a mut Worker>,
    ) -> Self {
        let tables = Tables::new(platform, verdicts, seed);
        let symbols = Symbols::of(platform);
        let rate = |zero: bool| if zero { "0" } else { "1" };
        let text_point = symbols.point(platform, rate(tables.zeros.w_n), rate(tables.zeros.w_u));
        let usable = worker.is_some() && symbols.angles() <= MAX_SYMBOLIC_ANGLES;
        let text = if usable { rows_at(platform, &text_point, &tables.observables) } else { Vec::new() };
        let floats = platform.scheme().generic_names().is_empty().then(|| {
            let point = float_point(platform, &tables);
            let rows = rows_at(platform, &point, &tables.observables);
            (point, rows)
        });
        Self { platform, verdicts, tables, symbols, text, text_point, floats, worker, frame }
    }

    /// Whether formulas in sines and cosines are out of question: too many different angles.
    pub fn too_many_angles(&self) -> bool {
        self.symbols.angles() > MAX_SYMBOLIC_ANGLES
    }

    /// Whether a formula was too much work, so that no other was attempted.
    pub fn given_up(&self) -> bool {
        self.worker.is_some() && self.text.is_empty() && !self.too_many_angles()
    }

    /// The symbols of the formulas.
    pub fn symbols(&self) -> &Symbols {
        &self.symbols
    }

    /// The worker, if there is one.
    pub fn worker(&mut self) -> Option<&mut Worker> {
        self.worker.as_deref_mut()
    }

    /// The image of a coefficient; `None` for a decimal.
    fn image(&self, c: &Coefficient, field: usize, table: &Table) -> Option<u64> {
        let k = &table.sample.roots;
        let number = match &c.number {
            Number::Radical(r) => r.image(k),
            Number::Text { raw, .. } => {
                self.symbols.value(raw, &self.verdicts.values[field], &table.sample)?
            }
            Number::Decimal(_) => return None,
        };
        Some(k.field.mul(number, power(&k.field, table.rates(), c.rates)?))
    }

    /// The functional with the given exact coefficients; `None` when one of them is a decimal.
    pub fn functional(&self, terms: Sparse) -> Option<Functional> {
        let images = |(field, table): (usize, &Table)| {
            terms.iter().map(|(_, c)| self.image(c, field, table)).collect::<Option<Vec<u64>>>()
        };
        let images = self.all_tables().map(images).collect::<Option<_>>()?;
        Some(Functional { terms, images })
    }

    /// Whether the terms, as printed, sum up to `targets` (one row per table) when every derivative of Z
    /// is replaced by its row `H F^k S_i`, in all tables. True for decimals, which have their own check.
    fn holds(&self, terms: &[Term], targets: &[Vec<u64>]) -> bool {
        if terms.iter().any(|t| matches!(t.coefficient.number, Number::Decimal(_))) {
            return true;
        }
        let azimuth = self.platform.scheme().measured_azimuth;
        self.all_tables().zip(targets).all(|((field, table), target)| {
            let (f, point) = (table.sample.roots.field, &table.sample.point);
            let (dynamics, output) = (local_dynamics(&f, &point.w_n, &point.w_u), local_output(&f, azimuth));
            let blocks = self.platform.blocks(point);
            let mut sum = vec![0; target.len()];
            for t in terms {
                let Some(coefficient) = self.image(&t.coefficient, field, table) else { return false };
                // Z^n as measured, or Z^c = C_n^c Z^n
                let c = &point.attitudes[t.position];
                let mut row = [0; LOCAL];
                for (component, h) in &output {
                    let weight = match self.frame {
                        Frame::Platform if !t.azimuth && *component != 2 => c[component - 1][t.component - 1],
                        Frame::Platform if !t.azimuth => 0,
                        _ if *component == t.component => f.one(),
                        _ => 0,
                    };
                    row = std::array::from_fn(|j| f.add(row[j], f.mul(weight, h[j])));
                }
                for _ in 0..t.order {
                    row = std::array::from_fn(|j| f.dot(0, (0..LOCAL).map(|i| (row[i], dynamics[i][j]))));
                }
                let block = &blocks[t.position];
                for (k, &column) in block.columns.iter().enumerate() {
                    let entry = f.dot(0, (0..LOCAL).map(|i| (row[i], block.rows[i][k])));
                    sum[column] = f.add(sum[column], f.mul(coefficient, entry));
                }
            }
            sum == *target
        })
    }

    /// The functional on `support` whose coefficients are the outputs of `problem`.
    pub fn functional_of(&mut self, support: &[usize], problem: &Problem) -> Option<Functional> {
        let (coefficients, images) = self.coefficients(problem)?;
        Some(Functional { terms: support.iter().copied().zip(coefficients).collect(), images })
    }

    /// All nine tables with the index of their field.
    fn all_tables(&self) -> impl Iterator<Item = (usize, &Table)> {
        let main =
            self.tables.tables.iter().enumerate().flat_map(|(i, four)| four.iter().map(move |t| (i, t)));
        main.chain([(0, &self.tables.other_rates)])
    }

    /// The exponents of the rates and the nine images of the numbers of some values, given as nine
    /// vectors in the order of `all_tables`.
    fn split_rates(&self, values: &[Vec<u64>]) -> Option<Vec<(Rates, Vec<u64>)>> {
        let first = self.tables.first();
        let f = first.sample.roots.field;
        (0..values[0].len())
            .map(|i| {
                let a = Image { value: values[0][i], rates: first.rates() };
                let b = Image { value: values[8][i], rates: self.tables.other_rates.rates() };
                let rates = rates_between(&f, a, b)?;
                let numbers = self.all_tables().zip(values).map(|((_, t), v)| {
                    let f = t.sample.roots.field;
                    Some(f.mul(v[i], f.inv(power(&f, t.rates(), rates)?)))
                });
                Some((rates, numbers.collect::<Option<_>>()?))
            })
            .collect()
    }

    fn recover(&self, numbers: &[u64]) -> Option<Radical> {
        let four = |i: usize| -> Option<[u64; 4]> { numbers[4 * i..4 * i + 4].try_into().ok() };
        recover_radical(&self.tables.fields(), &[four(0)?, four(1)?])
    }

    /// Whether the text solves the system in the prime fields too: it must have the images of the
    /// solution there (in the order of `all_tables`, without the last).
    fn agrees(&self, text: &str, numbers: &[u64]) -> bool {
        self.all_tables()
            .zip(numbers)
            .take(8)
            .all(|((i, t), &n)| self.symbols.value(text, &self.verdicts.values[i], &t.sample) == Some(n))
    }

    fn text_number(&self, raw: String) -> Number {
        Number::Text { shown: self.symbols.display(&raw), raw }
    }

    /// The outputs of a problem without targets, as coefficients and as their images in all tables:
    /// roots where possible, then readable formulas in sines and cosines, then decimals. `None` when
    /// nothing of these is at hand.
    pub fn coefficients(&mut self, problem: &Problem) -> Option<(Vec<Coefficient>, Vec<Vec<u64>>)> {
        let solve = |(_, t): (usize, &Table)| problem.solve_in_field(&t.sample.roots.field, &t.rows, &[]);
        let values: Vec<Vec<u64>> = self.all_tables().map(solve).collect::<Option<_>>()?;
        let split = self.split_rates(&values)?;
        let numbers = self.output_numbers(problem, &split)?;
        let coefficients =
            numbers.into_iter().zip(&split).map(|(number, (rates, _))| Coefficient { number, rates: *rates });
        Some((coefficients.collect(), values))
    }

    fn output_numbers(&mut self, problem: &Problem, split: &[(Rates, Vec<u64>)]) -> Option<Vec<Number>> {
        let exact: Option<Vec<Number>> =
            split.iter().map(|(_, numbers)| self.recover(numbers).map(Number::Radical)).collect();
        if exact.is_some() {
            return exact;
        }
        let limit = if self.floats.is_some() { READABLE } else { PRINTABLE };
        if let Some(texts) = self.ask_for_outputs(problem) {
            let fine = |(raw, (_, numbers)): (&String, &(Rates, Vec<u64>))| {
                self.symbols.display(raw).len() <= limit && self.agrees(raw, numbers)
            };
            if texts.iter().zip(split).all(fine) {
                let pairs = texts.into_iter().zip(split);
                return Some(pairs.map(|(raw, (_, numbers))| self.simplest(raw, numbers)).collect());
            }
        }
        let (_, rows) = self.floats.as_ref()?;
        Some(problem.solve_in_floats(rows, &[])?.into_iter().map(|x| Number::Decimal(tidy(x))).collect())
    }

    fn simplest(&self, raw: String, numbers: &[u64]) -> Number {
        self.recover(numbers).map_or_else(|| self.text_number(raw), Number::Radical)
    }

    /// A functional that is observable with the given degree, as a short sum of derivatives of Z.
    /// `Err` says why there is none to print.
    pub fn solve(&mut self, functional: &Functional, degree: usize) -> Result<Solved, String> {
        const LOST: &str = "its coefficients have no short exact form";
        let scatter = |values: &Vec<u64>| {
            let mut row = vec![0; self.platform.names().len()];
            for ((column, _), &value) in functional.terms.iter().zip(values) {
                row[*column] = value;
            }
            row
        };
        let targets: Vec<Vec<u64>> = functional.images.iter().map(scatter).collect();
        let first = self.tables.first();
        let cost = |j: usize| self.tables.observables[j % self.tables.observables.len()].solution.len();
        let support = short_support(
            first.sample.roots.field,
            &first.rows,
            &self.tables.rows_up_to(degree),
            &targets[0],
            cost,
        )
        .ok_or("the rows of its order do not span it")?;
        let problem = Problem::solution(&support, self.platform.names().len());
        let y: Vec<Vec<u64>> = self
            .all_tables()
            .zip(&targets)
            .map(|((_, t), target)| problem.solve_in_field(&t.sample.roots.field, &t.rows, target))
            .collect::<Option<_>>()
            .ok_or(LOST)?;
        let split = self.split_rates(&y).ok_or(LOST)?;
        let rates: Vec<Rates> = split.iter().map(|(r, _)| *r).collect();
        let plan = self.plan(&support, &rates);
        // numbers of the printed terms in every field
        let numbers: Vec<Vec<u64>> = self
            .all_tables()
            .enumerate()
            .map(|(s, (_, t))| {
                let x: Vec<u64> = split.iter().map(|(_, numbers)| numbers[s]).collect();
                self.term_numbers(&t.sample.point, &plan, &x)
            })
            .collect();
        let of_term = |i: usize| -> Vec<u64> { numbers.iter().map(|v| v[i]).collect() };
        let exact: Option<Vec<Number>> =
            (0..plan.len()).map(|i| self.recover(&of_term(i)).map(Number::Radical)).collect();
        let symbolic = self.ask_for_solution(functional, &problem, &support, &rates, &plan);
        let (numbers, verification) = match (symbolic, exact) {
            (Some(texts), exact) => {
                if !texts.iter().enumerate().all(|(i, t)| self.agrees(t, &of_term(i))) {
                    return Err(
                        "its coefficients do not solve the system in the prime fields: please report this scheme".into(),
                    );
                }
                let longest = texts.iter().map(|t| self.symbols.display(t).len()).max().unwrap_or(0);
                let limit = if self.floats.is_some() { READABLE } else { PRINTABLE };
                if let Some(exact) = exact {
                    (exact, Verification::Symbolic)
                } else if longest <= limit {
                    (texts.into_iter().map(|t| self.text_number(t)).collect(), Verification::Symbolic)
                } else {
                    let decimals = self.decimals(functional, &problem, &plan);
                    let numbers = decimals
                        .ok_or_else(|| format!("its longest coefficient has {longest} characters"))?;
                    (numbers, Verification::Numeric)
                }
            }
            (None, Some(exact)) => (exact, Verification::Modular),
            (None, None) => {
                let numbers = self.decimals(functional, &problem, &plan);
                let missing = match &self.worker {
                    None => "formulas in generic angles need the symbolic engine".into(),
                    Some(_) if self.too_many_angles() => {
                        format!(
                            "formulas in more than {MAX_SYMBOLIC_ANGLES} different angles are not attempted"
                        )
                    }
                    Some(_) => "the symbolic engine gave no formula for it".into(),
                };
                (numbers.ok_or(missing)?, Verification::Numeric)
            }
        };
        let mut terms: Vec<Term> = plan
            .iter()
            .zip(numbers)
            .map(|(((order, component, azimuth, rates, position), _), number)| Term {
                position: *position,
                component: *component,
                azimuth: *azimuth,
                order: *order,
                coefficient: Coefficient { number, rates: *rates },
            })
            .collect();
        terms.retain(|t| !t.coefficient.is_zero());
        if !self.holds(&terms, &targets) {
            return Err(
                "it did not survive its substitution in the prime fields: please report this scheme".into()
            );
        }
        let printed = readable(terms.iter().map(|t| t.coefficient.clone()).collect());
        for (term, coefficient) in terms.iter_mut().zip(printed) {
            term.coefficient = coefficient;
        }
        Ok(Solved { terms, verification })
    }

    /// The printed terms of a solution that uses the rows `support` with rates `rates`.
    fn plan(&self, support: &[usize], rates: &[Rates]) -> Vec<(Key, Vec<Contribution>)> {
        let mut plan: BTreeMap<Key, Vec<Contribution>> = BTreeMap::new();
        for (j, (&row, r)) in support.iter().zip(rates).enumerate() {
            let position = self.tables.position(row);
            for z in &self.tables.observables[row % self.tables.observables.len()].solution {
                let rates = [r[0] + z.rates[0], r[1] + z.rates[1]];
                let azimuth = z.component == 2;
                let printed = match self.frame {
                    Frame::Platform if !azimuth => vec![1, 2, 3],
                    _ => vec![z.component],
                };
                for component in printed {
                    plan.entry((z.order, component, azimuth, rates, position)).or_default().push((
                        j,
                        z.sign,
                        z.component,
                    ));
                }
            }
        }
        plan.into_iter().collect()
    }

    /// `sum sign * x_j * (axis factor)` for every printed term: `Z^n = C_c^n Z^c`.
    fn term_numbers<R: Ring>(
        &self,
        point: &Point<R>,
        plan: &[(Key, Vec<Contribution>)],
        x: &[R::Element],
    ) -> Vec<R::Element> {
        let ring = &point.ring;
        plan.iter()
            .map(|((_, component, azimuth, _, position), contributions)| {
                contributions.iter().fold(ring.zero(), |sum, &(j, sign, in_n)| {
                    let axis = self.axis_factor(point, *position, *component, *azimuth, in_n);
                    let value = ring.mul(&axis, &x[j]);
                    ring.add(&sum, &if sign < 0 { ring.neg(&value) } else { value })
                })
            })
            .collect()
    }

    pub(super) fn axis_factor<R: Ring>(
        &self,
        point: &Point<R>,
        position: usize,
        component: usize,
        azimuth: bool,
        in_n: usize,
    ) -> R::Element {
        match self.frame {
            Frame::Platform if !azimuth => point.attitudes[position][in_n - 1][component - 1].clone(),
            _ => point.ring.one(),
        }
    }

    fn decimals(
        &self,
        functional: &Functional,
        problem: &Problem,
        plan: &[(Key, Vec<Contribution>)],
    ) -> Option<Vec<Number>> {
        let (point, rows) = self.floats.as_ref()?;
        let mut target = vec![0.0; self.platform.names().len()];
        for (column, c) in &functional.terms {
            target[*column] = match &c.number {
                Number::Radical(r) => r.to_f64(),
                Number::Decimal(x) => *x,
                Number::Text { raw, .. } => self.symbols.float(raw)?,
            };
        }
        let x = problem.solve_in_floats(rows, &target)?;
        Some(self.term_numbers(point, plan, &x).into_iter().map(|v| Number::Decimal(tidy(v))).collect())
    }
}

fn float_point(platform: &Platform, tables: &Tables) -> Point<Float> {
    let attitudes =
        platform.scheme().stations().iter().map(|s| s.attitude(&Float, |a| a.turn().cos_sin_f64())).collect();
    let rate = |zero: bool, w: f64| if zero { 0.0 } else { w };
    let (w_n, w_u) = (rate(tables.zeros.w_n, FLOAT_RATES.0), rate(tables.zeros.w_u, FLOAT_RATES.1));
    Point { ring: Float, w_n, w_u, attitudes }
}

/// Zero for what rounding left over.
fn tidy(x: f64) -> f64 {
    if x.abs() < 1e-12 { 0.0 } else { x }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::degree::ensemble::judge;
    use crate::model::scheme::{Scheme, parse_attitude};

    /// In both frames the printed solutions of a scheme survive their substitution, and a wrong sign, a
    /// wrong position or a wrong order does not.
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
            assert!(solver.holds(&solved.terms, &targets));
            let mut wrong = solved.terms.clone();
            wrong[0].coefficient = wrong[0].coefficient.negated();
            assert!(!solver.holds(&wrong, &targets));
            let mut wrong = solved.terms.clone();
            wrong[0].order += 1;
            assert!(!solver.holds(&wrong, &targets));
        }
    }
}

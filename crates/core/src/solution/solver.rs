//! Coefficients and solutions: recovered from the fields, solved and verified by the symbolic worker,
//! or as decimals.

use std::collections::BTreeMap;

use obsdeg_exact::{Radical, SplitMix64};
use obsdeg_symbolic::Worker;
use schemars::JsonSchema;
use serde::Serialize;

use super::problem::{Motion, Problem};
use super::substitution::{Substitution, binomial};
use super::support::short_support;
use super::turning::{attitude_derivative, motion_rows};
use crate::degree::coefficient::{
    Coefficient, Form, Image, Number, READABLE, Rates, power, rates_between, readable, recover_radical,
};
use crate::degree::ensemble::Verdicts;
use crate::model::platform::{Platform, Point};
use crate::model::ring::{Float, Ring, Text};
use crate::model::rotation::Axis;
use crate::model::symbols::Symbols;
use crate::solution::local::rows_at;
use crate::solution::tables::{Table, Tables};

/// Most angles with symbols of their own for which formulas are attempted.
const MAX_SYMBOLIC_ANGLES: usize = 4;
/// Longest number that is printed when there are no decimals to fall back to.
const PRINTABLE: usize = 1000;
/// Values of `(wN, wU)` for decimals; coefficients are homogeneous in them.
const FLOAT_RATES: (f64, f64) = (1.0, 1.0);
/// Values of `(wN, wU)` and of every rate of turning at which decimals are checked.
const OTHER_RATES: (f64, f64, f64) = (0.8, 0.5, 1.3);
/// How far the sum of terms with decimals may be from its target, relative to the sum of their magnitudes.
const RESIDUAL: f64 = 1e-9;

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
    /// By substitution in floating point: residual below 1e-9 of the sum of magnitudes.
    Numeric,
}

/// `coefficient * w^turns * Z_component^(order) @ station`, w being the rate at which the platform turns there.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// Index of the station.
    pub station: usize,
    /// 1, 2, 3: component in n (2 is a measured azimuth) or platform axis.
    pub component: usize,
    /// Whether this is the measured azimuth.
    pub azimuth: bool,
    /// Derivative order; at a rotation, of the platform that turns.
    pub order: usize,
    /// The power of the rate of turning.
    pub turns: usize,
    /// The coefficient, without it.
    pub coefficient: Coefficient,
}

/// An observable quantity as a sum of derivatives of Z.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    /// The terms, by power of the rate of turning, order, component and station.
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

/// Place of a term in a solution, in the order of printing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key {
    pub(super) turns: usize,
    pub(super) order: usize,
    pub(super) component: usize,
    pub(super) azimuth: bool,
    pub(super) rates: Rates,
    pub(super) station: usize,
}

/// What enters a term: an unknown of the problem, times a factor, times an entry of a derivative of `C_c^n` by the angle of the turn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contribution {
    pub(super) unknown: usize,
    pub(super) factor: i64,
    /// The component of Z in n.
    in_n: usize,
    /// The order of the derivative of `C_c^n`.
    derivative: usize,
}

/// An unknown of the problem: a row of the tables, with the rates that its amount is multiplied with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Used {
    pub(super) row: usize,
    pub(super) rates: Rates,
    pub(super) turns: usize,
}

/// Everything that coefficients are computed from.
pub struct Solver<'a> {
    pub(super) platform: &'a Platform,
    pub(super) verdicts: &'a Verdicts,
    /// The tables in the fields.
    pub(crate) tables: Tables,
    pub(super) symbols: Symbols,
    pub(super) text: Vec<Vec<String>>,
    pub(super) text_point: Point<Text>,
    pub(super) floats: Option<(Point<Float>, Vec<Vec<f64>>)>,
    pub(super) worker: Option<&'a mut Worker>,
    pub(super) frame: Frame,
    /// Per station: its position, and the axis if it turns there.
    pub(super) stations: Vec<(usize, Option<Axis>)>,
}

impl<'a> Solver<'a> {
    /// A solver for `platform`; without a worker nothing symbolic is started.
    pub(crate) fn new(
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
        let mut text = Vec::new();
        if usable {
            text = rows_at(platform, &text_point, &tables.observables);
            text.extend(motion_rows(platform, &text_point));
        }
        let floats = platform.scheme().generic_names().is_empty().then(|| {
            let point = float_point(platform, &tables, FLOAT_RATES);
            let mut rows = rows_at(platform, &point, &tables.observables);
            rows.extend(motion_rows(platform, &point));
            (point, rows)
        });
        let stations = platform.scheme().stations();
        let stations = stations.iter().map(|s| (s.index, s.turned.as_ref().map(|t| t.axis))).collect();
        Self { platform, verdicts, tables, symbols, text, text_point, floats, worker, frame, stations }
    }

    /// Whether formulas in sines and cosines are out of question: too many different angles.
    pub(crate) fn too_many_angles(&self) -> bool {
        self.symbols.angles() > MAX_SYMBOLIC_ANGLES
    }

    /// Whether a formula was too much work, so that no other was attempted.
    pub(crate) fn given_up(&self) -> bool {
        self.worker.is_some() && self.text.is_empty() && !self.too_many_angles()
    }

    /// The symbols of the formulas.
    pub(crate) fn symbols(&self) -> &Symbols {
        &self.symbols
    }

    /// The worker, if there is one.
    pub(crate) fn worker(&mut self) -> Option<&mut Worker> {
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
    pub(crate) fn functional(&self, terms: Sparse) -> Option<Functional> {
        let images = |(field, table): (usize, &Table)| {
            terms.iter().map(|(_, c)| self.image(c, field, table)).collect::<Option<Vec<u64>>>()
        };
        let images = self.all_tables().map(images).collect::<Option<_>>()?;
        Some(Functional { terms, images })
    }

    /// Whether the terms, as printed, sum up to `targets` (one row per table) when every derivative of Z is replaced by its row, at
    /// rest or turning, in all tables; terms with decimals in floating point.
    fn holds(&self, terms: &[Term], functional: &Functional, targets: &[Vec<u64>]) -> bool {
        if terms.iter().any(|t| matches!(t.coefficient.number, Number::Decimal(_))) {
            return self.holds_in_floats(terms, functional).unwrap_or(false);
        }
        self.all_tables().zip(targets).all(|((field, table), target)| {
            let f = table.sample.roots.field;
            // a rate of turning of its own for every position
            let turning = |i: usize| f.from_u64(SplitMix64::new(f.modulus() ^ i as u64).next_u64());
            let coefficient = |t: &Term| {
                let image = self.image(&t.coefficient, field, table)?;
                Some(f.mul(image, f.pow(turning(self.stations[t.station].0), t.turns as u64)))
            };
            let coefficients: Option<Vec<u64>> = terms.iter().map(coefficient).collect();
            let substitution = Substitution::new(self.platform, &table.sample.point, self.frame);
            coefficients.is_some_and(|c| substitution.sum(terms, &c, turning) == *target)
        })
    }

    /// The same at rates of its own in floating point; `None` without numbers.
    fn holds_in_floats(&self, terms: &[Term], functional: &Functional) -> Option<bool> {
        let (w_n, w_u, turning) = OTHER_RATES;
        let point = float_point(self.platform, &self.tables, (w_n, w_u));
        let number = |c: &Coefficient| Some(self.number(c)? * w_n.powi(c.rates[0]) * w_u.powi(c.rates[1]));
        let coefficient = |t: &Term| Some(number(&t.coefficient)? * turning.powi(t.turns as i32));
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

    /// The functional on `support` whose coefficients are the outputs of `problem`.
    pub(crate) fn functional_of(&mut self, support: &[usize], problem: &Problem) -> Option<Functional> {
        let (coefficients, images) = self.coefficients(problem)?;
        Some(Functional { terms: support.iter().copied().zip(coefficients).collect(), images })
    }

    /// The functional that is a row of a local observable.
    pub(crate) fn functional_of_row(&self, row: usize) -> Option<Functional> {
        let first = self.tables.first();
        let names = self.platform.names();
        let mut columns: Vec<usize> = (0..names.len()).filter(|&c| first.rows[row][c] != 0).collect();
        // a coefficient leads
        columns.sort_by_key(|&c| names[c].starts_with("psi"));
        let images: Vec<Vec<u64>> =
            self.all_tables().map(|(_, t)| columns.iter().map(|&c| t.rows[row][c]).collect()).collect();
        let split = self.split_rates(&images)?;
        let mut text = None;
        let terms = columns.into_iter().zip(split).map(|(c, (rates, numbers))| {
            let number = self.recover(&numbers).map_or_else(
                || {
                    let rows = text.get_or_insert_with(|| {
                        rows_at(self.platform, &self.text_point, &self.tables.observables)
                    });
                    self.text_number(rows[row][c].clone())
                },
                Number::Radical,
            );
            (c, Coefficient { number, rates })
        });
        Some(Functional { terms: terms.collect(), images })
    }

    /// The value of a coefficient without rates; `None` for one in generic angles.
    pub fn number(&self, c: &Coefficient) -> Option<f64> {
        match &c.number {
            Number::Radical(r) => Some(r.to_f64()),
            Number::Decimal(x) => Some(*x),
            Number::Text { raw, .. } => self.symbols.float(raw),
        }
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
    pub(crate) fn coefficients(&mut self, problem: &Problem) -> Option<(Vec<Coefficient>, Vec<Vec<u64>>)> {
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
        let allowed = self.tables.rows_up_to(degree);
        // what is a row is solved by it
        let support = match allowed.iter().find(|&&j| first.rows[j] == targets[0]) {
            Some(&j) => vec![j],
            None => short_support(first.sample.roots.field, &first.rows, &allowed, &targets[0], cost)
                .ok_or("the rows of its order do not span it")?,
        };
        let columns = self.platform.names().len();
        let solve = |problem: &Problem| -> Option<Vec<(Rates, Vec<u64>)>> {
            let tables = self.all_tables().zip(&targets);
            let y =
                tables.map(|((_, t), target)| problem.solve_in_field(&t.sample.roots.field, &t.rows, target));
            self.split_rates(&y.collect::<Option<Vec<_>>>()?)
        };
        let mut problem = Problem::solution(&support, columns, &[]);
        let mut split = solve(&problem).ok_or(LOST)?;
        let motions = self
            .motions(&support, &split)
            .ok_or("the motion of the platform is not in the span of its stations")?;
        if !motions.is_empty() {
            problem = Problem::solution(&support, columns, &motions);
            split = solve(&problem).ok_or(LOST)?;
        }
        let rows = support.iter().map(|&row| (row, [0, 0], 0));
        // the motion enters (16) with w/wN
        let moved = motions.iter().flat_map(|m| m.rows.iter().map(|&row| (row, [-1, 0], 1)));
        let used: Vec<Used> = (rows.chain(moved).zip(&split))
            .map(|((row, by, turns), (r, _))| Used { row, rates: [r[0] + by[0], r[1] + by[1]], turns })
            .collect();
        let plan = self.plan(&used);
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
        let symbolic = self.ask_for_solution(functional, &problem, &used, &plan);
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
            .map(|((key, _), number)| Term {
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
            return Err("it did not survive its substitution: please report this scheme".into());
        }
        let printed = readable(terms.iter().map(|t| t.coefficient.clone()).collect());
        for (term, coefficient) in terms.iter_mut().zip(printed) {
            term.coefficient = coefficient;
        }
        Ok(Solved { terms, verification })
    }

    /// What the turning of the platform adds to a solution by the rows `support`: one motion per rotation and rates of the amounts, in
    /// rows of the rotation itself up to order one. `None` when these do not span it, which they always do.
    fn motions(&self, support: &[usize], split: &[(Rates, Vec<u64>)]) -> Option<Vec<Motion>> {
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
            out.push(Motion { rows: short_support(f, &first.rows, &own, &target, cost)?, of });
        }
        Some(out)
    }

    /// The printed terms of a solution that uses the rows `used`.
    fn plan(&self, used: &[Used]) -> Vec<(Key, Vec<Contribution>)> {
        let mut plan: BTreeMap<Key, Vec<Contribution>> = BTreeMap::new();
        for (j, u) in used.iter().enumerate() {
            let station = self.tables.station(u.row);
            let turns = self.stations[station].1.is_some();
            for z in &self.tables.observables[u.row % self.tables.observables.len()].solution {
                let azimuth = z.component == 2;
                let in_platform = self.frame == Frame::Platform && !azimuth;
                // Z^n = C_c^n Z^c, and C_c^n changes where the platform turns
                for derivative in 0..=if in_platform && turns { z.order } else { 0 } {
                    for component in if in_platform { 1..=3 } else { z.component..=z.component } {
                        let key = Key {
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

    /// `sum factor * x_j * (axis factor)` for every printed term.
    fn term_numbers<R: Ring>(
        &self,
        point: &Point<R>,
        plan: &[(Key, Vec<Contribution>)],
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

    /// What the amount of a row is multiplied with in a printed term.
    pub(super) fn weight<R: Ring>(&self, point: &Point<R>, key: &Key, c: &Contribution) -> R::Element {
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
        problem: &Problem,
        plan: &[(Key, Vec<Contribution>)],
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

fn float_point(platform: &Platform, tables: &Tables, rates: (f64, f64)) -> Point<Float> {
    let attitudes =
        platform.scheme().stations().iter().map(|s| s.attitude(&Float, |a| a.turn().cos_sin_f64())).collect();
    let rate = |zero: bool, w: f64| if zero { 0.0 } else { w };
    let (w_n, w_u) = (rate(tables.zeros.w_n, rates.0), rate(tables.zeros.w_u, rates.1));
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

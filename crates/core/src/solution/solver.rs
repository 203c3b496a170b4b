//! Coefficients and solutions: recovered from the fields, or solved and verified by the symbolic worker, or
//! as decimals.

use std::cell::OnceCell;

use obsdeg_exact::Radical;
use obsdeg_symbolic::Worker;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::angle_products::AngleProduct;
use super::problem::LinearSystem;
use super::turning::motion_rows;
use crate::degree::coefficient::{
    Coefficient, Image, Number, READABLE, Rates, power, rates_between, recover_radical,
};
use crate::degree::ensemble::Verdicts;
use crate::model::angle::Angle;
use crate::model::platform::{Platform, PlatformPoint};
use crate::model::ring::{Float, ManyDigits, Real, Text};
use crate::model::rotation::Axis;
use crate::model::symbols::Symbols;
use crate::model::terms::ErrorSource;
use crate::solution::local::rows_at;
use crate::solution::tables::{RowTable, Tables};

/// Largest number of angles with symbols of their own for which formulas are attempted.
pub(super) const MAX_SYMBOLIC_ANGLES: usize = 4;
/// Longest number, in characters, that is printed if there are no decimals.
pub(super) const PRINTABLE: usize = 1000;
/// Values of `(wN, wU)` for decimals; coefficients are homogeneous in them.
const FLOAT_RATES: (f64, f64) = (1.0, 1.0);

/// Axes in which Z is printed in solutions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Frame {
    /// Local geographic axes, as in the paper: `Z1` and `Z3` (`Z2` is zero).
    #[default]
    N,
    /// Platform axes: `Zx`, `Zy`, `Zz`.
    Platform,
}

/// Columns and their coefficients.
pub type Sparse = Vec<(usize, Coefficient)>;

/// Linear functional of the unknowns.
#[derive(Debug, Clone, PartialEq)]
pub struct Functional {
    /// Columns and coefficients, as printed.
    pub terms: Sparse,
    /// Exact images of the coefficients, one vector per table in the order of the tables.
    pub(super) images: Vec<Vec<u64>>,
}

/// Solver of coefficients: tables, symbols and worker.
pub struct Solver<'a> {
    pub(super) platform: &'a Platform,
    pub(super) verdicts: &'a Verdicts,
    /// Tables in the fields.
    pub(crate) tables: Tables,
    pub(super) symbols: Symbols,
    pub(super) text: Vec<Vec<String>>,
    pub(super) text_point: PlatformPoint<Text>,
    pub(super) floats: Option<(PlatformPoint<Float>, Vec<Vec<f64>>)>,
    many_digits: OnceCell<Option<Vec<Vec<Real>>>>,
    /// Short products of sines and cosines, computed at the first request.
    pub(super) products: OnceCell<Vec<AngleProduct>>,
    pub(super) worker: Option<&'a mut Worker>,
    pub(super) frame: Frame,
    /// Position of every station, and its axis if the platform turns there.
    pub(super) stations: Vec<(usize, Option<Axis>)>,
    /// Number of combinations that were left out.
    pub(super) left_out: usize,
}

impl<'a> Solver<'a> {
    /// Solver for `platform`; without a worker it starts nothing symbolic.
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
        // turns of torquer errors contain pi, and their drift sums of rates: neither is among the symbols
        let torquers = platform.scheme().unknowns.have(ErrorSource::Rate);
        let others = torquers || platform.scheme().by_history();
        let usable = worker.is_some() && symbols.angles() <= MAX_SYMBOLIC_ANGLES && !others;
        let mut text = Vec::new();
        if usable {
            text = rows_at(platform, &text_point, &tables.observables);
            text.extend(motion_rows(platform, &text_point));
        }
        let floats =
            (platform.scheme().generic_names().is_empty() && !platform.scheme().by_history()).then(|| {
                let point = float_point(platform, &tables, FLOAT_RATES);
                let mut rows = rows_at(platform, &point, &tables.observables);
                rows.extend(motion_rows(platform, &point));
                (point, rows)
            });
        let stations = platform.scheme().stations();
        let stations = stations.iter().map(|s| (s.index, s.turned.as_ref().map(|t| t.axis))).collect();
        Self {
            platform,
            verdicts,
            tables,
            symbols,
            text,
            text_point,
            floats,
            many_digits: OnceCell::new(),
            products: OnceCell::new(),
            worker,
            frame,
            stations,
            left_out: 0,
        }
    }

    /// True if there are too many different angles for formulas in sines and cosines.
    pub(crate) fn too_many_angles(&self) -> bool {
        self.symbols.angles() > MAX_SYMBOLIC_ANGLES
    }

    /// True if a formula exceeded the limit of work, so that no other was attempted.
    pub(crate) fn given_up(&self) -> bool {
        self.worker.is_some() && self.text.is_empty() && !self.too_many_angles()
    }

    /// Number of sparse combinations that are not listed, because their coefficients were not found, or only
    /// as decimals.
    pub(crate) fn left_out(&self) -> usize {
        self.left_out
    }

    /// The symbols of the formulas.
    pub(crate) fn symbols(&self) -> &Symbols {
        &self.symbols
    }

    /// The worker, if there is one.
    pub(crate) fn worker(&mut self) -> Option<&mut Worker> {
        self.worker.as_deref_mut()
    }

    /// Image of a coefficient; `None` for a decimal.
    pub(super) fn image(&self, c: &Coefficient, field: usize, table: &RowTable) -> Option<u64> {
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

    /// Functional with the given exact coefficients; `None` if one of them is a decimal.
    pub(crate) fn functional(&self, terms: Sparse) -> Option<Functional> {
        let images = |(field, table): (usize, &RowTable)| {
            terms.iter().map(|(_, c)| self.image(c, field, table)).collect::<Option<Vec<u64>>>()
        };
        let images = self.all_tables().map(images).collect::<Option<_>>()?;
        Some(Functional { terms, images })
    }

    /// Functional on `support` whose coefficients are the outputs of `problem`.
    pub(crate) fn functional_of(&mut self, support: &[usize], problem: &LinearSystem) -> Option<Functional> {
        let (coefficients, images) = self.coefficients(problem)?;
        Some(Functional { terms: support.iter().copied().zip(coefficients).collect(), images })
    }

    /// Functional of a row of a local observable.
    pub(crate) fn functional_of_row(&self, row: usize) -> Option<Functional> {
        let first = self.tables.first();
        let names = self.platform.names();
        let mut columns: Vec<usize> = (0..names.len()).filter(|&c| first.rows[row][c] != 0).collect();
        // a coefficient comes first, before psi
        columns.sort_by_key(|&c| names[c].starts_with("psi"));
        let images: Vec<Vec<u64>> =
            self.all_tables().map(|(_, t)| columns.iter().map(|&c| t.rows[row][c]).collect()).collect();
        let split = self.split_rates(&images)?;
        let mut text = None;
        let terms = columns.into_iter().zip(split).map(|(c, (rates, numbers))| {
            let number = match self.recover(&numbers) {
                Some(radical) => Number::Radical(radical),
                None if self.platform.scheme().unknowns.have(ErrorSource::Rate) => return None,
                None => {
                    let rows = text.get_or_insert_with(|| {
                        rows_at(self.platform, &self.text_point, &self.tables.observables)
                    });
                    self.text_number(rows[row][c].clone())
                }
            };
            Some((c, Coefficient { number, rates }))
        });
        Some(Functional { terms: terms.collect::<Option<_>>()?, images })
    }

    /// Value of a coefficient without rates; `None` for one in generic angles.
    pub fn number(&self, c: &Coefficient) -> Option<f64> {
        match &c.number {
            Number::Radical(r) => Some(r.to_f64()),
            Number::Decimal(x) => Some(*x),
            Number::Text { raw, .. } => self.symbols.float(raw),
        }
    }

    /// Tables of both fields, embedding by embedding, with the index of the field.
    pub(super) fn tables_at_the_rates(&self) -> impl Iterator<Item = (usize, &RowTable)> {
        self.tables.tables.iter().enumerate().flat_map(|(i, four)| four.iter().map(move |t| (i, t)))
    }

    /// Tables of both fields with the index of the field, then the table at other rates.
    pub(super) fn all_tables(&self) -> impl Iterator<Item = (usize, &RowTable)> {
        self.tables_at_the_rates().chain([(0, &self.tables.other_rates)])
    }

    /// Exponents of the rates, and images of the numbers of some values. Values and images are vectors in
    /// the order of `all_tables`.
    pub(super) fn split_rates(&self, values: &[Vec<u64>]) -> Option<Vec<(Rates, Vec<u64>)>> {
        let first = self.tables.first();
        let f = first.sample.roots.field;
        let [at_first, .., at_other] = values else { return None };
        (0..at_first.len())
            .map(|i| {
                let a = Image { value: at_first[i], rates: first.rates() };
                let b = Image { value: at_other[i], rates: self.tables.other_rates.rates() };
                let rates = rates_between(&f, a, b)?;
                let numbers = self.all_tables().zip(values).map(|((_, t), v)| {
                    let f = t.sample.roots.field;
                    Some(f.mul(v[i], f.inv(power(&f, t.rates(), rates)?)))
                });
                Some((rates, numbers.collect::<Option<_>>()?))
            })
            .collect()
    }

    pub(super) fn recover(&self, numbers: &[u64]) -> Option<Radical> {
        let [first, second, ..] = numbers.as_chunks().0 else { return None };
        recover_radical(&self.tables.fields(), &[*first, *second])
    }

    /// True if the text solves the system in the prime fields too: it has the images of the solution there
    /// (in the order of `all_tables`, without the table at other rates).
    pub(super) fn agrees(&self, text: &str, numbers: &[u64]) -> bool {
        self.tables_at_the_rates()
            .zip(numbers)
            .all(|((i, t), &n)| self.symbols.value(text, &self.verdicts.values[i], &t.sample) == Some(n))
    }

    pub(super) fn text_number(&self, raw: String) -> Number {
        Number::Text { shown: self.symbols.display(&raw), raw }
    }

    /// Outputs of a system without targets, as coefficients and as their images in all tables: roots if
    /// possible, or readable formulas in sines and cosines, or decimals. `None` if all fail.
    pub(crate) fn coefficients(
        &mut self,
        problem: &LinearSystem,
    ) -> Option<(Vec<Coefficient>, Vec<Vec<u64>>)> {
        let solve = |(_, t): (usize, &RowTable)| problem.solve_in_field(&t.sample.roots.field, &t.rows, &[]);
        let values: Vec<Vec<u64>> = self.all_tables().map(solve).collect::<Option<_>>()?;
        let split = self.split_rates(&values)?;
        let numbers = self.output_numbers(problem, &split)?;
        let coefficients =
            numbers.into_iter().zip(&split).map(|(number, (rates, _))| Coefficient { number, rates: *rates });
        Some((coefficients.collect(), values))
    }

    fn output_numbers(&mut self, problem: &LinearSystem, split: &[(Rates, Vec<u64>)]) -> Option<Vec<Number>> {
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
        let closed: Option<Vec<Number>> =
            split.iter().map(|(_, numbers)| self.closed_form(numbers)).collect();
        if closed.is_some() {
            return closed;
        }
        if let Some(numbers) = self.many_digits().and_then(|rows| problem.solve_in_many_digits(rows)) {
            return Some(numbers.into_iter().map(Number::Decimal).collect());
        }
        let (_, rows) = self.floats.as_ref()?;
        Some(problem.solve_in_floats(rows, &[])?.into_iter().map(|x| Number::Decimal(tidy(x))).collect())
    }

    /// Observable rows in many digits at the rates for decimals; `None` for generic angles, and for torquer
    /// errors, whose turns have none.
    fn many_digits(&self) -> Option<&Vec<Vec<Real>>> {
        let rows = self.many_digits.get_or_init(|| {
            let scheme = self.platform.scheme();
            self.floats.as_ref().filter(|_| !scheme.unknowns.have(ErrorSource::Rate))?;
            let known =
                |a: &Angle| ManyDigits::cos_sin(a.turn().nanodeg()).unwrap_or((Real::ZERO, Real::ZERO));
            let rate = |zero: bool| if zero { Real::ZERO } else { Real::from_i64(1) };
            let point = PlatformPoint {
                ring: ManyDigits,
                w_n: rate(self.tables.zeros.w_n),
                w_u: rate(self.tables.zeros.w_u),
                attitudes: scheme.stations().iter().map(|s| s.attitude(&ManyDigits, known)).collect(),
                turns: Vec::new(),
            };
            Some(rows_at(self.platform, &point, &self.tables.observables))
        });
        rows.as_ref()
    }

    fn simplest(&self, raw: String, numbers: &[u64]) -> Number {
        self.recover(numbers).map_or_else(|| self.text_number(raw), Number::Radical)
    }
}

pub(super) fn float_point(platform: &Platform, tables: &Tables, rates: (f64, f64)) -> PlatformPoint<Float> {
    let rate = |zero: bool, w: f64| if zero { 0.0 } else { w };
    let (w_n, w_u) = (rate(tables.zeros.w_n, rates.0), rate(tables.zeros.w_u, rates.1));
    PlatformPoint::in_floats(platform, w_n, w_u)
}

/// The number, or zero if it is rounding.
pub(super) fn tidy(x: f64) -> f64 {
    if x.abs() < 1e-12 { 0.0 } else { x }
}

//! Numbers of a solution as short products of sines and cosines, recovered from their images in the prime
//! fields without the symbolic engine.

use super::angle_products::{AngleFactors, AngleProduct, power, products, text};
use super::ask::radical_text;
use super::solver::Solver;
use super::tables::RowTable;
use crate::degree::coefficient::{Number, READABLE};

impl Solver<'_> {
    /// Products of sines and cosines that have a value and an inverse in all tables.
    pub(super) fn angle_products(&self) -> Vec<AngleProduct> {
        if self.too_many_angles() {
            return Vec::new();
        }
        let product = |powers: AngleFactors| {
            let part = |up: bool| -> Vec<String> {
                powers.iter().filter(|f| (f.1 > 0) == up).map(|(base, e)| power(base, *e)).collect()
            };
            let (above, below) = (part(true), part(false));
            let whole = text(false, "1", &above, &below);
            let images: Option<Vec<u64>> = self
                .tables_at_the_rates()
                .map(|(i, t)| self.symbols.value(&whole, &self.verdicts.values[i], &t.sample))
                .collect();
            Some(AngleProduct { above, below, images: images.filter(|all| !all.contains(&0))? })
        };
        products(&self.symbols.angle_names()).into_iter().filter_map(product).collect()
    }

    /// Number with these images (in the order of `all_tables`) as a root times a product of sines and
    /// cosines; `None` if there is no short one.
    pub(super) fn closed_form(&self, numbers: &[u64]) -> Option<Number> {
        if let Some(root) = self.recover(numbers) {
            return Some(Number::Radical(root));
        }
        let products = self.products.get_or_init(|| self.angle_products());
        products.iter().find_map(|product| {
            let quotient = |((_, table), (n, m)): ((usize, &RowTable), (&u64, &u64))| {
                let f = table.sample.roots.field;
                f.mul(*n, f.inv(*m))
            };
            let rest: Vec<u64> =
                self.tables_at_the_rates().zip(numbers.iter().zip(&product.images)).map(quotient).collect();
            let root = self.recover(&rest)?;
            let negative = root.to_f64() < 0.0;
            let size = if negative { root.negated() } else { root };
            let raw = text(negative, &radical_text(&size), &product.above, &product.below);
            let number = self.text_number(raw.clone());
            let short = matches!(&number, Number::Text { shown, .. } if shown.len() <= READABLE);
            (short && self.agrees(&raw, numbers)).then_some(number)
        })
    }
}

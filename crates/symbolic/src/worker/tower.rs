//! Rational functions of some symbols, extended by square roots.

use std::sync::Arc;

use symbolica::domains::rational_polynomial::RationalPolynomial;
use symbolica::poly::PolyVariable;
use symbolica::prelude::*;

use super::JobError;

/// A rational function of the symbols.
pub(crate) type Scalar = RationalPolynomial<IntegerRing, u16>;

/// `sum_m scalars[m] * product of the generators in the bit set m`.
#[derive(Clone)]
pub(crate) struct Element(pub(crate) Vec<Scalar>);

/// The field of rational functions of the symbols, extended by the square roots `generators`.
pub(crate) struct Tower {
    symbols: Arc<Vec<PolyVariable>>,
    /// Symbols, then generators.
    ids: Vec<Symbol>,
    symbol_scalars: Vec<Scalar>,
    squares: Vec<Scalar>,
    names: Vec<String>,
}

pub(crate) fn atom(text: &str) -> Result<Atom, JobError> {
    try_parse!(text).map_err(|_| JobError::NotAnElement { text: text.into() })
}

fn variable(name: &str) -> PolyVariable {
    symbol!(name).into()
}

impl Tower {
    /// Creates the symbols in the order given.
    pub(crate) fn new(symbols: &[String], generators: &[(String, String)]) -> Result<Self, JobError> {
        let names: Vec<String> = generators.iter().map(|(name, _)| name.clone()).collect();
        let symbol_map: Arc<Vec<PolyVariable>> = Arc::new(symbols.iter().map(|s| variable(s)).collect());
        let ids = symbols.iter().chain(&names).map(|s| symbol!(s)).collect();
        let mut tower = Self { symbols: symbol_map, ids, symbol_scalars: vec![], squares: vec![], names };
        tower.symbol_scalars = symbols.iter().map(|s| tower.scalar(s)).collect::<Result<_, _>>()?;
        tower.squares =
            generators.iter().map(|(_, square)| tower.scalar(square)).collect::<Result<_, _>>()?;
        Ok(tower)
    }

    /// A rational function of the symbols alone.
    pub(crate) fn scalar(&self, text: &str) -> Result<Scalar, JobError> {
        let s: Scalar = atom(text)?.to_rational_polynomial(&Q, &Z, self.symbols.clone());
        if s.get_variables().len() != self.symbols.len() {
            return Err(JobError::NotAnElement { text: text.into() });
        }
        Ok(s)
    }

    fn size(&self) -> usize {
        1 << self.squares.len()
    }

    fn zero_scalar(&self) -> Scalar {
        RationalPolynomial::new(&Z, self.symbols.clone())
    }

    pub(crate) fn zero(&self) -> Element {
        Element(vec![self.zero_scalar(); self.size()])
    }

    pub(crate) fn lift(&self, s: Scalar) -> Element {
        let mut e = self.zero();
        e.0[0] = s;
        e
    }

    /// A rational function of symbols and generators.
    pub(crate) fn element(&self, text: &str) -> Result<Element, JobError> {
        self.element_of(&atom(text)?)
    }

    pub(crate) fn element_of(&self, atom: &Atom) -> Result<Element, JobError> {
        self.element_of_view(atom.as_view())
    }

    fn element_of_view(&self, view: AtomView<'_>) -> Result<Element, JobError> {
        let wrong = || JobError::NotAnElement { text: view.to_owned().to_string() };
        match view {
            AtomView::Num(n) => {
                Ok(self.lift(n.as_view().to_owned().to_rational_polynomial(&Q, &Z, self.symbols.clone())))
            }
            AtomView::Var(v) => {
                let known = self.ids.iter().position(|s| *s == v.get_symbol()).ok_or_else(wrong)?;
                let mut out = self.zero();
                match known.checked_sub(self.symbol_scalars.len()) {
                    None => out.0[0] = self.symbol_scalars[known].clone(),
                    Some(generator) => out.0[1 << generator] = self.one_scalar(),
                }
                Ok(out)
            }
            AtomView::Pow(p) => {
                let (base, exponent) = p.get_base_exp();
                let exponent: i64 = exponent.to_owned().to_string().parse().map_err(|_| wrong())?;
                let mut base = self.element_of_view(base)?;
                if exponent < 0 {
                    if self.is_zero(&base) {
                        return Err(wrong());
                    }
                    base = self.inv(&base);
                }
                let one = self.lift(self.one_scalar());
                Ok((0..exponent.unsigned_abs()).fold(one, |product, _| self.mul(&product, &base)))
            }
            AtomView::Mul(m) => m.iter().try_fold(self.lift(self.one_scalar()), |product, x| {
                Ok(self.mul(&product, &self.element_of_view(x)?))
            }),
            AtomView::Add(a) => {
                a.iter().try_fold(self.zero(), |sum, x| Ok(self.add(&sum, &self.element_of_view(x)?)))
            }
            AtomView::Fun(_) => Err(wrong()),
        }
    }

    pub(crate) fn is_zero(&self, a: &Element) -> bool {
        a.0.iter().all(Scalar::is_zero)
    }

    /// How many monomials an element has in numerators and denominators.
    pub(crate) fn terms(&self, a: &Element) -> usize {
        let of = |x: &Scalar| x.numerator.nterms() + x.denominator.nterms();
        a.0.iter().filter(|x| !x.is_zero()).map(of).sum()
    }

    pub(crate) fn add(&self, a: &Element, b: &Element) -> Element {
        Element(a.0.iter().zip(&b.0).map(|(x, y)| x + y).collect())
    }

    pub(crate) fn neg(&self, a: &Element) -> Element {
        Element(a.0.iter().map(|x| -x.clone()).collect())
    }

    pub(crate) fn mul(&self, a: &Element, b: &Element) -> Element {
        let mut out = self.zero();
        for (i, x) in a.0.iter().enumerate().filter(|(_, x)| !x.is_zero()) {
            for (j, y) in b.0.iter().enumerate().filter(|(_, y)| !y.is_zero()) {
                let mut value = x * y;
                for (k, square) in self.squares.iter().enumerate() {
                    if i & j & (1 << k) != 0 {
                        value = &value * square;
                    }
                }
                out.0[i ^ j] = &out.0[i ^ j] + &value;
            }
        }
        out
    }

    /// `1 / a` for `a != 0`: multiplies by the conjugate in the last generator until it is gone.
    pub(crate) fn inv(&self, a: &Element) -> Element {
        let mut numerator = self.lift(self.zero_scalar());
        numerator.0[0] = self.one_scalar();
        let mut norm = a.clone();
        for k in (0..self.squares.len()).rev() {
            let mut conjugate = norm.clone();
            for (i, x) in conjugate.0.iter_mut().enumerate() {
                if i & (1 << k) != 0 {
                    *x = -x.clone();
                }
            }
            numerator = self.mul(&numerator, &conjugate);
            norm = self.mul(&norm, &conjugate);
        }
        let scale = norm.0[0].clone().inv();
        Element(numerator.0.iter().map(|x| x * &scale).collect())
    }

    fn one_scalar(&self) -> Scalar {
        Atom::num(1).to_rational_polynomial(&Q, &Z, self.symbols.clone())
    }

    /// The element as text, over one factored denominator; squares of generators in symbols, such as
    /// `1-s^2`, are written as powers of the generator where they divide out.
    pub(crate) fn print(&self, e: &Element) -> String {
        if self.is_zero(e) {
            return "0".into();
        }
        // common denominator: the product of denominators that do not divide what is there already
        let one = self.one_scalar();
        let mut denominator = one.clone();
        for x in e.0.iter().filter(|x| !x.is_zero()) {
            let d = Scalar::from(x.denominator.clone());
            let missing = &d * &denominator.clone().inv();
            denominator = &denominator * &Scalar::from(missing.numerator.clone());
        }
        let mut parts: Vec<Scalar> = e.0.iter().map(|x| x * &denominator).collect();
        let mut powers = vec![0i32; self.squares.len()];
        for (k, square) in self.squares.iter().enumerate().filter(|(_, s)| !s.is_constant()) {
            let inverse = square.clone().inv();
            let divides = |x: &Scalar| (x * &inverse).denominator.is_one();
            while divides(&denominator) {
                denominator = &denominator * &inverse;
                powers[k] -= 2;
            }
            while parts.iter().all(divides) {
                parts = parts.iter().map(|x| x * &inverse).collect();
                powers[k] += 2;
            }
            // g out of every part: from its own factor g, or from g^2 = square
            let has = |i: usize| i & (1 << k) != 0;
            while powers[k] < 0 && parts.iter().enumerate().all(|(i, x)| has(i) || divides(x)) {
                powers[k] += 1;
                let mut moved = vec![self.zero_scalar(); parts.len()];
                for (i, x) in parts.iter().enumerate() {
                    moved[i ^ (1 << k)] = if has(i) { x.clone() } else { x * &inverse };
                }
                parts = moved;
            }
        }
        let generator = |i: usize| atom(&self.names[i]).unwrap_or_else(|_| Atom::num(1));
        let mut numerator = Atom::num(0);
        for (i, x) in parts.iter().enumerate() {
            let product = (0..self.names.len())
                .filter(|k| i & (1 << k) != 0)
                .fold(x.to_expression(), |product, k| product * generator(k));
            numerator += product;
        }
        let mut result = numerator.factor() / denominator.to_expression().factor();
        for (k, power) in powers.into_iter().enumerate() {
            result *= generator(k).pow(i64::from(power));
        }
        result.to_string()
    }
}

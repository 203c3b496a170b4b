//! Rational functions of some symbols and of the cosines and sines of some angles, extended by square
//! roots of constants.
//!
//! An angle `a` is represented by `t_a = tan(a/2)`: `c_a = (1-t^2)/(1+t^2)`, `s_a = 2t/(1+t^2)`, so
//! `c_a^2 + s_a^2 = 1` needs no rule. In print, functions of `t_a` are converted back to `c_a` and
//! `s_a`.

use std::cell::Cell;
use std::sync::Arc;

use symbolica::domains::rational_polynomial::RationalPolynomial;
use symbolica::poly::PolyVariable;
use symbolica::poly::polynomial::MultivariatePolynomial;
use symbolica::prelude::*;

use super::JobError;

/// A rational function of the symbols.
pub(crate) type Scalar = RationalPolynomial<IntegerRing, u16>;

/// Element `sum_m scalars[m] * product of the generators in the bit set m`.
#[derive(Clone)]
pub(crate) struct Element(pub(crate) Vec<Scalar>);

/// Field of rational functions of the symbols and half tangents, extended by the square roots
/// `generators`.
pub(crate) struct Tower {
    /// Variables: symbols, then half tangents.
    variables: Arc<Vec<PolyVariable>>,
    /// Names of scalars with their values: symbols, then cosines, then sines.
    scalars: Vec<(Symbol, Scalar)>,
    /// Square roots with their squares.
    generators: Vec<(Symbol, Scalar)>,
    /// Names of the angles; their half tangents are the last variables.
    angles: Vec<String>,
    /// Number of products of terms that may still be formed.
    work: Cell<u64>,
}

/// Work of an operation besides its products of terms.
const OPERATION: u64 = 200;
/// Work to print a term with its angles.
const PRINTED: u64 = 10_000;

pub(crate) fn atom(text: &str) -> Result<Atom, JobError> {
    try_parse!(text).map_err(|_| JobError::NotAnElement { text: text.into() })
}

fn variable(name: &str) -> PolyVariable {
    symbol!(name).into()
}

impl Tower {
    /// Creates the symbols in the order given; `limit` is the work that may be done, in products of terms.
    pub(crate) fn new(
        symbols: &[String],
        generators: &[(String, String)],
        angles: &[String],
        limit: u64,
    ) -> Result<Self, JobError> {
        let tangents = angles.iter().map(|a| format!("t_{a}"));
        let variables = symbols.iter().cloned().chain(tangents).map(|s| variable(&s)).collect();
        let mut tower = Self {
            variables: Arc::new(variables),
            scalars: Vec::new(),
            generators: Vec::new(),
            angles: angles.to_vec(),
            work: Cell::new(limit),
        };
        for s in symbols {
            tower.scalars.push((symbol!(s), tower.scalar(s)?));
        }
        for a in angles {
            let cosine = tower.scalar(&format!("(1-t_{a}^2)/(1+t_{a}^2)"))?;
            tower.scalars.push((symbol!(format!("c_{a}")), cosine));
            let sine = tower.scalar(&format!("2*t_{a}/(1+t_{a}^2)"))?;
            tower.scalars.push((symbol!(format!("s_{a}")), sine));
        }
        for (name, square) in generators {
            tower.generators.push((symbol!(name), tower.scalar(square)?));
        }
        Ok(tower)
    }

    /// Rational function of the symbols and half tangents alone.
    pub(crate) fn scalar(&self, text: &str) -> Result<Scalar, JobError> {
        self.scalar_of(&atom(text)?)
    }

    pub(crate) fn scalar_of(&self, atom: &Atom) -> Result<Scalar, JobError> {
        let s: Scalar = atom.to_rational_polynomial(&Q, &Z, self.variables.clone());
        if s.get_variables().len() != self.variables.len() {
            return Err(JobError::NotAnElement { text: atom.to_string() });
        }
        Ok(s)
    }

    /// Counts the work of an operation on two scalars by their products of terms, which a common
    /// divisor costs too.
    pub(crate) fn charge(&self, x: &Scalar, y: &Scalar) {
        let terms = |s: &Scalar| (s.numerator.nterms() + s.denominator.nterms()) as u64;
        self.spend(OPERATION.saturating_add(terms(x).saturating_mul(terms(y))));
    }

    fn spend(&self, work: u64) {
        self.work.set(self.work.get().saturating_sub(work));
    }

    /// Checks that work is left.
    pub(crate) fn go_on(&self) -> Result<(), JobError> {
        if self.work.get() == 0 { Err(JobError::OverLimit) } else { Ok(()) }
    }

    fn size(&self) -> usize {
        1 << self.generators.len()
    }

    fn zero_scalar(&self) -> Scalar {
        RationalPolynomial::new(&Z, self.variables.clone())
    }

    pub(crate) fn zero(&self) -> Element {
        Element(vec![self.zero_scalar(); self.size()])
    }

    pub(crate) fn lift(&self, s: Scalar) -> Element {
        let mut e = self.zero();
        e.0[0] = s;
        e
    }

    /// Rational function of symbols and generators.
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
                Ok(self.lift(n.as_view().to_owned().to_rational_polynomial(&Q, &Z, self.variables.clone())))
            }
            AtomView::Var(v) => {
                let name = v.get_symbol();
                if let Some((_, value)) = self.scalars.iter().find(|(s, _)| *s == name) {
                    return Ok(self.lift(value.clone()));
                }
                let generator = self.generators.iter().position(|(s, _)| *s == name).ok_or_else(wrong)?;
                let mut out = self.zero();
                out.0[1 << generator] = self.one_scalar();
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
                (0..exponent.unsigned_abs()).try_fold(one, |product, _| {
                    self.go_on()?;
                    Ok(self.mul(&product, &base))
                })
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

    /// Number of monomials of an element in numerators and denominators.
    pub(crate) fn terms(&self, a: &Element) -> usize {
        let of = |x: &Scalar| x.numerator.nterms() + x.denominator.nterms();
        a.0.iter().filter(|x| !x.is_zero()).map(of).sum()
    }

    pub(crate) fn add(&self, a: &Element, b: &Element) -> Element {
        let sum = |(x, y): (&Scalar, &Scalar)| {
            self.charge(x, y);
            x + y
        };
        Element(a.0.iter().zip(&b.0).map(sum).collect())
    }

    pub(crate) fn neg(&self, a: &Element) -> Element {
        Element(a.0.iter().map(|x| -x.clone()).collect())
    }

    pub(crate) fn mul(&self, a: &Element, b: &Element) -> Element {
        let mut out = self.zero();
        for (i, x) in a.0.iter().enumerate().filter(|(_, x)| !x.is_zero()) {
            for (j, y) in b.0.iter().enumerate().filter(|(_, y)| !y.is_zero()) {
                self.charge(x, y);
                let mut value = x * y;
                for (k, (_, square)) in self.generators.iter().enumerate() {
                    if i & j & (1 << k) != 0 {
                        value = &value * square;
                    }
                }
                self.charge(&out.0[i ^ j], &value);
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
        for k in (0..self.generators.len()).rev() {
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
        let scaled = |x: &Scalar| {
            self.charge(x, &scale);
            x * &scale
        };
        Element(numerator.0.iter().map(scaled).collect())
    }

    fn one_scalar(&self) -> Scalar {
        Atom::num(1).to_rational_polynomial(&Q, &Z, self.variables.clone())
    }

    /// Element as text over one denominator, both factored. It is written with powers of cosines or of
    /// sines, whichever is shorter.
    pub(crate) fn print(&self, e: &Element) -> Result<String, JobError> {
        if self.is_zero(e) {
            return Ok("0".into());
        }
        self.spend((self.terms(e) as u64).saturating_mul(PRINTED));
        self.go_on()?;
        // common denominator: product of the denominators that do not divide it already
        let mut denominator = self.one_scalar();
        for x in e.0.iter().filter(|x| !x.is_zero()) {
            let missing = &Scalar::from(x.denominator.clone()) * &denominator.clone().inv();
            denominator = &denominator * &Scalar::from(missing.numerator.clone());
        }
        let parts: Vec<Scalar> = e.0.iter().map(|x| x * &denominator).collect();
        let polynomials = || parts.iter().chain([&denominator]).map(|x| &x.numerator);
        let first = self.variables.len() - self.angles.len();
        let halves: Vec<u32> = (first..self.variables.len())
            .map(|v| polynomials().map(|p| degree(p, v)).max().unwrap_or(0).div_ceil(2))
            .collect();
        let ways = [Reduction::OfSine, Reduction::OfCosine].map(|powers| {
            let mut numerator = Atom::num(0);
            for (i, x) in parts.iter().enumerate() {
                let product = (0..self.generators.len())
                    .filter(|k| i & (1 << k) != 0)
                    .fold(self.in_angles(&x.numerator, &halves, powers), |product, k| {
                        product * Atom::var(self.generators[k].0)
                    });
                numerator += product;
            }
            let below = self.in_angles(&denominator.numerator, &halves, powers);
            (numerator.expand().factor() / below.expand().factor()).to_string()
        });
        Ok(ways.into_iter().min_by_key(String::len).unwrap_or_default())
    }

    /// Polynomial over `product (1 + t_a^2)^half_a`, in cosines and sines.
    fn in_angles(&self, p: &Polynomial, halves: &[u32], powers: Reduction) -> Atom {
        let first = self.variables.len() - self.angles.len();
        let mut sum = Atom::num(0);
        for term in p {
            let mut product = Atom::num(term.coefficient.clone());
            for (v, &exponent) in self.variables[..first].iter().zip(term.exponents) {
                product *= v.to_atom().pow(i64::from(exponent));
            }
            for ((angle, &half), &exponent) in self.angles.iter().zip(halves).zip(&term.exponents[first..]) {
                product *= trigonometric(angle, u32::from(exponent), half, powers);
            }
            sum += product;
        }
        sum
    }
}

/// A polynomial in the symbols.
pub(crate) type Polynomial = MultivariatePolynomial<IntegerRing, u16>;

/// Function whose powers above one are kept; the square of the other is replaced.
#[derive(Clone, Copy)]
enum Reduction {
    OfSine,
    OfCosine,
}

/// Highest power of a variable.
pub(crate) fn degree(p: &Polynomial, variable: usize) -> u32 {
    p.into_iter().filter_map(|term| term.exponents.get(variable)).copied().max().map_or(0, u32::from)
}

/// Fraction `t^j / (1+t^2)^m = cos^(2m-j)(a/2) sin^j(a/2)` in the cosine and sine of `a`, for `j <=
/// 2m`.
fn trigonometric(angle: &str, j: u32, m: u32, powers: Reduction) -> Atom {
    let (c, s) = (Atom::var(symbol!(format!("c_{angle}"))), Atom::var(symbol!(format!("s_{angle}"))));
    let half = Atom::num((1, 2));
    // an odd power is one sine times an even one: sin(a/2) cos(a/2) = s/2
    let (sine, j, m) = if j % 2 == 1 { (s.clone() * &half, j - 1, m - 1) } else { (Atom::num(1), j, m) };
    let down = ((Atom::num(1) - &c) * &half).pow(i64::from(j / 2));
    let up = ((Atom::num(1) + &c) * &half).pow(i64::from(m - j / 2));
    let in_cosine = (down * up).expand();
    let in_cosine = match powers {
        Reduction::OfCosine => in_cosine,
        Reduction::OfSine => (0..=i64::from(m)).fold(Atom::num(0), |sum, k| {
            // the coefficient of c^k, times c^(k mod 2) (1-s^2)^(k/2)
            let coefficient = match k {
                0 => in_cosine.replace(c.clone()).with(Atom::num(0)),
                1 => in_cosine.coefficient(c.clone()),
                _ => in_cosine.coefficient(c.clone().pow(k)),
            };
            let even = (Atom::num(1) - s.clone().pow(2)).pow(k / 2);
            sum + coefficient * c.clone().pow(k % 2) * even
        }),
    };
    (sine * in_cosine).expand()
}

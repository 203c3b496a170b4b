//! Error model: drift of the gyros and errors of the accelerometers at any attitude, as linear functions of
//! the unknown coefficients.

use super::attitude::{Matrix3, unit};
use super::geometry::SignedAxis;
use super::ring::Ring;
use super::terms::{ErrorSource, ErrorTerm};

/// Vector with one column per coefficient.
pub type Columns<E> = [Vec<E>; 3];

/// The error terms of the unknown coefficients, in their order.
#[derive(Debug, Clone, Default)]
pub struct ErrorModel {
    terms: Vec<ErrorTerm>,
}

impl From<Vec<ErrorTerm>> for ErrorModel {
    fn from(terms: Vec<ErrorTerm>) -> Self {
        Self { terms }
    }
}

impl ErrorModel {
    /// Error terms; none if the unknowns are the drift itself.
    pub fn terms(&self) -> &[ErrorTerm] {
        &self.terms
    }

    /// Degree of the trigonometric polynomials of the turn angle that drifts and accelerometer errors in n
    /// are while the platform turns about one axis: one for `C_c^n`, one for each component that a
    /// coefficient multiplies.
    pub(crate) fn harmonics(&self) -> usize {
        1 + self.terms.iter().map(|t| t.factors.len()).max().unwrap_or(0)
    }

    /// The rows of `eps^n = C E D` at any attitude `C`, `g = C^T (0,-1,0)`: three rows, one column per
    /// coefficient; none if the unknowns are the drift itself. `rate` gives the torquing rate of the gyros
    /// in c; it is called only if a torquer error is unknown.
    pub fn drift_rows<R: Ring>(
        &self,
        ring: &R,
        c: &Matrix3<R::Element>,
        rate: impl FnOnce() -> [R::Element; 3],
    ) -> Columns<R::Element> {
        let g: [R::Element; 3] = std::array::from_fn(|j| ring.neg(&c[1][j]));
        let rate = self.terms.iter().any(|t| t.source == ErrorSource::Rate).then(rate);
        let of = |source: ErrorSource| match source {
            ErrorSource::Gravity => Some(&g),
            ErrorSource::Rate => rate.as_ref(),
            ErrorSource::Force => None,
        };
        self.rows(ring, c, of)
    }

    /// The rows of the error of the accelerometers in `Z^n` at any attitude `C`, with the specific force
    /// `f = C^T (0,1,0)`: three rows, one column per coefficient.
    pub fn accelerometer_rows<R: Ring>(&self, ring: &R, c: &Matrix3<R::Element>) -> Columns<R::Element> {
        let f = c[1].clone();
        self.rows(ring, c, |source| (source == ErrorSource::Force).then_some(&f))
    }

    /// The errors of the accelerometers in c, at the specific force `f`: three rows, one column per
    /// coefficient.
    pub fn accelerometer_columns<R: Ring>(&self, ring: &R, f: &[R::Element; 3]) -> Columns<R::Element> {
        self.rows(ring, &unit(ring), |source| (source == ErrorSource::Force).then_some(f))
    }

    /// `E(u)` of torquer errors in c, for a rate along `u`: three rows, one column per coefficient.
    pub(crate) fn torquer_columns<R: Ring>(&self, ring: &R, u: &[R::Element; 3]) -> Columns<R::Element> {
        self.rows(ring, &unit(ring), |source| (source == ErrorSource::Rate).then_some(u))
    }

    /// Rows in n with one column per coefficient: along the input axis, times the components (3) of the
    /// quantity that the term depends on; zero where `of` returns `None`.
    fn rows<'a, R: Ring>(
        &self,
        ring: &R,
        c: &Matrix3<R::Element>,
        of: impl Fn(ErrorSource) -> Option<&'a [R::Element; 3]>,
    ) -> Columns<R::Element>
    where
        R::Element: 'a,
    {
        let signed = |a: &SignedAxis, x: &R::Element| if a.negative { ring.neg(x) } else { x.clone() };
        let excitation = |t: &ErrorTerm| {
            let x = of(t.source)?;
            Some(match t.factors.split_first() {
                None => ring.one(),
                Some((first, rest)) => rest
                    .iter()
                    .fold(signed(first, &x[first.axis]), |e, a| ring.mul(&e, &signed(a, &x[a.axis]))),
            })
        };
        let mut rows = [0; 3].map(|_| Vec::with_capacity(self.terms.len()));
        for t in &self.terms {
            let e = excitation(t);
            for (row, c) in rows.iter_mut().zip(c) {
                row.push(match &e {
                    Some(e) => ring.mul(&signed(&t.input, &c[t.input.axis]), e),
                    None => ring.zero(),
                });
            }
        }
        rows
    }
}

//! Errors of a bench that are not among the unknowns of a scheme: the other terms of the error model, and
//! errors of the site and of the stated attitudes. Each is one column beside those of the unknowns.
//!
//! A column is the effect of one unit (SI) of the error on the truth, in n: on `psi^n` while a position
//! lasts, on the drift `eps^n`, and on the output `Z^n`. Errors of the site are *value of the scheme minus
//! true value*. Psi turns by the difference between the rate at which the platform is torqued (from the
//! stated values) and the true rate:
//!
//! - latitude: `d omega_ie/dL = (-wU, wN, 0)`, a drift in rad/s per rad;
//! - azimuth of the North reference: the rate of a frame turned about the vertical,
//!   `(0, 1, 0) x omega_ie = (0, 0, -wN)`;
//! - magnitude of the earth rate: `(wN, wU, 0)` per part of it;
//! - magnitude of gravity (true minus stated): the vertical component of the specific force, `(0, 1, 0)` in
//!   Z;
//! - attitude of one position: `psi^n` increases by `C e_k` while the position lasts, for axis k of the
//!   platform.

use super::attitude::{Matrix3, product};
use super::error_model::{Columns, ErrorModel};
use super::omitted_names::SITE_FAMILIES;
use super::platform::{LOCAL, PSI_EPS, Platform, PlatformPoint, PositionBlock, earth_rate_in};
use super::position::Carry;
use super::ring::Ring;
use super::scheme::Scheme;
use super::terms::{ErrorSource, Term, Unknowns};

/// Largest number of positions whose attitude errors are treated one by one.
pub const MAX_ATTITUDES: usize = 64;

/// Kind of an error that is not estimated: the place at which it enters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OmittedKind {
    /// Coefficient of the error model.
    Coefficient,
    /// Latitude of the scheme minus true latitude.
    Latitude,
    /// Azimuth of the North reference that attitudes and a measured azimuth refer to.
    Azimuth,
    /// Magnitude of the earth rate, stated minus true.
    EarthRate,
    /// Magnitude of gravity, true minus stated.
    Gravity,
    /// Attitude of one position about one platform axis.
    Attitude {
        /// Index of the position.
        position: usize,
        /// Platform axis, 0 to 2.
        axis: usize,
    },
}

/// Error that is not estimated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OmittedTerm {
    /// Name of the error, such as `K0_X`, `latitude` or `attitude_x@2`.
    pub name: String,
    /// Name of the family, such as `K0`, `latitude` or `attitude`.
    pub family: &'static str,
    /// Unit of the error's size: ug, ppm, arcsec, ...
    pub unit: &'static str,
    /// Kind of the error: the place at which it enters.
    pub kind: OmittedKind,
}

/// All errors that a scheme does not estimate, in a fixed order: coefficients first.
#[derive(Debug, Clone)]
pub struct OmittedModel {
    terms: Vec<OmittedTerm>,
    /// Error model of the coefficients, which are the first terms.
    errors: ErrorModel,
    /// Scheme with the turns on which torquer errors act; `None` if they act at the earth rate alone.
    turning: Option<Scheme>,
}

/// Terms of the error model that `unknowns` omits. If a lower triangle is among the unknowns, the rest of
/// its matrix defines the platform axes and is no error.
fn omitted_families(unknowns: &Unknowns) -> Vec<Term> {
    let has = |term: Term| unknowns.terms().contains(&term);
    let defined = |whole: Term, triangle: Term| has(whole) || has(triangle);
    let left_out = |term: &Term| match term {
        Term::GM => !defined(Term::GM, Term::GM3),
        Term::M6 => !defined(Term::M6, Term::M3),
        Term::GM3 | Term::M3 => false,
        other => !has(*other),
    };
    Term::ALL.into_iter().filter(left_out).collect()
}

impl OmittedModel {
    /// Errors that `platform` does not estimate; none for a scheme whose unknown is the drift itself.
    pub fn new(platform: &Platform) -> Self {
        let scheme = platform.scheme();
        let (mut terms, mut errors) = (Vec::new(), Vec::new());
        if scheme.unknowns != Unknowns::Drift {
            for term in omitted_families(&scheme.unknowns) {
                for (name, entry) in term.coefficients(&scheme.geometry) {
                    let (family, unit) = (term.family(), term.unit());
                    terms.push(OmittedTerm { name, family, unit, kind: OmittedKind::Coefficient });
                    errors.push(entry);
                }
            }
            terms.extend(site_terms(scheme));
        }
        Self { terms, errors: errors.into(), turning: turning_scheme(scheme) }
    }

    /// Model with a subset of the errors: those at the indices `kept`, in ascending order.
    pub fn only(&self, kept: &[usize]) -> Self {
        let coefficients = self.errors.terms();
        let errors: Vec<_> = kept.iter().filter_map(|&j| coefficients.get(j).cloned()).collect();
        let terms = kept.iter().map(|&j| self.terms[j].clone()).collect();
        Self { terms, errors: errors.into(), turning: self.turning.clone() }
    }

    /// Errors in their fixed order.
    pub fn terms(&self) -> &[OmittedTerm] {
        &self.terms
    }

    /// Scheme with the turns on which torquer errors act: the given one, with a torquer error among its
    /// unknowns. `None` if no turn is stated or psi^n is not carried, so that torquers act at the earth rate
    /// alone.
    pub fn turning(&self) -> Option<&Scheme> {
        self.turning.as_ref()
    }

    /// Offsets of psi^n while a position lasts (3 x terms): errors of its attitude, `c` being `C_c^n`.
    pub fn offsets<R: Ring>(
        &self,
        ring: &R,
        position: usize,
        c: &Matrix3<R::Element>,
    ) -> Columns<R::Element> {
        self.columns(ring, |kind, r| match kind {
            OmittedKind::Attitude { position: own, axis } if *own == position => Some(c[r][*axis].clone()),
            _ => None,
        })
    }

    /// Drift `eps^n` (3 x terms) at the attitude `c` (`C_c^n`), with the torquing rate `rate` in c and the
    /// earth rate `earth` (North, Up).
    pub fn drift_rows<R: Ring>(
        &self,
        ring: &R,
        c: &Matrix3<R::Element>,
        rate: [R::Element; 3],
        [w_n, w_u]: [&R::Element; 2],
    ) -> Columns<R::Element> {
        let mut out = self.errors.drift_rows(ring, c, || rate);
        let site = self.columns(ring, |kind, r| {
            Some(match (kind, r) {
                (OmittedKind::Latitude, 0) => ring.neg(w_u),
                (OmittedKind::Latitude, 1) | (OmittedKind::EarthRate, 0) => w_n.clone(),
                (OmittedKind::Azimuth, 2) => ring.neg(w_n),
                (OmittedKind::EarthRate, 1) => w_u.clone(),
                _ => return None,
            })
        });
        let first = self.errors.terms().len();
        for (row, site) in out.iter_mut().zip(site) {
            row.extend_from_slice(&site[first..]);
        }
        out
    }

    /// Errors in `Z^n` (3 x terms), in g, at the attitude `c` (`C_c^n`).
    pub fn output_rows<R: Ring>(&self, ring: &R, c: &Matrix3<R::Element>) -> Columns<R::Element> {
        let mut out = self.errors.accelerometer_rows(ring, c);
        let site =
            self.columns(ring, |kind, r| (*kind == OmittedKind::Gravity && r == 1).then(|| ring.one()));
        let first = self.errors.terms().len();
        for (row, site) in out.iter_mut().zip(site) {
            row.extend_from_slice(&site[first..]);
        }
        out
    }

    /// Errors in psi^n (3 x terms) from the turns that lead to station `i`, as in section 10 of the method;
    /// `None` if there is no turn.
    pub fn turned<R: Ring>(&self, point: &PlatformPoint<R>, i: usize) -> Option<Columns<R::Element>> {
        let ring = &point.ring;
        let mut sum: Option<Columns<R::Element>> = None;
        for (from, turn) in point.turns_to(i) {
            let at = product(ring, &from, &turn.integral(ring));
            let torquers = self.errors.torquer_columns(ring, &turn.axis);
            let left = |r: usize, k: usize| ring.dot((0..3).map(|j| (&at[r][j], &torquers[j][k])));
            let mut total = self.columns(ring, |_, _| None);
            for (r, row) in total.iter_mut().enumerate() {
                for (k, x) in row.iter_mut().take(self.errors.terms().len()).enumerate() {
                    let old = sum.as_ref().map_or_else(|| ring.zero(), |s| s[r][k].clone());
                    *x = ring.add(&old, &left(r, k));
                }
            }
            sum = Some(total);
        }
        sum
    }

    /// `S_i` of every station, with one more column per error after those of the unknowns. `point` has the
    /// turns of [`Self::turning`].
    pub fn blocks<R: Ring>(
        &self,
        platform: &Platform,
        point: &PlatformPoint<R>,
    ) -> Vec<PositionBlock<R::Element>> {
        let ring = &point.ring;
        let (n, m) = (platform.names().len(), self.terms.len());
        let mut torqued: Columns<R::Element> = self.columns(ring, |_, _| None);
        let blocks = platform.blocks(point);
        let stations = platform.scheme().stations();
        let extended = blocks.into_iter().zip(&stations).enumerate().map(|(i, (block, station))| {
            let c = &point.attitudes[i];
            if let Some(turned) = self.turned(point, i) {
                for (sum, new) in torqued.iter_mut().zip(turned) {
                    for (a, b) in sum.iter_mut().zip(&new) {
                        *a = ring.add(a, b);
                    }
                }
            }
            let earth = earth_rate_in(ring, c, &point.w_n, &point.w_u);
            let drift = self.drift_rows(ring, c, earth, [&point.w_n, &point.w_u]);
            let (outputs, offsets) = (self.output_rows(ring, c), self.offsets(ring, station.index, c));
            let own = block.columns.len();
            let rows: [Box<[R::Element]>; LOCAL] = std::array::from_fn(|r| {
                // without unknown accelerometer errors the rows have no columns for them
                let mut row = block.rows[r].to_vec();
                row.resize(own, ring.zero());
                match r {
                    0..3 => row.extend((0..m).map(|k| ring.add(&torqued[r][k], &offsets[r][k]))),
                    3..PSI_EPS => row.extend_from_slice(&drift[r - 3]),
                    _ => row.extend_from_slice(&outputs[r - PSI_EPS]),
                }
                row.into_boxed_slice()
            });
            PositionBlock { columns: block.columns.iter().copied().chain(n..n + m).collect(), rows }
        });
        extended.collect()
    }

    /// Three rows with one entry per term; zero where `entry` is `None`.
    fn columns<R: Ring>(
        &self,
        ring: &R,
        entry: impl Fn(&OmittedKind, usize) -> Option<R::Element>,
    ) -> Columns<R::Element> {
        let of =
            |r: usize| self.terms.iter().map(|t| entry(&t.kind, r).unwrap_or_else(|| ring.zero())).collect();
        [of(0), of(1), of(2)]
    }
}

/// Errors of the site and of the attitudes.
fn site_terms(scheme: &Scheme) -> impl Iterator<Item = OmittedTerm> + use<> {
    let kinds = [OmittedKind::Latitude, OmittedKind::Azimuth, OmittedKind::EarthRate, OmittedKind::Gravity];
    let site = SITE_FAMILIES.into_iter().zip(kinds).map(|((family, unit), kind)| OmittedTerm {
        name: family.into(),
        family,
        unit,
        kind,
    });
    let positions = scheme.positions.len();
    let counted = if positions <= MAX_ATTITUDES && !scheme.rotates() { positions } else { 0 };
    let attitudes = (0..counted).flat_map(|position| {
        ['x', 'y', 'z'].into_iter().enumerate().map(move |(axis, letter)| OmittedTerm {
            name: format!("attitude_{letter}@{}", position + 1),
            family: "attitude",
            unit: "arcsec",
            kind: OmittedKind::Attitude { position, axis },
        })
    });
    site.chain(attitudes)
}

/// The scheme with a torquer error among its unknowns, if its turns are stated and have an exact form.
fn turning_scheme(scheme: &Scheme) -> Option<Scheme> {
    if scheme.carry != Carry::Inertial || scheme.positions.len() < 2 || scheme.rotates() {
        return None;
    }
    if scheme.unknowns.have(ErrorSource::Rate) {
        return Some(scheme.clone());
    }
    let Unknowns::Coefficients(terms) = &scheme.unknowns else { return None };
    let mut terms = terms.clone();
    terms.push(Term::GS);
    terms.sort_unstable();
    let turning = Scheme { unknowns: Unknowns::Coefficients(terms), ..scheme.clone() };
    Platform::new(turning).ok().map(Platform::into_scheme)
}

//! The inertially stabilized platform of the paper: (2), (3), (6)-(9) at each position of a scheme.

use obsdeg_exact::{Field, PrimeError, RootField, SplitMix64, turn::common_order};

use super::angle::Angle;
use super::attitude::{Matrix3, product};
use super::geometry::{GYROS, SignedAxis, Unknowns};
use super::ring::Ring;
use super::scheme::{Carry, Scheme, SchemeError};

/// The local unknowns of one position, in n: `psi^n` then `eps^n`.
pub const LOCAL: usize = 6;
/// Names of the local unknowns.
pub(crate) const LOCAL_NAMES: [&str; LOCAL] =
    ["psi_x^n", "psi_y^n", "psi_z^n", "eps_x^n", "eps_y^n", "eps_z^n"];

/// A scheme with its unknowns spelled out.
#[derive(Debug, Clone)]
pub struct Platform {
    scheme: Scheme,
    names: Vec<String>,
    units: Vec<&'static str>,
    drift: Vec<DriftTerm>,
}

/// How one coefficient enters the drift: along the input axis of its gyro, times components of g.
#[derive(Debug, Clone)]
pub struct DriftTerm {
    /// The input axis of the gyro.
    pub input: SignedAxis,
    /// The components of g that the coefficient multiplies; none for a constant drift.
    pub factors: Vec<SignedAxis>,
}

/// The platform at one point: cosines and sines of all angles and the earth rate, in some ring.
#[derive(Debug, Clone)]
pub struct Point<R: Ring> {
    /// The ring.
    pub ring: R,
    /// North component of the earth rate.
    pub w_n: R::Element,
    /// Up component of the earth rate.
    pub w_u: R::Element,
    /// `C_c^n` of every station of the scheme.
    pub attitudes: Vec<Matrix3<R::Element>>,
}

/// `S_i`: how the local unknowns of one position depend on the unknowns of the scheme.
#[derive(Debug, Clone)]
pub struct Block<E> {
    /// The columns (unknowns of the scheme) that occur.
    pub columns: Vec<usize>,
    /// One row per local unknown, one entry per column listed.
    pub rows: [Vec<E>; LOCAL],
}

impl Platform {
    /// The platform under `scheme`.
    ///
    /// # Errors
    /// [`SchemeError`] when the scheme cannot be analysed.
    pub fn new(scheme: Scheme) -> Result<Self, SchemeError> {
        scheme.validate()?;
        let mut names = Vec::new();
        let mut units = Vec::new();
        match &scheme.unknowns {
            Unknowns::Drift => {
                names.extend(LOCAL_NAMES.map(String::from));
                units.extend(["rad", "rad", "rad", "deg/h", "deg/h", "deg/h"]);
            }
            Unknowns::Coefficients(terms) => {
                let copies = if scheme.carry == Carry::Reset { scheme.positions.len() } else { 1 };
                for i in 1..=copies {
                    for axis in ['x', 'y', 'z'] {
                        let at = if scheme.carry == Carry::Reset { format!("@{i}") } else { String::new() };
                        names.push(format!("psi_{axis}{at}"));
                        units.push("rad");
                    }
                }
                for term in terms {
                    for gyro in GYROS {
                        names.push(format!("D_{}{gyro}", term.letters()));
                        units.push(term.unit());
                    }
                }
            }
        }
        let drift = match &scheme.unknowns {
            Unknowns::Drift => Vec::new(),
            Unknowns::Coefficients(terms) => terms
                .iter()
                .flat_map(|term| {
                    scheme.geometry.gyros().map(|g| DriftTerm { input: g.I, factors: term.factors(&g) })
                })
                .collect(),
        };
        Ok(Self { scheme, names, units, drift })
    }

    /// The scheme.
    pub fn scheme(&self) -> &Scheme {
        &self.scheme
    }

    /// The scheme, when the rest is no longer needed.
    pub(crate) fn into_scheme(self) -> Scheme {
        self.scheme
    }

    /// The names of the unknowns: psi first, then the coefficients term by term.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The units of the unknowns.
    pub fn units(&self) -> &[&'static str] {
        &self.units
    }

    /// `S_i` of every station: of every position, and several of a rotation (section 4 of the method: the psi block depends on the carry).
    pub fn blocks<R: Ring>(&self, point: &Point<R>) -> Vec<Block<R::Element>> {
        let ring = &point.ring;
        if self.scheme.unknowns == Unknowns::Drift {
            let rows = std::array::from_fn(|i| {
                (0..LOCAL).map(|j| if i == j { ring.one() } else { ring.zero() }).collect()
            });
            return vec![Block { columns: (0..LOCAL).collect(), rows }];
        }
        let first_d = self.names.len() - self.drift.len();
        // psi^n as a function of psi at the start of the scheme, and psi in platform axes where a rotation ended
        let mut psi_block = &point.attitudes[0];
        let mut composed;
        let mut handed_on: Option<Matrix3<R::Element>> = None;
        let stations = self.scheme.stations();
        let mut out = Vec::with_capacity(stations.len());
        for (i, (station, c)) in stations.iter().zip(&point.attitudes).enumerate() {
            if !station.continues {
                psi_block = match (self.scheme.carry, &handed_on) {
                    (Carry::Inertial, _) => &point.attitudes[0],
                    (Carry::Platform, Some(k)) => {
                        composed = product(ring, c, k);
                        &composed
                    }
                    _ => c,
                };
            } else if stations.get(i + 1).is_none_or(|next| !next.continues) {
                let back: Matrix3<R::Element> =
                    std::array::from_fn(|r| std::array::from_fn(|k| c[k][r].clone()));
                handed_on = Some(product(ring, &back, psi_block));
            }
            let psi_first = if self.scheme.carry == Carry::Reset { 3 * station.index } else { 0 };
            let drift = drift_block(ring, &self.drift, c);
            let zeros = |n: usize| std::iter::repeat_with(|| ring.zero()).take(n);
            let rows = std::array::from_fn(|r| match r {
                0..3 => psi_block[r].iter().cloned().chain(zeros(self.drift.len())).collect(),
                _ => zeros(3).chain(drift[r - 3].iter().cloned()).collect(),
            });
            let columns = (psi_first..psi_first + 3).chain(first_d..self.names.len()).collect();
            out.push(Block { columns, rows });
        }
        out
    }
}

impl Platform {
    /// The rows of `eps^n = C E(g) D` at any attitude `C`, `g = C^T (0,-1,0)`: three rows, one column per
    /// coefficient; none when the unknowns are the drift itself.
    pub fn drift_rows<R: Ring>(&self, ring: &R, c: &Matrix3<R::Element>) -> [Vec<R::Element>; 3] {
        drift_block(ring, &self.drift, c)
    }

    /// How each coefficient enters the drift, in the order of the unknowns; none when the unknowns are the drift itself.
    pub fn drift_terms(&self) -> &[DriftTerm] {
        &self.drift
    }

    /// The number of coefficients.
    pub fn coefficients(&self) -> usize {
        self.drift.len()
    }
}

/// `eps^n = C_c^n E(g^c) D` (3), (8): three rows, one column per coefficient (term by term, gyro by
/// gyro). `g^c = C_n^c (0,-1,0)` is minus the second row of `C_c^n`.
fn drift_block<R: Ring>(ring: &R, terms: &[DriftTerm], c: &Matrix3<R::Element>) -> [Vec<R::Element>; 3] {
    let g: [R::Element; 3] = std::array::from_fn(|j| ring.neg(&c[1][j]));
    let signed = |a: &SignedAxis, x: &R::Element| if a.negative { ring.neg(x) } else { x.clone() };
    let excitation = |t: &DriftTerm| match t.factors.split_first() {
        None => ring.one(),
        Some((first, rest)) => {
            rest.iter().fold(signed(first, &g[first.axis]), |e, a| ring.mul(&e, &signed(a, &g[a.axis])))
        }
    };
    let excitations: Vec<R::Element> = terms.iter().map(excitation).collect();
    std::array::from_fn(|row| {
        let along_input = |t: &DriftTerm| signed(&t.input, &c[row][t.input.axis]);
        terms.iter().zip(&excitations).map(|(t, e)| ring.mul(&along_input(t), e)).collect()
    })
}

/// `F` of (8) on `(psi^n, eps^n)`: `psi' = psi x omega_ie + eps`, `eps' = 0`.
pub fn local_dynamics<R: Ring>(ring: &R, w_n: &R::Element, w_u: &R::Element) -> [[R::Element; LOCAL]; LOCAL] {
    let mut f: [[R::Element; LOCAL]; LOCAL] = std::array::from_fn(|_| std::array::from_fn(|_| ring.zero()));
    f[0][2] = ring.neg(w_u);
    f[1][2] = w_n.clone();
    f[2][0] = w_u.clone();
    f[2][1] = ring.neg(w_n);
    for i in 0..3 {
        f[i][3 + i] = ring.one();
    }
    f
}

/// `H` of (9), `Z^n = (psi_z, 0, -psi_x)`: the components (1, 3, and 2 for a measured azimuth
/// `psi_y^n`) with their rows.
pub fn local_output<R: Ring>(ring: &R, measured_azimuth: bool) -> Vec<(usize, [R::Element; LOCAL])> {
    let unit = |j: usize, value: R::Element| {
        let mut row: [R::Element; LOCAL] = std::array::from_fn(|_| ring.zero());
        row[j] = value;
        row
    };
    let mut out = vec![(1, unit(2, ring.one())), (3, unit(0, ring.neg(&ring.one())))];
    if measured_azimuth {
        out.push((2, unit(1, ring.one())));
    }
    out
}

/// The images of a scheme in one random prime field.
#[derive(Debug, Clone)]
pub struct Sample {
    /// The field and its root of unity.
    pub roots: RootField,
    /// The point.
    pub point: Point<Field>,
}

/// Everything random that a sample needs, so that a conjugate embedding can reuse it.
#[derive(Debug, Clone)]
pub struct RandomValues {
    roots: RootField,
    rates: (u64, u64),
    /// `exp(i angle)` of every generic angle.
    generic: Vec<(String, u64)>,
}

impl RandomValues {
    /// A random field that fits `scheme`, with random earth rates and generic angles.
    ///
    /// # Errors
    /// [`PrimeError`] never for a validated scheme.
    pub fn draw(scheme: &Scheme, rng: &mut SplitMix64) -> Result<Self, PrimeError> {
        let stations = scheme.stations();
        let angles = stations.iter().flat_map(super::scheme::Station::angles).map(Angle::turn);
        let latitude = scheme.latitude.map(|l| obsdeg_exact::Turn::from_nanodeg(l.nanodeg()));
        let roots = RootField::random(common_order(angles.chain(latitude)), rng)?;
        let p = roots.field.modulus();
        let mut nonzero = || 1 + rng.below(p - 1);
        let rates = (nonzero(), nonzero());
        let generic = scheme.generic_names().into_iter().map(|n| (n, nonzero())).collect();
        Ok(Self { roots, rates, generic })
    }

    /// The field.
    pub fn roots(&self) -> &RootField {
        &self.roots
    }

    /// Replaces the value of a generic angle by the one with `tan(angle/2) = t`; false when the name
    /// is unknown or `t = +-i`.
    pub fn set_half_tangent(&mut self, name: &str, t: u64) -> bool {
        let f = &self.roots.field;
        let it = f.mul(self.roots.imaginary_unit(), t);
        let (num, den) = (f.add(f.one(), it), f.sub(f.one(), it));
        let slot = self.generic.iter_mut().find(|(n, _)| n == name);
        match slot {
            Some((_, z)) if num != 0 && den != 0 => {
                *z = f.mul(num, f.inv(den));
                true
            }
            _ => false,
        }
    }

    /// Puts a generic angle at 180 degrees, where `tan(angle/2)` is infinite; false when unknown.
    pub(crate) fn set_half_turn(&mut self, name: &str) -> bool {
        let f = &self.roots.field;
        let minus_one = f.neg(f.one());
        self.generic.iter_mut().find(|(n, _)| n == name).map(|(_, z)| *z = minus_one).is_some()
    }

    /// `(cos, sin)` of an angle in a conjugate of the field. The imaginary unit may have gone to its negative there: then
    /// exp(i angle) at a fixed tangent is inverted.
    pub fn angle_cos_sin(&self, roots: &RootField, angle: &Angle) -> (u64, u64) {
        let f = roots.field;
        let flip = roots.imaginary_unit() != self.roots.imaginary_unit();
        let constant = unit(roots, angle.turn());
        let generic = angle.generic().map_or(f.one(), |(name, minus)| {
            let drawn = self.generic.iter().find(|(n, _)| n == name);
            let z = drawn.expect("a value is drawn for every generic angle of the scheme").1;
            if minus != flip { f.inv(z) } else { z }
        });
        roots.cos_sin(f.mul(constant, generic))
    }

    /// `(cos, sin)` of a generic angle at a sample of these values.
    pub(crate) fn generic_cos_sin(&self, name: &str, sample: &Sample) -> Option<(u64, u64)> {
        let z = self.generic.iter().find(|(n, _)| n == name)?.1;
        let f = sample.roots.field;
        // see `sample`: the sine at a fixed tangent must not depend on the sign of the imaginary unit
        let flipped = sample.roots.imaginary_unit() != self.roots.imaginary_unit();
        Some(sample.roots.cos_sin(if flipped { f.inv(z) } else { z }))
    }

    /// The sample under the embedding `g -> g^a`. Generic angles keep their `tan(angle/2)`.
    pub fn sample(&self, scheme: &Scheme, a: u64) -> Sample {
        let roots = self.roots.conjugate(a);
        let f = roots.field;
        let (w_n, w_u) = match scheme.latitude {
            None => self.rates,
            Some(latitude) => {
                let turn = obsdeg_exact::Turn::from_nanodeg(latitude.nanodeg());
                let (c, s) = roots.cos_sin(unit(&roots, turn));
                (f.mul(self.rates.0, c), f.mul(self.rates.0, s))
            }
        };
        let attitudes = scheme
            .stations()
            .iter()
            .map(|station| station.attitude(&f, |angle| self.angle_cos_sin(&roots, angle)))
            .collect();
        Sample { roots, point: Point { ring: f, w_n, w_u, attitudes } }
    }
}

/// The image of `exp(i angle)` for an angle of the scheme whose field this is.
fn unit(roots: &RootField, angle: obsdeg_exact::Turn) -> u64 {
    roots.unit_circle(angle).expect("fields are drawn with the roots of unity of every angle of the scheme")
}

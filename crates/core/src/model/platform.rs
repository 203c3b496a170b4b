//! The inertially stabilized platform of the paper: (2), (3), (6)-(9) at each position of a scheme.

use obsdeg_exact::{Field, PrimeError, RootField, SplitMix64, turn::common_order};

use super::angle::Angle;
use super::attitude::{Matrix3, product};
use super::error_model::{Columns, ErrorModel};
pub(crate) use super::observed::{LOCAL, Observed, PSI_EPS};
use super::path::{PathError, PathStep, TurnAt};
use super::position::{Carry, Position, Station};
use super::ring::{Float, Ring};
use super::rotation::Axis;
use super::scheme::{Scheme, SchemeError};
use super::terms::{ErrorTerm, Unknowns};

/// Names of the local unknowns.
pub(crate) const LOCAL_NAMES: [&str; LOCAL] =
    ["psi_x^n", "psi_y^n", "psi_z^n", "eps_x^n", "eps_y^n", "eps_z^n", "a_x^n", "a_y^n", "a_z^n"];
/// Component number of a measured azimuth; the components of Z are 1, 2, 3.
pub const AZIMUTH: usize = 4;

/// A scheme with the names and units of its unknowns.
#[derive(Debug, Clone)]
pub struct Platform {
    scheme: Scheme,
    names: Vec<String>,
    units: Vec<&'static str>,
    errors: ErrorModel,
    /// Turns that lead to every position, if torquer errors act on them.
    paths: Vec<Vec<PathStep>>,
}

/// The platform at one point: cosines and sines of all angles and the earth rate, in a ring.
#[derive(Debug, Clone)]
pub struct PlatformPoint<R: Ring> {
    /// Ring of the numbers.
    pub ring: R,
    /// North component of the earth rate.
    pub w_n: R::Element,
    /// Up component of the earth rate.
    pub w_u: R::Element,
    /// `C_c^n` of every station of the scheme.
    pub attitudes: Vec<Matrix3<R::Element>>,
    /// Turns that lead to every station, on which torquer errors act; empty if none act.
    pub turns: Vec<Vec<TurnAt<R::Element>>>,
}

/// `S_i`: the local unknowns of one position as functions of the unknowns of the scheme.
#[derive(Debug, Clone)]
pub struct PositionBlock<E> {
    /// Columns (unknowns of the scheme) that occur: psi, then the coefficients.
    pub columns: Vec<usize>,
    /// Rows, one per local unknown, with one entry per column listed; the last three are empty if no
    /// accelerometer error is unknown.
    pub rows: [Box<[E]>; LOCAL],
}

impl<E: Clone> PositionBlock<E> {
    /// Entry of a functional of the local unknowns at the `k`-th column.
    pub fn entry<R: Ring<Element = E>>(&self, ring: &R, row: &[E], k: usize) -> E {
        ring.dot(row.iter().zip(&self.rows).filter_map(|(x, row)| Some((x, row.get(k)?))))
    }
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
        if scheme.unknowns == Unknowns::Drift {
            names.extend(LOCAL_NAMES[..PSI_EPS].iter().map(|n| n.to_string()));
            units.extend(["rad", "rad", "rad", "deg/h", "deg/h", "deg/h"]);
        } else {
            let copies = if scheme.carry == Carry::Reset { scheme.positions.len() } else { 1 };
            for i in 1..=copies {
                for axis in ['x', 'y', 'z'] {
                    let at = if scheme.carry == Carry::Reset { format!("@{i}") } else { String::new() };
                    names.push(format!("psi_{axis}{at}"));
                    units.push("rad");
                }
            }
        }
        for term in scheme.unknowns.terms() {
            names.extend(term.coefficients(&scheme.geometry).into_iter().map(|(name, _)| name));
            units.resize(names.len(), term.unit());
        }
        let errors = scheme.error_model();
        let paths = scheme.paths()?;
        let platform = Self { scheme, names, units, errors, paths };
        platform.check_paths()?;
        Ok(platform)
    }

    /// Refuses turns that have no image in a field.
    fn check_paths(&self) -> Result<(), SchemeError> {
        let Some(index) = self.paths.iter().rposition(|p| !p.is_empty()) else { return Ok(()) };
        // every validated scheme has a field
        let Ok(values) = RandomValues::draw(&self.scheme, &mut SplitMix64::new(1)) else { return Ok(()) };
        let roots = *values.roots();
        let inexact = |index: usize| {
            let found = self.paths[index].iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
            PathError::NotExact { name: self.scheme.positions[index].name.clone(), index, found }
        };
        match values.turns(&self.scheme, &self.paths, &roots, &values.attitudes(&self.scheme, &roots)) {
            Ok(_) => Ok(()),
            Err(at) => Err(inexact(at.min(index)).into()),
        }
    }

    /// Scheme of the platform.
    pub fn scheme(&self) -> &Scheme {
        &self.scheme
    }

    /// Scheme of the platform, which is consumed.
    pub(crate) fn into_scheme(self) -> Scheme {
        self.scheme
    }

    /// Names of the unknowns: psi first, then the coefficients term by term.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Units of the unknowns, in their order.
    pub fn units(&self) -> &[&'static str] {
        &self.units
    }

    /// Observed quantities.
    pub fn observed(&self) -> Observed {
        self.scheme.observed()
    }

    /// Turns that lead to every position, if torquer errors act on them; empty otherwise.
    pub fn paths(&self) -> &[Vec<PathStep>] {
        &self.paths
    }

    /// `S_i` of every station: of every position, and several of a rotation. The psi block depends on the
    /// carry (section 4 of the method); torquer errors add to psi^n in every turn (section 10).
    pub fn blocks<R: Ring>(&self, point: &PlatformPoint<R>) -> Vec<PositionBlock<R::Element>> {
        let ring = &point.ring;
        if self.scheme.unknowns == Unknowns::Drift {
            return vec![drift_block(ring)];
        }
        let first_d = self.names.len() - self.coefficients();
        // psi^n as a function of psi at the start of the scheme, and psi in platform axes at the end of a
        // rotation
        let mut psi_block = &point.attitudes[0];
        let mut composed;
        let mut handed_on: Option<Matrix3<R::Element>> = None;
        // sum of torquer errors in psi^n
        let mut torqued: Option<Columns<R::Element>> = None;
        let nothing = vec![ring.zero(); self.coefficients()];
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
            torqued = self.with_torquer_errors(point, i, torqued);
            let torquers =
                std::array::from_fn(|r| torqued.as_ref().map_or(&nothing, |left| &left[r]).as_slice());
            let psi_first = if self.scheme.carry == Carry::Reset { 3 * station.index } else { 0 };
            let columns = (psi_first..psi_first + 3).chain(first_d..self.names.len()).collect();
            out.push(PositionBlock { columns, rows: self.rows_at(point, c, psi_block, torquers) });
        }
        out
    }

    /// Sum of the torquer errors in psi^n, with those of the turns to a station.
    fn with_torquer_errors<R: Ring>(
        &self,
        point: &PlatformPoint<R>,
        station: usize,
        before: Option<Columns<R::Element>>,
    ) -> Option<Columns<R::Element>> {
        let ring = &point.ring;
        let mut torqued = before;
        for (from, turn) in point.turns_to(station) {
            let left = times(
                ring,
                &product(ring, &from, &turn.integral(ring)),
                &self.errors.torquer_columns(ring, &turn.axis),
            );
            torqued = Some(match torqued {
                None => left,
                Some(old) => std::array::from_fn(|r| {
                    old[r].iter().zip(&left[r]).map(|(a, b)| ring.add(a, b)).collect()
                }),
            });
        }
        torqued
    }

    /// Rows of the local unknowns at an attitude: psi^n by psi and by the errors of torquers, then the errors
    /// of gyros and accelerometers.
    fn rows_at<R: Ring>(
        &self,
        point: &PlatformPoint<R>,
        c: &Matrix3<R::Element>,
        psi: &Matrix3<R::Element>,
        torquers: [&[R::Element]; 3],
    ) -> [Box<[R::Element]>; LOCAL] {
        let ring = &point.ring;
        let accelerometers = self.observed().accelerometers;
        let no_psi = [0; 3].map(|_| ring.zero());
        let row = |psi: &[R::Element; 3], rest: &[R::Element]| {
            let mut row = Vec::with_capacity(3 + rest.len());
            row.extend_from_slice(psi);
            row.extend_from_slice(rest);
            row.into_boxed_slice()
        };
        let drift = self.errors.drift_rows(ring, c, || earth_rate_in(ring, c, &point.w_n, &point.w_u));
        let accelerometer =
            if accelerometers { self.errors.accelerometer_rows(ring, c) } else { Default::default() };
        std::array::from_fn(|r| match r {
            0..3 => row(&psi[r], torquers[r]),
            3..PSI_EPS => row(&no_psi, &drift[r - 3]),
            _ if !accelerometers => Box::default(),
            _ => row(&no_psi, &accelerometer[r - PSI_EPS]),
        })
    }
}

/// Block of a scheme whose unknowns are psi and eps themselves.
fn drift_block<R: Ring>(ring: &R) -> PositionBlock<R::Element> {
    let rows = std::array::from_fn(|i| match i {
        0..PSI_EPS => (0..PSI_EPS).map(|j| if i == j { ring.one() } else { ring.zero() }).collect(),
        _ => Box::default(),
    });
    PositionBlock { columns: (0..PSI_EPS).collect(), rows }
}

impl<R: Ring> PlatformPoint<R> {
    /// Turns to a station, each with the attitude at its start.
    #[expect(clippy::type_complexity, reason = "pairs, which would be no plainer under a name")]
    pub(crate) fn turns_to(&self, i: usize) -> Vec<(Matrix3<R::Element>, &TurnAt<R::Element>)> {
        let (Some(turns), Some(before)) = (self.turns.get(i), i.checked_sub(1)) else { return Vec::new() };
        let mut from = self.attitudes[before].clone();
        let mut out = Vec::with_capacity(turns.len());
        for turn in turns {
            let next = product(&self.ring, &from, &turn.rotation(&self.ring));
            out.push((std::mem::replace(&mut from, next), turn));
        }
        out
    }
}

/// Product `m v`.
fn times<R: Ring>(ring: &R, m: &Matrix3<R::Element>, v: &Columns<R::Element>) -> Columns<R::Element> {
    std::array::from_fn(|r| (0..v[0].len()).map(|k| ring.dot((0..3).map(|j| (&m[r][j], &v[j][k])))).collect())
}

/// `C^T (wN, wU, 0)`: the earth rate in the axes of c.
pub fn earth_rate_in<R: Ring>(
    ring: &R,
    c: &Matrix3<R::Element>,
    w_n: &R::Element,
    w_u: &R::Element,
) -> [R::Element; 3] {
    std::array::from_fn(|j| ring.dot([(&c[0][j], w_n), (&c[1][j], w_u)]))
}

impl Platform {
    /// Error model of the coefficients.
    pub fn errors(&self) -> &ErrorModel {
        &self.errors
    }

    /// Error term of each coefficient, in the order of the unknowns; none if the unknowns are the drift
    /// itself.
    pub fn error_terms(&self) -> &[ErrorTerm] {
        self.errors.terms()
    }

    /// Number of coefficients.
    pub fn coefficients(&self) -> usize {
        self.errors.terms().len()
    }
}

/// `F` of (8) on the local unknowns: `psi' = psi x omega_ie + eps`, the others constant.
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

/// `H` of (9): `Z^n = (psi_z, 0, -psi_x)` plus the error of the accelerometers if it is unknown. Returns the
/// components with their rows: 1 and 3, with accelerometer errors also 2, and [`AZIMUTH`] for a measured
/// `psi_y^n`.
pub fn local_output<R: Ring>(ring: &R, observed: Observed) -> Vec<(usize, [R::Element; LOCAL])> {
    let unit = |j: usize, value: R::Element| {
        let mut row: [R::Element; LOCAL] = std::array::from_fn(|_| ring.zero());
        row[j] = value;
        row
    };
    let mut out = vec![(1, unit(2, ring.one())), (3, unit(0, ring.neg(&ring.one())))];
    if observed.accelerometers {
        out.insert(1, (2, unit(PSI_EPS + 1, ring.one())));
        out[0].1[PSI_EPS] = ring.one();
        out[2].1[PSI_EPS + 2] = ring.one();
    }
    if observed.azimuth {
        out.push((AZIMUTH, unit(1, ring.one())));
    }
    out
}

/// The images of a scheme in one random prime field.
#[derive(Debug, Clone)]
pub struct FieldSample {
    /// Field with its root of unity.
    pub roots: RootField,
    /// The platform in the field.
    pub point: PlatformPoint<Field>,
    /// Rotation of every position, if rotations are judged by their output history; empty otherwise.
    pub arcs: Vec<Option<SteadyTurn>>,
}

/// Rotation at a steady rate, in a field.
#[derive(Debug, Clone)]
pub struct SteadyTurn {
    /// Axis of the rotation.
    pub axis: Axis,
    /// Cosine and sine of the whole angle.
    pub cos_sin: (u64, u64),
    /// Rate of the rotation, times the unit T of time.
    pub rate: u64,
    /// Duration of the rotation, in units of T.
    pub duration: u64,
}

/// Random values of a sample, kept so that a conjugate embedding can reuse them.
#[derive(Debug, Clone)]
pub struct RandomValues {
    roots: RootField,
    rates: (u64, u64),
    /// Image `exp(i angle)` of every generic angle.
    generic: Vec<(String, u64)>,
    /// Image of pi, if torquer errors act in turns.
    pi: Option<u64>,
    /// Rate of the rotation of every position, if rotations are judged by their output history.
    turning: Vec<u64>,
}

impl RandomValues {
    /// Random values for `scheme`: a field that contains its angles, earth rates and generic angles.
    ///
    /// # Errors
    /// [`PrimeError`] never for a validated scheme.
    pub fn draw(scheme: &Scheme, rng: &mut SplitMix64) -> Result<Self, PrimeError> {
        let stations = scheme.stations();
        // the scheme of an analysis has been validated
        let paths = scheme.paths().unwrap_or_default();
        let turns = paths.iter().flatten().map(|step| step.angle().turn());
        let angles = stations.iter().flat_map(Station::angles).map(Angle::turn).chain(turns);
        let latitude = scheme.latitude.map(|l| obsdeg_exact::TurnFraction::from_nanodeg(l.nanodeg()));
        let roots = RootField::random(common_order(angles.chain(latitude)), rng)?;
        let p = roots.field.modulus();
        let mut nonzero = || 1 + rng.below(p - 1);
        let rates = (nonzero(), nonzero());
        let generic = scheme.generic_names().into_iter().map(|n| (n, nonzero())).collect();
        let pi = (scheme.torquers_act() || scheme.by_history()).then(&mut nonzero);
        let rotations = if scheme.by_history() { scheme.positions.len() } else { 0 };
        let turning = (0..rotations).map(|_| nonzero()).collect();
        Ok(Self { roots, rates, generic, pi, turning })
    }

    /// Field with its root of unity.
    pub fn roots(&self) -> &RootField {
        &self.roots
    }

    /// Replaces the value of a generic angle by the one with `tan(angle/2) = t`. Returns false if the name
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

    /// Sets a generic angle to 180 degrees, where `tan(angle/2)` is infinite. Returns false if the name is
    /// unknown.
    pub(crate) fn set_half_turn(&mut self, name: &str) -> bool {
        let f = &self.roots.field;
        let minus_one = f.neg(f.one());
        self.generic.iter_mut().find(|(n, _)| n == name).map(|(_, z)| *z = minus_one).is_some()
    }

    /// `(cos, sin)` of an angle in a conjugate of the field. If the conjugation takes the imaginary unit to
    /// its negative, exp(i angle) at a fixed tangent is inverted.
    pub fn angle_cos_sin(&self, roots: &RootField, angle: &Angle) -> (u64, u64) {
        let f = roots.field;
        let flip = roots.imaginary_unit() != self.roots.imaginary_unit();
        let constant = circle(roots, angle.turn());
        let generic = angle.generic().map_or(f.one(), |(name, minus)| {
            let drawn = self.generic.iter().find(|(n, _)| n == name);
            let z = drawn.expect("a value is drawn for every generic angle of the scheme").1;
            if minus != flip { f.inv(z) } else { z }
        });
        roots.cos_sin(f.mul(constant, generic))
    }

    /// `(cos, sin)` of a generic angle at a sample of these values.
    pub(crate) fn generic_cos_sin(&self, name: &str, sample: &FieldSample) -> Option<(u64, u64)> {
        let z = self.generic.iter().find(|(n, _)| n == name)?.1;
        let f = sample.roots.field;
        // see `sample`: the sine at a fixed tangent must not depend on the sign of the imaginary unit
        let flipped = sample.roots.imaginary_unit() != self.roots.imaginary_unit();
        Some(sample.roots.cos_sin(if flipped { f.inv(z) } else { z }))
    }

    /// `C_c^n` of every station in a conjugate of the field.
    fn attitudes(&self, scheme: &Scheme, roots: &RootField) -> Vec<Matrix3<u64>> {
        let cos_sin = |angle: &Angle| self.angle_cos_sin(roots, angle);
        scheme.stations().iter().map(|station| station.attitude(&roots.field, cos_sin)).collect()
    }

    /// Turns to every station ([`PlatformPoint::turns`]) in a field.
    ///
    /// # Errors
    /// Index of the first position whose slew path has no image, or does not lead there.
    fn turns(
        &self,
        scheme: &Scheme,
        paths: &[Vec<PathStep>],
        roots: &RootField,
        attitudes: &[Matrix3<u64>],
    ) -> Result<Vec<Vec<TurnAt<u64>>>, usize> {
        let Some(pi) = self.pi.filter(|_| !paths.is_empty()) else { return Ok(Vec::new()) };
        let f = roots.field;
        let cos_sin = |angle: &Angle| self.angle_cos_sin(roots, angle);
        let at = |step: &PathStep, from: &Matrix3<u64>, to: Option<&Matrix3<u64>>| {
            step.at_field(roots, from, to, pi, cos_sin)
        };
        turns_of(&f, scheme, paths, attitudes, at, |reached, to| reached == to)
    }

    /// Rotation of every position, if rotations are judged by their output history.
    fn arcs(&self, scheme: &Scheme, roots: &RootField) -> Vec<Option<SteadyTurn>> {
        let Some(pi) = self.pi else { return Vec::new() };
        let f = roots.field;
        let arc = |(rate, position): (&u64, &Position)| {
            let rotation = position.rotation.as_ref()?;
            let angle = f.mul(pi, f.from_ratio(rotation.angle.nanodeg(), 180_000_000_000));
            let cos_sin = self.angle_cos_sin(roots, &rotation.angle);
            Some(SteadyTurn {
                axis: rotation.axis,
                cos_sin,
                rate: *rate,
                duration: f.mul(angle, f.inv(*rate)),
            })
        };
        self.turning.iter().zip(&scheme.positions).map(arc).collect()
    }

    /// Sample under the embedding `g -> g^a`. Generic angles keep their `tan(angle/2)`.
    pub fn sample(&self, scheme: &Scheme, a: u64) -> FieldSample {
        let roots = self.roots.conjugate(a);
        let f = roots.field;
        let (w_n, w_u) = match scheme.latitude {
            None => self.rates,
            Some(latitude) => {
                let turn = obsdeg_exact::TurnFraction::from_nanodeg(latitude.nanodeg());
                let (c, s) = roots.cos_sin(circle(&roots, turn));
                (f.mul(self.rates.0, c), f.mul(self.rates.0, s))
            }
        };
        self.sample_at(scheme, a, [w_n, w_u])
    }

    /// Sample under the embedding `g -> g^a`, at other rates `(wN, wU)` of the earth.
    pub(crate) fn sample_at(&self, scheme: &Scheme, a: u64, [w_n, w_u]: [u64; 2]) -> FieldSample {
        let roots = self.roots.conjugate(a);
        let attitudes = self.attitudes(scheme, &roots);
        let paths = scheme.paths().unwrap_or_default();
        let turns = self.turns(scheme, &paths, &roots, &attitudes);
        let turns = turns.expect("the ways of a platform have images in the fields of its angles");
        let arcs = self.arcs(scheme, &roots);
        FieldSample { roots, arcs, point: PlatformPoint { ring: roots.field, w_n, w_u, attitudes, turns } }
    }
}

/// Turns to every station ([`PlatformPoint::turns`]) in a ring. `at` gives one turn of a path from the
/// attitude at its start; if it is the only turn, the attitude at its end is given too. `arrives` is true if
/// a path ends at the attitude required.
///
/// # Errors
/// Index of the first position whose path `at` does not give, or does not lead there.
fn turns_of<R: Ring>(
    ring: &R,
    scheme: &Scheme,
    paths: &[Vec<PathStep>],
    attitudes: &[Matrix3<R::Element>],
    at: impl Fn(&PathStep, &Matrix3<R::Element>, Option<&Matrix3<R::Element>>) -> Option<TurnAt<R::Element>>,
    arrives: impl Fn(&Matrix3<R::Element>, &Matrix3<R::Element>) -> bool,
) -> Result<Vec<Vec<TurnAt<R::Element>>>, usize> {
    if paths.is_empty() {
        return Ok(Vec::new());
    }
    let mut out = Vec::with_capacity(attitudes.len());
    for (i, station) in scheme.stations().iter().enumerate() {
        let path = if station.continues { &[][..] } else { &paths[station.index][..] };
        let mut attitude = attitudes[i.saturating_sub(1)].clone();
        let only = (path.len() == 1).then_some(&attitudes[i]);
        let mut turns = Vec::with_capacity(path.len());
        for step in path {
            let turn = at(step, &attitude, only).ok_or(station.index)?;
            attitude = product(ring, &attitude, &turn.rotation(ring));
            turns.push(turn);
        }
        if i > 0 && !station.continues && !arrives(&attitude, &attitudes[i]) {
            return Err(station.index);
        }
        out.push(turns);
    }
    Ok(out)
}

impl PlatformPoint<Float> {
    /// The platform in floating point at the given rates of the earth.
    pub fn in_floats(platform: &Platform, w_n: f64, w_u: f64) -> Self {
        let scheme = platform.scheme();
        let cos_sin = |angle: &Angle| angle.turn().cos_sin_f64();
        let attitudes: Vec<_> = scheme.stations().iter().map(|s| s.attitude(&Float, cos_sin)).collect();
        // the end of each path was checked when the platform was made
        let at = |step: &PathStep, from: &Matrix3<f64>, _: Option<&Matrix3<f64>>| Some(step.at_f64(from));
        let turns = turns_of(&Float, scheme, &platform.paths, &attitudes, at, |_, _| true);
        let turns = turns.unwrap_or_default();
        Self { ring: Float, w_n, w_u, attitudes, turns }
    }
}

/// Image of `exp(i angle)` for an angle of the scheme of this field.
fn circle(roots: &RootField, angle: obsdeg_exact::TurnFraction) -> u64 {
    roots.unit_circle(angle).expect("fields are drawn with the roots of unity of every angle of the scheme")
}

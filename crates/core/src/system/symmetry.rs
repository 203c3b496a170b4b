//! Scaling and translation symmetries: directions `c_i x_i + d_i` with rational `c_i`, `d_i` that no output sees, at
//! any point.

use obsdeg_exact::{Echelon, Field, Ratio};

use super::functions::gcd;
use super::judge::{At, Judgement, climb_at};
use super::model::{Compiled, ModelError, SystemModel};
use crate::degree::sparse::{extend_by_short_vectors, support};

/// Points at which a direction must vanish, at most.
const POINTS: usize = 8;
/// Most unknowns among which directions that are polynomials in them are sought.
const MOVED: usize = 16;
/// Most coefficients of such a direction.
const COEFFICIENTS: usize = 800;
/// Points that these take, at most.
const POLYNOMIAL_POINTS: usize = 400;
/// Their highest degree.
pub const POLYNOMIAL_DEGREE: usize = 4;

/// A rational coefficient of an unknown.
pub(crate) type Term = (usize, (i64, i64));

/// A direction in which nothing changes: `x_i` grows by `c_i x_i + d_i`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Symmetry {
    /// The `c_i` that are not zero.
    pub scaling: Vec<Term>,
    /// The `d_i` that are not zero.
    pub translation: Vec<Term>,
}

/// What stays the same: a product of powers, or a sum.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Invariant {
    /// Integer exponents (or, of a sum, coefficients).
    pub terms: Vec<(usize, i64)>,
    /// A product of powers, not a sum.
    pub product: bool,
    /// Its degree.
    pub degree: usize,
}

/// The factors of a product, and its rational coefficient.
pub(crate) type PolynomialTerm = (Vec<usize>, (i64, i64));

/// A direction whose components are polynomials in the unknowns and the known constants: `(unknown, [(factors,
/// coefficient)])`; a factor is an unknown or a known constant (counted on behind the unknowns).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PolynomialDirection {
    /// Of every unknown that it moves.
    pub components: Vec<(usize, Vec<PolynomialTerm>)>,
}

/// The symmetries of a system, and the invariant combinations that they leave observable.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Symmetries {
    /// Independent ones.
    pub found: Vec<Symmetry>,
    /// Directions beyond these that are polynomials in the unknowns: turns, for instance.
    pub polynomial: Vec<PolynomialDirection>,
    /// What each direction beyond all of these moves: of unobservable directions among unknowns that are excited.
    pub unexplained: Vec<Vec<usize>>,
    /// Observable combinations of unobservable unknowns.
    pub invariants: Vec<Invariant>,
}

/// The vector as small rationals, one at its first entry.
fn rationals(f: &Field, v: &[u64]) -> Option<Vec<(i64, i64)>> {
    let lead = v.iter().find(|x| **x != 0)?;
    let inverse = f.inv(*lead);
    v.iter().map(|&x| Ratio::recover(f, f.mul(x, inverse)).map(|r| (r.num, r.den))).collect()
}

/// Rationals times their common denominator.
fn integers(v: &[(i64, i64)]) -> Vec<i64> {
    let common = v.iter().filter(|x| x.0 != 0).fold(1, |l, x| l / gcd(l, x.1) * x.1);
    let scaled: Vec<i64> = v.iter().map(|x| x.0 * (common / x.1)).collect();
    let divisor = scaled.iter().fold(0, |g, x| gcd(g, *x)).max(1);
    scaled.iter().map(|x| x / divisor).collect()
}

/// The symmetries of a judged model.
///
/// # Errors
/// [`ModelError`] when a point cannot be had.
pub fn symmetries(
    model: &SystemModel,
    compiled: &Compiled,
    judged: &Judgement,
    seed: u64,
) -> Result<Symmetries, ModelError> {
    let n = judged.layout.unknowns.len();
    let excited = &judged.findings.degrees.excited;
    let silent = excited.iter().filter(|e| !**e).count();
    let defect = n - judged.findings.degrees.rank() - silent;
    if defect == 0 {
        return Ok(Symmetries::default());
    }
    let f = judged.fields[0];
    let mut rng = model.random(seed, "symmetries");
    let mut basis = Echelon::new(f, 2 * n);
    // an unknown that no output sees is said so by itself; an observable one never moves
    for c in (0..n).filter(|&c| !excited[c] || judged.findings.degrees.degree[c].is_some()) {
        for column in [c, n + c] {
            let unit: Vec<u64> = (0..2 * n).map(|j| if j == column { f.one() } else { 0 }).collect();
            basis.insert(&unit);
        }
    }
    let (mut last, mut at): (usize, Option<At>) = (0, None);
    for point in 0..POINTS {
        let here = climb_at(model, compiled, &judged.layout, f, &mut rng)?;
        if let Some(span) = here.stairs.last() {
            for i in 0..span.rank() {
                let row = span.row(i);
                let scaled = row.iter().zip(&here.values).map(|(&r, &x)| f.mul(r, x));
                let both: Vec<u64> = scaled.chain(row.iter().copied()).collect();
                basis.insert(&both);
            }
        }
        at = Some(here);
        if point >= 2 && basis.rank() == last {
            break;
        }
        last = basis.rank();
    }
    let Some(at) = at else { return Ok(Symmetries::default()) };
    let mut span = Echelon::new(f, 2 * n);
    let short = extend_by_short_vectors(&basis.null_space(), &mut span);
    let mut tangents = Echelon::new(f, n);
    let mut out = Symmetries::default();
    for v in short {
        let tangent: Vec<u64> = (0..n).map(|c| f.add(f.mul(v[c], at.values[c]), v[n + c])).collect();
        let Some(k) = rationals(&f, &v).filter(|_| tangents.insert(&tangent)) else { continue };
        let terms = |half: &[(i64, i64)]| -> Vec<Term> {
            half.iter().copied().enumerate().filter(|(_, k)| k.0 != 0).collect()
        };
        out.found.push(Symmetry { scaling: terms(&k[..n]), translation: terms(&k[n..]) });
    }
    if out.found.len() < defect {
        let moved: Vec<usize> =
            (0..n).filter(|&c| excited[c] && judged.findings.degrees.degree[c].is_none()).collect();
        let mut draw = || climb_at(model, compiled, &judged.layout, f, &mut rng);
        // constants that every segment and experiment shares may be factors too
        let changed =
            model.segments.iter().map(|s| &s.constants).chain(model.own.iter().map(|e| &e.constants));
        let changed: Vec<&String> = changed.flatten().map(|(name, _)| name).collect();
        let shared = |name: &String| !changed.contains(&name);
        let constants = model.constants.iter().enumerate().filter(|(_, c)| shared(&c.0.name));
        let unknowns = if n <= MOVED { (0..n).collect() } else { moved.clone() };
        let factors: Vec<usize> = unknowns.into_iter().chain(constants.map(|(i, _)| n + i)).collect();
        for degree in 1..=POLYNOMIAL_DEGREE {
            let products = products(&factors, degree);
            if out.found.len() + out.polynomial.len() == defect
                || moved.len() > MOVED
                || moved.len() * products.len() > COEFFICIENTS
            {
                break;
            }
            out.polynomial.extend(directions(&f, &moved, &products, &mut tangents, &at, &mut draw)?);
        }
    }
    if out.found.len() + out.polynomial.len() < defect
        && let Some(rows) = at.stairs.last()
    {
        let among_excited = |v: &Vec<u64>| support(v).iter().all(|&c| excited[c]);
        let rest: Vec<Vec<u64>> = rows.null_space().into_iter().filter(among_excited).collect();
        out.unexplained = extend_by_short_vectors(&rest, &mut tangents).iter().map(|v| support(v)).collect();
    }
    out.invariants = invariants(&f, n, &out.found, &at);
    Ok(out)
}

/// All products of up to `degree` of the factors.
fn products(factors: &[usize], degree: usize) -> Vec<Vec<usize>> {
    let mut out: Vec<Vec<usize>> = vec![Vec::new()];
    let mut last = 0;
    for _ in 0..degree {
        let end = out.len();
        for i in last..end {
            let from = out[i].last().and_then(|l| factors.iter().position(|f| f == l)).unwrap_or(0);
            let longer = factors[from..].iter().map(|&f| [&out[i][..], &[f]].concat());
            let longer: Vec<_> = longer.collect();
            out.extend(longer);
        }
        last = end;
    }
    out
}

/// Directions `v_i = sum_j a_ij m_j` over the unknowns that move, m_j products of unknowns and known constants: a
/// linear system for the a_ij from rows at several points.
fn directions(
    f: &Field,
    moved: &[usize],
    products: &[Vec<usize>],
    tangents: &mut Echelon,
    at: &At,
    draw: &mut dyn FnMut() -> Result<At, ModelError>,
) -> Result<Vec<PolynomialDirection>, ModelError> {
    let width = products.len();
    let value = |at: &At, product: &Vec<usize>| product.iter().fold(f.one(), |x, &j| f.mul(x, at.values[j]));
    let mut basis = Echelon::new(*f, moved.len() * width);
    let (mut rank, mut still) = (0, 0);
    for _ in 0..POLYNOMIAL_POINTS {
        let here = draw()?;
        let Some(span) = here.stairs.last() else { break };
        let values: Vec<u64> = products.iter().map(|p| value(&here, p)).collect();
        for i in 0..span.rank() {
            let row = span.row(i);
            let entries = moved.iter().flat_map(|&m| values.iter().map(move |&x| f.mul(row[m], x)));
            basis.insert(&entries.collect::<Vec<_>>());
        }
        still = if basis.rank() == rank { still + 1 } else { 0 };
        if still == 2 {
            break;
        }
        rank = basis.rank();
    }
    if still < 2 {
        return Ok(Vec::new());
    }
    let here: Vec<u64> = products.iter().map(|p| value(at, p)).collect();
    let mut span = Echelon::new(*f, moved.len() * width);
    let mut out = Vec::new();
    for v in extend_by_short_vectors(&basis.null_space(), &mut span) {
        let mut tangent = vec![0; tangents.columns()];
        for (part, &m) in v.chunks_exact(width).zip(moved) {
            tangent[m] = f.dot(0, here.iter().zip(part).map(|(&x, &a)| (a, x)));
        }
        let Some(k) = rationals(f, &v).filter(|_| tangents.insert(&tangent)) else { continue };
        let component = |(part, &m): (&[(i64, i64)], &usize)| {
            let terms = products.iter().cloned().zip(part.iter().copied());
            let terms: Vec<_> = terms.filter(|(_, k)| k.0 != 0).collect();
            (!terms.is_empty()).then_some((m, terms))
        };
        let components = k.chunks_exact(width).zip(moved).filter_map(component).collect();
        out.push(PolynomialDirection { components });
    }
    Ok(out)
}

/// Products of powers that every scaling leaves alone, and sums that every translation does, as far as they are
/// observable.
fn invariants(f: &Field, n: usize, found: &[Symmetry], at: &At) -> Vec<Invariant> {
    let mut out = Vec::new();
    let scalings: Vec<&Symmetry> = found.iter().filter(|s| s.translation.is_empty()).collect();
    let translations: Vec<&Symmetry> = found.iter().filter(|s| s.scaling.is_empty()).collect();
    for (product, list) in [(true, scalings), (false, translations)] {
        let terms = |s: &Symmetry| if product { s.scaling.clone() } else { s.translation.clone() };
        let mut rows = Echelon::new(*f, n);
        let mut moved = vec![false; n];
        for s in &list {
            let mut row = vec![0; n];
            for (c, (p, q)) in terms(s) {
                row[c] = f.from_ratio(p, q);
                moved[c] = true;
            }
            rows.insert(&row);
        }
        let kept: Vec<Vec<u64>> =
            rows.null_space().into_iter().filter(|v| support(v).iter().all(|&c| moved[c])).collect();
        // the null vectors of what is not moved are units
        let mut span = Echelon::new(*f, n);
        for m in extend_by_short_vectors(&kept, &mut span) {
            let Some(k) = rationals(f, &m) else { continue };
            let exponents = integers(&k);
            // d(prod x^m) = prod x^m sum m_i dx_i / x_i
            let gradient: Vec<u64> = exponents
                .iter()
                .zip(&at.values)
                .map(|(&m, &x)| f.mul(f.from_i64(m), if product { f.inv(x) } else { f.one() }))
                .collect();
            if let Some(degree) = at.stairs.iter().position(|v| v.contains(&gradient)) {
                let terms = exponents.iter().copied().enumerate().filter(|t| t.1 != 0).collect();
                out.push(Invariant { terms, product, degree });
            }
        }
    }
    out
}

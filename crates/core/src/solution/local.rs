//! Observables of a single position, solved from Z in n: (13)-(17).

use crate::degree::coefficient::Rates;
use crate::model::Platform;
use crate::model::platform::{AZIMUTH, LOCAL, Observed, PlatformPoint, PositionBlock};
use crate::model::ring::Ring;

/// Term `sign * wN^a wU^b * Z_component^(order)`, Z in n.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ZTerm {
    /// Component of Z: 1, 2, 3 in n-axes, or the azimuth.
    pub component: usize,
    /// Derivative order.
    pub order: usize,
    /// Sign of the term, +1 or -1.
    pub sign: i64,
    /// Exponents of `(wN, wU)`.
    pub rates: Rates,
}

/// Observable of one position: a functional of the local unknowns and its solution in Z.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LocalObservable {
    /// Derivative order that the observable needs.
    pub order: usize,
    /// Terms `(local unknown, sign, exponents of (wN, wU))` of the functional.
    pub row: Vec<(usize, i64, Rates)>,
    /// Solution in Z.
    pub solution: Vec<ZTerm>,
}

/// Components of the earth rate that are zero at the latitude of a scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RateZeros {
    /// True if `wN = 0`: a pole.
    pub w_n: bool,
    /// True if `wU = 0`: the equator.
    pub w_u: bool,
}

impl RateZeros {
    /// Zeros of the rates at the latitude of `platform`.
    pub(crate) fn of(platform: &Platform) -> Self {
        let latitude = platform.scheme().latitude;
        Self { w_n: latitude.is_some_and(|l| l.is_pole()), w_u: latitude.is_some_and(|l| l.is_equator()) }
    }
}

const fn z(component: usize, order: usize, sign: i64, rates: Rates) -> ZTerm {
    ZTerm { component, order, sign, rates }
}

/// The observables of a single position, by order: `psi_x` (13), `psi_z` (14), `eps_x` (15), then
/// `eps_z - wN psi_y` (17) and `eps_y` (16) away from the poles; with a measured azimuth `psi_y`,
/// `eps_z` and `eps_y` itself.
pub(crate) fn local_observables(zeros: RateZeros, observed: Observed) -> Vec<LocalObservable> {
    const UNIT: Rates = [0, 0];
    let unit = |index: usize| vec![(index, 1, UNIT)];
    let measured_azimuth = observed.azimuth;
    if observed.accelerometers {
        return with_accelerometers(zeros, measured_azimuth);
    }
    let mut out = vec![
        LocalObservable { order: 0, row: unit(2), solution: vec![z(1, 0, 1, UNIT)] },
        LocalObservable { order: 0, row: unit(0), solution: vec![z(3, 0, -1, UNIT)] },
    ];
    if measured_azimuth {
        out.push(LocalObservable { order: 0, row: unit(1), solution: vec![z(AZIMUTH, 0, 1, UNIT)] });
    }
    out.push(LocalObservable {
        order: 1,
        row: unit(3),
        solution: vec![z(1, 0, 1, [0, 1]), z(3, 1, -1, UNIT)],
    });
    if measured_azimuth {
        out.push(LocalObservable {
            order: 1,
            row: unit(5),
            solution: vec![z(1, 1, 1, UNIT), z(3, 0, 1, [0, 1]), z(AZIMUTH, 0, 1, [1, 0])],
        });
        out.push(LocalObservable {
            order: 1,
            row: unit(4),
            solution: vec![z(AZIMUTH, 1, 1, UNIT), z(1, 0, -1, [1, 0])],
        });
    } else {
        out.push(LocalObservable {
            order: 1,
            row: vec![(5, 1, UNIT), (1, -1, [1, 0])],
            solution: vec![z(1, 1, 1, UNIT), z(3, 0, 1, [0, 1])],
        });
        if !zeros.w_n {
            out.push(LocalObservable {
                order: 2,
                row: unit(4),
                solution: vec![z(1, 2, -1, [-1, 0]), z(3, 1, -1, [-1, 1]), z(1, 0, -1, [1, 0])],
            });
        }
    }
    without_zeros(out, zeros)
}

/// Observables of a position with an accelerometer error a in Z: `psi_z + a_x`, `a_y`, `psi_x - a_z`;
/// `eps_x - wU psi_z`; then away from the poles `eps_z - wN psi_y + wU psi_x` and `eps_y + wN psi_z`. With a
/// measured azimuth: `psi_y`, and the last two in Z' and Za'.
fn with_accelerometers(zeros: RateZeros, measured_azimuth: bool) -> Vec<LocalObservable> {
    const UNIT: Rates = [0, 0];
    let observable = |order, row: &[(usize, i64, Rates)], solution: &[ZTerm]| LocalObservable {
        order,
        row: row.to_vec(),
        solution: solution.to_vec(),
    };
    let mut out = vec![
        observable(0, &[(2, 1, UNIT), (6, 1, UNIT)], &[z(1, 0, 1, UNIT)]),
        observable(0, &[(7, 1, UNIT)], &[z(2, 0, 1, UNIT)]),
        observable(0, &[(0, 1, UNIT), (8, -1, UNIT)], &[z(3, 0, -1, UNIT)]),
    ];
    if measured_azimuth {
        out.push(observable(0, &[(1, 1, UNIT)], &[z(AZIMUTH, 0, 1, UNIT)]));
    }
    out.push(observable(1, &[(3, 1, UNIT), (2, -1, [0, 1])], &[z(3, 1, -1, UNIT)]));
    if measured_azimuth {
        let solution = [z(1, 1, 1, UNIT), z(AZIMUTH, 0, 1, [1, 0])];
        out.push(observable(1, &[(5, 1, UNIT), (0, 1, [0, 1])], &solution));
        out.push(observable(1, &[(4, 1, UNIT), (2, 1, [1, 0])], &[z(AZIMUTH, 1, 1, UNIT)]));
    } else {
        out.push(observable(1, &[(5, 1, UNIT), (1, -1, [1, 0]), (0, 1, [0, 1])], &[z(1, 1, 1, UNIT)]));
        if !zeros.w_n {
            let solution = [z(1, 2, -1, [-1, 0]), z(3, 1, -1, [-1, 1])];
            out.push(observable(2, &[(4, 1, UNIT), (2, 1, [1, 0])], &solution));
        }
    }
    without_zeros(out, zeros)
}

/// Observables without the terms that are zero at the latitude.
fn without_zeros(mut out: Vec<LocalObservable>, zeros: RateZeros) -> Vec<LocalObservable> {
    let vanishes = |r: &Rates| (zeros.w_n && r[0] > 0) || (zeros.w_u && r[1] > 0);
    for o in &mut out {
        o.row.retain(|(_, _, r)| !vanishes(r));
        o.solution.retain(|t| !vanishes(&t.rates));
    }
    out
}

/// Rows of `observables` at every position of `platform`, at `point`.
pub(crate) fn rows_at<R: Ring>(
    platform: &Platform,
    point: &PlatformPoint<R>,
    observables: &[LocalObservable],
) -> Vec<Vec<R::Element>> {
    let ring = &point.ring;
    let power = |rates: Rates| {
        let factor =
            |base: &R::Element, e: i32| (0..e).fold(ring.one(), |product, _| ring.mul(&product, base));
        ring.mul(&factor(&point.w_n, rates[0]), &factor(&point.w_u, rates[1]))
    };
    let row = |block: &PositionBlock<R::Element>, o: &LocalObservable| {
        let mut out: Vec<R::Element> = platform.names().iter().map(|_| ring.zero()).collect();
        for &(index, sign, rates) in &o.row {
            debug_assert!(index < LOCAL);
            let factor = if sign < 0 { ring.neg(&power(rates)) } else { power(rates) };
            for (&column, entry) in block.columns.iter().zip(&block.rows[index]) {
                out[column] = ring.add(&out[column], &ring.mul(&factor, entry));
            }
        }
        out
    };
    platform.blocks(point).iter().flat_map(|b| observables.iter().map(|o| row(b, o))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::degree::platform_rows::local_chain;
    use crate::model::platform::{local_dynamics, local_output};
    use obsdeg_exact::{Echelon, Field, SplitMix64};

    /// True for a pole, for the equator, and with a measured azimuth.
    const PLACES: [(bool, bool, bool); 5] = [
        (false, false, false),
        (true, false, false),
        (false, true, false),
        (false, false, true),
        (true, false, true),
    ];

    /// (13)-(17) agree with the recursion: substituting the derivatives of Z gives the functional, and at
    /// every order the observables span the same space as the recursion.
    #[test]
    fn observables_of_one_position_follow_from_the_recursion() {
        let f = Field::new((1 << 60) + 33);
        let mut rng = SplitMix64::new(4);
        for ((pole, equator, azimuth), accelerometers) in
            PLACES.iter().flat_map(|p| [(*p, false), (*p, true)])
        {
            let mut rate = |zero: bool| if zero { 0 } else { f.from_u64(rng.next_u64()) };
            let (w_n, w_u) = (rate(pole), rate(equator));
            let dynamics = local_dynamics(&f, &w_n, &w_u);
            let observed = Observed { azimuth, accelerometers };
            let output = local_output(&f, observed);
            let derivative = |component: usize, order: usize| {
                let row = output.iter().find(|(c, _)| *c == component).expect("measured").1;
                (0..order).fold(row, |r, _| {
                    std::array::from_fn(|j| f.dot(0, (0..LOCAL).map(|i| (r[i], dynamics[i][j]))))
                })
            };
            let power = |r: Rates| {
                let factor =
                    |w: u64, e: i32| f.pow(if e < 0 { f.inv(w) } else { w }, e.unsigned_abs().into());
                f.mul(factor(w_n, r[0]), factor(w_u, r[1]))
            };
            let observables = local_observables(RateZeros { w_n: pole, w_u: equator }, observed);
            let chain = local_chain(&f, w_n, w_u, observed);
            for o in &observables {
                let mut substituted = [0; LOCAL];
                for t in &o.solution {
                    assert!(t.order <= o.order);
                    let factor = f.mul(f.from_i64(t.sign), power(t.rates));
                    for (slot, x) in substituted.iter_mut().zip(derivative(t.component, t.order)) {
                        *slot = f.add(*slot, f.mul(factor, x));
                    }
                }
                let mut expected = [0; LOCAL];
                for &(index, sign, rates) in &o.row {
                    expected[index] = f.mul(f.from_i64(sign), power(rates));
                }
                assert_eq!(substituted, expected, "{o:?}");
            }
            for order in 0..4 {
                let (mut a, mut b) = (Echelon::new(f, LOCAL), Echelon::new(f, LOCAL));
                chain.iter().filter(|r| r.order <= order).for_each(|r| {
                    a.insert(&r.row);
                });
                for o in observables.iter().filter(|o| o.order <= order) {
                    let mut row = [0; LOCAL];
                    o.row.iter().for_each(|&(i, s, r)| row[i] = f.mul(f.from_i64(s), power(r)));
                    assert!(a.contains(&row));
                    b.insert(&row);
                }
                assert_eq!(a.rank(), b.rank());
            }
        }
    }
}

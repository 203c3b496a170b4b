//! Tests of Groebner bases.

use super::*;
use crate::multivariate::Monomial;
use proptest::prelude::*;

const ENOUGH: RemainingWork = RemainingWork::new(50_000_000);

fn field() -> Field {
    Field::new((1 << 60) + 33)
}

/// Polynomial from terms `(coefficient, exponents)`.
fn polynomial(terms: &[(i64, Vec<u32>)]) -> Polynomial {
    let f = field();
    let mut out = Polynomial::default();
    for (c, exponents) in terms {
        let powers = exponents.iter().enumerate().filter(|p| *p.1 > 0).map(|(v, &e)| (v as u32, e));
        out.put(&f, powers.collect(), f.from_i64(*c));
    }
    out
}

/// Leading term in the textbook order, implemented independently: dense exponents and the
/// coefficient.
fn leading(p: &Polynomial, weights: &[u32]) -> Option<(Vec<u32>, u64)> {
    let dense = |m: &Monomial| {
        let mut out = vec![0u32; weights.len()];
        m.iter().for_each(|&(v, e)| out[v as usize] = e);
        out
    };
    let key = |e: &Vec<u32>| {
        let degree: u32 = e.iter().zip(weights).map(|(e, w)| e * w).sum();
        (degree, e.iter().rev().map(|&e| std::cmp::Reverse(e)).collect::<Vec<_>>())
    };
    p.terms().map(|(m, c)| (dense(m), c)).max_by_key(|(e, _)| key(e))
}

fn times(p: &Polynomial, exponents: &[u32], c: u64) -> Polynomial {
    let f = field();
    let mut factor = Polynomial::default();
    let powers = exponents.iter().enumerate().filter(|p| *p.1 > 0).map(|(v, &e)| (v as u32, e));
    factor.put(&f, powers.collect(), c);
    let mut out = Polynomial::default();
    out.add_product(&f, p, &factor);
    out
}

/// Remainder of a division step by step.
fn divided(mut p: Polynomial, by: &[Polynomial], weights: &[u32]) -> Polynomial {
    let f = field();
    'next: while let Some((lead, c)) = leading(&p, weights) {
        for g in by {
            let (own, d) = leading(g, weights).expect("no zero in a basis");
            if own.iter().zip(&lead).all(|(a, b)| a <= b) {
                let rest: Vec<u32> = lead.iter().zip(&own).map(|(a, b)| a - b).collect();
                p.add_scaled(&f, &times(g, &rest, f.mul(c, f.inv(d))), f.neg(f.one()));
                continue 'next;
            }
        }
        return p;
    }
    p
}

/// True if Buchberger's criterion holds and the ideal contains the input; by division only.
fn is_basis_of(basis: &GroebnerBasis, input: &[Polynomial], weights: &[u32]) -> bool {
    let f = field();
    let elements = basis.elements();
    let closed = elements.iter().enumerate().all(|(i, a)| {
        elements[..i].iter().all(|b| {
            let ((x, c), (y, d)) = (leading(a, weights).expect("a"), leading(b, weights).expect("b"));
            let lcm: Vec<u32> = x.iter().zip(&y).map(|(x, y)| *x.max(y)).collect();
            let up = |m: &[u32]| lcm.iter().zip(m).map(|(l, m)| l - m).collect::<Vec<_>>();
            let mut s = times(a, &up(&x), d);
            s.add_scaled(&f, &times(b, &up(&y), c), f.neg(f.one()));
            divided(s, &elements, weights).is_empty()
        })
    });
    closed && input.iter().all(|p| divided(p.clone(), &elements, weights).is_empty())
}

fn terms(variables: usize) -> impl Strategy<Value = Vec<(i64, Vec<u32>)>> {
    prop::collection::vec((-5i64..6, prop::collection::vec(0u32..3, variables)), 1..5)
}

proptest! {
    /// Random ideals of any dimension.
    #[test]
    fn what_is_called_a_basis_is_one(
        input in prop::collection::vec(terms(3), 1..4),
        weights in prop::collection::vec(1u32..4, 3),
    ) {
        let input: Vec<Polynomial> = input.iter().map(|p| polynomial(p)).collect();
        let basis = GroebnerBasis::new(&field(), &weights, &input, &mut ENOUGH.clone());
        prop_assert!(basis.is_complete());
        prop_assert!(is_basis_of(&basis, &input, &weights));
    }

    /// Equations of a few points: x runs through given numbers, y and z are polynomials of it.
    #[test]
    fn solutions_are_counted(mut xs in prop::collection::vec(-9i64..10, 1..6), a in -3i64..4, b in 1i64..4) {
        let f = field();
        xs.sort_unstable();
        // prod (x - x_i), with multiplicity; y = a x^2 + 1; b z = x y
        let mut product = Polynomial::constant(f.one());
        for &x in &xs {
            let mut next = Polynomial::default();
            next.add_product(&f, &product, &polynomial(&[(1, vec![1, 0, 0]), (-x, vec![0, 0, 0])]));
            product = next;
        }
        let y = polynomial(&[(a, vec![2, 0, 0]), (1, vec![0, 0, 0]), (-1, vec![0, 1, 0])]);
        let z = polynomial(&[(b, vec![0, 0, 1]), (-1, vec![1, 1, 0])]);
        let input = [product, y, z];
        let mut basis = GroebnerBasis::new(&f, &[1, 1, 1], &input, &mut ENOUGH.clone());
        prop_assert!(is_basis_of(&basis, &input, &[1, 1, 1]));
        prop_assert_eq!(basis.dimension(50), Ok(Some(xs.len())));
        let mut values = |v: u32| {
            let element = Polynomial::variable(&f, v);
            let minimal = basis
                .minimal_polynomial(&element, 50, &mut ENOUGH.clone())
                .expect("work")
                .expect("finite");
            crate::polynomial::distinct_roots(&f, &minimal)
        };
        let found = [values(0), values(1), values(2)];
        let distinct = |of: &dyn Fn(i64) -> i64| {
            xs.iter().map(|&x| of(x)).collect::<std::collections::BTreeSet<i64>>().len()
        };
        let y = |x: i64| a * x * x + 1;
        prop_assert_eq!(found, [distinct(&|x| x), distinct(&y), distinct(&|x| x * y(x))]);
    }
}

/// A case in which a published program was wrong, by hand: x y = 1 and y = -x^2/5 give x^3 = -5.
#[test]
fn a_basis_by_hand() {
    let f = field();
    let input =
        [polynomial(&[(1, vec![2, 0]), (5, vec![0, 1])]), polynomial(&[(1, vec![1, 1]), (-1, vec![0, 0])])];
    let mut basis = GroebnerBasis::new(&f, &[1, 1], &input, &mut ENOUGH.clone());
    assert!(is_basis_of(&basis, &input, &[1, 1]));
    let x = Polynomial::variable(&f, 0);
    let cube = basis.minimal_polynomial(&x, 5, &mut ENOUGH.clone()).expect("work").expect("finite");
    assert_eq!((cube, basis.dimension(5)), (vec![f.from_i64(5), 0, 0, f.one()], Ok(Some(3))));
    assert_eq!(basis.dimension(2), Ok(None));
    // no solution, and infinitely many
    let none = [input[1].clone(), x.clone()];
    assert_eq!(GroebnerBasis::new(&f, &[1, 1], &none, &mut ENOUGH.clone()).dimension(5), Ok(Some(0)));
    assert_eq!(GroebnerBasis::new(&f, &[1, 1], &input[..1], &mut ENOUGH.clone()).dimension(5), Ok(None));
}

/// Katsura's fourth system has sixteen solutions; with too little work no false statement results.
#[test]
fn work_ends() {
    let f = field();
    // sum u_|i| u_|m-i| = u_m for m = 0..3, u_0 + 2 sum u_i = 1
    let n = 5usize;
    let mut input = Vec::new();
    for m in 0..n as i64 - 1 {
        let mut p = polynomial(&[(-1, (0..n as i64).map(|v| u32::from(v == m)).collect())]);
        for i in 1 - n as i64..n as i64 {
            let j = (m - i).unsigned_abs() as usize;
            if j < n {
                let mut exponents = vec![0; n];
                exponents[i.unsigned_abs() as usize] += 1;
                exponents[j] += 1;
                p.add_scaled(&f, &polynomial(&[(1, exponents)]), f.one());
            }
        }
        input.push(p);
    }
    let mut sum = polynomial(&[(-1, vec![0; n])]);
    for i in 0..n {
        let exponents = (0..n).map(|v| u32::from(v == i)).collect();
        sum.add_scaled(&f, &polynomial(&[(if i == 0 { 1 } else { 2 }, exponents)]), f.one());
    }
    input.push(sum);
    let mut work = ENOUGH;
    let mut basis = GroebnerBasis::new(&f, &[1; 5], &input, &mut work);
    assert_eq!(basis.dimension(100), Ok(Some(16)));
    assert!(is_basis_of(&basis, &input, &[1; 5]));
    let needed = ENOUGH.left - work.left;
    assert!(!work.used_up);
    let mut short = RemainingWork::new(needed / 2);
    let part = GroebnerBasis::new(&f, &[1; 5], &input, &mut short);
    assert!(!part.is_complete() && short.used_up);
    // all elements found are in the ideal
    assert!(part.elements().iter().all(|p| divided(p.clone(), &basis.elements(), &[1; 5]).is_empty()));
}

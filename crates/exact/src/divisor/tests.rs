//! Tests of quotients, common divisors and factors.

use super::*;
use proptest::prelude::*;

const P: u64 = (1 << 60) + 33;

fn algebra(seed: u64) -> Algebra {
    Algebra { f: Field::new(P), rng: SplitMix64::new(seed), work: RemainingWork::new(1 << 32) }
}

/// Random polynomial of a few small terms.
fn drawn(f: &Field) -> impl Strategy<Value = Polynomial> + use<> {
    let f = *f;
    let term = (prop::collection::vec((0u32..5, 1u32..3), 0..3), 1i64..20);
    prop::collection::vec(term, 1..5).prop_map(move |terms| {
        let mut out = Polynomial::default();
        for (powers, c) in terms {
            let mut product = Polynomial::constant(f.from_i64(c));
            for (v, e) in powers {
                for _ in 0..e {
                    let mut next = Polynomial::default();
                    next.add_product(&f, &product, &Polynomial::variable(&f, v));
                    product = next;
                }
            }
            out.add_scaled(&f, &product, f.one());
        }
        out
    })
}

proptest! {
    /// The quotient `gcd(a c, b c) / c` divides the common divisor of `a` and `b`, also at points.
    #[test]
    fn common_divisors(
        a in drawn(&Field::new(P)),
        b in drawn(&Field::new(P)),
        c in drawn(&Field::new(P)),
        seed in any::<u64>(),
    ) {
        let mut s = algebra(seed);
        let (x, y) = (s.product(&a, &c).expect("work"), s.product(&b, &c).expect("work"));
        let d = s.divisor(&x, &y).expect("work");
        let (p, q) = (s.quotient(&x, &d).expect("work"), s.quotient(&y, &d).expect("work"));
        let (p, q) = (p.expect("it divides"), q.expect("it divides"));
        prop_assert!(s.quotient(&d, &c).expect("work").is_some(), "{d:?} without {c:?}");
        // no common divisor is left: along no variable, at a random point
        let point: Vec<u64> = (0..5).map(|_| s.number()).collect();
        for v in 0..5 {
            let [p, q] = [&p, &q].map(|p| image(&s.f, p, &point, v));
            prop_assert_eq!(polynomial::gcd(&s.f, p, q).len(), 1);
        }
        prop_assert_eq!(s.product(&p, &d).expect("work"), x);
    }

    /// Factors multiply to the whole, and factors in different variables are separated.
    #[test]
    fn factors_multiply_to_the_whole(a in drawn(&Field::new(P)), b in drawn(&Field::new(P)), seed in any::<u64>()) {
        let mut s = algebra(seed);
        let square = s.product(&b, &b).expect("work");
        let whole = s.product(&a, &square).expect("work");
        let mut product = Polynomial::constant(s.leading(&whole));
        let factors = s.factors(&whole).expect("work");
        for (p, e) in &factors {
            for _ in 0..*e {
                product = s.product(&product, p).expect("work");
            }
        }
        prop_assert_eq!(product, whole);
        if b.degree() > 0 {
            prop_assert!(factors.iter().any(|x| x.1 > 1), "{:?}", factors);
        }
    }
}

#[test]
fn what_does_not_divide_and_what_is_too_much() {
    let mut s = algebra(1);
    let f = s.f;
    let [x, y] = [0, 1].map(|v| Polynomial::variable(&f, v));
    let mut sum = x.clone();
    sum.add_scaled(&f, &y, f.one());
    assert_eq!(s.quotient(&x, &sum), Ok(None));
    assert_eq!(s.quotient(&sum, &x), Ok(None));
    let square = s.product(&sum, &sum).expect("work");
    assert_eq!(s.quotient(&square, &sum), Ok(Some(sum.clone())));
    s.work.left = 3;
    assert_eq!(s.product(&sum, &sum), Err(OverLimit));
}

/// Every pass over the terms counts as work, also without products: copies of polynomials whose
/// terms share no power, images along a variable, division by a number. Dense images are as long as
/// the power is high.
#[test]
fn what_is_copied_is_counted() {
    let mut s = algebra(3);
    let f = s.f;
    let power = |e: u32| {
        let mut out = Polynomial::default();
        out.put(&f, vec![(0, e)], f.one());
        out
    };
    let mut long = Polynomial::default();
    (0..1000).for_each(|k| long.put(&f, vec![(0, 1), (1, k + 1)], f.from_u64(k.into())));
    let two = Polynomial::constant(f.from_u64(2));
    let mut spent = |work: &mut dyn FnMut(&mut Algebra)| {
        let before = s.work.left;
        work(&mut s);
        before - s.work.left
    };
    let copies = 2 * TERM * long.len() as u64;
    assert!(spent(&mut |s| drop(s.divisor(&long, &two).expect("work"))) >= copies);
    assert!(spent(&mut |s| drop(s.quotient(&long, &two).expect("work"))) >= copies);
    // 1000 and 2000 numbers along the variable
    let images = spent(&mut |s| {
        let mut a = power(1000);
        a.put(&f, vec![(1, 1)], f.one());
        let mut b = power(2000);
        b.put(&f, vec![(1, 2)], f.one());
        s.divisor(&a, &b).expect("work");
    });
    assert!(images >= 1000 * 2000, "{images}");
    // powers beyond 32 bits are refused at once, whatever work is left
    let high = power(40_000);
    assert_eq!(s.product(&high, &high), Err(OverLimit));
    assert_eq!(s.product(&power(u32::MAX), &high), Err(OverLimit));
    assert_eq!(s.product(&power(32_768), &power(32_768)), Ok(power(65_536)));
}

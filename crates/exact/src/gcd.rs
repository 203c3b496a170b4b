//! The greatest common divisor of integers.

/// The greatest common divisor (Euclid); that of zero and `b` is `b`.
///
/// ```
/// use obsdeg_exact::gcd;
/// assert_eq!((gcd(12, 18), gcd(0, 5), gcd(7, 0), gcd(0, 0)), (6, 5, 7, 0));
/// ```
pub fn gcd(mut a: u64, mut b: u64) -> u64 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

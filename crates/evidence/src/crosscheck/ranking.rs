//! Evidence e: Kendall's tau-b, which handles ties.

/// Kendall's tau-b (Kendall 1945, doi:10.1093/biomet/33.3.239) of two rankings of the same items; `None` when
/// all items are tied in one of them.
///
/// ```
/// use obsdeg_evidence::crosscheck::kendall_tau_b;
/// assert_eq!(kendall_tau_b(&[1, 1, 2, 3], &[5, 5, 6, 9]), Some(1.0));
/// assert_eq!(kendall_tau_b(&[1, 2, 3], &[3, 2, 1]), Some(-1.0));
/// assert_eq!(kendall_tau_b(&[1, 1], &[1, 2]), None);
/// ```
pub fn kendall_tau_b(a: &[i64], b: &[i64]) -> Option<f64> {
    let (mut balance, mut in_a, mut in_b) = (0i64, 0i64, 0i64);
    for i in 0..a.len().min(b.len()) {
        for j in 0..i {
            let (s, t) = ((a[i] - a[j]).signum(), (b[i] - b[j]).signum());
            balance += s * t;
            in_a += s.abs();
            in_b += t.abs();
        }
    }
    (in_a > 0 && in_b > 0).then(|| balance as f64 / ((in_a * in_b) as f64).sqrt())
}

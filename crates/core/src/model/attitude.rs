//! Passive Euler matrices, and the 24 cardinal attitudes by direction letters.

use super::angle::Angle;
use super::ring::{Float, Ring};
use super::rotation::Axis;

/// A 3x3 matrix, row by row.
pub type Matrix3<E> = [[E; 3]; 3];

/// The three Euler angles `(alpha, beta, gamma)` of (19).
pub type Euler = [Angle; 3];

/// Text `alpha,beta,gamma` of Euler angles, in degrees.
pub fn angles_text(angles: &Euler) -> String {
    angles.each_ref().map(ToString::to_string).join(",")
}

/// Product `a b`.
pub fn product<R: Ring>(ring: &R, a: &Matrix3<R::Element>, b: &Matrix3<R::Element>) -> Matrix3<R::Element> {
    std::array::from_fn(|i| std::array::from_fn(|j| ring.dot((0..3).map(|k| (&a[i][k], &b[k][j])))))
}

/// The transpose.
pub(crate) fn transpose<E: Clone>(m: &Matrix3<E>) -> Matrix3<E> {
    std::array::from_fn(|i| std::array::from_fn(|j| m[j][i].clone()))
}

/// Unit matrix.
pub(crate) fn unit<R: Ring>(ring: &R) -> Matrix3<R::Element> {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { ring.one() } else { ring.zero() }))
}

/// The elementary passive rotation about `axis` (0, 1, 2) by the angle of cosine `c` and sine `s`:
/// `Mx = [[1,0,0],[0,c,s],[0,-s,c]]` and cyclic.
pub fn elementary<R: Ring>(ring: &R, axis: usize, (c, s): &(R::Element, R::Element)) -> Matrix3<R::Element> {
    let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut m: Matrix3<R::Element> = std::array::from_fn(|_| std::array::from_fn(|_| ring.zero()));
    m[axis][axis] = ring.one();
    m[j][j] = c.clone();
    m[k][k] = c.clone();
    m[j][k] = s.clone();
    m[k][j] = ring.neg(s);
    m
}

/// `C_c^n = Mx(alpha) My(beta) Mz(gamma)` (19), from the cosine and sine of each angle.
pub(crate) fn c_n_from_euler<R: Ring>(ring: &R, cs: &[(R::Element, R::Element); 3]) -> Matrix3<R::Element> {
    let m: [Matrix3<R::Element>; 3] = std::array::from_fn(|axis| elementary(ring, axis, &cs[axis]));
    product(ring, &product(ring, &m[0], &m[1]), &m[2])
}

/// Turn about one axis.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Turned {
    /// Axis of the turn.
    pub axis: Axis,
    /// Angle of the turn, right-handed.
    pub angle: Angle,
}

/// `C_c^n` of Euler angles and a following turn: `C exp([a x] t)` about a platform axis, `exp([b x] t) C`
/// about a geographic one. `exp([a x] t)` is the transpose of the passive elementary matrix.
pub(crate) fn c_n<R: Ring>(
    ring: &R,
    euler: &Euler,
    turned: Option<&Turned>,
    cos_sin: impl Fn(&Angle) -> (R::Element, R::Element),
) -> Matrix3<R::Element> {
    let c = c_n_from_euler(ring, &std::array::from_fn(|k| cos_sin(&euler[k])));
    let Some(t) = turned else { return c };
    let (cos, sin) = cos_sin(&t.angle);
    let turn = elementary(ring, t.axis.index, &(cos, ring.neg(&sin)));
    if t.axis.geographic { product(ring, &turn, &c) } else { product(ring, &c, &turn) }
}

/// `C_c^n` of Euler angles in floating point.
pub fn c_n_f64(euler: &Euler) -> Matrix3<f64> {
    c_n(&Float, euler, None, |a| a.turn().cos_sin_f64())
}

/// The geographic directions and their components (North, Up, East).
const DIRECTIONS: [(char, [i32; 3]); 6] = [
    ('N', [1, 0, 0]),
    ('U', [0, 1, 0]),
    ('E', [0, 0, 1]),
    ('S', [-1, 0, 0]),
    ('D', [0, -1, 0]),
    ('W', [0, 0, -1]),
];

/// Ring of integers, for the cardinal attitudes.
struct Integer;

impl Ring for Integer {
    type Element = i32;
    fn zero(&self) -> i32 {
        0
    }
    fn one(&self) -> i32 {
        1
    }
    fn add(&self, a: &i32, b: &i32) -> i32 {
        a + b
    }
    fn mul(&self, a: &i32, b: &i32) -> i32 {
        a * b
    }
    fn neg(&self, a: &i32) -> i32 {
        -a
    }
    fn is_zero(&self, a: &i32) -> bool {
        *a == 0
    }
}

/// Quarter turns as (cos, sin).
const QUARTERS: [(i32, i32); 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];

fn quarter_name(q: [usize; 3]) -> String {
    let c = c_n_from_euler(&Integer, &q.map(|i| QUARTERS[i]));
    // column j of C_c^n is the platform axis j in n
    (0..3)
        .map(|j| {
            let axis = [c[0][j], c[1][j], c[2][j]];
            DIRECTIONS.iter().find(|(_, d)| *d == axis).map_or('?', |(letter, _)| *letter)
        })
        .collect()
}

fn quarters() -> impl Iterator<Item = [usize; 3]> {
    (0..64).map(|i| [i / 16, i / 4 % 4, i % 4])
}

fn euler_of(q: [usize; 3]) -> Euler {
    q.map(|i| Angle::from_degrees([0, 90, 180, -90][i]))
}

/// The Euler angles of a cardinal attitude, given by three letters for the directions of X_p, Y_p and Z_p,
/// each one of N, U, E, S, D, W. `NUE` is (0,0,0) and `NDW` is (180,0,0). Of several sets of angles, the set
/// with the fewest rotations is taken. `None` for any other text.
///
/// ```
/// use obsdeg_core::model::cardinal;
/// let angles = cardinal("NDW").expect("an attitude").map(|a| a.to_string());
/// assert_eq!(angles, ["180", "0", "0"]);
/// assert!(cardinal("NUW").is_none()); // left-handed
/// ```
pub fn cardinal(name: &str) -> Option<Euler> {
    let turned = |q: &[usize; 3]| q.iter().filter(|&&i| i != 0).count();
    quarters().filter(|&q| quarter_name(q) == name).min_by_key(turned).map(euler_of)
}

/// The names of the 24 cardinal attitudes, `NUE` first.
pub fn cardinal_names() -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for name in quarters().map(quarter_name) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// The letters of an attitude whose angles are all multiples of 90 degrees.
pub fn cardinal_name(angles: &Euler) -> Option<String> {
    let quarter = |a: &Angle| {
        (a.generic().is_none() && a.turn().is_multiple_of_deg(90))
            .then(|| (a.turn().nanodeg() / 90_000_000_000) as usize)
    };
    Some(quarter_name([quarter(&angles[0])?, quarter(&angles[1])?, quarter(&angles[2])?]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::ring::Float;

    #[test]
    fn twenty_four_attitudes_round_trip() {
        let names = cardinal_names();
        assert_eq!((names.len(), names[0].as_str()), (24, "NUE"));
        for name in &names {
            let angles = cardinal(name).expect("known");
            assert_eq!(cardinal_name(&angles).as_ref(), Some(name));
        }
        for wrong in ["", "NU", "NNE", "nue", "NUEE", "NUW"] {
            assert!(cardinal(wrong).is_none(), "{wrong}");
        }
    }

    #[test]
    fn matches_equation_20() {
        // g^c = C_n^c (0,-1,0) against the closed form (20), at an arbitrary attitude
        let (al, be, ga) = (0.3f64, -1.1f64, 2.2f64);
        let cs = [al, be, ga].map(|x| (x.cos(), x.sin()));
        let c = c_n_from_euler(&Float, &cs);
        let g: Vec<f64> = (0..3).map(|j| -c[1][j]).collect();
        let expected = [
            ga.sin() * al.cos() - al.sin() * be.sin() * ga.cos(),
            -al.cos() * ga.cos() - al.sin() * be.sin() * ga.sin(),
            -al.sin() * be.cos(),
        ];
        for (a, b) in g.iter().zip(expected) {
            assert!((a - b).abs() < 1e-15);
        }
    }
}

//! Independent paths to the same verdicts: exact rational arithmetic on the equations in platform axes, and
//! the equations as text in n and in platform axes.

use num_bigint::BigInt;
use num_rational::BigRational;
use obsdeg_core::degree::{Degrees, DerivativeRows, climb, filtration};
use obsdeg_core::language::{Environment, evaluate, parse};
use obsdeg_core::model::{Carry, Platform, RandomValues, Scheme};
use obsdeg_exact::{Echelon, Field, SplitMix64};

use crate::program::cases;

type Q = BigRational;

fn q(n: i64, d: i64) -> Q {
    Q::new(BigInt::from(n), BigInt::from(d))
}

/// Reduced row-echelon form over the rationals.
struct Rref {
    columns: usize,
    rows: Vec<(usize, Vec<Q>)>,
}

impl Rref {
    fn insert(&mut self, row: &[Q]) -> bool {
        let zero = q(0, 1);
        let mut row = row.to_vec();
        for (pivot, basis) in &self.rows {
            let factor = row[*pivot].clone();
            if factor != zero {
                for (x, b) in row.iter_mut().zip(basis) {
                    *x -= &factor * b;
                }
            }
        }
        let Some(pivot) = (0..self.columns).find(|&c| row[c] != zero) else { return false };
        let scale = row[pivot].clone();
        for x in &mut row {
            *x /= &scale;
        }
        for (_, basis) in &mut self.rows {
            let factor = basis[pivot].clone();
            if factor != zero {
                for (b, x) in basis.iter_mut().zip(&row) {
                    *b -= &factor * x;
                }
            }
        }
        self.rows.push((pivot, row));
        true
    }

    fn contains(&self, row: &[Q]) -> bool {
        let mut row = row.to_vec();
        for (pivot, basis) in &self.rows {
            let factor = row[*pivot].clone();
            for (x, b) in row.iter_mut().zip(basis) {
                *x -= &factor * b;
            }
        }
        row.iter().all(|x| *x == q(0, 1))
    }

    fn has_unit(&self, c: usize) -> bool {
        let zero = q(0, 1);
        self.rows.iter().any(|(p, row)| *p == c && row.iter().enumerate().all(|(j, x)| j == c || *x == zero))
    }
}

/// Attitude matrix C_c^n from (24), in the reverse direction: psi^c = (C_c^n)^T psi^n.
fn c_n(t: &[Q; 3]) -> [[Q; 3]; 3] {
    let one = q(1, 1);
    let cs = |t: &Q| {
        let d = &one + t * t;
        ((&one - t * t) / &d, (t + t) / &d)
    };
    let ((ca, sa), (cb, sb), (cg, sg)) = (cs(&t[0]), cs(&t[1]), cs(&t[2]));
    // columns: the coefficients of psi_x, psi_y, psi_z in (24)
    [
        [&cb * &cg, &cb * &sg, -sb.clone()],
        [&sa * &sb * &cg - &ca * &sg, &sa * &sb * &sg + &ca * &cg, &sa * &cb],
        [&sa * &sg + &ca * &cg * &sb, &ca * &sb * &sg - &sa * &cg, &ca * &cb],
    ]
}

/// Rank profile and degrees by the equations in platform axes (2), (3), (6), directly from the text of the
/// method, with 15 unknowns (psi^c, D) and the state transported by the carry.
fn oracle(tangents: &[[Q; 3]], carry: Carry, w_n: &Q, w_u: &Q) -> (Vec<usize>, Vec<Option<usize>>) {
    let (profile, degree, _) = oracle_with_psi(tangents, carry, w_n, w_u);
    (profile, degree)
}

/// Rank profile and degrees, and the degrees of psi^c at the start of every position.
#[expect(clippy::type_complexity, reason = "a name for it would be used here alone")]
fn oracle_with_psi(
    tangents: &[[Q; 3]],
    carry: Carry,
    w_n: &Q,
    w_u: &Q,
) -> (Vec<usize>, Vec<Option<usize>>, Vec<[Option<usize>; 3]>) {
    let zero = q(0, 1);
    let reset = carry == Carry::Reset;
    let n = if reset { 3 * tangents.len() + 12 } else { 15 };
    let d0 = n - 12;
    let first = c_n(&tangents[0]);
    let mut chains: Vec<Vec<Vec<Q>>> = Vec::new();
    let mut dynamics: Vec<Vec<Vec<Q>>> = Vec::new();
    let mut maps: Vec<Vec<Vec<Q>>> = Vec::new();
    for (i, t) in tangents.iter().enumerate() {
        let c = c_n(t);
        let g: Vec<Q> = (0..3).map(|j| -c[1][j].clone()).collect();
        let w: Vec<Q> = (0..3).map(|j| &c[0][j] * w_n + &c[1][j] * w_u).collect();
        // local state: psi^c (3), D (12): F_X..Z, I_X..Z, O_X..Z, S_X..Z
        let mut f = vec![vec![zero.clone(); 15]; 15];
        // psi x w
        f[0][1] = w[2].clone();
        f[0][2] = -w[1].clone();
        f[1][2] = w[0].clone();
        f[1][0] = -w[2].clone();
        f[2][0] = w[1].clone();
        f[2][1] = -w[0].clone();
        for a in 0..3 {
            f[a][3 + a] = q(1, 1);
            f[a][6 + a] = g[a].clone();
        }
        // D_OX gz, D_OY gz negative; D_OZ gx; D_SX gy, D_SY gx negative, D_SZ gy
        f[0][9] = -g[2].clone();
        f[1][10] = -g[2].clone();
        f[2][11] = g[0].clone();
        f[0][12] = g[1].clone();
        f[1][13] = -g[0].clone();
        f[2][14] = g[1].clone();
        // Z = -[g x] psi
        let mut h = vec![vec![zero.clone(); 15]; 3];
        h[0][1] = g[2].clone();
        h[0][2] = -g[1].clone();
        h[1][0] = -g[2].clone();
        h[1][2] = g[0].clone();
        h[2][0] = g[1].clone();
        h[2][1] = -g[0].clone();
        // map S_i
        let mut s = vec![vec![zero.clone(); n]; 15];
        for a in 0..12 {
            s[3 + a][d0 + a] = q(1, 1);
        }
        for a in 0..3 {
            for b in 0..3 {
                s[a][if reset { 3 * i + b } else { b }] = match carry {
                    Carry::Inertial => (0..3).map(|k| &c[k][a] * &first[k][b]).sum(),
                    _ => q(i64::from(a == b), 1),
                };
            }
        }
        chains.push(h);
        dynamics.push(f);
        maps.push(s);
    }
    let mut basis = Rref { columns: n, rows: Vec::new() };
    let (mut profile, mut degree) = (Vec::new(), vec![None; n]);
    let mut psi = vec![[None; 3]; tangents.len()];
    let times = |row: &[Q], m: &[Vec<Q>]| -> Vec<Q> {
        (0..m[0].len())
            .map(|j| row.iter().zip(m).filter(|(x, _)| **x != zero).map(|(x, r)| x * &r[j]).sum())
            .collect()
    };
    let mut local: Vec<Rref> = tangents.iter().map(|_| Rref { columns: 15, rows: Vec::new() }).collect();
    loop {
        let mut grew = false;
        for (i, chain) in chains.iter_mut().enumerate() {
            chain.retain(|row| local[i].insert(row));
            grew |= !chain.is_empty();
            for row in chain.iter() {
                basis.insert(&times(row, &maps[i]));
            }
            *chain = chain.iter().map(|row| times(row, &dynamics[i])).collect();
        }
        if !grew {
            return (profile, degree, psi);
        }
        let order = profile.len();
        for (c, d) in degree.iter_mut().enumerate() {
            if d.is_none() && basis.has_unit(c) {
                *d = Some(order);
            }
        }
        for (map, degrees) in maps.iter().zip(&mut psi) {
            for (row, d) in map.iter().zip(degrees) {
                if d.is_none() && basis.contains(row) {
                    *d = Some(order);
                }
            }
        }
        profile.push(basis.rows.len());
    }
}

/// The reported differences under the other carries are exact and complete. psi at the start of a position,
/// such as `psi_x@2`, is the same quantity under all carries, and an unknown only under reset carry.
#[test]
fn carries_are_compared_in_the_same_quantities() {
    let mut rng = SplitMix64::new(33);
    let (w_n, w_u) = (q(7, 3), q(-5, 11));
    let mut of_positions = 0;
    for round in 0..24 {
        let n = 2 + rng.below(3) as usize;
        let steps: Vec<[i64; 3]> = (0..n).map(|_| std::array::from_fn(|_| rng.below(3) as i64 - 1)).collect();
        let tangents: Vec<[Q; 3]> = steps.iter().map(|p| p.map(|k| q(k, 1))).collect();
        let attitudes: Vec<String> =
            steps.iter().map(|p| p.map(|k| (90 * k).to_string()).join(",")).collect();
        let carry = Carry::ALL[round % 3];
        let attitudes: Vec<&str> = attitudes.iter().map(String::as_str).collect();
        let a = crate::schemes::judged(&crate::schemes::scheme(&attitudes, carry));
        let of = |carry: Carry| {
            let (_, degree, psi) = oracle_with_psi(&tangents, carry, &w_n, &w_u);
            let mut out: Vec<(String, Option<usize>)> = Vec::new();
            for (i, degrees) in psi.iter().enumerate() {
                out.extend(
                    ["x", "y", "z"].iter().zip(degrees).map(|(k, d)| (format!("psi_{k}@{}", i + 1), *d)),
                );
            }
            let names =
                ["F", "I", "O", "S"].iter().flat_map(|t| ["X", "Y", "Z"].map(|g| format!("D_{t}{g}")));
            out.extend(names.zip(degree[degree.len() - 12..].iter().copied()));
            out
        };
        assert_eq!(a.carries.len(), 2);
        for other in &a.carries {
            let reset = [carry, other.carry].contains(&Carry::Reset);
            let pairs = of(carry).into_iter().zip(of(other.carry));
            let differ = pairs
                .filter(|(here, there)| here.1 != there.1)
                .map(|(here, there)| (here.0, here.1, there.1));
            // without reset carry psi of the first position is the unknown
            let named = differ.filter_map(|(name, here, there)| match name.split_once('@') {
                Some((psi, "1")) if !reset => Some((psi.to_string(), here, there)),
                Some(_) if !reset => None,
                _ => Some((name, here, there)),
            });
            let mut expected: Vec<_> = named.collect();
            let said = other.differs.iter().map(|d| (d.name.clone(), d.here.degree, d.there.degree));
            let mut said: Vec<_> = said.filter(|d| d.1 != d.2).collect();
            of_positions += said.iter().filter(|d| d.0.contains('@') && !d.0.ends_with("@1")).count();
            expected.sort();
            said.sort();
            assert_eq!(said, expected, "{attitudes:?} {carry} {}", other.carry);
        }
    }
    assert!(of_positions > 20, "{of_positions}");
}

fn engine(tangents: &[[(i64, i64); 3]], carry: Carry, rng: &mut SplitMix64) -> Degrees {
    let angles =
        (0..tangents.len()).map(|i| std::array::from_fn(|k| format!("a{i}x{k}").parse().expect("a name")));
    let platform = Platform::new(Scheme { carry, ..Scheme::of_angles(angles) }).expect("valid");
    let mut values = RandomValues::draw(platform.scheme(), rng).expect("fits");
    for (i, t) in tangents.iter().enumerate() {
        for (k, &(n, d)) in t.iter().enumerate() {
            let image = values.roots().field.from_ratio(n, d);
            assert!(values.set_half_tangent(&format!("a{i}x{k}"), image));
        }
    }
    filtration(&platform, &values.sample(platform.scheme(), 1)).0
}

/// Random schemes (240 with `AT_LENGTH=1`) at rational points of the unit circle, special angles (0, 90, -90
/// degrees) included: rank profile and every degree agree with exact rational arithmetic.
#[test]
fn rational_arithmetic_agrees_on_random_schemes() {
    let mut rng = SplitMix64::new(2017);
    let special = [(0, 1), (1, 1), (-1, 1)];
    let mut ranks = Vec::new();
    for round in 0..cases(80, 240) {
        let carry = Carry::ALL[round % 3];
        let n = 1 + rng.below(6) as usize;
        let mut tangent = || {
            if rng.below(3) < 2 {
                special[rng.below(3) as usize]
            } else {
                (rng.below(9) as i64 - 4, 1 + rng.below(4) as i64)
            }
        };
        let tangents: Vec<[(i64, i64); 3]> = (0..n).map(|_| std::array::from_fn(|_| tangent())).collect();
        let rationals: Vec<[Q; 3]> = tangents.iter().map(|t| t.map(|(a, b)| q(a, b))).collect();
        let (profile, degree) = oracle(&rationals, carry, &q(7, 3), &q(-5, 11));
        let found = engine(&tangents, carry, &mut rng);
        assert_eq!((&found.rank_profile, &found.degree), (&profile, &degree), "{carry} {tangents:?}");
        ranks.push(found.rank());
    }
    ranks.sort_unstable();
    ranks.dedup();
    assert!(ranks.len() > 8, "the schemes should differ in rank: {ranks:?}");
}

type Matrix = Vec<Vec<u64>>;

/// Output rows of the current order, dynamics, map to the unknowns.
type Segment = (Matrix, Matrix, Matrix);

/// Linear dynamics per segment given by dense matrices: a second source of derivative rows.
struct Matrices {
    field: Field,
    columns: usize,
    segments: Vec<Segment>,
    orders: usize,
}

impl DerivativeRows for Matrices {
    type Field = Field;

    fn field(&self) -> Field {
        self.field
    }
    fn columns(&self) -> usize {
        self.columns
    }
    fn emit(&mut self, order: usize, sink: &mut dyn FnMut(&[u64]) -> bool) -> bool {
        let f = self.field;
        let times = |row: &[u64], m: &[Vec<u64>]| -> Vec<u64> {
            (0..m[0].len()).map(|j| f.dot(0, row.iter().zip(m).map(|(&x, r)| (x, r[j])))).collect()
        };
        for (rows, dynamics, map) in &mut self.segments {
            for row in rows.iter_mut() {
                sink(&times(row, map));
                *row = times(row, dynamics);
            }
        }
        order < self.orders
    }
}

/// Values of names with one state equal to one and the others zero.
struct Names<'a> {
    constants: &'a [(String, u64)],
    states: &'a [String],
    unit: usize,
    one: u64,
}

impl Environment for Names<'_> {
    fn name(&self, name: &str) -> Option<u64> {
        if let Some(i) = self.states.iter().position(|s| s == name) {
            return Some(if i == self.unit { self.one } else { 0 });
        }
        self.constants.iter().find(|(n, _)| n == name).map(|(_, v)| *v)
    }
    fn cos_sin(&self, _: &str) -> Option<(u64, u64)> {
        None
    }
    fn known(&self) -> Vec<String> {
        Vec::new()
    }
}

const EPS_C: [&str; 3] = [
    "D_FX + D_IX*gx + D_SX*gy - D_OX*gz",
    "D_FY + D_IY*gy - D_SY*gx - D_OY*gz",
    "D_FZ + D_IZ*gz + D_SZ*gy + D_OZ*gx",
];

/// The platform as text equations, in n or in platform axes.
fn from_text(in_n: bool, attitudes: &[&str], carry: Carry, seed: u64) -> (Vec<usize>, Vec<Option<usize>>) {
    let angles = attitudes.iter().map(|a| obsdeg_core::model::parse_attitude(a).expect("an attitude"));
    let scheme = Scheme { carry, ..Scheme::of_angles(angles) };
    let platform = Platform::new(scheme).expect("valid");
    let values = RandomValues::draw(platform.scheme(), &mut SplitMix64::new(seed)).expect("fits");
    let sample = values.sample(platform.scheme(), 1);
    let f = sample.roots.field;
    let d_names: Vec<String> = platform.names().iter().filter(|n| n.starts_with("D_")).cloned().collect();
    let states: Vec<String> =
        ["psi_x", "psi_y", "psi_z"].map(String::from).into_iter().chain(d_names).collect();
    let n = platform.names().len();
    let matrices: Vec<[[u64; 3]; 3]> = platform
        .scheme()
        .positions
        .iter()
        .map(|p| {
            let [(ca, sa), (cb, sb), (cg, sg)] =
                p.angles.each_ref().map(|angle| values.angle_cos_sin(&sample.roots, angle));
            let m = |xs: &[u64]| xs.iter().fold(f.one(), |p, &x| f.mul(p, x));
            [
                [m(&[cb, cg]), m(&[cb, sg]), f.neg(sb)],
                [f.sub(m(&[sa, sb, cg]), m(&[ca, sg])), f.add(m(&[sa, sb, sg]), m(&[ca, cg])), m(&[sa, cb])],
                [f.add(m(&[sa, sg]), m(&[ca, cg, sb])), f.sub(m(&[ca, sb, sg]), m(&[sa, cg])), m(&[ca, cb])],
            ]
        })
        .collect();
    let (equations, outputs): (Vec<String>, Vec<String>) = if in_n {
        let eps = |i: usize| format!("c{i}0*({}) + c{i}1*({}) + c{i}2*({})", EPS_C[0], EPS_C[1], EPS_C[2]);
        (
            vec![
                format!("-wU*psi_z + {}", eps(0)),
                format!("wN*psi_z + {}", eps(1)),
                format!("wU*psi_x - wN*psi_y + {}", eps(2)),
            ],
            vec!["psi_z".into(), "-psi_x".into()],
        )
    } else {
        (
            vec![
                format!("psi_y*wz - psi_z*wy + {}", EPS_C[0]),
                format!("psi_z*wx - psi_x*wz + {}", EPS_C[1]),
                format!("psi_x*wy - psi_y*wx + {}", EPS_C[2]),
            ],
            vec![
                "-(gy*psi_z - gz*psi_y)".into(),
                "-(gz*psi_x - gx*psi_z)".into(),
                "-(gx*psi_y - gy*psi_x)".into(),
            ],
        )
    };
    let mut segments = Vec::new();
    for (i, c) in matrices.iter().enumerate() {
        let (w_n, w_u) = (sample.point.w_n, sample.point.w_u);
        let mut constants = vec![("wN".to_string(), w_n), ("wU".to_string(), w_u)];
        for (j, axis) in ["x", "y", "z"].iter().enumerate() {
            constants.push((format!("g{axis}"), f.neg(c[1][j])));
            constants.push((format!("w{axis}"), f.add(f.mul(c[0][j], w_n), f.mul(c[1][j], w_u))));
            for (r, row) in c.iter().enumerate() {
                constants.push((format!("c{r}{j}"), row[j]));
            }
        }
        let row = |text: &str| -> Vec<u64> {
            let e = parse(text).expect("it parses");
            (0..15)
                .map(|unit| {
                    let env = Names { constants: &constants, states: &states, unit, one: f.one() };
                    evaluate(&e, &f, &env).expect("it has a value")
                })
                .collect()
        };
        let mut dynamics: Vec<Vec<u64>> = equations.iter().map(|t| row(t)).collect();
        dynamics.resize(15, vec![0; 15]);
        let mut map = vec![vec![0; n]; 15];
        for d in 0..12 {
            map[3 + d][n - 12 + d] = f.one();
        }
        let psi_first = if carry == Carry::Reset { 3 * i } else { 0 };
        for a in 0..3 {
            for b in 0..3 {
                let first = &matrices[0];
                map[a][psi_first + b] = match (in_n, carry) {
                    (true, Carry::Inertial) => first[a][b],
                    (true, _) => c[a][b],
                    (false, Carry::Inertial) => f.dot(0, (0..3).map(|k| (c[k][a], first[k][b]))),
                    (false, _) => {
                        if a == b {
                            f.one()
                        } else {
                            0
                        }
                    }
                };
            }
        }
        segments.push((outputs.iter().map(|t| row(t)).collect(), dynamics, map));
    }
    let mut rows = Matrices { field: f, columns: n, segments, orders: 5 };
    let degrees = climb(&mut rows, &mut Echelon::new(f, n), |_, _| {});
    (degrees.rank_profile, degrees.degree)
}

#[test]
fn text_equations_in_both_axes_give_the_same_verdicts() {
    let s6 = ["10,25,40", "130,-50,70", "-95,33,-160", "60,80,15", "-20,-70,110", "170,15,-75"];
    let schemes: [&[&str]; 5] =
        [&["0,0,0", "180,0,0"], &s6[..4], &s6[..5], &s6, &["90,0,0", "0,90,0", "0,0,90"]];
    for attitudes in schemes {
        for carry in Carry::ALL {
            let angles =
                attitudes.iter().map(|a| obsdeg_core::model::parse_attitude(a).expect("an attitude"));
            let platform = Platform::new(Scheme { carry, ..Scheme::of_angles(angles) }).expect("valid");
            let values = RandomValues::draw(platform.scheme(), &mut SplitMix64::new(5)).expect("fits");
            let built_in = filtration(&platform, &values.sample(platform.scheme(), 1)).0;
            for in_n in [true, false] {
                let (profile, degree) = from_text(in_n, attitudes, carry, 5);
                // orders beyond the last that can add rows repeat the rank
                assert_eq!(
                    profile[..built_in.rank_profile.len()],
                    built_in.rank_profile,
                    "{carry} {in_n} {attitudes:?}"
                );
                assert_eq!(profile.last(), built_in.rank_profile.last());
                assert_eq!(degree, built_in.degree, "{carry} {in_n} {attitudes:?}");
            }
        }
    }
}

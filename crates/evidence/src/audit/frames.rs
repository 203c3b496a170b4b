//! Equations that set up the model, (1)-(5), (7), (8), (11), (19), as printed, at random points of random
//! prime fields.

use obsdeg_core::analysis::AnalysisError;
use obsdeg_core::model::{GYROS, Matrix3, SignedAxis, elementary, product};
use obsdeg_exact::Field;

use super::equations::{ANY, G, PSI_C, RandomModelPoint, everywhere, plain};
use super::{AuditFinding, Line, finding, line};

fn transpose(a: &Matrix3<u64>) -> Matrix3<u64> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

fn apply(f: &Field, a: &Matrix3<u64>, v: &[u64; 3]) -> [u64; 3] {
    std::array::from_fn(|i| f.dot(0, (0..3).map(|j| (a[i][j], v[j]))))
}

fn negated(f: &Field, v: &[u64; 3]) -> [u64; 3] {
    v.map(|x| f.neg(x))
}

fn sum(f: &Field, a: &[u64; 3], b: &[u64; 3]) -> [u64; 3] {
    std::array::from_fn(|i| f.add(a[i], b[i]))
}

/// Cross product `a x b`.
fn cross(f: &Field, a: &[u64; 3], b: &[u64; 3]) -> [u64; 3] {
    apply(f, &skew(f, a), b)
}

/// Skew-symmetric matrix `[v x]`.
fn skew(f: &Field, v: &[u64; 3]) -> Matrix3<u64> {
    let [x, y, z] = *v;
    [[0, f.neg(z), y], [z, 0, f.neg(x)], [f.neg(y), x, 0]]
}

/// Matrix sum `a + k b`.
fn plus(f: &Field, a: &Matrix3<u64>, k: u64, b: &Matrix3<u64>) -> Matrix3<u64> {
    std::array::from_fn(|i| std::array::from_fn(|j| f.add(a[i][j], f.mul(k, b[i][j]))))
}

fn identity(f: &Field) -> Matrix3<u64> {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { f.one() } else { 0 }))
}

/// True if a polynomial of degree two in a small quantity has no terms of degree 0 and 1: its value at the
/// random size h of the point is `h^2` times its value at 1.
fn of_second_order(
    at: &RandomModelPoint,
    polynomial: impl Fn(u64) -> Matrix3<u64>,
) -> Result<bool, AnalysisError> {
    let (f, h) = (&at.field, at.value("h")?);
    let zero = [[0; 3]; 3];
    Ok(polynomial(h) == plus(f, &zero, f.mul(h, h), &polynomial(f.one())))
}

/// `C_c^p = I - [psi x]` with psi of size h; `minus` false for the other sign.
fn small_turn(f: &Field, psi: &[u64; 3], h: u64, minus: bool) -> Matrix3<u64> {
    plus(f, &identity(f), if minus { f.neg(h) } else { h }, &skew(f, psi))
}

const PSI: [&str; 3] = ["psi_x", "psi_y", "psi_z"];
const EPS: [&str; 3] = ["cx", "cy", "cz"];
const GRAVITY: [&str; 3] = ["gx", "gy", "gz"];
const RATES: [&str; 3] = ["wN", "wU", "0"];

/// True if psi has the derivative of (2), to first order in psi and eps. The platform turns with
/// `omega_c + eps` in inertial space, the computed frame with `omega_c`.
fn kinematics(at: &RandomModelPoint, minus: bool) -> Result<bool, AnalysisError> {
    let f = &at.field;
    let (psi, eps, rate) = (at.vector(PSI)?, at.vector(EPS)?, at.vector(["rx", "ry", "rz"])?);
    let derivative = sum(f, &cross(f, &psi, &rate), &eps);
    // C_c^p' - (C_c^p [omega_c x] - [omega_c + eps x] C_c^p)
    of_second_order(at, |h| {
        let c = small_turn(f, &psi, h, minus);
        let left = plus(f, &small_turn(f, &derivative, h, minus), f.neg(f.one()), &identity(f));
        let turned = plus(f, &skew(f, &rate), h, &skew(f, &eps));
        let right = plus(f, &product(f, &c, &skew(f, &rate)), f.neg(f.one()), &product(f, &turned, &c));
        plus(f, &left, f.neg(f.one()), &right)
    })
}

/// Axes I, O, S of a gyro.
type Mounting = [SignedAxis; 3];

/// The 48 ways to put three signed axes along the platform axes.
fn mountings() -> impl Iterator<Item = Mounting> {
    let permutations = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    permutations.into_iter().flat_map(|axes: [usize; 3]| {
        (0..8).map(move |signs| {
            std::array::from_fn(|k| SignedAxis { axis: axes[k], negative: signs >> k & 1 == 1 })
        })
    })
}

/// True if `I x O = S`.
fn right_handed([i, o, s]: &Mounting) -> bool {
    let (a, b) = (i.vector(), o.vector());
    let at = |k: usize| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    [at(0), at(1), at(2)] == s.vector()
}

/// Mountings of a gyro for which (3), with `a = g^c` or `a = -g^c`, gives the drift of (22), (27), (28); eps
/// is counted positive about +I or about -I.
fn fitting_mountings(
    gyro: usize,
    along_g: bool,
    about_plus: bool,
    seed: u64,
) -> Result<Vec<Mounting>, AnalysisError> {
    let mut fitting: Vec<Mounting> = mountings().collect();
    everywhere(ANY, seed, |at| {
        let f = &at.field;
        let signed = |negative: bool, x: u64| if negative { f.neg(x) } else { x };
        let [of_zero, of_i, of_o, of_s] =
            ["F", "I", "O", "S"].map(|l| at.value(&format!("D_{l}{}", GYROS[gyro])));
        let (of_zero, first_order) = (of_zero?, [of_i?, of_o?, of_s?]);
        let (g, drift) = (at.vector(GRAVITY)?, at.value(EPS[gyro])?);
        fitting.retain(|mounting| {
            let force = |a: &SignedAxis| signed(a.negative == along_g, g[a.axis]);
            let about = f.dot(of_zero, first_order.into_iter().zip(mounting.iter().map(force)));
            // eps along the platform axis of the gyro
            mounting[0].axis == gyro && signed(mounting[0].negative == about_plus, about) == drift
        });
        Ok(true)
    })?;
    Ok(fitting)
}

/// Mounting in words, or the number of mountings if several fit.
fn shown(fitting: &[Vec<Mounting>; 3]) -> String {
    let one = |(gyro, found): (char, &Vec<Mounting>)| match found[..] {
        [[i, o, s]] => {
            let hand = if right_handed(&[i, o, s]) { "right" } else { "left" };
            format!("{gyro} I={i} O={o} S={s} {hand}-handed")
        }
        _ => format!("{gyro} {}", if found.is_empty() { "none".into() } else { found.len().to_string() }),
    };
    GYROS.into_iter().zip(fitting).map(one).collect::<Vec<_>>().join(", ")
}

/// Audit of (3) and (4): mountings of the gyros that these equations require.
fn mounting_lines(seed: u64) -> Result<[Line; 2], AnalysisError> {
    let fit = |along_g: bool, about_plus: bool| -> Result<[Vec<Mounting>; 3], AnalysisError> {
        let [x, y, z] = [0, 1, 2].map(|gyro| fitting_mountings(gyro, along_g, about_plus, seed));
        Ok([x?, y?, z?])
    };
    let (plus, plus_reversed) = (fit(true, true)?, fit(true, false)?);
    let (minus, minus_reversed) = (fit(false, true)?, fit(false, false)?);
    let every = |found: &[Vec<Mounting>; 3]| found.iter().all(|f| !f.is_empty());
    let none = |found: &[Vec<Mounting>; 3]| found.iter().all(Vec::is_empty);
    let three = line(
        "(3)",
        "eps = D_F + D_I a_I + D_O a_O + D_S a_S along the axes of each gyro",
        finding([&plus, &plus_reversed, &minus, &minus_reversed].into_iter().any(every)),
        format!(
            "of the 48 ways to mount a gyro along platform axes, with a = g^c and eps positive about +I, \
             these give the drift of \
             (22), (27), (28): {} (Fig. 1, the mounting, is missing)",
            shown(&plus)
        ),
    );
    let finding = match (every(&minus), every(&minus_reversed)) {
        (true, true) => AuditFinding::Agree,
        (false, false) => AuditFinding::Disagree,
        _ => AuditFinding::Conditional,
    };
    let reason = format!(
        "when eps is positive about +I, {} with -g^c gives the drift of (22), (27), (28), {} with +g^c; when \
         eps is positive about -I: {} with \
         -g^c, {} with +g^c. Fig. 1, which would tell, is missing; obsdeg takes eps positive about +I, and +g^c",
        if none(&minus) { "no mounting".into() } else { shown(&minus) },
        if every(&plus) { "that of (3)".into() } else { shown(&plus) },
        shown(&minus_reversed),
        if none(&plus_reversed) { "none".into() } else { shown(&plus_reversed) },
    );
    Ok([three, line("(4)", "the g-sensitive terms multiply a = C_n^c (-g^n) = -g^c", finding, reason)])
}

/// Derivative of eps in c while c turns with `rate` against n: the first-order terms take
/// `g^c' = g^c x rate`.
fn drift_rate(at: &RandomModelPoint, rate: &[u64; 3]) -> Result<[u64; 3], AnalysisError> {
    let f = &at.field;
    let [x, y, z] = cross(f, &at.vector(GRAVITY)?, rate);
    let d = |name: &str| at.value(name);
    let dot = |terms: [(&str, u64); 3]| -> Result<u64, AnalysisError> {
        let [a, b, c] = terms.map(|(name, v)| d(name).map(|d| f.mul(d, v)));
        Ok(f.add(f.add(a?, b?), c?))
    };
    Ok([
        dot([("D_IX", x), ("D_SX", y), ("D_OX", f.neg(z))])?,
        dot([("D_IY", y), ("D_SY", f.neg(x)), ("D_OY", f.neg(z))])?,
        dot([("D_IZ", z), ("D_SZ", y), ("D_OZ", x)])?,
    ])
}

/// Choices, out of eight, of passive and active elementary matrices that give (20) and (24); bit k is set if
/// axis k is active.
fn euler_conventions(seed: u64) -> Result<Vec<usize>, AnalysisError> {
    let mut right = Vec::new();
    for active in 0..8usize {
        let fits = everywhere(ANY, seed, |at| {
            let f = &at.field;
            let m: [Matrix3<u64>; 3] = std::array::from_fn(|axis| {
                let passive = elementary(f, axis, &at.angles[axis]);
                if active >> axis & 1 == 1 { transpose(&passive) } else { passive }
            });
            let c = product(f, &product(f, &m[0], &m[1]), &m[2]);
            let back = transpose(&c);
            let psi = apply(f, &back, &at.vector(["px", "py", "pz"])?);
            let g = apply(f, &back, &[0, f.neg(f.one()), 0]);
            Ok(g == at.vector(G.map(|(_, formula)| formula))?
                && psi == at.vector(PSI_C.map(|(_, formula)| formula))?)
        })?;
        if fits {
            right.push(active);
        }
    }
    Ok(right)
}

/// Rates of n against c, `omega_nc = omega_c - C_n^c omega_ie`, at the `omega_c` of (7) or at a random one.
fn rate_of_c(at: &RandomModelPoint, tracks: bool) -> Result<[u64; 3], AnalysisError> {
    let f = &at.field;
    let earth = apply(f, &transpose(&at.attitude), &at.vector(RATES)?);
    let commanded = if tracks { earth } else { at.vector(["rx", "ry", "rz"])? };
    Ok(sum(f, &commanded, &negated(f, &earth)))
}

/// Audit of (1) and (2): small turns and their kinematics.
fn turn_lines(seed: u64) -> Result<[Line; 2], AnalysisError> {
    let rotation = everywhere(ANY, seed, |at| {
        let (f, psi) = (&at.field, at.vector(PSI)?);
        of_second_order(at, |h| {
            let c = small_turn(f, &psi, h, true);
            plus(f, &product(f, &c, &transpose(&c)), f.neg(f.one()), &identity(f))
        })
    })?;
    let sign = everywhere(ANY, seed, |at| kinematics(at, true))?;
    let other = everywhere(ANY, seed, |at| kinematics(at, false))?;
    let one = line(
        "(1)",
        "C_c^p = I - [psi x]",
        finding(rotation && sign),
        format!(
            "{} rotation up to terms of second order in psi; with this sign (2) {}, with + it {}",
            if rotation { "a" } else { "no" },
            if sign { "follows" } else { "does not follow" },
            if other { "does as well" } else { "does not" }
        ),
    );
    let two = line(
        "(2)",
        "psi' = [psi x] omega_c + eps",
        finding(sign),
        format!(
            "what is of first order in psi and eps when the platform turns with omega_c + eps and the \
             computed frame with omega_c, any \
             omega_c: {}",
            plain(sign)
        ),
    );
    Ok([one, two])
}

/// Output of the accelerometers, `C_n^p (-g^n) = -C_c^p C_n^c g^n`.
fn output(at: &RandomModelPoint) -> Result<[u64; 3], AnalysisError> {
    let f = &at.field;
    let to_p = product(f, &small_turn(f, &at.vector(PSI)?, f.one(), true), &transpose(&at.attitude));
    Ok(apply(f, &to_p, &[0, f.one(), 0]))
}

/// Audit of (5).
fn output_line(seed: u64) -> Result<Line, AnalysisError> {
    let printed = everywhere(ANY, seed, |at| {
        let (f, g) = (&at.field, at.vector(GRAVITY)?);
        Ok(output(at)? == negated(f, &apply(f, &transpose(&at.attitude), &g)))
    })?;
    let mended = everywhere(ANY, seed, |at| {
        let (f, g) = (&at.field, at.vector(GRAVITY)?);
        let c = small_turn(f, &at.vector(PSI)?, f.one(), true);
        let difference = sum(f, &output(at)?, &g);
        Ok(output(at)? == negated(f, &apply(f, &c, &g))
            && difference == negated(f, &cross(f, &g, &at.vector(PSI)?)))
    })?;
    Ok(line(
        "(5)",
        "Z_a = C_n^p (-g^n) = -C_n^c g^c",
        finding(printed),
        format!(
            "as printed {}; with C_c^p, of (1), in the place of the last C_n^c {}",
            plain(printed),
            if mended { "an identity, from which (6) follows" } else { "still none" }
        ),
    ))
}

/// Audit of (7): a platform that tracks n.
fn tracking_line(seed: u64) -> Result<Line, AnalysisError> {
    let from_n = everywhere(ANY, seed, |at| {
        let f = &at.field;
        Ok(apply(f, &transpose(&at.attitude), &[0, f.neg(f.one()), 0]) == at.vector(GRAVITY)?)
    })?;
    let from_c = |back: bool| {
        everywhere(ANY, seed, |at| {
            let (f, g) = (&at.field, at.vector(GRAVITY)?);
            let c = if back { transpose(&at.attitude) } else { at.attitude };
            Ok(apply(f, &c, &g) == g)
        })
    };
    let printed = from_c(true)? || from_c(false)?;
    let turns = |tracks: bool| {
        everywhere(ANY, seed, |at| {
            let rate = skew(&at.field, &rate_of_c(at, tracks)?);
            Ok(product(&at.field, &at.attitude, &rate) == [[0; 3]; 3])
        })
    };
    let stands = turns(true)? && !turns(false)?;
    Ok(line(
        "(7)",
        "omega_nc = 0, C_c^n' = 0, g^c = C_n^c(t) g^n = C_n^c(0) g^c, g^c' = 0",
        finding(stands && from_n && printed),
        format!(
            "C_c^n' = C_c^n [omega_nc x] {}; g^c = C_n^c g^n {}; the last member, {}",
            if stands {
                "is zero at omega_c = C_n^c omega_ie^n, and not at a random omega_c"
            } else {
                "is not as it says"
            },
            if from_n { "holds" } else { "does not hold" },
            if printed {
                "C g^c, is g^c"
            } else {
                "C_n^c g^c, is not g^c, nor is C_c^n g^c: read C_n^c(0) g^n"
            }
        ),
    ))
}

/// Audit of (8): the motion of psi in n.
fn motion_line(seed: u64) -> Result<Line, AnalysisError> {
    let both = everywhere(ANY, seed, |at| {
        let f = &at.field;
        let (earth, psi_n, eps_n) =
            (at.vector(RATES)?, at.vector(["px", "py", "pz"])?, at.vector(["ex", "ey", "ez"])?);
        let in_c = apply(f, &transpose(&at.attitude), &earth);
        let inner = sum(f, &cross(f, &at.vector(PSI)?, &in_c), &at.vector(EPS)?);
        let right = sum(f, &cross(f, &psi_n, &earth), &eps_n);
        Ok(apply(f, &at.attitude, &inner) == right && right == at.vector(["pxp", "pyp", "pzp"])?)
    })?;
    Ok(line(
        "(8)",
        "psi^n' = C_c^n ([psi x] C_n^c omega_ie^n + eps) = [psi^n x] omega_ie^n + eps^n",
        finding(both),
        format!("both members, and the model that is analysed: {}", plain(both)),
    ))
}

/// Audit of (11): a constant drift.
fn drift_line(seed: u64) -> Result<Line, AnalysisError> {
    let constant =
        |tracks: bool| everywhere(ANY, seed, |at| Ok(drift_rate(at, &rate_of_c(at, tracks)?)? == [0; 3]));
    let (still, turning) = (constant(true)?, constant(false)?);
    Ok(line(
        "(11)",
        "eps' = 0",
        finding(still && !turning),
        format!(
            "with g^c' = g^c x omega_nc the derivative of (3) is {} at the omega_c of (7), {} at random \
             ones; products of psi and \
             coefficients are left out, as the paper says",
            if still { "zero" } else { "not zero" },
            if turning { "zero as well" } else { "not" }
        ),
    ))
}

/// Audit of (19): the elementary matrices of an attitude.
fn attitude_line(seed: u64) -> Result<Line, AnalysisError> {
    let right = euler_conventions(seed)?;
    Ok(line(
        "(19)",
        "C_c^n = Mx(alpha) My(beta) Mz(gamma)",
        finding(right.contains(&0)),
        format!(
            "{} of the eight choices of passive and active elementary matrices {} (20) and (24) as printed{}",
            right.len(),
            if right.len() == 1 { "gives" } else { "give" },
            if right.contains(&0) { ": passive ones" } else { ", not passive ones" }
        ),
    ))
}

/// Lines of the equations that set up the model.
///
/// # Errors
/// [`AnalysisError`].
pub(super) fn lines(seed: u64) -> Result<Vec<Line>, AnalysisError> {
    let mut out = Vec::from(turn_lines(seed)?);
    out.extend(mounting_lines(seed)?);
    out.push(output_line(seed)?);
    out.push(tracking_line(seed)?);
    out.push(motion_line(seed)?);
    out.push(drift_line(seed)?);
    out.push(attitude_line(seed)?);
    Ok(out)
}

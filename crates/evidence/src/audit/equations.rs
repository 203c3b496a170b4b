//! The numbered equations from (6) on, as printed, compared with the model at random points of random prime
//! fields.

use obsdeg_core::analysis::AnalysisError;
use obsdeg_core::degree::EnsembleError;
use obsdeg_core::language::{Environment, ExpressionError, evaluate, parse};
use obsdeg_core::model::{
    LOCAL, Matrix3, Platform, RandomValues, Scheme, local_dynamics, local_output, parse_attitude,
};
use obsdeg_core::solution::CombinationError;
use obsdeg_exact::{Field, RootField, SplitMix64};

use super::{AuditFinding, Line, finding, line};

/// Number of random points at which an identity is tested, each in a random prime field of its own.
const POINTS: usize = 6;

/// Random point (angles, rates, psi and the twelve coefficients) with the values of the model there.
pub(super) struct RandomModelPoint {
    pub(super) field: Field,
    /// `C_c^n`.
    pub(super) attitude: Matrix3<u64>,
    /// Cosine and sine of alpha, beta and gamma.
    pub(super) angles: [(u64, u64); 3],
    names: Vec<(String, u64)>,
}

impl RandomModelPoint {
    /// Value of a formula at this point.
    pub(super) fn value(&self, text: &str) -> Result<u64, AnalysisError> {
        let wrap = |e: ExpressionError| CombinationError {
            text: text.into(),
            reason: e.to_string(),
            span: e.span(),
        };
        Ok(evaluate(&parse(text).map_err(wrap)?, &self.field, self).map_err(wrap)?)
    }

    /// Values of three formulas at this point.
    pub(super) fn vector(&self, texts: [&str; 3]) -> Result<[u64; 3], AnalysisError> {
        let [x, y, z] = texts.map(|t| self.value(t));
        Ok([x?, y?, z?])
    }
}

impl Environment for RandomModelPoint {
    fn name(&self, name: &str) -> Option<u64> {
        self.names.iter().find(|(n, _)| n == name).map(|(_, v)| *v)
    }
    fn cos_sin(&self, angle: &str) -> Option<(u64, u64)> {
        ["alpha", "beta", "gamma"].iter().position(|a| *a == angle).map(|i| self.angles[i])
    }
    fn known(&self) -> Vec<String> {
        self.names.iter().map(|(n, _)| n.clone()).collect()
    }
}

/// Model at a random point of a random field, under names for the formulas of the paper: `psi_x psi_y psi_z`
/// and `gx gy gz` in c, `px py pz`, `ex ey ez` (psi, eps) in n, `cx cy cz` eps in c, `Z1 Z3` with `p`, `pp`
/// for derivatives, `Zcx..` for Z in c, `pxp pyp pzp` for psi' in n. `t q h` are random numbers, `rx ry rz` a
/// random rate.
pub(super) fn at(attitude: &str, rng: &mut SplitMix64) -> Result<RandomModelPoint, AnalysisError> {
    let angles = parse_attitude(attitude)
        .unwrap_or_else(|_| std::array::from_fn(|_| obsdeg_core::model::Angle::from_degrees(0)));
    let platform = Platform::new(Scheme::of_angles([angles]))?;
    let values = RandomValues::draw(platform.scheme(), rng).map_err(EnsembleError::from)?;
    let sample = values.sample(platform.scheme(), 1);
    let RootField { field: f, .. } = sample.roots;
    let x: Vec<u64> = platform.names().iter().map(|_| f.from_u64(rng.next_u64())).collect();
    let mut names: Vec<(String, u64)> = platform.names().iter().cloned().zip(x.iter().copied()).collect();
    let mut put = |name: &str, value: u64| names.push((name.into(), value));
    let (w_n, w_u) = (sample.point.w_n, sample.point.w_u);
    put("wN", w_n);
    put("wU", w_u);
    for name in ["t", "q", "h", "rx", "ry", "rz"] {
        put(name, f.from_u64(rng.next_u64()));
    }
    let c = &sample.point.attitudes[0];
    let g: [u64; 3] = std::array::from_fn(|j| f.neg(c[1][j]));
    for (name, value) in ["gx", "gy", "gz"].into_iter().zip(g) {
        put(name, value);
    }
    let block = &platform.blocks(&sample.point)[0];
    let local: [u64; LOCAL] = std::array::from_fn(|i| {
        f.dot(0, block.rows[i].iter().copied().zip(block.columns.iter().map(|&c| x[c])))
    });
    for (name, value) in ["px", "py", "pz", "ex", "ey", "ez"].into_iter().zip(local) {
        put(name, value);
    }
    let to_c =
        |v: [u64; 3]| -> [u64; 3] { std::array::from_fn(|j| f.dot(0, (0..3).map(|i| (c[i][j], v[i])))) };
    for (name, value) in ["cx", "cy", "cz"].into_iter().zip(to_c([local[3], local[4], local[5]])) {
        put(name, value);
    }
    let dynamics = local_dynamics(&f, &w_n, &w_u);
    for (component, row) in local_output(&f, platform.observed()) {
        let mut row = row;
        for primes in ["", "p", "pp"] {
            put(&format!("Z{component}{primes}"), f.dot(0, row.iter().copied().zip(local)));
            row = std::array::from_fn(|j| f.dot(0, (0..LOCAL).map(|i| (row[i], dynamics[i][j]))));
        }
    }
    // psi' of the model
    for (name, row) in ["pxp", "pyp", "pzp"].into_iter().zip(&dynamics) {
        put(name, f.dot(0, row.iter().copied().zip(local)));
    }
    let z_n = [local[2], 0, f.neg(local[0])];
    for (name, value) in ["Zcx", "Zcy", "Zcz"].into_iter().zip(to_c(z_n)) {
        put(name, value);
    }
    Ok(RandomModelPoint {
        field: f,
        attitude: *c,
        angles: platform.scheme().positions[0]
            .angles
            .each_ref()
            .map(|a| values.angle_cos_sin(&sample.roots, a)),
        names,
    })
}

/// True if `holds` returns true at random points of random fields, at the attitude given (`alpha,beta,gamma`
/// for a random one).
pub(super) fn everywhere(
    attitude: &str,
    seed: u64,
    mut holds: impl FnMut(&RandomModelPoint) -> Result<bool, AnalysisError>,
) -> Result<bool, AnalysisError> {
    let mut rng = SplitMix64::new(seed);
    for _ in 0..POINTS {
        if !holds(&at(attitude, &mut rng)?)? {
            return Ok(false);
        }
    }
    Ok(true)
}

/// True if `left = right` for every pair.
fn identity(attitude: &str, pairs: &[(&str, &str)], seed: u64) -> Result<bool, AnalysisError> {
    everywhere(attitude, seed, |point| {
        for (left, right) in pairs {
            if point.value(left)? != point.value(right)? {
                return Ok(false);
            }
        }
        Ok(true)
    })
}

pub(super) const ANY: &str = "alpha,beta,gamma";

// (20)
pub(super) const G: [(&str, &str); 3] = [
    ("gx", "sin(gamma)*cos(alpha) - sin(alpha)*sin(beta)*cos(gamma)"),
    ("gy", "-cos(alpha)*cos(gamma) - sin(alpha)*sin(beta)*sin(gamma)"),
    ("gz", "-sin(alpha)*cos(beta)"),
];

// (21); %s stands for the sign of D_SX
const EPS_C_X: &str = "D_FX + D_IX*(sin(gamma)*cos(alpha) - sin(alpha)*sin(beta)*cos(gamma)) \
    %s D_SX*(cos(alpha)*cos(gamma) + sin(alpha)*sin(beta)*sin(gamma)) + D_OX*sin(alpha)*cos(beta)";
const EPS_C_Y: &str = "D_FY - D_IY*(cos(alpha)*cos(gamma) + sin(alpha)*sin(beta)*sin(gamma)) \
    - D_SY*(sin(gamma)*cos(alpha) - sin(alpha)*sin(beta)*cos(gamma)) + D_OY*sin(alpha)*cos(beta)";
const EPS_C_Z: &str = "D_FZ + D_OZ*(sin(gamma)*cos(alpha) - sin(alpha)*sin(beta)*cos(gamma)) \
    - D_SZ*(cos(alpha)*cos(gamma) + sin(alpha)*sin(beta)*sin(gamma)) - D_IZ*sin(alpha)*cos(beta)";

// (22)
const EPS_N_X: &str = "D_FX*cos(beta)*cos(gamma) + D_FY*cos(beta)*sin(gamma) - D_FZ*sin(beta) \
    + (D_SZ*cos(gamma) - D_OZ*sin(gamma))*cos(alpha)*sin(beta) \
    + (D_OZ*cos(gamma) + D_SZ*sin(gamma))*sin(alpha)*sin(beta)^2 \
    + (D_OX*cos(gamma) + D_OY*sin(gamma))*sin(alpha)*cos(beta)^2 \
    - (D_SX*cos(gamma)^2 + D_SY*sin(gamma)^2)*cos(alpha)*cos(beta) \
    - (D_SX - D_SY)*sin(alpha)*sin(beta)*sin(gamma)*cos(beta)*cos(gamma) \
    - (D_IX - D_IZ)*sin(alpha)*sin(beta)*cos(beta) \
    + (D_IX - D_IY)*(cos(alpha)*cos(gamma) + sin(alpha)*sin(beta)*sin(gamma))*cos(beta)*sin(gamma)";

// (23); %f stands for the second zero-order coefficient, %c for the last factor of one term
const EPS_N_Y: &str = "D_FX*(cos(gamma)*sin(alpha)*sin(beta) - cos(alpha)*sin(gamma)) \
    + %f*(cos(alpha)*cos(gamma) + sin(alpha)*sin(beta)*sin(gamma)) + D_FZ*cos(beta)*sin(alpha) \
    + (D_OX*cos(gamma) + D_OY*sin(gamma))*sin(alpha)^2*sin(beta)*cos(beta) \
    - (D_OX*sin(gamma) - D_OY*cos(gamma))*sin(alpha)*cos(beta)*%c \
    - (D_SZ*sin(gamma) + D_OZ*cos(gamma))*cos(beta)*sin(alpha)^2*sin(beta) \
    - (D_SZ*cos(gamma) - D_OZ*sin(gamma))*sin(alpha)*cos(beta)*cos(alpha) \
    - (D_IX*sin(gamma)^2 + D_IY*cos(gamma)^2)*cos(alpha)^2 \
    - (D_IX*cos(gamma)^2 + D_IY*sin(gamma)^2)*sin(alpha)^2*sin(beta)^2 \
    - D_IZ*sin(alpha)^2*cos(beta)^2 \
    + (D_SX - D_SY)*(cos(alpha)*cos(gamma) + sin(alpha)*sin(beta)*sin(gamma)) \
      *(cos(alpha)*sin(gamma) - sin(alpha)*sin(beta)*cos(gamma)) \
    + 2*(D_IX - D_IY)*sin(alpha)*sin(beta)*sin(gamma)*cos(alpha)*cos(gamma)";

// (24)
pub(super) const PSI_C: [(&str, &str); 3] = [
    (
        "psi_x",
        "px*cos(beta)*cos(gamma) + py*(sin(alpha)*sin(beta)*cos(gamma) - cos(alpha)*sin(gamma)) \
         + pz*(sin(alpha)*sin(gamma) + cos(alpha)*cos(gamma)*sin(beta))",
    ),
    (
        "psi_y",
        "px*cos(beta)*sin(gamma) + py*(sin(alpha)*sin(beta)*sin(gamma) + cos(alpha)*cos(gamma)) \
         + pz*(cos(alpha)*sin(beta)*sin(gamma) - sin(alpha)*cos(gamma))",
    ),
    ("psi_z", "-px*sin(beta) + py*sin(alpha)*cos(beta) + pz*cos(alpha)*cos(beta)"),
];

/// Reason of an audit line that tests an identity without conditions.
pub(super) fn plain(ok: bool) -> String {
    if ok {
        format!("an identity: holds at {POINTS} random points, each in a prime field of its own")
    } else {
        "not an identity".into()
    }
}

/// Line of an equation that is tested without conditions by `pairs` of equal members.
fn plain_line(place: &str, claim: &str, pairs: &[(&str, &str)], seed: u64) -> Result<Line, AnalysisError> {
    let ok = identity(ANY, pairs, seed)?;
    Ok(line(place, claim, finding(ok), plain(ok)))
}

/// Equation with its number, as printed, and both sides of each of its components.
type PrintedEquation<'a> = (&'a str, &'a str, &'a [(&'a str, &'a str)]);

/// Lines of the equations as printed: the output with its derivatives, (6), (9), (10), (12), the solution,
/// (13)-(18), and g^c, (20).
fn output_lines(seed: u64) -> Result<Vec<Line>, AnalysisError> {
    let cross = [
        ("Zcx", "-(gy*psi_z - gz*psi_y)"),
        ("Zcy", "-(gz*psi_x - gx*psi_z)"),
        ("Zcz", "-(gx*psi_y - gy*psi_x)"),
    ];
    let second = [("Z1pp", "-(wN^2 + wU^2)*pz + wU*ex - wN*ey"), ("Z3pp", "wU^2*px - wU*wN*py + wU*ez")];
    let all: [PrintedEquation<'_>; 11] = [
        ("(6)", "Z = -[g^c x] psi", &cross),
        ("(9)", "Z^n = (psi_z, 0, -psi_x)", &[("Z1", "pz"), ("Z3", "-px")]),
        (
            "(10)",
            "Z'^n = (wU psi_x - wN psi_y + eps_z, 0, wU psi_z - eps_x)",
            &[("Z1p", "wU*px - wN*py + ez"), ("Z3p", "wU*pz - ex")],
        ),
        (
            "(12)",
            "Z''^n = (-(wN^2 + wU^2) psi_z + wU eps_x - wN eps_y, 0, wU^2 psi_x - wU wN psi_y + wU eps_z)",
            &second,
        ),
        ("(13)", "psi_x = -Z3", &[("px", "-Z3")]),
        ("(14)", "psi_z = Z1", &[("pz", "Z1")]),
        ("(15)", "eps_x = wU psi_z - Z3'", &[("ex", "wU*pz - Z3p")]),
        (
            "(16)",
            "eps_y = (wU eps_x - Z1'' - (wN^2 + wU^2) psi_z) / wN",
            &[("ey", "(wU*ex - Z1pp - (wN^2 + wU^2)*pz)/wN")],
        ),
        ("(17)", "wN psi_y - eps_z = wU psi_x - Z1'", &[("wN*py - ez", "wU*px - Z1p")]),
        ("(18)", "(wN psi_y - eps_z) wU = wU^2 psi_x - Z3''", &[("(wN*py - ez)*wU", "wU^2*px - Z3pp")]),
        ("(20)", "g^c in the Euler angles of (19)", &G),
    ];
    all.into_iter().map(|(place, claim, pairs)| plain_line(place, claim, pairs, seed)).collect()
}

/// Line of (21), also with the other sign of D_SX.
fn eps_c_line(seed: u64) -> Result<Line, AnalysisError> {
    let holds = |x: &str| identity(ANY, &[("cx", x), ("cy", EPS_C_Y), ("cz", EPS_C_Z)], seed);
    let (printed_x, corrected_x) = (EPS_C_X.replace("%s", "+"), EPS_C_X.replace("%s", "-"));
    let printed = holds(&printed_x)?;
    let corrected = holds(&corrected_x)?;
    let reason = format!(
        "as printed {}; with a minus before D_SX {} (as in (22), (27), (28))",
        plain(printed),
        if corrected { "an identity" } else { "still none" }
    );
    Ok(line("(21)", "eps^c in the Euler angles", finding(printed), reason))
}

/// Line of (23), also with one or both of its slips corrected.
fn eps_n_y_line(seed: u64) -> Result<Line, AnalysisError> {
    let eps_n_y = |f: &str, c: &str| EPS_N_Y.replace("%f", f).replace("%c", c);
    let holds = |right: String| identity(ANY, &[("ey", &right)], seed);
    let [a, b, c, d] = [
        holds(eps_n_y("D_FZ", "sin(beta)"))?,
        holds(eps_n_y("D_FY", "sin(beta)"))?,
        holds(eps_n_y("D_FZ", "cos(alpha)"))?,
        holds(eps_n_y("D_FY", "cos(alpha)"))?,
    ];
    let reason = format!(
        "as printed {}; with the first D_FZ read as D_FY and the last factor of (D_OX sin g - D_OY cos g) \
         sin a cos b sin b \
         read as cos a {}; with one of the two alone {}",
        plain(a),
        if d { "an identity" } else { "still none" },
        if b || c { "an identity" } else { "none" }
    );
    Ok(line("(23)", "eps_y^n in the Euler angles", finding(a), reason))
}

/// Line of (26) at time t: `psi_y(t) = psi_y(0) + psi_y' t` (`+ q t^2` when psi_y' is not constant).
fn psi_y_line(seed: u64) -> Result<Line, AnalysisError> {
    let left = "ez - wN*(py - pyp*t)";
    let curved = "ez - wN*(py - pyp*t - q*t^2)";
    let right = "Z1p + pyp*t*wN - wU*px";
    let (constant, varying) =
        (identity(ANY, &[(left, right)], seed)?, identity(ANY, &[(curved, right)], seed)?);
    let (finding, reason) = match (constant, varying) {
        (true, false) => (
            AuditFinding::Conditional,
            format!("while psi_y' is constant {}; when it changes with time it is none", plain(true)),
        ),
        _ => (finding(constant), plain(constant)),
    };
    Ok(line("(26)", "eps_z - wN psi_y(0) = Z1' + psi_y' t wN - wU psi_x", finding, reason))
}

/// Lines of the equations of the output, the drift and the solution.
///
/// # Errors
/// [`AnalysisError`].
pub(super) fn lines(seed: u64) -> Result<Vec<Line>, AnalysisError> {
    let mut out = output_lines(seed)?;
    out.push(eps_c_line(seed)?);
    out.push(plain_line("(22)", "eps_x^n in the Euler angles", &[("ex", EPS_N_X)], seed)?);
    out.push(eps_n_y_line(seed)?);
    out.push(plain_line("(24)", "psi^c in psi^n", &PSI_C, seed)?);
    out.push(plain_line("(25)", "psi_y' = wN psi_z + eps_y", &[("pyp", "wN*pz + ey")], seed)?);
    let psi_y = psi_y_line(seed)?;
    let p1 = [("ex", "D_FX - D_SX"), ("ey", "D_FY - D_IY"), ("ez", "D_FZ - D_SZ")];
    let p2 = [("ex", "D_FX + D_SX"), ("ey", "-(D_FY + D_IY)"), ("ez", "-(D_FZ + D_SZ)")];
    for (place, claim, attitude, pairs) in
        [("(27)", "eps^n at p1 = (0,0,0)", "0,0,0", p1), ("(28)", "eps^n at p2 = (180,0,0)", "180,0,0", p2)]
    {
        let ok = identity(attitude, &pairs, seed)?;
        out.push(line(place, claim, finding(ok), plain(ok)));
    }
    out.push(psi_y);
    Ok(out)
}

//! Claims of the paper in words, judged by the engine.

use obsdeg_core::accuracy::Accuracy;
use obsdeg_core::analysis::{AnalysisError, AnalysisOptions, analyze};
use obsdeg_core::degree::{Degrees, EnsembleError, Status, judge, local_chain};
use obsdeg_core::model::{
    Angle, Carry, FieldSample, PSI_EPS, Platform, RandomValues, Scheme, Unknowns, cardinal, cardinal_names,
    parse_attitude,
};
use obsdeg_exact::{Echelon, SplitMix64};

use super::equations::{ANY, PSI_C, everywhere};
use super::{AuditError, AuditFinding, Line, finding, line};

/// Scheme of `n` positions at generic angles.
fn generic(n: usize, carry: Carry) -> Scheme {
    let angle = |i: usize, k: usize| format!("a{i}x{k}").parse().unwrap_or_else(|_| Angle::from_degrees(0));
    let angles = (0..n).map(|i| std::array::from_fn(|k| angle(i, k)));
    Scheme { carry, ..Scheme::of_angles(angles) }
}

pub(super) fn positions(attitudes: &[&str]) -> Scheme {
    Scheme::of_angles(attitudes.iter().filter_map(|a| parse_attitude(a).ok()))
}

/// Scheme with the degrees of its unknowns.
pub(super) struct SchemeDegrees {
    names: Vec<String>,
    degrees: Degrees,
}

impl SchemeDegrees {
    pub(super) fn of(scheme: Scheme, seed: u64) -> Result<Self, AnalysisError> {
        let platform = Platform::new(scheme)?;
        Ok(Self { names: platform.names().to_vec(), degrees: judge(&platform, seed)?.degrees })
    }

    pub(super) fn degree(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name).and_then(|c| self.degrees.degree[c])
    }

    fn status(&self, name: &str) -> Option<Status> {
        let c = self.names.iter().position(|n| n == name)?;
        Some(match (self.degrees.degree[c], self.degrees.excited[c]) {
            (Some(_), _) => Status::Observable,
            (None, true) => Status::Inseparable,
            (None, false) => Status::NotExcited,
        })
    }

    /// Degrees of the coefficients whose names satisfy `which`.
    fn of_coefficients(&self, which: impl Fn(&str) -> bool) -> Vec<Option<usize>> {
        let pairs = self.names.iter().zip(&self.degrees.degree);
        pairs.filter(|(n, _)| n.starts_with("D_") && which(n)).map(|(_, d)| *d).collect()
    }
}

fn input_axis(name: &str) -> bool {
    name.starts_with("D_I")
}

pub(super) fn show(d: Option<usize>) -> String {
    d.map_or_else(|| "not observable".into(), |k| format!("degree {k}"))
}

/// Number of random samples of the platform at generic angles, each in a field of its own.
const SAMPLES: usize = 4;

fn samples(platform: &Platform, seed: u64) -> Result<Vec<FieldSample>, AnalysisError> {
    let mut rng = SplitMix64::new(seed);
    let draw = |_| {
        let values = RandomValues::draw(platform.scheme(), &mut rng).map_err(EnsembleError::from)?;
        Ok(values.sample(platform.scheme(), 1))
    };
    (0..SAMPLES).map(draw).collect()
}

fn column(platform: &Platform, name: &str) -> usize {
    platform.names().iter().position(|n| n == name).unwrap_or(0)
}

/// Properties of the common drift `eps^n = (0,-d,0)`, which D_IX = D_IY = D_IZ = d causes.
struct CommonMode {
    /// True if the drift is `(0,-d,0)` at every attitude.
    vertical: bool,
    /// True if eps_y^n does not enter Z and Z'.
    unseen: bool,
    /// True if no derivative beyond the second adds a row at a position.
    ends_at_two: bool,
    /// True if eps_y^n enters no derivative at a pole.
    unseen_at_pole: bool,
}

fn common_mode(seed: u64) -> Result<CommonMode, AnalysisError> {
    let platform = Platform::new(generic(1, Carry::Platform))?;
    let mut out = CommonMode { vertical: true, unseen: true, ends_at_two: true, unseen_at_pole: true };
    for sample in samples(&platform, seed)? {
        let f = sample.point.ring;
        let drift = platform.errors().drift_rows(&f, &sample.point.attitudes[0], || [0; 3]);
        let first = platform.names().len() - platform.coefficients();
        let along = |row: &[u64]| {
            ["D_IX", "D_IY", "D_IZ"].iter().fold(0, |sum, n| f.add(sum, row[column(&platform, n) - first]))
        };
        out.vertical &= drift.each_ref().map(|row| along(row)) == [0, f.neg(f.one()), 0];
        let chain = local_chain(&f, sample.point.w_n, sample.point.w_u, platform.observed());
        out.unseen &= chain.iter().all(|r| r.order > 1 || r.row[4] == 0);
        out.ends_at_two &= chain.iter().all(|r| r.order <= 2);
        out.unseen_at_pole &=
            local_chain(&f, 0, sample.point.w_u, platform.observed()).iter().all(|r| r.row[4] == 0);
    }
    Ok(out)
}

/// True if the outputs of one position do not change along psi^n = (0,1,0), eps^n = (0,0,wN), and the
/// zero-order coefficients cause this drift at every attitude. Then psi, which turns with this direction, is
/// not observable at one position of any attitude.
fn azimuth_is_hidden(carry: Carry, seed: u64) -> Result<bool, AnalysisError> {
    let platform = Platform::new(generic(1, carry))?;
    for sample in samples(&platform, seed)? {
        let (f, c, w_n) = (sample.point.ring, &sample.point.attitudes[0], sample.point.w_n);
        let block = &platform.blocks(&sample.point)[0];
        let mut direction = vec![0; platform.names().len()];
        for axis in 0..3 {
            // C_n^c takes (0,1,0) and (0,0,wN) into platform axes; psi occupies the first three columns under
            // every name
            direction[axis] = c[1][axis];
            direction[column(&platform, ["D_FX", "D_FY", "D_FZ"][axis])] = f.mul(w_n, c[2][axis]);
        }
        let local = block
            .rows
            .each_ref()
            .map(|row| f.dot(0, row.iter().copied().zip(block.columns.iter().map(|&k| direction[k]))));
        let expected = [0, f.one(), 0, 0, 0, w_n];
        let chain = local_chain(&f, w_n, sample.point.w_u, platform.observed());
        let seen = chain.iter().any(|r| f.dot(0, r.row.iter().copied().zip(local)) != 0);
        if local[..PSI_EPS] != expected || seen {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Coefficients that component `row` of eps^n (0: x, 1: y) determines at many generic attitudes.
struct DeterminedCoefficients {
    names: Vec<String>,
    single: Vec<bool>,
    /// True if the component determines the differences of the D_I.
    differences: bool,
}

impl DeterminedCoefficients {
    /// Coefficients that every one of the samples determines, at `positions` generic attitudes.
    fn of(row: usize, positions: usize, seed: u64) -> Result<Self, AnalysisError> {
        let platform = Platform::new(generic(positions, Carry::Platform))?;
        let n = platform.coefficients();
        let names = platform.names()[platform.names().len() - n..].to_vec();
        let mut out = Self { single: vec![true; n], differences: true, names };
        for sample in samples(&platform, seed)? {
            let f = sample.point.ring;
            let mut span = Echelon::new(f, n);
            for c in &sample.point.attitudes {
                span.insert(&platform.errors().drift_rows(&f, c, || [0; 3])[row]);
            }
            for (c, single) in out.single.iter_mut().enumerate() {
                *single &= span.has_unit(c);
            }
            for pair in [["D_IX", "D_IZ"], ["D_IX", "D_IY"]] {
                let sign = |name: &String| match pair.iter().position(|p| p == name) {
                    Some(0) => f.one(),
                    Some(_) => f.neg(f.one()),
                    None => 0,
                };
                out.differences &= span.contains(&out.names.iter().map(sign).collect::<Vec<_>>());
            }
        }
        Ok(out)
    }

    fn all(&self, which: impl Fn(&str) -> bool) -> bool {
        self.names.iter().zip(&self.single).all(|(n, s)| *s || !which(n))
    }

    fn any(&self, which: impl Fn(&str) -> bool) -> bool {
        self.names.iter().zip(&self.single).any(|(n, s)| *s && which(n))
    }
}

/// Number of generic attitudes at which the terms of one component of eps^n are separated.
const ATTITUDES: usize = 16;

/// Attitudes of section 3.2.
pub(super) const PAPER: [&str; 2] = ["0,0,0", "180,0,0"];

/// Claims of section 2.2.
///
/// # Errors
/// [`AuditError`].
pub(super) fn section_2(seed: u64) -> Result<Vec<Line>, AuditError> {
    let mut out = Vec::from(separation_lines(seed)?);
    let p1p2 = SchemeDegrees::of(positions(&PAPER), seed)?;
    out.push(first_derivative_line(&p1p2, seed)?);
    out.push(two_positions_line(seed)?);
    out.push(zero_order_line(&p1p2, seed)?);
    Ok(out)
}

/// Claims on the excitation of coefficients, and on those that eps^n at several attitudes separates.
fn separation_lines(seed: u64) -> Result<[Line; 3], AnalysisError> {
    let unit = everywhere(ANY, seed, |at| Ok(at.value("gx^2 + gy^2 + gz^2")? == at.field.one()))?;
    let excited = line(
        "section 2.2",
        "a first-order coefficient is excited most where its component of g^c is 1 and the others are 0",
        finding(unit),
        format!(
            "the squares of the components of g^c {} to 1 at every attitude",
            if unit { "add up" } else { "do not add up" }
        ),
    );
    let x = DeterminedCoefficients::of(0, ATTITUDES, seed)?;
    let (others, inputs) = (x.all(|n| !input_axis(n)), x.any(input_axis));
    let of_x = line(
        "section 2.2",
        "eps_x^n at several attitudes tells D_F, D_O, D_S apart, of the D_I only differences",
        finding(others && !inputs && x.differences),
        format!(
            "the coefficients that (22) tells at {ATTITUDES} generic attitudes: D_F, D_O, D_S {}, \
             differences of the D_I {}, a D_I by itself {}",
            yes(others),
            yes(x.differences),
            yes(inputs)
        ),
    );
    let y = DeterminedCoefficients::of(1, ATTITUDES, seed)?.all(input_axis);
    let of_y = line(
        "section 2.2",
        "eps_y^n at several attitudes tells D_IX, D_IY, D_IZ",
        finding(y),
        format!("at {ATTITUDES} generic attitudes the mended (23) tells each of them: {}", yes(y)),
    );
    Ok([excited, of_x, of_y])
}

/// Claim on the coefficients that need Z''.
fn first_derivative_line(p1p2: &SchemeDegrees, seed: u64) -> Result<Line, AnalysisError> {
    let one_order = |n: usize, carry: Carry| -> Result<bool, AnalysisError> {
        let judged = SchemeDegrees::of(generic(n, carry), seed)?;
        Ok(judged.of_coefficients(|name| !input_axis(name)).iter().all(|d| *d == Some(1)))
    };
    // None: not with fewer than `ATTITUDES` positions
    let fewest = |carry: Carry| -> Result<Option<usize>, AnalysisError> {
        for n in 1..ATTITUDES {
            if one_order(n, carry)? {
                return Ok(Some(n));
            }
        }
        Ok(None)
    };
    let [platform, inertial, reset] = Carry::ALL.map(fewest);
    let from = [platform?, inertial?, reset?];
    let at_paper = p1p2.of_coefficients(|n| !input_axis(n)).into_iter().flatten().all(|d| d <= 1);
    let found = match (at_paper, from.iter().all(Option::is_some)) {
        (true, true) => AuditFinding::Agree,
        (false, true) => AuditFinding::Conditional,
        _ => AuditFinding::Disagree,
    };
    let fewest = Carry::ALL.into_iter().zip(from).map(|(carry, n)| {
        n.map_or(format!("not up to {} under {carry}", ATTITUDES - 1), |n| format!("{n} under {carry}"))
    });
    Ok(line(
        "section 2.2",
        "all coefficients but the D_I need only Z and Z'",
        found,
        format!(
            "with enough positions; at the paper's p1 p2 D_FY has {}. Fewest generic positions: {} carry",
            show(p1p2.degree("D_FY")),
            fewest.collect::<Vec<_>>().join(", ")
        ),
    ))
}

/// Claim on the number of positions that psi needs.
fn two_positions_line(seed: u64) -> Result<Line, AnalysisError> {
    let hidden = Carry::ALL.map(|carry| azimuth_is_hidden(carry, seed));
    let mut needs_two = true;
    for hidden in hidden {
        needs_two &= hidden?;
    }
    let coefficient = |formula: &str| formula.replace("px", "0").replace("py", "1").replace("pz", "0");
    let squares = PSI_C.map(|(_, formula)| format!("({})^2", coefficient(formula))).join(" + ");
    let together = everywhere(ANY, seed, |at| Ok(at.value(&squares)? == at.field.one()))?;
    let (mut suffice, mut fail) = (Vec::new(), Vec::new());
    for carry in Carry::ALL {
        let judged = SchemeDegrees::of(generic(2, carry), seed)?;
        let mut psi = judged.names.iter().zip(&judged.degrees.degree).filter(|(n, _)| n.starts_with("psi"));
        let list = if psi.all(|(_, d)| d.is_some()) { &mut suffice } else { &mut fail };
        list.push(carry.to_string());
    }
    let or_none = |list: Vec<String>| if list.is_empty() { "no".into() } else { list.join(", ") };
    Ok(line(
        "section 2.2",
        "at least two different positions are needed for psi",
        finding(needs_two && together),
        format!(
            "psi^n = (0,1,0) with eps^n = (0,0,wN), which D_F can make, leaves Z and all derivatives zero at \
             {} attitude and under {} carry; \
             the squares of the coefficients of psi_y^n in (24) {} to 1, so they are never all zero. Two \
             generic positions suffice under {} carry, not under {} carry",
            if needs_two { "every" } else { "not every" },
            if needs_two { "every" } else { "not every" },
            if together { "add up" } else { "do not add up" },
            or_none(suffice),
            or_none(fail)
        ),
    ))
}

/// Claim on the degree of eps_z - wN psi_y(0).
fn zero_order_line(p1p2: &SchemeDegrees, seed: u64) -> Result<Line, AnalysisError> {
    let local = single_position(seed)?;
    let six = [Carry::Platform, Carry::Inertial].map(|carry| SchemeDegrees::of(generic(6, carry), seed));
    let of_biases = |j: &SchemeDegrees| ["D_FX", "D_FY", "D_FZ"].map(|n| j.degree(n));
    let same = |j: &SchemeDegrees| of_biases(j).iter().all(|d| *d == local.combination);
    let [platform, inertial] = six;
    let enough = same(&platform?) && same(&inertial?);
    let list = of_biases(p1p2).map(show).join(", ");
    Ok(line(
        "section 2.2",
        "eps_z - wN psi_y(0) has the degree of the zero-order coefficients, a better one than the D_I",
        match (same(p1p2), enough) {
            (true, true) => AuditFinding::Agree,
            (false, true) => AuditFinding::Conditional,
            _ => AuditFinding::Disagree,
        },
        format!(
            "it has {}; at the paper's p1 p2 D_FX, D_FY, D_FZ: {list}; at six generic positions, platform \
             and inertial carry, {}",
            show(local.combination),
            if enough { "all three have its degree" } else { "not all have its degree" }
        ),
    ))
}

fn yes(b: bool) -> &'static str {
    if b { "yes" } else { "no" }
}

/// Degrees at one position in terms of (psi^n, eps^n).
struct LocalDegrees {
    psi: [Option<usize>; 2],
    eps: [Option<usize>; 2],
    /// Degree of wN psi_y - eps_z.
    combination: Option<usize>,
    /// Degree of psi_y'.
    rate: Option<usize>,
    /// Unknowns that are not observable.
    lost: Vec<String>,
}

fn single_position(seed: u64) -> Result<LocalDegrees, AnalysisError> {
    let scheme = Scheme {
        unknowns: Unknowns::Drift,
        combinations: vec!["wN*psi_y^n - eps_z^n".into(), "wN*psi_z^n + eps_y^n".into()],
        ..positions(&PAPER[..1])
    };
    let options = AnalysisOptions { seed, solutions: false, omitted: false, ..AnalysisOptions::default() };
    let local = analyze(&scheme, options, None)?;
    let unknown = |name: &str| local.quantities.iter().find(|q| q.name == name).and_then(|q| q.degree);
    let mut asked = local.combinations.iter().filter(|c| c.requested).map(|c| c.degree);
    let (combination, rate) = (asked.next().flatten(), asked.next().flatten());
    let lost = local.quantities.iter().filter(|q| q.status != Status::Observable).map(|q| q.name.clone());
    Ok(LocalDegrees {
        psi: ["psi_x^n", "psi_z^n"].map(unknown),
        eps: ["eps_x^n", "eps_y^n"].map(unknown),
        combination,
        rate,
        lost: lost.collect(),
    })
}

/// Claims of section 3.3 about segment 1 that need no filter.
pub(super) fn segment_1(seed: u64) -> Result<[Line; 2], AnalysisError> {
    let p1 = SchemeDegrees::of(positions(&PAPER[..1]), seed)?;
    let psi_y = p1.degree("psi_y");
    let named = ["D_FX", "D_FY", "D_FZ", "D_SX", "D_IY", "D_SZ"];
    let inseparable = named.iter().all(|n| p1.status(n) == Some(Status::Inseparable));
    let coefficients = p1.names.iter().filter(|n| n.starts_with("D_"));
    let rest: Vec<&str> = coefficients.map(String::as_str).filter(|n| !named.contains(n)).collect();
    let idle = rest.iter().all(|n| p1.status(n) == Some(Status::NotExcited));
    Ok([
        line(
            "section 3.3",
            "psi_y is observable in segment 1",
            finding(psi_y.is_some()),
            format!(
                "at p1 alone psi_y is {}{}",
                show(psi_y),
                if psi_y.is_none() { ": read \"not observable\"" } else { "" }
            ),
        ),
        line(
            "section 3.3",
            "in segment 1 D_FX, D_FY, D_FZ, D_SX, D_IY, D_SZ are excited and cannot be told apart",
            finding(inseparable),
            format!(
                "at p1 alone {} excited and not observable; {} {}",
                if inseparable { "each is" } else { "not each is" },
                rest.join(", "),
                if idle { "are not excited" } else { "are not all without excitation" }
            ),
        ),
    ])
}

/// Conclusion 1: the classes of the unknowns by degree.
fn classes_line(seed: u64) -> Result<Line, AnalysisError> {
    let local = single_position(seed)?;
    let ([best_x, best_z], [eps_x, eps_y]) = (local.psi, local.eps);
    let classes = local.psi == [Some(0); 2]
        && [eps_x, local.combination] == [Some(1); 2]
        && eps_y == Some(2)
        && local.rate == Some(1);
    Ok(line(
        "conclusion 1",
        "psi_x, psi_z best; eps_x, psi_y', wN psi_y(0) - eps_z in the middle; eps_y worst",
        finding(classes),
        format!(
            "degrees: psi_x, psi_z {}, {}; eps_x {}; wN psi_y - eps_z {}; eps_y {}; psi_y' = wN psi_z + \
             eps_y needs eps_y: {} ({} not observable \
             by themselves)",
            show(best_x),
            show(best_z),
            show(eps_x),
            show(local.combination),
            show(eps_y),
            show(local.rate),
            local.lost.join(", ")
        ),
    ))
}

/// True if the D_I have degree 2 wherever they are observable, at concrete schemes: a second path.
fn degrees_are_two(seed: u64) -> Result<bool, AnalysisError> {
    let mut tried = true;
    let cardinals = || Scheme::of_angles(cardinal_names().iter().filter_map(|n| cardinal(n)));
    for carry in Carry::ALL {
        for scheme in [generic(12, carry), Scheme { carry, ..cardinals() }] {
            let judged = SchemeDegrees::of(scheme, seed)?;
            tried &= judged.of_coefficients(input_axis).iter().all(|d| d.is_none_or(|k| k == 2));
        }
    }
    Ok(tried)
}

/// Accuracy orders of the D_I at generic positions, in words.
fn orders_of_inputs(seed: u64) -> Result<Vec<String>, AuditError> {
    let mut orders = Vec::new();
    for carry in [Carry::Platform, Carry::Inertial] {
        for n in [5, 6] {
            let platform = Platform::new(generic(n, carry)).map_err(AnalysisError::from)?;
            let verdicts = judge(&platform, seed).map_err(AnalysisError::from)?;
            let accuracy = Accuracy::new(&platform, &verdicts, seed)?;
            let of_d_i = ["D_IX", "D_IY", "D_IZ"].map(|name| accuracy.order[column(&platform, name)]);
            let one = |d: Option<usize>| d.map_or_else(|| "-".into(), |k| k.to_string());
            orders.push(format!("{} at {n} under {carry}", of_d_i.map(one).join(" ")));
        }
    }
    Ok(orders)
}

/// Both conclusions of the paper.
///
/// # Errors
/// [`AuditError`].
pub(super) fn conclusions(seed: u64) -> Result<[Line; 2], AuditError> {
    let first = classes_line(seed)?;
    let lemma = common_mode(seed)?;
    let tried = degrees_are_two(seed)?;
    let orders = orders_of_inputs(seed)?;
    let second = line(
        "conclusion 2",
        "the D_I always have a poor degree, whatever the scheme",
        finding(lemma.vertical && lemma.unseen && lemma.ends_at_two && tried),
        format!(
            "D_IX = D_IY = D_IZ = d makes eps^n = (0,-d,0) {}, and eps_y^n is {} Z and Z': so no scheme \
             brings a D_I below degree 2, {} \
             (24 cardinal and 12 generic attitudes, every carry: {}){}. Accuracy orders of D_IX D_IY D_IZ, \
             which count the dwell, at generic positions: {} carry",
            if lemma.vertical { "at every attitude" } else { "not at every attitude" },
            if lemma.unseen { "in neither of" } else { "in" },
            if lemma.ends_at_two {
                "the largest that positions have"
            } else {
                "not the largest that positions have"
            },
            if tried { "2 wherever observable" } else { "other degrees than 2" },
            if lemma.unseen_at_pole {
                "; at a pole it is in no derivative, and no scheme makes a D_I observable"
            } else {
                ""
            },
            orders.join(", ")
        ),
    );
    Ok([first, second])
}

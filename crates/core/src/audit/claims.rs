//! The claims in words, judged by the engine.

use obsdeg_exact::SplitMix64;

use super::{Line, finding};
use crate::analysis::{AnalysisError, Options, Status, analyze};
use crate::degree::ensemble::{EnsembleError, judge};
use crate::degree::staircase::Degrees;
use crate::model::attitude::{cardinal, cardinal_names};
use crate::model::platform::{Platform, RandomValues};
use crate::model::scheme::{Carry, Scheme, parse_attitude};
use crate::model::{Angle, Unknowns};

/// Positions at generic angles.
fn generic(n: usize, carry: Carry) -> Scheme {
    let angle = |i: usize, k: usize| format!("a{i}x{k}").parse().unwrap_or_else(|_| Angle::from_degrees(0));
    let angles = (0..n).map(|i| std::array::from_fn(|k| angle(i, k)));
    Scheme { carry, ..Scheme::of_angles(angles) }
}

fn positions(attitudes: &[&str]) -> Scheme {
    Scheme::of_angles(attitudes.iter().filter_map(|a| parse_attitude(a).ok()))
}

struct Judged {
    names: Vec<String>,
    degrees: Degrees,
}

impl Judged {
    fn of(scheme: Scheme, seed: u64) -> Result<Self, AnalysisError> {
        let platform = Platform::new(scheme)?;
        Ok(Self { names: platform.names().to_vec(), degrees: judge(&platform, seed)?.degrees })
    }

    fn degree(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name).and_then(|c| self.degrees.degree[c])
    }

    /// The degrees of the coefficients that satisfy `which`.
    fn of_coefficients(&self, which: impl Fn(&str) -> bool) -> Vec<Option<usize>> {
        let pairs = self.names.iter().zip(&self.degrees.degree);
        pairs.filter(|(n, _)| n.starts_with("D_") && which(n)).map(|(_, d)| *d).collect()
    }
}

fn input_axis(name: &str) -> bool {
    name.starts_with("D_I")
}

fn show(d: Option<usize>) -> String {
    d.map_or_else(|| "not observable".into(), |k| format!("degree {k}"))
}

/// Whether D_IX = D_IY = D_IZ = d gives `eps^n = (0,-d,0)` at a random attitude of a random field.
fn common_mode_is_vertical(seed: u64) -> Result<bool, AnalysisError> {
    let mut rng = SplitMix64::new(seed);
    let platform = Platform::new(generic(1, Carry::Platform))?;
    let column = |name: &str| platform.names().iter().position(|n| n == name).unwrap_or(0);
    for _ in 0..4 {
        let values = RandomValues::draw(platform.scheme(), &mut rng).map_err(EnsembleError::from)?;
        let sample = values.sample(platform.scheme(), 1);
        let f = sample.roots.field;
        let d = f.from_u64(rng.next_u64());
        let block = &platform.blocks(&sample.point)[0];
        let drift = |row: usize| {
            ["D_IX", "D_IY", "D_IZ"].iter().fold(0, |sum, name| {
                let at = block.columns.iter().position(|&c| c == column(name)).unwrap_or(0);
                f.add(sum, f.mul(d, block.rows[row][at]))
            })
        };
        if [drift(3), drift(4), drift(5)] != [0, f.neg(d), 0] {
            return Ok(false);
        }
    }
    Ok(true)
}

pub(super) fn lines(seed: u64) -> Result<Vec<Line>, AnalysisError> {
    let mut out = Vec::new();
    let mut line = |place: &str, claim: &str, holds: bool, reason: String| {
        let (place, claim) = (place.to_string(), claim.to_string());
        out.push(Line { place, claim, finding: finding(holds), reason });
    };

    // section 2.2: which coefficients need Z''
    let one_order = |n: usize, carry: Carry| -> Result<bool, AnalysisError> {
        let judged = Judged::of(generic(n, carry), seed)?;
        Ok(judged.of_coefficients(|name| !input_axis(name)).iter().all(|d| *d == Some(1)))
    };
    let fewest = |carry: Carry| -> Result<usize, AnalysisError> {
        for n in 1..16 {
            if one_order(n, carry)? {
                return Ok(n);
            }
        }
        Ok(16)
    };
    let p1p2 = Judged::of(positions(&["0,0,0", "180,0,0"]), seed)?;
    let (platform, inertial, reset) =
        (fewest(Carry::Platform)?, fewest(Carry::Inertial)?, fewest(Carry::Reset)?);
    line(
        "section 2.2",
        "all coefficients but the D_I need only Z and Z'",
        p1p2.degree("D_FY") == Some(1),
        format!(
            "not for every scheme: at the paper's p1 p2 D_FY has {}; true from {platform} generic positions on under platform \
             carry, {inertial} under inertial, {reset} under reset",
            show(p1p2.degree("D_FY"))
        ),
    );
    let psi = |carry: Carry| -> Result<Vec<Option<usize>>, AnalysisError> {
        let judged = Judged::of(generic(2, carry), seed)?;
        Ok(["psi_x", "psi_y", "psi_z"].map(|n| judged.degree(n)).to_vec())
    };
    let (under_platform, under_inertial) = (psi(Carry::Platform)?, psi(Carry::Inertial)?);
    let all = |d: &[Option<usize>]| d.iter().all(Option::is_some);
    line(
        "section 2.2",
        "two different positions make psi observable",
        all(&under_platform) && all(&under_inertial),
        format!(
            "two generic positions: psi {} under platform carry, {} under inertial carry",
            if all(&under_platform) { "observable" } else { "not observable" },
            if all(&under_inertial) { "observable" } else { "not observable" }
        ),
    );

    let p1 = Judged::of(positions(&["0,0,0"]), seed)?;
    line(
        "section 3.3",
        "psi_y is observable in segment 1",
        p1.degree("psi_y").is_some(),
        format!("at p1 alone psi_y is {}: read \"not observable\"", show(p1.degree("psi_y"))),
    );

    // conclusion 1, at a single position in (psi^n, eps^n)
    let scheme = Scheme {
        unknowns: Unknowns::Drift,
        combinations: vec!["wN*psi_y^n - eps_z^n".into(), "wN*psi_z^n + eps_y^n".into()],
        ..positions(&["0,0,0"])
    };
    let options = Options { seed, solutions: false, ..Options::default() };
    let local = analyze(&scheme, options, None)?;
    let unknown = |name: &str| local.quantities.iter().find(|q| q.name == name).and_then(|q| q.degree);
    let asked: Vec<Option<usize>> =
        local.combinations.iter().filter(|c| c.requested).map(|c| c.degree).collect();
    let best = [unknown("psi_x^n"), unknown("psi_z^n")];
    let middle = [unknown("eps_x^n"), asked[0]];
    let worst = unknown("eps_y^n");
    let rate = asked[1];
    let classes = best == [Some(0); 2] && middle == [Some(1); 2] && worst == Some(2);
    let rest = local.quantities.iter().filter(|q| q.status != Status::Observable).count();
    line(
        "conclusion 1",
        "psi_x, psi_z best; eps_x, psi_y', wN psi_y(0) - eps_z in the middle; eps_y worst",
        classes && rate == Some(1),
        format!(
            "degrees: psi_x, psi_z {}, {}; eps_x {}; wN psi_y - eps_z {}; eps_y {}; but psi_y' = wN psi_z + eps_y needs eps_y: {} \
             ({rest} unknowns, psi_y and eps_z, are not observable by themselves)",
            show(best[0]),
            show(best[1]),
            show(middle[0]),
            show(middle[1]),
            show(worst),
            show(rate)
        ),
    );

    // conclusion 2
    let lemma = common_mode_is_vertical(seed)?;
    let cardinals = || Scheme::of_angles(cardinal_names().iter().filter_map(|n| cardinal(n)));
    let mut never_below_two = lemma;
    for carry in Carry::ALL {
        for scheme in [generic(12, carry), Scheme { carry, ..cardinals() }] {
            let judged = Judged::of(scheme, seed)?;
            never_below_two &= judged.of_coefficients(input_axis).iter().all(|d| d.is_none_or(|k| k >= 2));
        }
    }
    let pole = Judged::of(Scheme { latitude: "90".parse().ok(), ..generic(12, Carry::Inertial) }, seed)?;
    let lost = pole.of_coefficients(input_axis).iter().all(Option::is_none);
    line(
        "conclusion 2",
        "the D_I are always worst, whatever the scheme",
        never_below_two && lost,
        format!(
            "D_IX = D_IY = D_IZ = d makes eps^n = (0,-d,0) at every attitude ({}), and eps_y^n first shows in Z'': no D_I below \
             degree 2 in any scheme tried under any carry{}",
            if lemma { "identity in the Euler angles" } else { "refuted" },
            if lost { "; at a pole, where Z'' adds nothing, none is observable" } else { "" }
        ),
    );
    Ok(out)
}

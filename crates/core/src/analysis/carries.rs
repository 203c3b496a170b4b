//! Verdicts under the other carries, quantity by quantity.
//!
//! Under reset carry psi of every position is an unknown of its own, `psi_x@2`: psi in the axes of c where
//! that position begins. Under another carry the same quantity is a combination of its unknowns, `C^T S_i`
//! with the attitude C and the block `S_i` of that position ([`Platform::blocks`]), and is judged as such.

use super::answer::CarryReport;
use crate::degree::ensemble::{Verdicts, degrees, judge};
use crate::degree::findings::Findings;
use crate::degree::status::{Difference, Status, Verdict};
use crate::findings::AnalysisError;
use crate::model::platform::Platform;
use crate::model::{Carry, Scheme, SchemeError, Unknowns};

/// Verdicts under one carry, with the names of their unknowns and of psi at positions.
struct NamedVerdicts {
    names: Vec<String>,
    verdicts: Vec<Verdict>,
}

impl NamedVerdicts {
    fn of(&self, name: &str) -> Option<Verdict> {
        self.names.iter().position(|own| own == name).map(|i| self.verdicts[i])
    }
}

/// Verdicts under the other carries, and reasons for omitted ones.
pub(super) fn carry_reports(
    platform: &Platform,
    judged: &Verdicts,
    findings: &Findings,
) -> Result<(Vec<CarryReport>, Vec<String>), AnalysisError> {
    let scheme = platform.scheme();
    if scheme.unknowns == Unknowns::Drift {
        return Ok((Vec::new(), Vec::new()));
    }
    let names = platform.names().to_vec();
    let verdicts = (0..names.len()).map(|c| findings.verdict(c)).collect();
    let own = NamedVerdicts { names, verdicts };
    let (mut out, mut notes) = (Vec::new(), Vec::new());
    for carry in Carry::ALL.into_iter().filter(|&c| c != scheme.carry) {
        let other = match Platform::new(Scheme { carry, ..scheme.clone() }) {
            Err(SchemeError::Path(e)) => {
                notes.push(format!("nothing is said of {carry} carry: {e}"));
                continue;
            }
            other => other?,
        };
        let (there, rank_profile) = match scheme.carry {
            Carry::Reset => {
                let found = judge(&other, findings.seed)?;
                let profile = found.degrees.rank_profile.clone();
                (with_psi_of_positions(&other, &found), profile)
            }
            _ => {
                let found = degrees(&other, findings.seed)?;
                let verdicts = (0..other.names().len()).map(|c| Verdict::of(&found, c)).collect();
                (NamedVerdicts { names: other.names().to_vec(), verdicts }, found.rank_profile)
            }
        };
        let here = match carry {
            Carry::Reset => &with_psi_of_positions(platform, judged),
            _ => &own,
        };
        let differs = here.names.iter().zip(&here.verdicts).filter_map(|(name, &here)| {
            let there = there.of(name)?;
            (here != there).then(|| Difference { name: name.clone(), here, there })
        });
        let differs = differs.collect();
        out.push(CarryReport { carry, unknowns: other.names().len(), differs, rank_profile });
    }
    if scheme.by_history() && scheme.positions.len() > 1 && !out.is_empty() {
        notes.push(
            "where rotations are judged by their course, psi of reset carry is compared with the other \
             carries at the first position alone"
                .into(),
        );
    }
    Ok((out, notes))
}

/// Verdicts of a scheme that is not under reset carry, with verdicts on psi of every position, `psi_x@2`.
/// If rotations are judged by their output history, only the first position is included: psi after a
/// rotation is no combination of the unknowns with known numbers.
fn with_psi_of_positions(platform: &Platform, judged: &Verdicts) -> NamedVerdicts {
    let (scheme, names) = (platform.scheme(), platform.names());
    let sample = judged.values[0].sample(scheme, 1);
    let (f, point) = (sample.point.ring, &sample.point);
    let (blocks, stations) = (platform.blocks(point), scheme.stations());
    let mut out = NamedVerdicts { names: Vec::new(), verdicts: Vec::new() };
    let begins = stations.iter().enumerate().filter(|(_, s)| !s.continues);
    let begins = begins.filter(|(_, s)| s.index == 0 || !scheme.by_history());
    for (i, station) in begins {
        let (attitude, block) = (&point.attitudes[i], &blocks[i]);
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let mut row = vec![0; names.len()];
            for (j, &column) in block.columns.iter().enumerate() {
                row[column] = f.dot(0, (0..3).map(|r| (attitude[r][k], block.rows[r][j])));
            }
            let degree = judged.spans.iter().position(|v| v.contains(&row));
            let moved = (0..row.len()).any(|c| row[c] != 0 && judged.degrees.excited[c]);
            out.names.push(format!("psi_{axis}@{}", station.index + 1));
            out.verdicts.push(Verdict { status: Status::of(degree, moved), degree });
        }
    }
    out.names.extend_from_slice(names);
    out.verdicts.extend((0..names.len()).map(|c| Verdict::of(&judged.degrees, c)));
    out
}

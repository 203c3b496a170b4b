//! Records that are copies of each other, with other times, digits or fewer rows: the noise of one is that of
//! the other, which counts twice then.
//!
//! Errors that the model lacks are in all records of a platform, but their effects are smooth. So differences
//! of differences of neighbouring residuals are compared.

use super::diagnose::data::AnswerData;
use super::diagnose::filter_path::MeasurementResidual;
use crate::answer::CalibrationFinding;

/// Fewest measurements of two records at the same times of the scheme.
const FEWEST: usize = 20;
/// Largest difference of these times, in intervals between rows or lengths of bins: fewer rows of a bin have
/// another middle.
const TOGETHER: f64 = 0.3;
/// Least correlation of these differences of copies, and its least size in standard deviations of that of
/// independent records (of independent numbers: that of these differences is two fifths larger).
const COPIED: f64 = 0.4;
const SIGMAS: f64 = 6.0;

/// Measurement: channel and position, time in s, normalised residual.
type Normalised = ((usize, usize), f64, f64);
/// Channel and position, and the residuals of two records there.
type CopyPair = ((usize, usize), f64, f64);

impl AnswerData<'_> {
    /// Measurements of run `r`, by channel, position and time.
    fn normalised(&self, r: usize) -> Vec<Normalised> {
        let run = &self.problem.runs[r];
        let times: Vec<f64> = run.bins.iter().flatten().map(|place| run.reading.bin(place).t).collect();
        let own = self.found.all.iter().filter(|m| m.run == r);
        let of = |m: &MeasurementResidual| {
            ((m.key.channel, m.key.position), times[m.key.bin], m.residual / m.r.sqrt())
        };
        let mut out: Vec<Normalised> = own.map(of).collect();
        out.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        out
    }

    /// Findings on pairs of records with the same noise.
    pub(super) fn copies(&self) -> Vec<CalibrationFinding> {
        let runs = self.problem.runs;
        if runs.len() < 2 {
            return Vec::new();
        }
        let each: Vec<Vec<Normalised>> = (0..runs.len()).map(|r| self.normalised(r)).collect();
        let mut out = Vec::new();
        for (a, own) in each.iter().enumerate() {
            for (b, others) in each.iter().enumerate().take(a) {
                let interval = runs[a].reading.interval.min(runs[b].reading.interval);
                let within = TOGETHER * interval.max(self.problem.conditions.step_s);
                let pairs = together(own, others, within);
                let neighbours = pairs.windows(3).filter(|w| w[0].0 == w[2].0);
                let steps: Vec<(f64, f64)> =
                    neighbours.map(|w| (bend(w, |p| p.1), bend(w, |p| p.2))).collect();
                let sum = |of: fn(&(f64, f64)) -> f64| steps.iter().map(of).sum::<f64>();
                let correlation = sum(|p| p.0 * p.1) / (sum(|p| p.0 * p.0) * sum(|p| p.1 * p.1)).sqrt();
                let least = COPIED.max(SIGMAS / (steps.len() as f64).sqrt());
                if steps.len() >= FEWEST && correlation > least {
                    let name = |r: usize| runs[r].reading.name.clone();
                    out.push(CalibrationFinding::Copy { record: name(a), other: name(b), correlation });
                }
            }
        }
        out
    }
}

/// Second difference of a residual over three neighbours.
fn bend(w: &[CopyPair], of: fn(&CopyPair) -> f64) -> f64 {
    of(&w[0]) - 2.0 * of(&w[1]) + of(&w[2])
}

/// Residuals of two records at the same times, to `within` s: channel and position, and both residuals.
fn together(own: &[Normalised], others: &[Normalised], within: f64) -> Vec<CopyPair> {
    let mut rest = others.iter().peekable();
    let of = |&(place, t, x): &Normalised| {
        while rest.next_if(|o| o.0 < place || o.0 == place && o.1 < t - within).is_some() {}
        rest.next_if(|o| o.0 == place && o.1 <= t + within).map(|o| (place, x, o.2))
    };
    own.iter().filter_map(of).collect()
}

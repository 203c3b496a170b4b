//! Records that are copies of each other, with other times, digits or fewer rows: the noise of one is that of
//! the other, which counts twice then.

use super::diagnose::Parts;
use crate::answer::Finding;

/// Fewest measurements of two records at the same times of the scheme.
const FEWEST: usize = 20;
/// Largest difference of these times, in intervals between rows.
const TOGETHER: f64 = 0.25;
/// Least correlation of the residuals of copies, and its least size in standard deviations of that of
/// independent records.
const COPIED: f64 = 0.5;
const SIGMAS: f64 = 6.0;

impl Parts<'_> {
    /// Channel, time and normalised residual of every measurement of run `r`, by channel and time.
    fn normalised(&self, r: usize) -> Vec<(usize, f64, f64)> {
        let run = &self.problem.runs[r];
        let times: Vec<f64> =
            run.bins.iter().flatten().map(|&(position, i)| run.reading.bins[position][i].t).collect();
        let own = self.found.all.iter().filter(|m| m.run == r);
        let mut out: Vec<(usize, f64, f64)> =
            own.map(|m| (m.key.channel, times[m.key.bin], m.residual / m.r.sqrt())).collect();
        out.sort_by(|a, b| (a.0, a.1).partial_cmp(&(b.0, b.1)).unwrap_or(std::cmp::Ordering::Equal));
        out
    }

    /// Findings on pairs of records with the same noise.
    pub(super) fn copies(&self) -> Vec<Finding> {
        let runs = self.problem.runs;
        let each: Vec<Vec<(usize, f64, f64)>> = match runs.len() {
            0 | 1 => return Vec::new(),
            n => (0..n).map(|r| self.normalised(r)).collect(),
        };
        let mut out = Vec::new();
        for (a, own) in each.iter().enumerate() {
            for (b, others) in each.iter().enumerate().take(a) {
                let within = TOGETHER * runs[a].reading.interval.min(runs[b].reading.interval);
                let mut pairs: Vec<(f64, f64)> = Vec::new();
                let mut rest = others.iter().peekable();
                for &(channel, t, x) in own {
                    while rest.next_if(|o| (o.0, o.1) < (channel, t - within)).is_some() {}
                    pairs.extend(rest.next_if(|o| o.0 == channel && o.1 <= t + within).map(|o| (x, o.2)));
                }
                let sum = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>();
                let correlation = sum(|p| p.0 * p.1) / (sum(|p| p.0 * p.0) * sum(|p| p.1 * p.1)).sqrt();
                let least = COPIED.max(SIGMAS / (pairs.len() as f64).sqrt());
                if pairs.len() >= FEWEST && correlation > least {
                    let name = |r: usize| runs[r].reading.name.clone();
                    out.push(Finding::Copy { record: name(a), other: name(b), correlation });
                }
            }
        }
        out
    }
}

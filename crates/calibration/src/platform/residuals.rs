//! Residuals of the measurements over time: correlations, the temperature, Allan deviations.

use obsdeg_core::model::AZIMUTH;
use obsdeg_ekf::allan::overlapping_deviation;
use obsdeg_ekf::consistency::{autocorrelation, chi_square_tail};

use super::diagnose::data::AnswerData;
use super::diagnose::filter_path::MeasurementResidual;
use super::placed::BinPlace;
use super::placed::channel_name;
use crate::answer::{Residual, ResidualSeries, Warmth};
use crate::answer::{ResidualDeviation, ResidualPoint};

/// Fewest residuals of a position whose correlation with the temperature is reported.
const FEWEST_WARM: usize = 10;
/// Most points of a series.
const POINTS: usize = 1000;
/// Largest lag of the correlation, in residuals.
const LAGS: usize = 20;

impl AnswerData<'_> {
    /// Probability that independent residuals are correlated as these are, by those of the filter: between
    /// those of a smoother an estimate leaves correlations of about minus its unknowns over their number.
    pub(super) fn whiteness(&self, run: usize, channel: usize) -> Option<f64> {
        let of = || {
            let own = self.found.all.iter().filter(|l| l.run == run && l.key.channel == channel);
            crate::white::whiteness(&own.map(|l| l.innovation).collect::<Vec<f64>>())
        };
        *self.found.white.borrow_mut().entry((run, channel)).or_insert_with(of)
    }

    /// Correlation of the residuals of a channel with the temperature, position by position: an effect fixed
    /// to the platform changes its sign in n.
    pub(super) fn warmth(&self, run: usize, channel: usize) -> Option<Warmth> {
        let reading = &self.problem.runs[run].reading;
        let places: Vec<&BinPlace> = self.problem.runs[run].bins.iter().flatten().collect();
        let mut pairs = vec![Vec::new(); reading.bins.len()];
        for l in self.found.all.iter().filter(|l| l.run == run && l.key.channel == channel) {
            let place = places[l.key.bin];
            pairs[place.position].extend(reading.bin(place).temperature.map(|t| (t, l.normalised)));
        }
        // for independent pairs artanh r is normal, with variance 1/(n - 3)
        let all = pairs.iter().filter(|p| p.len() >= FEWEST_WARM).filter_map(|p| {
            let r = correlation(p)?;
            Some((r, r.clamp(-1.0, 1.0).atanh() * (p.len() as f64 - 3.0).sqrt()))
        });
        let all: Vec<(f64, f64)> = all.collect();
        let strongest = all.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        let chi: f64 = all.iter().map(|(_, z)| z * z).sum();
        Some(Warmth { correlation: strongest.0, probability: chi_square_tail(all.len() as f64, chi) })
    }

    pub(super) fn residuals(&self) -> Vec<Residual> {
        let runs = self.problem.runs;
        let times: Vec<Vec<f64>> = runs
            .iter()
            .map(|run| {
                let of = |place: &BinPlace| run.reading.origin + run.reading.bin(place).t;
                run.bins.iter().flatten().map(of).collect()
            })
            .collect();
        let of = |l: &MeasurementResidual| Residual {
            record: l.run,
            position: l.key.position,
            channel: l.key.channel,
            t_s: times[l.run][l.key.bin],
            residual: l.residual,
            sigma: l.r.sqrt(),
            normalised: l.normalised,
        };
        self.found.all.iter().map(of).collect()
    }

    /// Residuals over time, by channel.
    pub(super) fn series(&self) -> Vec<ResidualSeries> {
        let all = self.residuals();
        let mut out = Vec::new();
        for (r, run) in self.problem.runs.iter().enumerate() {
            for (c, &component) in self.planned.components.iter().enumerate() {
                let own: Vec<&Residual> = all.iter().filter(|l| l.record == r && l.channel == c).collect();
                if own.is_empty() {
                    continue;
                }
                let n = own.len();
                let values: Vec<f64> = own.iter().map(|l| l.residual).collect();
                let normalised: Vec<f64> = own.iter().map(|l| l.normalised).collect();
                let mut steps: Vec<f64> = own.windows(2).map(|w| w[1].t_s - w[0].t_s).collect();
                steps.sort_by(f64::total_cmp);
                let step = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
                let sigma = (own.iter().map(|l| l.sigma * l.sigma).sum::<f64>() / n as f64).sqrt();
                let clusters = std::iter::successors(Some(1), |m| Some(2 * m)).take_while(|m| 3 * m <= n);
                let allan = clusters.filter_map(|m| {
                    let found = overlapping_deviation(&values, m).ok()?;
                    let (tau_s, white) = (m as f64 * step, sigma / (m as f64).sqrt());
                    Some(ResidualDeviation { tau_s, deviation: found, white })
                });
                out.push(ResidualSeries {
                    record: run.reading.name.clone(),
                    channel: channel_name(component),
                    unit: if component == AZIMUTH { "rad".into() } else { "g".into() },
                    allan: allan.collect(),
                    points: own
                        .iter()
                        .step_by(n.div_ceil(POINTS))
                        .map(|l| ResidualPoint { t_s: l.t_s, residual: l.residual, sigma: l.sigma })
                        .collect(),
                    autocorrelation: autocorrelation(&normalised, LAGS.min(n / 4)),
                    count: n,
                });
            }
        }
        out
    }
}

/// Coefficient of correlation; `None` where one of the two is constant.
fn correlation(pairs: &[(f64, f64)]) -> Option<f64> {
    let n = pairs.len() as f64;
    let (x, y) = pairs.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let sum = |of: fn(f64, f64) -> f64| pairs.iter().map(|p| of(p.0 - x, p.1 - y)).sum::<f64>();
    let r = sum(|x, y| x * y) / (sum(|x, _| x * x) * sum(|_, y| y * y)).sqrt();
    r.is_finite().then_some(r)
}

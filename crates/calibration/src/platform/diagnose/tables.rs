//! Tables of the answer: positions, channels, records, and assumed values.

use obsdeg_core::model::AZIMUTH;
use obsdeg_ekf::EkfError;
use obsdeg_evidence::simulation::{latitude_of, shown_unit, si_per_shown};

use super::super::estimate::{BOX, LinearisedRecord, WEAK};
use super::super::placed::channel_name;
use super::LOST;
use super::data::{AnswerData, ReportedFunctional};
use crate::answer::{Assumed, ChannelFit, HeldUnknown, Moved, PositionFit, RecordReport};
use crate::least_squares::StartInformation;
use crate::setup::Setup;

impl AnswerData<'_> {
    pub(super) fn positions(&self, determined: &[&ReportedFunctional]) -> Result<Vec<PositionFit>, EkfError> {
        let names = &self.scheme.positions;
        let mut out = Vec::new();
        for (r, run) in self.problem.runs.iter().enumerate() {
            for (p, position) in names.iter().enumerate() {
                let (chi, free) = self.found.sums(|l| l.run == r && l.key.position == p);
                let measurements =
                    self.found.all.iter().filter(|l| l.run == r && l.key.position == p).count();
                let stay = run.reading.stays.get(p).copied().unwrap_or_default();
                let (moves, loses) = self.without(r, p, determined)?;
                out.push(PositionFit {
                    record: run.reading.name.clone(),
                    position: position.name.clone(),
                    start_s: run.reading.origin + stay.from,
                    end_s: run.reading.origin + stay.to,
                    force_g: run.reading.lengths.get(p).copied().flatten().map(|l| l.length),
                    measurements,
                    chi_square: chi / free.max(f64::MIN_POSITIVE),
                    degrees_of_freedom: free,
                    moves,
                    loses,
                });
            }
        }
        Ok(out)
    }

    /// Change of the estimates without a position of a run, and the unknowns that are then lost.
    fn without(
        &self,
        r: usize,
        p: usize,
        determined: &[&ReportedFunctional],
    ) -> Result<(Option<Moved>, Vec<String>), EkfError> {
        let LinearisedRecord { run, keys } = &self.estimate.at.runs[r];
        let keep: Vec<bool> = keys.iter().map(|k| k.position != p).collect();
        let rest = StartInformation::of(&run.without(&keep))?;
        let solution = self.problem.step_with(&self.estimate.at, WEAK, Some((r, &rest)))?;
        let (mut moves, mut loses): (Option<Moved>, _) = (None, Vec::new());
        for a in determined {
            let (with, without) = (self.linear.sigma(&a.local), solution.sigma(&a.local));
            if without > LOST * with {
                loses.push(a.name.clone());
                continue;
            }
            let by: f64 = a.local.iter().map(|&(i, k)| k * solution.x[i]).sum();
            let expected = (without * without - with * with).max(1e-12 * with * with).sqrt();
            let sigmas = by / expected;
            if moves.as_ref().is_none_or(|m| sigmas.abs() > m.sigmas.abs()) {
                moves = Some(Moved { name: a.name.clone(), sigmas });
            }
        }
        Ok((moves, loses))
    }

    pub(super) fn channels(&self) -> Vec<ChannelFit> {
        let of = |(c, &component): (usize, &usize)| {
            let (chi, free) = self.found.sums(|l| l.key.channel == c);
            let means = self.problem.runs.iter().flat_map(|run| run.measured());
            let (scatter, scatter_free) = means
                .filter(|(key, ..)| key.channel == c)
                .fold((0.0, 0), |(s, f), (_, m, _)| (s + m.scatter, f + m.free));
            let white = (0..self.problem.runs.len()).filter_map(|r| self.whiteness(r, c));
            ChannelFit {
                channel: channel_name(component),
                unit: if component == AZIMUTH { "rad".into() } else { "g".into() },
                sigma: self.problem.sigmas[c],
                scatter: (scatter_free > 0).then(|| (scatter / scatter_free as f64).sqrt()),
                chi_square: chi / free.max(f64::MIN_POSITIVE),
                degrees_of_freedom: free,
                whiteness_probability: white.reduce(f64::min),
                temperature: (0..self.problem.runs.len())
                    .filter_map(|r| self.warmth(r, c))
                    .min_by(|a, b| a.probability.total_cmp(&b.probability)),
            }
        };
        self.planned.components.iter().enumerate().map(of).collect()
    }

    pub(super) fn records(&self) -> Vec<RecordReport> {
        let of = |(r, run): (usize, &super::super::run::RecordedRun)| RecordReport {
            clock: self.clock(r),
            name: run.reading.name.clone(),
            samples: run.reading.samples,
            interval_s: run.reading.interval,
            gaps: run.reading.gaps(self.scheme),
            empty_cells: run.reading.missing.clone(),
            psi_at_s: run.reading.origin,
            unused: run.reading.unused,
            waiting: run.reading.waiting,
            bins: run.len(),
            span_s: run.reading.span,
            positions_by: run.reading.by.into(),
            change_open_s: run.changes.iter().map(|c| c.open).reduce(f64::max),
            gimbals_deg: run.reading.gimbals,
            ignored: run.reading.ignored.clone(),
            force_g: run.reading.force,
        };
        self.problem.runs.iter().enumerate().map(of).collect()
    }

    /// Keys of the conditions that are not stated.
    fn chosen(&self) -> Vec<String> {
        let stated = self.conditions.states();
        let all = [
            ("latitude_deg", self.scheme.latitude.is_none()),
            ("accelerometer_noise_g", !stated.accelerometer_noise && !self.options.estimate_noise),
            ("drift_noise", !stated.drift_noise && self.conditions.drift_noise.amount() > 0.0),
        ];
        all.into_iter().filter(|(_, by_default)| *by_default).map(|(key, _)| key.into()).collect()
    }

    /// Unknowns of a run with a stated prior.
    fn priors(&self) -> Vec<HeldUnknown> {
        let (names, units) = (self.planned.platform.names(), self.planned.platform.units());
        let u = &self.problem.unknowns;
        let stated = (0..names.len()).filter(|&s| u.stated.contains(&u.index[0][s]));
        stated
            .map(|s| HeldUnknown {
                name: names[s].clone(),
                sigma: u.prior[u.index[0][s]] / si_per_shown(units[s]),
                unit: shown_unit(units[s]).into(),
            })
            .collect()
    }

    pub(super) fn assumed(&self, unknowns: &[ReportedFunctional]) -> Assumed {
        let c = self.conditions;
        let open = unknowns.iter().filter(|a| !a.determined);
        let constrained = open.map(|a| HeldUnknown {
            name: a.name.clone(),
            sigma: BOX * self.problem.unknowns.prior[a.terms[0].0] / si_per_shown(a.unit),
            unit: shown_unit(a.unit).into(),
        });
        Assumed {
            latitude_deg: latitude_of(self.scheme).map_or(0.0, |l| l.degrees()),
            latitude_by_default: self.scheme.latitude.is_none(),
            gravity_m_s2: self.options.gravity_m_s2,
            bin_s: c.step_s,
            accelerometer_noise_g: c.accelerometer_noise_g,
            noise_estimated: self.options.estimate_noise,
            drift_noise_deg_sqrt_h: c.drift_noise.density_deg_sqrt_h(c.drift_noise_step_s),
            gate: self.options.gate,
            known: self.known.clone(),
            priors: self.priors(),
            known_differs: self.options.prior.as_ref().map_or_else(Vec::new, |before| {
                let own = Setup::of(self.scheme);
                let differs = if before.of.terms == own.terms { None } else { Some(before.of.terms.clone()) };
                differs.map(|terms| format!("terms {terms} instead of {}", own.terms)).into_iter().collect()
            }),
            constrained: constrained.collect(),
            by_default: self.chosen(),
            seed: self.options.seed,
        }
    }
}

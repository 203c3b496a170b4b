//! Bins of samples: over a few seconds a channel is a straight line, and its value at the middle has the
//! weight of all samples. Samples far from the line (spikes) are left out and listed. Only the samples of one
//! bin are in memory.

use std::collections::VecDeque;

use obsdeg_core::span::Span;

/// Mean of one channel at the middle of a bin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    /// Value at the middle of the bin.
    pub value: f64,
    /// Variance: relative to that of a sample, or absolute where the record gives a sigma.
    pub variance: f64,
    /// True if the record gives the sigma.
    pub given: bool,
    /// Number of samples that count.
    pub samples: usize,
    /// Sum of squared distances of these samples from the line.
    pub scatter: f64,
    /// Degrees of freedom of the sum.
    pub free: usize,
    /// Change of the value per second derivative of the channel, in s^2: a curve lies beside its line.
    pub bend: f64,
}

/// Bin: a few seconds of a record.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bin {
    /// Middle of the bin: the mean of its times, in s.
    pub t: f64,
    /// First and last line of the record.
    pub lines: Span<u64>,
    /// Means by channel; `None` where nothing was measured.
    pub channels: Vec<Option<Mean>>,
    /// Mean temperature; `None` where the record has none.
    pub temperature: Option<f64>,
}

/// Sample far from the line of its bin.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Spike {
    /// Line of the record.
    pub line: u64,
    /// Time, in s.
    pub t: f64,
    /// Index of the channel.
    pub channel: usize,
    /// Distance from the line.
    pub off: f64,
    /// Distance in standard deviations of the other samples.
    pub sigmas: f64,
}

/// Largest number of channels: three components of Z and an azimuth.
pub(crate) const CHANNELS: usize = 4;

/// Sample: its line, time and channels, and their standard deviations where the record gives them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BinSample {
    /// Line of the record.
    pub line: u64,
    /// Time, in s.
    pub t: f64,
    /// Values by channel; entries behind the last channel are not used.
    pub z: [Option<f64>; CHANNELS],
    /// Standard deviations by channel; `None` where the record gives none.
    pub sigma: Option<[f64; CHANNELS]>,
    /// Temperature; `None` where the record has none.
    pub temperature: Option<f64>,
}

/// Fewest samples of a line in which spikes are sought.
pub(crate) const FEWEST: usize = 8;
/// Distance of a spike from a line of many samples, in standard deviations. A right record of a million
/// samples has a false spike with a probability of one in five hundred.
const SPIKE: f64 = 6.0;
/// Growth of its square with the inverse number of samples: the line of few samples is uncertain at its ends.
const OF_LINE: f64 = 6.0;
/// Number of bins whose spreads give the usual one of a sample: the spread of ten samples may be a third of
/// that by chance. Before `SOME` of them the stated one counts.
const RECENT: usize = 31;
const SOME: usize = 5;

/// Collects samples into bins.
#[derive(Debug, Clone)]
pub(crate) struct Binner {
    length_s: f64,
    /// Standard deviations by channel, for bins whose samples are all equal.
    sigmas: Vec<f64>,
    /// Spreads of the samples about the lines of the last bins, by channel.
    spreads: Vec<VecDeque<f64>>,
    now: Vec<BinSample>,
}

impl Binner {
    /// Bins of at most `length_s`, for channels with about these standard deviations of a sample.
    pub(crate) fn new(length_s: f64, sigmas: Vec<f64>) -> Self {
        Self { length_s, spreads: vec![VecDeque::new(); sigmas.len()], sigmas, now: Vec::new() }
    }

    /// Adds a sample; returns the bins that it ends.
    pub(crate) fn push(&mut self, sample: BinSample, spikes: &mut Vec<Spike>) -> Vec<Bin> {
        // a small margin, so that samples every 10 s are bins of 10 s
        let ends = self.now.first().is_some_and(|first| {
            sample.sigma.is_some() || sample.t - first.t >= self.length_s * (1.0 - 1e-9)
        });
        let bins = if ends { self.end(spikes) } else { Vec::new() };
        self.now.push(sample);
        bins
    }

    /// Bins of the remaining samples: one, or several where one channel has a single sample among others. No
    /// slope brings that to their middle, so each run of samples with the same channels is a bin then.
    pub(crate) fn end(&mut self, spikes: &mut Vec<Spike>) -> Vec<Bin> {
        let mut now = std::mem::take(&mut self.now);
        let alone = |c: usize| now.len() > 1 && now.iter().filter(|s| s.z[c].is_some()).count() == 1;
        let same =
            |a: &BinSample, b: &BinSample| a.z.iter().zip(&b.z).all(|(a, b)| a.is_some() == b.is_some());
        let bins = match (0..self.sigmas.len()).any(alone) {
            true => now.chunk_by(same).filter_map(|part| self.bin(part, spikes)).collect(),
            false => self.bin(&now, spikes).into_iter().collect(),
        };
        now.clear();
        self.now = now;
        bins
    }

    /// Scale of the distances of spikes in a bin of the spread `own`: that, or the usual one if it is larger.
    fn scale(&mut self, c: usize, own: f64) -> f64 {
        let recent = &mut self.spreads[c];
        let usual =
            if recent.len() < SOME { self.sigmas[c] } else { median(recent.iter().copied().collect()) };
        recent.push_back(own);
        if recent.len() > RECENT {
            recent.pop_front();
        }
        let scale = own.max(usual);
        if scale > 0.0 { scale } else { self.sigmas[c] }
    }

    fn bin(&mut self, now: &[BinSample], spikes: &mut Vec<Spike>) -> Option<Bin> {
        let (first, last) = (now.first()?, now.last()?);
        let t = first.t + now.iter().map(|s| s.t - first.t).sum::<f64>() / now.len() as f64;
        let channels = (0..self.sigmas.len()).map(|c| self.channel(now, c, t, spikes)).collect();
        let warm: Vec<f64> = now.iter().filter_map(|s| s.temperature).collect();
        let temperature = (!warm.is_empty()).then(|| warm.iter().sum::<f64>() / warm.len() as f64);
        Some(Bin { t, lines: Span { from: first.line, to: last.line }, channels, temperature })
    }

    fn channel(&mut self, now: &[BinSample], c: usize, t: f64, spikes: &mut Vec<Spike>) -> Option<Mean> {
        let mut points: Vec<(f64, f64, u64)> =
            now.iter().filter_map(|s| Some((s.t - t, s.z[c]?, s.line))).collect();
        if let ([(_, value, _)], Some(sigma)) = (&points[..], now.first().and_then(|s| s.sigma)) {
            let variance = sigma[c] * sigma[c];
            return Some(Mean {
                value: *value,
                variance,
                given: true,
                samples: 1,
                scatter: 0.0,
                free: 0,
                bend: 0.0,
            });
        }
        if points.len() >= FEWEST {
            let (slope, level, spread) = resistant(&points);
            let scale = self.scale(c, spread);
            let limit = SPIKE * (1.0 + OF_LINE / points.len() as f64).sqrt();
            points.retain(|&(dt, x, line)| {
                let off = x - level - slope * dt;
                let sigmas = off / scale;
                if sigmas.abs() > limit {
                    spikes.push(Spike { line, t: t + dt, channel: c, off, sigmas });
                }
                sigmas.abs() <= limit
            });
        }
        let samples = points.len();
        if samples == 0 {
            return None;
        }
        let n = samples as f64;
        let mean = |of: &dyn Fn(&(f64, f64, u64)) -> f64| points.iter().map(of).sum::<f64>() / n;
        let (dt, x) = (mean(&|p| p.0), mean(&|p| p.1));
        let along: f64 = points.iter().map(|p| (p.0 - dt).powi(2)).sum();
        let slope_of = |of: &dyn Fn(&(f64, f64, u64)) -> f64| match samples {
            1 => 0.0,
            _ => points.iter().map(|p| (p.0 - dt) * of(p)).sum::<f64>() / along,
        };
        let slope = slope_of(&|p| p.1 - x);
        let curve = |p: &(f64, f64, u64)| p.0 * p.0 / 2.0;
        let bend = mean(&curve) - slope_of(&curve) * dt;
        let scatter = points.iter().map(|p| (p.1 - x - slope * (p.0 - dt)).powi(2)).sum();
        let variance = 1.0 / n + if samples > 1 { dt * dt / along } else { 0.0 };
        let value = x - slope * dt;
        Some(Mean { value, variance, given: false, samples, scatter, free: samples.saturating_sub(2), bend })
    }
}

/// Median of some numbers.
fn median(mut of: Vec<f64>) -> f64 {
    let middle = of.len() / 2;
    *of.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Robust line: slope (median of the slopes from each sample of the first half to its partner in the second;
/// Theil 1950), level at 0, and the standard deviation about it by the median distance.
fn resistant(points: &[(f64, f64, u64)]) -> (f64, f64, f64) {
    let half = points.len() / 2;
    let slope = median(
        points
            .iter()
            .zip(&points[half..])
            .map(|(left, right)| (right.1 - left.1) / (right.0 - left.0))
            .collect(),
    );
    let level = median(points.iter().map(|p| p.1 - slope * p.0).collect());
    let spread = median(points.iter().map(|p| (p.1 - level - slope * p.0).abs()).collect());
    (slope, level, 1.4826 * spread)
}

#[cfg(test)]
mod tests {
    use obsdeg_evidence::simulation::Noise;

    use super::*;

    fn sample(line: u64, t: f64, z: f64) -> BinSample {
        BinSample { line, t, z: [Some(z), None, None, None], sigma: None, temperature: None }
    }

    fn binned(samples: impl Iterator<Item = BinSample>) -> (Vec<Bin>, Vec<Spike>) {
        let (mut binner, mut spikes) = (Binner::new(10.0, vec![1e-3]), Vec::new());
        let mut bins: Vec<Bin> = samples.flat_map(|s| binner.push(s, &mut spikes)).collect();
        bins.extend(binner.end(&mut spikes));
        (bins, spikes)
    }

    /// A curve is moved off the middle of its line by half the mean square of the times.
    #[test]
    fn a_curve_lies_beside_its_line() {
        for lost in [3, 7, 100] {
            let times = (0..11).filter(|i| *i != lost).map(|i| 0.9 * f64::from(i));
            let (all, _) = binned(times.enumerate().map(|(i, t)| {
                let curve = 0.5 * 0.02 * (t - 4.5) * (t - 4.5);
                sample(i as u64, t, 3.0 + 0.1 * (t - 4.5) + curve)
            }));
            let mean = all[0].channels[0].expect("measured");
            let middle = all[0].t - 4.5;
            let there = 3.0 + 0.1 * middle + 0.5 * 0.02 * middle * middle;
            assert!((mean.value - 0.02 * mean.bend - there).abs() < 1e-12, "{mean:?}");
        }
    }

    /// Samples every 10 s are bins of their own; a line of several samples gives its value at the middle,
    /// with the weight of all.
    #[test]
    fn alone_and_together() {
        let (alone, _) = binned((0..3).map(|i| sample(i + 2, 10.0 * i as f64, i as f64)));
        assert_eq!(alone.len(), 3);
        assert_eq!((alone[1].t, alone[1].lines), (10.0, (3, 3).into()));
        let one = alone[1].channels[0].expect("measured");
        assert_eq!((one.value, one.variance, one.free), (1.0, 1.0, 0));
        let (all, spikes) = binned((0..100).map(|i| sample(i, i as f64 / 10.0, 3.0 + 0.7 * i as f64)));
        let mean = all[0].channels[0].expect("measured");
        assert!((all[0].t - 4.95).abs() < 1e-12 && (mean.value - 3.0 - 0.7 * 49.5).abs() < 1e-10);
        assert!((mean.variance - 0.01).abs() < 1e-12 && mean.scatter < 1e-18 && mean.free == 98);
        assert!(spikes.is_empty() && all.len() == 1);
    }

    /// Two spikes in a noisy line are found at their lines and do not change its value; the scatter is the
    /// noise.
    #[test]
    fn spikes_are_left_out() {
        let mut noise = Noise::new(3, 0);
        let clean: Vec<f64> = (0..400).map(|i| 0.01 * i as f64 + 1e-3 * noise.normal()).collect();
        let of = |values: &[f64]| {
            binned(values.iter().enumerate().map(|(i, z)| sample(i as u64, i as f64 / 40.0, *z)).take(400))
        };
        let mut spiked = clean.clone();
        spiked[17] += 5.0;
        spiked[390] -= 0.02;
        let (right, none) = of(&clean);
        let (bins, spikes) = of(&spiked);
        assert!(none.is_empty(), "{none:?}");
        assert_eq!(spikes.iter().map(|s| s.line).collect::<Vec<_>>(), [17, 390]);
        assert!((spikes[1].off + 0.02).abs() < 5e-3 && spikes[1].sigmas < -12.0);
        let (a, b) = (right[0].channels[0].expect("there"), bins[0].channels[0].expect("there"));
        assert!((a.value - b.value).abs() < 2e-5, "{} {}", a.value, b.value);
        let sigma = (b.scatter / b.free as f64).sqrt();
        assert!((sigma / 1e-3 - 1.0).abs() < 0.1, "{sigma}");
    }

    /// Bins of eight to twelve right samples have no spikes, whether the stated sigma is right, or a tenth or
    /// ten times as large; a spike of fifteen sigma is found in them where the stated sigma is not too large
    /// for the first bins.
    #[test]
    fn few_samples_have_no_spikes_by_chance() {
        for stated in [1e-4, 1e-3, 1e-2] {
            let mut noise = Noise::new(7, 0);
            let (mut binner, mut spikes) = (Binner::new(10.0, vec![stated]), Vec::new());
            for i in 0..100_000_u64 {
                let t = i as f64 * if i < 50_000 { 1.0 } else { 1.25 };
                let off = if i == 70_001 { 15e-3 } else { 0.0 };
                binner.push(sample(i, t, 0.3 * t + 1e-3 * noise.normal() + off), &mut spikes);
            }
            spikes.retain(|s| s.line > 10 * SOME as u64);
            assert_eq!(spikes.iter().map(|s| s.line).collect::<Vec<_>>(), [70_001], "{stated}: {spikes:?}");
        }
    }

    /// A fast ramp with missing cells: every bin has the value of the ramp at its middle.
    #[test]
    fn missing_cells_move_no_middle() {
        let two = |i: u64| {
            let (t, there) = (5.0 * i as f64, |missing: bool| (!missing).then_some(7.0 * i as f64));
            BinSample { z: [there(i.is_multiple_of(7)), there(i % 5 == 1), None, None], ..sample(i, t, 0.0) }
        };
        let (mut binner, mut spikes) = (Binner::new(10.0, vec![1e-3; 2]), Vec::new());
        let mut bins: Vec<Bin> = (0..60).flat_map(|i| binner.push(two(i), &mut spikes)).collect();
        bins.extend(binner.end(&mut spikes));
        assert!(bins.len() > 30 && spikes.is_empty());
        for (bin, mean) in bins.iter().flat_map(|b| b.channels.iter().flatten().map(move |m| (b, m))) {
            assert!((mean.value - 7.0 * bin.t / 5.0).abs() < 1e-9, "{bin:?}");
        }
    }

    /// A dense record with every second cell of a channel empty makes no more bins, and no value moves.
    #[test]
    fn dense_rows_with_empty_cells_stay_together() {
        let two = |i: u64| {
            let other = (i % 2 == 1).then_some(7.0 * i as f64);
            BinSample { z: [Some(7.0 * i as f64), other, None, None], ..sample(i, i as f64, 0.0) }
        };
        let (mut binner, mut spikes) = (Binner::new(10.0, vec![1e-3; 2]), Vec::new());
        let mut bins: Vec<Bin> = (0..60).flat_map(|i| binner.push(two(i), &mut spikes)).collect();
        bins.extend(binner.end(&mut spikes));
        assert_eq!((bins.len(), spikes.len()), (6, 0));
        for (bin, mean) in bins.iter().flat_map(|b| b.channels.iter().flatten().map(move |m| (b, m))) {
            assert!((mean.value - 7.0 * bin.t).abs() < 1e-9, "{bin:?}");
        }
    }

    /// A sample with its own sigma is a bin of its own; gaps make no bins.
    #[test]
    fn given_sigmas_and_gaps() {
        let given = |line: u64, z: Option<f64>| BinSample {
            line,
            t: line as f64,
            z: [z, None, None, None],
            sigma: Some([0.5; CHANNELS]),
            temperature: None,
        };
        let (bins, _) = binned([given(1, Some(2.0)), given(2, None), given(3, Some(4.0))].into_iter());
        let of: Vec<_> = bins.iter().map(|b| b.channels[0].map(|m| (m.value, m.variance, m.given))).collect();
        assert_eq!(of, [Some((2.0, 0.25, true)), None, Some((4.0, 0.25, true))]);
    }
}

//! Intervals at rest: the scatter of some channels within a window about a sample, combined, stays within a
//! multiple of the scatter at the beginning.
//!
//! D. Tedaldi, A. Pretto, E. Menegatti, *A robust and easy to implement method for IMU calibration without
//! external equipments*, ICRA 2014, doi:10.1109/ICRA.2014.6907297, (15). Samples stay in memory for one
//! window and one shortest interval.

use std::collections::VecDeque;

use obsdeg_core::model::Still;

/// Sample in the window: its time, the channels that decide, and its payload.
#[derive(Debug, Clone)]
struct WindowSample<S> {
    t: f64,
    x: Vec<f64>,
    carried: S,
}

/// Sample with its interval at rest.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DecidedSample<S> {
    /// Payload of the sample.
    pub sample: S,
    /// Index of its interval at rest, from 0; `None` in motion.
    pub interval: Option<usize>,
}

/// Detector of intervals at rest; samples come out in the order in which they went in.
#[derive(Debug, Clone)]
pub(crate) struct Detector<S> {
    of: Still,
    /// Samples from the start of the window of the next undecided sample on; those before `next` are decided.
    samples: VecDeque<WindowSample<Option<S>>>,
    next: usize,
    /// Index of the first sample of the window about the next undecided one.
    first: usize,
    /// End of the window `first..last`; `sums` has the sums and sums of squares of its samples, by channel,
    /// about the first sample of all (`origin`).
    last: usize,
    sums: Vec<[f64; 2]>,
    origin: Vec<f64>,
    /// Largest variance at rest; `None` until the beginning is over.
    limit: Option<f64>,
    begin: f64,
    /// Samples of an interval that is not long enough yet, and the time `since` which it lasts, in s.
    waiting: Vec<S>,
    since: f64,
    found: usize,
    /// True if the interval that `found` counts is going on.
    inside: bool,
}

impl<S> Detector<S> {
    /// Detector without samples.
    pub(crate) fn new(of: &Still) -> Self {
        Self {
            of: of.clone(),
            samples: VecDeque::new(),
            next: 0,
            first: 0,
            last: 0,
            sums: Vec::new(),
            origin: Vec::new(),
            limit: None,
            begin: f64::NAN,
            waiting: Vec::new(),
            since: 0.0,
            found: 0,
            inside: false,
        }
    }

    /// Number of intervals found.
    pub(crate) fn found(&self) -> usize {
        self.found
    }

    /// Adds a sample with the channels `x` that decide; samples that are decided now go to `out`.
    pub(crate) fn push(&mut self, t: f64, x: Vec<f64>, sample: S, out: &mut Vec<DecidedSample<S>>) {
        if self.origin.is_empty() {
            self.sums = vec![[0.0; 2]; x.len()];
            self.origin.clone_from(&x);
            self.begin = t;
        }
        self.samples.push_back(WindowSample { t, x, carried: Some(sample) });
        if self.limit.is_none() && t - self.begin >= self.of.initial {
            self.set_limit();
        }
        self.judge(false, out);
    }

    /// Decides the remaining samples at the end of the record.
    pub(crate) fn end(&mut self, out: &mut Vec<DecidedSample<S>>) {
        if self.limit.is_none() {
            self.set_limit();
        }
        self.judge(true, out);
        self.leave(out);
    }

    /// Sets the limit from the variance of all samples in memory, all channels together: the norm of their
    /// vector.
    fn set_limit(&mut self) {
        let mut sums = vec![[0.0; 2]; self.origin.len()];
        self.samples.iter().for_each(|h| add(&mut sums, &self.origin, &h.x, 1.0));
        self.limit = Some(self.of.factor * spread(&sums, self.samples.len()));
    }

    fn judge(&mut self, all: bool, out: &mut Vec<DecidedSample<S>>) {
        let Some(limit) = self.limit else { return };
        let half = self.of.window / 2.0;
        while let Some(middle) = self.samples.get(self.next).map(|h| h.t) {
            if !all && self.samples.back().is_none_or(|h| h.t <= middle + half) {
                return;
            }
            // the window is cut at both ends of the record
            while self.samples.get(self.last).is_some_and(|h| h.t <= middle + half) {
                add(&mut self.sums, &self.origin, &self.samples[self.last].x, 1.0);
                self.last += 1;
            }
            while self.samples[self.first].t < middle - half {
                add(&mut self.sums, &self.origin, &self.samples[self.first].x, -1.0);
                self.first += 1;
            }
            let still = spread(&self.sums, self.last - self.first) <= limit;
            if let Some(sample) = self.samples[self.next].carried.take() {
                self.decide(middle, sample, still, out);
            }
            self.next += 1;
            while self.first > 0 {
                self.samples.pop_front();
                (self.first, self.next, self.last) = (self.first - 1, self.next - 1, self.last - 1);
            }
        }
    }

    fn decide(&mut self, t: f64, sample: S, still: bool, out: &mut Vec<DecidedSample<S>>) {
        if !still {
            self.leave(out);
            out.push(DecidedSample { sample, interval: None });
            return;
        }
        if !self.inside && self.waiting.is_empty() {
            self.since = t;
        }
        if !self.inside {
            self.waiting.push(sample);
            if t - self.since >= self.of.shortest {
                self.inside = true;
                self.found += 1;
                let interval = Some(self.found - 1);
                out.extend(self.waiting.drain(..).map(|sample| DecidedSample { sample, interval }));
            }
            return;
        }
        out.push(DecidedSample { sample, interval: Some(self.found - 1) });
    }

    /// Ends an interval; one that was too short does not count.
    fn leave(&mut self, out: &mut Vec<DecidedSample<S>>) {
        self.inside = false;
        out.extend(self.waiting.drain(..).map(|sample| DecidedSample { sample, interval: None }));
    }
}

fn add(sums: &mut [[f64; 2]], origin: &[f64], x: &[f64], sign: f64) {
    for ((s, o), x) in sums.iter_mut().zip(origin).zip(x) {
        s[0] += sign * (x - o);
        s[1] += sign * (x - o) * (x - o);
    }
}

/// Norm of the variances of the channels.
fn spread(sums: &[[f64; 2]], count: usize) -> f64 {
    let n = count.max(1) as f64;
    sums.iter().map(|s| (s[1] / n - (s[0] / n).powi(2)).max(0.0)).map(|v| v * v).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use obsdeg_evidence::simulation::Noise;

    use super::*;

    fn still() -> Still {
        Still { by: vec![], initial: 5.0, window: 1.0, factor: 6.0, shortest: 2.0 }
    }

    /// Rest, a turn, a rest that is too short, a turn, rest. Every sample comes out once, in order. Samples
    /// at rest, except for half a window about the turns, belong to the first and the second interval. The
    /// reference sums every window by itself.
    #[test]
    fn rest_and_turns() {
        let mut noise = Noise::new(5, 0);
        let level = |t: f64| match t {
            t if t < 10.0 => 0.0,
            t if t < 12.0 => t - 10.0,
            t if t < 13.5 => 2.0,
            t if t < 15.0 => 2.0 + (t - 13.5),
            _ => 3.5,
        };
        let samples: Vec<(f64, Vec<f64>)> = (0..2000)
            .map(|i| f64::from(i) * 0.01)
            .map(|t| (t, vec![1e3 + level(t) + 0.01 * noise.normal(), 0.01 * noise.normal()]))
            .collect();
        let mut detector = Detector::new(&still());
        let mut out = Vec::new();
        let mut most = 0;
        for (i, (t, x)) in samples.iter().enumerate() {
            detector.push(*t, x.clone(), i, &mut out);
            most = most.max(detector.samples.len() + detector.waiting.len());
        }
        detector.end(&mut out);
        assert_eq!(out.iter().map(|o| o.sample).collect::<Vec<_>>(), (0..2000).collect::<Vec<_>>());
        assert_eq!(detector.found(), 2);
        assert!(most < 510, "{most} held");
        let variance = |range: &[(f64, Vec<f64>)]| {
            let of = |c: usize| {
                let mean = range.iter().map(|s| s.1[c]).sum::<f64>() / range.len() as f64;
                range.iter().map(|s| (s.1[c] - mean).powi(2)).sum::<f64>() / range.len() as f64
            };
            of(0).hypot(of(1))
        };
        let limit = 6.0 * variance(&samples[..501]);
        for (i, decide) in out.iter().enumerate() {
            let t = samples[i].0;
            let window: Vec<_> = samples.iter().filter(|s| (s.0 - t).abs() <= 0.5).cloned().collect();
            let rest = variance(&window) <= limit;
            let expected = match t {
                t if t < 10.5 => rest.then_some(0),
                t if t < 14.0 => None,
                _ => rest.then_some(1),
            };
            assert_eq!(decide.interval, expected, "{t}");
        }
        let of = |k: usize| out.iter().filter(|o| o.interval == Some(k)).count();
        assert!((940..=1000).contains(&of(0)) && (440..=500).contains(&of(1)), "{} {}", of(0), of(1));
    }

    /// A record shorter than the beginning is judged by all its samples.
    #[test]
    fn shorter_than_its_beginning() {
        let mut detector = Detector::new(&still());
        let mut out = Vec::new();
        for i in 0..300 {
            detector.push(f64::from(i) * 0.01, vec![f64::from(i % 2)], i, &mut out);
        }
        assert!(out.is_empty());
        detector.end(&mut out);
        assert_eq!((out.len(), detector.found()), (300, 1));
        assert!(out.iter().all(|o| o.interval == Some(0)));
    }
}

//! Chi-square of a fit against its degrees of freedom: of everything, and of what joining records adds.

use super::diagnose::data::{AnswerData, ReportedFunctional};
use crate::answer::{Fit, Repeatability};
use crate::levels;

impl AnswerData<'_> {
    /// Degrees of freedom of what is known beside the records: rows of stated priors and of a calibration
    /// before, without those directions that they alone determine.
    fn free_of_priors(&self) -> f64 {
        let known = self.problem.known.as_ref().map_or(0, |k| k.values.len());
        (self.problem.unknowns.stated.len() + known).saturating_sub(self.problem.unknowns.given) as f64
    }

    /// Degrees of freedom of the priors of random biases: the parts of them that the records determine.
    fn free_of_biases(&self) -> f64 {
        let u = &self.problem.unknowns;
        let of = |&i: &usize| 1.0 - (self.linear.sigma(&[(i, 1.0)]) / u.prior[i]).powi(2);
        u.biases.iter().map(of).sum::<f64>().max(0.0)
    }

    /// Chi-square of everything: degrees of freedom are measurements and priors minus what they determine.
    pub(super) fn fit(&self, unknowns: &[ReportedFunctional], combinations: &[ReportedFunctional]) -> Fit {
        let (_, free) = self.found.sums(|_| true);
        let left: f64 = self.estimate.at.cost - (&self.linear.root * &self.linear.x).norm_squared();
        // what several records share counts once: every run alone leaves more free than all together
        let alone = self.problem.runs.len() - 1;
        let coefficients =
            |a: &&ReportedFunctional| a.determined && a.terms.iter().all(|(i, _)| *i >= self.shared());
        let shared = unknowns.iter().chain(combinations).filter(coefficients).count();
        let degrees_of_freedom =
            free + (alone * shared) as f64 + self.free_of_priors() + self.free_of_biases();
        let mean = left.max(0.0) / degrees_of_freedom.max(1.0);
        Fit {
            chi_square: left,
            degrees_of_freedom,
            band: levels::band(degrees_of_freedom.max(1.0), levels::NOISE),
            factor: mean.sqrt(),
            passes: self.estimate.passes,
        }
    }

    /// The first unknown that all runs share.
    fn shared(&self) -> usize {
        self.problem.unknowns.n - self.planned.platform.coefficients()
    }

    /// Chi-square that joining the records adds to the sum over the records alone.
    pub(super) fn repeatability(&self, fit: &Fit) -> Option<Repeatability> {
        let runs = self.problem.runs.len();
        let (_, free) = self.found.sums(|_| true);
        let degrees_of_freedom = fit.degrees_of_freedom - free - self.free_of_biases();
        (runs > 1 && degrees_of_freedom > 0.0).then(|| {
            let joined = (fit.chi_square - self.found.alone.iter().sum::<f64>()).max(0.0);
            Repeatability {
                chi_square: joined / degrees_of_freedom,
                degrees_of_freedom,
                band: levels::band(degrees_of_freedom, 2.0 * levels::REPEATABILITY),
            }
        })
    }
}

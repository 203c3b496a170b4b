//! The bench: sizes (one sigma) of errors that are not estimated, and the total uncertainty with them.

use obsdeg_core::model::settings::{Assignment, concerns};
use obsdeg_core::model::{OmittedModel, OmittedTerm, may_be_omitted, omitted_meant};

/// Name in a bench that nothing answers to.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("bench: no error is `{found}`; {known}")]
pub struct BenchError {
    /// Name that was found.
    pub found: String,
    /// Names that could be meant.
    pub known: String,
}

/// Sizes of the errors that a scheme does not estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Bench {
    /// One sigma of every error in its unit; `None` where the bench states none.
    pub sizes: Vec<Option<f64>>,
}

impl Bench {
    /// The sizes that `stated` gives the errors of `model`, families before single ones. What is among the
    /// unknowns has no size: it is estimated.
    ///
    /// # Errors
    /// [`BenchError`] for a name that no error has.
    pub fn of(stated: &[Assignment], model: &OmittedModel) -> Result<Self, BenchError> {
        // of an error that is estimated, or of a position that another scheme has, nothing counts
        if let Some(a) = stated.iter().find(|a| !may_be_omitted(&a.name)) {
            return Err(BenchError { found: a.name.clone(), known: omitted_meant(&a.name) });
        }
        let size = |t: &OmittedTerm| Self::size_of(stated, t.family, &t.name);
        Ok(Self { sizes: model.terms().iter().map(size).collect() })
    }

    /// Size that `stated` gives an error of a family, in its unit: the last one that names either.
    pub fn size_of(stated: &[Assignment], family: &str, name: &str) -> Option<f64> {
        let own = |a: &&Assignment| a.name == family || concerns(&a.name, name);
        stated.iter().rfind(own).map(|a| a.value)
    }

    /// True if no error has a size.
    pub fn is_empty(&self) -> bool {
        self.sizes.iter().all(Option::is_none)
    }

    /// Total uncertainty of every estimate: `sqrt(sigma^2 + sum (B s)^2)`, the covariance of Schmidt's
    /// consider filter. `changes` is unknowns x errors, in the units of `sigmas` per unit of the sizes.
    pub fn totals(&self, sigmas: &[Option<f64>], changes: &[Vec<f64>]) -> Vec<Option<f64>> {
        let of = |(sigma, row): (&Option<f64>, &Vec<f64>)| {
            let contribution = |(b, s): (&f64, &Option<f64>)| (b * s.unwrap_or(0.0)).powi(2);
            sigma.map(|s| (s * s + row.iter().zip(&self.sizes).map(contribution).sum::<f64>()).sqrt())
        };
        sigmas.iter().zip(changes).map(of).collect()
    }
}

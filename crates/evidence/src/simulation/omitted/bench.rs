//! Bench: sizes (one sigma) of errors that are not estimated, and the total uncertainty with them.

use obsdeg_core::model::settings::{Assignment, concerns};
use obsdeg_core::model::{MAX_ATTITUDES, OmittedModel, OmittedTerm, Platform, may_be_omitted, omitted_meant};

/// Name in a bench that matches no error.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("bench: no error is `{found}`; {known}")]
pub struct BenchError {
    /// Name that was found.
    pub found: String,
    /// Names that could be meant.
    pub known: String,
}

/// Number of the position in the name of an attitude: 2 in `attitude_x@2`.
fn attitude_position(name: &str) -> Option<usize> {
    name.strip_prefix("attitude_")?.split_once('@')?.1.parse().ok()
}

/// Sizes of the errors that a scheme does not estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Bench {
    /// One sigma of every error, in its unit; `None` where the bench states none.
    pub sizes: Vec<Option<f64>>,
}

impl Bench {
    /// Sizes of the errors of `model` by `stated`, families before single errors. An error among the unknowns
    /// has no size: it is estimated.
    ///
    /// # Errors
    /// [`BenchError`] for a name that matches no error.
    pub fn of(stated: &[Assignment], model: &OmittedModel) -> Result<Self, BenchError> {
        // estimated errors, and positions of another scheme, do not count
        if let Some(a) = stated.iter().find(|a| !may_be_omitted(&a.name)) {
            return Err(BenchError { found: a.name.clone(), known: omitted_meant(&a.name) });
        }
        let size = |t: &OmittedTerm| Self::size_of(stated, t.family, &t.name);
        Ok(Self { sizes: model.terms().iter().map(size).collect() })
    }

    /// Checks that the effect of stated attitudes is computed: not for schemes of so many positions, or with
    /// rotating positions.
    ///
    /// # Errors
    /// [`BenchError`].
    pub fn check(stated: &[Assignment], positions: usize, rotates: bool) -> Result<(), BenchError> {
        let Some(first) = stated.iter().find(|a| a.name.starts_with("attitude") && a.value != 0.0) else {
            return Ok(());
        };
        let refuse = |a: &Assignment, known: String| Err(BenchError { found: a.name.clone(), known });
        if rotates {
            let known = "the effect of an attitude is not computed where a position rotates; leave it out of the bench";
            return refuse(first, known.into());
        }
        if positions > MAX_ATTITUDES {
            let known =
                format!("attitudes are computed for at most {MAX_ATTITUDES} positions, found {positions}");
            return refuse(first, known);
        }
        let beyond = |a: &&Assignment| attitude_position(&a.name).is_some_and(|i| i > positions);
        match stated.iter().find(beyond) {
            Some(a) if positions == 0 => {
                refuse(a, "the number of positions is not known beforehand; state it (--positions)".into())
            }
            Some(a) if positions == 1 => refuse(a, "the scheme has one position".into()),
            Some(a) => refuse(a, format!("the scheme has {positions} positions")),
            None => Ok(()),
        }
    }

    /// Names of a bench that are among the unknowns of `platform`: they are estimated, so their sizes do not
    /// count.
    pub fn estimated(stated: &[Assignment], platform: &Platform) -> Vec<String> {
        let model = OmittedModel::new(platform);
        let is_omitted =
            |a: &Assignment| model.terms().iter().any(|t| a.name == t.family || concerns(&a.name, &t.name));
        let is_unknown = |a: &Assignment| platform.names().iter().any(|name| concerns(&a.name, name));
        let own = stated.iter().filter(|a| is_unknown(a) && !is_omitted(a));
        own.map(|a| a.name.clone()).collect()
    }

    /// Sizes of a bench for the scheme without a position (counted from 0): the attitudes of later positions
    /// move up.
    pub fn without(stated: &[Assignment], position: usize) -> Vec<Assignment> {
        let moved = |a: &Assignment| match attitude_position(&a.name) {
            Some(i) if i == position + 1 => None,
            Some(i) if i > position + 1 => {
                let own = a.name.split('@').next().unwrap_or(&a.name);
                Some(Assignment { name: format!("{own}@{}", i - 1), value: a.value })
            }
            _ => Some(a.clone()),
        };
        stated.iter().filter_map(moved).collect()
    }

    /// Size of an error of a family, in its unit: the last one of `stated` that names the error or its
    /// family.
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

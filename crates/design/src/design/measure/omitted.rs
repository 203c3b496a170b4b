//! Errors that a scheme does not estimate, in a search: how they change the estimates of a sequence, built up
//! position by position beside its information.
//!
//! With J the columns of the unknowns and O those of the errors, `M = J^T R^-1 J` is the information of
//! a sequence and `N = J^T R^-1 O` is stored here. Estimates change by `B = M^-1 N`, and the total
//! uncertainty of an estimate is `sqrt(sigma^2 + sum (B s)^2)`, s the sizes. A record shows error j
//! with the information `O_j^T R^-1 O_j - N_j^T M^-1 N_j`. A total is never below its sigma, so a lower
//! bound on sigmas is one on totals.

use obsdeg_core::model::settings::Assignment;
use obsdeg_core::model::slew::W_IE;
use obsdeg_core::model::{AZIMUTH, Carry, LOCAL, OmittedKind, OmittedModel, PSI_EPS, Platform, Scheme};
use obsdeg_evidence::simulation::omitted::Bench;
use obsdeg_evidence::simulation::{Conditions, si_per_shown};

use crate::design::request::error::DesignError;
use crate::design::request::options::Immune;

/// Errors that count in a search.
#[derive(Debug, Clone)]
pub(crate) struct OmittedErrors {
    /// Errors except those of attitudes, which are three more at every position.
    pub(super) model: OmittedModel,
    /// One sigma of every error in SI units, zero where none is stated; the last three are about x, y
    /// and z of the attitude of a position.
    pub(super) sizes: Vec<f64>,
    /// Largest size in SI units at which a record may begin to show the error, zero where it must have
    /// no effect, in the order of `sizes`; `None` if no immunity is required.
    pub(super) immune: Vec<Option<f64>>,
    /// Largest effect of one SI unit on drift (rad/s) or on the output (g), in the order of `sizes`.
    pub(super) largest: Vec<f64>,
    /// True if attitude errors count.
    pub(super) attitudes: bool,
    /// True if a turn of the platform axes leaves every criterion unchanged.
    pub(crate) alike: bool,
}

/// Effects of the errors at one candidate.
#[derive(Debug, Clone, Default)]
pub(crate) struct OmittedAt {
    /// Drift, then output, of every error at this attitude (errors x 6).
    pub(super) effects: Vec<[f64; LOCAL - 3]>,
    /// Contribution of a position under reset carry, psi eliminated.
    pub(super) own: OmittedSums,
}

/// Sums over a sequence for the errors that are not estimated.
#[derive(Debug, Clone, Default)]
pub(crate) struct OmittedSums {
    /// `J^T R^-1 O`, error by error (errors x n).
    pub(super) cross: Vec<f64>,
    /// `O^T R^-1 O` of every error.
    pub(super) squares: Vec<f64>,
    /// Psi in the carried axes by every error.
    pub(super) psi: Vec<[f64; 3]>,
}

impl OmittedErrors {
    /// Errors of the bench that `conditions` state, and those that schemes must be immune to. `None` if
    /// there are none, or if a search does not count them: with random drift and biases, with
    /// instantaneous turns in which torquers act, and with sizes for single attitudes.
    ///
    /// # Errors
    /// [`DesignError::Immune`] for a name that is no error.
    pub(crate) fn of(
        base: &Scheme,
        platform: &Platform,
        conditions: &Conditions,
        immune: &[Immune],
    ) -> Result<Option<Self>, DesignError> {
        let bench = &conditions.bench;
        let all = OmittedModel::new(platform);
        for i in immune {
            let known = all.terms().iter().any(|t| i.names(t.family, &t.name));
            if !known {
                return Err(DesignError::Immune { found: i.name.clone() });
            }
        }
        let mut names = bench.iter().map(|a| &a.name).chain(immune.iter().map(|i| &i.name)).peekable();
        let stated = names.peek().is_some();
        // an attitude error of a single position
        let counts = stated && names.all(|name| !name.contains('@')) && are_counted(base, conditions);
        Ok(counts.then(|| Self::among(&all, bench, immune)))
    }

    /// Units of the sizes of the errors in `immune`.
    pub(crate) fn units(platform: &Platform, immune: &[Immune]) -> Vec<&'static str> {
        let all = OmittedModel::new(platform);
        let own = |i: &Immune| all.terms().iter().find(|t| i.names(t.family, &t.name));
        immune.iter().filter_map(own).map(|t| t.unit).collect()
    }

    fn among(all: &OmittedModel, bench: &[Assignment], immune: &[Immune]) -> Self {
        let size = |family: &str, name: &str, unit: &str| {
            Bench::size_of(bench, family, name).unwrap_or(0.0) * si_per_shown(unit)
        };
        let largest_of = |family: &str, name: &str, unit: &str| {
            let own = immune.iter().filter(|i| i.names(family, name));
            own.map(|i| i.size.unwrap_or(0.0) * si_per_shown(unit)).reduce(f64::min)
        };
        let counted = |j: &usize| {
            let t = &all.terms()[*j];
            !matches!(t.kind, OmittedKind::Attitude { .. })
                && (size(t.family, &t.name, t.unit) > 0.0 || largest_of(t.family, &t.name, t.unit).is_some())
        };
        let kept: Vec<usize> = (0..all.terms().len()).filter(counted).collect();
        let model = all.only(&kept);
        let attitudes =
            ["attitude_x@1", "attitude_y@1", "attitude_z@1"].map(|name| ("attitude", name, "arcsec"));
        let named = model.terms().iter().map(|t| (t.family, t.name.as_str(), t.unit));
        let of: Vec<_> = named.chain(attitudes).collect();
        let sizes: Vec<f64> = of.iter().map(|(f, n, u)| size(f, n, u)).collect();
        let immune: Vec<Option<f64>> = of.iter().map(|(f, n, u)| largest_of(f, n, u)).collect();
        let first = model.terms().len();
        let attitudes = (first..of.len()).any(|j| sizes[j] > 0.0 || immune[j].is_some());
        // a rate of the platform is at least the earth rate
        let rate = |t: &&str| matches!(*t, "GS" | "GM" | "latitude" | "azimuth" | "earth_rate");
        let largest = of.iter().map(|(f, _, _)| if rate(f) { W_IE } else { 1.0 }).collect();
        let alike = all.terms().iter().filter(|t| !matches!(t.kind, OmittedKind::Attitude { .. })).all(|t| {
            let whole = all.terms().iter().filter(|o| o.family == t.family);
            let mut each =
                whole.map(|o| (size(o.family, &o.name, o.unit), largest_of(o.family, &o.name, o.unit)));
            let own = (size(t.family, &t.name, t.unit), largest_of(t.family, &t.name, t.unit));
            // axes of gyros are those of the geometry, which a turn changes
            own == (0.0, None) && each.all(|o| o == own)
                || !t.unit.starts_with("deg/h") && each.all(|o| o == own)
        });
        let alike = alike && sizes[first..].windows(2).all(|s| s[0] == s[1]);
        Self { model, sizes, immune, largest, attitudes, alike }
    }

    /// True if an error has a size.
    pub(crate) fn has_sizes(&self) -> bool {
        self.sizes.iter().any(|s| *s > 0.0)
    }

    /// Errors with all sizes multiplied by a factor.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self { sizes: self.sizes.iter().map(|s| s * factor).collect(), ..self.clone() }
    }

    /// Number of errors except those of attitudes.
    pub(super) fn fixed(&self) -> usize {
        self.model.terms().len()
    }

    /// Index in `sizes` of the error `j` of a sequence.
    pub(super) fn kind(&self, j: usize) -> usize {
        let fixed = self.fixed();
        if j < fixed { j } else { fixed + (j - fixed) % 3 }
    }
}

/// True if a search counts errors: the information of a sequence is that of its samples alone, and
/// turns are those of the slews.
fn are_counted(base: &Scheme, conditions: &Conditions) -> bool {
    let at_once = conditions.slew_rate_deg_s.is_none();
    conditions.gyro_noise.is_none()
        && conditions.as_stated().drift_noise.amount() == 0.0
        && conditions.accelerometer().states().is_empty()
        && !(at_once && base.carry == Carry::Inertial && base.path.is_some())
}

/// Row of an output on all local unknowns, with the error of its accelerometer, unknown or not.
pub(crate) fn with_accelerometer(component: usize, mut row: [f64; LOCAL]) -> [f64; LOCAL] {
    if component != AZIMUTH {
        row[PSI_EPS + component - 1] = 1.0;
    }
    row
}

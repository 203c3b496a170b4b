//! Results of a search, with their files.

use obsdeg_core::model::Scheme;
use obsdeg_core::model::scheme_file::write;
use obsdeg_design::design::{
    Design, DesignError, Found, Part, ShortestSlewSequence, scheme_found, scheme_of_slew_sequence,
};
use obsdeg_design::next::NextPositions;
use obsdeg_design::sensors::Sensors;
use obsdeg_evidence::simulation::Conditions;
use obsdeg_report::{Answer, Document, Excess, File, Table, design_figures, position_figure, visible};
use serde::Serialize;

use crate::analyze::certificate_digest;
use crate::problem::Problem;

/// Result of a search.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub enum Designed {
    /// Schemes.
    Schemes(Box<Searched>),
    /// Fewest positions where the slew path between them counts.
    SlewSequence(Box<SearchedSlewSequence>),
    /// Part of a search.
    Part(Box<Part>),
    /// Sets of outputs of a model.
    Outputs(Box<Sensors>),
    /// Further positions of a scheme.
    Next(Box<NextPositions>),
}

/// Found schemes, with the base scheme and the conditions of the search.
#[derive(Debug, Serialize)]
#[serde(transparent)]
pub struct Searched {
    /// Found schemes.
    pub found: Design,
    #[serde(skip)]
    pub(crate) base: Scheme,
    #[serde(skip)]
    pub(crate) conditions: Conditions,
    #[serde(skip)]
    pub(crate) certificate: Option<File>,
}

/// Found slew sequences, with the base scheme of the search.
#[derive(Debug, Serialize)]
#[serde(transparent)]
pub struct SearchedSlewSequence {
    /// Found slew sequences.
    pub found: ShortestSlewSequence,
    #[serde(skip)]
    pub(crate) base: Scheme,
}

impl Answer for Searched {
    fn layout(&self) -> Option<&str> {
        self.found.layout()
    }

    fn document(&self) -> Document {
        self.found.document()
    }

    fn sentences(&self) -> Vec<String> {
        self.found.sentences()
    }

    fn tables(&self) -> Result<Vec<Table>, serde_json::Error> {
        self.found.tables()
    }

    fn main_table(&self) -> &'static str {
        self.found.main_table()
    }
}

impl Answer for SearchedSlewSequence {
    fn layout(&self) -> Option<&str> {
        self.found.layout()
    }

    fn document(&self) -> Document {
        self.found.document()
    }

    fn tables(&self) -> Result<Vec<Table>, serde_json::Error> {
        self.found.tables()
    }

    fn main_table(&self) -> &'static str {
        self.found.main_table()
    }
}

impl SearchedSlewSequence {
    /// Files beside the JSON: the found scheme.
    pub fn files(&self) -> Vec<File> {
        let scheme = scheme_of_slew_sequence(&self.found, &self.base);
        let file = |s: Scheme| File { name: "winner.toml".into(), bytes: write(&s).into_bytes() };
        scheme.map(file).into_iter().collect()
    }
}

impl Searched {
    /// Takes the requested certificate out of the files of the answer.
    pub fn take_certificate(&mut self) -> Option<File> {
        self.certificate.take()
    }

    /// Files beside the JSON: the best scheme, and with `pictures` its positions and the front.
    ///
    /// # Errors
    /// [`Problem`] of a figure that cannot be drawn.
    pub fn files(&self, pictures: bool) -> Result<Vec<File>, Problem> {
        let Self { found, base, conditions, certificate } = self;
        let mut files: Vec<File> = certificate.iter().cloned().collect();
        if let Some(best) = found.found.first() {
            let bytes = scheme_file(found, best, base, conditions)?.into_bytes();
            files.push(File { name: "winner.toml".into(), bytes });
            if pictures {
                files.push(position_figure(&scheme_found(best, base, conditions)?));
            }
        }
        if pictures {
            files.extend(design_figures(found)?);
        }
        Ok(files)
    }
}

/// Found scheme, as a file that `obsdeg analyze --scheme` reads.
fn scheme_file(
    found: &Design,
    best: &Found,
    base: &Scheme,
    conditions: &Conditions,
) -> Result<String, DesignError> {
    let as_searched = !best.refined && best.dwells_s.is_empty();
    let proven = found.search.as_ref().is_some_and(|s| s.proven) && as_searched;
    let certificate = found.search.as_ref().and_then(|s| s.certificate.as_ref()).filter(|_| as_searched);
    let proven = match (proven, certificate) {
        (true, _)
            if found.search.as_ref().and_then(|s| s.parts.as_ref()).is_some_and(|p| !p.is_repeated()) =>
        {
            "proven best (if the parts were searched as they state)".into()
        }
        (true, _) => "proven best".into(),
        (false, Some(c)) => {
            let excess = Excess::new(best.value, c.best_possible, c.within_percent);
            format!("within {} of the best possible", excess.percent)
        }
        (false, None) => "best found".to_string(),
    };
    let positions = best.positions.iter().enumerate().map(|(i, name)| format!("p{} {name}", i + 1));
    let positions = positions.collect::<Vec<_>>().join(", ");
    let scheme = scheme_found(best, base, conditions)?;
    let all = found.required.len() + 3 >= best.rank[1];
    let what = if all { "all coefficients".into() } else { found.required.join(", ") };
    let search = found.search.as_ref();
    let unit = search.and_then(|s| s.unit.as_deref());
    let prior = search.and_then(|s| s.prior.as_ref());
    let prior = prior.map_or_else(|| "no prior".into(), |p| format!("prior {}", visible(p)));
    let noisy = conditions.as_stated().drift_noise_in_words().is_some() || !conditions.gyro_noise.is_none();
    let drift = if noisy { "the random drift below" } else { "no random drift" };
    let digest = certificate_digest(&scheme);
    let digest = digest.map_or_else(|_| String::new(), |hex| format!("# sha256 of its certificate: {hex}\n"));
    let name = search.map_or("", |s| s.criterion.as_str());
    let largest = |sigma: f64| format!("largest sigma of {what} {sigma:.3e} deg/h (per g)");
    let reached = match (unit, best.worst_sigma_dph) {
        (Some("deg/h"), Some(sigma)) if name == "worst" => largest(sigma),
        (unit, sigma) => {
            let own = unit.map_or_else(String::new, |u| format!(" {u}"));
            let sigma = sigma.filter(|_| unit == Some("deg/h")).map(|s| format!("; {}", largest(s)));
            format!("criterion {name} of {what} {:.3e}{own}{}", best.value, sigma.unwrap_or_default())
        }
    };
    Ok(format!(
        "# {proven} of {} candidates: {reached} in {:.0} s, {prior}, {drift}, seed {}\n# {}\n{digest}{}",
        found.candidates.len(),
        best.total_s,
        found.seed,
        visible(&positions),
        write(&scheme)
    ))
}

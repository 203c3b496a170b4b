//! The degree tables of schemes and models.

use std::ops::RangeInclusive;

use clap::{ArgAction, Args};
use obsdeg_core::analysis::AnalysisOptions;
use obsdeg_core::certificate::{CertificateError, certify, certify_model};
use obsdeg_core::model::Scheme;
use obsdeg_core::model::settings::concerns;
use obsdeg_core::solution::Frame;
use obsdeg_core::system::{
    COUNT_LIMIT, RELATION_LIMIT, ReducedError, SystemAnalysis, SystemOptions, analyze_system, explain_system,
    reduced,
};
use obsdeg_core::why::no_unknown;
use obsdeg_evidence::simulation::{Conditions, SchemeAnalysis, sensitivities};
use obsdeg_report::{Answer, Document, Explanation, File, Several, Table};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::arguments::{ANY, InputOptions, SEED, Word, check_whole, one_of, whole};
use crate::host::{Host, Now};
use crate::problem::Problem;
use crate::source::{Input, ModelWithText, NamedInput};

/// Request of `analyze`: the input, and the options of its verdicts and solutions.
#[derive(Debug, Clone, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct Analyze {
    /// Seed of all random choices
    #[arg(long, default_value_t = SEED, value_parser = whole::<u64>(ANY))]
    pub seed: u64,

    /// Positions, combinations and assumptions.
    #[command(flatten)]
    #[serde(flatten)]
    pub input: InputOptions,

    /// The highest order of derivatives to look at in a model that has no proven end
    #[arg(long, value_name = "K", help_heading = "Models", value_parser = whole::<u16>(ORDERS))]
    pub order: Option<u16>,

    /// Limit of the work of counting the solutions of a model: millions of products at each of two points (30
    /// ms each) [default: 3]
    #[arg(long, value_name = "MILLIONS", help_heading = "Models", value_parser = whole::<u64>(ANY))]
    pub count_limit: Option<u64>,

    /// Limit of the work of relations among output derivatives, sought where counting does not decide how
    /// many solutions there are: millions of products at each of two points (5 ms each); 0: none
    /// [default: 50]
    #[arg(long, value_name = "MILLIONS", help_heading = "Models", value_parser = whole::<u64>(ANY))]
    pub relation_limit: Option<u64>,

    /// Solving expressions and numbers of solutions
    #[arg(
        long, value_name = "ON|OFF", help_heading = "Solutions", default_value = "on",
        action = ArgAction::Set, value_parser = one_of(SOLUTIONS)
    )]
    pub solutions: bool,

    /// Axes of Z in solutions
    #[arg(long, value_name = "FRAME", help_heading = "Solutions", default_value = "n", value_parser = one_of(FRAMES))]
    pub frame: Frame,

    /// Print Z and its derivatives, and psi and eps at each position, as formulas
    #[arg(long, help_heading = "Solutions")]
    pub formulas: bool,

    /// Exact classes of the errors that a scheme does not estimate
    #[arg(
        long, value_name = "ON|OFF", help_heading = "Solutions", default_value = "on",
        action = ArgAction::Set, value_parser = one_of(OMITTED)
    )]
    pub omitted: bool,

    /// Changes of the estimates per unit of each error that a scheme does not estimate, in deg/h per ug and
    /// so on, by the weights of the record that the scheme file states (dwell, step, noise, priors); what it
    /// does not state is chosen as compare does and said
    #[arg(long, help_heading = "Solutions")]
    pub sensitivities: bool,

    /// Explain the verdict on an unknown, or on each of a family (D_F): what decides it, which assumptions it
    /// rests on, and the changes that make it observable or lower its degree, in order of cost, each tried;
    /// repeatable
    #[arg(long, value_name = "NAME", help_heading = "Solutions")]
    pub why: Vec<String>,

    /// True if `certificate.json` is among the files of the answer; on the command line `--certificate` names
    /// the file.
    #[arg(skip)]
    pub certificate: bool,

    /// True if `reduced.toml` is among the files of the answer; on the command line `--reduced` names the
    /// file.
    #[arg(skip)]
    pub reduced: bool,
}

/// Largest orders of derivatives that a request may name.
const ORDERS: RangeInclusive<u64> = 0..=1000;

impl Default for Analyze {
    fn default() -> Self {
        Self {
            seed: SEED,
            input: InputOptions::default(),
            order: None,
            count_limit: None,
            relation_limit: None,
            solutions: true,
            frame: Frame::default(),
            formulas: false,
            omitted: true,
            sensitivities: false,
            why: Vec::new(),
            certificate: false,
            reduced: false,
        }
    }
}

/// The words of `--solutions`.
const SOLUTIONS: [Word<bool>; 2] =
    [("on", "all that there are", true), ("off", "none; never starts the symbolic engine", false)];

/// The words of `--omitted`.
const OMITTED: [Word<bool>; 2] = [("on", "all families of errors", true), ("off", "none; quicker", false)];

/// The words of `--frame`.
const FRAMES: [Word<Frame>; 2] = [
    ("n", "North-Up-East, as in the paper", Frame::N),
    ("platform", "those of the platform", Frame::Platform),
];

/// Answer on a scheme or a model.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub enum Judged {
    /// Answer on a scheme.
    Scheme(Box<SchemeAnalysis>),
    /// Answer on a model.
    Model(Box<SystemAnalysis>),
}

impl Answer for Judged {
    fn layout(&self) -> Option<&str> {
        match self {
            Self::Scheme(a) => a.layout(),
            Self::Model(a) => a.layout(),
        }
    }

    fn document(&self) -> Document {
        match self {
            Self::Scheme(a) => a.document(),
            Self::Model(a) => a.document(),
        }
    }

    fn sentences(&self) -> Vec<String> {
        match self {
            Self::Scheme(a) => a.sentences(),
            Self::Model(a) => a.sentences(),
        }
    }

    fn explanations(&self) -> Vec<Explanation> {
        match self {
            Self::Scheme(a) => a.explanations(),
            Self::Model(a) => a.explanations(),
        }
    }
}

/// Answers on all inputs: the answer itself for one input, a list with names for several.
#[derive(Serialize)]
#[serde(untagged)]
pub enum Judgements {
    /// One answer.
    One(Judged),
    /// Answers on several inputs, or on none.
    Several(Several<Judged>),
}

impl Judged {
    /// The first sentence of the answer, and every unknown with its degree.
    fn verdicts(&self) -> [String; 2] {
        let degree = |name: &str, degree: Option<usize>| match degree {
            Some(k) => format!("{name} {k}"),
            None => format!("{name} not observable"),
        };
        let degrees: Vec<String> = match self {
            Self::Scheme(a) => a.verdicts.quantities.iter().map(|q| degree(&q.name, q.degree)).collect(),
            Self::Model(a) => a.quantities.iter().map(|q| degree(&q.name, q.degree)).collect(),
        };
        let first = self.sentences().into_iter().next().unwrap_or_default();
        [first, format!("degrees: {}", degrees.join(", "))]
    }
}

impl Judgements {
    /// Verdicts as lines of text: the first sentence of each answer, and its degrees.
    pub fn verdicts(&self) -> Vec<String> {
        match self {
            Self::One(one) => one.verdicts().to_vec(),
            Self::Several(Several(all)) => {
                let lines =
                    |(name, one): &(String, Judged)| one.verdicts().map(|line| format!("{name}: {line}"));
                all.iter().flat_map(lines).collect()
            }
        }
    }
}

impl Answer for Judgements {
    fn layout(&self) -> Option<&str> {
        match self {
            Self::One(one) => one.layout(),
            Self::Several(_) => None,
        }
    }

    fn document(&self) -> Document {
        match self {
            Self::One(one) => one.document(),
            Self::Several(several) => several.document(),
        }
    }

    fn sentences(&self) -> Vec<String> {
        match self {
            Self::One(one) => one.sentences(),
            Self::Several(_) => Vec::new(),
        }
    }

    fn explanations(&self) -> Vec<Explanation> {
        match self {
            Self::One(one) => one.explanations(),
            Self::Several(_) => Vec::new(),
        }
    }

    fn tables(&self) -> Result<Vec<Table>, serde_json::Error> {
        match self {
            Self::One(one) => one.tables(),
            Self::Several(several) => several.tables(),
        }
    }

    fn main_table(&self) -> &'static str {
        match self {
            Self::One(one) => one.main_table(),
            Self::Several(several) => several.main_table(),
        }
    }
}

/// Judges schemes and models, as [`InputOptions::read`] gives them.
///
/// # Errors
/// Error of the first scheme or model that cannot be judged, with its name if there are several.
pub fn analyze(options: &Analyze, read: &[NamedInput], host: &mut Host<'_>) -> Result<Judgements, Problem> {
    if let Some(order) = options.order {
        check_whole("--order", order, &ORDERS)?;
    }
    let several = read.len() > 1;
    let mut judged = Vec::with_capacity(read.len());
    for (i, (name, input)) in read.iter().enumerate() {
        let what = if name.is_empty() { "judging".into() } else { format!("judging {name}") };
        if several && !(host.progress)(Now::of(what, i as u64, read.len() as u64)) {
            return Err(Problem::interrupted());
        }
        // errors in a model already have a place in its file
        let of_scheme = several && matches!(input, Input::Scheme(_));
        let one = judge(options, input, host).map_err(|e| if of_scheme { e.in_file(name) } else { e })?;
        judged.push((name.clone(), one));
    }
    Ok(match judged.pop() {
        Some((_, one)) if judged.is_empty() => Judgements::One(one),
        last => {
            judged.extend(last);
            Judgements::Several(Several(judged))
        }
    })
}

/// The certificate of the verdicts on the one scheme or model that was read, under its name
/// `certificate.json`.
///
/// # Errors
/// [`Problem`] of a scheme or model that certificates do not cover.
pub fn certificate(options: &Analyze, read: &[NamedInput]) -> Result<File, Problem> {
    let text = match read {
        [(_, Input::Scheme(scheme))] => certify(scheme, options.seed)?.text(),
        [(_, Input::Model(file))] => {
            in_continuous_time(file, "--certificate")?;
            match certify_model(&file.model, options.seed) {
                Err(CertificateError::Model(e)) => return Err(file.wrong(&e)),
                certified => certified?.text(),
            }
        }
        _ => return Err(Problem::input("a certificate is of one scheme or model; found several files")),
    };
    let text = text.map_err(|e| Problem::internal(e.to_string()))?;
    Ok(File { name: "certificate.json".into(), bytes: text.into_bytes() })
}

/// The reduced model of the one model that was read, under its name `reduced.toml`: fully observable, with
/// the same outputs.
///
/// # Errors
/// [`Problem`] of a model that has no reduced model, or whose reduced model cannot be written.
pub fn reduced_model(options: &Analyze, read: &[NamedInput]) -> Result<File, Problem> {
    let [(_, Input::Model(file))] = read else {
        return Err(Problem::input("a reduced model is of one model"));
    };
    in_continuous_time(file, "--reduced")?;
    match reduced(&file.model, options.seed, options.order.map(|order| order as usize)) {
        Ok(found) => Ok(File { name: "reduced.toml".into(), bytes: found.text.into_bytes() }),
        Err(ReducedError::Model(e)) => Err(file.wrong(&e)),
        Err(e) => Err(Problem::input(e.to_string())),
    }
}

/// Refuses an option for a model in discrete time.
fn in_continuous_time(file: &ModelWithText, option: &str) -> Result<(), Problem> {
    match file.model.discrete {
        true => Err(Problem::input(format!(
            "{option}: the model is in discrete time; expected one in continuous time"
        ))),
        false => Ok(()),
    }
}

/// The SHA-256 of the certificate of a scheme, in hexadecimal digits. It does not depend on a seed.
///
/// # Errors
/// [`Problem`] of a scheme or model that certificates do not cover.
pub(crate) fn certificate_digest(scheme: &Scheme) -> Result<String, Problem> {
    let text = certify(scheme, SEED)?.text().map_err(|e| Problem::internal(e.to_string()))?;
    Ok(Sha256::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Error of `--why` with a name that is not an unknown.
fn not_an_unknown(name: &str, unknowns: &[String]) -> Problem {
    Problem::input(format!("--why: {}", no_unknown(name, unknowns)))
}

/// Unknowns that `--why` asks for, each once: those of these names, or all that a name `stands_for`.
///
/// # Errors
/// [`Problem`] of a name that stands for no unknown.
fn to_explain(
    why: &[String],
    unknowns: &[String],
    stands_for: impl Fn(&str, &str) -> bool,
) -> Result<Vec<String>, Problem> {
    let mut out: Vec<String> = Vec::new();
    for name in why {
        let of = |own: &&String| if unknowns.contains(name) { *own == name } else { stands_for(name, own) };
        let found: Vec<&String> = unknowns.iter().filter(of).collect();
        if found.is_empty() {
            return Err(not_an_unknown(name, unknowns));
        }
        let new: Vec<String> = found.into_iter().filter(|own| !out.contains(own)).cloned().collect();
        out.extend(new);
    }
    Ok(out)
}

fn judge(options: &Analyze, input: &Input, host: &mut Host<'_>) -> Result<Judged, Problem> {
    let &Analyze { seed, solutions, formulas, frame, omitted, count_limit, relation_limit, order, .. } =
        options;
    let why = &options.why;
    Ok(match input {
        Input::Scheme(scheme) => {
            // a record that cannot be predicted is an error before anything is solved
            let of_record = options
                .sensitivities
                .then(|| sensitivities(scheme, &Conditions::of(scheme), seed))
                .transpose()?;
            let options = AnalysisOptions { seed, solutions, formulas, frame, omitted };
            let worker = host.worker.as_deref_mut();
            let mut verdicts = obsdeg_core::analysis::analyze(scheme, options, worker)?;
            let names: Vec<String> = verdicts.quantities.iter().map(|q| q.name.clone()).collect();
            for name in to_explain(why, &names, concerns)? {
                let found = obsdeg_core::analysis::explain(scheme, &verdicts, &name, seed)?;
                verdicts.why.push(found.ok_or_else(|| not_an_unknown(&name, &names))?);
            }
            Judged::Scheme(Box::new(SchemeAnalysis { verdicts, sensitivities: of_record }))
        }
        Input::Model(file) => {
            let count_limit = count_limit.unwrap_or(COUNT_LIMIT);
            let relation_limit = relation_limit.unwrap_or(RELATION_LIMIT);
            let order = order.map(Into::into);
            if !why.is_empty() {
                in_continuous_time(file, "--why")?;
            }
            let options = SystemOptions { seed, solutions, count_limit, relation_limit, order };
            let mut found = analyze_system(&file.model, options).map_err(|e| file.wrong(&e))?;
            let names: Vec<String> = found.quantities.iter().map(|q| q.name.clone()).collect();
            let of_experiment =
                |asked: &str, name: &str| name.split_once('@').is_some_and(|(own, _)| own == asked);
            for name in to_explain(why, &names, of_experiment)? {
                let explained = explain_system(&file.model, &found, &name, options);
                let explained = explained.map_err(|e| file.wrong(&e))?;
                found.why.push(explained.ok_or_else(|| not_an_unknown(&name, &names))?);
            }
            Judged::Model(Box::new(found))
        }
    })
}

//! Checks certificates of obsdeg by their specification alone (`book/src/certificate.md`): rows, arithmetic
//! and reader are this crate's own.
//!
//! ```
//! let refused = obsdeg_verify::verify(b"{}", None).expect_err("no certificate");
//! assert!(refused.to_string().starts_with("certificate: "));
//! ```

mod exact;
mod file;
mod model;
mod modular;
mod optimum;
mod problem;
mod scheme;

use file::{Certificate, Functional, Witness};
use modular::{Judged, PrimeField, Randomness, error_bound, images, judge, primes};
use problem::Problem;

/// Largest certificate, in bytes.
const MOST_BYTES: usize = 16_000_000;

/// Reason why a certificate is not accepted: the place, the certificate's value and the value found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refused {
    text: String,
    unreadable: bool,
}

impl Refused {
    fn new(text: String) -> Self {
        Self { text, unreadable: false }
    }

    /// Refusal whose reason lies in the input beside the certificate.
    fn unreadable(self) -> Self {
        Self { unreadable: true, ..self }
    }

    /// True if nothing was judged: the scheme file is not TOML, or blocks are chosen where there are none.
    pub fn is_unreadable(&self) -> bool {
        self.unreadable
    }
}

/// Choice of the blocks of an optimum's certificate that are searched again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Replay {
    /// Number of blocks, chosen at random. `None`: all blocks if they have at most two million
    /// sequences in total, otherwise as many as this number covers.
    pub blocks: Option<usize>,
    /// Seed of the choice; `None` for a random number of the system.
    pub seed: Option<u64>,
}

impl std::fmt::Display for Refused {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.text)
    }
}

impl std::error::Error for Refused {}

/// Refusal with the place, the expectation and the value found.
fn refusal(place: &str, expected: &str, found: impl std::fmt::Display) -> Refused {
    Refused::new(format!("{place}: expected {expected}; found {}", short(&found.to_string())))
}

/// Refuses unless `holds`.
fn need(holds: bool, place: &str, expected: &str, found: impl std::fmt::Display) -> Result<(), Refused> {
    if holds { Ok(()) } else { Err(refusal(place, expected, found)) }
}

/// Refuses a certificate whose value differs from the one found.
fn same<T: serde::Serialize>(place: &str, certificate: &T, found: &T) -> Result<(), Refused> {
    let text = |value: &T| serde_json::to_string(value).unwrap_or_default();
    let (says, found) = (text(certificate), text(found));
    match says == found {
        true => Ok(()),
        false => {
            let text = format!("{place}: the certificate says {}; found {}", short(&says), short(&found));
            Err(Refused::new(text))
        }
    }
}

/// The beginning of a long text.
fn short(text: &str) -> String {
    let beginning: String = text.chars().take(120).collect();
    if beginning.len() < text.len() { beginning + "..." } else { beginning }
}

/// Checks a certificate, and its problem against a scheme file (TOML) if one is given. Returns one
/// sentence per unknown and combination, then the rank, the assumptions and whether a scheme was
/// compared.
///
/// # Errors
/// [`Refused`] with the reason.
pub fn verify(certificate: &[u8], scheme: Option<&str>) -> Result<Vec<String>, Refused> {
    verify_with(certificate, scheme, &Replay::default())
}

/// Checks a certificate as [`verify`]; `replay` chooses the blocks of an optimum to search again.
///
/// # Errors
/// [`Refused`] with the reason.
pub fn verify_with(
    certificate: &[u8],
    scheme: Option<&str>,
    replay: &Replay,
) -> Result<Vec<String>, Refused> {
    need(
        certificate.len() <= MOST_BYTES,
        "certificate",
        "at most 16 MB",
        format!("{} bytes", certificate.len()),
    )?;
    let layout: Layout = parsed(certificate)?;
    objects(&parsed(certificate)?)?;
    if *replay != Replay::default() && layout.layout != optimum::LAYOUT {
        return Err(refusal("choice of blocks", "the certificate of an optimum", layout.layout).unreadable());
    }
    match layout.layout.as_str() {
        "obsdeg.certificate/1" => of_scheme(certificate, scheme),
        model::LAYOUT => model::verify(certificate, scheme.is_some()),
        optimum::LAYOUT => optimum::verify(certificate, scheme.is_some(), replay),
        other => {
            let layouts = format!("obsdeg.certificate/1, {} or {}", model::LAYOUT, optimum::LAYOUT);
            Err(refusal("layout", &layouts, other))
        }
    }
}

/// Layout key of a file.
#[derive(serde::Deserialize)]
struct Layout {
    layout: String,
}

/// Reads JSON with the keys of a layout.
fn parsed<'de, T: serde::Deserialize<'de>>(certificate: &'de [u8]) -> Result<T, Refused> {
    serde_json::from_slice(certificate).map_err(|e| Refused::new(short(&format!("certificate: {e}"))))
}

/// Refuses lists in place of objects, which the reader would accept as the values of the keys.
fn objects(value: &serde_json::Value) -> Result<(), Refused> {
    let object = |place: String, value: &serde_json::Value| {
        need(value.is_object(), &place, "an object", short(&value.to_string()))
    };
    object("certificate".into(), value)?;
    object("problem".into(), &value["problem"])?;
    let list = |value: &serde_json::Value| value.as_array().cloned().unwrap_or_default();
    for (key, other) in [("verdicts", "terms"), ("combinations", "unknown")] {
        let both = list(&value[key]).iter().any(|claim| claim.get(other).is_some());
        need(!both, key, &format!("objects without the key {other}"), "one with it")?;
    }
    for (place, value) in [
        ("problem.gyros", &value["problem"]["gyros"]),
        ("verdicts", &value["verdicts"]),
        ("combinations", &value["combinations"]),
        ("problem.required", &value["problem"]["required"]),
        ("best", &value["best"]),
        ("blocks", &value["blocks"]),
    ] {
        list(value).iter().enumerate().try_for_each(|(i, entry)| object(format!("{place}.{i}"), entry))?;
    }
    for (i, turns) in list(&value["problem"]["slews"]).iter().enumerate() {
        list(turns).iter().try_for_each(|turn| object(format!("problem.slews.{i}"), turn))?;
    }
    Ok(())
}

/// Checks the certificate of a scheme.
fn of_scheme(certificate: &[u8], scheme: Option<&str>) -> Result<Vec<String>, Refused> {
    let file: Certificate = parsed(certificate)?;
    if let Some(scheme) = scheme {
        scheme::compare(&file.problem, scheme)?;
    }
    let problem = Problem::new(&file.problem)?;
    same("unknowns", &file.unknowns, &problem.names)?;
    need(file.kind == "exact" || file.kind == "modular", "kind", "exact or modular", &file.kind)?;
    let exactly = file.kind == "exact";
    let (functionals, claims) = claims(&file, &problem)?;
    let (count, bound) = match exactly {
        true => (1, 0.0),
        false => primes(error_bound(&problem, file.ranks.len(), &functionals))?,
    };
    let mut random = Randomness::new(certificate);
    for _ in 0..count {
        let field = PrimeField::new(&problem, &mut random);
        field.check_slews(&problem)?;
        let (rows, functionals) = (problem.rows(&field), images(&problem, &field, &functionals)?);
        compare(&judge(field.p, &problem.names, &rows, &functionals), &file.ranks, &file.basis, &claims)?;
    }
    if exactly {
        exact::check(&problem, &file, &functionals, &claims)?;
    } else {
        need(file.null_vectors.is_none(), "null_vectors", "null in a modular certificate", "vectors")?;
        no_coefficients(&claims)?;
    }
    let how = if exactly { "exactly".into() } else { by_primes(count, bound) };
    Ok(sentences(&problem, &claims, file.basis.len(), &how, scheme.is_some()))
}

/// Refuses a certificate that differs from the rows modulo a prime.
fn compare(
    found: &Judged,
    ranks: &[usize],
    basis: &[(usize, usize, usize, String)],
    claims: &[Claim<'_>],
) -> Result<(), Refused> {
    same("ranks", &ranks, &found.ranks.as_slice())?;
    same("basis", &basis, &found.basis.as_slice())?;
    claims.iter().zip(&found.witnesses).try_for_each(|((name, claim), found)| claim.compare(name, found))
}

/// Refuses coefficients in a modular certificate.
fn no_coefficients(claims: &[Claim<'_>]) -> Result<(), Refused> {
    let mut all = claims.iter();
    let given = all.find(|(_, claim)| claim.coefficients.is_some());
    given.map_or(Ok(()), |(name, _)| {
        Err(refusal(&format!("{name}, coefficients"), "null in a modular certificate", "a list"))
    })
}

fn by_primes(count: usize, bound: f64) -> String {
    format!("modulo {count} primes (wrong with probability below {})", rounded_up(bound))
}

/// Number with one digit and an exponent, rounded up.
fn rounded_up(x: f64) -> String {
    let shown = format!("{x:.0e}");
    match shown.split_once('e') {
        Some((digit, exponent)) if shown.parse::<f64>().is_ok_and(|y| y < x) => {
            let exponent: i32 = exponent.parse().unwrap_or(0);
            match digit {
                "9" => format!("1e{}", exponent + 1),
                _ => format!("{}e{exponent}", digit.parse().unwrap_or(0) + 1),
            }
        }
        _ => shown,
    }
}

/// Claim with the name of its functional.
type Claim<'a> = (String, &'a Witness);

/// All claims with their functionals: every unknown, then the combinations.
fn claims<'a>(
    file: &'a Certificate,
    problem: &Problem,
) -> Result<(Vec<Functional>, Vec<Claim<'a>>), Refused> {
    let n = problem.names.len();
    need(file.verdicts.len() == n, "verdicts", &format!("{n} entries"), file.verdicts.len())?;
    need(file.combinations.len() <= 100, "combinations", "at most 100 entries", file.combinations.len())?;
    let (mut functionals, mut claims) = (Vec::new(), Vec::new());
    for (i, (verdict, name)) in file.verdicts.iter().zip(&problem.names).enumerate() {
        same(&format!("verdicts.{i}.unknown"), verdict.unknown.as_ref().unwrap_or(&String::new()), name)?;
        need(verdict.terms.is_none(), &format!("verdicts.{i}"), "no terms", "some")?;
        functionals.push(Functional::unit(name));
        claims.push((name.clone(), &verdict.witness));
    }
    for (i, combination) in file.combinations.iter().enumerate() {
        let place = format!("combinations.{i}.terms");
        need(combination.unknown.is_none(), &place, "no unknown", "one")?;
        let terms = combination.terms.clone().unwrap_or_default();
        terms.check(&place, problem)?;
        functionals.push(terms);
        claims.push((format!("combination {}", i + 1), &combination.witness));
    }
    Ok((functionals, claims))
}

/// Sentence on the verified result of one functional.
fn sentence((name, claim): &Claim<'_>, how: &str) -> String {
    let hidden = claim.hidden_by.as_deref().unwrap_or_default();
    match (claim.degree, claim.excited_by) {
        (Some(degree), _) => {
            let rows = claim.solution.as_ref().map_or(0, Vec::len);
            let lower = match degree {
                0 => String::new(),
                _ => format!(", no lower one suffices (null vector of {hidden})"),
            };
            format!("{name}: observable with degree {degree} from {rows} rows{lower}; verified {how}.")
        }
        (None, Some(row)) => {
            format!(
                "{name}: inseparable at every order (null vector of {hidden}), excited by row {row:?}; verified {how}."
            )
        }
        _ => format!("{name}: not excited, every row has the entry 0; verified {how}."),
    }
}

fn sentences(problem: &Problem, claims: &[Claim<'_>], rank: usize, how: &str, compared: bool) -> Vec<String> {
    let mut out: Vec<String> = claims.iter().map(|claim| sentence(claim, how)).collect();
    let latitude = match &problem.latitude_deg {
        None => "generic latitude".into(),
        Some(degrees) => format!("latitude {degrees} deg"),
    };
    out.push(format!("Rank {rank} of {}; verified {how}.", problem.names.len()));
    let coefficients = claims.iter().take(problem.names.len()).skip(problem.psi);
    let seen = coefficients.filter(|(_, claim)| claim.degree.is_some()).count();
    if let Some(fewest) = problem.fewest_positions(seen) {
        let as_few = if fewest == problem.positions.len() { " This one has as few." } else { "" };
        out.push(format!(
            "Counting: no scheme of fewer than {fewest} positions makes {seen} coefficients observable \
             under {} carry.{as_few}",
            problem.carry
        ));
    }
    out.push(format!(
        "Assumption: the model of book/src/certificate.md with {} carry and {latitude}, {} positions.",
        problem.carry,
        problem.positions.len()
    ));
    let scheme =
        if compared { "The scheme file is that of the certificate." } else { "No scheme file was compared." };
    out.push(scheme.into());
    out
}

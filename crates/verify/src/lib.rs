//! Checks certificates of obsdeg by their specification alone (`book/src/certificate.md`): rows, arithmetic and reader are this crate's own.
//!
//! ```
//! let refused = obsdeg_verify::verify(b"{}", None).expect_err("no certificate");
//! assert!(refused.to_string().starts_with("certificate: "));
//! ```

mod exact;
mod file;
mod modular;
mod problem;
mod scheme;

use file::{Certificate, Functional, Witness};
use modular::{PrimeField, Randomness, error_bound, judge};
use problem::Problem;

/// Largest certificate, in bytes.
const MOST_BYTES: usize = 16_000_000;

/// Reason why a certificate is not accepted: the place, what the certificate says, what is found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refused(String);

impl std::fmt::Display for Refused {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Refused {}

/// A refusal: the place, what was expected there, what was found.
fn refusal(place: &str, expected: &str, found: impl std::fmt::Display) -> Refused {
    Refused(format!("{place}: expected {expected}; found {}", short(&found.to_string())))
}

/// Refuses unless `holds`.
fn need(holds: bool, place: &str, expected: &str, found: impl std::fmt::Display) -> Result<(), Refused> {
    if holds { Ok(()) } else { Err(refusal(place, expected, found)) }
}

/// Refuses unless the certificate says what is found.
fn same<T: serde::Serialize>(place: &str, certificate: &T, found: &T) -> Result<(), Refused> {
    let text = |value: &T| serde_json::to_string(value).unwrap_or_default();
    let (says, found) = (text(certificate), text(found));
    match says == found {
        true => Ok(()),
        false => {
            Err(Refused(format!("{place}: the certificate says {}; found {}", short(&says), short(&found))))
        }
    }
}

/// The beginning of a long text.
fn short(text: &str) -> String {
    let beginning: String = text.chars().take(120).collect();
    if beginning.len() < text.len() { beginning + "..." } else { beginning }
}

/// Checks a certificate, and that it is of the scheme of a file (TOML) if one is given. Returns one sentence per
/// unknown and combination, then the rank, the assumptions and whether a scheme was compared.
///
/// # Errors
/// [`Refused`] with the reason.
pub fn verify(certificate: &[u8], scheme: Option<&str>) -> Result<Vec<String>, Refused> {
    need(
        certificate.len() <= MOST_BYTES,
        "certificate",
        "at most 16 MB",
        format!("{} bytes", certificate.len()),
    )?;
    let file: Certificate =
        serde_json::from_slice(certificate).map_err(|e| Refused(short(&format!("certificate: {e}"))))?;
    same("layout", &file.layout.as_str(), &"obsdeg.certificate/1")?;
    if let Some(scheme) = scheme {
        scheme::compare(&file.problem, scheme)?;
    }
    let problem = Problem::new(&file.problem)?;
    same("unknowns", &file.unknowns, &problem.names)?;
    need(file.kind == "exact" || file.kind == "modular", "kind", "exact or modular", &file.kind)?;
    let exactly = file.kind == "exact";
    let (functionals, claims) = claims(&file, &problem)?;
    let mut random = Randomness::new(certificate);
    for _ in 0..if exactly { 1 } else { 2 } {
        let field = PrimeField::new(&problem, &mut random);
        field.check_slews(&problem)?;
        let found = judge(&problem, &field, &functionals);
        same("ranks", &file.ranks, &found.ranks)?;
        same("basis", &file.basis, &found.basis)?;
        for ((name, claim), found) in claims.iter().zip(&found.witnesses) {
            claim.compare(name, found)?;
        }
    }
    if exactly {
        exact::check(&problem, &file, &functionals, &claims)?;
    } else {
        need(file.null_vectors.is_none(), "null_vectors", "null in a modular certificate", "vectors")?;
        for (name, claim) in &claims {
            need(
                claim.coefficients.is_none(),
                &format!("{name}, coefficients"),
                "null in a modular certificate",
                "a list",
            )?;
        }
    }
    let how = match exactly {
        true => "exactly".into(),
        false => {
            // 1.5 times: rounding to one digit never goes below the bound
            let bound = 1.5 * error_bound(&problem, file.ranks.len(), &functionals);
            format!("modulo two primes (wrong with probability below {bound:.0e})")
        }
    };
    Ok(sentences(&problem, &claims, file.basis.len(), &how, scheme.is_some()))
}

/// A claim by the name of what it is about.
type Claim<'a> = (String, &'a Witness);

/// Everything that is claimed: the functionals (every unknown, then the combinations), and the claims.
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

fn sentences(problem: &Problem, claims: &[Claim<'_>], rank: usize, how: &str, compared: bool) -> Vec<String> {
    let one = |(name, claim): &Claim<'_>| {
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
    };
    let mut out: Vec<String> = claims.iter().map(one).collect();
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
            "Counting: no scheme of fewer than {fewest} positions makes {seen} coefficients observable under {} carry.{as_few}",
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

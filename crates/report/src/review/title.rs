//! Title block of a review, from the tables `[document]` of its files.

use obsdeg_core::title_block::TitleBlock;
use obsdeg_design::review::DesignReview;

use crate::Origin;
use crate::document::{DocumentBlock, TableColumn, left};

/// Table of the title blocks, a row for each file, with room for signatures; a sentence where a single file
/// states none.
pub(super) fn block(r: &DesignReview, origin: &Origin) -> DocumentBlock {
    let schemes = r.schemes.iter().map(|s| (s.name.as_str(), &s.document));
    let generic = r.generic.iter().map(|g| (g.name.as_str(), &g.document));
    let models = r.models.iter().map(|m| (m.analysis.name.as_str(), &m.document));
    let all: Vec<(&str, &TitleBlock)> = schemes.chain(generic).chain(models).collect();
    // of schemes alone, files and schemes have the same order
    let files = origin.inputs.iter().map(|line| file_and_digest(line).0).collect::<Vec<_>>();
    let by_file = r.schemes.len() == all.len() && files.len() == all.len() && all.len() > 1;
    let name = |(i, (name, of)): (usize, &(&str, _))| match by_file {
        true => (format!("{name} ({})", files[i]), *of),
        false => (name.to_string(), *of),
    };
    self::of(all.iter().enumerate().map(name).collect())
}

/// File and digest of a line `sha256 of FILE: DIGEST`; a line without digest is a file.
fn file_and_digest(line: &str) -> (&str, Option<&str>) {
    let (file, digest) = line.rsplit_once(": ").map_or((line, None), |(file, digest)| (file, Some(digest)));
    (file.strip_prefix("sha256 of ").unwrap_or(file), digest)
}

/// Title block of one document; a sentence where the file states none.
pub(crate) fn of_one(own: &TitleBlock, name: &str) -> DocumentBlock {
    of(vec![(name.to_string(), own)])
}

fn of(all: Vec<(String, &TitleBlock)>) -> DocumentBlock {
    let is_stated = |of: &TitleBlock| *of != TitleBlock::default();
    let entry = |of: &TitleBlock, name: &str| {
        let none = if name == "reference" && !is_stated(of) { "no document stated" } else { "-" };
        of.entries().into_iter().find(|e| e.0 == name).map_or(none, |e| e.1).to_string()
    };
    let names = ["reference", "revision", "date", "author"];
    let mut roles: Vec<&String> = all.iter().flat_map(|(_, of)| &of.signatures).collect();
    roles.sort();
    roles.dedup();
    roles.sort_by_key(|role| all.iter().find_map(|(_, of)| of.signatures.iter().position(|s| s == *role)));
    let columns: Vec<TableColumn> = std::iter::once(left("document"))
        .chain(names.map(left))
        .chain(roles.iter().map(|role| left(format!("{role}: name, date, signature"))))
        .collect();
    let row = |(name, of): &(String, &TitleBlock)| -> Vec<String> {
        let line =
            |role: &&String| if of.signatures.contains(role) { "\u{a0}".repeat(44) } else { "-".into() };
        std::iter::once(name.clone())
            .chain(names.map(|name| entry(of, name)))
            .chain(roles.iter().map(line))
            .collect()
    };
    match all.iter().any(|(_, of)| is_stated(of)) || all.len() > 1 {
        true => DocumentBlock::table("", columns, all.iter().map(row)),
        false => DocumentBlock::Text(
            "Reference, revision, date, author and signatures are not stated (table [document] of the file)."
                .into(),
        ),
    }
}

/// Number of digits of a digest on the first page.
pub(crate) const DIGITS: usize = 12;

/// Sentence on the program and the files that the review was made from, with the beginning of their digests.
pub(super) fn made_from(r: &DesignReview, origin: &Origin) -> String {
    made(&r.version, origin)
}

/// Sentence on the version of the program and on the files, with the beginning of their digests.
pub(crate) fn made(version: &str, origin: &Origin) -> String {
    let short = |line: &String| match file_and_digest(line) {
        (file, Some(digest)) => {
            format!("{file} (sha256 {}...)", digest.chars().take(DIGITS).collect::<String>())
        }
        (_, None) => line.clone(),
    };
    let from = origin.inputs.iter().map(short).collect::<Vec<_>>().join(", ");
    let from = if from.is_empty() { from } else { format!(" from {from}") };
    format!("Made by obsdeg {version}{from}.")
}

/// Program, command and files of a document.
pub(crate) fn about(version: &str, origin: &Origin) -> Vec<DocumentBlock> {
    let mut blocks = vec![DocumentBlock::Text(format!("obsdeg {version}"))];
    blocks.extend(origin_of(origin));
    blocks
}

/// Command and files of a document, as far as they are known.
pub(super) fn origin_of(origin: &Origin) -> Vec<DocumentBlock> {
    let command = Vec::from_iter((!origin.command.is_empty()).then(|| origin.command.clone()));
    let lists = [("Command", command), ("Files that were read", origin.inputs.clone())];
    lists.into_iter().filter_map(|(heading, lines)| DocumentBlock::list_if_any(heading, lines)).collect()
}

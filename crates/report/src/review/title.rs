//! Title block of a review, from the tables `[document]` of its files.

use obsdeg_core::title_block::TitleBlock;
use obsdeg_design::review::DesignReview;

use crate::Origin;
use crate::document::{Block, Column, left};

/// Table of the title blocks, a row for each file that states one, with room for signatures; a sentence where
/// no file does.
pub(super) fn block(r: &DesignReview) -> Block {
    let schemes = r.schemes.iter().map(|s| (s.name.as_str(), &s.document));
    let generic = r.generic.iter().map(|g| (g.name.as_str(), &g.document));
    let models = r.models.iter().map(|m| (m.analysis.name.as_str(), &m.document));
    let all: Vec<(&str, &TitleBlock)> =
        schemes.chain(generic).chain(models).filter(|(_, of)| **of != TitleBlock::default()).collect();
    let entry = |of: &TitleBlock, name: &str| {
        of.entries().into_iter().find(|e| e.0 == name).map_or("-", |e| e.1).to_string()
    };
    let names = ["reference", "revision", "date", "author"];
    let mut roles: Vec<&String> = all.iter().flat_map(|(_, of)| &of.signatures).collect();
    roles.sort();
    roles.dedup();
    roles.sort_by_key(|role| all.iter().find_map(|(_, of)| of.signatures.iter().position(|s| s == *role)));
    let columns: Vec<Column> = std::iter::once(left("document"))
        .chain(names.map(left))
        .chain(roles.iter().map(|role| left(format!("{role}: name, date, signature"))))
        .collect();
    let row = |(name, of): &(&str, &TitleBlock)| -> Vec<String> {
        let line =
            |role: &&String| if of.signatures.contains(role) { "\u{a0}".repeat(44) } else { "-".into() };
        std::iter::once(name.to_string())
            .chain(names.map(|name| entry(of, name)))
            .chain(roles.iter().map(line))
            .collect()
    };
    match all.is_empty() {
        false => Block::table("", columns, all.iter().map(row)),
        true => Block::Text(
            "Reference, revision, date, author and signatures are not stated (table [document] of the file)."
                .into(),
        ),
    }
}

/// Number of digits of a digest on the first page.
const DIGITS: usize = 12;

/// Sentence on the program and the files that the review was made from, with the beginning of their digests.
pub(super) fn made_from(r: &DesignReview, origin: &Origin) -> String {
    let short = |line: &String| match line.rsplit_once(": ") {
        Some((file, digest)) => {
            let file = file.strip_prefix("sha256 of ").unwrap_or(file);
            format!("{file} (sha256 {}...)", digest.chars().take(DIGITS).collect::<String>())
        }
        None => line.clone(),
    };
    let from = origin.inputs.iter().map(short).collect::<Vec<_>>().join(", ");
    let from = if from.is_empty() { from } else { format!(" from {from}") };
    format!("Made by obsdeg {}{from}.", r.version)
}

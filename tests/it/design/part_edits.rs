//! Randomly edited parts of a search: each is refused, or merges to the bytes of the whole search. Some edits
//! keep the old digest. Others compute it again, and then every block is searched again.

use obsdeg_commands::{Designed, Host, Search, SearchFiles, Source, design as command};
use obsdeg_design::design::Part;
use obsdeg_exact::SplitMix64;
use serde_json::{Value, json};

use super::*;

/// Number of edits in everyday runs; `.ci/run release` makes a thousand.
const DAILY: u64 = 60;
const RELEASE: u64 = 1000;

fn below(random: &mut SplitMix64, n: usize) -> usize {
    random.below(n.max(1) as u64) as usize
}

/// Replaces, removes or doubles one byte or a stretch of a text.
fn edit_text(text: &str, random: &mut SplitMix64) -> String {
    let mut bytes = text.as_bytes().to_vec();
    let place = below(random, bytes.len());
    let end = (place + 1 + below(random, 40)).min(bytes.len());
    match below(random, 5) {
        0 => bytes[place] = b"0123456789.-e\"[]{},:xtfn "[below(random, 25)],
        1 => drop(bytes.remove(place)),
        2 => bytes.insert(place, b"0123456789,[]"[below(random, 13)]),
        3 => drop(bytes.drain(place..end)),
        _ => {
            let doubled = bytes[place..end].to_vec();
            bytes.splice(place..place, doubled);
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Collects the JSON paths of a value and of all values below it.
fn paths(value: &Value, path: &str, out: &mut Vec<String>) {
    out.push(path.into());
    match value {
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(i, item)| paths(item, &format!("{path}/{i}"), out));
        }
        Value::Object(fields) => {
            let escaped = |name: &str| name.replace('~', "~0").replace('/', "~1");
            fields.iter().for_each(|(name, item)| paths(item, &format!("{path}/{}", escaped(name)), out));
        }
        _ => {}
    }
}

/// Changes one value of a JSON text.
fn edit_value(text: &str, random: &mut SplitMix64) -> String {
    let mut all: Value = serde_json::from_str(text).expect("JSON");
    let mut places = Vec::new();
    paths(&all, "", &mut places);
    let place = places.swap_remove(below(random, places.len()));
    let value = all.pointer_mut(&place).expect("a value");
    let choice = below(random, 6);
    *value = match value {
        Value::Number(n) => {
            let x = n.as_f64().expect("a number");
            let whole = n.is_u64();
            match choice {
                0 if whole => json!(x as u64 + 1),
                1 if whole => json!((x as u64).saturating_sub(1)),
                2 if whole => json!(random.next_u64() >> below(random, 60)),
                0 => json!(x * (1.0 + f64::EPSILON)),
                1 => json!(x / 2.0),
                2 => json!(-x),
                3 => json!(0),
                4 => Value::Null,
                _ => json!(x * 3.0),
            }
        }
        Value::Bool(b) => json!(!*b),
        Value::String(s) => match choice {
            0 => json!(""),
            1 => json!(format!("{s}x")),
            2 => json!(s.replace('1', "2")),
            _ => json!(s.chars().rev().collect::<String>()),
        },
        Value::Null => json!(1),
        Value::Array(items) => {
            let (i, j) = (below(random, items.len()), below(random, items.len()));
            match choice {
                _ if items.is_empty() => items.push(json!(1)),
                0 => items.clear(),
                1 => drop(items.remove(i)),
                2 => items.push(items[i].clone()),
                3 => items.reverse(),
                _ => items.swap(i, j),
            }
            json!(items)
        }
        Value::Object(fields) => {
            let names: Vec<String> = fields.keys().cloned().collect();
            if let Some(name) = names.get(below(random, names.len())) {
                match choice {
                    0 => drop(fields.insert(format!("{name}2"), json!(1))),
                    _ => drop(fields.shift_remove(name)),
                }
            }
            json!(fields)
        }
    };
    all.to_string()
}

/// Merges parts as the command does.
fn merged(parts: &[String], check: Option<u64>) -> Result<String, String> {
    let source = |(i, text): (usize, &String)| Source {
        name: format!("part-{}.json", i + 1),
        text: text.clone(),
        must_be: Default::default(),
    };
    let files =
        SearchFiles { merge: parts.iter().enumerate().map(source).collect(), ..SearchFiles::default() };
    let asked = Search { check, ..Search::default() };
    match command(&asked, &files, &Host::silent()).map_err(|problem| format!("{problem:?}"))? {
        Designed::Schemes(found) => Ok(serde_json::to_string(&found).expect("JSON")),
        _ => Err("another answer".into()),
    }
}

/// Parts of a search, as the command writes them.
fn parts_of(asked: &Search, of: usize) -> Vec<String> {
    let part = |number: usize| {
        let asked = Search { part: Some([number, of]), ..asked.clone() };
        match command(&asked, &SearchFiles::default(), &Host::silent()) {
            Ok(Designed::Part(part)) => serde_json::to_string(&part).expect("JSON"),
            _ => panic!("no part"),
        }
    };
    (1..=of).map(part).collect()
}

#[expect(clippy::print_stderr, reason = "what was measured")]
fn every_edit_is_refused_or_changes_nothing(edits: u64) {
    let mut asked = Search { positions: Some(3), keep: Some(4), ..Search::default() };
    asked.wanted.observable = vec!["D_F".into()];
    asked.assumptions.carry = Some(Carry::Inertial);
    let mut unordered = asked.clone();
    unordered.assumptions.carry = Some(Carry::Reset);
    unordered.positions = Some(4);
    let searches = [asked, unordered].map(|asked| {
        let parts = parts_of(&asked, 3);
        let [whole, repeated] = [None, Some(1000)].map(|check| merged(&parts, check).expect("the whole"));
        (parts, whole, repeated)
    });
    let mut refused = [0; 2];
    for seed in 0..edits {
        let mut random = SplitMix64::of(seed, "edits of parts", &["one"]);
        let (parts, whole, repeated) = &searches[seed as usize % 2];
        let mut parts = parts.clone();
        let edited = below(&mut random, parts.len());
        let before = parts[edited].clone();
        let text = match below(&mut random, 3) {
            0 => edit_text(&before, &mut random),
            _ => edit_value(&before, &mut random),
        };
        let again = seed % 4 >= 2;
        // with a new digest, if the edited text still parses as a part
        let resealed = serde_json::from_str::<Part>(&text).ok().filter(|_| again).map(Part::sealed);
        parts[edited] = resealed.map_or(text, |part| serde_json::to_string(&part).expect("JSON"));
        let (found, expected) = match again {
            true => (merged(&parts, Some(1000)), repeated),
            false => (merged(&parts, None), whole),
        };
        match found {
            Ok(found) => assert_eq!(&found, expected, "edit {seed}: {} -> {}", before, parts[edited]),
            Err(_) => refused[usize::from(again)] += 1,
        }
    }
    eprintln!("{edits} edits: refused {refused:?} (digest as it was, computed again)");
    let half = edits as usize / 2;
    // an edit of a list may leave the list unchanged
    assert!(refused[0] > half * 2 / 3 && refused[1] > half / 2, "{refused:?}");
}

#[test]
#[ignore = "seconds: .ci/run"]
fn some_edits_of_parts() {
    every_edit_is_refused_or_changes_nothing(DAILY);
}

#[test]
#[ignore = "full length, for `.ci/run release`"]
fn a_thousand_edits_of_parts() {
    every_edit_is_refused_or_changes_nothing(RELEASE);
}

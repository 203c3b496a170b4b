//! Conversion of a record's columns to the units of a model.

use obsdeg_core::system::SystemModel;

use crate::record::{Record, RecordError, STANDARD_GRAVITY, Wanted};

const DEG: f64 = std::f64::consts::PI / 180.0;

/// Units by kind, with their values in the first of the kind.
const KINDS: [&[(&str, f64)]; 5] = [
    &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("min", 60.0), ("h", 3600.0), ("d", 86400.0)],
    &[("rad", 1.0), ("mrad", 1e-3), ("deg", DEG), ("arcsec", DEG / 3600.0)],
    &[("rad/s", 1.0), ("deg/s", DEG), ("deg/h", DEG / 3600.0)],
    &[
        ("m/s^2", 1.0),
        ("g", STANDARD_GRAVITY),
        ("mg", STANDARD_GRAVITY * 1e-3),
        ("ug", STANDARD_GRAVITY * 1e-6),
    ],
    &[("m", 1.0), ("km", 1e3), ("cm", 1e-2), ("mm", 1e-3)],
];
/// Units of time that are sought in those of a model; the year `a` has no fixed ratio to the others.
const TIMES: [&str; 7] = ["s", "ms", "us", "min", "h", "d", "a"];

/// Factor from the unit `found` to the unit `own`; `None` unless both are of one kind.
fn scale(found: &str, own: &str) -> Option<f64> {
    let of = |kind: &&[(&str, f64)]| {
        let size = |unit: &str| kind.iter().find(|(name, _)| *name == unit).map(|(_, size)| *size);
        Some(size(found)? / size(own)?)
    };
    if found == own { Some(1.0) } else { KINDS.iter().find_map(of) }
}

/// Column with the factor to the unit `own` of the model; either unit may be missing.
pub(super) fn wanted(record: &Record, column: usize, own: &str) -> Result<Wanted, RecordError> {
    let found = record.columns()[column].unit.as_deref().filter(|_| !own.is_empty());
    match found.map_or(Some(1.0), |found| scale(found, own)) {
        Some(scale) => Ok(Wanted { column, scale }),
        None => Err(record.unit(column, format!("the unit of the model, [{own}], or one of its kind"))),
    }
}

/// Units of time in those of a model: `h` in `1/h` and `km/h^2`, `s` by itself.
fn times(model: &SystemModel) -> Vec<&'static str> {
    let states = model.states.iter().map(|s| &s.named);
    let inputs = model.known_inputs.iter().map(|i| &i.0).chain(model.unknown_inputs.iter().map(|i| &i.0));
    let others = model.constants.iter().map(|c| &c.0).chain(model.outputs.iter().map(|o| &o.0));
    let all = states.chain(&model.parameters).chain(inputs).chain(others);
    let mut out = Vec::new();
    for unit in all.map(|named| named.unit.as_str()) {
        for time in TIMES {
            let below = unit
                .split('/')
                .skip(1)
                .any(|part| part.split(|c: char| !c.is_ascii_alphabetic()).any(|word| word == time));
            if (unit == time || below) && !out.contains(&time) {
                out.push(time);
            }
        }
    }
    out
}

/// Time column with the factor to the unit of time of the model, if its units have one.
pub(super) fn time(record: &Record, column: usize, model: &SystemModel) -> Result<Wanted, RecordError> {
    let own = times(model);
    let as_it_is = Wanted { column, scale: 1.0 };
    match (record.columns()[column].unit.as_deref(), &own[..]) {
        (None, _) | (_, []) => Ok(as_it_is),
        (Some(found), _) if own.contains(&found) => match own.len() {
            1 => Ok(as_it_is),
            _ => Err(several(record, column, &own)),
        },
        (Some(found), [one]) => match scale(found, one) {
            Some(scale) => Ok(Wanted { column, scale }),
            None => Err(record.unit(column, format!("times in [{one}], as in the units of the model"))),
        },
        _ => Err(several(record, column, &own)),
    }
}

fn several(record: &Record, column: usize, own: &[&str]) -> RecordError {
    record.unit(
        column,
        format!("a header without a unit, since the units of the model have time in {}", own.join(" and ")),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(header: &str) -> Record {
        Record::csv("r.csv", Box::new(std::io::Cursor::new(format!("{header}\n0,1\n")))).expect("a record")
    }

    #[test]
    fn columns_and_models() {
        let of = |found: &str, own: &str| wanted(&record(&format!("t,y [{found}]")), 1, own).map(|w| w.scale);
        assert_eq!((of("mg/l", "mg/l"), of("mg/l", "")), (Ok(1.0), Ok(1.0)));
        assert_eq!(of("mg", "m/s^2"), Ok(STANDARD_GRAVITY * 1e-3));
        assert!((of("deg/h", "rad/s").expect("of one kind") / 4.848_136_811_095e-6 - 1.0).abs() < 1e-12);
        let e = of("V", "rad/s").expect_err("another kind").to_string();
        assert_eq!(
            e,
            "r.csv: line 1, column `y [V]`: expected the unit of the model, [rad/s], or one of its kind"
        );
        let model = |units: &[&str]| SystemModel {
            parameters: units
                .iter()
                .map(|u| obsdeg_core::system::Named { unit: u.to_string(), ..Default::default() })
                .collect(),
            ..SystemModel::default()
        };
        let time = |found: &str, units: &[&str]| {
            super::time(&record(&format!("t [{found}],y")), 0, &model(units)).map(|w| w.scale)
        };
        assert_eq!(time("min", &["1/h", "l/kg"]), Ok(1.0 / 60.0));
        assert_eq!(time("ms", &["count/(m/s^2)", "count/(rad/s)"]), Ok(1e-3));
        assert_eq!((time("a", &["1/a/1000"]), time("d", &["kg"])), (Ok(1.0), Ok(1.0)));
        for (found, units, words) in [
            ("d", &["1/a"][..], "times in [a], as in the units of the model"),
            ("h", &["1/h", "m/s"], "the units of the model have time in h and s"),
        ] {
            let e = time(found, units).expect_err(found).to_string();
            assert!(e.contains(words), "{e}");
        }
    }
}

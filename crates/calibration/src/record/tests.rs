//! Tests of records as texts.

use super::*;

/// Line, numbers and label of a row.
type ReadRow = (u64, Vec<Option<f64>>, String);

fn all(text: &str) -> Result<Vec<ReadRow>, RecordError> {
    let record = Record::csv("r.csv", Box::new(std::io::Cursor::new(text.to_string())))?;
    let t = record
        .wanted(record.find("t").ok_or_else(|| record.missing("`t [s]`"))?, &[("s", 1.0), ("ms", 1e-3)])?;
    let f = record.wanted(record.find("f").ok_or_else(|| record.missing("`f [g]`"))?, &[("g", 1.0)])?;
    let (label, mut out) = (record.find("position"), Vec::new());
    record.read(&[t, f], label, false, |r| {
        out.push((r.line, r.numbers.to_vec(), r.label.to_string()));
        Ok::<(), RecordError>(())
    })?;
    Ok(out)
}

#[test]
fn rows_with_units_gaps_and_comments() {
    let rows = all("\u{feff}# made by hand\nt [ms], f [g] ,position\n500,1.5,p1\n# a gap\n1500,,\n\
        2500.5,-1e-3,p 2\n")
    .expect("rows");
    assert_eq!(rows[0], (3, vec![Some(0.5), Some(1.5)], "p1".to_string()));
    assert_eq!(rows[1], (5, vec![Some(1.5), None], String::new()));
    assert_eq!(rows[2], (6, vec![Some(2.5005), Some(-1e-3)], "p 2".to_string()));
}

/// Semicolons and tabs as separators, decimal commas.
#[test]
fn what_else_loggers_write() {
    for (text, written) in [
        ("t [s];f [g];note\n0;1,5;a\n1;-2e-3;b\n", "columns are separated by semicolons, decimals by commas"),
        ("t [s]\tf [g]\n0\t1.5\n1\t-0,002\n", "columns are separated by tabs"),
        (
            "t [s];f [g]\n\"0\";\"1,5\"\n1,0;-0,002\n",
            "columns are separated by semicolons, decimals by commas",
        ),
    ] {
        let rows = all(text).expect(text);
        assert_eq!(
            rows.iter().map(|r| r.1.clone()).collect::<Vec<_>>(),
            [[Some(0.0), Some(1.5)], [Some(1.0), Some(-0.002)]]
        );
        let record = Record::csv("r.csv", Box::new(std::io::Cursor::new(text))).expect("a record");
        assert_eq!(record.written(), Some(written));
    }
    let e = all("t [s];f [g]\n0;1.234,5\n").expect_err("both").to_string();
    assert!(e.ends_with("line 2, column `f [g]`: expected a number, found `1.234,5`"), "{e}");
}

/// Dates, against seconds by a system's calendar.
#[test]
fn dates_are_unix_seconds() {
    for (text, seconds) in [
        ("1970-01-01T00:00:00Z", 0.0),
        ("2000-02-29T12:00:00Z", 951_825_600.0),
        ("2026-11-23T10:00:00.25+01:00", 1_795_424_400.25),
        ("2026-11-23 09:00", 1_795_424_400.0),
        ("23.11.2026 09:00", 1_795_424_400.0),
        ("23.11.2026 09:00:00,5", 1_795_424_400.5),
        ("1969-12-31T23:59:59.5Z", -0.5),
        ("2100-03-01T00:00:00Z", 4_107_542_400.0),
    ] {
        assert_eq!(unix_seconds(text), Some(seconds), "{text}");
    }
    for text in [
        "2026-11-23",
        "11.23.2026 09:00",
        "23.11.2026.1 09:00",
        "11/23/2026 09:00",
        "2026-02-29T00:00",
        "2026-13-01T00:00",
        "2026-11-23T24:00",
        "x",
        "10:00",
        "2026-11-23T10",
    ] {
        assert_eq!(unix_seconds(text), None, "{text}");
    }
    for cell in ["23.11.26 09:00:00", "11/23/2026 9:00 AM"] {
        let record = Record::csv("r.csv", Box::new(std::io::Cursor::new(format!("t,f [g]\n{cell},1\n"))));
        let e = record.expect("a header").wanted(0, &[("s", 1.0)]).expect_err("refused").to_string();
        assert!(e.ends_with(&format!("or dates such as 2026-11-23 09:00:00.5; found `{cell}`")), "{e}");
    }
    let rows = all("t,f [g]\n2026-11-23T09:00:00Z,1\n2026-11-23T09:00:00.5Z,2\n").expect("rows");
    assert_eq!(rows[1].1, [Some(1_795_424_400.5), Some(2.0)]);
}

/// A header of many columns takes no time that grows with their square.
#[test]
fn many_columns() {
    let names: Vec<String> = (0..100_000).map(|k| format!("c{k}")).collect();
    let text = format!("t [s],f [g],{}\n", names.join(","));
    let record = Record::csv("r.csv", Box::new(std::io::Cursor::new(text))).expect("a record");
    let record = record.named(&Recording::default()).expect("named");
    assert_eq!(record.find("c99999"), Some(100_001));
    assert!(record.missing("`x`").to_string().len() < 1000);
}

/// Names and counts that a scheme gives the columns.
#[test]
fn names_and_counts() {
    let by = |columns: &[(&str, &str)], units: &[(&str, &str)]| {
        let of = |l: &[(&str, &str)]| l.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect();
        Recording { columns: of(columns), units: of(units), ..Recording::default() }
    };
    let read = |by: &Recording| {
        let text = "Time [ms],AccX,g\n500,3,1\n";
        let record = Record::csv("r.csv", Box::new(std::io::Cursor::new(text)))?.named(by)?;
        let of = |name: &str, unit: &str| record.wanted(record.find(name).expect("there"), &[(unit, 10.0)]);
        Ok::<_, RecordError>((of("t", "ms")?, of("fx", "g")?))
    };
    let (t, f) = read(&by(&[("t", "Time"), ("fx", "AccX")], &[("fx", "2.5e-5 g")])).expect("named");
    assert_eq!((t, f), (Wanted { column: 0, scale: 10.0 }, Wanted { column: 1, scale: 2.5e-4 }));
    let message = |by| read(&by).expect_err("wrong").to_string();
    assert_eq!(
        message(by(&[("t", "Zeit")], &[])),
        "r.csv: no column `Zeit`, which record.columns has as `t`; found `Time [ms]`, `AccX`, `g`"
    );
    assert!(message(by(&[("g", "AccX")], &[])).starts_with("r.csv: line 1, column `g`: expected a name"));
    assert_eq!(
        message(by(&[("t", "Time"), ("fx", "AccX")], &[("fx", "much g")])),
        "record.units.fx: found `much g`; expected a unit, or what one count is, as in `2.44e-5 g`"
    );
}

#[test]
fn what_is_wrong_has_its_place() {
    for (text, message) in [
        ("", "the record r.csv is empty; expected a header such as `t [s],position,fx [g],fy [g],fz [g]`"),
        ("t [s],f [g]\n", "r.csv: no rows after the header"),
        (
            "t [s],g [g]\n0,1\n",
            "r.csv: no column `f [g]`; found `t [s]`, `g [g]`; a column of another name is given under \
             [record.columns]",
        ),
        ("t [s],f\n0,1\n", "r.csv: line 1, column `f`: expected a unit, `f [g]`"),
        ("t [h],f [g]\n0,1\n", "r.csv: line 1, column `t [h]`: expected a unit, `t [s]` or `t [ms]`"),
        (
            "t [s],f [g],f [g]\n0,1,1\n",
            "r.csv: line 1, column `f [g]`: expected a name, or a name with its unit as in `fx [g]`, once",
        ),
        (
            "t [s],f [g\n0,1\n",
            "r.csv: line 1, column `f [g`: expected a name, or a name with its unit as in `fx [g]`, once",
        ),
        (
            "t [s],f [g]\n2026-11-23T10:00,1\n",
            "r.csv: line 2, column `t [s]`: expected a number, the time since any moment, found `2026-11-23T10:00`",
        ),
        ("t [s],f [g]\n0,1\n1,abc\n", "r.csv: line 3, column `f [g]`: expected a number, found `abc`"),
        (
            "t [s],f [g]\n0,NaN\n",
            "r.csv: line 2, column `f [g]`: found NaN, expected a finite number (an empty cell is a \
             value that is not there)",
        ),
        (
            "t [ms],f [g]\n100,1\n100,1\n",
            "r.csv: line 3, column `t [ms]`: the time 100 is not after that of the row before, 100; \
             expected times that increase",
        ),
        (
            "t [s],f [g]\n,1\n",
            "r.csv: line 2, column `t [s]`: expected a number, the time since any moment, found ``",
        ),
        ("t [s],f [g]\n0,1\n0.5\n", "r.csv: line 3: 1 cells; expected 2, as in the header"),
        (
            "t [s],f [g]\n0,1\n0,1\n",
            "r.csv: line 3, column `t [s]`: the time 0 is not after that of the row before, 0; expected \
             times that increase",
        ),
    ] {
        assert_eq!(all(text).expect_err(text).to_string(), message);
    }
}

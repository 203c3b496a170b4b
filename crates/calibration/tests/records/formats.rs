//! Formats that loggers write beside CSV with commas: the numbers and the estimates are the same.

use std::sync::Arc;

use obsdeg_calibration::record::Record;
use obsdeg_calibration::{Calibration, Options, calibrate};
use parquet::basic::{Compression, LogicalType, Repetition, TimeUnit, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use crate::round_trip::{conditions, of_csv, scheme, six};
use crate::simulator::{Bench, Sample, csv};

/// Samples rounded to steps of 1e-8 g and 1e-6 s.
fn samples(bench: &Bench) -> Vec<Sample> {
    let round = |x: f64, n: f64| (x * n).round() / n;
    let of = |s: &Sample| Sample { t: round(s.t, 1e6), f: s.f.map(|x| round(x, 1e8)), ..s.clone() };
    bench.record().iter().map(of).collect()
}

/// Parquet file with times as nanoseconds since 1970, and forces as decimals with eight digits.
fn parquet(samples: &[Sample]) -> Vec<u8> {
    let field = |name: &str| {
        let kind = if name == "position" { Physical::BYTE_ARRAY } else { Physical::INT64 };
        let builder = Type::primitive_type_builder(name, kind).with_repetition(Repetition::REQUIRED);
        let builder = match name {
            "position" => builder.with_logical_type(Some(LogicalType::String)),
            "t" => builder.with_logical_type(Some(LogicalType::timestamp(true, TimeUnit::NANOS))),
            _ => {
                builder.with_logical_type(Some(LogicalType::decimal(8, 12))).with_precision(12).with_scale(8)
            }
        };
        Arc::new(builder.build().expect("a field"))
    };
    let names = ["t", "position", "fx [g]", "fy [g]", "fz [g]"];
    let fields = names.iter().map(|n| field(n)).collect();
    let schema = Arc::new(Type::group_type_builder("record").with_fields(fields).build().expect("a schema"));
    let gzip = Compression::GZIP(Default::default());
    let properties = Arc::new(WriterProperties::builder().set_compression(gzip).build());
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, properties).expect("a writer");
    let mut group = writer.next_row_group().expect("a group");
    for name in names {
        let mut column = group.next_column().expect("a column").expect("a column");
        let whole: Vec<i64> = match name {
            "position" => {
                let texts: Vec<ByteArray> = samples.iter().map(|s| s.label.into()).collect();
                column.typed::<ByteArrayType>().write_batch(&texts, None, None).expect("written");
                column.close().expect("closed");
                continue;
            }
            "t" => samples
                .iter()
                .map(|s| 1_795_424_400_000_000_000 + 1000 * (s.t * 1e6).round() as i64)
                .collect(),
            of => {
                let axis = "xyz".find(&of[1..2]).expect("an axis");
                samples.iter().map(|s| (s.f[axis] * 1e8).round() as i64).collect()
            }
        };
        column.typed::<Int64Type>().write_batch(&whole, None, None).expect("written");
        column.close().expect("closed");
    }
    group.close().expect("closed");
    writer.into_inner().expect("closed")
}

fn agree(a: &Calibration, b: &Calibration, what: &str) {
    assert!(b.consistent, "{what}: {:?}", b.findings);
    for (u, v) in a.quantities.iter().zip(&b.quantities) {
        let (x, y, s) = (u.estimate.expect("there"), v.estimate.expect("there"), u.sigma.expect("there"));
        assert!((x - y).abs() < 0.02 * s, "{what}: {} {x} {y} +- {s}", u.name);
    }
}

#[test]
fn other_formats_are_the_same_record() {
    let bench = Bench { seed: 6, slew_deg_s: Some(2.0), ..six() };
    let samples = samples(&bench);
    let text = csv(&samples);
    let right = of_csv(&bench, "F,I,O,S", text.clone()).expect("calibrated");
    let german = text.replace(',', ";").replace('.', ",");
    let tabs = text.replace(',', "\t");
    for (what, text) in [("semicolons", german), ("tabs", tabs)] {
        let c = of_csv(&bench, "F,I,O,S", text).expect("calibrated");
        assert_eq!(c.quantities, right.quantities, "{what}");
        assert_eq!(c.rests_on[0].digest, right.rests_on[0].digest, "{what}");
    }
    // Unix seconds, which leave the beginning open as labels do
    let late: Vec<Sample> =
        samples.iter().map(|s| Sample { t: s.t + 1_795_424_400.0, ..s.clone() }).collect();
    let late = of_csv(&bench, "F,I,O,S", csv(&late)).expect("calibrated");
    let record =
        Record::stream("run.parquet", Box::new(std::io::Cursor::new(parquet(&samples)))).expect("a record");
    let c = calibrate(
        &scheme(&bench, "F,I,O,S"),
        &conditions(&bench),
        vec![record],
        &Options::default(),
        &|_| true,
    )
    .expect("calibrated");
    agree(&late, &c, "parquet");
    // nanoseconds in a column of seconds
    let nanos: Vec<Sample> = samples.iter().map(|s| Sample { t: s.t * 1e9, ..s.clone() }).collect();
    let e = of_csv(&bench, "F,I,O,S", csv(&nanos)).expect_err("nanoseconds").to_string();
    assert!(e.contains("column `t [s]`") && e.contains("as [ns] they agree"), "{e}");
}

/// A pipe that never ends is not read to its end.
#[test]
fn a_pipe_is_bounded() {
    let endless = std::io::Read::chain(std::io::Cursor::new(b"PAR1".to_vec()), std::io::repeat(0));
    let e = Record::stream("pipe", Box::new(endless)).err().expect("refused").to_string();
    assert!(e.contains("more than 256 MiB of Parquet from a pipe"), "{e}");
}

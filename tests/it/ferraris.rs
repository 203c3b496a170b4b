//! A public record of a MEMS unit at six positions, against the result of another program on it.

use crate::program::json;

/// Counts per g of imucal 2.6.0 on the whole session (`FerrarisCalibration`, K_a R_a times 9.81), and its biases in counts.
const IMUCAL: [(&str, f64); 9] = [
    ("kxx", 2045.6541),
    ("kxy", 14.5705),
    ("kxz", -22.8022),
    ("kyx", -16.2166),
    ("kyy", 2039.8560),
    ("kyz", 48.2554),
    ("kzx", 44.9703),
    ("kzy", -22.7178),
    ("kzz", 2106.4340),
];

/// The linear map is that of imucal to a hundredth of a count per g; biases, which it takes from two positions each, within a third of what six allow.
#[test]
fn accelerometers_are_those_of_imucal() {
    let found = json(&[
        "calibrate",
        "--model",
        "examples/ferraris/model.toml",
        "examples/ferraris/record.csv",
        "--starts",
        "1",
        "--format",
        "json",
    ]);
    let of = |name: &str| {
        let all = found["quantities"].as_array().expect("quantities");
        all.iter().find(|q| q["name"] == name).expect("the unknown")["estimate"].as_f64().expect("a number")
    };
    for (name, expected) in IMUCAL {
        assert!((of(name) - expected).abs() < 0.01, "{name}: {}", of(name));
    }
    for (name, expected) in [("bx", -6.02), ("by", -48.29), ("bz", -28.97)] {
        assert!((of(name) - expected).abs() < 8.0, "{name}: {}", of(name));
    }
    assert_eq!(found["consistent"], true);
}

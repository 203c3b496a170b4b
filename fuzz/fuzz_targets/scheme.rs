//! Any text as a scheme file: read and validated, written back and read again as the same, analysed and
//! planned; or refused.
#![no_main]

use libfuzzer_sys::fuzz_target;
use obsdeg_core::analysis::{AnalysisOptions, analyze};
use obsdeg_core::model::scheme_file::{read, write};
use obsdeg_evidence::simulation::{Conditions, Plan};

fuzz_target!(|data: &[u8]| {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let Ok(scheme) = read(text) else { return };
    scheme.validate().expect("what is read is valid");
    let written = write(&scheme);
    let again = read(&written).unwrap_or_else(|e| panic!("{e}\n{written}"));
    assert_eq!(again, scheme, "{written}");
    // small schemes only: time is not what is looked for
    if scheme.positions.len() <= 6 {
        let _ = analyze(&scheme, AnalysisOptions::default(), None);
        let _ = Plan::new(&scheme, &Conditions::of(&scheme));
    }
});

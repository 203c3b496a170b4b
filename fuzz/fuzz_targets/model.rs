//! Any bytes as a model file, as JSON and as a scheme: read and judged, or refused.
#![no_main]

use libfuzzer_sys::fuzz_target;
use obsdeg_core::model::scheme_file;
use obsdeg_core::system::{SystemOptions, analyze_system, json, model_file};

fuzz_target!(|data: &[u8]| {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let options = SystemOptions { solutions: false, order: Some(6), ..SystemOptions::default() };
    for read in [model_file::read(text), json::read(text)] {
        if let Ok(model) = read {
            // small systems only: time is not what is looked for
            if model.states.len() + model.parameters.len() <= 12 {
                let _ = analyze_system(&model, options, None);
            }
        }
    }
    let _ = scheme_file::read(text).map(|scheme| scheme.validate());
});

//! Unpacks the engine of the page from LZMA: browsers can only unpack deflate, whose files are half as large
//! again.
#![cfg(target_arch = "wasm32")]

use std::io::Read;

use lzma_rust2::LzmaReader;
use wasm_bindgen::prelude::wasm_bindgen;

/// Unpacks bytes that were packed with LZMA.
///
/// # Errors
/// Defect of the packed bytes, in words.
#[wasm_bindgen]
pub fn unpack(packed: &[u8]) -> Result<Vec<u8>, String> {
    let mut out = Vec::new();
    LzmaReader::new_mem_limit(packed, u32::MAX, None)
        .and_then(|mut reader| reader.read_to_end(&mut out))
        .map_err(|e| e.to_string())?;
    Ok(out)
}

//! Builds the page: the engine as WebAssembly, packed, with scripts, style and examples in one file.
//!
//! `cargo run -p obsdeg-web [PAGE]`; the default path is `target/workbench.html`.

#[cfg(not(target_arch = "wasm32"))]
mod build;

#[cfg(not(target_arch = "wasm32"))]
fn main() -> std::process::ExitCode {
    let asked = std::env::args_os().nth(1).map(std::path::PathBuf::from);
    match build::page(asked) {
        Ok(done) => {
            #[expect(clippy::print_stdout, reason = "a program")]
            {
                println!("{done}");
            }
            std::process::ExitCode::SUCCESS
        }
        Err(e) => {
            #[expect(clippy::print_stderr, reason = "a program")]
            {
                eprintln!("{e}");
            }
            std::process::ExitCode::FAILURE
        }
    }
}

#[cfg(target_arch = "wasm32")]
fn main() {}

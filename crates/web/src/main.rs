//! Builds the page: the engine as WebAssembly, packed, with scripts, style and examples in one file.
//!
//! `cargo run -p obsdeg-web [--draft] [PAGE]`; the default path is `target/workbench.html`, of a draft
//! `target/draft.html`.

#[cfg(not(target_arch = "wasm32"))]
mod build;
#[cfg(not(target_arch = "wasm32"))]
mod draft;
#[cfg(not(target_arch = "wasm32"))]
mod engine;
#[cfg(not(target_arch = "wasm32"))]
mod link;
#[cfg(not(target_arch = "wasm32"))]
mod tokens;

#[cfg(not(target_arch = "wasm32"))]
#[expect(clippy::print_stdout, clippy::print_stderr, reason = "a program")]
fn main() -> std::process::ExitCode {
    let (draft, asked): (Vec<_>, Vec<_>) = std::env::args_os().skip(1).partition(|a| a == "--draft");
    let asked = asked.into_iter().next().map(std::path::PathBuf::from);
    let done =
        if draft.is_empty() { build::page(asked).map(|done| println!("{done}")) } else { drafted(asked) };
    match done {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("{e}");
            std::process::ExitCode::FAILURE
        }
    }
}

/// Writes a draft and answers its questions until the standard input ends.
#[cfg(not(target_arch = "wasm32"))]
#[expect(clippy::print_stdout, reason = "a program")]
fn drafted(asked: Option<std::path::PathBuf>) -> Result<(), build::BuildError> {
    let io = |reason| build::BuildError::File { path: "127.0.0.1".into(), reason };
    let listener = std::net::TcpListener::bind(("127.0.0.1", 0)).map_err(io)?;
    let address = format!("http://{}", listener.local_addr().map_err(io)?);
    let path = build::draft(asked, &address)?;
    println!("{}: the engine is this program, at {address}, until its input ends", path.display());
    draft::serve(listener);
    Ok(())
}

#[cfg(target_arch = "wasm32")]
fn main() {}

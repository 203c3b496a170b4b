//! A page printed to PDF by a browser of this computer.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::str::FromStr;
use std::sync::{Mutex, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::failure::Failure;

/// Names of browsers that print from the command line, in the order in which they are looked for.
const BROWSERS: [&str; 8] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "msedge",
    "brave-browser",
];
/// Longest time that a browser may take.
const LIMIT: Duration = Duration::from_secs(120);
/// Interval at which the end of the browser is looked for.
const INTERVAL: Duration = Duration::from_millis(20);

/// Maker of a PDF, as `--pdf-by` has it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum PdfBy {
    /// First browser of [`BROWSERS`] that is found.
    Browser,
    /// Typesetter in this program (cargo feature `pdf`).
    Typesetter,
    /// Browser at this path.
    Program(PathBuf),
}

impl FromStr for PdfBy {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(match text {
            "browser" => Self::Browser,
            "typesetter" => Self::Typesetter,
            path => Self::Program(path.into()),
        })
    }
}

/// Maker of a PDF that is there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum PdfPrinter {
    Browser(PathBuf),
    Typesetter,
}

impl PdfPrinter {
    /// Finds what is asked for; without a request a browser, else the typesetter.
    ///
    /// # Errors
    /// [`Failure`] where that is not there, with what is expected.
    pub(crate) fn find(asked: Option<&PdfBy>) -> Result<Self, Failure> {
        let typesetter = obsdeg_report::HAS_PDF.then_some(Self::Typesetter);
        let browser = || BROWSERS.iter().find_map(on_path).map(Self::Browser);
        let names = || BROWSERS.join(", ");
        match asked {
            None => browser().or(typesetter).ok_or_else(|| {
                Failure::input(format!(
                    "no PDF: no browser was found, and this program was built without the typesetter; expected one \
                     of {} on PATH, a browser by --pdf-by PATH, a build with `--features pdf`, or HTML \
                     (-o review.html)",
                    names()
                ))
            }),
            Some(PdfBy::Browser) => browser().ok_or_else(|| {
                let names = names();
                Failure::input(format!("--pdf-by browser: none was found; expected one of {names}"))
            }),
            Some(PdfBy::Typesetter) => typesetter.ok_or_else(|| {
                Failure::input(
                    "--pdf-by typesetter: this program was built without it; expected a build with `--features pdf`"
                        .into(),
                )
            }),
            Some(PdfBy::Program(path)) => match on_path(path) {
                Some(path) => Ok(Self::Browser(path)),
                None => Err(Failure::input(format!(
                    "--pdf-by {}: no such program; expected browser, typesetter, or the path of a browser",
                    path.display()
                ))),
            },
        }
    }
}

/// Program with this name on PATH, or at this path.
fn on_path(name: impl AsRef<Path>) -> Option<PathBuf> {
    let name = name.as_ref();
    if name.components().count() > 1 {
        return name.is_file().then(|| name.to_path_buf());
    }
    let folders = std::env::var_os("PATH")?;
    let endings: &[&str] = if cfg!(windows) { &["", ".exe"] } else { &[""] };
    std::env::split_paths(&folders).find_map(|folder| {
        let files = endings.iter().map(|ending| folder.join(format!("{}{ending}", name.display())));
        files.into_iter().find(|file| file.is_file())
    })
}

/// Folder of the print that goes on, and the process group of its browser.
static RUNNING: Mutex<Option<(PathBuf, Option<u32>)>> = Mutex::new(None);

/// Ends the browser of a print that goes on, with all its processes, and removes the folder.
pub(crate) fn abandon() {
    let running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner).take();
    let Some((folder, browser)) = running else { return };
    browser.into_iter().for_each(end_group);
    for _ in 0..10 {
        // its processes may still write
        if fs::remove_dir_all(&folder).is_ok() || !folder.exists() {
            return;
        }
        sleep(INTERVAL);
    }
}

#[cfg(unix)]
fn end_group(leader: u32) {
    use rustix::process::{Pid, Signal, kill_process_group};
    if let Some(group) = i32::try_from(leader).ok().and_then(Pid::from_raw) {
        // it may have ended meanwhile
        let _ = kill_process_group(group, Signal::KILL);
    }
}

#[cfg(not(unix))]
fn end_group(_: u32) {}

/// Print that goes on, abandoned at its end.
struct RunningPrint;

impl Drop for RunningPrint {
    fn drop(&mut self) {
        abandon();
    }
}

/// The page as PDF, printed by `browser`. Dates and identifiers that a browser stamps are replaced by
/// constants of the same length: the same page gives the same bytes.
///
/// # Errors
/// [`Failure`] of a browser that does not start, does not end within two minutes, or prints nothing.
pub(crate) fn print(browser: &Path, page: &[u8]) -> Result<Vec<u8>, Failure> {
    within(browser, page, LIMIT)
        .map_err(|why| Failure::input(format!("{} printed no PDF: {why}", browser.display())))
}

/// Prints within a time limit; the error is the reason.
fn within(browser: &Path, page: &[u8], limit: Duration) -> Result<Vec<u8>, String> {
    let folder = private_folder().map_err(|e| e.to_string())?;
    *RUNNING.lock().unwrap_or_else(PoisonError::into_inner) = Some((folder.clone(), None));
    let _going = RunningPrint;
    let [html, pdf, profile] = ["review.html", "review.pdf", "profile"].map(|name| folder.join(name));
    fs::write(&html, page).map_err(|e| e.to_string())?;
    let mut command = Command::new(browser);
    command.args([
        "--headless",
        "--disable-gpu",
        "--no-first-run",
        "--disable-extensions",
        "--no-pdf-header-footer",
    ]);
    if is_root() {
        // a browser refuses to run as root within its sandbox
        command.arg("--no-sandbox");
    }
    command.arg(format!("--user-data-dir={}", profile.display()));
    command.arg(format!("--print-to-pdf={}", pdf.display()));
    command.arg(address(&html));
    // what it leaves when it is ended is removed with the folder
    command.env("TMPDIR", &folder);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let child = command.spawn().map_err(|e| e.to_string())?;
    *RUNNING.lock().unwrap_or_else(PoisonError::into_inner) = Some((folder, Some(child.id())));
    let status = ended(child, limit)?;
    let mut bytes = fs::read(&pdf).map_err(|_| format!("it ended with {status}"))?;
    if !bytes.starts_with(b"%PDF-") {
        return Err("what it wrote is no PDF".into());
    }
    without_stamps(&mut bytes);
    Ok(bytes)
}

/// New folder for a print that only its user can read.
fn private_folder() -> std::io::Result<PathBuf> {
    let mut builder = fs::DirBuilder::new();
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    let mut number = 0;
    loop {
        let name = format!("obsdeg-print-{}-{number}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        match builder.create(&folder) {
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => number += 1,
            done => return done.map(|()| folder),
        }
    }
}

/// Address of a file for a browser.
fn address(file: &Path) -> String {
    let path = file.display().to_string();
    let escapes = [("%", "%25"), ("#", "%23"), ("?", "%3F"), (" ", "%20")];
    let path = escapes.iter().fold(path, |path, (sign, escape)| path.replace(sign, escape));
    format!("file://{path}")
}

/// Waits for the end of a process, at most `limit`.
fn ended(mut child: Child, limit: Duration) -> Result<ExitStatus, String> {
    let begun = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return Ok(status),
            Ok(None) if begun.elapsed() < limit => sleep(INTERVAL),
            Ok(None) => {
                // it may have ended meanwhile
                let _ = child.kill();
                let _ = child.wait();
                return Err(format!("it did not end within {} s", limit.as_secs_f64()));
            }
            Err(e) => return Err(e.to_string()),
        }
    }
}

#[cfg(unix)]
fn is_root() -> bool {
    rustix::process::geteuid().is_root()
}

#[cfg(not(unix))]
fn is_root() -> bool {
    false
}

/// Replaces the digits of dates by zeros: places of objects stay.
fn without_stamps(pdf: &mut [u8]) {
    for key in [&b"/CreationDate ("[..], b"/ModDate ("] {
        let mut from = 0;
        while let Some(at) = pdf[from..].windows(key.len()).position(|w| w == key) {
            from += at + key.len();
            let date = pdf[from..].iter_mut().take_while(|b| **b != b')');
            date.filter(|b| b.is_ascii_digit()).for_each(|b| *b = b'0');
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_become_zeros_of_the_same_length() {
        let mut pdf = b"<</CreationDate (D:20261127183000+01'00')\n/ModDate (D:2026)/N 7>>".to_vec();
        let length = pdf.len();
        without_stamps(&mut pdf);
        assert_eq!(pdf, b"<</CreationDate (D:00000000000000+00'00')\n/ModDate (D:0000)/N 7>>");
        assert_eq!(pdf.len(), length);
    }

    /// Programs that do not print: a failure with the reason, within the limit, and nothing is left.
    #[cfg(unix)]
    #[test]
    fn a_browser_that_fails_is_named() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().expect("a folder");
        let script = |text: &str| {
            let file = folder.path().join("browser");
            fs::write(&file, format!("#!/bin/sh\n{text}\n")).expect("written");
            fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).expect("a program");
            file
        };
        let to = "for a in \"$@\"; do case $a in --print-to-pdf=*) f=${a#*=};; esac; done; ";
        for (text, said) in [
            ("sleep 60".to_string(), "did not end within 0.3 s"),
            ("exit 3".into(), "exit status: 3"),
            (format!("{to} echo page > \"$f\""), "no PDF"),
        ] {
            let failed = within(&script(&text), b"<p>", Duration::from_millis(300)).expect_err("no PDF");
            assert!(failed.contains(said), "{failed}");
        }
        let browser = script(&format!("{to} printf '%%PDF-1.4 /ModDate (D:2026)' > \"$f\""));
        assert_eq!(within(&browser, b"<p>", LIMIT).expect("a PDF"), b"%PDF-1.4 /ModDate (D:0000)");
        let left = std::env::temp_dir().join(format!("obsdeg-print-{}-0", std::process::id()));
        assert!(!left.exists());
        assert_eq!(address(Path::new("/a b/#1%.html")), "file:///a%20b/%231%25.html");
    }
}

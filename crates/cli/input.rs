//! Input files: read up to a limit, whatever they are.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

use crate::failure::Failure;

/// Largest input file, in bytes.
const MAX_FILE: u64 = 50_000_000;

/// The text of a file; `what` it is stands in the errors. Pipes and devices are read too (`/dev/stdin`, `<(command)`), up to the same
/// limit; a pipe that nobody writes to is refused.
pub(crate) fn read_text(path: &Path, what: &str) -> std::result::Result<String, Failure> {
    let name = path.display();
    let wrong = |e: Error| Failure::input(format!("cannot read the {what} file {name}: {e}"));
    let too_large = |size: &str| {
        Failure::input(format!("the {what} file {name} has {size} bytes; expected at most {MAX_FILE}"))
    };
    let file = open(path).map_err(wrong)?;
    let metadata = file.metadata().map_err(wrong)?;
    if metadata.is_file() && metadata.len() > MAX_FILE {
        return Err(too_large(&metadata.len().to_string()));
    }
    let mut bytes = Vec::new();
    let read = file.take(MAX_FILE + 1).read_to_end(&mut bytes).map_err(wrong)?;
    if read as u64 > MAX_FILE {
        return Err(too_large(&format!("more than {MAX_FILE}")));
    }
    if read == 0 && !metadata.is_file() {
        return Err(wrong(Error::new(ErrorKind::UnexpectedEof, "nothing comes out of it")));
    }
    String::from_utf8(bytes).map_err(|e| wrong(Error::new(ErrorKind::InvalidData, e.utf8_error())))
}

/// Opens without waiting for somebody to write into a pipe; reading waits for whoever has it open.
#[cfg(unix)]
fn open(path: &Path) -> Result<File> {
    use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
    use std::os::unix::fs::OpenOptionsExt;
    let file = File::options().read(true).custom_flags(OFlags::NONBLOCK.bits() as i32).open(path)?;
    fcntl_setfl(&file, fcntl_getfl(&file)? - OFlags::NONBLOCK)?;
    Ok(file)
}

#[cfg(not(unix))]
fn open(path: &Path) -> Result<File> {
    File::open(path)
}

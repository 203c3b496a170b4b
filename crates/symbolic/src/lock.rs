//! The lock of the symbolic engine: one process per user may hold it.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Error, ErrorKind, Result};
use std::path::Path;

/// Opens the lock file without locking it, and creates it if needed. It never follows a symbolic link
/// and accepts only a regular file of this user: in a folder for all users, another user may have taken
/// the name.
///
/// # Errors
/// Errors of the system, or the fault of the file.
pub fn open(path: &Path) -> Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        // a pipe opens without waiting and is then refused
        let flags = rustix::fs::OFlags::NOFOLLOW | rustix::fs::OFlags::NONBLOCK;
        options.mode(0o600).custom_flags(flags.bits() as i32);
    }
    let file = options.open(path)?;
    let metadata = file.metadata()?;
    if !metadata.is_file() {
        return Err(Error::new(ErrorKind::InvalidInput, "it is no regular file"));
    }
    #[cfg(unix)]
    if std::os::unix::fs::MetadataExt::uid(&metadata) != rustix::process::geteuid().as_raw() {
        return Err(Error::new(ErrorKind::PermissionDenied, "it belongs to another user"));
    }
    Ok(file)
}

/// Waits for the lock without a time limit; calls `waiting` first if another process holds it. The lock
/// lasts until the file is closed: the system does that at the end of the process in any case.
///
/// # Errors
/// Errors of the system.
pub fn wait(file: &File, waiting: impl FnOnce() -> Result<()>) -> Result<()> {
    match file.try_lock() {
        Ok(()) => return Ok(()),
        Err(TryLockError::Error(e)) => return Err(e),
        Err(TryLockError::WouldBlock) => waiting()?,
    }
    loop {
        match file.lock() {
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            other => return other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_at_a_time() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("lock");
        let (first, second) = (open(&path).expect("created"), open(&path).expect("opened"));
        wait(&first, || panic!("nobody holds it")).expect("locked");
        let refused = wait(&second, || Err(Error::other("it is held")));
        assert_eq!(refused.expect_err("held").to_string(), "it is held");
        drop(first);
        wait(&second, || panic!("nobody holds it")).expect("locked");
    }

    #[cfg(unix)]
    #[test]
    fn what_is_no_file_of_this_user_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("folder")).expect("made");
        assert!(open(&at("folder")).is_err());
        // through a link no file is created or opened
        std::os::unix::fs::symlink(at("target"), at("link")).expect("made");
        assert!(open(&at("link")).is_err() && !at("target").exists());
        std::fs::write(at("target"), "").expect("written");
        assert!(open(&at("link")).is_err());
        // a pipe without a writer does not block
        let made = std::process::Command::new("mkfifo").arg(at("pipe")).status().expect("mkfifo");
        assert!(made.success());
        assert_eq!(open(&at("pipe")).expect_err("a pipe").to_string(), "it is no regular file");
        // root may open files of others
        if rustix::process::geteuid().is_root() {
            std::os::unix::fs::chown(at("target"), Some(12345), None).expect("given away");
            assert_eq!(
                open(&at("target")).expect_err("of another").to_string(),
                "it belongs to another user"
            );
        }
    }
}

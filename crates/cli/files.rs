//! Files are put in place completely or not at all, and replace regular files only.
//!
//! New files are written into a folder beside their destination, `.obsdeg-NAME-PID-N`, and moved from there.
//! The process that uses the folder holds a lock on the file `lock` in it. The system releases the lock when
//! the process ends, however it ends. A folder whose lock is free was therefore left by a process that was
//! killed: the next run that writes NAME removes it, and nothing else.

use std::fs::{self, File, TryLockError};
use std::io::{Error, ErrorKind, Result, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Folder for new files; locked while files are put in place, so that an interrupt waits for the end.
static STAGING: Mutex<Option<PathBuf>> = Mutex::new(None);

const LOCK: &str = "lock";

fn staging() -> MutexGuard<'static, Option<PathBuf>> {
    STAGING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Waits until no file is being put in place and removes the folder of new files: the program is about to
/// end. The lock is kept, so later attempts to write wait until the process ends.
pub(crate) fn abandon() {
    let mut held = staging();
    if let Some(folder) = held.take() {
        // the next run removes a folder that cannot be removed now
        let _ = fs::remove_dir_all(folder);
    }
    std::mem::forget(held);
}

/// Refuses a file larger than the limit of the system (`ulimit -f`). A write beyond it sends a signal that
/// ends the program and leaves the folder behind.
fn within_limit(bytes: &[u8]) -> Result<()> {
    #[cfg(unix)]
    {
        use rustix::process::{Resource, getrlimit};
        if let Some(limit) = getrlimit(Resource::Fsize).current.filter(|limit| bytes.len() as u64 > *limit) {
            let message =
                format!("{} bytes; the system allows {limit} bytes of a file (ulimit -f)", bytes.len());
            return Err(Error::new(ErrorKind::FileTooLarge, message));
        }
    }
    Ok(())
}

/// Path of the file that is written: symbolic links are followed to the file behind them.
///
/// # Errors
/// Paths of anything but a regular file: these are neither written to nor replaced.
pub(crate) fn destination(path: &Path) -> Result<PathBuf> {
    let refuse =
        |found: &str| Err(Error::new(ErrorKind::InvalidInput, format!("it is {found}; expected a file")));
    match fs::metadata(path) {
        Ok(found) if found.is_file() => fs::canonicalize(path),
        Ok(found) => refuse(kind(found.file_type())),
        Err(e) if e.kind() == ErrorKind::NotFound => match fs::symlink_metadata(path) {
            Ok(_) => refuse("a symbolic link to nothing"),
            Err(_) => Ok(path.to_path_buf()),
        },
        Err(e) => Err(e),
    }
}

/// Folder that contains the file.
pub(crate) fn folder(file: &Path) -> &Path {
    file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Name of a file type, for messages.
pub(crate) fn kind(found: fs::FileType) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if found.is_fifo() {
            return "a pipe";
        }
        if found.is_socket() {
            return "a socket";
        }
        if found.is_block_device() || found.is_char_device() {
            return "a device";
        }
    }
    if found.is_dir() { "a folder" } else { "no regular file" }
}

/// Writes files, then moves them in place in their order. `target` is the path that the user named: a file,
/// or a folder of these files. Replaced files keep their permissions; new files have the usual ones.
///
/// # Errors
/// The file that could not be written. No file is in place then, unless moving failed.
pub(crate) fn place(target: &Path, files: &[(PathBuf, &[u8])]) -> std::result::Result<(), (PathBuf, Error)> {
    let at = |path: &Path| {
        let path = path.to_path_buf();
        move |e: Error| (path, e)
    };
    let ends: Vec<PathBuf> = files
        .iter()
        .map(|(path, _)| destination(path).map_err(at(path)))
        .collect::<std::result::Result<_, _>>()?;
    for (path, bytes) in files {
        within_limit(bytes).map_err(at(path))?;
    }
    // the folder lies where links lead, so that moving stays within one file system
    let beside = fs::canonicalize(target).unwrap_or_else(|_| target.to_path_buf());
    let new = Staging::beside(&beside).map_err(at(target))?;
    for (i, ((path, bytes), end)) in files.iter().zip(&ends).enumerate() {
        new.write(i, bytes, end).map_err(at(path))?;
    }
    let placing = staging();
    for (i, ((path, _), end)) in files.iter().zip(&ends).enumerate() {
        if let Some(folder) = end.parent().filter(|f| !f.as_os_str().is_empty()) {
            fs::create_dir_all(folder).map_err(at(path))?;
        }
        fs::rename(new.folder.join(i.to_string()), end).map_err(at(path))?;
    }
    drop(placing);
    Ok(())
}

/// A folder beside a destination, removed when it is dropped.
struct Staging {
    folder: PathBuf,
    /// Lock that marks the folder as in use.
    _lock: File,
}

impl Staging {
    /// Makes a new folder, after removing the folders that killed runs left.
    fn beside(target: &Path) -> Result<Self> {
        let parent = folder(target);
        let prefix = prefix(target);
        remove_left_over(parent, &prefix);
        let mut n = 0;
        loop {
            let folder = parent.join(format!("{prefix}{}-{n}", process::id()));
            n += 1;
            let mut builder = fs::DirBuilder::new();
            #[cfg(unix)]
            std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
            // the folder is registered as soon as it exists, so that an interrupt finds it
            let mut held = staging();
            match builder.create(&folder) {
                Err(e) if e.kind() == ErrorKind::AlreadyExists => continue,
                made => made?,
            }
            *held = Some(folder.clone());
            // before the lock is taken, another run may remove the folder as left over
            let lock = match File::create_new(folder.join(LOCK)) {
                Err(e) if e.kind() == ErrorKind::NotFound => continue,
                lock => lock?,
            };
            drop(held);
            match lock.try_lock() {
                Err(TryLockError::WouldBlock) => continue,
                // a file system without locks: other runs do not remove the folder either
                Ok(()) | Err(TryLockError::Error(_)) => {}
            }
            if folder.join(LOCK).exists() {
                return Ok(Self { folder, _lock: lock });
            }
        }
    }

    /// Writes file number `i`, which will replace `end`.
    fn write(&self, i: usize, bytes: &[u8], end: &Path) -> Result<()> {
        // the guard keeps an interrupt from removing the folder during the write
        let held = staging();
        let mut file = File::create_new(self.folder.join(i.to_string()))?;
        drop(held);
        file.write_all(bytes)?;
        if let Ok(replaced) = fs::metadata(end) {
            file.set_permissions(replaced.permissions())?;
        }
        file.sync_all()
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        let mut held = staging();
        // the next run removes a folder that cannot be removed now
        let _ = fs::remove_dir_all(&self.folder);
        *held = None;
    }
}

/// Beginning of the names of the folders beside a destination.
fn prefix(target: &Path) -> String {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    // names have at most 255 bytes
    format!(".obsdeg-{}-", name.chars().take(40).collect::<String>())
}

/// Removes folders named `prefix` and two numbers, unless a process holds their lock.
fn remove_left_over(parent: &Path, prefix: &str) {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let own = name.strip_prefix(prefix).and_then(|rest| rest.split_once('-'));
        if !own.is_some_and(|(process, n)| is_number(process) && is_number(n)) {
            continue;
        }
        match File::open(entry.path().join(LOCK)) {
            // a folder that cannot be removed stays
            Ok(lock) if lock.try_lock().is_ok() => drop(fs::remove_dir_all(entry.path())),
            Err(e) if e.kind() == ErrorKind::NotFound => drop(fs::remove_dir(entry.path())),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder").flatten();
        let mut out: Vec<String> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        out.sort();
        out
    }

    /// A folder as a killed run leaves it, with the file of its lock.
    fn left(folder: &Path, name: &str) -> File {
        fs::create_dir(folder.join(name)).expect("made");
        fs::write(folder.join(name).join("0"), "half").expect("written");
        File::create_new(folder.join(name).join(LOCK)).expect("made")
    }

    #[test]
    fn only_what_a_dead_run_for_the_same_file_left_is_removed() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        for name in
            [".obsdeg-a.json-11-0", ".obsdeg-a.json-12-7", ".obsdeg-b.json-11-0", ".obsdeg-a.json-x-0"]
        {
            left(folder.path(), name);
        }
        // state between the creation of a folder and of its lock
        fs::create_dir(at(".obsdeg-a.json-13-0")).expect("made");
        let live = left(folder.path(), ".obsdeg-a.json-14-0");
        live.try_lock().expect("locked");
        place(&at("a.json"), &[(at("a.json"), b"text")]).expect("written");
        assert_eq!(
            names(folder.path()),
            [".obsdeg-a.json-14-0", ".obsdeg-a.json-x-0", ".obsdeg-b.json-11-0", "a.json"]
        );
        assert_eq!(fs::read(at("a.json")).expect("readable"), b"text");
        drop(live);
        place(&at("a.json"), &[(at("a.json"), b"other")]).expect("written");
        assert_eq!(names(folder.path()), [".obsdeg-a.json-x-0", ".obsdeg-b.json-11-0", "a.json"]);
        assert_eq!(fs::read(at("a.json")).expect("readable"), b"other");
    }

    #[test]
    fn several_files_or_none() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        fs::create_dir_all(at("run/b")).expect("made");
        let files = [(at("run/a"), &b"a"[..]), (at("run/b"), &b"b"[..])];
        let (path, e) = place(&at("run"), &files).expect_err("a folder in the way");
        assert_eq!((path, e.to_string()), (at("run/b"), "it is a folder; expected a file".into()));
        assert_eq!(names(folder.path()), ["run"]);
        assert_eq!(names(&at("run")), ["b"]);
        place(&at("new"), &[(at("new/a"), &b"a"[..]), (at("new/b"), &b"b"[..])]).expect("written");
        assert_eq!(names(&at("new")), ["a", "b"]);
    }
}

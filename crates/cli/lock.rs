//! The lock file of the symbolic engine: one per user.

use std::path::{Path, PathBuf};

/// Path of the lock file: in the runtime folder of the user, else in the temporary folder under the user's
/// number.
pub(crate) fn symbolic_lock_file() -> PathBuf {
    let runtime = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from);
    match runtime.filter(|folder| folder.is_absolute() && is_own(folder)) {
        Some(folder) => folder.join("obsdeg-symbolic.lock"),
        None => std::env::temp_dir().join(format!("obsdeg-symbolic-{}.lock", user())),
    }
}

#[cfg(unix)]
fn user() -> String {
    rustix::process::geteuid().as_raw().to_string()
}

#[cfg(unix)]
fn is_own(folder: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    std::fs::metadata(folder).is_ok_and(|m| m.is_dir() && m.uid() == rustix::process::geteuid().as_raw())
}

#[cfg(not(unix))]
fn user() -> String {
    let user = std::env::var("USERNAME").unwrap_or_default();
    user.chars().filter(|c| c.is_alphanumeric() || *c == '-').collect()
}

#[cfg(not(unix))]
fn is_own(folder: &Path) -> bool {
    folder.is_dir()
}

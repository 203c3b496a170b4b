//! The lock file of the symbolic engine: one per user.

use std::path::PathBuf;

/// In the runtime folder of the user, else in the temporary folder under the user's name.
pub(crate) fn symbolic_lock_file() -> PathBuf {
    match std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from).filter(|p| p.is_dir()) {
        Some(folder) => folder.join("obsdeg-symbolic.lock"),
        None => {
            let user = std::env::var("USER").or_else(|_| std::env::var("USERNAME")).unwrap_or_default();
            let user: String = user.chars().filter(|c| c.is_alphanumeric() || *c == '-').collect();
            std::env::temp_dir().join(format!("obsdeg-symbolic-{user}.lock"))
        }
    }
}

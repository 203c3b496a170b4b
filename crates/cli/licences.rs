//! `obsdeg licences`: third-party parts of this build, their licences, and the texts of these.

use clap::Args;

use crate::failure::Failure;
use crate::output;
use crate::third_party::ThirdParty;

const AFTER_HELP: &str = "\
Examples:
  obsdeg licences
  obsdeg licences nalgebra uPlot
  obsdeg licences --texts > THIRD-PARTY.txt

Versions are those that the release was built and tested with (Cargo.lock).";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Arguments {
    /// Packages whose texts are printed; without any, a list of all packages
    #[arg(value_name = "PACKAGE")]
    packages: Vec<String>,

    /// Print the texts of all licences below the list
    #[arg(long, conflicts_with = "packages")]
    texts: bool,
}

/// Compressed table of third-party packages of all builds.
const TABLE: &[u8] = include_bytes!("../../licenses/third-party.z");

/// Parts of this build, as the table names them.
const PARTS: &[&str] = match (cfg!(feature = "symbolica"), cfg!(feature = "pdf")) {
    (false, false) => &["program"],
    (true, false) => &["program", "symbolica"],
    (false, true) => &["program", "pdf"],
    (true, true) => &["program", "symbolica", "pdf"],
};

pub(crate) fn run(a: &Arguments) -> Result<(), Failure> {
    let unreadable = |e: String| Failure::internal(format!("the table of licences is damaged: {e}"));
    let json = miniz_oxide::inflate::decompress_to_vec_zlib(TABLE).map_err(|e| unreadable(e.to_string()))?;
    let table: ThirdParty = serde_json::from_slice(&json).map_err(|e| unreadable(e.to_string()))?;
    let platform = format!("{}-{}", std::env::consts::OS, std::env::consts::ARCH);
    let table = table.of(PARTS, &platform);
    let unknown = |name: &&String| table.packages.iter().all(|p| p.name != **name);
    if let Some(name) = a.packages.iter().find(unknown) {
        return Err(Failure::input(format!(
            "this build holds no package `{name}`; expected one of the {} names in the list of `obsdeg licences`",
            table.packages.len()
        )));
    }
    if !a.packages.is_empty() {
        return output::print(table.words(&a.packages).as_bytes());
    }
    let mut text = format!(
        "obsdeg {} is under MIT or Apache-2.0, as you like. This build holds {} packages of others:\n\n{}\n",
        env!("CARGO_PKG_VERSION"),
        table.packages.len(),
        table.list()
    );
    match a.texts {
        true => text += &table.words(&[]),
        false => text += "`obsdeg licences PACKAGE` prints the texts of a package, --texts those of all.\n",
    }
    output::print(text.as_bytes())
}

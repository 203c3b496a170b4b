//! Third-party packages of a build, their licences, and the texts of these, each once. The table is
//! `licenses/third-party.z` (JSON, deflated). `tests/it/licences.rs` writes it from the dependency graphs of
//! all builds and includes this file.

use serde::{Deserialize, Serialize};

/// Packages and licence texts of all builds.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ThirdParty {
    /// Packages by name and version.
    pub(crate) packages: Vec<Package>,
    /// Texts of licences and notices; `Package::texts` counts from 0.
    pub(crate) texts: Vec<String>,
}

/// A crate, font or script in some build.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Package {
    pub(crate) name: String,
    /// Empty if the package has no version of its own.
    pub(crate) version: String,
    /// SPDX expression.
    pub(crate) licence: String,
    /// Address of the source.
    pub(crate) source: String,
    /// Builds that contain it: program, symbolica (the program with that feature), pdf (likewise), wheel,
    /// workbench.
    pub(crate) builds: Vec<String>,
    /// Operating systems and architectures of the package, as `linux-x86_64`; empty if it is in the builds of
    /// all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) platforms: Vec<String>,
    /// Indices of its texts in `ThirdParty::texts`.
    pub(crate) texts: Vec<usize>,
}

/// Platforms that the table distinguishes; on any other all packages of a build are listed.
pub(crate) const PLATFORMS: [&str; 6] =
    ["linux-x86_64", "linux-aarch64", "macos-x86_64", "macos-aarch64", "windows-x86_64", "windows-aarch64"];

impl ThirdParty {
    /// Packages of a build on a platform, and their texts. `builds` names the parts of the build.
    pub(crate) fn of(&self, builds: &[&str], platform: &str) -> ThirdParty {
        let here = |p: &&Package| {
            p.builds.iter().any(|b| builds.contains(&b.as_str()))
                && (p.platforms.is_empty()
                    || !PLATFORMS.contains(&platform)
                    || p.platforms.iter().any(|x| x == platform))
        };
        let mut out = ThirdParty::default();
        for package in self.packages.iter().filter(here) {
            let mut package = package.clone();
            for text in &mut package.texts {
                let known = out.texts.iter().position(|t| *t == self.texts[*text]);
                *text = known.unwrap_or_else(|| {
                    out.texts.push(self.texts[*text].clone());
                    out.texts.len() - 1
                });
            }
            out.packages.push(package);
        }
        out
    }

    /// Table of the packages, one line each.
    pub(crate) fn list(&self) -> String {
        let width = |of: fn(&Package) -> &str| {
            self.packages.iter().map(|p| of(p).chars().count()).max().unwrap_or_default()
        };
        let (name, version, licence) =
            (width(|p| p.name.as_str()), width(|p| p.version.as_str()), width(|p| p.licence.as_str()));
        let mut out = String::new();
        for p in &self.packages {
            let line =
                format!("{:name$}  {:version$}  {:licence$}  {}", p.name, p.version, p.licence, p.source);
            out += line.trim_end();
            if !p.platforms.is_empty() {
                out += &format!(" (only in builds for {})", p.platforms.join(", "));
            }
            out.push('\n');
        }
        out
    }

    /// Licence texts, each below the packages it applies to. `names` selects packages; empty selects all.
    pub(crate) fn words(&self, names: &[String]) -> String {
        let mut out = String::new();
        for (index, text) in self.texts.iter().enumerate() {
            let of = self.packages.iter().filter(|p| p.texts.contains(&index));
            let of: Vec<&Package> = of.collect();
            if !names.is_empty() && !of.iter().any(|p| names.contains(&p.name)) {
                continue;
            }
            let of: Vec<String> =
                of.iter().map(|p| format!("{} {}", p.name, p.version).trim_end().to_string()).collect();
            out += &format!("{}\n{}\n\n{}\n\n", "=".repeat(80), wrapped(&of.join(", ")), text.trim_end());
        }
        out
    }
}

/// Text broken at spaces into lines of at most 80 characters.
fn wrapped(text: &str) -> String {
    let mut out = String::new();
    let mut length = 0;
    for word in text.split(' ') {
        let long = length + 1 + word.chars().count();
        if length > 0 && long > 80 {
            out.push('\n');
            length = 0;
        } else if length > 0 {
            out.push(' ');
            length += 1;
        }
        out += word;
        length += word.chars().count();
    }
    out
}

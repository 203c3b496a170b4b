//! Schemes shared by several tests.

use obsdeg_core::analysis::{Analysis, AnalysisOptions, analyze};
use obsdeg_core::model::{Carry, Scheme, parse_attitude};

/// Six attitudes in general position.
pub(crate) const S6: [&str; 6] =
    ["10,25,40", "130,-50,70", "-95,33,-160", "60,80,15", "-20,-70,110", "170,15,-75"];

pub(crate) fn scheme(attitudes: &[&str], carry: Carry) -> Scheme {
    Scheme { carry, ..Scheme::of_angles(attitudes.iter().map(|a| parse_attitude(a).expect("an attitude"))) }
}

/// The two positions of the paper.
pub(crate) fn paper(carry: Carry) -> Scheme {
    scheme(&["0,0,0", "180,0,0"], carry)
}

/// Verdicts without solutions.
pub(crate) fn judged(scheme: &Scheme) -> Analysis {
    analyze(scheme, AnalysisOptions { solutions: false, ..AnalysisOptions::default() }, None)
        .expect("analysed")
}

//! Symbols of a review, with the equations of the paper in which they occur.

use std::collections::BTreeSet;

use obsdeg_core::model::{Carry, ErrorSource, Term, Unknowns};
use obsdeg_design::review::DesignReview;

use crate::document::{DocumentBlock, left};

/// Symbols of schemes: symbol, meaning, unit, and place in the paper (J. NUDT 39(1), 2017,
/// 1001-2486(2017)01-040-06).
const SCHEMES: [[&str; 4]; 15] = [
    [
        "n, c, p",
        "geographic axes North, Up, East; computed and true platform axes: C_c^p = I - [psi x]",
        "-",
        "(1)",
    ],
    [
        "psi",
        "misalignment of the computed platform from the true one; psi_x, psi_y, psi_z along the axes that \
         the carry names",
        "rad; deg in tables",
        "(1), (2)",
    ],
    ["eps", "drift of the platform, along the axes of p", "rad/s; deg/h in tables", "(3), (4)"],
    ["C_c^n", "attitude: passive rotations by alpha, beta, gamma about x, y, z", "-", "(19)"],
    [
        "g^c",
        "gravity in platform axes; in n it is (0, -1, 0), and the specific force is -g",
        "g",
        "(5), (20)",
    ],
    ["wN, wU", "earth rate to the North and up: w_ie cos and w_ie sin of the latitude", "rad/s", "(2)"],
    [
        "Z, Z', Z''",
        "observation -[g^c x] psi and its derivatives by time; Z1, Z2, Z3 along x, y, z of n unless it is \
         said otherwise; Z@p2: at position p2",
        "g",
        "(6), (12)",
    ],
    [
        "degree",
        "observable degree: the highest derivative of Z that a solution needs; 0 is best, every derivative \
         amplifies noise",
        "-",
        "(13) to (18)",
    ],
    [
        "accuracy order",
        "d where the best error falls as T^-(d+1/2) with the dwell T; equal to the degree unless it is said otherwise",
        "-",
        "-",
    ],
    [
        "rank, rank profile",
        "number of independent combinations that are observable, with derivatives up to order 0, 1, 2, ...",
        "-",
        "(13) to (18)",
    ],
    [
        "inseparable",
        "it moves Z, and so do others in the same way: only combinations with these are observable",
        "-",
        "-",
    ],
    ["not excited", "no derivative of Z changes with it at any of the positions", "-", "-"],
    [
        "sigma",
        "standard deviation; predicted: by the information of all samples of Z, with the priors and the \
         random drift that are stated",
        "as the unknown",
        "-",
    ],
    [
        "margin",
        "required over predicted sigma, with a bench over the total uncertainty: 1 or more is met",
        "-",
        "-",
    ],
    [
        "NEES, NIS",
        "squares of errors and of innovations over what the filter believes of them: about their number \
         where it is right",
        "-",
        "-",
    ],
];

/// The symbols of models.
const MODELS: [[&str; 4]; 3] = [
    [
        "x, p, u, y",
        "states, constants, inputs, outputs: x' = f(x, u, p, t), y = h(x, u, p, t); x(0): at the start",
        "as declared",
        "-",
    ],
    ["degree", "the highest derivative of the outputs that determines an unknown locally", "-", "-"],
    [
        "observable, locally",
        "no other value near it gives the same outputs; how many there are at all is said where it is known",
        "-",
        "-",
    ],
];

fn carry(carry: Carry) -> [String; 4] {
    let (name, means) = match carry {
        Carry::Platform => {
            ("platform carry", "psi along the axes of the platform goes on from one position to the next")
        }
        Carry::Inertial => (
            "inertial carry",
            "psi along North, Up, East goes on from one position to the next, as under real torqued slews",
        ),
        Carry::Reset => ("reset carry", "psi is unknown anew at every position: psi_x@p1, psi_x@p2, ..."),
    };
    [name, means, "-", "-"].map(String::from)
}

/// Table of the symbols that the review may use.
pub(super) fn notation(r: &DesignReview) -> DocumentBlock {
    let analyses = || r.schemes.iter().map(|s| &s.analysis).chain(r.generic.iter().map(|g| &g.analysis));
    let any_scheme = analyses().next().is_some();
    let mut rows: Vec<[String; 4]> = Vec::new();
    if any_scheme {
        rows.extend(SCHEMES.map(|row| row.map(String::from)));
        let carries: BTreeSet<String> = analyses().map(|a| a.carry.to_string()).collect();
        rows.extend(Carry::ALL.into_iter().filter(|c| carries.contains(&c.to_string())).map(carry));
    }
    if !r.models.is_empty() {
        rows.extend(MODELS.map(|row| row.map(String::from)));
    }
    let used =
        |term: &Term| analyses().any(|a| a.terms.parse::<Unknowns>().is_ok_and(|u| u.terms().contains(term)));
    let equation = |t: Term| match t {
        Term::F | Term::I | Term::O | Term::S => "(4), (21) to (23)",
        _ => "-",
    };
    rows.extend(Term::ALL.into_iter().filter(used).map(|t| {
        let names = match t.source() {
            ErrorSource::Gravity => format!("{0}X, {0}Y, {0}Z", t.family()),
            _ => format!("{0}_X, ...", t.family()),
        };
        [names, t.words().into(), t.unit().into(), equation(t).into()]
    }));
    let columns = [left("symbol"), left("meaning"), left("unit"), left("equation")];
    let heading =
        if any_scheme { "Symbols and terms (equations: J. NUDT 39(1), 2017)" } else { "Symbols and terms" };
    DocumentBlock::table(heading, columns, rows.into_iter().map(Vec::from))
}

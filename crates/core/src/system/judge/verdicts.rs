//! Verdicts on the unknowns of a system, with their certainty.

use obsdeg_exact::{Echelon, Field, RowSpace};

use super::super::branches::BranchSide;
use super::super::model::SystemModel;
use super::super::model::compiled::Role;
use super::super::rows::layout::{Layout, Unknown};
use super::super::values::Values;
use super::point_degrees::PointDegrees;
use crate::degree::findings::{ByPrimes, Findings};
use crate::degree::status::{Status, Verdict};

/// Verdicts on a system, with their certainty.
#[derive(Debug, Clone)]
pub struct Judgement {
    /// Unknowns of the system, and the bound on the order.
    pub layout: Layout,
    /// Verdicts on the unknowns and on requested combinations.
    pub findings: Findings,
    /// Certainty of the verdicts.
    pub certainty: SystemCertainty,
    /// Span of all rows in the first prime field; `None` if real numbers decided.
    pub span: Option<Echelon>,
    /// Number of independent functions of the reported unknowns that the outputs determine.
    pub(in crate::system) shown_rank: usize,
    /// The two prime fields of a rational model.
    pub fields: Option<[Field; 2]>,
    /// Number of functions whose values are proven to be independent of each other, so that random values
    /// replace them; `None` if true values were used.
    pub independent_functions: Option<usize>,
    /// Number of operations of the verdicts, at all points that were drawn.
    pub work: u64,
    /// True if unobservable unknowns might be observable beyond the bound on the order: it is not proven
    /// that higher orders add nothing.
    pub rests_on_bound: bool,
    /// Sides of the branches of abs and sign at the two points.
    pub sides: Vec<BranchSide>,
}

/// Certainty of the verdicts on a system.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SystemCertainty {
    /// Two prime fields that agree: a rational model, or one whose functions have independent values.
    Primes(ByPrimes),
    /// Two random real points that agree: any other model with functions.
    Digits(ByDigits),
}

/// Margin of rank decisions in real numbers. Decimal logarithms, relative to the largest entry of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ByDigits {
    /// Numbers of decimal digits at the first point and at the second.
    pub digits: [usize; 2],
    /// Smallest number that counts as non-zero: an error bound proves it.
    pub nonzero: f64,
    /// Widest error bound of a number that counts as zero: it contains zero.
    pub zero: f64,
}

impl Judgement {
    /// True if an unknown is reported: of arbitrary inputs only the signal itself, not its derivatives.
    pub fn shown(&self, model: &SystemModel, unknown: usize) -> bool {
        is_shown(model, &self.layout.unknowns[unknown])
    }

    /// Verdict on the unknown of a name; `None` if it is not reported.
    pub fn verdict(&self, model: &SystemModel, name: &str) -> Option<Verdict> {
        let unknown = self.layout.unknowns.iter().position(|u| u.name == name)?;
        self.shown(model, unknown).then(|| self.verdict_on(unknown))
    }

    /// Verdict on an unknown, as far as it is proven.
    pub fn verdict_on(&self, unknown: usize) -> Verdict {
        self.as_proven(self.findings.verdict(unknown))
    }

    /// Verdicts on requested combinations, as far as they are proven.
    pub fn asked(&self) -> impl Iterator<Item = Verdict> + '_ {
        self.findings.asked.iter().map(|v| self.as_proven(*v))
    }

    /// Verdict that allows for a higher order: an unobservable unknown is not resolved if no end is proven.
    fn as_proven(&self, verdict: Verdict) -> Verdict {
        match verdict.degree {
            None if self.rests_on_bound => Verdict { status: Status::NotSeen, ..verdict },
            _ => verdict,
        }
    }
}

/// True if an unknown is reported.
fn is_shown(model: &SystemModel, u: &Unknown) -> bool {
    match u.role {
        Role::UnknownInput(i) => u.derivative == 0 || model.unknown_inputs[i].1.is_some(),
        _ => true,
    }
}

/// Number of independent functionals in a span that contain only unknowns other than `hidden`.
fn rank_without<S: Values>(f: &S, span: &S::Space, hidden: &[usize]) -> usize {
    let mut part = <S::Space as RowSpace>::new(f.clone(), hidden.len());
    for i in 0..span.rank() {
        let row = span.row(i);
        part.insert(&hidden.iter().map(|&c| row[c]).collect::<Vec<_>>());
    }
    span.rank() - part.rank()
}

impl Judgement {
    pub(super) fn of<S: Values>(
        model: &SystemModel,
        layout: Layout,
        at: PointDegrees<S>,
        certainty: SystemCertainty,
        seed: u64,
    ) -> Self {
        let full = at.degrees.rank() == layout.unknowns.len();
        let hidden = |unknown: &usize| !is_shown(model, &layout.unknowns[*unknown]);
        let hidden: Vec<usize> = (0..layout.unknowns.len()).filter(hidden).collect();
        Self {
            shown_rank: rank_without(&at.steps.field, &at.span, &hidden),
            rests_on_bound: !full && !at.ended,
            findings: Findings {
                partners: at.span.companions(),
                degrees: at.degrees,
                asked: at.combinations,
                seed,
            },
            layout: Layout { closed: at.closed, ..layout },
            certainty,
            span: None,
            fields: None,
            independent_functions: None,
            sides: Vec::new(),
            work: 0,
        }
    }
}

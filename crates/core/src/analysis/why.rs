//! Explanation of the verdict on one unknown of a scheme.

use obsdeg_exact::{Echelon, RowSpace};

use super::answer::Analysis;
use super::remedies::{Spans, degrees_knowing, spans, with_attitudes};
use super::{components, degrees_of, generic_angles};
use crate::degree::rows::DerivativeRows;
use crate::degree::{Degrees, PlatformRows, Verdict};
use crate::findings::{AnalysisError, JudgedScheme};
use crate::model::attitude::cardinal_names;
use crate::model::platform::{AZIMUTH, Platform};
use crate::model::{Carry, Scheme, Unknowns};
use crate::remedies::{Change, Directions, Resolved};
use crate::solution::combinations::null_components;
use crate::solution::print::stations;
use crate::solution::solver::Frame;
use crate::why::{
    Assumption, AssumptionKind, Improvement, MOST_DECIDED, Otherwise, OutputDerivative, UnseenDirection, Why,
    by_cost, deciding_rows, is_lower, too_many,
};

/// Largest number of unknowns up to which added attitudes and known values are tried.
const MOST_UNKNOWNS: usize = 120;

/// Explains the verdict on one unknown of a scheme that was analysed with this seed; `None` if the scheme has
/// no unknown of this name.
///
/// # Errors
/// [`AnalysisError`].
pub fn explain(
    scheme: &Scheme,
    found: &Analysis,
    name: &str,
    seed: u64,
) -> Result<Option<Why>, AnalysisError> {
    let platform = Platform::new(scheme.clone())?;
    let Some(column) = platform.names().iter().position(|n| n == name) else { return Ok(None) };
    let judged = JudgedScheme::new(&platform, seed)?;
    let degree = judged.verdicts.degrees.degree[column];
    let spans = spans(&platform, &judged.verdicts.values);
    let mut explainer = VerdictExplainer {
        platform: &platform,
        judged: &judged,
        found,
        spans,
        column,
        degree,
        seed,
        verdicts: 0,
        not_explained: Vec::new(),
    };
    let (determined_by, rows) = explainer.determined_by();
    let unseen = explainer.unseen(&determined_by, &rows);
    let assumptions = explainer.assumptions();
    let remedies = explainer.remedies();
    Ok(Some(Why {
        name: name.into(),
        status: Verdict::of(&judged.verdicts.degrees, column).status,
        degree,
        determined_by,
        unseen,
        symmetries: Vec::new(),
        assumptions,
        remedies,
        not_explained: explainer.not_explained,
        verdicts: explainer.verdicts,
    }))
}

/// One unknown of a scheme, with the findings that its explanation uses.
struct VerdictExplainer<'a> {
    platform: &'a Platform,
    judged: &'a JudgedScheme<'a>,
    found: &'a Analysis,
    spans: Spans,
    column: usize,
    degree: Option<usize>,
    seed: u64,
    verdicts: usize,
    not_explained: Vec<String>,
}

/// Row of derivatives in the first field.
type DerivativeRow = Vec<u64>;

impl VerdictExplainer<'_> {
    fn scheme(&self) -> &Scheme {
        self.platform.scheme()
    }

    fn name(&self) -> &str {
        &self.platform.names()[self.column]
    }

    /// Derivatives of Z, and their rows in the first field, that together determine the unknown.
    fn determined_by(&mut self) -> (Vec<OutputDerivative>, Vec<DerivativeRow>) {
        let Some(degree) = self.degree else { return Default::default() };
        let unknowns = self.platform.names().len();
        if self.scheme().rotates() {
            let text = "deciding derivatives: while the platform turns, Z'' holds derivatives of the drift";
            self.not_explained.push(text.into());
            return Default::default();
        }
        if unknowns > MOST_DECIDED {
            self.not_explained.push(too_many(unknowns));
            return Default::default();
        }
        let labels = stations(self.scheme());
        let [(derivatives, first), (_, second)] = [0, 1].map(|i| {
            let sample = self.judged.verdicts.values[i].sample(self.scheme(), 1);
            let mut source = PlatformRows::new(self.platform, &sample);
            let (mut named, mut rows): (Vec<OutputDerivative>, Vec<DerivativeRow>) = Default::default();
            for order in 0..=degree {
                named.extend(source.labels(order).into_iter().map(|(station, component)| OutputDerivative {
                    output: if component == AZIMUTH { "Za".into() } else { format!("Z{component}") },
                    order,
                    place: Some(labels[station].position.clone()),
                }));
                source.emit(order, &mut |row| {
                    rows.push(row.to_vec());
                    true
                });
            }
            (named, rows)
        });
        let fields = [0, 1].map(|i| self.judged.verdicts.values[i].roots().field);
        let refs: Vec<&[u64]> = first.iter().map(Vec::as_slice).collect();
        let chosen = deciding_rows(&fields[0], &[], &refs, self.column);
        let agrees = |chosen: &Vec<usize>| {
            let mut space = Echelon::new(fields[1], unknowns);
            chosen.iter().for_each(|&i| _ = space.insert(&second[i]));
            space.has_unit(self.column)
        };
        let Some(chosen) = chosen.filter(agrees) else {
            self.not_explained.push("deciding derivatives: two random primes do not agree".into());
            return Default::default();
        };
        chosen.into_iter().map(|i| (derivatives[i].clone(), first[i].clone())).unzip()
    }

    /// Direction along which no derivative changes: below the degree of the unknown, or at every order.
    fn unseen(
        &mut self,
        derivatives: &[OutputDerivative],
        rows: &[DerivativeRow],
    ) -> Option<UnseenDirection> {
        let order = match self.degree {
            Some(degree) => degree.checked_sub(1)?,
            None => self.spans[0].len().saturating_sub(1),
        };
        let space = |i: usize| {
            let none =
                || Echelon::new(self.judged.verdicts.values[i].roots().field, self.platform.names().len());
            self.spans[i].get(order).cloned().unwrap_or_else(none)
        };
        let [first, second] = [space(0), space(1)];
        let support = Directions::of(first.field(), &first).shortest(self.column)?;
        if !Directions::of(second.field(), &second).is_support(&support) {
            self.not_explained.push("unseen direction: two random primes do not agree".into());
            return None;
        }
        let computed = match support.len() {
            1 => None,
            _ => null_components(&mut self.judged.solver(Frame::N, None), &support, order),
        };
        let mut components = components(self.platform, &support, computed.as_ref());
        if let [alone] = &mut components[..] {
            alone.coefficient = Some("1".into());
        }
        let vector = vector_on(&first, &support);
        let field = first.field();
        let sees =
            |row: &DerivativeRow| field.dot(0, support.iter().zip(&vector).map(|(&c, &x)| (row[c], x))) != 0;
        let seen = derivatives.iter().zip(rows).filter(|(d, row)| Some(d.order) == self.degree && sees(row));
        let seen_by = seen.map(|(d, _)| d.clone()).collect();
        Some(UnseenDirection {
            up_to_order: order,
            at_every_order: self.degree.is_none(),
            components,
            seen_by,
        })
    }

    /// The degree of the unknown in a changed scheme; `None` where there is no such scheme or unknown.
    fn otherwise(&mut self, scheme: Scheme, condition: &str, name: &str) -> Option<Otherwise> {
        let names = Platform::new(scheme.clone()).ok()?.names().to_vec();
        let place = names.iter().position(|n| n == name)?;
        let degree = *degrees_of(&scheme, self.seed).ok()?.get(place)?;
        self.verdicts += 1;
        Some(Otherwise { condition: condition.into(), degree })
    }

    fn assumptions(&mut self) -> Vec<Assumption> {
        let mut out = Vec::new();
        let (scheme, degree, name) = (self.scheme().clone(), self.degree, self.name().to_string());
        let mut put = |kind, stated: String, otherwise: Vec<Otherwise>| {
            if !otherwise.is_empty() {
                out.push(Assumption::new(kind, stated, otherwise, degree));
            }
        };
        put(AssumptionKind::Carry, scheme.carry.to_string(), self.carries(&name));
        let other = |latitude: &str| latitude.parse().ok();
        let latitudes = match scheme.latitude {
            None => vec![("pole", other("90")), ("equator", other("0"))],
            Some(_) => vec![("generic", None)],
        };
        let stated = scheme.latitude.map_or_else(|| "generic".into(), |l| format!("{} deg", l.degrees()));
        let otherwise = latitudes.into_iter().filter_map(|(words, latitude)| {
            self.otherwise(Scheme { latitude, ..scheme.clone() }, words, &name)
        });
        put(AssumptionKind::Latitude, stated, otherwise.collect());
        if scheme.measured_azimuth {
            let without = Scheme { measured_azimuth: false, ..scheme.clone() };
            let otherwise = self.otherwise(without, "not measured", &name);
            put(AssumptionKind::Azimuth, "measured".into(), otherwise.into_iter().collect());
        }
        if let Some(generic) = generic_angles(&scheme) {
            let otherwise = self.otherwise(generic, "almost all angles", &name);
            put(AssumptionKind::Angles, "as stated".into(), otherwise.into_iter().collect());
        }
        for (i, position) in scheme.positions.iter().enumerate().filter(|_| scheme.positions.len() > 1) {
            let Some(left) = name_without(&name, i) else { continue };
            let otherwise = self.otherwise(scheme.without_position(i), "without it", &left);
            put(AssumptionKind::Position, position.name.clone(), otherwise.into_iter().collect());
        }
        out
    }

    /// Verdicts under the other carries, from the analysis.
    fn carries(&self, name: &str) -> Vec<Otherwise> {
        let of_position = name.starts_with("psi") || name.contains('@');
        let compared = self.found.carries.iter().filter_map(|report| {
            let there = report.differs.iter().find(|d| d.name == name).map(|d| d.there.degree);
            // psi of the start is no unknown under reset carry, and psi of a position none under the others
            let same = !of_position || ![self.scheme().carry, report.carry].contains(&Carry::Reset);
            let degree = there.or_else(|| same.then_some(self.degree))?;
            Some(Otherwise { condition: report.carry.to_string(), degree })
        });
        compared.collect()
    }

    fn remedies(&mut self) -> Vec<Improvement> {
        if self.degree == Some(0) {
            return Vec::new();
        }
        let mut out = self.known();
        out.extend(self.attitudes());
        if !self.scheme().measured_azimuth {
            let scheme = Scheme { measured_azimuth: true, ..self.scheme().clone() };
            let change = Change::Output { state: "psi_y^n".into() };
            out.extend(self.of_scheme(scheme, change));
        }
        out.extend(self.other_carries());
        if self.degree.is_none() && out.is_empty() {
            out.extend(self.two());
        }
        by_cost(&mut out);
        out
    }

    /// Improvement by some changes, from the degrees of all unknowns with them; `None` if there is none.
    fn improvement(
        &mut self,
        changes: Vec<Change>,
        names: &[String],
        after: &[Option<usize>],
    ) -> Option<Improvement> {
        self.verdicts += 1;
        let of = |c: usize| {
            let name = &self.platform.names()[c];
            let given = changes.iter().any(|change| change.known() == Some(name));
            names.iter().position(|n| n == name).and_then(|k| after[k]).filter(|_| !given)
        };
        let degree = of(self.column).filter(|&k| is_lower(Some(k), self.degree))?;
        let before = &self.judged.verdicts.degrees.degree;
        let open = (0..before.len()).filter(|&c| c != self.column && before[c].is_none());
        let name = |c: usize| self.platform.names()[c].clone();
        let resolves = open.filter_map(|c| Some(Resolved { name: name(c), degree: of(c)? })).collect();
        Some(Improvement { changes, degree, resolves, loses: Vec::new() })
    }

    /// Improvements by one known value.
    fn known(&mut self) -> Vec<Improvement> {
        let unknowns = self.platform.names().len();
        if unknowns > MOST_UNKNOWNS {
            self.not_explained.push(format!("known values: {unknowns} unknowns; at most {MOST_UNKNOWNS}"));
            return Vec::new();
        }
        let names = self.platform.names().to_vec();
        let others = (0..unknowns).filter(|&w| w != self.column).collect::<Vec<_>>();
        let tried = others.into_iter().filter_map(|w| {
            let after = degrees_knowing(&self.spans, &[w])?;
            self.improvement(vec![Change::Known { name: names[w].clone() }], &names, &after)
        });
        tried.collect()
    }

    /// Improvements by one more cardinal attitude at the end.
    fn attitudes(&mut self) -> Vec<Improvement> {
        let unknowns = self.platform.names().len();
        if self.scheme().unknowns == Unknowns::Drift {
            return Vec::new();
        }
        if unknowns > MOST_UNKNOWNS {
            self.not_explained.push(format!("more attitudes: {unknowns} unknowns; at most {MOST_UNKNOWNS}"));
            return Vec::new();
        }
        let position = self.scheme().free_name(self.scheme().positions.len() + 1);
        let tried = cardinal_names().into_iter().filter_map(|attitude| {
            let scheme = with_attitudes(self.scheme(), &[attitude.as_str()])?;
            self.of_scheme(scheme, Change::Attitude { position: position.clone(), attitude })
        });
        tried.collect()
    }

    fn of_scheme(&mut self, scheme: Scheme, change: Change) -> Option<Improvement> {
        let platform = Platform::new(scheme).ok()?;
        let Degrees { degree, .. } = crate::degree::ensemble::degrees(&platform, self.seed).ok()?;
        self.improvement(vec![change], platform.names(), &degree)
    }

    /// Improvements by another carry, as judged by the analysis. psi of a position is not an unknown there.
    fn other_carries(&mut self) -> Vec<Improvement> {
        if self.name().contains('@') {
            return Vec::new();
        }
        let found = self.found.carries.iter().filter_map(|report| {
            let own = report.differs.iter().find(|d| d.name == self.name())?;
            let degree = own.there.degree.filter(|&k| is_lower(Some(k), self.degree))?;
            let others = report.differs.iter().filter(|d| d.name != own.name && !d.name.contains('@'));
            let won = others.clone().filter(|d| d.here.degree.is_none());
            let resolves =
                won.filter_map(|d| Some(Resolved { name: d.name.clone(), degree: d.there.degree? }));
            let lost = others.filter(|d| d.here.degree.is_some() && d.there.degree.is_none());
            Some(Improvement {
                changes: vec![Change::Carry { carry: report.carry }],
                degree,
                resolves: resolves.collect(),
                loses: lost.map(|d| d.name.clone()).collect(),
            })
        });
        found.collect()
    }

    /// Two changes, as the analysis has tried them.
    fn two(&mut self) -> Vec<Improvement> {
        let name = self.name();
        let found = self.found.to_resolve.remedies.iter().filter_map(|r| {
            let degree = r.resolves.iter().find(|x| x.name == name)?.degree;
            let resolves = r.resolves.iter().filter(|x| x.name != name).cloned().collect();
            Some(Improvement { changes: r.changes.clone(), degree, resolves, loses: r.loses.clone() })
        });
        let found: Vec<Improvement> = found.filter(|i| i.changes.len() > 1).collect();
        self.not_explained.extend(self.found.to_resolve.not_tried.iter().cloned());
        found
    }
}

/// Name of an unknown after a position is removed; `None` if the unknown belongs to that position.
fn name_without(name: &str, position: usize) -> Option<String> {
    match name.split_once('@') {
        Some((psi, number)) => {
            let index = number.parse::<usize>().ok()?.checked_sub(1)?;
            match index.cmp(&position) {
                std::cmp::Ordering::Less => Some(name.into()),
                std::cmp::Ordering::Equal => None,
                std::cmp::Ordering::Greater => Some(format!("{psi}@{index}")),
            }
        }
        // psi is that of the first position
        None if position == 0 && name.starts_with("psi") => None,
        None => Some(name.into()),
    }
}

/// The null vector of a space on its support.
fn vector_on(space: &Echelon, support: &[usize]) -> Vec<u64> {
    let mut short = Echelon::new(space.field(), support.len());
    for i in 0..space.rank() {
        let row: Vec<u64> = support.iter().map(|&c| space.row(i)[c]).collect();
        short.insert(&row);
    }
    RowSpace::null_space(&short).into_iter().next().unwrap_or_default()
}

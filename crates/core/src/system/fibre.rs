//! Number of solutions for an unknown: the values it takes among all points with the same outputs.
//!
//! At a random point of a prime field the Taylor coefficients of the outputs are numbers. These values are a
//! system of polynomial equations in the unknowns and the coefficients of the states. An unknown that a
//! symmetry changes keeps its value, since nothing observable depends on it. A Groebner basis gives the
//! number of values of each observable unknown over the algebraic closure: the degree of its minimal
//! polynomial in the quotient ring.
//!
//! Sufficient order: let `L_k` be the field that the derivatives up to order k generate. If rank grows last
//! at order h, `y^(h+1)` is algebraic over `L_h`. Differentiating its minimal polynomial gives `y^(h+2)` in
//! `L_(h+1)`, and so on: `L_(h+1)` contains all derivatives (the argument of Hong, Ovchinnikov, Pogudin, Yap
//! 2020, doi:10.1002/cpa.21921). The argument needs a derivation of the unknowns, hence one segment, a
//! generic start and no arbitrary input. In other cases one solution remains one, and several may become
//! fewer. Orders beyond h+1 only make the equations easier to solve.
//!
//! If inputs are generic, runs from the same start with other inputs add equations of low order. Almost
//! every input distinguishes every pair of points that any input distinguishes (Sussmann 1979, "Single-input
//! observability of continuous-time systems", Math. Systems Theory 12, 371), so no solution is lost.

use std::collections::BTreeSet;

use obsdeg_exact::groebner::{GroebnerBasis, RemainingWork};
use obsdeg_exact::multivariate::{Monomial, Polynomial};
use obsdeg_exact::{Field, SplitMix64, polynomial};

use super::dag::Op;
use super::function_factors::ModelFactors;
use super::global::RelationConsequences;
use super::judge::verdicts::Judgement;
use super::model::SystemModel;
use super::model::compiled::{Compiled, Role};
use super::quotients::{QuotientTerms, Quotients};
use super::rows::SystemRows;
use super::rows::layout::{Layout, Unknown};
use super::undecided::{LONGEST, NotCounted};
use super::work;

/// Limit of the powers that are formed: a basis has none above 255.
const POWER: u64 = 1 << 16;
/// Least weight of a state; parameters have weight one.
const STATE: u32 = 2;

/// Equations at a point.
struct Equations<'a> {
    f: Field,
    compiled: &'a Compiled,
    layout: &'a Layout,
    rows: SystemRows<'a, Field>,
    work: &'a mut RemainingWork,
    /// Value of every variable at the point.
    values: Vec<u64>,
    /// Weight of every variable.
    weights: Vec<u32>,
    /// Weight of every state.
    state_weights: Vec<u32>,
    /// Every unknown as a polynomial in the variables.
    unknowns: Vec<Polynomial>,
    /// Polynomials that are zero.
    zero: Vec<Polynomial>,
    runs: Vec<SegmentSeries>,
}

/// Segment of an experiment.
struct SegmentSeries {
    experiment: usize,
    /// States at its start.
    initial: Vec<Polynomial>,
    /// Coefficients `nodes[node][k]` of the nodes that are needed.
    nodes: Vec<Vec<Polynomial>>,
}

impl<'a> Equations<'a> {
    /// Variables at a point, without runs.
    fn new(
        compiled: &'a Compiled,
        judged: &'a Judgement,
        CountingPoint { f, known, .. }: CountingPoint<'_>,
        rows: SystemRows<'a, Field>,
        work: &'a mut RemainingWork,
    ) -> Self {
        let layout = &judged.layout;
        let values = rows.values(compiled, layout, &[]);
        let free = |unknown: usize| {
            known.unique.contains(&unknown)
                || judged.span.as_ref().is_none_or(|s| s.pivots().all(|p| p != unknown))
        };
        let unknown = |(unknown, &value): (usize, &u64)| match free(unknown) {
            true => Polynomial::constant(value),
            false => Polynomial::variable(&f, unknown as u32),
        };
        let state_weights = state_weights(compiled);
        let weight = |u: &Unknown| match u.role {
            Role::State(s) => state_weights[s],
            Role::Parameter(_) => 1,
            _ => STATE,
        };
        Self {
            f,
            compiled,
            layout,
            rows,
            work,
            weights: layout.unknowns.iter().map(weight).collect(),
            state_weights,
            unknowns: values.iter().enumerate().map(unknown).collect(),
            values,
            zero: known.zero.clone(),
            runs: Vec::new(),
        }
    }

    /// Appends a run without coefficients; returns its number.
    fn add_run(&mut self, experiment: usize, initial: Vec<Polynomial>) -> usize {
        let nodes = vec![Vec::new(); self.compiled.dag.ops.len()];
        self.runs.push(SegmentSeries { experiment, initial, nodes });
        self.runs.len() - 1
    }

    /// States at the start of an experiment: unknowns, and numbers for known ones.
    fn initial(&mut self, model: &SystemModel, experiment: usize) -> Result<Vec<Polynomial>, NotCounted> {
        let segments = self.compiled.segments.len().max(1);
        let mut initial = Vec::new();
        for s in 0..model.states.len() {
            initial.push(match self.layout.index_of(Role::State(s), experiment) {
                Some(unknown) => self.unknowns[unknown].clone(),
                None => {
                    let node = self.compiled.node_of(Role::State(s)).ok_or(NotCounted::NoPoint)?;
                    Polynomial::constant(self.rows.coefficient(experiment * segments, node, 0))
                }
            });
        }
        Ok(initial)
    }

    /// Appends a run for every segment of an experiment, with its constraints and jumps.
    fn add_segments(&mut self, model: &SystemModel, experiment: usize) -> Result<(), NotCounted> {
        let compiled = self.compiled;
        let mut initial = self.initial(model, experiment)?;
        for segment in 0..compiled.segments.len().max(1) {
            let r = self.add_run(experiment, initial);
            let given = compiled.starts.iter().enumerate().filter_map(|(s, node)| Some((s, (*node)?)));
            let given: Vec<(usize, usize)> = given.filter(|_| segment == 0).collect();
            let jumps = compiled.segments.get(segment).map_or(&[][..], |s| &s.carry);
            self.jump(r, &given)?;
            if segment == 0 {
                for &node in &compiled.constraints {
                    let p = self.start(r, node)?;
                    self.zero.push(p);
                }
            }
            self.jump(r, jumps)?;
            initial = self.runs[r].initial.clone();
        }
        Ok(())
    }

    /// Adds the equations of the outputs of all runs, order by order, each solved for what it gives.
    fn add_outputs(&mut self, model: &SystemModel, order: usize) -> Result<(), NotCounted> {
        let (compiled, f) = (self.compiled, self.f);
        let needed: Vec<Vec<bool>> = (0..model.experiments.max(1))
            .map(|e| reached(compiled, compiled.outputs(e), |s| Some(compiled.rates(e)[s])))
            .collect();
        for k in 0..=order {
            for r in 0..self.runs.len() {
                let experiment = self.runs[r].experiment;
                self.extend(r, &needed[experiment], k)?;
                for &o in compiled.outputs(experiment) {
                    let mut p = self.runs[r].nodes[o][k].clone();
                    let value = Polynomial::constant(self.rows.coefficient(r, o, k));
                    p.add_scaled(&f, &value, f.neg(f.one()));
                    self.zero.push(p);
                }
            }
            self.solve()?;
        }
        Ok(())
    }

    fn variable(&mut self, value: u64, weight: u32) -> Polynomial {
        self.values.push(value);
        self.weights.push(weight);
        Polynomial::variable(&self.f, self.values.len() as u32 - 1)
    }

    fn add_product(
        &mut self,
        sum: &mut Polynomial,
        a: &Polynomial,
        b: &Polynomial,
    ) -> Result<(), NotCounted> {
        self.work.take(1 + 8 * (a.len() * b.len()) as u64)?;
        if u64::from(a.highest_power()) + u64::from(b.highest_power()) > POWER {
            return Err(NotCounted::TooHigh);
        }
        sum.add_product(&self.f, a, b);
        if sum.len() > LONGEST { Err(NotCounted::TooLong) } else { Ok(()) }
    }

    /// Computes coefficient `k` of the `needed` nodes in run `r`, from the coefficients before.
    fn extend(&mut self, r: usize, needed: &[bool], k: usize) -> Result<(), NotCounted> {
        self.work.take(needed.len() as u64)?;
        for (i, &needed) in needed.iter().enumerate() {
            let p = if needed { self.coefficient(r, i, k)? } else { Polynomial::default() };
            self.runs[r].nodes[i].push(p);
        }
        Ok(())
    }

    fn coefficient(&mut self, r: usize, i: usize, k: usize) -> Result<Polynomial, NotCounted> {
        let f = self.f;
        if self.rows.is_known(r, i) {
            return Ok(Polynomial::constant(self.rows.coefficient(r, i, k)));
        }
        let minus = f.neg(f.one());
        let of = |s: &Self, a: usize, j: usize| s.runs[r].nodes[a][j].clone();
        match self.compiled.dag.ops[i] {
            Op::Number { .. } => Ok(Polynomial::default()),
            Op::Slot(slot) => Ok(self.signal(r, self.compiled.roles[slot], k)),
            Op::Add(a, b) => {
                let mut sum = of(self, a, k);
                sum.add_scaled(&f, &of(self, b, k), f.one());
                Ok(sum)
            }
            Op::Subtract(a, b) => {
                let mut sum = of(self, a, k);
                sum.add_scaled(&f, &of(self, b, k), minus);
                Ok(sum)
            }
            Op::Multiply(a, b) => {
                let mut sum = Polynomial::default();
                for j in 0..=k {
                    let (x, y) = (of(self, a, j), of(self, b, k - j));
                    self.add_product(&mut sum, &x, &y)?;
                }
                Ok(sum)
            }
            Op::Divide(a, b) => {
                // c b = a
                let below = of(self, b, 0);
                let mut rest = of(self, a, k);
                for j in 0..k {
                    let (x, y) = (of(self, i, j).scaled(&f, minus), of(self, b, k - j));
                    self.add_product(&mut rest, &x, &y)?;
                }
                let inverse = f.inv(below.at(&f, &self.values));
                if inverse == 0 {
                    return Err(NotCounted::NoPoint);
                }
                if below.as_constant().is_some() {
                    return Ok(rest.scaled(&f, inverse));
                }
                if k == 0 {
                    // no divisor is zero at a solution
                    let z = self.variable(inverse, STATE);
                    let mut zero = Polynomial::constant(minus);
                    self.add_product(&mut zero, &z, &below)?;
                    self.zero.push(zero);
                }
                let c = self.variable(f.mul(rest.at(&f, &self.values), inverse), STATE);
                let mut zero = rest.scaled(&f, minus);
                self.add_product(&mut zero, &c, &below)?;
                self.zero.push(zero);
                Ok(c)
            }
            Op::Primitive { .. } | Op::Pi => Err(NotCounted::NotRational),
        }
    }

    /// Coefficient `k` of a slot that is neither known nor an operation.
    fn signal(&mut self, r: usize, role: Role, k: usize) -> Polynomial {
        let f = self.f;
        let Role::State(s) = role else {
            let experiment = self.runs[r].experiment;
            let own = |u: &Unknown| {
                u.role == role && u.derivative == k && u.experiment.is_none_or(|e| e == experiment)
            };
            let unknown = self.layout.unknowns.iter().position(own);
            return unknown.map_or_else(Polynomial::default, |unknown| self.unknowns[unknown].clone());
        };
        if k == 0 {
            return self.runs[r].initial[s].clone();
        }
        let node = self.compiled.rates(self.runs[r].experiment)[s];
        let rate = self.runs[r].nodes[node][k - 1].scaled(&f, f.inv(f.from_u64(k as u64)));
        if rate.degree() <= 1 {
            return rate;
        }
        let x = self.variable(rate.at(&f, &self.values), self.state_weights[s]);
        let mut zero = rate.scaled(&f, f.neg(f.one()));
        zero.add_scaled(&f, &x, f.one());
        self.zero.push(zero);
        x
    }

    /// Value of a node at the start of a run, in terms of the states there.
    fn start(&mut self, r: usize, node: usize) -> Result<Polynomial, NotCounted> {
        let needed = reached(self.compiled, &[node], |_| None);
        self.extend(r, &needed, 0)?;
        let p = self.runs[r].nodes[node].pop();
        self.runs[r].nodes.iter_mut().for_each(Vec::clear);
        Ok(p.unwrap_or_default())
    }

    /// Gives states other values at the start of a run, in terms of those before.
    fn jump(&mut self, r: usize, to: &[(usize, usize)]) -> Result<(), NotCounted> {
        let found = to.iter().map(|&(s, node)| Ok((s, self.start(r, node)?)));
        for (s, p) in found.collect::<Result<Vec<_>, NotCounted>>()? {
            self.runs[r].initial[s] = p;
        }
        Ok(())
    }

    /// Eliminates variables that an affine equation gives, the latest first.
    fn solve(&mut self) -> Result<(), NotCounted> {
        let f = self.f;
        while let Some(e) = self.zero.iter().position(|p| p.degree() <= 1) {
            let p = self.zero.swap_remove(e);
            let Some(v) = p.terms().filter_map(|(m, _)| m.first().map(|x| x.0)).max() else {
                if p.is_empty() { continue } else { return Err(NotCounted::NoPoint) }
            };
            let mut value = p.scaled(&f, f.neg(f.inv(p.coefficient(&[(v, 1)]))));
            value.add_scaled(&f, &Polynomial::variable(&f, v), f.one());
            let nodes = self.runs.iter_mut().flat_map(|r| r.nodes.iter_mut().flatten().chain(&mut r.initial));
            for q in nodes.chain(&mut self.unknowns).chain(&mut self.zero) {
                self.work.take(1 + q.len() as u64 / 4)?;
                if q.terms_with(v) > 0 {
                    self.work.take(q.products_of_replaced(v, value.len()).saturating_mul(8))?;
                    *q = q.replaced(&f, v, &value);
                }
            }
        }
        Ok(())
    }
}

/// Nodes that some nodes depend on; `follow` gives the next node of a state.
pub(super) fn reached(
    compiled: &Compiled,
    from: &[usize],
    follow: impl Fn(usize) -> Option<usize>,
) -> Vec<bool> {
    let mut out = vec![false; compiled.dag.ops.len()];
    let mut left = from.to_vec();
    while let Some(i) = left.pop() {
        if std::mem::replace(&mut out[i], true) {
            continue;
        }
        match compiled.dag.ops[i] {
            Op::Add(a, b) | Op::Subtract(a, b) | Op::Multiply(a, b) | Op::Divide(a, b) => left.extend([a, b]),
            Op::Primitive { of, weight, .. } => left.extend([of, weight]),
            Op::Slot(slot) => {
                if let Role::State(s) = compiled.roles[slot] {
                    left.extend(follow(s));
                }
            }
            Op::Number { .. } | Op::Pi => {}
        }
    }
    out
}

/// Weight of every state: the lowest order of an output derivative that contains it, plus [`STATE`].
/// Coefficients of a state weigh as much as the products from which they are solved.
fn state_weights(compiled: &Compiled) -> Vec<u32> {
    let mut weights = vec![0; compiled.rates(0).len()];
    let experiments = 0..compiled.experiments.len();
    let mut from: Vec<usize> = experiments.clone().flat_map(|e| compiled.outputs(e)).copied().collect();
    for weight in STATE.. {
        let nodes = reached(compiled, &from, |_| None);
        from.clear();
        for (op, _) in compiled.dag.ops.iter().zip(nodes).filter(|n| n.1) {
            if let Op::Slot(slot) = *op
                && let Role::State(s) = compiled.roles[slot]
                && weights[s] == 0
            {
                weights[s] = weight;
                from.extend(experiments.clone().map(|e| compiled.rates(e)[s]));
            }
        }
        if from.is_empty() {
            break;
        }
    }
    // states that only constraints contain have a weight too: otherwise their powers would be unlimited
    weights.into_iter().map(|weight| weight.max(STATE)).collect()
}

/// Equations at a random point, with derivatives of the outputs up to the order of `at`.
fn equations<'a>(
    model: &SystemModel,
    compiled: &'a Compiled,
    judged: &'a Judgement,
    at: CountingPoint<'_>,
    (rng, verdict): (&mut SplitMix64, &'a work::Work),
    work: &'a mut RemainingWork,
) -> Result<Equations<'a>, NotCounted> {
    let mut rows = SystemRows::with_inputs(model, compiled, &judged.layout, at.f, (rng, at.others), verdict)
        .map_err(|_| NotCounted::NoPoint)?;
    let segments = compiled.segments.len().max(1);
    for e in 0..model.experiments.max(1) {
        // values of unknown inputs are Taylor coefficients
        let highest = judged.layout.unknowns.iter().map(|u| u.derivative).max().unwrap_or(0);
        rows.coefficient(e * segments, 0, highest);
    }
    let mut out = Equations::new(compiled, judged, at, rows, work);
    for experiment in 0..model.experiments.max(1) {
        out.add_segments(model, experiment)?;
    }
    for _ in 0..at.others {
        let initial = out.runs[0].initial.clone();
        out.add_run(0, initial);
    }
    out.add_outputs(model, at.order)?;
    // the point itself must be a solution
    let holds = out.zero.iter().all(|p| p.at(&at.f, &out.values) == 0);
    if holds { Ok(out) } else { Err(NotCounted::NoPoint) }
}

/// Drops equations that only define a variable which nothing else uses.
fn without_lonely(mut zero: Vec<Polynomial>, variables: usize, wanted: &[Polynomial]) -> Vec<Polynomial> {
    let held =
        |p: &Polynomial| -> BTreeSet<u32> { p.terms().flat_map(|(m, _)| m.iter().map(|x| x.0)).collect() };
    let mut users = vec![0; variables];
    for p in zero.iter().chain(wanted) {
        held(p).into_iter().for_each(|v| users[v as usize] += 1);
    }
    loop {
        let before = zero.len();
        zero.retain(|p| {
            let alone =
                |m: &Monomial| matches!(m[..], [(v, 1)] if users[v as usize] == 1 && p.terms_with(v) == 1);
            let lonely = p.terms().any(|(m, _)| alone(m));
            if lonely {
                held(p).into_iter().for_each(|v| users[v as usize] -= 1);
            }
            !lonely
        });
        if zero.len() == before {
            return zero;
        }
    }
}

/// Random point in one of the two fields at which solutions are counted, with what is known there.
#[derive(Debug, Clone, Copy)]
pub(super) struct CountingPoint<'a> {
    pub(super) f: Field,
    /// Highest order of the derivatives of the outputs.
    pub(super) order: usize,
    /// Number of runs from the same start with other values of the generic inputs.
    pub(super) others: usize,
    /// Consequences of relations for the unknowns.
    pub(super) known: &'a RelationConsequences,
    /// Functions whose values are counted too, together with all unknowns and the combinations that the model
    /// asks for. For unknowns that are not observable these are the values while as many of them are fixed as
    /// there are unobservable directions.
    /// `None`: only observable unknowns.
    pub(super) functions: Option<&'a [QuotientTerms]>,
}

/// Polynomial whose roots are the values that an unknown takes, constant term first.
type RootPolynomial = Result<Vec<u64>, NotCounted>;

/// Values of the unknowns among all points with the same outputs.
#[derive(Debug, Clone)]
pub(super) struct Fibre {
    /// Values of the unknowns at the point itself.
    pub(super) values: Vec<u64>,
    /// Polynomial of every unknown.
    pub(super) polynomials: Vec<RootPolynomial>,
    /// True if all unknowns together take two values.
    pub(super) is_pair: bool,
    /// Numbers of values of the functions, then of the combinations that the model asks for.
    pub(super) functions: Vec<Result<usize, NotCounted>>,
}

/// Variables that occur, from the latest on, which are the largest and eliminated first, and the polynomials
/// with the places in this list as variables.
fn renumbered(lists: [&[Polynomial]; 2], variables: usize) -> Option<(Vec<usize>, [Vec<Polynomial>; 2])> {
    let occurs = |v: &usize| lists.iter().copied().flatten().any(|p| p.terms_with(*v as u32) > 0);
    let used: Vec<usize> = (0..variables).filter(occurs).rev().collect();
    let mut place = vec![None; variables];
    for (i, &v) in used.iter().enumerate() {
        place[v] = Some(i as u32);
    }
    let renamed = |list: &[Polynomial]| -> Option<Vec<Polynomial>> {
        list.iter().map(|p| p.renamed(|v| place[v as usize])).collect()
    };
    let [first, second] = lists.map(renamed);
    Some((used, [first?, second?]))
}

/// Values that every unknown takes at one random point.
pub(super) fn at_point(
    model: &SystemModel,
    compiled: &Compiled,
    judged: &Judgement,
    at: CountingPoint<'_>,
    rng: &mut SplitMix64,
    work: &mut RemainingWork,
) -> Result<Fibre, NotCounted> {
    let f = at.f;
    let verdict = work::Work::new(model.work_limit);
    let Equations { zero, values, weights, unknowns, rows, .. } =
        equations(model, compiled, judged, at, (&mut *rng, &verdict), &mut *work)?;
    let factors = ModelFactors::new(model, compiled, &judged.layout);
    let known = rows.values(compiled, &judged.layout, &factors.nodes(compiled)).split_off(unknowns.len());
    let degree = &judged.findings.degrees.degree;
    let counted = |unknown: usize| degree[unknown].is_some() || at.functions.is_some();
    // of inputs the derivatives, not the Taylor coefficients
    let factor = |unknown: usize| judged.layout.factorial(&f, unknown);
    let own: Vec<u64> = (0..unknowns.len()).map(|unknown| f.mul(values[unknown], factor(unknown))).collect();
    let shown = |(unknown, p): (usize, &Polynomial)| match counted(unknown) {
        true => p.scaled(&f, factor(unknown)),
        false => Polynomial::default(),
    };
    let mut wanted: Vec<Polynomial> = unknowns.iter().enumerate().map(shown).collect();
    let zero = without_lonely(zero, values.len(), &wanted);
    // all unknowns together, by a random combination
    let mut joint = Polynomial::default();
    wanted.iter().for_each(|p| joint.add_scaled(&f, p, rng.below(f.modulus())));
    wanted.push(joint);
    let (used, [zero, mut wanted]) = renumbered([&zero, &wanted], values.len()).ok_or(NotCounted::NoPoint)?;
    let joint = wanted.pop().unwrap_or_default();
    let weights: Vec<u32> = used.iter().map(|&v| weights[v]).collect();
    let mut basis = GroebnerBasis::new(&f, &weights, &zero, work);
    let mut ring = Quotients { f, basis: &mut basis };
    let polynomials: Vec<RootPolynomial> = wanted.iter().map(|p| ring.values(p, work)).collect();
    let two = |p: &RootPolynomial| p.as_ref().is_ok_and(|p| polynomial::distinct_roots(&f, p) == 2);
    let is_pair = polynomials.iter().any(two) && two(&ring.values(&joint, work));
    let elements: Vec<Polynomial> =
        wanted.into_iter().chain(known.into_iter().map(Polynomial::constant)).collect();
    let number = |element: Result<Polynomial, NotCounted>, ring: &mut Quotients<'_>, work: &mut _| {
        Ok(polynomial::distinct_roots(&f, &ring.values(&element?, work)?))
    };
    let mut functions = Vec::new();
    if let Some(terms) = at.functions {
        for terms in terms {
            let element = ring.function(terms, &elements, work);
            functions.push(number(element, &mut ring, work));
        }
        for &asked in &compiled.combinations {
            let slot = |s: usize| {
                let factor = factors.of_role(compiled.roles[s], &judged.layout, 0)?;
                elements.get(factor).cloned()
            };
            let element = ring.node(&compiled.dag, asked, slot, work);
            functions.push(number(element, &mut ring, work));
        }
    }
    Ok(Fibre { values: own, polynomials, is_pair, functions })
}

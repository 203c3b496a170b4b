//! Certificates of rational models: the equations as a straight-line program, and the rows, pivots and free
//! unknowns that a checker finds again at points and primes of its own.

use std::collections::HashMap;

use obsdeg_exact::{Echelon, Field, SplitMix64};
use schemars::JsonSchema;
use serde::Serialize;

use super::witness::{Filtration, WitnessedVerdict};
use super::{BasisRow, CertificateError, CertifiedUnknown, MOST_UNKNOWNS, RowName, not_covered, proof, text};
use crate::degree::ensemble::EnsembleError;
use crate::degree::rows::DerivativeRows;
use crate::findings::AnalysisError;
use crate::system::judge::judge_compiled;
use crate::system::rows::SystemRows;
use crate::system::work::Work;
use crate::system::{Compiled, Judgement, KnownInput, Op, Role, SystemModel};

/// Name and version of the layout.
const LAYOUT: &str = "obsdeg.model-certificate/1";

/// Certificate of a rational model: the verdicts and the witness that proves them.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ModelCertificate {
    /// Name and version of the layout, `obsdeg.model-certificate/1`.
    pub layout: String,
    /// Equations that the verdicts are about.
    pub problem: CertifiedModel,
    /// Names of the unknowns (states, then parameters), in the order of the columns of all rows.
    pub unknowns: Vec<String>,
    /// Ranks of the rows of order at most 0, 1, ..., K; higher orders add nothing.
    pub ranks: Vec<usize>,
    /// Basis rows: 1, derivative order, number of the output (from 1), name of the pivot unknown.
    pub basis: Vec<BasisRow>,
    /// Verdict and witness for every unknown, in the order of the unknowns.
    pub verdicts: Vec<CertifiedUnknown>,
}

/// Equations of a certificate as a straight-line program. Values are numbered from 0: states, parameters,
/// constants, inputs, operations.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CertifiedModel {
    /// Names of the states; their starts are unknown.
    pub states: Vec<String>,
    /// Names of the parameters: unknown constants.
    pub parameters: Vec<String>,
    /// Names of the known constants of generic value.
    pub constants: Vec<String>,
    /// Known inputs: name, and degree of the polynomial in time (dimensionless), or null for a generic
    /// function of time.
    pub inputs: Vec<CertifiedInput>,
    /// Operations, each on values before it.
    pub program: Vec<Operation>,
    /// For each state the index of the value that is its derivative.
    pub rates: Vec<usize>,
    /// Outputs: name, and number of the value.
    pub outputs: Vec<CertifiedOutput>,
}

/// Known input of a certificate; in JSON `[name, degree]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CertifiedInput {
    /// Name of the input.
    pub name: String,
    /// Degree of the polynomial in time, dimensionless; `None` for a generic function of time.
    pub degree: Option<usize>,
}

crate::json_list!(CertifiedInput { name: String, degree: Option<usize> });

/// Output of a certificate; in JSON `[name, value]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CertifiedOutput {
    /// Name of the output.
    pub name: String,
    /// Number of the value that it is, from 0.
    pub value: usize,
}

crate::json_list!(CertifiedOutput { name: String, value: usize });

/// Operation of a straight-line program, dimensionless.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Operation {
    /// `["=", "-3/10"]`: a fraction.
    Number(char, String),
    /// `["*", 3, 5]`: sum (+), difference (-), product (*) or quotient (/) of two values, each by its index.
    Binary(char, usize, usize),
}

impl ModelCertificate {
    /// JSON text with one key per line, and one list entry per line.
    ///
    /// # Errors
    /// None for the certificate of a model.
    pub fn text(&self) -> Result<String, serde_json::Error> {
        text(self)
    }
}

/// The certificate of a rational model whose starts and inputs are generic.
///
/// # Errors
/// [`CertificateError`].
pub fn certify_model(model: &SystemModel, seed: u64) -> Result<ModelCertificate, CertificateError> {
    let compiled = model.compile()?;
    check_shape(model, &compiled)?;
    let judgement = judge_compiled(model, &compiled, seed, None)?;
    check_covered(model, &compiled, &judgement)?;
    let (problem, columns) = problem(model, &compiled, &judgement);
    let Some(fields) = judgement.fields else {
        return Err(not_covered("functions", "rational models"));
    };
    let mut rng = SplitMix64::new(seed ^ 0x6365_7274_6966_7900);
    let [first, second] =
        fields.map(|field| witness(model, &compiled, &judgement, field, &columns, &mut rng));
    let ((filtration, found), (other, second)) = (first?, second?);
    let verdict = |(found, &column): (&WitnessedVerdict, &usize)| {
        let verdict = judgement.findings.verdict(column);
        (verdict.status, verdict.degree) == (found.status, found.degree)
    };
    let agree = found == second && filtration.basis == other.basis && filtration.ranks == other.ranks;
    if !agree || !found.iter().zip(&columns).all(verdict) {
        return Err(AnalysisError::from(EnsembleError::Disagreement).into());
    }
    let unknowns: Vec<String> = problem.states.iter().chain(&problem.parameters).cloned().collect();
    let verdicts = unknowns.iter().zip(found);
    let verdicts = verdicts.map(|(name, found)| CertifiedUnknown {
        unknown: name.clone(),
        proof: proof(found, None, &filtration, &unknowns),
    });
    let basis = filtration.basis.iter().map(|&(row, pivot)| BasisRow::new(row, &unknowns[pivot]));
    Ok(ModelCertificate {
        layout: LAYOUT.into(),
        verdicts: verdicts.collect(),
        basis: basis.collect(),
        ranks: filtration.ranks.clone(),
        unknowns,
        problem,
    })
}

/// Refuses models that the layout does not cover, before any verdict.
fn check_shape(model: &SystemModel, compiled: &Compiled) -> Result<(), CertificateError> {
    let expected = "one experiment in one segment without constraints and algebraic equations";
    let cases = [
        (model.experiments > 1, "several experiments"),
        (!model.segments.is_empty(), "segments"),
        (!model.algebraic.is_empty(), "algebraic equations"),
        (!model.constraints.is_empty(), "constraints"),
    ];
    if let Some((_, found)) = cases.into_iter().find(|case| case.0) {
        return Err(not_covered(found, expected));
    }
    if compiled.dag.ops.iter().any(|op| matches!(op, Op::Primitive { .. } | Op::Pi)) {
        return Err(not_covered("functions", "rational models"));
    }
    let inputs =
        model.known_inputs.iter().map(|i| &i.0.name).chain(model.unknown_inputs.iter().map(|i| &i.0.name));
    let named = model.parameters.iter().map(|n| &n.name).chain(model.constants.iter().map(|c| &c.0.name));
    let names = model.states.iter().map(|s| &s.named.name).chain(inputs).chain(named);
    let mut names = names.chain(model.outputs.iter().map(|o| &o.0.name));
    match names.find(|name| !is_name(name)) {
        Some(name) => Err(not_covered(format!("the name `{name}`"), NAMES)),
        None => Ok(()),
    }
}

/// Description of the names that certificates cover.
const NAMES: &str = "names of letters, digits and _ [ ] , . @ ' that begin with a letter or _, at most 256";

/// True for a name that a checker accepts: it cannot be read as an expression.
fn is_name(name: &str) -> bool {
    let first = name.chars().next().is_some_and(|c| c.is_alphabetic() || c == '_');
    first && name.chars().count() <= 256 && name.chars().all(|c| c.is_alphanumeric() || "_[],.@'".contains(c))
}

/// Refuses starts and inputs that are not generic: the layout does not cover them.
fn check_covered(
    model: &SystemModel,
    compiled: &Compiled,
    judgement: &Judgement,
) -> Result<(), CertificateError> {
    let layout = &judgement.layout;
    let of_time =
        (0..model.known_inputs.len()).any(|i| matches!(model.known_input(0, i), KnownInput::Function(_)));
    if !layout.closed || of_time || compiled.roles.contains(&Role::Time) && compiled.uses_time() {
        return Err(not_covered(
            "starts or inputs that are not generic",
            "unknown starts and generic inputs",
        ));
    }
    let found = layout.unknowns.len();
    if found > MOST_UNKNOWNS {
        return Err(not_covered(format!("{found} unknowns"), "at most 300"));
    }
    Ok(())
}

/// Equations of the certificate, and for every unknown its column in the layout. An unknown input that is a
/// polynomial in time is a chain of states, each the derivative of the one before.
fn problem(model: &SystemModel, compiled: &Compiled, judgement: &Judgement) -> (CertifiedModel, Vec<usize>) {
    let unknowns = &judgement.layout.unknowns;
    let of = |wanted: fn(Role) -> bool| (0..unknowns.len()).filter(move |&c| wanted(unknowns[c].role));
    let states: Vec<usize> = of(|role| matches!(role, Role::State(_) | Role::UnknownInput(_))).collect();
    let parameters: Vec<usize> = of(|role| matches!(role, Role::Parameter(_))).collect();
    let names = |columns: &[usize]| columns.iter().map(|&c| unknowns[c].name.clone()).collect::<Vec<_>>();
    let used = |role: Role| compiled.roles.contains(&role);
    let constants: Vec<usize> = (0..model.constants.len())
        .filter(|&c| used(Role::Constant(c)) && compiled.constants(0)[c].is_none())
        .collect();
    let inputs: Vec<usize> = (0..model.known_inputs.len()).filter(|&i| used(Role::KnownInput(i))).collect();
    let columns: Vec<usize> = states.iter().chain(&parameters).copied().collect();
    let place = |role: Role| match role {
        Role::Constant(c) => constants.iter().position(|x| *x == c).map(|i| columns.len() + i),
        Role::KnownInput(u) => {
            inputs.iter().position(|x| *x == u).map(|i| columns.len() + constants.len() + i)
        }
        _ => columns.iter().position(|&c| unknowns[c].role == role && unknowns[c].derivative == 0),
    };
    let mut program =
        Program { compiled, start: columns.len() + constants.len() + inputs.len(), ..Program::of(compiled) };
    for (slot, role) in compiled.roles.iter().enumerate() {
        if let Some(index) = place(*role) {
            program.slots.insert(slot, index);
        }
    }
    for (c, node) in compiled.constants(0).iter().enumerate() {
        let slot = compiled.roles.iter().position(|role| *role == Role::Constant(c));
        if let (Some(node), Some(slot)) = (node, slot) {
            let index = program.node(*node);
            program.slots.insert(slot, index);
        }
    }
    let rate = |program: &mut Program<'_>, (i, &c): (usize, &usize)| match unknowns[c].role {
        Role::State(state) => program.node(compiled.rates(0)[state]),
        role => match states.get(i + 1).filter(|&&next| unknowns[next].role == role) {
            Some(_) => i + 1,
            None => program.operation(Operation::Number('=', "0".into())),
        },
    };
    let rates = states.iter().enumerate().map(|entry| rate(&mut program, entry)).collect();
    let outputs = model.outputs.iter().zip(compiled.outputs(0));
    let outputs = outputs
        .map(|((named, _), &node)| CertifiedOutput { name: named.name.clone(), value: program.node(node) });
    let outputs = outputs.collect();
    let input =
        |&i: &usize| CertifiedInput { name: model.known_inputs[i].0.name.clone(), degree: degree(model, i) };
    let problem = CertifiedModel {
        states: names(&states),
        parameters: names(&parameters),
        constants: constants.iter().map(|&c| model.constants[c].0.name.clone()).collect(),
        inputs: inputs.iter().map(input).collect(),
        program: program.operations,
        rates,
        outputs,
    };
    (problem, columns)
}

fn degree(model: &SystemModel, input: usize) -> Option<usize> {
    match model.known_input(0, input) {
        KnownInput::Polynomial(degree) => Some(*degree),
        _ => None,
    }
}

/// Straight-line program under construction.
struct Program<'a> {
    compiled: &'a Compiled,
    /// Index of the first operation.
    start: usize,
    slots: HashMap<usize, usize>,
    nodes: HashMap<usize, usize>,
    operations: Vec<Operation>,
}

impl<'a> Program<'a> {
    fn of(compiled: &'a Compiled) -> Self {
        Self { compiled, start: 0, slots: HashMap::new(), nodes: HashMap::new(), operations: Vec::new() }
    }

    fn operation(&mut self, operation: Operation) -> usize {
        self.operations.push(operation);
        self.start + self.operations.len() - 1
    }

    /// Index of the value of a node; its operands are added before it.
    fn node(&mut self, root: usize) -> usize {
        let operands = |op: &Op| match *op {
            Op::Add(a, b) | Op::Subtract(a, b) | Op::Multiply(a, b) | Op::Divide(a, b) => Some([a, b]),
            _ => None,
        };
        let mut left = vec![root];
        while let Some(&node) = left.last() {
            if self.nodes.contains_key(&node) {
                left.pop();
                continue;
            }
            let op = self.compiled.dag.ops[node];
            let before = left.len();
            left.extend(operands(&op).into_iter().flatten().filter(|of| !self.nodes.contains_key(of)));
            if left.len() > before {
                continue;
            }
            let of = |i: usize| self.nodes.get(&i).copied().unwrap_or(0);
            let index = match op {
                Op::Slot(slot) => self.slots.get(&slot).copied().unwrap_or(0),
                Op::Number { mantissa, decimals } => {
                    self.operation(Operation::Number('=', fraction(mantissa, decimals)))
                }
                Op::Add(a, b) => self.operation(Operation::Binary('+', of(a), of(b))),
                Op::Subtract(a, b) => self.operation(Operation::Binary('-', of(a), of(b))),
                Op::Multiply(a, b) => self.operation(Operation::Binary('*', of(a), of(b))),
                Op::Divide(a, b) => self.operation(Operation::Binary('/', of(a), of(b))),
                // refused by `check_shape`
                Op::Pi | Op::Primitive { .. } => 0,
            };
            self.nodes.insert(node, index);
        }
        self.nodes.get(&root).copied().unwrap_or(0)
    }
}

/// `mantissa / 10^decimals` as text.
fn fraction(mantissa: i128, decimals: i32) -> String {
    let zeros = "0".repeat(decimals.unsigned_abs() as usize);
    match decimals {
        0 => mantissa.to_string(),
        1.. => format!("{mantissa}/1{zeros}"),
        _ => format!("{mantissa}{zeros}"),
    }
}

/// Rows and witness in one field, in the columns of the certificate.
fn witness(
    model: &SystemModel,
    compiled: &Compiled,
    judgement: &Judgement,
    field: Field,
    columns: &[usize],
    rng: &mut SplitMix64,
) -> Result<(Filtration, Vec<WitnessedVerdict>), CertificateError> {
    let work = Work::new(model.work_limit);
    let unsolved =
        || not_covered("no point at which it is defined, or more work than the limit", "models with rows");
    let mut source =
        SystemRows::new(model, compiled, &judgement.layout, field, rng, &work).map_err(|_| unsolved())?;
    let mut space = Echelon::new(field, columns.len());
    let mut rows: Vec<(RowName, Vec<u64>)> = Vec::new();
    for order in 0.. {
        let mut output = 0;
        let more = space.rank() < columns.len()
            && source.emit(order, &mut |row| {
                output += 1;
                let name = RowName { segment: 1, order, component: output };
                rows.push((name, columns.iter().map(|&c| row[c]).collect()));
                space.insert(row)
            });
        if !more {
            break;
        }
    }
    if work.refused().is_some() || space.rank() < columns.len() && !source.is_done() {
        return Err(unsolved());
    }
    let filtration = Filtration::of(field, columns.len(), rows);
    let one = field.one();
    let units: Vec<_> = (0..columns.len()).map(|c| vec![(c, one)]).collect();
    let found = filtration.found(&units);
    Ok((filtration, found))
}

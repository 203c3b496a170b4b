//! Number of solutions of an observable unknown, against published verdicts, by hand, and by trying all
//! points of a small field.

use std::collections::{BTreeMap, BTreeSet};

use obsdeg_core::system::{
    NumberOfSolutions, SystemAnalysis, SystemOptions, analyze_system, json, model_file,
};
use obsdeg_exact::SplitMix64;

use crate::models::models;
use crate::program::cases;

fn counted(text: &str) -> SystemAnalysis {
    let model = model_file::read(text).unwrap_or_else(|e| panic!("{e}: {text}"));
    analyze_system(&model, SystemOptions::default()).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// Number of solutions of each observable and decided unknown, by name.
fn numbers(a: &SystemAnalysis) -> BTreeMap<&str, usize> {
    let number = |n: &NumberOfSolutions| match n {
        NumberOfSolutions::OneByExpression => Some(1),
        NumberOfSolutions::Counted(k) => Some(*k),
        NumberOfSolutions::Undecided(_) => None,
    };
    a.quantities
        .iter()
        .filter_map(|q| Some((q.name.as_str(), number(q.number_of_solutions.as_ref()?)?)))
        .collect()
}

/// Published global verdicts have one solution, published local verdicts several; all are decided.
#[test]
fn no_contradiction_with_published_verdicts() {
    let (mut decided, mut open) = (0, Vec::new());
    for (name, reference, text) in models() {
        let Some(published) = reference["expected_global_published"].as_object() else { continue };
        let model = json::read(&text).expect("a model");
        let a = analyze_system(&model, SystemOptions::default()).expect("judged");
        let numbers = numbers(&a);
        for (unknown, verdict) in published {
            let observable = a.quantities.iter().any(|q| q.name == *unknown && q.degree.is_some());
            match (verdict.as_str().expect("a word"), numbers.get(unknown.as_str())) {
                ("non", found) => assert!(!observable && found.is_none(), "{name}: {unknown}"),
                ("global", Some(1)) | ("local", Some(2..)) => decided += 1,
                (_, None) => open.push(format!("{name}: {unknown}")),
                (verdict, found) => panic!("{name}: {unknown} is {verdict}, found {found:?}"),
            }
        }
    }
    assert_eq!((decided, open), (57, Vec::new()));
}

/// Numbers of solutions by hand. Complex solutions count: p^3 has three.
#[test]
fn numbers_by_hand() {
    let of = |parameters: &[&str], outputs: &[&str]| {
        let list = |names: &[&str]| names.iter().map(|p| format!("{p} = {{}}\n")).collect::<String>();
        let y: String = outputs.iter().enumerate().map(|(i, y)| format!("y{i} = \"{y}\"\n")).collect();
        let text = format!(
            "name = \"m\"\n[states]\nx = \"-x\"\n[parameters]\n{}[outputs]\nz = \"x\"\n{y}",
            list(parameters)
        );
        let a = counted(&text);
        assert!(a.quantities.iter().all(|q| q.degree.is_none() == q.number_of_solutions.is_none()), "{a:?}");
        numbers(&a).into_iter().filter(|n| n.0 != "x").map(|(n, k)| (n.to_string(), k)).collect::<Vec<_>>()
    };
    let is = |found: Vec<(String, usize)>, expected: &[(&str, usize)]| {
        let expected: Vec<(String, usize)> = expected.iter().map(|(n, k)| (n.to_string(), *k)).collect();
        assert_eq!(found, expected);
    };
    is(of(&["p"], &["p"]), &[("p", 1)]);
    is(of(&["p"], &["p^2 + p"]), &[("p", 2)]);
    is(of(&["p"], &["p^3"]), &[("p", 3)]);
    is(of(&["p"], &["p^3", "p^2"]), &[("p", 1)]);
    is(of(&["p"], &["p^4 - p", "p^6"]), &[("p", 1)]);
    is(of(&["p", "q"], &["p + q", "p*q"]), &[("p", 2), ("q", 2)]);
    is(of(&["p", "q", "r"], &["p + q + r", "p*q + q*r + r*p", "p*q*r"]), &[("p", 3), ("q", 3), ("r", 3)]);
    // a common sign of two unknowns, and a sign of each
    is(of(&["p", "q"], &["p^2", "p*q"]), &[("p", 2), ("q", 2)]);
    is(of(&["p", "q", "r"], &["p^2", "q^2", "p*q", "r^3 + p"]), &[("p", 2), ("q", 2), ("r", 6)]);
    // fractions: p + 1/p; a zero of the denominator is no solution ((p-1)(p-q) = 0 has p = 1)
    is(of(&["p"], &["p + 1/p"]), &[("p", 2)]);
    is(of(&["p"], &["(p^2 - p)/(p - 1)"]), &[("p", 1)]);
    is(of(&["p", "q"], &["(p^2 - p)/(p - q)", "q"]), &[("p", 2), ("q", 1)]);
    // unknowns that a symmetry changes have no number, and do not affect the numbers of others
    is(of(&["p", "q", "r"], &["p*q", "r^2 + p*q*r"]), &[("r", 2)]);
    is(of(&["p", "q", "r"], &["p*q^2", "p*q^2*r"]), &[("r", 1)]);
}

/// Two exchangeable compartments and a third that is not, with known or unknown states.
#[test]
fn numbers_of_systems() {
    let twins = "name = \"twins\"\nparameters = [\"a\", \"b\"]\n[states]\nu = \"-a*u\"\nv = \"-b*v\"\n[outputs]\n\
                 y = \"u + v\"\n";
    let two = counted(twins);
    assert_eq!(numbers(&two), BTreeMap::from([("u", 2), ("v", 2), ("a", 2), ("b", 2)]));
    let three = twins.replace("[outputs]\ny = \"u + v\"", "w = \"-(a + b)*w\"\n[outputs]\ny = \"u + v + w\"");
    // the rates are a, b, a + b: only a and b are exchangeable
    assert_eq!(numbers(&counted(&three)), BTreeMap::from([("u", 2), ("v", 2), ("w", 1), ("a", 2), ("b", 2)]));
    // one more output determines a
    let with_output = twins.replace("[outputs]\n", "[outputs]\nz = \"a^2\"\n");
    assert_eq!(numbers(&counted(&with_output)), BTreeMap::from([("u", 1), ("v", 1), ("a", 1), ("b", 1)]));
    // in two experiments with the same rates everything is exchanged together
    let again = counted(&format!("experiments = 2\n{twins}"));
    assert_eq!(numbers(&again).values().copied().collect::<Vec<_>>(), [2; 6]);
    // a known jump of u distinguishes the two, and so does a constraint; a symmetric constraint does not
    let jump = counted(&format!("{twins}[[segment]]\n[[segment]]\ncarry = {{u = \"u + 1\"}}\n"));
    assert_eq!(numbers(&jump).values().copied().collect::<Vec<_>>(), [1; 4]);
    let constrained =
        |holds: &str| counted(&twins.replace("[states]", &format!("constraints = [\"{holds}\"]\n[states]")));
    assert_eq!(numbers(&constrained("u - 2*v = 1")).values().copied().collect::<Vec<_>>(), [1; 4]);
    assert_eq!(numbers(&constrained("u + v = 1")), numbers(&two));
    // an unknown constant input; an output shows its square only
    let pushed = "name = \"pushed\"\nparameters = [\"a\"]\nunknown_inputs = {w = \"constant\"}\n[states]\n\
                  x = \"-a*x + w^2\"\n[outputs]\ny = \"x\"\n";
    assert_eq!(numbers(&counted(pushed)), BTreeMap::from([("a", 1), ("w", 2), ("x", 1)]));
}

/// If the derivatives have no proven end, later orders could reduce several solutions: the number stays
/// undecided.
#[test]
fn special_starts_leave_it_open() {
    let text = |start: &str| {
        format!(
            "name = \"s\"\nparameters = [\"a\", \"b\"]\n[states]\nx = {{equation = \"a^2 + b*x\"{start}}}\n[outputs]\n\
             y = \"x\"\n"
        )
    };
    assert_eq!(numbers(&counted(&text(""))), BTreeMap::from([("a", 2), ("b", 1), ("x", 1)]));
    // linear in its state, and the sign of a is exchangeable
    assert_eq!(numbers(&counted(&text(", initial = 0"))), BTreeMap::from([("a", 2), ("b", 1)]));
    let cubic = |start: &str| text(start).replace("a^2 + b*x", "a^3 + a + b*x^2");
    assert_eq!(numbers(&counted(&cubic(""))), BTreeMap::from([("a", 3), ("b", 1), ("x", 1)]));
    let known = counted(&cubic(", initial = 0"));
    assert_eq!(numbers(&known), BTreeMap::from([("b", 1)]));
    let a = known.quantities.iter().find(|q| q.name == "a").expect("a");
    assert!(
        matches!(&a.number_of_solutions, Some(NumberOfSolutions::Undecided(r)) if r.contains("not generic")),
        "{a:?}"
    );
    // functions, and a work limit of zero
    let wave =
        counted("name = \"f\"\nparameters = [\"a\"]\n[states]\nx = \"a*sin(x)\"\n[outputs]\ny = \"x\"\n");
    let a = wave.quantities.iter().find(|q| q.name == "a").expect("a");
    assert!(
        matches!(&a.number_of_solutions, Some(NumberOfSolutions::Undecided(r)) if r.contains("without functions"))
    );
    let model = model_file::read(&text("")).expect("a model");
    let options = SystemOptions { count_limit: 0, relation_limit: 0, ..SystemOptions::default() };
    let none = analyze_system(&model, options).expect("judged");
    // an output and y''/y' are unique without counting
    assert_eq!(numbers(&none), BTreeMap::from([("b", 1), ("x", 1)]));
    assert_eq!(none.counting_order, None);
}

/// Polynomial with small coefficients: `(coefficient, exponents)`.
type Terms = Vec<(i64, Vec<u32>)>;

/// System over the field of `Q` elements; the first unknowns are states.
struct SmallFieldSystem {
    rates: Vec<Terms>,
    outputs: Vec<Terms>,
    unknowns: usize,
}

/// Order of the field, above any order of derivatives, so that orders have inverses.
const Q: i64 = 37;

impl SmallFieldSystem {
    fn draw(rng: &mut SplitMix64) -> Self {
        let unknowns = 2 + rng.below(2) as usize;
        let states = 1 + rng.below(2) as usize;
        let mut terms = |count: u64, degree: u64| -> Terms {
            let term = |rng: &mut SplitMix64| {
                let mut exponents = vec![0; unknowns];
                for _ in 0..1 + rng.below(degree) {
                    exponents[rng.below(unknowns as u64) as usize] += 1;
                }
                ([-2, -1, 1, 2, 3][rng.below(5) as usize], exponents)
            };
            (0..1 + rng.below(count)).map(|_| term(rng)).collect()
        };
        let rates = (0..states).map(|_| terms(2, 2)).collect();
        let outputs = (0..1 + states % 2).map(|_| terms(2, 3)).collect();
        Self { rates, outputs, unknowns }
    }

    fn name(&self, i: usize) -> String {
        if i < self.rates.len() { format!("x{i}") } else { format!("p{i}") }
    }

    fn text(&self) -> String {
        let formula = |terms: &Terms| {
            let term = |(c, exponents): &(i64, Vec<u32>)| {
                let powers = exponents.iter().enumerate().filter(|e| *e.1 > 0);
                let powers: Vec<String> = powers.map(|(i, e)| format!("{}^{e}", self.name(i))).collect();
                format!("({c})*{}", powers.join("*"))
            };
            terms.iter().map(term).collect::<Vec<_>>().join(" + ")
        };
        let states: String =
            self.rates.iter().enumerate().map(|(i, r)| format!("x{i} = \"{}\"\n", formula(r))).collect();
        let parameters: String =
            (self.rates.len()..self.unknowns).map(|i| format!("{} = {{}}\n", self.name(i))).collect();
        let outputs: String =
            self.outputs.iter().enumerate().map(|(i, y)| format!("y{i} = \"{}\"\n", formula(y))).collect();
        format!("name = \"tiny\"\n[states]\n{states}[parameters]\n{parameters}[outputs]\n{outputs}")
    }

    /// Taylor coefficients of the outputs from a point, up to an order.
    fn outputs(&self, point: &[i64], order: usize) -> Vec<i64> {
        let mut series = vec![[0; ORDERS]; self.unknowns];
        series.iter_mut().zip(point).for_each(|(x, &start)| x[0] = start);
        // terms are multiplied factor by factor, one coefficient at a time
        let mut rates: Vec<Vec<Product>> = self.rates.iter().map(products).collect();
        let mut outputs: Vec<Vec<Product>> = self.outputs.iter().map(products).collect();
        let inverse = |k: i64| (1..Q).find(|x| x * k % Q == 1).expect("a field");
        let mut out = Vec::new();
        for k in 0..=order {
            if k > 0 {
                let factor = inverse(k as i64);
                let next: Vec<i64> =
                    rates.iter_mut().map(|r| coefficient(r, &series, k - 1) * factor % Q).collect();
                series.iter_mut().zip(next).for_each(|(x, c)| x[k] = c);
            }
            out.extend(outputs.iter_mut().map(|y| coefficient(y, &series, k)));
        }
        out
    }
}

/// Number of coefficients of a series, above any order.
const ORDERS: usize = 16;

/// Coefficient of a term, its factors, and the series of the partial products of the factors.
type Product = (i64, Vec<(usize, [i64; ORDERS])>);

fn products(terms: &Terms) -> Vec<Product> {
    let factors = |exponents: &[u32]| {
        let repeated = exponents.iter().enumerate().flat_map(|(i, &e)| (0..e).map(move |_| i));
        repeated.map(|i| (i, [0; ORDERS])).collect()
    };
    terms.iter().map(|(c, exponents)| (*c, factors(exponents))).collect()
}

/// Coefficient `k` of a sum of terms whose lower coefficients were computed before.
fn coefficient(terms: &mut [Product], series: &[[i64; ORDERS]], k: usize) -> i64 {
    let mut sum: i64 = 0;
    for (c, factors) in terms {
        for f in 0..factors.len() {
            let x = &series[factors[f].0];
            let value = match f {
                0 => x[k],
                _ => (0..=k).map(|j| factors[f - 1].1[j] * x[k - j]).sum::<i64>() % Q,
            };
            factors[f].1[k] = value;
        }
        sum += *c * factors.last().map_or(1, |f| f.1[k]);
    }
    sum.rem_euclid(Q)
}

/// All points of a field of 37 elements are grouped by their outputs. For an unknown with k solutions, almost
/// no point has more than k values with the same outputs. For k up to 3 enough points have all k (all but
/// special points for 1 and 2, half for 3, by the density of primes that split).
#[test]
fn counts_are_those_of_all_points_of_a_small_field() {
    counts_by_points(cases(10, 20), cases(2, 3), &[1, 2]);
}

#[test]
#[ignore = "full length: .ci/run release"]
fn counts_are_those_of_all_points_at_length() {
    counts_by_points(60, 5, &[1, 2, 3]);
}

/// Counts of random systems, among them `least` unknowns with each number of solutions in `of`.
fn counts_by_points(systems: usize, least: usize, of: &[usize]) {
    let mut rng = SplitMix64::new(20);
    let mut seen = BTreeMap::new();
    for _ in 0..systems {
        let tiny = SmallFieldSystem::draw(&mut rng);
        let a = counted(&tiny.text());
        let numbers = numbers(&a);
        if numbers.is_empty() {
            continue;
        }
        // an expression contains derivatives of up to two orders beyond the degree
        let order = a.counting_order.unwrap_or(a.last_order + 2);
        let mut fibres: BTreeMap<Vec<i64>, Vec<Vec<i64>>> = BTreeMap::new();
        let all = Q.pow(tiny.unknowns as u32);
        for at in 0..all {
            let point: Vec<i64> = (0..tiny.unknowns as u32).map(|i| at / Q.pow(i) % Q).collect();
            fibres.entry(tiny.outputs(&point, order)).or_default().push(point);
        }
        for i in 0..tiny.unknowns {
            let Some(&k) = numbers.get(tiny.name(i).as_str()) else { continue };
            *seen.entry(k).or_insert(0) += 1;
            let (mut more, mut just) = (0, 0);
            for points in fibres.values() {
                let values = points.iter().map(|p| p[i]).collect::<BTreeSet<i64>>().len();
                more += if values > k { points.len() } else { 0 };
                just += if values == k { points.len() } else { 0 };
            }
            let share = |n: usize| n as f64 / all as f64;
            let enough = [0.0, 0.7, 0.7, 0.35].get(k).copied().unwrap_or(0.0);
            assert!(
                share(more) < 0.25 && share(just) > enough,
                "{}: {k} values of {}; more at {:.2}, all at {:.2} of the points",
                tiny.text(),
                tiny.name(i),
                share(more),
                share(just)
            );
        }
    }
    // enough unknowns of each kind
    assert!(of.iter().all(|k| seen.get(k).is_some_and(|n| *n >= least)), "{seen:?}");
}

/// An expression gives one solution only if everything on which it rests has one.
#[cfg(feature = "symbolica")]
#[test]
fn expressions_that_rest_on_what_is_local() {
    let of = |name: &str| {
        let file = format!("{}/tests/data/models/{name}.json", env!("CARGO_MANIFEST_DIR"));
        crate::program::json(&["analyze", "--format", "json", "--model", &file])
    };
    let number = |answer: &serde_json::Value, name: &str| {
        let list = answer["quantities"].as_array().expect("quantities").clone();
        let q = list.into_iter().find(|q| q["name"] == name).expect("an unknown");
        (q["number_of_solutions"].clone(), q["solution"].is_string())
    };
    // S and E have a second solution, with a and nu exchanged
    let seir = of("seir_known_population");
    for name in ["S", "E", "a", "nu"] {
        assert_eq!(number(&seir, name).0, serde_json::json!({"counted": 2}), "{name}");
    }
    assert!(number(&seir, "S").1 && number(&seir, "E").1, "{seir}");
    assert_eq!(number(&seir, "In"), ("one_by_expression".into(), true));
    // beyond its degree an unknown may have an expression: a, c, d have degree 4
    let prey = of("sian_lotka_volterra");
    for name in ["x1", "a", "c", "d"] {
        assert_eq!(number(&prey, name), ("one_by_expression".into(), true), "{name}");
    }
    let file = format!("{}/tests/data/models/seir_known_population.json", env!("CARGO_MANIFEST_DIR"));
    let table = crate::program::stdout(&crate::program::run(&["analyze", "--model", &file]));
    assert!(table.contains("2 solutions); in terms of others: see below"), "{table}");
}

/// Relations hold whatever the start is: the Goodwin oscillator with two known states. Its constants and x4
/// have one solution without that knowledge too.
#[test]
fn known_starts_leave_relations_as_they_are() {
    let goodwin = |start: &str| {
        format!(
            "name = \"goodwin\"\n[states]\n\
             x1 = \"-b*x1 + 1/(c + x4)\"\n\
             x2 = {{ equation = \"alpha*x1 - beta*x2\"{start} }}\n\
             x3 = {{ equation = \"gamma*x2 - delta*x3\"{start} }}\n\
             x4 = \"sigma*x4*(gamma*x2 - delta*x3)/x3\"\n\
             [parameters]\n{}\n[outputs]\ny = \"x1\"\n",
            ["b", "c", "alpha", "beta", "gamma", "delta", "sigma"].map(|p| format!("{p} = {{}}")).join("\n")
        )
    };
    let options = SystemOptions { relation_limit: 1000, ..SystemOptions::default() };
    for start in ["", ", initial = \"known\""] {
        let model = model_file::read(&goodwin(start)).unwrap_or_else(|e| panic!("{e}"));
        let found = analyze_system(&model, options).expect("judged");
        let numbers = numbers(&found);
        for name in ["b", "c", "sigma", "x1", "x4"] {
            assert_eq!(numbers.get(name), Some(&1), "{start}: {name}");
        }
    }
}

/// Known inputs and starts have one value; a start that is given by a parameter has those of the parameter.
#[test]
fn combinations_of_known_values() {
    let text = "name = \"m\"\ncombinations = [\"x^2\", \"a*x\", \"a*u\", \"q*x\", \"w\"]\n[states]\n\
                x = { equation = \"-a*x^2\", initial = \"known\" }\nw = { equation = \"0\", initial = \"q\" }\n\
                [parameters]\na = {}\nq = {}\n[known_inputs]\nu = \"generic\"\n\
                [outputs]\ny = \"x + u\"\nv = \"w^2\"\n";
    let found = counted(text);
    let is_one = |n: &Option<NumberOfSolutions>| matches!(n, Some(NumberOfSolutions::Counted(1)));
    let single: Vec<bool> = found.combinations.iter().map(|c| is_one(&c.number_of_solutions)).collect();
    assert_eq!(single, [true, true, true, false, false], "{found:#?}");
}

/// Numbers of values of combinations that are asked for, by hand: a and b are exchangeable.
#[test]
fn combinations_that_are_asked_for_are_counted() {
    let of = |discrete: &str, rates: [&str; 2]| {
        let text = format!(
            "name = \"m\"\n{discrete}combinations = [\"a + b\", \"a*b\", \"a - b\", \"a/b\", \"1/(a + b)\", \"a + k\", \"(a - b)^2\", \
             \"a*u\", \"c*z\", \"c^2*z^2\", \"c\"]\n[states]\nx = \"{}\"\nw = \"{}\"\nz = \"0\"\n[parameters]\na = {{}}\nb = {{}}\nc = {{}}\n\
             [constants]\nk = {{}}\n[known_inputs]\nu = \"generic\"\n[outputs]\ny = \"x + w + u\"\nv = \"c*z\"\n",
            rates[0], rates[1]
        );
        let found = counted(&text);
        let number = |n: &Option<NumberOfSolutions>| match n {
            Some(NumberOfSolutions::Counted(k)) => format!("{k}"),
            Some(NumberOfSolutions::Undecided(why)) if why.contains("known inputs") => "input".into(),
            Some(NumberOfSolutions::Undecided(why)) if why.contains("later steps may") => "later".into(),
            other => format!("{other:?}"),
        };
        found.combinations.iter().map(|c| number(&c.number_of_solutions)).collect::<Vec<_>>()
    };
    let expected = ["1", "1", "2", "2", "1", "2", "1", "input", "1", "1", "None"];
    assert_eq!(of("", ["-a*x", "-b*w"]), expected);
    // the input of a step is a known number there; of later steps nothing is known
    let expected = ["1", "1", "later", "later", "1", "later", "1", "later", "1", "1", "None"];
    assert_eq!(of("discrete = true\n", ["a*x", "b*w"]), expected);
}

//! Algebraic equations: the verdicts are those of the same system with the algebraic unknowns eliminated, or
//! differentiated, by hand.

use std::collections::BTreeMap;

use obsdeg_core::system::{NumberOfSolutions, SystemAnalysis, SystemOptions, analyze_system, model_file};
use obsdeg_exact::SplitMix64;

fn analyzed(text: &str) -> SystemAnalysis {
    let model = model_file::read(text).unwrap_or_else(|e| panic!("{e}: {text}"));
    // of two forms of a model one takes more work: here both are within the limit, or beyond it
    let options = SystemOptions { relation_limit: 0, ..SystemOptions::default() };
    analyze_system(&model, options).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// Status and degree by unknown.
fn verdicts(text: &str) -> BTreeMap<String, (String, Option<usize>)> {
    let a = analyzed(text);
    a.quantities.iter().map(|q| (q.name.clone(), (q.status.to_string(), q.degree))).collect()
}

/// Number of solutions by unknown, where it is decided.
fn numbers(text: &str) -> BTreeMap<String, usize> {
    let number = |n: NumberOfSolutions| match n {
        NumberOfSolutions::OneByExpression => Some(1),
        NumberOfSolutions::Counted(k) => Some(k),
        NumberOfSolutions::Undecided(_) => None,
    };
    let a = analyzed(text);
    let named = a.quantities.into_iter().map(|q| (q.name, q.number_of_solutions.and_then(number)));
    named.filter_map(|(name, k)| Some((name, k?))).collect()
}

/// Asserts that the unknowns in both models have the same verdicts; at least two are in both. Numbers of
/// solutions are the same where both are decided: that of a model with a known start may not be, as its
/// eliminated form is proven by being linear.
fn same(with: &str, by_hand: &str) {
    let with_numbers = numbers(with);
    for (name, k) in numbers(by_hand) {
        let found = with_numbers.get(&name);
        let may_be_open = by_hand.contains("initial") || !verdicts(with).contains_key(&name);
        assert!(
            found == Some(&k) || found.is_none() && may_be_open,
            "{name} {k} {found:?}: {with}\n{by_hand}"
        );
    }
    let (with_verdicts, expected) = (verdicts(with), verdicts(by_hand));
    let both: Vec<&String> = expected.keys().filter(|name| with_verdicts.contains_key(*name)).collect();
    assert!(both.len() > 1, "{with}\n{by_hand}");
    for name in both {
        let (found, expected) = (&with_verdicts[name], &expected[name]);
        // what moves no output may still move an algebraic unknown, which is an unknown of this model
        let moves_one = expected.0 == "not excited" && found == &("inseparable".to_string(), None);
        assert!(found == expected || moves_one, "{name}: {found:?}, {expected:?} of\n{with}\n{by_hand}");
    }
}

fn model(head: &str, states: &str, algebraic: &str, parameters: &[&str], outputs: &str) -> String {
    let parameters: Vec<String> = parameters.iter().map(|p| format!("{p:?}")).collect();
    let algebraic = if algebraic.is_empty() { String::new() } else { format!("[algebraic]\n{algebraic}\n") };
    format!(
        "name = \"m\"\nparameters = [{}]\n{head}\n[states]\n{states}\n{algebraic}[outputs]\n{outputs}\n",
        parameters.join(", ")
    )
}

#[test]
fn eliminated_by_hand() {
    // an output that is an algebraic unknown
    same(
        &model("", "x = \"-p*z\"", "z = \"z - q*x\"", &["p", "q"], "y = \"z\""),
        &model("", "x = \"-p*q*x\"", "", &["p", "q"], "y = \"q*x\""),
    );
    // a current divider: two equations for two currents, one through the other
    same(
        &model("", "x = \"-c*i\"", "i = \"i + k - x\"\nk = \"a*i - b*k\"", &["a", "b", "c"], "y = \"k\""),
        &model("", "x = \"-c*b*x/(a + b)\"", "", &["a", "b", "c"], "y = \"a*x/(a + b)\""),
    );
    // the first equation does not hold the first unknown
    same(
        &model("", "x = \"i - x\"", "i = \"k - a*x\"\nk = \"i*k - x\"", &["a"], "y = \"x\""),
        &model("", "x = \"1/a - x\"", "", &["a"], "y = \"x\""),
    );
    // the first unknown cancels in the first equation
    same(
        &model("", "x = \"i - x\"", "i = \"(a - a)*i + k - a*x\"\nk = \"i*k - x\"", &["a"], "y = \"x\""),
        &model("", "x = \"1/a - x\"", "", &["a"], "y = \"x\""),
    );
    // a known input in an equation, a constant one, and definitions
    for kind in ["generic", "constant"] {
        let input = format!("known_inputs = {{ u = \"{kind}\" }}");
        let defined = format!("{input}\ndefinitions = {{ drop = \"r*(u - x)\" }}");
        same(
            &model(&defined, "x = \"z - k*x\"", "z = \"z - drop\"", &["r", "k"], "y = \"z\""),
            &model(&input, "x = \"r*(u - x) - k*x\"", "", &["r", "k"], "y = \"r*(u - x)\""),
        );
    }
    // two experiments
    same(
        &model("experiments = 2", "x = \"-p*z\"", "z = \"z - q*x\"", &["p", "q"], "y = \"x\""),
        &model("experiments = 2", "x = \"-p*q*x\"", "", &["p", "q"], "y = \"x\""),
    );
}

/// Starts that are known, or given by numbers and formulas: the end of the derivatives is proven too.
#[test]
fn known_starts() {
    for start in ["known", "1", "q", "p + 1/2", "0"] {
        let x = |equation: &str| format!("x = {{ equation = \"{equation}\", initial = \"{start}\" }}");
        // a linear equation, alone and through a definition
        let by_hand = model("", &x("-p*q*x"), "", &["p", "q"], "y = \"x\"");
        same(&model("", &x("-p*z"), "z = \"z - q*x\"", &["p", "q"], "y = \"x\""), &by_hand);
        let defined = "definitions = { way = \"q*x\", unused = \"1/x\" }";
        same(&model(defined, &x("-p*z"), "z = \"z - way\"", &["p", "q"], "y = \"x\""), &by_hand);
        // a rational one, with a second state whose start is unknown
        same(
            &model(
                "",
                &format!("{}\nw = \"-p*z*w\"", x("-r*z + w")),
                "z = \"z*(1 + q*x) - x\"",
                &["p", "q", "r"],
                "y = \"x\"",
            ),
            &model(
                "",
                &format!("{}\nw = \"-p*x/(1 + q*x)*w\"", x("-r*x/(1 + q*x) + w")),
                "",
                &["p", "q", "r"],
                "y = \"x\"",
            ),
        );
        // a quadratic one: its derivative by hand, whose start the equation gives
        let quadratic = model("", &x("-x + z"), "z = \"z^2 + z - p*x - q\"", &["p", "q"], "y = \"z\"");
        let states = format!("{}\nz = \"p*(-x + z)/(2*z + 1)\"", x("-x + z"));
        let shown = verdicts(&quadratic);
        let hand =
            verdicts(&model("constraints = [\"z^2 + z = p*x + q\"]", &states, "", &["p", "q"], "y = \"z\""));
        assert_eq!(shown, hand, "{start}");
        assert!(shown.values().all(|(status, _)| !status.contains("order")), "{shown:?}");
    }
}

/// Thirty linear equations, each with all unknowns: all are multiples of p*x, so that all are determined.
#[test]
fn many_equations() {
    let coefficient = |i: usize, j: usize| i * j % 7 + if i == j { 6 } else { 1 };
    let equation = |i: usize| {
        let terms: Vec<String> = (1..=30).map(|j| format!("{}*z{j}", coefficient(i, j))).collect();
        format!("z{i} = \"{} - {i}*p*x\"\n", terms.join(" + "))
    };
    let equations: String = (1..=30).map(equation).collect();
    let verdicts = verdicts(&model("", "x = \"-z1\"", &equations, &["p"], "y = \"x\""));
    assert_eq!(verdicts.len(), 32);
    let first_order = |name: &&String| verdicts[*name] == ("observable".into(), Some(1));
    assert_eq!(verdicts.keys().filter(first_order).count(), 31);
    assert_eq!(verdicts["x"], ("observable".into(), Some(0)));
}

/// A quadratic equation, whose solution no rational formula gives: its derivative by hand, with the equation
/// as a constraint.
#[test]
fn differentiated_by_hand() {
    same(
        &model("", "x = \"-a*x + z\"", "z = \"z^2 + z - b*x\"", &["a", "b"], "y = \"x\""),
        &model(
            "constraints = [\"z^2 + z = b*x\"]",
            "x = \"-a*x + z\"\nz = \"b*(-a*x + z)/(2*z + 1)\"",
            "",
            &["a", "b"],
            "y = \"x\"",
        ),
    );
    // a vector of algebraic unknowns
    same(
        &model(
            "",
            "x = \"-v[1]*x\"",
            "\"v[2]\" = \"[v[1]*v[2] - a*x, v[1] + v[2] - b]\"",
            &["a", "b"],
            "y = \"x\"",
        ),
        &model(
            "constraints = [\"v1*v2 = a*x\", \"v1 + v2 = b\"]",
            "x = \"-v1*x\"\nv1 = \"-a*v1*x/(v2 - v1)\"\nv2 = \"a*v1*x/(v2 - v1)\"",
            "",
            &["a", "b"],
            "y = \"x\"",
        ),
    );
}

/// Random linear systems with two algebraic unknowns, eliminated by Cramer's rule.
#[test]
fn random_linear_systems() {
    are_those_by_hand(12);
}

#[test]
#[ignore = "full length: .ci/run release"]
fn two_hundred_random_linear_systems() {
    are_those_by_hand(200);
}

/// Compares random linear systems with the same ones whose algebraic unknowns were eliminated by hand.
fn are_those_by_hand(systems: usize) {
    let mut rng = SplitMix64::new(38_001_128);
    let (mut tried, mut lost, mut seen) = (0, 0, 0);
    let starts = ["", "", ", initial = \"known\"", ", initial = \"2\"", ", initial = \"p\""];
    while tried < systems {
        let names = ["p", "q", "r"];
        let mut entry = || match rng.below(6) {
            0 | 1 => "0".to_string(),
            2 | 3 => (1 + rng.below(3)).to_string(),
            k => names[(k as usize + rng.below(2) as usize) % 3].to_string(),
        };
        let [a, b, c, d] = [(); 4].map(|()| [[entry(), entry()], [entry(), entry()]]);
        let [e, f] = [(); 2].map(|()| [entry(), entry()]);
        // 0 = c x + d z
        let det = format!("({}*({}) - {}*({}))", d[0][0], d[1][1], d[0][1], d[1][0]);
        let singular = |i: usize, j: usize| d[i][j] == "0";
        if (singular(0, 0) || singular(1, 1)) && (singular(0, 1) || singular(1, 0)) || d[0] == d[1] {
            continue;
        }
        let right = |i: usize| format!("({}*x1 + {}*x2)", c[i][0], c[i][1]);
        let z1 = format!("(({}*{} - {}*{})/{det})", d[0][1], right(1), d[1][1], right(0));
        let z2 = format!("(({}*{} - {}*{})/{det})", d[1][0], right(0), d[0][0], right(1));
        let rate = |i: usize, z1: &str, z2: &str| {
            format!("{}*x1 + {}*x2 + {}*{z1} + {}*{z2}", a[i][0], a[i][1], b[i][0], b[i][1])
        };
        let output =
            |z1: &str, z2: &str| format!("{}*x1 + {}*x2 + {}*{z1} + {}*{z2}", e[0], e[1], f[0], f[1]);
        let start = starts[rng.below(5) as usize];
        let states = |z1: &str, z2: &str| {
            let x1 = format!("x1 = {{ equation = \"{}\"{start} }}", rate(0, z1, z2));
            format!("{x1}\nx2 = \"{}\"", rate(1, z1, z2))
        };
        let equation = |i: usize| format!("{} + {}*z1 + {}*z2", right(i), d[i][0], d[i][1]);
        let algebraic = format!("z1 = \"{}\"\nz2 = \"{}\"", equation(0), equation(1));
        let with =
            model("", &states("z1", "z2"), &algebraic, &names, &format!("y = \"{}\"", output("z1", "z2")));
        let by_hand = model("", &states(&z1, &z2), "", &names, &format!("y = \"{}\"", output(&z1, &z2)));
        // a determinant may still vanish, as 1*2 - 2*1
        let Ok(hand) = model_file::read(&by_hand)
            .map_err(|_| ())
            .and_then(|m| analyze_system(&m, SystemOptions::default()).map_err(|_| ()))
        else {
            continue;
        };
        same(&with, &by_hand);
        tried += 1;
        let observable = hand.quantities.iter().filter(|q| q.degree.is_some()).count();
        (seen, lost) = (seen + observable, lost + hand.quantities.len() - observable);
    }
    assert!(2 * lost > systems && 2 * seen > systems, "{lost}, {seen}");
}

/// The answer shows the equations as written, and what is not possible is named.
#[test]
fn equations_and_refusals() {
    let a = analyzed(&model("", "x = \"-p*z\"", "z = \"z - q*x\"", &["p", "q"], "y = \"z\""));
    assert_eq!(a.equations, ["x' = -p*z", "0 = z - q*x", "y = z"]);
    assert_eq!(a.constraints, ["z - q*x = 0"]);
    assert_eq!(a.quantities.iter().map(|q| q.name.as_str()).collect::<Vec<_>>(), ["x", "z", "p", "q"]);
    assert_eq!(
        a.quantities.iter().map(|q| q.kind.as_str()).collect::<Vec<_>>(),
        ["state", "algebraic", "parameter", "parameter"]
    );
    let refused = |text: &str, word: &str| {
        let read = model_file::read(text).map_err(|e| e.to_string());
        let found = read.and_then(|m| {
            analyze_system(&m, SystemOptions::default()).map(|_| ()).map_err(|e| e.to_string())
        });
        let error = found.expect_err(text);
        assert!(error.contains(word), "{error}: {text}");
    };
    let one = |head: &str, equation: &str| {
        model(head, "x = \"-z\"", &format!("z = \"{equation}\""), &["p"], "y = \"x\"")
    };
    refused(&one("", "x - p"), "index 1");
    refused(&one("", "0*z - x"), "index 1");
    refused(&one("", "x + (p - p)*z"), "do not determine `z`");
    refused(&one("constants = { k = 0 }", "x + k*z"), "do not determine `z`");
    let two = |i: &str, k: &str| {
        let equations = format!("i = \"{i}\"\nk = \"{k}\"");
        model("", "x = \"i - x\"", &equations, &["p"], "y = \"x + k\"")
    };
    refused(&two("i + k - x", "2*i + 2*k - 2*x"), "do not determine `k`");
    // the coefficient of k's rate is zero where the first equation holds
    refused(&two("i - x", "x + (i - x)*k - p"), "(index 1)");
    refused(
        &model("", "x = \"-z\"", "z = { equation = \"z - x\", initial = \"5\" }", &[], "y = \"x\""),
        "a start",
    );
    refused(&one("", "z - sin(x)"), "a function");
    refused(&one("", "z - t*x"), "time");
    refused(&one("", "z - x^p"), "power");
    refused(&one("unknown_inputs = { w = \"arbitrary\" }", "z - w"), "unknown input `w`");
    refused(&one("known_inputs = { u = { polynomial = 2 } }", "z - u"), "generic or constant");
    refused(&one("discrete = true", "z - x"), "continuous time");
    refused(&one("", "z - nobody"), "nobody");
}

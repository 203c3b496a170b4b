//! Sentences on constraints: refused constraints have no usable real point, judged ones have one.

use obsdeg_core::language::{Names, evaluate_f64, parse_with};
use obsdeg_core::system::{ModelError, SystemAnalysis, SystemOptions, analyze_system, model_file};

use crate::program::cases;

/// Answer on a model with constant states x and y, outputs y and a, and the given constraints, or the error.
fn judged(constraints: &[&str], rest: &str, seed: u64) -> Result<SystemAnalysis, ModelError> {
    let list: Vec<String> = constraints.iter().map(|c| format!("'{c}'")).collect();
    let text = format!(
        "name='m'\nconstraints=[{}]\nparameters=['a']\n[states]\nx='0'\ny='0'\n[outputs]\nz='y'\nw='a'\n{rest}",
        list.join(", ")
    );
    model_file::read(&text).and_then(|m| {
        analyze_system(&m, SystemOptions { seed, solutions: false, ..SystemOptions::default() })
    })
}

fn refusal(constraints: &[&str], rest: &str) -> String {
    match judged(constraints, rest, 1) {
        Ok(a) => panic!("{constraints:?}: judged, {:?}", a.rank_profile),
        Err(error) => error.to_string(),
    }
}

/// Difference of the two sides of an equation in x, y and a.
fn difference(constraint: &str) -> impl Fn([f64; 3]) -> f64 + use<> {
    let (left, right) = constraint.split_once(" = ").expect("an equation");
    let text = format!("({}) - ({right})", left.replace("norm([x, y])", "sqrt(x^2 + y^2)"));
    let e = parse_with(&text, Names::Plain).expect("an expression");
    move |p| {
        evaluate_f64(&e, &|name| match name {
            "x" => p[0],
            "y" => p[1],
            "a" => p[2],
            _ => f64::NAN,
        })
    }
}

/// Points on a grid from -3 to 3.
fn grid() -> impl Iterator<Item = [f64; 3]> {
    let line = || (-12..=12).map(|k| f64::from(k) / 4.0);
    line().flat_map(move |x| line().flat_map(move |y| line().map(move |a| [x, y, a])))
}

/// Sides with contradicting signs have no real point, and a grid of points confirms it. Sides with agreeing
/// signs are no reason for a refusal.
#[test]
fn sides_of_other_signs_are_refused() {
    for constraint in [
        "norm([x, y]) = -1 - a^2",
        "x^2 + y^2 = -1",
        "x^2 + y^2 + 1/(x^2 + 1) = 0",
        "x^10 + (x - y)^4 = -a^2 - 0.5",
        "-x^2 - 3 = (x*y)^2",
    ] {
        let said = refusal(&[constraint], "");
        assert!(said.contains("no real point meets it"), "{constraint}: {said}");
        let of = difference(constraint);
        let signs: Vec<f64> = grid().map(|p| of(p).signum()).collect();
        assert!(signs.iter().all(|s| *s == signs[0]), "{constraint}");
    }
    // the value of a constant decides
    for (value, refused) in
        [("'-1'", true), ("'-sqrt(2)'", true), ("'2 - 3'", true), ("'1'", false), ("'3 - 2'", false)]
    {
        for constraint in ["norm([x, y]) = r", "x^2 + y^2 = r"] {
            let found = judged(&[constraint], &format!("[constants]\nr={value}"), 1);
            match found {
                Ok(a) => assert!(!refused && a.rank == 3, "{constraint} {value}"),
                Err(e) => {
                    assert!(refused && e.to_string().contains("no real point meets it"), "{value}: {e}")
                }
            }
        }
    }
    let said = refusal(&["sqrt(x) = -y^2"], "");
    assert!(said.contains("holds only where both sides are zero"), "{said}");
    // a root equals an expression that may have either sign
    assert_eq!(judged(&["sqrt(x) = a"], "", 1).expect("judged").rank, 3);
}

/// Constraints with real points are judged for every seed; their points are known by hand.
#[test]
fn points_are_found_whatever_the_seed() {
    let golden = [(3.0 + 5f64.sqrt()) / 2.0, (3.0 - 5f64.sqrt()) / 2.0];
    let fifth = 5f64.powf(0.1);
    for (constraints, point) in [
        (&["x^10 = 5"][..], [fifth, 0.0]),
        (&["x^100 = 5"], [5f64.powf(0.01), 0.0]),
        (&["x^5 - x = 1"], [1.167_303_978_261_418_7, 0.0]),
        (&["x*y = 1", "x + y = 3"], golden),
        (&["x^1000 + y^1000 = 2"], [1.0, 1.0]),
        (&["x^2 + y^2 = 2", "x*y = 1/2"], [(1.0 + 3f64.sqrt()) / 2.0, (3f64.sqrt() - 1.0) / 2.0]),
        (&["x^7*y^3 = 1e30"], [1000.0, 1000.0]),
    ] {
        for constraint in constraints {
            let of = difference(constraint);
            assert!(of([point[0], point[1], 0.0]).abs() < 1e-9 * (1.0 + of([0.0; 3]).abs()), "{constraint}");
        }
        for seed in 1..=5 {
            let a = judged(constraints, "", seed).unwrap_or_else(|e| panic!("{constraints:?}, {seed}: {e}"));
            // y and a are outputs; x follows from a constraint
            let x = a.quantities.iter().find(|q| q.name == "x").expect("x");
            assert_eq!((a.rank, x.degree), (3, Some(0)), "{constraints:?} {seed}");
        }
    }
}

/// A product with one factor that has real points gets the verdicts of that factor: x = 1 determines x, x^2 +
/// y^2 = 0 would determine neither.
#[test]
fn verdicts_are_those_of_real_points() {
    for seed in 1..=8 {
        let text =
            "name='m'\nconstraints=['(x^2 + y^2)*(x - 1) = 0']\n[states]\nx='0'\ny='0'\n[outputs]\nz='x'";
        let model = model_file::read(text).expect("a model");
        let a = analyze_system(&model, SystemOptions { seed, solutions: false, ..SystemOptions::default() });
        let a = a.expect("judged");
        let degree = |n: &str| a.quantities.iter().find(|q| q.name == n).expect("it").degree;
        assert_eq!((a.rank, degree("x"), degree("y")), (1, Some(0), None), "{seed}");
    }
}

/// An unknown that only a constraint determines: with R^2 = 4 its number of solutions is undecided, with R =
/// 2 it is one. S and I have as many as without the constraint.
#[test]
fn what_constraints_alone_hold_is_counted() {
    use obsdeg_core::system::NumberOfSolutions as Number;
    let counted = |constraint: &str| {
        let text =
            format!("name='m'\n{constraint}\n[states]\nS='-S*I'\nI='S*I - I'\nR='I'\n[outputs]\ny='I'");
        let model = model_file::read(&text).expect("a model");
        let a = analyze_system(&model, SystemOptions::default()).expect("judged");
        ["S", "I", "R"]
            .map(|n| a.quantities.iter().find(|q| q.name == n).expect("it").number_of_solutions.clone())
    };
    let [s, i, none] = counted("");
    assert_eq!((&s, &i, none), (&Some(Number::OneByExpression), &Some(Number::OneByExpression), None));
    let [with_s, with_i, r] = counted("constraints=['R^2 = 4']");
    assert_eq!((s, i), (with_s, with_i));
    let Some(Number::Undecided(reason)) = r else { panic!("{r:?}") };
    assert!(reason.contains("constraints are not generic: there are several"), "{reason}");
    let [_, _, r] = counted("constraints=['R = 2']");
    assert_eq!(r, Some(Number::Counted(1)));
}

/// If no point is found, the message states the number of starts. A point given in the file is used, in prime
/// fields and in many digits.
#[test]
fn tries_are_said_and_given_points_used() {
    // positive everywhere, which the signs of the terms do not show
    let said = refusal(&["x^2 + y^2 + x*y + 1 = 0"], "");
    assert!(said.contains("no real point was found") && said.contains("from 200 starts"), "{said}");
    assert!(said.contains("give it under [simulation.values]"), "{said}");
    let of = difference("x^2 + y^2 + x*y + 1 = 0");
    assert!(grid().all(|p| of(p) > 0.0));
    let far = "(x - 100000)^2 + (y - 100000)^2 + (x - 100000)^2*(y - 100000)^2 = 0.000001";
    let values = "[simulation]\nvalues={x=100000.001, y=100000.0}";
    assert_eq!(judged(&[far], values, 1).expect("a point is given").rank, 3);
    let text = format!(
        "name='m'\nconstraints=['{far}']\n[states]\nx='0'\ny='0'\n[outputs]\nz='sqrt(y) + abs(x)'\n{values}"
    );
    let model = model_file::read(&text).expect("a model");
    let a = analyze_system(&model, SystemOptions { solutions: false, ..SystemOptions::default() });
    let a = a.unwrap_or_else(|e| panic!("in many digits: {e}"));
    assert!(a.digits.is_some() && a.rank == 2, "{:?}", a.rank_profile);
}

/// Expanded squares plus a positive number have no real point. Points far away, where large terms cancel, are
/// not accepted.
#[test]
fn sums_of_expanded_squares_have_no_point() {
    for (constraint, squares) in [
        ("x^2 + y^2 = 2*x*y - 1", "(x - y)^2 + 1"),
        ("x^2*y^2 - 2*x*y + 1 + x^2 = 0", "(x*y - 1)^2 + x^2"),
        ("x^4 - 2*x^2*y^2 + y^4 + 1 = 0", "(x^2 - y^2)^2 + 1"),
    ]
    .into_iter()
    .take(cases(2, 3))
    {
        let (of, sum) = (difference(constraint), difference(&format!("{squares} = 0")));
        for p in grid() {
            let (a, b) = (of(p), sum(p));
            assert!((a - b).abs() < 1e-9 * (1.0 + b) && b > 0.0, "{constraint}");
        }
        let given = "[simulation]\nvalues={x=0.5, y=0.25}";
        for rest in if squares.ends_with("y)^2 + 1") { vec!["", given] } else { vec![""] } {
            let said = refusal(&[constraint], rest);
            assert!(said.contains("no real point was found"), "{constraint}: {said}");
            let advice = if rest.is_empty() { "give it under" } else { "give values nearer to it" };
            assert!(said.contains(advice), "{said}");
        }
    }
}

/// Constraints with several solution branches are judged on one of them, and the answer says so.
#[test]
fn one_of_several_ways_is_named() {
    for (constraint, named) in [("x^2 - y^2 = 0", true), ("x*y = 0", false), ("x + y = 1", false)] {
        let a = judged(&[constraint], "", 1).expect("judged");
        let text = obsdeg_report::written(
            &a,
            obsdeg_report::Format::Table,
            obsdeg_report::TerminalLayout::default(),
        );
        let text = text.expect("text").split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(text.contains("can hold in several ways"), named, "{text}");
    }
}

/// Symmetries, combinations and remedies belong to the branch of the constraint on which the verdicts are
/// judged. By hand: with x^2 = y^2 z^2 and s = x - y z, two scalings along x = y z affect nothing, and x/(y
/// z) is 1 there. With (x - y)(x + y - z) = 0 and s = (x - y)(1 + z), only z is free along x = y.
#[test]
fn all_that_is_said_is_of_one_way() {
    let answer = |constraint: &str, outputs: &str, seed: u64| {
        let text = format!(
            "name='m'\nconstraints=['{constraint}']\nparameters=['x', 'y', 'z']\n[outputs]\n{outputs}"
        );
        let model = model_file::read(&text).expect("a model");
        let options = SystemOptions { seed, solutions: false, ..SystemOptions::default() };
        analyze_system(&model, options).unwrap_or_else(|e| panic!("{constraint} {seed}: {e}"))
    };
    let mut seen = [0; 2];
    for seed in 1..=8 {
        let a = answer("x^2 = y^2*z^2", "s='x - y*z'", seed);
        let combinations: Vec<&str> = a.invariants.iter().map(|i| i.expression.as_str()).collect();
        assert!(a.other_directions.is_empty(), "{seed}: {:?}", a.other_directions);
        assert_eq!(a.symmetries.len(), a.unobservable_directions, "{seed}");
        match a.rank {
            1 => assert_eq!(combinations, ["x/(y*z)"], "{seed}"),
            rank => assert_eq!(rank, 2, "{seed}"),
        }
        seen[0] += usize::from(a.rank == 1);
        let a = answer("(x - y)*(x + y - z) = 0", "s='x - y + z*(x - y)'", seed);
        let text = obsdeg_report::written(
            &a,
            obsdeg_report::Format::Table,
            obsdeg_report::TerminalLayout::default(),
        );
        let text = text.expect("text").split_whitespace().collect::<Vec<_>>().join(" ");
        if a.rank == 1 {
            for wrong in ["z: know x", "z: know y", "z: know one of"] {
                assert!(!text.contains(wrong), "{seed}: {text}");
            }
        }
        seen[1] += usize::from(a.rank == 1);
    }
    assert!(seen.iter().all(|n| *n > 0), "{seen:?}");
}

/// Constraints with dependent gradients at their points are refused, since a verdict from the gradients would
/// be wrong.
#[test]
#[ignore = "seconds: .ci/run release"]
fn dependent_gradients_are_refused() {
    for (constraints, point) in [
        (&["x^2 + y^2 = 0"][..], [0.0, 0.0]),
        (&["(x - y)^2 = 0"], [0.7, 0.7]),
        (&["(x - y)^3 = 0"], [0.7, 0.7]),
        (&["x^4 + y^4 = x^2*y^2"], [0.0, 0.0]),
        (&["x^2 + y^2 = 1", "x = 1"], [1.0, 0.0]),
        (&["x^2 + y^2 = 1", "x*y = 1/2"], [0.5f64.sqrt(), 0.5f64.sqrt()]),
    ] {
        let given = format!("[simulation]\nvalues={{x={:?}, y={:?}}}", point[0], point[1]);
        for rest in ["", &given] {
            let said = refusal(constraints, rest);
            assert!(said.contains("gradient vanishes"), "{constraints:?}: {said}");
        }
        // two columns of finite differences: all minors vanish
        let gradient = |constraint: &&str| {
            let (of, h) = (difference(constraint), 1e-6);
            let at = |dx: f64, dy: f64| of([point[0] + dx, point[1] + dy, 0.0]);
            assert!(at(0.0, 0.0).abs() < 1e-12, "{constraint}");
            [(at(h, 0.0) - at(-h, 0.0)) / (2.0 * h), (at(0.0, h) - at(0.0, -h)) / (2.0 * h)]
        };
        let rows: Vec<[f64; 2]> = constraints.iter().map(gradient).collect();
        match rows[..] {
            [one] => assert!(one.iter().all(|x| x.abs() < 1e-6), "{constraints:?}"),
            [a, b] => assert!((a[0] * b[1] - a[1] * b[0]).abs() < 1e-6, "{constraints:?}"),
            _ => panic!("{constraints:?}"),
        }
    }
    // redundant constraints are accepted, and so is a product that vanishes elsewhere with independent
    // gradients
    for constraints in [&["x = 1", "y = 2", "x + y = 3"][..], &["x^2 = 1", "x = 1"], &["x^2*(y - 2) = 0"]] {
        for seed in 1..=4 {
            let a = judged(constraints, "", seed).unwrap_or_else(|e| panic!("{constraints:?}: {e}"));
            assert_eq!(a.rank, if constraints.len() > 1 { 3 } else { 2 }, "{constraints:?}");
        }
    }
}

/// A product vanishes where one of its factors vanishes. The chosen factor does not depend on the seed,
/// follows the given values and is named. Verdicts are those of the model with the factor in place of the
/// product.
#[test]
fn products_are_judged_by_the_factor_that_is_named() {
    let point = |x: f64, y: f64| format!("[simulation]\nvalues={{x={x}, y={y}}}");
    for (constraints, rest, of, factor, others) in [
        (&["x*y = 0"][..], String::new(), &["x = 0"][..], "x", &["y"][..]),
        (&["x*y = 0"], point(2.0, 0.0), &["y = 0"], "y", &["x"]),
        (&["x*y = 0"], point(2.0, 3.0), &["x = 0"], "x", &["y"]),
        (&["0 = (x - y)*(x + y - a)"], String::new(), &["x - y = 0"], "x - y", &["x + y - a"]),
        (&["(x^2 + 1)*(y - 2)^2/3 = 0"], String::new(), &["y - 2 = 0"], "y - 2", &["x^2 + 1"]),
        (&["x = 1", "-(x*y) = 0"], String::new(), &["x = 1", "y = 0"], "y", &["x"]),
        (&["x*y*(x + y + a) = 0"], point(1.0, 1.0), &["x + y + a = 0"], "x + y + a", &["x", "y"]),
        (&["y = 0", "x*y = 0"], String::new(), &["y = 0"], "y", &["x"]),
    ] {
        for seed in 1..=6 {
            let a =
                judged(constraints, &rest, seed).unwrap_or_else(|e| panic!("{constraints:?}, {seed}: {e}"));
            let plain = judged(of, "", seed).expect("judged");
            let verdicts = |a: &SystemAnalysis| -> Vec<_> {
                a.quantities.iter().map(|q| (q.name.clone(), q.status, q.degree)).collect()
            };
            assert_eq!(verdicts(&a), verdicts(&plain), "{constraints:?}, {seed}");
            assert_eq!((a.rank, a.symmetries.len()), (plain.rank, plain.symmetries.len()), "{constraints:?}");
            let [way] = &a.constraint_factors[..] else { panic!("{:?}", a.constraint_factors) };
            let own: Vec<String> = others.iter().map(|o| o.to_string()).collect();
            assert_eq!((way.factor.as_str(), &way.others), (factor, &own));
            assert_eq!(way.given, rest.contains("y=0"), "{constraints:?} {rest}");
        }
        let a = judged(constraints, &rest, 1).expect("judged");
        let text = obsdeg_report::written(
            &a,
            obsdeg_report::Format::Table,
            obsdeg_report::TerminalLayout::default(),
        );
        let text = text.expect("text").split_whitespace().collect::<Vec<_>>().join(" ");
        let ways: Vec<String> = others.iter().map(|o| format!("{o} = 0")).collect();
        let said = format!("holds where {factor} = 0 or where {}", ways.join(" or where "));
        assert!(text.contains(&said), "{said}: {text}");
    }
}

/// The order of constraints does not matter: those that touch at their points may come in any order. By hand:
/// x = y = 1/sqrt(2), or with both signs changed.
#[test]
fn constraints_are_met_in_any_order() {
    let all = ["x^2 + y^2 = 1", "x^4 + y^4 = 1/2", "x = y"];
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        let a = judged(&order.map(|k| all[k]), "", 1).unwrap_or_else(|e| panic!("{order:?}: {e}"));
        assert_eq!(a.rank, 3, "{order:?}");
    }
}

/// Given values that meet a constraint exactly at a vanishing gradient: the message names the gradient.
#[test]
fn a_vanishing_gradient_at_given_values_is_said() {
    for (constraint, x, y) in [
        ("x^2*y^2 - 2*x*y + 1 + x^2 - 2000*x + 1000000 = 0", 1000.0, 0.001),
        ("x^2 - 2*x + 1 + 1000000*y^2 - 2000000*y + 1000000 = 0", 1.0, 1.0),
    ] {
        let said = refusal(&[constraint], &format!("[simulation]\nvalues={{x={x:?}, y={y:?}}}"));
        assert!(said.contains("gradient vanishes"), "{constraint}: {said}");
    }
}

/// The chosen factor leaves the most unknowns free, allows the outputs to be defined, and is the same for all
/// experiments. A quotient of unknowns is not split into factors.
#[test]
fn factors_are_taken_that_can_be() {
    let answer = |text: &str| {
        let model = model_file::read(&format!("name='m'\n{text}")).unwrap_or_else(|e| panic!("{text}: {e}"));
        let options = SystemOptions { solutions: false, ..SystemOptions::default() };
        analyze_system(&model, options).unwrap_or_else(|e| panic!("{text}: {e}"))
    };
    let taken = |a: &SystemAnalysis| -> Vec<String> {
        a.constraint_factors.iter().map(|f| f.factor.clone()).collect()
    };
    let three = "parameters=['x', 'y', 'z']\n[outputs]\n";
    // both products vanish at y = 0, or at the factor of the shorter one; rank of this constraint and of the
    // output
    for (constraints, output, factors, rank) in [
        ("'x*y = 0', 'y*(x - 1) = 0'", "s='z'", &["y", "y"][..], 2),
        ("'x*y = 0', 'y*x*z = 0'", "s='z'", &["y", "y"], 2),
        ("'x*y = 0', 'y*(z - 1) = 0'", "s='z + x'", &["x", "z - 1"], 2),
        ("'x*y = 0'", "s='y/x + z'", &["y"], 2),
        ("'(x + 1)*(y - x) = 0'", "s='log(x) + z'", &["y - x"], 2),
        ("'x*y/x^2 = 0'", "s='z'", &[], 2),
    ] {
        let a = answer(&format!("constraints=[{constraints}]\n{three}{output}"));
        assert_eq!(
            (taken(&a).as_slice(), a.rank),
            (&factors.iter().map(|f| f.to_string()).collect::<Vec<_>>()[..], rank),
            "{constraints}"
        );
    }
    let runs = "constraints=['x*(y - 1) = 0']\nexperiments=2\n[states]\nx='0'\ny='0'\n[outputs]\ns='x + y'\n\
                [simulation.values]\n";
    for (values, factors) in
        [("'x@1'=0\n'y@1'=2\n'x@2'=3\n'y@2'=1", &[][..]), ("'x@1'=0\n'y@1'=2\n'x@2'=0\n'y@2'=5", &["x"])]
    {
        assert_eq!(taken(&answer(&format!("{runs}{values}"))), factors, "{values}");
    }
}

/// Given values choose the branch of a constraint that is a sum. By hand: x*y = x*z at x = 0 leaves y free,
/// which z does not determine; at y = z it leaves x free. x^2 = y^2 with x + y as output has rank 1 at x =
/// -y.
#[test]
fn given_values_choose_the_way() {
    for (constraint, output, values, rank, observable) in [
        ("x*y = x*z", "z", "x=0, y=2, z=1", 2, &["x", "z"][..]),
        ("x*y = x*z", "z", "x=3, y=1, z=1", 2, &["y", "z"]),
        ("x^2 = y^2", "x + y", "x=1, y=-1, z=1", 1, &[]),
        ("x^2 = y^2", "x + y", "x=1, y=1, z=1", 2, &["x", "y"]),
        ("x^2 = x", "x*y", "x=1, y=5, z=1", 2, &["x", "y"]),
        ("x^2 = x", "x*y", "x=0, y=5, z=1", 1, &["x"]),
    ] {
        for seed in 1..=6 {
            let text = format!(
                "name='m'\nconstraints=['{constraint}']\nparameters=['x', 'y', 'z']\n[outputs]\ns='{output}'\n\
                 [simulation]\nvalues={{{values}}}"
            );
            let model = model_file::read(&text).expect("a model");
            let options = SystemOptions { seed, solutions: false, ..SystemOptions::default() };
            let a = analyze_system(&model, options)
                .unwrap_or_else(|e| panic!("{constraint} {values} {seed}: {e}"));
            let seen = a.quantities.iter().filter(|q| q.degree.is_some()).map(|q| q.name.as_str());
            let mut seen: Vec<&str> = seen.collect();
            seen.sort_unstable();
            assert_eq!((a.rank, &seen[..]), (rank, observable), "{constraint} {values} {seed}");
        }
    }
}

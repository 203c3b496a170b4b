//! Notation of models: vectors, matrices, quaternions, definitions in any order.

use nalgebra::{DMatrix, Matrix3, Quaternion, UnitQuaternion, Vector3};
use obsdeg_core::language::{Components, Shape, Shapes, evaluate_f64, parse_components};
use obsdeg_core::system::{Judgement, ModelError, SystemModel, judge, model_file};
use obsdeg_evidence::system::{crosscheck_system, simulate_system};
use proptest::prelude::*;

fn shapes() -> Shapes {
    let all = [("a", 3, 1), ("b", 3, 1), ("p", 4, 1), ("q", 4, 1), ("M", 3, 3), ("N", 3, 2), ("u", 2, 1)];
    all.into_iter().map(|(name, rows, columns)| (name.to_string(), Shape { rows, columns })).collect()
}

/// Values of all entries of a text; `v[i]` and `M[i,j]` take values from `numbers`.
fn values(text: &str, numbers: &[f64]) -> DMatrix<f64> {
    let Components { shape, entries } = parse_components(text, &shapes()).expect(text);
    let at = |name: &str| number(name, numbers);
    DMatrix::from_row_iterator(shape.rows, shape.columns, entries.iter().map(|e| evaluate_f64(e, &at)))
}

/// One of the numbers for every name.
fn number(name: &str, numbers: &[f64]) -> f64 {
    let place = name.bytes().fold(7usize, |h, b| h.wrapping_mul(31).wrapping_add(b.into()));
    numbers[place % numbers.len()]
}

fn given(name: &str, numbers: &[f64]) -> DMatrix<f64> {
    let Shape { rows, columns } = shapes()[name];
    let entry = |i: usize, j: usize| match columns {
        1 => number(&format!("{name}[{}]", i + 1), numbers),
        _ => number(&format!("{name}[{},{}]", i + 1, j + 1), numbers),
    };
    DMatrix::from_fn(rows, columns, entry)
}

proptest! {
    /// Every operation agrees with nalgebra.
    #[test]
    fn operations_are_those_of_linear_algebra(numbers in prop::collection::vec(-3.0f64..3.0, 97)) {
        let m = |name: &str| given(name, &numbers);
        let v = |name: &str| Vector3::from_iterator(m(name).iter().copied());
        let q = |name: &str| { let q = m(name); Quaternion::new(q[0], q[1], q[2], q[3]) };
        let of = |q: Quaternion<f64>| DMatrix::from_column_slice(4, 1, &[q.w, q.i, q.j, q.k]);
        let column = |v: Vector3<f64>| DMatrix::from_column_slice(3, 1, v.as_slice());
        let square = |m: Matrix3<f64>| DMatrix::from_fn(3, 3, |i, j| m[(i, j)]);
        let scalar = |x: f64| DMatrix::from_element(1, 1, x);
        let angle = number("x", &numbers);
        let about = |axis| square(UnitQuaternion::from_axis_angle(&axis, angle).to_rotation_matrix().into_inner());
        let turn = UnitQuaternion::new_normalize(q("q")).to_rotation_matrix().into_inner() * q("q").norm_squared();
        let rate = q("q") * Quaternion::from_imag(v("a")) * 0.5;
        for (text, expected) in [
            ("a + b", m("a") + m("b")),
            ("-(a - 2*b)/4", (m("b") * 2.0 - m("a")) / 4.0),
            ("M*a", m("M") * m("a")),
            ("M*N*u", m("M") * m("N") * m("u")),
            ("transpose(N)*M", m("N").transpose() * m("M")),
            ("a*transpose(b)", m("a") * m("b").transpose()),
            ("transpose(a)*b", scalar(v("a").dot(&v("b")))),
            ("cross(a, b)", column(v("a").cross(&v("b")))),
            ("skew(a)*b", column(v("a").cross(&v("b")))),
            ("dot(a, b)", scalar(v("a").dot(&v("b")))),
            ("norm(a)^2", scalar(v("a").norm_squared())),
            ("qmul(p, q)", of(q("p") * q("q"))),
            ("conj(q)", of(q("q").conjugate())),
            ("R(q)", square(turn)),
            ("R(q)*a", column(turn * v("a"))),
            ("qdot(q, a)", of(rate)),
            ("Rx(x)", about(Vector3::x_axis())),
            ("Ry(x)", about(Vector3::y_axis())),
            ("Rz(x)", about(Vector3::z_axis())),
            ("[x, a[2], M[2,3]]", DMatrix::from_column_slice(3, 1, &[angle, m("a")[1], m("M")[(1, 2)]])),
            ("[a, b]", DMatrix::from_fn(2, 3, |i, j| [m("a"), m("b")][i][j])),
            ("[[1, 2], [3, x]]", DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 3.0, angle])),
            ("(M*a)[2]*x", scalar((m("M") * m("a"))[1] * angle)),
            ("qmul(q, conj(q))[1]", scalar(q("q").norm_squared())),
        ] {
            let found = values(text, &numbers);
            prop_assert_eq!(found.shape(), expected.shape(), "{}", text);
            prop_assert!(
                (&found - &expected).amax() < 1e-12 * (1.0 + expected.amax()),
                "{} {} {}", text, found, expected
            );
        }
    }
}

fn read(text: &str) -> SystemModel {
    model_file::read(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

fn judged(text: &str) -> Judgement {
    judge(&read(text), 3, None).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// A rigid body with a biased gyro that observes two landmarks, written in vectors and by hand in scalars.
#[test]
fn vectors_are_their_components() {
    let vectors = r#"
name = "v"
parameters = ["b[3]"]
known_inputs = { "w[3]" = "generic" }
combinations = ["dot(q, q)", "2*b"]
[constants]
"f[3]" = "generic"
g = [0, 0, -9.81]
[definitions]
h = "transpose(C)*g"
C = "R(q)"
[states]
"q[4]" = "qdot(q, w - b)"
[outputs]
y = "transpose(C)*f"
z = "h"
"#;
    let names = ["b[1]", "b[2]", "b[3]", "w[1]", "w[2]", "w[3]", "f[1]", "f[2]", "f[3]"];
    let plain = |name: &str| name.replace(['[', ']'], "");
    let list = |from: usize| names[from..from + 3].iter().map(|n| plain(n)).collect::<Vec<_>>();
    let quoted =
        |l: Vec<String>, end: &str| l.iter().map(|n| format!("{n}{end}")).collect::<Vec<_>>().join(",");
    let row = |i: usize, v: [&str; 3]| {
        let c = [
            ["(q1^2+q2^2-q3^2-q4^2)", "2*(q2*q3-q1*q4)", "2*(q2*q4+q1*q3)"],
            ["2*(q2*q3+q1*q4)", "(q1^2-q2^2+q3^2-q4^2)", "2*(q3*q4-q1*q2)"],
            ["2*(q2*q4-q1*q3)", "2*(q3*q4+q1*q2)", "(q1^2-q2^2-q3^2+q4^2)"],
        ];
        (0..3).map(|k| format!("{}*{}", c[k][i], v[k])).collect::<Vec<_>>().join(" + ")
    };
    let (f, g) = (["f1", "f2", "f3"], ["0", "0", "(-9.81)"]);
    let scalars = format!(
        "name='s'\nparameters=['b1','b2','b3']\nknown_inputs={{{}}}\n\
         combinations=['q1^2+q2^2+q3^2+q4^2','2*b1','2*b2','2*b3']\n\
         [constants]\n{}\n[states]\n\
         q1='(-q2*(w1-b1) - q3*(w2-b2) - q4*(w3-b3))/2'\nq2='(q1*(w1-b1) + q3*(w3-b3) - q4*(w2-b2))/2'\n\
         q3='(q1*(w2-b2) + q4*(w1-b1) - q2*(w3-b3))/2'\nq4='(q1*(w3-b3) + q2*(w2-b2) - q3*(w1-b1))/2'\n\
         [outputs]\ny1='{}'\ny2='{}'\ny3='{}'\nz1='{}'\nz2='{}'\nz3='{}'\n",
        quoted(list(3), "='generic'"),
        list(6).iter().map(|n| format!("{n}='generic'")).collect::<Vec<_>>().join("\n"),
        row(0, f),
        row(1, f),
        row(2, f),
        row(0, g),
        row(1, g),
        row(2, g),
    );
    let (one, other) = (judged(vectors), judged(&scalars));
    let names = |j: &Judgement| j.layout.unknowns.iter().map(|u| plain(&u.name)).collect::<Vec<_>>();
    assert_eq!(names(&one), names(&other));
    assert_eq!(one.findings.degrees, other.findings.degrees);
    assert_eq!(one.findings.asked, other.findings.asked);
    assert_eq!(one.findings.degrees.rank(), 7);
    let model = read(vectors);
    assert_eq!(model.states[3].named.name, "q[4]");
    let combinations: Vec<&str> = model.combinations.iter().map(|c| c.text.as_str()).collect();
    assert_eq!(combinations, ["dot(q, q)", "(2*b)[1]", "(2*b)[2]", "(2*b)[3]"]);
}

/// Different spellings of the same model.
#[test]
fn other_words_for_the_same_model() {
    let model = |text: &str| {
        let j = judged(&format!("name = 'm'\n{text}"));
        (j.layout.unknowns.iter().map(|u| u.name.clone()).collect::<Vec<_>>(), j.findings.degrees.clone())
    };
    // 0 stands for every entry, a list for its entries, a table for a key
    let first =
        model("parameters=['k']\n[states]\n'x[2]'='v'\n'v[2]'='-k*x'\n'c[2]'=0\n[outputs]\ny='x + c'");
    for other in [
        "[parameters]\nk={}\n[states]\n'x[2]'={equation='v'}\n'v[2]'=['-k*x[1]', '-k*x[2]']\n'c[2]'=[0, 0]\n\
         [outputs]\n'y[2]'='x + c'",
        "[parameters]\nk={}\n[definitions]\nz='x + w'\nw='c'\n[states]\n'x[2]'='v'\n'v[2]'='-K*x'\n'c[2]'='[0, 0]'\n\
         [outputs]\ny={expression='z'}\n[constants]\nE=[[1, 0], [0, 1]]\n[definitions.K]\n",
    ] {
        let other = match other.strip_suffix("[definitions.K]\n") {
            Some(rest) => rest.replace("w='c'", "w='c'\nK='k*E'"),
            None => other.to_string(),
        };
        assert_eq!(model(&other), first, "{other}");
    }
    assert_eq!(first.0, ["x[1]", "x[2]", "v[1]", "v[2]", "c[1]", "c[2]", "k"]);
    // starts, jumps and constants of a segment
    let known = model("[states]\n'x[2]'={equation='s*x', initial='known'}\ns=0\n[outputs]\ny='x[2]'");
    assert_eq!(known.0, ["s"]);
    let jump = "[constants]\ng=[0, 0, 1]\n[states]\n'x[3]'='cross(g, x)'\n[outputs]\ny='x[1]'\n[[segment]]\n\
                [[segment]]\nconstants={g=[1, 0, 0]}\ncarry={x='2*x'}";
    let by_hand = "[constants]\na=0\nb=1\n[states]\nx1='-b*x2'\nx2='b*x1 - a*x3'\nx3='a*x2'\n[outputs]\ny='x1'\n\
                   [[segment]]\n[[segment]]\nconstants={a=1, b=0}\ncarry={x1='2*x1', x2='2*x2', x3='2*x3'}";
    assert_eq!(model(jump).1, model(by_hand).1);
}

/// Names of vector functions may be used for other quantities.
#[test]
fn names_of_functions_of_vectors_are_free() {
    let j = judged(
        "name='r'\nparameters=['dot']\n[states]\nR='-dot*R'\n'q[4]'=0\n[definitions]\nskew='R*R'\n[outputs]\n\
         y='skew + R'\nz='R(q)*[1, 0, 0]'",
    );
    assert_eq!(j.findings.degrees.degree[0], Some(0));
    // `R = "R(q)"` is not circular
    let j = judged("name='r'\n[states]\n'q[4]'=0\n[definitions]\nR='R(q)'\n[outputs]\ny='R*[1, 0, 0]'");
    assert_eq!(j.findings.degrees.rank(), 3);
}

#[test]
fn definitions_in_any_order() {
    let with = |definitions: &str| {
        read(&format!(
            "name='d'\n[states]\nx='-a'\n[constants]\nk='2*m'\nm=3\n[definitions]\n{definitions}\n[outputs]\ny='x'"
        ))
    };
    let (forth, back) = (with("c='x^2'\nb='c + k'\na='b*c'"), with("a='b*c'\nb='c + k'\nc='x^2'"));
    assert_eq!(forth.definitions.iter().map(|d| &d.0).collect::<Vec<_>>(), ["c", "b", "a"]);
    assert_eq!(back.definitions.iter().map(|d| &d.0).collect::<Vec<_>>(), ["c", "b", "a"]);
    assert_eq!(back.constants.iter().map(|c| c.0.name.as_str()).collect::<Vec<_>>(), ["m", "k"]);
    let degrees = |m: &SystemModel| judge(m, 1, None).expect("judged").findings.degrees;
    assert_eq!(degrees(&forth), degrees(&back));
}

#[test]
fn what_does_not_fit_is_named_with_its_place() {
    let error = |text: &str| -> (ModelError, String) {
        let text = format!("name = 'w'\n{text}");
        let e = model_file::read(&text).and_then(|m| judge(&m, 1, None)).expect_err(&text);
        let place = e.span.clone().map(|s| text[s].to_string()).unwrap_or_default();
        (e, place)
    };
    let states = "[states]\n'p[3]' = 'v'\n'v[3]' = 0\n's' = 0\n'q[4]' = 0\n'M[3,3]' = 0\n";
    for (expression, message, place) in [
        ("p + s", "expected the same shape on both sides of `+`, found a vector of 3 + a scalar", "p + s"),
        (
            "s*(p - q)",
            "expected the same shape on both sides of `-`, found a vector of 3 - a vector of 4",
            "p - q",
        ),
        (
            "p*v",
            "expected dot(a, b), cross(a, b), or a matrix before `*`, found a vector of 3 * a vector of 3",
            "p*v",
        ),
        ("M*q", "expected 3 rows behind `*`, found a 3x3 matrix * a vector of 4", "M*q"),
        ("s/p", "expected a scalar behind `/`, found a vector of 3", "s/p"),
        ("p^2", "expected scalars on both sides of `^`, found a vector of 3 ^ a scalar", "p^2"),
        ("sin(p)", "expected a scalar in `sin`, found a vector of 3", "sin(p)"),
        ("cross(p, q)", "expected two vectors of 3, found a vector of 3 and a vector of 4", "cross(p, q)"),
        ("dot(p)", "expected two vectors of one length, found a vector of 3", "dot(p)"),
        ("norm(M)", "expected a vector, found a 3x3 matrix", "norm(M)"),
        ("R(p)", "expected a vector of 4 (a quaternion w, x, y, z), found a vector of 3", "R(p)"),
        (
            "1 + qmul(q, s)[1]",
            "expected two vectors of 4 (quaternions w, x, y, z), found a vector of 4 and a scalar",
            "qmul(q, s)",
        ),
        ("Rx(p)", "expected an angle, found a vector of 3", "Rx(p)"),
        ("p[4]", "expected an index from 1 to 3, found [4] of a vector of 3", "p[4]"),
        ("p[0]", "expected an index from 1 to 3, found [0] of a vector of 3", "p[0]"),
        ("p[1,2]", "expected an index from 1 to 3, found [1,2] of a vector of 3", "p[1,2]"),
        (
            "M[3]",
            "expected a row from 1 to 3 and a column from 1 to 3, as in [1,2], found [3] of a 3x3 matrix",
            "M[3]",
        ),
        ("s[1]", "expected a vector or matrix before `[`, found [1] of a scalar", "s[1]"),
        ("p[s]", "expected an index: a whole number from 1 on, found `s`", "s"),
        ("p[1", "expected `,` or `]`, found the end of the expression", ""),
        (
            "[s, p]",
            "expected scalars, or rows of one length, in a list, found a scalar and a vector of 3",
            "[s, p]",
        ),
        ("[M, M]", "expected scalars, or rows of one length, in a list, found a 3x3 matrix", "[M, M]"),
        ("[s, 1", "expected an operator, `,` or `]`, found the end of the expression", ""),
        ("[]", "expected a number, a name or `(`, found `]`", "]"),
        ("dot(p, w)", "expected two vectors of one length, found a vector of 3 and a scalar", "dot(p, w)"),
        ("det(M)", "of vectors cross, dot, norm", "det"),
    ] {
        let (e, found) = error(&format!("{states}[outputs]\ny = '{expression}'"));
        assert!(e.message.contains(message) && e.what == "the output y", "{expression}: {e}");
        assert_eq!(found, place, "{expression}: {e}");
    }
    for (text, what, message) in [
        (
            "[states]\np = 'v'\n'v[3]' = 0\n[outputs]\ny='p'",
            "the equation of p",
            "found a vector of 3; expected a scalar, as `p` is; `p[3]` in quotes declares one",
        ),
        (
            "[states]\n'p[3]' = 1\n[outputs]\ny='p'",
            "the equation of p",
            "found a scalar; expected a vector of 3, as `p` is",
        ),
        (
            "[states]\n'p[3]' = [1, 2]\n[outputs]\ny='p'",
            "the equation of p",
            "found a vector of 2; expected a vector of 3",
        ),
        (
            "[states]\n'p[2]' = ['t', ['t', 't']]\n[outputs]\ny='p'",
            "the equation of p",
            "found a scalar and a vector of 2; expected scalars, or rows of one length, in a list",
        ),
        (
            "[states]\n'p[3' = 1\n[outputs]\ny='p'",
            "`p[3`",
            "not a size; expected that of a vector, as in p[3]",
        ),
        ("[states]\n'p[0]' = 1\n[outputs]\ny='p'", "`p[0]`", "not a size"),
        ("[states]\n'p[1]' = 1\n[outputs]\ny='p'", "`p[1]`", "with 2 to 10000 entries"),
        ("[states]\n'p[101,101]' = 1\n[outputs]\ny='p'", "`p[101,101]`", "with 2 to 10000 entries"),
        ("[states]\n'x[2]' = 0\nx = 1\n[outputs]\ny='x'", "`x`", "given twice"),
        ("parameters=['x']\n[states]\n'x[2]' = 0\n[outputs]\ny='x'", "`x`", "given twice"),
        ("[states]\n'sin[2]' = 0\n[outputs]\ny='1'", "`sin[1]`", "the name of a function"),
        (
            "[states]\nx = 0\n[definitions]\na='b'\nb='c + 1'\nc='2*a'\n[outputs]\ny='x'",
            "the definition of a",
            "a circle: a -> b -> c -> a; expected an end to it",
        ),
        (
            "[states]\nx = 0\n[definitions]\na='a + 1'\n[outputs]\ny='x'",
            "the definition of a",
            "a circle: a -> a;",
        ),
        (
            "[states]\nx = 0\n[constants]\na='b'\nb='a'\n[outputs]\ny='x'",
            "the constant a",
            "a circle: a -> b -> a;",
        ),
        (
            "[states]\n'x[2]' = 0\n[outputs]\n'y[3]'='x'",
            "the output y",
            "found a vector of 2; expected a vector of 3, as `y[3]` declares it",
        ),
        (
            "[states]\n'x[2]' = {equation = 0, initial = [1, 2, 3]}\n[outputs]\ny='x'",
            "the initial value of x",
            "found a vector of 3; expected a vector of 2",
        ),
        (
            "[states]\n'x[2]' = 0\n[outputs]\ny='x'\n[[segment]]\ncarry={x='x[1]'}",
            "the carried state x of segment 1",
            "found a scalar; expected a vector of 2",
        ),
        (
            "known_inputs={'u[2]'={function='sin(t)'}}\n[states]\n'x[2]' = 'u'\n[outputs]\ny='x'",
            "the known input u",
            "found a scalar; expected a vector of 2",
        ),
        (
            "[states]\n'x[2]' = 0\n[outputs]\ny='x'\n[simulation]\nvalues={x=[1, 2, 3]}",
            "values of x",
            "found 3 numbers; expected a number, or a list of 2",
        ),
        (
            "[states]\n'x[2]' = 0\n[outputs]\ny='x'\n[simulation]\npriors={x=[1, 0]}",
            "priors of x",
            "expected a number above 0, or a list of 2",
        ),
        (
            "[states]\n'x[2]' = 0\n[outputs]\ny='x'\n[simulation]\nvalues={x='1'}",
            "values of x",
            "found a string; expected a number, or a list of 2",
        ),
        (
            "[states]\n'x[2]' = 0\n[outputs]\ny='x'\n[simulation]\nvalues={'x[3]'=1}",
            "values of the simulation",
            "`x[3]` is not known here; did you mean `x[1]`?",
        ),
        (
            "[states]\n'x[2]' = 0\n[outputs]\ny='x'\n[simulation]\nnoise={x=1}",
            "noise of the simulation",
            "`x` is not known here",
        ),
    ] {
        let (e, place) = error(text);
        assert!(e.what == what && e.message.contains(message), "{text}: {e}");
        assert!(!place.is_empty() || e.what == "`sin[1]`", "{text}: {e}");
    }
    // the language of schemes has no vectors
    assert!(obsdeg_core::language::parse("[1, 2]").is_err());
    // deep nesting and large texts
    let deep = format!("{}1", "[".repeat(1_000_000));
    assert!(parse_components(&deep, &shapes()).expect_err("deep").to_string().contains("nested"));
    let large = format!("{states}[outputs]\ny = '{}M'", "M*".repeat(20_000));
    assert!(error(&large).0.message.contains("at most 200000 operations"));
}

fn degrees(j: &Judgement) -> Vec<(String, Option<usize>)> {
    let names = j.layout.unknowns.iter().map(|u| u.name.clone());
    names.zip(j.findings.degrees.degree.iter().copied()).collect()
}

/// Verdicts under a constraint equal those of the same system with fewer unknowns.
#[test]
fn constraints_against_coordinates_of_their_own() {
    // a rotation by two numbers on a circle, and by the tangent of the half angle: rank 2 of 3 and 1 of 2
    let circle = judged(
        "name='c'\nconstraints=['c^2 + s^2 = 1']\nparameters=['k']\n[states]\nc='-s*k'\ns='c*k'\nz='c'\n[outputs]\n\
         y='z'",
    );
    let half = judged(
        "name='h'\nparameters=['k']\n[states]\nt='(1 + t^2)*k/2'\nz='(1-t^2)/(1+t^2)'\n[outputs]\ny='z'",
    );
    assert!(circle.layout.closed && half.layout.closed);
    let profile = |j: &Judgement| j.findings.degrees.rank_profile.clone();
    // the circle adds one row at every order
    assert_eq!(profile(&circle), profile(&half).iter().map(|r| r + 1).collect::<Vec<_>>());
    assert_eq!(
        degrees(&circle),
        [("c", 1), ("s", 1), ("z", 0), ("k", 2)].map(|(n, d)| (n.to_string(), Some(d)))
    );
    assert_eq!(degrees(&half), [("t", 1), ("z", 0), ("k", 2)].map(|(n, d)| (n.to_string(), Some(d))));
    // without it s and k need one order more, c'' = -k^2 c; a constraint on a queried unknown decides it
    // alone
    let open = judged("name='c'\nparameters=['k']\n[states]\nc='-s*k'\ns='c*k'\nz='c'\n[outputs]\ny='z'");
    assert_eq!(
        degrees(&open),
        [("c", 1), ("s", 3), ("z", 0), ("k", 3)].map(|(n, d)| (n.to_string(), Some(d)))
    );
    let line = judged(
        "name='l'\nconstraints=['2*x + a*y = 3']\n[constants]\na='generic'\n[states]\nx=0\ny=0\n[outputs]\nz='y'",
    );
    assert_eq!(degrees(&line), [("x", 0), ("y", 0)].map(|(n, d)| (n.to_string(), Some(d))));
}

/// A gyro and gravity: with |q| = 1 only yaw is not observable, and the rank counts the constraint. A
/// rotation matrix in place of the quaternion and the count with small angles agree.
#[test]
fn attitudes_on_their_constraint() {
    let attitude = |constraints: &str, state: &str, turned: &str, b: &str| {
        judged(&format!(
            "name='a'\nparameters=['b[3]']\nconstraints={constraints}\nknown_inputs={{'w[3]'='generic'}}\n\
             [definitions]\nr='w - b'\n\
             [states]\n{state}\n[outputs]\ny='{turned}*{b}'"
        ))
    };
    let matrix = |b: &str| {
        attitude("['transpose(C)*C = [[1,0,0],[0,1,0],[0,0,1]]']", "'C[3,3]'='C*skew(r)'", "transpose(C)", b)
    };
    for (name, text) in
        [("norm", "['norm(q) = 1']"), ("bars", "['|q| = 1']"), ("square", "['dot(q, q) = 1']")]
    {
        let quaternion = attitude(text, "'q[4]'='qdot(q, r)'", "transpose(R(q))", "[0, 0, 9.81]");
        let d = &quaternion.findings.degrees;
        // yaw is not observable: rank 5 of 3 + 3 directions
        assert_eq!(
            (d.rank(), quaternion.layout.unknowns.len(), quaternion.layout.closed),
            (6, 7, true),
            "{name}"
        );
        assert_eq!(d.rank_profile[..3], [3, 5, 6], "{name}");
        assert!((4..7).all(|c| d.degree[c].is_some()) && (0..4).all(|c| d.degree[c].is_none()));
    }
    // without the constraint |q| is observable through the size of gravity, by an output and by no derivative
    let free = attitude("[]", "'q[4]'='qdot(q, r)'", "transpose(R(q))", "[0, 0, 9.81]");
    assert_eq!((free.findings.degrees.rank(), free.findings.degrees.rank_profile[0]), (6, 3));
    let m = matrix("[0, 0, 9.81]");
    assert_eq!((m.findings.degrees.rank(), m.layout.unknowns.len(), m.layout.closed), (9 - 1 + 3, 12, true));
    assert_eq!(m.findings.degrees.rank_profile[..3], [6 + 2, 6 + 4, 6 + 5]);
}

/// The motion leaves a constraint that is not invariant: such a start is special, and the first order that
/// adds nothing is not the end.
#[test]
fn a_constraint_that_is_left_is_a_special_start() {
    let trap = |start: &str| judged(&format!("name='t'\nparameters=['a']\n{start}\n[outputs]\ny='x'"));
    let given = trap("[states]\nx={equation='1 + a*x^2', initial=0}");
    let held = trap("constraints=['x = 0']\n[states]\nx='1 + a*x^2'");
    assert_eq!((held.layout.closed, given.layout.closed), (false, false));
    // the constraint determines x
    assert_eq!(degrees(&held), [("x".to_string(), Some(0)), ("a".to_string(), degrees(&given)[0].1)]);
    assert_eq!(degrees(&given)[0].1, Some(3));
}

#[test]
fn constraints_that_cannot_hold_are_named() {
    for (constraints, message) in [
        ("['x']", "expected an operator or `=`"),
        ("['|x = 1']", "expected an operator or `|`"),
        ("['x = 1 = 2']", "expected an operator or the end of the expression"),
        ("['exp(x) = 2']", "a function; expected + - * / and whole powers"),
        ("['x = u']", "`u` is an input; expected states, parameters and constants"),
        ("['x = t']", "`t` is the time"),
        ("['z = 2']", "nothing unknown; expected states or parameters in it"),
        ("['2*k = 6']", "nothing unknown; expected states or parameters in it"),
        ("['x = w']", "`w` is not known here"),
        ("['p = x']", "expected the same shape on both sides of `-`, found a vector of 2 - a scalar"),
        ("['x = 1', 'x = 2']", "no real point was found at which it holds"),
        ("['x = 1', 'x^2 = 2']", "no real point was found at which it holds"),
    ] {
        let text = format!(
            "name='c'\nconstraints={constraints}\nknown_inputs={{u='generic'}}\n[constants]\nk='generic'\n[states]\n\
             x='u*k'\nz={{equation=0, initial=1}}\n'p[2]'=0\n[outputs]\ny='x + z'"
        );
        let e = model_file::read(&text).and_then(|m| judge(&m, 1, None)).expect_err(constraints);
        assert!(e.message.contains(message) && e.what.starts_with("the constraint"), "{constraints}: {e}");
        assert!(e.span.is_some(), "{constraints}: {e}");
    }
}

/// In a constraint a given start stands for its state.
#[test]
fn constraints_with_given_starts() {
    let held = |constraint: &str, start: &str| {
        let states = format!("x='-a*x*z'\nz={{equation='-b*z', initial={start}}}");
        let text = format!(
            "name='c'\nparameters=['a', 'b']\nconstraints=['{constraint}']\n[states]\n{states}\n[outputs]\ny='x*b'"
        );
        degrees(&judged(&text))
    };
    let degree_of = |constraint: &str, start: &str, name: &str| {
        held(constraint, start).into_iter().find(|q| q.0 == name).expect("an unknown").1
    };
    for (with, without, start) in
        [("x = z", "x = 2", "2"), ("x*z = 3", "x*5 = 3", "5"), ("x + z = 4*a", "x + a*b = 4*a", "'a*b'")]
    {
        assert_eq!(held(with, start), held(without, start), "{with}");
    }
    assert_eq!(degree_of("x = z", "2", "b"), Some(0));
}

/// Experiments with different constants and inputs equal one system with separate states for each.
#[test]
fn experiments_of_their_own() {
    let several = judged(
        "name='s'\nparameters=['k', 'b']\nknown_inputs={u='generic', 'z[2]'='generic'}\n[constants]\nm='2*d'\nd=1\n\
         [definitions]\nforce='b*u*m'\n\
         [states]\nx='-k*x + force + z[1]*z[2]'\n[outputs]\ny='d*x'\n[[experiment]]\nconstants={d=3}\n\
         known_inputs={u={function='t + d'}, z='constant'}\n\
         [[experiment]]\nknown_inputs={u='constant'}\n[[experiment]]\nconstants={d='1/2'}\n\
         known_inputs={z={function=['t', 'd']}}\n",
    );
    let one = judged(
        "name='o'\nparameters=['k', 'b']\nknown_inputs={u2='constant', u3='generic', z1='constant', z2='generic', \
         z3='generic'}\n\
         [states]\nx1='-k*x1 + b*(t + 3)*6 + z1'\nx2='-k*x2 + b*u2*2 + z2'\nx3='-k*x3 + b*u3 + t/2'\n[outputs]\n\
         y1='3*x1'\ny2='x2'\ny3='x3/2'\n",
    );
    let names: Vec<String> = degrees(&several).into_iter().map(|d| d.0).collect();
    assert_eq!(names, ["x@1", "x@2", "x@3", "k", "b"]);
    let plain = |j: &Judgement| j.findings.degrees.degree.clone();
    assert_eq!(plain(&several), plain(&one));
    assert_eq!(several.findings.degrees.rank_profile[..2], one.findings.degrees.rank_profile[..2]);
    // the experiments distinguish the unknowns because they differ
    let doses = |own: &str| {
        judged(&format!(
            "name='d'\nparameters=['a', 'b']\n[constants]\nd=1\n[states]\nx='a + b*d'\n[outputs]\ny='x'\n{own}"
        ))
    };
    let same = doses("[[experiment]]\n[[experiment]]\n");
    let two = doses("[[experiment]]\n[[experiment]]\nconstants={d=2}\n");
    assert_eq!((same.findings.degrees.rank(), two.findings.degrees.rank()), (3, 4));
    assert_eq!(degrees(&two)[2], ("a".to_string(), Some(1)));
}

#[test]
fn experiments_that_are_wrong_are_named() {
    let error = |own: &str| {
        let text = format!("name='d'\n{own}");
        model_file::read(&text).and_then(|m| judge(&m, 1, None)).expect_err(own).to_string()
    };
    let rest = "parameters=['a']\nknown_inputs={u='generic'}\n[constants]\nd=1\ne='2*d'\n[states]\nx='a + u*d'\n\
                [outputs]\ny='x'\n";
    for (own, message) in [
        ("[[experiment]]\nconstants={c=1}", "the constant c of experiment 1: `c` is no known constant"),
        (
            "[[experiment]]\n[[experiment]]\nconstants={a=1}",
            "the constant a of experiment 2: `a` is no known constant",
        ),
        ("[[experiment]]\nconstants={d='a'}", "the constant d of experiment 1: `a` is not known here"),
        ("[[experiment]]\nconstants={d='e'}", "the constant d of experiment 1: `e` is not known here"),
        ("[[experiment]]\nconstants={d=[1, 2]}", "found a vector of 2; expected a scalar"),
        (
            "[[experiment]]\nknown_inputs={uu='generic'}",
            "`uu` is no known input; expected one of [known_inputs]; did you mean `u`?",
        ),
        ("[[experiment]]\nknown_inputs={u='wild'}", "the known input u: expected \"generic\", \"constant\""),
        ("[[experiment]]\nknown_inputs={u={function='sin(x)'}}", "`x` is not known here"),
        ("[[experiment]]\nstates={x=1}", "unknown key `states`"),
        ("[[experiment]]\n[[experiment]]\n[simulation]\nvalues={'x@3'=1}", "`x@3` is not known here"),
    ] {
        assert!(
            error(&format!("{rest}{own}")).contains(message),
            "{own}: {}",
            error(&format!("{rest}{own}"))
        );
    }
    let counted = error(&format!("experiments=3\n{rest}[[experiment]]\n[[experiment]]"));
    assert!(counted.contains("3, and 2 [[experiment]]; expected as many, or no number"), "{counted}");
    let many = error(&format!("{rest}{}", "[[experiment]]\n".repeat(21)));
    assert!(many.contains("21 [[experiment]]; expected at most 20"), "{many}");
}

/// The information of several experiments with segments confirms the verdicts. Equal inputs in place of
/// different ones refute them.
#[test]
fn evidence_of_several_experiments() {
    let text = |second: &str| {
        format!(
            "name='e'\nparameters=['a', 'b']\nknown_inputs={{u='constant'}}\n[states]\nx='-a*x + b*u'\nc='-c'\n\
             [outputs]\ny='x'\nz='c'\n[[experiment]]\n[[experiment]]\n\
             [simulation]\nduration=2\nstep=0.05\nnoise={{y=0.01, z=0.01}}\n\
             values={{x=1, 'x@2'=0.3, c=0.1, 'c@2'=-0.2, a=0.7, b=1.5}}\ninputs={{u='1', 'u@2'='{second}'}}\n"
        )
    };
    let model = |second: &str| read(&text(second));
    let e = crosscheck_system(&model("3"), 1).expect("evidence");
    assert!(e.passed && e.orders.measured == e.orders.of && e.orders.of >= 5, "{e:?}");
    let (run, traces) = simulate_system(&model("3"), 1).expect("a run");
    assert!(run.consistency.consistent, "{run:?}");
    assert_eq!(traces.names, ["x@1", "c@1", "x@2", "c@2", "a", "b"]);
    assert_eq!((traces.time.len(), traces.time.last().copied()), (81, Some(4.0)));
    // states of the other experiment are constant
    let x2 = &traces.series[2].truth;
    assert!(x2[..=40].iter().all(|x| *x == 0.3) && x2[80] != 0.3);
    for estimate in run.quantities.iter().filter(|e| e.is_determined()) {
        assert!(
            estimate.error_over_sigma.abs() < 4.0 && estimate.sigma < estimate.prior_sigma,
            "{estimate:?}"
        );
    }
    // in each experiment the time of the segments starts anew
    let jumps = text("3").replace(
        "[[experiment]]\n[[experiment]]\n",
        "[[experiment]]\n[[experiment]]\n[[segment]]\n[[segment]]\ncarry={x='2*x'}\n",
    );
    let e = crosscheck_system(&read(&jumps), 1).expect("evidence");
    assert!(e.passed && e.checks > 5, "{e:?}");
    assert_eq!(simulate_system(&read(&jumps), 1).expect("a run").1.position.last(), Some(&3));
    // two equal starts and inputs add nothing
    let twice = text("1").replace("'x@2'=0.3", "'x@2'=1").replace("'c@2'=-0.2", "'c@2'=0.1");
    let refuted = crosscheck_system(&read(&twice), 1).expect("evidence");
    assert!(!refuted.passed, "{refuted:?}");
}

/// A unit quaternion in filter and information: consistent and with the exact rank. Values off the sphere are
/// refused.
#[test]
fn evidence_on_constraints() {
    let text = std::fs::read_to_string(
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/gyro_and_field.toml"),
    )
    .expect("readable");
    let e = crosscheck_system(&read(&text), 1).expect("evidence");
    assert!(e.passed && e.orders.measured > 3, "{e:?}");
    assert_eq!((e.defect.predicted, e.defect.measured), (0, 0));
    let (run, _) = simulate_system(&read(&text), 1).expect("a run");
    assert!(run.consistency.consistent, "{run:?}");
    let q: Vec<f64> = run.quantities.iter().take(4).map(|e| e.estimate).collect();
    assert!((q.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-3, "{q:?}");
    let off = text.replace("q = [0.5, 0.5, 0.5, 0.5]", "q = [0.5, 0.5, 0.5, 0.6]");
    let error = simulate_system(&read(&off), 1).map(|r| r.0).expect_err("off the sphere").to_string();
    assert!(
        error.contains("the constraint norm(q) = 1: the values under [simulation.values] miss it by 1.1e-1"),
        "{error}"
    );
    // without the constraint the norm is one more unknown
    let free = text.replace("constraints = [\"norm(q) = 1\"]\n", "");
    assert_ne!(free, text);
    let e = crosscheck_system(&read(&free), 1).expect("evidence");
    assert!(e.passed, "{e:?}");
}

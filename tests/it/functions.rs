//! Models with functions: given values, related arguments, and different values in every segment. Expected
//! verdicts are derived by hand.

use obsdeg_core::degree::Status;
use obsdeg_core::system::{
    Judgement, NumberOfSolutions, StateStart, SystemCertainty, SystemOptions, analyze_system, judge,
    model_file,
};
use obsdeg_evidence::system::crosscheck_system;
use proptest::prelude::*;

fn judged(text: &str) -> Judgement {
    let model = model_file::read(text).unwrap_or_else(|e| panic!("{e}: {text}"));
    judge(&model, 7, None).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// Verdicts as `name 2, other -`: a degree, `-` if no output depends on the unknown, `~` if it is
/// indistinguishable from others, `?` if it is not resolved up to the bound.
fn verdicts(text: &str) -> String {
    let j = judged(text);
    let one = |c: usize| {
        let v = j.verdict_on(c);
        let mark = match (v.status, v.degree) {
            (_, Some(k)) => k.to_string(),
            (Status::NotExcited, _) => "-".into(),
            (Status::NotSeen, _) => "?".into(),
            _ => "~".into(),
        };
        format!("{} {mark}", j.layout.unknowns[c].name)
    };
    (0..j.layout.unknowns.len()).map(one).collect::<Vec<_>>().join(", ")
}

/// Model of one output over constant states, with constants and segments.
fn still(states: &str, output: &str, rest: &str) -> String {
    let equations: String = states.split(' ').map(|s| format!("{s}='0'\n")).collect();
    format!("name='m'\n[states]\n{equations}[outputs]\ny='{output}'\n{rest}")
}

/// Model with a known angle for each segment.
fn at_angles(output: &str, angles: &[&str]) -> String {
    let segments: String = angles.iter().map(|a| format!("[[segment]]\nconstants={{a='{a}'}}\n")).collect();
    still("s b", output, &format!("[constants]\na=0\n{segments}"))
}

#[test]
fn every_segment_has_values_of_its_own() {
    // tumble test: scale factor and bias from one, two or three known angles
    let tumble = |angles: &[&str]| verdicts(&at_angles("s*9.81*sin(a) + b", angles));
    assert_eq!(tumble(&["0", "0.5", "1.5"]), "s 0, b 0");
    assert_eq!(tumble(&["0.5", "1.5"]), "s 0, b 0");
    assert_eq!(tumble(&["0"]), "s -, b 0");
    assert_eq!(tumble(&["0.5"]), "s ~, b ~");
    assert_eq!(tumble(&["0.5", "0.5"]), "s ~, b ~");
    // angles with the same sine
    assert_eq!(tumble(&["0.5", "pi - 0.5"]), "s ~, b ~");
    assert_eq!(tumble(&["30*deg", "150*deg"]), "s ~, b ~");
    // two headings; a full turn adds nothing, but its decimals are not a full turn
    let heading = |angles: &[&str]| verdicts(&at_angles("s*cos(a) + b", angles));
    assert_eq!(heading(&["0", "3.14159265"]), "s 0, b 0");
    assert_eq!(heading(&["0", "2*pi"]), "s ~, b ~");
    assert_eq!(heading(&["0", "360*deg"]), "s ~, b ~");
    assert_eq!(heading(&["0", "6.283"]), "s 0, b 0");
    assert_eq!(heading(&["0", "pi"]), "s 0, b 0");
    // experiments share constants, but not starts
    let two =
        "name='m'\nexperiments=2\nparameters=['p']\n[states]\nx='0'\n[outputs]\ny='sin(p)*cos(x)'\nz='x'";
    assert_eq!(verdicts(two), "x@1 0, x@2 0, p 0");
}

#[test]
fn definite_values_are_what_they_are() {
    let with = |output: &str, constants: &str| {
        verdicts(&still("z x", output, &format!("[constants]\n{constants}\n")))
    };
    assert_eq!(with("z*sin(c) + x", "c=0"), "z -, x 0");
    assert_eq!(with("z*sin(c) + x", "c='pi'"), "z -, x 0");
    assert_eq!(with("z*sin(c) + x", "c='30*deg'"), "z ~, x ~");
    assert_eq!(with("z*log(c) + x", "c=1"), "z -, x 0");
    assert_eq!(with("z*log(c) + x", "c='1 + 1/3 - 4/3 + 1'"), "z -, x 0");
    assert_eq!(with("z*(exp(c) - 1) + x", "c=0"), "z -, x 0");
    assert_eq!(with("z*(sqrt(c) - 2) + x", "c=4"), "z -, x 0");
    assert_eq!(with("z*(c^0.5 - sqrt(2)) + x", "c=2"), "z -, x 0");
    assert_eq!(with("z*(8^(1/3) - c) + x", "c=2"), "z -, x 0");
    // functions at the ends of their ranges, where no verdict needs their derivative
    assert_eq!(with("z*(asin(c) - pi/2) + x", "c=1"), "z -, x 0");
    assert_eq!(with("z*acos(c) + x", "c=1"), "z -, x 0");
    assert_eq!(with("z*(acos(c) - pi) + x", "c=-1"), "z -, x 0");
    assert_eq!(with("z*sqrt(c) + x", "c=0"), "z -, x 0");
    assert_eq!(with("z*abs(c) + x", "c=0"), "z -, x 0");
    assert_eq!(with("z*(sign(c) + 1) + x", "c=-3"), "z -, x 0");
    assert_eq!(with("z*tanh(c) + x", "c=0"), "z -, x 0");
    assert_eq!(with("z*atan2(c, 5) + x", "c=0"), "z -, x 0");
    assert_eq!(with("z*(atan2(c, c) - pi/4) + x", "c=7"), "z -, x 0");
    assert_eq!(with("z*(4*atan(c/5) - atan(c/239) - pi/4) + x", "c=1"), "z -, x 0");
}

#[test]
fn starts_are_the_given_ones() {
    let pendulum = |rate: &str| {
        verdicts(&format!(
            "name='m'\nparameters=['k']\n[states]\nth={{equation='w', initial=0}}\n\
             w={{equation='-k*sin(th)', initial={rate}}}\n[outputs]\ny='th'"
        ))
    };
    // at rest the output is constant; with an initial rate th''' = -k w
    assert_eq!(pendulum("0"), "k -");
    assert_eq!(pendulum("1"), "k 3");
    let upside_down = "name='m'\nparameters=['k']\n[states]\nth={equation='w', initial='pi'}\n\
                       w={equation='-k*sin(th)', initial=0}\n[outputs]\ny='th'";
    assert_eq!(verdicts(upside_down), "k -");
    // from a generic start: y'' = -k sin y
    let free = "name='m'\nparameters=['k']\n[states]\nth='w'\nw='-k*sin(th)'\n[outputs]\ny='th'";
    assert_eq!(verdicts(free), "th 0, w 1, k 2");
    // order of a power of the time
    let power = |n: usize| {
        format!("name='m'\nparameters=['p']\n[states]\nx={{equation='1', initial=0}}\n[outputs]\ny='p*x^{n}'")
    };
    assert_eq!((verdicts(&power(20)), verdicts(&power(50))), ("p 20".into(), "p 50".into()));
    assert_eq!(verdicts(&power(80)), "p ?");
    let timed = "name='m'\nparameters=['p']\n[states]\nx='0'\n[outputs]\ny='p*t^3 + x'";
    assert_eq!(verdicts(timed), "x 0, p 3");
    let input = "name='m'\nparameters=['p']\nknown_inputs={u={function='1 - cos(t)'}}\n[states]\nx='0'\n[outputs]\n\
                 y='p*u + x'";
    assert_eq!(verdicts(input), "x 0, p 2");
    // the end of the chain is proven where the rank is that of a generic point
    let never = judged(
        "name='m'\nparameters=['p', 'q']\n[states]\nx={equation='1', initial=0}\n[outputs]\ny='(p + q)*x^20'",
    );
    assert!(!never.rests_on_bound && never.findings.degrees.rank() == 1);
    // known start with a generic value
    let known =
        "name='m'\nparameters=['k']\n[states]\nx={equation='-k*exp(x)', initial='known'}\n[outputs]\ny='x'";
    assert_eq!(verdicts(known), "k 1");
}

#[test]
fn jumps_to_special_values_are_special() {
    // the output of the first segment is constant; after the jump x' = 1 + a x^2 starts at 0
    let jump = |to: &str| {
        format!(
            "name='m'\nparameters=['a']\n[constants]\nc=0\n[states]\nx='1 + a*x^2'\n[outputs]\ny='c*x'\n[[segment]]\n\
             [[segment]]\nconstants={{c='1'}}\ncarry={{x='{to}'}}"
        )
    };
    assert_eq!(verdicts(&jump("0")), "x -, a 3");
    assert_eq!(verdicts(&jump("1")), "x -, a 1");
    assert_eq!(verdicts(&jump("2*x")), "x 0, a 1");
    // functions in the jump
    assert_eq!(verdicts(&jump("sin(pi)*x")), "x -, a 3");
    assert_eq!(verdicts(&jump("cos(0)")), "x -, a 1");
}

/// Expressions that are constant for all x, q and w near one.
const IDENTITIES: [&str; 29] = [
    "sin(asin(x/2)) - x/2",
    "asin(sin(x)) - x",
    "acos(cos(x)) - x",
    "atan(tan(x)) - x",
    "tan(x) - sin(x)/cos(x)",
    "tanh(x) - (exp(x) - exp(-x))/(exp(x) + exp(-x))",
    "sqrt(exp(x)) - exp(x/2)",
    "exp(q*(x + w)) - exp(q*x + q*w)",
    "exp(q*(x + w)) - exp(q*x)*exp(q*w)",
    "(x^q)^w - x^(q*w)",
    "(x*q)^0.7368 - x^0.7368*q^0.7368",
    "log((x + 2)^2 - q^2) - log(x + 2 - q) - log(x + 2 + q)",
    "sqrt(x^2 + q^2)*cos(atan(q/x)) - x",
    "sqrt(x^2 + q^2)*sin(atan2(q, x)) - q",
    "atan2(q, x) - atan(q/x)",
    "sin(x*q + x) - sin(x*(q + 1))",
    "abs(x) - x",
    "abs(-x) - x",
    "sign(x*q)",
    "x^pi - exp(pi*log(x))",
    "exp(log(x)*2) - x^2",
    "sqrt(2)*sqrt(3)*x - sqrt(6)*x",
    "sin(x + pi) + sin(x)",
    "cos(x + 90*deg) + sin(x)",
    "log(exp(x) + exp(q)) - q - log(exp(x - q) + 1)",
    "atan(x) + atan(q) - atan2(x + q, 1 - x*q)",
    "sin(sin(x + q)) - sin(sin(x)*cos(q) + cos(x)*sin(q))",
    "sin(x)^2 + cos(x)^2",
    "x^0 + q^0",
];

/// A constant expression affects no output, however its arguments are related.
#[test]
fn related_values_are_related() {
    for zero in IDENTITIES {
        let text = format!(
            "name='identity'\n[states]\nx='w*x + q'\nq='x - w'\nw='0'\nz='-z'\n[outputs]\ny='z + ({zero})'"
        );
        let found = judged(&text);
        assert_eq!(found.findings.degrees.rank(), 1, "{zero}: {:?}", found.findings.degrees);
        assert_eq!(found.findings.degrees.degree[3], Some(0), "{zero}");
    }
    // expressions that are not constant affect the output
    for different in ["sin(asin(x/2)) - x", "sqrt(exp(x)) - exp(x/3)", "sin(x + 3.14159265) + sin(x)"] {
        let text = format!("name='m'\n[states]\nx='0'\nz='0'\n[outputs]\ny='z + ({different})'");
        assert_eq!(verdicts(&text), "x ~, z ~", "{different}");
    }
}

/// No seed leads to a refusal of roots, whatever their number.
#[test]
fn roots_are_never_refused() {
    let beacons: String =
        (0..12).map(|i| format!("r{i}='sqrt((x - {i})^2 + (y - {}.5)^2)'\n", (i * 7) % 12)).collect();
    let text = format!("name='m'\n[states]\nx='vx'\ny='vy'\nvx='0'\nvy='0'\n[outputs]\n{beacons}");
    for seed in 1..6 {
        let model = model_file::read(&text).expect("a model");
        let found = judge(&model, seed, None).expect("judged");
        assert_eq!(found.findings.degrees.degree, [Some(0), Some(0), Some(1), Some(1)]);
        let root = model_file::read(&still("x", "sqrt(2)*x", "")).expect("a model");
        assert_eq!(judge(&root, seed, None).expect("judged").findings.degrees.degree, [Some(0)]);
    }
    assert_eq!(
        verdicts("name='m'\nparameters=['k']\n[states]\nx='-k*x^0.7368'\n[outputs]\ny='x'"),
        "x 0, k 1"
    );
}

/// A point of the model's domain is found. If the domain is empty, the message names the place.
#[test]
fn points_lie_where_the_model_is_defined() {
    for inside in [
        "log(x - q - 5)",
        "asin(x/9 + q)",
        "sqrt(1 - x^2 - q^2)",
        "log(log(log(x))) + q",
        "acos(x*q)",
        "sqrt(-x) + q",
        "log(x^2 - q)",
    ] {
        let found = judged(&still("x q", inside, ""));
        assert_eq!(found.findings.degrees.rank(), 1, "{inside}");
    }
    let refused = |output: &str, rest: &str| {
        let model = model_file::read(&still("x q", output, rest)).expect("a model");
        judge(&model, 1, None).expect_err(output).to_string()
    };
    assert_eq!(
        refused("x + log(-1 - x^2)", ""),
        "the output y: log is not defined here at any of 2000 points that were tried"
    );
    assert_eq!(
        refused("x + asin(2 + x^2)", ""),
        "the output y: asin is not defined here at any of 2000 points that were tried"
    );
    assert_eq!(
        refused("x*sqrt(c)", "[constants]\nc=-2\n"),
        "the output y: sqrt is not defined here at any of 2000 points that were tried"
    );
    assert_eq!(
        refused("abs(sin(x)^2 + cos(x)^2 - 1) + q", ""),
        "the output y: abs of zero, where it has no derivative; expected an argument that is not zero"
    );
    assert_eq!(refused("x/sin(pi)", ""), "the output y: division by zero at every point that was tried");
    let from_zero = |output: &str| {
        let text =
            format!("name='m'\n[states]\nz={{equation='1', initial=0}}\nx='0'\n[outputs]\ny='{output}'");
        judge(&model_file::read(&text).expect("a model"), 1, None).expect_err(output).to_string()
    };
    assert_eq!(
        from_zero("x*sqrt(z)"),
        "the output y: sqrt of zero, where it has no derivative; expected an argument that is not zero"
    );
    assert_eq!(
        from_zero("x*acos(1 - z)"),
        "the output y: acos at an end of its range, where it has no derivative; expected an argument between -1 and 1"
    );
}

/// A constant with a given value gives the verdicts, orders and ranks of the model with the value written in.
#[test]
fn substituted_by_hand() {
    for (functions, by_hand) in [
        ("x*exp(c) + sin(c)*q + cos(c)*w", "x + w"),
        ("x*cos(c)^2 + x*q*sin(c) + log(1 + c)*w", "x"),
        ("sqrt(4 + c)*x + q*abs(c - 1) + w*tanh(c)", "2*x + q"),
        ("(2 + c)^1.5*x/2^1.5 + 3^c*q", "x + q"),
        ("atan2(c, 1)*x + x*q + asin(c)*w + acos(1 + c)*w", "x*q"),
    ] {
        let model = |output: &str| {
            judged(&format!(
                "name='m'\n[constants]\nc=0\n[states]\nx='q*x'\nq='w'\nw='x*w'\n[outputs]\ny='{output}'"
            ))
            .findings
            .degrees
        };
        assert_eq!(model(functions), model(by_hand), "{functions}");
    }
}

/// Terms over x, q, w as text, each with an equivalent spelling.
fn terms() -> impl Strategy<Value = (String, String)> {
    let leaf = prop_oneof![
        Just(("x".to_string(), "x".to_string())),
        Just(("q".into(), "q".into())),
        Just(("w".into(), "w".into())),
        (1..5i32).prop_map(|k| (format!("{k}"), format!("{k}"))),
    ];
    leaf.prop_recursive(3, 12, 2, |inner| {
        prop_oneof![
            (inner.clone(), inner.clone())
                .prop_map(|(a, b)| { (format!("({} + {})", a.0, b.0), format!("({} + {})", b.1, a.1)) }),
            (inner.clone(), inner.clone())
                .prop_map(|(a, b)| (format!("({}*{})", a.0, b.0), format!("({}*{})", a.1, b.1))),
            // addition theorems
            (inner.clone(), inner.clone()).prop_map(|(a, b)| (
                format!("sin({} + {})", a.0, b.0),
                format!("(sin({0})*cos({1}) + cos({0})*sin({1}))", a.1, b.1)
            )),
            // shifted angles
            inner.clone().prop_map(|a| (format!("cos({})", a.0), format!("sin({} + pi/2)", a.1))),
            // products under roots and logarithms, with positive factors
            (inner.clone(), inner.clone()).prop_map(|(a, b)| (
                format!("log((1 + {}^2)*(2 + {}^2))", a.0, b.0),
                format!("(log(1 + {}^2) + log(2 + {}^2))", a.1, b.1)
            )),
            inner
                .clone()
                .prop_map(|a| (format!("(1 + ({})^2)^1.3", a.0), format!("((1 + ({})^2)^2.6)^0.5", a.1))),
            // inverse functions
            inner.clone().prop_map(|a| (format!("({})", a.0), format!("tan(atan({}))", a.1))),
            inner.clone().prop_map(|a| (format!("tanh({})", a.0), format!("(1 - 2/(1 + exp(2*({}))))", a.1))),
            inner.prop_map(|a| (format!("exp(-({})^2)", a.0), format!("1/exp(({})^2)", a.1))),
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// Two spellings of the same model give the same verdicts, orders and ranks.
    #[test]
    fn identities_change_nothing(f in terms(), g in terms(), h in terms()) {
        let model = |f: &str, g: &str, h: &str| {
            format!("name='m'\n[states]\nx='{f}'\nq='{g}'\nw='0'\n[outputs]\ny='{h}'")
        };
        let one = model_file::read(&model(&f.0, &g.0, &h.0)).and_then(|m| judge(&m, 3, None));
        let other = model_file::read(&model(&f.1, &g.1, &h.1)).and_then(|m| judge(&m, 3, None));
        // towers of exponentials exceed any number of digits, and the message says so
        if let (Ok(one), Ok(other)) = (&one, &other) {
            prop_assert_eq!(&one.findings.degrees, &other.findings.degrees, "{} {} {}", f.0, g.0, h.0);
        }
    }
}

#[test]
fn certainty_names_what_it_rests_on() {
    // two dependent functions
    let SystemCertainty::Digits(d) = judged(&still("x", "sin(x) + sin(x + 1)", "")).certainty else {
        panic!("related functions are judged in digits")
    };
    assert_eq!(d.digits, [77, 115]);
    assert!(d.zero < d.nonzero - 30.0);
    assert!(matches!(judged(&still("x", "x^2", "")).certainty, SystemCertainty::Primes(_)));
}

/// Prime fields judge only models whose functions have independent values. Each of the other models has a
/// relation, a special value or a branch that random values would miss.
#[test]
fn only_independent_functions_are_judged_in_prime_fields() {
    let by_primes = |states: &str, output: &str, rest: &str| {
        matches!(judged(&still(states, output, rest)).certainty, SystemCertainty::Primes(_))
    };
    for independent in [
        "sin(x) + q*cos(x)",
        "exp(x)*exp(q)",
        "sin(x) + exp(x) + log(x)",
        "sin(exp(x)*q) + exp(x)",
        "x^w + q",
        "pi*x + sin(x + pi)",
        "tanh(x) + exp(x) + atan(x)",
        "sin(1.5*x)*q",
        // dependent by addition theorems only
        "exp(x) + exp(2*x)",
        "exp(x + q) + exp(x)*exp(q)",
        "sin(x) + sin(x + pi/2)",
        "tanh(x) + exp(2*x)",
        "sin(x - q) + cos(x)*cos(q)",
        "exp(w*(x + q)) + exp(w*x)*q + exp(q*w/2)",
        "x*sin(pi) + q*cos(90*deg) + sin(w)",
        "exp(x - x) + q",
    ] {
        assert!(by_primes("x q w", independent, ""), "{independent}");
    }
    for related in [
        "exp(log(x)/2) + q",
        "exp(x) + exp(x + 1)",
        "sin(x) + sin(x + 1)",
        "sin(x) + sin(x + 30*deg)",
        "sin(x) + sin(40*x)",
        "log(x*q) + log(x) + log(q)",
        "log(exp(x)*q) + log(q)",
        "sin(atan(x))",
        "atan(x) + atan(1/x)",
        "sqrt(x) + q",
        "asin(x) + q",
        "abs(x) + q",
        "sin(1)*x",
        "x^0.7368",
    ] {
        assert!(!by_primes("x q w", related, ""), "{related}");
    }
    // given values, values that change, the time, experiments
    assert!(by_primes("x q", "sin(c*x)", "[constants]\nc=2\n"));
    assert!(!by_primes("x q", "x*sin(c)", "[constants]\nc=2\n"));
    assert!(by_primes("x q", "sin(c*x)", "[constants]\nc=0\n"));
    assert_eq!(verdicts(&still("x q", "sin(c*x)", "[constants]\nc=0\n")), "x -, q -");
    assert!(!by_primes("x q", "sin(c*x)", "[constants]\nc=2\n[[segment]]\n[[segment]]\nconstants={c=3}\n"));
    assert!(by_primes("x q", "c*sin(x)", "[constants]\nc=2\n[[segment]]\n[[segment]]\nconstants={c=3}\n"));
    assert!(!by_primes("x q", "sin(x)", "[[segment]]\n[[segment]]\ncarry={x='1'}\n"));
    assert!(by_primes("x q", "sin(x)*q", "[[segment]]\n[[segment]]\ncarry={q='1'}\n"));
    assert!(!by_primes("x q", "x*sin(t)", ""));
    let start = |of: &str| {
        let text = format!(
            "name='m'\n[states]\nx={{equation='q', initial=0}}\nq='-q'\n[outputs]\ny='x + exp({of})'"
        );
        matches!(judged(&text).certainty, SystemCertainty::Primes(_))
    };
    assert!(start("q") && !start("x"));
    assert!(matches!(
        judged("name='m'\nexperiments=2\n[states]\nx='0'\n[outputs]\ny='exp(x)'").certainty,
        SystemCertainty::Digits(_)
    ));
    // no real point: both engines refuse
    let nowhere = model_file::read(&still("x q", "x + log(-1 - x^2)", "")).expect("a model");
    assert!(judge(&nowhere, 1, None).is_err());
}

/// A constant of known value as exponent acts as its number, without a logarithm of the base.
#[test]
fn exponents_may_be_constants() {
    let power = |start: &str, exponent: &str, rest: &str| {
        format!(
            "name='m'\nparameters=['p']\n{rest}\n[states]\nx={{equation='1', initial='{start}'}}\n[outputs]\n\
             y='p*x^{exponent}'"
        )
    };
    let constant = |start: &str, exponent: &str, n: &str| {
        verdicts(&power(start, exponent, &format!("[constants]\nn='{n}'\nm='n + 1'")))
    };
    for (start, n, degree) in
        [("0", "2", 2), ("0", "7", 7), ("-1", "2", 0), ("-1", "-3", 0), ("-2", "1/3 + 2/3", 0)]
    {
        assert_eq!(constant(start, "n", n), format!("p {degree}"), "{start} {n}");
    }
    // exponents from several constants, exponents one half and less; the root of a negative number is refused
    assert_eq!(constant("0", "m", "2"), "p 3");
    assert_eq!(constant("0", "(2*n - 1)", "2"), "p 3");
    assert_eq!(constant("4", "n", "1/2"), "p 0");
    assert_eq!(constant("4", "n", "-0.25"), "p 0");
    let refused = model_file::read(&power("-4", "n", "[constants]\nn=0.5")).expect("a model");
    assert_eq!(
        judge(&refused, 1, None).expect_err("no root").to_string(),
        "the output y: sqrt is not defined here at any of 2000 points that were tried"
    );
    // the same as the number written in, and rational
    let free = |exponent: &str, rest: &str| {
        judged(&format!(
            "name='m'\nparameters=['p']\n{rest}\n[states]\nx='-p*x^{exponent}'\n[outputs]\ny='x^2'"
        ))
    };
    let (by_name, by_hand) = (free("n", "[constants]\nn=3"), free("3", ""));
    assert_eq!(by_name.findings.degrees, by_hand.findings.degrees);
    assert!(by_name.fields.is_some() && free("n", "[constants]\nn='generic'").fields.is_none());
    // exponents may differ between experiments; an exponent that a segment changes is not replaced by its
    // number
    let own = "name='m'\nexperiments=2\nparameters=['p']\n[constants]\nn=2\n[states]\nx={equation='1', initial=0}\n\
               [outputs]\ny='p*x^n'\n[[experiment]]\n[[experiment]]\nconstants={n=4}\n";
    assert_eq!(verdicts(own), "p 2");
    let later = own.replace("[constants]\nn=2", "[constants]\nn=5");
    assert_eq!(verdicts(&later), "p 4");
    let segment = "name='m'\n[constants]\nn=1\n[states]\nx='0'\nz='0'\n[outputs]\ny='z + x^n'\n[[segment]]\n\
                   [[segment]]\nconstants={n=2}\n";
    assert_eq!(verdicts(segment), "x 0, z 0");
}

/// Model with numbers for a filter; unknowns without a value get one near 1.
fn with_numbers(text: &str, duration: f64) -> String {
    let model = model_file::read(text).unwrap_or_else(|e| panic!("{e}: {text}"));
    let mut values = String::new();
    let states = model.states.iter().filter(|s| !matches!(s.start, StateStart::Value(_)));
    let names = states.map(|s| &s.named.name).chain(model.parameters.iter().map(|p| &p.name));
    for (i, name) in names.enumerate() {
        values += &format!("{name}={}\n", 0.7 - 0.13 * i as f64);
    }
    let noise: String = model.outputs.iter().map(|o| format!("{}=0.01\n", o.0.name)).collect();
    format!(
        "{text}\n[simulation]\nduration={duration}\nstep=0.01\n[simulation.values]\n{values}\n[simulation.noise]\n\
         {noise}"
    )
}

/// The samples of a filter confirm every named case, or do not resolve it.
#[test]
fn the_information_agrees_on_every_named_case() {
    let tumble = |angles: &[&str]| at_angles("s*9.81*sin(a) + b", angles);
    let heading = |angles: &[&str]| at_angles("s*cos(a) + b", angles);
    let constant = |output: &str, c: &str| still("z x", output, &format!("[constants]\nc={c}\n"));
    let pendulum = |th: &str, w: &str| {
        format!(
            "name='m'\nparameters=['k']\n[states]\nth={{equation='w', initial='{th}'}}\n\
             w={{equation='-k*sin(th)', initial='{w}'}}\n[outputs]\ny='th'"
        )
    };
    let beacons: String =
        (0..12).map(|i| format!("r{i}='sqrt((x - {i})^2 + (y - {}.5)^2)'\n", (i * 7) % 12)).collect();
    let satellites: String = (0..5)
        .map(|i| format!("r{i}='sqrt((x - {})^2 + (y - {})^2 + (z - 20)^2) + c'\n", 5 * i, (i * 3) % 5 - 2))
        .collect();
    let mut cases = vec![
        tumble(&["0", "0.5", "1.5"]),
        tumble(&["0.5", "1.5"]),
        tumble(&["0"]),
        tumble(&["0.5"]),
        tumble(&["30*deg", "150*deg"]),
        heading(&["0", "3.14159265"]),
        heading(&["0", "2*pi"]),
        constant("z*sin(c) + x", "0"),
        constant("z*sin(c) + x", "'pi'"),
        constant("z*log(c) + x", "1"),
        constant("z*log(c) + x", "2"),
        pendulum("0", "0"),
        pendulum("0", "1"),
        pendulum("pi", "0"),
        "name='m'\nparameters=['k']\n[states]\nth='w'\nw='-k*sin(th)'\n[outputs]\ny='th'".into(),
        "name='m'\nparameters=['a']\n[constants]\nc=0\n[states]\nx='1 + a*x^2'\n[outputs]\ny='c*x'\n[[segment]]\n\
         [[segment]]\nconstants={c='1'}\ncarry={x='0'}".into(),
        "name='m'\nparameters=['p']\n[states]\nx={equation='1', initial=0}\n[outputs]\ny='p*x^20'".into(),
        still("x", "sqrt(2)*x", ""),
        format!("name='m'\n[states]\nx='vx'\ny='vy'\nvx='0'\nvy='0'\n[outputs]\n{beacons}"),
        format!("name='m'\n[states]\nx='0'\ny='0'\nz='0'\nc='0'\n[outputs]\n{satellites}"),
        "name='m'\nparameters=['k']\n[states]\nx='-k*x^0.7368'\n[outputs]\ny='x'".into(),
        "name='m'\n[states]\nx='u'\nv='0'\nu='v'\n[outputs]\ny='atan(u/x)'\nz='sqrt(u^2 + x^2)'".into(),
    ];
    cases.extend(
        IDENTITIES.iter().map(|zero| {
            format!("name='m'\n[states]\nx='0'\nq='0'\nw='0'\nz='-z'\n[outputs]\ny='z + ({zero})'")
        }),
    );
    let (mut disagree, mut checks) = (Vec::new(), 0);
    for text in &cases {
        let model = model_file::read(&with_numbers(text, 1.0)).unwrap_or_else(|e| panic!("{e}: {text}"));
        match crosscheck_system(&model, 1) {
            Ok(e) if e.passed => checks += e.checks,
            Ok(e) => disagree.push(format!("{text}\n{e:?}")),
            Err(e) => disagree.push(format!("{text}\n{e}")),
        }
    }
    assert!(disagree.is_empty(), "{} of {}\n{}", disagree.len(), cases.len(), disagree.join("\n\n"));
    assert!(checks > 3 * cases.len(), "{checks}");
}

/// Difficult cases, each derived by hand from the first derivatives of the output.
#[test]
fn held_out_models() {
    let c = |output: &str, value: &str| still("z x", output, &format!("[constants]\nc='{value}'\n"));
    let two = |output: &str, angles: &[&str]| {
        let segments: String =
            angles.iter().map(|a| format!("[[segment]]\nconstants={{a='{a}'}}\n")).collect();
        still("s m", output, &format!("[constants]\na=0\n{segments}"))
    };
    let model = |parameters: &str, states: &str, outputs: &str, rest: &str| {
        format!("name='m'\n{rest}parameters=[{parameters}]\n[states]\n{states}\n[outputs]\n{outputs}\n")
    };
    let start = |rate: &str, x: &str, p: &str| {
        model(p, &format!("x={{equation='{rate}', initial='{x}'}}"), "y='x'", "")
    };
    let pendulum = |th: &str, w: &str| model("'l', 'd'", &format!("th={th}\nw={w}"), "y='th'", "");
    let swing = |th: &str, w: &str| {
        pendulum(
            &format!("{{equation='w', initial={th}}}"),
            &format!("{{equation='-9.81/l*sin(th) - d*w', initial={w}}}"),
        )
    };
    let arrhenius = "name='m'\nexperiments=2\nparameters=['A', 'E']\n[constants]\nT=300\n[states]\n\
                     x='-A*exp(-E/T)*x'\n[outputs]\ny='x'\n[[experiment]]\n[[experiment]]\nconstants={T=350}\n";
    let cases: Vec<(String, &str)> = vec![
        // given values
        (c("z*tan(c) + x", "0"), "z -, x 0"),
        (c("z*(cos(c) - 1) + x", "2*pi"), "z -, x 0"),
        (c("z*(exp(c) - exp(1)) + x", "1"), "z -, x 0"),
        (c("z*(c^c - 4) + x", "2"), "z -, x 0"),
        (c("z*(c^c - 4) + x", "2.0001"), "z ~, x ~"),
        (c("z*(sqrt(c)*sqrt(c) - c) + x", "3"), "z -, x 0"),
        (c("z*tanh(c) + x", "0.1"), "z ~, x ~"),
        (c("z*(log(c) - 3*log(2)) + x", "8"), "z -, x 0"),
        (c("z*(sin(c)^2 - 3/4) + x", "60*deg"), "z -, x 0"),
        (c("z*((c + 1)^(c - 1) - 9) + x", "2"), "z ~, x ~"),
        (c("z*((c + 1)^c - 9) + x", "2"), "z -, x 0"),
        // special starts
        (start("p*sin(x)", "0", "'p'"), "p -"),
        (start("p*sin(x)", "pi/2", "'p'"), "p 1"),
        (start("p*cos(x)", "0", "'p'"), "p 1"),
        (start("p*x + q", "0", "'p', 'q'"), "p 2, q 1"),
        (start("1 + p*(exp(x) - 1 - x)", "0", "'p'"), "p 3"),
        (swing("0", "0"), "l -, d -"),
        (swing("0", "1"), "l 3, d 2"),
        (pendulum("'w'", "'-9.81/l*sin(th) - d*w'"), "th 0, w 1, l 3, d 3"),
        // dependence on the time
        (model("'k'", "x='0'", "y='x*exp(-k*t)'", ""), "x 0, k 1"),
        (still("a w phi", "a*sin(w*t + phi)", ""), "a 2, w 2, phi 2"),
        (still("a w", "a*sin(w*t)", ""), "a 3, w 3"),
        (still("a w", "a*cos(w*t)", ""), "a 0, w 2"),
        (
            model("'p'", "x={equation='p*u', initial=0}", "y='x'", "known_inputs={u={function='sin(t)'}}\n"),
            "p 2",
        ),
        (
            model(
                "'p'",
                "x={equation='p*u', initial=0}",
                "y='x'",
                "known_inputs={u={function='exp(t) - 1 - t'}}\n",
            ),
            "p 3",
        ),
        // related values
        (model("", "x='0'\nq='0'", "y='log(x) + log(q)'\nz='x*q'", ""), "x ~, q ~"),
        (model("", "x='0'\nq='0'", "y='exp(x)*exp(q)'\nz='x - q'", ""), "x 0, q 0"),
        (model("", "x='0'\nq='0'", "y='atan2(x, q)'\nz='x^2 + q^2'", ""), "x 0, q 0"),
        (model("", "x='0'\nq='0'", "y='sqrt(x)*sqrt(q)'\nz='sqrt(x*q)'", ""), "x ~, q ~"),
        (model("", "x='0'\nq='0'", "y='x^q'\nz='q*log(x)'", ""), "x ~, q ~"),
        (model("", "x='0'\nq='0'", "y='x^q'\nz='q'", ""), "x 0, q 0"),
        (still("x q", "sqrt(x^2 + 2*x*q + q^2)", ""), "x ~, q ~"),
        (still("x z", "(x^2)^0.5 - x + z", ""), "x -, z 0"),
        (still("x z", "acos(x) + asin(x) + z", ""), "x -, z 0"),
        (still("x z", "sign(x)*z + x", ""), "x ~, z ~"),
        (still("x z", "abs(x*z)", ""), "x ~, z ~"),
        (model("'r', 'K'", "x='r*x*log(K/x)'", "y='x'", ""), "x 0, r 2, K 2"),
        (model("", "x='v*cos(h)'\ny='v*sin(h)'\nh='0'\nv='0'", "a='x'\nb='y'", ""), "x 0, y 0, h 1, v 1"),
        (
            model("", "x='v*cos(h)'\ny='v*sin(h)'\nh='0'\nv={equation='0', initial=0}", "a='x'\nb='y'", ""),
            "x 0, y 0, h -",
        ),
        // segments and experiments
        (two("s*sin(a) + m*cos(a)", &["0", "90*deg"]), "s 0, m 0"),
        (two("s*sin(a) + m*cos(a)", &["30*deg", "210*deg"]), "s ~, m ~"),
        (two("s*sin(a) + m*cos(a)", &["30*deg", "390*deg"]), "s ~, m ~"),
        (two("s*sin(a) + m*cos(a)", &["0", "pi"]), "s -, m 0"),
        (two("s*exp(a) + m", &["0", "log(1)"]), "s ~, m ~"),
        (two("s*exp(a) + m", &["0", "log(2)"]), "s 0, m 0"),
        (arrhenius.into(), "x@1 0, x@2 0, A 1, E 1"),
        (arrhenius.replace("350", "300"), "x@1 0, x@2 0, A ~, E ~"),
        (
            "name='m'\nexperiments=2\nparameters=['p']\n[constants]\nc=0\n[states]\nx='0'\n[outputs]\n\
             y='p*sin(c) + x'\n[[experiment]]\n[[experiment]]\nconstants={c='pi/2'}\n"
                .into(),
            "x@1 0, x@2 ~, p ~",
        ),
    ];
    let wrong = cases.iter().filter_map(|(text, truth)| {
        let found = verdicts(text);
        (found != *truth).then(|| format!("{found} instead of {truth}:\n{text}"))
    });
    let wrong: Vec<String> = wrong.collect();
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}

/// The answer names the branches of its verdicts and the basis of each number of solutions.
#[test]
fn the_answer_says_what_it_leaves_open() {
    let analysis = |text: &str| {
        let model = model_file::read(text).unwrap_or_else(|e| panic!("{e}: {text}"));
        analyze_system(&model, SystemOptions::default()).expect("judged")
    };
    let of = |output: &str| analysis(&still("x z", output, "")).branches;
    assert_eq!(of("sqrt(x^2) + abs(z)"), ["sqrt", "abs"]);
    assert_eq!(of("sqrt(2)*x + exp(z)"), [""; 0]);
    let plain = analysis("name='m'\n[states]\nx='-sin(x)*z'\nz='0'\n[outputs]\ny='x'");
    assert_eq!(plain.quantities[0].number_of_solutions, Some(NumberOfSolutions::OneByExpression));
    assert_eq!(plain.quantities[0].solution.as_deref(), Some("y"));
    assert!(matches!(plain.quantities[1].number_of_solutions, Some(NumberOfSolutions::Undecided(_))));
    let fall = analysis("name='m'\n[states]\nx='v'\nv='a'\na='-sin(v)'\n[outputs]\ny='x'");
    let shown: Vec<Option<&str>> = fall.quantities.iter().map(|q| q.solution.as_deref()).collect();
    assert_eq!(shown, [Some("y"), Some("y'"), Some("y''")]);
    assert!(plain.note.expect("why").contains("without functions only"));
    assert_eq!((plain.independent_functions, plain.error_bound.is_some()), (Some(2), true));
}

/// Constraints in models with functions: a pendulum on a circle, observed by its bearing.
#[test]
fn constraints_beside_functions() {
    let circle = |constraint: &str, output: &str| {
        verdicts(&format!(
            "name='m'\n{constraint}[states]\nx='-w*y'\ny='w*x'\nw='0'\n[outputs]\nz='{output}'"
        ))
    };
    // without a constraint the bearing does not determine the radius
    assert_eq!(circle("", "atan2(y, x)"), "x ~, y ~, w 1");
    assert_eq!(circle("constraints=['x^2 + y^2 = 2']\n", "atan2(y, x)"), "x 0, y 0, w 1");
    assert_eq!(circle("constraints=['x^2 + y^2 = 2']\n", "exp(x)"), "x 0, y 0, w 1");
    // the constraint gives the radius, so the output adds nothing
    assert_eq!(circle("constraints=['x^2 + y^2 = 2']\n", "log(x^2 + y^2)"), "x ~, y ~, w -");
    let two = "constraints=['x^2 + y^2 = 2', 'x = y']\n";
    assert_eq!(circle(two, "sin(w*x)"), "x 0, y 0, w 0");
    // a constraint without real points
    let none = model_file::read(
        "name='m'\nconstraints=['x^2 + y^2 = -1']\n[states]\nx='0'\ny='0'\n[outputs]\nz='exp(x)'",
    )
    .expect("a model");
    let refused = judge(&none, 1, None).expect_err("no real point").to_string();
    assert!(refused.contains("no real point meets it"), "{refused}");
}

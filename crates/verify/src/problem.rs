//! Checked problem of a scheme, and its rows in any ring.

use crate::file::{Functional, Number, RawAxis, RawProblem, RowName};
use crate::{Refused, need, refusal};

/// Orders of rows: `F^4 = -(wN^2 + wU^2) F^2`, so 0 to 3 suffice.
pub(crate) const ORDERS: usize = 4;
/// Full turn in 1e-9 degrees.
pub(crate) const TURN: i64 = 360_000_000_000;
/// Drift terms of the gyros, by the axes whose components of g they multiply.
const GRAVITY: [&str; 10] = ["F", "I", "O", "S", "II", "OO", "SS", "IO", "IS", "OS"];
/// Error terms of the torquers of the gyros.
const RATE: [&str; 3] = ["GS", "GM", "GM3"];
/// Error terms of the accelerometers.
const FORCE: [&str; 7] = ["K0", "K1", "M6", "M3", "K2", "K3", "Kx"];
const SENSORS: [char; 3] = ['X', 'Y', 'Z'];
/// Local quantities: psi, eps, a in n.
const LOCAL: usize = 9;

/// Names of all terms, in their order.
pub(crate) fn all_terms() -> impl Iterator<Item = &'static str> {
    GRAVITY.into_iter().chain(RATE).chain(FORCE)
}

/// Signed axis: its index, and true if it is negative.
pub(crate) type Axis = (usize, bool);

/// Checked problem of a scheme.
pub(crate) struct Problem {
    pub carry: String,
    /// Latitude as text, then in 1e-9 degrees.
    pub latitude_deg: Option<String>,
    pub latitude: Option<i64>,
    pub pole: bool,
    pub equator: bool,
    pub positions: Vec<[i64; 3]>,
    pub names: Vec<String>,
    azimuth: bool,
    /// Number of psi unknowns.
    pub psi: usize,
    pub coefficients: Vec<Coefficient>,
    /// Turns to every position, if torquer errors act in them; empty otherwise.
    pub slews: Vec<Vec<Slew>>,
}

/// Sensor, axis and factors of a coefficient.
pub(crate) struct Coefficient {
    pub of: Source,
    pub input: Axis,
    pub factors: Vec<Axis>,
}

/// Vector whose components are the factors of a coefficient.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Source {
    Gravity,
    Rate,
    Force,
}

/// One turn of a slew.
pub(crate) struct Slew {
    pub about: TurnAxis,
    /// Angle in 1e-9 degrees.
    pub angle: i64,
}

/// Axis of a turn.
pub(crate) enum TurnAxis {
    /// Axis of the shortest turn between the attitudes before and after it.
    Shortest,
    /// Platform axis X_p, Y_p or Z_p.
    Platform(usize),
    /// Geographic axis N, U or E.
    Geographic(usize),
    /// Axis of the middle gimbal at this gamma.
    Middle(i64),
    /// Direction in n.
    Direction([Number; 3]),
}

/// Ring of the entries of rows.
pub(crate) trait Ring {
    type Element: Clone;
    fn zero(&self) -> Self::Element;
    fn one(&self) -> Self::Element;
    fn add(&self, a: &Self::Element, b: &Self::Element) -> Self::Element;
    fn mul(&self, a: &Self::Element, b: &Self::Element) -> Self::Element;
    fn neg(&self, a: &Self::Element) -> Self::Element;
    fn is_zero(&self, a: &Self::Element) -> bool;
    /// Cosine and sine of an angle in 1e-9 degrees.
    fn cos_sin(&self, angle: i64) -> (Self::Element, Self::Element);
    /// `wN` and `wU`.
    fn rates(&self) -> [Self::Element; 2];
    /// Effects of slews on psi^n per position: three rows, one column per coefficient.
    fn left(&self, problem: &Problem, attitudes: &[Matrix<Self::Element>]) -> Vec<Matrix<Self::Element>>;
}

pub(crate) type Matrix<E> = Vec<Vec<E>>;

fn dot<'a, R: Ring>(ring: &R, terms: impl Iterator<Item = (&'a R::Element, &'a R::Element)>) -> R::Element
where
    R::Element: 'a,
{
    let terms = terms.filter(|(a, b)| !ring.is_zero(a) && !ring.is_zero(b));
    terms.fold(ring.zero(), |sum, (a, b)| ring.add(&sum, &ring.mul(a, b)))
}

pub(crate) fn times<R: Ring>(ring: &R, a: &Matrix<R::Element>, b: &Matrix<R::Element>) -> Matrix<R::Element> {
    let entry = |row: &Vec<R::Element>, j: usize| dot(ring, row.iter().zip(b.iter().map(|r| &r[j])));
    a.iter().map(|row| (0..b[0].len()).map(|j| entry(row, j)).collect()).collect()
}

/// Attitude `C = Mx(alpha) My(beta) Mz(gamma)`.
fn attitude<R: Ring>(ring: &R, angles: &[i64; 3]) -> Matrix<R::Element> {
    let [(ca, sa), (cb, sb), (cg, sg)] = angles.map(|a| ring.cos_sin(a));
    let (o, i) = (|| ring.zero(), || ring.one());
    let x = vec![vec![i(), o(), o()], vec![o(), ca.clone(), sa.clone()], vec![o(), ring.neg(&sa), ca]];
    let y = vec![vec![cb.clone(), o(), ring.neg(&sb)], vec![o(), i(), o()], vec![sb, o(), cb]];
    let z = vec![vec![cg.clone(), sg.clone(), o()], vec![ring.neg(&sg), cg, o()], vec![o(), o(), i()]];
    times(ring, &times(ring, &x, &y), &z)
}

/// Refuses an unknown carry.
pub(crate) fn known_carry(carry: &str) -> Result<(), Refused> {
    let known = ["platform", "inertial", "reset"].contains(&carry);
    need(known, "problem.carry", "platform, inertial or reset", carry)
}

impl Problem {
    pub(crate) fn new(raw: &RawProblem) -> Result<Self, Refused> {
        known_carry(&raw.carry)?;
        let latitude = raw.latitude_deg.as_ref().map(|l| nanodeg("problem.latitude_deg", l)).transpose()?;
        let in_range = latitude.is_none_or(|l| l.abs() <= TURN / 4);
        need(in_range, "problem.latitude_deg", "-90 to 90", raw.latitude_deg.as_deref().unwrap_or_default())?;
        let sorted: Vec<&str> = all_terms().filter(|t| raw.terms.iter().any(|r| r == t)).collect();
        let terms = raw.terms.join(",");
        need(
            !sorted.is_empty() && raw.terms == sorted,
            "problem.terms",
            "known terms in their order",
            &terms,
        )?;
        for both in [["M3", "M6"], ["GM", "GM3"]] {
            let one = !both.iter().all(|t| sorted.contains(t));
            need(one, "problem.terms", &format!("one of {}", both.join(", ")), &terms)?;
        }
        let count = raw.positions.len();
        need((1..=1000).contains(&count), "problem.positions", "1 to 1000 positions", count)?;
        let (gyros, inputs) = sensors(raw)?;
        let of_position = |(i, angles): (usize, &[String; 3])| {
            let angle = |k: usize| nanodeg(&format!("problem.positions.{i}"), &angles[k]);
            Ok::<_, Refused>([angle(0)?, angle(1)?, angle(2)?])
        };
        let positions = raw.positions.iter().enumerate().map(of_position).collect::<Result<Vec<_>, _>>()?;
        let copies = if raw.carry == "reset" { count } else { 1 };
        let suffix = |i: usize| if raw.carry == "reset" { format!("@{}", i + 1) } else { String::new() };
        let psi = (0..copies).flat_map(|i| ["x", "y", "z"].map(|a| format!("psi_{a}{}", suffix(i))));
        let mut names: Vec<String> = psi.collect();
        let (psi, mut coefficients) = (names.len(), Vec::new());
        for (name, coefficient) in sorted.iter().flat_map(|t| of_term(t, &gyros, &inputs)) {
            names.push(name);
            coefficients.push(coefficient);
        }
        need(names.len() <= 300, "problem", "at most 300 unknowns", names.len())?;
        let act = raw.carry == "inertial" && count > 1 && sorted.iter().any(|t| RATE.contains(t));
        let expected = if act { "a list" } else { "null" };
        need(raw.slews.is_some() == act, "problem.slews", expected, if act { "null" } else { "a list" })?;
        Ok(Self {
            slews: slews(raw, &positions)?,
            carry: raw.carry.clone(),
            latitude_deg: raw.latitude_deg.clone(),
            latitude,
            pole: latitude.is_some_and(|l| l.abs() == TURN / 4),
            equator: latitude == Some(0),
            positions,
            names,
            azimuth: raw.measured_azimuth,
            psi,
            coefficients,
        })
    }

    /// Column of an unknown; `None` for an unknown name.
    pub(crate) fn column(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    /// Smallest number of positions that may determine `seen` coefficients, by counting rows; `None` if
    /// the argument does not hold.
    pub(crate) fn fewest_positions(&self, seen: usize) -> Option<usize> {
        if seen == 0 || self.pole {
            return None;
        }
        let (reset, inertial) = (self.carry == "reset", self.carry == "inertial");
        let rows = 5 + usize::from(self.force()) + usize::from(self.azimuth);
        // without accelerometer errors and slews, the rows without drift are about psi alone
        let drift_alone = !(self.force() || inertial && self.is_torqued());
        let most = |k: usize| {
            let all = rows * k - if reset { 3 * k } else { 3 };
            match drift_alone {
                true => all.min(3 * k - usize::from(inertial && !self.azimuth)),
                false => all,
            }
        };
        (1..=seen).find(|&k| most(k) >= seen)
    }

    /// Largest number of factors of a coefficient.
    pub(crate) fn factors(&self) -> usize {
        self.coefficients.iter().map(|c| c.factors.len()).max().unwrap_or(0)
    }

    /// True if an error of a torquer is unknown.
    pub(crate) fn is_torqued(&self) -> bool {
        self.coefficients.iter().any(|c| c.of == Source::Rate)
    }

    /// True if an error of an accelerometer is unknown.
    pub(crate) fn force(&self) -> bool {
        self.coefficients.iter().any(|c| c.of == Source::Force)
    }

    pub(crate) fn components(&self) -> Vec<usize> {
        let force = self.force();
        (1..=4).filter(|c| (*c != 2 || force) && (*c != 4 || self.azimuth)).collect()
    }

    /// Matrix `S_i`: local quantities of a position as functions of the unknowns.
    pub(crate) fn local<R: Ring>(
        &self,
        ring: &R,
        i: usize,
        c: &Matrix<R::Element>,
        first: &Matrix<R::Element>,
    ) -> Matrix<R::Element> {
        let mut s = vec![vec![ring.zero(); self.names.len()]; LOCAL];
        let carried = if self.carry == "inertial" { first } else { c };
        let column = if self.carry == "reset" { 3 * i } else { 0 };
        for (row, carried) in s.iter_mut().zip(carried) {
            row[column..column + 3].clone_from_slice(carried);
        }
        let rates = ring.rates();
        for (k, Coefficient { of, input, factors }) in self.coefficients.iter().enumerate() {
            let start = if input.1 { ring.neg(&ring.one()) } else { ring.one() };
            let e = factors.iter().fold(start, |e, (axis, negative)| {
                // g = -u, f = u, with u the second row of C; the torqued rate is C^T (wN, wU, 0)
                let component = match of {
                    Source::Rate => dot(ring, c.iter().map(|row| &row[*axis]).zip(&rates)),
                    _ => c[1][*axis].clone(),
                };
                let product = ring.mul(&e, &component);
                if *negative != (*of == Source::Gravity) { ring.neg(&product) } else { product }
            });
            for r in 0..3 {
                s[if *of == Source::Force { 6 } else { 3 } + r][self.psi + k] = ring.mul(&c[r][input.0], &e);
            }
        }
        s
    }

    /// Attitude `C` of every position.
    pub(crate) fn attitudes<R: Ring>(&self, ring: &R) -> Vec<Matrix<R::Element>> {
        self.positions.iter().map(|a| attitude(ring, a)).collect()
    }

    /// All rows, by order, segment, component.
    pub(crate) fn rows<R: Ring>(&self, ring: &R) -> Vec<(RowName, Vec<R::Element>)> {
        let attitudes = self.attitudes(ring);
        let mut local: Vec<_> =
            attitudes.iter().enumerate().map(|(i, c)| self.local(ring, i, c, &attitudes[0])).collect();
        if !self.slews.is_empty() {
            for (s, left) in local.iter_mut().zip(ring.left(self, &attitudes)) {
                for (row, left) in s.iter_mut().zip(left) {
                    row[self.psi..].clone_from_slice(&left);
                }
            }
        }
        let [w_n, w_u] = ring.rates();
        let mut f = vec![vec![ring.zero(); LOCAL]; LOCAL];
        (f[0][2], f[1][2], f[2][0], f[2][1]) = (ring.neg(&w_u), w_n.clone(), w_u, ring.neg(&w_n));
        for i in 0..3 {
            f[i][3 + i] = ring.one();
        }
        let force = self.force();
        let output = |component: usize| {
            let mut h = vec![ring.zero(); LOCAL];
            match component {
                1 => h[2] = ring.one(),
                3 => h[0] = ring.neg(&ring.one()),
                4 => h[1] = ring.one(),
                _ => {}
            }
            if force && component < 4 {
                h[5 + component] = ring.one();
            }
            h
        };
        let mut chain: Matrix<R::Element> = self.components().into_iter().map(output).collect();
        let mut out = Vec::new();
        for k in 0..ORDERS {
            for (i, s) in local.iter().enumerate() {
                let names = self.components().into_iter().map(|c| (i + 1, k, c));
                out.extend(names.zip(times(ring, &chain, s)));
            }
            chain = times(ring, &chain, &f);
        }
        out
    }
}

/// Axes of the gyros (I, O, S each) and of the accelerometers.
fn sensors(raw: &RawProblem) -> Result<([[Axis; 3]; 3], [Axis; 3]), Refused> {
    let mut gyros = [[(0, false); 3]; 3];
    for (i, (slot, gyro)) in gyros.iter_mut().zip(&raw.gyros).enumerate() {
        let place = format!("problem.gyros.{i}");
        let [a, b, c] = [axis(&place, &gyro.I)?, axis(&place, &gyro.O)?, axis(&place, &gyro.S)?];
        // I x O = S: cyclic axes and an even number of signs, or anticyclic ones and an odd number
        let cyclic = (b.0 + 3 - a.0) % 3 == 1;
        let right = a.0 != b.0 && c.0 == 3 - a.0 - b.0 && (a.1 ^ b.1 ^ c.1) != cyclic;
        need(right, &place, "I x O = S", format!("I={} O={} S={}", gyro.I, gyro.O, gyro.S))?;
        *slot = [a, b, c];
    }
    let mut inputs = [(0, false); 3];
    for (i, (slot, text)) in inputs.iter_mut().zip(&raw.accelerometers).enumerate() {
        *slot = axis(&format!("problem.accelerometers.{i}"), text)?;
    }
    for (place, [a, b, c]) in
        [("problem.gyros", gyros.map(|g| g[0].0)), ("problem.accelerometers", inputs.map(|a| a.0))]
    {
        need(a != b && a != c && b != c, place, "three different input axes", "one twice")?;
    }
    Ok((gyros, inputs))
}

/// Coefficients of a term, with their names.
fn of_term(term: &str, gyros: &[[Axis; 3]; 3], inputs: &[Axis; 3]) -> Vec<(String, Coefficient)> {
    let of = match term {
        _ if FORCE.contains(&term) => Source::Force,
        _ if RATE.contains(&term) => Source::Rate,
        _ => Source::Gravity,
    };
    let one = |i: usize| {
        let (input, factors) = match term {
            "F" => (gyros[i][0], Vec::new()),
            "GS" => (gyros[i][0], vec![gyros[i][0]]),
            _ if of == Source::Gravity => {
                (gyros[i][0], term.chars().map(|a| gyros[i]["IOS".find(a).unwrap_or(0)]).collect())
            }
            _ => (inputs[i], vec![inputs[i]; term[1..].parse().unwrap_or(0)]),
        };
        let gravity = of == Source::Gravity;
        let name = if gravity { format!("D_{term}{}", SENSORS[i]) } else { format!("{term}_{}", SENSORS[i]) };
        (name, Coefficient { of, input, factors })
    };
    if !["GM", "GM3", "M6", "M3", "Kx"].contains(&term) {
        return (0..3).map(one).collect();
    }
    let inputs = if of == Source::Rate { gyros.map(|g| g[0]) } else { *inputs };
    let triangle = term == "M3" || term == "GM3";
    let pairs = (0..9).map(|k| (k / 3, k % 3)).filter(|(i, j)| j < i || j > i && !triangle);
    let of_pair = |(i, j): (usize, usize)| {
        let factors = if term == "Kx" { vec![inputs[i], inputs[j]] } else { vec![inputs[j]] };
        let family = term.trim_end_matches(['3', '6']);
        (format!("{family}_{}{}", SENSORS[i], SENSORS[j]), Coefficient { of, input: inputs[i], factors })
    };
    pairs.map(of_pair).collect()
}

/// Turns to every position.
fn slews(raw: &RawProblem, positions: &[[i64; 3]]) -> Result<Vec<Vec<Slew>>, Refused> {
    let Some(slews) = &raw.slews else { return Ok(Vec::new()) };
    let found = slews.len();
    need(found == positions.len(), "problem.slews", &format!("{} lists", positions.len()), found)?;
    let mut out = Vec::with_capacity(found);
    for (i, turns) in slews.iter().enumerate() {
        let place = format!("problem.slews.{i}");
        let most = if i > 0 { 3 } else { 0 };
        need(turns.len() <= most, &place, &format!("at most {most} turns"), turns.len())?;
        let turn = |turn: &crate::file::RawTurn| {
            let about = match &turn.about {
                None if turns.len() == 1 => TurnAxis::Shortest,
                None => return Err(refusal(&place, "an axis where there are several turns", "null")),
                Some(RawAxis::Direction(v)) => {
                    let plain = v.iter().all(|x| x.0.keys().all(|(_, a, b)| *a == 0 && *b == 0));
                    need(plain, &place, "numbers without rates", "a rate")?;
                    TurnAxis::Direction(v.clone())
                }
                Some(RawAxis::Named(name)) => match name.as_str() {
                    "X_p" => TurnAxis::Platform(0),
                    "Y_p" => TurnAxis::Platform(1),
                    "Z_p" => TurnAxis::Platform(2),
                    "N" => TurnAxis::Geographic(0),
                    "U" => TurnAxis::Geographic(1),
                    "E" => TurnAxis::Geographic(2),
                    "middle" => TurnAxis::Middle(positions[i - 1][2]),
                    _ => return Err(refusal(&place, "an axis of a turn", name)),
                },
            };
            Ok(Slew { about, angle: nanodeg(&place, &turn.angle_deg)? })
        };
        out.push(turns.iter().map(turn).collect::<Result<_, _>>()?);
    }
    Ok(out)
}

fn axis(place: &str, text: &str) -> Result<Axis, Refused> {
    let negative = text.starts_with('-');
    let found = ["x", "y", "z"].iter().position(|a| text.get(1..) == Some(a));
    match found.filter(|_| negative || text.starts_with('+')) {
        Some(index) => Ok((index, negative)),
        None => Err(refusal(place, "an axis such as +x", text)),
    }
}

/// Decimal number of degrees in 1e-9 degrees; only its canonical form is accepted.
pub(crate) fn nanodeg(place: &str, text: &str) -> Result<i64, Refused> {
    let digits = text.strip_prefix('-').unwrap_or(text);
    let (whole, decimals) = digits.split_once('.').unwrap_or((digits, ""));
    let all_digits = |s: &str| s.bytes().all(|b| b.is_ascii_digit());
    let form =
        (1..=7).contains(&whole.len()) && decimals.len() <= 9 && all_digits(whole) && all_digits(decimals);
    let form = form && (whole == "0" || !whole.starts_with('0')) && !decimals.ends_with('0');
    let form = form && (decimals.is_empty() != digits.contains('.')) && text != "-0";
    need(form, place, "a decimal of degrees as text", text)?;
    let magnitude = format!("{whole}{decimals:0<9}").parse::<i64>().unwrap_or(i64::MAX);
    need(magnitude <= 1_000_000_000_000_000, place, "at most 1000000 in magnitude", text)?;
    Ok(if text.starts_with('-') { -magnitude } else { magnitude })
}

impl Functional {
    /// Refuses a functional with names that are no unknowns of the problem, with an entry 0, or with a
    /// power of a rate that is 0.
    pub(crate) fn check(&self, place: &str, problem: &Problem) -> Result<(), Refused> {
        need(!self.0.is_empty(), place, "at least one unknown", "none")?;
        for (name, number) in &self.0 {
            need(problem.column(name).is_some(), place, "names of unknowns", name)?;
            need(!number.0.is_empty(), &format!("{place}.{name}"), "a number other than 0", "0")?;
            number.check(&format!("{place}.{name}"), problem)?;
        }
        Ok(())
    }
}

impl Number {
    /// Refuses powers of a rate that is 0.
    pub(crate) fn check(&self, place: &str, problem: &Problem) -> Result<(), Refused> {
        let wrong = self.0.keys().find(|(_, a, b)| problem.pole && *a != 0 || problem.equator && *b != 0);
        need(wrong.is_none(), place, "no power of a rate that is 0", "one")
    }
}

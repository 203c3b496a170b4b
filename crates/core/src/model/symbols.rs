//! Symbols of exact formulas: sines and cosines of angles, square roots of 2 and 3.

use std::sync::OnceLock;

use crate::language::{Environment, Expression, Node, evaluate, parse};
use crate::model::angle::{Angle, format_decimal};
use crate::model::platform::{FieldSample, Platform, PlatformPoint, RandomValues};
use crate::model::ring::{ManyDigits, Real, Ring, Text};
use crate::model::scheme::Station;

/// Angle whose sine and cosine remain symbols.
#[derive(Debug, Clone, PartialEq, Eq)]
enum BaseAngle {
    /// A generic angle.
    Name(String),
    /// A constant angle between 0 and 45 degrees, in 1e-9 degrees.
    Constant(i64),
}

/// Symbols in the formulas of a scheme.
#[derive(Debug, Clone, Default)]
pub struct Symbols {
    bases: Vec<BaseAngle>,
    radicals: bool,
    /// Indices of the positions that rotate.
    turning: Vec<usize>,
    /// Cosine and sine of every constant angle in many digits, computed at the first request.
    digits: OnceLock<Vec<Option<(Real, Real)>>>,
}

impl Symbols {
    /// The symbols of `platform`: one base per generic name, and one per constant angle that is no multiple
    /// of 15 degrees. Angles that agree up to sign, complement or supplement share a base.
    pub fn of(platform: &Platform) -> Self {
        // requested combinations may contain square roots
        let radicals = platform.scheme().combinations.iter().any(|c| c.contains('('));
        let positions = platform.scheme().positions.iter().enumerate();
        let turning = positions.filter(|(_, p)| p.rotation.is_some()).map(|(i, _)| i).collect();
        let mut out = Self { turning, radicals, ..Self::default() };
        for angle in platform.scheme().stations().iter().flat_map(Station::angles) {
            if let Some((name, _)) = angle.generic() {
                out.add(BaseAngle::Name(name.into()));
            }
            if !angle.turn().is_multiple_of_deg(15) {
                out.add(BaseAngle::Constant(octant(angle).0));
            } else if !angle.turn().is_multiple_of_deg(90) {
                out.radicals = true;
            }
        }
        out
    }

    fn add(&mut self, base: BaseAngle) {
        if !self.bases.contains(&base) {
            self.bases.push(base);
        }
    }

    /// Number of angles with symbols.
    pub fn angles(&self) -> usize {
        self.bases.len()
    }

    /// Independent symbols for the worker: the rates of the earth and of the platform.
    pub fn independent(&self) -> Vec<String> {
        let turning = self.turning.iter().map(|&i| Self::rate_of_turning(i));
        ["wN", "wU"].map(String::from).into_iter().chain(turning).collect()
    }

    /// Symbol of the turning rate at the position of this index, for the worker.
    pub(crate) fn rate_of_turning(position: usize) -> String {
        format!("w_{position}")
    }

    /// Square roots with their squares, for the worker.
    pub fn generators(&self) -> Vec<(String, String)> {
        let roots: &[&str] = if self.radicals { &["2", "3"] } else { &[] };
        roots.iter().map(|n| (format!("r_{n}"), n.to_string())).collect()
    }

    /// The names of the angles, for the worker.
    pub(crate) fn angle_names(&self) -> Vec<String> {
        (0..self.bases.len()).map(|i| self.suffix(i)).collect()
    }

    /// Suffix of a symbol: a name or a number, which differ, since names start with a letter.
    fn suffix(&self, i: usize) -> String {
        match &self.bases[i] {
            BaseAngle::Name(name) => name.clone(),
            BaseAngle::Constant(_) => format!("{i}"),
        }
    }

    /// The platform as text, with rates 1 (or 0): coefficients are homogeneous in the rates.
    pub fn point(&self, platform: &Platform, w_n: &str, w_u: &str) -> PlatformPoint<Text> {
        let attitudes =
            platform.scheme().stations().iter().map(|s| s.attitude(&Text, |a| self.cos_sin(a))).collect();
        PlatformPoint { ring: Text, w_n: w_n.into(), w_u: w_u.into(), attitudes, turns: Vec::new() }
    }

    /// True if the sine and cosine of an angle are among the symbols.
    pub fn has(&self, angle: &Angle) -> bool {
        let base = octant(angle).0;
        let name = angle.generic().map(|(name, _)| name);
        angle.turn().is_multiple_of_deg(15)
            && name.is_none_or(|n| self.bases.contains(&BaseAngle::Name(n.into())))
            || name.is_none() && self.bases.contains(&BaseAngle::Constant(base))
    }

    /// The cosine and sine of an angle as text.
    pub fn cos_sin(&self, angle: &Angle) -> (String, String) {
        let constant = self.constant_cos_sin(angle);
        match angle.generic() {
            None => constant,
            Some((name, minus)) => {
                let (c, mut s) = (format!("c_{name}"), format!("s_{name}"));
                if minus {
                    s = Text.neg(&s);
                }
                let (a, b) = constant;
                let cos = Text.add(&Text.mul(&c, &a), &Text.neg(&Text.mul(&s, &b)));
                let sin = Text.add(&Text.mul(&s, &a), &Text.mul(&c, &b));
                (cos, sin)
            }
        }
    }

    fn constant_cos_sin(&self, angle: &Angle) -> (String, String) {
        let (base, quadrant, mirrored) = octant(angle);
        let (c, s) = match base {
            0 => ("1".into(), "0".into()),
            15_000_000_000 => ("(r_2*r_3+r_2)/4".into(), "(r_2*r_3-r_2)/4".into()),
            30_000_000_000 => ("r_3/2".into(), "1/2".into()),
            45_000_000_000 => ("r_2/2".into(), "r_2/2".into()),
            _ => match self.bases.iter().position(|b| *b == BaseAngle::Constant(base)) {
                Some(i) => (format!("c_{}", self.suffix(i)), format!("s_{}", self.suffix(i))),
                None => ("0".into(), "0".into()),
            },
        };
        let (c, s): (String, String) = if mirrored { (s, c) } else { (c, s) };
        match quadrant {
            0 => (c, s),
            1 => (Text.neg(&s), c),
            2 => (Text.neg(&c), Text.neg(&s)),
            _ => (s, Text.neg(&c)),
        }
    }

    /// Text with the symbols replaced by their readable forms: `sin(alpha)`, `cos(25 deg)`, `sqrt(2)`.
    pub fn display(&self, text: &str) -> String {
        let mut out = String::new();
        let mut rest = text;
        while let Some(c) = rest.chars().next() {
            let word = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len());
            if word == 0 || !c.is_ascii_alphabetic() {
                let end = if word == 0 { c.len_utf8() } else { word };
                out.push_str(&rest[..end]);
                rest = &rest[end..];
                continue;
            }
            out.push_str(&self.meaning(&rest[..word]).unwrap_or_else(|| rest[..word].to_string()));
            rest = &rest[word..];
        }
        out
    }

    fn meaning(&self, word: &str) -> Option<String> {
        if let Some(n) = word.strip_prefix("r_") {
            return Some(format!("sqrt({n})"));
        }
        let (function, suffix) = match word.split_at_checked(2)? {
            ("s_", suffix) => ("sin", suffix),
            ("c_", suffix) => ("cos", suffix),
            _ => return None,
        };
        let i = (0..self.bases.len()).find(|&i| self.suffix(i) == suffix)?;
        Some(match &self.bases[i] {
            BaseAngle::Name(name) => format!("{function}({name})"),
            BaseAngle::Constant(nanodeg) => format!("{function}({} deg)", format_decimal(*nanodeg)),
        })
    }

    /// Value of a text in square roots and constant angles, correct in all digits even if terms cancel;
    /// `None` if it contains another symbol, or if 512 bits do not suffice.
    pub(crate) fn float(&self, text: &str) -> Option<f64> {
        let at = |name: &str| -> Option<Real> {
            let (kind, suffix) = name.split_at_checked(2)?;
            if kind == "r_" {
                return Real::from_i64(suffix.parse().ok()?).sqrt();
            }
            let i = (0..self.bases.len()).find(|&i| self.suffix(i) == suffix)?;
            let digits = |base: &BaseAngle| match base {
                BaseAngle::Constant(nanodeg) => ManyDigits::cos_sin(*nanodeg),
                BaseAngle::Name(_) => None,
            };
            let all = self.digits.get_or_init(|| self.bases.iter().map(digits).collect());
            let (c, s) = all[i].as_ref()?;
            Some(if kind == "c_" { *c } else { *s })
        };
        ManyDigits::to_f64(&real(&parse(text).ok()?, &at)?)
    }

    /// Value of a text in the symbols at a sample; `None` if it has none.
    pub fn value(&self, text: &str, values: &RandomValues, sample: &FieldSample) -> Option<u64> {
        let env = SymbolValues { symbols: self, values, sample };
        evaluate(&parse(text).ok()?, &sample.roots.field, &env).ok()
    }
}

/// Value of a rational expression; `None` for a name that `at` does not know, for a function, and for a
/// division by zero.
fn real(e: &Expression, at: &dyn Fn(&str) -> Option<Real>) -> Option<Real> {
    let power = |x: &Real, k: i32| {
        let product = (0..k.unsigned_abs()).fold(Real::from_i64(1), |product, _| product.mul(x));
        if k < 0 { product.inverse() } else { Some(product) }
    };
    let mut values: Vec<Real> = Vec::with_capacity(e.nodes.len());
    for node in &e.nodes {
        values.push(match node {
            Node::Number { mantissa, decimals } => {
                Real::from_i128(*mantissa).mul(&power(&Real::from_i64(10), -*decimals)?)
            }
            Node::Name(name) => at(name)?,
            Node::Call { .. } => return None,
            Node::Negate(a) => values[*a].neg(),
            Node::Add(a, b) => values[*a].add(&values[*b]),
            Node::Subtract(a, b) => values[*a].sub(&values[*b]),
            Node::Multiply(a, b) => values[*a].mul(&values[*b]),
            Node::Divide(a, b) => values[*a].div(&values[*b])?,
            Node::Power(a, b) => power(&values[*a], e.integer_at(*b)?)?,
        });
    }
    values.pop()
}

/// `(base, quadrant, mirrored)`: the constant part of an angle is quadrant * 90 + base, or
/// quadrant * 90 + (90 - base) when mirrored, with a base of 0 to 45 degrees in 1e-9 degrees.
fn octant(angle: &Angle) -> (i64, i64, bool) {
    const RIGHT: i64 = 90_000_000_000;
    let nanodeg = angle.turn().nanodeg();
    let (quadrant, rest) = (nanodeg / RIGHT, nanodeg % RIGHT);
    if 2 * rest > RIGHT { (RIGHT - rest, quadrant, true) } else { (rest, quadrant, false) }
}

struct SymbolValues<'a> {
    symbols: &'a Symbols,
    values: &'a RandomValues,
    sample: &'a FieldSample,
}

impl Environment for SymbolValues<'_> {
    fn name(&self, name: &str) -> Option<u64> {
        let (k, f) = (&self.sample.roots, self.sample.roots.field);
        let angle =
            |nanodeg: i64| k.cos_sin(k.unit_circle(Angle::from_nanodeg(nanodeg).turn()).unwrap_or(f.one()));
        match name {
            "wN" => return Some(self.sample.point.w_n),
            "wU" => return Some(self.sample.point.w_u),
            "r_2" => return Some(f.mul(f.from_i64(2), angle(45_000_000_000).0)),
            "r_3" => return Some(f.mul(f.from_i64(2), angle(30_000_000_000).0)),
            _ => {}
        }
        let (kind, suffix) = name.split_at_checked(2)?;
        let i = (0..self.symbols.bases.len()).find(|&i| self.symbols.suffix(i) == suffix)?;
        let (c, s) = match &self.symbols.bases[i] {
            BaseAngle::Constant(nanodeg) => angle(*nanodeg),
            BaseAngle::Name(name) => self.values.generic_cos_sin(name, self.sample)?,
        };
        match kind {
            "c_" => Some(c),
            "s_" => Some(s),
            _ => None,
        }
    }

    fn cos_sin(&self, _: &str) -> Option<(u64, u64)> {
        None
    }

    fn known(&self) -> Vec<String> {
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::scheme::{Scheme, parse_attitude};
    use obsdeg_exact::SplitMix64;

    /// Cancellation costs no digits: `(1 - cos x) / sin x = tan(x / 2)`, whose series is summed here.
    #[test]
    fn texts_have_all_their_digits() {
        for nanodeg in [1, 1000, 1_000_000, 100_000_000] {
            let angle = format!("{},0,0", format_decimal(nanodeg));
            let attitudes = ["0,0,0", &angle].map(|a| parse_attitude(a).expect("an attitude"));
            let symbols = Symbols::of(&Platform::new(Scheme::of_angles(attitudes)).expect("valid"));
            let h = (nanodeg as f64 * 1e-9).to_radians() / 2.0;
            let tangent = h + h.powi(3) / 3.0 + 2.0 * h.powi(5) / 15.0;
            for text in ["(1-c_0)/s_0", "-(c_0-1)*s_0^-1", "s_0/(1+c_0)"] {
                let value = symbols.float(text).expect("a number");
                assert!((value / tangent - 1.0).abs() < 1e-14, "{nanodeg} {text}: {value} {tangent}");
            }
        }
        let none = parse_attitude("0,0,0").expect("an attitude");
        let symbols = Symbols::of(&Platform::new(Scheme::of_angles([none])).expect("valid"));
        assert_eq!(symbols.float("r_2*r_2-2"), Some(0.0));
        assert_eq!(symbols.float("1/(2-2)"), None);
        assert_eq!(symbols.float("wN"), None);
    }

    /// The text of every cosine and sine has the value of the sample.
    #[test]
    fn texts_have_the_values_of_the_sample() {
        let attitudes = [
            "0,15,30",
            "45,60,75",
            "90,105,120",
            "-135,150,-165",
            "25,65,-115",
            "12.5,102.5,347.5",
            "alpha,-alpha,beta+15",
            "180-beta,alpha+25,270",
        ];
        let scheme = Scheme::of_angles(attitudes.map(|a| parse_attitude(a).expect("an attitude")));
        let platform = Platform::new(scheme).expect("valid");
        let symbols = Symbols::of(&platform);
        assert_eq!(symbols.angles(), 4);
        let values = RandomValues::draw(platform.scheme(), &mut SplitMix64::new(2)).expect("fits");
        for a in obsdeg_exact::radical::embeddings(values.roots().order) {
            let sample = values.sample(platform.scheme(), a);
            for angle in platform.scheme().positions.iter().flat_map(|p| &p.angles) {
                let (t, v) = (symbols.cos_sin(angle), values.angle_cos_sin(&sample.roots, angle));
                assert_eq!(symbols.value(&t.0, &values, &sample), Some(v.0), "{}", t.0);
                assert_eq!(symbols.value(&t.1, &values, &sample), Some(v.1), "{}", t.1);
            }
        }
        let tangent = symbols.float("s_0/c_0*r_3^2").expect("constants only");
        assert!((tangent - 3.0 * 25f64.to_radians().tan()).abs() < 1e-14);
        assert_eq!(symbols.float("s_alpha"), None);
        assert_eq!(symbols.display("-s_alpha*c_0^2/r_3"), "-sin(alpha)*cos(25 deg)^2/sqrt(3)");
    }
}

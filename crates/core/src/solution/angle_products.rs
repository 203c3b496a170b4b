//! Short products of powers of sines and cosines, as texts.

/// Largest complexity of a product: the sum of the exponents, those of a sum counted twice.
const COMPLEXITY: usize = 4;
/// Largest number of products that are compared with a number.
const MOST: usize = 2000;

/// Product of powers of sines and cosines, with its images in the order of the tables at the rates.
#[derive(Debug, Clone)]
pub(super) struct AngleProduct {
    pub(super) above: Vec<String>,
    pub(super) below: Vec<String>,
    pub(super) images: Vec<u64>,
}

/// Factor of a product: a text with the sign of its exponents.
pub(super) type AngleFactors = Vec<(String, i32)>;

/// Products of powers of `c`, `s`, `1 - c`, `1 + c` and `c^2 - s^2` of each angle, simplest first.
pub(super) fn products(angles: &[String]) -> Vec<AngleFactors> {
    let mut out: Vec<(usize, AngleFactors)> = vec![(0, Vec::new())];
    for angle in angles {
        let atoms = [
            (format!("c_{angle}"), 1),
            (format!("s_{angle}"), 1),
            (format!("(1-c_{angle})"), 2),
            (format!("(1+c_{angle})"), 2),
            (format!("(c_{angle}^2-s_{angle}^2)"), 2),
        ];
        for (atom, weight) in atoms {
            let powers = |(complexity, product): &(usize, AngleFactors)| -> Vec<(usize, AngleFactors)> {
                let most = ((COMPLEXITY - complexity) / weight) as i32;
                (-most..=most)
                    .map(|e| {
                        let mut product = product.clone();
                        if e != 0 {
                            product.push((atom.clone(), e));
                        }
                        (complexity + weight * e.unsigned_abs() as usize, product)
                    })
                    .collect()
            };
            out = out.iter().flat_map(powers).collect();
        }
    }
    // of (1-c)/s and s/(1+c), which are equal, the second, as the symbolic engine prints it
    let differences = |product: &AngleFactors| product.iter().filter(|f| f.0.starts_with("(1-")).count();
    out.sort_by_key(|(complexity, product)| {
        (*complexity, product.iter().filter(|f| f.1 < 0).count(), product.len(), differences(product))
    });
    out.into_iter().map(|(_, product)| product).take(MOST).collect()
}

/// Factor with its exponent, whatever its sign.
pub(super) fn power(base: &str, exponent: i32) -> String {
    match exponent.abs() {
        1 => base.into(),
        e => format!("{base}^{e}"),
    }
}

/// A product as one text, factors that are sums last: `-2*c_0*(1+c_1)/(s_0*c_1)`; `root` is positive.
pub(super) fn text(negative: bool, root: &str, above: &[String], below: &[String]) -> String {
    let sum = root.contains(['+', '-']);
    let root = match (root, above.is_empty()) {
        ("1", false) => None,
        _ if sum => Some(format!("({root})")),
        _ => Some(root.to_string()),
    };
    let factors = |all: &mut dyn Iterator<Item = &String>| {
        let mut all: Vec<&str> = all.map(String::as_str).collect();
        all.sort_by_key(|factor| factor.starts_with('('));
        all.join("*")
    };
    let sign = if negative { "-" } else { "" };
    let above = factors(&mut root.iter().chain(above));
    match below {
        [] => format!("{sign}{above}"),
        [one] => format!("{sign}{above}/{one}"),
        all => format!("{sign}{above}/({})", factors(&mut all.iter())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_products() {
        let names = |list: &[&str]| list.iter().map(ToString::to_string).collect::<Vec<_>>();
        for (negative, root, above, below, expected) in [
            (true, "1", &["c_0"][..], &["s_0"][..], "-c_0/s_0"),
            (false, "1", &[], &["s_0"], "1/s_0"),
            (false, "1/2", &["c_0^2"], &["s_0", "c_1"], "1/2*c_0^2/(s_0*c_1)"),
            (true, "r_2/2+1", &["c_0"], &[], "-c_0*(r_2/2+1)"),
            (false, "2", &["(1+c_0)^2", "s_1"], &["(1-c_1)", "c_0"], "2*s_1*(1+c_0)^2/(c_0*(1-c_1))"),
            (false, "1", &[], &[], "1"),
        ] {
            assert_eq!(text(negative, root, &names(above), &names(below)), expected);
        }
    }

    /// Every product once, the simple ones first.
    #[test]
    fn products_by_complexity() {
        let one = products(&["0".into()]);
        assert!(one[0].is_empty() && one[1].len() == 1);
        let mut all: Vec<String> = one.iter().map(|p| format!("{p:?}")).collect();
        all.sort();
        all.dedup();
        assert_eq!(all.len(), one.len());
        assert!(one.contains(&vec![("c_0".into(), 1), ("s_0".into(), -1)]));
        let place = |factors: &[(&str, i32)]| {
            let product: AngleFactors = factors.iter().map(|(base, e)| (base.to_string(), *e)).collect();
            one.iter().position(|p| *p == product).expect("a product")
        };
        assert!(place(&[("s_0", 1), ("(1+c_0)", -1)]) < place(&[("s_0", -1), ("(1-c_0)", 1)]));
        assert!(products(&["0".into(), "1".into(), "a".into(), "b".into()]).len() <= MOST);
    }
}

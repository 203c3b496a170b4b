//! Laws that hold for every scheme, on random schemes.

use obsdeg_core::analysis::{AnalysisError, AnalysisOptions, analyze};
use obsdeg_core::degree::{Degrees, DerivativeRows, Status, climb, filtration, judge};
use obsdeg_core::model::{Angle, Carry, Platform, RandomValues, Scheme};
use obsdeg_exact::{Echelon, Field, SplitMix64};
use proptest::prelude::*;

type Attitude = (i32, i32, i32);

fn scheme(attitudes: &[Attitude], carry: Carry) -> Scheme {
    let angles = attitudes.iter().map(|&(a, b, c)| [a, b, c].map(Angle::from_degrees));
    Scheme { carry, ..Scheme::of_angles(angles) }
}

fn judged(s: Scheme) -> (Vec<String>, Degrees) {
    let platform = Platform::new(s).expect("valid");
    let degrees = judge(&platform, 3).expect("judged").degrees;
    (platform.names().to_vec(), degrees)
}

/// Degrees of the coefficients, in the order of the model.
fn coefficients(s: Scheme) -> Vec<Option<usize>> {
    let (names, d) = judged(s);
    names.iter().zip(d.degree).filter(|(n, _)| n.starts_with("D_")).map(|(_, d)| d).collect()
}

/// Random attitudes; half of them have special angles (multiples of 90 and 30).
fn attitudes(most: usize) -> impl Strategy<Value = Vec<Attitude>> {
    let angle =
        || prop_oneof![(-2i32..3).prop_map(|k| 90 * k), (-6i32..7).prop_map(|k| 30 * k), -180i32..180];
    prop::collection::vec((angle(), angle(), angle()), 1..most)
}

fn carry() -> impl Strategy<Value = Carry> {
    prop::sample::select(Carry::ALL.to_vec())
}

fn worse(a: Option<usize>) -> usize {
    a.unwrap_or(usize::MAX)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn the_order_of_the_positions_does_not_matter_to_the_coefficients(
        list in attitudes(7), carry in carry(), seed in any::<u64>()
    ) {
        let mut shuffled = list.clone();
        let mut rng = SplitMix64::new(seed);
        for i in (1..shuffled.len()).rev() {
            shuffled.swap(i, rng.below(i as u64 + 1) as usize);
        }
        prop_assert_eq!(coefficients(scheme(&list, carry)), coefficients(scheme(&shuffled, carry)));
    }

    #[test]
    fn a_repeated_position_adds_nothing(list in attitudes(6), which in any::<prop::sample::Index>()) {
        let mut repeated = list.clone();
        repeated.push(list[which.index(list.len())]);
        for carry in [Carry::Platform, Carry::Inertial] {
            prop_assert_eq!(judged(scheme(&list, carry)), judged(scheme(&repeated, carry)));
        }
        // under reset carry it adds its own psi, and the coefficients do not change
        prop_assert_eq!(coefficients(scheme(&list, Carry::Reset)), coefficients(scheme(&repeated, Carry::Reset)));
    }

    #[test]
    fn an_added_position_never_raises_a_degree(list in attitudes(6), more in attitudes(2), carry in carry()) {
        let before = coefficients(scheme(&list, carry));
        let after = coefficients(scheme(&[list, more].concat(), carry));
        for (b, a) in before.into_iter().zip(after) {
            prop_assert!(worse(a) <= worse(b));
        }
    }

    #[test]
    fn no_input_axis_coefficient_below_two(list in attitudes(8), carry in carry()) {
        let (names, d) = judged(scheme(&list, carry));
        for (name, degree) in names.iter().zip(d.degree).filter(|(n, _)| n.starts_with("D_I")) {
            prop_assert!(worse(degree) >= 2, "{name} {degree:?}");
        }
    }

    #[test]
    fn the_latitude_does_not_matter_away_from_the_poles(list in attitudes(6), carry in carry(), degrees in -89i32..90) {
        let generic = scheme(&list, carry);
        let latitude = degrees.to_string().parse().ok();
        prop_assert_eq!(judged(Scheme { latitude, ..generic.clone() }), judged(generic));
    }

    #[test]
    fn the_azimuth_origin_does_not_matter_at_a_pole(
        tilts in prop::collection::vec((-180i32..180, -180i32..180), 1..6), carry in carry(), turn in 1i32..360
    ) {
        // a pole has no North; with alpha = 0, C_c^n = My(beta) Mz(gamma), and beta -> beta + turn turns the
        // whole scheme about Up
        let pole = |s: Scheme| Scheme { latitude: "90".parse().ok(), ..s };
        let at = |shift: i32| -> Vec<Attitude> { tilts.iter().map(|&(b, c)| (0, b + shift, c)).collect() };
        prop_assert_eq!(judged(pole(scheme(&at(0), carry))), judged(pole(scheme(&at(turn), carry))));
    }

    #[test]
    fn scaling_the_unknowns_changes_nothing(list in attitudes(6), carry in carry(), seed in any::<u64>()) {
        let platform = Platform::new(scheme(&list, carry)).expect("valid");
        let mut rng = SplitMix64::new(seed);
        let values = RandomValues::draw(platform.scheme(), &mut rng).expect("fits");
        let sample = values.sample(platform.scheme(), 1);
        let plain = filtration(&platform, &sample).0;
        let f = sample.roots.field;
        let scale = (0..platform.names().len()).map(|_| 1 + rng.below(f.modulus() - 1)).collect();
        let inner = obsdeg_core::degree::PlatformRows::new(&platform, &sample);
        let mut scaled = Scaled { inner, scale };
        let again = climb(&mut scaled, &mut Echelon::new(f, platform.names().len()), |_, _| {});
        prop_assert_eq!(plain, again);
    }

    #[test]
    fn the_seed_does_not_matter(list in attitudes(6), carry in carry(), seed in any::<u64>()) {
        let platform = Platform::new(scheme(&list, carry)).expect("valid");
        let (a, b) = (judge(&platform, seed).expect("judged"), judge(&platform, 1).expect("judged"));
        prop_assert_eq!(a.degrees, b.degrees);
    }
}

/// Derivative rows with scaled columns, as in other units.
struct Scaled<R> {
    inner: R,
    scale: Vec<u64>,
}

impl<R: DerivativeRows<Field = Field>> DerivativeRows for Scaled<R> {
    type Field = Field;

    fn field(&self) -> Field {
        self.inner.field()
    }
    fn columns(&self) -> usize {
        self.inner.columns()
    }
    fn emit(&mut self, order: usize, sink: &mut dyn FnMut(&[u64]) -> bool) -> bool {
        let (f, scale) = (self.inner.field(), &self.scale);
        self.inner.emit(order, &mut |row| {
            let scaled: Vec<u64> = row.iter().zip(scale).map(|(&x, &s)| f.mul(x, s)).collect();
            sink(&scaled)
        })
    }
}

#[test]
fn four_hundred_positions_and_duplicates_are_fine() {
    let list: Vec<Attitude> = (0..400).map(|i| (i * 7 % 360, i * 13 % 360, i / 2 * 31 % 360)).collect();
    let (_, d) = judged(scheme(&list, Carry::Platform));
    assert_eq!(d.rank(), 15);
}

/// Printed primes allow a combination with coefficients that they divide: such a combination gets other
/// primes and is not taken for zero. D_FZ is indistinguishable from psi_y.
#[test]
fn nobody_aims_at_the_primes_of_a_scheme() {
    let with = |combination: &str| {
        let mut scheme = scheme(&[(0, 0, 0), (180, 0, 0)], Carry::Platform);
        scheme.combinations.push(combination.into());
        scheme
    };
    let asked = |text: &str| {
        let answer =
            analyze(&with(text), AnalysisOptions { solutions: false, ..AnalysisOptions::default() }, None)?;
        let requested = answer.combinations.into_iter().find(|c| c.requested);
        Ok::<_, AnalysisError>(requested.map(|c| (c.status, c.degree)))
    };
    assert_eq!(asked("D_FZ").expect("analysed"), Some((Status::Inseparable, None)));
    let (mut factors, mut seen) = (String::new(), Vec::new());
    for _ in 0..3 {
        let text = format!("{factors}D_FZ");
        if let Ok(judged) = asked(&text) {
            assert_eq!(judged, Some((Status::Inseparable, None)), "{text}");
        }
        let judged = judge(&Platform::new(with(&text)).expect("valid"), 1).expect("judged");
        for p in judged.values.map(|v| v.roots().field.modulus()) {
            factors = format!("{factors}{p}*");
            seen.push(p);
        }
    }
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), 6);
    // linear at one fixed point only
    assert!(asked("D_FX + D_FX*(D_FX - 1)*(D_FX - 1071274)").is_err());
}

//! Values that are lists in JSON and have names in the code.

/// Implements the JSON of a struct as the list of its fields, in their order.
#[macro_export]
macro_rules! json_list {
    ($name:ident $(<$kind:ident>)? { $($field:ident: $of:ty),+ }) => {
        impl $(<$kind: serde::Serialize>)? serde::Serialize for $name $(<$kind>)? {
            fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                ($(&self.$field,)+).serialize(to)
            }
        }

        impl<'de $(, $kind: serde::Deserialize<'de>)?> serde::Deserialize<'de> for $name $(<$kind>)? {
            fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                let ($($field,)+): ($($of,)+) = serde::Deserialize::deserialize(from)?;
                Ok(Self { $($field),+ })
            }
        }

        impl $(<$kind: schemars::JsonSchema>)? schemars::JsonSchema for $name $(<$kind>)? {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                <($($of,)+)>::json_schema(generator)
            }
        }
    };
}

/// Interval with both ends: times, lines of a file, or the acceptance band of a statistic.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Span<T> {
    /// First number of the interval, in the unit of the field that holds it.
    pub from: T,
    /// Last number of the interval, in the same unit.
    pub to: T,
}

json_list!(Span<T> { from: T, to: T });

impl<T> From<(T, T)> for Span<T> {
    fn from((from, to): (T, T)) -> Self {
        Self { from, to }
    }
}

impl<T: PartialOrd> Span<T> {
    /// True if the number is in the interval, the ends included.
    pub fn contains(&self, x: &T) -> bool {
        (&self.from..=&self.to).contains(&x)
    }
}

impl Span<f64> {
    /// Length of the interval, in the unit of its ends.
    pub fn length(&self) -> f64 {
        self.to - self.from
    }

    /// Middle of the interval, in the unit of its ends.
    pub fn middle(&self) -> f64 {
        (self.from + self.to) / 2.0
    }

    /// Interval with both ends divided by `x`.
    pub fn over(&self, x: f64) -> Self {
        Self { from: self.from / x, to: self.to / x }
    }

    /// Interval moved by `by`, in the unit of its ends.
    pub fn later(&self, by: f64) -> Self {
        Self { from: self.from + by, to: self.to + by }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_is_the_list_of_the_ends() {
        let span = Span { from: 0.5, to: 2.0 };
        assert_eq!(serde_json::to_string(&span).expect("JSON"), "[0.5,2.0]");
        assert_eq!(serde_json::from_str::<Span<f64>>("[0.5, 2]").expect("a span"), span);
        for wrong in ["[0.5]", "[0.5, 2, 3]", r#"{"from": 0.5, "to": 2}"#, "[0.5, null]"] {
            assert!(serde_json::from_str::<Span<f64>>(wrong).is_err(), "{wrong}");
        }
        let mut generator = schemars::SchemaGenerator::default();
        let pair = generator.subschema_for::<Option<(u64, u64)>>();
        assert_eq!(generator.subschema_for::<Option<Span<u64>>>(), pair);
    }

    #[test]
    fn ends_are_inside() {
        let span = Span::from((1.0, 3.0));
        assert!(
            span.contains(&1.0) && span.contains(&3.0) && !span.contains(&0.999) && !span.contains(&3.001)
        );
        assert!(!span.contains(&f64::NAN));
        assert_eq!(
            (span.length(), span.middle(), span.later(-1.0).from, span.over(2.0).to),
            (2.0, 2.0, 0.0, 1.5)
        );
    }
}

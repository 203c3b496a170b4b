//! Exact linear algebra over a random prime field.
//!
//! Observability is a question of rank over `Q(wN, wU)` extended by the sines and cosines of the
//! angles of a scheme. All of these have images in a prime field `F_p` with `p = 1 mod n`, where `n`
//! is the common denominator of a full turn: the field then holds the n-th roots of unity. Ranks are
//! computed there in microseconds; [`certainty`] bounds the probability that a rank differs.
//!
//! One algorithm per module:
//! - [`field`]: arithmetic modulo a prime of 61 bits (Montgomery form, lazily reduced dot products);
//! - [`prime`]: random primes `p = 1 mod n` and their roots of unity;
//! - [`turn`]: cosines and sines of decimal degrees in such a field;
//! - [`echelon`]: the incremental reduced row-echelon basis;
//! - [`series`]: truncated power series, and echelon form over them;
//! - [`transform`]: products of long polynomials;
//! - [`radical`]: numbers of `Q(sqrt 2, sqrt 3)` recovered from their images;
//! - [`polynomial`]: roots of small polynomials in the field;
//! - [`multivariate`], [`groebner`]: polynomials in several variables, and bases of their ideals;
//! - [`divisor`], [`fraction`]: common divisors of these, and rational functions;
//! - [`dense`]: dependencies among the columns of a dense matrix;
//! - [`reconstruct`]: rational functions of one variable through points;
//! - [`certainty`]: the bound on the error probability;
//! - [`interrupt`]: interruption of long computations.
//!
//! Transcendental functions have no image in a prime field. Where they take part, the same algorithms run
//! over real numbers of many digits with error bounds:
//! - [`scalars`]: the interface of fields and row spaces for these algorithms;
//! - [`ball`]: the numbers; `elementary`: their functions;
//! - [`reals`]: row spaces over them, in which a gap separates zeros from other numbers.

pub mod ball;
pub mod certainty;
pub mod dense;
pub mod divisor;
pub mod echelon;
mod elementary;
pub mod field;
pub mod fraction;
mod gap;
mod gcd;
pub mod groebner;
pub mod interrupt;
pub mod multivariate;
pub mod parallel;
pub mod polynomial;
pub mod prime;
pub mod radical;
pub mod reals;
pub mod reconstruct;
pub mod rng;
pub mod scalars;
pub mod series;
pub mod transform;
pub mod turn;

pub use ball::{Ball, BallSum};
pub use echelon::Echelon;
pub use field::Field;
pub use gap::RankMargin;
pub use gcd::gcd;
pub use prime::{PrimeError, RootField};
pub use radical::{Radical, Ratio};
pub use reals::{RealSpace, Reals};
pub use rng::SplitMix64;
pub use scalars::{RowSpace, Scalars};
pub use transform::Transform;
pub use turn::TurnFraction;

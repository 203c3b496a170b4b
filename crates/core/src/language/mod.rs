//! The expression language: expressions, their parser, vectors, and errors of files in words.

pub(crate) mod expression;
pub(crate) mod file_error;
pub(crate) mod parser;
pub(crate) mod vectors;

pub use expression::{
    Environment, Expression, ExpressionError, Function, MAX_DEPTH, Names, Node, constant, evaluate,
    evaluate_f64, from_i128,
};
pub(crate) use expression::{MAX_NAME, among, nearest};
pub use file_error::explain_message;
pub(crate) use parser::parse_equation;
pub use parser::{Components, Shapes, parse, parse_components, parse_with};
pub use vectors::Shape;
pub(crate) use vectors::{MAX_ENTRIES, component};

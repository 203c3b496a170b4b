//! The expression language: expressions, their parser, vectors, and errors of files in words.

pub(crate) mod expression;
pub(crate) mod file_error;
pub(crate) mod parser;
pub(crate) mod vectors;

pub use expression::{
    Environment, Expression, ExpressionError, Function, MAX_DEPTH, MAX_NAME, Names, Node, constant, evaluate,
    evaluate_f64, from_i128,
};
pub(crate) use expression::{among, nearest};
pub use file_error::explain_message;
pub use parser::{Components, Shapes, parse, parse_components, parse_equation, parse_with};
pub(crate) use vectors::component;
pub use vectors::{MAX_ENTRIES, Shape};

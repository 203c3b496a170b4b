//! Vectors, matrices and quaternions in expressions: every operation on them becomes operations on their
//! components when it is read. The result consists of scalar expressions.
//!
//! A vector is a column. Quaternions are vectors of four, (w, x, y, z) with Hamilton's product. `R(q)` turns
//! as `v -> q v q*` where `|q| = 1`; elsewhere it is `|q|^2` times a rotation, a polynomial in q.

use std::fmt;
use std::ops::Range;

use super::expression::{Expression, Function, Node};

/// Largest number of entries of a vector or matrix.
pub(crate) const MAX_ENTRIES: usize = 10_000;
/// Largest number of operations of an expression with vectors.
const MAX_OPERATIONS: usize = 200_000;

/// Numbers of rows and columns; a scalar has one of each, a vector has one column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
}

impl Shape {
    /// Shape of one number.
    pub(crate) const SCALAR: Self = Self { rows: 1, columns: 1 };

    /// Shape of a column of `n` entries.
    pub const fn vector(n: usize) -> Self {
        Self { rows: n, columns: 1 }
    }

    /// Number of entries.
    pub const fn entries(self) -> usize {
        self.rows * self.columns
    }

    /// Names of the entries of `base`, row by row: `v[1]`, `C[1,2]`; for a scalar its own name.
    pub fn names(self, base: &str) -> Vec<String> {
        let entry = |k: usize| match self {
            Self::SCALAR => base.to_string(),
            Self { columns: 1, .. } => format!("{base}[{}]", k + 1),
            Self { columns, .. } => format!("{base}[{},{}]", k / columns + 1, k % columns + 1),
        };
        (0..self.entries()).map(entry).collect()
    }
}

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            &Self::SCALAR => f.write_str("a scalar"),
            Self { rows, columns: 1 } => write!(f, "a vector of {rows}"),
            Self { rows, columns } => write!(f, "a {rows}x{columns} matrix"),
        }
    }
}

/// Value of an expression: the nodes of its entries, row by row.
#[derive(Debug, Clone)]
pub(super) struct Value {
    pub(super) shape: Shape,
    pub(super) entries: Vec<usize>,
    /// Byte index at which its text begins.
    pub(super) start: usize,
}

/// Shapes that an operation needs, and the shapes that it was given.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Mismatch {
    pub(crate) expected: String,
    pub(crate) found: String,
}

impl Mismatch {
    pub(super) fn new(expected: impl Into<String>, found: impl fmt::Display) -> Self {
        Self { expected: expected.into(), found: found.to_string() }
    }
}

pub(super) type Made = Result<(Shape, Vec<usize>), Mismatch>;

/// Functions of vectors; their names are taken only before a bracket.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum VectorOperation {
    Cross,
    Dot,
    Norm,
    Transpose,
    Skew,
    Rotation,
    Product,
    Conjugate,
    Rate,
    AboutX,
    AboutY,
    AboutZ,
}

impl VectorOperation {
    pub(super) const ALL: [(&'static str, Self); 12] = [
        ("cross", Self::Cross),
        ("dot", Self::Dot),
        ("norm", Self::Norm),
        ("transpose", Self::Transpose),
        ("skew", Self::Skew),
        ("R", Self::Rotation),
        ("qmul", Self::Product),
        ("conj", Self::Conjugate),
        ("qdot", Self::Rate),
        ("Rx", Self::AboutX),
        ("Ry", Self::AboutY),
        ("Rz", Self::AboutZ),
    ];

    pub(super) fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(n, _)| *n == name).map(|(_, o)| *o)
    }

    /// Arguments of the operation, in words and as shapes; `None` is any shape.
    fn takes(self) -> (&'static str, &'static [Option<Shape>]) {
        const V: Option<Shape> = Some(Shape::vector(3));
        const Q: Option<Shape> = Some(Shape::vector(4));
        match self {
            Self::Cross => ("two vectors of 3", &[V, V]),
            Self::Dot => ("two vectors of one length", &[None, None]),
            Self::Norm => ("a vector", &[None]),
            Self::Transpose => ("a vector or matrix", &[None]),
            Self::Skew => ("a vector of 3", &[V]),
            Self::Rotation | Self::Conjugate => ("a vector of 4 (a quaternion w, x, y, z)", &[Q]),
            Self::Product => ("two vectors of 4 (quaternions w, x, y, z)", &[Q, Q]),
            Self::Rate => ("a vector of 4 (a quaternion w, x, y, z) and one of 3 (the turn rate)", &[Q, V]),
            Self::AboutX | Self::AboutY | Self::AboutZ => ("an angle", &[Some(Shape::SCALAR)]),
        }
    }

    /// Result of the operation on `arguments`; adds its nodes to the expression.
    pub(super) fn apply(self, arguments: &[Value], builder: &mut NodeBuilder<'_>) -> Made {
        let (words, shapes) = self.takes();
        let fits = arguments.len() == shapes.len()
            && arguments.iter().zip(shapes).all(|(a, s)| s.is_none_or(|s| s == a.shape));
        let column = |a: &Value| a.shape.columns == 1;
        let same = match self {
            Self::Dot => fits && arguments.iter().all(column) && arguments[0].shape == arguments[1].shape,
            Self::Norm => fits && column(&arguments[0]),
            _ => fits,
        };
        if !same {
            let found: Vec<String> = arguments.iter().map(|a| a.shape.to_string()).collect();
            return Err(Mismatch::new(
                words,
                if found.is_empty() { "nothing".into() } else { found.join(" and ") },
            ));
        }
        let a = &arguments[0].entries;
        let b = arguments.get(1).map_or(&[][..], |b| &b.entries);
        let shape = arguments[0].shape;
        Ok(match self {
            Self::Cross => (shape, builder.cross(a, b)),
            Self::Dot => (Shape::SCALAR, vec![builder.dot(a, b)]),
            Self::Norm => {
                let square = builder.dot(a, a);
                (Shape::SCALAR, vec![builder.node(Node::Call { function: Function::Sqrt, argument: square })])
            }
            Self::Transpose => {
                let Shape { rows, columns } = shape;
                let turned = (0..columns).flat_map(|j| (0..rows).map(move |i| a[i * columns + j]));
                (Shape { rows: columns, columns: rows }, turned.collect())
            }
            Self::Skew => {
                let zero = builder.integer(0);
                let [x, y, z] = [a[0], a[1], a[2]];
                let [mx, my, mz] = [x, y, z].map(|k| builder.node(Node::Negate(k)));
                (Shape { rows: 3, columns: 3 }, vec![zero, mz, y, z, zero, mx, my, x, zero])
            }
            Self::Rotation => (Shape { rows: 3, columns: 3 }, builder.rotation(a)),
            Self::Product => (shape, builder.quaternion_product(a, b)),
            Self::Conjugate => {
                let minus = a[1..].iter().map(|&k| builder.node(Node::Negate(k))).collect::<Vec<_>>();
                (shape, [&a[..1], &minus].concat())
            }
            Self::Rate => {
                let zero = builder.integer(0);
                let product = builder.quaternion_product(a, &[&[zero], b].concat());
                let two = builder.integer(2);
                (shape, product.into_iter().map(|k| builder.node(Node::Divide(k, two))).collect())
            }
            Self::AboutX | Self::AboutY | Self::AboutZ => {
                let axis = self as usize - Self::AboutX as usize;
                (Shape { rows: 3, columns: 3 }, builder.turn(axis, a[0]))
            }
        })
    }
}

/// Builder of the nodes of one operation, all with the byte range of the operation.
pub(super) struct NodeBuilder<'a> {
    pub(super) expression: &'a mut Expression,
    pub(super) span: Range<usize>,
}

impl NodeBuilder<'_> {
    fn node(&mut self, node: Node) -> usize {
        self.expression.nodes.push(node);
        self.expression.spans.push(self.span.clone());
        self.expression.nodes.len() - 1
    }

    fn integer(&mut self, x: i128) -> usize {
        self.node(Node::Number { mantissa: x, decimals: 0 })
    }

    /// Node of `a b +- c d`.
    fn two(&mut self, (a, b): (usize, usize), (c, d): (usize, usize), minus: bool) -> usize {
        let (ab, cd) = (self.node(Node::Multiply(a, b)), self.node(Node::Multiply(c, d)));
        self.node(if minus { Node::Subtract(ab, cd) } else { Node::Add(ab, cd) })
    }

    fn dot(&mut self, a: &[usize], b: &[usize]) -> usize {
        let mut sum = None;
        for (&x, &y) in a.iter().zip(b) {
            let product = self.node(Node::Multiply(x, y));
            sum = Some(sum.map_or(product, |s| self.node(Node::Add(s, product))));
        }
        sum.unwrap_or_else(|| self.integer(0))
    }

    fn cross(&mut self, a: &[usize], b: &[usize]) -> Vec<usize> {
        [(1, 2), (2, 0), (0, 1)].map(|(i, j)| self.two((a[i], b[j]), (a[j], b[i]), true)).to_vec()
    }

    /// Nodes of the quaternion product `(a0 b0 - a.b, a0 b + b0 a + a x b)`.
    fn quaternion_product(&mut self, a: &[usize], b: &[usize]) -> Vec<usize> {
        let w = self.node(Node::Multiply(a[0], b[0]));
        let dot = self.dot(&a[1..], &b[1..]);
        let mut out = vec![self.node(Node::Subtract(w, dot))];
        for (k, cross) in self.cross(&a[1..], &b[1..]).into_iter().enumerate() {
            let linear = self.two((a[0], b[k + 1]), (b[0], a[k + 1]), false);
            out.push(self.node(Node::Add(linear, cross)));
        }
        out
    }

    /// Nodes of the matrix `(w^2 - r.r) I + 2 r r^T + 2 w [r x]` of a quaternion.
    fn rotation(&mut self, q: &[usize]) -> Vec<usize> {
        let (w, r) = (q[0], &q[1..]);
        let two = self.integer(2);
        let square = self.dot(r, r);
        let ww = self.node(Node::Multiply(w, w));
        let diagonal = self.node(Node::Subtract(ww, square));
        let mut out = Vec::new();
        for i in 0..3 {
            for j in 0..3 {
                let rr = self.node(Node::Multiply(r[i], r[j]));
                let inner = if i == j {
                    rr
                } else {
                    let turn = self.node(Node::Multiply(w, r[3 - i - j]));
                    let forward = (j + 1) % 3 == i;
                    self.node(if forward { Node::Add(rr, turn) } else { Node::Subtract(rr, turn) })
                };
                let twice = self.node(Node::Multiply(two, inner));
                out.push(if i == j { self.node(Node::Add(diagonal, twice)) } else { twice });
            }
        }
        out
    }

    /// Nodes of the matrix that turns vectors by an angle about axis 0, 1 or 2, right-handed.
    fn turn(&mut self, axis: usize, angle: usize) -> Vec<usize> {
        let [c, s] = [Function::Cos, Function::Sin]
            .map(|function| self.node(Node::Call { function, argument: angle }));
        let (zero, one, minus) = (self.integer(0), self.integer(1), self.node(Node::Negate(s)));
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut out = vec![zero; 9];
        out[4 * axis] = one;
        (out[4 * j], out[3 * j + k], out[3 * k + j], out[4 * k]) = (c, minus, s, c);
        out
    }

    /// Nodes of a binary operation (`a + b` and others) with at least one operand that is no scalar.
    pub(super) fn binary(&mut self, sign: char, a: &Value, b: &Value) -> Made {
        let both = || format!("{} {sign} {}", a.shape, b.shape);
        let each = |builder: &mut Self, node: fn(usize, usize) -> Node| {
            let pairs: Vec<_> = a.entries.iter().copied().zip(b.entries.iter().copied()).collect();
            pairs.into_iter().map(|(x, y)| builder.node(node(x, y))).collect()
        };
        match sign {
            '+' | '-' if a.shape == b.shape => {
                let node = if sign == '+' { Node::Add } else { Node::Subtract };
                Ok((a.shape, each(self, node)))
            }
            '+' | '-' => Err(Mismatch::new(format!("the same shape on both sides of `{sign}`"), both())),
            '*' => self.product(a, b),
            '/' if b.shape == Shape::SCALAR => {
                let by = b.entries[0];
                Ok((a.shape, a.entries.iter().map(|&x| self.node(Node::Divide(x, by))).collect()))
            }
            '/' => Err(Mismatch::new("a scalar behind `/`", b.shape)),
            _ => Err(Mismatch::new("scalars on both sides of `^`", both())),
        }
    }

    fn product(&mut self, a: &Value, b: &Value) -> Made {
        for (k, v) in [(a, b), (b, a)] {
            if k.shape == Shape::SCALAR {
                let k = k.entries[0];
                return Ok((v.shape, v.entries.iter().map(|&x| self.node(Node::Multiply(k, x))).collect()));
            }
        }
        let (n, inner, m) = (a.shape.rows, a.shape.columns, b.shape.columns);
        if inner != b.shape.rows {
            let vectors = a.shape.columns == 1 && b.shape.columns == 1;
            let expected = match vectors {
                true => "dot(a, b), cross(a, b), or a matrix before `*`".to_string(),
                false => format!("{inner} rows behind `*`"),
            };
            return Err(Mismatch::new(expected, format!("{} * {}", a.shape, b.shape)));
        }
        self.bounded(2 * n * m * inner)?;
        let mut out = Vec::with_capacity(n * m);
        for i in 0..n {
            for j in 0..m {
                let column: Vec<usize> = (0..inner).map(|k| b.entries[k * m + j]).collect();
                out.push(self.dot(&a.entries[i * inner..(i + 1) * inner], &column));
            }
        }
        Ok((Shape { rows: n, columns: m }, out))
    }

    /// Refuses an expression that would exceed the largest number of operations.
    fn bounded(&self, more: usize) -> Result<(), Mismatch> {
        let total = self.expression.nodes.len().saturating_add(more);
        match total <= MAX_OPERATIONS {
            true => Ok(()),
            false => Err(Mismatch::new(
                format!("at most {MAX_OPERATIONS} operations on components"),
                format!("{total}"),
            )),
        }
    }

    pub(super) fn negative(&mut self, a: &Value) -> Vec<usize> {
        a.entries.iter().map(|&x| self.node(Node::Negate(x))).collect()
    }
}

/// Shape of a list of values with these shapes: a vector of scalars, or a matrix whose rows are vectors of
/// one length.
///
/// # Errors
/// Expected and given shapes.
pub(crate) fn stacked(shapes: &[Shape]) -> Result<Shape, Mismatch> {
    let expected = "scalars, or rows of one length, in a list";
    let Some(&first) = shapes.first() else { return Err(Mismatch::new(expected, "nothing")) };
    if let Some(other) = shapes.iter().find(|&&s| s != first) {
        return Err(Mismatch::new(expected, format!("{first} and {other}")));
    }
    let shape = match first {
        Shape::SCALAR => Shape::vector(shapes.len()),
        Shape { rows, columns: 1 } => Shape { rows: shapes.len(), columns: rows },
        matrix => return Err(Mismatch::new(expected, matrix)),
    };
    match shape.entries() <= MAX_ENTRIES {
        true => Ok(shape),
        false => Err(Mismatch::new(format!("at most {MAX_ENTRIES} entries"), shape)),
    }
}

/// Value of a list `[a, b, c]`.
pub(super) fn list(parts: &[Value]) -> Made {
    let shape = stacked(&parts.iter().map(|p| p.shape).collect::<Vec<_>>())?;
    Ok((shape, parts.iter().flat_map(|p| p.entries.iter().copied()).collect()))
}

/// The entry of a vector (`[i]`) or matrix (`[i,j]`), counted from 1.
pub(super) fn entry(of: &Value, index: &[usize]) -> Result<usize, Mismatch> {
    let Shape { rows, columns } = of.shape;
    let bad = |expected: String| {
        let index: Vec<String> = index.iter().map(ToString::to_string).collect();
        Mismatch::new(expected, format!("[{}] of {}", index.join(","), of.shape))
    };
    let inside = |i: usize, n: usize| (1..=n).contains(&i);
    match (of.shape, index) {
        (Shape::SCALAR, _) => Err(bad("a vector or matrix before `[`".into())),
        (Shape { columns: 1, .. }, &[i]) if inside(i, rows) => Ok(of.entries[i - 1]),
        (Shape { columns: 1, .. }, _) => Err(bad(format!("an index from 1 to {rows}"))),
        (_, &[i, j]) if inside(i, rows) && inside(j, columns) => Ok(of.entries[(i - 1) * columns + j - 1]),
        _ => Err(bad(format!("a row from 1 to {rows} and a column from 1 to {columns}, as in [1,2]"))),
    }
}

/// The expression of node `root` alone, with the nodes that it uses.
pub(crate) fn component(e: &Expression, root: usize) -> Expression {
    // operands stand before the operations that use them
    let mut used = vec![false; root + 1];
    used[root] = true;
    for i in (0..=root).rev() {
        if used[i] {
            e.nodes[i].with(&mut |a| {
                used[a] = true;
                a
            });
        }
    }
    let used: Vec<usize> = (0..=root).filter(|&i| used[i]).collect();
    let mut place = vec![0; root + 1];
    for (k, &i) in used.iter().enumerate() {
        place[i] = k;
    }
    Expression {
        nodes: used.iter().map(|&i| e.nodes[i].with(&mut |a| place[a])).collect(),
        spans: used.iter().map(|&i| e.spans[i].clone()).collect(),
    }
}

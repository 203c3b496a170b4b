//! Derivative rows of the platform: `R_ik = H F^k S_i` with the local chain shared by all positions.

use obsdeg_exact::{Echelon, Field};

use super::rows::DerivativeRows;
use crate::model::platform::{
    FieldSample, LOCAL, Observed, PSI_EPS, Platform, PositionBlock, local_dynamics, local_output,
};

/// A row of the local chain: `Z_component^(order)` as a functional of the local unknowns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LocalRow {
    /// Component of Z in n: 1, 2 or 3, or the azimuth.
    pub component: usize,
    /// Derivative order.
    pub order: usize,
    /// Coefficients of the local unknowns (shape 9).
    pub row: [u64; LOCAL],
}

/// Rows of `H F^k` that raise the rank of one position, order by order until the rank stalls. Since
/// `V_{k+1} = V_k + V_k F`, only the new rows of order k need a derivative.
pub fn local_chain(field: &Field, w_n: u64, w_u: u64, observed: Observed) -> Vec<LocalRow> {
    chain_of(field, [w_n, w_u], local_output(field, observed), observed.locals())
}

/// Local chain of any outputs (component and row), over the first `locals` local unknowns.
pub(crate) fn chain_of(
    field: &Field,
    [w_n, w_u]: [u64; 2],
    outputs: Vec<(usize, [u64; LOCAL])>,
    locals: usize,
) -> Vec<LocalRow> {
    let f = local_dynamics(field, &w_n, &w_u);
    let mut basis = Echelon::new(*field, locals);
    let mut chain: Vec<LocalRow> = Vec::new();
    let mut candidates: Vec<LocalRow> =
        outputs.into_iter().map(|(component, row)| LocalRow { component, order: 0, row }).collect();
    while !candidates.is_empty() {
        candidates.retain(|r| basis.insert(&r.row[..locals]));
        chain.extend_from_slice(&candidates);
        for r in &mut candidates {
            let old = r.row;
            r.row = [0; LOCAL];
            // only psi^n moves
            for (j, x) in r.row[..PSI_EPS].iter_mut().enumerate() {
                *x = field.dot(0, (0..3).map(|i| (old[i], f[i][j])));
            }
            r.order += 1;
        }
    }
    chain
}

/// The platform as a source of derivative rows.
#[derive(Debug, Clone)]
pub struct PlatformRows {
    field: Field,
    columns: usize,
    chain: Vec<LocalRow>,
    blocks: Vec<PositionBlock<u64>>,
    /// True if turns leave torquer errors in psi^n; `None` if the unknowns are the local ones.
    apart: Option<bool>,
    scratch: Vec<u64>,
}

impl PlatformRows {
    /// The rows of `platform` at `sample`.
    pub fn new(platform: &Platform, sample: &FieldSample) -> Self {
        let p = &sample.point;
        Self {
            field: p.ring,
            columns: platform.names().len(),
            chain: local_chain(&p.ring, p.w_n, p.w_u, platform.observed()),
            blocks: platform.blocks(p),
            apart: (platform.coefficients() > 0).then_some(!p.turns.is_empty()),
            scratch: vec![0; platform.names().len()],
        }
    }
}

impl PlatformRows {
    /// Station and component of every row of an order, in the order of [`emit`](DerivativeRows::emit).
    pub(crate) fn labels(&self, order: usize) -> Vec<(usize, usize)> {
        let chain = || self.chain.iter().filter(|r| r.order == order);
        (0..self.blocks.len()).flat_map(|i| chain().map(move |r| (i, r.component))).collect()
    }
}

impl DerivativeRows for PlatformRows {
    type Field = Field;

    fn field(&self) -> Field {
        self.field
    }

    fn columns(&self) -> usize {
        self.columns
    }

    fn emit(&mut self, order: usize, sink: &mut dyn FnMut(&[u64]) -> bool) -> bool {
        let f = self.field;
        for block in &self.blocks {
            for local in self.chain.iter().filter(|r| r.order == order) {
                // without unknown accelerometer errors a row has no entries for them
                let mut used = [(0, &block.rows[0][..]); LOCAL];
                let (mut n, mut of_psi) = (0, 0);
                for (i, (x, row)) in local.row.iter().zip(&block.rows).enumerate().filter(|(_, r)| *r.0 != 0)
                {
                    used[n] = (*x, row);
                    n += 1;
                    of_psi += usize::from(i < 3);
                }
                // psi of the scheme enters psi^n alone; coefficients enter it only where torquers act
                let (psi, rest) = match self.apart {
                    Some(torqued) => (&used[..of_psi], &used[if torqued { 0 } else { of_psi }..n]),
                    None => (&used[..n], &used[..n]),
                };
                for (k, &column) in block.columns.iter().enumerate() {
                    let used = if k < 3 { psi } else { rest };
                    self.scratch[column] = f.dot(0, used.iter().map(|(x, row)| (*x, row[k])));
                }
                sink(&self.scratch);
            }
            for &column in &block.columns {
                self.scratch[column] = 0;
            }
        }
        self.chain.iter().any(|r| r.order >= order)
    }
}

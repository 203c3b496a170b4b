//! Observed quantities of a platform.

/// Number of local unknowns of one position, in n: `psi^n`, `eps^n`, then the error of the accelerometers in
/// `Z^n`.
pub const LOCAL: usize = 9;
/// Number of `psi^n` and `eps^n` among the local unknowns; they come first.
pub const PSI_EPS: usize = 6;

/// Observed quantities, which also decide the local unknowns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Observed {
    /// True if `psi_y^n` is measured too.
    pub azimuth: bool,
    /// True if errors of the accelerometers are unknown, so that Z has three components.
    pub accelerometers: bool,
}

impl Observed {
    /// Number of local unknowns in use, the first ones of all.
    pub fn locals(self) -> usize {
        if self.accelerometers { LOCAL } else { PSI_EPS }
    }
}

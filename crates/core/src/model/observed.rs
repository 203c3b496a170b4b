//! What is observed of a platform.

/// The local unknowns of one position, in n: `psi^n`, `eps^n`, then the error of the accelerometers in `Z^n`.
pub const LOCAL: usize = 9;
/// Of these `psi^n` and `eps^n`.
pub const PSI_EPS: usize = 6;

/// What is observed, and which local unknowns there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Observed {
    /// `psi_y^n` is measured too.
    pub azimuth: bool,
    /// Errors of the accelerometers are unknown, so that Z has three components.
    pub accelerometers: bool,
}

impl Observed {
    /// How many local unknowns there are: the first so many.
    pub fn locals(self) -> usize {
        if self.accelerometers { LOCAL } else { PSI_EPS }
    }
}

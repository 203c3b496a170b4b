//! The matrices of the library `obsdeg` against the verdicts: ranks of H F^k S_i by singular values, without
//! the engine.

use nalgebra::DMatrix;
use obsdeg::error::MatricesError;
use obsdeg::{AnalysisOptions, Angle, Carry, Scheme, analyze, earth_rates, platform_matrices, read_scheme};
use obsdeg_ekf::decomposition::singular_values;

fn scheme(angles: &[[i32; 3]], carry: Carry) -> Scheme {
    Scheme { carry, ..Scheme::of_angles(angles.iter().map(|a| a.map(Angle::from_degrees))) }
}

/// Rank of all Z^(k) of orders up to `orders`. Time is in units of 1/w_ie, so that every entry is of order 1.
fn rank(scheme: &Scheme, orders: u32) -> usize {
    let [w_n, w_u] = earth_rates(41.0);
    let w = w_n.hypot(w_u);
    let m = platform_matrices(scheme, [w_n / w, w_u / w]).expect("decimal angles");
    let blocks: Vec<DMatrix<f64>> =
        m.s.iter().flat_map(|s| (0..=orders).map(|k| &m.h * m.f.pow(k) * s).collect::<Vec<_>>()).collect();
    let rows = blocks.iter().map(DMatrix::nrows).sum();
    let mut all = DMatrix::zeros(rows, m.unknowns.len());
    let mut at = 0;
    for b in &blocks {
        all.rows_mut(at, b.nrows()).copy_from(b);
        at += b.nrows();
    }
    let tall = if all.nrows() < all.ncols() { all.transpose() } else { all };
    let (values, _) = singular_values(&tall).expect("finite entries");
    values.iter().filter(|&&v| v > 1e-9).count()
}

#[test]
fn ranks_of_the_matrices_are_those_of_the_engine() {
    let sets: [&[[i32; 3]]; 4] = [
        &[[0, 0, 0], [180, 0, 0]],
        &[[10, 25, 40], [130, -50, 70], [-95, 33, -160]],
        &[[10, 25, 40], [130, -50, 70], [-95, 33, -160], [60, 80, 15], [-20, -70, 110]],
        &[[90, 0, 0]],
    ];
    let options = AnalysisOptions { solutions: false, ..AnalysisOptions::default() };
    for set in sets {
        for carry in Carry::ALL {
            let scheme = scheme(set, carry);
            let answer = analyze(&scheme, options, None).expect("a scheme");
            assert_eq!(rank(&scheme, 6), answer.rank, "{set:?}, {carry}");
        }
    }
}

#[test]
fn shapes_names_and_refusals() {
    let m = platform_matrices(&scheme(&[[0, 0, 0], [180, 0, 0]], Carry::Reset), earth_rates(0.0))
        .expect("a scheme");
    assert_eq!((m.f.shape(), m.h.shape(), m.s.len()), ((6, 6), (2, 6), 2));
    assert!(m.s.iter().all(|s| s.shape() == (6, m.unknowns.len())));
    assert_eq!(
        m.unknowns.iter().filter(|n| n.starts_with("psi_x")).collect::<Vec<_>>(),
        ["psi_x@1", "psi_x@2"]
    );
    // at the equator omega_ie points north: psi_y' contains + wN psi_z, psi_z' contains - wN psi_y, and
    // otherwise only eps
    assert_eq!((m.f[(1, 2)], m.f[(2, 1)], m.f[(0, 2)], m.f[(0, 3)]), (7.292115e-5, -7.292115e-5, 0.0, 1.0));

    let generic = read_scheme("[[position]]\nangles_deg = [\"a\", 0, 0]\nname = 'p'").expect("a scheme");
    let error = platform_matrices(&generic, earth_rates(28.2)).expect_err("an angle without a number");
    assert!(matches!(&error, MatricesError::Generic { position, .. } if position == "p"), "{error}");
}
